//! Pictures of a study (plots/*.svg): figures over design values and loads, and the estimated
//! errors of numerical parameters.

use std::path::Path;

use super::analysis::{Analysis, Refined, Refinement};
use super::cases::{at_slug, at_words};
use super::convergence::How;
use super::designs::centre;
use super::error::StudyError;
use super::file::{Mode, Study};
use super::parameter::Parameter;
use super::quantity::Figure;
use super::results::CaseResult;
use crate::export::create_folder;
use crate::export::plots::{Axis, HeatMap, Scale, Series, write_heat_map, write_series};

/// Largest number of figures in one picture: the number of colours.
const MOST_SERIES: usize = 6;
/// Ratio of the largest to the smallest value above which an axis is logarithmic.
const WIDE: f64 = 20.0;

/// Written picture: its description, and its file name.
pub type Picture = (String, String);

/// Inputs of the pictures, their folder, and the pictures written so far.
struct Pictures<'s> {
    folder: &'s Path,
    study: &'s Study,
    results: &'s [CaseResult],
    analysis: &'s Analysis,
    written: Vec<Picture>,
}

/// Draws each figure that changes over each design value or load and over two of them, and the
/// estimated errors of each numerical parameter at each design.
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
    for figure in &analysis.designs.changing {
        pictures.of_designs(figure)?;
    }
    for refinement in &analysis.refinements {
        pictures.of_errors(refinement)?;
    }
    Ok(pictures.written)
}

impl Pictures<'_> {
    fn draw(
        &mut self,
        file: String,
        shows: String,
        axes: &[Axis; 2],
        series: &[Series],
    ) -> Result<(), StudyError> {
        write_series(&self.folder.join(&file), &shows, axes, series)?;
        self.written.push((shows, file));
        Ok(())
    }

    /// Draws estimated errors against the size of a parameter, or over its values if they have no
    /// sizes.
    fn of_errors(&mut self, refinement: &Refinement) -> Result<(), StudyError> {
        let parameter = &self.study.parameters[refinement.parameter];
        let figures = refinement.figures.iter().zip(&self.analysis.figures);
        let changes = |(refined, _): &(&Refined, &Figure)| {
            let how = refined.limit.map(|limit| limit.how);
            !matches!(how, None | Some(How::Unchanged | How::Single))
        };
        let shown: Vec<_> = figures.filter(changes).take(MOST_SERIES).collect();
        if shown.is_empty() {
            return Ok(());
        }
        let sizes = parameter.sizes();
        let (x, places) = match sizes {
            Some(sizes) => (Axis::logarithmic(&parameter.size_name), sizes),
            None => {
                let count = parameter.values.len();
                let places: Vec<f64> = (1..=count).map(|v| v as f64).collect();
                (axis(parameter, &places, Scale::Linear), places)
            }
        };
        let has_names = x.marks.is_empty();
        let one = |(i, (refined, figure)): (usize, &(&Refined, &Figure))| {
            let errors = refined.estimated_errors.iter();
            let errors = errors.map(|e| e.map(|e| 100.0 * e));
            // The values are written once, beside the first figure.
            let names = parameter.values.iter().filter(|_| has_names && i == 0);
            Series {
                label: figure.name.clone(),
                names: names.map(|v| v.label.clone()).collect(),
                points: places.iter().copied().zip(errors).collect(),
                joined: true,
            }
        };
        let series: Vec<Series> = shown.iter().enumerate().map(one).collect();
        let axes = [x, Axis::logarithmic("estimated error (%)")];
        let (name, at) = (parameter.title(), at_words(self.study, &refinement.at));
        let file = format!(
            "{}{}.svg",
            parameter.name,
            at_slug(self.study, &refinement.at)
        );
        self.draw(file, format!("Errors by {name}{at}"), &axes, &series)
    }

    /// Draws a figure over each design value or load, with a line for each value of another, and
    /// over each two of them. The other parameters keep their values.
    fn of_designs(&mut self, figure: &Figure) -> Result<(), StudyError> {
        let parameters = self.study.parameters.iter().enumerate();
        let varied = parameters.filter(|(_, p)| !p.is_numerical() && p.values.len() > 1);
        let varied: Vec<usize> = varied.map(|(k, _)| k).collect();
        let is_grid = self.study.mode == Mode::Grid;
        for &k in &varied {
            let others = varied.iter().copied().filter(|o| is_grid && *o != k);
            let others: Vec<usize> = others.collect();
            if others.is_empty() {
                self.curves(figure, k, None)?;
            }
            for other in others {
                self.curves(figure, k, Some(other))?;
                if k < other {
                    self.heat_map(figure, [k, other])?;
                }
            }
        }
        Ok(())
    }

    fn curves(
        &mut self,
        figure: &Figure,
        k: usize,
        other: Option<usize>,
    ) -> Result<(), StudyError> {
        let parameter = &self.study.parameters[k];
        let counted = || (1..=parameter.values.len()).map(|v| v as f64).collect();
        let places: Vec<f64> = parameter.numbers().unwrap_or_else(counted);
        let line = |label: String, fixed: &[(usize, usize)]| {
            let point = |(v, place): (usize, &f64)| {
                (*place, self.value(figure, &[fixed, &[(k, v)]].concat()))
            };
            Series {
                label,
                points: places.iter().enumerate().map(point).collect(),
                names: Vec::new(),
                joined: true,
            }
        };
        let mut file = format!("{}_over_{}", figure.heading, parameter.name);
        let mut shows = format!("{} over {}", capital(&figure.name), parameter.title());
        let series = match other.map(|o| (o, &self.study.parameters[o])) {
            None => vec![line(figure.name.clone(), &[])],
            Some((o, other)) => {
                file += &format!("_by_{}", other.name);
                shows += &format!(", by {}", other.title());
                let values = 0..other.values.len();
                values.map(|w| line(other.words(w), &[(o, w)])).collect()
            }
        };
        let least = places.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = places.iter().copied().fold(0.0, f64::max);
        let scale = if least > 0.0 && largest >= WIDE * least {
            Scale::Logarithmic
        } else {
            Scale::Linear
        };
        let y = Axis {
            title: figure.name.clone(),
            unit: figure.unit(),
            scale: Scale::Linear,
            marks: Vec::new(),
        };
        let axes = [axis(parameter, &places, scale), y];
        self.draw(file + ".svg", shows, &axes, &series)
    }

    fn heat_map(&mut self, figure: &Figure, both: [usize; 2]) -> Result<(), StudyError> {
        let [across, up] = both.map(|k| &self.study.parameters[k]);
        let labels = |p: &Parameter| p.values.iter().map(|v| v.label.clone()).collect();
        let value = |v: usize, w: usize| self.value(figure, &[(both[0], v), (both[1], w)]);
        let column = |v: usize| (0..up.values.len()).map(|w| value(v, w)).collect();
        let axes = [across.title(), up.title()];
        let shows = format!("{} over {} and {}", capital(&figure.name), axes[0], axes[1]);
        let map = HeatMap {
            title: shows.clone(),
            unit: figure.unit(),
            labels: [labels(across), labels(up)],
            values: (0..across.values.len()).map(column).collect(),
            axes,
        };
        let file = format!(
            "{}_over_{}_and_{}.svg",
            figure.heading, across.name, up.name
        );
        write_heat_map(&self.folder.join(&file), &map)?;
        self.written.push((shows, file));
        Ok(())
    }

    /// Value of a figure where these parameters have these values and the others keep theirs.
    fn value(&self, figure: &Figure, varied: &[(usize, usize)]) -> Option<f64> {
        let mut values = centre(self.study);
        for (k, v) in varied {
            values[*k] = *v;
        }
        let mut results = self.results.iter();
        let result = results.find(|r| r.case.values == values)?;
        result.value(&figure.heading)
    }
}

/// Axis of a parameter whose values are at these coordinates.
fn axis(parameter: &Parameter, places: &[f64], scale: Scale) -> Axis {
    let labels = parameter.values.iter().map(|v| v.label.clone());
    Axis {
        title: parameter.title(),
        unit: "",
        scale,
        marks: places.iter().copied().zip(labels).collect(),
    }
}

/// Text with a capital letter at the start.
fn capital(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}
