//! Response under way: what is solved of it, and the files of its flanks.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::error::RunError;
use dovetail_export::flank::FlankSeries;
use dovetail_export::folder::OutputFolder;
use dovetail_export::words::counted;
use dovetail_solver::dlft::branch::partial_response;
use dovetail_solver::dlft::{Branch, LinearPoint, Orbit, Response, SolvedFrequency};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::run::Observed;

/// Number of files of the flanks that are named in summary.json at once before they are written.
const LISTED: usize = 200;

/// Response under way.
#[derive(Debug)]
pub(super) struct Solving {
    /// Name of its table.
    pub table: String,
    pub observed: Vec<Observed>,
    pub pairs: PairTable,
    /// All requested frequencies, Hz.
    pub frequencies_hz: Vec<f64>,
    /// Solved frequencies by their numbers; the orbits have no fields.
    pub solved: BTreeMap<usize, SolvedFrequency>,
    /// Flanks of the scene's own response, if fields are written.
    pub flanks: Option<FlankSeries>,
    /// Number of the files of flanks that summary.json names, written or about to be.
    pub listed: usize,
    /// Time of the last update of the tables, and its duration.
    pub written: (Instant, Duration),
}

impl Solving {
    /// Words for the points that are solved. `follows`: a response over several frequencies is a curve that is
    /// followed, whose points are not known before.
    pub fn progress(&self, follows: bool) -> String {
        let (solved, all) = (self.solved.len(), self.frequencies_hz.len());
        let mut points = self.solved.values();
        let is_curve = points.any(|point| point.along.is_some());
        if is_curve || solved == 0 && follows && all > 1 {
            let points = counted(solved, "point", "points");
            return format!("{points} of the curve of {}", self.table);
        }
        format!("{solved} of {all} frequencies of {}", self.table)
    }

    /// Solved part of the response, for tables.
    pub fn partial(&self) -> Response {
        let mut solved: Vec<SolvedFrequency> = self.solved.values().cloned().collect();
        if solved.iter().any(|solved| solved.along.is_some()) {
            return partial_response(solved);
        }
        let frequency_hz = |solved: &SolvedFrequency| solved.orbit.frequency_hz;
        solved.sort_by(|a, b| frequency_hz(a).total_cmp(&frequency_hz(b)));
        let solved = solved.into_iter().map(|s| (s.orbit, s.linear));
        let (orbits, linear): (Vec<Orbit>, Vec<LinearPoint>) = solved.unzip();
        Response {
            branches: vec![Branch::swept(orbits.len())],
            orbits,
            linear,
            ..Response::default()
        }
    }

    /// Frequencies between which none was tried yet, Hz; `None` once the range is covered.
    pub fn untried_hz(&self) -> Option<[f64; 2]> {
        untried_hz(&self.frequencies_hz, &self.solved)
    }

    /// Adds a frequency, and writes its file of the flanks.
    pub fn add(&mut self, out: &OutputFolder, solved: &SolvedFrequency) -> Result<(), RunError> {
        let orbit = &solved.orbit;
        self.solved.insert(orbit.point, strip_fields(solved));
        if let Some(flanks) = &mut self.flanks {
            if orbit.point >= self.listed {
                let from = self.listed;
                self.listed = orbit.point + LISTED;
                out.list((from..self.listed).map(FlankSeries::file))?;
            }
            flanks.write(out.path(), orbit)?;
        }
        Ok(())
    }
}

/// Solved frequencies between which none was tried yet, Hz.
fn untried_hz(
    frequencies_hz: &[f64],
    solved: &BTreeMap<usize, SolvedFrequency>,
) -> Option<[f64; 2]> {
    let [first, last] = [frequencies_hz.first()?, frequencies_hz.last()?];
    let of_branch = |wanted: bool| {
        let points = solved.values();
        let points = points.filter_map(|s| Some((s.along.as_ref()?.from_last, s)));
        let own = points.filter(move |(from_last, _)| *from_last == wanted);
        own.map(|(_, s)| s.orbit.frequency_hz)
    };
    if solved.values().any(|s| s.along.is_some()) {
        let from = of_branch(false).fold(*first, f64::max);
        let to = of_branch(true).fold(*last, f64::min);
        return (from < to).then_some([from, to]);
    }
    let is_untried = |point: &usize| !solved.contains_key(point);
    let mut untried = (0..frequencies_hz.len()).filter(is_untried);
    let from = untried.next()?;
    let to = untried.next_back().unwrap_or(from);
    let before = from.checked_sub(1).and_then(|i| frequencies_hz.get(i));
    let after = frequencies_hz.get(to + 1);
    Some([*before.unwrap_or(first), *after.unwrap_or(last)])
}

/// A solved frequency for tables.
pub(super) fn strip_fields(solved: &SolvedFrequency) -> SolvedFrequency {
    let orbit = Orbit {
        x: Vec::new(),
        lambda: Vec::new(),
        modal: Vec::new(),
        ..solved.orbit.clone()
    };
    SolvedFrequency {
        orbit,
        linear: solved.linear.clone(),
        along: solved.along.clone(),
        ..*solved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_solver::dlft::{BranchPosition, Outcome, Part};

    /// Response over 10 to 60 Hz with these numbers of frequencies and places along the two branches.
    fn untried(points: &[(usize, f64, Option<bool>)]) -> Option<[f64; 2]> {
        let solved = |(point, frequency_hz, from_last): &(usize, f64, Option<bool>)| {
            let mut orbit = Orbit::motionless(*frequency_hz, Outcome::Converged);
            orbit.point = *point;
            let mut solved = SolvedFrequency::isolated(orbit);
            solved.along = from_last.map(|from_last| BranchPosition {
                from_last,
                step: 0,
                part: Part::Reached,
                abscissa: *frequency_hz,
                length: 0.0,
                heading: None,
            });
            (*point, solved)
        };
        let frequencies_hz = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0];
        untried_hz(&frequencies_hz, &points.iter().map(solved).collect())
    }

    #[test]
    fn what_was_not_tried_lies_between_the_halves_of_a_response() {
        let grid = |points: &[usize]| {
            let points = points.iter().map(|i| (*i, 10.0 * (*i + 1) as f64, None));
            untried(&points.collect::<Vec<_>>())
        };
        assert_eq!(grid(&[]), Some([10.0, 60.0]));
        assert_eq!(grid(&[0, 1]), Some([20.0, 60.0]));
        assert_eq!(grid(&[0, 1, 5]), Some([20.0, 60.0]));
        assert_eq!(grid(&[0, 1, 4, 5]), Some([20.0, 50.0]));
        assert_eq!(grid(&[0, 1, 2, 3, 4, 5]), None);
        let [rising, falling] = [Some(false), Some(true)];
        assert_eq!(untried(&[(0, 25.0, rising)]), Some([25.0, 60.0]));
        let both = [(0, 10.0, rising), (1, 60.0, falling), (2, 34.0, rising)];
        assert_eq!(untried(&both), Some([34.0, 60.0]));
        let joined = [(0, 35.0, rising), (1, 35.0, falling)];
        assert_eq!(untried(&joined), None);
    }
}
