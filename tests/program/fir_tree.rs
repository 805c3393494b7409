//! Fir-tree root whose disc has free sides: half of its pairs are open at rest, all others slip at
//! the resonance, and the curve goes far from its linear one.

use crate::shared_folder::Folder;
use crate::shared_program::{needs_gmsh, said, scene_command};
use crate::shared_runs::{Row, Run, number, rows};
use std::fs;

fn scene() -> String {
    let geometry = concat!(env!("CARGO_MANIFEST_DIR"), "/geometry/fir_tree.geo");
    let body = |name: &str, more: &str| {
        format!(
            "{{ name = \"{name}\", volume = \"{name}\", young_pa = 210e9, poisson = 0.3, \
             density_kg_m3 = 7850{more} }}"
        )
    };
    let flanks = ["lower_right", "upper_right", "lower_left", "upper_left"];
    let contact = |at: &str| {
        format!(
            "{{ name = \"{at}\", first = \"blade_{at}\", second = \"disc_{at}\", friction = 0.2 }}"
        )
    };
    format!(
        "name = \"fir_tree\"\n\
         mesh = {{ geometry = \"{geometry}\", metres_per_unit = 1e-3 }}\n\
         body = [{}, {}]\n\
         contact = [{}]\n\
         rotation = {{ axis = [1, 0, 0], point_m = [0, 0, -0.3], speed_rpm = 8000 }}\n\
         damping = {{ ratio = 0.001 }}\n\
         excitation = [{{ on = \"tip_front\", direction = [0, 1, 0], force_n = 5 }}]\n\
         observe = [{{ name = \"tip\", points = \"tip_rear\", direction = [0, 1, 0] }}]\n\
         response = {{ times_first_linear_mode = [0.95, 1.03] }}\n",
        body("blade", ""),
        body("disc", ", fixed = [\"disc_base\"]"),
        flanks.map(contact).join(", "),
    )
}

/// The run ends, its share of the work is not far ahead of it, and each point is the motion that 21
/// harmonics have at its frequency, within its estimated error.
#[test]
#[ignore = "slow: make verify"]
fn the_curve_of_a_root_with_free_sides_ends_and_is_right() {
    needs_gmsh();
    let folder = Folder::new("fir_tree");
    let file = folder.join("fir_tree.toml");
    fs::write(&file, scene()).unwrap();
    let out = folder.join("out");
    let mut program = scene_command("run", &file, &out, &[]);
    let output = program.arg("--no-fields").output().unwrap();
    let told = said(&output);
    assert_eq!(output.status.code(), Some(0), "{told}");
    assert!(
        !told.contains("given up") && !told.contains("gap,"),
        "{told}"
    );
    let progress = told
        .lines()
        .filter(|line| line.contains("points of the curve"));
    let percent = |line: &str| {
        line.split(['(', '%'])
            .nth(1)
            .unwrap()
            .trim()
            .parse()
            .unwrap()
    };
    let shares: Vec<u32> = progress.map(percent).collect();
    let nearly = shares.iter().filter(|percent| **percent > 95).count();
    assert!(nearly <= 1 + shares.len() / 10, "{shares:?}");
    let points = rows(&out.join("response.csv"));
    assert!(points.len() < 150, "{}", points.len());
    let amplitude = |row: &Row| number(row, "tip_amplitude_m");
    for point in points.iter().step_by(8) {
        let hz = number(point, "frequency_hz");
        let range = format!("response.frequency_hz=[{hz}, {hz}]");
        let set = [
            "response.times_first_linear_mode=",
            &range,
            "response.harmonics=21",
        ];
        let alone = Run::run_file("run", &file, "fir_tree_alone", &set);
        let [fine] = &alone.table("response.csv")[..] else {
            panic!("{hz} Hz");
        };
        let off = (amplitude(point) / amplitude(fine) - 1.0).abs();
        let estimated = number(point, "estimated_error") + number(fine, "estimated_error");
        println!("{hz:.3} Hz: off by {off:.1e}, estimated {estimated:.1e}");
        assert!(off < estimated, "{hz} Hz: {off:e}, {estimated:e}");
    }
}
