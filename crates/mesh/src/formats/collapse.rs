//! Elements that name a node more than once: hexahedra that are wedges, pyramids or tetrahedra, and
//! quadrilaterals that are triangles, as programs write them that have only one type for all.

use std::borrow::Cow;
use std::collections::HashMap;

use crate::MeshError;
use crate::element::{ElementOrder, ElementType, Shape, facet_corners};

/// Nodes of the solid of another shape that a solid with these nodes is, or its own nodes if each
/// occurs once. `tags` has the numbers of the nodes in the file, for messages.
///
/// # Errors
/// A node occurs more than once, and the solid has none of the four shapes.
pub(super) fn solid<'a>(
    tag: u64,
    nodes: &'a [u32],
    tags: &[u64],
) -> Result<Cow<'a, [u32]>, MeshError> {
    let element = ElementType::from_node_count(nodes.len());
    or_collapsed(tag, nodes, tags, || collapsed_solid(element?, nodes))
}

/// Nodes of the triangle that a quadrilateral with these nodes is, or its own nodes.
///
/// # Errors
/// A node occurs more than once, and the facet cannot be read as a triangle.
pub(super) fn facet<'a>(
    tag: u64,
    nodes: &'a [u32],
    tags: &[u64],
) -> Result<Cow<'a, [u32]>, MeshError> {
    or_collapsed(tag, nodes, tags, || collapsed_facet(nodes))
}

fn or_collapsed<'a>(
    tag: u64,
    nodes: &'a [u32],
    tags: &[u64],
    collapsed: impl Fn() -> Option<Vec<u32>>,
) -> Result<Cow<'a, [u32]>, MeshError> {
    let Some(twice) = (1..nodes.len()).find(|i| nodes[..*i].contains(&nodes[*i])) else {
        return Ok(nodes.into());
    };
    let error = || MeshError::RepeatedNode {
        element: tag,
        node: tags[nodes[twice] as usize],
    };
    collapsed().map(Cow::from).ok_or_else(error)
}

/// Corners of a face without repetitions of the one before; `None` for those of a face
/// that touches itself, and no corners if it has no area.
fn distinct(face: impl Iterator<Item = u32>) -> Option<Vec<u32>> {
    let mut corners: Vec<u32> = face.collect();
    corners.dedup();
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let touches = |i: usize| corners[..i].contains(&corners[i]);
    match corners.len() {
        0..=2 => Some(Vec::new()),
        count => (!(1..count).any(touches)).then_some(corners),
    }
}

/// Node in the middle of each edge, by its ends in ascending order; `None` if two edges that fall
/// together have different ones.
type Middles = HashMap<[u32; 2], u32>;

fn ends(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn collapsed_solid(element: ElementType, nodes: &[u32]) -> Option<Vec<u32>> {
    let faces = element.shape.faces().iter();
    let faces: Option<Vec<Vec<u32>>> = faces
        .map(|face| distinct(face.iter().map(|i| nodes[*i])))
        .collect();
    let faces: Vec<Vec<u32>> = faces?.into_iter().filter(|f| !f.is_empty()).collect();
    let (shape, mut found) = shape_of(&faces)?;
    if element.order == ElementOrder::Quadratic {
        let mut middles = Middles::new();
        let of_edges = &nodes[element.shape.corners()..];
        for (middle, [a, b]) in of_edges.iter().zip(element.shape.edges()) {
            let (a, b) = (nodes[*a], nodes[*b]);
            if a != b
                && middles
                    .insert(ends(a, b), *middle)
                    .is_some_and(|m| m != *middle)
            {
                return None;
            }
        }
        for [a, b] in shape.edges() {
            found.push(*middles.get(&ends(found[*a], found[*b]))?);
        }
    }
    let is_once = |i: usize| !found[..i].contains(&found[i]);
    (1..found.len()).all(is_once).then_some(found)
}

/// Shape with these faces, each counter-clockwise seen from outside, and its corners in our order.
fn shape_of(faces: &[Vec<u32>]) -> Option<(Shape, Vec<u32>)> {
    let mut corners = faces.concat();
    corners.sort_unstable();
    corners.dedup();
    let of = |sides: usize| faces.iter().filter(move |face| face.len() == sides);
    let base = match of(4).count() {
        1 => of(4).next()?,
        _ => of(3).next()?,
    };
    // Our first face is the base, seen from outside: its first corner, then the others backwards.
    let mut ordered = vec![base[0]];
    ordered.extend(base[1..].iter().rev());
    match (of(3).count(), of(4).count(), corners.len()) {
        (4, 0, 4) | (4, 1, 5) => {
            ordered.extend(corners.iter().find(|c| !base.contains(c)));
            let shape = if base.len() == 3 {
                Shape::Tetrahedron
            } else {
                Shape::Pyramid
            };
            Some((shape, ordered))
        }
        (2, 3, 6) => {
            for i in 0..3 {
                let above = of(4).find_map(|face| {
                    let at = face.iter().position(|c| *c == ordered[i])?;
                    let beside = [face[(at + 1) % 4], face[(at + 3) % 4]];
                    beside.into_iter().find(|c| !base.contains(c))
                });
                ordered.push(above?);
            }
            Some((Shape::Wedge, ordered))
        }
        _ => None,
    }
}

fn collapsed_facet(nodes: &[u32]) -> Option<Vec<u32>> {
    let count = facet_corners(nodes.len());
    let (corners, of_edges) = nodes.split_at(count);
    let mut corners_left = distinct(corners.iter().copied()).filter(|found| found.len() == 3)?;
    if !of_edges.is_empty() {
        let sides = (0..count).filter(|i| corners[*i] != corners[(i + 1) % count]);
        let middles: Middles = sides
            .map(|i| (ends(corners[i], corners[(i + 1) % count]), of_edges[i]))
            .collect();
        for i in 0..3 {
            corners_left.push(*middles.get(&ends(corners_left[i], corners_left[(i + 1) % 3]))?);
        }
    }
    let is_once = |i: usize| !corners_left[..i].contains(&corners_left[i]);
    (1..corners_left.len()).all(is_once).then_some(corners_left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::quality;

    /// Nodes of a hexahedron of two orders on a unit cube, whose corners are then moved to others.
    fn cube(order: ElementOrder, to: [u32; 8]) -> (Mesh, Vec<u32>) {
        const CORNERS: [[f64; 3]; 8] = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
        ];
        let mut mesh = Mesh {
            nodes_m: CORNERS.to_vec(),
            ..Mesh::default()
        };
        let mut nodes = to.to_vec();
        if order == ElementOrder::Quadratic {
            let mut known: HashMap<[u32; 2], u32> = HashMap::new();
            for [a, b] in Shape::Hexahedron.edges() {
                let (a, b) = (to[*a], to[*b]);
                let middle =
                    [0, 1, 2].map(|k| 0.5 * (CORNERS[a as usize][k] + CORNERS[b as usize][k]));
                nodes.push(if a == b {
                    a
                } else {
                    *known.entry(ends(a, b)).or_insert_with(|| {
                        mesh.nodes_m.push(middle);
                        mesh.nodes_m.len() as u32 - 1
                    })
                });
            }
        }
        (mesh, nodes)
    }

    /// Every way to let corners of a cube fall together that gives another shape: its volume, and
    /// Jacobian determinants that are positive.
    #[test]
    fn collapsed_hexahedra_are_the_shapes_that_they_fill() {
        let shapes = [
            ([0, 1, 2, 2, 4, 5, 6, 6], Shape::Wedge, 0.5),
            ([0, 1, 1, 0, 4, 5, 6, 7], Shape::Wedge, 0.5),
            ([0, 0, 2, 3, 4, 4, 6, 7], Shape::Wedge, 0.5),
            ([0, 1, 2, 3, 0, 1, 6, 7], Shape::Wedge, 0.5),
            ([0, 1, 2, 3, 4, 4, 4, 4], Shape::Pyramid, 1.0 / 3.0),
            ([0, 0, 0, 0, 4, 5, 6, 7], Shape::Pyramid, 1.0 / 3.0),
            ([0, 1, 2, 2, 4, 4, 4, 4], Shape::Tetrahedron, 1.0 / 6.0),
            ([0, 0, 2, 3, 4, 4, 4, 4], Shape::Tetrahedron, 1.0 / 6.0),
        ];
        for (to, shape, volume) in shapes {
            for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
                let (mut mesh, nodes) = cube(order, to);
                let tags: Vec<u64> = (0..mesh.nodes_m.len() as u64).collect();
                let found = solid(7, &nodes, &tags).unwrap();
                let element = ElementType::new(shape, order);
                assert_eq!(found.len(), element.nodes(), "{to:?}");
                mesh.elements.push(7, found.iter().copied());
                let mut used = found.to_vec();
                used.sort_unstable();
                mesh.nodes_m = found.iter().map(|n| mesh.nodes_m[*n as usize]).collect();
                let mut alone = Mesh {
                    node_tags: (0..found.len() as u64).collect(),
                    nodes_m: mesh.nodes_m,
                    ..Mesh::default()
                };
                alone.elements.push(7, 0..found.len() as u32);
                let quality = quality::check(&alone).unwrap();
                assert!(
                    (quality.volume_m3 - volume).abs() < 1e-14,
                    "{to:?} {quality:?}"
                );
            }
        }
    }

    #[test]
    fn other_repetitions_are_errors_that_name_the_node() {
        let tags: Vec<u64> = (100..120).collect();
        let cases: [&[u32]; 4] = [
            &[0, 1, 2, 2, 4, 5, 6, 7],
            &[0, 1, 0, 3, 4, 5, 6, 7],
            &[0, 1, 2, 2],
            &[0, 1, 1, 0, 4, 5, 5, 4],
        ];
        for nodes in cases {
            let error = solid(7, nodes, &tags).unwrap_err().to_string();
            assert!(error.starts_with("element 7 names node 10"), "{error}");
        }
        assert!(facet(7, &[0, 1, 0, 2], &tags).is_err());
        assert!(facet(7, &[0, 1, 1], &tags).is_err());
    }

    #[test]
    fn collapsed_quadrilaterals_are_triangles() {
        let tags: Vec<u64> = (0..20).collect();
        assert_eq!(*facet(7, &[3, 4, 5, 5], &tags).unwrap(), [3, 4, 5]);
        assert_eq!(*facet(7, &[3, 4, 5, 3], &tags).unwrap(), [3, 4, 5]);
        let quadratic = [3, 4, 5, 5, 10, 11, 5, 12];
        let found = facet(7, &quadratic, &tags).unwrap();
        assert_eq!(*found, [3, 4, 5, 10, 11, 12]);
    }
}
