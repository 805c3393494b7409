//! Elimination of the stuck modes, and of the forces of dashpots and of the air, from the equations of
//! one harmonic.
//!
//! Each stuck mode has factors s_m and z_m of its own, `d_m = s_m w_m^2 - z_m`: those of K and M,
//! or, with a damping ratio zeta of its own, s_m = 1 and z_m = w^2 - 2 i w zeta w_m. A dashpot has the
//! force k v on its displacement v, with k = i w c. So has a mode on which the air acts: there k is
//! the matrix -A ([`influence`](crate::reduced::influence)), which couples these modes and need
//! not be symmetric. With Q = [p, x] (the coupling of the modes, and the weights of the dashpots on
//! the pairs), y the weights of the dashpots on the modes, Z = diag(z_m), D = diag(d_m), and k the
//! matrix of all of them,
//!
//! ```text
//! Lambda = s K - z M + Q (diag(z - z_m - z_m^2 / d_m) + L T L^T) Q^T
//! L = (Z D^-1 y, I)      T = k (1 + H k)^-1 = (1 + k H)^-1 k      H = y^T D^-1 y
//! F = F_X + p Z D^-1 fm - Q L T y^T D^-1 fm
//! q = D^-1 (fm + Z p^T X - y T (L^T Q^T X + y^T D^-1 fm))
//! ```
//!
//! These are the equations of X, of q and of the forces of the dashpots, with all but X eliminated
//! (Woodbury's formula). `T` is as large as the number of dashpots and of modes on which the air
//! acts. Below, "dashpots" are both.
//!
//! At the frequency of a mode that the dashpots alone damp, d_m vanishes, and the terms with 1 / d_m
//! cancel. Such a mode gets a large d_m, and the difference becomes one more column of y, with
//! x = 0 and k of the opposite sign: the formulas stay, and nothing cancels.

use crate::reduced::ReducedModel;
use dovetail_numerics::dense::{Lu, product};
use faer::{Mat, c64};

/// A mode is near a frequency where its d is smaller than this, relative to the squared frequency
/// of the mode.
const NEAR: f64 = 1e-3;

const ZERO: c64 = c64::new(0.0, 0.0);
const ONE: c64 = c64::new(1.0, 0.0);

/// Factors of one harmonic, or their derivatives with respect to something.
#[derive(Debug, Clone)]
pub(super) struct Factors {
    /// Factor of K.
    pub s: c64,
    /// Factor of -M.
    pub z: c64,
    /// Factors s and z of the first stuck modes, which have damping ratios of their own.
    pub of_modes: Vec<[c64; 2]>,
    /// Factor of the coefficients of the dashpots.
    pub rate: c64,
    /// Coefficients k of the modes on which the air acts; `None` where they are 0.
    pub influence: Option<Mat<c64>>,
}

impl Factors {
    /// Coefficient (i, j) of the forces of dashpots of these coefficients, and of the air behind them.
    fn force_coefficient(&self, damping_n_s_m: &[f64], i: usize, j: usize) -> c64 {
        let d = damping_n_s_m.len();
        match (i.checked_sub(d), j.checked_sub(d)) {
            (None, None) if i == j => self.rate * damping_n_s_m[i],
            (Some(i), Some(j)) => self.influence.as_ref().map_or(ZERO, |k| k[(i, j)]),
            _ => ZERO,
        }
    }

    /// Factors s and z of a stuck mode.
    pub(crate) fn mode_factors(&self, mode: usize) -> [c64; 2] {
        let factors = self.of_modes.get(mode);
        factors.copied().unwrap_or([self.s, self.z])
    }
}

/// Coefficients of Lambda of one harmonic: `s K - z M + Q (diag(modes) + L T L^T) Q^T`.
#[derive(Debug, Clone)]
pub(crate) struct Coefficients {
    /// Factor of K, `1 + i w a`.
    pub s: c64,
    /// Factor of -M, `w^2 - i w b`.
    pub z: c64,
    /// Factor of `p_m p_m^T`, for each stuck mode.
    pub modes: Vec<c64>,
    /// Matrix `L T L^T`; `None` without dashpots.
    pub dashpots: Option<LowRank>,
}

/// Matrix `L T L^T` on the stuck modes, m, and on the dashpots, d.
#[derive(Debug, Clone)]
pub(crate) struct LowRank {
    /// Rows of L that belong to the modes, m x r.
    on_modes: Mat<c64>,
    /// Rows of L that belong to the dashpots, d x r.
    on_dashpots: Mat<c64>,
    /// T, r x r.
    middle: Mat<c64>,
}

impl LowRank {
    /// Transposed matrix.
    pub(super) fn transposed(&self) -> Self {
        Self {
            middle: self.middle.transpose().to_owned(),
            ..self.clone()
        }
    }

    /// Matrix on the first `count` modes alone.
    pub(super) fn truncate(&mut self, count: usize) {
        self.on_modes = self.on_modes.subrows(0, count).to_owned();
    }

    /// Computes `L T L^T g`, for vectors on the modes and on the dashpots.
    pub(super) fn product(&self, g: [&[c64]; 2]) -> [Vec<c64>; 2] {
        self.scattered(&times(&self.middle, &self.gathered(g)))
    }

    /// Matrix of rows `a` times `L T L^T`: from r x m and r x d on the modes and on the dashpots to
    /// the same.
    pub(super) fn left_product(&self, a: [&Mat<c64>; 2]) -> [Mat<c64>; 2] {
        let [on_modes, on_dashpots] = [&self.on_modes, &self.on_dashpots];
        let across = product(a[0].as_ref(), on_modes.as_ref())
            + product(a[1].as_ref(), on_dashpots.as_ref());
        let across = product(across.as_ref(), self.middle.as_ref());
        [on_modes, on_dashpots].map(|rows| product(across.as_ref(), rows.transpose()))
    }

    /// Computes `L t` on the modes and on the dashpots.
    fn scattered(&self, t: &[c64]) -> [Vec<c64>; 2] {
        [&self.on_modes, &self.on_dashpots].map(|rows| {
            let mut sum = vec![ZERO; rows.nrows()];
            add_columns(rows, t, &mut sum);
            sum
        })
    }

    /// Computes `L^T g`, r, of a vector on the modes and on the dashpots.
    fn gathered(&self, g: [&[c64]; 2]) -> Vec<c64> {
        let mut sum = vec![ZERO; self.middle.nrows()];
        for (rows, g) in [&self.on_modes, &self.on_dashpots].into_iter().zip(g) {
            for (sum, column) in sum.iter_mut().zip(rows.col_iter()) {
                *sum += column.iter().zip(g).map(|(l, g)| l * g).sum::<c64>();
            }
        }
        sum
    }
}

/// Stuck modes of a model, eliminated at one harmonic.
pub(super) struct Elimination<'a> {
    reduced: &'a ReducedModel,
    factors: Factors,
    /// Modes that are not eliminated and move together, with their amplitudes where the first one has
    /// 1; empty where all are eliminated.
    kept: &'a [(usize, c64)],
    /// d of each mode.
    divisors: Vec<c64>,
    dashpots: Option<Forces>,
}

/// Forces of the dashpots, eliminated at one harmonic.
struct Forces {
    /// Weights y on the modes, m x r: those of the dashpots, then those of the modes nearby.
    y: Mat<c64>,
    /// H, r x r.
    among: Mat<c64>,
    /// `(1 + H k)^-1`, r x r.
    inverse: Mat<c64>,
    /// L and T.
    coupled: LowRank,
}

/// Derivatives of the forces of dashpots.
struct ForceSlopes {
    /// Derivative of the rows of L that belong to the modes; the others are constant.
    on_modes: Mat<c64>,
    /// Derivative of T.
    middle: Mat<c64>,
}

impl<'a> Elimination<'a> {
    /// Elimination of all modes but `kept`, which move together and have these amplitudes where the
    /// first one has 1.
    pub(crate) fn new(
        reduced: &'a ReducedModel,
        factors: Factors,
        kept: &'a [(usize, c64)],
    ) -> Self {
        let divisor = |(m, w2): (usize, &f64)| {
            let [s, z] = factors.mode_factors(m);
            s * *w2 - z
        };
        let divisors = reduced.omega2.iter().enumerate().map(divisor).collect();
        let mut this = Self {
            reduced,
            factors,
            kept,
            divisors,
            dashpots: None,
        };
        if reduced.dashpots.count() > 0 {
            this.dashpots = Some(this.eliminate_forces());
        }
        this
    }

    fn eliminate_forces(&mut self) -> Forces {
        let dashpots = &self.reduced.dashpots;
        let (d, modes) = (dashpots.count(), self.divisors.len());
        let mut near: Vec<usize> = Vec::new();
        for (m, w2) in self.reduced.omega2.iter().enumerate() {
            if !self.keeps(m) && self.divisors[m].norm() < NEAR * w2 {
                self.divisors[m] += c64::new(*w2, 0.0);
                near.push(m);
            }
        }
        let y = Mat::from_fn(modes, d + near.len(), |m, j| match j.checked_sub(d) {
            None => c64::new(dashpots.on_modes[(m, j)], 0.0),
            Some(j) if near[j] == m => ONE,
            Some(_) => ZERO,
        });
        let r = y.ncols();
        let coefficients = Mat::from_fn(r, r, |i, j| match (i.checked_sub(d), j.checked_sub(d)) {
            (None, None) => self
                .factors
                .force_coefficient(&dashpots.damping_n_s_m, i, j),
            (Some(i), Some(j)) if i == j => c64::new(-self.reduced.omega2[near[j]], 0.0),
            _ => ZERO,
        });
        let divided = self.scaled_rows(&y, |m| self.inverse(m));
        let among = product(y.transpose(), divided.as_ref());
        let unit = Mat::from_fn(r, r, |i, j| if i == j { ONE } else { ZERO });
        let matrix = &unit + product(among.as_ref(), coefficients.as_ref());
        let mut inverse = unit;
        Lu::new(matrix).solve_in_place(inverse.as_mut());
        let coupled = LowRank {
            on_modes: self.scaled_rows(&divided, |m| self.factors.mode_factors(m)[1]),
            on_dashpots: Mat::from_fn(d, r, |i, j| if i == j { ONE } else { ZERO }),
            middle: product(coefficients.as_ref(), inverse.as_ref()),
        };
        Forces {
            y,
            among,
            inverse,
            coupled,
        }
    }

    /// Returns `true` if a mode is not eliminated.
    fn keeps(&self, mode: usize) -> bool {
        self.kept.iter().any(|(kept, _)| *kept == mode)
    }

    /// Inverse 1 / d of a mode; 0 of a mode that is kept.
    fn inverse(&self, mode: usize) -> c64 {
        match self.keeps(mode) {
            true => ZERO,
            false => ONE / self.divisors[mode],
        }
    }

    /// Matrix with a row for each mode, times a factor of that mode.
    fn scaled_rows(&self, a: &Mat<c64>, factor: impl Fn(usize) -> c64) -> Mat<c64> {
        let factors: Vec<c64> = (0..a.nrows()).map(factor).collect();
        Mat::from_fn(a.nrows(), a.ncols(), |m, j| factors[m] * a[(m, j)])
    }

    /// Coefficients of Lambda.
    pub(crate) fn coefficients(&self) -> Coefficients {
        let Factors { s, z, .. } = self.factors;
        let mode = |m: usize| {
            let [_, own] = self.factors.mode_factors(m);
            let mut factor = match self.keeps(m) {
                true => ZERO,
                false => -(own * own) / self.divisors[m],
            };
            if m < self.factors.of_modes.len() {
                factor += z - own;
            }
            factor
        };
        Coefficients {
            s,
            z,
            modes: (0..self.divisors.len()).map(mode).collect(),
            dashpots: self.dashpots.as_ref().map(|forces| forces.coupled.clone()),
        }
    }

    /// Derivatives of the coefficients of Lambda, from those of the factors, times `times`.
    pub(crate) fn slopes(&self, slope: &Factors, times: f64) -> Coefficients {
        let mode = |m: usize| {
            let ([_, own], [_, dz]) = (self.factors.mode_factors(m), slope.mode_factors(m));
            let (d, dd) = (self.divisors[m], self.divisor_slope(slope, m));
            let mut factor = match self.keeps(m) {
                true => ZERO,
                false => -(own * (dz * d * 2.0 - own * dd)) / (d * d) * times,
            };
            if m < self.factors.of_modes.len() {
                factor += (slope.z - dz) * times;
            }
            factor
        };
        // (L T L^T)' = L' T L^T + L T L'^T + L T' L^T.
        let dashpots = self.dashpots.as_ref().map(|forces| {
            let ForceSlopes { on_modes, middle } = self.force_slopes(forces, slope);
            let LowRank {
                on_modes: of_modes,
                on_dashpots,
                middle: t,
            } = &forces.coupled;
            let r = t.nrows();
            LowRank {
                on_modes: Mat::from_fn(of_modes.nrows(), 2 * r, |m, j| match j.checked_sub(r) {
                    None => on_modes[(m, j)],
                    Some(j) => of_modes[(m, j)],
                }),
                on_dashpots: Mat::from_fn(on_dashpots.nrows(), 2 * r, |i, j| {
                    j.checked_sub(r).map_or(ZERO, |j| on_dashpots[(i, j)])
                }),
                middle: Mat::from_fn(2 * r, 2 * r, |i, j| {
                    let entry = match (i.checked_sub(r), j.checked_sub(r)) {
                        (None, None) => ZERO,
                        (None, Some(j)) => t[(i, j)],
                        (Some(i), None) => t[(i, j)],
                        (Some(i), Some(j)) => middle[(i, j)],
                    };
                    entry * times
                }),
            }
        });
        Coefficients {
            s: slope.s * times,
            z: slope.z * times,
            modes: (0..self.divisors.len()).map(mode).collect(),
            dashpots,
        }
    }

    /// Derivative of d of a mode.
    fn divisor_slope(&self, slope: &Factors, mode: usize) -> c64 {
        let [ds, dz] = slope.mode_factors(mode);
        ds * self.reduced.omega2[mode] - dz
    }

    /// L' = y (z / d)' and T' = (1 - T H) k' R + T y^T D^-1 D' D^-1 y T with R = (1 + H k)^-1.
    fn force_slopes(&self, forces: &Forces, slope: &Factors) -> ForceSlopes {
        let by_mode = |m: usize| {
            let ([_, z], [_, dz]) = (self.factors.mode_factors(m), slope.mode_factors(m));
            let inverse = self.inverse(m);
            (dz - z * self.divisor_slope(slope, m) * inverse) * inverse
        };
        let squared = |m: usize| self.divisor_slope(slope, m) * self.inverse(m) * self.inverse(m);
        let (y, t) = (&forces.y, &forces.coupled.middle);
        let among = product(y.transpose(), self.scaled_rows(y, squared).as_ref());
        let through = product(product(t.as_ref(), among.as_ref()).as_ref(), t.as_ref());
        // k' is that of the dashpots alone.
        let damping = &self.reduced.dashpots.damping_n_s_m;
        let d = damping.len();
        let r = &forces.inverse;
        let rated = Mat::from_fn(d, r.ncols(), |i, j| slope.rate * damping[i] * r[(i, j)]);
        let turned = product(t.as_ref(), forces.among.subcols(0, d));
        let left = Mat::from_fn(t.nrows(), d, |i, j| {
            (if i == j { ONE } else { ZERO }) - turned[(i, j)]
        });
        let of_rate = product(left.as_ref(), rated.as_ref());
        ForceSlopes {
            on_modes: self.scaled_rows(y, by_mode),
            middle: of_rate + through,
        }
    }

    /// Amplitude of each stuck mode for a unit of `p_m . X`, without dashpots: z / d.
    pub(crate) fn shares(&self) -> Vec<c64> {
        let share = |m: usize| self.factors.mode_factors(m)[1] / self.divisors[m];
        (0..self.divisors.len()).map(share).collect()
    }

    /// Amplitude of a stuck mode under a force on it and `p . X`, without dashpots.
    pub(crate) fn amplitude(&self, mode: usize, force: c64, px: c64) -> c64 {
        (force + self.factors.mode_factors(mode)[1] * px) / self.divisors[mode]
    }

    /// Amplitude of a stuck mode that a force on it has, times z: the part of the force that acts on
    /// the pairs through the mode, without dashpots.
    pub(crate) fn carried(&self, mode: usize, force: c64) -> c64 {
        force * self.factors.mode_factors(mode)[1] / self.divisors[mode]
    }

    /// Derivative of [`Elimination::carried`] for a force with a derivative.
    pub(crate) fn carried_slope(&self, slope: &Factors, mode: usize, [force, df]: [c64; 2]) -> c64 {
        let ([_, z], [_, dz]) = (self.factors.mode_factors(mode), slope.mode_factors(mode));
        let (d, dd) = (self.divisors[mode], self.divisor_slope(slope, mode));
        df * z / d + force * (dz * d - z * dd) / (d * d)
    }

    /// What the dashpots take from a load on the modes before it acts on Q: `-L T y^T D^-1 fm` on
    /// the modes and on the dashpots; `None` without dashpots.
    pub(crate) fn dashpot_share(&self, on_modes: &[c64]) -> Option<[Vec<c64>; 2]> {
        let forces = self.dashpots.as_ref()?;
        let t = times(
            &forces.coupled.middle,
            &self.project_forces(forces, on_modes),
        );
        Some(forces.coupled.scattered(&negated(&t)))
    }

    /// What the dashpots take from a displacement by the modes before it depends on `Q^T X`: `-L T^T
    /// y^T D^-1 w`, for weights w of the modes in the displacement; `None` without dashpots.
    pub(crate) fn dashpot_displacement_share(&self, on_modes: &[c64]) -> Option<[Vec<c64>; 2]> {
        let forces = self.dashpots.as_ref()?;
        let coupled = forces.coupled.transposed();
        let t = times(&coupled.middle, &self.project_forces(forces, on_modes));
        Some(coupled.scattered(&negated(&t)))
    }

    /// Derivative of [`Elimination::dashpot_share`] for a load with the derivative
    /// `on_modes_slope`.
    pub(crate) fn dashpot_share_slope(
        &self,
        slope: &Factors,
        on_modes: &[c64],
        on_modes_slope: &[c64],
    ) -> Option<[Vec<c64>; 2]> {
        let forces = self.dashpots.as_ref()?;
        let slopes = self.force_slopes(forces, slope);
        let middle = &forces.coupled.middle;
        // b = y^T D^-1 fm, t = T b.
        let b = self.project_forces(forces, on_modes);
        let turned: Vec<c64> = (0..on_modes.len())
            .map(|m| {
                on_modes_slope[m] - self.divisor_slope(slope, m) * self.inverse(m) * on_modes[m]
            })
            .collect();
        let t = times(middle, &b);
        let mut dt = times(middle, &self.project_forces(forces, &turned));
        for (sum, part) in dt.iter_mut().zip(times(&slopes.middle, &b)) {
            *sum += part;
        }
        let [mut of_modes, of_dashpots] = forces.coupled.scattered(&negated(&dt));
        add_columns(&slopes.on_modes, &negated(&t), &mut of_modes);
        Some([of_modes, of_dashpots])
    }

    /// Takes from the amplitudes of the modes what the dashpots do: `D^-1 y T (L^T Q^T X + y^T D^-1
    /// fm + y_k q_k)`, with `Q^T X` on the modes and on the dashpots, and the amplitude `kept` of the
    /// first of the modes that are not eliminated.
    pub(crate) fn subtract_dashpots(
        &self,
        moved: [&[c64]; 2],
        (on_modes, kept): (&[c64], c64),
        amplitudes: &mut [c64],
    ) {
        let Some(forces) = &self.dashpots else {
            return;
        };
        let mut b = self.project_forces(forces, on_modes);
        let of_kept = self.kept_displacements(forces);
        b.iter_mut()
            .zip(&of_kept)
            .for_each(|(sum, y)| *sum += y * kept);
        for (sum, part) in b.iter_mut().zip(forces.coupled.gathered(moved)) {
            *sum += part;
        }
        let t = negated(&times(&forces.coupled.middle, &b));
        let mut sum = vec![ZERO; amplitudes.len()];
        add_columns(&forces.y, &t, &mut sum);
        for (m, (amplitude, sum)) in amplitudes.iter_mut().zip(sum).enumerate() {
            *amplitude += sum * self.inverse(m);
        }
    }

    /// Computes `y^T D^-1 f`, r.
    fn project_forces(&self, forces: &Forces, f: &[c64]) -> Vec<c64> {
        let divided: Vec<c64> = (0..f.len()).map(|m| f[m] * self.inverse(m)).collect();
        let columns = forces.y.col_iter();
        let of = |column: faer::ColRef<'_, c64>| {
            column.iter().zip(&divided).map(|(y, f)| y * f).sum::<c64>()
        };
        columns.map(of).collect()
    }

    /// Coupling of the modes that are kept by the dashpots; `None` without dashpots or such modes.
    pub(crate) fn kept_coupling(&self) -> Option<KeptCoupling> {
        let (forces, first) = self.first_kept_forces()?;
        let coupled = &forces.coupled;
        let t = times(&coupled.middle, &self.kept_displacements(forces));
        let row = times(&coupled.transposed().middle, &first);
        Some(KeptCoupling {
            own: dot(&first, &t),
            drive: coupled.scattered(&negated(&t)),
            row: coupled.scattered(&negated(&row)),
        })
    }

    /// Derivatives of [`Elimination::kept_coupling`].
    pub(crate) fn kept_coupling_slope(&self, slope: &Factors) -> Option<KeptCoupling> {
        let (forces, first) = self.first_kept_forces()?;
        let slopes = self.force_slopes(forces, slope);
        // (L t)' = L t' + L' t.
        let scattered = |t: &[c64], dt: &[c64]| {
            let [mut on_modes, on_dashpots] = forces.coupled.scattered(&negated(dt));
            add_columns(&slopes.on_modes, &negated(t), &mut on_modes);
            [on_modes, on_dashpots]
        };
        let together = self.kept_displacements(forces);
        let (t, dt) = (&forces.coupled.middle, &slopes.middle);
        let [across, of_slope] = [t, dt].map(|t| t.transpose().to_owned());
        let moved = times(dt, &together);
        Some(KeptCoupling {
            own: dot(&first, &moved),
            drive: scattered(&times(t, &together), &moved),
            row: scattered(&times(&across, &first), &times(&of_slope, &first)),
        })
    }

    /// Forces of the dashpots, and their weights on the first of the modes that are kept.
    fn first_kept_forces(&self) -> Option<(&Forces, Vec<c64>)> {
        let (forces, (first, _)) = (self.dashpots.as_ref()?, self.kept.first()?);
        let weights = (0..forces.y.ncols()).map(|j| forces.y[(*first, j)]);
        Some((forces, weights.collect()))
    }

    /// Displacements of the dashpots, r, by the modes that are kept, where the first one has the
    /// amplitude 1.
    fn kept_displacements(&self, forces: &Forces) -> Vec<c64> {
        let of = |j: usize| {
            let modes = self.kept.iter();
            modes.map(|(m, share)| share * forces.y[(*m, j)]).sum()
        };
        (0..forces.y.ncols()).map(of).collect()
    }
}

/// Coupling by the dashpots of the modes that are not eliminated, with the amplitudes e that they have
/// where the first one, k, has 1.
pub(super) struct KeptCoupling {
    /// Forces `-L T y^T e` that the modes have on others, on the modes and on the dashpots.
    pub drive: [Vec<c64>; 2],
    /// Force `-L T^T y_k` on the first mode by a unit of `Q^T X`, on the modes and on the dashpots.
    pub row: [Vec<c64>; 2],
    /// Force `y_k^T T y^T e` on the first mode by the modes themselves.
    pub own: c64,
}

fn negated(v: &[c64]) -> Vec<c64> {
    v.iter().map(|v| -v).collect()
}

fn dot(a: &[c64], b: &[c64]) -> c64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Computes A x of a square matrix.
fn times(a: &Mat<c64>, x: &[c64]) -> Vec<c64> {
    let mut sum = vec![ZERO; a.nrows()];
    add_columns(a, x, &mut sum);
    sum
}

/// Adds A x to a sum.
fn add_columns(a: &Mat<c64>, x: &[c64], sum: &mut [c64]) {
    for (column, x) in a.col_iter().zip(x) {
        for (sum, a) in sum.iter_mut().zip(column.iter()) {
            *sum += a * x;
        }
    }
}
