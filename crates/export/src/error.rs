//! Errors of writing results.

use std::path::PathBuf;

/// Every variant names the file and what to do.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
pub enum ExportError {
    #[error(
        "cannot create the folder {}: {source}. Choose another output folder with --out, or make this one writable",
        path.display()
    )]
    CreateFolder {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "cannot write {}: {source}. Check the free space and the permissions of its folder, or choose another output folder with --out",
        path.display()
    )]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "cannot read {}: {source}. Make it readable, or remove it and run its scene again",
        path.display()
    )]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "the folder {} holds a run of the scene \"{other}\", and this is a run of \"{scene}\". Choose another folder with --out, or replace the files of that run with --force",
        path.display()
    )]
    OtherScene {
        path: PathBuf,
        scene: String,
        /// Name of the scene whose run is in the folder.
        other: String,
    },
    #[error(
        "the folder {} holds a run of this scene with other settings, with other files, or by another version of dovetail, whose figures these files would not belong to. Choose another folder with --out, or replace the files of that run with --force",
        path.display()
    )]
    OtherSettings { path: PathBuf },
    #[error(
        "a run is going on in the folder {}. Wait for its end, or choose another output folder with --out",
        folder.display()
    )]
    Busy { folder: PathBuf },
    #[error(
        "cannot lock the folder {}: {source}. Check the permissions and the free space of the folder and of {} in it, or choose another output folder with --out",
        folder.display(),
        super::lock::LOCK
    )]
    Lock {
        folder: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "the journal {}: {source}. Check the free space and the permissions of its folder, choose another output folder with --out, or remove it by hand",
        path.display()
    )]
    Journal {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "--resume: the frequencies in {} were computed from other inputs, or by another build of the program. Run without --resume to begin with the first frequency, or take back what was changed",
        path.display()
    )]
    OtherInputs { path: PathBuf },
    #[error(
        "--resume: the program cannot read the file that it was started from, and cannot check whether the results in {} belong to it. Make that file readable, or run without --resume to begin anew",
        path.display()
    )]
    UnknownProgram { path: PathBuf },
    #[error(
        "cannot remove {}, a file of an earlier run: {source}. Remove it by hand, or choose another output folder with --out",
        path.display()
    )]
    RemoveOld {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "cannot encode {} as VTK: {source}. Its arrays are too large or malformed; the CSV files hold the values per pair",
        path.display()
    )]
    EncodeVtk { path: PathBuf, source: vtkio::Error },
    #[error(
        "cannot encode {} as JSON: {source}. The CSV files hold the same results",
        path.display()
    )]
    EncodeJson {
        path: PathBuf,
        source: serde_json::Error,
    },
    #[error(
        "{} was not written: '{field}' has {found} values where {expected} are needed ({needed_for}). The stage that computes '{field}' and the model do not match: pass both from the same run",
        path.display()
    )]
    FieldLength {
        path: PathBuf,
        field: String,
        found: usize,
        expected: usize,
        /// Quantity that the expected number counts.
        needed_for: &'static str,
    },
    #[error(
        "{} was not written: '{field}' is not finite at entry {index}. Check the material, the loads and the mesh near that entry",
        path.display()
    )]
    NotFinite {
        path: PathBuf,
        field: String,
        index: usize,
    },
}
