//! Detects implausible materials of blades: their numbers are mostly in another unit.

use std::ops::RangeInclusive;

use dovetail_solver::model::Material;

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

/// Message about an implausible material of a body, with the unit that the number is probably in;
/// `None` if the material is plausible.
pub(super) fn doubt(name: &str, material: Material) -> Option<String> {
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
        return Some(format!(
            "body \"{}\": a density of {density_kg_m3} kg/m3 is outside of {} to {} kg/m3{meant}; one that is meant to give \
             the body another mass is as good",
            name,
            DENSITIES.start(),
            DENSITIES.end()
        ));
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
    Some(format!(
        "body \"{}\": young_pa = {young_pa} and density_kg_m3 = {density_kg_m3} give waves of {own:.3e} m/s, outside of \
         {} to {} m/s{meant}; a density that is meant to give the body another mass is as good",
        name,
        WAVE_SPEEDS.start(),
        WAVE_SPEEDS.end()
    ))
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

    fn told(young_pa: f64, density_kg_m3: f64) -> Option<String> {
        let material = Material {
            young_pa,
            poisson: 0.3,
            density_kg_m3,
        };
        doubt("blade", material)
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
            assert_eq!(told(young_pa, density), None);
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
            let told = told(young_pa, density).unwrap();
            assert!(told.contains(expected), "{told}");
        }
    }
}
