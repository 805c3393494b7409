//! Picture of the motions at one frequency over a key.

use std::collections::BTreeMap;

use super::conditions::in_motion;
use super::solving::strip_fields;
use super::{RunFiles, axis};
use crate::error::RunError;
use dovetail_export::ExportError;
use dovetail_export::csv::{CurveRow, write_curve};
use dovetail_export::folder::OutputFolder;
use dovetail_export::manifest::curve_summary;
use dovetail_export::plots::Series;
use dovetail_export::words::{rounded, short, title};
use dovetail_solver::dlft::SolvedFrequency;
use dovetail_solver::dlft::branch::{ValueRange, partial_response, sections};
use dovetail_solver::results::far_slip::ShorterSides;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::run::{CurveQuestion, Error, ParameterCurve, ReducedScene};

/// Name of the table of a curve.
pub(super) const CURVE: &str = "curve.csv";

/// Curve under way, for the table that an interrupted one leaves.
#[derive(Debug)]
pub struct CurveUnderWay {
    key: String,
    range: ValueRange,
    /// Name of the observed displacement; `None`: the first one.
    observation: Option<String>,
    /// Pairs, and number of the observed displacement, once the first model is known.
    model: Option<(PairTable, usize)>,
    /// Motions by their numbers, without fields.
    solved: BTreeMap<usize, SolvedFrequency>,
}

impl CurveUnderWay {
    /// Curve without motions.
    pub fn new(question: &CurveQuestion<'_>) -> Self {
        Self {
            key: question.key.to_owned(),
            range: question.range.clone(),
            observation: question.observation.map(str::to_owned),
            model: None,
            solved: BTreeMap::new(),
        }
    }

    /// Sets the model of the first value.
    ///
    /// # Errors
    /// The observed displacement is not in the model.
    pub fn start(&mut self, reduced: &ReducedScene) -> Result<(), Error> {
        let observation = reduced.observed(self.observation.as_deref())?;
        self.model = Some((reduced.pairs.clone(), observation));
        Ok(())
    }

    /// Adds a motion.
    pub fn add(&mut self, solved: &SolvedFrequency) {
        let solved = strip_fields(solved);
        self.solved.insert(solved.orbit.point, solved);
    }

    /// Writes the table of the motions so far. Returns `false` without motions.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, out: &OutputFolder) -> Result<bool, ExportError> {
        let Some((pairs, observation)) = self.model.as_ref().filter(|_| !self.solved.is_empty())
        else {
            return Ok(false);
        };
        let mut response = partial_response(self.solved.values().cloned());
        ShorterSides::new(pairs).judge_response(&mut response);
        let curve = self.range.curve(response);
        let rows = CurveRow::rows(&curve, pairs, *observation);
        write_curve(&out.file(CURVE)?, &self.key, &rows)?;
        Ok(true)
    }
}

impl RunFiles {
    /// Writes curve.csv, and draws the amplitude of the motions at one frequency over the values of a
    /// key, unstable ones dashed, and the linear reference.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn curve(
        &mut self,
        key: &str,
        frequency_hz: f64,
        found: &ParameterCurve,
    ) -> Result<(), RunError> {
        let rows = &CurveRow::rows(&found.curve, &found.reduced.pairs, found.observation)[..];
        write_curve(&self.folder.out.file(CURVE)?, key, rows)?;
        self.figures.summary.curve = Some(curve_summary(key, frequency_hz, found));
        let observation = &found.reduced.observations()[found.observation].name;
        let over = title(key.rsplit('.').next().unwrap_or(key));
        let point = |i: usize| {
            let row = &rows[i];
            let has_motion = row.orbit.outcome.has_motion();
            (row.value, has_motion.then(|| row.amplitude_m()))
        };
        // The line of a series breaks between its sections.
        let of = |is_stable: bool| {
            let sections = sections(&found.curve.response).into_iter();
            let sections = sections.filter(move |section| section.is_stable == is_stable);
            sections.flat_map(move |section| {
                let last = section.points.end.saturating_sub(1);
                let end = (rows[last].value, None);
                section.points.map(point).chain([end]).collect::<Vec<_>>()
            })
        };
        let mut linear: Vec<(f64, Option<f64>)> =
            rows.iter().map(|row| (row.value, row.linear_m)).collect();
        linear.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut series = vec![
            Series {
                dots: false,
                ..Series::new("linear".to_owned(), linear.into_iter())
            },
            Series::new("stable".to_owned(), of(true)),
        ];
        let unstable: Vec<_> = of(false).collect();
        if !unstable.is_empty() {
            series.push(Series {
                dashed: true,
                ..Series::new("unstable".to_owned(), unstable.into_iter())
            });
        }
        let shown = series.iter().flat_map(|s| &s.points);
        let shown: Vec<f64> = shown.filter_map(|point| point.1).collect();
        let axes = [
            axis(over.clone(), "", rows.iter().map(|row| row.value)),
            axis(format!("amplitude of {observation}"), "m", shown),
        ];
        let shows = format!(
            "Amplitude of {observation} over {over} at {} Hz",
            short(rounded(frequency_hz, 7))
        );
        let conditions = &in_motion(&self.scene, &[key]);
        self.draw("curve_amplitude", [&shows, conditions], &axes, &series)
    }
}
