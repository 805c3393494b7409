//! Range of a key of the scene, whose values a command goes through.

use crate::error::RunError;
use crate::scene::keys::is_setting;
use dovetail_export::words::{name_and_unit, rounded, short};
use dovetail_solver::description::{Scene, Subject};

/// Number of values of a range without its own.
const VALUES: usize = 20;
/// Largest number of values of a range.
const MOST_VALUES: usize = 1000;
/// Ratio of the ends above which values are spaced evenly in their logarithm.
const WIDE: f64 = 3.0;
/// Digits of a value for a reader.
pub(super) const DIGITS: usize = 4;

/// Range of a key: `KEY=FROM:TO` or `KEY=FROM:TO:N`.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyRange {
    pub key: String,
    from: f64,
    to: f64,
    values: usize,
}

/// Reason why a text is not a [`KeyRange`].
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum KeyRangeError {
    #[error("`{0}` is not KEY=FROM:TO or KEY=FROM:TO:N, such as contact.*.friction=0.01:1:20")]
    Form(String),
    #[error("the values must ascend, and {from} to {to} do not")]
    Descends { from: f64, to: f64 },
    #[error("the number of values must be from 2 to {MOST_VALUES}, not {0}")]
    Values(String),
    #[error("`{0}` is a setting of the solution: `dovetail study` varies them")]
    Setting(String),
}

impl std::str::FromStr for KeyRange {
    type Err = KeyRangeError;

    fn from_str(text: &str) -> Result<Self, KeyRangeError> {
        let form = || KeyRangeError::Form(text.to_owned());
        let (key, range) = text.split_once('=').ok_or_else(form)?;
        let key = key.trim();
        if key.is_empty() {
            return Err(form());
        }
        if is_setting(key) {
            return Err(KeyRangeError::Setting(key.to_owned()));
        }
        let number = |word: &str| word.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let words: Vec<&str> = range.split(':').collect();
        let (ends, count) = match words[..] {
            [from, to] => ([from, to], None),
            [from, to, count] => ([from, to], Some(count)),
            _ => return Err(form()),
        };
        let [from, to] = ends.map(number);
        let (from, to) = (from.ok_or_else(form)?, to.ok_or_else(form)?);
        if from >= to {
            return Err(KeyRangeError::Descends { from, to });
        }
        let values = match count {
            None => VALUES,
            Some(count) => (count.trim().parse().ok())
                .filter(|count| (2..=MOST_VALUES).contains(count))
                .ok_or_else(|| KeyRangeError::Values(count.to_owned()))?,
        };
        Ok(Self {
            key: key.to_owned(),
            from,
            to,
            values,
        })
    }
}

impl KeyRange {
    /// True if the values are spaced evenly in their logarithm.
    pub fn is_logarithmic(&self) -> bool {
        self.from > 0.0 && self.to >= WIDE * self.from
    }

    /// Values, ascending, ends included.
    pub fn values(&self) -> Vec<f64> {
        let last = self.values - 1;
        let at = |i: usize| {
            let share = i as f64 / last as f64;
            match i {
                0 => self.from,
                i if i == last => self.to,
                _ if self.is_logarithmic() => interpolate_ratio([self.from, self.to], share),
                _ if (self.to - self.from).is_finite() => self.from + share * (self.to - self.from),
                _ => (1.0 - share) * self.from + share * self.to,
            }
        };
        (0..self.values).map(at).collect()
    }

    /// Checks that the result depends on the key, with these other keys set.
    ///
    /// # Errors
    /// [`RunError::KeyNotRead`]; the errors of `scene_with`.
    pub(super) fn check_is_read<E: From<RunError>>(
        &self,
        also: &[String],
        scene_with: &dyn Fn(&[String]) -> Result<Scene, E>,
    ) -> Result<(), E> {
        let at = |value: f64| scene_with(&[also, &[self.set(value)]].concat());
        if strip_unread_keys(at(self.from)?) == strip_unread_keys(at(self.to)?) {
            let key = self.key.clone();
            return Err(RunError::KeyNotRead { key }.into());
        }
        Ok(())
    }

    /// The key set to its first value, as `--set` has it.
    pub(super) fn first(&self) -> String {
        self.set(self.from)
    }

    /// The key set to a value, as `--set` has it.
    pub(super) fn set(&self, value: f64) -> String {
        format!("{}={value:?}", self.key)
    }

    /// Last word of the key: `friction` of `contact.*.friction`.
    pub(super) fn word(&self) -> &str {
        self.key.rsplit('.').next().unwrap_or(&self.key)
    }

    /// Name and value, such as `friction 0.05` or `force 2 N`.
    pub(super) fn words(&self, value: f64) -> String {
        let (name, unit) = name_and_unit(self.word());
        let value = short(rounded(value, DIGITS));
        format!("{name} {value} {unit}").trim_end().to_owned()
    }
}

/// Value at a share of the way from one positive number to another, evenly in their logarithm.
pub(super) fn interpolate_ratio([from, to]: [f64; 2], share: f64) -> f64 {
    match to / from {
        ratio if ratio.is_finite() => from * ratio.powf(share),
        _ => from.powf(1.0 - share) * to.powf(share),
    }
}

/// Scene without the keys that neither peaks nor curves read: names, engine orders, the mission of a
/// wear, and the strengths and wear coefficients of the subject.
fn strip_unread_keys(mut scene: Scene) -> Scene {
    scene.name.clear();
    scene.engine_orders.clear();
    scene.mission.clear();
    match &mut scene.subject {
        Subject::Assembly(assembly) => {
            assembly
                .bodies
                .iter_mut()
                .for_each(|body| body.strength = None);
            let contacts = assembly.contacts.iter_mut();
            contacts.for_each(|contact| contact.pair_law.wear_m2_n = 0.0);
        }
        Subject::ReducedModel(model) => model.law.wear_m2_n = 0.0,
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_ranges_are_spaced_by_ratio_and_narrow_ones_evenly() {
        let range = |text: &str| text.parse::<KeyRange>().unwrap();
        let wide = range("contact.*.friction=0.01:1:3");
        assert_eq!(wide.key, "contact.*.friction");
        assert!(wide.is_logarithmic());
        let values = wide.values();
        assert_eq!((values[0], values[2]), (0.01, 1.0));
        assert!((values[1] - 0.1).abs() < 1e-15, "{values:?}");
        assert_eq!(
            range("rotation.speed_rpm = 4000 : 6000 : 3").values(),
            [4e3, 5e3, 6e3]
        );
        assert_eq!(
            range("contact.0.gap_m=-1e-5:1e-5:3").values(),
            [-1e-5, 0.0, 1e-5]
        );
        // The ratio of the ends, and their difference, need not be numbers.
        let values = range("contact.*.friction=1e-300:1e300:3").values();
        assert!((values[1] - 1.0).abs() < 1e-9, "{values:?}");
        let values = range("contact.0.gap_m=-1e308:1e308:3").values();
        assert_eq!(values, [-1e308, 0.0, 1e308]);
        assert_eq!(range("reduced_model.force_n=0.1:20").values().len(), VALUES);
        assert_eq!(wide.set(0.5), "contact.*.friction=0.5");
        assert_eq!(range("excitation.*.force_n=1:2").words(2.0), "force 2 N");
    }

    #[test]
    fn what_is_no_range_of_a_key_says_what_is() {
        for (text, says) in [
            ("contact.*.friction", "KEY=FROM:TO"),
            ("contact.*.friction=0.1", "KEY=FROM:TO"),
            ("=0.1:1", "KEY=FROM:TO"),
            ("contact.*.friction=a:1", "KEY=FROM:TO"),
            ("contact.*.friction=0:inf", "KEY=FROM:TO"),
            ("contact.*.friction=1:0.1", "ascend"),
            ("contact.*.friction=1:1", "ascend"),
            ("contact.*.friction=0.1:1:1", "from 2"),
            ("contact.*.friction=0.1:1:x", "from 2"),
            ("mesh.parameters.nu=2:8", "dovetail study"),
            ("response.harmonics=1:9", "dovetail study"),
        ] {
            let message = text.parse::<KeyRange>().unwrap_err().to_string();
            assert!(message.contains(says), "{text}: {message}");
        }
    }
}
