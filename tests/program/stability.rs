//! Stability of the motions of a run, and the warnings about unstable ones. A mass on a stop, excited at
//! twice its nonlinear resonance, moves with twice the period of the excitation. Leapfrog integration
//! over 2000 periods of 16,000 steps gives half ranges of 1.2732 m and 1.5364 m in alternate periods.

use crate::reduced_scenes::write_model;
use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, scene_command, told};
use crate::shared_runs::{Row, number, rows, summary};
use std::path::PathBuf;

const SCENE: &str = r#"
name = "touching"
[reduced_model]
folder = "touching"
friction = 0
force_n = 0.1
normal_stiffness_n_m = 10
tangential_stiffness_n_m = 10
[damping]
mass_per_s = 0.01
[response]
frequency_hz = [0.489139, 0.489139]
"#;

/// Scene of 1 kg on a spring of 1 N/m, which touches a stop of 10 N/m.
fn touching(folder: &Folder) -> PathBuf {
    let diagonal = || vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let along = || vec![1.0, 0.0, 0.0];
    write_model(
        &folder.join("touching"),
        &[
            ("positions", 3, vec![0.0; 3]),
            ("stiffness", 3, diagonal()),
            ("mass", 3, diagonal()),
            ("static_load", 1, vec![0.0; 3]),
            ("excitations", 1, along()),
            ("observed_points", 1, along()),
        ],
    );
    folder.write("scene.toml", SCENE)
}

#[test]
fn an_unstable_peak_is_told_and_the_run_says_where_it_leads() {
    let folder = Folder::new("departs");
    let scene = touching(&folder);
    let out = folder.join("out");
    let stderr = told(scene_command("run", &scene, &out, &[]), 3);
    has(
        &stderr,
        "the peak of tip at 0.489139 Hz is unstable (period doubling, multiplier −3.20)",
    );
    has(&stderr, "no stable motion was found");
    let [row, doubled] = &rows(&out.join("response.csv"))[..] else {
        panic!("a motion of one period and one of two");
    };
    assert_eq!([&row["periods"], &doubled["periods"]], ["1", "2"]);
    // The two periods may come in either order.
    let halves =
        ["first", "second"].map(|word| number(doubled, &format!("tip_{word}_period_amplitude_m")));
    let [least, most] = [f64::min, f64::max].map(|end| end(halves[0], halves[1]));
    println!("half ranges of two periods: {halves:.4?} m");
    assert!((least / 1.2732 - 1.0).abs() < 0.01, "{halves:?}");
    assert!((most / 1.5364 - 1.0).abs() < 0.01, "{halves:?}");
    assert_eq!(doubled["stable"], "yes");
    assert_eq!(number(doubled, "frequency_hz"), 0.489139);
    has(
        &stderr,
        "there is a response of twice the period of the excitation: half of its range over both periods reaches 1.71",
    );
    assert_eq!(
        [&row["stable"], &row["instability"]],
        ["no", "period_doubling"]
    );
    // The multiplier of an integration of the first variation is -3.2009.
    assert!(
        (number(row, "floquet_multiplier") - 3.2009).abs() < 1e-3,
        "{row:?}"
    );
    assert!((number(row, "floquet_argument_rad") - std::f64::consts::PI).abs() < 1e-9);
    let found = summary(&out);
    let peak = &found["response"]["peak_stability"];
    assert_eq!(peak["stable"], false);
    assert_eq!(peak["instability"], "period_doubling");
    assert!(peak["largest_stable_amplitude_m"].is_null());
    let range = &peak["departure"]["amplitude_range_m"];
    let [least, most] = [0, 1].map(|i| range[i].as_f64().unwrap());
    // The motion may not have settled yet, and is far beyond the 0.0143 m of the balance.
    assert!(least > 0.1 && most > 1.0, "{range}");
    assert_eq!(found["response"]["unstable_points"], 1);
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    has(
        &report,
        "The peak is unstable (period doubling, multiplier −3.20)",
    );

    // Nobody asks, nobody answers.
    let none = folder.join("none");
    let stderr = told(
        scene_command("run", &scene, &none, &["response.stability=none"]),
        0,
    );
    assert!(!stderr.contains("unstable"), "{stderr}");
    assert_eq!(rows(&none.join("response.csv"))[0]["stable"], "not_judged");
    assert!(summary(&none)["response"]["peak_stability"].is_null());
}

/// Between the resonance and twice the resonance the multipliers leave the unit circle at -1.
#[test]
fn a_period_doubling_is_located_along_a_curve() {
    let folder = Folder::new("period-doubling");
    let scene = touching(&folder);
    let out = folder.join("out");
    let set = ["response.frequency_hz=[0.3, 0.5]"];
    let stderr = told(scene_command("run", &scene, &out, &set), 0);
    has(&stderr, "are unstable, between");
    let found = summary(&out);
    let [change] = &found["response"]["bifurcations"].as_array().unwrap()[..] else {
        panic!("{found}");
    };
    assert_eq!(change["kind"], "period_doubling");
    let hz = change["frequency_hz"].as_f64().unwrap();
    // By leapfrog integration over 6000 periods from rest, the motion doubles its period from 0.37529 Hz
    // on.
    println!("period doubling at {hz:.5} Hz");
    assert!((hz - 0.37529).abs() < 4e-4, "{change}");
    let table = rows(&out.join("response.csv"));
    let after = change["after_row"].as_u64().unwrap() as usize;
    let [before_hz, behind_hz] = [0, 1].map(|i| number(&table[after + i], "frequency_hz"));
    assert!(before_hz < hz && hz < behind_hz, "{change}");
    let is_one_period = |row: &&Row| row["periods"] == "1";
    for (at, row) in table.iter().filter(is_one_period).enumerate() {
        assert_eq!(
            row["stable"],
            if at <= after { "yes" } else { "no" },
            "row {at}"
        );
    }
    // The branch of twice the period begins there with two periods that are almost the same.
    let doubled: Vec<&Row> = table.iter().filter(|row| row["periods"] == "2").collect();
    let from_hz = number(doubled[0], "frequency_hz");
    assert!((from_hz / hz - 1.0).abs() < 1e-3, "{from_hz} {hz}");
    let halves = |row: &Row| {
        ["first", "second"].map(|word| number(row, &format!("tip_{word}_period_amplitude_m")))
    };
    let [first, second] = halves(doubled[0]);
    assert!((first / second - 1.0).abs() < 0.2, "{first} {second}");
    let [_, largest] = doubled
        .iter()
        .map(|row| halves(row))
        .fold(
            [0.0; 2],
            |most, own| {
                if own[1] > most[1] { own } else { most }
            },
        );
    assert!(largest > 1.2, "{largest}");
    // A motion on either side of the change has the verdict of its side, close to it.
    for (by, code, stable) in [(0.999, 0, "yes"), (1.001, 3, "no")] {
        let at = folder.join(format!("at-{by}"));
        let set = [format!("response.frequency_hz=[{0:?}, {0:?}]", by * hz)];
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        ended(scene_command("run", &scene, &at, &set), code);
        assert_eq!(rows(&at.join("response.csv"))[0]["stable"], stable, "{by}");
    }
    let picture = std::fs::read_to_string(out.join("plots/response_tip.svg")).unwrap();
    has(&picture, "unstable");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    has(&report, "period doubling");
}
