//! Reads the coefficients of an aerodynamic influence from a CSV file.

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use thiserror::Error;

use dovetail_solver::reduced::InfluenceCoefficient;
use dovetail_superelement::input;

/// Error of a file of coefficients.
#[derive(Debug, Error)]
pub enum InfluenceFileError {
    #[error("cannot read {}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{}: {reason}; the columns are nodal_diameter, mode, by_mode (left out where each mode acts on itself alone), real_n_m, imaginary_n_m", path.display())]
    Columns { path: PathBuf, reason: String },
    #[error("{}, line {line}: {reason}", path.display())]
    Line {
        path: PathBuf,
        line: u64,
        reason: String,
    },
    #[error("{}: it has no coefficients below the names of its columns", path.display())]
    Empty { path: PathBuf },
}

/// Names of the columns. `by_mode` may be left out.
const COLUMNS: [&str; 5] = [
    "nodal_diameter",
    "mode",
    "by_mode",
    "real_n_m",
    "imaginary_n_m",
];
const BY_MODE: usize = 2;
/// Largest number of a mode.
const MOST_MODES: usize = 1000;

/// Reads the file at a path.
///
/// # Errors
/// A file that cannot be read, or that has no such coefficients: see [`InfluenceFileError`].
pub fn read(path: &Path) -> Result<Vec<InfluenceCoefficient>, InfluenceFileError> {
    let file = input::open(path).map_err(|source| InfluenceFileError::Io {
        path: path.to_owned(),
        source,
    })?;
    parse(file, path)
}

/// Reads the text of a file; `path` is for messages.
fn parse(text: impl Read, path: &Path) -> Result<Vec<InfluenceCoefficient>, InfluenceFileError> {
    let mut lines = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .flexible(true)
        .from_reader(text);
    let wrong = |line: u64, reason: String| InfluenceFileError::Line {
        path: path.to_owned(),
        line,
        reason,
    };
    let of_csv = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        wrong(line, "it is not a line of a CSV file in UTF-8".to_owned())
    };
    let header = lines.headers().map_err(of_csv)?.clone();
    let columns = places(&header).map_err(|reason| InfluenceFileError::Columns {
        path: path.to_owned(),
        reason,
    })?;
    let mut found: Vec<InfluenceCoefficient> = Vec::new();
    let mut line_of = HashMap::new();
    for record in lines.records() {
        let record = record.map_err(of_csv)?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != header.len() {
            let reason = format!(
                "it has {} values, and the first line names {} columns; commas separate the values, and numbers have a decimal point",
                record.len(),
                header.len()
            );
            return Err(wrong(line, reason));
        }
        let at = |column: usize| columns[column].map(|i| record.get(i).unwrap_or_default());
        let misfit = |column: usize, wanted: &str| {
            let value = at(column).unwrap_or_default().escape_debug();
            wrong(
                line,
                format!("`{}` = `{value}` is not {wanted}", COLUMNS[column]),
            )
        };
        let whole = |column: usize| at(column).and_then(|text| text.parse::<i64>().ok());
        let mode = |column: usize| {
            let number = whole(column).and_then(|n| usize::try_from(n).ok());
            let number = number.filter(|n| (1..=MOST_MODES).contains(n));
            number
                .ok_or_else(|| misfit(column, &format!("the number of a mode, 1 to {MOST_MODES}")))
        };
        let part = |column: usize| {
            let number = at(column).and_then(|text| text.parse::<f64>().ok());
            let number = number.filter(|v| v.is_finite() && v.abs() < 1e100);
            number.ok_or_else(|| misfit(column, "a finite number"))
        };
        let own = mode(1)?;
        let coefficient = InfluenceCoefficient {
            nodal_diameter: whole(0).ok_or_else(|| misfit(0, "a whole number"))?,
            mode: own,
            by_mode: match columns[BY_MODE] {
                None => own,
                Some(_) => mode(BY_MODE)?,
            },
            real_n_m: part(3)?,
            imaginary_n_m: part(4)?,
        };
        let InfluenceCoefficient {
            nodal_diameter: wave,
            mode: own,
            by_mode: by,
            ..
        } = coefficient;
        if let Some(before) = line_of.insert((wave, own, by), line) {
            let reason = format!(
                "nodal diameter {wave} has the coefficient of mode {own} by mode {by} also in line {before}"
            );
            return Err(wrong(line, reason));
        }
        found.push(coefficient);
    }
    if found.is_empty() {
        let path = path.to_owned();
        return Err(InfluenceFileError::Empty { path });
    }
    Ok(found)
}

/// Place of each of the columns in the first line, or what is wrong with it.
fn places(header: &csv::StringRecord) -> Result<[Option<usize>; 5], String> {
    for name in header {
        if name.contains([';', '\t']) {
            return Err("commas separate the columns, not semicolons or tabs".to_owned());
        }
        if !COLUMNS.contains(&name) {
            return Err(format!("there is no column `{}`", name.escape_debug()));
        }
        if header.iter().filter(|other| *other == name).count() > 1 {
            return Err(format!("column `{name}` stands twice"));
        }
    }
    let place = |name: &str| header.iter().position(|other| other == name);
    let places = COLUMNS.map(place);
    for (i, name) in COLUMNS.iter().enumerate() {
        if places[i].is_none() && i != BY_MODE {
            return Err(format!("it lacks the column `{name}`"));
        }
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed_coefficients(text: &str) -> Result<Vec<InfluenceCoefficient>, String> {
        parse(text.as_bytes(), Path::new("air.csv")).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_may_stand_in_any_order_and_modes_act_on_themselves() {
        let found = parsed_coefficients(
            "# of a CFD\nmode,nodal_diameter,imaginary_n_m, real_n_m\n2,-1,-3e4,1.5\n",
        );
        let expected = InfluenceCoefficient {
            nodal_diameter: -1,
            mode: 2,
            by_mode: 2,
            real_n_m: 1.5,
            imaginary_n_m: -3e4,
        };
        assert_eq!(found, Ok(vec![expected]));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let with = |rows: &str| {
            parsed_coefficients(&format!(
                "nodal_diameter,mode,by_mode,real_n_m,imaginary_n_m\n{rows}"
            ))
        };
        assert!(with("1,1,2,0,0\n1,2,1,0,0\n").is_ok());
        for (rows, words) in [
            ("", "no coefficients"),
            ("1.5,1,1,0,0\n", "line 2: `nodal_diameter` = `1.5`"),
            ("1,0,1,0,0\n", "`mode` = `0` is not the number of a mode"),
            ("1,1,-1,0,0\n", "`by_mode` = `-1`"),
            ("1,1,1,nan,0\n", "`real_n_m` = `nan`"),
            ("1,1,1,,0\n", "`real_n_m` = ``"),
            (
                "1,1,1,0\n",
                "line 2: it has 4 values, and the first line names 5",
            ),
            ("1,1,1,0,0\n1,1,2,0,5,0,0\n", "line 3: it has 7 values"),
            ("1,1,1,0,5,0\n", "numbers have a decimal point"),
            (
                "1,1,1,\"0,5\",0\n",
                "`real_n_m` = `0,5` is not a finite number",
            ),
            ("1,1,1,0,0\n1,1,1,2,0\n", "line 3: nodal diameter 1 has"),
            ("1,1,1,0,0\n2,1,1,0,0\n1,1,1,2,0\n", "also in line 2"),
        ] {
            let error = with(rows).unwrap_err();
            assert!(error.contains(words), "{rows}: {error}");
        }
        let error = parsed_coefficients("nodal_diameter,mode,damping\n1,1,0\n").unwrap_err();
        assert!(
            error.contains("`damping`") && error.contains("by_mode"),
            "{error}"
        );
        let error = parsed_coefficients("nodal_diameter;mode;real_n_m;imaginary_n_m\n1;1;0,5;0\n")
            .unwrap_err();
        assert!(error.contains("commas separate the columns"), "{error}");
        let error = parsed_coefficients("nodal_diameter,mode,real_n_m\n").unwrap_err();
        assert!(
            error.contains("lacks the column `imaginary_n_m`"),
            "{error}"
        );
        let error = read(Path::new("nowhere.csv")).unwrap_err().to_string();
        assert!(error.contains("cannot read nowhere.csv"), "{error}");
    }
}
