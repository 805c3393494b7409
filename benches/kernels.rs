//! Seconds of each part of a run: `cargo bench`, or `cargo bench -- dlft` for those whose name
//! contains that word. The finite elements are those of scenes/paper.toml on the ready mesh; the
//! contact is a reduced dovetail of 72 pairs (tests/data/dovetail72). docs/performance.md has the
//! figures.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use dovetail::{mesh_files, scene};
use dovetail_numerics::eigen::lowest_modes;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::nonlinear::{NewtonEnd, NewtonOptions, NewtonStatus, newton};
use dovetail_numerics::sparse::{Cholesky, submatrix};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::balance::{Balance, Setting};
use dovetail_solver::dlft::dense::powell;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::newton_krylov::{KrylovSystem, Preconditioner};
use dovetail_solver::dlft::settings::EpsChoice;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::fem::assemble;
use dovetail_solver::model::MeshKind;
use dovetail_solver::model::{self, Model};
use dovetail_solver::problem::Problem;
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::problem::inexact::InexactModel;
use dovetail_solver::reduction::{Highest, StuckModes, reduce};

const HARMONICS: usize = 3;
const SAMPLES: usize = 128;
/// Force of the excitation, N; part of the flanks slips and some pairs lift off.
const FORCE_N: f64 = 1.0;
/// Ratio of the frequency to that of the first stuck mode. It is near the peak of the response,
/// where both solvers find the same motion from the static state.
const FREQUENCY_RATIO: f64 = 0.9985;
const NEWTON: NewtonOptions = NewtonOptions::new(1e-8, 200);
const STATIC_NEWTON: NewtonOptions = NewtonOptions::new(1e-10, 100);

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Model of the paper's scene on the ready mesh, with more `--set` arguments.
fn bound(more: &[&str]) -> Model {
    let mut overrides = vec!["mesh.file=../meshes/dovetail.msh".to_owned()];
    overrides.extend(more.iter().map(|s| (*s).to_owned()));
    let scene = scene::load(&root().join("scenes/paper.toml"), &overrides).unwrap();
    let assembly = scene.assembly().unwrap();
    let source = assembly.mesh.as_ref().unwrap();
    let MeshKind::File { path } = &source.kind else {
        unreachable!("mesh.file displaces the geometry");
    };
    let mesh = mesh_files::read(path, source.units).unwrap();
    model::bind(assembly, &mesh, None).unwrap()
}

/// Times the steps from the bound mesh to the matrices of the contact solver.
fn structure(c: &mut Criterion) {
    let mut group = c.benchmark_group("structure");
    group
        .sample_size(10)
        .sampling_mode(SamplingMode::Flat)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));

    let plain = bound(&["rotation.prestress=none"]);
    group.bench_function("assembly", |b| {
        b.iter(|| assemble(black_box(&plain)).unwrap());
    });
    let model = bound(&[]);
    group.bench_function("assembly_with_prestress", |b| {
        b.iter(|| assemble(black_box(&model)).unwrap());
    });

    let structure = assemble(&model).unwrap();
    let (blade, matrices) = (&model.bodies[0], &structure.bodies[0]);
    let interior: Vec<usize> = (0..3 * blade.dofs.interior_nodes).collect();
    let stiffness = submatrix(&matrices.stiffness, &interior, &interior);
    let mass = submatrix(&matrices.mass, &interior, &interior);
    group.bench_function("cholesky_blade_interior", |b| {
        b.iter(|| Cholesky::factor(black_box(&stiffness)).unwrap());
    });
    let factor = Cholesky::factor(&stiffness).unwrap();
    group.bench_function("six_modes_blade_interior", |b| {
        b.iter(|| lowest_modes(black_box(&stiffness), &mass, 6, &factor).unwrap());
    });
    group.bench_function("reduction", |b| {
        b.iter(|| reduce(black_box(&structure), WANTED).unwrap());
    });
    group.finish();
}

const WANTED: StuckModes = StuckModes::new(None, Highest::OfFirstStuckMode(1.05));

fn reduced_dovetail() -> Problem {
    let law = PairLaw::rigid(0.3, 0.0);
    let folder = root().join("tests/data/dovetail72");
    Problem::uniform(
        dovetail_superelement::read(&folder).unwrap().model,
        law,
        FORCE_N,
    )
}

/// Newton-GMRES from `start`, with no preconditioner left over from another frequency.
fn newton_krylov(balance: &Balance, start: &[f64]) -> (Vec<f64>, NewtonEnd) {
    let mut u = start.to_vec();
    let mut preconditioner = Preconditioner::default();
    let mut system = KrylovSystem::new(balance, &mut preconditioner, 1e-2, 1e-8, &|_| false);
    let end = newton(&mut system, &mut u, NEWTON);
    (u, end)
}

/// Powell's hybrid method from `start`.
fn dogleg(balance: &Balance, start: &[f64]) -> (Vec<f64>, NewtonEnd) {
    let mut u = start.to_vec();
    let (end, _) = powell(balance, &mut u, None, NEWTON);
    (u, end)
}

/// Times the static state and one frequency of the reduced dovetail, and the parts of a Newton
/// iteration.
fn dlft(c: &mut Criterion) {
    let mut group = c.benchmark_group("dlft");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(2));

    let model = reduced_dovetail();
    group.bench_function("static_state", |b| {
        b.iter(|| static_state(black_box(&model), 10, STATIC_NEWTON));
    });

    let statics = static_state(&model, 10, STATIC_NEWTON);
    assert!(statics.outcome.is_converged());
    let first = model.reduced.omega2[0].sqrt();
    let omega = FREQUENCY_RATIO * first;
    let damping = Rayleigh::stiffness_proportional(2.0 * 0.001 / first);
    let system = ContactSystem::new(&model, damping);
    let fourier = Fourier::new(HARMONICS, SAMPLES);
    let eps = Eps::new(EpsChoice::Dynamic).values(&system, omega, HARMONICS);
    let inexact = InexactModel::new(&model.reduced);
    let mut setting = Setting::new(
        &statics,
        system.into(),
        inexact.into(),
        fourier.into(),
        eps.into(),
    );
    setting.slip_threshold_m = 0.0;
    group.bench_function("condense_one_frequency", |b| {
        b.iter(|| Balance::new(&setting, black_box(omega)));
    });

    let balance = Balance::new(&setting, omega);
    let mut still = vec![0.0; balance.force.len()];
    still[..statics.x.len()].copy_from_slice(&statics.x);
    // Both find the same motion, or the ratio of their times means nothing.
    let (motion, krylov) = newton_krylov(&balance, &still);
    let (same, hybrid) = dogleg(&balance, &still);
    for end in [&krylov, &hybrid] {
        assert_eq!(end.status, NewtonStatus::Converged, "{end:?}");
    }
    let largest = motion.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    let apart = motion.iter().zip(&same);
    let apart = apart.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(apart < 1e-6 * largest, "{apart:e} m of {largest:e} m");
    let evaluation = balance.evaluate(&motion);
    println!(
        "one frequency: {} iterations of Newton-GMRES, {} of Powell's method; {} of {} pairs active",
        krylov.iterations,
        hybrid.iterations,
        balance.linearise(&evaluation).active.len(),
        model.laws.len()
    );

    group.bench_function("evaluation", |b| {
        b.iter(|| balance.evaluate(black_box(&motion)));
    });
    group.bench_function("linearisation", |b| {
        b.iter(|| balance.linearise(black_box(&evaluation)));
    });
    group.sampling_mode(SamplingMode::Flat);
    group.bench_function("one_frequency_newton_krylov", |b| {
        b.iter(|| newton_krylov(&balance, black_box(&still)));
    });
    group.bench_function("one_frequency_powell", |b| {
        b.iter(|| dogleg(&balance, black_box(&still)));
    });
    group.finish();
}

criterion_group!(kernels, structure, dlft);
criterion_main!(kernels);
