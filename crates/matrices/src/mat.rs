//! Matlab's files of version 5 (`save -v6` and `save -v7`): named variables, of which the matrices
//! of real numbers are read, dense or sparse, compressed or not.
//!
//! A file has a header of 128 bytes and elements. An element has a tag (type and length) and data. A
//! variable is an element of elements: flags, size, name and values, and for a sparse matrix the
//! rows of its entries and where its columns begin. The values in the file may have a smaller type
//! than those in Matlab. A compressed variable is decompressed bit by bit: what it becomes is never
//! held as a whole.

use crate::NamedMatrix;
use crate::contents::{FoundMatrices, Listed, MatrixContent, OtherVariable, Unread};
use crate::entries::{Budget, Entries, OF_A_NUMBER, OF_AN_ENTRY};
use crate::error::{MatrixFault, Read, WRITE_AGAIN};
use crate::text;

mod elements;

use elements::{MatNumber, NumberType, Stream};

const HEADER: usize = 128;
/// Types of elements that are no numbers.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Flag and classes of variables.
const COMPLEX: u64 = 0x0800;
const SPARSE: u64 = 5;
const OPAQUE: u64 = 17;

/// Returns `true` for a file of version 5.
pub(crate) fn is_mat_5(bytes: &[u8]) -> bool {
    matches!(bytes.get(126..HEADER), Some(b"IM" | b"MI")) && bytes.starts_with(b"MATLAB")
}

/// Finds the variables of a file.
pub(crate) fn parse(bytes: &[u8]) -> Read<FoundMatrices<'_>> {
    let is_big_endian = bytes.get(126..HEADER) == Some(b"MI");
    let mut matrices = FoundMatrices::default();
    let mut next = HEADER;
    // Less than a tag of zeros at the end is padding.
    let is_padding = |rest: &[u8]| rest.len() < 8 && rest.iter().all(|b| *b == 0);
    while !is_padding(&bytes[next.min(bytes.len())..]) {
        let mut stream = Stream::plain(&bytes[next..], next, is_big_endian);
        let (kind, length) = stream.tag("a variable")?;
        let from = stream.position();
        let end = from.checked_add(length).filter(|end| *end <= bytes.len());
        let end = end.ok_or_else(|| text::cut_off_failure("the end of a variable"))?;
        let variable = Variable {
            bytes: &bytes[from..end],
            at: from,
            is_compressed: kind == COMPRESSED,
            is_big_endian,
        };
        // Compressed data are not padded.
        next = end
            + if kind == COMPRESSED {
                0
            } else {
                stream.padding()
            };
        if (kind == MATRIX || kind == COMPRESSED) && length > 0 {
            variable.list(&mut matrices);
        }
    }
    Ok(matrices)
}

/// Variable of a file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Variable<'a> {
    bytes: &'a [u8],
    /// Place of the bytes in the file.
    at: usize,
    is_compressed: bool,
    is_big_endian: bool,
}

/// Part of a variable before its values.
struct Head {
    class: u64,
    is_complex: bool,
    name: String,
    size: Vec<u64>,
}

impl Head {
    /// Reads up to the values; `None` for a variable without a name.
    fn read(stream: &mut Stream) -> Read<Option<Self>> {
        let (_, flags) = stream.short("the flags of a variable")?;
        let flags = flags.first_chunk::<4>();
        let flags = flags.ok_or_else(|| text::cut_off_failure("the flags of a variable"))?;
        let flags = u64::from(stream.word(*flags));
        let class = flags & 0xff;
        let mut size = Vec::new();
        // An object of the kind of tables and strings has no size.
        if class != OPAQUE {
            let what = "the size of a variable";
            let (kind, data) = stream.short(what)?;
            let at = stream.position() - data.len();
            let form = NumberType::from_kind(kind, at)?;
            for (i, bytes) in data.chunks_exact(form.size).enumerate() {
                let number = form.number(bytes, stream.is_big_endian, at + i * form.size);
                size.push(number.count()? as u64);
            }
            if size.len() < 2 {
                return Err(text::cut_off_failure(what));
            }
        }
        let (_, name) = stream.short("the name of a variable")?;
        Ok((!name.is_empty()).then(|| Self {
            class,
            is_complex: flags & COMPLEX != 0,
            name: text::printable(&name),
            size,
        }))
    }

    /// Reason why a variable cannot be read as a matrix of real numbers.
    fn unreadable_reason(&self) -> Option<&'static str> {
        match self.class {
            1 => Some("a cell array"),
            2 => Some("a structure"),
            4 => Some("text"),
            5..=15 if self.is_complex => Some("complex"),
            5..=15 if self.size.len() != 2 => Some("an array of more than two dimensions"),
            5..=15 if self.size.contains(&0) => Some("empty"),
            5..=15 => None,
            16 => Some("a function"),
            _ => Some("an object"),
        }
    }
}

impl<'a> Variable<'a> {
    /// Adds the variable to the contents of a file.
    fn list(self, found: &mut FoundMatrices<'a>) {
        let head = self.stream().and_then(|mut stream| Head::read(&mut stream));
        match head {
            Err(failure) => found.list.push(Listed {
                name: None,
                columns: None,
                content: MatrixContent::Faulty(failure),
            }),
            // Matlab's own data about objects.
            Ok(None) => {}
            Ok(Some(head)) => match head.unreadable_reason() {
                Some(what) => found.others.push(OtherVariable {
                    name: head.name,
                    what,
                }),
                None => found.list.push(Listed {
                    name: Some(head.name),
                    columns: usize::try_from(head.size[1]).ok(),
                    content: MatrixContent::Unread(Box::new(self)),
                }),
            },
        }
    }

    /// Elements of the variable.
    fn stream(self) -> Read<Stream<'a>> {
        let Self {
            bytes,
            at,
            is_big_endian,
            ..
        } = self;
        if !self.is_compressed {
            return Ok(Stream::plain(bytes, at, is_big_endian));
        }
        let mut stream = Stream::compressed(bytes, at, is_big_endian);
        let (kind, length) = stream.tag("a compressed variable")?;
        if kind != MATRIX {
            let found = format!("compressed data of the type {kind}");
            return Err(MatrixFault::malformed(found, "a variable", WRITE_AGAIN).locate_byte(at));
        }
        stream.enter_element(length);
        Ok(stream)
    }
}

impl Unread for Variable<'_> {
    fn read(&self, budget: &mut Budget) -> Read<NamedMatrix> {
        let mut stream = self.stream()?;
        let head = Head::read(&mut stream)?;
        let Some(Head {
            class, name, size, ..
        }) = head
        else {
            return Err(text::cut_off_failure("the size of a variable"));
        };
        let [rows, columns] = [size[0], size[1]];
        let size = budget.size(rows, columns, &name);
        let size = size.map_err(|fault| fault.locate_byte(self.at))?;
        let mut matrix = Matrix {
            entries: Entries::new(size[0], size[1]),
            size,
            name: &name,
            budget,
        };
        if class == SPARSE {
            matrix.sparse(&mut stream)?;
        } else {
            matrix.dense(&mut stream)?;
        }
        let matrix = matrix.entries.into_matrix()?;
        Ok(NamedMatrix {
            name: Some(name),
            matrix,
            rows: None,
        })
    }
}

/// Matrix in the making.
struct Matrix<'b> {
    entries: Entries,
    size: [usize; 2],
    name: &'b str,
    budget: &'b mut Budget,
}

impl Matrix<'_> {
    fn push(&mut self, row: usize, column: usize, value: MatNumber) -> Read<()> {
        let at = value.at;
        let value = value.value(self.name)?;
        if value != 0.0 {
            let charged = self.budget.charge(OF_AN_ENTRY, self.name);
            charged.map_err(|fault| fault.locate_byte(at))?;
            self.entries.push(row, column, value);
        }
        Ok(())
    }

    fn wrong<T>(found: String, expected: &str, at: usize) -> Read<T> {
        Err(MatrixFault::malformed(found, expected, WRITE_AGAIN).locate_byte(at))
    }

    /// Reads values column by column.
    fn dense(&mut self, stream: &mut Stream) -> Read<()> {
        let [rows, columns] = self.size;
        let mut values = stream.numbers("the values of a matrix")?;
        if rows.checked_mul(columns) != Some(values.count) {
            let found = format!("{} values of `{}`", values.count, self.name);
            return Self::wrong(found, &format!("{rows} x {columns}"), values.position());
        }
        for j in 0..columns {
            for i in 0..rows {
                self.push(i, j, values.next()?)?;
            }
        }
        Ok(())
    }

    /// Reads the rows of the entries, the index of the first one of each column, and their values.
    fn sparse(&mut self, stream: &mut Stream) -> Read<()> {
        let [rows, columns] = self.size;
        let mut given = stream.numbers("the rows of a sparse matrix")?;
        let rows_at = given.position();
        let rows_size = given.form.size;
        // Behind the last entry there may be room for more, which means nothing.
        let mut of: Vec<u32> = Vec::new();
        for _ in 0..given.count {
            let charged = self.budget.charge(OF_A_NUMBER, self.name);
            charged.map_err(|fault| fault.locate_byte(rows_at))?;
            let row = given.next()?.count()?;
            of.push(u32::try_from(row).unwrap_or(u32::MAX));
        }
        given.skip()?;
        let mut given = stream.numbers("the columns of a sparse matrix")?;
        if given.count != columns + 1 {
            let found = format!("{} beginnings of columns of `{}`", given.count, self.name);
            return Self::wrong(found, "one more than the columns", given.position());
        }
        let mut begin = Vec::with_capacity(columns + 1);
        let mut last = 0;
        for j in 0..=columns {
            let number = given.next()?;
            let to = number.count()?;
            if (j > 0 && to < last) || to > of.len() {
                let found = format!("column {j} of `{}` from entry {last} to {to}", self.name);
                let expected = format!("ascending up to {}", of.len());
                return Self::wrong(found, &expected, number.at);
            }
            begin.push(to);
            last = to;
        }
        given.skip()?;
        let mut values = stream.numbers("the values of a sparse matrix")?;
        if last > values.count {
            let found = format!("{} values of `{}`", values.count, self.name);
            return Self::wrong(found, &format!("{last}"), values.position());
        }
        for _ in 0..begin[0] {
            values.next()?;
        }
        for (j, ends) in begin.windows(2).enumerate() {
            for (k, &row) in (ends[0]..).zip(&of[ends[0]..ends[1]]) {
                let row = row as usize;
                if row >= rows {
                    let (what, found) = ("row", (row + 1).to_string());
                    let most = rows;
                    let fault = MatrixFault::OutOfRange { what, found, most };
                    return Err(fault.locate_byte(rows_at + k * rows_size));
                }
                self.push(row, j, values.next()?)?;
            }
        }
        Ok(())
    }
}
