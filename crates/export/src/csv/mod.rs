//! Writes the tables, each as one list of columns ([`super::table`]). `solution` has the columns that
//! several tables have in common.

mod loads;
mod modes;
mod motions;
mod pairs;
mod response;
mod solution;
mod wear;

use std::path::Path;

pub use self::loads::{write_forces, write_stress};
pub use self::modes::{
    ASSEMBLY, read_modes, write_campbell, write_crossings, write_modes, write_nodal_diameters,
};
pub use self::motions::{BackboneRow, CurveRow, PeakRow, write_backbone, write_curve, write_peaks};
pub use self::pairs::{write_contact, write_static, write_static_observations};
pub use self::response::{write_response, write_tractions, write_verification};
pub use self::wear::{write_wear, write_wear_pairs};

use super::ExportError;
use dovetail_superelement::input;

/// Reads columns of numbers by their names: the rows of the table, with `None` for a cell without a
/// number. Returns `None` if there is no such file or column.
///
/// # Errors
/// A file that cannot be read, or that is not a table.
pub fn read_columns<const N: usize>(
    path: &Path,
    names: [&str; N],
) -> Result<Option<Vec<[Option<f64>; N]>>, ExportError> {
    let text = match input::bytes(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(reading(path, source)),
    };
    let mut table = ::csv::Reader::from_reader(text.as_slice());
    let failed = |error: ::csv::Error| reading(path, error.into());
    let header = table.headers().map_err(failed)?.clone();
    let places = names.map(|name| header.iter().position(|heading| heading == name));
    if places.contains(&None) {
        return Ok(None);
    }
    let mut rows = Vec::new();
    for row in table.records() {
        let row = row.map_err(failed)?;
        rows.push(places.map(|place| row.get(place?)?.parse().ok()));
    }
    Ok(Some(rows))
}

fn reading(path: &Path, source: std::io::Error) -> ExportError {
    ExportError::Read {
        path: path.to_path_buf(),
        source,
    }
}
