//! What the folders of the cases hold, as one table.

use serde_json::Value;

use super::cases::Case;
use super::file::Study;
use super::folder::{self, Found, Settings};
use crate::error::Error;
use crate::progress::HELD_MODES_STAGE;

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
    /// Wall clock, without what only the study asked for, s.
    pub seconds: f64,
    /// Of the static state and the response.
    pub contact_seconds: f64,
    /// The same two on the processors, all threads.
    pub processor_seconds: Option<f64>,
    pub contact_processor_seconds: Option<f64>,
    /// Largest resident memory, MiB.
    pub peak_memory_mib: Option<f64>,
    pub threads: Option<u16>,
    /// Frequencies, and how many of them did not converge.
    pub points: usize,
    pub unconverged: usize,
}

impl Figures {
    /// What the run costs, apart for all up to the reduced model and for the contact solve, s: on one thread the time of the
    /// processor, which is that of a free core whatever else the machine does; on several the wall clock.
    pub fn cost(&self) -> [f64; 2] {
        let (whole, contact) = match (
            self.threads,
            self.processor_seconds,
            self.contact_processor_seconds,
        ) {
            (Some(1), Some(whole), Some(contact)) => (whole, contact),
            _ => (self.seconds, self.contact_seconds),
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
    cases
        .iter()
        .map(|case| {
            let record = folder::record(study, case, settings)?;
            let ended = match folder::find(&record, &settings.folder(case))? {
                Found::Complete { summary, threads } => {
                    Ended::WithFigures(figures(study, &summary, threads))
                }
                Found::Failed { exit_code, message } => Ended::Failed { exit_code, message },
                Found::Nothing => Ended::NotRun,
            };
            Ok(CaseResult {
                case: case.clone(),
                ended,
            })
        })
        .collect()
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

fn figures(study: &Study, summary: &Value, threads: Option<u16>) -> Figures {
    let stages = || summary["stages"].as_array().into_iter().flatten();
    let sum = |of: &str, wanted: &dyn Fn(&str) -> bool| -> f64 {
        let named = stages().filter(|s| s["name"].as_str().is_some_and(wanted));
        named.filter_map(|s| s[of].as_f64()).sum()
    };
    let held = |name: &str| name == HELD_MODES_STAGE;
    let contact = |name: &str| name == "static state" || name.starts_with("response, ");
    let without_held = |of: &str| Some((summary[of].as_f64()? - sum(of, &held)).max(0.0));
    let processor = "processor_seconds";
    let on_processors = without_held(processor);
    let count = |name: &str| summary["response"][name].as_u64().unwrap_or_default() as usize;
    let unheld = stages().filter(|s| !s["name"].as_str().is_some_and(held));
    Figures {
        values: study
            .quantities
            .iter()
            .flat_map(|q| q.figures(summary))
            .collect(),
        seconds: without_held("seconds").unwrap_or_default(),
        contact_seconds: sum("seconds", &contact),
        processor_seconds: on_processors,
        contact_processor_seconds: on_processors.map(|_| sum(processor, &contact)),
        peak_memory_mib: unheld
            .filter_map(|s| s["peak_memory_mib"].as_f64())
            .reduce(f64::max),
        threads,
        points: count("points"),
        unconverged: count("points").saturating_sub(count("converged_points")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::file::Mode;
    use crate::study::quantity;

    #[test]
    fn time_leaves_out_what_only_the_study_asked_for() {
        let study = Study {
            name: "s".into(),
            scene: "x".into(),
            set: vec![],
            mode: Mode::Grid,
            quantities: quantity::ALL.to_vec(),
            fields: false,
            knobs: vec![],
            targets: vec![],
        };
        let stage = |name: &str, seconds: f64, mib: f64| {
            serde_json::json!({
            "name": name, "seconds": seconds, "processor_seconds": 2.0 * seconds, "peak_memory_mib": mib })
        };
        let summary = serde_json::json!({
            "seconds": 10.0, "processor_seconds": 20.0,
            "stages": [stage("reduction", 4.0, 300.0), stage("static state", 0.5, 310.0),
                       stage("response, 3 harmonics", 2.0, 350.0), stage("response files", 1.0, 350.0),
                       stage(HELD_MODES_STAGE, 2.5, 900.0)],
            "response": { "points": 5, "converged_points": 3, "peak_ratio": 0.5 }
        });
        let side_by_side = figures(&study, &summary, Some(2));
        assert_eq!(side_by_side.cost(), [5.0, 2.5]);
        let figures = figures(&study, &summary, Some(1));
        assert_eq!((figures.seconds, figures.contact_seconds), (7.5, 2.5));
        assert_eq!(
            (figures.cost(), figures.cost_seconds()),
            ([10.0, 5.0], 15.0)
        );
        assert_eq!(figures.peak_memory_mib, Some(350.0));
        assert_eq!((figures.points, figures.unconverged), (5, 2));
        assert_eq!(figures.values, [("peak_ratio".to_owned(), 0.5)]);
    }
}
