//! Excitations: the base, pressures and tractions on surfaces, fields of files.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::shared_scenes::*;
use dovetail_mesh::surface_field::{FieldValues, SurfaceField};
use dovetail_mesh::{ElementType, Mesh};
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::orbit::linear_point;
use dovetail_solver::model::{
    Assembly, BaseMotion, ExcitationKind, ExcitationSpec, FieldSource, LoadKind, LoadSpec,
    ModelError, bind,
};
use dovetail_solver::problem::Problem;
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::reduction::{Highest, StuckModes};
use dovetail_testkit::block::block;
use dovetail_testkit::words::has;

const UNDAMPED: Rayleigh = Rayleigh::NONE;

fn shaken_by(kind: ExcitationKind, amplitude: f64, phase_rad: f64) -> ExcitationSpec {
    ExcitationSpec {
        kind,
        amplitude,
        harmonic: 1,
        phase_rad,
    }
}

fn reduced(assembly: &Assembly, mesh: &Mesh) -> Problem {
    let wanted = StuckModes::new(Some(30), Highest::RadS(0.0));
    crate::shared_scenes::reduced(assembly, mesh, wanted).1
}

// ------------------------------------------------------------------------------------ the base

/// Under the acceleration A cos(w t) of its base the end of a bar moves, relative to the base, by
/// -(A / w^2) (1 / cos(w L / c) - 1), c the speed of sound: E u'' + rho w^2 (u + u_base) = 0 with
/// u(0) = 0 and u'(L) = 0.
#[test]
fn a_bar_on_a_shaken_base_moves_as_the_wave_equation_says() {
    let acceleration = 3.0;
    let direction = [1.0, 0.0, 0.0];
    let motion = BaseMotion::Acceleration;
    let kind = ExcitationKind::Base { direction, motion };
    let (assembly, mesh, sound_m_s) =
        bar(ElementType::HEX20, 12, shaken_by(kind, acceleration, 0.0));
    let relative = reduced(&assembly, &mesh);
    let system = ContactSystem::new(&relative, UNDAMPED);
    let motion = BaseMotion::Displacement;
    let displacement = 2e-6;
    let kind = ExcitationKind::Base { direction, motion };
    let (assembly, _, _) = bar(ElementType::HEX20, 12, shaken_by(kind, displacement, 0.0));
    let displaced = reduced(&assembly, &mesh);
    let displaced = ContactSystem::new(&displaced, UNDAMPED);
    for share in [0.1, 0.7, 1.6] {
        let omega = share * FRAC_PI_2 * sound_m_s / LENGTH_M;
        let expected =
            acceleration / omega.powi(2) * (1.0 / (omega * LENGTH_M / sound_m_s).cos() - 1.0);
        let found = linear_point(&system, 1, omega / TAU).observed_amplitude[0];
        assert!(
            (found / expected.abs() - 1.0).abs() < 1e-5,
            "{share}: {found:e} {expected:e}"
        );
        // The acceleration of a displacement is w^2 times it.
        let expected = displacement * omega.powi(2) / acceleration * found;
        let found = linear_point(&displaced, 1, omega / TAU).observed_amplitude[0];
        assert!((found / expected - 1.0).abs() < 1e-9, "{share}: {found:e}");
    }
}

/// Under a slow excitation the end lags behind the base by A L^2 / (2 c^2). Linear elements have it
/// exactly, however few they are, if the elements at the base carry the mass of its nodes, too.
#[test]
fn the_mass_of_the_base_nodes_loads_the_elements_that_hang_on_them() {
    let acceleration = 3.0;
    let kind = ExcitationKind::Base {
        direction: [1.0, 0.0, 0.0],
        motion: BaseMotion::Acceleration,
    };
    for cells in [1, 2] {
        let shaken = shaken_by(kind.clone(), acceleration, 0.0);
        let (assembly, mesh, sound_m_s) = bar(ElementType::HEX8, cells, shaken);
        let relative = reduced(&assembly, &mesh);
        let system = ContactSystem::new(&relative, UNDAMPED);
        let first_hz = relative.reduced.omega2[0].sqrt() / TAU;
        let found = linear_point(&system, 1, 1e-5 * first_hz).observed_amplitude[0];
        let expected = acceleration * (LENGTH_M / sound_m_s).powi(2) / 2.0;
        assert!(
            (found / expected - 1.0).abs() < 1e-8,
            "{cells}: {found:e} {expected:e}"
        );
    }
}

// --------------------------------------------------------------------------------- on surfaces

fn top_load(load: LoadKind) -> ExcitationKind {
    ExcitationKind::Load(LoadSpec {
        on: "top".to_owned(),
        load,
    })
}

/// Two blocks whose upper side is 20 mm by 10 mm, and the points of a grid on it.
fn blocks() -> (Assembly, Mesh, Vec<[f64; 3]>) {
    let size = [0.02, 0.01, 0.006];
    let element = ElementType::TET10;
    let mut upper = block(element, [4, 3, 2], size);
    let lower = block(element, [4, 3, 2], size);
    for x in &mut upper.nodes_m {
        x[2] += size[2];
    }
    let mut both = two_blocks(&upper, &lower);
    let top = both.groups.remove("upper_z_max").unwrap();
    both.groups.insert("top".to_owned(), top);
    let grid = (0..9).flat_map(|i| (0..7).map(move |j| [f64::from(i) / 8.0, f64::from(j) / 6.0]));
    let place = |[x, y]: [f64; 2]| [size[0] * x, size[1] * y, 2.0 * size[2]];
    (blocks_assembly(), both, grid.map(place).collect())
}

fn point_pressures(
    points_m: &[[f64; 3]],
    pressure_pa: impl Fn([f64; 3]) -> [f64; 2],
) -> ExcitationKind {
    ExcitationKind::Field {
        on: "top".to_owned(),
        field: FieldSource::Points(SurfaceField {
            points_m: points_m.to_vec(),
            values: FieldValues::Pressures {
                pressures_pa: points_m.iter().map(|x| pressure_pa(*x)).collect(),
                areas_m2: None,
            },
        }),
    }
}

/// Loads of harmonic 1 on X and on the modes: of the cosine, then of the sine.
fn loads(mut assembly: Assembly, mesh: &Mesh, excitations: Vec<ExcitationSpec>) -> [Vec<f64>; 2] {
    assembly.excitations = excitations;
    let relative = reduced(&assembly, mesh);
    assert_eq!(relative.excitations.len(), 1);
    let load = &relative.excitations[0];
    [&load.cosine, &load.sine].map(|load| [&load.on_x[..], &load.on_modes[..]].concat())
}

/// Compares X only, because other loads have other residual vectors.
fn assert_same_on_x(a: &[f64], b: &[f64]) {
    let largest = b.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    for (a, b) in a.iter().zip(b).take(27) {
        assert!((a - b).abs() < 1e-9 * largest, "{a:e} {b:e}");
    }
}

/// p = a + i b is a cos(w t) - b sin(w t).
#[test]
fn a_complex_field_is_two_pressures_a_quarter_of_a_period_apart() {
    let (assembly, mesh, points) = blocks();
    let pressure = top_load(LoadKind::Pressure { pressure_pa: 1.0 });
    let field = loads(
        assembly.clone(),
        &mesh,
        vec![shaken_by(
            point_pressures(&points, |_| [300.0, -200.0]),
            2.0,
            0.0,
        )],
    );
    let two = vec![
        shaken_by(pressure.clone(), 600.0, 0.0),
        shaken_by(pressure.clone(), 400.0, FRAC_PI_2),
    ];
    let two = loads(assembly.clone(), &mesh, two);
    let [alone, _] = loads(assembly, &mesh, vec![shaken_by(pressure, 1.0, 0.0)]);
    for (part, amplitude) in [(0, 600.0), (1, 400.0)] {
        assert_same_on_x(&field[part], &two[part]);
        let expected: Vec<f64> = alone.iter().map(|f| amplitude * f).collect();
        assert_same_on_x(&field[part], &expected);
    }
}

/// A lag turns cosine into sine: (c, s) becomes (c cos - s sin, c sin + s cos).
#[test]
fn a_phase_turns_all_of_a_field() {
    let (assembly, mesh, points) = blocks();
    let kind = point_pressures(&points, |x| [300.0 + 1e4 * x[0], 2e4 * x[1]]);
    let [c, s] = loads(
        assembly.clone(),
        &mesh,
        vec![shaken_by(kind.clone(), 1.0, 0.0)],
    );
    let [turned_c, turned_s] = loads(assembly, &mesh, vec![shaken_by(kind, 1.0, FRAC_PI_2)]);
    let minus: Vec<f64> = s.iter().map(|s| -s).collect();
    assert_same_on_x(&turned_c, &minus);
    assert_same_on_x(&turned_s, &c);
}

/// One force on a surface as a whole, over its area, and as a pressure against its normal.
#[test]
fn a_force_a_traction_and_a_pressure_on_a_plane_are_one() {
    let (assembly, mesh, _) = blocks();
    let of = |load, amplitude| {
        loads(
            assembly.clone(),
            &mesh,
            vec![shaken_by(top_load(load), amplitude, 0.0)],
        )
    };
    let down = [0.0, 0.0, -1.0];
    let area_m2 = 2e-4;
    let [force, _] = of(LoadKind::Force { vector_n: down }, 5.0);
    let [traction, _] = of(LoadKind::Traction { vector_pa: down }, 5.0 / area_m2);
    let [pressure, _] = of(LoadKind::Pressure { pressure_pa: 1.0 }, 5.0 / area_m2);
    assert_same_on_x(&traction, &force);
    assert_same_on_x(&pressure, &force);
    // With all pairs stuck they carry what the base does not: the sum of the normal forces is the
    // load.
    assert!(force.iter().any(|f| f.abs() > 1e-6));
}

#[test]
fn what_a_support_takes_whole_is_refused_and_the_rest_is_not() {
    let (mut assembly, mesh, points) = blocks();
    assembly.bodies[0].fixed_along[1] = vec!["top".into()];
    let traction = |direction| {
        top_load(LoadKind::Traction {
            vector_pa: direction,
        })
    };
    let bound = |kind: ExcitationKind| {
        let mut assembly = assembly.clone();
        assembly.excitations = vec![shaken_by(kind, 1.0, 0.0)];
        bind(&assembly, &mesh, None)
    };
    let error = bound(traction([0.0, 1.0, 0.0])).unwrap_err();
    assert!(matches!(error, ModelError::NodesHeld { .. }), "{error}");
    assert!(error.to_string().starts_with("excitation 1: each of the"));
    assert!(bound(traction([0.6, 0.8, 0.0])).is_ok());
    assert!(bound(top_load(LoadKind::Pressure { pressure_pa: 1.0 })).is_ok());
    let on = |on: &str| ExcitationKind::force(on, [0.0, 0.0, 1.0]);
    assert!(matches!(
        bound(on("base")).unwrap_err(),
        ModelError::NodesFixed { .. }
    ));
    let volume = bound(on("upper")).unwrap_err();
    let words = "acts on a point, a curve or a surface";
    has(&volume.to_string(), words);
    // Points in millimetres.
    let far: Vec<[f64; 3]> = points.iter().map(|x| x.map(|c| 1e3 * c)).collect();
    let error = bound(point_pressures(&far, |_| [1.0, 0.0])).unwrap_err();
    has(&error.to_string(), "in metres & surface `top`");
    let missing = ExcitationKind::Field {
        on: "top".to_owned(),
        field: FieldSource::File("no_such.csv".into()),
    };
    let words = "excitation 1: the field of no_such.csv is not read";
    has(&bound(missing).unwrap_err().to_string(), words);
}
