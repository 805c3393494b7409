//! Stress of the bodies over one period, and what a designer reads from it: mean and amplitude of
//! the equivalent stress, their use of the strength of the material, and the places where they are
//! highest.

use std::collections::HashMap;
use std::f64::consts::TAU;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::recovery::NodalField;
use crate::fem::stress::{nodal_stress, von_mises};
use crate::model::{AppliedLoad, Body, BodyNode, Model, NodeMotion, SpringSupport, Strength};
use dovetail_mesh::element::facet_corners;

/// Stress of each node, Pa: xx, yy, zz, xy, yz, xz.
pub(crate) type NodalStress = Vec<[f64; 6]>;

/// Stress of one body over a period.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct BodyStress {
    /// The 2H+1 fields of the nodes, Pa: mean, cosine 1, sine 1, ...
    pub coefficients_pa: Vec<NodalStress>,
    /// Cycle of each node.
    pub cycles: Vec<StressCycle>,
}

/// Stress of one place over a period, as equivalent stresses of von Mises.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct StressCycle {
    /// Equivalent of the mean stress, Pa, with the sign of its trace: positive in tension.
    pub mean_pa: f64,
    /// Half of the largest equivalent of the difference of the stresses at two instants, Pa.
    pub amplitude_pa: f64,
    /// Largest equivalent stress of the period, Pa.
    pub largest_pa: f64,
}

impl StressCycle {
    /// Cycle of the stresses `mean + sum_k cosine_k cos(k w t) + sine_k sin(k w t)`, Pa, which are
    /// given as mean, cosine 1, sine 1, ...
    pub(crate) fn new(coefficients_pa: &[[f64; 6]]) -> Self {
        let Some((mean, moving)) = coefficients_pa.split_first() else {
            return Self::default();
        };
        let equivalent = von_mises(*mean);
        let trace = mean[0] + mean[1] + mean[2];
        // A length in this space is an equivalent stress.
        let mean = deviator(*mean);
        let moving = StressMotion(moving.iter().copied().map(deviator).collect());
        let instants = (SAMPLES * moving.harmonics()).clamp(LEAST_SAMPLES, MOST_SAMPLES);
        let step = TAU / instants as f64;
        let path: Vec<[f64; 6]> = (0..instants)
            .map(|i| moving.deviator(step * i as f64))
            .collect();
        let origin = mean.map(|m| -m);
        let (mut range, mut farthest) = (-1.0, [0; 2]);
        let (mut size, mut largest) = (-1.0, 0);
        for (i, here) in path.iter().enumerate() {
            let from_origin = squared_distance(here, &origin);
            if from_origin >= size {
                (size, largest) = (from_origin, i);
            }
            for (j, there) in path[..i].iter().enumerate() {
                let between = squared_distance(here, there);
                if between >= range {
                    (range, farthest) = (between, [i, j]);
                }
            }
        }
        let instant_rad = |i: usize| step * i as f64;
        let range = moving.local_maximum(
            |[a, b]| squared_distance(a, b),
            farthest.map(instant_rad),
            step,
        );
        let size = moving.local_maximum(
            |[a]| squared_distance(a, &origin),
            [instant_rad(largest)],
            step,
        );
        Self {
            mean_pa: if trace < 0.0 { -equivalent } else { equivalent },
            amplitude_pa: 0.5 * range.sqrt(),
            largest_pa: size.sqrt(),
        }
    }

    /// Share of the strength that the cycle uses, by the line of Goodman: amplitude over endurance
    /// and mean over ultimate strength. A mean in compression counts as none. The cycle is safe
    /// below 1.
    pub fn utilisation(&self, strength: Strength) -> f64 {
        self.amplitude_pa / strength.endurance_pa + self.mean_pa.max(0.0) / strength.ultimate_pa
    }
}

/// Instants of a period for each harmonic at which a largest stress is looked for first.
const SAMPLES: usize = 8;
/// Least number of these instants.
const LEAST_SAMPLES: usize = 32;
/// Largest number of these instants.
const MOST_SAMPLES: usize = 96;
/// Halvings of the step by which a largest stress is looked for between the instants.
const HALVINGS: usize = 12;

/// Vector whose length is the equivalent stress of von Mises.
fn deviator(s: [f64; 6]) -> [f64; 6] {
    let (half, three) = (0.5_f64.sqrt(), 3.0_f64.sqrt());
    [
        half * (s[0] - s[1]),
        half * (s[1] - s[2]),
        half * (s[2] - s[0]),
        three * s[3],
        three * s[4],
        three * s[5],
    ]
}

fn squared_distance(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Part of a stress that changes with time, as deviators: cosine 1, sine 1, ...
struct StressMotion(Vec<[f64; 6]>);

impl StressMotion {
    fn harmonics(&self) -> usize {
        self.0.len() / 2
    }

    /// Deviator at a phase of the period.
    fn deviator(&self, phase_rad: f64) -> [f64; 6] {
        let (first_sin, first_cos) = phase_rad.sin_cos();
        let (mut sin, mut cos) = (first_sin, first_cos);
        let mut sum = [0.0; 6];
        for pair in self.0.chunks_exact(2) {
            for ((sum, c), s) in sum.iter_mut().zip(pair[0]).zip(pair[1]) {
                *sum += cos * c + sin * s;
            }
            (sin, cos) = (
                sin * first_cos + cos * first_sin,
                cos * first_cos - sin * first_sin,
            );
        }
        sum
    }

    /// Largest value near `N` phases, by steps of each of them that are halved where none rises.
    fn local_maximum<const N: usize>(
        &self,
        value: impl Fn([&[f64; 6]; N]) -> f64,
        mut phases_rad: [f64; N],
        step: f64,
    ) -> f64 {
        let mut places = phases_rad.map(|phase_rad| self.deviator(phase_rad));
        let mut best = value(places.each_ref());
        let (mut step, mut halvings) = (0.5 * step, 0);
        while halvings < HALVINGS {
            let mut rises = false;
            for i in 0..N {
                for way in [-step, step] {
                    let phase_rad = phases_rad[i] + way;
                    let other = self.deviator(phase_rad);
                    let mut others = places.each_ref();
                    others[i] = &other;
                    let candidate = value(others);
                    if candidate > best {
                        (best, phases_rad[i], places[i], rises) =
                            (candidate, phase_rad, other, true);
                    }
                }
            }
            if !rises {
                step *= 0.5;
                halvings += 1;
            }
        }
        best
    }
}

/// Stress of each body whose nodes have the motion `motion_m[b]`: 2H+1 fields, mean, cosine 1,
/// sine 1, ... Bodies whose matrices come from another program have no stress, which is zero.
pub fn dynamic_stress(model: &Model, motion_m: &[Vec<NodalField>]) -> Vec<BodyStress> {
    let bodies = harmonic_stress(model, motion_m).into_iter();
    let with_cycles = |coefficients_pa: Vec<NodalStress>| {
        let nodes = coefficients_pa.first().map_or(0, Vec::len);
        let cycle = |node: usize| StressCycle::new(&node_stress(&coefficients_pa, node));
        BodyStress {
            cycles: (0..nodes).into_par_iter().map(cycle).collect(),
            coefficients_pa,
        }
    };
    bodies.map(with_cycles).collect()
}

/// The 2H+1 fields of the stress of each body, Pa, from those of the motion of its nodes.
pub(crate) fn harmonic_stress(
    model: &Model,
    motion_m: &[Vec<NodalField>],
) -> Vec<Vec<NodalStress>> {
    let bodies = model.bodies.iter().zip(motion_m);
    let of_body = |(body, fields): (&Body, &Vec<NodalField>)| {
        let fields = fields.par_iter();
        fields.map(|field| nodal_stress(body, field)).collect()
    };
    bodies.map(of_body).collect()
}

/// Stress of a node over the period, Pa, from the fields of all: mean, cosine 1, sine 1, ...
pub(crate) fn node_stress(coefficients_pa: &[NodalStress], node: usize) -> Vec<[f64; 6]> {
    coefficients_pa.iter().map(|field| field[node]).collect()
}

/// Reason why the stress of a place is a number of the mesh: in theory it grows without bound as
/// the mesh is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Singular {
    /// The place is at a support.
    Support,
    /// The place is at the edge of a flank.
    FlankEdge,
    /// A force or a spring acts on a point.
    PointLoad,
}

impl Singular {
    /// All reasons.
    pub(crate) const ALL: [Self; 3] = [Self::Support, Self::FlankEdge, Self::PointLoad];

    /// Reason in a few words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Support => "at a support",
            Self::FlankEdge => "at the edge of a flank",
            Self::PointLoad => "at a point load",
        }
    }
}

/// Nodes of each body at which the stress is singular, and all others of the elements that they
/// belong to, with the reason.
pub fn singular_nodes(model: &Model) -> Vec<Vec<Option<Singular>>> {
    let bodies = model.bodies.iter();
    let mut marks: Vec<Vec<Option<Singular>>> = bodies.map(support_singularities).collect();
    let mut mark = |body: usize, node: u32, reason: Singular| {
        // Auxiliary nodes of springs are no nodes of the mesh.
        if let Some(place) = marks[body].get_mut(node as usize) {
            place.get_or_insert(reason);
        }
    };
    for (body, nodes) in flank_edges(model).into_iter().enumerate() {
        for node in nodes {
            mark(body, node, Singular::FlankEdge);
        }
    }
    for (body, on) in model.bodies.iter().enumerate() {
        for (_, load) in &on.loads {
            if let AppliedLoad::Point { node, .. } = load {
                mark(body, *node, Singular::PointLoad);
            }
        }
        for spring in &on.springs {
            let nodes: Vec<u32> = match &spring.on {
                SpringSupport::Nodes(nodes) => nodes.clone(),
                SpringSupport::Chain(chain) => chain.links.iter().map(|(node, _)| *node).collect(),
                SpringSupport::Surface(_) => Vec::new(),
            };
            for node in nodes {
                mark(body, node, Singular::PointLoad);
            }
        }
    }
    for (body, load) in model.excitations.iter().flat_map(|e| &e.loads) {
        if let AppliedLoad::Point { node, .. } = load {
            mark(*body, *node, Singular::PointLoad);
        }
    }
    let bodies = model.bodies.iter().zip(marks);
    bodies
        .map(|(body, own)| extend_to_elements(body, &own))
        .collect()
}

/// Supports of a body.
fn support_singularities(body: &Body) -> Vec<Option<Singular>> {
    let held: std::collections::HashSet<u32> = body.held_dofs.iter().map(|dof| dof / 3).collect();
    let is_support = |motion: &NodeMotion| match motion {
        NodeMotion::Fixed => true,
        NodeMotion::Free(free) => held.contains(free),
        NodeMotion::Tied(_) => false,
    };
    let nodes = body.dofs.nodes.iter();
    nodes
        .map(|motion| is_support(motion).then_some(Singular::Support))
        .collect()
}

/// Marks all nodes of elements with a marked node: what is singular at one node counts in the
/// whole element.
fn extend_to_elements(body: &Body, own: &[Option<Singular>]) -> Vec<Option<Singular>> {
    let mut marks = own.to_vec();
    for nodes in body.elements.iter() {
        let reason = nodes.iter().find_map(|&node| own[node as usize]);
        if let Some(reason) = reason {
            for &node in nodes {
                marks[node as usize].get_or_insert(reason);
            }
        }
    }
    marks
}

/// Corners of each body at the edges of its flanks: flanks are faces of elements all of whose
/// corners are nodes of one contact, and their edges belong to one such face alone.
fn flank_edges(model: &Model) -> Vec<Vec<u32>> {
    let mut contacts_of: Vec<HashMap<u32, Vec<usize>>> = vec![HashMap::new(); model.bodies.len()];
    let mut add = |at: BodyNode, contact: usize| {
        let contacts = contacts_of[at.body].entry(at.node).or_default();
        if !contacts.contains(&contact) {
            contacts.push(contact);
        }
    };
    for pair in &model.pairs {
        add(pair.slave.node, pair.contact);
        for (master, _) in &pair.slave.masters {
            add(*master, pair.contact);
        }
    }
    // Bonded flanks of all contacts count as one more.
    for slave in &model.bonded {
        add(slave.node, model.contact_names.len());
        for (master, _) in &slave.masters {
            add(*master, model.contact_names.len());
        }
    }
    let bodies = model.bodies.iter().zip(&contacts_of);
    bodies.map(|(body, of)| flank_edges_of(body, of)).collect()
}

fn flank_edges_of(body: &Body, contacts_of: &HashMap<u32, Vec<usize>>) -> Vec<u32> {
    let mut edges: HashMap<(usize, [u32; 2]), usize> = HashMap::new();
    let solids = body.elements.solids();
    for (element, nodes) in
        solids.filter(|(_, nodes)| nodes.iter().any(|n| contacts_of.contains_key(n)))
    {
        for (f, _) in element.sorted_faces(nodes) {
            let face = element.face_of(f, nodes);
            let corners = &face[..facet_corners(face.len())];
            let of_corner = |node: &u32| contacts_of.get(node).map_or(&[][..], Vec::as_slice);
            for &contact in of_corner(&corners[0]) {
                if !corners
                    .iter()
                    .all(|node| of_corner(node).contains(&contact))
                {
                    continue;
                }
                for (i, &a) in corners.iter().enumerate() {
                    let b = corners[(i + 1) % corners.len()];
                    *edges.entry((contact, [a.min(b), a.max(b)])).or_default() += 1;
                }
            }
        }
    }
    let outer = edges.into_iter().filter(|(_, faces)| *faces == 1);
    let mut nodes: Vec<u32> = outer.flat_map(|((_, edge), _)| edge).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Place where the stress is higher than at all nodes around it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StressPlace {
    /// Body in [`Model::bodies`], and its node.
    pub at: BodyNode,
    /// Stress over the period.
    pub cycle: StressCycle,
    /// Share of the strength that is used; `None` where the body has no strength.
    pub utilisation: Option<f64>,
    /// Reason why the stress is a number of the mesh; `None` elsewhere.
    pub singular: Option<Singular>,
    /// Estimated mesh error; `None` if it is not known.
    pub error: Option<StressError>,
}

/// Estimated mesh error of a cycle of stress; none of its figures is negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StressError {
    /// Error of [`StressCycle::mean_pa`], Pa.
    pub mean_pa: f64,
    /// Error of [`StressCycle::amplitude_pa`], Pa.
    pub amplitude_pa: f64,
    /// Error of [`StressCycle::largest_pa`], Pa.
    pub largest_pa: f64,
    /// Error of the use of the strength; `None` where the body has no strength.
    pub utilisation: Option<f64>,
}

/// Places with the highest stress.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct HighestStress {
    /// Highest places without those that are singular, the highest first.
    pub places: Vec<StressPlace>,
    /// Highest place of each reason for which a stress is singular, the highest first.
    pub singular: Vec<StressPlace>,
}

/// The `count` highest places of bodies with this stress, without errors. They are ranked by what
/// they use of the strength where all bodies with elements have one, else by amplitude. `strengths`
/// and `singular` ([`singular_nodes`]) have an entry for each body.
pub fn highest_stress(
    model: &Model,
    stress: &[BodyStress],
    strengths: &[Option<Strength>],
    singular: &[Vec<Option<Singular>>],
    count: usize,
) -> HighestStress {
    let ranked_by_use = ranked_by_utilisation(model, strengths);
    let figure = |place: &StressPlace| match place.utilisation {
        Some(utilisation) if ranked_by_use => utilisation,
        _ => place.cycle.amplitude_pa,
    };
    let mut places = Vec::new();
    for (b, (body, stress)) in model.bodies.iter().zip(stress).enumerate() {
        let place = |node: usize| StressPlace {
            at: BodyNode {
                body: b,
                node: node as u32,
            },
            cycle: stress.cycles[node],
            utilisation: strengths[b].map(|strength| stress.cycles[node].utilisation(strength)),
            singular: singular[b][node],
            error: None,
        };
        let figures: Vec<f64> = (0..stress.cycles.len())
            .map(|n| figure(&place(n)))
            .collect();
        let mut is_highest: Vec<bool> = figures.iter().map(|f| *f > 0.0).collect();
        for nodes in body.elements.iter() {
            let of = |node: &u32| figures[*node as usize];
            let highest = nodes.iter().map(of).fold(0.0, f64::max);
            for node in nodes.iter().filter(|node| of(node) < highest) {
                is_highest[*node as usize] = false;
            }
        }
        let nodes = is_highest.iter().enumerate();
        places.extend(nodes.filter(|(_, is)| **is).map(|(node, _)| place(node)));
    }
    places.sort_by(|a, b| figure(b).total_cmp(&figure(a)));
    let regular = places.iter().filter(|place| place.singular.is_none());
    let first = |reason: &Singular| places.iter().find(|place| place.singular == Some(*reason));
    let mut singular: Vec<StressPlace> = Singular::ALL.iter().filter_map(first).copied().collect();
    singular.sort_by(|a, b| figure(b).total_cmp(&figure(a)));
    HighestStress {
        places: regular.take(count).copied().collect(),
        singular,
    }
}

/// Returns `true` if every body with elements has a strength, by which places are ranked.
pub(crate) fn ranked_by_utilisation(model: &Model, strengths: &[Option<Strength>]) -> bool {
    let bodies = model.bodies.iter().zip(strengths);
    let mut solid = bodies.filter(|(body, _)| body.material().is_some());
    solid.clone().next().is_some() && solid.all(|(_, strength)| strength.is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIAXIAL: [f64; 6] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    const SHEAR: [f64; 6] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0];

    fn times(stress: [f64; 6], factor: f64) -> [f64; 6] {
        stress.map(|s| factor * s)
    }

    #[test]
    fn a_uniaxial_cycle_has_its_mean_its_amplitude_and_their_sum() {
        let phase: f64 = 0.3;
        let moving = [phase.cos(), phase.sin()].map(|part| times(UNIAXIAL, 40.0 * part));
        for sign in [1.0, -1.0] {
            let cycle = StressCycle::new(&[times(UNIAXIAL, 100.0 * sign), moving[0], moving[1]]);
            assert!((cycle.mean_pa - 100.0 * sign).abs() < 1e-12);
            assert!((cycle.amplitude_pa - 40.0).abs() < 1e-5, "{cycle:?}");
            assert!((cycle.largest_pa - 140.0).abs() < 1e-5, "{cycle:?}");
        }
    }

    /// Of one harmonic the squared amplitude is the larger eigenvalue of the 2 x 2 matrix of the
    /// products of cosine and sine in the scalar product of von Mises.
    #[test]
    fn amplitude_of_one_harmonic_is_the_longer_axis_of_its_ellipse() {
        let cosine = [3.0, -1.0, 0.5, 2.0, -0.7, 0.2];
        let sine = [-1.0, 2.0, 0.3, 0.4, 1.1, -2.0];
        let (c, s) = (deviator(cosine), deviator(sine));
        let product = |a: [f64; 6], b: [f64; 6]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (cc, ss, cs) = (product(c, c), product(s, s), product(c, s));
        let longer = 0.5 * (cc + ss) + (0.25 * (cc - ss).powi(2) + cs * cs).sqrt();
        let found = StressCycle::new(&[[0.0; 6], cosine, sine]).amplitude_pa;
        assert!(
            (found - longer.sqrt()).abs() < 1e-5 * found,
            "{found} {longer}"
        );
    }

    /// cos(t) + a cos(2 t) is largest at t = 0, 1 + a, and least at cos(t) = -1 / (4 a), where it
    /// is -a - 1 / (8 a), for a above 1 / 4.
    #[test]
    fn range_of_two_harmonics_is_that_of_their_sum() {
        let a = 0.8;
        let zero = [0.0; 6];
        let cycle = StressCycle::new(&[zero, SHEAR, zero, times(SHEAR, a), zero]);
        let range = 1.0 + a + a + 1.0 / (8.0 * a);
        let expected = 0.5 * 3.0_f64.sqrt() * range;
        assert!(
            (cycle.amplitude_pa - expected).abs() < 1e-5,
            "{cycle:?} {expected}"
        );
    }

    #[test]
    fn pressure_alone_has_no_equivalent_stress() {
        let pressure = [-5.0, -5.0, -5.0, 0.0, 0.0, 0.0];
        let cycle = StressCycle::new(&[pressure, pressure, pressure]);
        assert!(cycle.amplitude_pa.abs() < 1e-12 && cycle.largest_pa.abs() < 1e-12);
    }

    #[test]
    fn goodman_adds_both_shares_and_leaves_compression_out() {
        let strength = Strength {
            endurance_pa: 200.0,
            ultimate_pa: 1000.0,
        };
        let cycle = |mean_pa: f64| StressCycle {
            mean_pa,
            amplitude_pa: 50.0,
            largest_pa: 0.0,
        };
        assert!((cycle(300.0).utilisation(strength) - 0.55).abs() < 1e-15);
        assert!((cycle(-300.0).utilisation(strength) - 0.25).abs() < 1e-15);
    }
}
