//! What accuracy costs: a scene over ranges of any of its keys, and what each choice costs and buys.
//!
//! A study file (`file`, `knob`) names a scene and knobs; they make cases (`cases`), each of which is one
//! `dovetail run` in a folder of its own (`folder`, `runner`). What comes out (`results`) is turned into errors, orders,
//! a Pareto front and a recommendation (`answers`), and written (`report`, `pictures`). Nothing is computed here that a
//! run does not say itself in its summary.json.

mod answers;
mod cases;
mod error;
mod file;
mod folder;
mod knob;
mod pictures;
mod quantity;
mod reader;
mod report;
mod results;
mod runner;
mod spent;
mod summary;
mod words;
mod workflow;

use std::path::{Path, PathBuf};

use miette::Diagnostic;

pub use self::error::{StudyError, StudyFault, StudyProblem};
pub use self::folder::Sharing;

use self::answers::{Answers, answers};
use self::cases::{Case, cases, combination};
use self::file::{Study, StudyText};
use self::folder::{Found, Settings};
use self::results::{CaseResult, Ended, collect};
use crate::error::Error;
use crate::pipeline;
use crate::progress::Progress;
use crate::scene;
use crate::terminal;
use dovetail_solver::description::Subject;

/// What to do with a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Run what is not complete, then answer.
    Run,
    /// Run this case alone.
    Case(String),
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

/// A study from its file to its answers.
///
/// # Errors
/// A study or a case of it that is not possible (told before anything runs), files that cannot be read or written;
/// [`Error::CasesFailed`] when all is written but some cases have no or no full result.
pub fn study(file: &Path, options: &StudyOptions, progress: &Progress) -> Result<(), Error> {
    let text = StudyText::read(file)?;
    let study = text.parse(&options.overrides)?;
    let mut all = cases(&study);
    check(&text, &study, &all)?;
    let out = options
        .out
        .clone()
        .unwrap_or_else(|| Path::new("output").join(&study.name));
    let settings = Settings {
        out,
        threads: options.threads,
        sharing: options.sharing.clone(),
    };
    match &options.action {
        Action::ExportWorkflow(folder) => {
            workflow::write(folder, file, &study, &all, &options.overrides, &settings)?;
            progress.note(&format!(
                "{} cases in {}",
                all.len(),
                folder.join("Snakefile").display()
            ));
            return Ok(());
        }
        Action::Case(name) => {
            let case = all.iter().find(|c| c.slug == *name).cloned();
            let case = case.ok_or_else(|| StudyError::NoSuchCase {
                name: name.clone(),
                cases: all.iter().map(|c| c.slug.clone()).collect(),
            })?;
            let one = [case];
            runner::run(&study, &one, &settings, 1, progress)?;
            return all_well(&collect(&study, &one, &settings)?);
        }
        Action::Run | Action::Collect => {}
    }
    let runs = options.action == Action::Run;
    progress.note(&format!("study \"{}\": {} cases", study.name, all.len()));
    if runs {
        runner::run(&study, &all, &settings, options.jobs, progress)?;
    }
    let mut results = collect(&study, &all, &settings)?;
    let mut found = answers(&study, &results);
    // What is put together from several knobs is run, too, to see whether it holds.
    let further = further(&study, &all, &found, runs, &settings)?;
    if !further.is_empty() {
        progress.note("the recommended combinations:");
        if runs {
            runner::run(&study, &further, &settings, options.jobs, progress)?;
        }
        all.extend(further);
        results = collect(&study, &all, &settings)?;
        found = answers(&study, &results);
    }
    write(&study, &settings, &results, &found)?;
    tell(&study, &settings, &results, &found, progress)?;
    all_well(&results)
}

/// Every case is loaded and its mesh or folder looked for, so that a slip in the last is told before the first is run.
fn check(text: &StudyText, study: &Study, cases: &[Case]) -> Result<(), Error> {
    // Where neither the scene alone nor the first case is possible, nothing is wrong with that case in particular.
    if let (Err(error), Some(Err(_))) = (
        scene::load(&study.scene, &study.set),
        cases
            .first()
            .map(|c| scene::load(&study.scene, &c.set(study))),
    ) {
        return Err(error.into());
    }
    let mut subjects: Vec<Subject> = Vec::new();
    let mut faults: Vec<(std::ops::Range<usize>, StudyFault)> = Vec::new();
    for case in cases {
        let checked = scene::load(&study.scene, &case.set(study))
            .map_err(Error::from)
            .and_then(|scene| {
                if subjects.contains(&scene.subject) {
                    return Ok(());
                }
                let options = pipeline::Options {
                    out: PathBuf::new(),
                    scene_file: study.scene.clone(),
                    fields: false,
                    held_modes: false,
                    cache: None,
                };
                pipeline::check(&scene, &options, &Progress::new(&mut ()))?;
                subjects.push(scene.subject);
                Ok(())
            });
        let Err(error) = checked else {
            continue;
        };
        let message = error.to_string();
        // A grid meets the same fault again and again.
        let known = |f: &StudyFault| matches!(f, StudyFault::ImpossibleCase { message: m, .. } if *m == message);
        if faults.iter().any(|(_, f)| known(f)) {
            continue;
        }
        let help = error.help().map_or(String::new(), |h| h.to_string());
        let case_name = words::title(study, case);
        let fault = StudyFault::ImpossibleCase {
            case: case_name,
            message,
            help,
        };
        faults.push((place(study, case), fault));
    }
    match faults.is_empty() {
        true => Ok(()),
        false => Err(StudyError::Invalid {
            problems: text.problems(faults),
        }
        .into()),
    }
}

/// The value that makes a case differ from the base, else the first knob.
fn place(study: &Study, case: &Case) -> std::ops::Range<usize> {
    let knobs = study.knobs.iter().zip(&case.values);
    let turned = knobs.clone().find(|(knob, value)| knob.base != **value);
    let (knob, value) = match turned.or_else(|| knobs.clone().next()) {
        Some(found) => found,
        None => return 0..0,
    };
    knob.values[*value].span.clone()
}

/// Combinations that the answers recommend and the study has not: all of them, or those that were run before.
fn further(
    study: &Study,
    cases: &[Case],
    found: &Answers,
    all: bool,
    settings: &Settings,
) -> Result<Vec<Case>, Error> {
    let mut further: Vec<Case> = Vec::new();
    for combined in found.advice.iter().filter_map(|a| a.combination.as_ref()) {
        if further.iter().any(|c| c.values == combined.values) {
            continue;
        }
        let case = combination(study, cases, combined.values.clone());
        let record = folder::record(study, &case, settings)?;
        let complete = || {
            folder::find(&record, &settings.folder(&case))
                .map(|f| matches!(f, Found::Complete { .. }))
        };
        if all || complete()? {
            further.push(case);
        }
    }
    Ok(further)
}

fn write(
    study: &Study,
    settings: &Settings,
    results: &[CaseResult],
    found: &Answers,
) -> Result<(), Error> {
    let out = &settings.out;
    pictures::write(&out.join("plots"), study, results, found)?;
    report::write_report(&out.join("study.md"), study, results, found)?;
    report::write_summary(&out.join("summary.json"), study, results, found)?;
    report::write_table(&out.join("study.csv"), study, results, found)
}

/// The recommendations on the terminal, and where the rest is.
fn tell(
    study: &Study,
    settings: &Settings,
    results: &[CaseResult],
    found: &Answers,
    progress: &Progress,
) -> Result<(), Error> {
    for result in results {
        if let Ended::Failed { message, .. } = &result.ended {
            progress.warning(&format!(
                "{} {}: {message}",
                result.case.slug,
                result.outcome()
            ));
        }
    }
    let advice = found.advice.iter();
    let lines = advice.map(|advice| words::advice(study, results, found, advice) + "\n");
    terminal::print(&lines.collect::<String>())?;
    progress.note(&format!(
        "answers in {}",
        settings.out.join("study.md").display()
    ));
    Ok(())
}

fn all_well(results: &[CaseResult]) -> Result<(), Error> {
    let count =
        |wanted: &dyn Fn(&Ended) -> bool| results.iter().filter(|r| wanted(&r.ended)).count();
    let without = count(&|e| !matches!(e, Ended::WithFigures(_)));
    let unconverged = count(&|e| matches!(e, Ended::WithFigures(f) if f.unconverged > 0));
    match (without, unconverged) {
        (0, 0) => Ok(()),
        _ => Err(Error::CasesFailed {
            without,
            unconverged,
            cases: results.len(),
        }),
    }
}
