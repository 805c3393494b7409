//! Mirror of the TOML file for serde. Every key is optional and knows its place in the text.
//!
//! [`super::check`] finds what is absent, out of range or contradictory. Here a value only has to
//! be of the right type, and a key must be one of the fields below.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};
use serde_spanned::Spanned;

/// Key that may be absent; its span is that of the value.
pub type Located<T> = Option<Spanned<T>>;

/// The whole file. Lists of tables are `[[body]]` and so on.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawScene {
    pub name: Located<String>,
    pub reduced_model: Located<RawReducedModel>,
    pub mesh: Located<RawMesh>,
    #[serde(default)]
    pub body: Vec<Spanned<RawBody>>,
    pub rotation: Located<RawRotation>,
    #[serde(default)]
    pub contact: Vec<Spanned<RawContact>>,
    #[serde(default)]
    pub spring: Vec<Spanned<RawSpring>>,
    #[serde(default)]
    pub load: Vec<Spanned<RawLoad>>,
    pub damping: Located<RawDamping>,
    #[serde(default)]
    pub excitation: Vec<Spanned<RawExcitation>>,
    #[serde(default)]
    pub observe: Vec<Spanned<RawObserve>>,
    #[serde(rename = "static")]
    pub static_state: Located<RawStatic>,
    pub response: Located<RawResponse>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawReducedModel {
    pub folder: Located<String>,
    pub friction: Located<Number>,
    pub normal_stiffness_n_m: Located<Number>,
    pub tangential_stiffness_n_m: Located<Number>,
    pub gap_m: Located<Number>,
    pub force_n: Located<Number>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawMesh {
    pub geometry: Located<String>,
    pub parameters: Located<BTreeMap<String, Spanned<Number>>>,
    pub time_limit_s: Located<Number>,
    pub fallback: Located<String>,
    pub fallback_parameters: Located<BTreeMap<String, Spanned<Number>>>,
    pub file: Located<String>,
    pub metres_per_unit: Located<Number>,
    pub units: Located<String>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawBody {
    pub name: Located<String>,
    pub mesh_file: Located<String>,
    pub metres_per_unit: Located<Number>,
    pub units: Located<String>,
    pub copy_of: Located<String>,
    pub rotation_deg: Located<Number>,
    pub rotation_axis: Located<Numbers<3>>,
    pub rotation_point_m: Located<Numbers<3>>,
    pub translation_m: Located<Numbers<3>>,
    pub volume: Located<String>,
    pub material: Located<String>,
    pub young_pa: Located<Number>,
    pub poisson: Located<Number>,
    pub density_kg_m3: Located<Number>,
    pub fixed: Located<Vec<Spanned<String>>>,
    pub fixed_x: Located<Vec<Spanned<String>>>,
    pub fixed_y: Located<Vec<Spanned<String>>>,
    pub fixed_z: Located<Vec<Spanned<String>>>,
    pub fixed_interface_modes: Located<Count>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawRotation {
    pub axis: Located<Numbers<3>>,
    pub point_m: Located<Numbers<3>>,
    pub speed_rpm: Located<Number>,
    pub bodies: Located<Vec<Spanned<String>>>,
    pub prestress: Located<String>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawContact {
    pub name: Located<String>,
    pub first: Located<String>,
    pub second: Located<String>,
    pub slave: Located<String>,
    pub law: Located<String>,
    pub friction: Located<Number>,
    pub normal_stiffness_n_m3: Located<Number>,
    pub tangential_stiffness_n_m3: Located<Number>,
    pub gap: Located<String>,
    pub gap_m: Located<Number>,
    pub search_distance_m: Located<Number>,
    pub crown_radius_m: Located<Number>,
    pub crown_axis: Located<Numbers<3>>,
    pub crown_centre_m: Located<Numbers<3>>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawSpring {
    pub name: Located<String>,
    pub first: Located<String>,
    pub second: Located<String>,
    pub stiffness_n_m: Located<Number>,
    pub direction: Located<Numbers<3>>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawLoad {
    pub on: Located<String>,
    pub force_n: Located<Number>,
    pub traction_pa: Located<Number>,
    pub direction: Located<Numbers<3>>,
    pub pressure_pa: Located<Number>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawDamping {
    pub ratio: Located<Number>,
    pub linear_mode: Located<Count>,
    pub stiffness_s: Located<Number>,
    pub mass_per_s: Located<Number>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawExcitation {
    pub on: Located<String>,
    pub force_n: Located<Number>,
    pub traction_pa: Located<Number>,
    pub direction: Located<Numbers<3>>,
    pub pressure_pa: Located<Number>,
    pub file: Located<String>,
    pub factor: Located<Number>,
    pub base_acceleration_m_s2: Located<Number>,
    pub base_displacement_m: Located<Number>,
    pub harmonic: Located<Count>,
    pub phase_deg: Located<Number>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawObserve {
    pub name: Located<String>,
    pub points: Located<String>,
    pub direction: Located<Numbers<3>>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawStatic {
    pub load_steps: Located<Count>,
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawResponse {
    pub frequency_hz: Located<Numbers<2>>,
    pub times_first_linear_mode: Located<Numbers<2>>,
    pub points: Located<Count>,
    pub accuracy: Located<Number>,
    pub harmonics: Located<Count>,
    pub compare_harmonics: Located<Count>,
    pub samples: Located<Count>,
    pub eps: Located<String>,
    pub eps_scale: Located<Number>,
    pub tolerance: Located<Number>,
    pub max_newton_iterations: Located<Count>,
    pub most_seconds_per_frequency: Located<Number>,
    pub solver: Located<String>,
    pub stuck_modes: Located<Count>,
    pub slip_threshold_m: Located<Number>,
}

/// Finite number, written as a TOML float or integer.
#[derive(Debug, Clone, Copy)]
pub struct Number(pub f64);

/// Whole number, 0 or more.
#[derive(Debug, Clone, Copy)]
pub struct Count(pub usize);

/// List of exactly `N` finite numbers.
#[derive(Debug, Clone, Copy)]
pub struct Numbers<const N: usize>(pub [f64; N]);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberVisitor;
        impl Visitor<'_> for NumberVisitor {
            type Value = Number;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a finite number")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Number, E> {
                if v.is_finite() {
                    Ok(Number(v))
                } else {
                    Err(E::invalid_value(de::Unexpected::Float(v), &self))
                }
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Number, E> {
                Ok(Number(v as f64))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Number, E> {
                Ok(Number(v as f64))
            }
        }
        deserializer.deserialize_any(NumberVisitor)
    }
}

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct CountVisitor;
        impl Visitor<'_> for CountVisitor {
            type Value = Count;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a whole number, 0 or more")
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Count, E> {
                usize::try_from(v)
                    .map(Count)
                    .map_err(|_| E::invalid_value(de::Unexpected::Signed(v), &self))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Count, E> {
                usize::try_from(v)
                    .map(Count)
                    .map_err(|_| E::invalid_value(de::Unexpected::Unsigned(v), &self))
            }
        }
        deserializer.deserialize_any(CountVisitor)
    }
}

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumbersVisitor<const N: usize>;
        impl<'de, const N: usize> Visitor<'de> for NumbersVisitor<N> {
            type Value = Numbers<N>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                write!(f, "a list of {N} finite numbers")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Numbers<N>, A::Error> {
                let mut values = [0.0; N];
                for (i, value) in values.iter_mut().enumerate() {
                    match seq.next_element::<Number>()? {
                        Some(Number(v)) => *value = v,
                        None => return Err(de::Error::invalid_length(i, &self)),
                    }
                }
                let mut extra = 0;
                while seq.next_element::<de::IgnoredAny>()?.is_some() {
                    extra += 1;
                }
                if extra > 0 {
                    return Err(de::Error::invalid_length(N + extra, &self));
                }
                Ok(Numbers(values))
            }
        }
        deserializer.deserialize_any(NumbersVisitor)
    }
}
