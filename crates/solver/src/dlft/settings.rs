//! What the solution of the harmonic balance may be told.

/// What each frequency is resolved with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// Harmonics of the motion, and samples of a period in the alternating frequency-time step.
    Fixed {
        /// Harmonics besides the mean.
        harmonics: usize,
        /// Samples of a period.
        samples: usize,
    },
    /// As few as keep the estimated error of the observed amplitudes below this fraction of them.
    Accuracy(f64),
}

impl Resolution {
    /// Most harmonics kept for an accuracy: with more, what the time evaluation of a pair leaves open (its parameter eps, the
    /// way to the periodic state) weighs more than what the harmonics add.
    pub const MOST_ADAPTED: usize = 31;

    /// The fewest samples of a period that carry so many harmonics: four in a period of the first one left out. With fewer the contact
    /// forces of the highest harmonics alias, and no motion is found where pairs slip and open (31 harmonics: none with 64, 80 or 96
    /// samples, one with 128).
    pub fn least_samples(harmonics: usize) -> usize {
        4 * (harmonics + 1)
    }

    /// Relative residual at which a frequency has converged, where nothing else is asked for. What is left at an accuracy is far
    /// below what is cut off.
    pub fn tolerance(self) -> f64 {
        match self {
            Self::Fixed { .. } => 1e-8,
            Self::Accuracy(accuracy) => (1e-4 * accuracy).clamp(1e-10, 1e-6),
        }
    }

    /// The most harmonics any frequency may have.
    pub fn most_harmonics(self) -> usize {
        match self {
            Self::Fixed { harmonics, .. } => harmonics,
            Self::Accuracy(_) => Self::MOST_ADAPTED,
        }
    }
}

/// The free parameter of DLFT.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EpsChoice {
    /// Per pair: the median of the dynamic stiffness over the harmonics, one value for N, one for T.
    Dynamic,
    /// Per pair: diagonal of the static stiffness, one value for N, one for T.
    Pair,
    /// Spectral radius of the static stiffness, for all pairs (the paper's choice).
    SpectralRadius,
}

/// What solves the balance of a frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// Newton's method with GMRES for its linear systems.
    NewtonKrylov,
    /// Powell's hybrid method (dogleg), the paper's solver.
    Powell,
}
