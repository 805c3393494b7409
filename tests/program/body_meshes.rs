//! Scenes of bodies with meshes of their own, and the messages of the program about them.

use std::path::{Path, PathBuf};

use crate::shared_folder::Folder;
use crate::shared_program::{cases, has, scene_command, told};
use crate::shared_runs::summary;
use dovetail::scene;
use dovetail_mesh::parts::Placement;
use dovetail_mesh::units::Units;
use dovetail_solver::model::{Assembly, BodyMesh, MaterialSpec, MatrixSource};
use dovetail_testkit::folder::root;
use miette::Diagnostic;

/// Two bodies of two decks, without `[mesh]`.
const SCENE: &str = r#"
name = "two_decks"
[[body]]
name = "blade"
mesh_file = "blade.inp"
units = "mm-t-s"
volume = "BLADE"
rotation_axis = [0, 0, 2]
rotation_deg = 90
translation_m = [0, 0, 0.5]
[[body]]
name = "disc"
mesh_file = "disc.msh"
metres_per_unit = 1
volume = "disc"
young_pa = 200e9
poisson = 0.3
density_kg_m3 = 7850
fixed = ["base"]
[[contact]]
name = "c"
first = "blade.flank"
second = "disc.flank"
friction = 0.3
[damping]
ratio = 0.001
[[excitation]]
on = "tip"
direction = [0, 1, 0]
force_n = 1
[[observe]]
name = "tip"
points = "tip"
direction = [0, 1, 0]
[response]
frequency_hz = [1, 2]
points = 2
"#;

const TWO_DECKS: &str = "scenes/decks/two_decks.toml";

fn read(text: &str, overrides: &[&str]) -> Result<Assembly, String> {
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    let scene = scene::parse(text, "two_decks.toml", Path::new("here"), &overrides);
    scene
        .map(|scene| scene.assembly().unwrap().clone())
        .map_err(|error| {
            let scene::SceneError::Invalid { problems } = error else {
                panic!("{error}");
            };
            let texts = problems
                .iter()
                .map(|p| format!("{p} {}", p.help().map_or(String::new(), |h| h.to_string())));
            texts.collect::<Vec<_>>().join("; ")
        })
}

#[test]
fn a_scene_of_bodies_with_their_own_files_needs_no_mesh_table() {
    let assembly = read(SCENE, &[]).unwrap();
    assert_eq!(assembly.mesh, None);
    let [blade, disc] = [&assembly.bodies[0], &assembly.bodies[1]];
    assert_eq!(
        blade.mesh,
        BodyMesh::File {
            path: PathBuf::from("here/blade.inp"),
            units: Units::MillimetreTonneSecond,
            placement: Placement {
                axis: [0.0, 0.0, 1.0],
                point_m: [0.0; 3],
                angle_rad: std::f64::consts::FRAC_PI_2,
                translation_m: [0.0, 0.0, 0.5],
            },
        }
    );
    assert_eq!(
        blade.matrices,
        MatrixSource::Elements(MaterialSpec::OfMesh(None)),
        "a deck has materials"
    );
    assert!(matches!(
        disc.matrices,
        MatrixSource::Elements(MaterialSpec::Given(_))
    ));
    // The units of [mesh] hold for files that say nothing else.
    let with_mesh = "mesh.units=m-kg-s";
    let assembly = read(SCENE, &[with_mesh, "body.disc.metres_per_unit="]).unwrap();
    assert!(matches!(
        &assembly.bodies[1].mesh,
        BodyMesh::File {
            units: Units::MetreKilogramSecond,
            ..
        }
    ));
}

#[test]
fn a_copy_takes_what_it_does_not_say_from_its_original() {
    let disc = SCENE.find("name = \"disc\"").unwrap();
    let end = SCENE.find("[[contact]]").unwrap();
    let copy =
        "name = \"disc\"\ncopy_of = \"blade\"\ntranslation_m = [0, 0, 1]\nfixed = [\"base\"]\n";
    let text = format!("{}{copy}{}", &SCENE[..disc], &SCENE[end..]);
    let assembly = read(&text, &[]).unwrap();
    let [blade, disc] = [&assembly.bodies[0], &assembly.bodies[1]];
    assert_eq!(
        (&disc.volume, &disc.matrices),
        (&blade.volume, &blade.matrices)
    );
    assert_eq!(disc.fixed, ["base"]);
    assert!(matches!(&disc.mesh, BodyMesh::CopyOf { body, .. } if body == "blade"));
    let error = read(&text, &["body.disc.copy_of=wheel"]).unwrap_err();
    has(&error, "`body.disc.copy_of` & blade");
}

#[test]
fn contradictions_about_meshes_of_bodies_are_refused() {
    let table = "
        body.blade.copy_of=disc => mesh_file & copy_of
        body.blade.metres_per_unit=1e-3 => metres_per_unit & units
        body.blade.units=inch => body.blade.units & mm-t-s
        body.disc.metres_per_unit= => neither `body.disc.units` nor `body.disc.metres_per_unit`
        body.blade.rotation_axis= => body.blade.rotation_axis & is missing
        body.blade.rotation_axis=[0, 0, 0] => rotation_axis & length is zero
        body.disc.material=Steel => material & young_pa
        body.disc.young_pa= => body.disc.young_pa & is missing
        body.disc.mesh_file= => body.disc.metres_per_unit & mesh_file
        body.blade.volume= => body.blade.volume & is missing
        ";
    for [set, words] in cases(table) {
        has(&read(SCENE, &[&set]).unwrap_err(), &words);
    }
}

/// The disc of two decks moved along its slot by one and by two of the five columns of facets: the
/// nodes match all the same, and 4 and 3 columns of 5 lie opposite.
#[test]
fn a_body_that_stands_beside_its_place_is_warned_of_where_the_nodes_match() {
    for (shift_m, covered) in [(0.0, 1.0), (5e-3, 0.75), (10e-3, 0.5)] {
        let folder = Folder::new("moved");
        let moved = format!("body.jaw.translation_m=[{shift_m}, 0, -0.25]");
        let said = told(scene_command("mesh", TWO_DECKS, &folder, &[&moved]), 0);
        let warned = "neither flank lies wholly opposite the other";
        assert_eq!(
            said.matches(warned).count(),
            usize::from(covered < 1.0),
            "{said}"
        );
        for contact in summary(&folder)["mesh"]["contacts"].as_array().unwrap() {
            assert_eq!(contact["nodes_match"], true);
            for share in contact["covered"].as_array().unwrap() {
                let share = share.as_f64().unwrap();
                assert!((share - covered).abs() < 1e-9, "{share}, not {covered}");
            }
        }
    }
}

#[test]
fn what_a_deck_says_beside_is_told_with_its_file() {
    let folder = Folder::new("aside");
    let deck = std::fs::read_to_string(root().join("meshes/decks/disc.inp")).unwrap();
    let file = folder.write("tied.inp", deck + "*TIE, NAME=glue\nA, B\n");
    let set = format!("body.jaw.mesh_file={}", file.display());
    let said = told(
        scene_command("mesh", TWO_DECKS, &folder.join("out"), &[&set]),
        0,
    );
    let words = "tied.inp: These keywords were not read: *TIE. What *TIE joins is joined in the \
                 scene by a contact with the law `bonded`.";
    has(&said, words);
}
