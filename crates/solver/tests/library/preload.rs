//! Traction that the way of the load leaves in a joint: friction remembers it. The masses on springs
//! have closed forms by Coulomb's law. The parts of the steady load of bodies are compared with those
//! of each load alone.

use std::sync::Arc;

use dovetail_mesh::units::Units;
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::vector::norm;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::{LoadPath, static_state};
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Outcome, PairStatus, StaticState};
use dovetail_solver::fem::assemble;
use dovetail_solver::model::{
    Assembly, GivenMatrices, LoadKind, LoadSpec, MatrixSource, Prestress, Row, bind,
};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::SteadyCause;
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel, StaticPart};
use faer::Mat;

use crate::shared_problems::diagonal;
use crate::shared_scenes::{FEW_MODES, blocks_assembly, ready, reduced};

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
        }
        .into(),
        laws: vec![PairLaw::rigid(0.5, gap_m)],
        excitations: vec![HarmonicLoad::cosine(
            1,
            Load::new(vec![0.0, force_n, 0.0], vec![]),
        )],
        modal_ratios: Vec::new(),
    }
}

/// The mass pressed by the first part of the load, 1 N, and pulled by the second, 1 N, with these
/// multiples in the end.
fn loaded_in_parts(gap_m: f64, [press, pull]: [f64; 2]) -> Problem {
    let mut problem = pulled(gap_m, 0.0);
    problem.reduced_mut().static_load.on_x = vec![-press, pull, 0.0];
    let part = |number: usize, on_x: [f64; 3], working: f64| StaticPart {
        cause: SteadyCause::Load(number),
        on_x: on_x.to_vec(),
        working,
    };
    problem.reduced_mut().static_parts = vec![
        part(0, [-1.0, 0.0, 0.0], press),
        part(1, [0.0, 1.0, 0.0], pull),
    ];
    problem
}

fn path(steps: usize, points: &[&[f64]]) -> LoadPath {
    let points = points.iter().map(|point| point.to_vec()).collect();
    LoadPath { steps, points }
}

/// Checks position, traction and what the pair does, after 1, 3 and 10 steps a leg: friction does not
/// depend on their number, as long as the load only rises or only falls along a leg.
#[track_caller]
fn ends_at(problem: &Problem, points: &[&[f64]], x_m: f64, traction_n: f64) -> StaticState {
    let [.., last] = [1, 3, 10].map(|steps| {
        let state = static_state(problem, path(steps, points), NEWTON);
        assert_eq!(state.outcome, Outcome::Converged, "{points:?}");
        let (x, lambda) = (state.x[1], state.lambda[1]);
        assert!(
            (x - x_m).abs() < 1e-9 && (lambda - traction_n).abs() < 1e-9,
            "{points:?}, {steps} steps: {x} m, {lambda} N, expected {x_m} m, {traction_n} N"
        );
        state
    });
    last
}

/// Under s times the load the mass has slid to s (1 - 0.5) m. Where the load falls back to 1, it
/// sticks there as long as friction can hold it: up to s = 3, where the spring pulls back by 0.5 N.
/// From there on it slides back to 1.5 m. The parts of the load are not known here.
#[test]
fn a_mass_stays_where_an_overload_has_put_it_as_long_as_friction_holds_it() {
    for (overload, x_m) in [(1.0, 0.5), (1.5, 0.75), (2.0, 1.0), (2.9, 1.45), (4.0, 1.5)] {
        let state = ends_at(&pulled(0.0, 0.0), &[&[overload]], x_m, 1.0 - x_m);
        assert!((state.lambda[0] + 1.0).abs() < 1e-9);
        let slips = overload == 1.0 || overload == 4.0;
        assert_eq!(state.status[0] == PairStatus::Slipping, slips, "{overload}");
    }
}

/// A point of the path at which nothing holds the mass ends the way there, also if a balance is found
/// because the load has no part along the motion that nothing holds. A spring along its normal holds
/// the mass.
#[test]
fn a_point_at_which_nothing_holds_the_mass_ends_the_path() {
    let lifted: [&[f64]; 2] = [&[2.0, 0.2], &[-1.0, 0.2]];
    let pulled: [&[f64]; 2] = [&[0.0, 0.2], &[1.0, 0.2]];
    for (points, spring_n_m, outcome, ended_at) in [
        (lifted, 1.0, Outcome::Converged, None),
        (lifted, 0.0, Outcome::NothingHolds, Some(1)),
        (pulled, 1.0, Outcome::Converged, None),
        (pulled, 0.0, Outcome::NothingHolds, Some(0)),
    ] {
        let mut problem = loaded_in_parts(0.0, [1.0, 0.2]);
        problem.reduced_mut().stiffness[(0, 0)] = spring_n_m;
        let state = static_state(&problem, path(2, &points), NEWTON);
        let found = (state.outcome, state.ended_at);
        assert_eq!(found, (outcome, ended_at), "{points:?}, {spring_n_m}");
        // The steady load itself holds it.
        let alone = static_state(&problem, 2, NEWTON);
        assert_eq!((alone.outcome, alone.ended_at), (Outcome::Converged, None));
    }
}

/// A mass that is pressed before it is pulled slides to 1 - 0.5 m, as under a load that rises as a
/// whole. One that is pulled before it is pressed slides all of 1 m, and bears no traction there.
#[test]
fn what_comes_first_decides_how_far_the_mass_slides() {
    let problem = loaded_in_parts(0.0, [1.0, 1.0]);
    ends_at(&problem, &[], 0.5, 0.5);
    ends_at(&problem, &[&[1.0, 0.0]], 0.5, 0.5);
    ends_at(&problem, &[&[0.0, 1.0]], 1.0, 0.0);
    // Half the pull, the press, and the rest of the pull, which friction holds.
    ends_at(&problem, &[&[0.0, 0.5], &[1.0, 0.5]], 0.5, 0.5);
    // A part without a multiple has that of the end.
    ends_at(&problem, &[&[0.0]], 1.0, 0.0);
}

/// Each part goes its own way: the pull alone rises further, the press alone, or the pull acts the
/// other way before.
#[test]
fn each_part_of_the_load_leaves_what_friction_keeps_of_it() {
    let whole = loaded_in_parts(0.0, [1.0, 1.0]);
    // Slides to 1.8 - 0.5 m, and sticks where the pull falls back.
    ends_at(&whole, &[&[1.0, 0.0], &[1.0, 1.8]], 1.3, -0.3);
    // Three times the press holds all of the pull until it falls back.
    ends_at(&whole, &[&[3.0, 1.0]], 0.5, 0.5);
    let weak = loaded_in_parts(0.0, [1.0, 0.4]);
    ends_at(&weak, &[&[1.0, 0.0]], 0.0, 0.4);
    // Slides to -1.2 + 0.5 m, and back to 0.4 - 0.5 m.
    ends_at(&weak, &[&[1.0, -1.2]], -0.1, 0.5);
    // Press and pull several times what they are in the end, which changes nothing where friction
    // holds all the pull all the way.
    ends_at(&weak, &[&[2.0, 0.8], &[0.5, 0.2]], 0.0, 0.4);
}

/// A pull that is gone in the end leaves its traction, and a load that is gone as a whole leaves
/// none: the mass slides back as the press falls.
#[test]
fn loads_that_are_gone_in_the_end_act_on_the_way() {
    ends_at(&loaded_in_parts(0.0, [1.0, 0.0]), &[&[1.0, 0.8]], 0.3, -0.3);
    ends_at(&loaded_in_parts(0.0, [1.0, 0.0]), &[&[1.0, 2.0]], 0.5, -0.5);
    ends_at(&loaded_in_parts(0.0, [0.0, 0.0]), &[&[1.0, 1.0]], 0.0, 0.0);
}

/// Points below the end on the straight way to it change nothing, but for the number of steps.
#[test]
fn points_on_the_way_of_a_rising_load_change_nothing() {
    for pull in [0.4, 1.0] {
        let problem = loaded_in_parts(0.0, [1.0, pull]);
        let plain = static_state(&problem, 9, NEWTON);
        let third = [1.0 / 3.0, pull / 3.0];
        let two_thirds = third.map(|multiple| 2.0 * multiple);
        let by_points = static_state(&problem, path(3, &[&third, &two_thirds]), NEWTON);
        for (a, b) in plain.x.iter().zip(&by_points.x) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert_eq!(plain.status, by_points.status);
    }
}

/// The joint is assembled once: a path presses its interference no deeper, and widens no
/// clearance. The spring of 1 N/m along the normal takes 0.2 N of the load or adds as much.
#[test]
fn a_path_leaves_interference_and_clearance_as_they_are() {
    for gap_m in [-0.2, 0.2] {
        let state = static_state(&pulled(gap_m, 0.0), path(10, &[&[2.5]]), NEWTON);
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

/// A first point without load is the assembly alone: the interference presses 0.2 N, of which
/// friction takes 0.1 N from the pull of 0.5 N that comes then. The press comes last and holds the
/// mass where it is.
#[test]
fn interference_is_whole_after_the_first_leg() {
    let problem = loaded_in_parts(-0.2, [1.0, 0.5]);
    let state = ends_at(&problem, &[&[0.0, 0.0], &[0.0, 0.5]], 0.4, 0.1);
    assert!((state.lambda[0] + 1.2).abs() < 1e-9, "{}", state.lambda[0]);
    // It also is where the load falls again.
    ends_at(&problem, &[&[0.0, 0.5], &[0.0, 0.0], &[0.0, 0.5]], 0.4, 0.1);
}

const SPEED_RAD_S: f64 = 700.0;

/// Two blocks that touch, the upper one rotating, with two forces on a corner of it.
fn loaded(rotates: bool, forces: [bool; 2], modes: Option<usize>) -> Assembly {
    let mut assembly = blocks_assembly();
    let rotation = assembly.rotation.as_mut().unwrap();
    rotation.speed_rad_s = if rotates { SPEED_RAD_S } else { 0.0 };
    // The stiffness is the same at any speed.
    rotation.prestress = Prestress::None;
    let both = [[30.0, -20.0, -50.0], [5.0, 40.0, -10.0]];
    let given = both.into_iter().zip(forces).filter(|(_, given)| *given);
    let load = |vector_n| LoadSpec {
        on: "corner".into(),
        load: LoadKind::Force { vector_n },
    };
    assembly.loads = given.map(|(vector_n, _)| load(vector_n)).collect();
    for body in &mut assembly.bodies {
        body.fixed_interface_modes = modes;
    }
    assembly
}

#[track_caller]
fn close(found: &[f64], expected: &[f64]) {
    assert!(norm(expected) > 0.0);
    let off: Vec<f64> = found.iter().zip(expected).map(|(a, b)| a - b).collect();
    let off = norm(&off) / norm(expected);
    assert!(off < 1e-10, "{off:e}");
}

/// Each part of the steady load is that of a run with this load alone, whether bodies are reduced by
/// themselves or not. At rest the part of the rotation is there all the same.
#[test]
fn the_parts_of_the_steady_load_are_those_of_each_load_alone() {
    let mesh = ready("blocks_order1.msh");
    let model_of = |assembly: &Assembly| reduced(assembly, &mesh, FEW_MODES).1.reduced;
    for modes in [None, Some(3)] {
        let whole = model_of(&loaded(true, [true, true], modes));
        assert_eq!(
            whole.working_multiples(),
            [SPEED_RAD_S * SPEED_RAD_S, 1.0, 1.0]
        );
        let together = whole.steady_on_x(&whole.working_multiples());
        close(&together, &whole.static_load.on_x);
        let alone = [
            (true, [false; 2]),
            (false, [true, false]),
            (false, [false, true]),
        ];
        for (part, (rotates, forces)) in alone.into_iter().enumerate() {
            let expected = model_of(&loaded(rotates, forces, modes));
            let mut multiples = [0.0; 3];
            multiples[part] = whole.working_multiples()[part];
            let expected = &expected.static_load.on_x;
            close(&whole.steady_on_x(&multiples), expected);
        }
        let at_rest = model_of(&loaded(false, [true, true], modes));
        assert_eq!(at_rest.working_multiples(), [0.0, 1.0, 1.0]);
        close(
            &at_rest.steady_on_x(&whole.working_multiples()),
            &whole.static_load.on_x,
        );
    }
}

/// A load that comes with matrices of another program is a part of its own.
#[test]
fn the_load_of_matrices_is_a_part_of_its_own() {
    let mesh = ready("blocks_order1.msh");
    let mut assembly = loaded(false, [true, false], None);
    assembly.rotation = None;
    let model = bind(&assembly, &mesh, None).unwrap();
    let structure = assemble(&model).unwrap();
    let upper = &structure.bodies[0];
    let rows = upper.node_tags.iter();
    let rows = rows.flat_map(|&node| [1, 2, 3].map(|direction| Row::Node { node, direction }));
    let given = GivenMatrices::new(
        upper.stiffness.clone(),
        upper.mass.clone(),
        rows.collect(),
        Units::MetreKilogramSecond,
    );
    let load_n = (0..upper.dofs()).map(|dof| (dof % 7) as f64).collect();
    let given = given.unwrap().with_load(load_n).unwrap();
    assembly.bodies[0].matrices = MatrixSource::Given(Arc::new(given));
    let (_, problem) = reduced(&assembly, &mesh, FEW_MODES);
    let parts = &problem.reduced.static_parts;
    let causes: Vec<SteadyCause> = parts.iter().map(|part| part.cause).collect();
    assert_eq!(causes, [SteadyCause::Load(0), SteadyCause::Matrices]);
    let whole = problem.reduced.steady_on_x(&[1.0, 1.0]);
    close(&whole, &problem.reduced.static_load.on_x);
    assembly.loads.clear();
    let (_, alone) = reduced(&assembly, &mesh, FEW_MODES);
    close(&parts[1].on_x, &alone.reduced.static_load.on_x);
}

/// A force of 0.3 N moves the mass whose friction carries 0.5 N already, and does not move one that
/// an overload has left without any.
#[test]
fn what_an_overload_leaves_decides_whether_a_small_force_moves_the_joint() {
    let mut settings = SweepSettings::new(vec![0.02], Resolution::fixed(5, 128));
    settings.newton = NEWTON;
    let [as_loaded, after] = [1.0, 2.0].map(|overload| {
        let problem = pulled(0.0, 0.3);
        let state = static_state(&problem, path(10, &[&[overload]]), NEWTON);
        let damping = Rayleigh::mass_proportional(0.1);
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
