//! Checks `[mesh]`: a ready file, or a script with its parameters.

use std::collections::BTreeMap;
use std::path::Path;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use crate::scene::entries::RawMesh;
use crate::scene::raw::{Located, Number};
use dovetail_mesh::units::Units;
use dovetail_solver::model::{MeshKind, MeshSource};

/// Content of `[mesh]`.
pub struct SharedMesh {
    /// Shared mesh; `None` if every body has a mesh of its own.
    pub source: Option<MeshSource>,
    /// Units of all mesh files without units of their own.
    pub units: Option<Units>,
}

/// Checks `[mesh]`. `needed`: a body has no mesh of its own.
pub fn mesh(
    checker: &mut Checker,
    base_dir: &Path,
    raw: Option<&Spanned<RawMesh>>,
    needed: bool,
) -> Option<SharedMesh> {
    let Some(raw) = raw else {
        // Where it is needed its absence is said by the caller.
        return (!needed).then_some(SharedMesh {
            source: None,
            units: None,
        });
    };
    let at = SceneTable::new("mesh", raw.span(), None);
    let raw = raw.get_ref();
    let has_source = needed || raw.file.is_some() || raw.geometry.is_some();
    let kind = has_source.then(|| mesh_kind(checker, &at, base_dir, raw));
    let units_given = units(checker, &at, &raw.metres_per_unit, &raw.units);
    if has_source && units_given == Some(None) {
        checker.require_one_of(&at, &["units", "metres_per_unit"], "units");
    }
    let units = units_given?;
    let source = match kind {
        None => None,
        Some(kind) => Some(MeshSource {
            kind: kind?,
            units: units?,
        }),
    };
    Some(SharedMesh { source, units })
}

/// Units of a file; `Some(None)` if they are not given.
pub fn units(
    checker: &mut Checker,
    at: &SceneTable,
    metres: &Located<Number>,
    words: &Located<String>,
) -> Option<Option<Units>> {
    match (metres, words) {
        (None, None) => Some(None),
        (Some(metres), Some(words)) => {
            let remedy = "keep `units`, which says what lengths and materials are in, or `metres_per_unit` for \
                          lengths alone";
            let given = ("metres_per_unit", metres.span());
            checker.exclude(at, given, &[("units", Some(words.span()))], remedy)?;
            None
        }
        (None, words) => checker.optional_choice(at, "units", words),
        (metres, None) => {
            let metres = checker.number(at, "metres_per_unit", metres)?;
            Some(Some(Units::MetresPerUnit(metres)))
        }
    }
}

fn mesh_kind(
    checker: &mut Checker,
    at: &SceneTable,
    base_dir: &Path,
    raw: &RawMesh,
) -> Option<MeshKind> {
    let remedy =
        "keep `file` (a ready mesh) or `geometry` with its parameters (a .geo script), not both";
    let of_geometry =
        places!(raw; geometry, parameters, time_limit_s, fallback, fallback_parameters);
    if let Some(file) = &raw.file {
        checker.exclude(at, ("file", file.span()), &of_geometry, remedy)?;
        return Some(MeshKind::File {
            path: base_dir.join(checker.text(at, "file", &raw.file)?),
        });
    }
    if raw.geometry.is_none() {
        checker.require_one_of(at, &["geometry", "file"], "file");
        return None;
    }
    let script = checker.text(at, "geometry", &raw.geometry);
    let time_limit = checker.number(at, "time_limit_s", &raw.time_limit_s);
    let fallback = raw
        .fallback
        .as_ref()
        .map(|_| checker.text(at, "fallback", &raw.fallback));
    let [file, made_with] = ["fallback", "fallback_parameters"];
    match (&raw.fallback, &raw.fallback_parameters) {
        (Some(_), Some(_)) | (None, None) => {}
        (Some(present), None) => {
            let remedy = "say which `parameters` the ready mesh was made with (`{}` for the script's own values), \
                          so that it is not taken for another mesh";
            checker.note_missing_partner(at, file, made_with, present.span(), remedy);
        }
        (None, Some(present)) => {
            let remedy = "name the ready mesh they belong to, or leave them out";
            checker.note_missing_partner(at, made_with, file, present.span(), remedy);
        }
    }
    let fallback = match fallback {
        None => None,
        Some(path) => Some(base_dir.join(path?)),
    };
    Some(MeshKind::Geometry {
        script: base_dir.join(script?),
        parameters: parameters(&raw.parameters),
        time_limit_s: time_limit?,
        fallback,
        fallback_parameters: parameters(&raw.fallback_parameters),
    })
}

/// Parameters in the order of the text.
fn parameters(raw: &Located<BTreeMap<String, Spanned<Number>>>) -> Vec<(String, f64)> {
    let mut entries: Vec<_> = raw.iter().flat_map(|p| p.get_ref().iter()).collect();
    entries.sort_by_key(|(_, value)| value.span().start);
    entries
        .into_iter()
        .map(|(name, value)| (name.clone(), value.get_ref().0))
        .collect()
}
