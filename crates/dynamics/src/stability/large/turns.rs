//! Reversals that rigid pairs pass at once, without sticking: what moves them on exceeds friction. A
//! perturbation v of the velocity changes there as the acceleration does.

use super::super::passage::Passage;
use super::GAMMA;
use crate::dlft::{CycleStatus, Orbit};
use crate::problem::Problem;
use dovetail_numerics::dense::Lu;
use dovetail_numerics::fourier::Fourier;
use faer::Mat;
use std::sync::OnceLock;

/// Reversal that a pair passes at once.
pub(super) struct PassedTurn {
    /// Sample after it.
    pub(super) sample: usize,
    /// Direction, unit.
    pub(super) along: [f64; 2],
    /// Resistance to the velocity in this direction, integrated over the reversal, N s/m per s/m.
    pub(super) impulse_n_s_m: f64,
}

/// Accelerations of pairs by forces.
pub(super) struct Mobility<'a> {
    problem: &'a Problem,
    orbit: &'a Orbit,
    /// `None` if the mass is singular.
    inverse: OnceLock<Option<InverseMass>>,
}

/// Inverse of the mass on the displacements that move and on the modes.
struct InverseMass {
    matrix: Mat<f64>,
    /// Row of each displacement.
    places: Vec<Option<usize>>,
}

impl<'a> Mobility<'a> {
    pub(super) const fn new(problem: &'a Problem, orbit: &'a Orbit) -> Self {
        Self {
            problem,
            orbit,
            inverse: OnceLock::new(),
        }
    }

    /// Finds the reversals that a pair passes at once, and lets it slip there.
    pub(super) fn turns(
        &self,
        passage: &mut Passage,
        pair: usize,
        fourier: &Fourier,
    ) -> Vec<PassedTurn> {
        let law = &self.problem.laws[pair];
        if law.stiffness.is_some() || law.computed_friction() == 0.0 {
            return Vec::new();
        }
        let samples = passage.contact.len();
        let mut passed = Vec::new();
        for turn in passage.turns(law, self.orbit, pair, fourier) {
            // What else moves makes a pair lighter, and it sticks the more.
            let needs = |mobility: f64| {
                let free = turn.acceleration + mobility * turn.force_n;
                [-1.0, 1.0].map(|sign| free + sign * mobility * turn.limit_n)
            };
            let mass = &self.problem.reduced.mass;
            let own = product_of(mass, [3 * pair + 1, 3 * pair + 2], turn.along);
            if own > 0.0 && needs(1.0 / own)[1] >= 0.0 {
                continue;
            }
            let Some(mobility) = self.mobility(pair, turn.along) else {
                continue;
            };
            let [before, after] = needs(mobility);
            if before < 0.0 && after < 0.0 {
                passage.pass_at_once(&turn);
                passed.push(PassedTurn {
                    sample: (turn.at + 1) % samples,
                    along: turn.along,
                    impulse_n_s_m: decay_to(after / before) / mobility,
                });
            }
        }
        passed
    }

    /// Acceleration of a pair by a force of 1 N along a tangential direction, 1/kg.
    fn mobility(&self, pair: usize, along: [f64; 2]) -> Option<f64> {
        let inverse = self.inverse.get_or_init(|| self.inverted()).as_ref()?;
        let [t1, t2] = [1, 2].map(|c| inverse.places[3 * pair + c]);
        Some(product_of(&inverse.matrix, [t1?, t2?], along))
    }

    /// Inverse mass on the displacements that move, without normal ones of rigid contact.
    fn inverted(&self) -> Option<InverseMass> {
        let reduced = &self.problem.reduced;
        let moves = |i: &usize| {
            let is_rigid = self.problem.laws[i / 3].stiffness.is_none();
            match self.orbit.cycles[i / 3].status {
                CycleStatus::Open => true,
                CycleStatus::Stuck => !is_rigid,
                _ => !is_rigid || !i.is_multiple_of(3),
            }
        };
        let free: Vec<usize> = (0..reduced.mass.nrows()).filter(moves).collect();
        let mut places = vec![None; reduced.mass.nrows()];
        for (i, number) in free.iter().enumerate() {
            places[*number] = Some(i);
        }
        let [_, mass] = reduced.full_matrices(&free);
        let size = mass.nrows();
        let factor = Lu::new(mass);
        if factor.is_singular() {
            return None;
        }
        let mut matrix = Mat::identity(size, size);
        factor.solve_in_place(matrix.as_mut());
        Some(InverseMass { matrix, places })
    }
}

/// Product z of rate and length of a step that leaves this share of a decaying motion:
/// `(1 - (1 - 2 gamma) z) / (1 + gamma z)^2`.
fn decay_to(share: f64) -> f64 {
    let [a, b] = [
        share * GAMMA * GAMMA,
        2.0 * share * GAMMA + 1.0 - 2.0 * GAMMA,
    ];
    let c = 1.0 - share;
    2.0 * c / (b + (b * b + 4.0 * a * c).sqrt())
}

/// Quadratic form of a matrix on two unknowns.
fn product_of(matrix: &Mat<f64>, at: [usize; 2], along: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for (i, e) in at.into_iter().zip(along) {
        for (j, f) in at.into_iter().zip(along) {
            sum += e * matrix[(i, j)] * f;
        }
    }
    sum
}
