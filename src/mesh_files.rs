//! Opens the files of meshes and of surface fields, as the library reads bytes.

use std::path::{Path, PathBuf};

use dovetail_mesh::formats::surface_field::SurfaceFieldError;
use dovetail_mesh::surface_field::SurfaceField;
use dovetail_mesh::units::Units;
use dovetail_mesh::{Mesh, MeshError, formats};
use dovetail_superelement::input;

/// Reads a mesh file of any format, with the files that it includes.
///
/// # Errors
/// A file that cannot be read, or that is not a whole mesh of solid elements: see [`MeshError`].
pub fn read(path: &Path, units: impl Into<Units>) -> Result<Mesh, MeshError> {
    let bytes = bytes(path)?;
    let mut include = |name: &str| self::bytes(&included(path, name));
    let content = formats::parse(&bytes, &path.to_string_lossy(), &mut include);
    let mesh = content.and_then(|content| content.into_mesh(units.into()));
    mesh.map_err(|e| MeshError::File {
        path: path.to_path_buf(),
        error: Box::new(e),
    })
}

/// The mesh file itself and the files that it includes, as far as they can be read.
pub fn files(path: &Path) -> Vec<PathBuf> {
    let mut paths = vec![path.to_path_buf()];
    let mut include = |name: &str| {
        let file = included(path, name);
        let content = self::bytes(&file);
        paths.push(file);
        content
    };
    if let Ok(bytes) = bytes(path) {
        // What is wrong with it is said when it is read for its mesh.
        let _ = formats::parse(&bytes, &path.to_string_lossy(), &mut include);
    }
    paths
}

/// File that the deck at `path` includes, perhaps with the backslashes of Windows between folders.
fn included(path: &Path, name: &str) -> PathBuf {
    let folder = path.parent().unwrap_or(Path::new(""));
    let file = folder.join(name);
    if file.exists() {
        return file;
    }
    let with_slashes = folder.join(name.replace('\\', "/"));
    if with_slashes.exists() {
        with_slashes
    } else {
        file
    }
}

fn bytes(path: &Path) -> Result<Vec<u8>, MeshError> {
    input::bytes(path).map_err(|source| MeshError::Io {
        path: path.to_path_buf(),
        source,
    })
}

/// Reads a CSV file of forces or pressures at points.
///
/// # Errors
/// A file that cannot be read, or that does not contain such points: see [`SurfaceFieldError`].
pub fn surface_field(path: &Path) -> Result<SurfaceField, SurfaceFieldError> {
    let file = input::open(path).map_err(|error| SurfaceFieldError::Io {
        path: path.to_owned(),
        reason: error.to_string(),
    })?;
    SurfaceField::parse(file, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn included_files_may_have_backslashes() {
        let folder = dovetail_testkit::folder::Folder::new("mesh-files-backslash");
        std::fs::create_dir_all(folder.join("mesh")).unwrap();
        let nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n";
        std::fs::write(folder.join("mesh/nodes.inp"), nodes).unwrap();
        let deck = folder.join("deck.inp");
        for name in ["mesh/nodes.inp", "mesh\\nodes.inp", ".\\mesh\\nodes.inp"] {
            let text = format!("*INCLUDE, INPUT={name}\n*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n");
            std::fs::write(&deck, text).unwrap();
            assert_eq!(read(&deck, 1.0).unwrap().nodes_m.len(), 4, "{name}");
            assert!(files(&deck)[1].exists());
        }
    }

    #[test]
    fn files_that_are_not_there_are_named() {
        let error = read(Path::new("meshes/nowhere.msh"), 1.0).unwrap_err();
        assert!(error.to_string().contains("nowhere.msh"));
        let error = surface_field(Path::new("scenes/nowhere.csv")).unwrap_err();
        assert!(error.to_string().contains("cannot read scenes/nowhere.csv"));
        assert_eq!(
            files(Path::new("meshes/nowhere.msh")),
            [Path::new("meshes/nowhere.msh")]
        );
    }
}
