//! Elements of a file of Matlab and their numbers, read one after the other, whether they are
//! compressed or not. No other file uses flate2.

use std::io::{ErrorKind, Read as _};

use flate2::read::ZlibDecoder;

use crate::error::{MatrixFault, Read, WRITE_AGAIN};
use crate::text;

/// Most bytes of a name or of the numbers of rows and columns.
const MOST_OF_A_HEAD: usize = 1 << 16;
/// Bytes that are decompressed at once.
const CHUNK: usize = 1 << 16;

/// Elements one behind the other, decompressed if need be.
pub struct Stream<'a> {
    source: ByteSource<'a>,
    at: usize,
    /// Bytes up to the end of the variable.
    left: usize,
    padding: Option<usize>,
    pub is_big_endian: bool,
    /// Place of the compressed data in the file.
    compressed_at: usize,
}

enum ByteSource<'a> {
    Plain(&'a [u8]),
    Compressed(ZlibDecoder<&'a [u8]>),
}

impl<'a> Stream<'a> {
    /// Elements that are not compressed, from a place of the file on.
    pub fn plain(bytes: &'a [u8], at: usize, is_big_endian: bool) -> Self {
        Self {
            source: ByteSource::Plain(bytes),
            at,
            left: bytes.len(),
            padding: None,
            is_big_endian,
            compressed_at: at,
        }
    }

    /// Elements that are compressed; `at` is their place in the file.
    pub fn compressed(bytes: &'a [u8], at: usize, is_big_endian: bool) -> Self {
        Self {
            source: ByteSource::Compressed(ZlibDecoder::new(bytes)),
            at: 0,
            left: usize::MAX,
            padding: None,
            is_big_endian,
            compressed_at: at,
        }
    }

    /// Place of the next byte in the file, or in the decompressed data.
    pub fn position(&self) -> usize {
        self.at
    }

    /// Bytes between the last element and the next one.
    pub fn padding(&self) -> usize {
        self.padding.unwrap_or(0)
    }

    /// Goes on with the elements within the last one, whose length is given.
    pub fn enter_element(&mut self, length: usize) {
        (self.left, self.padding) = (length, None);
    }

    /// Fills a buffer with the next bytes.
    fn fill(&mut self, buffer: &mut [u8], missing: &str) -> Read<()> {
        let left = self.left.checked_sub(buffer.len());
        self.left = left.ok_or_else(|| text::cut_off_failure(missing))?;
        let read = match &mut self.source {
            ByteSource::Plain(bytes) => bytes.read_exact(buffer),
            ByteSource::Compressed(decoder) => decoder.read_exact(buffer),
        };
        self.at += buffer.len();
        read.map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => text::cut_off_failure(missing),
            _ => {
                let found = format!("compressed data with an error ({error})");
                let fault = MatrixFault::malformed(found, "a compressed variable", WRITE_AGAIN);
                fault.locate_byte(self.compressed_at)
            }
        })
    }

    pub fn word(&self, bytes: [u8; 4]) -> u32 {
        if self.is_big_endian {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        }
    }

    /// Type and length of the next element. The tag itself holds up to four bytes of data.
    pub fn tag(&mut self, what: &str) -> Read<(u32, usize)> {
        if let Some(padding) = self.padding.take() {
            self.fill(&mut [0; 8][..padding], what)?;
        }
        let mut word = [0; 4];
        self.fill(&mut word, what)?;
        let first = self.word(word);
        let (kind, length, is_short) = if first >> 16 == 0 {
            self.fill(&mut word, what)?;
            (first, self.word(word) as usize, false)
        } else {
            (first & 0xffff, (first >> 16) as usize, true)
        };
        let end = if is_short { 4 } else { 8 };
        let padding = match is_short {
            true => 4usize
                .checked_sub(length)
                .ok_or_else(|| text::cut_off_failure(what))?,
            false => length.wrapping_neg() % end,
        };
        self.padding = Some(padding);
        Ok((kind, length))
    }

    /// Data of a short element.
    pub fn short(&mut self, what: &str) -> Read<(u32, Vec<u8>)> {
        let (kind, length) = self.tag(what)?;
        if length > MOST_OF_A_HEAD {
            let found = format!("{length} bytes");
            return Err(MatrixFault::malformed(found, what, WRITE_AGAIN).locate_byte(self.at));
        }
        let mut data = vec![0; length];
        self.fill(&mut data, what)?;
        Ok((kind, data))
    }

    /// Goes through the numbers of the next element.
    pub fn numbers(&mut self, what: &str) -> Read<MatNumbers<'_, 'a>> {
        let (kind, length) = self.tag(what)?;
        let form = NumberType::from_kind(kind, self.at)?;
        if length > self.left {
            return Err(text::cut_off_failure(what));
        }
        Ok(MatNumbers {
            count: length / form.size,
            unread: length,
            form,
            what: what.to_owned(),
            chunk: Vec::new(),
            next: 0,
            stream: self,
        })
    }
}

/// Kind of the numbers of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Signed,
    Unsigned,
    Real,
}

/// Type of the numbers of an element.
#[derive(Debug, Clone, Copy)]
pub struct NumberType {
    kind: Kind,
    /// Bytes of a number.
    pub size: usize,
}

impl NumberType {
    pub fn from_kind(kind: u32, at: usize) -> Read<Self> {
        let (kind, size) = match kind {
            1 => (Kind::Signed, 1),
            2 => (Kind::Unsigned, 1),
            3 => (Kind::Signed, 2),
            4 => (Kind::Unsigned, 2),
            5 => (Kind::Signed, 4),
            6 => (Kind::Unsigned, 4),
            7 => (Kind::Real, 4),
            9 => (Kind::Real, 8),
            12 => (Kind::Signed, 8),
            13 => (Kind::Unsigned, 8),
            other => {
                let found = format!("data of the type {other}");
                return Err(MatrixFault::malformed(found, "numbers", WRITE_AGAIN).locate_byte(at));
            }
        };
        Ok(Self { kind, size })
    }

    pub fn number(self, bytes: &[u8], is_big_endian: bool, at: usize) -> MatNumber {
        let add = |number: u64, byte: &u8| (number << 8) | u64::from(*byte);
        let bits = if is_big_endian {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        };
        MatNumber {
            form: self,
            bits,
            at,
        }
    }
}

/// Number of a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct MatNumber {
    form: NumberType,
    bits: u64,
    /// Place, as in [`Stream::position`].
    pub at: usize,
}

impl MatNumber {
    fn signed(self) -> i64 {
        let unused = 64 - 8 * self.form.size as u32;
        (self.bits << unused) as i64 >> unused
    }

    pub fn real(self) -> f64 {
        match (self.form.kind, self.form.size) {
            (Kind::Signed, _) => self.signed() as f64,
            (Kind::Unsigned, _) => self.bits as f64,
            (Kind::Real, 4) => f64::from(f32::from_bits(self.bits as u32)),
            (Kind::Real, _) => f64::from_bits(self.bits),
        }
    }

    /// Whole number that counts something.
    pub fn count(self) -> Read<usize> {
        let count = match self.form.kind {
            Kind::Signed => usize::try_from(self.signed()).ok(),
            Kind::Unsigned => usize::try_from(self.bits).ok(),
            Kind::Real => None,
        };
        count.ok_or_else(|| {
            let (found, expected) = (self.real().to_string(), "a number of rows or entries");
            MatrixFault::malformed(found, expected, WRITE_AGAIN).locate_byte(self.at)
        })
    }

    /// Value of an entry of a matrix.
    pub fn value(self, name: &str) -> Read<f64> {
        let value = self.real();
        if value.is_finite() {
            return Ok(value);
        }
        let found = format!("{value} in `{name}`");
        let what = "an entry";
        Err(MatrixFault::NotFinite { what, found }.locate_byte(self.at))
    }
}

/// Numbers of an element, one after the other.
pub struct MatNumbers<'s, 'a> {
    stream: &'s mut Stream<'a>,
    pub form: NumberType,
    what: String,
    /// Number of them.
    pub count: usize,
    /// Bytes that follow the chunk.
    unread: usize,
    chunk: Vec<u8>,
    /// Place of the next number in the chunk.
    next: usize,
}

impl MatNumbers<'_, '_> {
    pub fn next(&mut self) -> Read<MatNumber> {
        let size = self.form.size;
        if self.next + size > self.chunk.len() {
            let length = CHUNK.min(self.unread - self.unread % size);
            if length == 0 {
                return Err(text::cut_off_failure(&self.what));
            }
            self.chunk.resize(length, 0);
            self.stream.fill(&mut self.chunk, &self.what)?;
            self.unread -= length;
            self.next = 0;
        }
        let at = self.stream.at - self.chunk.len() + self.next;
        let bytes = &self.chunk[self.next..self.next + size];
        self.next += size;
        Ok(self.form.number(bytes, self.stream.is_big_endian, at))
    }

    /// Place of the first number, before any was read.
    pub fn position(&self) -> usize {
        self.stream.at
    }

    /// Leaves the rest of the element.
    pub fn skip(mut self) -> Read<()> {
        while self.unread > 0 {
            let length = CHUNK.min(self.unread);
            self.chunk.resize(length, 0);
            self.stream.fill(&mut self.chunk, &self.what)?;
            self.unread -= length;
        }
        Ok(())
    }
}
