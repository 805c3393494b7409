//! Scene with its files in a folder, without a command line.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dovetail::cache::Cache;
use dovetail::commands::Work;
use dovetail::export::folder::OtherScene;
use dovetail::files::{Beginning, Files, Output, SharedFiles};
use dovetail::reporter::Reporter;
use dovetail_solver::description::Scene;

/// Work on a scene that writes its files into `folder`, with fields, and has no cache.
pub fn in_folder<'a>(
    scene: &'a Scene,
    scene_file: PathBuf,
    folder: &Path,
) -> (Work<'a>, Arc<SharedFiles>) {
    let output = Output {
        folder: folder.to_path_buf(),
        scene_file,
        fields: true,
        frames: None,
        further_plots: Vec::new(),
    };
    let files = Files::open(scene, &output, OtherScene::Refuse, Beginning::Anew).unwrap();
    let files = SharedFiles::new(files);
    let work = Work {
        scene,
        folder: output.folder,
        cache: Cache::new(None),
        files: Some(files.clone()),
        reporter: Reporter::silent(Some(files.clone())),
    };
    (work, files)
}
