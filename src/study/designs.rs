//! Comparison of designs, the cases that differ only in design values and loads: the figures that
//! change among them, and the case with the smallest value of a figure at each load.

use super::convergence::SAME;
use super::file::{Mode, Study};
use super::parameter::{Kind, Parameter};
use super::quantity::Figure;
use super::results::Runs;

/// Smallest value of a figure among the designs at one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    pub heading: String,
    /// Compared cases, which have one load.
    pub cases: Vec<usize>,
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
    /// Names of the parameters of which the case has the smallest or the largest number, with
    /// `lowest` or `highest`.
    pub at_ends: Vec<(String, &'static str)>,
}

/// Position of the value of each parameter around which designs are varied: its base or, for a
/// numerical parameter in a grid, its finest value.
pub fn centre(study: &Study) -> Vec<usize> {
    let value = |p: &Parameter| match (study.mode, p.kind) {
        (Mode::Grid, Kind::Numerical) => p.last(),
        _ => p.base,
    };
    study.parameters.iter().map(value).collect()
}

/// Compared cases; empty without design values and loads.
fn compared(runs: Runs<'_>) -> Vec<usize> {
    let centre = centre(runs.study);
    let is_compared = |case: &usize| {
        let mut chosen = runs.chosen(*case).zip(&centre);
        chosen.all(|((p, value), centre)| !p.is_numerical() || value == *centre)
    };
    let has_designs = runs.study.parameters.iter().any(|p| !p.is_numerical());
    let all = 0..runs.results.len() * usize::from(has_designs);
    all.filter(is_compared).collect()
}

/// Figures that differ among the designs.
pub fn changing(runs: Runs<'_>, figures: &[Figure]) -> Vec<Figure> {
    let cases = compared(runs);
    let changes = |figure: &&Figure| {
        let values = cases.iter().filter_map(|c| runs.value(*c, &figure.heading));
        let values: Vec<f64> = values.collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - low > SAME * high.abs().max(low.abs())
    };
    figures.iter().filter(changes).cloned().collect()
}

/// Smallest value of each figure to be minimised, at each load.
pub fn minima(runs: Runs<'_>, figures: &[Figure]) -> Vec<Minimum> {
    let cases = compared(runs);
    let mut minima = Vec::new();
    for quantity in &runs.study.minimise {
        let own = figures.iter().filter(|f| f.quantity == *quantity);
        let mut own: Vec<&str> = own.map(|f| f.heading.as_str()).collect();
        if own.is_empty() {
            own.push(quantity.word);
        }
        for heading in own {
            let at_loads = runs.groups(&cases, &[Kind::Load]).into_iter();
            minima.extend(at_loads.map(|cases| minimum(runs, cases, heading)));
        }
    }
    minima
}

fn minimum(runs: Runs<'_>, cases: Vec<usize>, heading: &str) -> Minimum {
    let value = |case: &usize| {
        let mut values = runs.results[*case].figures()?.values.iter();
        let (figure, value) = values.find(|(f, _)| f.heading == heading)?;
        Some((*case, figure, *value))
    };
    let values: Vec<(usize, &Figure, f64)> = cases.iter().filter_map(value).collect();
    let least = values.iter().min_by(|a, b| a.2.total_cmp(&b.2));
    let end = |(p, value): (&Parameter, usize)| {
        let has_ends = p.kind == Kind::Design && p.last() > 0 && p.numbers().is_some();
        let end = match value {
            0 => "lowest",
            v if v == p.last() => "highest",
            _ => return None,
        };
        has_ends.then(|| (p.name.clone(), end))
    };
    let least = least.map(|&(case, figure, value)| Least {
        figure: figure.clone(),
        case,
        value,
        at_ends: runs.chosen(case).filter_map(end).collect(),
    });
    Minimum {
        heading: heading.to_owned(),
        cases_without: cases.len() - values.len(),
        cases,
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
    use crate::study::results::{CaseResult, Ended};

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
        let found = analyse(&study, &results);
        assert_eq!(found.minima[0].cases.len(), 8);
        assert_eq!(found.changing.len(), 1);
        let least = found.minima[0].least.clone().unwrap();
        // x = 0.2 and x = 0.4 are as near to 0.3; y is at its end, x is not.
        assert_eq!(results[least.case].case.values, [1, 0, 1]);
        assert!((least.value - (0.01 + 1.0 + 0.02)).abs() < 1e-12);
        assert_eq!(least.at_ends, [("y".to_owned(), "lowest")]);
        assert_eq!(found.minima[0].cases_without, 0);
    }

    #[test]
    fn what_has_no_value_or_no_order_is_said_and_not_taken_for_an_end() {
        let (mut study, mut results) = designed();
        for value in &mut study.parameters[1].values {
            value.number = None;
        }
        let first = analyse(&study, &results).minima[0].least.clone();
        results[first.unwrap().case].ended = Ended::NotRun;
        let found = analyse(&study, &results).minima.remove(0);
        assert_eq!(found.cases_without, 1);
        let least = found.least.unwrap();
        assert_eq!(results[least.case].case.values, [2, 0, 1]);
        assert!(least.at_ends.is_empty());
        for result in &mut results {
            result.ended = Ended::NotRun;
        }
        let found = analyse(&study, &results).minima.remove(0);
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
        let found = analyse(&study, &results).minima;
        let least = |m: &Minimum| m.least.clone().unwrap();
        let values: Vec<f64> = found.iter().map(|m| least(m).value).collect();
        assert_eq!(values.len(), 2);
        assert!((values[0] - 1.03).abs() < 1e-12 && (values[1] - 2.03).abs() < 1e-12);
        for minimum in &found {
            assert_eq!(minimum.cases.len(), 4);
            assert!(least(minimum).at_ends.is_empty());
        }
        // One at a time designs are varied at the base of the loads alone.
        study.mode = Mode::OneAtATime;
        let all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| result(c, 1.0)).collect();
        let found = analyse(&study, &results).minima;
        assert_eq!((found.len(), found[0].cases.len()), (1, 4));
    }

    #[test]
    fn designs_alone_have_no_errors() {
        let (mut study, _) = designed();
        study.parameters.truncate(2);
        let all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| result(c, 1.0)).collect();
        let found = analyse(&study, &results);
        assert!(found.refinements.is_empty());
        // Nothing changes: the first case stands for all.
        assert!(found.changing.is_empty());
        assert_eq!(found.minima[0].least.clone().unwrap().case, 0);
    }
}
