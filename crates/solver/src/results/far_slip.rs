//! Distance that pairs slide, relative to the size of their flanks. Node-to-node contact assumes
//! that the two nodes of a pair face each other all the time, which holds while they slide much
//! less than the flank is wide.

use super::pairs::PairTable;
use crate::dlft::{Orbit, Outcome, Response, StaticState};
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::space::extent;
use dovetail_numerics::spectrum::Spectrum;

/// Fraction of the shorter side of a flank beyond which a slide deserves a warning.
pub const FAR: f64 = 0.05;
/// Fraction beyond which a solution is not accepted ([`Outcome::SlidesTooFar`]).
pub const TOO_FAR: f64 = 0.2;

/// Number of instants of a period at which the slide of a pair is evaluated.
const INSTANTS: usize = 64;

/// Shorter side of the flank of each pair, m; `None` where directions are unknown or a flank has
/// only one row of pairs.
#[derive(Debug, Clone)]
pub struct ShorterSides(Vec<Option<f64>>);

impl ShorterSides {
    /// Shorter sides of the extents of the pairs of each contact along the tangential directions of
    /// its first pair.
    pub fn new(pairs: &PairTable) -> Self {
        let of_contact = |contact: usize| {
            let contact_rows = || pairs.rows.iter().filter(|row| row.contact == contact);
            let [_, t1, t2] = contact_rows().next()?.frame?;
            let side = |t: [f64; 3]| {
                extent(contact_rows().map(|row| (0..3).map(|a| t[a] * row.position_m[a]).sum()))
            };
            Some(side(t1).min(side(t2))).filter(|side| *side > 0.0)
        };
        let sides: Vec<Option<f64>> = (0..pairs.contacts.len()).map(of_contact).collect();
        Self(pairs.rows.iter().map(|row| sides[row.contact]).collect())
    }

    /// Shorter side of the flank of a pair, m.
    pub(crate) fn pair_side_m(&self, pair: usize) -> Option<f64> {
        self.0[pair]
    }

    /// Largest ratio of |X_T| of a motion (2H+1 blocks, harmonic-major) to the shorter side of its
    /// flank.
    pub(crate) fn farthest(&self, x: &[f64], harmonics: usize) -> f64 {
        let x = Spectrum::new(x, harmonics);
        let fourier = Fourier::new(harmonics, INSTANTS.max(4 * harmonics + 4));
        let mut signals = [(); 2].map(|()| vec![0.0; fourier.samples()]);
        let mut farthest = 0.0_f64;
        for (pair, side) in self.0.iter().enumerate() {
            let Some(side) = side else { continue };
            for (signal, component) in signals.iter_mut().zip([1, 2]) {
                let coefficients: Vec<f64> = x.signal_coefficients(3 * pair + component).collect();
                fourier.to_time(&coefficients, signal);
            }
            let [along, across] = &signals;
            let lengths = along.iter().zip(across).map(|(a, b)| a.hypot(*b));
            farthest = farthest.max(lengths.fold(0.0, f64::max) / side);
        }
        farthest
    }

    /// Returns `Self::farthest` of the static state and the points of its load path. The outcome
    /// becomes [`Outcome::SlidesTooFar`] beyond [`TOO_FAR`], at the first such point.
    pub fn judge_static(&self, state: &mut StaticState) -> f64 {
        let (mut farthest, points) = (0.0_f64, state.on_path.len());
        for (point, x) in state.on_path.iter().chain([&state.x]).enumerate() {
            let slide = self.farthest(x, 0);
            farthest = farthest.max(slide);
            let is_first = state.outcome.is_converged() && slide > TOO_FAR;
            if is_first && point < points {
                state.ended_at = Some(point);
            }
            judge(&mut state.outcome, slide);
        }
        farthest
    }

    /// Judges each frequency in the same way. Returns the largest value of those with a motion.
    pub fn judge_response(&self, response: &mut Response) -> f64 {
        let orbits = response.orbits.iter_mut();
        let farthest = orbits.map(|orbit| {
            let farthest = self.judge_orbit(orbit);
            if orbit.outcome.has_motion() {
                farthest
            } else {
                0.0
            }
        });
        farthest.fold(0.0, f64::max)
    }

    /// Judges one frequency in the same way.
    pub(crate) fn judge_orbit(&self, orbit: &mut Orbit) -> f64 {
        let farthest = self.farthest(&orbit.x, orbit.harmonics);
        judge(&mut orbit.outcome, farthest);
        farthest
    }
}

fn judge(outcome: &mut Outcome, farthest: f64) {
    if outcome.has_motion() && farthest > TOO_FAR {
        *outcome = Outcome::SlidesTooFar;
    }
}

#[cfg(test)]
mod tests {
    use super::super::pairs::PairRow;
    use super::*;
    use crate::problem::LinearReference;
    use crate::reduced::ReducedModel;
    use faer::Mat;

    /// Two flanks of 2 x 2 pairs, 40 mm by 4 mm and, turned by 45 degrees, 10 mm by 8 mm.
    fn pairs() -> PairTable {
        let c = 0.5_f64.sqrt();
        let frames = [
            [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            [[0.0, c, c], [1.0, 0.0, 0.0], [0.0, c, -c]],
        ];
        let mut rows = Vec::new();
        for (contact, (frame, sides)) in frames
            .into_iter()
            .zip([[0.04, 0.004], [0.01, 0.008]])
            .enumerate()
        {
            for (i, j) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                let [_, t1, t2] = frame;
                rows.push(PairRow {
                    contact,
                    position_m: [0, 1, 2].map(|a| i * sides[0] * t1[a] + j * sides[1] * t2[a]),
                    frame: Some(frame),
                    area_m2: None,
                    gap_m: 0.0,
                    friction: 0.3,
                });
            }
        }
        PairTable {
            contacts: vec!["flat".into(), "turned".into()],
            nodes: vec![],
            rows,
        }
    }

    #[test]
    fn each_point_of_a_load_path_is_judged_as_its_end_is() {
        let sides = ShorterSides::new(&pairs());
        let slid = |share: f64| {
            let mut x = vec![0.0; 3 * 8];
            x[3 * 5 + 2] = share * 8e-3;
            x
        };
        for (on_path, end, outcome, ended_at) in [
            ([0.1, 0.1], 0.1, Outcome::Converged, None),
            ([0.1, 0.3], 0.1, Outcome::SlidesTooFar, Some(1)),
            ([0.3, 0.4], 0.5, Outcome::SlidesTooFar, Some(0)),
            ([0.1, 0.1], 0.3, Outcome::SlidesTooFar, None),
        ] {
            let mut state = StaticState {
                outcome: Outcome::Converged,
                x: slid(end),
                lambda: vec![0.0; 3 * 8],
                status: Vec::new(),
                newton_iterations: 0,
                residual: 0.0,
                retention_n: None,
                linear: LinearReference::stuck(&ReducedModel::from_pair_matrices(
                    Mat::identity(3, 3),
                    Mat::identity(3, 3),
                )),
                on_path: on_path.map(slid).to_vec(),
                ended_at: None,
            };
            let farthest = sides.judge_static(&mut state);
            assert_eq!((state.outcome, state.ended_at), (outcome, ended_at));
            let most = on_path.into_iter().fold(end, f64::max);
            assert!((farthest / most - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_farthest_slide_is_counted_in_shorter_sides() {
        let sides = ShorterSides::new(&pairs());
        let n = 3 * 8;
        // The mean of pair 5 along t2, and around it a circle of pair 5.
        let mut x = vec![0.0; 3 * n];
        x[3 * 5 + 2] = 0.3e-3;
        x[n + 3 * 5 + 1] = 0.1e-3;
        x[2 * n + 3 * 5 + 2] = 0.1e-3;
        assert!((sides.farthest(&x, 1) / (0.4e-3 / 8e-3) - 1.0).abs() < 1e-12);
        // Normal displacements are no slide.
        x[3 * 2] = 1.0;
        assert!((sides.farthest(&x, 1) / (0.4e-3 / 8e-3) - 1.0).abs() < 1e-12);
        x[3 * 2 + 1] = 1e-3;
        assert!((sides.farthest(&x, 1) / 0.25 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_unknown_is_not_judged() {
        let mut pairs = pairs();
        pairs.rows.iter_mut().for_each(|row| row.frame = None);
        assert_eq!(ShorterSides::new(&pairs).farthest(&[1.0; 24], 0), 0.0);
    }
}
