//! Free nodes of a body, and the order of their degrees of freedom.

use super::{DofMap, NodeMotion};

/// Possible motion of each node of a body, before numbering.
#[derive(Default)]
pub(super) struct Roles {
    pub fixed: Vec<bool>,
    /// Local nodes of contacts, in the order of the contacts and their pairs.
    pub contact: Vec<u32>,
    /// Mid-edge nodes of flank edges with the two corners.
    pub tied: Vec<(u32, [u32; 2])>,
    /// For each auxiliary node, true if it is an end that is joined to another body.
    pub auxiliary: Vec<bool>,
}

/// Numbers the free nodes: interior ones, then those of contacts; nodes of the mesh come first in
/// both.
pub(super) fn number(roles: &Roles) -> DofMap {
    let unset = u32::MAX;
    let mut nodes = vec![NodeMotion::Free(unset); roles.fixed.len()];
    for (motion, fixed) in nodes.iter_mut().zip(&roles.fixed) {
        if *fixed {
            *motion = NodeMotion::Fixed;
        }
    }
    for &(middle, corners) in &roles.tied {
        nodes[middle as usize] = NodeMotion::Tied(corners);
    }
    let mut in_contact = vec![false; nodes.len()];
    for &n in &roles.contact {
        in_contact[n as usize] = true;
    }
    let mut next = 0;
    for (motion, in_contact) in nodes.iter_mut().zip(&in_contact) {
        if *motion == NodeMotion::Free(unset) && !in_contact {
            *motion = NodeMotion::Free(next);
            next += 1;
        }
    }
    let is_end = |end: &&bool| **end;
    let ends = roles.auxiliary.iter().filter(is_end).count() as u32;
    let interior_nodes = next + roles.auxiliary.len() as u32 - ends;
    for (i, &n) in (interior_nodes..).zip(&roles.contact) {
        nodes[n as usize] = NodeMotion::Free(i);
    }
    let mut next_end = interior_nodes + roles.contact.len() as u32;
    let number = |&is_end: &bool| {
        let next = if is_end { &mut next_end } else { &mut next };
        *next += 1;
        *next - 1
    };
    DofMap {
        nodes,
        auxiliary: roles.auxiliary.iter().map(number).collect(),
        interior_nodes: interior_nodes as usize,
        contact_nodes: roles.contact.len() + ends as usize,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use NodeMotion::{Fixed, Free, Tied};

    #[test]
    fn interior_nodes_come_first_then_those_of_contacts_in_the_order_of_the_pairs() {
        let map = number(&Roles {
            fixed: [false, true, false, false, false, false, false, false].to_vec(),
            contact: vec![6, 2],
            tied: vec![(4, [2, 6])],
            auxiliary: vec![false, true, false],
        });
        let expected = [
            Free(0),
            Fixed,
            Free(7),
            Free(1),
            Tied([2, 6]),
            Free(2),
            Free(6),
            Free(3),
        ];
        assert_eq!(map.nodes, expected);
        assert_eq!(map.auxiliary, [4, 8, 5]);
        assert_eq!((map.interior_nodes, map.contact_nodes), (6, 3));
        assert_eq!(map.weights(4).collect::<Vec<_>>(), [(7, 0.5), (6, 0.5)]);
        assert_eq!(map.weights(1).count(), 0);
        assert_eq!(map.weights(9).collect::<Vec<_>>(), [(8, 1.0)]);
        assert_eq!(map.free(10), Some(5));
    }
}
