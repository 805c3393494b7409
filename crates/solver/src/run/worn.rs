//! State of worn contacts over the number of cycles, as `run/wear.rs` finds it.

use super::reduced::ReducedScene;
use crate::description::MissionPart;
use crate::dlft::Orbit;
use crate::dlft::wear::largest;

/// State after a number of cycles.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct WearBlock {
    /// Cycles since the beginning.
    pub cycles: f64,
    /// Time of these cycles, s.
    pub seconds: f64,
    /// Estimated error of the depths worn in the block that ends here, as a fraction of the largest
    /// of them; 0 at the beginning.
    pub error: f64,
    /// Steps inside of that block; 0 at the beginning.
    pub steps: usize,
    /// Worn depth of each pair, m.
    pub depth_m: Vec<f64>,
    /// Depth that each pair wears in a cycle here, m.
    pub rate_m: Vec<f64>,
    /// Compression of each pair in the static state that the vibration leaves, N.
    pub at_rest_n: Vec<f64>,
    /// Vibration of each part of the mission.
    pub motions: Vec<Orbit>,
}

/// Wear of a scene so far.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct WearCourse<'a> {
    /// Reduced model.
    pub reduced: &'a ReducedScene,
    /// Number of the observed displacement whose peaks are followed.
    pub observation: usize,
    /// Parts of the mission, with shares that add up to 1.
    pub mission: &'a [MissionPart],
    /// Area of each pair, m2.
    pub area_m2: &'a [f64],
    /// State at the beginning, and after each block.
    pub blocks: &'a [WearBlock],
}

impl WearBlock {
    /// Largest worn depth, m.
    pub fn largest_depth_m(&self) -> f64 {
        largest(&self.depth_m)
    }
}

impl WearCourse<'_> {
    /// Worn volume of a state, m3.
    pub fn volume_m3(&self, block: &WearBlock) -> f64 {
        self.area_mean(&block.depth_m)
    }

    /// Volume that is worn in a cycle of a state, m3.
    pub fn volume_rate_m3(&self, block: &WearBlock) -> f64 {
        self.area_mean(&block.rate_m)
    }

    /// Mean depth of a state over the area of the pairs that can wear, m.
    pub fn mean_depth_m(&self, block: &WearBlock) -> f64 {
        let laws = self.reduced.problem.laws.iter().zip(self.area_m2);
        let wearing = laws.filter(|(law, _)| law.wear_m2_n > 0.0);
        self.volume_m3(block) / wearing.map(|(_, area)| area).sum::<f64>()
    }

    /// Friction power of a state, mean over the time of the mission, W.
    pub fn friction_power_w(&self, block: &WearBlock) -> f64 {
        let parts = self.mission.iter().zip(&block.motions);
        let energy_j =
            parts.map(|(part, orbit)| part.share * orbit.friction_power_w / orbit.frequency_hz);
        energy_j.sum::<f64>() / seconds_per_cycle(self.mission, &block.motions)
    }

    fn area_mean(&self, of_pairs: &[f64]) -> f64 {
        let both = of_pairs.iter().zip(self.area_m2);
        both.map(|(value, area)| value * area).sum()
    }
}

/// Mean duration of a cycle of the mission, s.
pub(super) fn seconds_per_cycle(mission: &[MissionPart], motions: &[Orbit]) -> f64 {
    let parts = mission.iter().zip(motions);
    parts
        .map(|(part, orbit)| part.share / orbit.frequency_hz)
        .sum()
}
