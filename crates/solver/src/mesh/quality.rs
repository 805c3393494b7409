//! Elements no calculation can use: turned inside out, flat, doubled; and nodes of no element.

use std::collections::HashMap;

use thiserror::Error;

use super::{ElementOrder, Mesh, TET_EDGES};
use dovetail_numerics::space::{cross, dot, sub};

/// A tetrahedron whose mean ratio is below this is flat for any purpose.
pub const SLIVER_SHAPE: f64 = 1e-3;

/// How good the elements of a usable mesh are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Smallest mean ratio 12 (3 V)^(2/3) / sum of squared edges (straight edges): 1 for a regular
    /// tetrahedron, 0 for a flat one. Liu and Joe, BIT 34 (1994) 268-287.
    pub worst_shape: f64,
    /// Tag of that tetrahedron.
    pub worst_tag: u64,
    /// Smallest ratio, over the quadratic tetrahedra, of the least Jacobian determinant to that of
    /// the straight element; 1 for linear ones.
    pub worst_jacobian_ratio: f64,
    /// Volume of the straight-sided tetrahedra, m3.
    pub volume_m3: f64,
}

/// Elements that must not be used. Lists hold the first few tags, with the number of all.
#[derive(Debug, Error, PartialEq)]
#[expect(missing_docs, reason = "the messages say what they mean")]
pub enum QualityError {
    #[error(
        "all {count} tetrahedra are inside out: the geometry is mirrored, or the nodes of the elements are in another program's order; in Gmsh, turn them with `ReverseMesh Volume {{:}};`"
    )]
    AllInsideOut { count: usize },
    #[error(
        "{count} tetrahedra are inside out, first {}: mesh finer there, or with another Mesh.Algorithm3D",
        list(tags)
    )]
    InsideOut { count: usize, tags: Vec<u64> },
    #[error(
        "{count} tetrahedra are flat (mean ratio below {SLIVER_SHAPE}), first {}: optimise the mesh (Mesh.Optimize = 1, Mesh.OptimizeThreshold = 0.3) or use Mesh.Algorithm3D = 10",
        list(tags)
    )]
    Sliver { count: usize, tags: Vec<u64> },
    #[error(
        "{count} curved tetrahedra fold over themselves (Jacobian not positive), first {}: mesh finer at curved edges, or make them straight with Mesh.SecondOrderLinear = 1",
        list(tags)
    )]
    Folded { count: usize, tags: Vec<u64> },
    #[error(
        "{count} tetrahedra have the same corners as another, first {}: the file holds them twice; is a volume in the script twice?",
        list(tags)
    )]
    Doubled { count: usize, tags: Vec<u64> },
    #[error(
        "{count} nodes belong to no tetrahedron, first {}: a group names a surface, curve or point that no meshed volume has",
        list(tags)
    )]
    Orphan { count: usize, tags: Vec<u64> },
}

fn list(tags: &[u64]) -> String {
    let words: Vec<String> = tags.iter().map(u64::to_string).collect();
    words.join(", ")
}

fn first_few(tags: &[u64]) -> (usize, Vec<u64>) {
    (tags.len(), tags.iter().copied().take(10).collect())
}

/// Checks every tetrahedron and node.
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
    for (e, &tag) in mesh.tet_tags.iter().enumerate() {
        let x: Vec<[f64; 3]> = mesh
            .tet(e)
            .iter()
            .map(|&n| mesh.nodes_m[n as usize])
            .collect();
        let (volume, shape) = volume_and_shape(&x);
        quality.volume_m3 += volume;
        if shape < quality.worst_shape {
            (quality.worst_shape, quality.worst_tag) = (shape, tag);
        }
        if shape.abs() < SLIVER_SHAPE {
            slivers.push(tag);
        } else if volume < 0.0 {
            inside_out.push(tag);
        } else if mesh.order == ElementOrder::Quadratic {
            let ratio = least_jacobian(&x) / (6.0 * volume);
            quality.worst_jacobian_ratio = quality.worst_jacobian_ratio.min(ratio);
            if ratio <= 0.0 {
                folded.push(tag);
            }
        }
    }
    let (count, tags) = first_few(&inside_out);
    if count > 0 && count == mesh.tet_count() {
        return Err(QualityError::AllInsideOut { count });
    }
    if count > 0 {
        return Err(QualityError::InsideOut { count, tags });
    }
    let (count, tags) = first_few(&slivers);
    if count > 0 {
        return Err(QualityError::Sliver { count, tags });
    }
    let (count, tags) = first_few(&folded);
    if count > 0 {
        return Err(QualityError::Folded { count, tags });
    }
    check_doubled(mesh)?;
    check_orphans(mesh)?;
    Ok(quality)
}

/// Signed volume and signed mean ratio of the straight-sided tetrahedron.
fn volume_and_shape(x: &[[f64; 3]]) -> (f64, f64) {
    let edge = |a: usize, b: usize| sub(x[b], x[a]);
    let volume = determinant([edge(0, 1), edge(0, 2), edge(0, 3)]) / 6.0;
    let squares: f64 = TET_EDGES
        .iter()
        .flat_map(|&[a, b]| edge(a, b))
        .map(|d| d * d)
        .sum();
    if squares == 0.0 {
        return (0.0, 0.0);
    }
    let shape = 12.0 * (3.0 * volume.abs()).powf(2.0 / 3.0) / squares;
    (volume, shape.copysign(volume))
}

/// Rows a, b, c.
fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    dot(a, cross(b, c))
}

/// Least Jacobian determinant of a ten-node tetrahedron at its nodes and at the four points of the
/// quadrature of degree 2.
fn least_jacobian(x: &[[f64; 3]]) -> f64 {
    const NEAR: f64 = 0.585_410_196_624_968_5; // (5 + 3 sqrt 5) / 20
    const FAR: f64 = 0.138_196_601_125_010_5; // (5 - sqrt 5) / 20
    let corners = (0..4).map(|i| std::array::from_fn(|k| f64::from(u8::from(i == k))));
    let middles = TET_EDGES
        .iter()
        .map(|edge| std::array::from_fn(|k| if edge.contains(&k) { 0.5 } else { 0.0 }));
    let inner = (0..4).map(|i| std::array::from_fn(|k| if i == k { NEAR } else { FAR }));
    corners
        .chain(middles)
        .chain(inner)
        .map(|l| jacobian(x, l))
        .fold(f64::INFINITY, f64::min)
}

/// Jacobian determinant at barycentric coordinates `l`; six times the volume for straight edges.
fn jacobian(x: &[[f64; 3]], l: [f64; 4]) -> f64 {
    // dx/dl_i: corner N_i = l_i (2 l_i - 1), middle of (a, b) N = 4 l_a l_b.
    let mut d = [[0.0; 3]; 4];
    for k in 0..3 {
        for i in 0..4 {
            d[i][k] = (4.0 * l[i] - 1.0) * x[i][k];
        }
        for (m, &[a, b]) in TET_EDGES.iter().enumerate() {
            d[a][k] += 4.0 * l[b] * x[4 + m][k];
            d[b][k] += 4.0 * l[a] * x[4 + m][k];
        }
    }
    determinant([1, 2, 3].map(|i| sub(d[i], d[0])))
}

fn check_doubled(mesh: &Mesh) -> Result<(), QualityError> {
    let mut seen = HashMap::with_capacity(mesh.tet_count());
    let mut doubled = Vec::new();
    for (e, &tag) in mesh.tet_tags.iter().enumerate() {
        let t = mesh.tet(e);
        let mut corners = [t[0], t[1], t[2], t[3]];
        corners.sort_unstable();
        if seen.insert(corners, tag).is_some() {
            doubled.push(tag);
        }
    }
    match first_few(&doubled) {
        (0, _) => Ok(()),
        (count, tags) => Err(QualityError::Doubled { count, tags }),
    }
}

fn check_orphans(mesh: &Mesh) -> Result<(), QualityError> {
    let mut used = vec![false; mesh.nodes_m.len()];
    for &n in &mesh.tets {
        used[n as usize] = true;
    }
    let orphans: Vec<u64> = (0..used.len())
        .filter(|&n| !used[n])
        .map(|n| mesh.node_tags[n])
        .collect();
    match first_few(&orphans) {
        (0, _) => Ok(()),
        (count, tags) => Err(QualityError::Orphan { count, tags }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_numerics::space::middle;
    use std::collections::BTreeMap;

    fn mesh(order: ElementOrder, nodes_m: Vec<[f64; 3]>, tets: Vec<u32>) -> Mesh {
        let count = tets.len() / order.nodes_per_tet();
        Mesh {
            order,
            node_tags: (1..=nodes_m.len() as u64).collect(),
            nodes_m,
            tets,
            tet_tags: (101..101 + count as u64).collect(),
            facets: vec![],
            facet_tags: vec![],
            groups: BTreeMap::new(),
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
        mesh(ElementOrder::Linear, nodes, vec![0, 1, 2, 3, 1, 2, 3, 4])
    }

    fn quadratic_tet() -> Mesh {
        let mut nodes = two_tets().nodes_m;
        nodes.truncate(4);
        for [a, b] in TET_EDGES {
            nodes.push(middle(nodes[a], nodes[b]));
        }
        mesh(ElementOrder::Quadratic, nodes, (0..10).collect())
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
        assert!((volume_and_shape(&x).1 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn one_or_all_inside_out() {
        let mut m = two_tets();
        m.tets.swap(0, 1);
        let tags = vec![101];
        assert_eq!(check(&m), Err(QualityError::InsideOut { count: 1, tags }));
        m.tets.swap(4, 5);
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
        m.tets.extend([1, 2, 0, 3]);
        m.tet_tags.push(103);
        let tags = vec![103];
        assert_eq!(check(&m), Err(QualityError::Doubled { count: 1, tags }));

        let mut m = two_tets();
        m.nodes_m.push([9.0; 3]);
        m.node_tags.push(77);
        let tags = vec![77];
        assert_eq!(check(&m), Err(QualityError::Orphan { count: 1, tags }));
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
