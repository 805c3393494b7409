//! Integrals over one element: isotropic linear elasticity, consistent mass, geometric stiffness.
//!
//! With g_a the gradient of shape function a, for nodes a and b,
//!
//!   K_ab = integral of  lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I   (3 x 3)
//!   M_ab = integral of  rho N_a N_b                                          (times I)
//!   G_ab = integral of  g_a^T sigma g_b                                      (times I)
//!
//! (Zienkiewicz and Taylor, The Finite Element Method, vol. 1 ch. 6 and vol. 2 ch. 10; Bathe,
//! Finite Element Procedures, 6.2.) G is the geometric (initial stress) stiffness under the stress
//! sigma.

use super::tables::ShapeTable;
use crate::model::Material;
use dovetail_numerics::space::{cross, dot};

/// Lame's constants, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lame {
    /// First Lame parameter, Pa.
    pub lambda_pa: f64,
    /// Shear modulus, Pa.
    pub mu_pa: f64,
}

impl From<Material> for Lame {
    fn from(m: Material) -> Self {
        Self {
            lambda_pa: m.young_pa * m.poisson / ((1.0 + m.poisson) * (1.0 - 2.0 * m.poisson)),
            mu_pa: m.young_pa / (2.0 * (1.0 + m.poisson)),
        }
    }
}

/// Map from the reference element to space, at a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Map {
    /// Determinant of the Jacobian, m3. Where it is not positive, gradients have no meaning.
    pub determinant_m3: f64,
    /// Inverse of the transposed Jacobian, row by row: it maps reference gradients to space.
    inverse_transposed: [[f64; 3]; 3],
}

impl Map {
    /// Map of an element with its nodes at `coords_m`, at a point where its shape functions have
    /// these gradients.
    pub(crate) fn new<const N: usize>(coords_m: &[[f64; 3]; N], reference: &[[f64; 3]; N]) -> Self {
        let j = jacobian(coords_m, reference);
        // Rows of the cofactor matrix; J^-T = cofactor / det.
        let cofactor = [cross(j[1], j[2]), cross(j[2], j[0]), cross(j[0], j[1])];
        let determinant_m3 = dot(j[0], cofactor[0]);
        let inverse = 1.0 / determinant_m3;
        Self {
            determinant_m3,
            inverse_transposed: cofactor.map(|row| row.map(|c| c * inverse)),
        }
    }

    /// Gradients in space (1/m) from those in the reference element.
    pub(crate) fn gradients<const N: usize>(&self, reference: &[[f64; 3]; N]) -> [[f64; 3]; N] {
        reference.map(|g| self.inverse_transposed.map(|row| dot(row, g)))
    }
}

/// Jacobian determinant of the map from the reference element, and the gradients of the shape
/// functions in space (1/m), from their reference gradients.
pub fn map_gradients<const N: usize>(
    coords_m: &[[f64; 3]; N],
    reference: &[[f64; 3]; N],
) -> (f64, [[f64; 3]; N]) {
    let map = Map::new(coords_m, reference);
    (map.determinant_m3, map.gradients(reference))
}

/// Determinant of the map from the reference element, m3.
pub(crate) fn determinant<const N: usize>(
    coords_m: &[[f64; 3]; N],
    reference: &[[f64; 3]; N],
) -> f64 {
    let j = jacobian(coords_m, reference);
    dot(j[0], cross(j[1], j[2]))
}

/// Element stiffness, N/m: block (a, b), row by row, at `a N + b`.
pub(crate) fn stiffness<const N: usize>(
    coords_m: &[[f64; 3]; N],
    table: &ShapeTable<N>,
    lame: Lame,
    out: &mut [[f64; 9]],
) {
    out.fill([0.0; 9]);
    for (reference, weight) in table.gradients.iter().zip(&table.weights) {
        let (det, g) = map_gradients(coords_m, reference);
        add_stiffness(&g, det * weight, lame, out);
    }
    mirror_blocks(N, out);
}

/// Adds the contribution of a point of quadrature to the stiffness, on and below the diagonal. `g`
/// are the gradients there, `volume_m3` is the point's part of the volume.
pub(crate) fn add_stiffness<const N: usize>(
    g: &[[f64; 3]; N],
    volume_m3: f64,
    lame: Lame,
    out: &mut [[f64; 9]],
) {
    let (lambda, mu) = (lame.lambda_pa * volume_m3, lame.mu_pa * volume_m3);
    for a in 0..N {
        let (lambda_g, mu_g) = (g[a].map(|x| lambda * x), g[a].map(|x| mu * x));
        for b in 0..=a {
            let shear = dot(mu_g, g[b]);
            let block = &mut out[a * N + b];
            for r in 0..3 {
                for c in 0..3 {
                    block[3 * r + c] += lambda_g[r] * g[b][c] + mu_g[c] * g[b][r];
                }
                block[4 * r] += shear;
            }
        }
    }
}

/// Fills the blocks above the diagonal of `n` times `n` with the transposed ones below.
pub(crate) fn mirror_blocks(n: usize, out: &mut [[f64; 9]]) {
    for a in 0..n {
        for b in 0..a {
            let t = out[a * n + b];
            out[b * n + a] = [t[0], t[3], t[6], t[1], t[4], t[7], t[2], t[5], t[8]];
        }
    }
}

/// Element mass, kg: M_ab at `a N + b`.
pub(crate) fn mass<const N: usize>(
    coords_m: &[[f64; 3]; N],
    table: &ShapeTable<N>,
    density_kg_m3: f64,
    out: &mut [[f64; 1]],
) {
    out.fill([0.0]);
    let points = table
        .gradients
        .iter()
        .zip(&table.shapes)
        .zip(&table.weights);
    for ((reference, n), weight) in points {
        let dm = density_kg_m3 * determinant(coords_m, reference) * weight;
        for a in 0..N {
            for b in 0..=a {
                out[a * N + b][0] += dm * n[a] * n[b];
            }
        }
    }
    mirror(N, out);
}

/// Element geometric stiffness, N/m, under a stress that is given at each point of the table from
/// the gradients there: G_ab at `a N + b`.
pub(crate) fn geometric_stiffness<const N: usize>(
    coords_m: &[[f64; 3]; N],
    table: &ShapeTable<N>,
    stress_pa: impl Fn(usize, &[[f64; 3]; N]) -> [f64; 6],
    out: &mut [[f64; 1]],
) {
    out.fill([0.0]);
    let points = table.gradients.iter().zip(&table.weights).enumerate();
    for (point, (reference, weight)) in points {
        let (det, g) = map_gradients(coords_m, reference);
        let s = stress_pa(point, &g);
        let dv = det * weight;
        for a in 0..N {
            let sg = [
                dv * (s[0] * g[a][0] + s[3] * g[a][1] + s[5] * g[a][2]),
                dv * (s[3] * g[a][0] + s[1] * g[a][1] + s[4] * g[a][2]),
                dv * (s[5] * g[a][0] + s[4] * g[a][1] + s[2] * g[a][2]),
            ];
            for b in 0..=a {
                out[a * N + b][0] += dot(sg, g[b]);
            }
        }
    }
    mirror(N, out);
}

/// Stress xx, yy, zz, xy, yz, xz (Pa) where the shape functions have the given gradients.
pub(crate) fn stress_at<const N: usize>(
    gradients: &[[f64; 3]; N],
    displacement_m: &[[f64; 3]; N],
    lame: Lame,
) -> [f64; 6] {
    let mut h = [[0.0; 3]; 3];
    for (u, g) in displacement_m.iter().zip(gradients) {
        for r in 0..3 {
            for c in 0..3 {
                h[r][c] += u[r] * g[c];
            }
        }
    }
    let pressure = lame.lambda_pa * (h[0][0] + h[1][1] + h[2][2]);
    let mu = lame.mu_pa;
    [
        pressure + 2.0 * mu * h[0][0],
        pressure + 2.0 * mu * h[1][1],
        pressure + 2.0 * mu * h[2][2],
        mu * (h[0][1] + h[1][0]),
        mu * (h[1][2] + h[2][1]),
        mu * (h[0][2] + h[2][0]),
    ]
}

fn jacobian<const N: usize>(coords_m: &[[f64; 3]; N], reference: &[[f64; 3]; N]) -> [[f64; 3]; 3] {
    let mut j = [[0.0; 3]; 3];
    for (x, g) in coords_m.iter().zip(reference) {
        for r in 0..3 {
            for c in 0..3 {
                j[r][c] += x[r] * g[c];
            }
        }
    }
    j
}

fn mirror(n: usize, out: &mut [[f64; 1]]) {
    for a in 0..n {
        for b in 0..a {
            out[b * n + a] = out[a * n + b];
        }
    }
}
