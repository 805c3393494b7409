//! Time evaluation of a pair under a law without corners, as a way to solutions of the law itself.
//!
//! The normal force is N = (p_N - sqrt(p_N^2 + w^2)) / 2 of the prediction p_N, which tends to the
//! law, min(p_N, 0), as the width w shrinks. The tangential force is L h(|p| / L) along the
//! prediction p, with the limit L = mu |N| and h(r) = r / (1 + r^q)^(1/q), which tends to the law,
//! min(r, 1), as the sharpness q grows. There are no corners where friction sets in or a pair lifts
//! off, and a pair forgets where it began: it creeps under any force. Newton's method finds the
//! motion at a small q from far away, and follows it as q grows.

use super::derivative_rows::{DerivativeSignals, Square, identity_state, solve_memory};
use super::pair_signals::{PERIODICITY, PairInput, Rounding, Signals, add_own};
use crate::contact::coulomb::length;
use dovetail_numerics::fourier::Fourier;

/// Most periods evaluated; each but the first begins where Newton's method expects the periodic
/// state. Where so many do not suffice, more hardly ever do.
const MOST_PERIODS: usize = 12;

/// Rounded law at one instant.
struct Rounded {
    /// Contact force, N.
    force: [f64; 3],
    /// Derivative of the tangential force by the tangential prediction.
    by_tangential: Square,
    /// Derivative of the normal force by the normal prediction.
    normal_by_normal: f64,
    /// Derivative of the tangential force by the normal prediction.
    by_normal: [f64; 2],
}

#[inline(always)]
fn rounded(predicted: [f64; 3], friction: f64, rounding: Rounding) -> Rounded {
    let Rounding { sharpness, width_n } = rounding;
    let [prediction, t1, t2] = predicted;
    let root = (prediction * prediction + width_n * width_n).sqrt();
    // The same number by sums of one sign.
    let (normal, normal_by_normal) = if prediction > 0.0 {
        let by_width = 0.5 * width_n / (prediction + root);
        (-by_width * width_n, by_width * width_n / root)
    } else if root > 0.0 {
        (0.5 * (prediction - root), 0.5 * (1.0 - prediction / root))
    } else {
        (0.0, 0.0)
    };
    let limit = -friction * normal;
    let size = length(t1, t2);
    if limit == 0.0 || size == 0.0 {
        let same = if limit > 0.0 { 1.0 } else { 0.0 };
        return Rounded {
            force: [normal, 0.0, 0.0],
            by_tangential: [[same, 0.0], [0.0, same]],
            normal_by_normal,
            by_normal: [0.0; 2],
        };
    }
    let ratio = size / limit;
    // h / r, and h'.
    let (share, slope) = if ratio > 1.0 {
        let part = ratio.powf(-sharpness);
        let share = (1.0 + part).powf(-1.0 / sharpness) / ratio;
        (share, share * part / (1.0 + part))
    } else {
        let rest = 1.0 + ratio.powf(sharpness);
        let share = rest.powf(-1.0 / sharpness);
        (share, share / rest)
    };
    let e = [t1 / size, t2 / size];
    let along = |i: usize, j: usize| {
        let unit = if i == j { share } else { 0.0 };
        unit + (slope - share) * e[i] * e[j]
    };
    let by_limit = ratio * (share - slope);
    Rounded {
        force: [normal, share * t1, share * t2],
        by_tangential: [[along(0, 0), along(0, 1)], [along(1, 0), along(1, 1)]],
        normal_by_normal,
        by_normal: e.map(|e| -friction * by_limit * normal_by_normal * e),
    }
}

/// Law at sample `n`, and lambda_x (tangential) after it, from that before it, N.
#[inline(always)]
fn sample_law(
    n: usize,
    input: &PairInput<'_>,
    signals: &Signals,
    rounding: Rounding,
    [x1, x2]: [f64; 2],
) -> (Rounded, [f64; 2]) {
    let [normal, t1, t2] = signals.prediction(n, input.law.shift_n);
    let law = rounded([normal, t1 - x1, t2 - x2], input.law.friction, rounding);
    let after = [t1 - law.force[1], t2 - law.force[2]];
    (law, after)
}

/// One period of a pair.
struct March {
    /// lambda_x (tangential) at the start, N.
    start: [f64; 2],
    /// lambda_x (tangential) at the end, N.
    state: [f64; 2],
    /// Derivative of the end by the start.
    memory: Square,
}

fn one_period(
    input: &PairInput<'_>,
    signals: &Signals,
    rounding: Rounding,
    start: [f64; 2],
) -> March {
    let (mut state, mut memory) = (start, [[1.0, 0.0], [0.0, 1.0]]);
    for n in 0..signals.samples() {
        let (law, after) = sample_law(n, input, signals, rounding, state);
        state = after;
        memory = product(law.by_tangential, memory);
    }
    March {
        start,
        state,
        memory,
    }
}

/// Last period evaluated, and whether it is periodic.
fn periodic(input: &PairInput<'_>, signals: &Signals, rounding: Rounding) -> (March, bool) {
    let scale = signals.lambda_u.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut start = input.start.slid_n;
    let mut periods = 0;
    loop {
        let march = one_period(input, signals, rounding, start);
        let moved = [0, 1].map(|c| march.state[c] - march.start[c]);
        periods += 1;
        let is_periodic = moved[0].hypot(moved[1]) <= PERIODICITY * scale;
        if is_periodic || periods == MOST_PERIODS {
            return (march, is_periodic);
        }
        let step = solve_memory(march.memory, moved).unwrap_or(moved);
        start = [0, 1].map(|c| march.start[c] + step[c]);
    }
}

/// Writes the contact forces of a period into `signals`, whose predicted forces are given. Returns
/// `true` if they are periodic.
pub(crate) fn contact_forces(
    input: &PairInput<'_>,
    rounding: Rounding,
    signals: &mut Signals,
) -> bool {
    let (march, is_periodic) = periodic(input, signals, rounding);
    let samples = signals.samples();
    let mut state = march.start;
    for n in 0..samples {
        let (law, after) = sample_law(n, input, signals, rounding, state);
        for (c, force) in law.force.iter().enumerate() {
            signals.lambda[c * samples + n] = *force;
        }
        state = after;
    }
    is_periodic
}

/// Derivative of the force over the periodic period.
pub(crate) fn derivative_rows(
    fourier: &Fourier,
    input: &PairInput<'_>,
    rounding: Rounding,
    signals: &Signals,
) -> DerivativeSignals {
    let (samples, width, block) = (fourier.samples(), fourier.width(), fourier.padded_width());
    let full = 3 * block;
    let (march, _) = periodic(input, signals, rounding);
    let mut history = identity_state(width, block);
    let mut rows = vec![0.0; (block + 2 * full) * samples];
    let mut state = march.start;
    for (n, row) in rows.chunks_exact_mut(block + 2 * full).enumerate() {
        let s = fourier.padded_row(n);
        let (law, after) = sample_law(n, input, signals, rounding, state);
        let (normal, force) = row.split_at_mut(block);
        let slope = law.normal_by_normal;
        normal.iter_mut().zip(s).for_each(|(n, s)| *n = slope * s);
        // d force = B (S - history) + b S_N.
        let (h1, h2) = history.split_at(full);
        for (i, force) in force.chunks_exact_mut(full).enumerate() {
            let [b1, b2] = law.by_tangential[i];
            for (f, (h1, h2)) in force.iter_mut().zip(h1.iter().zip(h2)) {
                *f = -b1 * h1 - b2 * h2;
            }
            for (c, by) in [law.by_normal[i], b1, b2].into_iter().enumerate() {
                let pair_forces = force[c * block..(c + 1) * block].iter_mut();
                pair_forces.zip(s).for_each(|(f, s)| *f += by * s);
            }
        }
        history.iter_mut().zip(&*force).for_each(|(h, f)| *h = -f);
        add_own(s, &mut history);
        state = after;
    }
    DerivativeSignals {
        signals: rows,
        normal_changes: Vec::new(),
        end: Some(history),
    }
}

fn product(a: Square, b: Square) -> Square {
    let at = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]
}
