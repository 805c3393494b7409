//! Analysis of the results of all cases: how each figure converges with each numerical parameter,
//! how far every case is from the finest, and which design has the smallest value of a figure.

use serde::Serialize;

use super::cases::designs;
use super::convergence::{Limit, estimates, limit, relative_error};
use super::designs::Designs;
use super::file::{Mode, Study};
use super::parameter::Parameter;
use super::quantity::Figure;
use super::results::{CaseResult, figures};

/// Analysis of the results of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    pub figures: Vec<Figure>,
    /// Relative difference of each figure of each case from the finest case; `None` if there is no
    /// finest case or no such figure.
    pub differences: Vec<Vec<Option<f64>>>,
    pub refinements: Vec<Refinement>,
    pub designs: Designs,
}

/// One numerical parameter through its values, while the others stay at their base (in a grid at
/// their finest value).
#[derive(Debug, Clone, PartialEq)]
pub struct Refinement {
    /// Position of the parameter among those of the study.
    pub parameter: usize,
    /// Positions of the values of the other parameters.
    pub at: Vec<usize>,
    /// Case of each value, from coarse to fine.
    pub cases: Vec<usize>,
    /// Convergence of each figure, in the order of the figures of the analysis.
    pub figures: Vec<Refined>,
}

/// Dependence of one figure on a numerical parameter. The lists have an entry for each value,
/// `None` if the case has no such figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refined {
    pub figure: String,
    pub values: Vec<Option<f64>>,
    /// Relative differences from the finest value.
    pub differences: Vec<Option<f64>>,
    /// Estimated error of each value: see [`estimates`].
    pub estimated_errors: Vec<Option<f64>>,
    /// Limit of the values.
    pub limit: Option<Limit>,
}

/// Analyses the results of all cases.
pub fn analyse(study: &Study, results: &[CaseResult]) -> Analysis {
    let figures = figures(study, results);
    let of_case = |result: &CaseResult| {
        let finest = finest(study, results, &result.case.values);
        let of_figure = |f: &Figure| difference(results, result, &finest, &f.heading);
        figures.iter().map(of_figure).collect()
    };
    let mut refinements = Vec::new();
    for design in designs(study) {
        let at = centre(study, results, &design);
        for k in (0..at.len()).filter(|k| study.parameters[*k].is_numerical()) {
            refinements.push(refinement(study, results, &at, &figures, k));
        }
    }
    Analysis {
        differences: results.iter().map(of_case).collect(),
        designs: Designs::of(study, results, &figures),
        refinements,
        figures,
    }
}

fn case_of(results: &[CaseResult], values: &[usize]) -> Option<usize> {
    results.iter().position(|r| r.case.values == values)
}

/// Returns `true` if two cases differ in numerical parameters only.
fn is_same_design(study: &Study, a: &[usize], b: &[usize]) -> bool {
    let mut parameters = study.parameters.iter().zip(a.iter().zip(b));
    parameters.all(|(p, (a, b))| p.is_numerical() || a == b)
}

/// Values around which numerical parameters are varied at a design: one at a time those of the
/// base, in a grid those of the finest case that has a result.
fn centre(study: &Study, results: &[CaseResult], design: &[usize]) -> Vec<usize> {
    let steps_from_finest = |r: &&CaseResult| -> usize {
        let parameters = study.parameters.iter().zip(&r.case.values);
        parameters.map(|(p, v)| p.values.len() - 1 - v).sum()
    };
    let finest = results
        .iter()
        .filter(|r| study.mode == Mode::Grid && r.figures().is_some())
        .filter(|r| is_same_design(study, &r.case.values, design))
        .min_by_key(steps_from_finest);
    finest.map_or(design.to_vec(), |f| f.case.values.clone())
}

/// Cases that a case is compared with. In a grid this is the finest case of its design. One at a
/// time it is the case with the finest value of the varied parameter; the base is compared with
/// that of each parameter.
fn finest(study: &Study, results: &[CaseResult], values: &[usize]) -> Vec<usize> {
    let mut designs = designs(study).into_iter();
    let Some(design) = designs.find(|design| is_same_design(study, design, values)) else {
        return Vec::new();
    };
    if study.mode == Mode::Grid {
        return Vec::from_iter(case_of(results, &centre(study, results, &design)));
    }
    let numerical = study.parameters.iter().enumerate();
    let numerical = numerical.filter(|(_, p)| p.is_numerical());
    let along = numerical.filter_map(|(k, parameter)| {
        let mut finest = values.to_vec();
        finest[k] = parameter.values.len() - 1;
        case_of(results, &finest)
    });
    along.collect()
}

/// Largest of the differences from these cases.
fn difference(
    results: &[CaseResult],
    result: &CaseResult,
    finest: &[usize],
    heading: &str,
) -> Option<f64> {
    let value = result.value(heading)?;
    let others = finest.iter().filter_map(|c| results[*c].value(heading));
    let differences = others.filter_map(|other| relative_error(value, other));
    differences.reduce(f64::max)
}

fn refinement(
    study: &Study,
    results: &[CaseResult],
    at: &[usize],
    figures: &[Figure],
    k: usize,
) -> Refinement {
    let parameter = &study.parameters[k];
    let mut values = at.to_vec();
    let case = |v: usize| {
        values[k] = v;
        // Every combination on an axis through the centre is a case of the study.
        case_of(results, &values).unwrap_or_default()
    };
    let cases: Vec<usize> = (0..parameter.values.len()).map(case).collect();
    let refined = figures.iter().map(|figure| {
        let values = cases.iter().map(|c| results[*c].value(&figure.heading));
        refined(figure, values.collect(), parameter)
    });
    Refinement {
        parameter: k,
        at: at.to_vec(),
        figures: refined.collect(),
        cases,
    }
}

fn refined(figure: &Figure, values: Vec<Option<f64>>, parameter: &Parameter) -> Refined {
    let there: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_some()).collect();
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    let sizes = parameter.sizes();
    let sizes: Option<Vec<f64>> = sizes.map(|s| there.iter().map(|i| s[*i]).collect());
    let limit = limit(
        sizes.as_deref(),
        &known,
        parameter.order,
        !figure.is_count(),
    );
    let mut estimated_errors = vec![None; values.len()];
    let estimates = limit.map_or(Vec::new(), |limit| estimates(&known, &limit));
    for (i, error) in there.iter().zip(estimates) {
        estimated_errors[*i] = error;
    }
    let difference = |v: &Option<f64>| relative_error((*v)?, *known.last()?);
    Refined {
        figure: figure.heading.clone(),
        differences: values.iter().map(difference).collect(),
        values,
        estimated_errors,
        limit,
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::study::cases::{Case, cases};
    use crate::study::parameter::{Kind, ParameterValue};
    use crate::study::quantity::tests::PEAK_AMPLITUDE;
    use crate::study::results::{Ended, Figures};

    pub fn sized(name: &str, sizes: &[f64], base: usize) -> Parameter {
        let value = |size: &f64| ParameterValue {
            label: size.to_string(),
            set: vec![],
            number: Some(*size),
            size: Some(*size),
            span: 0..0,
        };
        Parameter {
            name: name.to_owned(),
            kind: Kind::Numerical,
            values: sizes.iter().map(value).collect(),
            base,
            size_name: "size".into(),
            order: 2.0,
            span: 0..0,
        }
    }

    /// Study whose figure is 1 + 2 a^2 + 0.5 b.
    pub fn study(mode: Mode) -> Study {
        Study {
            name: "s".into(),
            scene: "x".into(),
            set: vec![],
            mode,
            quantities: vec![PEAK_AMPLITUDE],
            fields: false,
            parameters: vec![
                sized("a", &[0.4, 0.2, 0.1, 0.05], 1),
                sized("b", &[0.2, 0.1, 0.05, 0.025], 1),
            ],
            minimise: vec![],
        }
    }

    fn of_sizes(study: &Study) -> Vec<CaseResult> {
        let result = |case: &Case| {
            let size = |k: usize| study.parameters[k].values[case.values[k]].size.unwrap();
            let (a, b) = (size(0), size(1));
            result(case, 1.0 + 2.0 * a * a + 0.5 * b)
        };
        cases(study).iter().map(result).collect()
    }

    pub fn result(case: &Case, amplitude_m: f64) -> CaseResult {
        let figure = Figure {
            quantity: PEAK_AMPLITUDE,
            heading: PEAK_AMPLITUDE.word.to_owned(),
            name: "peak amplitude of tip".to_owned(),
        };
        CaseResult {
            case: case.clone(),
            ended: Ended::WithFigures(Figures {
                values: vec![(figure, amplitude_m)],
                points: 3,
                ..Figures::default()
            }),
        }
    }

    fn near(found: Option<f64>, wanted: f64) {
        let found = found.unwrap();
        assert!((found - wanted).abs() < 1e-9, "{found} is not {wanted}");
    }

    #[test]
    fn a_known_function_is_taken_apart() {
        let study = study(Mode::OneAtATime);
        let found = analyse(&study, &of_sizes(&study));
        // Along a, b is 0.1: to 1.05 with order 2; along b, a is 0.2: to 1.08 with order 1.
        let [a, b] = [0, 1].map(|k| &found.refinements[k].figures[0]);
        near(a.limit.unwrap().order, 2.0);
        near(Some(a.limit.unwrap().value), 1.05);
        near(b.limit.unwrap().order, 1.0);
        near(a.estimated_errors[0], 0.32 / 1.05);
        near(a.estimated_errors[3], 0.005 / 1.05);
        near(b.estimated_errors[0], 0.1 / 1.08);
        // From the finest values, which are 1.055 and 1.0925.
        near(a.differences[0], 0.315 / 1.055);
        near(b.differences[0], 0.0875 / 1.0925);
        // Cases are the base (a 0.2, b 0.1), a 0.4, 0.1, 0.05, then b 0.2, 0.05, 0.025. The base is
        // compared with the finest value of each parameter, and farther from that of a.
        near(found.differences[0][0], 0.075 / 1.055);
        near(found.differences[1][0], 0.315 / 1.055);
        near(found.differences[3][0], 0.0);
        near(found.differences[4][0], 0.0875 / 1.0925);
    }

    #[test]
    fn cases_of_a_grid_are_compared_with_the_finest_that_there_is() {
        let study = study(Mode::Grid);
        let mut results = of_sizes(&study);
        let found = analyse(&study, &results);
        // Along each parameter the other is at its finest.
        assert_eq!(found.refinements[0].cases, [3, 7, 11, 15]);
        near(found.differences[0][0], (1.42 - 1.0175) / 1.0175);
        near(found.differences[15][0], 0.0);
        // Without the finest corner the finest that there is serves: a 0.1, b 0.025.
        results[15].ended = Ended::NotRun;
        let found = analyse(&study, &results);
        assert_eq!(found.refinements[0].cases, [3, 7, 11, 15]);
        let b = &found.refinements[1];
        near(b.figures[0].limit.map(|l| l.value), 1.02);
        near(found.differences[0][0], (1.42 - 1.0325) / 1.0325);
        assert_eq!(found.differences[15][0], None);
    }

    #[test]
    fn a_case_without_result_is_left_out_of_the_series() {
        let study = study(Mode::OneAtATime);
        let mut results = of_sizes(&study);
        results[1].ended = Ended::NotRun;
        let found = analyse(&study, &results);
        let a = &found.refinements[0].figures[0];
        assert_eq!((a.values[0], a.estimated_errors[0]), (None, None));
        near(Some(a.limit.unwrap().value), 1.05);
    }
}
