//! Studies: runs of a scene over ranges of any of its keys, for the cost of accuracy and the effect
//! of design values.
//!
//! A study file (`file`, `parameter`) names a scene and parameters. They make cases (`cases`), each
//! of which is one `dovetail run` in a folder of its own (`folder`, `runner`). The results
//! (`results`) are turned into orders and errors (`convergence`, `analysis`) and into the smallest
//! figures among designs (`designs`), and written (`report`, `pictures`, `page`). All figures are
//! read from the summary.json of the runs.

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

use self::analysis::analyse;
use self::folder::Settings;
use self::parameter::Parameter;
use self::pieces::Pieces;
use self::results::{CaseResult, Ended, collect};
use self::workflow::Workflow;
use crate::commands;
use crate::export::report::REPORT;
use crate::reporter::Reporter;
use crate::scene::{self, Fault};
use crate::warning::Weight;
use crate::words::counted;
use dovetail_solver::description::Subject;

/// Action on a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Run the incomplete cases, then answer.
    Run,
    /// Run this case alone.
    Case(String),
    /// Make only this mesh or reduced model, which several cases share.
    Piece(String),
    /// Answer with the existing results.
    Collect,
    /// Write a Snakemake workflow into this folder.
    ExportWorkflow(PathBuf),
}

/// Options of a study.
#[derive(Debug, Clone)]
pub struct StudyOptions {
    pub action: Action,
    /// Folder of the study; `None` for `output/<name of the study>`.
    pub out: Option<PathBuf>,
    /// Number of cases that run at the same time.
    pub jobs: usize,
    /// Number of threads of each case.
    pub threads: u16,
    pub sharing: Sharing,
    /// `KEY=VALUE` texts for all cases, applied after those of the study.
    pub overrides: Vec<String>,
}

/// Sharing of meshes and reduced models among cases.
#[derive(Debug, Clone, PartialEq)]
pub enum Sharing {
    /// Default: in a workflow cases share through the folder `cache` of the study, unless the study
    /// has numerical parameters, as it then reports the cost of their values. Otherwise nothing is
    /// shared.
    Unsaid,
    /// Nothing is shared: each case computes all of its stages, and its cost is that of its
    /// settings.
    Nothing,
    /// Cases share through the cache in this folder.
    Cache {
        folder: PathBuf,
        limit_gib: Option<f64>,
    },
}

/// Size limit of a cache that belongs to one study, whose cases need all of it.
const MOST_GIB: f64 = 1000.0;

impl Sharing {
    /// Sharing in a workflow: replaces [`Sharing::Unsaid`].
    fn in_workflow(self, study: &Study, out: &Path) -> Self {
        let tells_costs = study.parameters.iter().any(Parameter::is_numerical);
        match self {
            Self::Unsaid if !tells_costs => Self::Cache {
                folder: out.join("cache"),
                limit_gib: Some(MOST_GIB),
            },
            said => said,
        }
    }

    /// Options of each case, as words of the command line.
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

/// Outcome of a study.
#[derive(Debug)]
pub struct Studied {
    /// Smallest values, one line each; empty if the study asks for none.
    pub answers: String,
    /// [`StudyError::CasesFailed`] if everything is written but some cases have no or no full
    /// result.
    pub verdict: Result<(), StudyError>,
}

/// Performs a study from its file to its answers.
///
/// # Errors
/// A study or a case of it that is not possible (reported before anything runs), files that cannot
/// be read or written.
pub fn study(
    file: &Path,
    options: &StudyOptions,
    reporter: &Reporter<'_>,
) -> Result<Studied, StudyError> {
    let text = StudyText::read(file)?;
    let study = text.parse(&options.overrides)?;
    let all = cases(&study);
    check(&text, &study, &all)?;
    let out = options.out.clone();
    let out = out.unwrap_or_else(|| Path::new("output").join(&study.name));
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
    let verdict = match &options.action {
        Action::Run => return run(&study, &all, &settings, Some(options.jobs), reporter),
        Action::Collect => return run(&study, &all, &settings, None, reporter),
        Action::ExportWorkflow(folder) => {
            let pieces = if shares {
                Pieces::of(&study, &all)?
            } else {
                Pieces::none(&all)
            };
            let workflow = Workflow {
                study_file: file,
                overrides: &options.overrides,
                settings: &settings,
                cases: &all,
                pieces: &pieces,
            };
            workflow.write(folder)?;
            reporter.note(&format!(
                "{} and {} in {}",
                counted(all.len(), "case", "cases"),
                counted(pieces.all.len(), "shared piece", "shared pieces"),
                folder.join("Snakefile").display()
            ));
            Ok(())
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
            runner::make(&study, piece, &settings)
        }
        Action::Case(name) => {
            let case = all.iter().find(|c| c.slug == *name).cloned();
            let one = [case.ok_or_else(|| StudyError::NoSuchCase {
                name: name.clone(),
                cases: all.iter().map(|c| c.slug.clone()).collect(),
            })?];
            runner::run(&study, &one, &settings, 1, reporter)?;
            all_complete(&collect(&study, &one, &settings)?)
        }
    };
    Ok(Studied {
        answers: String::new(),
        verdict,
    })
}

/// Runs the incomplete cases, `jobs` at a time, and answers; without `jobs` it answers with the
/// existing results.
fn run(
    study: &Study,
    all: &[Case],
    settings: &Settings,
    jobs: Option<usize>,
    reporter: &Reporter<'_>,
) -> Result<Studied, StudyError> {
    reporter.note(&format!("study \"{}\": {} cases", study.name, all.len()));
    if let Some(jobs) = jobs {
        runner::run(study, all, settings, jobs, reporter)?;
    }
    let results = collect(study, all, settings)?;
    let analysis = analyse(study, &results);
    let out = &settings.out;
    let pictures = pictures::write(&out.join("plots"), study, &results, &analysis)?;
    let contents = page::Contents {
        study,
        settings,
        results: &results,
        analysis: &analysis,
        pictures: &pictures,
    };
    page::write(&out.join(REPORT), &contents)?;
    report::write_summary(&out.join("summary.json"), study, &results, &analysis)?;
    report::write_table(&out.join("table.csv"), study, &results, &analysis)?;
    if jobs.is_some() {
        let removed = folder::remove_other_cases(study, all, settings)?;
        if !removed.is_empty() {
            reporter.note(&format!(
                "removed {} of an earlier definition of the study: {}",
                counted(removed.len(), "case", "cases"),
                removed.join(", ")
            ));
        }
    }
    for result in &results {
        if let Ended::Failed { message, .. } = &result.ended {
            let words = format!("{} failed: {message}", result.case.slug);
            reporter.warning(Weight::Wrong, words);
        }
    }
    reporter.note(&format!("answers in {}", out.join(REPORT).display()));
    let least = report::least_values(study, &results, &analysis);
    Ok(Studied {
        answers: least.iter().map(|line| format!("{line}\n")).collect(),
        verdict: all_complete(&results),
    })
}

/// Loads every case and looks for its mesh or folder, so that a mistake in the last case is
/// reported before the first case runs.
fn check(text: &StudyText, study: &Study, cases: &[Case]) -> Result<(), StudyError> {
    let load = |set: &[String]| scene::load(&study.scene, set);
    // Where neither the scene alone nor the first case is possible, nothing is wrong with that case
    // in particular.
    if let (Err(error), Some(Err(_))) =
        (load(&study.set), cases.first().map(|c| load(&c.set(study))))
    {
        return Err(error.into());
    }
    let mut subjects: Vec<Subject> = Vec::new();
    let mut faults: Vec<(std::ops::Range<usize>, Fault)> = Vec::new();
    for case in cases {
        let checked = load(&case.set(study)).map_err(StudyError::from);
        let checked = checked.and_then(|scene| {
            if !subjects.contains(&scene.subject) {
                commands::check(&scene, &Reporter::silent(None))?;
                subjects.push(scene.subject);
            }
            Ok(())
        });
        let Err(error) = checked else {
            continue;
        };
        let told = error.to_string();
        // A grid meets the same fault again and again.
        if faults
            .iter()
            .any(|(_, known)| known.to_string().ends_with(&told))
        {
            continue;
        }
        let (slug, values) = (&case.slug, cases::words(study, &case.values, |_| true));
        let message = format!("case \"{slug}\" ({values}) is no possible run: {told}");
        let remedy = error.help().map_or(String::new(), |h| h.to_string());
        // The value that makes the case differ from the base, else the first parameter.
        let parameters = study.parameters.iter().zip(&case.values);
        let varied = parameters.clone().find(|(p, v)| p.base != **v);
        let place = varied.or_else(|| parameters.clone().next());
        let place = place.map_or(0..0, |(p, v)| p.values[*v].span.clone());
        faults.push((place, parameter::fault(message, "asks for it", remedy)));
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(text.invalid(faults))
    }
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
