//! Opens the files of the matrices of a body, as the library reads bytes.

use std::path::{Path, PathBuf};

use thiserror::Error;

use dovetail_matrices::{
    MatrixError, MatrixQuantity, NamedMatrix, expand_to_rows, parse, parse_rows,
};
use dovetail_solver::model::{GivenMatrices, MatricesError, MatrixFile, MatrixFiles};
use dovetail_superelement::input;

/// Error of the matrices of a body.
#[derive(Debug, Error)]
pub enum MatrixFilesError {
    #[error("body `{body}`: cannot read {}", path.display())]
    Io {
        body: String,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("body `{body}`: {error}")]
    File {
        body: String,
        error: Box<MatrixError>,
    },
    #[error(
        "body `{body}`: {} does not say which node and direction its rows belong to; give a table by `rows_file` (of CalculiX the .dof beside it, else lines `node,direction`)",
        path.display()
    )]
    NoRows { body: String, path: PathBuf },
    #[error("body `{body}`, {files}: {error}")]
    Matrices {
        body: String,
        files: String,
        error: MatricesError,
    },
}

/// Checks that the files of the matrices of a body exist.
///
/// # Errors
/// A path where no regular file is.
pub fn check(body: &str, files: &MatrixFiles) -> Result<(), MatrixFilesError> {
    for path in files.paths() {
        input::check(path).map_err(|source| MatrixFilesError::Io {
            body: body.to_owned(),
            path: path.to_owned(),
            source,
        })?;
    }
    Ok(())
}

/// Reads the matrices of a body.
///
/// # Errors
/// A file that cannot be read, or is no such file; matrices that are not those of a body.
pub fn read(body: &str, files: &MatrixFiles) -> Result<GivenMatrices, MatrixFilesError> {
    let body = body.to_owned();
    let wrong = |error| MatrixFilesError::File {
        body: body.clone(),
        error: Box::new(error),
    };
    let bytes = |path: &Path| {
        input::bytes(path).map_err(|source| MatrixFilesError::Io {
            body: body.clone(),
            path: path.to_owned(),
            source,
        })
    };
    let matrix = |file: &MatrixFile, quantity| -> Result<NamedMatrix, MatrixFilesError> {
        let bytes = bytes(&file.path)?;
        let matrices = parse(&file.path, &bytes).map_err(wrong)?;
        matrices
            .choose(quantity, file.name.as_deref())
            .map_err(wrong)
    };
    let stiffness = matrix(&files.stiffness, MatrixQuantity::Stiffness)?;
    let mass = matrix(&files.mass, MatrixQuantity::Mass)?;
    let rows = match (&files.rows, &stiffness.rows) {
        (Some(path), _) => parse_rows(path, &bytes(path)?).map_err(wrong)?,
        (None, Some(rows)) => rows.clone(),
        (None, None) => {
            let path = files.stiffness.path.clone();
            return Err(MatrixFilesError::NoRows { body, path });
        }
    };
    // A file that names its rows leaves out those without entries.
    let on_these = |matrix: NamedMatrix| match matrix.rows {
        Some(_) => expand_to_rows(matrix, &rows).map_err(wrong),
        None => Ok(matrix.matrix),
    };
    let both = (on_these(stiffness)?, on_these(mass)?);
    let load = match &files.load {
        None => None,
        Some(file) => {
            let bytes = bytes(&file.path)?;
            let column = parse(&file.path, &bytes).and_then(|all| all.column(file.name.as_deref()));
            Some(column.map_err(wrong)?)
        }
    };
    let made = GivenMatrices::new(both.0, both.1, rows, files.units);
    let made = made.and_then(|made| match load {
        Some(load_n) => made.with_load(load_n),
        None => Ok(made),
    });
    made.map_err(|error| MatrixFilesError::Matrices {
        body: body.clone(),
        files: format!(
            "{} and {}",
            files.stiffness.path.display(),
            files.mass.path.display()
        ),
        error,
    })
}
