//! Verdict on the stability of a motion, which [`crate::stability`] gives.

use faer::c64;
use serde::{Deserialize, Serialize};

/// Stability of a periodic response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// Verdict on the motion.
    pub verdict: Verdict,
    /// Largest Floquet multiplier; of a conjugate pair that above the real axis. `None` where none was
    /// computed, or nothing can move.
    #[serde(with = "parts")]
    pub multiplier: Option<c64>,
}

/// Verdict on a periodic motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// Small perturbations die away.
    Stable,
    /// A small perturbation grows.
    Unstable(Kind),
    /// The motion was not judged.
    NotJudged(Reason),
}

/// Kind of an instability, by the largest multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::Display, Serialize, Deserialize)]
#[strum(serialize_all = "snake_case")]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Real, above 1: the perturbation grows from period to period.
    Real,
    /// Real, below -1: the perturbation changes its sign in each period, and the motion of twice the
    /// period takes over.
    PeriodDoubling,
    /// Complex (Neimark-Sacker): the perturbation has a frequency of its own, which modulates the
    /// motion.
    NeimarkSacker,
}

/// Reason why a motion was not judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// Nobody asked for a verdict.
    #[error("its stability was not asked for")]
    NotAsked,
    /// The balance was not solved.
    #[error("there is no motion")]
    NoMotion,
    /// The harmonics are waves round a disc.
    #[error("the harmonics are waves round a disc")]
    Waves,
    /// The air acts on the blades.
    #[error("the air acts on the blades")]
    Influence,
    /// A multiplier beyond 1 may belong to the drift that the retention of the mean prevents.
    #[error(
        "the mean is retained, and a multiplier beyond 1 may belong to the drift that this prevents"
    )]
    Retained,
    /// The multipliers call the motion unstable, and an integration in time stays on it.
    #[error("its multipliers call it unstable, but an integration in time stays on it")]
    Stays,
    /// Rigid pairs land with much of the kinetic energy: their rebound would decide.
    #[error("rigid pairs open and land with much of the kinetic energy")]
    Landing,
    /// Some displacement has no mass.
    #[error("the mass matrix is singular")]
    Massless,
    /// The monodromy matrix costs more than can be afforded.
    #[error("the model has too many unknowns")]
    TooLarge,
    /// The multipliers were not found.
    #[error("the multipliers were not found")]
    NotFound,
    /// The largest multiplier is nearer to the unit circle than its error, or the motion has too few
    /// harmonics.
    #[error("the largest multiplier is not known well enough: take more harmonics")]
    TooNear,
}

impl Stability {
    /// No verdict, for this reason.
    pub(crate) const fn not_judged(reason: Reason) -> Self {
        Self {
            verdict: Verdict::NotJudged(reason),
            multiplier: None,
        }
    }

    /// `Some(true)` for a stable motion, `Some(false)` for an unstable one, `None` where the motion
    /// was not judged.
    pub fn is_stable(&self) -> Option<bool> {
        match self.verdict {
            Verdict::Stable => Some(true),
            Verdict::Unstable(_) => Some(false),
            Verdict::NotJudged(_) => None,
        }
    }

    /// Kind of the instability of an unstable motion.
    pub fn kind(&self) -> Option<Kind> {
        match self.verdict {
            Verdict::Unstable(kind) => Some(kind),
            Verdict::Stable | Verdict::NotJudged(_) => None,
        }
    }
}

impl Default for Stability {
    /// That of a motion whose stability was not asked for.
    fn default() -> Self {
        Self::not_judged(Reason::NotAsked)
    }
}

/// A multiplier as real and imaginary part.
mod parts {
    use faer::c64;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(value: &Option<c64>, to: S) -> Result<S::Ok, S::Error> {
        value.map(|m| [m.re, m.im]).serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<c64>, D::Error> {
        let parts = Option::<[f64; 2]>::deserialize(from)?;
        Ok(parts.map(|[re, im]| c64::new(re, im)))
    }
}
