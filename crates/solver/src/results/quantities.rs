//! Quantities of a response: counts, amplitudes and phases, pressures, dissipation.
//!
//! Every sum and maximum over frequencies takes only the frequencies with a motion; the others have
//! no number here. Values per area are NaN where the area of a pair is unknown. Signs:
//! [`crate::contact`].

use super::pairs::PairPlace;
use super::signals::sample_period;
use crate::dlft::{Branch, CycleStatus, Orbit, PairCycle, PairStatus, Response, StaticState};
use std::f64::consts::TAU;

/// One harmonic of a real signal: `amplitude cos(k w t - phase_rad)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phasor {
    /// Amplitude in the unit of the signal, never negative.
    pub amplitude: f64,
    /// Phase lag behind the cosine, in (-pi, pi].
    pub phase_rad: f64,
}

/// Harmonics 1..H of a signal with Fourier coefficients (mean, cosine 1, sine 1, cosine 2, ...):
/// `u(t) = mean + sum_k A_k cos(k w t - phi_k)`, A = |c + i s|, phi = arg(c + i s).
pub fn phasors(coefficients: &[f64]) -> Vec<Phasor> {
    let harmonics = coefficients.get(1..).unwrap_or_default();
    harmonics
        .chunks_exact(2)
        .map(|c| Phasor {
            amplitude: c[0].hypot(c[1]),
            phase_rad: c[1].atan2(c[0]),
        })
        .collect()
}

/// Half of the range of a signal with these Fourier coefficients over the first and over the second
/// half of its period, and over all of it.
fn half_ranges(coefficients: &[f64]) -> [f64; 3] {
    /// Instants of a period for each harmonic.
    const INSTANTS: usize = 512;
    let harmonics = (coefficients.len() / 2).max(1);
    let mut values = sample_period(coefficients, INSTANTS * harmonics);
    values.extend_from_within(..1);
    let half_range = |part: &[f64]| {
        let (low, high) = (part.iter()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        });
        0.5 * (high - low)
    };
    let middle = values.len() / 2;
    [&values[..=middle], &values[middle..], &values].map(half_range)
}

/// Motion of twice the period as tables and pictures have it: at the frequency of the excitation and
/// with its harmonics, with half of the range over both periods as amplitudes. With it half of the range
/// in each of the two periods, for each observed displacement, m.
pub fn at_excitation_frequency(doubled: &Orbit) -> (Orbit, Vec<[f64; 2]>) {
    let of_excitation = |coefficients: &Vec<f64>| {
        let pairs = coefficients.get(1..).unwrap_or_default().chunks_exact(2);
        let even = pairs.skip(1).step_by(2).flatten().copied();
        coefficients
            .first()
            .copied()
            .into_iter()
            .chain(even)
            .collect()
    };
    let ranges: Vec<[f64; 3]> = doubled.observed.iter().map(|c| half_ranges(c)).collect();
    let motion = Orbit {
        frequency_hz: 2.0 * doubled.frequency_hz,
        observed_amplitude: ranges.iter().map(|[.., both]| *both).collect(),
        observed: doubled.observed.iter().map(of_excitation).collect(),
        ..doubled.clone()
    };
    let each = ranges.iter().map(|[first, second, _]| [*first, *second]);
    (motion, each.collect())
}

/// Fields on the flanks over one period, one entry per pair.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CycleFields {
    /// Status of each pair in the period.
    pub status: Vec<CycleStatus>,
    /// Mean pressure over the period, Pa: compression over tributary area.
    pub pressure_mean_pa: Vec<f64>,
    /// Smallest pressure over the period, Pa.
    pub pressure_min_pa: Vec<f64>,
    /// Largest pressure over the period, Pa.
    pub pressure_max_pa: Vec<f64>,
    /// Distance slid in a period, m.
    pub slid_m: Vec<f64>,
    /// Fraction of the period spent open.
    pub open_fraction: Vec<f64>,
    /// Energy that friction dissipates in a period over tributary area, J/m2.
    pub friction_energy_j_m2: Vec<f64>,
}

/// Fields of one orbit (`orbit.cycles` and `pairs` in the same order).
pub fn cycle_fields(orbit: &Orbit, pairs: &[impl PairPlace]) -> CycleFields {
    let per_area = |value: &dyn Fn(&PairCycle) -> f64| {
        let cycles = orbit.cycles.iter().zip(pairs);
        cycles.map(|(c, p)| value(c) / area_m2(p)).collect()
    };
    CycleFields {
        status: orbit.cycles.iter().map(|c| c.status).collect(),
        pressure_mean_pa: per_area(&|c| c.compression_mean_n),
        pressure_min_pa: per_area(&|c| c.compression_min_n),
        pressure_max_pa: per_area(&|c| c.compression_max_n),
        slid_m: orbit.cycles.iter().map(|c| c.slid_m).collect(),
        open_fraction: orbit.cycles.iter().map(|c| c.open_fraction).collect(),
        friction_energy_j_m2: per_area(&|c| c.friction_power_w / orbit.frequency_hz),
    }
}

/// Fields on the flanks in the static state, one entry per pair.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct StaticFields {
    /// Status of each pair.
    pub status: Vec<PairStatus>,
    /// Compression -lambda_N, N.
    pub normal_force_n: Vec<f64>,
    /// Compression over tributary area, Pa.
    pub pressure_pa: Vec<f64>,
    /// Friction force along t1 and t2 by which the body of the first flank pushes that of the
    /// second (lambda_T), N.
    pub friction_n: Vec<[f64; 2]>,
    /// Displacement of the first flank relative to the second along t1 and t2, m.
    pub slip_m: Vec<[f64; 2]>,
    /// Width of the opening, m: X_N + initial clearance, 0 in contact.
    pub gap_m: Vec<f64>,
}

/// Fields of the static state.
pub fn static_fields(state: &StaticState, pairs: &[impl PairPlace]) -> StaticFields {
    let tangential = |v: &[f64]| v.chunks_exact(3).map(|c| [c[1], c[2]]).collect();
    // 0 - x rather than -x: an open pair carries 0, not -0.
    let normal_force_n: Vec<f64> = state.lambda.chunks_exact(3).map(|l| 0.0 - l[0]).collect();
    let forces = normal_force_n.iter().zip(pairs);
    let places = state.x.chunks_exact(3).zip(pairs);
    StaticFields {
        status: state.status.clone(),
        pressure_pa: forces.map(|(f, p)| f / area_m2(p)).collect(),
        friction_n: tangential(&state.lambda),
        slip_m: tangential(&state.x),
        gap_m: places.map(|(x, p)| x[0] + p.gap_m()).collect(),
        normal_force_n,
    }
}

/// Fields over all frequencies with a motion, one entry per pair. None of them grows with the
/// number of frequencies asked for.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SweepFields {
    /// Number of frequencies that the means are taken over.
    pub points: usize,
    /// Mean of the friction power over the points, W; 0 where there are none. Frequencies of a grid
    /// count alike, and times `points` it is the sum over frequencies of the paper's Figure 6. A
    /// point of a branch that was followed counts by the range of frequencies that is nearest to it.
    pub friction_power_mean_w: Vec<f64>,
    /// Fraction of the points at which the pair, closed in the static state, separates, counted in
    /// the same way; 0 where there are none.
    pub opening_share: Vec<f64>,
    /// True if the pair, closed in the static state, separates at any frequency with a motion; the
    /// paper's Figure 5.
    pub separates: Vec<bool>,
}

/// Means over the frequencies with a motion, in their order.
pub fn sweep_fields(response: &Response, pairs: usize) -> SweepFields {
    let mut power_w = vec![0.0; pairs];
    let mut opening = vec![0.0; pairs];
    let mut separates = vec![false; pairs];
    let mut points = 0;
    let mut whole = 0.0;
    let weights = weights(response);
    for (orbit, weight) in response.orbits.iter().zip(weights) {
        if !orbit.outcome.has_motion() {
            continue;
        }
        points += 1;
        whole += weight;
        for (i, cycle) in orbit.cycles.iter().enumerate() {
            let opens = cycle.status == CycleStatus::Opening;
            separates[i] |= opens;
            power_w[i] += weight * cycle.friction_power_w;
            opening[i] += weight * f64::from(u8::from(opens));
        }
    }
    let mean = |sums: Vec<f64>| -> Vec<f64> {
        let whole = if whole > 0.0 { whole } else { 1.0 };
        sums.into_iter().map(|sum| sum / whole).collect()
    };
    SweepFields {
        points,
        friction_power_mean_w: mean(power_w),
        opening_share: mean(opening),
        separates,
    }
}

/// Weight of each orbit in a mean over the frequencies.
fn weights(response: &Response) -> Vec<f64> {
    let orbits = &response.orbits;
    if !response.is_followed() {
        return vec![1.0; orbits.len()];
    }
    let mut weights = vec![0.0; orbits.len()];
    for Branch { points, .. } in &response.branches {
        for (i, two) in points.clone().zip(orbits[points.clone()].windows(2)) {
            let half_hz = 0.5 * (two[1].frequency_hz - two[0].frequency_hz).abs();
            weights[i] += half_hz;
            weights[i + 1] += half_hz;
        }
    }
    weights
}

/// Friction power below this fraction of the power put in counts as rounding.
const LEAST_FRICTION: f64 = 1e-9;

/// Mean power that friction dissipates, W: 0 where it is rounding, or where the truncation error of
/// the normal forces outweighs it.
pub fn friction_power_w(orbit: &Orbit) -> f64 {
    let least = LEAST_FRICTION * orbit.input_power_w.abs();
    if orbit.friction_power_w > least {
        orbit.friction_power_w
    } else {
        0.0
    }
}

/// Largest value of a field of pairs; `None` where there are none, or the area of one is unknown.
pub fn largest_of_pairs(field: &[f64]) -> Option<f64> {
    let known = field.iter().all(|value| value.is_finite());
    field
        .iter()
        .copied()
        .filter(|_| known)
        .reduce(f64::max)
        .map(|largest| largest.max(0.0))
}

/// Orbits that have a motion, in the order of the response: those that converged, and those that
/// did so except for the accuracy asked for.
pub fn moving_orbits(response: &Response) -> impl Iterator<Item = &Orbit> {
    response.orbits.iter().filter(|o| o.outcome.has_motion())
}

/// Mass of an oscillator that vibrates with an observed amplitude and has the kinetic energy of the
/// orbit: the modal mass of the motion at that point, kg. `None` where it does not move.
pub fn modal_mass_kg(orbit: &Orbit, observation: usize) -> Option<f64> {
    let amplitude_m = *orbit.observed_amplitude.get(observation)?;
    let squared = (TAU * orbit.frequency_hz * amplitude_m).powi(2);
    (squared > 0.0).then(|| 4.0 * orbit.kinetic_energy_j / squared)
}

/// Loss factor, as in [`LocalPeak`](super::peak::LocalPeak).
pub fn loss_factor(orbit: &Orbit) -> Option<f64> {
    let stored_w = TAU * orbit.frequency_hz * 2.0 * orbit.kinetic_energy_j;
    (stored_w > 0.0).then(|| (orbit.friction_power_w + orbit.viscous_power_w) / stored_w)
}

/// Estimated error of the largest distance that a pair slides in a period, m; `None` where it is not
/// known.
pub fn largest_slid_error_m(orbit: &Orbit) -> Option<f64> {
    let errors = orbit.figure_errors.as_ref()?;
    let farthest = orbit.cycles.iter().zip(&errors.pairs);
    let farthest = farthest.max_by(|(a, _), (b, _)| a.slid_m.total_cmp(&b.slid_m));
    farthest.map(|(_, errors)| errors.slid_m)
}

/// Largest estimated error of the frequencies with a motion; `None` where nothing is estimated.
pub fn largest_estimated_error(response: &Response) -> Option<f64> {
    let estimated = moving_orbits(response).filter_map(|orbit| orbit.estimated_error);
    estimated.reduce(f64::max)
}

/// Error |input - friction - viscous| over the largest of the three; `None` where all are 0.
pub fn energy_balance_error(orbit: &Orbit) -> Option<f64> {
    let (input, friction, viscous) = (
        orbit.input_power_w,
        orbit.friction_power_w,
        orbit.viscous_power_w,
    );
    let scale = input.abs().max(friction.abs()).max(viscous.abs());
    (scale > 0.0).then(|| (input - friction - viscous).abs() / scale)
}

fn area_m2(pair: &impl PairPlace) -> f64 {
    pair.area_m2().unwrap_or(f64::NAN)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::dlft::{LinearPoint, Outcome, PairCycle};
    use crate::problem::LinearReference;
    use crate::reduced::ReducedModel;
    use crate::results::pairs::PairRow;
    use dovetail_numerics::spectrum::{cosine, sine};
    use faer::Mat;

    fn pair(area_m2: f64) -> PairRow {
        PairRow {
            contact: 0,
            position_m: [0.0; 3],
            frame: None,
            area_m2: Some(area_m2),
            gap_m: 1e-6,
            friction: 0.3,
        }
    }

    fn cycle(slips: bool, opens: bool, friction_power_w: f64) -> PairCycle {
        PairCycle {
            status: CycleStatus::new(false, f64::from(u8::from(opens)), slips),
            slid_m: 1e-6,
            rubbed_nm: 1e-5,
            open_fraction: if opens { 0.25 } else { 0.0 },
            compression_mean_n: 10.0,
            compression_min_n: if opens { 0.0 } else { 4.0 },
            compression_max_n: 16.0,
            landing: None,
            friction_power_w,
        }
    }

    pub(in crate::results) fn orbit(frequency_hz: f64, outcome: Outcome, amplitude: f64) -> Orbit {
        Orbit {
            cycles: vec![
                cycle(true, true, 3.0),
                cycle(true, false, 2.0),
                cycle(false, false, 0.0),
            ],
            observed: vec![vec![0.0, amplitude, 0.0]],
            observed_amplitude: vec![amplitude],
            friction_power_w: 5.0,
            viscous_power_w: 1.0,
            input_power_w: 6.0,
            kinetic_energy_j: 0.25,
            newton_iterations: 3,
            krylov_iterations: 9,
            residual: 1e-10,
            ..Orbit::motionless(frequency_hz, outcome)
        }
    }

    /// Three frequencies with the linear peak in the middle, which failed.
    pub(in crate::results) fn response() -> Response {
        let linear = [(10.0, 1.0), (20.0, 8.0), (30.0, 2.0)]
            .map(|(frequency_hz, a)| LinearPoint {
                frequency_hz,
                observed_amplitude: vec![a],
            })
            .to_vec();
        Response {
            linear: linear.clone(),
            linear_curve: linear,
            orbits: vec![
                orbit(10.0, Outcome::Converged, 1.0),
                orbit(20.0, Outcome::Stagnated, 99.0),
                orbit(30.0, Outcome::Converged, 2.0),
            ],
            branches: vec![Branch::swept(3)],
            second_motions: Vec::new(),
            bifurcations: Vec::new(),
            two_periods: Vec::new(),
            slip_threshold_m: 1e-9,
        }
    }

    #[test]
    fn a_pair_that_is_open_at_rest_does_not_separate() {
        let statuses = [CycleStatus::Open, CycleStatus::Closing];
        let mut response = response();
        response.orbits.truncate(1);
        let of_status = |status| PairCycle {
            status,
            ..cycle(false, false, 0.0)
        };
        response.orbits[0].cycles = statuses.map(of_status).to_vec();
        let fields = cycle_fields(&response.orbits[0], &[pair(1.0), pair(1.0)]);
        assert_eq!(fields.status, statuses);
        let fields = sweep_fields(&response, 2);
        assert_eq!(fields.separates, [false; 2]);
        assert_eq!(fields.opening_share, [0.0; 2]);
    }

    #[test]
    fn fields_of_a_cycle_are_per_area_and_have_one_status_each() {
        let pairs = [pair(0.5), pair(2.0), pair(1.0)];
        let fields = cycle_fields(&orbit(4.0, Outcome::Converged, 0.0), &pairs);
        let words: Vec<String> = fields.status.iter().map(ToString::to_string).collect();
        assert_eq!(words, ["opening", "slipping", "stuck"]);
        assert_eq!(fields.pressure_mean_pa, [20.0, 5.0, 10.0]);
        assert_eq!(fields.pressure_min_pa, [0.0, 2.0, 4.0]);
        assert_eq!(fields.pressure_max_pa, [32.0, 8.0, 16.0]);
        // 3 W and 2 W at 4 Hz.
        assert_eq!(fields.friction_energy_j_m2, [1.5, 0.25, 0.0]);
        assert_eq!(fields.slid_m, [1e-6; 3]);
        assert_eq!(fields.open_fraction, [0.25, 0.0, 0.0]);
    }

    #[test]
    fn phasors_rebuild_the_signal() {
        let coefficients = [0.7, -1.0, 2.0, 0.5, -0.25, 0.0, -3.0];
        let phasors = phasors(&coefficients);
        assert_eq!(phasors.len(), 3);
        for step in 0..7 {
            let wt = 0.9 * step as f64;
            let direct: f64 = (1..=3)
                .map(|k| {
                    let a = k as f64 * wt;
                    coefficients[cosine(k)] * a.cos() + coefficients[sine(k)] * a.sin()
                })
                .sum();
            let rebuilt: f64 = phasors
                .iter()
                .enumerate()
                .map(|(k, p)| p.amplitude * ((k + 1) as f64 * wt - p.phase_rad).cos())
                .sum();
            assert!((direct - rebuilt).abs() < 1e-14, "{direct} {rebuilt}");
        }
        assert!(super::phasors(&[]).is_empty());
    }

    /// `2 cos(w t / 2) + cos(w t)`, whose range is 4.5 over two periods of w.
    #[test]
    fn a_motion_of_two_periods_has_half_of_its_range_as_amplitude() {
        let coefficients = vec![0.25, 2.0, 0.0, 1.0, 0.0];
        let [first, second, both] = half_ranges(&coefficients);
        // From 3 at the beginning down to -1 after a period, with -1.5 a third of a period before it.
        assert!((first - 2.25).abs() < 1e-4 && (second - 2.25).abs() < 1e-4);
        assert!((both - 2.25).abs() < 1e-4);
        let doubled = Orbit {
            observed: vec![coefficients],
            ..Orbit::motionless(5.0, Outcome::Converged)
        };
        let (shown, each) = at_excitation_frequency(&doubled);
        assert_eq!(each, [[first, second]]);
        assert_eq!(shown.frequency_hz, 10.0);
        assert_eq!(shown.observed, [[0.25, 1.0, 0.0]]);
        assert_eq!(shown.observed_amplitude, [both]);
        // A sine of half the frequency is half a wave in each period.
        let [first, second, both] = half_ranges(&[0.0, 0.0, 2.0]);
        assert!(
            (first - 1.0).abs() < 1e-3 && (second - 1.0).abs() < 1e-3,
            "{first} {second}"
        );
        assert!((both - 2.0).abs() < 1e-3);
    }

    #[test]
    fn means_leave_out_what_did_not_converge() {
        let swept = sweep_fields(&response(), 3);
        assert_eq!(swept.points, 2);
        assert_eq!(swept.friction_power_mean_w, [3.0, 2.0, 0.0]);
        assert_eq!(swept.opening_share, [1.0, 0.0, 0.0]);
        assert_eq!(swept.separates, [true, false, false]);
    }

    #[test]
    fn points_of_a_branch_that_was_followed_count_by_the_range_around_them() {
        let mut followed = response();
        followed.orbits = [(10.0, 1.0), (11.0, 2.0), (13.0, 4.0)]
            .map(|(frequency_hz, power_w)| {
                let mut orbit = orbit(frequency_hz, Outcome::Converged, 1.0);
                orbit.cycles[0].friction_power_w = power_w;
                orbit
            })
            .to_vec();
        followed.branches[0].lengths = vec![0.0, 0.1, 0.3];
        let found = sweep_fields(&followed, 3);
        // 0.5, 1.5 and 1 Hz of 3 Hz.
        assert_eq!(found.friction_power_mean_w[0], 2.5);
        assert_eq!(found.points, 3);
    }

    /// Power over friction that depends on frequency alone: with twice and with ten times as many
    /// points the means are the same except for the ends of the range.
    #[test]
    fn nothing_of_a_sweep_grows_with_the_number_of_frequencies() {
        let swept = |points: usize| {
            let mut response = response();
            response.orbits = (0..points)
                .map(|i| {
                    let at = i as f64 / (points - 1) as f64;
                    let mut orbit = orbit(10.0 + at, Outcome::Converged, 1.0);
                    orbit.point = i;
                    orbit.cycles[0].friction_power_w = at * (1.0 - at);
                    orbit.cycles[0].status = if (0.25..0.5).contains(&at) {
                        CycleStatus::Opening
                    } else {
                        CycleStatus::Slipping
                    };
                    orbit
                })
                .collect();
            sweep_fields(&response, 3)
        };
        for points in [101, 201, 1001] {
            let found = swept(points);
            let ends = 2.0 / points as f64;
            assert!((found.friction_power_mean_w[0] - 1.0 / 6.0).abs() < ends);
            assert!((found.opening_share[0] - 0.25).abs() < ends);
        }
    }

    #[test]
    fn friction_that_takes_nothing_but_rounding_takes_nothing() {
        let mut orbit = orbit(1.0, Outcome::Converged, 1.0);
        assert_eq!(friction_power_w(&orbit), 5.0);
        for power_w in [0.0, -1e-3, 1e-12, -1e-15] {
            orbit.friction_power_w = power_w;
            assert_eq!(friction_power_w(&orbit), 0.0, "{power_w}");
        }
        orbit.friction_power_w = 1e-6;
        assert_eq!(friction_power_w(&orbit), 1e-6);
    }

    #[test]
    fn the_largest_of_pairs_is_known_where_all_are() {
        assert_eq!(largest_of_pairs(&[1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(largest_of_pairs(&[-1e-18, -2.0]), Some(0.0));
        assert_eq!(largest_of_pairs(&[1.0, f64::NAN]), None);
        assert_eq!(largest_of_pairs(&[]), None);
    }

    #[test]
    fn pressure_is_positive_in_compression_and_the_gap_counts_the_clearance() {
        let state = StaticState {
            outcome: Outcome::Converged,
            x: vec![-1e-6, 3e-6, 4e-6, 5e-6, 0.0, 0.0],
            lambda: vec![-8.0, 1.0, 2.0, 0.0, 0.0, 0.0],
            status: vec![PairStatus::Slipping, PairStatus::Open],
            newton_iterations: 1,
            residual: 0.0,
            retention_n: None,
            linear: LinearReference::stuck(&ReducedModel::from_pair_matrices(
                Mat::identity(3, 3),
                Mat::identity(3, 3),
            )),
            on_path: Vec::new(),
            ended_at: None,
        };
        let fields = static_fields(&state, &[pair(0.5), pair(2.0)]);
        assert_eq!(fields.pressure_pa, [16.0, 0.0]);
        assert!(fields.normal_force_n[1].is_sign_positive());
        assert_eq!(fields.slip_m[0], [3e-6, 4e-6]);
        assert_eq!(fields.friction_n[0], [1.0, 2.0]);
        assert_eq!(fields.gap_m[0], 0.0);
        assert!((fields.gap_m[1] - 6e-6).abs() < 1e-20);
    }

    #[test]
    fn energy_balance_is_relative_to_the_largest_power() {
        let mut point = orbit(1.0, Outcome::Converged, 1.0);
        assert_eq!(energy_balance_error(&point), Some(0.0));
        point.input_power_w = 8.0;
        assert_eq!(energy_balance_error(&point), Some(0.25));
        (
            point.input_power_w,
            point.friction_power_w,
            point.viscous_power_w,
        ) = (0.0, 0.0, 0.0);
        assert_eq!(energy_balance_error(&point), None);
    }
}
