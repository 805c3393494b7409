//! Entry of the cache: one file. It is written whole or not at all, and hashed, so that damage is
//! detected.
//!
//! The file contains a mark, the hash of the inputs of the entry, the content, the length of the
//! content, and a hash of all of these.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use dovetail_export::write_whole;
use dovetail_superelement::input;

const MARK: &[u8; 16] = b"dovetail entry 1";
const HASH: usize = 32;
const LENGTH: usize = 8;

/// Reason why an entry cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Damage {
    #[error("it cannot be read: {0}")]
    Io(#[from] io::Error),
    #[error("it is cut off")]
    Short,
    #[error("its content has changed since it was written")]
    Hash,
    #[error("it is another entry")]
    Key,
    #[error("its content makes no sense: {0}")]
    Content(#[from] postcard::Error),
}

/// Reads an entry; `None` if there is no such file.
pub(crate) fn read<T: DeserializeOwned>(
    path: &Path,
    key: &[u8; HASH],
) -> Result<Option<T>, Damage> {
    let bytes = match input::bytes(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        read => read?,
    };
    let (hashed, hash) = bytes.split_last_chunk::<HASH>().ok_or(Damage::Short)?;
    if blake3::hash(hashed) != *hash {
        return Err(Damage::Hash);
    }
    let (rest, length) = hashed.split_last_chunk::<LENGTH>().ok_or(Damage::Short)?;
    let (head, content) = rest
        .split_at_checked(MARK.len() + HASH)
        .ok_or(Damage::Short)?;
    if head[..MARK.len()] != MARK[..] || head[MARK.len()..] != key[..] {
        return Err(Damage::Key);
    }
    if content.len() as u64 != u64::from_le_bytes(*length) {
        return Err(Damage::Short);
    }
    Ok(Some(postcard::from_bytes(content)?))
}

/// Size of the file of an entry, bytes.
pub(crate) fn size(value: &impl Serialize) -> u64 {
    struct Count(u64);
    impl Write for Count {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0 += bytes.len() as u64;
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let mut count = Count((MARK.len() + HASH + LENGTH + HASH) as u64);
    match postcard::to_io(value, &mut count) {
        Ok(count) => count.0,
        Err(_) => u64::MAX,
    }
}

/// Writes a whole entry or nothing.
pub(crate) fn write(path: &Path, key: &[u8; HASH], value: &impl Serialize) -> io::Result<()> {
    write_whole(path, |file| write_parts(file, key, value))
}

fn write_parts(file: &mut File, key: &[u8; HASH], value: &impl Serialize) -> io::Result<()> {
    /// Writer that counts and hashes the bytes written through it.
    struct Passing<W> {
        into: W,
        hasher: blake3::Hasher,
        length: u64,
    }
    impl<W: Write> Write for Passing<W> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.into.write_all(bytes)?;
            self.hasher.update(bytes);
            self.length += bytes.len() as u64;
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            self.into.flush()
        }
    }
    let mut passing = Passing {
        into: BufWriter::new(file),
        hasher: blake3::Hasher::new(),
        length: 0,
    };
    passing.write_all(MARK)?;
    passing.write_all(key)?;
    let head = passing.length;
    // One buffer, so that small numbers do not come to the hasher byte by byte.
    let mut buffered = BufWriter::with_capacity(1 << 16, &mut passing);
    postcard::to_io(value, &mut buffered).map_err(|e| io::Error::other(e.to_string()))?;
    buffered.flush()?;
    drop(buffered);
    let length = passing.length - head;
    passing.write_all(&length.to_le_bytes())?;
    let hash = passing.hasher.finalize();
    passing.into.write_all(hash.as_bytes())?;
    passing.into.flush()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::folder::tests::Bench;

    const KEY: [u8; 32] = [7; 32];

    #[test]
    fn any_changed_byte_and_any_cut_is_noticed() {
        let bench = Bench::new();
        let path = bench.path("a");
        let value: Vec<u32> = (0..40).collect();
        assert!(matches!(read::<Vec<u32>>(&path, &KEY), Ok(None)));
        write(&path, &KEY, &value).unwrap();
        assert_eq!(read::<Vec<u32>>(&path, &KEY).unwrap().unwrap(), value);
        let whole = fs::read(&path).unwrap();
        assert_eq!(whole.len() as u64, size(&value));
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x10;
            fs::write(&path, &bytes).unwrap();
            assert!(read::<Vec<u32>>(&path, &KEY).is_err(), "byte {at}");
            fs::write(&path, &whole[..at]).unwrap();
            assert!(read::<Vec<u32>>(&path, &KEY).is_err(), "cut at {at}");
        }
        fs::write(&path, &whole).unwrap();
        assert!(matches!(
            read::<Vec<u32>>(&path, &[8; 32]),
            Err(Damage::Key)
        ));
    }

    #[test]
    fn two_that_write_one_entry_at_once_leave_a_whole_one() {
        let bench = Bench::new();
        let path = bench.path("a");
        let value: Vec<u64> = (0..100_000).collect();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..5 {
                        write(&path, &KEY, &value).unwrap();
                        assert_eq!(read::<Vec<u64>>(&path, &KEY).unwrap().unwrap(), value);
                    }
                });
            }
        });
        assert_eq!(bench.names(), ["a"]);
    }

    #[test]
    fn a_write_that_fails_leaves_nothing() {
        let bench = Bench::new();
        let taken = bench.path("taken");
        fs::create_dir_all(taken.join("not empty")).unwrap();
        assert!(write(&taken, &KEY, &1u8).is_err());
        assert_eq!(bench.names(), ["taken"]);
    }
}
