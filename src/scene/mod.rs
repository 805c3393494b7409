//! Text -> [`Scene`]: everything one run depends on, checked, in SI units, with names still unresolved.
//!
//! A `Scene` can only be made by the parser, so a value of this type is possible by construction
//! (positive moduli, known options, ordered ranges). Names of mesh groups are checked later, by
//! [`crate::model`], when the mesh is known.

mod check;
mod document;
pub(crate) mod error;
mod keys;
mod overrides;
mod raw;
mod source;

use std::path::{Path, PathBuf};

use crate::input;

pub use error::{Fault, Problem, SceneError};
pub use keys::nearest;

/// Reads and checks the scene file `path`. Relative paths in it are joined to its folder; `overrides` are
/// `KEY=VALUE` texts as for [`parse`].
///
/// # Errors
/// [`SceneError::Read`] when the file cannot be read, [`SceneError::Invalid`] as for [`parse`].
pub fn load(path: &Path, overrides: &[String]) -> Result<Scene, SceneError> {
    let text = input::text(path).map_err(|source| SceneError::Read {
        path: path.to_owned(),
        source,
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(&text, &path.display().to_string(), folder, overrides)
}

/// Parses and checks the text of a scene. `file_name` is for messages only, relative paths of the scene are
/// joined to `base_dir`. Each of `overrides` is `KEY=VALUE`, KEY a dotted path (`response.points`,
/// `contact.left.friction`, `contact.0.friction`, `contact.*.friction`), VALUE a TOML value or else a
/// text; with nothing after `=` the key is removed. Of keys that exclude each other (a mesh file and a geometry,
/// the two frequency ranges, the two ways to give damping) the one set replaces the file's.
///
/// # Errors
/// [`SceneError::Invalid`] with every problem found: first those of syntax alone, then unknown keys and
/// wrong types, then missing, impossible and contradictory values.
pub fn parse(
    text: &str,
    file_name: &str,
    base_dir: &Path,
    overrides: &[String],
) -> Result<Scene, SceneError> {
    let source = source::Source {
        name: file_name,
        text: text.into(),
        overrides,
    };
    document::read(&source)
        .and_then(|raw| check::scene(&source, base_dir, raw))
        .map_err(|problems| SceneError::Invalid { problems })
}

/// One run, as the TOML file describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name of the run: the default output folder is `output/<name>`.
    pub name: String,
    pub subject: Subject,
    pub damping: DampingSpec,
    pub static_state: StaticSpec,
    pub response: ResponseSpec,
}

impl Scene {
    /// The mesh and all that refers to it, where the scene is about one.
    pub fn assembly(&self) -> Option<&Assembly> {
        match &self.subject {
            Subject::Assembly(assembly) => Some(assembly),
            Subject::ReducedModel(_) => None,
        }
    }
}

/// What vibrates.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// Bodies of a mesh.
    Assembly(Box<Assembly>),
    /// What a reduction has left of bodies that are not described further.
    ReducedModel(ReducedModelSpec),
}

/// A reduced model read from a folder (its files: `reduction::superelement`).
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedModelSpec {
    pub folder: PathBuf,
    /// Coulomb coefficient of every pair.
    pub friction: f64,
    /// Initial clearance of every pair, m.
    pub gap_m: f64,
    /// The folder's unit excitation is multiplied by this.
    pub force_n: f64,
}

/// Bodies of a mesh, how they are held, driven and watched.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembly {
    pub mesh: MeshSource,
    /// First the body that vibrates (blade), then the one that holds it (jaw); without the second the contacts are
    /// with rigid ground.
    pub bodies: Vec<BodySpec>,
    /// `None`: the scene does not rotate and no prestress is computed.
    pub rotation: Option<RotationSpec>,
    pub contacts: Vec<ContactSpec>,
    /// Steady loads besides the rotation's.
    pub loads: Vec<LoadSpec>,
    pub excitations: Vec<ExcitationSpec>,
    pub observations: Vec<ObservationSpec>,
}

/// Where the mesh comes from. Paths are absolute or relative to the working directory
/// (the parser has already joined them to the folder of the scene file).
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSource {
    pub kind: MeshKind,
    /// Length of one mesh unit in metres (Gmsh files carry no unit).
    pub metres_per_unit: f64,
    /// Two flank nodes farther apart than this fraction of the local node spacing are not a pair.
    pub pairing_tolerance: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub enum MeshKind {
    /// A ready `.msh` file (MSH 4.1, ASCII or binary).
    File { path: PathBuf },
    /// A Gmsh script meshed by the `gmsh` program.
    Geometry {
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

#[derive(Debug, Clone, PartialEq)]
pub struct BodySpec {
    pub name: String,
    /// Name of the volume group.
    pub volume: String,
    pub material: Material,
    /// Groups (of any dimension) whose nodes do not move.
    pub fixed: Vec<String>,
    /// Groups whose nodes do not move along x, y, z (planes of symmetry, rollers).
    pub fixed_along: [Vec<String>; 3],
    /// Number of fixed-interface modes kept in the Craig-Bampton reduction.
    pub fixed_interface_modes: usize,
}

/// Isotropic linear elasticity.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Material {
    pub young_pa: f64,
    pub poisson: f64,
    pub density_kg_m3: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct RotationSpec {
    /// A point of the axis, m.
    pub point_m: [f64; 3],
    /// Direction of the axis, unit length.
    pub axis: [f64; 3],
    /// 0 or more. At 0 the section is kept (`Some`): a rotating scene at rest, without load or prestress.
    pub speed_rad_s: f64,
    /// Names of the bodies that carry the centrifugal load.
    pub bodies: Vec<String>,
    pub prestress: Prestress,
}

/// What the rotation adds to the stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub enum Prestress {
    /// The centrifugal load only.
    None,
    /// Geometric stiffness of the static state with the contact nodes held, and spin softening
    /// (the paper's choice).
    HeldFlanks,
}

#[derive(Debug, Clone, PartialEq)]
pub struct ContactSpec {
    pub name: String,
    /// Surface group of the first body.
    pub first: String,
    /// Surface group of the second body; `None` where there is no second body.
    pub second: Option<String>,
    pub law: ContactLaw,
    /// Coulomb coefficient.
    pub friction: f64,
    /// Initial clearance along the normal, m (0: the flanks touch).
    pub gap_m: f64,
    /// Clearance that grows away from a point or line of the flank.
    pub crown: Option<CrownSpec>,
}

/// What joins the two sides of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactLaw {
    /// Compression only, dry friction.
    UnilateralCoulomb,
    /// Nothing moves: friction, clearance and crown are not used.
    Bonded,
}

/// A crowned flank: to the clearance is added d^2 / (2 radius_m), d the distance in the flank's tangent plane
/// from the centre, or from the line through it along `axis`.
#[derive(Debug, Clone, PartialEq)]
pub struct CrownSpec {
    /// Radius of curvature, m; where both flanks are crowned, R1 R2 / (R1 + R2).
    pub radius_m: f64,
    /// Unit length; `None`: the same curvature in all directions.
    pub axis: Option<[f64; 3]>,
    /// `None`: the centroid of the flank's area.
    pub centre_m: Option<[f64; 3]>,
}

/// A steady load, applied with that of the rotation in the load steps of the static state.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadSpec {
    /// Point group (shared equally by its nodes) or surface group (spread uniformly over its area).
    pub on: String,
    pub load: LoadKind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadKind {
    /// The whole force, N.
    Force { vector_n: [f64; 3] },
    /// Along the inward normal of a surface, Pa.
    Pressure { pressure_pa: f64 },
}

/// Rayleigh damping C = stiffness_s K + mass_per_s M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DampingSpec {
    Rayleigh {
        stiffness_s: f64,
        mass_per_s: f64,
    },
    /// Stiffness-proportional damping that gives this ratio of critical on one stuck mode (1 = first).
    Ratio {
        ratio: f64,
        stuck_mode: usize,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationSpec {
    /// Point group (or any group: the force is shared equally by its nodes).
    pub points: String,
    /// Unit length.
    pub direction: [f64; 3],
    /// Amplitude of `force_n cos(harmonic omega t - phase_rad)`.
    pub force_n: f64,
    pub harmonic: usize,
    pub phase_rad: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct ObservationSpec {
    pub name: String,
    /// Point group; the displacement observed is the mean over its nodes.
    pub points: String,
    /// Unit length.
    pub direction: [f64; 3],
}

/// Static state under rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticSpec {
    /// The load is applied in this many equal steps.
    pub load_steps: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct ResponseSpec {
    pub range: FrequencyRange,
    /// Number of frequencies, evenly spaced.
    pub points: usize,
    pub resolution: Resolution,
    /// A second response with this many harmonics, drawn beside the first.
    pub compare_harmonics: Option<usize>,
    pub eps: EpsChoice,
    /// eps is multiplied by this (1 = the choice itself).
    pub eps_scale: f64,
    /// Converged when the relative residual is below this: the larger of |f_0| / |F| and
    /// |f_1..H| / |F_1..H|.
    pub tolerance: f64,
    pub max_newton_iterations: usize,
    pub solver: Solver,
    /// Stuck modes kept; `None` keeps all of them (the paper's exact condensation).
    pub stuck_modes: Option<usize>,
    /// A pair slips in a period when it slides farther than this, m; `None`: 1e-5 of the largest
    /// static slip.
    pub slip_threshold_m: Option<f64>,
}

/// What each frequency is resolved with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// Harmonics of the motion, and samples of a period in the alternating frequency-time step.
    Fixed { harmonics: usize, samples: usize },
    /// As few as keep the estimated error of the observed amplitudes below this fraction of them.
    Accuracy(f64),
}

impl Resolution {
    /// Most harmonics kept for an accuracy: with more, what the march of a pair leaves open (its parameter eps, the
    /// way to the periodic state) weighs more than what the harmonics add.
    pub const MOST_ADAPTED: usize = 31;

    /// The fewest samples of a period that carry so many harmonics: four in a period of the first one left out. With fewer the contact
    /// forces of the highest harmonics alias, and no motion is found where pairs slip and open (31 harmonics: none with 64, 80 or 96
    /// samples, one with 128).
    pub fn least_samples(harmonics: usize) -> usize {
        4 * (harmonics + 1)
    }

    /// The most harmonics any frequency may have.
    pub fn most_harmonics(self) -> usize {
        match self {
            Self::Fixed { harmonics, .. } => harmonics,
            Self::Accuracy(_) => Self::MOST_ADAPTED,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrequencyRange {
    Hz {
        from_hz: f64,
        to_hz: f64,
    },
    /// Multiples of the first stuck frequency.
    OfFirstStuckMode {
        from: f64,
        to: f64,
    },
}

/// The free parameter of DLFT.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EpsChoice {
    /// Per pair: the median of the dynamic stiffness over the harmonics, one value for N, one for T.
    Dynamic,
    /// Per pair: diagonal of the static stiffness, one value for N, one for T.
    Pair,
    /// Spectral radius of the static stiffness, for all pairs (the paper's choice).
    SpectralRadius,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    NewtonKrylov,
    /// Powell's hybrid method (dogleg), the paper's solver.
    Powell,
}
