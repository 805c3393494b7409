//! Says in a few words under what a scene rests and shakes, for the headings of pictures.

use crate::words::{counted, figure, quantity};
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::model::{Assembly, ContactLaw, ExcitationKind, ExcitationSpec};

/// Excitation, speed and friction: `1.00 N, 6000 rpm, friction 0.3`.
pub(super) fn in_motion(scene: &Scene) -> String {
    let parts = match &scene.subject {
        Subject::Assembly(assembly) => [
            excitations(assembly),
            vec![speed(assembly)],
            vec![friction(assembly)],
        ]
        .concat(),
        Subject::ReducedModel(model) => vec![
            quantity(model.force_n, "N", 3),
            format!("friction {}", short(model.friction)),
        ],
    };
    parts.join(", ")
}

/// What acts in the static state: `6000 rpm, 1 steady load, friction 0.3`. The excitation does not.
pub(super) fn at_rest(scene: &Scene) -> String {
    let parts = match &scene.subject {
        Subject::Assembly(assembly) => {
            let loads = match assembly.loads.len() {
                0 => Vec::new(),
                loads => vec![counted(loads, "steady load", "steady loads")],
            };
            [vec![speed(assembly)], loads, vec![friction(assembly)]].concat()
        }
        Subject::ReducedModel(model) => vec![format!("friction {}", short(model.friction))],
    };
    parts.join(", ")
}

/// `5000 rpm`, `no rotation`.
fn speed(assembly: &Assembly) -> String {
    match &assembly.rotation {
        Some(rotation) => format!("{} rpm", short(rotation.speed_rpm())),
        None => "no rotation".to_owned(),
    }
}

/// `friction 0.3`, of the contacts that slide.
fn friction(assembly: &Assembly) -> String {
    let rub = |law: &ContactLaw| matches!(law, ContactLaw::UnilateralCoulomb);
    let contacts = assembly.contacts.iter().filter(|c| rub(&c.law));
    let friction: Vec<f64> = contacts.map(|c| c.friction).collect();
    match range(&friction) {
        Some((least, most)) if least == most => format!("friction {}", short(most)),
        Some((least, most)) => format!("friction {} to {}", short(least), short(most)),
        None => "bonded".to_owned(),
    }
}

/// One part for each unit, `1.00 N` or `2 forces of 1.00 N to 2.00 N`, and one for the fields.
fn excitations(assembly: &Assembly) -> Vec<String> {
    let mut parts = Vec::new();
    for unit in ["N", "Pa", "m/s2", "m"] {
        let of_unit = assembly.excitations.iter();
        let of_unit = of_unit.filter(|e| e.kind.unit() == unit);
        let amplitudes: Vec<f64> = of_unit.map(|e| e.amplitude).collect();
        match (amplitudes.as_slice(), range(&amplitudes)) {
            ([one], _) => parts.push(quantity(*one, unit, 3)),
            (_, Some((least, most))) => {
                let each = match least == most {
                    true => quantity(most, unit, 3),
                    false => format!(
                        "{} to {}",
                        quantity(least, unit, 3),
                        quantity(most, unit, 3)
                    ),
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

/// Six digits at most, no zeros at the end.
fn short(v: f64) -> String {
    let text = figure(v, 6);
    match text.contains('.') && !text.contains('e') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
