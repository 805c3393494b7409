//! Tables of a response under way, which an interrupted run leaves, and tables of the whole response.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::RunFiles;
use super::solving::Solving;
use crate::error::RunError;
use crate::mesh_study;
use dovetail_export::curves::Sweep;
use dovetail_export::flank::FlankSeries;
use dovetail_export::folder::Beginning;
use dovetail_export::journal::{Inputs, JOURNAL, Journal};
use dovetail_export::manifest::{self, Checks, ResponseSummary, RunState, TractionCheck};
use dovetail_export::words::shell_word;
use dovetail_export::{ExportError, csv};
use dovetail_solver::dlft::SolvedFrequency;
use dovetail_solver::run::{ReducedScene, ResponseResult};

/// Least time between two updates of the tables of a response under way.
const INTERVAL: Duration = Duration::from_secs(5);
/// Least time between two updates as a multiple of the duration of the last one, which limits the
/// share of the time spent on updates.
const SHARE: u32 = 20;
/// File name of the collection of the flanks at each frequency.
const FLANKS: &str = "flank.pvd";
/// File name of the table of the cycles of the pairs.
const CONTACT: &str = "contact.csv";

/// Responses that have begun, the scene's own first, with the journal of their frequencies.
#[derive(Debug)]
pub(super) struct RunningResponses {
    pub journal: Journal,
    pub solving: Vec<Solving>,
}

impl RunFiles {
    pub(super) fn response_begins(
        &mut self,
        reduced: &ReducedScene,
        frequencies_hz: &[f64],
        compared_harmonics: Option<usize>,
    ) {
        let is_own = compared_harmonics.is_none();
        let bodies = reduced.bodies.as_ref();
        let bodies = bodies.filter(|_| is_own && self.asked.fields);
        self.responses.solving.push(Solving {
            table: table_of(compared_harmonics),
            observed: reduced.observations(),
            pairs: reduced.pairs.clone(),
            frequencies_hz: frequencies_hz.to_vec(),
            solved: BTreeMap::new(),
            flanks: bodies.map(|bodies| FlankSeries::new(bodies.model())),
            listed: 0,
            written: (Instant::now(), Duration::ZERO),
        });
    }

    /// Frequencies of the last response begun that were solved before it was interrupted.
    pub(super) fn earlier_frequencies(
        &mut self,
        inputs: &Inputs,
    ) -> Result<Vec<SolvedFrequency>, RunError> {
        let RunningResponses { journal, solving } = &mut self.responses;
        let is_own = solving.len() == 1;
        if is_own && self.folder.beginning == Beginning::Anew {
            journal.clear()?;
        }
        let earlier = journal.solved(inputs)?;
        if is_own && earlier.is_empty() && !journal.is_empty() {
            let path = self.folder.out.path().join(JOURNAL);
            return Err(ExportError::OtherInputs { path }.into());
        }
        self.write_summary(RunState::Running, None)?;
        Ok(earlier)
    }

    /// Keeps a frequency of the last response begun.
    pub(super) fn frequency(
        &mut self,
        inputs: &Inputs,
        solved: &SolvedFrequency,
    ) -> Result<(), RunError> {
        let RunningResponses { journal, solving } = &mut self.responses;
        let Some(solving) = solving.last_mut() else {
            return Ok(());
        };
        journal.append(inputs, solved)?;
        solving.add(&self.folder.out, solved)?;
        let (last, took) = solving.written;
        if last.elapsed() > INTERVAL.max(SHARE * took) {
            let begin = Instant::now();
            self.write_tables()?;
            self.write_summary(RunState::Running, None)?;
            if let Some(solving) = self.responses.solving.last_mut() {
                solving.written = (Instant::now(), begin.elapsed());
            }
        }
        Ok(())
    }

    /// Writes the tables of the responses under way, and all that is needed to resume.
    fn write_tables(&self) -> Result<(), RunError> {
        let (out, along) = (&self.folder.out, self.scene.response.along_engine_order);
        for solving in &self.responses.solving {
            let partial = solving.partial();
            let path = out.file(&solving.table)?;
            csv::write_response(&path, &solving.observed, &partial, along)?;
            if let Some(flanks) = &solving.flanks {
                flanks.write_collection(&out.file(FLANKS)?, &partial.orbits)?;
            }
        }
        Ok(self.responses.journal.sync()?)
    }

    /// Writes what is solved of the responses under way, and returns words for it; `None` if none has
    /// begun.
    pub(super) fn leave_response(&mut self) -> Result<Option<String>, RunError> {
        let [own, ..] = &self.responses.solving[..] else {
            return Ok(None);
        };
        let last = self.responses.solving.last().unwrap_or(own);
        let progress = last.progress(self.scene.response.points.is_none());
        let (partial, pairs) = (own.partial(), &own.pairs);
        csv::write_contact(&self.folder.out.file(CONTACT)?, pairs, &partial)?;
        let first = own.observed.first().map(|first| first.name.as_str());
        let along = self.scene.response.along_engine_order;
        let summary = manifest::response_summary(pairs, first, &partial, along, &[]);
        let summary = match own.untried_hz() {
            Some(untried_hz) => summary.without_peaks(untried_hz),
            None => summary,
        };
        self.figures.summary.response = Some(summary);
        self.write_tables()?;
        Ok(Some(progress))
    }

    pub(super) fn response(
        &mut self,
        reduced: &ReducedScene,
        found: &ResponseResult,
    ) -> Result<(), RunError> {
        let response = &found.response;
        let observed = reduced.observations();
        let first = observed.first().map(|first| first.name.as_str());
        let along = self.scene.response.along_engine_order;
        let summary = &mut self.figures.summary;
        summary.response = Some(ResponseSummary {
            traction_range: found.tractions.as_ref().and_then(manifest::traction_range),
            ..manifest::response_summary(&reduced.pairs, first, response, along, &found.departures)
        });
        if let Some(truncation) = &mut summary.truncation {
            truncation.modes_reach = found.modes_reach;
        }
        self.figures.summary.checks = self.checks(reduced);
        let out = &self.folder.out;
        csv::write_response(&out.file(&table_of(None))?, &observed, response, along)?;
        if let Some(compared) = &found.compared {
            let file = table_of(Some(compared.harmonics));
            csv::write_response(&out.file(&file)?, &observed, &compared.response, along)?;
        }
        csv::write_contact(&out.file(CONTACT)?, &reduced.pairs, response)?;
        if let Some(range) = &found.tractions {
            csv::write_tractions(&out.file("tractions.csv")?, range)?;
        }
        self.write_curves(&observed, &sweep(found))?;
        let solving = self.responses.solving.first_mut();
        if let Some(flanks) = solving.and_then(|solving| solving.flanks.as_mut()) {
            flanks.remove_others(out.path(), &response.orbits)?;
            flanks.write_collection(&out.file(FLANKS)?, &response.orbits)?;
        }
        if let Some(bodies) = found.bodies_at_peak(reduced.bodies.as_ref()) {
            self.write_response_on_mesh(bodies, &reduced.problem, found)?;
        }
        Ok(())
    }
}

impl RunFiles {
    /// Checks of the peak that need further runs; `None` without a peak or without pairs.
    fn checks(&self, reduced: &ReducedScene) -> Option<Checks> {
        let summary = &self.figures.summary;
        let response = summary.response.as_ref()?;
        let has_peak = response.first.peak_amplitude_m.is_some();
        if summary.pairs == 0 || !has_peak {
            return None;
        }
        let command = || {
            let overrides = self.asked.overrides.iter().map(String::as_str);
            let set = overrides.chain([OTHER_TRACTIONS]);
            let set: String = set
                .map(|set| format!(" --set {}", shell_word(set)))
                .collect();
            let file = shell_word(&summary.scene.file);
            let name = &summary.scene.name;
            format!("dovetail run {file}{set} --out output/{name}_tractions")
        };
        let has_friction = reduced.problem.laws.iter().any(|law| law.friction > 0.0);
        let one_speed = response.engine_order.is_none();
        let range = response.traction_range.as_ref();
        Some(Checks {
            residual_tractions: has_friction
                .then(|| TractionCheck::new(range, one_speed.then(command))),
            flank_mesh: mesh_study::check(summary, &self.asked.scene_file, self.folder.out.path()),
        })
    }
}

/// Setting with which a run looks for the range over starting tractions.
const OTHER_TRACTIONS: &str = "static.starting_tractions=2";

/// Name of the table of a response.
fn table_of(compared_harmonics: Option<usize>) -> String {
    match compared_harmonics {
        None => "response.csv".to_owned(),
        Some(harmonics) => format!("response_h{harmonics}.csv"),
    }
}

/// Response of a result and the one that it is compared with.
pub(super) fn sweep(found: &ResponseResult) -> Sweep<'_> {
    Sweep {
        response: &found.response,
        compared: found.compared.as_ref().map(|compared| &compared.response),
        along: found.run_up.as_ref().map(|run_up| run_up.engine_order),
        tractions: found.tractions.as_ref(),
    }
}
