//! Ways to approach the balance of a frequency, and the methods that solve it.

use crate::dlft::newton_krylov::LOOSE_KRYLOV_TOLERANCE;
use crate::dlft::settings::Solver;

/// Way to approach a balance.
#[derive(Debug, Clone, Copy)]
pub(super) enum Strategy {
    /// Start from the neighbour, as it is and continued.
    FromNeighbour(Method),
    /// Start from the vibration with frozen contacts ([`crate::dlft::frozen`]), where no condition of
    /// contact is violated.
    Frozen(Method),
    /// Start from the static state without vibration.
    FromRest(Method),
    /// Steps in frequency from the neighbour.
    InFrequency(u32),
    /// Steps of the vibrating part of the load from the static state.
    InForce(u32),
    /// Start from the static state with rounded laws ([`crate::dlft::rounded`]); each solution is the
    /// start of the next sharper one.
    InSharpness,
    /// Start from the static state with coefficients of friction that grow. Each start lies on the
    /// straight line in 1 / mu through the last two solutions.
    InFriction(GrowingFriction),
}

/// Coefficients of friction that are at most `from` first, then `growth` times that, or less, and
/// so on.
#[derive(Debug, Clone, Copy)]
pub(super) struct GrowingFriction {
    pub(super) from: f64,
    pub(super) growth: f64,
}

impl Strategy {
    /// Returns `true` if no balances are solved on the way, by the methods that `solver` begins with.
    pub(super) fn is_direct(self, solver: Solver) -> bool {
        match self {
            Self::FromNeighbour(method) | Self::FromRest(method) => {
                solver == Solver::Powell || !matches!(method, Method::Dogleg)
            }
            _ => false,
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Method {
    /// Newton-GMRES with this relative residual of the linear solves.
    Krylov(f64),
    /// Newton's method with the Jacobian factored.
    Exact,
    /// Powell's hybrid method.
    Dogleg,
}

impl std::fmt::Display for Strategy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::FromNeighbour(method) => write!(f, "from the neighbour{method}"),
            Self::Frozen(method) => write!(f, "with frozen contacts{method}"),
            Self::FromRest(method) => write!(f, "from the static state{method}"),
            Self::InFrequency(steps) => {
                write!(f, "from the neighbour in {steps} steps of frequency")
            }
            Self::InForce(steps) => write!(f, "from the static state in {steps} steps of force"),
            Self::InSharpness => f.write_str("with rounded contact laws"),
            Self::InFriction(GrowingFriction { from, .. }) => {
                write!(f, "along friction that grows from a coefficient of {from}")
            }
        }
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Krylov(tolerance) if *tolerance < LOOSE_KRYLOV_TOLERANCE => "",
            Self::Krylov(_) => " with loose linear solves",
            Self::Exact => "",
            Self::Dogleg => " by the dogleg",
        })
    }
}
