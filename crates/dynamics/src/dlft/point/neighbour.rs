//! A converged frequency, from which the next one starts.

use crate::dlft::Orbit;
use crate::dlft::retention::Mean;

/// Converged frequency, from which the next one starts.
#[derive(Debug, Clone, serde::Serialize)]
pub(crate) struct Neighbour {
    pub frequency_hz: f64,
    pub u: Vec<f64>,
    /// dU/df towards the frequency before, m/Hz; `None` unless that has the same mean (free or
    /// retained).
    pub slope: Option<Vec<f64>>,
    /// Treatment of the mean along the motions that only friction holds.
    pub mean: Mean,
}

impl Neighbour {
    /// Neighbour of a frequency with a motion; `before` is the one before it.
    pub(crate) fn from_orbit(orbit: &Orbit, before: Option<&Self>) -> Self {
        let u = orbit.x.clone();
        Self::following(before, orbit.frequency_hz, u, orbit.mean)
    }

    /// Neighbour of a converged frequency; `last` is the one before it.
    pub(crate) fn following(
        last: Option<&Self>,
        frequency_hz: f64,
        u: Vec<f64>,
        mean: Mean,
    ) -> Self {
        let slope = last.filter(|l| l.mean == mean).map(|l| {
            let step = frequency_hz - l.frequency_hz;
            let before = resized(&l.u, u.len());
            u.iter().zip(&before).map(|(u, v)| (u - v) / step).collect()
        });
        Self {
            frequency_hz,
            u,
            slope: slope.filter(|s: &Vec<f64>| s.iter().all(|v| v.is_finite())),
            mean,
        }
    }

    /// U continued to `frequency_hz`, and U as it is, of `unknowns` entries each. Further harmonics
    /// are zero.
    pub(super) fn starts(&self, frequency_hz: f64, unknowns: usize) -> Vec<Vec<f64>> {
        let step = frequency_hz - self.frequency_hz;
        let continued = self.slope.as_ref().map(|slope| {
            let ends = self.u.iter().zip(slope);
            ends.map(|(u, s)| u + step * s).collect()
        });
        let starts = continued.into_iter().chain([self.u.clone()]);
        starts.map(|u| resized(&u, unknowns)).collect()
    }
}

/// Returns U with `entries` entries: missing harmonics are zero, further ones are dropped.
pub(crate) fn resized(u: &[f64], entries: usize) -> Vec<f64> {
    let mut u = u[..u.len().min(entries)].to_vec();
    u.resize(entries, 0.0);
    u
}
