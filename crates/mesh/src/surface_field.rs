//! Complex forces or pressures at points in space.

/// Forces or pressures at points in space.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceField {
    /// Positions of the points, m.
    pub points_m: Vec<[f64; 3]>,
    /// One value for each point.
    pub values: FieldValues,
}

/// Complex values at points, the real part first.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValues {
    /// Forces along x, y, z, N.
    Forces(Vec<[[f64; 3]; 2]>),
    /// Pressures, positive where they press.
    Pressures {
        /// Complex pressure at each point, Pa.
        pressures_pa: Vec<[f64; 2]>,
        /// Area of the surface that belongs to each point, m2; `None` where it is not known.
        areas_m2: Option<Vec<f64>>,
    },
}
