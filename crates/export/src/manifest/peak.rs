//! Peak of an observation in summary.json. Console and report have it from there.

use serde::{Deserialize, Serialize};

use super::finite;
use super::stability::PeakStability;
use crate::words::{error_words, figure, quantity_in_prefix, supported_digits};
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::{CycleCounts, Response};
use dovetail_solver::integration::departure::Departure;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::peak::{
    largest_amplitude, linear_peak, local_peaks, peak, peak_ratio, peak_rise, uncomputed_resonance,
};
use dovetail_solver::results::quantities::{
    cycle_fields, friction_power_w, largest_of_pairs, largest_slid_error_m,
};

/// Number of digits of amplitudes of the linear curve, which is exact.
const LINEAR_DIGITS: usize = 4;

/// Peak of an observation, and what happens there. Amplitudes are in m; those of a strain have no
/// unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ObservedPeak {
    /// Frequencies between which no motion is known although the resonance may be there, Hz. `None`
    /// if the resonance was computed. Otherwise all figures of the peak are missing.
    #[serde(default)]
    pub resonance_not_computed_hz: Option<[f64; 2]>,
    /// Largest amplitude that was found; `None` if nothing converged. It is the peak if the resonance
    /// was computed.
    #[serde(default)]
    pub largest_amplitude_m: Option<f64>,
    /// Frequency of the largest amplitude that was found, Hz.
    #[serde(default)]
    pub largest_amplitude_frequency_hz: Option<f64>,
    /// Amplitude of the peak; `None` if the resonance was not computed.
    pub peak_amplitude_m: Option<f64>,
    /// Frequency of that amplitude, Hz.
    pub peak_frequency_hz: Option<f64>,
    /// Speed at the peak of a run-up.
    #[serde(default)]
    pub peak_speed_rpm: Option<f64>,
    /// Row of response.csv, 0 = first.
    pub peak_row: Option<usize>,
    /// Estimated relative error of the amplitude from harmonics and samples; `None` if it is not
    /// known, and without pairs.
    pub peak_estimated_error: Option<f64>,
    /// Largest estimated relative error of all observed amplitudes at that peak.
    pub peak_largest_estimated_error: Option<f64>,
    /// True if the largest amplitude is at an end of the range: the curve may rise further outside.
    pub peak_at_end_of_range: bool,
    /// Height of the curve through the peak and its neighbours above the peak, relative; `None` at
    /// an end of the range or beside a frequency without a result.
    pub peak_rise: Option<f64>,
    /// Loss factor, if the peak is a local maximum inside of the range.
    #[serde(default)]
    pub peak_loss_factor: Option<f64>,
    /// Exact peak amplitude of the linear reference.
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
    /// Its estimated error; `None` where it is not known.
    #[serde(default)]
    pub peak_friction_power_error_w: Option<f64>,
    /// Mean power of viscous damping at the peak.
    pub peak_damping_power_w: Option<f64>,
    /// Its estimated error; `None` where it is not known.
    #[serde(default)]
    pub peak_damping_power_error_w: Option<f64>,
    /// Energy that friction dissipates in a period per area at the peak, the largest over the
    /// pairs; `None` if the area of a pair is unknown.
    pub peak_largest_friction_energy_j_m2: Option<f64>,
    /// Distance slid in a period at the peak, the largest over the pairs.
    pub peak_largest_slid_m: Option<f64>,
    /// Its estimated error; `None` where it is not known.
    #[serde(default)]
    pub peak_largest_slid_error_m: Option<f64>,
    /// Stability of the motion at the peak; `None` where nobody asked for it.
    #[serde(default)]
    pub peak_stability: Option<PeakStability>,
}

impl ObservedPeak {
    /// Peak of observation `i` of a response. `along` is the engine order of a run-up, `departures` are
    /// the integrations from unstable peaks.
    pub(super) fn new(
        response: &Response,
        i: usize,
        pairs: &PairTable,
        along: Option<EngineOrder>,
        departures: &[Departure],
    ) -> Self {
        let linear = linear_peak(response, i);
        let largest = largest_amplitude(response, i);
        let without_peak = Self {
            resonance_not_computed_hz: uncomputed_resonance(response, i),
            largest_amplitude_m: largest.map(|p| p.amplitude_m),
            largest_amplitude_frequency_hz: largest.map(|p| p.frequency_hz),
            linear_peak_amplitude_m: linear.map(|p| p.amplitude_m),
            linear_peak_frequency_hz: linear.map(|p| p.frequency_hz),
            ..Self::default()
        };
        let Some(top) = peak(response, i) else {
            return without_peak;
        };
        let orbit = &response.orbits[top.index];
        let counts = orbit.counts();
        let cycles = cycle_fields(orbit, &pairs.rows);
        let friction_w = friction_power_w(orbit);
        let of_contact = |(c, name): (usize, &String)| {
            let own = pairs.rows.iter().zip(&orbit.cycles);
            let own = own.filter(|(row, _)| row.contact == c);
            ContactCounts {
                name: name.clone(),
                counts: own.map(|(_, cycle)| cycle.status).collect(),
            }
        };
        let contacts = pairs.contacts.iter().enumerate().map(of_contact);
        let errors = orbit.figure_errors.as_ref();
        let energy = largest_of_pairs(&cycles.friction_energy_j_m2);
        let local = local_peaks(response, i).into_iter();
        let loss = local.filter(|local| local.at.index == top.index);
        Self {
            peak_amplitude_m: Some(top.amplitude_m),
            peak_frequency_hz: Some(top.frequency_hz),
            peak_speed_rpm: along.map(|order| order.speed_rpm(top.frequency_hz)),
            peak_row: Some(top.index),
            peak_estimated_error: orbit.observed_error.get(i).copied(),
            peak_largest_estimated_error: orbit.estimated_error,
            peak_at_end_of_range: top.is_at_an_end,
            peak_rise: peak_rise(response, i),
            peak_loss_factor: loss.filter_map(|local| local.loss_factor).find_map(finite),
            peak_ratio: peak_ratio(response, i),
            peak_stuck_pairs: Some(counts.stuck),
            peak_slipping_pairs: Some(counts.slipping),
            peak_opening_pairs: Some(counts.opening),
            peak_closing_pairs: Some(counts.closing),
            peak_open_pairs: Some(counts.open),
            peak_contacts: contacts.collect(),
            peak_friction_power_w: finite(friction_w),
            peak_friction_power_error_w: errors.and_then(|e| finite(e.friction_power_w)),
            peak_damping_power_w: finite(orbit.viscous_power_w),
            peak_damping_power_error_w: errors.and_then(|e| finite(e.viscous_power_w)),
            peak_largest_friction_energy_j_m2: energy
                .map(|energy| if friction_w > 0.0 { energy } else { 0.0 }),
            peak_largest_slid_m: largest_of_pairs(&cycles.slid_m),
            peak_largest_slid_error_m: largest_slid_error_m(orbit).and_then(finite),
            peak_stability: PeakStability::new(response, i, top.index, departures),
            ..without_peak
        }
    }

    /// The figures that do not need a peak, if no motion is known between these frequencies, Hz.
    pub(super) fn without_peak(self, unknown_hz: [f64; 2]) -> Self {
        let [from, to] = self.resonance_not_computed_hz.unwrap_or(unknown_hz);
        Self {
            resonance_not_computed_hz: Some([from.min(unknown_hz[0]), to.max(unknown_hz[1])]),
            largest_amplitude_m: self.largest_amplitude_m,
            largest_amplitude_frequency_hz: self.largest_amplitude_frequency_hz,
            linear_peak_amplitude_m: self.linear_peak_amplitude_m,
            linear_peak_frequency_hz: self.linear_peak_frequency_hz,
            ..Self::default()
        }
    }

    /// Amplitude and frequency in Hz; `None` if nothing converged.
    pub fn place(&self) -> Option<[f64; 2]> {
        Some([self.peak_amplitude_m?, self.peak_frequency_hz?])
    }

    /// Sentence that the resonance was not computed, without its full stop; `None` if it was.
    pub fn not_computed_words(&self) -> Option<String> {
        let [from, to] = self.resonance_not_computed_hz?.map(|hz| figure(hz, 6));
        Some(format!(
            "the resonance was not computed: no motion is known from {from} to {to} Hz"
        ))
    }

    /// Amplitude and frequency in Hz of the linear reference; `None` if there are no pairs, whose
    /// response is its own reference.
    pub fn linear(&self) -> Option<[f64; 2]> {
        let has_pairs = self.counts().is_some() || self.resonance_not_computed_hz.is_some();
        if !has_pairs {
            return None;
        }
        Some([
            self.linear_peak_amplitude_m?,
            self.linear_peak_frequency_hz?,
        ])
    }

    /// Returns `true` if the peak was judged unstable.
    pub fn is_unstable(&self) -> bool {
        let stability = self.peak_stability.as_ref();
        stability.is_some_and(|stability| stability.stable == Some(false))
    }

    /// Stability of the peak in words: `stable`, or `unstable: period doubling, multiplier -1.4`; `None`
    /// where it was not judged.
    pub fn stability_words(&self) -> Option<String> {
        let stability = self.peak_stability.as_ref()?;
        match stability.stable? {
            true => Some("stable".to_owned()),
            false => Some(format!("unstable: {}", stability.instability_words()?)),
        }
    }

    /// Counts of the states of the pairs; `None` without pairs.
    pub fn counts(&self) -> Option<CycleCounts> {
        let counts = CycleCounts {
            stuck: self.peak_stuck_pairs?,
            slipping: self.peak_slipping_pairs?,
            opening: self.peak_opening_pairs?,
            closing: self.peak_closing_pairs?,
            open: self.peak_open_pairs?,
        };
        (counts.pairs() > 0).then_some(counts)
    }

    /// Error of the friction power at the peak relative to it; `None` where it is not known, or
    /// friction takes nothing.
    pub fn friction_power_error(&self) -> Option<f64> {
        let power_w = self.peak_friction_power_w.filter(|power| *power > 0.0)?;
        Some(self.peak_friction_power_error_w? / power_w)
    }

    /// Number of digits of the amplitude that its estimated error supports.
    pub fn digits(&self) -> usize {
        let exact = self.counts().is_none().then_some(0.0);
        let error = self.peak_estimated_error.or(exact);
        supported_digits(self.peak_amplitude_m.unwrap_or_default(), error)
    }

    /// Amplitude in words: `6.4 mm`; `None` if nothing converged.
    pub fn amplitude_words(&self, unit: &str) -> Option<String> {
        let [amplitude, _] = self.place()?;
        Some(quantity_in_prefix(
            amplitude,
            self.larger(),
            unit,
            self.digits(),
        ))
    }

    /// Amplitude of the linear reference in words, with the same prefix: `16.64 mm`; `None` as for
    /// [`ObservedPeak::linear`].
    pub fn linear_words(&self, unit: &str) -> Option<String> {
        let [amplitude, _] = self.linear()?;
        Some(quantity_in_prefix(
            amplitude,
            self.larger(),
            unit,
            LINEAR_DIGITS,
        ))
    }

    /// Larger one of the two amplitudes.
    fn larger(&self) -> f64 {
        let both = [self.place(), self.linear()].into_iter().flatten();
        both.map(|[amplitude, _]| amplitude).fold(0.0, f64::max)
    }

    /// Estimated error in words; `None` if it is not known, and without pairs, which leave nothing
    /// out.
    pub fn error_words(&self) -> Option<String> {
        self.counts()?;
        self.peak_estimated_error.map(error_words)
    }

    /// Ratio to the linear peak in words: `0.39`; `None` if there is no such peak, and without
    /// pairs.
    pub fn ratio_words(&self) -> Option<String> {
        self.counts()?;
        Some(figure(self.peak_ratio?, self.digits().min(3)))
    }

    /// Loss factor in words: `loss factor 0.00518 (Q = 193)`.
    pub fn loss_words(&self) -> Option<String> {
        let loss = self.peak_loss_factor.filter(|loss| *loss > 0.0)?;
        let quality = figure(loss.recip(), 3);
        Some(format!("loss factor {} (Q = {quality})", figure(loss, 3)))
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
