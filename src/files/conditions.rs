//! Short texts of the loads and excitations of a scene, for the headings of pictures.

use dovetail_export::words::{counted, short, short_quantity};
use dovetail_solver::description::{EngineOrder, Scene, Subject};
use dovetail_solver::model::{Assembly, ContactLaw, ExcitationKind, ExcitationSpec};

/// Excitation, speed and friction without those that these keys vary: `1 N at 6000 rpm, friction 0.3`.
/// A run-up has its engine order in the place of the speed.
pub(super) fn in_motion(scene: &Scene, keys: &[&str]) -> String {
    let is_varied = |section: &str, end: &str| {
        let varies = |key: &&str| {
            let of_section = key.starts_with(section) || key.starts_with("reduced_model.");
            of_section
                && key
                    .rsplit('.')
                    .next()
                    .is_some_and(|last| last.contains(end))
        };
        keys.iter().any(varies)
    };
    let excited = |words: String| {
        let varied = ["force", "pressure", "traction", "base", "factor"];
        let is_varied = varied.iter().any(|end| is_varied("excitation.", end));
        (!is_varied).then_some(words)
    };
    let rubbed = |words: String| (!is_varied("contact.", "friction")).then_some(words);
    let parts = match &scene.subject {
        Subject::Assembly(assembly) => {
            let shaken = excited(excitations(assembly).join(", "));
            let speed = match scene.response.along_engine_order {
                Some(EngineOrder(order)) => Some(format!("along engine order {order}")),
                None => (!is_varied("rotation.", "speed")).then(|| speed(assembly)),
            };
            let moving = match (shaken, speed) {
                (Some(shaken), Some(speed)) if speed.starts_with("along") => {
                    Some(format!("{shaken} {speed}"))
                }
                (Some(shaken), Some(speed)) if assembly.rotation.is_some() => {
                    Some(format!("{shaken} at {speed}"))
                }
                (Some(shaken), Some(speed)) => Some(format!("{shaken}, {speed}")),
                (shaken, speed) => shaken.or(speed),
            };
            [moving, rubbed(friction(assembly))]
        }
        Subject::ReducedModel(model) => [
            excited(short_quantity(model.force_n, "N")),
            rubbed(format!("friction {}", short(model.law.friction))),
        ],
    };
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// Conditions of the static state: `6000 rpm, 1 steady load, friction 0.3`. The excitation does not
/// act in it.
pub(super) fn static_conditions(scene: &Scene) -> String {
    let parts = match &scene.subject {
        Subject::Assembly(assembly) => {
            let loads = match assembly.loads.len() {
                0 => Vec::new(),
                loads => vec![counted(loads, "steady load", "steady loads")],
            };
            [vec![speed(assembly)], loads, vec![friction(assembly)]].concat()
        }
        Subject::ReducedModel(model) => vec![format!("friction {}", short(model.law.friction))],
    };
    parts.join(", ")
}

/// Speed: `5000 rpm` or `no rotation`.
fn speed(assembly: &Assembly) -> String {
    match &assembly.rotation {
        Some(rotation) => format!("{} rpm", short(rotation.speed_rpm())),
        None => "no rotation".to_owned(),
    }
}

/// Friction of the contacts that slide: `friction 0.3`, or where it is that of a file.
fn friction(assembly: &Assembly) -> String {
    let rub = |law: &ContactLaw| matches!(law, ContactLaw::UnilateralCoulomb);
    let contacts = assembly.contacts.iter().filter(|c| rub(&c.law));
    let (files, contacts): (Vec<_>, Vec<_>) = contacts.partition(|c| c.friction_at.is_some());
    let friction: Vec<f64> = contacts.iter().map(|c| c.pair_law.friction).collect();
    let numbers = range(&friction).map(|(least, most)| match least == most {
        true => short(most),
        false => format!("{} to {}", short(least), short(most)),
    });
    let mut files: Vec<_> = files
        .iter()
        .filter_map(|c| c.friction_at.as_ref()?.file())
        .collect();
    files.sort_unstable();
    files.dedup();
    let of_files = match files.len() {
        0 => None,
        1 => Some("of a file".to_owned()),
        _ => Some("of files".to_owned()),
    };
    let texts: Vec<String> = numbers.into_iter().chain(of_files).collect();
    match texts.is_empty() {
        true => "bonded".to_owned(),
        false => format!("friction {}", texts.join(" and ")),
    }
}

/// Excitations: one text for each unit, `1 N` or `2 forces of 1 N to 2 N`, and one for the fields.
fn excitations(assembly: &Assembly) -> Vec<String> {
    let mut parts = Vec::new();
    for unit in ["N", "Pa", "m/s2", "m"] {
        let of_unit = assembly.excitations.iter();
        let of_unit = of_unit.filter(|e| e.kind.unit() == unit);
        let amplitudes: Vec<f64> = of_unit.map(|e| e.amplitude).collect();
        match (amplitudes.as_slice(), range(&amplitudes)) {
            ([one], _) => parts.push(short_quantity(*one, unit)),
            (_, Some((least, most))) => {
                let each = if least == most {
                    short_quantity(most, unit)
                } else {
                    format!(
                        "{} to {}",
                        short_quantity(least, unit),
                        short_quantity(most, unit)
                    )
                };
                let (one, many) = match unit {
                    "N" => ("force", "forces"),
                    "Pa" => ("pressure", "pressures"),
                    "m" => ("displacement", "displacements"),
                    _ => ("acceleration", "accelerations"),
                };
                parts.push(format!(
                    "{} of {each}",
                    counted(amplitudes.len(), one, many)
                ));
            }
            (_, None) => {}
        }
    }
    let is_field = |e: &&ExcitationSpec| matches!(e.kind, ExcitationKind::Field { .. });
    match assembly.excitations.iter().filter(is_field).count() {
        0 => {}
        fields => parts.push(counted(fields, "field of a file", "fields of files")),
    }
    parts
}

fn range(values: &[f64]) -> Option<(f64, f64)> {
    let least = values.iter().copied().reduce(f64::min)?;
    Some((least, values.iter().copied().reduce(f64::max)?))
}
