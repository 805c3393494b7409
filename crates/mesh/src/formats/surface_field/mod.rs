//! CSV files of points in space with complex forces or pressures, as programs of fluid dynamics
//! write them, or with coefficients of friction.
//!
//! A file gives a [`SurfaceField`] and no [`Content`](super::Content): it is an excitation or the
//! friction of a contact and no mesh, and [`detect`](fn@super::detect) does not know it.
//!
//! The first line names the columns, in any order: `x_m`, `y_m`, `z_m`, and either `pressure_re_pa`
//! with `pressure_im_pa` and `area_m2` if there are any, or `force_x_re_n`, `force_y_re_n`,
//! `force_z_re_n` with `force_x_im_n` and so on, or `friction`. Imaginary parts that are left out
//! are zero.
//! `pressure_amplitude_pa` and `pressure_phase_deg` may replace real and imaginary parts, and names
//! of other programs may replace these names (`columns.rs`). A line that begins with `#` is a
//! remark. In a file with sections, such as CFD-Post writes, every section `[Data]` is read: there is
//! one for each region, and each begins with a line that names its columns.
//!
//! The value at the time t is the real part of (re + i im) exp(i w t); re + i im is the amplitude
//! times exp(i phase).

mod columns;

use std::io::Read;
use std::path::{Path, PathBuf};

use thiserror::Error;

use self::columns::{FieldColumn, FieldColumns, ValueColumns};
use crate::surface_field::{FieldValues, SurfaceField};
use crate::text::plain;

/// Most points of a file.
pub const MOST_POINTS: usize = 20_000_000;

/// Error of a file of points that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum SurfaceFieldError {
    #[error("cannot read {}: {reason}", path.display())]
    Io { path: PathBuf, reason: String },
    #[error("{}: it has no lines after the one that names the columns", path.display())]
    NoPoints { path: PathBuf },
    #[error("{}: it has more than {MOST_POINTS} points", path.display())]
    TooManyPoints { path: PathBuf },
    #[error("{}: the line of names has no column `{column}`; columns it names: {found}; {COLUMNS}", path.display())]
    NoColumn {
        path: PathBuf,
        column: String,
        found: String,
    },
    #[error("{}: column `{column}` has no unit that is known: write the unit in brackets behind the name, one of {units}", path.display())]
    Unit {
        path: PathBuf,
        column: String,
        units: String,
    },
    #[error("{}: `{column}` is one way too many to give a value: keep real and imaginary parts, or amplitudes and phases, or one column alone", path.display())]
    TwoWays { path: PathBuf, column: String },
    #[error("{}: column `{column}` is not known; {COLUMNS}", path.display())]
    UnknownColumn { path: PathBuf, column: String },
    #[error("{}: the line of names has column `{column}` twice", path.display())]
    ColumnTwice { path: PathBuf, column: String },
    #[error("{}: it has forces and `{column}`: keep the columns of the forces or those of the pressures", path.display())]
    TwoKinds { path: PathBuf, column: String },
    #[error("{}: it has friction and `{column}`: keep the column of the friction or those of the load", path.display())]
    FrictionAndLoad { path: PathBuf, column: String },
    #[error("{}, line {line}, column `{column}`: `{value}` is not {wanted}", path.display())]
    Value {
        path: PathBuf,
        line: u64,
        column: String,
        value: String,
        wanted: &'static str,
    },
    #[error("{}, line {line}: this [Data] section has other columns than the first: export pressures or forces, with areas or without, for all regions", path.display())]
    OtherColumns { path: PathBuf, line: u64 },
    #[error("{}, line {line}: {reason}", path.display())]
    Line {
        path: PathBuf,
        line: u64,
        reason: String,
    },
}

const COLUMNS: &str = "the columns are x_m, y_m, z_m, and pressure_re_pa (and pressure_im_pa, area_m2) or \
                       force_x_re_n, force_y_re_n, force_z_re_n (and force_x_im_n, force_y_im_n, force_z_im_n), or \
                       friction; \
                       amplitude and phase may stand for re and im (pressure_amplitude_pa, pressure_phase_deg), and \
                       units in brackets (Pressure Amplitude [Pa])";
/// Most units named in a message.
const UNITS: usize = 6;

impl SurfaceField {
    /// Reads the text of a file; `path` is for messages.
    ///
    /// # Errors
    /// A text that cannot be read, or is not a file of such points: see [`SurfaceFieldError`].
    pub fn parse(mut text: impl Read, path: &Path) -> Result<Self, SurfaceFieldError> {
        Self::read(&mut text, path)
    }

    /// Reads the text. It is not generic: the program, which is not optimised, does not compile it.
    fn read(text: &mut dyn Read, path: &Path) -> Result<Self, SurfaceFieldError> {
        let mut lines = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .has_headers(false)
            .flexible(true)
            .from_reader(text);
        let no_points = || {
            let path = path.to_owned();
            SurfaceFieldError::NoPoints { path }
        };
        let mut record = csv::StringRecord::new();
        let mut next =
            |record: &mut csv::StringRecord| lines.read_record(record).map_err(|e| fault(path, &e));
        next(&mut record)?;
        let mut field: Option<Self> = None;
        loop {
            if section(&record).is_some() {
                let mut there = true;
                while there && section(&record).is_none_or(|name| name != "data") {
                    there = next(&mut record)?;
                }
                if !(there && next(&mut record)?) {
                    break;
                }
            }
            let columns = FieldColumns::read(&record, path)?;
            let values = empty_values(&columns);
            let field = field.get_or_insert_with(|| Self {
                points_m: Vec::new(),
                values: values.clone(),
            });
            if !alike(&field.values, &values) {
                return Err(SurfaceFieldError::OtherColumns {
                    path: path.to_owned(),
                    line: line_of(&record),
                });
            }
            let mut there = next(&mut record)?;
            while there && section(&record).is_none() {
                if field.points_m.len() == MOST_POINTS {
                    let path = path.to_owned();
                    return Err(SurfaceFieldError::TooManyPoints { path });
                }
                field.add(&columns, &record, path)?;
                there = next(&mut record)?;
            }
            if !there {
                break;
            }
        }
        field
            .filter(|field| !field.points_m.is_empty())
            .ok_or_else(no_points)
    }

    /// Adds the point of a line.
    fn add(
        &mut self,
        columns: &FieldColumns,
        record: &csv::StringRecord,
        path: &Path,
    ) -> Result<(), SurfaceFieldError> {
        let line = line_of(record);
        if record.len() != columns.count {
            return Err(SurfaceFieldError::Line {
                path: path.to_owned(),
                line,
                reason: format!(
                    "it has {} values, and there are {} columns",
                    record.len(),
                    columns.count
                ),
            });
        }
        let value = |column: &FieldColumn, wanted: &'static str, least: f64| {
            let text = record.get(column.at).unwrap_or_default();
            let number = text.parse::<f64>().ok().map(|v| v * column.factor);
            let fits = |v: &f64| v.is_finite() && v.abs() < 1e100 && *v >= least;
            number.filter(fits).ok_or_else(|| SurfaceFieldError::Value {
                path: path.to_owned(),
                line,
                column: column.name.clone(),
                value: plain(text),
                wanted,
            })
        };
        let number = |column: &FieldColumn| value(column, "a finite number", f64::NEG_INFINITY);
        let [x, y, z] = &columns.place;
        self.points_m.push([number(x)?, number(y)?, number(z)?]);
        match (&columns.values, &mut self.values) {
            (ValueColumns::Forces(axes), FieldValues::Forces(forces)) => {
                let mut force = [[0.0; 3]; 2];
                for (k, axis) in axes.iter().enumerate() {
                    [force[0][k], force[1][k]] = axis.value(number)?;
                }
                forces.push(force);
            }
            (
                ValueColumns::Pressures(pressure, area),
                FieldValues::Pressures {
                    pressures_pa,
                    areas_m2,
                },
            ) => {
                pressures_pa.push(pressure.value(number)?);
                if let (Some(areas), Some(area)) = (areas_m2, area) {
                    areas.push(value(area, "an area, 0 or more", 0.0)?);
                }
            }
            (ValueColumns::Friction(column), FieldValues::Friction(friction)) => {
                friction.push(value(column, "a coefficient of friction, 0 or more", 0.0)?);
            }
            _ => unreachable!("the values are made by the columns"),
        }
        Ok(())
    }
}

fn line_of(record: &csv::StringRecord) -> u64 {
    record.position().map_or(0, csv::Position::line)
}

/// Returns `true` if two sections give the same quantities.
fn alike(a: &FieldValues, b: &FieldValues) -> bool {
    use FieldValues::Pressures;
    let has_areas = |values: &FieldValues| match values {
        Pressures { areas_m2, .. } => areas_m2.is_some(),
        _ => false,
    };
    std::mem::discriminant(a) == std::mem::discriminant(b) && has_areas(a) == has_areas(b)
}

/// Name of the section that a line begins, in small letters: `[Data]`.
fn section(record: &csv::StringRecord) -> Option<String> {
    let name = record.get(0).filter(|_| record.len() == 1)?;
    let name = name.strip_prefix('[')?.strip_suffix(']')?;
    Some(name.trim().to_lowercase())
}

fn empty_values(columns: &FieldColumns) -> FieldValues {
    match &columns.values {
        ValueColumns::Forces(_) => FieldValues::Forces(Vec::new()),
        ValueColumns::Friction(_) => FieldValues::Friction(Vec::new()),
        ValueColumns::Pressures(_, area) => FieldValues::Pressures {
            pressures_pa: Vec::new(),
            areas_m2: area.as_ref().map(|_| Vec::new()),
        },
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
        _ => plain(&error.to_string()),
    };
    SurfaceFieldError::Line { path, line, reason }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::assert_near;
    use super::*;
    use dovetail_testkit::words::{cases, has};

    fn parse(text: &str) -> Result<SurfaceField, String> {
        SurfaceField::parse(text.as_bytes(), Path::new("p.csv")).map_err(|e| e.to_string())
    }

    fn pressures(pressures_pa: &[[f64; 2]], areas_m2: Option<Vec<f64>>) -> FieldValues {
        FieldValues::Pressures {
            pressures_pa: pressures_pa.to_vec(),
            areas_m2,
        }
    }

    #[test]
    fn columns_in_any_order_with_remarks_and_blanks() {
        let text =
            "# from a CFD run\npressure_im_pa, z_m,x_m,y_m ,pressure_re_pa\n-1,3, 1e-3,2,4.5\n";
        let field = parse(text).unwrap();
        assert_eq!(field.points_m, [[1e-3, 2.0, 3.0]]);
        assert_eq!(field.values, pressures(&[[4.5, -1.0]], None));
        let text =
            "x_m,y_m,z_m,force_x_re_n,force_y_re_n,force_z_re_n,force_y_im_n\n1,2,3,4,5,6,7\n";
        let forces = FieldValues::Forces(vec![[[4.0, 5.0, 6.0], [0.0, 7.0, 0.0]]]);
        assert_eq!(parse(text).unwrap().values, forces);
        let text = "x_m,y_m,z_m,pressure_re_pa,area_m2\n0,0,0,1,0.5\n0,0,1,2,0\n";
        let expected = pressures(&[[1.0, 0.0], [2.0, 0.0]], Some(vec![0.5, 0.0]));
        assert_eq!(parse(text).unwrap().values, expected);
    }

    #[test]
    fn coefficients_of_friction_are_read_by_their_name() {
        let friction = |values: &[f64]| FieldValues::Friction(values.to_vec());
        for name in [
            "friction",
            "Friction Coefficient",
            "coefficient of friction [-]",
        ] {
            let field = parse(&format!("x_m,y_m,z_m,{name}\n1,2,3,0.3\n4,5,6,0\n")).unwrap();
            assert_eq!(field.points_m, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
            assert_eq!(field.values, friction(&[0.3, 0.0]), "{name}");
        }
        refused(
            r"
            PLACE,friction\n1,2,3,-0.1 => line 2 & `friction` & `-0.1` & 0 or more
            PLACE,friction\n1,2,3,nan => line 2 & `nan` & 0 or more
            PLACE,friction [N] => `friction [N]` has no unit
            PLACE,coefficient => `coefficient` is not known & friction
            PLACE,friction,Pressure [Pa] => friction and `Pressure [Pa]`
            PLACE,friction,Force X [N] => friction and `Force X [N]`
            ",
        );
    }

    /// Files as CFD-Post exports a surface, and as Fluent writes ASCII with commas.
    #[test]
    fn files_of_other_programs_are_read_by_their_names_and_units() {
        let post = "\n[Name]\nBlade 1 pressure side\n\n[Spatial Fields]\nX,Y,Z\n\n[Data]\n\
            Node Number, X [ mm ], Y [ mm ], Z [ mm ], Pressure Amplitude [ kPa ], Pressure Phase [ degree ]\n\
            0, 1.0e+00, 2.0, 3.0, 2.0, 90\n1, 4.0, 5.0, 6.0, 1.0e+00, -180\n\n[Faces]\n0, 1, 2, 3\n";
        let field = parse(post).unwrap();
        let expected = [[1e-3, 2e-3, 3e-3], [4e-3, 5e-3, 6e-3]];
        assert_near(&field.points_m, &expected, 1e-15);
        let FieldValues::Pressures {
            pressures_pa,
            areas_m2: None,
        } = field.values
        else {
            panic!("{:?}", field.values);
        };
        // The angle of re + i im.
        assert_near(&pressures_pa, &[[0.0, 2e3], [-1e3, 0.0]], 1e-9);
        let fluent = "nodenumber,    x-coordinate,    y-coordinate,    z-coordinate,        pressure\n\
                      1, 1.5, -2.0, 3.0, 101.0\n";
        let field = parse(fluent).unwrap();
        assert_eq!(field.points_m, [[1.5, -2.0, 3.0]]);
        assert_eq!(field.values, pressures(&[[101.0, 0.0]], None));
        let parts = "x [m],y [m],z [m],Force X Real [N],Force Y Real [N],Force Z Real Part [kN],Imaginary Force Y [N]\n\
                     1,2,3,4,5,6,7\n";
        let forces = FieldValues::Forces(vec![[[4.0, 5.0, 6e3], [0.0, 7.0, 0.0]]]);
        assert_eq!(parse(parts).unwrap().values, forces);
        let own = "x_m,y_m,z_m,pressure_amplitude_pa,pressure_phase_deg,area_m2\n1,2,3,4,60,5\n";
        let FieldValues::Pressures {
            pressures_pa,
            areas_m2,
        } = parse(own).unwrap().values
        else {
            panic!("{own}");
        };
        assert!((pressures_pa[0][0] - 2.0).abs() < 1e-15 && areas_m2 == Some(vec![5.0]));
    }

    /// CFD-Post writes a section for each region that is exported, each with its own columns.
    #[test]
    fn all_sections_with_data_are_read() {
        let post = "[Name]\npressure side\n\n[Data]\nNode Number, X [ m ], Y [ m ], Z [ m ], Pressure [ Pa ]\n\
            0, 1, 2, 3, 100\n1, 4, 5, 6, 200\n\n[Faces]\n0, 1, 1\n\n[Name]\nsuction side\n\n[Data]\n\
            X [ mm ], Y [ mm ], Z [ mm ], Pressure [ kPa ]\n7, 8, 9, 3\n\n[Lines]\n0, 1\n\n[Data]\nX [ m ], Y [ m ], Z [ m ], Pressure [ Pa ]\n";
        let field = parse(post).unwrap();
        let expected = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7e-3, 8e-3, 9e-3]];
        assert_near(&field.points_m, &expected, 1e-15);
        let expected = pressures(&[[100.0, 0.0], [200.0, 0.0], [3e3, 0.0]], None);
        assert_eq!(field.values, expected);
        let second = |columns: &str, line: &str| {
            let [head, rest] = post
                .split("X [ mm ], Y [ mm ], Z [ mm ], Pressure [ kPa ]\n7, 8, 9, 3")
                .collect::<Vec<_>>()[..]
            else {
                panic!("{post}");
            };
            parse(&format!("{head}{columns}\n{line}{rest}")).unwrap_err()
        };
        let areas = "X [ m ], Y [ m ], Z [ m ], Pressure [ Pa ], Area [ m^2 ]";
        has(
            &second(areas, "7, 8, 9, 3, 1"),
            "line 16 & other columns than the first",
        );
        let forces = "X [ m ], Y [ m ], Z [ m ], Force X [ N ], Force Y [ N ], Force Z [ N ]";
        has(
            &second(forces, "7, 8, 9, 3, 1, 2"),
            "line 16 & other columns than the first",
        );
        has(
            &second("X [ m ], Y [ m ], Z [ m ], Pressure [ Pa ]", "7, 8, 9, x"),
            "line 17 & `x`",
        );
    }

    /// Checks that the text of each line, in which `PLACE` and `ALL` stand for names of columns, is
    /// refused with the words beside it.
    #[track_caller]
    fn refused(table: &str) {
        for [text, words] in cases(table) {
            let text = text.replace("PLACE", "X [m],Y [m],Z [m]");
            let text = text.replace("ALL", "x_m,y_m,z_m,pressure_re_pa");
            has(&parse(&format!("{text}\n")).unwrap_err(), &words);
        }
    }

    #[test]
    fn names_with_more_than_one_meaning_are_errors() {
        refused(
            r"
            x,y,z,pressure => `x` has no unit & m, mm
            PLACE,Pressure => `Pressure` has no unit & Pa
            PLACE,Pressure [mPa] => `Pressure [mPa]` has no unit that is known
            PLACE,Pressure Amplitude [Pa] => no column `pressure_phase_deg`
            PLACE,Pressure Phase [rad] => no column `pressure_amplitude_pa`
            x-coordinate,y-coordinate,z-coordinate,pressure-amplitude,pressure-phase
            => `pressure-phase` has no unit & deg
            PLACE,Pressure [Pa],Pressure Amplitude [Pa],Pressure Phase [deg]
            => `Pressure [Pa]` is one way too many
            PLACE,Pressure [Pa],Pressure Imag [Pa] => `Pressure [Pa]` is one way too many
            PLACE,Total Pressure [Pa] => `Total Pressure [Pa]` is not known & brackets
            PLACE,Pressure Re [Pa],pressure_re_pa => `pressure_re_pa` twice
            [Name]\nblade => no lines
            ",
        );
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        refused(
            r"
            x_m,y_m,z_m => `pressure_re_pa` & x_m, y_m, z_m;
            ALL,p => `p` is not known & force_z_im_n
            ALL,x_m => `x_m` twice
            ALL,force_x_re_n => forces and `pressure_re_pa`
            x_m,y_m,z_m,force_x_re_n => `force_y_re_n`
            ALL => no lines
            ALL\n1,2,3,4\n1,2,3,nan => line 3 & `nan` & finite
            ALL\n1,2,3,1e300 => line 2 & `1e300`
            ALL\n1,,3,4 => line 2 & `y_m` & ``
            ALL\n1,2,3 => line 2 & 3 values & 4 columns
            ALL,area_m2\n1,2,3,4,-1 => `area_m2` & 0 or more
            ",
        );
        has(&parse("").unwrap_err(), "`x_m` & names: none & area_m2");
        let error = SurfaceField::parse(&b"x_m,\xff\n"[..], Path::new("p.csv")).unwrap_err();
        has(&error.to_string(), "UTF-8");
    }
}
