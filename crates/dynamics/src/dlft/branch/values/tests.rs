use super::*;
use crate::contact::PairLaw;
use crate::dlft::branch::{folds, follow, partial_response, stable_in_drawing};
use crate::dlft::eps::Eps;
use crate::dlft::made_up::{self, mass_with_a_stop, recorded};
use crate::dlft::settings::{EpsChoice, Resolution};
use crate::dlft::static_state::static_state;
use crate::dlft::sweep::sweep;
use crate::problem::dovetail72::{damping, dovetail72};
use crate::reduced::Load;
use dovetail_numerics::nonlinear::NewtonOptions;

const NEWTON: NewtonOptions = NewtonOptions::new(1e-8, 60);

/// Mass in front of a stop under a force of another size.
fn mass(gap_m: f64, force_n: f64) -> Problem {
    let mut problem = mass_with_a_stop(gap_m);
    problem.excitations[0].cosine = Load::new(vec![force_n, 0.0, 0.0], vec![]);
    problem
}

fn model(problem: Problem, damping: Rayleigh) -> Arc<ModelAt> {
    Arc::new(ModelAt {
        state: static_state(&problem, 10, NEWTON),
        problem,
        damping,
    })
}

/// Settings whose eps does not depend on the frequency.
fn mass_settings(frequencies_hz: Vec<f64>) -> SweepSettings {
    SweepSettings {
        eps: Eps::new(EpsChoice::Pair),
        slip_threshold_m: Some(1e-9),
        newton: NewtonOptions::new(1e-11, 60),
        ..SweepSettings::new(frequencies_hz, Resolution::fixed(5, 128))
    }
}

fn range(values: &[f64], logarithmic: bool, frequency_hz: f64) -> ValueRange {
    ValueRange {
        values: values.to_vec(),
        logarithmic,
        frequency_hz,
    }
}

/// Amplitudes of the motions at one value, ascending.
fn amplitudes_at(curve: &ValueCurve, value: f64) -> Vec<f64> {
    let points = curve.values.iter().zip(&curve.response.orbits);
    let at = points.filter(|(v, _)| **v == value);
    let mut amplitudes: Vec<f64> = at.map(|(_, o)| o.observed_amplitude[0]).collect();
    amplitudes.sort_by(f64::total_cmp);
    amplitudes
}

/// Amplitude at one frequency of a model, solved by itself.
fn single_amplitude(model: &ModelAt, settings: &SweepSettings, frequency_hz: f64) -> f64 {
    let settings = SweepSettings {
        frequencies_hz: vec![frequency_hz],
        ..settings.clone()
    };
    let ModelAt {
        problem,
        damping,
        state,
    } = model;
    let found = sweep(problem, *damping, state, &settings, &[], &|_| ());
    assert!(found.orbits[0].outcome.is_converged());
    found.orbits[0].observed_amplitude[0]
}

/// Over the force, evenly and by ratio, the mass has three motions at a force under which its
/// response over the frequency has the same three, and it folds where that response does.
#[test]
fn over_the_force_and_over_the_frequency_are_the_same_motions() {
    let frequency_hz = 0.19;
    let settings = mass_settings(vec![0.1, frequency_hz, 0.4]);
    let over_frequency = |force: f64| {
        let ModelAt {
            problem,
            damping,
            state,
        } = &*model(mass(1.0, force), made_up::DAMPING);
        follow(problem, *damping, state, &settings, &[], &|_| ())
    };
    let response = over_frequency(0.1);
    let points = response.orbits.iter();
    let mut expected: Vec<f64> = points
        .filter(|o| o.frequency_hz == frequency_hz)
        .map(|o| o.observed_amplitude[0])
        .collect();
    expected.sort_by(f64::total_cmp);
    assert_eq!(expected.len(), 3);
    let model_of = |force: f64| Some(model(mass(1.0, force), made_up::DAMPING));
    let mut solved = Vec::new();
    for logarithmic in [false, true] {
        let range = range(&[0.02, 0.1, 1.0], logarithmic, frequency_hz);
        let curve = follow_over(&range, &model_of, &settings, &[], &|_| ()).unwrap();
        let [several] = &curve.several[..] else {
            panic!("{:?}", curve.several);
        };
        assert!(several.from < 0.1 && several.to > 0.1, "{several:?}");
        let found = amplitudes_at(&curve, 0.1);
        assert_eq!(found.len(), 3, "{found:?}");
        for (a, b) in found.iter().zip(&expected) {
            assert!((a / b - 1.0).abs() < 1e-6, "{found:?} {expected:?}");
        }
        let response = &curve.response;
        assert_eq!(response.curves().len(), 1);
        // The motion in the middle is the unstable one.
        let stable = stable_in_drawing(response);
        for (i, orbit) in response.orbits.iter().enumerate() {
            if curve.values[i] == 0.1 {
                let is_middle = (orbit.observed_amplitude[0] / found[1] - 1.0).abs() < 1e-6;
                assert_eq!(stable[i], !is_middle);
            }
        }
        for fold in folds(response) {
            let of_force = over_frequency(curve.values[fold]);
            let folds_hz = folds(&of_force).into_iter();
            let folds_hz = folds_hz.map(|i| of_force.orbits[i].frequency_hz);
            let off = folds_hz.map(|hz| (hz - frequency_hz).abs());
            let off = off.reduce(f64::min).unwrap();
            assert!(off < 3e-4 * 0.3, "{}: {off:e}", curve.values[fold]);
        }
        assert_eq!(folds(response).len(), 2);
        solved.push(response.orbits.len());
    }
    assert!(solved.iter().all(|count| *count < 120), "{solved:?}");
}

/// Without its stop the mass has the amplitude `0.1 / |1 - w^2 + 0.03 i w|`. So it moves wherever the
/// clearance is larger, on one section of the curve. Where the clearance is just that, it touches.
#[test]
fn over_the_clearance_a_mass_leaves_its_linear_motion_where_it_touches_the_stop() {
    let frequency_hz = 0.19;
    let w = TAU * frequency_hz;
    let linear_m = 0.1 / (1.0 - w * w).hypot(0.03 * w);
    let settings = mass_settings(vec![]);
    let model_of = |gap_m: f64| Some(model(mass(gap_m, 0.1), made_up::DAMPING));
    let values = [0.05, linear_m, 1.0, 4.0];
    let range = range(&values, false, frequency_hz);
    let curve = follow_over(&range, &model_of, &settings, &[], &|_| ()).unwrap();
    assert_eq!(folds(&curve.response).len(), 2);
    let points = curve.values.iter().zip(&curve.response.orbits);
    let mut counts = [0; 2];
    for (gap_m, orbit) in points {
        let off = (orbit.observed_amplitude[0] / linear_m - 1.0).abs();
        if *gap_m < linear_m * (1.0 - 1e-6) {
            assert!(off > 1e-8, "{gap_m}: {off:e}");
            counts[0] += 1;
        } else if off < 0.05 {
            assert!(off < 1e-8, "{gap_m}: {off:e}");
            counts[1] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 8), "{counts:?}");
    // The stable motion that does touch it.
    let touching = model(mass(0.05, 0.1), made_up::DAMPING);
    let alone = single_amplitude(&touching, &settings, frequency_hz);
    let [only] = amplitudes_at(&curve, 0.05)[..] else {
        panic!("{:?}", curve.values);
    };
    assert!((only / alone - 1.0).abs() < 1e-6, "{only} {alone}");
    // At 1 m the response over the frequency has the same three.
    assert_eq!(amplitudes_at(&curve, 1.0).len(), 3);
}

/// 72 pairs: the force takes them from sticking to slipping all, and the friction moves their static
/// state, too.
#[test]
fn a_curve_passes_the_motions_of_single_values() {
    let problem = dovetail72(1.0);
    let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
    let resolution = Resolution::fixed(1, 64);
    let settings = SweepSettings::new(vec![], resolution);
    let damping = damping(&problem);
    let rest = static_state(&problem, 10, NEWTON);
    let of_force = |force: f64| {
        Some(Arc::new(ModelAt {
            problem: dovetail72(force),
            damping,
            state: rest.clone(),
        }))
    };
    let of_friction = |friction: f64| {
        let mut problem = dovetail72(1.0);
        let own = |law: &PairLaw| PairLaw { friction, ..*law };
        problem.laws = problem.laws.iter().map(own).collect();
        Some(model(problem, damping))
    };
    let questions: [(&ModelOf<'_>, &[f64], f64); 3] = [
        (&of_force, &[0.1, 0.3, 0.7, 1.0, 1.5, 2.2, 3.0], 0.992),
        (&of_force, &[0.1, 0.5, 1.0, 3.0], 1.004),
        (&of_friction, &[0.05, 0.1, 0.2, 0.3, 0.6], 0.992),
    ];
    for (model_of, values, ratio) in questions {
        let range = range(values, true, ratio * first_hz);
        let curve = follow_over(&range, model_of, &settings, &[], &|_| ()).unwrap();
        println!(
            "{values:?}: {} motions, {} branches, folds {:?}",
            curve.values.len(),
            curve.response.branches.len(),
            folds(&curve.response)
        );
        assert!(curve.values.len() < 80, "{}", curve.values.len());
        for value in values {
            let expected =
                single_amplitude(&model_of(*value).unwrap(), &settings, range.frequency_hz);
            let found = amplitudes_at(&curve, *value);
            let off = |a: &f64| (a / expected - 1.0).abs();
            let nearest = found.iter().map(off).reduce(f64::min);
            assert!(
                nearest.is_some_and(|off| off < 1e-4),
                "{value}: {found:?} {expected}"
            );
        }
    }
}

/// Wherever the run was broken off, between two points of either branch.
#[test]
fn a_curve_that_was_broken_off_goes_on_to_the_same_bits() {
    let settings = mass_settings(vec![]);
    let model_of = |force: f64| Some(model(mass(1.0, force), made_up::DAMPING));
    let values: Vec<f64> = (0..41).map(|i| 0.02 + 0.01 * f64::from(i)).collect();
    let range = range(&values, false, 0.19);
    let run = |earlier: &[SolvedFrequency]| {
        let (curve, told) =
            recorded(|tell| follow_over(&range, &model_of, &settings, earlier, tell).unwrap());
        let response = &curve.response;
        let text = format!(
            "{:?}{:?}{:?}",
            response.orbits, response.branches, curve.values
        );
        (text, told)
    };
    let (whole, told) = run(&[]);
    let [rising, falling] = [false, true].map(|from_last| {
        let of = |s: &&SolvedFrequency| s.along.as_ref().unwrap().from_last == from_last;
        told.iter().filter(of).cloned().collect::<Vec<_>>()
    });
    assert!(rising.len().min(falling.len()) > 20, "{}", told.len());
    for (low, high) in [(0, 0), (21, 23), (24, 41), (999, 999)] {
        let first = |of: &[SolvedFrequency], n: usize| of[..n.min(of.len())].to_vec();
        let earlier = [first(&falling, high), first(&rising, low)].concat();
        let (again, told) = run(&earlier);
        assert!(again == whole, "{low} {high}");
        assert!(told.len() >= earlier.len());
    }
    let all = partial_response(told);
    assert!(range.curve(all).values.len() >= values.len());
}

/// Where some values have no model, the curve has a gap, and goes on behind it.
#[test]
fn a_curve_goes_on_behind_values_without_a_model() {
    let settings = mass_settings(vec![]);
    let model_of = |gap_m: f64| {
        let has_none = (0.9..1.1).contains(&gap_m);
        (!has_none).then(|| model(mass(gap_m, 0.1), made_up::DAMPING))
    };
    let range = range(&[0.5, 1.5], false, 0.12);
    let curve = follow_over(&range, &model_of, &settings, &[], &|_| ()).unwrap();
    let is_in = |from: f64, to: f64| curve.values.iter().any(|v| *v > from && *v < to);
    assert!(is_in(0.5, 0.9) && is_in(1.1, 1.5) && !is_in(0.9, 1.1));
    let nowhere = |_: f64| None;
    assert!(follow_over(&range, &nowhere, &settings, &[], &|_| ()).is_none());
}

/// The column of the force, of the friction and of the clearance, at motions of pairs that stick,
/// slip and open, about static states of their own.
#[test]
fn the_column_of_a_value_is_that_by_differences() {
    let of = |change: fn(&mut Problem, f64)| {
        move |value: f64| {
            let mut problem = dovetail72(1.0);
            change(&mut problem, value);
            let damping = damping(&problem);
            Some(model(problem, damping))
        }
    };
    let force = of(|problem, value| {
        let load = &mut problem.excitations[0].cosine;
        load.on_x.iter_mut().for_each(|f| *f *= value);
        load.on_modes.iter_mut().for_each(|f| *f *= value);
    });
    let friction = of(|problem, value| {
        problem.laws.iter_mut().for_each(|law| law.friction = value);
    });
    let clearance = of(|problem, value| {
        problem.laws.iter_mut().for_each(|law| law.gap_m = value);
    });
    let questions: [(&ModelOf<'_>, [f64; 3]); 3] = [
        (&force, [0.5, 1.0, 4.0]),
        (&friction, [0.1, 0.3, 0.5]),
        (&clearance, [-1e-6, 2e-7, 1e-6]),
    ];
    let frequency_hz = 0.992 * dovetail72(1.0).reduced.omega2[0].sqrt() / TAU;
    for (model_of, [from, value, to]) in questions {
        let first = model_of(from).unwrap();
        let settings = SweepSettings::new(vec![frequency_hz], Resolution::fixed(2, 64));
        let range = range(&[from, value, to], false, frequency_hz);
        let ModelAt {
            problem,
            damping,
            state,
        } = &*first;
        let run = SweepSolvers::new(problem, *damping, state, &settings, &[], &|_| ());
        let values = Values {
            run: &run,
            range,
            model_of,
            first: Arc::clone(&first),
            slip_threshold_m: None,
        };
        let over = values.parameter(None);
        let balance = |at: f64| {
            let refinement = over.refinement(at).unwrap();
            let balance = refinement.level(0).balance(frequency_hz, Mean::Free);
            balance.unwrap()
        };
        let own = over.refinement(value).unwrap();
        let solved = own
            .level(0)
            .solve(frequency_hz, None, &mut Default::default());
        assert!(solved.is_converged());
        // Off the motion, so that the residual is not zero.
        let moved = |(i, u): (usize, &f64)| u * (1.0 + 0.01 * made_up_number(i));
        let u: Vec<f64> = solved.u.iter().enumerate().map(moved).collect();
        let evaluation = solved.balance.evaluate(&u);
        let jacobian = solved.balance.linearise(&evaluation);
        let place = DerivativePoint {
            balance: &solved.balance,
            level: 0,
            u: &u,
            abscissa: value,
        };
        let column = over.column(place, &jacobian, Use::Direction).unwrap();
        let step = 1e-5 * (to - from);
        let [above, below] =
            [value + step, value - step].map(|at| balance(at).evaluate(&u).residual);
        let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(largest > 0.0);
        for ((a, b), column) in above.iter().zip(&below).zip(&column) {
            let by_differences = (a - b) / (2.0 * step);
            let off = (by_differences - column).abs();
            assert!(off < 2e-3 * largest, "{value}: {by_differences} {column}");
        }
    }
}

/// Number between -1 and 1.
fn made_up_number(i: usize) -> f64 {
    crate::dlft::jacobians::mixed(i, 3)
}
