//! A response from a stiffness and a mass matrix in memory: they are condensed on the relative
//! displacements of the contact pairs and on the modes that are left while these stick.
//!
//! The system is a Jenkins oscillator: a mass of 1 kg on a spring of 1 N/m, and on a second one of
//! 0.5 N/m that ends in a massless slider, which holds 0.2 N. The mass is shaken with 0.25 N.
//!
//!     cargo run --release --package dovetail-solver --example reduced_from_matrices

use std::error::Error;
use std::f64::consts::TAU;

use dovetail_numerics::dense::product;
use dovetail_numerics::eigen::dense::{cholesky, modes, solve_in_place};
use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::model::Growth;
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduction::damping::Rayleigh;
use dovetail_solver::reduction::{Load, ObservedDisplacement, ReducedModel};
use faer::{Mat, MatRef};

fn main() -> Result<(), Box<dyn Error>> {
    for harmonics in [1, 3, 15] {
        println!(
            "{:.6} m with {harmonics} harmonics",
            amplitude_m(harmonics)?
        );
    }
    Ok(())
}

/// Amplitude of the mass at 1.05 rad/s.
pub fn amplitude_m(harmonics: usize) -> Result<f64, Box<dyn Error>> {
    let (spring, slider) = (1.0, 0.5);
    // Across the slider nothing moves; it is as stiff there as both springs in series.
    let across = spring * slider / (spring + slider);
    // Unknowns: the slider's normal motion, its two tangential ones, then the mass.
    #[rustfmt::skip]
    let stiffness = faer::mat![
        [1.0,     0.0,    0.0,              0.0],
        [0.0,  slider,    0.0,          -slider],
        [0.0,     0.0, across,              0.0],
        [0.0, -slider,    0.0, spring + slider],
    ];
    let mass = Mat::from_fn(4, 4, |i, j| if (i, j) == (3, 3) { 1.0 } else { 0.0 });
    let steady_load = [-1.0, 0.0, 0.0, 0.0];
    let model = condensed(
        &Matrices {
            stiffness: stiffness.as_ref(),
            mass: mass.as_ref(),
            steady_load: &steady_load,
            // The force acts on the mass, which is also observed.
            force: &[0.0, 0.0, 0.0, 0.25],
            observed: &[0.0, 0.0, 0.0, 1.0],
        },
        &[PairLaw::rigid(0.2, 0.0)],
    )?;
    let damping = Rayleigh {
        stiffness_s: 0.0,
        mass_per_s: 0.02,
    };
    let newton = NewtonOptions {
        tolerance: 1e-10,
        max_iterations: 60,
    };
    let state = static_state(&model, 10, newton);
    let resolution = Resolution::Fixed {
        harmonics,
        samples: 8192,
    };
    let mut settings = SweepSettings::new(vec![1.05 / TAU], resolution);
    // The parameter eps of the method stands for the stiffness that the harmonics left out feel. They
    // leave the mass at rest: it is the slider's spring, where K of the pair has both in series.
    settings.eps = Eps {
        choice: EpsChoice::Pair,
        scale: (spring + slider) / spring,
    };
    let response = sweep(&model, damping, &state, &settings, &[], &|_| ());
    let orbit = &response.orbits[0];
    if !orbit.outcome.is_converged() {
        return Err(format!("{} Hz: {:?}", orbit.frequency_hz, orbit.outcome).into());
    }
    Ok(orbit.observed_amplitude_m[0])
}

/// A system whose first unknowns are the relative displacements X of its pairs (normal, and two
/// tangential ones of each), and whose others g have mass.
struct Matrices<'a> {
    stiffness: MatRef<'a, f64>,
    mass: MatRef<'a, f64>,
    steady_load: &'a [f64],
    /// Of the first harmonic.
    force: &'a [f64],
    observed: &'a [f64],
}

/// Craig-Bampton: `g = Psi X + Phi q` with `Psi = -K_gg^-1 K_gx` and the modes Phi of g, all kept.
fn condensed(full: &Matrices, pairs: &[PairLaw]) -> Result<Problem, Box<dyn Error>> {
    let (n, all) = (3 * pairs.len(), full.stiffness.nrows());
    let inner = all - n;
    let k_gg = full.stiffness.submatrix(n, n, inner, inner);
    let m_gg = full.mass.submatrix(n, n, inner, inner);
    let modes = modes(k_gg, m_gg)?;
    let mut psi = -full.stiffness.submatrix(n, 0, inner, n).to_owned();
    solve_in_place(cholesky(k_gg)?.as_ref(), psi.as_mut());
    // All unknowns from X, and from q.
    let from_x = Mat::from_fn(all, n, |i, j| match i < n {
        true => f64::from(u8::from(i == j)),
        false => psi[(i - n, j)],
    });
    let from_q = Mat::from_fn(all, modes.omega2.len(), |i, j| match i < n {
        true => 0.0,
        false => modes.vectors[(i - n, j)],
    });
    let between = |left: &Mat<f64>, matrix: MatRef<'_, f64>, right: &Mat<f64>| {
        product(left.transpose(), product(matrix, right.as_ref()).as_ref())
    };
    let onto = |basis: &Mat<f64>, vector: &[f64]| -> Vec<f64> {
        let columns = basis.col_iter();
        columns
            .map(|column| column.iter().zip(vector).map(|(a, b)| a * b).sum())
            .collect()
    };
    let load = |vector: &[f64]| Load {
        on_x: onto(&from_x, vector),
        on_modes: onto(&from_q, vector),
    };
    let observed = load(full.observed);
    Ok(Problem {
        reduced: ReducedModel {
            stiffness: between(&from_x, full.stiffness, &from_x),
            mass: between(&from_x, full.mass, &from_x),
            coupling: between(&from_x, full.mass, &from_q),
            stuck_modes: modes.omega2.len(),
            omega2: modes.omega2,
            static_load: load(full.steady_load),
            unit_loads: Vec::new(),
            observations: vec![ObservedDisplacement {
                name: "mass".into(),
                on_x: observed.on_x,
                on_modes: observed.on_modes,
            }],
        },
        laws: pairs.to_vec(),
        excitations: vec![HarmonicLoad {
            harmonic: 1,
            cosine: load(full.force),
            sine: load(&vec![0.0; all]),
            growth: Growth::Constant,
        }],
    })
}
