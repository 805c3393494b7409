//! Unilateral contact with Coulomb friction (circular cone), at one instant of one pair. The trial
//! force, with which the pair would stick, gives the contact force (Nacivet et al. 2003, equations
//! 20-26).

use dovetail_numerics::dual::{Real, two};

/// Status of a pair at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Contact {
    /// Stick: the contact force is the trial force.
    Stick,
    /// Slip: the tangential force is at its limit.
    Slip,
    /// Open: there is no force.
    Open,
}

/// Contact force for the trial force `(N, t1, t2)`, N; compression is negative.
///
/// * `trial_N >= 0`: open, no force;
/// * `|trial_T| < mu |trial_N| - touch_n`: stick, the trial force itself;
/// * otherwise slip: a force on the cone along [`slip_direction`]. `rate` is the rate of the
///   tangential trial force at this instant, N per step, asked for here alone; without it the force
///   points along the trial force.
#[inline(always)]
pub(crate) fn unilateral_coulomb<D: Real>(
    trial: [D; 3],
    rate: impl FnOnce() -> Option<[D; 2]>,
    friction: f64,
    touch_n: f64,
) -> (Contact, [D; 3]) {
    let zero = D::from(0.0);
    let [normal, t1, t2] = trial;
    if normal.re() >= 0.0 {
        return (Contact::Open, [zero; 3]);
    }
    let limit = normal * -friction;
    let squared = t1 * t1 + t2 * t2;
    let inside = limit.re() - touch_n;
    if inside > 0.0 && squared.re() < inside * inside {
        return (Contact::Stick, trial);
    }
    if squared.re() == 0.0 {
        return (Contact::Slip, [normal, zero, zero]);
    }
    let (direction, size) = match rate() {
        Some(rate) => slip_direction([t1, t2], rate, limit, squared),
        None => ([t1, t2], squared.sqrt()),
    };
    let scale = limit / size;
    let [f1, f2] = two(|c| direction[c] * scale);
    (Contact::Slip, [normal, f1, f2])
}

/// Vector along the friction force at the end of a step in which a pair slips, N2, and its length.
/// `limit` is R, the limit of friction, `squared` the square of the length of the trial force t.
///
/// Friction turns towards the velocity: with the rate r of the trial force, N per step, the angle a
/// of the force satisfies `R da = r across(a)`. The vector `2 R t + (|t| - R) r` solves this to second
/// order in the step. It is exact where r turns evenly, whether the force follows it at once
/// (`|r| >> R`) or slowly. A step leaves 1 / (1 + q + q^2 / 2) of a deviation, `q = |r| / R`. A part
/// of r against t does not count: the pair slips although it turns back, because its limit falls.
#[inline(always)]
fn slip_direction<D: Real>(trial: [D; 2], rate: [D; 2], limit: D, squared: D) -> ([D; 2], D) {
    let tangential = squared.sqrt();
    let by_rate = tangential - limit;
    let along = trial[0] * rate[0] + trial[1] * rate[1];
    let mut by_trial = limit * 2.0;
    if along.re() < 0.0 {
        by_trial = by_trial - by_rate * along / squared;
    }
    let [d1, d2] = two(|c| trial[c] * by_trial + rate[c] * by_rate);
    let size = d1 * d1 + d2 * d2;
    // It vanishes with the limit, where any direction serves.
    if size.re() == 0.0 {
        return (trial, tangential);
    }
    ([d1, d2], size.sqrt())
}

/// Length of a tangential force. (Forces are far from overflow: `hypot` would cost a sixth of a
/// run.)
#[inline(always)]
pub(crate) fn length<D: Real>(t1: D, t2: D) -> D {
    (t1 * t1 + t2 * t2).sqrt()
}

/// Derivative of the force of a pair that slips, which stays on its cone along e:
/// `d lambda_T = by_normal d p_N + across (by_trial . d t + by_rate . d r)`, with the trial force
/// (p_N, t) and its rate r.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlipTangent {
    /// Direction of the force e, unit (zero where the trial force has no tangential part).
    pub direction: [f64; 2],
    /// Direction across the force, unit or zero.
    pub across: [f64; 2],
    /// Derivative by the normal trial force.
    pub by_normal: [f64; 2],
    /// Derivative of the part across by the tangential trial force.
    pub by_trial: [f64; 2],
    /// Derivative of the part across by the rate of the tangential trial force.
    pub by_rate: [f64; 2],
}

/// Derivative of [`unilateral_coulomb`] where the pair slips.
#[inline(always)]
pub(crate) fn slip_tangent(trial: [f64; 3], rate: Option<[f64; 2]>, friction: f64) -> SlipTangent {
    let [normal, t1, t2] = trial;
    let (trial, limit) = ([t1, t2], -friction * normal);
    let squared = t1 * t1 + t2 * t2;
    if squared == 0.0 {
        return SlipTangent {
            direction: [0.0; 2],
            across: [0.0; 2],
            by_normal: [0.0; 2],
            by_trial: [0.0; 2],
            by_rate: [0.0; 2],
        };
    }
    let (vector, size) = match rate {
        Some(rate) => slip_direction(trial, rate, limit, squared),
        None => (trial, squared.sqrt()),
    };
    let over_size = 1.0 / size;
    let direction = vector.map(|v| v * over_size);
    let across = [-direction[1], direction[0]];
    let turn = limit * over_size;
    let by_limit = direction.map(|e| -friction * e);
    let Some(rate) = rate else {
        return SlipTangent {
            direction,
            across,
            by_normal: by_limit,
            by_trial: across.map(|a| turn.min(1.0) * a),
            by_rate: [0.0; 2],
        };
    };
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let tangential = squared.sqrt();
    let excess = tangential - limit;
    let unit = trial.map(|t| t / tangential);
    let along = dot(unit, rate);
    // Rate that counts, and the derivatives of its part across by the rate and by the trial force.
    let (counted, by_rate, by_unit) = if along < 0.0 {
        let beside = [-unit[1], unit[0]];
        let (across_unit, across_beside) = (dot(across, unit), dot(across, beside));
        let by_angle = -along * across_beside - dot(rate, beside) * across_unit;
        (
            [0, 1].map(|c| rate[c] - along * unit[c]),
            beside.map(|b| across_beside * b),
            beside.map(|b| by_angle * b / tangential),
        )
    } else {
        (rate, across, [0.0; 2])
    };
    // The vector depends on the limit and on the size of the trial force through its two factors.
    let [across_trial, across_rate] = [dot(across, trial), dot(across, counted)];
    let by_factor = turn * (2.0 * across_trial - across_rate);
    let by_size = turn * across_rate;
    SlipTangent {
        direction,
        across,
        by_normal: [0, 1].map(|c| by_limit[c] - friction * by_factor * across[c]),
        by_trial: [0, 1]
            .map(|c| turn * (2.0 * limit * across[c] + excess * by_unit[c]) + by_size * unit[c]),
        by_rate: by_rate.map(|r| turn * excess * r),
    }
}

/// Fraction w of a way at which the trial force `from + step w` of a closed pair leaves the cone,
/// at most `last`. It begins on the cone where the pair slips.
#[inline(always)]
pub(crate) fn leaves_cone<D: Real>(
    from: [D; 3],
    step: [D; 3],
    friction: f64,
    slips: bool,
    last: D,
) -> D {
    let zero = D::from(0.0);
    // The cone's equation along the way, a + b w + c w^2 with a <= 0.
    let mu2 = friction * friction;
    let (a, b, c) = (
        form(from, from, mu2),
        form(from, step, mu2) * 2.0,
        form(step, step, mu2),
    );
    let way = if slips || a.re() >= 0.0 {
        if b.re() >= 0.0 { zero } else { -b / c }
    } else {
        let under = b * b - a * c * 4.0;
        if under.re() <= 0.0 {
            return last;
        }
        let root = under.sqrt();
        if b.re() >= 0.0 {
            a * -2.0 / (b + root)
        } else {
            (root - b) / (c * 2.0)
        }
    };
    if way.re() >= 0.0 && way.re() < last.re() {
        way
    } else {
        last
    }
}

/// Bilinear form of the cone, whose quadratic form is negative inside.
#[inline(always)]
fn form<D: Real>(p: [D; 3], q: [D; 3], mu2: f64) -> D {
    p[1] * q[1] + p[2] * q[2] - p[0] * q[0] * mu2
}

/// Returns `true` if a force on the cone goes into the cone with this step.
#[inline(always)]
pub(crate) fn turns_inward(force: [f64; 3], step: [f64; 3], friction: f64) -> bool {
    let [normal, t1, t2] = [0, 1, 2].map(|c| force[c] * step[c]);
    t1 + t2 < friction * friction * normal
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::differences::central;

    #[test]
    fn force_stays_on_or_inside_the_cone_and_never_pulls() {
        for i in 0..2000 {
            let p = [
                (i as f64).sin(),
                (i as f64 * 1.3).cos(),
                (i as f64 * 0.7).sin() * 2.0,
            ];
            let (state, f) = unilateral_coulomb(p, || None, 0.3, 0.0);
            assert!(f[0] <= 0.0);
            assert!(f[1].hypot(f[2]) <= -0.3 * f[0] * (1.0 + 1e-15));
            match state {
                Contact::Open => assert!(p[0] >= 0.0 && f == [0.0; 3]),
                Contact::Stick => assert_eq!(f, p),
                Contact::Slip => {
                    assert!((f[1].hypot(f[2]) + 0.3 * f[0]).abs() < 1e-15);
                    assert!(
                        (f[1] * p[2] - f[2] * p[1]).abs() < 1e-15,
                        "along the trial force"
                    );
                }
            }
        }
    }

    #[test]
    fn what_touches_the_cone_slips_and_what_is_not_pressed_is_open() {
        for (trial, contact) in [
            ([-1.0, 0.5, 0.0], Contact::Slip),
            ([-1.0, 0.0, 0.0], Contact::Stick),
            ([0.0, 0.0, 0.0], Contact::Open),
        ] {
            assert_eq!(unilateral_coulomb(trial, || None, 0.5, 0.0).0, contact);
        }
        // Without friction nothing sticks.
        let (contact, force) = unilateral_coulomb([-1.0, 0.0, 0.0], || None, 0.0, 0.0);
        assert_eq!((contact, force), (Contact::Slip, [-1.0, 0.0, 0.0]));
    }

    /// Friction force across and along `e` for inputs N, t1, t2, r1, r2.
    fn slip_force(input: &[f64]) -> Vec<f64> {
        let [n, t1, t2, r1, r2] = *input else {
            panic!("{input:?}")
        };
        let (contact, force) = unilateral_coulomb([n, t1, t2], || Some([r1, r2]), 0.4, 0.0);
        assert_eq!(contact, Contact::Slip);
        force.to_vec()
    }

    #[test]
    fn slip_tangent_is_the_derivative() {
        // The rate goes along with the trial force, across it, and against it.
        for rate in [[1.3, -0.2], [-0.6, -1.9], [-0.9, 0.4]] {
            let input = [-2.0, 0.9, -1.4, rate[0], rate[1]];
            let found = central(&input, 1e-6, slip_force);
            let tangent = slip_tangent([-2.0, 0.9, -1.4], Some(rate), 0.4);
            for c in 0..2 {
                let a = tangent.across[c];
                let exact = [
                    tangent.by_normal[c],
                    a * tangent.by_trial[0],
                    a * tangent.by_trial[1],
                    a * tangent.by_rate[0],
                    a * tangent.by_rate[1],
                ];
                for (by, exact) in exact.into_iter().enumerate() {
                    let off = found[(c + 1, by)] - exact;
                    assert!(off.abs() < 1e-9, "{rate:?}: {c} by {by}: {off}");
                }
            }
            let plain = slip_tangent([-2.0, 0.9, -1.4], None, 0.4);
            assert_eq!(plain.by_rate, [0.0; 2]);
        }
    }

    /// Angle of the force, from that of the pull, after steps of a straight pull over `slip_n` under
    /// a limit of friction of 1 N, which it begins at 1.2 rad.
    fn angle_after(slip_n: f64, steps: usize) -> f64 {
        let pull = slip_n / steps as f64;
        let mut force = [1.2_f64.cos(), 1.2_f64.sin()];
        for _ in 0..steps {
            let trial = [-1.0, force[0] + pull, force[1]];
            let (_, [_, f1, f2]) = unilateral_coulomb(trial, || Some([pull, 0.0]), 1.0, 0.0);
            force = [f1, f2];
        }
        force[1].atan2(force[0])
    }

    #[test]
    fn friction_turns_into_a_straight_pull_as_its_closed_form() {
        // Under constant pressure tan(a / 2) = tan(a_0 / 2) exp(-slip k / (mu N)).
        let exact = 2.0 * ((0.6_f64).tan() * (-1.5_f64).exp()).atan();
        let errors = [16, 32, 64, 128].map(|steps| (angle_after(1.5, steps) - exact).abs());
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((3.5..4.6).contains(&ratio), "{errors:?}");
        }
        assert!(errors[0] < 1e-3, "{errors:?}");
    }

    #[test]
    fn friction_forgets_its_direction_however_far_the_pair_slides_in_a_step() {
        // Share of a deviation that one step leaves, for steps of 1e-3 to 1e7 times the limit.
        for exponent in -3..=7 {
            let pull = 10.0_f64.powi(exponent);
            let tangent = slip_tangent([-1.0, 1.0 + pull, 0.0], Some([pull, 0.0]), 1.0);
            let kept = tangent.by_trial[1];
            let expected = 1.0 / (1.0 + pull + 0.5 * pull * pull);
            assert!(
                (kept / expected - 1.0).abs() < 1e-9,
                "{pull}: {kept} {expected}"
            );
        }
    }

    #[test]
    fn friction_on_a_line_keeps_its_sense_whatever_the_rate() {
        for rate in [-1e6, -1.0, 0.0, 1.0, 1e6] {
            for limit in [0.0, 1e-300, 0.3, 1.0] {
                let trial = [-1.0, 1.0, 0.0];
                let (_, force) = unilateral_coulomb(trial, || Some([rate, 0.0]), limit, 0.0);
                assert!(
                    (force[1] - limit).abs() <= 1e-15 && force[2] == 0.0,
                    "{rate} {limit}"
                );
            }
        }
    }
}
