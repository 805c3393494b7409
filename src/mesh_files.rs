//! Opens the files of meshes and of surface fields, as the library reads bytes.

use std::path::{Path, PathBuf};

use dovetail_mesh::formats::surface_field::SurfaceFieldError;
use dovetail_mesh::surface_field::SurfaceField;
use dovetail_mesh::units::Units;
use dovetail_mesh::{Mesh, MeshError, formats};
use dovetail_solver::input;

/// Reads a mesh file of any format, with the files that it includes.
///
/// # Errors
/// A file that cannot be read, or that is not a whole mesh of solid elements: see [`MeshError`].
pub fn read(path: &Path, units: impl Into<Units>) -> Result<Mesh, MeshError> {
    let bytes = bytes(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut include = |name: &str| self::bytes(&folder.join(name));
    let content = formats::parse(&bytes, &path.to_string_lossy(), &mut include);
    let mesh = content.and_then(|content| content.into_mesh(units.into()));
    mesh.map_err(|e| MeshError::File {
        path: path.to_path_buf(),
        error: Box::new(e),
    })
}

/// The mesh file itself and the files that it includes, as far as they can be read.
pub fn files(path: &Path) -> Vec<PathBuf> {
    let mut all = vec![path.to_path_buf()];
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut include = |name: &str| {
        let file = folder.join(name);
        let found = self::bytes(&file);
        all.push(file);
        found
    };
    if let Ok(bytes) = bytes(path) {
        // What is wrong with it is said when it is read for its mesh.
        let _ = formats::parse(&bytes, &path.to_string_lossy(), &mut include);
    }
    all
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
