//! Comparison of the reduced model with the full finite elements: two cubes on each other, ten-node
//! tetrahedra with tied mid-edge nodes, one of them rotating, solved densely by faer.

use crate::elements::algebra::dense_omega2;
use crate::shared_lattices::{forces, observed};
use crate::shared_scenes::{blocks_assembly, ready};
use dovetail_numerics::sparse::dense;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::fem::assemble;
use dovetail_solver::model::Assembly;
use dovetail_solver::model::{DashpotSpec, ExcitationKind, ExcitationSpec, Model, bind};
use dovetail_solver::problem::LinearReference;
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::reduced::{
    DiscExcitation, Influence, InfluenceCoefficient, ReducedModel, Waves,
};
use dovetail_solver::reduction::craig_bampton::fixed_interface_modes;
use dovetail_solver::reduction::{Highest, Reduction, StuckModes, reduce, stuck_modes};
use dovetail_solver::structure::{BodyMatrices, Structure};
use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use std::collections::BTreeMap;

const DAMPING: Rayleigh = Rayleigh {
    stiffness_s: 2e-9,
    mass_per_s: 3e3,
};
/// More modes than there are: all of them.
const ALL: usize = 10_000;

fn assembled(modes: Option<usize>) -> (Model, Structure) {
    assembled_with(modes, Vec::new())
}

fn assembled_with(modes: Option<usize>, dashpots: Vec<DashpotSpec>) -> (Model, Structure) {
    let mut assembly: Assembly = blocks_assembly();
    assembly.dashpots = dashpots;
    for body in &mut assembly.bodies {
        body.fixed_interface_modes = modes;
    }
    // Fast enough for a millimetre cube to feel it.
    if let Some(rotation) = &mut assembly.rotation {
        rotation.speed_rad_s = 2e5;
        rotation.point_m = [0.0, 0.3e-3, -1e-3];
    }
    let model = bind(&assembly, &ready("blocks_order2.msh"), None).unwrap();
    let structure = assemble(&model).unwrap();
    (model, structure)
}

fn reduced(structure: &Structure) -> Reduction {
    let wanted = StuckModes::new(Some(ALL), Highest::RadS(0.0));
    reduce(structure, wanted).unwrap()
}

/// Arbitrary angular frequencies between 0.05 and 3 times that of the first stuck mode.
fn random_frequencies(reduced: &ReducedModel, count: usize) -> Vec<f64> {
    let first = reduced.omega2[0].sqrt();
    let mut state = 20_041_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        first * (0.05 + 2.95 * (state >> 11) as f64 / (1u64 << 53) as f64)
    };
    (0..count).map(|_| next()).collect()
}

/// (1 + i w a) K - (w^2 - i w b) M of a whole body.
fn full_dynamic_stiffness(body: &BodyMatrices, w: f64) -> Mat<c64> {
    let (k, m) = (dense(&body.stiffness), dense(&body.mass));
    let s = c64::new(1.0, w * DAMPING.stiffness_s);
    let z = c64::new(w * w, -w * DAMPING.mass_per_s);
    Mat::from_fn(k.nrows(), k.ncols(), |i, j| s * k[(i, j)] - z * m[(i, j)])
}

/// Rows that give the displacement of a body's flank in the frames of the pairs.
fn flank_rows(model: &Model, body: usize) -> Mat<c64> {
    let dofs = &model.bodies[body].dofs;
    let mut rows = Mat::zeros(3 * model.pairs.len(), 3 * dofs.free_nodes());
    for (i, pair) in model.pairs.iter().enumerate() {
        let node = [pair.slave.node, pair.slave.partner().unwrap()][body].node;
        for (free, weight) in dofs.weights(node as usize) {
            for (r, direction) in pair.frame.iter().enumerate() {
                for axis in 0..3 {
                    rows[(3 * i + r, 3 * free + axis)] += c64::new(weight * direction[axis], 0.0);
                }
            }
        }
    }
    rows
}

fn lambda(system: &ContactSystem, w: f64) -> Mat<c64> {
    let [re, im] = system.stiffness_at(w);
    Mat::from_fn(re.nrows(), re.ncols(), |i, j| {
        c64::new(re[(i, j)], im[(i, j)])
    })
}

fn complex(re: &[f64], im: &[f64]) -> Vec<c64> {
    re.iter()
        .zip(im)
        .map(|(re, im)| c64::new(*re, -*im))
        .collect()
}

/// Dashpots of which the one from a corner to ground leads to a damping ratio of 3 % or so in the
/// first mode, and the one between both flanks to more.
fn dashpots() -> Vec<DashpotSpec> {
    let dashpot = |first: &str, second: Option<&str>, damping_n_s_m, direction| DashpotSpec {
        name: first.to_owned(),
        first: first.to_owned(),
        second: second.map(str::to_owned),
        damping_n_s_m,
        direction,
    };
    vec![
        dashpot("corner", None, 0.3, Some([0.0, 0.6, 0.8])),
        dashpot("upper_bottom", Some("lower_top"), 5.0, None),
        dashpot("corner", Some("lower_top"), 0.2, Some([1.0, 0.0, 0.0])),
    ]
}

/// A dashpot acts on the means over its groups: a load of 1 N spread over a group does the same work.
#[test]
fn dashpots_act_on_the_mean_displacements_of_their_groups() {
    let (_, structure) = assembled_with(None, dashpots());
    let mut assembly = blocks_assembly();
    let unit = |on: &str, direction| ExcitationSpec {
        kind: ExcitationKind::force(on, direction),
        amplitude: 1.0,
        harmonic: 1,
        phase_rad: 0.0,
    };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let between = |on: [&str; 2], along| on.map(|on| unit(on, along));
    assembly.excitations = vec![unit("corner", [0.0, 0.6, 0.8])];
    for along in axes {
        let both = between(["upper_bottom", "lower_top"], along);
        assembly.excitations.extend(both);
    }
    let both = between(["corner", "lower_top"], axes[0]);
    assembly.excitations.extend(both);
    let model = bind(&assembly, &ready("blocks_order2.msh"), None).unwrap();
    let loads = assemble(&model).unwrap().excitations;
    let expected = std::iter::once((&loads[0], None));
    let expected = expected.chain(loads[1..].chunks(2).map(|both| (&both[0], Some(&both[1]))));
    let coefficients: Vec<f64> = structure.dashpots.iter().map(|(c, _)| *c).collect();
    assert_eq!(coefficients, [0.3, 5.0, 5.0, 5.0, 0.2]);
    for ((_, found), (first, second)) in structure.dashpots.iter().zip(expected) {
        for (body, found) in found.iter().enumerate() {
            for (dof, found) in found.iter().enumerate() {
                let less = second.map_or(0.0, |second| second[body][dof]);
                assert!((found - (first[body][dof] - less)).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn with_all_modes_springs_on_the_flanks_give_the_response_of_the_full_model() {
    spring_response(assembled(None));
}

/// The full matrices have the dashpots as c v v^T.
#[test]
fn with_all_modes_dashpots_give_the_response_of_the_full_model() {
    spring_response(assembled_with(None, dashpots()));
}

/// The full matrices have the air as -w A w^T, with the motions w on which it acts and a matrix A
/// without symmetry.
#[test]
fn with_all_modes_aerodynamic_influence_gives_the_response_of_the_full_model() {
    let (mut model, mut structure) = assembled_with(None, dashpots());
    structure.influenced = structure.dashpots[..2]
        .iter()
        .map(|(_, load)| {
            load.iter()
                .map(|f| f.iter().map(|f| 0.01 * f).collect())
                .collect()
        })
        .collect();
    structure.influenced.swap(0, 1);
    model.dashpots.clear();
    structure.dashpots.pop();
    let first = 0.5 * stuck_modes(&structure, 1).unwrap()[0];
    let coefficients = [[1, 1], [1, 2], [2, 1], [2, 2]].into_iter().enumerate();
    let coefficients = coefficients.map(|(i, [mode, by_mode])| InfluenceCoefficient {
        nodal_diameter: 0,
        mode,
        by_mode,
        real_n_m: [0.2, -0.5, 0.3, 0.1][i] * first,
        imaginary_n_m: [-0.3, 0.4, 0.2, -0.6][i] * first,
    });
    let coefficients: Vec<InfluenceCoefficient> = coefficients.collect();
    spring_response_with((model, structure), &coefficients);
}

/// Contact forces of linear springs, stiffer across the flank than along it: the assembly is then
/// linear, and the full one can be solved at once.
fn spring_response(assembled: (Model, Structure)) {
    spring_response_with(assembled, &[]);
}

/// Like [`spring_response`], as a sector that is excited in phase, with this aerodynamic influence.
fn spring_response_with(
    (model, structure): (Model, Structure),
    coefficients: &[InfluenceCoefficient],
) {
    let mut reduced = reduced(&structure).model;
    let excitation = DiscExcitation {
        sectors: 2,
        engine_order: 0,
    };
    let influence = Influence::new(2, &[1, 2], coefficients);
    reduced.waves = Waves::new(excitation, BTreeMap::new()).with_influence(influence);
    let problem = dovetail_solver::run::problem(reduced, &model);
    let frequencies = random_frequencies(&problem.reduced, 6);
    let system = ContactSystem::new(&problem, DAMPING);
    let n = 3 * model.pairs.len();
    let load = problem
        .excitations
        .iter()
        .find(|e| e.harmonic == 1)
        .unwrap();
    let on_x = complex(&load.cosine.on_x, &load.sine.on_x);
    let on_modes = complex(&load.cosine.on_modes, &load.sine.on_modes);
    let typical = problem.reduced.stiffness[(0, 0)];
    for (i, w) in frequencies.into_iter().enumerate() {
        let stiffness = typical * [0.02, 0.5, 40.0][i % 3];
        let spring = |dof: usize| stiffness * [1.0, 0.3, 0.4][dof % 3];

        let mut z = lambda(&system, w);
        (0..n).for_each(|dof| z[(dof, dof)] += c64::new(spring(dof), 0.0));
        let rhs = system.condensed_load(1, w, &on_x, &on_modes);
        let x = z.partial_piv_lu().solve(Mat::from_fn(n, 1, |i, _| rhs[i]));
        let x: Vec<c64> = (0..n).map(|i| x[(i, 0)]).collect();
        let q = system.modal_response(1, w, &x, &on_modes);
        let weights = &problem.reduced.observations[0];
        let product = |a: &[f64], b: &[c64]| a.iter().zip(b).map(|(a, b)| b * *a).sum::<c64>();
        let tip = product(&weights.on_x, &x) + product(&weights.on_modes, &q);

        // Both bodies whole: Z + C^T k C, C the relative displacement.
        let sizes = [0, 1].map(|b| 3 * model.bodies[b].dofs.free_nodes());
        let mut full = Mat::zeros(sizes[0] + sizes[1], sizes[0] + sizes[1]);
        let mut c = Mat::zeros(n, sizes[0] + sizes[1]);
        for (b, sign) in [(0, 1.0), (1, -1.0)] {
            let at = b * sizes[0];
            full.submatrix_mut(at, at, sizes[b], sizes[b])
                .copy_from(full_dynamic_stiffness(&structure.bodies[b], w));
            let rows = flank_rows(&model, b);
            c.submatrix_mut(0, at, n, sizes[b])
                .copy_from(Mat::from_fn(n, sizes[b], |i, j| rows[(i, j)] * sign));
        }
        let pulled = Mat::from_fn(n, c.ncols(), |i, j| c[(i, j)] * spring(i));
        full += c.transpose() * pulled;
        for (damping, on_bodies) in &structure.dashpots {
            let all = on_bodies.concat();
            for (j, moved) in all.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                for (i, pulled) in all.iter().enumerate() {
                    full[(i, j)] += c64::new(0.0, w * damping * moved * pulled);
                }
            }
        }
        let motions: Vec<Vec<f64>> = structure.influenced.iter().map(|m| m.concat()).collect();
        for of_air in coefficients {
            let [force, by] = [of_air.mode, of_air.by_mode].map(|mode| &motions[mode - 1]);
            let factor = c64::new(of_air.real_n_m, of_air.imaginary_n_m);
            for (j, moved) in by.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                for (i, pushed) in force.iter().enumerate() {
                    full[(i, j)] -= factor * *moved * *pushed;
                }
            }
        }
        let [first, second] = forces(&model, 1);
        let force = Mat::from_fn(c.ncols(), 1, |i, _| {
            if i < sizes[0] {
                first[(i, 0)]
            } else {
                second[(i - sizes[0], 0)]
            }
        });
        let u = full.partial_piv_lu().solve(&force);
        let opened = &c * &u;
        let largest = opened.norm_max();
        let off = (0..n)
            .map(|i| (x[i] - opened[(i, 0)]).norm())
            .fold(0.0, f64::max);
        assert!(
            off < 1e-9 * largest,
            "relative displacements: {:e}",
            off / largest
        );
        let exact = observed(&model, 0, |body, dof| u[(body * sizes[0] + dof, 0)]);
        let off = (tip - exact).norm() / exact.norm();
        println!("{w:.4e} rad/s: {tip:.6e}, full {exact:.6e}, off {off:.1e}");
        assert!(off < 1e-9, "{off:e}");
    }
}

#[test]
fn the_stuck_modes_form_is_the_two_bodies_in_parallel() {
    // Z_j (Z_b + Z_j)^-1 Z_b = (Z_b^-1 + Z_j^-1)^-1, Z^-1 the receptance of a whole body at its
    // flank.
    let (model, structure) = assembled(None);
    let problem = dovetail_solver::run::problem(reduced(&structure).model, &model);
    let system = ContactSystem::new(&problem, DAMPING);
    for w in random_frequencies(&problem.reduced, 5) {
        let receptance = |b: usize| -> Mat<c64> {
            let rows = flank_rows(&model, b);
            let full = full_dynamic_stiffness(&structure.bodies[b], w);
            &rows * full.partial_piv_lu().solve(rows.transpose())
        };
        let both = receptance(0) + receptance(1);
        let n = both.nrows();
        let parallel = both.partial_piv_lu().solve(Mat::<c64>::identity(n, n));
        let found = lambda(&system, w);
        let off = (&found - &parallel).norm_max() / parallel.norm_max();
        println!("{w:.4e} rad/s: off {off:.1e}");
        assert!(off < 1e-9, "{off:e}");
    }
}

#[test]
fn lanczos_and_dense_modes_of_the_elements_agree() {
    let (model, structure) = assembled(None);
    for (body, matrices) in model.bodies.iter().zip(&structure.bodies) {
        let moving: Vec<usize> = (0..3 * body.dofs.interior_nodes).collect();
        let part = |a: Mat<f64>| {
            Mat::from_fn(moving.len(), moving.len(), |i, j| a[(moving[i], moving[j])])
        };
        let exact = dense_omega2(
            &part(dense(&matrices.stiffness)),
            &part(dense(&matrices.mass)),
        );
        const COUNT: usize = 10;
        // Far above the sizes that are solved densely anyway.
        assert!(moving.len() > 200, "{}", moving.len());
        let found = fixed_interface_modes(matrices, COUNT).unwrap().omega2;
        let off = found.iter().zip(&exact).map(|(f, e)| (f / e - 1.0).abs());
        let worst = off.fold(0.0, f64::max);
        println!("{} unknowns, {COUNT} modes: off {worst:.1e}", moving.len());
        assert!(worst < 1e-9, "{found:?} {exact:?}");
    }
}

/// Squared angular frequencies of the two bodies tied at all pairs except `open`: the first one's
/// flank moves with the second's.
fn tied_omega2(model: &Model, structure: &Structure, open: &[usize]) -> Vec<f64> {
    let sizes = [0, 1].map(|b| 3 * model.bodies[b].dofs.free_nodes());
    let tied_size = sizes[0] + sizes[1] - 3 * model.pairs.len();
    let place = |b: usize, dof: usize| -> usize {
        let flank = 3 * model.bodies[0].dofs.interior_nodes;
        let width = 3 * model.bodies[0].dofs.contact_nodes;
        match (b, dof) {
            (1, dof) => sizes[0] - width + dof,
            (_, dof) if dof < flank => dof,
            (_, dof) if dof < flank + width => {
                let (pair, axis) = ((dof - flank) / 3, (dof - flank) % 3);
                match open.iter().position(|p| *p == pair) {
                    Some(i) => tied_size + 3 * i + axis,
                    None => {
                        sizes[0] - width + 3 * model.bodies[1].dofs.interior_nodes + dof - flank
                    }
                }
            }
            (_, dof) => dof - width,
        }
    };
    let total = tied_size + 3 * open.len();
    let tied = |matrix: fn(&BodyMatrices) -> &nalgebra_sparse::CscMatrix<f64>| {
        let mut sum = Mat::zeros(total, total);
        for (b, body) in structure.bodies.iter().enumerate() {
            for (i, j, v) in matrix(body).triplet_iter() {
                sum[(place(b, i), place(b, j))] += *v;
            }
        }
        sum
    };
    dense_omega2(&tied(|b| &b.stiffness), &tied(|b| &b.mass))
}

/// The frequencies are those of the full model if all stuck modes are kept.
#[test]
fn the_linear_modes_are_those_of_the_bodies_tied_at_the_closed_pairs() {
    let (model, structure) = assembled(None);
    let problem = dovetail_solver::run::problem(reduced(&structure).model, &model);
    let stuck = tied_omega2(&model, &structure, &[]);
    for open in [vec![], vec![0], vec![1, 4, 8], vec![0, 1, 2, 3, 4]] {
        let exact = tied_omega2(&model, &structure, &open);
        let found = LinearReference::new(&problem, &open);
        assert_eq!(found.not_released, None);
        let found = found.omega2;
        let off = found.iter().zip(&exact).take(6);
        let worst = off.map(|(f, e)| (f / e - 1.0).abs()).fold(0.0, f64::max);
        println!("{open:?} open: squared frequencies off {worst:.1e}");
        assert!(worst < 1e-8, "{open:?}: {worst:e}");
        let lower = exact.iter().zip(&stuck).take(6).any(|(e, s)| *e < 0.99 * s);
        assert_eq!(lower, !open.is_empty());
    }
}

#[test]
fn stuck_frequencies_come_down_to_those_of_the_full_model_as_modes_are_kept() {
    let (model, structure) = assembled(None);
    let exact = tied_omega2(&model, &structure, &[]);
    let mut before = vec![f64::INFINITY; 4];
    for modes in [1, 3, 9, 27, ALL] {
        let (_, structure) = assembled(Some(modes));
        let found = reduced(&structure).model.omega2;
        let off = found.iter().zip(&exact).take(4);
        let off = off.map(|(f, e)| format!("{:.1e}", (f / e).sqrt() - 1.0));
        let off = off.collect::<Vec<_>>().join(", ");
        println!("{modes} fixed-interface modes kept: stuck frequencies too high by {off}");
        for ((found, before), exact) in found.iter().zip(&mut before).zip(&exact) {
            assert!(
                found / exact > 1.0 - 1e-9,
                "below the full model: {found} {exact}"
            );
            assert!(
                *found <= *before * (1.0 + 1e-9),
                "more modes, higher: {found} {before}"
            );
            *before = *found;
        }
    }
    for (found, exact) in before.iter().zip(&exact) {
        assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
    }
}
