//! The hash by which a folder knows the scene of its run: each key and the contents of each file count,
//! and the place of the scene does not.

use std::path::Path;

use crate::shared_folder::Folder;
use dovetail::scene::parse;
use dovetail::scene_files;

/// A scene with a path of each kind.
const ASSEMBLY: &str = r#"
name = "hashed"

[mesh]
geometry = "../geometry/part.geo"
parameters = { nu = 4, nv = 9 }
fallback = "ready.msh"
fallback_parameters = { nu = 4, nv = 9 }
metres_per_unit = 1e-3

[[body]]
name = "blade"
volume = "blade"
young_pa = 113.8e9
poisson = 0.34
density_kg_m3 = 4430

[[body]]
name = "jaw"
mesh_file = "meshes/jaw.inp"
units = "mm-t-s"
rotation_deg = 90
rotation_axis = [1, 0, 0]
translation_m = [0, 0, -0.25]
volume = "jaw"
stiffness_file = "jaw.K.mtx"
mass_file = "../jaw.M.mtx"
rows_file = "jaw.csv"
fixed = ["base"]

[cyclic]
sectors = 6
low = ["low"]
high = ["high"]
axis = [1, 0, 0]
engine_order = 4
influence = "air.csv"
influence_on = "blade"

[rotation]
axis = [1, 0, 0]
speed_rpm = 5000

[[contact]]
name = "root"
first = "blade_flank"
second = "jaw_flank"
friction_file = "friction.csv"

[[load]]
on = "tip"
direction = [0, 0, -1]
force_n = 5000

[[spring]]
name = "wire"
first = "tip"
stiffness_n_m = 1e6

[damping]
ratio = 0.001

[[excitation]]
on = "side"
file = "blown.csv"
factor = 1.0

[[observe]]
name = "tip"
points = "tip"
direction = [0, 1, 0]

[response]
times_first_linear_mode = [0.99, 1.01]
"#;

const REDUCED: &str = r#"
name = "hashed"

[reduced_model]
folder = "model"
friction = 0.3
force_n = 1.0

[damping]
ratio = 0.001

[response]
frequency_hz = [1.0, 2.0]
"#;

fn hash_in(folder: &Path, text: &str, set: &[&str]) -> String {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    let scene = parse(text, "scene.toml", folder, &set);
    let scene = scene.unwrap_or_else(|error| panic!("{set:?}: {error:?}"));
    scene_files::hash(&scene, &folder.join("scene.toml")).unwrap()
}

#[test]
fn a_scene_in_another_folder_is_the_same() {
    for text in [ASSEMBLY, REDUCED] {
        let own = hash_in(Path::new("scenes"), text, &[]);
        for folder in ["", "a/b", "/an absolute \"place\"/é"] {
            assert_eq!(hash_in(Path::new(folder), text, &[]), own, "{folder}");
        }
    }
}

#[test]
fn each_key_of_a_scene_counts() {
    let of_assembly = [
        "name=\"other\"",
        "mesh.geometry=\"../geometry/other.geo\"",
        "mesh.parameters={ nu = 5, nv = 9 }",
        "mesh.fallback=\"other.msh\"",
        "mesh.metres_per_unit=1",
        "body.0.name=\"vane\"",
        "body.0.volume=\"vane\"",
        "body.0.young_pa=113.8000000000001e9",
        "body.0.poisson=0.3",
        "body.0.density_kg_m3=4431",
        "body.0.fixed_interface_modes=3",
        "body.0.fixed_x=[\"tip\"]",
        "body.1.mesh_file=\"jaw.inp\"",
        "body.1.units=\"m-kg-s\"",
        "body.1.rotation_deg=91",
        "body.1.translation_m=[0, 0, -0.26]",
        "body.1.stiffness_file=\"jaw.M.mtx\"",
        "body.1.mass_file=\"jaw.M.mtx\"",
        "body.1.rows_file=\"rows.csv\"",
        "body.1.fixed=[]",
        "cyclic.sectors=7",
        "cyclic.low=[\"left\"]",
        "cyclic.high=[\"right\"]",
        "cyclic.engine_order=5",
        "cyclic.influence=\"wind.csv\"",
        "cyclic.influence_on=\"jaw\"",
        "rotation.speed_rpm=5001",
        "rotation.prestress=\"none\"",
        "contact.0.name=\"foot\"",
        "contact.0.second=\"other\"",
        "contact.0.friction_file=\"other.csv\"",
        "contact.0.gap_m=1e-6",
        "contact.0.slave=\"first\"",
        "contact.0.crown_radius_m=1",
        "load.0.on=\"root\"",
        "load.0.force_n=5001",
        "load.0.direction=[0, 1, 0]",
        "spring.0.stiffness_n_m=2e6",
        "spring.0.second=\"side\"",
        "damping.ratio=0.002",
        "excitation.0.file=\"other.csv\"",
        "excitation.0.factor=2",
        "excitation.0.harmonic=2",
        "excitation.0.phase_deg=90",
        "observe.0.points=\"side\"",
        "observe.0.direction=[1, 0, 0]",
        "response.times_first_linear_mode=[0.98, 1.01]",
        "response.points=10",
        "response.harmonics=3",
        "response.eps_scale=2",
        "response.accuracy=0.02",
        "response.max_newton_iterations=50",
        "response.solver=\"powell\"",
        "response.stuck_modes=20",
        "static.load_steps=3",
    ];
    let of_reduced = [
        "reduced_model.folder=\"other\"",
        "reduced_model.friction=0.4",
        "reduced_model.force_n=2",
        "response.frequency_hz=[1.0, 2.5]",
    ];
    let folder = Path::new("scenes");
    for (text, changes) in [(ASSEMBLY, &of_assembly[..]), (REDUCED, &of_reduced[..])] {
        let mut seen = vec![(hash_in(folder, text, &[]), "nothing")];
        for change in changes {
            let hash = hash_in(folder, text, &[change]);
            let same = seen.iter().find(|(other, _)| *other == hash);
            assert!(same.is_none(), "{change} is like {}", same.unwrap().1);
            seen.push((hash, change));
        }
    }
}

#[test]
fn the_content_of_each_file_counts() {
    let folder = Folder::new("scene_hash");
    std::fs::create_dir(folder.join("meshes")).unwrap();
    let files = [
        "friction.csv",
        "blown.csv",
        "air.csv",
        "jaw.csv",
        "jaw.K.mtx",
        "meshes/jaw.inp",
    ];
    let mut seen = vec![hash_in(&folder, ASSEMBLY, &[])];
    for file in files {
        for content in ["1", "2"] {
            std::fs::write(folder.join(file), content).unwrap();
            let hash = hash_in(&folder, ASSEMBLY, &[]);
            assert!(!seen.contains(&hash), "{file}");
            seen.push(hash);
        }
    }
}
