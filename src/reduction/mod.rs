//! [`Structure`](crate::fem::Structure) -> [`ReducedModel`]: Craig-Bampton per body, then relative
//! displacements of the pairs and modes of the stuck assembly.

pub mod superelement;

use faer::Mat;

/// What the contact solver sees: the assembly on the relative displacements X of the pairs
/// (n = 3 pairs unknowns, per pair N, t1, t2) and on the modes of the stuck assembly (X = 0).
///
/// With q the modal amplitudes: `K X + M X'' + p q'' + lambda = F`, `q'' + w^2 q + p^T X'' = fm`
/// (Rayleigh damping `a K + b M` alongside).
#[derive(Debug, Clone)]
pub struct RelativeModel {
    /// Static stiffness on X, N/m, n x n.
    pub stiffness: Mat<f64>,
    /// Mass on X with the rest following statically, kg, n x n.
    pub mass: Mat<f64>,
    /// p: mass coupling of X to the stuck modes (mass-normalised), n x m.
    pub coupling: Mat<f64>,
    /// Squared angular frequencies of the stuck modes, rad2/s2, ascending, m.
    pub omega2: Vec<f64>,
    /// Static (centrifugal) load on X and on the modes.
    pub static_load: Load,
    /// Harmonic loads, by harmonic; several of one harmonic are already added.
    pub excitations: Vec<HarmonicLoad>,
    pub observations: Vec<Probe>,
    /// One entry per pair.
    pub pairs: Vec<PairLaw>,
}

/// A load on X (n) and on the stuck modes (m).
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    pub on_x: Vec<f64>,
    pub on_modes: Vec<f64>,
}

/// `cosine cos(k w t) + sine sin(k w t)`, k = `harmonic`.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicLoad {
    pub harmonic: usize,
    pub cosine: Load,
    pub sine: Load,
}

/// An observed displacement `on_x . X + on_modes . q`.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    pub name: String,
    pub on_x: Vec<f64>,
    pub on_modes: Vec<f64>,
}

/// What the contact law needs of one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairLaw {
    pub friction: f64,
    /// Initial clearance, m.
    pub gap_m: f64,
}
