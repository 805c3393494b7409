//! Figures of fretting: what the surfaces of each pair bear in a period, from which wear and the
//! start of cracks are judged.
//!
//! The two parameters are those of Ruiz, Boddington and Chen, "An investigation of fatigue and
//! fretting in a dovetail joint", Experimental Mechanics 24 (1984) 208-217: friction stress times
//! slip for wear, and that times the tension of the surface along the slip for cracks.

use super::signals::{pair_signals, sample_period};
use super::stress::{BodyStress, node_stress};
use crate::dlft::{Orbit, PairCycle};
use crate::model::{BodyNode, ContactPair, Model};
use dovetail_numerics::space::dot;

/// Instants of a period at which the largest values are taken.
const INSTANTS: usize = 128;

/// What the surfaces of a pair bear in a period.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Fretting {
    /// Range of the slip to and fro: half of the distance slid in a period, m.
    pub slip_range_m: f64,
    /// Largest friction force over tributary area, Pa.
    pub friction_stress_pa: f64,
    /// Largest tension of the surfaces of both bodies along the main direction of the motion, Pa,
    /// zero in compression; `None` without stress.
    pub tension_pa: Option<f64>,
}

impl Fretting {
    /// Ruiz' parameter of wear: friction stress times slip, Pa m.
    pub fn wear_parameter_pa_m(&self) -> f64 {
        self.friction_stress_pa * self.slip_range_m
    }

    /// Ruiz' parameter of fretting fatigue: tension times friction stress times slip, Pa2 m; `None`
    /// without stress.
    pub fn fatigue_parameter_pa2_m(&self) -> Option<f64> {
        Some(self.tension_pa? * self.wear_parameter_pa_m())
    }
}

/// Figures of each pair of an orbit. `stress` is that of the bodies in the same orbit.
pub fn fretting(model: &Model, orbit: &Orbit, stress: Option<&[BodyStress]>) -> Vec<Fretting> {
    let pairs = model.pairs.iter().zip(&orbit.cycles).enumerate();
    let of_pair = |(i, (pair, cycle)): (usize, (&ContactPair, &PairCycle))| {
        let signals = pair_signals(orbit, i, INSTANTS);
        let [_, f1, f2] = &signals.force_n;
        let friction_n = f1.iter().zip(f2).map(|(a, b)| a.hypot(*b));
        let [_, t1, t2] = pair.frame;
        let [a, b] = signals.main_direction();
        let along = [0, 1, 2].map(|k| a * t1[k] + b * t2[k]);
        Fretting {
            slip_range_m: 0.5 * cycle.slid_m,
            friction_stress_pa: friction_n.fold(0.0, f64::max) / pair.area_m2,
            tension_pa: stress.map(|stress| {
                let nodes = surface_nodes(model, pair, along);
                let of_nodes = nodes.map(|(at, d)| tension_pa(&stress[at.body], at.node, d));
                of_nodes.fold(0.0, f64::max)
            }),
        }
    };
    pairs.map(of_pair).collect()
}

/// Node of a pair, and the one of the other flank that has most weight, each with the direction in the
/// axes of its sector.
fn surface_nodes(
    model: &Model,
    pair: &ContactPair,
    along: [f64; 3],
) -> impl Iterator<Item = (BodyNode, [f64; 3])> {
    let masters = pair.slave.masters.iter();
    let heaviest = masters.max_by(|a, b| a.1.total_cmp(&b.1));
    let disc = model.cyclic.as_ref();
    // The axes of this sector, seen from that of the masters.
    let sector = disc.and_then(|disc| disc.sector(-pair.slave.ahead));
    let of_other = sector.map_or(along, |sector| sector.turn.map(|row| dot(row, along)));
    let other = heaviest.map(|(node, _)| (*node, of_other));
    [Some((pair.slave.node, along)), other]
        .into_iter()
        .flatten()
}

/// Largest tension of a node along a direction of unit length in a period, Pa.
fn tension_pa(stress: &BodyStress, node: u32, d: [f64; 3]) -> f64 {
    let along = |s: &[f64; 6]| {
        let normal = s[0] * d[0] * d[0] + s[1] * d[1] * d[1] + s[2] * d[2] * d[2];
        normal + 2.0 * (s[3] * d[0] * d[1] + s[4] * d[1] * d[2] + s[5] * d[0] * d[2])
    };
    let coefficients: Vec<f64> = node_stress(&stress.coefficients_pa, node as usize)
        .iter()
        .map(along)
        .collect();
    sample_period(&coefficients, INSTANTS)
        .into_iter()
        .fold(0.0, f64::max)
}
