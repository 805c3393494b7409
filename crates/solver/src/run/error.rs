//! Error of a run: that of its stage, or one that the run itself finds.

use thiserror::Error as ThisError;

use crate::damping::DampingError;
use crate::dlft::Outcome;
use crate::fem::FemError;
use crate::integration::IntegrationError;
use crate::model::ModelError;
use crate::reduction::ReductionError;
use crate::results::far_slip::TOO_FAR;
use crate::results::modes::ModeKind;
use crate::results::rigid_motion::BodyMotion;
use crate::results::small::Moved;
use crate::stability::Kind;
use dovetail_numerics::memory::TooLittle;

/// Place of a fault of a static state: a point of its load path, counted from 0, or its end.
pub fn static_place(point: Option<usize>) -> String {
    match point {
        None => "in the static state".to_owned(),
        Some(point) => format!("at point {} of [[static.path]]", point + 1),
    }
}

/// Reason why a run ended without its full result.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// Names and meshes do not match.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The elements cannot be assembled.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// The bodies cannot be reduced.
    #[error(transparent)]
    Reduction(#[from] ReductionError),
    /// The modes of a disc at a nodal diameter were not found.
    #[error("at {nodal_diameter} nodal diameters")]
    NodalDiameter {
        /// Nodal diameter.
        nodal_diameter: usize,
        /// Reason.
        source: ReductionError,
    },
    /// Nodal diameters are asked for, and the bodies are not a sector of a disc.
    #[error("the scene is not about a disc of equal sectors")]
    NoDisc,
    /// No wave of the disc has so many nodal diameters.
    #[error(
        "the largest nodal diameter of the disc is {largest}, half the number of its sectors, not {nodal_diameter}"
    )]
    TooManyDiameters {
        /// Nodal diameter that was asked for.
        nodal_diameter: usize,
        /// Largest one.
        largest: usize,
    },
    /// A task needs all sectors of a disc to move in phase, and the engine order excites a wave.
    #[error(
        "{task} needs all sectors of the disc in phase, and engine order {engine_order} of {sectors} sectors is a wave"
    )]
    NotInPhase {
        /// Task.
        task: &'static str,
        /// Engine order of the excitation.
        engine_order: usize,
        /// Number of sectors.
        sectors: usize,
    },
    /// A task does not know forces that the air returns to the blades.
    #[error("{task} has no aerodynamic influence")]
    WithInfluence {
        /// Task.
        task: &'static str,
    },
    /// The ratio of damping refers to a mode that does not exist.
    #[error(transparent)]
    Damping(#[from] DampingError),
    /// The integration in time failed.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// Bodies have no mesh, or the scene is about a reduced model where bodies are needed.
    #[error("there is no mesh")]
    NoMesh,
    /// The scene is about a reduced model, and meshes were given.
    #[error("there is no reduced model")]
    NoReducedModel,
    /// The range of frequencies refers to a mode that does not exist.
    #[error("the range of frequencies counts from the first linear mode, and this model has none")]
    NoLinearMode,
    /// A harmonic lies on a resonance without damping.
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
    /// No contact can slip or open, although the task needs one that can.
    #[error("all contacts are bonded: {why}")]
    AllBonded {
        /// Task that needs one.
        why: &'static str,
    },
    /// The value of a key changes the pairs, and a curve has one set of them.
    #[error(
        "at the value {value} there are {own} pairs, and {first} at the first value: a curve is followed over values \
         with the same pairs"
    )]
    OtherPairs {
        /// Value with other pairs.
        value: f64,
        /// Number of its pairs.
        own: usize,
        /// Number of pairs at the first value.
        first: usize,
    },
    /// The scene of a value cannot be read.
    #[error("the scene is none with this value")]
    NoScene,
    /// No motion was found at any value of a curve.
    #[error("there is no motion at any value of the range")]
    NoMotion,
    /// The static state was not found, so that nothing can vibrate about it.
    #[error(
        "the static state under the steady load was not found: {outcome} after {iterations} Newton iterations, residual {residual:.1e} of the load"
    )]
    StaticState {
        /// Outcome of the static state.
        outcome: Outcome,
        /// Newton iterations of its last step.
        iterations: usize,
        /// Residual relative to the load.
        residual: f64,
    },
    /// The normal forces and the stress that they cause do not converge.
    #[error(
        "after {passes} passes of the prestress the normal forces still move by {change:.1e} of the largest one"
    )]
    Prestress {
        /// Number of passes.
        passes: usize,
        /// Largest change of a normal force relative to the largest one.
        change: f64,
    },
    /// A pair slides too far in the static state for the method.
    #[error(
        "{} a pair slides farther than {} % of the shorter side of its flank",
        static_place(*point),
        100.0 * TOO_FAR
    )]
    SlidesTooFar {
        /// Number of the point of the load path, from 0; `None` for its end.
        point: Option<usize>,
    },
    /// Displacements are too large for a linear computation.
    #[error(
        "{} of body `{}` moves by {:.3e} m, more than the body is long ({:.3e} m)",
        .0.what, .0.body, .0.displacement_m, .0.size_m
    )]
    MovesTooFar(Moved),
    /// No pair carries a normal force in the static state, and without them some body is free.
    #[error("nothing holds the bodies: no pair is in contact {}", static_place(*point))]
    NothingHolds {
        /// Number of the point of the load path, from 0; `None` for its end.
        point: Option<usize>,
        /// Free motions of the bodies; empty where none are known.
        motions: Vec<BodyMotion>,
    },
    /// There is no observed displacement of this name, or none at all.
    #[error(
        "there is no observed displacement{}, but {}",
        name.as_ref().map_or(String::new(), |name| format!(" `{name}`")),
        if names.is_empty() { "none at all".to_owned() } else { names.join(", ") }
    )]
    NoObservation {
        /// Name that was asked for.
        name: Option<String>,
        /// Names that there are.
        names: Vec<String>,
    },
    /// A mode of the linear reference is asked for that there is not.
    #[error("there is no linear mode {asked}: the model has {available}")]
    NoSuchMode {
        /// Number that was asked for.
        asked: usize,
        /// Number of modes.
        available: usize,
    },
    /// No linear mode lies in the range of frequencies.
    #[error("no linear mode lies from {from_hz} Hz to {to_hz} Hz")]
    NoModeInRange {
        /// First frequency of the range, Hz.
        from_hz: f64,
        /// Last frequency of the range, Hz.
        to_hz: f64,
    },
    /// An observed displacement does not move in a mode, so that no amplitude of it is reached.
    #[error("`{name}` does not move in linear mode {mode}")]
    NotInMode {
        /// Number of the mode, 1 the lowest.
        mode: usize,
        /// Name of the observed displacement.
        name: String,
    },
    /// No motion of a backbone was found.
    #[error("no motion was found at any of the amplitudes")]
    NoBackbone,
    /// No contact wears.
    #[error("no contact has a coefficient of wear")]
    NoWear,
    /// The areas of the pairs are not known, which depths are worn over.
    #[error("the areas of the pairs are not known, and a depth is a volume over an area")]
    NoAreas,
    /// Blocks of few cycles do not reach the accuracy that is asked for, or lead to no motion.
    #[error(
        "at {cycles:.4e} cycles not even a block of {block:.1e} cycles is as accurate as asked for{}",
        why.as_ref().map_or(String::new(), |why| format!(": {why}"))
    )]
    WearStalls {
        /// Cycles that were reached.
        cycles: f64,
        /// Cycles of the last block that was tried.
        block: f64,
        /// Why it has no result, where it has none.
        why: Option<Box<Error>>,
    },
    /// The curve has no motion, and therefore no peak.
    #[error("no motion was found in the range of frequencies")]
    NoPeak,
    /// No motion is known at frequencies at which the resonance may be
    /// ([`uncomputed_resonance`](crate::results::peak::uncomputed_resonance)).
    #[error(
        "the resonance was not computed: no motion is known from {from_hz:.3} to {to_hz:.3} Hz"
    )]
    ResonanceNotComputed {
        /// First frequency of the stretch, Hz.
        from_hz: f64,
        /// Last frequency of the stretch, Hz.
        to_hz: f64,
    },
    /// The largest amplitude is at an end of the range.
    #[error("the amplitude still rises at {frequency_hz:.3} Hz, where the range ends")]
    PeakOutside {
        /// Frequency of that end, Hz.
        frequency_hz: f64,
    },
    /// Frequencies over the speed are asked for, but the bodies do not rotate.
    #[error("frequencies over the speed were asked for, and there is no axis of rotation")]
    NoRotation,
    /// A stage of a run-up failed at one of its speeds.
    #[error("at {speed_rpm} rpm: {error}")]
    AtSpeed {
        /// Speed of rotation, rpm.
        speed_rpm: f64,
        /// Error of the stage.
        error: Box<Error>,
    },
    /// A task that goes along the frequency at one speed is asked of a response along an engine
    /// order.
    #[error("the response goes along an engine order: {why}")]
    AlongEngineOrder {
        /// Why the task does not.
        why: &'static str,
    },
    /// There are too many steps in time.
    #[error("{periods} periods of {steps} steps are more than {most} steps")]
    TooManySteps {
        /// Number of periods asked for.
        periods: usize,
        /// Steps per period.
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
        /// Fraction of the transient that is left.
        left: f64,
    },
    /// Harmonic balance and integration in time disagree.
    #[error(
        "harmonic balance and time integration differ by {percent:.2} % at {frequency_hz:.4} Hz, more than {tolerance_percent} %"
    )]
    Disagreement {
        /// Frequency of the excitation, Hz.
        frequency_hz: f64,
        /// Largest difference, %.
        percent: f64,
        /// Largest difference allowed, %.
        tolerance_percent: f64,
    },
    /// An integration in time stays on a motion that was judged unstable.
    #[error(
        "{frequency_hz:.4} Hz: the integration in time stays on a motion that was judged unstable"
    )]
    Stays {
        /// Frequency of the excitation, Hz.
        frequency_hz: f64,
    },
    /// The memory does not suffice, which is reported before the first frequency.
    #[error("a frequency of the response, in {blocks} blocks of harmonics, does not fit in memory")]
    TooLittleMemory {
        /// Number of blocks, 2H+1.
        blocks: usize,
        /// Memory needed and available.
        source: TooLittle,
    },
    /// The run is complete, but not every frequency converged.
    #[error("{unconverged} of {points} frequencies did not converge")]
    NotConverged {
        /// Number of frequencies that did not converge.
        unconverged: usize,
        /// Number of those that have a motion, and miss the accuracy asked for.
        inaccurate: usize,
        /// Number of those at which the bodies come apart, slide too far, or are held by nothing.
        not_held: usize,
        /// Number of all frequencies.
        points: usize,
    },
    /// The run is complete, but a peak is unstable.
    #[error("the peak at {frequency_hz:.4} Hz is unstable ({}): the structure does not stay in this motion", kind.to_string().replace('_', " "))]
    UnstablePeak {
        /// Frequency of the peak, Hz.
        frequency_hz: f64,
        /// Kind of its instability.
        kind: Kind,
    },
    /// The observer or the store ended the run.
    #[error("the run was ended by who listens to it")]
    Stopped,
}
