//! Tables of what the rows of a matrix are: CalculiX' .dof, tables with the columns node and
//! direction, and Ansys' mapping file.

use std::collections::HashMap;

use crate::Row;
use crate::error::{MatrixFault, Read};
use crate::text::{self, TextLines};

const REMEDY: &str = "a table has a header and lines like `12,3` below `node,direction`, and a \
                      file .dof of CalculiX lines like `12.3`";

/// Reads a table of rows.
pub(crate) fn parse(bytes: &[u8]) -> Read<Vec<Row>> {
    let mut lines = content(bytes);
    let Some((number, first)) = lines.next() else {
        return Err(MatrixFault::Empty.locate_file());
    };
    let rows = match header(first, number)? {
        Some(columns) => read_below_header(lines, columns)?,
        None => read_dotted_rows(content(bytes))?,
    };
    check_unique_rows(&rows)?;
    Ok(rows)
}

/// Lines that are neither blank nor comments.
fn content(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let lines = TextLines::new(bytes).map(|(number, line)| (number, line.trim_ascii()));
    lines.filter(|(_, line)| !line.is_empty() && line[0] != b'#')
}

/// Positions of the columns of a table.
#[derive(Debug, Clone, Copy)]
struct TableColumns {
    row: Option<usize>,
    node: usize,
    direction: usize,
    /// Number of columns.
    all: usize,
    separator: Separator,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    Blank,
    Byte(u8),
}

impl Separator {
    /// Fields of a line without blanks and quotation marks around them.
    fn fields(self, line: &[u8]) -> Vec<&[u8]> {
        let bare = |field: &'_ [u8]| -> std::ops::Range<usize> {
            let blanks = |b: &u8| b.is_ascii_whitespace() || *b == b'"';
            let from = field.iter().position(|b| !blanks(b)).unwrap_or(field.len());
            let to = field
                .iter()
                .rposition(|b| !blanks(b))
                .map_or(from, |at| at + 1);
            from..to
        };
        match self {
            Self::Blank => line
                .split(u8::is_ascii_whitespace)
                .filter(|field| !field.is_empty())
                .map(|field| &field[bare(field)])
                .collect(),
            Self::Byte(byte) => {
                let fields = line.split(|b| *b == byte);
                fields.map(|field| &field[bare(field)]).collect()
            }
        }
    }
}

/// Columns that the first line names, if it is a header.
fn header(line: &[u8], number: usize) -> Read<Option<TableColumns>> {
    let lower = line.to_ascii_lowercase();
    if !lower.iter().any(u8::is_ascii_alphabetic) {
        return Ok(None);
    }
    let contains = |word: &[u8]| lower.windows(word.len()).any(|part| part == word);
    // Ansys: `Matrix Eqn   Node   DOF`.
    if contains(b"eq") && contains(b"node") && contains(b"dof") {
        return Ok(Some(TableColumns {
            row: Some(0),
            node: 1,
            direction: 2,
            all: 3,
            separator: Separator::Blank,
        }));
    }
    let separator = [b',', b';', b'\t'].into_iter().find(|b| line.contains(b));
    let separator = separator.map_or(Separator::Blank, Separator::Byte);
    let names = separator.fields(&lower);
    let column = |name: &[u8]| names.iter().position(|n| *n == name);
    match (column(b"node"), column(b"direction")) {
        (Some(node), Some(direction)) => Ok(Some(TableColumns {
            row: column(b"row"),
            node,
            direction,
            all: names.len(),
            separator,
        })),
        _ => {
            let expected = "a header with the columns node and direction";
            Err(MatrixFault::malformed(text::quoted(line), expected, REMEDY).locate_line(number))
        }
    }
}

fn read_below_header<'a>(
    lines: impl Iterator<Item = (usize, &'a [u8])>,
    columns: TableColumns,
) -> Read<Vec<Row>> {
    let mut rows = Vec::new();
    let mut places: Vec<(u64, usize)> = Vec::new();
    for (number, line) in lines {
        let fields = columns.separator.fields(line);
        if fields.len() != columns.all {
            let found = format!("{} columns in {}", fields.len(), text::quoted(line));
            let expected = format!("{}, as in the header", columns.all);
            let remedy = "an empty node stands as `-`";
            return Err(MatrixFault::malformed(found, expected, remedy).locate_line(number));
        }
        if let Some(at) = columns.row {
            let wrong =
                || MatrixFault::malformed(text::quoted(fields[at]), "the number of a row", REMEDY);
            let place =
                text::parse_whole_number(fields[at]).ok_or_else(|| wrong().locate_line(number))?;
            places.push((place, number));
        }
        let row = row(fields[columns.node], fields[columns.direction]);
        rows.push(row.map_err(|fault| fault.locate_line(number))?);
    }
    if columns.row.is_some() {
        rows = reorder_rows(&rows, &places)?;
    }
    Ok(rows)
}

/// Puts rows in the places that a column gives.
fn reorder_rows(rows: &[Row], places: &[(u64, usize)]) -> Read<Vec<Row>> {
    let mut sorted: Vec<Option<Row>> = vec![None; rows.len()];
    for (row, (place, number)) in rows.iter().zip(places) {
        let index = place.checked_sub(1).and_then(|n| usize::try_from(n).ok());
        let slot = index.and_then(|index| sorted.get_mut(index));
        match slot {
            Some(slot @ None) => *slot = Some(*row),
            other => {
                let twice = if other.is_some() { " again" } else { "" };
                let found = format!("row {place}{twice}");
                let expected = format!("each number from 1 to {} once", rows.len());
                return Err(MatrixFault::malformed(found, expected, REMEDY).locate_line(*number));
            }
        }
    }
    Ok(sorted.into_iter().flatten().collect())
}

fn row(node: &[u8], direction: &[u8]) -> Result<Row, MatrixFault> {
    if node.is_empty() || node == b"-" {
        return Ok(Row::Generalised);
    }
    let wrong = |found: &[u8], expected: &str| {
        MatrixFault::malformed(text::quoted(found), expected, REMEDY)
    };
    let number =
        text::parse_whole_number(node).ok_or_else(|| wrong(node, "the number of a node"))?;
    let known = direction.to_ascii_lowercase();
    let direction = match &known[..] {
        b"1" | b"x" | b"ux" => 1,
        b"2" | b"y" | b"uy" => 2,
        b"3" | b"z" | b"uz" => 3,
        b"4" | b"rotx" | b"rx" => 4,
        b"5" | b"roty" | b"ry" => 5,
        b"6" | b"rotz" | b"rz" => 6,
        _ => {
            let expected = "a direction (1 to 6, x, y, z, ux, uy, uz, rotx, roty or rotz)";
            return Err(wrong(direction, expected));
        }
    };
    Ok(Row::Node {
        node: number,
        direction,
    })
}

/// Reads lines `node.direction`. They are no decimal numbers: 1.10 is not 1.1.
fn read_dotted_rows<'a>(lines: impl Iterator<Item = (usize, &'a [u8])>) -> Read<Vec<Row>> {
    let mut rows = Vec::new();
    for (number, line) in lines {
        let point = line.iter().position(|b| *b == b'.');
        let parts = point.map(|at| {
            (
                text::parse_whole_number(&line[..at]),
                text::parse_whole_number(&line[at + 1..]),
            )
        });
        let Some((Some(node), Some(direction))) = parts else {
            let expected = "`node.direction`";
            return Err(
                MatrixFault::malformed(text::quoted(line), expected, REMEDY).locate_line(number)
            );
        };
        let direction = match u8::try_from(direction) {
            Ok(direction @ 1..=6) => direction,
            _ => return Err(MatrixFault::Direction { node, direction }.locate_line(number)),
        };
        rows.push(Row::Node { node, direction });
    }
    Ok(rows)
}

/// Checks that no direction of a node has two rows.
fn check_unique_rows(rows: &[Row]) -> Read<()> {
    let mut first = HashMap::with_capacity(rows.len());
    for (i, row) in rows.iter().enumerate() {
        if let Row::Node { .. } = row
            && let Some(before) = first.insert(*row, i)
        {
            return Err(MatrixFault::RowTwice {
                what: row.to_string(),
                first: before + 1,
                second: i + 1,
            }
            .locate_file());
        }
    }
    Ok(())
}
