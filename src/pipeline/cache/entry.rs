//! One entry, one file: written whole or not at all, and hashed, so that damage is noticed.
//!
//! The file is a mark, the hash of what the entry depends on, the content, the content's length, and a hash of
//! all before.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::turn::LOCK;

const MARK: &[u8; 16] = b"dovetail entry 1";
const HASH: usize = 32;
const LENGTH: usize = 8;
/// Of the name of an entry under way.
const PART: &str = "part";

/// Why an entry is of no use.
#[derive(Debug, thiserror::Error)]
pub(super) enum Damage {
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

/// `None` where there is no such file.
pub(super) fn read<T: DeserializeOwned>(
    path: &Path,
    key: &[u8; HASH],
) -> Result<Option<T>, Damage> {
    let bytes = match fs::read(path) {
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

/// Bytes of the file of an entry.
pub(super) fn size(value: &impl Serialize) -> u64 {
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

/// Writes under a name of its own, which no other run uses, and takes the entry's name at the end.
pub(super) fn write(path: &Path, key: &[u8; HASH], value: &impl Serialize) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let part = part_of(path);
    let written = write_part(&part, key, value).and_then(|()| fs::rename(&part, path));
    if written.is_err() {
        let _ = fs::remove_file(&part); // the first failure is the one to report
    }
    written
}

fn part_of(path: &Path) -> PathBuf {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let nanoseconds = now.map_or(0, |t| t.as_nanos());
    path.with_extension(format!("{}-{nanoseconds}.{PART}", std::process::id()))
}

fn write_part(part: &Path, key: &[u8; HASH], value: &impl Serialize) -> io::Result<()> {
    /// Counts and hashes what passes.
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
    let file = File::options().write(true).create_new(true).open(part)?;
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

/// Removes the entries used longest ago until all together are within the limit; `newest` stays. Entries
/// under way that nobody has written to for `abandoned` go, too.
pub(super) fn make_room(folder: &Path, limit_bytes: u64, newest: &Path, abandoned: Duration) {
    let Ok(files) = fs::read_dir(folder) else {
        return;
    };
    let (mut entries, mut total) = (Vec::new(), 0);
    for file in files.flatten() {
        let path = file.path();
        // Another run may have removed it meanwhile.
        let Ok(about) = file.metadata() else { continue };
        let used = about.modified().unwrap_or(UNIX_EPOCH);
        if !about.is_file() {
            continue;
        }
        if path.extension().is_some_and(|e| e == PART || e == LOCK) {
            if used.elapsed().is_ok_and(|age| age > abandoned) {
                let _ = fs::remove_file(&path);
            }
            continue;
        }
        total += about.len();
        if path != newest {
            entries.push((used, path, about.len()));
        }
    }
    entries.sort();
    for (_, path, size) in entries {
        if total <= limit_bytes {
            return;
        }
        if fs::remove_file(&path).is_ok() {
            total -= size;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let name = format!("dovetail-entry-{name}-{}", std::process::id());
            let path = std::env::temp_dir().join(name);
            let _ = fs::remove_dir_all(&path);
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }
        fn names(&self) -> Vec<String> {
            let files = fs::read_dir(&self.0).unwrap().flatten();
            let mut names: Vec<_> = files
                .map(|f| f.file_name().into_string().unwrap())
                .collect();
            names.sort();
            names
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    const KEY: [u8; 32] = [7; 32];

    #[test]
    fn any_changed_byte_and_any_cut_is_noticed() {
        let folder = Folder::new("damage");
        let path = folder.0.join("a");
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
        let folder = Folder::new("race");
        let path = folder.0.join("a");
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
        assert_eq!(folder.names(), ["a"]);
    }

    #[test]
    fn a_write_that_fails_leaves_nothing() {
        let folder = Folder::new("failed");
        let taken = folder.0.join("taken");
        fs::create_dir_all(taken.join("not empty")).unwrap();
        assert!(write(&taken, &KEY, &1u8).is_err());
        assert_eq!(folder.names(), ["taken"]);
    }

    #[test]
    fn those_used_longest_ago_leave_first() {
        let folder = Folder::new("room");
        let file = |name: &str, age_s: u64| {
            let path = folder.0.join(name);
            fs::write(&path, [0; 100]).unwrap();
            let then = SystemTime::now() - Duration::from_secs(age_s);
            File::options()
                .append(true)
                .open(&path)
                .unwrap()
                .set_modified(then)
                .unwrap();
            path
        };
        for (name, age_s) in [("b", 50), ("a", 300), ("c", 400), ("d.1.part", 500)] {
            file(name, age_s);
        }
        let newest = file("e", 1000);
        let hour = Duration::from_secs(3600);
        make_room(&folder.0, 400, &newest, hour);
        assert_eq!(folder.names(), ["a", "b", "c", "d.1.part", "e"]);
        make_room(&folder.0, 399, &newest, hour);
        assert_eq!(folder.names(), ["a", "b", "d.1.part", "e"]);
        make_room(&folder.0, 250, &newest, hour);
        assert_eq!(folder.names(), ["b", "d.1.part", "e"]);
        make_room(&folder.0, 10, &newest, Duration::from_secs(60));
        assert_eq!(folder.names(), ["e"]);
    }
}
