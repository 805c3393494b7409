//! Tests of the library from outside, one module per subject: finite elements, reduction, contact,
//! harmonic balance, steps in time. None uses the program. They are one binary, like those of
//! tests/program, and no test changes anything that the process has only once (its environment, its
//! folder, its number of threads).

mod shared_bodies;
mod shared_dovetail;
mod shared_lattices;
mod shared_problems;
mod shared_rigid_body;
mod shared_scenes;

mod accuracy;
mod binding;
mod body_meshes;
mod clearance;
mod curved_flanks;
mod damaged_meshes;
mod elements;
mod excitation;
mod extremes;
mod friction_field;
mod given_matrices;
mod gross_slip;
mod massless;
mod mortar;
mod peaks;
mod penalty_contact;
mod preload;
mod reactions;
mod reduced_lattices;
mod reduction;
mod reference_dovetail72;
mod rigid_slider;
mod ring_of_masses;
mod rubbing_beam;
mod solver_choices;
mod strain_gauge;
mod stress;
mod ties;
mod time_integration;
mod transitions;
mod truth;
mod two_motions;
mod viscous;
mod wear;
