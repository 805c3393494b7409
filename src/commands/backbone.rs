//! Amplitudes and table of `dovetail backbone`.

use super::Workspace;
use super::key_range::interpolate_ratio;
use crate::error::RunError;
use dovetail_export::csv::BackboneRow;
use dovetail_export::warning::Weight;
use dovetail_export::words::{figure, percent, quantity, rounded, short};
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::dlft::backbone::{BackboneEnd, BackbonePoint};
use dovetail_solver::run::{self, BackboneQuestion, Error, ModeBackbone, ModeChoice};

/// Number of amplitudes where none is given.
pub const AMPLITUDES: usize = 20;
/// Most amplitudes of a backbone.
pub const MOST_AMPLITUDES: usize = 10_000;
/// Estimated error of the damping ratio above which a warning says so.
const LARGE_ERROR: f64 = 0.02;

/// Range of amplitudes, `FROM:TO`, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeRange {
    from_m: f64,
    to_m: f64,
}

/// Reason why a text is not an [`AmplitudeRange`].
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum AmplitudeRangeError {
    #[error("`{0}` is not FROM:TO in metres, such as 1e-6:1e-3")]
    Form(String),
    #[error("amplitudes must be above 0 and ascend, and {from_m} to {to_m} do not")]
    Descends { from_m: f64, to_m: f64 },
}

impl std::str::FromStr for AmplitudeRange {
    type Err = AmplitudeRangeError;

    fn from_str(text: &str) -> Result<Self, AmplitudeRangeError> {
        let form = || AmplitudeRangeError::Form(text.to_owned());
        let (from, to) = text.split_once(':').ok_or_else(form)?;
        let number = |word: &str| word.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let (from_m, to_m) = (number(from).ok_or_else(form)?, number(to).ok_or_else(form)?);
        if from_m <= 0.0 || from_m >= to_m {
            return Err(AmplitudeRangeError::Descends { from_m, to_m });
        }
        Ok(Self { from_m, to_m })
    }
}

impl AmplitudeRange {
    /// So many amplitudes, 2 at least, spaced evenly in their logarithm, ends included, m.
    pub fn values_m(self, points: usize) -> Vec<f64> {
        let last = points.max(2) - 1;
        let at = |i: usize| match i {
            0 => self.from_m,
            i if i == last => self.to_m,
            _ => interpolate_ratio([self.from_m, self.to_m], i as f64 / last as f64),
        };
        (0..=last).map(at).collect()
    }
}

/// Backbone that is asked for.
#[derive(Debug, Clone)]
pub struct AskedBackbone {
    /// Linear mode.
    pub mode: ModeChoice,
    /// Amplitudes of the observed displacement, m, ascending.
    pub amplitudes_m: Vec<f64>,
    /// Name of the observed displacement; `None`: the first one.
    pub observation: Option<String>,
}

impl Workspace<'_> {
    /// Follows the backbone of a mode, writes it, and returns a table for the reader.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; a mode or an observed displacement that there is not.
    pub fn backbone(
        &self,
        asked: &AskedBackbone,
    ) -> Result<(String, Result<(), RunError>), RunError> {
        let source = self.source()?;
        let question = BackboneQuestion {
            mode: asked.mode,
            observation: asked.observation.as_deref(),
            amplitudes_m: &asked.amplitudes_m,
        };
        let found =
            self.computes(|session| run::backbone(self.scene, source, &question, session))?;
        let force_n = force_n(self.scene);
        if found.backbone.points.is_empty() {
            return Err(Error::NoBackbone.into());
        }
        self.warn_of_backbone(&found);
        let rows: Vec<BackboneRow<'_>> = (found.backbone.points.iter())
            .map(|point| BackboneRow {
                observation: found.observation,
                point,
                force_n,
            })
            .collect();
        if let Some(files) = &self.files {
            files.locked().backbone(&found, &rows)?;
        }
        let missing = asked.amplitudes_m.len() - rows.len();
        let verdict = match missing {
            0 => Ok(()),
            missing => Err(RunError::BackboneEnds {
                missing,
                amplitudes: asked.amplitudes_m.len(),
            }),
        };
        Ok((table(&found, &rows), verdict))
    }

    /// Warns of what the backbone does not show.
    fn warn_of_backbone(&self, found: &ModeBackbone) {
        let points = &found.backbone.points;
        let from_m = points.last().map_or(0.0, |point| {
            point.orbit.observed_amplitude[found.observation]
        });
        let why = match found.backbone.end {
            BackboneEnd::Open => Some(
                "more than one in twenty of the pairs that are closed at rest would be open in the \
                 whole period: such a motion is hardly that of the mode",
            ),
            BackboneEnd::Lost => Some(
                "no motion of a larger amplitude was found: more response.max_newton_iterations, \
                 more amplitudes (--points) or another number of response.harmonics may help",
            ),
            _ => None,
        };
        if let Some(why) = why {
            let text = format!("the backbone ends at {}: {why}", quantity(from_m, "m", 4));
            self.reporter.warning(Weight::Wrong, text);
        }
        if !found.close_modes.is_empty() {
            let others: Vec<String> = (found.close_modes.iter())
                .map(|mode| format!("{mode} ({} Hz)", figure(found.linear_hz[mode - 1], 6)))
                .collect();
            let text = format!(
                "the backbone of linear mode {} comes within 3 % of the frequency of mode {}: the \
                 motions of both may mix, and a force then excites both",
                found.mode,
                others.join(", ")
            );
            self.reporter.warning(Weight::Doubt, text);
        }
        let excitations = &found.reduced.problem.excitations;
        if let Some(other) = excitations.iter().find(|load| load.harmonic != 1) {
            let text = format!(
                "an excitation has harmonic {}: the force of a resonance is that of harmonic 1, \
                 and the columns force_n and excitation_scale stay empty",
                other.harmonic
            );
            self.reporter.warning(Weight::Wrong, text);
        }
        let error_of = |point: &BackbonePoint| point.estimated_error.unwrap_or(0.0);
        if let Some(first) = points.iter().find(|point| error_of(point) > LARGE_ERROR) {
            let largest = points.iter().map(error_of).fold(0.0, f64::max);
            let from_m = first.orbit.observed_amplitude[found.observation];
            let text = format!(
                "from {} on damping ratios are estimated to err by up to {}: ask for more \
                 response.harmonics, or for response.accuracy",
                quantity(from_m, "m", 4),
                percent(largest, 2)
            );
            self.reporter.warning(Weight::Doubt, text);
        }
    }
}

/// Force of the scene, N, where a single force excites it.
fn force_n(scene: &Scene) -> Option<f64> {
    match &scene.subject {
        Subject::ReducedModel(spec) => Some(spec.force_n),
        Subject::Assembly(assembly) => match &assembly.excitations[..] {
            [only] if only.kind.unit() == "N" => Some(only.amplitude),
            _ => None,
        },
    }
}

/// Table of a backbone.
fn table(found: &ModeBackbone, rows: &[BackboneRow<'_>]) -> String {
    let backbone = &found.backbone;
    let mut text = format!(
        "backbone of linear mode {} ({} Hz, damping ratio {}), amplitude of {}\n\
         {:>14}{:>15}{:>15}{:>13}{:>12}{:>9}{:>9}{:>9}\n",
        found.mode,
        figure(backbone.linear_hz, 6),
        short(rounded(backbone.linear_ratio, 4)),
        found.reduced.observations()[found.observation].name,
        "amplitude",
        "frequency, Hz",
        "damping ratio",
        "of friction",
        "force, N",
        "stick",
        "slip",
        "open",
    );
    for row in rows {
        let counts = row.point.orbit.counts();
        let words = |v: Option<f64>| v.map_or("–".to_owned(), |v| short(rounded(v, 4)));
        text += &format!(
            "{:>14}{:>15}{:>15}{:>13}{:>12}{:>9}{:>9}{:>9}\n",
            quantity(row.amplitude_m(), "m", 4),
            figure(row.point.orbit.frequency_hz, 7),
            short(rounded(row.point.damping_ratio, 4)),
            short(rounded(row.point.friction_ratio, 4)),
            words(row.resonant_force_n()),
            counts.stuck,
            counts.slipping,
            counts.opening + counts.closing + counts.open,
        );
    }
    for cycle in backbone.limit_cycles(found.observation) {
        let what = match cycle.is_stable {
            true => "limit cycle, to which smaller and larger motions tend without an excitation",
            false => "limit cycle that motions leave without an excitation: larger ones grow",
        };
        text += &format!(
            "{:>14}{:>15}  {what}\n",
            quantity(cycle.amplitude_m, "m", 4),
            figure(cycle.frequency_hz, 7),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amplitudes_are_spaced_by_ratio_and_have_both_ends() {
        let range: AmplitudeRange = "1e-6 : 1e-3".parse().unwrap();
        let values = range.values_m(4);
        assert_eq!((values[0], values[3]), (1e-6, 1e-3));
        assert!((values[1] / 1e-5 - 1.0).abs() < 1e-12, "{values:?}");
        assert_eq!(range.values_m(AMPLITUDES).len(), AMPLITUDES);
    }

    #[test]
    fn what_is_no_range_of_amplitudes_says_what_is() {
        for (text, says) in [
            ("1e-6", "FROM:TO"),
            ("a:1", "FROM:TO"),
            ("1e-6:inf", "FROM:TO"),
            ("0:1e-3", "above 0"),
            ("1e-3:1e-6", "ascend"),
        ] {
            let message = text.parse::<AmplitudeRange>().unwrap_err().to_string();
            assert!(message.contains(says), "{text}: {message}");
        }
    }
}
