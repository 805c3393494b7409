//! Reduced model as it is stored: with the names of its contacts and excitations, and with the
//! positions of its pairs.

use serde::{Deserialize, Serialize};

use crate::excitation::NamedExcitation;
use crate::reduced::ReducedModel;

/// Reduced model with the names and positions that its results refer to.
#[derive(Debug, Clone)]
pub struct Superelement {
    /// Matrices, with the unit load of each excitation and the observed points.
    pub model: ReducedModel,
    /// Excitations, in the order of the unit loads.
    pub excitations: Vec<NamedExcitation>,
    /// Contacts, in the order of the pairs.
    pub contacts: Vec<NamedContact>,
    /// Positions of the pairs, m.
    pub positions_m: Vec<[f64; 3]>,
    /// Tributary areas of the pairs, m2, if they are known.
    pub areas_m2: Option<Vec<f64>>,
}

/// Contact: a number of pairs that follow one another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedContact {
    /// Name in the results.
    pub name: String,
    /// Number of pairs.
    pub pairs: usize,
}
