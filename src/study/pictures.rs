//! Pictures of a study (plots/*.svg): figures over physical parameters with their estimated errors
//! and the values without one, and the estimated errors of numerical ones.

use std::path::Path;

use super::analysis::{Analysis, ParameterRefinement};
use super::cases::slug;
use super::convergence::How;
use super::results::{CaseEnd, CaseResult};
use crate::study_file::StudyError;
use crate::study_file::keys::{CombinationMode, ParameterKind};
use crate::study_file::parameter::Parameter;
use crate::study_file::quantity::Figure;
use dovetail_export::create_folder;
use dovetail_export::plots::{
    Axis, HeatMap, PictureHeading, Scale, Series, error_bar, write_heat_map, write_series,
};
use dovetail_export::words::capital;

/// Largest number of figures in one picture: the number of colours.
const MOST_SERIES: usize = 6;

/// Written picture: its description, and its file name.
pub type Picture = (String, String);
type Drawn = Result<Picture, StudyError>;

/// Folder of the pictures, and what they show.
struct Pictures<'a> {
    folder: &'a Path,
    analysis: &'a Analysis<'a>,
}

/// Draws each figure that changes over each physical parameter, and the estimated errors of each
/// numerical parameter at each design. In a grid of two physical parameters there is a line for
/// each value of the other one, and a heat map over both.
pub fn write(folder: &Path, analysis: &Analysis<'_>) -> Result<Vec<Picture>, StudyError> {
    create_folder(folder)?;
    let study = analysis.study;
    let parameters = study.parameters.iter().enumerate();
    let varied =
        parameters.filter(|(_, p)| p.kind == ParameterKind::Physical && p.values.len() > 1);
    let varied: Vec<usize> = varied.map(|(k, _)| k).collect();
    let pictures = Pictures { folder, analysis };
    let mut written = Vec::new();
    for figure in &analysis.changing {
        match varied[..] {
            [a, b] if study.mode == CombinationMode::Grid => {
                written.push(pictures.curves(figure, a, Some(b))?);
                written.push(pictures.heat_map(figure, [a, b])?);
                written.push(pictures.curves(figure, b, Some(a))?);
            }
            _ => {
                for k in &varied {
                    written.push(pictures.curves(figure, *k, None)?);
                }
            }
        }
    }
    for refinement in &analysis.refinements {
        written.extend(pictures.errors(refinement)?);
    }
    Ok(written)
}

impl Pictures<'_> {
    fn draw(&self, file: String, shows: String, axes: [Axis; 2], series: &[Series]) -> Drawn {
        write_series(
            &self.folder.join(&file),
            PictureHeading::plain(&shows),
            &axes,
            series,
        )?;
        Ok((shows, file))
    }

    /// Draws estimated errors against the size of a parameter, or over its values if they have no
    /// sizes.
    fn errors(&self, refinement: &ParameterRefinement) -> Result<Option<Picture>, StudyError> {
        let study = self.analysis.study;
        let parameter = &study.parameters[refinement.parameter];
        let (x, places) = match parameter.sizes() {
            Some(sizes) => (Axis::logarithmic(&parameter.size_name), sizes),
            None => axis(parameter),
        };
        let mut series: Vec<Series> = Vec::new();
        for (refined, figure) in refinement.figures.iter().zip(&self.analysis.figures) {
            let how = refined.limit.map(|limit| limit.how);
            if matches!(how, None | Some(How::Unchanged | How::Single)) {
                continue;
            }
            let errors = refined.estimated_errors.iter();
            let errors = errors.map(|e| e.map(|e| 100.0 * e));
            let mut one = Series::new(figure.name.clone(), places.iter().copied().zip(errors));
            // The values are written once, beside the first figure.
            if x.marks.is_empty() && series.is_empty() {
                one.names = parameter.labels();
            }
            series.push(one);
        }
        series.truncate(MOST_SERIES);
        if series.is_empty() {
            return Ok(None);
        }
        let values = &self.analysis.results[refinement.cases[0]].case.values;
        let at = study.case_conditions(values);
        let shows = format!("Errors by {}{at}", parameter.title());
        let design = slug(study.physical(values));
        let mut file = parameter.name.clone();
        if !design.is_empty() {
            file += &format!("__{design}");
        }
        let axes = [x, Axis::logarithmic("estimated error (%)")];
        self.draw(file + ".svg", shows, axes, &series).map(Some)
    }

    /// Draws a figure over parameter `k`, with a line for each value of the other one, if there is
    /// one.
    fn curves(&self, figure: &Figure, k: usize, other: Option<usize>) -> Drawn {
        let parameters = &self.analysis.study.parameters;
        let (x, places) = axis(&parameters[k]);
        let over = |label: String, fixed: &[(usize, usize)]| {
            let results = (0..places.len()).map(|v| self.result(&[fixed, &[(k, v)]].concat()));
            let results: Vec<Option<&CaseResult>> = results.collect();
            let value = |result: &Option<&CaseResult>| (*result)?.value(&figure.heading);
            let bar = |result: &Option<&CaseResult>| {
                let value = value(result)?;
                let response = &(*result)?.figures()?.response;
                error_bar(value, figure.quantity.error(response, value))
            };
            let has_failed = |result: &Option<&CaseResult>| {
                let ended = result.is_some_and(|result| result.ended != CaseEnd::NotRun);
                ended && value(result).is_none()
            };
            let failed = places.iter().zip(&results);
            let failed = failed.filter(|(_, result)| has_failed(result));
            let points = places.iter().zip(&results);
            let points = points.map(|(place, result)| (*place, value(result)));
            Series {
                bars: results.iter().map(bar).collect(),
                failed: failed.map(|(place, _)| *place).collect(),
                ..Series::new(label, points)
            }
        };
        let mut file = format!("{}_over_{}", figure.heading, parameters[k].name);
        let mut shows = format!("{} over {}", capital(&figure.name), parameters[k].title());
        let mut series = Vec::new();
        if let Some((o, other)) = other.map(|o| (o, &parameters[o])) {
            file += &format!("_by_{}", other.name);
            shows += &format!(", by {}", other.title());
            let values = other.values.iter().enumerate();
            series.extend(values.map(|(w, value)| over(other.words(value), &[(o, w)])));
        } else {
            series.push(over(figure.name.clone(), &[]));
        }
        let y = Axis {
            unit: figure.unit(),
            ..Axis::linear(&figure.name)
        };
        self.draw(file + ".svg", shows, [x, y], &series)
    }

    fn heat_map(&self, figure: &Figure, [a, b]: [usize; 2]) -> Drawn {
        let [across, up] = [a, b].map(|k| &self.analysis.study.parameters[k]);
        let value = |v: usize, w: usize| self.value(figure, &[(a, v), (b, w)]);
        let column = |v: usize| (0..up.values.len()).map(|w| value(v, w)).collect();
        let map = HeatMap {
            quantity: figure.name.clone(),
            unit: figure.unit(),
            labels: [across.labels(), up.labels()],
            values: (0..across.values.len()).map(column).collect(),
            axes: [across.title(), up.title()],
        };
        let (figure, across, up) = (&figure.heading, &across.name, &up.name);
        let file = format!("{figure}_over_{across}_and_{up}.svg");
        write_heat_map(&self.folder.join(&file), &map)?;
        Ok((map.title(), file))
    }

    /// Value of a figure where these parameters have these values and the others keep theirs.
    fn value(&self, figure: &Figure, varied: &[(usize, usize)]) -> Option<f64> {
        self.result(varied)?.value(&figure.heading)
    }

    /// Result of the case in which these parameters have these values and the others keep theirs.
    fn result(&self, varied: &[(usize, usize)]) -> Option<&CaseResult> {
        let mut values = self.analysis.study.centre();
        for (k, v) in varied {
            values[*k] = *v;
        }
        let mut results = self.analysis.results.iter();
        results.find(|r| r.case.values == values)
    }
}

/// Axis of a parameter with a mark at each of its values, and their coordinates. Values that are
/// not numbers are at equal distances.
fn axis(parameter: &Parameter) -> (Axis, Vec<f64>) {
    let counted = || (1..=parameter.values.len()).map(|v| v as f64).collect();
    let numbers = parameter.numbers();
    let scale = |all: &Vec<f64>| Scale::fitting(all.iter().copied());
    let scale = numbers.as_ref().map_or(Scale::Linear, scale);
    let places: Vec<f64> = numbers.unwrap_or_else(counted);
    let axis = Axis {
        scale,
        marks: places.iter().copied().zip(parameter.labels()).collect(),
        ..Axis::linear(&parameter.title())
    };
    (axis, places)
}
