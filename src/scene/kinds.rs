//! Types of the values of keys, with their units and limits. The tables of the documentation, the
//! schemas and the messages use the words given here.

use std::fmt;

/// Type of the value of a key.
#[derive(Debug, Clone, Copy)]
pub enum ValueKind {
    /// Text; the argument describes what it names.
    Text(&'static str),
    /// Text of letters, digits, `_` and `-` that begins with a letter.
    Name,
    /// One of these texts.
    Choice(&'static [&'static str]),
    /// List of texts; the argument describes what they name.
    Texts(&'static str),
    /// List of some of these texts.
    Choices(&'static [&'static str]),
    /// Number with its unit, which is empty if it has none, and its limits.
    Number(&'static str, Limits),
    /// Whole number from the first to the second, which are `None` if they depend on other keys.
    Whole(Option<u32>, Option<u32>),
    /// List of this many numbers with their unit.
    Numbers(usize, &'static str),
    /// List of any number of numbers, at least one, with their unit and limits.
    NumberList(&'static str, Limits),
    /// Number, or a list of them, at least one, with their unit and limits.
    NumberOrList(&'static str, Limits),
    /// Table of numbers under names chosen by the user.
    NumberTable,
    /// True or false.
    Flag,
    /// List of values of any type, at least one.
    List,
    /// Value of several types, described in words.
    Any(&'static str),
}

/// Type into which serde reads a value of a [`ValueKind`].
macro_rules! mirror {
    (Text $of:tt) => { String };
    (Name) => { String };
    (Choice $of:tt) => { String };
    (Texts $of:tt) => { Vec<serde_spanned::Spanned<String>> };
    (Choices $of:tt) => { Vec<serde_spanned::Spanned<String>> };
    (Number $of:tt) => { $crate::scene::raw::Number };
    (Whole $of:tt) => { $crate::scene::raw::Count };
    (Numbers($count:literal, $unit:literal)) => { $crate::scene::raw::Numbers<$count> };
    (NumberList $of:tt) => { Vec<serde_spanned::Spanned<$crate::scene::raw::Number>> };
    (NumberOrList $of:tt) => { $crate::scene::raw::NumberOrList };
    (NumberTable) => {
        std::collections::BTreeMap<String, serde_spanned::Spanned<$crate::scene::raw::Number>>
    };
    (Flag) => { bool };
    (List) => { Vec<serde_spanned::Spanned<toml::Value>> };
    (Any $of:tt) => { toml::Value };
}
pub(crate) use mirror;

impl ValueKind {
    /// Limits of a number, in words; `None` if any number is valid or the type has no limits.
    pub fn limits(&self) -> Option<String> {
        match self {
            Self::Number(_, limits)
            | Self::NumberList(_, limits)
            | Self::NumberOrList(_, limits) => Some(limits.to_string()),
            Self::Whole(Some(least), Some(most)) => {
                Some(format!("{} to {}", grouped(*least), grouped(*most)))
            }
            Self::Whole(Some(least), None) => Some(format!("{} or more", grouped(*least))),
            Self::Whole(None, Some(most)) => Some(format!("at most {}", grouped(*most))),
            _ => None,
        }
    }
}

/// Type and unit, in words.
impl fmt::Display for ValueKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let with_unit = |f: &mut fmt::Formatter, unit: &str| match unit {
            "" => Ok(()),
            unit => write!(f, ", {unit}"),
        };
        match self {
            Self::Text(what) | Self::Texts(what) | Self::Any(what) => f.write_str(what),
            Self::Name | Self::Choice(_) => f.write_str("text"),
            Self::Choices(_) => f.write_str("list of texts"),
            Self::Number(unit, _) => {
                f.write_str("number")?;
                with_unit(f, unit)
            }
            Self::Whole(..) => f.write_str("whole number"),
            Self::Numbers(count, unit) => {
                write!(f, "list of {count} numbers")?;
                with_unit(f, unit)
            }
            Self::NumberList(unit, _) => {
                f.write_str("list of numbers")?;
                with_unit(f, unit)
            }
            Self::NumberOrList(unit, _) => {
                f.write_str("number, or list of numbers")?;
                with_unit(f, unit)
            }
            Self::NumberTable => f.write_str("table of numbers"),
            Self::Flag => f.write_str("true or false"),
            Self::List => f.write_str("list"),
        }
    }
}

/// Whole number with a comma before each three digits.
fn grouped(number: u32) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Interval of numbers.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    pub above: f64,
    pub below: f64,
    /// True if the lower end itself is allowed.
    pub from: bool,
}

impl Limits {
    pub const ANY: Self = Self {
        above: f64::NEG_INFINITY,
        below: f64::INFINITY,
        from: false,
    };
    pub const POSITIVE: Self = Self {
        above: 0.0,
        below: f64::INFINITY,
        from: false,
    };
    pub const NOT_NEGATIVE: Self = Self {
        above: 0.0,
        below: f64::INFINITY,
        from: true,
    };

    /// Interval that excludes both ends.
    pub const fn open_interval(above: f64, below: f64) -> Self {
        Self {
            above,
            below,
            from: false,
        }
    }
    /// Interval from 0, included, to `below`, excluded.
    pub const fn non_negative_below(below: f64) -> Self {
        Self {
            above: 0.0,
            below,
            from: true,
        }
    }
    pub fn contain(self, x: f64) -> bool {
        (x > self.above || (self.from && x == self.above)) && x < self.below
    }
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { above, below, from } = *self;
        let (above, below) = (Short(above), Short(below));
        match (self.below.is_finite(), from) {
            (false, false) if self.above.is_infinite() => f.write_str("any"),
            (false, true) => write!(f, "{above} or more"),
            (false, false) => write!(f, "greater than {above}"),
            (true, true) => write!(f, "{above} or more and less than {below}"),
            (true, false) => write!(f, "greater than {above} and less than {below}"),
        }
    }
}

/// Limit in common notation: with a power of ten if it is far from one.
pub(super) struct Short(pub f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.0.abs() {
            0.0 | 1e-3..1e6 => write!(f, "{}", self.0),
            _ => write!(f, "{:e}", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_keep_their_ends() {
        assert!(!Limits::POSITIVE.contain(0.0) && Limits::NOT_NEGATIVE.contain(0.0));
        let poisson = Limits::open_interval(-1.0, 0.5);
        assert!(poisson.contain(0.499) && !poisson.contain(0.5) && !poisson.contain(-1.0));
    }

    #[test]
    fn limits_are_said_as_people_write_them() {
        let texts = [
            Limits::ANY,
            Limits::open_interval(1e-4, 0.5),
            Limits::non_negative_below(1e7),
        ];
        assert_eq!(
            texts.map(|l| l.to_string()),
            [
                "any",
                "greater than 1e-4 and less than 0.5",
                "0 or more and less than 1e7"
            ]
        );
        let whole = [
            ValueKind::Whole(Some(1), Some(1_000_000)),
            ValueKind::Whole(None, Some(1000)),
            ValueKind::Whole(Some(1), None),
        ];
        assert_eq!(
            whole.map(|kind| kind.limits().unwrap()),
            ["1 to 1,000,000", "at most 1,000", "1 or more"]
        );
    }
}
