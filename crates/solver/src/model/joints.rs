//! What the contacts of a scene make of the flanks: pairs, and nodes tied for good.

use super::bind::{Draft, find_group, first_tags};
use super::contacts::{Contact, contact, ground_contact};
use super::crown::add_crown;
use super::{ContactPair, ModelError};
use crate::mesh::Mesh;
use crate::model::{Assembly, ContactLaw, ContactSpec};

/// What the contacts of a scene make of the flanks.
#[derive(Default)]
pub(super) struct Joints {
    pub names: Vec<String>,
    pub pairs: Vec<ContactPair>,
    pub triangles: Vec<[u32; 3]>,
    pub bonded: Vec<[u32; 2]>,
    pub largest_mismatch_m: f64,
}

/// Pairs the flanks, the bonded ones last, and gives the bodies their flank nodes.
pub(super) fn joints(
    assembly: &Assembly,
    mesh: &Mesh,
    bodies: &mut [Draft; 2],
) -> Result<Joints, ModelError> {
    let is_bonded = |spec: &&ContactSpec| spec.law == ContactLaw::Bonded;
    let mut joints = Joints::default();
    let mut all_names = Vec::new();
    let opening = assembly.contacts.iter().filter(|c| !is_bonded(c));
    for spec in opening.chain(assembly.contacts.iter().filter(is_bonded)) {
        all_names.push(spec.name.clone());
        let mut found = paired(assembly, spec, joints.names.len(), mesh, bodies)?;
        for (b, draft) in bodies.iter_mut().enumerate() {
            if draft.is_ground() {
                continue;
            }
            for pair in &mut found.pairs {
                pair.nodes[b] = draft.local(pair.nodes[b]);
            }
            let flank: Vec<u32> = found.pairs.iter().map(|p| p.nodes[b]).collect();
            draft.add_flank(
                &flank,
                &found.tied[b],
                all_names.len() - 1,
                &all_names,
                mesh,
            )?;
        }
        joints.largest_mismatch_m = joints.largest_mismatch_m.max(found.largest_mismatch_m);
        check_held_flanks(bodies, &found.pairs, spec, mesh)?;
        if is_bonded(&spec) {
            let nodes = found.pairs.iter().map(|p| p.nodes);
            match bodies[1].is_ground() {
                true => bodies[0].hold_flank(nodes.map(|n| n[0]), &found.tied[0]),
                false => joints.bonded.extend(nodes),
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
        let triangles = found.triangles.iter().map(|t| t.map(|i| i + before));
        joints.triangles.extend(triangles);
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
    bodies: &[Draft; 2],
) -> Result<Contact, ModelError> {
    let used_by = format!("contact `{}`", spec.name);
    let group = |name| find_group(mesh, name, Some(2), &used_by);
    let first = group(&spec.first)?;
    let [blade, jaw] = bodies;
    let (on_blade, on_jaw) = (|n| blade.has(n), |n| jaw.has(n));
    let blade = blade.part(&on_blade);
    match &spec.second {
        None if jaw.is_ground() => ground_contact(mesh, spec, number, first, &blade),
        Some(second) if !jaw.is_ground() => {
            let (groups, parts) = ([first, group(second)?], [&blade, &jaw.part(&on_jaw)]);
            let tolerance = assembly.mesh.pairing_tolerance;
            contact(mesh, (spec, second), number, groups, parts, tolerance)
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
    bodies: &[Draft; 2],
    pairs: &[ContactPair],
    contact: &ContactSpec,
    mesh: &Mesh,
) -> Result<(), ModelError> {
    for (axis, key) in ["fixed_x", "fixed_y", "fixed_z"].into_iter().enumerate() {
        let held_in = |b: usize, node: u32| bodies[b].held(node)[axis];
        let held = |p: &ContactPair| match bodies[1].is_ground() {
            // A support along the flank opposes no contact force.
            true => [held_in(0, p.nodes[0]); 2],
            false => [0, 1].map(|b| held_in(b, p.nodes[b])),
        };
        let is_wrong = |p: &ContactPair| match held(p) {
            [false, false] => false,
            [true, true] => {
                contact.law != ContactLaw::Bonded && p.frame[0][axis].abs() > ALONG_FLANK
            }
            _ => true,
        };
        let wrong: Vec<&ContactPair> = pairs.iter().filter(|p| is_wrong(p)).collect();
        if let Some(first) = wrong.first() {
            let body = usize::from(!held(first)[0]);
            let nodes: Vec<u32> = wrong
                .iter()
                .map(|p| bodies[body].mesh_node(p.nodes[body]))
                .collect();
            return Err(ModelError::FlankHeld {
                body: bodies[body].name().to_string(),
                key,
                contact: contact.name.clone(),
                count: wrong.len(),
                tags: first_tags(mesh, nodes.iter()).1,
            });
        }
    }
    Ok(())
}

/// Sine of the largest angle between a held direction and the flank.
const ALONG_FLANK: f64 = 1e-6;
