//! Comparison of harmonic balance with integration in time, which uses no Fourier series and no
//! parameter of the balance, for a reduced dovetail of 72 pairs, read from a folder of matrices.
//!
//!     cargo run --release --package dovetail-solver --example integration_check

use std::error::Error;
use std::path::Path;

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::{DampingSpec, rayleigh};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::integration::compare::{Comparison, Start, compare};
use dovetail_solver::integration::steady::Until;
use dovetail_solver::problem::{LinearReference, Problem};

fn main() -> Result<(), Box<dyn Error>> {
    let comparison = comparison()?;
    let (balance, integration) = (&comparison.balance, &comparison.integration);
    println!(
        "amplitude {:?} m by {} harmonics, {:?} m by integration over {} periods",
        balance.amplitude_m, comparison.harmonics, integration.amplitude_m, comparison.periods
    );
    println!(
        "work of friction {:e} J and {:e} J in a period",
        balance.contact_work_j, integration.contact_work_j
    );
    println!(
        "the worst of their relative differences is {:.1e}",
        comparison.worst()
    );
    Ok(())
}

/// Comparison at a frequency near the peak, where pairs slip and some open.
pub fn comparison() -> Result<Comparison, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/dovetail72");
    let law = PairLaw::rigid(0.3, 0.0);
    let force_n = 1.0;
    let model = Problem::of_one_law(dovetail_superelement::read(&folder)?.model, law, force_n);
    let ratio = DampingSpec::Ratio {
        ratio: 0.001,
        linear_mode: 1,
    };
    let stuck = LinearReference::stuck(&model.reduced);
    let damping = rayleigh(&ratio, &stuck.modes_of_first_harmonic(&model.reduced))?;
    let newton = NewtonOptions::new(1e-10, 60);
    let state = static_state(&model, 10, newton);
    let resolution = Resolution::fixed(7, 256);
    let settings = SweepSettings::new(vec![699.5], resolution);
    let response = sweep(&model, damping, &state, &settings, &[], &|_| ());
    // Six periods from the motion of harmonic balance: a correct motion stays as it is.
    let steps_per_period = 300;
    let until = Until::new(6, 0.0);
    Ok(compare(
        &model,
        damping,
        &response.orbits[0],
        Start::Orbit { larger_by: 0.0 },
        steps_per_period,
        until,
        response.slip_threshold_m,
    )?)
}
