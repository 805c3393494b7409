//! What the contacts of a scene make of the flanks: pairs, and nodes tied for good.

use super::builder::BodyBuilder;
use super::contacts::{Contact, contact, ground_contact};
use super::crown::add_crown;
use super::groups::{find_surface, first_tags};
use super::{BodyNode, ContactPair, ModelError};
use crate::mesh::{Group, Mesh};
use crate::model::{Assembly, ContactLaw, ContactSpec};

/// What the contacts of a scene make of the flanks.
#[derive(Default)]
pub(super) struct Joints {
    pub names: Vec<String>,
    pub pairs: Vec<ContactPair>,
    pub facets: Vec<Vec<u32>>,
    pub bonded: Vec<[BodyNode; 2]>,
    pub largest_mismatch_m: f64,
}

/// Pairs the flanks, the bonded ones last, and gives the bodies their contact nodes.
pub(super) fn joints(
    assembly: &Assembly,
    mesh: &Mesh,
    bodies: &mut [BodyBuilder],
) -> Result<Joints, ModelError> {
    let is_bonded = |spec: &&ContactSpec| spec.law == ContactLaw::Bonded;
    let mut joints = Joints::default();
    let mut all_names = Vec::new();
    let opening = assembly.contacts.iter().filter(|c| !is_bonded(c));
    for spec in opening.chain(assembly.contacts.iter().filter(is_bonded)) {
        all_names.push(spec.name.clone());
        let mut found = paired(assembly, spec, joints.names.len(), mesh, bodies)?;
        for pair in &mut found.pairs {
            for at in std::iter::once(&mut pair.first).chain(&mut pair.second) {
                at.node = bodies[at.body].local(at.node);
            }
        }
        let firsts: Vec<BodyNode> = found.pairs.iter().map(|p| p.first).collect();
        let seconds: Vec<BodyNode> = found.pairs.iter().filter_map(|p| p.second).collect();
        for (flank, tied) in [&firsts, &seconds].into_iter().zip(&found.tied) {
            let Some(&BodyNode { body, .. }) = flank.first() else {
                continue;
            };
            let flank: Vec<u32> = flank.iter().map(|at| at.node).collect();
            bodies[body].add_flank(&flank, tied, all_names.len() - 1, &all_names, mesh)?;
        }
        joints.largest_mismatch_m = joints.largest_mismatch_m.max(found.largest_mismatch_m);
        check_held_flanks(bodies, &found.pairs, spec, mesh)?;
        if is_bonded(&spec) {
            match firsts.first() {
                Some(at) if seconds.is_empty() => {
                    let flank = firsts.iter().map(|at| at.node);
                    bodies[at.body].hold_flank(flank, &found.tied[0]);
                }
                _ => joints
                    .bonded
                    .extend(firsts.into_iter().zip(seconds).map(|(a, b)| [a, b])),
            }
            continue;
        }
        if let Some(crown) = &spec.crown {
            add_crown(&mut found.pairs, crown).map_err(|_| ModelError::CrownAcross {
                contact: spec.name.clone(),
                axis: crown.axis.unwrap_or_default(),
            })?;
        }
        let before = joints.pairs.len() as u32;
        for mut facet in found.facets {
            facet.iter_mut().for_each(|pair| *pair += before);
            joints.facets.push(facet);
        }
        joints.pairs.append(&mut found.pairs);
        joints.names.push(spec.name.clone());
    }
    Ok(joints)
}

/// The pairs of one contact, node numbers still the mesh's.
fn paired(
    assembly: &Assembly,
    spec: &ContactSpec,
    number: usize,
    mesh: &Mesh,
    bodies: &[BodyBuilder],
) -> Result<Contact, ModelError> {
    let used_by = format!("contact `{}`", spec.name);
    let group = |name| find_surface(mesh, name, &used_by);
    let first = group(&spec.first)?;
    // The body that has most of a flank is the one it is meant to be on.
    let owner = |group: &Group| {
        let count = |body: &BodyBuilder| group.nodes.iter().filter(|&&n| body.has(n)).count();
        let counts = bodies.iter().map(count).enumerate();
        counts
            .rev()
            .max_by_key(|(_, count)| *count)
            .map_or(0, |(b, _)| b)
    };
    let on_body = |b: usize| move |n: u32| bodies[b].has(n);
    match &spec.second {
        None if bodies.len() == 1 => {
            let on_body = on_body(0);
            ground_contact(mesh, spec, number, first, &bodies[0].part(0, &on_body))
        }
        Some(name) if bodies.len() > 1 => {
            let second = group(name)?;
            // `first` is on the body that is named first.
            let [a, b] = match [owner(first), owner(second)] {
                [a, b] if a == b => [a.min(bodies.len() - 2), a.min(bodies.len() - 2) + 1],
                [a, b] => [a.min(b), a.max(b)],
            };
            let (on_first, on_second) = (on_body(a), on_body(b));
            let parts = [
                &bodies[a].part(a, &on_first),
                &bodies[b].part(b, &on_second),
            ];
            let tolerance = assembly.pairing_tolerance;
            contact(
                mesh,
                (spec, name),
                number,
                [first, second],
                parts,
                tolerance,
            )
        }
        _ => Err(ModelError::SecondFlank {
            contact: spec.name.clone(),
            bodies: assembly.bodies.len(),
        }),
    }
}

/// A flank node may be held along the flank only, and its partner with it: a plane of symmetry cuts both bodies.
/// Contact forces then never act on a support. Bonded nodes may be held in any direction, both alike.
fn check_held_flanks(
    bodies: &[BodyBuilder],
    pairs: &[ContactPair],
    contact: &ContactSpec,
    mesh: &Mesh,
) -> Result<(), ModelError> {
    for (axis, key) in ["fixed_x", "fixed_y", "fixed_z"].into_iter().enumerate() {
        let is_held = |at: BodyNode| bodies[at.body].held(at.node)[axis];
        // On the ground a support along the flank opposes no contact force.
        let held = |p: &ContactPair| [is_held(p.first), is_held(p.second.unwrap_or(p.first))];
        let is_wrong = |p: &ContactPair| match held(p) {
            [false, false] => false,
            [true, true] => {
                contact.law != ContactLaw::Bonded && p.frame[0][axis].abs() > ALONG_FLANK
            }
            _ => true,
        };
        let held_node = |p: &ContactPair| match held(p) {
            [false, true] => p.second.unwrap_or(p.first),
            _ => p.first,
        };
        let wrong: Vec<BodyNode> = pairs
            .iter()
            .filter(|p| is_wrong(p))
            .map(held_node)
            .collect();
        if let Some(&BodyNode { body, .. }) = wrong.first() {
            let on_body = wrong.iter().filter(|at| at.body == body);
            let nodes: Vec<u32> = on_body.map(|at| bodies[body].mesh_node(at.node)).collect();
            return Err(ModelError::FlankHeld {
                body: bodies[body].name().to_string(),
                key,
                contact: contact.name.clone(),
                count: nodes.len(),
                tags: first_tags(mesh, nodes.iter()).1,
            });
        }
    }
    Ok(())
}

/// Sine of the largest angle between a held direction and the flank.
const ALONG_FLANK: f64 = 1e-6;
