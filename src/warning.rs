//! Defines what a run tells its user to mind.

/// Something to mind about a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// How much it weighs.
    pub weight: Weight,
    /// What is so, and what to do about it.
    pub text: String,
}

/// How much a warning weighs, the weightiest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Weight {
    /// A result is missing, or is not of what was meant.
    Wrong,
    /// A figure may be off.
    Doubt,
    /// The results are as asked for.
    Remark,
}

/// Their texts, the weightiest first, each once; of the same weight in their order.
pub fn by_weight(warnings: &[Warning]) -> Vec<&str> {
    let mut sorted: Vec<&Warning> = warnings.iter().collect();
    sorted.sort_by_key(|warning| warning.weight);
    let mut texts: Vec<&str> = Vec::new();
    for warning in sorted {
        if !texts.contains(&warning.text.as_str()) {
            texts.push(&warning.text);
        }
    }
    texts
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
        assert_eq!(by_weight(&told), ["missing", "off", "rough", "kept"]);
    }
}
