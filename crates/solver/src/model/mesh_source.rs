//! Where the mesh comes from that bodies share.

use std::path::{Path, PathBuf};

use dovetail_mesh::units::Units;

/// Where the mesh comes from. Paths are absolute or relative to the working directory
/// (the parser has already joined them to the folder of the scene file).
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSource {
    /// A file, or a script.
    pub kind: MeshKind,
    /// Of the file.
    pub units: Units,
}

/// A mesh that is there, or one that is to be made.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshKind {
    /// A ready file.
    File {
        /// The file.
        path: PathBuf,
    },
    /// A Gmsh script meshed by the `gmsh` program.
    Geometry {
        /// The script's file.
        script: PathBuf,
        /// `-setnumber name value`, in the order of the scene file.
        parameters: Vec<(String, f64)>,
        /// gmsh is stopped after this time, in seconds.
        time_limit_s: f64,
        /// Ready mesh used where the `gmsh` program is missing and no parameter differs from
        /// `fallback_parameters`.
        fallback: Option<PathBuf>,
        /// The parameters `fallback` was made with.
        fallback_parameters: Vec<(String, f64)>,
    },
}

impl MeshKind {
    /// The ready mesh that stands for the script, if there is one and it was made with the same parameters
    /// (in any order).
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
