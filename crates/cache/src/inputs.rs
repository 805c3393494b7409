//! Hashes of serialised inputs: the keys under which a journal keeps motions, and the hash of a scene.

use crate::fingerprint::{hash_of, key};
use dovetail_export::journal::Inputs;
use dovetail_solver::description::Scene;
use dovetail_solver::run::RecordInputs;

/// Hash of all inputs of motions that a journal keeps, including the program.
pub fn records_hash(inputs: &RecordInputs<'_>) -> Option<Inputs> {
    hash_of(&(key(), inputs))
}

/// Hash of a scene and of the contents of the files that it names; `None` if a path is not Unicode.
pub fn scene_hash(scene: &Scene, contents: &[String]) -> Option<[u8; 32]> {
    hash_of(&(scene, contents))
}
