//! Way in which the static load is applied.

use crate::reduced::ReducedModel;
use dovetail_numerics::vector::norm;
use serde::Serialize;

/// Way in which the static load is applied: from no load through the points in their order, and
/// from the last of them to the steady load. Each leg is a straight line.
///
/// ```
/// use dovetail_dynamics::dlft::static_state::LoadPath;
///
/// assert_eq!(LoadPath::default(), LoadPath::from(10));
/// // First 1.2 times the whole steady load, then back to it.
/// let overload = LoadPath { points: vec![vec![1.2]], ..LoadPath::default() };
/// assert_eq!(overload.steps, 10);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoadPath {
    /// Number of equal steps of each leg.
    pub steps: usize,
    /// Multiples of the parts of the steady load at each point, in the order of
    /// [`ReducedModel::working_multiples`](crate::reduced::ReducedModel::working_multiples), which
    /// says what the parts are. A part without a multiple has that of the steady load. Empty: the
    /// load rises to the steady load itself.
    pub points: Vec<Vec<f64>>,
}

impl Default for LoadPath {
    /// The load rises in [`LoadPath::STEPS`] equal steps.
    fn default() -> Self {
        Self::STEPS.into()
    }
}

impl From<usize> for LoadPath {
    /// The load rises in so many equal steps.
    fn from(steps: usize) -> Self {
        let points = Vec::new();
        Self { steps, points }
    }
}

/// Share of the load before it that is left at a point without load. Where nothing presses the pairs,
/// all of them are about to open, and bodies that only they hold have no state of their
/// own; with so little left the state is that which the falling load leads to.
const LEFT: f64 = 1e-6;

impl LoadPath {
    /// Number of equal steps of a leg.
    pub const STEPS: usize = 10;

    /// Loads on X, N, between which the legs are: none, those of the points, and the steady load.
    pub(super) fn stations(&self, reduced: &ReducedModel) -> Vec<Vec<f64>> {
        let mut stations = vec![vec![0.0; reduced.static_load.on_x.len()]];
        for multiples in &self.points {
            let mut load = reduced.steady_on_x(multiples);
            let before = stations.last().map_or(&[][..], Vec::as_slice);
            if norm(&load) < LEFT * norm(before) {
                load = before.iter().map(|f| LEFT * f).collect();
            }
            stations.push(load);
        }
        stations.push(reduced.static_load.on_x.clone());
        stations
    }
}
