//! Pictures of the backbone of a mode.

use super::conditions::in_motion;
use super::{RunFiles, axis};
use crate::error::RunError;
use dovetail_export::csv::{BackboneRow, write_backbone};
use dovetail_export::plots::{Axis, Series};
use dovetail_solver::run::ModeBackbone;

impl RunFiles {
    /// Writes backbone.csv, and draws frequency and damping of a mode over its amplitude, the response
    /// near the peak and, of a single force, the amplitude of the peak over it. `rows` are the motions
    /// by ascending amplitude.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn backbone(&self, found: &ModeBackbone, rows: &[BackboneRow<'_>]) -> Result<(), RunError> {
        write_backbone(&self.folder.out.file("backbone.csv")?, rows)?;
        // A backbone has the peaks of all forces.
        let conditions = &in_motion(&self.scene, &["excitation.*.force_n"]);
        let observation = &found.reduced.observations()[found.observation].name;
        let mode = found.mode;
        let write = |name: &str, title: String, axes: [Axis; 2], series: &[Series]| {
            self.draw(name, [&title, conditions], &axes, series)
        };
        let amplitudes_m: Vec<f64> = rows.iter().map(BackboneRow::amplitude_m).collect();
        let amplitude = || {
            axis(
                format!("amplitude of {observation}"),
                "m",
                amplitudes_m.iter().copied(),
            )
        };
        let series = |label: &str, values: &[f64]| {
            let points = amplitudes_m.iter().zip(values);
            Series::new(label.to_owned(), points.map(|(a, v)| (*a, Some(*v))))
        };
        let of = |value: fn(&BackboneRow<'_>) -> f64| rows.iter().map(value).collect::<Vec<f64>>();
        let frequencies_hz = of(|row| row.point.orbit.frequency_hz);
        let y = axis("frequency".to_owned(), "Hz", frequencies_hz.iter().copied());
        write(
            "backbone_frequency",
            format!("Frequency of mode {mode} over its amplitude"),
            [amplitude(), y],
            &[series("frequency", &frequencies_hz)],
        )?;
        let (whole, friction) = (
            of(|row| row.point.damping_ratio),
            of(|row| row.point.friction_ratio),
        );
        let y = axis("damping ratio".to_owned(), "", whole.iter().copied());
        write(
            "backbone_damping",
            format!("Damping ratio of mode {mode} over its amplitude"),
            [amplitude(), y],
            &[series("whole", &whole), series("of friction", &friction)],
        )?;
        // Up to the peak on its left, and down on its right.
        let of_side = |side: usize| {
            let at = move |row: &BackboneRow<'_>| row.point.response_frequencies_hz()[side];
            rows.iter()
                .filter_map(move |row| Some((at(row)?, row.amplitude_m())))
        };
        let right: Vec<(f64, f64)> = of_side(1).collect();
        let sides = of_side(0).chain(rows.windows(2).find_map(peak));
        let response: Vec<(f64, f64)> = sides.chain(right.into_iter().rev()).collect();
        if !response.is_empty() {
            let frequencies_hz: Vec<f64> = response.iter().map(|point| point.0).collect();
            let x = axis("frequency".to_owned(), "Hz", frequencies_hz.iter().copied());
            let y = axis(
                format!("amplitude of {observation}"),
                "m",
                amplitudes_m.iter().copied(),
            );
            let points = response.into_iter().map(|(hz, a)| (hz, Some(a)));
            write(
                "backbone_response",
                format!("Response of {observation} near its peak, from mode {mode}"),
                [x, y],
                &[Series::new("from the backbone".to_owned(), points)],
            )?;
        }
        let forces: Vec<(f64, Option<f64>)> = (rows.iter())
            .filter_map(|row| Some((row.resonant_force_n()?, Some(row.amplitude_m()))))
            .collect();
        if forces.is_empty() {
            return Ok(());
        }
        let forces_n: Vec<f64> = forces.iter().map(|point| point.0).collect();
        let x = axis("force".to_owned(), "N", forces_n.iter().copied());
        let y = axis(
            format!("peak of {observation}"),
            "m",
            amplitudes_m.iter().copied(),
        );
        write(
            "backbone_peak",
            format!("Peak amplitude of {observation} over the force, from mode {mode}"),
            [x, y],
            &[Series::new("peak".to_owned(), forces.into_iter())],
        )?;
        Ok(())
    }
}

/// Frequency, Hz, and amplitude, m, at which the backbone has the excitation of the scene, where that
/// lies between two motions: the logarithms of both are lines over that of the excitation.
fn peak(two: &[BackboneRow<'_>]) -> Option<(f64, f64)> {
    let [below, above] = two else {
        return None;
    };
    let scales = [below, above].map(|row| row.point.excitation_scale);
    let (low, high) = (scales[0]?.ln(), scales[1]?.ln());
    if !(low <= 0.0 && 0.0 < high) {
        return None;
    }
    let share = -low / (high - low);
    let between = |value: fn(&BackboneRow<'_>) -> f64| {
        value(below) * (value(above) / value(below)).powf(share)
    };
    Some((
        between(|row| row.point.orbit.frequency_hz),
        between(|row| row.amplitude_m()),
    ))
}
