//! [`Model`](crate::model::Model) -> [`Structure`]: stiffness, mass and loads per body, rotation only if asked.

use nalgebra_sparse::CscMatrix;

/// Matrices of both bodies on their free degrees of freedom.
#[derive(Debug, Clone)]
pub struct Structure {
    pub bodies: [BodyMatrices; 2],
}

/// Symmetric matrices of one body on its free dofs ([`DofMap`](crate::model::DofMap): interior, flank, probe),
/// stored whole (both triangles), row indices ascending in each column.
#[derive(Debug, Clone)]
pub struct BodyMatrices {
    /// K, N/m, with geometric stiffness and spin softening where the scene asks for them.
    pub stiffness: CscMatrix<f64>,
    /// M, kg.
    pub mass: CscMatrix<f64>,
    /// Centrifugal load, N (zeros where the body does not rotate).
    pub load_n: Vec<f64>,
    /// Mass of the body, kg.
    pub total_mass_kg: f64,
}
