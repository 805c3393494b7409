//! Residual and Jacobian of one frequency as functions of U, for a solver of one's own: here Newton's
//! method with the Jacobian formed column by column, beside the solver of the library.
//!
//!     cargo run --release --package dovetail-solver --example own_newton
//!
//! With `--bits` the bits of a residual and of a product with the Jacobian are printed, line by
//! line, which another way into the library has to give, too.

use std::error::Error;
use std::path::Path;

use dovetail_solver::dlft::balance::Balance;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::one_balance::{OneBalanceSettings, one_balance};
use dovetail_solver::dlft::orbit::observed_amplitudes_m;
use dovetail_solver::dlft::retention::Mean;
use dovetail_solver::folder;
use dovetail_solver::prelude::*;
use faer::linalg::solvers::Solve;

/// Frequency below the first mode, at which few pairs slip.
const FREQUENCY_HZ: f64 = 690.0;
const HARMONICS: usize = 1;
const SAMPLES: usize = 64;

fn main() -> Result<(), Box<dyn Error>> {
    if std::env::args().any(|word| word == "--bits") {
        for [residual, product] in bits()? {
            println!("{residual:016x} {product:016x}");
        }
        return Ok(());
    }
    let [own, library] = amplitudes_m()?;
    println!("{own:e} m by Newton's method of one's own");
    println!("{library:e} m by the library");
    Ok(())
}

/// Dovetail of 72 pairs.
fn dovetail() -> Result<Problem, Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/dovetail72");
    let model = folder::read(&path)?.model;
    Ok(Problem::uniform(model, PairLaw::rigid(0.3, 0.0), 1.0))
}

/// Response of the library, with its static state and damping.
fn solved(problem: &Problem) -> Result<Solved, ResponseError> {
    ForcedResponse::new(problem)
        .damping(DampingSpec::ratio(0.001))
        .resolution(Resolution::fixed(HARMONICS, SAMPLES))
        .frequencies_hz([FREQUENCY_HZ])
        .solve()
}

fn balance_of(problem: &Problem, solved: &Solved) -> Balance {
    let settings = OneBalanceSettings {
        frequency_hz: FREQUENCY_HZ,
        harmonics: HARMONICS,
        samples: SAMPLES,
        eps: Eps::new(EpsChoice::Dynamic),
        eps_hz: FREQUENCY_HZ,
        mean: Mean::Free,
    };
    one_balance(problem, solved.damping, &solved.state, settings)
}

/// Amplitude of the observed point by Newton's method from the static state, and by the library, m.
pub fn amplitudes_m() -> Result<[f64; 2], Box<dyn Error>> {
    let problem = dovetail()?;
    let solved = solved(&problem)?;
    let balance = balance_of(&problem, &solved);
    let mut u = solved.state.x.clone();
    u.resize(balance.unknowns(), 0.0);
    for _ in 0..10 {
        let evaluation = balance.evaluate(&u);
        let residual = &evaluation.residual;
        let residual = Mat::from_fn(u.len(), 1, |row, _| residual[row]);
        let step = formed(&balance, &u).partial_piv_lu().solve(&residual);
        u.iter_mut()
            .enumerate()
            .for_each(|(row, u)| *u -= step[(row, 0)]);
    }
    let own = observed_amplitudes_m(&balance, &u, FREQUENCY_HZ);
    Ok([own[0], solved.response.orbits[0].observed_amplitude[0]])
}

/// Jacobian at U, column by column.
fn formed(balance: &Balance, u: &[f64]) -> Mat<f64> {
    let jacobian = balance.linearise(&balance.evaluate(u));
    let mut matrix = Mat::zeros(u.len(), u.len());
    for column in 0..u.len() {
        let mut unit = vec![0.0; u.len()];
        unit[column] = 1.0;
        let product = balance.jacobian_times(&jacobian, &unit);
        (0..u.len()).for_each(|row| matrix[(row, column)] = product[row]);
    }
    matrix
}

/// Bits of the residual and of J v, for numbers v that vary along the unknowns, about the static
/// state.
pub fn bits() -> Result<Vec<[u64; 2]>, Box<dyn Error>> {
    let problem = dovetail()?;
    let solved = solved(&problem)?;
    let balance = balance_of(&problem, &solved);
    // Whole numbers, so that any program makes the same ones.
    let v: Vec<f64> = (0..balance.unknowns())
        .map(|i| ((i * 7919) % 2003) as f64 / 1e9 - 1e-6)
        .collect();
    let mut u = solved.state.x.clone();
    u.resize(balance.unknowns(), 0.0);
    u.iter_mut().zip(&v).for_each(|(u, v)| *u += v);
    let evaluation = balance.evaluate(&u);
    let jacobian = balance.linearise(&evaluation);
    let product = balance.jacobian_times(&jacobian, &v);
    let both = evaluation.residual.iter().zip(&product);
    Ok(both.map(|(f, jv)| [f.to_bits(), jv.to_bits()]).collect())
}
