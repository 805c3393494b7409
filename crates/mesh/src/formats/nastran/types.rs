//! Element cards of Nastran.

use super::super::numbered::NumberedKind;

/// Solids that are read, for messages.
pub(super) const READ: &str = "CTETRA, CPYRAM, CPENTA, CHEXA, CQUAD4, CQUADR, CQUAD8, CQUAD, \
    CSHEAR, CTRIA3, CTRIAR and CTRIA6";

/// Card of elements that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ElementCard {
    pub kind: NumberedKind,
    pub corners: usize,
    /// Most nodes that are read.
    pub most: usize,
    /// Position on the card of each node behind the corners, in our order.
    order: &'static [usize],
}

/// Positions of the middle nodes of a hexahedron: the card has the vertical edges before the top.
const HEXAHEDRON: [usize; 12] = [8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];
/// The same of a wedge.
const WEDGE: [usize; 9] = [6, 7, 8, 12, 13, 14, 9, 10, 11];

/// Elements of a card, if they are read.
pub(super) fn element(name: &str) -> Option<ElementCard> {
    let solid = |corners, most, order| {
        Some(ElementCard {
            kind: NumberedKind::Solid,
            corners,
            most,
            order,
        })
    };
    let facet = |corners, most| {
        Some(ElementCard {
            kind: NumberedKind::Facet,
            corners,
            most,
            order: &[4, 5, 6, 7],
        })
    };
    match name {
        "CTETRA" => solid(4, 10, &[4, 5, 6, 7, 8, 9]),
        "CPYRAM" | "CPYRA" => solid(5, 13, &[5, 6, 7, 8, 9, 10, 11, 12]),
        "CPENTA" => solid(6, 15, &WEDGE),
        "CHEXA" => solid(8, 20, &HEXAHEDRON),
        "CQUAD4" | "CQUADR" | "CSHEAR" => facet(4, 4),
        "CQUAD8" | "CQUAD" => facet(4, 8),
        "CTRIA3" | "CTRIAR" => facet(3, 3),
        "CTRIA6" => Some(ElementCard {
            kind: NumberedKind::Facet,
            corners: 3,
            most: 6,
            order: &[3, 4, 5],
        }),
        _ => None,
    }
}

impl ElementCard {
    /// Nodes in our order; missing middle nodes are 0. `None` where corners are missing.
    pub fn arrange(&self, nodes: &[u64]) -> Option<Vec<u64>> {
        let corners = nodes.get(..self.corners)?;
        if corners.contains(&0) {
            return None;
        }
        let mut arranged = corners.to_vec();
        if nodes.len() > self.corners {
            let middles = self
                .order
                .iter()
                .map(|i| nodes.get(*i).copied().unwrap_or(0));
            arranged.extend(middles);
        }
        Some(arranged)
    }
}

/// Fields of a card that name nodes, for elements and constraints that are not read.
pub(super) fn other_nodes(name: &str) -> &'static [usize] {
    match name {
        "CBAR" | "CBEAM" | "CBEND" | "CROD" | "CTUBE" | "CBUSH" | "CGAP" | "CBEAM3" | "CVISC"
        | "RBAR" | "RROD" => &[2, 3],
        "CONROD" | "PLOTEL" => &[1, 2],
        "CONM1" | "CONM2" | "RBE2" => &[1],
        "RBE3" => &[2],
        "CELAS1" | "CELAS2" | "CDAMP1" | "CDAMP2" | "CMASS1" | "CMASS2" => &[2, 4],
        _ => &[],
    }
}
