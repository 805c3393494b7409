//! The binding itself: groups looked up, bodies numbered, contacts and probes tied to nodes.

use super::contacts::Part;
use super::dofs::{Roles, number};
use super::joints::joints;
use super::loads::static_load;
use super::{
    Body, BodyNode, DofMap, Excitation, Model, ModelError, NodeMotion, Observation, Rotation,
    StaticLoad,
};
use crate::mesh::{Group, Mesh};
use crate::model::{Assembly, BodySpec};

const NONE: u32 = u32::MAX;

/// Resolves every name of the scene against the mesh.
///
/// Pairs stand contact by contact, each along the slot and then across it, whatever the numbering
/// of the mesh. A force on a group is shared equally by its nodes, an observation is their mean.
///
/// # Errors
/// A name that the mesh does not have, or a group that is not what it is used for: see
/// [`ModelError`].
pub fn bind(assembly: &Assembly, mesh: &Mesh) -> Result<Model, ModelError> {
    if assembly.bodies.is_empty() {
        return Err(ModelError::NoBody);
    }
    let rotation = assembly.rotation.as_ref().filter(|r| r.speed_rad_s != 0.0);
    for name in rotation.iter().flat_map(|r| &r.bodies) {
        if !assembly.bodies.iter().any(|b| b.name == *name) {
            return Err(ModelError::UnknownBody {
                used_by: "rotation".to_string(),
                name: name.clone(),
                available: assembly.bodies.iter().map(|b| b.name.clone()).collect(),
            });
        }
    }
    let drafts = assembly.bodies.iter().map(|spec| Draft::new(spec, mesh));
    let mut bodies: Vec<Draft> = drafts.collect::<Result<_, _>>()?;
    check_disjoint(&bodies, mesh)?;
    for (draft, spec) in bodies.iter_mut().zip(&assembly.bodies) {
        draft.fix(spec, mesh)?;
    }
    let joints = joints(assembly, mesh, &mut bodies)?;

    let mut excitations = Vec::new();
    for (i, spec) in assembly.excitations.iter().enumerate() {
        let used_by = format!("excitation {}", i + 1);
        let nodes = group_nodes(mesh, &bodies, &spec.points, used_by)?;
        let share = 1.0 / nodes.len() as f64;
        let term = |at: BodyNode| {
            let direction = spec.direction.map(|d| d * share);
            (at, bodies[at.body].movable(at.node, direction))
        };
        excitations.push(Excitation {
            terms: nodes.into_iter().map(term).collect(),
            force_n: spec.force_n,
            harmonic: spec.harmonic,
            phase_rad: spec.phase_rad,
        });
    }
    let mut observations = Vec::new();
    for spec in &assembly.observations {
        let used_by = format!("observation `{}`", spec.name);
        let nodes = group_nodes(mesh, &bodies, &spec.points, used_by)?;
        let share = 1.0 / nodes.len() as f64;
        let term = |at| (at, spec.direction.map(|d| d * share));
        observations.push(Observation {
            name: spec.name.clone(),
            terms: nodes.into_iter().map(term).collect(),
        });
    }

    for (number, spec) in assembly.loads.iter().enumerate() {
        for (body, load) in static_load(mesh, &bodies, spec, number)? {
            bodies[body].loads.push(load);
        }
    }

    let rotates = |spec: &BodySpec| rotation.is_some_and(|r| r.bodies.contains(&spec.name));
    let finished = bodies.into_iter().zip(&assembly.bodies);
    let finished = finished.map(|(draft, spec)| draft.finish(spec, rotates(spec), mesh));
    Ok(Model {
        bodies: finished.collect::<Result<_, _>>()?,
        rotation: rotation.map(|r| Rotation {
            point_m: r.point_m,
            axis: r.axis,
            speed_rad_s: r.speed_rad_s,
            prestress: r.prestress,
        }),
        pairs: joints.pairs,
        bonded: joints.bonded,
        flank_triangles: joints.triangles,
        contact_names: joints.names,
        excitations,
        observations,
        largest_mismatch_m: joints.largest_mismatch_m,
    })
}

pub(super) fn kind(dimension: u8) -> &'static str {
    match dimension {
        0 => "point",
        1 => "curve",
        2 => "surface",
        _ => "volume",
    }
}

/// A group by name, of the wanted dimension (`None`: any) and not empty.
pub(super) fn find_group<'a>(
    mesh: &'a Mesh,
    name: &str,
    wanted: Option<u8>,
    used_by: &str,
) -> Result<&'a Group, ModelError> {
    let available = || {
        let fits = |g: &Group| wanted.is_none_or(|d| g.dimension == d);
        let groups = mesh.groups.iter().filter(|(_, g)| fits(g));
        groups.map(|(name, _)| name.clone()).collect()
    };
    let Some(group) = mesh.groups.get(name) else {
        return Err(ModelError::UnknownGroup {
            used_by: used_by.to_string(),
            name: name.to_string(),
            wanted: wanted.map_or("any", kind),
            available: available(),
        });
    };
    if let Some(wanted) = wanted.filter(|&d| d != group.dimension) {
        return Err(ModelError::GroupDimension {
            used_by: used_by.to_string(),
            name: name.to_string(),
            found: kind(group.dimension),
            wanted: kind(wanted),
            available: available(),
        });
    }
    if group.nodes.is_empty() {
        return Err(ModelError::EmptyGroup {
            used_by: used_by.to_string(),
            name: name.to_string(),
        });
    }
    Ok(group)
}

/// The nodes of a group on their bodies.
fn group_nodes(
    mesh: &Mesh,
    bodies: &[Draft],
    group: &str,
    used_by: String,
) -> Result<Vec<BodyNode>, ModelError> {
    let nodes = &find_group(mesh, group, None, &used_by)?.nodes;
    let of = |n: u32| bodies.iter().position(|b| b.has(n));
    let group = group.to_string();
    let (count, tags) = first_tags(mesh, nodes.iter().filter(|&&n| of(n).is_none()));
    if count > 0 {
        return Err(ModelError::ProbeElsewhere {
            used_by,
            group,
            count,
            tags,
        });
    }
    let is_fixed = |n: u32| bodies.iter().any(|b| b.has(n) && b.is_fixed(n));
    let (count, tags) = first_tags(mesh, nodes.iter().filter(|&&n| is_fixed(n)));
    if count > 0 {
        return Err(ModelError::ProbeFixed {
            used_by,
            group,
            count,
            tags,
        });
    }
    let on_body = |n: u32| {
        let body = of(n)?;
        let node = bodies[body].local(n);
        Some(BodyNode { body, node })
    };
    Ok(nodes.iter().filter_map(|&n| on_body(n)).collect())
}

/// How many, and the tags of the first few.
pub(super) fn first_tags<'a>(
    mesh: &Mesh,
    nodes: impl Iterator<Item = &'a u32>,
) -> (usize, Vec<u64>) {
    let tags: Vec<u64> = nodes.map(|&n| mesh.node_tags[n as usize]).collect();
    (tags.len(), tags.into_iter().take(5).collect())
}

fn check_disjoint(bodies: &[Draft], mesh: &Mesh) -> Result<(), ModelError> {
    for (b, second) in bodies.iter().enumerate() {
        for first in &bodies[..b] {
            let shared = first.nodes.iter().filter(|&&n| second.has(n));
            let (count, tags) = first_tags(mesh, shared);
            if count > 0 {
                return Err(ModelError::SharedNodes {
                    first: first.name.clone(),
                    second: second.name.clone(),
                    count,
                    tags,
                });
            }
        }
    }
    Ok(())
}

/// A body on its way into the model.
pub(super) struct Draft {
    name: String,
    /// Elements of the mesh.
    tets: Vec<u32>,
    /// Local node -> mesh node, ascending.
    nodes: Vec<u32>,
    /// Mesh node -> local node, or `NONE`.
    local: Vec<u32>,
    roles: Roles,
    /// Per local node: held along x, y, z.
    held: Vec<[bool; 3]>,
    loads: Vec<StaticLoad>,
    /// Which contact each local node belongs to.
    contact_of: Vec<Option<usize>>,
}

impl Draft {
    fn new(spec: &BodySpec, mesh: &Mesh) -> Result<Self, ModelError> {
        let used_by = format!("body `{}`", spec.name);
        let group = find_group(mesh, &spec.volume, Some(3), &used_by)?;
        let mut local = vec![NONE; mesh.nodes_m.len()];
        for (i, &n) in (0..).zip(&group.nodes) {
            local[n as usize] = i;
        }
        Ok(Self {
            name: spec.name.clone(),
            tets: group.elements.clone(),
            nodes: group.nodes.clone(),
            local,
            roles: Roles {
                fixed: vec![false; group.nodes.len()],
                contact: Vec::new(),
                tied: Vec::new(),
            },
            held: vec![[false; 3]; group.nodes.len()],
            loads: Vec::new(),
            contact_of: vec![None; group.nodes.len()],
        })
    }

    /// Flank nodes that rigid ground holds: fixed, no longer flank.
    pub(super) fn hold_flank(
        &mut self,
        flank: impl Iterator<Item = u32>,
        tied: &[(u32, [u32; 2])],
    ) {
        let held: Vec<u32> = flank.chain(tied.iter().map(|t| self.local(t.0))).collect();
        for &node in &held {
            self.roles.fixed[node as usize] = true;
        }
        let is_fixed = |node: u32| self.roles.fixed[node as usize];
        self.roles.contact.retain(|n| !is_fixed(*n));
        self.roles.tied.retain(|t| !is_fixed(t.0));
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn tets(&self) -> &[u32] {
        &self.tets
    }

    pub(super) fn local(&self, mesh_node: u32) -> u32 {
        self.local[mesh_node as usize]
    }

    /// Of a local node.
    pub(super) fn mesh_node(&self, node: u32) -> u32 {
        self.nodes[node as usize]
    }

    /// Whether a local node is held along x, y, z.
    pub(super) fn held(&self, node: u32) -> [bool; 3] {
        self.held[node as usize]
    }

    pub(super) fn has(&self, mesh_node: u32) -> bool {
        self.local[mesh_node as usize] != NONE
    }

    pub(super) fn is_fixed(&self, mesh_node: u32) -> bool {
        self.roles.fixed[self.local[mesh_node as usize] as usize]
    }

    /// This body, the `body`-th of the scene, as its contacts see it.
    pub(super) fn part<'a>(&'a self, body: usize, has: &'a dyn Fn(u32) -> bool) -> Part<'a> {
        Part {
            body,
            name: &self.name,
            tets: &self.tets,
            has,
        }
    }

    fn fix(&mut self, spec: &BodySpec, mesh: &Mesh) -> Result<(), ModelError> {
        let used_by = |key| format!("body `{}`, {key}", spec.name);
        for name in &spec.fixed {
            for n in self.own_nodes(name, mesh, &used_by("fixed"))? {
                self.roles.fixed[n as usize] = true;
            }
        }
        for (axis, groups) in spec.fixed_along.iter().enumerate() {
            let key = ["fixed_x", "fixed_y", "fixed_z"][axis];
            for name in groups {
                for n in self.own_nodes(name, mesh, &used_by(key))? {
                    self.held[n as usize][axis] = true;
                }
            }
        }
        Ok(())
    }

    /// The body's nodes (local) in a group, at least one.
    fn own_nodes(&self, name: &str, mesh: &Mesh, used_by: &str) -> Result<Vec<u32>, ModelError> {
        let group = find_group(mesh, name, None, used_by)?;
        let own = group.nodes.iter().map(|&n| self.local[n as usize]);
        let own: Vec<u32> = own.filter(|&n| n != NONE).collect();
        if own.is_empty() {
            return Err(ModelError::FixedElsewhere {
                body: self.name.clone(),
                group: name.to_string(),
            });
        }
        Ok(own)
    }

    /// What of a vector at a (local) node is not taken by a support.
    fn movable(&self, node: u32, mut vector: [f64; 3]) -> [f64; 3] {
        for (v, held) in vector.iter_mut().zip(self.held[node as usize]) {
            if held {
                *v = 0.0;
            }
        }
        vector
    }

    /// Free dofs that are held, ascending. Tied nodes follow their corners.
    fn held_dofs(&self, dofs: &DofMap) -> Vec<u32> {
        let mut held = Vec::new();
        for (motion, axes) in dofs.nodes.iter().zip(&self.held) {
            if let NodeMotion::Free(n) = motion {
                held.extend((0..3).filter(|&k| axes[k as usize]).map(|k| 3 * n + k));
            }
        }
        held.sort_unstable();
        held
    }

    /// Adds the flank nodes (local, in the order of the pairs) and mid-edge nodes (mesh) of contact
    /// number `contact`.
    pub(super) fn add_flank(
        &mut self,
        flank: &[u32],
        tied: &[(u32, [u32; 2])],
        contact: usize,
        names: &[String],
        mesh: &Mesh,
    ) -> Result<(), ModelError> {
        let local = |n: u32| self.local[n as usize];
        let tied = tied
            .iter()
            .map(|&(n, corners)| (local(n), corners.map(local)));
        let tied: Vec<_> = tied.collect();
        let all = || flank.iter().copied().chain(tied.iter().map(|t| t.0));
        let tags = |wanted: &dyn Fn(u32) -> bool| {
            let found: Vec<u32> = all().filter(|&n| wanted(n)).collect();
            first_tags(mesh, found.iter().map(|&n| &self.nodes[n as usize]))
        };
        let (count, fixed) = tags(&|n| self.roles.fixed[n as usize]);
        if count > 0 {
            return Err(ModelError::FlankFixed {
                body: self.name.clone(),
                contact: names[contact].clone(),
                count,
                tags: fixed,
            });
        }
        if let Some(other) = all().find_map(|n| self.contact_of[n as usize]) {
            let (count, tags) = tags(&|n| self.contact_of[n as usize] == Some(other));
            return Err(ModelError::TwoContacts {
                first: names[other].clone(),
                second: names[contact].clone(),
                count,
                tags,
            });
        }
        for n in all() {
            self.contact_of[n as usize] = Some(contact);
        }
        self.roles.contact.extend(flank);
        self.roles.tied.extend(tied);
        Ok(())
    }

    fn finish(self, spec: &BodySpec, rotates: bool, mesh: &Mesh) -> Result<Body, ModelError> {
        let dofs = number(&self.roles);
        if dofs.free_nodes() == 0 {
            return Err(ModelError::NothingFree { body: self.name });
        }
        let held_dofs = self.held_dofs(&dofs);
        let of_tets = self.tets.iter().flat_map(|&e| mesh.tet(e as usize));
        let mesh_node = |&n: &u32| n as usize;
        Ok(Body {
            name: self.name,
            material: spec.material,
            rotates,
            fixed_interface_modes: spec.fixed_interface_modes,
            order: mesh.order,
            nodes_m: self
                .nodes
                .iter()
                .map(|n| mesh.nodes_m[mesh_node(n)])
                .collect(),
            node_tags: self
                .nodes
                .iter()
                .map(|n| mesh.node_tags[mesh_node(n)])
                .collect(),
            tets: of_tets.map(|&n| self.local[n as usize]).collect(),
            tet_tags: self
                .tets
                .iter()
                .map(|&e| mesh.tet_tags[e as usize])
                .collect(),
            mesh_nodes: self.nodes,
            held_dofs,
            loads: self.loads,
            dofs,
        })
    }
}
