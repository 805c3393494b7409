//! Studies: runs of a scene over ranges of any of its keys, for the cost of accuracy and the effect
//! of physical parameters.
//!
//! The parameters of a [study file](crate::study_file) make cases (`cases`), each of which is one
//! `dovetail run` in a folder of its own (`folder`, `runner`). The results (`results`) are turned
//! into orders and errors (`convergence`, `analysis`) and written (`report`, `pictures`, `page`).
//! `workflow` hands the same cases to Snakemake.
//!
//! All numbers are read from the summary.json of the runs. Cases share nothing but the cache, and
//! any engine can run one elsewhere.

mod analysis;
mod cases;
mod convergence;
mod folder;
mod page;
mod pictures;
mod report;
mod results;
mod runner;
mod workflow;

use std::path::{Path, PathBuf};

use miette::Diagnostic;

pub use self::cases::{Case, cases};

use self::analysis::analyse;
use self::cases::words;
use self::folder::StudyPlan;
use self::results::{CaseEnd, CaseResult};
use crate::commands;
use crate::reporter::Reporter;
use crate::scene::{self, SceneFault};
use crate::study_file::keys::ParameterKind;
use crate::study_file::{Study, StudyError};
use dovetail_export::lock::FolderLock;
use dovetail_export::report::REPORT;
use dovetail_export::warning::Weight;
use dovetail_export::words::counted;
use dovetail_solver::description::Subject;

/// Action on a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Run the incomplete cases, then answer.
    Run,
    /// Run this case alone.
    Case(String),
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
    /// Cache through which the cases share meshes and reduced models, and its size limit. Without
    /// it each case computes all of its stages, but for those of a workflow: they share through the
    /// folder `cache` of the study, unless the study has numerical parameters, as it then reports
    /// the cost of their values.
    pub cache: Option<(PathBuf, Option<f64>)>,
    /// True if the cases of a workflow share nothing either.
    pub no_cache: bool,
    /// `KEY=VALUE` texts for all cases, applied after those of the study.
    pub overrides: Vec<String>,
}

/// Size limit of a cache that belongs to one study, whose cases need all of it.
const MOST_GIB: f64 = 1000.0;

/// Performs a study from its file to its answers.
///
/// # Errors
/// A study or a case of it that is not possible (reported before anything runs), files that cannot
/// be read or written; [`StudyError::CasesFailed`] if everything is written but some cases have no
/// or no full result.
pub fn study(
    file: &Path,
    options: &StudyOptions,
    reporter: &Reporter<'_>,
) -> Result<(), StudyError> {
    let mut plan = plan(Study::read(file, &options.overrides)?, options);
    check(&plan.study, &plan.cases)?;
    match &options.action {
        Action::Run => answer(&plan, Some(options.jobs), reporter),
        Action::Collect => answer(&plan, None, reporter),
        Action::ExportWorkflow(folder) => {
            let pieces = plan.export(folder, file, &options.overrides)?;
            let cases = counted(plan.cases.len(), "case", "cases");
            let pieces = counted(pieces, "shared input", "shared inputs");
            let file = folder.join("Snakefile");
            reporter.note(&format!("{cases} and {pieces} in {}", file.display()));
            Ok(())
        }
        Action::Case(name) => {
            let known = plan.cases.iter().map(|case| case.slug.clone()).collect();
            plan.cases.retain(|case| case.slug == *name);
            if plan.cases.is_empty() {
                let name = name.clone();
                return Err(StudyError::UnknownCase { name, known });
            }
            plan.run(1, reporter)?;
            check_all_complete(&plan.results()?)
        }
    }
}

fn plan(study: Study, options: &StudyOptions) -> StudyPlan {
    let out = options.out.clone();
    let out = out.unwrap_or_else(|| Path::new("output").join(&study.name));
    let tells_costs = study
        .parameters
        .iter()
        .any(|p| p.kind == ParameterKind::Numerical);
    let is_workflow = matches!(options.action, Action::ExportWorkflow(_));
    let has_own_cache = is_workflow && !tells_costs && !options.no_cache;
    let cache_folder = has_own_cache.then(|| (out.join("cache"), Some(MOST_GIB)));
    let mut cache = vec!["--no-cache".to_owned()];
    if let Some((folder, limit)) = options.cache.clone().or(cache_folder) {
        let folder = std::path::absolute(&folder).unwrap_or(folder);
        cache = vec!["--cache".to_owned(), folder.display().to_string()];
        let limit = limit.iter();
        cache.extend(limit.flat_map(|gib| ["--cache-limit-gib".to_owned(), gib.to_string()]));
    }
    StudyPlan {
        cases: cases(&study),
        study,
        out,
        threads: options.threads,
        cache,
    }
}

/// Runs the incomplete cases, `jobs` at a time, and answers; without `jobs` it answers with the
/// existing results.
fn answer(
    plan: &StudyPlan,
    jobs: Option<usize>,
    reporter: &Reporter<'_>,
) -> Result<(), StudyError> {
    let (name, all) = (&plan.study.name, plan.cases.len());
    reporter.note(&format!("study \"{name}\": {all} cases"));
    if let Some(jobs) = jobs {
        plan.run(jobs, reporter)?;
    }
    let results = plan.results()?;
    let analysis = analyse(&plan.study, &results);
    let lock = FolderLock::acquire(&plan.out)?;
    let pictures = pictures::write(&plan.out.join("plots"), &analysis)?;
    page::write(plan, &analysis, &pictures)?;
    report::write_summary(&plan.out.join("summary.json"), &analysis)?;
    report::write_table(&plan.out.join("table.csv"), &analysis)?;
    drop(lock);
    for result in &results {
        let words = match &result.ended {
            CaseEnd::Failed { message, .. } => Some(format!(" failed: {message}")),
            CaseEnd::WithFigures(figures) => {
                let words = figures.response.first.not_computed_words();
                words.map(|words| format!(": {words}"))
            }
            CaseEnd::NotRun => None,
        };
        if let Some(words) = words {
            let words = format!("{}{words}", result.case.slug);
            reporter.warning(Weight::Wrong, words);
        }
    }
    reporter.note(&format!("answers in {}", plan.out.join(REPORT).display()));
    check_all_complete(&results)
}

/// Loads every case and looks for its mesh or folder, so that a mistake in the last case is
/// reported before the first case runs.
fn check(study: &Study, cases: &[Case]) -> Result<(), StudyError> {
    let load = |set: &[String]| scene::load(&study.scene, set);
    // Where neither the scene alone nor the first case is possible, nothing is wrong with that case
    // in particular.
    if let (Err(error), Err(_)) = (load(&study.set), load(&cases[0].set(study))) {
        return Err(error.into());
    }
    let mut subjects: Vec<Subject> = Vec::new();
    let mut check = |case: &Case| -> Result<(), StudyError> {
        let scene = load(&case.set(study))?;
        if !subjects.contains(&scene.subject) {
            commands::check(&scene, &Reporter::silent(None))?;
            subjects.push(scene.subject);
        }
        Ok(())
    };
    for case in cases {
        let Err(error) = check(case) else {
            continue;
        };
        let (slug, values) = (&case.slug, words(study.chosen(&case.values)));
        let message = format!("case \"{slug}\" ({values}) is no possible run: {error}");
        let remedy = error.help().map_or(String::new(), |h| h.to_string());
        // The value that makes the case differ from the base, else the first parameter.
        let parameters = study.parameters.iter().zip(&case.values);
        let place = parameters.min_by_key(|(p, v)| p.base == **v);
        let place = place.map_or(0..0, |(p, v)| p.values[*v].span.clone());
        let fault = SceneFault::particular(message, "asks for it", remedy);
        return Err(study.invalid(place, fault));
    }
    Ok(())
}

fn check_all_complete(results: &[CaseResult]) -> Result<(), StudyError> {
    let figures = || results.iter().filter_map(CaseResult::figures);
    let (cases, without) = (results.len(), results.len() - figures().count());
    let unconverged = figures().filter(|f| f.unconverged() > 0).count();
    if without + unconverged == 0 {
        return Ok(());
    }
    Err(StudyError::CasesFailed {
        without,
        unconverged,
        cases,
    })
}
