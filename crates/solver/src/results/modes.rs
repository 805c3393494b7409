//! Natural frequencies and mode shapes, as tables and fields name them.

use super::recovery::NodalField;
pub use dovetail_numerics::eigen::Modes;

/// What is held while a mode vibrates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModeKind {
    /// One body, its flanks held (full model).
    FlanksHeld,
    /// One body, its flanks held, in the basis of Craig and Bampton.
    FixedInterface,
    /// The assembly with all pairs stuck.
    Stuck,
    /// The assembly with the pairs released that are open in the static state.
    Linear,
}

impl ModeKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [
        Self::FlanksHeld,
        Self::FixedInterface,
        Self::Stuck,
        Self::Linear,
    ];

    /// Name for programs.
    pub fn id(self) -> &'static str {
        match self {
            Self::FlanksHeld => "flanks_held",
            Self::FixedInterface => "fixed_interface",
            Self::Stuck => "stuck",
            Self::Linear => "linear",
        }
    }
}

/// A natural frequency with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct NaturalFrequency {
    /// What is held.
    pub kind: ModeKind,
    /// Name of the body; `None` for the assembly.
    pub body: Option<String>,
    /// Number of the mode, 1 the lowest.
    pub mode: usize,
    /// Hz.
    pub frequency_hz: f64,
}

/// A mode shape on the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShape {
    /// What is held.
    pub kind: ModeKind,
    /// Name of the body that moves; `None` for the assembly.
    pub body: Option<String>,
    /// Number of the mode, 1 the lowest.
    pub mode: usize,
    /// Hz.
    pub frequency_hz: f64,
    /// Displacement of all nodes of each body, of modal mass 1.
    pub shape: Vec<NodalField>,
}

/// Frequency of a squared angular frequency (rad2/s2), Hz.
pub fn hertz(omega2: f64) -> f64 {
    omega2.max(0.0).sqrt() / std::f64::consts::TAU
}
