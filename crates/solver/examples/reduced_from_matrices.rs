//! A response from a stiffness and a mass matrix in memory: they are condensed on the relative
//! displacements of the contact pairs and on the modes that are left while these stick.
//!
//! The system is a Jenkins oscillator: a mass of 1 kg on a spring of 1 N/m, and on a second one of
//! 0.5 N/m that ends in a massless slider, whose friction limit is 0.2 N. The mass is excited with
//! 0.25 N.
//!
//!     cargo run --release --package dovetail-solver --example reduced_from_matrices

use std::error::Error;
use std::f64::consts::TAU;

use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::prelude::*;
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use dovetail_solver::structure::{BodyMatrices, InterfaceNode, Joint, ObservedWork, Structure};
use nalgebra_sparse::{CooMatrix, CscMatrix};

fn main() -> Result<(), Box<dyn Error>> {
    for harmonics in [1, 3, 15] {
        println!(
            "{:.6} m with {harmonics} harmonics",
            amplitude_m(harmonics)?
        );
    }
    Ok(())
}

/// Structure of the oscillator. The mass is the first node of the body, the slider the second,
/// which is its interface. Each has three degrees of freedom; the mass moves along y alone.
fn oscillator(spring: f64, slider: f64) -> Structure {
    // Across the slider nothing moves; it is as stiff there as both springs in series.
    let across = spring * slider / (spring + slider);
    let stiffness = [
        (0, 0, 1.0),
        (1, 1, spring + slider),
        (2, 2, 1.0),
        (3, 3, 1.0),
        (4, 4, slider),
        (1, 4, -slider),
        (4, 1, -slider),
        (5, 5, across),
    ];
    let along_the_mass = vec![0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    Structure {
        bodies: vec![BodyMatrices {
            name: "oscillator".into(),
            stiffness: sparse(&stiffness),
            mass: sparse(&[(1, 1, 1.0)]),
            // The normal of the pair is its first axis: x, along which 1 N presses the slider on.
            load_n: vec![0.0, 0.0, 0.0, -1.0, 0.0, 0.0],
            centrifugal_n_s2: Vec::new(),
            interior_nodes: 1,
            held_dofs: vec![0, 2],
            fixed_interface_modes: None,
            node_tags: vec![1, 2],
        }],
        joints: vec![Joint {
            slave: InterfaceNode { body: 0, node: 1 },
            // Rigid ground.
            masters: Vec::new(),
            turned: Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            across: None,
        }],
        // The steady load as a whole.
        steady_parts: Vec::new(),
        excitations: vec![vec![along_the_mass.clone()]],
        observations: vec![ObservedWork {
            name: "mass".into(),
            quantity: ObservedQuantity::Displacement,
            load: vec![along_the_mass],
        }],
        dashpots: Vec::new(),
        influenced: Vec::new(),
    }
}

fn sparse(entries: &[(usize, usize, f64)]) -> CscMatrix<f64> {
    let mut matrix = CooMatrix::new(6, 6);
    entries.iter().for_each(|(i, j, v)| matrix.push(*i, *j, *v));
    CscMatrix::from(&matrix)
}

/// Amplitude of the mass at 1.05 rad/s.
pub fn amplitude_m(harmonics: usize) -> Result<f64, Box<dyn Error>> {
    let (spring, slider) = (1.0, 0.5);
    let wanted = StuckModes::new(Some(1), Highest::RadS(1.05));
    let reduced = reduce(oscillator(spring, slider), wanted)?.model;
    let problem = Problem::uniform(reduced, PairLaw::rigid(0.2, 0.0), 0.25);
    let mut response = ForcedResponse::new(&problem)
        .damping(DampingSpec::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: 0.02,
        })
        .resolution(Resolution::fixed(harmonics, 8192))
        .frequencies_hz([1.05 / TAU]);
    // The parameter eps of the method represents the stiffness for the harmonics left out. They
    // leave the mass at rest: it is the slider's spring, where K of the pair has both in series.
    response.settings().eps = Eps {
        choice: EpsChoice::Pair,
        scale: (spring + slider) / spring,
    };
    let response = response.solve()?.response;
    let orbit = &response.orbits[0];
    if !orbit.outcome.is_converged() {
        return Err(format!("{} Hz: {:?}", orbit.frequency_hz, orbit.outcome).into());
    }
    Ok(orbit.observed_amplitude[0])
}
