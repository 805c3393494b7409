//! Joints of two surfaces that move as one: bonded contacts, and the faces of a sector.
//!
//! If both surfaces have the same mesh, each node follows the node at its place, middle nodes
//! included. Otherwise each node of one surface, the slave, follows the other one, the master, as
//!
//! ```text
//! u_s = P u_m     P = I + Q (1 - I)
//! ```
//!
//! `I` evaluates the master's shape functions at the slave's nodes. `Q` adds a field of the slave's shape
//! functions near each corner `a` that restores the moments of the difference `u_m - I u_m`,
//!
//! ```text
//! sum_a sum_l b_al int L_a (u_m - I u_m) p_l,     int b_al p_l' = 1 if l = l', 0 otherwise
//! ```
//!
//! with the linear shape functions `L_a` of the corners, whose sum is 1, and `p` = 1 and the two
//! coordinates in the tangent plane. `b_al` is the combination of the shape functions of the nodes
//! around `a` that has the least norm. So a quadratic displacement of plane faces is reproduced, because
//! `I` reproduces it, and a traction that is constant or linear does the same work on both sides,
//! because `Q` restores its moments: these two are the patch tests of uniform stress and of pure
//! bending. Dual shape functions (`mortar.rs`), which transmit constant tractions only, do not exist
//! for six nodes without a change of basis (Popp, Wohlmuth, Gitterle, Wall, SIAM J. Sci. Comput. 34
//! (2012) B421-B446). The weights stay as local as the weights of dual functions.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::neighbours::PointTree;
use super::opposite::{Facet, Opposite, Reach, opposite, points_in, reference, values};
use dovetail_mesh::element::facet_corners;
use dovetail_mesh::interpolation::facet_functions;
use dovetail_numerics::dense;
use dovetail_numerics::space::{Vector, cross, distance, dot, scaled, sub, unit};
use faer::Mat;

/// Largest distance of two nodes that meet, relative to the smallest distance of two nodes of a
/// face.
const MEETING: f64 = 0.02;
/// Largest distance of a node from the facet that it follows, in lengths of the reference facet.
const OUTSIDE: f64 = 0.1;
/// Weights below this are rounding.
const ROUNDING: f64 = 1e-10;

/// Surface with all its nodes.
pub(super) struct Sheet {
    /// Nodes of the mesh.
    pub nodes: Vec<u32>,
    pub nodes_m: Vec<Vector>,
    /// Facets as indices into `nodes`: corners counter-clockwise seen from outside, then middles.
    pub facets: Vec<Vec<u32>>,
}

/// Result of the tie of two surfaces.
pub(super) struct Tie {
    /// Master nodes of each slave node, by positions in the list of the master, with their weights;
    /// `None` for a node without a facet opposite it.
    pub rows: Vec<Option<Vec<(u32, f64)>>>,
    /// Facets that lie opposite each other.
    pub opposite: Opposite,
}

impl Sheet {
    fn facets(&self) -> Vec<Facet> {
        let nodes = |facet: &Vec<u32>| facet.iter().map(|&i| self.nodes_m[i as usize]).collect();
        self.facets.iter().map(|f| Facet::new(nodes(f))).collect()
    }
}

/// Rows of the nodes of the surface `own` on the nodes of `other`. `reach` is the largest distance of two
/// facets along the normal.
pub(super) fn tie([own, other]: [&Sheet; 2], reach: Reach) -> Tie {
    let (slaves, masters) = (own.facets(), other.facets());
    let opposite = opposite([&slaves, &masters], reach);
    let rows = match node_by_node([own, other]) {
        Some(rows) => rows,
        None => {
            let mut rows = interpolated([own, other], &masters, &opposite);
            restore_moments([own, other], [&slaves, &masters], &opposite, &mut rows);
            rows
        }
    };
    let finished = |row: BTreeMap<u32, f64>| {
        let kept = row.into_iter().filter(|(_, w)| w.abs() > ROUNDING);
        let mut masters: Vec<(u32, f64)> = kept.collect();
        let sum: f64 = masters.iter().map(|(_, w)| w).sum();
        masters.iter_mut().for_each(|(_, w)| *w /= sum);
        masters
    };
    Tie {
        rows: rows.into_iter().map(|row| row.map(finished)).collect(),
        opposite,
    }
}

/// Weights of each slave node by the positions of the masters.
type Rows = Vec<Option<BTreeMap<u32, f64>>>;

/// Rows of a surface whose facets are facets of the other one.
fn node_by_node([own, other]: [&Sheet; 2]) -> Option<Rows> {
    let meeting = Meeting::new(&own.nodes_m, &other.nodes_m, |x| x);
    if meeting.unmatched_nodes().next().is_some() {
        return None;
    }
    let sorted = |mut facet: Vec<u32>| {
        facet.sort_unstable();
        facet
    };
    let known: BTreeSet<Vec<u32>> = other.facets.iter().cloned().map(sorted).collect();
    let met = |facet: &Vec<u32>| {
        let nodes = facet.iter().map(|&i| meeting.nearest[i as usize].0 as u32);
        known.contains(&sorted(nodes.collect()))
    };
    let one = |&(k, _): &(usize, f64)| Some(BTreeMap::from([(k as u32, 1.0)]));
    let all_met = own.facets.iter().all(met);
    all_met.then(|| meeting.nearest.iter().map(one).collect())
}

/// Nodes of one face, and the nearest nodes of another.
pub(super) struct Meeting {
    /// Number of the nearest node, and its distance in m, for each node.
    pub nearest: Vec<(usize, f64)>,
    /// Smallest distance of two nodes of the face, m; infinite for one node.
    pub spacing_m: f64,
}

impl Meeting {
    /// Nearest of `others_m` to each of `nodes_m` after a motion of these.
    pub(crate) fn new(
        nodes_m: &[Vector],
        others_m: &[Vector],
        moved: impl Fn(Vector) -> Vector,
    ) -> Self {
        let (own, others) = (PointTree::new(nodes_m), PointTree::new(others_m));
        let spacing_m = |x: &Vector| own.nearest(*x).nth(1).map(|(_, square)| square.sqrt());
        let spacings_m = nodes_m.iter().filter_map(spacing_m);
        let nearest = |x: &Vector| {
            let nearest = others.nearest(moved(*x)).next();
            nearest.map_or((0, f64::INFINITY), |(k, square)| (k, square.sqrt()))
        };
        Self {
            nearest: nodes_m.iter().map(nearest).collect(),
            spacing_m: spacings_m.fold(f64::INFINITY, f64::min),
        }
    }

    /// Numbers of the nodes that meet none.
    pub(crate) fn unmatched_nodes(&self) -> impl Iterator<Item = usize> {
        let distances = self.nearest.iter().enumerate();
        // A face of one node has no spacing, and meets anything.
        distances
            .filter(|(_, near)| near.1 > MEETING * self.spacing_m)
            .map(|(i, _)| i)
    }

    /// Largest distance of a node from the nearest one, m.
    pub(crate) fn farthest_m(&self) -> f64 {
        self.nearest.iter().map(|near| near.1).fold(0.0, f64::max)
    }
}

/// Values of the master's shape functions at the places of the slave's nodes: `I`.
fn interpolated([own, other]: [&Sheet; 2], masters: &[Facet], opposite: &Opposite) -> Rows {
    let mut candidates: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); own.nodes.len()];
    for (facet, parts) in own.facets.iter().zip(&opposite.parts) {
        for &i in facet {
            candidates[i as usize].extend(parts.iter().map(|(m, _)| *m));
        }
    }
    let row = |(x, candidates): (&Vector, &BTreeSet<usize>)| {
        let place = |&m: &usize| {
            let at = reference(
                &masters[m].nodes_of(&masters[m]),
                masters[m].plane_coordinates(*x),
            );
            (m, at, outside(other.facets[m].len(), at))
        };
        let best = candidates.iter().map(place);
        let (m, at, beyond) = best.min_by(|a, b| a.2.total_cmp(&b.2))?;
        if beyond > OUTSIDE {
            return None;
        }
        let nodes = &other.facets[m];
        let functions = facet_functions(nodes.len(), at).into_iter();
        Some(
            nodes
                .iter()
                .copied()
                .zip(functions.map(|f| f.value))
                .collect(),
        )
    };
    own.nodes_m.iter().zip(&candidates).map(row).collect()
}

/// Distance of a reference point from a facet with this number of nodes, in lengths of its reference
/// edge.
fn outside(nodes: usize, [r, s]: [f64; 2]) -> f64 {
    let beyond = match facet_corners(nodes) {
        3 => (-r).max(-s).max(r + s - 1.0),
        _ => 0.5 * (r.abs() - 1.0).max(s.abs() - 1.0),
    };
    // Points inside are alike: the first facet is taken.
    beyond.max(1e-9)
}

/// Integral of a function, and of the function times the position.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    integral: f64,
    by_position: Vector,
}

impl Moments {
    fn add(&mut self, weight: f64, at: Vector) {
        self.integral += weight;
        for (sum, x) in self.by_position.iter_mut().zip(at) {
            *sum += weight * x;
        }
    }
}

/// Integrals over the facets whose nodes all follow the master.
struct Integrals {
    /// Shape function of each slave node.
    own: Vec<Moments>,
    /// Its square, m2.
    squares_m2: Vec<f64>,
    /// Product of the linear function of a corner and the shape function of a slave node, by corner and
    /// node.
    with_own: HashMap<u32, BTreeMap<u32, Moments>>,
    /// The same for master nodes.
    with_master: HashMap<u32, BTreeMap<u32, Moments>>,
    /// Sum of the outward normals of the facets at a corner, weighted by their areas.
    normals: HashMap<u32, Vector>,
}

impl Integrals {
    fn new(
        [own, other]: [&Sheet; 2],
        [slaves, masters]: [&[Facet]; 2],
        opposite: &Opposite,
        rows: &Rows,
    ) -> Self {
        let mut integrals = Self {
            own: vec![Moments::default(); own.nodes.len()],
            squares_m2: vec![0.0; own.nodes.len()],
            with_own: HashMap::new(),
            with_master: HashMap::new(),
            normals: HashMap::new(),
        };
        for ((nodes, slave), parts) in own.facets.iter().zip(slaves).zip(&opposite.parts) {
            if nodes.iter().any(|&i| rows[i as usize].is_none()) {
                continue;
            }
            let (outline, in_plane) = (slave.outline_of(slave), slave.nodes_of(slave));
            for &a in &nodes[..outline.len()] {
                let sum = integrals.normals.entry(a).or_default();
                let normal = scaled(slave.normal, slave.area_m2());
                *sum = [0, 1, 2].map(|k| sum[k] + normal[k]);
            }
            for (m, part) in parts {
                let opposite = slave.nodes_of(&masters[*m]);
                for (point, weight) in points_in(part, [&in_plane, &opposite]) {
                    let at = slave.space_point(point);
                    let local = reference(&in_plane, point);
                    let phi = facet_functions(in_plane.len(), local);
                    let linear = facet_functions(outline.len(), local);
                    let phi_master = values(&opposite, point);
                    for (&i, phi) in nodes.iter().zip(&phi) {
                        integrals.own[i as usize].add(weight * phi.value, at);
                        integrals.squares_m2[i as usize] += weight * phi.value * phi.value;
                    }
                    for (&a, corner) in nodes.iter().zip(&linear) {
                        let weight = weight * corner.value;
                        let sums = integrals.with_own.entry(a).or_default();
                        for (&i, phi) in nodes.iter().zip(&phi) {
                            sums.entry(i).or_default().add(weight * phi.value, at);
                        }
                        let sums = integrals.with_master.entry(a).or_default();
                        for (&k, phi) in other.facets[*m].iter().zip(&phi_master) {
                            sums.entry(k).or_default().add(weight * phi, at);
                        }
                    }
                }
            }
        }
        integrals
    }
}

/// Adds `Q (1 - I)` to the rows of `I`.
fn restore_moments(
    sheets: [&Sheet; 2],
    facets: [&[Facet]; 2],
    opposite: &Opposite,
    rows: &mut Rows,
) {
    let integrals = Integrals::new(sheets, facets, opposite, rows);
    let mut corners: Vec<u32> = integrals.with_own.keys().copied().collect();
    corners.sort_unstable();
    let mut corrections: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for a in corners {
        let Some(patch) = TiePatch::new(sheets[0], &integrals, a) else {
            continue;
        };
        // Moments of phi_k - I phi_k for each master's shape function phi_k.
        let mut left: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
        let mut add = |k: u32, factor: f64, moments: &Moments| {
            let sum = left.entry(k).or_default();
            for (sum, moment) in sum.iter_mut().zip(patch.moments(moments)) {
                *sum += factor * moment;
            }
        };
        for (&k, moments) in &integrals.with_master[&a] {
            add(k, 1.0, moments);
        }
        for (&i, moments) in &integrals.with_own[&a] {
            for (&k, weight) in rows[i as usize].iter().flatten() {
                add(k, -weight, moments);
            }
        }
        for (i, shares) in &patch.shares {
            for (&k, left) in &left {
                *corrections.entry((*i, k)).or_default() += dot(*shares, *left);
            }
        }
    }
    for ((i, k), weight) in corrections {
        if let Some(row) = &mut rows[i as usize] {
            *row.entry(k).or_default() += weight;
        }
    }
}

/// Fields `b` of the facets around a corner.
struct TiePatch {
    corner_m: Vector,
    /// Two unit vectors across the normal, over the size of the patch.
    axes_per_m: [Vector; 2],
    /// Coefficient of the shape function of each node in the fields of the three moments.
    shares: Vec<(u32, [f64; 3])>,
}

impl TiePatch {
    /// Fields around corner `a`; `None` if its facets have no area.
    fn new(sheet: &Sheet, integrals: &Integrals, a: u32) -> Option<Self> {
        let nodes = || integrals.with_own[&a].keys().copied();
        let corner_m = sheet.nodes_m[a as usize];
        let far = |i: u32| distance(sheet.nodes_m[i as usize], corner_m);
        let size_m = nodes().map(far).fold(0.0, f64::max);
        let normal = unit(*integrals.normals.get(&a)?)?;
        let least = (0..3).min_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs()))?;
        let across = unit(cross(normal, [0, 1, 2].map(|k| f64::from(k == least))))?;
        let axes_per_m = [across, cross(normal, across)].map(|t| scaled(t, 1.0 / size_m));
        let mut patch = Self {
            corner_m,
            axes_per_m,
            shares: Vec::new(),
        };
        // Least norm: each coefficient is the moment of its function over the square of this.
        let weighted: Vec<(u32, [f64; 3], f64)> = nodes()
            .map(|i| {
                let moments = patch.moments(&integrals.own[i as usize]);
                (i, moments, 1.0 / integrals.squares_m2[i as usize])
            })
            .collect();
        let product = |l: usize, k: usize| -> f64 {
            let terms = weighted.iter();
            terms
                .map(|(_, moments, weight)| moments[l] * weight * moments[k])
                .sum()
        };
        let size = if is_regular(&product) { 3 } else { 1 };
        let factor = dense::cholesky(Mat::from_fn(size, size, &product)).ok()?;
        let mut inverse = Mat::<f64>::identity(size, size);
        dense::solve_in_place(factor.as_ref(), inverse.as_mut());
        let shares = weighted.into_iter().map(|(i, moments, weight)| {
            let share = |l: usize| match l < size {
                true => (0..size)
                    .map(|k| weight * moments[k] * inverse[(k, l)])
                    .sum(),
                false => 0.0,
            };
            (i, [0, 1, 2].map(share))
        });
        patch.shares = shares.collect();
        Some(patch)
    }

    /// Integrals of a function times 1 and times the two coordinates.
    fn moments(&self, of: &Moments) -> [f64; 3] {
        let [s, t] = self.axes_per_m.map(|axis| {
            dot(
                sub(of.by_position, scaled(self.corner_m, of.integral)),
                axis,
            )
        });
        [of.integral, s, t]
    }
}

/// Returns `true` if a symmetric matrix of three rows is far from singular: its determinant over the
/// product of its diagonal.
fn is_regular(entry: &impl Fn(usize, usize) -> f64) -> bool {
    const LEAST: f64 = 1e-6;
    let row = |l: usize| [0, 1, 2].map(|k| entry(l, k));
    let determinant = dot(row(0), cross(row(1), row(2)));
    determinant > LEAST * entry(0, 0) * entry(1, 1) * entry(2, 2)
}
