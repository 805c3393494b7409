//! A CSV file of points in space with complex forces or pressures, as programs of fluid dynamics give them.
//!
//! The first line names the columns, in any order: `x_m`, `y_m`, `z_m`, and either `pressure_re_pa` with
//! `pressure_im_pa` and `area_m2` where there are such, or `force_x_re_n`, `force_y_re_n`, `force_z_re_n` with
//! `force_x_im_n` and so on. What is left out is zero. A line that begins with `#` is a remark.
//! The value at the time t is the real part of (re + i im) exp(i w t).

use std::io::Read;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::input;
use crate::text::{list, plain};

/// Most points of a file.
pub const MOST_POINTS: usize = 20_000_000;

/// Forces or pressures at points in space.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceField {
    /// Where the points are.
    pub points_m: Vec<[f64; 3]>,
    /// One value for each point.
    pub values: FieldValues,
}

/// Complex values at points, the real part first.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValues {
    /// N, along x, y, z.
    Forces(Vec<[[f64; 3]; 2]>),
    /// Pressures, positive where they press.
    Pressures {
        /// Pa.
        pressures_pa: Vec<[f64; 2]>,
        /// The part of the surface that each stands for; `None` where it is not known.
        areas_m2: Option<Vec<f64>>,
    },
}

/// Why a file of points cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
pub enum SurfaceFieldError {
    #[error("cannot read {}: {reason}", path.display())]
    Io { path: PathBuf, reason: String },
    #[error("{}: it has no lines after the one that names the columns", path.display())]
    NoPoints { path: PathBuf },
    #[error("{}: it has more than {MOST_POINTS} points", path.display())]
    TooManyPoints { path: PathBuf },
    #[error("{}: the first line names no column `{column}`; columns it names: {found}; {COLUMNS}", path.display())]
    NoColumn {
        path: PathBuf,
        column: &'static str,
        found: String,
    },
    #[error("{}: column `{column}` is not known; {COLUMNS}", path.display())]
    UnknownColumn { path: PathBuf, column: String },
    #[error("{}: the first line names column `{column}` twice", path.display())]
    ColumnTwice { path: PathBuf, column: String },
    #[error("{}: it has forces and `{column}`: keep the columns of the forces or those of the pressures", path.display())]
    TwoKinds { path: PathBuf, column: &'static str },
    #[error("{}, line {line}, column `{column}`: `{value}` is not {wanted}", path.display())]
    Value {
        path: PathBuf,
        line: u64,
        column: &'static str,
        value: String,
        wanted: &'static str,
    },
    #[error("{}, line {line}: {reason}", path.display())]
    Line {
        path: PathBuf,
        line: u64,
        reason: String,
    },
}

const COLUMNS: &str = "the columns are x_m, y_m, z_m, and pressure_re_pa (and pressure_im_pa, area_m2) or \
                       force_x_re_n, force_y_re_n, force_z_re_n (and force_x_im_n, force_y_im_n, force_z_im_n)";
const PLACE: [&str; 3] = ["x_m", "y_m", "z_m"];
const PRESSURE: [&str; 3] = ["pressure_re_pa", "pressure_im_pa", "area_m2"];
const FORCE_RE: [&str; 3] = ["force_x_re_n", "force_y_re_n", "force_z_re_n"];
const FORCE_IM: [&str; 3] = ["force_x_im_n", "force_y_im_n", "force_z_im_n"];

impl SurfaceField {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, or is none of such points: see [`SurfaceFieldError`].
    pub fn read(path: &Path) -> Result<Self, SurfaceFieldError> {
        let file = input::open(path).map_err(|error| SurfaceFieldError::Io {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
        Self::parse(file, path)
    }

    /// Reads the text of a file; `path` is for messages.
    ///
    /// # Errors
    /// As [`SurfaceField::read`].
    pub fn parse(text: impl Read, path: &Path) -> Result<Self, SurfaceFieldError> {
        let mut lines = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text);
        let header = lines.headers().map_err(|e| fault(path, &e))?.clone();
        let columns = Columns::of(&header, path)?;
        let mut field = Self {
            points_m: Vec::new(),
            values: columns.no_values(),
        };
        let mut record = csv::StringRecord::new();
        while lines
            .read_record(&mut record)
            .map_err(|e| fault(path, &e))?
        {
            if field.points_m.len() == MOST_POINTS {
                let path = path.to_owned();
                return Err(SurfaceFieldError::TooManyPoints { path });
            }
            columns.add(&mut field, &record, path)?;
        }
        match field.points_m.is_empty() {
            true => Err(SurfaceFieldError::NoPoints {
                path: path.to_owned(),
            }),
            false => Ok(field),
        }
    }
}

fn fault(path: &Path, error: &csv::Error) -> SurfaceFieldError {
    let path = path.to_owned();
    let line = error.position().map_or(1, csv::Position::line);
    let reason = match error.kind() {
        csv::ErrorKind::Io(source) => {
            let reason = source.to_string();
            return SurfaceFieldError::Io { path, reason };
        }
        csv::ErrorKind::Utf8 { .. } => "it is not a text in UTF-8".to_owned(),
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("it has {len} values, and the first line names {expected_len} columns"),
        _ => plain(&error.to_string()),
    };
    SurfaceFieldError::Line { path, line, reason }
}

/// A column that is read: its name and where it stands.
type Column = (&'static str, usize);

/// Where the columns stand.
struct Columns {
    place: [Column; 3],
    values: ValueColumns,
}

enum ValueColumns {
    Forces([Column; 3], [Option<Column>; 3]),
    Pressures(Column, Option<Column>, Option<Column>),
}

impl Columns {
    fn of(header: &csv::StringRecord, path: &Path) -> Result<Self, SurfaceFieldError> {
        let known = || [PLACE, PRESSURE, FORCE_RE, FORCE_IM].into_iter().flatten();
        for (i, name) in header.iter().enumerate() {
            let (path, column) = (path.to_owned(), plain(name));
            if !known().any(|known| known == name) {
                return Err(SurfaceFieldError::UnknownColumn { path, column });
            }
            if header.iter().take(i).any(|earlier| earlier == name) {
                return Err(SurfaceFieldError::ColumnTwice { path, column });
            }
        }
        let find = |name: &'static str| header.iter().position(|h| h == name).map(|i| (name, i));
        let need = |name: &'static str| {
            find(name).ok_or_else(|| SurfaceFieldError::NoColumn {
                path: path.to_owned(),
                column: name,
                found: list(&header.iter().map(plain).collect::<Vec<_>>()),
            })
        };
        let three = |[a, b, c]: [&'static str; 3]| Ok([need(a)?, need(b)?, need(c)?]);
        let is_there = |name: &&'static str| find(name).is_some();
        let has_forces = FORCE_RE.iter().chain(&FORCE_IM).any(is_there);
        let place = three(PLACE)?;
        let values = match has_forces {
            true => {
                if let Some(column) = PRESSURE.into_iter().find(is_there) {
                    let path = path.to_owned();
                    return Err(SurfaceFieldError::TwoKinds { path, column });
                }
                ValueColumns::Forces(three(FORCE_RE)?, FORCE_IM.map(find))
            }
            false => {
                let [re, im, area] = PRESSURE;
                ValueColumns::Pressures(need(re)?, find(im), find(area))
            }
        };
        Ok(Self { place, values })
    }

    fn no_values(&self) -> FieldValues {
        match self.values {
            ValueColumns::Forces(..) => FieldValues::Forces(Vec::new()),
            ValueColumns::Pressures(_, _, area) => FieldValues::Pressures {
                pressures_pa: Vec::new(),
                areas_m2: area.map(|_| Vec::new()),
            },
        }
    }

    fn add(
        &self,
        field: &mut SurfaceField,
        record: &csv::StringRecord,
        path: &Path,
    ) -> Result<(), SurfaceFieldError> {
        let number = |(column, at): Column, is_area: bool| {
            let text = record.get(at).unwrap_or_default();
            let number = text.parse::<f64>().ok();
            let fits = |v: &f64| v.is_finite() && v.abs() < 1e100 && (!is_area || *v >= 0.0);
            number.filter(fits).ok_or_else(|| SurfaceFieldError::Value {
                path: path.to_owned(),
                line: record.position().map_or(0, csv::Position::line),
                column,
                value: plain(text),
                wanted: match is_area {
                    true => "an area, 0 or more",
                    false => "a finite number",
                },
            })
        };
        let three = |[a, b, c]: [Column; 3]| {
            Ok::<_, SurfaceFieldError>([number(a, false)?, number(b, false)?, number(c, false)?])
        };
        let or_zero = |column: Option<Column>| column.map_or(Ok(0.0), |c| number(c, false));
        field.points_m.push(three(self.place)?);
        match (&self.values, &mut field.values) {
            (ValueColumns::Forces(re, [x, y, z]), FieldValues::Forces(forces)) => {
                let im = [or_zero(*x)?, or_zero(*y)?, or_zero(*z)?];
                forces.push([three(*re)?, im]);
            }
            (
                ValueColumns::Pressures(re, im, area),
                FieldValues::Pressures {
                    pressures_pa,
                    areas_m2,
                },
            ) => {
                pressures_pa.push([number(*re, false)?, or_zero(*im)?]);
                if let (Some(areas), Some(area)) = (areas_m2, area) {
                    areas.push(number(*area, true)?);
                }
            }
            (ValueColumns::Forces(..), FieldValues::Pressures { .. })
            | (ValueColumns::Pressures(..), FieldValues::Forces(_)) => {
                unreachable!("the values are made by the columns")
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<SurfaceField, String> {
        SurfaceField::parse(text.as_bytes(), Path::new("p.csv")).map_err(|e| e.to_string())
    }

    #[test]
    fn columns_in_any_order_with_remarks_and_blanks() {
        let text =
            "# from a CFD run\npressure_im_pa, z_m,x_m,y_m ,pressure_re_pa\n-1,3, 1e-3,2,4.5\n";
        let field = parse(text).unwrap();
        assert_eq!(field.points_m, [[1e-3, 2.0, 3.0]]);
        let expected = FieldValues::Pressures {
            pressures_pa: vec![[4.5, -1.0]],
            areas_m2: None,
        };
        assert_eq!(field.values, expected);
        let text =
            "x_m,y_m,z_m,force_x_re_n,force_y_re_n,force_z_re_n,force_y_im_n\n1,2,3,4,5,6,7\n";
        let forces = FieldValues::Forces(vec![[[4.0, 5.0, 6.0], [0.0, 7.0, 0.0]]]);
        assert_eq!(parse(text).unwrap().values, forces);
        let text = "x_m,y_m,z_m,pressure_re_pa,area_m2\n0,0,0,1,0.5\n0,0,1,2,0\n";
        let expected = FieldValues::Pressures {
            pressures_pa: vec![[1.0, 0.0], [2.0, 0.0]],
            areas_m2: Some(vec![0.5, 0.0]),
        };
        assert_eq!(parse(text).unwrap().values, expected);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        let all = "x_m,y_m,z_m,pressure_re_pa";
        for (text, words) in [
            (String::new(), &["`x_m`", "names: none", "area_m2"][..]),
            (
                "x_m,y_m,z_m\n".into(),
                &["`pressure_re_pa`", "x_m, y_m, z_m;"],
            ),
            (format!("{all},p\n"), &["`p` is not known", "force_z_im_n"]),
            (format!("{all},x_m\n"), &["`x_m` twice"]),
            (
                format!("{all},force_x_re_n\n"),
                &["forces and `pressure_re_pa`"],
            ),
            ("x_m,y_m,z_m,force_x_re_n\n".into(), &["`force_y_re_n`"]),
            (format!("{all}\n"), &["no lines"]),
            (
                format!("{all}\n1,2,3,4\n1,2,3,nan\n"),
                &["line 3", "`nan`", "finite"],
            ),
            (format!("{all}\n1,2,3,1e300\n"), &["line 2", "`1e300`"]),
            (format!("{all}\n1,,3,4\n"), &["line 2", "`y_m`", "``"]),
            (
                format!("{all}\n1,2,3\n"),
                &["line 2", "3 values", "4 columns"],
            ),
            (
                format!("{all},area_m2\n1,2,3,4,-1\n"),
                &["`area_m2`", "0 or more"],
            ),
        ] {
            let error = parse(&text).unwrap_err();
            for word in words {
                assert!(error.contains(word), "{error}: {word}");
            }
        }
        let error = SurfaceField::read(Path::new("no_such.csv")).unwrap_err();
        assert!(error.to_string().contains("cannot read no_such.csv"));
        let error = SurfaceField::parse(&b"x_m,\xff\n"[..], Path::new("p.csv")).unwrap_err();
        assert!(error.to_string().contains("UTF-8"), "{error}");
    }
}
