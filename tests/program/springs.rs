//! Springs to ground and between groups of nodes, against closed forms of rigid bodies and bars,
//! and against the same spring added as a dense matrix.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use crate::shared_bodies::{assembly, body, ready};
use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, patch_command, program, scene_command, told};
use crate::shared_runs::{number, rows, summary};
use dovetail::scene;
use dovetail_mesh::facet::shares;
use dovetail_mesh::{ElementType, Mesh};
use dovetail_numerics::eigen::dense::modes;
use dovetail_numerics::sparse::dense;
use dovetail_solver::fem;
use dovetail_solver::fem::statics::expand_to_nodes;
use dovetail_solver::model::{
    Assembly, Body, Material, Model, ModelError, NodeMotion, SpringSpec, bind,
};
use dovetail_solver::reduction::stuck_modes;
use dovetail_solver::structure::Structure;
use dovetail_testkit::block::{block, map_nodes, side_by_side};
use dovetail_testkit::folder::root;

const STEEL: Material = Material {
    young_pa: 2.1e11,
    poisson: 0.3,
    density_kg_m3: 7800.0,
};

fn spring(name: &str, first: &str, second: Option<&str>, stiffness_n_m: f64) -> SpringSpec {
    SpringSpec {
        name: name.into(),
        first: first.into(),
        second: second.map(String::from),
        stiffness_n_m,
        direction: None,
    }
}

/// Bodies of a mesh, named as their volumes, with springs only.
fn bodies_on_springs(bodies: &[&str], material: Material, springs: Vec<SpringSpec>) -> Assembly {
    let named = |name: &&str| {
        let mut body = body(name, &[]);
        body.matrices = material.into();
        body.volume = match *name {
            "volume" => "volume".into(),
            name => format!("{name}_volume"),
        };
        body
    };
    Assembly {
        springs,
        rotation: None,
        excitations: Vec::new(),
        observations: Vec::new(),
        ..assembly(bodies.iter().map(named).collect(), Vec::new(), "")
    }
}

fn frequencies_rad_s(model: &Model, count: usize) -> Vec<f64> {
    let structure = fem::assemble(model).unwrap();
    let omega2 = stuck_modes(&structure, count).unwrap();
    omega2.iter().map(|w2| w2.sqrt()).collect()
}

/// Place between two others up to which the condition holds.
fn bisected([mut low, mut high]: [f64; 2], holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

fn assert_has(found: &[f64], expected: f64, tolerance: f64, what: &str) {
    let nearest = found.iter().map(|w| (w / expected - 1.0).abs());
    let error = nearest.fold(f64::INFINITY, f64::min);
    assert!(
        error < tolerance,
        "{what}: {expected} of {found:?}, {error:e}"
    );
}

/// A rigid block on a foundation under its base: along the axis and about it like one mass on one
/// spring, sideways coupled with rocking.
#[test]
fn a_rigid_block_on_a_foundation_has_the_modes_of_a_rigid_body() {
    let [a, b, h] = [0.3, 0.2, 0.5];
    for element in [ElementType::HEX8, ElementType::TET10] {
        let mesh = block(element, [2, 2, 2], [a, b, h]);
        let k = 1e3;
        let springs = vec![spring("foot", "z_min", None, k)];
        let model = bind(&bodies_on_springs(&["volume"], STEEL, springs), &mesh, None).unwrap();
        let found = frequencies_rad_s(&model, 6);
        let m = STEEL.density_kg_m3 * a * b * h;
        assert_has(&found, (k / m).sqrt(), 1e-6, "up and down");
        for width in [a, b] {
            // [x, angle] about the centre of gravity, h/2 above the base.
            let stiffness = [k, 0.5 * k * h, k * (0.25 * h * h + width * width / 12.0)];
            let inertia = m * (width * width + h * h) / 12.0;
            let half = 0.5 * (stiffness[0] / m + stiffness[2] / inertia);
            let product = (stiffness[0] * stiffness[2] - stiffness[1].powi(2)) / (m * inertia);
            for sign in [-1.0, 1.0] {
                let omega2 = half + sign * (half * half - product).sqrt();
                assert_has(&found, omega2.sqrt(), 1e-6, "rocking");
            }
        }
        let about_axis = found
            .iter()
            .filter(|w| (*w / (k / m).sqrt() - 1.0).abs() < 1e-6);
        assert_eq!(about_axis.count(), 2, "{found:?}");
    }
}

/// Shares of the nodes of a surface group in its area, by the numbers of the mesh.
fn weights(mesh: &Mesh, group: &str) -> BTreeMap<u32, f64> {
    let mut weights = BTreeMap::new();
    let mut area = 0.0;
    for &f in &mesh.groups[group].elements {
        let nodes = mesh.facets.element_nodes(f as usize);
        let coords: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.nodes_m[n as usize]).collect();
        for (node, share) in nodes.iter().zip(shares(&coords)) {
            *weights.entry(*node).or_default() += share.area_m2;
            area += share.area_m2;
        }
    }
    weights.values_mut().for_each(|weight| *weight /= area);
    weights
}

/// Vector b of `k b b^T` on the free dofs of the mesh nodes of a body, along `d`.
fn difference(body: &Body, ends: [&BTreeMap<u32, f64>; 2], d: [f64; 3], size: usize) -> Mat<f64> {
    let mut b = Mat::zeros(size, 1);
    for (end, sign) in ends.into_iter().zip([1.0, -1.0]) {
        for (local, mesh_node) in body.mesh_nodes.iter().enumerate() {
            let Some(weight) = end.get(mesh_node) else {
                continue;
            };
            for (free, share) in body.dofs.weights(local) {
                for axis in 0..3 {
                    b[(3 * free + axis, 0)] += sign * weight * share * d[axis];
                }
            }
        }
    }
    b
}

const DIRECTIONS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const OBLIQUE: [f64; 3] = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];

/// If the auxiliary nodes are condensed, the stiffness is the dense one, to rounding.
#[test]
fn a_spring_between_two_faces_of_a_body_is_its_dense_matrix() {
    for element in [ElementType::HEX8, ElementType::TET10, ElementType::WEDGE15] {
        for direction in [None, Some(OBLIQUE)] {
            let mesh = block(element, [2, 2, 1], [0.3, 0.2, 0.1]);
            let foot = spring("foot", "z_min", None, 1e9);
            let mut between = spring("tie", "x_max", Some("y_min"), 3e9);
            between.direction = direction;
            let bound = |springs| {
                bind(&bodies_on_springs(&["volume"], STEEL, springs), &mesh, None).unwrap()
            };
            let (plain, tied) = (bound(vec![foot.clone()]), bound(vec![foot, between]));
            let stiffness =
                |model: &Model| dense(&fem::assemble(model).unwrap().bodies[0].stiffness);
            let (mut expected, whole) = (stiffness(&plain), stiffness(&tied));
            let n = expected.nrows();
            assert!(whole.nrows() > n, "there are auxiliary nodes");
            let ends = [weights(&mesh, "x_max"), weights(&mesh, "y_min")];
            for d in direction.map_or(DIRECTIONS.to_vec(), |d| vec![d]) {
                let b = difference(&plain.bodies[0], ends.each_ref(), d, n);
                expected += faer::Scale(3e9) * (&b * b.transpose());
            }
            let inner = whole.get(n.., n..).to_owned();
            let followed = inner.llt(Side::Lower).unwrap().solve(whole.get(n.., ..n));
            let found = whole.get(..n, ..n) - whole.get(..n, n..) * followed;
            let error = (&found - &expected).norm_max() / expected.norm_max();
            assert!(error < 1e-13, "{element:?} {direction:?}: {error:e}");
        }
    }
}

fn two_blocks(element: ElementType) -> Mesh {
    let lower = block(element, [2, 1, 2], [0.3, 0.2, 0.1]);
    let mut upper = block(element, [1, 2, 1], [0.2, 0.2, 0.3]);
    map_nodes(&mut upper, |x| [x[0], x[1], x[2] + 0.15]);
    side_by_side(("upper", &upper), ("lower", &lower))
}

/// The two bodies with their stiffness and mass side by side, and the spring as `k b b^T`.
fn dense_omega2(mesh: &Mesh, plain: &Model, k: f64, directions: &[[f64; 3]]) -> Vec<f64> {
    let Structure { bodies, .. } = fem::assemble(plain).unwrap();
    let sizes = [0, 1].map(|b| bodies[b].stiffness.nrows());
    let n = sizes[0] + sizes[1];
    let (mut stiffness, mut mass) = (Mat::zeros(n, n), Mat::zeros(n, n));
    for (start, body) in [0, sizes[0]].into_iter().zip(&bodies) {
        for (matrix, whole) in [(&body.stiffness, &mut stiffness), (&body.mass, &mut mass)] {
            for (i, j, v) in matrix.triplet_iter() {
                whole[(start + i, start + j)] = *v;
            }
        }
    }
    let (none, first) = (BTreeMap::new(), weights(mesh, "upper_z_min"));
    let second = weights(mesh, "lower_z_max");
    for &d in directions {
        let upper = difference(&plain.bodies[0], [&first, &none], d, sizes[0]);
        let lower = difference(&plain.bodies[1], [&none, &second], d, sizes[1]);
        let b = Mat::from_fn(n, 1, |i, _| match i.checked_sub(sizes[0]) {
            None => upper[(i, 0)],
            Some(i) => lower[(i, 0)],
        });
        stiffness += faer::Scale(k) * (&b * b.transpose());
    }
    modes(stiffness.as_ref(), mass.as_ref()).unwrap().omega2
}

/// Stiff and soft springs, also if the bodies are reduced separately with all their modes.
#[test]
fn a_spring_between_two_bodies_has_the_modes_of_its_dense_matrix() {
    let element = ElementType::HEX8;
    let mesh = two_blocks(element);
    let feet = || {
        [("a", "upper_z_max", 1e7), ("b", "lower_z_min", 1e8)]
            .map(|(name, group, k)| spring(name, group, None, k))
            .to_vec()
    };
    for (k, direction) in [(1e6, None), (1e11, None), (1e9, Some(OBLIQUE))] {
        let mut tie = spring("tie", "upper_z_min", Some("lower_z_max"), k);
        tie.direction = direction;
        let mut described = bodies_on_springs(&["upper", "lower"], STEEL, feet());
        let plain = bind(&described, &mesh, None).unwrap();
        let directions = direction.map_or(DIRECTIONS.to_vec(), |d| vec![d]);
        let expected = dense_omega2(&mesh, &plain, k, &directions);
        described.springs.push(tie);
        for kept in [None, Some(300)] {
            let mut described = described.clone();
            described.bodies[0].fixed_interface_modes = kept;
            let tied = bind(&described, &mesh, None).unwrap();
            assert_eq!(tied.bonded.len(), 1);
            let structure = fem::assemble(&tied).unwrap();
            let found = stuck_modes(&structure, 20).unwrap();
            for (mode, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let error = (found / expected - 1.0).abs();
                assert!(
                    error < 1e-9,
                    "{k} N/m, {kept:?}, mode {mode}: {found} {expected}"
                );
            }
        }
    }
}

/// Axial vibration of a bar whose end is on a spring: x tan x = k L / (E A).
#[test]
fn a_bar_on_a_foundation_is_that_of_the_closed_form() {
    let (length, width) = (1.0, 0.05);
    let material = Material {
        poisson: 0.0,
        ..STEEL
    };
    let mesh = block(ElementType::HEX20, [20, 1, 1], [length, width, width]);
    let axial = material.young_pa * width * width / length;
    for share in [0.1, 1.0, 10.0] {
        let springs = vec![spring("foot", "x_min", None, share * axial)];
        let model = bind(
            &bodies_on_springs(&["volume"], material, springs),
            &mesh,
            None,
        )
        .unwrap();
        let x = bisected([0.0, 0.5 * PI], |x| x * x.tan() < share);
        let speed = (material.young_pa / material.density_kg_m3).sqrt();
        let found = frequencies_rad_s(&model, 24);
        assert_has(&found, x * speed / length, 1e-5, "axial");
    }
}

/// A free beam: six rigid motions near zero, then the bending of Timoshenko, whatever its springs.
#[test]
fn soft_springs_do_not_matter_to_a_free_beam() {
    let (length, width) = (1.0, 0.04);
    let mesh = block(ElementType::HEX20, [24, 1, 1], [length, width, width]);
    let mut without = None;
    for k in [1e2, 1e3, 1e4, 1e5] {
        let springs = vec![spring("soft", "z_min", None, k)];
        let model = bind(&bodies_on_springs(&["volume"], STEEL, springs), &mesh, None).unwrap();
        let structure = fem::assemble(&model).unwrap();
        let omega2 = stuck_modes(&structure, 8).unwrap();
        let rigid = k / (STEEL.density_kg_m3 * length * width * width);
        assert!(omega2[5] < 4.0 * rigid, "{k}: {omega2:?}");
        // Euler-Bernoulli: 4.73004 is the first root of cos x cosh x = 1. The two corrections of
        // Rayleigh and Timoshenko lower the frequency by less than 1.5 % at this slenderness.
        let thin = 4.730_040_7f64.powi(2) / (length * length)
            * (STEEL.young_pa * width * width / 12.0 / STEEL.density_kg_m3).sqrt();
        let ratio = omega2[6].sqrt() / thin;
        assert!((0.985..0.999).contains(&ratio), "{k} N/m: {ratio}");
        // A mode of unit mass on a foundation of stiffness k over the length has the energy k / m
        // times the mean square of its shape, which is that of a rigid motion: so much is added to
        // the square.
        let first = omega2[6].min(omega2[7]);
        let free = *without.get_or_insert(first - rigid);
        let moved = (first - free) / rigid;
        assert!((moved - 1.0).abs() < 0.05 || k == 1e2, "{k} N/m: {moved}");
    }
}

/// scenes/verification/spring_blocks.toml has the frequencies that its file states.
#[test]
fn two_free_blocks_joined_by_a_spring_vibrate_against_each_other() {
    let folder = Folder::new("spring-blocks");
    let scene = "scenes/verification/spring_blocks.toml";
    let told = told(scene_command("modes", scene, &folder, &[]), 0);
    has(&told, "spring tie: `upper_bottom` to `lower_top`");
    let modes = rows(&folder.join("modes.csv"));
    let stuck = modes.iter().filter(|row| row["kind"] == "stuck");
    let hz = stuck.map(|row| number(row, "frequency_hz"));
    // Each block of 1 mm3 of density 7800 on its own foundation of 7.8 N/m, and 1000 N/m between
    // them.
    let (mass_kg, soft, tie) = (7800.0 * 1e-9_f64, 7.8, 1000.0);
    let together = (soft / mass_kg).sqrt();
    assert_has(&hz.collect::<Vec<f64>>(), together / TAU, 1e-4, "together");
    let scene = scene::load(&root().join(scene), &[]).unwrap();
    let model = bind(scene.assembly().unwrap(), &ready("blocks_order1.msh"), None).unwrap();
    let against = ((soft + 2.0 * tie) / mass_kg).sqrt();
    assert_has(
        &frequencies_rad_s(&model, 12),
        against,
        1e-4,
        "against each other",
    );
}

/// A rigid bar on a foundation at the axis of rotation flaps. With u_z = w + x t and u_x = -z t the
/// virial of the stress is that of the centrifugal load, int s_xx dV = m Omega^2 L^2 / 3.
#[test]
fn a_rigid_bar_that_a_spring_alone_holds_flaps_as_its_prestress_says() {
    let ([length, width], k, speed_rad_s) = ([0.4, 0.1], 1e5, 10.0);
    let mesh = block(ElementType::HEX20, [4, 1, 1], [length, width, width]);
    let springs = vec![spring("foot", "x_min", None, k)];
    let mut described = bodies_on_springs(&["volume"], STEEL, springs);
    described.rotation = assembly(vec![body("volume", &[])], Vec::new(), "").rotation;
    let rotation = described.rotation.as_mut().unwrap();
    rotation.axis = [0.0, 0.0, 1.0];
    rotation.speed_rad_s = speed_rad_s;
    rotation.point_m = [0.0, 0.5 * width, 0.5 * width];
    let model = bind(&described, &mesh, None).unwrap();
    let found = frequencies_rad_s(&model, 6);
    let mass = STEEL.density_kg_m3 * length * width * width;
    let across = width * width / 12.0;
    let along = length * length / 3.0;
    let inertia = [mass, 0.5 * mass * length, mass * (along + across)];
    let tilt = k * across + speed_rad_s * speed_rad_s * mass * (along - across);
    // [[k, 0], [0, tilt]] against [[m, m L/2], [m L/2, J]]: a w^4 + b w^2 + c = 0.
    let a = inertia[0] * inertia[2] - inertia[1] * inertia[1];
    let b = -(inertia[0] * tilt + inertia[2] * k);
    for sign in [-1.0, 1.0] {
        let omega2 = (-b + sign * (b * b - 4.0 * a * k * tilt).sqrt()) / (2.0 * a);
        assert_has(&found, omega2.sqrt(), 1e-3, "flapping");
    }
}

/// First frequency of a cantilever of length 1 m under a dead load on top of a rigid strut without
/// mass on its end, Hz: `EI w'''' + P w'' = m w^2 w` with `w = w' = 0` at the foot,
/// `EI w'' = P h w'` and `EI w''' + P w' = 0` at the end.
fn beam_column_hz(rigidity_n_m2: f64, mass_kg_m: f64, load_n: f64, strut_m: f64) -> f64 {
    let p = load_n / rigidity_n_m2;
    let determinant = |omega: f64| {
        let root = (0.25 * p * p + mass_kg_m * omega * omega / rigidity_n_m2).sqrt();
        let (a, b) = ((root + 0.5 * p).sqrt(), (root - 0.5 * p).sqrt());
        let slope = [-a * a.sin() - b * b.sinh(), a * a.cos() - a * b.cosh()];
        let bend = [
            -a * a * a.cos() - b * b * b.cosh(),
            -a * a * a.sin() - a * b * b.sinh(),
        ];
        let third = [
            a.powi(3) * a.sin() - b.powi(3) * b.sinh(),
            -a.powi(3) * a.cos() - a * b * b * b.cosh(),
        ];
        let moment = [0, 1].map(|i| bend[i] - p * strut_m * slope[i]);
        let shear = [0, 1].map(|i| third[i] + p * slope[i]);
        moment[0] * shear[1] - moment[1] * shear[0]
    };
    let [low, high] = [1.0, 260.0];
    let sign = determinant(low).signum();
    bisected([low, high], |omega| determinant(omega).signum() == sign) / TAU
}

/// scenes/verification/column.toml: the axial force comes through the contact alone, so that only
/// the prestress of the static state finds it. From the cache the run has the same numbers.
#[test]
fn a_column_that_a_block_presses_on_is_softened_by_the_contact_force() {
    let cache = Folder::new("column-cache");
    let run = |prestress: &str| -> serde_json::Value {
        let folder = Folder::new("column");
        let set = format!("rotation.prestress={prestress}");
        let words = ["modes", "scenes/verification/column.toml", "--set", &set];
        let mut modes = program(root(), &words);
        ended(
            modes.arg("--cache").arg(&cache).arg("--out").arg(&folder),
            0,
        );
        summary(&folder)
    };
    let hz = |summary: &serde_json::Value| summary["stuck_frequency_hz"].as_f64().unwrap();
    let [none, held, contact] = ["none", "held_flanks", "contact"].map(run);
    assert!(none.get("prestress_passes").is_none() && held.get("prestress_passes").is_none());
    let rigidity = 2.1e11 * 0.04f64.powi(4) / 12.0;
    let column = |load_n| beam_column_hz(rigidity, 7800.0 * 0.0016, load_n, 0.05);
    let expected = column(33160.9) / column(1e-6);
    let ratio = hz(&contact) / hz(&none);
    println!("{expected:.5} {ratio:.5} {:.5}", hz(&held) / hz(&none));
    assert!((ratio - expected).abs() < 5e-4, "{ratio} {expected}");
    assert!(hz(&held) / hz(&none) > 0.98);
    let passes = contact["prestress_passes"].as_array().unwrap();
    assert!(passes.len() >= 2 && passes[0]["change"].is_null());
    assert!(passes[passes.len() - 1]["change"].as_f64().unwrap() < 1e-3);
    // The first pass takes the pairs as stuck, which they nearly are.
    let first = passes[0]["stuck_frequency_hz"].as_f64().unwrap();
    assert!((first / hz(&contact) - 1.0).abs() < 1e-2, "{first}");
    let error = held["held_flanks_error"].as_f64().unwrap();
    let there_is = 1.0 - hz(&contact) / hz(&held);
    assert!((error / there_is - 1.0).abs() < 0.05, "{error} {there_is}");
    let again = run("contact");
    for key in [
        "stuck_frequency_hz",
        "prestress_passes",
        "blade_frequency_hz",
    ] {
        assert_eq!(again[key], contact[key], "{key}");
    }
    let stages = again["stages"].as_array().unwrap();
    assert!(stages.iter().any(|s| s["from_cache"] == true), "{stages:?}");
}

/// Auxiliary nodes are not nodes of the mesh.
#[test]
fn fields_have_the_nodes_of_the_mesh() {
    let mesh = two_blocks(ElementType::HEX8);
    let springs = vec![spring("tie", "upper_z_min", Some("lower_z_max"), 1.0)];
    let model = bind(
        &bodies_on_springs(&["upper", "lower"], STEEL, springs),
        &mesh,
        None,
    )
    .unwrap();
    for body in &model.bodies {
        let free = body.dofs.free_nodes();
        let moving = body
            .dofs
            .nodes
            .iter()
            .filter(|m| matches!(m, NodeMotion::Free(_)))
            .count();
        assert!(free > moving);
        assert_eq!(body.dofs.contact_nodes, 1);
        let u: Vec<f64> = (0..3 * free).map(|i| i as f64).collect();
        assert_eq!(expand_to_nodes(&body.dofs, &u).len(), body.nodes_m.len());
        assert!((0..free).all(|n| body.mesh_node_of(n) < body.nodes_m.len()));
    }
    // Means resist no rotation: the error names a node of the mesh, and the remedy.
    let structure = fem::assemble(&model).unwrap();
    let error = stuck_modes(&structure, 3).unwrap_err().to_string();
    has(&error, "a spring & nothing holds body");
}

fn refused(first: &str, second: Option<&str>, fixed: &[&str]) -> ModelError {
    let mut mesh = two_blocks(ElementType::HEX8);
    let both = [
        &mesh.groups["upper_z_min"].nodes[..],
        &mesh.groups["lower_z_max"].nodes,
    ]
    .concat();
    let mut across = mesh.groups["upper_z_min"].clone();
    across.nodes = both;
    across.nodes.sort_unstable();
    across.dimension = 0;
    across.elements.clear();
    mesh.groups.insert("across".into(), across);
    let springs = vec![spring("tie", first, second, 1.0)];
    let mut described = bodies_on_springs(&["upper", "lower"], STEEL, springs);
    described.bodies[1].fixed = fixed.iter().map(|s| s.to_string()).collect();
    bind(&described, &mesh, None).unwrap_err()
}

#[test]
fn what_a_spring_cannot_act_on_is_an_error() {
    let unknown = refused("nowhere", None, &[]);
    assert!(
        matches!(unknown, ModelError::UnknownGroup { .. }),
        "{unknown}"
    );
    assert!(unknown.to_string().contains("spring `tie`"), "{unknown}");
    for (first, second) in [("across", None), ("upper_z_min", Some("across"))] {
        let across = refused(first, second, &[]);
        assert!(
            matches!(across, ModelError::SeveralBodies { .. }),
            "{across}"
        );
    }
    let volume = refused("upper_volume", None, &[]);
    assert!(
        matches!(volume, ModelError::SpringDimension { .. }),
        "{volume}"
    );
    let fixed = refused("upper_z_min", Some("lower_z_max"), &["lower_z_max"]);
    assert!(matches!(fixed, ModelError::NodesFixed { .. }), "{fixed}");
}

/// The column "held by" of the bodies of a report.
#[test]
fn a_report_says_that_springs_hold_a_body_and_contacts_one_without_any() {
    let on_springs = "spring=[{name=\"side\",first=\"upper_top\",stiffness_n_m=1e3}]";
    for (set, expected) in [(&[][..], "contacts"), (&[on_springs], "springs")] {
        let folder = Folder::new("held-by");
        ended(patch_command("static", &folder, set), 0);
        let report = folder.text("report.html");
        let (_, table) = report.split_once("<th>held by</th>").unwrap();
        let row = table
            .split("<tr>")
            .find(|row| row.starts_with("<td>upper</td>"));
        let held = row.unwrap().rsplit("<td>").next().unwrap();
        assert!(held.starts_with(&format!("{expected}</td>")), "{held}");
    }
}
