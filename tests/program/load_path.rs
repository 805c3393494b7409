//! `[[static.path]]`: the steady load comes by way of other speeds and loads.

use std::path::Path;
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::{
    READY_PATCH, SMALL, ended, has, printed, rendered, said, scene_command, told,
};
use crate::shared_runs::{numbers, rows};
use dovetail::scene;
use dovetail_solver::description::{LoadMultiples, PathPoint, Scene};
use dovetail_testkit::folder::root;

const PAPER: &str = "scenes/paper.toml";

/// The paper's joint on its smallest mesh, with these settings.
fn paper(command: &str, out: &Path, set: &[&str]) -> Command {
    let quick = [
        SMALL,
        "response.compare_harmonics=",
        "response.harmonics=1",
        "response.samples=64",
    ];
    scene_command(command, PAPER, out, &[&quick[..], set].concat())
}

/// Tractions of all pairs, N, in the static state of a scene.
fn tractions_n(name: &str, scene: &Path, set: &[&str]) -> Vec<f64> {
    let out = Folder::new(name);
    ended(scene_command("static", scene, &out, set), 0);
    let file = out.join("static.csv");
    ["friction_t1_n", "friction_t2_n"]
        .map(|column| numbers(&file, column))
        .concat()
}

/// Largest difference relative to the largest value.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |m, v| m.max(v.abs()));
    most(&mut a.iter().zip(b).map(|(a, b)| a - b)) / most(&mut a.iter().copied())
}

/// Of rotation alone, sqrt(2) times the speed is twice the load: a reduced model, whose steady load
/// is a whole, has the same tractions after twice of it. A point on the straight way, and one at the
/// working speed, change nothing.
#[test]
fn a_speed_on_the_way_is_the_square_of_it_in_load() {
    let paper = root().join(PAPER);
    let of_mesh = |name: &str, set: &[&str]| {
        let set = [&[SMALL, "response.compare_harmonics="][..], set].concat();
        tractions_n(name, &paper, &set)
    };
    let straight = of_mesh("path_straight", &[]);
    let twice = of_mesh(
        "path_twice",
        &["static.path.0.speed_rpm=7071.0678118654755"],
    );
    assert!(
        apart(&straight, &twice) > 0.1,
        "{}",
        apart(&straight, &twice)
    );
    for (speed_rpm, load_steps) in [("3535.533905932738", "5"), ("5000", "10")] {
        let point = format!("static.path.0.speed_rpm={speed_rpm}");
        let steps = format!("static.load_steps={load_steps}");
        let on_the_way = of_mesh("path_on_the_way", &[&point, &steps]);
        let off = apart(&straight, &on_the_way);
        println!("{speed_rpm} rpm on the way: {off:e}");
        assert!(off < 1e-9, "{off:e}");
    }

    let folder = Folder::new("path_reduced");
    let set = [SMALL, "response.compare_harmonics="];
    let output = said(&ended(scene_command("reduce", PAPER, &folder, &set), 0));
    let keys = output.lines().skip_while(|l| *l != "[reduced_model]");
    let is_key = |l: &&str| l.starts_with('[') || l.contains(" = ");
    let keys: Vec<&str> = keys.take_while(is_key).collect();
    let text = format!(
        "name = \"again\"\n{}\n[damping]\nratio = 0.001\n[response]\n\
         times_first_linear_mode = [0.98, 1.02]\npoints = 2\nharmonics = 1\n\
         [[static.path]]\nloads = 2\n",
        keys.join("\n")
    );
    let scene = Folder::new("path_reduced_scene");
    let scene = scene.write("again.toml", text);
    let of_folder = tractions_n("path_of_folder", &scene, &[]);
    let off = apart(&twice, &of_folder);
    println!("twice the load of the folder: {off:e}");
    assert!(off < 1e-9, "{off:e}");
}

/// Two prisms pressed together, at rest. At 5000 rpm about an axis at their side friction held all
/// pairs, and nothing is left of it; at 12000 rpm some of them slid, and keep tractions that balance
/// each other.
#[test]
fn what_is_at_rest_may_have_rotated() {
    let at_rest = "rotation={ axis = [0, 1, 0], point_m = [-0.2, 0, 0], speed_rpm = 0, \
                   bodies = [\"upper\"] }";
    let scene = root().join("scenes/verification/patch.toml");
    let after = |speed_rpm: &str| {
        let path = format!("static.path.0.speed_rpm={speed_rpm}");
        tractions_n("path_at_rest", &scene, &[READY_PATCH, at_rest, &path])
    };
    let largest = |tractions_n: &[f64]| tractions_n.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    // 4050 N press the prisms together.
    for speed_rpm in ["0", "5000"] {
        let left_n = largest(&after(speed_rpm));
        assert!(left_n < 1e-8, "{speed_rpm} rpm: {left_n:e} N");
    }
    let left = after("12000");
    assert!(largest(&left) > 5.0, "{left:?}");
    for along in left.chunks_exact(left.len() / 2) {
        let sum_n: f64 = along.iter().sum();
        assert!(sum_n.abs() < 1e-8, "{sum_n:e} N");
    }
}

/// The first value is the working speed, a path of no effect.
#[test]
fn peaks_go_over_a_point_of_the_path() {
    let force = "excitation.*.force_n=0.1";
    let out = Folder::new("path_peaks");
    let mut command = paper("peaks", &out, &[force]);
    command.args(["--over", "static.path.0.speed_rpm=5000:8000:2"]);
    let said = printed(&ended(command, 0));
    has(&said, "peak of tip over static.path.0.speed_rpm");
    let peaks = numbers(&out.join("peaks.csv"), "amplitude_m");
    let run = Folder::new("path_peaks_run");
    let mut command = paper("run", &run, &[force]);
    ended(command.arg("--no-fields"), 0);
    let straight = numbers(&run.join("response.csv"), "tip_amplitude_m");
    let straight = straight.into_iter().fold(0.0, f64::max);
    assert!(
        (peaks[0] / straight - 1.0).abs() < 1e-3,
        "{peaks:?} {straight}"
    );
    assert!(peaks[peaks.len() - 1] > 1.01 * peaks[0], "{peaks:?}");
}

/// At each speed of a run-up the load comes by way of the same speed.
#[test]
fn a_run_up_follows_the_path_at_each_speed() {
    let amplitude = |name: &str, set: &[&str]| {
        let out = Folder::new(name);
        let set = [&["excitation.*.force_n=0.1"][..], set].concat();
        ended(paper("run", &out, &set).arg("--no-fields"), 0);
        let file = out.join("response.csv");
        (
            numbers(&file, "tip_amplitude_m")[0],
            numbers(&file, "slipping_pairs")[0],
        )
    };
    let path = "static.path.0.speed_rpm=8000";
    let speeds = [
        "response.along_engine_order=6",
        "response.speed_rpm=[4380, 4380]",
        "response.points=1",
    ];
    let up = amplitude("path_up", &[&speeds[..], &[path]].concat());
    let straight = amplitude("path_up_straight", &speeds);
    let single = [
        "rotation.speed_rpm=4380",
        "response.frequency_hz=[438, 438]",
        "response.points=1",
        path,
    ];
    let single = amplitude("path_single", &single);
    assert!((up.0 / single.0 - 1.0).abs() < 1e-6, "{up:?} {single:?}");
    assert_eq!(up.1, single.1);
    assert!(
        (up.0 / straight.0 - 1.0).abs() > 1e-4,
        "{up:?} {straight:?}"
    );
}

#[test]
fn the_report_says_by_which_way_the_load_came() {
    let out = Folder::new("path_report");
    let set = [
        "static.path=[{ speed_rpm = 6000 }, { speed_rpm = 0 }]",
        "response.points=2",
        "response.times_first_linear_mode=[0.9, 0.91]",
    ];
    ended(paper("run", &out, &set), 0);
    let html = out.text("report.html");
    for words in [
        "by way of 6000.0 rpm, then 0 rpm, each leg in 10 steps",
        "The stiffness is that of the working speed all the way.",
    ] {
        assert!(html.contains(words), "{words}");
    }
    assert_eq!(rows(&out.join("response.csv")).len(), 2);
}

fn parse(more: &str, overrides: &[&str]) -> Result<Scene, scene::SceneError> {
    let text = std::fs::read_to_string(root().join(PAPER)).unwrap();
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    let text = format!("{text}\n{more}");
    scene::parse(&text, "paper.toml", Path::new("scenes"), &overrides)
}

const TWO_LOADS: &str = "[[load]]\non = \"excitation\"\nforce_n = 1\ndirection = [1, 0, 0]\n\
                         [[load]]\non = \"excitation\"\nforce_n = 2\ndirection = [0, 1, 0]\n";

#[test]
fn points_have_a_speed_and_multiples_of_the_loads() {
    let scene = parse(
        TWO_LOADS,
        &["static.path=[{ speed_rpm = 0, loads = [1, -0.5] }, {}, { loads = 2 }]"],
    );
    let point = |speed_rad_s, loads| PathPoint { speed_rad_s, loads };
    assert_eq!(
        scene.unwrap().static_state.path,
        [
            point(Some(0.0), LoadMultiples::Each(vec![1.0, -0.5])),
            point(None, LoadMultiples::All(1.0)),
            point(None, LoadMultiples::All(2.0)),
        ]
    );
}

#[test]
fn a_point_that_means_nothing_is_refused_with_a_remedy() {
    let refused = |more: &str, overrides: &[&str], words: &str| {
        let error = parse(more, overrides).expect_err("the path is wrong");
        has(&rendered(&error), words);
    };
    let speed = "static.path.0.speed_rpm=6000";
    refused(
        "",
        &["rotation=", speed],
        "`static.path.0.speed_rpm` is given without `[rotation]` & give a section [rotation]",
    );
    refused(
        "",
        &["static.path.0.loads=2"],
        "`static.path.0.loads` is given without `[[load]]` & follows `speed_rpm`",
    );
    refused(
        TWO_LOADS,
        &["static.path.0.loads=[1, 0, 1]"],
        "`static.path.0.loads` has the wrong type & a list of 3; the scene has 2 [[load]] \
         & write it like this: loads = [1, 0]",
    );
    refused(
        TWO_LOADS,
        &["static.path.0.loads=[]"],
        "`static.path.0.loads` & at least one value",
    );
    refused(
        TWO_LOADS,
        &["static.path.0.loads=[inf, 1]"],
        "static.path.0.loads & a finite number",
    );
    refused(
        "",
        &["static.path.0.speed_rpm=-1"],
        "is -1; it must be 0 or more",
    );
    refused(
        "",
        &["static.path.0.rpm=6000"],
        "unknown key `static.path.0.rpm` & the keys of `static.path` are: speed_rpm, loads",
    );
    refused(
        "",
        &["static.path=[[1, 2]]"],
        "`static.path` has to be a list of tables & [[static.path]]",
    );
    refused(
        "",
        &["static.path=6000"],
        "`static.path` has to be a list of tables",
    );
    refused(
        "",
        &["static.overload=2"],
        "unknown key `static.overload` & path",
    );
    let of_folder = |set: &str, words: &str| {
        let out = Folder::new("path_of_jenkins");
        let scene = "scenes/verification/jenkins.toml";
        has(
            &told(scene_command("static", scene, &out, &[set]), 2),
            words,
        );
    };
    of_folder(
        speed,
        "`static.path.0.speed_rpm` is given without `[rotation]` & a reduced model holds its steady \
         load as a whole & `loads`",
    );
    of_folder(
        "static.path.0.loads=[1, 2]",
        "`static.path.0.loads` has the wrong type & one number",
    );
    refused(
        "",
        &[
            "rotation.speed_rpm=0",
            "body.blade.stiffness_file=blade.mtx",
            "body.blade.mass_file=blade.mtx",
            "body.blade.young_pa=",
            "body.blade.poisson=",
            "body.blade.density_kg_m3=",
            speed,
        ],
        "`static.path.0.speed_rpm` and `body.blade.stiffness_file` exclude each other & [rotation]",
    );
}
