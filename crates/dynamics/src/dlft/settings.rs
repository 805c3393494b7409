//! Settings of the solution of the harmonic balance.

pub use dovetail_numerics::nonlinear::NewtonOptions;
use serde::Serialize;
use strum::{Display, EnumString, VariantNames};

/// Number of harmonics and samples that each frequency is resolved with.
///
/// ```
/// use dovetail_dynamics::dlft::settings::Resolution;
///
/// assert_eq!(Resolution::default(), Resolution::Accuracy(0.01));
/// assert_eq!(Resolution::fixed(3, 128).most_harmonics(), 3);
/// assert_eq!(Resolution::least_samples(31), 128);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Resolution {
    /// A given number of harmonics of the motion, and of samples of a period in the alternating
    /// frequency-time step.
    Fixed {
        /// Harmonics besides the mean.
        harmonics: usize,
        /// Samples of a period.
        samples: usize,
    },
    /// Relative accuracy of the observed amplitudes: as few harmonics as keep their estimated error
    /// below this.
    Accuracy(f64),
}

impl Resolution {
    /// A given number of harmonics besides the mean, and of samples of a period.
    pub const fn fixed(harmonics: usize, samples: usize) -> Self {
        Self::Fixed { harmonics, samples }
    }

    /// Accuracy of a description that names neither harmonics nor an accuracy.
    pub const ACCURACY: f64 = 0.01;
    /// Samples of a period with given harmonics, unless so many harmonics need more.
    pub const SAMPLES: usize = 128;
    /// Most samples of a period.
    pub const MOST_SAMPLES: usize = 1 << 20;
    /// Most harmonics; a larger number counts as a typing error.
    pub const MOST_HARMONICS: usize = 1000;
    /// Relative residual at which a frequency with given harmonics has converged.
    pub const TOLERANCE: f64 = 1e-8;

    /// Most harmonics kept for an accuracy. With more, the errors of the time evaluation of a pair
    /// (its parameter eps, the way to the periodic state) outweigh what the harmonics add.
    pub const MOST_ADAPTED: usize = 31;

    /// Fewest samples of a period that carry so many harmonics: four in a period of the first
    /// harmonic left out. With fewer the contact forces of the highest harmonics alias, and no
    /// motion is found where pairs slip and open (31 harmonics: none with 64, 80 or 96 samples, one
    /// with 128).
    pub fn least_samples(harmonics: usize) -> usize {
        4 * (harmonics + 1)
    }

    /// Default relative residual at which a frequency has converged. For an accuracy, it is far
    /// below the truncation error.
    pub fn tolerance(self) -> f64 {
        match self {
            Self::Fixed { .. } => Self::TOLERANCE,
            Self::Accuracy(accuracy) => (1e-4 * accuracy).clamp(1e-10, 1e-6),
        }
    }

    /// Most harmonics that any frequency may have.
    pub fn most_harmonics(self) -> usize {
        match self {
            Self::Fixed { harmonics, .. } => harmonics,
            Self::Accuracy(_) => Self::MOST_ADAPTED,
        }
    }
}

impl Default for Resolution {
    fn default() -> Self {
        Self::Accuracy(Self::ACCURACY)
    }
}

/// Choice of the free parameter of DLFT. Its words are those of scenes and of Python.
///
/// ```
/// use dovetail_dynamics::dlft::settings::EpsChoice;
///
/// assert_eq!("spectral_radius".parse(), Ok(EpsChoice::SpectralRadius));
/// assert!("paper".parse::<EpsChoice>().is_err());
/// ```
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Display, EnumString, VariantNames, Serialize,
)]
#[strum(serialize_all = "snake_case")]
pub enum EpsChoice {
    /// Median of the dynamic stiffness over the harmonics, per pair: one value for N, one for T.
    #[default]
    Dynamic,
    /// Diagonal of the static stiffness, per pair: one value for N, one for T.
    Pair,
    /// Spectral radius of the static stiffness, for all pairs (the paper's choice).
    SpectralRadius,
}

/// Motions of a response whose stability is judged. Scenes and Python use the same words.
///
/// ```
/// use dovetail_dynamics::dlft::settings::StabilityScope;
///
/// assert_eq!("every_point".parse(), Ok(StabilityScope::EveryPoint));
/// assert_eq!(StabilityScope::default().to_string(), "peaks");
/// ```
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Display, EnumString, VariantNames, Serialize,
)]
#[strum(serialize_all = "snake_case")]
pub enum StabilityScope {
    /// Peaks, turning points and the ends of the range; every motion of a model with few pairs.
    #[default]
    Peaks,
    /// Every motion.
    EveryPoint,
    /// No motion.
    None,
}

/// Method that solves the balance of a frequency. Its words are those of scenes and of Python.
///
/// ```
/// use dovetail_dynamics::dlft::settings::Solver;
///
/// assert_eq!("powell".parse(), Ok(Solver::Powell));
/// assert_eq!(Solver::default().to_string(), "newton_krylov");
/// ```
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Display, EnumString, VariantNames, Serialize,
)]
#[strum(serialize_all = "snake_case")]
pub enum Solver {
    /// Newton's method with GMRES for its linear systems.
    #[default]
    NewtonKrylov,
    /// Powell's hybrid method (dogleg), the paper's solver.
    Powell,
}
