//! Runs of the program whose excitation is the pressure of a file.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use crate::shared_bodies::ready;
use crate::shared_folder::Folder;
use crate::shared_program::{SMALL, has, scene_command, told};
use crate::shared_runs::{numbers, summary};
use dovetail_mesh::facet;
use dovetail_mesh::surface_field::SurfaceField;
use dovetail_testkit::folder::root;

/// Runs scenes/pressure.toml with `--set`; returns the folder of its results, and its messages.
fn run(name: &str, set: &[&str]) -> (Folder, String) {
    let folder = Folder::new(name);
    let set = [&[SMALL, "response.points=5"], set].concat();
    let mut program = scene_command("run", "scenes/pressure.toml", &folder, &set);
    let said = told(program.arg("--no-fields"), 0);
    (folder, said)
}

/// Force `-int p n dA` of the pressure side in the finer mesh of scenes/pressure.csv, with the
/// formula whose rounded values are in its columns: a wave that runs along the chord and grows
/// towards the tip.
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
        let nodes = mesh.facets.element_nodes(f as usize).iter();
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
    has(&said, "pressure.csv on `blade_pressure_side`: 280 points");
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
    let report = folder.text("report.html");
    let (_, words) = report
        .split_once("Excitation: The field of <code>")
        .unwrap();
    let (file, words) = words.split_once("</code>").unwrap();
    assert!(file.ends_with("pressure.csv"), "{file}");
    assert!(words.starts_with(" on <code>blade_pressure_side</code>"));
}

/// Pressures that alternate from point to point do not determine the pressure between the points,
/// whatever the error of a fit through them.
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
    let file = files.write("few.csv", few);
    let file = format!("excitation.0.file={}", file.display());
    let (folder, said) = run("few", &[&file, "response.points=2", "response.harmonics=1"]);
    let words = "4 points without areas are too few to tell how much the pressures between them \
                 err, 13 are needed & half of the points gives one that differs by";
    has(&said, words);
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

/// A later start of the clock changes phases and not amplitudes: without friction, to the tolerance
/// of the solution. With friction the vibration leaves the mean position of the pairs at any place
/// where friction can hold it. That place depends on the phase with which the vibration began at
/// the static state. On this scene amplitudes change by up to 1.3e-3.
#[test]
fn a_lag_of_the_pressure_is_a_lag_of_the_answer() {
    let columns = |folder: &Folder, column: &str| numbers(&folder.join("response.csv"), column);
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
