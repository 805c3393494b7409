//! Coincident nodes of two flanks, found by position alone.

use std::collections::HashMap;

use dovetail_numerics::space::distance;

/// Result of [`pair`]. Indices are positions in its arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairing {
    /// (first, second, distance), in the order of the first set.
    pub pairs: Vec<(usize, usize, f64)>,
    /// Indices of the first side's nodes that have none.
    pub unmatched_first: Vec<usize>,
    /// Indices of the second side's nodes that have none.
    pub unmatched_second: Vec<usize>,
    /// Two of the first set that are both nearest to one of the second, and that one.
    pub conflict: Option<([usize; 2], usize)>,
}

/// Pairs each point of `first` with the nearest of `second` not farther than its `reach`.
///
/// O(n) through a grid of cells as wide as the largest reach. Equally near points: the lower index.
pub fn pair(first: &[[f64; 3]], reach: &[f64], second: &[[f64; 3]]) -> Pairing {
    let widest = reach.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let far = first
        .iter()
        .chain(second)
        .flatten()
        .fold(0.0, |m: f64, x| m.max(x.abs()));
    // Cells are numbered by i64: no finer than 1e-15 of the largest coordinate.
    let width = widest.max(far * 1e-15);
    let cell = |p: &[f64; 3]| p.map(|x| (x / width).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for (j, p) in second.iter().enumerate() {
        cells.entry(cell(p)).or_default().push(j);
    }
    let mut owner = vec![None; second.len()];
    let mut found = Pairing {
        pairs: Vec::with_capacity(first.len()),
        unmatched_first: Vec::new(),
        unmatched_second: Vec::new(),
        conflict: None,
    };
    for (i, p) in first.iter().enumerate() {
        let [x, y, z] = cell(p);
        let around =
            (-1..=1).flat_map(|a| (-1..=1).flat_map(move |b| (-1..=1).map(move |c| [a, b, c])));
        let near = around
            .filter_map(|[a, b, c]| cells.get(&[x + a, y + b, z + c]))
            .flatten()
            .map(|&j| (distance(*p, second[j]), j))
            .filter(|&(d, _)| d <= reach[i])
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let Some((d, j)) = near else {
            found.unmatched_first.push(i);
            continue;
        };
        if let Some(other) = owner[j] {
            found.conflict.get_or_insert(([other, i], j));
        }
        owner[j] = Some(i);
        found.pairs.push((i, j, d));
    }
    found.unmatched_second = (0..second.len()).filter(|&j| owner[j].is_none()).collect();
    found
}

/// Distance from `p` to the nearest of `points`; infinite where there are none.
pub fn nearest_distance(p: &[f64; 3], points: &[[f64; 3]]) -> f64 {
    points
        .iter()
        .map(|q| distance(*p, *q))
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_numerics::space::norm;
    use proptest::prelude::*;

    fn grid(n: usize) -> Vec<[f64; 3]> {
        (0..n * n)
            .map(|i| [(i % n) as f64, (i / n) as f64, 450.0])
            .collect()
    }

    proptest! {
        /// Any permutation, any small shift: the permutation is found again.
        #[test]
        fn a_permuted_and_shifted_copy_is_matched(
            order in Just((0..49).collect::<Vec<usize>>()).prop_shuffle(),
            shift in prop::array::uniform3(-5e-3..5e-3),
        ) {
            let first = grid(7);
            let second: Vec<_> = order.iter().map(|&i| [0, 1, 2].map(|k| first[i][k] + shift[k])).collect();
            let found = pair(&first, &[1e-2; 49], &second);
            prop_assert_eq!(found.pairs.len(), 49);
            prop_assert!(found.conflict.is_none() && found.unmatched_second.is_empty());
            let length = norm(shift);
            for (i, j, d) in found.pairs {
                prop_assert_eq!(order[j], i);
                prop_assert!((d - length).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn exact_coincidence_far_from_the_origin_with_a_tiny_reach() {
        let points = grid(5);
        let found = pair(&points, &[1e-300; 25], &points);
        assert_eq!(found.pairs.len(), 25);
        assert!(found.pairs.iter().all(|&(i, j, d)| i == j && d == 0.0));
    }

    #[test]
    fn beyond_its_own_reach_a_point_stays_alone() {
        let first = [[0.0; 3], [1.0, 0.0, 0.0]];
        let second = [[0.0, 0.1, 0.0], [1.0, 0.1, 0.0]];
        let found = pair(&first, &[0.2, 0.05], &second);
        assert_eq!((found.pairs.len(), found.pairs[0].1), (1, 0));
        assert_eq!(found.unmatched_first, [1]);
        assert_eq!(found.unmatched_second, [1]);
        assert!((nearest_distance(&first[1], &second) - 0.1).abs() < 1e-15);
        assert_eq!(nearest_distance(&first[1], &[]), f64::INFINITY);
    }

    #[test]
    fn one_node_for_two_is_a_conflict() {
        let first = [[0.0; 3], [0.1, 0.0, 0.0]];
        let found = pair(&first, &[1.0; 2], &[[0.05, 0.0, 0.0]]);
        assert_eq!(found.conflict, Some(([0, 1], 0)));
    }
}
