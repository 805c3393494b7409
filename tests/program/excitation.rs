//! What shakes: the base, pressures and tractions on surfaces, fields of files.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::said_in_one_line;
use crate::shared_scenes::*;
use dovetail_solver::contact::dynamic_stiffness::ContactSystem;
use dovetail_solver::dlft::orbit::linear_point;
use dovetail_solver::fem::assemble;
use dovetail_solver::mesh::block::block;
use dovetail_solver::mesh::facet;
use dovetail_solver::mesh::surface_field::{FieldValues, SurfaceField};
use dovetail_solver::mesh::{ElementType, Mesh};
use dovetail_solver::model::{
    Assembly, BaseMotion, ExcitationKind, ExcitationSpec, FieldSource, LoadKind, LoadSpec,
    Material, ModelError, bind,
};
use dovetail_solver::reduction::damping::Rayleigh;
use dovetail_solver::reduction::{Highest, ReducedModel, StuckModes, reduce};

const UNDAMPED: Rayleigh = Rayleigh {
    stiffness_s: 0.0,
    mass_per_s: 0.0,
};

fn shaken_by(kind: ExcitationKind, amplitude: f64, phase_rad: f64) -> ExcitationSpec {
    ExcitationSpec {
        kind,
        amplitude,
        harmonic: 1,
        phase_rad,
    }
}

fn reduced(assembly: &Assembly, mesh: &Mesh) -> ReducedModel {
    let model = bind(assembly, mesh).unwrap();
    let wanted = StuckModes {
        count: Some(30),
        excited: Highest::RadS(0.0),
        kept: Highest::RadS(0.0),
    };
    reduce(&model, &assemble(&model).unwrap(), wanted).unwrap()
}

// ------------------------------------------------------------------------------------ the base

const LENGTH_M: f64 = 0.2;

/// A bar along x whose base is its face x = 0, and nothing across it; its end is watched. The speed of sound in it is
/// the last.
fn bar(element: ElementType, cells: usize, excitation: ExcitationSpec) -> (Assembly, Mesh, f64) {
    let mut mesh = block(element, [cells, 1, 1], [LENGTH_M, 0.01, 0.01]);
    let group = mesh.groups.remove("volume").unwrap();
    mesh.groups.insert("bar".to_owned(), group);
    let material = Material {
        young_pa: 70e9,
        poisson: 0.0,
        density_kg_m3: 2700.0,
    };
    let mut bar = body("bar", &["x_min"]);
    bar.material = material.into();
    let mut assembly = assembly(vec![bar], Vec::new(), "x_max");
    assembly.rotation = None;
    assembly.excitations = vec![excitation];
    assembly.observations[0].direction = [1.0, 0.0, 0.0];
    (
        assembly,
        mesh,
        (material.young_pa / material.density_kg_m3).sqrt(),
    )
}

/// Under the acceleration A cos(w t) of its base the end of a bar moves, relative to the base, by
/// -(A / w^2) (1 / cos(w L / c) - 1), c the speed of sound: E u'' + rho w^2 (u + u_base) = 0 with u(0) = 0 and
/// u'(L) = 0.
#[test]
fn a_bar_on_a_shaken_base_moves_as_the_wave_equation_says() {
    let acceleration = 3.0;
    let direction = [1.0, 0.0, 0.0];
    let motion = BaseMotion::Acceleration;
    let kind = ExcitationKind::Base { direction, motion };
    let (assembly, mesh, sound_m_s) =
        bar(ElementType::HEX20, 12, shaken_by(kind, acceleration, 0.0));
    let relative = reduced(&assembly, &mesh).relative;
    let system = ContactSystem::new(&relative, UNDAMPED);
    let motion = BaseMotion::Displacement;
    let displacement = 2e-6;
    let kind = ExcitationKind::Base { direction, motion };
    let (assembly, _, _) = bar(ElementType::HEX20, 12, shaken_by(kind, displacement, 0.0));
    let displaced = reduced(&assembly, &mesh).relative;
    let displaced = ContactSystem::new(&displaced, UNDAMPED);
    for share in [0.1, 0.7, 1.6] {
        let omega = share * FRAC_PI_2 * sound_m_s / LENGTH_M;
        let expected =
            acceleration / omega.powi(2) * (1.0 / (omega * LENGTH_M / sound_m_s).cos() - 1.0);
        let found = linear_point(&system, 1, omega / TAU).observed_amplitude_m[0];
        assert!(
            (found / expected.abs() - 1.0).abs() < 1e-5,
            "{share}: {found:e} {expected:e}"
        );
        // The acceleration of a displacement is w^2 times it.
        let expected = displacement * omega.powi(2) / acceleration * found;
        let found = linear_point(&displaced, 1, omega / TAU).observed_amplitude_m[0];
        assert!((found / expected - 1.0).abs() < 1e-9, "{share}: {found:e}");
    }
}

/// Shaken slowly the end lags behind the base by A L^2 / (2 c^2). Linear elements have it exactly, however few they
/// are, where the elements at the base carry the mass of its nodes, too.
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
        let relative = reduced(&assembly, &mesh).relative;
        let system = ContactSystem::new(&relative, UNDAMPED);
        let first_hz = relative.omega2[0].sqrt() / TAU;
        let found = linear_point(&system, 1, 1e-5 * first_hz).observed_amplitude_m[0];
        let expected = acceleration * (LENGTH_M / sound_m_s).powi(2) / 2.0;
        assert!(
            (found / expected - 1.0).abs() < 1e-8,
            "{cells}: {found:e} {expected:e}"
        );
    }
}

// --------------------------------------------------------------------------------- on surfaces

fn on_top(load: LoadKind) -> ExcitationKind {
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

fn of_points(points_m: &[[f64; 3]], pressure_pa: impl Fn([f64; 3]) -> [f64; 2]) -> ExcitationKind {
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

/// The loads of harmonic 1 on X and on the modes: of the cosine, then of the sine.
fn loads(mut assembly: Assembly, mesh: &Mesh, excitations: Vec<ExcitationSpec>) -> [Vec<f64>; 2] {
    assembly.excitations = excitations;
    let relative = reduced(&assembly, mesh).relative;
    assert_eq!(relative.excitations.len(), 1);
    let load = &relative.excitations[0];
    [&load.cosine, &load.sine].map(|load| [&load.on_x[..], &load.on_modes[..]].concat())
}

/// The residual vectors of other loads are others: only X is compared.
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
    let pressure = on_top(LoadKind::Pressure { pressure_pa: 1.0 });
    let field = loads(
        assembly.clone(),
        &mesh,
        vec![shaken_by(of_points(&points, |_| [300.0, -200.0]), 2.0, 0.0)],
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
    let kind = of_points(&points, |x| [300.0 + 1e4 * x[0], 2e4 * x[1]]);
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

/// The same force on a surface as a whole, over its area, and as a pressure against its normal.
#[test]
fn a_force_a_traction_and_a_pressure_on_a_plane_are_one() {
    let (assembly, mesh, _) = blocks();
    let of = |load, amplitude| {
        loads(
            assembly.clone(),
            &mesh,
            vec![shaken_by(on_top(load), amplitude, 0.0)],
        )
    };
    let down = [0.0, 0.0, -1.0];
    let area_m2 = 2e-4;
    let [force, _] = of(LoadKind::Force { vector_n: down }, 5.0);
    let [traction, _] = of(LoadKind::Traction { vector_pa: down }, 5.0 / area_m2);
    let [pressure, _] = of(LoadKind::Pressure { pressure_pa: 1.0 }, 5.0 / area_m2);
    assert_same_on_x(&traction, &force);
    assert_same_on_x(&pressure, &force);
    // With all pairs stuck they carry what the base does not: the sum of the normal forces is the load.
    assert!(force.iter().any(|f| f.abs() > 1e-6));
}

#[test]
fn what_a_support_takes_whole_is_refused_and_the_rest_is_not() {
    let (mut assembly, mesh, points) = blocks();
    assembly.bodies[0].fixed_along[1] = vec!["top".into()];
    let traction = |direction| {
        on_top(LoadKind::Traction {
            vector_pa: direction,
        })
    };
    let bound = |kind: ExcitationKind| {
        let mut assembly = assembly.clone();
        assembly.excitations = vec![shaken_by(kind, 1.0, 0.0)];
        bind(&assembly, &mesh)
    };
    let error = bound(traction([0.0, 1.0, 0.0])).unwrap_err();
    assert!(matches!(error, ModelError::NodesHeld { .. }), "{error}");
    assert!(error.to_string().starts_with("excitation 1: each of the"));
    assert!(bound(traction([0.6, 0.8, 0.0])).is_ok());
    assert!(bound(on_top(LoadKind::Pressure { pressure_pa: 1.0 })).is_ok());
    let on = |on: &str| ExcitationKind::force(on, [0.0, 0.0, 1.0]);
    assert!(matches!(
        bound(on("base")).unwrap_err(),
        ModelError::NodesFixed { .. }
    ));
    let volume = bound(on("upper")).unwrap_err();
    assert!(
        volume
            .to_string()
            .contains("acts on a point, a curve or a surface")
    );
    // Points in millimetres.
    let far: Vec<[f64; 3]> = points.iter().map(|x| x.map(|c| 1e3 * c)).collect();
    let error = bound(of_points(&far, |_| [1.0, 0.0]))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("in metres") && error.contains("surface `top`"),
        "{error}"
    );
    let missing = ExcitationKind::Field {
        on: "top".to_owned(),
        field: FieldSource::File("no_such.csv".into()),
    };
    let error = bound(missing).unwrap_err().to_string();
    assert!(
        error.contains("excitation 1: cannot read no_such.csv"),
        "{error}"
    );
}

// --------------------------------------------------------------------------------- the program

/// scenes/pressure.toml with `--set`; the folder of its results, and what it said.
fn run(name: &str, set: &[&str]) -> (Folder, String) {
    let folder = Folder::new(name);
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program
        .current_dir(root())
        .args([
            "run",
            "scenes/pressure.toml",
            "--no-cache",
            "--no-fields",
            "--out",
        ])
        .arg(&*folder);
    let small = [
        "mesh.file=../meshes/dovetail_small.msh",
        "response.points=5",
    ];
    for set in small.iter().chain(set) {
        program.args(["--set", set]);
    }
    let output = program.output().unwrap();
    let said = said_in_one_line(&output);
    assert!(output.status.success(), "{said}");
    (folder, said)
}

fn summary(folder: &Folder) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(folder.join("summary.json")).unwrap()).unwrap()
}

/// -int p n dA of the pressure side in the finer mesh that scenes/pressure.csv was written on, with the formula
/// that its columns are rounded values of: a wave that runs along the chord and grows towards the tip.
fn integral_n() -> [[f64; 3]; 2] {
    let text = std::fs::read(root().join("scenes/pressure.csv")).unwrap();
    let points = SurfaceField::parse(&text[..], Path::new("pressure.csv")).unwrap();
    let ends = |k: usize| {
        let all = points.points_m.iter().map(|x| x[k]);
        let low = all.clone().fold(f64::INFINITY, f64::min);
        (low, all.fold(f64::NEG_INFINITY, f64::max) - low)
    };
    let ((x0, chord), (z0, height)) = (ends(0), ends(2));
    let mesh = ready("dovetail.msh");
    let mut sum = [[0.0; 3]; 2];
    for &f in &mesh.groups["blade_pressure_side"].elements {
        let nodes = mesh.facets.of(f as usize).iter();
        let coords: Vec<[f64; 3]> = nodes.map(|&n| mesh.nodes_m[n as usize]).collect();
        for (point, weight) in facet::points(&coords) {
            let [x, _, z] = point.position_m;
            let size = 200.0 + 400.0 * (z - z0) / height;
            let (s, c) = (0.75 * PI * (x - x0) / chord).sin_cos();
            for (sum, part) in sum.iter_mut().zip([c, -s]) {
                for (sum, n) in sum.iter_mut().zip(point.normal_m2) {
                    *sum -= weight * size * part * n;
                }
            }
        }
    }
    sum
}

#[test]
fn the_field_of_a_file_is_mapped_told_and_written() {
    let (folder, said) = run("field", &[]);
    let told = "pressure.csv on `blade_pressure_side`: 280 points";
    assert!(said.contains(told), "{said}");
    let summary = summary(&folder);
    let field = &summary["excitation_fields"][0];
    let number = |key: &str| field[key].as_f64().unwrap();
    assert_eq!((number("points"), number("empty_facets")), (280.0, 0.0));
    assert!(number("interpolation_error") < 0.02, "{field}");
    assert!(number("largest_distance_m") < 1e-5, "{field}");
    for (part, expected) in integral_n().iter().enumerate() {
        for (k, expected) in expected.iter().enumerate() {
            let applied = field["applied_n"][part][k].as_f64().unwrap();
            assert!((applied - expected).abs() < 0.01, "{applied} {expected}");
        }
    }
    assert!(summary["response"]["peak_amplitude_m"].as_f64().unwrap() > 0.0);
    let report = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let (_, words) = report
        .split_once("Excitation: The field of <code>")
        .unwrap();
    let (file, words) = words.split_once("</code>").unwrap();
    assert!(file.ends_with("pressure.csv"), "{file}");
    assert!(words.starts_with(" on <code>blade_pressure_side</code>"));
}

/// Pressures that alternate from point to point say nothing of what lies between them, whatever a fit through them errs.
#[test]
fn few_points_of_a_pressure_that_changes_fast_are_warned_of() {
    let text = std::fs::read_to_string(root().join("scenes/pressure.csv")).unwrap();
    let points = text.lines().filter(|line| !line.starts_with(['#', 'x']));
    let mut few =
        "[Name]\nblade\n\n[Data]\nX [ m ], Y [ m ], Z [ m ], Pressure [ kPa ]\n".to_owned();
    for (number, line) in points.step_by(80).enumerate() {
        let place: Vec<&str> = line.split(',').take(3).collect();
        let pressure = if number % 2 == 0 { "1.1" } else { "-0.9" };
        few += &format!("{},{pressure}\n", place.join(","));
    }
    let files = Folder::new("few");
    let file = files.join("few.csv");
    std::fs::write(&file, few).unwrap();
    let file = format!("excitation.0.file={}", file.display());
    let (folder, said) = run("few", &[&file, "response.points=2", "response.harmonics=1"]);
    for told in [
        "4 points without areas are too few to tell how much the pressures between them err, 13 are needed",
        "half of the points gives one that differs by",
    ] {
        assert!(said.contains(told), "{said}");
    }
    assert!(!said.contains("pressures err by about"), "{said}");
    let field = &summary(&folder)["excitation_fields"][0];
    assert!(field["interpolation_error"].is_null(), "{field}");
    let size = |vector: &serde_json::Value| {
        let parts = vector.as_array().unwrap().iter();
        parts
            .map(|f| f.as_f64().unwrap().powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let error_n = field["sum_error_n"].as_f64().unwrap();
    assert!(error_n > 0.3 * size(&field["applied_n"][0]), "{field}");
}

/// A later start of the clock turns phases and leaves amplitudes: without friction to the tolerance of the solution. With
/// friction the vibration leaves the mean of the pairs anywhere where friction can hold it, and where it comes to lie depends
/// on the phase in which it began at the static state. On this scene that moves amplitudes by up to 1.3e-3.
#[test]
fn a_lag_of_the_pressure_is_a_lag_of_the_answer() {
    let columns = |folder: &Folder, column: &str| -> Vec<f64> {
        let text = std::fs::read_to_string(folder.join("response.csv")).unwrap();
        let mut lines = text.lines();
        let at = lines.next().unwrap().split(',').position(|h| h == column);
        let value = |line: &str| line.split(',').nth(at.unwrap()).unwrap().parse().unwrap();
        lines.map(value).collect()
    };
    let lagging = |further: &[&str], limit: f64| {
        let set = [
            &["response.harmonics=1", "response.tolerance=1e-10"],
            further,
        ]
        .concat();
        let (now, _) = run("now", &set);
        let (later, _) = run(
            "later",
            &[&set[..], &["excitation.*.phase_deg=90"]].concat(),
        );
        let [a, b] = [&now, &later].map(|run| columns(run, "tip_amplitude_m"));
        let [p, q] = [&now, &later].map(|run| columns(run, "tip_h1_phase_rad"));
        for i in 0..a.len() {
            let moved = (a[i] / b[i] - 1.0).abs();
            assert!(moved < limit, "{moved:e}: {a:?} {b:?}");
            let turned = ((q[i] - p[i]).rem_euclid(TAU) - FRAC_PI_2).abs();
            assert!(turned < limit, "{turned:e}: {p:?} {q:?}");
        }
        columns(&now, "friction_power_w")
    };
    lagging(&["contact.*.friction=0"], 1e-6);
    let slips = lagging(&[], 5e-3);
    assert!(slips.iter().any(|power| *power > 0.0));
}
