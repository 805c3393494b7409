//! Newton-GMRES for the harmonic balance: matrix-free Jacobian on the active pairs, preconditioned by
//! two dense blocks, of the mean and of the first harmonic (which serves all others), with the derivative of each pair
//! averaged on that harmonic. All in single precision: the linear solves are inexact anyway, and they are bound
//! by the memory that they read.

use super::balance::{Balance, Jacobian};
use super::retention::Retention;
use crate::contact::dynamic_stiffness::HarmonicStiffness;
use crate::numerics::gmres::{gmres, norm};
use crate::numerics::newton::NonlinearSystem;
use crate::numerics::wear::Wear;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::traits::ComplexField;
use faer::{Mat, MatMut, c32, c64};
use std::ops::{Add, Mul, Sub};

/// Relative residual asked of each linear solve.
pub const KRYLOV_TOLERANCE: f64 = 1e-2;
/// A loose one: GMRES then stays out of directions in which J is nearly singular, such as the mean
/// position of pairs that slip in every period, where a full Newton step goes far astray.
pub const LOOSE_KRYLOV_TOLERANCE: f64 = 0.1;
const MOST_KRYLOV_ITERATIONS: usize = 300;
/// Stuck modes below this multiple of a harmonic's frequency enter its block.
const MODES_BELOW: f64 = 6.0;

/// Factored blocks, kept over Newton steps and over neighbouring frequencies.
#[derive(Default)]
pub struct Preconditioner {
    /// Pairs the blocks cover.
    pairs: Vec<usize>,
    mean: Option<PartialPivLu<f32>>,
    /// The first harmonic, and so all others.
    vibration: Option<PartialPivLu<c32>>,
    wear: Wear,
}

/// The unknowns of a block, of the active pairs, by whether the preconditioner covers them.
struct Cover {
    /// Position among the active ones, position in the blocks.
    places: Vec<(usize, usize)>,
    outside: Vec<usize>,
}

/// One frequency as a nonlinear system.
pub struct KrylovSystem<'a, 'b> {
    pub balance: &'b Balance<'a>,
    preconditioner: &'b mut Preconditioner,
    /// |F|, and the norm of its harmonic part.
    scale: [f64; 2],
    linear: Option<Linearised<'a>>,
    krylov_tolerance: f64,
    /// Whether the mean of U lies where it is not looked for.
    has_left: &'b dyn Fn(&[f64]) -> bool,
    pub krylov_iterations: usize,
}

struct Linearised<'a> {
    jacobian: Jacobian,
    /// On the active pairs.
    stiffness: HarmonicStiffness<'a, f32>,
    /// On the active pairs.
    retention: Option<Retention>,
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
        let retention = self.balance.retention();
        let system = self.balance.setting.system;
        let linear = Linearised {
            stiffness: system.inexact(&self.balance.stiffness, &columns, MODES_BELOW),
            retention: retention.map(|r| r.restricted(&columns)),
            jacobian,
            columns,
        };
        if self.preconditioner.mean.is_none()
            || self
                .preconditioner
                .wear
                .is_worn(3 * self.preconditioner.pairs.len())
            || self.preconditioner.vibration.is_none()
        {
            self.preconditioner.refresh(self.balance, &linear);
        }
        self.linear = Some(linear);
    }

    fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        let tolerance = self.krylov_tolerance;
        self.solve(f, tolerance, dx)
    }

    fn simplified(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        self.solve(f, LOOSE_KRYLOV_TOLERANCE, dx)
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

impl KrylovSystem<'_, '_> {
    /// J dx = -f to the relative residual `tolerance`; false without a usable answer.
    fn solve(&mut self, f: &[f64], tolerance: f64, dx: &mut [f64]) -> bool {
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
        let cover = preconditioner.cover(&linear.jacobian.active);
        let end = gmres(
            |v, y| linear.apply(&eps, width, v, y),
            |v| preconditioner.apply(&cover, &eps, v),
            &rhs,
            &mut solution,
            tolerance,
            MOST_KRYLOV_ITERATIONS,
        );
        self.krylov_iterations += end.iterations;
        self.preconditioner.wear.serve(end.iterations);
        for (h, block) in solution.chunks_exact(m).enumerate() {
            for (&c, &v) in linear.columns.iter().zip(block) {
                dx[h * n + c] = v;
            }
        }
        // A direction that is not exact still serves: the step is judged afterwards.
        dx.iter().all(|d| d.is_finite())
    }
}

impl Linearised<'_> {
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
        self.stiffness.apply(v, y);
        if let Some(retention) = &self.retention {
            retention.add_to(&v[..m], &mut y[..m]);
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
    fn refresh(&mut self, balance: &Balance<'_>, linear: &Linearised<'_>) {
        let eps: Vec<f64> = linear.columns.iter().map(|&c| balance.eps_at(c)).collect();
        let derivatives = &linear.jacobian.derivatives;
        let mean_stiffness = linear.stiffness.mean();
        let width = 2 * linear.stiffness.harmonics() + 1;
        let mean: Vec<_> = derivatives.iter().map(|d| on_mean(d, width)).collect();
        let column = |j: usize| {
            let column = mean_stiffness.col_as_slice(j).iter();
            let mut column: Vec<f64> = column.map(|v| f64::from(*v)).collect();
            if let Some(retention) = &linear.retention {
                retention.add_to_column(j, &mut column);
            }
            column
        };
        self.mean = Some(active_block(&mean, &eps, column, |v| v as f32).partial_piv_lu());
        self.vibration = (width > 1).then(|| {
            let first: Vec<_> = derivatives
                .iter()
                .map(|d| on_first_harmonic(d, width))
                .collect();
            let [re, im] = linear.stiffness.formed(1, MODES_BELOW);
            let column = |j: usize| {
                let parts = re.col_as_slice(j).iter().zip(im.col_as_slice(j));
                parts
                    .map(|(re, im)| c64::new(f64::from(*re), f64::from(*im)))
                    .collect()
            };
            let narrow = |v: c64| c32::new(v.re as f32, v.im as f32);
            active_block(&first, &eps, column, narrow).partial_piv_lu()
        });
        self.pairs = linear.jacobian.active.clone();
        self.wear = Wear::default();
    }

    /// Where the active pairs stand in the blocks.
    fn cover(&self, active: &[usize]) -> Cover {
        let mut cover = Cover {
            places: Vec::with_capacity(3 * active.len()),
            outside: vec![],
        };
        for (i, pair) in active.iter().enumerate() {
            for c in 0..3 {
                match self.pairs.binary_search(pair) {
                    Ok(slot) => cover.places.push((3 * i + c, 3 * slot + c)),
                    Err(_) => cover.outside.push(3 * i + c),
                }
            }
        }
        cover
    }

    /// v := P^-1 v; pairs the blocks do not cover count as sticking.
    fn apply(&self, cover: &Cover, eps: &[f64], v: &mut [f64]) {
        let (Some(mean), m) = (&self.mean, eps.len()) else {
            return;
        };
        let (on_mean, on_harmonics) = v.split_at_mut(m);
        for block in std::iter::once(&mut *on_mean).chain(on_harmonics.chunks_exact_mut(m)) {
            cover.outside.iter().for_each(|&i| block[i] /= eps[i]);
        }
        let size = 3 * self.pairs.len();
        rayon::join(
            || solve_mean(mean, &cover.places, size, on_mean),
            || {
                if let Some(block) = &self.vibration {
                    solve_harmonics(block, &cover.places, size, m, on_harmonics);
                }
            },
        );
    }
}

/// v := A^-1 v on the entries that have a place in the factored A of `size` rows.
fn solve_mean(a: &PartialPivLu<f32>, places: &[(usize, usize)], size: usize, v: &mut [f64]) {
    let mut local = vec![0.0_f32; size];
    for &(i, s) in places {
        local[s] = v[i] as f32;
    }
    a.solve_in_place(MatMut::from_column_major_slice_mut(&mut local, size, 1));
    for &(i, s) in places {
        v[i] = f64::from(local[s]);
    }
}

/// The same for each harmonic of a vector without its mean: cosine and sine block of m entries, `cosine - i sine`.
fn solve_harmonics(
    a: &PartialPivLu<c32>,
    places: &[(usize, usize)],
    size: usize,
    m: usize,
    v: &mut [f64],
) {
    let count = v.len() / (2 * m);
    let mut local = vec![c32::new(0.0, 0.0); size * count];
    for (v, local) in v.chunks_exact(2 * m).zip(local.chunks_exact_mut(size)) {
        for &(i, s) in places {
            local[s] = c32::new(v[i] as f32, -v[m + i] as f32);
        }
    }
    a.solve_in_place(MatMut::from_column_major_slice_mut(&mut local, size, count));
    for (v, local) in v.chunks_exact_mut(2 * m).zip(local.chunks_exact(size)) {
        for &(i, s) in places {
            (v[i], v[m + i]) = (f64::from(local[s].re), -f64::from(local[s].im));
        }
    }
}

/// (I - D) A + D eps = (I - D)(A - eps) + eps for a preconditioner: D 3 x 3 per pair, A by columns, `narrow` to the
/// precision it is kept in.
pub fn active_block<A, T: ComplexField>(
    derivatives: &[[[A; 3]; 3]],
    eps: &[f64],
    column: impl Fn(usize) -> Vec<A>,
    narrow: impl Fn(A) -> T,
) -> Mat<T>
where
    A: Copy + From<f64> + Add<Output = A> + Sub<Output = A> + Mul<Output = A>,
{
    let mut block = Mat::zeros(eps.len(), eps.len());
    for (j, &eps) in eps.iter().enumerate() {
        let mut column = column(j);
        column[j] = column[j] - A::from(eps);
        let pairs = derivatives.iter().zip(column.chunks_exact(3));
        let out = block.col_as_slice_mut(j);
        for (slot, (d, a)) in pairs.enumerate() {
            for (r, d) in d.iter().enumerate() {
                let mut v = a[r] - (d[0] * a[0] + d[1] * a[1] + d[2] * a[2]);
                if 3 * slot + r == j {
                    v = v + A::from(eps);
                }
                out[3 * slot + r] = narrow(v);
            }
        }
    }
    block
}

/// The part of a pair's derivative, 3(2H+1) square with `width` = 2H+1, that maps the mean to itself.
fn on_mean(derivative: &[f64], width: usize) -> [[f64; 3]; 3] {
    let at = |r: usize, c: usize| derivative[r * width * 3 * width + c * width];
    std::array::from_fn(|r| std::array::from_fn(|c| at(r, c)))
}

/// The part that maps the first harmonic to itself, complex amplitudes.
fn on_first_harmonic(derivative: &[f64], width: usize) -> [[c64; 3]; 3] {
    const COSINE: usize = 1;
    const SINE: usize = 2;
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let at =
                |hr: usize, hc: usize| derivative[(r * width + hr) * 3 * width + c * width + hc];
            c64::new(
                0.5 * (at(COSINE, COSINE) + at(SINE, SINE)),
                0.5 * (at(COSINE, SINE) - at(SINE, COSINE)),
            )
        })
    })
}

/// Entries of the active pairs, block by block.
fn restrict(v: &[f64], n: usize, columns: &[usize]) -> Vec<f64> {
    v.chunks_exact(n)
        .flat_map(|block| columns.iter().map(|&c| block[c]))
        .collect()
}
