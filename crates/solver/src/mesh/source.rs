//! Where a mesh comes from.

use std::path::{Path, PathBuf};

/// Where the mesh comes from. Paths are absolute or relative to the working directory
/// (the parser has already joined them to the folder of the scene file).
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSource {
    /// A file, or a script.
    pub kind: MeshKind,
    /// Of the file.
    pub units: Units,
}

/// What the numbers of a mesh file are in; no format says it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Units {
    /// Length of one unit in metres. Materials of the file cannot be used.
    MetresPerUnit(f64),
    /// Metre, kilogram, second: Pa, kg/m3.
    MetreKilogramSecond,
    /// Millimetre, tonne, second: MPa, t/mm3.
    MillimetreTonneSecond,
}

impl Units {
    /// The systems of units by the words that name them.
    pub const SYSTEMS: [(&'static str, Self); 2] = [
        ("m-kg-s", Self::MetreKilogramSecond),
        ("mm-t-s", Self::MillimetreTonneSecond),
    ];

    /// Length of one unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::MetresPerUnit(metres) => metres,
            Self::MetreKilogramSecond => 1.0,
            Self::MillimetreTonneSecond => 1e-3,
        }
    }

    /// One unit of stress in Pa and one of density in kg/m3, where they are known.
    pub fn stress_pa_and_density_kg_m3(self) -> Option<[f64; 2]> {
        match self {
            Self::MetresPerUnit(_) => None,
            Self::MetreKilogramSecond => Some([1.0, 1.0]),
            Self::MillimetreTonneSecond => Some([1e6, 1e12]),
        }
    }
}

impl From<f64> for Units {
    fn from(metres_per_unit: f64) -> Self {
        Self::MetresPerUnit(metres_per_unit)
    }
}

/// A mesh that is there, or one that is to be made.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshKind {
    /// A ready file, of one of the [formats](super::format) that are read.
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
