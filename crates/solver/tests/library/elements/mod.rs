//! Properties of the finite elements on any mesh: theorems and closed forms.

pub mod algebra;
pub mod bodies;
mod mass;
mod mesh_error;
mod orders;
mod refusals;
mod rotation;
mod stiffness;
