//! Numbers of an array: text, base64 or bytes, perhaps compressed.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use flate2::read::ZlibDecoder;

use super::xml::{Array, ArrayPosition, File, Scalar};
use crate::MeshError;

/// Four letters are three bytes; of the last four some may be padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Bytes that are taken in parts, and decoded only as far as they are taken.
struct ByteStream<'a> {
    rest: Cow<'a, [u8]>,
    at: usize,
    base64: bool,
    /// Bytes that are decoded and not yet taken.
    spare: Vec<u8>,
}

impl<'a> ByteStream<'a> {
    fn new(rest: impl Into<Cow<'a, [u8]>>, base64: bool) -> Self {
        Self {
            rest: rest.into(),
            at: 0,
            base64,
            spare: Vec::new(),
        }
    }

    fn read_bytes(&mut self, count: usize) -> Result<Vec<u8>, String> {
        let rest = &self.rest[self.at..];
        let short = || format!("it breaks off: {count} bytes are announced");
        if !self.base64 {
            let taken = rest.get(..count).ok_or_else(short)?.to_vec();
            self.at += count;
            return Ok(taken);
        }
        if count > self.spare.len() + rest.len() {
            return Err(short());
        }
        while self.spare.len() < count {
            let rest = &self.rest[self.at..];
            let letters = (count - self.spare.len()).div_ceil(3) * 4;
            let chunk = &rest[..letters.min(rest.len())];
            // One run of base64 ends with padding, and the next begins after it.
            let padding = chunk.iter().position(|letter| *letter == b'=');
            let end = padding
                .map_or(chunk.len(), |at| (at / 4 + 1) * 4)
                .min(chunk.len());
            if end == 0 {
                return Err(short());
            }
            let decoded = BASE64.decode_vec(&chunk[..end], &mut self.spare);
            decoded.map_err(|e| format!("it is no base64: {e}"))?;
            self.at += end;
        }
        let left = self.spare.split_off(count);
        Ok(std::mem::replace(&mut self.spare, left))
    }
}

/// Numbers of an array of `tuples` entries.
///
/// # Errors
/// An array of another length, or one that is broken.
pub(super) fn values(
    file: &File<'_>,
    array: &Array<'_>,
    tuples: usize,
) -> Result<Vec<f64>, MeshError> {
    decoded(file, array, tuples).map_err(|reason| MeshError::VtuArray {
        array: array.name.clone(),
        reason,
    })
}

fn decoded(file: &File<'_>, array: &Array<'_>, tuples: usize) -> Result<Vec<f64>, String> {
    let scalar = array.scalar.ok_or("its type is not one of numbers")?;
    let too_many = || "it is larger than any file".to_owned();
    let count = tuples.checked_mul(array.components).ok_or_else(too_many)?;
    let bytes = count.checked_mul(scalar.size()).ok_or_else(too_many)?;
    let stream = match array.place {
        ArrayPosition::Ascii => return ascii(&array.text.concat(), count),
        ArrayPosition::Binary => {
            let mut text = array.text.concat();
            text.retain(|letter| !letter.is_ascii_whitespace());
            ByteStream::new(text, true)
        }
        ArrayPosition::Appended(offset) => {
            let (data, base64) = file.appended.ok_or("the file has no <AppendedData>")?;
            let rest = data.get(offset..);
            ByteStream::new(rest.ok_or("it lies behind the appended data")?, base64)
        }
    };
    let bytes = if file.compressed {
        inflated(file, stream, bytes)?
    } else {
        plain(file, stream, bytes)?
    };
    Ok(numbers(&bytes, scalar, file.big_endian))
}

fn ascii(text: &[u8], count: usize) -> Result<Vec<f64>, String> {
    let text = String::from_utf8_lossy(text);
    let mut found = Vec::new();
    for word in text.split_ascii_whitespace() {
        let number = word
            .parse()
            .map_err(|_| format!("`{word}` is not a number"))?;
        found.push(number);
    }
    if found.len() == count {
        Ok(found)
    } else {
        Err(format!("it has {} numbers, expected {count}", found.len()))
    }
}

/// Next number of a header.
fn header(file: &File<'_>, stream: &mut ByteStream<'_>) -> Result<usize, String> {
    let size = if file.wide_header { 8 } else { 4 };
    let bytes = stream.read_bytes(size)?;
    let number = numbers(&bytes, Scalar::Unsigned(size), file.big_endian)[0];
    Ok(number as usize)
}

fn plain(file: &File<'_>, mut stream: ByteStream<'_>, expected: usize) -> Result<Vec<u8>, String> {
    let found = header(file, &mut stream)?;
    if found != expected {
        return Err(format!("it has {found} bytes, expected {expected}"));
    }
    stream.read_bytes(expected)
}

/// Bytes to which an array may grow when it is decompressed, for each byte of the file and besides.
const INFLATION: usize = 100;
const INFLATED: usize = 100 << 20;

/// Bytes of compressed blocks. All have the same size except the last, each compressed by itself.
fn inflated(
    file: &File<'_>,
    mut stream: ByteStream<'_>,
    expected: usize,
) -> Result<Vec<u8>, String> {
    let blocks = header(file, &mut stream)?;
    let (block, last) = (header(file, &mut stream)?, header(file, &mut stream)?);
    let last = if last == 0 { block } else { last };
    let whole = blocks
        .checked_sub(1)
        .map(|full| full.saturating_mul(block).saturating_add(last));
    let found = whole.unwrap_or(0);
    if found != expected {
        return Err(format!("it has {found} bytes, expected {expected}"));
    }
    if expected > INFLATED + INFLATION * file.size {
        return Err(format!(
            "it has {expected} bytes when it is decompressed, more than {INFLATION} times the size of the file: write the file \
             without compression if the array is right"
        ));
    }
    let mut sizes = Vec::new();
    for _ in 0..blocks {
        sizes.push(header(file, &mut stream)?);
    }
    let mut bytes = Vec::new();
    for (i, size) in sizes.into_iter().enumerate() {
        let length = if i + 1 == blocks { last } else { block };
        let before = bytes.len();
        let compressed = stream.read_bytes(size)?;
        let decoder = ZlibDecoder::new(&compressed[..]);
        let read = decoder.take(length as u64 + 1).read_to_end(&mut bytes);
        read.map_err(|e| format!("it cannot be decompressed: {e}"))?;
        let found = bytes.len() - before;
        if found != length {
            return Err(format!(
                "a block of it has {found} bytes, expected {length}"
            ));
        }
    }
    Ok(bytes)
}

/// Converts bytes to numbers. Whole numbers beyond 2^53 are rounded.
fn numbers(bytes: &[u8], scalar: Scalar, big_endian: bool) -> Vec<f64> {
    let number = |chunk: &[u8]| {
        let mut wide = [0; 8];
        for (i, byte) in chunk.iter().enumerate() {
            let place = if big_endian { chunk.len() - 1 - i } else { i };
            wide[place] = *byte;
        }
        let bits = u64::from_le_bytes(wide);
        match scalar {
            Scalar::Unsigned(_) => bits as f64,
            Scalar::Signed(size) => {
                let shift = 64 - 8 * size as u32;
                ((bits << shift) as i64 >> shift) as f64
            }
            Scalar::Float(4) => f32::from_bits(bits as u32).into(),
            Scalar::Float(_) => f64::from_bits(bits),
        }
    };
    bytes.chunks_exact(scalar.size()).map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two successive runs of base64, the first with padding, taken across their border.
    #[test]
    fn base64_is_taken_across_its_padding() {
        let stream = || ByteStream::new(&b"AQIDBA==BQYHCAk="[..], true);
        assert_eq!(stream().read_bytes(9).unwrap(), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
        let mut stream = stream();
        assert_eq!(stream.read_bytes(2).unwrap(), [1, 2]);
        assert_eq!(stream.read_bytes(4).unwrap(), [3, 4, 5, 6]);
        assert_eq!(stream.read_bytes(3).unwrap(), [7, 8, 9]);
        assert!(stream.read_bytes(1).is_err());
        for count in [usize::MAX, usize::MAX / 2, 100] {
            assert!(stream.read_bytes(count).is_err(), "{count}");
        }
    }
}
