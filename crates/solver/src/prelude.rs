//! What most programs with a scene need: its parts, how it is solved, and the types of
//! [`dovetail_dynamics::prelude`].

pub use crate::description::{
    FrequencyRange, ReducedModelSpec, ResponseSpec, Scene, StaticSpec, Subject,
};
pub use crate::model::{
    Assembly, BodySpec, ContactLaw, ContactSpec, ExcitationSpec, LoadKind, LoadSpec, Material,
    MeshSource, ObservationSpec, Prestress, RotationSpec, SpringSpec,
};
pub use crate::results::peak::{linear_peak, peak};
pub use crate::run::{Options, Run, Session, solve};
pub use dovetail_dynamics::prelude::*;
