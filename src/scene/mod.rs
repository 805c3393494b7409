//! Reads a scene from TOML. A [`Scene`] has everything that one run depends on, checked (positive
//! moduli, known options, ordered ranges) and in SI units. [`dovetail_solver::model`] checks the
//! names of mesh groups later, when the mesh is known.
//!
//! A key goes through three places. `raw.rs` mirrors the file: `document.rs` sets what `--set` asks
//! for (`overrides.rs`) and reads the text into it. `entries.rs` declares the key: meaning, type,
//! unit, limits, default, example. `check` holds the value against that entry and against other
//! keys, and puts it into the [`Scene`].
//!
//! Messages, the tables of docs/scene.md ([`crate::reference`]) and the JSON schema
//! ([`crate::schema`]) are made from the entries: what a key means is said there alone.
//! [`crate::study`] reads its files by the same code, with entries of its own.

pub(crate) mod check;
pub(crate) mod document;
pub(crate) mod entries;
pub(crate) mod error;
pub(crate) mod keys;
pub(crate) mod kinds;
pub(crate) mod located;
mod overrides;
mod place;
pub(crate) mod raw;
pub(crate) mod source;

use std::path::Path;

use dovetail_solver::description::Scene;
use dovetail_superelement::input;
use serde::Deserialize;
use serde_spanned::Spanned;
use toml::de::{DeValue, ValueDeserializer};

pub use error::{SceneError, SceneFault, SceneProblem};
pub use keys::nearest;

/// Reads and checks the scene file `path`. Relative paths in it are joined to its folder;
/// `overrides` are `KEY=VALUE` texts as for [`parse`].
///
/// # Errors
/// [`SceneError::Read`] when the file cannot be read, [`SceneError::Invalid`] as for [`parse`].
pub fn load(path: &Path, overrides: &[String]) -> Result<Scene, SceneError> {
    let text = input::text(path).map_err(|source| SceneError::Read {
        path: path.to_owned(),
        source,
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse(&text, &path.display().to_string(), folder, overrides)
}

/// Parses and checks the text of a scene. `file_name` is for messages only; relative paths of the
/// scene are joined to `base_dir`. Each of `overrides` is `KEY=VALUE`. KEY is a dotted path
/// (`response.points`, `contact.left.friction`, `contact.0.friction`, `contact.*.friction`). VALUE
/// is a TOML value or else a text; with nothing after `=` the key is removed. If keys exclude each
/// other (a mesh file and a geometry, the two frequency ranges, the two ways to give damping), the
/// key that is set replaces that of the file.
///
/// # Errors
/// [`SceneError::Invalid`] with every problem found: first those of syntax alone, then unknown keys
/// and wrong types, then missing, impossible and contradictory values.
pub fn parse(
    text: &str,
    file_name: &str,
    base_dir: &Path,
    overrides: &[String],
) -> Result<Scene, SceneError> {
    let source = source_of(text, file_name, overrides);
    document::read(&source)
        .and_then(|raw| check::scene(&source, base_dir, raw))
        .map_err(|problems| SceneError::Invalid { problems })
}

/// Values that the text of a scene and its `overrides` set at `key`, a dotted path as for
/// [`parse`]: none where nothing is set there, and several where the path has a `*`. An empty key
/// gives the whole scene. Values are not checked.
///
/// # Errors
/// [`SceneError::Invalid`] for a text that is not TOML, and for a path through a list or a value
/// that has no such element.
pub fn values(
    text: &str,
    file_name: &str,
    overrides: &[String],
    key: &str,
) -> Result<Vec<toml::Value>, SceneError> {
    let source = source_of(text, file_name, overrides);
    let invalid = |problems| SceneError::Invalid { problems };
    let (root, _) = document::table(&source).map_err(invalid)?;
    let root = Spanned::new(0..0, DeValue::Table(root));
    let values = match (key, root.get_ref()) {
        ("", whole) => vec![whole],
        (key, DeValue::Table(root)) => {
            overrides::values_at(&source, root, key).map_err(|problem| invalid(vec![*problem]))?
        }
        _ => Vec::new(),
    };
    let owned = |value: &DeValue<'_>| {
        let value = Spanned::new(0..0, value.clone());
        toml::Value::deserialize(ValueDeserializer::from(value)).ok()
    };
    Ok(values.into_iter().filter_map(owned).collect())
}

fn source_of<'i>(
    text: &str,
    file_name: &'i str,
    overrides: &'i [String],
) -> source::SourceTexts<'i> {
    source::SourceTexts {
        name: file_name,
        text: text.into(),
        overrides,
        vocabulary: &entries::SCENE,
    }
}
