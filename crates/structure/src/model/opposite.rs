//! Facets of two surfaces that lie opposite each other, and their common parts.

use std::collections::HashMap;

use dovetail_mesh::element::facet_corners;
use dovetail_mesh::interpolation::facet_functions;
use dovetail_mesh::quadrature::triangle;
use dovetail_numerics::space::{Vector, cross, distance, dot, scaled, sub, unit};

/// Two facets that lie opposite each other and are not in contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Missed {
    pub position_m: Vector,
    /// Distance along the normal of the slave facet, m; negative if the bodies overlap.
    pub apart_m: f64,
    /// Angle between the outward normals, degrees.
    pub degrees: f64,
}

/// A facet is left out if less than this fraction of it is covered: its integrals are then rounding.
const LEAST_FACET: f64 = 1e-6;
/// The common part of two facets is rounding if it is below this fraction of the slave facet.
const LEAST_PART: f64 = 1e-13;
/// Normals of facets that face each other have a smaller cosine than this (120 degrees).
const FACING: f64 = -0.5;
/// Degree of the rule on a part of a facet: exact for triangles and parallelograms.
const DEGREE: usize = 6;
/// Number of times that the triangles of a part are cut into four where shape functions are not
/// polynomials.
const CUTS: usize = 2;

/// Facets of a slave surface and of a master surface that lie opposite each other.
pub(super) struct Opposite {
    /// For each slave facet, the master facets opposite it with the common parts.
    pub parts: Vec<Vec<(usize, Polygon)>>,
    /// For each slave facet, and for each master facet, true if it faces the other surface.
    pub met: [Vec<bool>; 2],
    /// Fractions of the slave surface's area, and of the master surface's, that lie opposite the
    /// other one.
    pub covered: [f64; 2],
    /// Nearest pair of facets that lie opposite each other but do not face each other, or are too
    /// far apart.
    pub missed: Option<Missed>,
}

/// Finds the facets that lie opposite each other. `reach` is their largest distance along the
/// normal.
pub(super) fn opposite([slaves, masters]: [&[Facet]; 2], reach: Reach) -> Opposite {
    let cells = Cells::new(masters, slaves, reach);
    let mut result = Opposite {
        parts: Vec::with_capacity(slaves.len()),
        met: [vec![false; slaves.len()], vec![false; masters.len()]],
        covered: [0.0; 2],
        missed: None,
    };
    let mut common_m2 = [0.0; 2];
    for (e, facet) in slaves.iter().enumerate() {
        let mut parts = Vec::new();
        let mut covered_m2 = 0.0;
        for &m in &cells.nearby_facets(facet) {
            let opposite = facet.part_opposite(&masters[m], reach, &mut result.missed);
            if let Some(polygon) = opposite {
                covered_m2 += area(&polygon);
                parts.push((m, polygon));
            }
        }
        if covered_m2 < LEAST_FACET * facet.area_m2() {
            parts.clear();
        }
        for (m, part) in &parts {
            result.met[0][e] = true;
            result.met[1][*m] = true;
            // The part is in the plane of the slave facet.
            let tilt = dot(facet.normal, masters[*m].normal).abs();
            common_m2[0] += area(part);
            common_m2[1] += area(part) / tilt;
        }
        result.parts.push(parts);
    }
    let whole = [slaves, masters].map(|facets| facets.iter().map(Facet::area_m2).sum::<f64>());
    // Facets of a hollow surface overlap where they are projected to each other's planes.
    result.covered = [0, 1].map(|k| (common_m2[k] / whole[k]).min(1.0));
    result
}

/// Largest distance of facets that are in contact.
#[derive(Debug, Clone, Copy)]
pub(super) enum Reach {
    /// Distance in metres.
    Given(f64),
    /// Multiple of the longer of their longest edges.
    OfFacets(f64),
}

impl Reach {
    fn distance_m(self, longest_m: f64) -> f64 {
        match self {
            Self::Given(reach) => reach,
            Self::OfFacets(share) => share * longest_m,
        }
    }
}

/// Facet of 3, 4, 6 or 8 nodes, seen as the plane facet between its corners.
pub(super) struct Facet {
    /// Corners, then the middles of the edges.
    nodes_m: Vec<Vector>,
    corners: usize,
    centre_m: Vector,
    /// Unit normal, out of the body.
    pub normal: Vector,
    /// Two axes across the normal.
    axes: [Vector; 2],
    longest_m: f64,
    /// Distance from the centre to the farthest corner, m.
    radius_m: f64,
}

/// Points in the plane of a slave facet.
pub(super) type Polygon = Vec<[f64; 2]>;

impl Facet {
    /// Facet of nodes that run counter-clockwise seen from outside: the corners, then the middles of
    /// the edges.
    pub(crate) fn new(nodes_m: Vec<Vector>) -> Self {
        let corners_m = &nodes_m[..facet_corners(nodes_m.len())];
        let count = corners_m.len() as f64;
        let centre_m = [0, 1, 2].map(|k| corners_m.iter().map(|x| x[k]).sum::<f64>() / count);
        let last = corners_m.len() - 1;
        // The diagonals of a quadrilateral, or two edges of a triangle.
        let across = match last {
            3 => [
                sub(corners_m[2], corners_m[0]),
                sub(corners_m[3], corners_m[1]),
            ],
            _ => [
                sub(corners_m[1], corners_m[0]),
                sub(corners_m[2], corners_m[0]),
            ],
        };
        // Facets have area: the flank was checked.
        let normal = unit(cross(across[0], across[1])).unwrap_or([0.0, 0.0, 1.0]);
        let in_plane = sub(across[0], scaled(normal, dot(across[0], normal)));
        let first = unit(in_plane).unwrap_or([1.0, 0.0, 0.0]);
        let edge = |i: usize| distance(corners_m[i], corners_m[if i == last { 0 } else { i + 1 }]);
        let longest_m = (0..=last).map(edge).fold(0.0, f64::max);
        let radius = |x: &Vector| distance(*x, centre_m);
        let radius_m = corners_m.iter().map(radius).fold(0.0, f64::max);
        Self {
            centre_m,
            normal,
            axes: [first, cross(normal, first)],
            longest_m,
            radius_m,
            corners: corners_m.len(),
            nodes_m,
        }
    }

    /// Coordinates of a point in the plane of the facet.
    pub(crate) fn plane_coordinates(&self, x: Vector) -> [f64; 2] {
        let d = sub(x, self.centre_m);
        self.axes.map(|axis| dot(axis, d))
    }

    /// Point of space at coordinates in the plane of the facet, m.
    pub(crate) fn space_point(&self, point: [f64; 2]) -> Vector {
        let [a, b] = self.axes;
        [0, 1, 2].map(|k| self.centre_m[k] + point[0] * a[k] + point[1] * b[k])
    }

    /// Corners of a facet, projected to the plane of this one along its normal.
    pub(crate) fn outline_of(&self, facet: &Self) -> Polygon {
        let corners = &facet.nodes_m[..facet.corners];
        corners.iter().map(|x| self.plane_coordinates(*x)).collect()
    }

    /// All nodes of a facet, projected to the plane of this one along its normal.
    pub(crate) fn nodes_of(&self, facet: &Self) -> Polygon {
        facet
            .nodes_m
            .iter()
            .map(|x| self.plane_coordinates(*x))
            .collect()
    }

    /// Area between the corners, m2.
    pub(crate) fn area_m2(&self) -> f64 {
        area(&self.outline_of(self))
    }

    /// Part of this facet opposite a master facet; without such a part, the reason is written to
    /// `missed`.
    fn part_opposite(
        &self,
        master: &Self,
        reach: Reach,
        missed: &mut Option<Missed>,
    ) -> Option<Polygon> {
        let cosine = dot(self.normal, master.normal);
        let mut outline = self.outline_of(master);
        if cosine < 0.0 {
            outline.reverse();
        }
        let own_outline = self.outline_of(self);
        let part = clipped(own_outline.clone(), &outline);
        if area(&part) < LEAST_PART * area(&own_outline) {
            return None;
        }
        // Between the planes of both, at the middle of the part.
        let count = part.len() as f64;
        let middle = [0, 1].map(|k| part.iter().map(|p| p[k]).sum::<f64>() / count);
        let on_own = self.space_point(middle);
        let apart_m = dot(sub(master.centre_m, on_own), master.normal) / cosine;
        let distance_m = apart_m.abs();
        let too_far = distance_m > reach.distance_m(self.longest_m.max(master.longest_m));
        if too_far || cosine > FACING {
            let is_nearest = missed.is_none_or(|m| distance_m < m.apart_m.abs());
            if is_nearest && distance_m.is_finite() {
                *missed = Some(Missed {
                    position_m: on_own,
                    apart_m,
                    degrees: cosine.clamp(-1.0, 1.0).acos().to_degrees(),
                });
            }
            return None;
        }
        Some(part)
    }
}

/// Points and weights of a rule on a convex part of two facets, whose nodes are given in the plane of
/// the part.
pub(super) fn points_in(
    part: &Polygon,
    [own, other]: [&Polygon; 2],
) -> impl Iterator<Item = ([f64; 2], f64)> {
    let sides = part[1..].windows(2);
    let mut triangles: Vec<[[f64; 2]; 3]> = sides.map(|s| [part[0], s[0], s[1]]).collect();
    if !is_affine(own) || !is_affine(other) {
        for _ in 0..CUTS {
            triangles = triangles.into_iter().flat_map(quarters).collect();
        }
    }
    let rule = triangle(DEGREE);
    triangles.into_iter().flat_map(move |[a, b, c]| {
        let twice = area_of([a, b, c]) * 2.0;
        let at = move |([r, s], w): ([f64; 2], f64)| {
            let point = [0, 1].map(|k| a[k] + r * (b[k] - a[k]) + s * (c[k] - a[k]));
            (point, twice * w)
        };
        rule.clone().into_iter().map(at)
    })
}

fn quarters([a, b, c]: [[f64; 2]; 3]) -> [[[f64; 2]; 3]; 4] {
    let middle = |p: [f64; 2], q: [f64; 2]| [0, 1].map(|k| 0.5 * (p[k] + q[k]));
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// Returns `true` if the shape functions of a facet are polynomials in its plane: its corners are
/// the corners of a triangle or a parallelogram, and its middle nodes are half way between them.
fn is_affine(nodes: &Polygon) -> bool {
    const ROUNDING: f64 = 1e-10;
    let (corners, middles) = nodes.split_at(facet_corners(nodes.len()));
    let length = |v: [f64; 2]| v[0].hypot(v[1]);
    let [a, c] = [corners[0], corners[2]];
    let long = length([0, 1].map(|k| c[k] - a[k]));
    let is_small = |v: [f64; 2]| length(v) < ROUNDING * long;
    let next = corners.iter().cycle().skip(1);
    let mut edges = corners.iter().zip(next).zip(middles);
    let is_parallelogram = match corners {
        [a, b, c, d] => is_small([0, 1].map(|k| a[k] - b[k] + c[k] - d[k])),
        _ => true,
    };
    is_parallelogram
        && edges.all(|((p, q), middle)| is_small([0, 1].map(|k| middle[k] - 0.5 * (p[k] + q[k]))))
}

/// Shape functions of the nodes of a facet at a point of the plane that they are given in.
pub(super) fn values(nodes: &Polygon, point: [f64; 2]) -> Vec<f64> {
    let functions = facet_functions(nodes.len(), reference(nodes, point));
    functions.iter().map(|f| f.value).collect()
}

/// Reference coordinates of a point of the plane that the nodes of a facet are given in, by Newton's
/// method, which needs one step for a triangle with straight edges.
pub(super) fn reference(nodes: &Polygon, point: [f64; 2]) -> [f64; 2] {
    const MOST_STEPS: usize = 30;
    let mut local = [0.0; 2];
    for _ in 0..MOST_STEPS {
        let functions = facet_functions(nodes.len(), local);
        let sum = |of: &dyn Fn(usize) -> f64, k: usize| -> f64 {
            (0..nodes.len()).map(|i| of(i) * nodes[i][k]).sum()
        };
        let off = [0, 1].map(|k| point[k] - sum(&|i| functions[i].value, k));
        let [[a, b], [c, d]] =
            [0, 1].map(|k| [0, 1].map(|j| sum(&|i| functions[i].gradient[j], k)));
        let determinant = a * d - b * c;
        let step = [
            (d * off[0] - b * off[1]) / determinant,
            (a * off[1] - c * off[0]) / determinant,
        ];
        local = [local[0] + step[0], local[1] + step[1]];
        let is_small = step.iter().all(|s| s.abs() < 1e-14);
        if is_small || nodes.len() == 3 || !step.iter().all(|s| s.is_finite()) {
            break;
        }
    }
    local
}

fn area_of([a, b, c]: [[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}

/// Area of a polygon whose corners run counter-clockwise.
fn area(polygon: &Polygon) -> f64 {
    let sides = polygon.get(1..).unwrap_or_default().windows(2);
    sides
        .map(|side| area_of([polygon[0], side[0], side[1]]))
        .sum()
}

/// Part of a convex polygon inside another one, both counter-clockwise (Sutherland and
/// Hodgman).
fn clipped(mut polygon: Polygon, by: &Polygon) -> Polygon {
    for (i, &from) in by.iter().enumerate() {
        let to = by[(i + 1) % by.len()];
        let inside = |p: [f64; 2]| area_of([from, to, p]);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (j, &p) in polygon.iter().enumerate() {
            let next = polygon[(j + 1) % polygon.len()];
            let (at_p, at_next) = (inside(p), inside(next));
            if at_p >= 0.0 {
                kept.push(p);
            }
            if (at_p > 0.0 && at_next < 0.0) || (at_p < 0.0 && at_next > 0.0) {
                let t = at_p / (at_p - at_next);
                kept.push([0, 1].map(|k| p[k] + t * (next[k] - p[k])));
            }
        }
        polygon = kept;
    }
    polygon
}

/// Master facets by the positions of their middles.
struct Cells {
    width_m: f64,
    of: HashMap<[i64; 3], Vec<usize>>,
}

impl Cells {
    /// Cells as wide as the largest distance between the middles of two facets that lie opposite
    /// each other.
    fn new(masters: &[Facet], slaves: &[Facet], reach: Reach) -> Self {
        let largest = |of: fn(&Facet) -> f64| {
            let both = [masters, slaves].map(|f| f.iter().map(of).fold(0.0, f64::max));
            (both[0] + both[1], both[0].max(both[1]))
        };
        let far = masters.iter().flat_map(|f| f.centre_m);
        let far = far.fold(0.0, |m: f64, x| m.max(x.abs()));
        // Cells are numbered by i64: no finer than 1e-15 of the largest coordinate.
        let width = largest(|f| f.radius_m).0 + reach.distance_m(largest(|f| f.longest_m).1);
        let mut cells = Self {
            width_m: width.max(far * 1e-15).max(f64::MIN_POSITIVE),
            of: HashMap::new(),
        };
        for (m, facet) in masters.iter().enumerate() {
            let cell = cells.cell(facet);
            cells.of.entry(cell).or_default().push(m);
        }
        cells
    }

    fn cell(&self, facet: &Facet) -> [i64; 3] {
        facet.centre_m.map(|x| (x / self.width_m).floor() as i64)
    }

    /// Master facets in the cells around a facet, ascending.
    fn nearby_facets(&self, facet: &Facet) -> Vec<usize> {
        let [x, y, z] = self.cell(facet);
        let near = -1..=1;
        let mut facets = Vec::new();
        for a in near.clone() {
            for b in near.clone() {
                for c in near.clone() {
                    facets.extend(self.of.get(&[x + a, y + b, z + c]).into_iter().flatten());
                }
            }
        }
        facets.sort_unstable();
        facets
    }
}
