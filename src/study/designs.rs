//! Comparison of designs: the cases that are compared, the figures that change among them, and the
//! case with the smallest value of a figure at each load.

use super::convergence::SAME;
use super::file::{Mode, Study};
use super::parameter::{Kind, Parameter};
use super::quantity::Figure;
use super::results::CaseResult;

/// Cases that differ only in design values and loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Designs {
    /// Compared cases. Their numerical parameters are at their base, in a grid at their finest
    /// value. Empty if all parameters are numerical.
    pub cases: Vec<usize>,
    /// Figures that differ among the cases.
    pub changing: Vec<Figure>,
    pub minima: Vec<Minimum>,
}

/// Smallest value of a figure among the designs at one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    pub heading: String,
    /// Position of the value of each parameter; only those of loads matter.
    pub at: Vec<usize>,
    /// Number of compared cases.
    pub cases: usize,
    /// Number of compared cases that do not have the figure.
    pub cases_without: usize,
    /// Smallest value; `None` if no case has the figure.
    pub least: Option<Least>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Least {
    pub figure: Figure,
    /// First case with this value.
    pub case: usize,
    pub value: f64,
    /// Number of other cases with this value.
    pub other_cases: usize,
    /// Parameters of which the case has the smallest or the largest number, with `lowest` or
    /// `highest`.
    pub at_ends: Vec<(usize, &'static str)>,
}

impl Designs {
    /// Compares the designs of all results in these figures.
    pub fn of(study: &Study, results: &[CaseResult], figures: &[Figure]) -> Self {
        let centre = centre(study);
        let is_compared = |case: &usize| {
            let values = results[*case].case.values.iter().zip(&centre);
            let mut parameters = study.parameters.iter().zip(values);
            parameters.all(|(p, (value, centre))| !p.is_numerical() || value == centre)
        };
        let has_designs = study.parameters.iter().any(|p| !p.is_numerical());
        let all = 0..results.len() * usize::from(has_designs);
        let cases: Vec<usize> = all.filter(is_compared).collect();
        let changes = |figure: &&Figure| {
            let mut values = cases
                .iter()
                .filter_map(|c| results[*c].value(&figure.heading));
            let first = values.next();
            first.is_some_and(|first| values.any(|v| !is_same(v, first)))
        };
        let mut minima = Vec::new();
        for quantity in &study.minimise {
            let own = figures.iter().filter(|f| f.quantity == *quantity);
            let mut own: Vec<&str> = own.map(|f| f.heading.as_str()).collect();
            if own.is_empty() {
                own.push(quantity.word);
            }
            for heading in own {
                for group in at_loads(study, results, &cases) {
                    minima.push(minimum(study, results, &group, heading));
                }
            }
        }
        Self {
            changing: figures.iter().filter(changes).cloned().collect(),
            cases,
            minima,
        }
    }
}

/// Position of the value of each parameter around which designs are drawn: its base or, for a
/// numerical parameter in a grid, its finest value.
pub fn centre(study: &Study) -> Vec<usize> {
    let value = |p: &Parameter| match (study.mode, p.is_numerical()) {
        (Mode::Grid, true) => p.values.len() - 1,
        _ => p.base,
    };
    study.parameters.iter().map(value).collect()
}

fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

/// Cases in groups of the same load. One at a time there is only the group at the base of the
/// loads, as designs are varied nowhere else.
fn at_loads(study: &Study, results: &[CaseResult], cases: &[usize]) -> Vec<Vec<usize>> {
    let loads = |case: usize| -> Vec<usize> {
        let values = study.parameters.iter().zip(&results[case].case.values);
        values
            .filter(|(p, _)| p.is(Kind::Load))
            .map(|(_, v)| *v)
            .collect()
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &case in cases {
        match groups
            .iter_mut()
            .find(|group| loads(group[0]) == loads(case))
        {
            Some(group) => group.push(case),
            None => groups.push(vec![case]),
        }
    }
    // The base is the first case.
    groups.truncate(if study.mode == Mode::Grid {
        usize::MAX
    } else {
        1
    });
    groups
}

fn minimum(study: &Study, results: &[CaseResult], cases: &[usize], heading: &str) -> Minimum {
    let value = |c: &usize| {
        let mut values = results[*c].figures()?.values.iter();
        let (figure, value) = values.find(|(f, _)| f.heading == heading)?;
        Some((*c, figure, *value))
    };
    let values: Vec<(usize, &Figure, f64)> = cases.iter().filter_map(value).collect();
    let least = values
        .iter()
        .copied()
        .reduce(|a, b| if b.2 < a.2 { b } else { a });
    let least = least.map(|(case, figure, value)| {
        let chosen = study.parameters.iter().zip(&results[case].case.values);
        let end = |(k, (parameter, value)): (usize, (&Parameter, &usize))| {
            let last = parameter.values.len() - 1;
            let has_ends = parameter.is(Kind::Design) && last > 0 && parameter.numbers().is_some();
            match *value {
                0 if has_ends => Some((k, "lowest")),
                v if has_ends && v == last => Some((k, "highest")),
                _ => None,
            }
        };
        Least {
            figure: figure.clone(),
            case,
            value,
            other_cases: values.iter().filter(|v| is_same(v.2, value)).count() - 1,
            at_ends: chosen.enumerate().filter_map(end).collect(),
        }
    });
    Minimum {
        heading: heading.to_owned(),
        at: results[cases[0]].case.values.clone(),
        cases: cases.len(),
        cases_without: cases.len() - values.len(),
        least,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::analysis::analyse;
    use crate::study::analysis::tests::{result, sized, study};
    use crate::study::cases::cases;
    use crate::study::quantity::tests::PEAK_AMPLITUDE;
    use crate::study::results::Ended;

    /// Study whose figure is (x - 0.3)^2 + y + 0.1 a, with y of two values and a numerical.
    fn designed() -> (Study, Vec<CaseResult>) {
        let design = |name: &str, values: &[f64]| Parameter {
            kind: Kind::Design,
            ..sized(name, values, 0)
        };
        let mut study = study(Mode::Grid);
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
        let results = results.iter().map(|c| result(c, figure(&study, &c.values)));
        let results = results.collect();
        (study, results)
    }

    #[test]
    fn the_least_design_is_found_at_the_finest_numerical_values() {
        let (study, results) = designed();
        let found = analyse(&study, &results).designs;
        assert_eq!(found.cases.len(), 8);
        assert_eq!(found.changing.len(), 1);
        let least = found.minima[0].least.clone().unwrap();
        // x = 0.2 and x = 0.4 are as near to 0.3; y is at its end, x is not.
        assert_eq!(results[least.case].case.values, [1, 0, 1]);
        assert!((least.value - (0.01 + 1.0 + 0.02)).abs() < 1e-12);
        assert_eq!(least.other_cases, 1);
        assert_eq!(least.at_ends, [(1, "lowest")]);
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
    fn differences_are_those_of_the_numerical_parameters_at_each_design_by_itself() {
        let (study, results) = designed();
        let found = analyse(&study, &results);
        assert_eq!(found.refinements.len(), 8);
        for refinement in &found.refinements {
            let [coarse, fine] = [0, 1].map(|v| refinement.cases[v]);
            let step = 0.02 / results[fine].value("peak_amplitude_m").unwrap();
            let difference = found.differences[coarse][0].unwrap();
            assert!((difference - step).abs() < 1e-12, "{difference} {step}");
            assert_eq!(found.differences[fine], [Some(0.0)]);
        }
    }

    /// Loads are not designs: the minima at different forces are not compared with each other.
    #[test]
    fn the_least_is_said_for_each_load() {
        let (mut study, results) = designed();
        study.parameters[1].kind = Kind::Load;
        let found = analyse(&study, &results).designs.minima;
        let least = |m: &Minimum| m.least.clone().unwrap();
        let values: Vec<f64> = found.iter().map(|m| least(m).value).collect();
        assert_eq!(values.len(), 2);
        assert!((values[0] - 1.03).abs() < 1e-12 && (values[1] - 2.03).abs() < 1e-12);
        assert_eq!(found.iter().map(|m| m.at[1]).collect::<Vec<_>>(), [0, 1]);
        for minimum in &found {
            assert_eq!((minimum.cases, least(minimum).other_cases), (4, 1));
            assert!(least(minimum).at_ends.is_empty());
        }
        // One at a time designs are varied at the base of the loads alone.
        study.mode = Mode::OneAtATime;
        let all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| result(c, 1.0)).collect();
        let found = analyse(&study, &results).designs.minima;
        assert_eq!((found.len(), found[0].cases), (1, 4));
    }

    #[test]
    fn designs_alone_have_no_errors() {
        let (mut study, _) = designed();
        study.parameters.truncate(2);
        let all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| result(c, 1.0)).collect();
        let found = analyse(&study, &results);
        assert!(found.refinements.is_empty());
        // Nothing changes, and all cases have the least value.
        assert!(found.designs.changing.is_empty());
        let least = found.designs.minima[0].least.clone().unwrap();
        assert_eq!((least.case, least.other_cases), (0, 7));
    }
}
