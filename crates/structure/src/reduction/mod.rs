//! Reduction of a [`Structure`](crate::structure::Structure) to a [`Reduction`]: the bodies joined
//! by their contacts, on the relative displacements X of the pairs and the amplitudes q of the
//! modes of the stuck assembly (X = 0), a Craig-Bampton reduction of the assembly with X for its
//! interface (AIAA J. 6 (1968) 1313-1319).
//!
//! The coordinates of all bodies are u = T (g, X) (`transformation.rs`), and g = Psi X + Phi q,
//! which leads to the equations of a [`ReducedModel`] (`assembly.rs`). Residual vectors follow the
//! modes (`residual.rs`), the modes that are left out have an estimate (`truncation.rs`), and the
//! motion of the bodies is recovered (`recovery.rs`). Meshes and elements are not known here: the
//! matrices may come from another program.
//!
//! The signs are those of [`dovetail_dynamics::contact`]. Folders of reduced models (`superelement.rs`) hold
//! the matrices for other programs: their layout and the order of their entries stay as they are.

mod assembly;
pub mod craig_bampton;
pub(crate) mod recovery;
mod residual;
mod restiffened;
pub mod sectors;
pub(crate) mod transformation;
mod truncation;

use serde::Serialize;

use dovetail_dynamics::reduced::ReducedModel;
use dovetail_numerics::eigen::EigenError;
use dovetail_numerics::sparse::FactorError;

pub use assembly::{
    analyse, reduce, reduce_analysed, stuck_displacement, stuck_modes, stuck_shapes,
};
pub use recovery::Recovery;
pub(crate) use residual::ResidualError;
pub use restiffened::frequency_change;
pub use truncation::ModalTruncation;

/// Number of modes of a kind that are listed, and whose errors are estimated.
pub const LISTED_MODES: usize = 6;

/// Number of stuck modes that a reduction keeps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StuckModes {
    /// Number of modes. `None`: those below four times the highest frequencies, at least
    /// [`StuckModes::LEAST`], and more where the estimated error of amplitudes of the linear curve
    /// requires them.
    pub count: Option<usize>,
    /// Highest frequency that is excited.
    pub excited: Highest,
    /// Highest frequency of a harmonic that is kept. It requires no more than
    /// [`StuckModes::OF_HARMONICS`].
    pub kept: Highest,
}

impl StuckModes {
    /// Modes for a response whose harmonics are all excited, up to the frequency `highest`.
    ///
    /// ```
    /// use dovetail_structure::reduction::{Highest, StuckModes};
    ///
    /// let automatic = StuckModes::new(None, Highest::OfFirstStuckMode(2.0));
    /// assert_eq!(automatic.kept, automatic.excited);
    /// ```
    pub const fn new(count: Option<usize>, highest: Highest) -> Self {
        Self {
            count,
            excited: highest,
            kept: highest,
        }
    }

    /// Least number kept where no number is given.
    pub const LEAST: usize = 12;
    /// Most modes that harmonics above the excited ones require.
    pub const OF_HARMONICS: usize = 48;
}

/// Highest frequency of a response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Highest {
    /// Angular frequency, rad/s.
    RadS(f64),
    /// Multiple of the first stuck frequency. The first frequency with open pairs released is never
    /// above that one.
    OfFirstStuckMode(f64),
}

impl Highest {
    /// Rounds up to the next power of the square root of two, so that ranges which hardly differ
    /// lead to the same reduction.
    pub fn rounded_up(self) -> Self {
        let up = |x: f64| {
            if x > 0.0 && x.is_finite() {
                (0.5 * (2.0 * x.log2()).ceil()).exp2()
            } else {
                x
            }
        };
        match self {
            Self::RadS(x) => Self::RadS(up(x)),
            Self::OfFirstStuckMode(x) => Self::OfFirstStuckMode(up(x)),
        }
    }

    /// Multiple of this frequency.
    pub fn times(self, factor: f64) -> Self {
        match self {
            Self::RadS(x) => Self::RadS(factor * x),
            Self::OfFirstStuckMode(x) => Self::OfFirstStuckMode(factor * x),
        }
    }

    fn rad_s(self, omega2: &[f64]) -> f64 {
        match self {
            Self::RadS(x) => x,
            Self::OfFirstStuckMode(x) => x * omega2.first().map_or(0.0, |w2| w2.sqrt()),
        }
    }
}

/// Reduced model of an assembly, estimates of its errors, and the recovery of the bodies.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Reduction {
    /// Assembly on the relative displacements of its pairs and on its stuck modes.
    pub model: ReducedModel,
    /// Estimated errors by the modes left out.
    pub truncation: ModalTruncation,
    /// Squared angular frequencies of the fixed-interface modes of each body, rad2/s2; empty for a
    /// body that was not reduced by itself.
    pub fixed_interface_omega2: Vec<Vec<f64>>,
    /// Recovery of the motion of the bodies.
    pub recovery: Recovery,
}

/// Error of an assembly that was not reduced.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum ReductionError {
    #[error("body `{body}`: {what} has {found} rows, its stiffness {expected}")]
    Size {
        body: String,
        what: &'static str,
        expected: usize,
        found: usize,
    },
    #[error(
        "body `{body}`: around node {node} nothing holds it, even with its contacts held: give the body a support, a spring or a contact; if it has one, its mesh falls apart there: check that the volume is connected"
    )]
    InteriorNotHeld { body: String, node: u64 },
    #[error(
        "body `{body}`: its stiffness is not positive (at node {node}) even with its contacts held; it flies apart or buckles at this speed: lower the speed or check the material and the units"
    )]
    InteriorUnstable { body: String, node: u64 },
    #[error("body `{body}`: its stiffness cannot be factored")]
    Factor { body: String, source: FactorError },
    #[error("body `{body}`: its fixed-interface modes were not found")]
    Eigen { body: String, source: EigenError },
    #[error(
        "node {node} of body `{body}` is joined to another body, but it is none of the last nodes of its matrices, which are the interface"
    )]
    NotOfInterface { body: String, node: u64 },
    #[error(
        "node {node} of body `{body}` follows the flanks of two contacts: let the other flank of one of them follow (its key `slave`)"
    )]
    SlaveTwice { body: String, node: u64 },
    #[error(
        "contacts go round in a circle: each node follows another one; let the other flank of one of them follow (its key `slave`)"
    )]
    Circle,
    #[error(
        "with all pairs stuck nothing holds body `{body}` (at node {node}), or it is unstable at this speed: it needs a support, a spring, a contact with what is held, or a speed that it stands"
    )]
    NotHeld { body: String, node: u64 },
    #[error("the stiffness of the assembly cannot be factored")]
    Assembly { source: FactorError },
    #[error("the modes of the stuck assembly were not found")]
    Stuck { source: EigenError },
    #[error(
        "the residual vectors of the loads and observed points of {part} were not found; check the loads, the units and metres_per_unit"
    )]
    Residual {
        /// Name of the stuck assembly, or of a body that is reduced by itself.
        part: String,
        source: ResidualError,
    },
}
