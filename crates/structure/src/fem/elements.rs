//! Elements of one body, checked once: their form, and which of them have straight edges.

use std::ops::Deref;
use std::sync::LazyLock;

use rayon::prelude::*;

use super::FemError;
use super::elasticity::Lame;
use super::element::{Deformed, Element, ElementForm, Isoparametric, MOST_NODES};
use super::incompatible::IncompatibleHexahedron;
use crate::model::{Body, Material};
use dovetail_mesh::element::ElementType;

/// Integrals of a type of element.
pub fn element(element: ElementType) -> &'static dyn Element {
    static ALL: LazyLock<[Box<dyn Element>; 8]> = LazyLock::new(|| ElementType::ALL.map(made));
    ALL[element.number()].as_ref()
}

fn made(element: ElementType) -> Box<dyn Element> {
    match element {
        ElementType::TET4 => Box::new(Isoparametric::<4>::new(element)),
        ElementType::TET10 => Box::new(Isoparametric::<10>::new(element)),
        ElementType::PYRAMID5 => Box::new(Isoparametric::<5>::new(element)),
        ElementType::PYRAMID13 => Box::new(Isoparametric::<13>::new(element)),
        ElementType::WEDGE6 => Box::new(Isoparametric::<6>::new(element)),
        ElementType::WEDGE15 => Box::new(Isoparametric::<15>::new(element)),
        ElementType::HEX8 => Box::new(IncompatibleHexahedron::new()),
        ElementType::HEX20 => Box::new(Isoparametric::<20>::new(element)),
    }
}

/// Elements of a body whose maps are one to one at every quadrature point.
pub(crate) struct Elements<'a> {
    body: &'a Body,
    material: Material,
    affine: Vec<bool>,
    volumes_m3: Vec<f64>,
}

/// An element this flat, relative to the cube of its longest edge, counts as degenerate.
const FLATNESS: f64 = 1e-9;

impl<'a> Elements<'a> {
    /// Checks the elements of a body, which are of this material.
    ///
    /// # Errors
    /// [`FemError::Inverted`] or [`FemError::Degenerate`], with the tags of the elements.
    pub(crate) fn new(body: &'a Body, material: Material) -> Result<Self, FemError> {
        let forms: Vec<ElementForm> = (0..body.elements.len())
            .into_par_iter()
            .map(|e| integrals(body, e).form(&values(body, e, &body.nodes_m)))
            .collect();
        let tags_where = |condition: fn(&ElementForm) -> bool| -> Vec<u64> {
            let elements = forms.iter().zip(body.elements.tags());
            elements
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
        Ok(Self {
            body,
            material,
            affine: forms.iter().map(|s| s.affine).collect(),
            volumes_m3: forms.iter().map(|s| s.volume_m3).collect(),
        })
    }

    /// Volume of the body, m3.
    pub(crate) fn volume_m3(&self) -> f64 {
        self.volumes_m3.iter().sum()
    }

    /// Positions of the nodes of element `e`.
    pub(crate) fn coords_m(&self, e: usize) -> NodalValues {
        values(self.body, e, &self.body.nodes_m)
    }

    /// Stiffness of element `e` ([`Element::stiffness`]).
    pub(crate) fn stiffness(&self, e: usize, out: &mut [[f64; 9]]) {
        let lame = Lame::from(self.material);
        integrals(self.body, e).stiffness(&self.coords_m(e), self.affine[e], lame, out);
    }

    /// Mass of element `e` ([`Element::mass`]).
    pub(crate) fn mass(&self, e: usize, out: &mut [[f64; 1]]) {
        let density = self.material.density_kg_m3;
        integrals(self.body, e).mass(&self.coords_m(e), self.affine[e], density, out);
    }

    /// Geometric stiffness of element `e` under the stress of a displacement of the nodes of the
    /// body ([`Element::geometric_stiffness`]).
    pub(crate) fn geometric_stiffness(
        &self,
        e: usize,
        displacement_m: &[[f64; 3]],
        out: &mut [[f64; 1]],
    ) {
        let lame = Lame::from(self.material);
        let u = values(self.body, e, displacement_m);
        let coords = self.coords_m(e);
        integrals(self.body, e).geometric_stiffness(&Deformed::new(&coords, &u, lame), out);
    }
}

/// Mass of element `e` of a body ([`Element::mass`]) of this density by the rule that is exact for
/// all elements of its type.
pub(super) fn element_mass(body: &Body, density_kg_m3: f64, e: usize, out: &mut [[f64; 1]]) {
    let coords = values(body, e, &body.nodes_m);
    integrals(body, e).mass(&coords, false, density_kg_m3, out);
}

/// Integrals of element `e` of a body.
pub(super) fn integrals(body: &Body, e: usize) -> &'static dyn Element {
    element(body.elements.solid(e).0)
}

/// Values of a nodal field at the nodes of one element.
pub(crate) struct NodalValues {
    values: [[f64; 3]; MOST_NODES],
    count: usize,
}

impl Deref for NodalValues {
    type Target = [[f64; 3]];
    fn deref(&self) -> &[[f64; 3]] {
        &self.values[..self.count]
    }
}

/// Values of a nodal field of a body at the nodes of element `e`.
pub(crate) fn values(body: &Body, e: usize, field: &[[f64; 3]]) -> NodalValues {
    let nodes = body.elements.element_nodes(e);
    let mut gathered = NodalValues {
        values: [[0.0; 3]; MOST_NODES],
        count: nodes.len(),
    };
    for (value, &node) in gathered.values.iter_mut().zip(nodes) {
        *value = field[node as usize];
    }
    gathered
}
