//! Strain gauges: a cantilever and a bar in axial vibration against their closed forms, and gauges
//! that cannot be.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::shared_scenes::*;
use dovetail_mesh::{ElementType, Group, Mesh};
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::orbit::linear_orbit;
use dovetail_solver::fem::assemble;
use dovetail_solver::fem::statics::solve_by_cholesky;
use dovetail_solver::model::{
    ExcitationKind, ExcitationSpec, LoadKind, LoadSpec, Material, Model, ModelError,
    ObservationSpec, bind,
};
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use dovetail_testkit::block::block;

fn gauge(points: &str, direction: [f64; 3]) -> ObservationSpec {
    ObservationSpec {
        name: points.into(),
        points: points.into(),
        direction,
        quantity: ObservedQuantity::Strain,
    }
}

fn shaken(vector_pa: [f64; 3]) -> ExcitationSpec {
    ExcitationSpec {
        kind: ExcitationKind::Load(LoadSpec {
            on: "x_max".into(),
            load: LoadKind::Traction { vector_pa },
        }),
        amplitude: 1.0,
        harmonic: 1,
        phase_rad: 0.0,
    }
}

/// Adds the group of all nodes for which this is true.
fn add_nodes(mesh: &mut Mesh, name: &str, is_in: impl Fn([f64; 3]) -> bool) {
    let nodes = mesh.nodes_m.iter().enumerate();
    let nodes = nodes.filter(|(_, x)| is_in(**x)).map(|(n, _)| n as u32);
    let group = Group {
        dimension: 0,
        elements: Vec::new(),
        nodes: nodes.collect(),
    };
    mesh.groups.insert(name.into(), group);
}

/// What the gauges measure under the steady load.
fn static_strains(model: &Model) -> Vec<f64> {
    let structure = assemble(model).unwrap();
    let body = &structure.bodies[0];
    let free = solve_by_cholesky(&body.stiffness, &body.load_n).unwrap();
    let gauges = structure.observations.iter();
    gauges
        .map(|gauge| {
            assert_eq!(gauge.quantity, ObservedQuantity::Strain);
            gauge.load[0].iter().zip(&free).map(|(w, u)| w * u).sum()
        })
        .collect()
}

/// A cantilever of length L and height h under a force F across its end has the strain
/// F (L - x) h / (2 E I) on its upper face, along it, and -nu times that across, where the clamp and
/// the end are far. A patch measures the mean of its area, nodes that of the faces around them. Turned
/// by 45 degrees a gauge measures the mean of both, which is not shear's.
#[test]
fn gauges_on_a_cantilever_measure_the_strain_of_the_beam() {
    let (length, width, height) = (0.2, 0.01, 0.01);
    let material = Material {
        young_pa: 2.1e11,
        poisson: 0.3,
        density_kg_m3: 7800.0,
    };
    let mut mesh = block(ElementType::HEX20, [40, 4, 4], [length, width, height]);
    // Two elements along and four across, 15 elements from the clamp.
    add_nodes(&mut mesh, "patch", |[x, _, z]| {
        z > height - 1e-9 && (0.075 - 1e-9..=0.085 + 1e-9).contains(&x)
    });
    add_nodes(&mut mesh, "node", |[x, y, z]| {
        let at = [x - 0.08, y - width / 2.0, z - height];
        at.iter().all(|c| c.abs() < 1e-9)
    });
    let mut beam = body("beam", &["x_min"]);
    beam.volume = "volume".into();
    beam.matrices = material.into();
    let mut assembly = assembly(vec![beam], Vec::new(), "x_max");
    assembly.rotation = None;
    assembly.excitations.clear();
    let force_n = 50.0;
    let vector_n = [0.0, 0.0, -force_n];
    assembly.loads = vec![LoadSpec {
        on: "x_max".into(),
        load: LoadKind::Force { vector_n },
    }];
    let slant = [0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0];
    assembly.observations = vec![
        gauge("patch", [1.0, 0.0, 0.0]),
        gauge("patch", [0.0, 1.0, 0.0]),
        gauge("patch", slant),
        gauge("node", [1.0, 0.0, 0.0]),
        // It leaves the face by 20 degrees, and is laid on it.
        gauge("node", [0.94, 0.0, 0.342]),
    ];
    let model = bind(&assembly, &mesh, None).unwrap();
    let inertia_m4 = width * height.powi(3) / 12.0;
    let along = force_n * (length - 0.08) * height / 2.0 / (material.young_pa * inertia_m4);
    let factors = [
        1.0,
        -material.poisson,
        (1.0 - material.poisson) / 2.0,
        1.0,
        1.0,
    ];
    for ((found, factor), spec) in static_strains(&model)
        .iter()
        .zip(factors)
        .zip(&assembly.observations)
    {
        let error = found / (factor * along) - 1.0;
        println!(
            "{} {:?}: {found:.4e}, {error:.1e}",
            spec.name, spec.direction
        );
        assert!(error.abs() < 1e-6, "{}: {error:e}", spec.name);
    }
}

/// A bar under the traction T cos(w t) at its end has the strain T cos(k x) / (E cos(k L)), with k
/// the frequency over the speed of sound: a gauge on the whole of its side measures the mean, the
/// corner of its end the strain there.
#[test]
fn gauges_on_a_bar_in_axial_vibration_measure_the_strain_of_the_wave_equation() {
    for share in [0.01, 0.6, 1.4] {
        let (mut assembly, mesh, sound_m_s) = bar(ElementType::HEX20, 24, shaken([2e6, 0.0, 0.0]));
        let young_pa = 70e9;
        assembly.observations = vec![
            gauge("y_max", [1.0, 0.0, 0.0]),
            gauge("corner_111", [1.0, 0.0, 0.0]),
        ];
        let model = bind(&assembly, &mesh, None).unwrap();
        let wanted = StuckModes::new(Some(60), Highest::RadS(0.0));
        let reduction = reduce(assemble(&model).unwrap(), wanted).unwrap();
        let problem = dovetail_solver::run::problem(reduction.model, &model);
        let wave_1_m = share * FRAC_PI_2 / LENGTH_M;
        let system = ContactSystem::new(&problem, Rayleigh::NONE);
        let orbit = linear_orbit(&system, 1, wave_1_m * sound_m_s / TAU);
        let angle = wave_1_m * LENGTH_M;
        let end = 2e6 / young_pa;
        let mean = end * angle.tan() / angle;
        // The faces around the corner are the last 24th of the length, l: the mean there is
        // (sin(k L) - sin(k (L - l))) / (k l) over cos(k L).
        let l = angle / 24.0;
        let corner = end * (angle.sin() - (angle - l).sin()) / (l * angle.cos());
        for (i, expected) in [mean, corner].into_iter().enumerate() {
            let error = orbit.observed[i][1] / expected - 1.0;
            println!("{share} {i}: {error:.1e}");
            assert!(error.abs() < 1e-5, "{share}: {error:e}");
        }
    }
}

/// A gauge lies along a face: across it, on a node inside the body, or on a volume it is refused.
#[test]
fn gauges_that_lie_on_no_face_are_refused() {
    let (mut assembly, mut mesh, _) = bar(ElementType::TET10, 3, shaken([1.0, 0.0, 0.0]));
    mesh.groups.insert(
        "edge".into(),
        Group {
            dimension: 1,
            ..mesh.groups["corner_111"].clone()
        },
    );
    let mut refused = |points: &str, direction: [f64; 3]| -> Option<ModelError> {
        assembly.observations = vec![gauge(points, direction)];
        bind(&assembly, &mesh, None).err()
    };
    let across = refused("y_max", [0.0, 1.0, 0.0]);
    assert!(
        matches!(&across, Some(ModelError::GaugeSteep { degrees, among_several: false, .. })
            if (degrees - 90.0).abs() < 1e-6),
        "{across:?}"
    );
    let volume = refused("bar", [1.0, 0.0, 0.0]);
    assert!(
        matches!(volume, Some(ModelError::GaugeDimension { .. })),
        "{volume:?}"
    );
    // Along no edge and on no face, which are 55 degrees away or 35.
    let space = refused("corner_111", [1.0, 1.0, 1.0].map(|c: f64| c / 3f64.sqrt()));
    assert!(
        matches!(&space, Some(ModelError::GaugeSteep { degrees, among_several: true, .. })
            if (degrees - 35.264).abs() < 1e-2),
        "{space:?}"
    );
    for points in ["corner_111", "edge", "y_max"] {
        assert!(refused(points, [1.0, 0.0, 0.0]).is_none(), "{points}");
    }
}
