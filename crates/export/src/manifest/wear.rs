//! Figures of `dovetail wear` in summary.json.

use serde::{Deserialize, Serialize};

use dovetail_solver::run::{WearBlock, WearCourse};

/// Figures of the wear of the contacts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WearSummary {
    /// Cycles that were gone through.
    pub cycles: f64,
    /// Time of these cycles, s.
    pub seconds_of_vibration: f64,
    /// Number of blocks.
    pub blocks: usize,
    /// Largest worn depth, m.
    pub largest_depth_m: f64,
    /// Mean worn depth over the area that can wear, m.
    pub mean_depth_m: f64,
    /// Worn volume, m3.
    pub volume_m3: f64,
    /// Vibration at the beginning and at the end, one entry for each part of the mission.
    pub parts: Vec<WearPartSummary>,
}

/// Change of the vibration of a part of the mission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WearPartSummary {
    /// Share of the cycles.
    pub share: f64,
    /// Frequency at the beginning and at the end, Hz.
    pub frequency_hz: [f64; 2],
    /// Amplitude of the observed displacement at the beginning and at the end, m.
    pub amplitude_m: [f64; 2],
}

/// Figures of the wear so far; `None` before the first vibration.
pub fn wear_summary(course: &WearCourse<'_>) -> Option<WearSummary> {
    let (first, last) = (course.blocks.first()?, course.blocks.last()?);
    let ends = |value: &dyn Fn(&WearBlock) -> f64| [first, last].map(value);
    let parts = course.mission.iter().enumerate();
    let part = |(i, part): (usize, &dovetail_solver::description::MissionPart)| WearPartSummary {
        share: part.share,
        frequency_hz: ends(&|block| block.motions[i].frequency_hz),
        amplitude_m: ends(&|block| block.motions[i].observed_amplitude[course.observation]),
    };
    Some(WearSummary {
        cycles: last.cycles,
        seconds_of_vibration: last.seconds,
        blocks: course.blocks.len() - 1,
        largest_depth_m: last.largest_depth_m(),
        mean_depth_m: course.mean_depth_m(last),
        volume_m3: course.volume_m3(last),
        parts: parts.map(part).collect(),
    })
}
