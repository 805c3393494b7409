//! Ways to approach the balance of a frequency, and the methods that solve it.

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
    InFrequency,
    /// Steps of the vibrating part of the load from the static state.
    InForce,
    /// Rounded laws ([`crate::dlft::rounded`]), sharper and sharper, from the neighbour or from the
    /// static state.
    InSharpness,
    /// Start from the static state with coefficients of friction that grow. Each start lies on the
    /// straight line in 1 / mu through the last two solutions.
    InFriction,
}

impl Strategy {
    /// Returns `true` if no balances are solved on the way.
    pub(super) fn is_direct(self) -> bool {
        matches!(self, Self::FromNeighbour(_) | Self::FromRest(_))
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Method {
    /// Newton-GMRES.
    Krylov,
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
            Self::InFrequency => f.write_str("from the neighbour in steps of frequency"),
            Self::InForce => f.write_str("from the static state in steps of force"),
            Self::InSharpness => f.write_str("with rounded contact laws"),
            Self::InFriction => f.write_str("with growing coefficients of friction"),
        }
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Krylov | Self::Exact => "",
            Self::Dogleg => " by the dogleg",
        })
    }
}
