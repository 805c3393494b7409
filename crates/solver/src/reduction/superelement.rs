//! A [`ReducedModel`] as a folder of dense MatrixMarket arrays, read and written.
//!
//! | file | shape | what |
//! | --- | --- | --- |
//! | `K.mtx`, `M.mtx` | n x n | stiffness (N/m) and mass (kg) on X, per pair N, t1, t2 |
//! | `p.mtx`, `w2.mtx` | n x m, m | coupling to, and squared angular frequencies of, the stuck modes; both absent: m = 0 |
//! | `f_static.mtx` (`fm_static.mtx`) | n, m | static load on X (on the modes; zeros where absent) |
//! | `f_excitation.mtx`, `fm_excitation.mtx` | n, m | cosine force of harmonic 1, of an amplitude of 1 N in all where the scene has forces alone |
//! | `tip_x.mtx`, `tip_modes.mtx` | n, m | the observed point: `tip_x . X + tip_modes . q` |
//! | `xyz.mtx` | n/3 x 3 | positions of the pairs, m |
//! | `area.mtx` | n/3 | tributary areas of the pairs, m2; may be absent |
//!
//! Without modes there is no `fm_excitation.mtx` and no `tip_modes.mtx` either. Files that
//! [`write()`] wrote name their model in a comment, a hash of all its numbers: files of two models
//! are not read together. Files without such a comment, from another program, are accepted as they
//! are. The folder contains no friction, gap or damping, and no amplitude of the force: the caller
//! gives them.
//!
//! K has no eigenvalue below -1e-3 of the mean of its diagonal (spin softening makes it weakly
//! negative, and only contact holds the bodies), and M - p p^T, the mass that the stuck modes
//! leave, is positive semidefinite.

use std::path::{Path, PathBuf};

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};

use super::matrix_market;
use super::{Load, ObservedDisplacement, ReducedModel};
use dovetail_numerics::dense;

/// Contents of the folder.
#[derive(Debug, Clone)]
pub struct Superelement {
    /// Matrices, with one unit load and one observed point.
    pub model: ReducedModel,
    /// Positions of the pairs, m.
    pub positions_m: Vec<[f64; 3]>,
    /// Tributary areas of the pairs, m2, if the folder has them.
    pub areas_m2: Option<Vec<f64>>,
}

/// Names of the files of a folder. Not every model has all; no other name is read or written.
pub const FILES: [&str; 12] = [
    "K.mtx",
    "M.mtx",
    "p.mtx",
    "w2.mtx",
    "f_static.mtx",
    "fm_static.mtx",
    "f_excitation.mtx",
    "fm_excitation.mtx",
    "tip_x.mtx",
    "tip_modes.mtx",
    "area.mtx",
    POSITIONS,
];

/// Name of the file that is read first and written last: a folder without it contains no model.
const POSITIONS: &str = "xyz.mtx";

/// Beginning of the comment that names the model of a file.
const MODEL: &str = "of the reduced model";

/// Files of a model that exist in a folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let paths = FILES.map(|name| folder.join(name));
    paths.into_iter().filter(|path| path.exists()).collect()
}

/// Error of a folder that was not read or written.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum SuperelementError {
    #[error("cannot read {}: {message}; a dense MatrixMarket array is expected", path.display())]
    Read { path: PathBuf, message: String },
    #[error(
        "the folder {} holds a part of a reduced model: xyz.mtx is missing, which `dovetail reduce` writes last; run it \
         again, or add the file: pairs x 3, positions in m",
        folder.display()
    )]
    NotWhole { folder: PathBuf },
    #[error(
        "{} is of the reduced model {model}, and {} of {other_model}: the files of one folder are those of one model. Take \
         all from one folder of `dovetail reduce`, or write the folder again; a file without the line of comment that names \
         its model is taken as it is",
        path.display(),
        other.display()
    )]
    TwoModels {
        path: PathBuf,
        model: String,
        other: PathBuf,
        other_model: String,
    },
    #[error("{} is {rows} x {columns}, expected {expected}", path.display())]
    Shape {
        path: PathBuf,
        rows: usize,
        columns: usize,
        expected: String,
    },
    #[error("{}: entry ({row}, {column}), counted from 1, is not a finite number", path.display())]
    NotFinite {
        path: PathBuf,
        row: usize,
        column: usize,
    },
    #[error("{}: squared frequency {index}, counted from 1, is {value}: all must be positive and ascending", path.display())]
    Omega2 {
        path: PathBuf,
        index: usize,
        value: f64,
    },
    #[error("{}: area {index}, counted from 1, is {value} m2: all must be positive", path.display())]
    Area {
        path: PathBuf,
        index: usize,
        value: f64,
    },
    #[error("{} has no rows: a reduced model has at least one pair", path.display())]
    NoPairs { path: PathBuf },
    #[error(
        "{}: the lowest eigenvalue of the stiffness is {lowest_n_m:.3e} N/m, the mean of its \
         diagonal {mean_n_m:.3e} N/m: the mean must be positive and no eigenvalue below -1e-3 of it; \
         check the sign of K, and that its rows stand per pair as N, t1, t2",
        path.display()
    )]
    Stiffness {
        path: PathBuf,
        lowest_n_m: f64,
        mean_n_m: f64,
    },
    #[error(
        "{}: the lowest eigenvalue of M - p p^T, the mass that the stuck modes leave, is \
         {lowest_kg:.3e} kg, the mean of the diagonal of M {mean_kg:.3e} kg: it must not be \
         negative; check the sign of M, and that p.mtx is the coupling to modes of unit modal mass",
        path.display()
    )]
    Mass {
        path: PathBuf,
        lowest_kg: f64,
        mean_kg: f64,
    },
    #[error("{}: entries ({row}, {column}) and ({column}, {row}), counted from 1, differ: the matrix must be symmetric", path.display())]
    NotSymmetric {
        path: PathBuf,
        row: usize,
        column: usize,
    },
    #[error(
        "a reduced model holds one observed point and forces cos(w t), the scene has {points} \
         points and forces of {harmonics} harmonics{}",
        if *in_phase { "" } else { ", some of them out of phase" }
    )]
    NotRepresentable {
        points: usize,
        harmonics: usize,
        in_phase: bool,
    },
    #[error(
        "a reduced model holds loads that are the same at all frequencies, and that of \
         base_displacement_m is not; give base_acceleration_m_s2 in its place"
    )]
    GrowingLoad,
    #[error("cannot write {}: {source}; check that the folder exists and is writable", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
}

/// Reads the folder. The unit load is the excitation of the folder, and the observed point is named
/// `tip`.
///
/// # Errors
/// A file that is missing, malformed, of the wrong shape, or not finite; K or M not symmetric
/// (1e-6 of the largest entry); squared frequencies not positive and ascending; a stiffness or a
/// mass that no body has.
pub fn read(folder: &Path) -> Result<Superelement, SuperelementError> {
    let path = folder.join(POSITIONS);
    if !path.exists() && folder.join("K.mtx").exists() {
        let folder = folder.to_owned();
        return Err(SuperelementError::NotWhole { folder });
    }
    check_one_model(folder)?;
    let positions = array(&path, None, Some(3), "pairs x 3")?;
    let pairs = positions.nrows();
    if pairs == 0 {
        return Err(SuperelementError::NoPairs { path });
    }
    let has_modes = ["w2.mtx", "p.mtx"].map(|name| folder.join(name).exists());
    let omega2 = match has_modes {
        [false, false] => None,
        _ => Some(squared_frequencies(folder)?),
    };
    let arrays = Arrays {
        folder,
        pairs,
        modes: omega2.as_ref().map(Vec::len),
    };
    let model = arrays.reduced(omega2.unwrap_or_default())?;
    check_stiffness(&folder.join("K.mtx"), &model.stiffness)?;
    check_mass(&folder.join("M.mtx"), &model)?;
    let position = |i: usize| [0, 1, 2].map(|k| positions[(i, k)]);
    Ok(Superelement {
        model,
        positions_m: (0..pairs).map(position).collect(),
        areas_m2: arrays.areas_m2()?,
    })
}

/// Checks that the files which name their model name the same.
fn check_one_model(folder: &Path) -> Result<(), SuperelementError> {
    let mut first: Option<(PathBuf, String)> = None;
    for path in files(folder) {
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

/// Hash (FNV-1a) of the bits of all numbers of a model, and of their shapes.
fn name_of_model(arrays: &[(&str, MatRef<'_, f64>)]) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |word: u64| {
        for byte in word.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for (_, a) in arrays {
        take(a.nrows() as u64);
        for j in 0..a.ncols() {
            a.col(j).iter().for_each(|value| take(value.to_bits()));
        }
    }
    format!("{hash:016x}")
}

fn squared_frequencies(folder: &Path) -> Result<Vec<f64>, SuperelementError> {
    let path = folder.join("w2.mtx");
    let omega2 = array(&path, None, Some(1), "stuck modes x 1")?;
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
    /// Number of modes; `None` where the folder has none.
    modes: Option<usize>,
}

impl Arrays<'_> {
    fn reduced(&self, omega2: Vec<f64>) -> Result<ReducedModel, SuperelementError> {
        let (n, m) = (3 * self.pairs, omega2.len());
        Ok(ReducedModel {
            stiffness: symmetric(&self.folder.join("K.mtx"), n)?,
            mass: symmetric(&self.folder.join("M.mtx"), n)?,
            coupling: match self.modes {
                Some(m) => {
                    let expected = format!("{n} x {m}");
                    array(&self.folder.join("p.mtx"), Some(n), Some(m), &expected)?
                }
                None => Mat::zeros(n, 0),
            },
            omega2,
            stuck_modes: m,
            static_load: Load {
                on_x: self.on_x("f_static.mtx")?,
                on_modes: if self.has("fm_static.mtx") {
                    self.on_modes("fm_static.mtx")?
                } else {
                    vec![0.0; m]
                },
            },
            unit_loads: vec![Load::new(
                self.on_x("f_excitation.mtx")?,
                self.on_modes("fm_excitation.mtx")?,
            )],
            observations: vec![ObservedDisplacement::new(
                "tip",
                self.on_x("tip_x.mtx")?,
                self.on_modes("tip_modes.mtx")?,
            )],
        })
    }

    fn areas_m2(&self) -> Result<Option<Vec<f64>>, SuperelementError> {
        if !self.has("area.mtx") {
            return Ok(None);
        }
        let areas = self.vector("area.mtx", self.pairs)?;
        match areas.iter().position(|a| *a <= 0.0) {
            Some(i) => Err(SuperelementError::Area {
                path: self.folder.join("area.mtx"),
                index: i + 1,
                value: areas[i],
            }),
            None => Ok(Some(areas)),
        }
    }

    fn has(&self, name: &str) -> bool {
        self.folder.join(name).exists()
    }

    fn on_x(&self, name: &str) -> Result<Vec<f64>, SuperelementError> {
        self.vector(name, 3 * self.pairs)
    }

    /// Reads a vector on the modes; empty where the folder has none.
    fn on_modes(&self, name: &str) -> Result<Vec<f64>, SuperelementError> {
        self.modes
            .map_or(Ok(Vec::new()), |modes| self.vector(name, modes))
    }

    fn vector(&self, name: &str, rows: usize) -> Result<Vec<f64>, SuperelementError> {
        let expected = format!("{rows} x 1");
        let a = array(&self.folder.join(name), Some(rows), Some(1), &expected)?;
        Ok(a.col_as_slice(0).to_vec())
    }
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

/// Writes a folder for [`read`], in digits that read back to the same numbers. A folder that was
/// not written to its end cannot be read, whatever model it had before.
///
/// # Errors
/// A model with other than one observed point and one unit load
/// ([`Problem::of_one_load`](crate::problem::Problem::of_one_load)); a file that cannot be written.
pub fn write(folder: &Path, element: &Superelement) -> Result<(), SuperelementError> {
    let model = &element.model;
    let ([force], [tip]) = (&model.unit_loads[..], &model.observations[..]) else {
        return Err(SuperelementError::NotRepresentable {
            points: model.observations.len(),
            harmonics: model.unit_loads.len(),
            in_phase: true,
        });
    };
    let positions = Mat::from_fn(element.positions_m.len(), 3, |i, j| {
        element.positions_m[i][j]
    });
    let mut files: Vec<(&str, MatRef<'_, f64>)> = vec![
        ("K.mtx", model.stiffness.as_ref()),
        ("M.mtx", model.mass.as_ref()),
        ("f_static.mtx", column(&model.static_load.on_x)),
        ("f_excitation.mtx", column(&force.on_x)),
        ("tip_x.mtx", column(&tip.on_x)),
    ];
    let of_modes = [
        ("p.mtx", model.coupling.as_ref()),
        ("w2.mtx", column(&model.omega2)),
        ("fm_static.mtx", column(&model.static_load.on_modes)),
        ("fm_excitation.mtx", column(&force.on_modes)),
        ("tip_modes.mtx", column(&tip.on_modes)),
    ];
    if !model.omega2.is_empty() {
        files.extend(of_modes);
    }
    files.extend(element.areas_m2.as_ref().map(|a| ("area.mtx", column(a))));
    files.push((POSITIONS, positions.as_ref()));
    let comment = format!("{MODEL} {}", name_of_model(&files));
    let part = |name: &str| folder.join(format!("{name}.reduce.part"));
    let failed = |path: PathBuf| |source| SuperelementError::Write { path, source };
    for (name, values) in &files {
        let path = part(name);
        matrix_market::write(&path, &comment, *values).map_err(failed(path))?;
    }
    // From here on until the last file has its name there is no model to read. Files of an earlier
    // one would be taken for a part of this one.
    for name in FILES.iter().rev() {
        let path = folder.join(name);
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(SuperelementError::Write { path, source });
            }
            _ => {}
        }
    }
    for (name, _) in &files {
        let path = folder.join(name);
        std::fs::rename(part(name), &path).map_err(failed(path))?;
    }
    Ok(())
}

fn column(v: &[f64]) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(v, v.len(), 1)
}

fn array(
    path: &Path,
    rows: Option<usize>,
    columns: Option<usize>,
    expected: &str,
) -> Result<Mat<f64>, SuperelementError> {
    let unreadable = |message: String| SuperelementError::Read {
        path: path.to_owned(),
        message,
    };
    let a = matrix_market::read(path).map_err(unreadable)?;
    let (r, c) = (a.nrows(), a.ncols());
    if rows.is_some_and(|rows| rows != r) || columns.is_some_and(|columns| columns != c) {
        return Err(SuperelementError::Shape {
            path: path.to_owned(),
            rows: r,
            columns: c,
            expected: expected.to_owned(),
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
    let mut a = array(path, Some(n), Some(n), &format!("{n} x {n}"))?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::folder::Folder;

    fn small() -> Superelement {
        let value = |seed: usize| (seed as f64 * 0.7531).sin() * 10f64.powi((seed % 7) as i32 - 3);
        let vector = |k: usize, at: usize| (0..k).map(|i| value(i + at)).collect::<Vec<_>>();
        let (n, m) = (6, 4);
        // Off the diagonal at most 1000 in each entry, on it more than all of a row.
        let square = |at: usize| {
            Mat::from_fn(n, n, |i, j| {
                value(at + i * j + i + j) + if i == j { 1e4 } else { 0.0 }
            })
        };
        let coupling = Mat::from_fn(n, m, |i, j| 1e-2 * value(i + 11 * j));
        let omega2 = vec![1.0 / 3.0, 2.0, 2.0, 1e9];
        Superelement {
            model: ReducedModel {
                static_load: Load::new(vector(n, 3), vector(m, 9)),
                unit_loads: vec![Load::new(vector(n, 20), vector(m, 30))],
                observations: vec![ObservedDisplacement::new(
                    "tip",
                    vector(n, 40),
                    vector(m, 50),
                )],
                ..ReducedModel::new(square(1), square(5), coupling, omega2)
            },
            positions_m: vec![[0.1, 0.2, 0.3], [-1e-3, 1.0 / 3.0, 0.0]],
            areas_m2: Some(vec![1e-6, 2.5e-7]),
        }
    }

    /// Model with twice the stiffness.
    fn stiffer() -> Superelement {
        let mut element = small();
        element.model.stiffness *= faer::Scale(2.0);
        element
    }

    /// Folder of a model.
    fn written(element: &Superelement) -> Folder {
        let folder = Folder::new("superelement");
        write(&folder, element).unwrap();
        folder
    }

    /// Checks that a folder is not read, for a reason in these words.
    #[track_caller]
    fn assert_refused(folder: &Folder, words: &[&str]) {
        let message = read(folder).unwrap_err().to_string();
        for words in words {
            assert!(message.contains(words), "{words}: {message}");
        }
    }

    #[test]
    fn what_is_written_reads_back_to_the_bit() {
        let element = small();
        let back = read(&written(&element)).unwrap();
        let (a, b) = (&element.model, &back.model);
        assert_eq!(a.stiffness, b.stiffness);
        assert_eq!(a.mass, b.mass);
        assert_eq!(a.coupling, b.coupling);
        assert_eq!(a.omega2, b.omega2);
        assert_eq!(a.static_load, b.static_load);
        assert_eq!(a.unit_loads, b.unit_loads);
        assert_eq!(a.stuck_modes, b.stuck_modes);
        assert_eq!(a.observations, b.observations);
        assert_eq!(element.positions_m, back.positions_m);
        assert_eq!(element.areas_m2, back.areas_m2);
    }

    #[test]
    fn a_model_without_modes_replaces_one_with_modes() {
        let mut element = small();
        let folder = written(&element);
        let model = &mut element.model;
        model.coupling = Mat::zeros(6, 0);
        model.omega2.clear();
        model.static_load.on_modes.clear();
        model.stuck_modes = 0;
        model.unit_loads[0].on_modes.clear();
        model.observations[0].on_modes.clear();
        element.areas_m2 = None;
        write(&folder, &element).unwrap();
        let back = read(&folder).unwrap();
        assert_eq!(back.model.coupling, element.model.coupling);
        assert_eq!(back.model.observations, element.model.observations);
        assert_eq!(back.model.static_load, element.model.static_load);
        assert_eq!(back.areas_m2, None);
        // Half of the modes is a mistake, not m = 0.
        folder.write("p.mtx", "");
        assert_refused(&folder, &["w2.mtx"]);
    }

    #[test]
    fn the_matrices_of_two_models_are_not_read_together() {
        let [first, second] = [small(), stiffer()].map(|element| written(&element));
        std::fs::copy(second.join("M.mtx"), first.join("M.mtx")).unwrap();
        assert_refused(&first, &["M.mtx", "K.mtx", "one model", "dovetail reduce"]);
        // A matrix that names no model is the user's own.
        let text = second.text("M.mtx");
        let without = text.lines().filter(|line| !line.starts_with("% "));
        let without: Vec<&str> = without.collect();
        first.write("M.mtx", without.join("\n"));
        assert!(read(&first).is_ok());
        // The same model has the same name.
        write(&second, &small()).unwrap();
        std::fs::copy(second.join("K.mtx"), first.join("K.mtx")).unwrap();
        assert!(read(&first).is_ok());
    }

    /// Wherever the writing of a second model ends, by a file that cannot take its name, nothing
    /// can be read but the whole of one of the two.
    #[test]
    fn a_folder_that_was_not_written_to_its_end_is_not_read() {
        for name in FILES {
            let folder = written(&small());
            // A folder of this name cannot be replaced by a file.
            std::fs::remove_file(folder.join(name)).unwrap();
            std::fs::create_dir_all(folder.join(name).join("in the way")).unwrap();
            let error = write(&folder, &stiffer()).unwrap_err();
            assert!(matches!(error, SuperelementError::Write { .. }), "{error}");
            std::fs::remove_dir_all(folder.join(name)).unwrap();
            assert!(read(&folder).is_err(), "{name}");
        }
        let folder = written(&small());
        std::fs::remove_file(folder.join(POSITIONS)).unwrap();
        let words = ["xyz.mtx", "a part of a reduced model", "dovetail reduce"];
        assert_refused(&folder, &words);
    }

    #[test]
    fn malformed_files_are_named_with_line_and_shape() {
        let folder = written(&small());
        let head = "%%MatrixMarket matrix array real general\n";
        let skew = Mat::from_fn(6, 6, |i, j| i as f64 - 2.0 * j as f64);
        let skew = (0..36).map(|i| format!("{}\n", skew[(i % 6, i / 6)]));
        let skew = format!("6 6\n{}", skew.collect::<String>());
        let cases: [(&str, &str, &[&str]); 5] = [
            (
                "w2.mtx",
                "4 1\n1\n2\nthree\n4\n",
                &["w2.mtx", "line 5: \"three\""],
            ),
            (
                "w2.mtx",
                "4 1\n1\n3\n2\n4\n",
                &["squared frequency 3", "ascending"],
            ),
            (
                "tip_x.mtx",
                "5 1\n1\n3\n2\n4\n5\n",
                &["5 x 1, expected 6 x 1"],
            ),
            ("f_static.mtx", "6 1\n1\n3\n2\n4\n5\n", &["6 entries", "5"]),
            ("K.mtx", &skew, &["symmetric", "(1, 2)"]),
        ];
        for (file, text, words) in cases {
            let whole = folder.text(file);
            folder.write(file, format!("{head}{text}"));
            assert_refused(&folder, words);
            folder.write(file, whole);
        }
        let lenient = format!("{}4 1\n1\n2\n3\n4\n", &head[1..]);
        folder.write("fm_static.mtx", lenient);
        let read_back = read(&folder).unwrap().model.static_load.on_modes;
        assert_eq!(read_back, [1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn a_stiffness_or_mass_that_no_body_has_is_refused() {
        let with = |change: &dyn Fn(&mut ReducedModel)| {
            let mut element = small();
            change(&mut element.model);
            written(&element)
        };
        let diagonal =
            |values: [f64; 6]| Mat::from_fn(6, 6, |i, j| if i == j { values[i] } else { 0.0 });
        let stiffness = |values: [f64; 6]| with(&|model| model.stiffness = diagonal(values));
        // Contact alone may hold the body, and spin may soften it.
        for values in [
            [0.0, 0.0, 0.0, 0.0, 0.0, 6.0],
            [-0.9e-3, 1.0, 1.0, 1.0, 1.0, 2.0],
        ] {
            assert!(read(&stiffness(values)).is_ok());
        }
        let too_soft = stiffness([-1.1e-3, 1.0, 1.0, 1.0, 1.0, 2.0]);
        let words = ["K.mtx", "lowest eigenvalue", "-1.100e-3 N/m", "sign of K"];
        assert_refused(&too_soft, &words);
        assert_refused(&stiffness([-1.0; 6]), &["K.mtx", "-1.000e0 N/m"]);
        assert_refused(&stiffness([0.0; 6]), &[]);
        let huge = stiffness([1e308, -1e308, 1e308, 1e308, 1e308, 1e308]);
        assert_refused(&huge, &[]);

        let mass = |mass: f64, coupling: f64| {
            with(&|model| {
                model.mass = diagonal([mass; 6]);
                model.coupling = Mat::from_fn(6, 4, |i, j| if i == j { coupling } else { 0.0 });
            })
        };
        // Massless pairs, and pairs whose mass is all in the modes, to rounding.
        for (kg, coupling) in [(0.0, 0.0), (2.0, 2f64.sqrt()), (2.0, (2f64 + 1e-7).sqrt())] {
            assert!(read(&mass(kg, coupling)).is_ok());
        }
        let words = ["M.mtx", "M - p p^T", "-1.000e0 kg", "unit modal mass"];
        assert_refused(&mass(2.0, 3f64.sqrt()), &words);
        for (kg, coupling) in [(-1.0, 0.0), (0.0, 1.0), (1e300, 1e200)] {
            assert_refused(&mass(kg, coupling), &[]);
        }
    }

    #[test]
    fn a_model_without_pairs_is_refused() {
        let folder = written(&small());
        folder.write("xyz.mtx", "%%MatrixMarket matrix array real general\n0 3\n");
        assert_refused(&folder, &["at least one pair"]);
    }

    #[test]
    fn a_missing_file_is_named() {
        assert_refused(&Folder::new("missing"), &["xyz.mtx"]);
    }
}
