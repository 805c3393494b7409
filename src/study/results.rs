//! Results of the cases: the figures and the cost from the summary.json of each.

use super::cases::Case;
use super::error::StudyError;
use super::file::Study;
use super::folder::{self, Found, Settings};
use super::quantity::Figure;
use crate::export::manifest::{StageSummary, Summary};
use dovetail_solver::run::Stage;

/// A case and its result.
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

/// Figures of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// Figures and their values; figures that the run does not have are left out.
    pub values: Vec<(Figure, f64)>,
    /// Name of the observed displacement of the peak.
    pub observation: Option<String>,
    /// Wall time of the case, s, without the modes with held flanks, which only the study requests.
    pub seconds: f64,
    /// Processor time of all threads and of gmsh, s, without the modes with held flanks; `None` if
    /// the system does not provide it.
    pub processor_seconds: Option<f64>,
    /// Largest resident memory, MiB.
    pub peak_memory_mib: Option<f64>,
    /// Stages taken from the cache: their cost is not in the figures above.
    pub from_cache: Vec<Stage>,
    /// True if the largest amplitude is at an end of the frequencies: it may be higher outside.
    pub peak_at_end_of_range: bool,
    /// Number of frequencies.
    pub points: usize,
    /// Number of frequencies that did not converge.
    pub unconverged: usize,
    /// Day of the run in universal time: `2004-02-29`.
    pub day: String,
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
        values
            .iter()
            .find(|(f, _)| f.heading == heading)
            .map(|(_, v)| *v)
    }

    /// Returns `true` if the peak may lie outside the frequencies.
    pub fn peak_at_end_of_range(&self) -> bool {
        self.figures().is_some_and(|f| f.peak_at_end_of_range)
    }

    /// Word for the outcome in tables.
    pub fn outcome(&self) -> &'static str {
        match &self.ended {
            Ended::WithFigures(f) if f.unconverged == 0 => "converged",
            Ended::WithFigures(_) => "some_unconverged",
            Ended::Failed { .. } => "failed",
            Ended::NotRun => "not_run",
        }
    }
}

/// Reads the results of the cases.
pub fn collect(
    study: &Study,
    cases: &[Case],
    settings: &Settings,
) -> Result<Vec<CaseResult>, StudyError> {
    let read = |case: &Case| {
        let record = folder::record(study, case, settings)?;
        let ended = match folder::find(&record, &settings.folder(case))? {
            Found::Complete(summary) => {
                of_run(study, &summary).map_or(Ended::NotRun, Ended::WithFigures)
            }
            Found::Failed { exit_code, message } => Ended::Failed { exit_code, message },
            Found::Nothing => Ended::NotRun,
        };
        let case = case.clone();
        Ok(CaseResult { case, ended })
    };
    cases.iter().map(read).collect()
}

/// Figures of the cases, in the order of the quantities of the study.
pub fn figures(study: &Study, results: &[CaseResult]) -> Vec<Figure> {
    let mut found: Vec<Figure> = Vec::new();
    for quantity in &study.quantities {
        let values = results.iter().filter_map(CaseResult::figures);
        for (figure, _) in values.flat_map(|f| &f.values) {
            let is_known = found.iter().any(|known| known.heading == figure.heading);
            if figure.quantity == *quantity && !is_known {
                found.push(figure.clone());
            }
        }
    }
    found
}

/// Figures of a run; `None` if it has no response.
fn of_run(study: &Study, summary: &Summary) -> Option<Figures> {
    let response = summary.response.as_ref()?;
    let (held, counted): (Vec<&StageSummary>, Vec<&StageSummary>) = summary
        .stages
        .iter()
        .partition(|s| s.id == Stage::HeldModes);
    let held_s: f64 = held.iter().map(|s| s.seconds).sum();
    let held_processor_s: f64 = held.iter().filter_map(|s| s.processor_seconds).sum();
    let memory = counted.iter().filter_map(|s| s.peak_memory_mib);
    let cached = counted.iter().filter(|s| s.from_cache);
    let quantities = study.quantities.iter();
    Some(Figures {
        values: quantities.flat_map(|q| q.figures(summary)).collect(),
        observation: response.observation.clone(),
        seconds: summary.seconds - held_s,
        processor_seconds: summary.processor_seconds.map(|s| s - held_processor_s),
        peak_memory_mib: memory.reduce(f64::max),
        from_cache: cached.map(|s| s.id).collect(),
        peak_at_end_of_range: response.peak_at_end_of_range,
        points: response.points,
        unconverged: response.points.saturating_sub(response.converged_points),
        day: summary.begun.split('T').next().unwrap_or("").to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::manifest::ResponseSummary;
    use crate::study::analysis::tests::study;
    use crate::study::file::Mode;

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
        let study = study(Mode::Grid);
        assert_eq!(of_run(&study, &summary), None);
        summary.response = Some(ResponseSummary {
            points: 3,
            converged_points: 2,
            peak_amplitude_m: Some(0.25),
            peak_at_end_of_range: true,
            ..ResponseSummary::default()
        });
        let figures = of_run(&study, &summary).unwrap();
        let (figure, value) = &figures.values[0];
        assert_eq!(
            (figure.heading.as_str(), *value),
            ("peak_amplitude_m", 0.25)
        );
        assert_eq!(figures.day, "2004-02-29");
        assert_eq!((figures.points, figures.unconverged), (3, 1));
        assert!(figures.peak_at_end_of_range);
        assert_eq!(
            (figures.seconds, figures.processor_seconds),
            (3.5, Some(6.0))
        );
        assert_eq!(figures.peak_memory_mib, Some(350.0));
        assert_eq!(figures.from_cache, [Stage::Reduction]);
    }
}
