//! Artificial model, static state and response that are consistent with one another.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use dovetail_mesh::{Connectivity, ElementOrder, Shape};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::retention::Mean;
use dovetail_solver::dlft::{
    Branch, CycleStatus, FigureErrors, LinearPoint, Orbit, Outcome, PairCycle, PairStatus,
    Response, StaticState,
};
use dovetail_solver::model::{
    Body, BodyNode, ContactPair, DofMap, Material, MatrixOrigin, Model, NodeMotion, Observation,
    Side, Slave,
};
use dovetail_solver::problem::LinearReference;
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::reduced::ReducedModel;
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::stability::Stability;
use faer::Mat;

const HARMONICS: usize = 3;

/// All data that a run passes to the export.
pub struct Run {
    pub model: Model,
    pub static_state: StaticState,
    pub static_displacement: [NodalField; 2],
    pub stress: [Vec<[f64; 6]>; 2],
    pub von_mises: [Vec<f64>; 2],
    pub response: Response,
    /// The 2H+1 nodal fields of each body, at the peak.
    pub motion: [Vec<NodalField>; 2],
}

/// Run with two flanks at 45 degrees with `nu` x `nv` pairs each; every flank triangle has one
/// tetrahedron of either body.
pub fn run(order: ElementOrder, nu: usize, nv: usize) -> Run {
    let model = model(order, nu, nv);
    let static_state = static_state(&model);
    let wave = |b: usize, n: usize, a: usize, s: f64| {
        1e-6 * ((1 + b) as f64 * 0.7 + n as f64 * 0.37 + a as f64 * 1.9 + s).sin()
    };
    let mut static_displacement = [0, 1].map(|b| -> NodalField {
        (0..model.bodies[b].nodes_m.len())
            .map(|n| [0, 1, 2].map(|a| wave(b, n, a, 0.0)))
            .collect()
    });
    for (i, pair) in model.pairs.iter().enumerate() {
        let x = &static_state.x[3 * i..3 * i + 3];
        let [b, j] = [pair.slave.node, pair.slave.partner().unwrap()].map(|at| at.node as usize);
        let relative = |a: usize| (0..3).map(|row| x[row] * pair.frame[row][a]).sum::<f64>();
        let held = static_displacement[1][j];
        static_displacement[0][b] = [0, 1, 2].map(|a| held[a] + relative(a));
    }
    let motion = [0, 1].map(|b| -> Vec<NodalField> {
        (0..2 * HARMONICS + 1)
            .map(|c| {
                (0..model.bodies[b].nodes_m.len())
                    .map(|n| [0, 1, 2].map(|a| wave(b, n, a, 5.3 * c as f64) / (1 + c) as f64))
                    .collect()
            })
            .collect()
    });
    let stress = [0, 1].map(|b| {
        (0..model.bodies[b].elements.len())
            .map(|e| [0, 1, 2, 3, 4, 5].map(|c| 1e6 * (10 * e + c + 100 * b) as f64))
            .collect()
    });
    let von_mises = [0, 1].map(|b| {
        (0..model.bodies[b].nodes_m.len())
            .map(|n| 1e5 * n as f64)
            .collect()
    });
    let response = response(&model, &motion);
    Run {
        model,
        static_state,
        static_displacement,
        stress,
        von_mises,
        response,
        motion,
    }
}

/// Linear tetrahedra of one body.
struct Corners {
    nodes_m: Vec<[f64; 3]>,
    tets: Vec<u32>,
}

fn model(order: ElementOrder, nu: usize, nv: usize) -> Model {
    let material = Material {
        young_pa: 1e11,
        poisson: 0.3,
        density_kg_m3: 4000.0,
    };
    let mut bodies = [(); 2].map(|()| Corners {
        nodes_m: vec![],
        tets: vec![],
    });
    let (mut pairs, mut triangles) = (Vec::new(), Vec::new());
    let (length, width) = (35.3e-3, 4.5e-3);
    for flank in 0..2 {
        let side = if flank == 0 { 1.0 } else { -1.0 };
        let (s, c) = (FRAC_1_SQRT_2, FRAC_1_SQRT_2);
        let t1 = [1.0, 0.0, 0.0];
        let n = [0.0, side * s, c];
        let t2 = [
            n[1] * t1[2] - n[2] * t1[1],
            n[2] * t1[0] - n[0] * t1[2],
            n[0] * t1[1] - n[1] * t1[0],
        ];
        let first_pair = pairs.len() as u32;
        let place = |u: f64, v: f64, h: f64| {
            let origin = [0.0, side * 8e-3, 0.0];
            [0, 1, 2].map(|a| origin[a] + u * t1[a] + v * t2[a] + h * n[a])
        };
        let (du, dv) = (length / (nv - 1) as f64, width / (nu - 1) as f64);
        for iv in 0..nv {
            for iu in 0..nu {
                let position = place(iv as f64 * du, iu as f64 * dv, 0.0);
                let border = |i: usize, n: usize| if i == 0 || i + 1 == n { 0.5 } else { 1.0 };
                let nodes = [0, 1].map(|b| {
                    bodies[b].nodes_m.push(position);
                    bodies[b].nodes_m.len() as u32 - 1
                });
                pairs.push(ContactPair {
                    contact: flank,
                    slave: Slave {
                        ahead: 0,
                        node: BodyNode {
                            body: 0,
                            node: nodes[0],
                        },
                        masters: vec![(
                            BodyNode {
                                body: 1,
                                node: nodes[1],
                            },
                            1.0,
                        )],
                    },
                    side: Side::First,
                    position_m: position,
                    frame: [n, t1, t2],
                    area_m2: du * dv * border(iv, nv) * border(iu, nu),
                    law: PairLaw::rigid(0.3, if iu == 0 && iv == 0 { 2e-6 } else { 0.0 }),
                });
            }
        }
        for iv in 0..nv - 1 {
            for iu in 0..nu - 1 {
                let a = first_pair + (iv * nu + iu) as u32;
                let (b, c, d) = (a + 1, a + nu as u32 + 1, a + nu as u32);
                triangles.extend([vec![a, b, c], vec![a, c, d]]);
            }
        }
        for t in triangles.iter().filter(|t| t[0] >= first_pair) {
            for (b, body) in bodies.iter_mut().enumerate() {
                let nodes = [0, 1, 2].map(|k| match (&pairs[t[k] as usize], b) {
                    (pair, 0) => pair.slave.node.node,
                    (pair, _) => pair.slave.partner().unwrap().node,
                });
                let centroid = [0, 1, 2].map(|a| {
                    let corner = |n: u32| body.nodes_m[n as usize][a];
                    nodes.iter().map(|&n| corner(n)).sum::<f64>() / 3.0
                });
                let height = if b == 0 { 4e-3 } else { -4e-3 };
                body.nodes_m
                    .push([0, 1, 2].map(|a| centroid[a] + height * n[a]));
                let apex = body.nodes_m.len() as u32 - 1;
                let mut tet = [nodes[0], nodes[1], nodes[2], apex];
                if volume(&body.nodes_m, &tet) < 0.0 {
                    tet.swap(0, 1);
                }
                body.tets.extend(tet);
            }
        }
    }
    let observed = bodies[0].nodes_m.len() as u32 - 1;
    let mut names = [("blade", 1000), ("jaw", 5000)].into_iter();
    let [blade, jaw] = bodies.map(|Corners { mut nodes_m, tets }| {
        let (name, first_tag) = names.next().unwrap();
        let mut elements = Connectivity::default();
        let tets = match order {
            ElementOrder::Linear => tets.chunks_exact(4).map(<[u32]>::to_vec).collect(),
            ElementOrder::Quadratic => add_edge_nodes(&mut nodes_m, &tets),
        };
        for (nodes, e) in tets.into_iter().zip(0..) {
            elements.push(first_tag + 7 * e, nodes);
        }
        Body {
            name: name.to_owned(),
            matrices: MatrixOrigin::Elements(material),
            rotates: true,
            fixed_interface_modes: None,
            mesh_nodes: (0..nodes_m.len() as u32).collect(),
            node_tags: (0..nodes_m.len() as u64)
                .map(|n| first_tag + 3 * n)
                .collect(),
            held_dofs: Vec::new(),
            supports: Vec::new(),
            loads: Vec::new(),
            springs: Vec::new(),
            dofs: DofMap {
                nodes: vec![NodeMotion::Fixed; nodes_m.len()],
                auxiliary: Vec::new(),
                interior_nodes: 5,
                contact_nodes: pairs.len(),
            },
            nodes_m,
            elements,
            facets: Connectivity::default(),
        }
    });
    let at = |body, node| BodyNode { body, node };
    Model {
        bodies: vec![blade, jaw],
        rotation: None,
        cyclic: None,
        pairs,
        bonded: Vec::new(),
        flank_facets: triangles,
        contact_names: vec!["left".into(), "right, \"skewed\"".into()],
        excitations: vec![],
        maps: vec![],
        friction_maps: vec![],
        dashpots: vec![],
        observations: vec![
            Observation {
                name: "tip".into(),
                quantity: ObservedQuantity::Displacement,
                terms: vec![
                    (at(0, observed), [0.0, 0.6, 0.8]),
                    (at(0, observed - 1), [0.5, 0.0, 0.0]),
                ],
            },
            Observation {
                name: "rim".into(),
                quantity: ObservedQuantity::Displacement,
                terms: vec![(at(1, 0), [1.0, 0.0, 0.0])],
            },
        ],
        matches: Vec::new(),
        straightened: Vec::new(),
    }
}

fn volume(nodes: &[[f64; 3]], tet: &[u32]) -> f64 {
    let p = |i: usize| nodes[tet[i] as usize];
    let edge = |i: usize| [0, 1, 2].map(|a| p(i)[a] - p(0)[a]);
    let (a, b, c) = (edge(1), edge(2), edge(3));
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// Ten-node tetrahedra on the corners of linear ones.
fn add_edge_nodes(nodes: &mut Vec<[f64; 3]>, corners: &[u32]) -> Vec<Vec<u32>> {
    let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let mut tets = Vec::new();
    for tet in corners.chunks_exact(4) {
        let mut all = tet.to_vec();
        for &[i, j] in Shape::Tetrahedron.edges() {
            let (a, b) = (tet[i].min(tet[j]), tet[i].max(tet[j]));
            let middle = *middles.entry((a, b)).or_insert_with(|| {
                let (p, q) = (nodes[a as usize], nodes[b as usize]);
                nodes.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
                nodes.len() as u32 - 1
            });
            all.push(middle);
        }
        tets.push(all);
    }
    tets
}

/// Static state whose pressure falls from the middle of the flanks; the first pair (with clearance)
/// is open.
fn static_state(model: &Model) -> StaticState {
    let (mut x, mut lambda, mut status) = (Vec::new(), Vec::new(), Vec::new());
    for (i, pair) in model.pairs.iter().enumerate() {
        let open = i == 0;
        let force = pair.area_m2 * 2e7 * (1.3 - (pair.position_m[0] / 35.3e-3 - 0.5).abs());
        x.extend([
            if open { 1e-7 } else { -pair.law.gap_m },
            1e-6 * (i as f64).sin(),
            1.2e-5,
        ]);
        lambda.extend(if open {
            [0.0; 3]
        } else {
            [-force, 0.1 * force, 0.25 * force]
        });
        status.push(match (open, i % 3) {
            (true, _) => PairStatus::Open,
            (false, 1) => PairStatus::Stuck,
            _ => PairStatus::Slipping,
        });
    }
    StaticState {
        outcome: Outcome::Converged,
        x,
        lambda,
        status,
        newton_iterations: 7,
        residual: 1e-12,
        retention_n: None,
        linear: LinearReference::stuck(&pairless_model()),
        on_path: Vec::new(),
        ended_at: None,
    }
}

/// Reduced model with one mode that nothing excites.
fn pairless_model() -> ReducedModel {
    let nothing = || Mat::zeros(0, 0);
    ReducedModel::new(nothing(), nothing(), Mat::zeros(0, 1), vec![1.0])
}

/// Response with a resonance at 377 Hz that is cut off by friction; points 3 and 17 did not
/// converge.
fn response(model: &Model, motion: &[Vec<NodalField>; 2]) -> Response {
    let (points, f0) = (31, 377.0);
    let frequency = |i: usize| f0 * (0.97 + 0.06 * i as f64 / (points - 1) as f64);
    let shape: Vec<Vec<f64>> = model
        .observations
        .iter()
        .map(|o| observed(o, motion))
        .collect();
    let amplitude = |c: &[f64]| {
        let at = |wt: f64| -> f64 {
            (1..=HARMONICS)
                .map(|k| {
                    let a = k as f64 * wt;
                    c[2 * k - 1] * a.cos() + c[2 * k] * a.sin()
                })
                .sum()
        };
        (0..4096)
            .map(|s| at(TAU * s as f64 / 4096.0).abs())
            .fold(0.0, f64::max)
    };
    // Scale of the motion: 1 at the top, where `motion` is the motion.
    let gain = |f: f64, damping: f64| {
        let r = f / f0;
        2.0 * 0.004 / ((1.0 - r * r).powi(2) + (2.0 * damping * r).powi(2)).sqrt()
    };
    let orbits = (0..points).map(|i| {
        let (f, g) = (frequency(i), gain(frequency(i), 0.004));
        let outcome = match i {
            3 => Outcome::IterationLimit,
            17 => Outcome::NotFinite,
            _ => Outcome::Converged,
        };
        let bad = if i == 17 { f64::NAN } else { 1.0 };
        let cycles: Vec<PairCycle> = model
            .pairs
            .iter()
            .enumerate()
            .map(|(p, pair)| {
                let mean = pair.area_m2 * 1e7 * (1.0 + 0.2 * (p as f64).cos());
                let swing = mean * g * (0.4 + 0.7 * (p % 4) as f64 / 3.0);
                let slid = 1e-6 * g * (p % 4) as f64;
                let open_fraction = if swing > mean { 0.1 } else { 0.0 };
                PairCycle {
                    status: CycleStatus::new(p == 0, open_fraction, slid > 1e-7),
                    slid_m: slid,
                    rubbed_nm: mean * slid,
                    open_fraction,
                    compression_mean_n: mean,
                    compression_min_n: (mean - swing).max(0.0),
                    compression_max_n: mean + swing,
                    landing: None,
                    friction_power_w: 0.3 * mean * slid * f,
                }
            })
            .collect();
        let friction_power_w: f64 = cycles.iter().map(|c| c.friction_power_w).sum();
        let observed: Vec<Vec<f64>> = shape
            .iter()
            .map(|s| s.iter().map(|c| c * g * bad).collect())
            .collect();
        Orbit {
            frequency_hz: f,
            point: i,
            outcome,
            harmonics: HARMONICS,
            x: vec![],
            lambda: vec![],
            modal: vec![],
            newton_residuals: vec![],
            cycles,
            observed_amplitude: observed.iter().map(|c| amplitude(c) * bad).collect(),
            observed,
            friction_power_w: friction_power_w * bad,
            viscous_power_w: 0.01 * g * g,
            input_power_w: friction_power_w + 0.01 * g * g,
            kinetic_energy_j: 0.2 * g * g,
            newton_iterations: 5 + i % 3,
            krylov_iterations: 40,
            estimated_error: Some(0.004),
            observed_error: vec![0.004, 0.001],
            figure_errors: Some(FigureErrors {
                friction_power_w: 1e-3 * friction_power_w,
                viscous_power_w: 1e-5 * g * g,
                pairs: Vec::new(),
            }),
            mean: Mean::Free,
            retention_n: 0.0,
            stability: Stability::default(),
            residual: 1e-9 * bad,
        }
    });
    let linear = (0..points).map(|i| LinearPoint {
        frequency_hz: frequency(i),
        observed_amplitude: shape
            .iter()
            .map(|s| amplitude(s) * gain(frequency(i), 0.001))
            .collect(),
    });
    let linear: Vec<LinearPoint> = linear.collect();
    Response {
        linear: linear.clone(),
        linear_curve: linear,
        orbits: orbits.collect(),
        branches: vec![Branch::swept(points)],
        second_motions: Vec::new(),
        bifurcations: Vec::new(),
        two_periods: Vec::new(),
        slip_threshold_m: 1e-7,
    }
}

/// Fourier coefficients of an observation, from those of the nodes.
pub fn observed(observation: &Observation, motion: &[Vec<NodalField>; 2]) -> Vec<f64> {
    let value = |c: usize| {
        let term = |&(BodyNode { body, node }, direction): &(BodyNode, [f64; 3])| -> f64 {
            (0..3)
                .map(|a| direction[a] * motion[body][c][node as usize][a])
                .sum()
        };
        observation.terms.iter().map(term).sum()
    };
    (0..2 * HARMONICS + 1).map(value).collect()
}

pub fn scaled(motion: &[Vec<NodalField>; 2], gain: f64) -> [Vec<NodalField>; 2] {
    let mut motion = motion.clone();
    motion
        .iter_mut()
        .flatten()
        .flatten()
        .flatten()
        .for_each(|u| *u *= gain);
    motion
}
