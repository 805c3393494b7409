//! Rows of the matrices of a meshed body.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What a row of a matrix is the degree of freedom of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Row {
    /// Displacement (direction 1, 2, 3 for x, y, z) or rotation (4, 5, 6) of a node.
    Node {
        /// Number of the node.
        node: u64,
        /// Direction from 1 to 6.
        direction: u8,
    },
    /// Generalised coordinate, such as the amplitude of a mode.
    Generalised,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node { node, direction } => write!(f, "direction {direction} of node {node}"),
            Self::Generalised => write!(f, "a generalised coordinate"),
        }
    }
}
