//! Solids with mirrored corners, which Ansys and Nastran permit.

use dovetail_numerics::space::{cross, dot, sub};

use crate::element::{ElementType, Shape};

/// Corner of the given solid for each corner of the turned one: base and top change places, or two
/// corners.
fn corners(shape: Shape) -> &'static [usize] {
    match shape {
        Shape::Tetrahedron => &[0, 2, 1, 3],
        Shape::Pyramid => &[0, 3, 2, 1, 4],
        Shape::Wedge => &[3, 4, 5, 0, 1, 2],
        Shape::Hexahedron => &[4, 5, 6, 7, 0, 1, 2, 3],
    }
}

/// Nodes of a solid in our order if they are in the mirrored one: the volume between its corners is
/// negative. `at` gives the position of a node.
pub(super) fn mirrored(nodes: &[u32], at: impl Fn(u32) -> [f64; 3]) -> Option<Vec<u32>> {
    let element = ElementType::from_node_count(nodes.len())?;
    let origin = at(nodes[0]);
    let from_origin = |i: usize| sub(at(nodes[i]), origin);
    let mut six_volumes = 0.0;
    for face in element.shape.faces() {
        for pair in face[1..].windows(2) {
            let [a, b, c] = [face[0], pair[0], pair[1]].map(from_origin);
            six_volumes += dot(a, cross(b, c));
        }
    }
    if six_volumes >= 0.0 || six_volumes.is_nan() {
        return None;
    }
    let corners = corners(element.shape);
    let edges = element.shape.edges();
    let mut turned: Vec<u32> = corners.iter().map(|i| nodes[*i]).collect();
    if nodes.len() > corners.len() {
        for [a, b] in edges {
            let [a, b] = [corners[*a], corners[*b]];
            let edge = edges.iter().position(|e| *e == [a.min(b), a.max(b)])?;
            turned.push(nodes[corners.len() + edge]);
        }
    }
    Some(turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolation::reference_nodes;
    use crate::volume::volume_m3;

    /// The reference element, mirrored at a plane: its nodes are turned, and its volume is positive.
    #[test]
    fn mirrored_elements_of_every_type_are_turned() {
        for element in ElementType::ALL {
            let reference = reference_nodes(element);
            let mirror = |sign: f64| -> Vec<[f64; 3]> {
                reference
                    .iter()
                    .map(|[x, y, z]| [sign * x, *y, *z])
                    .collect()
            };
            let nodes: Vec<u32> = (0..element.nodes() as u32).collect();
            let sound = mirror(1.0);
            assert!(mirrored(&nodes, |n| sound[n as usize]).is_none());
            let inside_out = mirror(-1.0);
            let turned = mirrored(&nodes, |n| inside_out[n as usize]).unwrap();
            let at: Vec<[f64; 3]> = turned.iter().map(|n| inside_out[*n as usize]).collect();
            let [volume, expected] =
                [&at, &sound].map(|at| volume_m3(std::iter::once((element, at.clone()))));
            assert!(
                (volume / expected - 1.0).abs() < 1e-12,
                "{element:?}: {volume}"
            );
        }
    }
}
