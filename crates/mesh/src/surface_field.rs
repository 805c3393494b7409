//! Complex forces or pressures, or coefficients of friction, at points in space.

/// Forces, pressures or coefficients of friction at points in space.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SurfaceField {
    /// Positions of the points, m.
    pub points_m: Vec<[f64; 3]>,
    /// One value for each point.
    pub values: FieldValues,
}

/// Values at points; of complex ones the real part comes first.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
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
    /// Coefficients of friction, 0 or more.
    Friction(Vec<f64>),
}
