//! Cycles, table and warnings of `dovetail wear`.

use super::Workspace;
use crate::error::RunError;
use crate::files::Sought;
use dovetail_export::warning::Weight;
use dovetail_export::words::{figure, quantity, rounded, short};
use dovetail_solver::description::MissionPart;
use dovetail_solver::run::{self, Wear, WearQuestion};

/// Error of a block where none is given, as a fraction of the largest depth that it wears.
pub const TOLERANCE: f64 = 0.05;
/// Least and largest error that can be asked for.
pub const TOLERANCES: [f64; 2] = [1e-4, 0.5];
/// Rows of the table for the reader.
const ROWS: usize = 12;

/// Wear that is asked for.
#[derive(Debug, Clone)]
pub struct AskedWear {
    /// Numbers of cycles at which a block ends, ascending; the last one is the end.
    pub cycles: Vec<f64>,
    /// Frequency of all cycles, Hz; `None`: the mission of the scene, or the peak without one.
    pub frequency_hz: Option<f64>,
    /// Largest error of a block.
    pub tolerance: f64,
    /// Name of the observed displacement; `None`: the first one.
    pub observation: Option<String>,
    /// True to go on with a computation that was interrupted.
    pub resume: bool,
}

impl AskedWear {
    /// Vibrations that wear the contacts, where the scene has this mission.
    fn mission(&self, of_scene: &[MissionPart]) -> Vec<MissionPart> {
        match (self.frequency_hz, of_scene) {
            (None, [_, ..]) => of_scene.to_vec(),
            (frequency_hz, _) => vec![MissionPart::whole_mission(frequency_hz)],
        }
    }
}

impl Workspace<'_> {
    /// Wears the contacts over the cycles, writes what becomes of them and of the vibration, and
    /// returns a table for the reader.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; a scene without a contact that wears.
    pub fn wear(&self, asked: &AskedWear) -> Result<(String, Result<(), RunError>), RunError> {
        // Before anything is meshed.
        run::check_one_speed(self.scene, "contacts wear at one speed")?;
        self.start_search(Sought::Vibrations, asked.resume)?;
        let mission = asked.mission(&self.scene.mission);
        let source = self.source()?;
        let question = WearQuestion {
            cycles: &asked.cycles,
            tolerance: asked.tolerance,
            mission: &mission,
            observation: asked.observation.as_deref(),
        };
        let course = self.computes(|session| run::wear(self.scene, source, &question, session))?;
        self.warn_of_wear(&course);
        if let Some(files) = &self.files {
            files.locked().wear(&course.course())?;
        }
        let last = asked.cycles.last().copied().unwrap_or(0.0);
        let reached = course.blocks.last().map_or(0.0, |block| block.cycles);
        let verdict = match &course.ended {
            None => Ok(()),
            Some(_) => Err(RunError::WearEnds {
                reached: short(rounded(reached, 4)),
                cycles: short(rounded(last, 4)),
            }),
        };
        Ok((table(&course), verdict))
    }

    /// Warns of what the wear does not show.
    fn warn_of_wear(&self, found: &Wear) {
        if let Some(why) = &found.ended {
            self.reporter.warning(Weight::Wrong, why.to_string());
        }
        let motions = found.blocks.iter().flat_map(|block| &block.motions);
        self.warn_of_missed("the vibrations", motions.clone());
        self.warn_of_unstable("the vibrations", motions.clone());
        self.warn_of_errors("amplitudes", motions, found.observation);
        if found
            .blocks
            .last()
            .is_some_and(|block| block.depth_m.iter().all(|d| *d == 0.0))
        {
            let text = "no pair slides, and nothing is worn".to_owned();
            self.reporter.warning(Weight::Remark, text);
        }
    }
}

/// Table of the wear, of a few of its blocks.
fn table(found: &Wear) -> String {
    let course = found.course();
    let mut text = format!(
        "wear, amplitude of {}\n{:>12}{:>12}{:>14}{:>14}{:>16}{:>16}{:>14}\n",
        found.reduced.observations()[found.observation].name,
        "cycles",
        "hours",
        "largest depth",
        "mean depth",
        "amplitude",
        "frequency, Hz",
        "volume, m3",
    );
    let count = found.blocks.len();
    let every = count.div_ceil(ROWS);
    let rows = found.blocks.iter().enumerate();
    for (_, block) in rows.filter(|(i, _)| i % every == 0 || i + 1 == count) {
        let largest_m = block.largest_depth_m();
        for (part, orbit) in block.motions.iter().enumerate() {
            let of_block = |words: String| if part == 0 { words } else { String::new() };
            text += &format!(
                "{:>12}{:>12}{:>14}{:>14}{:>16}{:>16}{:>14}\n",
                of_block(short(rounded(block.cycles, 4))),
                of_block(figure(block.seconds / 3600.0, 4)),
                of_block(quantity(largest_m, "m", 4)),
                of_block(quantity(course.mean_depth_m(block), "m", 4)),
                quantity(orbit.observed_amplitude[found.observation], "m", 4),
                figure(orbit.frequency_hz, 6),
                of_block(short(rounded(course.volume_m3(block), 4))),
            );
        }
    }
    text + &format!(
        "{} blocks, {} more were taken again with fewer cycles; {} motions solved\n",
        count - 1,
        found.rejected,
        found.solved
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frequency_takes_the_place_of_the_mission() {
        let mission = [
            MissionPart::whole_mission(Some(3.0)),
            MissionPart::whole_mission(None),
        ];
        let asked = |frequency_hz| AskedWear {
            cycles: vec![1.0],
            frequency_hz,
            tolerance: TOLERANCE,
            observation: None,
            resume: false,
        };
        assert_eq!(asked(None).mission(&mission), mission);
        assert_eq!(
            asked(Some(7.0)).mission(&mission),
            [MissionPart::whole_mission(Some(7.0))]
        );
        assert_eq!(asked(None).mission(&[]), [MissionPart::whole_mission(None)]);
    }
}
