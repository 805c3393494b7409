//! The sparse solver and the reduction on meshes of any size, beside other solvers: see compare.sh.
//!
//! `cargo bench --bench solvers --` and one of
//!
//! ```text
//! stages MESH [MODES]             seconds and memory of finite elements and reduction
//! matrix MESH FILE                stiffness and mass of the blade, flanks held
//! solve dovetail FILE THREADS     analysis, factor, 256 right-hand sides
//! solve faer FILE THREADS         the same by faer, in the order of dovetail
//! inertia dovetail FILE THREADS   the number of modes below a frequency
//! inertia faer FILE THREADS       the same from faer's L D L^T
//! modes blocks FILE THREADS       30 modes with the factor of dovetail
//! modes arpack FILE THREADS       the same by ARPACK
//! ```
//!
//! Each runs in a process of its own, so that the peak of memory is its alone.
//!
//! MESH is a mesh of geometry/dovetail.geo, in millimetres. Processor seconds are those of all
//! threads; on a busy machine they are more meaningful than the wall time.

use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use dovetail::mesh_files;
use dovetail::scene;
use dovetail_numerics::eigen::{LastModes, Modes, modes_by_arpack, modes_by_blocks};
use dovetail_numerics::sparse::{
    Symbolic, negative_eigenvalues, nested_dissection, submatrix, sum, symbolic_view, times, view,
};
use dovetail_solver::fem::assemble;
use dovetail_solver::model::{self, Model};
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::{Conj, Mat, MatMut, Par, Side, Spec};
use nalgebra_sparse::CscMatrix;
use rayon::iter::ParallelIterator;

const RIGHT_HAND_SIDES: usize = 256;
/// Numbers of right-hand sides that are solved together: few, as in a block of Lanczos vectors, and
/// many.
const COLUMNS: [usize; 4] = [1, 8, 16, RIGHT_HAND_SIDES];
const MODES: usize = 30;
/// Squared angular frequency below which modes are counted, rad2/s2: there are about fifty.
const SHIFT: f64 = 1e11;

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
        [
            task @ ("solve" | "inertia" | "modes"),
            program,
            file,
            threads,
        ] => {
            let threads = threads.parse().expect("a number of threads");
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build_global()
                .unwrap();
            let [k, m] = read_matrices(file);
            println!("{program}, {} unknowns, {threads} threads", k.ncols());
            match (task, program) {
                ("solve", "dovetail" | "faer") => {
                    drop(m);
                    match program {
                        "faer" => solve_by_faer(&k, threads),
                        _ => solve(&k),
                    }
                }
                ("inertia", "dovetail" | "faer") => inertia(&k, &m, program),
                ("modes", "blocks" | "arpack") => modes(&k, &m, program),
                _ => println!("solvers: {program} does not {task}"),
            }
        }
        // `cargo bench -- word` asks every bench: the words are not for this one.
        _ => println!(
            "solvers: stages MESH [MODES] | matrix MESH FILE | \
             (solve | inertia | modes) PROGRAM FILE THREADS"
        ),
    }
}

/// Runs `run` and prints wall and processor seconds and the peak of memory so far.
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
        let [excited, kept] = [Highest::OfFirstStuckMode(1.05); 2];
        let wanted = StuckModes {
            count,
            excited,
            kept,
        };
        reduce(&structure, wanted).unwrap()
    });
    let dofs: usize = structure.bodies.iter().map(|b| b.stiffness.ncols()).sum();
    let omega2 = reduced.model.stuck_omega2();
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
    let [k, m] = [&matrices.stiffness, &matrices.mass].map(|a| submatrix(a, &moving, &moving));
    let mut out = BufWriter::new(std::fs::File::create(file).unwrap());
    let mut number = |v: u64| out.write_all(&v.to_le_bytes()).unwrap();
    for a in [&k, &m] {
        number(a.ncols() as u64);
        number(a.nnz() as u64);
        a.col_offsets().iter().for_each(|&i| number(i as u64));
        a.row_indices().iter().for_each(|&i| number(i as u64));
        a.values().iter().for_each(|v| number(v.to_bits()));
    }
    println!("{} unknowns, {} entries", k.ncols(), k.nnz());
}

/// Reads stiffness and mass.
fn read_matrices(file: &str) -> [CscMatrix<f64>; 2] {
    let mut source = BufReader::new(std::fs::File::open(file).unwrap());
    let mut number = || {
        let mut bytes = [0; 8];
        source.read_exact(&mut bytes).unwrap();
        u64::from_le_bytes(bytes)
    };
    [(); 2].map(|()| {
        let (n, entries) = (number() as usize, number() as usize);
        let offsets = (0..=n).map(|_| number() as usize).collect();
        let rows = (0..entries).map(|_| number() as usize).collect();
        let values = (0..entries).map(|_| f64::from_bits(number())).collect();
        CscMatrix::try_from_csc_data(n, n, offsets, rows, values).unwrap()
    })
}

fn solve(k: &CscMatrix<f64>) {
    let symbolic = timed("analysis", || Symbolic::analyse(k).unwrap());
    let factor = timed("factor", || symbolic.cholesky(k).unwrap());
    for columns in COLUMNS {
        solve_columns(k, columns, |x| factor.solve_in_place(x));
    }
    println!("{} entries", factor.symbolic().factor_entries());
}

/// Solves by faer's Cholesky factor in the order of dovetail, by supernodes. The right-hand sides
/// are shared among the threads, each of which works alone, as faer is fastest this way.
fn solve_by_faer(k: &CscMatrix<f64>, threads: usize) {
    let together = if threads == 1 {
        Par::Seq
    } else {
        Par::rayon(threads)
    };
    let symbolic = timed("analysis", || faer_analysis(k));
    let mut values = vec![0.0; symbolic.len_val()];
    timed("factor", || {
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(together, Spec::default());
        symbolic
            .factorize_numeric_llt(
                &mut values,
                view(k),
                Side::Upper,
                LltRegularization::default(),
                together,
                MemStack::new(&mut MemBuffer::new(scratch)),
                Spec::default(),
            )
            .unwrap();
    });
    let factor = LltRef::new(&symbolic, &values);
    for columns in COLUMNS {
        solve_columns(k, columns, |x| {
            x.par_col_chunks_mut(columns.div_ceil(threads))
                .for_each(|x| {
                    let scratch = symbolic.solve_in_place_scratch::<f64>(x.ncols(), Par::Seq);
                    let stack = &mut MemBuffer::new(scratch);
                    factor.solve_in_place_with_conj(Conj::No, x, Par::Seq, MemStack::new(stack));
                });
        });
    }
    println!("{} entries", values.len());
}

fn faer_analysis(k: &CscMatrix<f64>) -> SymbolicCholesky<usize> {
    let order = nested_dissection(k.pattern(), 3).unwrap();
    let order = PermRef::new_checked(&order.new_to_old, &order.old_to_new, k.ncols());
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    let (pattern, order) = (symbolic_view(k.pattern()), SymmetricOrdering::Custom(order));
    factorize_symbolic_cholesky(pattern, Side::Upper, order, params).unwrap()
}

/// Times and checks the solution for this number of right-hand sides.
fn solve_columns(k: &CscMatrix<f64>, columns: usize, solve: impl Fn(MatMut<'_, f64>)) {
    let b = Mat::from_fn(k.ncols(), columns, |i, j| ((i + 7 * j) as f64).sin());
    let mut x = b.clone();
    timed(&format!("solve {columns}"), || solve(x.as_mut()));
    let error = (times(k, x.as_ref()) - &b).norm_l2() / b.norm_l2();
    assert!(error < 1e-6, "residual {error}");
}

/// Counts the eigenvalues below a shift: dovetail keeps no factor for the count, faer's L D L^T has
/// one thread.
fn inertia(k: &CscMatrix<f64>, m: &CscMatrix<f64>, program: &str) {
    let symbolic = Symbolic::analyse(k).unwrap();
    let count = if program == "dovetail" {
        timed("inertia", || {
            negative_eigenvalues(k, SHIFT, m, &symbolic).unwrap()
        })
    } else {
        let shifted = sum(k, -SHIFT, m);
        timed("inertia", || {
            symbolic.ldlt(&shifted).unwrap().negative_pivots()
        })
    };
    println!("{count} eigenvalues below {SHIFT:e} rad2/s2");
}

fn modes(k: &CscMatrix<f64>, m: &CscMatrix<f64>, program: &str) {
    let factor = Symbolic::analyse(k).unwrap().cholesky(k).unwrap();
    let found = timed(&format!("{MODES} modes"), || match program {
        "arpack" => modes_by_arpack(k, m, MODES, &factor, LastModes::Given),
        _ => modes_by_blocks(
            k,
            m,
            MODES,
            &factor,
            &Modes::none(k.ncols()),
            LastModes::Given,
        ),
    });
    let hertz = found.unwrap().frequencies_hz();
    println!("{:.6} to {:.6} Hz", hertz[0], hertz[MODES - 1]);
}

fn bound(mesh: &str) -> Model {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = std::path::absolute(PathBuf::from(mesh)).unwrap();
    let overrides = vec![format!("mesh.file={}", file.display())];
    let scene = scene::load(&here.join("scenes/paper.toml"), &overrides).unwrap();
    let assembly = scene.assembly().unwrap();
    let mesh = mesh_files::read(&file, assembly.mesh.as_ref().unwrap().units).unwrap();
    model::bind(assembly, &mesh, None).unwrap()
}

/// Processor time of the process so far, s; 0 if the system does not provide it.
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
