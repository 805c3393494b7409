//! Data for the scripts of a report, as JSON.

use std::f64::consts::TAU;

use serde::Serialize;

use super::packed::{Scaled, bytes, scaled};
use super::skin::Skin;
use super::{Contents, Sweep};
use crate::export::states::{STATES, State};
use crate::export::unrolled::{Panel, panels};
use crate::words::{figure, quantity, supported_digits};
use dovetail_solver::dlft::{Orbit, Response};
use dovetail_solver::model::Model;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{
    cycle_fields, friction_power_w, linear_amplitude, peak, phasors, static_fields,
};
use dovetail_solver::results::signals::{PairSignals, pair_signals};

/// Largest number of hysteresis loops in a report.
const LOOPS: usize = 4;
/// Number of points of a loop.
const INSTANTS: usize = 128;

/// All data of the pictures.
#[derive(Debug, Serialize)]
pub(super) struct Data {
    curves: Vec<Curve>,
    counts: Option<Counts>,
    /// Frequency of the peak of the first observation, Hz.
    peak_hz: Option<f64>,
    /// States of a pair, by their codes.
    states: [State; 5],
    flanks: Vec<Flank>,
    fields: Vec<Field>,
    statuses: Option<Statuses>,
    loops: Vec<Loop>,
    skin: Option<Skin>,
}

/// Amplitude of an observation over frequency.
#[derive(Debug, Serialize)]
struct Curve {
    name: String,
    frequency_hz: Vec<f64>,
    amplitude_m: Vec<Option<f64>>,
    /// Estimated relative error of the amplitudes.
    estimated_error: Vec<Option<f64>>,
    linear_m: Vec<Option<f64>>,
    /// Lag of the first harmonic, degrees.
    phase_deg: Vec<Option<f64>>,
    /// Linear reference, with additional points at its peaks.
    linear: Line,
    compared: Option<Line>,
    label: String,
    /// Text of the largest amplitude, with the digits that its estimated error supports.
    peak: String,
}

#[derive(Debug, Serialize)]
struct Line {
    label: String,
    frequency_hz: Vec<f64>,
    amplitude_m: Vec<Option<f64>>,
}

/// Pairs and powers over frequency.
#[derive(Debug, Serialize)]
struct Counts {
    frequency_hz: Vec<f64>,
    slipping: Vec<Option<usize>>,
    opening: Vec<Option<usize>>,
    closing: Vec<Option<usize>>,
    open: Vec<Option<usize>>,
    stuck: Vec<Option<usize>>,
    friction_w: Vec<Option<f64>>,
    damping_w: Vec<Option<f64>>,
}

/// Flank in its own plane, m.
#[derive(Debug, Serialize)]
struct Flank {
    name: String,
    /// Names of the sides left, right, below, above.
    edges: [String; 4],
    size: [f64; 2],
    patches: Vec<Patch>,
}

#[derive(Debug, Serialize)]
struct Patch {
    pair: usize,
    outline: Vec<[f64; 2]>,
}

/// Value of each pair.
#[derive(Debug, Serialize)]
struct Field {
    title: &'static str,
    unit: &'static str,
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
    pub fn of(contents: &Contents<'_>) -> Self {
        let model = contents.model.filter(|model| !model.pairs.is_empty());
        let sweep = contents.sweep.as_ref();
        let pairs = contents.pairs;
        let panels = model.map_or_else(Vec::new, panels);
        Self {
            curves: sweep.map_or_else(Vec::new, |sweep| curves(contents.observations, sweep)),
            counts: sweep
                .filter(|_| !pairs.rows.is_empty())
                .map(|sweep| counts(sweep.response)),
            peak_hz: sweep
                .and_then(Sweep::at_peak)
                .map(|orbit| orbit.frequency_hz),
            states: STATES,
            flanks: panels.iter().map(Flank::of).collect(),
            fields: model.map_or_else(Vec::new, |model| fields(contents, model)),
            statuses: sweep
                .filter(|_| model.is_some())
                .map(|sweep| statuses(sweep, pairs)),
            loops: sweep
                .and_then(Sweep::at_peak)
                .map_or_else(Vec::new, |orbit| loops(orbit, pairs, &panels)),
            skin: contents.model.map(|model| Skin::of(model, contents.motion)),
        }
    }
}

/// Number rounded to seven significant digits: enough for a reader, in few bytes.
fn short(v: f64) -> f64 {
    format!("{v:.6e}").parse().unwrap_or(v)
}

fn valid<T>(orbit: &Orbit, value: T) -> Option<T> {
    orbit.outcome.has_motion().then_some(value)
}

fn curves(names: &[&str], sweep: &Sweep<'_>) -> Vec<Curve> {
    let response = sweep.response;
    let orbits = || response.orbits.iter();
    let line = |label: &str, response: &Response, i: usize| Line {
        label: label.to_owned(),
        frequency_hz: response.orbits.iter().map(|o| o.frequency_hz).collect(),
        amplitude_m: response
            .orbits
            .iter()
            .map(|o| valid(o, short(*o.observed_amplitude_m.get(i)?)))
            .collect(),
    };
    let curve = |(i, name): (usize, &&str)| {
        let own = line("", response, i);
        let linear = |o: &Orbit| linear_amplitude(response, o.frequency_hz, i).map(short);
        let phase = |o: &Orbit| {
            let first = *phasors(o.observed.get(i)?).first()?;
            valid(o, short(first.phase_rad.to_degrees()))
        };
        Curve {
            name: (*name).to_owned(),
            frequency_hz: own.frequency_hz,
            amplitude_m: own.amplitude_m,
            estimated_error: orbits().map(|o| o.amplitude_error(i).map(short)).collect(),
            linear_m: orbits().map(linear).collect(),
            phase_deg: orbits().map(phase).collect(),
            linear: Line {
                label: "linear".to_owned(),
                frequency_hz: response
                    .linear_curve
                    .iter()
                    .map(|p| p.frequency_hz)
                    .collect(),
                amplitude_m: response
                    .linear_curve
                    .iter()
                    .map(|p| p.observed_amplitude_m.get(i).copied().map(short))
                    .collect(),
            },
            compared: sweep
                .compared
                .map(|(label, response)| line(label, response, i)),
            label: sweep.label.clone(),
            peak: peak(response, i).map_or_else(String::new, |peak| {
                let error = response.orbits[peak.index].amplitude_error(i);
                let digits = supported_digits(peak.amplitude_m, error);
                quantity(peak.amplitude_m, "m", digits)
            }),
        }
    };
    names.iter().enumerate().map(curve).collect()
}

fn counts(response: &Response) -> Counts {
    let orbits = || response.orbits.iter();
    let count = |of: fn(&Orbit) -> usize| orbits().map(|o| valid(o, of(o))).collect();
    Counts {
        frequency_hz: orbits().map(|o| o.frequency_hz).collect(),
        slipping: count(|o| o.counts().slipping),
        opening: count(|o| o.counts().opening),
        closing: count(|o| o.counts().closing),
        open: count(|o| o.counts().open),
        stuck: count(|o| o.counts().stuck),
        friction_w: orbits()
            .map(|o| valid(o, short(friction_power_w(o))))
            .collect(),
        damping_w: orbits()
            .map(|o| valid(o, short(o.viscous_power_w)))
            .collect(),
    }
}

impl Flank {
    fn of(panel: &Panel) -> Self {
        let patch = |(pair, outline): &(usize, Vec<[f64; 2]>)| Patch {
            pair: *pair,
            outline: outline.iter().map(|p| p.map(short)).collect(),
        };
        Self {
            name: panel.name.clone(),
            edges: panel.edges.clone(),
            size: [0, 1].map(|axis| panel.high[axis] - panel.low[axis]),
            patches: panel.patches.iter().map(patch).collect(),
        }
    }
}

fn fields(contents: &Contents<'_>, model: &Model) -> Vec<Field> {
    let mut fields = Vec::new();
    let mut add = |title, unit, values: &[f64]| {
        fields.push(Field {
            title,
            unit,
            values: scaled(values.iter().copied()),
        });
    };
    let sweep = contents.sweep.as_ref();
    if let Some(orbit) = sweep.and_then(Sweep::at_peak) {
        let cycle = cycle_fields(orbit, &model.pairs);
        add(
            "energy taken by friction in a period at the peak",
            "J/m²",
            &cycle.friction_energy_j_m2,
        );
        add("distance slid in a period at the peak", "m", &cycle.slid_m);
        add("largest pressure at the peak", "Pa", &cycle.pressure_max_pa);
        add("mean pressure at the peak", "Pa", &cycle.pressure_mean_pa);
        add(
            "share of the period spent open at the peak",
            "",
            &cycle.open_fraction,
        );
    }
    if let Some(state) = contents.static_state.filter(|s| s.outcome.is_converged()) {
        let at_rest = static_fields(state, &model.pairs);
        add("static pressure", "Pa", &at_rest.pressure_pa);
        let slip: Vec<f64> = at_rest.slip_m.iter().map(|s| s[0].hypot(s[1])).collect();
        add("static slip", "m", &slip);
    }
    fields
}

fn statuses(sweep: &Sweep<'_>, pairs: &PairTable) -> Statuses {
    let moving = || {
        let orbits = sweep.response.orbits.iter();
        orbits.filter(|o| o.outcome.has_motion())
    };
    let codes: Vec<u8> = moving()
        .flat_map(|orbit| cycle_fields(orbit, &pairs.rows).status)
        .map(|status| status as u8)
        .collect();
    let peak_hz = sweep.at_peak().map(|orbit| orbit.frequency_hz);
    Statuses {
        frequency_hz: moving().map(|o| o.frequency_hz).collect(),
        peak: moving().position(|o| Some(o.frequency_hz) == peak_hz),
        codes: bytes(&codes),
    }
}

/// Loops of the pairs with the largest friction power.
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
    let patch = |panel: &Panel| {
        let found = panel.patches.iter().find(|(of, _)| *of == pair)?;
        Some((panel.edges.clone(), found.1.clone()))
    };
    let (edges, outline) = panels.iter().find_map(patch)?;
    let middle = |axis: usize| {
        let values = || outline.iter().map(|p| p[axis]);
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
    let PairSignals {
        displacement_m: [_, x1, x2],
        force_n: [_, f1, f2],
    } = pair_signals(orbit, pair, INSTANTS);
    // The longest axis of the path.
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (m1, m2) = (mean(&x1), mean(&x2));
    let moment = |a: &[f64], ma: f64, b: &[f64], mb: f64| -> f64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - ma) * (b - mb)).sum()
    };
    let (s11, s22) = (moment(&x1, m1, &x1, m1), moment(&x2, m2, &x2, m2));
    let angle = 0.5 * (2.0 * moment(&x1, m1, &x2, m2)).atan2(s11 - s22);
    let (sin, cos) = angle.rem_euclid(TAU).sin_cos();
    let along = |a: &[f64], b: &[f64]| -> Vec<f64> {
        let both = a.iter().zip(b);
        let mut out: Vec<f64> = both.map(|(a, b)| short(cos * a + sin * b)).collect();
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
