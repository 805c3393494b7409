//! Reads the folder, and checks its arrays.

use std::path::Path;

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, Par};

use dovetail_dynamics::reduced::{Dashpots, Load, ObservedPoint, ReducedModel, Waves};
use dovetail_dynamics::superelement::Superelement;
use dovetail_numerics::dense;

use crate::description::{
    AREAS, COUPLING, DASHPOTS, DASHPOTS_ON_MODES, DESCRIPTION, Description, EXCITATIONS,
    EXCITATIONS_ON_MODES, MASS, MODEL, OBSERVED_POINTS, OBSERVED_POINTS_ON_MODES, POSITIONS,
    SQUARED_FREQUENCIES, STATIC_LOAD, STATIC_LOAD_ON_MODES, STIFFNESS, description,
};
use crate::{SuperelementError, files, matrix_market};

/// Reads the folder.
///
/// # Errors
/// A file that is missing, malformed, of the wrong shape, or not finite; K or M not symmetric
/// (1e-6 of the largest entry); squared frequencies not positive and ascending; a stiffness or a
/// mass that no body has.
pub fn read(folder: &Path) -> Result<Superelement, SuperelementError> {
    let path = folder.join(DESCRIPTION);
    if !path.exists() && folder.join("K.mtx").exists() {
        let folder = folder.to_owned();
        return Err(SuperelementError::OtherNames { folder });
    }
    if !path.exists() && folder.join(STIFFNESS).exists() {
        let folder = folder.to_owned();
        return Err(SuperelementError::NotWhole { folder });
    }
    let described = description(&path)?;
    check_one_model(folder, described.model.as_deref())?;
    let arrays = Arrays {
        folder,
        pairs: described.pairs,
        modes: described.modes,
    };
    let positions = array(&folder.join(POSITIONS), [described.pairs, 3])?;
    let model = arrays.reduced(&described)?;
    check_stiffness(&folder.join(STIFFNESS), &model.stiffness)?;
    check_mass(&folder.join(MASS), &model)?;
    let position = |i: usize| [0, 1, 2].map(|k| positions[(i, k)]);
    Ok(Superelement {
        model,
        excitations: described.excitations,
        contacts: described.contacts,
        positions_m: (0..described.pairs).map(position).collect(),
        areas_m2: arrays.areas_m2()?,
    })
}

/// Checks that the files which name their model name the same.
fn check_one_model(folder: &Path, described: Option<&str>) -> Result<(), SuperelementError> {
    let mut first = described.map(|model| (folder.join(DESCRIPTION), model.to_owned()));
    for path in files(folder) {
        if path.ends_with(DESCRIPTION) {
            continue;
        }
        let comments = matrix_market::comments(&path).map_err(|e| SuperelementError::Read {
            path: path.clone(),
            message: e.to_string(),
        })?;
        let named = comments.iter().find_map(|line| line.strip_prefix(MODEL));
        let Some(model) = named.map(|name| name.trim().to_owned()) else {
            continue;
        };
        match &first {
            None => first = Some((path, model)),
            Some((_, known)) if *known == model => {}
            Some((other, other_model)) => {
                return Err(SuperelementError::TwoModels {
                    path,
                    model,
                    other: other.clone(),
                    other_model: other_model.clone(),
                });
            }
        }
    }
    Ok(())
}

fn squared_frequencies(folder: &Path, modes: usize) -> Result<Vec<f64>, SuperelementError> {
    let path = folder.join(SQUARED_FREQUENCIES);
    let omega2 = array(&path, [modes, 1])?;
    let omega2 = omega2.col_as_slice(0).to_vec();
    let is_wrong = |i: &usize| omega2[*i] <= 0.0 || (*i > 0 && omega2[*i] < omega2[*i - 1]);
    match (0..omega2.len()).find(is_wrong) {
        Some(i) => Err(SuperelementError::Omega2 {
            path,
            index: i + 1,
            value: omega2[i],
        }),
        None => Ok(omega2),
    }
}

/// Arrays of a folder, whose sizes are known.
struct Arrays<'a> {
    folder: &'a Path,
    pairs: usize,
    modes: usize,
}

impl Arrays<'_> {
    fn reduced(&self, described: &Description) -> Result<ReducedModel, SuperelementError> {
        let (n, m) = (3 * self.pairs, self.modes);
        let has_modes = m > 0;
        let static_on_modes = match has_modes && self.has(STATIC_LOAD_ON_MODES) {
            true => self.vector(STATIC_LOAD_ON_MODES, m)?,
            false => vec![0.0; m],
        };
        let unit_loads = self.read_load_pairs(
            [EXCITATIONS, EXCITATIONS_ON_MODES],
            described.excitations.len(),
        )?;
        let points = &described.observed_points;
        let observed =
            self.read_load_pairs([OBSERVED_POINTS, OBSERVED_POINTS_ON_MODES], points.len())?;
        let observed = points.iter().zip(observed);
        let damping = &described.dashpots_n_s_m;
        let dashpots = self.read_load_pairs([DASHPOTS, DASHPOTS_ON_MODES], damping.len())?;
        let dashpots: Vec<(f64, Load)> = damping.iter().copied().zip(dashpots).collect();
        Ok(ReducedModel {
            dashpots: Dashpots::new(n, m, &dashpots),
            stiffness: symmetric(&self.folder.join(STIFFNESS), n)?,
            mass: symmetric(&self.folder.join(MASS), n)?,
            coupling: match has_modes {
                true => array(&self.folder.join(COUPLING), [n, m])?,
                false => Mat::zeros(n, 0),
            },
            omega2: match has_modes {
                true => squared_frequencies(self.folder, m)?,
                false => Vec::new(),
            },
            bodies_omega2: Vec::new(),
            stuck_modes: m,
            static_load: Load {
                on_x: self.vector(STATIC_LOAD, n)?,
                on_modes: static_on_modes,
            },
            static_parts: Vec::new(),
            unit_loads,
            observations: observed
                .map(|(name, on)| {
                    let quantity = described.quantity(name);
                    ObservedPoint::new(name, on.on_x, on.on_modes).with_quantity(quantity)
                })
                .collect(),
            waves: Waves::default(),
        })
    }

    /// Reads the columns of two files, on X and on the modes.
    fn read_load_pairs(
        &self,
        names: [&str; 2],
        count: usize,
    ) -> Result<Vec<Load>, SuperelementError> {
        let columns = |name: &str, rows: usize| {
            if rows == 0 || count == 0 {
                return Ok(vec![Vec::new(); count]);
            }
            let a = array(&self.folder.join(name), [rows, count])?;
            Ok((0..count).map(|j| a.col_as_slice(j).to_vec()).collect())
        };
        let on_x: Vec<Vec<f64>> = columns(names[0], 3 * self.pairs)?;
        let on_modes = columns(names[1], self.modes)?.into_iter();
        let both = on_x.into_iter().zip(on_modes);
        Ok(both
            .map(|(on_x, on_modes)| Load::new(on_x, on_modes))
            .collect())
    }

    fn areas_m2(&self) -> Result<Option<Vec<f64>>, SuperelementError> {
        if !self.has(AREAS) {
            return Ok(None);
        }
        let areas = self.vector(AREAS, self.pairs)?;
        match areas.iter().position(|a| *a <= 0.0) {
            Some(i) => Err(SuperelementError::Area {
                path: self.folder.join(AREAS),
                index: i + 1,
                value: areas[i],
            }),
            None => Ok(Some(areas)),
        }
    }

    fn has(&self, name: &str) -> bool {
        self.folder.join(name).exists()
    }

    fn vector(&self, name: &str, rows: usize) -> Result<Vec<f64>, SuperelementError> {
        let a = array(&self.folder.join(name), [rows, 1])?;
        Ok(a.col_as_slice(0).to_vec())
    }
}

/// Reads an array with these numbers of rows and columns.
fn array(path: &Path, size: [usize; 2]) -> Result<Mat<f64>, SuperelementError> {
    let unreadable = |message: String| SuperelementError::Read {
        path: path.to_owned(),
        message,
    };
    let a = matrix_market::read(path).map_err(unreadable)?;
    let (r, c) = (a.nrows(), a.ncols());
    if [r, c] != size {
        return Err(SuperelementError::Shape {
            path: path.to_owned(),
            rows: r,
            columns: c,
            expected: format!("{} x {}", size[0], size[1]),
        });
    }
    for j in 0..c {
        if let Some(i) = a.col_as_slice(j).iter().position(|v| !v.is_finite()) {
            return Err(SuperelementError::NotFinite {
                path: path.to_owned(),
                row: i + 1,
                column: j + 1,
            });
        }
    }
    Ok(a)
}

/// Reads a symmetric array. Its two halves are averaged, so that it is symmetric to the last bit.
fn symmetric(path: &Path, n: usize) -> Result<Mat<f64>, SuperelementError> {
    let mut a = array(path, [n, n])?;
    let largest = a.norm_max();
    for j in 0..n {
        for i in 0..j {
            if (a[(i, j)] - a[(j, i)]).abs() > 1e-6 * largest {
                return Err(SuperelementError::NotSymmetric {
                    path: path.to_owned(),
                    row: i + 1,
                    column: j + 1,
                });
            }
            let mean = 0.5 * (a[(i, j)] + a[(j, i)]);
            (a[(i, j)], a[(j, i)]) = (mean, mean);
        }
    }
    Ok(a)
}

/// Amount by which the stiffness may fail to be positive semidefinite, relative to the mean of its
/// diagonal.
const STIFFNESS_LACK: f64 = 1e-3;
/// Amount by which rounding may reduce the mass that the stuck modes leave, relative to the mean of
/// its diagonal.
const MASS_LACK: f64 = 1e-6;

fn check_stiffness(path: &Path, stiffness: &Mat<f64>) -> Result<(), SuperelementError> {
    let mean_n_m = mean_diagonal(stiffness);
    if mean_n_m > 0.0 && dense::is_definite(stiffness.clone(), STIFFNESS_LACK * mean_n_m) {
        return Ok(());
    }
    Err(SuperelementError::Stiffness {
        path: path.to_owned(),
        lowest_n_m: dense::lowest_eigenvalue(stiffness.as_ref()),
        mean_n_m,
    })
}

fn check_mass(path: &Path, model: &ReducedModel) -> Result<(), SuperelementError> {
    let (p, mean_kg) = (model.coupling.as_ref(), mean_diagonal(&model.mass));
    let mut left = model.mass.clone();
    matmul(
        left.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        p,
        BlockStructure::Rectangular,
        p.transpose(),
        BlockStructure::Rectangular,
        -1.0,
        Par::Seq,
    );
    // Massless pairs are possible.
    let is_zero = (0..left.nrows()).all(|j| left.col_as_slice(j)[j..].iter().all(|v| *v == 0.0));
    if is_zero || dense::is_definite(left.clone(), MASS_LACK * mean_kg) {
        return Ok(());
    }
    Err(SuperelementError::Mass {
        path: path.to_owned(),
        lowest_kg: dense::lowest_eigenvalue(left.as_ref()),
        mean_kg,
    })
}

fn mean_diagonal(a: &Mat<f64>) -> f64 {
    let n = a.nrows();
    (0..n).map(|i| a[(i, i)] / n as f64).sum()
}
