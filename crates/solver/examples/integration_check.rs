//! Comparison of harmonic balance with integration in time, which uses no Fourier series and no
//! parameter of the balance, for a reduced dovetail of 72 pairs, read from a folder of matrices.
//!
//!     cargo run --release --package dovetail-solver --example integration_check

use std::error::Error;
use std::path::Path;

use dovetail_solver::folder;
use dovetail_solver::integration::compare::{Comparison, IntegrationStart, compare};
use dovetail_solver::integration::steady::Until;
use dovetail_solver::prelude::*;

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
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/dovetail72");
    let model = folder::read(&path)?.model;
    let problem = Problem::uniform(model, PairLaw::rigid(0.3, 0.0), 1.0);
    let solved = ForcedResponse::new(&problem)
        .damping(DampingSpec::ratio(0.001))
        .resolution(Resolution::fixed(7, 256))
        .frequencies_hz([699.5])
        .solve()?;
    // Six periods from the motion of harmonic balance: a correct motion stays as it is.
    let steps_per_period = 300;
    let until = Until::new(6, 0.0);
    Ok(compare(
        &problem,
        solved.damping,
        &solved.response.orbits[0],
        IntegrationStart::Orbit { larger_by: 0.0 },
        steps_per_period,
        until,
        solved.response.slip_threshold_m,
    )?)
}
