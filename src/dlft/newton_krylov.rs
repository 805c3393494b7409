//! Newton-GMRES for the harmonic balance: matrix-free Jacobian on the active pairs, preconditioned by
//! one dense block per harmonic with the derivative of each pair averaged on that harmonic.

use super::balance::{Balance, Jacobian, apply_real, submatrix};
use crate::contact::dynamic_stiffness::DynamicStiffness;
use crate::numerics::gmres::{gmres, norm};
use crate::numerics::newton::NonlinearSystem;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatMut, c64};

/// Relative residual asked of each linear solve.
pub const KRYLOV_TOLERANCE: f64 = 1e-2;
/// A loose one: GMRES then stays out of directions in which J is nearly singular, such as the mean
/// position of pairs that slip in every period, where a full Newton step goes far astray.
pub const LOOSE_KRYLOV_TOLERANCE: f64 = 0.1;
const MOST_KRYLOV_ITERATIONS: usize = 300;
/// The preconditioner is made anew once a solve takes more iterations than this.
const PATIENCE: usize = 30;

/// Factored blocks, kept over Newton steps and over neighbouring frequencies.
#[derive(Default)]
pub struct Preconditioner {
    /// Pairs the blocks cover.
    pairs: Vec<usize>,
    mean: Option<PartialPivLu<f64>>,
    harmonics: Vec<PartialPivLu<c64>>,
    /// Iterations of the last linear solve that used it.
    last_iterations: usize,
}

/// One frequency as a nonlinear system.
pub struct KrylovSystem<'a, 'b> {
    pub balance: &'b Balance<'a>,
    preconditioner: &'b mut Preconditioner,
    /// |F|, and the norm of its harmonic part.
    scale: [f64; 2],
    linear: Option<Linearised>,
    krylov_tolerance: f64,
    /// Whether the mean of U lies where it is not looked for.
    has_left: &'b dyn Fn(&[f64]) -> bool,
    pub krylov_iterations: usize,
}

struct Linearised {
    jacobian: Jacobian,
    /// Rows and columns of the active pairs: K and Lambda_k.
    mean: Mat<f64>,
    harmonics: Vec<DynamicStiffness>,
    /// Position of each full entry of a block among the active ones.
    columns: Vec<usize>,
}

impl<'a, 'b> KrylovSystem<'a, 'b> {
    pub fn new(
        balance: &'b Balance<'a>,
        preconditioner: &'b mut Preconditioner,
        krylov_tolerance: f64,
        tolerance: f64,
        has_left: &'b dyn Fn(&[f64]) -> bool,
    ) -> Self {
        Self {
            scale: load_scale(balance, tolerance),
            balance,
            preconditioner,
            linear: None,
            krylov_tolerance,
            has_left,
            krylov_iterations: 0,
        }
    }
}

/// A residual below this fraction of |F| is rounding of the static forces (it is 5e-15 at a static state).
const ROUNDING: f64 = 1e-14;

/// |F| and |F_1..H|, the second not so small that `tolerance` of it is below rounding; where nothing shakes, |F|
/// twice.
pub fn load_scale(balance: &Balance<'_>, tolerance: f64) -> [f64; 2] {
    let harmonic = norm(&balance.force[balance.unknowns_per_block()..]);
    let whole = norm(&balance.setting.system.model.static_load.on_x).hypot(harmonic);
    if harmonic == 0.0 {
        return [whole; 2];
    }
    [whole, harmonic.max(ROUNDING / tolerance * whole)]
}

/// Larger of |f_0| / |F| and |f_1..H| / |F_1..H|: the vibration is converged on its own scale.
pub fn relative_residual(f: &[f64], n: usize, scale: [f64; 2]) -> f64 {
    let ratio = |f: f64, s: f64| if f == 0.0 { 0.0 } else { f / s };
    let (mean, rest) = (
        ratio(norm(&f[..n]), scale[0]),
        ratio(norm(&f[n..]), scale[1]),
    );
    if mean.is_nan() || rest.is_nan() {
        f64::NAN
    } else {
        mean.max(rest)
    }
}

impl NonlinearSystem for KrylovSystem<'_, '_> {
    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        f.copy_from_slice(&self.balance.evaluate(x).residual);
    }

    fn measure(&self, f: &[f64]) -> f64 {
        relative_residual(f, self.balance.unknowns_per_block(), self.scale)
    }

    fn linearise(&mut self, x: &[f64]) {
        let jacobian = self.balance.linearise(x);
        let columns: Vec<usize> = jacobian
            .active
            .iter()
            .flat_map(|p| [3 * p, 3 * p + 1, 3 * p + 2])
            .collect();
        let linear = Linearised {
            mean: self.balance.mean_stiffness(&columns),
            harmonics: self
                .balance
                .stiffness
                .iter()
                .map(|l| DynamicStiffness {
                    re: submatrix(&l.re, &columns),
                    im: submatrix(&l.im, &columns),
                })
                .collect(),
            jacobian,
            columns,
        };
        if self.preconditioner.mean.is_none()
            || self.preconditioner.last_iterations > PATIENCE
            || self.preconditioner.harmonics.len() != linear.harmonics.len()
        {
            self.preconditioner.refresh(self.balance, &linear);
        }
        self.linear = Some(linear);
    }

    fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        let Some(linear) = &self.linear else {
            return false;
        };
        let balance = self.balance;
        let n = balance.unknowns_per_block();
        let width = f.len() / n;
        let m = linear.columns.len();
        // Pairs that always stick: eps dx = -f.
        for (i, (d, f)) in dx.iter_mut().zip(f).enumerate() {
            *d = -f / balance.eps_at(i);
        }
        if m == 0 {
            return dx.iter().all(|d| d.is_finite());
        }
        // Active pairs: J_aa dx_a = -f_a - (I - D) Lambda_as dx_s.
        for &c in &linear.columns {
            (0..width).for_each(|h| dx[h * n + c] = 0.0);
        }
        let mut forces = vec![0.0; f.len()];
        if dx.iter().any(|&d| d != 0.0) {
            balance.apply_stiffness(dx, &mut forces);
        }
        let mut rhs = restrict(&forces, n, &linear.columns);
        linear.complement(&mut rhs, width);
        for (r, f) in rhs.iter_mut().zip(restrict(f, n, &linear.columns)) {
            *r = -*r - f;
        }
        let eps: Vec<f64> = linear.columns.iter().map(|&c| balance.eps_at(c)).collect();
        let mut solution = vec![0.0; rhs.len()];
        let preconditioner = &*self.preconditioner;
        let slots = preconditioner.slots(&linear.jacobian.active);
        let end = gmres(
            |v, y| linear.apply(&eps, width, v, y),
            |v| preconditioner.apply(&slots, &eps, width, v),
            &rhs,
            &mut solution,
            self.krylov_tolerance,
            MOST_KRYLOV_ITERATIONS,
        );
        self.krylov_iterations += end.iterations;
        self.preconditioner.last_iterations = end.iterations;
        for (h, block) in solution.chunks_exact(m).enumerate() {
            for (&c, &v) in linear.columns.iter().zip(block) {
                dx[h * n + c] = v;
            }
        }
        // A direction that is not exact still serves: the step is judged afterwards.
        dx.iter().all(|d| d.is_finite())
    }

    fn is_astray(&self, x: &[f64]) -> bool {
        (self.has_left)(x)
    }

    fn length(&self, dx: &[f64]) -> f64 {
        // In forces: steps of pairs of unlike stiffness weigh alike.
        dx.iter()
            .enumerate()
            .map(|(i, d)| (self.balance.eps_at(i) * d).powi(2))
            .sum::<f64>()
            .sqrt()
    }
}

impl Linearised {
    /// v := (I - D) v on active vectors.
    fn complement(&self, v: &mut [f64], width: usize) {
        let m = self.columns.len();
        let full = 3 * width;
        let mut local = vec![0.0; full];
        for (slot, derivative) in self.jacobian.derivatives.iter().enumerate() {
            for (i, l) in local.iter_mut().enumerate() {
                *l = v[(i % width) * m + 3 * slot + i / width];
            }
            for (i, row) in derivative.chunks_exact(full).enumerate() {
                let moved: f64 = row.iter().zip(&local).map(|(d, l)| d * l).sum();
                v[(i % width) * m + 3 * slot + i / width] -= moved;
            }
        }
    }

    /// y = (I - D) Lambda v + D eps v = (I - D)(Lambda v - eps v) + eps v.
    fn apply(&self, eps: &[f64], width: usize, v: &[f64], y: &mut [f64]) {
        let m = self.columns.len();
        let (y0, rest) = y.split_at_mut(m);
        apply_real(&self.mean, &v[..m], y0);
        for ((lambda, v), y) in self
            .harmonics
            .iter()
            .zip(v[m..].chunks_exact(2 * m))
            .zip(rest.chunks_exact_mut(2 * m))
        {
            let (yc, ys) = y.split_at_mut(m);
            lambda.apply(&v[..m], &v[m..], yc, ys);
        }
        for (i, (y, v)) in y.iter_mut().zip(v).enumerate() {
            *y -= eps[i % m] * v;
        }
        self.complement(y, width);
        for (i, (y, v)) in y.iter_mut().zip(v).enumerate() {
            *y += eps[i % m] * v;
        }
    }
}

impl Preconditioner {
    fn refresh(&mut self, balance: &Balance<'_>, linear: &Linearised) {
        let m = linear.columns.len();
        let width = 2 * linear.harmonics.len() + 1;
        let full = 3 * width;
        let eps = |j: usize| balance.eps_at(linear.columns[j]);
        let derivatives = &linear.jacobian.derivatives;
        // (I - d) A + d eps with d 3 x 3 per pair.
        let mut mean = Mat::zeros(m, m);
        for j in 0..m {
            let column = linear.mean.col_as_slice(j);
            let out = mean.col_as_slice_mut(j);
            for (slot, d) in derivatives.iter().enumerate() {
                for r in 0..3 {
                    let mut v = column[3 * slot + r];
                    for c in 0..3 {
                        let entry = d[(r * width) * full + c * width];
                        let own = if 3 * slot + c == j { eps(j) } else { 0.0 };
                        v -= entry * (column[3 * slot + c] - own);
                    }
                    out[3 * slot + r] = v;
                }
            }
        }
        self.mean = Some(mean.partial_piv_lu());
        self.harmonics.clear();
        for (k, lambda) in linear.harmonics.iter().enumerate() {
            let (cosine, sine) = (2 * k + 1, 2 * k + 2);
            let averaged: Vec<[[c64; 3]; 3]> = derivatives
                .iter()
                .map(|d| {
                    let at = |r: usize, hr: usize, c: usize, hc: usize| {
                        d[(r * width + hr) * full + c * width + hc]
                    };
                    std::array::from_fn(|r| {
                        std::array::from_fn(|c| {
                            c64::new(
                                0.5 * (at(r, cosine, c, cosine) + at(r, sine, c, sine)),
                                0.5 * (at(r, cosine, c, sine) - at(r, sine, c, cosine)),
                            )
                        })
                    })
                })
                .collect();
            let mut block = Mat::<c64>::zeros(m, m);
            for j in 0..m {
                let (re, im) = (lambda.re.col_as_slice(j), lambda.im.col_as_slice(j));
                let out = block.col_as_slice_mut(j);
                for (slot, d) in averaged.iter().enumerate() {
                    for r in 0..3 {
                        let mut v = c64::new(re[3 * slot + r], im[3 * slot + r]);
                        for (c, d) in d[r].iter().enumerate() {
                            let at = 3 * slot + c;
                            let own = if at == j { eps(j) } else { 0.0 };
                            v -= d * c64::new(re[at] - own, im[at]);
                        }
                        out[3 * slot + r] = v;
                    }
                }
            }
            self.harmonics.push(block.partial_piv_lu());
        }
        self.pairs = linear.jacobian.active.clone();
        self.last_iterations = 0;
    }

    /// For each active pair its slot among the pairs of the blocks.
    fn slots(&self, active: &[usize]) -> Vec<Option<usize>> {
        active
            .iter()
            .map(|pair| self.pairs.binary_search(pair).ok())
            .collect()
    }

    /// v := P^-1 v; pairs the blocks do not cover count as sticking.
    fn apply(&self, slots: &[Option<usize>], eps: &[f64], width: usize, v: &mut [f64]) {
        let Some(mean) = &self.mean else { return };
        let (m, size) = (3 * slots.len(), 3 * self.pairs.len());
        let covered = |v: &[f64]| {
            let mut local = vec![0.0; size];
            for (i, slot) in slots.iter().enumerate() {
                if let Some(s) = slot {
                    local[3 * s..3 * s + 3].copy_from_slice(&v[3 * i..3 * i + 3]);
                }
            }
            local
        };
        let put_back = |local: &dyn Fn(usize) -> f64, v: &mut [f64]| {
            for (i, slot) in slots.iter().enumerate() {
                for c in 0..3 {
                    v[3 * i + c] = match slot {
                        Some(s) => local(3 * s + c),
                        None => v[3 * i + c] / eps[3 * i + c],
                    };
                }
            }
        };
        let mut local = covered(&v[..m]);
        mean.solve_in_place(MatMut::from_column_major_slice_mut(&mut local, size, 1));
        put_back(&|i| local[i], &mut v[..m]);
        for (k, block) in self.harmonics.iter().enumerate() {
            debug_assert!(2 * k + 2 < width);
            let (cosine, sine) = v[(2 * k + 1) * m..(2 * k + 3) * m].split_at_mut(m);
            let mut local: Vec<c64> = covered(cosine)
                .into_iter()
                .zip(covered(sine))
                .map(|(c, s)| c64::new(c, -s))
                .collect();
            block.solve_in_place(MatMut::from_column_major_slice_mut(&mut local, size, 1));
            put_back(&|i| local[i].re, cosine);
            put_back(&|i| -local[i].im, sine);
        }
    }
}

/// Entries of the active pairs, block by block.
fn restrict(v: &[f64], n: usize, columns: &[usize]) -> Vec<f64> {
    v.chunks_exact(n)
        .flat_map(|block| columns.iter().map(|&c| block[c]))
        .collect()
}
