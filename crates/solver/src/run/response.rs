//! Response of a reduced model about its static state.

use super::curve_progress::CurveProgress;
use super::error::Error;
use super::records::{RecordInputs, ResponseInputs};
use super::reduced::ReducedScene;
use super::session::{Event, Session, Stage};
use super::stability::Judged;
use crate::damping::Rayleigh;
use crate::description::{FrequencyRange, ResponseSpec, Scene};
use crate::dlft::accuracy::samples_for;
use crate::dlft::branch::follow;
use crate::dlft::demand;
use crate::dlft::eps::Eps;
use crate::dlft::linear_curve::linear_curve;
use crate::dlft::orbit::{linear_orbit, linear_point};
use crate::dlft::settings::Resolution;
use crate::dlft::sweep::{SweepSettings, sweep};
use crate::dlft::{Branch, Orbit, Response, StaticState, SweepProgress};
use crate::integration::departure::Departure;
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::results::far_slip::ShorterSides;
use crate::results::modes::{ModeKind, hertz};
use crate::stability::Kind;
use dovetail_numerics::memory;
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::spectrum::blocks;
use std::time::Instant;

/// Checks that all sectors of the disc of a scene, if any, are excited in phase, and that no air acts
/// back on them, which a task needs.
///
/// # Errors
/// [`Error::NotInPhase`], [`Error::WithInfluence`].
pub(super) fn check_in_phase(scene: &Scene, task: &'static str) -> Result<(), Error> {
    let disc = scene.assembly().and_then(|a| a.cyclic.as_ref());
    match disc {
        Some(disc) if disc.engine_order % disc.sectors > 0 => Err(Error::NotInPhase {
            task,
            engine_order: disc.engine_order,
            sectors: disc.sectors,
        }),
        _ => check_without_influence(scene, task),
    }
}

/// Checks that no air acts back on the blades of a scene, of which a task knows nothing.
///
/// # Errors
/// [`Error::WithInfluence`].
pub(super) fn check_without_influence(scene: &Scene, task: &'static str) -> Result<(), Error> {
    let disc = scene.assembly().and_then(|a| a.cyclic.as_ref());
    match disc.is_some_and(|disc| disc.influence.is_some()) {
        true => Err(Error::WithInfluence { task }),
        false => Ok(()),
    }
}

/// Checks that the response of a scene is along the frequency, at one speed. `why` says what a task
/// needs it for.
///
/// # Errors
/// [`Error::AlongEngineOrder`].
pub fn check_one_speed(scene: &Scene, why: &'static str) -> Result<(), Error> {
    match scene.response.along_engine_order {
        Some(_) => Err(Error::AlongEngineOrder { why }),
        None => Ok(()),
    }
}

/// Frequencies of the response, Hz, ascending: those of the grid, or the two ends of the range
/// where the curve is followed.
///
/// # Errors
/// [`Error::NoLinearMode`] where they count from the first of the linear modes `omega2`, and there
/// is none.
pub(super) fn frequencies_hz(response: &ResponseSpec, omega2: &[f64]) -> Result<Vec<f64>, Error> {
    let (from, to) = match response.range {
        FrequencyRange::Hz { from_hz, to_hz } => (from_hz, to_hz),
        FrequencyRange::OfFirstLinearMode { from, to } => {
            let first = hertz(*omega2.first().ok_or(Error::NoLinearMode)?);
            (from * first, to * first)
        }
    };
    let ends = if from == to { 1 } else { 2 };
    let points = response.points.unwrap_or(ends);
    let last = points.saturating_sub(1).max(1) as f64;
    Ok((0..points)
        .map(|i| from + (to - from) * i as f64 / last)
        .collect())
}

/// Returns `true` if the curve of a response is followed, `false` if it is the answer at these
/// frequencies.
pub(super) fn follows(response: &ResponseSpec, frequencies_hz: &[f64]) -> bool {
    response.points.is_none() && frequencies_hz.len() > 1
}

/// Relative distance to an undamped mode within which a harmonic of the response lies on it.
const ON_A_MODE: f64 = 1e-9;

/// Checks that no harmonic lies on an undamped mode. There the linear answer is infinite for a
/// linear mode, and the condensed stiffness for a stuck mode.
///
/// # Errors
/// [`Error::UndampedMode`] where a harmonic of some frequency lies on one.
pub fn check_undamped_modes(
    problem: &Problem,
    state: &StaticState,
    damping: Rayleigh,
    frequencies_hz: &[f64],
    harmonics: usize,
) -> Result<(), Error> {
    let is_damped = damping.stiffness_s > 0.0 || damping.mass_per_s > 0.0;
    if is_damped && problem.modal_ratios.is_empty() {
        return Ok(());
    }
    let linear = state.linear.problem(problem, damping);
    for (kind, problem) in [(ModeKind::Stuck, problem), (ModeKind::Linear, &linear)] {
        let system = ContactSystem::new(problem, damping);
        let undamped = |harmonic: usize| -> (Vec<usize>, Vec<f64>) {
            let of = problem.reduced.harmonic_model(harmonic);
            let omega2 = of.model.omega2.iter().enumerate();
            let undamped = omega2.filter(|(m, _)| !system.is_damped(harmonic, *m));
            undamped
                .map(|(m, w2)| (of.mode_of_sector(m), hertz(*w2)))
                .unzip()
        };
        let undamped: Vec<_> = (1..=harmonics).map(undamped).collect();
        for &frequency_hz in frequencies_hz {
            let on_it = |(i, (modes, modes_hz)): (usize, &(Vec<usize>, Vec<f64>))| {
                let harmonic = i + 1;
                let mode = mode_at(modes_hz, harmonic as f64 * frequency_hz)?;
                Some((harmonic, modes[mode]))
            };
            if let Some((harmonic, mode)) = undamped.iter().enumerate().find_map(on_it) {
                return Err(Error::UndampedMode {
                    frequency_hz,
                    harmonic,
                    kind,
                    mode: mode + 1,
                });
            }
        }
    }
    Ok(())
}

/// Mode, of ascending ones, that lies at a frequency.
fn mode_at(modes_hz: &[f64], frequency_hz: f64) -> Option<usize> {
    // The first one not below the window around it.
    let mode = modes_hz.partition_point(|m| *m < frequency_hz * (1.0 - ON_A_MODE));
    let is_there = |m: &f64| (m / frequency_hz - 1.0).abs() <= ON_A_MODE;
    modes_hz.get(mode).is_some_and(is_there).then_some(mode)
}

/// Resolution of a second response with `harmonics`, with the samples of the first, if it has a
/// fixed number.
pub(super) fn compared(own: Resolution, harmonics: usize) -> Resolution {
    let samples = match own {
        Resolution::Fixed { samples, .. } => samples,
        Resolution::Accuracy(accuracy) => samples_for(accuracy, harmonics),
    };
    Resolution::fixed(harmonics, samples)
}

/// Settings of a response at these frequencies.
pub(super) fn settings(
    spec: &ResponseSpec,
    frequencies_hz: Vec<f64>,
    resolution: Resolution,
) -> SweepSettings {
    let mut settings = SweepSettings::new(frequencies_hz, resolution);
    settings.eps = Eps {
        choice: spec.eps,
        scale: spec.eps_scale,
    };
    settings.newton = NewtonOptions::new(spec.tolerance, spec.max_newton_iterations);
    settings.solver = spec.solver;
    settings.slip_threshold_m = spec.slip_threshold_m;
    settings.most_seconds = spec.most_seconds_per_frequency;
    settings
}

/// Common data of the responses of a run.
pub(super) struct Responses<'a, 'o> {
    pub spec: &'a ResponseSpec,
    pub reduced: &'a ReducedScene,
    pub damping: Rayleigh,
    pub state: &'a StaticState,
    /// Frequencies, ascending.
    pub frequencies_hz: &'a [f64],
    pub session: &'a Session<'o>,
}

impl Responses<'_, '_> {
    /// Response of the scene itself, or the one with so many harmonics that it is compared with,
    /// and the largest ratio of the slide of a pair in it to the shorter side of its flank.
    ///
    /// # Errors
    /// [`Error::TooLittleMemory`]; [`Error::Stopped`] by the observer or the store.
    pub(crate) fn response(
        &self,
        compared_harmonics: Option<usize>,
    ) -> Result<(Response, f64), Error> {
        let own_resolution = self.spec.resolution;
        let resolution = compared_harmonics.map_or(own_resolution, |h| compared(own_resolution, h));
        if self.reduced.problem.laws.is_empty() {
            return Ok((self.linear(resolution), 0.0));
        }
        self.contact_response(resolution, compared_harmonics)
    }

    fn contact_response(
        &self,
        resolution: Resolution,
        compared_harmonics: Option<usize>,
    ) -> Result<(Response, f64), Error> {
        let Self { spec, session, .. } = self;
        let problem = &self.reduced.problem;
        let sides = ShorterSides::new(&self.reduced.pairs);
        let stage = session.titled_stage(Stage::Response, &title(resolution));
        let blocks = blocks(resolution.most_harmonics());
        stage.solves(blocks * problem.reduced.stiffness.nrows());
        let settings = settings(spec, self.frequencies_hz.to_vec(), resolution);
        memory::check_available(demand::bytes(problem, &settings))
            .map_err(|source| Error::TooLittleMemory { blocks, source })?;
        let (damping, state) = (self.damping, self.state);
        session.report(&Event::ResponseBegins {
            reduced: self.reduced,
            frequencies_hz: self.frequencies_hz,
            compared_harmonics,
        })?;
        let recorded = session.records(&RecordInputs::Response(ResponseInputs {
            problem,
            damping,
            state,
            settings: &settings,
            points: spec.points,
        }))?;
        let follows = follows(spec, self.frequencies_hz);
        let (curve, steps) = if follows {
            (Some(CurveProgress::new(session, self.frequencies_hz)), None)
        } else {
            let frequencies = self.frequencies_hz.len();
            (None, Some(session.steps(frequencies, "frequencies")))
        };
        let tell = |told: SweepProgress<'_>| match told {
            SweepProgress::Solved(solved) => {
                let mut solved = solved.clone();
                sides.judge_orbit(&mut solved.orbit);
                let _ = session.append(recorded.key, &solved);
                let _ = session.report(&Event::Frequency(&solved));
                if let Some(curve) = &curve {
                    curve.advance(&solved);
                }
                if let (Some(steps), false) = (&steps, solved.again) {
                    steps.step();
                }
            }
            SweepProgress::Tries(attempt) => {
                let _ = session.report(&Event::Tries(attempt));
            }
            SweepProgress::Apart => curve.iter().for_each(CurveProgress::go_on),
            SweepProgress::Next(stop) => session.stop_if_ended(stop),
        };
        let solve = if follows { follow } else { sweep };
        let mut response = solve(problem, damping, state, &settings, &recorded.earlier, &tell);
        session.check_running()?;
        drop(stage);
        let farthest = sides.judge_response(&mut response);
        if compared_harmonics.is_none() {
            let _stage = session.stage(Stage::Stability);
            let named_hz = if follows { self.frequencies_hz } else { &[] };
            self.judged()
                .judge_response(&mut response, named_hz, &settings, None);
            session.check_running()?;
        }
        Ok((response, farthest))
    }

    /// Adds the responses of twice the period to a response, in as much time as has passed since `begun`.
    /// Returns the integrations in time that lead to them.
    ///
    /// # Errors
    /// [`Error::Stopped`] by the observer.
    pub(super) fn add_two_periods(
        &self,
        response: &mut Response,
        begun: Instant,
    ) -> Result<Vec<(usize, Departure)>, Error> {
        let doubled = |orbit: &Orbit| orbit.stability.kind() == Some(Kind::PeriodDoubling);
        if !response.orbits.iter().any(doubled) {
            return Ok(Vec::new());
        }
        let title = "response of twice the period";
        let _stage = self.session.titled_stage(Stage::Response, title);
        let frequencies_hz = self.frequencies_hz.to_vec();
        let settings = settings(self.spec, frequencies_hz, self.spec.resolution);
        let until = Instant::now() + begun.elapsed();
        let judged = self.judged();
        let departures = judged.follow_two_periods(response, &settings, until);
        self.session.check_running()?;
        Ok(departures)
    }

    /// Where integration in time leads from the peaks that are unstable, in as much time as has passed
    /// since `begun`. `known` are departures of this response that were integrated before.
    ///
    /// # Errors
    /// [`Error::Stopped`] by the observer.
    pub(super) fn departures(
        &self,
        response: &mut Response,
        known: Vec<(usize, Departure)>,
        begun: Instant,
    ) -> Result<Vec<Departure>, Error> {
        let until = Instant::now() + begun.elapsed();
        self.judged()
            .departures(response, known, until, self.session)
    }

    /// Model whose motions are judged.
    pub(super) fn judged(&self) -> Judged<'_> {
        Judged {
            problem: &self.reduced.problem,
            damping: self.damping,
            state: self.state,
            scope: self.spec.stability,
        }
    }

    /// Response where all flanks are bonded: each mode answers by itself. Without a grid the curve is
    /// smooth and has its peaks.
    fn linear(&self, resolution: Resolution) -> Response {
        let _stage = self
            .session
            .titled_stage(Stage::Response, "linear response");
        let problem = &self.reduced.problem;
        let harmonics = match resolution {
            Resolution::Fixed { harmonics, .. } => harmonics,
            Resolution::Accuracy(_) => problem.highest_excited().max(1),
        };
        let system = ContactSystem::new(problem, self.damping);
        let (linear, linear_curve) = match (self.spec.points, self.frequencies_hz) {
            (None, &[from_hz, to_hz]) => {
                let even_hz = smooth_curve_frequencies_hz(from_hz, to_hz);
                let curve = linear_curve(&system, harmonics, &even_hz);
                (curve.clone(), curve)
            }
            (_, grid_hz) => {
                let points = grid_hz.iter().map(|&f| linear_point(&system, harmonics, f));
                (points.collect(), linear_curve(&system, harmonics, grid_hz))
            }
        };
        let orbits = linear.iter().enumerate();
        let orbits = orbits.map(|(point, at)| Orbit {
            point,
            ..linear_orbit(&system, harmonics, at.frequency_hz)
        });
        Response {
            orbits: orbits.collect(),
            branches: vec![Branch::swept(linear.len())],
            linear,
            linear_curve,
            second_motions: Vec::new(),
            bifurcations: Vec::new(),
            two_periods: Vec::new(),
            slip_threshold_m: 0.0,
        }
    }
}

/// Frequencies from one to another, Hz, evenly spaced, that draw a linear response as a smooth
/// curve.
pub(super) fn smooth_curve_frequencies_hz(from_hz: f64, to_hz: f64) -> Vec<f64> {
    const POINTS: u16 = 200;
    let step_hz = (to_hz - from_hz) / f64::from(POINTS - 1);
    let numbers = (0..POINTS).map(f64::from);
    numbers.map(|i| from_hz + step_hz * i).collect()
}

fn title(resolution: Resolution) -> String {
    match resolution {
        Resolution::Fixed { harmonics: 1, .. } => "response, 1 harmonic".to_owned(),
        Resolution::Fixed { harmonics, .. } => format!("response, {harmonics} harmonics"),
        Resolution::Accuracy(accuracy) => format!("response, accuracy {accuracy}"),
    }
}
