//! Traction that an overload leaves in a joint: friction remembers it.

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::{LoadPath, static_state};
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Outcome, PairStatus};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduction::damping::Rayleigh;
use dovetail_solver::reduction::{Load, ObservedPoint, ReducedModel};
use faer::Mat;

use crate::shared_problems::diagonal;

const NEWTON: NewtonOptions = NewtonOptions::new(1e-11, 60);

/// A mass on a spring of 1 N/m that 1 N presses on the ground and 1 N pulls along it. Friction
/// carries 0.5 N.
fn pulled(gap_m: f64, force_n: f64) -> Problem {
    Problem {
        reduced: ReducedModel {
            static_load: Load::new(vec![-1.0, 1.0, 0.0], Vec::new()),
            observations: vec![ObservedPoint::new("mass", vec![0.0, 1.0, 0.0], vec![])],
            ..ReducedModel::new(
                diagonal([1.0, 1.0, 1.0]),
                diagonal([1.0, 1.0, 1.0]),
                Mat::zeros(3, 0),
                Vec::new(),
            )
        },
        laws: vec![PairLaw::rigid(0.5, gap_m)],
        excitations: vec![HarmonicLoad::cosine(
            1,
            Load::new(vec![0.0, force_n, 0.0], vec![]),
        )],
        modal_ratios: Vec::new(),
    }
}

fn path(steps: usize, overload: f64) -> LoadPath {
    LoadPath { steps, overload }
}

/// Under s times the load the mass has slid to s (1 - 0.5) m. Where the load falls back to 1, it
/// sticks there as long as friction can hold it: up to s = 3, where the spring pulls back by 0.5 N.
/// From there on it slides back to 1.5 m.
#[test]
fn a_mass_stays_where_an_overload_has_put_it_as_long_as_friction_holds_it() {
    for (overload, x_m) in [(1.0, 0.5), (1.5, 0.75), (2.0, 1.0), (2.9, 1.45), (4.0, 1.5)] {
        for steps in [1, 3, 10] {
            let state = static_state(&pulled(0.0, 0.0), path(steps, overload), NEWTON);
            assert_eq!(state.outcome, Outcome::Converged);
            assert!(
                (state.x[1] - x_m).abs() < 1e-9,
                "{overload}, {steps} steps: {} {x_m}",
                state.x[1]
            );
            assert!((state.lambda[0] + 1.0).abs() < 1e-9);
            assert!((state.lambda[1] - (1.0 - x_m)).abs() < 1e-9);
            let slips = overload == 1.0 || overload == 4.0;
            assert_eq!(state.status[0] == PairStatus::Slipping, slips, "{overload}");
        }
    }
}

/// The joint is assembled once: an overload presses its interference no deeper, and widens no
/// clearance. The spring of 1 N/m along the normal takes 0.2 N of the load or adds as much.
#[test]
fn an_overload_leaves_interference_and_clearance_as_they_are() {
    for gap_m in [-0.2, 0.2] {
        let state = static_state(&pulled(gap_m, 0.0), path(10, 2.5), NEWTON);
        assert_eq!(state.outcome, Outcome::Converged);
        assert!((state.x[0] + gap_m).abs() < 1e-9, "{}", state.x[0]);
        let slid_m = 2.5 - 0.5 * (2.5 - gap_m);
        assert!(
            (state.x[1] - slid_m).abs() < 1e-9,
            "{gap_m}: {} {slid_m}",
            state.x[1]
        );
    }
}

/// A force of 0.3 N moves the mass whose friction carries 0.5 N already, and does not move one that
/// an overload has left without any.
#[test]
fn what_an_overload_leaves_decides_whether_a_small_force_moves_the_joint() {
    let mut settings = SweepSettings::new(vec![0.02], Resolution::fixed(5, 128));
    settings.newton = NEWTON;
    let [as_loaded, after] = [1.0, 2.0].map(|overload| {
        let problem = pulled(0.0, 0.3);
        let state = static_state(&problem, path(10, overload), NEWTON);
        let damping = Rayleigh::of_mass(0.1);
        let mut orbits = sweep(&problem, damping, &state, &settings, &[], &|_| ()).orbits;
        let orbit = orbits.remove(0);
        assert_eq!(orbit.outcome, Outcome::Converged);
        orbit
    });
    assert!((after.x[1] - 1.0).abs() < 1e-9, "{}", after.x[1]);
    // At rest its traction is at the limit. The first half period pulls it on by 0.3 m, to where the
    // largest force is held, and then it sticks.
    assert!((as_loaded.x[1] - 0.8).abs() < 1e-6, "{}", as_loaded.x[1]);
}
