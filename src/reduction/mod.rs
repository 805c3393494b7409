//! [`Structure`](crate::fem::Structure) -> [`ReducedModel`]: Craig-Bampton per body, then relative
//! displacements of the pairs and modes of the stuck assembly.

pub mod craig_bampton;
pub mod damping;
mod joined;
pub mod relative;
pub mod superelement;

#[cfg(test)]
mod lattice_model;

use faer::Mat;

use crate::fem::Structure;
use crate::model::Model;
use crate::numerics::eigen::EigenError;
use crate::numerics::factor::FactorError;

pub use craig_bampton::ReducedBody;
pub use relative::ReducedModel;

/// More pairs than this, and the bodies are condensed together ([`reduce_joined`]).
pub const JOINED_ABOVE_PAIRS: usize = 400;
/// Stuck modes kept then, if the scene does not say.
pub const JOINED_STUCK_MODES: usize = 30;

/// Up to [`JOINED_ABOVE_PAIRS`] both bodies by Craig-Bampton, side by side, then on relative
/// displacements with the `stuck_modes` lowest stuck modes (`None`: all of them, exact). Above,
/// [`reduce_joined`] with `stuck_modes` or [`JOINED_STUCK_MODES`]: the dense matrices of both flanks
/// would cost more than all else.
///
/// # Errors
/// See [`ReductionError`].
pub fn reduce(
    model: &Model,
    structure: &Structure,
    stuck_modes: Option<usize>,
) -> Result<ReducedModel, ReductionError> {
    if model.pairs.len() > JOINED_ABOVE_PAIRS {
        return reduce_joined(model, structure, stuck_modes.unwrap_or(JOINED_STUCK_MODES));
    }
    let condense = |b: usize| craig_bampton::condense(&model.bodies[b], &structure.bodies[b]);
    let (first, second) = rayon::join(|| condense(0), || condense(1));
    relative::relative(model, [first?, second?], stuck_modes)
}

/// Both bodies at once, from the sparse matrices of the assembly to X and its `stuck_modes` lowest
/// stuck modes: no fixed-interface modes of the bodies (`Body::fixed_interface_modes` is not read).
///
/// # Errors
/// See [`ReductionError`].
pub fn reduce_joined(
    model: &Model,
    structure: &Structure,
    stuck_modes: usize,
) -> Result<ReducedModel, ReductionError> {
    let (relative, all_stuck_modes, joined) = joined::join(model, structure, stuck_modes)?;
    Ok(ReducedModel {
        bodies: Vec::new(),
        relative,
        all_stuck_modes,
        recovery: relative::Recovery::Joined(joined),
    })
}

#[derive(Debug, thiserror::Error)]
pub enum ReductionError {
    #[error(
        "body `{body}`: its matrices have {found} rows, its mesh {expected} free degrees of freedom"
    )]
    Size {
        body: String,
        expected: usize,
        found: usize,
    },
    #[error(
        "body `{body}`: around node {node} nothing holds it, even with its flanks and observed points held; the mesh falls apart there: check that the volume is one connected piece"
    )]
    InteriorNotHeld { body: String, node: u64 },
    #[error(
        "body `{body}`: its stiffness is not positive (at node {node}) even with its flanks and observed points held; it flies apart or buckles at this speed: lower the speed or check the material and the units"
    )]
    InteriorUnstable { body: String, node: u64 },
    #[error("body `{body}`: its stiffness cannot be factored")]
    Factor { body: String, source: FactorError },
    #[error("body `{body}`: its fixed-interface modes were not found")]
    Eigen { body: String, source: EigenError },
    #[error(
        "body `{body}` has {flank_nodes} flank nodes for {pairs} contact pairs: a node of a pair must be free and belong to one pair"
    )]
    FlankMismatch {
        body: String,
        flank_nodes: usize,
        pairs: usize,
    },
    #[error(
        "{what}: node {node} of body `{body}` was condensed; nodes of excitations and observations must be kept nodes of the model"
    )]
    PointCondensed {
        what: String,
        body: String,
        node: u64,
    },
    #[error(
        "with all pairs stuck nothing holds the assembly, or it is unstable at this speed: body `{body}` needs fixed groups (key `fixed` of the body), and the speed must be one it stands"
    )]
    NotHeld { body: String },
    #[error("the modes of the stuck assembly were not found")]
    Stuck { source: EigenError },
}

/// What the contact solver sees: the assembly on the relative displacements X of the pairs
/// (n = 3 pairs unknowns, per pair N, t1, t2) and on the modes of the stuck assembly (X = 0).
///
/// With q the modal amplitudes: `K X + M X'' + p q'' + lambda = F`, `q'' + w^2 q + p^T X'' = fm`
/// (Rayleigh damping `a K + b M` alongside).
#[derive(Debug, Clone)]
pub struct RelativeModel {
    /// Static stiffness on X, N/m, n x n.
    pub stiffness: Mat<f64>,
    /// Mass on X with the rest following statically, kg, n x n.
    pub mass: Mat<f64>,
    /// p: mass coupling of X to the stuck modes (mass-normalised), n x m.
    pub coupling: Mat<f64>,
    /// Squared angular frequencies of the stuck modes, rad2/s2, ascending, m.
    pub omega2: Vec<f64>,
    /// Static (centrifugal) load on X and on the modes.
    pub static_load: Load,
    /// Harmonic loads, by harmonic; several of one harmonic are already added.
    pub excitations: Vec<HarmonicLoad>,
    pub observations: Vec<Probe>,
    /// One entry per pair.
    pub pairs: Vec<PairLaw>,
}

impl RelativeModel {
    /// The model with the `modes` lowest stuck modes only.
    pub fn with_modes(mut self, modes: usize) -> Self {
        let kept = modes.min(self.omega2.len());
        self.coupling = self.coupling.subcols(0, kept).to_owned();
        self.omega2.truncate(kept);
        self.static_load.on_modes.truncate(kept);
        for excitation in &mut self.excitations {
            excitation.cosine.on_modes.truncate(kept);
            excitation.sine.on_modes.truncate(kept);
        }
        for probe in &mut self.observations {
            probe.on_modes.truncate(kept);
        }
        self
    }
}

/// A load on X (n) and on the stuck modes (m).
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    pub on_x: Vec<f64>,
    pub on_modes: Vec<f64>,
}

/// `cosine cos(k w t) + sine sin(k w t)`, k = `harmonic`.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicLoad {
    pub harmonic: usize,
    pub cosine: Load,
    pub sine: Load,
}

/// An observed displacement `on_x . X + on_modes . q`.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    pub name: String,
    pub on_x: Vec<f64>,
    pub on_modes: Vec<f64>,
}

/// What the contact law needs of one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairLaw {
    pub friction: f64,
    /// Initial clearance, m.
    pub gap_m: f64,
}
