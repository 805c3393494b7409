//! Pictures of the peaks over one key, or two.

use std::path::PathBuf;

use crate::error::RunError;
use crate::export::ExportError;
use crate::export::csv::PeakRow;
use crate::export::plots::{Axis, HeatMap, Scale, Series, write_heat_map, write_series};
use crate::words::{capital, rounded, short, title};
use dovetail_solver::results::quantities::loss_factor;

/// Digits of the values along the lower edge of a map.
const MAP_DIGITS: usize = 3;

/// Peaks over the values of a key.
#[derive(Debug)]
pub struct PeakLine<'a> {
    /// Words of the value of the second key, or of what is observed.
    pub label: String,
    /// Name of the observed displacement.
    pub observation: String,
    /// Peaks, ascending in value.
    pub rows: Vec<PeakRow<'a>>,
    /// Values that were asked for.
    pub asked: Vec<f64>,
}

/// A quantity of a peak: name of its file, title, unit, and value.
type Drawn = (
    &'static str,
    &'static str,
    &'static str,
    fn(&PeakRow<'_>) -> Option<f64>,
);

const DRAWN: [Drawn; 3] = [
    ("peaks_amplitude", "peak amplitude", "m", |row| {
        Some(row.amplitude_m())
    }),
    ("peaks_frequency", "frequency of the peak", "Hz", |row| {
        Some(row.peak.orbit.frequency_hz)
    }),
    ("peaks_loss_factor", "loss factor at the peak", "", |row| {
        loss_factor(&row.peak.orbit)
    }),
];

/// Draws amplitude, frequency and loss factor over the values of the last key, and a map of the
/// amplitudes over both where there are two. `file` gives the place of a picture.
pub fn draw(
    keys: &[&str],
    lines: &[PeakLine<'_>],
    file: impl Fn(&str) -> Result<PathBuf, ExportError>,
) -> Result<(), RunError> {
    let titled = |key: &str| title(key.rsplit('.').next().unwrap_or(key));
    let over = keys.last().map_or(String::new(), |key| titled(key));
    let of = lines.first().map_or("", |line| line.observation.as_str());
    for (name, quantity, unit, value) in DRAWN {
        let series: Vec<Series> = (lines.iter())
            .map(|line| {
                let points = line.rows.iter().map(|row| (row.peak.value, value(row)));
                Series::new(line.label.clone(), points)
            })
            .collect();
        let points = || series.iter().flat_map(|s| &s.points);
        let x = Axis {
            title: over.clone(),
            unit: "",
            scale: Scale::of(points().map(|p| p.0)),
            marks: Vec::new(),
        };
        let y = Axis {
            title: quantity.to_owned(),
            unit,
            scale: Scale::of(points().filter_map(|p| p.1)),
            marks: Vec::new(),
        };
        let shows = format!("{} of {of} over {over}", capital(quantity));
        write_series(&file(name)?, &shows, &[x, y], &series)?;
    }
    let ([also, _], [first, _, ..]) = (keys, lines) else {
        return Ok(());
    };
    let at = |line: &PeakLine<'_>, value: f64| {
        let row = line.rows.iter().find(|row| row.peak.value == value);
        row.map(PeakRow::amplitude_m)
    };
    let map = HeatMap {
        quantity: format!("peak amplitude of {of}"),
        unit: "m",
        labels: [
            (first.asked.iter())
                .map(|value| short(rounded(*value, MAP_DIGITS)))
                .collect(),
            lines.iter().map(|line| line.label.clone()).collect(),
        ],
        values: (first.asked.iter())
            .map(|value| lines.iter().map(|line| at(line, *value)).collect())
            .collect(),
        axes: [over, titled(also)],
    };
    Ok(write_heat_map(&file("peaks_map")?, &map)?)
}
