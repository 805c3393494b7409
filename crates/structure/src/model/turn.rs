//! Turns from one sector of a disc to another.

use std::f64::consts::TAU;

use super::CyclicSpec;
use dovetail_numerics::space::{Vector, add_scaled, cross, dot, scaled, sub};

/// Turn about the axis of a disc.
pub(super) struct SectorTurn {
    point_m: Vector,
    /// Matrix that turns directions.
    pub matrix: [[f64; 3]; 3],
}

impl SectorTurn {
    /// Turn to the sector that lies so many sectors ahead, by the right hand (O. Rodrigues, J. Math.
    /// Pures Appl. 5 (1840) 380-440).
    pub(crate) fn new(disc: &CyclicSpec, ahead: i32) -> Self {
        let angle = f64::from(ahead) * TAU / disc.sectors as f64;
        let (sine, cosine) = angle.sin_cos();
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|unit| {
            let mut column = scaled(unit, cosine);
            add_scaled(&mut column, sine, cross(disc.axis, unit));
            add_scaled(
                &mut column,
                (1.0 - cosine) * dot(disc.axis, unit),
                disc.axis,
            );
            column
        });
        Self {
            point_m: disc.point_m,
            matrix: [0, 1, 2].map(|i| [0, 1, 2].map(|j| columns[j][i])),
        }
    }

    /// Direction in the other sector, in the axes of this one.
    pub(crate) fn direction(&self, d: Vector) -> Vector {
        self.matrix.map(|row| dot(row, d))
    }

    /// Place in the other sector that has the place `x` in this one, m.
    pub(crate) fn place(&self, x: Vector) -> Vector {
        let mut place = self.point_m;
        add_scaled(&mut place, 1.0, self.direction(sub(x, self.point_m)));
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_numerics::space::distance;

    #[test]
    fn a_turn_follows_the_right_hand() {
        let disc = CyclicSpec {
            engine_order: 0,
            influence: None,
            sectors: 4,
            low: Vec::new(),
            high: Vec::new(),
            point_m: [1.0, 0.0, 0.0],
            axis: [0.0, 0.0, 1.0],
        };
        let quarter = SectorTurn::new(&disc, 1);
        let place = quarter.place([2.0, 0.0, 5.0]);
        assert!(distance(place, [1.0, 1.0, 5.0]) < 1e-15, "{place:?}");
        let back = SectorTurn::new(&disc, -1).direction(quarter.direction([0.3, 0.4, 0.5]));
        assert!(distance(back, [0.3, 0.4, 0.5]) < 1e-15, "{back:?}");
    }
}
