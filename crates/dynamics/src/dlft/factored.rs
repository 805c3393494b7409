//! The Jacobian formed and factored on the pairs that move, with a border where there is one.

use super::balance::{Balance, Jacobian};
use super::border::{Border, Equations, put_back, remaining_right_side, restrict};
use dovetail_numerics::dense::{Lu, product};
use dovetail_numerics::spectrum::{cosine, sine};
use faer::Mat;

/// Fraction of eps that is added to a Jacobian which is exactly singular: at a frequency at which nothing
/// opposes a motion that nothing excites.
const SHIFT: f64 = 1e-9;

/// Factor of the Jacobian on the pairs that move. In the rows of the others it is eps.
pub(crate) struct FactoredJacobian {
    jacobian: Jacobian,
    /// Positions of the unknowns of the pairs that move, among those of all pairs.
    columns: Vec<usize>,
    lu: Lu,
}

impl FactoredJacobian {
    /// The columns of the border are zero in the rows of pairs that stick throughout.
    pub(crate) fn new(balance: &Balance, jacobian: Jacobian, border: Option<&Border>) -> Self {
        let columns: Vec<usize> = jacobian
            .active
            .iter()
            .flat_map(|p| 3 * p..3 * p + 3)
            .collect();
        let mut inner = formed(balance, &jacobian, &jacobian.active);
        let n = balance.unknowns_per_block();
        let factor = |inner: &Mat<f64>| {
            Lu::new(match border {
                Some(border) => border.restricted(n, &columns).around(inner),
                None => inner.clone(),
            })
        };
        let mut lu = factor(&inner);
        if lu.is_singular() {
            for (i, column) in columns.iter().cycle().take(inner.nrows()).enumerate() {
                inner[(i, i)] += SHIFT * balance.eps_at(*column);
            }
            lu = factor(&inner);
        }
        Self {
            jacobian,
            columns,
            lu,
        }
    }

    /// Solves J x = right with the border that the factor was made with. `None` where the Jacobian is
    /// singular.
    pub(crate) fn solve(
        &self,
        balance: &Balance,
        equations: Equations<'_>,
        x: &mut [f64],
    ) -> Option<()> {
        let (n, width) = (
            balance.unknowns_per_block(),
            balance.setting.fourier.width(),
        );
        let (columns, unknowns) = (&self.columns, n * width);
        let unbalanced =
            |forces: &[f64]| restrict(&self.jacobian.unbalanced_part(forces, n), n, columns);
        let mut solution = remaining_right_side(balance, columns, equations, x, unbalanced);
        self.lu.solve_column_in_place(&mut solution);
        let (own, further) = solution.split_at(columns.len() * width);
        put_back(own, n, columns, x);
        x[unknowns..].copy_from_slice(further);
        x.iter().all(|v| v.is_finite()).then_some(())
    }

    /// Returns `true` if the determinant of the Jacobian with its border is negative. Its sign does not
    /// depend on the pairs that stick: eps is positive.
    pub(crate) fn has_negative_determinant(&self) -> bool {
        self.lu.has_negative_determinant()
    }
}

/// J = (I - D)(Lambda - eps) + eps on some pairs, which are ascending and contain those that move.
///
/// Lambda couples no harmonic with another, so that (I - D) is applied to one harmonic after the
/// other.
pub(crate) fn formed(balance: &Balance, jacobian: &Jacobian, pairs: &[usize]) -> Mat<f64> {
    let width = balance.setting.fourier.width();
    let (m, full) = (3 * pairs.len(), 3 * width);
    let columns: Vec<usize> = pairs.iter().flat_map(|p| 3 * p..3 * p + 3).collect();
    let mut out = Mat::<f64>::zeros(m * width, m * width);
    let derivatives: Vec<Option<&Vec<f64>>> = {
        let mut moving = jacobian.active.iter().zip(&jacobian.derivatives).peekable();
        let mut of = |pair: &usize| moving.next_if(|(p, _)| *p == pair).map(|(_, d)| d);
        pairs.iter().map(&mut of).collect()
    };
    for k in 0..=balance.stiffness.harmonics() {
        let blocks: Vec<usize> = if k == 0 {
            vec![0]
        } else {
            vec![cosine(k), sine(k)]
        };
        let size = blocks.len();
        let stiffness = without_eps(balance, k, &columns);
        for (pair, derivative) in derivatives.iter().enumerate() {
            let Some(derivative) = derivative else {
                continue;
            };
            // Rows and columns of D by component and block, those of Lambda by block and unknown.
            let own = Mat::from_fn(full, 3 * size, |i, j| {
                derivative[i * full + j / size * width + blocks[j % size]]
            });
            let rows = Mat::from_fn(3 * size, size * m, |i, j| {
                stiffness[(i % size * m + 3 * pair + i / size, j)]
            });
            let moved = product(own.as_ref(), rows.as_ref());
            for (j, column) in (0..size * m).map(|j| (j, blocks[j / m] * m + j % m)) {
                let into = out.col_as_slice_mut(column);
                let moved = moved.col_as_slice(j);
                for (block, into) in into.chunks_exact_mut(m).enumerate() {
                    (0..3).for_each(|c| into[3 * pair + c] = -moved[c * width + block]);
                }
                for i in 0..3 * size {
                    into[blocks[i % size] * m + 3 * pair + i / size] += rows[(i, j)];
                }
            }
        }
    }
    for (i, column) in columns.iter().cycle().take(m * width).enumerate() {
        out[(i, i)] += balance.eps_at(*column);
    }
    out
}

/// Lambda - eps of harmonic k on some unknowns: for k > 0 its cosine and its sine.
fn without_eps(balance: &Balance, k: usize, columns: &[usize]) -> Mat<f64> {
    let m = columns.len();
    let mut out = if k == 0 {
        let mut stiffness = balance.setting.system.problem.reduced.stiffness.clone();
        if let Some(retention) = balance.retention() {
            retention.add_to_matrix(&mut stiffness);
        }
        Mat::from_fn(m, m, |i, j| stiffness[(columns[i], columns[j])])
    } else {
        let [re, im] = balance.stiffness.formed(k);
        Mat::from_fn(2 * m, 2 * m, |i, j| {
            let at = (columns[i % m], columns[j % m]);
            match (i < m, j < m) {
                (true, true) | (false, false) => re[at],
                (true, false) => im[at],
                (false, true) => -im[at],
            }
        })
    };
    for i in 0..out.nrows() {
        out[(i, i)] -= balance.eps_at(columns[i % m]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{differences, sample_points_of_waves_too};
    use dovetail_testkit::differences::assert_close;

    #[test]
    fn the_dense_jacobian_is_that_by_differences() {
        for (what, balance, u) in &sample_points_of_waves_too() {
            let jacobian = balance.linearise(&balance.evaluate(u));
            let pairs: Vec<usize> = (0..balance.unknowns_per_block() / 3).collect();
            let exact = formed(balance, &jacobian, &pairs);
            assert_close(&exact, &differences(balance, u), 1e-7, what);
        }
    }

    /// The factor on the pairs that move against one of the whole matrix, with a border as a curve has
    /// it: its columns are zero where pairs stick.
    #[test]
    fn the_factor_solves_the_whole_system_and_has_the_sign_of_its_determinant() {
        let mut stuck = 0;
        for (what, balance, u) in &sample_points_of_waves_too() {
            let n = balance.unknowns_per_block();
            let wave = |factor: f64, count: usize| -> Vec<f64> {
                (0..count).map(|i| (factor * i as f64).cos()).collect()
            };
            let jacobian = || balance.linearise(&balance.evaluate(u));
            stuck += n / 3 - jacobian().active.len();
            let border = |sign: f64| Border {
                columns: vec![jacobian().unbalanced_part(&wave(1.3, u.len()), n)],
                rows: vec![wave(0.7, u.len()).iter().map(|r| sign * r).collect()],
                corner: vec![vec![sign]],
            };
            let mut signs = vec![];
            for border in [None, Some(border(1.0)), Some(border(-1.0))] {
                let pairs: Vec<usize> = (0..n / 3).collect();
                let whole = formed(balance, &jacobian(), &pairs);
                let whole = match &border {
                    Some(border) => border.around(&whole),
                    None => whole,
                };
                let whole = Lu::new(whole);
                let right = wave(0.4, u.len() + usize::from(border.is_some()));
                let mut expected = right.clone();
                whole.solve_column_in_place(&mut expected);
                let found = FactoredJacobian::new(balance, jacobian(), border.as_ref());
                let mut x = vec![0.0; right.len()];
                let equations = Equations {
                    border: border.as_ref(),
                    right: &right,
                };
                found.solve(balance, equations, &mut x).unwrap();
                let size = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                let apart = x.iter().zip(&expected).map(|(x, e)| (x - e).abs());
                assert!(apart.fold(0.0, f64::max) < 1e-8 * size, "{what}");
                let sign = found.has_negative_determinant();
                assert_eq!(sign, whole.has_negative_determinant(), "{what}");
                signs.push(sign);
            }
            assert_ne!(signs[1], signs[2], "{what}");
        }
        assert!(stuck > 0);
    }
}
