//! Errors of the folder of a reduced model.

use std::path::PathBuf;

/// Error of a folder that was not read or written.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum SuperelementError {
    #[error("cannot read {}, a dense matrix of MatrixMarket: {message}", path.display())]
    Read { path: PathBuf, message: String },
    #[error(
        "the folder {} holds a part of a reduced model: model.json is missing, which `dovetail reduce` writes last; run it \
         again, or add the file, with contacts, excitations and observed points",
        folder.display()
    )]
    NotWhole { folder: PathBuf },
    #[error(
        "the folder {folder} has K.mtx and no model.json: the files of a reduced model are called stiffness.mtx, mass.mtx, \
         coupling.mtx and so on; `python3 scripts/name_reduced_model.py {folder}` renames them and writes model.json",
        folder = folder.display()
    )]
    OtherNames { folder: PathBuf },
    #[error("cannot read {}: {message}; `dovetail reduce` writes such a file", path.display())]
    Description { path: PathBuf, message: String },
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
         check its sign, and that its rows stand per pair as N, t1, t2",
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
         negative; check the sign of the mass, and that coupling.mtx is the coupling to modes of unit modal mass",
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
    #[error("cannot write {}: {source}; check that the folder exists and is writable", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
}
