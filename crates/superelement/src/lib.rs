//! A [`ReducedModel`] as a folder of dense MatrixMarket arrays and a description, read and written.
//!
//! | file | shape | what |
//! | --- | --- | --- |
//! | `model.json` | | units, numbers of pairs and modes, contacts, excitations, observed points, coefficients of dashpots |
//! | `stiffness.mtx`, `mass.mtx` | n x n | stiffness (N/m) and mass (kg) on X, per pair N, t1, t2 |
//! | `coupling.mtx` | n x m | mass coupling to the stuck modes, of unit modal mass |
//! | `squared_frequencies.mtx` | m | squared angular frequencies of the stuck modes, rad2/s2 |
//! | `static_load.mtx`, `static_load_on_modes.mtx` | n, m | static load; zero on the modes where the second is absent |
//! | `excitations.mtx`, `excitations_on_modes.mtx` | n x e, m x e | one unit of each excitation, a column each |
//! | `observed_points.mtx`, `observed_points_on_modes.mtx` | n x o, m x o | the observed points `x . X + q . modes`, a column each |
//! | `dashpots.mtx`, `dashpots_on_modes.mtx` | n x d, m x d | the displacements `x . X + q . modes` that dashpots act on, a column each |
//! | `positions.mtx` | n/3 x 3 | positions of the pairs, m |
//! | `areas.mtx` | n/3 | tributary areas of the pairs, m2; may be absent |
//!
//! Files without columns are left out. `Description` is what `model.json` has. Files that
//! [`write()`] wrote name their model in a comment, a hash of all its numbers: files of two models
//! are not read together. Files without such a comment, from another program, are accepted as they
//! are. The folder contains no friction, gap or damping besides that of dashpots: the caller gives
//! them.
//!
//! K has no eigenvalue below -1e-3 of the mean of its diagonal (spin softening makes it weakly
//! negative, and only contact holds the bodies), and M - p p^T, the mass that the stuck modes
//! leave, is positive semidefinite.

#![forbid(unsafe_code)]
#![warn(missing_docs, clippy::missing_errors_doc)]

pub mod input;
mod matrix_market;

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};
use serde::{Deserialize, Serialize};

use dovetail_dynamics::excitation::NamedExcitation;
use dovetail_dynamics::reduced::Quantity;
use dovetail_dynamics::reduced::{Dashpots, Load, ObservedPoint, ReducedModel, Waves};
use dovetail_dynamics::superelement::{NamedContact, Superelement};
use dovetail_numerics::dense;

/// Contents of `model.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    /// [`FORMAT`].
    format: String,
    /// Hash of the numbers of all files, as in their comments.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    model: Option<String>,
    units: Units,
    pairs: usize,
    modes: usize,
    contacts: Vec<NamedContact>,
    excitations: Vec<NamedExcitation>,
    observed_points: Vec<String>,
    /// Those of the observed points that are strains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    observed_strains: Vec<String>,
    /// Coefficients of the dashpots.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    dashpots_n_s_m: Vec<f64>,
}

/// Units of all numbers of a folder, which are those of the SI.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Units {
    length: String,
    mass: String,
    time: String,
    force: String,
}

impl Units {
    fn si() -> Self {
        let [length, mass, time, force] = ["m", "kg", "s", "N"].map(str::to_owned);
        Self {
            length,
            mass,
            time,
            force,
        }
    }
}

/// Beginning of `model.json`.
const FORMAT: &str = "reduced model of dovetail";

/// Names of the files of a folder. Not every model has all; no other name is read or written.
pub const FILES: [&str; 15] = [
    STIFFNESS,
    MASS,
    COUPLING,
    SQUARED_FREQUENCIES,
    STATIC_LOAD,
    STATIC_LOAD_ON_MODES,
    EXCITATIONS,
    EXCITATIONS_ON_MODES,
    OBSERVED_POINTS,
    OBSERVED_POINTS_ON_MODES,
    DASHPOTS,
    DASHPOTS_ON_MODES,
    AREAS,
    POSITIONS,
    DESCRIPTION,
];

const STIFFNESS: &str = "stiffness.mtx";
const MASS: &str = "mass.mtx";
const COUPLING: &str = "coupling.mtx";
const SQUARED_FREQUENCIES: &str = "squared_frequencies.mtx";
const STATIC_LOAD: &str = "static_load.mtx";
const STATIC_LOAD_ON_MODES: &str = "static_load_on_modes.mtx";
const EXCITATIONS: &str = "excitations.mtx";
const EXCITATIONS_ON_MODES: &str = "excitations_on_modes.mtx";
const OBSERVED_POINTS: &str = "observed_points.mtx";
const OBSERVED_POINTS_ON_MODES: &str = "observed_points_on_modes.mtx";
const DASHPOTS: &str = "dashpots.mtx";
const DASHPOTS_ON_MODES: &str = "dashpots_on_modes.mtx";
const AREAS: &str = "areas.mtx";
const POSITIONS: &str = "positions.mtx";

/// Name of the file that is read first and written last: a folder without it contains no model.
const DESCRIPTION: &str = "model.json";

/// Most bytes of the description.
const MOST_OF_DESCRIPTION: u64 = 1 << 24;

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
    let expected = format!("{} x 3", described.pairs);
    let positions = folder.join(POSITIONS);
    let positions = array(&positions, Some(described.pairs), Some(3), &expected)?;
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

/// Reads `model.json`, and checks what it says.
fn description(path: &Path) -> Result<Description, SuperelementError> {
    let wrong = |message: String| SuperelementError::Description {
        path: path.to_owned(),
        message,
    };
    let mut text = String::new();
    let file = input::open(path).map_err(|e| wrong(e.to_string()))?;
    let mut file = file.take(MOST_OF_DESCRIPTION);
    file.read_to_string(&mut text)
        .map_err(|e| wrong(e.to_string()))?;
    let found: Description = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    if found.format != FORMAT {
        let message = format!("format is \"{}\", expected \"{FORMAT}\"", found.format);
        return Err(wrong(message));
    }
    if found.units != Units::si() {
        let message = "units are other than m, kg, s and N: convert all numbers to these";
        return Err(wrong(message.to_owned()));
    }
    if found.pairs == 0 {
        let path = path.to_owned();
        return Err(SuperelementError::NoPairs { path });
    }
    let of_contacts = found.contacts.iter().map(|contact| contact.pairs);
    let of_contacts = of_contacts.fold(0, usize::saturating_add);
    if of_contacts != found.pairs {
        let message = format!(
            "the contacts have {of_contacts} pairs in all, and `pairs` is {}: they must agree",
            found.pairs
        );
        return Err(wrong(message));
    }
    let mut dashpots = found.dashpots_n_s_m.iter();
    if let Some(wrong_one) = dashpots.find(|c| !(c.is_finite() && **c >= 0.0)) {
        let message = format!("dashpots_n_s_m has {wrong_one}: all must be 0 or more and finite");
        return Err(wrong(message));
    }
    let first = found.observed_points.first();
    for name in &found.observed_strains {
        let message = if first == Some(name) {
            format!(
                "the first of observed_points, \"{name}\", is one of observed_strains: put a \
                 displacement first, whose peak is that of a run"
            )
        } else if !found.observed_points.contains(name) {
            format!("observed_strains has \"{name}\", which is none of observed_points")
        } else {
            continue;
        };
        return Err(wrong(message));
    }
    for excitation in &found.excitations {
        let is_finite = excitation.amplitude.is_finite() && excitation.phase_rad.is_finite();
        if excitation.harmonic == 0 || !is_finite {
            let message = format!(
                "excitation \"{}\": the harmonic must be 1 or more, amplitude and phase finite",
                excitation.name
            );
            return Err(wrong(message));
        }
    }
    Ok(found)
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

fn squared_frequencies(folder: &Path, modes: usize) -> Result<Vec<f64>, SuperelementError> {
    let path = folder.join(SQUARED_FREQUENCIES);
    let omega2 = array(&path, Some(modes), Some(1), &format!("{modes} x 1"))?;
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

impl Description {
    fn quantity(&self, name: &String) -> Quantity {
        match self.observed_strains.contains(name) {
            true => Quantity::Strain,
            false => Quantity::Displacement,
        }
    }
}

/// Names of the observed points of these quantities.
fn names_of(model: &ReducedModel, wanted: impl Fn(Quantity) -> bool) -> Vec<String> {
    let points = model.observations.iter().filter(|o| wanted(o.quantity));
    points.map(|o| o.name.clone()).collect()
}

impl Arrays<'_> {
    fn reduced(&self, described: &Description) -> Result<ReducedModel, SuperelementError> {
        let (n, m) = (3 * self.pairs, self.modes);
        let (has_modes, expected) = (m > 0, format!("{n} x {m}"));
        let static_on_modes = match has_modes && self.has(STATIC_LOAD_ON_MODES) {
            true => self.vector(STATIC_LOAD_ON_MODES, m)?,
            false => vec![0.0; m],
        };
        let unit_loads = self.on_both(
            [EXCITATIONS, EXCITATIONS_ON_MODES],
            described.excitations.len(),
        )?;
        let points = &described.observed_points;
        let observed = self.on_both([OBSERVED_POINTS, OBSERVED_POINTS_ON_MODES], points.len())?;
        let observed = points.iter().zip(observed);
        let damping = &described.dashpots_n_s_m;
        let dashpots = self.on_both([DASHPOTS, DASHPOTS_ON_MODES], damping.len())?;
        let dashpots: Vec<(f64, Load)> = damping.iter().copied().zip(dashpots).collect();
        Ok(ReducedModel {
            dashpots: Dashpots::new(n, m, &dashpots),
            stiffness: symmetric(&self.folder.join(STIFFNESS), n)?,
            mass: symmetric(&self.folder.join(MASS), n)?,
            coupling: match has_modes {
                true => array(&self.folder.join(COUPLING), Some(n), Some(m), &expected)?,
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
                    ObservedPoint::new(name, on.on_x, on.on_modes).of(quantity)
                })
                .collect(),
            waves: Waves::default(),
        })
    }

    /// Reads the columns of two files, on X and on the modes.
    fn on_both(&self, names: [&str; 2], count: usize) -> Result<Vec<Load>, SuperelementError> {
        let columns = |name: &str, rows: usize| {
            if rows == 0 || count == 0 {
                return Ok(vec![Vec::new(); count]);
            }
            let expected = format!("{rows} x {count}");
            let a = array(&self.folder.join(name), Some(rows), Some(count), &expected)?;
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
    let all = [
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
    files.extend(all.into_iter().filter(|(_, a)| is_there(a)));
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
        units: Units::si(),
        pairs: element.positions_m.len(),
        modes: model.omega2.len(),
        contacts: element.contacts.clone(),
        excitations: element.excitations.clone(),
        observed_points: names_of(model, |_| true),
        observed_strains: names_of(model, |quantity| quantity == Quantity::Strain),
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
                unit_loads: vec![
                    Load::new(vector(n, 20), vector(m, 30)),
                    Load::new(vector(n, 21), vector(m, 31)),
                ],
                observations: vec![
                    ObservedPoint::new("tip", vector(n, 40), vector(m, 50)),
                    ObservedPoint::new("root", vector(n, 41), vector(m, 51)),
                ],
                dashpots: Dashpots::new(
                    n,
                    m,
                    &[(1.0 / 3.0, Load::new(vector(n, 60), vector(m, 70)))],
                ),
                ..ReducedModel::new(square(1), square(5), coupling, omega2)
            },
            excitations: vec![
                NamedExcitation::cosine("tip"),
                NamedExcitation {
                    name: "base".to_owned(),
                    harmonic: 3,
                    amplitude: 1.0 / 3.0,
                    phase_rad: -0.1,
                    grows_with_squared_frequency: true,
                },
            ],
            contacts: vec![contact("left"), contact("right")],
            positions_m: vec![[0.1, 0.2, 0.3], [-1e-3, 1.0 / 3.0, 0.0]],
            areas_m2: Some(vec![1e-6, 2.5e-7]),
        }
    }

    /// Contact of one pair.
    fn contact(name: &str) -> NamedContact {
        NamedContact {
            name: name.to_owned(),
            pairs: 1,
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
        assert_eq!(a.dashpots, b.dashpots);
        assert_eq!(a.static_load, b.static_load);
        assert_eq!(a.unit_loads, b.unit_loads);
        assert_eq!(a.stuck_modes, b.stuck_modes);
        assert_eq!(a.observations, b.observations);
        assert_eq!(element.excitations, back.excitations);
        assert_eq!(element.contacts, back.contacts);
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
        model
            .unit_loads
            .iter_mut()
            .for_each(|load| load.on_modes.clear());
        model
            .observations
            .iter_mut()
            .for_each(|point| point.on_modes.clear());
        element.areas_m2 = None;
        write(&folder, &element).unwrap();
        let back = read(&folder).unwrap();
        assert_eq!(back.model.coupling, element.model.coupling);
        assert_eq!(back.model.observations, element.model.observations);
        assert_eq!(back.model.static_load, element.model.static_load);
        assert_eq!(back.areas_m2, None);
        let text = folder.text("model.json");
        folder.write("model.json", text.replace("\"modes\": 0", "\"modes\": 4"));
        assert_refused(&folder, &["excitations_on_modes.mtx"]);
    }

    #[test]
    fn the_matrices_of_two_models_are_not_read_together() {
        let [first, second] = [small(), stiffer()].map(|element| written(&element));
        std::fs::copy(second.join("mass.mtx"), first.join("mass.mtx")).unwrap();
        assert_refused(
            &first,
            &["mass.mtx", "model.json", "one model", "dovetail reduce"],
        );
        // A matrix that names no model is the user's own.
        let text = second.text("mass.mtx");
        let without = text.lines().filter(|line| !line.starts_with("% "));
        let without: Vec<&str> = without.collect();
        first.write("mass.mtx", without.join("\n"));
        assert!(read(&first).is_ok());
        // The same model has the same name.
        write(&second, &small()).unwrap();
        std::fs::copy(second.join("stiffness.mtx"), first.join("stiffness.mtx")).unwrap();
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
        std::fs::remove_file(folder.join(DESCRIPTION)).unwrap();
        let words = ["model.json", "a part of a reduced model", "dovetail reduce"];
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
                "squared_frequencies.mtx",
                "4 1\n1\n2\nthree\n4\n",
                &["squared_frequencies.mtx", "line 5: \"three\""],
            ),
            (
                "squared_frequencies.mtx",
                "4 1\n1\n3\n2\n4\n",
                &["squared frequency 3", "ascending"],
            ),
            (
                "observed_points.mtx",
                "5 2\n1\n3\n2\n4\n5\n1\n3\n2\n4\n5\n",
                &["5 x 2, expected 6 x 2"],
            ),
            (
                "static_load.mtx",
                "6 1\n1\n3\n2\n4\n5\n",
                &["6 entries", "5"],
            ),
            ("stiffness.mtx", &skew, &["symmetric", "(1, 2)"]),
        ];
        for (file, text, words) in cases {
            let whole = folder.text(file);
            folder.write(file, format!("{head}{text}"));
            assert_refused(&folder, words);
            folder.write(file, whole);
        }
        let lenient = format!("{}4 1\n1\n2\n3\n4\n", &head[1..]);
        folder.write("static_load_on_modes.mtx", lenient);
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
        let words = [
            "stiffness.mtx",
            "lowest eigenvalue",
            "-1.100e-3 N/m",
            "its sign",
        ];
        assert_refused(&too_soft, &words);
        assert_refused(&stiffness([-1.0; 6]), &["stiffness.mtx", "-1.000e0 N/m"]);
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
        let words = ["mass.mtx", "M - p p^T", "-1.000e0 kg", "unit modal mass"];
        assert_refused(&mass(2.0, 3f64.sqrt()), &words);
        for (kg, coupling) in [(-1.0, 0.0), (0.0, 1.0), (1e300, 1e200)] {
            assert_refused(&mass(kg, coupling), &[]);
        }
    }

    #[test]
    fn a_description_that_contradicts_itself_is_refused() {
        let folder = written(&small());
        let whole = folder.text("model.json");
        for (from, to, words) in [
            ("\"pairs\": 2,", "\"pairs\": 0,", "at least one pair"),
            (
                "\"pairs\": 2,",
                "\"pairs\": 3,",
                "2 pairs in all, and `pairs` is 3",
            ),
            ("\"length\": \"m\"", "\"length\": \"mm\"", "m, kg, s and N"),
            (
                "\"harmonic\": 3",
                "\"harmonic\": 0",
                "\"base\": the harmonic must be 1",
            ),
            ("\"phase_rad\": 0.0", "\"phase_rad\": \"0\"", "expected f64"),
            (
                "\"harmonic\": 3",
                "\"harmonics\": 3",
                "unknown field `harmonics`",
            ),
            (FORMAT, "something", "format is \"something\""),
            ("\"root\"", "\"root\", \"top\"", "6 x 2, expected 6 x 3"),
        ] {
            assert!(whole.contains(from), "{from}: {whole}");
            folder.write("model.json", whole.replacen(from, to, 1));
            assert_refused(&folder, &[words]);
        }
    }

    #[test]
    fn a_folder_with_other_names_is_told_how_to_rename_them() {
        let folder = Folder::new("other_names");
        folder.write("K.mtx", "");
        let words = [
            "stiffness.mtx",
            "scripts/name_reduced_model.py",
            "model.json",
        ];
        assert_refused(&folder, &words);
    }

    #[test]
    fn a_missing_file_is_named() {
        assert_refused(&Folder::new("missing"), &["model.json"]);
    }
}
