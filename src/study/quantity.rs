//! The quantities a study follows, and where summary.json of a case has them.

use serde_json::Value;

/// A figure of a run. [`Quantity::NormalForce`] is one figure per contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    StuckFrequency,
    BladeFrequency,
    PeakAmplitude,
    PeakFrequency,
    PeakRatio,
    StaticPressure,
    NormalForce,
    StaticSlip,
    FrictionPower,
    DampingPower,
    OpeningPairs,
    OpeningShare,
    PeakOpeningPairs,
    PeakSlippingPairs,
}

/// In the order of the columns of study.csv.
pub const ALL: [Quantity; 14] = [
    Quantity::StuckFrequency,
    Quantity::BladeFrequency,
    Quantity::PeakAmplitude,
    Quantity::PeakFrequency,
    Quantity::PeakRatio,
    Quantity::StaticPressure,
    Quantity::NormalForce,
    Quantity::StaticSlip,
    Quantity::FrictionPower,
    Quantity::DampingPower,
    Quantity::OpeningPairs,
    Quantity::OpeningShare,
    Quantity::PeakOpeningPairs,
    Quantity::PeakSlippingPairs,
];

impl Quantity {
    /// In study files and as heading of a column (after the name of the contact, where there is one).
    pub fn word(self) -> &'static str {
        match self {
            Self::StuckFrequency => "stuck_frequency_hz",
            Self::BladeFrequency => "blade_frequency_hz",
            Self::PeakAmplitude => "peak_amplitude_m",
            Self::PeakFrequency => "peak_frequency_hz",
            Self::PeakRatio => "peak_ratio",
            Self::StaticPressure => "static_pressure_pa",
            Self::NormalForce => "normal_force_n",
            Self::StaticSlip => "static_slip_m",
            Self::FrictionPower => "peak_friction_power_w",
            Self::DampingPower => "peak_damping_power_w",
            Self::OpeningPairs => "opening_pairs",
            Self::OpeningShare => "opening_area_share",
            Self::PeakOpeningPairs => "peak_opening_pairs",
            Self::PeakSlippingPairs => "peak_slipping_pairs",
        }
    }

    pub fn of_word(word: &str) -> Option<Self> {
        ALL.into_iter().find(|q| q.word() == word)
    }

    /// A whole number, which follows no power of a size.
    pub fn is_count(self) -> bool {
        matches!(
            self,
            Self::OpeningPairs | Self::PeakOpeningPairs | Self::PeakSlippingPairs
        )
    }

    /// Place in summary.json.
    fn place(self) -> &'static str {
        match self {
            Self::StuckFrequency => "/stuck_frequency_hz",
            Self::BladeFrequency => "/blade_frequency_hz",
            Self::PeakAmplitude => "/response/peak_amplitude_m",
            Self::PeakFrequency => "/response/peak_frequency_hz",
            Self::PeakRatio => "/response/peak_ratio",
            Self::StaticPressure => "/static/largest_pressure_pa",
            Self::NormalForce => "/static/contacts",
            Self::StaticSlip => "/static/largest_slip_m",
            Self::FrictionPower => "/response/peak_friction_power_w",
            Self::DampingPower => "/response/peak_damping_power_w",
            Self::OpeningPairs => "/response/pairs_that_open",
            Self::OpeningShare => "/response/area_share_that_opens",
            Self::PeakOpeningPairs => "/response/peak_opening_pairs",
            Self::PeakSlippingPairs => "/response/peak_slipping_pairs",
        }
    }

    /// Heading and value of each of its figures in a summary; what the run does not have is left out.
    pub fn figures(self, summary: &Value) -> Vec<(String, f64)> {
        let Some(value) = summary.pointer(self.place()) else {
            return Vec::new();
        };
        let figure =
            |heading: String, v: &Value| Some((heading, v.as_f64().filter(|v| v.is_finite())?));
        match value.as_array() {
            None => figure(self.word().to_owned(), value).into_iter().collect(),
            Some(contacts) => contacts
                .iter()
                .filter_map(|contact| {
                    let name = contact.get("name")?.as_str()?;
                    figure(
                        format!("{name}_{}", self.word()),
                        contact.get("normal_force_n")?,
                    )
                })
                .collect(),
        }
    }

    /// The quantity a heading belongs to.
    pub fn of_heading(heading: &str) -> Option<Self> {
        let own = Self::of_word(heading);
        own.or_else(|| {
            heading
                .ends_with("_normal_force_n")
                .then_some(Self::NormalForce)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_lead_back_to_their_quantity() {
        for quantity in ALL {
            assert_eq!(Quantity::of_word(quantity.word()), Some(quantity));
            assert_eq!(Quantity::of_heading(quantity.word()), Some(quantity));
        }
        assert_eq!(
            Quantity::of_heading("left_normal_force_n"),
            Some(Quantity::NormalForce)
        );
        assert_eq!(Quantity::of_heading("harmonics"), None);
    }

    #[test]
    fn figures_are_read_and_what_is_missing_is_left_out() {
        let summary = serde_json::json!({
            "stuck_frequency_hz": 450.5, "blade_frequency_hz": null,
            "static": { "contacts": [
                { "name": "left", "normal_force_n": 10.0 }, { "name": "right", "normal_force_n": null }] },
            "response": null
        });
        let figures = |q: Quantity| q.figures(&summary);
        assert_eq!(
            figures(Quantity::StuckFrequency),
            [("stuck_frequency_hz".to_owned(), 450.5)]
        );
        assert_eq!(
            figures(Quantity::NormalForce),
            [("left_normal_force_n".to_owned(), 10.0)]
        );
        assert!(
            figures(Quantity::BladeFrequency).is_empty() && figures(Quantity::PeakRatio).is_empty()
        );
    }
}
