//! Assembly linearised about a static state: pairs that are closed there stick, open ones stay
//! open.
//!
//! With the rows o of K, M and p of the open pairs, the others being held (X = 0),
//!
//! ```text
//! | K_oo    0   | | X_o |   | M_oo   p_o | | X_o'' |   | f_o |
//! |  0    Omega^2| |  q  | + | p_o^T   1  | |  q''  | = | f_q |
//! ```
//!
//! describes vibrations too small to open, close or slide a pair. Its modes diagonalise it,
//! including Rayleigh damping, but for dashpots and the damping ratios of stuck modes.
//!
//! Rows of pairs on springs are free, too, and K_oo has the springs S besides. Rayleigh damping is
//! that of the bodies, C = a K + b M without S. In the modes V it is `a (Omega^2 - V^T S V) + b`, of
//! which the diagonal is kept: what lies beside it couples modes of different frequencies, which
//! changes a lightly damped motion in the second order.

use std::collections::BTreeMap;
use std::sync::Arc;

use faer::{Mat, MatRef, c64};

use super::{HarmonicLoad, Problem};
use crate::damping::{ModalStiffness, Rayleigh};
use crate::reduced::{Dashpots, HarmonicModel, Load, ObservedPoint, ReducedModel};
use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::eigen::{EigenError, Modes, dense};

/// Linear reference, which small vibrations about a static state obey.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct LinearReference {
    /// Squared angular frequencies of its modes, rad2/s2, ascending.
    pub omega2: Vec<f64>,
    /// Number of modes with mass, which come first; the others are motions that follow statically.
    pub with_mass: usize,
    /// Reason why open pairs are held like the others; `None` where they are released.
    pub not_released: Option<String>,
    /// Modes with pairs released; `None` where all pairs stick, and the modes are the stuck ones.
    released: Option<Arc<ReleasedModes>>,
    /// References of the waves round a disc, each about both copies of the sector, by their nodal
    /// diameter.
    waves: BTreeMap<usize, LinearReference>,
}

#[derive(Debug, Clone)]
struct ReleasedModes {
    /// Relative displacements that are free, and ...
    rows: Vec<usize>,
    /// ... the motion of these and of the stuck modes in each mode, of unit modal mass.
    vectors: Mat<f64>,
    /// Stiffness of the bodies alone in each mode, rad2/s2; empty where no row has a spring, and it is
    /// that of the whole.
    bodies_omega2: Vec<f64>,
}

impl LinearReference {
    /// Reference about a state in which the pairs of these numbers are open, and the others stick,
    /// with their springs if any. Where nothing holds the assembly so, or no modes are found,
    /// nothing moves in any pair.
    pub fn new(problem: &Problem, open_pairs: &[usize]) -> Self {
        let mut rows = Vec::new();
        for (pair, law) in problem.laws.iter().enumerate() {
            let springs_n_m = match law.stiffness {
                _ if open_pairs.contains(&pair) => [0.0; 3],
                Some(s) => [s.normal_n_m, s.tangential_n_m, s.tangential_n_m],
                None => continue,
            };
            rows.extend((3 * pair..).zip(springs_n_m));
        }
        let reduced = &problem.reduced;
        let n = reduced.stiffness.nrows();
        let of_both = |rows: &[(usize, f64)]| {
            let second = rows.iter().map(|(row, n_m)| (row + n, *n_m));
            rows.iter().copied().chain(second).collect::<Vec<_>>()
        };
        let mut reference = Self::release_rows(reduced, &rows);
        for (diameter, copies) in reduced.waves.copies() {
            // Where the sector in phase is held as a whole, so is every wave.
            let rows = match reference.not_released {
                None => of_both(&rows),
                Some(_) => Vec::new(),
            };
            let wave = Self::release_rows(copies, &rows);
            reference.waves.insert(*diameter, wave);
        }
        reference
    }

    /// Reference of a model with these rows of X on springs, N/m, and all others held.
    fn release_rows(reduced: &ReducedModel, rows: &[(usize, f64)]) -> Self {
        if rows.is_empty() {
            return Self::held(reduced);
        }
        match modes(reduced, rows) {
            Ok((Modes { omega2, vectors }, with_mass)) => Self {
                released: Some(Arc::new(ReleasedModes {
                    rows: rows.iter().map(|(row, _)| *row).collect(),
                    bodies_omega2: subtract_springs(&omega2, &vectors, rows),
                    vectors,
                })),
                omega2,
                with_mass,
                not_released: None,
                waves: BTreeMap::new(),
            },
            Err(error) => Self {
                not_released: Some(error.to_string()),
                ..Self::held(reduced)
            },
        }
    }

    /// Reference with all pairs stuck.
    pub fn stuck(reduced: &ReducedModel) -> Self {
        let waves = reduced.waves.copies().iter();
        Self {
            waves: waves.map(|(d, copies)| (*d, Self::held(copies))).collect(),
            ..Self::held(reduced)
        }
    }

    /// Reference of one model with all pairs stuck.
    fn held(reduced: &ReducedModel) -> Self {
        Self {
            omega2: reduced.omega2.clone(),
            with_mass: reduced.omega2.len(),
            not_released: None,
            released: None,
            waves: BTreeMap::new(),
        }
    }

    /// Reference of harmonic `k`: itself, or that of both copies of the sector, in which each mode
    /// stands twice.
    pub fn harmonic_reference(&self, reduced: &ReducedModel, k: usize) -> &Self {
        let wave = reduced.waves.wave(k);
        let reference = wave.and_then(|(wave, _)| self.waves.get(&wave.nodal_diameter));
        reference.unwrap_or(self)
    }

    /// Squared angular frequencies of the modes with mass that the first harmonic has, rad2/s2,
    /// ascending: those of its wave where it is one round a disc, each once.
    pub fn omega2_of_first_harmonic(&self, reduced: &ReducedModel) -> Vec<f64> {
        let modes = self.modes_of_first_harmonic(reduced);
        modes.iter().map(|mode| mode.omega2).collect()
    }

    /// The modes of [`LinearReference::omega2_of_first_harmonic`], each with the stiffness that the
    /// bodies have in it.
    pub fn modes_of_first_harmonic(&self, reduced: &ReducedModel) -> Vec<ModalStiffness> {
        let of = self.harmonic_reference(reduced, 1);
        let copies = reduced.harmonic_model(1).copies();
        let mode = |m: usize| ModalStiffness {
            omega2: of.omega2[m],
            bodies_omega2: of.bodies_omega2().get(m).copied().unwrap_or(of.omega2[m]),
        };
        (0..of.with_mass).step_by(copies).map(mode).collect()
    }

    /// Motion of harmonic 1 in one of its modes ([`Self::omega2_of_first_harmonic`]), of unit modal
    /// mass: complex amplitudes X of the relative displacements of `problem`, from which the reference
    /// was made, and those of the stuck modes of the model of that harmonic.
    pub fn first_harmonic_motion(&self, problem: &Problem, mode: usize) -> (Vec<c64>, Vec<c64>) {
        let reduced = &problem.reduced;
        let (of, on) = (
            self.harmonic_reference(reduced, 1),
            reduced.harmonic_model(1),
        );
        let first = mode * on.copies();
        let mut shares = vec![c64::ZERO; of.omega2.len()];
        let wave_model = of.model(on, problem, Rayleigh::NONE);
        let wave = HarmonicModel {
            model: &wave_model,
            ..on
        };
        for (mode, share) in wave.moving_together(first) {
            shares[mode] = share;
        }
        of.motion(on, &shares)
    }

    /// Relative displacements of the pairs in harmonic `k`, complex amplitudes, where `shares` are
    /// those of the modes that the reference has in that harmonic.
    pub(crate) fn displacements(
        &self,
        reduced: &ReducedModel,
        k: usize,
        shares: &[c64],
    ) -> Vec<c64> {
        let of = self.harmonic_reference(reduced, k);
        of.motion(reduced.harmonic_model(k), shares).0
    }

    /// Complex amplitudes X of the relative displacements and those of the stuck modes, from those of
    /// the modes of this reference, which moves by `on`.
    fn motion(&self, on: HarmonicModel<'_>, shares: &[c64]) -> (Vec<c64>, Vec<c64>) {
        let mut x = vec![c64::ZERO; on.unknowns()];
        let Some(released) = &self.released else {
            return (x, shares.to_vec());
        };
        let ReleasedModes { rows, vectors, .. } = &**released;
        let mut q = vec![c64::ZERO; on.model.omega2.len()];
        for (share, mode) in shares.iter().zip(vectors.col_iter()) {
            if *share == c64::ZERO {
                continue;
            }
            let column = mode.try_as_col_major().expect("columns are stored whole");
            let (on_rows, on_modes) = column.as_slice().split_at(rows.len());
            let of_sector = rows
                .iter()
                .zip(on_rows)
                .filter(|(row, _)| **row < on.unknowns());
            of_sector.for_each(|(row, v)| x[*row] += share * *v);
            let both = q.iter_mut().zip(on_modes);
            both.for_each(|(q, v)| *q += share * *v);
        }
        (x, q)
    }

    /// Converts `problem`, from which the reference was made, to its modes alone, without pairs.
    /// Displacements count from the static state. `damping` is that of all stuck modes without a ratio
    /// of their own.
    pub fn problem(&self, problem: &Problem, damping: Rayleigh) -> Problem {
        let reduced = &problem.reduced;
        let harmonic = |excitation: &HarmonicLoad| {
            let of = self.harmonic_reference(reduced, excitation.harmonic);
            HarmonicLoad {
                harmonic: excitation.harmonic,
                cosine: of.project_load(&excitation.cosine),
                sine: of.project_load(&excitation.sine),
                growth: excitation.growth,
            }
        };
        // In modes with pairs released a ratio of a stuck mode couples them.
        let modal_ratios = match &self.released {
            None => problem.modal_ratios.clone(),
            Some(_) => Vec::new(),
        };
        let waves = reduced.waves.map_copies(|diameter, copies| {
            let of = self.waves.get(&diameter).unwrap_or(self);
            of.model(
                HarmonicModel::from_copies(copies, diameter),
                problem,
                damping,
            )
        });
        let on_modes = ReducedModel {
            waves,
            ..self.model(reduced.harmonic_model(0), problem, damping)
        };
        Problem {
            reduced: on_modes.into(),
            laws: Vec::new(),
            excitations: problem.excitations.iter().map(harmonic).collect(),
            modal_ratios,
        }
    }

    /// A model on the modes of its reference alone, without pairs.
    fn model(&self, of: HarmonicModel<'_>, problem: &Problem, damping: Rayleigh) -> ReducedModel {
        let reduced = of.model;
        let observed = |observed: &ObservedPoint| {
            ObservedPoint::new(
                observed.name.clone(),
                Vec::new(),
                self.shares(&observed.on_x, &observed.on_modes),
            )
        };
        let observations = reduced.observations.iter().map(observed);
        let dashpots = match &self.released {
            None => reduced.dashpots.loads(),
            Some(_) => problem.additional_damping(of, damping),
        };
        let dashpots = dashpots
            .iter()
            .map(|(c, weights)| (*c, self.project_load(weights)));
        let dashpots: Vec<(f64, Load)> = dashpots.collect();
        let influenced = reduced.dashpots.influenced();
        let influenced = influenced.iter().map(|weights| self.project_load(weights));
        let influenced: Vec<Load> = influenced.collect();
        let unit_loads = reduced.unit_loads.iter();
        let nothing = |modes| Mat::zeros(0, modes);
        let coupling = nothing(self.omega2.len());
        ReducedModel {
            bodies_omega2: self.bodies_omega2().to_vec(),
            static_load: self.project_load(&reduced.static_load),
            unit_loads: unit_loads.map(|load| self.project_load(load)).collect(),
            observations: observations.collect(),
            dashpots: Dashpots::new(0, self.omega2.len(), &dashpots).with_influenced(&influenced),
            ..ReducedModel::new(nothing(0), nothing(0), coupling, self.omega2.clone())
        }
    }

    /// Stiffness of the bodies alone in each mode, rad2/s2; empty where it is `omega2`.
    fn bodies_omega2(&self) -> &[f64] {
        let released = self.released.as_ref();
        released.map_or(&[], |released| &released.bodies_omega2)
    }

    /// Load on the modes of the reference.
    fn project_load(&self, load: &Load) -> Load {
        Load::new(Vec::new(), self.shares(&load.on_x, &load.on_modes))
    }

    /// Converts weights of the relative displacements and of the stuck modes, for a load or an
    /// observation, to weights of each mode.
    fn shares(&self, on_x: &[f64], on_modes: &[f64]) -> Vec<f64> {
        let Some(released) = &self.released else {
            return on_modes.to_vec();
        };
        let ReleasedModes { rows, vectors, .. } = &**released;
        let on_open = rows.iter().map(|i| on_x[*i]);
        let loads: Vec<f64> = on_open.chain(on_modes.iter().copied()).collect();
        let column = MatRef::from_column_major_slice(&loads, loads.len(), 1);
        let shares = product(vectors.transpose(), column);
        shares.col_as_slice(0).to_vec()
    }
}

/// Squared angular frequencies, rad2/s2, less the stiffness of these rows' springs in each mode, of
/// unit modal mass; empty without springs.
fn subtract_springs(omega2: &[f64], vectors: &Mat<f64>, rows: &[(usize, f64)]) -> Vec<f64> {
    if rows.iter().all(|(_, n_m)| *n_m == 0.0) {
        return Vec::new();
    }
    let of_bodies = |(mode, omega2): (usize, &f64)| {
        let on_rows = vectors.col_as_slice(mode).iter();
        let of_springs = on_rows.zip(rows).map(|(v, (_, n_m))| n_m * v * v);
        (omega2 - of_springs.sum::<f64>()).max(0.0)
    };
    omega2.iter().enumerate().map(of_bodies).collect()
}

/// Modes with these rows of X on springs, N/m, and all others held.
fn modes(reduced: &ReducedModel, rows: &[(usize, f64)]) -> Result<(Modes, usize), EigenError> {
    let free: Vec<usize> = rows.iter().map(|(row, _)| *row).collect();
    let [mut stiffness, mass] = reduced.full_matrices(&free);
    for (i, (_, spring_n_m)) in rows.iter().enumerate() {
        stiffness[(i, i)] += spring_n_m;
    }
    dense::modes_with_massless(stiffness.as_ref(), mass.as_ref())
}
