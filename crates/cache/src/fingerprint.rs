//! Determines the fingerprint of the program that computes.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufWriter, Write};
use std::sync::OnceLock;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::Serialize;

/// Hash of the file of the program.
///
/// # Errors
/// The file cannot be read.
pub fn executable_hash() -> io::Result<[u8; 32]> {
    static HASH: OnceLock<[u8; 32]> = OnceLock::new();
    if let Some(hash) = HASH.get() {
        return Ok(*hash);
    }
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(executable()?)?;
    Ok(*HASH.get_or_init(|| *hasher.finalize().as_bytes()))
}

/// Fingerprint of everything in the program that affects the last bit of its results: a hash of the
/// executable, of the loaded libraries, and of what selects their kernels, which are the processor
/// and the settings of numerical libraries in the environment. `None` if the executable cannot be
/// read.
pub fn fingerprint() -> Option<[u8; 32]> {
    static FINGERPRINT: OnceLock<Option<[u8; 32]>> = OnceLock::new();
    *FINGERPRINT.get_or_init(|| {
        let program = executable_hash().ok()?;
        hash_of(&(program, libraries(), processor(), settings()))
    })
}

/// Hash of a value as it is serialised: numbers count to the bit. `None` for a path that is not
/// Unicode, which cannot be serialised.
pub(crate) fn hash_of(value: &impl Serialize) -> Option<[u8; 32]> {
    let mut hasher = blake3::Hasher::new();
    // One buffer: small numbers do not go to the hasher byte by byte.
    let buffered = BufWriter::with_capacity(1 << 16, &mut hasher);
    postcard::to_io(value, buffered).ok()?.flush().ok()?;
    Some(*hasher.finalize().as_bytes())
}

/// Key of the program in hashes of its inputs: its fingerprint or, if the executable
/// cannot be read, a key of this process, which no result of another process has.
pub fn key() -> [u8; 32] {
    static KEY: OnceLock<[u8; 32]> = OnceLock::new();
    *KEY.get_or_init(|| key_of(fingerprint()))
}

fn key_of(fingerprint: Option<[u8; 32]>) -> [u8; 32] {
    fingerprint.unwrap_or_else(|| {
        let time = SystemTime::now().duration_since(UNIX_EPOCH);
        let (process, random) = (std::process::id(), RandomState::new().hash_one(0));
        let identity = [
            process.into(),
            time.unwrap_or_default().as_nanos(),
            random.into(),
        ];
        *blake3::hash(identity.map(u128::to_le_bytes).as_flattened()).as_bytes()
    })
}

fn executable() -> io::Result<File> {
    // What runs, even if its file has been replaced since it was started.
    File::open("/proc/self/exe").or_else(|_| File::open(std::env::current_exe()?))
}

/// Path, size and time since 1970 of a shared library.
type Library = (String, Option<u64>, Option<Duration>);

/// Shared libraries, in the order of their paths; empty if the system does not provide them.
fn libraries() -> Vec<Library> {
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let paths = maps
        .lines()
        .filter_map(|line| line.find('/').map(|at| &line[at..]));
    let mut paths: Vec<&str> = paths.filter(|path| path.contains(".so")).collect();
    paths.sort_unstable();
    paths.dedup();
    let about = |path: &str| {
        let about = fs::metadata(path).ok();
        let size = about.as_ref().map(fs::Metadata::len);
        let modified = about.and_then(|about| about.modified().ok());
        let since = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        (path.to_owned(), size, since)
    };
    paths.into_iter().map(about).collect()
}

/// Environment variables for the threads and kernels of numerical libraries.
fn settings() -> BTreeMap<OsString, OsString> {
    let prefixes = ["OPENBLAS_", "GOTO_", "OMP_", "MKL_", "BLIS_"];
    let tells = |name: &OsString| {
        let name = name.to_string_lossy();
        prefixes.iter().any(|prefix| name.starts_with(prefix))
    };
    std::env::vars_os()
        .filter(|(name, _)| tells(name))
        .collect()
}

/// Model and features of the first processor.
fn processor() -> String {
    let cpuinfo = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let first = cpuinfo.split("\n\n").next().unwrap_or_default();
    let telling = ["vendor_id", "cpu family", "model", "flags", "Features"];
    let lines = first
        .lines()
        .filter(|l| telling.iter().any(|t| l.starts_with(t)));
    lines.collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_solver::description::Scene;
    use dovetail_solver::run::{Error, Options, Run, Session, Source, solve};

    #[test]
    fn the_program_is_known_by_its_libraries_and_its_processor() {
        // Linkers leave out a library that nothing in the binary uses.
        type Whole = fn(&Scene, Source, Options, &Session<'_>) -> Result<Run, Error>;
        let whole: Whole = solve;
        std::hint::black_box(whole);
        let found = libraries();
        if cfg!(target_os = "linux") {
            let is_it = |library: &Library| library.0.contains("libarpack");
            assert!(found.iter().any(is_it), "{found:?}");
            assert!(found.is_sorted() && !processor().is_empty());
        }
        assert!(fingerprint().is_some());
    }

    #[test]
    fn a_program_that_cannot_read_itself_has_a_key_that_no_other_has() {
        assert_eq!(key_of(Some([7; 32])), [7; 32]);
        assert_ne!(key_of(None), key_of(None));
        assert_eq!(Some(key()), fingerprint());
    }
}
