//! Nearest facets and nearest points, found by trees of boxes. The only place that knows the rstar
//! crate.

use rstar::primitives::GeomWithData;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use dovetail_mesh::element::facet_corners;
use dovetail_mesh::facet::{self, FacetPoint};
use dovetail_numerics::space::{dot, sub};

/// Most steps from the chord of a curved facet to the facet itself.
const STEPS: usize = 20;

/// Three corners of a facet: the chord of a triangle, or half of that of a quadrilateral.
struct Chord {
    facet: usize,
    corners_m: [[f64; 3]; 3],
    /// Reference coordinates of the corners.
    reference: [[f64; 2]; 3],
}

impl Chord {
    /// Shares of the corners in the point that is nearest to `p` (C. Ericson, Real-Time Collision
    /// Detection, 5.1.5).
    fn shares(&self, p: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.corners_m;
        let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
        let (d1, d2) = (dot(ab, ap), dot(ac, ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return [1.0, 0.0, 0.0];
        }
        let bp = sub(p, b);
        let (d3, d4) = (dot(ab, bp), dot(ac, bp));
        if d3 >= 0.0 && d4 <= d3 {
            return [0.0, 1.0, 0.0];
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            let v = d1 / (d1 - d3);
            return [1.0 - v, v, 0.0];
        }
        let cp = sub(p, c);
        let (d5, d6) = (dot(ab, cp), dot(ac, cp));
        if d6 >= 0.0 && d5 <= d6 {
            return [0.0, 0.0, 1.0];
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            let w = d2 / (d2 - d6);
            return [1.0 - w, 0.0, w];
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
            let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return [0.0, 1.0 - w, w];
        }
        let (v, w) = (vb / (va + vb + vc), vc / (va + vb + vc));
        [1.0 - v - w, v, w]
    }
}

impl RTreeObject for Chord {
    type Envelope = AABB<[f64; 3]>;
    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(self.corners_m.iter())
    }
}

impl PointDistance for Chord {
    fn distance_2(&self, p: &[f64; 3]) -> f64 {
        let nearest = weighted(&self.shares(*p), &self.corners_m);
        let d = sub(*p, nearest);
        dot(d, d)
    }
}

fn weighted<const N: usize>(shares: &[f64; 3], points: &[[f64; N]; 3]) -> [f64; N] {
    std::array::from_fn(|k| shares.iter().zip(points).map(|(s, x)| s * x[k]).sum())
}

/// Search tree of the facets of a surface.
pub(crate) struct FacetTree<'a> {
    facets_m: &'a [Vec<[f64; 3]>],
    tree: RTree<Chord>,
}

impl<'a> FacetTree<'a> {
    /// Tree of facets, each given as its 3, 4, 6 or 8 nodes.
    pub(crate) fn new(facets_m: &'a [Vec<[f64; 3]>]) -> Self {
        let mut chords = Vec::new();
        for (facet, nodes) in facets_m.iter().enumerate() {
            let (halves, reference): (&[[usize; 3]], &[[f64; 2]]) = match facet_corners(nodes.len())
            {
                3 => (&[[0, 1, 2]], &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
                _ => (
                    &[[0, 1, 2], [0, 2, 3]],
                    &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
                ),
            };
            chords.extend(halves.iter().map(|half| Chord {
                facet,
                corners_m: half.map(|i| nodes[i]),
                reference: half.map(|i| reference[i]),
            }));
        }
        Self {
            facets_m,
            tree: RTree::bulk_load(chords),
        }
    }

    /// Facet whose chord is nearest to `p`, and the point of the facet that is nearest. `None`
    /// without facets.
    pub(crate) fn nearest(&self, p: [f64; 3]) -> Option<(usize, FacetPoint)> {
        let chord = self.tree.nearest_neighbor(p)?;
        let start = weighted(&chord.shares(p), &chord.reference);
        let nodes = &self.facets_m[chord.facet];
        Some((chord.facet, nearest_on(nodes, start, p)))
    }
}

/// Point of a facet that is nearest to `p`, by the Gauss-Newton method from `start`.
fn nearest_on(nodes_m: &[[f64; 3]], start: [f64; 2], p: [f64; 3]) -> FacetPoint {
    let mut at = start;
    let mut best = facet::evaluate(nodes_m, at);
    if nodes_m.len() == 3 {
        return best;
    }
    let square = |point: &FacetPoint| {
        let d = sub(p, point.position_m);
        dot(d, d)
    };
    for _ in 0..STEPS {
        let [t, s] = best.tangents_m;
        let d = sub(p, best.position_m);
        let (tt, ts, ss) = (dot(t, t), dot(t, s), dot(s, s));
        let (td, sd) = (dot(t, d), dot(s, d));
        let determinant = tt * ss - ts * ts;
        if determinant <= 1e-12 * tt * ss {
            break;
        }
        let step = [ss * td - ts * sd, tt * sd - ts * td].map(|v| v / determinant);
        let next = inside(nodes_m.len(), [at[0] + step[0], at[1] + step[1]]);
        let point = facet::evaluate(nodes_m, next);
        // Near the minimum the squares differ by their rounding alone, while the point still moves.
        if square(&point) > square(&best) * (1.0 + 1e-12) {
            break;
        }
        let moved = (next[0] - at[0]).abs().max((next[1] - at[1]).abs());
        (at, best) = (next, point);
        if moved < 1e-12 {
            break;
        }
    }
    best
}

/// Reference coordinates moved back onto the facet.
fn inside(nodes: usize, [r, s]: [f64; 2]) -> [f64; 2] {
    if facet_corners(nodes) == 4 {
        return [r.clamp(-1.0, 1.0), s.clamp(-1.0, 1.0)];
    }
    let beyond = r + s - 1.0;
    let [r, s] = if beyond > 0.0 {
        [r - 0.5 * beyond, s - 0.5 * beyond]
    } else {
        [r, s]
    };
    let r = r.clamp(0.0, 1.0);
    [r, s.clamp(0.0, 1.0 - r)]
}

/// Search tree of points in space.
pub(crate) struct PointTree {
    tree: RTree<GeomWithData<[f64; 3], usize>>,
}

impl PointTree {
    /// Tree of these points.
    pub(crate) fn new(points_m: &[[f64; 3]]) -> Self {
        let numbered = points_m.iter().enumerate();
        let numbered = numbered.map(|(i, p)| GeomWithData::new(*p, i));
        Self {
            tree: RTree::bulk_load(numbered.collect()),
        }
    }

    /// Indices of the points in order of distance from `p`, with the squares of their distances.
    pub(crate) fn nearest(&self, p: [f64; 3]) -> impl Iterator<Item = (usize, f64)> {
        let neighbours = self.tree.nearest_neighbor_iter_with_distance_2(p);
        neighbours.map(|(point, square)| (point.data, square))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_numerics::space::{distance, middle, norm};
    use proptest::prelude::*;

    /// Six nodes of a triangle whose edges bulge.
    fn curved() -> Vec<[f64; 3]> {
        let corners = [[0.0; 3], [2.0, 0.0, 0.2], [0.3, 1.5, 0.0]];
        let mut nodes = corners.to_vec();
        for (a, b, z) in [(0, 1, 0.15), (1, 2, 0.2), (2, 0, -0.1)] {
            let [x, y, m] = middle(corners[a], corners[b]);
            nodes.push([x, y, m + z]);
        }
        nodes
    }

    fn warped() -> Vec<[f64; 3]> {
        vec![
            [0.0; 3],
            [2.0, 0.1, 0.3],
            [2.2, 1.4, -0.2],
            [-0.1, 1.0, 0.2],
        ]
    }

    proptest! {
        /// Compares with all points of a fine grid of the facet: none of them is nearer.
        #[test]
        fn no_point_of_a_facet_is_nearer(p in prop::array::uniform3(-1.0..2.5)) {
            for nodes in [curved()[..3].to_vec(), warped()] {
                let facets = [nodes.clone()];
                let (_, found) = FacetTree::new(&facets).nearest(p).unwrap();
                let (low, n) = if nodes.len() == 4 { (-1.0, 80) } else { (0.0, 80) };
                let mut least = f64::INFINITY;
                for i in 0..=n {
                    for j in 0..=n {
                        let at = [i, j].map(|k| low + (1.0 - low) * f64::from(k) / f64::from(n));
                        if nodes.len() == 3 && at[0] + at[1] > 1.0 {
                            continue;
                        }
                        least = least.min(distance(facet::evaluate(&nodes, at).position_m, p));
                    }
                }
                let own = distance(found.position_m, p);
                prop_assert!(own <= least * 1.0001 + 1e-9 || nodes.len() == 4 && own <= 1.02 * least, "{own} {least}");
            }
        }

        /// A point lifted off a curved facet along the normal comes back to where it was.
        #[test]
        fn a_lifted_point_comes_back(r in 0.1..0.6, s in 0.1..0.3, height in -0.05..0.05) {
            for nodes in [curved(), warped()] {
                let foot = facet::evaluate(&nodes, [r, s]);
                let length = norm(foot.normal_m2);
                let p = [0, 1, 2].map(|k| foot.position_m[k] + height * foot.normal_m2[k] / length);
                let facets = [nodes];
                let (_, found) = FacetTree::new(&facets).nearest(p).unwrap();
                prop_assert!(distance(found.position_m, foot.position_m) < 1e-9);
            }
        }
    }

    #[test]
    fn the_nearest_of_many_facets_and_points() {
        let facets: Vec<Vec<[f64; 3]>> = (0..20)
            .map(f64::from)
            .map(|x| vec![[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]])
            .collect();
        let tree = FacetTree::new(&facets);
        for (i, _) in facets.iter().enumerate() {
            assert_eq!(tree.nearest([i as f64 + 0.25, 0.25, 3.0]).unwrap().0, i);
        }
        assert!(FacetTree::new(&[]).nearest([0.0; 3]).is_none());
        let points: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i), 0.0, 1.0]).collect();
        let near: Vec<usize> = PointTree::new(&points)
            .nearest([3.2, 0.0, 0.0])
            .map(|n| n.0)
            .collect();
        assert_eq!(near[..4], [3, 4, 2, 5]);
    }
}
