//! Numbers of a section of Gmsh's files, as text or binary.

use std::ops::Range;

use super::sections::Encoding;
use crate::MeshError;

/// Numbers of a section, in their order.
pub(super) struct SectionNumbers<'a> {
    pub bytes: &'a [u8],
    pub encoding: Encoding,
    pub section: &'static str,
    /// Range of bytes that are not yet read.
    pub at: Range<usize>,
}

impl<'a> SectionNumbers<'a> {
    pub fn error(&self, byte: usize, reason: impl Into<String>) -> MeshError {
        MeshError::Malformed {
            byte,
            at: format!("section ${}", self.section),
            reason: reason.into(),
        }
    }

    /// Next word of text.
    fn word(&mut self) -> Result<&'a str, MeshError> {
        let rest = &self.bytes[self.at.clone()];
        let is_space = |b: &u8| b.is_ascii_whitespace();
        let blanks = rest.iter().take_while(|b| is_space(b)).count();
        let length = rest[blanks..].iter().take_while(|b| !is_space(b)).count();
        let start = self.at.start + blanks;
        if length == 0 {
            return Err(self.error(start, "it breaks off"));
        }
        self.at.start = start + length;
        std::str::from_utf8(&self.bytes[start..start + length])
            .map_err(|_| self.error(start, "expected a number"))
    }

    fn parsed<T: std::str::FromStr>(&mut self) -> Result<T, MeshError> {
        let word = self.word()?;
        word.parse()
            .map_err(|_| self.error(self.at.start - word.len(), "expected a number"))
    }

    /// Next bytes of binary numbers.
    fn raw<const N: usize>(&mut self) -> Result<[u8; N], MeshError> {
        let rest = &self.bytes[self.at.clone()];
        let Some(found) = rest.first_chunk::<N>() else {
            return Err(self.error(self.at.start, "it breaks off"));
        };
        self.at.start += N;
        Ok(*found)
    }

    /// Count on the first line, which is text even in binary files. It is at most the number of
    /// items of `least` bytes that the bytes that follow can hold.
    pub fn count(&mut self, least: usize) -> Result<usize, MeshError> {
        let count: usize = self.parsed()?;
        if self.encoding != Encoding::Ascii {
            let end = self.bytes[self.at.clone()].iter().position(|b| *b == b'\n');
            self.at.start += end.map_or(self.at.len(), |end| end + 1);
        }
        if count > self.at.len() / least + 1 {
            let reason = format!("it announces {count} items and is shorter");
            return Err(self.error(self.at.start, reason));
        }
        Ok(count)
    }

    pub fn int(&mut self) -> Result<i64, MeshError> {
        Ok(match self.encoding {
            Encoding::Ascii => return self.parsed(),
            Encoding::LittleEndian => i32::from_le_bytes(self.raw()?).into(),
            Encoding::BigEndian => i32::from_be_bytes(self.raw()?).into(),
        })
    }

    pub fn float(&mut self) -> Result<f64, MeshError> {
        Ok(match self.encoding {
            Encoding::Ascii => return self.parsed(),
            Encoding::LittleEndian => f64::from_le_bytes(self.raw()?),
            Encoding::BigEndian => f64::from_be_bytes(self.raw()?),
        })
    }

    /// Next number, which must not be negative.
    pub fn natural(&mut self, what: &str) -> Result<u64, MeshError> {
        let byte = self.at.start;
        let found = self.int()?;
        u64::try_from(found).map_err(|_| self.error(byte, format!("{what} is {found}")))
    }

    /// Next number of eight bytes, which a file of MSH 4.1 has for counts and tags.
    pub fn size(&mut self) -> Result<u64, MeshError> {
        Ok(match self.encoding {
            Encoding::Ascii => return self.parsed(),
            Encoding::LittleEndian => u64::from_le_bytes(self.raw()?),
            Encoding::BigEndian => u64::from_be_bytes(self.raw()?),
        })
    }

    pub fn is_at_end(&self) -> bool {
        let rest = &self.bytes[self.at.clone()];
        rest.iter().all(u8::is_ascii_whitespace)
    }
}
