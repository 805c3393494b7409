//! Defines the error of a run, which is the stage's own error, passed through.

use miette::Diagnostic;
use thiserror::Error;

use crate::exhaustion::OutOfMemory;
use crate::exit::ExitStatus;
use crate::export::ExportError;
use crate::gmsh::GmshError;
use dovetail_mesh::MeshError;
use dovetail_mesh::formats::surface_field::SurfaceFieldError;
use dovetail_mesh::quality::QualityError;
use dovetail_numerics::memory::TooLittle;
use dovetail_solver::dlft::Outcome;
use dovetail_solver::fem::FemError;
use dovetail_solver::integration::IntegrationError;
use dovetail_solver::model::ModelError;
use dovetail_solver::reduction::ReductionError;
use dovetail_solver::reduction::damping::DampingError;
use dovetail_solver::reduction::superelement::SuperelementError;
use dovetail_solver::results::far_slip::TOO_FAR;

/// Why a run ended without its full result.
#[derive(Debug, Error, Diagnostic)]
pub enum RunError {
    #[error(transparent)]
    Mesh(#[from] MeshError),

    /// gmsh made no mesh.
    #[error("meshing failed")]
    Gmsh(#[from] GmshError),

    #[error("the mesh cannot be used")]
    Quality(#[from] QualityError),

    /// The file of `excitation.file`.
    #[error(transparent)]
    Field(#[from] SurfaceFieldError),

    #[error(transparent)]
    Model(#[from] ModelError),

    #[error(transparent)]
    Fem(#[from] FemError),

    #[error(transparent)]
    Reduction(#[from] ReductionError),

    /// The folder of `reduced_model.folder`.
    #[error(transparent)]
    Superelement(#[from] SuperelementError),

    #[error(transparent)]
    Damping(#[from] DampingError),

    /// `dovetail mesh` of a scene about a reduced model.
    #[error("the scene \"{scene}\" has no mesh: it is about a reduced model")]
    #[diagnostic(help(
        "`dovetail static` and `dovetail run` compute with it; `dovetail mesh` and `dovetail reduce` need a scene with [mesh] \
         instead of [reduced_model]"
    ))]
    NoMesh { scene: String },

    /// What is only to be kept in the cache has no place there.
    #[error("the reduced model is to be kept in the cache alone, and there is none")]
    #[diagnostic(help(
        "name its folder (--cache DIR) and leave out --no-cache and a limit of 0 GiB, or write the reduced model into a \
         folder (--out DIR, without --into-cache)"
    ))]
    NoCache,

    /// The frequency range counts from a mode that does not exist.
    #[error("response.times_first_linear_mode: this model has no mode to count from")]
    #[diagnostic(help(
        "give the range in hertz, for example: response.frequency_hz = [440.0, 460.0]"
    ))]
    NoLinearMode,

    /// A resonance without damping.
    #[error(
        "{frequency_hz} Hz: harmonic {harmonic} is at the frequency of {kind} mode {mode}, and there is no damping: where no pair \
         slips, opens or closes the answer is infinite"
    )]
    #[diagnostic(help(
        "give some damping (damping.ratio = 0.001), or move the range or the number of points of [response] so that \
         no frequency is exactly there"
    ))]
    UndampedMode {
        frequency_hz: f64,
        harmonic: usize,
        /// `stuck` or `linear`, as in modes.csv.
        kind: &'static str,
        mode: usize,
    },

    /// What needs pairs, without any.
    #[error("all contacts are bonded: {why}")]
    #[diagnostic(help(
        "give a contact law = \"unilateral_coulomb\" and a coefficient of friction; `dovetail run` computes the linear response"
    ))]
    AllBonded { why: &'static str },

    #[error(transparent)]
    Integration(#[from] IntegrationError),

    #[error(transparent)]
    Export(#[from] ExportError),

    /// Nothing vibrates about a static state that was not found.
    #[error(
        "the static state under the steady load was not found: {} after {iterations} Newton iterations, residual {residual:.1e} of the load",
        outcome.word()
    )]
    #[diagnostic(help(
        "take more steps (static.load_steps), a friction coefficient below 1, or look at static.csv and \
         flank_static.vtu: pairs that all slide, or all open, hold nothing"
    ))]
    StaticState {
        outcome: Outcome,
        iterations: usize,
        residual: f64,
    },

    #[error(
        "after {passes} passes of the prestress the normal forces still move by {change:.1e} of the largest one"
    )]
    #[diagnostic(help(
        "the stress of the static state changes the stiffness so much that the two do not settle: lower the load or the speed, raise \
         static.load_steps, or take prestress = \"held_flanks\" of [rotation]"
    ))]
    Prestress { passes: usize, change: f64 },

    /// The static state has slides that the method does not cover.
    #[error(
        "in the static state a pair slides farther than {} % of the shorter side of its flank",
        100.0 * TOO_FAR
    )]
    #[diagnostic(help(
        "the two sides of a pair are assumed to stay opposite each other. Look in static.csv for the pairs that slide. Check the units of \
         the loads and of young_pa, hold the body that slides (friction, supports, a [[contact]]), or load it less"
    ))]
    SlidesTooFar,

    /// Displacements that no linear computation covers.
    #[error("{what} of body `{body}` moves by {displacement}, more than the body is long ({size})")]
    #[diagnostic(help(
        "displacements are taken to be small: check the units of the loads, of young_pa and of the mesh, the supports, and the \
         force of the excitation. The files of the run hold its figures, which are those of no possible motion"
    ))]
    MovesTooFar {
        what: String,
        displacement: String,
        body: String,
        size: String,
    },

    /// No pair carries a normal force in the static state, and without them some body is free.
    #[error("nothing holds {what}: no pair is in contact in the static state")]
    #[diagnostic(help(
        "a support (key `fixed`) or a [[spring]] holds a body without its contacts. Else a steady load must press them \
         together: give [rotation] a speed_rpm above 0, an axis that throws the body outwards, and the body among those that carry \
         the load (rotation.bodies), or add a [[load]] towards the other body; it must close the clearance (gap_m, \
         crown_radius_m); the f_static.mtx of a reduced model must be negative on N"
    ))]
    NothingHolds {
        /// Bodies, and how they are free.
        what: String,
    },

    /// Frequencies over the speed were asked of a scene that does not rotate.
    #[error("frequencies over the speed were asked for, and the scene has no axis of rotation")]
    #[diagnostic(help(
        "give the scene a section [rotation] with an axis and any speed_rpm; --rpm takes the place of the speed"
    ))]
    NoRotation,

    /// `dovetail verify` with many steps of many periods.
    #[error("{periods} periods of {steps} steps are more than {most} steps")]
    #[diagnostic(help(
        "take fewer steps per period (--steps; 500 to 2000 are usual) or fewer periods (--periods, \
         --most-periods)"
    ))]
    TooManySteps {
        periods: usize,
        steps: usize,
        most: usize,
    },

    /// The time integration did not reach its steady state.
    #[error(
        "{frequency_hz:.4} Hz: not steady after {periods} periods, an estimated {left:.1e} of the transient is left"
    )]
    #[diagnostic(help(
        "allow more periods (--most-periods), accept more of the transient (--steady), or add damping; verify.csv \
         holds the last period. A motion whose transient does not decay may have no steady state of the period of \
         the excitation"
    ))]
    NotSteady {
        frequency_hz: f64,
        periods: usize,
        left: f64,
    },

    /// Harmonic balance and time integration disagree.
    #[error(
        "harmonic balance and time integration differ by {percent:.2} % at {frequency_hz:.4} Hz, more than {tolerance_percent} %"
    )]
    #[diagnostic(help(
        "take more harmonics (--set response.harmonics=7) and more steps per period (--steps), see which moves, or \
         allow more (--tolerance); near a peak several motions may exist, and each method may have found another"
    ))]
    Disagreement {
        frequency_hz: f64,
        percent: f64,
        tolerance_percent: f64,
    },

    /// Told before the first frequency.
    #[error("a frequency of the response, in {blocks} blocks of harmonics, does not fit in memory")]
    #[diagnostic(help(
        "take fewer response.harmonics (`response.accuracy` takes as few as it needs), the solver \"newton_krylov\", or fewer pairs"
    ))]
    TooLittleMemory { blocks: usize, source: TooLittle },

    /// Told when it was met.
    #[error(transparent)]
    #[diagnostic(transparent)]
    OutOfMemory(#[from] OutOfMemory),

    /// The run is complete, its files are written, but not every frequency has a solution.
    #[error("{unconverged} of {points} frequencies did not converge")]
    #[diagnostic(
        severity(Warning),
        help(
            "they are marked in the column `outcome` of response.csv and left out of the curves; more \
             response.max_newton_iterations, a smaller step in frequency (response.points), or the default \
             response.eps = \"dynamic\" with eps_scale = 1 may help"
        )
    )]
    NotConverged { unconverged: usize, points: usize },
}

impl RunError {
    /// How a command ends with this error.
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
            | Self::Quality(_)
            | Self::Model(_)
            | Self::NoMesh { .. }
            | Self::NoCache
            | Self::NoLinearMode
            | Self::UndampedMode { .. }
            | Self::Damping(_)
            | Self::AllBonded { .. }
            | Self::TooManySteps { .. }
            | Self::Export(
                ExportError::OtherScene { .. }
                | ExportError::OtherSettings { .. }
                | ExportError::OtherInputs { .. },
            )
            | Self::NoRotation => ExitStatus::BadInput,
            Self::Superelement(error) if !matches!(error, SuperelementError::Write { .. }) => {
                ExitStatus::BadInput
            }
            Self::Superelement(_)
            | Self::Gmsh(_)
            | Self::Fem(_)
            | Self::Reduction(_)
            | Self::Export(_)
            | Self::Integration(_)
            | Self::NotSteady { .. }
            | Self::Disagreement { .. }
            | Self::StaticState { .. }
            | Self::SlidesTooFar
            | Self::MovesTooFar { .. }
            | Self::Prestress { .. }
            | Self::TooLittleMemory { .. }
            | Self::OutOfMemory(_)
            | Self::NothingHolds { .. } => ExitStatus::Failed,
            Self::NotConverged { .. } => ExitStatus::NotConverged,
        }
    }
}
