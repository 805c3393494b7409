//! Numbers in a form that is easy to read.

use dovetail_solver::dlft::{CycleCounts, StaticCounts};
use dovetail_solver::reduced::DiscExcitation;

/// Prefixes of units, a factor of a thousand apart.
const PREFIXES: [&str; 9] = ["p", "n", "µ", "m", "", "k", "M", "G", "T"];

/// Largest number of digits of a short number.
const SHORT_DIGITS: usize = 6;

/// Number rounded to this number of digits.
pub fn rounded(v: f64, digits: usize) -> f64 {
    let text = format!("{v:.*e}", digits.saturating_sub(1));
    text.parse().unwrap_or(v)
}

/// Number with seven digits, which suffice for a reader and take few bytes.
pub(crate) fn seven_digits(v: f64) -> f64 {
    rounded(v, 7)
}

/// Power of ten of a number that is rounded to this number of digits.
fn power_of_ten(v: f64, digits: usize) -> i32 {
    let text = format!("{v:.*e}", digits.saturating_sub(1));
    let power = text.rsplit('e').next().and_then(|e| e.parse().ok());
    power.unwrap_or(0)
}

/// Number with this number of digits in all, without an exponent if that is short.
pub fn figure(v: f64, digits: usize) -> String {
    if v == 0.0 {
        return "0".to_owned();
    }
    if !v.is_finite() {
        return "–".to_owned();
    }
    let power = power_of_ten(v, digits);
    if !(-4..6).contains(&power) {
        return format!("{v:.*e}", digits.saturating_sub(1)).replace('-', "−");
    }
    let after = (digits as i32 - 1 - power).max(0) as usize;
    format!("{:.after$}", rounded(v, digits)).replace('-', "−")
}

/// Number with at most `SHORT_DIGITS` digits, without zeros at the end of its fraction.
pub fn short(v: f64) -> String {
    let text = figure(v, SHORT_DIGITS);
    let (fraction, exponent) = text.split_at(text.find('e').unwrap_or(text.len()));
    let fraction = if fraction.contains('.') {
        fraction.trim_end_matches('0').trim_end_matches('.')
    } else {
        fraction
    };
    format!("{fraction}{exponent}")
}

/// Quantity with the prefix that leaves one to three digits before the point: `6.491 mm`.
pub fn quantity(v: f64, unit: &str, digits: usize) -> String {
    quantity_in_prefix(v, v, unit, digits)
}

/// Quantity with the prefix of another quantity: `0.656 µm` beside `1.24 µm`.
pub fn quantity_in_prefix(v: f64, other: f64, unit: &str, digits: usize) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{} {unit}", figure(v, digits));
    }
    let (unit, size) = prefixed(unit, other, digits);
    format!("{} {unit}", figure(rounded(v, digits) / size, digits))
}

/// Quantity as a scene gives it: `1 N`, `12.5 mN`.
pub fn short_quantity(v: f64, unit: &str) -> String {
    let (unit, size) = prefixed(unit, v, SHORT_DIGITS);
    format!("{} {unit}", short(v / size))
}

/// Unit with the prefix that leaves one to three digits of a number before the point, if it is
/// rounded to this number of digits, and the size of this unit.
fn prefixed(unit: &str, v: f64, digits: usize) -> (String, f64) {
    if v == 0.0 || !v.is_finite() {
        return (unit.to_owned(), 1.0);
    }
    let power = power_of_ten(v, digits).div_euclid(3).clamp(-4, 4);
    let prefix = PREFIXES[(power + 4) as usize];
    (format!("{prefix}{unit}"), 1e3_f64.powi(power))
}

/// Unit with the prefix that brings `largest` between 1 and 1000, and the factor to it; numbers
/// without a unit remain as they are.
pub fn prefixed_unit(unit: &str, largest: f64) -> (String, f64) {
    if unit.is_empty() {
        return (String::new(), 1.0);
    }
    let (unit, size) = prefixed(unit, largest, 6);
    (unit, 1.0 / size)
}

/// Name and unit of a key or a figure, from the end of the word: `gap` and `m`. Shares, ratios and
/// counts have no unit.
pub fn name_and_unit(word: &str) -> (String, &'static str) {
    const UNITS: [(&str, &str); 15] = [
        ("_j_m2", "J/m²"),
        ("_kg_m3", "kg/m³"),
        ("_m_s2", "m/s²"),
        ("_n_m", "N/m"),
        ("_per_s", "1/s"),
        ("_mib", "MiB"),
        ("_rpm", "rpm"),
        ("_deg", "°"),
        ("_hz", "Hz"),
        ("_pa", "Pa"),
        ("_s", "s"),
        ("_m", "m"),
        ("_n", "N"),
        ("_w", "W"),
        ("", ""),
    ];
    let of_unit = |(end, unit)| Some((word.strip_suffix(end)?.replace('_', " "), unit));
    let scaled = UNITS.into_iter().find_map(of_unit);
    scaled.unwrap_or_default()
}

/// Title of a key or a figure, such as `force (N)` for `force_n`.
pub fn title(word: &str) -> String {
    let (name, unit) = name_and_unit(word);
    append_unit(&name, unit)
}

/// Name with its unit in brackets, if it has one.
pub fn append_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_owned()
    } else {
        format!("{name} ({unit})")
    }
}

/// Number of a list whose numbers are apart by `step`, with no more decimals than that requires.
pub(crate) fn format_step(v: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{v:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        "0".to_owned()
    } else {
        text.replace('-', "−")
    }
}

/// Round numbers inside [low, high] with their texts, about `wanted` of them: multiples of 1, 2 or
/// 5 times a power of ten.
pub fn ticks(low: f64, high: f64, wanted: usize) -> Vec<(f64, String)> {
    let least = (high - low) / wanted.max(1) as f64;
    if !(least > 0.0 && least.is_finite()) {
        return vec![(low, format_step(low, 1.0))];
    }
    let power = 10f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    let step = steps.into_iter().find(|s| *s >= least * 0.999_999);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    let tick = |i: i64| (i as f64 * step, format_step(i as f64 * step, step));
    (first..=last).map(tick).collect()
}

/// Components of a vector in brackets: `(0, 0.707, −0.707)`.
pub fn vector(v: [f64; 3], digits: usize) -> String {
    format!("({})", v.map(|v| figure(v, digits)).join(", "))
}

/// Text of a value, or a dash if it is not known.
pub(crate) fn text_or_dash<T>(value: Option<T>, words: impl FnOnce(T) -> String) -> String {
    value.map_or_else(|| "–".to_owned(), words)
}

/// Text with a capital letter at the start.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// Largest number of digits of a figure.
const MOST_DIGITS: usize = 4;
/// Number of digits of a figure whose error is not known.
const DIGITS_OF_UNKNOWN: usize = 3;
/// Estimated error below which no digit changes.
const NO_ERROR: f64 = 1e-4;

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

/// Number and its error with the decimals that the error supports, in this unit: `300 ± 50 MPa`.
/// The error has one digit, or two if the first is 1; an error below the last of four digits of the
/// number is rounded up to it. An unknown error is left out, as the digits that it may change.
pub fn quantity_with_error(v: f64, error: Option<f64>, unit: &str) -> String {
    let Some(error) = error.filter(|error| error.is_finite() && v.is_finite()) else {
        return quantity(v, unit, DIGITS_OF_UNKNOWN);
    };
    let (unit, size) = prefixed(unit, v.abs().max(error.abs()), DIGITS_OF_UNKNOWN);
    format!("{} {unit}", figure_with_error(v / size, error / size))
}

/// Share and its error in percent: `105 ± 17 %`.
pub fn percent_with_error(share: f64, error: Option<f64>) -> String {
    match error.filter(|error| error.is_finite() && share.is_finite()) {
        Some(error) => format!("{} %", figure_with_error(100.0 * share, 100.0 * error)),
        None => percent(share, DIGITS_OF_UNKNOWN),
    }
}

fn figure_with_error(v: f64, error: f64) -> String {
    let largest = v.abs().max(error.abs());
    if largest == 0.0 {
        return "0 ± 0".to_owned();
    }
    let last = power_of_ten(largest, MOST_DIGITS) + 1 - MOST_DIGITS as i32;
    let error = error.abs().max(10f64.powi(last));
    let first_is_1 = [0, 1].map(|digits| format!("{error:.digits$e}").starts_with('1'));
    let first_is_1 = first_is_1.contains(&true);
    let last = (power_of_ten(error, 1) - i32::from(first_is_1)).max(last);
    let round = |v: f64| (v / 10f64.powi(last)).round() * 10f64.powi(last);
    let decimals = (-last).max(0) as usize;
    let texts = [v, error].map(|v| format!("{:.decimals$}", round(v)));
    let [v, error] = texts.map(|text| match text.strip_prefix('-') {
        Some(digits) if digits.trim_matches(['0', '.']).is_empty() => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    });
    format!("{v} ± {error}")
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

/// Text quoted as a word of a shell, if the shell would change it.
pub fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./~=:,+@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
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

/// What the static state and the response of a disc of equal sectors are.
pub fn motion_of_sectors(excitation: DiscExcitation) -> String {
    match excitation.wave(1) {
        None => "static state and response are those of all sectors in phase".to_owned(),
        Some(wave) => format!(
            "the static state is that of all sectors in phase, and the response the wave of engine order {}, whose \
             nodal diameter is {}",
            excitation.engine_order, wave.nodal_diameter
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_a_shell_are_quoted_where_it_would_change_them() {
        for (text, word) in [
            ("static.starting_tractions=2", "static.starting_tractions=2"),
            ("contact.*.friction=0.1", "'contact.*.friction=0.1'"),
            ("it's", "'it'\\''s'"),
            ("", "''"),
        ] {
            assert_eq!(shell_word(text), word);
        }
    }

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
    fn the_last_digit_of_a_number_is_the_last_of_its_error() {
        for (v, error, text) in [
            (303.2e6, Some(52.3e6), "300 ± 50 MPa"),
            (303.2e6, Some(14.6e6), "303 ± 15 MPa"),
            (303.2e6, Some(3.2e6), "303 ± 3 MPa"),
            (303.2e6, Some(0.96e6), "303.2 ± 1.0 MPa"),
            (303.2e6, Some(0.22e6), "303.2 ± 0.2 MPa"),
            (303.24e6, Some(0.001e6), "303.2 ± 0.1 MPa"),
            (303.24e6, Some(0.0), "303.2 ± 0.1 MPa"),
            (-8.4e6, Some(0.96e6), "−8.4 ± 1.0 MPa"),
            (-0.2e6, Some(4.0e6), "0 ± 4 MPa"),
            (999.9e6, Some(30.0e6), "1.00 ± 0.03 GPa"),
            (303.2e6, None, "303 MPa"),
            (0.0, Some(0.0), "0 ± 0 Pa"),
        ] {
            assert_eq!(quantity_with_error(v, error, "Pa"), text);
        }
        assert_eq!(percent_with_error(1.0534, Some(0.174)), "105 ± 17 %");
        assert_eq!(percent_with_error(1.0534, None), "105 %");
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
        assert_eq!(quantity_in_prefix(6.561e-7, 1.24e-6, "m", 4), "0.6561 µm");
        assert_eq!(quantity_in_prefix(0.0, 1.24e-6, "m", 4), "0 m");
        assert_eq!(figure(193.0, 3), "193");
        assert_eq!(figure(5.19e-3, 3), "0.00519");
        assert_eq!(figure(f64::NAN, 3), "–");
        assert_eq!(percent(0.0413, 2), "4.1 %");
        assert_eq!(bounded(0.0021, "at most"), "at most 0.21 %");
        assert_eq!(bounded(1.9e-9, "at most"), "less than 0.01 %");
        assert_eq!(counted(1, "pair", "pairs"), "1 pair");
        assert_eq!(short(0.1 + 0.2), "0.3");
        assert_eq!(short(1e-7), "1e−7");
        assert_eq!(short(1200.0), "1200");
        assert_eq!(short_quantity(0.0125, "N"), "12.5 mN");
    }

    #[test]
    fn units_bring_numbers_between_1_and_1000() {
        for (largest, unit, factor) in [
            (4.2e3, "kN", 1e-3),
            (0.999_999_9, "N", 1.0),
            (3e-5, "µN", 1e6),
            (0.0, "N", 1.0),
        ] {
            let (found, by) = prefixed_unit("N", largest);
            assert_eq!(found, unit);
            assert!((by / factor - 1.0).abs() < 1e-12, "{by}");
        }
        assert_eq!(prefixed_unit("", 4.2e3), (String::new(), 1.0));
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let of = |low, high, wanted| ticks(low, high, wanted);
        assert_eq!(
            of(371.3, 384.9, 6),
            [(375.0, "375".into()), (380.0, "380".into())]
        );
        assert_eq!(of(0.0, 1.0, 5).len(), 6);
        assert_eq!(of(-0.1, 0.3, 4)[0].1, "−0.1");
        assert_eq!(of(3.0, 3.0, 5), [(3.0, "3".into())]);
        assert_eq!(format_step(0.30000000000000004, 0.1), "0.3");
        assert_eq!(format_step(-0.0, 0.1), "0");
    }
}
