//! The sparse solver and the reduction on meshes of any size, beside other solvers: see compare.sh.
//!
//! ```text
//! cargo bench --bench solvers -- stages MESH [MODES]    seconds and memory of finite elements and reduction
//! cargo bench --bench solvers -- matrix MESH FILE       stiffness of the blade, flanks held, for `solve` and peers.c
//! cargo bench --bench solvers -- solve FILE THREADS     analysis, factor, 256 right-hand sides
//! ```
//!
//! MESH: of geometry/dovetail.geo, in millimetres. Processor seconds are of all threads; on a busy machine they say
//! more than the wall clock.

use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use dovetail::scene;
use dovetail_numerics::factor::Symbolic;
use dovetail_numerics::sparse::{submatrix, times};
use dovetail_solver::fem::assemble;
use dovetail_solver::mesh;
use dovetail_solver::model::{self, Model};
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use faer::Mat;
use nalgebra_sparse::CscMatrix;

const RIGHT_HAND_SIDES: usize = 256;

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        ["stages", mesh] => stages(mesh, None),
        ["stages", mesh, modes] => stages(mesh, Some(modes.parse().expect("a number of modes"))),
        ["matrix", mesh, file] => write_matrix(mesh, file),
        ["solve", file, threads] => solve(file, threads.parse().expect("a number of threads")),
        // `cargo bench -- word` asks every bench: the words are not for this one.
        _ => println!("solvers: stages MESH [MODES] | matrix MESH FILE | solve FILE THREADS"),
    }
}

/// Runs and prints wall and processor seconds and the peak of memory so far.
fn timed<T>(what: &str, run: impl FnOnce() -> T) -> T {
    let (start, used) = (Instant::now(), processor_seconds());
    let out = run();
    println!(
        "{what:<28} {:8.3} s wall {:8.3} s processor {:7} MiB peak",
        start.elapsed().as_secs_f64(),
        processor_seconds() - used,
        peak_mib()
    );
    out
}

fn stages(mesh: &str, count: Option<usize>) {
    let model = timed("mesh, pairs", || bound(mesh));
    let structure = timed("finite elements, rotation", || assemble(&model).unwrap());
    let reduced = timed("reduction", || {
        let highest = Highest::OfFirstStuckMode(1.05);
        reduce(&model, &structure, StuckModes { count, highest }).unwrap()
    });
    let dofs: usize = structure.bodies.iter().map(|b| b.stiffness.ncols()).sum();
    let omega2 = &reduced.relative.omega2[..reduced.stuck_modes];
    let hertz: Vec<String> = omega2
        .iter()
        .map(|w2| format!("{:.6}", w2.sqrt() / std::f64::consts::TAU))
        .collect();
    println!("{} pairs, {dofs} dofs", model.pairs.len());
    println!("{} stuck modes, Hz: {}", omega2.len(), hertz.join(" "));
}

fn write_matrix(mesh: &str, file: &str) {
    let model = bound(mesh);
    let structure = assemble(&model).unwrap();
    let (dofs, matrices) = (&model.bodies[0].dofs, &structure.bodies[0]);
    let moving: Vec<usize> = (0..3 * dofs.interior_nodes).collect();
    let k = submatrix(&matrices.stiffness, &moving, &moving);
    let mut out = BufWriter::new(std::fs::File::create(file).unwrap());
    let mut number = |v: u64| out.write_all(&v.to_le_bytes()).unwrap();
    number(k.ncols() as u64);
    number(k.nnz() as u64);
    k.col_offsets().iter().for_each(|&i| number(i as u64));
    k.row_indices().iter().for_each(|&i| number(i as u64));
    k.values().iter().for_each(|v| number(v.to_bits()));
    println!("{} unknowns, {} entries", k.ncols(), k.nnz());
}

fn read_matrix(file: &str) -> CscMatrix<f64> {
    let mut bytes = Vec::new();
    let mut source = std::fs::File::open(file).unwrap();
    source.read_to_end(&mut bytes).unwrap();
    let numbers: Vec<u64> = bytes
        .chunks_exact(8)
        .map(|b| u64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let (n, entries) = (numbers[0] as usize, numbers[1] as usize);
    let (offsets, rest) = numbers[2..].split_at(n + 1);
    let (rows, values) = rest.split_at(entries);
    let whole = |v: &[u64]| v.iter().map(|&i| i as usize).collect::<Vec<_>>();
    let values = values.iter().map(|&v| f64::from_bits(v)).collect();
    CscMatrix::try_from_csc_data(n, n, whole(offsets), whole(rows), values).unwrap()
}

fn solve(file: &str, threads: usize) {
    let k = read_matrix(file);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .unwrap();
    println!("dovetail, {} unknowns, {threads} threads", k.ncols());
    let symbolic = timed("analysis", || Symbolic::analyse(&k).unwrap());
    let factor = timed("factor", || symbolic.cholesky(&k).unwrap());
    for columns in [1, 8, 16, RIGHT_HAND_SIDES] {
        let b = Mat::from_fn(k.ncols(), columns, |i, j| ((i + 7 * j) as f64).sin());
        let mut x = b.clone();
        timed(&format!("solve {columns}"), || {
            factor.solve_in_place(x.as_mut());
        });
        let error = (times(&k, x.as_ref()) - &b).norm_l2() / b.norm_l2();
        assert!(error < 1e-6, "residual {error}");
    }
    println!("{} entries", factor.symbolic().factor_entries());
}

fn bound(mesh: &str) -> Model {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = std::path::absolute(PathBuf::from(mesh)).unwrap();
    let overrides = vec![format!("mesh.file={}", file.display())];
    let scene = scene::load(&here.join("scenes/paper.toml"), &overrides).unwrap();
    let assembly = scene.assembly().unwrap();
    let mesh = mesh::read(&file, assembly.mesh.metres_per_unit).unwrap();
    model::bind(assembly, &mesh).unwrap()
}

/// Of the process so far; 0 where the system does not say.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|f| f.parse::<f64>().ok());
    ticks(13).unwrap_or(0.0) / 100.0 + ticks(14).unwrap_or(0.0) / 100.0
}

fn peak_mib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = peak.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
    kib.unwrap_or(0) / 1024
}
