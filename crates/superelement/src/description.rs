//! The files of the folder, and what `model.json` says.

use std::io::Read as _;
use std::path::Path;

use serde::{Deserialize, Serialize};

use dovetail_dynamics::excitation::NamedExcitation;
use dovetail_dynamics::reduced::ObservedQuantity;
use dovetail_dynamics::superelement::NamedContact;

use crate::{SuperelementError, input};

/// Contents of `model.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Description {
    /// [`FORMAT`].
    pub(crate) format: String,
    /// Hash of the numbers of all files, as in their comments.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) model: Option<String>,
    pub(crate) units: FolderUnits,
    pub(crate) pairs: usize,
    pub(crate) modes: usize,
    pub(crate) contacts: Vec<NamedContact>,
    pub(crate) excitations: Vec<NamedExcitation>,
    pub(crate) observed_points: Vec<String>,
    /// Those of the observed points that are strains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) observed_strains: Vec<String>,
    /// Coefficients of the dashpots.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) dashpots_n_s_m: Vec<f64>,
}

/// Units of all numbers of a folder, which are those of the SI.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FolderUnits {
    length: String,
    mass: String,
    time: String,
    force: String,
}

impl FolderUnits {
    pub(crate) fn si() -> Self {
        let [length, mass, time, force] = ["m", "kg", "s", "N"].map(str::to_owned);
        Self {
            length,
            mass,
            time,
            force,
        }
    }
}

/// Beginning of `model.json`.
pub(crate) const FORMAT: &str = "reduced model of dovetail";

/// Names of the files of a folder. Not every model has all; no other name is read or written.
pub const FILES: [&str; 15] = [
    STIFFNESS,
    MASS,
    COUPLING,
    SQUARED_FREQUENCIES,
    STATIC_LOAD,
    STATIC_LOAD_ON_MODES,
    EXCITATIONS,
    EXCITATIONS_ON_MODES,
    OBSERVED_POINTS,
    OBSERVED_POINTS_ON_MODES,
    DASHPOTS,
    DASHPOTS_ON_MODES,
    AREAS,
    POSITIONS,
    DESCRIPTION,
];

pub(crate) const STIFFNESS: &str = "stiffness.mtx";
pub(crate) const MASS: &str = "mass.mtx";
pub(crate) const COUPLING: &str = "coupling.mtx";
pub(crate) const SQUARED_FREQUENCIES: &str = "squared_frequencies.mtx";
pub(crate) const STATIC_LOAD: &str = "static_load.mtx";
pub(crate) const STATIC_LOAD_ON_MODES: &str = "static_load_on_modes.mtx";
pub(crate) const EXCITATIONS: &str = "excitations.mtx";
pub(crate) const EXCITATIONS_ON_MODES: &str = "excitations_on_modes.mtx";
pub(crate) const OBSERVED_POINTS: &str = "observed_points.mtx";
pub(crate) const OBSERVED_POINTS_ON_MODES: &str = "observed_points_on_modes.mtx";
pub(crate) const DASHPOTS: &str = "dashpots.mtx";
pub(crate) const DASHPOTS_ON_MODES: &str = "dashpots_on_modes.mtx";
pub(crate) const AREAS: &str = "areas.mtx";
pub(crate) const POSITIONS: &str = "positions.mtx";

/// Name of the file that is read first and written last: a folder without it contains no model.
pub(crate) const DESCRIPTION: &str = "model.json";

/// Most bytes of the description.
pub(crate) const MOST_OF_DESCRIPTION: u64 = 1 << 24;

/// Beginning of the comment that names the model of a file.
pub(crate) const MODEL: &str = "of the reduced model";

impl Description {
    /// Quantity of an observed point.
    pub(crate) fn quantity(&self, name: &String) -> ObservedQuantity {
        match self.observed_strains.contains(name) {
            true => ObservedQuantity::Strain,
            false => ObservedQuantity::Displacement,
        }
    }
}

/// Reads `model.json`, and checks what it says.
pub(crate) fn description(path: &Path) -> Result<Description, SuperelementError> {
    let wrong = |message: String| SuperelementError::Description {
        path: path.to_owned(),
        message,
    };
    let mut text = String::new();
    let file = input::open(path).map_err(|e| wrong(e.to_string()))?;
    let mut file = file.take(MOST_OF_DESCRIPTION);
    file.read_to_string(&mut text)
        .map_err(|e| wrong(e.to_string()))?;
    let description: Description = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    if description.format != FORMAT {
        let message = format!(
            "format is \"{}\", expected \"{FORMAT}\"",
            description.format
        );
        return Err(wrong(message));
    }
    if description.units != FolderUnits::si() {
        let message = "units are other than m, kg, s and N: convert all numbers to these";
        return Err(wrong(message.to_owned()));
    }
    if description.pairs == 0 {
        let path = path.to_owned();
        return Err(SuperelementError::NoPairs { path });
    }
    let of_contacts = description.contacts.iter().map(|contact| contact.pairs);
    let of_contacts = of_contacts.fold(0, usize::saturating_add);
    if of_contacts != description.pairs {
        let message = format!(
            "the contacts have {of_contacts} pairs in all, and `pairs` is {}: they must agree",
            description.pairs
        );
        return Err(wrong(message));
    }
    let mut dashpots = description.dashpots_n_s_m.iter();
    if let Some(wrong_one) = dashpots.find(|c| !(c.is_finite() && **c >= 0.0)) {
        let message = format!("dashpots_n_s_m has {wrong_one}: all must be 0 or more and finite");
        return Err(wrong(message));
    }
    let first = description.observed_points.first();
    for name in &description.observed_strains {
        let message = if first == Some(name) {
            format!(
                "the first of observed_points, \"{name}\", is one of observed_strains: put a \
                 displacement first, whose peak is that of a run"
            )
        } else if !description.observed_points.contains(name) {
            format!("observed_strains has \"{name}\", which is none of observed_points")
        } else {
            continue;
        };
        return Err(wrong(message));
    }
    for excitation in &description.excitations {
        let is_finite = excitation.amplitude.is_finite() && excitation.phase_rad.is_finite();
        if excitation.harmonic == 0 || !is_finite {
            let message = format!(
                "excitation \"{}\": the harmonic must be 1 or more, amplitude and phase finite",
                excitation.name
            );
            return Err(wrong(message));
        }
    }
    Ok(description)
}
