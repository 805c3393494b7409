//! Reduction as it is stored for later runs, and its inputs.
//!
//! [`ReductionInputs`] is the model that is reduced,
//! [`PlannedReduction`](super::PlannedReduction) its description. Both [`clear`] the fields that a
//! reduction does not depend on. A new field that only the contact solve reads
//! belongs among those that are cleared: if it is not cleared, the store is asked in vain for
//! reductions that it has. The law of a pair is cleared whole: neither the finite elements nor the
//! reduction read it.

use serde::{Deserialize, Serialize};

use crate::contact::PairLaw;
use crate::description::PathPoint;
use crate::fem::Prestressed;
use crate::model::Model;
use crate::reduced::ReducedModel;
use crate::reduction::{ModalTruncation, Recovery, StuckModes};
use dovetail_numerics::eigen::Modes;

/// Settings of a static state besides the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct StaticOptions {
    pub(super) load_steps: usize,
    pub(super) path: Vec<PathPoint>,
    pub(super) tolerance: f64,
    pub(super) max_iterations: usize,
}

/// One pass of the prestress of the static state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PrestressPass {
    /// Largest change of a normal force since the pass before, relative to the largest one; without
    /// pairs, the change of the first squared stuck frequency. `None` for the first pass, whose
    /// stress is that with all pairs stuck.
    pub change: Option<f64>,
    /// First frequency of the fully stuck assembly, Hz.
    pub stuck_frequency_hz: Option<f64>,
}

/// Estimates and frequencies of the modes of a reduction.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ReductionModes {
    /// Estimated errors by the modes left out.
    pub truncation: ModalTruncation,
    /// Squared angular frequencies of the fixed-interface modes of each body, rad2/s2; empty where
    /// it was not reduced by itself.
    pub fixed_interface_omega2: Vec<Vec<f64>>,
    /// Passes of the prestress by contact; empty where the prestress is another one.
    pub prestress_passes: Vec<PrestressPass>,
    /// Largest relative change of the first stuck frequencies where the stress is that of the
    /// static state with all pairs stuck; `None` where the prestress is not that of the held
    /// flanks, or the bodies do not touch.
    pub held_flanks_error: Option<f64>,
}

/// Reduction as it is stored for later runs.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StoredReduction {
    /// Reduced model on pairs and modes.
    pub reduced: ReducedModel,
    /// Estimates and frequencies of its modes.
    pub modes: ReductionModes,
    /// Displacement of each body that its prestress comes from.
    pub prestressed: Prestressed,
}

/// Inputs of a reduction: the model without what only the contact laws and the size of the
/// excitation use. Where the prestress is that of the static state, the laws count, too.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ReductionInputs {
    model: Model,
    wanted: StuckModes,
    /// Settings of the static state that the prestress comes from.
    statics: Option<StaticOptions>,
    /// Nodal diameter of the waves that the reduced model is of; 0 for sectors in phase.
    nodal_diameter: usize,
}

/// Clears the fields that a reduction does not depend on, of a model or of the description of one:
/// the laws of contacts, unless the prestress depends on the static state, amplitude, phase and
/// harmonic of excitations, and the engine order of a disc, as each wave has a reduction of its own.
pub(super) fn clear<'m>(
    laws: impl Iterator<Item = &'m mut PairLaw>,
    in_time: impl Iterator<Item = (&'m mut f64, &'m mut f64, &'m mut usize)>,
    engine_order: Option<&mut usize>,
    statics: Option<&StaticOptions>,
) {
    if statics.is_none() {
        laws.for_each(|law| *law = PairLaw::rigid(0.0, 0.0));
    }
    for (amplitude, phase_rad, harmonic) in in_time {
        (*amplitude, *phase_rad, *harmonic) = (0.0, 0.0, 0);
    }
    if let Some(engine_order) = engine_order {
        *engine_order = 0;
    }
}

impl ReductionInputs {
    /// Inputs of a reduction of `model`, with `statics` where its prestress is that of the static
    /// state with contact.
    pub(super) fn new(model: &Model, wanted: StuckModes, statics: Option<StaticOptions>) -> Self {
        let mut model = model.clone();
        if let Some(influence) = model.cyclic.as_mut().and_then(|c| c.influence.as_mut()) {
            influence.waves.clear();
            influence.coefficients.clear();
        }
        model.maps.clear();
        model.friction_maps.clear();
        let excitations = model.excitations.iter_mut().map(|e| &mut e.in_time);
        clear(
            model.pairs.iter_mut().map(|pair| &mut pair.law),
            excitations.map(|e| (&mut e.amplitude, &mut e.phase_rad, &mut e.harmonic)),
            model.cyclic.as_mut().map(|c| &mut c.engine_order),
            statics.as_ref(),
        );
        Self {
            model,
            wanted,
            statics,
            nodal_diameter: 0,
        }
    }

    /// Inputs of the reduction of the waves of a nodal diameter of the same model.
    pub(super) fn with_nodal_diameter(self, nodal_diameter: usize) -> Self {
        Self {
            nodal_diameter,
            ..self
        }
    }
}

/// Key of a reduction, and of entries that belong to its model: the hash of its inputs.
pub type ReductionKey = [u8; 32];

/// Place for an entry of one kind under the key of a reduction.
#[derive(Debug)]
pub enum StoreSlot<'p> {
    /// The reduction itself.
    Reduction(&'p mut Option<StoredReduction>),
    /// Recovery of the bodies' motion.
    Recovery(&'p mut Option<Recovery>),
    /// Modes of each body with its contacts held.
    HeldModes(&'p mut Option<Vec<Modes>>),
}

/// Entry that is to be kept under the key of a reduction.
#[derive(Debug, Clone, Copy)]
pub enum StoreEntry<'e> {
    /// The reduction itself, with the recovery of the bodies' motion.
    Reduction(&'e StoredReduction, &'e Recovery),
    /// A recovery by itself.
    Recovery(&'e Recovery),
    /// Modes of each body with its contacts held.
    HeldModes(&'e [Modes]),
}
