//! Coordinate systems in which files give nodes.

use dovetail_numerics::space::{add_scaled, cross, sub, unit};

/// Meaning of three coordinates. Angles are degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coordinates {
    Rectangular,
    /// Radius, angle about z from x, z.
    Cylindrical,
    /// Radius, angle about z from x, angle above the plane of x and y (Ansys).
    Elevation,
    /// Radius, angle from z, angle about z from x (Nastran).
    Colatitude,
}

/// Coordinate system in global coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct System {
    pub coordinates: Coordinates,
    pub origin: [f64; 3],
    /// Directions of x, y and z.
    pub axes: [[f64; 3]; 3],
}

impl System {
    /// System by its origin, a point on its z axis and one in its plane of x and z. `None` where
    /// these points are on one line.
    pub fn of_points(coordinates: Coordinates, [a, b, c]: [[f64; 3]; 3]) -> Option<Self> {
        let z = unit(sub(b, a))?;
        let y = unit(cross(z, sub(c, a)))?;
        Some(Self {
            coordinates,
            origin: a,
            axes: [cross(y, z), y, z],
        })
    }

    /// Position of a point in global coordinates.
    pub fn point(&self, at: [f64; 3]) -> [f64; 3] {
        let [r, second, third] = at;
        let (sine, cosine) = second.to_radians().sin_cos();
        let local = match self.coordinates {
            Coordinates::Rectangular => at,
            Coordinates::Cylindrical => [r * cosine, r * sine, third],
            Coordinates::Elevation => {
                let (up, along) = third.to_radians().sin_cos();
                [r * along * cosine, r * along * sine, r * up]
            }
            Coordinates::Colatitude => {
                let (y, x) = third.to_radians().sin_cos();
                [r * sine * x, r * sine * y, r * cosine]
            }
        };
        let mut point = self.origin;
        for (axis, value) in self.axes.iter().zip(local) {
            add_scaled(&mut point, value, *axis);
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::assert_near;
    use super::*;

    #[test]
    fn points_of_each_kind_of_system() {
        let points = [[1.0, 2.0, 3.0], [1.0, 2.0, 4.0], [1.0, 5.0, 3.0]];
        // x points along the global y, y along -x, z along z.
        let cases = [
            (Coordinates::Rectangular, [1.0, 2.0, 3.0], [-2.0, 1.0, 3.0]),
            (Coordinates::Cylindrical, [2.0, 90.0, 3.0], [-2.0, 0.0, 3.0]),
            (Coordinates::Elevation, [2.0, 90.0, 0.0], [-2.0, 0.0, 0.0]),
            (Coordinates::Elevation, [2.0, 0.0, 90.0], [0.0, 0.0, 2.0]),
            (Coordinates::Colatitude, [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]),
            (Coordinates::Colatitude, [2.0, 90.0, 90.0], [-2.0, 0.0, 0.0]),
        ];
        for (coordinates, at, local) in cases {
            let system = System::of_points(coordinates, points).unwrap();
            let expected = [0, 1, 2].map(|k| points[0][k] + local[k]);
            assert_near(&[system.point(at)], &[expected], 1e-14);
        }
        assert!(System::of_points(Coordinates::Rectangular, [[0.0; 3]; 3]).is_none());
    }
}
