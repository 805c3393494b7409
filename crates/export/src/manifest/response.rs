//! Response in summary.json.

use serde::{Deserialize, Serialize};

use super::finite;
use super::peak::ObservedPeak;
use super::stability::{BifurcationSummary, TwoPeriodsSummary};
use crate::words::{figure, quantity};
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::branch::folds;
use dovetail_solver::dlft::{Orbit, Outcome, Response, SecondMotion};
use dovetail_solver::integration::departure::Departure;
use dovetail_solver::results::fretting::Fretting;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::peak::{LocalPeak, local_peaks};
use dovetail_solver::results::quantities::{
    energy_balance_error, largest_estimated_error, moving_orbits, sweep_fields,
};
use dovetail_solver::run::{Observed, TractionPeak, TractionRange};

/// Main figures of a response.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ResponseSummary {
    /// Number of points: frequencies of a grid, or points of the branches that were followed.
    pub points: usize,
    /// Number of points that converged.
    pub converged_points: usize,
    /// Frequencies that have a motion and did not converge: the estimated error is above the
    /// requested accuracy.
    pub accuracy_not_reached_points: usize,
    /// Largest estimated relative error of an observed amplitude due to the omitted harmonics;
    /// `None` if no harmonic is omitted or nothing converged.
    pub largest_estimated_error: Option<f64>,
    /// Points that did not converge.
    pub unconverged: Vec<UnconvergedPoint>,
    /// Name of the first observation; `None` without observations.
    pub observation: Option<String>,
    /// Peak of the first observation.
    #[serde(flatten)]
    pub first: ObservedPeak,
    /// Peaks of the other observations, in their order.
    #[serde(default)]
    pub other_observations: Vec<ObservedPeak>,
    /// Engine order of a run-up.
    #[serde(default)]
    pub engine_order: Option<EngineOrder>,
    /// First and last speed of a run-up.
    #[serde(default)]
    pub speed_rpm: Option<[f64; 2]>,
    /// Ranges in which another motion was found beside that of response.csv, rising.
    pub second_motion: Vec<SecondMotion>,
    /// Folds of the curve, in its order: between two of them the motions are unstable, unless a verdict
    /// says otherwise.
    #[serde(default)]
    pub folds: Vec<FoldSummary>,
    /// Other changes of stability along the curve, in its order.
    #[serde(default)]
    pub bifurcations: Vec<BifurcationSummary>,
    /// Branches of responses of twice the period.
    #[serde(default)]
    pub two_periods: Vec<TwoPeriodsSummary>,
    /// Points whose stability was judged.
    #[serde(default)]
    pub judged_points: usize,
    /// Points that were judged unstable.
    #[serde(default)]
    pub unstable_points: usize,
    /// All local maxima inside the range, rising in frequency.
    pub peaks: Vec<LocalPeakSummary>,
    /// Range of the peak over starting tractions; `None` where the scene asks for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction_range: Option<TractionRangeSummary>,
    /// Largest figures of fretting over the pairs at the peak; `None` if no fields were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_fretting: Option<FrettingSummary>,
    /// Number of pairs, closed in the static state, that separate at any converged frequency.
    pub pairs_that_open: usize,
    /// Share of these pairs in the area of the flanks; `None` if the area of a pair is unknown.
    pub area_share_that_opens: Option<f64>,
    /// Largest |input - friction - viscous| over the largest of the three powers.
    pub worst_energy_balance_error: Option<f64>,
    /// Distance beyond which a pair counts as slipping, m.
    pub slip_threshold_m: Option<f64>,
    /// Number of iterations of Newton's method over all points.
    pub newton_iterations: usize,
    /// Number of iterations of GMRES over all points.
    pub krylov_iterations: usize,
}

impl ResponseSummary {
    /// The same summary without figures of peaks, if no motion is known between these frequencies, Hz.
    #[must_use]
    pub fn without_peaks(self, unknown_hz: [f64; 2]) -> Self {
        let others = self.other_observations.into_iter();
        Self {
            first: self.first.without_peak(unknown_hz),
            other_observations: others.map(|peak| peak.without_peak(unknown_hz)).collect(),
            ..self
        }
    }

    /// What each branch of twice the period reaches, whose amplitudes have this unit, in words.
    pub fn two_periods_words(&self, unit: &str) -> Vec<String> {
        let words = |branch: &TwoPeriodsSummary| {
            let [from, to] = branch.frequency_hz.map(|hz| figure(hz, 6));
            let range = match from == to {
                true => format!("at {from} Hz"),
                false => format!("from {from} to {to} Hz"),
            };
            let amplitude_m = branch.largest_amplitude_m?;
            let over = match self.first.peak_amplitude_m {
                Some(peak_m) if amplitude_m > peak_m => {
                    format!(", {} times the peak,", figure(amplitude_m / peak_m, 3))
                }
                _ => String::new(),
            };
            Some(format!(
                "{range} there is a response of twice the period of the excitation: half of its range over both periods reaches \
                 {}{over} at {} Hz",
                quantity(amplitude_m, unit, 4),
                figure(branch.largest_amplitude_frequency_hz?, 6),
            ))
        };
        self.two_periods.iter().filter_map(words).collect()
    }

    /// Peaks of the observations that have one, or whose resonance was not computed, the first
    /// observation first.
    pub fn peaks_of<'a>(
        &'a self,
        observed: &'a [Observed],
    ) -> impl Iterator<Item = (&'a Observed, &'a ObservedPeak)> {
        let peaks = std::iter::once(&self.first).chain(&self.other_observations);
        let pairs = observed.iter().zip(peaks);
        let is_told = |peak: &ObservedPeak| {
            peak.peak_amplitude_m.is_some() || peak.resonance_not_computed_hz.is_some()
        };
        pairs.filter(move |(_, peak)| is_told(peak))
    }
}

/// Largest figures of fretting over the pairs, each of its own pair.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrettingSummary {
    /// Range of the slip to and fro: half of the distance slid in a period.
    pub slip_range_m: f64,
    /// Friction force over area.
    pub friction_stress_pa: f64,
    /// Ruiz' parameter of wear: friction stress times slip.
    pub wear_parameter_pa_m: f64,
    /// Ruiz' parameter of fretting fatigue: that times the tension along the slip; `None` without
    /// stress.
    pub fatigue_parameter_pa2_m: Option<f64>,
}

/// Largest figures of the pairs.
pub fn fretting_summary(pairs: &[Fretting]) -> FrettingSummary {
    let largest = |of: &dyn Fn(&Fretting) -> f64| pairs.iter().map(of).fold(0.0, f64::max);
    let fatigue = pairs.iter().map(Fretting::fatigue_parameter_pa2_m);
    let fatigue: Option<Vec<f64>> = fatigue.collect();
    FrettingSummary {
        slip_range_m: largest(&|f| f.slip_range_m),
        friction_stress_pa: largest(&|f| f.friction_stress_pa),
        wear_parameter_pa_m: largest(&Fretting::wear_parameter_pa_m),
        fatigue_parameter_pa2_m: fatigue.map(|all| all.into_iter().fold(0.0, f64::max)),
    }
}

/// Fold of a curve, where its frequency turns back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoldSummary {
    /// Row of response.csv, 0 = first.
    pub row: usize,
    pub frequency_hz: f64,
    /// Amplitude of the first observation.
    pub amplitude_m: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LocalPeakSummary {
    pub row: usize,
    pub frequency_hz: f64,
    pub amplitude_m: f64,
    /// Energy dissipated in a period over 2 pi times the stored energy: twice the equivalent
    /// damping ratio.
    pub loss_factor: Option<f64>,
    /// Inverse of the loss factor.
    pub quality_factor: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnconvergedPoint {
    pub row: usize,
    pub frequency_hz: f64,
    pub outcome: Outcome,
    pub residual: Option<f64>,
}

/// Range of the peak of the first observation over starting tractions, that of the load path
/// included. The response was found to span it; it is no bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TractionRangeSummary {
    /// Number of tractions with a peak.
    pub tractions: usize,
    /// Least and largest amplitude.
    pub peak_amplitude_m: [f64; 2],
    /// Least and largest frequency.
    pub peak_frequency_hz: [f64; 2],
    /// Least and largest loss factor.
    pub loss_factor: Option<[f64; 2]>,
}

/// Range of the peak; `None` where no traction has one.
pub fn traction_range(range: &TractionRange) -> Option<TractionRangeSummary> {
    let ends = |value: &dyn Fn(&TractionPeak) -> Option<f64>| {
        let values = range.peaks().filter_map(value);
        values.fold(None, |ends: Option<[f64; 2]>, v| {
            Some(ends.map_or([v; 2], |[least, most]| [least.min(v), most.max(v)]))
        })
    };
    Some(TractionRangeSummary {
        tractions: range.peaks().count(),
        peak_amplitude_m: ends(&|peak| Some(peak.amplitude_m))?,
        peak_frequency_hz: ends(&|peak| Some(peak.frequency_hz))?,
        loss_factor: ends(&|peak| peak.loss_factor),
    })
}

/// Main figures of a response. `observation` is the name of the first observation, `along` the engine
/// order of a run-up, `departures` are the integrations from unstable peaks.
pub fn response_summary(
    pairs: &PairTable,
    observation: Option<&str>,
    response: &Response,
    along: Option<EngineOrder>,
    departures: &[Departure],
) -> ResponseSummary {
    let of_motions = response.orbits.iter().map(|o| o.observed_amplitude.len());
    let linear = response.linear_curve.iter();
    let observed = of_motions.chain(linear.map(|point| point.observed_amplitude.len()));
    let mut peaks = (0..observed.max().unwrap_or(0))
        .map(|i| ObservedPeak::new(response, i, pairs, along, departures));
    let separates = sweep_fields(response, pairs.rows.len()).separates;
    let unconverged = response
        .orbits
        .iter()
        .enumerate()
        .filter(|(_, o)| !o.outcome.is_converged())
        .map(|(row, o)| UnconvergedPoint {
            row,
            frequency_hz: o.frequency_hz,
            outcome: o.outcome,
            residual: finite(o.residual),
        });
    let converged = response.orbits.iter();
    let converged = converged.filter(|o| o.outcome.is_converged());
    let inaccurate = |o: &&Orbit| o.outcome == Outcome::AccuracyNotReached;
    let inaccurate = response.orbits.iter().filter(inaccurate);
    let local = |peak: &LocalPeak| {
        let loss_factor = peak.loss_factor.and_then(finite);
        LocalPeakSummary {
            row: peak.at.index,
            frequency_hz: peak.at.frequency_hz,
            amplitude_m: peak.at.amplitude_m,
            loss_factor,
            quality_factor: loss_factor.map(f64::recip).and_then(finite),
        }
    };
    let fold = |row: usize| FoldSummary {
        row,
        frequency_hz: response.orbits[row].frequency_hz,
        amplitude_m: response.orbits[row].observed_amplitude.first().copied(),
    };
    let verdicts = || {
        let orbits = response.orbits.iter();
        orbits.filter_map(|orbit| orbit.stability.is_stable())
    };
    ResponseSummary {
        points: response.orbits.len(),
        converged_points: converged.count(),
        accuracy_not_reached_points: inaccurate.count(),
        largest_estimated_error: largest_estimated_error(response),
        unconverged: unconverged.collect(),
        observation: observation.map(str::to_owned),
        first: peaks.next().unwrap_or_default(),
        other_observations: peaks.collect(),
        engine_order: along,
        speed_rpm: along.and_then(|order| {
            let ends = response.orbits.first().zip(response.orbits.last())?;
            let ends: [&Orbit; 2] = ends.into();
            Some(ends.map(|o| order.speed_rpm(o.frequency_hz)))
        }),
        second_motion: response.second_motions.clone(),
        folds: folds(response).into_iter().map(fold).collect(),
        bifurcations: (response.bifurcations.iter())
            .map(BifurcationSummary::new)
            .collect(),
        two_periods: (response.two_periods.iter())
            .map(TwoPeriodsSummary::new)
            .collect(),
        judged_points: verdicts().count(),
        unstable_points: verdicts().filter(|is_stable| !is_stable).count(),
        peaks: local_peaks(response, 0).iter().map(local).collect(),
        traction_range: None,
        peak_fretting: None,
        pairs_that_open: separates.iter().filter(|separates| **separates).count(),
        area_share_that_opens: opening_share(pairs, &separates),
        worst_energy_balance_error: moving_orbits(response)
            .filter_map(energy_balance_error)
            .reduce(f64::max),
        slip_threshold_m: finite(response.slip_threshold_m),
        newton_iterations: response.orbits.iter().map(|o| o.newton_iterations).sum(),
        krylov_iterations: response.orbits.iter().map(|o| o.krylov_iterations).sum(),
    }
}

/// Area of the pairs that open at some frequency over that of all pairs.
fn opening_share(pairs: &PairTable, separates: &[bool]) -> Option<f64> {
    let areas: Option<Vec<f64>> = pairs.rows.iter().map(|p| p.area_m2).collect();
    let areas = areas?;
    let open = areas.iter().zip(separates).filter(|(_, opens)| **opens);
    let total: f64 = areas.iter().sum();
    (total > 0.0).then(|| open.map(|(a, _)| a).sum::<f64>() / total)
}
