//! Results of the cases: the figures and the cost from the summary.json of each.

use std::path::Path;

use super::cases::Case;
use super::folder::{CaseRecord, OutcomeRecord, StudyPlan};
use crate::exit::ExitStatus;
use crate::study_file::Study;
use crate::study_file::StudyError;
use crate::study_file::quantity::Figure;
use dovetail_export::manifest::{ResponseSummary, RunState, Summary};
use dovetail_export::read_json;
use dovetail_solver::run::Stage;

/// A case and its result.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseResult {
    pub case: Case,
    pub ended: CaseEnd,
}

#[derive(Debug, Clone, PartialEq)]
pub enum CaseEnd {
    WithFigures(Box<CaseFigures>),
    Failed {
        exit_code: Option<i32>,
        message: String,
    },
    /// No run to the end with the present request.
    NotRun,
}

/// Figures of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CaseFigures {
    /// Figures and their values; figures that the run does not have are left out.
    pub values: Vec<(Figure, f64)>,
    pub response: ResponseSummary,
    /// Wall time of the case, s, without the modes with held flanks, which only the study requests.
    pub seconds: f64,
    /// Processor time of all threads and of gmsh, s, without the modes with held flanks; `None` if
    /// the system does not provide it.
    pub processor_seconds: Option<f64>,
    /// Largest resident memory, MiB.
    pub peak_memory_mib: Option<f64>,
    /// Stages taken from the cache: their cost is not in the figures above.
    pub from_cache: Vec<Stage>,
    /// Day of the run in universal time: `2004-02-29`.
    pub day: String,
}

impl CaseFigures {
    /// Number of frequencies that did not converge.
    pub fn unconverged(&self) -> usize {
        let response = &self.response;
        response.points.saturating_sub(response.converged_points)
    }
}

impl CaseResult {
    pub fn figures(&self) -> Option<&CaseFigures> {
        match &self.ended {
            CaseEnd::WithFigures(figures) => Some(figures),
            _ => None,
        }
    }

    pub fn value(&self, heading: &str) -> Option<f64> {
        let mut values = self.figures()?.values.iter();
        values.find(|(f, _)| f.heading == heading).map(|(_, v)| *v)
    }

    /// Word for the outcome in tables.
    pub fn outcome(&self) -> &'static str {
        match &self.ended {
            CaseEnd::WithFigures(f) if f.unconverged() == 0 => "converged",
            CaseEnd::WithFigures(_) => "some_unconverged",
            CaseEnd::Failed { .. } => "failed",
            CaseEnd::NotRun => "not_run",
        }
    }
}

impl StudyPlan {
    /// Results of the cases.
    ///
    /// # Errors
    /// As for [`StudyPlan::record`].
    pub fn results(&self) -> Result<Vec<CaseResult>, StudyError> {
        let result = |case: &Case| {
            let ended = self.ended(case, &self.record(case)?);
            let case = case.clone();
            Ok(CaseResult { case, ended })
        };
        self.cases.iter().map(result).collect()
    }

    /// Reads the folder of a case. It has a result if its program ended with one (exit code 0 or 3)
    /// and case.json has the present request: the same program, overrides and input files, byte for
    /// byte.
    pub fn ended(&self, case: &Case, record: &CaseRecord) -> CaseEnd {
        let folder = self.folder(case);
        let outcome: Option<OutcomeRecord> = read_json(&folder.join("outcome.json"));
        let outcome = outcome.filter(|_| record.read_answered(&folder).is_some());
        match outcome.map(|outcome| outcome.exit_code) {
            None => CaseEnd::NotRun,
            Some(exit_code) if !ExitStatus::has_results(exit_code) => CaseEnd::Failed {
                exit_code,
                message: failure_reason(&folder),
            },
            Some(_) => {
                let summary: Option<Summary> = read_json(&folder.join("summary.json"));
                let figures = summary.and_then(|summary| run_figures(&self.study, &summary));
                figures.map_or(CaseEnd::NotRun, |f| CaseEnd::WithFigures(Box::new(f)))
            }
        }
    }
}

/// Reason why the case in a folder failed: that of its summary.json, else the last line of its log.
fn failure_reason(folder: &Path) -> String {
    let summary: Option<Summary> = read_json(&folder.join("summary.json"));
    let why = summary.filter(|s| s.state == RunState::Failed);
    why.and_then(|s| s.why).unwrap_or_else(|| {
        let log = std::fs::read_to_string(folder.join("log.txt")).unwrap_or_default();
        let last = log.lines().rfind(|line| !line.trim().is_empty());
        last.unwrap_or("nothing was logged").trim().to_owned()
    })
}

/// Figures of a run; `None` if it has no response.
fn run_figures(study: &Study, summary: &Summary) -> Option<CaseFigures> {
    let quantities = study.quantities.iter();
    let values = quantities.flat_map(|q| q.figures(summary)).collect();
    let response = summary.response.clone()?;
    let stages = summary.stages.iter();
    let (held, counted): (Vec<_>, Vec<_>) = stages.partition(|s| s.id == Stage::HeldModes);
    let held_s: f64 = held.iter().map(|s| s.seconds).sum();
    let held_processor_s: f64 = held.iter().filter_map(|s| s.processor_seconds).sum();
    let memory = counted.iter().filter_map(|s| s.peak_memory_mib);
    let cached = counted.iter().filter(|s| s.from_cache);
    Some(CaseFigures {
        values,
        response,
        seconds: summary.seconds - held_s,
        processor_seconds: summary.processor_seconds.map(|s| s - held_processor_s),
        peak_memory_mib: memory.reduce(f64::max),
        from_cache: cached.map(|s| s.id).collect(),
        day: summary.begun.split('T').next().unwrap_or("").to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::tests::study;
    use crate::study_file::keys::CombinationMode;
    use dovetail_export::manifest::{ObservedPeak, StageSummary};
    use dovetail_export::write_json;

    #[test]
    fn why_a_case_failed_is_what_its_summary_says_else_the_end_of_its_log() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(failure_reason(folder.path()), "nothing was logged");
        std::fs::write(folder.path().join("log.txt"), "  mesh 1.0 s\nKilled\n\n").unwrap();
        assert_eq!(failure_reason(folder.path()), "Killed");
        let mut summary = Summary {
            why: Some("meshing failed: gmsh was stopped".into()),
            ..Summary::default()
        };
        let path = folder.path().join("summary.json");
        write_json(&path, &summary).unwrap();
        assert_eq!(failure_reason(folder.path()), "Killed");
        summary.state = RunState::Failed;
        write_json(&path, &summary).unwrap();
        assert_eq!(
            failure_reason(folder.path()),
            "meshing failed: gmsh was stopped"
        );
    }

    #[test]
    fn the_cost_leaves_out_what_only_the_study_asked_for_and_names_what_was_cached() {
        let stage = |id: Stage, seconds: f64, mib: f64, from_cache: bool| StageSummary {
            id,
            name: "a title".into(),
            seconds,
            processor_seconds: Some(2.0 * seconds),
            peak_memory_mib: Some(mib),
            from_cache,
            unknowns: vec![7],
        };
        let mut summary = Summary {
            seconds: 6.0,
            begun: "2004-02-29T23:59:59Z".into(),
            processor_seconds: Some(11.0),
            stages: vec![
                stage(Stage::Reduction, 0.5, 60.0, true),
                stage(Stage::Response, 2.0, 350.0, false),
                stage(Stage::HeldModes, 2.5, 900.0, false),
            ],
            ..Summary::default()
        };
        let study = study(CombinationMode::Grid);
        assert_eq!(run_figures(&study, &summary), None);
        summary.response = Some(ResponseSummary {
            points: 3,
            converged_points: 2,
            first: ObservedPeak {
                peak_amplitude_m: Some(0.25),
                peak_at_end_of_range: true,
                ..ObservedPeak::default()
            },
            ..ResponseSummary::default()
        });
        let figures = run_figures(&study, &summary).unwrap();
        let (figure, value) = &figures.values[0];
        assert_eq!(
            (figure.heading.as_str(), *value),
            ("peak_amplitude_m", 0.25)
        );
        assert_eq!(figures.day, "2004-02-29");
        assert_eq!((figures.response.points, figures.unconverged()), (3, 1));
        assert_eq!(
            (figures.seconds, figures.processor_seconds),
            (3.5, Some(6.0))
        );
        assert_eq!(figures.peak_memory_mib, Some(350.0));
        assert_eq!(figures.from_cache, [Stage::Reduction]);
    }
}
