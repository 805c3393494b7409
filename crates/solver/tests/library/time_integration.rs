//! Comparison of the time integration with closed forms, and of harmonic balance with the time
//! integration.

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::Response;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::sweep::SweepSettings;
use dovetail_solver::excitation::Growth;
use dovetail_solver::integration::compare::{Comparison, IntegrationStart, compare};
use dovetail_solver::integration::steady::{SteadyMotion, Until, integrate};
use dovetail_solver::integration::step::{MotionState, Stepper};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Dashpots, Load, ObservedPoint, ReducedModel};
use faer::Mat;
use std::f64::consts::TAU;

use crate::shared_problems::{damping_of, diagonal, dovetail72, respond};

const UNDAMPED: Rayleigh = Rayleigh::NONE;

/// One pair with diagonal K and M and at most one mode, pressed together by `press_n`. The
/// vibrating load acts along `axis` and on the mode, and the displacement along `axis` (and of the
/// mode) is observed.
struct OnePair {
    stiffness: [f64; 3],
    mass: [f64; 3],
    friction: f64,
    press_n: f64,
    axis: usize,
    /// Along `axis`: share of the load and of the displacement.
    share: f64,
    /// Coupling along `axis`, squared frequency.
    mode: Option<(f64, f64)>,
    force_n: f64,
}

/// Unit masses on unit springs that are pressed together by 1 N and shaken by 1 N along t1.
const PLAIN: OnePair = OnePair {
    stiffness: [1.0; 3],
    mass: [1.0; 3],
    friction: 0.5,
    press_n: 1.0,
    axis: 1,
    share: 1.0,
    mode: None,
    force_n: 1.0,
};

impl OnePair {
    fn model(&self) -> Problem {
        let modes = usize::from(self.mode.is_some());
        let (p, w2) = self.mode.unwrap_or_default();
        let along = |value: f64| {
            let mut v = vec![0.0; 3];
            v[self.axis] = value;
            v
        };
        let load = |force: f64| Load::new(along(force * self.share), vec![force; modes]);
        Problem {
            reduced: ReducedModel {
                static_load: Load::new(vec![-self.press_n, 0.0, 0.0], vec![0.0; modes]),
                observations: vec![ObservedPoint::new("u", along(self.share), vec![1.0; modes])],
                ..ReducedModel::new(
                    diagonal(self.stiffness),
                    diagonal(self.mass),
                    Mat::from_fn(3, modes, |i, _| along(p)[i]),
                    vec![w2; modes],
                )
            }
            .into(),
            laws: vec![PairLaw::rigid(self.friction, 0.0)],
            excitations: vec![HarmonicLoad::cosine(1, load(self.force_n))],
            modal_ratios: Vec::new(),
        }
    }
}

fn settle(
    model: &Problem,
    damping: Rayleigh,
    omega_rad_s: f64,
    steps: usize,
    most_periods: usize,
) -> SteadyMotion {
    let mut stepper = Stepper::new(model, damping, omega_rad_s / TAU, steps).unwrap();
    let n = model.reduced.stiffness.nrows();
    let mut state = MotionState::resting(model, &vec![0.0; n], &vec![0.0; n]);
    let until = Until::new(most_periods, 1e-9);
    integrate(&mut stepper, &mut state, until).unwrap()
}

/// Stuck, one mode of frequency 1 remains: P / |1 - b^2 + i b c|, at any step size.
#[test]
fn a_stuck_joint_is_the_linear_oscillator_whatever_the_step() {
    let b: f64 = 1.02;
    let model = OnePair {
        press_n: 1e3,
        share: 0.0,
        mode: Some((0.3, 1.0)),
        ..PLAIN
    }
    .model();
    for (a, c) in [(0.05, 0.0), (0.0, 0.05), (0.02, 0.03)] {
        let damping = Rayleigh {
            stiffness_s: a,
            mass_per_s: c,
        };
        let exact = 1.0 / (1.0 - b * b).hypot(b * (a + c));
        for steps in [20, 200] {
            let settled = settle(&model, damping, b, steps, 400);
            let [re, im] = settled.cycle.observed[0].first_harmonic_m;
            let off = re.hypot(im) / exact - 1.0;
            assert!(settled.steady && off.abs() < 1e-8, "{steps} steps: {off:e}");
            let work = settled.cycle.work;
            assert!(work.friction_j.abs() + work.impact_j.abs() < 1e-8 * work.input_j);
            assert!((work.viscous_j / work.input_j - 1.0).abs() < 1e-7);
        }
    }
}

/// A dashpot on the mode and a damping ratio of it are alike: what they spend is all that is put in.
#[test]
fn a_stuck_joint_with_a_dashpot_or_a_ratio_is_that_oscillator_too() {
    let b: f64 = 1.02;
    let plain = OnePair {
        press_n: 1e3,
        share: 0.0,
        mode: Some((0.3, 1.0)),
        ..PLAIN
    }
    .model();
    let (mut dashpot, mut ratio, mut both) = (plain.clone(), plain.clone(), plain);
    // The pair does not move; its share in the dashpot does not count.
    let on_both = Load::new(vec![0.0, 0.7, 0.0], vec![0.5]);
    dashpot.reduced_mut().dashpots = Dashpots::new(3, 1, &[(0.2, on_both)]);
    ratio.modal_ratios = vec![0.025];
    both.reduced_mut().dashpots = dashpot.reduced.dashpots.clone();
    both.modal_ratios = vec![0.01];
    let material = Rayleigh::new(0.02, 0.03);
    for (model, damping, c) in [
        (&dashpot, UNDAMPED, 0.05),
        (&dashpot, material, 0.1),
        (&ratio, UNDAMPED, 0.05),
        (&ratio, material, 0.05),
        (&both, material, 0.07),
    ] {
        let exact = 1.0 / (1.0 - b * b).hypot(b * c);
        for steps in [20, 200] {
            let settled = settle(model, damping, b, steps, 400);
            let [re, im] = settled.cycle.observed[0].first_harmonic_m;
            let off = re.hypot(im) / exact - 1.0;
            assert!(settled.steady && off.abs() < 1e-8, "{steps} steps: {off:e}");
            let work = settled.cycle.work;
            assert!((work.viscous_j / work.input_j - 1.0).abs() < 1e-7);
        }
    }
}

/// Den Hartog (1931): rigid Coulomb friction, motion without stops.
#[test]
fn a_mass_on_rigid_friction_moves_as_den_hartog_says() {
    for (b, friction_n, expected) in [
        (0.7, 0.2, 1.927775),
        (0.7, 0.4, 1.825167),
        (0.7, 0.6, 1.639948),
        (1.25, 0.2, 1.708218),
        (1.25, 0.4, 1.480050),
        (1.25, 0.6, 0.988996),
        (1.5, 0.2, 0.765942),
        (1.5, 0.4, 0.653197),
        (1.5, 0.6, 0.400000),
    ] {
        let model = OnePair {
            press_n: 2.0 * friction_n,
            ..PLAIN
        }
        .model();
        let coarse = settle(&model, UNDAMPED, b, 500, 400);
        let fine = settle(&model, UNDAMPED, b, 2000, 400);
        let off = |s: &SteadyMotion| s.cycle.observed[0].amplitude_m / expected - 1.0;
        println!(
            "b {b} F {friction_n}: {:+.1e} at 500, {:+.1e} at 2000 steps, {} periods",
            off(&coarse),
            off(&fine),
            fine.periods
        );
        // The error is of first order in the step: without damping the motion keeps wandering.
        assert!(off(&coarse).abs() < 6.0 / 500.0, "b {b} F {friction_n}");
        assert!(off(&fine).abs() < 6.0 / 2000.0, "b {b} F {friction_n}");
        let work = fine.cycle.work.friction_j / (4.0 * friction_n * expected) - 1.0;
        assert!(
            work.abs() < 6.0 / 2000.0,
            "b {b} F {friction_n}: work {work:e}"
        );
    }
}

/// Spring and slider in series beside a damped oscillator; all harmonics.
#[test]
fn a_jenkins_oscillator_has_the_known_amplitude_and_work() {
    let (k, kd, fc) = (1.0, 0.5, 0.2);
    let share = kd / (k + kd);
    let model = OnePair {
        stiffness: [1.0, kd - kd * share, 1.0],
        mass: [1.0, share * share, 1.0],
        press_n: fc / 0.5,
        share,
        mode: Some((share, k + kd)),
        force_n: 0.25,
        ..PLAIN
    }
    .model();
    // M is the oscillator's mass alone, so b M is its dashpot.
    let damping = Rayleigh::mass_proportional(0.02);
    let settled = settle(&model, damping, 1.05, 2000, 300);
    let (amplitude, work) = (
        settled.cycle.observed[0].amplitude_m,
        settled.cycle.work.friction_j,
    );
    println!(
        "A = {amplitude:.6}, W = {work:.6}, {} periods",
        settled.periods
    );
    assert!((amplitude / 1.946123 - 1.0).abs() < 5e-6);
    assert!((work / 1.236895 - 1.0).abs() < 3e-5);
}

/// A mass pressed on a rigid floor with N and excited with P cos(w t), P > N: it leaves when the
/// load does, flies freely and lands without rebound.
#[test]
fn a_pair_lifts_off_flies_and_lands() {
    let (press, p, w): (f64, f64, f64) = (1.0, 1.2, 1.0);
    let leaves = -(press / p).acos() / w;
    let place = |t: f64| {
        let s = t - leaves;
        p / (w * w) * ((w * leaves).cos() - (w * t).cos())
            - p / w * (w * leaves).sin() * s
            - 0.5 * press * s * s
    };
    // Landing and top, by bisection and by search.
    let (mut low, mut high) = (leaves + 0.5, leaves + 6.0);
    assert!(place(low) > 0.0 && place(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if place(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let flight = low - leaves;
    let top = (0..100_000)
        .map(|i| place(leaves + flight * f64::from(i) / 1e5))
        .fold(0.0, f64::max);
    let model = OnePair {
        stiffness: [0.0, 1.0, 1.0],
        press_n: press,
        axis: 0,
        force_n: p,
        ..PLAIN
    }
    .model();
    let mut last = f64::INFINITY;
    for steps in [500, 2000, 8000] {
        let settled = settle(&model, UNDAMPED, w, steps, 3);
        let seen = settled.cycle.observed[0];
        // Zero on the floor: largest departure from the mean is top - mean.
        let height = seen.mean_m + seen.amplitude_m;
        let open = settled.cycle.open_fraction[0] * TAU / w;
        println!(
            "{steps}: height {:+.1e}, flight {:+.1e}",
            height / top - 1.0,
            open / flight - 1.0
        );
        let off = (height / top - 1.0).abs();
        // Found: 65 over the square of the steps.
        assert!(
            off < 200.0 / (steps as f64).powi(2) && off < last,
            "{steps} steps"
        );
        assert!((open - flight).abs() < 3.0 * TAU / steps as f64);
        last = off;
        let work = settled.cycle.work;
        assert!(
            (work.input_j - work.impact_j).abs() < 12.0 / steps as f64 * work.input_j,
            "all input is lost in the impact: {work:?}"
        );
    }
}

const SETTLE: NewtonOptions = NewtonOptions::new(1e-10, 60);

fn balanced(model: &Problem, harmonics: usize, frequency_hz: f64) -> Response {
    let mut settings = SweepSettings::new(vec![frequency_hz], Resolution::fixed(harmonics, 256));
    settings.newton = SETTLE;
    respond(model, damping_of(model), &settings)
}

fn integrate_and_compare(
    model: &Problem,
    harmonics: usize,
    hz: f64,
    steps: usize,
    until: Until,
) -> Comparison {
    let response = balanced(model, harmonics, hz);
    assert!(response.orbits[0].outcome.is_converged());
    compare(
        model,
        damping_of(model),
        &response.orbits[0],
        IntegrationStart::Orbit { larger_by: 0.0 },
        steps,
        until,
        response.slip_threshold_m,
    )
    .unwrap()
}

/// A few periods from the motion of harmonic balance: it stays where it is.
#[test]
fn a_dovetail_of_72_pairs_keeps_the_motion_of_harmonic_balance() {
    let model = dovetail72(PairLaw::rigid(0.3, 0.0), 1.0);
    let until = Until::new(6, 0.0);
    let c = integrate_and_compare(&model, 7, 699.5, 300, until);
    println!("{c:#?}\n{:?}", c.differences());
    // Found: 3e-5, 9e-5, 1.4e-3 and 2.3e-4 of amplitude, harmonic 1, contact work and input.
    for (difference, most) in c.differences().into_iter().zip([1e-4, 3e-4, 5e-3, 1e-3]) {
        assert!(difference.unwrap().abs() < most, "{:?}", c.differences());
    }
}

/// For both methods, a load that grows as the square of the frequency equals a constant one of that
/// size at each frequency: motion, work of the excitation and work of the contacts.
#[test]
fn a_load_that_grows_with_the_frequency_is_at_each_frequency_a_constant_one() {
    const FREQUENCY_HZ: f64 = 699.5;
    let mut constant = dovetail72(PairLaw::rigid(0.3, 0.0), 1.0);
    let mut twice = constant.excitations[0].clone();
    twice.harmonic = 2;
    constant.excitations.push(twice);
    let mut growing = constant.clone();
    for load in &mut growing.excitations {
        load.growth = Growth::Squared;
        let size = (load.harmonic as f64 * TAU * FREQUENCY_HZ).powi(2);
        for part in [&mut load.cosine, &mut load.sine] {
            let all = part.on_x.iter_mut().chain(&mut part.on_modes);
            all.for_each(|f| *f /= size);
        }
    }
    let until = Until::new(1, 0.0);
    let [constant, growing] =
        [&constant, &growing].map(|model| integrate_and_compare(model, 2, FREQUENCY_HZ, 64, until));
    let figures = |c: &Comparison| [c.balance, c.integration];
    for (a, b) in figures(&constant).iter().zip(&figures(&growing)) {
        let same = |what: &str, a: f64, b: f64| {
            assert!((b / a - 1.0).abs() < 1e-6, "{what}: {a:e} {b:e}");
        };
        same("amplitude", a.amplitude_m.unwrap(), b.amplitude_m.unwrap());
        same("input", a.input_work_j, b.input_work_j);
        same("contacts", a.contact_work_j, b.contact_work_j);
        assert!(a.pairs.slipping > 0 && a.pairs.slipping == b.pairs.slipping);
    }
}

/// Near the peak, where all pairs slip: integrated until steady, which takes minutes.
#[test]
#[ignore = "slow: make verify"]
fn the_truncation_error_of_harmonic_balance_falls_with_its_harmonics() {
    let model = dovetail72(PairLaw::rigid(0.3, 0.0), 1.0);
    let until = Until::new(600, 1e-4);
    let integrated = integrate_and_compare(&model, 7, 699.5, 500, until);
    println!("{integrated:#?}");
    assert!(integrated.steady);
    let theirs = integrated.integration.first_harmonic_m.unwrap();
    let off = [1, 3, 7].map(|harmonics| {
        let response = balanced(&model, harmonics, 699.5);
        let c = &response.orbits[0].observed[0];
        (c[1].hypot(c[2]) / theirs - 1.0).abs()
    });
    println!("H = 1, 3, 7: off by {off:?}");
    assert!(off[1] < off[0] && off[2] < 2e-3, "{off:?}");
}
