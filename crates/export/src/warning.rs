//! Warnings of a run for its user.

use serde::{Deserialize, Serialize};

/// Reason for which a curve is given up.
pub const CREEPS: &str = "hundreds of its steps lead through hardly any of the range";

/// Estimated error of an amplitude above which a run warns of it.
pub const LARGE_ERROR: f64 = 0.02;
/// Estimated mesh error of a stress, relative to the stress, above which a run warns of it.
pub const LARGE_STRESS_ERROR: f64 = 0.1;

/// Warning about a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warning {
    /// Importance of the warning.
    pub weight: Weight,
    /// The condition, and the remedy.
    pub text: String,
}

/// Importance of a warning, the highest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// A result is missing, or is not what was intended.
    Wrong,
    /// A figure may be inaccurate.
    Doubt,
    /// The results are as requested.
    Remark,
}

/// Warning that a result is missing, or is not what was intended.
pub fn wrong(text: String) -> Warning {
    let weight = Weight::Wrong;
    Warning { weight, text }
}

/// Warning that a figure may be inaccurate.
pub fn accuracy_warning(text: String) -> Warning {
    let weight = Weight::Doubt;
    Warning { weight, text }
}

/// Remark about results that are as requested.
pub fn remark(text: String) -> Warning {
    let weight = Weight::Remark;
    Warning { weight, text }
}

/// Warnings sorted by importance, each text once; those of the same weight keep their order.
pub fn sorted_by_weight(warnings: &[Warning]) -> Vec<&Warning> {
    let mut sorted: Vec<&Warning> = warnings.iter().collect();
    sorted.sort_by_key(|warning| warning.weight);
    let mut distinct: Vec<&Warning> = Vec::new();
    for warning in sorted {
        if !distinct.iter().any(|known| known.text == warning.text) {
            distinct.push(warning);
        }
    }
    distinct
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weightiest_comes_first_and_nothing_twice() {
        let warning = |weight, text: &str| Warning {
            weight,
            text: text.to_owned(),
        };
        let told = [
            warning(Weight::Remark, "kept"),
            warning(Weight::Doubt, "off"),
            warning(Weight::Wrong, "missing"),
            warning(Weight::Doubt, "rough"),
            warning(Weight::Doubt, "off"),
        ];
        let texts: Vec<&str> = sorted_by_weight(&told)
            .iter()
            .map(|w| w.text.as_str())
            .collect();
        assert_eq!(texts, ["missing", "off", "rough", "kept"]);
    }
}
