//! Mapping of forces and pressures at points in space to consistent forces on the nodes of a
//! surface.
//!
//! A force goes to the nearest point of the surface and is shared there by the shape functions of
//! the facet. They add up to one, so that the sum of the forces is kept. Pressures with areas are
//! forces -p A n along the inward normal. Pressures alone are a field: it is found at the points of
//! quadrature of the facets by [`least_squares`], and gives node a the force -int N_a p n dA.

use std::borrow::Cow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::least_squares;
use super::neighbours::{FacetTree, PointTree};
use dovetail_mesh::element::facet_corners;
use dovetail_mesh::facet::{self, FacetPoint};
use dovetail_mesh::surface_field::{FieldValues, SurfaceField};
use dovetail_numerics::space::{add_scaled, cross, distance, dot, norm, scaled, sub, unit};

/// Report of how a field at points in space was mapped to a surface, at the amplitude of its
/// excitation. In complex vectors the real part comes first.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FieldMap {
    /// Source of the field.
    pub field: String,
    /// Group that it acts on.
    pub surface: String,
    /// Number of given points.
    pub points: usize,
    /// Sum of the given forces, N; `None` for pressures without areas.
    pub given_n: Option<[[f64; 3]; 2]>,
    /// Sum of the forces on the nodes, N.
    pub applied_n: [[f64; 3]; 2],
    /// Largest distance of a point from the surface.
    pub largest_distance_m: f64,
    /// Root mean square of the distances.
    pub rms_distance_m: f64,
    /// Number of points farther from the surface than the longest edge of the nearest facet.
    pub far_points: usize,
    /// Difference of the moment about the centroid of the surface from that of the given forces,
    /// over the sum of the products of forces and lever arms; `None` for pressures without areas.
    pub moment_error: Option<f64>,
    /// Interpolation error of pressures without areas. It is the root mean square of the
    /// differences between the given pressures and those that all other points give there, over
    /// that of the pressures. `None` where the points are too few for such a comparison
    /// ([`FieldMap::LEAST_POINTS`]).
    pub interpolation_error: Option<f64>,
    /// Difference of the sum of the forces from the sum that half of the points gives, N, the
    /// larger for two halves, for pressures without areas; `None` for a single point.
    pub sum_error_n: Option<f64>,
    /// Number of facets that no point is near, for pressures without areas.
    pub empty_facets: usize,
    /// Number of facets of the surface.
    pub facets: usize,
    /// Distance of each point from the surface, m. No result depends on it.
    #[serde(skip)]
    distances_m: Vec<f64>,
}

impl FieldMap {
    /// Fewest points without areas for which an error can be estimated: those of a fit, and one to
    /// leave out.
    pub const LEAST_POINTS: usize = least_squares::FEWEST + 1;

    /// Number of points farther from the surface than this.
    pub(crate) fn farther_than(&self, distance_m: f64) -> usize {
        let far = self.distances_m.iter().filter(|d| **d > distance_m);
        far.count()
    }

    /// Scales the reported forces to those of a field that is so many times as large.
    pub(super) fn scale(&mut self, amplitude: f64) {
        let sums = self.given_n.iter_mut().chain([&mut self.applied_n]);
        let components = sums.flatten().flatten();
        for component in components.chain(&mut self.sum_error_n) {
            *component *= amplitude;
        }
    }
}

/// Nodes of a body and the forces on them.
pub(super) type NodalForces = Vec<(u32, [f64; 3])>;

/// Facets of a surface: nodes of a body, and their positions.
pub(super) struct Facets {
    nodes: Vec<Vec<u32>>,
    coords_m: Vec<Vec<[f64; 3]>>,
}

impl Facets {
    pub(crate) fn new(nodes: Vec<Vec<u32>>, position_m: impl Fn(u32) -> [f64; 3]) -> Self {
        let coords = |facet: &Vec<u32>| facet.iter().map(|&n| position_m(n)).collect();
        Self {
            coords_m: nodes.iter().map(coords).collect(),
            nodes,
        }
    }

    /// Length of the longest edge of a facet.
    fn length_m(&self, facet: usize) -> f64 {
        let corners = &self.coords_m[facet][..facet_corners(self.coords_m[facet].len())];
        let next = corners.iter().cycle().skip(1);
        let edges = corners.iter().zip(next).map(|(a, b)| distance(*a, *b));
        edges.fold(0.0, f64::max)
    }

    /// Centroid of the area, m.
    fn centroid_m(&self) -> [f64; 3] {
        let (mut sum, mut area) = ([0.0; 3], 0.0);
        for coords in &self.coords_m {
            for (point, weight) in facet::points(coords) {
                let part = weight * norm(point.normal_m2);
                area += part;
                add_scaled(&mut sum, part, point.position_m);
            }
        }
        scaled(sum, 1.0 / area)
    }
}

/// Real and imaginary part of a field as forces on the nodes of a surface, and the report of the
/// mapping. Every node of the surface has one force in each part.
pub(super) fn map(field: &SurfaceField, facets: &Facets) -> ([NodalForces; 2], FieldMap) {
    let feet = feet(&field.points_m, facets);
    let mut forces = Forces::none(facets);
    let mut map = FieldMap {
        points: feet.len(),
        largest_distance_m: feet.iter().map(|f| f.distance_m).fold(0.0, f64::max),
        rms_distance_m: rms(feet.iter().map(|f| f.distance_m)),
        far_points: feet
            .iter()
            .filter(|f| f.distance_m > facets.length_m(f.facet))
            .count(),
        facets: facets.nodes.len(),
        distances_m: feet.iter().map(|f| f.distance_m).collect(),
        ..FieldMap::default()
    };
    match sample_field(field, &feet) {
        SampledField::Forces(given) => {
            for (foot, force) in feet.iter().zip(given.iter()) {
                forces.add(&facets.nodes[foot.facet], &foot.point.shapes, *force);
            }
            map.given_n = Some(sum(given.iter().copied()));
            map.moment_error = Some(moment_error(&field.points_m, &given, facets, &forces));
        }
        SampledField::Pressures(pressures_pa) => {
            let tree = PointTree::new(&field.points_m);
            add_pressures(&field.points_m, pressures_pa, &tree, facets, &mut forces);
            map.interpolation_error = interpolation_error(&field.points_m, pressures_pa, &tree);
            map.sum_error_n = sum_error_n(&field.points_m, pressures_pa, facets, &forces);
            map.empty_facets = empty_facets(&field.points_m, &tree, facets);
        }
    }
    map.applied_n = sum(forces.on_node.iter().copied());
    (forces.parts(), map)
}

/// Number of points that are farther from the box around a surface than `limit_m`, and the distance
/// of the farthest of them from the surface, m; `None` if all are nearer. The feet of far points are
/// not searched, because that is slow.
pub(super) fn farthest_outlier(
    points_m: &[[f64; 3]],
    facets: &Facets,
    limit_m: f64,
) -> Option<(usize, f64)> {
    let mut ends = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for x in facets.coords_m.iter().flatten() {
        ends[0] = [0, 1, 2].map(|k| ends[0][k].min(x[k]));
        ends[1] = [0, 1, 2].map(|k| ends[1][k].max(x[k]));
    }
    let from_box =
        |p: &[f64; 3]| norm([0, 1, 2].map(|k| p[k] - p[k].clamp(ends[0][k], ends[1][k])));
    let distances = points_m.iter().map(|p| (from_box(p), *p));
    let far: Vec<(f64, [f64; 3])> = distances.filter(|(d, _)| *d > limit_m).collect();
    let (_, farthest) = far.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (_, foot) = FacetTree::new(&facets.coords_m).nearest(*farthest)?;
    Some((far.len(), distance(foot.position_m, *farthest)))
}

/// Point of the surface that is nearest to a given point.
struct Foot {
    facet: usize,
    point: FacetPoint,
    distance_m: f64,
}

fn feet(points_m: &[[f64; 3]], facets: &Facets) -> Vec<Foot> {
    let tree = FacetTree::new(&facets.coords_m);
    let foot = |p: &[f64; 3]| {
        let (facet, point) = tree.nearest(*p).expect("a surface has facets");
        let distance_m = distance(point.position_m, *p);
        Foot {
            facet,
            point,
            distance_m,
        }
    };
    points_m.par_iter().map(foot).collect()
}

/// Values of a field at its points.
enum SampledField<'a> {
    /// Forces, including those of pressures with areas.
    Forces(Cow<'a, [[[f64; 3]; 2]]>),
    /// Pressures without areas.
    Pressures(&'a [[f64; 2]]),
}

fn sample_field<'a>(field: &'a SurfaceField, feet: &[Foot]) -> SampledField<'a> {
    match &field.values {
        FieldValues::Forces(forces) => SampledField::Forces(forces.into()),
        FieldValues::Pressures {
            pressures_pa,
            areas_m2: Some(areas_m2),
        } => {
            let force = |((foot, p), area): ((&Foot, &[f64; 2]), &f64)| {
                let normal = unit(foot.point.normal_m2).unwrap_or_default();
                p.map(|p| scaled(normal, -p * area))
            };
            let all = feet.iter().zip(pressures_pa).zip(areas_m2).map(force);
            SampledField::Forces(all.collect())
        }
        FieldValues::Pressures {
            pressures_pa,
            areas_m2: None,
        } => SampledField::Pressures(pressures_pa),
        // No load: an excitation of such a field is refused before.
        FieldValues::Friction(_) => SampledField::Forces(Cow::Owned(Vec::new())),
    }
}

/// Adds the forces of a field of pressures.
fn add_pressures(
    points_m: &[[f64; 3]],
    pressures_pa: &[[f64; 2]],
    tree: &PointTree,
    facets: &Facets,
    forces: &mut Forces,
) {
    let on_facet = |coords: &Vec<[f64; 3]>| -> Vec<(Vec<f64>, [[f64; 3]; 2])> {
        let point = |(point, weight): (FacetPoint, f64)| {
            let shares = least_squares::shares(points_m, tree, point.position_m, None);
            let p = pressure(&shares, pressures_pa);
            let force = p.map(|p| scaled(point.normal_m2, -weight * p));
            (point.shapes, force)
        };
        facet::points(coords).map(point).collect()
    };
    let all: Vec<_> = facets.coords_m.par_iter().map(on_facet).collect();
    for (nodes, points) in facets.nodes.iter().zip(&all) {
        for (shapes, force) in points {
            forces.add(nodes, shapes, *force);
        }
    }
}

fn pressure(shares: &[(usize, f64)], pressures_pa: &[[f64; 2]]) -> [f64; 2] {
    let part = |part: usize| shares.iter().map(|(i, s)| s * pressures_pa[*i][part]).sum();
    [part(0), part(1)]
}

fn interpolation_error(
    points_m: &[[f64; 3]],
    pressures_pa: &[[f64; 2]],
    tree: &PointTree,
) -> Option<f64> {
    if points_m.len() < FieldMap::LEAST_POINTS {
        return None;
    }
    let size = rms(pressures_pa.iter().map(|p| p[0].hypot(p[1])));
    let miss = |i: usize| {
        let shares = least_squares::shares(points_m, tree, points_m[i], Some(i));
        let [re, im] = pressure(&shares, pressures_pa);
        (re - pressures_pa[i][0]).hypot(im - pressures_pa[i][1])
    };
    let misses: Vec<f64> = (0..points_m.len()).into_par_iter().map(miss).collect();
    Some(if size > 0.0 {
        rms(misses.into_iter()) / size
    } else {
        0.0
    })
}

/// Difference of the sum of the forces from those of two halves of the points, whatever their
/// order: the half of a point is a hash of its number (Steele, Lea, Flood, OOPSLA 2014, 453-472).
fn sum_error_n(
    points_m: &[[f64; 3]],
    pressures_pa: &[[f64; 2]],
    facets: &Facets,
    forces: &Forces,
) -> Option<f64> {
    if points_m.len() < 2 {
        return None;
    }
    let whole = sum(forces.on_node.iter().copied());
    let scattered = |i: &usize| {
        let z = (*i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    let mut order: Vec<usize> = (0..points_m.len()).collect();
    order.sort_by_cached_key(scattered);
    let (first, second) = order.split_at(order.len() / 2);
    let differences = [first, second].map(|half| {
        let points: Vec<_> = half.iter().map(|i| points_m[*i]).collect();
        let pressures: Vec<_> = half.iter().map(|i| pressures_pa[*i]).collect();
        let tree = PointTree::new(&points);
        let mut half = Forces::none(facets);
        add_pressures(&points, &pressures, &tree, facets, &mut half);
        let half = sum(half.on_node.iter().copied());
        let [re, im] = [0, 1].map(|part| distance(whole[part], half[part]));
        re.hypot(im)
    });
    Some(differences[0].max(differences[1]))
}

/// Number of facets whose middle is farther from the nearest point than the facet is long, and than
/// twice the spacing of the points there.
fn empty_facets(points_m: &[[f64; 3]], tree: &PointTree, facets: &Facets) -> usize {
    let is_empty = |facet: &usize| {
        let coords = &facets.coords_m[*facet];
        let middle = match facet_corners(coords.len()) {
            3 => [1.0 / 3.0; 2],
            _ => [0.0; 2],
        };
        let middle = facet::evaluate(coords, middle).position_m;
        let Some((nearest, square)) = tree.nearest(middle).next() else {
            return true;
        };
        let others = tree.nearest(points_m[nearest]).take(5);
        let spacing = others.map(|(_, square)| square).fold(0.0, f64::max).sqrt();
        square.sqrt() > (2.0 * spacing).max(facets.length_m(*facet))
    };
    let all = (0..facets.nodes.len()).into_par_iter();
    all.filter(is_empty).count()
}

fn moment_error(
    points_m: &[[f64; 3]],
    given: &[[[f64; 3]; 2]],
    facets: &Facets,
    forces: &Forces,
) -> f64 {
    let centre = facets.centroid_m();
    let mut position = vec![[0.0; 3]; forces.on_node.len()];
    for (nodes, coords) in facets.nodes.iter().zip(&facets.coords_m) {
        for (node, x) in nodes.iter().zip(coords) {
            position[forces.index(*node)] = *x;
        }
    }
    let moment = |at: &[f64; 3], force: &[[f64; 3]; 2]| force.map(|f| cross(sub(*at, centre), f));
    let of_points = points_m.iter().zip(given).map(|(x, f)| moment(x, f));
    let of_nodes = position.iter().zip(&forces.on_node);
    let of_nodes = of_nodes.map(|(x, f)| moment(x, f));
    let [given_moment, applied_moment] = [sum(of_points), sum(of_nodes)];
    let lever = |(x, force): (&[f64; 3], &[[f64; 3]; 2])| {
        let length = dot(force[0], force[0]) + dot(force[1], force[1]);
        distance(*x, centre) * length.sqrt()
    };
    let scale: f64 = points_m.iter().zip(given).map(lever).sum();
    let [re, im] = [0, 1].map(|part| distance(given_moment[part], applied_moment[part]));
    if scale > 0.0 {
        re.hypot(im) / scale
    } else {
        0.0
    }
}

fn sum(vectors: impl Iterator<Item = [[f64; 3]; 2]>) -> [[f64; 3]; 2] {
    let mut sum = [[0.0; 3]; 2];
    for vector in vectors {
        for (sum, part) in sum.iter_mut().zip(vector) {
            add_scaled(sum, 1.0, part);
        }
    }
    sum
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|v| v * v).sum::<f64>() / count).sqrt()
}

/// Complex forces on the nodes of a surface.
struct Forces {
    /// Nodes of the surface, ascending.
    nodes: Vec<u32>,
    on_node: Vec<[[f64; 3]; 2]>,
}

impl Forces {
    fn none(facets: &Facets) -> Self {
        let mut nodes = facets.nodes.concat();
        nodes.sort_unstable();
        nodes.dedup();
        Self {
            on_node: vec![[[0.0; 3]; 2]; nodes.len()],
            nodes,
        }
    }

    fn index(&self, node: u32) -> usize {
        self.nodes.partition_point(|n| *n < node)
    }

    fn add(&mut self, nodes: &[u32], shapes: &[f64], force: [[f64; 3]; 2]) {
        for (node, share) in nodes.iter().zip(shapes) {
            let index = self.index(*node);
            for (sum, part) in self.on_node[index].iter_mut().zip(force) {
                add_scaled(sum, *share, part);
            }
        }
    }

    fn parts(&self) -> [NodalForces; 2] {
        let part = |part: usize| {
            let all = self.nodes.iter().zip(&self.on_node);
            all.map(|(node, force)| (*node, force[part])).collect()
        };
        [part(0), part(1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_mesh::facet::shares;
    use proptest::prelude::*;

    /// A sheet of six-node triangles over the square from 0 to 1, `cells` squares wide.
    fn sheet(cells: usize, place: impl Fn([f64; 2]) -> [f64; 3]) -> Facets {
        let n = 2 * cells + 1;
        let at = |i: usize, j: usize| (i * n + j) as u32;
        let mut nodes = Vec::new();
        for i in (0..n - 1).step_by(2) {
            for j in (0..n - 1).step_by(2) {
                for [a, b, c] in [[[0, 0], [2, 0], [2, 2]], [[0, 0], [2, 2], [0, 2]]] {
                    let node = |p: [usize; 2]| at(i + p[0], j + p[1]);
                    let half =
                        |p: [usize; 2], q: [usize; 2]| node([(p[0] + q[0]) / 2, (p[1] + q[1]) / 2]);
                    nodes.push(vec![
                        node(a),
                        node(b),
                        node(c),
                        half(a, b),
                        half(b, c),
                        half(c, a),
                    ]);
                }
            }
        }
        let step = 1.0 / (n - 1) as f64;
        Facets::new(nodes, |k| {
            let k = k as usize;
            place([(k / n) as f64 * step, (k % n) as f64 * step])
        })
    }

    fn flat([x, y]: [f64; 2]) -> [f64; 3] {
        [x, y, 0.0]
    }

    /// A quarter of a cylinder of radius 1.
    fn bent([x, y]: [f64; 2]) -> [f64; 3] {
        let (s, c) = (1.5 * x).sin_cos();
        [s, y, c]
    }

    fn scattered(count: usize, place: impl Fn([f64; 2]) -> [f64; 3]) -> Vec<[f64; 3]> {
        // Halton's points: even, and on no grid.
        let radical = |mut i: usize, base: usize| {
            let (mut value, mut part) = (0.0, 1.0);
            while i > 0 {
                part /= base as f64;
                value += part * (i % base) as f64;
                i /= base;
            }
            value
        };
        (1..=count)
            .map(|i| place([radical(i, 2), radical(i, 3)]))
            .collect()
    }

    fn pressure_field(points_m: Vec<[f64; 3]>, p: impl Fn([f64; 3]) -> [f64; 2]) -> SurfaceField {
        let pressures_pa = points_m.iter().map(|x| p(*x)).collect();
        SurfaceField {
            points_m,
            values: FieldValues::Pressures {
                pressures_pa,
                areas_m2: None,
            },
        }
    }

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() < tolerance, "{a} {b}");
    }

    /// With p = a + b x + c y the force is -int p dA, and the moments of the nodal forces are those
    /// of the pressure, -int y p dA and int x p dA: x and y are in the span of the shape functions.
    #[test]
    fn a_linear_pressure_has_its_exact_force_and_moment() {
        let facets = sheet(3, flat);
        let (a, b, c) = (2.0, -3.0, 0.7);
        let linear = |x: [f64; 3]| [a + b * x[0] + c * x[1], 5.0 * x[0]];
        let field = pressure_field(scattered(150, flat), linear);
        let ([re, im], map) = super::map(&field, &facets);
        close(map.applied_n[0][2], -(a + b / 2.0 + c / 2.0), 1e-12);
        close(map.applied_n[1][2], -2.5, 1e-12);
        let position = |node: u32| {
            let of = |(nodes, coords): (&Vec<u32>, &Vec<[f64; 3]>)| {
                nodes.iter().position(|n| *n == node).map(|i| coords[i])
            };
            facets
                .nodes
                .iter()
                .zip(&facets.coords_m)
                .find_map(of)
                .unwrap()
        };
        let first = |forces: &NodalForces, k: usize| -> f64 {
            forces.iter().map(|(n, f)| position(*n)[k] * f[2]).sum()
        };
        close(first(&re, 0), -(a / 2.0 + b / 3.0 + c / 4.0), 1e-12);
        close(first(&re, 1), -(a / 2.0 + b / 4.0 + c / 3.0), 1e-12);
        close(first(&im, 0), -5.0 / 3.0, 1e-12);
        assert!(map.interpolation_error.unwrap() < 1e-12);
        assert!(map.sum_error_n.unwrap() < 1e-12);
        assert_eq!(
            (map.far_points, map.empty_facets, map.given_n),
            (0, 0, None)
        );
    }

    #[test]
    fn the_same_pressure_everywhere_is_that_pressure_on_a_curved_surface_too() {
        let facets = sheet(4, bent);
        let field = pressure_field(scattered(200, bent), |_| [3.0, -1.0]);
        let (parts, _) = super::map(&field, &facets);
        let mut expected = Forces::none(&facets);
        for (nodes, coords) in facets.nodes.iter().zip(&facets.coords_m) {
            for (node, share) in nodes.iter().zip(shares(coords)) {
                let force = [3.0, -1.0].map(|p| scaled(share.normal_m2, -p));
                expected.add(&[*node], &[1.0], force);
            }
        }
        for (part, expected) in parts.iter().zip(expected.parts()) {
            for ((node, force), (same, other)) in part.iter().zip(&expected) {
                assert!(node == same && distance(*force, *other) < 1e-14);
            }
        }
    }

    /// A field that is not linear, on a curved surface: refined points lead to its integral, and
    /// the estimated error falls with them as the square of their spacing.
    #[test]
    fn a_smooth_pressure_comes_nearer_with_more_points() {
        let facets = sheet(6, bent);
        let wave = |x: [f64; 3]| [(3.0 * x[0] + 2.0 * x[1]).sin(), 0.0];
        let exact = map_of(&facets, wave);
        let miss = |count: usize| {
            let (_, map) = super::map(&pressure_field(scattered(count, bent), wave), &facets);
            (
                distance(map.applied_n[0], exact),
                map.interpolation_error.unwrap(),
            )
        };
        let (coarse, fine) = (miss(100), miss(1600));
        assert!(fine.0 < coarse.0 / 6.0, "{coarse:?} {fine:?}");
        assert!(
            fine.1 < coarse.1 / 6.0 && fine.1 < 0.02,
            "{coarse:?} {fine:?}"
        );
    }

    /// Waves that are as short as the points are apart, or shorter: the estimate is no less than
    /// the error.
    #[test]
    fn points_too_coarse_for_the_pressure_say_so() {
        let facets = sheet(20, flat);
        let (mut told, mut worst) = (0, 0.0f64);
        for wave_number in [15.0, 30.0, 60.0] {
            for count in [4, 9, 13, 25, 60] {
                let wave = |x: [f64; 3]| {
                    let phase = wave_number * (x[0] + 0.6 * x[1]);
                    [1.0 + 20.0 * phase.sin(), 0.0]
                };
                let exact = map_of(&facets, wave);
                let (_, map) = super::map(&pressure_field(scattered(count, flat), wave), &facets);
                let error = distance(map.applied_n[0], exact);
                let said = map.sum_error_n.unwrap();
                let is_few = map.interpolation_error.is_none();
                assert_eq!(is_few, count < 13, "{map:?}");
                assert!(is_few || map.interpolation_error.unwrap() > 0.3, "{map:?}");
                println!("{wave_number} {count}: {error:.3} of {said:.3} N");
                told += usize::from(said > 0.3 * norm(exact));
                worst = worst.max(error / said);
            }
        }
        assert!(told == 15 && worst < 3.0, "{told} {worst}");
    }

    /// -int p n dA with p taken at the points of quadrature.
    fn map_of(facets: &Facets, p: impl Fn([f64; 3]) -> [f64; 2]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for coords in &facets.coords_m {
            for (point, weight) in facet::points(coords) {
                let force_n = -weight * p(point.position_m)[0];
                add_scaled(&mut sum, force_n, point.normal_m2);
            }
        }
        sum
    }

    proptest! {
        /// Forces on the surface keep their sum and their moment; forces beside it keep their sum.
        #[test]
        fn forces_keep_their_sum_and_moment(
            at in prop::collection::vec((prop::array::uniform2(0.0..1.0), prop::array::uniform6(-5.0..5.0)), 1..30),
            lift in -0.2..0.2,
        ) {
            let facets = sheet(2, flat);
            let mut field = SurfaceField {
                points_m: at.iter().map(|(p, _)| flat(*p)).collect(),
                values: FieldValues::Forces(
                    at.iter().map(|(_, f)| [[f[0], f[1], f[2]], [f[3], f[4], f[5]]]).collect(),
                ),
            };
            let (_, map) = super::map(&field, &facets);
            let given = map.given_n.unwrap();
            for (given, applied) in given.iter().zip(&map.applied_n) {
                prop_assert!(distance(*given, *applied) < 1e-12);
            }
            prop_assert!(map.moment_error.unwrap() < 1e-12 && map.largest_distance_m < 1e-12);
            field.points_m.iter_mut().for_each(|x| x[2] = lift);
            let (_, map) = super::map(&field, &facets);
            prop_assert!(distance(given[0], map.applied_n[0]) < 1e-12);
            prop_assert!((map.largest_distance_m - f64::abs(lift)).abs() < 1e-12);
            prop_assert!((map.rms_distance_m - f64::abs(lift)).abs() < 1e-12);
        }
    }

    /// The areas of the cells of a grid, pressed on a cylinder: -int p n dA of the arc in closed
    /// form.
    #[test]
    fn pressures_with_areas_press_along_the_inward_normal() {
        let facets = sheet(8, bent);
        let n = 60;
        let middle = |i: usize| (i as f64 + 0.5) / f64::from(n);
        let cells = (0..n as usize).flat_map(|i| (0..n as usize).map(move |j| [i, j]));
        let points_m: Vec<[f64; 3]> = cells.map(|[i, j]| bent([middle(i), middle(j)])).collect();
        let area = 1.5 / f64::from(n * n);
        let field = SurfaceField {
            values: FieldValues::Pressures {
                pressures_pa: vec![[2.0, 0.0]; points_m.len()],
                areas_m2: Some(vec![area; points_m.len()]),
            },
            points_m,
        };
        let (_, map) = super::map(&field, &facets);
        // The order of the nodes says which of the two normals is outward.
        let outward = facet::evaluate(&facets.coords_m[0], [0.3; 2]).normal_m2[2].signum();
        let (s, c) = 1.5f64.sin_cos();
        let expected = [1.0 - c, 0.0, s].map(|f| -2.0 * outward * f);
        assert!(
            distance(map.applied_n[0], expected) < 2e-3,
            "{map:?} {expected:?}"
        );
        assert!(distance(map.applied_n[0], map.given_n.unwrap()[0]) < 1e-12);
        assert!(map.moment_error.unwrap() < 1e-3);
    }

    #[test]
    fn points_far_from_the_surface_and_facets_without_points_are_counted() {
        let facets = sheet(4, flat);
        let mut points = scattered(200, |[x, y]| [0.3 * x, y, 0.0]);
        let near = pressure_field(points.clone(), |_| [1.0, 0.0]);
        let (_, map) = super::map(&near, &facets);
        assert_eq!(map.far_points, 0);
        assert!((8..=16).contains(&map.empty_facets), "{map:?}");
        points[3][2] = 0.6;
        points[7][2] = -7.0;
        assert_eq!(farthest_outlier(&points, &facets, 8.0), None);
        assert_eq!(farthest_outlier(&points, &facets, 1.0), Some((1, 7.0)));
        assert_eq!(
            farthest_outlier(&points, &facets, 0.5).map(|far| far.0),
            Some(2)
        );
        let (_, map) = super::map(&pressure_field(points, |_| [1.0, 0.0]), &facets);
        assert_eq!((map.far_points, map.farther_than(1.0)), (2, 1));
        assert!((map.largest_distance_m - 7.0).abs() < 1e-12);
    }
}
