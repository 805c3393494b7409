//! Fields on the flanks: what their maps and the report show of each pair.

use crate::words::figure;
use dovetail_solver::dlft::{Orbit, Response, StaticState};
use dovetail_solver::model::ContactPair;
use dovetail_solver::results::quantities::{
    cycle_fields, moving_orbits, static_fields, sweep_fields,
};

/// Share of the largest value below which rounding leaves a value below zero.
const ROUNDING: f64 = 1e-6;

/// Value of each pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Quantity and state: `mean pressure at the peak`.
    pub title: &'static str,
    /// SI unit; empty if the values have none.
    pub unit: &'static str,
    /// Value of each pair; NaN if it has none.
    pub values: Vec<f64>,
}

impl Field {
    /// Ends of the scale of colours: zero, or the least value below it, and the largest value.
    pub(crate) fn range(&self) -> [f64; 2] {
        let values = || self.values.iter().copied().filter(|v| v.is_finite());
        let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let low = if -low < ROUNDING * high { 0.0 } else { low };
        [low, if high > low { high } else { low + 1.0 }]
    }
}

/// Fields of the period of an orbit, which is called the peak: energy that friction takes, distance
/// slid, largest and mean pressure, share of the period spent open.
pub fn peak_fields(orbit: &Orbit, pairs: &[ContactPair]) -> [Field; 5] {
    let cycle = cycle_fields(orbit, pairs);
    let fields = [
        (
            "energy taken by friction in a period at the peak",
            "J/m²",
            cycle.friction_energy_j_m2,
        ),
        ("distance slid in a period at the peak", "m", cycle.slid_m),
        ("largest pressure at the peak", "Pa", cycle.pressure_max_pa),
        ("mean pressure at the peak", "Pa", cycle.pressure_mean_pa),
        (
            "share of the period spent open at the peak",
            "",
            cycle.open_fraction,
        ),
    ];
    fields.map(|(title, unit, values)| Field {
        title,
        unit,
        values,
    })
}

/// Fields of the static state: pressure and length of the slip. `None` if it did not converge.
pub fn static_state_fields(state: &StaticState, pairs: &[ContactPair]) -> Option<[Field; 2]> {
    if !state.outcome.is_converged() {
        return None;
    }
    let fields = static_fields(state, pairs);
    let slip_m = fields.slip_m.iter().map(|[t1, t2]| t1.hypot(*t2));
    let slip_m = slip_m.collect();
    let pressure = Field {
        title: "static pressure",
        unit: "Pa",
        values: fields.pressure_pa,
    };
    let slip = Field {
        title: "static slip",
        unit: "m",
        values: slip_m,
    };
    Some([pressure, slip])
}

/// Pairs that open at any converged frequency (the paper's Figure 5).
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// Title of the map.
    pub title: String,
    /// True for each pair that opens.
    pub opens: Vec<bool>,
}

impl Separation {
    /// Pairs that open in a response with this number of pairs.
    pub fn new(response: &Response, pairs: usize) -> Self {
        let opens = sweep_fields(response, pairs).separates;
        let frequencies = || moving_orbits(response).map(|orbit| orbit.frequency_hz);
        let [least, most] = [
            frequencies().reduce(f64::min),
            frequencies().reduce(f64::max),
        ];
        let title = match (least, most) {
            (Some(least), Some(most)) => format!(
                "Pairs that open somewhere from {} to {} Hz: {} of {pairs}",
                figure(least, 4),
                figure(most, 4),
                opens.iter().filter(|opens| **opens).count(),
            ),
            _ => "Pairs that open: no frequency converged".to_owned(),
        };
        Self { title, opens }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_begin_at_zero_or_below_it() {
        let range = |values: &[f64]| {
            let field = Field {
                title: "",
                unit: "Pa",
                values: values.to_vec(),
            };
            field.range()
        };
        assert_eq!(range(&[2.0, 3.0]), [0.0, 3.0]);
        assert_eq!(range(&[-1e-9, 3.0]), [0.0, 3.0]);
        assert_eq!(range(&[-1.0, 3.0]), [-1.0, 3.0]);
        assert_eq!(range(&[0.0, f64::NAN]), [0.0, 1.0]);
    }
}
