//! What the cases came to: what summary.json of each says of its figures and its cost.

use serde::Deserialize;
use serde_json::Value;

use super::cases::Case;
use super::file::Study;
use super::folder::{self, Found, Settings};
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
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figures {
    /// Heading and value; what the run does not have is not there.
    pub values: Vec<(String, f64)>,
    pub cost: Cost,
    /// Frequencies, and how many of them did not converge.
    pub points: usize,
    pub unconverged: usize,
}

/// What a case took, without the modes with held flanks, which only the study asks for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cost {
    /// Wall clock.
    pub seconds: f64,
    /// Of all threads and of gmsh, where the system tells.
    pub processor_seconds: Option<f64>,
    /// Largest resident memory.
    pub peak_memory_mib: Option<f64>,
    /// Ids of the stages that came from the cache: their cost is not in the figures above.
    pub from_cache: Vec<String>,
}

impl Cost {
    /// By which cases are compared: processor seconds, else the wall clock.
    pub fn compared_s(&self) -> f64 {
        self.processor_seconds.unwrap_or(self.seconds)
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
    pub fn outcome(&self) -> &'static str {
        match &self.ended {
            Ended::WithFigures(f) if f.unconverged == 0 => "converged",
            Ended::WithFigures(_) => "some_unconverged",
            Ended::Failed { .. } => "failed",
            Ended::NotRun => "not_run",
        }
    }
}

/// Reads what there is of the cases.
pub fn collect(
    study: &Study,
    cases: &[Case],
    settings: &Settings,
) -> Result<Vec<CaseResult>, Error> {
    let read = |case: &Case| {
        let record = folder::record(study, case, settings)?;
        let ended = match folder::find(&record, &settings.folder(case))? {
            Found::Complete(summary) => Ended::WithFigures(summary.figures(study)),
            Found::Failed { exit_code, message } => Ended::Failed { exit_code, message },
            Found::Nothing => Ended::NotRun,
        };
        let case = case.clone();
        Ok(CaseResult { case, ended })
    };
    cases.iter().map(read).collect()
}

/// Headings of the figures of all cases, in the order of the study's quantities.
pub fn headings(study: &Study, results: &[CaseResult]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for quantity in &study.quantities {
        let figures = results.iter().filter_map(CaseResult::figures);
        for (heading, _) in figures.flat_map(|f| &f.values) {
            if quantity.has_heading(heading) && !found.contains(heading) {
                found.push(heading.clone());
            }
        }
    }
    found
}

/// summary.json of a run with a response, as far as every such run has it.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseSummary {
    run: Run,
    /// The whole of it, for the quantities.
    whole: Value,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Run {
    seconds: f64,
    processor_seconds: Option<f64>,
    stages: Vec<RunStage>,
    response: RunResponse,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct RunStage {
    id: String,
    seconds: f64,
    processor_seconds: Option<f64>,
    peak_memory_mib: Option<f64>,
    from_cache: bool,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct RunResponse {
    points: usize,
    converged_points: usize,
}

impl CaseSummary {
    /// `None`: this is no summary of a run with a response.
    pub fn of(whole: Value) -> Option<Self> {
        let run = Run::deserialize(&whole).ok()?;
        let RunResponse {
            points,
            converged_points,
        } = run.response;
        (points > 0 && converged_points <= points).then_some(Self { run, whole })
    }

    fn figures(&self, study: &Study) -> Figures {
        let Run {
            seconds,
            processor_seconds,
            stages,
            response,
        } = &self.run;
        let (held, counted): (Vec<&RunStage>, Vec<&RunStage>) =
            stages.iter().partition(|s| s.id == Stage::HeldModes.id());
        let held_s =
            |of: fn(&RunStage) -> Option<f64>| held.iter().filter_map(|s| of(s)).sum::<f64>();
        let cached = counted.iter().filter(|s| s.from_cache);
        let quantities = study.quantities.iter();
        Figures {
            values: quantities.flat_map(|q| q.figures(&self.whole)).collect(),
            cost: Cost {
                seconds: seconds - held_s(|s| Some(s.seconds)),
                processor_seconds: processor_seconds.map(|s| s - held_s(|s| s.processor_seconds)),
                peak_memory_mib: counted
                    .iter()
                    .filter_map(|s| s.peak_memory_mib)
                    .reduce(f64::max),
                from_cache: cached.map(|s| s.id.clone()).collect(),
            },
            points: response.points,
            unconverged: response.points - response.converged_points,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::tests::study;
    use crate::study::file::Mode;
    use serde_json::json;

    fn summary() -> Value {
        let stage = |id: &str, seconds: f64, mib: f64, from_cache: bool| {
            json!({ "id": id, "name": "a title", "seconds": seconds, "processor_seconds": 2.0 * seconds,
                    "peak_memory_mib": mib, "from_cache": from_cache, "unknowns": [7] })
        };
        let stages = [
            stage("reduction", 0.5, 60.0, true),
            stage("response", 2.0, 350.0, false),
            stage("held_modes", 2.5, 900.0, false),
        ];
        json!({ "seconds": 6.0, "processor_seconds": 11.0, "stages": stages, "version": "1",
                "response": { "points": 3, "converged_points": 2, "peak_amplitude_m": 0.25 } })
    }

    #[test]
    fn only_the_summary_of_a_run_with_a_response_is_one() {
        assert!(CaseSummary::of(summary()).is_some());
        assert_eq!(CaseSummary::of(json!({})), None);
        assert_eq!(CaseSummary::of(Value::Null), None);
        for (pointer, value) in [
            ("/response", Value::Null),
            ("/response", json!({})),
            ("/response/points", json!(0)),
            ("/response/converged_points", json!(4)),
            ("/seconds", Value::Null),
            ("/stages", Value::Null),
            ("/stages/0/seconds", Value::Null),
        ] {
            let mut other = summary();
            *other.pointer_mut(pointer).unwrap() = value;
            assert_eq!(CaseSummary::of(other), None, "{pointer}");
        }
    }

    #[test]
    fn the_cost_leaves_out_what_only_the_study_asked_for_and_names_what_was_cached() {
        let study = study(Mode::Grid, 0.1);
        let figures = CaseSummary::of(summary()).unwrap().figures(&study);
        assert_eq!(figures.values, [("peak_amplitude_m".to_owned(), 0.25)]);
        assert_eq!((figures.points, figures.unconverged), (3, 1));
        let expected = Cost {
            seconds: 3.5,
            processor_seconds: Some(6.0),
            peak_memory_mib: Some(350.0),
            from_cache: vec!["reduction".to_owned()],
        };
        assert_eq!(figures.cost, expected);
    }
}
