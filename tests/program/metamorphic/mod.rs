//! Laws that hold for any scene: how results change with units, scale, position, numbering and
//! names.
//!
//! The whole program runs on a small dovetail (meshes/dovetail_small.msh, 24 pairs) at three
//! frequencies around the first stuck mode: at the middle one, near the peak, nearly all pairs slip
//! and some lift off. None of the changes is exact in floating point, and the balance is solved by
//! iterations that stop at [`NEWTON`]. The laws must hold to [`ROUNDING`], which includes a factor
//! for how ill-conditioned the balance is if pairs slide in the whole period.

mod joint;
mod meshes;

use joint::{Joint, Point, Run};
use meshes::{renumbered, rotated, scaled, small};

/// Relative residual at which the runs stop.
const NEWTON: f64 = 1e-11;
/// Largest relative deviation from a law.
const ROUNDING: f64 = 1e-6;

/// Factor by which each kind of quantity is multiplied.
#[derive(Clone, Copy)]
struct Factors {
    frequency: f64,
    length: f64,
    force: f64,
    power: f64,
}

const UNCHANGED: Factors = Factors {
    frequency: 1.0,
    length: 1.0,
    force: 1.0,
    power: 1.0,
};

fn joint() -> Joint {
    Joint::new(small())
}

/// Checks that the runs are the same except for the factors.
fn same(one: &Run, other: &Run, by: Factors) {
    assert_eq!(one.points.len(), other.points.len());
    let close = |what: &str, a: f64, b: f64, factor: f64, scale: f64| {
        let off = (b - factor * a).abs() / (factor * scale);
        println!("{what:<28} {a:>22.15e} {b:>22.15e} off {off:.1e}");
        assert!(
            off < ROUNDING,
            "{what}: {a:e} times {factor} is not {b:e}: {off:e}"
        );
    };
    for (a, b) in one.static_normal_n.iter().zip(&other.static_normal_n) {
        close("static normal force", *a, *b, by.force, *a);
    }
    let [a, b] = [one, other].map(|run| run.largest_slip_m);
    close("largest static slip", a, b, by.length, a);
    for (a, b) in one.points.iter().zip(&other.points) {
        let length =
            |what: &str, of: fn(&Point) -> f64| close(what, of(a), of(b), by.length, of(a));
        length("amplitude", |p| p.amplitude_m);
        length("stuck amplitude", |p| p.stuck_amplitude_m);
        let power = |what: &str, of: fn(&Point) -> f64| {
            close(what, of(a), of(b), by.power, a.input_power_w);
        };
        power("friction power", |p| p.friction_power_w);
        power("input power", |p| p.input_power_w);
        let [f, g] = [a, b].map(|p| p.frequency_hz);
        close("frequency", f, g, by.frequency, f);
        assert_eq!(a.opening_pairs, b.opening_pairs);
        assert_eq!(a.slipping_pairs, b.slipping_pairs);
    }
}

/// Checks that the case is relevant: pairs slip and lift off, and friction takes much of the power.
fn is_worth_comparing(run: &Run) {
    let peak = &run.points[1];
    assert!(peak.slipping_pairs + peak.opening_pairs > 12 && peak.opening_pairs > 0);
    assert!(peak.amplitude_m < 0.8 * peak.stuck_amplitude_m);
    assert!(peak.friction_power_w > 0.2 * peak.input_power_w);
}

#[test]
fn twice_the_modulus_is_the_root_of_two_in_frequency() {
    // With the forces doubled, too: the centrifugal ones by the root of two in speed, which doubles
    // stress stiffening and spin softening.
    let base = joint().run("modulus-1");
    is_worth_comparing(&base);
    let root = 2.0_f64.sqrt();
    let stiffer = Joint {
        young_pa: 2.0 * joint().young_pa,
        speed_rpm: root * joint().speed_rpm,
        force_n: 2.0 * joint().force_n,
        ..joint()
    };
    let factors = Factors {
        frequency: root,
        force: 2.0,
        power: 2.0 * root,
        ..UNCHANGED
    };
    same(&base, &stiffer.run("modulus-2"), factors);
}

#[test]
fn frequencies_go_with_the_inverse_of_the_size() {
    // The same stress: speeds go with 1/s, forces with s^2.
    let s = 3.7;
    let larger = Joint {
        metres_per_unit: s * joint().metres_per_unit,
        speed_rpm: joint().speed_rpm / s,
        force_n: s * s * joint().force_n,
        ..joint()
    };
    let factors = Factors {
        frequency: 1.0 / s,
        length: s,
        force: s * s,
        power: s * s,
    };
    same(&joint().run("size-1"), &larger.run("size-2"), factors);
}

#[test]
fn the_response_goes_with_force_and_preload() {
    // Without stress stiffening and spin softening, and with no gap, the speed is a load and no
    // more.
    let c = 1.7_f64;
    let plain = Joint {
        prestress: "none",
        ..joint()
    };
    let harder = Joint {
        speed_rpm: c.sqrt() * plain.speed_rpm,
        force_n: c * plain.force_n,
        ..plain.clone()
    };
    let factors = Factors {
        frequency: 1.0,
        length: c,
        force: c,
        power: c * c,
    };
    let base = plain.run("load-1");
    is_worth_comparing(&base);
    same(&base, &harder.run("load-2"), factors);
}

#[test]
fn millimetres_and_metres_are_the_same() {
    let metres = Joint {
        mesh: scaled(&small(), 1e-3),
        metres_per_unit: 1.0,
        ..joint()
    };
    same(&joint().run("unit-1"), &metres.run("unit-2"), UNCHANGED);
}

#[test]
fn a_scene_turned_as_a_whole_is_the_same() {
    // Mesh, axis, a point of the axis, force, observed direction.
    let q = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];
    let turn = |v: [f64; 3]| q.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    let turned = Joint {
        mesh: rotated(&small(), q),
        axis: turn(joint().axis),
        direction: turn(joint().direction),
        ..joint()
    };
    same(&joint().run("turned-1"), &turned.run("turned-2"), UNCHANGED);
}

#[test]
fn numbering_means_nothing() {
    // Nodes, tetrahedra and facets in another order, with other tags, and the corners of each
    // element in another order.
    let other = Joint {
        mesh: renumbered(&small()),
        ..joint()
    };
    same(&joint().run("number-1"), &other.run("number-2"), UNCHANGED);
}

#[test]
fn which_body_is_named_first_means_nothing() {
    let swapped = Joint {
        jaw_first: true,
        ..joint()
    };
    same(&joint().run("named-1"), &swapped.run("named-2"), UNCHANGED);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let [one, two] = ["1", "2"].map(|threads| {
        let threaded = Joint {
            threads: Some(threads),
            ..joint()
        };
        threaded.run(&format!("threads-{threads}"))
    });
    assert_eq!(one.response_csv, two.response_csv);
    assert_eq!(one, two);
}
