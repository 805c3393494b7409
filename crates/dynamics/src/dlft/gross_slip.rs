//! Ratio of the distance that pairs would slide if nothing rubbed to the distance that friction
//! deforms them.
//!
//! Bodies slide as a whole where it is large. Each reversal of friction is then a step in time that
//! is as wide as the elastic displacement mu N / eps: Newton's method does not find it, and the
//! motion hardly depends on it.

use super::balance::{Balance, Setting, gather};
use super::dense::MOST_DENSE_UNKNOWNS;
use crate::problem::tangential;
use dovetail_numerics::dense::Lu;
use dovetail_numerics::spectrum::{cosine, sine};
use dovetail_numerics::vector::norm;
use faer::{Mat, c64};

/// Ratio above which bodies slide as a whole.
pub(crate) const GROSS_SLIP: f64 = 1e5;

/// Motion of each pair along the contact at `omega`, rad/s, without friction and without lift-off,
/// as the norm of its harmonics, m. Empty where there are too many pairs for a balance of one
/// harmonic to have exact corrections.
pub(crate) fn free_slips_m(setting: &Setting, omega: f64) -> Vec<f64> {
    let pairs = setting.system.problem.laws.len();
    if 3 * setting.system.unknowns() > MOST_DENSE_UNKNOWNS {
        return vec![];
    }
    let balance = Balance::new(setting, omega);
    let x = frictionless_vibration(&balance);
    let width = setting.fourier.width();
    let pair_values = |pair| gather(&x, balance.unknowns_per_block(), pair, width);
    (0..pairs).map(|pair| norm(&pair_values(pair))).collect()
}

/// Ratio of the largest of [`free_slips_m`] to the mean elastic displacement under friction, mu N /
/// eps. 0 where nothing rubs, and where the free slips are not known.
pub(crate) fn slides_past(setting: &Setting, free_slips_m: &[f64]) -> f64 {
    let pairs = &setting.system.problem.laws;
    let count = pairs.len() as f64;
    let friction = pairs.iter().map(|p| p.computed_friction()).sum::<f64>() / count;
    let limit_n = friction * setting.pressing_n / count;
    if limit_n <= 0.0 {
        return 0.0;
    }
    let along = setting.eps.iter().skip(1).step_by(3);
    let forces_n = along.zip(free_slips_m).map(|(eps, slip)| eps * slip);
    forces_n.fold(0.0, f64::max) / limit_n
}

/// Vibration where nothing rubs and nothing lifts off, as U: Lambda_TT X_T = F_T of the harmonics
/// that are excited.
fn frictionless_vibration(balance: &Balance) -> Vec<f64> {
    let n = balance.unknowns_per_block();
    let along = tangential(n);
    let mut out = vec![0.0; balance.force.len()];
    for k in 1..=balance.stiffness.harmonics() {
        let [cosine, sine] = [cosine(k) * n, sine(k) * n];
        let of = |i: &usize| c64::new(balance.force[cosine + i], -balance.force[sine + i]);
        let mut x: Vec<c64> = along.iter().map(of).collect();
        if x.iter().all(|f| *f == c64::new(0.0, 0.0)) {
            continue;
        }
        let [re, im] = balance.stiffness.formed(k);
        let matrix = Mat::from_fn(along.len(), along.len(), |i, j| {
            let at = (along[i], along[j]);
            c64::new(re[at], im[at])
        });
        Lu::new(matrix).solve_column_in_place(&mut x);
        for (i, x) in along.iter().zip(&x) {
            (out[cosine + i], out[sine + i]) = (x.re, -x.im);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::frozen::FrozenContacts;
    use crate::dlft::jacobians::{OMEGA_RAD_S, sample_points};
    use crate::dlft::pair_signals::Periods;
    use crate::dlft::retention::Mean;
    use crate::dlft::{PairStatus, made_up};
    use crate::problem::LinearReference;
    use crate::problem::dynamic_stiffness::ContactSystem;
    use crate::problem::inexact::InexactModel;
    use crate::reduced::ReducedModel;
    use dovetail_numerics::fourier::Fourier;

    #[test]
    fn without_friction_nothing_acts_along_the_contact_and_nothing_lifts_off() {
        for (_, balance, _) in &sample_points() {
            let x = frictionless_vibration(balance);
            let n = balance.unknowns_per_block();
            let mut forces = vec![0.0; x.len()];
            balance.apply_stiffness(&x, &mut forces);
            let mut moves = false;
            for i in n..x.len() {
                if i % n % 3 == 0 {
                    assert_eq!(x[i], 0.0);
                } else {
                    let load = balance.force[i];
                    assert!(
                        (forces[i] - load).abs() < 1e-9 * norm(&balance.force),
                        "{i}"
                    );
                    moves |= x[i] != 0.0;
                }
            }
            assert!(moves);
        }
    }

    #[test]
    fn pairs_slide_past_the_elastic_displacement_of_the_mean_limit_of_friction() {
        for (_, balance, _) in &sample_points() {
            let free_slips_m = free_slips_m(&balance.setting, OMEGA_RAD_S);
            let setting = Setting {
                pressing_n: 6.0,
                ..balance.setting.clone()
            };
            let pairs = &setting.system.problem.laws;
            let count = pairs.len() as f64;
            let friction: f64 = pairs.iter().map(|p| p.friction).sum::<f64>() / count;
            let x = frictionless_vibration(&Balance::new(&setting, OMEGA_RAD_S));
            let n = 3 * pairs.len();
            let mut farthest = 0.0_f64;
            for pair in 0..pairs.len() {
                let own = (n..x.len()).filter(|i| i % n / 3 == pair);
                let moved_m = own.map(|i| x[i].powi(2)).sum::<f64>().sqrt();
                farthest = farthest.max(moved_m * setting.eps[3 * pair + 2]);
            }
            let expected = farthest / (friction * 6.0 / count);
            assert!((slides_past(&setting, &free_slips_m) / expected - 1.0).abs() < 1e-12);
            let unpressed = Setting {
                pressing_n: 0.0,
                ..setting.clone()
            };
            assert_eq!(slides_past(&unpressed, &free_slips_m), 0.0);
            assert_eq!(slides_past(&setting, &[]), 0.0);
        }
    }
    /// One harmonic has three blocks: 1998 unknowns for 222 pairs, 2007 for 223.
    #[test]
    fn of_more_pairs_than_have_exact_corrections_no_free_slips_are_known() {
        let known = |pairs: usize| {
            let mut problem = made_up::mass_with_a_stop(1.0);
            let n = 3 * pairs;
            let all = |v: &[f64]| v.iter().copied().cycle().take(n).collect::<Vec<f64>>();
            problem.laws = vec![problem.laws[0]; pairs];
            let excitation = &mut problem.excitations[0];
            for load in [&mut excitation.cosine, &mut excitation.sine] {
                load.on_x = all(&load.on_x);
            }
            problem.reduced =
                ReducedModel::from_pair_matrices(Mat::identity(n, n), Mat::identity(n, n)).into();
            let system = ContactSystem::new(&problem, made_up::DAMPING).into();
            let linear = LinearReference::stuck(&problem.reduced);
            let setting = Setting {
                frozen: FrozenContacts::new(&linear, &system).into(),
                system,
                inexact: InexactModel::unprepared(&problem.reduced).into(),
                fourier: Fourier::new(1, 4).into(),
                eps: vec![1.0; n].into(),
                x_static: vec![0.0; n].into(),
                lambda_static: vec![0.0; n].into(),
                at_rest: vec![PairStatus::Stuck; pairs].into(),
                static_mean: Mean::Free,
                pressing_n: 1.0,
                periods: Periods::UntilPeriodic,
                slip_threshold_m: 0.0,
                free_slips_m: [].into(),
            };
            free_slips_m(&setting, OMEGA_RAD_S).len()
        };
        assert_eq!([2, 223].map(known), [2, 0]);
    }
}
