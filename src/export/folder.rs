//! The folder of a run: whose it is, which files in it the run wrote, and which an earlier run left.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::manifest::{self, RunState, Summary};
use super::{ExportError, create_folder, name_of_part};

const SUMMARY: &str = "summary.json";

/// What to do about a folder that holds the run of another scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherScene {
    Refuse,
    Replace,
}

/// A folder with the files of one run. Every file that goes into it is asked for by name
/// ([`OutputFolder::file`]), so that summary.json can list them.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// Names of files, with `/` between folders.
    written: RefCell<BTreeSet<String>>,
    /// Those that the summary of an earlier run lists.
    earlier: BTreeSet<String>,
}

impl OutputFolder {
    /// Takes the folder for a run, which it says in summary.json: `summary` is that of a run that begins.
    ///
    /// # Errors
    /// A folder that cannot be made or written; one that holds the run of a scene of another name.
    pub fn open(path: &Path, summary: &Summary, other: OtherScene) -> Result<Self, ExportError> {
        create_folder(path)?;
        let earlier = manifest::read_summary(&path.join(SUMMARY));
        let scene = &summary.scene.name;
        if let Some(earlier) = &earlier
            && earlier.scene.name != *scene
            && other == OtherScene::Refuse
        {
            return Err(ExportError::OtherScene {
                path: path.to_path_buf(),
                scene: scene.clone(),
                other: earlier.scene.name.clone(),
            });
        }
        let folder = Self {
            path: path.to_path_buf(),
            written: RefCell::default(),
            earlier: earlier.map_or_else(BTreeSet::new, |s| s.files.into_iter().collect()),
        };
        folder.write_summary(summary.clone(), RunState::Running, None)?;
        Ok(folder)
    }

    /// Where the file of this name goes; the run lists it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.wrote(std::iter::once(name.to_owned()));
        self.path.join(name)
    }

    /// Lists files that were written in it by another way.
    pub fn wrote(&self, names: impl IntoIterator<Item = String>) {
        self.written.borrow_mut().extend(names);
    }

    /// Lists a file no longer, which is gone.
    pub fn forget(&self, name: &str) {
        self.written.borrow_mut().remove(name);
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes the files that an earlier run listed and this one has not written, and what a run that was killed had
    /// half written of the files of both.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove_earlier(&mut self) -> Result<(), ExportError> {
        for name in self.earlier.difference(self.written.get_mut()) {
            // A list that somebody has edited leads nowhere else.
            if !is_inside(name) {
                continue;
            }
            let path = self.path.join(name);
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(ExportError::RemoveOld { path, source });
                }
                _ => {}
            }
            // A folder that is empty now was one of that run's; any other stays.
            let parent = path.parent().filter(|parent| *parent != self.path);
            if let Some(parent) = parent {
                let _ = fs::remove_dir(parent);
            }
        }
        self.remove_parts()?;
        self.earlier.clear();
        Ok(())
    }

    fn remove_parts(&mut self) -> Result<(), ExportError> {
        let written = self.written.get_mut();
        let ours = |name: &str| written.contains(name) || self.earlier.contains(name);
        let parent = |name: &String| Path::new(name).parent().map(Path::to_path_buf);
        let own = written
            .iter()
            .chain(&self.earlier)
            .filter(|name| is_inside(name));
        let folders: BTreeSet<PathBuf> = own.filter_map(parent).collect();
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

    /// Writes summary.json with the state of the run and the files of the folder: its own, and those of an earlier
    /// run that are still there.
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
        summary.files = self
            .earlier
            .union(&self.written.borrow())
            .cloned()
            .collect();
        manifest::write_summary(&self.path.join(SUMMARY), &summary)
    }
}

/// Whether a name of a list stays below the folder.
fn is_inside(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    parts.all(|part| matches!(part, std::path::Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::manifest::SceneSummary;

    fn summary(scene: &str) -> Summary {
        Summary {
            scene: SceneSummary {
                name: scene.to_owned(),
                file: format!("{scene}.toml"),
            },
            ..Summary::default()
        }
    }

    fn write(folder: &OutputFolder, names: &[&str]) {
        for name in names {
            super::super::write_file(&folder.file(name), name.as_bytes()).unwrap();
        }
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
    fn a_second_run_leaves_nothing_of_the_first_and_everything_else() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let first = OutputFolder::open(path, &summary("a"), OtherScene::Refuse).unwrap();
        write(
            &first,
            &[
                "response.csv",
                "flank/flank_0000.vtu",
                "flank/flank_0001.vtu",
            ],
        );
        let finished = RunState::Finished;
        first.write_summary(summary("a"), finished, None).unwrap();
        for own in ["notes.txt", "flank_of_mine.vtu"] {
            fs::write(path.join(own), "mine").unwrap();
        }
        let mut second = OutputFolder::open(path, &summary("a"), OtherScene::Refuse).unwrap();
        let running = manifest::read_summary(&path.join(SUMMARY)).unwrap();
        assert_eq!(running.state, RunState::Running);
        // A run that is killed here still lists what the first one left.
        assert_eq!(running.files.len(), 3);
        write(&second, &["static.csv", "flank/flank_0000.vtu"]);
        second.remove_earlier().unwrap();
        let left = [
            "flank/flank_0000.vtu",
            "flank_of_mine.vtu",
            "notes.txt",
            "static.csv",
        ];
        assert_eq!(names(path), [&left[..], &[SUMMARY]].concat());
        second.write_summary(summary("a"), finished, None).unwrap();
        let listed = manifest::read_summary(&path.join(SUMMARY)).unwrap().files;
        assert_eq!(listed, ["flank/flank_0000.vtu", "static.csv"]);
        // A folder that is left without files goes, too.
        let mut third = OutputFolder::open(path, &summary("a"), OtherScene::Refuse).unwrap();
        third.remove_earlier().unwrap();
        assert_eq!(names(path), ["flank_of_mine.vtu", "notes.txt", SUMMARY]);
        assert!(!path.join("flank").exists());
    }

    #[test]
    fn what_a_killed_run_had_half_written_goes_and_nothing_else() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let first = OutputFolder::open(path, &summary("a"), OtherScene::Refuse).unwrap();
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
        let mut second = OutputFolder::open(path, &summary("a"), OtherScene::Refuse).unwrap();
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
    fn the_folder_of_another_scene_is_taken_only_where_that_is_asked_for() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path();
        let first = OutputFolder::open(path, &summary("a"), OtherScene::Refuse).unwrap();
        write(&first, &["response.csv"]);
        first
            .write_summary(summary("a"), RunState::Finished, None)
            .unwrap();
        let refused = OutputFolder::open(path, &summary("b"), OtherScene::Refuse).unwrap_err();
        assert!(refused.to_string().contains("--force"), "{refused}");
        let untouched = manifest::read_summary(&path.join(SUMMARY)).unwrap();
        assert_eq!(untouched.scene.name, "a");
        let mut other = OutputFolder::open(path, &summary("b"), OtherScene::Replace).unwrap();
        other.remove_earlier().unwrap();
        assert_eq!(names(path), [SUMMARY]);
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
        manifest::write_summary(&path.join(SUMMARY), &edited).unwrap();
        let mut folder = OutputFolder::open(&path, &summary("a"), OtherScene::Refuse).unwrap();
        folder.remove_earlier().unwrap();
        assert!(outside.exists());
    }
}
