//! Finds the files that a scene names, and determines whether two runs have the same inputs.

use std::io;
use std::path::{Path, PathBuf};

use crate::mesh_files;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::model::MeshKind;
use dovetail_solver::model::{BodyMesh, MatrixSource};
use dovetail_superelement::input;

/// Files that a scene names: meshes or their script, matrices, fields, the aerodynamic influence, the
/// files of a reduced model. A ready mesh that does not exist is left out, as it is needed only if
/// gmsh is missing.
pub fn files(scene: &Scene) -> Vec<PathBuf> {
    let assembly = match &scene.subject {
        Subject::ReducedModel(spec) => return dovetail_superelement::files(&spec.folder),
        Subject::Assembly(assembly) => assembly,
    };
    let mut files = Vec::new();
    match assembly.mesh.as_ref().map(|mesh| &mesh.kind) {
        None => {}
        Some(MeshKind::File { path }) => files.extend(mesh_files::files(path)),
        Some(MeshKind::Geometry {
            script, fallback, ..
        }) => {
            files.push(script.clone());
            files.extend(fallback.clone().filter(|file| file.is_file()));
        }
    }
    for body in &assembly.bodies {
        if let BodyMesh::File { path, .. } = &body.mesh {
            files.extend(mesh_files::files(path));
        }
        if let MatrixSource::Files(named) = &body.matrices {
            files.extend(named.paths().map(Path::to_path_buf));
        }
    }
    files.extend(assembly.field_files().map(Path::to_path_buf));
    files.extend(assembly.influence_file().map(Path::to_path_buf));
    files
}

/// Hash of the bytes of a file, in hexadecimals.
///
/// # Errors
/// A file that cannot be read, or is not a regular file.
pub fn hash_of_file(file: &Path) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    io::copy(&mut input::open(file)?, &mut hasher)?;
    Ok(hasher.finalize().to_string())
}

/// Hash of a scene as it was read and of the files that it names, in hexadecimals. Paths are
/// relative to the folder of the file of the scene. A file that cannot be read is ignored here; it
/// is reported where it is needed.
pub fn hash(scene: &Scene, scene_file: &Path) -> String {
    let mut hasher = blake3::Hasher::new();
    // Numbers are written so that they read back to the bit.
    let text = format!("{scene:?}");
    let folder = scene_file.parent().map_or(String::new(), |folder| {
        format!("{:?}", folder.join("x")).replace("x\"", "")
    });
    let text = if folder.len() > 1 {
        text.replace(&folder, "\"")
    } else {
        text
    };
    hasher.update(text.as_bytes());
    for file in files(scene) {
        hasher.update(hash_of_file(&file).unwrap_or_default().as_bytes());
    }
    hasher.finalize().to_string()
}
