//! Convergence of a figure: the order shown by its differences, the extrapolated value (Richardson,
//! 1911), and the error of each value.
//!
//! For three values f1, f2, f3 at sizes h1 > h2 > h3 with `f = f* + C h^p`:
//! `(f1 - f2) / (f2 - f3) = (h1^p - h2^p) / (h2^p - h3^p)`, where the right side grows with p;
//! `f* = f3 - (f2 - f3) h3^p / (h2^p - h3^p)`.

use serde::Serialize;

/// Relative difference below which values count as equal, as it may be due to rounding and
/// tolerance: such a figure does not depend on the parameter.
pub const SAME: f64 = 1e-7;
/// Smallest share of the expected order at which an observed order is accepted.
pub const LEAST_ORDER: f64 = 0.3;
/// Largest multiple of the expected order at which an observed order is accepted.
pub const MOST_ORDER: f64 = 2.0;

/// Value from which errors are measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limit {
    pub value: f64,
    pub how: How,
    /// Order of the last three values if they change monotonically; it is used if `how` is
    /// Richardson.
    pub order: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// Extrapolated from the last three values, whose differences show an order.
    Richardson,
    /// The finest value itself, as no order is observed.
    Finest,
    /// The last value, with which the others are compared, as the fineness of the values is
    /// unknown.
    Reference,
    /// The common value, as all values are the same.
    Unchanged,
    /// The only value.
    Single,
}

/// Order shown by three values; `None` if they do not change monotonically, or if no order between
/// 0.01 and 20 fits.
pub fn observed_order(sizes: [f64; 3], values: [f64; 3]) -> Option<f64> {
    let [h1, h2, h3] = sizes;
    let (first, second) = (values[0] - values[1], values[1] - values[2]);
    let scale = values[2].abs();
    if !(h1 > h2 && h2 > h3 && h3 > 0.0) || second.abs() <= SAME * scale || first * second <= 0.0 {
        return None;
    }
    let ratio = first / second;
    // Sizes relative to the middle one: powers stay in range.
    let (a, b) = (h1 / h2, h3 / h2);
    let excess = |p: f64| (a.powf(p) - 1.0) / (1.0 - b.powf(p)) - ratio;
    let (mut low, mut high) = (0.01, 20.0);
    if excess(low) > 0.0 || excess(high) < 0.0 {
        return None;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// Limit f* extrapolated from the last two of three values at this order.
fn extrapolated(sizes: [f64; 3], values: [f64; 3], order: f64) -> f64 {
    let shrink = (sizes[2] / sizes[1]).powf(order);
    values[2] + (values[2] - values[1]) * shrink / (1.0 - shrink)
}

/// Limit of the values (coarse to fine, at least one). `order` is the expected order. The limit is
/// the finest value if the last three show no order near it, or if the figure is not one to
/// `extrapolate`.
pub fn limit(
    sizes: Option<&[f64]>,
    values: &[f64],
    order: f64,
    extrapolate: bool,
) -> Option<Limit> {
    let (&finest, coarser) = values.split_last()?;
    let is_same = |v: &f64| (v - finest).abs() <= SAME * finest.abs();
    let how = match sizes {
        _ if coarser.is_empty() => How::Single,
        _ if coarser.iter().all(is_same) => How::Unchanged,
        None => How::Reference,
        Some(_) => How::Finest,
    };
    let mut limit = Limit {
        value: finest,
        how,
        order: None,
    };
    if let (How::Finest, Some(&[.., h1, h2, h3]), &[.., f1, f2, f3]) = (how, sizes, values)
        && extrapolate
    {
        let (sizes, values) = ([h1, h2, h3], [f1, f2, f3]);
        let near = |p: &f64| (LEAST_ORDER * order..=MOST_ORDER * order).contains(p);
        limit.order = observed_order(sizes, values);
        if let Some(p) = limit.order.filter(near) {
            limit.value = extrapolated(sizes, values, p);
            limit.how = How::Richardson;
        }
    }
    Some(limit)
}

/// |v - reference| / |reference|; 0 if both are 0, `None` if only the reference is 0.
pub fn relative_error(v: f64, reference: f64) -> Option<f64> {
    if v == reference {
        return Some(0.0);
    }
    Some((v - reference).abs() / reference.abs()).filter(|e| e.is_finite())
}

/// Estimated error of each value: the largest of its own error and those of all finer values, so
/// that a coarse value that is near the limit by chance gains nothing. If no order is observed, the
/// error of the finest value is estimated by the last step. Without sizes the error of each value
/// is its own, and that of the reference is 0.
pub fn estimates(values: &[f64], limit: &Limit) -> Vec<Option<f64>> {
    let n = values.len();
    let errors = values.iter().map(|v| relative_error(*v, limit.value));
    let mut errors: Vec<Option<f64>> = errors.collect();
    match limit.how {
        How::Single => errors[n - 1] = None,
        How::Finest => errors[n - 1] = relative_error(values[n - 2], values[n - 1]),
        How::Unchanged | How::Richardson | How::Reference => {}
    }
    // Without sizes nothing says that one value is finer than another.
    let finer = 0..(n - 1) * usize::from(limit.how != How::Reference);
    for i in finer.rev() {
        let both = errors[i].zip(errors[i + 1]);
        errors[i] = both.map(|(own, finer)| own.max(finer));
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample_values(f: impl Fn(f64) -> f64, sizes: &[f64]) -> Vec<f64> {
        sizes.iter().map(|h| f(*h)).collect()
    }

    #[test]
    fn the_order_and_the_limit_of_a_power_are_found_exactly() {
        let halved = [0.4, 0.2, 0.1];
        let uneven = [1.0 / 3.0, 1.0 / 7.0, 1.0 / 15.0];
        for sizes in [halved, uneven] {
            for p in [0.5, 1.0, 2.0, 4.0] {
                let values = sample_values(|h| 1.0 + 2.0 * h.powf(p), &sizes);
                let found = limit(Some(&sizes), &values, p, true).unwrap();
                assert_eq!(found.how, How::Richardson);
                assert!(
                    (found.order.unwrap() / p - 1.0).abs() < 1e-9,
                    "{p}: {found:?}"
                );
                assert!((found.value - 1.0).abs() < 1e-12, "{p}: {found:?}");
            }
        }
    }

    #[test]
    fn errors_are_counted_from_the_limit() {
        let sizes = [0.4, 0.2, 0.1];
        let values = sample_values(|h| 1.0 + 2.0 * h * h, &sizes);
        let limit = limit(Some(&sizes), &values, 2.0, true).unwrap();
        let errors = estimates(&values, &limit);
        for (error, h) in errors.iter().zip(sizes) {
            assert!((error.unwrap() - 2.0 * h * h).abs() < 1e-12);
        }
    }

    #[test]
    fn no_order_is_made_up() {
        let sizes = [0.4, 0.2, 0.1];
        // To and fro; away; far from the order expected.
        for (values, order) in [
            ([1.0, 1.2, 1.1], 2.0),
            ([1.0, 1.1, 1.3], 2.0),
            ([1.64, 1.04, 1.0025], 1.0),
        ] {
            let found = limit(Some(&sizes), &values, order, true).unwrap();
            assert_eq!((found.how, found.value), (How::Finest, values[2]));
        }
        assert_eq!(observed_order([0.1, 0.2, 0.4], [1.0, 2.0, 2.5]), None);
        let power = [1.32, 1.08, 1.02];
        let how = |sizes, extrapolate| limit(sizes, &power, 2.0, extrapolate).unwrap().how;
        assert_eq!(how(Some(&sizes[..]), true), How::Richardson);
        assert_eq!(how(Some(&sizes[..]), false), How::Finest);
        assert_eq!(how(None, true), How::Reference);
        assert_eq!(limit(None, &[], 2.0, true), None);
    }

    #[test]
    fn the_finest_value_is_not_taken_for_exact() {
        let values = [1.3, 1.0];
        let of =
            |sizes: Option<&[f64]>| estimates(&values, &limit(sizes, &values, 2.0, true).unwrap());
        assert!((of(Some(&[0.2, 0.1]))[1].unwrap() - 0.3).abs() < 1e-12);
        assert_eq!(of(None)[1], Some(0.0));
        let single = limit(None, &[5.0], 2.0, true).unwrap();
        assert_eq!(
            (single.how, estimates(&[5.0], &single)),
            (How::Single, vec![None])
        );
    }

    #[test]
    fn a_coarse_value_near_the_limit_by_chance_gains_nothing() {
        let values = [1.001, 1.3, 1.002, 1.0];
        let sizes = [0.8, 0.4, 0.2, 0.1];
        let of = |sizes| estimates(&values, &limit(sizes, &values, 2.0, true).unwrap());
        let errors = of(Some(&sizes[..]));
        assert!((errors[0].unwrap() - 0.3).abs() < 1e-12);
        assert!((errors[2].unwrap() - 0.002).abs() < 1e-12);
        // Values without sizes are compared with the last one, each by itself.
        assert!((of(None)[0].unwrap() - 0.001).abs() < 1e-12);
    }

    #[test]
    fn what_does_not_change_has_no_error_and_no_order() {
        let sizes = [0.4, 0.2, 0.1];
        let values = [450.0, 450.0 + 1e-9, 450.0];
        let found = limit(Some(&sizes), &values, 2.0, true).unwrap();
        assert_eq!(found.how, How::Unchanged);
        assert!(
            estimates(&values, &found)
                .iter()
                .all(|e| e.unwrap() < 1e-10)
        );
        assert_eq!(relative_error(0.0, 0.0), Some(0.0));
        assert_eq!(relative_error(1.0, 0.0), None);
    }
}
