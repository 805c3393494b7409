//! Entries in columns of a text: CalculiX' matrix storage and Abaqus' FORMAT=COORDINATE have
//! `row column value`, Abaqus' FORMAT=MATRIX INPUT and FORMAT=LABELS have `node, direction, node,
//! direction, value`. Such a file may have one of each pair of opposite entries, or both.

use std::collections::HashMap;

use crate::entries::{Entries, check_size};
use crate::error::{MatrixFault, Read, WRITE_AGAIN};
use crate::text::{self, TextLines};
use crate::{NamedMatrix, Row};

/// Number of columns of a text, if its first line of content has numbers alone.
pub(crate) fn columns(bytes: &[u8]) -> Option<usize> {
    let (_, line) = content(&mut TextLines::new(bytes))?;
    let mut count = 0;
    for field in text::fields(line) {
        text::number(field)?;
        count += 1;
    }
    Some(count)
}

/// Next line that is neither blank nor a comment of Abaqus.
fn content<'a>(lines: &mut TextLines<'a>) -> Option<(usize, &'a [u8])> {
    lines
        .by_ref()
        .map(|(number, line)| (number, line.trim_ascii()))
        .find(|(_, line)| !line.is_empty() && !line.starts_with(b"**"))
}

/// Reads entries whose rows and columns are numbered from 1. The matrix ends with its last entry.
pub(crate) fn numbered(bytes: &[u8]) -> Read<NamedMatrix> {
    let mut lines = TextLines::new(bytes);
    let mut entries = Entries::new(0, 0);
    let mut rows = 0;
    while let Some((number, line)) = content(&mut lines) {
        let Some([row, column, value]) = text::exactly::<3>(line) else {
            let expected = "an entry (`row column value`)";
            return Err(
                MatrixFault::malformed(text::quoted(line), expected, WRITE_AGAIN)
                    .locate_line(number),
            );
        };
        let mut index = |field: &[u8]| {
            let number = text::parse_whole_number(field).filter(|n| *n > 0);
            let number_or_fault = number.ok_or_else(|| {
                let expected = "the number of a row or column, counted from 1";
                MatrixFault::malformed(text::quoted(field), expected, WRITE_AGAIN)
            })?;
            check_size(number_or_fault, number_or_fault, bytes.len())?;
            rows = rows.max(number_or_fault as usize);
            Ok(number_or_fault as usize - 1)
        };
        let at_line = |fault: MatrixFault| fault.locate_line(number);
        let row = index(row).map_err(at_line)?;
        let column = index(column).map_err(at_line)?;
        entries.push(row, column, text::value(value, number)?);
    }
    entries.resize(rows, rows);
    Ok(NamedMatrix {
        name: None,
        matrix: entries.into_whole_matrix()?,
        rows: None,
    })
}

/// Label of a row. They are in the order of the rows of the matrix: nodes ascending, and after them
/// what the program adds by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Label {
    Node { node: u64, direction: u8 },
    Internal { node: u64, direction: u64 },
}

impl Label {
    fn row(self) -> Row {
        match self {
            Self::Node { node, direction } => Row::Node { node, direction },
            Self::Internal { .. } => Row::Generalised,
        }
    }
}

/// Label of a node and a direction. Nodes with a negative number are internal ones of Abaqus.
fn label(node: &[u8], direction: &[u8]) -> Result<Label, MatrixFault> {
    let number = |field: &[u8], expected: &str| {
        let wrong = || MatrixFault::malformed(text::quoted(field), expected, WRITE_AGAIN);
        text::signed(field).ok_or_else(wrong)
    };
    let node = number(node, "the number of a node")?;
    let direction = number(direction, "a direction from 1 to 6")?;
    let direction = u64::try_from(direction).unwrap_or(0);
    match u64::try_from(node) {
        Ok(node) if node > 0 => match u8::try_from(direction) {
            Ok(direction @ 1..=6) => Ok(Label::Node { node, direction }),
            _ => Err(MatrixFault::Direction { node, direction }),
        },
        _ => Ok(Label::Internal {
            node: node.unsigned_abs(),
            direction,
        }),
    }
}

/// Numbers of labels in the order in which they were found.
#[derive(Debug, Default)]
struct Found {
    numbers: HashMap<Label, u32>,
}

impl Found {
    /// Number of a label, which is often that of the entry before.
    fn number(&mut self, label: Label, last: &mut Option<(Label, u32)>) -> usize {
        let known = last.filter(|(known, _)| *known == label);
        let number = known.map_or_else(
            || {
                let next = self.numbers.len() as u32;
                *self.numbers.entry(label).or_insert(next)
            },
            |(_, number)| number,
        );
        *last = Some((label, number));
        number as usize
    }

    /// Labels in the order of rows, and the row of each number.
    fn sorted_labels(self) -> (Vec<Row>, Vec<u32>) {
        let mut sorted: Vec<_> = self.numbers.into_iter().collect();
        sorted.sort_unstable();
        let mut row_of = vec![0; sorted.len()];
        for (row, (_, number)) in sorted.iter().enumerate() {
            row_of[*number as usize] = row as u32;
        }
        let rows = sorted.iter().map(|(label, _)| label.row()).collect();
        (rows, row_of)
    }
}

/// Reads entries whose rows and columns are named by node and direction.
pub(crate) fn labelled(bytes: &[u8]) -> Read<NamedMatrix> {
    let mut lines = TextLines::new(bytes);
    let mut entries = Entries::new(0, 0);
    let mut matrix = Found::default();
    let (mut last_row, mut last_column) = (None, None);
    while let Some((number, line)) = content(&mut lines) {
        let Some([node, direction, other_node, other_direction, value]) = text::exactly::<5>(line)
        else {
            let expected = "an entry (`node, direction, node, direction, value`)";
            return Err(
                MatrixFault::malformed(text::quoted(line), expected, WRITE_AGAIN)
                    .locate_line(number),
            );
        };
        let at_line = |fault: MatrixFault| fault.locate_line(number);
        let row = label(node, direction).map_err(at_line)?;
        let column = label(other_node, other_direction).map_err(at_line)?;
        let row = matrix.number(row, &mut last_row);
        let column = matrix.number(column, &mut last_column);
        entries.push(row, column, text::value(value, number)?);
    }
    let (rows, row_of) = matrix.sorted_labels();
    entries.renumber(&row_of);
    entries.resize(rows.len(), rows.len());
    Ok(NamedMatrix {
        name: None,
        matrix: entries.into_whole_matrix()?,
        rows: Some(rows),
    })
}
