//! Scenes whose bodies have matrices of another program, and what the program says about them.

use std::fmt::Write;
use std::path::Path;

use dovetail::mesh_files;
use dovetail_matrices::write_matrix_market;
use dovetail_mesh::units::Units;
use dovetail_numerics::eigen::dense::modes;
use dovetail_numerics::sparse::dense;
use dovetail_solver::fem::{assemble_body, statics};
use dovetail_solver::model::{Assembly, Body, BodySpec, MaterialSpec, MatrixSource, bind};
use dovetail_testkit::folder::root;
use faer::Mat;
use faer::linalg::solvers::Solve;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::shared_decks::{column, steel};
use crate::shared_folder::Folder;
use crate::shared_program::{cases, has, said_in_one_line, scene_command, told};
use crate::shared_runs::{Row, number, rows, summary};

/// The joint of two decks at rest: a force pulls the blade outwards.
fn resting_scene(sources: [&str; 2]) -> String {
    let text = std::fs::read_to_string(root().join("scenes/decks/two_decks.toml")).unwrap();
    let begin = text.find("[rotation]").unwrap();
    let end = text.find("[[contact]]").unwrap();
    let load = "[[load]]\non = \"Tip\"\ndirection = [0, 0, 1]\nforce_n = 500\n\n";
    let text = format!("{}{load}{}", &text[..begin], &text[end..]);
    let decks = root().join("meshes/decks");
    let text = text.replace("../../meshes/decks", decks.to_str().unwrap());
    let text = text.replace(
        "volume = \"Blade-1\"",
        &format!("volume = \"Blade-1\"\n{}", sources[0]),
    );
    text.replace(
        "volume = \"Sector\"",
        &format!("volume = \"Sector\"\n{}", sources[1]),
    )
}

/// Body of a deck as its elements make it, with its stiffness and mass in SI units.
fn deck_body(
    deck: &str,
    volume: &str,
    fixed: &[&str],
    units: Units,
) -> (Body, [CscMatrix<f64>; 2]) {
    let mesh = mesh_files::read(&root().join("meshes/decks").join(deck), units).unwrap();
    let assembly = Assembly {
        bodies: vec![BodySpec {
            volume: volume.into(),
            fixed: fixed.iter().map(|s| (*s).to_owned()).collect(),
            ..BodySpec::new("body", MatrixSource::Elements(MaterialSpec::OfMesh(None)))
        }],
        ..Assembly::default()
    };
    let mut model = bind(&assembly, &mesh, None).unwrap();
    let body = model.bodies.remove(0);
    let matrices = assemble_body(&body, None, &statics::solve_by_cholesky).unwrap();
    (body, [matrices.stiffness, matrices.mass])
}

/// Deck of the surfaces of a deck alone, in the same units, with its sets of nodes.
fn surfaces_of(deck: &str, units: Units) -> String {
    let mesh = mesh_files::read(&root().join("meshes/decks").join(deck), units).unwrap();
    let metres = units.metres();
    let mut named: Vec<&u32> = Vec::new();
    let mut rest = String::new();
    for (name, group) in &mesh.groups {
        if group.dimension == 2 {
            writeln!(rest, "*ELEMENT, TYPE=SFM3D8, ELSET={name}").unwrap();
            for &f in &group.elements {
                let nodes = mesh.facets.element_nodes(f as usize);
                let tags = nodes
                    .iter()
                    .map(|&n| mesh.node_tags[n as usize].to_string());
                let tags: Vec<String> = tags.collect();
                writeln!(rest, "{},{}", f + 1, tags.join(",")).unwrap();
                named.extend(nodes);
            }
        } else if group.dimension == 0 && group.nodes.len() < 30 {
            writeln!(rest, "*NSET, NSET={name}").unwrap();
            for n in &group.nodes {
                writeln!(rest, "{}", mesh.node_tags[*n as usize]).unwrap();
            }
            named.extend(&group.nodes);
        }
    }
    named.sort_unstable();
    named.dedup();
    let mut text = "*NODE\n".to_owned();
    for &&n in &named {
        let [x, y, z] = mesh.nodes_m[n as usize].map(|x| x / metres);
        writeln!(
            text,
            "{},{x:.15e},{y:.15e},{z:.15e}",
            mesh.node_tags[n as usize]
        )
        .unwrap();
    }
    text + &rest
}

/// Matrices as CalculiX writes them: the upper triangle, counted from 1, and `node.direction`.
fn write_calculix(folder: &Path, body: &Body, matrices: &[CscMatrix<f64>; 2]) {
    for (matrix, file) in matrices.iter().zip(["jaw.sti", "jaw.mas"]) {
        let mut text = String::new();
        for (i, j, v) in matrix.triplet_iter().filter(|(i, j, _)| i <= j) {
            writeln!(text, "{} {} {v:.16e}", i + 1, j + 1).unwrap();
        }
        std::fs::write(folder.join(file), text).unwrap();
    }
    let mut text = String::new();
    for node in body.free_node_tags() {
        for direction in 1..=3 {
            writeln!(text, "{node}.{direction}").unwrap();
        }
    }
    std::fs::write(folder.join("jaw.dof"), text).unwrap();
}

const JAW: &str = "stiffness_file = \"jaw.sti\"\nmass_file = \"jaw.mas\"\nrows_file = \"jaw.dof\"";
const BLADE: &str =
    "stiffness_file = \"blade_k.mtx\"\nmass_file = \"blade_m.mtx\"\nrows_file = \"rows.csv\"";

/// Folder with the files of the matrices of both decks: those of the blade in millimetres and
/// tonnes with a table of its rows, those of the jaw without the rows of its support.
fn matrices_folder() -> Folder {
    let folder = Folder::new("given_matrices");
    let (body, mut matrices) = deck_body("blade.inp", "Blade-1", &[], Units::MillimetreTonneSecond);
    for (matrix, file) in matrices.iter_mut().zip(["blade_k.mtx", "blade_m.mtx"]) {
        matrix.values_mut().iter_mut().for_each(|v| *v /= 1e3);
        folder.write(file, write_matrix_market(matrix));
    }
    let mut table = "node,direction\n".to_owned();
    for node in body.free_node_tags() {
        for direction in ["x", "y", "z"] {
            writeln!(table, "{node},{direction}").unwrap();
        }
    }
    folder.write("rows.csv", table);
    let (body, matrices) = deck_body("disc.inp", "Sector", &["Base"], Units::MetreKilogramSecond);
    write_calculix(&folder, &body, &matrices);
    let matrices = resting_scene([BLADE, JAW]).replace("fixed = [\"Base\"]\n", "");
    folder.write("matrices.toml", matrices);
    let two = "%%MatrixMarket matrix array real general\n2 1\n1.0\n2.0\n";
    folder.write("load.mtx", two);
    folder.write("elements.toml", resting_scene(["", ""]));
    folder.write("mixed.toml", resting_scene([BLADE, ""]));
    let mut surfaces = std::fs::read_to_string(folder.join("matrices.toml")).unwrap();
    let both = [
        ("blade.inp", "Blade-1", Units::MillimetreTonneSecond),
        ("disc.inp", "Sector", Units::MetreKilogramSecond),
    ];
    for (deck, volume, units) in both {
        folder.write(deck, surfaces_of(deck, units));
        let path = root().join("meshes/decks").join(deck);
        surfaces = surfaces.replace(path.to_str().unwrap(), deck);
        surfaces = surfaces.replace(&format!("volume = \"{volume}\""), "volume = \"all\"");
    }
    folder.write("surfaces.toml", surfaces);
    folder
}

/// The jaw is turned by its scene, and a middle node of the flank follows its corners.
#[test]
fn a_scene_with_matrices_has_the_answers_of_its_elements() {
    let folder = matrices_folder();
    let run = |scene: &str| {
        let out = folder.join(scene);
        let file = folder.join(format!("{scene}.toml"));
        let said = told(scene_command("static", &file, &out, &[]), 0);
        told(scene_command("modes", &file, &out, &[]), 0);
        (
            said,
            ["static.csv", "modes.csv"].map(|file| rows(&out.join(file))),
        )
    };
    let (_, expected) = run("elements");
    for scene in ["matrices", "mixed", "surfaces"] {
        let (said, found) = run(scene);
        let words = match scene {
            "matrices" => "blade: matrices & 6 rigid motions are free & no rigid motion is free",
            "mixed" => "336 quadratic hexahedra & blade: matrices & 6 rigid motions are free",
            _ => {
                "blade.inp: There are no solid elements & `all` & 48 facets without elements & \
                 blade: matrices & 3 translations are free, rotations not checked & \
                 no translation is free"
            }
        };
        has(&said, words);
        assert_eq!(said.contains("jaw: matrices"), scene != "mixed");
        let [statics, modes] = &expected;
        let compared = |found: &[Row], expected: &[Row], column: &str| {
            assert_eq!(found.len(), expected.len());
            let largest = expected
                .iter()
                .map(|row| number(row, column).abs())
                .fold(0.0, f64::max);
            for (found, expected) in found.iter().zip(expected) {
                let off = number(found, column) - number(expected, column);
                assert!(
                    off.abs() < 1e-6 * largest,
                    "{scene}, {column}: {off:e} of {largest:e}"
                );
            }
        };
        for column in ["normal_force_n", "slip_t1_m"] {
            compared(&found[0], statics, column);
        }
        compared(&found[1], modes, "frequency_hz");
    }
}

/// Base and column with a contact between them. The column has these keys.
fn base_and_column(of_column: &str) -> String {
    format!(
        r#"
        name = "column"
        [[body]]
        name = "base"
        mesh_file = "base.inp"
        units = "mm-t-s"
        volume = "BASE"
        fixed = ["BASE_FOOT"]
        [[body]]
        name = "column"
        mesh_file = "column.inp"
        units = "mm-t-s"
        volume = "COLUMN"
        {of_column}
        [[contact]]
        name = "foot"
        first = "COLUMN_BOTTOM"
        second = "BASE_TOP"
        friction = 0.5
        [[load]]
        on = "COLUMN_TIP"
        direction = [0, 0, -1]
        force_n = 1
        [damping]
        stiffness_s = 1e-9
        [[excitation]]
        on = "COLUMN_TIP"
        direction = [0, 1, 0]
        force_n = 1e-4
        [[observe]]
        name = "tip"
        points = "COLUMN_TIP"
        direction = [0, 1, 0]
        [response]
        frequency_hz = [4000, 12000]
        points = 9
        harmonics = 1
        "#
    )
}

/// Craig-Bampton matrices of the column on its flank and its tip, with all its modes, in millimetres and
/// tonnes: the stiffness is diagonal on the modes, and the mass couples them with the nodes.
fn write_superelement(folder: &Folder, deck: &str) {
    let mesh = mesh_files::read(&folder.join(deck), Units::MillimetreTonneSecond).unwrap();
    let spec = BodySpec {
        volume: "COLUMN".into(),
        fixed: Vec::new(),
        ..BodySpec::new("column", MatrixSource::Elements(MaterialSpec::OfMesh(None)))
    };
    let alone = Assembly {
        bodies: vec![spec],
        ..Assembly::default()
    };
    let body = bind(&alone, &mesh, None).unwrap().bodies.remove(0);
    let matrices = assemble_body(&body, None, &statics::solve_by_cholesky).unwrap();
    let kept = |node: u64| {
        let groups = ["COLUMN_FOOT", "COLUMN_TIP"].map(|name| &mesh.groups[name].nodes);
        let mut nodes = groups.into_iter().flatten();
        nodes.any(|n| mesh.node_tags[*n as usize] == node)
    };
    let tags = body.free_node_tags();
    let (outer, inner): (Vec<usize>, Vec<usize>) =
        (0..3 * tags.len()).partition(|dof| kept(tags[dof / 3]));
    let order = [&inner[..], &outer].concat();
    let [k, m] = [&matrices.stiffness, &matrices.mass].map(|a| {
        let a = dense(a);
        Mat::from_fn(order.len(), order.len(), |i, j| {
            1e-3 * a[(order[i], order[j])]
        })
    });
    let split = inner.len();
    let k_ii = k.get(..split, ..split);
    let own = modes(k_ii, m.get(..split, ..split)).unwrap();
    let psi = k_ii.partial_piv_lu().solve(k.get(..split, split..));
    let t = Mat::from_fn(order.len(), order.len(), |i, j| {
        match (i < split, j < split) {
            (true, true) => own.vectors[(i, j)],
            (true, false) => -psi[(i, j - split)],
            (false, _) => f64::from(u8::from(i == j)),
        }
    });
    for (a, file) in [(k, "k.mtx"), (m, "m.mtx")] {
        let on_both = t.transpose() * (&a * &t);
        let mut coo = CooMatrix::new(order.len(), order.len());
        for (i, j) in (0..order.len()).flat_map(|i| (0..order.len()).map(move |j| (i, j))) {
            let among = i.min(j) >= split;
            let mixed = i.max(j) >= split && file == "m.mtx";
            if i == j || among || mixed {
                coo.push(i, j, 0.5 * (on_both[(i, j)] + on_both[(j, i)]));
            }
        }
        folder.write(file, write_matrix_market(&CscMatrix::from(&coo)));
    }
    let mut table = "node,direction\n".to_owned() + &"-,-\n".repeat(split);
    for dof in &outer {
        writeln!(table, "{},{}", tags[dof / 3], ["x", "y", "z"][dof % 3]).unwrap();
    }
    folder.write("rows.csv", table);
}

#[test]
fn a_superelement_with_modes_has_the_answers_of_fixed_interface_modes() {
    let folder = Folder::new("given_matrices-modes");
    folder.write("base.inp", column("BASE", 0.0, 1, 0) + &steel(&["BASE"]));
    folder.write(
        "column.inp",
        column("COLUMN", 1.0, 8, 0) + &steel(&["COLUMN"]),
    );
    write_superelement(&folder, "column.inp");
    let keys = "stiffness_file = \"k.mtx\"\nmass_file = \"m.mtx\"\nrows_file = \"rows.csv\"";
    let [expected, found] = [
        ("fixed", "fixed_interface_modes = 1000"),
        ("superelement", keys),
    ]
    .map(|(name, keys)| {
        let (scene, out) = (
            folder.write(&format!("{name}.toml"), base_and_column(keys)),
            folder.join(format!("out-{name}")),
        );
        told(scene_command("modes", &scene, &out, &[]), 0);
        let modes = rows(&out.join("modes.csv"));
        let stuck = modes.iter().filter(|row| row["kind"] == "stuck").take(10);
        let mut numbers: Vec<f64> = stuck.map(|row| number(row, "frequency_hz")).collect();
        assert_eq!(numbers.len(), 10);
        told(scene_command("run", &scene, &out, &[]), 0);
        let summary = summary(&out);
        for key in ["peak_amplitude_m", "linear_peak_amplitude_m"] {
            numbers.push(summary["response"][key].as_f64().unwrap());
        }
        numbers
    });
    for (found, expected) in found.iter().zip(&expected) {
        assert!(
            (found / expected - 1.0).abs() < 1e-8,
            "{found:e} {expected:e}"
        );
    }
}

#[test]
fn keys_of_matrices_that_do_not_fit_are_refused() {
    let folder = matrices_folder();
    let table = "
        body.blade.young_pa=1e11 => `body.blade.stiffness_file` and `body.blade.young_pa` exclude
        body.blade.material=Steel => `body.blade.stiffness_file` and `body.blade.material` exclude
        body.blade.mass_file= => `body.blade.mass_file` is missing
        body.blade.stiffness_file= => `body.blade.mass_file` is given without `body.blade.stiffness_file`
        body.blade.rows_file=no.csv => body `blade` & cannot read & no.csv
        body.blade.rows_file= => body `blade` & blade_k.mtx & node and direction & `rows_file`
        body.blade.rows_file=jaw.dof => body `blade` & rows & same degrees of freedom
        body.blade.mass_file=jaw.mas => body `blade` & blade_k.mtx and & jaw.mas & same degrees
        body.blade.stiffness_name=K => body `blade` & blade_k.mtx & `K`
        body.blade.load_name=PA => `body.blade.load_name` is given without `body.blade.load_file`
        body.blade.load_file=blade_k.mtx => body `blade` & blade_k.mtx & 0 matrices of one column & its name
        body.blade.load_file=load.mtx => body `blade` & load has 2 values & matrices have
        body.blade.mass_file=rows.csv => body `blade` & rows.csv: this is a table of rows
        ";
    for [set, words] in cases(table) {
        let file = folder.join("matrices.toml");
        let said = told(
            scene_command("mesh", &file, &folder.join("out"), &[&set]),
            2,
        );
        has(&said, &words);
    }
    let set = ["body.blade.units=", "body.blade.metres_per_unit=1e-3"];
    let file = folder.join("matrices.toml");
    let said = told(scene_command("mesh", file, &folder.join("out"), &set), 2);
    has(
        &said,
        "`body.blade.stiffness_file` is given without `body.blade.units` & m-kg-s",
    );
}

/// Nodes and directions of a chain of six nodes, of which each has a spring and a mass along three
/// axes to the next one; its rotations have rows without entries, as Nastran writes them for solids.
const ROWS: usize = 36;

/// Entries of the stiffness, N/mm, and of the mass, t.
fn chain() -> [Vec<(usize, usize, f64)>; 2] {
    let mut both = [Vec::new(), Vec::new()];
    for link in 0..5 {
        let along = link as f64;
        let stiffness = [
            1000.0 + 37.0 * along,
            310.5 + 11.0 * along,
            77.25 + 3.0 * along,
        ];
        let mass = 1e-3 * (1.0 + 0.13 * along) / 6.0;
        for (axis, k) in stiffness.into_iter().enumerate() {
            let ends = [6 * link + axis, 6 * link + 6 + axis];
            for (a, i) in ends.into_iter().enumerate() {
                for (b, j) in ends.into_iter().enumerate() {
                    both[0].push((i, j, if a == b { k } else { -k }));
                    both[1].push((i, j, if a == b { 2.0 * mass } else { mass }));
                }
            }
        }
    }
    both
}

/// Folder with a scene of the chain, whose entries `change` may change.
fn chain_folder(name: &str, change: impl Fn(&mut [Vec<(usize, usize, f64)>; 2])) -> Folder {
    let folder = Folder::new(name);
    let mut both = chain();
    change(&mut both);
    for (entries, file) in both.iter().zip(["k.mtx", "m.mtx"]) {
        let mut matrix = CooMatrix::new(ROWS, ROWS);
        entries.iter().for_each(|(i, j, v)| matrix.push(*i, *j, *v));
        folder.write(file, write_matrix_market(&CscMatrix::from(&matrix)));
    }
    let mut table = "node,direction\n".to_owned();
    let mut deck = "*NODE\n".to_owned();
    for node in 1..=6 {
        writeln!(deck, "{node},{}.,{}.,0.", 10 * node, node % 2).unwrap();
        for direction in 1..=6 {
            writeln!(table, "{node},{direction}").unwrap();
        }
    }
    deck +=
        "*NSET,NSET=ROOT\n1\n*NSET,NSET=FIFTH\n5\n*NSET,NSET=TIP\n6\n*ELEMENT,TYPE=S3,ELSET=SKIN\n";
    (1..5).for_each(|n| writeln!(deck, "{n},{n},{},{}", n + 1, n + 2).unwrap());
    folder.write("rows.csv", table);
    folder.write("chain.inp", deck);
    let scene = "
        name = \"chain\"
        [[body]]
        name = \"chain\"
        mesh_file = \"chain.inp\"
        units = \"mm-t-s\"
        volume = \"all\"
        stiffness_file = \"k.mtx\"
        mass_file = \"m.mtx\"
        rows_file = \"rows.csv\"
        fixed = [\"ROOT\"]
        [damping]
        ratio = 0.01
        [[excitation]]
        on = \"TIP\"
        direction = [1.0, 0.0, 0.0]
        force_n = 1.0
        [[observe]]
        name = \"tip\"
        points = \"TIP\"
        direction = [1.0, 0.0, 0.0]
        [response]
        frequency_hz = [10.0, 20.0]
        points = 2
        harmonics = 1
        ";
    folder.write("scene.toml", scene);
    folder
}

/// The frequencies come from `scipy.linalg.eigh` for the rows with entries, with node 1 held.
#[test]
fn rows_with_neither_stiffness_nor_mass_are_left_out() {
    let folder = chain_folder("given_matrices_empty_rows", |_| {});
    let scene = folder.join("scene.toml");
    let run = scene_command("modes", &scene, &folder.join("out"), &[]);
    let words = "18 displacements & 18 rows have neither stiffness nor mass and are left out";
    has(&told(run, 0), words);
    let modes = rows(&folder.join("out/modes.csv"));
    let found: Vec<f64> = modes
        .iter()
        .map(|row| number(row, "frequency_hz"))
        .collect();
    for (found, expected) in found.iter().zip([12.0754, 24.1699, 39.9214, 43.4081]) {
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    }
    let load = |row: usize| {
        let values = (0..ROWS).map(|i| if i == row { "1.0\n" } else { "0.0\n" });
        let head = format!("%%MatrixMarket matrix array real general\n{ROWS} 1\n");
        folder.write("load.mtx", head + &values.collect::<String>());
        scene_command(
            "static",
            &scene,
            &folder.join("out"),
            &["body.chain.load_file=load.mtx"],
        )
    };
    has(
        &told(load(33), 2),
        "value 34 of its steady load & neither stiffness nor mass",
    );
}

/// Node 6 has neither stiffness nor mass. With springs k1 to ground and k2 to node 5 it passes
/// k2 / (k1 + k2) of a force on to node 5, which has the spring k1 k2 / (k1 + k2) to ground.
#[test]
fn empty_rows_on_which_springs_act_are_kept() {
    let folder = chain_folder("given_matrices_sprung", |both| {
        // The entries of the last link.
        both.iter_mut().for_each(|all| all.truncate(all.len() - 12));
    });
    let [k1, k2] = [2e5, 3e5];
    let spring = |name: &str, first: &str, second: &str, k: f64| {
        format!(
            "[[spring]]\nname = \"{name}\"\nfirst = \"{first}\"\n{second}\
             direction = [1.0, 0.0, 0.0]\nstiffness_n_m = {k:e}\n"
        )
    };
    let base = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    let base = base.replace("points = \"TIP\"", "points = \"FIFTH\"");
    let inner = "second = \"FIFTH\"\n";
    let both = spring("outer", "TIP", "", k1) + &spring("inner", "TIP", inner, k2);
    let series = spring("series", "FIFTH", "", k1 * k2 / (k1 + k2));
    let passed = base.replace("on = \"TIP\"", "on = \"FIFTH\"");
    let passed = passed.replace("force_n = 1.0", &format!("force_n = {:e}", k2 / (k1 + k2)));
    let turned = (base.clone() + &both).replace("[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]");
    let turned = turned.replace(
        "fixed =",
        "rotation_deg = 90\nrotation_axis = [0, 0, 1]\nfixed =",
    );
    let answers = |name: &str, text: String, words: &str| {
        let scene = folder.write(&format!("{name}.toml"), text);
        let out = folder.join(name);
        has(&told(scene_command("modes", &scene, &out, &[]), 0), words);
        let modes = rows(&out.join("modes.csv"));
        let modes = modes.iter().map(|row| number(row, "frequency_hz"));
        let mut numbers: Vec<f64> = modes.collect();
        assert_eq!(numbers.len(), 18);
        told(scene_command("run", &scene, &out, &[]), 0);
        let peak = &summary(&out)["response"]["peak_amplitude_m"];
        numbers.push(peak.as_f64().unwrap());
        numbers
    };
    let expected = answers("series", passed + &series, "21 rows have neither");
    for (name, text, words) in [
        ("sprung", base.clone() + &both, "20 rows have neither"),
        ("turned", turned, "18 rows have neither"),
    ] {
        let found = answers(name, text, words);
        for (found, expected) in found.iter().zip(&expected) {
            let off = (found / expected - 1.0).abs();
            assert!(off < 1e-9, "{name}: {found:e} {expected:e}");
        }
    }
    let load = |row: usize| {
        let values = (0..ROWS).map(|i| if i == row { "1.0\n" } else { "0.0\n" });
        let head = format!("%%MatrixMarket matrix array real general\n{ROWS} 1\n");
        folder.write("load.mtx", head + &values.collect::<String>());
        let (scene, out) = (folder.join("sprung.toml"), folder.join("out"));
        scene_command("static", scene, &out, &["body.chain.load_file=load.mtx"])
    };
    told(load(30), 0);
    let words = "body `chain`: value 32 of its steady load & no spring of the scene acts on it";
    has(&told(load(31), 2), words);
}

#[test]
fn indefinite_matrices_are_named() {
    let add = |what: usize, entries: &'static [(usize, usize, f64)]| {
        move |both: &mut [Vec<(usize, usize, f64)>; 2]| both[what].extend(entries)
    };
    let three: &[_] = &[(6, 12, 5e-4), (12, 6, 5e-4), (12, 18, 5e-4), (18, 12, 5e-4)];
    let table = [
        (
            "pair",
            1,
            &[(8, 14, 1.0), (14, 8, 1.0)][..],
            "the mass matrix is indefinite: entry (15, 9)",
        ),
        (
            "three",
            1,
            three,
            "the mass matrix is indefinite & eigenvalues are negative",
        ),
        (
            "spring",
            0,
            &[(8, 14, -900.0), (14, 8, -900.0)],
            "the stiffness matrix is indefinite: entry",
        ),
    ];
    for (name, what, entries, words) in table {
        let folder = chain_folder(&format!("given_matrices_{name}"), add(what, entries));
        let run = scene_command("modes", folder.join("scene.toml"), &folder.join("out"), &[]);
        has(&told(run, 2), words);
    }
    // A spring of negative stiffness that two others hold: every pair of rows is possible.
    let by = 103.25;
    let softer = [(14, 14, -by), (14, 20, by), (20, 14, by), (20, 20, -by)];
    let folder = chain_folder("given_matrices_softer", |both| both[0].extend(softer));
    let run = scene_command("modes", folder.join("scene.toml"), &folder.join("out"), &[]);
    let said = run_to_its_end(run);
    has(
        &said,
        "body `chain`: its stiffness is indefinite, 1 eigenvalue is negative",
    );
}

/// Output to stderr, on one line, whatever the exit code.
fn run_to_its_end(mut run: std::process::Command) -> String {
    said_in_one_line(&run.output().unwrap())
}
