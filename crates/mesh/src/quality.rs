//! Check for elements that no calculation can use: turned inside out, flat, doubled, or not joined
//! to their neighbours; and for nodes of no element.

use std::collections::HashMap;
use std::sync::LazyLock;

use thiserror::Error;

use super::element::{facet_corners, sorted_corners};
use super::interpolation::{element_functions, reference_nodes};
use super::{ElementOrder, ElementType, Group, Mesh, Shape, text};
use dovetail_numerics::space::{cross, dot, middle, sub};

/// Mean ratio below which an element counts as flat.
pub const SLIVER_SHAPE: f64 = 1e-3;

/// Quality of the elements of a usable mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Quality {
    /// Smallest mean ratio 3 det(A)^(2/3) / |A|^2 over all corners. A maps the edges that meet
    /// there in an element of equal edges to those of this element. 1 for an element of equal
    /// edges, 0 for a flat one. (All corners of a tetrahedron have the same ratio. Liu and Joe, BIT
    /// 34 (1994) 268-287; Knupp, SIAM J. Sci. Comput. 23 (2001) 193-218.)
    pub worst_shape: f64,
    /// Tag of the element with that ratio.
    pub worst_tag: u64,
    /// Smallest ratio, over all elements but linear tetrahedra, of the least Jacobian determinant
    /// to that of an undistorted element of the same volume.
    pub worst_jacobian_ratio: f64,
    /// Volume of the elements with straight edges, m3.
    pub volume_m3: f64,
}

/// Error of elements that must not be used. Lists hold the first few tags, with the number of all.
#[derive(Debug, Error, PartialEq)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum QualityError {
    #[error(
        "all {count} elements are inside out: the geometry is mirrored, or the nodes of the elements are in another program's order; in Gmsh, turn them with `ReverseMesh Volume {{:}};`"
    )]
    AllInsideOut { count: usize },
    #[error(
        "{count} elements are inside out, first {}: mesh finer there, or with another algorithm (in Gmsh: Mesh.Algorithm3D)",
        list(tags)
    )]
    InsideOut { count: usize, tags: Vec<u64> },
    #[error(
        "{count} elements are flat (mean ratio below {SLIVER_SHAPE}), first {}: improve the mesh there (in Gmsh: Mesh.Optimize = 1 with Mesh.OptimizeThreshold = 0.3, or Mesh.Algorithm3D = 10)",
        list(tags)
    )]
    Sliver { count: usize, tags: Vec<u64> },
    #[error(
        "{count} elements fold over themselves (Jacobian not positive), first {}: mesh finer at curved edges, make them straight (in Gmsh: Mesh.SecondOrderLinear = 1), or mend the corners of hexahedra and wedges that are too skewed",
        list(tags)
    )]
    Folded { count: usize, tags: Vec<u64> },
    #[error(
        "{count} elements have the same corners as another, first {}: the file holds them twice; is a volume in it twice?",
        list(tags)
    )]
    Doubled { count: usize, tags: Vec<u64> },
    #[error(
        "{count} elements or facets have an edge with a node in its middle where another has none, or another one, first {}: mesh everything that is joined with one order (in Gmsh: Mesh.ElementOrder)",
        list(tags)
    )]
    MixedOrders { count: usize, tags: Vec<u64> },
    #[error(
        "{count} elements have a quadrilateral on which the triangles of other elements lie, first {}: they are not joined there; put pyramids between hexahedra or wedges and tetrahedra",
        list(tags)
    )]
    NoPyramids { count: usize, tags: Vec<u64> },
    #[error(
        "{count} nodes belong to no solid element, first {}: {}",
        list(tags),
        groups_without_elements(groups)
    )]
    Orphan {
        count: usize,
        tags: Vec<u64>,
        /// Groups that hold such nodes alone.
        groups: Vec<String>,
    },
}

fn list(tags: &[u64]) -> String {
    let words: Vec<String> = tags.iter().map(u64::to_string).collect();
    words.join(", ")
}

fn groups_without_elements(groups: &[String]) -> String {
    match groups {
        [] => "a surface, curve or point is meshed that no meshed volume has".to_owned(),
        some => format!(
            "no meshed volume has the nodes of {}: a volume is missing from the file (a Gmsh script that names groups \
             writes only those: give each body a Physical Volume), or the group is not on a body",
            text::list(some)
        ),
    }
}

/// Error of elements or nodes with these tags; none where there are none.
fn refuse(
    tags: &[u64],
    error: impl Fn(usize, Vec<u64>) -> QualityError,
) -> Result<(), QualityError> {
    match tags.len() {
        0 => Ok(()),
        count => Err(error(count, tags.iter().copied().take(10).collect())),
    }
}

/// Checks every element and node. Without elements the worst shape is infinite.
///
/// # Errors
/// Elements that must not be used: see [`QualityError`].
pub fn check(mesh: &Mesh) -> Result<Quality, QualityError> {
    let mut quality = Quality {
        worst_shape: f64::INFINITY,
        worst_tag: 0,
        worst_jacobian_ratio: 1.0,
        volume_m3: 0.0,
    };
    let (mut inside_out, mut slivers, mut folded) = (Vec::new(), Vec::new(), Vec::new());
    for ((element, nodes), &tag) in mesh.elements.solids().zip(mesh.elements.tags()) {
        let x: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.nodes_m[n as usize]).collect();
        let (volume, shape) = (volume(element.shape, &x), worst_corner(element.shape, &x));
        quality.volume_m3 += volume;
        if shape < quality.worst_shape {
            (quality.worst_shape, quality.worst_tag) = (shape, tag);
        }
        if shape.abs() < SLIVER_SHAPE {
            slivers.push(tag);
        } else if volume < 0.0 {
            inside_out.push(tag);
        } else if element != ElementType::TET4 {
            let ratio = jacobian_ratio(element, &x, volume);
            quality.worst_jacobian_ratio = quality.worst_jacobian_ratio.min(ratio);
            if ratio <= 0.0 || shape < 0.0 {
                folded.push(tag);
            }
        }
    }
    refuse(&inside_out, |count, tags| {
        if count == mesh.elements.len() {
            QualityError::AllInsideOut { count }
        } else {
            QualityError::InsideOut { count, tags }
        }
    })?;
    refuse(&slivers, |count, tags| QualityError::Sliver { count, tags })?;
    refuse(&folded, |count, tags| QualityError::Folded { count, tags })?;
    check_doubled(mesh)?;
    check_orders(mesh)?;
    check_faces(mesh)?;
    check_orphans(mesh)?;
    Ok(quality)
}

/// Returns `true` if an element with its nodes at `x` folds over itself: its Jacobian determinant
/// is not positive at one of the points that are checked.
pub fn folds(element: ElementType, x: &[[f64; 3]]) -> bool {
    jacobian_ratio(element, x, volume(element.shape, x)) <= 0.0
}

/// Ratio of the least Jacobian determinant to that of an undistorted element of this volume.
fn jacobian_ratio(element: ElementType, x: &[[f64; 3]], volume: f64) -> f64 {
    least_jacobian(element, x) / (volume / reference_volume(element.shape))
}

/// Signed volume of the element with straight edges: each face is the bilinear surface of its
/// corners.
fn volume(shape: Shape, x: &[[f64; 3]]) -> f64 {
    let origin = x[0];
    let cone = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        determinant([sub(a, origin), sub(b, origin), sub(c, origin)]) / 6.0
    };
    let of_face = |face: &&[usize]| match **face {
        [a, b, c] => cone(x[a], x[b], x[c]),
        [a, b, c, d] => {
            let centre = middle(middle(x[a], x[c]), middle(x[b], x[d]));
            let sides = [[a, b], [b, c], [c, d], [d, a]];
            sides.iter().map(|&[p, q]| cone(x[p], x[q], centre)).sum()
        }
        _ => unreachable!("faces have three or four corners"),
    };
    match shape {
        Shape::Tetrahedron => cone(x[1], x[2], x[3]),
        _ => shape.faces().iter().map(of_face).sum(),
    }
}

/// Volume of the reference element.
fn reference_volume(shape: Shape) -> f64 {
    match shape {
        Shape::Tetrahedron => 1.0 / 6.0,
        Shape::Wedge => 1.0,
        Shape::Pyramid => 8.0 / 3.0,
        Shape::Hexahedron => 8.0,
    }
}

/// Corners with the ends of the three edges that meet there, right-handed. The apex of a pyramid,
/// where four edges meet, is left out; all corners of a tetrahedron are alike.
fn corners(shape: Shape) -> &'static [[usize; 4]] {
    match shape {
        Shape::Tetrahedron => &[[0, 1, 2, 3]],
        Shape::Pyramid => &[[0, 1, 3, 4], [1, 2, 0, 4], [2, 3, 1, 4], [3, 0, 2, 4]],
        Shape::Wedge => &[
            [0, 1, 2, 3],
            [1, 2, 0, 4],
            [2, 0, 1, 5],
            [3, 5, 4, 0],
            [4, 3, 5, 1],
            [5, 4, 3, 2],
        ],
        Shape::Hexahedron => &[
            [0, 1, 3, 4],
            [1, 2, 0, 5],
            [2, 3, 1, 6],
            [3, 0, 2, 7],
            [4, 7, 5, 0],
            [5, 4, 6, 1],
            [6, 5, 7, 2],
            [7, 6, 4, 3],
        ],
    }
}

/// Inverse of the matrix of the edges, in that order, that meet in a corner of an element with
/// equal edges. Rows are the columns of the inverse.
fn to_equal_edges(shape: Shape) -> [[f64; 3]; 3] {
    let third = 1.0 / 3.0_f64.sqrt();
    let root = 2.0_f64.sqrt();
    match shape {
        // Edges (1, 0, 0), (1/2, sqrt(3)/2, 0), (1/2, sqrt(3)/6, sqrt(2/3)).
        Shape::Tetrahedron => [
            [1.0, 0.0, 0.0],
            [-third, 2.0 * third, 0.0],
            [-1.0 / 6.0_f64.sqrt(), -1.0 / 6.0_f64.sqrt(), 1.5_f64.sqrt()],
        ],
        // (1, 0, 0), (0, 1, 0), (1/2, 1/2, 1/sqrt(2)).
        Shape::Pyramid => [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-0.5 * root, -0.5 * root, root],
        ],
        // (1, 0, 0), (1/2, sqrt(3)/2, 0), (0, 0, 1).
        Shape::Wedge => [[1.0, 0.0, 0.0], [-third, 2.0 * third, 0.0], [0.0, 0.0, 1.0]],
        Shape::Hexahedron => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    }
}

/// Smallest signed mean ratio of all corners; 0 where an edge has no length.
fn worst_corner(shape: Shape, x: &[[f64; 3]]) -> f64 {
    let back = to_equal_edges(shape);
    let ratio = |&[at, p, q, r]: &[usize; 4]| {
        let edges = [p, q, r].map(|end| sub(x[end], x[at]));
        let columns =
            back.map(|w| [0, 1, 2].map(|k| (0..3).map(|i| w[i] * edges[i][k]).sum::<f64>()));
        let squares: f64 = columns.iter().flatten().map(|a| a * a).sum();
        if squares == 0.0 {
            return 0.0;
        }
        let det = determinant(columns);
        (3.0 * det.abs().powf(2.0 / 3.0) / squares).copysign(det)
    };
    corners(shape)
        .iter()
        .map(ratio)
        .fold(f64::INFINITY, f64::min)
}

/// Determinant of the rows a, b, c.
fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    dot(a, cross(b, c))
}

/// Gradients of the shape functions at a point, and the Jacobian determinant of the undistorted
/// element there.
type Probe = (Vec<[f64; 3]>, f64);

/// Points at which a type of element is checked: its nodes, and points inside it.
fn probes(element: ElementType) -> &'static [Probe] {
    static ALL: LazyLock<[Vec<Probe>; 8]> = LazyLock::new(|| ElementType::ALL.map(made));
    &ALL[element.number()]
}

fn made(element: ElementType) -> Vec<Probe> {
    const NEAR: f64 = 0.585_410_196_624_968_5; // (5 + 3 sqrt 5) / 20
    const FAR: f64 = 0.138_196_601_125_010_5; // (5 - sqrt 5) / 20
    let gauss = 1.0 / 3.0_f64.sqrt();
    let mut points = reference_nodes(element);
    match element.shape {
        Shape::Tetrahedron => {
            points.push([FAR; 3]);
            let near = |k: usize| std::array::from_fn(|i| if i == k { NEAR } else { FAR });
            points.extend((0..3).map(near));
        }
        Shape::Wedge => {
            let inner = [[1.0, 1.0], [4.0, 1.0], [1.0, 4.0]];
            points.extend(inner.map(|[r, s]| [r / 6.0, s / 6.0, -gauss]));
            points.extend(inner.map(|[r, s]| [r / 6.0, s / 6.0, gauss]));
        }
        Shape::Pyramid | Shape::Hexahedron => {
            let signs = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 0 { -gauss } else { gauss });
            points.extend((0..8).map(signs));
        }
    }
    let probe = |point: [f64; 3]| {
        let s = 0.5 * (1.0 - point[2]);
        let undistorted = match element.shape {
            Shape::Pyramid => s * s,
            _ => 1.0,
        };
        let functions = element_functions(element, point);
        (functions.iter().map(|n| n.gradient).collect(), undistorted)
    };
    // At a pyramid's apex, where the map from the cube is flat, nothing can be said.
    let probed = points.into_iter().map(probe);
    probed
        .filter(|(_, undistorted)| *undistorted > 0.0)
        .collect()
}

/// Smallest ratio of the Jacobian determinant to that of the reference element.
fn least_jacobian(element: ElementType, x: &[[f64; 3]]) -> f64 {
    let at = |(gradients, undistorted): &Probe| {
        let mut j = [[0.0; 3]; 3];
        for (x, g) in x.iter().zip(gradients) {
            for r in 0..3 {
                for c in 0..3 {
                    j[r][c] += x[r] * g[c];
                }
            }
        }
        determinant(j) / undistorted
    };
    probes(element).iter().map(at).fold(f64::INFINITY, f64::min)
}

fn check_doubled(mesh: &Mesh) -> Result<(), QualityError> {
    let mut seen = HashMap::with_capacity(mesh.elements.len());
    let mut doubled = Vec::new();
    for ((element, nodes), &tag) in mesh.elements.solids().zip(mesh.elements.tags()) {
        let corners: [u32; 8] = sorted_corners(&nodes[..element.shape.corners()]);
        if seen.insert(corners, tag).is_some() {
            doubled.push(tag);
        }
    }
    refuse(&doubled, |count, tags| QualityError::Doubled {
        count,
        tags,
    })
}

/// Checks that the edges of elements, then of facets, have one node in the middle, or none, for all
/// that share them. A mesh of one order needs no check.
fn check_orders(mesh: &Mesh) -> Result<(), QualityError> {
    let has_middles = |nodes: &[u32]| nodes.len() > facet_corners(nodes.len());
    let orders = || {
        let elements = mesh.elements.solids();
        let elements = elements.map(|(element, _)| element.order == ElementOrder::Quadratic);
        elements.chain(mesh.facets.iter().map(has_middles))
    };
    if orders().all(|quadratic| quadratic) || !orders().any(|quadratic| quadratic) {
        return Ok(());
    }
    let mut middles: HashMap<[u32; 2], Option<u32>> = HashMap::new();
    let mut differs = |nodes: &[u32], corners: usize, edges: &[[usize; 2]]| {
        let mut differs = false;
        for (i, &[a, b]) in edges.iter().enumerate() {
            let key = [nodes[a].min(nodes[b]), nodes[a].max(nodes[b])];
            let middle = nodes.get(corners + i).copied();
            differs |= *middles.entry(key).or_insert(middle) != middle;
        }
        differs
    };
    let mut tags = Vec::new();
    for ((ElementType { shape, .. }, nodes), &tag) in
        mesh.elements.solids().zip(mesh.elements.tags())
    {
        if differs(nodes, shape.corners(), shape.edges()) {
            tags.push(tag);
        }
    }
    for (nodes, &tag) in mesh.facets.iter().zip(mesh.facets.tags()) {
        let corners = facet_corners(nodes.len());
        let edges: Vec<_> = (0..corners).map(|i| [i, (i + 1) % corners]).collect();
        if differs(nodes, corners, &edges) {
            tags.push(tag);
        }
    }
    refuse(&tags, |count, tags| QualityError::MixedOrders {
        count,
        tags,
    })
}

/// Checks that no quadrilateral of one element lies on triangles of others.
fn check_faces(mesh: &Mesh) -> Result<(), QualityError> {
    let mut shapes = [false; Shape::ALL.len()];
    for (element, _) in mesh.elements.solids() {
        shapes[element.shape as usize] = true;
    }
    // All faces of hexahedra alone, or of tetrahedra alone, are alike.
    if shapes.iter().filter(|is_there| **is_there).count() < 2 {
        return Ok(());
    }
    let mut faces: HashMap<[u32; 4], (usize, u64)> = HashMap::new();
    for ((element, nodes), &tag) in mesh.elements.solids().zip(mesh.elements.tags()) {
        for (_, corners) in element.sorted_faces(nodes) {
            faces.entry(corners).or_insert((0, tag)).0 += 1;
        }
    }
    let is_outer = |corners: [u32; 4]| faces.get(&corners).is_some_and(|(count, _)| *count == 1);
    let of_three = |corners: &[u32; 4]| corners[3] == u32::MAX;
    let mut tags: Vec<u64> = faces
        .iter()
        .filter(|(corners, (count, _))| {
            let without = |k: usize| {
                let mut three = **corners;
                three[k] = u32::MAX;
                three.sort_unstable();
                three
            };
            *count == 1 && !of_three(corners) && (0..4).any(|k| is_outer(without(k)))
        })
        .map(|(_, (_, tag))| *tag)
        .collect();
    tags.sort_unstable();
    refuse(&tags, |count, tags| QualityError::NoPyramids {
        count,
        tags,
    })
}

fn check_orphans(mesh: &Mesh) -> Result<(), QualityError> {
    let mut used = vec![false; mesh.nodes_m.len()];
    // A volume without elements is a body of matrices.
    let bodies = mesh.groups.values().filter(|g| g.dimension == 3);
    let of_bodies = bodies.flat_map(|group| &group.nodes);
    for &n in mesh.elements.nodes().iter().chain(of_bodies) {
        used[n as usize] = true;
    }
    let orphans: Vec<u64> = (0..used.len())
        .filter(|&n| !used[n])
        .map(|n| mesh.node_tags[n])
        .collect();
    let lies_apart = |group: &Group| {
        let mut nodes = group.nodes.iter();
        !group.nodes.is_empty() && nodes.all(|&n| !used[n as usize])
    };
    refuse(&orphans, |count, tags| QualityError::Orphan {
        count,
        tags,
        groups: (mesh.groups.iter())
            .filter(|(_, group)| lies_apart(group))
            .map(|(name, _)| format!("`{name}`"))
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Connectivity;

    /// A cube of one hexahedron with edges of 1 m.
    fn cube() -> Mesh {
        let layer = |z: f64| [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]];
        mesh(
            [layer(0.0), layer(1.0)].concat(),
            &[&[0, 1, 2, 3, 4, 5, 6, 7]],
        )
    }

    fn mesh(nodes_m: Vec<[f64; 3]>, elements: &[&[u32]]) -> Mesh {
        let mut list = Connectivity::default();
        for (tag, nodes) in (101..).zip(elements) {
            list.push(tag, nodes.iter().copied());
        }
        Mesh {
            node_tags: (1..=nodes_m.len() as u64).collect(),
            nodes_m,
            elements: list,
            facets: Connectivity::default(),
            ..Mesh::default()
        }
    }

    fn two_tets() -> Mesh {
        let nodes = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
        ];
        mesh(nodes, &[&[0, 1, 2, 3], &[1, 2, 3, 4]])
    }

    fn quadratic_tet() -> Mesh {
        let mut nodes = two_tets().nodes_m;
        nodes.truncate(4);
        for &[a, b] in Shape::Tetrahedron.edges() {
            nodes.push(middle(nodes[a], nodes[b]));
        }
        mesh(nodes, &[&(0..10).collect::<Vec<u32>>()])
    }

    #[test]
    fn volume_and_shape_of_known_tetrahedra() {
        let found = check(&two_tets()).unwrap();
        // 1/6 and 1/3 (corner and inner tetrahedron of the unit cube).
        assert!((found.volume_m3 - 0.5).abs() < 1e-15);
        // Corner of a cube: V = 1/6, squared edges 3 + 6.
        let corner = 12.0 * 0.5f64.powf(2.0 / 3.0) / 9.0;
        assert!((found.worst_shape - corner).abs() < 1e-15);
        // The inner one is regular.
        let x: Vec<_> = [1, 2, 3, 4].map(|i| two_tets().nodes_m[i]).to_vec();
        assert!((worst_corner(Shape::Tetrahedron, &x) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn one_or_all_inside_out() {
        let mut m = two_tets();
        m.elements.nodes_mut().swap(0, 1);
        let tags = vec![101];
        assert_eq!(check(&m), Err(QualityError::InsideOut { count: 1, tags }));
        m.elements.nodes_mut().swap(4, 5);
        assert_eq!(check(&m), Err(QualityError::AllInsideOut { count: 2 }));
    }

    #[test]
    fn flat_doubled_and_orphan() {
        let mut m = two_tets();
        m.nodes_m[4] = [1.0 / 3.0 + 1e-6; 3];
        let tags = vec![102];
        assert_eq!(check(&m), Err(QualityError::Sliver { count: 1, tags }));
        m.nodes_m[4] = [f64::MIN_POSITIVE; 3]; // far on the wrong side
        assert!(matches!(check(&m), Err(QualityError::InsideOut { .. })));

        let mut m = two_tets();
        m.elements.push(103, [1, 2, 0, 3]);
        let tags = vec![103];
        assert_eq!(check(&m), Err(QualityError::Doubled { count: 1, tags }));

        let mut m = two_tets();
        m.nodes_m.push([9.0; 3]);
        m.node_tags.push(77);
        let orphan = |groups: &[&str]| QualityError::Orphan {
            count: 1,
            tags: vec![77],
            groups: groups.iter().map(|g| format!("`{g}`")).collect(),
        };
        assert_eq!(check(&m), Err(orphan(&[])));
        for (name, nodes) in [("apart", vec![5]), ("across", vec![4, 5]), ("none", vec![])] {
            let group = Group {
                nodes,
                ..Group::empty(2)
            };
            m.groups.insert(name.to_owned(), group);
        }
        assert_eq!(check(&m), Err(orphan(&["apart"])));
        assert!(
            orphan(&["apart"])
                .to_string()
                .contains("of `apart`: a volume is missing")
        );
    }

    /// Every shape with equal edges has the best ratio; its mirror image is inside out.
    #[test]
    fn elements_of_equal_edges_are_the_best_there_are() {
        let h = 0.75_f64.sqrt();
        let triangle = [[0.0, 0.0], [1.0, 0.0], [0.5, h]];
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let level = |corners: &[[f64; 2]], z: f64| -> Vec<[f64; 3]> {
            corners.iter().map(|[x, y]| [*x, *y, z]).collect()
        };
        let pyramid = [level(&square, 0.0), vec![[0.5, 0.5, 0.5_f64.sqrt()]]].concat();
        let wedge = [level(&triangle, 0.0), level(&triangle, 1.0)].concat();
        let cube = [level(&square, 0.0), level(&square, 1.0)].concat();
        for (nodes, volume) in [
            (pyramid, 0.5_f64.sqrt() / 3.0),
            (wedge, h / 2.0),
            (cube, 1.0),
        ] {
            let all: Vec<u32> = (0..nodes.len() as u32).collect();
            let mut m = mesh(nodes, &[&all]);
            let found = check(&m).unwrap();
            assert!((found.worst_shape - 1.0).abs() < 1e-14, "{found:?}");
            assert!(
                (found.worst_jacobian_ratio - 1.0).abs() < 1e-14,
                "{found:?}"
            );
            assert!((found.volume_m3 - volume).abs() < 1e-15, "{found:?}");
            m.nodes_m.iter_mut().for_each(|x| x[2] = -x[2]);
            assert_eq!(check(&m), Err(QualityError::AllInsideOut { count: 1 }));
        }
    }

    #[test]
    fn a_corner_drawn_inwards_folds_a_hexahedron() {
        let mut m = cube();
        m.nodes_m[6] = [0.2; 3];
        let tags = vec![101];
        assert_eq!(check(&m), Err(QualityError::Folded { count: 1, tags }));
    }

    /// A cube with two wedges beside it whose triangles lie on its face.
    #[test]
    fn triangles_on_a_quadrilateral_are_not_joined_to_it() {
        let cube = cube();
        let mut m = cube.clone();
        let far = m.nodes_m.len() as u32;
        m.nodes_m.push([2.0, 0.5, 0.5]);
        m.node_tags.push(99);
        let face: Vec<u32> = Shape::Hexahedron.faces()[3]
            .iter()
            .map(|&i| cube.elements.element_nodes(0)[i])
            .collect();
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let base = corners.map(|i: usize| face[i]);
            m.elements.push(200, [base[0], base[1], base[2], far]);
        }
        let tags = vec![101];
        assert_eq!(check(&m), Err(QualityError::NoPyramids { count: 1, tags }));
        // One pyramid in their place is.
        let mut joined = cube.clone();
        joined.nodes_m.push([2.0, 0.5, 0.5]);
        joined.node_tags.push(99);
        joined
            .elements
            .push(200, [face[0], face[1], face[2], face[3], far]);
        assert!(check(&joined).is_ok());
    }

    #[test]
    fn curved_elements_are_checked_where_they_are_integrated() {
        let straight = check(&quadratic_tet()).unwrap();
        assert!((straight.worst_jacobian_ratio - 1.0).abs() < 1e-14);
        let mut m = quadratic_tet();
        // Middle of edge 0-1 moved along it: dx/dl at corner 0 is 4 x_m - x_1, 0 at a quarter.
        m.nodes_m[4][0] = 0.3;
        let found = check(&m).unwrap().worst_jacobian_ratio;
        assert!((found - (4.0 * 0.3 - 1.0)).abs() < 1e-14, "{found}");
        m.nodes_m[4][0] = 0.24;
        let tags = vec![101];
        assert_eq!(check(&m), Err(QualityError::Folded { count: 1, tags }));
    }
}
