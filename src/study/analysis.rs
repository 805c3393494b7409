//! Analysis of the results of all cases: how each figure converges with each numerical parameter,
//! how far every case is from the finest, and which figures change with the physical parameters.

use serde::Serialize;

use super::convergence::{Limit, SAME, estimates, limit, relative_error};
use super::results::CaseResult;
use crate::study_file::Study;
use crate::study_file::keys::{CombinationMode, ParameterKind};
use crate::study_file::parameter::{Parameter, ParameterValue};
use crate::study_file::quantity::Figure;
use dovetail_export::plots::ends;

/// Results of a study and their analysis.
#[derive(Debug, Clone)]
pub struct Analysis<'s> {
    pub study: &'s Study,
    pub results: &'s [CaseResult],
    /// Figures of the cases, in the order of the quantities of the study.
    pub figures: Vec<Figure>,
    /// Relative difference of each figure of each case from the finest case; `None` if there is no
    /// finest case or no such figure.
    pub differences: Vec<Vec<Option<f64>>>,
    pub refinements: Vec<ParameterRefinement>,
    /// Figures that change with the physical parameters.
    pub changing: Vec<Figure>,
}

/// One numerical parameter through its values, while the others stay at their base (in a grid at
/// their finest value).
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterRefinement {
    /// Position of the parameter among those of the study.
    pub parameter: usize,
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
pub fn analyse<'s>(study: &'s Study, results: &'s [CaseResult]) -> Analysis<'s> {
    let figures = figures(study, results);
    let mut analysis = Analysis {
        study,
        results,
        differences: vec![vec![None; figures.len()]; results.len()],
        figures,
        refinements: Vec::new(),
        changing: Vec::new(),
    };
    analysis.changing = analysis.changing();
    analysis.refine();
    analysis
}

/// Figures of the cases, in the order of the quantities of the study.
fn figures(study: &Study, results: &[CaseResult]) -> Vec<Figure> {
    let mut all_figures: Vec<Figure> = Vec::new();
    for quantity in &study.quantities {
        let values = results.iter().filter_map(CaseResult::figures);
        for (figure, _) in values.flat_map(|f| &f.values) {
            let is_known = all_figures
                .iter()
                .any(|known| known.heading == figure.heading);
            if figure.quantity == *quantity && !is_known {
                all_figures.push(figure.clone());
            }
        }
    }
    all_figures
}

impl Analysis<'_> {
    /// Cases in groups that have the same values of the physical parameters. One at a time there is
    /// only the group of the base, as nothing is varied elsewhere.
    fn designs(&self) -> Vec<Vec<usize>> {
        let mut designs: Vec<(Vec<&ParameterValue>, Vec<usize>)> = Vec::new();
        for (case, result) in self.results.iter().enumerate() {
            let physical = self.study.physical(&result.case.values);
            let physical: Vec<_> = physical.map(|(_, v)| v).collect();
            match designs.iter_mut().find(|(known, _)| *known == physical) {
                Some((_, design)) => design.push(case),
                None => designs.push((physical, vec![case])),
            }
        }
        // The base is the first case.
        if self.study.mode == CombinationMode::OneAtATime {
            designs.truncate(1);
        }
        designs.into_iter().map(|(_, design)| design).collect()
    }

    /// Refines each numerical parameter at each design.
    fn refine(&mut self) {
        let (study, results) = (self.study, self.results);
        let numerical = (0..study.parameters.len())
            .filter(|k| study.parameters[*k].kind == ParameterKind::Numerical);
        let numerical: Vec<usize> = numerical.collect();
        if numerical.is_empty() {
            return;
        }
        for design in self.designs() {
            let centre = self.centre(&design);
            let axes = numerical.iter().map(|k| self.axis(&design, centre, *k));
            let axes: Vec<Vec<usize>> = axes.collect();
            for case in design {
                let of_axes = axes.iter().filter(|axis| axis.contains(&case));
                let finest: Vec<usize> = match study.mode {
                    CombinationMode::Grid => vec![centre],
                    CombinationMode::OneAtATime => {
                        of_axes.map(|axis| axis[axis.len() - 1]).collect()
                    }
                };
                let figures = self.figures.iter();
                let differences = figures.map(|f| self.difference(case, &finest, &f.heading));
                self.differences[case] = differences.collect();
            }
            for (&parameter, cases) in numerical.iter().zip(axes) {
                let refined = |f: &Figure| {
                    let values = cases.iter().map(|c| results[*c].value(&f.heading));
                    refined(f, values.collect(), &study.parameters[parameter])
                };
                self.refinements.push(ParameterRefinement {
                    parameter,
                    figures: self.figures.iter().map(refined).collect(),
                    cases,
                });
            }
        }
    }

    /// Case around which numerical parameters are varied at a design: one at a time the base, in a
    /// grid the finest case that has a result.
    fn centre(&self, design: &[usize]) -> usize {
        let steps_from_finest = |case: &usize| -> usize {
            let chosen = self.study.parameters.iter();
            let chosen = chosen.zip(&self.results[*case].case.values);
            chosen.map(|(p, v)| p.last() - v).sum()
        };
        let has_result = |case: &usize| self.results[*case].figures().is_some();
        let cases = design.iter().copied();
        let centres =
            cases.filter(|case| self.study.mode == CombinationMode::Grid && has_result(case));
        centres.min_by_key(steps_from_finest).unwrap_or(design[0])
    }

    /// Cases of a design through the values of parameter `k`, with the others as in the centre.
    fn axis(&self, design: &[usize], centre: usize, k: usize) -> Vec<usize> {
        let mut values = self.results[centre].case.values.clone();
        let case = |v: usize| {
            values[k] = v;
            let mut cases = design.iter().copied();
            cases.find(|case| self.results[*case].case.values == values)
        };
        let count = self.study.parameters[k].values.len();
        (0..count).filter_map(case).collect()
    }

    /// Largest of the differences of a case from these cases.
    fn difference(&self, case: usize, finest: &[usize], heading: &str) -> Option<f64> {
        let value = |case: &usize| self.results[*case].value(heading);
        let case_value = value(&case)?;
        let differences = finest.iter().filter_map(value);
        let differences = differences.filter_map(|other| relative_error(case_value, other));
        differences.reduce(f64::max)
    }

    /// Figures that differ among the cases whose numerical parameters are at their centre; none
    /// without physical parameters.
    fn changing(&self) -> Vec<Figure> {
        let centre = self.study.centre();
        let is_compared = |result: &&CaseResult| {
            let chosen = self.study.chosen(&result.case.values);
            let mut both = chosen.zip(self.study.chosen(&centre));
            both.all(|((p, value), (_, centre))| {
                p.kind == ParameterKind::Physical || value == centre
            })
        };
        let compared: Vec<_> = self.results.iter().filter(is_compared).collect();
        let changes = |figure: &&Figure| {
            let [low, high] = ends(compared.iter().filter_map(|r| r.value(&figure.heading)));
            high - low > SAME * high.abs().max(low.abs())
        };
        self.figures.iter().filter(changes).cloned().collect()
    }
}

fn refined(figure: &Figure, values: Vec<Option<f64>>, parameter: &Parameter) -> Refined {
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    let of_known = |sizes: Vec<f64>| {
        let sizes = sizes.into_iter().zip(&values);
        sizes.filter_map(|(size, v)| v.map(|_| size)).collect()
    };
    let sizes: Option<Vec<f64>> = parameter.sizes().map(of_known);
    let is_extrapolated = !figure.is_count();
    let limit = limit(sizes.as_deref(), &known, parameter.order, is_extrapolated);
    let mut errors = limit.iter().flat_map(|limit| estimates(&known, limit));
    let estimated_errors = values.iter().map(|v| v.and_then(|_| errors.next()?));
    let estimated_errors = estimated_errors.collect();
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
    use crate::study::results::{CaseEnd, CaseFigures};
    use crate::study_file::quantity::tests::PEAK_AMPLITUDE;

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
            kind: ParameterKind::Numerical,
            values: sizes.iter().map(value).collect(),
            base,
            size_name: "size".into(),
            order: 2.0,
            span: 0..0,
        }
    }

    /// Study whose figure is 1 + 2 a^2 + 0.5 b.
    pub fn study(mode: CombinationMode) -> Study {
        Study {
            mode,
            quantities: vec![PEAK_AMPLITUDE],
            parameters: vec![
                sized("a", &[0.4, 0.2, 0.1, 0.05], 1),
                sized("b", &[0.2, 0.1, 0.05, 0.025], 1),
            ],
            ..Study::default()
        }
    }

    fn case_results(study: &Study) -> Vec<CaseResult> {
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
            ended: CaseEnd::WithFigures(Box::new(CaseFigures {
                values: vec![(figure, amplitude_m)],
                ..CaseFigures::default()
            })),
        }
    }

    fn near(found: Option<f64>, wanted: f64) {
        let found = found.unwrap();
        assert!((found - wanted).abs() < 1e-9, "{found} is not {wanted}");
    }

    #[test]
    fn a_known_function_is_taken_apart() {
        let study = study(CombinationMode::OneAtATime);
        let results = case_results(&study);
        let found = analyse(&study, &results);
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
        let study = study(CombinationMode::Grid);
        let mut results = case_results(&study);
        let found = analyse(&study, &results);
        // Along each parameter the other is at its finest.
        assert_eq!(found.refinements[0].cases, [3, 7, 11, 15]);
        near(found.differences[0][0], (1.42 - 1.0175) / 1.0175);
        near(found.differences[15][0], 0.0);
        // Without the finest corner the finest that there is serves: a 0.1, b 0.025.
        results[15].ended = CaseEnd::NotRun;
        let found = analyse(&study, &results);
        assert_eq!(found.refinements[0].cases, [3, 7, 11, 15]);
        let b = &found.refinements[1];
        near(b.figures[0].limit.map(|l| l.value), 1.02);
        near(found.differences[0][0], (1.42 - 1.0325) / 1.0325);
        assert_eq!(found.differences[15][0], None);
    }

    #[test]
    fn a_case_without_result_is_left_out_of_the_series() {
        let study = study(CombinationMode::OneAtATime);
        let mut results = case_results(&study);
        results[1].ended = CaseEnd::NotRun;
        let found = analyse(&study, &results);
        let a = &found.refinements[0].figures[0];
        assert_eq!((a.values[0], a.estimated_errors[0]), (None, None));
        near(Some(a.limit.unwrap().value), 1.05);
    }

    /// Study whose figure is (x - 0.3)^2 + y + 0.1 a, with the physical x and y and a numerical a.
    fn designed() -> (Study, Vec<CaseResult>) {
        let physical = |name: &str, values: &[f64]| Parameter {
            kind: ParameterKind::Physical,
            ..sized(name, values, 0)
        };
        let mut study = study(CombinationMode::Grid);
        study.parameters = vec![
            physical("x", &[0.1, 0.2, 0.4, 0.9]),
            physical("y", &[1.0, 2.0]),
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
    fn differences_are_those_of_the_numerical_parameters_at_each_design_by_itself() {
        let (study, results) = designed();
        let found = analyse(&study, &results);
        assert_eq!(found.changing.len(), 1);
        assert_eq!(found.refinements.len(), 8);
        for refinement in &found.refinements {
            let [coarse, fine] = [0, 1].map(|v| refinement.cases[v]);
            let step = 0.02 / results[fine].value("peak_amplitude_m").unwrap();
            let difference = found.differences[coarse][0].unwrap();
            assert!((difference - step).abs() < 1e-12, "{difference} {step}");
            assert_eq!(found.differences[fine], [Some(0.0)]);
        }
    }

    #[test]
    fn physical_parameters_alone_have_no_errors() {
        let (mut study, _) = designed();
        study.parameters.truncate(2);
        let all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| result(c, 1.0)).collect();
        let found = analyse(&study, &results);
        assert!(found.refinements.is_empty() && found.changing.is_empty());
    }
}
