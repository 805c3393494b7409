//! The bytes of a mesh file, whatever its format, read for its mesh.

use super::format;
use super::source::Units;
use super::{Mesh, MeshError};

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
