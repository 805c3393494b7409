//! Coarse space of a two-level solver: the softest motions of a dense symmetric matrix relative to
//! its own diagonal.
//!
//! They come from a few rounds of inverse iteration. Of a large matrix it is the Laplacian of a graph
//! that is factored in its place. The unknowns are the three displacements of points on surfaces, and
//! what is soft there is smooth: each component alone is about spanned by the softest vectors of the
//! graph whose edges are as heavy as the blocks of the matrix that couple two points. This takes a 27th
//! of the operations. The few motions that are far softer than all others, such as those of whole
//! bodies, are then found by Davidson's method (J. Comput. Phys. 17 (1975) 87-94) in blocks: a solver
//! in single precision would not find what is missing of them.

use faer::diag::DiagRef;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Mat, MatRef, Par};
use rayon::prelude::*;

use crate::dense;
use crate::dense::add_symmetric_product;
use crate::dense::parallel::{self, product};
use crate::vector::{axpy, dot, norm};

/// Most unknowns of a matrix that is factored itself.
const MOST_FACTORED: usize = 4000;
/// Relative diagonal shifts, tried in turn until the matrix is positive definite: it may be
/// singular or slightly indefinite (rigid motion, spin softening).
const SHIFTS: [f64; 3] = [1e-5, 1e-3, 1e-1];
const ROUNDS: usize = 4;
/// Among smooth motions so many, and all with a theta below this, are made accurate ...
const FEWEST_ACCURATE: usize = 12;
const SOFT: f64 = 1e-2;
/// ... until `|A w - theta diag(weights) w|` relative to the weights is below this, or below this
/// fraction of theta ...
const RESIDUAL: f64 = 1e-4;
const OF_THETA: f64 = 0.1;
/// ... or so many rounds are over.
const MOST_ROUNDS: usize = 20;
/// A direction is left out where less than this fraction of its length is independent of the others.
const DEPENDENT: f64 = 1e-6;

/// Motions that are soft, and their forces.
pub struct CoarseSpace {
    /// W, n x motions, softest first.
    pub motions: Mat<f64>,
    /// A W, n x motions.
    pub forces: Mat<f64>,
}

/// Motions W (n x `count` or up to two more, fewer where n is less), ascending in theta, with
/// `W^T diag(weights) W = 1` and `W^T A W = diag(theta)`. They approximately span the eigenvectors `A w
/// = theta diag(weights) w` of the smallest theta. A has both triangles stored, and three rows a point.
/// There are none where A is far from positive semi-definite, a weight is not positive, or a number is
/// not finite.
pub fn coarse_space(matrix: MatRef<'_, f64>, weights: &[f64], count: usize) -> CoarseSpace {
    let space = if is_factored(matrix.nrows()) {
        factored(matrix, weights, count)
    } else {
        smooth(matrix, weights, count)
    };
    space.unwrap_or_else(|| CoarseSpace {
        motions: Mat::zeros(matrix.nrows(), 0),
        forces: Mat::zeros(matrix.nrows(), 0),
    })
}

/// Order of the dense matrix that [`coarse_space`] factors for so many unknowns.
pub fn factor_order(unknowns: usize) -> usize {
    if is_factored(unknowns) {
        unknowns
    } else {
        unknowns / 3
    }
}

fn is_factored(unknowns: usize) -> bool {
    unknowns <= MOST_FACTORED
}

/// Motions by inverse iteration with a factor of the matrix.
fn factored(matrix: MatRef<'_, f64>, weights: &[f64], count: usize) -> Option<CoarseSpace> {
    let motions = softest(matrix, weights, count)?;
    append_softest(matrix, weights, motions, 0)
}

/// Smooth motions, with the softest ones found accurately.
fn smooth(matrix: MatRef<'_, f64>, weights: &[f64], count: usize) -> Option<CoarseSpace> {
    are_positive(weights).then_some(())?;
    let of_point = |w: &[f64]| w.iter().sum::<f64>() / 3.0;
    let of_points: Vec<f64> = weights.chunks_exact(3).map(of_point).collect();
    let scalar = softest(laplacian(matrix).as_ref(), &of_points, count.div_ceil(3))?;
    let entry = |i: usize, j: usize| match i % 3 == j % 3 {
        true => scalar[(i / 3, j / 3)],
        false => 0.0,
    };
    let mut motions = Mat::from_fn(matrix.nrows(), 3 * scalar.ncols(), entry);
    orthonormalise(&mut motions, DiagRef::from_slice(weights)).then_some(())?;
    append_softest(matrix, weights, motions, MOST_ROUNDS)
}

/// As many motions as are given, orthonormal in the inner product of the weights, out of those and of
/// what is missing of the softest ones after so many rounds.
fn append_softest(
    matrix: MatRef<'_, f64>,
    weights: &[f64],
    mut motions: Mat<f64>,
    mut rounds: usize,
) -> Option<CoarseSpace> {
    let count = motions.ncols();
    let mut forces = product(matrix, motions.as_ref());
    let mut projected = dense::product(motions.transpose(), forces.as_ref());
    loop {
        let (theta, ritz) = dense::self_adjoint_eigen(projected.as_ref())?;
        let on = |count: usize| {
            [&motions, &forces].map(|of| product(of.as_ref(), ritz.get(.., ..count)))
        };
        let further = match rounds {
            0 => None,
            _ => {
                let soft = theta.iter().filter(|theta| **theta < SOFT).count();
                let soft = soft.max(FEWEST_ACCURATE).min(count);
                further_directions(on(soft), &theta, weights, &motions)
            }
        };
        let Some(further) = further else {
            let [motions, forces] = on(count);
            return Some(CoarseSpace { motions, forces });
        };
        rounds -= 1;
        let mut moved = Mat::zeros(further.nrows(), further.ncols());
        add_symmetric_product(matrix, further.as_ref(), moved.as_mut());
        let across = dense::product(motions.transpose(), moved.as_ref());
        let among = dense::product(further.transpose(), moved.as_ref());
        projected = faer::concat![
            [projected, across.as_ref()],
            [across.transpose(), among.as_ref()]
        ];
        motions = faer::concat![[motions, further]];
        forces = faer::concat![[forces, moved]];
    }
}

/// Directions in which the motions that are not accurate yet are improved, orthonormal to each other
/// and to the basis: what is left of their forces, divided by the weights. `None` where all motions are
/// accurate.
fn further_directions(
    [motions, forces]: [Mat<f64>; 2],
    theta: &[f64],
    weights: &[f64],
    basis: &Mat<f64>,
) -> Option<Mat<f64>> {
    let left = |(j, theta): (usize, &f64)| {
        let columns = motions.col_as_slice(j).iter().zip(forces.col_as_slice(j));
        let left = columns.zip(weights).map(|((x, f), w)| f / w - theta * x);
        let left: Vec<f64> = left.collect();
        let squares = left.iter().zip(weights).map(|(v, w)| w * v * v);
        (squares.sum::<f64>().sqrt() > RESIDUAL.max(OF_THETA * theta)).then_some(left)
    };
    let of_motions = theta[..motions.ncols()].iter().enumerate();
    let left: Vec<Vec<f64>> = of_motions.filter_map(left).collect();
    let left = Mat::from_fn(weights.len(), left.len(), |i, j| left[j][i]);
    let mut directions = independent(&left, weights, DEPENDENT);
    // It is orthogonal to the basis but for rounding.
    let weights = DiagRef::from_slice(weights);
    let weighed = weights * &directions;
    let shared = dense::product(basis.transpose(), weighed.as_ref());
    directions -= product(basis.as_ref(), shared.as_ref());
    (directions.ncols() > 0 && orthonormalise(&mut directions, weights)).then_some(directions)
}

/// Orthonormal columns in the inner product of `weights`, in their order, without those of which less
/// than the fraction `least` of their length is independent of earlier ones.
pub fn independent(columns: &Mat<f64>, weights: &[f64], least: f64) -> Mat<f64> {
    let root: Vec<f64> = weights.iter().map(|w| w.sqrt()).collect();
    let mut kept: Vec<Vec<f64>> = vec![];
    for j in 0..columns.ncols() {
        let column = columns.col_as_slice(j).iter().zip(&root);
        let mut column: Vec<f64> = column.map(|(v, r)| v * r).collect();
        let before = norm(&column);
        for _ in 0..2 {
            for earlier in &kept {
                axpy(-dot(earlier, &column), earlier, &mut column);
            }
        }
        let left = norm(&column);
        if left > least * before {
            column.iter_mut().for_each(|v| *v /= left);
            kept.push(column);
        }
    }
    Mat::from_fn(columns.nrows(), kept.len(), |i, j| kept[j][i] / root[i])
}

fn are_positive(weights: &[f64]) -> bool {
    weights.iter().all(|w| *w > 0.0 && w.is_finite())
}

/// Laplacian of the graph of the points, whose edges have the Frobenius norms of the blocks between
/// them for weights.
fn laplacian(matrix: MatRef<'_, f64>) -> Mat<f64> {
    let points = matrix.nrows() / 3;
    let mut laplacian = Mat::<f64>::zeros(points, points);
    let columns = laplacian.par_col_iter_mut().enumerate();
    columns.for_each(|(point, mut column)| {
        for (i, entry) in column.rb_mut().iter_mut().enumerate() {
            let block = (0..9).map(|k| matrix[(3 * i + k % 3, 3 * point + k / 3)]);
            let norm = block.map(|v| v * v).sum::<f64>().sqrt();
            *entry = if i == point { 0.0 } else { -norm };
        }
        let sum: f64 = column.rb().iter().sum();
        column[point] = -sum;
    });
    laplacian
}

/// Vectors that approximately span the `count` softest of a positive semi-definite matrix, orthonormal
/// in the inner product of the weights.
fn softest(matrix: MatRef<'_, f64>, weights: &[f64], count: usize) -> Option<Mat<f64>> {
    let count = count.min(matrix.nrows());
    (are_positive(weights) && count > 0).then_some(())?;
    let factor = SHIFTS.iter().find_map(|shift| {
        let mut shifted = matrix.to_owned();
        for (i, w) in weights.iter().enumerate() {
            shifted[(i, i)] += shift * w;
        }
        parallel::cholesky(shifted)
    })?;
    let weights = DiagRef::from_slice(weights);
    // Vectors that are the same on every machine.
    let mut vectors = Mat::from_fn(matrix.nrows(), count, |i, j| {
        ((i * (j + 1)) as f64 * 0.618_033_988_75 + (j * j) as f64).sin()
    });
    for _ in 0..ROUNDS {
        orthonormalise(&mut vectors, weights).then_some(())?;
        vectors = weights * &vectors;
        parallel::solve_in_place(factor.as_ref(), vectors.as_mut());
    }
    orthonormalise(&mut vectors, weights).then_some(vectors)
}

/// Makes the columns orthonormal in the inner product of `weights`. Returns `false` where they are
/// dependent.
fn orthonormalise(motions: &mut Mat<f64>, weights: DiagRef<'_, f64>) -> bool {
    // Twice: one pass loses accuracy in proportion to the condition of the columns.
    for _ in 0..2 {
        let weighted = weights * &*motions;
        let gram = dense::product(motions.transpose(), weighted.as_ref());
        let Ok(factor) = dense::cholesky(gram) else {
            return false;
        };
        let mut rows = motions.transpose().to_owned();
        solve_lower_triangular_in_place(factor.as_ref(), rows.as_mut(), Par::Seq);
        *motions = rows.transpose().to_owned();
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::lattice::Lattice;
    use nalgebra_sparse::CscMatrix;

    type Way = fn(MatRef<'_, f64>, &[f64], usize) -> Option<CoarseSpace>;

    /// Stiffness of a face of a block that nothing holds, from which all else is condensed.
    fn face() -> Mat<f64> {
        let block = Lattice::new([4, 11, 11], 3e7, 1.0, 0.4);
        let number: Vec<_> = (0..block.nodes()).map(Some).collect();
        let (k, _) = block.matrices(&number, block.nodes());
        condensed(&k, 11 * 11)
    }

    /// Stiffness of the last nodes, from which all others are condensed.
    fn condensed(k: &CscMatrix<f64>, nodes: usize) -> Mat<f64> {
        let k = crate::sparse::dense(k);
        let inside = k.nrows() - 3 * nodes;
        let coupling = k.get(..inside, inside..);
        let mut moved = coupling.to_owned();
        let factor = dense::cholesky(k.get(..inside, ..inside).to_owned()).unwrap();
        dense::solve_in_place(factor.as_ref(), moved.as_mut());
        k.get(inside.., inside..) - dense::product(coupling.transpose(), moved.as_ref())
    }

    fn diagonal(k: &Mat<f64>) -> Vec<f64> {
        (0..k.nrows()).map(|i| k[(i, i)]).collect()
    }

    #[test]
    fn what_is_left_beside_them_is_stiff() {
        let k = face();
        let (n, weights) = (k.nrows(), diagonal(&k));
        let root = |i: usize| weights[i].sqrt();
        let scaled = Mat::from_fn(n, n, |i, j| k[(i, j)] / (root(i) * root(j)));
        let exact = dense::self_adjoint_eigenvalues(scaled.as_ref()).unwrap();
        let count = 39;
        for (way, share) in [(smooth as Way, 0.5), (factored, 0.75)] {
            let motions = way(k.as_ref(), &weights, count).unwrap().motions;
            assert_eq!(motions.ncols(), count);
            let q = Mat::from_fn(n, count, |i, j| root(i) * motions[(i, j)]);
            let projector = Mat::<f64>::identity(n, n) - &q * q.transpose();
            // The motions themselves are made stiff.
            let left = &projector * &scaled * &projector + 10.0 * (&q * q.transpose());
            let least = dense::lowest_eigenvalue(left.as_ref());
            let best = exact[count];
            assert!(least > share * best, "{least} {best} {:?}", &exact[..9]);
        }
    }

    /// The end of a slender beam moves a hundred times as easily as it is deformed.
    #[test]
    fn the_softest_are_those_of_the_eigenproblem() {
        let beam = Lattice::new([50, 4, 4], 3e7, 1.0, 0.4);
        let k = condensed(&beam.cantilever().0, 16);
        let (n, weights) = (k.nrows(), diagonal(&k));
        let scaled = Mat::from_fn(n, n, |i, j| k[(i, j)] / (weights[i] * weights[j]).sqrt());
        let exact = dense::self_adjoint_eigenvalues(scaled.as_ref()).unwrap();
        let CoarseSpace { motions, forces } = smooth(k.as_ref(), &weights, 12).unwrap();
        let soft = exact.iter().filter(|theta| **theta < SOFT).count();
        assert!(soft >= 2, "{exact:?}");
        for (j, exact) in exact[..soft].iter().enumerate() {
            let theta = motions.col(j).transpose() * forces.col(j);
            assert!((theta - exact).abs() < 1e-7, "{j}: {theta} {exact}");
        }
    }

    #[test]
    fn their_forces_belong_to_them_and_translations_cost_nothing() {
        let k = face();
        let weights = diagonal(&k);
        for (way, count) in [(smooth as Way, 21), (factored, 20)] {
            let CoarseSpace { motions, forces } = way(k.as_ref(), &weights, 20).unwrap();
            assert_eq!(motions.ncols(), count);
            let scale = k.norm_max() * motions.norm_max();
            assert!((&forces - &k * &motions).norm_max() < 1e-12 * scale);
            let theta = motions.transpose() * &forces;
            let weighed = DiagRef::from_slice(&weights) * &motions;
            let one = motions.transpose() * weighed;
            for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
                assert!((one[(i, j)] - f64::from(i == j)).abs() < 1e-12);
                assert!(i == j || theta[(i, j)].abs() < 1e-12);
                assert!(i != j || j == 0 || theta[(j, j)] > theta[(j - 1, j - 1)] - 1e-12);
            }
            assert!((0..3).all(|i| theta[(i, i)].abs() < 1e-10));
            assert!(theta[(3, 3)] > 1e-4, "{}", theta[(3, 3)]);
        }
    }

    #[test]
    fn there_are_none_where_something_is_not_a_number() {
        let k = face();
        let weights = diagonal(&k);
        for way in [smooth as Way, factored] {
            let found = |k: &Mat<f64>, weights: &[f64]| way(k.as_ref(), weights, 9).is_some();
            assert!(found(&k, &weights));
            for wrong in [0.0, -10.0 * k.norm_max(), f64::NAN] {
                let mut weights = weights.clone();
                weights[7] = wrong;
                assert!(!found(&k, &weights));
            }
            let mut broken = k.clone();
            broken[(9, 4)] = f64::NAN;
            broken[(4, 9)] = f64::NAN;
            assert!(!found(&broken, &weights));
            assert!(!found(&Mat::new(), &[]));
        }
        let none = coarse_space(Mat::new().as_ref(), &[], 9);
        assert_eq!([none.motions.ncols(), none.forces.ncols()], [0, 0]);
    }

    #[test]
    fn they_are_those_of_the_dense_eigenproblem() {
        let lattice = Lattice::new([9, 7, 6], 3e7, 1.0, 0.4);
        let (k, _) = lattice.cantilever();
        let k = crate::sparse::dense(&k);
        let weights: Vec<f64> = (0..k.nrows()).map(|i| k[(i, i)]).collect();
        let motions = coarse_space(k.as_ref(), &weights, 40).motions;
        let diagonal = |i, j| if i == j { weights[i] } else { 0.0 };
        let mass = Mat::from_fn(k.nrows(), k.nrows(), diagonal);
        let modes = crate::eigen::dense::modes(k.as_ref(), mass.as_ref()).unwrap();
        for (j, exact) in modes.omega2[..20].iter().enumerate() {
            let w = motions.col(j);
            let theta = w.transpose() * (&k * w);
            let off = if j < 5 { 1e-3 } else { 0.2 };
            assert!((theta / exact - 1.0).abs() < off, "{j}: {theta} {exact}");
            let one = w.transpose() * (&mass * w);
            assert!((one - 1.0).abs() < 1e-10);
        }
    }

    #[test]
    fn a_matrix_with_motions_that_cost_nothing_has_them_first() {
        // A chain that nothing holds.
        let n = 300;
        let k = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 if i == 0 || i == n - 1 => 1.0,
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        let motions = coarse_space(k.as_ref(), &vec![2.0; n], 10).motions;
        let even = 1.0 / (2.0 * n as f64).sqrt();
        assert!((0..n).all(|i| (motions[(i, 0)].abs() - even).abs() < 1e-6 * even));
        let opposite = coarse_space((-k).as_ref(), &vec![2.0; n], 2);
        assert_eq!(opposite.motions.ncols(), 0);
    }
}
