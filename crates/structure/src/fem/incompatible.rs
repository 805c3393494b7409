//! Eight-node hexahedron with incompatible modes.
//!
//! The linear hexahedron locks in bending: it shears instead. Three internal functions 1 - xi^2,
//! 1 - eta^2, 1 - zeta^2 for each component of the displacement, which stop at the element's faces,
//! let it bend (Wilson, Taylor, Doherty, Ghaboussi 1973). Their gradients in space are taken by the
//! Jacobian J_0 of the middle, scaled by det J_0 / det J, so that the element passes the patch test
//! whatever its form (Taylor, Beresford, Wilson, Int. J. Numer. Meth. Engng 10 (1976) 1211-1219).
//! The nine unknowns are condensed out of the stiffness; they have no mass.

use nalgebra_sparse::na::SMatrix;

use super::elasticity::{self, Lame, Map, add_stiffness, mirror_blocks, stress_at};
use super::element::{Deformed, Element, ElementForm, Isoparametric, nodal};
use super::tables::ShapeTable;
use dovetail_mesh::element::ElementType;
use dovetail_mesh::interpolation::{centre, reference_nodes};
use dovetail_mesh::quadrature::Rule;

const N: usize = 8;
/// Number of nodes and internal functions.
const ALL: usize = N + 3;

/// Element of eight nodes with incompatible modes.
#[derive(Debug)]
pub(crate) struct IncompatibleHexahedron {
    compatible: Isoparametric<N>,
    at_points: Internal,
    at_nodes: Internal,
    at_centre: Internal,
}

/// Reference gradients of the three internal functions at some points.
type Internal = Vec<[[f64; 3]; 3]>;

/// Reference gradients of 1 - xi^2, 1 - eta^2, 1 - zeta^2 at some points.
fn internal(points: &[[f64; 3]]) -> Internal {
    let at = |p: &[f64; 3]| {
        [0, 1, 2].map(|k| {
            let mut gradient = [0.0; 3];
            gradient[k] = -2.0 * p[k];
            gradient
        })
    };
    points.iter().map(at).collect()
}

impl IncompatibleHexahedron {
    /// Element with its tables.
    pub(crate) fn new() -> Self {
        let element = ElementType::HEX8;
        Self {
            compatible: Isoparametric::new(element),
            at_points: internal(&Rule::cube(2).points),
            at_nodes: internal(&reference_nodes(element)),
            at_centre: internal(&[centre(element.shape)]),
        }
    }

    /// Gradients in space of nodes and internal functions, and the Jacobian determinant.
    fn gradients(
        &self,
        coords_m: &[[f64; 3]; N],
        reference: &[[f64; 3]; N],
        internal: &[[f64; 3]; 3],
    ) -> (f64, [[f64; 3]; ALL]) {
        let tables = &self.compatible.tables;
        let middle = Map::new(coords_m, &tables.centre.gradients[0]);
        let here = Map::new(coords_m, reference);
        let scale = middle.determinant_m3 / here.determinant_m3;
        let mut gradients = [[0.0; 3]; ALL];
        gradients[..N].copy_from_slice(&here.gradients(reference));
        let internal = middle.gradients(internal);
        gradients[N..].copy_from_slice(&internal.map(|g| g.map(|g| scale * g)));
        (here.determinant_m3, gradients)
    }

    /// Stiffness on nodes and internal functions.
    fn whole_stiffness(&self, coords_m: &[[f64; 3]; N], lame: Lame) -> Vec<[f64; 9]> {
        let table = &self.compatible.tables.stiffness;
        let points = table.gradients.iter().zip(&table.weights);
        let mut whole = vec![[0.0; 9]; ALL * ALL];
        for ((reference, weight), internal) in points.zip(&self.at_points) {
            let (det, g) = self.gradients(coords_m, reference, internal);
            add_stiffness(&g, det * weight, lame, &mut whole);
        }
        mirror_blocks(ALL, &mut whole);
        whole
    }

    /// Positions of the nodes, and displacements of nodes and internal functions: the internal ones
    /// are in equilibrium under those of the nodes.
    fn whole_displacement<'a>(
        &self,
        deformed: &Deformed<'a>,
    ) -> (&'a [[f64; 3]; N], [[f64; 3]; ALL]) {
        let coords_m = nodal(deformed.coords_m);
        let displacement_m: &[[f64; 3]; N] = nodal(deformed.displacement_m);
        let whole = self.whole_stiffness(coords_m, deformed.lame);
        let mut displacements = [[0.0; 3]; ALL];
        displacements[..N].copy_from_slice(displacement_m);
        let mut force = SMatrix::<f64, 9, 1>::zeros();
        for i in 0..9 {
            for (b, u) in displacement_m.iter().enumerate() {
                let block = whole[(N + i / 3) * ALL + b];
                force[i] -= (0..3).map(|c| block[3 * (i % 3) + c] * u[c]).sum::<f64>();
            }
        }
        if let Some(factor) = internal_part(&whole).cholesky() {
            let internal = factor.solve(&force);
            for i in 0..9 {
                displacements[N + i / 3][i % 3] = internal[i];
            }
        }
        (coords_m, displacements)
    }

    /// Stress where nodes and internal functions have these reference gradients.
    fn stress(
        &self,
        coords_m: &[[f64; 3]; N],
        displacement_m: &[[f64; 3]; ALL],
        reference: &[[f64; 3]; N],
        internal: &[[f64; 3]; 3],
        lame: Lame,
    ) -> [f64; 6] {
        let (_, g) = self.gradients(coords_m, reference, internal);
        stress_at(&g, displacement_m, lame)
    }

    /// Stress at each point of a table, where the internal functions have the reference gradients
    /// `internal`.
    fn stress_at_all(
        &self,
        deformed: &Deformed<'_>,
        table: &ShapeTable<N>,
        internal: &Internal,
    ) -> Vec<[f64; 6]> {
        let (coords, u) = self.whole_displacement(deformed);
        let points = table.gradients.iter().zip(internal);
        points
            .map(|(reference, internal)| {
                self.stress(coords, &u, reference, internal, deformed.lame)
            })
            .collect()
    }
}

impl Default for IncompatibleHexahedron {
    fn default() -> Self {
        Self::new()
    }
}

/// Part of the stiffness between internal functions.
fn internal_part(whole: &[[f64; 9]]) -> SMatrix<f64, 9, 9> {
    SMatrix::from_fn(|i, j| whole[(N + i / 3) * ALL + N + j / 3][3 * (i % 3) + j % 3])
}

impl Element for IncompatibleHexahedron {
    fn form(&self, coords_m: &[[f64; 3]]) -> ElementForm {
        self.compatible.form(coords_m)
    }

    fn stiffness(&self, coords_m: &[[f64; 3]], _affine: bool, lame: Lame, out: &mut [[f64; 9]]) {
        let whole = self.whole_stiffness(nodal(coords_m), lame);
        let between = SMatrix::<f64, 9, 24>::from_fn(|i, j| {
            whole[(N + i / 3) * ALL + j / 3][3 * (i % 3) + j % 3]
        });
        let factor = internal_part(&whole).cholesky();
        // K - B^T B, B = L^-1 K_between. The result is not finite where the matrix is not positive
        // definite, as for an element whose form is refused.
        let condensed = factor.and_then(|f| f.l().solve_lower_triangular(&between));
        let condensed = condensed.unwrap_or_else(|| SMatrix::from_element(f64::NAN));
        for a in 0..N {
            for b in 0..=a {
                let mut block = whole[a * ALL + b];
                for r in 0..3 {
                    for c in 0..3 {
                        let (left, right) = (3 * a + r, 3 * b + c);
                        block[3 * r + c] -= condensed.column(left).dot(&condensed.column(right));
                    }
                }
                out[a * N + b] = block;
            }
        }
        mirror_blocks(N, out);
    }

    fn mass(&self, coords_m: &[[f64; 3]], affine: bool, density_kg_m3: f64, out: &mut [[f64; 1]]) {
        self.compatible.mass(coords_m, affine, density_kg_m3, out);
    }

    fn geometric_stiffness(&self, deformed: &Deformed<'_>, out: &mut [[f64; 1]]) {
        let (coords, u) = self.whole_displacement(deformed);
        let lame = deformed.lame;
        let table: &ShapeTable<N> = &self.compatible.tables.stiffness;
        let stress = |point: usize, _: &[[f64; 3]; N]| {
            let (reference, internal) = (&table.gradients[point], &self.at_points[point]);
            self.stress(coords, &u, reference, internal, lame)
        };
        elasticity::geometric_stiffness(coords, table, stress, out);
    }

    fn centre_stress(&self, deformed: &Deformed<'_>) -> [f64; 6] {
        let (coords, u) = self.whole_displacement(deformed);
        let lame = deformed.lame;
        let reference = &self.compatible.tables.centre.gradients[0];
        self.stress(coords, &u, reference, &self.at_centre[0], lame)
    }

    fn nodal_stress(&self, deformed: &Deformed<'_>, out: &mut [[f64; 6]]) {
        let table = &self.compatible.tables.nodes;
        out.copy_from_slice(&self.stress_at_all(deformed, table, &self.at_nodes));
    }

    fn points_m(&self, coords_m: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.compatible.points_m(coords_m)
    }

    fn point_stress(&self, deformed: &Deformed<'_>) -> Vec<[f64; 6]> {
        self.stress_at_all(deformed, self.compatible.points(), &self.at_points)
    }
}
