//! Folder of a case: case.json has the request, outcome.json how the run ended, summary.json its
//! results.
//!
//! A case is complete if its program ended with a result (exit code 0 or 3) and case.json has the
//! current request: the same program, overrides and input files, byte for byte.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::cases::Case;
use super::error::StudyError;
use super::file::Study;
use super::quantity::BLADE_FREQUENCY;
use crate::exit::ExitStatus;
use crate::export::folder::remove_run;
use crate::export::journal::{JOURNAL, Journal};
use crate::export::manifest::{self, RunState, Summary};
use crate::export::write_file;
use crate::fingerprint::{executable_hash, fingerprint};
use crate::scene;
use crate::scene_files;
use dovetail_solver::description::Scene;

/// Content of case.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseRecord {
    /// Version of the program.
    pub version: String,
    /// Hash of the file of the program, in hexadecimals. Its libraries and the processor are left
    /// out: cases may run on several machines.
    pub program_hash: String,
    /// Hash of the program, its libraries and the processor, in hexadecimals; empty if the system
    /// does not provide it. The last digits depend on them: a case is resumed only if they are the
    /// same.
    pub machine_hash: String,
    pub study: String,
    pub case: String,
    /// Name of each parameter and label of its value.
    pub parameters: Vec<(String, String)>,
    /// `KEY=VALUE` texts.
    pub set: Vec<String>,
    pub fields: bool,
    pub held_modes: bool,
    pub inputs: Vec<Input>,
    /// Words of the command that is run; with it the results can be reproduced by hand.
    pub command: Vec<String>,
}

/// File that the case depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    pub file: String,
    /// Hash of its bytes, in hexadecimals.
    pub blake3: String,
}

/// Content of outcome.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutcomeRecord {
    /// Exit code; `None` if the process was ended by a signal.
    pub exit_code: Option<i32>,
    /// Wall time of the process, s.
    pub seconds: f64,
}

/// Settings for running cases.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Folder of the study.
    pub out: PathBuf,
    /// Number of threads of each case.
    pub threads: u16,
    /// Options for the cache of meshes and reduced models, as words of the command line of each
    /// case.
    pub cache: Vec<String>,
}

impl Settings {
    pub fn folder(&self, case: &Case) -> PathBuf {
        self.out.join("cases").join(&case.slug)
    }

    /// Options of a command about the scene with these overrides, whose results go into this
    /// folder.
    pub fn words(&self, set: &[String], folder: &Path) -> Vec<String> {
        let set = set.iter().flat_map(|argument| ["--set", argument]);
        let mut words: Vec<String> = set.map(str::to_owned).collect();
        words.extend([
            "--out".to_owned(),
            folder.display().to_string(),
            // The folder is the study's, whatever scene it held.
            "--force".to_owned(),
            "--threads".to_owned(),
            self.threads.to_string(),
        ]);
        words.extend_from_slice(&self.cache);
        words
    }
}

/// Request of a case.
///
/// # Errors
/// The scene with the overrides of the case, or a file named by it, cannot be read.
pub fn record(study: &Study, case: &Case, settings: &Settings) -> Result<CaseRecord, StudyError> {
    let set = case.set(study);
    let scene = scene::load(&study.scene, &set)?;
    let held_modes = study.quantities.contains(&BLADE_FREQUENCY) && scene.assembly().is_some();
    let mut command = vec![
        "dovetail".to_owned(),
        "run".to_owned(),
        study.scene.display().to_string(),
    ];
    command.extend(settings.words(&set, &settings.folder(case)));
    if !study.fields {
        command.push("--no-fields".to_owned());
    }
    if held_modes {
        command.push("--held-modes".to_owned());
    }
    let labels = case.labels(study).into_iter().map(str::to_owned);
    let names = study.parameters.iter().map(|p| p.name.clone());
    Ok(CaseRecord {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        program_hash: program_hash()?,
        machine_hash: fingerprint().map_or_else(String::new, |hash| hexadecimals(&hash)),
        study: study.name.clone(),
        case: case.slug.clone(),
        parameters: names.zip(labels).collect(),
        set,
        fields: study.fields,
        held_modes,
        inputs: inputs(&study.scene, &scene)?,
        command,
    })
}

fn program_hash() -> Result<String, StudyError> {
    let program = || std::env::current_exe().unwrap_or_else(|_| PathBuf::from("dovetail"));
    let hash = executable_hash().map_err(StudyError::io("reading", &program()))?;
    Ok(hexadecimals(&hash))
}

fn hexadecimals(hash: &[u8; 32]) -> String {
    blake3::Hash::from_bytes(*hash).to_hex().to_string()
}

/// The scene file and the files named in it.
fn inputs(scene_file: &Path, scene: &Scene) -> Result<Vec<Input>, StudyError> {
    let input = |file: PathBuf| {
        let hash = scene_files::hash_of_file(&file);
        Ok(Input {
            file: file.display().to_string(),
            blake3: hash.map_err(StudyError::io("reading", &file))?,
        })
    };
    let named = scene_files::files(scene).into_iter();
    let all = std::iter::once(scene_file.to_path_buf()).chain(named);
    all.map(input).collect()
}

impl CaseRecord {
    /// Returns `true` if a result of `earlier` is also a result of this request: paths, threads and
    /// the machine do not matter.
    fn is_answered_by(&self, earlier: &CaseRecord) -> bool {
        let contents =
            |r: &CaseRecord| -> Vec<String> { r.inputs.iter().map(|i| i.blake3.clone()).collect() };
        self.program_hash == earlier.program_hash
            && self.set == earlier.set
            && (earlier.fields || !self.fields)
            && (earlier.held_modes || !self.held_modes)
            && contents(self) == contents(earlier)
    }
}

/// State of the folder of a case.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    Complete(Box<Summary>),
    /// Ended without a result.
    Failed {
        exit_code: Option<i32>,
        message: String,
    },
    /// No run to the end with these settings, or an unreadable summary.
    Nothing,
}

/// Reads the folder of a case.
///
/// # Errors
/// An existing file that cannot be read or understood.
pub fn find(record: &CaseRecord, folder: &Path) -> Result<Found, StudyError> {
    let (Some(earlier), Some(outcome)) = (
        read_json::<Value>(&folder.join("case.json"))?,
        read_json::<OutcomeRecord>(&folder.join("outcome.json"))?,
    ) else {
        return Ok(Found::Nothing);
    };
    // A record without a field that this program knows is one of another program.
    if !CaseRecord::deserialize(earlier).is_ok_and(|earlier| record.is_answered_by(&earlier)) {
        return Ok(Found::Nothing);
    }
    if !ExitStatus::has_results(outcome.exit_code) {
        return Ok(Found::Failed {
            exit_code: outcome.exit_code,
            message: why_failed(folder),
        });
    }
    let summary: Option<Value> = read_json(&folder.join("summary.json"))?;
    Ok(match summary.and_then(|s| Summary::deserialize(s).ok()) {
        Some(summary) if summary.response.is_some() => Found::Complete(Box::new(summary)),
        _ => Found::Nothing,
    })
}

/// Returns `true` if an interrupted run of the same case is in the folder, which can be resumed.
///
/// # Errors
/// An existing file that cannot be read or understood.
pub fn was_broken_off(record: &CaseRecord, folder: &Path) -> Result<bool, StudyError> {
    let earlier: Option<Value> = read_json(&folder.join("case.json"))?;
    let earlier = earlier.and_then(|record| CaseRecord::deserialize(record).ok());
    let is_same = earlier.is_some_and(|earlier| {
        record.is_answered_by(&earlier) && record.machine_hash == earlier.machine_hash
    });
    Ok(is_same && folder.join(JOURNAL).exists())
}

/// Prepares the folder of a case for a run: removes outcome.json of an earlier run and writes
/// case.json.
pub fn prepare(record: &CaseRecord, folder: &Path) -> Result<(), StudyError> {
    remove_outcome(folder)?;
    write_json(&folder.join("case.json"), record)
}

/// Removes the cases that an earlier definition of this study had and this one has not: the files
/// that they wrote, and their folders if nothing else is in them. A running case stays. Returns the
/// names of the removed cases.
///
/// # Errors
/// A file that cannot be removed.
pub fn remove_other_cases(
    study: &Study,
    cases: &[Case],
    settings: &Settings,
) -> Result<Vec<String>, StudyError> {
    let all = settings.out.join("cases");
    let folders = std::fs::read_dir(&all).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = folders.map(|entry| entry.path()).collect();
    folders.sort();
    let mut removed = Vec::new();
    for folder in folders {
        let record = read_json::<CaseRecord>(&folder.join("case.json"));
        let Ok(Some(CaseRecord { case, .. })) = record
            .map(|record| record.filter(|r| r.study == study.name && all.join(&r.case) == folder))
        else {
            continue;
        };
        if cases.iter().any(|own| own.slug == case) || Journal::is_busy(&folder) {
            continue;
        }
        remove_outcome(&folder)?;
        for name in ["log.txt", "case.json"] {
            remove(&folder.join(name))?;
        }
        remove_run(&folder)?;
        removed.push(case);
    }
    Ok(removed)
}

/// Removes outcome.json of an earlier run.
pub fn remove_outcome(folder: &Path) -> Result<(), StudyError> {
    remove(&folder.join("outcome.json"))
}

/// Removes a file if it exists.
fn remove(path: &Path) -> Result<(), StudyError> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(StudyError::io("removing", path)(error))
        }
        _ => Ok(()),
    }
}

pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), StudyError> {
    let text = serde_json::to_string_pretty(value).map_err(|e| malformed(path, &e))?;
    Ok(write_file(path, (text + "\n").as_bytes())?)
}

/// Reads a JSON file; `None` if there is no such file.
fn read_json<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<Option<T>, StudyError> {
    match std::fs::read(path) {
        Ok(bytes) => match serde_json::from_slice(&bytes) {
            Ok(value) => Ok(Some(value)),
            Err(error) => Err(malformed(path, &error)),
        },
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(StudyError::io("reading", path)(error)),
    }
}

fn malformed(path: &Path, error: &serde_json::Error) -> StudyError {
    let (path, message) = (path.to_owned(), error.to_string());
    StudyError::Malformed { path, message }
}

/// Reason why the case in a folder failed: that of its summary.json, else the last line of its log.
fn why_failed(folder: &Path) -> String {
    let summary = manifest::read_summary(&folder.join("summary.json"));
    let why = summary.filter(|s| s.state == RunState::Failed);
    why.and_then(|s| s.why).unwrap_or_else(|| {
        let log = std::fs::read_to_string(folder.join("log.txt")).unwrap_or_default();
        let last = log.lines().rfind(|line| !line.trim().is_empty());
        last.unwrap_or("nothing was logged").trim().to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn why_a_case_failed_is_what_its_summary_says_else_the_end_of_its_log() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(why_failed(folder.path()), "nothing was logged");
        std::fs::write(folder.path().join("log.txt"), "  mesh 1.0 s\nKilled\n\n").unwrap();
        assert_eq!(why_failed(folder.path()), "Killed");
        let mut summary = Summary {
            why: Some("meshing failed: gmsh was stopped".into()),
            ..Summary::default()
        };
        let path = folder.path().join("summary.json");
        manifest::write_summary(&path, &summary).unwrap();
        assert_eq!(why_failed(folder.path()), "Killed");
        summary.state = RunState::Failed;
        manifest::write_summary(&path, &summary).unwrap();
        assert_eq!(
            why_failed(folder.path()),
            "meshing failed: gmsh was stopped"
        );
    }

    fn record() -> CaseRecord {
        CaseRecord {
            version: "1".into(),
            program_hash: "a".into(),
            machine_hash: "m".into(),
            study: "s".into(),
            case: "base".into(),
            parameters: vec![],
            set: vec!["a=1".into()],
            fields: false,
            held_modes: false,
            inputs: vec![Input {
                file: "a".into(),
                blake3: "0".into(),
            }],
            command: vec![],
        }
    }

    /// The last digits of a run depend on the machine.
    #[test]
    fn a_case_goes_on_only_on_such_a_machine_as_it_began_on() {
        let folder = tempfile::tempdir().unwrap();
        let record = record();
        prepare(&record, folder.path()).unwrap();
        assert!(!was_broken_off(&record, folder.path()).unwrap());
        std::fs::write(folder.path().join(JOURNAL), "").unwrap();
        assert!(was_broken_off(&record, folder.path()).unwrap());
        let mut elsewhere = record.clone();
        elsewhere.machine_hash = "n".into();
        assert!(!was_broken_off(&elsewhere, folder.path()).unwrap());
    }

    #[test]
    fn a_result_counts_for_what_asks_no_more() {
        let record = record();
        let but = |change: fn(&mut CaseRecord)| {
            let mut other = record.clone();
            change(&mut other);
            other
        };
        assert!(record.is_answered_by(&but(|r| r.inputs[0].file = "b/a".into())));
        assert!(record.is_answered_by(&but(|r| r.machine_hash = "n".into())));
        assert!(record.is_answered_by(&but(|r| r.held_modes = true)));
        assert!(!but(|r| r.held_modes = true).is_answered_by(&record));
        assert!(!record.is_answered_by(&but(|r| r.set.clear())));
        assert!(!record.is_answered_by(&but(|r| r.program_hash = "b".into())));
        assert!(!record.is_answered_by(&but(|r| r.inputs[0].blake3 = "1".into())));
    }
}
