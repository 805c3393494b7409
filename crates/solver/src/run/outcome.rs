//! Results of a run: static state, response, and whether they are complete.

use super::bodies::Bodies;
use super::error::Error;
use super::reduced::ReducedScene;
use crate::damping::Rayleigh;
use crate::description::EngineOrder;
use crate::dlft::starting_traction::StartingTraction;
use crate::dlft::{CycleCounts, Orbit, Outcome, Response, StaticState};
use crate::integration::departure::Departure;
use crate::results::peak::unstable_peaks;
use crate::results::recovery::NodalField;
use crate::results::rigid_motion::BodyMotion;
use crate::results::small::Moved;

/// Results of a run.
#[derive(Debug)]
#[non_exhaustive]
pub struct Run {
    /// Reduced model.
    pub reduced: ReducedScene,
    /// Static state.
    pub statics: StaticResult,
    /// Response; `None` where there is no static state to vibrate about, or none was asked for.
    pub response: Option<ResponseResult>,
    /// Squared angular frequencies of each body with its flanks held, rad2/s2; empty where they
    /// were not asked for.
    pub held_omega2: Vec<Vec<f64>>,
}

/// Static state, with the quantities derived from it.
#[derive(Debug)]
#[non_exhaustive]
pub struct StaticResult {
    /// The state, converged or not.
    pub state: StaticState,
    /// Largest ratio of the slide of a pair to the shorter side of its flank.
    pub slide: f64,
    /// Displacements of all nodes of each body, m, where the state converged and the recovery was
    /// made.
    pub displacements_m: Option<Vec<NodalField>>,
    /// Largest displacement relative to the size of its body, where displacements are known.
    pub farthest: Option<Moved>,
    /// Motions that friction does not hold under the steady load; empty where it holds all, or the
    /// bodies are not known.
    pub retained: Vec<BodyMotion>,
    /// Free motions of the bodies that nothing holds.
    pub free: Vec<BodyMotion>,
}

impl StaticResult {
    /// Checks that there is a static state to vibrate about.
    ///
    /// # Errors
    /// [`Error::NothingHolds`], [`Error::SlidesTooFar`], [`Error::StaticState`].
    pub fn usable(&self) -> Result<(), Error> {
        usable(&self.state, &self.free)
    }
}

/// Checks that a static state is one to vibrate about. `free` are the motions that nothing holds, as
/// far as they are known.
///
/// # Errors
/// Those of [`StaticResult::usable`].
pub(super) fn usable(state: &StaticState, free: &[BodyMotion]) -> Result<(), Error> {
    match state.outcome {
        Outcome::NothingHolds => Err(Error::NothingHolds {
            motions: free.to_vec(),
            point: state.ended_at,
        }),
        Outcome::SlidesTooFar => Err(Error::SlidesTooFar {
            point: state.ended_at,
        }),
        outcome if outcome.is_converged() => Ok(()),
        outcome => Err(Error::StaticState {
            outcome,
            iterations: state.newton_iterations,
            residual: state.residual,
        }),
    }
}

/// Response, with the quantities derived from it.
#[derive(Debug)]
#[non_exhaustive]
pub struct ResponseResult {
    /// Response that the scene asks for.
    pub response: Response,
    /// Response with another number of harmonics, where the scene asks for one.
    pub compared: Option<Compared>,
    /// Rayleigh damping; along an engine order, that at the speed of the peak of the first observed
    /// displacement, or where there is none, that about the static state of the run.
    pub damping: Rayleigh,
    /// Largest ratio of the slide of a pair to the shorter side of its flank.
    pub slide: f64,
    /// Observed displacement that is largest relative to the size of its body, where there are
    /// bodies.
    pub farthest: Option<Moved>,
    /// Motions that friction does not hold where it holds least; empty where it holds all, or the
    /// bodies are not known.
    pub retained: Vec<BodyMotion>,
    /// Ratio of the frequency of the last stuck mode to that of the highest harmonic of any
    /// solution; `None` where no mode was left out, or where it is not known.
    pub modes_reach: Option<f64>,
    /// Range over the tractions from which the vibration may start, where the scene asks for it.
    pub tractions: Option<TractionRange>,
    /// Where integration in time leads from each peak that is unstable; empty where none is.
    pub departures: Vec<Departure>,
    /// What a response along an engine order has besides; `None` where the speed stays.
    pub run_up: Option<RunUp>,
}

/// Response along an engine order.
#[derive(Debug)]
#[non_exhaustive]
pub struct RunUp {
    /// Engine order, which gives the speed of each frequency.
    pub engine_order: EngineOrder,
    /// Bodies at the speed of the peak of the first observed displacement, with their recovery;
    /// `None` where no fields were asked for, or there is no peak.
    pub at_peak: Option<Bodies>,
}

impl ResponseResult {
    /// Bodies that the motion at the peak belongs to; `own` are those of the run.
    pub fn bodies_at_peak<'a>(&'a self, own: Option<&'a Bodies>) -> Option<&'a Bodies> {
        let run_up = self.run_up.as_ref();
        run_up.and_then(|run_up| run_up.at_peak.as_ref()).or(own)
    }
}

/// Response with another number of harmonics.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Compared {
    /// Number of harmonics.
    pub harmonics: usize,
    /// Response with that number.
    pub response: Response,
}

/// Response from one starting traction.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TractionResponse {
    /// Traction from which the vibration starts.
    pub start: StartingTraction,
    /// Outcome of its static state. Without one there is no response.
    pub outcome: Outcome,
    /// Peak of the first observed displacement.
    pub peak: Option<TractionPeak>,
    /// Response, whose orbits have no contact forces and no cycles; `None` without a static state.
    pub response: Option<Response>,
}

/// Peak of a response from a starting traction.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TractionPeak {
    /// Frequency of the largest amplitude, Hz.
    pub frequency_hz: f64,
    /// Largest departure from the mean, m.
    pub amplitude_m: f64,
    /// Loss factor, where the peak is one of the curve.
    pub loss_factor: Option<f64>,
    /// States of the pairs.
    pub pairs: CycleCounts,
}

/// Range of the response over starting tractions. It is what these were found to span, and no bound.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TractionRange {
    /// Responses from other tractions than that of the load path.
    pub others: Vec<TractionResponse>,
    /// Peak from the traction of the load path.
    pub own: Option<TractionPeak>,
}

impl TractionRange {
    /// Peaks from all tractions, that of the load path first.
    pub fn peaks(&self) -> impl Iterator<Item = &TractionPeak> {
        let others = self.others.iter().filter_map(|other| other.peak.as_ref());
        self.own.iter().chain(others)
    }
}

impl Run {
    /// Checks that the run reached its full result.
    ///
    /// # Errors
    /// [`Error::NothingHolds`], [`Error::StaticState`], [`Error::SlidesTooFar`],
    /// [`Error::MovesTooFar`], [`Error::NotConverged`] where some frequencies failed,
    /// [`Error::UnstablePeak`] where a peak is unstable.
    pub fn verdict(&self) -> Result<(), Error> {
        let Some(found) = &self.response else {
            self.statics.usable()?;
            return moves_too_far(self.statics.farthest.as_ref());
        };
        moves_too_far(found.farthest.as_ref().or(self.statics.farthest.as_ref()))?;
        let compared = found.compared.iter().map(|c| &c.response);
        check_all_converged(std::iter::once(&found.response).chain(compared))?;
        check_peaks_are_stable(&found.response, self.reduced.observations().len())
    }
}

/// Error where something moves by more than its body is long.
fn moves_too_far(moved: Option<&Moved>) -> Result<(), Error> {
    match moved.filter(|moved| moved.share() > 1.0) {
        Some(moved) => Err(Error::MovesTooFar(moved.clone())),
        None => Ok(()),
    }
}

fn check_peaks_are_stable(response: &Response, observations: usize) -> Result<(), Error> {
    let unstable = unstable_peaks(response, observations);
    let kinds = unstable.iter().filter_map(|at| {
        let orbit = &response.orbits[*at];
        Some((orbit.frequency_hz, orbit.stability.kind()?))
    });
    match kinds.into_iter().next() {
        Some((frequency_hz, kind)) => Err(Error::UnstablePeak { frequency_hz, kind }),
        None => Ok(()),
    }
}

fn check_all_converged<'a>(responses: impl Iterator<Item = &'a Response>) -> Result<(), Error> {
    let (mut points, mut unconverged, mut inaccurate, mut not_held) = (0, 0, 0, 0);
    for outcome in responses.flat_map(|r| &r.orbits).map(|o| o.outcome) {
        points += 1;
        unconverged += usize::from(!outcome.is_converged());
        inaccurate += usize::from(outcome == Outcome::AccuracyNotReached);
        let is_not_held = matches!(
            outcome,
            Outcome::NoStaticEquilibrium | Outcome::SlidesTooFar | Outcome::NothingHolds
        );
        not_held += usize::from(is_not_held);
    }
    match unconverged {
        0 => Ok(()),
        _ => Err(Error::NotConverged {
            unconverged,
            inaccurate,
            not_held,
            points,
        }),
    }
}

/// Peak at one value.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PeakAt {
    /// Value of the scene.
    pub value: f64,
    /// Motion at the peak.
    pub orbit: Orbit,
    /// Largest amplitude of the linear reference in the range of frequencies, m; `None` where it
    /// does not move.
    pub linear_m: Option<f64>,
}

impl PeakAt {
    /// Amplitude of an observed displacement, m.
    pub fn amplitude_m(&self, observation: usize) -> f64 {
        self.orbit.observed_amplitude[observation]
    }
}
