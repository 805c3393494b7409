//! Tables of wear: wear.csv and wear_pairs.csv.

use std::path::Path;

use super::pairs::{numbers, pair_columns};
use super::solution::SolutionRow;
use crate::ExportError;
use crate::table::Columns;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::run::{WearBlock, WearCourse};

/// Writes wear.csv: one row for the beginning and one for each block. A mission of several parts has
/// the columns of their vibrations with `part<n>_` before them.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_wear(path: &Path, course: &WearCourse<'_>) -> Result<(), ExportError> {
    let mut table: Columns<'_, &WearBlock> = Columns::default();
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    table.add("cycles", |block| block.cycles);
    table.add("seconds", |block| block.seconds);
    table.add("largest_depth_m", move |block| largest(&block.depth_m));
    table.add("mean_depth_m", |block| course.mean_depth_m(block));
    table.add("volume_m3", |block| course.volume_m3(block));
    table.add("volume_per_cycle_m3", |block| course.volume_rate_m3(block));
    table.add("friction_power_w", |block| course.friction_power_w(block));
    table.add("compression_n", |block| block.at_rest_n.iter().sum::<f64>());
    table.add("largest_pressure_pa", |block| {
        let pairs = block.at_rest_n.iter().zip(course.area_m2);
        pairs.map(|(force, area)| force / area).fold(0.0, f64::max)
    });
    for part in 0..course.mission.len() {
        let prefix = match course.mission {
            [_] => String::new(),
            _ => format!("part{}_", part + 1),
        };
        table.add_solution(
            &prefix,
            move |block| Some(SolutionRow::new(&block.motions[part], course.observation)),
            "frequency_hz amplitude_m outcome slipping_pairs opening_pairs largest_slid_m \
             estimated_error",
        );
    }
    table.add("block_error", |block| block.error);
    table.add("block_steps", |block| block.steps);
    table.write(path, &course.blocks.iter().collect::<Vec<_>>())
}

/// Writes wear_pairs.csv: each pair with its depth, the depth that it wears in a cycle, and its
/// static pressure, after the last block.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_wear_pairs(
    path: &Path,
    pairs: &PairTable,
    area_m2: &[f64],
    block: &WearBlock,
) -> Result<(), ExportError> {
    let mut table = pair_columns(pairs);
    table.add("worn_depth_m", |i| block.depth_m[*i]);
    table.add("depth_per_cycle_m", |i| block.rate_m[*i]);
    table.add("static_pressure_pa", |i| block.at_rest_n[*i] / area_m2[*i]);
    table.write(path, &numbers(pairs.rows.len()))
}
