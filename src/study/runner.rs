//! Runs cases and shared inputs: each is a process of this program, several cases at the same time.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::cases::Case;
use super::error::StudyError;
use super::file::Study;
use super::folder::{self, Found, OutcomeRecord, Settings};
use super::pieces::Piece;
use crate::exit::ExitStatus;
use crate::export::journal::Journal;
use crate::export::{ExportError, create_folder};
use crate::reporter::Reporter;

/// Runs the incomplete cases, `jobs` at a time, in their order.
///
/// # Errors
/// The first failure to start a process or to write its folder; running cases are finished. A
/// failed case is not an error.
pub fn run(
    study: &Study,
    cases: &[Case],
    settings: &Settings,
    jobs: usize,
    reporter: &Reporter<'_>,
) -> Result<(), StudyError> {
    let mut pending = Vec::new();
    for case in cases {
        let record = folder::record(study, case, settings)?;
        let found = folder::find(&record, &settings.folder(case))?;
        if !matches!(found, Found::Complete(_)) {
            pending.push((case, record));
        }
    }
    let complete = cases.len() - pending.len();
    if complete > 0 {
        reporter.note(&format!(
            "{complete} of {} cases are complete already",
            cases.len()
        ));
    }
    let program = program()?;
    let (queue, done) = (Mutex::new(pending.iter()), AtomicUsize::new(0));
    let queue = || queue.lock().unwrap_or_else(PoisonError::into_inner);
    let next = || queue().next();
    let work = || {
        while let Some((case, record)) = next() {
            let outcome = run_case(&program, record, &settings.folder(case));
            // Nothing more is begun after a failure.
            let outcome = outcome.inspect_err(|_| *queue() = [].iter())?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            reporter.note(&format!(
                "[{done}/{}] {:<28} {:8.2} s{}",
                pending.len(),
                case.slug,
                outcome.seconds,
                remark(&outcome)
            ));
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers = (0..jobs.min(pending.len())).map(|_| scope.spawn(work));
        let workers: Vec<_> = workers.collect();
        let ends = workers.into_iter().map(|worker| {
            let end = worker.join();
            end.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        // All of them are waited for.
        ends.collect::<Vec<_>>().into_iter().collect()
    })
}

fn remark(outcome: &OutcomeRecord) -> String {
    let not_converged = i32::from(ExitStatus::NotConverged.code());
    match outcome.exit_code {
        Some(0) => String::new(),
        Some(code) if code == not_converged => "  some frequencies did not converge".to_owned(),
        Some(code) => format!("  failed with exit code {code}: see its log.txt"),
        None => "  ended by a signal".to_owned(),
    }
}

/// Runs one case in its folder and records how it ended.
///
/// # Errors
/// [`ExportError::Busy`] if another process runs the case; its folder is then left unchanged.
fn run_case(
    program: &Path,
    record: &folder::CaseRecord,
    folder: &Path,
) -> Result<OutcomeRecord, StudyError> {
    if Journal::is_busy(folder) {
        let folder = folder.to_path_buf();
        return Err(ExportError::Busy { folder }.into());
    }
    let resumed = folder::was_broken_off(record, folder)?;
    folder::prepare(record, folder)?;
    let mut command = Command::new(program);
    command
        .args(&record.command[1..])
        .arg("--until-stdin-ends")
        .args(resumed.then_some("--resume"));
    one(command, folder)
}

/// Puts a shared input into the cache. An input that is already there is not made again.
///
/// # Errors
/// A process that cannot be started, a folder that cannot be written; [`StudyError::PieceFailed`],
/// after everything is written.
pub fn make(study: &Study, piece: &Piece, settings: &Settings) -> Result<(), StudyError> {
    let folder = piece.folder(settings);
    create_folder(&folder)?;
    folder::remove_outcome(&folder)?;
    let mut command = Command::new(program()?);
    command.args(piece.command(study, settings));
    let outcome = one(command, &folder)?;
    match outcome.exit_code {
        Some(0) => Ok(()),
        _ => Err(StudyError::PieceFailed {
            name: piece.name.clone(),
            log: folder.join("log.txt"),
        }),
    }
}

fn program() -> Result<PathBuf, StudyError> {
    std::env::current_exe().map_err(StudyError::io("finding", Path::new("dovetail")))
}

/// Runs a command about a folder, writes its log there and records how the command ended.
fn one(mut command: Command, folder: &Path) -> Result<OutcomeRecord, StudyError> {
    let path = folder.join("log.txt");
    let log = std::fs::File::create(&path).map_err(StudyError::io("creating", &path))?;
    let also = log.try_clone().map_err(StudyError::io("creating", &path))?;
    let begin = Instant::now();
    // The pipe to its standard input ends with this process, however it ends, and the case with it:
    // nobody writes into the folder any more when the study is taken up again.
    let program = PathBuf::from(command.get_program());
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(log)
        .stderr(also)
        .spawn()
        .map_err(StudyError::io("starting", &program))?;
    let held = child.stdin.take();
    let status = child
        .wait()
        .map_err(StudyError::io("waiting for", &program))?;
    drop(held);
    let outcome = OutcomeRecord {
        exit_code: status.code(),
        seconds: begin.elapsed().as_secs_f64(),
    };
    folder::write_json(&folder.join("outcome.json"), &outcome)?;
    Ok(outcome)
}
