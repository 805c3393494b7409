//! Pieces of a part that share no node, and nodes of it that lie at one place.

use std::collections::BTreeMap;

use super::near::Near;
use super::{Group, Mesh};
use dovetail_numerics::space::distance;

/// Nodes closer together than this part of the shortest edge lie at one place.
const SAME_PLACE: f64 = 1e-4;

/// Pieces of the elements of a group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pieces {
    /// Number of elements of each piece, the largest piece first.
    pub elements: Vec<usize>,
    /// Pairs of nodes that lie at one place and are not joined, as indices into the nodes of the
    /// mesh, each with the smaller index first.
    pub at_one_place: Vec<[u32; 2]>,
}

impl Mesh {
    /// Pieces of the elements of a volume group. Nodes that are in one of the sets `joined`, each
    /// ascending, count as joined to each other: the two flanks of a contact, for example.
    pub fn pieces(&self, volume: &Group, joined: &[Vec<u32>]) -> Pieces {
        let mut sets = DisjointSets::new(self.nodes_m.len());
        let of = |element: &u32| self.elements.element_nodes(*element as usize);
        let elements = volume.elements.iter().map(of);
        for nodes in elements.clone().chain(joined.iter().map(Vec::as_slice)) {
            for pair in nodes.windows(2) {
                sets.join(pair[0], pair[1]);
            }
        }
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        for nodes in elements.clone() {
            *counts.entry(sets.root(nodes[0])).or_default() += 1;
        }
        let mut counts: Vec<usize> = counts.into_values().collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        Pieces {
            elements: counts,
            at_one_place: self.coincident_nodes(volume, joined),
        }
    }

    fn coincident_nodes(&self, volume: &Group, joined: &[Vec<u32>]) -> Vec<[u32; 2]> {
        let at = |node: u32| self.nodes_m[node as usize];
        let edges = volume.elements.iter().flat_map(|&element| {
            let (element, nodes) = self.elements.solid(element as usize);
            let edges = element.shape.edges().iter();
            edges.map(|[a, b]| distance(at(nodes[*a]), at(nodes[*b])))
        });
        let radius = SAME_PLACE * edges.fold(f64::INFINITY, f64::min);
        if !radius.is_finite() {
            return Vec::new();
        }
        let of_elements = volume.elements.iter();
        let mut nodes: Vec<u32> = of_elements
            .flat_map(|element| self.elements.element_nodes(*element as usize))
            .copied()
            .collect();
        super::sort_once(&mut nodes);
        let near = Near::new(&self.nodes_m, nodes.iter().copied(), radius);
        let mut pairs = Vec::new();
        for node in nodes {
            near.visit_within(at(node), radius, |other| {
                let has = |set: &[u32], node: u32| set.binary_search(&node).is_ok();
                let has_both = |set: &Vec<u32>| has(set, node) && has(set, other);
                if other > node && !joined.iter().any(has_both) {
                    pairs.push([node, other]);
                }
            });
        }
        pairs.sort_unstable();
        pairs
    }
}

/// Disjoint sets of nodes.
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(nodes: usize) -> Self {
        Self((0..nodes as u32).collect())
    }

    /// Node that represents the set of a node.
    fn root(&mut self, mut node: u32) -> u32 {
        while self.0[node as usize] != node {
            let above = self.0[node as usize];
            self.0[node as usize] = self.0[above as usize];
            node = above;
        }
        node
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cubes of edges of 1 m, each with its own nodes, with its lower corner at these places.
    fn cubes(places: &[f64]) -> (Mesh, Group) {
        let mut mesh = Mesh::default();
        for (tag, x) in (1..).zip(places) {
            let first = mesh.nodes_m.len() as u32;
            for z in [0.0, 1.0] {
                for [dx, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                    mesh.nodes_m.push([x + dx, y, z]);
                }
            }
            mesh.elements.push(tag, first..first + 8);
        }
        let volume = Group {
            dimension: 3,
            elements: (0..places.len() as u32).collect(),
            nodes: (0..mesh.nodes_m.len() as u32).collect(),
        };
        (mesh, volume)
    }

    #[test]
    fn cubes_that_touch_without_common_nodes_are_pieces() {
        let (mesh, volume) = cubes(&[0.0, 1.0, 5.0]);
        let found = mesh.pieces(&volume, &[]);
        assert_eq!(found.elements, [1, 1, 1]);
        assert_eq!(found.at_one_place, [[1, 8], [2, 11], [5, 12], [6, 15]]);
        // A clearance of a thousandth of an edge is a clearance.
        let (mesh, volume) = cubes(&[0.0, 1.001]);
        assert_eq!(mesh.pieces(&volume, &[]).at_one_place, [[0; 2]; 0]);
        let (mesh, volume) = cubes(&[0.0, 1.000_01]);
        assert_eq!(mesh.pieces(&volume, &[]).at_one_place.len(), 4);
    }

    /// Two cubes that a contact joins, and a third that it does not reach.
    #[test]
    fn flanks_of_a_contact_are_joined() {
        let (mesh, volume) = cubes(&[0.0, 1.0, 2.0]);
        let flanks = vec![1, 2, 5, 6, 8, 11, 12, 15];
        let found = mesh.pieces(&volume, &[flanks]);
        assert_eq!(found.elements, [2, 1]);
        assert_eq!(found.at_one_place, [[9, 16], [10, 19], [13, 20], [14, 23]]);
    }

    #[test]
    fn elements_with_common_nodes_are_one_piece() {
        let (mut mesh, volume) = cubes(&[0.0]);
        mesh.nodes_m.extend([
            [2.0, 0.0, 0.0],
            [2.0, 1.0, 0.0],
            [2.0, 0.0, 1.0],
            [2.0, 1.0, 1.0],
        ]);
        mesh.elements.push(2, [1, 8, 9, 2, 5, 10, 11, 6]);
        let both = Group {
            elements: vec![0, 1],
            ..volume
        };
        let found = mesh.pieces(&both, &[]);
        assert_eq!((found.elements, found.at_one_place), (vec![2], vec![]));
    }
}
