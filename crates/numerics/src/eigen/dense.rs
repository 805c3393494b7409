//! All modes of a dense pencil.
//!
//! The stiffness is factored, K = L L^T, and L^-1 M L^-T y = y / omega^2 solved. The low modes,
//! which matter most, are then right to rounding however high the highest one is. With the mass
//! factored their relative error would be omega_max^2 / omega^2 times larger.

use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Mat, MatRef, Par, unzip, zip};

use super::{EigenError, LastModes, Modes, fix_signs, normalise};
use crate::dense::parallel::product;
use crate::dense::{self_adjoint_eigen, symmetrised};

/// All modes, ascending; the strict upper triangles are not read for K, and M is symmetrised.
///
/// # Errors
/// [`EigenError::StiffnessNotPositive`], [`EigenError::MassNotPositive`], [`EigenError::Dense`].
pub fn modes(stiffness: MatRef<'_, f64>, mass: MatRef<'_, f64>) -> Result<Modes, EigenError> {
    Ok(pencil(stiffness, mass, stiffness.nrows(), Massless::Refused)?.0)
}

/// The `count` lowest of the [`modes`], or a few more as `last` says; fewer where fewer motions have
/// mass.
///
/// # Errors
/// The errors of [`modes`].
pub(super) fn lowest_modes(
    stiffness: MatRef<'_, f64>,
    mass: MatRef<'_, f64>,
    count: usize,
    last: LastModes,
) -> Result<Modes, EigenError> {
    let most = match last {
        LastModes::Given => count,
        LastModes::WithEqual => stiffness.nrows(),
    };
    let (modes, with_mass) = pencil(stiffness, mass, most, Massless::LeftOut)?;
    let modes = separate(stiffness, mass, modes.lowest(with_mass))?;
    let count = count.min(modes.count());
    Ok(modes.lowest(last.end(&modes.omega2, count)))
}

/// Modes whose digits rounding of the largest 1 / omega^2 has not taken: those far above the first
/// ones are found again in the space that they span.
fn separate(
    stiffness: MatRef<'_, f64>,
    mass: MatRef<'_, f64>,
    modes: Modes,
) -> Result<Modes, EigenError> {
    let Some(first) = modes.omega2.first() else {
        return Ok(modes);
    };
    let near = modes.omega2.partition_point(|w2| SEPARATE * w2 <= *first);
    if near == modes.count() {
        return Ok(modes);
    }
    let far = modes.vectors.get(.., near..);
    let on_far = |a: MatRef<'_, f64>| {
        let product = product(far.transpose(), product(a, far).as_ref());
        symmetrised(product.as_ref())
    };
    let (k, m) = (on_far(stiffness), on_far(mass));
    let (again, with_mass) = pencil(k.as_ref(), m.as_ref(), k.nrows(), Massless::LeftOut)?;
    let again = separate(k.as_ref(), m.as_ref(), again.lowest(with_mass))?;
    let mut vectors = Mat::zeros(modes.vectors.nrows(), near + again.count());
    let (mut kept, mut found) = vectors.as_mut().split_at_col_mut(near);
    kept.copy_from(modes.vectors.get(.., ..near));
    found.copy_from(product(far, again.vectors.as_ref()));
    fix_signs(&mut vectors);
    Ok(Modes {
        omega2: [&modes.omega2[..near], &again.omega2].concat(),
        vectors,
    })
}

/// All modes, ascending, and the number of them that have mass. A motion without mass, or with one
/// that is rounding beside the lowest mode, follows statically. It comes last, with a frequency so
/// high that nothing but its stiffness counts.
///
/// # Errors
/// The errors of [`modes`]; [`EigenError::MassNotPositive`] where the mass of a motion is negative,
/// or no motion has any.
pub fn modes_with_massless(
    stiffness: MatRef<'_, f64>,
    mass: MatRef<'_, f64>,
) -> Result<(Modes, usize), EigenError> {
    pencil(stiffness, mass, stiffness.nrows(), Massless::Followed)
}

/// Treatment of motions without mass.
#[derive(Clone, Copy, PartialEq)]
enum Massless {
    Refused,
    LeftOut,
    Followed,
}

/// Rounding of an eigenvalue of a matrix, in units of the last place of the largest one and for each
/// row.
const MASSLESS: f64 = 16.0;
/// Ratio of the first omega^2 to another one below which this one is found again.
const SEPARATE: f64 = 1e-7;

/// A negative 1 / omega^2 down to this, relative to the largest one, is rounding.
const NEGATIVE: f64 = 1e-10;

/// The `count` lowest modes, and the number of them that have mass.
fn pencil(
    stiffness: MatRef<'_, f64>,
    mass: MatRef<'_, f64>,
    count: usize,
    massless: Massless,
) -> Result<(Modes, usize), EigenError> {
    let factor = cholesky(stiffness)?;
    let n = factor.nrows();
    if n == 0 || count == 0 {
        return Ok((Modes::none(n), 0));
    }
    // L^-1 M L^-T, by two solves and two transposes.
    let mut whitened = mass.to_owned();
    solve_lower_triangular_in_place(factor.as_ref(), whitened.as_mut(), Par::Seq);
    let mut whitened = whitened.transpose().to_owned();
    solve_lower_triangular_in_place(factor.as_ref(), whitened.as_mut(), Par::Seq);
    let whitened = symmetrised(whitened.as_ref());
    let (mut inverses, vectors) = largest_first(whitened)?;
    inverses.truncate(count);
    let mut vectors = vectors.get(.., ..inverses.len()).to_owned();
    let rounding = match massless {
        Massless::LeftOut => MASSLESS * n as f64,
        Massless::Refused | Massless::Followed => 1.0,
    };
    let least = rounding * f64::EPSILON * inverses[0];
    let is_mass = |x: &f64| match massless {
        Massless::Refused => *x > least,
        Massless::LeftOut | Massless::Followed => {
            inverses[0] > 0.0 && *x >= -NEGATIVE * inverses[0]
        }
    };
    if let Some(mode) = inverses.iter().position(|x| !is_mass(x)) {
        return Err(EigenError::MassNotPositive { mode: mode + 1 });
    }
    solve_upper_triangular_in_place(factor.transpose(), vectors.as_mut(), Par::Seq);
    // Of unit stiffness so far: its modal mass is 1 / omega^2.
    let weighted = product(mass, vectors.as_ref());
    normalise(&mut vectors, weighted.as_ref(), least);
    let with_mass = inverses.partition_point(|x| *x > least);
    let modes = Modes {
        omega2: inverses.iter().map(|x| x.max(least).recip()).collect(),
        vectors,
    };
    Ok((modes, with_mass))
}

/// Eigenvalues of a symmetric matrix (lower triangle read), the largest first, with one vector per
/// column.
///
/// # Errors
/// [`EigenError::Dense`].
pub(super) fn largest_first(mut a: Mat<f64>) -> Result<(Vec<f64>, Mat<f64>), EigenError> {
    let n = a.nrows();
    // Divide and conquer deflates against unit vectors: the eigenvalues, 1 / omega^2, must be of
    // order one, or all but the largest are lost in the thresholds.
    let scale = a.norm_max();
    if scale > 0.0 && scale.is_finite() {
        zip!(a.as_mut()).for_each(|unzip!(v)| *v /= scale);
    }
    let (values, vectors) =
        self_adjoint_eigen(a.as_ref()).ok_or(EigenError::Dense { unknowns: n })?;
    let values = values.iter().rev().map(|x| scale * x).collect();
    Ok((values, vectors.reverse_cols().to_owned()))
}

/// Lower Cholesky factor of a dense positive definite matrix (lower triangle read).
///
/// # Errors
/// [`EigenError::StiffnessNotPositive`] on a negative pivot or one that is zero except for
/// rounding.
pub(super) fn cholesky(a: MatRef<'_, f64>) -> Result<Mat<f64>, EigenError> {
    let n = a.nrows();
    let factor = crate::dense::cholesky(a.to_owned())
        .map_err(|pivot| EigenError::StiffnessNotPositive { pivot })?;
    for i in 0..n {
        // A pivot this small is rounding (see `sparse/factor.rs`).
        let is_stiffness = factor[(i, i)].powi(2) > 1e-12 * a[(i, i)];
        if !is_stiffness {
            return Err(EigenError::StiffnessNotPositive { pivot: i });
        }
    }
    Ok(factor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::dense;
    use dovetail_testkit::lattice::Lattice;

    #[test]
    fn modes_diagonalise_both_matrices() {
        let lattice = Lattice::new([5, 3, 3], 4e7, 0.1, 0.0);
        let (k, m) = lattice.cantilever();
        let (k, m) = (dense(&k), dense(&m));
        let modes = modes(k.as_ref(), m.as_ref()).unwrap();
        assert!(modes.omega2.is_sorted());
        let project = |a: &Mat<f64>| modes.vectors.transpose() * (a * &modes.vectors);
        let unit = Mat::<f64>::identity(k.nrows(), k.nrows());
        assert!((project(&m) - &unit).norm_max() < 1e-11);
        let top = modes.omega2[modes.count() - 1];
        let spectrum = Mat::from_fn(k.nrows(), k.nrows(), |i, j| {
            if i == j { modes.omega2[i] } else { 0.0 }
        });
        assert!((project(&k) - spectrum).norm_max() < 1e-11 * top);
    }

    /// Checks the modes of n equal masses between equal springs, both ends held: omega_k = 2
    /// sqrt(k/m) sin(k pi / (2 (n+1))).
    fn check_chain(n: usize, spring_n_m: f64, mass_kg: f64, tolerance: f64) {
        let k = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 2.0 * spring_n_m,
            1 => -spring_n_m,
            _ => 0.0,
        });
        let m = Mat::from_fn(n, n, |i, j| if i == j { mass_kg } else { 0.0 });
        let modes = modes(k.as_ref(), m.as_ref()).unwrap();
        for (i, w2) in modes.omega2.iter().enumerate() {
            let angle = (i + 1) as f64 * std::f64::consts::PI / (2 * (n + 1)) as f64;
            let exact = 4.0 * spring_n_m / mass_kg * angle.sin().powi(2);
            assert!(
                (w2 / exact - 1.0).abs() < tolerance,
                "{i}: {w2:e} {exact:e}"
            );
        }
    }

    #[test]
    fn a_chain_has_its_textbook_frequencies_from_lowest_to_highest() {
        check_chain(40, 1e9, 0.25, 1e-11);
    }

    #[test]
    fn high_modes_are_right_in_any_unit() {
        // The chain again, larger than what the eigenvalue solver treats in one piece. Its
        // eigenvalues 1/omega^2 are of order 1e-17 to 1e-12 in SI; scaled by 1e12 nothing but the
        // unit changes.
        for unit in [1.0, 1e12] {
            check_chain(300, 1e12, 1e-5 * unit, 1e-9);
        }
    }

    /// Two masses on springs, and between them a point without any: under any static load the modes
    /// move it as the springs do.
    #[test]
    fn a_motion_without_mass_follows_statically() {
        let k = Mat::from_fn(3, 3, |i, j| {
            [[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 4.0]][i][j]
        });
        let masses = |kg: [f64; 3]| Mat::from_fn(3, 3, |i, j| if i == j { kg[i] } else { 0.0 });
        let m = masses([2.0, 0.0, 1.0]);
        assert!(modes(k.as_ref(), m.as_ref()).is_err());
        let (modes, with_mass) = modes_with_massless(k.as_ref(), m.as_ref()).unwrap();
        assert_eq!((modes.count(), with_mass), (3, 2));
        // K condensed on the masses: 2.5, -0.5, 3.5.
        for w2 in &modes.omega2[..2] {
            let determinant = (2.5 - 2.0 * w2) * (3.5 - w2) - 0.25;
            assert!(determinant.abs() < 1e-12, "{w2}: {determinant:e}");
        }
        // sum phi phi^T / omega^2 = K^-1.
        let v = &modes.vectors;
        let compliance = Mat::from_fn(3, 3, |i, j| {
            (0..3)
                .map(|r| v[(i, r)] * v[(j, r)] / modes.omega2[r])
                .sum::<f64>()
        });
        let product = &k * &compliance;
        assert!((product - Mat::<f64>::identity(3, 3)).norm_max() < 1e-12);
        let negative = masses([2.0, -0.1, 1.0]);
        assert!(modes_with_massless(k.as_ref(), negative.as_ref()).is_err());
        assert!(modes_with_massless(k.as_ref(), Mat::zeros(3, 3).as_ref()).is_err());
    }

    #[test]
    fn what_is_not_positive_is_an_error() {
        let k = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { -1.0 });
        let unit = Mat::<f64>::identity(2, 2);
        assert!(matches!(
            modes(k.as_ref(), unit.as_ref()),
            Err(EigenError::StiffnessNotPositive { pivot: 1 })
        ));
        assert!(matches!(
            modes(unit.as_ref(), Mat::from_fn(2, 2, |_, _| 1.0).as_ref()),
            Err(EigenError::MassNotPositive { mode: 2 })
        ));
        assert_eq!(
            modes(Mat::zeros(0, 0).as_ref(), Mat::zeros(0, 0).as_ref())
                .unwrap()
                .count(),
            0
        );
    }
}
