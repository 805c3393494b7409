//! A scene over ranges of any of its keys: what accuracy costs, and what design values lead to.
//!
//! A study file (`file`, `parameter`) names a scene and parameters; they make cases (`cases`), each of which
//! is one `dovetail run` in a folder of its own (`folder`, `runner`). What comes out (`results`) is
//! turned into orders, errors and recommended settings (`convergence`, `analysis`) and into the least
//! figures among designs (`designs`), and written (`report`, `pictures`, `page`). Nothing is computed here that a run does not say itself in its
//! summary.json.

mod analysis;
mod cases;
mod convergence;
mod designs;
mod error;
mod file;
mod folder;
pub(crate) mod keys;
mod page;
mod parameter;
mod pictures;
mod pieces;
mod quantity;
mod raw;
mod report;
mod results;
mod runner;
mod workflow;

use std::path::{Path, PathBuf};

use miette::Diagnostic;

pub use self::cases::{Case, cases};
pub use self::error::StudyError;
pub use self::file::{Study, StudyText};

use self::analysis::{Analysis, analyse};
use self::cases::combination;
use self::folder::{Found, Settings};
use self::pieces::Pieces;
use self::results::{CaseResult, Ended, collect};
use self::workflow::Workflow;
use crate::pipeline;
use crate::pipeline::progress::Progress;
use crate::scene::{self, Fault};
use crate::warning::Weight;
use crate::words::counted;
use dovetail_solver::description::Subject;

/// What to do with a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Run what is not complete, then answer.
    Run,
    /// Run this case alone.
    Case(String),
    /// Make this mesh or reduced model alone, which several cases share.
    Piece(String),
    /// Answer with what is there.
    Collect,
    /// Write a Snakemake workflow into this folder.
    ExportWorkflow(PathBuf),
}

/// How to do it.
#[derive(Debug, Clone)]
pub struct StudyOptions {
    pub action: Action,
    /// `None`: `output/<name of the study>`.
    pub out: Option<PathBuf>,
    /// Cases side by side.
    pub jobs: usize,
    /// Threads of each case.
    pub threads: u16,
    pub sharing: Sharing,
    /// `KEY=VALUE` for all cases, after those of the study.
    pub overrides: Vec<String>,
}

/// Whether cases share meshes and reduced models.
#[derive(Debug, Clone, PartialEq)]
pub enum Sharing {
    /// In a workflow through the folder `cache` of the study, unless the study has numerical parameters: it compares what
    /// its cases cost. Else nothing is shared.
    Unsaid,
    /// Each case computes all of its stages: its cost is then that of its settings.
    Nothing,
    /// Through the cache in this folder.
    Cache {
        folder: PathBuf,
        limit_gib: Option<f64>,
    },
}

/// Of a cache that belongs to one study, whose cases need all of it.
const MOST_GIB: f64 = 1000.0;

impl Sharing {
    /// In a workflow, in place of [`Sharing::Unsaid`].
    fn in_workflow(self, study: &Study, out: &Path) -> Self {
        let compares_costs = study
            .parameters
            .iter()
            .any(|parameter| !parameter.is_design());
        match self {
            Self::Unsaid if !compares_costs => Self::Cache {
                folder: out.join("cache"),
                limit_gib: Some(MOST_GIB),
            },
            said => said,
        }
    }

    /// What each case is told, as words of the command line.
    fn words(&self) -> Vec<String> {
        let Self::Cache { folder, limit_gib } = self else {
            return vec!["--no-cache".to_owned()];
        };
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.clone());
        let mut words = vec!["--cache".to_owned(), folder.display().to_string()];
        if let Some(limit) = limit_gib {
            words.extend(["--cache-limit-gib".to_owned(), limit.to_string()]);
        }
        words
    }
}

/// What came of a study.
#[derive(Debug)]
pub struct Studied {
    /// The least values and the recommendations, for a reader; empty where the action answers
    /// nothing.
    pub answers: String,
    /// [`StudyError::CasesFailed`], where all is written but some cases have no or no full result.
    pub verdict: Result<(), StudyError>,
}

/// A study from its file to its answers.
///
/// # Errors
/// A study or a case of it that is not possible (told before anything runs), files that cannot be
/// read or written.
pub fn study(
    file: &Path,
    options: &StudyOptions,
    progress: &Progress,
) -> Result<Studied, StudyError> {
    let without_answers = |verdict| Studied {
        answers: String::new(),
        verdict,
    };
    let text = StudyText::read(file)?;
    let study = text.parse(&options.overrides)?;
    let mut all = cases(&study);
    check(&text, &study, &all)?;
    let out = options
        .out
        .clone()
        .unwrap_or_else(|| Path::new("output").join(&study.name));
    let sharing = match &options.action {
        Action::ExportWorkflow(_) => options.sharing.clone().in_workflow(&study, &out),
        _ => options.sharing.clone(),
    };
    let shares = matches!(sharing, Sharing::Cache { .. });
    let settings = Settings {
        out,
        threads: options.threads,
        cache: sharing.words(),
    };
    match &options.action {
        Action::ExportWorkflow(folder) => {
            let pieces = match shares {
                true => Pieces::of(&study, &all)?,
                false => Pieces::none(&all),
            };
            let workflow = Workflow {
                study_file: file,
                overrides: &options.overrides,
                settings: &settings,
                cases: &all,
                pieces: &pieces,
            };
            workflow.write(folder)?;
            progress.note(&format!(
                "{} and {} in {}",
                counted(all.len(), "case", "cases"),
                counted(pieces.all.len(), "shared piece", "shared pieces"),
                folder.join("Snakefile").display()
            ));
            return Ok(without_answers(Ok(())));
        }
        Action::Piece(name) => {
            let pieces = Pieces::of(&study, &all)?.all;
            let piece = pieces.iter().find(|p| p.name == *name);
            let piece = piece.ok_or_else(|| StudyError::NoSuchPiece {
                name: name.clone(),
                pieces: pieces.iter().map(|p| p.name.clone()).collect(),
            })?;
            if !shares {
                return Err(StudyError::PieceWithoutCache { name: name.clone() });
            }
            return Ok(without_answers(runner::make(&study, piece, &settings)));
        }
        Action::Case(name) => {
            let case = all.iter().find(|c| c.slug == *name).cloned();
            let case = case.ok_or_else(|| StudyError::NoSuchCase {
                name: name.clone(),
                cases: all.iter().map(|c| c.slug.clone()).collect(),
            })?;
            let one = [case];
            runner::run(&study, &one, &settings, 1, progress)?;
            let results = collect(&study, &one, &settings)?;
            return Ok(without_answers(all_complete(&results)));
        }
        Action::Run | Action::Collect => {}
    }
    let runs = options.action == Action::Run;
    progress.note(&format!("study \"{}\": {} cases", study.name, all.len()));
    if runs {
        runner::run(&study, &all, &settings, options.jobs, progress)?;
    }
    let mut results = collect(&study, &all, &settings)?;
    let mut analysis = analyse(&study, &results);
    // Settings that are put together from several parameters are run, too, to see whether they hold.
    for values in analysis.not_run() {
        let case = combination(&study, &all, values);
        if runs || is_complete(&study, &case, &settings)? {
            all.push(case);
        }
    }
    if all.len() > results.len() {
        progress.note("the recommended combinations:");
        if runs {
            runner::run(&study, &all, &settings, options.jobs, progress)?;
        }
        results = collect(&study, &all, &settings)?;
        analysis = analyse(&study, &results);
    }
    write(&study, &settings, &results, &analysis)?;
    if runs {
        let removed = folder::remove_other_cases(&study, &all, &settings)?;
        if !removed.is_empty() {
            progress.note(&format!(
                "removed {} of an earlier definition of the study: {}",
                counted(removed.len(), "case", "cases"),
                removed.join(", ")
            ));
        }
    }
    for result in &results {
        if let Ended::Failed { message, .. } = &result.ended {
            progress.warning(
                Weight::Wrong,
                format!("{} failed: {message}", result.case.slug),
            );
        }
    }
    let report = settings.out.join("report.html");
    progress.note(&format!("answers in {}", report.display()));
    let mut lines = report::least_values(&study, &results, &analysis);
    lines.extend(report::recommended(&study, &results, &analysis));
    Ok(Studied {
        answers: lines.iter().map(|line| format!("{line}\n")).collect(),
        verdict: all_complete(&results),
    })
}

fn is_complete(study: &Study, case: &Case, settings: &Settings) -> Result<bool, StudyError> {
    let record = folder::record(study, case, settings)?;
    let found = folder::find(&record, &settings.folder(case))?;
    Ok(matches!(found, Found::Complete(_)))
}

/// Every case is loaded and its mesh or folder looked for, so that a slip in the last is told
/// before the first is run.
fn check(text: &StudyText, study: &Study, cases: &[Case]) -> Result<(), StudyError> {
    // Where neither the scene alone nor the first case is possible, nothing is wrong with that case
    // in particular.
    if let (Err(error), Some(Err(_))) = (
        scene::load(&study.scene, &study.set),
        cases
            .first()
            .map(|c| scene::load(&study.scene, &c.set(study))),
    ) {
        return Err(error.into());
    }
    let mut subjects: Vec<Subject> = Vec::new();
    let mut faults: Vec<(std::ops::Range<usize>, Fault)> = Vec::new();
    for case in cases {
        let checked = scene::load(&study.scene, &case.set(study))
            .map_err(StudyError::from)
            .and_then(|scene| {
                if subjects.contains(&scene.subject) {
                    return Ok(());
                }
                pipeline::check(&scene, &Progress::new(&mut ()))?;
                subjects.push(scene.subject);
                Ok(())
            });
        let Err(error) = checked else {
            continue;
        };
        let labels = study.parameters.iter().zip(case.labels(study));
        let labels: Vec<String> = labels.map(|(k, l)| format!("{} {l}", k.name)).collect();
        let told = error.to_string();
        // A grid meets the same fault again and again.
        let known = |fault: &Fault| fault.to_string().ends_with(&told);
        if faults.iter().any(|(_, fault)| known(fault)) {
            continue;
        }
        let fault = Fault::Particular {
            message: format!(
                "case \"{}\" ({}) is no possible run: {told}",
                case.slug,
                labels.join(", ")
            ),
            label: "asks for it",
            remedy: error.help().map_or(String::new(), |h| h.to_string()),
        };
        faults.push((place(study, case), fault));
    }
    match faults.is_empty() {
        true => Ok(()),
        false => Err(text.invalid(faults)),
    }
}

/// The value that makes a case differ from the base, else the first parameter.
fn place(study: &Study, case: &Case) -> std::ops::Range<usize> {
    let parameters = study.parameters.iter().zip(&case.values);
    let turned = parameters
        .clone()
        .find(|(parameter, value)| parameter.base != **value);
    let (parameter, value) = match turned.or_else(|| parameters.clone().next()) {
        Some(found) => found,
        None => return 0..0,
    };
    parameter.values[*value].span.clone()
}

fn write(
    study: &Study,
    settings: &Settings,
    results: &[CaseResult],
    analysis: &Analysis,
) -> Result<(), StudyError> {
    let out = &settings.out;
    let pictures = pictures::write(&out.join("plots"), study, results, analysis)?;
    let contents = page::Contents {
        study,
        settings,
        results,
        analysis,
        pictures: &pictures,
    };
    page::write(&out.join("report.html"), &contents)?;
    report::write_summary(&out.join("summary.json"), study, results, analysis)?;
    report::write_table(&out.join("table.csv"), study, results, analysis)
}

fn all_complete(results: &[CaseResult]) -> Result<(), StudyError> {
    let count =
        |wanted: &dyn Fn(&Ended) -> bool| results.iter().filter(|r| wanted(&r.ended)).count();
    let without = count(&|e| !matches!(e, Ended::WithFigures(_)));
    let unconverged = count(&|e| matches!(e, Ended::WithFigures(f) if f.unconverged > 0));
    match (without, unconverged) {
        (0, 0) => Ok(()),
        _ => Err(StudyError::CasesFailed {
            without,
            unconverged,
            cases: results.len(),
        }),
    }
}
