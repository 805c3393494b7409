//! Numbers in a form that is easy to read.

use dovetail_solver::dlft::{CycleCounts, StaticCounts};

/// Prefixes of units and their powers of a thousand.
const PREFIXES: [(&str, i32); 9] = [
    ("p", -4),
    ("n", -3),
    ("µ", -2),
    ("m", -1),
    ("", 0),
    ("k", 1),
    ("M", 2),
    ("G", 3),
    ("T", 4),
];

/// Number rounded to this number of digits, and its power of ten.
fn rounded(v: f64, digits: usize) -> (f64, i32) {
    let text = format!("{v:.*e}", digits.saturating_sub(1));
    let power = text.rsplit('e').next().and_then(|e| e.parse().ok());
    (text.parse().unwrap_or(v), power.unwrap_or(0))
}

/// Number with this number of digits in all, without an exponent if that is short.
pub fn figure(v: f64, digits: usize) -> String {
    if v == 0.0 {
        return "0".to_owned();
    }
    if !v.is_finite() {
        return "–".to_owned();
    }
    let (value, power) = rounded(v, digits);
    if !(-4..6).contains(&power) {
        return format!("{v:.*e}", digits.saturating_sub(1)).replace('-', "−");
    }
    let after = (digits as i32 - 1 - power).max(0) as usize;
    format!("{value:.after$}").replace('-', "−")
}

/// Quantity with the prefix that leaves one to three digits before the point: `6.491 mm`.
pub fn quantity(v: f64, unit: &str, digits: usize) -> String {
    quantity_beside(v, v, unit, digits)
}

/// Quantity with the prefix of another quantity: `0.656 µm` beside `1.24 µm`.
pub fn quantity_beside(v: f64, other: f64, unit: &str, digits: usize) -> String {
    if v == 0.0 || !v.is_finite() || other == 0.0 || !other.is_finite() {
        return format!("{} {unit}", figure(v, digits));
    }
    let (value, _) = rounded(v, digits);
    let (_, power) = rounded(other, digits);
    let power = power.div_euclid(3).clamp(-4, 4);
    let prefix = PREFIXES.iter().find(|(_, p)| *p == power);
    let prefix = prefix.map_or("", |(prefix, _)| prefix);
    format!(
        "{} {prefix}{unit}",
        figure(value / 1e3_f64.powi(power), digits)
    )
}

/// Largest number of digits of a figure.
const MOST_DIGITS: usize = 4;
/// Number of digits of a figure whose error is not known.
const DIGITS_OF_UNKNOWN: usize = 3;
/// Estimated error below which no digit changes.
const NO_ERROR: f64 = 1e-4;

/// Number without the zeros at the end of its fraction.
pub fn without_zeros(number: &str) -> &str {
    if number.contains('.') && !number.contains('e') {
        number.trim_end_matches('0').trim_end_matches('.')
    } else {
        number
    }
}

/// Number of digits that are supported by the estimated relative error of a number: the last one
/// has the power of ten of the error. `None` is an unknown error.
pub fn supported_digits(v: f64, error: Option<f64>) -> usize {
    let Some(error) = error else {
        return DIGITS_OF_UNKNOWN;
    };
    if v == 0.0 || !v.is_finite() || error.abs() < NO_ERROR {
        return MOST_DIGITS;
    }
    let power = |v: f64| v.abs().log10().floor();
    let digits = power(v) - power(error * v) + 1.0;
    // A cast saturates, and takes a NaN to 0.
    (digits as usize).clamp(1, MOST_DIGITS)
}

/// Text of an error with one digit, `estimated error 4 %`, or two digits if the first is 1:
/// `estimated error 15 %`.
pub fn error_words(error: f64) -> String {
    let error = error.abs();
    if error < NO_ERROR {
        return format!("estimated error below {}", percent(NO_ERROR, 1));
    }
    let digits = if format!("{error:.1e}").starts_with('1') {
        2
    } else {
        1
    };
    format!("estimated error {}", percent(error, digits))
}

/// Share in percent: `3.4 %`.
pub fn percent(share: f64, digits: usize) -> String {
    format!("{} %", figure(100.0 * share, digits))
}

/// Text of a relative error: `at most 0.21 %` with `words` before it, or `less than 0.01 %` if it
/// changes no digit.
pub fn bounded(error: f64, words: &str) -> String {
    if error.abs() < NO_ERROR {
        format!("less than {}", percent(NO_ERROR, 1))
    } else {
        format!("{words} {}", percent(error.abs(), 2))
    }
}

/// Number with its noun: `1 pair`, `12 pairs`.
pub fn counted(count: usize, one: &str, many: &str) -> String {
    match count {
        1 => format!("1 {one}"),
        _ => format!("{count} {many}"),
    }
}

/// Counts of the states of the pairs in the static state: `38 pairs stick, 4 slide, 64 open`.
pub fn static_counts(counts: StaticCounts) -> String {
    format!(
        "{} stick, {} slide, {} open",
        counted(counts.stuck, "pair", "pairs"),
        counts.slipping,
        counts.open
    )
}

/// Counts of the states of the pairs in a period: `14 pairs stick, 35 slip, 3 open at times`,
/// followed by those of pairs that are open at rest, if any: `, 2 close at times, 62 stay open`.
pub fn cycle_counts(counts: CycleCounts) -> String {
    let at_rest = match counts.closing + counts.open {
        0 => String::new(),
        _ => format!(
            ", {} close at times, {} stay open",
            counts.closing, counts.open
        ),
    };
    format!(
        "{} stick, {} slip, {} open at times{at_rest}",
        counted(counts.stuck, "pair", "pairs"),
        counts.slipping,
        counts.opening
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_pairs_name_every_state_that_pairs_are_in() {
        let counts = CycleCounts {
            stuck: 14,
            slipping: 35,
            opening: 3,
            ..CycleCounts::default()
        };
        assert_eq!(
            cycle_counts(counts),
            "14 pairs stick, 35 slip, 3 open at times"
        );
        let counts = CycleCounts {
            stuck: 1,
            open: 2,
            ..counts
        };
        assert_eq!(
            cycle_counts(counts),
            "1 pair stick, 35 slip, 3 open at times, 0 close at times, 2 stay open"
        );
        let counts = StaticCounts {
            stuck: 4,
            slipping: 38,
            open: 64,
        };
        assert_eq!(static_counts(counts), "4 pairs stick, 38 slide, 64 open");
    }

    #[test]
    fn a_headline_has_the_digits_that_its_error_supports() {
        for (v, error, text) in [
            (6.4913e-3, Some(0.041), "6.5 mm, estimated error 4 %"),
            (6.4913e-3, Some(0.0033), "6.49 mm, estimated error 0.3 %"),
            (
                6.4913e-3,
                Some(1e-9),
                "6.491 mm, estimated error below 0.01 %",
            ),
            (
                6.4913e-3,
                Some(0.0),
                "6.491 mm, estimated error below 0.01 %",
            ),
            (1.0367e-6, Some(0.00118), "1.037 µm, estimated error 0.12 %"),
            (193.0e-3, Some(0.041), "193 mm, estimated error 4 %"),
            (193.0e-3, Some(0.12), "190 mm, estimated error 12 %"),
            (6.4913e-3, Some(1.02), "6 mm, estimated error 100 %"),
            (6.4913e-3, None, "6.49 mm"),
        ] {
            let number = quantity(v, "m", supported_digits(v, error));
            let words = error.map_or(String::new(), |error| format!(", {}", error_words(error)));
            assert_eq!(number + &words, text);
        }
        assert_eq!(supported_digits(0.0, Some(0.1)), MOST_DIGITS);
        assert_eq!(supported_digits(f64::NAN, Some(f64::NAN)), MOST_DIGITS);
    }

    #[test]
    fn numbers_have_their_digits_and_prefixes() {
        for (v, text) in [
            (6.4913e-3, "6.491 mm"),
            (16.82e-3, "16.82 mm"),
            (113.8e9, "113.8 GPa"),
            (-4.2e-7, "−420.0 nPa"),
            (0.0, "0 Pa"),
            (999.96, "1.000 kPa"),
            (1e-30, "1.000e−18 pPa"),
        ] {
            let unit = if text.ends_with("Pa") { "Pa" } else { "m" };
            assert_eq!(quantity(v, unit, 4), text);
        }
        assert_eq!(quantity_beside(6.561e-7, 1.24e-6, "m", 4), "0.6561 µm");
        assert_eq!(quantity_beside(0.0, 1.24e-6, "m", 4), "0 m");
        assert_eq!(figure(193.0, 3), "193");
        assert_eq!(figure(5.19e-3, 3), "0.00519");
        assert_eq!(figure(f64::NAN, 3), "–");
        assert_eq!(percent(0.0413, 2), "4.1 %");
        assert_eq!(bounded(0.0021, "at most"), "at most 0.21 %");
        assert_eq!(bounded(1.9e-9, "at most"), "less than 0.01 %");
        assert_eq!(counted(1, "pair", "pairs"), "1 pair");
    }
}
