//! The tests of the program and of the way through all packages, one module a subject. They are one
//! binary, which links the program once: no test may change what the process has only one of (its
//! environment, its folder, its number of threads), and names of temporary files begin with the
//! module's.

mod shared_browser;
mod shared_folder;
mod shared_program;
mod shared_runs;
mod shared_scenes;

mod accuracy;
mod bad_input;
mod binding;
mod blade_frequencies;
mod body_meshes;
mod cache;
mod clearance;
mod closed_forms;
mod command_line;
mod curved_flanks;
mod elements;
mod excitation;
mod export_files;
mod extremes;
mod interruption;
mod memory;
mod mesh_files;
mod meshed_contact;
mod meshing;
mod metamorphic;
mod mortar;
mod only_what_is_asked;
mod output_folder;
mod paper_findings;
mod prestress;
mod reduced_scenes;
mod reduction;
mod reference;
mod reference_dovetail72;
mod report;
mod rubbing_beam;
mod run_as_value;
mod scene_any_text;
mod scene_errors;
mod scene_set;
mod several_bodies;
mod small_displacements;
mod springs;
mod study;
mod tidy;
mod time_integration;
mod transitions;
mod tutorial;
mod way_in;
mod words_of_a_run;
