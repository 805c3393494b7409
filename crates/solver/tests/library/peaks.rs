//! Peaks over a value of the scene, beside the peaks of whole curves.

use std::path::PathBuf;

use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::{
    FrequencyRange, ReducedModelSpec, ResponseSpec, Scene, StaticSpec,
};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::excitation::NamedExcitation;
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use dovetail_solver::results::peak::peak;
use dovetail_solver::run::{self, Error, Options, PeakRange, Peaks, Session, peaks as peaks_over};
use dovetail_solver::superelement::{NamedContact, Superelement};
use faer::Mat;

use crate::shared_problems::diagonal;

/// A mass of 1 kg on a spring of 1 N/m in front of a stop of 5 N/m at 1 m, and a second one that
/// nothing couples with it, on 4 N/m. What is observed is the sum of both, of which the second one
/// gets 1.6 times the force: it has the higher peak where the stop has stiffened the first one.
fn stop_and_mass() -> ReducedModel {
    let along = |v: f64| vec![v, 0.0, 0.0];
    ReducedModel {
        static_load: Load::new(along(0.0), vec![0.0]),
        unit_loads: vec![Load::new(along(1.0), vec![1.6])],
        observations: vec![ObservedPoint::new("tip", along(1.0), vec![1.0])],
        ..ReducedModel::new(
            diagonal([1.0, 1.0, 1.0]),
            diagonal([1.0, 1.0, 1.0]),
            Mat::zeros(3, 1),
            vec![4.0],
        )
    }
}

/// Scene about the model under a force.
fn scene(force_n: f64) -> Scene {
    let range = FrequencyRange::Hz {
        from_hz: 0.1,
        to_hz: 0.4,
    };
    let mut response = ResponseSpec::new(range, Resolution::fixed(3, 64));
    response.slip_threshold_m = Some(1e-9);
    Scene {
        damping: DampingSpec::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: 0.03,
        },
        static_state: StaticSpec {
            load_steps: 1,
            ..StaticSpec::default()
        },
        ..Scene::new(
            "stop",
            ReducedModelSpec {
                folder: PathBuf::new(),
                law: PairLaw {
                    stiffness: Some(PairStiffness::new(5.0, 1.0)),
                    ..PairLaw::rigid(0.0, 1.0)
                },
                force_n,
            },
            response,
        )
    }
}

/// The model with its names.
fn element() -> Superelement {
    Superelement {
        model: stop_and_mass(),
        excitations: vec![NamedExcitation::cosine("force")],
        contacts: vec![NamedContact {
            name: "stop".to_owned(),
            pairs: 1,
        }],
        positions_m: vec![[0.0; 3]],
        areas_m2: None,
    }
}

fn force_peaks(values: &[f64], amplitude_m: Option<f64>) -> Peaks {
    value_peaks(values, amplitude_m, scene)
}

fn value_peaks(values: &[f64], amplitude_m: Option<f64>, scene: impl Fn(f64) -> Scene) -> Peaks {
    let range = PeakRange {
        values,
        logarithmic: true,
        observation: None,
        amplitude_m,
        start: None,
    };
    let (mut observer, mut store) = ((), ());
    let session = Session::new(&mut observer, &mut store);
    peaks_over(
        &range,
        |value| Ok::<_, Error>(scene(value)),
        element().into(),
        &session,
    )
    .unwrap()
}

/// Highest peak of the whole curve: frequency and amplitude.
fn curve_peak(force_n: f64) -> [f64; 2] {
    scene_peak(&scene(force_n))
}

fn scene_peak(scene: &Scene) -> [f64; 2] {
    let (mut observer, mut store) = ((), ());
    let session = Session::new(&mut observer, &mut store);
    let run = run::solve(scene, element().into(), Options::default(), &session).unwrap();
    let top = peak(&run.response.unwrap().response, 0).unwrap();
    [top.frequency_hz, top.amplitude_m]
}

/// The first resonance is the higher one under small forces, and folds; the second one under large
/// forces.
#[test]
fn peaks_are_those_of_whole_curves_and_another_resonance_that_takes_over_is_told() {
    let values = [0.02, 0.05, 0.1, 0.2, 0.4, 0.8];
    let found = force_peaks(&values, None);
    assert!(found.missing.is_empty());
    assert_eq!(found.rows.len(), values.len());
    for (row, force_n) in found.rows.iter().zip(values) {
        let [frequency_hz, amplitude_m] = curve_peak(force_n);
        let off = row.orbit.observed_amplitude[0] / amplitude_m - 1.0;
        assert!(off.abs() < 1e-3, "{force_n} N: {off:e}");
        let off = row.orbit.frequency_hz / frequency_hz - 1.0;
        assert!(off.abs() < 5e-3, "{force_n} N: {off:e}");
    }
    let is_second = |row: &run::PeakAt| row.orbit.frequency_hz > 0.29;
    let taken_over = found.rows.iter().position(is_second).unwrap();
    assert!(taken_over > 1, "{taken_over}");
    let between = [values[taken_over - 1], values[taken_over]];
    assert_eq!(found.changes, [between]);
    assert_eq!(found.least, None);
}

/// The stop asks for more harmonics where the mass meets it.
#[test]
fn peaks_have_as_many_harmonics_as_an_accuracy_needs() {
    let accuracy = 0.005;
    let with = |force_n: f64, resolution: Resolution| {
        let mut scene = scene(force_n);
        scene.response.resolution = resolution;
        scene
    };
    let accurate = |force_n: f64| with(force_n, Resolution::Accuracy(accuracy));
    let found = value_peaks(&[0.02, 0.04, 0.1], None, accurate);
    assert_eq!(found.rows.len(), 3);
    for row in &found.rows {
        let (force_n, orbit) = (row.value, &row.orbit);
        let estimated = orbit.estimated_error.unwrap();
        println!(
            "{force_n} N: {} harmonics, {estimated:.1e}",
            orbit.harmonics
        );
        assert!(orbit.outcome.is_converged(), "{force_n} N");
        assert!(estimated <= accuracy, "{force_n} N: {estimated}");
        let [_, amplitude_m] = scene_peak(&with(force_n, Resolution::fixed(15, 256)));
        let off = row.amplitude_m(0) / amplitude_m - 1.0;
        assert!(off.abs() <= accuracy, "{force_n} N: {off:e}");
    }
    let [least, .., most] = [0, 1, 2].map(|i| found.rows[i].orbit.harmonics);
    assert!(least < most, "{least} {most}");
}

#[test]
fn a_force_is_found_whose_peak_has_an_amplitude() {
    let found = force_peaks(&[0.02, 0.1, 0.4], Some(1.5));
    let [force_n] = found.reached[..] else {
        panic!("{:?}", found.reached);
    };
    let [_, amplitude_m] = curve_peak(force_n);
    assert!(
        (amplitude_m / 1.5 - 1.0).abs() < 1e-3,
        "{force_n}: {amplitude_m}"
    );
    assert!(found.rows.windows(2).all(|two| two[0].value < two[1].value));
    let none = force_peaks(&[0.02, 0.03], Some(100.0));
    assert!(none.reached.is_empty());
}

/// The range ends below the second resonance. Under the largest force the curve rises to where no
/// motion is found any more, and to the end of a shorter range.
#[test]
fn a_value_without_a_peak_in_the_range_is_noted_with_its_reason() {
    let scene_to = |to_hz: f64| {
        move |force_n: f64| {
            let mut scene = scene(force_n);
            scene.response.range = FrequencyRange::Hz {
                from_hz: 0.1,
                to_hz,
            };
            Ok::<_, Error>(scene)
        }
    };
    let range = PeakRange {
        values: &[0.02, 0.03, 1.0],
        logarithmic: true,
        observation: Some("tip"),
        amplitude_m: None,
        start: None,
    };
    let (mut observer, mut store) = ((), ());
    let session = Session::new(&mut observer, &mut store);
    let found = peaks_over(&range, scene_to(0.19), element().into(), &session).unwrap();
    assert_eq!(found.rows.len(), 2);
    let [(value, error)] = &found.missing[..] else {
        panic!("{:?}", found.missing);
    };
    assert_eq!(*value, 1.0);
    let is_lost = |error: &Error| {
        matches!(error, Error::ResonanceNotComputed { from_hz, to_hz }
            if (0.17..0.19).contains(from_hz) && *to_hz == 0.19)
    };
    assert!(is_lost(error), "{error}");
    let shorter = PeakRange {
        values: &[1.0],
        ..range.clone()
    };
    let found = peaks_over(&shorter, scene_to(0.13), element().into(), &session).unwrap();
    let [(_, error)] = &found.missing[..] else {
        panic!("{:?}", found.missing);
    };
    assert!(matches!(error, Error::PeakOutside { .. }), "{error}");
    let other = PeakRange {
        observation: Some("hub"),
        ..range
    };
    let refused = peaks_over(&other, scene_to(0.19), element().into(), &session);
    assert!(matches!(refused, Err(Error::NoObservation { .. })));
}
