//! The quantities a study follows, and where summary.json of a case has them.

use serde_json::Value;

/// One figure of a run; `normal_force_n` is one figure per contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// In study files and as heading of a column (after the name of the contact, if there is one).
    pub word: &'static str,
    /// JSON pointer into summary.json.
    place: &'static str,
    /// A whole number, which follows no power of a size.
    pub is_count: bool,
}

const fn number(word: &'static str, place: &'static str) -> Quantity {
    Quantity {
        word,
        place,
        is_count: false,
    }
}

const fn count(word: &'static str, place: &'static str) -> Quantity {
    Quantity {
        word,
        place,
        is_count: true,
    }
}

/// First mode of a body with its flanks held, which a run computes only if it is asked to.
pub const BLADE_FREQUENCY: Quantity = number("blade_frequency_hz", "/blade_frequency_hz");
pub const PEAK_AMPLITUDE: Quantity = number("peak_amplitude_m", "/response/peak_amplitude_m");
const NORMAL_FORCE: Quantity = number("normal_force_n", "/static/contacts");

/// In the order of the columns of table.csv.
pub const ALL: [Quantity; 14] = [
    number("stuck_frequency_hz", "/stuck_frequency_hz"),
    BLADE_FREQUENCY,
    PEAK_AMPLITUDE,
    number("peak_frequency_hz", "/response/peak_frequency_hz"),
    number("peak_ratio", "/response/peak_ratio"),
    number("static_pressure_pa", "/static/largest_pressure_pa"),
    NORMAL_FORCE,
    number("static_slip_m", "/static/largest_slip_m"),
    number("peak_friction_power_w", "/response/peak_friction_power_w"),
    number("peak_damping_power_w", "/response/peak_damping_power_w"),
    count("opening_pairs", "/response/pairs_that_open"),
    number("opening_area_share", "/response/area_share_that_opens"),
    count("peak_opening_pairs", "/response/peak_opening_pairs"),
    count("peak_slipping_pairs", "/response/peak_slipping_pairs"),
];

pub const WORDS: [&str; ALL.len()] = {
    let mut words = [""; ALL.len()];
    let mut i = 0;
    while i < ALL.len() {
        words[i] = ALL[i].word;
        i += 1;
    }
    words
};

impl Quantity {
    /// Heading and value of each of its figures in a summary; what the run does not have is left
    /// out.
    pub fn figures(self, summary: &Value) -> Vec<(String, f64)> {
        let figure = |heading: String, value: Option<&Value>| {
            Some((heading, value?.as_f64().filter(|v| v.is_finite())?))
        };
        match summary.pointer(self.place) {
            Some(Value::Array(contacts)) => contacts
                .iter()
                .filter_map(|contact| {
                    let name = contact.get("name")?.as_str()?;
                    figure(format!("{name}_{}", self.word), contact.get(self.word))
                })
                .collect(),
            value => figure(self.word.to_owned(), value).into_iter().collect(),
        }
    }

    /// Whether a heading is that of one of its figures.
    pub fn has_heading(self, heading: &str) -> bool {
        let suffix = heading.strip_suffix(self.word);
        suffix == Some("") || (self == NORMAL_FORCE && suffix.is_some_and(|s| s.ends_with('_')))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_lead_back_to_their_quantity() {
        for quantity in ALL {
            let own = ALL.iter().filter(|q| q.has_heading(quantity.word));
            assert_eq!(own.collect::<Vec<_>>(), [&quantity]);
        }
        assert!(NORMAL_FORCE.has_heading("left_normal_force_n"));
        assert!(!ALL.iter().any(|q| q.has_heading("harmonics")));
    }

    #[test]
    fn figures_are_read_and_what_is_missing_is_left_out() {
        let summary = serde_json::json!({
            "stuck_frequency_hz": 450.5, "blade_frequency_hz": null,
            "static": { "contacts": [
                { "name": "left", "normal_force_n": 10.0 }, { "name": "right", "normal_force_n": null }] },
            "response": null
        });
        let figures: Vec<_> = ALL.iter().flat_map(|q| q.figures(&summary)).collect();
        let expected = [("stuck_frequency_hz", 450.5), ("left_normal_force_n", 10.0)];
        assert_eq!(figures, expected.map(|(h, v)| (h.to_owned(), v)));
    }
}
