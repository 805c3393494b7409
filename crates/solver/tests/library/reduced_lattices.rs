//! Comparison of the reduction of two spring lattices with their full matrices.

use crate::shared_lattices::{assembly, forces, observed};
use dovetail_numerics::sparse::dense as to_dense;
use dovetail_solver::fem::{FemError, join};
use dovetail_solver::model::{Body, BodyNode, Model, NodeMotion, Slave};
use dovetail_solver::reduced::ReducedModel;
use dovetail_solver::reduction::craig_bampton::{condense, fixed_interface_modes};
use dovetail_solver::reduction::{
    Highest, Recovery, Reduction, ReductionError, StuckModes, analyse, reduce, reduce_analysed,
    stuck_modes,
};
use dovetail_solver::structure::{BodyMatrices, InterfaceNode, Structure};
use dovetail_testkit::threads::run_on_threads;
use dovetail_testkit::words::has;
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, c64};
use nalgebra_sparse::CscMatrix;

/// More modes than there are: all of them.
const ALL: usize = 1000;

fn wanted(count: usize) -> StuckModes {
    StuckModes::new(Some(count), Highest::RadS(1e3))
}

const A: f64 = 3e-7;
const B: f64 = 40.0;
const FREQUENCIES: [f64; 4] = [0.0, 2.3e3, 1.1e4, 4.7e4];

fn dynamic_stiffness(k: &Mat<f64>, m: &Mat<f64>, w: f64) -> Mat<c64> {
    Mat::from_fn(k.nrows(), k.ncols(), |i, j| {
        c64::new(1.0, w * A) * k[(i, j)] - c64::new(w * w, -w * B) * m[(i, j)]
    })
}

/// Lambda(w) of method section 2b.
fn lambda(model: &ReducedModel, w: f64) -> Mat<c64> {
    let mut z = dynamic_stiffness(&model.stiffness, &model.mass, w);
    let s = c64::new(w * w, -w * B);
    for (mode, &omega2) in model.omega2.iter().enumerate() {
        let d = c64::new(1.0, w * A) * omega2 - s;
        for j in 0..z.ncols() {
            for i in 0..z.nrows() {
                let p = model.coupling[(i, mode)] * model.coupling[(j, mode)];
                z[(i, j)] -= s * s * p / d;
            }
        }
    }
    z
}

fn complex(re: &[f64], im: &[f64]) -> Mat<c64> {
    Mat::from_fn(re.len(), 1, |i, _| c64::new(re[i], im[i]))
}

fn close(a: &Mat<c64>, b: &Mat<c64>, tolerance: f64) {
    let error = (a - b).norm_max() / b.norm_max();
    assert!(error < tolerance, "{error}");
}

/// Reductions of whole bodies, and of both reduced with as many modes as they have.
fn both_ways(count: usize) -> Vec<(Model, Structure, Reduction)> {
    [[None, None], [Some(ALL), Some(ALL)], [None, Some(ALL)]]
        .into_iter()
        .map(|modes| {
            let (model, structure) = assembly(modes);
            let reduced = reduce(&structure, wanted(count)).unwrap();
            (model, structure, reduced)
        })
        .collect()
}

/// Dense matrix of the contact nodes, which come last, turned into the frames of the pairs.
fn turn_to_frames(model: &Model, a: &Mat<f64>) -> Mat<f64> {
    let inner = a.nrows() - 3 * model.pairs.len();
    let mut r = Mat::<f64>::identity(a.nrows(), a.nrows());
    for (p, pair) in model.pairs.iter().enumerate() {
        for i in 0..3 {
            for j in 0..3 {
                r[(inner + 3 * p + i, inner + 3 * p + j)] = pair.frame[i][j];
            }
        }
    }
    &r * a * r.transpose()
}

#[test]
fn lambda_is_the_parallel_form() {
    for (model, structure, reduced) in both_ways(ALL) {
        for w in FREQUENCIES {
            let z = [0, 1].map(|b| {
                let BodyMatrices {
                    stiffness, mass, ..
                } = &structure.bodies[b];
                let k = turn_to_frames(&model, &to_dense(stiffness));
                let m = turn_to_frames(&model, &to_dense(mass));
                let z = dynamic_stiffness(&k, &m, w);
                let n = z.nrows() - 3 * model.pairs.len();
                let rest = z.get(..n, ..n).partial_piv_lu().solve(z.get(..n, n..));
                z.get(n.., n..) - z.get(n.., ..n) * rest
            });
            let parallel = &z[1] * (&z[0] + &z[1]).partial_piv_lu().solve(&z[0]);
            close(&lambda(&reduced.model, w), &parallel, 1e-9);
        }
    }
}

/// Displacements of all free degrees of freedom of a body under given forces, from its full
/// matrices.
fn solved(structure: &Structure, body: usize, w: f64, forces: &Mat<c64>) -> Mat<c64> {
    let b = &structure.bodies[body];
    let z = dynamic_stiffness(&to_dense(&b.stiffness), &to_dense(&b.mass), w);
    z.partial_piv_lu().solve(forces)
}

#[test]
fn forces_fields_and_observations_are_those_of_the_full_bodies() {
    // Pairs joined by given contact forces lambda: each body answers for itself.
    for (model, structure, reduced) in both_ways(ALL) {
        compare_with_full_bodies(&model, &structure, &reduced);
    }
}

fn compare_with_full_bodies(model: &Model, structure: &Structure, reduced: &Reduction) {
    let n = 3 * model.pairs.len();
    let contact = Mat::from_fn(n, 1, |i, _| c64::new((i as f64).cos(), 0.3 * i as f64));
    for (harmonic, w) in [(1, 2.3e3), (3, 1.1e4)] {
        let excitations = model.excitations.iter().zip(&reduced.model.unit_loads);
        let mut on_x = Mat::zeros(n, 1);
        let mut on_modes = Mat::zeros(reduced.model.omega2.len(), 1);
        for (excitation, unit) in excitations.filter(|(e, _)| e.in_time.harmonic == harmonic) {
            let amplitude =
                c64::from_polar(excitation.in_time.amplitude, -excitation.in_time.phase_rad);
            let add = |to: &mut Mat<c64>, unit: &[f64]| {
                for (i, f) in unit.iter().enumerate() {
                    to[(i, 0)] += amplitude * f;
                }
            };
            add(&mut on_x, &unit.on_x);
            add(&mut on_modes, &unit.on_modes);
        }
        // Lambda X = F - sum c fm / d - lambda, q = (fm - c . X) / d.
        let s = c64::new(w * w, -w * B);
        let mut rhs = &on_x - &contact;
        let d: Vec<c64> = reduced
            .model
            .omega2
            .iter()
            .map(|w2| c64::new(1.0, w * A) * w2 - s)
            .collect();
        let p = &reduced.model.coupling;
        for (mode, d) in d.iter().enumerate() {
            for i in 0..n {
                rhs[(i, 0)] += s * p[(i, mode)] * on_modes[(mode, 0)] / d;
            }
        }
        let x = lambda(&reduced.model, w).partial_piv_lu().solve(&rhs);
        let q = Mat::from_fn(d.len(), 1, |mode, _| {
            let cx: c64 = (0..n).map(|i| -s * p[(i, mode)] * x[(i, 0)]).sum();
            (on_modes[(mode, 0)] - cx) / d[mode]
        });

        let mut f = forces(model, harmonic);
        for (pair, entry) in model.pairs.iter().enumerate() {
            for axis in 0..3 {
                let force: c64 = (0..3)
                    .map(|row| contact[(3 * pair + row, 0)] * entry.frame[row][axis])
                    .sum();
                for (b, sign) in [(0, -1.0), (1, 1.0)] {
                    let free = model.bodies[b].dofs.interior_nodes + pair;
                    f[b][(3 * free + axis, 0)] += sign * force;
                }
            }
        }
        let exact = [0, 1].map(|b| solved(structure, b, w, &f[b]));
        // Real and imaginary parts as two columns.
        let parts = |a: &Mat<c64>| {
            Mat::from_fn(a.nrows(), 2, |i, j| {
                if j == 0 { a[(i, 0)].re } else { a[(i, 0)].im }
            })
        };
        let motion = reduced
            .recovery
            .full_motion(parts(&x).as_ref(), parts(&q).as_ref());
        for b in 0..2 {
            let found = complex(motion[b].col_as_slice(0), motion[b].col_as_slice(1));
            close(&found, &exact[b], 1e-8);
        }
        for (number, weights) in reduced.model.observations.iter().enumerate() {
            let dot = |row: &[f64], v: &Mat<c64>| -> c64 {
                row.iter().enumerate().map(|(i, r)| v[(i, 0)] * r).sum()
            };
            let found = dot(&weights.on_x, &x) + dot(&weights.on_modes, &q);
            let expected = observed(model, number, |b, dof| exact[b][(dof, 0)]);
            assert!(
                (found - expected).norm() < 1e-8 * expected.norm(),
                "{}",
                weights.name
            );
        }
    }
}

#[test]
fn statics_balance_the_full_bodies_whatever_the_modes_kept() {
    for modes in [[None, None], [Some(2), Some(3)]] {
        let (model, structure) = assembly(modes);
        balanced(&model, &structure, &reduce(&structure, wanted(1)).unwrap());
    }
}

/// Forces K u - f that act on a body from outside, at its free degrees of freedom.
fn unbalanced(body: &BodyMatrices, u: &[f64]) -> Mat<f64> {
    let force = to_dense(&body.stiffness) * MatRef::from_column_major_slice(u, u.len(), 1);
    force - MatRef::from_column_major_slice(&body.load_n, u.len(), 1)
}

fn balanced(model: &Model, structure: &Structure, reduced: &Reduction) {
    let n = 3 * model.pairs.len();
    let x: Vec<f64> = (0..n).map(|i| 1e-6 * (1.0 + i as f64).sin()).collect();
    let column = Mat::from_fn(n, 1, |i, _| x[i]);
    let elastic = &reduced.model.stiffness * &column;
    let u = reduced.recovery.full_static(&x);
    for (b, sign) in [(0, 1.0), (1, -1.0)] {
        let body = &structure.bodies[b];
        let mut residual = unbalanced(body, &u[b]);
        for (pair, entry) in model.pairs.iter().enumerate() {
            for axis in 0..3 {
                let force: f64 = (0..3)
                    .map(|row| {
                        let at = 3 * pair + row;
                        let lambda = reduced.model.static_load.on_x[at] - elastic[(at, 0)];
                        entry.frame[row][axis] * lambda
                    })
                    .sum();
                let free = model.bodies[b].dofs.interior_nodes + pair;
                residual[(3 * free + axis, 0)] += sign * force;
            }
        }
        assert!(
            residual.norm_max() < 1e-8 * 100.0,
            "{b}: {}",
            residual.norm_max()
        );
    }
    for (pair, entry) in model.pairs.iter().enumerate() {
        let node = |b: usize| {
            let at = 3 * (model.bodies[b].dofs.interior_nodes + pair);
            [0, 1, 2].map(|axis| u[b][at + axis])
        };
        let (first, second) = (node(0), node(1));
        for row in 0..3 {
            let gap: f64 = (0..3)
                .map(|axis| entry.frame[row][axis] * (first[axis] - second[axis]))
                .sum();
            assert!((gap - x[3 * pair + row]).abs() < 1e-15);
        }
    }
}

#[test]
fn fewer_stuck_modes_err_with_the_square_of_the_frequency() {
    let (_, structure) = assembly([None, None]);
    let all = reduce(&structure, wanted(ALL)).unwrap();
    let few = reduce(&structure, wanted(4)).unwrap();
    assert_eq!(
        (few.model.stuck_modes, all.truncation.amplitude),
        (4, Some(0.0))
    );
    for (a, b) in few.model.omega2[..4].iter().zip(&all.model.omega2) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    assert!(
        few.model.omega2[4..]
            .iter()
            .all(|w2| *w2 > few.model.omega2[3])
    );
    assert_eq!(few.model.stiffness, all.model.stiffness);
    let cut = all.model.omega2[4].sqrt();
    let error = |w: f64| {
        let exact = lambda(&all.model, w);
        (lambda(&few.model, w) - &exact).norm_max() / exact.norm_max()
    };
    let [low, high] = [0.05, 0.1].map(|share| error(share * cut));
    assert!(high < 0.02 && (high / low).log2() > 1.9, "{low} {high}");
}

/// Observed amplitudes over the frequency `w` where all pairs stick, undamped.
fn stuck_answer(relative: &ReducedModel, w: f64) -> Vec<f64> {
    let load = &relative.unit_loads[0].on_modes;
    let observed = relative.observations.iter().map(|observed| {
        let modes = observed.on_modes.iter().zip(load).zip(&relative.omega2);
        modes.map(|((c, f), w2)| c * f / (w2 - w * w)).sum()
    });
    observed.collect()
}

#[test]
fn residual_vectors_make_answers_exact_in_statics_and_of_fourth_order_beside() {
    let (_, structure) = assembly([None, None]);
    let all = reduce(&structure, wanted(ALL)).unwrap();
    let few = reduce(&structure, wanted(3)).unwrap();
    let largest = stuck_answer(&all.model, 0.0);
    let largest = largest.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let [still, slow, fast] = [0.0, 0.2, 0.4].map(|share| {
        let w = share * all.model.omega2[3].sqrt();
        let exact = stuck_answer(&all.model, w);
        let found = stuck_answer(&few.model, w);
        let errors = exact
            .iter()
            .zip(&found)
            .map(|(a, b)| (a - b).abs() / largest);
        errors.fold(0.0, f64::max)
    });
    assert!(still < 1e-9, "{still}");
    assert!(fast < 0.01 && (fast / slow).log2() > 3.5, "{slow} {fast}");
}

#[test]
fn the_error_by_the_modes_left_out_is_estimated_from_above_and_not_by_far() {
    let (_, structure) = assembly([None, None]);
    let all = reduce(&structure, wanted(ALL)).unwrap();
    let exact = first_yielding(&all.model);
    for count in [4, 8, 16, 32] {
        let wanted = StuckModes::new(Some(count), Highest::RadS(exact.sqrt()));
        let few = reduce(&structure, wanted).unwrap();
        let estimate = few.truncation.amplitude.unwrap();
        let error = first_yielding(&few.model) / exact - 1.0;
        println!("{count} modes: error {error:.1e}, estimated {estimate:.1e}");
        assert!(
            error < estimate && estimate < 100.0 * error,
            "{error} {estimate}"
        );
    }
}

/// Squared frequency of the first mode where each pair is a spring as stiff as the bodies behind
/// it.
fn first_yielding(relative: &ReducedModel) -> f64 {
    let (n, m) = (relative.stiffness.nrows(), relative.omega2.len());
    let own = relative.diagonal_stiffness();
    let stiffness = Mat::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) if i == j => relative.stiffness[(i, j)] + own[i],
        (true, true) => relative.stiffness[(i, j)],
        (false, false) if i == j => relative.omega2[i - n],
        _ => 0.0,
    });
    let mass = Mat::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => relative.mass[(i, j)],
        (true, false) => relative.coupling[(i, j - n)],
        (false, true) => relative.coupling[(j, i - n)],
        (false, false) => f64::from(u8::from(i == j)),
    });
    let modes = dovetail_numerics::eigen::dense::modes(stiffness.as_ref(), mass.as_ref());
    modes.unwrap().omega2[0]
}

#[test]
fn few_modes_of_a_body_are_told_by_the_errors_of_the_frequencies() {
    let (_, structure) = assembly([None, None]);
    let exact = stuck_modes(&structure, 6).unwrap();
    let (_, structure) = assembly([Some(3), Some(2)]);
    let reduced = reduce(&structure, wanted(6)).unwrap();
    let found = &reduced.model.omega2;
    let mut seen = 0;
    for ((found, exact), estimate) in found
        .iter()
        .zip(&exact)
        .zip(&reduced.truncation.frequencies)
    {
        let error = (found / exact).sqrt() - 1.0;
        println!("error {error:.2e}, estimated {estimate:.2e}");
        if error > 1e-5 && error < 0.05 {
            assert!(
                *estimate > 0.5 * error && *estimate < 2.0 * error,
                "{error} {estimate}"
            );
            seen += 1;
        }
    }
    assert!(seen >= 3);
    let (_, structure) = assembly([None, None]);
    let whole = reduce(&structure, wanted(6)).unwrap();
    assert!(whole.truncation.frequencies.is_empty());
}

#[test]
fn enough_modes_reach_beyond_the_highest_frequency_and_are_no_more_than_there_are() {
    let (_, structure) = assembly([None, None]);
    let reached = |highest_rad_s: f64| {
        let wanted = StuckModes::new(None, Highest::RadS(highest_rad_s));
        reduce(&structure, wanted).unwrap()
    };
    let all = reached(1e9);
    let unknowns = structure
        .bodies
        .iter()
        .map(|b| b.load_n.len())
        .sum::<usize>()
        - 15;
    assert_eq!(
        (all.model.stuck_modes, all.model.omega2.len()),
        (unknowns, unknowns)
    );
    let few = reached(0.2 * all.model.omega2[0].sqrt());
    let same = StuckModes::new(None, Highest::OfFirstStuckMode(0.2));
    let same = reduce(&structure, same).unwrap();
    assert_eq!(same.model.stuck_modes, few.model.stuck_modes);
    assert!(few.model.stuck_modes >= 12 && few.model.stuck_modes < unknowns);
    assert!(few.truncation.amplitude.unwrap() <= 1e-4);
    let more = reached(0.3 * all.model.omega2[20].sqrt());
    assert!(more.model.stuck_modes > 20, "{}", more.model.stuck_modes);
}

/// Harmonics above the excited ones require modes, too, but no more than 48.
#[test]
fn harmonics_that_are_kept_require_modes_up_to_a_number() {
    let (_, structure) = assembly([None, None]);
    let low = Highest::OfFirstStuckMode(0.2);
    let modes = |factor: f64| {
        let wanted = StuckModes {
            count: None,
            excited: low,
            kept: low.times(factor),
        };
        reduce(&structure, wanted).unwrap().model.stuck_modes
    };
    let [few, more, most] = [1.0, 10.0, 1e6].map(modes);
    println!("{few}, {more} and {most} modes");
    assert!(few < more, "{few} {more}");
    assert_eq!(most, StuckModes::OF_HARMONICS);
}

#[test]
fn rigid_ground_leaves_the_flank_to_x_alone() {
    let (mut model, structure) = assembly([None, None]);
    model.excitations.retain(|force| force.loads[0].0 == 0);
    model.observations.truncate(1);
    model.bodies.truncate(1);
    for pair in &mut model.pairs {
        pair.slave.masters.clear();
    }
    let structure = join(&model, structure.bodies[..1].to_vec()).unwrap();
    let reduced = reduce(&structure, wanted(ALL)).unwrap();
    // Stuck on what is rigid, the body has the modes of its flank held.
    let matrices = &structure.bodies[0];
    let held = fixed_interface_modes(matrices, ALL).unwrap();
    assert_eq!(held.omega2.len(), reduced.model.omega2.len());
    for (a, b) in held.omega2.iter().zip(&reduced.model.omega2) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    // X alone moves it: the free body has no stiffness against a translation.
    let turned = turn_to_frames(&model, &to_dense(&matrices.stiffness));
    let n = turned.nrows() - 15;
    let inner = turned
        .get(..n, ..n)
        .partial_piv_lu()
        .solve(turned.get(..n, n..));
    let exact = turned.get(n.., n..) - turned.get(n.., ..n) * inner;
    assert!((&reduced.model.stiffness - &exact).norm_max() < 1e-9 * exact.norm_max());
    let u = reduced.recovery.full_static(&[0.0; 15]);
    assert_eq!((u.len(), u[0].len()), (1, matrices.load_n.len()));
}

#[test]
fn what_is_bonded_is_what_sticks_and_has_no_unknowns() {
    let (model, structure) = assembly([None, None]);
    let whole = reduce(&structure, wanted(ALL)).unwrap();
    for left in [3, 0] {
        let mut tied = model.clone();
        let gone = tied.pairs.split_off(left);
        tied.bonded = gone.into_iter().map(|p| p.slave).collect();
        let few = 3 * left;
        for modes in [None, Some(ALL)] {
            let mut tied = join(&tied, structure.bodies.clone()).unwrap();
            for body in &mut tied.bodies {
                body.fixed_interface_modes = modes;
            }
            let reduced = reduce(&tied, wanted(ALL)).unwrap();
            let (all, some) = (&whole.model, &reduced.model);
            assert_eq!((some.stiffness.nrows(), some.pairs()), (few, left));
            let same = |a: &Mat<f64>, b: &Mat<f64>| {
                let error = (a - b.get(..few, ..few)).norm_max();
                assert!(error <= 1e-9 * b.norm_max(), "{error}");
            };
            same(&some.stiffness, &all.stiffness);
            same(&some.mass, &all.mass);
            assert_eq!(some.omega2.len(), all.omega2.len());
            for (a, b) in some.omega2.iter().zip(&all.omega2) {
                assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
            }
            for w in FREQUENCIES {
                let a = lambda(some, w);
                let b = lambda(all, w);
                let error = (&a - b.get(..few, ..few)).norm_max();
                assert!(error <= 1e-9 * b.norm_max(), "{w}: {error}");
            }
            // With what is left stuck both move alike.
            let u = reduced.recovery.full_static(&vec![0.0; few]);
            let v = whole.recovery.full_static(&[0.0; 15]);
            for (u, v) in u.iter().flatten().zip(v.iter().flatten()) {
                assert!((u - v).abs() < 1e-9 * 1e-5, "{u} {v}");
            }
            for (a, b) in some.observations.iter().zip(&all.observations) {
                for (a, b) in a.on_x.iter().zip(&b.on_x) {
                    assert!((a - b).abs() < 1e-9, "{a} {b}");
                }
            }
            for (a, b) in some.static_load.on_x.iter().zip(&all.static_load.on_x) {
                assert!((a - b).abs() < 1e-9 * 100.0, "{a} {b}");
            }
        }
    }
}

/// A chain of three bodies: bar, block, and a second bar on another side of the block, each pair
/// its own.
fn three_bodies() -> (Model, Structure) {
    let (mut model, structure) = assembly([None, None]);
    let mut third: Body = model.bodies[0].clone();
    third.name = "third".into();
    model.bodies.push(third);
    let mut bodies = structure.bodies;
    bodies.push(bodies[0].clone());
    // The first three pairs of the block are the bar's, the last two the third body's.
    for pair in &mut model.pairs[3..] {
        pair.slave.node.body = 2;
    }
    let structure = join(&model, bodies).unwrap();
    (model, structure)
}

#[test]
fn three_bodies_hang_together_by_their_own_pairs() {
    let (model, structure) = three_bodies();
    let reduced = reduce(&structure, wanted(ALL)).unwrap();
    // Given X, the bodies lie apart by it at their own pairs, and nothing else is loaded there.
    let x: Vec<f64> = (0..15).map(|i| 1e-6 * (2.0 + i as f64).cos()).collect();
    let u = reduced.recovery.full_static(&x);
    assert_eq!(u.len(), 3);
    for (p, pair) in model.pairs.iter().enumerate() {
        let moved = |at: BodyNode| {
            let free = model.bodies[at.body].dofs.free(at.node).unwrap();
            [0, 1, 2].map(|axis| u[at.body][3 * free + axis])
        };
        let (first, second) = (moved(pair.slave.node), moved(pair.slave.partner().unwrap()));
        for row in 0..3 {
            let gap: f64 = (0..3)
                .map(|k| pair.frame[row][k] * (first[k] - second[k]))
                .sum();
            assert!((gap - x[3 * p + row]).abs() < 1e-14, "{gap}");
        }
    }
    // Forces of all bodies balance: what is left of K u - f at the nodes is the contact forces.
    let mut forces = vec![[0.0; 3]; model.pairs.len()];
    for (b, (u, matrices)) in u.iter().zip(&structure.bodies).enumerate() {
        let mut residual = unbalanced(matrices, u);
        for (p, pair) in model.pairs.iter().enumerate() {
            for at in [pair.slave.node, pair.slave.partner().unwrap()]
                .into_iter()
                .filter(|at| at.body == b)
            {
                let free = model.bodies[b].dofs.free(at.node).unwrap();
                for axis in 0..3 {
                    forces[p][axis] += residual[(3 * free + axis, 0)];
                    residual[(3 * free + axis, 0)] = 0.0;
                }
            }
        }
        assert!(residual.norm_max() < 1e-6, "{b}: {}", residual.norm_max());
    }
    for force in forces.as_flattened() {
        assert!(force.abs() < 1e-6, "{force}");
    }
}

#[test]
fn a_master_that_is_a_slave_is_put_in_and_a_circle_is_an_error() {
    let (mut model, structure) = three_bodies();
    // The third body's first contact node follows the bar's, which follows the block's.
    let (bar, block) = (
        model.pairs[0].slave.node,
        model.pairs[0].slave.partner().unwrap(),
    );
    let third = BodyNode { body: 2, ..bar };
    let follows = |[node, master]: [BodyNode; 2]| Slave {
        ahead: 0,
        node,
        masters: vec![(master, 1.0)],
    };
    model.bonded = vec![follows([third, bar])];
    let structure = join(&model, structure.bodies).unwrap();
    let reduced = reduce(&structure, wanted(ALL)).unwrap();
    let x: Vec<f64> = (0..15).map(|i| 1e-6 * (1.0 + i as f64).sin()).collect();
    let u = reduced.recovery.full_static(&x);
    let moved = |at: BodyNode| {
        let free = model.bodies[at.body].dofs.free(at.node).unwrap();
        [0, 1, 2].map(|axis| u[at.body][3 * free + axis])
    };
    assert_eq!(moved(third), moved(bar));
    assert_ne!(moved(bar), moved(block));

    let error = |bonded: Vec<[BodyNode; 2]>| {
        let model = Model {
            bonded: bonded.into_iter().map(follows).collect(),
            ..model.clone()
        };
        let structure = join(&model, structure.bodies.clone()).unwrap();
        reduce(&structure, wanted(3)).unwrap_err()
    };
    let circle = error(vec![[block, third], [third, bar]]);
    assert!(matches!(circle, ReductionError::Circle), "{circle}");
    let twice = error(vec![[bar, third]]);
    assert!(
        matches!(twice, ReductionError::SlaveTwice { .. }),
        "{twice}"
    );
}

#[test]
fn threads_change_no_bit() {
    let (_, structure) = assembly([None, Some(7)]);
    let run =
        |threads: usize| run_on_threads(threads, || reduce(&structure, wanted(6)).unwrap().model);
    let (one, four) = (run(1), run(4));
    assert_eq!(one.stiffness, four.stiffness);
    assert_eq!(one.mass, four.mass);
    assert_eq!(one.coupling, four.coupling);
    assert_eq!(one.omega2, four.omega2);
    assert_eq!(one.unit_loads, four.unit_loads);
}

/// A structure that is given away is reduced as one that is kept is.
#[test]
fn a_structure_that_is_given_away_gives_the_same_bits() {
    for modes in [[None, None], [None, Some(7)]] {
        let (_, structure) = assembly(modes);
        let kept = reduce(&structure, wanted(6)).unwrap();
        let given = reduce(structure, wanted(6)).unwrap();
        assert_eq!(kept.model.stiffness, given.model.stiffness);
        assert_eq!(kept.model.mass, given.model.mass);
        assert_eq!(kept.model.coupling, given.model.coupling);
        assert_eq!(kept.model.omega2, given.model.omega2);
        assert_eq!(kept.model.static_load, given.model.static_load);
        let still = vec![0.0; kept.model.stiffness.nrows()];
        let [kept, given] = [kept, given].map(|all| all.recovery.full_static(&still));
        assert_eq!(kept, given);
    }
}

/// The analysis of an assembly serves to the last bit, whatever the stiffness is by then. That of one
/// with other unknowns is not used.
#[test]
fn an_analysis_that_is_known_serves_another_stiffness() {
    let (_, mut structure) = assembly([None, None]);
    let analysis = analyse(&structure.bodies, &structure.joints);
    let of_others = analyse(&structure.bodies, &[]);
    assert!(analysis.is_some() && of_others.is_some());
    for body in &mut structure.bodies {
        let entries = body.stiffness.values_mut().iter_mut();
        entries.for_each(|k| *k *= 1.25);
    }
    let expected = reduce(&structure, wanted(6)).unwrap().model;
    for analysis in [analysis, of_others] {
        let found = reduce_analysed(&structure, wanted(6), analysis.as_ref()).unwrap();
        assert_eq!(found.model.stiffness, expected.stiffness);
        assert_eq!(found.model.mass, expected.mass);
        assert_eq!(found.model.omega2, expected.omega2);
    }
    let (_, by_modes) = assembly([None, Some(7)]);
    assert!(analyse(&by_modes.bodies, &by_modes.joints).is_none());
}

#[test]
fn what_was_written_and_read_back_gives_the_same_bits() {
    for modes in [[None, None], [Some(5), Some(7)]] {
        let (_, structure) = assembly(modes);
        let reduced = reduce(&structure, wanted(9)).unwrap();
        let bytes = postcard::to_stdvec(&reduced.model).unwrap();
        let (relative, own): (ReducedModel, _) =
            (postcard::from_bytes(&bytes).unwrap(), &reduced.model);
        assert_eq!(relative.stiffness, own.stiffness);
        assert_eq!(relative.coupling, own.coupling);
        assert_eq!(relative.unit_loads, own.unit_loads);
        assert_eq!(relative.stuck_modes, own.stuck_modes);
        assert_eq!(relative.observations, own.observations);
        let bytes = postcard::to_stdvec(&reduced.recovery).unwrap();
        let recovery: Recovery = postcard::from_bytes(&bytes).unwrap();
        let value = |i: usize, j: usize| (i as f64 - 3.0 * j as f64).sin();
        let (x, q) = (
            Mat::from_fn(15, 3, value),
            Mat::from_fn(own.omega2.len(), 3, value),
        );
        let motion = recovery.full_motion(x.as_ref(), q.as_ref());
        assert_eq!(motion, reduced.recovery.full_motion(x.as_ref(), q.as_ref()));
        let x = x.col_as_slice(1);
        assert_eq!(recovery.full_static(x), reduced.recovery.full_static(x));
    }
}

#[test]
fn what_cannot_be_assembled_is_an_error() {
    let (mut model, structure) = assembly([None, None]);
    // Both bodies free: the bar against itself.
    let mut loose = model.bodies[0].clone();
    loose.name = "loose".into();
    let mut pairs = model.pairs.clone();
    for pair in &mut pairs {
        let opposite = BodyNode {
            body: 1,
            ..pair.slave.node
        };
        pair.slave.masters = vec![(opposite, 1.0)];
    }
    let free = Model {
        pairs,
        bodies: vec![model.bodies[0].clone(), loose],
        excitations: Vec::new(),
        observations: Vec::new(),
        ..model.clone()
    };
    let twice = join(&free, vec![structure.bodies[0].clone(); 2]).unwrap();
    let message = reduce(&twice, wanted(3)).unwrap_err().to_string();
    has(&message, "holds body ` & support");
    let pair = &mut model.pairs[0];
    let mut fixed = model.bodies[1].dofs.nodes.iter();
    let fixed = fixed.position(|m| *m == NodeMotion::Fixed);
    pair.slave.node = BodyNode {
        body: 1,
        node: fixed.unwrap() as u32,
    };
    assert!(matches!(
        join(&model, structure.bodies.clone()),
        Err(FemError::ContactNodeNotFree { .. })
    ));
    // A node of the interior is joined to no other body, whether its own is reduced by itself or
    // not.
    for modes in [None, Some(3)] {
        let (_, mut structure) = assembly([modes, None]);
        structure.joints[1].slave = InterfaceNode { body: 0, node: 4 };
        let error = reduce(&structure, wanted(3)).unwrap_err();
        has(
            &error.to_string(),
            &structure.bodies[0].node_tag(4).to_string(),
        );
        assert!(matches!(error, ReductionError::NotOfInterface { .. }));
    }
}

#[test]
fn bodies_that_nothing_holds_are_an_error() {
    let (_, mut structure) = assembly([None, None]);
    // The block without its support: rows and columns sum to nothing.
    let k = &mut structure.bodies[1].stiffness;
    let n = k.ncols();
    let mut sums = vec![0.0; n];
    for (i, j, v) in k.triplet_iter() {
        if i % 3 == j % 3 {
            sums[i] += v;
        }
    }
    for (i, j, v) in k.triplet_iter_mut() {
        if i == j {
            *v -= sums[i];
        }
    }
    let held = reduce(&structure, wanted(3));
    assert!(
        matches!(held, Err(ReductionError::NotHeld { .. })),
        "{held:?}"
    );
}

fn undamped(k: &Mat<f64>, m: &Mat<f64>, omega: f64) -> Mat<f64> {
    k - faer::Scale(omega * omega) * m
}

/// Z_bb - Z_bi Z_ii^-1 Z_ib, with the first `split` unknowns condensed if `first`, otherwise the
/// others.
fn condensed(z: &Mat<f64>, inner: std::ops::Range<usize>) -> Mat<f64> {
    let outer = if inner.start == 0 {
        inner.end..z.nrows()
    } else {
        0..inner.start
    };
    let z_ii = z.get(inner.clone(), inner.clone());
    let z_ib = z.get(inner.clone(), outer.clone());
    let z_bi = z.get(outer.clone(), inner);
    z.get(outer.clone(), outer) - z_bi * z_ii.partial_piv_lu().solve(z_ib)
}

const NO_LOADS: usize = 0;

#[test]
fn all_modes_give_the_exact_dynamic_stiffness_and_fields() {
    let (_, structure) = assembly([None, None]);
    for b in 0..2 {
        let matrices = &structure.bodies[b];
        let loads = Mat::zeros(matrices.load_n.len(), NO_LOADS);
        let reduced = condense(matrices, 1000, loads.as_ref()).unwrap();
        let split = matrices.interior_dofs();
        assert_eq!(reduced.omega2.len(), split);
        let (k, m) = (to_dense(&matrices.stiffness), to_dense(&matrices.mass));
        let (small_k, small_m) = (to_dense(&reduced.stiffness), to_dense(&reduced.mass));
        let (nk, n) = (matrices.dofs() - split, small_k.nrows());
        for omega in [0.0, 3.1e3, 1.7e4, 6.3e4] {
            let full = condensed(&undamped(&k, &m, omega), 0..split);
            let small = condensed(&undamped(&small_k, &small_m, omega), nk..n);
            let error = (&full - &small).norm_max() / full.norm_max();
            assert!(error < 1e-9, "{omega}: {error}");
        }
        // Fields: a forced motion of the contact nodes, solved on both.
        let omega = 1.7e4;
        let kept = Mat::from_fn(nk, 2, |i, j| ((i + 3 * j) as f64).sin());
        let z = undamped(&k, &m, omega);
        let interior = z
            .get(..split, ..split)
            .partial_piv_lu()
            .solve(-(z.get(..split, split..) * &kept));
        let w = undamped(&small_k, &small_m, omega);
        let modal = w
            .get(nk..n, nk..n)
            .partial_piv_lu()
            .solve(-(w.get(nk..n, ..nk) * &kept));
        let coordinates = stacked(kept.as_ref(), modal.as_ref());
        let motion = reduced.interior.motion(coordinates.as_ref());
        let expected = stacked(interior.as_ref(), kept.as_ref());
        assert!((&motion - &expected).norm_max() < 1e-9 * expected.norm_max());
    }
}

#[test]
fn statics_are_exact_without_any_mode() {
    let (_, structure) = assembly([None, None]);
    let matrices = &structure.bodies[1];
    let f = |v: &[f64]| Mat::from_fn(v.len(), 1, |i, _| v[i]);
    let load = f(&matrices.load_n);
    let reduced = condense(matrices, 0, load.as_ref()).unwrap();
    assert_eq!(
        reduced.stiffness.ncols(),
        matrices.dofs() - matrices.interior_dofs() + 1
    );
    let exact = to_dense(&matrices.stiffness).partial_piv_lu().solve(&load);
    let on_coordinates = f(&reduced.interior.gather(&matrices.load_n));
    let found = to_dense(&reduced.stiffness)
        .partial_piv_lu()
        .solve(on_coordinates);
    let all = reduced.interior.motion(found.as_ref());
    let error = (all - &exact).norm_max() / exact.norm_max();
    assert!(error < 1e-11, "{error}");
}

#[test]
fn rigid_motion_keeps_its_mass() {
    // Translation of the free bar: u^T M u is the whole mass, whatever the modes kept.
    let (_, structure) = assembly([None, None]);
    let matrices = &structure.bodies[0];
    let loads = Mat::zeros(matrices.load_n.len(), NO_LOADS);
    let reduced = condense(matrices, 4, loads.as_ref()).unwrap();
    let all = to_dense(&matrices.mass);
    let n = all.nrows();
    let total: f64 = (0..n / 3)
        .flat_map(|i| (0..n / 3).map(move |j| (i, j)))
        .map(|(i, j)| all[(3 * i, 3 * j)])
        .sum();
    let kept = matrices.dofs() - matrices.interior_dofs();
    let u = Mat::from_fn(kept, 1, |i, _| if i % 3 == 0 { 1.0 } else { 0.0 });
    let (k, m) = (to_dense(&reduced.stiffness), to_dense(&reduced.mass));
    let small = u.transpose() * (m.get(..kept, ..kept) * &u);
    assert!((small[(0, 0)] / total - 1.0).abs() < 1e-12);
    assert!((k.get(..kept, ..kept) * &u).norm_max() < 1e-12 * 3e7 * 50.0);
}

#[test]
fn fixed_interface_modes_are_those_of_the_body_with_its_contacts_held() {
    let (_, structure) = assembly([None, None]);
    let body = &structure.bodies[0];
    let modes = fixed_interface_modes(body, 5).unwrap();
    let flank = body.interior_dofs();
    let stiffen = |a: &CscMatrix<f64>, large: f64| {
        let mut a = to_dense(a);
        (flank..a.nrows()).for_each(|i| a[(i, i)] += large);
        a
    };
    let (k, m) = (&body.stiffness, &body.mass);
    let penalty =
        dovetail_numerics::eigen::dense::modes(stiffen(k, 1e18).as_ref(), stiffen(m, 0.0).as_ref())
            .unwrap();
    for (held, penalty) in modes.omega2.iter().zip(&penalty.omega2) {
        assert!((held / penalty - 1.0).abs() < 1e-7, "{held} {penalty}");
    }
    assert_eq!(modes.count(), 5);
}

#[test]
fn errors_name_the_body_and_the_node() {
    let (model, mut structure) = assembly([None, None]);
    let dof = 3 * 4;
    for (i, j, v) in structure.bodies[0].stiffness.triplet_iter_mut() {
        if i == dof && j == dof {
            *v = -1e10;
        }
    }
    let loads = |b: usize| Mat::<f64>::zeros(structure.bodies[b].load_n.len(), NO_LOADS);
    let message = condense(&structure.bodies[0], 2, loads(0).as_ref())
        .unwrap_err()
        .to_string();
    let local = model.bodies[0]
        .dofs
        .nodes
        .iter()
        .position(|m| *m == NodeMotion::Free(4));
    let tag = model.bodies[0].node_tags[local.unwrap()];
    has(&message, &format!("`bar` & {tag}"));
    let loads = loads(1);
    structure.bodies[1].load_n.pop();
    assert!(matches!(
        condense(&structure.bodies[1], 2, loads.as_ref()),
        Err(ReductionError::Size { .. })
    ));
}

fn stacked(upper: MatRef<'_, f64>, lower: MatRef<'_, f64>) -> Mat<f64> {
    let n = upper.nrows();
    Mat::from_fn(n + lower.nrows(), upper.ncols(), |i, j| {
        if i < n {
            upper[(i, j)]
        } else {
            lower[(i - n, j)]
        }
    })
}
