//! Data for the scripts of a report, as JSON.

use serde::Serialize;

use super::Contents;
use super::packed::{Scaled, bytes, scaled};
use super::skin::Skin;
use crate::colours::{self, Colour, STATES, StateStyle};
use crate::curves::Curves;
use crate::fields::{Field, peak_fields, static_state_fields};
use crate::unrolled::{Panel, panels};
use crate::words::{figure, quantity, seven_digits};
use dovetail_solver::dlft::{Orbit, Response};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{cycle_fields, moving_orbits};
use dovetail_solver::results::signals::{PairSignals, pair_signals};
use dovetail_solver::run::Observed;

/// Largest number of hysteresis loops in a report.
const LOOPS: usize = 4;
/// Number of points of a loop.
const INSTANTS: usize = 128;

/// All data of the pictures.
#[derive(Debug, Serialize)]
pub(super) struct Data {
    /// Amplitude and phase of each observation.
    amplitudes: Vec<Curves>,
    phases: Vec<Curves>,
    pairs: Option<Curves>,
    powers: Option<Curves>,
    /// Frequency of the peak of the first observation, Hz.
    peak_hz: Option<f64>,
    /// States of a pair, by their codes.
    states: [StateStyle; 5],
    colours: FieldColours,
    flanks: Vec<Panel>,
    fields: Vec<PackedField>,
    statuses: Option<Statuses>,
    loops: Vec<Loop>,
    skin: Option<Skin>,
}

/// Colours of fields from the least value to the largest.
#[derive(Debug, Serialize)]
struct FieldColours {
    flanks: [Colour; 11],
    bodies: [Colour; 5],
}

/// Value of each pair.
#[derive(Debug, Serialize)]
struct PackedField {
    title: &'static str,
    unit: &'static str,
    /// Ends of the scale of colours.
    ends: [f64; 2],
    values: Scaled,
}

/// State of each pair at each converged frequency, as codes of the status: the pairs of the first
/// frequency, then of the second, and so on.
#[derive(Debug, Serialize)]
struct Statuses {
    frequency_hz: Vec<f64>,
    peak: Option<usize>,
    codes: String,
}

/// Friction force over displacement of a pair in a period, along the direction in which it moves
/// most.
#[derive(Debug, Serialize)]
struct Loop {
    pair: usize,
    /// Letter that marks the pair on the map.
    letter: char,
    title: String,
    displacement_m: Vec<f64>,
    force_n: Vec<f64>,
}

impl Data {
    pub fn new(contents: &Contents<'_>) -> Self {
        let model = contents.flank_model();
        let (sweep, pairs) = (contents.sweep.as_ref(), contents.pairs);
        let of_pairs = sweep.filter(|_| contents.has_pairs());
        let panels = model.map_or_else(Vec::new, panels);
        let orbit = contents.peak_orbit();
        let peak_hz = orbit.map(|orbit| orbit.frequency_hz);
        let moving = model.zip(orbit).into_iter();
        let moving = moving.flat_map(|(model, orbit)| peak_fields(orbit, &model.pairs));
        let still = model.zip(contents.static_state);
        let still = still.and_then(|(model, state)| static_state_fields(state, &model.pairs));
        let fields = moving.chain(still.into_iter().flatten());
        let observed = || contents.observations.iter().enumerate();
        let curves = |of: &dyn Fn(usize, &Observed) -> Option<Curves>| {
            observed().filter_map(|(i, one)| of(i, one)).collect()
        };
        Self {
            amplitudes: curves(&|i, one| Some(sweep?.amplitude(one, i))),
            phases: curves(&|i, one| Some(sweep?.phase(&one.name, i))),
            pairs: of_pairs.map(|sweep| sweep.pairs()),
            powers: of_pairs.map(|sweep| sweep.powers()),
            peak_hz,
            states: STATES,
            colours: FieldColours {
                flanks: colours::VIRIDIS,
                bodies: colours::BODIES,
            },
            fields: fields.map(PackedField::new).collect(),
            statuses: sweep
                .filter(|_| model.is_some())
                .map(|sweep| statuses(sweep.response, pairs, peak_hz)),
            loops: orbit.map_or_else(Vec::new, |orbit| loops(orbit, pairs, &panels)),
            flanks: panels,
            skin: contents
                .model
                .map(|model| Skin::new(model, contents.motion, contents.stress)),
        }
    }
}

impl PackedField {
    fn new(field: Field) -> Self {
        Self {
            title: field.title,
            unit: field.unit,
            ends: field.range(),
            values: scaled(field.values.iter().copied()),
        }
    }
}

fn statuses(response: &Response, pairs: &PairTable, peak_hz: Option<f64>) -> Statuses {
    let codes = moving_orbits(response).flat_map(|orbit| cycle_fields(orbit, &pairs.rows).status);
    let codes: Vec<u8> = codes.map(|status| status as u8).collect();
    Statuses {
        frequency_hz: moving_orbits(response).map(|o| o.frequency_hz).collect(),
        peak: moving_orbits(response).position(|o| Some(o.frequency_hz) == peak_hz),
        codes: bytes(&codes),
    }
}

fn loops(orbit: &Orbit, pairs: &PairTable, panels: &[Panel]) -> Vec<Loop> {
    let mut order: Vec<usize> = (0..orbit.cycles.len()).collect();
    let power = |pair: &usize| orbit.cycles[*pair].friction_power_w;
    order.sort_by(|a, b| power(b).total_cmp(&power(a)));
    let spends = order.into_iter().filter(|pair| power(pair) > 0.0);
    spends
        .take(LOOPS)
        .zip('A'..)
        .map(|(pair, letter)| {
            let contact = &pairs.contacts[pairs.rows[pair].contact];
            let place =
                place_of(panels, pair).map_or_else(String::new, |place| format!(", {place}"));
            let energy_j = orbit.cycles[pair].friction_power_w / orbit.frequency_hz;
            let energy = quantity(energy_j, "J", 3);
            let title = format!("{contact}, pair {pair}{place}: {energy} in a period");
            hysteresis(orbit, pair, letter, title)
        })
        .collect()
}

/// Position of a pair on the map of its flank, such as `3.2 mm from the front end and 1.1 mm from
/// the inner edge`.
fn place_of(panels: &[Panel], pair: usize) -> Option<String> {
    let patches = panels.iter().flat_map(|panel| {
        let patches = panel.patches.iter();
        patches.map(|patch| (&panel.edges, patch))
    });
    let (edges, patch) = patches.into_iter().find(|(_, patch)| patch.pair == pair)?;
    let middle = |axis: usize| {
        let values = || patch.outline.iter().map(|p| p[axis]);
        0.5 * (values().fold(f64::INFINITY, f64::min) + values().fold(f64::NEG_INFINITY, f64::max))
    };
    let from = |axis: usize| {
        let edge = match edges[2 * axis].strip_prefix("towards ") {
            Some(direction) => format!("side towards {direction}"),
            None => edges[2 * axis].clone(),
        };
        format!("{} mm from the {edge}", figure(1e3 * middle(axis), 2))
    };
    Some(format!("{} and {}", from(0), from(1)))
}

fn hysteresis(orbit: &Orbit, pair: usize, letter: char, title: String) -> Loop {
    let signals = pair_signals(orbit, pair, INSTANTS);
    let [cos, sin] = signals.main_direction();
    let PairSignals {
        displacement_m: [_, x1, x2],
        force_n: [_, f1, f2],
    } = signals;
    let along = |a: &[f64], b: &[f64]| -> Vec<f64> {
        let both = a.iter().zip(b);
        let mut out: Vec<f64> = both.map(|(a, b)| seven_digits(cos * a + sin * b)).collect();
        // Closed.
        out.extend(out.first().copied());
        out
    };
    Loop {
        pair,
        letter,
        title,
        displacement_m: along(&x1, &x2),
        // By which the body of the first flank pushes that of the second: it spends what the loop
        // encloses.
        force_n: along(&f1, &f2),
    }
}
