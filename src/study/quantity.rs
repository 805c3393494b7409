//! The quantities that a study follows, and what the summary of a case says of them.

use crate::export::manifest::{ContactSummary, ResponseSummary, StaticSummary, Summary};

/// One figure of a run, or one figure per contact.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    /// In study files and as heading of a column (after the name of the contact, if there is one).
    pub word: &'static str,
    /// A whole number, which follows no power of a size.
    pub is_count: bool,
    of: Of,
}

/// Where a summary has a figure.
#[derive(Debug, Clone, Copy)]
enum Of {
    Run(fn(&Summary) -> Option<f64>),
    Static(fn(&StaticSummary) -> Option<f64>),
    Contact(fn(&ContactSummary) -> Option<f64>),
    Response(fn(&ResponseSummary) -> Option<f64>),
}

impl PartialEq for Quantity {
    fn eq(&self, other: &Self) -> bool {
        self.word == other.word
    }
}

const fn number(word: &'static str, of: Of) -> Quantity {
    Quantity {
        word,
        is_count: false,
        of,
    }
}

const fn count(word: &'static str, of: fn(&ResponseSummary) -> Option<f64>) -> Quantity {
    Quantity {
        word,
        is_count: true,
        of: Of::Response(of),
    }
}

/// First mode of a body with its flanks held, which a run computes only if it is asked to.
pub const BLADE_FREQUENCY: Quantity =
    number("blade_frequency_hz", Of::Run(|s| s.blade_frequency_hz));
pub const PEAK_AMPLITUDE: Quantity =
    number("peak_amplitude_m", Of::Response(|r| r.peak_amplitude_m));
const NORMAL_FORCE: Quantity = number("normal_force_n", Of::Contact(|c| c.normal_force_n));

/// In the order of the columns of table.csv.
pub const ALL: [Quantity; 18] = [
    number("stuck_frequency_hz", Of::Run(|s| s.stuck_frequency_hz)),
    number("linear_frequency_hz", Of::Run(|s| s.linear_frequency_hz)),
    BLADE_FREQUENCY,
    PEAK_AMPLITUDE,
    number("peak_frequency_hz", Of::Response(|r| r.peak_frequency_hz)),
    number("peak_ratio", Of::Response(|r| r.peak_ratio)),
    number("static_pressure_pa", Of::Static(|s| s.largest_pressure_pa)),
    NORMAL_FORCE,
    number("static_slip_m", Of::Static(|s| s.largest_slip_m)),
    number(
        "peak_friction_power_w",
        Of::Response(|r| r.peak_friction_power_w),
    ),
    number(
        "peak_damping_power_w",
        Of::Response(|r| r.peak_damping_power_w),
    ),
    number(
        "peak_friction_energy_j_m2",
        Of::Response(|r| r.peak_largest_friction_energy_j_m2),
    ),
    number("peak_slid_m", Of::Response(|r| r.peak_largest_slid_m)),
    number("loss_factor", Of::Response(loss_factor)),
    count("opening_pairs", |r| Some(r.pairs_that_open as f64)),
    number(
        "opening_area_share",
        Of::Response(|r| r.area_share_that_opens),
    ),
    count("peak_opening_pairs", |r| {
        r.peak_opening_pairs.map(|n| n as f64)
    }),
    count("peak_slipping_pairs", |r| {
        r.peak_slipping_pairs.map(|n| n as f64)
    }),
];

/// At the peak.
fn loss_factor(response: &ResponseSummary) -> Option<f64> {
    let row = response.peak_row?;
    let at_peak = response.peaks.iter().find(|peak| peak.row == row);
    at_peak?.loss_factor
}

pub const WORDS: [&str; ALL.len()] = {
    let mut words = [""; ALL.len()];
    let mut i = 0;
    while i < ALL.len() {
        words[i] = ALL[i].word;
        i += 1;
    }
    words
};

/// What a figure is called and its SI unit, taken from the end of its heading: `peak_amplitude` and
/// `m`. Shares, ratios and counts have no unit.
pub fn name_and_unit(heading: &str) -> (&str, &'static str) {
    const UNITS: [(&str, &str); 6] = [
        ("_j_m2", "J/m²"),
        ("_m", "m"),
        ("_hz", "Hz"),
        ("_pa", "Pa"),
        ("_n", "N"),
        ("_w", "W"),
    ];
    let of_unit = |(end, unit)| Some((heading.strip_suffix(end)?, unit));
    UNITS.into_iter().find_map(of_unit).unwrap_or((heading, ""))
}

impl Quantity {
    /// Heading and value of each of its figures in a summary; what the run does not have is left
    /// out.
    pub fn figures(self, summary: &Summary) -> Vec<(String, f64)> {
        let own = |value: Option<f64>| vec![(self.word.to_owned(), value)];
        let (of_static, of_response) = (&summary.static_state, &summary.response);
        let figures = match self.of {
            Of::Run(of) => own(of(summary)),
            Of::Static(of) => own(of_static.as_ref().and_then(of)),
            Of::Response(of) => own(of_response.as_ref().and_then(of)),
            Of::Contact(of) => {
                let contacts = of_static.iter().flat_map(|s| &s.contacts);
                let figure = |c: &ContactSummary| (format!("{}_{}", c.name, self.word), of(c));
                contacts.map(figure).collect()
            }
        };
        let there = figures
            .into_iter()
            .filter_map(|(heading, v)| Some((heading, v?)));
        there.filter(|(_, v)| v.is_finite()).collect()
    }

    /// Whether a heading is that of one of its figures.
    pub fn has_heading(self, heading: &str) -> bool {
        match (heading.strip_suffix(self.word), self.of) {
            (Some(contact), Of::Contact(_)) => contact.len() > 1 && contact.ends_with('_'),
            (Some(before), _) => before.is_empty(),
            (None, _) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_solver::dlft::Outcome;

    #[test]
    fn headings_lead_back_to_their_quantity() {
        for quantity in ALL.into_iter().filter(|q| *q != NORMAL_FORCE) {
            let own: Vec<_> = ALL
                .iter()
                .filter(|q| q.has_heading(quantity.word))
                .collect();
            assert_eq!(own, [&quantity]);
        }
        let own = ALL.iter().filter(|q| q.has_heading("left_normal_force_n"));
        assert_eq!(own.collect::<Vec<_>>(), [&NORMAL_FORCE]);
        assert!(!ALL.iter().any(|q| q.has_heading("harmonics")));
    }

    #[test]
    fn names_end_with_their_unit_or_have_none() {
        assert_eq!(name_and_unit("peak_amplitude_m"), ("peak_amplitude", "m"));
        assert_eq!(
            name_and_unit("static_pressure_pa"),
            ("static_pressure", "Pa")
        );
        assert_eq!(name_and_unit("peak_ratio"), ("peak_ratio", ""));
        assert_eq!(name_and_unit("opening_pairs"), ("opening_pairs", ""));
        assert_eq!(name_and_unit("left_normal_force_n").1, "N");
    }

    #[test]
    fn figures_are_read_and_what_is_missing_is_left_out() {
        let contact = |name: &str, normal_force_n| ContactSummary {
            name: name.to_owned(),
            pairs: 1,
            area_m2: None,
            normal_force_n,
            friction_force_n: None,
            mean_pressure_pa: None,
            counts: None,
        };
        let summary = Summary {
            stuck_frequency_hz: Some(450.5),
            static_state: Some(StaticSummary {
                outcome: Outcome::Converged,
                counts: None,
                largest_slip_m: Some(f64::NAN),
                largest_pressure_pa: None,
                contacts: vec![contact("left", Some(10.0)), contact("right", None)],
                retention_n: None,
                newton_iterations: 1,
                residual: None,
            }),
            ..Summary::default()
        };
        let figures: Vec<_> = ALL.iter().flat_map(|q| q.figures(&summary)).collect();
        let expected = [("stuck_frequency_hz", 450.5), ("left_normal_force_n", 10.0)];
        assert_eq!(figures, expected.map(|(h, v)| (h.to_owned(), v)));
    }
}
