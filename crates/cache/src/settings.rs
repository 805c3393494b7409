//! Settings of the cache: its folder, and how large it may become.

use std::path::{Path, PathBuf};

/// Folder of the entries, and their size limit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CacheSettings {
    /// Folder in which the cache has its own.
    pub folder: PathBuf,
    /// Largest total size of the entries, bytes; above it the least recently used entries are
    /// removed.
    pub limit_bytes: u64,
}

/// Environment variable with the folder of the cache.
const FOLDER: &str = "DOVETAIL_CACHE";
/// Environment variable with the size limit of the cache, GiB.
const LIMIT: &str = "DOVETAIL_CACHE_LIMIT_GIB";
const DEFAULT_LIMIT_GIB: f64 = 4.0;

/// Environment variable whose value is invalid.
#[derive(Debug, thiserror::Error)]
#[error("the environment variable {variable}: {problem}")]
pub struct EnvironmentError {
    variable: &'static str,
    problem: String,
}

impl CacheSettings {
    /// Settings of a folder and a limit in GiB. Where one is not given it is that of the
    /// environment, or else the default: `output/.cache`, and 4 GiB.
    ///
    /// # Errors
    /// A limit of the environment that is no size.
    pub fn chosen(
        folder: Option<PathBuf>,
        limit_gib: Option<f64>,
    ) -> Result<Self, EnvironmentError> {
        let given = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        let limit_gib = match (limit_gib, given(LIMIT)) {
            (Some(limit), _) => limit,
            (None, Some(text)) => {
                let variable = LIMIT;
                gibibytes(&text.to_string_lossy())
                    .map_err(|problem| EnvironmentError { variable, problem })?
            }
            (None, None) => DEFAULT_LIMIT_GIB,
        };
        let folder = folder.or(given(FOLDER).map(PathBuf::from));
        Ok(Self {
            folder: folder.unwrap_or_else(|| Path::new("output").join(".cache")),
            limit_bytes: (limit_gib * (1u64 << 30) as f64) as u64,
        })
    }
}

/// Size in GiB.
///
/// # Errors
/// A text that is no number of GiB from 0 to 1e6.
pub fn gibibytes(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(gib) if (0.0..=1e6).contains(&gib) => Ok(gib),
        _ => Err(format!("`{text}` is not a number of GiB from 0 to 1e6")),
    }
}
