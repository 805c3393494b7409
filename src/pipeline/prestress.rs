//! Takes a model to its problem with the prestress that it asks for. That of the static state with contact
//! depends on the reduced model itself: both are repeated until the normal forces no longer move. The first pass takes
//! the stress of the static state with all pairs stuck, which one linear system gives.

use super::error::RunError;
use super::hertz;
use super::progress::{Progress, StageGuard};
use super::statics::static_state;
use crate::export::manifest::PrestressPass;
use crate::stage::Stage;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::StaticState;
use dovetail_solver::fem::statics::{prestressing, solve_by_cholesky};
use dovetail_solver::fem::{self, FemError, Structure, assemble_stressed, expand_to_nodes};
use dovetail_solver::model::{BodyPrestress, Model};
use dovetail_solver::problem::Problem;
use dovetail_solver::reduction::{
    self, Recovery, Reduction, StuckModes, Truncation, frequency_change, stuck_displacement,
};
use nalgebra_sparse::CscMatrix;

/// Passes after which the normal forces still move.
const MOST_PASSES: usize = 20;
/// Largest change of a normal force over the largest normal force that counts as none.
const STILL: f64 = 1e-3;

/// Static displacement of the nodes of each body that the prestress comes from.
pub(super) type Displacement = Vec<Vec<[f64; 3]>>;

/// A problem, and what it is made of.
pub(super) struct Settled {
    pub structure: Structure,
    pub problem: Problem,
    pub truncation: Truncation,
    /// As in [`Reduction`].
    pub fixed_interface_omega2: Vec<Vec<f64>>,
    pub recovery: Recovery,
    /// Of the static state that the prestress comes from; `None`: [`assemble`] finds the stress, or there is none.
    pub displacement: Option<Displacement>,
    /// Where the prestress is that of the held flanks: see [`held_flanks_error`].
    pub held_flanks_error: Option<f64>,
    /// None where nothing is repeated.
    pub passes: Vec<PrestressPass>,
}

/// Whether the prestress of a model is that of its static state.
pub(super) fn is_of_contact(model: &Model) -> bool {
    model
        .rotation
        .as_ref()
        .is_some_and(|r| r.prestress_of_contact)
}

/// # Errors
/// Those of the finite elements and of the reduction; [`RunError::Prestress`] where the normal forces do not
/// settle.
pub(super) fn settle(
    model: &Model,
    wanted: StuckModes,
    scene: &Scene,
    progress: &Progress,
) -> Result<Settled, RunError> {
    let structure = assemble(model, progress)?;
    let (reduction, held_flanks_error) = {
        let stage = reduction_stage(model, progress);
        let reduction = reduction::reduce(model, &structure, wanted)?;
        let error = held_flanks_error(model, &structure, &reduction)?;
        drop(stage);
        (reduction, error)
    };
    let mut settled = Settled {
        structure,
        problem: Problem::new(reduction.model, model),
        truncation: reduction.truncation,
        fixed_interface_omega2: reduction.fixed_interface_omega2,
        recovery: reduction.recovery,
        displacement: None,
        held_flanks_error,
        passes: Vec::new(),
    };
    if !is_of_contact(model) {
        return Ok(settled);
    }
    let mut state = static_state(scene, &settled.problem, progress);
    settled.take_down(None, progress);
    loop {
        // Without a state there is nothing to go on from: the run says why, by the one of this model.
        if !state.outcome.is_converged() {
            return Ok(settled);
        }
        let change = settled.passes.last().and_then(|pass| pass.change);
        if change.is_some_and(|change| change < STILL) {
            return Ok(settled);
        }
        if let (Some(change), true) = (change, settled.passes.len() >= MOST_PASSES) {
            return Err(RunError::Prestress {
                passes: settled.passes.len(),
                change,
            });
        }
        let before = (state, settled.first_omega2());
        settled.again(model, &before.0, wanted, progress)?;
        state = static_state(scene, &settled.problem, progress);
        let after = (&state, settled.first_omega2());
        let change = match state.status.is_empty() {
            false => change_of_normal_forces(&before.0, &state),
            true => relative(before.1, after.1),
        };
        settled.take_down(Some(change), progress);
    }
}

impl Settled {
    fn first_omega2(&self) -> Option<f64> {
        self.problem.reduced.omega2.first().copied()
    }

    /// The problem with the stress of a static state of the one before.
    fn again(
        &mut self,
        model: &Model,
        state: &StaticState,
        wanted: StuckModes,
        progress: &Progress,
    ) -> Result<(), RunError> {
        let free = self.recovery.full_static(&state.x);
        let displacement = on_nodes(model, &free);
        self.structure = stressed(model, &displacement, progress)?;
        let reduction = reduce(model, &self.structure, wanted, progress)?;
        self.problem = Problem::new(reduction.model, model);
        self.truncation = reduction.truncation;
        self.fixed_interface_omega2 = reduction.fixed_interface_omega2;
        self.recovery = reduction.recovery;
        self.displacement = Some(displacement);
        Ok(())
    }

    fn take_down(&mut self, change: Option<f64>, progress: &Progress) {
        let stuck_frequency_hz = self.first_omega2().map(hertz);
        let moved = match change {
            None => "pairs stuck".to_string(),
            Some(change) => format!("normal forces moved by {change:.1e}"),
        };
        let stuck =
            stuck_frequency_hz.map_or(String::new(), |hz| format!(", first stuck mode {hz:.4} Hz"));
        let pass = self.passes.len() + 1;
        progress.note(&format!("prestress, pass {pass}: {moved}{stuck}"));
        self.passes.push(PrestressPass {
            change,
            stuck_frequency_hz,
        });
    }
}

/// The matrices with the stress of a displacement.
pub(super) fn stressed(
    model: &Model,
    displacement: &[Vec<[f64; 3]>],
    progress: &Progress,
) -> Result<Structure, RunError> {
    let _stage = progress.stage(Stage::FiniteElements);
    Ok(assemble_stressed(model, displacement)?)
}

/// Largest change of a normal force over the largest normal force.
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

/// Where no pair can open: the change of the first stuck frequency squared.
fn relative(before: Option<f64>, after: Option<f64>) -> f64 {
    before
        .zip(after)
        .map_or(0.0, |(before, after)| (after / before - 1.0).abs())
}

/// The matrices of the bodies. Where their prestress is that of the static state with contact, it is taken with all
/// pairs stuck.
pub(super) fn assemble(model: &Model, progress: &Progress) -> Result<Structure, RunError> {
    let stage = progress.stage(Stage::FiniteElements);
    let solve = |k: &CscMatrix<f64>, f: &[f64]| {
        stage.solves(k.ncols());
        solve_by_cholesky(k, f)
    };
    let structure = fem::assemble_with(model, &solve)?;
    if !is_of_contact(model) {
        return Ok(structure);
    }
    stage.solves(unknowns(model));
    let free = stuck_displacement(model, &structure)?;
    let bodies = model.bodies.iter().zip(&free);
    let displacement: Displacement = bodies
        .map(|(body, free)| prestressing(body, free))
        .collect::<Result<_, FemError>>()?;
    Ok(assemble_stressed(model, &displacement)?)
}

/// What the prestress of the held flanks makes of the first stuck frequencies: their largest relative change where the
/// stress is that of the static state with all pairs stuck. `None` where the prestress is another one, or the bodies
/// do not touch.
fn held_flanks_error(
    model: &Model,
    structure: &Structure,
    reduction: &Reduction,
) -> Result<Option<f64>, FemError> {
    let joined = !model.pairs.is_empty() || !model.bonded.is_empty();
    let rotation = model.rotation.as_ref();
    if rotation.map(|r| r.prestress) != Some(BodyPrestress::HeldFlanks) || !joined {
        return Ok(None);
    }
    let stuck = vec![0.0; 3 * model.pairs.len()];
    let displacement = on_nodes(model, &reduction.recovery.full_static(&stuck));
    let other = assemble_stressed(model, &displacement)?;
    Ok(frequency_change(reduction, structure, &other))
}

/// Displacements of all nodes of each body, of those of its free dofs.
fn on_nodes(model: &Model, free: &[Vec<f64>]) -> Displacement {
    let bodies = model.bodies.iter().zip(free);
    bodies
        .map(|(body, free)| expand_to_nodes(&body.dofs, free))
        .collect()
}

/// Unknowns of the stuck assembly, no body of which is reduced by itself.
fn unknowns(model: &Model) -> usize {
    let free: usize = model.bodies.iter().map(|b| 3 * b.dofs.free_nodes()).sum();
    free - 3 * (model.pairs.len() + model.bonded.len())
}

pub(super) fn reduce(
    model: &Model,
    structure: &Structure,
    wanted: StuckModes,
    progress: &Progress,
) -> Result<Reduction, RunError> {
    let _stage = reduction_stage(model, progress);
    Ok(reduction::reduce(model, structure, wanted)?)
}

/// Told of the systems that a reduction solves.
fn reduction_stage<'p, 'o>(model: &Model, progress: &'p Progress<'o>) -> StageGuard<'p, 'o> {
    let stage = progress.stage(Stage::Reduction);
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
    stage.solves(assembly - 3 * (model.pairs.len() + model.bonded.len()));
    stage
}
