//! Rayleigh damping C = a K + b M.

/// Rayleigh damping C = stiffness_s K + mass_per_s M.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub enum DampingSpec {
    /// Both coefficients, given directly.
    Rayleigh {
        /// Coefficient a, s.
        stiffness_s: f64,
        /// Coefficient b, 1/s.
        mass_per_s: f64,
    },
    /// Stiffness-proportional damping that gives this ratio of critical on one mode of the
    /// [linear reference](crate::problem::LinearReference) (1 = first).
    Ratio {
        /// Ratio of critical damping.
        ratio: f64,
        /// Number of the mode, counted from 1.
        linear_mode: usize,
    },
}

/// No damping.
impl Default for DampingSpec {
    fn default() -> Self {
        Self::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: 0.0,
        }
    }
}

impl DampingSpec {
    /// Ratio of critical damping on the first linear mode.
    ///
    /// ```
    /// use dovetail_dynamics::damping::DampingSpec;
    ///
    /// let two_per_mille = DampingSpec::ratio(0.002);
    /// assert!(matches!(two_per_mille, DampingSpec::Ratio { linear_mode: 1, .. }));
    /// ```
    pub const fn ratio(ratio: f64) -> Self {
        let linear_mode = 1;
        Self::Ratio { ratio, linear_mode }
    }
}

/// Coefficients of C = `stiffness_s` K + `mass_per_s` M.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Rayleigh {
    /// Coefficient a, s.
    pub stiffness_s: f64,
    /// Coefficient b, 1/s.
    pub mass_per_s: f64,
}

impl Rayleigh {
    /// No damping.
    pub const NONE: Self = Self::stiffness_proportional(0.0);

    /// Damping of these coefficients, in s and in 1/s.
    pub const fn new(stiffness_s: f64, mass_per_s: f64) -> Self {
        Self {
            stiffness_s,
            mass_per_s,
        }
    }

    /// Damping proportional to the stiffness, with the coefficient in s.
    pub const fn stiffness_proportional(stiffness_s: f64) -> Self {
        Self::new(stiffness_s, 0.0)
    }

    /// Damping proportional to the mass, with the coefficient in 1/s.
    pub const fn mass_proportional(mass_per_s: f64) -> Self {
        Self::new(0.0, mass_per_s)
    }

    /// Damping proportional to the stiffness that has a ratio to critical damping at the angular
    /// frequency `omega_rad_s`.
    ///
    /// ```
    /// use dovetail_dynamics::damping::Rayleigh;
    ///
    /// assert_eq!(Rayleigh::from_damping_ratio(0.01, 100.0).stiffness_s, 2e-4);
    /// ```
    pub const fn from_damping_ratio(ratio: f64, omega_rad_s: f64) -> Self {
        Self::stiffness_proportional(2.0 * ratio / omega_rad_s)
    }
}

/// Frequency of a mode, and the part of it that strains the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalStiffness {
    /// Squared angular frequency, rad2/s2.
    pub omega2: f64,
    /// Stiffness of the bodies alone in the mode, without springs of contacts, for a unit modal mass,
    /// rad2/s2.
    pub bodies_omega2: f64,
}

impl ModalStiffness {
    /// Mode in which nothing but the bodies is strained, of this squared angular frequency, rad2/s2.
    #[cfg(test)]
    const fn from_omega2(omega2: f64) -> Self {
        Self {
            omega2,
            bodies_omega2: omega2,
        }
    }
}

/// Least part of the stiffness of a mode that is the bodies' where a ratio can be reached through
/// them. What is less is rounding.
const LEAST_STRAINED: f64 = 1e-9;

/// Error of a damping without coefficients.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum DampingError {
    #[error(
        "damping.linear_mode = {asked}, but the linear assembly has {available} modes: choose 1 to {available}, or keep more response.stuck_modes"
    )]
    NoSuchMode { asked: usize, available: usize },
    #[error(
        "damping.ratio is that of a mode, and this model has none: give damping.stiffness_s or damping.mass_per_s instead"
    )]
    NoModes,
    #[error(
        "damping.modal_ratios has {given} values, but the model has {available} stuck modes: give no more than these, or keep more response.stuck_modes"
    )]
    FewerModes { given: usize, available: usize },
    #[error(
        "damping.ratio is reached by damping of the bodies' stiffness, but linear mode {mode} strains only springs of contacts: choose another damping.linear_mode, or give damping.mass_per_s instead"
    )]
    StrainsNoBody { mode: usize },
}

/// Coefficients from the scene. A ratio may be given for one of the modes `linear`. A ratio zeta of
/// critical on mode k is reached by damping that is proportional to the stiffness of the bodies, with
/// a = 2 zeta omega_k / s_k: s_k is that stiffness in the mode, omega_k^2 where no springs of contacts
/// take part.
///
/// # Errors
/// A mode that does not exist (modes count from 1), or that strains no body.
pub fn rayleigh(spec: &DampingSpec, linear: &[ModalStiffness]) -> Result<Rayleigh, DampingError> {
    match *spec {
        DampingSpec::Rayleigh {
            stiffness_s,
            mass_per_s,
        } => Ok(Rayleigh::new(stiffness_s, mass_per_s)),
        DampingSpec::Ratio { ratio, linear_mode } => {
            let missing = match linear.len() {
                0 => DampingError::NoModes,
                available => DampingError::NoSuchMode {
                    asked: linear_mode,
                    available,
                },
            };
            let mode = linear_mode.checked_sub(1).ok_or_else(|| missing.clone())?;
            let &ModalStiffness {
                omega2,
                bodies_omega2,
            } = linear.get(mode).ok_or(missing)?;
            let strained = bodies_omega2 / omega2;
            if strained < LEAST_STRAINED {
                return Err(DampingError::StrainsNoBody { mode: linear_mode });
            }
            Ok(Rayleigh::from_damping_ratio(
                ratio / strained,
                omega2.sqrt(),
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coefficients of 1 % of critical damping on a mode.
    fn one_percent_damping(linear_mode: usize, omega2: &[f64]) -> Result<Rayleigh, DampingError> {
        let ratio = 0.01;
        let linear: Vec<_> = omega2
            .iter()
            .copied()
            .map(ModalStiffness::from_omega2)
            .collect();
        rayleigh(&DampingSpec::Ratio { ratio, linear_mode }, &linear)
    }

    #[test]
    fn the_ratio_is_reached_on_the_chosen_mode() {
        let c = one_percent_damping(2, &[4.0, 25.0]).unwrap();
        // zeta = (a omega + b / omega) / 2
        assert!((0.5 * (c.stiffness_s * 5.0 + c.mass_per_s / 5.0) - 0.01).abs() < 1e-16);
        let given = DampingSpec::Rayleigh {
            stiffness_s: 1e-6,
            mass_per_s: 3.0,
        };
        let c = rayleigh(&given, &[]).unwrap();
        assert_eq!((c.stiffness_s, c.mass_per_s), (1e-6, 3.0));
    }

    /// A mode whose stiffness is 9 rad2/s2 of the bodies and 16 rad2/s2 of springs.
    #[test]
    fn springs_of_contacts_are_not_damped() {
        let ratio = DampingSpec::ratio(0.01);
        let partly = |bodies_omega2| ModalStiffness {
            omega2: 25.0,
            bodies_omega2,
        };
        let c = rayleigh(&ratio, &[partly(9.0)]).unwrap();
        assert!((c.stiffness_s * 9.0 / (2.0 * 5.0) - 0.01).abs() < 1e-16);
        let none = DampingError::StrainsNoBody { mode: 1 };
        assert_eq!(rayleigh(&ratio, &[partly(1e-12)]), Err(none));
    }

    #[test]
    fn a_mode_that_does_not_exist_is_an_error() {
        for linear_mode in [0, 3] {
            let error = one_percent_damping(linear_mode, &[4.0, 25.0]).unwrap_err();
            assert!(error.to_string().contains("choose 1 to 2"));
        }
        assert_eq!(one_percent_damping(1, &[]), Err(DampingError::NoModes));
    }
}
