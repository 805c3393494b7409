//! Middle nodes that quadratic elements lack.

use std::collections::{HashMap, HashSet};

use dovetail_numerics::space::middle;

use super::content::Content;
use crate::element::{ElementOrder, ElementType, facet_corners};

/// Kind of an element with a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberedKind {
    /// A solid of one of the eight types.
    Solid,
    /// A face of 3, 4, 6 or 8 nodes.
    Facet,
    /// A beam, mass, spring or constraint, which only uses its nodes.
    Other,
}

/// Middles of the edges of elements, by the ends of an edge in ascending order.
#[derive(Debug, Default)]
pub(super) struct Middles {
    known: HashMap<[u32; 2], u32>,
    made: HashSet<[u32; 2]>,
    /// Number of elements that have some of their middle nodes and lack others.
    pub lacking: usize,
    /// Number of the next node that is made.
    next_tag: Option<u64>,
}

/// Corners of an element, and the corners of each of its edges with middle nodes.
fn edges(kind: NumberedKind, nodes: &[u32]) -> (usize, Vec<[usize; 2]>) {
    match kind {
        NumberedKind::Solid => match ElementType::from_node_count(nodes.len()) {
            Some(element) if element.order == ElementOrder::Quadratic => {
                (element.shape.corners(), element.shape.edges().to_vec())
            }
            _ => (nodes.len(), Vec::new()),
        },
        NumberedKind::Facet => {
            let corners = facet_corners(nodes.len());
            let sides = (0..nodes.len() - corners).map(|i| [i, (i + 1) % corners]);
            (corners, sides.collect())
        }
        NumberedKind::Other => (nodes.len(), Vec::new()),
    }
}

fn ends(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Middles {
    /// A middle node that an element lacks.
    pub const MISSING: u32 = u32::MAX;

    /// Counts an element that lacks some of its middle nodes.
    pub fn inspect(&mut self, kind: NumberedKind, nodes: &[u32]) {
        if nodes.contains(&Self::MISSING) {
            self.lacking += usize::from(!Self::is_linear(kind, nodes));
        }
    }

    /// True if an element has none of its middle nodes, except on edges without length.
    fn is_linear(kind: NumberedKind, nodes: &[u32]) -> bool {
        let (corners, edges) = edges(kind, nodes);
        let mut middles = nodes[corners..].iter().zip(edges);
        middles.all(|(middle, [a, b])| *middle == Self::MISSING || nodes[a] == nodes[b])
    }

    /// Notes the middle nodes that an element has.
    pub fn learn(&mut self, kind: NumberedKind, nodes: &[u32]) {
        let (corners, edges) = edges(kind, nodes);
        for (middle, [a, b]) in nodes[corners..].iter().zip(edges) {
            if *middle != Self::MISSING && nodes[a] != nodes[b] {
                self.known.insert(ends(nodes[a], nodes[b]), *middle);
            }
        }
    }

    /// Nodes of an element with all of its middle nodes, or without any if it has none. Middle
    /// nodes that no element has are added to the content.
    pub fn complete(
        &mut self,
        kind: NumberedKind,
        nodes: &[u32],
        content: &mut Content,
    ) -> Vec<u32> {
        let mut nodes = nodes.to_vec();
        let (corners, edges) = edges(kind, &nodes);
        if !nodes[corners..].contains(&Self::MISSING) || nodes[..corners].contains(&Self::MISSING) {
            return nodes;
        }
        if Self::is_linear(kind, &nodes) {
            nodes.truncate(corners);
            return nodes;
        }
        for (i, [a, b]) in (corners..).zip(edges) {
            let (a, b) = (nodes[a], nodes[b]);
            if nodes[i] != Self::MISSING {
                continue;
            }
            nodes[i] = if a == b {
                a
            } else {
                *self.known.entry(ends(a, b)).or_insert_with(|| {
                    let [a_at, b_at] = [a, b].map(|node| content.nodes[node as usize]);
                    content.nodes.push(middle(a_at, b_at));
                    let highest = || content.node_tags.iter().copied().max().unwrap_or(0);
                    let tag = self.next_tag.unwrap_or_else(|| highest().saturating_add(1));
                    self.next_tag = Some(tag.saturating_add(1));
                    content.node_tags.push(tag);
                    self.made.insert(ends(a, b));
                    content.nodes.len() as u32 - 1
                })
            };
        }
        nodes
    }

    /// Remark on the middle nodes that were missing. `solids` has the nodes of all solids.
    pub fn remark<'a, I>(&self, solids: impl Fn() -> I) -> Option<String>
    where
        I: Iterator<Item = &'a [u32]>,
    {
        if self.lacking == 0 {
            return None;
        }
        let mut remark = format!(
            "{} elements lack some of their middle nodes: these are nodes of a neighbour, or were \
             made in the middle of {} edges.",
            self.lacking,
            self.made.len()
        );
        let mut beside_linear = HashSet::new();
        for nodes in solids() {
            let Some(element) = ElementType::from_node_count(nodes.len()) else {
                continue;
            };
            if element.order == ElementOrder::Linear {
                let edges = element.shape.edges().iter();
                let edges = edges.map(|[a, b]| ends(nodes[*a], nodes[*b]));
                beside_linear.extend(edges.filter(|edge| self.made.contains(edge)));
            }
        }
        if !beside_linear.is_empty() {
            remark += &format!(
                " {} of these edges belong to linear elements, too: a body of both kinds cannot be \
                 computed, so mesh it with one order.",
                beside_linear.len()
            );
        }
        Some(remark)
    }
}
