//! Defines what a run tells its user to mind.

use serde::{Deserialize, Serialize};

/// Something to mind about a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// How much it weighs.
    pub weight: Weight,
    /// What is so, and what to do about it.
    pub text: String,
}

/// How much a warning weighs, the weightiest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// A result is missing, or is not of what was meant.
    Wrong,
    /// A figure may be off.
    Doubt,
    /// The results are as asked for.
    Remark,
}

/// The weightiest first, each text once; of the same weight in their order.
pub fn by_weight(warnings: &[Warning]) -> Vec<&Warning> {
    let mut sorted: Vec<&Warning> = warnings.iter().collect();
    sorted.sort_by_key(|warning| warning.weight);
    let mut found: Vec<&Warning> = Vec::new();
    for warning in sorted {
        if !found.iter().any(|known| known.text == warning.text) {
            found.push(warning);
        }
    }
    found
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
        let texts: Vec<&str> = by_weight(&told).iter().map(|w| w.text.as_str()).collect();
        assert_eq!(texts, ["missing", "off", "rough", "kept"]);
    }
}
