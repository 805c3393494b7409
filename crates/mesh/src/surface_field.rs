//! Complex forces or pressures at points in space.

/// Forces or pressures at points in space.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceField {
    /// Where the points are.
    pub points_m: Vec<[f64; 3]>,
    /// One value for each point.
    pub values: FieldValues,
}

/// Complex values at points, the real part first.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValues {
    /// N, along x, y, z.
    Forces(Vec<[[f64; 3]; 2]>),
    /// Pressures, positive where they press.
    Pressures {
        /// Pa.
        pressures_pa: Vec<[f64; 2]>,
        /// The part of the surface that each stands for; `None` where it is not known.
        areas_m2: Option<Vec<f64>>,
    },
}
