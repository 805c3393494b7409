//! Which nodes of a body move, and in which order their degrees of freedom stand.

use super::{DofMap, NodeMotion};

/// How each node of a body moves, before numbering.
#[derive(Default)]
pub(super) struct Roles {
    pub fixed: Vec<bool>,
    /// Local nodes of the flanks' corners, in the order of the pairs.
    pub flank: Vec<u32>,
    /// Mid-edge nodes of flank edges with the two corners.
    pub tied: Vec<(u32, [u32; 2])>,
    /// Local nodes excited or observed, in the order of the scene; any of them may also be a flank
    /// node or tied, and may occur more than once.
    pub probes: Vec<u32>,
}

/// Numbers the free nodes: interior, flank, probe.
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
    let mut kept = roles.flank.clone();
    let mut is_kept = vec![false; nodes.len()];
    for &n in &kept {
        is_kept[n as usize] = true;
    }
    for &probe in &roles.probes {
        let free = nodes[probe as usize] == NodeMotion::Free(unset);
        if free && !std::mem::replace(&mut is_kept[probe as usize], true) {
            kept.push(probe);
        }
    }
    let mut next = 0;
    for (motion, kept) in nodes.iter_mut().zip(&is_kept) {
        if *motion == NodeMotion::Free(unset) && !kept {
            *motion = NodeMotion::Free(next);
            next += 1;
        }
    }
    for (i, &n) in (next..).zip(&kept) {
        nodes[n as usize] = NodeMotion::Free(i);
    }
    DofMap {
        nodes,
        interior_nodes: next as usize,
        flank_nodes: roles.flank.len(),
        probe_nodes: kept.len() - roles.flank.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use NodeMotion::{Fixed, Free, Tied};

    #[test]
    fn interior_then_flank_in_pair_order_then_probes() {
        let map = number(&Roles {
            fixed: [false, true, false, false, false, false, false, false].to_vec(),
            flank: vec![6, 2],
            tied: vec![(4, [2, 6])],
            probes: vec![7, 2, 4, 0, 7],
        });
        let expected = [
            Free(5),
            Fixed,
            Free(3),
            Free(0),
            Tied([2, 6]),
            Free(1),
            Free(2),
            Free(4),
        ];
        assert_eq!(map.nodes, expected);
        assert_eq!(
            (map.interior_nodes, map.flank_nodes, map.probe_nodes),
            (2, 2, 2)
        );
        assert_eq!(map.weights(4).collect::<Vec<_>>(), [(3, 0.5), (2, 0.5)]);
        assert_eq!(map.weights(1).count(), 0);
    }
}
