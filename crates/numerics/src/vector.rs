//! Operations on vectors, to the same bits on every machine.

use pulp::Arch;

/// Euclidean norm.
pub fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

/// Inner product, in eight running sums.
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    Arch::new().dispatch(|| eight_sums(x, y))
}

/// As [`dot`], inlined where it is called.
#[inline(always)]
pub(crate) fn eight_sums(x: &[f64], y: &[f64]) -> f64 {
    // Eight running sums: vectorisable, and the same order whatever the machine.
    let mut sums = [0.0; 8];
    let (xc, yc) = (x.chunks_exact(8), y.chunks_exact(8));
    let tail: f64 = xc
        .remainder()
        .iter()
        .zip(yc.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in xc.zip(yc) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + tail
}

/// Computes y += a x.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    Arch::new().dispatch(|| y.iter_mut().zip(x).for_each(|(yi, xi)| *yi += a * xi));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_that_are_no_multiple_of_eight_are_summed_whole() {
        for n in [0, 1, 7, 8, 9, 19] {
            let x: Vec<f64> = (1..=n).map(f64::from).collect();
            let mut y = vec![2.0; x.len()];
            assert_eq!(dot(&x, &y), f64::from(n * (n + 1)));
            axpy(3.0, &x, &mut y);
            assert!(y.iter().zip(&x).all(|(y, x)| *y == 2.0 + 3.0 * x));
        }
        assert_eq!(norm(&[3.0, 0.0, 4.0]), 5.0);
    }
}
