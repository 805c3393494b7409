//! Comparison of two motions at one frequency.

use super::Orbit;
use dovetail_numerics::spectrum::blocks;

/// Two motions with as many harmonics are the same where they differ by less than this fraction.
const SAME: f64 = 1e-4;

impl Orbit {
    /// Returns `true` if two motions have the same vibration: that of what is observed, or that of
    /// the pairs where nothing is. Means may differ, which pairs that stick leave open. Motions with
    /// different numbers of harmonics may differ by their estimated errors.
    pub fn has_same_vibration(&self, other: &Self) -> bool {
        if !self.outcome.has_motion() || !other.outcome.has_motion() {
            return false;
        }
        let error = if self.harmonics == other.harmonics {
            SAME
        } else {
            let errors = [self, other].map(|orbit| orbit.estimated_error.unwrap_or(0.0));
            errors[0].max(errors[1]).max(SAME)
        };
        if self.observed.is_empty() {
            let of_pairs = |orbit: &'_ Self| orbit.x.len() / blocks(orbit.harmonics);
            return is_near(&self.x, &other.x, of_pairs(self), error);
        }
        let observed = self.observed.iter().zip(&other.observed);
        observed.into_iter().all(|(a, b)| is_near(a, b, 1, error))
    }
}

/// Returns `true` if the coefficients behind the first `mean` of two series differ by less than this
/// fraction of the first series.
fn is_near(a: &[f64], b: &[f64], mean: usize, error: f64) -> bool {
    let size = |squares: &mut dyn Iterator<Item = f64>| squares.sum::<f64>();
    let moved = size(&mut a.iter().zip(b).skip(mean).map(|(a, b)| (a - b).powi(2)));
    let whole = size(&mut a.iter().skip(mean).map(|a| a * a));
    moved <= error * error * whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::Outcome;

    #[test]
    fn motions_are_the_same_where_their_vibrations_are() {
        let orbit = |mean: f64, cosine: f64, error: f64, harmonics: usize| {
            let mut series = vec![mean, cosine, 0.0];
            series.resize(blocks(harmonics), 0.0);
            Orbit {
                harmonics,
                observed: vec![series],
                estimated_error: Some(error),
                ..Orbit::motionless(100.0, Outcome::Converged)
            }
        };
        let one = orbit(1.0, 2.0, 0.01, 1);
        assert!(one.has_same_vibration(&orbit(5.0, 2.0001, 0.01, 1)));
        assert!(!one.has_same_vibration(&orbit(1.0, 2.01, 0.01, 1)));
        assert!(one.has_same_vibration(&orbit(1.0, 2.01, 0.01, 3)));
        assert!(!one.has_same_vibration(&orbit(1.0, 2.03, 0.01, 3)));
        let failed = Orbit {
            outcome: Outcome::Stagnated,
            ..one.clone()
        };
        assert!(!failed.has_same_vibration(&failed));
        // Without observations the pairs count.
        let pair = |mean: f64, cosine: f64| Orbit {
            observed: Vec::new(),
            x: vec![mean, mean, cosine, cosine, 0.0, 0.0],
            ..one.clone()
        };
        assert!(pair(0.0, 1.0).has_same_vibration(&pair(9.0, 1.0)));
        assert!(!pair(0.0, 1.0).has_same_vibration(&pair(0.0, 1.1)));
    }
}
