//! Joints that the contacts of a scene make of the flanks: pairs, and bonded nodes.

use std::collections::{BTreeMap, BTreeSet};

use super::builder::BodyBuilder;
use super::contacts::{ContactJoint, ContactSurface, bond, contact, finer, ground_contact};
use super::crown::add_crown;
use super::friction::set_friction;
use super::groups::{find_surface, first_tags};
use super::{BodyNode, ContactPair, CyclicSpec, FlankMatch, FrictionMap, ModelError, Side, Slave};
use crate::model::{Assembly, ContactLaw, ContactSpec, Sector, SurfaceFields};
use dovetail_mesh::Mesh;
use dovetail_numerics::space::Vector;

/// Joints of all contacts of a scene.
#[derive(Default)]
pub(super) struct Joints {
    pub names: Vec<String>,
    pub pairs: Vec<ContactPair>,
    pub facets: Vec<Vec<u32>>,
    pub bonded: Vec<Slave>,
    pub matches: Vec<FlankMatch>,
    pub friction_maps: Vec<FrictionMap>,
    /// Contact of each slave node, and the nodes that it follows.
    slaves: BTreeMap<BodyNode, (String, Vec<BodyNode>)>,
}

/// Pairs the flanks, the bonded ones last, and gives the bodies their contact nodes.
pub(super) fn joints(
    assembly: &Assembly,
    mesh: &Mesh,
    bodies: &mut [BodyBuilder],
    fields: Option<&SurfaceFields>,
) -> Result<Joints, ModelError> {
    let is_bonded = |spec: &&ContactSpec| spec.law == ContactLaw::Bonded;
    let mut joints = Joints::default();
    let opening = assembly.contacts.iter().filter(|c| !is_bonded(c));
    for spec in opening.chain(assembly.contacts.iter().filter(is_bonded)) {
        let mut found = joints.paired(spec, assembly.cyclic.as_ref(), mesh, bodies)?;
        for side in &found.sides {
            bodies[side.body].add_flank(&side.nodes, &side.tied);
        }
        for pair in &mut found.pairs {
            make_local(&mut pair.slave, bodies);
        }
        for slave in &mut found.bonded {
            make_local(slave, bodies);
        }
        found.bonded = free_of_edges(found.bonded, bodies);
        for Slave { node, masters, .. } in found.slaves() {
            let masters = masters.iter().map(|(at, _)| *at).collect();
            joints.slaves.insert(*node, (spec.name.clone(), masters));
        }
        joints.matches.extend(found.flank_match.take());
        if is_bonded(&spec) {
            if spec.second.is_none() {
                for side in &found.sides {
                    bodies[side.body].hold_flank(&spec.name, side);
                }
            } else {
                joints.bonded.append(&mut found.bonded);
            }
            continue;
        }
        joints.add(spec, found, fields)?;
    }
    Ok(joints)
}

/// Replaces the numbers of nodes in the mesh by those in their bodies.
pub(super) fn make_local(slave: &mut Slave, bodies: &[BodyBuilder]) {
    let masters = slave.masters.iter_mut().map(|(at, _)| at);
    for at in std::iter::once(&mut slave.node).chain(masters) {
        at.node = bodies[at.body].local(at.node);
    }
}

/// Bonded nodes without those in the middles of edges that a contact with pairs has made follow their
/// corners. Such a master is replaced by its corners.
pub(super) fn free_of_edges(bonded: Vec<Slave>, bodies: &[BodyBuilder]) -> Vec<Slave> {
    let tied: Vec<BTreeMap<u32, [u32; 2]>> = bodies.iter().map(BodyBuilder::tied).collect();
    let corners = |at: &BodyNode| tied[at.body].get(&at.node);
    let with_corners = |slave: Slave| {
        let mut masters: BTreeMap<BodyNode, f64> = BTreeMap::new();
        for (at, weight) in slave.masters {
            match corners(&at) {
                Some(both) => both.iter().for_each(|&node| {
                    *masters.entry(BodyNode { node, ..at }).or_default() += 0.5 * weight;
                }),
                None => *masters.entry(at).or_default() += weight,
            }
        }
        Slave {
            masters: masters.into_iter().collect(),
            ..slave
        }
    };
    let free = bonded.into_iter();
    let free = free.filter(|slave| corners(&slave.node).is_none());
    free.map(with_corners).collect()
}

impl Joints {
    fn add(
        &mut self,
        spec: &ContactSpec,
        mut found: ContactJoint,
        fields: Option<&SurfaceFields>,
    ) -> Result<(), ModelError> {
        let friction = set_friction(&mut found.pairs, spec, fields)?;
        self.friction_maps.extend(friction);
        if let Some(crown) = &spec.crown {
            add_crown(&mut found.pairs, crown).map_err(|_| ModelError::CrownAcross {
                contact: spec.name.clone(),
                axis: crown.axis.unwrap_or_default(),
            })?;
        }
        let before = self.pairs.len() as u32;
        for mut facet in found.facets {
            facet.iter_mut().for_each(|pair| *pair += before);
            self.facets.push(facet);
        }
        self.pairs.append(&mut found.pairs);
        self.names.push(spec.name.clone());
        Ok(())
    }

    /// Pairs of one contact, with node numbers of the mesh. Where the scene does not say which
    /// flank follows the other, the coarser one may follow where the finer one cannot.
    fn paired(
        &self,
        spec: &ContactSpec,
        disc: Option<&CyclicSpec>,
        mesh: &Mesh,
        bodies: &[BodyBuilder],
    ) -> Result<ContactJoint, ModelError> {
        let number = self.names.len();
        let first = surface(mesh, spec, &spec.first, bodies)?;
        let held = |at: BodyNode| [0, 1, 2].map(|axis| bodies[at.body].is_held(at.node, axis));
        let is_bonded = spec.law == ContactLaw::Bonded;
        let Some(second) = &spec.second else {
            let found = match is_bonded {
                true => first.bonded_to_ground(),
                false => ground_contact(spec, number, &first, held),
            };
            self.check(spec, &found, mesh, bodies)?;
            return Ok(found);
        };
        let mut second = surface(mesh, spec, second, bodies)?;
        if spec.second_sector == Sector::Next {
            let disc = disc.ok_or_else(|| ModelError::NoNextSector {
                contact: spec.name.clone(),
            })?;
            second = second.turned_to_sector(disc, 1);
        }
        let both = [&first, &second];
        let attempt = |slave: Side| {
            let found = match is_bonded {
                true => bond(spec, both, slave)?,
                false => contact(spec, number, both, slave, held)?,
            };
            self.check(spec, &found, mesh, bodies)?;
            Ok(found)
        };
        // Pairs count in the axes of the slave's sector, which are to be those of the first flank.
        if spec.second_sector == Sector::Next {
            return attempt(Side::First);
        }
        if let Some(slave) = spec.slave {
            return attempt(slave);
        }
        let slave = finer(both);
        attempt(slave).or_else(|refused| {
            let [_, other] = slave.ordered([Side::First, Side::Second]);
            attempt(other).map_err(|_| refused)
        })
    }

    /// Checks that a node follows only one contact, and none that follows it, and that no support
    /// holds it where contact forces act.
    fn check(
        &self,
        spec: &ContactSpec,
        found: &ContactJoint,
        mesh: &Mesh,
        bodies: &[BodyBuilder],
    ) -> Result<(), ModelError> {
        let Some(side) = found.sides.first() else {
            return Ok(());
        };
        let body = &bodies[side.body];
        let tied = side.tied.iter().map(|t| t.0);
        let fixed = side.nodes.iter().copied().chain(tied);
        let fixed: Vec<u32> = fixed.filter(|&n| body.is_fixed(n)).collect();
        let (count, tags) = first_tags(mesh, fixed.iter());
        if count > 0 {
            return Err(ModelError::FlankFixed {
                body: body.name().to_string(),
                contact: spec.name.clone(),
                count,
                tags,
            });
        }
        let local = |at: &BodyNode| BodyNode {
            node: bodies[at.body].local(at.node),
            ..*at
        };
        let slaves = || found.slaves();
        let own: BTreeSet<BodyNode> = slaves().map(|s| local(&s.node)).collect();
        let other = |slave: &Slave| {
            let itself = self.slaves.get(&local(&slave.node)).map(|(name, _)| name);
            let masters = slave.masters.iter().map(|(at, _)| local(at)).collect();
            itself.or_else(|| self.cyclic_contact(masters, &own))
        };
        if let Some(first) = slaves().find_map(other) {
            let twice = slaves().filter(|s| other(s) == Some(first));
            let twice: Vec<u32> = twice.map(|s| s.node.node).collect();
            let (count, tags) = first_tags(mesh, twice.iter());
            return Err(ModelError::SlaveTwice {
                first: first.clone(),
                second: spec.name.clone(),
                count,
                tags,
            });
        }
        check_held(bodies, found, spec, mesh)
    }

    /// Name of the contact through which these nodes, followed from slave to masters, lead back to
    /// one of `own`.
    fn cyclic_contact(
        &self,
        mut nodes: Vec<BodyNode>,
        own: &BTreeSet<BodyNode>,
    ) -> Option<&String> {
        let mut seen = BTreeSet::new();
        while let Some(node) = nodes.pop() {
            let Some((name, masters)) = self.slaves.get(&node).filter(|_| seen.insert(node)) else {
                continue;
            };
            if masters.iter().any(|master| own.contains(master)) {
                return Some(name);
            }
            nodes.extend(masters);
        }
        None
    }
}

/// Flank on the body that has the most of its nodes.
pub(super) fn surface(
    mesh: &Mesh,
    spec: &ContactSpec,
    name: &str,
    bodies: &[BodyBuilder],
) -> Result<ContactSurface, ModelError> {
    let used_by = format!("contact `{}`", spec.name);
    let group = find_surface(mesh, name, &used_by)?;
    let count = |body: &BodyBuilder| group.nodes.iter().filter(|&&n| body.has(n)).count();
    let counts = bodies.iter().map(count).enumerate();
    // The first of equals is taken.
    let owner = counts.rev().max_by_key(|(_, count)| *count);
    let Some((owner, _)) = owner.filter(|(_, count)| *count > 0) else {
        let (count, tags) = first_tags(mesh, group.nodes.iter());
        return Err(ModelError::NodesElsewhere {
            used_by,
            group: name.to_string(),
            count,
            tags,
        });
    };
    let body = &bodies[owner];
    let found = ContactSurface::new(
        mesh,
        &spec.name,
        (name, group),
        owner,
        (body.name(), &body.outside(mesh)),
    )?;
    let (count, tags) = first_tags(mesh, body.nodes_lacking_rows(found.nodes()).iter());
    if count > 0 {
        return Err(ModelError::FlankWithoutRows {
            body: body.name().to_string(),
            contact: spec.name.clone(),
            count,
            tags,
        });
    }
    Ok(found)
}

/// Checks that a slave node is held along the flank only, and that the nodes opposite are held,
/// too: a plane of symmetry cuts the two bodies of the contact. Contact forces then never act on a
/// support of the slave. Bonded nodes may be held in any direction, those of the two bodies alike.
fn check_held(
    bodies: &[BodyBuilder],
    found: &ContactJoint,
    contact: &ContactSpec,
    mesh: &Mesh,
) -> Result<(), ModelError> {
    let pairs = found.pairs.iter().map(|p| (&p.slave, Some(p.frame[0])));
    let bonded = found.bonded.iter().map(|slave| (slave, None));
    let all: Vec<(&Slave, Option<Vector>)> = pairs.chain(bonded).collect();
    for (axis, key) in ["fixed_x", "fixed_y", "fixed_z"].into_iter().enumerate() {
        let is_held = |at: BodyNode| bodies[at.body].is_held(at.node, axis);
        let is_wrong = |(slave, normal): &&(&Slave, Option<Vector>)| {
            let masters = &slave.masters;
            // On the ground a support along the flank opposes no contact force.
            let alone = !masters.is_empty() && !masters.iter().any(|(at, _)| is_held(*at));
            let across = normal.is_some_and(|n| n[axis].abs() > ALONG_FLANK);
            is_held(slave.node) && (alone || across)
        };
        let wrong = all.iter().filter(is_wrong);
        let wrong: Vec<BodyNode> = wrong.map(|(slave, _)| slave.node).collect();
        if let Some(&BodyNode { body, .. }) = wrong.first() {
            let (count, tags) = first_tags(mesh, wrong.iter().map(|at| &at.node));
            return Err(ModelError::FlankHeld {
                body: bodies[body].name().to_string(),
                key,
                contact: contact.name.clone(),
                count,
                tags,
            });
        }
    }
    Ok(())
}

/// Sine of the largest angle between a held direction and the flank.
const ALONG_FLANK: f64 = 1e-6;
