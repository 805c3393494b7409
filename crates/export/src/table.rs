//! Tables as files of comma-separated values (RFC 4180, with line feeds): a list of columns, each with
//! its heading and its cell of a row.
//!
//! A number is written as the shortest text that reads back as the same f64. A cell without a value
//! (a point that did not converge, a harmonic not computed) is empty.

use std::path::Path;

use super::{ExportError, write_file};

/// One cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// No value.
    Empty,
    /// A text. A text that a spreadsheet would take for a formula is written with an apostrophe
    /// before it.
    Text(String),
    /// A count or an index.
    Integer(usize),
    /// A number; an error if it is not finite.
    Number(f64),
}

impl Cell {
    /// The cell in words, with numbers as `number` writes them; nothing if it is empty.
    pub fn words(&self, number: impl Fn(f64) -> String) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Text(text) => text.clone(),
            Self::Integer(count) => count.to_string(),
            Self::Number(value) => number(*value),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self::Integer(count)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(cell: Option<T>) -> Self {
        cell.map_or(Self::Empty, T::into)
    }
}

/// The cell of a row.
type OfRow<'a, R> = Box<dyn Fn(&R) -> Cell + 'a>;

/// The columns of a table with rows of type `R`: headings and cells.
pub struct Columns<'a, R>(Vec<(String, OfRow<'a, R>)>);

impl<R> Default for Columns<'_, R> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'a, R> Columns<'a, R> {
    /// Adds a column on the right.
    pub fn add<C: Into<Cell>>(&mut self, heading: impl Into<String>, cell: impl Fn(&R) -> C + 'a) {
        let cell = move |row: &R| cell(row).into();
        self.0.push((heading.into(), Box::new(cell)));
    }

    /// Writes the headings and a line for each row.
    ///
    /// # Errors
    /// [`ExportError::NotFinite`] with the number of the row (1 is the first one below the headings)
    /// for a number that is not finite; a file that cannot be written.
    pub fn write(&self, path: &Path, rows: &[R]) -> Result<(), ExportError> {
        let mut table = csv::WriterBuilder::new()
            .terminator(csv::Terminator::Any(b'\n'))
            .from_writer(Vec::new());
        let failed = |error: csv::Error| ExportError::Write {
            path: path.to_owned(),
            source: error.into(),
        };
        let headings = self.0.iter().map(|(heading, _)| guarded(heading));
        table.write_record(headings).map_err(failed)?;
        for (index, row) in rows.iter().enumerate() {
            for (heading, cell) in &self.0 {
                let cell = match cell(row) {
                    Cell::Text(text) => Cell::Text(guarded(&text)),
                    Cell::Number(value) if !value.is_finite() => {
                        return Err(ExportError::NotFinite {
                            path: path.to_owned(),
                            field: heading.clone(),
                            index: index + 1,
                        });
                    }
                    cell => cell,
                };
                table.write_field(cell.words(number)).map_err(failed)?;
            }
            table.write_record(None::<&[u8]>).map_err(failed)?;
        }
        let text = table.into_inner().map_err(|error| ExportError::Write {
            path: path.to_owned(),
            source: std::io::Error::other(error.to_string()),
        })?;
        write_file(path, &text)
    }
}

/// A text that no spreadsheet takes for a formula; numbers are left as they are.
fn guarded(text: &str) -> String {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    if is_formula && text.parse::<f64>().is_err() {
        format!("'{text}")
    } else {
        text.to_owned()
    }
}

/// Shortest text that reads back as the same number: plain for moderate numbers, with an exponent
/// for very large and very small ones.
pub fn number(v: f64) -> String {
    if v == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e9).contains(&v.abs()) {
        format!("{v}")
    } else {
        format!("{v:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text of a table with these cells in its only row.
    fn written(headings: &[&str], row: Vec<Cell>) -> Result<String, ExportError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut table = Columns::default();
        for (k, heading) in headings.iter().enumerate() {
            table.add(*heading, move |row: &Vec<Cell>| row[k].clone());
        }
        table.write(&path, &[row])?;
        Ok(std::fs::read_to_string(path).unwrap())
    }

    impl From<&Cell> for Cell {
        fn from(cell: &Cell) -> Self {
            cell.clone()
        }
    }

    #[test]
    fn numbers_read_back_as_themselves() {
        let values = [
            0.0,
            1.0,
            -1.5,
            0.1 + 0.2,
            1e-300,
            6.02e23,
            -123456.789,
            f64::MIN_POSITIVE,
        ];
        for v in values {
            assert_eq!(number(v).parse::<f64>().unwrap().to_bits(), v.to_bits());
        }
    }

    #[test]
    fn cells_with_commas_and_quotes_are_quoted_and_empty_ones_are_empty() {
        let row = vec![Cell::Empty, Cell::Integer(3), "x\ny".into()];
        let table = written(&["a,b", "say \"x\"", "c"], row).unwrap();
        assert_eq!(table, "\"a,b\",\"say \"\"x\"\"\",c\n,3,\"x\ny\"\n");
    }

    #[test]
    fn no_text_is_a_formula_and_numbers_stay_numbers() {
        let texts = ["=1+1", "+x", "-x", "@x", "\t=1", "-1.5e-3", "+2", "a=b"];
        let row = texts.iter().map(|text| Cell::from(*text));
        let row: Vec<Cell> = row.chain([Cell::Number(-1.5)]).collect();
        let table = written(&["h"; 9], row).unwrap();
        let row = "'=1+1,'+x,'-x,'@x,'\t=1,-1.5e-3,+2,a=b,-1.5";
        assert_eq!(table.lines().nth(1), Some(row));
    }

    #[test]
    fn a_number_that_is_not_finite_is_an_error_with_its_place() {
        let error = written(&["tip_amplitude_m"], vec![Cell::Number(f64::NAN)]).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("t.csv") && message.contains("tip_amplitude_m"),
            "{message}"
        );
    }
}
