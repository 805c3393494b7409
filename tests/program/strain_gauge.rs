//! A strain gauge from the scene to its tables, curves and report, and from a folder of a reduced
//! model.

use crate::shared_program::{SMALL, said, scene_command, unwrapped};
use crate::shared_runs::{Run, number};
use dovetail_testkit::folder::{Folder, root};

const GAUGE: &str = "[[observe]]\nname = \"gauge\"\npoints = \"blade_leading_edge\"\n\
                     direction = [0, 0, 1]\nquantity = \"strain\"\n";
const QUICK: [&str; 5] = [
    "response.compare_harmonics=",
    "response.harmonics=1",
    "response.samples=64",
    "response.points=3",
    "response.times_first_linear_mode=[0.998, 1.0]",
];

/// The paper's scene on its small mesh with a gauge behind its observed displacement.
fn gauge_scene(folder: &Folder) -> std::path::PathBuf {
    let paper = std::fs::read_to_string(root().join("scenes/paper.toml")).unwrap();
    folder.write("scene.toml", format!("{paper}\n{GAUGE}"))
}

/// Mesh of the small joint, from any folder.
fn small() -> String {
    let file = SMALL.rsplit('/').next().unwrap();
    format!("mesh.file={}", root().join("meshes").join(file).display())
}

/// The amplitude of the strain and that of its one harmonic agree, its steady part is that of the
/// static state to what the contacts change, and it is of the size that the stress there has. A folder
/// of the reduced model has the same gauge.
#[test]
fn a_gauge_stands_in_tables_curves_report_and_folders() {
    let folder = Folder::new("strain_gauge");
    let scene = gauge_scene(&folder);
    let mesh = small();
    let set = [&[mesh.as_str()], &QUICK[..]].concat();
    let run = Run::run_file("run", &scene, "strain_gauge", &set);
    let observed = &run.summary()["observations"];
    assert_eq!(observed[0]["quantity"], "displacement");
    assert_eq!(observed[1]["quantity"], "strain");
    let response = run.table("response.csv");
    for row in &response {
        let amplitude = number(row, "gauge_amplitude_strain");
        assert!((1e-5..1e-2).contains(&amplitude), "{amplitude}");
        let of_harmonic = number(row, "gauge_h1_amplitude_strain");
        assert!((amplitude / of_harmonic - 1.0).abs() < 1e-3, "{row:?}");
        assert!(number(row, "gauge_linear_amplitude_strain") > 0.0);
        assert!(number(row, "tip_amplitude_m") > 0.0);
    }
    let statics = run.table("static_observed.csv");
    assert_eq!(
        (&statics[0]["name"][..], &statics[1]["name"][..]),
        ("tip", "gauge")
    );
    assert_eq!(
        (&statics[0]["strain"][..], &statics[1]["displacement_m"][..]),
        ("", "")
    );
    // The blade is pulled outwards.
    assert!(number(&statics[1], "strain") > 1e-5, "{statics:?}");
    let report = std::fs::read_to_string(run.0.join("report.html")).unwrap();
    assert!(report.contains("gauge is the strain of"));
    let picture = std::fs::read_to_string(run.0.join("plots/response_gauge.svg")).unwrap();
    assert!(picture.contains("m/m"), "the unit of a strain");

    let reduced = Folder::new("strain_gauge_reduced");
    let mut reduce = scene_command("reduce", &scene, &reduced, &[mesh.as_str()]);
    assert!(reduce.output().unwrap().status.success());
    let model = std::fs::read_to_string(reduced.join("model.json")).unwrap();
    assert!(model.contains("\"observed_strains\""), "{model}");
    // What is left out of the scene stands in the folder.
    let rest = "name = \"of_folder\"\n[reduced_model]\nfolder = \".\"\nfriction = 0.3\nforce_n = 2\n\
                [damping]\nratio = 0.001\nlinear_mode = 1\n[response]\nharmonics = 1\n\
                samples = 64\npoints = 3\ntimes_first_linear_mode = [0.998, 1.0]\n";
    let of_folder = reduced.write("of_folder.toml", rest);
    let again = Run::run_file("run", &of_folder, "strain_gauge_again", &[]);
    let name = "gauge_linear_amplitude_strain";
    for (a, b) in response.iter().zip(&again.table("response.csv")) {
        let [a, b] = [a, b].map(|row| number(row, name));
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn a_gauge_is_no_displacement() {
    let folder = Folder::new("strain_gauge_refused");
    let scene = gauge_scene(&folder);
    let mesh = small();
    let set = [&[mesh.as_str()], &QUICK[..]].concat();
    let refused = |command: &str, set: &[&str], more: &[&str], words: &[&str]| {
        let output = scene_command(command, &scene, &folder.join("out"), set)
            .args(more)
            .output()
            .unwrap();
        let said = unwrapped(&said(&output));
        assert!(!output.status.success(), "{said}");
        for word in words {
            assert!(said.contains(word), "{word}: {said}");
        }
    };
    let first = [&set[..], &["observe.tip.quantity=strain"]].concat();
    refused(
        "run",
        &first,
        &[],
        &[
            "the first [[observe]] is a strain",
            "of a displacement before it",
        ],
    );
    refused(
        "peaks",
        &set,
        &["--over", "excitation.0.force_n=1:2:2", "--observe", "gauge"],
        &["no observed displacement `gauge`, but tip"],
    );
    let across = [&set[..], &["observe.gauge.points=blade_tip"]].concat();
    refused(
        "run",
        &across,
        &[],
        &["observation `gauge`", "blade_tip", "30 degrees at most"],
    );
    let unknown = [&set[..], &["observe.gauge.quantity=stress"]].concat();
    refused(
        "run",
        &unknown,
        &[],
        &["observe.gauge.quantity", "displacement", "strain"],
    );
}
