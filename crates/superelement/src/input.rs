//! Opening of files that a user names. Only regular files are read: a named pipe would block a run
//! for ever, a device may never end, and a folder has no useful contents.

use std::fs::{File, FileType};
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Most bytes of a text that a person writes: a scene, a study, a script of gmsh.
pub const MOST_TEXT_BYTES: u64 = 16 << 20;

/// Opens a regular file.
///
/// # Errors
/// The errors of the system, and [`ErrorKind::InvalidInput`] for anything but a regular file.
pub fn open(path: &Path) -> Result<File> {
    check(path)?;
    File::open(path)
}

/// Checks that there is a regular file, without opening it: opening a named pipe waits for its
/// other end.
///
/// # Errors
/// The errors of [`open`].
pub fn check(path: &Path) -> Result<()> {
    let kind = std::fs::metadata(path)?.file_type();
    if kind.is_file() {
        Ok(())
    } else {
        Err(Error::new(
            ErrorKind::InvalidInput,
            format!("it is {}; give a regular file", called(kind)),
        ))
    }
}

fn called(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "a named pipe";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    if kind.is_dir() {
        "a folder"
    } else {
        "no regular file"
    }
}

/// Reads all bytes of a regular file.
///
/// # Errors
/// The errors of [`open`] and of reading.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    check(path)?;
    std::fs::read(path)
}

/// Reads the bytes of a file that a person writes, at most [`MOST_TEXT_BYTES`].
///
/// # Errors
/// The errors of [`open`] and of reading, and [`ErrorKind::InvalidData`] for a longer file.
pub fn short_bytes(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?
        .take(MOST_TEXT_BYTES + 1)
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_TEXT_BYTES {
        Err(Error::new(
            ErrorKind::InvalidData,
            format!(
                "it is longer than {} MiB, too long for a text that a person writes",
                MOST_TEXT_BYTES >> 20
            ),
        ))
    } else {
        Ok(bytes)
    }
}

/// Reads the text of a file that a person writes, at most [`MOST_TEXT_BYTES`] of UTF-8.
///
/// # Errors
/// The errors of [`short_bytes`], and [`ErrorKind::InvalidData`] for bytes that are not UTF-8.
pub fn text(path: &Path) -> Result<String> {
    String::from_utf8(short_bytes(path)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let message = format!("it is not a text: byte {} is not UTF-8", at + 1);
        Error::new(ErrorKind::InvalidData, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::folder::Folder;

    #[test]
    fn only_regular_files_of_text_are_read() {
        let folder = Folder::new("input");
        let said = |path: &Path| text(path).unwrap_err().to_string();
        assert!(said(&folder).contains("a folder"));
        if cfg!(target_os = "linux") {
            assert!(said(Path::new("/dev/zero")).contains("a device"));
            assert!(bytes(Path::new("/dev/zero")).is_err());
        }
        let path = folder.write("a.toml", b"ab\xffcd");
        assert!(said(&path).contains("byte 3 is not UTF-8"));
        folder.write("a.toml", "name = 1");
        assert_eq!(text(&path).unwrap(), "name = 1");
        // A file of holes: nothing of it need be on the disk.
        let long = File::create(&path).unwrap();
        long.set_len(1 << 40).unwrap();
        assert!(said(&path).contains("longer than 16 MiB"));
    }
}
