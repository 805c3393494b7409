//! Table and diagram of `dovetail modes --rpm`.

use std::collections::BTreeSet;

use dovetail_export::csv::ASSEMBLY;
use dovetail_export::plots::{CampbellFamily, EngineOrders, Operation};
use dovetail_export::words::{figure, quantity, supported_digits};
use dovetail_solver::results::modes::ModeKind;
use dovetail_solver::run::{
    Campbell, Crossing, CrossingPeak, DiscWave, ModeFamily, NodalDiameters, PeakAt,
};

/// Highest engine order whose crossings are listed if no engine orders are requested.
const MOST_ENGINE_ORDER: usize = 36;
/// Engine orders that the diagram shows if their names have room, besides those named in the text.
const DRAWN_ENGINE_ORDERS: [usize; 12] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 36];
/// Largest number of speeds of a table.
const MOST_SPEEDS: usize = 10_000;

/// Speeds of a Campbell table: `points` of them, evenly spaced, ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRange {
    from_rpm: f64,
    to_rpm: f64,
    points: usize,
}

/// Reason why a text is not a [`SpeedRange`].
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SpeedRangeError {
    #[error("`{0}` is not FROM:TO:N, such as 0:8000:9")]
    Form(String),
    #[error("speeds must be from 0 to below 1e7 rpm and ascend, not {from} to {to}")]
    Speeds { from: f64, to: f64 },
    #[error(
        "the number of speeds must be from 2 to {MOST_SPEEDS} (1 where both ends are equal), not {0}"
    )]
    Points(usize),
}

impl std::str::FromStr for SpeedRange {
    type Err = SpeedRangeError;

    fn from_str(text: &str) -> Result<Self, SpeedRangeError> {
        let form = || SpeedRangeError::Form(text.to_string());
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let [from, to, points] = parts[..] else {
            return Err(form());
        };
        let speed = |s: &str| s.parse::<f64>().ok().filter(|v| v.is_finite());
        let (from, to) = (speed(from).ok_or_else(form)?, speed(to).ok_or_else(form)?);
        let points: usize = points.parse().map_err(|_| form())?;
        if !(0.0 <= from && from <= to && to < 1e7) {
            return Err(SpeedRangeError::Speeds { from, to });
        }
        if points > MOST_SPEEDS || points < if from == to { 1 } else { 2 } {
            return Err(SpeedRangeError::Points(points));
        }
        Ok(Self {
            from_rpm: from,
            to_rpm: to,
            points,
        })
    }
}

impl SpeedRange {
    /// Speeds, rpm, ascending.
    pub fn values_rpm(&self) -> Vec<f64> {
        let last = (self.points - 1).max(1) as f64;
        let step = (self.to_rpm - self.from_rpm) / last;
        (0..self.points)
            .map(|i| match i + 1 {
                n if n == self.points && n > 1 => self.to_rpm,
                _ => self.from_rpm + step * i as f64,
            })
            .collect()
    }
}

/// Modes over the speed, with engine orders.
#[derive(Debug)]
pub struct Diagram<'a> {
    campbell: &'a Campbell,
    /// Requested engine orders, rising; empty for all up to [`MOST_ENGINE_ORDER`].
    asked: Vec<usize>,
    peaks: &'a [CrossingPeak],
}

impl<'a> Diagram<'a> {
    /// Diagram with the requested engine orders; empty for all up to 36.
    pub fn new(campbell: &'a Campbell, engine_orders: &[usize], peaks: &'a [CrossingPeak]) -> Self {
        let asked: BTreeSet<usize> = engine_orders.iter().copied().collect();
        Self {
            campbell,
            asked: asked.into_iter().collect(),
            peaks,
        }
    }

    /// Curves of the modes.
    pub fn curves(&self) -> Vec<CampbellFamily> {
        self.campbell.families.iter().map(curves).collect()
    }

    /// Crossings of modes and engine orders, rising in speed.
    pub fn crossings(&self) -> Vec<Crossing> {
        self.campbell.crossings(&self.crossed())
    }

    /// Engine orders whose crossings are found.
    fn crossed(&self) -> Vec<usize> {
        if self.asked.is_empty() {
            (1..=MOST_ENGINE_ORDER).collect()
        } else {
            self.asked.clone()
        }
    }

    /// Crossing of each mode that is nearest to the speed of the scene.
    fn nearest(&self) -> Vec<Crossing> {
        self.campbell.nearest_crossings(&self.crossed())
    }

    /// Engine orders of the diagram: all that were requested or that the text names, and others
    /// that have room.
    pub fn drawn_orders(&self) -> EngineOrders {
        if !self.asked.is_empty() {
            return EngineOrders {
                all_of: self.asked.clone(),
                with_room: Vec::new(),
            };
        }
        let named = self.nearest().into_iter().map(|c| c.engine_order);
        let named: BTreeSet<usize> = named.collect();
        EngineOrders {
            all_of: named.into_iter().collect(),
            with_room: DRAWN_ENGINE_ORDERS.to_vec(),
        }
    }

    /// Speed of the scene, and its modes there.
    pub fn operation(&self) -> Operation {
        let speed_rpm = self.campbell.operating_rpm;
        let modes = self.campbell.families.iter().flat_map(|family| {
            (0..family.modes()).filter_map(move |mode| family.frequency_hz(mode, speed_rpm))
        });
        let name = |hz: f64| format!("{hz:.1} Hz, EO {:.2}", hz * 60.0 / speed_rpm);
        Operation {
            speed_rpm,
            modes: if speed_rpm > 0.0 {
                modes.map(|hz| (hz, name(hz))).collect()
            } else {
                Vec::new()
            },
            peaks: found_crossings(self.peaks)
                .map(|(crossing, at)| {
                    let place = (crossing.speed_rpm, crossing.frequency_hz);
                    (place, amplitude(at))
                })
                .collect(),
        }
    }

    /// Table for the reader: the frequencies, and the crossings nearest to the speed of the scene.
    pub fn table(&self) -> String {
        let tables: String = self.campbell.families.iter().map(table).collect();
        let operating_rpm = self.campbell.operating_rpm;
        if operating_rpm <= 0.0 {
            return tables;
        }
        let line = |c: Crossing| {
            format!(
                "{:>10.1}{:>12.4}  EO {:<3}{:+8.1} %  {}, {}, mode {}{}\n",
                c.speed_rpm,
                c.frequency_hz,
                c.engine_order,
                100.0 * c.margin(operating_rpm),
                c.body.as_deref().unwrap_or(ASSEMBLY),
                c.kind.id().replace('_', " "),
                c.mode,
                c.wave
                    .map_or_else(String::new, |wave| format!(", {}", wave_words(wave)))
            )
        };
        let lines: String = self.nearest().into_iter().map(line).collect();
        let orders = if self.asked.is_empty() {
            format!("an engine order up to {MOST_ENGINE_ORDER}")
        } else {
            let orders: Vec<String> = self.asked.iter().map(usize::to_string).collect();
            format!("one of the engine orders {}", orders.join(", "))
        };
        format!(
            "{tables}crossing with {orders} that is nearest to {operating_rpm:.0} rpm, of each mode\n\
             {:>10}{:>12}\n{lines}",
            "speed_rpm", "Hz"
        )
    }
}

/// Crossings with their peaks.
fn found_crossings(peaks: &[CrossingPeak]) -> impl Iterator<Item = (&Crossing, &PeakAt)> {
    let crossings = peaks.iter();
    crossings.filter_map(|peak| Some((&peak.crossing, peak.peak.as_ref().ok()?)))
}

/// Amplitude of a peak with the digits that its error supports.
fn amplitude(at: &PeakAt) -> String {
    let (amplitude_m, error) = (at.amplitude_m(0), at.orbit.amplitude_error(0));
    quantity(amplitude_m, "m", supported_digits(amplitude_m, error))
}

/// Table of the peaks at crossings for the reader; empty where there are none.
pub fn table_of_peaks(observation: &str, peaks: &[CrossingPeak]) -> String {
    let line = |(crossing, at): (&Crossing, &PeakAt)| {
        let ratio = at.linear_m.map(|linear| at.amplitude_m(0) / linear);
        let ratio = ratio.map_or("–".to_owned(), |ratio| figure(ratio, 3));
        format!(
            "{:>10.1}  EO {:<4}{:>6}{:>14}{:>12}{:>12}{:>8}{:>8}\n",
            crossing.speed_rpm,
            crossing.engine_order,
            crossing.mode,
            amplitude(at),
            figure(at.orbit.frequency_hz, 6),
            ratio,
            at.orbit.counts().slipping,
            at.orbit.counts().opening,
        )
    };
    let lines: String = found_crossings(peaks).map(line).collect();
    if lines.is_empty() {
        return lines;
    }
    format!(
        "peak of {observation} at the crossings of the assembly, each at its speed\n\
         {:>10}{:<9}{:>6}{:>14}{:>12}{:>12}{:>8}{:>8}\n{lines}",
        "speed_rpm", "  order", "mode", "amplitude", "Hz", "of linear", "slip", "open"
    )
}

/// Table of the frequencies of a disc for the reader, one line per nodal diameter.
pub fn table_of_nodal_diameters(found: &NodalDiameters) -> String {
    let modes = found.frequencies_hz.iter().map(Vec::len).max().unwrap_or(0);
    let heads: String = (1..=modes).map(|mode| format!("{mode:>12}")).collect();
    let line = |(diameter, frequencies): (usize, &Vec<f64>)| {
        let cells = frequencies.iter().map(|hz| format!("{hz:>12.4}"));
        format!("{diameter:>10}{}\n", cells.collect::<String>())
    };
    let lines = found.frequencies_hz.iter().enumerate().map(line);
    format!(
        "disc of {} sectors, all pairs stuck: frequencies in Hz\n{:>10}{heads}\n{}",
        found.sectors,
        "diameters",
        lines.collect::<String>()
    )
}

fn wave_words(wave: DiscWave) -> String {
    format!("nodal diameter {}", wave.nodal_diameter)
}

fn title(family: &ModeFamily) -> String {
    if let Some(wave) = family.wave {
        return wave_words(wave);
    }
    let body = family.body.as_deref().unwrap_or(ASSEMBLY);
    format!("{body}, {}", family.kind.id().replace('_', " "))
}

fn curves(family: &ModeFamily) -> CampbellFamily {
    let mode = |mode: usize| {
        let point = |(rpm, f): &(f64, Option<Vec<f64>>)| Some((*rpm, *f.as_ref()?.get(mode)?));
        family.speeds.iter().filter_map(point).collect()
    };
    CampbellFamily {
        label: title(family),
        modes: (0..family.modes()).map(mode).collect(),
        dashed: family.kind == ModeKind::Stuck && family.wave.is_none(),
    }
}

/// Table with one line per speed.
fn table(family: &ModeFamily) -> String {
    let heads = (1..=family.modes()).map(|mode| format!("{mode:>12}"));
    let heads = format!("{:>10}{}\n", "speed_rpm", heads.collect::<String>());
    let line = |(rpm, frequencies): &(f64, Option<Vec<f64>>)| {
        let cells: String = match frequencies {
            Some(f) => f.iter().map(|f| format!("{f:>12.4}")).collect(),
            None => format!("{:>12}", "-").repeat(family.modes()),
        };
        format!("{rpm:>10.1}{cells}\n")
    };
    let lines: String = family.speeds.iter().map(line).collect();
    format!("{}: frequencies in Hz\n{heads}{lines}", title(family))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_and_include_their_ends() {
        let speeds = |text: &str| text.parse::<SpeedRange>().map(|s| s.values_rpm());
        assert_eq!(speeds("0:8000:5").unwrap(), [0.0, 2e3, 4e3, 6e3, 8e3]);
        assert_eq!(speeds(" 1e3 : 2e3 : 2 ").unwrap(), [1e3, 2e3]);
        assert_eq!(speeds("5000:5000:1").unwrap(), [5e3]);
        assert_eq!(speeds("0:0:1").unwrap(), [0.0]);
        assert_eq!(*speeds("0:1e6:7").unwrap().last().unwrap(), 1e6);
    }

    #[test]
    fn what_is_no_range_says_what_is() {
        for (text, says) in [
            ("5000", "FROM:TO:N"),
            ("0:5000", "FROM:TO:N"),
            ("0:fast:3", "FROM:TO:N"),
            ("0:inf:3", "FROM:TO:N"),
            ("0:5000:2.5", "FROM:TO:N"),
            ("-1:5000:3", "ascend"),
            ("5000:0:3", "ascend"),
            ("0:1e7:3", "1e7"),
            ("0:5000:1", "2 to"),
            ("0:5000:0", "2 to"),
            ("0:5000:10001", "2 to"),
        ] {
            let message = text.parse::<SpeedRange>().unwrap_err().to_string();
            assert!(message.contains(says), "{text}: {message}");
        }
    }
}
