//! Source of the mesh that bodies share.

use std::path::{Path, PathBuf};

use dovetail_mesh::units::Units;

/// Source of a mesh. Paths are absolute or relative to the working directory (the parser has
/// already joined them to the folder of the scene file).
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MeshSource {
    /// File, or script.
    pub kind: MeshKind,
    /// Units of the file.
    pub units: Units,
}

impl MeshSource {
    /// Mesh of a file in these units, or with so many metres in a unit of length.
    ///
    /// ```
    /// use dovetail_structure::model::MeshSource;
    ///
    /// let in_millimetres = MeshSource::file("meshes/dovetail.msh", 1e-3);
    /// assert_eq!(in_millimetres.units.metres(), 1e-3);
    /// ```
    pub fn file(path: impl Into<PathBuf>, units: impl Into<Units>) -> Self {
        Self {
            kind: MeshKind::File { path: path.into() },
            units: units.into(),
        }
    }
}

/// Mesh that exists, or one that is to be generated.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub enum MeshKind {
    /// Existing file.
    File {
        /// Path of the file.
        path: PathBuf,
    },
    /// Gmsh script meshed by the `gmsh` program.
    Geometry {
        /// Path of the script.
        script: PathBuf,
        /// Parameters passed as `-setnumber name value`, in the order of the scene file.
        parameters: Vec<(String, f64)>,
        /// Time after which gmsh is stopped, s.
        time_limit_s: f64,
        /// Ready mesh that is used where the `gmsh` program is missing and no parameter differs
        /// from `fallback_parameters`.
        fallback: Option<PathBuf>,
        /// Parameters that `fallback` was made with.
        fallback_parameters: Vec<(String, f64)>,
    },
}

impl MeshKind {
    /// Ready mesh that replaces the script, if there is one and it was made with the same
    /// parameters (in any order).
    pub fn equivalent_fallback(&self) -> Option<&Path> {
        let Self::Geometry {
            parameters,
            fallback,
            fallback_parameters,
            ..
        } = self
        else {
            return None;
        };
        let same = parameters.len() == fallback_parameters.len()
            && parameters.iter().all(|p| fallback_parameters.contains(p));
        fallback.as_deref().filter(|_| same)
    }
}
