//! Mesh error of the stress over a period, at single places.

use super::recovery::NodalField;
use super::stress::{BodyStress, StressCycle, StressError, StressPlace, node_stress};
use crate::fem::stress::nodal_stress_error;
use crate::model::{Model, Strength};

/// Least error of an equivalent stress, relative to the equivalent of the error: two stresses may
/// have the same equivalent by chance.
const LEAST: f64 = 0.5;

impl StressError {
    /// Error of the cycle of the stresses `nodal_pa`, which the stresses `error_pa` correct, both
    /// given as mean, cosine 1, sine 1, ...
    pub fn new(nodal_pa: &[[f64; 6]], error_pa: &[[f64; 6]], strength: Option<Strength>) -> Self {
        let sum = |(s, e): (&[f64; 6], &[f64; 6])| std::array::from_fn(|k| s[k] + e[k]);
        let corrected: Vec<[f64; 6]> = nodal_pa.iter().zip(error_pa).map(sum).collect();
        let [cycle, corrected, of_error] = [nodal_pa, &corrected, error_pa].map(StressCycle::new);
        let error = |figure: fn(&StressCycle) -> f64| {
            let [own, corrected, of_error] = [&cycle, &corrected, &of_error].map(figure);
            (corrected - own).abs().max(LEAST * of_error)
        };
        let mean_pa = error(|cycle| cycle.mean_pa.abs());
        let amplitude_pa = error(|cycle| cycle.amplitude_pa);
        let utilisation = |strength: Strength| {
            let worse = StressCycle {
                mean_pa: cycle.mean_pa + mean_pa,
                amplitude_pa: cycle.amplitude_pa + amplitude_pa,
                ..cycle
            };
            worse.utilisation(strength) - cycle.utilisation(strength)
        };
        Self {
            mean_pa,
            amplitude_pa,
            largest_pa: error(|cycle| cycle.largest_pa),
            utilisation: strength.map(utilisation),
        }
    }
}

/// Estimates the mesh error of places from the motion `motion_m` of the nodes, whose stress is
/// `stress`. `strengths` has an entry for each body. The error of a place with too few elements
/// around it stays `None`.
pub(crate) fn estimate_errors<'p>(
    model: &Model,
    motion_m: &[Vec<NodalField>],
    stress: &[BodyStress],
    strengths: &[Option<Strength>],
    places: impl Iterator<Item = &'p mut StressPlace>,
) {
    for place in places {
        let (b, node) = (place.at.body, place.at.node);
        let fields: Vec<&[[f64; 3]]> = motion_m[b].iter().map(Vec::as_slice).collect();
        let nodal_pa = node_stress(&stress[b].coefficients_pa, node as usize);
        let error_pa = nodal_stress_error(&model.bodies[b], node, &fields, &nodal_pa);
        place.error = error_pa.map(|error_pa| StressError::new(&nodal_pa, &error_pa, strengths[b]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: [f64; 6] = [0.0; 6];

    fn uniaxial(pa: f64) -> [f64; 6] {
        [pa, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    #[test]
    fn errors_of_a_uniaxial_cycle_are_those_of_its_mean_and_amplitude() {
        let strength = Strength {
            endurance_pa: 200.0,
            ultimate_pa: 1000.0,
        };
        let nodal = [uniaxial(100.0), uniaxial(40.0), NONE];
        let error = [uniaxial(-10.0), uniaxial(6.0), NONE];
        let found = StressError::new(&nodal, &error, Some(strength));
        assert!((found.mean_pa - 10.0).abs() < 1e-12);
        assert!((found.amplitude_pa - 6.0).abs() < 1e-5);
        // From 140 to 136 there are 4, and half of the equivalent of the error are 8.
        assert!((found.largest_pa - 8.0).abs() < 1e-5, "{found:?}");
        let utilisation = 6.0 / 200.0 + 10.0 / 1000.0;
        assert!((found.utilisation.unwrap() - utilisation).abs() < 1e-7);
        // In compression only the amplitude counts.
        let pressed = [uniaxial(-100.0), uniaxial(40.0), NONE];
        let found = StressError::new(&pressed, &error, Some(strength));
        assert!((found.utilisation.unwrap() - 6.0 / 200.0).abs() < 1e-7);
    }

    /// A shear that replaces a tension of the same equivalent is an error all the same.
    #[test]
    fn equivalents_that_agree_by_chance_have_an_error() {
        let shear = 100.0 / 3.0_f64.sqrt();
        let error = [-100.0, 0.0, 0.0, shear, 0.0, 0.0];
        let found = StressError::new(&[uniaxial(100.0)], &[error], None);
        assert!((found.mean_pa - LEAST * 100.0 * 2.0_f64.sqrt()).abs() < 1e-9);
        assert_eq!(found.utilisation, None);
    }
}
