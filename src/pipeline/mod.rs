//! Runs the stages in their order: this is what the program does. Read [`solve`] first.

mod cache;
mod campbell;
mod conditions;
mod error;
mod files;
mod findings;
mod free_motion;
pub mod inputs;
mod maps;
mod meshed;
mod meshing;
pub mod observer;
pub mod pieces;
mod prestress;
pub mod progress;
mod reduced;
mod solve;
mod statics;
mod summary;
mod units;
pub mod verify;

use std::path::{Path, PathBuf};

pub use self::cache::{CacheSettings, executable_hash, fingerprint};
pub use self::campbell::{Campbell, SpeedRange, SpeedRangeError, campbell};
pub use self::error::RunError;
pub use self::files::{Files, SharedFiles};
use self::meshed::Bound;
use self::observer::{Compared, Observer};
use self::progress::Progress;
pub use self::reduced::Reduced;
use crate::export::csv::ModeRow;
pub use crate::export::folder::Beginning;
use crate::export::manifest::{self, Summary};
use crate::export::vtu::ModeShape;
use crate::stage::Stage;
use dovetail_numerics::eigen::Modes;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::dlft::{Response, StaticState};
use dovetail_solver::model::Assembly;
use dovetail_solver::reduction::damping::rayleigh;
use dovetail_solver::results::far_slip::ShorterSides;
use dovetail_solver::results::small::{Moved, Sizes};

/// What a run finds about it: where it writes, what it was asked by, what earlier runs left.
#[derive(Debug, Clone)]
pub struct Context {
    pub out: PathBuf,
    pub scene_file: PathBuf,
    /// [`solve`], [`static_state`]: make the way back to the bodies, for fields.
    pub fields: bool,
    /// [`solve`]: with fields, the motion at the peak as so many frames of a period, too.
    pub frames: Option<usize>,
    /// [`solve`]: compute the modes of each body with its flanks held, too (a stage of its own, the last).
    pub held_modes: bool,
    /// [`solve`]: pictures beyond those of every run.
    pub further_plots: Vec<FurtherPlot>,
    /// `None`: nothing is kept for later runs, nothing taken from earlier ones.
    pub cache: Option<CacheSettings>,
}

/// A picture that is drawn where it is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FurtherPlot {
    /// Amplitude on a logarithmic axis.
    Logarithmic,
    /// Phase of the first harmonic.
    Phase,
}

/// What came of a run.
#[derive(Debug)]
pub struct Run {
    pub reduced: Reduced,
    pub static_state: StaticState,
    /// `None` where there is no static state to vibrate about, or none was asked for.
    pub response: Option<Response>,
    /// The response with another number of harmonics, where the scene asks for one.
    pub compared: Option<Compared>,
    pub summary: Summary,
    /// What moves farthest over the size of its body, where there is a mesh.
    pub farthest: Option<Moved>,
}

impl Run {
    /// Whether the run came to its full result.
    ///
    /// # Errors
    /// [`RunError::NothingHolds`], [`RunError::StaticState`], [`RunError::MovesTooFar`],
    /// [`RunError::NotConverged`] where some frequencies failed.
    pub fn verdict(&self) -> Result<(), RunError> {
        if self.response.is_none() {
            solve::usable(&self.reduced, &self.static_state)?;
        }
        findings::moves_too_far(self.farthest.clone())?;
        let compared = self.compared.iter().map(|c| &c.response);
        all_converged(self.response.iter().chain(compared))
    }
}

/// Mesh, or reduced model, to static state and response. Nothing is written here but the mesh that gmsh makes, and
/// nothing printed: `observer` hears of everything as it comes.
///
/// # Errors
/// The stage's own error, or the observer's.
pub fn solve(
    scene: &Scene,
    context: &Context,
    observer: &mut dyn Observer,
) -> Result<Run, RunError> {
    let progress = &Progress::new(observer);
    let reduced = Reduced::of(scene, context, progress)?;
    let Static {
        state: static_state,
        slide,
        farthest,
        mut summary,
    } = solve_static(scene, context, &reduced, progress)?;
    if solve::usable(&reduced, &static_state).is_err()
        || findings::moves_too_far(farthest.clone()).is_err()
    {
        summary::take_down(progress, &mut summary);
        return Ok(Run {
            reduced,
            static_state,
            response: None,
            compared: None,
            summary,
            farthest,
        });
    }
    let linear_omega2 = reduced.linear_omega2(&static_state);
    let damping = rayleigh(&scene.damping, linear_omega2)?;
    let frequencies_hz = solve::frequencies_hz(&scene.response, linear_omega2)?;
    let harmonics = scene.response.resolution.most_harmonics();
    solve::off_undamped_modes(
        reduced.model(),
        &static_state,
        damping,
        &frequencies_hz,
        harmonics,
    )?;
    let responses = solve::Responses {
        spec: &scene.response,
        reduced: &reduced,
        damping,
        state: &static_state,
        frequencies_hz: &frequencies_hz,
        progress,
    };
    let (response, slide_in_motion) = responses.response(None)?;
    let resolution = scene.response.resolution;
    let compared = scene.response.compare_harmonics;
    let compared = compared.filter(|h| solve::compared(resolution, *h) != resolution);
    let compare = |harmonics| {
        let (response, _) = responses.response(Some(harmonics))?;
        Ok::<Compared, RunError>(Compared {
            harmonics,
            response,
        })
    };
    let compared = compared.map(compare).transpose()?;
    let slides = [slide, slide_in_motion];
    let small = findings::of_motion(&reduced, &static_state, &response, slides);
    let held = findings::held(&reduced, &static_state, &response, progress)?;
    let of_response = findings::warnings(&reduced, &response);
    for warning in small.iter().chain(&held).chain(&of_response) {
        progress.tell(|o| o.warning(warning));
    }
    let all: Vec<&Response> = std::iter::once(&response)
        .chain(compared.iter().map(|c| &c.response))
        .collect();
    let modes_reach = reduced.modes_reach(&all);
    if let Some(warning) = findings::few_modes(modes_reach) {
        progress.tell(|o| o.warning(&warning));
    }
    if let Some(truncation) = &mut summary.truncation {
        truncation.modes_reach = modes_reach;
    }
    let observed = reduced.meshed();
    let observed = observed.and_then(|m| Sizes::of(&m.model).farthest_observed(&response));
    let farthest = observed.or(farthest);
    {
        let _stage = progress.stage(Stage::ResponseFiles);
        progress.tell(|o| o.response(&reduced, &response, compared.as_ref()))?;
    }
    let first = reduced.observations().first().copied();
    summary.response = Some(manifest::response_summary(&reduced.pairs, first, &response));
    if let (Some(meshed), true) = (reduced.meshed(), context.held_modes) {
        let held = omega2(&meshed.held_modes(progress)?);
        progress.tell(|o| o.held_modes(&reduced, &static_state, &held))?;
        summary.blade_frequency_hz = first_hz(&held);
    }
    summary::take_down(progress, &mut summary);
    Ok(Run {
        reduced,
        static_state,
        response: Some(response),
        compared,
        summary,
        farthest,
    })
}

/// The static state, and what is known with it.
struct Static {
    state: StaticState,
    /// The farthest slide of a pair over the shorter side of its flank.
    slide: f64,
    /// What moves farthest over the size of its body, where the way back to the bodies was made.
    farthest: Option<Moved>,
    /// So far.
    summary: Summary,
}

/// The static state, told.
fn solve_static(
    scene: &Scene,
    context: &Context,
    reduced: &Reduced,
    progress: &Progress,
) -> Result<Static, RunError> {
    progress.tell(|o| o.reduced(reduced))?;
    for warning in reduced
        .meshed()
        .map_or_else(Vec::new, |m| findings::of_gaps(&m.model))
    {
        progress.tell(|o| o.warning(&warning));
    }
    let mut state = solve::statics(scene, reduced, progress)?;
    let slide = ShorterSides::of(&reduced.pairs).judge_static(&mut state);
    let mut summary = summary::of_reduced(scene, context, reduced);
    summary.static_state = summary::static_summary(reduced, &state);
    if solve::usable(reduced, &state).is_ok() {
        solve::tell_of_linear_reference(reduced, &state, progress);
        let linear_omega2 = reduced.linear_omega2(&state);
        summary.linear_frequency_hz = linear_omega2.first().copied().map(hertz);
    }
    progress.tell(|o| o.figures(&summary));
    let mut displacements_m = None;
    if let Some(meshed) = reduced.meshed().filter(|_| context.fields) {
        meshed.recover(progress)?;
        let valid = state.outcome.is_converged();
        displacements_m = valid
            .then(|| meshed.static_displacements_m(&state))
            .flatten();
    }
    for warning in findings::of_static(reduced, &state, slide, displacements_m.as_deref()) {
        progress.tell(|o| o.warning(&warning));
    }
    let sizes = reduced.meshed().map(|meshed| Sizes::of(&meshed.model));
    let farthest = sizes
        .zip(displacements_m)
        .and_then(|(s, u)| s.farthest_node(&u));
    {
        let _stage = progress.stage(Stage::StaticFiles);
        progress.tell(|o| o.static_state(reduced, &state))?;
    }
    Ok(Static {
        state,
        slide,
        farthest,
        summary,
    })
}

/// Squared angular frequencies of each body.
fn omega2(modes: &[Modes]) -> Vec<Vec<f64>> {
    modes.iter().map(|modes| modes.omega2.clone()).collect()
}

/// First frequency of the first body.
fn first_hz(held_omega2: &[Vec<f64>]) -> Option<f64> {
    held_omega2.first()?.first().copied().map(hertz)
}

/// Only the mesh: made, checked, its flanks paired.
///
/// # Errors
/// gmsh, an unreadable or unusable mesh, groups it lacks, flanks that do not match; a scene without mesh.
pub fn mesh(scene: &Scene, context: &Context, progress: &Progress) -> Result<Summary, RunError> {
    let Subject::Assembly(assembly) = &scene.subject else {
        return Err(no_mesh(scene));
    };
    let bound = Bound::of(assembly, context, progress)?;
    for warning in findings::of_gaps(&bound.model) {
        progress.tell(|o| o.warning(&warning));
    }
    let mut summary = summary::empty(scene, context);
    summary.pairs = bound.model.pairs.len();
    summary.observations = manifest::observation_summaries(&bound.model);
    summary.excitation_fields = bound.model.maps.clone();
    summary.mesh = Some(bound.summary());
    summary::take_down(progress, &mut summary);
    Ok(summary)
}

/// What `dovetail modes` finds.
#[derive(Debug)]
pub struct ModalAnalysis {
    pub reduced: Reduced,
    /// Rows of modes.csv.
    pub rows: Vec<ModeRow>,
    /// On the nodes; none without a mesh.
    pub shapes: Vec<ModeShape>,
    pub summary: Summary,
}

/// Modes: of each body with its flanks held (full model), fixed-interface, and of the stuck assembly.
///
/// # Errors
/// Those of [`mesh`], of the finite elements and of the reduction; an unreadable reduced model.
pub fn modes(
    scene: &Scene,
    context: &Context,
    progress: &Progress,
) -> Result<ModalAnalysis, RunError> {
    let reduced = Reduced::of(scene, context, progress)?;
    let (mut held, mut shapes) = (Vec::new(), Vec::new());
    if let Some(meshed) = reduced.meshed() {
        meshed.recover(progress)?;
        let modes = meshed.held_modes(progress)?;
        shapes = meshed.shapes(&modes);
        held = omega2(&modes);
    }
    let rows = files::mode_rows(&reduced, None, &held);
    let mut summary = summary::of_reduced(scene, context, &reduced);
    summary.blade_frequency_hz = first_hz(&held);
    summary::take_down(progress, &mut summary);
    Ok(ModalAnalysis {
        reduced,
        rows,
        shapes,
        summary,
    })
}

/// What `dovetail reduce` finds.
#[derive(Debug)]
pub struct Condensed {
    /// Excited by 1 N in all, where the scene has forces alone.
    pub reduced: Reduced,
    /// What the excitation is to be multiplied by, N.
    pub force_n: f64,
    pub summary: Summary,
}

impl Condensed {
    /// The lines of a scene that read the model from this folder. `None` where its pairs follow
    /// more than one `law`.
    pub fn lines_of_scene(&self, law: Option<PairLaw>, folder: &Path) -> Option<String> {
        let law = law?;
        // A scene counts paths from its own folder, wherever that will be.
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let springs = law.stiffness.map(|springs| {
            format!(
                "normal_stiffness_n_m = {:?}\ntangential_stiffness_n_m = {:?}\n",
                springs.normal_n_m, springs.tangential_n_m
            )
        });
        Some(format!(
            "[reduced_model]\nfolder = {}\nfriction = {:?}\n{}gap_m = {:?}\nforce_n = {:?}",
            toml::Value::String(folder.display().to_string()),
            law.friction,
            springs.unwrap_or_default(),
            law.gap_m,
            self.force_n
        ))
    }
}

/// Up to the reduced model, for a folder that `[reduced_model]` reads. The folder holds the
/// response to 1 N in all, whatever the forces of the scene: `reduced_model.force_n` alone gives
/// the amplitude. Where the scene has other causes than forces the folder holds them as they are,
/// and `reduced_model.force_n` multiplies them.
///
/// # Errors
/// Those of [`modes`]; a scene about a reduced model already, or one without pairs.
pub fn reduce(
    scene: &Scene,
    context: &Context,
    progress: &Progress,
) -> Result<Condensed, RunError> {
    let Subject::Assembly(assembly) = &scene.subject else {
        return Err(no_mesh(scene));
    };
    let (of_one_newton, force_n) = of_one_newton(assembly);
    let mut excited = scene.clone();
    excited.subject = Subject::Assembly(Box::new(of_one_newton));
    let reduced = Reduced::of(&excited, context, progress)?;
    if reduced.pairs.rows.is_empty() {
        let why = "a reduced model is about the pairs of its contacts";
        return Err(RunError::AllBonded { why });
    }
    let mut summary = summary::of_reduced(scene, context, &reduced);
    summary::take_down(progress, &mut summary);
    Ok(Condensed {
        reduced,
        force_n,
        summary,
    })
}

/// Up to the reduced model, kept in the cache with what later runs need to come back to the bodies.
///
/// # Errors
/// Those of [`modes`]; a scene about a reduced model already, or no cache.
pub fn reduce_into_cache(
    scene: &Scene,
    context: &Context,
    progress: &Progress,
) -> Result<(), RunError> {
    if scene.assembly().is_none() {
        return Err(no_mesh(scene));
    }
    let cache = context.cache.as_ref().filter(|cache| cache.limit_bytes > 0);
    let cache = cache.ok_or(RunError::NoCache)?;
    let reduced = Reduced::of(scene, context, progress)?;
    if let (Some(meshed), true) = (reduced.meshed(), context.held_modes) {
        meshed.held_modes(progress)?;
    }
    progress.note(&format!(
        "reduced model in the cache {}",
        cache.folder.display()
    ));
    Ok(())
}

/// The assembly with forces that are 1 N in all, in the proportions of its own, and the sum of its
/// own. Pressures and accelerations have no such sum: with any of them the assembly stays as it is,
/// and the sum is 1.
fn of_one_newton(assembly: &Assembly) -> (Assembly, f64) {
    let mut scaled = assembly.clone();
    if assembly.excitations.iter().any(|e| e.kind.unit() != "N") {
        return (scaled, 1.0);
    }
    let force_n: f64 = assembly.excitations.iter().map(|e| e.amplitude).sum();
    let count = assembly.excitations.len() as f64;
    for excitation in &mut scaled.excitations {
        // Without any force all proportions are alike.
        excitation.amplitude = match force_n > 0.0 {
            true => excitation.amplitude / force_n,
            false => 1.0 / count,
        };
    }
    (scaled, force_n)
}

/// Up to the static state under rotation: a run without a response.
///
/// # Errors
/// Those of [`modes`], or the observer's.
pub fn static_state(
    scene: &Scene,
    context: &Context,
    observer: &mut dyn Observer,
) -> Result<Run, RunError> {
    let progress = &Progress::new(observer);
    let reduced = Reduced::of(scene, context, progress)?;
    let mut found = solve_static(scene, context, &reduced, progress)?;
    summary::take_down(progress, &mut found.summary);
    Ok(Run {
        reduced,
        static_state: found.state,
        response: None,
        compared: None,
        summary: found.summary,
        farthest: found.farthest,
    })
}

/// Says that the scene is sound; nothing is computed or written.
///
/// # Errors
/// A mesh or script that does not exist, a reduced model that cannot be read.
pub fn check(scene: &Scene, progress: &Progress) -> Result<(), RunError> {
    match &scene.subject {
        Subject::Assembly(assembly) => meshing::check(assembly, progress)?,
        Subject::ReducedModel(spec) => reduced::check(spec)?,
    }
    progress.note(&format!("scene \"{}\" is sound", scene.name));
    Ok(())
}

fn no_mesh(scene: &Scene) -> RunError {
    RunError::NoMesh {
        scene: scene.name.clone(),
    }
}

fn all_converged<'a>(responses: impl Iterator<Item = &'a Response>) -> Result<(), RunError> {
    let (mut points, mut unconverged) = (0, 0);
    for orbit in responses.flat_map(|r| &r.orbits) {
        points += 1;
        unconverged += usize::from(!orbit.outcome.is_converged());
    }
    match unconverged {
        0 => Ok(()),
        _ => Err(RunError::NotConverged {
            unconverged,
            points,
        }),
    }
}

fn hertz(omega2: f64) -> f64 {
    omega2.max(0.0).sqrt() / std::f64::consts::TAU
}
