//! Contact through springs: against closed forms, steps in time, and rigid contact, which it tends to.

use std::f64::consts::TAU;

use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::dlft::settings::{Resolution, Solver};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Orbit, Outcome, PairStatus};
use dovetail_solver::integration::steady::{Settled, Until, integrate};
use dovetail_solver::integration::step::{State, Stepper};
use dovetail_solver::model::Growth;
use dovetail_solver::problem::{HarmonicLoad, LinearReference, Problem};
use dovetail_solver::reduction::damping::Rayleigh;
use dovetail_solver::reduction::{Load, ObservedDisplacement, ReducedModel, superelement};
use dovetail_testkit::folder::root;
use faer::Mat;

const NEWTON: NewtonOptions = NewtonOptions {
    tolerance: 1e-10,
    max_iterations: 60,
};

/// A mass of 1 kg on springs of 1 N/m, pressed on the ground and shaken; its pair has springs.
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
        let identity = || Mat::from_fn(3, 3, |i, j| if i == j { 1.0 } else { 0.0 });
        let load = |on_x: [f64; 3]| Load {
            on_x: on_x.to_vec(),
            on_modes: vec![],
        };
        let along = |axis: usize| ObservedDisplacement {
            name: axis.to_string(),
            on_x: (0..3).map(|i| f64::from(u8::from(i == axis))).collect(),
            on_modes: vec![],
        };
        Problem {
            reduced: ReducedModel {
                stiffness: identity(),
                mass: identity(),
                coupling: Mat::zeros(3, 0),
                omega2: vec![],
                stuck_modes: 0,
                static_load: load([-self.press_n, 0.0, 0.0]),
                unit_loads: Vec::new(),
                observations: (0..3).map(along).collect(),
            },
            laws: vec![PairLaw {
                friction: self.friction,
                gap_m: self.gap_m,
                stiffness: Some(self.springs),
            }],
            excitations: vec![HarmonicLoad {
                harmonic: 1,
                cosine: load(self.force_n[0]),
                sine: load(self.force_n[1]),
                growth: Growth::Constant,
            }],
        }
    }

    fn damping(&self) -> Rayleigh {
        Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: self.damping_per_s,
        }
    }

    /// By harmonic balance at an angular frequency.
    fn orbit(&self, omega: f64, harmonics: usize, solver: Solver) -> Orbit {
        let model = self.model();
        let state = static_state(&model, 10, NEWTON);
        assert_eq!(state.outcome, Outcome::Converged);
        let resolution = Resolution::Fixed {
            harmonics,
            samples: 1024,
        };
        let settings = SweepSettings {
            newton: NEWTON,
            solver,
            ..SweepSettings::new(vec![omega / TAU], resolution)
        };
        let response = sweep(&model, self.damping(), &state, &settings, &[], &|_| ());
        let orbit = response.orbits.into_iter().next().unwrap();
        assert!(orbit.outcome.is_converged(), "{:?}", orbit.outcome);
        orbit
    }

    /// By steps in time.
    fn settled(&self, omega: f64, steps: usize) -> Settled {
        let model = self.model();
        let mut stepper = Stepper::new(&model, self.damping(), omega / TAU, steps).unwrap();
        let mut state = State::at_rest(&model, &[0.0; 3], &[0.0; 3]);
        let until = Until {
            most_periods: 400,
            tolerance: 1e-9,
        };
        integrate(&mut stepper, &mut state, until).unwrap()
    }
}

/// Spring and slider in series beside a damped oscillator: the amplitude and the work of a period in closed form, as in
/// `time_integration`, where the spring is a mode.
#[test]
fn a_jenkins_oscillator_has_the_known_amplitude_and_work() {
    let jenkins = Mass {
        springs: PairStiffness {
            normal_n_m: 3.0,
            tangential_n_m: 0.5,
        },
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
        let amplitude = orbit.observed_amplitude_m[1];
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
        springs: PairStiffness {
            normal_n_m: 3.0,
            tangential_n_m: 0.5,
        },
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
    for (found, expected) in orbit.observed_amplitude_m[1..].iter().zip(expected) {
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
    let linear = LinearReference::about(&model, &[]);
    let mut expected = [1.0 + 3.0, 1.5, 1.5];
    expected.sort_by(f64::total_cmp);
    for (found, expected) in linear.omega2.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-12);
    }
}

/// Springs that are soft, a mass that lifts off and one that slides around: harmonic balance and steps in time, which
/// have their own forms of the law.
#[test]
fn harmonic_balance_and_steps_in_time_agree_where_pairs_with_springs_slide_and_lift_off() {
    let normal = [1.5, 0.5, 0.0];
    let around = [[0.1, 0.8, 0.2], [0.3, 0.0, 0.6]];
    for (what, force_n, opens) in [
        ("lifts off", [normal, [0.0, 0.0, 0.2]], true),
        ("slides around", around, false),
    ] {
        let mass = Mass {
            springs: PairStiffness {
                normal_n_m: 8.0,
                tangential_n_m: 4.0,
            },
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
                orbit.observed_amplitude_m[axis],
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

/// The flanks of the 72-pair model with stiffer and stiffer springs: the difference to rigid contact falls as 1 / kappa.
#[test]
fn stiff_springs_tend_to_rigid_contact_with_the_inverse_of_the_stiffness() {
    let folder = root().join("tests/data/dovetail72");
    let amplitude_m = |stiffness: Option<f64>| {
        let law = PairLaw {
            friction: 0.3,
            gap_m: 0.0,
            stiffness: stiffness.map(|n_m| PairStiffness {
                normal_n_m: n_m,
                tangential_n_m: n_m,
            }),
        };
        let model = Problem::of_one_law(superelement::read(&folder).unwrap().model, law, 1.0);
        let damping = Rayleigh {
            stiffness_s: 2.0 * 0.001 / model.reduced.omega2[0].sqrt(),
            mass_per_s: 0.0,
        };
        let state = static_state(&model, 10, NEWTON);
        assert_eq!(state.outcome, Outcome::Converged);
        let resolution = Resolution::Fixed {
            harmonics: 3,
            samples: 128,
        };
        // Below the first stuck frequency, where nothing is resonant.
        let hz = 0.98 * model.reduced.omega2[0].sqrt() / TAU;
        let settings = SweepSettings {
            newton: NEWTON,
            ..SweepSettings::new(vec![hz], resolution)
        };
        let response = sweep(&model, damping, &state, &settings, &[], &|_| ());
        let orbit = &response.orbits[0];
        assert!(
            orbit.outcome.is_converged(),
            "{stiffness:?}: {:?}",
            orbit.outcome
        );
        [
            orbit.observed_amplitude_m[0],
            response.linear[0].observed_amplitude_m[0],
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
