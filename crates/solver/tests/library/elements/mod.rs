//! What the finite elements must satisfy whatever the mesh: theorems and closed forms.

mod algebra;
mod bodies;
mod mass;
mod orders;
mod refusals;
mod rotation;
mod stiffness;
