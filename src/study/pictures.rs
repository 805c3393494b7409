//! plots/*.svg of a study.

use std::path::Path;

use super::analysis::{Analysis, AtDesign, CaseErrors, FigureAnswer, ParameterAnswer};
use super::cases::{design_slug, design_words};
use super::convergence::How;
use super::designs::centre;
use super::error::StudyError;
use super::file::{Mode, Study};
use super::parameter::Parameter;
use super::quantity::name_and_unit;
use super::results::CaseResult;
use crate::export::create_folder;
use crate::export::plots::{Axis, HeatMap, Scale, Series, write_heat_map, write_series};

/// Figures drawn in one plot, as many as there are colours.
const MOST_SERIES: usize = 6;
const COST: &str = "processor seconds";
/// An axis of design values is logarithmic where the largest is as many times the least.
const WIDE: f64 = 20.0;

/// A picture that was written: what it shows, and the name of its file.
pub type Picture = (String, String);

/// What is drawn, where to, and what was written.
struct Pictures<'s> {
    folder: &'s Path,
    study: &'s Study,
    results: &'s [CaseResult],
    analysis: &'s Analysis,
    written: Vec<Picture>,
}

/// Of designs each figure over each design value, and over two of them. Of numerical parameters, at each
/// design, errors of all cases against cost, and errors against each parameter and against what its
/// values cost.
pub fn write(
    folder: &Path,
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
) -> Result<Vec<Picture>, StudyError> {
    create_folder(folder)?;
    let mut pictures = Pictures {
        folder,
        study,
        results,
        analysis,
        written: Vec::new(),
    };
    for heading in &analysis.designs.changing {
        pictures.of_designs(heading)?;
    }
    for at in &analysis.at_designs {
        pictures.of_errors(at)?;
    }
    Ok(pictures.written)
}

impl Pictures<'_> {
    fn draw(
        &mut self,
        name: String,
        shows: String,
        axes: &[Axis; 2],
        series: &[Series],
    ) -> Result<(), StudyError> {
        let file = format!("{name}.svg");
        write_series(&self.folder.join(&file), &self.study.name, axes, series)?;
        self.written.push((shows, file));
        Ok(())
    }

    fn of_errors(&mut self, at: &AtDesign) -> Result<(), StudyError> {
        let results = self.results;
        let cost = |case: usize| Some(results[case].figures()?.cost.compared_s());
        let end = design_slug(self.study, &at.values);
        let words = match design_words(self.study, &at.values) {
            none if none.is_empty() => none,
            words => format!(", at {words}"),
        };
        for errors in &at.errors {
            let CaseErrors { heading, .. } = errors;
            let axes = [COST, &format!("error of {heading}")].map(Axis::logarithmic);
            let shows = format!("Error of {heading} against cost, all cases{words}");
            let series = all_cases(results, errors, &cost);
            self.draw(format!("pareto_{heading}{end}"), shows, &axes, &series)?;
        }
        for answer in &at.parameters {
            let figures = drawn(self.analysis, answer);
            if figures.is_empty() {
                continue;
            }
            let parameter = &self.study.parameters[answer.parameter];
            let name = &parameter.name;
            let label = |v: usize| parameter.values[v].label.clone();
            if let Some(sizes) = parameter.sizes() {
                let series = series(&figures, &|v| Some(sizes[v]), &label);
                let size = format!("size of {name}");
                let axes = [&size, "relative error"].map(Axis::logarithmic);
                let shows = format!("Errors against the size of {name}{words}");
                self.draw(format!("{name}{end}"), shows, &axes, &series)?;
            }
            let series = series(&figures, &|v| cost(answer.cases[v]), &label);
            let axes = [COST, "relative error"].map(Axis::logarithmic);
            let shows = format!("Errors against the cost of each value of {name}{words}");
            self.draw(format!("{name}_seconds{end}"), shows, &axes, &series)?;
        }
        Ok(())
    }

    /// A figure over each design parameter, with a line for each value of another, and over each two of
    /// them; the rest of the parameters stay where they are.
    fn of_designs(&mut self, heading: &str) -> Result<(), StudyError> {
        let parameters = self.study.parameters.iter().enumerate();
        let turned = parameters.filter(|(_, k)| k.is_design() && k.values.len() > 1);
        let turned: Vec<usize> = turned.map(|(k, _)| k).collect();
        let is_grid = self.study.mode == Mode::Grid;
        for &k in &turned {
            let others = turned.iter().copied().filter(|o| is_grid && *o != k);
            let others: Vec<usize> = others.collect();
            if others.is_empty() {
                self.curves(heading, k, None)?;
            }
            for other in others {
                self.curves(heading, k, Some(other))?;
                if k < other {
                    self.heat_map(heading, [k, other])?;
                }
            }
        }
        Ok(())
    }

    fn curves(&mut self, heading: &str, k: usize, other: Option<usize>) -> Result<(), StudyError> {
        let parameter = &self.study.parameters[k];
        let places = places(parameter);
        let line = |label: String, fixed: &[(usize, usize)]| {
            let point = |(v, place): (usize, &f64)| {
                let turned = [fixed, &[(k, v)]].concat();
                (*place, self.value(heading, &turned))
            };
            Series {
                label,
                points: places.iter().enumerate().map(point).collect(),
                names: Vec::new(),
                joined: true,
            }
        };
        let (name, unit) = name_and_unit(heading);
        let (series, by) = match other.map(|o| (o, &self.study.parameters[o])) {
            None => (vec![line(name.to_owned(), &[])], String::new()),
            Some((o, other)) => {
                let label = |w: usize| format!("{} {}", other.name, other.values[w].label);
                let values = 0..other.values.len();
                let lines = values.map(|w| line(label(w), &[(o, w)]));
                (lines.collect(), format!("_by_{}", other.name))
            }
        };
        let axes = [
            axis(parameter, &places),
            Axis {
                title: name.to_owned(),
                unit,
                scale: Scale::Linear,
                marks: Vec::new(),
            },
        ];
        let file = format!("{heading}_over_{}{by}", parameter.name);
        let shows = format!(
            "{heading} over {}{}",
            parameter.name,
            by.replace("_by_", ", by ")
        );
        self.draw(file, shows, &axes, &series)
    }

    fn heat_map(&mut self, heading: &str, parameters: [usize; 2]) -> Result<(), StudyError> {
        let [across, up] = parameters.map(|k| &self.study.parameters[k]);
        let labels =
            |parameter: &Parameter| parameter.values.iter().map(|v| v.label.clone()).collect();
        let value =
            |v: usize, w: usize| self.value(heading, &[(parameters[0], v), (parameters[1], w)]);
        let column = |v: usize| (0..up.values.len()).map(|w| value(v, w)).collect();
        let (name, unit) = name_and_unit(heading);
        let map = HeatMap {
            title: format!("{}: {name}", self.study.name),
            unit,
            axes: [across.name.clone(), up.name.clone()],
            labels: [labels(across), labels(up)],
            values: (0..across.values.len()).map(column).collect(),
        };
        let file = format!("{heading}_over_{}_and_{}.svg", across.name, up.name);
        write_heat_map(&self.folder.join(&file), &map)?;
        let shows = format!("{heading} over {} and {}", across.name, up.name);
        self.written.push((shows, file));
        Ok(())
    }

    /// A figure where these parameters have these values and the others stay.
    fn value(&self, heading: &str, turned: &[(usize, usize)]) -> Option<f64> {
        let mut values = centre(self.study);
        for (k, v) in turned {
            values[*k] = *v;
        }
        let case = self.analysis.designs.case(self.results, &values)?;
        self.results[case].value(heading)
    }
}

/// Where the values of a design parameter stand on an axis: at their numbers, else at 0, 1, ...
fn places(parameter: &Parameter) -> Vec<f64> {
    let counted = || (0..parameter.values.len()).map(|v| v as f64).collect();
    parameter.numbers().unwrap_or_else(counted)
}

fn axis(parameter: &Parameter, places: &[f64]) -> Axis {
    let least = places.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = places.iter().copied().fold(0.0, f64::max);
    let labels = parameter.values.iter().map(|v| v.label.clone());
    Axis {
        title: parameter.name.clone(),
        unit: "",
        scale: match least > 0.0 && largest >= WIDE * least && parameter.numbers().is_some() {
            true => Scale::Logarithmic,
            false => Scale::Linear,
        },
        marks: places.iter().copied().zip(labels).collect(),
    }
}

/// The Pareto front, and the other cases.
fn all_cases(
    results: &[CaseResult],
    errors: &CaseErrors,
    cost: &dyn Fn(usize) -> Option<f64>,
) -> [Series; 2] {
    let mut points: Vec<(usize, (f64, f64))> = (0..results.len())
        .filter_map(|c| Some((c, (cost(c)?, errors.errors[c]?))))
        .collect();
    points.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
    [("Pareto front", true), ("other cases", false)].map(|(label, on_front)| {
        let own = points
            .iter()
            .filter(|(c, _)| errors.on_pareto_front[*c] == on_front);
        let names = own.clone().filter(|_| on_front);
        Series {
            label: label.to_owned(),
            names: names.map(|(c, _)| results[*c].case.slug.clone()).collect(),
            points: own
                .map(|(_, (cost, error))| (*cost, Some(*error)))
                .collect(),
            joined: on_front,
        }
    })
}

/// Figures that change with the parameter: those asked for first.
fn drawn<'a>(analysis: &Analysis, parameter: &'a ParameterAnswer) -> Vec<&'a FigureAnswer> {
    let changes = |f: &&FigureAnswer| {
        f.limit
            .is_some_and(|l| !matches!(l.how, How::Unchanged | How::Single))
    };
    let asked = |f: &&FigureAnswer| analysis.with_errors.contains(&f.heading);
    let mut found: Vec<&FigureAnswer> = parameter.figures.iter().filter(changes).collect();
    found.sort_by_key(|f| !asked(f));
    found.truncate(MOST_SERIES);
    found
}

fn series(
    figures: &[&FigureAnswer],
    place: &dyn Fn(usize) -> Option<f64>,
    label: &dyn Fn(usize) -> String,
) -> Vec<Series> {
    let one = |(i, figure): (usize, &&FigureAnswer)| {
        let is_limit = figure.limit.is_some_and(|l| l.how == How::Richardson);
        let from = if is_limit { "Richardson" } else { "finest" };
        let points = figure.errors.iter().enumerate();
        let points = points.filter_map(|(v, error)| Some((v, (place(v)?, *error))));
        let (values, points): (Vec<usize>, Vec<(f64, Option<f64>)>) = points.unzip();
        Series {
            label: format!("{} (from {from})", figure.heading),
            // The values are written once, beside the first figure.
            names: values.into_iter().filter(|_| i == 0).map(label).collect(),
            points,
            joined: true,
        }
    };
    figures.iter().enumerate().map(one).collect()
}
