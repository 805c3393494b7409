//! Coordinate systems of Mechanical APDL, in which the command N gives nodes.

use super::super::systems::{Coordinates, System};

/// Coordinates by the number of their kind: 0 rectangular, 1 cylindrical, 2 spherical.
fn coordinates(kind: u64) -> Option<Coordinates> {
    Some(match kind {
        0 => Coordinates::Rectangular,
        1 => Coordinates::Cylindrical,
        2 => Coordinates::Elevation,
        _ => return None,
    })
}

/// System of LOCAL: its axes are turned about z, then about the new x, then about the new y, by
/// angles in degrees. `None` for a kind that is not read.
pub(super) fn local(kind: u64, origin: [f64; 3], angles: [f64; 3]) -> Option<System> {
    let [(sz, cz), (sx, cx), (sy, cy)] = angles.map(|angle| angle.to_radians().sin_cos());
    let x = [cz * cy - sz * sx * sy, sz * cy + cz * sx * sy, -cx * sy];
    let y = [-sz * cx, cz * cx, sx];
    let z = [cz * sy + sz * sx * cy, sz * sy - cz * sx * cy, cx * cy];
    Some(System {
        coordinates: coordinates(kind)?,
        origin,
        axes: [x, y, z],
    })
}

/// System that every model has: 1 cylindrical and 2 spherical about z, 5 cylindrical about y.
pub(super) fn global(number: u64) -> Option<System> {
    let mut system = local(if number == 5 { 1 } else { number }, [0.0; 3], [0.0; 3])?;
    if number == 5 {
        system.axes = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    }
    Some(system)
}

#[cfg(test)]
mod tests {
    use super::super::super::fixtures::assert_near;
    use super::*;

    #[test]
    fn angles_turn_about_z_then_x_then_y() {
        let about = |angles| local(0, [0.0; 3], angles).unwrap().axes;
        let x_y_z = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_near(
            &about([90.0, 0.0, 0.0]),
            &[x_y_z[1], [-1.0, 0.0, 0.0], x_y_z[2]],
            1e-15,
        );
        assert_near(
            &about([0.0, 90.0, 0.0]),
            &[x_y_z[0], x_y_z[2], [0.0, -1.0, 0.0]],
            1e-15,
        );
        assert_near(
            &about([0.0, 0.0, 90.0]),
            &[[0.0, 0.0, -1.0], x_y_z[1], x_y_z[0]],
            1e-15,
        );
        // Rz Rx Ry as products of the three rotations.
        let [z, x, y] = [[30.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 10.0]].map(about);
        let product = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| {
            b.map(|axis| [0, 1, 2].map(|k| (0..3).map(|i| a[i][k] * axis[i]).sum()))
        };
        let expected = product(product(z, x), y);
        assert_near(&about([30.0, 20.0, 10.0]), &expected, 1e-15);
    }

    #[test]
    fn systems_that_every_model_has() {
        let at = [2.0, 90.0, 3.0];
        assert_near(&[global(1).unwrap().point(at)], &[[0.0, 2.0, 3.0]], 1e-15);
        assert_near(&[global(5).unwrap().point(at)], &[[0.0, 3.0, -2.0]], 1e-15);
        assert!(global(7).is_none());
    }
}
