//! A body while it is built: its nodes, how they move, and what acts on them.

use super::contacts::Part;
use super::dofs::{Roles, number};
use super::gather::name_for;
use super::groups::{find_group, first_tags};
use super::material::material;
use super::{Body, DofMap, ModelError, NodeMotion, StaticLoad};
use crate::mesh::{Connectivity, Mesh};
use crate::model::{BodySpec, RotationSpec};

const NONE: u32 = u32::MAX;

/// A body on its way into the model.
pub(super) struct BodyBuilder {
    name: String,
    /// Elements of the mesh.
    elements: Vec<u32>,
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

impl BodyBuilder {
    pub(super) fn new(spec: &BodySpec, mesh: &Mesh) -> Result<Self, ModelError> {
        let used_by = format!("body `{}`", spec.name);
        let volume = name_for(mesh, &spec.name, &spec.volume);
        let group = find_group(mesh, &volume, Some(3), &used_by)?;
        let mut local = vec![NONE; mesh.nodes_m.len()];
        for (i, &n) in (0..).zip(&group.nodes) {
            local[n as usize] = i;
        }
        Ok(Self {
            name: spec.name.clone(),
            elements: group.elements.clone(),
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

    /// Ascending.
    pub(super) fn mesh_nodes(&self) -> &[u32] {
        &self.nodes
    }

    pub(super) fn elements(&self) -> &[u32] {
        &self.elements
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
            elements: &self.elements,
            has,
        }
    }

    pub(super) fn fix(&mut self, spec: &BodySpec, mesh: &Mesh) -> Result<(), ModelError> {
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
        let name = name_for(mesh, &self.name, name);
        let group = find_group(mesh, &name, None, used_by)?;
        let own = group.nodes.iter().map(|&n| self.local[n as usize]);
        let own: Vec<u32> = own.filter(|&n| n != NONE).collect();
        if own.is_empty() {
            return Err(ModelError::FixedElsewhere {
                body: self.name.clone(),
                group: name.into_owned(),
            });
        }
        Ok(own)
    }

    /// What of a vector at a (local) node is not taken by a support.
    pub(super) fn movable(&self, node: u32, mut vector: [f64; 3]) -> [f64; 3] {
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

    pub(super) fn add_load(&mut self, load: StaticLoad) {
        self.loads.push(load);
    }

    pub(super) fn finish(
        self,
        spec: &BodySpec,
        rotation: Option<&RotationSpec>,
        mesh: &Mesh,
    ) -> Result<Body, ModelError> {
        let dofs = number(&self.roles);
        if dofs.free_nodes() == 0 {
            return Err(ModelError::NothingFree { body: self.name });
        }
        let material = material(&spec.material, mesh, &self.name, &self.elements)?;
        let held_dofs = self.held_dofs(&dofs);
        let mut elements = Connectivity::default();
        for &e in &self.elements {
            let nodes = mesh.elements.of(e as usize).iter();
            let tag = mesh.elements.tags()[e as usize];
            elements.push(tag, nodes.map(|&n| self.local[n as usize]));
        }
        let mesh_node = |&n: &u32| n as usize;
        Ok(Body {
            name: self.name,
            material,
            rotates: rotation.is_some_and(|r| r.bodies.contains(&spec.name)),
            fixed_interface_modes: spec.fixed_interface_modes,
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
            elements,
            mesh_nodes: self.nodes,
            held_dofs,
            loads: self.loads,
            dofs,
        })
    }
}
