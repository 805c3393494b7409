//! Runs cases: each is a process of this program, several at the same time.

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use super::folder::{self, CaseRecord, OutcomeRecord, StudyPlan};
use super::results::CaseEnd;
use crate::exit::ExitStatus;
use crate::reporter::Reporter;
use crate::study_file::StudyError;
use dovetail_export::lock::FolderLock;
use dovetail_export::write_json;

/// Lock of the folder of a case: who has it starts the case and records how it ended.
const CASE_LOCK: &str = ".case.lock";

impl StudyPlan {
    /// Runs the incomplete cases, `jobs` at a time, in their order.
    ///
    /// # Errors
    /// The first failure to start a process or to write its folder; running cases are finished. A
    /// failed case is not an error.
    pub fn run(&self, jobs: usize, reporter: &Reporter<'_>) -> Result<(), StudyError> {
        let mut pending = Vec::new();
        for case in &self.cases {
            let record = self.record(case)?;
            if !matches!(self.ended(case, &record), CaseEnd::WithFigures(_)) {
                pending.push((record, self.folder(case)));
            }
        }
        let (all, left) = (self.cases.len(), pending.len());
        if left < all {
            let complete = all - left;
            reporter.note(&format!("{complete} of {all} cases are complete already"));
        }
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = || {
            while let Some((record, folder)) = pending.get(next.fetch_add(1, Ordering::Relaxed)) {
                let outcome = run_case(record, folder);
                // Nothing more is begun after a failure.
                let outcome = outcome.inspect_err(|_| next.store(left, Ordering::Relaxed))?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                let (case, seconds) = (&record.case, outcome.seconds);
                let remark = match outcome.exit_code {
                    Some(0) => String::new(),
                    Some(code) if code == i32::from(ExitStatus::NotConverged.code()) => {
                        "  some frequencies did not converge".to_owned()
                    }
                    Some(code) => format!("  failed with exit code {code}: see its log.txt"),
                    None => "  ended by a signal".to_owned(),
                };
                let words = format!("[{done}/{left}] {case:<28} {seconds:8.2} s{remark}");
                reporter.note(&words);
            }
            Ok(())
        };
        std::thread::scope(|scope| {
            let workers: Vec<_> = (0..jobs.min(left)).map(|_| scope.spawn(work)).collect();
            let mut ends = workers.into_iter().map(|worker| worker.join());
            ends.try_for_each(|end| end.unwrap_or_else(|panic| resume_unwind(panic)))
        })
    }
}

/// Runs one case in its folder, with its log there, and records how it ended.
///
/// # Errors
/// [`ExportError::Busy`](dovetail_export::ExportError::Busy) if another process runs the case; its
/// folder is then left unchanged.
fn run_case(record: &CaseRecord, folder: &Path) -> Result<OutcomeRecord, StudyError> {
    // The run locks the folder itself.
    let _of_case = FolderLock::acquire_named(folder, CASE_LOCK)?;
    drop(FolderLock::acquire(folder)?);
    let resumed = folder::was_broken_off(record, folder).then_some("--resume");
    folder::prepare(record, folder)?;
    let program = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("dovetail"));
    let path = folder.join("log.txt");
    let log = std::fs::File::create(&path).map_err(StudyError::io("creating", &path))?;
    let also = log.try_clone().map_err(StudyError::io("creating", &path))?;
    let begin = Instant::now();
    // The pipe to its standard input ends with this process, however it ends, and the case with it:
    // nobody writes into the folder any more when the study is taken up again.
    let mut child = Command::new(&program)
        .args(&record.command[1..])
        .arg("--until-stdin-ends")
        .args(resumed)
        .stdin(Stdio::piped())
        .stdout(log)
        .stderr(also)
        .spawn()
        .map_err(StudyError::io("starting", &program))?;
    let held = child.stdin.take();
    let status = child.wait();
    drop(held);
    let status = status.map_err(StudyError::io("waiting for", &program))?;
    let outcome = OutcomeRecord {
        exit_code: status.code(),
        seconds: begin.elapsed().as_secs_f64(),
    };
    write_json(&folder.join("outcome.json"), &outcome)?;
    Ok(outcome)
}
