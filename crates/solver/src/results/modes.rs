//! Natural frequencies and mode shapes, for tables and fields.

use super::recovery::NodalField;
pub use dovetail_numerics::eigen::Modes;
use dovetail_numerics::space::signed_longest;

/// Constraint under which a mode vibrates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModeKind {
    /// One body with its flanks held (full model).
    FlanksHeld,
    /// One body with its flanks held, in the basis of Craig and Bampton.
    FixedInterface,
    /// Assembly with all pairs stuck.
    Stuck,
    /// Assembly with the pairs released that are open in the static state.
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

/// Natural frequency with its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct NaturalFrequency {
    /// Kind of the mode.
    pub kind: ModeKind,
    /// Name of the body; `None` for the assembly.
    pub body: Option<String>,
    /// Number of the mode, 1 the lowest.
    pub mode: usize,
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Modal mass of the shape whose longest displacement is 1, kg; `None` where no shape is known.
    pub modal_mass_kg: Option<f64>,
}

/// Mode shape on the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShape {
    /// Kind of the mode.
    pub kind: ModeKind,
    /// Name of the body that moves; `None` for the assembly.
    pub body: Option<String>,
    /// Number of the mode, 1 the lowest.
    pub mode: usize,
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Displacement of all nodes of each body, of modal mass 1.
    pub shape: Vec<NodalField>,
}

impl ModeShape {
    /// Longest displacement of a node, over the root of 1 kg, with the sign of its largest component; 0
    /// where nothing moves.
    pub fn scale(&self) -> f64 {
        signed_longest(self.shape.iter().flatten())
    }

    /// Modal mass of the shape whose longest displacement is 1, kg; `None` where nothing moves.
    pub fn modal_mass_kg(&self) -> Option<f64> {
        let scale = self.scale();
        (scale != 0.0).then(|| 1.0 / (scale * scale))
    }
}

/// Frequency of a squared angular frequency (rad2/s2), Hz.
pub fn hertz(omega2: f64) -> f64 {
    omega2.max(0.0).sqrt() / std::f64::consts::TAU
}
