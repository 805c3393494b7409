//! Memory that the solution of a frequency takes, known before it begins.

use super::point::MOST_EXACT_UNKNOWNS;
use super::settings::{Resolution, Solver};
use super::sweep::SweepSettings;
use crate::dlft::coarse::Blocks;
use crate::problem::Problem;
use crate::problem::inexact::{ALL_FROM, motions};
use dovetail_numerics::eigen::factor_order;
use dovetail_numerics::spectrum::blocks;

/// Bytes of a number in double and in single precision.
const F64: u64 = 8;
const F32: u64 = 4;
/// Vectors of a balance: the load, the point, its forces and residual, those before, and the work
/// arrays of an iteration.
const VECTORS: u64 = 16;

/// Least number of bytes that a sweep takes where pairs slip: what both halves share, and the
/// frequency that each of them works on. For an accuracy it counts the harmonics that are excited,
/// with which a sweep begins, and none added later.
pub fn bytes(problem: &Problem, settings: &SweepSettings) -> u64 {
    let highest_excited = problem.highest_excited();
    let (harmonics, samples) = match settings.resolution {
        Resolution::Fixed { harmonics, samples } => (harmonics, samples),
        Resolution::Accuracy(_) => {
            let harmonics = highest_excited.max(1);
            (harmonics, Resolution::least_samples(harmonics))
        }
    };
    let size = Size {
        pairs: problem.laws.len() as u64,
        harmonics,
        highest_excited,
    };
    let halves = settings.frequencies_hz.len().clamp(1, 2) as u64;
    let transforms = F64 * samples as u64 * size.width();
    let [shared, each] = match settings.solver {
        Solver::Powell => [size.inexact(), size.dense()],
        Solver::NewtonKrylov if size.unknowns() <= MOST_EXACT_UNKNOWNS as u64 => [0, size.dense()],
        Solver::NewtonKrylov => [size.inexact(), size.krylov()],
    };
    transforms + shared + halves * (each + VECTORS * F64 * size.unknowns())
}

/// Number of pairs, of harmonics, and the highest harmonic that is excited.
#[derive(Clone, Copy)]
struct Size {
    pairs: u64,
    harmonics: usize,
    highest_excited: usize,
}

impl Size {
    /// Number of blocks of a vector.
    fn width(self) -> u64 {
        blocks(self.harmonics) as u64
    }

    /// Number of unknowns of a block.
    fn block(self) -> u64 {
        3 * self.pairs
    }

    fn unknowns(self) -> u64 {
        self.width() * self.block()
    }

    /// Bytes of the Jacobian, factored in place, and of the dynamic stiffness of a harmonic.
    fn dense(self) -> u64 {
        F64 * (self.unknowns().pow(2) + 2 * self.block().pow(2))
    }

    /// Bytes of stiffness, mass and motions of the inner linear solves, and of the factor that
    /// finds the motions.
    fn inexact(self) -> u64 {
        let motions = motions(self.block() as usize) as u64;
        let factor = factor_order(self.block() as usize) as u64;
        F64 * factor.pow(2) + F32 * (self.block().pow(2) / 2 + 4 * motions * self.block())
    }

    /// Bytes of the derivatives of the pairs, in both precisions, for as many pairs as count as
    /// all, and of the coarse problem, its rows and its factor.
    fn krylov(self) -> u64 {
        let active = (ALL_FROM * self.pairs as f64).ceil() as u64;
        let motions = motions(self.block() as usize);
        let coarse = Blocks::new(self.harmonics, self.highest_excited, motions).unknowns() as u64;
        (F64 + F32) * (active * (3 * self.width()).pow(2) + coarse.pow(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::dovetail72::dovetail72;

    fn demand_bytes(harmonics: usize, solver: Solver) -> u64 {
        let resolution = Resolution::fixed(harmonics, 4096);
        let settings = SweepSettings {
            solver,
            ..SweepSettings::new(vec![450.0, 451.0], resolution)
        };
        bytes(&dovetail72(1.0), &settings)
    }

    #[test]
    fn the_jacobian_of_a_frequency_is_asked_for_by_each_half() {
        // 72 pairs, 2001 blocks: the derivative of a pair is 6003 x 6003.
        let pair = 12 * 6003_u64.pow(2);
        let found = demand_bytes(1000, Solver::NewtonKrylov);
        assert!(found > 2 * 18 * pair && found < 2 * 19 * pair, "{found}");
        let unknowns = 216 * 2001_u64;
        let dense = demand_bytes(1000, Solver::Powell);
        assert!(dense > 2 * 8 * unknowns.pow(2), "{dense}");
        // Large flanks need no factor of their stiffness.
        let [small, large] = [1152, 4608].map(|pairs| {
            let size = Size {
                pairs,
                harmonics: 3,
                highest_excited: 1,
            };
            size.inexact() as f64 / (8 * size.block().pow(2)) as f64
        });
        assert!(small > 1.2 && large < 0.5, "{small} {large}");
        // The settings of the paper take little.
        let few = demand_bytes(3, Solver::NewtonKrylov);
        assert!(few < 64 << 20, "{few}");
    }
}
