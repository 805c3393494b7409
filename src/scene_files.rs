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
    let mut files = Vec::new();
    for_each_path(&mut scene.clone(), &mut |named, path| match named {
        Named::Model => files.extend(dovetail_superelement::files(path)),
        Named::Mesh => files.extend(mesh_files::files(path)),
        Named::ReadyMesh if !path.is_file() => {}
        Named::ReadyMesh | Named::Other => files.push(path.clone()),
    });
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
    for_each_path(&mut scene, &mut |_, path| {
        let relative = path.strip_prefix(folder).unwrap_or(path);
        // Only Unicode can be serialised.
        *path = relative.to_string_lossy().into_owned().into();
    });
    let hash = inputs::scene_hash(&scene, &contents)?;
    Some(blake3::Hash::from_bytes(hash).to_string())
}

/// Kind of file that a path of a scene names.
enum Named {
    /// Folder of a reduced model.
    Model,
    Mesh,
    /// Mesh that replaces the mesh of a script.
    ReadyMesh,
    Other,
}

/// Goes through the paths of a scene, each with its kind of file.
fn for_each_path(scene: &mut Scene, each: &mut dyn FnMut(Named, &mut PathBuf)) {
    let assembly = match &mut scene.subject {
        Subject::ReducedModel(spec) => return each(Named::Model, &mut spec.folder),
        Subject::Assembly(assembly) => assembly,
    };
    match assembly.mesh.as_mut().map(|mesh| &mut mesh.kind) {
        None => {}
        Some(MeshKind::File { path }) => each(Named::Mesh, path),
        Some(MeshKind::Geometry {
            script, fallback, ..
        }) => {
            each(Named::Other, script);
            fallback
                .iter_mut()
                .for_each(|file| each(Named::ReadyMesh, file));
        }
    }
    for body in &mut assembly.bodies {
        if let BodyMesh::File { path, .. } = &mut body.mesh {
            each(Named::Mesh, path);
        }
        if let MatrixSource::Files(named) = &mut body.matrices {
            let both = [&mut named.stiffness.path, &mut named.mass.path].into_iter();
            let load = named.load.iter_mut().map(|file| &mut file.path);
            let paths = both.chain(&mut named.rows).chain(load);
            paths.for_each(|path| each(Named::Other, path));
        }
    }
    let excitations = assembly.excitations.iter_mut();
    let fields = excitations.filter_map(|excitation| match &mut excitation.kind {
        ExcitationKind::Field { field, .. } => Some(field),
        _ => None,
    });
    let contacts = assembly.contacts.iter_mut();
    for field in fields.chain(contacts.filter_map(|contact| contact.friction_at.as_mut())) {
        if let FieldSource::File(path) = field {
            each(Named::Other, path);
        }
    }
    let influence = assembly.cyclic.as_mut().and_then(|c| c.influence.as_mut());
    if let Some(InfluenceSource::File(path)) = influence.map(|i| &mut i.coefficients) {
        each(Named::Other, path);
    }
}
