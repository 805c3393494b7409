//! What most programs with a reduced model need.
//!
//! ```
//! use dovetail_dynamics::prelude::*;
//!
//! let law = PairLaw::rigid(0.3, 0.0);
//! assert!(law.stiffness.is_none());
//! ```

pub use crate::contact::PairLaw;
pub use crate::damping::{DampingSpec, Rayleigh};
pub use crate::dlft::settings::{EpsChoice, Resolution, Solver};
pub use crate::dlft::{Orbit, Outcome, Response, StaticState};
pub use crate::excitation::Excitation;
pub use crate::forced_response::{ForcedResponse, ResponseError, Solved};
pub use crate::problem::{HarmonicLoad, Problem};
pub use crate::reduced::{Load, ObservedPoint, ReducedModel};
pub use faer::Mat;
