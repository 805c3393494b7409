//! A whole run: from a [`Scene`] and the meshes of its bodies to static state, response, modes.
//!
//! [`solve`] is the run. Only this folder knows the sequence of the stages: a stage knows nothing
//! of those after it. [`campbell()`], [`crossing_peaks()`], [`peaks()`], [`backbone()`],
//! [`wear()`] and [`verify()`] are runs of another kind, one file each.
//!
//! Nothing is written or printed here. A [`Session`] reports everything to an [`Observer`] as it
//! comes, and asks a [`Store`] for results of earlier runs. `()` is an observer that ignores all
//! events, and a store that keeps nothing.
//!
//! A reduction is kept under a hash of its inputs ([`ReductionInputs`], `kept.rs`): the whole model
//! but for a list of fields that only the contact solve reads. A new field counts as an input.
//! Where it belongs on the list and is left out, reductions are made that could have been taken
//! from the store, but a wrong one is never taken.

mod at;
mod backbone;
mod bodies;
mod campbell;
mod crossing_peaks;
mod curve;
mod curve_progress;
mod error;
mod free_motion;
mod kept;
mod nodal_diameters;
mod outcome;
mod peaks;
mod prestress;
mod reactions;
mod records;
mod reduced;
mod reducing;
mod response;
mod run_up;
mod session;
mod stability;
mod statics;
mod stress;
mod tractions;
mod verify;
mod wear;
mod worn;

pub use backbone::{BackboneQuestion, ModeBackbone, ModeChoice, backbone};
pub use bodies::{Bodies, Bound, Meshes, Source, problem};
pub use campbell::{Campbell, Crossing, DiscWave, ModeFamily, campbell};
pub use crossing_peaks::{CrossingPeak, crossing_peaks};
pub use curve::{CurveQuestion, ParameterCurve, SceneAt, curve};
pub use error::{Error, static_place};
pub use kept::{
    PrestressPass, ReductionInputs, ReductionKey, ReductionModes, StoreEntry, StoreSlot,
    StoredReduction,
};
pub use nodal_diameters::{DiscMode, DiscModes, NodalDiameters};
pub use outcome::{
    Compared, PeakAt, ResponseResult, Run, RunUp, StaticResult, TractionPeak, TractionRange,
    TractionResponse,
};
pub use peaks::{PeakRange, Peaks, peaks};
pub use reactions::{PeakMotion, peak_forces, static_forces};
pub use records::{RecordInputs, RecordKey, Recorded, ResponseInputs};
pub use reduced::{Observed, ReducedScene};
pub use reducing::PlannedReduction;
pub use response::{check_one_speed, check_undamped_modes};
pub use session::{Event, Observer, Session, Stage, StageEnd, Store};
pub use stability::Judged;
pub use statics::load_path;
pub use stress::{PLACES, PeakStress, peak_stress};
pub use verify::{Verification, Verified, verify};
pub use wear::{Wear, WearQuestion, wear};
pub use worn::{WearBlock, WearCourse};

use crate::description::{Scene, Subject};
use crate::dlft::retention::Mean;
use crate::dlft::{Orbit, Response};
use crate::model::Assembly;
use crate::results::far_slip::ShorterSides;
use crate::results::modes::ModeShape;
use crate::results::small::AssemblySizes;
use dovetail_numerics::eigen::Modes;
use std::time::Instant;

/// Restricts each dense product and factorisation of this process to one thread, because those
/// split among threads round differently. The work is shared between bodies, halves of a sweep and
/// pairs, so that results then do not depend on the number of threads. It is a setting of the whole
/// process, and therefore left to the program.
pub fn factorise_on_one_thread() {
    faer::set_global_parallelism(faer::Par::Seq);
}

/// Optional results of a run besides the response.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Options {
    /// True to make the recovery of the bodies, which fields on them need.
    pub fields: bool,
    /// True to compute the modes of each body with its flanks held.
    pub held_modes: bool,
}

/// Computes static state and response from the meshes of a scene, or from its reduced model. A
/// static state that nothing can vibrate about is no error: [`Run::verdict`] reports it.
///
/// # Errors
/// The error of a stage; [`Error::Stopped`] by the observer or the store.
pub fn solve(
    scene: &Scene,
    source: Source,
    options: Options,
    session: &Session<'_>,
) -> Result<Run, Error> {
    let begun = Instant::now();
    let mut run = static_state(scene, source, options, session)?;
    if run.verdict().is_err() {
        return Ok(run);
    }
    let response = match scene.response.along_engine_order {
        None => frequency_response(scene, &run, begun, session)?,
        Some(order) => run_up::run_up(scene, order, &run, options.fields, session)?,
    };
    run.response = Some(response);
    session.report(&Event::Response(&run))?;
    if let (Some(bodies), true) = (&run.reduced.bodies, options.held_modes) {
        run.held_omega2 = omega2(&bodies.held_modes(session)?);
    }
    Ok(run)
}

impl Scene {
    /// Computes static state and response as [`solve`] does, from meshes or a reduced model. Nothing
    /// is reported on the way, and nothing is kept.
    ///
    /// # Errors
    /// Errors of [`solve`] and of [`Run::verdict`].
    pub fn solve(&self, source: impl Into<Source>) -> Result<Run, Error> {
        let (mut observer, mut store) = ((), ());
        let session = Session::new(&mut observer, &mut store);
        let run = solve(self, source.into(), Options::default(), &session)?;
        run.verdict()?;
        Ok(run)
    }
}

/// Response of a scene over the frequency, about the static state of its run, which began at `begun`.
fn frequency_response(
    scene: &Scene,
    run: &Run,
    begun: Instant,
    session: &Session<'_>,
) -> Result<ResponseResult, Error> {
    let (reduced, state) = (&run.reduced, &run.statics.state);
    let linear_omega2 = reduced.linear_omega2(state);
    let damping = reduced.rayleigh(&scene.damping, state)?;
    let frequencies_hz = response::frequencies_hz(&scene.response, &linear_omega2)?;
    let resolution = scene.response.resolution;
    response::check_undamped_modes(
        &reduced.problem,
        state,
        damping,
        &frequencies_hz,
        resolution.most_harmonics(),
    )?;
    let responses = response::Responses {
        spec: &scene.response,
        reduced,
        damping,
        state,
        frequencies_hz: &frequencies_hz,
        session,
    };
    let (mut response, slide) = responses.response(None)?;
    let departures = responses.add_two_periods(&mut response, begun)?;
    let compared = scene.response.compare_harmonics;
    let compared = compared.filter(|h| response::compared(resolution, *h) != resolution);
    let compare = |harmonics| {
        let (response, _) = responses.response(Some(harmonics))?;
        Ok::<Compared, Error>(Compared {
            harmonics,
            response,
        })
    };
    let compared = compared.map(compare).transpose()?;
    let tractions =
        tractions::solve_tractions(scene, reduced, damping, &frequencies_hz, &response, session)?;
    let departures = responses.departures(&mut response, departures, begun)?;
    let held = |o: &&Orbit| o.outcome.has_motion() && o.mean == Mean::Retained;
    let held = response.orbits.iter().filter(held);
    let retained = match held.max_by(|a, b| a.retention_n.total_cmp(&b.retention_n)) {
        Some(most) => free_motion::retained_in_motion(reduced, state, most, session)?,
        None => Vec::new(),
    };
    let responses: Vec<&Response> = std::iter::once(&response)
        .chain(compared.iter().map(|c| &c.response))
        .collect();
    let bodies = reduced.bodies.as_ref();
    let farthest = bodies.and_then(|b| AssemblySizes::new(b.model()).farthest_observed(&response));
    Ok(ResponseResult {
        slide,
        farthest,
        retained,
        modes_reach: reduced.modes_reach(&responses),
        response,
        compared,
        tractions,
        departures,
        damping,
        run_up: None,
    })
}

/// Computes the static state under the steady load: a run without a response.
///
/// # Errors
/// The error of a stage; [`Error::Stopped`] by the observer.
pub fn static_state(
    scene: &Scene,
    source: Source,
    options: Options,
    session: &Session<'_>,
) -> Result<Run, Error> {
    let reduced = ReducedScene::new(scene, source, session)?;
    let statics = statics(scene, &reduced, options.fields, session)?;
    session.report(&Event::StaticState {
        reduced: &reduced,
        statics: &statics,
    })?;
    Ok(Run {
        reduced,
        statics,
        response: None,
        held_omega2: Vec::new(),
    })
}

/// Static state of a reduced model, with the quantities derived from it.
fn statics(
    scene: &Scene,
    reduced: &ReducedScene,
    fields: bool,
    session: &Session<'_>,
) -> Result<StaticResult, Error> {
    let mut state = statics::static_state(scene, &reduced.problem, session);
    let retained = free_motion::retained_at_rest(reduced, &state, session)?;
    let free = free_motion::held_by_nothing(reduced, &state, session)?;
    let slide = ShorterSides::new(&reduced.pairs).judge_static(&mut state);
    let (mut displacements_m, mut farthest) = (None, None);
    if let Some(bodies) = reduced.bodies.as_ref().filter(|_| fields) {
        bodies.recover(session)?;
        if state.outcome.is_converged() {
            displacements_m = bodies.static_displacements_m(&state);
        }
        let sizes = AssemblySizes::new(bodies.model());
        farthest = displacements_m
            .as_ref()
            .and_then(|u| sizes.farthest_node(u));
    }
    Ok(StaticResult {
        state,
        slide,
        displacements_m,
        farthest,
        retained,
        free,
    })
}

/// Checks that the static state whose stress a reduced model has, if any, is one to vibrate about.
///
/// # Errors
/// Those of [`StaticResult::usable`].
fn judge_prestress(
    scene: &Scene,
    reduced: &ReducedScene,
    session: &Session<'_>,
) -> Result<(), Error> {
    let mut bodies = reduced.bodies.iter();
    match bodies.any(|bodies| prestress::is_of_contact(bodies.model())) {
        true => statics(scene, reduced, false, session)?.usable(),
        false => Ok(()),
    }
}

/// Squared angular frequencies of each body, rad2/s2.
fn omega2(modes: &[Modes]) -> Vec<Vec<f64>> {
    modes.iter().map(|modes| modes.omega2.clone()).collect()
}

/// Result of a modal analysis.
#[derive(Debug)]
#[non_exhaustive]
pub struct ModalAnalysis {
    /// Reduced model.
    pub reduced: ReducedScene,
    /// Squared angular frequencies of each body with its flanks held, rad2/s2.
    pub held_omega2: Vec<Vec<f64>>,
    /// Shapes on the nodes; empty without bodies.
    pub shapes: Vec<ModeShape>,
    /// Frequencies over the nodal diameters; `None` for bodies that are not a sector of a disc.
    pub nodal_diameters: Option<NodalDiameters>,
    /// Modes of the nodal diameter that was asked for.
    pub disc: Option<DiscModes>,
}

/// Computes the modes of each body with its flanks held (full model), the fixed-interface modes,
/// those of the stuck assembly, and those of a disc at each nodal diameter. `nodal_diameter` is the one
/// whose shapes are wanted on the whole disc.
///
/// # Errors
/// The errors of [`ReducedScene::new`] and of the eigenvalues; [`Error::NoDisc`],
/// [`Error::TooManyDiameters`].
pub fn modes(
    scene: &Scene,
    source: Source,
    nodal_diameter: Option<usize>,
    session: &Session<'_>,
) -> Result<ModalAnalysis, Error> {
    let scene = &scene.sectors_in_phase();
    let reduced = ReducedScene::new(scene, source, session)?;
    judge_prestress(scene, &reduced, session)?;
    let (mut held_omega2, mut shapes, mut nodal_diameters) = (Vec::new(), Vec::new(), None);
    if let Some(bodies) = &reduced.bodies {
        bodies.recover(session)?;
        let modes = bodies.held_modes(session)?;
        shapes = bodies.shapes(&reduced.problem, &modes);
        held_omega2 = omega2(&modes);
        nodal_diameters = bodies.nodal_diameters(session)?;
    }
    let disc = nodal_diameter.map(|nodal_diameter| {
        let bodies = reduced.bodies.as_ref().ok_or(Error::NoDisc)?;
        bodies.disc_modes(nodal_diameter, session)
    });
    let disc = disc.transpose()?;
    Ok(ModalAnalysis {
        reduced,
        held_omega2,
        shapes,
        nodal_diameters,
        disc,
    })
}

/// Result of a condensation for other programs.
#[derive(Debug)]
#[non_exhaustive]
pub struct CondensedAssembly {
    /// Reduced model, under a total force of 1 N where the scene has forces alone.
    pub reduced: ReducedScene,
    /// Factor on that excitation, N.
    pub force_n: f64,
}

/// Computes the reduced model, under a total force of 1 N whatever the forces of the scene.
/// Excitations that are not forces stay as they are.
///
/// # Errors
/// [`Error::NoMesh`] for a scene about a reduced model; [`Error::AllBonded`] for one without pairs;
/// [`Error::NotInPhase`] for a wave round a disc; those of [`ReducedScene::new`].
pub fn reduce(
    scene: &Scene,
    meshes: Meshes,
    session: &Session<'_>,
) -> Result<CondensedAssembly, Error> {
    response::check_in_phase(scene, "a reduced model for other programs")?;
    let assembly = scene.assembly().ok_or(Error::NoMesh)?;
    let (of_one_newton, force_n) = normalise_forces(assembly);
    let mut excited = scene.clone();
    excited.subject = Subject::Assembly(Box::new(of_one_newton));
    let reduced = ReducedScene::new(&excited, meshes.into(), session)?;
    if reduced.pairs.rows.is_empty() {
        let why = "a reduced model is about the pairs of its contacts";
        return Err(Error::AllBonded { why });
    }
    judge_prestress(scene, &reduced, session)?;
    Ok(CondensedAssembly { reduced, force_n })
}

/// Assembly whose forces add up to 1 N, in the proportions of its own, and the sum of its own.
/// Pressures and accelerations have no such sum: with any of them the assembly stays as it is, and
/// the sum is 1.
fn normalise_forces(assembly: &Assembly) -> (Assembly, f64) {
    let mut scaled = assembly.clone();
    if assembly.excitations.iter().any(|e| e.kind.unit() != "N") {
        return (scaled, 1.0);
    }
    let force_n: f64 = assembly.excitations.iter().map(|e| e.amplitude).sum();
    let count = assembly.excitations.len() as f64;
    for excitation in &mut scaled.excitations {
        // Without any force all proportions are alike.
        excitation.amplitude = if force_n > 0.0 {
            excitation.amplitude / force_n
        } else {
            1.0 / count
        };
    }
    (scaled, force_n)
}
