//! The folder of a case: case.json says what was asked, outcome.json how it ended, summary.json
//! what came out.
//!
//! A case is complete when its program ended with a result (exit code 0 or 3) and case.json asks
//! what would be asked now: the same program, overrides and input files, byte for byte.

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

/// case.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseRecord {
    /// Of the program.
    pub version: String,
    /// Of the program's file, in hexadecimals. Its libraries and the processor are left out: cases
    /// may run on several machines.
    pub program_hash: String,
    /// Of the program, its libraries and the processor, in hexadecimals; empty where the system does not tell. The
    /// last digits depend on them: a case goes on only where they are the same.
    pub machine_hash: String,
    pub study: String,
    pub case: String,
    /// Parameter and label of its value.
    pub parameters: Vec<(String, String)>,
    /// `KEY=VALUE` texts.
    pub set: Vec<String>,
    pub fields: bool,
    pub held_modes: bool,
    pub inputs: Vec<Input>,
    /// What is run; with it the folder can be made by hand.
    pub command: Vec<String>,
}

/// A file the case depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    pub file: String,
    /// Hash of its bytes, in hexadecimals.
    pub blake3: String,
}

/// outcome.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutcomeRecord {
    /// `None`: ended by a signal.
    pub exit_code: Option<i32>,
    /// Wall clock of the process, s.
    pub seconds: f64,
}

/// How cases are run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Of the study.
    pub out: PathBuf,
    /// Of each case.
    pub threads: u16,
    /// What each case is told of the cache of meshes and reduced models, as words of the command
    /// line.
    pub cache: Vec<String>,
}

impl Settings {
    pub fn folder(&self, case: &Case) -> PathBuf {
        self.out.join("cases").join(&case.slug)
    }

    /// The options of a command about the scene with these overrides, whose results are in this folder.
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

/// What a case asks for.
///
/// # Errors
/// The scene with the overrides of the case, or a file it names that cannot be read.
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

/// The scene file and the files it names.
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
    /// Whether a result of `earlier` is a result of this, too: paths, threads and the machine do not matter.
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

/// What stands in the folder of a case.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    Complete(Box<Summary>),
    /// Ended without a result.
    Failed {
        exit_code: Option<i32>,
        message: String,
    },
    /// Never run to its end, or with other settings; a summary that is none.
    Nothing,
}

/// Reads the folder of a case.
///
/// # Errors
/// A file that is there but cannot be read or understood.
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

/// Whether a run of the same case was broken off in the folder: it can be resumed.
///
/// # Errors
/// A file that is there but cannot be read or understood.
pub fn was_broken_off(record: &CaseRecord, folder: &Path) -> Result<bool, StudyError> {
    let earlier: Option<Value> = read_json(&folder.join("case.json"))?;
    let earlier = earlier.and_then(|record| CaseRecord::deserialize(record).ok());
    let is_same = earlier.is_some_and(|earlier| {
        record.is_answered_by(&earlier) && record.machine_hash == earlier.machine_hash
    });
    Ok(is_same && folder.join(JOURNAL).exists())
}

/// Makes the folder of a case ready for a run: what an earlier one left of its end is taken away,
/// case.json is written.
pub fn prepare(record: &CaseRecord, folder: &Path) -> Result<(), StudyError> {
    remove_outcome(folder)?;
    write_json(&folder.join("case.json"), record)
}

/// Removes the cases of this study that an earlier definition of it had and this one has not: the
/// files that they wrote, and their folders where nothing else stands in them. A case that is
/// running stays. Gives their names.
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

/// Takes away what an earlier run says of its end.
pub fn remove_outcome(folder: &Path) -> Result<(), StudyError> {
    remove(&folder.join("outcome.json"))
}

/// Removes a file, where it is there.
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

/// `None` where there is no such file.
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

/// Why the case in a folder failed: what its summary.json says, else the last line of its
/// log.
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
