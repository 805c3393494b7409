//! Quantities that a study can follow, their names, and where they are found in the summary of a
//! case.

use std::str::FromStr;

use dovetail_export::manifest::{ContactSummary, ResponseSummary, StaticSummary, Summary};
use dovetail_export::words::{figure, name_and_unit};

/// One figure of a run, or one figure per contact.
#[derive(Debug, Clone, Copy)]
pub struct StudyQuantity {
    /// Word in study files and heading of a column (after the name of the contact, if there is
    /// one).
    pub word: &'static str,
    /// Name in sentences and pictures.
    name: &'static str,
    of: Of,
}

/// Source of a figure in a summary.
#[derive(Debug, Clone, Copy)]
enum Of {
    Run(fn(&Summary) -> Option<f64>),
    Static(fn(&StaticSummary) -> Option<f64>),
    /// One figure for each contact.
    Contact(fn(&ContactSummary) -> Option<f64>),
    Response(fn(&ResponseSummary) -> Option<f64>),
    /// Figure of the observed displacement.
    Observed(fn(&ResponseSummary) -> Option<f64>),
    Count(fn(&ResponseSummary) -> Option<usize>),
}

impl PartialEq for StudyQuantity {
    fn eq(&self, other: &Self) -> bool {
        self.word == other.word
    }
}

/// Reads the word of a quantity.
impl FromStr for StudyQuantity {
    type Err = ();
    fn from_str(word: &str) -> Result<Self, ()> {
        let mut quantities = ALL.iter();
        quantities.find(|of| of.word == word).copied().ok_or(())
    }
}

/// Defines the quantities in the order of the columns of table.csv: word, name, and source.
macro_rules! quantities {
    ($($word:literal, $name:literal, $of:ident($from:expr);)*) => {
        pub const ALL: &[StudyQuantity] = &[$(StudyQuantity {
            word: $word,
            name: $name,
            of: Of::$of($from),
        }),*];
        pub const WORDS: &[&str] = &[$($word),*];
    };
}

quantities! {
    "stuck_frequency_hz", "first stuck frequency", Run(|s| s.stuck_frequency_hz);
    "linear_frequency_hz", "first linear frequency", Run(|s| s.linear_frequency_hz);
    "blade_frequency_hz", "first frequency with held flanks", Run(|s| s.blade_frequency_hz);
    "peak_amplitude_m", "peak amplitude", Observed(|r| r.first.peak_amplitude_m);
    "peak_frequency_hz", "frequency of the peak", Response(|r| r.first.peak_frequency_hz);
    "peak_ratio", "ratio of the peak to the linear peak", Response(|r| r.first.peak_ratio);
    "static_pressure_pa", "largest static pressure", Static(|s| s.largest_pressure_pa);
    "normal_force_n", "static normal force", Contact(|c| c.normal_force_n);
    "static_slip_m", "largest static slip", Static(|s| s.largest_slip_m);
    "peak_friction_power_w", "friction power at the peak", Response(|r| r.first.peak_friction_power_w);
    "peak_damping_power_w", "damping power at the peak", Response(|r| r.first.peak_damping_power_w);
    "peak_friction_energy_j_m2", "largest friction energy per area in a period of the peak",
        Response(|r| r.first.peak_largest_friction_energy_j_m2);
    "peak_slid_m", "largest distance slid in a period of the peak",
        Response(|r| r.first.peak_largest_slid_m);
    "loss_factor", "loss factor", Response(|r| r.first.peak_loss_factor);
    "opening_pairs", "pairs that open", Count(|r| Some(r.pairs_that_open));
    "opening_area_share", "share of the area that opens", Response(|r| r.area_share_that_opens);
    "peak_opening_pairs", "pairs that open at the peak", Count(|r| r.first.peak_opening_pairs);
    "peak_slipping_pairs", "pairs that slip at the peak", Count(|r| r.first.peak_slipping_pairs);
}

/// First frequency of a body with its flanks held, which a run computes only on request.
pub const BLADE_FREQUENCY: StudyQuantity = ALL[2];

/// Figure of runs: a quantity, with its contact or displacement if it belongs to one.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    pub quantity: StudyQuantity,
    /// Heading of its column in table.csv.
    pub heading: String,
    /// Name in sentences and pictures: `peak amplitude of tip`.
    pub name: String,
}

impl Figure {
    pub fn unit(&self) -> &'static str {
        name_and_unit(self.quantity.word).1
    }

    /// Returns `true` if the figure is a whole number, which follows no power of a size.
    pub fn is_count(&self) -> bool {
        matches!(self.quantity.of, Of::Count(_))
    }

    /// Text of a value without its unit.
    pub fn number(&self, value: f64, digits: usize) -> String {
        if self.is_count() {
            format!("{value}")
        } else {
            figure(value, digits)
        }
    }
}

impl StudyQuantity {
    /// Estimated error of the figure with this value, in its unit; `None` where it is not known.
    pub fn error(self, response: &ResponseSummary, value: f64) -> Option<f64> {
        let peak = &response.first;
        let relative = || Some(value.abs() * peak.peak_estimated_error?);
        match self.word {
            "peak_amplitude_m" | "peak_ratio" => relative(),
            "peak_friction_power_w" => peak.peak_friction_power_error_w,
            "peak_damping_power_w" => peak.peak_damping_power_error_w,
            "peak_slid_m" => peak.peak_largest_slid_error_m,
            _ => None,
        }
    }

    /// Figures of the quantity in a summary, with their values; figures that the run does not have
    /// are left out.
    pub fn figures(self, summary: &Summary) -> Vec<(Figure, f64)> {
        let figure = |heading: String, of: Option<&str>, value: Option<f64>| {
            let name = of.map_or(self.name.to_owned(), |of| format!("{} of {of}", self.name));
            let figure = Figure {
                quantity: self,
                heading,
                name,
            };
            Some((figure, value.filter(|v| v.is_finite())?))
        };
        let state = summary.static_state.as_ref();
        let response = summary.response.as_ref();
        let mut observation = None;
        let value = match self.of {
            Of::Contact(of) => {
                let contacts = state.iter().flat_map(|s| &s.contacts);
                let heading = |c: &ContactSummary| format!("{}_{}", c.name, self.word);
                let contact_figure = |c: &ContactSummary| figure(heading(c), Some(&c.name), of(c));
                return contacts.filter_map(contact_figure).collect();
            }
            Of::Run(of) => of(summary),
            Of::Static(of) => state.and_then(of),
            Of::Response(of) => response.and_then(of),
            Of::Observed(of) => {
                observation = response.and_then(|r| r.observation.as_deref());
                response.and_then(of)
            }
            Of::Count(of) => response.and_then(of).map(|n| n as f64),
        };
        Vec::from_iter(figure(self.word.to_owned(), observation, value))
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use dovetail_export::manifest::ObservedPeak;
    use dovetail_export::words::title;
    use dovetail_solver::dlft::Outcome;

    pub const PEAK_AMPLITUDE: StudyQuantity = ALL[3];

    #[test]
    fn quantities_that_are_named_are_themselves() {
        assert_eq!(BLADE_FREQUENCY.word, "blade_frequency_hz");
        assert_eq!(PEAK_AMPLITUDE.word, "peak_amplitude_m");
    }

    #[test]
    fn names_end_with_their_unit_or_have_none() {
        for (word, name, unit) in [
            ("peak_amplitude_m", "peak amplitude", "m"),
            ("peak_friction_energy_j_m2", "peak friction energy", "J/m²"),
            ("stiffness_n_m", "stiffness", "N/m"),
            ("force_n", "force", "N"),
            ("speed_rpm", "speed", "rpm"),
            ("peak_ratio", "peak ratio", ""),
            ("stuck_modes", "stuck modes", ""),
        ] {
            assert_eq!(name_and_unit(word), (name.to_owned(), unit));
        }
        assert_eq!(title("force_n"), "force (N)");
        assert_eq!(title("friction"), "friction");
    }

    #[test]
    fn figures_have_words_for_what_they_are() {
        let summary = Summary {
            response: Some(ResponseSummary {
                observation: Some("tip".into()),
                first: ObservedPeak {
                    peak_amplitude_m: Some(6.4913e-3),
                    peak_ratio: Some(0.3828),
                    ..ObservedPeak::default()
                },
                pairs_that_open: 120,
                ..ResponseSummary::default()
            }),
            ..Summary::default()
        };
        let figures = ALL.iter().flat_map(|q| q.figures(&summary));
        let words = figures.map(|(f, v)| format!("{}: {}", f.name, f.number(v, 5)));
        let expected = [
            "peak amplitude of tip: 0.0064913",
            "ratio of the peak to the linear peak: 0.38280",
            "pairs that open: 120",
        ];
        assert_eq!(words.collect::<Vec<_>>()[..3], expected);
    }

    /// The error of an amplitude is relative, and the error of a power has the unit of the power.
    #[test]
    fn figures_have_the_errors_of_the_peak() {
        let response = ResponseSummary {
            first: ObservedPeak {
                peak_estimated_error: Some(0.1),
                peak_friction_power_error_w: Some(0.3),
                ..ObservedPeak::default()
            },
            ..ResponseSummary::default()
        };
        let errors = ALL
            .iter()
            .filter_map(|q| Some((q.word, q.error(&response, 2.0)?)));
        let expected = [
            ("peak_amplitude_m", 0.2),
            ("peak_ratio", 0.2),
            ("peak_friction_power_w", 0.3),
        ];
        assert_eq!(errors.collect::<Vec<_>>(), expected);
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
        let found: Vec<_> = figures
            .iter()
            .map(|(f, v)| (f.heading.as_str(), *v))
            .collect();
        assert_eq!(found, expected);
        assert_eq!(figures[1].0.name, "static normal force of left");
    }
}
