//! What the folders of the cases hold, as one table.

use super::cases::Case;
use super::file::Study;
use super::folder::{self, Found, Settings};
use super::spent::{Spent, shared_settings, spent};
use super::summary::{CaseSummary, StageTimes};
use crate::error::Error;
use crate::stage::Stage;

/// A case and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseResult {
    pub case: Case,
    pub ended: Ended,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    WithFigures(Figures),
    Failed {
        exit_code: Option<i32>,
        message: String,
    },
    NotRun,
}

/// The figures of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// Heading and value; what the run does not have is not there.
    pub values: Vec<(String, f64)>,
    pub spent: Spent,
    pub threads: Option<u16>,
    /// Frequencies, and how many of them did not converge.
    pub points: usize,
    pub unconverged: usize,
}

impl Figures {
    /// What the run costs, apart for all up to the reduced model and for the contact solve, s: on one thread the time of the
    /// processor, which is that of a free core whatever else the machine does; on several the wall clock.
    pub fn cost(&self) -> [f64; 2] {
        let spent = &self.spent;
        let on_processors = spent.processor_seconds.zip(spent.contact_processor_seconds);
        let (whole, contact) = match on_processors.filter(|_| self.threads == Some(1)) {
            Some(both) => both,
            None => (spent.seconds, spent.contact_seconds),
        };
        [(whole - contact).max(0.0), contact]
    }

    /// The whole of it.
    pub fn cost_seconds(&self) -> f64 {
        self.cost().iter().sum()
    }
}

impl CaseResult {
    pub fn figures(&self) -> Option<&Figures> {
        match &self.ended {
            Ended::WithFigures(figures) => Some(figures),
            _ => None,
        }
    }

    pub fn value(&self, heading: &str) -> Option<f64> {
        let values = &self.figures()?.values;
        values.iter().find(|(h, _)| h == heading).map(|(_, v)| *v)
    }

    /// A word for tables.
    pub fn outcome(&self) -> String {
        match &self.ended {
            Ended::WithFigures(f) if f.unconverged == 0 => "converged".to_owned(),
            Ended::WithFigures(f) => format!("{} of {} unconverged", f.unconverged, f.points),
            Ended::Failed {
                exit_code: Some(code),
                ..
            } => format!("failed ({code})"),
            Ended::Failed {
                exit_code: None, ..
            } => "ended by a signal".to_owned(),
            Ended::NotRun => "not run".to_owned(),
        }
    }
}

/// Reads what there is of the cases.
pub fn collect(
    study: &Study,
    cases: &[Case],
    settings: &Settings,
) -> Result<Vec<CaseResult>, Error> {
    let mut found = Vec::new();
    for case in cases {
        let record = folder::record(study, case, settings)?;
        let in_folder = folder::find(&record, &settings.folder(case))?;
        found.push((record, in_folder));
    }
    let ended = found.iter().map(|(record, in_folder)| match in_folder {
        Found::Complete { summary, threads } => {
            let made = |stage: Stage| {
                let shared = shared_settings(record, stage);
                let alike = found
                    .iter()
                    .filter(|(r, _)| shared_settings(r, stage) == shared);
                let mut stages = alike.flat_map(|(_, found)| stages_of(found));
                stages.find(|s| s.stage == stage && !s.from_cache)
            };
            Ended::WithFigures(figures(study, summary, spent(summary, made), *threads))
        }
        Found::Failed { exit_code, message } => Ended::Failed {
            exit_code: *exit_code,
            message: message.clone(),
        },
        Found::Nothing => Ended::NotRun,
    });
    Ok(cases
        .iter()
        .zip(ended)
        .map(|(case, ended)| CaseResult {
            case: case.clone(),
            ended,
        })
        .collect())
}

fn stages_of(found: &Found) -> &[StageTimes] {
    match found {
        Found::Complete { summary, .. } => &summary.stages,
        _ => &[],
    }
}

/// Headings of the figures of all cases, in the order of the study's quantities.
pub fn headings(study: &Study, results: &[CaseResult]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for quantity in &study.quantities {
        for (heading, _) in results
            .iter()
            .filter_map(CaseResult::figures)
            .flat_map(|f| &f.values)
        {
            let own = super::quantity::Quantity::of_heading(heading) == Some(*quantity);
            if own && !found.contains(heading) {
                found.push(heading.clone());
            }
        }
    }
    found
}

fn figures(study: &Study, summary: &CaseSummary, spent: Spent, threads: Option<u16>) -> Figures {
    Figures {
        values: study
            .quantities
            .iter()
            .flat_map(|q| q.figures(&summary.whole))
            .collect(),
        spent,
        threads,
        points: summary.points,
        unconverged: summary.points - summary.converged_points,
    }
}
