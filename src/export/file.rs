//! The one place where bytes reach the disk.

use std::fs;
use std::path::Path;

use super::ExportError;

/// Writes a whole file or nothing: the bytes go to a neighbour with the ending `.part`, which then
/// takes the name. Missing folders are created.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    if let Some(folder) = path.parent() {
        create_folder(folder)?;
    }
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = Path::new(&part);
    let failed = |source| ExportError::Write {
        path: path.to_path_buf(),
        source,
    };
    fs::write(part, bytes)
        .and_then(|()| fs::rename(part, path))
        .map_err(|source| {
            // What is left of the attempt is of no use; the first failure is the one to report.
            let _ = fs::remove_file(part);
            failed(source)
        })
}

/// Removes `<folder>/<stem>_<digits>.vtu` of an earlier run, so that a shorter series leaves no
/// files behind that look as if they belonged to it.
pub(super) fn remove_old_series(folder: &Path, stem: &str) -> Result<(), ExportError> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Ok(());
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let number = name.to_str().and_then(|n| {
            n.strip_prefix(stem)?
                .strip_prefix('_')?
                .strip_suffix(".vtu")
        });
        if number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit())) {
            let path = entry.path();
            fs::remove_file(&path).map_err(|source| ExportError::RemoveOld { path, source })?;
        }
    }
    Ok(())
}

/// Creates a folder with those it lies in, where they are missing.
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
