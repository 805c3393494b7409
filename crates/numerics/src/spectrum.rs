//! Order of the coefficients of a periodic motion.
//!
//! A real signal is `a_0 + sum_k a_k cos(k t) + b_k sin(k t)`, k = 1 to H: 2H+1 coefficients, the
//! mean, then cosine and sine of each harmonic. A vector of n such signals is 2H+1 blocks of n, one
//! for each coefficient.

/// Number of coefficients of a signal with so many harmonics, 2H+1.
pub const fn blocks(harmonics: usize) -> usize {
    2 * harmonics + 1
}

/// Block of the cosine of harmonic k, k from 1.
pub const fn cosine(k: usize) -> usize {
    2 * k - 1
}

/// Block of the sine of harmonic k, k from 1.
pub const fn sine(k: usize) -> usize {
    2 * k
}

/// Coefficients of n signals: 2H+1 blocks of n.
#[derive(Debug, Clone, Copy)]
pub struct Spectrum<'a> {
    values: &'a [f64],
    harmonics: usize,
}

impl<'a> Spectrum<'a> {
    /// Spectrum of `values`, which are 2H+1 blocks of one length.
    pub fn new(values: &'a [f64], harmonics: usize) -> Self {
        debug_assert_eq!(values.len() % blocks(harmonics), 0, "blocks of one length");
        Self { values, harmonics }
    }

    /// Number of harmonics besides the mean, H.
    pub fn harmonics(self) -> usize {
        self.harmonics
    }

    /// Number of signals, n.
    pub fn signals(self) -> usize {
        self.values.len() / blocks(self.harmonics)
    }

    /// Block of all signals, counted from 0, the mean.
    pub fn block(self, block: usize) -> &'a [f64] {
        let n = self.signals();
        &self.values[block * n..(block + 1) * n]
    }

    /// Means of all signals.
    pub fn mean(self) -> &'a [f64] {
        self.block(0)
    }

    /// Cosines of harmonic k of all signals, k from 1.
    pub fn cosine(self, k: usize) -> &'a [f64] {
        self.block(cosine(k))
    }

    /// Sines of harmonic k of all signals, k from 1.
    pub fn sine(self, k: usize) -> &'a [f64] {
        self.block(sine(k))
    }

    /// The 2H+1 coefficients of one signal.
    pub fn signal_coefficients(self, signal: usize) -> impl Iterator<Item = f64> + 'a {
        let n = self.signals();
        self.values.iter().skip(signal).step_by(n.max(1)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_stand_mean_first_and_each_has_all_signals() {
        // Two signals with two harmonics.
        let values: Vec<f64> = (0..10).map(f64::from).collect();
        let spectrum = Spectrum::new(&values, 2);
        assert_eq!((spectrum.signals(), spectrum.harmonics()), (2, 2));
        assert_eq!(spectrum.mean(), [0.0, 1.0]);
        assert_eq!(spectrum.cosine(1), [2.0, 3.0]);
        assert_eq!(spectrum.sine(2), [8.0, 9.0]);
        let second: Vec<f64> = spectrum.signal_coefficients(1).collect();
        assert_eq!(second, [1.0, 3.0, 5.0, 7.0, 9.0]);
        assert_eq!(Spectrum::new(&[], 3).mean(), [0.0; 0]);
    }
}
