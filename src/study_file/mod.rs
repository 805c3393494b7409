//! Study files: a scene, parameters with their values, and the quantities that are compared.
//!
//! Every key of a study file is in `keys`. A new quantity is a line in `quantity`, which says where
//! summary.json has it.

mod error;
mod file;
pub(crate) mod keys;
pub(crate) mod parameter;
pub(crate) mod quantity;

pub use self::error::StudyError;
pub use self::file::Study;
