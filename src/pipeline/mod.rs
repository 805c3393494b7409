//! The sequence of stages: what the program does, in the order in which it does it.

mod files;
mod meshed;
mod solve;

use std::path::PathBuf;

use self::meshed::{Bound, HELD_MODES, Meshed};
use crate::dlft::Response;
use crate::error::Error;
use crate::export::manifest;
use crate::progress::Progress;
use crate::reduction::damping::rayleigh;
use crate::scene::{Scene, Subject};

/// Where a run writes, and what it was asked by.
#[derive(Debug, Clone)]
pub struct Options {
    pub out: PathBuf,
    pub scene_file: PathBuf,
}

/// Mesh to results.
///
/// # Errors
/// The stage's own error; [`Error::NotConverged`] when all is written but some frequencies failed.
pub fn run(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let meshed = reduced(scene, options, progress)?;
    let relative = &meshed.reduced.relative;
    let damping = rayleigh(&scene.damping, &relative.omega2)?;
    let state = solve::statics(scene, relative, progress);
    let mut summary = files::summarise(scene, options, &meshed.model, meshed.summary());
    summary.static_state = Some(manifest::static_summary(&meshed.model, &state));
    files::write_modes(options, &meshed, None)?;
    files::write_static_state(options, &meshed, &state, progress)?;
    if let Err(error) = solve::usable(&state) {
        files::finish(options, summary, progress)?;
        return Err(error);
    }
    let respond = |harmonics| solve::respond(scene, relative, damping, &state, harmonics, progress);
    let response = respond(scene.response.harmonics);
    let compared = scene
        .response
        .compare_harmonics
        .filter(|h| *h != scene.response.harmonics)
        .map(|h| (h, respond(h)));
    files::write_response(
        options,
        scene,
        &meshed,
        &response,
        compared.as_ref(),
        progress,
    )?;
    summary.response = Some(manifest::response_summary(&meshed.model, &response));
    files::finish(options, summary, progress)?;
    files::report(&meshed.model, &response, progress);
    all_converged(std::iter::once(&response).chain(compared.as_ref().map(|(_, r)| r)))
}

/// Only the mesh: made, checked, its flanks paired.
///
/// # Errors
/// gmsh, an unreadable or unusable mesh, groups it lacks, flanks that do not match.
pub fn mesh(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let Subject::Assembly(assembly) = &scene.subject;
    let bound = Bound::of(assembly, options, progress)?;
    let summary = files::summarise(scene, options, &bound.model, bound.summary());
    files::finish(options, summary, progress)
}

/// Modes: of each body with its flanks held (full model), fixed-interface, and of the stuck assembly.
///
/// # Errors
/// Those of [`mesh`], of the finite elements and of the reduction.
pub fn modes(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let meshed = reduced(scene, options, progress)?;
    let held = meshed.held_modes(progress)?;
    let rows = files::write_modes(options, &meshed, Some(&held))?;
    for row in rows.iter().filter(|r| r.mode <= HELD_MODES) {
        println!(
            "{:<15} {:<10} {:>3} {:>14.4} Hz",
            row.kind, row.body, row.mode, row.frequency_hz
        );
    }
    let summary = files::summarise(scene, options, &meshed.model, meshed.summary());
    files::finish(options, summary, progress)
}

/// Up to the static state under rotation.
///
/// # Errors
/// Those of [`modes`]; [`Error::StaticState`] when the state was not found.
pub fn static_state(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let meshed = reduced(scene, options, progress)?;
    let state = solve::statics(scene, &meshed.reduced.relative, progress);
    let mut summary = files::summarise(scene, options, &meshed.model, meshed.summary());
    summary.static_state = Some(manifest::static_summary(&meshed.model, &state));
    files::write_modes(options, &meshed, None)?;
    files::write_static_state(options, &meshed, &state, progress)?;
    files::finish(options, summary, progress)?;
    solve::usable(&state)
}

/// Says that the scene is sound; nothing is computed or written.
///
/// # Errors
/// A mesh or script that does not exist.
pub fn check(scene: &Scene, _: &Options, progress: &Progress) -> Result<(), Error> {
    match &scene.subject {
        Subject::Assembly(assembly) => meshed::check(&assembly.mesh)?,
    }
    progress.note(&format!("scene \"{}\" is sound", scene.name));
    Ok(())
}

/// The scene's subject, reduced.
fn reduced(scene: &Scene, options: &Options, progress: &Progress) -> Result<Meshed, Error> {
    match &scene.subject {
        Subject::Assembly(assembly) => {
            Meshed::of(assembly, scene.response.stuck_modes, options, progress)
        }
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
