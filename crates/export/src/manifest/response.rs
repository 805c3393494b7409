//! Response in summary.json.

use serde::{Deserialize, Serialize};

use super::finite;
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::branch::folds;
use dovetail_solver::dlft::{CycleCounts, Orbit, Outcome, Response, SecondMotion};
use dovetail_solver::results::fretting::Fretting;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{
    LocalPeak, cycle_fields, energy_balance_error, friction_power_w, largest_estimated_error,
    largest_of_pairs, linear_peak, local_peaks, peak, peak_is_at_an_end, peak_ratio, peak_rise,
    sweep_fields, with_motion,
};
use dovetail_solver::run::{TractionPeak, TractionRange};

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
    /// Estimated relative error of the peak amplitude of the first observation.
    pub peak_estimated_error: Option<f64>,
    /// Largest estimated relative error of all observed amplitudes at that peak.
    pub peak_largest_estimated_error: Option<f64>,
    /// Points that did not converge.
    pub unconverged: Vec<UnconvergedPoint>,
    /// Name of the first observation; `None` without observations.
    pub observation: Option<String>,
    /// Peak amplitude of the first observation, m.
    pub peak_amplitude_m: Option<f64>,
    /// Frequency of that peak, Hz.
    pub peak_frequency_hz: Option<f64>,
    /// Engine order of a run-up.
    #[serde(default)]
    pub engine_order: Option<EngineOrder>,
    /// First and last speed of a run-up.
    #[serde(default)]
    pub speed_rpm: Option<[f64; 2]>,
    /// Speed at the peak of a run-up.
    #[serde(default)]
    pub peak_speed_rpm: Option<f64>,
    /// Row of response.csv, 0 = first.
    pub peak_row: Option<usize>,
    /// True if the largest amplitude is at an end of the range: the curve may rise further outside.
    pub peak_at_end_of_range: bool,
    /// Height of the curve through the peak and its neighbours above the peak, relative; `None` at
    /// an end of the range or beside a frequency without a result.
    pub peak_rise: Option<f64>,
    /// Ranges in which another motion was found beside that of response.csv, rising.
    pub second_motion: Vec<SecondMotion>,
    /// Folds of the curve, in its order: between two of them the motions are unstable.
    #[serde(default)]
    pub folds: Vec<FoldSummary>,
    /// All local maxima inside the range, rising in frequency.
    pub peaks: Vec<PeakSummary>,
    /// Range of the peak over starting tractions; `None` where the scene asks for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction_range: Option<TractionRangeSummary>,
    /// Exact peak amplitude of the linear reference, m.
    pub linear_peak_amplitude_m: Option<f64>,
    /// Frequency of the peak of the linear reference, Hz.
    pub linear_peak_frequency_hz: Option<f64>,
    /// Peak amplitude over linear peak amplitude.
    pub peak_ratio: Option<f64>,
    /// Counts of the states of the pairs in a period at the peak. The five counts add up to the
    /// number of pairs.
    pub peak_stuck_pairs: Option<usize>,
    /// Number of pairs that slip and stay closed.
    pub peak_slipping_pairs: Option<usize>,
    /// Number of pairs that are closed in the static state and open at times.
    pub peak_opening_pairs: Option<usize>,
    /// Number of pairs that are open in the static state and close at times.
    pub peak_closing_pairs: Option<usize>,
    /// Number of pairs that stay open.
    pub peak_open_pairs: Option<usize>,
    /// Counts of the states of the pairs of each contact at the peak.
    #[serde(default)]
    pub peak_contacts: Vec<ContactCounts>,
    /// Mean power of friction at the peak. It is 0 if friction takes no power beyond rounding.
    pub peak_friction_power_w: Option<f64>,
    /// Mean power of viscous damping at the peak.
    pub peak_damping_power_w: Option<f64>,
    /// Energy that friction dissipates in a period per area at the peak, the largest over the
    /// pairs; `None` if the area of a pair is unknown.
    pub peak_largest_friction_energy_j_m2: Option<f64>,
    /// Distance slid in a period at the peak, the largest over the pairs.
    pub peak_largest_slid_m: Option<f64>,
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
    /// Counts of the states of the pairs at the peak; `None` without a peak.
    pub(crate) fn peak_counts(&self) -> Option<CycleCounts> {
        Some(CycleCounts {
            stuck: self.peak_stuck_pairs?,
            slipping: self.peak_slipping_pairs?,
            opening: self.peak_opening_pairs?,
            closing: self.peak_closing_pairs?,
            open: self.peak_open_pairs?,
        })
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

/// Counts of the states of the pairs of a contact in a period.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactCounts {
    /// Name of the contact.
    pub name: String,
    /// Counts of its pairs.
    #[serde(flatten)]
    pub counts: CycleCounts,
}

/// Counts of the states of the pairs of each contact in the period of an orbit.
pub fn contact_counts(pairs: &PairTable, orbit: &Orbit) -> Vec<ContactCounts> {
    let contacts = pairs.contacts.iter().enumerate();
    let of_contact = |(c, name): (usize, &String)| {
        let own = pairs.rows.iter().zip(&orbit.cycles);
        let own = own.filter(|(row, _)| row.contact == c);
        ContactCounts {
            name: name.clone(),
            counts: own.map(|(_, cycle)| cycle.status).collect(),
        }
    };
    contacts.map(of_contact).collect()
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
pub struct PeakSummary {
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

fn peak_summary(peak: &LocalPeak) -> PeakSummary {
    let loss_factor = peak.loss_factor.and_then(finite);
    PeakSummary {
        row: peak.at.index,
        frequency_hz: peak.at.frequency_hz,
        amplitude_m: peak.at.amplitude_m,
        loss_factor,
        quality_factor: loss_factor.map(f64::recip).and_then(finite),
    }
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
/// order of a run-up.
pub fn response_summary(
    pairs: &PairTable,
    observation: Option<&str>,
    response: &Response,
    along: Option<EngineOrder>,
) -> ResponseSummary {
    let top = peak(response, 0);
    let at_peak = top.map(|p| &response.orbits[p.index]);
    let counts = at_peak.map(Orbit::counts);
    let linear = linear_peak(response, 0);
    let separates = sweep_fields(response, pairs.rows.len()).separates;
    let cycles = at_peak.map(|orbit| cycle_fields(orbit, &pairs.rows));
    let friction_works = at_peak.is_some_and(|orbit| friction_power_w(orbit) > 0.0);
    let energies = cycles.as_ref().map(|c| &c.friction_energy_j_m2);
    let largest_energy = energies.and_then(|energies| largest_of_pairs(energies));
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
    let inaccurate = |o: &&Orbit| o.outcome == Outcome::AccuracyNotReached;
    let inaccurate = response.orbits.iter().filter(inaccurate);
    let fold = |row: usize| FoldSummary {
        row,
        frequency_hz: response.orbits[row].frequency_hz,
        amplitude_m: response.orbits[row].observed_amplitude.first().copied(),
    };
    ResponseSummary {
        points: response.orbits.len(),
        converged_points: response
            .orbits
            .iter()
            .filter(|o| o.outcome.is_converged())
            .count(),
        accuracy_not_reached_points: inaccurate.count(),
        largest_estimated_error: largest_estimated_error(response),
        peak_estimated_error: at_peak.and_then(|o| o.observed_error.first().copied()),
        peak_largest_estimated_error: at_peak.and_then(|o| o.estimated_error),
        unconverged: unconverged.collect(),
        observation: observation.map(str::to_owned),
        peak_amplitude_m: top.map(|p| p.amplitude_m),
        peak_frequency_hz: top.map(|p| p.frequency_hz),
        engine_order: along,
        speed_rpm: along.and_then(|order| {
            let ends = response.orbits.first().zip(response.orbits.last())?;
            let ends: [&Orbit; 2] = ends.into();
            Some(ends.map(|o| order.speed_rpm(o.frequency_hz)))
        }),
        peak_speed_rpm: along
            .zip(top)
            .map(|(order, p)| order.speed_rpm(p.frequency_hz)),
        peak_row: top.map(|p| p.index),
        peak_at_end_of_range: peak_is_at_an_end(response, 0),
        peak_rise: peak_rise(response, 0),
        second_motion: response.second_motions.clone(),
        folds: folds(response).into_iter().map(fold).collect(),
        peaks: local_peaks(response, 0).iter().map(peak_summary).collect(),
        traction_range: None,
        linear_peak_amplitude_m: linear.map(|p| p.amplitude_m),
        linear_peak_frequency_hz: linear.map(|p| p.frequency_hz),
        peak_ratio: peak_ratio(response, 0),
        peak_stuck_pairs: counts.map(|c| c.stuck),
        peak_slipping_pairs: counts.map(|c| c.slipping),
        peak_opening_pairs: counts.map(|c| c.opening),
        peak_closing_pairs: counts.map(|c| c.closing),
        peak_open_pairs: counts.map(|c| c.open),
        peak_contacts: at_peak.map_or_else(Vec::new, |o| contact_counts(pairs, o)),
        peak_friction_power_w: at_peak.map(friction_power_w).and_then(finite),
        peak_damping_power_w: at_peak.and_then(|o| finite(o.viscous_power_w)),
        peak_largest_friction_energy_j_m2: largest_energy
            .map(|energy| if friction_works { energy } else { 0.0 }),
        peak_largest_slid_m: cycles.and_then(|c| largest_of_pairs(&c.slid_m)),
        peak_fretting: None,
        pairs_that_open: separates.iter().filter(|separates| **separates).count(),
        area_share_that_opens: opening_share(pairs, &separates),
        worst_energy_balance_error: with_motion(response)
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
