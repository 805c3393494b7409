//! `dovetail wear`: its files, a mission of the scene, and what it refuses.

use std::path::Path;
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::{READY_PATCH, SMALL, ended, has, printed, scene_command, told};
use crate::shared_runs::{number, numbers, rows, sum, summary};
use dovetail_testkit::folder::root;

/// Command about the paper's scene on its smallest mesh, whose contacts wear.
fn dovetail(out: &Path, rest: &[&str]) -> Command {
    let set = [
        SMALL,
        "response.compare_harmonics=",
        "response.harmonics=1",
        "contact.*.wear_m2_n=1e-14",
    ];
    let mut command = scene_command("wear", "scenes/paper.toml", out, &set);
    command.args(rest);
    command
}

#[test]
fn the_worn_volume_is_that_of_the_pairs_and_the_flanks_go_on_carrying_the_load() {
    let out = Folder::new("wear");
    let asked = ["--cycles", "1e5,1e6"];
    let printed = printed(&ended(dovetail(&out, &asked), 0));
    has(&printed, "wear, amplitude of tip & largest depth");
    let column = |heading: &str| numbers(&out.join("wear.csv"), heading);
    let (cycles, volumes) = (column("cycles"), column("volume_m3"));
    assert_eq!(cycles[0], 0.0);
    assert!(cycles.contains(&1e5) && cycles.is_sorted());
    assert_eq!(cycles.last(), Some(&1e6));
    assert!(volumes[0] == 0.0 && volumes.is_sorted());
    let pairs = rows(&out.join("wear_pairs.csv"));
    let volume_m3 = sum(&pairs, |pair| {
        number(pair, "area_m2") * number(pair, "worn_depth_m")
    });
    let last = volumes.last().unwrap();
    assert!((volume_m3 / last - 1.0).abs() < 1e-9);
    assert!(*last > 0.0);
    // The volume of a cycle is k_w times the energy of friction over its coefficient.
    let (powers, hz) = (column("friction_power_w"), column("frequency_hz"));
    for (i, rate) in column("volume_per_cycle_m3").iter().enumerate() {
        let expected = 1e-14 * powers[i] / hz[i] / 0.3;
        assert!((rate / expected - 1.0).abs() < 0.01, "{rate} {expected}");
    }
    // What some pairs lose others gain.
    let carried = column("compression_n");
    assert!(carried.iter().all(|n| (n / carried[0] - 1.0).abs() < 0.02));
    assert!(column("block_error").iter().all(|e| *e <= 0.05));
    let whole = summary(&out);
    assert_eq!(whole["wear"]["blocks"], cycles.len() - 1);
    assert_eq!(whole["wear"]["volume_m3"], *last);
    let files = ["wear.pvd", "wear/wear_0000.vtu", "plots/wear_map.svg"];
    let plots = ["amplitude", "frequency", "depth"].map(|p| format!("plots/wear_{p}.svg"));
    for file in files.map(str::to_owned).into_iter().chain(plots) {
        assert!(out.join(&file).exists(), "{file}");
    }
    let pvd = out.text("wear.pvd");
    assert!(pvd.matches("<DataSet").count() == cycles.len());
    assert!(
        pvd.contains("timestep=\"1000000\"") || pvd.contains("timestep=\"1e6\""),
        "{pvd}"
    );
    let vtu = String::from_utf8_lossy(&std::fs::read(out.join("wear/wear_0001.vtu")).unwrap())
        .into_owned();
    assert!(vtu.contains("worn_depth_m") && vtu.contains("static_pressure_pa"));
}

#[test]
fn the_parts_of_a_mission_have_columns_of_their_own() {
    let out = Folder::new("wear_mission");
    let scene = std::fs::read_to_string(root().join("scenes/paper.toml")).unwrap();
    let mission = "\n[[mission]]\nshare = 9\nfrequency_hz = 446.0\n\
                   [[mission]]\nforce_scale = 0.5\n";
    let file = out.join("mission.toml");
    std::fs::write(&file, scene + mission).unwrap();
    let mesh = root().join("meshes/dovetail_small.msh");
    let mesh = format!("mesh.file={}", mesh.display());
    let set = [
        &mesh[..],
        "response.compare_harmonics=",
        "response.harmonics=1",
        "contact.left.wear_m2_n=1e-14",
    ];
    let command = |rest: &[&str]| {
        let mut command = scene_command("wear", &file, &out, &set);
        command.args(["--cycles", "1e5"]).args(rest);
        command
    };
    has(&printed(&ended(command(&[]), 0)), "446.0");
    let column = |heading: &str| numbers(&out.join("wear.csv"), heading);
    assert!(column("part1_frequency_hz").iter().all(|hz| *hz == 446.0));
    let [amplitudes, frequencies] =
        ["amplitude_m", "frequency_hz"].map(|name| column(&format!("part2_{name}")));
    assert!(amplitudes.iter().all(|m| *m > 1e-4) && frequencies[0] > 446.0);
    let (seconds, cycles) = (column("seconds"), column("cycles"));
    let expected = cycles.last().unwrap() * (0.9 / 446.0 + 0.1 / frequencies[0]);
    assert!((seconds.last().unwrap() / expected - 1.0).abs() < 1e-3);
    // Only one of the contacts wears.
    let pairs = rows(&out.join("wear_pairs.csv"));
    let of = |name: &str| {
        let own = pairs.iter().filter(|pair| pair["contact"] == name);
        own.map(|pair| number(pair, "worn_depth_m"))
            .fold(0.0, f64::max)
    };
    assert!(of("left") > 0.0 && of("right") == 0.0);
    // A frequency of the command line takes the place of the mission.
    ended(command(&["--at-frequency", "447"]), 0);
    assert!(column("frequency_hz").iter().all(|hz| *hz == 447.0));
}

#[test]
fn what_cannot_wear_is_refused_with_a_remedy() {
    let out = Folder::new("wear_refused");
    for (rest, says) in [
        ("", "--cycles"),
        ("--cycles 0", "a number above 0"),
        ("--cycles 1e6,1e5", "the cycles must ascend"),
        ("--cycles 1e6 --tolerance 2", "from 0.0001 to 0.5"),
        ("--cycles 1e6 --at-frequency=-1", "at-frequency"),
        ("--cycles 1e6 --observe hub", "hub"),
        ("--cycles 1e6 --set contact.*.wear_m2_n=0", "wear_m2_n"),
        ("--cycles 1e6 --set contact.*.wear_m2_n=-1", "wear_m2_n"),
        ("--cycles 1e6 --set contact.*.law=bonded", "bonded"),
        (
            "--cycles 1e6 --set response.frequency_hz=[440,460] --set response.along_engine_order=4",
            "engine order",
        ),
    ] {
        let rest: Vec<&str> = rest.split_whitespace().collect();
        has(&told(dovetail(&out, &rest), 2), says);
    }
    let set = [READY_PATCH, "mission.0.share=0"];
    let patch = "scenes/verification/patch.toml";
    let mut command = scene_command("wear", patch, &out, &set);
    command.args(["--cycles", "1"]);
    has(&told(command, 2), "mission");
}
