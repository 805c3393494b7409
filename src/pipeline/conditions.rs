//! Says in a few words under what a scene shakes, for the headings of pictures.

use crate::words::{counted, figure, quantity};
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::model::{Assembly, ContactLaw, ExcitationKind, ExcitationSpec};

/// Force, speed and friction: `1.00 N, 6000 rpm, friction 0.3`.
pub(super) fn conditions(scene: &Scene) -> String {
    let parts = match &scene.subject {
        Subject::Assembly(assembly) => of_assembly(assembly),
        Subject::ReducedModel(model) => vec![
            quantity(model.force_n, "N", 3),
            format!("friction {}", short(model.friction)),
        ],
    };
    parts.join(", ")
}

fn of_assembly(assembly: &Assembly) -> Vec<String> {
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
    match &assembly.rotation {
        Some(rotation) => parts.push(format!("{} rpm", short(rotation.speed_rpm()))),
        None => parts.push("at rest".to_owned()),
    }
    let rub = |law: &ContactLaw| matches!(law, ContactLaw::UnilateralCoulomb);
    let contacts = assembly.contacts.iter().filter(|c| rub(&c.law));
    let friction: Vec<f64> = contacts.map(|c| c.friction).collect();
    parts.push(match range(&friction) {
        Some((least, most)) if least == most => format!("friction {}", short(most)),
        Some((least, most)) => format!("friction {} to {}", short(least), short(most)),
        None => "bonded".to_owned(),
    });
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
