//! Dynamic stiffness of a vibration that no force excites: the extended periodic motion of M. Krack,
//! Nonlinear modal analysis of nonconservative systems: extension of the periodic motion concept,
//! Comput. Struct. 154 (2015) 59-71.
//!
//! With `C := a K + (b - 2 w zeta) M` the damping ratio zeta is what keeps the vibration up, and at
//! harmonic h
//!
//! `s = 1 + i h w a`, `z = (h w)^2 - i h w b + 2 i h w^2 zeta`.
//!
//! Condensed on the pairs, the stuck mode m that is tracked has a pole at harmonic 1, `d_m = 0` and
//! X = 0 for every amplitude. Its amplitude q at harmonic 1 therefore stays, real and positive:
//!
//! `Lambda_1 X_1 + lambda_1 = z p_m q`, `(s w_m^2 - z) q = z p_m . X_1`,
//!
//! with mode m left out of the sum in `Lambda_1`.

use super::dynamic_stiffness::{Coefficients, ContactSystem, HarmonicStiffness};
use faer::c64;

/// Vibration without a force at one frequency and damping ratio.
#[derive(Clone, Copy)]
pub struct Unforced<'a> {
    /// System with its own damping.
    pub system: &'a ContactSystem<'a>,
    /// Number of the stuck mode that is tracked, from 0.
    pub mode: usize,
    /// Angular frequency of harmonic 1, rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio zeta of the vibration, its whole damping.
    pub damping_ratio: f64,
}

/// s and z of one harmonic, or their derivatives.
#[derive(Clone, Copy)]
struct Factors {
    s: c64,
    z: c64,
}

impl<'a> Unforced<'a> {
    /// Lambda of the mean and of the harmonics up to `harmonics`, without the tracked mode in
    /// harmonic 1.
    pub fn stiffness(&self, harmonics: usize) -> HarmonicStiffness<'a> {
        self.of_harmonics(harmonics, |k| {
            let Factors { s, z } = self.factors(k);
            (
                Factors { s, z },
                Box::new(move |w2| -(z * z) / (s * w2 - z)),
            )
        })
    }

    /// Derivatives of Lambda with respect to the angular frequency and to the damping ratio. What
    /// they write to the mean means nothing.
    pub fn stiffness_slopes(&self, harmonics: usize) -> [HarmonicStiffness<'a>; 2] {
        [0, 1].map(|unknown| {
            self.of_harmonics(harmonics, |k| {
                let Factors { s, z } = self.factors(k);
                let slope = self.slopes(k)[unknown];
                let of_mode = move |w2: f64| {
                    let (d, dd) = (s * w2 - z, slope.s * w2 - slope.z);
                    -(z * (slope.z * d * 2.0 - z * dd)) / (d * d)
                };
                (slope, Box::new(of_mode))
            })
        })
    }

    /// Force of the tracked mode on the pairs at harmonic 1, `z p_m q`, N.
    pub fn drive(&self, q: f64) -> Vec<c64> {
        self.coupled(self.factors(1.0).z * q)
    }

    /// Derivatives of [`Unforced::drive`] with respect to the angular frequency and to the damping
    /// ratio.
    pub fn drive_slopes(&self, q: f64) -> [Vec<c64>; 2] {
        self.slopes(1.0).map(|slope| self.coupled(slope.z * q))
    }

    /// Left side of the equation of the tracked mode, `(s - z / w_m^2) - z p_m . X_1 / (w_m^2 q)`.
    pub fn equation(&self, x: &[c64], q: f64) -> c64 {
        self.left_side(self.factors(1.0), x, q)
    }

    /// Derivatives of [`Unforced::equation`] with respect to the angular frequency and to the
    /// damping ratio.
    pub fn equation_slopes(&self, x: &[c64], q: f64) -> [c64; 2] {
        self.slopes(1.0).map(|slope| self.left_side(slope, x, q))
    }

    /// Derivatives of [`Unforced::equation`] with respect to the complex amplitudes `X_1`.
    pub fn equation_row(&self, q: f64) -> Vec<c64> {
        self.coupled(-self.factors(1.0).z / (self.omega2() * q))
    }

    /// Complex amplitudes of the stuck modes at harmonic `k`, from those of the pairs, where that of
    /// the tracked mode at harmonic 1 is `q`.
    pub fn modal_amplitudes(&self, k: usize, x: &[c64], q: f64) -> Vec<c64> {
        let Factors { s, z } = self.factors(k as f64);
        let omega2 = self.system.problem.reduced.omega2.iter().enumerate();
        omega2
            .map(|(m, w2)| match (k, m == self.mode) {
                (1, true) => c64::new(q, 0.0),
                _ => z * self.on_mode(m, x) / (s * *w2 - z),
            })
            .collect()
    }

    /// Product `p_m . X` of a stuck mode.
    fn on_mode(&self, mode: usize, x: &[c64]) -> c64 {
        let coupling = self.system.problem.reduced.coupling.col_as_slice(mode);
        x.iter().zip(coupling).map(|(x, p)| x * *p).sum()
    }

    /// Coupling of the tracked mode times a factor.
    fn coupled(&self, factor: c64) -> Vec<c64> {
        let coupling = self.system.problem.reduced.coupling.col_as_slice(self.mode);
        coupling.iter().map(|p| factor * *p).collect()
    }

    fn left_side(&self, Factors { s, z }: Factors, x: &[c64], q: f64) -> c64 {
        let w2 = self.omega2();
        s - z / w2 - z * self.on_mode(self.mode, x) / (w2 * q)
    }

    /// Squared angular frequency of the tracked stuck mode.
    fn omega2(&self) -> f64 {
        self.system.problem.reduced.omega2[self.mode]
    }

    fn factors(&self, k: f64) -> Factors {
        let (w, damping) = (self.omega_rad_s, self.system.damping);
        Factors {
            s: c64::new(1.0, k * w * damping.stiffness_s),
            z: c64::new(
                (k * w).powi(2),
                k * w * (2.0 * w * self.damping_ratio - damping.mass_per_s),
            ),
        }
    }

    /// Derivatives of s and z at harmonic `k` with respect to the angular frequency and to the
    /// damping ratio.
    fn slopes(&self, k: f64) -> [Factors; 2] {
        let (w, damping) = (self.omega_rad_s, self.system.damping);
        let over_omega = Factors {
            s: c64::new(0.0, k * damping.stiffness_s),
            z: c64::new(
                2.0 * k * k * w,
                k * (4.0 * w * self.damping_ratio - damping.mass_per_s),
            ),
        };
        let over_ratio = Factors {
            s: c64::new(0.0, 0.0),
            z: c64::new(0.0, 2.0 * k * w * w),
        };
        [over_omega, over_ratio]
    }

    /// Combination of K, M and p, of which `of` gives the factors of each harmonic, and that of each
    /// mode by its squared angular frequency.
    fn of_harmonics(
        &self,
        harmonics: usize,
        of: impl Fn(f64) -> (Factors, Box<dyn Fn(f64) -> c64>),
    ) -> HarmonicStiffness<'a> {
        let omega2 = &self.system.problem.reduced.omega2;
        self.system.of_harmonics(self.omega_rad_s, harmonics, |k| {
            let (Factors { s, z }, of_mode) = of(k);
            let left_out = |m: usize| k == 1.0 && m == self.mode;
            let modes = omega2.iter().enumerate().map(|(m, w2)| match left_out(m) {
                true => c64::new(0.0, 0.0),
                false => of_mode(*w2),
            });
            Coefficients {
                s,
                z,
                modes: modes.collect(),
            }
        })
    }
}
