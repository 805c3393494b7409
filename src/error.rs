//! Error of a run: the error of the stage itself, in the words of the scene.

use std::error::Error;
use std::fmt;

use miette::{Diagnostic, Severity};
use thiserror::Error;

use crate::exhaustion::OutOfMemory;
use crate::exit::ExitStatus;
use crate::gmsh::GmshError;
use crate::influence_file::InfluenceFileError;
use crate::matrix_files::MatrixFilesError;
use crate::motions::free_words;
use crate::scene::located::suggestion;
use dovetail_export::ExportError;
use dovetail_export::words::quantity;
use dovetail_mesh::MeshError;
use dovetail_mesh::formats::surface_field::SurfaceFieldError;
use dovetail_mesh::quality::QualityError;
use dovetail_solver::fem::FemError;
use dovetail_solver::model::{ErrorSubject, ModelError};
use dovetail_solver::reduction::ReductionError;
use dovetail_solver::run::{self, static_place};
use dovetail_superelement::SuperelementError;

/// Reason why a run ended without its full result.
#[derive(Debug, Error, Diagnostic)]
pub enum RunError {
    #[error(transparent)]
    Mesh(#[from] MeshError),

    /// Error of gmsh, which made no mesh.
    #[error("meshing failed")]
    Gmsh(#[from] GmshError),

    #[error("the mesh cannot be used")]
    Quality(#[from] QualityError),

    /// Error of the file of `excitation.file`.
    #[error(transparent)]
    Field(#[from] SurfaceFieldError),

    /// Error of the file of `cyclic.influence`.
    #[error(transparent)]
    Influence(#[from] InfluenceFileError),

    /// Error of the matrices of a body.
    #[error(transparent)]
    Matrices(#[from] MatrixFilesError),

    /// Error of the run itself.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Run(RunFailure),

    /// `dovetail peaks` found no peak at some values.
    #[error("{missing} of {values} values have no peak")]
    #[diagnostic(
        severity(Warning),
        help(
            "the warnings say why: response.frequency_hz or response.times_first_linear_mode may have to reach farther, or the motions \
             may need more response.max_newton_iterations"
        )
    )]
    NoPeaks { missing: usize, values: usize },

    /// Neither peaks nor curves depend on a key that they were asked for over.
    #[error(
        "what is computed does not depend on `{key}`: its first and its last value have the same model, loads, damping and settings"
    )]
    #[diagnostic(help(
        "give a key that the vibration depends on: a force (excitation.*.force_n), a coefficient of friction, a clearance, a load, a \
         speed, a damping. The strength and the wear of bodies, engine orders and the mission are read by other commands"
    ))]
    KeyNotRead { key: String },

    /// `dovetail curve` found no motion at some values.
    #[error("{missing} of {values} values have no motion")]
    #[diagnostic(
        severity(Warning),
        help(
            "the warnings say why: other values (--over), more response.max_newton_iterations or another number of response.harmonics may help"
        )
    )]
    NoMotions { missing: usize, values: usize },

    /// `dovetail backbone` ended before its last amplitude.
    #[error("{missing} of {amplitudes} amplitudes were not reached")]
    #[diagnostic(
        severity(Warning),
        help("the warnings say why: the last amplitude of --amplitude FROM:TO may be too large")
    )]
    BackboneEnds { missing: usize, amplitudes: usize },

    /// `dovetail wear` ended before its last cycle.
    #[error("the contacts were worn over {reached} of {cycles} cycles")]
    #[diagnostic(
        severity(Warning),
        help(
            "the warning says why: a larger --tolerance, a wider response.frequency_hz or more response.max_newton_iterations may help"
        )
    )]
    WearEnds { reached: String, cycles: String },

    /// A command that needs a mesh, for a scene with a reduced model.
    #[error("the scene \"{scene}\" has no mesh: it is about a reduced model")]
    #[diagnostic(help(
        "this command needs a scene with [mesh] instead of [reduced_model]; `dovetail static` and `dovetail run` compute with \
         a reduced model"
    ))]
    NoMesh { scene: String },

    /// A reduced model is to be kept only in the cache, and there is no cache.
    #[error("the reduced model is to be kept in the cache alone, and there is none")]
    #[diagnostic(help(
        "name its folder (--cache DIR) and leave out --no-cache and a limit of 0 GiB, or write the reduced model into a \
         folder (--out DIR, without --into-cache)"
    ))]
    NoCache,

    /// The folder of a reduced model cannot be read or written.
    #[error(transparent)]
    Superelement(#[from] SuperelementError),

    #[error(transparent)]
    Export(#[from] ExportError),

    /// End of memory, which is reported when it occurs.
    #[error(transparent)]
    #[diagnostic(transparent)]
    OutOfMemory(#[from] OutOfMemory),
}

/// Error of bodies and meshes that do not fit, before a run begins.
impl From<ModelError> for RunError {
    fn from(error: ModelError) -> Self {
        run::Error::from(error).into()
    }
}

impl From<run::Error> for RunError {
    fn from(error: run::Error) -> Self {
        Self::Run(RunFailure(error))
    }
}

/// Error of a run in the words of a scene, with the names of the keys to change.
#[derive(Debug)]
pub struct RunFailure(pub run::Error);

impl RunFailure {
    /// Part of the scene that the error is about, if it is one of bodies and meshes that do not fit.
    pub fn subject(&self) -> Option<ErrorSubject<'_>> {
        match &self.0 {
            run::Error::Model(error) => error.subject(),
            _ => None,
        }
    }
}

impl fmt::Display for RunFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        words(&self.0, f)
    }
}

/// Message of an error of a run.
fn words(error: &run::Error, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match error {
        run::Error::AtSpeed { speed_rpm, error } => {
            write!(f, "at {speed_rpm} rpm: ")?;
            words(error, f)
        }
        run::Error::NoLinearMode => write!(
            f,
            "response.times_first_linear_mode: this model has no mode to count from"
        ),
        run::Error::NoRotation => write!(
            f,
            "frequencies over the speed were asked for, and the scene has no axis of rotation"
        ),
        run::Error::MovesTooFar(moved) => write!(
            f,
            "{} of body `{}` moves by {}, more than the body is long ({})",
            moved.what,
            moved.body,
            quantity(moved.displacement_m, "m", 3),
            quantity(moved.size_m, "m", 3)
        ),
        run::Error::NothingHolds { motions, point } => write!(
            f,
            "nothing holds {}: no pair is in contact {}",
            free_words(motions),
            static_place(*point)
        ),
        error => fmt::Display::fmt(error, f),
    }
}

impl Error for RunFailure {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.source()
    }
}

impl Diagnostic for RunFailure {
    fn severity(&self) -> Option<Severity> {
        let is_complete = matches!(
            self.0,
            run::Error::NotConverged { .. } | run::Error::UnstablePeak { .. }
        );
        is_complete.then_some(Severity::Warning)
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        if let Some(meant) = self.subject().as_ref().and_then(suggestion) {
            return Some(Box::new(format!("did you mean `{meant}`?")));
        }
        Some(Box::new(remedy(&self.0)?))
    }
}

/// Remedy for the error of a run.
fn remedy(error: &run::Error) -> Option<&'static str> {
    Some(match error {
        run::Error::AtSpeed { error, .. } => return remedy(error),
        run::Error::AlongEngineOrder { .. } => {
            "leave the engine order out and give the range in hertz: --set response.along_engine_order= \
             --set response.frequency_hz=[440,460]; rotation.speed_rpm is the speed then"
        }
        run::Error::NoLinearMode => {
            "give the range in hertz, for example: response.frequency_hz = [440.0, 460.0]"
        }
        run::Error::UndampedMode { .. } => {
            "give some damping (damping.ratio = 0.001), or move the range or the number of points of [response] so that \
         no frequency is exactly there"
        }
        run::Error::AllBonded { .. } => {
            "give a contact law = \"unilateral_coulomb\" and a coefficient of friction; `dovetail run` computes the linear response"
        }
        run::Error::StaticState { .. } => {
            "take more steps (static.load_steps), a friction coefficient below 1, or look at static.csv and \
         flank_static.vtu: pairs that all slide, or all open, hold nothing, and they may do so at a point of [[static.path]]"
        }
        run::Error::Prestress { .. } => {
            "the stress of the static state changes the stiffness so much that the two do not settle: lower the load or the speed, raise \
         static.load_steps, or take prestress = \"held_flanks\" of [rotation]"
        }
        run::Error::SlidesTooFar { .. } => {
            "the two sides of a pair are assumed to stay opposite each other. Look in static.csv for the pairs that slide. Check the units of \
         the loads and of young_pa, hold the body that slides (friction, supports, a [[contact]]), or load it less"
        }
        run::Error::MovesTooFar(_) => {
            "displacements are taken to be small: check the units of the loads, of young_pa and of the mesh, the supports, and the \
         force of the excitation. The files of the run hold its figures, which are those of no possible motion"
        }
        run::Error::NothingHolds { point: Some(_), .. } => {
            "a load path is a way along which the bodies stay together: change the loads or the speed_rpm of \
             that point of [[static.path]], so that they press some pairs together, or hold the body by a \
             support (key `fixed`) or a [[spring]]"
        }
        run::Error::NothingHolds { .. } => {
            "a support (key `fixed`) or a [[spring]] holds a body without its contacts. Else a \
         steady load must press them together: give [rotation] a speed_rpm above 0, an axis that \
         throws the body outwards, and the body among those that carry the load \
         (rotation.bodies), or add a [[load]] that presses the body against the one that it \
         touches (a pressure_pa above 0 presses, one below 0 pulls); the load must close the clearance (gap_m, crown_radius_m); the static_load.mtx of \
         a reduced model must be negative on N"
        }
        run::Error::NoSuchMode { .. } => {
            "give --mode one of them, or keep more response.stuck_modes; `dovetail static` lists the linear modes in modes.csv"
        }
        run::Error::NoModeInRange { .. } => {
            "widen response.frequency_hz or response.times_first_linear_mode, or give --mode a number"
        }
        run::Error::NotInMode { .. } => {
            "give another mode (--mode), or another displacement (--observe NAME, of an [[observe]])"
        }
        run::Error::OtherPairs { .. } => {
            "give a key that leaves the pairs as they are: a force, a coefficient of friction, a clearance, a speed; \
             `dovetail study` runs a scene at values that change its pairs"
        }
        run::Error::NoMotion => {
            "other values (--over) or another frequency (--frequency) may have motions; more \
             response.max_newton_iterations may help"
        }
        run::Error::NoBackbone => {
            "begin at a smaller amplitude (--amplitude FROM:TO), or allow more response.max_newton_iterations"
        }
        run::Error::NoWear => {
            "give a [[contact]] that is not bonded its coefficient `wear_m2_n`, such as 1e-14, or \
             the [reduced_model]"
        }
        run::Error::NoAreas => {
            "give model.json of the reduced model `areas_m2`; `dovetail reduce` writes it"
        }
        run::Error::NoRotation => {
            "give the scene a section [rotation] with an axis and any speed_rpm; --rpm takes the place of the speed"
        }
        run::Error::TooManySteps { .. } => {
            "take fewer steps per period (--steps; 500 to 2000 are usual) or fewer periods (--periods, \
         --most-periods)"
        }
        run::Error::NotSteady { .. } => {
            "allow more periods (--most-periods), accept more of the transient (--steady), or add damping; verify.csv \
         holds the last period. A motion whose transient does not decay may have no steady state of the period of \
         the excitation"
        }
        run::Error::Disagreement { .. } => {
            "take more harmonics (--set response.harmonics=7) and more steps per period (--steps), see which moves, or \
         allow more (--tolerance); near a peak several motions may exist, and each method may have found another"
        }
        run::Error::NoDisc => {
            "give a section [cyclic] with the number of sectors and the faces at which they meet, or leave out \
             --nodal-diameter or --whole-disc"
        }
        run::Error::NotInPhase { .. } => {
            "leave out `engine_order` of [cyclic], or give a multiple of `sectors`; `dovetail run`, `dovetail peaks`, \
             `dovetail curve` and `dovetail backbone` compute the wave"
        }
        run::Error::WithInfluence { .. } => {
            "leave out `influence` of [cyclic]; `dovetail run`, `dovetail peaks`, `dovetail curve` and `dovetail backbone` \
             have it"
        }
        run::Error::TooLittleMemory { .. } => {
            "take fewer response.harmonics (`response.accuracy` takes as few as it needs), the solver \"newton_krylov\", or fewer pairs"
        }
        run::Error::NotConverged {
            unconverged,
            inaccurate,
            ..
        } if unconverged == inaccurate => {
            "all have a motion, which is written and drawn, but its estimated error (column \
             estimated_error of response.csv) is above response.accuracy: ask for a larger one, or \
             give the number of harmonics yourself (response.harmonics)"
        }
        run::Error::NotConverged {
            unconverged,
            not_held,
            ..
        } if unconverged == not_held => {
            "the warnings say at which frequencies the bodies would come apart, slide too far or are held \
             by nothing, and what to change: less excitation, or more of the steady load that presses \
             the flanks together (check the units of force_n and of the loads)"
        }
        run::Error::NotConverged { .. } => {
            "they are marked in the column `outcome` of response.csv; those without a motion are \
             left out of the curves; more response.max_newton_iterations, a smaller step in \
             frequency (response.points), or the default response.eps = \"dynamic\" with \
             eps_scale = 1 may help"
        }
        run::Error::UnstablePeak { .. } => {
            "the largest stable amplitude and the range that an integration in time reached are in the \
             warning above and in summary.json (response.peak_stability); \
             `dovetail verify --perturb 0.01` integrates for longer; more damping or less excitation \
             may make the peak stable"
        }
        run::Error::Fem(FemError::LooselyHeld { .. })
        | run::Error::NodalDiameter {
            source: ReductionError::NotHeld { .. },
            ..
        }
        | run::Error::Reduction(
            ReductionError::InteriorNotHeld { .. } | ReductionError::NotHeld { .. },
        ) => {
            "a support is one of the keys `fixed`, `fixed_x`, `fixed_y` and `fixed_z` of a \
             [[body]], which name groups; a spring is a [[spring]], and a contact a [[contact]]"
        }
        _ => return None,
    })
}

impl RunError {
    /// Exit status of a command that ends with this error.
    pub fn exit_status(&self) -> ExitStatus {
        match self {
            Self::Gmsh(
                GmshError::Script { .. }
                | GmshError::UnknownParameter { .. }
                | GmshError::UnknownOption { .. }
                | GmshError::SetByScript { .. },
            )
            | Self::Mesh(_)
            | Self::Field(_)
            | Self::Influence(_)
            | Self::Matrices(_)
            | Self::Quality(_)
            | Self::NoMesh { .. }
            | Self::NoCache
            | Self::KeyNotRead { .. }
            | Self::Export(
                ExportError::OtherScene { .. }
                | ExportError::OtherSettings { .. }
                | ExportError::OtherInputs { .. }
                | ExportError::UnknownProgram { .. },
            ) => ExitStatus::BadInput,
            Self::NoPeaks { .. }
            | Self::NoMotions { .. }
            | Self::BackboneEnds { .. }
            | Self::WearEnds { .. } => ExitStatus::NotConverged,
            Self::Run(RunFailure(error)) => run_status(error),
            Self::Superelement(error) => folder_status(error),
            Self::Gmsh(_) | Self::Export(_) | Self::OutOfMemory(_) => ExitStatus::Failed,
        }
    }
}

fn folder_status(error: &SuperelementError) -> ExitStatus {
    if matches!(error, SuperelementError::Write { .. }) {
        ExitStatus::Failed
    } else {
        ExitStatus::BadInput
    }
}

fn run_status(error: &run::Error) -> ExitStatus {
    use run::Error;
    match error {
        Error::AtSpeed { error, .. } => run_status(error),
        Error::Model(_)
        | Error::NoMesh
        | Error::NoReducedModel
        | Error::NoLinearMode
        | Error::UndampedMode { .. }
        | Error::Damping(_)
        | Error::AllBonded { .. }
        | Error::TooManySteps { .. }
        | Error::NoObservation { .. }
        | Error::AlongEngineOrder { .. }
        | Error::OtherPairs { .. }
        | Error::NoScene
        | Error::NoSuchMode { .. }
        | Error::NoModeInRange { .. }
        | Error::NotInMode { .. }
        | Error::NoWear
        | Error::NoAreas
        | Error::NoRotation => ExitStatus::BadInput,
        Error::NotConverged { .. } | Error::UnstablePeak { .. } => ExitStatus::NotConverged,
        _ => ExitStatus::Failed,
    }
}
