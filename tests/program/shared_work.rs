//! Scene with its files in a folder, and the model of the paper's scene, without a command line.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dovetail::commands::Workspace;
use dovetail::files::{Output, RunFiles, SharedFiles};
use dovetail::mesh_files;
use dovetail::reporter::Reporter;
use dovetail::scene;
use dovetail_cache::Cache;
use dovetail_export::folder::{Beginning, OtherScene};
use dovetail_solver::description::Scene;
use dovetail_solver::model::{MeshKind, Model, bind};
use dovetail_testkit::folder::root;

/// The paper's scene on a ready mesh, and its model.
pub fn paper(mesh: &str, overrides: &[String]) -> (Scene, Model) {
    let mesh = [format!("mesh.file=../meshes/{mesh}")];
    let scene = root().join("scenes/paper.toml");
    let scene = scene::load(&scene, &[&mesh[..], overrides].concat()).unwrap();
    let assembly = scene.assembly().unwrap();
    let source = assembly.mesh.as_ref().unwrap();
    let MeshKind::File { path } = &source.kind else {
        panic!("the ready mesh was asked for");
    };
    let mesh = mesh_files::read(path, source.units).unwrap();
    let model = bind(assembly, &mesh, None).unwrap();
    (scene, model)
}

/// Work on a scene that writes its files into `folder`, with fields, and has no cache.
pub fn workspace<'a>(
    scene: &'a Scene,
    scene_file: PathBuf,
    folder: &Path,
) -> (Workspace<'a>, Arc<SharedFiles>) {
    let output = Output {
        folder: folder.to_path_buf(),
        scene_file,
        overrides: Vec::new(),
        fields: true,
        frames: None,
        whole_disc: false,
        stress_points: false,
        further_plots: Vec::new(),
    };
    let files = RunFiles::open(scene, &output, OtherScene::Refuse, Beginning::Anew).unwrap();
    let files = SharedFiles::new(files);
    let work = Workspace {
        scene,
        folder: output.folder,
        cache: Cache::new(None),
        files: Some(files.clone()),
        reporter: Reporter::silent(Some(files.clone())),
    };
    (work, files)
}
