//! Waves that the harmonics of a motion make round a disc, and the reduced model of each.
//!
//! An excitation of engine order E is fixed in space. Harmonic k of sector j of a disc of N sectors
//! then moves as that of the first sector does, times `exp(i k E 2 pi j / N)`, in axes that turn with
//! the sector. Its mean, and the harmonics for which k E is a multiple of N, have all sectors in
//! phase. Each other one is a wave of a nodal diameter, whose reduced model is that of two copies of
//! the sector, for the real and the imaginary part of the motion.
//!
//! With the complex amplitudes X of the pairs of the first sector, those of both copies are
//!
//! ```text
//! Y = (X, -i X)     where the next sector is ahead: the wave runs against the counting of sectors
//! Y = (X,  i X)     where it runs in the direction in which sectors are counted
//! ```
//!
//! and the forces on the first sector are the first half of those on both. The matrices of the
//! copies are real, so that all that holds for a sector whose neighbours move in phase holds for
//! both copies together.

use std::borrow::Cow;
use std::collections::BTreeMap;

use faer::{Mat, c64};
use serde::{Deserialize, Serialize};

use super::influence::Influence;
use super::{Load, ObservedPoint, ReducedModel};

/// Largest nodal diameter of a disc with this number of sectors. Larger ones have the waves of smaller ones.
pub const fn largest_nodal_diameter(sectors: usize) -> usize {
    sectors / 2
}

/// Nodal diameter, from 0 to [`largest_nodal_diameter`], that a load with so many waves round a disc
/// excites, such as one that an engine order brings about: all sectors see the same as from that
/// one, or from the wave that runs the other way.
pub const fn nodal_diameter_of(waves: usize, sectors: usize) -> usize {
    let rest = waves % sectors;
    let other = sectors - rest;
    if rest < other { rest } else { other }
}

/// Waves that harmonics make round a disc. By default there are none, and neighbours move in phase.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Waves {
    /// `None` where nothing repeats.
    excitation: Option<DiscExcitation>,
    /// Forces that the air returns to the blades. A model is kept without them, because they need no
    /// reduction.
    #[serde(skip)]
    pub(super) influence: Influence,
    /// Model of both copies for each nodal diameter above 0.
    copies: BTreeMap<usize, ReducedModel>,
}

/// Excitation of an engine order round a disc, which says what wave each harmonic is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiscExcitation {
    /// Number of sectors of the disc.
    pub sectors: usize,
    /// Engine order of the first harmonic.
    pub engine_order: usize,
}

/// Wave of one harmonic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Nodal diameter, above 0.
    pub nodal_diameter: usize,
    /// Sign of the imaginary unit in Y = (X, sign i X).
    pub sign: f64,
}

impl DiscExcitation {
    /// Wave of harmonic `k`; `None` where neighbours move in phase.
    pub fn wave(self, k: usize) -> Option<Wave> {
        let nodal_diameter = nodal_diameter_of(k * self.engine_order, self.sectors);
        let rest = (k * self.engine_order) % self.sectors;
        let sign = if rest == nodal_diameter { -1.0 } else { 1.0 };
        (nodal_diameter > 0).then_some(Wave {
            nodal_diameter,
            sign,
        })
    }

    /// Number of sectors that move differently: from this number on each moves as one before.
    pub fn different_sectors(self) -> usize {
        let (mut a, mut b) = (self.sectors, self.engine_order);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        self.sectors / a
    }

    /// Nodal diameter of harmonic `k`: above 0 where the wave runs in the direction in which sectors are
    /// counted, seen from the disc, and where it is half the number of sectors; below 0 where it runs
    /// the other way.
    pub fn signed_nodal_diameter(self, k: usize) -> i64 {
        let rest = (k * self.engine_order) % self.sectors;
        // The next sector is ahead by rest / N of a period.
        if 2 * rest < self.sectors {
            -(rest as i64)
        } else {
            (self.sectors - rest) as i64
        }
    }

    /// Nodal diameters above 0 that the harmonics up to this one have, ascending.
    pub fn nodal_diameters(self, harmonics: usize) -> Vec<usize> {
        let waves = (1..=harmonics).filter_map(|k| self.wave(k));
        let mut diameters: Vec<usize> = waves.map(|wave| wave.nodal_diameter).collect();
        diameters.sort_unstable();
        diameters.dedup();
        diameters
    }
}

impl Wave {
    /// Cosine and sine parts of Y, 2 n each, from those of the sector, n each.
    pub fn widened_parts(self, [cosine, sine]: [&[f64]; 2]) -> [Vec<f64>; 2] {
        // X = cosine - i sine, and i X = sine + i cosine.
        let with = |own: &[f64], other: &[f64], sign: f64| {
            let second = other.iter().map(|v| sign * v);
            own.iter().copied().chain(second).collect()
        };
        [
            with(cosine, sine, self.sign),
            with(sine, cosine, -self.sign),
        ]
    }
}

impl Waves {
    /// Waves with the reduced model of both copies for each nodal diameter. A harmonic whose nodal
    /// diameter has none is taken as one in phase.
    pub fn new(excitation: DiscExcitation, copies: BTreeMap<usize, ReducedModel>) -> Self {
        Self {
            excitation: Some(excitation),
            influence: Influence::default(),
            copies,
        }
    }

    /// The same waves with forces that the air returns to the blades.
    pub fn with_influence(self, influence: Influence) -> Self {
        Self { influence, ..self }
    }

    /// Excitation that makes the waves; `None` where nothing repeats.
    pub fn excitation(&self) -> Option<DiscExcitation> {
        self.excitation
    }

    /// Wave of harmonic `k`, with the model of both copies; `None` where neighbours move in phase.
    pub(crate) fn wave(&self, k: usize) -> Option<(Wave, &ReducedModel)> {
        let wave = self.excitation?.wave(k)?;
        Some((wave, self.copies.get(&wave.nodal_diameter)?))
    }

    /// Matrix of the aerodynamic influence in harmonic `k`; `None` where it has none.
    fn influence(&self, k: usize) -> Option<&Mat<c64>> {
        let excitation = self.excitation.filter(|_| k > 0)?;
        self.influence
            .wave_matrix(excitation.signed_nodal_diameter(k))
    }

    /// Model of both copies for each nodal diameter, without the waves.
    pub fn into_copies(self) -> BTreeMap<usize, ReducedModel> {
        self.copies
    }

    /// Model of both copies for each nodal diameter.
    pub(crate) fn copies(&self) -> &BTreeMap<usize, ReducedModel> {
        &self.copies
    }

    /// The same waves with other models of both copies.
    pub(crate) fn map_copies(&self, of: impl Fn(usize, &ReducedModel) -> ReducedModel) -> Self {
        let copies = self.copies.iter();
        Self {
            copies: copies.map(|(d, model)| (*d, of(*d, model))).collect(),
            excitation: self.excitation,
            influence: self.influence.clone(),
        }
    }
}

/// Reduced model of one harmonic: that of the sector, or that of two copies of it.
#[derive(Debug, Clone, Copy)]
pub struct HarmonicModel<'a> {
    /// Model of N unknowns on X and M modes: those of the sector, or twice as many.
    pub model: &'a ReducedModel,
    /// Wave of the harmonic; `None` where neighbours move in phase, and Y is X.
    pub wave: Option<Wave>,
    /// Matrix A of the aerodynamic influence on the modes of each copy, r x r; `None` where there is
    /// none.
    pub influence: Option<&'a Mat<c64>>,
}

impl ReducedModel {
    /// Model by which harmonic `k` moves.
    pub fn harmonic_model(&self, k: usize) -> HarmonicModel<'_> {
        let influence = self.waves.influence(k);
        match self.waves.wave(k) {
            Some((wave, model)) => HarmonicModel {
                model,
                wave: Some(wave),
                influence,
            },
            None => HarmonicModel {
                model: self,
                wave: None,
                influence,
            },
        }
    }

    /// Number of modal amplitudes that the model of each harmonic has room for.
    pub(crate) fn most_modes(&self) -> usize {
        let copies = self.waves.copies.values().map(|model| model.omega2.len());
        copies.fold(self.omega2.len(), usize::max)
    }
}

impl<'a> HarmonicModel<'a> {
    /// Model of both copies of a sector, for the waves of a nodal diameter that run against the
    /// direction in which sectors are counted, without aerodynamic influence.
    pub(crate) fn from_copies(model: &'a ReducedModel, nodal_diameter: usize) -> Self {
        let wave = Wave {
            nodal_diameter,
            sign: -1.0,
        };
        Self {
            model,
            wave: Some(wave),
            influence: None,
        }
    }

    /// Coefficients k of the forces `-k v` that the air returns to the modes on which it acts, on those
    /// of the first copy and then on those of the second one; `None` without influence.
    pub(crate) fn influence_on_copies(&self) -> Option<Mat<c64>> {
        let influence = self.influence?;
        let r = influence.nrows();
        let on_both = |i: usize, j: usize| match i / r == j / r {
            true => -influence[(i % r, j % r)],
            false => c64::ZERO,
        };
        Some(Mat::from_fn(r * self.copies(), r * self.copies(), on_both))
    }

    /// Number of copies of the sector that the model has.
    pub fn copies(&self) -> usize {
        1 + usize::from(self.wave.is_some())
    }

    /// Sign of the imaginary unit in Y; `None` where Y is X.
    fn sign(&self) -> Option<f64> {
        self.wave.map(|wave| wave.sign)
    }

    /// Number of unknowns of the sector on X, n.
    pub(crate) fn unknowns(&self) -> usize {
        self.model.stiffness.nrows() / self.copies()
    }

    /// Observed displacements and strains, those of the first copy.
    pub fn observations(&self) -> &'a [ObservedPoint] {
        let observations = &self.model.observations;
        &observations[..observations.len() / self.copies()]
    }

    /// One unit of an excitation, by its number; `None` where there is no such one.
    pub fn unit_load(&self, number: usize) -> Option<UnitLoad<'a>> {
        let loads = &self.model.unit_loads;
        let second = match self.sign() {
            None => None,
            Some(sign) => Some((sign, loads.get(number + loads.len() / 2)?)),
        };
        Some(UnitLoad {
            first: loads.get(number)?,
            second,
        })
    }

    /// Complex amplitudes Y of all unknowns of the model, N, from those of the sector, n.
    pub fn widened<'x>(&self, x: &'x [c64]) -> Cow<'x, [c64]> {
        let Some(sign) = self.sign() else {
            return Cow::Borrowed(x);
        };
        let second = x.iter().map(|x| c64::new(-sign * x.im, sign * x.re));
        Cow::Owned(x.iter().copied().chain(second).collect())
    }

    /// Cosine and sine parts of Y, N each, from those of the sector, n each.
    pub(crate) fn widened_parts(&self, [cosine, sine]: [&[f64]; 2]) -> [Vec<f64>; 2] {
        match self.wave {
            None => [cosine.to_vec(), sine.to_vec()],
            Some(wave) => wave.widened_parts([cosine, sine]),
        }
    }

    /// Coefficients of X, n, in a sum with these coefficients of Y, N.
    pub(crate) fn narrowed(&self, of_all: &[c64]) -> Vec<c64> {
        let n = of_all.len() / self.copies();
        let mut narrowed = of_all[..n].to_vec();
        if let Some(sign) = self.sign() {
            for (v, second) in narrowed.iter_mut().zip(&of_all[n..]) {
                *v += c64::new(-sign * second.im, sign * second.re);
            }
        }
        narrowed
    }

    /// Entry of the sector's complex matrix, n x n, that acts on X as the first n rows of a matrix of
    /// the model, N x N, do on Y.
    pub(crate) fn entry(&self, matrix: &Mat<f64>, i: usize, j: usize) -> c64 {
        let imaginary = self.sign().map_or(0.0, |sign| {
            sign * matrix[(i, j + matrix.ncols() / self.copies())]
        });
        c64::new(matrix[(i, j)], imaginary)
    }

    /// Matrix of the sector with a column for each column of Q: the rows of the first copy, n, from
    /// which forces on X come.
    pub(crate) fn rows_of_forces(&self, columns: &Mat<f64>) -> Mat<c64> {
        let n = columns.nrows() / self.copies();
        Mat::from_fn(n, columns.ncols(), |i, j| c64::new(columns[(i, j)], 0.0))
    }

    /// Like [`HarmonicModel::rows_of_forces`], for the rows that X acts on Q by: those of Y narrowed
    /// to X.
    pub(crate) fn rows_of_motions(&self, columns: &Mat<f64>) -> Mat<c64> {
        let n = columns.nrows() / self.copies();
        Mat::from_fn(n, columns.ncols(), |i, j| {
            let imaginary = self.sign().map_or(0.0, |sign| sign * columns[(i + n, j)]);
            c64::new(columns[(i, j)], imaginary)
        })
    }

    /// Products `p^T Y`, M, and the displacements of the dashpots by X alone.
    pub(crate) fn moved_by(&self, x: &[c64]) -> [Vec<c64>; 2] {
        self.model.moved_by(&self.widened(x))
    }

    /// Adds to `load`, n, the forces on X of amplitudes of the coupling to the modes, M, and of the
    /// dashpots.
    pub(crate) fn add_on_pairs(&self, amplitudes: &[Vec<c64>; 2], load: &mut [c64]) {
        self.model.add_on_pairs(amplitudes, load);
    }

    /// Modes of the model that move together where `mode` has the amplitude 1, with the amplitudes of
    /// all: the mode alone or, in a wave, both of its frequency.
    pub(crate) fn moving_together(&self, mode: usize) -> Vec<(usize, c64)> {
        let first_mode = (mode, c64::new(1.0, 0.0));
        let Some(sign) = self.sign() else {
            return vec![first_mode];
        };
        // With the shape (a, b) of the mode on both copies, that of its twin is t (-b, a), t = 1 or -1.
        // Y = (X, sign i X) then has t sign i times the amplitude of the mode in its twin.
        let twin = mode ^ 1;
        if twin >= self.model.omega2.len() {
            return vec![first_mode];
        }
        let turned = |of: &dyn Fn(usize) -> [f64; 2]| -> f64 {
            let ([a, b], [first, second]) = (of(mode), of(twin));
            a * second - b * first
        };
        let reduced = self.model;
        let (n, points) = (self.unknowns(), self.observations().len());
        let of_pairs =
            (0..n).map(|i| turned(&|m| [reduced.coupling[(i, m)], reduced.coupling[(i + n, m)]]));
        let of_points = (0..points)
            .map(|p| turned(&|m| [p, p + points].map(|p| reduced.observations[p].on_modes[m])));
        let t = f64::signum(of_pairs.sum::<f64>() + of_points.sum::<f64>());
        vec![first_mode, (twin, c64::new(0.0, t * sign))]
    }

    /// Number of the mode of the sector that a mode of the model stands for: both copies have each.
    pub fn mode_of_sector(&self, mode: usize) -> usize {
        mode / self.copies()
    }
}

/// One unit of an excitation on the model of a harmonic.
#[derive(Debug, Clone, Copy)]
pub struct UnitLoad<'a> {
    /// That on the first copy.
    first: &'a Load,
    /// The sign of [`HarmonicModel`], and the unit on the second copy.
    second: Option<(f64, &'a Load)>,
}

impl UnitLoad<'_> {
    /// Adds an excitation to the cosine and the sine part of a load, from its own cosine and sine part,
    /// as multiples of the unit.
    pub fn add_to(&self, [cosine, sine]: [&mut Load; 2], [c, s]: [f64; 2]) {
        cosine.add(c, self.first);
        sine.add(s, self.first);
        if let Some((sign, second)) = self.second {
            // (c - i s) times sign i.
            cosine.add(sign * s, second);
            sine.add(-sign * c, second);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_engine_order_excites_the_nodal_diameter_that_all_sectors_see() {
        let of = |waves: usize| nodal_diameter_of(waves, 6);
        let expected = [0, 1, 2, 3, 2, 1, 0, 1, 2];
        assert_eq!((0..9).map(of).collect::<Vec<_>>(), expected);
        assert_eq!(nodal_diameter_of(3, 5), 2);
        assert_eq!(largest_nodal_diameter(5), 2);
    }
}
