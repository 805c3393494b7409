//! Pictures of the peaks over one key, or two.

use std::path::PathBuf;

use crate::error::RunError;
use crate::export::ExportError;
use crate::export::csv::PeakRow;
use crate::export::plots::{Axis, HeatMap, Scale, Series, write_heat_map, write_series};
use crate::words::{capital, rounded, short, title};
use dovetail_solver::results::quantities::loss_factor;

/// Ratio of the largest to the smallest value from which an axis is logarithmic.
const WIDE: f64 = 5.0;

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
            .map(|line| Series {
                label: line.label.clone(),
                points: line
                    .rows
                    .iter()
                    .map(|row| (row.peak.value, value(row)))
                    .collect(),
                names: Vec::new(),
                joined: true,
            })
            .collect();
        let points = || series.iter().flat_map(|s| &s.points);
        let x = Axis {
            title: over.clone(),
            unit: "",
            scale: scale(points().map(|p| p.0)),
            marks: Vec::new(),
        };
        let y = Axis {
            title: quantity.to_owned(),
            unit,
            scale: scale(points().filter_map(|p| p.1)),
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
    let axes = [over.clone(), titled(also)];
    let map = HeatMap {
        title: format!("Peak amplitude of {of} over {over} and {}", axes[1]),
        unit: "m",
        axes,
        labels: [
            (first.asked.iter())
                .map(|value| short(rounded(*value, MAP_DIGITS)))
                .collect(),
            lines.iter().map(|line| line.label.clone()).collect(),
        ],
        values: (first.asked.iter())
            .map(|value| lines.iter().map(|line| at(line, *value)).collect())
            .collect(),
    };
    Ok(write_heat_map(&file("peaks_map")?, &map)?)
}

/// Logarithmic for positive values of a wide range.
fn scale(values: impl Iterator<Item = f64>) -> Scale {
    let [least, most] = values.fold([f64::INFINITY, 0.0], |[least, most], v| {
        [v.min(least), v.max(most)]
    });
    if least > 0.0 && most >= WIDE * least {
        Scale::Logarithmic
    } else {
        Scale::Linear
    }
}
