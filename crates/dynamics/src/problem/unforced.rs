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
//! with mode m left out of the sum in `Lambda_1`. With a damping ratio of its own the mode has its
//! own s and z, to which zeta adds the same. Dashpots and the air between blades couple it to the
//! others: both equations then have what they hand on (`elimination.rs`).
//!
//! In a wave round a disc both modes of the same frequency stay
//! ([`moving_together`](HarmonicModel::moving_together)). With the amplitudes e that they have where
//! mode m has 1, `p_m q` in the first equation is `P e q`; the second one is that of mode m, and that
//! of the other mode says the same.

use super::dynamic_stiffness::{ContactSystem, HarmonicStiffness, s_and_z};
use super::elimination::{Elimination, Factors, KeptCoupling};
use crate::damping::Rayleigh;
use crate::reduced::HarmonicModel;
use faer::c64;

/// Newton iterations allowed to a mode without pairs.
const MOST_ITERATIONS: usize = 30;
/// Changes of its frequency and of its damping ratio that are rounding.
const ROUNDING: f64 = 1e-12;

/// Vibration without a force at one frequency and damping ratio.
#[derive(Clone, Copy)]
pub(crate) struct Unforced<'a> {
    /// System with its own damping.
    pub system: &'a ContactSystem,
    /// Stuck mode that is tracked, and what moves with it, with their amplitudes: modes of the model of
    /// harmonic 1. Empty where a relative displacement is tracked: no mode is left out then, and there
    /// is no equation of one.
    pub tracked: &'a [(usize, c64)],
    /// Angular frequency of harmonic 1, rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio zeta of the vibration, its whole damping.
    pub damping_ratio: f64,
}

impl<'a> Unforced<'a> {
    /// Lambda of the mean and of the harmonics up to `harmonics`, without the tracked mode in
    /// harmonic 1.
    pub(crate) fn stiffness(&self, harmonics: usize) -> HarmonicStiffness {
        let of = |k: usize| self.eliminated(k).coefficients();
        self.system
            .harmonic_stiffness(self.omega_rad_s, harmonics, of)
    }

    /// Angular frequency and damping ratio at which the tracked mode vibrates without pairs, from those
    /// given: the equation of the mode, solved by Newton's method. `None` where it has no solution
    /// near by.
    pub(crate) fn pairless(mut self) -> Option<Self> {
        for _ in 0..MOST_ITERATIONS {
            let left = self.equation(&[], 1.0);
            let [by_omega, by_ratio] = self.equation_slopes(&[], 1.0);
            let determinant = by_omega.re * by_ratio.im - by_omega.im * by_ratio.re;
            let by = [
                (left.re * by_ratio.im - left.im * by_ratio.re) / determinant,
                (by_omega.re * left.im - by_omega.im * left.re) / determinant,
            ];
            self.omega_rad_s -= by[0];
            self.damping_ratio -= by[1];
            if !(self.omega_rad_s > 0.0 && self.damping_ratio.is_finite()) {
                return None;
            }
            if (by[0] / self.omega_rad_s).hypot(by[1]) < ROUNDING {
                return Some(self);
            }
        }
        None
    }

    /// Derivatives of Lambda with respect to the angular frequency and to the damping ratio. What
    /// they write to the mean means nothing.
    pub(crate) fn stiffness_slopes(&self, harmonics: usize) -> [HarmonicStiffness; 2] {
        [0, 1].map(|unknown| {
            let of = |k: usize| self.eliminated(k).slopes(&self.slopes(k)[unknown], 1.0);
            self.system
                .harmonic_stiffness(self.omega_rad_s, harmonics, of)
        })
    }

    /// Force of the tracked mode on the pairs at harmonic 1, `z p_m q`, N.
    pub(crate) fn drive(&self, q: f64) -> Vec<c64> {
        if self.tracked.is_empty() {
            return vec![c64::ZERO; self.first_harmonic().unknowns()];
        }
        let [_, z] = self.factors(1).mode_factors(self.mode());
        self.driven(z, self.eliminated(1).kept_coupling(), q)
    }

    /// Derivatives of [`Unforced::drive`] with respect to the angular frequency and to the damping
    /// ratio.
    pub(crate) fn drive_slopes(&self, q: f64) -> [Vec<c64>; 2] {
        if self.tracked.is_empty() {
            return [0, 1].map(|_| self.drive(q));
        }
        self.slopes(1).map(|slope| {
            let of_dashpots = self.eliminated(1).kept_coupling_slope(&slope);
            let [_, dz] = slope.mode_factors(self.mode());
            self.driven(dz, of_dashpots, q)
        })
    }

    /// Left side of the equation of the tracked mode, `(s - z / w_m^2) - z p_m . X_1 / (w_m^2 q)`.
    pub(crate) fn equation(&self, x: &[c64], q: f64) -> c64 {
        self.left_side(&self.factors(1), self.eliminated(1).kept_coupling(), x, q)
    }

    /// Derivatives of [`Unforced::equation`] with respect to the angular frequency and to the
    /// damping ratio.
    pub(crate) fn equation_slopes(&self, x: &[c64], q: f64) -> [c64; 2] {
        self.slopes(1).map(|slope| {
            let of_dashpots = self.eliminated(1).kept_coupling_slope(&slope);
            self.left_side(&slope, of_dashpots, x, q)
        })
    }

    /// Derivatives of [`Unforced::equation`] with respect to the complex amplitudes `X_1`.
    pub(crate) fn equation_row(&self, q: f64) -> Vec<c64> {
        let (of, scale) = (self.first_harmonic(), self.omega2() * q);
        let [_, z] = self.factors(1).mode_factors(self.mode());
        let coupling = of.model.coupling.col_as_slice(self.mode());
        let mut row: Vec<c64> = coupling.iter().map(|p| -z / scale * *p).collect();
        if let Some(KeptCoupling { row: handed_on, .. }) = self.eliminated(1).kept_coupling() {
            let handed_on = scaled(handed_on, -1.0 / scale);
            of.model.add_on_pairs(&handed_on, &mut row);
        }
        of.narrowed(&row)
    }

    /// Complex amplitudes of the stuck modes at harmonic `k`, from those of the pairs, where that of
    /// the tracked mode at harmonic 1 is `q`.
    pub(crate) fn modal_amplitudes(&self, k: usize, x: &[c64], q: f64) -> Vec<c64> {
        let eliminated = self.eliminated(k);
        let [px, moved] = self.system.problem.reduced.harmonic_model(k).moved_by(x);
        let of_mode = |(m, px): (usize, &c64)| eliminated.carried(m, *px);
        let mut amplitudes: Vec<c64> = px.iter().enumerate().map(of_mode).collect();
        let no_load = vec![c64::ZERO; px.len()];
        let kept = c64::new(q, 0.0);
        eliminated.subtract_dashpots([&px, &moved], (&no_load, kept), &mut amplitudes);
        if k == 1 {
            for (mode, share) in self.tracked {
                amplitudes[*mode] = share * q;
            }
        }
        amplitudes
    }

    /// Model by which harmonic 1 moves.
    fn first_harmonic(&self) -> HarmonicModel<'a> {
        self.system.problem.reduced.harmonic_model(1)
    }

    /// Number of the stuck mode that is tracked, from 0.
    fn mode(&self) -> usize {
        self.tracked[0].0
    }

    /// Equations of harmonic `k` without the stuck modes, except for the tracked ones in harmonic 1.
    fn eliminated(&self, k: usize) -> Elimination<'a> {
        let kept = if k == 1 { self.tracked } else { &[] };
        let of = self.system.problem.reduced.harmonic_model(k);
        Elimination::new(of.model, self.factors(k), kept)
    }

    /// Forces on X of the amplitude `q` of the tracked mode: its coupling times a factor, and what the
    /// dashpots hand on.
    fn driven(&self, factor: c64, of_dashpots: Option<KeptCoupling>, q: f64) -> Vec<c64> {
        let of = self.first_harmonic();
        let mut on_pairs = vec![c64::ZERO; of.unknowns()];
        for (mode, share) in self.tracked {
            let coupling = of.model.coupling.col_as_slice(*mode);
            for (f, p) in on_pairs.iter_mut().zip(coupling) {
                *f += factor * q * share * *p;
            }
        }
        if let Some(KeptCoupling { drive, .. }) = of_dashpots {
            of.add_on_pairs(&scaled(drive, q), &mut on_pairs);
        }
        on_pairs
    }

    fn left_side(
        &self,
        factors: &Factors,
        of_dashpots: Option<KeptCoupling>,
        x: &[c64],
        q: f64,
    ) -> c64 {
        let (w2, of) = (self.omega2(), self.first_harmonic());
        let [s, z] = factors.mode_factors(self.mode());
        let coupling = of.model.coupling.col_as_slice(self.mode());
        let widened = of.widened(x);
        let px: c64 = widened.iter().zip(coupling).map(|(x, p)| x * *p).sum();
        let mut left = s - z / w2 - z * px / (w2 * q);
        if let Some(KeptCoupling { row, own, .. }) = of_dashpots {
            left += own / w2;
            for (amplitudes, moved) in row.iter().zip(of.moved_by(x)) {
                let held: c64 = amplitudes.iter().zip(&moved).map(|(a, b)| a * b).sum();
                left -= held / (w2 * q);
            }
        }
        left
    }

    /// Squared angular frequency of the tracked stuck mode.
    fn omega2(&self) -> f64 {
        self.first_harmonic().model.omega2[self.mode()]
    }

    /// Factors at harmonic `k`: those of the system, whose damping has `-2 w zeta M` besides.
    fn factors(&self, k: usize) -> Factors {
        let (w, at) = (self.omega_rad_s, k as f64 * self.omega_rad_s);
        let of = |damping: Rayleigh| {
            let mass_per_s = damping.mass_per_s - 2.0 * w * self.damping_ratio;
            s_and_z(
                Rayleigh {
                    mass_per_s,
                    ..damping
                },
                at,
            )
        };
        self.system.factors_by(k, of, c64::new(0.0, at))
    }

    /// Derivatives of the factors at harmonic `k` with respect to the angular frequency and to the
    /// damping ratio.
    fn slopes(&self, harmonic: usize) -> [Factors; 2] {
        let (w, k) = (self.omega_rad_s, harmonic as f64);
        let over_omega = |damping: Rayleigh| {
            let of_ratio = 4.0 * w * self.damping_ratio;
            (
                c64::new(0.0, k * damping.stiffness_s),
                c64::new(2.0 * k * k * w, k * (of_ratio - damping.mass_per_s)),
            )
        };
        let over_ratio = |_| (c64::ZERO, c64::new(0.0, 2.0 * k * w * w));
        [
            self.system
                .factors_by(harmonic, over_omega, c64::new(0.0, k)),
            self.system.factors_by(harmonic, over_ratio, c64::ZERO),
        ]
    }
}

fn scaled(amplitudes: [Vec<c64>; 2], by: f64) -> [Vec<c64>; 2] {
    amplitudes.map(|part| part.iter().map(|v| v * by).collect())
}
