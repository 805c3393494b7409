//! Axes of charts, linear or logarithmic, with their marks.

use crate::words::{append_unit, prefixed_unit, short, ticks};

/// Number of round marks that a linear axis has, about.
const MARKS: usize = 10;
/// Ratio of the largest to the least value from which an axis is logarithmic.
const WIDE: f64 = 10.0;

/// Least and largest number; the least is above the largest if there is none.
pub fn ends(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, largest], v| {
        [v.min(least), v.max(largest)]
    })
}

/// Spacing of values along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences have equal lengths.
    Linear,
    /// Equal ratios have equal lengths.
    Logarithmic,
}

impl Scale {
    /// Scale that shows these values well: logarithmic for values above 0 over a decade or more.
    pub fn fitting(values: impl Iterator<Item = f64>) -> Self {
        let [least, largest] = ends(values);
        if least > 0.0 && largest >= WIDE * least {
            Self::Logarithmic
        } else {
            Self::Linear
        }
    }
}

/// One of the two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Title of the axis, without its unit.
    pub title: String,
    /// SI unit of the values, which a prefix may precede; empty if they are shown as they are.
    pub unit: &'static str,
    /// Scale of the axis; a logarithmic axis shows only values above 0.
    pub scale: Scale,
    /// Marked values and their labels; if empty, round values are marked.
    pub marks: Vec<(f64, String)>,
}

impl Axis {
    /// Linear axis of numbers whose unit, if any, stands in the title.
    pub fn linear(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            unit: "",
            scale: Scale::Linear,
            marks: Vec::new(),
        }
    }

    /// Logarithmic axis of numbers whose unit, if any, stands in the title.
    pub fn logarithmic(title: &str) -> Self {
        Self {
            scale: Scale::Logarithmic,
            ..Self::linear(title)
        }
    }

    /// Returns `true` if the axis can show a value.
    pub(super) fn shows(&self, value: f64) -> bool {
        place(self.scale, value).is_some()
    }

    /// Axis that covers these values and its own marks.
    pub(super) fn around(&self, values: impl Iterator<Item = f64>) -> DrawnAxis {
        let marked = self.marks.iter().map(|(v, _)| *v);
        let [low, high] = ends(values.chain(marked).filter_map(|v| place(self.scale, v)));
        let [low, high] = match self.scale {
            Scale::Logarithmic if low > high => [-1.0, 0.0],
            Scale::Logarithmic => [low - 0.15, high + 0.15],
            Scale::Linear if low > high => [0.0, 1.0],
            // From 0 where that does not press the points together.
            Scale::Linear if low >= 0.0 && low < 0.5 * high => [0.0, 1.05 * high],
            Scale::Linear => {
                let beside = match (high > low, low) {
                    (true, _) => 0.05 * (high - low),
                    (false, 0.0) => 1.0,
                    (false, same) => 0.1 * same.abs(),
                };
                [low - beside, high + beside]
            }
        };
        self.drawn([low, high])
    }

    /// Axis from one value to another, both above 0 if it is logarithmic.
    pub(super) fn spanning(&self, [low, high]: [f64; 2]) -> DrawnAxis {
        let ends = match self.scale {
            Scale::Linear => [low, high],
            Scale::Logarithmic => [low.log10(), high.log10()],
        };
        self.drawn(ends)
    }

    fn drawn(&self, [low, high]: [f64; 2]) -> DrawnAxis {
        let ends = match self.scale {
            Scale::Linear => [low, high],
            Scale::Logarithmic => [low, high].map(|v| 10f64.powf(v)),
        };
        let (unit, factor) = prefixed_unit(self.unit, ends[0].abs().max(ends[1].abs()));
        let round = || -> Vec<(f64, String)> {
            let ends = ends.map(|v| factor * v);
            let ticks = match self.scale {
                Scale::Linear => ticks(ends[0], ends[1], MARKS),
                Scale::Logarithmic => logarithmic_ticks(ends),
            };
            ticks
                .into_iter()
                .map(|(v, words)| (v / factor, words))
                .collect()
        };
        let marks = if self.marks.is_empty() {
            round()
        } else {
            self.marks.clone()
        };
        let mut axis = DrawnAxis {
            title: append_unit(&self.title, &unit),
            scale: self.scale,
            low,
            high,
            marks: Vec::new(),
        };
        let shares = marks.into_iter();
        let shares = shares.filter_map(|(v, words)| Some((axis.share(v)?, words)));
        axis.marks = shares.filter(|(s, _)| (0.0..=1.0).contains(s)).collect();
        axis
    }
}

/// Place of a value along an axis; `None` if the axis cannot show it.
fn place(scale: Scale, value: f64) -> Option<f64> {
    let place = match scale {
        Scale::Linear => value,
        Scale::Logarithmic => value.log10(),
    };
    Some(place).filter(|p| p.is_finite())
}

/// Powers of ten inside the range, with numbers between them if the range is short.
fn logarithmic_ticks([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    let decades = (high / low).log10();
    let steps: &[f64] = match decades {
        d if d < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        d if d < 3.0 => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let every = ((decades / 10.0).ceil() as i32).max(1);
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    (first..=last)
        .filter(|power| power % every == 0)
        .flat_map(|power| steps.iter().map(move |s| s * 10f64.powi(power)))
        .filter(|v| (low..=high).contains(v))
        .map(|v| (v, short(v)))
        .collect()
}

/// Axis with its range and its marks.
#[derive(Debug, Clone)]
pub(super) struct DrawnAxis {
    pub title: String,
    scale: Scale,
    /// Values at the ends, or their logarithms.
    pub low: f64,
    pub high: f64,
    /// Places of the marks, as shares of the length, and their words.
    pub marks: Vec<(f64, String)>,
}

impl DrawnAxis {
    /// Place of a value, as a share of the length; `None` if the axis cannot show the value.
    pub fn share(&self, value: f64) -> Option<f64> {
        Some((place(self.scale, value)? - self.low) / (self.high - self.low))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_ticks_are_round_and_inside() {
        let words = |low, high| -> Vec<String> {
            let ticks = logarithmic_ticks([low, high]).into_iter();
            ticks.map(|(_, words)| words).collect()
        };
        assert_eq!(words(0.9, 120.0), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(words(0.5e-4, 2.0), ["0.0001", "0.001", "0.01", "0.1", "1"]);
        assert_eq!(words(2.5, 4.5), ["3", "4"]);
    }

    #[test]
    fn an_axis_over_a_decade_is_logarithmic() {
        let of = |values: &[f64]| Scale::fitting(values.iter().copied());
        assert_eq!(of(&[0.5, 0.05]), Scale::Logarithmic);
        for values in [&[0.5, 0.06][..], &[0.0, 1.0], &[-1.0, 1.0], &[]] {
            assert_eq!(of(values), Scale::Linear, "{values:?}");
        }
    }

    #[test]
    fn an_axis_of_one_value_or_none_has_a_length() {
        for values in [&[][..], &[0.0], &[5.0], &[-5.0]] {
            let axis = Axis::linear("x").around(values.iter().copied());
            assert!(axis.low < axis.high && !axis.marks.is_empty());
        }
    }
}
