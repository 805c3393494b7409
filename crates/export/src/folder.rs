//! Output folder of a run: which run it belongs to, which files the run writes, and which files an
//! earlier run left.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use super::journal::JOURNAL;
use super::manifest::{RunState, Summary};
use super::{ExportError, create_folder, name_of_part, read_json, write_file, write_json};
use dovetail_superelement::input;

const SUMMARY: &str = "summary.json";

/// Treatment of a folder that holds the run of another scene or of other settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherScene {
    /// The run is an error.
    Refuse,
    /// The files of the other run are removed.
    Replace,
}

/// Use of the folder by a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beginning {
    /// A run that begins with the first frequency.
    Anew,
    /// A run that solves the frequencies that an interrupted run has not solved.
    Resumed,
    /// A command that puts files beside those of a run of the same scene and settings, whose
    /// figures stay.
    Beside,
}

/// Folder with the files of one run. Every file that goes into it is requested by name
/// ([`OutputFolder::file`]), so that summary.json lists it before it is written: what a killed run
/// leaves is known to the next one.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// Content of summary.json.
    said: RefCell<Summary>,
    /// Names of the written files, with `/` between folders.
    written: RefCell<BTreeSet<String>>,
    /// Names of the files that the summary of an earlier run lists.
    earlier: BTreeSet<String>,
    /// True if the earlier files are of the same scene and settings; they stay.
    keeps: bool,
    /// Summary of the run whose figures stay.
    run: Option<Box<Summary>>,
    /// Bytes of the summary of an earlier run that is finished.
    finished: Option<Vec<u8>>,
}

impl OutputFolder {
    /// Takes over the folder and says so in summary.json. `summary` is the summary of a command
    /// that begins. `to_resume`: there are solved frequencies to continue from.
    ///
    /// # Errors
    /// A folder that cannot be created or written; a folder that holds the run of a scene of
    /// another name; a folder of other settings, if files are to be put beside that run or the run
    /// is to be resumed.
    pub fn open(
        path: &Path,
        summary: &Summary,
        other: OtherScene,
        beginning: Beginning,
        to_resume: bool,
    ) -> Result<Self, ExportError> {
        create_folder(path)?;
        let bytes = input::bytes(&path.join(SUMMARY)).ok();
        let earlier = bytes.as_deref().map(serde_json::from_slice::<Summary>);
        let earlier = earlier.and_then(Result::ok);
        let is_same = |earlier: &Summary| earlier.scene.is_same_scene(&summary.scene);
        if let Some(earlier) = &earlier {
            let refuses = other == OtherScene::Refuse;
            if refuses && earlier.scene.name != summary.scene.name {
                return Err(ExportError::OtherScene {
                    path: path.to_path_buf(),
                    scene: summary.scene.name.clone(),
                    other: earlier.scene.name.clone(),
                });
            }
            if refuses && beginning == Beginning::Beside && earlier.is_of_run() && !is_same(earlier)
            {
                return Err(ExportError::OtherSettings {
                    path: path.to_path_buf(),
                });
            }
            let goes_on = is_same(earlier) && earlier.program_blake3 == summary.program_blake3;
            if beginning == Beginning::Resumed && to_resume {
                check_journal(summary, &path.join(JOURNAL))?;
            }
            if beginning == Beginning::Resumed && to_resume && !goes_on {
                return Err(ExportError::OtherInputs {
                    path: path.join(JOURNAL),
                });
            }
        }
        let keeps = beginning == Beginning::Beside && earlier.as_ref().is_some_and(is_same);
        let files = earlier.as_ref().map_or_else(Vec::new, |s| s.files.clone());
        let is_finished = |earlier: &Summary| earlier.state == RunState::Finished;
        let finished = bytes.filter(|_| earlier.as_ref().is_some_and(is_finished));
        let run = earlier.filter(|earlier| keeps && earlier.is_of_run());
        let folder = Self {
            path: path.to_path_buf(),
            said: RefCell::new(run.clone().unwrap_or_else(|| summary.clone())),
            written: RefCell::default(),
            earlier: files.into_iter().collect(),
            keeps,
            run: run.map(Box::new),
            finished,
        };
        folder.write_summary(summary.clone(), RunState::Running, None)?;
        Ok(folder)
    }

    /// Returns `true` if the figures of summary.json are those of a run beside whose files others
    /// are put.
    pub fn is_beside_run(&self) -> bool {
        self.run.is_some()
    }

    /// Path of the file of this name; the run lists it.
    ///
    /// # Errors
    /// A summary.json that cannot be written.
    pub fn file(&self, name: &str) -> Result<PathBuf, ExportError> {
        self.list([name.to_owned()])?;
        Ok(self.path.join(name))
    }

    /// Lists files that are about to be written in the folder by other means.
    ///
    /// # Errors
    /// A summary.json that cannot be written.
    pub fn list(&self, names: impl IntoIterator<Item = String>) -> Result<(), ExportError> {
        let before = self.written.borrow().len();
        self.written.borrow_mut().extend(names);
        if self.written.borrow().len() == before {
            return Ok(());
        }
        let said = self.said.borrow().clone();
        let (state, why) = (said.state, said.why.clone());
        self.write_summary(said, state, why)
    }

    /// Names of the files in the folder. If a run is under way, they include the files that it is
    /// about to write.
    pub fn files(&self, state: RunState) -> Vec<String> {
        let written = self.written.borrow();
        let names = self.earlier.union(&written);
        let is_there = |name: &&String| state == RunState::Running || self.path.join(name).exists();
        names.filter(is_there).cloned().collect()
    }

    /// Returns `true` if summary.json says that the run is under way.
    pub fn is_running(&self) -> bool {
        self.said.borrow().state == RunState::Running
    }

    /// Puts the summary of an earlier, finished run back, and says whether it did. This run must have
    /// listed no files but those named `under_way`, which are not results.
    pub fn restore_summary(&self, under_way: &[&str]) -> bool {
        let written = self.written.borrow();
        let has_results = written.iter().any(|name| !under_way.contains(&&**name));
        let Some(finished) = self.finished.as_ref().filter(|_| !has_results) else {
            return false;
        };
        let is_back = write_file(&self.path.join(SUMMARY), finished).is_ok();
        if is_back {
            self.said.borrow_mut().state = RunState::Finished;
        }
        is_back
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes the files that an earlier run listed and this one has not written, and incomplete
    /// files of either run. Nothing is removed beside files of the same scene and settings.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove_earlier(&mut self) -> Result<(), ExportError> {
        if self.keeps {
            return Ok(());
        }
        remove_files(&self.path, self.earlier.difference(self.written.get_mut()))?;
        self.remove_parts()?;
        self.earlier.clear();
        Ok(())
    }

    fn remove_parts(&mut self) -> Result<(), ExportError> {
        let written = self.written.get_mut();
        let ours = |name: &str| written.contains(name) || self.earlier.contains(name);
        let parent = |name: &String| Path::new(name).parent().map(Path::to_path_buf);
        let written_here = written
            .iter()
            .chain(&self.earlier)
            .filter(|name| is_inside(name));
        let folders: BTreeSet<PathBuf> = written_here.filter_map(parent).collect();
        for folder in folders {
            let Ok(entries) = fs::read_dir(self.path.join(&folder)) else {
                continue;
            };
            for path in entries.flatten().map(|entry| entry.path()) {
                let name = path.file_name().and_then(|name| name.to_str());
                let whole = name.and_then(name_of_part);
                let whole = whole.map(|whole| folder.join(whole).display().to_string());
                if whole.is_some_and(|whole| ours(&whole)) {
                    fs::remove_file(&path)
                        .map_err(|source| ExportError::RemoveOld { path, source })?;
                }
            }
        }
        Ok(())
    }

    /// Writes summary.json with the state of the run and the files of the folder: its own, and
    /// those of an earlier run that are still there. If the run is under way, they include the
    /// files that it is about to write. Beside a run, the summary of that run stays, with the
    /// further findings of the command.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_summary(
        &self,
        mut summary: Summary,
        state: RunState,
        why: Option<String>,
    ) -> Result<(), ExportError> {
        summary.state = state;
        summary.why = why;
        if let Some(run) = &self.run {
            summary = run.merge_findings(summary);
        }
        summary.files = self.files(state);
        write_json(&self.path.join(SUMMARY), &summary)?;
        *self.said.borrow_mut() = summary;
        Ok(())
    }
}

/// Checks that a program that begins with this summary can tell whether the results of a journal are
/// its own.
///
/// # Errors
/// [`ExportError::UnknownProgram`].
pub fn check_journal(summary: &Summary, journal: &Path) -> Result<(), ExportError> {
    match summary.program_blake3 {
        Some(_) => Ok(()),
        None => Err(ExportError::UnknownProgram {
            path: journal.to_path_buf(),
        }),
    }
}

/// Sentence about how to go on after an interruption. `goes_on` is the rest of the sentence if the
/// program knows itself.
pub fn continuation_hint(summary: &Summary, goes_on: &str) -> String {
    match summary.program_blake3 {
        Some(_) => format!("The same command with --resume {goes_on}"),
        None => "--resume cannot go on with them: the program cannot read the file that it was started from, and cannot check \
                 whether they belong to it"
            .to_owned(),
    }
}

/// Marks summary.json as that of a failed run, whichever process has the folder. It serves the end
/// of a process whose threads no longer work. Errors of writing are ignored.
pub fn mark_failed(path: &Path, why: String) {
    let file = path.join(SUMMARY);
    let Some(mut summary) = read_json::<Summary>(&file) else {
        return;
    };
    if summary.state == RunState::Running {
        (summary.state, summary.why) = (RunState::Failed, Some(why));
        let _ = write_json(&file, &summary);
    }
}

/// Removes files of a folder, and the folders below it that become empty.
fn remove_files<'n>(
    folder: &Path,
    names: impl IntoIterator<Item = &'n String>,
) -> Result<(), ExportError> {
    // A list that somebody has edited leads nowhere else.
    for name in names.into_iter().filter(|name| is_inside(name)) {
        let path = folder.join(name);
        match fs::remove_file(&path) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                return Err(ExportError::RemoveOld { path, source });
            }
            _ => {}
        }
        // A folder that is empty now was one of that run's; any other stays.
        let parent = path.parent().filter(|parent| *parent != folder);
        if let Some(parent) = parent {
            let _ = fs::remove_dir(parent);
        }
    }
    Ok(())
}

/// Returns `true` if a listed name stays below the folder.
fn is_inside(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    parts.all(|part| matches!(part, std::path::Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::{ResponseSummary, SceneSummary};
    use dovetail_testkit::folder::Folder;

    fn summary(scene: &str) -> Summary {
        Summary {
            scene: SceneSummary {
                name: scene.to_owned(),
                file: format!("{scene}.toml"),
                blake3: Some(format!("hash of {scene}")),
            },
            program_blake3: Some("hash of the program".to_owned()),
            ..Summary::default()
        }
    }

    fn open(path: &Path, scene: &str, other: OtherScene) -> Result<OutputFolder, ExportError> {
        OutputFolder::open(path, &summary(scene), other, Beginning::Anew, false)
    }

    fn write(folder: &OutputFolder, names: &[&str]) {
        for name in names {
            super::super::write_file(&folder.file(name).unwrap(), name.as_bytes()).unwrap();
        }
    }

    #[test]
    fn a_run_without_results_puts_the_summary_of_a_finished_one_back() {
        let folder = Folder::new("folder-back");
        let first = open(&folder, "a", OtherScene::Refuse).unwrap();
        write(&first, &["response.csv"]);
        first
            .write_summary(summary("a"), RunState::Finished, None)
            .unwrap();
        let bytes = || fs::read(folder.join(SUMMARY)).unwrap();
        let finished = bytes();
        let second = open(&folder, "a", OtherScene::Refuse).unwrap();
        second.list(["journal".to_owned()]).unwrap();
        assert_ne!(bytes(), finished);
        assert!(second.restore_summary(&["journal"]));
        assert_eq!(bytes(), finished);
        let third = open(&folder, "a", OtherScene::Refuse).unwrap();
        write(&third, &["response.csv"]);
        assert!(!third.restore_summary(&["journal"]));
        assert_ne!(bytes(), finished);
    }

    fn names(path: &Path) -> Vec<String> {
        let mut found = Vec::new();
        let mut folders = vec![path.to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap().flatten() {
                match entry.path() {
                    inner if inner.is_dir() => folders.push(inner),
                    file => found.push(file.strip_prefix(path).unwrap().display().to_string()),
                }
            }
        }
        found.sort();
        found
    }

    #[test]
    fn what_a_killed_run_had_half_written_goes_and_nothing_else() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let first = open(path, "a", OtherScene::Refuse).unwrap();
        write(&first, &["response.csv", "flank/flank_0000.vtu"]);
        first
            .write_summary(summary("a"), RunState::Running, None)
            .unwrap();
        let others = [
            "notes.txt.c3zfaF.part",
            "response.csv.c3zfa.part",
            "response.csv.part",
        ];
        let ours = [
            "flank/flank_0000.vtu.c3zfaF.part",
            "flank/flank_0001.vtu.aaaaaa.part",
            "response.csv.0123ab.part",
        ];
        for name in others.iter().chain(&ours) {
            fs::write(path.join(name), "half").unwrap();
        }
        let mut second = open(path, "a", OtherScene::Refuse).unwrap();
        write(&second, &["flank/flank_0000.vtu", "flank/flank_0001.vtu"]);
        second.remove_earlier().unwrap();
        let left = [
            "flank/flank_0000.vtu",
            "flank/flank_0001.vtu",
            others[0],
            others[1],
            others[2],
            SUMMARY,
        ];
        assert_eq!(names(path), left);
    }

    #[test]
    fn a_list_leads_to_nothing_outside_of_the_folder() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path().join("out");
        fs::create_dir(&path).unwrap();
        let outside = temporary.path().join("precious");
        fs::write(&outside, "x").unwrap();
        let mut edited = summary("a");
        edited.files = vec!["../precious".into(), outside.display().to_string()];
        write_json(&path.join(SUMMARY), &edited).unwrap();
        let mut folder = open(&path, "a", OtherScene::Refuse).unwrap();
        folder.remove_earlier().unwrap();
        assert!(outside.exists());
    }

    /// Summary of a run, with a figure.
    fn run_summary(scene: &str) -> Summary {
        Summary {
            response: Some(ResponseSummary::default()),
            ..summary(scene)
        }
    }

    fn sibling_folder(path: &Path, summary: &Summary) -> Result<OutputFolder, ExportError> {
        OutputFolder::open(path, summary, OtherScene::Refuse, Beginning::Beside, false)
    }

    #[test]
    fn the_figures_of_a_run_stay_where_files_are_put_beside_it() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let run = open(path, "a", OtherScene::Refuse).unwrap();
        write(&run, &["response.csv"]);
        let finished = RunState::Finished;
        run.write_summary(run_summary("a"), finished, None).unwrap();
        let mut modes = sibling_folder(path, &summary("a")).unwrap();
        assert!(modes.is_beside_run());
        let said = || read_json::<Summary>(&path.join(SUMMARY)).unwrap();
        assert_eq!(said().response, run_summary("a").response);
        write(&modes, &["modes.vtu"]);
        // A command that fails, or is killed here, leaves the run's word.
        modes
            .write_summary(summary("a"), RunState::Failed, Some("why".to_owned()))
            .unwrap();
        assert_eq!((said().state, said().why), (finished, None));
        modes.remove_earlier().unwrap();
        let found = Summary {
            blade_frequency_hz: Some(7.0),
            ..summary("a")
        };
        modes.write_summary(found, finished, None).unwrap();
        assert_eq!(said().response, run_summary("a").response);
        assert_eq!(said().blade_frequency_hz, Some(7.0));
        assert_eq!(said().files, ["modes.vtu", "response.csv"]);
        // Of other settings they would be files of no run.
        let mut other = summary("a");
        other.scene.blake3 = Some("another".to_owned());
        let refused = sibling_folder(path, &other).unwrap_err();
        assert!(refused.to_string().contains("--out"), "{refused}");
        assert_eq!(said().files, ["modes.vtu", "response.csv"]);
    }

    #[test]
    fn without_a_run_what_is_of_other_settings_is_replaced() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let finished = RunState::Finished;
        let mesh = sibling_folder(path, &summary("a")).unwrap();
        write(&mesh, &["mesh.msh"]);
        mesh.write_summary(summary("a"), finished, None).unwrap();
        let mut modes = sibling_folder(path, &summary("a")).unwrap();
        write(&modes, &["modes.vtu"]);
        modes.remove_earlier().unwrap();
        modes.write_summary(summary("a"), finished, None).unwrap();
        assert_eq!(names(path), ["mesh.msh", "modes.vtu", SUMMARY]);
        let mut other = summary("a");
        other.scene.blake3 = Some("another".to_owned());
        let mut mesh = sibling_folder(path, &other).unwrap();
        write(&mesh, &["mesh.msh"]);
        mesh.remove_earlier().unwrap();
        mesh.write_summary(other, finished, None).unwrap();
        assert_eq!(names(path), ["mesh.msh", SUMMARY]);
    }

    #[test]
    fn a_file_is_listed_before_it_is_written() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let run = open(path, "a", OtherScene::Refuse).unwrap();
        run.list(["flank/flank_0000.vtu", "flank/flank_0001.vtu"].map(str::to_owned))
            .unwrap();
        run.file("response.csv").unwrap();
        let listed = || read_json::<Summary>(&path.join(SUMMARY)).unwrap().files;
        let all = [
            "flank/flank_0000.vtu",
            "flank/flank_0001.vtu",
            "response.csv",
        ];
        assert_eq!(listed(), all);
        // Killed here, with one of them written.
        fs::create_dir(path.join("flank")).unwrap();
        fs::write(path.join(all[0]), "x").unwrap();
        let mut next = open(path, "a", OtherScene::Refuse).unwrap();
        next.remove_earlier().unwrap();
        assert_eq!(names(path), [SUMMARY]);
        assert!(!path.join("flank").exists());
        // What a run that has ended lists is there.
        next.file("response.csv").unwrap();
        next.write_summary(summary("a"), RunState::Finished, None)
            .unwrap();
        assert_eq!(listed(), Vec::<String>::new());
    }

    #[test]
    fn a_run_of_other_inputs_is_not_resumed_and_its_folder_stays() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let broken = open(path, "a", OtherScene::Refuse).unwrap();
        write(&broken, &["static.csv"]);
        let mut changed = summary("a");
        changed.scene.blake3 = Some("another".to_owned());
        let mut rebuilt = summary("a");
        rebuilt.program_blake3 = Some("another".to_owned());
        let before = fs::read(path.join(SUMMARY)).unwrap();
        let resume = |summary: &Summary, to_resume: bool| {
            let refuse = OtherScene::Refuse;
            OutputFolder::open(path, summary, refuse, Beginning::Resumed, to_resume)
        };
        for other in [changed.clone(), rebuilt] {
            let refused = resume(&other, true).unwrap_err();
            assert!(refused.to_string().contains("other inputs"), "{refused}");
            assert_eq!(fs::read(path.join(SUMMARY)).unwrap(), before);
        }
        assert!(resume(&summary("a"), true).is_ok());
        // Without a frequency there is nothing that the inputs could differ from.
        assert!(resume(&changed, false).is_ok());
    }

    /// Two programs that cannot read their own files are not known to be the same.
    #[test]
    fn a_program_that_does_not_know_itself_resumes_nothing_and_says_so() {
        let mut unknown = summary("a");
        unknown.program_blake3 = None;
        for earlier in [&summary("a"), &unknown] {
            let temporary = tempfile::tempdir().unwrap();
            let path = temporary.path();
            let (refuse, anew) = (OtherScene::Refuse, Beginning::Anew);
            OutputFolder::open(path, earlier, refuse, anew, false).unwrap();
            let before = fs::read(path.join(SUMMARY)).unwrap();
            let resumed = OutputFolder::open(path, &unknown, refuse, Beginning::Resumed, true);
            let refused = resumed.unwrap_err();
            assert!(
                matches!(refused, ExportError::UnknownProgram { .. }),
                "{refused}"
            );
            assert_eq!(fs::read(path.join(SUMMARY)).unwrap(), before);
        }
        let goes_on = "The same command with --resume goes on with the others";
        assert_eq!(
            continuation_hint(&summary("a"), "goes on with the others"),
            goes_on
        );
        let way_on = continuation_hint(&unknown, "goes on with the others");
        assert!(way_on.starts_with("--resume cannot go on"), "{way_on}");
        assert!(!way_on.contains("with the others"), "{way_on}");
    }
}
