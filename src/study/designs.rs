//! What the design values lead to: the cases that are compared, the figures that change among them,
//! and the case with the least of a figure.

use super::convergence::SAME;
use super::file::{Mode, Study};
use super::results::CaseResult;

/// The cases that differ in design values alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Designs {
    /// Numerical parameters are at their base, in a grid at their finest value; none where no parameter is a
    /// design value.
    pub cases: Vec<usize>,
    /// Headings of the figures that are not the same in all of them.
    pub changing: Vec<String>,
    pub minima: Vec<Minimum>,
}

/// The least value of a figure among the designs.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    pub heading: String,
    /// `None` where no case has the figure.
    pub least: Option<Least>,
    /// Cases that do not have the figure.
    pub cases_without: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Least {
    /// The first case that has it.
    pub case: usize,
    pub value: f64,
    /// Other cases that have it, too.
    pub other_cases: usize,
    /// Parameters of numbers that stand at the lowest or the highest of them.
    pub at_ends: Vec<(usize, End)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Lowest,
    Highest,
}

impl End {
    pub fn word(self) -> &'static str {
        match self {
            Self::Lowest => "lowest",
            Self::Highest => "highest",
        }
    }
}

impl Designs {
    /// Compares the designs of all results in the figures of these headings.
    pub fn of(study: &Study, results: &[CaseResult], headings: &[String]) -> Self {
        let compared = |case: &usize| is_compared(study, &results[*case].case.values);
        let cases: Vec<usize> = match study.parameters.iter().any(|k| k.is_design()) {
            true => (0..results.len()).filter(compared).collect(),
            false => Vec::new(),
        };
        let changes = |heading: &&String| {
            let mut values = cases.iter().filter_map(|c| results[*c].value(heading));
            let first = values.next();
            first.is_some_and(|first| values.any(|v| !is_same(v, first)))
        };
        let minimise = study.minimise.iter().flat_map(|quantity| {
            let own = headings.iter().filter(|h| quantity.has_heading(h));
            let own: Vec<&str> = own.map(String::as_str).collect();
            match own.is_empty() {
                true => vec![quantity.word],
                false => own,
            }
        });
        Self {
            minima: minimise
                .map(|heading| minimum(study, results, &cases, heading))
                .collect(),
            changing: headings.iter().filter(changes).cloned().collect(),
            cases,
        }
    }

    /// The case of these values of all parameters.
    pub fn case(&self, results: &[CaseResult], values: &[usize]) -> Option<usize> {
        let mut cases = self.cases.iter().copied();
        cases.find(|c| results[*c].case.values == values)
    }
}

/// The value of each parameter around which designs are drawn: its base, of a numerical parameter in a grid
/// its finest value.
pub fn centre(study: &Study) -> Vec<usize> {
    let value = |parameter: &super::parameter::Parameter| match (study.mode, parameter.is_design())
    {
        (Mode::Grid, false) => parameter.values.len() - 1,
        _ => parameter.base,
    };
    study.parameters.iter().map(value).collect()
}

fn is_compared(study: &Study, values: &[usize]) -> bool {
    let centre = centre(study);
    let mut parameters = study.parameters.iter().enumerate();
    parameters.all(|(k, parameter)| parameter.is_design() || values[k] == centre[k])
}

fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

fn minimum(study: &Study, results: &[CaseResult], cases: &[usize], heading: &str) -> Minimum {
    let values = cases
        .iter()
        .filter_map(|c| Some((*c, results[*c].value(heading)?)));
    let values: Vec<(usize, f64)> = values.collect();
    let first_least = |a: (usize, f64), b: (usize, f64)| if b.1 < a.1 { b } else { a };
    let least = values.iter().copied().reduce(first_least);
    let least = least.map(|(case, value)| {
        let same = values.iter().filter(|(_, v)| is_same(*v, value));
        let chosen = study.parameters.iter().zip(&results[case].case.values);
        let end = |(k, (parameter, value)): (usize, (&super::parameter::Parameter, &usize))| {
            let last = parameter.values.len() - 1;
            let has_ends = parameter.is_design() && last > 0 && parameter.numbers().is_some();
            match *value {
                0 if has_ends => Some((k, End::Lowest)),
                v if has_ends && v == last => Some((k, End::Highest)),
                _ => None,
            }
        };
        Least {
            case,
            value,
            other_cases: same.count() - 1,
            at_ends: chosen.enumerate().filter_map(end).collect(),
        }
    });
    Minimum {
        heading: heading.to_owned(),
        least,
        cases_without: cases.len() - values.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::analyse;
    use crate::study::analysis::tests::{result, sized, study};
    use crate::study::cases::cases;
    use crate::study::parameter::{Kind, Parameter};
    use crate::study::quantity::PEAK_AMPLITUDE;
    use crate::study::results::Ended;

    /// The figure is (x - 0.3)^2 + y + 0.1 a, with y of two values and a numerical.
    fn designed() -> (Study, Vec<CaseResult>) {
        let design = |name: &str, values: &[f64]| Parameter {
            kind: Kind::Design,
            ..sized(name, values, 0)
        };
        let mut study = study(Mode::Grid, 0.5);
        study.minimise = vec![PEAK_AMPLITUDE];
        study.parameters = vec![
            design("x", &[0.1, 0.2, 0.4, 0.9]),
            design("y", &[1.0, 2.0]),
            sized("a", &[0.4, 0.2], 0),
        ];
        let figure = |study: &Study, values: &[usize]| {
            let number = |k: usize| study.parameters[k].values[values[k]].number.unwrap();
            (number(0) - 0.3).powi(2) + number(1) + 0.1 * number(2)
        };
        let results = cases(&study);
        let results = results
            .iter()
            .map(|c| result(c, figure(&study, &c.values), 1.0));
        let results = results.collect();
        (study, results)
    }

    #[test]
    fn the_least_design_is_found_at_the_finest_numerical_values() {
        let (study, results) = designed();
        let found = analyse(&study, &results).designs;
        assert_eq!(found.cases.len(), 8);
        assert_eq!(found.changing, ["peak_amplitude_m"]);
        let least = found.minima[0].least.clone().unwrap();
        // x = 0.2 and x = 0.4 are as near to 0.3; y is at its end, x is not.
        assert_eq!(results[least.case].case.values, [1, 0, 1]);
        assert!((least.value - (0.01 + 1.0 + 0.02)).abs() < 1e-12);
        assert_eq!(least.other_cases, 1);
        assert_eq!(least.at_ends, [(1, End::Lowest)]);
        assert_eq!(found.minima[0].cases_without, 0);
    }

    #[test]
    fn what_has_no_value_or_no_order_is_said_and_not_taken_for_an_end() {
        let (mut study, mut results) = designed();
        for value in &mut study.parameters[1].values {
            value.number = None;
        }
        let first = analyse(&study, &results).designs.minima[0].least.clone();
        results[first.unwrap().case].ended = Ended::NotRun;
        let found = analyse(&study, &results).designs.minima.remove(0);
        assert_eq!(found.cases_without, 1);
        let least = found.least.unwrap();
        assert_eq!(results[least.case].case.values, [2, 0, 1]);
        assert!(least.at_ends.is_empty() && least.other_cases == 0);
        for result in &mut results {
            result.ended = Ended::NotRun;
        }
        let found = analyse(&study, &results).designs.minima.remove(0);
        assert_eq!((found.least, found.cases_without), (None, 8));
        assert_eq!(found.heading, "peak_amplitude_m");
    }

    #[test]
    fn errors_are_those_of_the_numerical_parameters_at_each_design_by_itself() {
        let (study, results) = designed();
        let found = analyse(&study, &results);
        assert_eq!(found.at_designs.len(), 8);
        for at in &found.at_designs {
            assert_eq!(at.parameters.len(), 1);
            let own = at.errors[0].errors.iter().flatten();
            // The finest value has no order and no third size: the last step, 0.1 (0.4 - 0.2).
            let fine = (at.values[0], at.values[1]);
            let result = results
                .iter()
                .find(|r| r.case.values == [fine.0, fine.1, 1]);
            let step = 0.02 / result.unwrap().value("peak_amplitude_m").unwrap();
            let own: Vec<f64> = own.copied().collect();
            assert!(
                own.len() == 2 && own.iter().all(|e| (e - step).abs() < 1e-12),
                "{own:?}"
            );
        }
        // Every case has the error of its own design.
        assert!((0..results.len()).all(|c| found.error(0, c).is_some()));
    }

    #[test]
    fn designs_alone_have_no_errors() {
        let (mut study, _) = designed();
        study.parameters.truncate(2);
        study.targets.clear();
        let all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| result(c, 1.0, 1.0)).collect();
        let found = analyse(&study, &results);
        assert!(found.at_designs.is_empty() && found.with_errors.is_empty());
        // Nothing changes, and all cases have the least value.
        assert!(found.designs.changing.is_empty());
        let least = found.designs.minima[0].least.clone().unwrap();
        assert_eq!((least.case, least.other_cases), (0, 7));
    }
}
