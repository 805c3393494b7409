//! Which nodes of a body move, and in which order their degrees of freedom stand.

use super::{DofMap, NodeMotion};

/// How each node of a body moves, before numbering.
#[derive(Default)]
pub(super) struct Roles {
    pub fixed: Vec<bool>,
    /// Local nodes of contacts, in the order of the contacts and their pairs.
    pub contact: Vec<u32>,
    /// Mid-edge nodes of flank edges with the two corners.
    pub tied: Vec<(u32, [u32; 2])>,
}

/// Numbers the free nodes: interior ones, then those of contacts.
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
    for (i, &n) in (next..).zip(&roles.contact) {
        nodes[n as usize] = NodeMotion::Free(i);
    }
    DofMap {
        nodes,
        interior_nodes: next as usize,
        contact_nodes: roles.contact.len(),
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
        });
        let expected = [
            Free(0),
            Fixed,
            Free(5),
            Free(1),
            Tied([2, 6]),
            Free(2),
            Free(4),
            Free(3),
        ];
        assert_eq!(map.nodes, expected);
        assert_eq!((map.interior_nodes, map.contact_nodes), (4, 2));
        assert_eq!(map.weights(4).collect::<Vec<_>>(), [(5, 0.5), (4, 0.5)]);
        assert_eq!(map.weights(1).count(), 0);
    }
}
