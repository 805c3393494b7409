//! Matlab's files of version 5 (`save -v6` and `save -v7`): named variables, of which the matrices
//! of real numbers are read, dense or sparse, compressed or not. This file alone knows flate2.
//!
//! A file has a header of 128 bytes and elements. An element has a tag (type and length) and data. A
//! variable is an element of elements: flags, size, name and values, and for a sparse matrix the
//! rows of its entries and where its columns begin. The values in the file may have a smaller type
//! than those in Matlab.

use std::io::Read as _;

use crate::NamedMatrix;
use crate::entries::{Entries, Sizes};
use crate::error::{Fault, Read, WRITE_AGAIN};
use crate::text;

const HEADER: usize = 128;

/// Types of elements that are no numbers.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Returns `true` for a file of version 5.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    matches!(bytes.get(126..HEADER), Some(b"IM" | b"MI")) && bytes.starts_with(b"MATLAB")
}

/// Reads all real matrices of a file.
pub(crate) fn parse(bytes: &[u8]) -> Read<Vec<NamedMatrix>> {
    let mut elements = Elements {
        is_big_endian: bytes.get(126..HEADER) == Some(b"MI"),
        bytes,
        next: HEADER,
        from: 0,
    };
    let mut found = Found {
        sizes: Sizes::of(bytes.len()),
        matrices: Vec::new(),
        left_out: Vec::new(),
    };
    while elements.next < bytes.len() {
        let element = elements.required("a variable")?;
        if element.kind == COMPRESSED {
            let data = decompressed(&element)?;
            found.sizes.add_bytes(data.len());
            let mut inner = Elements {
                bytes: &data,
                next: 0,
                from: 0,
                ..elements
            };
            found.add(&inner.required("a compressed variable")?)?;
        } else {
            found.add(&element)?;
        }
    }
    if found.matrices.is_empty() {
        let left_out = match &found.left_out[..] {
            [] => "it has no variables".to_owned(),
            left_out => text::shown(left_out.join(", ").as_bytes()),
        };
        return Err(Fault::NoMatrix { left_out }.in_file());
    }
    Ok(found.matrices)
}

fn decompressed(element: &Element) -> Read<Vec<u8>> {
    let mut data = Vec::new();
    let read = flate2::read::ZlibDecoder::new(element.data).read_to_end(&mut data);
    read.map_err(|error| {
        let found = format!("compressed data with an error ({error})");
        Fault::malformed(found, "a compressed variable", WRITE_AGAIN).at_byte(element.at)
    })?;
    Ok(data)
}

/// Element of a file.
#[derive(Debug, Clone, Copy)]
struct Element<'a> {
    is_big_endian: bool,
    kind: u32,
    data: &'a [u8],
    /// Place of the data.
    at: usize,
}

/// Elements one behind the other.
#[derive(Debug, Clone, Copy)]
struct Elements<'a> {
    is_big_endian: bool,
    bytes: &'a [u8],
    /// Index of the next element.
    next: usize,
    /// Place of the bytes.
    from: usize,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Option<u32> {
        let word = self.bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.is_big_endian {
            u32::from_be_bytes(word)
        } else {
            u32::from_le_bytes(word)
        })
    }

    /// Next element. Up to four bytes of data stand in the tag itself.
    fn required(&mut self, what: &str) -> Read<Element<'a>> {
        let missing = || text::cut_off(what);
        let tag = self.next;
        let first = self.word(tag).ok_or_else(missing)?;
        let (kind, length, from) = if first >> 16 == 0 {
            let length = self.word(tag + 4).ok_or_else(missing)? as usize;
            (first, length, tag + 8)
        } else {
            (first & 0xffff, (first >> 16) as usize, tag + 4)
        };
        let end = from.checked_add(length).ok_or_else(missing)?;
        let data = self.bytes.get(from..end).ok_or_else(missing)?;
        // Compressed data are not padded.
        let padding = if kind == COMPRESSED {
            0
        } else {
            end.wrapping_neg() % 8
        };
        self.next = if from == tag + 4 {
            tag + 8
        } else {
            end + padding
        };
        Ok(Element {
            is_big_endian: self.is_big_endian,
            kind,
            data,
            at: self.from + from,
        })
    }
}

/// Type of the numbers of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Signed,
    Unsigned,
    Real,
}

/// Numbers of an element.
#[derive(Debug, Clone, Copy)]
struct Numbers<'a> {
    element: Element<'a>,
    form: Form,
    /// Bytes of a number.
    size: usize,
}

impl<'a> Numbers<'a> {
    fn new(element: Element<'a>) -> Read<Self> {
        let (form, size) = match element.kind {
            1 => (Form::Signed, 1),
            2 => (Form::Unsigned, 1),
            3 => (Form::Signed, 2),
            4 => (Form::Unsigned, 2),
            5 => (Form::Signed, 4),
            6 => (Form::Unsigned, 4),
            7 => (Form::Real, 4),
            9 => (Form::Real, 8),
            12 => (Form::Signed, 8),
            13 => (Form::Unsigned, 8),
            other => {
                let found = format!("data of the type {other}");
                return Err(Fault::malformed(found, "numbers", WRITE_AGAIN).at_byte(element.at));
            }
        };
        Ok(Self {
            element,
            form,
            size,
        })
    }

    fn len(&self) -> usize {
        self.element.data.len() / self.size
    }

    /// Bits of a number, the signed ones as whole numbers of 64 bits.
    fn bits(&self, i: usize) -> u64 {
        let bytes = &self.element.data[i * self.size..(i + 1) * self.size];
        let add = |number: u64, byte: &u8| (number << 8) | u64::from(*byte);
        if self.element.is_big_endian {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        }
    }

    fn signed(&self, i: usize) -> i64 {
        let unused = 64 - 8 * self.size as u32;
        (self.bits(i) << unused) as i64 >> unused
    }

    fn real(&self, i: usize) -> f64 {
        match (self.form, self.size) {
            (Form::Signed, _) => self.signed(i) as f64,
            (Form::Unsigned, _) => self.bits(i) as f64,
            (Form::Real, 4) => f64::from(f32::from_bits(self.bits(i) as u32)),
            (Form::Real, _) => f64::from_bits(self.bits(i)),
        }
    }

    /// Whole number that counts something.
    fn count(&self, i: usize) -> Read<usize> {
        let count = match self.form {
            Form::Signed => usize::try_from(self.signed(i)).ok(),
            Form::Unsigned => usize::try_from(self.bits(i)).ok(),
            Form::Real => None,
        };
        count.ok_or_else(|| {
            let (found, expected) = (self.real(i).to_string(), "a number of rows or entries");
            Fault::malformed(found, expected, WRITE_AGAIN).at_byte(self.at(i))
        })
    }

    fn at(&self, i: usize) -> usize {
        self.element.at + i * self.size
    }

    /// Value of an entry of a matrix.
    fn value(&self, i: usize, name: &str) -> Read<f64> {
        let value = self.real(i);
        if value.is_finite() {
            return Ok(value);
        }
        let found = format!("{value} in `{name}`");
        let what = "an entry";
        Err(Fault::NotFinite { what, found }.at_byte(self.at(i)))
    }
}

/// Matrices that were read, and what was not.
#[derive(Debug)]
struct Found {
    sizes: Sizes,
    matrices: Vec<NamedMatrix>,
    left_out: Vec<String>,
}

impl Found {
    /// Reads a variable.
    fn add(&mut self, element: &Element) -> Read<()> {
        if element.kind != MATRIX {
            return Ok(());
        }
        let mut parts = Elements {
            is_big_endian: element.is_big_endian,
            bytes: element.data,
            next: 0,
            from: element.at,
        };
        if element.data.is_empty() {
            return Ok(());
        }
        let flags = Numbers::new(parts.required("the flags of a variable")?)?;
        let size = Numbers::new(parts.required("the size of a variable")?)?;
        let name = text::shown(parts.required("the name of a variable")?.data);
        if flags.len() == 0 {
            return Err(text::cut_off("the flags of a variable"));
        }
        let flags = flags.bits(0);
        let class = match flags & 0xff {
            1 => Some("a cell array"),
            2 | 3 => Some("a structure"),
            4 => Some("text"),
            5..=15 if flags & 0x0800 != 0 => Some("complex"),
            5..=15 if size.len() != 2 => Some("an array of more than two dimensions"),
            5..=15 => None,
            _ => Some("an object"),
        };
        if let Some(class) = class {
            self.left_out.push(format!("`{name}` is {class}"));
            return Ok(());
        }
        let size = [size.count(0)?, size.count(1)?];
        let [rows, columns] = size.map(|n| n as u64);
        let checked = self.sizes.add(rows, columns);
        let (rows, columns) = checked.map_err(|fault| fault.at_byte(element.at))?;
        let mut entries = Entries::new(rows, columns);
        let mut numbers = |what: &str| Numbers::new(parts.required(what)?);
        if flags & 0xff == 5 {
            let of = numbers("the rows of a sparse matrix")?;
            let begin = numbers("the columns of a sparse matrix")?;
            let values = numbers("the values of a sparse matrix")?;
            sparse(&mut entries, [of, begin, values], [rows, columns], &name)?;
        } else {
            let values = numbers("the values of a matrix")?;
            dense(&mut entries, values, [rows, columns], &name)?;
        }
        self.matrices.push(NamedMatrix {
            name: Some(name),
            matrix: entries.into_matrix()?,
            rows: None,
        });
        Ok(())
    }
}

/// Reads values column by column.
fn dense(entries: &mut Entries, values: Numbers, size: [usize; 2], name: &str) -> Read<()> {
    let [rows, columns] = size;
    if values.len() != rows * columns {
        let found = format!("{} values of `{name}`", values.len());
        let expected = format!("{rows} x {columns}");
        return Err(Fault::malformed(found, expected, WRITE_AGAIN).at_byte(values.at(0)));
    }
    for j in 0..columns {
        for i in 0..rows {
            let value = values.value(j * rows + i, name)?;
            if value != 0.0 {
                entries.push(i, j, value);
            }
        }
    }
    Ok(())
}

/// Reads the entries of the columns, given by their rows, the index of the first one of each
/// column, and their values.
fn sparse(
    entries: &mut Entries,
    [of, begin, values]: [Numbers; 3],
    [rows, columns]: [usize; 2],
    name: &str,
) -> Read<()> {
    let wrong = |found: String, expected: &str, at: usize| {
        Err(Fault::malformed(found, expected, WRITE_AGAIN).at_byte(at))
    };
    if begin.len() != columns + 1 {
        let found = format!("{} beginnings of columns of `{name}`", begin.len());
        return wrong(found, "one more than the columns", begin.at(0));
    }
    let most = of.len().min(values.len());
    let mut from = begin.count(0)?;
    for j in 0..columns {
        let to = begin.count(j + 1)?;
        if to < from || to > most {
            let found = format!("column {} of `{name}` from entry {from} to {to}", j + 1);
            return wrong(found, &format!("ascending up to {most}"), begin.at(j + 1));
        }
        for k in from..to {
            let row = of.count(k)?;
            if row >= rows {
                let (what, found) = ("row", format!("{}", row.saturating_add(1)));
                return Err(Fault::OutOfRange {
                    what,
                    found,
                    most: rows,
                }
                .at_byte(of.at(k)));
            }
            entries.push(row, j, values.value(k, name)?);
        }
        from = to;
    }
    Ok(())
}
