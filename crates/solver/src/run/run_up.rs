//! Response along an engine order: the speed of rotation and the frequency of the excitation move
//! together, as in the run-up of a rig.
//!
//! Each speed has a reduction, a static state and a damping of its own: nothing is interpolated
//! between speeds. What is solved there is the response of one frequency of an ordinary run
//! ([`solve_after`]), which starts from the motions of the speeds before. Names, flanks and pairs
//! are found once.

use super::at::{ModelAtValue, rad_s, scene_at};
use super::error::Error;
use super::outcome::{ResponseResult, Run, RunUp};
use super::records::RecordInputs;
use super::reduced::{ReducedScene, stuck_modes};
use super::response::frequencies_hz;
use super::session::{Event, Observer, Session, Stage, StageEnd};
use crate::damping::Rayleigh;
use crate::description::{EngineOrder, Scene};
use crate::dlft::orbit::{linear_orbit, linear_point};
use crate::dlft::settings::Resolution;
use crate::dlft::sweep::{SweepState, solve_after};
use crate::dlft::{Branch, LinearPoint, Orbit, Outcome, Response, SolvedFrequency, SweepProgress};
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::results::far_slip::ShorterSides;
use crate::results::peak::peak;
use crate::results::small::AssemblySizes;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Response of a scene along an engine order. `run` has its model and its static state at its own
/// speed. With `fields` the bodies at the speed of the peak can be recovered.
///
/// # Errors
/// [`Error::NoMesh`] without bodies, [`Error::NoRotation`] where none of them turns;
/// [`Error::AtSpeed`] with the error of a stage at one of the speeds, but for a static state that
/// nothing can vibrate about: that is the outcome of the speed; [`Error::Stopped`].
pub(super) fn run_up(
    scene: &Scene,
    engine_order: EngineOrder,
    run: &Run,
    fields: bool,
    session: &Session<'_>,
) -> Result<ResponseResult, Error> {
    let frequencies_hz = &frequencies_hz(&scene.response, &[])?;
    let mut ascent = Ascent {
        scene,
        engine_order,
        run,
        session,
        dampings: BTreeMap::new(),
        stages: Stages::default(),
    };
    let ends = [frequencies_hz.first(), frequencies_hz.last()];
    let [from, to] = ends.map(|f| f.map_or(0.0, |f| engine_order.speed_rpm(*f)));
    let title = format!(
        "run-up along engine order {} from {from} to {to} rpm",
        engine_order.0
    );
    let mut response = {
        let (stage, begun) = (
            session.titled_stage(Stage::Response, &title),
            Instant::now(),
        );
        session.report(&Event::ResponseBegins {
            reduced: &run.reduced,
            frequencies_hz,
            compared_harmonics: None,
        })?;
        let response = ascent.response(frequencies_hz)?;
        // What the stages of the speeds take is told below.
        stage.set_time(begun.elapsed().saturating_sub(ascent.stages.total_time()));
        response
    };
    let top = peak(&response, 0);
    let known = top.as_ref().and_then(|top| ascent.dampings.get(&top.index));
    let (at_peak, damping) = match (top, known.copied()) {
        (None, _) => {
            let rayleigh = run.reduced.rayleigh(&scene.damping, &run.statics.state)?;
            (None, rayleigh)
        }
        (Some(_), Some(damping)) if !fields => (None, damping),
        (Some(top), Some(damping)) => (ascent.reduced(top.frequency_hz)?.bodies, damping),
        // A run before this one has solved the speed.
        (Some(top), None) => {
            let at = ascent.model_at(top.frequency_hz)?;
            (at.reduced.bodies, at.damping)
        }
    };
    let at_peak = at_peak.filter(|_| fields);
    if let Some(bodies) = &at_peak {
        ascent.silently(|session| bodies.recover(session))?;
    }
    ascent.stages.report(session);
    let bodies = run.reduced.bodies.as_ref();
    let slide = ShorterSides::new(&run.reduced.pairs).judge_response(&mut response);
    Ok(ResponseResult {
        slide,
        farthest: bodies.and_then(|b| AssemblySizes::new(b.model()).farthest_observed(&response)),
        retained: Vec::new(),
        modes_reach: run.reduced.modes_reach(&[&response]),
        response,
        compared: None,
        tractions: None,
        departures: Vec::new(),
        damping,
        run_up: Some(RunUp {
            engine_order,
            at_peak,
        }),
    })
}

/// A scene whose speeds are gone through.
struct Ascent<'a, 'o> {
    scene: &'a Scene,
    engine_order: EngineOrder,
    /// Model and static state at the speed of the scene.
    run: &'a Run,
    session: &'a Session<'o>,
    /// Rayleigh damping at each speed that was solved, by the number of its frequency.
    dampings: BTreeMap<usize, Rayleigh>,
    /// Time of the stages of all speeds.
    stages: Stages,
}

impl Ascent<'_, '_> {
    /// Response at these frequencies, each at its speed, rising.
    fn response(&mut self, frequencies_hz: &[f64]) -> Result<Response, Error> {
        let (run, session) = (self.run, self.session);
        let bodies = run.reduced.bodies.as_ref().ok_or(Error::NoMesh)?;
        let recorded = session.records(&RecordInputs::RunUp {
            model: bodies.model(),
            scene: self.scene,
        })?;
        let sides = ShorterSides::new(&run.reduced.pairs);
        let steps = session.steps(frequencies_hz.len(), "speeds");
        let mut last = SweepState::default();
        let (mut orbits, mut linear) = (Vec::new(), Vec::new());
        for (point, &frequency_hz) in frequencies_hz.iter().enumerate() {
            session.check_running()?;
            let is_known = |s: &&SolvedFrequency| {
                s.place() == (point, false) && s.orbit.frequency_hz == frequency_hz
            };
            let mut solved = match recorded.earlier.iter().find(is_known) {
                Some(known) => known.clone(),
                None => self.point(point, frequency_hz, &last)?,
            };
            session.check_running()?;
            sides.judge_orbit(&mut solved.orbit);
            session.append(recorded.key, &solved)?;
            session.report(&Event::Frequency(&solved))?;
            steps.step();
            if !solved.orbit.x.is_empty() {
                last.follow(&solved);
            }
            orbits.push(solved.orbit);
            linear.push(solved.linear);
        }
        Ok(Response {
            linear_curve: linear.clone(),
            linear,
            branches: vec![Branch::swept(orbits.len())],
            orbits,
            second_motions: Vec::new(),
            bifurcations: Vec::new(),
            two_periods: Vec::new(),
            slip_threshold_m: (self.scene.response.slip_threshold_m).unwrap_or(f64::NAN),
        })
    }

    /// Motion at one speed.
    fn point(
        &mut self,
        point: usize,
        frequency_hz: f64,
        last: &SweepState,
    ) -> Result<SolvedFrequency, Error> {
        let at = match self.model_at(frequency_hz) {
            Err(Error::AtSpeed { error, speed_rpm }) => match outcome(&error) {
                Some(outcome) => return Ok(failed_static_state(point, frequency_hz, outcome)),
                None => return Err(Error::AtSpeed { error, speed_rpm }),
            },
            at => at?,
        };
        self.dampings.insert(point, at.damping);
        let problem = &at.reduced.problem;
        if problem.laws.is_empty() {
            let system = ContactSystem::new(problem, at.damping);
            let harmonics = match self.scene.response.resolution {
                Resolution::Fixed { harmonics, .. } => harmonics,
                Resolution::Accuracy(_) => problem.highest_excited().max(1),
            };
            let orbit = Orbit {
                point,
                ..linear_orbit(&system, harmonics, frequency_hz)
            };
            return Ok(SolvedFrequency {
                linear: linear_point(&system, harmonics, frequency_hz),
                ..SolvedFrequency::isolated(orbit)
            });
        }
        let session = self.session;
        let tell = |told: SweepProgress<'_>| match told {
            SweepProgress::Tries(attempt) => {
                let _ = session.report(&Event::Tries(attempt));
            }
            SweepProgress::Next(stop) => session.stop_if_ended(stop),
            SweepProgress::Solved(_) | SweepProgress::Apart => {}
        };
        let (damping, state, settings) = (at.damping, &at.state, &at.settings);
        let solved = solve_after(last, point, problem, damping, state, settings, &tell);
        let mut solved = solved.ok_or(Error::NoPeak)?;
        // The model of a speed is not kept until the peak is known.
        at.judge(&mut solved.orbit);
        Ok(solved)
    }

    /// Model at the speed of a frequency, about its static state: that of the response of this one
    /// frequency.
    fn model_at(&mut self, frequency_hz: f64) -> Result<ModelAtValue, Error> {
        let reduced = self.reduced(frequency_hz)?;
        let speed_rpm = self.engine_order.speed_rpm(frequency_hz);
        let scene = scene_at(self.scene, speed_rpm, [frequency_hz; 2]);
        let about = |session: &Session<'_>| {
            ModelAtValue::from_reduced((speed_rpm, scene), reduced, None, session)
        };
        let made = self.silently(about);
        made.map_err(|error| locate_speed_error(speed_rpm, error))
    }

    /// Reduced model at the speed of a frequency.
    fn reduced(&mut self, frequency_hz: f64) -> Result<ReducedScene, Error> {
        let (run, scene) = (self.run, self.scene);
        let speed_rpm = self.engine_order.speed_rpm(frequency_hz);
        let bodies = run.reduced.bodies.as_ref().ok_or(Error::NoMesh)?;
        let bound = bodies.bound.with_speed(rad_s(speed_rpm));
        let bound = bound.ok_or(Error::NoRotation)?;
        let wanted = stuck_modes(scene);
        let made = self.silently(|session| ReducedScene::from_bound(bound, wanted, scene, session));
        made.map_err(|error| locate_speed_error(speed_rpm, error))
    }

    /// Does the work of a speed, of which nothing is told but what its stages take in all.
    fn silently<T>(
        &mut self,
        work: impl FnOnce(&Session<'_>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let mut store = self.session.store();
        work(&Session::new(&mut self.stages, &mut **store))
    }
}

fn locate_speed_error(speed_rpm: f64, error: Error) -> Error {
    match error {
        Error::Stopped => Error::Stopped,
        error => Error::AtSpeed {
            speed_rpm,
            error: Box::new(error),
        },
    }
}

/// Outcome of a speed at which there is no static state to vibrate about; `None` for other errors.
fn outcome(error: &Error) -> Option<Outcome> {
    match error {
        Error::NothingHolds { .. } => Some(Outcome::NothingHolds),
        Error::SlidesTooFar { .. } => Some(Outcome::SlidesTooFar),
        Error::StaticState { outcome, .. } => Some(*outcome),
        _ => None,
    }
}

fn failed_static_state(point: usize, frequency_hz: f64, outcome: Outcome) -> SolvedFrequency {
    let orbit = Orbit {
        point,
        residual: f64::NAN,
        ..Orbit::motionless(frequency_hz, outcome)
    };
    SolvedFrequency {
        linear: LinearPoint {
            frequency_hz,
            observed_amplitude: Vec::new(),
        },
        ..SolvedFrequency::isolated(orbit)
    }
}

/// Observer that adds up what the stages of all speeds take.
#[derive(Default)]
struct Stages {
    under_way: Vec<Instant>,
    ended: Vec<Ended>,
}

/// Stages of one kind.
struct Ended {
    stage: Stage,
    took: Duration,
    times: usize,
    from_store: usize,
    /// Unknowns of the one that ended last.
    unknowns: Vec<usize>,
}

impl Observer for Stages {
    fn on_event(&mut self, event: &Event<'_>) -> ControlFlow<()> {
        match event {
            Event::StageBegins { .. } => self.under_way.push(Instant::now()),
            Event::StageEnds(end) => {
                let begun = self.under_way.pop();
                let took = end.took.or(begun.map(|begun| begun.elapsed()));
                self.add(end, took.unwrap_or_default());
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }
}

impl Stages {
    fn add(&mut self, end: &StageEnd, took: Duration) {
        let position = self.ended.iter().position(|e| e.stage == end.stage);
        let index = position.unwrap_or_else(|| {
            self.ended.push(Ended {
                stage: end.stage,
                took: Duration::ZERO,
                times: 0,
                from_store: 0,
                unknowns: Vec::new(),
            });
            self.ended.len() - 1
        });
        let ended = &mut self.ended[index];
        ended.took += took;
        ended.times += 1;
        ended.from_store += usize::from(end.from_store);
        ended.unknowns.clone_from(&end.unknowns);
    }

    /// Time that all of them took.
    fn total_time(&self) -> Duration {
        self.ended.iter().map(|ended| ended.took).sum()
    }

    /// Tells a session what they took.
    fn report(&self, session: &Session<'_>) {
        for ended in &self.ended {
            let Ended {
                stage,
                times,
                from_store,
                ..
            } = *ended;
            let kept = match from_store {
                0 => String::new(),
                all if all == times => ", from the cache".to_owned(),
                some => format!(", {some} from the cache"),
            };
            let count = match times {
                1 => String::new(),
                times => format!(", {times} times"),
            };
            let title = format!("{} along the run-up{count}{kept}", stage.title());
            let _ = session.report(&Event::StageBegins {
                stage,
                title: &title,
            });
            let _ = session.report(&Event::StageEnds(&StageEnd {
                stage,
                title,
                from_store: from_store == times,
                took: Some(ended.took),
                unknowns: ended.unknowns.clone(),
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Titles of the stages that end.
    #[derive(Default)]
    struct Titles(Vec<(String, bool)>);

    impl Observer for Titles {
        fn on_event(&mut self, event: &Event<'_>) -> ControlFlow<()> {
            if let Event::StageEnds(end) = event {
                self.0.push((end.title.clone(), end.from_store));
            }
            ControlFlow::Continue(())
        }
    }

    #[test]
    fn the_stages_of_all_speeds_are_told_as_one_of_each_kind() {
        let mut stages = Stages::default();
        for (stage, from_store) in [
            (Stage::Reduction, false),
            (Stage::StaticState, false),
            (Stage::Reduction, true),
            (Stage::Reduction, true),
            (Stage::Recovery, true),
        ] {
            let title = "";
            let _ = stages.on_event(&Event::StageBegins { stage, title });
            let mut end = StageEnd::caller_stage(stage, from_store);
            end.took = Some(Duration::from_secs(2));
            let _ = stages.on_event(&Event::StageEnds(&end));
        }
        assert_eq!(stages.total_time(), Duration::from_secs(10));
        let mut titles = Titles::default();
        stages.report(&Session::new(&mut titles, &mut ()));
        let expected = [
            (
                "reduction along the run-up, 3 times, 2 from the cache",
                false,
            ),
            ("static state along the run-up", false),
            ("recovery along the run-up, from the cache", true),
        ];
        assert_eq!(
            titles.0,
            expected.map(|(title, kept)| (title.to_owned(), kept))
        );
    }

    /// A speed at which nothing presses the pairs together is a frequency without a motion, and the
    /// next one does not start from it.
    #[test]
    fn a_speed_without_a_static_state_is_an_outcome_and_other_errors_end_the_run() {
        let motions = Vec::new();
        assert_eq!(
            outcome(&Error::NothingHolds {
                motions,
                point: None
            }),
            Some(Outcome::NothingHolds)
        );
        let too_far = Error::SlidesTooFar { point: None };
        assert_eq!(outcome(&too_far), Some(Outcome::SlidesTooFar));
        let stalled = Error::StaticState {
            outcome: Outcome::Stagnated,
            iterations: 1,
            residual: 1.0,
        };
        assert_eq!(outcome(&stalled), Some(Outcome::Stagnated));
        assert_eq!(outcome(&Error::NoLinearMode), None);
        let solved = failed_static_state(3, 50.0, Outcome::NothingHolds);
        assert_eq!(
            (solved.place(), solved.orbit.frequency_hz),
            ((3, false), 50.0)
        );
        assert!(!solved.orbit.outcome.has_motion() && solved.orbit.x.is_empty());
    }
}
