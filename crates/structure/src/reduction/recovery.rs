//! Recovery of the motion of the bodies from relative displacements and modal amplitudes.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;
use serde::{Deserialize, Serialize};

use super::craig_bampton::Interior;
use super::transformation::Transformation;
use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::sparse::{Cholesky, stored, times};

/// Recovery of the motion of the bodies, with one solve for each column.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Recovery {
    pub(super) transformation: Transformation,
    pub(super) factor: Cholesky,
    /// K_gx
    #[serde(with = "stored::sparse_matrix")]
    pub(super) coupling: CscMatrix<f64>,
    /// Phi, stuck modes and residual vectors.
    #[serde(with = "stored::matrix")]
    pub(super) modes: Mat<f64>,
    /// Steady load on g, N.
    #[serde(with = "stored::numbers")]
    pub(super) load_n: Vec<f64>,
    /// Interior of each body that was reduced by itself.
    pub(super) interiors: Vec<Option<Interior>>,
}

impl Recovery {
    /// Number of stuck modes and residual vectors.
    pub fn mode_count(&self) -> usize {
        self.modes.ncols()
    }

    /// Motion of all free degrees of freedom of each body, one column per column of `x` and `modal`
    /// (amplitudes of one harmonic, or instants), without the static load: `g = Psi X + Phi q`.
    pub fn full_motion(&self, x: MatRef<'_, f64>, modal: MatRef<'_, f64>) -> Vec<Mat<f64>> {
        let mut g = times(&self.coupling, x);
        self.factor.solve_in_place(g.as_mut());
        let g = product(self.modes.as_ref(), modal) - g;
        self.bodies(g.as_ref(), x)
    }

    /// Motion of all free degrees of freedom of each body in the first `count` modes, one a column.
    pub fn modes(&self, count: usize) -> Vec<Mat<f64>> {
        let still = Mat::zeros(self.coupling.ncols(), count);
        let each = Mat::<f64>::identity(self.modes.ncols(), count);
        self.full_motion(still.as_ref(), each.as_ref())
    }

    /// Static displacement of all free degrees of freedom of each body, under the steady load and
    /// the contact forces that belong to the static `x`. It is exact, whatever the number of modes
    /// kept.
    pub fn full_static(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let x = MatRef::from_column_major_slice(x, x.len(), 1);
        let mut g = times(&self.coupling, x);
        for (g, f) in g.col_as_slice_mut(0).iter_mut().zip(&self.load_n) {
            *g = f - *g;
        }
        self.factor.solve_in_place(g.as_mut());
        let bodies = self.bodies(g.as_ref(), x).into_iter();
        bodies.map(|u| u.col_as_slice(0).to_vec()).collect()
    }

    fn bodies(&self, g: MatRef<'_, f64>, x: MatRef<'_, f64>) -> Vec<Mat<f64>> {
        let coordinates = self.transformation.scatter(g, x);
        let bodies = coordinates.into_iter().zip(&self.interiors);
        bodies
            .map(|(coordinates, interior)| match interior {
                Some(interior) => interior.motion(coordinates.as_ref()),
                None => coordinates,
            })
            .collect()
    }
}
