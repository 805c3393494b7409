//! Reactions of supports and springs: they balance loads, inertia and damping, and are those of
//! closed forms.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use crate::shared_scenes::*;
use dovetail_mesh::units::Units;
use dovetail_mesh::{ElementType, Mesh};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::space::add_scaled;
use dovetail_numerics::sparse::times;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::orbit::linear_orbit;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Orbit, StaticState};
use dovetail_solver::fem::mass_properties::mass_properties;
use dovetail_solver::fem::statics::solve_by_cholesky;
use dovetail_solver::fem::{Prestressed, assemble_body, assemble_with, expand_to_nodes};
use dovetail_solver::model::{
    Assembly, BaseMotion, Body, BodySpec, ContactLaw, DofMap, ExcitationKind, ExcitationSpec,
    GivenMatrices, LoadKind, LoadSpec, MatrixSource, Model, NodeMotion, Prestress, Row, Side,
    SpringSpec, bind,
};
use dovetail_solver::problem::Problem;
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::reduction::{Highest, ModalTruncation, Recovery, StuckModes, reduce};
use dovetail_solver::results::reactions::{Moving, Supports};
use dovetail_solver::results::resultants::{Pusher, Resultant, static_contact_resultants};
use dovetail_solver::spectrum::{Spectrum, blocks};
use dovetail_testkit::block::{block, map_nodes};
use faer::Mat;
use nalgebra_sparse::{CooMatrix, CscMatrix};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-11, 60);
const SIZE: [f64; 3] = [0.04, 0.02, 0.01];

/// A model with its reduction.
struct Case {
    model: Model,
    prestressed: Prestressed,
    problem: Problem,
    recovery: Recovery,
    truncation: ModalTruncation,
}

impl Case {
    fn new(assembly: &Assembly, mesh: &Mesh, modes: usize) -> Self {
        let model = bind(assembly, mesh, None).unwrap();
        let (structure, prestressed, ()) =
            assemble_with(&model, &solve_by_cholesky, |_, _| ()).unwrap();
        let wanted = StuckModes::new(Some(modes), Highest::OfFirstStuckMode(1.0));
        let reduction = reduce(&structure, wanted).unwrap();
        Self {
            problem: dovetail_solver::run::problem(reduction.model, &model),
            recovery: reduction.recovery,
            truncation: reduction.truncation,
            prestressed,
            model,
        }
    }

    fn supports(&self) -> Supports<'_> {
        Supports::new(&self.model, &self.prestressed).unwrap()
    }

    /// Static state, the displacements of the free degrees of freedom, and the reactions.
    fn static_reactions(&self) -> (StaticState, Vec<Vec<f64>>, Vec<Resultant>) {
        let state = static_state(&self.problem, 10, NEWTON);
        assert!(state.outcome.is_converged(), "{:?}", state.outcome);
        let free = self.recovery.full_static(&state.x);
        let reactions = self.supports().static_reactions(&free);
        (state, free, reactions)
    }

    /// Motion of the free degrees of freedom in an orbit.
    fn motion(&self, orbit: &Orbit) -> Vec<Mat<f64>> {
        let blocks = blocks(orbit.harmonics);
        let columns = |v: &[f64]| {
            let v = Spectrum::new(v, orbit.harmonics);
            Mat::from_fn(v.signals(), blocks, |i, j| v.block(j)[i])
        };
        let (x, modal) = (columns(&orbit.x), columns(&orbit.modal));
        let mut motion = self.recovery.full_motion(x.as_ref(), modal.as_ref());
        let mean = self.recovery.full_static(x.col_as_slice(0));
        for (motion, mean) in motion.iter_mut().zip(&mean) {
            motion.col_as_slice_mut(0).copy_from_slice(mean);
        }
        motion
    }

    fn periodic_reactions(
        &self,
        orbit: &Orbit,
        damping: Rayleigh,
    ) -> (Vec<Mat<f64>>, Vec<Resultant>) {
        let motion = self.motion(orbit);
        let reactions = self.supports().periodic_reactions(&Moving {
            omega_rad_s: TAU * orbit.frequency_hz,
            motion_m: &motion,
            damped_m: &motion,
            damping,
        });
        (motion, reactions)
    }

    /// [`moved_mass`] of a body in a motion of its free degrees of freedom.
    fn moved_mass(&self, body: usize, free: &[f64]) -> [[f64; 3]; 2] {
        let body = &self.model.bodies[body];
        moved_mass(body, &expand_to_nodes(&body.dofs, free))
    }
}

/// Sum of M u over all nodes of a body, which is its mass times the displacement of its centre of
/// gravity, and the moment of M u about the origin.
fn moved_mass(body: &Body, u: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let all = assemble_body(&unsupported(body), None, &solve_by_cholesky).unwrap();
    let u = Mat::from_fn(3 * u.len(), 1, |i, _| u[i / 3][i % 3]);
    let moved = times(&all.mass, u.as_ref());
    let forces = moved.col_as_slice(0).chunks_exact(3);
    let forces = forces.zip(&body.nodes_m);
    sum(forces.map(|(f, x)| ([f[0], f[1], f[2]], *x)))
}

/// The same body with all of its nodes free.
fn unsupported(body: &Body) -> Body {
    let nodes = body.nodes_m.len();
    Body {
        dofs: DofMap {
            nodes: (0..nodes as u32).map(NodeMotion::Free).collect(),
            auxiliary: Vec::new(),
            interior_nodes: nodes,
            contact_nodes: 0,
        },
        held_dofs: Vec::new(),
        supports: Vec::new(),
        springs: Vec::new(),
        loads: Vec::new(),
        ..body.clone()
    }
}

/// Sum of forces, and of their moments about the origin.
fn sum(forces: impl Iterator<Item = ([f64; 3], [f64; 3])>) -> [[f64; 3]; 2] {
    let mut sum = [[0.0; 3]; 2];
    for (force, at) in forces {
        add_scaled(&mut sum[0], 1.0, force);
        add_scaled(&mut sum[1], 1.0, cross(at, force));
    }
    sum
}

/// Sum of resultants in one block, and of their moments about the origin.
fn sum_of<'a>(all: impl Iterator<Item = &'a Resultant>, block: usize) -> [[f64; 3]; 2] {
    let mut total = [[0.0; 3]; 2];
    for of in all {
        add_scaled(&mut total[0], 1.0, of.force_n[block]);
        add_scaled(&mut total[1], 1.0, of.moment_nm[block]);
        add_scaled(&mut total[1], 1.0, cross(of.about_m, of.force_n[block]));
    }
    total
}

fn traction(on: &str, vector_pa: [f64; 3]) -> LoadSpec {
    LoadSpec {
        on: on.into(),
        load: LoadKind::Traction { vector_pa },
    }
}

/// A block that is pressed on another one and pulled along it. Planes of symmetry cut both at
/// y = 0, where the flanks have held nodes. The lower one stands on its base, on whose edges a
/// pressure acts, and a spring holds a side of the upper one.
fn pressed(
    element: ElementType,
    upper_cells: [usize; 3],
    lower_cells: [usize; 3],
) -> (Assembly, Mesh) {
    let mut upper = block(element, upper_cells, SIZE);
    let lower = block(element, lower_cells, SIZE);
    map_nodes(&mut upper, |[x, y, z]| [x, y, z + SIZE[2]]);
    let mesh = two_blocks(&upper, &lower);
    let mut assembly = blocks_assembly();
    for (body, side) in assembly
        .bodies
        .iter_mut()
        .zip(["upper_y_min", "lower_y_min"])
    {
        body.fixed_along[1] = vec![side.into()];
    }
    assembly.loads = vec![
        traction("upper_z_max", [2e6, 0.3e6, -9e6]),
        LoadSpec {
            on: "lower_x_min".into(),
            load: LoadKind::Pressure { pressure_pa: 4e6 },
        },
    ];
    assembly.springs = vec![SpringSpec {
        name: "side".into(),
        first: "upper_x_max".into(),
        second: None,
        stiffness_n_m: 3e7,
        direction: Some([0.8, 0.0, 0.6]),
    }];
    assembly.rotation = None;
    (assembly, mesh)
}

/// Applied loads of [`pressed`], and their moments about the origin.
fn applied() -> [[f64; 3]; 2] {
    let [x, y, z] = SIZE;
    let top = [2e6, 0.3e6, -9e6].map(|pa| pa * x * y);
    let side = [4e6 * y * z, 0.0, 0.0];
    sum([
        (top, [x / 2.0, y / 2.0, 2.0 * z]),
        (side, [0.0, y / 2.0, z / 2.0]),
    ]
    .into_iter())
}

#[track_caller]
fn assert_none(total: [f64; 3], scale: f64, tolerance: f64) {
    let off = total.map(|v| v.abs() / scale);
    println!("{:.1e} {:.1e} {:.1e}", off[0], off[1], off[2]);
    assert!(off.iter().all(|off| *off < tolerance), "{total:?} {scale}");
}

/// Without prestress loads and reactions are in equilibrium at the undeformed geometry, forces and
/// moments; with it forces are, where the centrifugal force is that at the displaced position.
/// Reactions are sums of 1e4 N that differ from those of the matrices by rounding.
#[test]
fn reactions_loads_and_centrifugal_forces_of_two_bodies_in_contact_are_in_equilibrium() {
    let (mut assembly, mesh) = pressed(ElementType::TET10, [5, 3, 2], [4, 3, 2]);
    let mut rotation = blocks_assembly().rotation.unwrap();
    rotation.bodies = vec!["upper".into(), "lower".into()];
    rotation.point_m = [0.0, 0.0, 0.1];
    rotation.speed_rad_s = 900.0;
    for prestress in [Prestress::None, Prestress::HeldFlanks] {
        rotation.prestress = prestress;
        assembly.rotation = Some(rotation.clone());
        let case = Case::new(&assembly, &mesh, 4);
        let (state, free, reactions) = case.static_reactions();
        let names = reactions
            .iter()
            .map(|r| (r.pusher, r.name.as_str(), r.body));
        assert_eq!(
            names.collect::<Vec<_>>(),
            [
                (Pusher::Support, "upper_y_min", 0),
                (Pusher::Support, "base", 1),
                (Pusher::Support, "lower_y_min", 1),
                (Pusher::Spring, "side", 0),
            ]
        );
        let mut total = sum_of(reactions.iter(), 0);
        let scale = reactions[1].force_n[0]
            .map(f64::abs)
            .into_iter()
            .fold(0.0, f64::max);
        let about = case.model.rotation.as_ref().unwrap();
        let omega2 = about.speed_rad_s.powi(2);
        let across = |v: [f64; 3]| [0.0, omega2 * v[1], omega2 * v[2]];
        for (b, body) in case.model.bodies.iter().enumerate() {
            let properties = mass_properties(body, Some(about)).unwrap();
            add_scaled(&mut total[0], 1.0, properties.centrifugal_force_n.unwrap());
            let arms = body.nodes_m.iter().map(|x| across(sub(*x, about.point_m)));
            let [force, moment] = moved_mass(body, &arms.collect::<Vec<_>>());
            assert_vector(force, properties.centrifugal_force_n.unwrap(), 1e-9 * scale);
            add_scaled(&mut total[1], 1.0, moment);
            if prestress == Prestress::HeldFlanks {
                let [moved, _] = case.moved_mass(b, &free[b]);
                assert!(across(moved).iter().any(|f| f.abs() > 1e-7 * scale));
                add_scaled(&mut total[0], 1.0, across(moved));
            }
        }
        let [force, moment] = applied();
        add_scaled(&mut total[0], 1.0, force);
        add_scaled(&mut total[1], 1.0, moment);
        assert_none(total[0], scale, 1e-9);
        if prestress == Prestress::None {
            assert_none(total[1], scale * SIZE[0], 1e-9);
        }
        // The upper body by itself, with the contact.
        let contacts = static_contact_resultants(&case.model, &state);
        let on_upper = reactions.iter().chain(&contacts).filter(|r| r.body == 0);
        let [mut force, _] = sum_of(on_upper, 0);
        let upper = mass_properties(&case.model.bodies[0], Some(about)).unwrap();
        add_scaled(&mut force, 1.0, upper.centrifugal_force_n.unwrap());
        add_scaled(&mut force, 1.0, traction_force());
        if prestress == Prestress::HeldFlanks {
            add_scaled(&mut force, 1.0, across(case.moved_mass(0, &free[0])[0]));
        }
        assert!(
            contacts[0].force_n[0][2] > 0.5 * scale,
            "the contact carries the upper body"
        );
        assert_none(force, scale, 1e-8);
    }
}

fn traction_force() -> [f64; 3] {
    [2e6, 0.3e6, -9e6].map(|pa| pa * SIZE[0] * SIZE[1])
}

/// A flank whose nodes are held bears what the other one is pressed on it with, whether it is bonded
/// or slides.
#[test]
fn a_support_of_flank_nodes_bears_the_force_of_the_contact() {
    for law in [ContactLaw::Bonded, blocks_assembly().contacts[0].law] {
        let (mut assembly, mesh) = pressed(ElementType::TET10, [5, 3, 2], [4, 3, 2]);
        assembly.bodies[1].fixed = vec!["lower_top".into()];
        assembly.contacts[0].law = law;
        assembly.contacts[0].slave = Some(Side::First);
        let case = Case::new(&assembly, &mesh, 4);
        let (_, _, reactions) = case.static_reactions();
        let mut total = sum_of(reactions.iter(), 0);
        let scale = reactions
            .iter()
            .map(|r| r.force_n[0][2].abs())
            .fold(0.0, f64::max);
        for (total, applied) in total.iter_mut().zip(applied()) {
            add_scaled(total, 1.0, applied);
        }
        assert_none(total[0], scale, 1e-9);
        assert_none(total[1], scale * SIZE[0], 1e-9);
        let of = |name: &str| reactions.iter().find(|r| r.name == name).unwrap();
        let upper = of("upper_y_min").force_n[0][2] + of("side").force_n[0][2];
        let borne = of("lower_top").force_n[0][2];
        assert!((borne + upper + traction_force()[2]).abs() < 1e-9 * scale);
    }
}

/// Supports are told apart by their groups. A node of the edge between two groups counts for the one
/// that fixes it, and a group that is named for two axes is one support.
#[test]
fn a_node_of_several_groups_counts_for_the_one_that_holds_it_first() {
    let (mut assembly, mesh) = pressed(ElementType::TET10, [4, 3, 2], [4, 3, 2]);
    let groups = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    assembly.bodies[1].fixed_along = [
        groups(&["lower_x_max"]),
        groups(&["lower_x_max", "lower_y_min"]),
        Vec::new(),
    ];
    assembly.contacts[0].slave = Some(Side::First);
    let case = Case::new(&assembly, &mesh, 4);
    let lower = &case.model.bodies[1];
    let [base, side, cut] = lower.supports.as_slice() else {
        panic!("{:?}", lower.supports);
    };
    let names = [&base.name, &side.name, &cut.name];
    assert_eq!(names, ["base", "lower_x_max", "lower_y_min"]);
    assert!(base.nodes.iter().all(|(_, axes)| *axes == [true; 3]));
    for (node, axes) in &side.nodes {
        assert_eq!(*axes, [true, true, false]);
        assert!(lower.nodes_m[*node as usize][2] > 1e-9);
    }
    for (node, axes) in &cut.nodes {
        assert_eq!(*axes, [false, true, false]);
        assert!(lower.nodes_m[*node as usize][0] < SIZE[0] - 1e-9);
    }
    let (_, _, reactions) = case.static_reactions();
    let mut total = sum_of(reactions.iter(), 0);
    for (total, applied) in total.iter_mut().zip(applied()) {
        add_scaled(total, 1.0, applied);
    }
    assert_none(total[0], 7200.0, 1e-9);
    assert_none(total[1], 7200.0 * SIZE[0], 1e-9);
}

/// In each harmonic reactions are inertia and damping less the excitation: exactly with all modes,
/// and with a few to twice the estimate of what the modes left out do to amplitudes. The base moves, too: its acceleration
/// pushes all mass, also that of held nodes, and 2e-6 m of harmonic 2 are an acceleration that grows
/// with the square of the frequency.
#[test]
fn reactions_over_a_period_are_inertia_damping_and_excitation() {
    let (mut assembly, mesh) = pressed(ElementType::HEX8, [3, 2, 1], [3, 2, 1]);
    let direction = [0.6, 0.0, 0.8];
    let base = |motion| ExcitationKind::Base { direction, motion };
    let excitations = [
        (
            ExcitationKind::force("corner", [1.0, 0.0, -0.5]),
            5000.0,
            1,
            0.4,
        ),
        (
            ExcitationKind::Load(traction("lower_x_max", [1.0, 0.0, 0.0])),
            5e5,
            1,
            0.9,
        ),
        (base(BaseMotion::Acceleration), 900.0, 1, 1.1),
        (base(BaseMotion::Displacement), 2e-7, 2, -0.7),
    ];
    let excitations = excitations.map(|(kind, amplitude, harmonic, phase_rad)| ExcitationSpec {
        kind,
        amplitude,
        harmonic,
        phase_rad,
    });
    assembly.excitations = excitations.to_vec();
    let damping = Rayleigh::new(2e-6, 300.0);
    for modes in [1000, 12] {
        let case = Case::new(&assembly, &mesh, modes);
        let state = static_state(&case.problem, 10, NEWTON);
        let first_hz = case.problem.reduced.omega2[0].sqrt() / TAU;
        let mut settings = SweepSettings::new(vec![0.4 * first_hz], Resolution::fixed(3, 256));
        settings.newton = NEWTON;
        let orbit = sweep(&case.problem, damping, &state, &settings, &[], &|_| ())
            .orbits
            .remove(0);
        assert!(orbit.outcome.is_converged());
        let (motion, reactions) = case.periodic_reactions(&orbit, damping);
        let omega = TAU * orbit.frequency_hz;
        let mut scale: f64 = 0.0;
        let mut totals = Vec::new();
        for block in 0..blocks(3) {
            let mut total = sum_of(reactions.iter(), block)[0];
            scale = if block == 0 { 0.0 } else { scale };
            for reaction in &reactions {
                scale = scale.max(dot(reaction.force_n[block], reaction.force_n[block]).sqrt());
            }
            let k = block.div_ceil(2) as f64;
            // The other coefficient of the harmonic, whose k w multiple is the velocity.
            let (other, sign) = if block % 2 == 1 {
                (block + 1, 1.0)
            } else {
                (block.max(1) - 1, -1.0)
            };
            let mut mass_kg = 0.0;
            for (b, motion) in motion.iter().enumerate() {
                let moved = case.moved_mass(b, motion.col_as_slice(block))[0];
                let velocity = case.moved_mass(b, motion.col_as_slice(other))[0];
                add_scaled(&mut total, (k * omega).powi(2), moved);
                add_scaled(&mut total, -damping.mass_per_s * sign * k * omega, velocity);
                mass_kg += mass_properties(&case.model.bodies[b], None)
                    .unwrap()
                    .mass_kg;
            }
            for excitation in excitations
                .iter()
                .filter(|e| e.harmonic == block.div_ceil(2))
            {
                let force = match &excitation.kind {
                    ExcitationKind::Base {
                        motion: BaseMotion::Acceleration,
                        ..
                    } => direction.map(|d| -mass_kg * d),
                    ExcitationKind::Base { .. } => {
                        direction.map(|d| mass_kg * (k * omega).powi(2) * d)
                    }
                    kind if kind.unit() == "N" => [1.0, 0.0, -0.5],
                    _ => [SIZE[1] * SIZE[2], 0.0, 0.0],
                };
                let (sin, cos) = excitation.phase_rad.sin_cos();
                let share = if block % 2 == 1 { cos } else { sin };
                add_scaled(&mut total, excitation.amplitude * share, force);
            }
            if block == 0 {
                add_scaled(&mut total, 1.0, applied()[0]);
                assert_none(total, scale, 1e-9);
            }
            totals.push(total);
        }
        let truncation = case.truncation.amplitude.unwrap();
        println!("{modes} modes: {truncation:.1e}");
        assert_eq!(truncation == 0.0, modes == 1000);
        let third = Spectrum::new(&orbit.lambda, 3).cosine(3);
        assert!(third.iter().any(|f| f.abs() > 1e-3 * scale), "pairs slip");
        for total in &totals[1..] {
            assert_none(*total, scale, (2.0 * truncation).max(1e-9));
        }
        if modes == 12 {
            let worst = totals[1..]
                .iter()
                .flatten()
                .fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(worst > 1e-7 * scale, "12 modes leave something out");
        }
    }
}

/// The root of a bar has the stress of the wave equation: under the traction T cos(w t) at its end
/// T / cos(k L), on a base of acceleration A cos(w t) rho A tan(k L) / k, with k the frequency over
/// the speed of sound. A steady traction stands everywhere, and a damping proportional to the
/// stiffness leaves it.
#[test]
fn the_root_of_a_bar_in_axial_vibration_reacts_as_the_wave_equation_says() {
    let direction = [1.0, 0.0, 0.0];
    let motion = BaseMotion::Acceleration;
    let kinds = [
        ExcitationKind::Load(traction("x_max", direction)),
        ExcitationKind::Base { direction, motion },
    ];
    for kind in kinds {
        let is_base = matches!(kind, ExcitationKind::Base { .. });
        let shaken = ExcitationSpec {
            kind,
            amplitude: 2e6,
            harmonic: 1,
            phase_rad: 0.0,
        };
        let (mut assembly, mesh, sound_m_s) = bar(ElementType::HEX20, 24, shaken);
        assembly.loads = vec![traction("x_max", [3e6, 0.0, 0.0])];
        let case = Case::new(&assembly, &mesh, 200);
        let area_m2 = 1e-4;
        for share in [0.01, 0.6, 1.4] {
            let wave_1_m = share * FRAC_PI_2 / LENGTH_M;
            let omega = wave_1_m * sound_m_s;
            let system = ContactSystem::new(&case.problem, Rayleigh::NONE);
            let orbit = linear_orbit(&system, 1, omega / TAU);
            let (_, reactions) = case.periodic_reactions(&orbit, Rayleigh::NONE);
            let [root] = reactions.as_slice() else {
                panic!("{reactions:?}");
            };
            assert_eq!(root.name, "x_min");
            let [mean, cosine, sine] = root.force_n[..] else {
                panic!("{root:?}");
            };
            assert!((mean[0] / (-3e6 * area_m2) - 1.0).abs() < 1e-9, "{mean:?}");
            let angle = wave_1_m * LENGTH_M;
            let expected = match is_base {
                false => -2e6 * area_m2 / angle.cos(),
                true => 2e6 * 2700.0 * area_m2 * angle.tan() / wave_1_m,
            };
            let off = cosine[0] / expected - 1.0;
            println!("{is_base} {share}: {off:.1e}");
            assert!(off.abs() < 1e-5, "{share}: {} {expected}", cosine[0]);
            assert!(sine[0].abs() < 1e-9 * expected.abs());
            assert_vector(root.about_m, [0.0, 0.005, 0.005], 1e-12);
            assert!(
                root.moment_nm
                    .iter()
                    .flatten()
                    .all(|m| m.abs() < 1e-9 * expected.abs())
            );
        }
    }
}

/// Matrices of another program that keep the rows of the support have the reactions of their
/// elements; those without them have no support. Where a node of the support has a rotation its
/// moment counts: a spring between it and the rotation of two other nodes leaves the equilibrium.
#[test]
fn matrices_with_the_rows_of_a_support_have_the_reactions_of_their_elements() {
    let (plain, mesh) = pressed(ElementType::TET10, [4, 3, 2], [4, 3, 2]);
    let given = |rows: RowsOfBase| {
        let mut assembly = plain.clone();
        assembly.bodies[1] = given_body(&plain.bodies[1], &mesh, rows);
        let (_, _, reactions) = Case::new(&assembly, &mesh, 4).static_reactions();
        reactions
    };
    let scale = 7200.0;
    let (_, _, expected) = Case::new(&plain, &mesh, 4).static_reactions();
    let found = given(RowsOfBase::Kept);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found.name, expected.name);
        assert_vector(found.force_n[0], expected.force_n[0], 1e-7 * scale);
        assert_vector(
            found.moment_nm[0],
            expected.moment_nm[0],
            1e-7 * scale * SIZE[0],
        );
    }
    let without = given(RowsOfBase::LeftOut);
    assert!(without.iter().all(|r| r.name != "base"), "{without:?}");
    let turned = given(RowsOfBase::WithRotation);
    let mut total = sum_of(turned.iter(), 0);
    for (total, applied) in total.iter_mut().zip(applied()) {
        add_scaled(total, 1.0, applied);
    }
    assert_none(total[0], scale, 1e-9);
    assert_none(total[1], scale * SIZE[0], 1e-9);
}

/// Rows of the base in the matrices of [`given_body`].
#[derive(Clone, Copy, PartialEq)]
enum RowsOfBase {
    Kept,
    LeftOut,
    /// With the rotation about z of one node of the base.
    WithRotation,
}

/// A body with the matrices of its elements.
fn given_body(spec: &BodySpec, mesh: &Mesh, base: RowsOfBase) -> BodySpec {
    let alone = Assembly {
        bodies: vec![BodySpec {
            fixed: match base {
                RowsOfBase::LeftOut => spec.fixed.clone(),
                RowsOfBase::Kept | RowsOfBase::WithRotation => Vec::new(),
            },
            fixed_along: Default::default(),
            ..spec.clone()
        }],
        ..Assembly::default()
    };
    let model = bind(&alone, mesh, None).unwrap();
    let body = &model.bodies[0];
    let all = assemble_body(body, None, &solve_by_cholesky).unwrap();
    let tags = body.free_node_tags();
    let rows = tags.iter();
    let rows = rows.flat_map(|&node| [1, 2, 3].map(|direction| Row::Node { node, direction }));
    let mut rows: Vec<Row> = rows.collect();
    let (mut stiffness, mut mass) = (all.stiffness, all.mass);
    if base == RowsOfBase::WithRotation {
        let node = |at: [f64; 3]| {
            let found = body.nodes_m.iter().position(|x| distance(*x, at) < 1e-9);
            body.dofs.free(found.unwrap() as u32).unwrap()
        };
        let [x, y, z] = SIZE;
        let [near, far] = [[0.0, y, z / 2.0], [x, y, z / 2.0]].map(node);
        let rotation = rows.len();
        rows.push(Row::Node {
            node: tags[node([0.0; 3])],
            direction: 6,
        });
        let spring = [
            (rotation, 1.0),
            (3 * far + 1, -1.0 / x),
            (3 * near + 1, 1.0 / x),
        ];
        let [mut larger, still] = [&stiffness, &mass].map(|a| {
            let mut coo = CooMatrix::new(rotation + 1, rotation + 1);
            for (i, j, v) in a.triplet_iter() {
                coo.push(i, j, *v);
            }
            coo
        });
        for (i, a) in spring {
            for (j, b) in spring {
                larger.push(i, j, 1e5 * a * b);
            }
        }
        (stiffness, mass) = (CscMatrix::from(&larger), CscMatrix::from(&still));
    }
    let given = GivenMatrices::new(stiffness, mass, rows, Units::MetreKilogramSecond);
    BodySpec {
        matrices: MatrixSource::Given(Arc::new(given.unwrap())),
        ..spec.clone()
    }
}
