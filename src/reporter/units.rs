//! Detects implausible materials and sizes of bodies: their numbers are mostly in another unit.

use std::ops::RangeInclusive;

use dovetail_export::words::quantity;
use dovetail_mesh::units::Units;
use dovetail_solver::fem::mass_properties::MassProperties;
use dovetail_solver::model::{
    Assembly, Body, BodyMesh, BodySpec, Material, MaterialSpec, MatrixSource,
};
use dovetail_solver::run::Bound;

/// Plausible lengths of the bodies of one mesh, m: a small damper to a long fan blade with its disc.
const LENGTHS_M: RangeInclusive<f64> = 2e-3..=10.0;
/// Largest plausible volume of the bodies of one mesh, m3: 100 t of steel.
const MOST_VOLUME_M3: f64 = 12.0;
/// Common units of length, and their values in m.
const LENGTH_UNITS: [(&str, f64); 2] = [("millimetres", 1e-3), ("metres", 1.0)];

/// Plausible densities of solids except aerogels, kg/m3.
const DENSITIES: RangeInclusive<f64> = 10.0..=3e4;
/// Plausible wave speeds sqrt(E / density), m/s: rubber to diamond.
const WAVE_SPEEDS: RangeInclusive<f64> = 100.0..=2e4;
/// Wave speed of steel, titanium and aluminium, m/s. Among several units, the one that comes
/// nearest to it is probably meant.
const METALS: f64 = 5000.0;
/// Common units of density, and their values in kg/m3.
const DENSITY_UNITS: [(&str, f64); 2] = [("g/cm3", 1e3), ("t/mm3", 1e12)];
/// Common units of stiffness, and their values in Pa.
const YOUNG_UNITS: [(&str, f64); 2] = [("MPa (N/mm2)", 1e6), ("GPa", 1e9)];

/// Messages about bodies of implausible size, one for each mesh, with the unit that the mesh is
/// probably in.
pub(super) fn doubtful_sizes(assembly: &Assembly, bound: &Bound) -> Vec<String> {
    let bodies: Vec<(&BodySpec, &Body, &MassProperties)> = (assembly.bodies.iter())
        .zip(&bound.model.bodies)
        .zip(&bound.properties)
        .map(|((spec, body), properties)| (spec, body, properties))
        .collect();
    let shared = bodies
        .iter()
        .filter(|(spec, ..)| spec.mesh == BodyMesh::Shared);
    let shared: Vec<_> = shared
        .map(|(_, body, properties)| (*body, *properties))
        .collect();
    let shared = assembly.mesh.as_ref().and_then(|mesh| {
        let named = match shared.as_slice() {
            [(one, _)] => format!("body \"{}\"", one.name),
            _ => "the bodies of [mesh] together".to_owned(),
        };
        doubtful_size((&named, "[mesh]"), mesh.units, &shared)
    });
    let sizes = bodies.iter().filter_map(|(spec, body, properties)| {
        let BodyMesh::File { units, .. } = &spec.mesh else {
            return None;
        };
        let named = format!("body \"{}\"", spec.name);
        doubtful_size((&named, "this body"), *units, &[(body, properties)])
    });
    shared.into_iter().chain(sizes).collect()
}

/// Message about bodies of an implausible size, whose mesh has these units.
fn doubtful_size(
    (named, table): (&str, &str),
    units: Units,
    bodies: &[(&Body, &MassProperties)],
) -> Option<String> {
    let nodes = || bodies.iter().flat_map(|(body, _)| &body.nodes_m);
    let size = [0, 1, 2].map(|axis| {
        let ends = nodes().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x[axis]), high.max(x[axis])]
        });
        (ends[1] - ends[0]).max(0.0)
    });
    let length_m = size.into_iter().fold(0.0, f64::max);
    let volumes = bodies
        .iter()
        .filter_map(|(_, properties)| properties.volume_m3);
    let volume_m3: f64 = volumes.sum();
    let is_plausible = |factor: f64| {
        LENGTHS_M.contains(&(factor * length_m)) && factor.powi(3) * volume_m3 <= MOST_VOLUME_M3
    };
    if is_plausible(1.0) {
        return None;
    }
    let meant = LENGTH_UNITS
        .into_iter()
        .find(|(_, metres)| is_plausible(metres / units.metres()))
        .map_or_else(
            || format!("check `metres_per_unit` of {table}"),
            |(word, metres)| {
                let key = match units {
                    Units::MetresPerUnit(_) => format!("metres_per_unit = {metres}"),
                    _ if metres == 1.0 => "units = \"m-kg-s\"".to_owned(),
                    _ => "units = \"mm-t-s\"".to_owned(),
                };
                format!("the mesh looks like {word}, which would be `{key}` of {table}")
            },
        );
    let mass_kg: f64 = bodies
        .iter()
        .map(|(_, properties)| properties.mass_kg)
        .sum();
    let size = size.map(|side| quantity(side, "m", 3)).join(" x ");
    Some(format!(
        "{named}: a size of {size} and a mass of {} are implausible for blades and discs: {meant}",
        mass_words(mass_kg)
    ))
}

/// Mass in kilograms or tonnes.
fn mass_words(mass_kg: f64) -> String {
    if mass_kg < 1e3 {
        quantity(1e3 * mass_kg, "g", 3)
    } else {
        quantity(1e-3 * mass_kg, "t", 3)
    }
}

/// Message about an implausible material of a body, with the unit that the number is probably in;
/// `None` if the material is plausible.
pub(super) fn implausible_material(spec: &BodySpec, material: Material) -> Option<String> {
    let doubtful = doubtful_material(&spec.name, material)?;
    if let MatrixSource::Elements(MaterialSpec::OfMass { mass_kg, .. }) = &spec.matrices {
        return Some(format!(
            "{}: the density is mass_kg = {mass_kg} over the volume of the mesh; if you chose the mass on purpose, \
             ignore this warning, else check mass_kg and the units of the mesh",
            doubtful.told
        ));
    }
    let MatrixSource::Elements(MaterialSpec::OfMesh(_)) = &spec.matrices else {
        // A density that no unit explains may have been chosen for the mass that it gives.
        let meant = match doubtful.meant.as_str() {
            "" => "; if you chose the density to give the body another mass, ignore this warning",
            meant => meant,
        };
        return Some(doubtful.told + meant);
    };
    Some(format!(
        "{}: check `units` of the mesh, whose material it is (\"mm-t-s\" for a file in mm, t, s, MPa; \"m-kg-s\" for \
         one in SI units; \"in-lbf-s\" for one in inches and psi)",
        doubtful.told
    ))
}

/// Words on an implausible material, and on the unit that its number is probably in.
struct Doubtful {
    told: String,
    meant: String,
}

fn doubtful_material(name: &str, material: Material) -> Option<Doubtful> {
    let Material {
        young_pa,
        density_kg_m3,
        ..
    } = material;
    let speed = |young_pa: f64, density: f64| (young_pa / density).sqrt();
    if !DENSITIES.contains(&density_kg_m3) {
        let meant = likely(&DENSITY_UNITS, |unit| {
            let density = density_kg_m3 * unit;
            DENSITIES
                .contains(&density)
                .then(|| speed(young_pa, density))
        });
        let meant = meant.map_or(String::new(), |(word, unit)| {
            format!(
                ": it looks like {word}, which would be density_kg_m3 = {}",
                rounded(density_kg_m3 * unit)
            )
        });
        let told = format!(
            "body \"{}\": a density of {density_kg_m3} kg/m3 is outside of {} to {} kg/m3",
            name,
            DENSITIES.start(),
            DENSITIES.end()
        );
        return Some(Doubtful { told, meant });
    }
    let own = speed(young_pa, density_kg_m3);
    if WAVE_SPEEDS.contains(&own) {
        return None;
    }
    let meant = likely(&YOUNG_UNITS, |unit| {
        Some(speed(young_pa * unit, density_kg_m3))
    });
    let meant = meant.map_or(String::new(), |(word, unit)| {
        format!(
            ": young_pa looks like {word}, which would be young_pa = {}",
            rounded(young_pa * unit)
        )
    });
    let told = format!(
        "body \"{}\": young_pa = {young_pa} and density_kg_m3 = {density_kg_m3} give waves of {own:.3e} m/s, outside of \
         {} to {} m/s",
        name,
        WAVE_SPEEDS.start(),
        WAVE_SPEEDS.end()
    );
    Some(Doubtful { told, meant })
}

/// Unit with which the wave speed is nearest to that of metals; `None` if no unit gives a plausible
/// speed.
fn likely(
    units: &[(&'static str, f64)],
    speed: impl Fn(f64) -> Option<f64>,
) -> Option<(&'static str, f64)> {
    let possible = units.iter().filter_map(|&(word, unit)| {
        let speed = speed(unit).filter(|speed| WAVE_SPEEDS.contains(speed))?;
        Some((word, unit, (speed / METALS).ln().abs()))
    });
    let nearest = possible.min_by(|a, b| a.2.total_cmp(&b.2))?;
    Some((nearest.0, nearest.1))
}

/// Number without the digits that stem from a change of units.
fn rounded(v: f64) -> String {
    let v: f64 = format!("{v:.6e}").parse().unwrap_or(v);
    match v {
        v if v < 1e6 => v.to_string(),
        v => format!("{v:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warning_text(young_pa: f64, density_kg_m3: f64) -> Option<String> {
        let material = Material {
            young_pa,
            poisson: 0.3,
            density_kg_m3,
        };
        doubtful_material("blade", material).map(|found| found.told + &found.meant)
    }

    #[test]
    fn materials_of_blades_are_not_doubted() {
        for (young_pa, density) in [
            (113.8e9, 4430.0),
            (210e9, 7850.0),
            (70e9, 2700.0),
            (5e7, 1200.0),
            (1050e9, 3500.0),
        ] {
            assert_eq!(warning_text(young_pa, density), None);
        }
    }

    #[test]
    fn numbers_in_other_units_are_told_with_the_unit() {
        for (young_pa, density, expected) in [
            (210e9, 8.19e-9, "t/mm3, which would be density_kg_m3 = 8190"),
            (210e9, 7.85, "g/cm3, which would be density_kg_m3 = 7850"),
            (
                113_800.0,
                4430.0,
                "MPa (N/mm2), which would be young_pa = 1.138e11",
            ),
            (210.0, 7850.0, "GPa, which would be young_pa = 2.1e11"),
            (1.0, 1.0, "outside of 10 to 30000 kg/m3"),
        ] {
            let told = warning_text(young_pa, density).unwrap();
            assert!(told.contains(expected), "{told}");
        }
    }
}
