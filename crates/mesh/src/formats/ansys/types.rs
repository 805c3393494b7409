//! Element types of Ansys, by their numbers.

use super::super::numbered::NumberedKind;

/// How the elements of a type are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Tetrahedra, with the largest number of nodes.
    Tetrahedron(usize),
    /// Hexahedra, with the largest number of nodes; wedges, pyramids and tetrahedra repeat nodes.
    Hexahedron(usize),
    /// Faces, with the largest number of nodes.
    Facet(usize),
    /// Lines, points and types that are not known.
    Other,
}

/// Type that ET defines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct AnsysType {
    /// Name, such as `SOLID186`.
    pub name: String,
    number: u32,
    /// KEYOPT(1).
    pub first_option: i64,
}

/// Types that are read, for messages.
pub(super) const READ: &str = "SOLID5, 45, 46, 62, 64, 65, 69, 70, 72, 73, 87, 90, 92, 95, 96, 98, \
    122, 123, 127, 128, 147, 148, 168, 185, 186, 187, 191, 225, 226, 227, 231, 232, 239, 240, 278, \
    279, 285, 291, SOLSH190, FLUID30, 80, 220, 221, MESH200, shells, planes, SURF152, SURF154, \
    CONTA173, CONTA174, TARGE170";

/// Name before the number, kind, numbers.
type Family = (&'static str, Kind, &'static [u32]);

const FAMILIES: [Family; 12] = [
    (
        "SOLID",
        Kind::Hexahedron(8),
        &[5, 45, 46, 62, 64, 65, 69, 70, 73, 96, 164, 185, 225, 278],
    ),
    ("SOLSH", Kind::Hexahedron(8), &[190]),
    ("FLUID", Kind::Hexahedron(8), &[30, 80]),
    (
        "SOLID",
        Kind::Hexahedron(20),
        &[90, 95, 122, 128, 147, 186, 191, 226, 231, 239, 279],
    ),
    ("FLUID", Kind::Hexahedron(20), &[220]),
    (
        "SOLID",
        Kind::Tetrahedron(10),
        &[87, 92, 98, 123, 127, 148, 168, 187, 227, 232, 240, 291],
    ),
    ("FLUID", Kind::Tetrahedron(10), &[221]),
    ("SOLID", Kind::Tetrahedron(4), &[72, 285]),
    (
        "SHELL",
        Kind::Facet(8),
        &[
            28, 41, 43, 57, 63, 91, 93, 99, 131, 132, 143, 150, 157, 163, 181, 281,
        ],
    ),
    (
        "PLANE",
        Kind::Facet(8),
        &[
            2, 13, 25, 35, 42, 53, 55, 67, 75, 77, 78, 82, 83, 121, 145, 146, 182, 183, 222, 223,
            230, 233, 238, 292, 293,
        ],
    ),
    ("SURF", Kind::Facet(8), &[152, 154]),
    ("CONTA", Kind::Facet(8), &[173, 174]),
];
/// Other types, for their names.
const OTHERS: [(&str, &[u32]); 12] = [
    ("LINK", &[1, 8, 10, 11, 31, 32, 33, 34, 160, 167, 180, 228]),
    ("BEAM", &[3, 4, 23, 24, 44, 54, 161, 188, 189]),
    ("COMBIN", &[7, 14, 37, 39, 40, 165, 214]),
    ("CONTA", &[171, 172, 175, 176, 177, 178]),
    ("TARGE", &[169]),
    ("MASS", &[21, 71, 166]),
    ("PIPE", &[16, 18, 20, 59, 60, 288, 289]),
    ("SURF", &[151, 153, 156]),
    ("MPC", &[184]),
    ("PRETS", &[179]),
    ("MATRIX", &[27, 50]),
    ("FOLLW", &[201]),
];

impl AnsysType {
    /// Type by the name that ET gives it, `186` or `SOLID186`.
    pub fn new(name: &str) -> Self {
        let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
        let number: u32 = digits.parse().unwrap_or(0);
        let family = FAMILIES.iter().find(|(.., list)| list.contains(&number));
        let other = OTHERS.iter().find(|(_, list)| list.contains(&number));
        let prefix = match number {
            170 => "TARGE",
            200 => "MESH",
            _ => family.map_or_else(|| other.map_or("type ", |(name, _)| name), |f| f.0),
        };
        let is_word = name.starts_with(|c: char| c.is_ascii_alphabetic());
        Self {
            name: match is_word {
                true => name.to_ascii_uppercase(),
                false => format!("{prefix}{name}"),
            },
            number,
            first_option: 0,
        }
    }

    /// How its elements are read.
    pub fn kind(&self) -> Kind {
        match (self.number, self.first_option) {
            (200, 8) => Kind::Tetrahedron(4),
            (200, 9) => Kind::Tetrahedron(10),
            (200, 10) => Kind::Hexahedron(8),
            (200, 11) => Kind::Hexahedron(20),
            (200, 4..=7) | (170, _) => Kind::Facet(8),
            (number, _) => FAMILIES
                .iter()
                .find(|(.., list)| list.contains(&number))
                .map_or(Kind::Other, |(_, kind, _)| *kind),
        }
    }
}

impl Kind {
    /// Most nodes of an element.
    pub fn nodes(self) -> Option<usize> {
        match self {
            Self::Tetrahedron(nodes) | Self::Hexahedron(nodes) => Some(nodes),
            Self::Facet(_) | Self::Other => None,
        }
    }

    /// Kind of an element, and its nodes in our order; a missing middle node is 0. `None` where it
    /// has too few nodes.
    pub fn arrange(self, nodes: &[u64]) -> Option<(NumberedKind, Vec<u64>)> {
        let mut nodes = nodes.to_vec();
        let (corners, most) = match self {
            Self::Tetrahedron(most) => (4, most),
            Self::Hexahedron(most) => (8, most),
            Self::Facet(_) => return Some(facet(nodes)),
            Self::Other => return Some((NumberedKind::Other, nodes)),
        };
        if nodes.len() < corners {
            return None;
        }
        let given = if nodes.len() > corners { most } else { corners };
        nodes.resize(given.min(most), 0);
        Some((NumberedKind::Solid, nodes))
    }
}

/// A face. An extra node that heat or radiation goes to is left out.
fn facet(mut nodes: Vec<u64>) -> (NumberedKind, Vec<u64>) {
    let count = match nodes.len() {
        0..=2 => return (NumberedKind::Other, nodes),
        count @ (3 | 4 | 6) => count,
        5 => 4,
        7 => 8,
        _ => 8,
    };
    nodes.resize(count, 0);
    (NumberedKind::Facet, nodes)
}
