//! Integrals over one element, whatever its type.

use super::elasticity::{self, Lame, determinant, map_gradients, stress_at};
use super::tables::{ShapeTable, Tables};
use dovetail_mesh::element::ElementType;
use dovetail_numerics::space::{add_scaled, distance, middle};

/// Largest number of nodes of an element.
pub(crate) const MOST_NODES: usize = 20;

/// Mid-edge nodes this close to the middle, relative to the length of the edge, count as straight.
const STRAIGHTNESS: f64 = 1e-10;

/// Integrals over elements of one type. Slices of nodal values have one entry for each node,
/// matrices one for each pair of nodes, row by row.
pub trait Element: Sync + Send {
    /// Form of the element.
    fn form(&self, coords_m: &[[f64; 3]]) -> ElementForm;

    /// Stiffness, N/m, in blocks of 3 x 3. `affine` is that of [`Element::form`].
    fn stiffness(&self, coords_m: &[[f64; 3]], affine: bool, lame: Lame, out: &mut [[f64; 9]]);

    /// Consistent mass, kg, times the identity.
    fn mass(&self, coords_m: &[[f64; 3]], affine: bool, density_kg_m3: f64, out: &mut [[f64; 1]]);

    /// Geometric stiffness, N/m, times the identity, under the linear stress of nodal
    /// displacements.
    fn geometric_stiffness(&self, deformed: &Deformed<'_>, out: &mut [[f64; 1]]);

    /// Stress in the middle, Pa: xx, yy, zz, xy, yz, xz.
    fn centre_stress(&self, deformed: &Deformed<'_>) -> [f64; 6];

    /// Stress at each node, Pa.
    fn nodal_stress(&self, deformed: &Deformed<'_>, out: &mut [[f64; 6]]);

    /// Positions of the integration points, m: those of the rule that is exact for the stiffness of
    /// an element with straight edges.
    fn points_m(&self, coords_m: &[[f64; 3]]) -> Vec<[f64; 3]>;

    /// Stress at each of [`Element::points_m`], Pa.
    fn point_stress(&self, deformed: &Deformed<'_>) -> Vec<[f64; 6]>;
}

/// Element under a displacement of its nodes.
#[derive(Debug, Clone, Copy)]
pub struct Deformed<'a> {
    /// Positions of the nodes, m, in the order of the element.
    pub coords_m: &'a [[f64; 3]],
    /// Displacements of the nodes, m, in the same order.
    pub displacement_m: &'a [[f64; 3]],
    /// Elastic constants.
    pub lame: Lame,
}

impl<'a> Deformed<'a> {
    /// Element of these positions and displacements, m, of its nodes.
    pub fn new(coords_m: &'a [[f64; 3]], displacement_m: &'a [[f64; 3]], lame: Lame) -> Self {
        Self {
            coords_m,
            displacement_m,
            lame,
        }
    }
}

/// Form of an element.
#[derive(Debug, Clone, Copy)]
pub struct ElementForm {
    /// Smallest Jacobian determinant over the cube of the longest edge; NaN where that edge is zero
    /// or a coordinate is not finite.
    pub flatness: f64,
    /// True for a tetrahedron with straight edges, whose Jacobian is the same everywhere.
    pub affine: bool,
    /// Volume, m3.
    pub volume_m3: f64,
}

/// Element whose displacement is interpolated like its positions.
#[derive(Debug)]
pub struct Isoparametric<const N: usize> {
    element: ElementType,
    /// Shape functions.
    pub tables: Tables<N>,
    /// Mass of an affine element per unit density and Jacobian determinant.
    reference_mass: Vec<f64>,
}

impl<const N: usize> Isoparametric<N> {
    /// Element of a type with `N` nodes.
    pub fn new(element: ElementType) -> Self {
        let tables = Tables::new(element);
        let mut reference_mass = vec![0.0; N * N];
        for (n, weight) in tables.mass.shapes.iter().zip(&tables.mass.weights) {
            for a in 0..N {
                for b in 0..N {
                    reference_mass[a * N + b] += weight * n[a] * n[b];
                }
            }
        }
        Self {
            element,
            tables,
            reference_mass,
        }
    }

    /// Table at the integration points of an element with straight edges.
    pub(super) fn points(&self) -> &ShapeTable<N> {
        self.tables
            .affine
            .as_ref()
            .unwrap_or(&self.tables.stiffness)
    }

    /// Stress at each point of a table.
    fn stress_at_all(&self, deformed: &Deformed<'_>, table: &ShapeTable<N>) -> Vec<[f64; 6]> {
        let coords = nodal(deformed.coords_m);
        let displacement = nodal(deformed.displacement_m);
        let centre = &self.tables.centre.gradients[0];
        let (middle, in_middle) = map_gradients(coords, centre);
        let at = |reference: &[[f64; 3]; N]| {
            let (det, gradients) = map_gradients(coords, reference);
            // A curved element may be pinched at a node, though valid at its quadrature points, and
            // a pyramid is pinched at its apex.
            let gradients = if det > PINCHED * middle {
                gradients
            } else {
                in_middle
            };
            stress_at::<N>(&gradients, displacement, deformed.lame)
        };
        table.gradients.iter().map(at).collect()
    }

    /// Returns `true` if the Jacobian is known to be the same everywhere.
    fn is_affine(&self, coords_m: &[[f64; 3]; N]) -> bool {
        let edges = self.element.shape.edges().iter();
        let middles = &coords_m[self.element.shape.corners()..];
        self.tables.affine.is_some()
            && edges.zip(middles).all(|(&[a, b], m)| {
                let (a, b) = (coords_m[a], coords_m[b]);
                distance(*m, middle(a, b)) <= STRAIGHTNESS * distance(a, b)
            })
    }
}

/// Values at an element's nodes, as an array.
pub(super) fn nodal<const N: usize>(values: &[[f64; 3]]) -> &[[f64; 3]; N] {
    values
        .try_into()
        .expect("one value for each node of the element")
}

impl<const N: usize> Element for Isoparametric<N> {
    fn form(&self, coords_m: &[[f64; 3]]) -> ElementForm {
        let coords = nodal(coords_m);
        let lengths = self.element.shape.edges().iter();
        let longest = lengths
            .map(|&[a, b]| distance(coords[a], coords[b]))
            .fold(0.0, f64::max);
        let affine = self.is_affine(coords);
        let (mut smallest, mut volume_m3) = (f64::INFINITY, 0.0);
        let mass = &self.tables.mass;
        for (reference, weight) in mass.gradients.iter().zip(&mass.weights) {
            let det = determinant(coords, reference);
            smallest = smallest.min(det);
            volume_m3 += weight * det;
        }
        if !affine {
            let others = [&self.tables.stiffness, &self.tables.centre];
            for reference in others.iter().flat_map(|table| &table.gradients) {
                smallest = smallest.min(determinant(coords, reference));
            }
        }
        // Minima skip NaN, sums do not.
        let flatness = if volume_m3.is_finite() {
            smallest / longest.powi(3)
        } else {
            f64::NAN
        };
        ElementForm {
            flatness,
            affine,
            volume_m3,
        }
    }

    fn stiffness(&self, coords_m: &[[f64; 3]], affine: bool, lame: Lame, out: &mut [[f64; 9]]) {
        let enough = self.tables.affine.as_ref().filter(|_| affine);
        let table: &ShapeTable<N> = enough.unwrap_or(&self.tables.stiffness);
        elasticity::stiffness(nodal(coords_m), table, lame, out);
    }

    fn mass(&self, coords_m: &[[f64; 3]], affine: bool, density_kg_m3: f64, out: &mut [[f64; 1]]) {
        let coords = nodal(coords_m);
        if affine {
            let det = determinant(coords, &self.tables.centre.gradients[0]);
            for (m, reference) in out.iter_mut().zip(&self.reference_mass) {
                m[0] = density_kg_m3 * det * reference;
            }
        } else {
            elasticity::mass(coords, &self.tables.mass, density_kg_m3, out);
        }
    }

    fn geometric_stiffness(&self, deformed: &Deformed<'_>, out: &mut [[f64; 1]]) {
        let (coords, u) = (nodal(deformed.coords_m), nodal(deformed.displacement_m));
        let stress = |_, g: &[[f64; 3]; N]| stress_at(g, u, deformed.lame);
        elasticity::geometric_stiffness(coords, &self.tables.stiffness, stress, out);
    }

    fn centre_stress(&self, deformed: &Deformed<'_>) -> [f64; 6] {
        let coords = nodal(deformed.coords_m);
        let (_, gradients) = map_gradients(coords, &self.tables.centre.gradients[0]);
        stress_at::<N>(&gradients, nodal(deformed.displacement_m), deformed.lame)
    }

    fn nodal_stress(&self, deformed: &Deformed<'_>, out: &mut [[f64; 6]]) {
        out.copy_from_slice(&self.stress_at_all(deformed, &self.tables.nodes));
    }

    fn points_m(&self, coords_m: &[[f64; 3]]) -> Vec<[f64; 3]> {
        points_m(self.points(), nodal(coords_m))
    }

    fn point_stress(&self, deformed: &Deformed<'_>) -> Vec<[f64; 6]> {
        self.stress_at_all(deformed, self.points())
    }
}

/// Positions of the points of a table, m.
fn points_m<const N: usize>(table: &ShapeTable<N>, coords_m: &[[f64; 3]; N]) -> Vec<[f64; 3]> {
    let at = |shapes: &[f64; N]| {
        let mut point = [0.0; 3];
        for (weight, x) in shapes.iter().zip(coords_m) {
            add_scaled(&mut point, *weight, *x);
        }
        point
    };
    table.shapes.iter().map(at).collect()
}

/// Fraction of the Jacobian determinant in the middle below which an element is pinched.
const PINCHED: f64 = 1e-3;
