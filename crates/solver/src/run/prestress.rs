//! Prestress of an assembly. That of the static state with contact depends on the reduced model
//! itself: both are computed repeatedly until the normal forces no longer change. The first pass
//! takes the stress of the static state with all pairs stuck, which one linear system gives.

use std::sync::Arc;

use nalgebra_sparse::CscMatrix;

use super::bodies::problem;
use super::error::Error;
use super::kept::{PrestressPass, ReductionModes, StoredReduction};
use super::session::{Event, Session, Stage, StageGuard};
use super::statics::static_state;
use crate::description::Scene;
use crate::dlft::StaticState;
use crate::fem::statics::{prestressing, solve_by_cholesky};
use crate::fem::{
    self, FemError, NodeDisplacements, Prestressed, assemble_stressed, expand_to_nodes,
    geometric_stiffness,
};
use crate::model::{BodyPrestress, Model};
use crate::problem::Problem;
use crate::reduction::{
    self, ModalTruncation, Recovery, Reduction, StuckModes, frequency_change, stuck_displacement,
};
use crate::results::modes::hertz;
use crate::structure::{BodyMatrices, Joint, Structure};
use dovetail_numerics::sparse::Symbolic;

/// Largest number of passes.
const MOST_PASSES: usize = 20;
/// Largest change of a normal force, relative to the largest one, that counts as none.
const STILL: f64 = 1e-3;

/// Reduction with the prestress that its model asks for.
pub(super) struct PrestressedReduction {
    /// Matrices of the bodies of a sector, of which waves are reduced later; `None` for others, which
    /// the reduction drops.
    pub structure: Option<Structure>,
    pub reduction: StoredReduction,
    pub recovery: Recovery,
}

/// Returns `true` if the prestress of a model is that of its static state.
pub(super) fn is_of_contact(model: &Model) -> bool {
    let rotation = model.rotation.as_ref();
    rotation.is_some_and(|r| r.prestress_of_contact)
}

/// Returns `true` if a model asks for a prestress.
fn is_stressed(model: &Model) -> bool {
    let rotation = model.rotation.as_ref();
    let of_bodies = rotation.is_some_and(|r| r.prestress != BodyPrestress::None);
    of_bodies || is_of_contact(model)
}

/// Reduces a model with the prestress that it asks for.
///
/// # Errors
/// The errors of the finite elements and of the reduction; [`Error::Prestress`] where the normal
/// forces do not converge.
pub(super) fn settle(
    model: &Model,
    wanted: StuckModes,
    scene: &Scene,
    session: &Session<'_>,
) -> Result<PrestressedReduction, Error> {
    let (structure, mut prestressed, analysis) = assemble(model, session)?;
    let analysis = analysis.as_ref();
    let reduced = |structure: Structure| -> Result<(Reduction, Option<Structure>), Error> {
        if model.cyclic.is_some() {
            let reduction = reduction::reduce_analysed(&structure, wanted, analysis)?;
            return Ok((reduction, Some(structure)));
        }
        let reduction = reduction::reduce_analysed(structure, wanted, analysis)?;
        Ok((reduction, None))
    };
    let (reduction, mut structure, held_flanks_error) = {
        let _stage = reduction_stage(model, session);
        let (reduction, structure) = reduced(structure)?;
        let error = held_flanks_error(model, &prestressed, &reduction)?;
        (reduction, structure, error)
    };
    let (mut pass, mut recovery) = Pass::split(reduction, model);
    let mut passes = Vec::new();
    if is_of_contact(model) {
        let mut state = static_state(scene, &pass.problem, session);
        pass.record_pass(None, &mut passes, session)?;
        // Without a state there is nothing to continue from; the run reports the reason, by the
        // state of this model.
        while state.outcome.is_converged() {
            let change = passes.last().and_then(|pass: &PrestressPass| pass.change);
            match change {
                Some(change) if change < STILL => break,
                Some(change) if passes.len() >= MOST_PASSES => {
                    let passes = passes.len();
                    return Err(Error::Prestress { passes, change });
                }
                _ => {}
            }
            let displacements = node_displacements(model, &recovery.full_static(&state.x));
            prestressed = displacements.into_iter().map(Some).collect();
            let stressed = stressed(model, &prestressed, session)?;
            let before = (state, pass.first_omega2());
            let reduction;
            (reduction, structure) = {
                let _stage = reduction_stage(model, session);
                reduced(stressed)?
            };
            (pass, recovery) = Pass::split(reduction, model);
            state = static_state(scene, &pass.problem, session);
            let change = if state.status.is_empty() {
                relative(before.1, pass.first_omega2())
            } else {
                change_of_normal_forces(&before.0, &state)
            };
            pass.record_pass(Some(change), &mut passes, session)?;
        }
    }
    Ok(PrestressedReduction {
        structure,
        reduction: StoredReduction {
            reduced: Arc::unwrap_or_clone(pass.problem.reduced),
            modes: ReductionModes {
                truncation: pass.truncation,
                fixed_interface_omega2: pass.fixed_interface_omega2,
                prestress_passes: passes,
                held_flanks_error,
            },
            prestressed,
        },
        recovery,
    })
}

/// Reduced model of one pass with its laws, and the estimates of its modes.
struct Pass {
    problem: Problem,
    truncation: ModalTruncation,
    fixed_interface_omega2: Vec<Vec<f64>>,
}

impl Pass {
    /// Splits a reduction into the pass and its recovery.
    fn split(reduction: Reduction, model: &Model) -> (Self, Recovery) {
        let Reduction {
            model: reduced,
            truncation,
            fixed_interface_omega2,
            recovery,
            ..
        } = reduction;
        let pass = Self {
            problem: problem(reduced, model),
            truncation,
            fixed_interface_omega2,
        };
        (pass, recovery)
    }

    fn first_omega2(&self) -> Option<f64> {
        self.problem.reduced.omega2.first().copied()
    }

    fn record_pass(
        &self,
        change: Option<f64>,
        passes: &mut Vec<PrestressPass>,
        session: &Session<'_>,
    ) -> Result<(), Error> {
        let pass = PrestressPass {
            change,
            stuck_frequency_hz: self.first_omega2().map(hertz),
        };
        let number = passes.len() + 1;
        session.report(&Event::PrestressPass {
            number,
            pass: &pass,
        })?;
        passes.push(pass);
        Ok(())
    }
}

/// Matrices with the stress of these displacements.
pub(super) fn stressed(
    model: &Model,
    prestressed: &[Option<NodeDisplacements>],
    session: &Session<'_>,
) -> Result<Structure, Error> {
    let _stage = session.stage(Stage::FiniteElements);
    Ok(assemble_stressed(model, prestressed)?)
}

/// Largest change of a normal force relative to the largest one.
fn change_of_normal_forces(before: &StaticState, after: &StaticState) -> f64 {
    let normal =
        |state: &StaticState| -> Vec<f64> { state.lambda.iter().step_by(3).copied().collect() };
    let (before, after) = (normal(before), normal(after));
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |m, v| m.max(v.abs()));
    let moved = most(&mut before.iter().zip(&after).map(|(a, b)| a - b));
    match most(&mut after.iter().copied()) {
        0.0 => 0.0,
        largest => moved / largest,
    }
}

/// Change of the first squared stuck frequency, where no pair can open.
fn relative(before: Option<f64>, after: Option<f64>) -> f64 {
    before
        .zip(after)
        .map_or(0.0, |(before, after)| (after / before - 1.0).abs())
}

/// Matrices of the bodies, the displacements that their prestress comes from, and the analysis of the
/// assembly, which one thread makes while the others find the displacements; `None` without a
/// prestress. Where this is that of the static state with contact, it is taken with all pairs stuck.
pub(super) fn assemble(
    model: &Model,
    session: &Session<'_>,
) -> Result<(Structure, Prestressed, Option<Symbolic>), Error> {
    let stage = session.stage(Stage::FiniteElements);
    let solve = |k: &CscMatrix<f64>, f: &[f64]| {
        stage.solves(k.ncols());
        solve_by_cholesky(k, f)
    };
    // Without a prestress there is nothing to wait for, and one reduction alone to serve.
    let analyse = |bodies: &[BodyMatrices], joints: &[Joint]| {
        is_stressed(model).then(|| reduction::analyse(bodies, joints))?
    };
    let (structure, prestressed, analysis) = fem::assemble_with(model, &solve, analyse)?;
    if !is_of_contact(model) {
        return Ok((structure, prestressed, analysis));
    }
    stage.solves(unknowns(model));
    let free = stuck_displacement(&structure, analysis.as_ref())?;
    let bodies = model.bodies.iter().zip(&free);
    let prestressed: Prestressed = bodies
        .map(|(body, free)| prestressing(body, free).map(Some))
        .collect::<Result<_, FemError>>()?;
    let structure = assemble_stressed(model, &prestressed)?;
    Ok((structure, prestressed, analysis))
}

/// Largest relative change of the first stuck frequencies where the prestress of the held flanks is
/// replaced by the stress of the static state with all pairs stuck. `None` where the prestress is
/// another one, or the bodies do not touch.
fn held_flanks_error(
    model: &Model,
    prestressed: &[Option<NodeDisplacements>],
    reduction: &Reduction,
) -> Result<Option<f64>, FemError> {
    let joined = !model.pairs.is_empty() || !model.bonded.is_empty();
    let rotation = model.rotation.as_ref();
    if rotation.map(|r| r.prestress) != Some(BodyPrestress::HeldFlanks) || !joined {
        return Ok(None);
    }
    let stuck = vec![0.0; 3 * model.pairs.len()];
    let mut displacements = node_displacements(model, &reduction.recovery.full_static(&stuck));
    for (u, held) in displacements.iter_mut().zip(prestressed) {
        for (u, held) in u.iter_mut().zip(held.iter().flatten()) {
            *u = [0, 1, 2].map(|k| u[k] - held[k]);
        }
    }
    let added = geometric_stiffness(model, &displacements)?;
    Ok(frequency_change(reduction, &added))
}

/// Displacements of all nodes of each body, from those of its free degrees of freedom.
fn node_displacements(model: &Model, free: &[Vec<f64>]) -> Vec<NodeDisplacements> {
    let bodies = model.bodies.iter().zip(free);
    bodies
        .map(|(body, free)| expand_to_nodes(&body.dofs, free))
        .collect()
}

/// Number of unknowns of the stuck assembly, no body of which is reduced by itself.
fn unknowns(model: &Model) -> usize {
    let free: usize = model.bodies.iter().map(|b| 3 * b.dofs.free_nodes()).sum();
    free - 3 * joined(model)
}

/// Number of nodes that follow others.
fn joined(model: &Model) -> usize {
    let tied = model.cyclic.as_ref().map_or(0, |cyclic| cyclic.ties.len());
    model.pairs.len() + model.bonded.len() + tied
}

pub(super) fn reduce(
    model: &Model,
    structure: &Structure,
    wanted: StuckModes,
    session: &Session<'_>,
) -> Result<Reduction, Error> {
    let _stage = reduction_stage(model, session);
    Ok(reduction::reduce(structure, wanted)?)
}

/// Begins the stage of a reduction, with the systems that it solves.
fn reduction_stage<'s, 'o>(model: &Model, session: &'s Session<'o>) -> StageGuard<'s, 'o> {
    let stage = session.stage(Stage::Reduction);
    // A body that is reduced by itself, and then the assembly of what is left.
    let mut assembly = 0;
    for body in &model.bodies {
        match body.fixed_interface_modes {
            Some(modes) => {
                stage.solves(3 * body.dofs.interior_nodes);
                assembly += modes + 3 * body.dofs.contact_nodes;
            }
            None => assembly += 3 * body.dofs.free_nodes(),
        }
    }
    stage.solves(assembly - 3 * joined(model));
    stage
}
