//! Writing of files, through which all results pass, and reading of JSON.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::ExportError;
use dovetail_superelement::input;

/// Suffix of the name of an incomplete file, after [`RANDOM`] random characters.
const PART: &str = ".part";
const RANDOM: usize = 6;

/// Name of the file that an incomplete file was to become when its process was killed; `None` if
/// `name` is not the name of an incomplete file.
pub fn name_of_part(name: &str) -> Option<&str> {
    let (whole, random) = name.strip_suffix(PART)?.rsplit_once('.')?;
    let is_random = random.len() == RANDOM && random.bytes().all(|b| b.is_ascii_alphanumeric());
    is_random.then_some(whole)
}

/// Writes a whole file or nothing. Missing folders are created.
///
/// # Errors
/// A folder or a file that cannot be written.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    if let Some(folder) = path.parent() {
        create_folder(folder)?;
    }
    write_whole(path, |file| file.write_all(bytes)).map_err(|source| ExportError::Write {
        path: path.to_path_buf(),
        source,
    })
}

/// Writes a value as indented JSON, the whole file or nothing.
///
/// # Errors
/// As for [`write_file`]; a value that JSON cannot hold.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), ExportError> {
    let text = serde_json::to_string_pretty(value).map_err(|source| ExportError::EncodeJson {
        path: path.to_path_buf(),
        source,
    })?;
    write_file(path, (text + "\n").as_bytes())
}

/// Reads a JSON file; `None` if there is no such file, or if it holds no such value.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&input::bytes(path).ok()?).ok()
}

/// Writes a whole file or nothing. `write` writes to a neighbour `<name>.<six characters>.part`,
/// which is renamed at the end.
///
/// # Errors
/// Errors of the file system; nothing is left behind then.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut fs::File) -> io::Result<()>,
) -> io::Result<()> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&name).rand_bytes(RANDOM).suffix(PART);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut part = builder.tempfile_in(folder.unwrap_or(Path::new(".")))?;
    write(part.as_file_mut())?;
    part.persist(path)?;
    Ok(())
}

/// Creates a folder and its missing parents.
///
/// # Errors
/// A folder that cannot be created.
pub fn create_folder(folder: &Path) -> Result<(), ExportError> {
    // The folder of a bare name is the working directory.
    if folder.as_os_str().is_empty() {
        return Ok(());
    }
    fs::create_dir_all(folder).map_err(|source| ExportError::CreateFolder {
        path: folder.to_path_buf(),
        source,
    })
}
