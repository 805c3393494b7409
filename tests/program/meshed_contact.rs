//! Contact between meshed bodies against closed forms, as scenes of `scenes/verification` through
//! the program itself.
//!
//! Signs and formulas: K. L. Johnson, Contact Mechanics (Cambridge 1985): round flat punch, eq.
//! (3.34), (3.36); Hertz, ch. 4; Cattaneo and Mindlin, eq. (7.40)-(7.42), with the work per cycle
//! derived here from (7.42).

use crate::shared_folder::Folder;
use crate::shared_program::{READY_PATCH, cases, has, patch_command, said_in_one_line};
use crate::shared_runs::{Row, Run, number, sum};
use std::f64::consts::PI;

const MM: f64 = 1e-3;

/// Run of a scene on the mesh in the repository, without gmsh.
fn run_on_ready_mesh(scene: &str, name: &str) -> Run {
    let mesh = format!("mesh.file=../../meshes/verification/{scene}.msh");
    Run::new("static", &format!("verification/{scene}"), name, &[&mesh])
}

/// Run of a scene with `n` elements on the flank, each `growth / n` larger than the one before it.
fn run_on_finer_mesh(scene: &str, n: u32, growth: f64) -> Run {
    let [n, grow] = [
        format!("mesh.parameters.n={n}"),
        format!("mesh.parameters.grow={}", growth / f64::from(n)),
    ];
    let scene_file = format!("verification/{scene}");
    Run::new("static", &scene_file, scene, &[&n, &grow])
}

fn observed_m(run: &Run) -> f64 {
    number(&run.table("static_observed.csv")[0], "displacement_m")
}

fn radius_m(row: &Row) -> f64 {
    number(row, "x_m").hypot(number(row, "y_m"))
}

/// Order of convergence: -log(error ratio) / log(refinement).
fn order(coarse: f64, fine: f64, refinement: f64) -> f64 {
    (coarse / fine).ln() / refinement.ln()
}

// ------------------------------------------------------------------------------------ patch test

/// Two materials, an uneven mesh of an irregular flank: pressure, slip and displacement are exact.
#[test]
fn patch_test_uniform_pressure_across_the_interface() {
    pressure_is_uniform(&run_on_ready_mesh("patch", "patch"));
}

/// Flanks of quadrilaterals and of the triangles of wedges, with mid-edge nodes and without.
#[test]
fn patch_test_with_hexahedra_and_wedges() {
    for shape in [6, 8] {
        for order in [1, 2] {
            let [shape, order] = [("shape", shape), ("order", order)]
                .map(|(name, value)| format!("mesh.parameters.{name}={value}"));
            let set = [&shape[..], &order];
            pressure_is_uniform(&Run::new("static", "verification/patch", "shapes", &set));
        }
    }
}

/// A pressing load may be given as a force over area, or as the whole force, here on 81 mm2.
#[test]
fn patch_test_under_a_traction_and_under_a_force() {
    for size in ["traction_pa=50e6", "force_n=4050"] {
        let set = [
            READY_PATCH,
            "load.0.pressure_pa=",
            "load.0.direction=[0, 0, -1]",
            &format!("load.0.{size}"),
        ];
        pressure_is_uniform(&Run::new("static", "verification/patch", "pulled", &set));
    }
}

fn pressure_is_uniform(run: &Run) {
    let pairs = run.table("static.csv");
    assert_eq!(pairs.len(), 30);
    let areas: Vec<f64> = pairs.iter().map(|p| number(p, "area_m2")).collect();
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let smallest = areas.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(
        largest > 4.0 * smallest,
        "the mesh is too even to prove much"
    );
    for pair in &pairs {
        let pressure = number(pair, "pressure_pa") / 50e6 - 1.0;
        assert!(pressure.abs() < 1e-8, "{pressure:e}");
        assert_eq!(pair["status"], "stuck");
        assert!(number(pair, "slip_m") < 1e-18);
        for friction in ["friction_t1_n", "friction_t2_n"] {
            let share = number(pair, friction) / number(pair, "normal_force_n");
            assert!(share.abs() < 1e-8, "{share:e}");
        }
    }
    // p (8 mm / 100 GPa + 6 mm / 200 GPa)
    let shortening = -observed_m(run) / 5.5e-6 - 1.0;
    assert!(shortening.abs() < 1e-8, "{shortening:e}");
}

// ----------------------------------------------------------------------------------------- Hertz

/// Relative errors against the closed form: radius from the second moment of the pressure, largest
/// pressure, pressure in the mean square, approach.
struct HertzErrors {
    radius: f64,
    largest_pressure: f64,
    pressure: f64,
    approach: f64,
}

/// Errors of a run; `elastic` is the number of elastic sides, 1 or 2.
fn hertz(run: &Run, elastic: f64) -> HertzErrors {
    let (a, crown_radius) = (MM, 1.0);
    let (force, pairs) = (8.0 * 36.63003663 / elastic, run.table("static.csv"));
    let p0 = 1.5 * force / (PI * a * a);
    // a^3 = 3 P R / (4 E*), 1 / E* = (1 - nu^2) / E for each elastic side
    let e_star = 200e9 / (elastic * (1.0 - 0.09));
    assert!(((0.75 * force * crown_radius / e_star).cbrt() / a - 1.0).abs() < 1e-8);
    let exact = |p: &Row| p0 * (1.0 - (radius_m(p) / a).powi(2)).max(0.0).sqrt();
    let normal = |p: &Row| number(p, "normal_force_n");
    let area = |p: &Row| number(p, "area_m2");
    assert!((4.0 * sum(&pairs, normal) / force - 1.0).abs() < 1e-9);
    // The mean of r^2 over the pressure is 2/5 a^2.
    let second = sum(&pairs, |p| normal(p) * radius_m(p).powi(2)) / sum(&pairs, normal);
    let difference = |p: &Row| area(p) * (number(p, "pressure_pa") - exact(p)).powi(2);
    let largest = pairs.iter().map(|p| number(p, "pressure_pa"));
    HertzErrors {
        radius: (2.5 * second).sqrt() / a - 1.0,
        largest_pressure: largest.fold(0.0, f64::max) / p0 - 1.0,
        pressure: (sum(&pairs, difference) / sum(&pairs, |p| area(p) * exact(p).powi(2))).sqrt(),
        approach: -observed_m(run) / (a * a / crown_radius) - 1.0,
    }
}

fn print_hertz(label: &str, e: &HertzErrors) {
    println!(
        "{label}: radius {:+.2} %, largest pressure {:+.2} %, pressure (mean square) {:.2} %, approach {:+.2} %",
        1e2 * e.radius,
        1e2 * e.largest_pressure,
        1e2 * e.pressure,
        1e2 * e.approach
    );
}

/// Checks the errors with four elements on the radius of contact.
fn is_hertz(label: &str, e: &HertzErrors) {
    print_hertz(label, e);
    assert!(e.radius.abs() < 0.02, "{}", e.radius);
    assert!(e.largest_pressure.abs() < 0.04, "{}", e.largest_pressure);
    assert!(e.pressure < 0.13, "{}", e.pressure);
    assert!(e.approach.abs() < 0.005, "{}", e.approach);
}

#[test]
fn hertz_coarse() {
    is_hertz("n = 6", &hertz(&run_on_ready_mesh("hertz", "hertz"), 2.0));
}

/// A sphere as above on rigid ground: one body, no friction.
#[test]
fn hertz_on_rigid_ground() {
    let mesh = "mesh.file=../../meshes/verification/hertz.msh";
    let run = Run::new("static", "verification/hertz_rigid", "rigid", &[mesh]);
    is_hertz("rigid ground, n = 6", &hertz(&run, 1.0));
}

#[test]
#[ignore = "slow: make verify"]
fn hertz_converges() {
    let at = |n: u32| {
        let e = hertz(&run_on_finer_mesh("hertz", n, 3.6), 2.0);
        print_hertz(&format!("n = {n}"), &e);
        e
    };
    let [coarse, middle, fine] = [6, 9, 12].map(at);
    assert!(coarse.pressure > middle.pressure && middle.pressure > fine.pressure);
    assert!(order(coarse.pressure, fine.pressure, 2.0) > 0.8);
    assert!(order(coarse.radius, fine.radius, 2.0) > 1.2);
    assert!(fine.radius < 0.008 && fine.largest_pressure < 0.025 && fine.pressure < 0.065);
    // The blocks are 240 a wide: the half-space is off by a / size or less.
    for e in [coarse, middle, fine] {
        assert!(e.approach.abs() < 0.004, "{}", e.approach);
    }
}

// ------------------------------------------------------------------------------------ flat punch

/// Relative errors against the closed form: pressure in the mean square inside 0.85 a, and
/// indentation.
struct PunchErrors {
    pressure: f64,
    indentation: f64,
}

fn punch(run: &Run) -> PunchErrors {
    let (a, force) = (MM, 400.0);
    let pairs = run.table("static.csv");
    let total = sum(&pairs, |p| number(p, "normal_force_n"));
    assert!((4.0 * total / force - 1.0).abs() < 1e-9);
    assert!(pairs.iter().all(|p| p["status"] != "open"));
    let exact = |p: &Row| force / (2.0 * PI * a * (a * a - radius_m(p).powi(2)).sqrt());
    let inside: Vec<Row> = pairs
        .into_iter()
        .filter(|p| radius_m(p) < 0.85 * a)
        .collect();
    let area = |p: &Row| number(p, "area_m2");
    let difference = |p: &Row| area(p) * (number(p, "pressure_pa") - exact(p)).powi(2);
    let whole = sum(&inside, |p| area(p) * exact(p).powi(2));
    PunchErrors {
        pressure: (sum(&inside, difference) / whole).sqrt(),
        // P (1 - nu^2) / (2 E a)
        indentation: observed_m(run) / (force * 0.91 / (2.0 * 200e9 * a)) - 1.0,
    }
}

fn print_punch(label: &str, e: &PunchErrors) {
    println!(
        "{label}: pressure inside 0.85 a (mean square) {:.2} %, indentation {:+.2} %",
        1e2 * e.pressure,
        1e2 * e.indentation
    );
}

/// Eight elements on the radius. Contact is linear on the flank and the pressure singular at the
/// rim: too stiff by O(h).
#[test]
fn punch_coarse() {
    let e = punch(&run_on_ready_mesh("punch", "punch"));
    print_punch("n = 8", &e);
    assert!(e.pressure < 0.08, "{}", e.pressure);
    assert!(
        e.indentation < 0.0 && e.indentation > -0.035,
        "{}",
        e.indentation
    );
}

#[test]
#[ignore = "slow: make verify"]
fn punch_converges() {
    let at = |n: u32| {
        let e = punch(&run_on_finer_mesh("punch", n, 3.2));
        print_punch(&format!("n = {n}"), &e);
        e
    };
    let [coarse, middle, fine] = [4, 8, 16].map(at);
    for [a, b] in [[&coarse, &middle], [&middle, &fine]] {
        assert!(order(a.pressure, b.pressure, 2.0) > 0.9);
        assert!(order(-a.indentation, -b.indentation, 2.0) > 0.9);
    }
    assert!(fine.pressure < 0.035 && fine.indentation > -0.018);
}

// ---------------------------------------------------------------------------- Cattaneo and Mindlin

const FRICTION: f64 = 0.3;
const NORMAL_N: f64 = 400.0 / 3.0;
/// (2 - nu1) / G1 + (2 - nu2) / G2, nu = 0
const COMPLIANCE: f64 = 4.0 / 100e9;

/// Tangential displacement of a sphere under Q = q mu P that grows from nothing, m: Johnson (7.42).
fn tangential_m(q: f64) -> f64 {
    let scale = 3.0 * FRICTION * NORMAL_N * COMPLIANCE / (16.0 * MM);
    scale * (1.0 - (1.0 - q).powf(2.0 / 3.0))
}

/// Work of a cycle between -q mu P and q mu P. On the way back the slip starts again from the rim,
/// at twice the friction (Mindlin and Deresiewicz): displacement = law(q) - 2 law((q - s) / 2), and
/// twice that in the loop. With u = 1 - q, the integral of s d(law) is mu P C (3/5 (1 - u^(5/3)) -
/// q u^(2/3)), and the loop 8 times it less 4 Q law(q).
fn work_j(q: f64) -> f64 {
    let u = 1.0 - q;
    let scale = 0.9 * (FRICTION * NORMAL_N).powi(2) * COMPLIANCE / MM;
    scale * (1.0 - u.powf(5.0 / 3.0) - 5.0 * q / 6.0 * (1.0 + u.powf(2.0 / 3.0)))
}

/// The closed form is the loop of the displacement law, summed.
#[test]
fn work_per_cycle_is_the_area_of_the_loop() {
    for q in [0.1, 0.3, 0.6, 0.9, 1.0] {
        let steps = 20_000;
        let width = |s: f64| {
            let unloading = tangential_m(q) - 2.0 * tangential_m((q - s) / 2.0);
            let loading = -tangential_m(q) + 2.0 * tangential_m((q + s) / 2.0);
            unloading - loading
        };
        let at = |i: i32| width(q * (2.0 * f64::from(i) / f64::from(steps) - 1.0));
        let ds = 2.0 * q * FRICTION * NORMAL_N / f64::from(steps);
        // Simpson's rule.
        let odd: f64 = (1..steps).step_by(2).map(at).sum();
        let even: f64 = (2..steps).step_by(2).map(at).sum();
        let area = ds / 3.0 * (4.0 * odd + 2.0 * even + at(0) + at(steps));
        let difference = area / work_j(q) - 1.0;
        assert!(difference.abs() < 1e-4, "{q}: {difference:e}");
    }
}

/// Radius of the stuck disc over a, and work per cycle over that of the closed form.
fn cattaneo_mindlin(n: u32, q: f64) -> (f64, f64) {
    let force_n = q * FRICTION * NORMAL_N / 2.0;
    let [n_set, force] = [
        format!("mesh.parameters.n={n}"),
        format!("excitation.0.force_n={force_n}"),
    ];
    let run = Run::run_without_fields("verification/cattaneo_mindlin", "slip", &[&n_set, &force]);
    let response = &run.table("response.csv")[0];
    assert_eq!(response["outcome"], "converged");
    let mut pairs = run.table("contact.csv");
    pairs.retain(|p| p["peak_status"] == "stuck");
    // A half of the contact is meshed.
    let area = 2.0 * sum(&pairs, |p| number(p, "area_m2"));
    let work = 2.0 * number(response, "friction_power_w") / number(response, "frequency_hz");
    let (radius, ratio) = ((area / PI).sqrt() / MM, work / work_j(q));
    let exact = (1.0 - q).cbrt();
    println!(
        "n = {n}, Q = {q} mu P: c = {radius:.3} a (closed form {exact:.3}), work {ratio:.3} of the closed form"
    );
    (radius, ratio)
}

#[test]
#[ignore = "slow: make verify"]
fn cattaneo_mindlin_stick_radius_and_work() {
    // (elements on the half patch, Q / mu P, error of c in a, of the work)
    for (n, q, of_radius, of_work) in [
        (6, 0.6, 0.08, 0.10),
        (8, 0.3, 0.04, 0.15),
        (8, 0.6, 0.04, 0.06),
        (8, 0.9, 0.06, 0.02),
        (12, 0.6, 0.05, 0.02),
    ] {
        let (radius, work) = cattaneo_mindlin(n, q);
        assert!(
            (radius - (1.0 - q).cbrt()).abs() < of_radius,
            "{n} {q}: {radius}"
        );
        assert!((work - 1.0).abs() < of_work, "{n} {q}: {work}");
    }
}

// ---------------------------------------------------------------------- what the new keys refuse

#[test]
fn loads_supports_and_crowns_that_make_no_sense_are_named() {
    let table = r#"
        load.0.on=nowhere => load 1: the mesh has no group `nowhere`
        load.0.on=lower_rail
        => `lower_rail` is a set of 1 nodes, and no face on the surface of body `lower`
        load.0.on=upper => acts on a surface group
        load.0.on=lower_base body.lower.fixed=["lower_base"] => are fixed
        load.0.force_n=1 => exclude each other
        load.0.pressure_pa=
        => neither `load.0.force_n` nor `load.0.traction_pa` nor `load.0.pressure_pa` is given
        body.lower.fixed_x=["lower_flank"] contact.flank.slave=second
        => body `lower`, fixed_x: 30 nodes
        contact.flank.crown_axis=[1,0,0] => is given without `contact.flank.crown_radius_m`
        contact.flank.crown_axis=[0,0,1] contact.flank.crown_radius_m=2 => stands across the flank
        load.0.pressure_pa=-50e6 => nothing holds body `upper`
        "#;
    let out = Folder::new("refusal");
    for [set, expected] in cases(table) {
        let set: Vec<&str> = set.split(' ').collect();
        let output = patch_command("static", &out, &set).output().unwrap();
        assert!(!output.status.success(), "{set:?} is no error");
        has(&said_in_one_line(&output), &expected);
    }
}
