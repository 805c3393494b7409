//! Answers in words and rounded numbers.

use super::answers::{Advice, Answers};
use super::cases::Case;
use super::file::Study;
use super::results::{CaseResult, Figures};
use crate::study::answers::orders::How;

/// To so many significant digits: plain between 1e-3 and 1e6, else with an exponent.
pub fn rounded(v: f64, digits: usize) -> String {
    if v == 0.0 {
        return "0".to_owned();
    }
    if v.fract() == 0.0 && v.abs() < 1e6 {
        return format!("{v:.0}");
    }
    let magnitude = v.abs().log10().floor();
    if !(-3.0..6.0).contains(&magnitude) {
        return format!("{v:.*e}", digits.saturating_sub(1));
    }
    let decimals = (digits as f64 - 1.0 - magnitude).max(0.0) as usize;
    format!("{v:.decimals$}")
}

/// 0.0123 -> `1.2 %`.
pub fn percent(fraction: f64) -> String {
    format!("{} %", rounded(100.0 * fraction, 2))
}

/// A share that someone asked for: 0.01 -> `1 %`.
fn asked_percent(fraction: f64) -> String {
    let text = format!("{:.6}", 100.0 * fraction);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// `flanks 8 x 18, harmonics 3`: knobs that have more than one value.
pub fn settings(study: &Study, values: &[usize]) -> String {
    let knobs = study.knobs.iter().zip(values);
    let words: Vec<String> = knobs
        .filter(|(knob, _)| knob.values.len() > 1)
        .map(|(knob, v)| format!("{} {}", knob.name, knob.values[*v].label))
        .collect();
    if words.is_empty() {
        "as it is".to_owned()
    } else {
        words.join(", ")
    }
}

/// One recommendation, in one sentence or two.
pub fn advice(study: &Study, results: &[CaseResult], answers: &Answers, advice: &Advice) -> String {
    let goal = format!(
        "for {} on {}",
        asked_percent(advice.accuracy),
        advice.heading
    );
    let mut text = match advice.run {
        Some(c) => {
            let error = error_of(answers, &advice.heading, c).map_or("unknown".to_owned(), percent);
            let seconds = results[c].figures().map_or(f64::NAN, Figures::cost_seconds);
            let marked = match results[c].figures() {
                Some(f) if f.unconverged > 0 => format!(", {}", results[c].outcome()),
                _ => String::new(),
            };
            format!(
                "{goal}: {}: {} s (run {}{marked}; estimated error {error}{})",
                settings(study, &results[c].case.values),
                rounded(seconds, 2),
                results[c].case.slug,
                measured(results, answers, advice, c)
            )
        }
        None => match smallest(answers, &advice.heading) {
            Some((c, error)) => format!(
                "{goal}: no run is that accurate; the best is {}, estimated error {} (run {}): go on refining the knob \
                 that errs most",
                settings(study, &results[c].case.values),
                percent(error),
                results[c].case.slug
            ),
            None => format!("{goal}: no run has an estimate of its error"),
        },
    };
    if let Some(combination) = &advice.combination {
        text = format!(
            "{text}. Not run itself, put together from what each knob costs and errs: {}: about {} s, estimated error {}",
            settings(study, &combination.values),
            rounded(combination.seconds, 2),
            percent(combination.error)
        );
    }
    text
}

/// For a combination: how far it came out from the common limit.
fn measured(results: &[CaseResult], answers: &Answers, advice: &Advice, c: usize) -> String {
    let base = &answers.base;
    let turned = results[c].case.turned(base);
    let front = answers.fronts.iter().find(|f| f.heading == advice.heading);
    let limit = front.and_then(|f| f.limit);
    match (turned > 1, results[c].value(&advice.heading), limit) {
        (true, Some(value), Some(limit)) => {
            match super::answers::orders::relative_error(value, limit) {
                Some(error) => format!(
                    ", {} from the common limit {}",
                    percent(error),
                    rounded(limit, 5)
                ),
                None => String::new(),
            }
        }
        _ => String::new(),
    }
}

fn error_of(answers: &Answers, heading: &str, case: usize) -> Option<f64> {
    answers.fronts.iter().find(|f| f.heading == heading)?.errors[case]
}

fn smallest(answers: &Answers, heading: &str) -> Option<(usize, f64)> {
    let front = answers.fronts.iter().find(|f| f.heading == heading)?;
    let errors = front
        .errors
        .iter()
        .enumerate()
        .filter_map(|(c, e)| Some((c, (*e)?)));
    errors.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// What the errors of a figure rest on, knob by knob.
pub fn basis(study: &Study, answers: &Answers, heading: &str) -> String {
    let of_knob = |k: &super::answers::KnobAnswer| {
        let figure = k.figures.iter().find(|f| f.heading == heading)?;
        let name = &study.knobs[k.knob].name;
        Some(match figure.limit?.how {
            How::Richardson => format!(
                "{name}: from the Richardson value (order {})",
                rounded(figure.limit?.order?, 2)
            ),
            How::Finest => format!(
                "{name}: from the finest value, no order shows (its own error taken as the last step)"
            ),
            How::Reference => format!(
                "{name}: from {}",
                study.knobs[k.knob].values[k.cases.len() - 1].label
            ),
            How::Unchanged => format!("{name}: no influence"),
            How::Single => format!("{name}: one value only, its error is not known"),
        })
    };
    let words: Vec<String> = answers.knobs.iter().filter_map(of_knob).collect();
    words.join("; ")
}

/// What a case is, for headings.
pub fn title(study: &Study, case: &Case) -> String {
    format!("{} ({})", case.slug, settings(study, &case.values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_to_significant_digits() {
        assert_eq!(rounded(450.7812, 5), "450.78");
        assert_eq!(rounded(0.0065012, 3), "0.00650");
        assert_eq!(rounded(1.34e-5, 2), "1.3e-5");
        assert_eq!(rounded(12_345_678.0, 3), "1.23e7");
        assert_eq!(rounded(123_456.4, 3), "123456");
        assert_eq!(rounded(15.0, 6), "15");
        assert_eq!(percent(0.0123), "1.2 %");
        assert_eq!(asked_percent(0.01), "1 %");
        assert_eq!(asked_percent(0.0025), "0.25 %");
    }
}
