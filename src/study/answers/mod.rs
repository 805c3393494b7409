//! From the table of all cases to what a user wants to know: errors per knob, the front, the cheapest choice.

pub mod choice;
pub mod orders;

use self::choice::{Combination, Price, cheapest, pareto_front};
use self::orders::{How, Limit, estimates, limit, orders, relative_error};
use super::cases::{base, coarseness};
use super::file::{Mode, Study};
use super::quantity::Quantity;
use super::results::{CaseResult, Figures, headings};

/// One knob, the others at their base (of a grid: at their finest).
#[derive(Debug, Clone, PartialEq)]
pub struct KnobAnswer {
    pub knob: usize,
    /// Per value of the knob, coarse to fine: the case that has it.
    pub cases: Vec<usize>,
    pub figures: Vec<FigureAnswer>,
}

/// How one figure follows one knob; the lists have an entry per value, `None` where the case has no such figure.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureAnswer {
    pub heading: String,
    pub values: Vec<Option<f64>>,
    /// Relative errors.
    pub to_finest: Vec<Option<f64>>,
    /// From the Richardson value; all `None` where no order shows.
    pub to_richardson: Vec<Option<f64>>,
    /// Order of this and the two coarser values.
    pub orders: Vec<Option<f64>>,
    pub limit: Option<Limit>,
    /// What the value is credited with: see [`estimates`].
    pub estimates: Vec<Option<f64>>,
}

impl FigureAnswer {
    /// The order of the last three values there are, whether it counts or not.
    pub fn seen_order(&self) -> Option<f64> {
        let last = self.values.iter().rposition(Option::is_some)?;
        self.orders[last]
    }
}

/// Error against time over all runs, for one figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Front {
    pub heading: String,
    /// What all knobs together lead to.
    pub limit: Option<f64>,
    /// Per case.
    pub errors: Vec<Option<f64>>,
    pub on_front: Vec<bool>,
}

/// The cheapest way to an accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    pub heading: String,
    pub accuracy: f64,
    /// The cheapest run within it.
    pub run: Option<usize>,
    /// Values put together that promise to be cheaper than any run.
    pub combination: Option<Combination>,
}

/// Everything.
#[derive(Debug, Clone, PartialEq)]
pub struct Answers {
    /// Values of the case that the knobs are turned around: the base; of a grid, the finest case that has a result.
    pub base: Vec<usize>,
    pub headings: Vec<String>,
    pub knobs: Vec<KnobAnswer>,
    pub fronts: Vec<Front>,
    pub advice: Vec<Advice>,
}

/// Answers of the results of all cases (further runs of combinations may follow those of the study).
pub fn answers(study: &Study, results: &[CaseResult]) -> Answers {
    let headings = headings(study, results);
    let base = centre(study, results);
    let knobs: Vec<KnobAnswer> = (0..study.knobs.len())
        .map(|k| knob(study, results, &base, &headings, k))
        .collect();
    let fronts: Vec<Front> = ranked(study, &headings)
        .into_iter()
        .map(|heading| front(study, results, &base, &knobs, &heading))
        .collect();
    let advice = study
        .targets
        .iter()
        .flat_map(|target| {
            let of_target = fronts
                .iter()
                .filter(|f| Quantity::of_heading(&f.heading) == Some(target.quantity));
            of_target.map(|front| advise(study, results, &base, &knobs, front, target.accuracy))
        })
        .collect();
    Answers {
        base,
        headings,
        knobs,
        fronts,
        advice,
    }
}

fn centre(study: &Study, results: &[CaseResult]) -> Vec<usize> {
    let finest = results
        .iter()
        .filter(|r| study.mode == Mode::Grid && r.figures().is_some())
        .min_by_key(|r| coarseness(study, &r.case));
    finest.map_or_else(|| base(study), |r| r.case.values.clone())
}

/// The figures whose front is drawn: those a recommendation is asked for, else the peak amplitude, else the first.
fn ranked(study: &Study, headings: &[String]) -> Vec<String> {
    let wanted = |q: Quantity| {
        headings
            .iter()
            .filter(move |h| Quantity::of_heading(h) == Some(q))
    };
    let mut found: Vec<String> = Vec::new();
    for heading in study.targets.iter().flat_map(|t| wanted(t.quantity)) {
        if !found.contains(heading) {
            found.push(heading.clone());
        }
    }
    if found.is_empty() {
        found.extend(
            wanted(Quantity::PeakAmplitude)
                .chain(headings)
                .next()
                .cloned(),
        );
    }
    found
}

fn knob(
    study: &Study,
    results: &[CaseResult],
    base: &[usize],
    headings: &[String],
    k: usize,
) -> KnobAnswer {
    let knob = &study.knobs[k];
    let mut values = base.to_vec();
    let cases = (0..knob.values.len())
        .map(|v| {
            values[k] = v;
            // Every combination on an axis through the base is a case of the study.
            results
                .iter()
                .position(|r| r.case.values == values)
                .unwrap_or_default()
        })
        .collect::<Vec<_>>();
    let figures = headings
        .iter()
        .map(|heading| {
            let values: Vec<Option<f64>> =
                cases.iter().map(|c| results[*c].value(heading)).collect();
            figure(heading, &values, knob.sizes().as_deref(), knob.order)
        })
        .collect();
    KnobAnswer {
        knob: k,
        cases,
        figures,
    }
}

fn figure(
    heading: &str,
    values: &[Option<f64>],
    sizes: Option<&[f64]>,
    order: f64,
) -> FigureAnswer {
    let there: Vec<usize> = (0..values.len()).filter(|i| values[*i].is_some()).collect();
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    let is_count = Quantity::of_heading(heading).is_some_and(Quantity::is_count);
    let sizes: Option<Vec<f64>> = sizes.map(|s| there.iter().map(|i| s[*i]).collect());
    let limit = limit(sizes.as_deref(), &known, order, !is_count);
    let spread = |of_known: Vec<Option<f64>>| {
        let mut all = vec![None; values.len()];
        for (i, v) in there.iter().zip(of_known) {
            all[*i] = v;
        }
        all
    };
    let from = |reference: Option<f64>| {
        spread(
            known
                .iter()
                .map(|v| relative_error(*v, reference?))
                .collect(),
        )
    };
    let richardson = limit.filter(|l| l.how == How::Richardson).map(|l| l.value);
    FigureAnswer {
        heading: heading.to_owned(),
        values: values.to_vec(),
        to_finest: from(known.last().copied()),
        to_richardson: from(richardson),
        orders: spread(match &sizes {
            Some(sizes) if !is_count => orders(sizes, &known),
            _ => vec![None; known.len()],
        }),
        limit,
        estimates: spread(limit.map_or(Vec::new(), |l| estimates(&known, &l))),
    }
}

fn of_heading<'k>(knob: &'k KnobAnswer, heading: &str) -> Option<&'k FigureAnswer> {
    knob.figures.iter().find(|f| f.heading == heading)
}

/// Where the base goes when each knob goes to its own limit: their changes added.
fn common_limit(
    results: &[CaseResult],
    base: &[usize],
    knobs: &[KnobAnswer],
    heading: &str,
) -> Option<f64> {
    let at_base = results
        .iter()
        .find(|r| r.case.values == base)?
        .value(heading)?;
    knobs.iter().try_fold(at_base, |sum, knob| {
        let limit = of_heading(knob, heading)?.limit?;
        Some(sum + limit.value - at_base)
    })
}

/// Errors of all runs. One at a time: the sum of what the values of its knobs are credited with (no run gains by errors that
/// cancel), of a combination no less than its difference from the common limit. Grid: the difference from the common limit, for the
/// finest corner the sum, and no less than what finer runs err.
fn front(
    study: &Study,
    results: &[CaseResult],
    base: &[usize],
    knobs: &[KnobAnswer],
    heading: &str,
) -> Front {
    let limit = common_limit(results, base, knobs, heading);
    let summed = |values: &[usize]| {
        knobs
            .iter()
            .zip(values)
            .try_fold(0.0, |sum, (knob, value)| {
                if knob.cases.len() == 1 {
                    return Some(sum);
                }
                Some(sum + of_heading(knob, heading)?.estimates[*value]?)
            })
    };
    let mut errors: Vec<Option<f64>> = results
        .iter()
        .map(|result| {
            let value = result.value(heading)?;
            match study.mode {
                Mode::OneAtATime => {
                    let turned = result.case.turned(base);
                    // A combination was run to see whether errors add up: the worse of both counts.
                    match (turned > 1, summed(&result.case.values)) {
                        (true, Some(sum)) => Some(sum.max(relative_error(value, limit?)?)),
                        (_, sum) => sum,
                    }
                }
                Mode::Grid if result.case.values == base => summed(base),
                Mode::Grid => relative_error(value, limit?),
            }
        })
        .collect();
    if study.mode == Mode::Grid {
        errors = with_finer(study, results, &errors);
    }
    let points: Vec<(f64, Option<f64>)> = results
        .iter()
        .zip(&errors)
        .map(|(r, e)| match r.figures() {
            Some(figures) => (figures.cost_seconds(), *e),
            None => (f64::INFINITY, None),
        })
        .collect();
    Front {
        heading: heading.to_owned(),
        limit,
        on_front: pareto_front(&points),
        errors,
    }
}

/// Each error raised to the largest of all runs that are no coarser in any knob with sizes and alike in the others.
fn with_finer(study: &Study, results: &[CaseResult], errors: &[Option<f64>]) -> Vec<Option<f64>> {
    let sized: Vec<bool> = study.knobs.iter().map(|k| k.sizes().is_some()).collect();
    let no_coarser = |finer: &[usize], than: &[usize]| {
        let mut knobs = finer.iter().zip(than).zip(&sized);
        knobs.all(|((f, t), sized)| f == t || (*sized && f > t))
    };
    results
        .iter()
        .zip(errors)
        .map(|(result, own)| {
            let finer = results.iter().zip(errors);
            let finer = finer.filter(|(r, _)| no_coarser(&r.case.values, &result.case.values));
            own.map(|own| finer.filter_map(|(_, e)| *e).fold(own, f64::max))
        })
        .collect()
}

fn advise(
    study: &Study,
    results: &[CaseResult],
    base: &[usize],
    knobs: &[KnobAnswer],
    front: &Front,
    accuracy: f64,
) -> Advice {
    let seconds = |c: usize| {
        results[c]
            .figures()
            .map_or(f64::INFINITY, Figures::cost_seconds)
    };
    let run = (0..results.len())
        .filter(|c| {
            front.errors[*c].is_some_and(|e| e <= accuracy) && results[*c].figures().is_some()
        })
        .min_by(|a, b| seconds(*a).total_cmp(&seconds(*b)));
    let combination = match study.mode {
        Mode::Grid => None,
        Mode::OneAtATime => cheapest(&prices(results, knobs, &front.heading), base, accuracy),
    };
    let known = |c: &Combination| results.iter().any(|r| r.case.values == c.values);
    let combination =
        combination.filter(|c| !known(c) && run.is_none_or(|r| c.seconds < 0.95 * seconds(r)));
    Advice {
        heading: front.heading.clone(),
        accuracy,
        run,
        combination,
    }
}

fn prices(results: &[CaseResult], knobs: &[KnobAnswer], heading: &str) -> Vec<Vec<Price>> {
    knobs
        .iter()
        .map(|knob| {
            let estimates = of_heading(knob, heading).map(|f| &f.estimates);
            let price = |(v, case): (usize, &usize)| match results[*case].figures() {
                Some(f) => Price {
                    seconds: f.cost(),
                    error: estimates.and_then(|e| e[v]),
                },
                None => Price {
                    seconds: [f64::INFINITY; 2],
                    error: None,
                },
            };
            knob.cases.iter().enumerate().map(price).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::cases::{Case, cases, combination};
    use crate::study::file::Target;
    use crate::study::knob::{Knob, KnobValue};
    use crate::study::results::Ended;
    use crate::study::spent::Spent;

    const PEAK: &str = "peak_amplitude_m";

    fn knob(name: &str, sizes: &[f64], base: usize) -> Knob {
        let value = |size: &f64| KnobValue {
            label: size.to_string(),
            set: vec![],
            size: Some(*size),
            span: 0..0,
        };
        Knob {
            name: name.to_owned(),
            values: sizes.iter().map(value).collect(),
            base,
            order: 2.0,
            span: 0..0,
        }
    }

    /// Peak 1 + 2 a^2 + 0.5 b; the model costs 1 / a, contact 0.1 / (a b).
    fn study(mode: Mode, accuracy: f64) -> Study {
        Study {
            name: "s".into(),
            scene: "x".into(),
            set: vec![],
            mode,
            quantities: vec![Quantity::PeakAmplitude],
            fields: false,
            knobs: vec![
                knob("a", &[0.4, 0.2, 0.1, 0.05], 1),
                knob("b", &[0.2, 0.1, 0.05, 0.025], 1),
            ],
            targets: vec![Target {
                quantity: Quantity::PeakAmplitude,
                accuracy,
            }],
        }
    }

    fn result(study: &Study, case: &Case) -> CaseResult {
        let size = |k: usize| study.knobs[k].values[case.values[k]].size.unwrap();
        let (a, b) = (size(0), size(1));
        let contact = 0.1 / (a * b);
        CaseResult {
            case: case.clone(),
            ended: Ended::WithFigures(Figures {
                values: vec![(PEAK.to_owned(), 1.0 + 2.0 * a * a + 0.5 * b)],
                spent: Spent {
                    seconds: 1.0 / a + contact,
                    contact_seconds: contact,
                    processor_seconds: None,
                    contact_processor_seconds: None,
                    peak_memory_mib: None,
                    not_counted: vec![],
                },
                threads: Some(1),
                points: 3,
                unconverged: 0,
            }),
        }
    }

    fn near(found: Option<f64>, wanted: f64) {
        let found = found.unwrap();
        assert!((found - wanted).abs() < 1e-9, "{found} is not {wanted}");
    }

    #[test]
    fn a_known_function_is_taken_apart_and_put_together() {
        let study = study(Mode::OneAtATime, 0.05);
        let mut all = cases(&study);
        let results: Vec<CaseResult> = all.iter().map(|c| result(&study, c)).collect();
        let found = answers(&study, &results);
        // Along a, b is 0.1: to 1.05 with order 2; along b, a is 0.2: to 1.08 with order 1.
        let [a, b] = [0, 1].map(|k| &found.knobs[k].figures[0]);
        near(a.limit.unwrap().order, 2.0);
        near(Some(a.limit.unwrap().value), 1.05);
        near(b.limit.unwrap().order, 1.0);
        near(a.to_richardson[0], 0.32 / 1.05);
        near(a.to_finest[1], 0.075 / 1.055);
        near(b.estimates[0], 0.1 / 1.08);
        // All together: to 1; the base errs by both.
        near(found.fronts[0].limit, 1.0);
        near(found.fronts[0].errors[0], 0.08 / 1.05 + 0.05 / 1.08);
        // No run is within 5 %: a or b is too coarse in each. Two finer values together are.
        let advice = &found.advice[0];
        assert_eq!(advice.run, None);
        let combined = advice.combination.as_ref().unwrap();
        assert_eq!(combined.values, [2, 2]);
        near(Some(combined.seconds), 10.0 + 0.1 / (0.1 * 0.05));
        // Run, it is judged by the worse of sum and difference, and recommended.
        all.push(combination(&study, &all, combined.values.clone()));
        let results: Vec<CaseResult> = all.iter().map(|c| result(&study, c)).collect();
        let found = answers(&study, &results);
        assert_eq!(
            (found.advice[0].run, &found.advice[0].combination),
            (Some(7), &None)
        );
        near(found.fronts[0].errors[7], 0.02 + 0.025);
        assert!(found.fronts[0].on_front[7]);
    }

    #[test]
    fn a_combination_that_does_not_keep_its_promise_is_not_recommended() {
        let study = study(Mode::OneAtATime, 0.05);
        let mut all = cases(&study);
        all.push(combination(&study, &all, vec![2, 2]));
        let mut results: Vec<CaseResult> = all.iter().map(|c| result(&study, c)).collect();
        let Ended::WithFigures(figures) = &mut results[7].ended else {
            panic!("no figures");
        };
        figures.values[0].1 = 1.2;
        let found = answers(&study, &results);
        near(found.fronts[0].errors[7], 0.2);
        assert_eq!(found.advice[0].run, None);
    }

    #[test]
    fn a_grid_counts_from_where_its_finest_corner_leads_to() {
        let study = study(Mode::Grid, 0.05);
        let all = cases(&study);
        let mut results: Vec<CaseResult> = all.iter().map(|c| result(&study, c)).collect();
        let found = answers(&study, &results);
        assert_eq!(found.base, [3, 3]);
        near(found.fronts[0].limit, 1.0);
        let chosen = found.advice[0].run.unwrap();
        // 2 a^2 + 0.5 b within 0.05: of a = 0.1, 0.05 and b = 0.05, 0.025 the cheapest.
        assert_eq!(all[chosen].values, [2, 2]);
        near(found.fronts[0].errors[chosen], 0.02 + 0.025);
        // A coarse run near the limit by chance gains nothing.
        let Ended::WithFigures(figures) = &mut results[0].ended else {
            panic!("no figures");
        };
        figures.values[0].1 = 1.0;
        let errors = answers(&study, &results).fronts[0].errors.clone();
        near(errors[0], 0.32 + 0.05);
        // Without the finest corner the finest there is serves.
        results[15].ended = Ended::NotRun;
        let found = answers(&study, &results);
        assert_eq!(found.base, [2, 3]);
        near(found.fronts[0].limit, 1.0);
    }

    #[test]
    fn a_case_without_result_is_left_out_of_the_series() {
        let study = study(Mode::OneAtATime, 0.05);
        let all = cases(&study);
        let mut results: Vec<CaseResult> = all.iter().map(|c| result(&study, c)).collect();
        results[1].ended = Ended::NotRun;
        let found = answers(&study, &results);
        let a = &found.knobs[0].figures[0];
        assert_eq!((a.values[0], a.estimates[0]), (None, None));
        near(Some(a.limit.unwrap().value), 1.05);
    }
}
