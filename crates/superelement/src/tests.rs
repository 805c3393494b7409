use super::*;
use crate::description::{DESCRIPTION, FORMAT};
use dovetail_dynamics::excitation::NamedExcitation;
use dovetail_dynamics::reduced::{Dashpots, Load, ObservedPoint, ReducedModel};
use dovetail_dynamics::superelement::{NamedContact, Superelement};
use dovetail_testkit::folder::Folder;
use faer::Mat;

fn small() -> Superelement {
    let value = |seed: usize| (seed as f64 * 0.7531).sin() * 10f64.powi((seed % 7) as i32 - 3);
    let vector = |k: usize, at: usize| (0..k).map(|i| value(i + at)).collect::<Vec<_>>();
    let (n, m) = (6, 4);
    // Off the diagonal at most 1000 in each entry, on it more than all of a row.
    let square = |at: usize| {
        Mat::from_fn(n, n, |i, j| {
            value(at + i * j + i + j) + if i == j { 1e4 } else { 0.0 }
        })
    };
    let coupling = Mat::from_fn(n, m, |i, j| 1e-2 * value(i + 11 * j));
    let omega2 = vec![1.0 / 3.0, 2.0, 2.0, 1e9];
    Superelement {
        model: ReducedModel {
            static_load: Load::new(vector(n, 3), vector(m, 9)),
            unit_loads: vec![
                Load::new(vector(n, 20), vector(m, 30)),
                Load::new(vector(n, 21), vector(m, 31)),
            ],
            observations: vec![
                ObservedPoint::new("tip", vector(n, 40), vector(m, 50)),
                ObservedPoint::new("root", vector(n, 41), vector(m, 51)),
            ],
            dashpots: Dashpots::new(
                n,
                m,
                &[(1.0 / 3.0, Load::new(vector(n, 60), vector(m, 70)))],
            ),
            ..ReducedModel::new(square(1), square(5), coupling, omega2)
        },
        excitations: vec![
            NamedExcitation::cosine("tip"),
            NamedExcitation {
                name: "base".to_owned(),
                harmonic: 3,
                amplitude: 1.0 / 3.0,
                phase_rad: -0.1,
                grows_with_squared_frequency: true,
            },
        ],
        contacts: vec![contact("left"), contact("right")],
        positions_m: vec![[0.1, 0.2, 0.3], [-1e-3, 1.0 / 3.0, 0.0]],
        areas_m2: Some(vec![1e-6, 2.5e-7]),
    }
}

/// Contact of one pair.
fn contact(name: &str) -> NamedContact {
    NamedContact {
        name: name.to_owned(),
        pairs: 1,
    }
}

/// Model with twice the stiffness.
fn stiffer() -> Superelement {
    let mut element = small();
    element.model.stiffness *= faer::Scale(2.0);
    element
}

/// Folder of a model.
fn written(element: &Superelement) -> Folder {
    let folder = Folder::new("superelement");
    write(&folder, element).unwrap();
    folder
}

/// Checks that a folder is not read, for a reason in these words.
#[track_caller]
fn assert_refused(folder: &Folder, words: &[&str]) {
    let message = read(folder).unwrap_err().to_string();
    for words in words {
        assert!(message.contains(words), "{words}: {message}");
    }
}

#[test]
fn what_is_written_reads_back_to_the_bit() {
    let element = small();
    let back = read(&written(&element)).unwrap();
    let (a, b) = (&element.model, &back.model);
    assert_eq!(a.stiffness, b.stiffness);
    assert_eq!(a.mass, b.mass);
    assert_eq!(a.coupling, b.coupling);
    assert_eq!(a.omega2, b.omega2);
    assert_eq!(a.dashpots, b.dashpots);
    assert_eq!(a.static_load, b.static_load);
    assert_eq!(a.unit_loads, b.unit_loads);
    assert_eq!(a.stuck_modes, b.stuck_modes);
    assert_eq!(a.observations, b.observations);
    assert_eq!(element.excitations, back.excitations);
    assert_eq!(element.contacts, back.contacts);
    assert_eq!(element.positions_m, back.positions_m);
    assert_eq!(element.areas_m2, back.areas_m2);
}

#[test]
fn a_model_without_modes_replaces_one_with_modes() {
    let mut element = small();
    let folder = written(&element);
    let model = &mut element.model;
    model.coupling = Mat::zeros(6, 0);
    model.omega2.clear();
    model.static_load.on_modes.clear();
    model.stuck_modes = 0;
    model
        .unit_loads
        .iter_mut()
        .for_each(|load| load.on_modes.clear());
    model
        .observations
        .iter_mut()
        .for_each(|point| point.on_modes.clear());
    element.areas_m2 = None;
    write(&folder, &element).unwrap();
    let back = read(&folder).unwrap();
    assert_eq!(back.model.coupling, element.model.coupling);
    assert_eq!(back.model.observations, element.model.observations);
    assert_eq!(back.model.static_load, element.model.static_load);
    assert_eq!(back.areas_m2, None);
    let text = folder.text("model.json");
    folder.write("model.json", text.replace("\"modes\": 0", "\"modes\": 4"));
    assert_refused(&folder, &["excitations_on_modes.mtx"]);
}

#[test]
fn the_matrices_of_two_models_are_not_read_together() {
    let [first, second] = [small(), stiffer()].map(|element| written(&element));
    std::fs::copy(second.join("mass.mtx"), first.join("mass.mtx")).unwrap();
    assert_refused(
        &first,
        &["mass.mtx", "model.json", "one model", "dovetail reduce"],
    );
    // A matrix that names no model is the user's own.
    let text = second.text("mass.mtx");
    let without = text.lines().filter(|line| !line.starts_with("% "));
    let without: Vec<&str> = without.collect();
    first.write("mass.mtx", without.join("\n"));
    assert!(read(&first).is_ok());
    // The same model has the same name.
    write(&second, &small()).unwrap();
    std::fs::copy(second.join("stiffness.mtx"), first.join("stiffness.mtx")).unwrap();
    assert!(read(&first).is_ok());
}

/// Wherever the writing of a second model ends, by a file that cannot take its name, nothing
/// can be read but the whole of one of the two.
#[test]
fn a_folder_that_was_not_written_to_its_end_is_not_read() {
    for name in FILES {
        let folder = written(&small());
        // A folder of this name cannot be replaced by a file.
        std::fs::remove_file(folder.join(name)).unwrap();
        std::fs::create_dir_all(folder.join(name).join("in the way")).unwrap();
        let error = write(&folder, &stiffer()).unwrap_err();
        assert!(matches!(error, SuperelementError::Write { .. }), "{error}");
        std::fs::remove_dir_all(folder.join(name)).unwrap();
        assert!(read(&folder).is_err(), "{name}");
    }
    let folder = written(&small());
    std::fs::remove_file(folder.join(DESCRIPTION)).unwrap();
    let words = ["model.json", "a part of a reduced model", "dovetail reduce"];
    assert_refused(&folder, &words);
}

#[test]
fn malformed_files_are_named_with_line_and_shape() {
    let folder = written(&small());
    let head = "%%MatrixMarket matrix array real general\n";
    let skew = Mat::from_fn(6, 6, |i, j| i as f64 - 2.0 * j as f64);
    let skew = (0..36).map(|i| format!("{}\n", skew[(i % 6, i / 6)]));
    let skew = format!("6 6\n{}", skew.collect::<String>());
    let cases: [(&str, &str, &[&str]); 5] = [
        (
            "squared_frequencies.mtx",
            "4 1\n1\n2\nthree\n4\n",
            &["squared_frequencies.mtx", "line 5: found `three`"],
        ),
        (
            "squared_frequencies.mtx",
            "4 1\n1\n3\n2\n4\n",
            &["squared frequency 3", "ascending"],
        ),
        (
            "observed_points.mtx",
            "5 2\n1\n3\n2\n4\n5\n1\n3\n2\n4\n5\n",
            &["5 x 2, expected 6 x 2"],
        ),
        (
            "static_load.mtx",
            "6 1\n1\n3\n2\n4\n5\n",
            &["6 x 1 is announced", "10 bytes"],
        ),
        ("stiffness.mtx", &skew, &["symmetric", "(1, 2)"]),
    ];
    for (file, text, words) in cases {
        let whole = folder.text(file);
        folder.write(file, format!("{head}{text}"));
        assert_refused(&folder, words);
        folder.write(file, whole);
    }
    let lenient = format!("{}4 1\n1\n2\n3\n4\n", &head[1..]);
    folder.write("static_load_on_modes.mtx", lenient);
    let read_back = read(&folder).unwrap().model.static_load.on_modes;
    assert_eq!(read_back, [1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn a_stiffness_or_mass_that_no_body_has_is_refused() {
    let with = |change: &dyn Fn(&mut ReducedModel)| {
        let mut element = small();
        change(&mut element.model);
        written(&element)
    };
    let diagonal =
        |values: [f64; 6]| Mat::from_fn(6, 6, |i, j| if i == j { values[i] } else { 0.0 });
    let stiffness = |values: [f64; 6]| with(&|model| model.stiffness = diagonal(values));
    // Contact alone may hold the body, and spin may soften it.
    for values in [
        [0.0, 0.0, 0.0, 0.0, 0.0, 6.0],
        [-0.9e-3, 1.0, 1.0, 1.0, 1.0, 2.0],
    ] {
        assert!(read(&stiffness(values)).is_ok());
    }
    let too_soft = stiffness([-1.1e-3, 1.0, 1.0, 1.0, 1.0, 2.0]);
    let words = [
        "stiffness.mtx",
        "lowest eigenvalue",
        "-1.100e-3 N/m",
        "its sign",
    ];
    assert_refused(&too_soft, &words);
    assert_refused(&stiffness([-1.0; 6]), &["stiffness.mtx", "-1.000e0 N/m"]);
    assert_refused(&stiffness([0.0; 6]), &[]);
    let huge = stiffness([1e308, -1e308, 1e308, 1e308, 1e308, 1e308]);
    assert_refused(&huge, &[]);

    let mass = |mass: f64, coupling: f64| {
        with(&|model| {
            model.mass = diagonal([mass; 6]);
            model.coupling = Mat::from_fn(6, 4, |i, j| if i == j { coupling } else { 0.0 });
        })
    };
    // Massless pairs, and pairs whose mass is all in the modes, to rounding.
    for (kg, coupling) in [(0.0, 0.0), (2.0, 2f64.sqrt()), (2.0, (2f64 + 1e-7).sqrt())] {
        assert!(read(&mass(kg, coupling)).is_ok());
    }
    let words = ["mass.mtx", "M - p p^T", "-1.000e0 kg", "unit modal mass"];
    assert_refused(&mass(2.0, 3f64.sqrt()), &words);
    for (kg, coupling) in [(-1.0, 0.0), (0.0, 1.0), (1e300, 1e200)] {
        assert_refused(&mass(kg, coupling), &[]);
    }
}

#[test]
fn a_description_that_contradicts_itself_is_refused() {
    let folder = written(&small());
    let whole = folder.text("model.json");
    for (from, to, words) in [
        ("\"pairs\": 2,", "\"pairs\": 0,", "at least one pair"),
        (
            "\"pairs\": 2,",
            "\"pairs\": 3,",
            "2 pairs in all, and `pairs` is 3",
        ),
        ("\"length\": \"m\"", "\"length\": \"mm\"", "m, kg, s and N"),
        (
            "\"harmonic\": 3",
            "\"harmonic\": 0",
            "\"base\": the harmonic must be 1",
        ),
        ("\"phase_rad\": 0.0", "\"phase_rad\": \"0\"", "expected f64"),
        (
            "\"harmonic\": 3",
            "\"harmonics\": 3",
            "unknown field `harmonics`",
        ),
        (FORMAT, "something", "format is \"something\""),
        ("\"root\"", "\"root\", \"top\"", "6 x 2, expected 6 x 3"),
    ] {
        assert!(whole.contains(from), "{from}: {whole}");
        folder.write("model.json", whole.replacen(from, to, 1));
        assert_refused(&folder, &[words]);
    }
}

#[test]
fn a_folder_with_other_names_is_told_how_to_rename_them() {
    let folder = Folder::new("other_names");
    folder.write("K.mtx", "");
    let words = [
        "stiffness.mtx",
        "scripts/name_reduced_model.py",
        "model.json",
    ];
    assert_refused(&folder, &words);
}

#[test]
fn a_missing_file_is_named() {
    assert_refused(&Folder::new("missing"), &["model.json"]);
}
