//! Harmonic excitations of a reduced model, each a multiple of one of its unit loads.

use serde::{Deserialize, Serialize};

/// Harmonic excitation: `amplitude cos(harmonic omega t - phase_rad)` times a unit load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Excitation {
    /// Factor on the unit load.
    pub amplitude: f64,
    /// Multiple of the frequency of the response.
    pub harmonic: usize,
    /// Phase lag behind the cosine.
    pub phase_rad: f64,
    /// Dependence on the frequency.
    pub growth: Growth,
}

impl Excitation {
    /// Excitation of constant size in phase with the cosine of harmonic 1.
    ///
    /// ```
    /// use dovetail_dynamics::excitation::{Excitation, Growth};
    ///
    /// let third = Excitation { harmonic: 3, ..Excitation::cosine(2.0) };
    /// assert_eq!((third.amplitude, third.growth), (2.0, Growth::Constant));
    /// ```
    pub const fn cosine(amplitude: f64) -> Self {
        Self {
            amplitude,
            harmonic: 1,
            phase_rad: 0.0,
            growth: Growth::Constant,
        }
    }
}

/// Dependence of a harmonic load on its own frequency, `harmonic` times the frequency of the response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Growth {
    /// The load is the same at all frequencies.
    Constant,
    /// The load grows with the square of the angular frequency; it is given at 1 rad/s.
    Squared,
}

/// Excitation of a reduced model that is stored, with its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedExcitation {
    /// Name, for the reader of the folder.
    pub name: String,
    /// Multiple of the frequency of the response.
    pub harmonic: usize,
    /// Factor on the unit load.
    pub amplitude: f64,
    /// Phase lag behind the cosine.
    pub phase_rad: f64,
    /// True if the load grows with the square of its angular frequency and is given at 1 rad/s.
    #[serde(default)]
    pub grows_with_squared_frequency: bool,
}

impl NamedExcitation {
    /// Excitation with a name.
    pub fn new(name: impl Into<String>, excitation: Excitation) -> Self {
        Self {
            name: name.into(),
            harmonic: excitation.harmonic,
            amplitude: excitation.amplitude,
            phase_rad: excitation.phase_rad,
            grows_with_squared_frequency: excitation.growth == Growth::Squared,
        }
    }

    /// Force cos(w t).
    pub fn cosine(name: impl Into<String>) -> Self {
        Self::new(name, Excitation::cosine(1.0))
    }
}

impl From<&NamedExcitation> for Excitation {
    fn from(named: &NamedExcitation) -> Self {
        Self {
            amplitude: named.amplitude,
            harmonic: named.harmonic,
            phase_rad: named.phase_rad,
            growth: match named.grows_with_squared_frequency {
                true => Growth::Squared,
                false => Growth::Constant,
            },
        }
    }
}
