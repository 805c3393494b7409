//! The tests of the program and of the way through all packages, one module a subject. They are one
//! binary, which links the program once: no test may change what the process has only one of (its
//! environment, its folder, its number of threads), and names of temporary files begin with the
//! module's. Tests that need the library alone stand beside it, in crates/solver/tests/library.

mod shared_browser;
mod shared_decks;
mod shared_folder;
mod shared_program;
mod shared_runs;
mod shared_work;

#[path = "../../crates/solver/tests/library/shared_bodies.rs"]
mod shared_bodies;
#[path = "../../crates/solver/tests/library/shared_dovetail.rs"]
mod shared_dovetail;
#[path = "../../crates/solver/tests/library/shared_rigid_body.rs"]
mod shared_rigid_body;

mod backbone;
mod bad_input;
mod blade_frequencies;
mod body_meshes;
mod cache;
mod closed_forms;
mod command_line;
mod constants;
mod curve;
mod dashpots;
mod dovetail_script;
mod excitation;
mod export_files;
mod extremes;
mod fir_tree;
mod friction_file;
mod given_matrices;
mod interruption;
mod limits;
mod load_path;
mod memory;
mod mesh_study;
mod meshed_contact;
mod meshing;
mod metamorphic;
mod misleading;
mod natural_modes;
mod nodal_diameters;
mod only_what_is_asked;
mod open_at_rest;
mod output_folder;
mod pair_counts;
mod paper_findings;
mod peaks;
mod prestress;
mod public_items;
mod reduced_scenes;
mod reference;
mod report;
mod run_as_value;
mod run_up;
mod scene_any_text;
mod scene_errors;
mod scene_hash;
mod scene_set;
mod several_bodies;
mod small_displacements;
mod springs;
mod stability;
mod stacked_blocks;
mod starting_tractions;
mod strain_gauge;
mod stress;
mod study;
mod tidy;
mod tutorial;
mod uncomputed_resonance;
mod way_in;
mod wear;
mod whole_meshes;
mod words_of_a_run;
