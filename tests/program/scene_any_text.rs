//! Any text and any `--set` arguments: no panic, a message that can be displayed, and no impossible
//! scene.

use std::path::Path;

use crate::shared_program::rendered;
use dovetail::scene;
use dovetail::study::cases;
use dovetail::study_file::Study;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::model::{ExcitationKind, LoadKind, MaterialSpec, MatrixSource};
use dovetail_testkit::folder::root;
use proptest::prelude::*;
use proptest::sample::{Index, select};

const PAPER: &str = include_str!("../../scenes/paper.toml");

/// Reads a scene, renders its errors, or checks that a valid scene is possible.
fn survives(text: &str, overrides: &[String]) {
    let scene = match scene::parse(text, "any.toml", Path::new(""), overrides) {
        Ok(scene) => scene,
        Err(error) => {
            rendered(&error);
            return;
        }
    };
    let response = &scene.response;
    let harmonics = match response.resolution {
        Resolution::Fixed { harmonics, samples } => {
            assert!(samples > 2 * harmonics + 1);
            harmonics
        }
        accuracy @ Resolution::Accuracy(_) => accuracy.most_harmonics(),
    };
    assert!(response.points != Some(0));
    let assembly = scene.assembly().unwrap();
    assert!(
        assembly
            .excitations
            .iter()
            .all(|e| (1..=harmonics).contains(&e.harmonic))
    );
    assert!(assembly.bodies.len() == 2 && !assembly.contacts.is_empty());
    let excited = assembly.excitations.iter().filter_map(|e| match &e.kind {
        ExcitationKind::Load(load) => match load.load {
            LoadKind::Force { vector_n: unit } | LoadKind::Traction { vector_pa: unit } => {
                Some(unit)
            }
            LoadKind::Pressure { .. } => None,
        },
        ExcitationKind::Base { direction, .. } => Some(*direction),
        ExcitationKind::Field { .. } => None,
    });
    for direction in excited.chain(assembly.observations.iter().map(|o| o.direction)) {
        let length2: f64 = direction.iter().map(|c| c * c).sum();
        assert!((length2 - 1.0).abs() < 1e-12, "{direction:?}");
    }
    for body in &assembly.bodies {
        let MatrixSource::Elements(MaterialSpec::Given(material)) = body.matrices else {
            continue; // of the mesh
        };
        assert!(material.young_pa > 0.0 && material.young_pa.is_finite());
        assert!(material.density_kg_m3 > 0.0 && material.density_kg_m3.is_finite());
        assert!(material.poisson > -1.0 && material.poisson < 0.5);
    }
}

/// Initial inputs of `make fuzz` besides the files that other tests read.
#[test]
fn the_seeds_of_fuzzing_are_possible() {
    let fuzz = root().join("fuzz");
    for file in [
        "fuzz_targets/blocks.toml",
        "seeds/scene/geometry.toml",
        "seeds/scene/reduced_model.toml",
    ] {
        let read = scene::load(&fuzz.join(file), &[]);
        assert!(read.is_ok(), "{file}: {read:?}");
    }
    let file = fuzz.join("seeds/study/grid.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let study = Study::parse(&text, &file, &[]);
    assert_eq!(cases(&study.unwrap()).len(), 24);
}

/// Text fragments that are likely to bring a scene to the edge of validity.
fn piece() -> impl Strategy<Value = String> {
    let known = [
        "[",
        "]",
        "[[body]]",
        "[mesh]",
        "=",
        "\n",
        "\"",
        "'''",
        "{",
        "}",
        ",",
        ".",
        "#",
        "nan",
        "-inf",
        "0",
        "-1",
        "1e308",
        "1e-320",
        "99999999999999999999999999",
        "true",
        "1979-05-27",
        "name",
        "mesh.file",
        "body",
        "contact",
        "response.points = 3",
        "é",
        "\u{0}",
        "\r",
        "[0, 0, 0]",
        "static = 1",
        "a.b.c = 2",
    ];
    prop_oneof![select(known.to_vec()).prop_map(str::to_owned), ".{0,6}"]
}

fn argument() -> impl Strategy<Value = String> {
    let keys = [
        "response.points",
        "contact.*.friction",
        "contact.left",
        "body.*",
        "*",
        "body.0.fixed.0",
        "mesh",
        "mesh.parameters.nu",
        "rotation.axis.2",
        "excitation.0.direction",
        "name",
        "x.y.z",
        "",
        "é.ü",
        "response.samples",
        "response.harmonics",
        "observe.tip.direction",
        "body.1.young_pa",
    ];
    let known = (select(keys.to_vec()), piece()).prop_map(|(key, value)| format!("{key}={value}"));
    prop_oneof![3 => known, 1 => ".{0,20}"]
}

/// The text with a few places overwritten.
fn damaged(edits: &[(Index, usize, String)]) -> String {
    let mut text = PAPER.to_owned();
    for (at, length, piece) in edits {
        let boundary = |i: usize| {
            (0..=i.min(text.len()))
                .rev()
                .find(|&i| text.is_char_boundary(i))
                .unwrap_or(0)
        };
        let from = boundary(at.index(text.len() + 1));
        let to = boundary(from + length);
        text.replace_range(from..to, piece);
    }
    text
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..Default::default() })]

    #[test]
    fn arbitrary_text(text in "(?s).{0,200}", overrides in prop::collection::vec(argument(), 0..3)) {
        survives(&text, &overrides);
    }

    #[test]
    fn pieces_of_toml(pieces in prop::collection::vec(piece(), 0..30)) {
        survives(&pieces.concat(), &[]);
    }

    #[test]
    fn a_damaged_scene(
        edits in prop::collection::vec((any::<Index>(), 0usize..12, piece()), 1..6),
        overrides in prop::collection::vec(argument(), 0..4),
    ) {
        survives(&damaged(&edits), &overrides);
    }

    #[test]
    fn a_scene_with_any_arguments(overrides in prop::collection::vec(argument(), 1..6)) {
        survives(PAPER, &overrides);
    }

    #[test]
    fn any_number_for_any_key(
        line in select(vec![
            "young_pa = 113.8e9", "poisson = 0.34", "density_kg_m3 = 4430", "friction = 0.3",
            "speed_rpm = 5000", "ratio = 0.001", "force_n = 2.0", "samples = 128", "harmonics = 3",
            "compare_harmonics = 1", "metres_per_unit = 1e-3", "harmonic = 1", "[0, 1, 0]", "[0.98, 1.02]",
        ]),
        value in prop_oneof![any::<f64>().prop_map(|v| format!("{v:?}")), any::<i64>().prop_map(|v| v.to_string())],
    ) {
        let replaced = match line.split_once(" = ") {
            Some((key, _)) => format!("{key} = {value}"),
            None => line.replacen(&line[1..2], &value, 1),
        };
        survives(&PAPER.replacen(line, &replaced, 1), &[]);
    }
}
