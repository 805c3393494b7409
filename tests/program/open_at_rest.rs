//! Pairs that are all open at rest: if supports or springs hold the bodies, this is a static state
//! like any other, and small vibrations about it are those of the bodies without the contact.

use std::fmt::Write;

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{has, scene_command, told};
use crate::shared_runs::{Run, number};

/// Lengths of the sides of the beam along x, y, z, mm.
const BEAM_MM: [f64; 3] = [200.0, 10.0, 4.0];
/// Numbers of elements along the beam and across it.
const CELLS: [usize; 2] = [25, 2];
/// Thickness of the pad below the last elements along the beam, mm.
const PAD_MM: f64 = 1.0;

/// Deck of a steel beam with a pad under its tip, each with one layer of hexahedra.
fn deck() -> String {
    let [along, across] = CELLS;
    let levels_mm = [-PAD_MM, 0.0, BEAM_MM[2]];
    let node = |i: usize, j: usize, level: usize| 1 + level + 3 * (j + (across + 1) * i);
    let is_there = |i: usize, level: usize| level > 0 || i + 1 >= along;
    let mut text = String::from("*NODE\n");
    let (mut root, mut elements) = (Vec::new(), Vec::new());
    for i in 0..=along {
        for j in 0..=across {
            for (level, z) in levels_mm.into_iter().enumerate() {
                if is_there(i, level) {
                    let x = BEAM_MM[0] * i as f64 / along as f64;
                    let y = BEAM_MM[1] * j as f64 / across as f64;
                    writeln!(text, "{}, {x:?}, {y:?}, {z:?}", node(i, j, level)).unwrap();
                    if i == 0 {
                        root.push(node(i, j, level).to_string());
                    }
                }
            }
        }
    }
    for level in [1, 0] {
        for i in (0..along).filter(|i| is_there(*i, level)) {
            for j in 0..across {
                let square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let nodes: Vec<String> = [level, level + 1]
                    .iter()
                    .flat_map(|l| square.map(|(i, j)| node(i, j, *l).to_string()))
                    .collect();
                elements.push(nodes.join(", "));
            }
        }
    }
    text += "*ELEMENT, TYPE=C3D8I, ELSET=BEAM\n";
    for (i, nodes) in elements.iter().enumerate() {
        writeln!(text, "{}, {nodes}", i + 1).unwrap();
    }
    let pad = elements.len() - across + 1..=elements.len();
    let pad: Vec<String> = pad.map(|e| format!("{e}, S1")).collect();
    let tip = node(along, across / 2, 2);
    format!(
        "{text}*NSET, NSET=ROOT\n{}\n*NSET, NSET=TIP\n{tip}\n*SURFACE, NAME=PAD\n{}\n",
        root.join(",\n"),
        pad.join("\n")
    )
}

const SCENE: &str = r#"
name = "beam"
[mesh]
file = "beam.inp"
metres_per_unit = 1e-3
[[body]]
name = "beam"
volume = "BEAM"
young_pa = 2.1e11
poisson = 0.3
density_kg_m3 = 7800
fixed = ["ROOT"]
[damping]
ratio = 0.005
[[excitation]]
on = "TIP"
direction = [0, 0, 1]
force_n = 1e-4
[[observe]]
name = "tip"
points = "TIP"
direction = [0, 0, 1]
[response]
frequency_hz = [80, 88]
points = 17
harmonics = 3
stuck_modes = 240               # With fewer the modes left out move the frequency by 1e-8.
"#;

const PAD: &str = r#"
[[contact]]
name = "pad"
first = "PAD"
friction = 0.3
gap_m = 1e-4
"#;

/// Runs the scene of the beam with `more` appended.
fn run(command: &str, folder: &Folder, name: &str, more: &str) -> Run {
    folder.write("beam.inp", deck());
    let scene = folder.write(&format!("{name}.toml"), format!("{SCENE}{more}"));
    Run::run_file(command, &scene, name, &[])
}

fn apart(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}

#[test]
fn a_pad_that_does_not_touch_leaves_the_beam_as_it_is() {
    let folder = Folder::new("open_pad");
    let [alone, padded] =
        [("alone", ""), ("padded", PAD)].map(|(name, more)| run("run", &folder, name, more));
    let [of_beam, with_pad] = [&alone, &padded].map(Run::summary);
    let hz = |summary: &Value| summary["linear_frequency_hz"].as_f64().unwrap();
    println!("{} Hz, {} Hz", hz(&of_beam), hz(&with_pad));
    assert!(apart(hz(&with_pad), hz(&of_beam)) < 1e-9);
    // Euler and Bernoulli, with the mass of the pad at the tip: a quarter of the beam's moves with
    // it (Rayleigh).
    let second_moment_over_area_m2 = (4e-3_f64).powi(2) / 12.0;
    let wave_m2_s = (2.1e11_f64 / 7800.0 * second_moment_over_area_m2).sqrt();
    let bare_hz = 1.875104_f64.powi(2) * wave_m2_s / 0.2_f64.powi(2) / std::f64::consts::TAU;
    let pad_share = PAD_MM / BEAM_MM[2] / CELLS[0] as f64;
    let expected_hz = bare_hz / (1.0 + 4.0 * pad_share).sqrt();
    assert!(apart(hz(&of_beam), expected_hz) < 0.01, "{expected_hz}");

    let state = &with_pad["static"];
    let pairs = with_pad["pairs"].as_u64().unwrap();
    assert!(pairs > 0);
    assert_eq!(state["open_pairs"].as_u64(), Some(pairs));
    assert_eq!(state["largest_pressure_pa"].as_f64(), Some(0.0));
    let [alone, padded] = [alone, padded].map(|run| run.table("response.csv"));
    assert_eq!((alone.len(), padded.len()), (17, 17));
    let mut largest_m = 0.0_f64;
    for (a, b) in alone.iter().zip(&padded) {
        let [f, g] = [a, b].map(|row| number(row, "frequency_hz"));
        assert_eq!(f, g);
        for column in ["tip_amplitude_m", "tip_linear_amplitude_m"] {
            let [a, b] = [a, b].map(|row| number(row, column));
            // At a resonance an amplitude is off by the quality factor times as much as the
            // frequency is.
            let off = apart(b, a);
            println!("{f} Hz: {a:e} m, {off:.1e}");
            assert!(off < 1e-8, "{f} Hz, {column}: {off:e}");
            largest_m = largest_m.max(a);
        }
    }
    // The tip of 3 E I / L^3 amplified by 1 / (2 * 0.005), less the share of higher modes: 2.28 um
    // at the resonance.
    assert!((1.5e-6..2.4e-6).contains(&largest_m), "{largest_m:e}");
}

#[test]
fn a_steady_load_that_does_not_close_a_gap_bends_the_beam_as_without_it() {
    let folder = Folder::new("open_loaded");
    // 4.2 N/mm: 0.1 N bends the tip down by a quarter of the gap.
    let load = "[[load]]\non = \"TIP\"\ndirection = [0, 0, -1]\nforce_n = 0.1\n";
    let [alone, padded] = [("alone", ""), ("padded", PAD)]
        .map(|(name, more)| run("static", &folder, name, &format!("{more}{load}")).summary());
    let pairs = padded["pairs"].as_u64();
    assert_eq!(padded["static"]["open_pairs"].as_u64(), pairs);
    let hz = |summary: &Value| summary["linear_frequency_hz"].as_f64().unwrap();
    assert!(apart(hz(&padded), hz(&alone)) < 1e-9);
    // Five times as much closes it.
    let load = load.replace("0.1", "0.5");
    let closed = run("static", &folder, "closed", &format!("{PAD}{load}")).summary();
    assert!(closed["static"]["open_pairs"].as_u64() < pairs);
}

/// The beam is refused if nothing fixes it, or nothing along one axis, and the message names the
/// free motion.
#[test]
fn a_body_that_nothing_holds_where_all_pairs_are_open_is_refused_and_named() {
    let folder = Folder::new("open_free");
    folder.write("beam.inp", deck());
    let guided = "fixed_x = [\"ROOT\"]\nfixed_y = [\"ROOT\"]";
    for (support, expected) in [
        ("", "nothing holds body `beam`: no pair"),
        (guided, "nothing holds body `beam` along z: no pair"),
    ] {
        let scene = SCENE.replace("fixed = [\"ROOT\"]", support);
        let file = folder.write("scene.toml", format!("{scene}{PAD}"));
        has(
            &told(scene_command("run", &file, &folder.join("out"), &[]), 1),
            expected,
        );
    }
}
