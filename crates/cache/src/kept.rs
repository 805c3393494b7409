//! Kinds of entries: each with the type of its content, in functions that are not generic.

use serde::{Deserialize, Serialize};

use crate::folder::Kind;
use crate::{Cache, Key, Log, Turn};
use dovetail_solver::reduction::Recovery;
use dovetail_solver::results::modes::Modes;
use dovetail_solver::run::{self, KeptReduction, ReductionInputs};

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
    pub fn mesh_key(&self, inputs: &impl Serialize) -> Option<Key> {
        self.key(Kind::Mesh, inputs)
    }

    /// Passes the mesh of an earlier run to `accept`, also if another run has just made it. A mesh
    /// that is not accepted is removed.
    ///
    /// # Errors
    /// Without a mesh that is accepted: the right to make it until it is dropped, if there is such a
    /// right.
    pub fn mesh(
        &self,
        key: Option<&Key>,
        accept: &mut dyn FnMut(KeptMesh) -> Result<(), String>,
        log: &dyn Log,
    ) -> Result<(), Option<Turn>> {
        self.get_or_turn(key, accept, log)
    }

    /// Keeps a mesh.
    pub fn keep_mesh(&self, key: &Key, mesh: &KeptMesh, log: &dyn Log) {
        self.put(Some(key), mesh, log);
    }
}

/// Reductions, and what belongs to the model of one, under the key of its inputs.
impl Cache {
    /// Key of a reduction; `None` if nothing is kept.
    pub fn reduction_key(&self, inputs: &ReductionInputs) -> Option<run::Key> {
        self.key(Kind::ReducedModel, inputs).map(|key| key.hash)
    }

    /// Reduction of an earlier run, also if another run has just made it.
    ///
    /// # Errors
    /// Without a reduction: the right to make it until it is dropped, if there is such a right.
    pub fn reduction(&self, key: &run::Key, log: &dyn Log) -> Result<KeptReduction, Option<Turn>> {
        let key = self.key(Kind::ReducedModel, key);
        self.get_or_turn(key.as_ref(), Ok, log)
    }

    /// Keeps a reduction.
    pub fn keep_reduction(&self, key: &run::Key, reduction: &KeptReduction, log: &dyn Log) {
        let key = self.key(Kind::ReducedModel, key);
        self.put(key.as_ref(), reduction, log);
    }

    /// Recovery of a reduction of an earlier run.
    pub fn recovery(&self, key: &run::Key, log: &dyn Log) -> Option<Recovery> {
        let key = self.key(Kind::Recovery, key);
        self.get(key.as_ref(), Ok, log)
    }

    /// Keeps the recovery of a reduction.
    pub fn keep_recovery(&self, key: &run::Key, recovery: &Recovery, log: &dyn Log) {
        let key = self.key(Kind::Recovery, key);
        self.put(key.as_ref(), recovery, log);
    }

    /// Modes of each body with its contacts held, of an earlier run.
    pub fn held_modes(&self, key: &run::Key, log: &dyn Log) -> Option<Vec<Modes>> {
        let key = self.key(Kind::HeldModes, key);
        self.get(key.as_ref(), Ok, log)
    }

    /// Keeps the modes of each body with its contacts held.
    pub fn keep_held_modes(&self, key: &run::Key, modes: &[Modes], log: &dyn Log) {
        let key = self.key(Kind::HeldModes, key);
        self.put(key.as_ref(), &modes, log);
    }
}
