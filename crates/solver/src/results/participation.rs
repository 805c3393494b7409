//! Shares of excitations and observations in the linear modes of a range: by symmetry, or at a node
//! of a mode, a force excites nothing and a point does not move.

use crate::damping::Rayleigh;
use crate::model::{AppliedLoad, Body, Model, Traction};
use crate::problem::{HarmonicLoad, LinearReference, Problem};
use crate::reduced::ObservedQuantity;
use crate::results::modes::hertz;
use dovetail_mesh::facet::shares;
use dovetail_numerics::space::norm;

/// A share below this counts as none: a mesh without the symmetry of the body has shares up to it.
pub const NO_SHARE: f64 = 5e-4;
/// Share from which on a mode counts as well excited.
const WELL_EXCITED: f64 = 0.1;

/// Shares in the modes of a range of frequencies. The share of a force is its modal force relative to
/// the modal force in a rigid motion of the same mass all along the force; the share of a displacement
/// is relative to that motion.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Participation {
    /// Frequencies at which harmonics of the excitation meet the modes of the range, Hz.
    pub resonances_hz: Vec<f64>,
    /// Largest share of the excitation in a mode of the range.
    pub excited: f64,
    /// Largest share of each observation in a mode of the range, or the share of the excitation in
    /// that mode if it is smaller. Strains have no share: `None`.
    pub observed: Vec<Option<f64>>,
    /// Lowest frequency at which a mode outside of the range is excited, Hz, if one is known.
    pub excited_outside_hz: Option<f64>,
}

/// Shares in the modes of a linear reference whose resonances lie from `from_hz` to `to_hz`, of a
/// problem about bodies with these masses, kg. `None` without such modes or forces.
pub fn participation(
    problem: &Problem,
    linear: &LinearReference,
    [from_hz, to_hz]: [f64; 2],
    (model, masses_kg): (&Model, &[f64]),
) -> Option<Participation> {
    let on_modes = linear.problem(problem, Rayleigh::NONE);
    let per_root_kg = masses_kg.iter().sum::<f64>().sqrt().recip();
    let mut harmonics: Vec<usize> = on_modes.excitations.iter().map(|e| e.harmonic).collect();
    harmonics.sort_unstable();
    harmonics.dedup();
    let quantities = problem.reduced.observations.iter().map(|o| o.quantity);
    let is_length = |quantity: ObservedQuantity| quantity == ObservedQuantity::Displacement;
    let mut participation = Participation {
        resonances_hz: Vec::new(),
        excited: 0.0,
        observed: quantities.map(|q| is_length(q).then_some(0.0)).collect(),
        excited_outside_hz: None,
    };
    for k in harmonics {
        let forces = added(on_modes.excitations.iter().filter(|e| e.harmonic == k));
        let rigid = per_root_kg * force_n(model, masses_kg, k);
        if !(rigid > 0.0 && rigid.is_finite()) {
            continue;
        }
        let of = on_modes.reduced.harmonic_model(k).model;
        let with_mass = linear.harmonic_reference(&problem.reduced, k).with_mass;
        for (mode, (omega2, force)) in of.omega2.iter().zip(&forces).enumerate().take(with_mass) {
            let hz = hertz(*omega2) / k as f64;
            let excited = force / rigid;
            if !(from_hz..=to_hz).contains(&hz) {
                let is_lowest = participation
                    .excited_outside_hz
                    .is_none_or(|known| hz < known);
                if excited > WELL_EXCITED && is_lowest {
                    participation.excited_outside_hz = Some(hz);
                }
                continue;
            }
            participation.resonances_hz.push(hz);
            participation.excited = participation.excited.max(excited);
            for (share, point) in participation.observed.iter_mut().zip(&of.observations) {
                let seen = point.on_modes[mode].abs() / per_root_kg;
                *share = share.map(|share| share.max(seen.min(excited)));
            }
        }
    }
    (!participation.resonances_hz.is_empty()).then_some(participation)
}

/// Amplitudes of the sums of loads on each mode.
fn added<'a>(loads: impl Iterator<Item = &'a HarmonicLoad>) -> Vec<f64> {
    let mut sums: Vec<[f64; 2]> = Vec::new();
    for load in loads {
        sums.resize(load.cosine.on_modes.len(), [0.0; 2]);
        let both = load.cosine.on_modes.iter().zip(&load.sine.on_modes);
        for (sum, (cosine, sine)) in sums.iter_mut().zip(both) {
            *sum = [sum[0] + cosine, sum[1] + sine];
        }
    }
    let sums = sums.into_iter();
    sums.map(|[cosine, sine]| cosine.hypot(sine)).collect()
}

/// Sum of the sizes of the forces of a harmonic of the excitation, N, whatever their directions.
fn force_n(model: &Model, masses_kg: &[f64], harmonic: usize) -> f64 {
    let area_m2 = |body: &Body, facets: &[Vec<u32>]| -> f64 {
        let of_facet = |facet: &Vec<u32>| {
            let coords: Vec<_> = facet.iter().map(|&n| body.nodes_m[n as usize]).collect();
            shares(&coords)
                .iter()
                .map(|share| share.area_m2)
                .sum::<f64>()
        };
        facets.iter().map(of_facet).sum()
    };
    let of_load = |(body, load): &(usize, AppliedLoad)| match load {
        AppliedLoad::Point { vector_n, .. } => norm(*vector_n),
        AppliedLoad::Surface { facets, traction } => match traction {
            Traction::Total(vector_n) => norm(*vector_n),
            Traction::Uniform(pa) => norm(*pa) * area_m2(&model.bodies[*body], facets),
            Traction::Pressure(pa) => pa.abs() * area_m2(&model.bodies[*body], facets),
        },
        AppliedLoad::Acceleration { vector_m_s2 } => masses_kg[*body] * norm(*vector_m_s2),
    };
    let forces = model
        .excitations
        .iter()
        .filter(|e| e.in_time.harmonic == harmonic);
    forces
        .map(|e| e.in_time.amplitude.abs() * e.loads.iter().map(of_load).sum::<f64>())
        .sum()
}
