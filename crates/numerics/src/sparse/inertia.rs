//! Inertia of an indefinite matrix by a multifrontal LDL^T that keeps no factor (Duff, Reid, ACM
//! Trans. Math. Softw. 9 (1983) 302-325): a count of the negative pivots, on all threads. There is
//! no pivoting, as in [`Ldlt`](super::factor::Ldlt).

use faer::MatMut;
use faer::prelude::{IntoConst, Reborrow, ReborrowMut};
use nalgebra_sparse::CscMatrix;

use super::fronts::{BadPivot, Contribution, Pivots, Tree, factor_front, schur_complement};
use super::operations::sum;
use super::symbolic::{FactorError, Symbolic, check_finite};

/// Number of negative eigenvalues of K - shift M (Sylvester's law). `symbolic` is the analysis of
/// K. If it belongs to another matrix, or M has entries that K has not, the matrix is analysed
/// again.
///
/// # Errors
/// [`FactorError::Singular`] on a zero pivot; those of [`Symbolic::analyse`].
pub fn negative_eigenvalues(
    stiffness: &CscMatrix<f64>,
    shift: f64,
    mass: &CscMatrix<f64>,
    symbolic: &Symbolic,
) -> Result<usize, FactorError> {
    let counted = symbolic
        .check_pattern(stiffness)
        .and_then(|()| check_finite(stiffness))
        .and_then(|()| count(&[(1.0, stiffness), (-shift, mass)], symbolic));
    match counted {
        Err(FactorError::PatternDiffers) => {
            let whole = sum(stiffness, -shift, mass);
            let analysis = Symbolic::analyse(&whole)?;
            check_finite(&whole)?;
            count(&[(1.0, &whole)], &analysis)
        }
        counted => counted,
    }
}

/// Number of negative eigenvalues of the sum of the terms, of which the first has the pattern
/// analysed.
fn count(terms: &[(f64, &CscMatrix<f64>)], symbolic: &Symbolic) -> Result<usize, FactorError> {
    let (Some(supernodes), Some((_, first))) = (symbolic.supernodal(), terms.first()) else {
        return Ok(0);
    };
    let tree = Tree::new(supernodes, symbolic, first);
    let roots = tree.branches(&tree.roots, |s| eliminate(&tree, terms, s))?;
    Ok(roots.iter().map(|(_, negative)| negative).sum())
}

/// Contribution block of a branch to its parent, and the number of its negative pivots.
fn eliminate(
    tree: &Tree<'_>,
    terms: &[(f64, &CscMatrix<f64>)],
    s: usize,
) -> Result<(Contribution, usize), FactorError> {
    let branches = tree.branches(&tree.children[s], |child| eliminate(tree, terms, child))?;
    let width = tree.columns(s).len();
    let mut negative = branches.iter().map(|(_, negative)| negative).sum();
    let contributions = branches.into_iter().map(|(contribution, _)| contribution);
    let mut front = tree
        .front(s, terms, contributions)
        .ok_or(FactorError::PatternDiffers)?;
    factor_front(front.columns(), Pivots::Signed).map_err(|BadPivot| FactorError::Singular {
        dof: tree.new_to_old[tree.columns(s).start],
        share: 0.0,
    })?;
    let children = std::mem::take(&mut front.children);
    let (pivots, lower) = front.columns().into_const().split_at_row(width);
    negative += (0..width).filter(|&j| pivots[(j, j)] < 0.0).count();
    // F_21 L^-T D^-1
    let below = lower.nrows();
    let mut scaled = vec![0.0; below * width];
    let mut scaled = MatMut::from_column_major_slice_mut(&mut scaled, below, width);
    for j in 0..width {
        let pivot = pivots[(j, j)];
        let column = scaled.rb_mut().col_mut(j);
        for (scaled, v) in column.iter_mut().zip(lower.col(j).iter()) {
            *scaled = v / pivot;
        }
    }
    let contribution = schur_complement(width, &[(scaled.rb(), lower)], &children);
    Ok((contribution, negative))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Ldlt;
    use dovetail_testkit::lattice::Lattice;

    #[test]
    fn the_count_is_that_of_the_factor_with_its_pivots() {
        // The second one has fronts of several blocks.
        for shape in [[7, 5, 4], [12, 18, 18]] {
            let lattice = Lattice::new(shape, 3e7, 0.2, 0.4);
            let (k, m) = lattice.cantilever();
            let symbolic = Symbolic::analyse(&k).unwrap();
            let mut seen = Vec::new();
            for sigma in [0.0, 6e7, 4e8] {
                let found = negative_eigenvalues(&k, sigma, &m, &symbolic).unwrap();
                let shifted = sum(&k, -sigma, &m);
                let expected = Ldlt::factor(&shifted).unwrap().negative_pivots();
                assert_eq!(found, expected);
                seen.push(found);
            }
            assert!(seen[0] == 0 && 0 < seen[1] && seen[1] < seen[2], "{seen:?}");
        }
    }

    #[test]
    fn other_patterns_and_nothing_at_all() {
        let mut diagonal = CscMatrix::identity(9);
        diagonal.values_mut()[4] = -2.0;
        diagonal.values_mut()[8] = -1.0;
        let none = CscMatrix::zeros(0, 0);
        let other = Symbolic::analyse(&none).unwrap();
        let count = |shift: f64, mass: &CscMatrix<f64>| {
            negative_eigenvalues(&diagonal, shift, mass, &other)
        };
        let unit = CscMatrix::identity(9);
        assert_eq!(count(0.0, &unit).unwrap(), 2);
        assert_eq!(count(1.5, &unit).unwrap(), 9);
        assert!(matches!(
            count(1.0, &unit),
            Err(FactorError::Singular { .. })
        ));
        // A mass with entries where the stiffness has none.
        let mut far = nalgebra_sparse::CooMatrix::from(&unit);
        far.push(0, 7, 5.0);
        far.push(7, 0, 5.0);
        assert_eq!(count(0.5, &CscMatrix::from(&far)).unwrap(), 3);
        assert_eq!(negative_eigenvalues(&none, 0.0, &none, &other).unwrap(), 0);
    }
}
