//! Small algebra on the matrices of a body, and fields at its nodes.

pub use dovetail_numerics::space::cross;
use dovetail_numerics::sparse::{Cholesky, submatrix};
use dovetail_solver::fem::assemble_body;
use dovetail_solver::fem::statics::SolveFailure;
use dovetail_solver::model::Material;
use dovetail_solver::model::{Body, NodeMotion};
use dovetail_solver::structure::BodyMatrices;
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Par, Side};
use nalgebra_sparse::CscMatrix;

pub fn solve(a: &CscMatrix<f64>, b: &[f64]) -> Result<Vec<f64>, SolveFailure> {
    let triplets: Vec<_> = a
        .triplet_iter()
        .map(|(i, j, v)| Triplet::new(i, j, *v))
        .collect();
    let sparse = SparseColMat::<usize, f64>::try_new_from_triplets(a.nrows(), a.ncols(), &triplets)
        .map_err(|e| SolveFailure::Factorisation(format!("{e:?}").into()))?;
    let factor = sparse
        .sp_cholesky(Side::Lower)
        .map_err(|_| SolveFailure::NotPositiveDefinite { dof: 0 })?;
    let x = factor.solve(Mat::from_fn(b.len(), 1, |i, _| b[i]));
    Ok((0..b.len()).map(|i| x[(i, 0)]).collect())
}

/// Solves K u = `load` for the displacements that are not given, m; `u` has those that are.
pub fn solve_inside(
    k: &CscMatrix<f64>,
    load: &[f64],
    is_given: impl Fn(usize) -> bool,
    u: &mut [f64],
) {
    let inner: Vec<usize> = (0..u.len()).filter(|dof| !is_given(*dof)).collect();
    inner.iter().for_each(|&dof| u[dof] = 0.0);
    let given = times(k, u);
    let mut x: Vec<f64> = inner.iter().map(|&dof| load[dof] - given[dof]).collect();
    Cholesky::factor(&submatrix(k, &inner, &inner))
        .unwrap()
        .solve_vector(&mut x);
    inner.iter().zip(x).for_each(|(&dof, x)| u[dof] = x);
}

pub fn never(_: &CscMatrix<f64>, _: &[f64]) -> Result<Vec<f64>, SolveFailure> {
    panic!("nothing to solve here")
}

pub fn matrices(body: &Body) -> BodyMatrices {
    assemble_body(body, None, &never).unwrap()
}

pub fn times(a: &CscMatrix<f64>, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; a.nrows()];
    for (i, j, v) in a.triplet_iter() {
        y[i] += v * x[j];
    }
    y
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// First `n` rows and columns.
pub fn dense(a: &CscMatrix<f64>, n: usize) -> Mat<f64> {
    let mut d = Mat::zeros(n, n);
    for (i, j, v) in a.triplet_iter().filter(|(i, j, _)| *i < n && *j < n) {
        d[(i, j)] = *v;
    }
    d
}

/// Ascending eigenvalues of K x = w2 M x on the first `n` unknowns.
pub fn eigenvalues(k: &CscMatrix<f64>, m: &CscMatrix<f64>, n: usize) -> Vec<f64> {
    dense_omega2(&dense(k, n), &dense(m, n))
}

/// Ascending eigenvalues of K x = w2 M x, by faer alone.
pub fn dense_omega2(k: &Mat<f64>, m: &Mat<f64>) -> Vec<f64> {
    use faer::linalg::triangular_solve::solve_lower_triangular_in_place as divide_by;
    let factor = m.llt(Side::Lower).unwrap();
    let mut half = k.clone();
    divide_by(factor.L(), half.as_mut(), Par::Seq);
    let mut whole = half.transpose().to_owned();
    divide_by(factor.L(), whole.as_mut(), Par::Seq);
    whole.self_adjoint_eigenvalues(Side::Lower).unwrap()
}

/// A field at the free nodes of a body.
pub fn field(body: &Body, value: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    let mut x = vec![0.0; 3 * body.dofs.free_nodes()];
    for (motion, position) in body.dofs.nodes.iter().zip(&body.nodes_m) {
        if let NodeMotion::Free(n) = motion {
            x[3 * *n as usize..][..3].copy_from_slice(&value(*position));
        }
    }
    x
}

pub fn apply(h: [[f64; 3]; 3], x: [f64; 3]) -> [f64; 3] {
    h.map(|row| dot(&row, &x))
}

/// Hooke's law written out: sigma = lambda tr(e) I + 2 mu e.
pub fn hooke(h: [[f64; 3]; 3], m: Material) -> [f64; 6] {
    let c = m.young_pa / (1.0 + m.poisson);
    let t = c * m.poisson / (1.0 - 2.0 * m.poisson) * (h[0][0] + h[1][1] + h[2][2]);
    let shear = |r: usize, s: usize| 0.5 * c * (h[r][s] + h[s][r]);
    [
        t + c * h[0][0],
        t + c * h[1][1],
        t + c * h[2][2],
        shear(0, 1),
        shear(1, 2),
        shear(0, 2),
    ]
}
