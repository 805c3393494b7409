//! From the results of all cases to what a user wants to know: how each figure converges with each
//! numerical parameter, how far every case errs, which settings are recommended, and which design has the
//! least of a figure.

use serde::Serialize;

use super::cases::{Case, designs};
use super::convergence::{Limit, errors, estimates, limit, relative_error};
use super::designs::Designs;
use super::file::{Mode, Study, Target};
use super::parameter::Parameter;
use super::results::{CaseResult, headings};

/// Costs nearer to each other than this share are taken for equal: a run timed twice differs by as
/// much.
const SAME_COST: f64 = 0.1;

/// One numerical parameter, the others at their base (of a grid: at their finest).
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterAnswer {
    /// Which of the study's parameters.
    pub parameter: usize,
    /// Per value of the parameter, coarse to fine: the case that has it.
    pub cases: Vec<usize>,
    pub figures: Vec<FigureAnswer>,
}

/// How one figure follows one parameter; the lists have an entry per value, `None` where the case has no
/// such figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FigureAnswer {
    #[serde(rename = "figure")]
    pub heading: String,
    pub values: Vec<Option<f64>>,
    /// What the values lead to.
    pub limit: Option<Limit>,
    /// Relative differences from the limit.
    pub errors: Vec<Option<f64>>,
    /// What each value is taken to err: see [`estimates`].
    pub estimated_errors: Vec<Option<f64>>,
}

/// Errors of the cases of one design in one figure.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseErrors {
    pub heading: String,
    /// Per case of the study; `None` for those of other designs.
    pub errors: Vec<Option<f64>>,
    /// No other case costs and errs no more, and less in one of the two.
    pub on_pareto_front: Vec<bool>,
}

/// The settings for one figure and one accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct Recommendation {
    pub heading: String,
    pub accuracy: f64,
    /// Value of each parameter, and the sum of their errors; `None` where no sum is within the accuracy.
    pub settings: Option<(Vec<usize>, f64)>,
    /// The case that has these values.
    pub case: Option<usize>,
    /// The error of that case.
    pub error: Option<f64>,
}

/// What the numerical parameters do at one combination of design values.
#[derive(Debug, Clone, PartialEq)]
pub struct AtDesign {
    /// Value of each parameter; those of numerical ones say nothing.
    pub values: Vec<usize>,
    /// The numerical ones, in the order of the study's parameters.
    pub parameters: Vec<ParameterAnswer>,
    /// One for each heading of `with_errors` of the analysis.
    pub errors: Vec<CaseErrors>,
    pub recommendations: Vec<Recommendation>,
}

/// Everything.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    pub headings: Vec<String>,
    /// Of the figures whose errors are given: those that a recommendation is asked for, else the
    /// first. None where no parameter is numerical.
    pub with_errors: Vec<String>,
    /// Per design at which numerical parameters are turned; one without design values.
    pub at_designs: Vec<AtDesign>,
    pub designs: Designs,
}

/// The results of all cases, taken apart (recommended combinations may follow those of the study).
pub fn analyse(study: &Study, results: &[CaseResult]) -> Analysis {
    let headings = headings(study, results);
    let wanted = |t: &Target| {
        let own = headings.iter().filter(|h| t.quantity.has_heading(h));
        own.map(|h| (h.clone(), t.accuracy)).collect::<Vec<_>>()
    };
    let wanted: Vec<(String, f64)> = study.targets.iter().flat_map(wanted).collect();
    let has_errors = study.parameters.iter().any(|k| !k.is_design());
    let mut with_errors: Vec<String> = Vec::new();
    let first = headings.first().filter(|_| wanted.is_empty());
    let shown = wanted.iter().map(|(h, _)| h).chain(first);
    for heading in shown.filter(|_| has_errors) {
        if !with_errors.contains(heading) {
            with_errors.push(heading.clone());
        }
    }
    let at_designs = designs(study).into_iter().map(|design| {
        let base = base(study, results, &design);
        let numerical = (0..study.parameters.len()).filter(|k| !study.parameters[*k].is_design());
        let parameters: Vec<ParameterAnswer> = numerical
            .map(|k| parameter(study, results, &base, &headings, k))
            .collect();
        let errors = with_errors.iter().map(|heading| {
            let own = |r: &CaseResult| is_of_design(study, &r.case, &design);
            case_errors(results, &own, &base, &parameters, heading)
        });
        let errors: Vec<CaseErrors> = errors.collect();
        let recommendations = wanted
            .iter()
            .map(|wanted| recommendation(results, &design, &parameters, &errors, wanted));
        AtDesign {
            recommendations: recommendations.collect(),
            values: design,
            parameters,
            errors,
        }
    });
    Analysis {
        at_designs: at_designs.collect(),
        designs: Designs::of(study, results, &headings),
        with_errors,
        headings,
    }
}

fn is_of_design(study: &Study, case: &Case, design: &[usize]) -> bool {
    let mut parameters = study.parameters.iter().zip(&case.values).zip(design);
    parameters.all(|((parameter, value), wanted)| !parameter.is_design() || value == wanted)
}

impl Analysis {
    /// Recommended values that none of the cases has.
    pub fn not_run(&self) -> Vec<Vec<usize>> {
        let all = self.at_designs.iter().flat_map(|at| &at.recommendations);
        let without = all.filter(|r| r.case.is_none());
        let mut found: Vec<Vec<usize>> = Vec::new();
        for (values, _) in without.filter_map(|r| r.settings.as_ref()) {
            if !found.contains(values) {
                found.push(values.clone());
            }
        }
        found
    }

    /// Error of a case in a figure, given by its place in `with_errors`.
    pub fn error(&self, figure: usize, case: usize) -> Option<f64> {
        let mut all = self.at_designs.iter();
        all.find_map(|at| at.errors[figure].errors[case])
    }
}

/// What the numerical parameters are turned around at a design; of a grid, the finest case that has a
/// result.
fn base(study: &Study, results: &[CaseResult], design: &[usize]) -> Vec<usize> {
    let steps_from_finest = |case: &Case| -> usize {
        let parameters = study.parameters.iter().zip(&case.values);
        parameters
            .map(|(parameter, value)| parameter.values.len() - 1 - value)
            .sum()
    };
    let finest = results
        .iter()
        .filter(|r| study.mode == Mode::Grid && r.figures().is_some())
        .filter(|r| is_of_design(study, &r.case, design))
        .min_by_key(|r| steps_from_finest(&r.case));
    match finest {
        Some(finest) => finest.case.values.clone(),
        None => design.to_vec(),
    }
}

fn parameter(
    study: &Study,
    results: &[CaseResult],
    base: &[usize],
    headings: &[String],
    k: usize,
) -> ParameterAnswer {
    let parameter = &study.parameters[k];
    let mut values = base.to_vec();
    let case = |v: usize| {
        values[k] = v;
        // Every combination on an axis through the base is a case of the study.
        let found = results.iter().position(|r| r.case.values == values);
        found.unwrap_or_default()
    };
    let cases: Vec<usize> = (0..parameter.values.len()).map(case).collect();
    let figures = headings.iter().map(|heading| {
        let values = cases.iter().map(|c| results[*c].value(heading)).collect();
        let mut counts = study.quantities.iter().filter(|q| q.is_count);
        let is_count = counts.any(|q| q.has_heading(heading));
        figure(heading, values, parameter, is_count)
    });
    ParameterAnswer {
        parameter: k,
        figures: figures.collect(),
        cases,
    }
}

fn figure(
    heading: &str,
    values: Vec<Option<f64>>,
    parameter: &Parameter,
    is_count: bool,
) -> FigureAnswer {
    let there: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_some()).collect();
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    let sizes = parameter.sizes();
    let sizes: Option<Vec<f64>> = sizes.map(|s| there.iter().map(|i| s[*i]).collect());
    let limit = limit(sizes.as_deref(), &known, parameter.order, !is_count);
    let spread = |of_known: Vec<Option<f64>>| {
        let mut all = vec![None; values.len()];
        for (i, v) in there.iter().zip(of_known) {
            all[*i] = v;
        }
        all
    };
    FigureAnswer {
        heading: heading.to_owned(),
        limit,
        errors: spread(limit.map_or(Vec::new(), |l| errors(&known, &l))),
        estimated_errors: spread(limit.map_or(Vec::new(), |l| estimates(&known, &l))),
        values,
    }
}

impl ParameterAnswer {
    fn figure(&self, heading: &str) -> Option<&FigureAnswer> {
        self.figures.iter().find(|f| f.heading == heading)
    }

    /// What a value errs; a parameter of one value adds no error that it could know.
    fn error(&self, heading: &str, value: usize) -> Option<f64> {
        match self.cases.len() {
            1 => Some(0.0),
            _ => self.figure(heading)?.estimated_errors[value],
        }
    }

    /// The cheapest value that errs no more than this; of those as cheap, the one that errs least.
    fn cheapest_within(
        &self,
        results: &[CaseResult],
        heading: &str,
        most: f64,
    ) -> Option<(usize, f64)> {
        let within = self.cases.iter().enumerate().filter_map(|(value, case)| {
            let cost = results[*case].figures()?.cost.compared_s();
            let error = self.error(heading, value).filter(|e| *e <= most)?;
            Some((value, cost, error))
        });
        let within: Vec<(usize, f64, f64)> = within.collect();
        let least = within.iter().map(|w| w.1).reduce(f64::min)?;
        let cheap = within
            .into_iter()
            .filter(|w| w.1 <= least * (1.0 + SAME_COST));
        let best = cheap.min_by(|a, b| a.2.total_cmp(&b.2))?;
        Some((best.0, best.2))
    }
}

fn recommendation(
    results: &[CaseResult],
    design: &[usize],
    parameters: &[ParameterAnswer],
    errors: &[CaseErrors],
    (heading, accuracy): &(String, f64),
) -> Recommendation {
    let settings = settings(results, design, parameters, heading, *accuracy);
    let case = settings
        .as_ref()
        .and_then(|(values, _)| results.iter().position(|r| r.case.values == *values));
    let of_heading = errors.iter().find(|e| e.heading == *heading);
    Recommendation {
        error: case.and_then(|c| of_heading?.errors[c]),
        heading: heading.clone(),
        accuracy: *accuracy,
        settings,
        case,
    }
}

/// Of each numerical parameter the cheapest value within the accuracy, or within a half, a third, ... of
/// it: the first such share with which the errors add up to no more than the accuracy. The others
/// have the values of the design.
fn settings(
    results: &[CaseResult],
    design: &[usize],
    parameters: &[ParameterAnswer],
    heading: &str,
    accuracy: f64,
) -> Option<(Vec<usize>, f64)> {
    (1..=parameters.len()).find_map(|share| {
        let most = accuracy / share as f64;
        let chosen = parameters
            .iter()
            .map(|k| k.cheapest_within(results, heading, most));
        let chosen: Vec<(usize, f64)> = chosen.collect::<Option<_>>()?;
        let mut values = design.to_vec();
        for (parameter, (value, _)) in parameters.iter().zip(&chosen) {
            values[parameter.parameter] = *value;
        }
        let sum = chosen.iter().map(|(_, error)| error).sum();
        (sum <= accuracy).then_some((values, sum))
    })
}

/// Where the base goes when each parameter goes to its own limit: their changes added.
fn common_limit(
    results: &[CaseResult],
    base: &[usize],
    parameters: &[ParameterAnswer],
    heading: &str,
) -> Option<f64> {
    let at_base = results.iter().find(|r| r.case.values == base)?;
    let at_base = at_base.value(heading)?;
    parameters.iter().try_fold(at_base, |sum, parameter| {
        Some(sum + parameter.figure(heading)?.limit?.value - at_base)
    })
}

/// A case errs by the sum of what its values err (nothing is gained by errors that cancel), and by
/// no less than its difference from the common limit (errors need not add up). Cases that are not
/// its `own` are of other designs.
fn case_errors(
    results: &[CaseResult],
    own: &dyn Fn(&CaseResult) -> bool,
    base: &[usize],
    parameters: &[ParameterAnswer],
    heading: &str,
) -> CaseErrors {
    let limit = common_limit(results, base, parameters, heading);
    let error = |result: &CaseResult| {
        let of_parameter = |k: &ParameterAnswer| k.error(heading, result.case.values[k.parameter]);
        let sum = own(result).then_some(0.0)?;
        let sum = parameters
            .iter()
            .try_fold(sum, |sum, k| Some(sum + of_parameter(k)?))?;
        Some(relative_error(result.value(heading)?, limit?)?.max(sum))
    };
    let errors: Vec<Option<f64>> = results.iter().map(error).collect();
    let costs = results
        .iter()
        .map(|r| r.figures().map_or(f64::INFINITY, |f| f.cost.compared_s()));
    let points: Vec<(f64, Option<f64>)> = costs.zip(errors.iter().copied()).collect();
    CaseErrors {
        heading: heading.to_owned(),
        on_pareto_front: pareto_front(&points),
        errors,
    }
}

/// Which of the points (cost, error) no other beats. A point without error is on no front.
fn pareto_front(points: &[(f64, Option<f64>)]) -> Vec<bool> {
    let beaten = |cost: f64, error: f64| {
        let others = points.iter().filter_map(|&(c, e)| Some((c, e?)));
        let mut no_worse = others.filter(|&(c, e)| c <= cost && e <= error);
        no_worse.any(|(c, e)| c < cost || e < error)
    };
    points
        .iter()
        .map(|&(cost, error)| error.is_some_and(|error| !beaten(cost, error)))
        .collect()
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::study::cases::{cases, combination};
    use crate::study::parameter::{Kind, ParameterValue};
    use crate::study::quantity::PEAK_AMPLITUDE;
    use crate::study::results::{Cost, Ended, Figures};

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
            order: 2.0,
            span: 0..0,
        }
    }

    /// The figure is 1 + 2 a^2 + 0.5 b, the cost 1 / a + 0.1 / (a b).
    pub fn study(mode: Mode, accuracy: f64) -> Study {
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
            targets: vec![Target {
                quantity: PEAK_AMPLITUDE,
                accuracy,
            }],
            minimise: vec![],
        }
    }

    fn of_sizes(study: &Study, case: &Case) -> CaseResult {
        let size = |k: usize| study.parameters[k].values[case.values[k]].size.unwrap();
        let (a, b) = (size(0), size(1));
        let amplitude_m = 1.0 + 2.0 * a * a + 0.5 * b;
        result(case, amplitude_m, 1.0 / a + 0.1 / (a * b))
    }

    pub fn result(case: &Case, amplitude_m: f64, processor_seconds: f64) -> CaseResult {
        CaseResult {
            case: case.clone(),
            ended: Ended::WithFigures(Figures {
                values: vec![(PEAK_AMPLITUDE.word.to_owned(), amplitude_m)],
                cost: Cost {
                    processor_seconds: Some(processor_seconds),
                    ..Cost::default()
                },
                points: 3,
                ..Figures::default()
            }),
        }
    }

    fn near(found: Option<f64>, wanted: f64) {
        let found = found.unwrap();
        assert!((found - wanted).abs() < 1e-9, "{found} is not {wanted}");
    }

    fn set_value(result: &mut CaseResult, value: f64) {
        let Ended::WithFigures(figures) = &mut result.ended else {
            panic!("no figures");
        };
        figures.values[0].1 = value;
    }

    #[test]
    fn a_known_function_is_taken_apart_and_put_together() {
        let study = study(Mode::OneAtATime, 0.05);
        let mut all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| of_sizes(&study, c)).collect();
        let found = analyse(&study, &results);
        // Along a, b is 0.1: to 1.05 with order 2; along b, a is 0.2: to 1.08 with order 1.
        let [a, b] = [0, 1].map(|k| &found.at_designs[0].parameters[k].figures[0]);
        near(a.limit.unwrap().order, 2.0);
        near(Some(a.limit.unwrap().value), 1.05);
        near(b.limit.unwrap().order, 1.0);
        near(a.errors[0], 0.32 / 1.05);
        near(b.estimated_errors[0], 0.1 / 1.08);
        // The base errs by both: by 0.13 of the common limit, which is 1.
        near(found.at_designs[0].errors[0].errors[0], 0.13);
        // Within 5 % of each parameter are a = 0.1 and b = 0.1, which together err by more: within 2.5 %
        // are a = 0.1 and b = 0.05.
        let recommended = &found.at_designs[0].recommendations[0];
        let (values, sum) = recommended.settings.clone().unwrap();
        assert_eq!((&values, recommended.case), (&vec![2, 2], None));
        near(Some(sum), 0.02 / 1.05 + 0.025 / 1.08);
        assert_eq!(found.not_run(), std::slice::from_ref(&values));
        // Run, its error is the worse of the sum and the difference from the common limit, 1.
        all.push(combination(&study, &all, values));
        let mut results: Vec<CaseResult> = all.iter().map(|c| of_sizes(&study, c)).collect();
        let found = analyse(&study, &results);
        assert_eq!(found.at_designs[0].recommendations[0].case, Some(7));
        near(found.at_designs[0].recommendations[0].error, 0.02 + 0.025);
        assert!(found.at_designs[0].errors[0].on_pareto_front[7] && found.not_run().is_empty());
        // Where errors do not add up, the difference says so.
        set_value(&mut results[7], 1.2);
        near(
            analyse(&study, &results).at_designs[0].recommendations[0].error,
            0.2,
        );
    }

    #[test]
    fn an_accuracy_out_of_reach_has_no_recommendation() {
        let study = study(Mode::OneAtATime, 1e-3);
        let results: Vec<CaseResult> = cases(&study).iter().map(|c| of_sizes(&study, c)).collect();
        let found = analyse(&study, &results);
        let recommended = &found.at_designs[0].recommendations[0];
        assert_eq!((&recommended.settings, recommended.case), (&None, None));
        assert!(found.not_run().is_empty());
    }

    #[test]
    fn of_values_as_cheap_the_one_that_errs_least_is_taken() {
        let study = study(Mode::OneAtATime, 0.9);
        let mut results: Vec<CaseResult> =
            cases(&study).iter().map(|c| of_sizes(&study, c)).collect();
        for (result, seconds) in results
            .iter_mut()
            .zip([10.0, 10.5, 10.9, 11.1, 9.0, 9.5, 12.0])
        {
            let Ended::WithFigures(figures) = &mut result.ended else {
                panic!("no figures");
            };
            figures.cost.processor_seconds = Some(seconds);
        }
        // Cases are the base (a 0.2, b 0.1), a 0.4, 0.1, 0.05, then b 0.2, 0.05, 0.025.
        let recommended = &analyse(&study, &results).at_designs[0].recommendations[0];
        assert_eq!(recommended.settings.as_ref().unwrap().0, [2, 2]);
    }

    #[test]
    fn a_grid_recommends_one_of_its_cases() {
        let study = study(Mode::Grid, 0.05);
        let all = cases(&study);
        let mut results: Vec<CaseResult> = all.iter().map(|c| of_sizes(&study, c)).collect();
        let found = analyse(&study, &results);
        let chosen = found.at_designs[0].recommendations[0].case.unwrap();
        // Along each parameter the other is at its finest; a = 0.1 and b = 0.05 are each within 2.5 %.
        assert_eq!(all[chosen].values, [2, 2]);
        near(found.at_designs[0].errors[0].errors[chosen], 0.02 + 0.025);
        // A coarse run near the limit by chance gains nothing.
        set_value(&mut results[0], 1.0);
        let errors = &analyse(&study, &results).at_designs[0].errors[0].errors;
        near(errors[0], 0.32 / 1.0125 + 0.1 / 1.005);
        // Without the finest corner the finest there is serves.
        results[15].ended = Ended::NotRun;
        let found = analyse(&study, &results);
        assert_eq!(found.at_designs[0].parameters[0].cases, [3, 7, 11, 15]);
        near(
            found.at_designs[0].parameters[1].figures[0]
                .limit
                .map(|l| l.value),
            1.02,
        );
    }

    #[test]
    fn a_case_without_result_is_left_out_of_the_series() {
        let study = study(Mode::OneAtATime, 0.05);
        let mut results: Vec<CaseResult> =
            cases(&study).iter().map(|c| of_sizes(&study, c)).collect();
        results[1].ended = Ended::NotRun;
        let found = analyse(&study, &results);
        let a = &found.at_designs[0].parameters[0].figures[0];
        assert_eq!((a.values[0], a.estimated_errors[0]), (None, None));
        near(Some(a.limit.unwrap().value), 1.05);
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            (1.0, Some(0.5)),
            (2.0, Some(0.1)),
            (2.5, Some(0.2)),
            (3.0, Some(0.1)),
            (9.0, Some(0.01)),
            (0.1, None),
        ];
        let expected = [true, true, false, false, true, false];
        assert_eq!(pareto_front(&points), expected);
        // The same twice: neither beats the other.
        assert_eq!(pareto_front(&[(1.0, Some(0.1)); 2]), [true, true]);
    }
}
