//! [`Structure`](crate::fem::Structure) -> [`ReducedModel`]: Craig-Bampton per body, then relative
//! displacements of the pairs and modes of the stuck assembly.

pub mod craig_bampton;
pub mod damping;
mod joined;
mod matrix_market;
pub mod relative;
pub mod superelement;

#[cfg(test)]
mod lattice_model;

use faer::Mat;

use serde::{Deserialize, Serialize};

use crate::fem::Structure;
use crate::model::{ContactPair, Excitation, Model};
use dovetail_numerics::eigen::EigenError;
use dovetail_numerics::factor::FactorError;
use dovetail_numerics::stored;

pub use craig_bampton::ReducedBody;
pub use relative::Recovery;

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
    if model.pairs.len() + model.bonded.len() > JOINED_ABOVE_PAIRS {
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
    joined::join(model, structure, stuck_modes)
}

/// The assembly as the contact solver sees it, and the way back to the bodies.
#[derive(Debug, Clone)]
pub struct ReducedModel {
    pub relative: RelativeModel,
    /// One newton of each excitation of the model.
    pub unit_loads: Vec<Load>,
    /// Number of stuck modes there are; `relative` may keep fewer.
    pub all_stuck_modes: usize,
    /// Per body; none where the bodies were condensed together.
    pub fixed_interface_omega2: Vec<Vec<f64>>,
    pub recovery: Recovery,
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
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RelativeModel {
    /// Static stiffness on X, N/m, n x n.
    #[serde(with = "stored::matrix")]
    pub stiffness: Mat<f64>,
    /// Mass on X with the rest following statically, kg, n x n.
    #[serde(with = "stored::matrix")]
    pub mass: Mat<f64>,
    /// p: mass coupling of X to the stuck modes (mass-normalised), n x m.
    #[serde(with = "stored::matrix")]
    pub coupling: Mat<f64>,
    /// Squared angular frequencies of the stuck modes, rad2/s2, ascending, m.
    pub omega2: Vec<f64>,
    /// Static (centrifugal) load on X and on the modes.
    pub static_load: Load,
    /// Harmonic loads, by harmonic; several of one harmonic are already added.
    #[serde(skip)]
    pub excitations: Vec<HarmonicLoad>,
    pub observations: Vec<Probe>,
    /// One entry per pair.
    #[serde(skip)]
    pub pairs: Vec<PairLaw>,
}

impl RelativeModel {
    /// Own static stiffness of each relative displacement, N/m: K_NN of a pair, and the mean of its two tangential diagonals for both.
    pub fn own_stiffness(&self) -> Vec<f64> {
        let own = |i: usize| self.stiffness[(i, i)];
        (0..self.pairs.len())
            .flat_map(|p| {
                let tangential = 0.5 * (own(3 * p + 1) + own(3 * p + 2));
                [own(3 * p), tangential, tangential]
            })
            .collect()
    }

    /// Highest harmonic of the excitations; 0 without any.
    pub fn highest_excited(&self) -> usize {
        let excited = self.excitations.iter().map(|e| e.harmonic);
        excited.max().unwrap_or(0)
    }

    /// With the laws of the model's pairs, and excited as the model says; `unit_loads` as in [`ReducedModel`].
    pub fn under(mut self, model: &Model, unit_loads: &[Load]) -> Self {
        let law = |pair: &ContactPair| PairLaw {
            friction: pair.friction,
            gap_m: pair.gap_m,
        };
        self.pairs = model.pairs.iter().map(law).collect();
        self.excitations = excited(&model.excitations, unit_loads);
        self
    }

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

/// Loads by harmonic, ascending; forces of one harmonic are added.
fn excited(forces: &[Excitation], unit_loads: &[Load]) -> Vec<HarmonicLoad> {
    let mut harmonics: Vec<usize> = forces.iter().map(|f| f.harmonic).collect();
    harmonics.sort_unstable();
    harmonics.dedup();
    let load = |harmonic: usize, share: fn(f64) -> f64| {
        let mut sum: Option<Load> = None;
        let of_harmonic = forces.iter().zip(unit_loads);
        for (force, unit) in of_harmonic.filter(|(f, _)| f.harmonic == harmonic) {
            let amplitude_n = force.force_n * share(force.phase_rad);
            let zero = || Load {
                on_x: vec![0.0; unit.on_x.len()],
                on_modes: vec![0.0; unit.on_modes.len()],
            };
            let sum = sum.get_or_insert_with(zero);
            let into = sum.on_x.iter_mut().chain(&mut sum.on_modes);
            for (into, unit) in into.zip(unit.on_x.iter().chain(&unit.on_modes)) {
                *into += amplitude_n * unit;
            }
        }
        sum
    };
    let both = |harmonic| {
        Some(HarmonicLoad {
            harmonic,
            cosine: load(harmonic, f64::cos)?,
            sine: load(harmonic, f64::sin)?,
        })
    };
    harmonics.into_iter().filter_map(both).collect()
}

/// A load on X (n) and on the stuck modes (m).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

impl PairLaw {
    /// A coefficient of friction above this is computed as this. A pair then sticks as long as it is
    /// pressed, which a larger one does not change (1e3 and 1e4 give the same peak to 1e-5), but
    /// friction is known to the coefficient times the rounding of the normal force only.
    pub const MOST_FRICTION: f64 = 1e3;

    /// The coefficient of friction that is computed with.
    pub fn computed_friction(&self) -> f64 {
        self.friction.min(Self::MOST_FRICTION)
    }
}
