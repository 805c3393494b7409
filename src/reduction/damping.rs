//! Rayleigh damping.

/// C = stiffness_s K + mass_per_s M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rayleigh {
    pub stiffness_s: f64,
    pub mass_per_s: f64,
}
