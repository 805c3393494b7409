//! Bodies of which some unknowns have no mass, against their full matrices. Loads and observed points may
//! be where no mass is.

use dovetail_solver::reduced::{ObservedQuantity, ReducedModel};
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use dovetail_solver::structure::{BodyMatrices, InterfaceNode, Joint, ObservedWork, Structure};
use dovetail_testkit::lattice::scattered;
use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use nalgebra_sparse::{CooMatrix, CscMatrix};

const NODES: usize = 8;
const SIZE: usize = 3 * NODES;
const A: f64 = 2e-5;
const B: f64 = 3.0;
const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn sparse(a: &Mat<f64>) -> CscMatrix<f64> {
    let mut coo = CooMatrix::new(a.nrows(), a.ncols());
    for j in 0..a.ncols() {
        for i in (0..a.nrows()).filter(|i| a[(*i, j)] != 0.0) {
            coo.push(i, j, a[(i, j)]);
        }
    }
    CscMatrix::from(&coo)
}

/// Stiffness, N/m, and mass, kg. The unknowns without mass differ from case to case; some masses move
/// with several unknowns, and couple unknowns that the stiffness does not.
fn matrices(case: usize, without: impl Fn(usize) -> bool) -> [Mat<f64>; 2] {
    let number = |i: usize| scattered(1000 * case + i);
    let springs = Mat::from_fn(SIZE, SIZE, |i, j| match i.abs_diff(j) {
        0 => 1.0 + number(i).abs(),
        1..4 => 0.6 * number(40 * i + j),
        _ => 0.0,
    });
    let shapes = Mat::from_fn(SIZE, SIZE / 2, |i, j| {
        match (without(i), i % (SIZE / 2) == j) {
            (true, _) => 0.0,
            (false, true) => 1.0,
            (false, false) => 0.3 * number(7000 + 40 * i + j).powi(3),
        }
    });
    let own = Mat::from_fn(SIZE, SIZE, |i, j| {
        match i == j && i % 2 == 0 && !without(i) {
            true => 0.5 + number(9000 + i).abs(),
            false => 0.0,
        }
    });
    [
        1e6 * &springs * springs.transpose(),
        &shapes * shapes.transpose() + own,
    ]
}

/// A body whose last node is a contact pair with the ground, with a force and two observed points.
fn structure([k, m]: &[Mat<f64>; 2], loaded: usize, observed: usize, alone: bool) -> Structure {
    let unit = |dof: usize| {
        let mut vector = vec![0.0; SIZE];
        vector[dof] = 1.0;
        vec![vector]
    };
    let point = |name: &str, dof: usize| ObservedWork {
        name: name.to_owned(),
        quantity: ObservedQuantity::Displacement,
        load: unit(dof),
    };
    Structure {
        bodies: vec![BodyMatrices {
            name: "body".to_owned(),
            stiffness: sparse(k),
            mass: sparse(m),
            load_n: vec![0.0; SIZE],
            centrifugal_n_s2: Vec::new(),
            interior_nodes: NODES - 1,
            held_dofs: Vec::new(),
            fixed_interface_modes: alone.then_some(1000),
            node_tags: (1..=NODES as u64).collect(),
        }],
        joints: vec![Joint {
            slave: InterfaceNode {
                body: 0,
                node: NODES - 1,
            },
            masters: Vec::new(),
            turned: Some(IDENTITY),
            across: None,
        }],
        steady_parts: Vec::new(),
        excitations: vec![unit(loaded)],
        observations: vec![point("loaded", loaded), point("observed", observed)],
        dashpots: Vec::new(),
        influenced: Vec::new(),
    }
}

/// Observed amplitudes under the unit load at `w` rad/s, the pair free or held.
fn reduced_answer(model: &ReducedModel, w: f64, is_free: bool) -> Vec<c64> {
    let (s, z) = (c64::new(1.0, w * A), c64::new(w * w, -w * B));
    let load = &model.unit_loads[0];
    let n = model.stiffness.nrows();
    let divisors: Vec<c64> = model.omega2.iter().map(|w2| s * *w2 - z).collect();
    let coupled = |i: usize, mode: usize| -z * model.coupling[(i, mode)];
    let mut lambda = Mat::from_fn(n, n, |i, j| {
        s * model.stiffness[(i, j)] - z * model.mass[(i, j)]
    });
    let mut x = Mat::from_fn(n, 1, |i, _| c64::new(load.on_x[i], 0.0));
    for (mode, d) in divisors.iter().enumerate() {
        for i in 0..n {
            x[(i, 0)] -= coupled(i, mode) * load.on_modes[mode] / d;
            for j in 0..n {
                lambda[(i, j)] -= coupled(i, mode) * coupled(j, mode) / d;
            }
        }
    }
    x = match is_free {
        true => lambda.partial_piv_lu().solve(x),
        false => Mat::zeros(n, 1),
    };
    let x: Vec<c64> = x.col(0).iter().copied().collect();
    let q = divisors.iter().enumerate().map(|(mode, d)| {
        let by_x = x.iter().enumerate().map(|(i, x)| coupled(i, mode) * *x);
        (by_x.fold(c64::new(load.on_modes[mode], 0.0), |sum, c| sum - c)) / d
    });
    let q: Vec<c64> = q.collect();
    let points = model.observations.iter();
    points.map(|point| point.amplitude(&x, &q)).collect()
}

/// The same from the full matrices.
fn full_answer(
    [k, m]: &[Mat<f64>; 2],
    w: f64,
    is_free: bool,
    [loaded, observed]: [usize; 2],
) -> Vec<c64> {
    let size = if is_free { SIZE } else { SIZE - 3 };
    let z = Mat::from_fn(size, size, |i, j| {
        c64::new(1.0, w * A) * k[(i, j)] - c64::new(w * w, -w * B) * m[(i, j)]
    });
    let force = Mat::from_fn(size, 1, |i, _| {
        c64::new(f64::from(u8::from(i == loaded)), 0.0)
    });
    let u = z.partial_piv_lu().solve(force);
    [loaded, observed].map(|dof| u[(dof, 0)]).to_vec()
}

/// 40 patterns of mass: neither the loaded unknown nor, in every other case, the observed one has any.
#[test]
fn loads_and_observed_points_without_mass_move_as_in_the_full_matrices() {
    for case in 0..40 {
        let (loaded, observed) = (case % 17, (case * 5 + 3) % 19);
        let without = |i: usize| {
            i == loaded || (i == observed && case % 2 == 0) || scattered(31 * case + 7 * i) > 0.2
        };
        let given = matrices(case, without);
        for alone in [false, true] {
            let structure = structure(&given, loaded, observed, alone);
            let wanted = StuckModes::new(Some(1000), Highest::RadS(1e3));
            let reduction = reduce(&structure, wanted).unwrap();
            assert_eq!(reduction.truncation.amplitude, Some(0.0));
            let model = reduction.model;
            for w in [0.0, 4e2, 1.3e3, 6e3] {
                for is_free in [false, true] {
                    let found = reduced_answer(&model, w, is_free);
                    let exact = full_answer(&given, w, is_free, [loaded, observed]);
                    let still = full_answer(&given, 0.0, is_free, [loaded, observed]);
                    let scale = exact[0].norm().max(still[0].norm());
                    for (found, exact) in found.iter().zip(&exact) {
                        let error = (found - exact).norm() / scale;
                        assert!(error < 1e-9, "{case} {alone} {w} {is_free}: {error:e}");
                    }
                }
            }
        }
    }
}
