//! Branches: curves of periodic motions over the frequency, or over a value of the model at one
//! frequency, followed along their length, round folds.
//!
//! A step goes from a point of the curve along its direction (`trace`). Abscissa and motion of the
//! next point are solved for together (`bordered`), which is possible where the curve turns back
//! and no motion lies farther on. What the abscissa is, `over` says: the frequency, or a value of the
//! model, of which `values` has the models. The length of a step is measured on what is observed
//! (`gauge`), and chosen by how far the cubic through the last two points misses the next one. Two
//! branches (`followed`), one from each end of the range, are followed (`follower`) to where they meet
//! (`follow`). Near a motion that is known, the curve is followed to its peak alone (`peak`).
//!
//! Two files read the finished curves and solve nothing: `folds` finds where they turn back and
//! which parts are unstable, and `several` the ranges of frequencies with several
//! motions.
//!
//! A run that was broken off goes on to the same bits. `follower` works in stretches of at least 20
//! points. At the end of each it goes on from what [`SolvedFrequency`] records, and from nothing
//! else. What a step needs from the points before it is therefore a part of that record.
//!
//! H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in:
//! Applications of bifurcation theory, 1977 (pseudo-arclength continuation).

pub(in crate::dlft) mod bordered;
mod folds;
mod follow;
mod followed;
mod follower;
mod gauge;
mod over;
mod peak;
mod several;
mod trace;
mod values;

pub use folds::{Section, folds, sections, stable, stable_in_drawing};
pub use followed::partial_response;
pub use peak::{Guess, estimated, peak_near};
pub use values::{ModelAt, ModelOf, SeveralAt, ValueCurve, ValueRange, follow_over};

use super::sweep::{SweepSettings, SweepSolvers};
use super::{Orbit, Response, SolvedFrequency, StaticState, SweepProgress};
use crate::damping::Rayleigh;
use crate::problem::Problem;

/// Follows the response from the first to the last frequency of the settings, and from the last to
/// the first. One branch comes of it where both meet, and two where they do not. Each of the
/// frequencies of the settings is solved for wherever a branch passes it. Points are added until
/// the peak of each observed amplitude, and each fold, is found.
///
/// Branches that begin at neither end are not found.
///
/// `earlier` are points that an interrupted run of the same model with the same settings solved, in
/// any order; complete stretches of 20 points are not solved again. `tell` is called from any
/// thread, for each point that is solved, `earlier` ones included. It may stop the follower
/// ([`SweepProgress::Next`]).
pub fn follow(
    problem: &Problem,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    earlier: &[SolvedFrequency],
    tell: &(dyn Fn(SweepProgress<'_>) + Sync),
) -> Response {
    let run =
        SweepSolvers::new(problem, damping, static_state, settings, earlier, tell).along_a_curve();
    run.followed(&settings.frequencies_hz)
}

/// Follows the branch near a motion from its frequency towards the first and the last frequency of the
/// settings, until it leaves the range. Other branches are not looked for.
pub(crate) fn follow_through(
    problem: &Problem,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    near: &Orbit,
) -> Response {
    let run =
        SweepSolvers::new(problem, damping, static_state, settings, &[], &|_| ()).along_a_curve();
    run.followed_through(near, &settings.frequencies_hz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::PairLaw;
    use crate::contact::penalty::PairStiffness;
    use crate::damping::Rayleigh;
    use crate::dlft::made_up::{self, mass_with_a_stop, recorded};
    use crate::dlft::settings::Resolution;
    use crate::dlft::static_state::static_state;
    use crate::dlft::sweep::sweep;
    use crate::dlft::{Outcome, Part};
    use crate::problem::dovetail72::{damping, dovetail72};
    use crate::problem::{HarmonicLoad, Problem};
    use crate::reduced::{Load, ObservedPoint, ReducedModel};
    use faer::Mat;
    use std::collections::HashSet;
    use std::f64::consts::TAU;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Frequency and amplitude of each point of a response of one branch without a gap.
    fn curve(response: &Response) -> Vec<(f64, f64)> {
        let whole = 0..response.orbits.len();
        assert_eq!(response.curves(), [whole], "{:?}", response.branches);
        let orbits = response.orbits.iter();
        orbits
            .map(|o| (o.frequency_hz, o.observed_amplitude[0]))
            .collect()
    }

    /// Without a force nothing moves, and the length of the curve is that of the frequency.
    #[test]
    fn a_curve_without_motion_is_followed_through_its_range() {
        let problem = dovetail72(0.0);
        let ends_hz = [400.0, 500.0];
        let settings = SweepSettings::new(ends_hz.to_vec(), Resolution::fixed(1, 64));
        let state = static_state(&problem, 10, settings.newton);
        let followed = follow(&problem, damping(&problem), &state, &settings, &[], &|_| ());
        let points = curve(&followed);
        assert_eq!([points[0].0, points[points.len() - 1].0], ends_hz);
        assert!(
            points.len() > 3 && points.iter().all(|p| p.1 == 0.0),
            "{points:?}"
        );
    }

    #[test]
    fn a_listener_stops_a_sweep_and_a_follower_before_their_next_frequency() {
        let problem = dovetail72(1.0);
        let frequencies_hz: Vec<f64> = (0..11).map(|i| 690.0 + f64::from(i)).collect();
        let settings = SweepSettings::new(frequencies_hz, Resolution::fixed(1, 64));
        let state = static_state(&problem, 10, settings.newton);
        for solve in [sweep, follow] {
            let told = AtomicUsize::new(0);
            let tell = |told_of: SweepProgress<'_>| match told_of {
                SweepProgress::Solved(_) => {
                    told.fetch_add(1, Ordering::Relaxed);
                }
                SweepProgress::Next(stop) if told.load(Ordering::Relaxed) >= 3 => stop.stop(),
                SweepProgress::Next(_) | SweepProgress::Tries(_) | SweepProgress::Apart => {}
            };
            let response = solve(&problem, damping(&problem), &state, &settings, &[], &tell);
            // Each of the two halves may have begun one more step.
            let most = 3 + 2 * 3;
            let solved = response.orbits.len();
            assert!((3..=most).contains(&solved), "{solved} frequencies");
            assert_eq!(response.linear.len(), solved);
        }
    }

    /// Three forces: pairs stick, slip in part, and all slip, so that the mean is retained about
    /// the resonance.
    #[test]
    fn a_branch_passes_the_motions_of_a_sweep_and_finds_the_peak_with_few_points() {
        for (force, most_points) in [(0.3, 40), (1.0, 60), (3.0, 90)] {
            let problem = dovetail72(force);
            let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
            let asked = [0.975, 0.99, 0.998, 1.01, 1.025].map(|r| r * first_hz);
            let resolution = Resolution::fixed(1, 64);
            let settings = |frequencies_hz| SweepSettings::new(frequencies_hz, resolution);
            let state = static_state(&problem, 10, settings(vec![]).newton);
            let damping = damping(&problem);
            let few = settings(asked.to_vec());
            let followed = follow(&problem, damping, &state, &few, &[], &|_| ());
            let points = curve(&followed);
            assert_eq!(followed.second_motions, []);
            assert!(points.len() < most_points, "{force}: {}", points.len());
            let (top_hz, peak) = (points.iter().copied())
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap();
            // About the resonance, and closely about the peak that was found.
            let about = (0..31).map(|i| first_hz * (0.9951 + 3e-4 * f64::from(i)));
            let near = (-4..5).map(|i| top_hz * (1.0 + 6e-5 * f64::from(i)));
            let mut all_hz: Vec<f64> = asked.into_iter().chain(about).chain(near).collect();
            all_hz.sort_by(f64::total_cmp);
            let swept = sweep(&problem, damping, &state, &settings(all_hz), &[], &|_| ());
            for hz in asked {
                let orbit = swept.orbits.iter().find(|o| o.frequency_hz == hz);
                let expected = orbit.unwrap().observed_amplitude[0];
                let found: Vec<f64> = (points.iter().filter(|p| p.0 == hz)).map(|p| p.1).collect();
                assert_eq!(found.len(), 1, "{force}: {hz}");
                let off = found[0] / expected - 1.0;
                assert!(off.abs() < 1e-4, "{force}: {hz}: {off:e}");
            }
            let swept = swept.orbits.iter().map(|o| o.observed_amplitude[0]);
            let highest = swept.fold(0.0, f64::max);
            assert!(
                (peak / highest - 1.0).abs() < 1e-3,
                "{force}: {peak} {highest}"
            );
            let lengths = &followed.branches[0].lengths;
            assert_eq!(lengths.len(), points.len());
            assert!(lengths.windows(2).all(|l| l[0] <= l[1]), "{lengths:?}");
        }
    }

    /// With a gap the stop stiffens the mass, and with interference it softens it where it opens.
    #[test]
    fn a_curve_is_followed_round_both_of_its_folds_from_either_end() {
        for (gap_m, asked_hz, turns_up) in [(1.0, 0.19, true), (-0.2, 0.25, false)] {
            let problem = mass_with_a_stop(gap_m);
            let resolution = Resolution::fixed(5, 128);
            let mut amplitudes = Vec::new();
            for ends in [[0.1, 0.4], [0.4, 0.1]] {
                let frequencies_hz = vec![ends[0], asked_hz, ends[1]];
                let mut settings = SweepSettings::new(frequencies_hz, resolution);
                settings.slip_threshold_m = Some(1e-9);
                let state = static_state(&problem, 1, settings.newton);
                let damping = made_up::DAMPING;
                let followed = follow(&problem, damping, &state, &settings, &[], &|_| ());
                let points = curve(&followed);
                let [several] = &followed.second_motions[..] else {
                    panic!("{:?}", followed.second_motions);
                };
                assert!((several.from_hz..several.to_hz).contains(&asked_hz));
                assert!(several.amplitude_m > 1.05 * several.other_amplitude_m);
                assert_eq!(
                    (points[0].0, points[points.len() - 1].0),
                    (ends[0], ends[1])
                );
                // Forwards, backwards between the folds, forwards.
                let forwards = points
                    .windows(2)
                    .map(|p| (p[1].0 > p[0].0) == (ends[1] > ends[0]));
                let mut runs: Vec<bool> = forwards.collect();
                runs.dedup();
                assert_eq!(runs, [true, false, true], "{gap_m}: {points:?}");
                let mut three: Vec<f64> = (points.iter().filter(|p| p.0 == asked_hz))
                    .map(|p| p.1)
                    .collect();
                assert_eq!(three.len(), 3, "{gap_m}: {points:?}");
                let rises = three[0] < three[2];
                assert_eq!(rises, turns_up != (ends[0] < ends[1]), "{three:?}");
                three.sort_by(f64::total_cmp);
                amplitudes.push(three);
            }
            for (a, b) in amplitudes[0].iter().zip(&amplitudes[1]) {
                assert!((a / b - 1.0).abs() < 1e-6, "{amplitudes:?}");
            }
        }
    }

    /// Three masses of 1 kg in a row on springs of 1 N/m, the last of which rubs under a constant load
    /// and friction that it takes 1 N to overcome. The difference of two responses never grows.
    fn rubbing_chain(force_n: f64) -> Problem {
        let on_pair = |size: f64| vec![0.0, size, 0.0];
        let diagonal = |along: f64| {
            let entries = [1.0, along, 1.0];
            Mat::from_fn(3, 3, |i, j| if i == j { entries[i] } else { 0.0 })
        };
        // With the last mass held, two masses move alike and opposite to each other.
        let root = 0.5_f64.sqrt();
        let inertia = [root, -root / 3.0];
        let mut reduced = ReducedModel::new(
            diagonal(1.0 / 3.0),
            diagonal(14.0 / 9.0),
            Mat::from_fn(3, 2, |i, k| on_pair(inertia[k])[i]),
            vec![1.0, 3.0],
        );
        reduced.static_load = Load::new(vec![-4.0, 0.0, 0.0], vec![0.0; 2]);
        reduced.observations = vec![ObservedPoint::new("last", on_pair(1.0), vec![0.0; 2])];
        let force = Load::new(on_pair(force_n / 3.0), vec![force_n * root; 2]);
        Problem {
            reduced: reduced.into(),
            laws: vec![PairLaw {
                stiffness: Some(PairStiffness::new(1.0, 2.0)),
                ..PairLaw::rigid(0.5, 0.0)
            }],
            excitations: vec![HarmonicLoad::cosine(1, force)],
            modal_ratios: Vec::new(),
        }
    }

    /// The response is unique at each frequency. At its superharmonic resonances the curve has corners
    /// at which it turns by more than a right angle.
    #[test]
    fn a_curve_through_sharp_corners_never_runs_back() {
        for (force_n, per_s) in [(2.0, 0.005), (2.0, 0.02), (4.0, 0.01)] {
            let problem = rubbing_chain(force_n);
            let settings = SweepSettings::new(vec![0.04, 0.16], Resolution::fixed(9, 128));
            let state = static_state(&problem, 1, settings.newton);
            let damping = Rayleigh::mass_proportional(per_s);
            let followed = follow(&problem, damping, &state, &settings, &[], &|_| ());
            let points = curve(&followed);
            assert_eq!(folds::folds(&followed), [], "{force_n} {per_s}: {points:?}");
            assert!(points.len() < 150, "{}", points.len());
            assert_eq!(followed.second_motions, []);
            // Each point is the solution of its frequency alone.
            let alone = points.iter().step_by(9).map(|p| p.0).collect();
            let settings = SweepSettings::new(alone, Resolution::fixed(9, 128));
            let swept = sweep(&problem, damping, &state, &settings, &[], &|_| ());
            for (orbit, point) in swept.orbits.iter().zip(points.iter().step_by(9)) {
                let off = orbit.observed_amplitude[0] / point.1 - 1.0;
                assert!(off.abs() < 1e-3, "{force_n} {per_s}: {point:?} {off:e}");
            }
        }
    }

    /// A curve whose records creep takes no further step. The one from the other end goes through the
    /// range, unless it creeps itself.
    #[test]
    fn a_curve_that_creeps_is_given_up() {
        let problem = mass_with_a_stop(1.0);
        let settings = SweepSettings::new(vec![0.1, 0.4], Resolution::fixed(3, 64));
        let state = static_state(&problem, 1, settings.newton);
        let run = |earlier: &[SolvedFrequency]| {
            let damping = made_up::DAMPING;
            recorded(|tell| follow(&problem, damping, &state, &settings, earlier, tell)).0
        };
        let (_, records) =
            recorded(|tell| follow(&problem, made_up::DAMPING, &state, &settings, &[], tell));
        let creeping = |from_last: bool| {
            let along = |r: &SolvedFrequency| r.along.clone().unwrap();
            let own = records.iter().filter(|r| along(r).from_last == from_last);
            let mut own: Vec<SolvedFrequency> = own.take(30).cloned().collect();
            let last = own.iter().rposition(|r| along(r).part == Part::Reached);
            own.truncate(last.unwrap() + 1);
            let last = own.last().unwrap().clone();
            own.extend((1..=320).map(|i| {
                let mut again = last.clone();
                again.along.as_mut().unwrap().step += i;
                again.orbit.point += 2 * i;
                again
            }));
            own
        };
        let one = run(&creeping(false));
        let [whole] = &one.branches[..] else {
            panic!("{:?}", one.branches);
        };
        assert_eq!(whole.given_up, None);
        let hz = |i: usize| one.orbits[i].frequency_hz;
        assert_eq!([0, whole.points.end - 1].map(hz), [0.1, 0.4]);
        let both = run(&[creeping(false), creeping(true)].concat());
        for branch in &both.branches {
            let at = branch.given_up.unwrap();
            assert!(branch.points.len() > 300 && at + 1 == branch.points.end);
        }
        assert_eq!(both.branches.len(), 2);
    }

    /// An accuracy asks for other harmonics at the corners themselves.
    #[test]
    fn a_curve_keeps_its_direction_where_its_harmonics_change() {
        for (force_n, per_s, accuracy) in [(3.0, 0.005, 0.003), (6.0, 0.01, 0.01)] {
            let problem = rubbing_chain(force_n);
            let settings = SweepSettings::new(vec![0.03, 0.2], Resolution::Accuracy(accuracy));
            let state = static_state(&problem, 1, settings.newton);
            let damping = Rayleigh::mass_proportional(per_s);
            let followed = follow(&problem, damping, &state, &settings, &[], &|_| ());
            let points = curve(&followed);
            assert_eq!(folds::folds(&followed), [], "{force_n} {per_s}: {points:?}");
            let harmonics = followed.orbits.iter().map(|orbit| orbit.harmonics);
            assert!(harmonics.collect::<HashSet<_>>().len() > 2);
        }
    }

    /// A mass with little damping before a hard stop: the curve turns back where it is touched,
    /// within a millionth of its length.
    #[test]
    fn a_curve_turns_back_where_a_hard_stop_is_touched() {
        // The amplitude of the mass without the stop, 0.1 / |1 - w^2 + 0.001 i w|, is the gap of 1.
        let touches_hz = 1.1_f64.sqrt() / TAU;
        let ends_hz = [0.4, 0.12];
        for stop_n_m in [Some(1e4), Some(1e6), None] {
            let mut problem = mass_with_a_stop(1.0);
            problem.laws[0].stiffness = stop_n_m.map(|n_m| PairStiffness::new(n_m, 1.0));
            let mut settings = SweepSettings::new(ends_hz.to_vec(), Resolution::fixed(3, 128));
            settings.slip_threshold_m = Some(1e-9);
            let state = static_state(&problem, 1, settings.newton);
            let damping = Rayleigh::mass_proportional(0.001);
            let followed = follow(&problem, damping, &state, &settings, &[], &|_| ());
            let gaps = followed.branches.iter().map(|b| b.gaps.len());
            assert_eq!(gaps.sum::<usize>(), 0, "{stop_n_m:?}");
            let found = folds::folds(&followed);
            let fold_hz = followed.orbits[found[0]].frequency_hz;
            let off = (fold_hz - touches_hz).abs() / (ends_hz[0] - ends_hz[1]);
            assert!(off < 2e-4, "{stop_n_m:?}: {fold_hz} {touches_hz}");
        }
    }

    /// A mass rubs on rigid ground (Den Hartog): no number of harmonics reaches the accuracy, so that
    /// no amplitude is known closely enough to look for a peak from.
    #[test]
    fn no_points_are_added_at_the_peak_of_a_curve_that_misses_its_accuracy() {
        let mut problem = mass_with_a_stop(0.0);
        let along = |n: f64, t: f64| vec![n, t, 0.0];
        problem.laws = vec![PairLaw::rigid(0.3, 0.0)];
        problem.reduced_mut().static_load.on_x = along(-1.0, 0.0);
        problem.reduced_mut().observations[0].on_x = along(0.0, 1.0);
        problem.excitations[0].cosine.on_x = along(0.0, 1.0);
        let settings = SweepSettings::new(vec![0.12, 0.2], Resolution::Accuracy(1e-4));
        let state = static_state(&problem, 1, settings.newton);
        let damping = made_up::DAMPING;
        let (_, told) = recorded(|tell| follow(&problem, damping, &state, &settings, &[], tell));
        let part = |s: &SolvedFrequency| s.along.as_ref().map(|along| along.part);
        let parts: Vec<_> = told.iter().map(|s| (part(s), s.orbit.outcome)).collect();
        let missed = (parts.iter()).filter(|(_, outcome)| *outcome == Outcome::AccuracyNotReached);
        assert!(missed.count() > 3, "{parts:?}");
        assert!(
            parts.iter().all(|(part, _)| *part != Some(Part::Added)),
            "{parts:?}"
        );
    }

    /// Wherever the run was broken off, between two points of either branch.
    #[test]
    fn a_branch_that_was_broken_off_goes_on_to_the_same_bits() {
        let problem = mass_with_a_stop(1.0);
        let resolution = Resolution::fixed(3, 64);
        let frequencies_hz = (0..81).map(|i| 0.1 + 0.3 * f64::from(i) / 80.0).collect();
        let mut settings = SweepSettings::new(frequencies_hz, resolution);
        settings.slip_threshold_m = Some(1e-9);
        let state = static_state(&problem, 1, settings.newton);
        let run = |earlier: &[SolvedFrequency]| {
            let damping = made_up::DAMPING;
            let (response, told) =
                recorded(|tell| follow(&problem, damping, &state, &settings, earlier, tell));
            let text = format!("{:?}{:?}", response.orbits, response.branches);
            (text, told)
        };
        let (whole, told) = run(&[]);
        let [rising, falling] = [false, true].map(|from_last| {
            let of = |s: &&SolvedFrequency| s.along.as_ref().unwrap().from_last == from_last;
            told.iter().filter(of).cloned().collect::<Vec<_>>()
        });
        assert!(rising.len().min(falling.len()) > 44, "{}", told.len());
        for (low, high) in [(0, 0), (19, 23), (24, 41), (45, 22), (999, 30), (999, 999)] {
            let first = |of: &[SolvedFrequency], n: usize| of[..n.min(of.len())].to_vec();
            let mut earlier = [first(&falling, high), first(&rising, low)].concat();
            for solved in &mut earlier {
                // Told from what is computed.
                solved.orbit.newton_iterations += 1000;
            }
            let (resumed, again) = run(&earlier);
            let kept = again
                .iter()
                .filter(|s| s.orbit.newton_iterations >= 1000)
                .count();
            let least = [low, high]
                .map(|n| n.min(44).saturating_sub(24))
                .iter()
                .sum::<usize>();
            assert!(kept >= least, "{low} {high}: {kept} kept");
            let expected = again.iter().map(|s| s.orbit.point).collect::<HashSet<_>>();
            assert_eq!(expected.len(), again.len(), "no point is told twice");
            let marked = |text: &str| {
                let fields = text.split("newton_iterations: ");
                fields
                    .map(|f| f.trim_start_matches(char::is_numeric).to_owned())
                    .collect::<String>()
            };
            assert!(marked(&resumed) == marked(&whole), "{low} {high}");
        }
    }

    /// A mass without a spring, pressed against its stop by less than what excites it: over the whole
    /// range no motion is found, and it is looked for ever farther on.
    #[test]
    fn where_there_is_no_motion_it_is_looked_for_at_few_frequencies() {
        let mut problem = mass_with_a_stop(0.0);
        problem.reduced_mut().stiffness[(0, 0)] = 0.0;
        problem.reduced_mut().static_load.on_x[0] = -0.05;
        let resolution = Resolution::fixed(1, 32);
        let mut settings = SweepSettings::new(vec![0.1, 0.4], resolution);
        settings.slip_threshold_m = Some(1e-9);
        settings.most_seconds = Some(0.0);
        let state = static_state(&problem, 1, settings.newton);
        let damping = made_up::DAMPING;
        let response = follow(&problem, damping, &state, &settings, &[], &|_| ());
        let orbits = &response.orbits;
        assert!((10..40).contains(&orbits.len()), "{}", orbits.len());
        assert!(
            orbits
                .iter()
                .all(|o| o.outcome == Outcome::NoStaticEquilibrium)
        );
        for branch in &response.branches {
            let ends = [branch.points.start, branch.points.end - 1];
            let mut ends_hz = ends.map(|i| orbits[i].frequency_hz);
            ends_hz.sort_by(f64::total_cmp);
            assert_eq!(ends_hz, [0.1, 0.4]);
        }
    }

    /// Without friction pairs open and close everywhere, and Newton's method in a plane across the
    /// curve fails at steps that the curve itself is smooth for.
    #[test]
    fn a_smooth_curve_has_few_points_where_newtons_method_needs_help() {
        let mut problem = dovetail72(2.0);
        problem.laws.iter_mut().for_each(|law| law.friction = 0.0);
        let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
        let resolution = Resolution::fixed(1, 128);
        let ends = [0.98, 1.02].map(|ratio| ratio * first_hz);
        let settings = SweepSettings::new(ends.to_vec(), resolution);
        let state = static_state(&problem, 10, settings.newton);
        let damping = damping(&problem);
        let followed = follow(&problem, damping, &state, &settings, &[], &|_| ());
        let points = curve(&followed);
        println!("{} points", points.len());
        assert!(points.len() < 30, "{}", points.len());
        for (hz, amplitude) in points {
            let mut alone = settings.clone();
            alone.frequencies_hz = vec![hz];
            let orbits = sweep(&problem, damping, &state, &alone, &[], &|_| ()).orbits;
            let off = amplitude / orbits[0].observed_amplitude[0] - 1.0;
            assert!(off.abs() < 1e-4, "{hz}: {off}");
        }
    }
}
