//! Writes the folder.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use faer::{Mat, MatRef};

use dovetail_dynamics::reduced::{ObservedQuantity, ReducedModel};
use dovetail_dynamics::superelement::Superelement;

use crate::description::{
    AREAS, COUPLING, DASHPOTS, DASHPOTS_ON_MODES, DESCRIPTION, Description, EXCITATIONS,
    EXCITATIONS_ON_MODES, FILES, FORMAT, FolderUnits, MASS, MODEL, OBSERVED_POINTS,
    OBSERVED_POINTS_ON_MODES, POSITIONS, SQUARED_FREQUENCIES, STATIC_LOAD, STATIC_LOAD_ON_MODES,
    STIFFNESS,
};
use crate::{SuperelementError, matrix_market};

/// Writes a folder for [`read`](crate::read()), in digits that read back to the same numbers. A folder that was
/// not written to its end cannot be read, whatever model it had before.
///
/// # Errors
/// A file that cannot be written.
pub fn write(folder: &Path, element: &Superelement) -> Result<(), SuperelementError> {
    let written = write_all(folder, element);
    if written.is_err() {
        // A folder that is not complete cannot be read. Some of the files may not exist.
        for name in FILES {
            let _ = std::fs::remove_file(part(folder, name));
        }
    }
    written
}

/// Path of a file of a folder until all of them are written.
fn part(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.reduce.part"))
}

fn write_all(folder: &Path, element: &Superelement) -> Result<(), SuperelementError> {
    let model = &element.model;
    let positions = Mat::from_fn(element.positions_m.len(), 3, |i, j| {
        element.positions_m[i][j]
    });
    let [excitations, excitations_on_modes] = side_by_side(
        model
            .unit_loads
            .iter()
            .map(|load| [&load.on_x[..], &load.on_modes]),
    );
    let [points, points_on_modes] = side_by_side(
        model
            .observations
            .iter()
            .map(|point| [&point.on_x[..], &point.on_modes]),
    );
    let dashpots = &model.dashpots;
    let matrices = [
        (STIFFNESS, model.stiffness.as_ref()),
        (MASS, model.mass.as_ref()),
        (STATIC_LOAD, column(&model.static_load.on_x)),
        (EXCITATIONS, excitations.as_ref()),
        (OBSERVED_POINTS, points.as_ref()),
        (COUPLING, model.coupling.as_ref()),
        (SQUARED_FREQUENCIES, column(&model.omega2)),
        (STATIC_LOAD_ON_MODES, column(&model.static_load.on_modes)),
        (EXCITATIONS_ON_MODES, excitations_on_modes.as_ref()),
        (OBSERVED_POINTS_ON_MODES, points_on_modes.as_ref()),
        (DASHPOTS, dashpots.on_x.as_ref()),
        (DASHPOTS_ON_MODES, dashpots.on_modes.as_ref()),
    ];
    let is_there = |a: &MatRef<'_, f64>| a.nrows() > 0 && a.ncols() > 0;
    let mut files: Vec<(&str, MatRef<'_, f64>)> = Vec::new();
    files.extend(matrices.into_iter().filter(|(_, a)| is_there(a)));
    files.extend(element.areas_m2.as_ref().map(|a| (AREAS, column(a))));
    files.push((POSITIONS, positions.as_ref()));
    let hash = name_of_model(&files);
    let comment = format!("{MODEL} {hash}");
    let part = |name: &str| part(folder, name);
    let failed = |path: PathBuf| |source| SuperelementError::Write { path, source };
    for (name, values) in &files {
        let path = part(name);
        matrix_market::write(&path, &comment, *values).map_err(failed(path))?;
    }
    let described = Description {
        format: FORMAT.to_owned(),
        model: Some(hash),
        units: FolderUnits::si(),
        pairs: element.positions_m.len(),
        modes: model.omega2.len(),
        contacts: element.contacts.clone(),
        excitations: element.excitations.clone(),
        observed_points: names_of(model, |_| true),
        observed_strains: names_of(model, |quantity| quantity == ObservedQuantity::Strain),
        dashpots_n_s_m: dashpots.damping_n_s_m.clone(),
    };
    let path = part(DESCRIPTION);
    write_json(&path, &described).map_err(failed(path))?;
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
    for name in files.iter().map(|(name, _)| *name).chain([DESCRIPTION]) {
        let path = folder.join(name);
        std::fs::rename(part(name), &path).map_err(failed(path))?;
    }
    Ok(())
}

fn write_json(path: &Path, described: &Description) -> std::io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(serde_json::to_string_pretty(described)?.as_bytes())?;
    file.write_all(b"\n")?;
    file.sync_all()
}

/// Columns of pairs of vectors, side by side in two arrays.
fn side_by_side<'a>(columns: impl Iterator<Item = [&'a [f64]; 2]>) -> [Mat<f64>; 2] {
    let columns: Vec<[&[f64]; 2]> = columns.collect();
    [0, 1].map(|k| {
        let rows = columns.first().map_or(0, |column| column[k].len());
        Mat::from_fn(rows, columns.len(), |i, j| columns[j][k][i])
    })
}

fn column(v: &[f64]) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(v, v.len(), 1)
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

/// Names of the observed points of these quantities.
fn names_of(model: &ReducedModel, wanted: impl Fn(ObservedQuantity) -> bool) -> Vec<String> {
    let points = model.observations.iter().filter(|o| wanted(o.quantity));
    points.map(|o| o.name.clone()).collect()
}
