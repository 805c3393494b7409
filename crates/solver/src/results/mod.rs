//! Physical fields of a [`Response`](crate::dlft::Response): pressures, slip, dissipation, motion
//! of the bodies.

pub mod far_slip;
pub mod modes;
pub mod pairs;
pub mod quantities;
pub mod recovery;
pub mod rigid_motion;
pub mod signals;
pub mod small;
