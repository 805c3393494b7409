//! Motions that a search keeps, from which an interrupted search goes on, and the table that it leaves.

use super::RunFiles;
use super::curve::{CURVE, CurveUnderWay};
use super::peaks::{PEAKS, PeaksFound};
use crate::error::RunError;
use dovetail_export::ExportError;
use dovetail_export::csv::write_peaks;
use dovetail_export::folder::{OutputFolder, check_journal};
use dovetail_export::journal::{CURVE_JOURNAL, Inputs, Journal, PEAKS_JOURNAL, WEAR_JOURNAL};
use dovetail_export::words::counted;
use dovetail_solver::dlft::SolvedFrequency;
use dovetail_solver::run::{PeakAt, ReducedScene};

/// Search under way, with the journal of its motions.
#[derive(Debug)]
pub(super) struct SearchFiles {
    pub journal: Journal,
    pub sought: Sought,
}

/// What a search looks for, with what it has found so far.
#[derive(Debug)]
pub enum Sought {
    /// Peaks over the values of one key, or two.
    Peaks(PeaksFound),
    /// Motions at one frequency over the values of a key.
    Curve(CurveUnderWay),
    /// Vibrations that wear the contacts.
    Vibrations,
}

impl Sought {
    /// Name of the journal, one motion in words, several ones, and what was done to them.
    fn words(&self) -> [&'static str; 4] {
        match self {
            Self::Peaks(_) => [PEAKS_JOURNAL, "peak", "peaks", "found"],
            Self::Curve(_) => [CURVE_JOURNAL, "motion", "motions", "solved"],
            Self::Vibrations => [WEAR_JOURNAL, "vibration", "vibrations", "found"],
        }
    }
}

impl SearchFiles {
    /// Keeps a motion. It is on disk when this returns.
    pub fn keep(&mut self, inputs: &Inputs, motion: &SolvedFrequency) -> Result<(), RunError> {
        self.journal.append(inputs, motion)?;
        self.journal.sync()?;
        if let Sought::Curve(curve) = &mut self.sought {
            curve.add(motion);
        }
        Ok(())
    }

    /// Words for a search that is ended by `signal`.
    pub fn ending_text(&self, signal: &str) -> String {
        let [_, one, several, _] = self.sought.words();
        match self.journal.count() {
            0 => format!("{signal} before the first of its {several}"),
            count => format!("{signal} after {}", counted(count, one, several)),
        }
    }

    /// Writes the table of a search that is interrupted, and returns words for it. That of peaks is
    /// written with each of them.
    pub fn write(&self, out: &OutputFolder) -> Result<String, ExportError> {
        let table = match &self.sought {
            Sought::Peaks(_) => PEAKS,
            Sought::Curve(curve) if curve.write(out)? => CURVE,
            Sought::Curve(_) | Sought::Vibrations => return Ok(String::new()),
        };
        let folder = out.path().display();
        Ok(format!("; {folder} has a table of those found, {table}"))
    }
}

impl RunFiles {
    /// Begins a search. Returns a note of the motions that are not solved for again, of which there are
    /// none unless an interrupted search is to be resumed.
    ///
    /// # Errors
    /// The file is not a journal, or cannot be written.
    pub fn begin_search(
        &mut self,
        sought: Sought,
        resume: bool,
    ) -> Result<Option<String>, RunError> {
        let [file, _, several, done] = sought.words();
        let mut journal = Journal::open(&self.folder.out.file(file)?)?;
        if !resume {
            journal.clear()?;
        } else if !journal.is_empty() {
            let path = self.folder.out.path().join(file);
            check_journal(&self.figures.summary, &path)?;
        }
        let before = journal.count();
        self.search = Some(SearchFiles { journal, sought });
        Ok((before > 0).then(|| format!("{before} {several} were {done} before")))
    }

    /// Begins the line of peaks at a value of the second key, if there is one.
    pub fn begin_line_of_peaks(&mut self, also: Option<f64>) {
        if let Some(Sought::Peaks(found)) = self.search.as_mut().map(|search| &mut search.sought) {
            found.also = also;
        }
    }

    /// Adds a peak to the table of a search for peaks.
    pub(super) fn peak_found(
        &mut self,
        reduced: &ReducedScene,
        observation: usize,
        peak: &PeakAt,
    ) -> Result<(), RunError> {
        let sought = self.search.as_mut().map(|search| &mut search.sought);
        let Some(Sought::Peaks(found)) = sought else {
            return Ok(());
        };
        found.add(&reduced.pairs, observation, peak);
        let keys: Vec<&str> = found.keys.iter().map(String::as_str).collect();
        let path = self.folder.out.file(PEAKS)?;
        Ok(write_peaks(&path, &keys, &found.rows())?)
    }
}
