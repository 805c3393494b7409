//! Checks of a peak by other runs, in the report and in summary.json: over residual tractions, and
//! by a study of meshes in a folder beside the run.

use crate::shared_folder::Folder;
use crate::shared_program::{SMALL, ended, has, program};
use crate::shared_runs::{json, summary};
use dovetail_testkit::folder::root;
use serde_json::Value;

const OTHER: &str = "mesh.file=../meshes/dovetail_order1.msh";
/// Settings of the paper's scene for a quick response.
const QUICK: [&str; 5] = [
    "response.compare_harmonics=",
    "response.harmonics=1",
    "response.samples=64",
    "response.points=5",
    "response.times_first_linear_mode=[0.99, 1.01]",
];

/// Checks of a run in a folder, whose results go into `out` there.
fn checked(folder: &Folder, out: &str, set: &[&str]) -> Value {
    let mut run = program(
        folder,
        &["run", "--no-cache", "--no-fields", "--force", "--out", out],
    );
    run.arg(root().join("scenes/paper.toml"));
    run.args(QUICK.iter().chain(set).flat_map(|set| ["--set", set]));
    ended(run, 0);
    summary(&folder.join(out))["checks"].clone()
}

fn near(found: &Value, expected: f64) {
    let found = found.as_f64().unwrap();
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn the_error_of_a_mesh_is_that_of_a_study_beside_the_run() {
    let folder = Folder::new("mesh_study");
    let alone = checked(&folder, "run", &[SMALL]);
    let of_root = |file: &str| root().join(file).display().to_string();
    for (check, begin, end) in [
        (
            "residual_tractions",
            format!("dovetail run {} --set ", of_root("scenes/paper.toml")),
            format!("{SMALL} --set static.starting_tractions=2 --out output/paper_tractions"),
        ),
        (
            "flank_mesh",
            "dovetail study ".to_owned(),
            of_root("studies/flank_mesh.toml"),
        ),
    ] {
        assert_eq!(alone[check]["verdict"], "not_checked");
        let told = alone[check]["command"].as_str().unwrap();
        assert!(told.starts_with(&begin) && told.ends_with(&end), "{told}");
    }
    let page = folder.text("run/report.html");
    has(
        &page,
        "Not checked: does the peak depend on the residual tractions",
    );
    has(&page, "Not checked: is the mesh of the flanks fine enough");
    has(&page, "static.starting_tractions=2");

    let file = folder.write(
        "study.toml",
        format!(
            "name = \"meshes\"\nscene = \"{}/scenes/paper.toml\"\nset = {QUICK:?}\n\
             quantities = [\"peak_amplitude_m\", \"peak_friction_power_w\"]\n\
             [[parameter]]\nname = \"mesh\"\nkey = \"mesh.file\"\nis = \"numerical\"\nsize = [2, 1]\n\
             values = [\"../meshes/dovetail_order1.msh\", \"../meshes/dovetail_small.msh\"]\n",
            root().display()
        ),
    );
    let study = folder.join("output/meshes");
    ended(
        program(root(), &["study"])
            .arg(file)
            .arg("--out")
            .arg(&study),
        0,
    );
    let found = json(&study.join("summary.json"));
    assert_eq!(
        found["parameters"][0]["keys"],
        serde_json::json!(["mesh.file"])
    );
    let figures = found["refinements"][0]["figures"].as_array().unwrap();
    let error = |figure: &str, mesh: usize| {
        let figure = figures.iter().find(|f| f["figure"] == figure).unwrap();
        figure["estimated_errors"][mesh].as_f64().unwrap()
    };
    for (mesh, file) in [OTHER, SMALL].into_iter().enumerate() {
        let check = &checked(&folder, "run", &[file])["flank_mesh"];
        assert_eq!(check["study"], "meshes");
        assert!(check["command"].is_null());
        let errors = ["peak_amplitude_m", "peak_friction_power_w"].map(|f| error(f, mesh));
        near(&check["peak_error"], errors[0]);
        near(&check["friction_power_error"], errors[1]);
        let is_large = errors.iter().any(|e| *e > 0.02);
        assert_eq!(check["verdict"], if is_large { "large" } else { "small" });
        has(&folder.text("run/report.html"), "(study meshes)");
    }
    // A mesh that the study does not have.
    let check = &checked(&folder, "run", &["mesh.file=../meshes/dovetail.msh"])["flank_mesh"];
    assert_eq!(check["verdict"], "not_checked");
    assert_eq!(check["study"], "meshes");
    assert!(check["command"].is_string());
}

#[test]
fn residual_tractions_need_friction() {
    let folder = Folder::new("mesh_study_smooth");
    let smooth = checked(&folder, "run", &[SMALL, "contact.*.friction=0"]);
    assert!(smooth["residual_tractions"].is_null());
    assert_eq!(smooth["flank_mesh"]["verdict"], "not_checked");
    let page = folder.text("run/report.html");
    assert!(!page.contains("residual tractions"));
}

#[test]
fn a_study_of_another_scene_or_of_no_mesh_is_no_check() {
    let folder = Folder::new("mesh_study_other");
    let record = |scene: &str, key: &str| {
        format!(
            "{{\"study\": \"other\", \"scene_blake3\": \"{scene}\", \
             \"parameters\": [{{\"name\": \"p\", \"keys\": [\"{key}\"]}}], \
             \"refinements\": [{{\"parameter\": \"p\", \"cases\": [], \"figures\": []}}]}}"
        )
    };
    let scene = std::fs::read(root().join("scenes/paper.toml")).unwrap();
    let hash = blake3::hash(&scene).to_string();
    for (text, study) in [
        (record(&hash, "response.harmonics"), Value::Null),
        (record("0", "mesh.file"), Value::Null),
        ("no summary".to_owned(), Value::Null),
        (record(&hash, "mesh.file"), Value::from("other")),
    ] {
        std::fs::create_dir_all(folder.join("other/cases")).unwrap();
        folder.write("other/summary.json", text);
        let check = &checked(&folder, "run", &[SMALL])["flank_mesh"];
        assert_eq!(check["verdict"], "not_checked");
        assert_eq!(check["study"], study);
    }
}
