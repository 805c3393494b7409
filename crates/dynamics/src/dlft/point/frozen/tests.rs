//! Motions with frozen contacts on made-up models, compared with linear systems that are solved here.

use crate::contact::PairLaw;
use crate::contact::penalty::PairStiffness;
use crate::damping::Rayleigh;
use crate::dlft::settings::Resolution;
use crate::dlft::static_state::{CRITERIA, static_state};
use crate::dlft::sweep::{SweepSettings, sweep};
use crate::dlft::{Orbit, PairStatus, StaticState};
use crate::problem::{HarmonicLoad, Problem};
use crate::reduced::{Load, ObservedPoint, ReducedModel};
use dovetail_numerics::dense::{Lu, self_adjoint_eigen};
use faer::{Mat, c64};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

const FRICTION: f64 = 0.3;
const SAMPLES: usize = 64;
const DAMPING: Rayleigh = Rayleigh::stiffness_proportional(2e-6);

/// Number of displacements of the four pairs, and of the four points of the blades behind them.
const ON_PAIRS: usize = 12;
const ON_BLADES: usize = 12;

/// Force along x on the first blade, as a fraction of that along y.
const ALONG_X: f64 = 0.5;

/// Wedge between the inclined platforms of two blades, as two rods one behind the other along x, whose
/// ends lie against one platform each. It turns freely as all ends slide, and forces along z press it
/// against the platforms.
struct Wedge {
    /// Stiffness, N/m, and mass, kg, on the pairs and then on the blades (x, y, z).
    stiffness: Mat<f64>,
    mass: Mat<f64>,
    /// Forces that press the wedge, N.
    pressing_n: Vec<f64>,
}

impl Wedge {
    fn new() -> Self {
        let slope = FRAC_1_SQRT_2;
        // Rows n, t1, t2 of the pairs of both platforms in x, y, z.
        let frames = [
            [[0.0, slope, -slope], [1.0, 0.0, 0.0], [0.0, slope, slope]],
            [[0.0, -slope, -slope], [1.0, 0.0, 0.0], [0.0, -slope, slope]],
        ];
        let size = ON_PAIRS + ON_BLADES;
        // An end of a rod moves as its blade does, and as its pair does besides.
        let ends = [0, 1, 2, 3].map(|end| {
            let mut motion = Mat::<f64>::zeros(3, size);
            for i in 0..3 {
                motion[(i, ON_PAIRS + 3 * end + i)] = 1.0;
                (0..3).for_each(|c| motion[(i, 3 * end + c)] = frames[end / 2][c][i]);
            }
            motion
        });
        let on_blade = [0, 1, 2, 3].map(|end| {
            Mat::from_fn(3, size, |i, j| {
                f64::from(u8::from(j == ON_PAIRS + 3 * end + i))
            })
        });
        let (mut stiffness, mut mass) = (Mat::zeros(size, size), Mat::zeros(size, size));
        let mut join = |motion: &Mat<f64>, n_m: [f64; 3]| {
            for (i, n_m) in n_m.into_iter().enumerate() {
                let row = motion.row(i);
                stiffness += row.transpose() * row * faer::Scale(n_m);
            }
        };
        for (end, motion) in on_blade.iter().enumerate() {
            let along_y = if end < 2 { 1.5e5 } else { 1.55e5 };
            join(motion, [2e6, along_y, 2.5e6]);
        }
        for side in [0, 2] {
            join(&(&on_blade[side] - &on_blade[side + 1]), [1e7; 3]);
            join(&(&ends[side] - &ends[side + 1]), [1e7; 3]);
        }
        for rod in [0, 1] {
            join(&(&ends[rod] - &ends[rod + 2]), [2e6, 2e7, 0.0]);
        }
        let mut pressing_n = vec![0.0; size];
        for (at, end) in ends.iter().enumerate() {
            mass += end.transpose() * end * faer::Scale(5e-4);
            mass += on_blade[at].transpose() * &on_blade[at] * faer::Scale(0.015);
            (0..size).for_each(|j| pressing_n[j] += 50.0 * end[(2, j)]);
        }
        Self {
            stiffness,
            mass,
            pressing_n,
        }
    }

    /// Problem on the pairs and the modes of the blades with the pairs held. The force along y, N, acts
    /// on the first blade.
    fn problem(&self, force_n: f64) -> Problem {
        let of = |a: &Mat<f64>, rows: [usize; 2], columns: [usize; 2]| {
            a.submatrix(rows[0], columns[0], rows[1], columns[1])
                .to_owned()
        };
        let (pairs, blades) = ([0, ON_PAIRS], [ON_PAIRS, ON_BLADES]);
        // With unit masses of the blades their modes are those of the scaled stiffness.
        let scale = Mat::from_fn(ON_BLADES, ON_BLADES, |i, j| match i == j {
            true => self.mass[(ON_PAIRS + i, ON_PAIRS + i)].sqrt().recip(),
            false => 0.0,
        });
        let (omega2, vectors) =
            self_adjoint_eigen((&scale * of(&self.stiffness, blades, blades) * &scale).as_ref())
                .unwrap();
        let modes = &scale * &vectors;
        let mut follows = Mat::zeros(ON_BLADES, ON_PAIRS);
        for j in 0..ON_PAIRS {
            let mut column: Vec<f64> = (0..ON_BLADES)
                .map(|i| -self.stiffness[(ON_PAIRS + i, j)])
                .collect();
            Lu::new(of(&self.stiffness, blades, blades)).solve_column_in_place(&mut column);
            (0..ON_BLADES).for_each(|i| follows[(i, j)] = column[i]);
        }
        let basis = Mat::from_fn(ON_PAIRS + ON_BLADES, ON_PAIRS + ON_BLADES, |i, j| {
            match (i < ON_PAIRS, j < ON_PAIRS) {
                (true, true) => f64::from(u8::from(i == j)),
                (true, false) => 0.0,
                (false, true) => follows[(i - ON_PAIRS, j)],
                (false, false) => modes[(i - ON_PAIRS, j - ON_PAIRS)],
            }
        });
        let [stiffness, mass] =
            [&self.stiffness, &self.mass].map(|a| basis.transpose() * a * &basis);
        let load = |forces: &[f64]| {
            let on: Vec<f64> = (0..forces.len())
                .map(|j| (0..forces.len()).map(|i| basis[(i, j)] * forces[i]).sum())
                .collect();
            Load::new(on[..ON_PAIRS].to_vec(), on[ON_PAIRS..].to_vec())
        };
        let on_first_blade = |along_x: f64, along_y: f64| {
            let mut forces = vec![0.0; ON_PAIRS + ON_BLADES];
            forces[ON_PAIRS] = along_x;
            forces[ON_PAIRS + 1] = along_y;
            load(&forces)
        };
        let force = on_first_blade(ALONG_X * force_n, force_n);
        let along_y = on_first_blade(0.0, 1.0);
        let reduced = ReducedModel::new(
            of(&stiffness, pairs, pairs),
            of(&mass, pairs, pairs),
            of(&mass, pairs, blades),
            omega2,
        );
        Problem {
            reduced: ReducedModel {
                static_load: load(&self.pressing_n),
                observations: vec![ObservedPoint::new("blade", along_y.on_x, along_y.on_modes)],
                ..reduced
            }
            .into(),
            laws: vec![PairLaw::rigid(FRICTION, 0.0); 4],
            excitations: vec![HarmonicLoad::cosine(1, force)],
            modal_ratios: Vec::new(),
        }
    }

    /// Amplitude of the first blade along y with all pairs stuck, m: both blades and the rod, solved as
    /// one real system of cosine and sine parts.
    fn stuck_amplitude_m(&self, force_n: f64, hz: f64) -> f64 {
        let (omega, n) = (TAU * hz, ON_BLADES);
        let system = Mat::from_fn(2 * n, 2 * n, |i, j| {
            let at = (ON_PAIRS + i % n, ON_PAIRS + j % n);
            let damped = omega * DAMPING.stiffness_s * self.stiffness[at];
            match (i < n, j < n) {
                (true, false) => damped,
                (false, true) => -damped,
                _ => self.stiffness[at] - omega * omega * self.mass[at],
            }
        });
        let mut motion = vec![0.0; 2 * n];
        motion[1] = force_n;
        motion[0] = ALONG_X * force_n;
        Lu::new(system).solve_column_in_place(&mut motion);
        motion[1].hypot(motion[n + 1])
    }
}

/// Motions at these frequencies with three harmonics.
fn motions(problem: &Problem, damping: Rayleigh, hz: Vec<f64>) -> (StaticState, Vec<Orbit>) {
    let settings = SweepSettings::new(hz, Resolution::fixed(3, SAMPLES));
    let state = static_state(problem, 10, CRITERIA);
    assert!(state.outcome.is_converged());
    let orbits = sweep(problem, damping, &state, &settings, &[], &|_| ()).orbits;
    assert!(orbits.iter().all(|o| o.outcome.is_converged()));
    (state, orbits)
}

/// Largest ratio of the tangential force of a pair to its limit of friction over a period.
fn utilisation(orbit: &Orbit, n: usize, pair: usize) -> f64 {
    let at = |instant: usize, c: usize| {
        let force = |block: usize| orbit.lambda[block * n + 3 * pair + c];
        let waves = (1..=orbit.harmonics).map(|k| {
            let turn = c64::cis(TAU * (k * instant) as f64 / SAMPLES as f64);
            force(2 * k - 1) * turn.re + force(2 * k) * turn.im
        });
        force(0) + waves.sum::<f64>()
    };
    (0..SAMPLES)
        .map(|i| at(i, 1).hypot(at(i, 2)) / (-FRICTION * at(i, 0)))
        .fold(0.0, f64::max)
}

/// All ends of the wedge are at their limit of friction at rest, and the wedge is free to turn where
/// all slide. The limits differ in the vibration, and some ends have to stay where they were.
#[test]
fn a_wedge_at_its_limit_of_friction_shakes_down_in_a_few_steps() {
    let wedge = Wedge::new();
    let hz: Vec<f64> = (0..60).map(|i| 420.0 + 4.0 * f64::from(i)).collect();
    for force_n in [0.003, 0.03, 0.1] {
        let problem = wedge.problem(force_n);
        let (state, orbits) = motions(&problem, DAMPING, hz.clone());
        assert_eq!(state.status, [PairStatus::Slipping; 4]);
        for orbit in &orbits {
            let hz = orbit.frequency_hz;
            let expected = wedge.stuck_amplitude_m(force_n, hz);
            let error = orbit.observed_amplitude[0] / expected - 1.0;
            assert!(error.abs() < 1e-8, "{hz}: {error:e}");
            let iterations = orbit.newton_iterations;
            assert!(iterations <= 5, "{force_n} N, {hz} Hz: {iterations}");
            for pair in 0..4 {
                let utilised = utilisation(orbit, ON_PAIRS, pair);
                assert!(utilised < 1.0 + 1e-6, "{hz}, {pair}: {utilised}");
            }
        }
    }
}

/// Frequency of the two masses, Hz, and the force on the first, N.
const HZ: f64 = 0.13;
const FORCE_N: f64 = 0.1;
/// Damping of the two masses, 1/s.
const MASS_PER_S: f64 = 0.03;

/// Two masses of 1 kg on springs of 1 N/m, each in front of a stop, and a spring between them.
struct TwoMasses {
    /// Spring between the masses, N/m.
    spring_n_m: f64,
    /// Clearance of the first mass, which is in front of a rigid stop, m.
    gap_m: f64,
    /// Force that presses the second mass against its stop, N.
    pressing_n: f64,
    /// Springs of the second stop; `None`: it is rigid.
    stop: Option<PairStiffness>,
}

impl TwoMasses {
    fn problem(&self) -> Problem {
        let mut stiffness = Mat::<f64>::identity(6, 6);
        for (i, j) in [(0, 0), (3, 3), (0, 3), (3, 0)] {
            let sign = if i == j { 1.0 } else { -1.0 };
            stiffness[(i, j)] += sign * self.spring_n_m;
        }
        let first = |size: f64| vec![size, 0.0, 0.0, 0.0, 0.0, 0.0];
        Problem {
            reduced: ReducedModel {
                static_load: Load::new(vec![0.0, 0.0, 0.0, -self.pressing_n, 0.0, 0.0], vec![]),
                observations: vec![ObservedPoint::new("first", first(1.0), vec![])],
                ..ReducedModel::from_pair_matrices(stiffness, Mat::identity(6, 6))
            }
            .into(),
            laws: vec![
                PairLaw::rigid(FRICTION, self.gap_m),
                PairLaw {
                    stiffness: self.stop,
                    ..PairLaw::rigid(FRICTION, 0.0)
                },
            ],
            excitations: vec![HarmonicLoad::cosine(1, Load::new(first(FORCE_N), vec![]))],
            modal_ratios: Vec::new(),
        }
    }

    /// Amplitudes of the first mass, m, and of the force of the second stop, N, where the first is free
    /// and the second rests against its stop.
    fn linear_amplitudes(&self) -> [f64; 2] {
        let omega = TAU * HZ;
        let on = |stop_n_m: f64| {
            let spring = 1.0 + self.spring_n_m + stop_n_m - omega * omega;
            c64::new(spring, omega * MASS_PER_S)
        };
        let c = self.spring_n_m;
        let Some(stop) = self.stop else {
            let x = FORCE_N / on(0.0);
            return [x.norm(), c * x.norm()];
        };
        let moves = on(stop.normal_n_m);
        let x = FORCE_N / (on(0.0) - c * c / moves);
        [x.norm(), stop.normal_n_m * (c * x / moves).norm()]
    }

    fn motion(&self) -> Orbit {
        let damping = Rayleigh::mass_proportional(MASS_PER_S);
        motions(&self.problem(), damping, vec![HZ]).1.remove(0)
    }
}

#[test]
fn pairs_that_nearly_open_or_close_move_as_the_linear_system_and_others_do_not() {
    let far = TwoMasses {
        spring_n_m: 0.4,
        gap_m: 100.0,
        pressing_n: 100.0,
        stop: None,
    };
    let springs = Some(PairStiffness::new(3.0, 2.0));
    for stop in [None, springs] {
        let far = TwoMasses { stop, ..far };
        let [x, force] = far.linear_amplitudes();
        // Share of the pressing force that the stop bears and the springs of the masses do not; with the
        // first mass displaced by the spring between them.
        let borne = match stop {
            None => 1.0,
            Some(stop) => {
                let beside = 1.4 - 0.4 * 0.4 / 1.4;
                stop.normal_n_m / (stop.normal_n_m + beside)
            }
        };
        let displaced = |pressing_n: f64| match stop {
            None => 0.0,
            Some(stop) => 0.4 / 1.4 * borne * pressing_n / stop.normal_n_m,
        };
        for (margin, is_linear) in [(1.001, true), (0.9, false)] {
            if !is_linear && stop.is_none() {
                continue;
            }
            let nearly_open = TwoMasses {
                pressing_n: margin * force / borne,
                ..far
            };
            let nearly_closed = TwoMasses {
                gap_m: margin * x + displaced(far.pressing_n),
                ..far
            };
            for masses in [nearly_open, nearly_closed] {
                let orbit = masses.motion();
                let off = (orbit.observed_amplitude[0] / x - 1.0).abs();
                if is_linear {
                    assert!(off < 1e-12, "{off:e}");
                    assert_eq!(orbit.newton_iterations, 0);
                } else {
                    assert!(off > 1e-3, "{off:e}");
                }
            }
        }
    }
}

#[test]
fn a_pair_that_just_touches_stays_as_it_is_only_where_nothing_moves_it() {
    let touching = |spring_n_m: f64| TwoMasses {
        spring_n_m,
        gap_m: 100.0,
        pressing_n: 0.0,
        stop: None,
    };
    let alone = touching(0.0);
    let orbit = alone.motion();
    let [x, _] = alone.linear_amplitudes();
    assert!((orbit.observed_amplitude[0] / x - 1.0).abs() < 1e-12);
    assert_eq!(orbit.newton_iterations, 0);
    // The stop bears pushes and no pulls: the motion is between those of a mass that is held and of
    // one that is free.
    let driven = touching(0.4);
    let orbit = driven.motion();
    let omega = TAU * HZ;
    let on = c64::new(1.4 - omega * omega, omega * MASS_PER_S);
    let [held, free] = [FORCE_N / on, FORCE_N / (on - 0.16 / on)].map(|x| x.norm());
    let amplitude = orbit.observed_amplitude[0];
    assert!(held < 0.99 * amplitude && amplitude < 0.99 * free);
    let opens = orbit.lambda[6 + 3] != 0.0;
    assert!(opens);
}
