//! Peaks with friction where modes cross engine orders: what the crossings of a Campbell diagram
//! come to under a given excitation.

use super::at::{ModelAtValue, rad_s, scene_at};
use super::bodies::Bound;
use super::campbell::{Campbell, Crossing};
use super::error::Error;
use super::outcome::PeakAt;
use super::reduced::{ReducedScene, stuck_modes};
use super::session::{Session, Stage};
use crate::description::Scene;
use crate::dlft::SweepProgress;
use crate::results::modes::ModeKind;

/// Ranges that a peak is looked for in, as multiples of the frequency of its crossing: a joint that
/// slips or opens is softer than one that sticks. A wider one is taken where the amplitude still
/// rises at an end of the one before.
const RANGES: [[f64; 2]; 3] = [[0.93, 1.03], [0.8, 1.1], [0.6, 1.3]];

/// Peak at a crossing.
#[derive(Debug)]
#[non_exhaustive]
pub struct CrossingPeak {
    /// Mode and engine order.
    pub crossing: Crossing,
    /// Factor on the excitation of the scene.
    pub times: f64,
    /// Peak of the first observed displacement over the frequency, at the speed of the crossing; or
    /// why there is none.
    pub peak: Result<PeakAt, Error>,
}

/// Finds the peak at each crossing of a mode of the stuck assembly with an engine order of the scene
/// that has an excitation and is one of `engine_orders`, ascending in speed. Each speed has its own
/// reduced model and static state, with the prestress of the scene.
///
/// # Errors
/// [`Error::Stopped`] by the observer. Other errors are those of their crossings.
pub fn crossing_peaks(
    scene: &Scene,
    campbell: &Campbell,
    engine_orders: &[usize],
    session: &Session<'_>,
) -> Result<Vec<CrossingPeak>, Error> {
    let excited = scene.engine_orders.iter();
    let excited = excited.filter(|order| engine_orders.contains(&order.order.0));
    let excited = excited.filter_map(|order| Some((order.order.0, order.times?)));
    let mut asked: Vec<(Crossing, f64)> = excited
        .flat_map(|(order, times)| {
            let crossings = campbell.crossings(&[order]).into_iter();
            let stuck = crossings.filter(move |c| c.kind == ModeKind::Stuck);
            stuck.map(move |crossing| (crossing, times))
        })
        .collect();
    asked.sort_by(|a, b| a.0.speed_rpm.total_cmp(&b.0.speed_rpm));
    if asked.is_empty() {
        return Ok(Vec::new());
    }
    let _stage = session.titled_stage(Stage::Peaks, "peaks at crossings");
    let steps = session.steps(asked.len(), "crossings");
    let mut peaks = Vec::new();
    for (crossing, times) in asked {
        let peak = peak_at(scene, &campbell.bound, &crossing, times, session);
        session.check_running()?;
        steps.step();
        peaks.push(CrossingPeak {
            crossing,
            times,
            peak,
        });
    }
    Ok(peaks)
}

/// Peak at one crossing, with this factor on the excitation.
fn peak_at(
    scene: &Scene,
    bound: &Bound,
    crossing: &Crossing,
    times: f64,
    session: &Session<'_>,
) -> Result<PeakAt, Error> {
    let [.., widest] = RANGES;
    let of_crossing = |range: [f64; 2]| range.map(|times| times * crossing.frequency_hz);
    let speed_rpm = crossing.speed_rpm;
    let scene = scene_at(scene, speed_rpm, of_crossing(widest));
    let mut bound = bound
        .with_speed(rad_s(speed_rpm))
        .ok_or(Error::NoRotation)?;
    for excitation in &mut bound.model.excitations {
        excitation.in_time.amplitude *= times;
    }
    if let Some(disc) = &mut bound.model.cyclic {
        disc.engine_order = crossing.engine_order;
    }
    let mut at = {
        let (mut store, mut nobody) = (session.store(), ());
        let silent = Session::new(&mut nobody, &mut **store);
        let reduced = ReducedScene::from_bound(bound, stuck_modes(&scene), &scene, &silent)?;
        if reduced.problem.laws.is_empty() {
            let why = "peaks without friction are those of the linear response, which `run` has";
            return Err(Error::AllBonded { why });
        }
        ModelAtValue::from_reduced((speed_rpm, scene), reduced, None, &silent)?
    };
    let observation = at.reduced.observed(None)?;
    let tell = |told: SweepProgress<'_>| {
        if let SweepProgress::Next(stop) = told {
            session.stop_if_ended(stop);
        }
    };
    let mut last = Error::NoPeak;
    for range in RANGES {
        at.settings.frequencies_hz = of_crossing(range).to_vec();
        match at.find(None, observation, session, &tell) {
            Ok(orbit) => return Ok(at.row(orbit, observation)),
            Err(
                error @ (Error::NoPeak
                | Error::PeakOutside { .. }
                | Error::ResonanceNotComputed { .. }),
            ) => last = error,
            Err(error) => return Err(error),
        }
        session.check_running()?;
    }
    Err(last)
}
