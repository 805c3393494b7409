//! Conversion of a solved harmonic balance to the [`Orbit`]: modal amplitudes, observed motion,
//! pair cycles, powers.

use super::balance::{Balance, Evaluation, Setting};
use super::{CycleStatus, Landing, LinearPoint, Orbit, Outcome, PairCycle, PairStatus};
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::problem::unforced::Unforced;
use crate::reduced::{Load, ObservedPoint, ReducedModel};
use dovetail_numerics::dense::quadratic_forms;
use dovetail_numerics::spectrum::{blocks, cosine, sine};
use dovetail_numerics::vector::dot;
use faer::{Mat, c64};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Number of instants at which the largest departure from the mean is looked for.
const AMPLITUDE_INSTANTS: usize = 720;

/// Builds the orbit of U. Number, `residual` and iteration counts are left at zero for the caller.
pub fn orbit(
    balance: &Balance,
    u: &[f64],
    evaluation: &Evaluation,
    frequency_hz: f64,
    outcome: Outcome,
) -> Orbit {
    let Setting {
        system, fourier, ..
    } = &balance.setting;
    let motion = motion(system, fourier.harmonics(), u, frequency_hz);
    add_pair_motion(motion, balance, u, evaluation, outcome)
}

/// Builds the orbit of a converged vibration without a force, in which the tracked mode has this
/// amplitude at harmonic 1. No power is put in.
pub(crate) fn unforced_orbit(
    balance: &Balance,
    u: &[f64],
    evaluation: &Evaluation,
    unforced: &Unforced<'_>,
    tracked_amplitude: f64,
) -> Orbit {
    let Setting {
        system, fourier, ..
    } = &balance.setting;
    let harmonics = fourier.harmonics();
    let modal = modal_amplitudes_by(system, harmonics, u, |k, x| {
        unforced.modal_amplitudes(k, x, tracked_amplitude)
    });
    let frequency_hz = unforced.omega_rad_s / TAU;
    let motion = Orbit {
        input_power_w: 0.0,
        ..motion_of(system, harmonics, u, modal, frequency_hz)
    };
    add_pair_motion(motion, balance, u, evaluation, Outcome::Converged)
}

/// Adds what the pairs do to an orbit.
fn add_pair_motion(
    motion: Orbit,
    balance: &Balance,
    u: &[f64],
    evaluation: &Evaluation,
    outcome: Outcome,
) -> Orbit {
    let cycles = pair_cycles(balance, u, evaluation, motion.frequency_hz);
    Orbit {
        outcome,
        x: u.to_vec(),
        lambda: evaluation.lambda.clone(),
        friction_power_w: cycles.iter().map(|c| c.friction_power_w).sum(),
        cycles,
        mean: balance.mean(),
        retention_n: balance.retention_n(u),
        ..motion
    }
}

/// Cycle of each pair in a motion.
pub(crate) fn pair_cycles(
    balance: &Balance,
    u: &[f64],
    evaluation: &Evaluation,
    frequency_hz: f64,
) -> Vec<PairCycle> {
    (0..balance.unknowns_per_block() / 3)
        .into_par_iter()
        .with_min_len(16)
        .map(|pair| pair_cycle(balance, u, evaluation, pair, frequency_hz))
        .collect()
}

/// Orbit of a converged U with what follows from its displacements alone: modal amplitudes,
/// observed motion, and the powers of excitation and damping.
fn motion(system: &ContactSystem, harmonics: usize, u: &[f64], frequency_hz: f64) -> Orbit {
    let modal = modal_amplitudes(system, harmonics, TAU * frequency_hz, u);
    motion_of(system, harmonics, u, modal, frequency_hz)
}

/// Like [`motion`], from the amplitudes of the stuck modes, too.
fn motion_of(
    system: &ContactSystem,
    harmonics: usize,
    u: &[f64],
    modal: Vec<f64>,
    frequency_hz: f64,
) -> Orbit {
    let omega = TAU * frequency_hz;
    let observed = observe(system, harmonics, u, &modal);
    let Powers {
        input_w,
        viscous_w,
        kinetic_energy_j,
    } = powers(system, harmonics, omega, u, &modal);
    Orbit {
        harmonics,
        modal,
        observed_amplitude: observed.iter().map(|c| amplitude(c)).collect(),
        observed,
        viscous_power_w: viscous_w,
        input_power_w: input_w,
        kinetic_energy_j,
        ..Orbit::motionless(frequency_hz, Outcome::Converged)
    }
}

/// Amplitudes of the observed displacements of U, m: the largest departures from their means.
pub fn observed_amplitudes_m(balance: &Balance, u: &[f64], frequency_hz: f64) -> Vec<f64> {
    let Setting {
        system, fourier, ..
    } = &balance.setting;
    amplitudes_m(system, fourier.harmonics(), u, frequency_hz)
}

fn amplitudes_m(
    system: &ContactSystem,
    harmonics: usize,
    u: &[f64],
    frequency_hz: f64,
) -> Vec<f64> {
    let modal = modal_amplitudes(system, harmonics, TAU * frequency_hz, u);
    let observed = observe(system, harmonics, u, &modal);
    observed.iter().map(|c| amplitude(c)).collect()
}

/// Complex amplitude of the first harmonic of each observed displacement of U, m.
pub(crate) fn first_harmonics(system: &ContactSystem, u: &[f64], omega: f64) -> Vec<c64> {
    let x = complex_block(u, system.unknowns(), 1);
    let q = system.modal_response(1, omega, &x, &system.modal_load(1, omega));
    let of = system.problem.reduced.harmonic_model(1);
    let x = of.widened(&x);
    let observed = of.observations().iter();
    observed.map(|point| point.amplitude(&x, &q)).collect()
}

/// Derivative of [`first_harmonics`] with respect to the complex amplitudes of harmonic 1 of the
/// pairs: n coefficients for each observed displacement.
pub(crate) fn first_harmonic_slopes(system: &ContactSystem, omega: f64) -> Vec<Vec<c64>> {
    let observed = system
        .problem
        .reduced
        .harmonic_model(1)
        .observations()
        .iter();
    observed
        .map(|point| system.displacement_slope(1, omega, &point.on_x, &point.on_modes))
        .collect()
}

/// Response of an assembly without pairs at one frequency, in closed form.
pub fn linear_point(system: &ContactSystem, harmonics: usize, frequency_hz: f64) -> LinearPoint {
    LinearPoint {
        frequency_hz,
        observed_amplitude: amplitudes_m(system, harmonics, &[], frequency_hz),
    }
}

/// Orbit of an assembly without pairs at one frequency, in closed form. Its number is 0.
pub fn linear_orbit(system: &ContactSystem, harmonics: usize, frequency_hz: f64) -> Orbit {
    motion(system, harmonics, &[], frequency_hz)
}

/// Largest departure from the mean over a period of a signal given by its coefficients.
pub(crate) fn amplitude(coefficients: &[f64]) -> f64 {
    let harmonics = coefficients.len() / 2;
    match harmonics {
        0 => 0.0,
        1 => coefficients[1].hypot(coefficients[2]),
        _ => {
            let instants = AMPLITUDE_INSTANTS.max(8 * harmonics);
            let step = c64::cis(TAU / instants as f64);
            let (mut farthest, mut sampled) = (0, 0.0);
            let mut turn = c64::ONE;
            for n in 0..instants {
                let departure = departure(coefficients, turn)[0].abs();
                if departure >= sampled {
                    (farthest, sampled) = (n, departure);
                }
                turn *= step;
            }
            let start = TAU * farthest as f64 / instants as f64;
            sampled.max(refined(coefficients, start).abs())
        }
    }
}

/// Departure from the mean at the instant t of a signal given by its coefficients, and its first and
/// second derivative; `turn` is e^it.
fn departure(coefficients: &[f64], turn: c64) -> [f64; 3] {
    let mut sums = [0.0; 3];
    let mut of_harmonic = c64::ONE;
    for (i, pair) in coefficients[1..].chunks_exact(2).enumerate() {
        of_harmonic *= turn;
        let (k, c64 { re: c, im: s }) = ((i + 1) as f64, of_harmonic);
        let part = pair[0] * c + pair[1] * s;
        sums[0] += part;
        sums[1] += k * (pair[1] * c - pair[0] * s);
        sums[2] -= k * k * part;
    }
    sums
}

/// Departure from the mean at the extremum next to `start`: Newton's method on the derivative,
/// within one instant's distance.
fn refined(coefficients: &[f64], start: f64) -> f64 {
    let reach = TAU / AMPLITUDE_INSTANTS as f64;
    let mut t = start;
    for _ in 0..3 {
        let [_, slope, curvature] = departure(coefficients, c64::cis(t));
        if curvature != 0.0 {
            t = (t - slope / curvature).clamp(start - reach, start + reach);
        }
    }
    departure(coefficients, c64::cis(t))[0]
}

/// Complex amplitudes of harmonic k (k >= 1) of a harmonic-major vector of block length n.
pub(super) fn complex_block(v: &[f64], n: usize, k: usize) -> Vec<c64> {
    let [c, s] = [cosine(k), sine(k)].map(|block| &v[block * n..(block + 1) * n]);
    c.iter().zip(s).map(|(c, s)| c64::new(*c, -*s)).collect()
}

/// Stuck-mode amplitudes, (2H+1) m, harmonic-major, with room for the
/// [most modes](crate::reduced::ReducedModel::most_modes) that any harmonic has.
fn modal_amplitudes(system: &ContactSystem, harmonics: usize, omega: f64, u: &[f64]) -> Vec<f64> {
    modal_amplitudes_by(system, harmonics, u, |k, x| {
        system.modal_response(k, omega, x, &system.modal_load(k, omega))
    })
}

/// Stuck-mode amplitudes, (2H+1) m, harmonic-major, of which `of` gives those of a harmonic from the
/// complex amplitudes of the pairs.
fn modal_amplitudes_by(
    system: &ContactSystem,
    harmonics: usize,
    u: &[f64],
    of: impl Fn(usize, &[c64]) -> Vec<c64>,
) -> Vec<f64> {
    let reduced = &system.problem.reduced;
    let (n, m) = (system.unknowns(), reduced.most_modes());
    let mut out = vec![0.0; blocks(harmonics) * m];
    let statics = reduced.static_load.on_modes.iter().zip(&reduced.omega2);
    for (out, (f, w2)) in out.iter_mut().zip(statics) {
        *out = f / w2;
    }
    for k in 1..=harmonics {
        let q = of(k, &complex_block(u, n, k));
        for (i, q) in q.iter().enumerate() {
            out[cosine(k) * m + i] = q.re;
            out[sine(k) * m + i] = -q.im;
        }
    }
    out
}

fn observe(system: &ContactSystem, harmonics: usize, u: &[f64], modal: &[f64]) -> Vec<Vec<f64>> {
    let reduced = &system.problem.reduced;
    let mut out = vec![vec![0.0; blocks(harmonics)]; reduced.observations.len()];
    let mut observe = |at: usize, observations: &[ObservedPoint], part: &CoefficientBlock| {
        for (out, point) in out.iter_mut().zip(observations) {
            let on_modes = &part.q[..point.on_modes.len()];
            out[at] = dot(&point.on_x, &part.x) + dot(&point.on_modes, on_modes);
        }
    };
    observe(
        0,
        &reduced.observations,
        &CoefficientBlock::mean(system, u, modal),
    );
    for k in 1..=harmonics {
        let observations = reduced.harmonic_model(k).observations();
        let parts = CoefficientBlock::parts(system, k, u, modal);
        for (at, part) in [cosine(k), sine(k)].into_iter().zip(&parts) {
            observe(at, observations, part);
        }
    }
    out
}

/// Cosine or sine part of a motion in one harmonic, on the model of that harmonic, or its mean.
struct CoefficientBlock {
    x: Vec<f64>,
    q: Vec<f64>,
}

impl CoefficientBlock {
    fn mean(system: &ContactSystem, u: &[f64], modal: &[f64]) -> Self {
        let reduced = &system.problem.reduced;
        Self {
            x: u[..system.unknowns()].to_vec(),
            q: modal[..reduced.omega2.len()].to_vec(),
        }
    }

    /// Both parts of harmonic `k`, from the vectors of all harmonics.
    fn parts(system: &ContactSystem, k: usize, u: &[f64], modal: &[f64]) -> [Self; 2] {
        let reduced = &system.problem.reduced;
        let (n, m) = (system.unknowns(), reduced.most_modes());
        let of = reduced.harmonic_model(k);
        let blocks = [cosine(k), sine(k)];
        let parts = of.widened_parts(blocks.map(|block| &u[block * n..(block + 1) * n]));
        let on_modes = blocks.map(|block| &modal[block * m..][..of.model.omega2.len()]);
        let [[c, s], [q_c, q_s]] = [parts, on_modes.map(<[f64]>::to_vec)];
        [Self { x: c, q: q_c }, Self { x: s, q: q_s }]
    }
}

/// Powers and kinetic energy, means over a period.
struct Powers {
    /// Power put in by the excitations, W.
    input_w: f64,
    /// Power spent by viscous damping and given to the air, W.
    viscous_w: f64,
    /// Kinetic energy, J.
    kinetic_energy_j: f64,
}

/// Harmonic k of motion Y: input (k w / 2) Im(conj(f)... ) written out on cosine and sine parts;
/// viscous (k w)^2 / 2 Y^H C Y with C = a K + b M and what damps besides, i.e. pi k^2 w (...) per
/// cycle, and -(k w / 2) Im(a^H A a) to the air; kinetic energy (k w)^2 / 4 Y^H M Y.
fn powers(
    system: &ContactSystem,
    harmonics: usize,
    omega: f64,
    u: &[f64],
    modal: &[f64],
) -> Powers {
    let problem = &system.problem;
    let (mut input, mut viscous, mut kinetic) = (0.0, 0.0, 0.0);
    let moved = |k: usize| CoefficientBlock::parts(system, k, u, modal);
    let moved: Vec<[CoefficientBlock; 2]> = (1..=harmonics).map(moved).collect();
    let products = elastic_and_inertial_products(&problem.reduced, &moved);
    for (k, (parts, products)) in (1..=harmonics).zip(moved.iter().zip(products)) {
        let kw = k as f64 * omega;
        let of = problem.reduced.harmonic_model(k);
        // Both copies of a sector have the same power.
        let share = 1.0 / of.copies() as f64;
        let model = of.model;
        for load in problem.excitations.iter().filter(|l| l.harmonic == k) {
            // Power = <f . dx/dt>: (k w / 2) (f_c . x_s - f_s . x_c).
            let work = |f: &Load, part: &CoefficientBlock| {
                dot(&f.on_x, &part.x) + dot(&f.on_modes, &part.q)
            };
            let work = work(&load.cosine, &parts[1]) - work(&load.sine, &parts[0]);
            input += 0.5 * kw * load.factor(omega) * share * work;
        }
        let besides = problem.additional_damping(of, system.damping);
        for (CoefficientBlock { x, q }, [elastic, inertial]) in parts.iter().zip(products) {
            let mut energy = 0.0;
            let modal = q.iter().zip(&model.omega2).map(|(q, w2)| w2 * q * q);
            energy += system.damping.stiffness_s * (elastic + modal.sum::<f64>());
            let mut mass = inertial + dot(q, q);
            for (j, q) in q.iter().enumerate() {
                mass += 2.0 * q * dot(x, model.coupling.col_as_slice(j));
            }
            energy += system.damping.mass_per_s * mass;
            for (c, weights) in &besides {
                energy += c * (dot(&weights.on_x, x) + dot(&weights.on_modes, q)).powi(2);
            }
            viscous += 0.5 * kw * kw * share * energy;
            kinetic += 0.25 * kw * kw * share * mass;
        }
        if let Some(coefficients) = of.influence_on_copies() {
            let moved = model.dashpots.influenced().into_iter().map(|weights| {
                let [c, s] = parts.each_ref().map(|CoefficientBlock { x, q }| {
                    dot(&weights.on_x, x) + dot(&weights.on_modes, q)
                });
                c64::new(c, -s)
            });
            let moved: Vec<c64> = moved.collect();
            for (j, force) in coefficients.col_iter().zip(&moved) {
                let on_all = j.iter().zip(&moved).map(|(k, v)| v.conj() * k * force);
                viscous += 0.5 * kw * share * on_all.sum::<c64>().im;
            }
        }
    }
    Powers {
        input_w: input,
        viscous_w: viscous,
        kinetic_energy_j: kinetic,
    }
}

/// Products x^T K x and x^T M x of both parts of each harmonic. The matrices are read once for all
/// harmonics that move by the same model.
fn elastic_and_inertial_products(
    reduced: &ReducedModel,
    moved: &[[CoefficientBlock; 2]],
) -> Vec<[[f64; 2]; 2]> {
    let mut found_products = vec![[[0.0; 2]; 2]; moved.len()];
    let models = (1..=moved.len()).map(|k| reduced.harmonic_model(k).model);
    let models: Vec<&ReducedModel> = models.collect();
    for (first, model) in models.iter().enumerate() {
        let is_same = |k: &usize| std::ptr::eq(models[*k], *model);
        if (0..first).any(|k| is_same(&k)) {
            continue;
        }
        let harmonics: Vec<usize> = (first..models.len()).filter(is_same).collect();
        let x = |row: usize, column: usize| moved[harmonics[column / 2]][column % 2].x[row];
        let x = Mat::from_fn(model.stiffness.nrows(), 2 * harmonics.len(), x);
        let [elastic, inertial] =
            [&model.stiffness, &model.mass].map(|a| quadratic_forms(a.as_ref(), x.as_ref()));
        for (column, products) in elastic.into_iter().zip(inertial).enumerate() {
            found_products[harmonics[column / 2]][column % 2] = products.into();
        }
    }
    found_products
}

fn pair_cycle(
    balance: &Balance,
    u: &[f64],
    evaluation: &Evaluation,
    pair: usize,
    frequency_hz: f64,
) -> PairCycle {
    let n = balance.unknowns_per_block();
    let fourier = &balance.setting.fourier;
    let end = &evaluation.ends[pair];
    let slid_m = balance.slid_m(pair, end);
    let open_at_rest = balance.setting.at_rest[pair] == PairStatus::Open;
    // Compressions by the law itself: a sum of harmonics would pull at a pair that opens.
    let compressions = balance.compressions_n(pair, &evaluation.lambda_u);
    let [least_n, most_n] = extremes(&compressions).map(|n| n.max(0.0));
    let rubs = balance.setting.system.problem.laws[pair].friction > 0.0;
    let mut friction = 0.0;
    for k in (1..=fourier.harmonics()).filter(|_| rubs) {
        let mut work = 0.0;
        for c in 0..3 {
            let i = 3 * pair + c;
            let (cosine, sine) = (cosine(k) * n + i, sine(k) * n + i);
            let lambda = &evaluation.lambda;
            work += lambda[cosine] * u[sine] - lambda[sine] * u[cosine];
        }
        friction += std::f64::consts::PI * frequency_hz * k as f64 * work;
    }
    let open_fraction = end.open_samples as f64 / fourier.samples() as f64;
    PairCycle {
        status: CycleStatus::new(open_at_rest, open_fraction, balance.slips(pair, end)),
        slid_m,
        rubbed_nm: balance.rubbed_nm(pair, end),
        open_fraction,
        compression_mean_n: 0.0 - evaluation.lambda[3 * pair],
        compression_min_n: least_n,
        compression_max_n: most_n,
        landing: balance.setting.system.problem.laws[pair]
            .stiffness
            .is_none()
            .then(|| landing(&compressions, fourier.harmonics(), frequency_hz))
            .flatten(),
        friction_power_w: friction,
    }
}

/// Smallest and largest value of a periodic signal, on parabolas through its samples.
fn extremes(samples: &[f64]) -> [f64; 2] {
    let count = samples.len();
    let mut extremes = [f64::INFINITY, f64::NEG_INFINITY];
    for (n, now) in samples.iter().enumerate() {
        let [before, after] = [count - 1, 1].map(|by| samples[(n + by) % count]);
        let (slope, curvature) = (0.5 * (after - before), before - 2.0 * now + after);
        // The vertex lies within half an interval of the sample.
        let vertex = if 2.0 * slope.abs() <= curvature.abs() && slope != 0.0 {
            now - 0.5 * slope * slope / curvature
        } else {
            *now
        };
        extremes = [
            extremes[0].min(*now).min(vertex),
            extremes[1].max(*now).max(vertex),
        ];
    }
    extremes
}

/// Landing of a rigid pair with these compressions at the samples, N; `None` where it stays closed or
/// open.
fn landing(compressions: &[f64], harmonics: usize, frequency_hz: f64) -> Option<Landing> {
    let samples = compressions.len();
    let lands = |n: usize| {
        let before = compressions[(n + samples - 1) % samples];
        before <= 0.0 && compressions[n] > 0.0
    };
    let spread = samples.div_ceil(harmonics + 1);
    let mut is_landing = vec![false; samples];
    let mut largest = None;
    for start in (0..samples).filter(|n| lands(*n)) {
        let mut sum = 0.0;
        for n in (start..start + spread).map(|n| n % samples) {
            if compressions[n] <= 0.0 {
                break;
            }
            sum += compressions[n];
            is_landing[n] = true;
        }
        let impulse_ns = sum / (samples as f64 * frequency_hz);
        largest = Some(largest.map_or(impulse_ns, |most: f64| most.max(impulse_ns)));
    }
    let after = compressions.iter().zip(&is_landing);
    let after = after.filter(|(_, landing)| !**landing).map(|(n, _)| *n);
    largest.map(|impulse_ns| Landing {
        impulse_ns,
        compression_after_n: after.fold(0.0, f64::max),
    })
}

/// Size of the vibration in the terms of each observed displacement, m, or strain: the sum of their
/// sizes, with that of a pair no less than what its force displaces eps by. Rounding and the tolerance
/// of the solution are relative to it.
pub(crate) fn observation_scales(
    balance: &Balance,
    u: &[f64],
    lambda: &[f64],
    frequency_hz: f64,
) -> Vec<f64> {
    let Setting {
        system, fourier, ..
    } = &balance.setting;
    let harmonics = fourier.harmonics();
    let modal = modal_amplitudes(system, harmonics, TAU * frequency_hz, u);
    let elastic = lambda.iter().enumerate();
    let elastic: Vec<f64> = elastic.map(|(i, l)| l / balance.eps_at(i)).collect();
    let mut scales = vec![0.0; system.problem.reduced.observations.len()];
    for k in 1..=harmonics {
        let moved = CoefficientBlock::parts(system, k, u, &modal);
        let forced = CoefficientBlock::parts(system, k, &elastic, &modal);
        let observations = system.problem.reduced.harmonic_model(k).observations();
        for (moved, forced) in moved.iter().zip(&forced) {
            for (scale, point) in scales.iter_mut().zip(observations) {
                let on_x = point.on_x.iter().zip(moved.x.iter().zip(&forced.x));
                *scale += on_x
                    .map(|(on, (x, f))| on.abs() * x.abs().max(f.abs()))
                    .sum::<f64>();
                let on_modes = point.on_modes.iter().zip(&moved.q);
                *scale += on_modes.map(|(on, q)| (on * q).abs()).sum::<f64>();
            }
        }
    }
    scales
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damping::Rayleigh;
    use crate::dlft::jacobians::{
        OMEGA_RAD_S, OPEN_AT_REST, changed, linear_residual, sample_points,
    };
    use crate::problem::{HarmonicLoad, LinearReference, Problem};
    use crate::reduced::ReducedModel;
    use faer::Mat;

    const FREQUENCY_HZ: f64 = OMEGA_RAD_S / TAU;
    /// Number of instants over which means of products of two motions are exact.
    const INSTANTS: usize = 64;

    /// Values, velocities and accelerations at the phase w t of signals given by blocks of `size`
    /// coefficients.
    fn evaluate_at_phase(v: &[f64], size: usize, phase: f64) -> [Vec<f64>; 3] {
        let mut out = [v[..size].to_vec(), vec![0.0; size], vec![0.0; size]];
        for (i, block) in v[size..].chunks_exact(2 * size).enumerate() {
            let k = (i + 1) as f64;
            let (kw, (s, c)) = (k * OMEGA_RAD_S, (k * phase).sin_cos());
            for (i, (a, b)) in block[..size].iter().zip(&block[size..]).enumerate() {
                out[0][i] += a * c + b * s;
                out[1][i] += kw * (b * c - a * s);
                out[2][i] -= kw * kw * (a * c + b * s);
            }
        }
        out
    }

    /// All loads of harmonics that the balance has, at the phase w t.
    fn load_at(problem: &Problem, harmonics: usize, phase: f64) -> Load {
        let mut load = problem.reduced.static_load.clone();
        let Load { on_x, on_modes } = &mut load;
        for part in problem
            .excitations
            .iter()
            .filter(|l| l.harmonic <= harmonics)
        {
            let (s, c) = (part.harmonic as f64 * phase).sin_cos();
            for (sum, (cosine, sine)) in [
                (&mut *on_x, (&part.cosine.on_x, &part.sine.on_x)),
                (&mut *on_modes, (&part.cosine.on_modes, &part.sine.on_modes)),
            ] {
                for (sum, (a, b)) in sum.iter_mut().zip(cosine.iter().zip(sine)) {
                    *sum += a * c + b * s;
                }
            }
        }
        load
    }

    fn times(a: &Mat<f64>, x: &[f64]) -> Vec<f64> {
        let row = |i: usize| (0..x.len()).map(|j| a[(i, j)] * x[j]).sum();
        (0..a.nrows()).map(row).collect()
    }

    #[track_caller]
    fn assert_near(found: f64, expected: f64) {
        let off = (found - expected).abs();
        assert!(
            off <= 1e-11 * (1.0 + expected.abs()),
            "{found}, not {expected}"
        );
    }

    fn orbit_of(balance: &Balance, u: &[f64]) -> (Orbit, Evaluation) {
        let evaluation = balance.evaluate(u);
        let outcome = Outcome::Converged;
        let orbit = orbit(balance, u, &evaluation, FREQUENCY_HZ, outcome);
        (orbit, evaluation)
    }

    /// Forces of the viscous damping on the pairs and on the modes. A mode with a damping ratio zeta
    /// of its own has a = 0 and b = 2 zeta w, in the products of its rows of the mass alone.
    fn damping_forces(system: &ContactSystem, v: &[f64], q_rate: &[f64]) -> [Vec<f64>; 2] {
        let (problem, reduced) = (&system.problem, &system.problem.reduced);
        let (a, b) = (system.damping.stiffness_s, system.damping.mass_per_s);
        let (stiff, mass) = (times(&reduced.stiffness, v), times(&reduced.mass, v));
        let mut on_x: Vec<f64> = stiff
            .iter()
            .zip(&mass)
            .map(|(k, m)| a * k + b * m)
            .collect();
        let mut on_modes = Vec::new();
        for (m, w2) in reduced.omega2.iter().enumerate() {
            let p = reduced.coupling.col_as_slice(m);
            let moving = dot(p, v) + q_rate[m];
            let (own, stiff) = match problem.modal_ratios.get(m) {
                Some(ratio) => (2.0 * ratio * w2.sqrt(), 0.0),
                None => (b, a * w2 * q_rate[m]),
            };
            // M x' + p q' = (M - p p^T) x' + p (p^T x' + q').
            let of_mode = (own - b) * moving + b * q_rate[m];
            on_x.iter_mut().zip(p).for_each(|(f, p)| *f += of_mode * p);
            on_modes.push(own * moving + stiff);
        }
        for (c, weights) in reduced.dashpots.loads() {
            let force = c * (dot(&weights.on_x, v) + dot(&weights.on_modes, q_rate));
            let add =
                |f: &mut [f64], w: &[f64]| f.iter_mut().zip(w).for_each(|(f, w)| *f += force * w);
            add(&mut on_x, &weights.on_x);
            add(&mut on_modes, &weights.on_modes);
        }
        [on_x, on_modes]
    }

    /// K x + M x'' + p q'' - F and the damping forces are what the balance says without contact
    /// forces, and q'' + w^2 q + p^T x'' and the damping forces are the load on the modes.
    #[test]
    fn loads_stiffness_and_modes_are_those_of_the_equations_in_time() {
        for (_, balance, u) in &sample_points() {
            let system = &balance.setting.system;
            let problem = &system.problem;
            let (n, modes) = (system.unknowns(), problem.reduced.omega2.len());
            let of_balance = linear_residual(&Balance::new(&balance.setting, OMEGA_RAD_S), u);
            let (orbit, _) = orbit_of(balance, u);
            for i in 0..7 {
                let phase = 0.9 * f64::from(i);
                let load = load_at(problem, orbit.harmonics, phase);
                let [x, v, acceleration] = evaluate_at_phase(u, n, phase);
                let [q, q_rate, q_second] = evaluate_at_phase(&orbit.modal, modes, phase);
                let kx = times(&problem.reduced.stiffness, &x);
                let ma = times(&problem.reduced.mass, &acceleration);
                let p = times(&problem.reduced.coupling, &q_second);
                let [on_x, on_modes] = damping_forces(system, &v, &q_rate);
                for (i, found) in evaluate_at_phase(&of_balance, n, phase)[0]
                    .iter()
                    .enumerate()
                {
                    assert_near(*found, kx[i] + on_x[i] + ma[i] + p[i] - load.on_x[i]);
                }
                let coupling = problem.reduced.coupling.transpose().to_owned();
                let of_x = times(&coupling, &acceleration);
                for (i, w2) in problem.reduced.omega2.iter().enumerate() {
                    let sum = q_second[i] + on_modes[i] + w2 * q[i] + of_x[i];
                    assert_near(sum, load.on_modes[i]);
                }
            }
        }
    }

    #[test]
    fn powers_are_the_means_of_force_times_velocity() {
        for (_, balance, u) in &sample_points() {
            let system = &balance.setting.system;
            let problem = &system.problem;
            let (n, modes) = (system.unknowns(), problem.reduced.omega2.len());
            let (orbit, evaluation) = orbit_of(balance, u);
            let mut kinetic = 0.0;
            let (mut input, mut viscous) = (0.0, 0.0);
            let mut friction = vec![0.0; n / 3];
            for i in 0..INSTANTS {
                let phase = TAU * i as f64 / INSTANTS as f64;
                let load = load_at(problem, orbit.harmonics, phase);
                let [_, v, _] = evaluate_at_phase(u, n, phase);
                let [_, q_rate, _] = evaluate_at_phase(&orbit.modal, modes, phase);
                let [lambda, ..] = evaluate_at_phase(&evaluation.lambda, n, phase);
                input += dot(&load.on_x, &v) + dot(&load.on_modes, &q_rate);
                let [on_x, on_modes] = damping_forces(system, &v, &q_rate);
                viscous += dot(&v, &on_x) + dot(&q_rate, &on_modes);
                kinetic += 0.5 * dot(&q_rate, &q_rate);
                kinetic += 0.5 * dot(&v, &times(&problem.reduced.mass, &v))
                    + dot(&v, &times(&problem.reduced.coupling, &q_rate));
                let pairs = lambda.chunks_exact(3).zip(v.chunks_exact(3));
                for (sum, (lambda, v)) in friction.iter_mut().zip(pairs) {
                    *sum += dot(lambda, v);
                }
            }
            let count = INSTANTS as f64;
            assert_near(orbit.input_power_w, input / count);
            assert_near(orbit.viscous_power_w, viscous / count);
            assert_near(orbit.kinetic_energy_j, kinetic / count);
            for (cycle, friction) in orbit.cycles.iter().zip(&friction) {
                assert_near(cycle.friction_power_w, friction / count);
            }
            assert_near(orbit.friction_power_w, friction.iter().sum::<f64>() / count);
        }
    }

    #[test]
    fn the_largest_force_is_found_between_the_samples_and_without_the_landing() {
        // A parabola has its vertex there, off the samples.
        let signal = [-3.0, 1.0, 3.0, 2.9, 0.8, -3.2];
        let [least, most] = extremes(&signal);
        assert_near(most, 3.0 + 0.5 * 0.95 * 0.95 / 2.1);
        assert!(least <= -3.2);
        // The pair lands at the second sample, and bears less from a third of the period on.
        let landing = landing(&[-1.0, 5.0, 9.0, 2.0, 3.0, -1.0], 2, 10.0).unwrap();
        assert_near(landing.impulse_ns, 14.0 / 60.0);
        assert_eq!(landing.compression_after_n, 3.0);
        for never in [[1.0, 2.0], [-1.0, -2.0]] {
            assert_eq!(super::landing(&never, 2, 10.0), None);
        }
    }

    /// The apparent work of a truncated series of a normal force is no work of friction.
    #[test]
    fn a_pair_without_friction_has_no_friction_power() {
        for (_, balance, u) in &sample_points() {
            let smooth = |problem: &mut Problem| {
                problem.laws.iter_mut().for_each(|law| law.friction = 0.0);
            };
            let setting = changed(&balance.setting, smooth);
            let (orbit, _) = orbit_of(&Balance::new(&setting, OMEGA_RAD_S), u);
            assert_eq!(orbit.friction_power_w, 0.0);
            assert!(orbit.cycles.iter().all(|c| c.friction_power_w == 0.0));
        }
    }

    #[test]
    fn observed_motion_and_cycles_of_pairs_are_read_off_the_solution() {
        for (_, balance, u) in &sample_points() {
            let setting = &balance.setting;
            let (problem, n) = (&setting.system.problem, setting.system.unknowns());
            let law = |pair: usize| {
                let eps = [setting.eps[3 * pair], setting.eps[3 * pair + 1]];
                problem.laws[pair].predicted(eps, f64::INFINITY)
            };
            let modes = problem.reduced.omega2.len();
            let (orbit, evaluation) = orbit_of(balance, u);
            assert_eq!((&orbit.x, &orbit.lambda), (u, &evaluation.lambda));
            assert_near(orbit.retention_n, balance.retention_n(u));
            assert_eq!(orbit.mean, balance.mean());
            for (point, observed) in problem.reduced.observations.iter().zip(&orbit.observed) {
                for i in 0..7 {
                    let phase = 0.9 * f64::from(i);
                    let [x, ..] = evaluate_at_phase(u, n, phase);
                    let [q, ..] = evaluate_at_phase(&orbit.modal, modes, phase);
                    let seen = dot(&point.on_x, &x) + dot(&point.on_modes, &q);
                    assert_near(evaluate_at_phase(observed, 1, phase)[0][0], seen);
                }
            }
            let amplitudes: Vec<f64> = orbit.observed.iter().map(|c| amplitude(c)).collect();
            assert_eq!(orbit.observed_amplitude, amplitudes);
            assert_eq!(observed_amplitudes_m(balance, u, FREQUENCY_HZ), amplitudes);

            let samples = setting.fourier.samples();
            let mut compressions = vec![vec![]; n / 3];
            // Extremes lie between the samples, too.
            let instants = 64 * samples;
            for i in 0..instants {
                let phase = TAU * i as f64 / instants as f64;
                // The normal law has no history: the force is what is predicted, unless that pulls.
                let [predicted, ..] = evaluate_at_phase(&evaluation.lambda_u, n, phase);
                for (pair, compression) in compressions.iter_mut().enumerate() {
                    let law = law(pair);
                    let trial = law.shares[0] * predicted[3 * pair] + law.shift_n;
                    compression.push((-trial).max(0.0));
                }
            }
            let farthest_m = orbit.cycles.iter().fold(0.0_f64, |m, c| m.max(c.slid_m));
            let lax = Setting {
                slip_threshold_m: farthest_m,
                ..setting.clone()
            };
            let lax = Balance::new(&lax, OMEGA_RAD_S);
            for (pair, end) in evaluation.ends.iter().enumerate() {
                assert!(!lax.slips(pair, end));
                assert_eq!(lax.sticks(pair, end), end.open_samples == 0);
                let sticks = end.open_samples == 0 && end.slid_n == 0.0;
                assert_eq!(balance.sticks(pair, end), sticks);
            }
            for (pair, cycle) in orbit.cycles.iter().enumerate() {
                let (end, compression) = (&evaluation.ends[pair], &compressions[pair]);
                assert_near(law(pair).slid_m(end.slid_n), cycle.slid_m);
                let expected = match (pair == OPEN_AT_REST, end.open_samples) {
                    (true, open) if open == samples => CycleStatus::Open,
                    (true, _) => CycleStatus::Closing,
                    (false, 0) if end.slid_n > 0.0 => CycleStatus::Slipping,
                    (false, 0) => CycleStatus::Stuck,
                    (false, _) => CycleStatus::Opening,
                };
                assert_eq!(cycle.status, expected);
                assert_near(
                    cycle.open_fraction,
                    end.open_samples as f64 / samples as f64,
                );
                let least = compression.iter().fold(f64::INFINITY, |m, c| m.min(*c));
                let most = compression.iter().fold(0.0_f64, |m, c| m.max(*c));
                let off = (cycle.compression_min_n - least).abs();
                assert!(off <= 1e-3 * most, "{off} of {most}");
                let off = (cycle.compression_max_n - most).abs();
                assert!(off <= 1e-3 * most, "{off} of {most}");
                // The samples do not tell when the pair opens and closes between them.
                let mean = compression.iter().sum::<f64>() / instants as f64;
                assert!((cycle.compression_mean_n - mean).abs() <= 5e-3 * most);
                assert!(cycle.compression_min_n >= 0.0);
                if end.open_samples > 0 {
                    assert_eq!(cycle.compression_min_n, 0.0);
                }
            }
        }
    }

    #[test]
    fn a_stuck_assembly_moves_as_one_whose_pairs_do_not() {
        for (_, balance, u) in &sample_points() {
            let still = vec![0.0; u.len()];
            let system = &balance.setting.system;
            let harmonics = balance.setting.fourier.harmonics();
            let stuck = LinearReference::stuck(&system.problem.reduced);
            let stuck = stuck.problem(&system.problem, system.damping);
            let stuck = ContactSystem::new(&stuck, system.damping);
            let stuck = linear_point(&stuck, harmonics, FREQUENCY_HZ);
            let expected = observed_amplitudes_m(balance, &still, FREQUENCY_HZ);
            assert_eq!(stuck.observed_amplitude, expected);
            assert!(expected.iter().all(|a| *a > 0.0));
        }
    }

    /// One mode, no pair: the linear oscillator.
    #[test]
    fn an_assembly_without_pairs_is_its_linear_oscillators() {
        let (w2, force, mean) = (0.3, 0.7, 0.2);
        let load = |on_modes: f64| Load::new(vec![], vec![on_modes]);
        let none = || Mat::zeros(0, 0);
        let problem = Problem {
            reduced: ReducedModel {
                static_load: load(mean),
                observations: vec![ObservedPoint::new("u", vec![], vec![2.0])],
                ..ReducedModel::new(none(), none(), Mat::zeros(0, 1), vec![w2])
            }
            .into(),
            laws: vec![],
            excitations: vec![HarmonicLoad::cosine(1, load(force))],
            modal_ratios: Vec::new(),
        };
        let (a, b) = (0.1, 0.05);
        let damping = Rayleigh::new(a, b);
        let orbit = linear_orbit(&ContactSystem::new(&problem, damping), 1, FREQUENCY_HZ);
        let w = OMEGA_RAD_S;
        let (stiff, damp) = (w2 - w * w, w * (a * w2 + b));
        let q = force / stiff.hypot(damp);
        assert_near(orbit.observed[0][0], 2.0 * mean / w2);
        assert_near(orbit.observed_amplitude[0], 2.0 * q);
        let power = 0.5 * w * damp * q * q;
        assert_near(orbit.input_power_w, power);
        assert_near(orbit.viscous_power_w, power);
        assert!(orbit.cycles.is_empty() && orbit.friction_power_w == 0.0);
    }

    #[test]
    fn the_amplitude_is_that_of_the_extremum_between_instants() {
        // One harmonic, whatever its phase and whatever follows it with amplitude zero.
        for i in 0..50 {
            let phase = 0.37 * i as f64;
            let (s, c) = phase.sin_cos();
            let one = amplitude(&[5.0, 2.0 * c, 2.0 * s]);
            let three = amplitude(&[5.0, 2.0 * c, 2.0 * s, 0.0, 0.0, 0.0, 0.0]);
            assert!(
                (one - 2.0).abs() < 1e-14 && (three - 2.0).abs() < 1e-13,
                "{three}"
            );
        }
        // cos t + cos 3t / 9: extremum 10/9 at t = 0, shifted to between instants.
        let shift: f64 = 0.001;
        let signal = [shift, 3.0 * shift].map(f64::sin_cos);
        let coefficients = [
            0.0,
            signal[0].1,
            signal[0].0,
            0.0,
            0.0,
            signal[1].1 / 9.0,
            signal[1].0 / 9.0,
        ];
        assert!((amplitude(&coefficients) - 10.0 / 9.0).abs() < 1e-12);
    }
}
