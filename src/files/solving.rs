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
