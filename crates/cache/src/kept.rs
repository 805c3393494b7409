//! Kinds of entries: each with the type of its content, in functions that are not generic.

use serde::{Deserialize, Serialize};

use crate::folder::EntryKind;
use crate::{Cache, EntryClaim, EntryKey, Log};
use dovetail_solver::run::{self, ReductionInputs, StoreEntry, StoreSlot};

/// Mesh that gmsh made in an earlier run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptMesh {
    /// Version of gmsh.
    pub version: String,
    /// Warnings of gmsh.
    pub warnings: Vec<String>,
    /// Bytes of the file.
    pub file: Vec<u8>,
}

/// Meshes. `inputs` are small: the package that names their type compiles how they are hashed.
impl Cache {
    /// Key of the mesh that is made of `inputs`; `None` if nothing is kept.
    pub fn mesh_key(&self, inputs: &impl Serialize) -> Option<EntryKey> {
        self.key(EntryKind::Mesh, inputs)
    }

    /// Passes the mesh of an earlier run to `accept`, also if another run has just made it. A mesh
    /// that is not accepted is removed.
    ///
    /// # Errors
    /// Without a mesh that is accepted: the right to make it until it is dropped, if there is such a
    /// right.
    pub fn mesh(
        &self,
        key: Option<&EntryKey>,
        accept: &mut dyn FnMut(KeptMesh) -> Result<(), String>,
        log: &dyn Log,
    ) -> Result<(), Option<EntryClaim>> {
        self.get_or_turn(key, accept, log)
    }

    /// Keeps a mesh.
    pub fn keep_mesh(&self, key: &EntryKey, mesh: &KeptMesh, log: &dyn Log) {
        self.store_entry(Some(key), mesh, log);
    }
}

/// Reductions, and what belongs to the model of one, under the key of its inputs.
impl Cache {
    /// Key of a reduction; `None` if nothing is kept.
    pub fn reduction_key(&self, inputs: &ReductionInputs) -> Option<run::ReductionKey> {
        self.key(EntryKind::ReducedModel, inputs)
            .map(|key| key.hash)
    }

    /// Fills a place with the entry of an earlier run under the key of a reduction. The place stays
    /// empty without such an entry. A reduction counts also if another run has just made it; without
    /// one returns the right to make it until it is dropped, if there is such a right.
    pub fn load(
        &self,
        key: &run::ReductionKey,
        place: StoreSlot<'_>,
        log: &dyn Log,
    ) -> Option<EntryClaim> {
        match place {
            StoreSlot::Reduction(place) => {
                let key = self.key(EntryKind::ReducedModel, key);
                match self.get_or_turn(key.as_ref(), Ok, log) {
                    Ok(found) => *place = Some(found),
                    Err(turn) => return turn,
                }
            }
            StoreSlot::Recovery(place) => {
                *place = self.get(self.key(EntryKind::Recovery, key).as_ref(), Ok, log);
            }
            StoreSlot::HeldModes(place) => {
                *place = self.get(self.key(EntryKind::HeldModes, key).as_ref(), Ok, log);
            }
        }
        None
    }

    /// Keeps an entry under the key of a reduction.
    pub fn keep(&self, key: &run::ReductionKey, entry: StoreEntry<'_>, log: &dyn Log) {
        match entry {
            StoreEntry::Reduction(reduction, recovery) => {
                let model_key = self.key(EntryKind::ReducedModel, key);
                self.store_entry(model_key.as_ref(), reduction, log);
                self.keep(key, StoreEntry::Recovery(recovery), log);
            }
            StoreEntry::Recovery(recovery) => {
                self.store_entry(self.key(EntryKind::Recovery, key).as_ref(), recovery, log);
            }
            StoreEntry::HeldModes(modes) => {
                self.store_entry(self.key(EntryKind::HeldModes, key).as_ref(), &modes, log);
            }
        }
    }
}
