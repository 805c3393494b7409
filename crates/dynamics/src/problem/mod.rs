//! Conversion of a [`ReducedModel`] to a [`Problem`]: the reduced model with the laws of its pairs
//! and its excitations. It has a dynamic stiffness at any frequency, and a linear reference about a
//! static state (`linear_reference.rs`).
//!
//! [`dynamic_stiffness`] applies the dynamic stiffness in full precision, for residuals.
//! [`inexact`] applies it in single precision, for the linear solves inside of Newton's method.
//! `unforced` has that of a vibration that no force excites. `elimination.rs` eliminates the stuck
//! modes and the forces of dashpots for all of them.
//!
//! The coefficients of Rayleigh damping do not belong to a problem: a ratio of critical refers to a
//! mode of the linear reference, which is known only after the static state
//! ([`dynamic_stiffness::ContactSystem`] has them). Damping ratios of stuck modes do belong to it. Only what is the same whichever solver is used
//! belongs here: no file of this folder evaluates a contact law, or knows eps, samples or time
//! steps.

#[cfg(test)]
pub(crate) mod dovetail72;
pub mod dynamic_stiffness;
mod elimination;
pub mod inexact;
mod linear_reference;
pub(crate) mod unforced;

pub use linear_reference::LinearReference;

use crate::contact::PairLaw;
use crate::damping::{DampingError, Rayleigh};
use crate::excitation::{Excitation, Growth, NamedExcitation};
use crate::reduced::{HarmonicModel, Load, ReducedModel, serialize_whole};
use dovetail_numerics::vector::norm;
use std::sync::Arc;

/// Problem to be solved: a reduced model, the law of each of its pairs, and its excitations. Clones
/// share the reduced model.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Problem {
    /// Matrices on the relative displacements X (n = 3 pairs) and the stuck modes.
    #[serde(serialize_with = "serialize_whole")]
    pub reduced: Arc<ReducedModel>,
    /// Contact law of each pair, n / 3.
    pub laws: Vec<PairLaw>,
    /// Loads by harmonic, ascending. Those of one harmonic that depend alike on the frequency are
    /// added.
    pub excitations: Vec<HarmonicLoad>,
    /// Damping ratios of the first stuck modes, which have these in place of Rayleigh damping; empty
    /// where no mode has a ratio of its own.
    pub modal_ratios: Vec<f64>,
}

impl Problem {
    /// Problem of a reduced model with the contact law of each pair and the excitations of its unit
    /// loads, in their order.
    pub fn new(
        reduced: impl Into<Arc<ReducedModel>>,
        laws: Vec<PairLaw>,
        excitations: &[Excitation],
    ) -> Self {
        let reduced = reduced.into();
        Self {
            laws,
            excitations: excited(excitations, &reduced),
            reduced,
            modal_ratios: Vec::new(),
        }
    }

    /// Problem of a reduced model all of whose pairs follow `law`, excited by `amplitude` times its
    /// first unit load, in phase with the cosine of harmonic 1.
    pub fn uniform(reduced: ReducedModel, law: PairLaw, amplitude: f64) -> Self {
        let laws = vec![law; reduced.pairs()];
        Self::new(reduced, laws, &[Excitation::cosine(amplitude)])
    }

    /// The same problem with two periods of the excitation in one of the motion: its frequency is half
    /// that of the excitation.
    pub(crate) fn over_two_periods(&self) -> Self {
        let mut problem = self.clone();
        for excitation in &mut problem.excitations {
            excitation.harmonic *= 2;
        }
        problem
    }

    /// Problem of a reduced model all of whose pairs follow `law`, under the excitations that are
    /// stored with it, `factor` times each.
    pub fn excited(
        reduced: ReducedModel,
        law: PairLaw,
        excitations: &[NamedExcitation],
        factor: f64,
    ) -> Self {
        let excitation = |named: &NamedExcitation| Excitation {
            amplitude: factor * named.amplitude,
            ..named.into()
        };
        let laws = vec![law; reduced.pairs()];
        let excitations: Vec<Excitation> = excitations.iter().map(excitation).collect();
        Self::new(reduced, laws, &excitations)
    }

    /// Reduced model, to be changed. Problems that share it keep it as it is.
    pub fn reduced_mut(&mut self) -> &mut ReducedModel {
        Arc::make_mut(&mut self.reduced)
    }

    /// Problem whose first stuck modes have these damping ratios in place of Rayleigh damping.
    ///
    /// # Errors
    /// [`DampingError::FewerModes`] where the model has fewer stuck modes.
    pub fn with_modal_ratios(mut self, ratios: &[f64]) -> Result<Self, DampingError> {
        let available = self.reduced.stuck_modes;
        if ratios.len() > available {
            return Err(DampingError::FewerModes {
                given: ratios.len(),
                available,
            });
        }
        self.modal_ratios = ratios.to_vec();
        Ok(self)
    }

    /// Damping of a stuck mode of the model of a harmonic where that of all others is `damping`: C =
    /// 2 zeta w_m M on the mode, where it has a ratio zeta of its own, and (a s_m + b) M, where s_m is
    /// the stiffness of the bodies alone in it ([`ReducedModel::bodies_omega2`]).
    pub(crate) fn mode_damping(
        &self,
        of: HarmonicModel<'_>,
        damping: Rayleigh,
        mode: usize,
    ) -> Rayleigh {
        if let Some(ratio) = self.modal_ratios.get(of.mode_of_sector(mode)) {
            return Rayleigh::mass_proportional(2.0 * ratio * of.model.omega2[mode].sqrt());
        }
        match of.model.bodies_omega2.get(mode) {
            Some(of_bodies) => {
                Rayleigh::mass_proportional(damping.stiffness_s * of_bodies + damping.mass_per_s)
            }
            None => damping,
        }
    }

    /// Number of stuck modes of the model of a harmonic, the first ones, whose damping is not that of
    /// all.
    pub(crate) fn modes_with_damping(&self, of: HarmonicModel<'_>) -> usize {
        let with_ratios = self.modal_ratios.len() * of.copies();
        with_ratios.max(of.model.bodies_omega2.len())
    }

    /// Terms of the damping matrix of the model of a harmonic besides `damping`: coefficients c, N s/m,
    /// and weights v as loads of `c v v^T`. They are the dashpots and, for each stuck mode m with a ratio zeta of its own,
    /// `(2 zeta w_m - b) v v^T` and `-a w_m^2 e e^T`, with v the row of M and e that of the identity
    /// that belong to the mode.
    pub(crate) fn additional_damping(
        &self,
        of: HarmonicModel<'_>,
        damping: Rayleigh,
    ) -> Vec<(f64, Load)> {
        let reduced = of.model;
        let mut terms = reduced.dashpots.loads();
        for m in 0..self.modal_ratios.len() * of.copies() {
            let mode_damping = self.mode_damping(of, damping, m);
            let mut on_mode = Load::zeros(reduced.stiffness.nrows(), reduced.omega2.len());
            on_mode.on_modes[m] = 1.0;
            let of_mass = Load {
                on_x: reduced.coupling.col_as_slice(m).to_vec(),
                ..on_mode.clone()
            };
            terms.push((mode_damping.mass_per_s - damping.mass_per_s, of_mass));
            terms.push((-damping.stiffness_s * reduced.omega2[m], on_mode));
        }
        terms
    }

    /// Returns `true` if another problem has the same static state: the same reduced model and laws.
    /// The excitations may differ.
    pub fn is_at_rest_like(&self, other: &Self) -> bool {
        let (own, others) = (&self.reduced, &other.reduced);
        self.laws == other.laws
            && own.static_load == others.static_load
            && own.static_parts == others.static_parts
            && own.omega2 == others.omega2
            && own.stiffness == others.stiffness
    }

    /// Norm of the forces that press the pairs steadily, N: the static load on X, and the own
    /// stiffness of each pair times its interference.
    pub(crate) fn steady_force_n(&self) -> f64 {
        let diagonal = self.reduced.diagonal_stiffness();
        let interference = self.laws.iter().zip(diagonal.iter().step_by(3));
        let interference: Vec<f64> = interference
            .map(|(law, diagonal)| diagonal * law.gap_m.min(0.0))
            .collect();
        norm(&self.reduced.static_load.on_x).hypot(norm(&interference))
    }

    /// Highest harmonic of the excitations; 0 without any.
    pub fn highest_excited(&self) -> usize {
        let excited = self.excitations.iter().map(|e| e.harmonic);
        excited.max().unwrap_or(0)
    }
}

/// Loads by harmonic, ascending, and by their dependence on the frequency; those alike are added.
fn excited(forces: &[Excitation], reduced: &ReducedModel) -> Vec<HarmonicLoad> {
    let of = |f: &Excitation| (f.harmonic, f.growth);
    let mut kinds: Vec<(usize, Growth)> = forces.iter().map(of).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let both = |kind: (usize, Growth)| {
        let model = reduced.harmonic_model(kind.0);
        let of_kind = forces.iter().enumerate().filter(|(_, f)| of(f) == kind);
        let mut sum: Option<[Load; 2]> = None;
        for (number, force) in of_kind {
            let Some(unit) = model.unit_load(number) else {
                continue;
            };
            let [cosine, sine] = sum.get_or_insert_with(|| {
                let n = model.model.stiffness.nrows();
                [0, 1].map(|_| Load::zeros(n, model.model.omega2.len()))
            });
            let (s, c) = force.phase_rad.sin_cos();
            let shares = [force.amplitude * c, force.amplitude * s];
            unit.add_to([cosine, sine], shares);
        }
        let [cosine, sine] = sum?;
        Some(HarmonicLoad {
            harmonic: kind.0,
            cosine,
            sine,
            growth: kind.1,
        })
    };
    kinds.into_iter().filter_map(both).collect()
}

/// Harmonic load `cosine cos(k w t) + sine sin(k w t)`, k = `harmonic`, times
/// `HarmonicLoad::factor`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct HarmonicLoad {
    /// Multiple k of the frequency of the response.
    pub harmonic: usize,
    /// Load in phase with the cosine, on the model of the harmonic
    /// ([`harmonic_model`](ReducedModel::harmonic_model)).
    pub cosine: Load,
    /// Load in phase with the sine.
    pub sine: Load,
    /// Dependence on the frequency.
    pub growth: Growth,
}

impl HarmonicLoad {
    /// Load of constant size in phase with the cosine of a harmonic.
    pub fn cosine(harmonic: usize, cosine: Load) -> Self {
        Self {
            harmonic,
            sine: Load::zeros(cosine.on_x.len(), cosine.on_modes.len()),
            cosine,
            growth: Growth::Constant,
        }
    }

    /// Factor on the load where the frequency of the response is `omega_rad_s`.
    pub(crate) fn factor(&self, omega_rad_s: f64) -> f64 {
        match self.growth {
            Growth::Constant => 1.0,
            Growth::Squared => (self.harmonic as f64 * omega_rad_s).powi(2),
        }
    }

    /// Derivative of [`HarmonicLoad::factor`] with respect to `omega_rad_s`.
    pub(crate) fn factor_slope(&self, omega_rad_s: f64) -> f64 {
        match self.growth {
            Growth::Constant => 0.0,
            Growth::Squared => 2.0 * (self.harmonic as f64).powi(2) * omega_rad_s,
        }
    }
}

/// Indices of the tangential ones of `n` unknowns, 3 per pair, ascending.
pub(crate) fn tangential(n: usize) -> Vec<usize> {
    (0..n).filter(|i| i % 3 != 0).collect()
}
