//! The error of a run: that of its stage, or what the run itself finds.

use thiserror::Error as ThisError;

use crate::dlft::Outcome;
use crate::fem::FemError;
use crate::integration::IntegrationError;
use crate::model::ModelError;
use crate::reduction::ReductionError;
use crate::reduction::damping::DampingError;
use crate::reduction::superelement::SuperelementError;
use crate::results::far_slip::TOO_FAR;
use crate::results::modes::ModeKind;
use crate::results::rigid_motion::BodyMotion;
use crate::results::small::Moved;
use dovetail_numerics::memory::TooLittle;

/// Why a run ended without its full result.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// Names and meshes do not fit.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Elements that cannot be assembled.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// Bodies that cannot be reduced.
    #[error(transparent)]
    Reduction(#[from] ReductionError),
    /// A folder of a reduced model that cannot be read.
    #[error(transparent)]
    Superelement(#[from] SuperelementError),
    /// A ratio of damping that has no mode.
    #[error(transparent)]
    Damping(#[from] DampingError),
    /// Steps in time that came to no end.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// Bodies without a mesh, or a scene about a reduced model where bodies are needed.
    #[error("there is no mesh")]
    NoMesh,
    /// The range of frequencies counts from a mode that does not exist.
    #[error("the range of frequencies counts from the first linear mode, and this model has none")]
    NoLinearMode,
    /// A resonance without damping.
    #[error(
        "{frequency_hz} Hz: harmonic {harmonic} is at the frequency of {} mode {mode}, and there is no damping: where no pair \
         slips, opens or closes the answer is infinite",
        kind.id()
    )]
    UndampedMode {
        /// Frequency of the excitation, Hz.
        frequency_hz: f64,
        /// Harmonic that lies on the mode.
        harmonic: usize,
        /// Kind of the mode.
        kind: ModeKind,
        /// Number of the mode, 1 the lowest.
        mode: usize,
    },
    /// No contact can slip or open, and what was asked for needs one that can.
    #[error("all contacts are bonded: {why}")]
    AllBonded {
        /// What needs one.
        why: &'static str,
    },
    /// The static state was not found, and nothing vibrates about it.
    #[error(
        "the static state under the steady load was not found: {} after {iterations} Newton iterations, residual {residual:.1e} of the load",
        outcome.word()
    )]
    StaticState {
        /// How it ended.
        outcome: Outcome,
        /// Newton iterations of its last step.
        iterations: usize,
        /// Residual over the load.
        residual: f64,
    },
    /// The normal forces and the stress that they make do not settle.
    #[error(
        "after {passes} passes of the prestress the normal forces still move by {change:.1e} of the largest one"
    )]
    Prestress {
        /// Passes made.
        passes: usize,
        /// Largest change of a normal force over the largest one.
        change: f64,
    },
    /// The static state has slides that the method does not cover.
    #[error(
        "in the static state a pair slides farther than {} % of the shorter side of its flank",
        100.0 * TOO_FAR
    )]
    SlidesTooFar,
    /// Displacements that no linear computation covers.
    #[error(
        "{} of body `{}` moves by {:.3e} m, more than the body is long ({:.3e} m)",
        .0.what, .0.body, .0.displacement_m, .0.size_m
    )]
    MovesTooFar(Moved),
    /// No pair carries a normal force in the static state, and without them some body is free.
    #[error("nothing holds the bodies: no pair is in contact in the static state")]
    NothingHolds {
        /// How bodies are free; empty where nothing is known of them.
        motions: Vec<BodyMotion>,
    },
    /// Frequencies over the speed were asked of bodies that do not rotate.
    #[error("frequencies over the speed were asked for, and there is no axis of rotation")]
    NoRotation,
    /// Too many steps in time.
    #[error("{periods} periods of {steps} steps are more than {most} steps")]
    TooManySteps {
        /// Periods asked for.
        periods: usize,
        /// Steps of each.
        steps: usize,
        /// Most steps in all.
        most: usize,
    },
    /// The integration in time did not reach its steady state.
    #[error(
        "{frequency_hz:.4} Hz: not steady after {periods} periods, an estimated {left:.1e} of the transient is left"
    )]
    NotSteady {
        /// Frequency of the excitation, Hz.
        frequency_hz: f64,
        /// Periods integrated.
        periods: usize,
        /// Share of the transient that is left.
        left: f64,
    },
    /// Harmonic balance and integration in time disagree.
    #[error(
        "harmonic balance and time integration differ by {percent:.2} % at {frequency_hz:.4} Hz, more than {tolerance_percent} %"
    )]
    Disagreement {
        /// Frequency of the excitation, Hz.
        frequency_hz: f64,
        /// Largest difference.
        percent: f64,
        /// What was allowed.
        tolerance_percent: f64,
    },
    /// Told before the first frequency.
    #[error("a frequency of the response, in {blocks} blocks of harmonics, does not fit in memory")]
    TooLittleMemory {
        /// 2H+1.
        blocks: usize,
        /// What there is.
        source: TooLittle,
    },
    /// The run is complete, but not every frequency has a solution.
    #[error("{unconverged} of {points} frequencies did not converge")]
    NotConverged {
        /// Frequencies without a solution.
        unconverged: usize,
        /// All frequencies.
        points: usize,
    },
    /// The observer or the store ended the run.
    #[error("the run was ended by who listens to it")]
    Stopped,
}
