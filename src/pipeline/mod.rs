//! The sequence of stages: what the program does, in the order in which it does it.

mod cache;
mod campbell;
mod files;
mod meshed;
mod meshing;
mod prepared;
mod solve;
pub mod verify;

use std::path::PathBuf;

pub use self::cache::{CacheSettings, executable_hash};
pub use self::campbell::{SpeedRange, SpeedRangeError, campbell};
use self::meshed::Bound;
use self::prepared::Prepared;
use crate::error::Error;
use crate::export::{csv, manifest};
use crate::progress::Progress;
use crate::terminal;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::dlft::Response;
use dovetail_solver::model::Assembly;
use dovetail_solver::reduction::LISTED_MODES;
use dovetail_solver::reduction::damping::rayleigh;

/// Where a run writes, and what it was asked by.
#[derive(Debug, Clone)]
pub struct Options {
    pub out: PathBuf,
    pub scene_file: PathBuf,
    /// [`run`]: write the fields for ParaView (VTU, PVD), too.
    pub fields: bool,
    /// [`run`]: compute the modes of each body with its flanks held, too (a stage of its own, the last).
    pub held_modes: bool,
    /// `None`: nothing is kept for later runs, nothing taken from earlier ones.
    pub cache: Option<CacheSettings>,
}

/// Mesh, or reduced model, to results.
///
/// # Errors
/// The stage's own error; [`Error::NotConverged`] when all is written but some frequencies failed.
pub fn run(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let subject = Prepared::of(scene, options, progress)?;
    let relative = subject.relative();
    let damping = rayleigh(&scene.damping, subject.stuck_omega2())?;
    let frequencies_hz = solve::frequencies_hz(&scene.response, relative)?;
    let most_harmonics = scene.response.resolution.most_harmonics();
    solve::off_undamped_modes(relative, damping, &frequencies_hz, most_harmonics)?;
    let state = solve::statics(scene, relative, progress);
    let mut summary = files::summarise(scene, options, &subject);
    summary.static_state = files::static_summary(&subject, &state);
    files::write_modes(options, &subject, None)?;
    files::write_static_state(options, &subject, &state, progress)?;
    if let Err(error) = solve::usable(&state) {
        files::finish(options, summary, progress)?;
        return Err(error);
    }
    let respond = |resolution| {
        solve::respond(
            &scene.response,
            relative,
            damping,
            &state,
            &frequencies_hz,
            resolution,
            progress,
        )
    };
    let resolution = scene.response.resolution;
    let response = respond(resolution);
    let compared = scene
        .response
        .compare_harmonics
        .map(|h| (h, solve::compared(resolution, h)))
        .filter(|(_, other)| *other != resolution)
        .map(|(h, other)| (h, respond(other)));
    let compared = compared.as_ref();
    files::write_response(options, scene, &subject, &response, compared, progress)?;
    let first = subject.observations().first().copied();
    summary.response = Some(manifest::response_summary(&subject.pairs, first, &response));
    if let (Some(meshed), true) = (subject.meshed(), options.held_modes) {
        let held = meshed.held_modes(progress)?;
        files::write_modes(options, &subject, Some(&held))?;
        let blade = held.first().and_then(|omega2| omega2.first());
        summary.blade_frequency_hz = blade.copied().map(hertz);
    }
    files::finish(options, summary, progress)?;
    files::report(&subject.observations(), &response, progress);
    all_converged(std::iter::once(&response).chain(compared.map(|(_, r)| r)))
}

/// Only the mesh: made, checked, its flanks paired.
///
/// # Errors
/// gmsh, an unreadable or unusable mesh, groups it lacks, flanks that do not match; a scene without mesh.
pub fn mesh(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let Subject::Assembly(assembly) = &scene.subject else {
        return Err(no_mesh(scene));
    };
    let bound = Bound::of(assembly, options, progress)?;
    let mut summary = files::empty_summary(scene, options);
    summary.pairs = bound.model.pairs.len();
    summary.observations = manifest::observation_summaries(&bound.model);
    summary.mesh = Some(bound.summary());
    files::finish(options, summary, progress)
}

/// Modes: of each body with its flanks held (full model), fixed-interface, and of the stuck assembly.
///
/// # Errors
/// Those of [`mesh`], of the finite elements and of the reduction; an unreadable reduced model.
pub fn modes(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let subject = Prepared::of(scene, options, progress)?;
    let held = match subject.meshed() {
        Some(meshed) => Some(meshed.held_modes(progress)?),
        None => None,
    };
    let rows = files::write_modes(options, &subject, held.as_deref())?;
    let line = |row: &csv::ModeRow| {
        format!(
            "{:<15} {:<10} {:>3} {:>14.4} Hz\n",
            row.kind, row.body, row.mode, row.frequency_hz
        )
    };
    let first = rows.iter().filter(|r| r.mode <= LISTED_MODES);
    terminal::print(&first.map(line).collect::<String>())?;
    let blade = held
        .iter()
        .flatten()
        .next()
        .and_then(|omega2| omega2.first());
    let mut summary = files::summarise(scene, options, &subject);
    summary.blade_frequency_hz = blade.copied().map(hertz);
    files::finish(options, summary, progress)
}

/// Up to the reduced model, written as a folder that `[reduced_model]` reads. The folder holds the
/// response to 1 N in all, whatever the forces of the scene: `reduced_model.force_n` alone gives
/// the amplitude, and the lines that are told give the scene's.
///
/// # Errors
/// Those of [`modes`]; a scene about a reduced model already, or one the folder cannot hold.
pub fn reduce(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let Subject::Assembly(assembly) = &scene.subject else {
        return Err(no_mesh(scene));
    };
    let (of_one_newton, force_n) = of_one_newton(assembly);
    let mut excited = scene.clone();
    excited.subject = Subject::Assembly(Box::new(of_one_newton));
    let subject = Prepared::of(&excited, options, progress)?;
    if subject.pairs.rows.is_empty() {
        let why = "a reduced model is about the pairs of its contacts";
        return Err(Error::AllBonded { why });
    }
    let law = files::write_reduced_model(options, &subject, progress)?;
    progress.note(&format!("reduced model in {}", options.out.display()));
    match law {
        Some(law) => {
            // A scene counts paths from its own folder, wherever that will be.
            let folder = std::path::absolute(&options.out).unwrap_or_else(|_| options.out.clone());
            progress.note(&format!(
                "[reduced_model]\nfolder = {}\nfriction = {:?}\ngap_m = {:?}\nforce_n = {force_n:?}",
                toml::Value::String(folder.display().to_string()),
                law.friction,
                law.gap_m
            ));
        }
        None => progress.warning(
            "the contacts differ in friction or clearance, of which [reduced_model] has one value for all pairs",
        ),
    }
    Ok(())
}

/// The assembly with forces that are 1 N in all, in the proportions of its own, and the sum of its
/// own.
fn of_one_newton(assembly: &Assembly) -> (Assembly, f64) {
    let mut scaled = assembly.clone();
    let force_n: f64 = assembly.excitations.iter().map(|e| e.force_n).sum();
    let count = assembly.excitations.len() as f64;
    for excitation in &mut scaled.excitations {
        // Without any force all proportions are alike.
        excitation.force_n = match force_n > 0.0 {
            true => excitation.force_n / force_n,
            false => 1.0 / count,
        };
    }
    (scaled, force_n)
}

/// Up to the static state under rotation.
///
/// # Errors
/// Those of [`modes`]; [`Error::StaticState`] when the state was not found.
pub fn static_state(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let subject = Prepared::of(scene, options, progress)?;
    let state = solve::statics(scene, subject.relative(), progress);
    let mut summary = files::summarise(scene, options, &subject);
    summary.static_state = files::static_summary(&subject, &state);
    files::write_modes(options, &subject, None)?;
    files::write_static_state(options, &subject, &state, progress)?;
    files::finish(options, summary, progress)?;
    solve::usable(&state)
}

/// Says that the scene is sound; nothing is computed or written.
///
/// # Errors
/// A mesh or script that does not exist, a reduced model that cannot be read.
pub fn check(scene: &Scene, _: &Options, progress: &Progress) -> Result<(), Error> {
    match &scene.subject {
        Subject::Assembly(assembly) => meshing::check(&assembly.mesh, progress)?,
        Subject::ReducedModel(spec) => prepared::check(spec)?,
    }
    progress.note(&format!("scene \"{}\" is sound", scene.name));
    Ok(())
}

fn no_mesh(scene: &Scene) -> Error {
    Error::NoMesh {
        scene: scene.name.clone(),
    }
}

fn all_converged<'a>(responses: impl Iterator<Item = &'a Response>) -> Result<(), Error> {
    let (mut points, mut unconverged) = (0, 0);
    for orbit in responses.flat_map(|r| &r.orbits) {
        points += 1;
        unconverged += usize::from(!orbit.outcome.is_converged());
    }
    match unconverged {
        0 => Ok(()),
        _ => Err(Error::NotConverged {
            unconverged,
            points,
        }),
    }
}

fn hertz(omega2: f64) -> f64 {
    omega2.max(0.0).sqrt() / std::f64::consts::TAU
}
