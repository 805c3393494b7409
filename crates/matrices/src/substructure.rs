//! Substructures of Abaqus (`*SUBSTRUCTURE MATRIX OUTPUT`) and CalculiX: a linear user element with
//! the lists of its nodes and directions, and its matrices as lower triangles by rows.
//!
//! The values of a matrix follow one another whatever the ends of lines: Abaqus puts four on a line,
//! CalculiX as many as stand in a row. Of an unsymmetric element (`UNSYM`) Abaqus writes the whole
//! stiffness, and the other matrices as triangles: their number tells.

use crate::contents::FoundMatrices;
use crate::entries::Entries;
use crate::error::{MatrixFault, Read, WRITE_AGAIN};
use crate::text::{self, TextLines};
use crate::{NamedMatrix, Row};

/// Keyword in capital letters without blanks, with the rest of its line, if the line is one.
fn keyword(line: &[u8]) -> Option<Vec<u8>> {
    let is_one = line.starts_with(b"*") && !line.starts_with(b"**");
    is_one.then(|| {
        let letters = line[1..].iter().filter(|b| !b.is_ascii_whitespace());
        letters.map(u8::to_ascii_uppercase).collect()
    })
}

/// Returns `true` if the first keyword of a text is that of a user element.
pub(crate) fn is_substructure(bytes: &[u8]) -> bool {
    let lines = TextLines::new(bytes).map(|(_, line)| line.trim_ascii());
    let mut content = lines.filter(|line| !line.is_empty() && !line.starts_with(b"**"));
    let first = content.next().and_then(keyword);
    first.is_some_and(|keyword| keyword.starts_with(b"USERELEMENT"))
}

/// What the lines up to the next keyword belong to.
enum KeywordSection {
    Outside,
    /// Lists of directions.
    Directions,
    Matrix {
        name: String,
        line: usize,
        /// Values, or the fault of the first wrong one.
        values: Read<Vec<f64>>,
    },
}

/// Reads all matrices of a file.
pub(crate) fn parse(bytes: &[u8]) -> Read<FoundMatrices<'static>> {
    let mut part = KeywordSection::Outside;
    let mut element = UserElement {
        bytes: bytes.len(),
        ..UserElement::default()
    };
    let mut found_matrices = FoundMatrices::default();
    let mut lists_nodes = false;
    for (number, line) in TextLines::new(bytes) {
        let line = line.trim_ascii();
        if let Some(comment) = line.strip_prefix(b"**") {
            if matches!(part, KeywordSection::Directions) {
                let words = comment.trim_ascii();
                if words.eq_ignore_ascii_case(b"ELEMENT NODES") {
                    lists_nodes = true;
                } else if lists_nodes {
                    element.add_nodes(words, number)?;
                }
            }
        } else if let Some(keyword) = keyword(line) {
            element.finish(&mut part, &mut found_matrices)?;
            if keyword.starts_with(b"USERELEMENT") {
                if !found_matrices.list.is_empty() || !element.nodes.is_empty() {
                    let what = "a file of several elements".to_owned();
                    let remedy = "write the matrices of the whole model (*MATRIX OUTPUT) or of a \
                                  substructure";
                    return Err(MatrixFault::NotRead { what, remedy }.locate_line(number));
                }
                element.announced =
                    parameter(&keyword, b"NODES").and_then(text::parse_whole_number);
                part = KeywordSection::Directions;
            } else if keyword.starts_with(b"MATRIX,") {
                let name = parameter(&keyword, b"TYPE").map_or(String::new(), text::printable);
                element.complete(number)?;
                part = KeywordSection::Matrix {
                    name,
                    line: number,
                    values: Ok(Vec::new()),
                };
            } else {
                part = KeywordSection::Outside;
            }
        } else if !line.is_empty() {
            match &mut part {
                KeywordSection::Outside => {}
                KeywordSection::Directions => {
                    lists_nodes = false;
                    element.add_directions(line, number)?;
                }
                KeywordSection::Matrix { values, .. } => {
                    for field in text::fields(line) {
                        match (&mut *values, text::value(field, number)) {
                            (Ok(list), Ok(value)) => list.push(value),
                            (Ok(_), Err(failure)) => *values = Err(failure),
                            (Err(_), _) => {}
                        }
                    }
                }
            }
        }
    }
    element.finish(&mut part, &mut found_matrices)?;
    if found_matrices.list.is_empty() {
        return Err(text::cut_off_failure("the first *MATRIX"));
    }
    Ok(found_matrices)
}

/// Value of a parameter of a keyword.
fn parameter<'a>(keyword: &'a [u8], name: &[u8]) -> Option<&'a [u8]> {
    let parts = keyword.split(|b| *b == b',');
    let mut values = parts.filter_map(|part| part.strip_prefix(name)?.strip_prefix(b"="));
    values.next()
}

/// Nodes of the element with their directions.
#[derive(Debug, Default)]
struct UserElement {
    /// Length of the file, which has a triangle of the rows.
    bytes: usize,
    /// Number of nodes that the keyword says.
    announced: Option<u64>,
    nodes: Vec<i64>,
    /// Directions of the nodes from a position on, counted from 0.
    directions: Vec<(usize, Vec<u64>)>,
    rows: Vec<Row>,
}

impl UserElement {
    /// Reads a comment with numbers of nodes.
    fn add_nodes(&mut self, words: &[u8], number: usize) -> Read<()> {
        for field in text::fields(words) {
            let wrong =
                || MatrixFault::malformed(text::quoted(field), "the number of a node", WRITE_AGAIN);
            let node = text::signed(field).ok_or_else(|| wrong().locate_line(number))?;
            self.nodes.push(node);
        }
        Ok(())
    }

    /// Reads a list of directions. The first list is that of the first node; each other begins with
    /// the position of the node from which on it holds.
    fn add_directions(&mut self, line: &[u8], number: usize) -> Read<()> {
        let wrong = |field: &[u8], expected: &str| {
            MatrixFault::malformed(text::quoted(field), expected, WRITE_AGAIN).locate_line(number)
        };
        let mut fields = text::fields(line);
        let mut from = 0;
        if let Some((before, _)) = self.directions.last() {
            let field = fields.next().unwrap_or_default();
            let position = text::parse_whole_number(field).and_then(|n| usize::try_from(n).ok());
            let least = before + 2;
            let is_next = |n: &usize| *n >= least && *n <= self.nodes.len();
            let position = position.filter(is_next).ok_or_else(|| {
                let most = self.nodes.len();
                wrong(
                    field,
                    &format!("the position of a node from {least} to {most}"),
                )
            })?;
            from = position - 1;
        }
        let mut list = Vec::new();
        for field in fields {
            list.push(text::parse_whole_number(field).ok_or_else(|| wrong(field, "a direction"))?);
        }
        self.directions.push((from, list));
        Ok(())
    }

    /// Lists the rows.
    fn complete(&mut self, number: usize) -> Read<()> {
        if !self.rows.is_empty() {
            return Ok(());
        }
        let nodes = self.nodes.len();
        if self
            .announced
            .is_some_and(|announced| announced != nodes as u64)
            || nodes == 0
        {
            let announced = self.announced.map_or("some".to_owned(), |n| n.to_string());
            let expected = format!("{announced} below `** ELEMENT NODES`");
            let fault = MatrixFault::malformed(format!("{nodes} nodes"), expected, WRITE_AGAIN);
            return Err(fault.locate_line(number));
        }
        let ends = self.directions.iter().skip(1).map(|(from, _)| *from);
        let ends = ends.chain([nodes]);
        for ((from, directions), end) in self.directions.iter().zip(ends) {
            for node in &self.nodes[*from..end] {
                for direction in directions {
                    let row = row(*node, *direction).map_err(|fault| fault.locate_line(number))?;
                    let n = self.rows.len();
                    if n * n > self.bytes {
                        let announced = format!("a substructure of more than {n} rows");
                        let bytes = self.bytes;
                        return Err(MatrixFault::TooLarge { announced, bytes }.locate_line(number));
                    }
                    self.rows.push(row);
                }
            }
        }
        if self.rows.is_empty() {
            return Err(text::cut_off_failure("the directions of the nodes"));
        }
        Ok(())
    }

    /// Makes a matrix of the values that were read.
    fn finish(&self, part: &mut KeywordSection, found: &mut FoundMatrices) -> Read<()> {
        let KeywordSection::Matrix { name, line, values } =
            std::mem::replace(part, KeywordSection::Outside)
        else {
            return Ok(());
        };
        let n = self.rows.len();
        let matrix = match values {
            Ok(values) => {
                let whole = self.matrix(&values);
                let wrong = || {
                    let found = format!("{} values of {name}", values.len());
                    let expected = format!("{} or {} for {n} rows", n * (n + 1) / 2, n * n);
                    MatrixFault::malformed(found, expected, WRITE_AGAIN).locate_line(line)
                };
                whole.ok_or_else(wrong)?.into_matrix()
            }
            Err(failure) => Err(failure),
        };
        let name = Some(name);
        let matrix = matrix.map(|matrix| NamedMatrix {
            name: name.clone(),
            matrix,
            rows: Some(self.rows.clone()),
        });
        found.add(name, n, matrix);
        Ok(())
    }

    /// Entries of the lower triangle by rows, or of all columns; `None` for another number of them.
    fn matrix(&self, values: &[f64]) -> Option<Entries> {
        let n = self.rows.len();
        let mut entries = Entries::new(n, n);
        if values.len() == n * (n + 1) / 2 {
            let places = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)));
            push(&mut entries, places, values);
            entries.mirror();
        } else if values.len() == n * n {
            let places = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
            push(&mut entries, places, values);
        } else {
            return None;
        }
        Some(entries)
    }
}

fn push(entries: &mut Entries, places: impl Iterator<Item = (usize, usize)>, values: &[f64]) {
    for ((i, j), value) in places.zip(values) {
        if *value != 0.0 {
            entries.push(i, j, *value);
        }
    }
}

/// Row of a node and direction. What no node of a mesh has is a generalised coordinate.
fn row(node: i64, direction: u64) -> Result<Row, MatrixFault> {
    match u64::try_from(node) {
        Ok(node) if node > 0 => match u8::try_from(direction) {
            Ok(direction @ 1..=6) => Ok(Row::Node { node, direction }),
            _ => Err(MatrixFault::Direction { node, direction }),
        },
        _ => Ok(Row::Generalised),
    }
}
