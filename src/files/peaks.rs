//! Pictures of the peaks over one key, or two.

use super::conditions::in_motion;
use super::{RunFiles, axis};
use crate::error::RunError;
use dovetail_export::csv::{PeakRow, write_peaks};
use dovetail_export::plots::{HeatMap, Series, error_bar, write_heat_map};
use dovetail_export::words::{capital, rounded, short, title};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::loss_factor;
use dovetail_solver::run::PeakAt;

/// Digits of the values along the lower edge of a map.
const MAP_DIGITS: usize = 3;

/// Name of the table of the peaks.
pub(super) const PEAKS: &str = "peaks.csv";

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
    /// Values without a peak.
    pub missing: Vec<f64>,
}

/// Peaks of a search under way, for a table that an interrupted search leaves.
#[derive(Debug)]
pub struct PeaksFound {
    /// Keys of the values, the key of each line first if there are two.
    pub keys: Vec<String>,
    /// Value of the key of the line under way.
    pub also: Option<f64>,
    found: Vec<Found>,
}

#[derive(Debug)]
struct Found {
    also: Option<f64>,
    observation: usize,
    pairs: PairTable,
    peak: PeakAt,
}

impl PeaksFound {
    /// No peaks yet over the values of these keys, the key of each line first.
    pub fn new(keys: &[&str]) -> Self {
        Self {
            keys: keys.iter().map(|key| (*key).to_owned()).collect(),
            also: None,
            found: Vec::new(),
        }
    }

    /// Adds a peak. If there is one at the same value, the higher one stays.
    pub fn add(&mut self, pairs: &PairTable, observation: usize, peak: &PeakAt) {
        let found = Found {
            also: self.also,
            observation,
            pairs: pairs.clone(),
            peak: peak.clone(),
        };
        let height = |found: &Found| found.peak.amplitude_m(observation);
        let is_same =
            |known: &&mut Found| known.also == found.also && known.peak.value == peak.value;
        match self.found.iter_mut().find(is_same) {
            Some(known) if height(known) >= height(&found) => {}
            Some(known) => *known = found,
            None => {
                // Lines follow each other, and values ascend in a line.
                let is_before =
                    |known: &Found| known.also != found.also || known.peak.value < found.peak.value;
                let at = self
                    .found
                    .iter()
                    .rposition(is_before)
                    .map_or(0, |at| at + 1);
                self.found.insert(at, found);
            }
        }
    }

    /// Rows of the table.
    pub fn rows(&self) -> Vec<PeakRow<'_>> {
        let lines = self.found.iter();
        let rows = lines.map(|lines| PeakRow {
            also: lines.also,
            observation: lines.observation,
            pairs: &lines.pairs,
            peak: &lines.peak,
        });
        rows.collect()
    }
}

impl RunFiles {
    /// Writes peaks.csv and draws amplitude, frequency and loss factor of the peaks. `keys` are the
    /// key of the value of each line, if there is one, and the key of the values along it. Where
    /// there are several lines, the amplitudes are drawn as a map, too.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn peaks(&self, keys: &[&str], lines: &[PeakLine<'_>]) -> Result<(), RunError> {
        let rows: Vec<PeakRow<'_>> = lines.iter().flat_map(|line| line.rows.clone()).collect();
        write_peaks(&self.folder.out.file(PEAKS)?, keys, &rows)?;
        let conditions = in_motion(&self.scene, keys);
        draw(keys, (lines, &conditions), self)
    }
}

/// Ends of the error bar of an amplitude, m.
fn amplitude_bar(row: &PeakRow<'_>) -> Option<[f64; 2]> {
    let error = row.peak.orbit.amplitude_error(row.observation);
    let amplitude_m = row.amplitude_m();
    error_bar(amplitude_m, error.map(|error| error * amplitude_m))
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
/// amplitudes over both if there are two. Values without a peak are marked, and errors are bars.
/// `conditions` hold for all peaks.
fn draw(
    keys: &[&str],
    (lines, conditions): (&[PeakLine<'_>], &str),
    files: &RunFiles,
) -> Result<(), RunError> {
    let titled = |key: &str| title(key.rsplit('.').next().unwrap_or(key));
    let over = keys.last().map_or(String::new(), |key| titled(key));
    let of = lines.first().map_or("", |line| line.observation.as_str());
    for (name, quantity, unit, value) in DRAWN {
        let series: Vec<Series> = (lines.iter())
            .map(|line| {
                let points = line.rows.iter().map(|row| (row.peak.value, value(row)));
                let bars = line.rows.iter().map(amplitude_bar);
                Series {
                    bars: bars.filter(|_| unit == "m").collect(),
                    failed: line.missing.clone(),
                    ..Series::new(line.label.clone(), points)
                }
            })
            .collect();
        let points = || series.iter().flat_map(|s| &s.points);
        let failed = series.iter().flat_map(|s| s.failed.iter().copied());
        let x = axis(over.clone(), "", points().map(|p| p.0).chain(failed));
        let y = axis(quantity.to_owned(), unit, points().filter_map(|p| p.1));
        let shows = format!("{} of {of} over {over}", capital(quantity));
        files.draw(name, [&shows, conditions], &[x, y], &series)?;
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
    Ok(write_heat_map(&files.picture("peaks_map")?, &map)?)
}
