use std::path::Path;

use super::*;
use crate::scene::error::{SceneError, SceneFault};
use crate::scene::keys::{Key, SectionShape};
use crate::scene::kinds::ValueKind;
use crate::scene::parse;

/// Scene with every section, in which each key of `section` can be given.
pub(crate) fn scene_with(section: &str, key: &str) -> String {
    let mesh = match key {
        "file" => "file = \"a.msh\"",
        "fallback" | "fallback_parameters" => {
            "geometry = \"a.geo\"\nfallback = \"a.msh\"\nfallback_parameters = {}"
        }
        _ => "geometry = \"a.geo\"",
    };
    let load = match key {
        "pressure_pa" => "pressure_pa = 1.0",
        "traction_pa" => "traction_pa = 1.0\ndirection = [1, 0, 0]",
        _ => "force_n = 1.0\ndirection = [1, 0, 0]",
    };
    // The example of `static.path` has multiples of two loads.
    let other_load = match key {
        "loads" => "[[load]]\non = \"a2\"\npressure_pa = 1.0\n",
        _ => "",
    };
    let cause = match key {
        "file" | "factor" => "on = \"p\"\nfile = \"p.csv\"".to_owned(),
        "base_acceleration_m_s2" | "base_displacement_m" => {
            format!("{key} = 1.0\ndirection = [1, 0, 0]")
        }
        _ => format!("on = \"p\"\n{load}"),
    };
    let damping = match key {
        "stiffness_s" => "mass_per_s = 1.0",
        "mass_per_s" => "stiffness_s = 1.0",
        _ => "ratio = 0.001",
    };
    let friction = match key {
        "friction_file" => "friction_file = \"f.csv\"",
        _ => "friction = 0.3",
    };
    let range = match key {
        "frequency_hz" | "along_engine_order" => "frequency_hz = [1, 2]",
        "speed_rpm" if section == "response" => "along_engine_order = 4\nspeed_rpm = [1, 2]",
        _ => "times_first_linear_mode = [0.9, 1.1]",
    };
    let body = match key {
        "mass_kg" => "young_pa = 1e11\npoisson = 0.3\nmass_kg = 1",
        _ => "young_pa = 1e11\npoisson = 0.3\ndensity_kg_m3 = 4000",
    };
    let of_disc = match key {
        "influence_on" => "influence = \"a.csv\"\n",
        _ => "",
    };
    let own = match (section, key) {
        ("body", "metres_per_unit") => "mesh_file = \"a.msh\"\n",
        ("body", "units") => "mesh_file = \"a.inp\"\n",
        ("body", "rotation_axis") => "mesh_file = \"a.msh\"\nrotation_deg = 1\n",
        ("body", "rotation_deg" | "rotation_point_m" | "translation_m") => {
            "mesh_file = \"a.msh\"\nrotation_axis = [1, 0, 0]\n"
        }
        ("body", "endurance_pa") => "ultimate_pa = 1e9\n",
        ("body", "ultimate_pa") => "endurance_pa = 1e8\n",
        _ => "",
    };
    let subject = match section {
        "reduced_model" => {
            "[reduced_model]\nfolder = \"a\"\nfriction = 0.3\nforce_n = 1".to_owned()
        }
        _ => format!(
            "[mesh]\n{mesh}\nmetres_per_unit = 1e-3\n\
             [[body]]\nname = \"a\"\n{own}volume = \"a\"\n{body}\n\
             [[body]]\nname = \"b\"\nvolume = \"b\"\n{body}\nfixed = [\"base\"]\n\
             [rotation]\naxis = [1, 0, 0]\nspeed_rpm = 5000\n\
             [cyclic]\nsectors = 36\nlow = [\"a5\"]\nhigh = [\"a6\"]\n{of_disc}\
             [[contact]]\nname = \"c\"\nfirst = \"a1\"\nsecond = \"b1\"\n{friction}\n\
             crown_radius_m = 1.0\n\
             [[spring]]\nname = \"s\"\nfirst = \"a3\"\nstiffness_n_m = 1e6\n\
             [[dashpot]]\nname = \"d\"\nfirst = \"a3\"\ndamping_n_s_m = 10\n\
             [[load]]\non = \"a2\"\n{load}\n{other_load}\
             [[excitation]]\n{cause}\n\
             [[observe]]\nname = \"tip\"\npoints = \"p\"\ndirection = [1, 0, 0]\n\
             [[engine_order]]\norder = 4\n[[mission]]\nforce_scale = 1"
        ),
    };
    let resolution = match key {
        "samples" | "tolerance" => "harmonics = 3\n",
        _ => "",
    };
    format!(
        "name = \"s\"\n{subject}\n[damping]\n{damping}\n[static]\n[[static.path]]\n[response]\n{range}\n{resolution}"
    )
}

fn parsed(section: &SceneSection, key: &Key, value: &str) -> (String, Vec<SceneFault>) {
    let text = scene_with(section.name, key.name);
    let path = match section.shape {
        SectionShape::Table => format!("{}.{}", section.name, key.name),
        SectionShape::List => format!("{}.0.{}", section.name, key.name),
    };
    let set = match value {
        "" => vec![],
        value => vec![format!("{path}={value}")],
    };
    let path = match section.name {
        "body" => format!("body.a.{}", key.name),
        "contact" => format!("contact.c.{}", key.name),
        "spring" => format!("spring.s.{}", key.name),
        "dashpot" => format!("dashpot.d.{}", key.name),
        "observe" => format!("observe.tip.{}", key.name),
        _ => path,
    };
    match parse(&text, "scene.toml", Path::new(""), &set) {
        Ok(scene) => (format!("{scene:?}"), vec![]),
        Err(SceneError::Invalid { problems }) => {
            (path, problems.into_iter().map(|p| p.fault).collect())
        }
        Err(error) => panic!("{error}"),
    }
}

fn is_out_of_range(section: &SceneSection, key: &Key, value: &str) -> bool {
    let (path, faults) = parsed(section, key, value);
    let of_key = |f: &SceneFault| match f {
        SceneFault::OutOfRange { path: found, .. } => *found == path,
        SceneFault::NoHarmonic => key.name == "harmonics",
        _ => false,
    };
    faults.iter().any(of_key)
}

pub(crate) fn all_keys() -> impl Iterator<Item = (&'static SceneSection, &'static Key)> {
    SECTIONS
        .iter()
        .filter(|s| !s.name.is_empty())
        .flat_map(|s| s.keys.iter().map(move |k| (s, k)))
}

/// Values within the limits of a kind and values just outside; `None` if the kind is not a
/// number.
pub(crate) fn probes(kind: ValueKind) -> Option<(Vec<String>, Vec<String>)> {
    let text = |v: f64| format!("{v:e}");
    let step = |v: f64| v.abs().max(1e-30) * 1e-9;
    let (inside, outside) = match kind {
        ValueKind::Whole(least, most) => {
            let below = least.filter(|l| *l > 0).map(|l| l - 1);
            let inside = least.into_iter().chain(most);
            let outside = below.into_iter().chain(most.map(|m| m + 1));
            let texts = |v: Vec<u32>| v.iter().map(u32::to_string).collect();
            return Some((texts(inside.collect()), texts(outside.collect())));
        }
        ValueKind::Number(_, limits) => {
            let Limits { above, below, from } = limits;
            let least = if from {
                (above, above - step(above))
            } else {
                (above + step(above), above)
            };
            let ends = [least, (below - step(below), below)];
            let open = [(-1e300, above.is_finite()), (1e300, below.is_finite())];
            let inside = ends.iter().zip(open).map(
                |((inside, _), (far, is_limit))| {
                    if is_limit { *inside } else { far }
                },
            );
            let outside = ends.iter().zip(open);
            let outside = outside.filter(|(_, (_, is_limit))| *is_limit);
            (
                inside.collect::<Vec<f64>>(),
                outside
                    .map(|((_, outside), _)| *outside)
                    .collect::<Vec<f64>>(),
            )
        }
        _ => return None,
    };
    let texts = |v: Vec<f64>| v.into_iter().map(text).collect();
    Some((texts(inside), texts(outside)))
}

#[test]
fn documented_limits_are_those_of_the_checks() {
    let mut probed = 0;
    for (section, key) in all_keys() {
        let Some((inside, outside)) = probes(key.kind) else {
            continue;
        };
        probed += 1;
        for value in inside {
            assert!(
                !is_out_of_range(section, key, &value),
                "{} = {value}",
                key.name
            );
        }
        for value in outside {
            assert!(
                is_out_of_range(section, key, &value),
                "{} = {value}",
                key.name
            );
        }
    }
    assert!(probed > 30, "{probed} keys");
}

/// Values of other types than the kind.
pub(crate) fn wrong_types(kind: ValueKind) -> &'static [&'static str] {
    match kind {
        ValueKind::Text(_) | ValueKind::Name | ValueKind::Choice(_) => &["1", "[]", "true"],
        ValueKind::Texts(_) | ValueKind::Choices(_) => &["\"a\"", "[1]", "1"],
        ValueKind::Number(..) => &["\"a\"", "[1]", "true", "inf"],
        ValueKind::Whole(..) => &["0.5", "\"a\"", "-1"],
        ValueKind::Numbers(2, _) => &["[1]", "[1, 2, 3]", "1", "[1, \"a\"]"],
        ValueKind::Numbers(_, _) => &["[1, 2]", "[1, 2, 3, 4]", "1"],
        ValueKind::NumberList(..) => &["1", "\"a\"", "[\"a\"]"],
        ValueKind::NumberOrList(..) => &["\"a\"", "[\"a\"]", "true", "inf"],
        ValueKind::NumberTable => &["{ a = \"b\" }", "1"],
        ValueKind::Flag => &["\"true\"", "1"],
        ValueKind::List => &["1", "\"a\""],
        ValueKind::Any(_) => &[],
    }
}

#[test]
fn documented_types_are_those_of_the_mirror() {
    for (section, key) in all_keys() {
        let is_wrong_type = |value: &str| {
            let faults = parsed(section, key, value).1;
            faults
                .iter()
                .any(|f| matches!(f, SceneFault::WrongType { .. }))
        };
        let example: toml::Table = key.example.parse().unwrap();
        let right = example[key.name].to_string();
        assert!(!is_wrong_type(&right), "{} = {right}", key.name);
        for value in wrong_types(key.kind) {
            assert!(is_wrong_type(value), "{} = {value}", key.name);
        }
    }
}

#[test]
fn what_is_required_is_missed() {
    let is_missed = |section: &SceneSection, key: &Key| {
        let faults = parsed(section, key, " ").1;
        let missing = |f: &SceneFault| match f {
            SceneFault::MissingKey { path, .. } => path.ends_with(key.name),
            _ => false,
        };
        faults.iter().any(missing)
    };
    for (section, key) in all_keys() {
        if key.is_required() {
            assert!(is_missed(section, key), "{}.{}", section.name, key.name);
        }
    }
}

#[test]
fn documented_defaults_change_nothing() {
    let mut written = 0;
    for (section, key) in all_keys() {
        let Some(default) = key.default_value() else {
            continue;
        };
        written += 1;
        let (without, faults) = parsed(section, key, "");
        assert!(faults.is_empty(), "{}: {faults:?}", key.name);
        let (with, _) = parsed(section, key, &default.to_string());
        assert_eq!(with, without, "{}.{}", section.name, key.name);
    }
    assert!(written > 20, "{written} keys");
}

#[test]
fn documented_words_are_those_of_the_checks() {
    let mut chosen = 0;
    for (section, key) in all_keys() {
        let (_, faults) = parsed(section, key, "\"no such word\"");
        let words = faults.iter().find_map(|f| match f {
            SceneFault::UnknownChoice { valid, .. } => Some(*valid),
            _ => None,
        });
        for word in words.unwrap_or_default() {
            chosen += 1;
            assert!(
                key.meaning.contains(&format!("`\"{word}\"`")),
                "{}: {word}",
                key.name
            );
        }
        let listed = match key.kind {
            ValueKind::Choice(listed) => listed,
            _ => &[],
        };
        assert_eq!(listed, words.unwrap_or_default(), "{}", key.name);
    }
    assert!(chosen > 7, "{chosen} words");
}
