//! Stress of a rotation that is transmitted between bodies.

use std::fmt::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::SMALL;
use crate::shared_runs::Run;

const LENGTH_M: f64 = 0.5;
const CELLS: usize = 24;

/// Beam along x of hexahedra, as MSH 2.2. Each part has a volume of this name over these cells of
/// the length, and the surfaces NAME_from and NAME_to at its ends. Parts share no nodes.
fn beam(parts: &[(&str, Range<usize>)]) -> String {
    let (mut nodes, mut elements, mut names) = (Vec::new(), Vec::new(), String::new());
    for (p, (name, cells)) in parts.iter().enumerate() {
        let [volume, from, to] = [1, 2, 3].map(|k| 3 * p + k);
        writeln!(names, "3 {volume} \"{name}\"").unwrap();
        writeln!(names, "2 {from} \"{name}_from\"\n2 {to} \"{name}_to\"").unwrap();
        let first = nodes.len() + 1;
        // Of each cross-section its four corners, in a circle.
        for i in cells.start..=cells.end {
            let x = LENGTH_M * i as f64 / CELLS as f64;
            nodes.extend(
                [[0.0, 0.0], [0.02, 0.0], [0.02, 0.01], [0.0, 0.01]].map(|[y, z]| [x, y, z]),
            );
        }
        let section = |i: usize| {
            [0, 1, 2, 3]
                .map(|k| (first + 4 * i + k).to_string())
                .join(" ")
        };
        let count = cells.len();
        elements.push(format!("3 2 {from} {from} {}", section(0)));
        elements.push(format!("3 2 {to} {to} {}", section(count)));
        for i in 0..count {
            let (near, far) = (section(i), section(i + 1));
            elements.push(format!("5 2 {volume} {volume} {near} {far}"));
        }
    }
    let mut text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n{names}$EndPhysicalNames\n$Nodes\n{}\n",
        3 * parts.len(),
        nodes.len()
    );
    for (i, [x, y, z]) in nodes.iter().enumerate() {
        writeln!(text, "{} {x} {y} {z}", i + 1).unwrap();
    }
    writeln!(text, "$EndNodes\n$Elements\n{}", elements.len()).unwrap();
    for (i, element) in elements.iter().enumerate() {
        writeln!(text, "{} {element}", i + 1).unwrap();
    }
    text + "$EndElements\n"
}

/// Scene of the parts at 3000 rpm about z. The first part is fixed at its root, and each other one
/// is bonded to the one before it.
fn scene(folder: &Folder, name: &str, parts: &[(&str, Range<usize>)]) -> PathBuf {
    let mut text = format!(
        "name = \"{name}\"\n[mesh]\nfile = \"{name}.msh\"\nmetres_per_unit = 1\n\
         [rotation]\naxis = [0, 0, 1]\nspeed_rpm = 3000\n[damping]\nratio = 0.001\n\
         [response]\nfrequency_hz = [50, 70]\npoints = 3\nharmonics = 1\n"
    );
    for (i, (part, _)) in parts.iter().enumerate() {
        let fixed = if i == 0 {
            format!("fixed = [\"{part}_from\"]\n")
        } else {
            String::new()
        };
        write!(
            text,
            "[[body]]\nname = \"{part}\"\nvolume = \"{part}\"\nyoung_pa = 2.1e11\npoisson = 0.3\n\
             density_kg_m3 = 7800\n{fixed}"
        )
        .unwrap();
    }
    for pair in parts.windows(2) {
        let [first, second] = [pair[0].0, pair[1].0];
        write!(
            text,
            "[[contact]]\nname = \"{second}\"\nfirst = \"{first}_to\"\nsecond = \"{second}_from\"\nlaw = \"bonded\"\n"
        )
        .unwrap();
    }
    let (end, _) = parts[parts.len() - 1];
    write!(
        text,
        "[[excitation]]\non = \"{end}_to\"\ndirection = [0, 0, 1]\nforce_n = 1\n\
         [[observe]]\nname = \"end\"\npoints = \"{end}_to\"\ndirection = [0, 0, 1]\n"
    )
    .unwrap();
    folder.write(&format!("{name}.msh"), beam(parts));
    folder.write(&format!("{name}.toml"), text)
}

fn stuck_hz(summary: &Value) -> f64 {
    summary["stuck_frequency_hz"].as_f64().unwrap()
}

/// The outer half loads the inner one, which the prestress of held flanks does not include.
#[test]
fn halves_that_are_bonded_are_stiffened_as_the_beam_in_one_piece_is() {
    let folder = Folder::new("prestress");
    let whole = scene(&folder, "whole", &[("beam", 0..CELLS)]);
    let middle = CELLS / 2;
    let halves = scene(
        &folder,
        "halves",
        &[("inner", 0..middle), ("outer", middle..CELLS)],
    );
    let summary =
        |file: &Path, set: &[&str]| Run::run_file("modes", file, "prestress-run", set).summary();
    let held = "rotation.prestress=held_flanks";
    let [one, one_held] = [&[][..], &[held]].map(|set| summary(&whole, set));
    let [two, two_held] = [&[][..], &[held]].map(|set| summary(&halves, set));
    let all = [&one, &one_held, &two, &two_held].map(stuck_hz);
    println!("{all:.3?} Hz");
    let [expected, one_held_hz, found, held_hz] = all;
    assert!((found / expected - 1.0).abs() < 1e-3);
    assert!((one_held_hz / expected - 1.0).abs() < 1e-3);
    assert!(held_hz < 0.95 * expected);
    // The error of the held flanks is told, and is the one that there is.
    let error = two_held["held_flanks_error"].as_f64().unwrap();
    let there_is = found / held_hz - 1.0;
    assert!((error / there_is - 1.0).abs() < 0.05, "{error} {there_is}");
    let warned = |summary: &Value| {
        let warnings = summary["warnings"].as_array().unwrap().clone();
        let texts = warnings
            .iter()
            .map(|w| w["text"].as_str().unwrap().to_owned());
        texts
            .filter(|t| t.contains("prestress = \"contact\""))
            .count()
    };
    assert_eq!([&one, &one_held, &two, &two_held].map(warned), [0, 0, 0, 1]);
    for summary in [&one, &one_held, &two] {
        assert!(summary.get("held_flanks_error").is_none());
    }
}

/// The flanks of the joint of the paper are where the stress is low.
#[test]
fn held_flanks_are_not_warned_of_where_they_hardly_matter() {
    let summary = Run::new("modes", "paper", "prestress-paper", &[SMALL]).summary();
    let error = summary["held_flanks_error"].as_f64().unwrap();
    println!("{error:e}");
    assert!(error > 1e-6 && error < 1e-3, "{error:e}");
    assert_eq!(summary["warnings"].as_array().unwrap().len(), 0);
}
