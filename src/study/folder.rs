//! Folder of a case: case.json has the request, outcome.json how the run ended, summary.json its
//! results.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::cases::Case;
use crate::scene;
use crate::scene_files;
use crate::study_file::Study;
use crate::study_file::StudyError;
use crate::study_file::quantity::BLADE_FREQUENCY;
use dovetail_cache::fingerprint::{executable_hash, fingerprint};
use dovetail_export::journal::JOURNAL;
use dovetail_export::{read_json, write_json};

/// Options of a case, as far as its result depends on them: it lacks what it leaves out.
const NO_FIELDS: &str = "--no-fields";
const HELD_MODES: &str = "--held-modes";

/// File of the request of a case.
const CASE: &str = "case.json";

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
    pub case: String,
    /// Name of each parameter and label of its value.
    pub parameters: Vec<(String, String)>,
    /// `KEY=VALUE` texts.
    pub set: Vec<String>,
    /// Files that the case depends on, and the hashes of their bytes, in hexadecimals.
    pub inputs: Vec<(String, String)>,
    /// Words of the command that is run; with it the results can be reproduced by hand.
    pub command: Vec<String>,
}

/// Content of outcome.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutcomeRecord {
    /// Exit code; `None` if the process was ended by a signal.
    pub exit_code: Option<i32>,
    /// Wall time of the process, s.
    pub seconds: f64,
}

/// Cases of a study, and where and how they are run.
#[derive(Debug)]
pub struct StudyPlan {
    pub study: Study,
    pub cases: Vec<Case>,
    /// Folder of the study.
    pub out: PathBuf,
    /// Number of threads of each case.
    pub threads: u16,
    /// Options for the cache of meshes and reduced models, as words of the command line of each
    /// case.
    pub cache: Vec<String>,
}

impl StudyPlan {
    pub fn folder(&self, case: &Case) -> PathBuf {
        self.out.join("cases").join(&case.slug)
    }

    /// Options of a command about the scene with these overrides, whose results go into this
    /// folder.
    pub fn words(&self, set: &[String], folder: &Path) -> Vec<String> {
        let (folder, threads) = (folder.display().to_string(), self.threads.to_string());
        let set = set.iter().flat_map(|argument| ["--set", argument]);
        // The folder is the study's, whatever scene it held.
        let arguments = ["--out", &folder, "--force", "--threads", &threads];
        let cache = self.cache.iter().map(String::as_str);
        set.chain(arguments)
            .chain(cache)
            .map(str::to_owned)
            .collect()
    }

    /// Request of a case.
    ///
    /// # Errors
    /// The scene with the overrides of the case, or a file named by it, cannot be read.
    pub fn record(&self, case: &Case) -> Result<CaseRecord, StudyError> {
        let study = &self.study;
        let set = case.set(study);
        let scene = scene::load(&study.scene, &set)?;
        let held_modes = study.quantities.contains(&BLADE_FREQUENCY) && scene.assembly().is_some();
        let scene_file = study.scene.display().to_string();
        let mut command = vec!["dovetail".to_owned(), "run".to_owned(), scene_file];
        command.extend(self.words(&set, &self.folder(case)));
        command.extend((!study.fields).then(|| NO_FIELDS.to_owned()));
        command.extend(held_modes.then(|| HELD_MODES.to_owned()));
        let input = |file: PathBuf| {
            let hash = scene_files::hash_of_file(&file);
            let hash = hash.map_err(StudyError::io("reading", &file))?;
            Ok((file.display().to_string(), hash))
        };
        let files = std::iter::once(study.scene.clone()).chain(scene_files::files(&scene));
        let inputs: Result<_, StudyError> = files.map(input).collect();
        let hexadecimals = |hash: [u8; 32]| blake3::Hash::from_bytes(hash).to_hex().to_string();
        let program = executable_hash();
        let program = program.map_err(StudyError::io("reading", Path::new("dovetail")))?;
        let parameters = study.chosen(&case.values);
        let parameters = parameters.map(|(p, v)| (p.name.clone(), v.label.clone()));
        Ok(CaseRecord {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            program_hash: hexadecimals(program),
            machine_hash: fingerprint().map_or_else(String::new, hexadecimals),
            case: case.slug.clone(),
            parameters: parameters.collect(),
            set,
            inputs: inputs?,
            command,
        })
    }
}

impl CaseRecord {
    /// Record of the run in a folder, if its result is also one of this request.
    pub fn read_answered(&self, folder: &Path) -> Option<Self> {
        let earlier: Option<Self> = read_json(&folder.join(CASE));
        earlier.filter(|earlier| self.is_answered_by(earlier))
    }

    /// Returns `true` if a result of `earlier` is also a result of this request: paths, threads and
    /// the machine do not matter.
    fn is_answered_by(&self, earlier: &Self) -> bool {
        let asks = |r: &Self, option: &str| r.command.iter().any(|word| word == option);
        let contents = |r: &Self| -> Vec<String> { r.inputs.iter().map(|i| i.1.clone()).collect() };
        self.program_hash == earlier.program_hash
            && self.set == earlier.set
            && (asks(self, NO_FIELDS) || !asks(earlier, NO_FIELDS))
            && (asks(earlier, HELD_MODES) || !asks(self, HELD_MODES))
            && contents(self) == contents(earlier)
    }
}

/// Returns `true` if an interrupted run of the same case is in the folder, which can be resumed.
pub fn was_broken_off(record: &CaseRecord, folder: &Path) -> bool {
    let earlier = record.read_answered(folder);
    !record.machine_hash.is_empty()
        && earlier.is_some_and(|earlier| earlier.machine_hash == record.machine_hash)
        && folder.join(JOURNAL).exists()
}

/// Prepares the folder of a case for a run: removes outcome.json of an earlier run and writes
/// case.json.
pub fn prepare(record: &CaseRecord, folder: &Path) -> Result<(), StudyError> {
    let path = folder.join("outcome.json");
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(StudyError::io("removing", &path)(error))
        }
        _ => Ok(write_json(&folder.join(CASE), record)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> CaseRecord {
        CaseRecord {
            version: "1".into(),
            program_hash: "a".into(),
            machine_hash: "m".into(),
            case: "base".into(),
            parameters: vec![],
            set: vec!["a=1".into()],
            inputs: vec![("a".into(), "0".into())],
            command: vec![NO_FIELDS.into()],
        }
    }

    /// The last digits of a run depend on the machine.
    #[test]
    fn a_case_goes_on_only_on_such_a_machine_as_it_began_on() {
        let folder = tempfile::tempdir().unwrap();
        let record = record();
        prepare(&record, folder.path()).unwrap();
        assert!(!was_broken_off(&record, folder.path()));
        std::fs::write(folder.path().join(JOURNAL), "").unwrap();
        assert!(was_broken_off(&record, folder.path()));
        let mut elsewhere = record.clone();
        elsewhere.machine_hash = "n".into();
        assert!(!was_broken_off(&elsewhere, folder.path()));
        // A program that cannot read itself does not know its own results.
        let mut unknown = record.clone();
        unknown.machine_hash.clear();
        prepare(&unknown, folder.path()).unwrap();
        assert!(!was_broken_off(&unknown, folder.path()));
    }

    #[test]
    fn a_result_counts_for_what_asks_no_more() {
        let record = record();
        let but = |change: fn(&mut CaseRecord)| {
            let mut other = record.clone();
            change(&mut other);
            other
        };
        assert!(record.is_answered_by(&but(|r| r.inputs[0].0 = "b/a".into())));
        assert!(record.is_answered_by(&but(|r| r.machine_hash = "n".into())));
        let with_modes = but(|r| r.command.push(HELD_MODES.into()));
        assert!(record.is_answered_by(&with_modes) && !with_modes.is_answered_by(&record));
        let with_fields = but(|r| r.command.clear());
        assert!(record.is_answered_by(&with_fields) && !with_fields.is_answered_by(&record));
        assert!(!record.is_answered_by(&but(|r| r.set.clear())));
        assert!(!record.is_answered_by(&but(|r| r.program_hash = "b".into())));
        assert!(!record.is_answered_by(&but(|r| r.inputs[0].1 = "1".into())));
    }
}
