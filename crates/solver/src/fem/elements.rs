//! The elements of one body, checked once: their shape and which of them have straight edges.

use rayon::prelude::*;

use super::FemError;
use super::elasticity::{self, Lame};
use super::quadrature::{Table, Tables};
use crate::mesh::TET_EDGES;
use crate::model::Body;
use dovetail_numerics::space::{distance, middle};

/// Elements of a body whose maps are one to one at every quadrature point.
pub struct Elements<'a, const N: usize> {
    /// Shape functions at the points of quadrature.
    pub tables: &'a Tables<N>,
    body: &'a Body,
    straight: Vec<bool>,
    /// Mass per unit density and Jacobian determinant of an element with straight edges.
    reference_mass: Vec<[f64; 1]>,
    volume_m3: f64,
}

/// An element this flat, against the cube of its longest edge, counts as degenerate.
const FLATNESS: f64 = 1e-9;
/// Mid-edge nodes this close to the middle, against the length of the edge, count as straight.
const STRAIGHTNESS: f64 = 1e-10;

impl<'a, const N: usize> Elements<'a, N> {
    /// # Errors
    /// [`FemError::Inverted`] or [`FemError::Degenerate`], with the tags of the elements.
    pub fn new(body: &'a Body, tables: &'a Tables<N>) -> Result<Self, FemError> {
        let shapes: Vec<Shape> = (0..body.tet_count())
            .into_par_iter()
            .map(|e| shape_of(&values(body, e, &body.nodes_m), tables))
            .collect();
        let tags_where = |condition: fn(&Shape) -> bool| -> Vec<u64> {
            shapes
                .iter()
                .zip(&body.tet_tags)
                .filter(|(s, _)| condition(s))
                .map(|(_, t)| *t)
                .collect()
        };
        let degenerate = tags_where(|s| s.flatness.is_nan() || s.flatness.abs() < FLATNESS);
        if !degenerate.is_empty() {
            return Err(FemError::Degenerate {
                body: body.name.clone(),
                tags: degenerate.into(),
            });
        }
        let inverted = tags_where(|s| s.flatness < 0.0);
        if !inverted.is_empty() {
            return Err(FemError::Inverted {
                body: body.name.clone(),
                tags: inverted.into(),
            });
        }
        let mut reference_mass = vec![[0.0]; N * N];
        for (n, weight) in tables.mass.shapes.iter().zip(&tables.mass.weights) {
            for a in 0..N {
                for b in 0..N {
                    reference_mass[a * N + b][0] += weight * n[a] * n[b];
                }
            }
        }
        Ok(Self {
            tables,
            body,
            straight: shapes.iter().map(|s| s.straight).collect(),
            reference_mass,
            volume_m3: shapes.iter().map(|s| s.volume_m3).sum(),
        })
    }

    /// Volume of the body.
    pub fn volume_m3(&self) -> f64 {
        self.volume_m3
    }

    /// Positions of the nodes of tetrahedron `e`.
    pub fn coords_m(&self, e: usize) -> [[f64; 3]; N] {
        self.values(e, &self.body.nodes_m)
    }

    /// Values of a nodal field at the nodes of element `e`.
    pub fn values(&self, e: usize, field: &[[f64; 3]]) -> [[f64; 3]; N] {
        values(self.body, e, field)
    }

    /// Element stiffness ([`elasticity::stiffness`]).
    pub fn stiffness(&self, e: usize, out: &mut [[f64; 9]]) {
        let table: &Table<N> = if self.straight[e] {
            &self.tables.stiffness_straight
        } else {
            &self.tables.stiffness_curved
        };
        elasticity::stiffness(
            &self.coords_m(e),
            table,
            Lame::from(self.body.material),
            out,
        );
    }

    /// Element mass ([`elasticity::mass`]).
    pub fn mass(&self, e: usize, out: &mut [[f64; 1]]) {
        let density = self.body.material.density_kg_m3;
        let coords = self.coords_m(e);
        if self.straight[e] {
            let det = elasticity::determinant(&coords, &self.tables.centroid.gradients[0]);
            for (m, reference) in out.iter_mut().zip(&self.reference_mass) {
                m[0] = density * det * reference[0];
            }
        } else {
            elasticity::mass(&coords, &self.tables.mass, density, out);
        }
    }
}

/// Values of a nodal field at the nodes of element `e`.
pub fn values<const N: usize>(body: &Body, e: usize, field: &[[f64; 3]]) -> [[f64; 3]; N] {
    let tet = body.tet(e);
    std::array::from_fn(|a| field[tet[a] as usize])
}

struct Shape {
    /// Smallest Jacobian determinant over the cube of the longest edge; NaN when that edge is zero
    /// or a coordinate is no number.
    flatness: f64,
    straight: bool,
    volume_m3: f64,
}

fn shape_of<const N: usize>(coords_m: &[[f64; 3]; N], tables: &Tables<N>) -> Shape {
    let (mut longest, mut straight): (f64, bool) = (0.0, true);
    for (edge, [a, b]) in TET_EDGES.iter().enumerate() {
        let (a, b) = (coords_m[*a], coords_m[*b]);
        let length = distance(a, b);
        longest = longest.max(length);
        if N > 4 {
            straight &= distance(coords_m[4 + edge], middle(a, b)) <= STRAIGHTNESS * length;
        }
    }
    let (mut smallest, mut volume_m3) = (f64::INFINITY, 0.0);
    for (reference, weight) in tables.mass.gradients.iter().zip(&tables.mass.weights) {
        let det = elasticity::determinant(coords_m, reference);
        smallest = smallest.min(det);
        volume_m3 += weight * det;
    }
    if !straight {
        for reference in &tables.stiffness_curved.gradients {
            smallest = smallest.min(elasticity::determinant(coords_m, reference));
        }
    }
    // Minima pass over NaN, sums do not.
    let flatness = if volume_m3.is_finite() {
        smallest / longest.powi(3)
    } else {
        f64::NAN
    };
    Shape {
        flatness,
        straight,
        volume_m3,
    }
}
