//! Reads a mesh file, whatever its format.

use std::path::{Path, PathBuf};

use super::format;
use super::source::Units;
use super::{Mesh, MeshError};
use crate::input;

/// Reads a mesh file, with the files that it includes.
///
/// # Errors
/// A file that cannot be read, or as [`parse`].
pub fn read(path: &Path, units: impl Into<Units>) -> Result<Mesh, MeshError> {
    let bytes = bytes(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut include = |name: &str| self::bytes(&folder.join(name));
    let content = format::parse(&bytes, &path.to_string_lossy(), &mut include);
    let mesh = content.and_then(|content| content.into_mesh(units.into()));
    mesh.map_err(|e| MeshError::File {
        path: path.to_path_buf(),
        error: Box::new(e),
    })
}

/// The file itself and the files that it includes, as far as they can be read.
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
        let _ = format::parse(&bytes, &path.to_string_lossy(), &mut include);
    }
    all
}

fn bytes(path: &Path) -> Result<Vec<u8>, MeshError> {
    input::bytes(path).map_err(|source| MeshError::Io {
        path: path.to_path_buf(),
        source,
    })
}

/// Parses the bytes of a mesh file that includes no other.
///
/// # Errors
/// Bytes that are no whole mesh of solid elements in a format that is read: see [`MeshError`].
pub fn parse(bytes: impl AsRef<[u8]>, units: impl Into<Units>) -> Result<Mesh, MeshError> {
    let mut include = |name: &str| {
        Err(MeshError::IncludeAlone {
            file: name.to_owned(),
        })
    };
    format::parse(bytes.as_ref(), "", &mut include)?.into_mesh(units.into())
}
