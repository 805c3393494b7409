//! Checks of the assumption that displacements, strains and clearances are small, against the sizes
//! of the bodies, their Young's moduli, and the sizes of the flanks. Every figure is a ratio, 1 at
//! the size itself.

use super::far_slip::ShorterSides;
use super::pairs::PairTable;
use crate::dlft::{Response, StaticState};
use crate::model::Model;
use crate::reduced::ObservedQuantity;
use crate::results::quantities::{cycle_fields, moving_orbits, static_fields};
use dovetail_numerics::space::extent;

/// Displacement that deserves a warning, relative to the longest side of its body.
pub const LARGE_DISPLACEMENT: f64 = 0.1;
/// Pressure that deserves a warning, relative to Young's modulus: where it acts strains are as
/// large.
pub const LARGE_PRESSURE: f64 = 0.01;
/// Clearance that deserves a warning, relative to the size of its flank.
pub const LARGE_CLEARANCE: f64 = 1.0;
/// Interference that deserves a warning, relative to the size of its flank; it is a strain.
pub const LARGE_INTERFERENCE: f64 = 0.1;

/// Sizes of a meshed assembly.
#[derive(Debug, Clone)]
pub struct AssemblySizes<'m> {
    model: &'m Model,
    /// Longest side of the box around each body, along the axes, m.
    bodies_m: Vec<f64>,
    /// Shorter side of the flank of each contact or, for a single row of pairs, the root of its
    /// area, m.
    flanks_m: Vec<f64>,
}

/// Displacement relative to the size of its body.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// Name of an observed point, or `a point`.
    pub what: String,
    /// Displacement, m.
    pub displacement_m: f64,
    /// Name of the body.
    pub body: String,
    /// Longest side of the body, m.
    pub size_m: f64,
}

impl Moved {
    /// Ratio of the displacement to the size.
    pub fn share(&self) -> f64 {
        self.displacement_m / self.size_m
    }
}

/// Pressure or clearance of a contact, relative to its limit.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactShare {
    /// Name of the contact.
    pub contact: String,
    /// Pressure, Pa, or clearance, m; negative for an interference.
    pub value: f64,
    /// Ratio of the value to Young's modulus, or to the size of the flank.
    pub share: f64,
}

impl<'m> AssemblySizes<'m> {
    /// Sizes of an assembly.
    pub fn new(model: &'m Model) -> Self {
        let side = |nodes_m: &[[f64; 3]], axis: usize| extent(nodes_m.iter().map(|p| p[axis]));
        let longest = |nodes_m: &[[f64; 3]]| (0..3).map(|a| side(nodes_m, a)).fold(0.0, f64::max);
        let sides = ShorterSides::new(&PairTable::from_model(model));
        let flank_m = |contact: usize| {
            let contact_pairs = || {
                model
                    .pairs
                    .iter()
                    .enumerate()
                    .filter(|(_, p)| p.contact == contact)
            };
            let side = contact_pairs()
                .next()
                .and_then(|(pair, _)| sides.pair_side_m(pair));
            side.unwrap_or_else(|| {
                contact_pairs()
                    .map(|(_, pair)| pair.area_m2)
                    .sum::<f64>()
                    .sqrt()
            })
        };
        Self {
            model,
            bodies_m: model.bodies.iter().map(|b| longest(&b.nodes_m)).collect(),
            flanks_m: (0..model.contact_names.len()).map(flank_m).collect(),
        }
    }

    fn moved(&self, what: &str, body: usize, displacement_m: f64) -> Moved {
        Moved {
            what: what.to_owned(),
            displacement_m,
            body: self.model.bodies[body].name.clone(),
            size_m: self.bodies_m[body],
        }
    }

    /// Largest displacement of a node relative to the size of its body, from the displacements of
    /// all nodes of each body.
    pub(crate) fn farthest_node(&self, displacements_m: &[Vec<[f64; 3]>]) -> Option<Moved> {
        let bodies = displacements_m.iter().enumerate();
        let moved = bodies.map(|(body, field)| {
            let lengths = field.iter().map(|u| u.iter().map(|c| c * c).sum::<f64>());
            self.moved("a point", body, lengths.fold(0.0, f64::max).sqrt())
        });
        farthest(moved)
    }

    /// Largest displacement of an observed point relative to the size of its body, as the sum of
    /// its mean and its departure from it, at any frequency with a motion.
    pub(crate) fn farthest_observed(&self, response: &Response) -> Option<Moved> {
        let of_point = |i: usize| {
            let observation = &self.model.observations[i];
            if observation.quantity != ObservedQuantity::Displacement {
                return None;
            }
            let body = observation.terms.first()?.0.body;
            let largest = moving_orbits(response).filter_map(|orbit| {
                let mean = orbit.observed.get(i)?.first()?.abs();
                Some(mean + orbit.observed_amplitude.get(i)?)
            });
            Some(self.moved(&observation.name, body, largest.fold(0.0, f64::max)))
        };
        farthest((0..self.model.observations.len()).filter_map(of_point))
    }

    /// Largest pressure of the static state relative to the lower Young's modulus of the two
    /// bodies; `None` where the state did not converge.
    pub fn hardest_static(&self, state: &StaticState) -> Option<ContactShare> {
        let fields = static_fields(state, &self.model.pairs);
        let valid = state.outcome.is_converged();
        self.hardest(&fields.pressure_pa).filter(|_| valid)
    }

    /// Largest pressure of the response relative to the lower Young's modulus of the two bodies.
    pub fn hardest_in_motion(&self, response: &Response) -> Option<ContactShare> {
        let of_orbits = moving_orbits(response).filter_map(|orbit| {
            self.hardest(&cycle_fields(orbit, &self.model.pairs).pressure_max_pa)
        });
        of_orbits.reduce(larger)
    }

    fn hardest(&self, pressures_pa: &[f64]) -> Option<ContactShare> {
        let pairs = self.model.pairs.iter().zip(pressures_pa);
        // A modulus is not known where the matrices come from another program.
        let pressed = pairs.filter_map(|(pair, &pressure_pa)| {
            let bodies = [Some(pair.slave.node), pair.slave.partner()];
            let materials = bodies.into_iter().flatten();
            let materials = materials.filter_map(|at| self.model.bodies[at.body].material());
            let modulus = materials.map(|material| material.young_pa);
            Some(ContactShare {
                contact: self.model.contact_names[pair.contact].clone(),
                value: pressure_pa,
                share: pressure_pa / modulus.reduce(f64::min)?,
            })
        });
        pressed.reduce(larger)
    }

    /// Widest clearance and deepest interference of the pairs relative to the sizes of their
    /// flanks.
    pub fn widest_gaps(&self) -> [Option<ContactShare>; 2] {
        let gaps = |sign: f64| {
            let pairs = self.model.pairs.iter();
            let gaps = pairs.map(|pair| ContactShare {
                contact: self.model.contact_names[pair.contact].clone(),
                value: pair.law.gap_m,
                share: sign * pair.law.gap_m / self.flanks_m[pair.contact],
            });
            gaps.filter(|gap| gap.share > 0.0).reduce(larger)
        };
        [gaps(1.0), gaps(-1.0)]
    }
}

fn farthest(moved: impl Iterator<Item = Moved>) -> Option<Moved> {
    let there = moved.filter(|moved| moved.share().is_finite());
    there.reduce(|a, b| if b.share() > a.share() { b } else { a })
}

fn larger(a: ContactShare, b: ContactShare) -> ContactShare {
    if b.share > a.share { b } else { a }
}
