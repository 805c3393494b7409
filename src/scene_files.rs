//! Finds the files that a scene names, and determines whether two runs have the same inputs.

use std::io;
use std::path::{Path, PathBuf};

use crate::mesh_files;
use dovetail_cache::inputs;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::model::{
    BodyMesh, ExcitationKind, FieldSource, InfluenceSource, MatrixSource, MeshKind,
};
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
/// is reported where it is needed. `None` if a path cannot be hashed.
pub fn hash(scene: &Scene, scene_file: &Path) -> Option<String> {
    let contents = files(scene).into_iter();
    let contents = contents.map(|file| hash_of_file(&file).unwrap_or_default());
    let contents: Vec<String> = contents.collect();
    let folder = scene_file.parent().unwrap_or(Path::new(""));
    let mut scene = scene.clone();
    change_paths(&mut scene, &|path| {
        let relative = path.strip_prefix(folder).unwrap_or(path);
        // A path that is no Unicode cannot be serialised.
        *path = relative.to_string_lossy().into_owned().into();
    });
    let hash = inputs::of_scene(&scene, &contents)?;
    Some(blake3::Hash::from_bytes(hash).to_string())
}

/// Changes each path of a scene.
fn change_paths(scene: &mut Scene, change: &dyn Fn(&mut PathBuf)) {
    let assembly = match &mut scene.subject {
        Subject::ReducedModel(spec) => return change(&mut spec.folder),
        Subject::Assembly(assembly) => assembly,
    };
    match assembly.mesh.as_mut().map(|mesh| &mut mesh.kind) {
        None => {}
        Some(MeshKind::File { path }) => change(path),
        Some(MeshKind::Geometry {
            script, fallback, ..
        }) => {
            change(script);
            fallback.iter_mut().for_each(change);
        }
    }
    for body in &mut assembly.bodies {
        if let BodyMesh::File { path, .. } = &mut body.mesh {
            change(path);
        }
        if let MatrixSource::Files(named) = &mut body.matrices {
            let load = named.load.iter_mut();
            let files = [&mut named.stiffness, &mut named.mass].into_iter();
            files.chain(load).for_each(|file| change(&mut file.path));
            named.rows.iter_mut().for_each(change);
        }
    }
    let excitations = assembly.excitations.iter_mut();
    let fields = excitations.filter_map(|excitation| match &mut excitation.kind {
        ExcitationKind::Field { field, .. } => Some(field),
        _ => None,
    });
    let contacts = assembly.contacts.iter_mut();
    let friction = contacts.filter_map(|contact| contact.friction_at.as_mut());
    for field in fields.chain(friction) {
        if let FieldSource::File(path) = field {
            change(path);
        }
    }
    let influence = assembly.cyclic.as_mut().and_then(|c| c.influence.as_mut());
    if let Some(InfluenceSource::File(path)) = influence.map(|i| &mut i.coefficients) {
        change(path);
    }
}
