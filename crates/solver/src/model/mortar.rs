//! Search for the points of one flank that the nodes of the other meet, where the meshes of both do
//! not match.
//!
//! The nodes of one flank, the slaves, follow those of the other, the masters, by weights of a dual
//! mortar method. With the linear (bilinear) shape functions phi of a slave facet e, on the part of
//! it that lies opposite master facets,
//!
//! ```text
//! psi = D_e M_e^-1 phi      M_e = int phi phi^T     D_e = diag(int phi)
//! D_s = sum int phi_s       W_sk = sum int psi_s phi_k       w_sk = W_sk / D_s
//! ```
//!
//! psi are biorthogonal to phi (Wohlmuth, SIAM J. Numer. Anal. 38 (2000) 989-1012; for contact
//! Popp, Gee, Wall, Int. J. Numer. Meth. Engng 83 (2010) 1428-1465; on partly covered facets
//! Cichosz and Bischoff, Comput. Methods Appl. Mech. Engng 200 (2011) 1317-1332). So each slave
//! node s has a gap of its own, x_s - sum_k w_sk x_k, and an area D_s. The weights of a row sum to
//! 1, and on flat flanks that coincide linear fields are reproduced, both to rounding: all
//! integrals use the same points, and these two identities hold for any rule.

use std::collections::HashMap;

use super::flank::Flank;
use dovetail_mesh::interpolation::of_facet;
use dovetail_mesh::quadrature::triangle;
use dovetail_numerics::dense;
use dovetail_numerics::space::{Vector, cross, distance, dot, scaled, sub, unit};
use faer::Mat;

/// Result of the pairing of two flanks.
pub(super) struct Mortar {
    /// Row of each node of the slave flank; `None` for a node that carries nothing.
    pub rows: Vec<Option<Row>>,
    /// For each slave facet, and for each master facet, true if the other flank lies opposite.
    pub met: [Vec<bool>; 2],
    /// Fractions of the slave flank's area, and of the master flank's, that lie opposite the other
    /// flank.
    pub covered: [f64; 2],
    /// Nearest pair of facets that lie opposite each other but do not face each other, or are too
    /// far apart.
    pub missed: Option<Missed>,
}

/// Area and weights of one slave node.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Area D, m2.
    pub area_m2: f64,
    /// Nodes of the master flank, by their positions in its list, ascending, and their weights.
    pub masters: Vec<(u32, f64)>,
}

/// Two facets that lie opposite each other and are not in contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Missed {
    pub position_m: Vector,
    /// Distance along the normal of the slave facet, m.
    pub distance_m: f64,
    /// Angle between the outward normals, degrees.
    pub degrees: f64,
}

/// A node carries nothing if its covered area is below this fraction of its whole area.
const LEAST_COVERED: f64 = 0.05;
/// A facet is left out if less than this fraction of it is covered: its M is then nearly singular.
const LEAST_FACET: f64 = 1e-6;
/// The common part of two facets is rounding if it is below this fraction of the slave facet.
const LEAST_PART: f64 = 1e-13;
/// Weights below this are rounding, and so is a difference from 1 below it.
const ROUNDING: f64 = 1e-10;
/// Normals of facets that face each other have a smaller cosine than this (120 degrees).
const FACING: f64 = -0.5;
/// Degree of the rule on a part of a facet: exact for triangles and parallelograms.
const DEGREE: usize = 6;
/// Number of times that the triangles of a part are cut into four where shape functions are not
/// polynomials.
const CUTS: usize = 2;

/// Weights of the nodes of the `slave` flank (its positions come first) on the nodes of the
/// `master` flank. `reach` is the largest distance of two facets along the normal.
pub(super) fn mortar(
    [slave, master]: [&Flank; 2],
    [slave_m, master_m]: [&[Vector]; 2],
    reach: Reach,
) -> Mortar {
    let masters: Vec<Facet> = facets(master, master_m);
    let slaves: Vec<Facet> = facets(slave, slave_m);
    let cells = Cells::of(&masters, &slaves, reach);
    let mut found = Mortar {
        rows: vec![None; slave.nodes.len()],
        met: [
            vec![false; slave.facets.len()],
            vec![false; master.facets.len()],
        ],
        covered: [0.0; 2],
        missed: None,
    };
    let mut area = vec![0.0; slave.nodes.len()];
    let mut master_area = 0.0;
    let mut weights: Vec<HashMap<u32, f64>> = vec![HashMap::new(); slave.nodes.len()];
    for (e, facet) in slaves.iter().enumerate() {
        let mut parts = Vec::new();
        for &m in &cells.around(facet) {
            let opposite = facet.part_opposite(&masters[m], reach, &mut found.missed);
            if let Some(polygon) = opposite {
                parts.push((m, polygon));
            }
        }
        let Some(shares) = facet.shares(&parts, &masters) else {
            continue;
        };
        found.met[0][e] = true;
        for (m, part) in &parts {
            found.met[1][*m] = true;
            // The part lies in the plane of the slave facet.
            let tilt = dot(facet.normal, masters[*m].normal).abs();
            master_area += self::area(part) / tilt;
        }
        for ((&s, own_area), own_weights) in slave.facets[e]
            .iter()
            .zip(shares.area_m2)
            .zip(shares.weights)
        {
            area[s as usize] += own_area;
            for ((m, corner), weight) in own_weights {
                let k = master.facets[m][corner];
                *weights[s as usize].entry(k).or_default() += weight;
            }
        }
    }
    let whole = [slave, master].map(|flank| flank.areas_m2.iter().sum::<f64>());
    // Facets of a hollow flank overlap where they are projected to each other's planes.
    found.covered = [
        area.iter().sum::<f64>() / whole[0],
        (master_area / whole[1]).min(1.0),
    ];
    for (s, weights) in weights.into_iter().enumerate() {
        if area[s] > LEAST_COVERED * slave.areas_m2[s] {
            let masters = row(weights, area[s]);
            found.rows[s] = Some(Row {
                area_m2: area[s],
                masters,
            });
        }
    }
    found
}

/// Weights W / D without those that are rounding, so that each node has one master where the facets
/// match.
fn row(weights: HashMap<u32, f64>, area: f64) -> Vec<(u32, f64)> {
    let mut masters: Vec<(u32, f64)> = weights
        .into_iter()
        .map(|(k, w)| (k, w / area))
        .filter(|(_, w)| w.abs() > ROUNDING)
        .collect();
    masters.sort_unstable_by_key(|(k, _)| *k);
    if let [(_, weight)] = masters.as_mut_slice() {
        *weight = 1.0;
    }
    let sum: f64 = masters.iter().map(|(_, w)| w).sum();
    for (_, weight) in &mut masters {
        *weight /= sum;
    }
    masters
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
    fn between(self, longest_m: f64) -> f64 {
        match self {
            Self::Given(reach) => reach,
            Self::OfFacets(share) => share * longest_m,
        }
    }
}

/// Facet of three or four corners.
struct Facet {
    corners_m: Vec<Vector>,
    centre_m: Vector,
    /// Unit normal, out of the body.
    normal: Vector,
    /// Two axes across the normal.
    axes: [Vector; 2],
    longest_m: f64,
    /// Distance from the centre to the farthest corner, m.
    radius_m: f64,
}

fn facets(flank: &Flank, nodes_m: &[Vector]) -> Vec<Facet> {
    let corners = |facet: &Vec<u32>| facet.iter().map(|&i| nodes_m[i as usize]).collect();
    flank
        .facets
        .iter()
        .map(|f| Facet::new(corners(f)))
        .collect()
}

/// Points in the plane of a slave facet.
type Polygon = Vec<[f64; 2]>;

/// Integrals over the covered part of a slave facet.
struct Shares {
    /// D_e of each corner, m2.
    area_m2: Vec<f64>,
    /// W of each corner, by master facet and its corner.
    weights: Vec<Vec<((usize, usize), f64)>>,
}

impl Facet {
    fn new(corners_m: Vec<Vector>) -> Self {
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
            corners_m,
        }
    }

    fn in_plane(&self, x: Vector) -> [f64; 2] {
        let d = sub(x, self.centre_m);
        self.axes.map(|axis| dot(axis, d))
    }

    /// Corners of a facet, projected to the plane of this one along its normal.
    fn outline_of(&self, facet: &Self) -> Polygon {
        facet.corners_m.iter().map(|x| self.in_plane(*x)).collect()
    }

    /// Part of this facet that lies opposite a master facet; where there is none, the reason is
    /// written to `missed`.
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
        let own = self.outline_of(self);
        let part = clipped(own.clone(), &outline);
        if area(&part) < LEAST_PART * area(&own) {
            return None;
        }
        // Between the planes of both, at the middle of the part.
        let count = part.len() as f64;
        let middle = [0, 1].map(|k| part.iter().map(|p| p[k]).sum::<f64>() / count);
        let on_own = [0, 1, 2]
            .map(|k| self.centre_m[k] + middle[0] * self.axes[0][k] + middle[1] * self.axes[1][k]);
        let off = dot(sub(master.centre_m, on_own), master.normal) / cosine;
        let distance_m = off.abs();
        let too_far = distance_m > reach.between(self.longest_m.max(master.longest_m));
        if too_far || cosine > FACING {
            let is_nearest = missed.is_none_or(|m| distance_m < m.distance_m);
            if is_nearest && distance_m.is_finite() {
                *missed = Some(Missed {
                    position_m: on_own,
                    distance_m,
                    degrees: cosine.clamp(-1.0, 1.0).acos().to_degrees(),
                });
            }
            return None;
        }
        Some(part)
    }
}

impl Facet {
    /// Integrals over the covered `parts` (master facet, polygon); `None` where there is no such
    /// part.
    fn shares(&self, parts: &[(usize, Polygon)], masters: &[Self]) -> Option<Shares> {
        let own = self.outline_of(self);
        let corners = own.len();
        let mut d = vec![0.0; corners];
        let mut m = Mat::<f64>::zeros(corners, corners);
        // int phi_b phi_k by slave corner b.
        let mut mixed: Vec<Vec<((usize, usize), f64)>> = vec![Vec::new(); corners];
        for (number, part) in parts {
            let outline = self.outline_of(&masters[*number]);
            let cuts = if is_affine(&own) && is_affine(&outline) {
                0
            } else {
                CUTS
            };
            let mut sums = Mat::<f64>::zeros(corners, outline.len());
            for (point, weight) in points_in(part, cuts) {
                let (phi, master) = (values(&own, point), values(&outline, point));
                for (a, phi_a) in phi.iter().enumerate() {
                    d[a] += weight * phi_a;
                    for (b, phi_b) in phi.iter().enumerate() {
                        m[(a, b)] += weight * phi_a * phi_b;
                    }
                    for (k, phi_k) in master.iter().enumerate() {
                        sums[(a, k)] += weight * phi_a * phi_k;
                    }
                }
            }
            for (a, mixed) in mixed.iter_mut().enumerate() {
                mixed.extend((0..outline.len()).map(|k| ((*number, k), sums[(a, k)])));
            }
        }
        if d.iter().sum::<f64>() < LEAST_FACET * area(&own) {
            return None;
        }
        let factor = dense::cholesky(m).ok()?;
        let mut inverse = Mat::<f64>::identity(corners, corners);
        dense::solve_in_place(factor.as_ref(), inverse.as_mut());
        let weights = (0..corners).map(|a| {
            let mut own = mixed[0].clone();
            for (i, (_, sum)) in own.iter_mut().enumerate() {
                *sum = (0..corners)
                    .map(|b| d[a] * inverse[(a, b)] * mixed[b][i].1)
                    .sum();
            }
            own
        });
        Some(Shares {
            weights: weights.collect(),
            area_m2: d,
        })
    }
}

/// Points and weights of a rule on a convex polygon whose triangles are cut into four so many
/// times.
fn points_in(polygon: &Polygon, cuts: usize) -> impl Iterator<Item = ([f64; 2], f64)> {
    let sides = polygon[1..].windows(2);
    let mut triangles: Vec<[[f64; 2]; 3]> = sides.map(|s| [polygon[0], s[0], s[1]]).collect();
    for _ in 0..cuts {
        triangles = triangles.into_iter().flat_map(quarters).collect();
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

/// Returns `true` if the shape functions of a facet are polynomials: those of triangles and
/// parallelograms.
fn is_affine(corners: &Polygon) -> bool {
    let [a, b, c, d] = corners.as_slice() else {
        return true;
    };
    let off = [0, 1].map(|k| a[k] - b[k] + c[k] - d[k]);
    let long = [0, 1].map(|k| c[k] - a[k]);
    let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
    square(off) < 1e-20 * square(long)
}

/// Linear (bilinear) shape functions at a point of the plane of a facet with these corners, by
/// Newton's method, which takes one step for a triangle.
fn values(corners: &Polygon, point: [f64; 2]) -> Vec<f64> {
    const MOST_STEPS: usize = 30;
    let mut local = [0.0; 2];
    for _ in 0..MOST_STEPS {
        let functions = of_facet(corners.len(), local);
        let sum = |of: &dyn Fn(usize) -> f64, k: usize| -> f64 {
            (0..corners.len()).map(|i| of(i) * corners[i][k]).sum()
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
        if is_small || corners.len() == 3 || !step.iter().all(|s| s.is_finite()) {
            break;
        }
    }
    let functions = of_facet(corners.len(), local);
    functions.iter().map(|f| f.value).collect()
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

/// Part of a convex polygon that lies in another one, both counter-clockwise (Sutherland and
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
    fn of(masters: &[Facet], slaves: &[Facet], reach: Reach) -> Self {
        let largest = |of: fn(&Facet) -> f64| {
            let both = [masters, slaves].map(|f| f.iter().map(of).fold(0.0, f64::max));
            (both[0] + both[1], both[0].max(both[1]))
        };
        let far = masters.iter().flat_map(|f| f.centre_m);
        let far = far.fold(0.0, |m: f64, x| m.max(x.abs()));
        // Cells are numbered by i64: no finer than 1e-15 of the largest coordinate.
        let width = largest(|f| f.radius_m).0 + reach.between(largest(|f| f.longest_m).1);
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
    fn around(&self, facet: &Facet) -> Vec<usize> {
        let [x, y, z] = self.cell(facet);
        let near = -1..=1;
        let mut found = Vec::new();
        for a in near.clone() {
            for b in near.clone() {
                for c in near.clone() {
                    found.extend(self.of.get(&[x + a, y + b, z + c]).into_iter().flatten());
                }
            }
        }
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_mesh::facet::shares;

    /// A flank and the positions of its nodes.
    type Surface = (Flank, Vec<Vector>);

    /// A flank of n x m cells, each a quadrilateral or two triangles, put in space by `map`; its
    /// outward normal is +z of the map, or -z where it lies on top of the other one.
    fn grid(
        [n, m]: [usize; 2],
        quadrilaterals: bool,
        on_top: bool,
        map: impl Fn([f64; 2]) -> Vector,
    ) -> Surface {
        let at = |i: usize, j: usize| (i + (n + 1) * j) as u32;
        let nodes_m: Vec<Vector> = (0..=m)
            .flat_map(|j| (0..=n).map(move |i| [i as f64 / n as f64, j as f64 / m as f64]))
            .map(map)
            .collect();
        let mut facets = Vec::new();
        for j in 0..m {
            for i in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                // The diagonals of neighbours cross.
                if quadrilaterals {
                    facets.push(vec![a, b, c, d]);
                } else if (i + j) % 2 == 0 {
                    facets.extend([vec![a, b, c], vec![a, c, d]]);
                } else {
                    facets.extend([vec![a, b, d], vec![b, c, d]]);
                }
            }
        }
        if on_top {
            facets.iter_mut().for_each(|f| f.reverse());
        }
        let mut areas_m2 = vec![0.0; nodes_m.len()];
        for facet in &facets {
            let corners: Vec<Vector> = facet.iter().map(|&k| nodes_m[k as usize]).collect();
            for (&k, share) in facet.iter().zip(shares(&corners)) {
                areas_m2[k as usize] += share.area_m2;
            }
        }
        let flank = Flank {
            nodes: (0..nodes_m.len() as u32).collect(),
            normals: vec![[0.0, 0.0, if on_top { -1.0 } else { 1.0 }]; nodes_m.len()],
            middles: vec![Vec::new(); facets.len()],
            facets,
            areas_m2,
            along: [1.0, 0.0, 0.0],
        };
        (flank, nodes_m)
    }

    const SIZE: [f64; 2] = [3e-2, 1e-2];
    const FAR: Reach = Reach::OfFacets(0.5);

    /// Rectangle of that size with its lines bent inside: cells that are no parallelograms.
    fn bent([u, v]: [f64; 2]) -> Vector {
        let inside = u * (1.0 - u) * v * (1.0 - v);
        let (u, v) = (u * u * 0.4 + 0.6 * u + 0.7 * inside, v - 0.6 * inside);
        [SIZE[0] * u, SIZE[1] * v, 0.2]
    }

    fn even([u, v]: [f64; 2]) -> Vector {
        [SIZE[0] * u, SIZE[1] * v, 0.2]
    }

    fn found(slave: &Surface, master: &Surface, reach: Reach) -> Mortar {
        mortar([&slave.0, &master.0], [&slave.1, &master.1], reach)
    }

    /// Position on the master that the slave's node meets.
    fn met(row: &Row, master: &[Vector]) -> Vector {
        [0, 1, 2].map(|c| {
            row.masters
                .iter()
                .map(|(k, w)| w * master[*k as usize][c])
                .sum()
        })
    }

    /// Rows sum to 1, linear fields are reproduced, and a uniform pressure on the slave's areas
    /// loads the master as it would by its own shape functions: the contact patch test.
    #[test]
    fn linear_fields_and_a_uniform_pressure_pass_any_two_grids() {
        let grids = [[3, 2], [4, 3], [7, 5]];
        for (below, above) in [(0, 1), (0, 2), (2, 0), (2, 1)] {
            for quadrilaterals in [[false; 2], [true; 2], [true, false], [false, true]] {
                let slave = grid(grids[below], quadrilaterals[0], false, bent);
                let master = grid(grids[above], quadrilaterals[1], true, even);
                let mortar = found(&slave, &master, FAR);
                for covered in mortar.covered {
                    assert!((covered - 1.0).abs() < 1e-12, "{covered}");
                }
                let mut loads = vec![0.0; master.1.len()];
                let mut area = 0.0;
                for (row, x) in mortar.rows.iter().zip(&slave.1) {
                    let row = row.as_ref().unwrap();
                    let sum: f64 = row.masters.iter().map(|(_, w)| w).sum();
                    assert!((sum - 1.0).abs() < 1e-12, "{sum}");
                    let off = distance(met(row, &master.1), *x);
                    assert!(off < 1e-10 * SIZE[0], "{off:e}");
                    for (k, weight) in &row.masters {
                        loads[*k as usize] += row.area_m2 * weight;
                    }
                    area += row.area_m2;
                }
                assert!((area / (SIZE[0] * SIZE[1]) - 1.0).abs() < 1e-12);
                for (load, own) in loads.iter().zip(&master.0.areas_m2) {
                    assert!((load / own - 1.0).abs() < 1e-9, "{load:e} {own:e}");
                }
            }
        }
    }

    #[test]
    fn flanks_turned_and_shifted_against_each_other_keep_the_identities() {
        let turned = |p: [f64; 2]| {
            let [x, y, z] = bent(p);
            let (s, c) = 0.4f64.sin_cos();
            [c * x - s * y + 4e-3, s * x + c * y - 5e-3, z]
        };
        let slave = grid([9, 4], false, false, even);
        let master = grid([6, 5], false, true, turned);
        let mortar = found(&slave, &master, FAR);
        // Both have the same area, and so has what they share.
        let [own, other] = mortar.covered;
        assert!((0.3..0.9).contains(&own), "{own}");
        assert!((own - other).abs() < 1e-12, "{own} {other}");
        let rows = mortar.rows.iter().zip(&slave.1);
        let rows: Vec<_> = rows.filter_map(|(r, x)| Some((r.as_ref()?, x))).collect();
        assert!(rows.len() > 10 && rows.len() < slave.1.len());
        for (row, x) in rows {
            assert!(distance(met(row, &master.1), *x) < 1e-10 * SIZE[0]);
        }
    }

    #[test]
    fn where_facets_match_each_node_meets_one_with_its_share_of_the_area() {
        for quadrilaterals in [false, true] {
            let [slave, master] =
                [false, true].map(|on_top| grid([5, 3], quadrilaterals, on_top, bent));
            let mortar = found(&slave, &master, FAR);
            for (s, row) in mortar.rows.iter().enumerate() {
                let row = row.as_ref().unwrap();
                assert_eq!(row.masters, [(s as u32, 1.0)]);
                assert!((row.area_m2 / slave.0.areas_m2[s] - 1.0).abs() < 1e-9);
            }
            assert!(mortar.met.iter().flatten().all(|met| *met));
        }
    }

    /// The shape functions of a quadrilateral far from a parallelogram are no polynomials in its
    /// plane. Its nodes have the areas all the same, which are polynomials in the coordinates of
    /// the element.
    #[test]
    fn the_nodes_of_a_quadrilateral_far_from_a_parallelogram_have_their_areas() {
        let kite = |[u, v]: [f64; 2]| even([u - 0.4 * u * v, v - 0.4 * u * v]);
        let slave = grid([1, 1], true, false, kite);
        let master = grid([1, 1], true, true, even);
        let mortar = found(&slave, &master, FAR);
        for (row, own) in mortar.rows.iter().zip(&slave.0.areas_m2) {
            let off = row.as_ref().unwrap().area_m2 / own - 1.0;
            assert!(off.abs() < 5e-6, "{off:e}");
        }
    }

    /// With columns a quarter of the flank wide, the master covers two and 1 % of a third: its node
    /// there has the area of half a column, and almost nothing of the third.
    #[test]
    fn what_is_hardly_covered_carries_nothing() {
        let slave = grid([4, 1], true, false, even);
        let master = grid([1, 1], true, true, |[u, v]| even([0.5025 * u, v]));
        let mortar = found(&slave, &master, Reach::Given(1e-6));
        let [own, other] = mortar.covered;
        assert!((own - 0.5025).abs() < 1e-12 && (other - 1.0).abs() < 1e-12);
        let carries: Vec<bool> = mortar.rows.iter().map(Option::is_some).collect();
        assert_eq!(carries[..5], [true, true, true, false, false]);
        assert_eq!(mortar.met[0], [true, true, true, false]);
        // No other facet is nearer.
        let above = grid([2, 2], true, true, |p| {
            let [x, y, z] = even(p);
            [x, y, z + 3e-3]
        });
        let mortar = found(&slave, &above, Reach::Given(2e-3));
        assert!(mortar.rows.iter().all(Option::is_none));
        let missed = mortar.missed.unwrap();
        assert!((missed.distance_m - 3e-3).abs() < 1e-12 && missed.degrees > 179.0);
        // A facet that faces the same way is not opposite.
        let same_way = grid([2, 2], true, false, even);
        let missed = found(&slave, &same_way, FAR).missed.unwrap();
        assert!(missed.degrees < 1.0, "{missed:?}");
    }
}
