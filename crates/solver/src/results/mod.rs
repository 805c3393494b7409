//! Physical fields of a [`Response`](crate::dlft::Response): pressures, slip, dissipation, motion
//! of the bodies.
//!
//! Each figure is a pure function of orbits and of the model that they are of. Sums and maxima over
//! frequencies skip those that did not converge, which have no numbers. A new figure of a response
//! belongs in [`quantities`], one of its peak in [`peak`](mod@peak), a new one of the smallness of displacements in [`small`]. Signs are
//! those of [`crate::contact`], units are SI and stand at the end of each name.

pub mod around_axis;
pub mod far_slip;
pub mod fretting;
pub mod modes;
pub mod pairs;
pub mod participation;
pub mod peak;
pub mod quantities;
pub mod reactions;
pub mod recovery;
pub mod resultants;
pub mod rigid_motion;
pub mod signals;
pub mod small;
pub mod stress;
pub(crate) mod stress_error;
