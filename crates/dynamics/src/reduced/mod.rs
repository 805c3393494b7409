//! Bodies joined by their contacts as the solver sees them: matrices on the relative displacements X
//! of the contact pairs and on the amplitudes q of modes of the stuck assembly (X = 0).
//!
//! Finite elements and a reduction make a [`ReducedModel`], or another program does. For a disc of
//! equal sectors it has models of the [`waves`] in the disc, on which the air may act
//! ([`influence`]), or the model of all sectors (`all_sectors`).

pub(crate) mod all_sectors;
pub mod influence;
pub mod waves;

use std::sync::Arc;

use faer::{Mat, MatRef, c64};
use serde::{Deserialize, Serialize, Serializer};
use strum::{EnumString, VariantNames};

use dovetail_numerics::dense::parallel::cholesky;
use dovetail_numerics::dense::quadratic_forms;
use dovetail_numerics::sparse::stored;
use dovetail_numerics::vector::dot;

pub(crate) use all_sectors::AllSectors;
pub use influence::{Influence, InfluenceCoefficient};
pub use waves::{DiscExcitation, HarmonicModel, Wave, Waves};

/// A motion is free if it has less than this fraction of the stiffness beside it, which is then its
/// rounding.
pub(crate) const FREE: f64 = 1e-10;

/// Assembly on the relative displacements X of the pairs (n = 3 pairs unknowns, per pair N, t1, t2)
/// and on the m modes of the stuck assembly (X = 0).
///
/// With q the modal amplitudes: `K X + M X'' + p q'' + lambda = F`, `q'' + w^2 q + p^T X'' = fm`
/// (plus Rayleigh damping `a K + b M` and the [`Dashpots`]). The contact laws and the amplitudes of the excitations
/// belong to the [`Problem`](crate::problem::Problem).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ReducedModel {
    /// Static stiffness on X, N/m, n x n.
    #[serde(with = "stored::matrix")]
    pub stiffness: Mat<f64>,
    /// Mass on X with the rest following statically, kg, n x n.
    #[serde(with = "stored::matrix")]
    pub mass: Mat<f64>,
    /// Mass coupling p of X to the stuck modes and residual vectors (mass-normalised), n x m.
    #[serde(with = "stored::matrix")]
    pub coupling: Mat<f64>,
    /// Squared angular frequencies, rad2/s2, m: of the stuck modes, ascending, then of the residual
    /// vectors.
    pub omega2: Vec<f64>,
    /// Stiffness of the bodies alone in each mode, without springs of contacts, for a unit modal mass,
    /// rad2/s2: Rayleigh damping goes with it. Empty where it is `omega2`, as in every model of bodies;
    /// a [linear reference](crate::problem::LinearReference) with springs has its own, which is not kept.
    #[serde(skip)]
    pub bodies_omega2: Vec<f64>,
    /// Number of entries of `omega2` that belong to stuck modes; residual vectors follow.
    pub stuck_modes: usize,
    /// Steady load on X and on the modes.
    pub static_load: Load,
    /// Parts of the steady load on X. With their working multiples they add up to `static_load`;
    /// empty where the parts are not known.
    pub static_parts: Vec<StaticPart>,
    /// One unit of each excitation.
    pub unit_loads: Vec<Load>,
    /// Observed displacements and strains.
    pub observations: Vec<ObservedPoint>,
    /// Dashpots between the bodies, or from them to ground, and the modes on which the air acts.
    pub dashpots: Dashpots,
    /// Waves that the harmonics make round a disc, with the models that they move by. The mean, and
    /// harmonics in phase, move by this one.
    pub waves: Waves,
}

/// Writes a model with the two fields that it is kept without.
pub(crate) fn serialize_whole<S: Serializer>(
    model: &Arc<ReducedModel>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let besides = (&model.bodies_omega2, &model.waves.influence);
    (&**model, besides).serialize(serializer)
}

impl ReducedModel {
    /// Model without loads and observations, all of whose modes are stuck modes: stiffness, N/m,
    /// and mass, kg, n x n, the coupling, n x m, and `omega2`, rad2/s2, m.
    pub fn new(stiffness: Mat<f64>, mass: Mat<f64>, coupling: Mat<f64>, omega2: Vec<f64>) -> Self {
        let (n, m) = (coupling.nrows(), coupling.ncols());
        Self {
            stiffness,
            mass,
            coupling,
            omega2,
            bodies_omega2: Vec::new(),
            stuck_modes: m,
            static_load: Load::zeros(n, m),
            static_parts: Vec::new(),
            unit_loads: Vec::new(),
            observations: Vec::new(),
            dashpots: Dashpots::none(n, m),
            waves: Waves::default(),
        }
    }

    /// Stiffness and mass on these relative displacements and on all stuck modes, which are dense. The
    /// other displacements are held.
    pub(crate) fn full_matrices(&self, free: &[usize]) -> [Mat<f64>; 2] {
        let (n, size) = (free.len(), free.len() + self.omega2.len());
        let stiffness = Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
            (true, true) => self.stiffness[(free[i], free[j])],
            (false, false) if i == j => self.omega2[i - n],
            _ => 0.0,
        });
        let mass = Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
            (true, true) => self.mass[(free[i], free[j])],
            (true, false) => self.coupling[(free[i], j - n)],
            (false, true) => self.coupling[(free[j], i - n)],
            (false, false) => f64::from(u8::from(i == j)),
        });
        [stiffness, mass]
    }

    /// Model of bodies that do not move while all pairs stick: no modes, otherwise like
    /// [`ReducedModel::new`].
    pub fn from_pair_matrices(stiffness: Mat<f64>, mass: Mat<f64>) -> Self {
        let coupling = Mat::zeros(stiffness.nrows(), 0);
        Self::new(stiffness, mass, coupling, Vec::new())
    }

    /// The same model under this steady load. A negative normal force presses a pair together.
    #[must_use]
    pub fn static_load(mut self, load: impl Into<Load>) -> Self {
        self.static_load = load.into().resized_to_modes(self.omega2.len());
        self
    }

    /// The same model with one more unit load, which an excitation multiplies.
    #[must_use]
    pub fn unit_load(mut self, load: impl Into<Load>) -> Self {
        self.unit_loads
            .push(load.into().resized_to_modes(self.omega2.len()));
        self
    }

    /// The same model with one more observed displacement, the sum of the displacements times
    /// these weights.
    ///
    /// ```
    /// use dovetail_dynamics::prelude::*;
    ///
    /// // One pair: the displacements along its normal and along two tangents.
    /// let identity = Mat::identity(3, 3);
    /// let model = ReducedModel::from_pair_matrices(identity.clone(), identity)
    ///     .static_load([-1.0, 0.0, 0.0])
    ///     .unit_load([0.0, 1.0, 0.0])
    ///     .observe("mass", [0.0, 1.0, 0.0]);
    /// assert_eq!((model.pairs(), model.observations.len()), (1, 1));
    /// ```
    #[must_use]
    pub fn observe(mut self, name: impl Into<String>, weights: impl Into<Load>) -> Self {
        let Load { on_x, on_modes } = weights.into().resized_to_modes(self.omega2.len());
        self.observations
            .push(ObservedPoint::new(name, on_x, on_modes));
        self
    }

    /// Number of contact pairs.
    pub fn pairs(&self) -> usize {
        self.stiffness.nrows() / 3
    }

    /// Squared angular frequencies of the stuck modes, rad2/s2, ascending, without the residual
    /// vectors.
    pub fn stuck_omega2(&self) -> &[f64] {
        &self.omega2[..self.stuck_modes]
    }

    /// Multiples of the parts of the steady load in the steady load, in the order of
    /// `static_parts`; a single 1, of the whole, where the parts are not known.
    pub fn working_multiples(&self) -> Vec<f64> {
        if self.static_parts.is_empty() {
            return vec![1.0];
        }
        self.static_parts.iter().map(|part| part.working).collect()
    }

    /// Forces on X, N, n, of these multiples of the parts of the steady load, which stand in the
    /// order of [`working_multiples`](Self::working_multiples). A part without a multiple has that.
    pub fn steady_on_x(&self, multiples: &[f64]) -> Vec<f64> {
        let mut multiples = multiples.iter().copied();
        if self.static_parts.is_empty() {
            let multiple = multiples.next().unwrap_or(1.0);
            return self.static_load.on_x.iter().map(|f| multiple * f).collect();
        }
        let mut sum = vec![0.0; self.stiffness.nrows()];
        for part in &self.static_parts {
            let multiple = multiples.next().unwrap_or(part.working);
            for (sum, f) in sum.iter_mut().zip(&part.on_x) {
                *sum += multiple * f;
            }
        }
        sum
    }

    /// Own static stiffness of each relative displacement, N/m, n: K_NN of a pair, and the mean of
    /// its two tangential diagonal entries for both. If nothing elastic opposes a direction, the stiffness of
    /// the other one of the pair stands for it, else the largest of all pairs, and 1 in a model without
    /// stiffness.
    pub fn diagonal_stiffness(&self) -> Vec<f64> {
        let diagonal = |i: usize| self.stiffness[(i, i)];
        let both = |p: usize| {
            [
                diagonal(3 * p),
                0.5 * (diagonal(3 * p + 1) + diagonal(3 * p + 2)),
            ]
        };
        let largest = (0..self.pairs()).flat_map(both).fold(0.0, f64::max);
        let first = |of: [f64; 3]| of.into_iter().find(|k| *k > 0.0).unwrap_or(1.0);
        (0..self.pairs())
            .flat_map(|p| {
                let [normal, tangential] = both(p);
                let along = first([tangential, normal, largest]);
                [first([normal, tangential, largest]), along, along]
            })
            .collect()
    }

    /// Returns `true` if supports and springs alone hold the bodies: with all pairs open K is
    /// positive definite, and each pivot of its Cholesky factorisation exceeds the rounding of its
    /// diagonal.
    pub(crate) fn is_held_without_contact(&self) -> bool {
        let Some(factor) = cholesky(self.stiffness.clone()) else {
            return false;
        };
        (0..factor.nrows()).all(|i| factor[(i, i)].powi(2) > FREE * self.stiffness[(i, i)])
    }

    /// Returns `true` if supports and springs do not hold a motion of the pairs, n entries: the work of
    /// the elastic forces is below the rounding of what one of its entries does alone. With the row of
    /// that entry as the last one, the last pivot of the Cholesky factor of K is as small.
    pub(crate) fn is_free(&self, motion: &[f64]) -> bool {
        let entries = motion.iter().enumerate();
        let terms = entries.map(|(i, v)| self.stiffness[(i, i)] * v * v);
        self.elastic_product(motion) < FREE * terms.fold(0.0, f64::max)
    }

    /// Product `w^T K w` of a motion of the pairs, n entries.
    pub fn elastic_product(&self, motion: &[f64]) -> f64 {
        let motion = MatRef::from_column_major_slice(motion, motion.len(), 1);
        quadratic_forms(self.stiffness.as_ref(), motion)
            .iter()
            .sum()
    }

    /// Coupling p of X to the modes, n x m, and the weights of the dashpots, and of the modes on which
    /// the air acts, on X, n x d.
    pub(crate) fn coupling_and_dashpots(&self) -> [&Mat<f64>; 2] {
        [&self.coupling, &self.dashpots.on_x]
    }

    /// Products `p^T X`, m, and the displacements of the dashpots by X alone, d.
    pub(crate) fn moved_by(&self, x: &[c64]) -> [Vec<c64>; 2] {
        let parts = [0, 1].map(|part| {
            let part = x.iter().map(|x| if part == 0 { x.re } else { x.im });
            part.collect::<Vec<f64>>()
        });
        // Harmonics that nothing moves are frequent.
        let moves = parts.each_ref().map(|part| part.iter().any(|v| *v != 0.0));
        self.coupling_and_dashpots().map(|columns| {
            let mut sums = vec![c64::ZERO; columns.ncols()];
            for (j, sum) in sums.iter_mut().enumerate() {
                let of = |part: usize| match moves[part] {
                    true => dot(&parts[part], &columns.col_as_slice(j)[..x.len()]),
                    false => 0.0,
                };
                *sum = c64::new(of(0), of(1));
            }
            sums
        })
    }

    /// Adds to `load` the forces on the first unknowns of X of amplitudes of the coupling to the
    /// modes, m, and of the dashpots, d.
    pub(crate) fn add_on_pairs(&self, amplitudes: &[Vec<c64>; 2], load: &mut [c64]) {
        for (columns, amplitudes) in self.coupling_and_dashpots().into_iter().zip(amplitudes) {
            for (column, amplitude) in columns.col_iter().zip(amplitudes) {
                for (f, v) in load.iter_mut().zip(column.iter()) {
                    *f += amplitude * *v;
                }
            }
        }
    }

    /// Model with its `modes` lowest stuck modes only.
    pub fn with_modes(mut self, modes: usize) -> Self {
        let count = modes.min(self.omega2.len());
        self.coupling = self.coupling.subcols(0, count).to_owned();
        self.omega2.truncate(count);
        self.stuck_modes = self.stuck_modes.min(count);
        self.static_load.on_modes.truncate(count);
        for load in &mut self.unit_loads {
            load.on_modes.truncate(count);
        }
        for observed in &mut self.observations {
            observed.on_modes.truncate(count);
        }
        let dashpots = &mut self.dashpots;
        dashpots.on_modes = dashpots.on_modes.subrows(0, count).to_owned();
        self.waves = self
            .waves
            .map_copies(|_, copies| copies.clone().with_modes(2 * modes));
        self
    }
}

/// Part of the steady load on X that a load path can change by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StaticPart {
    /// Cause of the part, which says what its multiple is.
    pub cause: SteadyCause,
    /// Forces on X at a multiple of 1, n, with those that the bodies hand on with all pairs stuck; N
    /// over the unit of the multiple.
    pub on_x: Vec<f64>,
    /// Multiple of the part in the steady load.
    pub working: f64,
}

/// Load on X (n) and on the stuck modes (m).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Forces on X, N, n.
    pub on_x: Vec<f64>,
    /// Forces on the modes, N per root of the modal mass, m.
    pub on_modes: Vec<f64>,
}

impl Load {
    /// Load of these forces on X, n, and on the modes, m.
    pub const fn new(on_x: Vec<f64>, on_modes: Vec<f64>) -> Self {
        Self { on_x, on_modes }
    }

    /// No force on n displacements and m modes.
    pub fn zeros(n: usize, m: usize) -> Self {
        Self::new(vec![0.0; n], vec![0.0; m])
    }

    /// This load on so many modes, of which those that it does not have are not loaded.
    fn resized_to_modes(mut self, modes: usize) -> Self {
        self.on_modes.resize(modes, 0.0);
        self
    }

    /// Adds a multiple of another load.
    pub(crate) fn add(&mut self, factor: f64, other: &Self) {
        let into = self.on_x.iter_mut().chain(&mut self.on_modes);
        for (into, f) in into.zip(other.on_x.iter().chain(&other.on_modes)) {
            *into += factor * f;
        }
    }
}

/// Forces on X, N, n, and none on the modes.
impl From<Vec<f64>> for Load {
    fn from(on_x: Vec<f64>) -> Self {
        Self::new(on_x, Vec::new())
    }
}

/// Forces on X, N, n, and none on the modes.
impl<const N: usize> From<[f64; N]> for Load {
    fn from(on_x: [f64; N]) -> Self {
        on_x.to_vec().into()
    }
}

/// Observed displacement or strain `on_x . X + on_modes . q`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservedPoint {
    /// Name in the results.
    pub name: String,
    /// What is observed.
    pub quantity: ObservedQuantity,
    /// Weights of the relative displacements, n; of a strain, over m.
    pub on_x: Vec<f64>,
    /// Weights of the modal amplitudes, m.
    pub on_modes: Vec<f64>,
}

impl ObservedPoint {
    /// Displacement of these weights, n of X and m of the modal amplitudes.
    pub fn new(name: impl Into<String>, on_x: Vec<f64>, on_modes: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            quantity: ObservedQuantity::Displacement,
            on_x,
            on_modes,
        }
    }

    /// Complex amplitude of the quantity, from those of X and of the modes.
    pub fn amplitude(&self, x: &[c64], q: &[c64]) -> c64 {
        let on_x = x.iter().zip(&self.on_x);
        let on_modes = q.iter().zip(&self.on_modes);
        on_x.chain(on_modes).map(|(v, on)| v * *on).sum()
    }

    /// This point, whose weights give a quantity of this kind.
    pub fn with_quantity(self, quantity: ObservedQuantity) -> Self {
        Self { quantity, ..self }
    }
}

/// Dashpots on the coordinates of a [`ReducedModel`]. Dashpot j acts on the displacement
/// `x_j . X + y_j . q`, and adds `c_j (x_j, y_j) (x_j, y_j)^T` to the damping matrix. Behind them
/// stand the amplitudes `x_j . X + y_j . q` of the modes on which the air acts
/// ([`influence`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dashpots {
    /// Coefficients c of the dashpots, N s/m.
    pub damping_n_s_m: Vec<f64>,
    /// Weights x of the relative displacements, one column for each dashpot and each mode on which the
    /// air acts, n x d.
    #[serde(with = "stored::matrix")]
    pub on_x: Mat<f64>,
    /// Weights y of the modal amplitudes, m x d.
    #[serde(with = "stored::matrix")]
    pub on_modes: Mat<f64>,
}

impl Dashpots {
    /// No dashpot on n displacements and m modes.
    pub fn none(n: usize, m: usize) -> Self {
        Self {
            damping_n_s_m: Vec::new(),
            on_x: Mat::zeros(n, 0),
            on_modes: Mat::zeros(m, 0),
        }
    }

    /// Dashpots with these coefficients, N s/m, on n displacements and m modes. Each acts on the
    /// displacement whose weights are those of a load.
    pub fn new(n: usize, m: usize, dashpots: &[(f64, Load)]) -> Self {
        let count = dashpots.len();
        Self {
            damping_n_s_m: dashpots.iter().map(|(damping, _)| *damping).collect(),
            on_x: Mat::from_fn(n, count, |i, j| dashpots[j].1.on_x[i]),
            on_modes: Mat::from_fn(m, count, |i, j| dashpots[j].1.on_modes[i]),
        }
    }

    /// The same dashpots, and behind them modes on which the air acts. The amplitude of a mode has the
    /// weights of a load.
    pub fn with_influenced(self, modes: &[Load]) -> Self {
        let behind = |own: &Mat<f64>, of: &dyn Fn(&Load) -> &[f64]| {
            Mat::from_fn(own.nrows(), own.ncols() + modes.len(), |i, j| {
                match j.checked_sub(own.ncols()) {
                    None => own[(i, j)],
                    Some(j) => of(&modes[j])[i],
                }
            })
        };
        Self {
            on_x: behind(&self.on_x, &|load| &load.on_x),
            on_modes: behind(&self.on_modes, &|load| &load.on_modes),
            damping_n_s_m: self.damping_n_s_m,
        }
    }

    /// Weights as a load of a dashpot, or of a mode on which the air acts, by its number.
    fn weights(&self, j: usize) -> Load {
        let [on_x, on_modes] = [&self.on_x, &self.on_modes].map(|a| a.col_as_slice(j).to_vec());
        Load::new(on_x, on_modes)
    }

    /// Coefficients, N s/m, and weights as loads of all dashpots.
    pub fn loads(&self) -> Vec<(f64, Load)> {
        let terms = self.damping_n_s_m.iter().enumerate();
        terms
            .map(|(j, damping)| (*damping, self.weights(j)))
            .collect()
    }

    /// Weights as loads of the modes on which the air acts.
    pub fn influenced(&self) -> Vec<Load> {
        let modes = self.damping_n_s_m.len()..self.count();
        modes.map(|j| self.weights(j)).collect()
    }

    /// Number of dashpots and of modes on which the air acts, d.
    pub(crate) fn count(&self) -> usize {
        self.on_x.ncols()
    }
}

/// Cause of a part of the steady load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SteadyCause {
    /// Rotation: the part is the centrifugal load at 1 rad/s, N s2/rad2, and its multiple the square
    /// of the speed, rad2/s2.
    Rotation,
    /// Steady load of the description with this number, counted from 0. Its multiple is 1 in the
    /// steady load.
    Load(usize),
    /// Loads that come with matrices of another program. Their multiple is 1 in the steady load.
    Matrices,
}

/// Quantity that is observed.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, EnumString, VariantNames,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ObservedQuantity {
    /// Displacement along a direction, m.
    #[default]
    Displacement,
    /// Strain of a surface along a direction, m/m: what a strain gauge measures.
    Strain,
}

impl ObservedQuantity {
    /// Unit in words.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement => "m",
            Self::Strain => "m/m",
        }
    }

    /// Last word of the names of columns that have this quantity: `<name>_amplitude_m`.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Displacement => "m",
            Self::Strain => "strain",
        }
    }
}
