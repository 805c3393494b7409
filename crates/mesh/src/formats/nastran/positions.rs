//! Nodes and systems of coordinates that depend on one another.

use std::collections::HashMap;

use super::super::numbered::NumberedMesh;
use super::super::source::{LinePosition, SourceFiles};
use super::super::systems::{Coordinates, System};
use crate::MeshError;

/// Most systems that are defined by one another.
const DEEPEST: usize = 100;

/// Definition of a system by a card.
#[derive(Debug, Clone, Copy)]
pub(super) enum SystemCard {
    /// Three nodes (CORD1R and others).
    Nodes([u64; 3]),
    /// Three points in the system of a number (CORD2R and others).
    Points(u64, [[f64; 3]; 3]),
}

/// Systems of coordinates, and the nodes that are in one.
#[derive(Debug, Default)]
pub(super) struct Positions {
    cards: HashMap<u64, (Coordinates, SystemCard, LinePosition)>,
    /// System of each node that has one.
    system_of: HashMap<u64, (u64, LinePosition)>,
    known: HashMap<u64, System>,
}

impl Positions {
    /// Notes that a node is in a system.
    pub fn add_node(&mut self, tag: u64, system: u64, place: LinePosition) {
        self.system_of.insert(tag, (system, place));
    }

    /// Adds a system.
    pub fn add_system(
        &mut self,
        number: u64,
        coordinates: Coordinates,
        card: SystemCard,
        place: LinePosition,
    ) {
        self.cards.insert(number, (coordinates, card, place));
    }

    /// Moves the nodes of a mesh to their places in global coordinates.
    ///
    /// # Errors
    /// A system that is not there, or whose points are on one line or depend on it.
    pub fn apply(mut self, mesh: &mut NumberedMesh, files: &SourceFiles) -> Result<(), MeshError> {
        let nodes: Vec<(u64, (u64, LinePosition))> =
            self.system_of.iter().map(|(n, s)| (*n, *s)).collect();
        let mut moved = Vec::with_capacity(nodes.len());
        for (tag, (number, place)) in nodes {
            let system = self.system(number, mesh, 0);
            let system = system.map_err(|e| match self.cards.get(&number) {
                Some((.., place)) => files.locate_error(*place, "", e),
                None => files.locate_error(place, "GRID", e),
            })?;
            moved.extend(mesh.node(tag).map(|at| (tag, system.point(at))));
        }
        for (tag, at) in moved {
            mesh.move_node(tag, at);
        }
        Ok(())
    }

    fn system(
        &mut self,
        number: u64,
        mesh: &NumberedMesh,
        depth: usize,
    ) -> Result<System, MeshError> {
        if let Some(known) = self.known.get(&number) {
            return Ok(*known);
        }
        let unknown = MeshError::UnknownSystem { number };
        let (coordinates, card, _) = *self.cards.get(&number).ok_or(unknown)?;
        let wrong = || MeshError::SystemPoints { number };
        if depth > DEEPEST {
            return Err(wrong());
        }
        let points = match card {
            SystemCard::Points(0, points) => points,
            SystemCard::Points(parent, points) => {
                let parent = self.system(parent, mesh, depth + 1)?;
                points.map(|at| parent.point(at))
            }
            SystemCard::Nodes(nodes) => {
                let mut points = [[0.0; 3]; 3];
                for (point, node) in points.iter_mut().zip(nodes) {
                    let missing = MeshError::MissingNode {
                        element: number,
                        node,
                    };
                    let at = mesh.node(node).ok_or(missing)?;
                    *point = match self.system_of.get(&node).copied() {
                        Some((system, _)) => self.system(system, mesh, depth + 1)?.point(at),
                        None => at,
                    };
                }
                points
            }
        };
        let system = System::of_points(coordinates, points).ok_or_else(wrong)?;
        self.known.insert(number, system);
        Ok(system)
    }
}
