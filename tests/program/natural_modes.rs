//! Natural frequencies of scenes: bodies that are equal, bodies that soft springs hold, and bodies of
//! which too few modes are kept.

use std::fmt::Write as _;
use std::path::Path;

use crate::shared_decks::{column, steel};
use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, said_in_one_line, scene_command};
use crate::shared_runs::{number, rows, summary};

/// Bars that nothing joins, of which the first is excited.
fn bars(folder: &Folder, count: usize) -> String {
    folder.write("bar.inp", column("BAR", 0.0, 10, 0) + &steel(&["BAR"]));
    let mut scene = r#"
        name = "bars"
        damping = { ratio = 0.001 }
        excitation = [{ on = "b0.BAR_TIP", direction = [0.3, 1, 0], force_n = 1 }]
        observe = [{ name = "tip", points = "b0.BAR_TIP", direction = [0, 1, 0] }]
        response = { frequency_hz = [8000, 9000], points = 3, harmonics = 1 }
        [[body]]
        name = "b0"
        mesh_file = "bar.inp"
        units = "mm-t-s"
        volume = "BAR"
        fixed = ["BAR_FOOT"]
        "#
    .to_owned();
    for bar in 1..count {
        let y = 0.003 * bar as f64;
        writeln!(
            scene,
            "[[body]]\nname = \"b{bar}\"\ncopy_of = \"b0\"\ntranslation_m = [0, {y}, 0]"
        )
        .unwrap();
    }
    scene
}

/// Frequencies of the stuck modes, Hz.
fn stuck_hz(folder: &Path) -> Vec<f64> {
    let rows = rows(&folder.join("modes.csv"));
    let stuck = rows.iter().filter(|row| row["kind"] == "stuck");
    stuck.map(|row| number(row, "frequency_hz")).collect()
}

/// The bar is 1 mm x 1 mm x 10 mm.
#[test]
fn a_body_of_a_mass_has_the_frequencies_of_its_density() {
    let folder = Folder::new("natural-modes-mass");
    let material = "young_pa = 210e9\npoisson = 0.3\ndensity_kg_m3 = 7800\nfixed =";
    let scene = bars(&folder, 1).replace("fixed =", material);
    let of_mass = scene.replace("density_kg_m3 = 7800", "mass_kg = 7.8e-5");
    let found = [("density", scene), ("mass", of_mass.clone())].map(|(name, text)| {
        let file = folder.write(&format!("{name}.toml"), text);
        let out = folder.join(name);
        ended(scene_command("modes", &file, &out, &[]), 0);
        stuck_hz(&out)
    });
    assert!(found[0].len() > 5);
    assert_eq!(found[0].len(), found[1].len());
    for (by_density, by_mass) in found[0].iter().zip(&found[1]) {
        let off = (by_mass / by_density - 1.0).abs();
        assert!(off < 1e-12, "{by_mass} {by_density}");
    }
    let file = folder.join("mass.toml");
    for (set, words) in [
        (
            "body.b0.density_kg_m3=7800",
            "`body.b0.mass_kg` and `body.b0.density_kg_m3` exclude",
        ),
        ("body.b0.material=S", "`body.b0.material` and"),
        ("body.b0.mass_kg=0", "`body.b0.mass_kg` & greater than 0"),
    ] {
        let run = scene_command("modes", &file, &folder.join("refused"), &[set]);
        has(&said_in_one_line(&ended(run, 2)), words);
    }
    let run = scene_command(
        "modes",
        &file,
        &folder.join("heavy"),
        &["body.b0.mass_kg=0.078"],
    );
    has(
        &said_in_one_line(&ended(run, 0)),
        "density is mass_kg = 0.078 over the volume",
    );
}

#[test]
fn equal_bars_have_each_mode_as_often_as_there_are_bars_and_answer_as_one_does() {
    let mut peaks = Vec::new();
    for count in [1, 12, 24] {
        let folder = Folder::new(&format!("natural-modes-bars-{count}"));
        let scene = folder.write("scene.toml", bars(&folder, count));
        ended(scene_command("modes", &scene, &folder, &[]), 0);
        let found = stuck_hz(&folder);
        let first = found[0];
        // The two bending modes of the first kind.
        let (equal, others) = found.split_at(2 * count);
        assert!(
            equal.iter().all(|hz| (hz / first - 1.0).abs() < 1e-9),
            "{equal:?}"
        );
        assert!(others[0] > 5.0 * first, "{others:?}");
        ended(scene_command("run", &scene, &folder, &[]), 0);
        peaks.push(
            summary(&folder)["response"]["peak_amplitude_m"]
                .as_f64()
                .unwrap(),
        );
    }
    for peak in &peaks {
        assert!((peak / peaks[0] - 1.0).abs() < 1e-7, "{peaks:?}");
    }
}

/// The squared frequencies of the rigid motions are in proportion to the springs, and the other modes do
/// not depend on them.
#[test]
fn a_body_on_soft_springs_has_its_rigid_motions_and_its_elastic_modes() {
    let of = |stiffness_n_m: f64| {
        let folder = Folder::new(&format!("natural-modes-soft-{stiffness_n_m}"));
        folder.write("bar.inp", column("BAR", 0.0, 10, 0) + &steel(&["BAR"]));
        let scene = format!(
            r#"
            name = "soft"
            mesh = {{ file = "bar.inp", units = "mm-t-s" }}
            body = [{{ name = "bar", volume = "BAR" }}]
            spring = [
              {{ name = "foot", first = "BAR_BOTTOM", stiffness_n_m = {stiffness_n_m} }},
              {{ name = "head", first = "BAR_TOP", stiffness_n_m = {stiffness_n_m} }},
            ]
            damping = {{ ratio = 0.001, linear_mode = 7 }}
            excitation = [{{ on = "BAR_TIP", direction = [1, 0, 0], force_n = 1 }}]
            observe = [{{ name = "tip", points = "BAR_TIP", direction = [1, 0, 0] }}]
            response = {{ frequency_hz = [40000, 60000], points = 2, harmonics = 1 }}
            "#
        );
        let scene = folder.write("scene.toml", scene);
        ended(scene_command("modes", &scene, &folder, &[]), 0);
        stuck_hz(&folder)
    };
    let (stiff, soft) = (of(1e1), of(1e-3));
    let squared_ratio = (soft[0] / soft[6]).powi(2);
    println!(
        "{:.4?} and {:.4?}, {squared_ratio:e}",
        &stiff[..8],
        &soft[..8]
    );
    assert!(squared_ratio < 1e-9);
    for mode in 0..6 {
        let error = 1e4_f64.sqrt() * soft[mode] / stiff[mode] - 1.0;
        assert!(error.abs() < 1e-3, "{mode}: {error:e}");
    }
    for mode in 6..8 {
        let error = soft[mode] / stiff[mode] - 1.0;
        assert!(error.abs() < 1e-4, "{mode}: {error:e}");
    }
}

#[test]
fn too_few_modes_of_a_body_and_of_the_assembly_are_a_warning() {
    let folder = Folder::new("natural-modes-few");
    let deck = column("BASE", 0.0, 1, 0) + &column("COLUMN", 1.0, 10, 100);
    folder.write("column.inp", deck + &steel(&["BASE", "COLUMN"]));
    let scene = r#"
        name = "column"
        mesh = { file = "column.inp", units = "mm-t-s" }
        body = [
          { name = "base", volume = "BASE", fixed = ["BASE_FOOT"] },
          { name = "column", volume = "COLUMN", fixed_interface_modes = 1 },
        ]
        contact = [{ name = "foot", first = "COLUMN_BOTTOM", second = "BASE_TOP", friction = 0.5 }]
        load = [{ on = "COLUMN_TOP", pressure_pa = 1e6 }]
        damping = { stiffness_s = 1e-9 }
        excitation = [{ on = "COLUMN_TIP", direction = [0, 1, 0], force_n = 1e-4 }]
        observe = [{ name = "tip", points = "COLUMN_TIP", direction = [0, 1, 0] }]
        response = { frequency_hz = [40000, 50000], points = 3, harmonics = 1 }
        "#;
    let scene = folder.write("scene.toml", scene);
    let of_bodies = "fixed_interface_modes kept of the bodies raise";
    let of_assembly = "stuck modes kept do not reach";
    let said_with = |set: &[&str]| {
        let output = ended(scene_command("run", &scene, &folder, set), 0);
        said_in_one_line(&output)
    };
    let few = said_with(&[]);
    has(&few, &format!("warning: & {of_bodies} & keep more of them"));
    assert!(!few.contains(of_assembly), "{few}");
    let warnings = summary(&folder)["warnings"].to_string();
    has(&warnings, of_bodies);
    let errors = &summary(&folder)["truncation"]["frequencies"];
    let mut errors = errors.as_array().unwrap().iter();
    assert!(errors.any(|error| error.as_f64().unwrap() > 0.5));
    let many = said_with(&["body.1.fixed_interface_modes=40"]);
    assert!(!many.contains(of_bodies), "{many}");
    let stuck = said_with(&["body.1.fixed_interface_modes=40", "response.stuck_modes=2"]);
    has(
        &stuck,
        &format!("warning: & {of_assembly} & take more response.stuck_modes"),
    );
}
