//! Modes of a body on which the air acts, and the coefficients of its influence in each wave.

use super::{BladeInfluence, Cyclic, InfluenceSource, InfluenceSpec, ModelError};
use dovetail_dynamics::reduced::InfluenceCoefficient;
use dovetail_dynamics::reduced::influence::canonical_nodal_diameter;

/// Influence on one of the bodies of these names, of a disc of so many sectors. `read` are the
/// coefficients of the file that it names.
pub(super) fn influence(
    spec: &InfluenceSpec,
    sectors: usize,
    names: &[String],
    read: Option<&[InfluenceCoefficient]>,
) -> Result<BladeInfluence, ModelError> {
    let body = match &spec.body {
        Some(name) => names.iter().position(|other| other == name),
        None => (names.len() == 1).then_some(0),
    };
    let body = body.ok_or_else(|| match &spec.body {
        Some(name) => ModelError::UnknownBody {
            used_by: "[cyclic], influence_on".to_owned(),
            name: name.clone(),
            available: names.to_vec(),
        },
        None => ModelError::InfluenceOnNone {
            available: names.to_vec(),
        },
    })?;
    let coefficients = match &spec.coefficients {
        InfluenceSource::Given(coefficients) => coefficients,
        InfluenceSource::File(path) => {
            read.ok_or_else(|| ModelError::InfluenceMissing { path: path.clone() })?
        }
    };
    let largest = (sectors / 2) as i64;
    let mut modes = Vec::new();
    let mut waves = Vec::new();
    for coefficient in coefficients {
        let wave = coefficient.nodal_diameter;
        if !(-largest..=largest).contains(&wave) {
            return Err(ModelError::InfluenceOfNoWave {
                nodal_diameter: wave,
                largest,
            });
        }
        modes.extend([coefficient.mode, coefficient.by_mode]);
        waves.push(canonical_nodal_diameter(wave, sectors));
    }
    modes.sort_unstable();
    modes.dedup();
    waves.sort_unstable();
    waves.dedup();
    Ok(BladeInfluence {
        body,
        modes,
        waves,
        coefficients: coefficients.to_vec(),
    })
}

impl Cyclic {
    /// Checks that the wave of the first harmonic has coefficients where the air acts on the blades.
    ///
    /// # Errors
    /// [`ModelError::InfluenceLacksWave`].
    pub fn check_influence(&self) -> Result<(), ModelError> {
        let excited = self.excitation().signed_nodal_diameter(1);
        match &self.influence {
            Some(influence) if !influence.waves.contains(&excited) => {
                Err(ModelError::InfluenceLacksWave {
                    nodal_diameter: excited,
                    engine_order: self.engine_order,
                    given: influence.waves.clone(),
                })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coefficients of these nodal diameters, of mode 2 by mode 1.
    fn wave_coefficients(waves: &[i64]) -> InfluenceSource {
        let coefficient = |nodal_diameter: &i64| InfluenceCoefficient {
            nodal_diameter: *nodal_diameter,
            mode: 2,
            by_mode: 1,
            real_n_m: 1.0,
            imaginary_n_m: 0.0,
        };
        InfluenceSource::Given(waves.iter().map(coefficient).collect())
    }

    fn bind_influence(
        body: Option<&str>,
        engine_order: usize,
        waves: &[i64],
    ) -> Result<BladeInfluence, String> {
        let spec = InfluenceSpec {
            body: body.map(str::to_owned),
            coefficients: wave_coefficients(waves),
        };
        let names = ["disc", "blade"].map(str::to_owned);
        let found = influence(&spec, 6, &names, None).map_err(|error| error.to_string())?;
        let disc = Cyclic {
            sectors: 6,
            ties: Vec::new(),
            matches: Vec::new(),
            largest_mismatch_m: 0.0,
            spacing_m: f64::INFINITY,
            point_m: [0.0; 3],
            turn: [[0.0; 3]; 3],
            engine_order,
            influence: Some(found.clone()),
        };
        disc.check_influence().map_err(|error| error.to_string())?;
        Ok(found)
    }

    /// An excitation that stands still runs backwards past the sectors: engine order 1 excites -1,
    /// and engine order 5 of 6 sectors excites 1.
    #[test]
    fn the_wave_that_the_engine_order_excites_has_coefficients() {
        for (engine_order, wave) in [
            (1, -1),
            (2, -2),
            (3, 3),
            (3, -3),
            (4, 2),
            (5, 1),
            (6, 0),
            (7, -1),
        ] {
            let found = bind_influence(Some("blade"), engine_order, &[wave]).unwrap();
            assert_eq!((found.body, found.modes), (1, vec![1, 2]), "{engine_order}");
        }
        let error = bind_influence(Some("blade"), 1, &[1, 0]).unwrap_err();
        assert!(error.contains("nodal diameter -1"), "{error}");
        assert!(error.contains("0, 1"), "{error}");
    }

    #[test]
    fn a_wave_that_there_is_not_and_a_body_that_there_is_not_are_errors() {
        let error = bind_influence(Some("blade"), 1, &[-1, 4]).unwrap_err();
        assert!(error.contains("-3 to 3"), "{error}");
        let error = bind_influence(Some("vane"), 1, &[-1]).unwrap_err();
        assert!(
            error.contains("`vane`") && error.contains("disc"),
            "{error}"
        );
        let error = bind_influence(None, 1, &[-1]).unwrap_err();
        assert!(
            error.contains("influence_on") && error.contains("blade"),
            "{error}"
        );
    }
}
