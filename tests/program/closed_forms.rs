//! Three problems with an answer in closed form, from scene to response.csv: scenes/verification,
//! whose models scripts/closed_form_models.py writes. Den Hartog (1931), a Jenkins oscillator, a
//! bar on a rough floor.

use crate::shared_folder::Folder;
use crate::shared_runs::{number, rows};
use crate::shared_work::workspace;
use dovetail::scene;
use dovetail_solver::excitation::NamedExcitation;
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use dovetail_solver::run::Options;
use dovetail_solver::superelement::{NamedContact, Superelement};
use dovetail_testkit::folder::root;
use faer::Mat;

/// Results of a run at its only frequency.
#[derive(Debug)]
struct Answer {
    amplitude_m: f64,
    /// Friction work of a cycle.
    work_j: f64,
    input_j: f64,
    viscous_j: f64,
    /// Distance that the first pair slides in a cycle.
    slid_m: f64,
}

impl Answer {
    /// Input work less the work of friction and damping, over the input work.
    fn energy_error(&self) -> f64 {
        (self.input_j - self.work_j - self.viscous_j) / self.input_j
    }
}

/// Runs scenes/verification/NAME.toml, changed as by `--set`, through the whole program except its
/// command line.
fn solve(name: &str, set: &[String]) -> Answer {
    let folder = Folder::new(name);
    let scene_file = root().join(format!("scenes/verification/{name}.toml"));
    let scene = scene::load(&scene_file, set).unwrap();
    let (work, _) = workspace(&scene, scene_file, &folder);
    work.solve(Options::default())
        .and_then(|run| Ok(run.verdict()?))
        .unwrap_or_else(|e| panic!("{name} {set:?}: {e}"));
    let [response, contact] = ["response.csv", "contact.csv"].map(|file| rows(&folder.join(file)));
    assert_eq!(response.len(), 1, "one frequency was asked for");
    let response = &response[0];
    let per_cycle = |column: &str| number(response, column) / number(response, "frequency_hz");
    Answer {
        amplitude_m: number(response, "tip_amplitude_m"),
        work_j: per_cycle("friction_power_w"),
        input_j: per_cycle("input_power_w"),
        viscous_j: per_cycle("viscous_power_w"),
        slid_m: number(&contact[0], "peak_slid_m"),
    }
}

fn frequency_text(hz: f64) -> String {
    format!("response.frequency_hz=[{hz}, {hz}]")
}

// ------------------------------------------------------------------------------- Den Hartog

/// Amplitude for m = k = P = 1, b the ratio of frequencies, without stops: sqrt(V^2 - U^2 F^2).
fn den_hartog(b: f64, f: f64) -> f64 {
    let u = (std::f64::consts::PI / b).sin() / (b * (1.0 + (std::f64::consts::PI / b).cos()));
    let v = 1.0 / (1.0 - b * b);
    (v * v - u * u * f * f).sqrt()
}

/// Relative error of the amplitude.
fn den_hartog_error(b: f64, f: f64, harmonics: usize) -> f64 {
    let set = [
        frequency_text(b),
        format!("reduced_model.friction={f}"),
        format!("response.harmonics={harmonics}"),
        "response.samples=512".to_string(),
    ];
    let answer = solve("den_hartog", &set);
    assert_eq!(answer.viscous_j, 0.0, "nothing but friction takes energy");
    assert!(
        (answer.work_j / answer.input_j - 1.0).abs() < 1e-6,
        "{answer:?}"
    );
    answer.amplitude_m / den_hartog(b, f) - 1.0
}

/// Errors, and their extrapolation to all harmonics: the parabola in 1 / (H + 1) through the last
/// three.
fn den_hartog_row(b: f64, f: f64, harmonics: &[usize]) -> (Vec<f64>, f64) {
    let errors: Vec<f64> = harmonics
        .iter()
        .map(|&h| den_hartog_error(b, f, h))
        .collect();
    assert!(
        errors
            .windows(2)
            .all(|e| e[1].abs() < e[0].abs() && e[1] * e[0] > 0.0),
        "b = {b}, F = {f}: {errors:?} falls with H, from one side"
    );
    let last: Vec<(f64, f64)> = harmonics
        .iter()
        .map(|&h| 1.0 / (h + 1) as f64)
        .zip(errors.iter().copied())
        .skip(harmonics.len() - 3)
        .collect();
    let weight = |s: f64| -> f64 {
        let others = last.iter().map(|p| p.0).filter(|t| *t != s);
        others.map(|t| t / (t - s)).product()
    };
    let limit = last.iter().map(|&(s, error)| error * weight(s)).sum();
    println!("b = {b}, F = {f}: H = {harmonics:?}: {errors:+.4?}, all: {limit:+.4}");
    (errors, limit)
}

#[test]
fn the_printed_amplitudes_are_those_of_the_formula() {
    for (b, amplitudes) in [
        (0.7, [1.927775, 1.825167, 1.639948]),
        (1.25, [1.708218, 1.480050, 0.988996]),
        (1.5, [0.765942, 0.653197, 0.400000]),
    ] {
        for (f, amplitude) in [0.2, 0.4, 0.6].into_iter().zip(amplitudes) {
            assert!((den_hartog(b, f) - amplitude).abs() < 1e-6);
        }
    }
}

#[test]
fn den_hartogs_amplitude_is_approached_as_harmonics_are_added() {
    for b in [0.7, 1.25, 1.5] {
        for (f, within) in [(0.2, 0.003), (0.4, 0.015), (0.6, 0.06)] {
            let (_, limit) = den_hartog_row(b, f, &[1, 3, 5, 9]);
            assert!(limit.abs() < within, "b = {b}, F = {f}: {limit}");
        }
    }
    let (errors, limit) = den_hartog_row(0.7, 0.2, &[9, 15, 31]);
    let order = (errors[1] / errors[2]).log2();
    assert!((order - 1.0).abs() < 0.1, "{order}");
    assert!(limit.abs() < 5e-4, "{limit}");
}

#[test]
#[ignore = "slow: make verify"]
fn den_hartogs_amplitude_with_up_to_sixty_three_harmonics() {
    for b in [0.7, 1.25, 1.5] {
        for f in [0.2, 0.4, 0.6] {
            let (errors, limit) = den_hartog_row(b, f, &[1, 3, 5, 9, 15, 31, 63]);
            assert!(errors[6].abs() < 0.05, "b = {b}, F = {f}: {errors:?}");
            assert!(limit.abs() < 0.005, "b = {b}, F = {f}: {limit}");
        }
    }
}

// ------------------------------------------------------------------------- Jenkins oscillator

#[test]
fn jenkins_one_harmonic_is_the_closed_form() {
    // Force, frequency, amplitude; slid per cycle 4 (A - fc / kd), with the work fc times that.
    for (force_n, hz, amplitude) in [
        (0.25, 1.05, 1.95379955),
        (0.25, 1.2, 0.87913353),
        (0.15, 1.1, 0.81336312),
    ] {
        let answer = solve(
            "jenkins",
            &[
                frequency_text(hz),
                format!("reduced_model.force_n={force_n}"),
            ],
        );
        let slid = 4.0 * (amplitude - 0.2 / 0.5);
        let work = 0.2 * slid;
        println!(
            "P = {force_n}, w = {hz}: A = {:.8} ({:+.1e}), W = {:.8} ({:+.1e}), \
             slid {:+.1e}, energy {:+.1e}",
            answer.amplitude_m,
            answer.amplitude_m / amplitude - 1.0,
            answer.work_j,
            answer.work_j / work - 1.0,
            answer.slid_m / slid - 1.0,
            answer.energy_error()
        );
        assert!((answer.amplitude_m / amplitude - 1.0).abs() < 1e-6);
        assert!((answer.work_j / work - 1.0).abs() < 1e-6);
        assert!((answer.slid_m / slid - 1.0).abs() < 1e-6);
        // The dashpot damps the mass, which is the pair's and the mode's, and what couples them.
        assert!(answer.viscous_j > 0.1 * answer.input_j, "{answer:?}");
        assert!(answer.energy_error().abs() < 1e-12, "{answer:?}");
    }
}

#[test]
fn with_another_eps_the_cut_harmonics_move_the_mass() {
    // eps = kd / 1.5 and 4 kd: one harmonic is then another truncation.
    for eps_scale in [1.0, 6.0] {
        let answer = solve("jenkins", &[format!("response.eps_scale={eps_scale}")]);
        assert!(
            (answer.amplitude_m / 1.95379955 - 1.0).abs() > 0.02,
            "{answer:?}"
        );
    }
}

#[test]
fn jenkins_with_all_harmonics_is_the_integration_in_time() {
    // benches/jenkins_in_time.py: from event to event, relative tolerance 1e-12.
    let (amplitude, work) = (1.946131257, 1.236905005);
    let errors = [3, 9, 31].map(|harmonics| {
        let samples = "response.samples=16384".to_string();
        let answer = solve(
            "jenkins",
            &[format!("response.harmonics={harmonics}"), samples],
        );
        let errors = [
            answer.amplitude_m / amplitude - 1.0,
            answer.work_j / work - 1.0,
        ];
        println!(
            "H = {harmonics}: A {:+.1e}, W {:+.1e}",
            errors[0], errors[1]
        );
        errors.map(f64::abs).into_iter().fold(0.0, f64::max)
    });
    assert!(
        errors[0] < 5e-4 && errors[1] < 2e-5 && errors[2] < 2e-6,
        "{errors:?}"
    );
}

#[test]
fn a_jenkins_element_of_a_pair_with_springs_is_that_of_a_slider_behind_a_spring() {
    let (amplitude, work) = (1.946131257, 1.236905005);
    let answer = solve("jenkins_springs", &[]);
    let errors = [
        answer.amplitude_m / amplitude - 1.0,
        answer.work_j / work - 1.0,
    ];
    println!("A {:+.1e}, W {:+.1e}", errors[0], errors[1]);
    assert!(errors.iter().all(|e| e.abs() < 2e-5), "{errors:?}");
    // Ten times stiffer, the spring is another one.
    let stiffer = "reduced_model.tangential_stiffness_n_m=5".to_string();
    let other = solve("jenkins_springs", &[stiffer]);
    assert!(
        (other.amplitude_m / amplitude - 1.0).abs() > 0.1,
        "{other:?}"
    );
}

// ------------------------------------------------------------------------------ microslip bar

/// The model that scripts/closed_form_models.py writes, for any number of elements.
fn bar(elements: usize) -> Superelement {
    let (nodes, h) = (elements + 1, 1.0 / elements as f64);
    let is_end = |i: usize| i == 0 || i == elements;
    let n = 3 * nodes;
    let stiffness = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 if is_end(i / 3) => 1.0 / h,
        0 => 2.0 / h,
        3 if i % 3 == 1 => -1.0 / h,
        _ => 0.0,
    });
    let first = |value: f64| (0..n).map(|i| if i == 1 { value } else { 0.0 }).collect();
    let load = |on_x: Vec<f64>| Load {
        on_x,
        on_modes: vec![],
    };
    let preload = |i: usize| match i % 3 {
        0 if is_end(i / 3) => -0.5 * h,
        0 => -h,
        _ => 0.0,
    };
    Superelement {
        model: ReducedModel {
            static_load: load((0..n).map(preload).collect()),
            unit_loads: vec![load(first(1.0))],
            observations: vec![ObservedPoint::new("tip", first(1.0), vec![])],
            ..ReducedModel::from_pair_matrices(stiffness, Mat::zeros(n, n))
        },
        excitations: vec![NamedExcitation::cosine("force")],
        contacts: vec![NamedContact {
            name: "floor".to_owned(),
            pairs: nodes,
        }],
        positions_m: (0..nodes).map(|i| [i as f64 * h, 0.0, 0.0]).collect(),
        areas_m2: None,
    }
}

#[test]
fn the_committed_bar_is_the_bar_of_this_file() {
    let folder = root().join("scenes/verification/microslip_bar");
    let [a, b] = [bar(9), dovetail_superelement::read(&folder).unwrap()].map(|s| s.model);
    assert!((a.stiffness - b.stiffness).norm_max() < 1e-14);
    for (a, b) in a.static_load.on_x.iter().zip(&b.static_load.on_x) {
        assert!((a - b).abs() < 1e-16);
    }
    assert_eq!(a.unit_loads, b.unit_loads);
    assert_eq!(a.observations, b.observations);
}

fn bar_answer(elements: usize, harmonics: usize) -> Answer {
    let folder = Folder::new("bar");
    dovetail_superelement::write(&folder, &bar(elements)).unwrap();
    let set = [
        format!("reduced_model.folder={}", folder.display()),
        format!("response.harmonics={harmonics}"),
        format!("response.samples={}", 16 * harmonics),
    ];
    let answer = solve("microslip_bar", &set);
    println!(
        "{elements} elements, H = {harmonics}: slip {:.6} ({:+.6}), work {:.6} ({:+.6})",
        answer.amplitude_m,
        answer.amplitude_m - 0.18,
        answer.work_j,
        answer.work_j - 0.144
    );
    answer
}

/// Nodal friction errs with h^2, times a factor that depends on where the front of slip, 0.6
/// elements, stands between two nodes: -0.08 for the slip with 4, 9, 19, 39 elements; 0.2 for the
/// work with 5, 10, 20 (the cut harmonics add about 1e-2 / H to it).
fn bar_converges(slip: &[usize], work: &[usize], harmonics: usize, within: f64) {
    let order = |errors: &[(usize, f64)]| {
        let [.., (n, e), (more, less)] = *errors else {
            panic!()
        };
        (e / less).ln() / (more as f64 / n as f64).ln()
    };
    let slips: Vec<(usize, f64)> = slip
        .iter()
        .map(|&n| (n, bar_answer(n, harmonics).amplitude_m - 0.18))
        .collect();
    let works: Vec<(usize, f64)> = work
        .iter()
        .map(|&n| (n, bar_answer(n, harmonics).work_j - 0.144))
        .collect();
    for (factor, errors) in [(-0.08, &slips), (0.2, &works)] {
        for &(n, error) in errors {
            let expected = factor / (n * n) as f64;
            assert!(
                (error - expected).abs() < within,
                "{n}: {error} for {expected}"
            );
        }
        let order = order(errors);
        println!("order {order:.2}");
        assert!((order - 2.0).abs() < 0.15, "{order}");
    }
}

#[test]
fn microslip_of_a_bar_converges_with_the_square_of_the_element() {
    bar_converges(&[4, 9], &[5, 10], 63, 2.5e-4);
}

#[test]
#[ignore = "slow: make verify"]
fn microslip_of_finer_bars_converges_with_the_square_of_the_element() {
    bar_converges(&[4, 9, 19], &[5, 10], 127, 1.2e-4);
}
