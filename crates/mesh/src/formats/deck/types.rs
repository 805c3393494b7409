//! Types of elements in decks, by their names.

use crate::MeshError;
use crate::element::ElementType;

/// Kind of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DeckElementKind {
    /// A solid of so many nodes.
    Solid(usize),
    /// A shell, membrane, plane or surface element of so many nodes.
    Facet(usize),
    /// A beam, truss or pipe of so many nodes.
    Line(usize),
    /// A mass, a spring and the like, or a type that is not known: only its label counts.
    Aside,
}

impl DeckElementKind {
    /// Number of nodes, where it matters.
    pub fn nodes(self) -> Option<usize> {
        match self {
            Self::Solid(nodes) | Self::Facet(nodes) | Self::Line(nodes) => Some(nodes),
            Self::Aside => None,
        }
    }
}

/// Beginnings of the names of solids; the number of nodes follows.
const SOLIDS: [&str; 5] = ["C3D", "DC3D", "Q3D", "SC", "CSS"];
/// Beginnings of the names of facets; the number of nodes follows.
const FACETS: [&str; 13] = [
    "CPS", "CPEG", "CPE", "CAX", "CGAX", "M3D", "SFM3D", "R3D", "DC2D", "DCAX", "DS", "STRI", "S",
];
/// Numbers of nodes of lines, with the names of these.
const LINES: [(usize, &str); 2] = [
    (
        2,
        "B21 B23 B31 B33 PIPE21 PIPE31 ELBOW31 T2D2 T3D2 FRAME2D FRAME3D RB2D2 RB3D2 RAX2 SAX1 \
         DC1D2",
    ),
    (3, "B22 B32 PIPE22 PIPE32 ELBOW32 T2D3 T3D3 SAX2"),
];
/// Beginnings of the names of elements without a shape that look like others.
const ASIDE: [&str; 2] = ["SPRING", "SAXA"];

/// Types that are read, for messages.
pub(super) const READ: &str = "C3D4, C3D5, C3D6, C3D8, C3D10, C3D13, C3D15 and C3D20 with any \
    suffix, shells, membranes, plane and surface elements of 3, 4, 6 or 8 nodes, beams and trusses";

/// Kind of the type that a deck calls `name`; `set` is the set of its elements, for messages.
///
/// # Errors
/// A type with nodes inside faces, or a solid of an unknown number of nodes.
pub(super) fn kind(name: &str, set: Option<&str>) -> Result<DeckElementKind, MeshError> {
    let capitals = name.trim().to_uppercase();
    let digits = |prefix: &str| -> Option<(usize, String)> {
        let rest = capitals.strip_prefix(prefix)?;
        let end = rest
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(rest.len());
        let suffix = rest[end..].to_owned();
        Some((rest[..end].parse().ok()?, suffix))
    };
    let inside = |nodes| MeshError::NodesInside {
        kind: name.trim().to_owned(),
        nodes,
        set: set.unwrap_or("none").to_owned(),
    };
    if let Some((nodes, suffix)) = SOLIDS.iter().find_map(|prefix| digits(prefix)) {
        return match ElementType::from_node_count(nodes) {
            Some(_) if !suffix.starts_with('V') => Ok(DeckElementKind::Solid(nodes)),
            _ if matches!(nodes, 14 | 15 | 18 | 27) => Err(inside(nodes)),
            _ => Err(unknown(name, set)),
        };
    }
    let is_it = |line: &str| {
        let rest = capitals.strip_prefix(line);
        rest.is_some_and(|suffix| !suffix.starts_with(|c: char| c.is_ascii_digit()))
    };
    let line = LINES.iter().find(|(_, names)| names.split(' ').any(is_it));
    if let Some((nodes, _)) = line {
        return Ok(DeckElementKind::Line(*nodes));
    }
    if ASIDE.iter().any(|prefix| capitals.starts_with(prefix)) {
        return Ok(DeckElementKind::Aside);
    }
    match FACETS.iter().find_map(|prefix| digits(prefix)) {
        Some((65, _)) => Ok(DeckElementKind::Facet(6)), // STRI65: six nodes, five unknowns each
        Some((nodes @ (3 | 4 | 6 | 8), _)) => Ok(DeckElementKind::Facet(nodes)),
        Some((nodes @ (7 | 9), _)) => Err(inside(nodes)),
        _ => Ok(DeckElementKind::Aside),
    }
}

fn unknown(name: &str, set: Option<&str>) -> MeshError {
    MeshError::ElementTypeUnknown {
        kind: name.trim().to_owned(),
        set: set.unwrap_or("none").to_owned(),
        read: READ,
    }
}
