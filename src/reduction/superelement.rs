//! A [`RelativeModel`] as a folder of dense MatrixMarket arrays, read and written.
//!
//! | file | shape | what |
//! | --- | --- | --- |
//! | `K.mtx`, `M.mtx` | n x n | stiffness (N/m) and mass (kg) on X, per pair N, t1, t2 |
//! | `p.mtx`, `w2.mtx` | n x m, m | coupling to, and squared angular frequencies of, the stuck modes; both absent: m = 0 |
//! | `f_static.mtx` (`fm_static.mtx`) | n, m | static load on X (on the modes; zeros where absent) |
//! | `f_excitation.mtx`, `fm_excitation.mtx` | n, m | unit cosine force of harmonic 1 |
//! | `tip_x.mtx`, `tip_modes.mtx` | n, m | the observed point: `tip_x . X + tip_modes . q` |
//! | `xyz.mtx` | n/3 x 3 | positions of the pairs, m |
//! | `area.mtx` | n/3 | tributary areas of the pairs, m2; may be absent |
//!
//! Without modes there is no `fm_excitation.mtx` and no `tip_modes.mtx` either.
//! The folder carries no friction, gap, damping or force: the caller gives them.

use std::path::{Path, PathBuf};

use faer::{Mat, MatRef};

use super::matrix_market;
use super::{HarmonicLoad, Load, PairLaw, Probe, RelativeModel};

/// What the folder holds.
#[derive(Debug, Clone)]
pub struct Superelement {
    pub relative: RelativeModel,
    /// Positions of the pairs, m.
    pub positions_m: Vec<[f64; 3]>,
    /// Tributary areas of the pairs, m2, where the folder tells.
    pub areas_m2: Option<Vec<f64>>,
}

#[derive(Debug, thiserror::Error)]
pub enum SuperelementError {
    #[error("cannot read {}: {message}; a dense MatrixMarket array is expected", path.display())]
    Read { path: PathBuf, message: String },
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
    #[error("{}: entries ({row}, {column}) and ({column}, {row}), counted from 1, differ: the matrix must be symmetric", path.display())]
    NotSymmetric {
        path: PathBuf,
        row: usize,
        column: usize,
    },
    #[error(
        "the superelement format holds one observed point and one cosine force of harmonic 1; the model has {probes} points and {excitations} harmonic loads"
    )]
    NotRepresentable { probes: usize, excitations: usize },
    #[error("cannot write {}: {source}; check that the folder exists and is writable", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
}

/// Reads the folder; every pair follows `law`, the unit excitation is multiplied by `force_n`, and
/// the observed point is named `tip`.
///
/// # Errors
/// A file that is missing, malformed, of the wrong shape, or not finite; K or M not symmetric
/// (1e-6 of the largest entry); squared frequencies not positive and ascending.
pub fn read(folder: &Path, law: PairLaw, force_n: f64) -> Result<Superelement, SuperelementError> {
    let positions = array(&folder.join("xyz.mtx"), None, Some(3), "pairs x 3")?;
    let pairs = positions.nrows();
    let n = 3 * pairs;
    let has = |name: &str| folder.join(name).exists();
    let with_modes = has("w2.mtx") || has("p.mtx");
    let omega2 = match with_modes {
        true => array(&folder.join("w2.mtx"), None, Some(1), "stuck modes x 1")?,
        false => Mat::zeros(0, 1),
    };
    let m = omega2.nrows();
    let omega2: Vec<f64> = (0..m).map(|i| omega2[(i, 0)]).collect();
    for (i, &value) in omega2.iter().enumerate() {
        if value <= 0.0 || (i > 0 && value < omega2[i - 1]) {
            return Err(SuperelementError::Omega2 {
                path: folder.join("w2.mtx"),
                index: i + 1,
                value,
            });
        }
    }
    let vector = |name: &str, rows: usize| -> Result<Vec<f64>, SuperelementError> {
        let expected = format!("{rows} x 1");
        let a = array(&folder.join(name), Some(rows), Some(1), &expected)?;
        Ok((0..rows).map(|i| a[(i, 0)]).collect())
    };
    let of_modes = |name: &str| match with_modes {
        true => vector(name, m),
        false => Ok(Vec::new()),
    };
    let static_modes = "fm_static.mtx";
    let static_load = Load {
        on_x: vector("f_static.mtx", n)?,
        on_modes: match has(static_modes) {
            true => of_modes(static_modes)?,
            false => vec![0.0; m],
        },
    };
    let scaled = |mut v: Vec<f64>| {
        v.iter_mut().for_each(|x| *x *= force_n);
        v
    };
    let excitation = HarmonicLoad {
        harmonic: 1,
        cosine: Load {
            on_x: scaled(vector("f_excitation.mtx", n)?),
            on_modes: scaled(of_modes("fm_excitation.mtx")?),
        },
        sine: Load {
            on_x: vec![0.0; n],
            on_modes: vec![0.0; m],
        },
    };
    let relative = RelativeModel {
        stiffness: symmetric(&folder.join("K.mtx"), n)?,
        mass: symmetric(&folder.join("M.mtx"), n)?,
        coupling: match with_modes {
            true => array(
                &folder.join("p.mtx"),
                Some(n),
                Some(m),
                &format!("{n} x {m}"),
            )?,
            false => Mat::zeros(n, 0),
        },
        omega2,
        static_load,
        excitations: vec![excitation],
        observations: vec![Probe {
            name: "tip".into(),
            on_x: vector("tip_x.mtx", n)?,
            on_modes: of_modes("tip_modes.mtx")?,
        }],
        pairs: vec![law; pairs],
    };
    let positions_m = (0..pairs)
        .map(|i| [positions[(i, 0)], positions[(i, 1)], positions[(i, 2)]])
        .collect();
    let areas_m2 = match has("area.mtx") {
        true => Some(vector("area.mtx", pairs)?),
        false => None,
    };
    let bad_area = |areas: &Vec<f64>| areas.iter().position(|a| *a <= 0.0).map(|i| (i, areas[i]));
    if let Some((i, value)) = areas_m2.as_ref().and_then(bad_area) {
        return Err(SuperelementError::Area {
            path: folder.join("area.mtx"),
            index: i + 1,
            value,
        });
    }
    Ok(Superelement {
        relative,
        positions_m,
        areas_m2,
    })
}

/// Writes what [`read`] reads, in digits that read back to the same numbers. Friction and gaps are
/// not written.
///
/// # Errors
/// A model with other than one observed point and one cosine load of harmonic 1; a file that
/// cannot be written.
pub fn write(folder: &Path, element: &Superelement) -> Result<(), SuperelementError> {
    let model = &element.relative;
    let representable = model.excitations.len() == 1
        && model.observations.len() == 1
        && model.excitations.iter().all(|e| {
            let silent = |v: &[f64]| v.iter().all(|x| *x == 0.0);
            e.harmonic == 1 && silent(&e.sine.on_x) && silent(&e.sine.on_modes)
        });
    if !representable {
        return Err(SuperelementError::NotRepresentable {
            probes: model.observations.len(),
            excitations: model.excitations.len(),
        });
    }
    let (force, tip) = (&model.excitations[0].cosine, &model.observations[0]);
    let positions = Mat::from_fn(element.positions_m.len(), 3, |i, j| {
        element.positions_m[i][j]
    });
    let mut files: Vec<(&str, MatRef<'_, f64>)> = vec![
        ("K.mtx", model.stiffness.as_ref()),
        ("M.mtx", model.mass.as_ref()),
        ("f_static.mtx", column(&model.static_load.on_x)),
        ("f_excitation.mtx", column(&force.on_x)),
        ("tip_x.mtx", column(&tip.on_x)),
        ("xyz.mtx", positions.as_ref()),
    ];
    let of_modes = [
        ("p.mtx", model.coupling.as_ref()),
        ("w2.mtx", column(&model.omega2)),
        ("fm_static.mtx", column(&model.static_load.on_modes)),
        ("fm_excitation.mtx", column(&force.on_modes)),
        ("tip_modes.mtx", column(&tip.on_modes)),
    ];
    let area = element.areas_m2.as_ref().map(|a| ("area.mtx", column(a)));
    // What an earlier model left would be taken for part of this one.
    let absent = [
        (
            model.omega2.is_empty(),
            &of_modes.each_ref().map(|f| f.0)[..],
        ),
        (area.is_none(), &["area.mtx"]),
    ];
    for name in absent.iter().filter(|a| a.0).flat_map(|a| a.1) {
        let path = folder.join(name);
        if path.exists() {
            std::fs::remove_file(&path)
                .map_err(|source| SuperelementError::Write { path, source })?;
        }
    }
    if !model.omega2.is_empty() {
        files.extend(of_modes);
    }
    files.extend(area);
    for (name, values) in &files {
        let path = folder.join(name);
        matrix_market::write(&path, *values)
            .map_err(|source| SuperelementError::Write { path, source })?;
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

/// A symmetric array, its two halves averaged so that it is symmetric to the last bit.
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

    fn small() -> Superelement {
        let value = |seed: usize| (seed as f64 * 0.7531).sin() * 10f64.powi((seed % 7) as i32 - 3);
        let vector = |k: usize, at: usize| (0..k).map(|i| value(i + at)).collect::<Vec<_>>();
        let (n, m) = (6, 4);
        let square = |at: usize| Mat::from_fn(n, n, |i, j| value(at + i * j + i + j));
        Superelement {
            relative: RelativeModel {
                stiffness: square(1),
                mass: square(5),
                coupling: Mat::from_fn(n, m, |i, j| value(i + 11 * j)),
                omega2: vec![1.0 / 3.0, 2.0, 2.0, 1e9],
                static_load: Load {
                    on_x: vector(n, 3),
                    on_modes: vector(m, 9),
                },
                excitations: vec![HarmonicLoad {
                    harmonic: 1,
                    cosine: Load {
                        on_x: vector(n, 20),
                        on_modes: vector(m, 30),
                    },
                    sine: Load {
                        on_x: vec![0.0; n],
                        on_modes: vec![0.0; m],
                    },
                }],
                observations: vec![Probe {
                    name: "tip".into(),
                    on_x: vector(n, 40),
                    on_modes: vector(m, 50),
                }],
                pairs: vec![
                    PairLaw {
                        friction: 0.3,
                        gap_m: 1e-6
                    };
                    2
                ],
            },
            positions_m: vec![[0.1, 0.2, 0.3], [-1e-3, 1.0 / 3.0, 0.0]],
            areas_m2: Some(vec![1e-6, 2.5e-7]),
        }
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!(
            "dovetail-superelement-{name}-{}",
            std::process::id()
        ));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn what_is_written_reads_back_to_the_bit() {
        let (folder, element) = (folder("round-trip"), small());
        write(&folder, &element).unwrap();
        let back = read(&folder, element.relative.pairs[0], 1.0).unwrap();
        let (a, b) = (&element.relative, &back.relative);
        assert_eq!(a.stiffness, b.stiffness);
        assert_eq!(a.mass, b.mass);
        assert_eq!(a.coupling, b.coupling);
        assert_eq!(a.omega2, b.omega2);
        assert_eq!(a.static_load, b.static_load);
        assert_eq!(a.excitations, b.excitations);
        assert_eq!(a.observations, b.observations);
        assert_eq!(a.pairs, b.pairs);
        assert_eq!(element.positions_m, back.positions_m);
        assert_eq!(element.areas_m2, back.areas_m2);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_model_without_modes_replaces_one_with_modes() {
        let (folder, mut element) = (folder("no-modes"), small());
        write(&folder, &element).unwrap();
        let model = &mut element.relative;
        model.coupling = Mat::zeros(6, 0);
        model.omega2.clear();
        model.static_load.on_modes.clear();
        model.excitations[0].cosine.on_modes.clear();
        model.excitations[0].sine.on_modes.clear();
        model.observations[0].on_modes.clear();
        element.areas_m2 = None;
        write(&folder, &element).unwrap();
        let back = read(&folder, element.relative.pairs[0], 1.0).unwrap();
        assert_eq!(back.relative.coupling, element.relative.coupling);
        assert_eq!(back.relative.observations, element.relative.observations);
        assert_eq!(back.relative.static_load, element.relative.static_load);
        assert_eq!(back.areas_m2, None);
        // Half of the modes is a mistake, not m = 0.
        std::fs::write(folder.join("p.mtx"), "").unwrap();
        let message = read(&folder, element.relative.pairs[0], 1.0).unwrap_err();
        assert!(message.to_string().contains("w2.mtx"), "{message}");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn malformed_files_are_named_with_line_and_shape() {
        let (folder, element) = (folder("malformed"), small());
        write(&folder, &element).unwrap();
        let law = element.relative.pairs[0];
        let spoil = |file: &str, text: &str| {
            let path = folder.join(file);
            let whole = std::fs::read_to_string(&path).unwrap();
            std::fs::write(&path, text).unwrap();
            let message = read(&folder, law, 1.0).unwrap_err().to_string();
            std::fs::write(&path, whole).unwrap();
            message
        };
        let head = "%%MatrixMarket matrix array real general\n";
        let message = spoil("w2.mtx", &format!("{head}4 1\n1\n2\nthree\n4\n"));
        assert!(
            message.contains("w2.mtx") && message.contains("line 5: \"three\""),
            "{message}"
        );
        let message = spoil("w2.mtx", &format!("{head}4 1\n1\n3\n2\n4\n"));
        assert!(
            message.contains("squared frequency 3") && message.contains("ascending"),
            "{message}"
        );
        let lenient = format!("{}4 1\n1\n2\n3\n4\n", &head[1..]);
        std::fs::write(folder.join("fm_static.mtx"), lenient).unwrap();
        let read_back = read(&folder, law, 1.0)
            .unwrap()
            .relative
            .static_load
            .on_modes;
        assert_eq!(read_back, [1.0, 2.0, 3.0, 4.0]);
        let message = spoil("tip_x.mtx", &format!("{head}5 1\n1\n3\n2\n4\n5\n"));
        assert!(message.contains("5 x 1, expected 6 x 1"), "{message}");
        let message = spoil("f_static.mtx", &format!("{head}6 1\n1\n3\n2\n4\n5\n"));
        assert!(
            message.contains("6 entries") && message.contains('5'),
            "{message}"
        );
        let skew = Mat::from_fn(6, 6, |i, j| i as f64 - 2.0 * j as f64);
        let text = (0..36).map(|i| format!("{}\n", skew[(i % 6, i / 6)]));
        let text = format!("{head}6 6\n{}", text.collect::<String>());
        let message = spoil("K.mtx", &text);
        assert!(
            message.contains("symmetric") && message.contains("(1, 2)"),
            "{message}"
        );
        assert!(read(&folder, law, 1.0).is_ok());
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_missing_file_is_named() {
        let folder = folder("missing");
        let message = read(
            &folder,
            PairLaw {
                friction: 0.3,
                gap_m: 0.0,
            },
            1.0,
        )
        .unwrap_err()
        .to_string();
        assert!(message.contains("xyz.mtx"), "{message}");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
