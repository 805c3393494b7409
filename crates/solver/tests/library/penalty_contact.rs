//! Contact through springs, compared with closed forms, steps in time, and rigid contact as its
//! limit.

use std::f64::consts::TAU;
use std::sync::Mutex;

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::damping::{DampingSpec, Rayleigh, rayleigh};
use dovetail_solver::dlft::settings::{Resolution, Solver};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Orbit, PairStatus, SolvedFrequency, SweepProgress};
use dovetail_solver::integration::steady::{SteadyMotion, Until, integrate};
use dovetail_solver::integration::step::{MotionState, Stepper};
use dovetail_solver::problem::{HarmonicLoad, LinearReference, Problem};
use dovetail_solver::reduced::{Dashpots, Load, ObservedPoint, ReducedModel, Waves};
use faer::Mat;

use crate::shared_problems::{damping_of, diagonal, dovetail72, respond};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-10, 60);

/// A mass of 1 kg on springs of 1 N/m, pressed on the ground and excited; its pair has springs.
struct Mass {
    springs: PairStiffness,
    friction: f64,
    gap_m: f64,
    press_n: f64,
    /// Amplitudes along N, t1 and t2, cosine and sine.
    force_n: [[f64; 3]; 2],
    damping_per_s: f64,
}

impl Mass {
    fn model(&self) -> Problem {
        let identity = || diagonal([1.0; 3]);
        let load = |on_x: [f64; 3]| Load::new(on_x.to_vec(), vec![]);
        let along = |axis: usize| {
            ObservedPoint::new(
                axis.to_string(),
                (0..3).map(|i| f64::from(u8::from(i == axis))).collect(),
                vec![],
            )
        };
        Problem {
            reduced: ReducedModel {
                static_load: load([-self.press_n, 0.0, 0.0]),
                observations: (0..3).map(along).collect(),
                ..ReducedModel::from_pair_matrices(identity(), identity())
            }
            .into(),
            laws: vec![PairLaw {
                stiffness: Some(self.springs),
                ..PairLaw::rigid(self.friction, self.gap_m)
            }],
            excitations: vec![HarmonicLoad {
                sine: load(self.force_n[1]),
                ..HarmonicLoad::cosine(1, load(self.force_n[0]))
            }],
            modal_ratios: Vec::new(),
        }
    }

    fn damping(&self) -> Rayleigh {
        Rayleigh::mass_proportional(self.damping_per_s)
    }

    /// Orbit by harmonic balance at an angular frequency.
    fn orbit(&self, omega: f64, harmonics: usize, solver: Solver) -> Orbit {
        let resolution = Resolution::fixed(harmonics, 1024);
        let mut settings = SweepSettings::new(vec![omega / TAU], resolution);
        settings.newton = NEWTON;
        settings.solver = solver;
        let response = respond(&self.model(), self.damping(), &settings);
        let orbit = response.orbits.into_iter().next().unwrap();
        assert!(orbit.outcome.is_converged(), "{:?}", orbit.outcome);
        orbit
    }

    /// Motion by steps in time.
    fn settled(&self, omega: f64, steps: usize) -> SteadyMotion {
        let model = self.model();
        let mut stepper = Stepper::new(&model, self.damping(), omega / TAU, steps).unwrap();
        let mut state = MotionState::resting(&model, &[0.0; 3], &[0.0; 3]);
        let until = Until::new(400, 1e-9);
        integrate(&mut stepper, &mut state, until).unwrap()
    }
}

/// Spring and slider in series beside a damped oscillator: the amplitude and the work of a period
/// in closed form, as in `time_integration`, where the spring is a mode.
#[test]
fn a_jenkins_oscillator_has_the_known_amplitude_and_work() {
    let jenkins = Mass {
        springs: PairStiffness::new(3.0, 0.5),
        friction: 0.5,
        gap_m: 0.0,
        // A quarter of it is carried by the spring of 1 N/m beside that of 3 N/m.
        press_n: 0.4 * 4.0 / 3.0,
        force_n: [[0.0, 0.25, 0.0], [0.0; 3]],
        damping_per_s: 0.02,
    };
    let omega = 1.05;
    for solver in [Solver::NewtonKrylov, Solver::Powell] {
        let orbit = jenkins.orbit(omega, 31, solver);
        let work = orbit.friction_power_w * TAU / omega;
        let amplitude = orbit.observed_amplitude[1];
        println!("A = {amplitude:.6}, W = {work:.6}");
        assert!((amplitude / 1.946123 - 1.0).abs() < 2e-5);
        assert!((work / 1.236895 - 1.0).abs() < 2e-4);
        // 4 mu N (A - mu N / kappa) is that work: there and back the slider goes twice that.
        let slid = 4.0 * (1.946123 - 0.2 / 0.5);
        assert!((orbit.cycles[0].slid_m / slid - 1.0).abs() < 2e-4);
    }
    let settled = jenkins.settled(omega, 2000);
    let (amplitude, work) = (
        settled.cycle.observed[1].amplitude_m,
        settled.cycle.work.friction_j,
    );
    println!(
        "in time: A = {amplitude:.6}, W = {work:.6}, {} periods, steady: {}",
        settled.periods, settled.steady
    );
    assert!((amplitude / 1.946123 - 1.0).abs() < 1e-4);
    assert!((work / 1.236895 - 1.0).abs() < 1e-3);
}

#[test]
fn a_pair_that_sticks_is_a_spring() {
    let stuck = Mass {
        springs: PairStiffness::new(3.0, 0.5),
        friction: 0.5,
        gap_m: -0.1,
        press_n: 8.0,
        force_n: [[0.0, 0.25, 0.1], [0.0, 0.0, 0.2]],
        damping_per_s: 0.1,
    };
    let omega = 1.1;
    let orbit = stuck.orbit(omega, 3, Solver::NewtonKrylov);
    let flexibility = 1.0 / (1.5 - omega * omega).hypot(0.1 * omega);
    let expected = [0.25, 0.1_f64.hypot(0.2)].map(|force| force * flexibility);
    for (found, expected) in orbit.observed_amplitude[1..].iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }
    assert!(orbit.friction_power_w.abs() < 1e-12);

    let model = stuck.model();
    let state = static_state(&model, 10, NEWTON);
    assert_eq!(state.status, [PairStatus::Stuck]);
    // K x + kappa (x + g) = -N.
    let expected = (-8.0 + 3.0 * 0.1) / 4.0;
    assert!((state.x[0] - expected).abs() < 1e-9, "{:?}", state.x);
    assert!((state.lambda[0] - 3.0 * (expected - 0.1)).abs() < 1e-9);
    // The linear reference has the springs.
    let linear = LinearReference::new(&model, &[]);
    let mut expected = [1.0 + 3.0, 1.5, 1.5];
    expected.sort_by(f64::total_cmp);
    for (found, expected) in linear.omega2.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-12);
    }
}

/// The springs of a pair have no damping. A ratio that is asked for is that of the whole mode, whose
/// bodies have 1 of 1.5 N/m, in the motion and in the linear reference.
#[test]
fn a_ratio_of_damping_is_reached_where_pairs_have_springs() {
    let stuck = Mass {
        springs: PairStiffness::new(3.0, 0.5),
        friction: 0.5,
        gap_m: 0.0,
        press_n: 8.0,
        force_n: [[0.0, 0.25, 0.0], [0.0; 3]],
        damping_per_s: 0.0,
    };
    let model = stuck.model();
    let linear = LinearReference::new(&model, &[]);
    let asked = DampingSpec::ratio(0.1);
    let damping = rayleigh(&asked, &linear.modes_of_first_harmonic(&model.reduced)).unwrap();
    let omega2: f64 = 1.5;
    let resolution = Resolution::fixed(3, 128);
    let mut settings = SweepSettings::new(vec![omega2.sqrt() / TAU], resolution);
    settings.newton = NEWTON;
    let response = respond(&model, damping, &settings);
    let amplitudes = [
        response.orbits[0].observed_amplitude[1],
        response.linear[0].observed_amplitude[1],
    ];
    let expected = 0.25 / (2.0 * 0.1 * omega2);
    for found in amplitudes {
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }
}

/// Springs that are soft, a mass that lifts off and one that slides around: harmonic balance and
/// steps in time, which have their own forms of the law.
#[test]
fn harmonic_balance_and_steps_in_time_agree_where_pairs_with_springs_slide_and_lift_off() {
    let normal = [1.5, 0.5, 0.0];
    let around = [[0.1, 0.8, 0.2], [0.3, 0.0, 0.6]];
    for (what, force_n, opens) in [
        ("lifts off", [normal, [0.0, 0.0, 0.2]], true),
        ("slides around", around, false),
    ] {
        let mass = Mass {
            springs: PairStiffness::new(8.0, 4.0),
            friction: 0.4,
            gap_m: 0.0,
            press_n: 1.0,
            force_n,
            damping_per_s: 0.2,
        };
        let omega = 1.6;
        let orbit = mass.orbit(omega, 21, Solver::NewtonKrylov);
        let cycle = &orbit.cycles[0];
        assert!(cycle.slid_m > 0.01, "{what}: {cycle:?}");
        assert_eq!(cycle.open_fraction > 0.0, opens, "{what}: {cycle:?}");
        let settled = mass.settled(omega, 8000);
        println!(
            "{what}: {} periods in time, steady: {}",
            settled.periods, settled.steady
        );
        for axis in 0..3 {
            let (found, steps) = (
                orbit.observed_amplitude[axis],
                settled.cycle.observed[axis].amplitude_m,
            );
            println!("{what}, axis {axis}: {found:.6} m, in time {steps:.6} m");
            assert!((found / steps - 1.0).abs() < 2e-3, "{what}, axis {axis}");
        }
        let power = settled.cycle.work.friction_j * omega / TAU;
        println!(
            "{what}: {:.6} W, in time {power:.6} W",
            orbit.friction_power_w
        );
        assert!(
            (orbit.friction_power_w / power - 1.0).abs() < 2e-2,
            "{what}"
        );
    }
}

/// The flanks of the 72-pair model with stiffer and stiffer springs: the difference to rigid
/// contact falls as 1 / kappa.
#[test]
fn stiff_springs_tend_to_rigid_contact_with_the_inverse_of_the_stiffness() {
    let amplitude_m = |stiffness: Option<f64>| {
        let law = PairLaw {
            stiffness: stiffness.map(|n_m| PairStiffness::new(n_m, n_m)),
            ..PairLaw::rigid(0.3, 0.0)
        };
        let model = dovetail72(law, 1.0);
        let resolution = Resolution::fixed(3, 128);
        // Below the first stuck frequency, where nothing is resonant.
        let hz = 0.98 * model.reduced.omega2[0].sqrt() / TAU;
        let mut settings = SweepSettings::new(vec![hz], resolution);
        settings.newton = NEWTON;
        let response = respond(&model, damping_of(&model), &settings);
        let orbit = &response.orbits[0];
        assert!(
            orbit.outcome.is_converged(),
            "{stiffness:?}: {:?}",
            orbit.outcome
        );
        [
            orbit.observed_amplitude[0],
            response.linear[0].observed_amplitude[0],
        ]
    };
    let rigid = amplitude_m(None);
    let differences = [1e9, 1e10, 1e11].map(|n_m| {
        let found = amplitude_m(Some(n_m));
        [0, 1].map(|i| found[i] / rigid[i] - 1.0)
    });
    println!("{differences:?}");
    for i in 0..2 {
        for pair in differences.windows(2) {
            let falls = pair[0][i] / pair[1][i];
            assert!(falls > 8.0 && falls < 12.0, "{differences:?}");
        }
        assert!(differences[1][i] > 1e-6);
    }
}

/// Pairs under the pressure of a Hertz contact of cylinders, whose forces fall to zero at its
/// edges.
const HERTZ_PAIRS: usize = 40;

/// Length that each pair represents, of a contact from -1 to 1 m.
const HERTZ_SPACING: f64 = 2.0 / HERTZ_PAIRS as f64;

const HERTZ_FRICTION: f64 = 0.5;

/// Stiffness per metre, N/m per metre: for each pair its own spring and that which joins it to the
/// body, in series.
const HERTZ_SHEAR: f64 = 0.5;

/// Normal force of a pair: its length times the pressure sqrt(1 - x^2), 1 N/m at the most.
fn hertz_force(pair: usize) -> f64 {
    let x = -1.0 + (pair as f64 + 0.5) * HERTZ_SPACING;
    (1.0 - x * x).sqrt() * HERTZ_SPACING
}

/// Force of all pairs at the first shift of a body that has not moved: each sticks up to its limit,
/// and the edges slide first.
fn first_loading(shift: f64) -> f64 {
    (0..HERTZ_PAIRS)
        .map(|pair| (HERTZ_SHEAR * HERTZ_SPACING * shift).min(HERTZ_FRICTION * hertz_force(pair)))
        .sum()
}

/// First harmonic of the force by Masing's rules, where the body moves as D cos(w t): in phase with
/// the displacement, and ahead of it. The energy lost per period is pi D times the second value.
fn masing(amplitude: f64, loading: fn(f64) -> f64) -> [f64; 2] {
    let steps = 20_000;
    let mut force = [0.0; 2];
    for step in 0..steps {
        // Back from D to -D; the other half is its mirror image.
        let (sin, cos) = ((step as f64 + 0.5) / steps as f64 * TAU / 2.0).sin_cos();
        let back = loading(amplitude) - 2.0 * loading(amplitude * (1.0 - cos) / 2.0);
        force[0] += 2.0 / steps as f64 * back * cos;
        force[1] -= 2.0 / steps as f64 * back * sin;
    }
    force
}

/// A body on a spring, and on pairs that are joined to it by springs. At the frequency where its
/// inertia and its spring cancel, the contact alone carries the force: the edges slide and the
/// middle sticks (Cattaneo and Mindlin, on a bed of independent springs).
#[test]
fn a_hertz_pressure_slides_from_its_edges_as_masing_has_it() {
    let n = 3 * HERTZ_PAIRS;
    let (mass, omega) = (1000.0, 1.0);
    let ground = mass * omega * omega;
    let stiffness = HERTZ_SHEAR * HERTZ_SPACING;
    // In series 1 / (3 / 4 + 1 / 4).
    let (own, link) = (4.0 / 3.0 * stiffness, 4.0 * stiffness);
    let body = ground + HERTZ_PAIRS as f64 * link;
    let along = |i: usize| i % 3 == 1;
    let psi: Vec<f64> = (0..n)
        .map(|i| if along(i) { link / body } else { 0.0 })
        .collect();
    let amplitude = 0.7;
    let [in_phase, ahead] = masing(amplitude, first_loading);
    let excited = |on: f64| {
        Load::new(
            psi.iter().map(|psi| psi * on).collect(),
            vec![on / f64::sqrt(mass)],
        )
    };
    // A spring of 1 N/m and that of the pair, the same, share it.
    let pressing = |i: usize| {
        if i.is_multiple_of(3) {
            -2.0 * hertz_force(i / 3)
        } else {
            0.0
        }
    };
    let observed = excited(1.0);
    let model = Problem {
        reduced: ReducedModel {
            stiffness: Mat::from_fn(n, n, |i, j| {
                let diagonal = match (i == j, i % 3) {
                    (true, 0) => 1.0,
                    (true, _) => link,
                    (false, _) => 0.0,
                };
                diagonal - body * psi[i] * psi[j]
            }),
            mass: Mat::from_fn(n, n, |i, j| mass * psi[i] * psi[j]),
            coupling: Mat::from_fn(n, 1, |i, _| mass.sqrt() * psi[i]),
            omega2: vec![body / mass],
            bodies_omega2: Vec::new(),
            stuck_modes: 1,
            static_load: Load::new((0..n).map(pressing).collect(), vec![0.0]),
            static_parts: Vec::new(),
            unit_loads: Vec::new(),
            observations: vec![ObservedPoint::new("body", observed.on_x, observed.on_modes)],
            dashpots: Dashpots::none(n, 1),
            waves: Waves::default(),
        }
        .into(),
        laws: vec![
            PairLaw {
                stiffness: Some(PairStiffness::new(1.0, own)),
                ..PairLaw::rigid(HERTZ_FRICTION, 0.0)
            };
            HERTZ_PAIRS
        ],
        excitations: vec![HarmonicLoad::cosine(1, excited(in_phase.hypot(ahead)))],
        modal_ratios: Vec::new(),
    };
    let resolution = Resolution::fixed(31, 512);
    let mut settings = SweepSettings::new(vec![omega / TAU], resolution);
    settings.newton = NEWTON;
    let response = respond(&model, Rayleigh::NONE, &settings);
    let orbit = &response.orbits[0];
    assert!(orbit.outcome.is_converged(), "{:?}", orbit.outcome);

    let (cos, sin) = (orbit.observed[0][1], orbit.observed[0][2]);
    let found = cos.hypot(sin);
    let force = |row: usize| -> f64 {
        (0..n)
            .filter(|i| along(*i))
            .map(|i| orbit.lambda[row * n + i])
            .sum()
    };
    let phase_force = (force(1) * cos + force(2) * sin) / found;
    let work = orbit.friction_power_w * TAU / omega;
    let expected_work = TAU / 2.0 * amplitude * ahead;
    let sliding = orbit
        .cycles
        .iter()
        .filter(|cycle| cycle.slid_m > 1e-6)
        .count();
    println!(
        "amplitude {found:.9} m ({amplitude}), stiffness {:.9} N/m ({:.9}), work {work:.9} J ({expected_work:.9}), \
         {sliding} pairs slide",
        phase_force / found,
        in_phase / amplitude
    );
    for (found, expected) in [
        (found, amplitude),
        (phase_force / found, in_phase / amplitude),
        (work, expected_work),
    ] {
        assert!((found / expected - 1.0).abs() < 2e-5, "{found} {expected}");
    }
    // Pairs slide where sqrt(1 - x^2) < 0.7.
    let expected = (0..HERTZ_PAIRS)
        .filter(|pair| hertz_force(*pair) < amplitude * HERTZ_SPACING)
        .count();
    assert_eq!(sliding, expected);

    // The sum over the pairs stands for the integral over the contact, which has a closed form.
    let of_the_contact =
        |shift: f64| HERTZ_FRICTION * (shift * (1.0 - shift * shift).sqrt() + shift.asin());
    for (sum, integral) in masing(amplitude, first_loading)
        .into_iter()
        .zip(masing(amplitude, of_the_contact))
    {
        assert!((sum / integral - 1.0).abs() < 3e-2, "{sum} {integral}");
    }
}

/// A mass of 1 kg on a spring of 40 N/m that strikes one of 1000 N/m behind a gap of 10 m (the
/// example `onedofgap` of pyHarm), and its damping.
fn mass_before_a_gap() -> (Problem, Rayleigh) {
    let along = |v: f64| vec![-v, 0.0, 0.0];
    let load = |v: f64| Load::new(along(v), vec![]);
    let problem = Problem {
        reduced: ReducedModel {
            static_load: load(0.0),
            observations: vec![ObservedPoint::new("mass", along(1.0), vec![])],
            ..ReducedModel::from_pair_matrices(diagonal([40.0, 1.0, 1.0]), diagonal([1.0; 3]))
        }
        .into(),
        laws: vec![PairLaw {
            stiffness: Some(PairStiffness::new(1000.0, 1.0)),
            ..PairLaw::rigid(0.0, 10.0)
        }],
        excitations: vec![HarmonicLoad::cosine(1, load(100.0))],
        modal_ratios: Vec::new(),
    };
    (problem, Rayleigh::mass_proportional(0.1 * 40.0_f64.sqrt()))
}

/// The curve of [`mass_before_a_gap`] folds from 1.11 to 1.36 Hz. From above the sweep
/// follows the motion that does not strike, which ends at 1.11 Hz. Further down Newton's method
/// finds no motion from there: the frequencies are solved from below.
#[test]
fn what_is_not_found_from_one_side_of_a_fold_is_found_from_the_other() {
    let (problem, damping) = mass_before_a_gap();
    let resolution = Resolution::fixed(7, 1024);
    let frequencies_hz = (0..21).map(|i| (5.6 + 0.1 * f64::from(i)) / TAU).collect();
    let settings = SweepSettings::new(frequencies_hz, resolution);
    let state = static_state(&problem, 10, settings.newton);
    let run = |earlier: &[SolvedFrequency]| {
        let told = Mutex::new(Vec::new());
        let tell = |event: SweepProgress<'_>| {
            if let SweepProgress::Solved(solved) = event {
                told.lock().unwrap().push(solved.clone());
            }
        };
        let response = sweep(&problem, damping, &state, &settings, earlier, &tell);
        (response, told.into_inner().unwrap())
    };
    let (response, told) = run(&[]);
    // A frequency that is solved again is told with its place, and a sweep that knows it takes it.
    let again = |told: &[SolvedFrequency]| told.iter().filter(|s| s.again).count();
    assert!(again(&told) > 0 && told.len() == response.orbits.len() + again(&told));
    let (resumed, retold) = run(&told);
    assert_eq!(again(&retold), again(&told));
    assert_eq!(format!("{response:?}"), format!("{resumed:?}"));
    for orbit in &response.orbits {
        let omega = TAU * orbit.frequency_hz;
        let last = told.iter().rev().find(|s| s.orbit.point == orbit.point);
        assert_eq!(format!("{orbit:?}"), format!("{:?}", last.unwrap().orbit));
        assert!(orbit.outcome.is_converged(), "{omega:.1} rad/s");
        // The motion that does not strike is that of the mass on its spring.
        let free = 100.0 / (40.0 - omega * omega).hypot(damping.mass_per_s * omega);
        let amplitude = orbit.observed_amplitude[0];
        assert!(
            amplitude > 10.0 || (amplitude / free - 1.0).abs() < 1e-9,
            "{omega:.1} rad/s: {amplitude}"
        );
    }
}

/// Frequencies that are solved again have the level of their balance in their record: they need more
/// harmonics than a sweep begins with.
#[test]
fn a_frequency_that_is_solved_again_keeps_its_level() {
    let (problem, damping) = mass_before_a_gap();
    let frequencies_hz = (0..21).map(|i| (5.6 + 0.1 * f64::from(i)) / TAU).collect();
    let settings = SweepSettings::new(frequencies_hz, Resolution::Accuracy(0.02));
    let state = static_state(&problem, 10, settings.newton);
    let told = Mutex::new(Vec::new());
    let tell = |event: SweepProgress<'_>| {
        if let SweepProgress::Solved(solved) = event {
            told.lock().unwrap().push(solved.clone());
        }
    };
    sweep(&problem, damping, &state, &settings, &[], &tell);
    let told = told.into_inner().unwrap();
    let again: Vec<_> = told.iter().filter(|solved| solved.again).collect();
    assert!(!again.is_empty());
    assert!(again.iter().any(|solved| solved.next_level > 0));
}
