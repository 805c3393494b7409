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
use super::opposite::{Facet, Opposite, Polygon, Reach, opposite, points_in, values};
use dovetail_numerics::dense;
use dovetail_numerics::space::Vector;
use faer::Mat;

/// Result of the pairing of two flanks.
pub(super) struct Mortar {
    /// Row of each node of the slave flank; `None` for a node that carries nothing.
    pub rows: Vec<Option<MortarRow>>,
    /// Facets that lie opposite each other.
    pub opposite: Opposite,
}

/// Area and weights of one slave node.
#[derive(Debug, Clone)]
pub(super) struct MortarRow {
    /// Area D, m2.
    pub area_m2: f64,
    /// Nodes of the master flank, by their positions in its list, ascending, and their weights.
    pub masters: Vec<(u32, f64)>,
}

/// A node carries nothing if its covered area is below this fraction of its whole area.
const LEAST_COVERED: f64 = 0.05;
/// Weights below this are rounding, and so is a difference from 1 below it.
const ROUNDING: f64 = 1e-10;
/// Weights of the nodes of the `slave` flank (its positions come first) on the nodes of the
/// `master` flank. `reach` is the largest distance of two facets along the normal.
pub(super) fn mortar(
    [slave, master]: [&Flank; 2],
    [slave_m, master_m]: [&[Vector]; 2],
    reach: Reach,
) -> Mortar {
    let masters: Vec<Facet> = facets(master, master_m);
    let slaves: Vec<Facet> = facets(slave, slave_m);
    let opposite = opposite([&slaves, &masters], reach);
    let mut area = vec![0.0; slave.nodes.len()];
    let mut weights: Vec<HashMap<u32, f64>> = vec![HashMap::new(); slave.nodes.len()];
    for ((facet, parts), corners) in slaves.iter().zip(&opposite.parts).zip(&slave.facets) {
        let Some(shares) = shares(facet, parts, &masters) else {
            continue;
        };
        for ((&s, own_area), own_weights) in corners.iter().zip(shares.area_m2).zip(shares.weights)
        {
            area[s as usize] += own_area;
            for ((m, corner), weight) in own_weights {
                let k = master.facets[m][corner];
                *weights[s as usize].entry(k).or_default() += weight;
            }
        }
    }
    let rows = weights.into_iter().enumerate().map(|(s, weights)| {
        let is_covered = area[s] > LEAST_COVERED * slave.areas_m2[s];
        is_covered.then(|| MortarRow {
            area_m2: area[s],
            masters: row(weights, area[s]),
        })
    });
    Mortar {
        rows: rows.collect(),
        opposite,
    }
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

/// Integrals over the covered part of a slave facet.
struct Shares {
    /// D_e of each corner, m2.
    area_m2: Vec<f64>,
    /// W of each corner, by master facet and its corner.
    weights: Vec<Vec<((usize, usize), f64)>>,
}

fn facets(flank: &Flank, nodes_m: &[Vector]) -> Vec<Facet> {
    let corners = |facet: &Vec<u32>| facet.iter().map(|&i| nodes_m[i as usize]).collect();
    flank
        .facets
        .iter()
        .map(|f| Facet::new(corners(f)))
        .collect()
}

/// Integrals over the covered `parts` (master facet, polygon) of a slave facet; `None` if there is no
/// such part.
fn shares(facet: &Facet, parts: &[(usize, Polygon)], masters: &[Facet]) -> Option<Shares> {
    if parts.is_empty() {
        return None;
    }
    let own_outline = facet.outline_of(facet);
    let corners = own_outline.len();
    let mut d = vec![0.0; corners];
    let mut m = Mat::<f64>::zeros(corners, corners);
    // int phi_b phi_k by slave corner b.
    let mut mixed: Vec<Vec<((usize, usize), f64)>> = vec![Vec::new(); corners];
    for (number, part) in parts {
        let outline = facet.outline_of(&masters[*number]);
        let mut sums = Mat::<f64>::zeros(corners, outline.len());
        for (point, weight) in points_in(part, [&own_outline, &outline]) {
            let (phi, master) = (values(&own_outline, point), values(&outline, point));
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
    let factor = dense::cholesky(m).ok()?;
    let mut inverse = Mat::<f64>::identity(corners, corners);
    dense::solve_in_place(factor.as_ref(), inverse.as_mut());
    let weights = (0..corners).map(|a| {
        let mut mixed_row = mixed[0].clone();
        for (i, (_, sum)) in mixed_row.iter_mut().enumerate() {
            *sum = (0..corners)
                .map(|b| d[a] * inverse[(a, b)] * mixed[b][i].1)
                .sum();
        }
        mixed_row
    });
    Some(Shares {
        weights: weights.collect(),
        area_m2: d,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_mesh::facet::shares;
    use dovetail_numerics::space::distance;

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

    /// Rectangle of this size with its lines bent inside, whose cells are not parallelograms.
    fn bent([u, v]: [f64; 2]) -> Vector {
        let inside = u * (1.0 - u) * v * (1.0 - v);
        let (u, v) = (u * u * 0.4 + 0.6 * u + 0.7 * inside, v - 0.6 * inside);
        [SIZE[0] * u, SIZE[1] * v, 0.2]
    }

    fn even([u, v]: [f64; 2]) -> Vector {
        [SIZE[0] * u, SIZE[1] * v, 0.2]
    }

    fn test_mortar(slave: &Surface, master: &Surface, reach: Reach) -> Mortar {
        mortar([&slave.0, &master.0], [&slave.1, &master.1], reach)
    }

    /// Position on the master that the slave's node meets.
    fn met(row: &MortarRow, master: &[Vector]) -> Vector {
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
                let mortar = test_mortar(&slave, &master, FAR);
                for covered in mortar.opposite.covered {
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
        let mortar = test_mortar(&slave, &master, FAR);
        // Both have the same area, and so has the part that they share.
        let [own, other] = mortar.opposite.covered;
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
            let mortar = test_mortar(&slave, &master, FAR);
            for (s, row) in mortar.rows.iter().enumerate() {
                let row = row.as_ref().unwrap();
                assert_eq!(row.masters, [(s as u32, 1.0)]);
                assert!((row.area_m2 / slave.0.areas_m2[s] - 1.0).abs() < 1e-9);
            }
            assert!(mortar.opposite.met.iter().flatten().all(|met| *met));
        }
    }

    /// The shape functions of a quadrilateral far from a parallelogram are not polynomials in its
    /// plane. Its nodes have the areas all the same, which are polynomials in the coordinates of
    /// the element.
    #[test]
    fn the_nodes_of_a_quadrilateral_far_from_a_parallelogram_have_their_areas() {
        let kite = |[u, v]: [f64; 2]| even([u - 0.4 * u * v, v - 0.4 * u * v]);
        let slave = grid([1, 1], true, false, kite);
        let master = grid([1, 1], true, true, even);
        let mortar = test_mortar(&slave, &master, FAR);
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
        let mortar = test_mortar(&slave, &master, Reach::Given(1e-6));
        let [own, other] = mortar.opposite.covered;
        assert!((own - 0.5025).abs() < 1e-12 && (other - 1.0).abs() < 1e-12);
        let carries: Vec<bool> = mortar.rows.iter().map(Option::is_some).collect();
        assert_eq!(carries[..5], [true, true, true, false, false]);
        assert_eq!(mortar.opposite.met[0], [true, true, true, false]);
        // No other facet is nearer.
        let above = grid([2, 2], true, true, |p| {
            let [x, y, z] = even(p);
            [x, y, z + 3e-3]
        });
        let mortar = test_mortar(&slave, &above, Reach::Given(2e-3));
        assert!(mortar.rows.iter().all(Option::is_none));
        let missed = mortar.opposite.missed.unwrap();
        assert!((missed.apart_m.abs() - 3e-3).abs() < 1e-12 && missed.degrees > 179.0);
        // A facet that faces the same way is not opposite.
        let same_way = grid([2, 2], true, false, even);
        let missed = test_mortar(&slave, &same_way, FAR).opposite.missed.unwrap();
        assert!(missed.degrees < 1.0, "{missed:?}");
    }
}
