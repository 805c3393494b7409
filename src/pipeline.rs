//! The sequence of stages: what the program does, in the order in which it does it.

use std::path::{Path, PathBuf};

use faer::Mat;
use nalgebra_sparse::CscMatrix;

use crate::dlft::static_state::static_state as solve_static;
use crate::dlft::sweep::{SweepSettings, eps_of, sweep};
use crate::dlft::{Orbit, PairStatus, Response, StaticState, march::Periods};
use crate::error::Error;
use crate::export::plots::{
    AmplitudeScale, response_curve, stuck_curve, write_dissipation_map, write_response_plot,
    write_separation_map, write_static_pressure_map,
};
use crate::export::{csv, flank, manifest, vtu};
use crate::fem::statics::SolveFailure;
use crate::fem::{self, FemError, Structure, expand_to_nodes, stress};
use crate::mesh::gmsh::{self, GmshError};
use crate::mesh::{Mesh, MeshError, msh, quality};
use crate::model::{self, Model};
use crate::numerics::factor::{Cholesky, FactorError};
use crate::numerics::newton::NewtonOptions;
use crate::progress::Progress;
use crate::reduction::craig_bampton::held_modes;
use crate::reduction::damping::{Rayleigh, rayleigh};
use crate::reduction::{self, ReducedModel};
use crate::results::quantities::{pair_counts, peak};
use crate::results::recovery::NodalField;
use crate::scene::{FrequencyRange, MeshKind, Scene};

/// Where a run writes, and what it was asked by.
#[derive(Debug, Clone)]
pub struct Options {
    pub out: PathBuf,
    pub scene_file: PathBuf,
}

/// Frames of the animation of the peak.
const FRAMES: usize = 24;
/// Modes of each body alone, flanks held, that `dovetail modes` lists.
const HELD_MODES: usize = 6;
/// Newton iterations allowed for one step of the static load.
const STATIC_ITERATIONS: usize = 100;

/// Mesh to results.
///
/// # Errors
/// The stage's own error; [`Error::NotConverged`] when all is written but some frequencies failed.
pub fn run(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let (mesh, origin) = make_mesh(scene, options, progress)?;
    let model = bind(scene, &mesh, progress)?;
    let structure = assemble(&model, progress)?;
    let reduced = reduce(scene, &model, &structure, progress)?;
    let damping = rayleigh(&scene.damping, &reduced.relative.omega2)?;
    let state = statics(scene, &reduced, progress);
    let mut summary = summarise(scene, options, &model, origin);
    summary.static_state = Some(manifest::static_summary(&model, &state));
    write_modes(options, &model, &reduced, None)?;
    write_static_state(options, &model, &reduced, &state, progress)?;
    if let Err(error) = usable(&state) {
        finish(options, summary, progress)?;
        return Err(error);
    }
    let response = respond(
        scene,
        &reduced,
        damping,
        &state,
        scene.response.harmonics,
        progress,
    );
    let compared = scene
        .response
        .compare_harmonics
        .filter(|h| *h != scene.response.harmonics)
        .map(|h| (h, respond(scene, &reduced, damping, &state, h, progress)));
    write_response(
        options,
        scene,
        &model,
        &reduced,
        &response,
        compared.as_ref(),
        progress,
    )?;
    summary.response = Some(manifest::response_summary(&model, &response));
    finish(options, summary, progress)?;
    report(&model, &response, progress);
    let orbits = || {
        let compared = compared.iter().flat_map(|(_, r)| &r.orbits);
        response.orbits.iter().chain(compared)
    };
    match orbits().filter(|o| !o.outcome.is_converged()).count() {
        0 => Ok(()),
        unconverged => Err(Error::NotConverged {
            unconverged,
            points: orbits().count(),
        }),
    }
}

/// Only the mesh: made, checked, its flanks paired.
///
/// # Errors
/// gmsh, an unreadable or unusable mesh, groups it lacks, flanks that do not match.
pub fn mesh(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let (mesh, origin) = make_mesh(scene, options, progress)?;
    let model = bind(scene, &mesh, progress)?;
    finish(options, summarise(scene, options, &model, origin), progress)
}

/// Modes: of each body with its flanks held (full model), fixed-interface, and of the stuck assembly.
///
/// # Errors
/// Those of [`mesh`], of the finite elements and of the reduction.
pub fn modes(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let (mesh, origin) = make_mesh(scene, options, progress)?;
    let model = bind(scene, &mesh, progress)?;
    let structure = assemble(&model, progress)?;
    let held = {
        let _stage = progress.stage("modes of each body, flanks held");
        let mut held = Vec::new();
        for (body, matrices) in model.bodies.iter().zip(&structure.bodies) {
            held.push(held_modes(body, matrices, HELD_MODES)?.omega2);
        }
        held
    };
    let reduced = reduce(scene, &model, &structure, progress)?;
    let rows = write_modes(options, &model, &reduced, Some(&held))?;
    for row in rows.iter().filter(|r| r.mode <= HELD_MODES) {
        println!(
            "{:<15} {:<10} {:>3} {:>14.4} Hz",
            row.kind, row.body, row.mode, row.frequency_hz
        );
    }
    finish(options, summarise(scene, options, &model, origin), progress)
}

/// Up to the static state under rotation.
///
/// # Errors
/// Those of [`modes`]; [`Error::StaticState`] when the state was not found.
pub fn static_state(scene: &Scene, options: &Options, progress: &Progress) -> Result<(), Error> {
    let (mesh, origin) = make_mesh(scene, options, progress)?;
    let model = bind(scene, &mesh, progress)?;
    let structure = assemble(&model, progress)?;
    let reduced = reduce(scene, &model, &structure, progress)?;
    let state = statics(scene, &reduced, progress);
    let mut summary = summarise(scene, options, &model, origin);
    summary.static_state = Some(manifest::static_summary(&model, &state));
    write_modes(options, &model, &reduced, None)?;
    write_static_state(options, &model, &reduced, &state, progress)?;
    finish(options, summary, progress)?;
    usable(&state)
}

/// Says that the scene is sound; nothing is computed or written.
///
/// # Errors
/// A mesh or script that does not exist.
pub fn check(scene: &Scene, _: &Options, progress: &Progress) -> Result<(), Error> {
    match &scene.mesh.kind {
        MeshKind::File { path } => {
            std::fs::metadata(path).map_err(|source| MeshError::Io {
                path: path.clone(),
                source,
            })?;
        }
        MeshKind::Geometry { script, .. } => {
            std::fs::metadata(script).map_err(|source| GmshError::Script {
                path: script.clone(),
                source,
            })?;
        }
    }
    progress.note(&format!("scene \"{}\" is sound", scene.name));
    Ok(())
}

/// Where the mesh came from, for the summary.
struct Origin {
    source: PathBuf,
    gmsh: Option<String>,
    fallback: bool,
}

fn make_mesh(
    scene: &Scene,
    options: &Options,
    progress: &Progress,
) -> Result<(Mesh, Origin), Error> {
    let _stage = progress.stage("mesh");
    let origin = match &scene.mesh.kind {
        MeshKind::File { path } => Origin {
            source: path.clone(),
            gmsh: None,
            fallback: false,
        },
        MeshKind::Geometry {
            script,
            parameters,
            time_limit_s,
            ..
        } => {
            let out = options.out.join("mesh.msh");
            create_folder(&options.out)?;
            match gmsh::generate(script, parameters, *time_limit_s, &out) {
                Ok(made) => {
                    for warning in &made.warnings {
                        progress.warning(&format!("gmsh: {warning}"));
                    }
                    Origin {
                        source: out,
                        gmsh: Some(made.version),
                        fallback: false,
                    }
                }
                Err(missing @ GmshError::Missing { .. }) => {
                    let Some(ready) = scene.mesh.kind.equivalent_fallback() else {
                        return Err(missing.into());
                    };
                    progress.warning(&format!(
                        "gmsh is not installed: using the ready mesh {}, made with the same parameters",
                        ready.display()
                    ));
                    Origin {
                        source: ready.to_path_buf(),
                        gmsh: None,
                        fallback: true,
                    }
                }
                Err(error) => return Err(error.into()),
            }
        }
    };
    let mesh = msh::read(&origin.source, scene.mesh.metres_per_unit)?;
    quality::check(&mesh)?;
    Ok((mesh, origin))
}

fn create_folder(path: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(path).map_err(|source| Error::Io {
        action: "creating the folder",
        path: path.to_path_buf(),
        source,
    })
}

fn bind(scene: &Scene, mesh: &Mesh, progress: &Progress) -> Result<Model, Error> {
    let _stage = progress.stage("model");
    let model = model::bind(scene, mesh)?;
    let tets: usize = model.bodies.iter().map(|b| b.tet_count()).sum();
    progress.note(&format!(
        "{tets} tetrahedra, {} dofs, {} contact pairs (largest mismatch {:.1e} m)",
        model
            .bodies
            .iter()
            .map(|b| 3 * b.dofs.free_nodes())
            .sum::<usize>(),
        model.pairs.len(),
        model.largest_mismatch_m
    ));
    Ok(model)
}

fn assemble(model: &Model, progress: &Progress) -> Result<Structure, FemError> {
    let _stage = progress.stage("finite elements");
    let solve = |k: &CscMatrix<f64>, f: &[f64]| {
        let factor = Cholesky::factor(k).map_err(|error| match error {
            FactorError::NotPositiveDefinite { dof } | FactorError::Singular { dof, .. } => {
                SolveFailure::NotPositiveDefinite { dof }
            }
            other => SolveFailure::Factorisation(Box::new(other)),
        })?;
        let mut x = f.to_vec();
        factor.solve_vector(&mut x);
        Ok(x)
    };
    fem::assemble(model, &solve)
}

fn reduce(
    scene: &Scene,
    model: &Model,
    structure: &Structure,
    progress: &Progress,
) -> Result<ReducedModel, Error> {
    let _stage = progress.stage("reduction");
    let reduced = reduction::reduce(model, structure, scene.response.stuck_modes)?;
    if let Some(omega2) = reduced.relative.omega2.first() {
        progress.note(&format!("first stuck mode {:.4} Hz", hertz(*omega2)));
    }
    Ok(reduced)
}

fn statics(scene: &Scene, reduced: &ReducedModel, progress: &Progress) -> StaticState {
    let _stage = progress.stage("static state");
    let eps = eps_of(
        &reduced.relative,
        scene.response.eps,
        scene.response.eps_scale,
    );
    let options = NewtonOptions {
        tolerance: scene.response.tolerance.min(1e-10),
        max_iterations: STATIC_ITERATIONS,
    };
    solve_static(
        &reduced.relative,
        &eps,
        scene.static_state.load_steps,
        options,
    )
}

/// Whether there is a static state to vibrate about.
fn usable(state: &StaticState) -> Result<(), Error> {
    if !state.outcome.is_converged() {
        return Err(Error::StaticState {
            outcome: state.outcome,
            iterations: state.newton_iterations,
            residual: state.residual,
        });
    }
    if state.status.iter().all(|s| *s == PairStatus::Open) {
        return Err(Error::NothingHolds);
    }
    Ok(())
}

fn frequencies_hz(scene: &Scene, reduced: &ReducedModel) -> Vec<f64> {
    let (from, to) = match scene.response.range {
        FrequencyRange::Hz { from_hz, to_hz } => (from_hz, to_hz),
        FrequencyRange::OfFirstStuckMode { from, to } => {
            let first = reduced.relative.omega2.first().map_or(0.0, |w2| hertz(*w2));
            (from * first, to * first)
        }
    };
    let points = scene.response.points;
    let last = points.saturating_sub(1).max(1) as f64;
    (0..points)
        .map(|i| from + (to - from) * i as f64 / last)
        .collect()
}

fn respond(
    scene: &Scene,
    reduced: &ReducedModel,
    damping: Rayleigh,
    state: &StaticState,
    harmonics: usize,
    progress: &Progress,
) -> Response {
    let plural = if harmonics == 1 { "" } else { "s" };
    let _stage = progress.stage(&format!("response, {harmonics} harmonic{plural}"));
    let frequencies_hz = frequencies_hz(scene, reduced);
    let bar = progress.bar(frequencies_hz.len(), "frequencies");
    let settings = SweepSettings {
        frequencies_hz,
        harmonics,
        samples: scene.response.samples,
        newton: NewtonOptions {
            tolerance: scene.response.tolerance,
            max_iterations: scene.response.max_newton_iterations,
        },
        periods: Periods::UntilPeriodic,
        solver: scene.response.solver,
        slip_threshold_m: scene.response.slip_threshold_m,
    };
    let eps = eps_of(
        &reduced.relative,
        scene.response.eps,
        scene.response.eps_scale,
    );
    let step = |_: &Orbit| bar.step();
    sweep(&reduced.relative, damping, &eps, state, &settings, &step)
}

fn hertz(omega2: f64) -> f64 {
    omega2.max(0.0).sqrt() / std::f64::consts::TAU
}

/// modes.csv; `held` are squared frequencies per body with the flanks held.
fn write_modes(
    options: &Options,
    model: &Model,
    reduced: &ReducedModel,
    held: Option<&[Vec<f64>]>,
) -> Result<Vec<csv::ModeRow>, Error> {
    let mut rows = Vec::new();
    let mut add = |kind: &str, body: &str, omega2: &[f64]| {
        for (i, w2) in omega2.iter().enumerate() {
            rows.push(csv::ModeRow {
                kind: kind.to_string(),
                body: body.to_string(),
                mode: i + 1,
                frequency_hz: hertz(*w2),
            });
        }
    };
    for (body, omega2) in model.bodies.iter().zip(held.unwrap_or_default()) {
        add("flanks_held", &body.name, omega2);
    }
    for (body, of_body) in model.bodies.iter().zip(&reduced.bodies) {
        add("fixed_interface", &body.name, &of_body.omega2);
    }
    add("stuck", "assembly", &reduced.relative.omega2);
    csv::write_modes(&options.out.join("modes.csv"), &rows)?;
    Ok(rows)
}

fn write_static_state(
    options: &Options,
    model: &Model,
    reduced: &ReducedModel,
    state: &StaticState,
    progress: &Progress,
) -> Result<(), Error> {
    let _stage = progress.stage("static files");
    let out = &options.out;
    csv::write_static(&out.join("static.csv"), model, state)?;
    write_static_pressure_map(&out.join("plots/static_pressure.svg"), model, state)?;
    if !state.outcome.is_converged() {
        return Ok(());
    }
    flank::write_flank_static(&out.join("flank_static.vtu"), model, state)?;
    let free = reduced.full_static(&state.x);
    let fields: Vec<_> = model
        .bodies
        .iter()
        .zip(&free)
        .map(|(body, free)| {
            let displacement = expand_to_nodes(&body.dofs, free);
            let at_elements = stress::stress(body, &displacement);
            let von_mises: Vec<f64> = stress::nodal_stress(body, &displacement)
                .into_iter()
                .map(stress::von_mises)
                .collect();
            (displacement, at_elements, von_mises)
        })
        .collect();
    let [first, second] =
        [&fields[0], &fields[1]].map(|(displacement, stress, von_mises)| vtu::StaticBodyFields {
            displacement_m: displacement,
            stress_pa: stress,
            von_mises_pa: von_mises,
        });
    vtu::write_static(&out.join("static.vtu"), model, [first, second])?;
    Ok(())
}

fn write_response(
    options: &Options,
    scene: &Scene,
    model: &Model,
    reduced: &ReducedModel,
    response: &Response,
    compared: Option<&(usize, Response)>,
    progress: &Progress,
) -> Result<(), Error> {
    let _stage = progress.stage("response files");
    let out = &options.out;
    csv::write_response(&out.join("response.csv"), model, response)?;
    if let Some((h, other)) = compared {
        csv::write_response(&out.join(format!("response_h{h}.csv")), model, other)?;
    }
    csv::write_contact(&out.join("contact.csv"), model, response)?;
    flank::write_flank_series(out, model, response)?;
    flank::write_flank_dissipation(&out.join("flank_dissipation.vtu"), model, response)?;
    write_separation_map(&out.join("plots/fig5_separation.svg"), model, response)?;
    write_dissipation_map(&out.join("plots/fig6_dissipation.svg"), model, response)?;
    if let Some(peak) = peak(response, 0) {
        write_peak_motion(out, model, reduced, &response.orbits[peak.index])?;
    }
    let label = |h: usize| format!("H = {h}");
    for (i, observation) in model.observations.iter().enumerate() {
        let quantity = format!("amplitude of {}", observation.name);
        let stuck = stuck_curve("linear (stuck)", response, i);
        let own = response_curve(&label(response_harmonics(response)), response, i);
        let mut plots = vec![("fig4", vec![stuck.clone(), own.clone()])];
        if let Some((h, other)) = compared {
            let other = response_curve(&label(*h), other, i);
            plots[0].1.insert(1, other.clone());
            plots.push(("fig3", vec![stuck, other]));
        }
        for (figure, curves) in plots {
            let path = out.join(format!("plots/{figure}_{}.svg", observation.name));
            let scale = AmplitudeScale::Linear;
            write_response_plot(&path, &scene.name, &quantity, &curves, scale)?;
        }
    }
    Ok(())
}

fn response_harmonics(response: &Response) -> usize {
    response
        .orbits
        .iter()
        .map(|o| o.harmonics)
        .max()
        .unwrap_or(0)
}

/// Both bodies over one period of an orbit.
fn write_peak_motion(
    out: &Path,
    model: &Model,
    reduced: &ReducedModel,
    orbit: &Orbit,
) -> Result<(), Error> {
    let blocks = 2 * orbit.harmonics + 1;
    let columns = |v: &[f64]| {
        let rows = v.len() / blocks;
        Mat::from_fn(rows, blocks, |i, j| v[j * rows + i])
    };
    let motion = reduced.full_motion(columns(&orbit.x).as_ref(), columns(&orbit.modal).as_ref());
    // The mean: what the static load does to the interior is not in the modes.
    let n = orbit.x.len() / blocks;
    let mean = reduced.full_static(&orbit.x[..n]);
    let fields: Vec<Vec<NodalField>> = model
        .bodies
        .iter()
        .zip(motion.iter().zip(&mean))
        .map(|(body, (motion, mean))| {
            let harmonic = (1..blocks).map(|j| expand_to_nodes(&body.dofs, motion.col_as_slice(j)));
            std::iter::once(expand_to_nodes(&body.dofs, mean))
                .chain(harmonic)
                .collect()
        })
        .collect();
    vtu::write_motion(
        out,
        "peak",
        model,
        [&fields[0], &fields[1]],
        orbit.frequency_hz,
        FRAMES,
    )?;
    Ok(())
}

fn summarise(scene: &Scene, options: &Options, model: &Model, origin: Origin) -> manifest::Summary {
    manifest::Summary {
        version: env!("CARGO_PKG_VERSION").to_string(),
        scene: manifest::SceneSummary {
            name: scene.name.clone(),
            file: options.scene_file.display().to_string(),
        },
        mesh: manifest::mesh_summary(
            model,
            origin.source.display().to_string(),
            origin.gmsh,
            origin.fallback,
        ),
        pairs: model.pairs.len(),
        stages: Vec::new(),
        static_state: None,
        response: None,
        observations: manifest::observation_summaries(model),
    }
}

/// Writes summary.json with the times of the stages.
fn finish(
    options: &Options,
    mut summary: manifest::Summary,
    progress: &Progress,
) -> Result<(), Error> {
    summary.stages = progress
        .records()
        .into_iter()
        .map(|record| manifest::StageSummary {
            name: record.name,
            seconds: record.seconds,
            peak_memory_mib: record.peak_rss_mib,
        })
        .collect();
    manifest::write_summary(&options.out.join("summary.json"), &summary)?;
    progress.note(&format!("results in {}", options.out.display()));
    Ok(())
}

/// The figures a reader asks for first, on the terminal.
fn report(model: &Model, response: &Response, progress: &Progress) {
    let held = |o: &&Orbit| o.outcome.is_converged() && o.retention_n > 0.0;
    let held: Vec<&Orbit> = response.orbits.iter().filter(held).collect();
    if !held.is_empty() {
        let largest_n = held.iter().fold(0.0_f64, |m, o| m.max(o.retention_n));
        progress.warning(&format!(
            "at {} of {} frequencies friction does not hold the blade along its slot: its mean position was held there, \
             as a lock plate does, with up to {largest_n:.3} N (column retention_n of response.csv)",
            held.len(),
            response.orbits.len(),
        ));
    }
    for (i, observation) in model.observations.iter().enumerate() {
        let Some(peak) = peak(response, i) else {
            continue;
        };
        let counts = pair_counts(&response.orbits[peak.index]);
        progress.note(&format!(
            "{}: peak {:.4e} m at {:.3} Hz; {} pairs slip, {} open, {} stick",
            observation.name,
            peak.amplitude_m,
            peak.frequency_hz,
            counts.slipping,
            counts.opening,
            counts.stuck
        ));
    }
}
