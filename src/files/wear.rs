//! Tables, pictures and fields of the wear of the contacts.

use super::RunFiles;
use super::conditions::in_motion;
use crate::error::RunError;
use dovetail_export::fields::Field;
use dovetail_export::flank::WornFlanks;
use dovetail_export::plots::{Axis, PictureHeading, Scale, Series, write_field_map};
use dovetail_export::words::{rounded, short};
use dovetail_export::{csv, manifest};
use dovetail_solver::run::{Bodies, WearBlock, WearCourse};

/// File name of the collection of the worn flanks over the cycles.
const WORN: &str = "wear.pvd";

impl RunFiles {
    /// Writes what the contacts have become, and draws amplitude, frequency and depth over the cycles.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn wear(&mut self, course: &WearCourse<'_>) -> Result<(), RunError> {
        if let Some(last) = course.blocks.last() {
            let path = self.folder.out.file("wear_pairs.csv")?;
            csv::write_wear_pairs(&path, &course.reduced.pairs, course.area_m2, last)?;
        }
        draw(course, &in_motion(&self.scene, &[]), self)
    }

    /// Writes wear.csv so far and, if fields are written, the flanks after the last block.
    pub(super) fn worn(&mut self, course: &WearCourse<'_>) -> Result<(), RunError> {
        csv::write_wear(&self.folder.out.file("wear.csv")?, course)?;
        self.figures.summary.wear = manifest::wear_summary(course);
        let bodies = course.reduced.bodies.as_ref().filter(|_| self.asked.fields);
        let (Some(bodies), Some(last)) = (bodies, course.blocks.last()) else {
            return Ok(());
        };
        let (worn, out) = (&mut self.worn, &self.folder.out);
        let flanks = worn.get_or_insert_with(|| WornFlanks::new(bodies.model()));
        out.list([WornFlanks::file(course.blocks.len() - 1)])?;
        flanks.write(out.path(), last)?;
        Ok(flanks.write_collection(&out.file(WORN)?)?)
    }
}

/// Draws amplitude, frequency and depth over the cycles, and the depths on the flanks at the end.
fn draw(course: &WearCourse<'_>, conditions: &str, files: &RunFiles) -> Result<(), RunError> {
    let observation = &course.reduced.observations()[course.observation].name;
    let series = |label: String, value: &dyn Fn(&WearBlock) -> f64| {
        let points = course.blocks.iter().map(|b| (b.cycles, Some(value(b))));
        Series::new(label, points)
    };
    let of_parts = |quantity: &str, value: &dyn Fn(&WearBlock, usize) -> f64| -> Vec<Series> {
        let parts = 0..course.mission.len();
        parts
            .map(|part| {
                let label = match course.mission {
                    [_] => quantity.to_owned(),
                    _ => format!("part {}", part + 1),
                };
                series(label, &|block| value(block, part))
            })
            .collect()
    };
    let amplitude = format!("amplitude of {observation}");
    let depth = "worn depth".to_owned();
    let pictures: [(&str, String, String, &'static str, Vec<Series>); 3] = [
        (
            "wear_amplitude",
            format!("Amplitude of {observation} over the cycles"),
            amplitude.clone(),
            "m",
            of_parts(&amplitude, &|block, part| {
                block.motions[part].observed_amplitude[course.observation]
            }),
        ),
        (
            "wear_frequency",
            "Frequency of the vibration over the cycles".to_owned(),
            "frequency".to_owned(),
            "Hz",
            of_parts("frequency", &|block, part| block.motions[part].frequency_hz),
        ),
        (
            "wear_depth",
            "Worn depth over the cycles".to_owned(),
            depth,
            "m",
            vec![
                series("largest".to_owned(), &WearBlock::largest_depth_m),
                series("mean".to_owned(), &|block| course.mean_depth_m(block)),
            ],
        ),
    ];
    for (name, shows, title, unit, series) in pictures {
        let cycles = Axis::linear("cycles");
        let y = Axis {
            title,
            unit,
            scale: Scale::Linear,
            marks: Vec::new(),
        };
        files.draw(name, [&shows, conditions], &[cycles, y], &series)?;
    }
    let bodies = course.reduced.bodies.as_ref().map(Bodies::model);
    let (Some(model), Some(last)) = (bodies, course.blocks.last()) else {
        return Ok(());
    };
    let heading = PictureHeading {
        title: &format!("Worn depth after {} cycles", short(rounded(last.cycles, 4))),
        conditions,
    };
    let field = Field {
        title: "worn depth",
        unit: "m",
        values: last.depth_m.clone(),
    };
    Ok(write_field_map(
        &files.picture("wear_map")?,
        model,
        heading,
        &field,
    )?)
}
