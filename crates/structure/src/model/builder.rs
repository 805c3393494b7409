//! Body under construction: its nodes, how they move, and what acts on them.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use super::contacts::ContactSide;
use super::dofs::{Roles, number};
use super::gather::name_for;
use super::groups::{Outside, find_group};
use super::material::material;
use super::matrices::{GivenMatrices, PlacedMatrices, RowUnknown, place};
use super::{
    AppliedLoad, Body, DofMap, MatrixOrigin, ModelError, NodeMotion, Spring, StraightenedEdges,
    Support,
};
use crate::model::{BodySpec, MaterialSpec, RotationSpec};
use dovetail_mesh::element::sorted_facet;
use dovetail_mesh::quality::folds;
use dovetail_mesh::volume::volume_m3;
use dovetail_mesh::{Connectivity, ElementType, Mesh};
use dovetail_numerics::space::{distance, middle};

const NONE: u32 = u32::MAX;
/// A middle node counts as in the middle if it is nearer to it than this fraction of the edge.
const STRAIGHT: f64 = 1e-9;

/// Source of the matrices of a body whose material is not looked up yet.
enum Unfinished {
    Elements(MaterialSpec),
    Given(PlacedMatrices),
}

/// Source of the matrices of a body, with the contents of its files.
pub(super) enum MatrixContents<'a> {
    /// Finite elements of this material.
    Elements(&'a MaterialSpec),
    /// Matrices of another program, and their axes where the body is turned.
    Given(&'a Arc<GivenMatrices>, Option<[[f64; 3]; 3]>),
}

/// Body on its way into the model.
pub(super) struct BodyBuilder {
    name: String,
    /// Elements of the mesh.
    elements: Vec<u32>,
    /// Local node -> mesh node, ascending.
    nodes: Vec<u32>,
    /// Position of each local node, m. On flanks the edges are straight, whatever the mesh has.
    nodes_m: Vec<[f64; 3]>,
    /// Mesh node -> local node, or `NONE`.
    local: Vec<u32>,
    roles: Roles,
    /// Held axes (x, y, z) of each local node.
    held: Vec<[bool; 3]>,
    supports: Vec<Support>,
    /// Axes of each local node along which one of the supports holds it.
    supported: Vec<[bool; 3]>,
    loads: Vec<(usize, AppliedLoad)>,
    springs: Vec<Spring>,
    matrices: Unfinished,
    /// True for each local node that belongs to a contact.
    in_contact: Vec<bool>,
}

impl BodyBuilder {
    /// Body without supports, loads and contacts. `sprung` has the axes along which springs will
    /// act on nodes of the mesh.
    pub(super) fn new(
        spec: &BodySpec,
        mesh: &Mesh,
        source: MatrixContents<'_>,
        sprung: &HashMap<u32, [bool; 3]>,
    ) -> Result<Self, ModelError> {
        let used_by = format!("body `{}`", spec.name);
        let volume = name_for(mesh, &spec.name, &spec.volume);
        let group = find_group(mesh, &volume, Some(3), &used_by)?;
        let mut local = vec![NONE; mesh.nodes_m.len()];
        for (i, &n) in (0..).zip(&group.nodes) {
            local[n as usize] = i;
        }
        let nodes = group.nodes.len();
        let mut roles = Roles {
            fixed: vec![false; nodes],
            ..Roles::default()
        };
        let mut held = vec![[false; 3]; nodes];
        let matrices = match source {
            MatrixContents::Elements(_) if group.elements.is_empty() => {
                return Err(ModelError::SurfaceAlone {
                    body: spec.name.clone(),
                    volume: spec.volume.clone(),
                });
            }
            MatrixContents::Elements(material) => Unfinished::Elements(material.clone()),
            MatrixContents::Given(given, axes) => {
                let tags = group.nodes.iter().map(|&n| mesh.node_tags[n as usize]);
                let tags: Vec<u64> = tags.collect();
                let along = group.nodes.iter().map(|n| sprung.get(n).copied());
                let along: Vec<[bool; 3]> = along.map(Option::unwrap_or_default).collect();
                let placed = place(&spec.name, given, axes, &tags, &along)?;
                // What has no row does not move: supports of the other program are not in it.
                for (node, known) in placed.axes_with_rows(nodes).into_iter().enumerate() {
                    roles.fixed[node] = known == [false; 3];
                    held[node] = known.map(|known| !known);
                }
                roles.auxiliary = vec![false; placed.unmeshed_unknowns().div_ceil(3)];
                Unfinished::Given(placed)
            }
        };
        Ok(Self {
            name: spec.name.clone(),
            elements: group.elements.clone(),
            nodes: group.nodes.clone(),
            nodes_m: group
                .nodes
                .iter()
                .map(|&n| mesh.nodes_m[n as usize])
                .collect(),
            local,
            roles,
            held,
            supports: Vec::new(),
            supported: vec![[false; 3]; nodes],
            loads: Vec::new(),
            springs: Vec::new(),
            matrices,
            in_contact: vec![false; group.nodes.len()],
        })
    }

    /// Fixes a flank that rigid ground holds, and removes it from the flanks.
    pub(super) fn hold_flank(&mut self, contact: &str, side: &ContactSide) {
        let nodes: Vec<u32> = side.nodes.iter().map(|&node| self.local(node)).collect();
        for &node in &nodes {
            self.roles.fixed[node as usize] = true;
        }
        self.support(contact, nodes, [true; 3]);
        let is_fixed = |node: u32| self.roles.fixed[node as usize];
        self.roles.contact.retain(|n| !is_fixed(*n));
        self.roles.tied.retain(|t| !is_fixed(t.0));
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Mesh nodes of the body, ascending.
    pub(super) fn mesh_nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Node positions in the body's own numbering, m.
    pub(super) fn nodes_m(&self) -> &[[f64; 3]] {
        &self.nodes_m
    }

    /// Origin of the surface of the body: its elements, or the facets on its nodes, each once.
    pub(super) fn outside<'a>(&'a self, mesh: &'a Mesh) -> Outside<'a> {
        let mut facets: Vec<(u64, &[u32])> = Vec::new();
        if self.elements.is_empty() {
            let mut seen: HashSet<[u32; 4]> = HashSet::new();
            let all_facets = mesh.facets.iter().zip(mesh.facets.tags());
            let outside_facets = all_facets.filter(|(nodes, _)| nodes.iter().all(|&n| self.has(n)));
            let once = outside_facets.filter(|(nodes, _)| seen.insert(sorted_facet(nodes)));
            facets.extend(once.map(|(nodes, &tag)| (tag, nodes)));
        }
        Outside {
            elements: &self.elements,
            facets,
        }
    }

    pub(super) fn local(&self, mesh_node: u32) -> u32 {
        self.local[mesh_node as usize]
    }

    /// Returns `true` if a node of the mesh is held along an axis.
    pub(super) fn is_held(&self, mesh_node: u32, axis: usize) -> bool {
        self.held[self.local(mesh_node) as usize][axis]
    }

    pub(super) fn has(&self, mesh_node: u32) -> bool {
        self.local[mesh_node as usize] != NONE
    }

    /// Returns `true` if a node of the mesh belongs to a contact.
    pub(super) fn is_in_contact(&self, mesh_node: u32) -> bool {
        self.in_contact[self.local(mesh_node) as usize]
    }

    /// Local nodes in the middles of edges that follow the corners of these.
    pub(super) fn tied(&self) -> BTreeMap<u32, [u32; 2]> {
        self.roles.tied.iter().copied().collect()
    }

    pub(super) fn is_fixed(&self, mesh_node: u32) -> bool {
        self.roles.fixed[self.local[mesh_node as usize] as usize]
    }

    /// Those of these nodes of the mesh that have no row in the matrices of another program.
    pub(super) fn nodes_lacking_rows(&self, mesh_nodes: &[u32]) -> Vec<u32> {
        let Unfinished::Given(placed) = &self.matrices else {
            return Vec::new();
        };
        let known = placed.axes_with_rows(self.nodes.len());
        let lacks = |n: &u32| self.has(*n) && known[self.local(*n) as usize] == [false; 3];
        mesh_nodes.iter().copied().filter(lacks).collect()
    }

    pub(super) fn fix(&mut self, spec: &BodySpec, mesh: &Mesh) -> Result<(), ModelError> {
        let used_by = |key| format!("body `{}`, {key}", spec.name);
        for name in &spec.fixed {
            let nodes = self.body_nodes(name, mesh, &used_by("fixed"))?;
            for &n in &nodes {
                self.roles.fixed[n as usize] = true;
            }
            self.support(name, nodes, [true; 3]);
        }
        for (axis, groups) in spec.fixed_along.iter().enumerate() {
            let key = ["fixed_x", "fixed_y", "fixed_z"][axis];
            for name in groups {
                let nodes = self.body_nodes(name, mesh, &used_by(key))?;
                for &n in &nodes {
                    self.held[n as usize][axis] = true;
                }
                self.support(name, nodes, [0, 1, 2].map(|k| k == axis));
            }
        }
        Ok(())
    }

    /// Adds nodes (local) that are held along some axes to the support of this name. Axes along
    /// which another support holds them stay with that one.
    fn support(&mut self, name: &str, nodes: Vec<u32>, along: [bool; 3]) {
        let at = self.supports.iter().position(|known| known.name == name);
        let at = at.unwrap_or_else(|| {
            self.supports.push(Support {
                name: name.to_owned(),
                nodes: Vec::new(),
            });
            self.supports.len() - 1
        });
        for node in nodes {
            let taken = &mut self.supported[node as usize];
            let axes = [0, 1, 2].map(|k| along[k] && !taken[k]);
            *taken = [0, 1, 2].map(|k| along[k] || taken[k]);
            self.supports[at].nodes.push((node, axes));
        }
    }

    /// Supports with each node once, without tied nodes and axes that have no row. Supports that
    /// hold nothing then are left out.
    fn finished_supports(&mut self, dofs: &DofMap) -> Vec<Support> {
        let known = match &self.matrices {
            Unfinished::Given(placed) => Some(placed.axes_with_rows(self.nodes.len())),
            Unfinished::Elements(_) => None,
        };
        let mut supports = std::mem::take(&mut self.supports);
        for support in &mut supports {
            support.nodes.sort_by_key(|(node, _)| *node);
            support.nodes.dedup_by(|again, first| {
                let same = again.0 == first.0;
                if same {
                    first.1 = [0, 1, 2].map(|k| first.1[k] || again.1[k]);
                }
                same
            });
            support.nodes.retain_mut(|(node, axes)| {
                let node = *node as usize;
                if let Some(known) = &known {
                    *axes = [0, 1, 2].map(|k| axes[k] && known[node][k]);
                }
                *axes != [false; 3] && !matches!(dofs.nodes[node], NodeMotion::Tied(_))
            });
        }
        supports.retain(|support| !support.nodes.is_empty());
        supports
    }

    /// Nodes of the body (local) in a group, at least one.
    fn body_nodes(&self, name: &str, mesh: &Mesh, used_by: &str) -> Result<Vec<u32>, ModelError> {
        let name = name_for(mesh, &self.name, name);
        let group = find_group(mesh, &name, None, used_by)?;
        let local_nodes = group.nodes.iter().map(|&n| self.local[n as usize]);
        let nodes: Vec<u32> = local_nodes.filter(|&n| n != NONE).collect();
        if nodes.is_empty() {
            return Err(ModelError::FixedElsewhere {
                body: self.name.clone(),
                group: name.into_owned(),
            });
        }
        Ok(nodes)
    }

    /// Free degrees of freedom that are held, ascending. Tied nodes follow their corners.
    fn held_dofs(&self, dofs: &DofMap) -> Vec<u32> {
        let mut held = Vec::new();
        if let Unfinished::Given(given) = &self.matrices {
            // Of the unknowns that are not on the mesh, rotations of supports are held, and what
            // fills the last auxiliary node.
            let mut moves = vec![false; 3 * given.unmeshed_unknowns().div_ceil(3)];
            for place in &given.places {
                if let RowUnknown::Other { number, rotates } = *place {
                    moves[number as usize] = rotates.is_none_or(|n| !self.roles.fixed[n as usize]);
                }
            }
            let still = (0..).zip(moves).filter(|(_, moves)| !moves);
            let dof = |number: u32| 3 * dofs.auxiliary[number as usize / 3] + number % 3;
            held.extend(still.map(|(number, _)| dof(number)));
        }
        for (motion, axes) in dofs.nodes.iter().zip(&self.held) {
            if let NodeMotion::Free(n) = motion {
                held.extend((0..3).filter(|&k| axes[k as usize]).map(|k| 3 * n + k));
            }
        }
        held.sort_unstable();
        held
    }

    /// Adds the nodes (mesh) of a flank in the order of the pairs, and its mid-edge nodes. Fixed
    /// nodes, and those that another contact has already added, stay as they are.
    pub(super) fn add_flank(&mut self, flank: &[u32], tied: &[(u32, [u32; 2])]) {
        for &n in flank {
            let node = self.local(n) as usize;
            if !self.roles.fixed[node] && !std::mem::replace(&mut self.in_contact[node], true) {
                self.roles.contact.push(node as u32);
            }
        }
        for &(middle, corners) in tied {
            let node = self.local(middle) as usize;
            if !self.roles.fixed[node] && !std::mem::replace(&mut self.in_contact[node], true) {
                let corners = corners.map(|n| self.local(n));
                self.roles.tied.push((node as u32, corners));
            }
        }
    }

    /// Puts the middle nodes of the flanks' edges, which move with the mean of their corners, half
    /// way between these. Returns `None` where all of them are there already.
    ///
    /// # Errors
    /// Elements fold over themselves after the change.
    pub(super) fn straighten_flanks(
        &mut self,
        mesh: &Mesh,
    ) -> Result<Option<StraightenedEdges>, ModelError> {
        if matches!(self.matrices, Unfinished::Given(_)) {
            // Matrices of another program are those of the edges as they are.
            return Ok(None);
        }
        let mut straightened = StraightenedEdges {
            body: self.name.clone(),
            edges: 0,
            largest_m: 0.0,
            largest_share: 0.0,
        };
        let mut is_moved = vec![false; self.nodes.len()];
        for &(node, corners) in &self.roles.tied {
            let [a, b] = corners.map(|corner| self.nodes_m[corner as usize]);
            let half_way = middle(a, b);
            let at = &mut self.nodes_m[node as usize];
            let off_m = distance(*at, half_way);
            let share = off_m / distance(a, b);
            if share > STRAIGHT {
                is_moved[node as usize] = true;
                straightened.edges += 1;
                straightened.largest_m = straightened.largest_m.max(off_m);
                straightened.largest_share = straightened.largest_share.max(share);
                *at = half_way;
            }
        }
        if straightened.edges == 0 {
            return Ok(None);
        }
        let mut folded = Vec::new();
        for &e in &self.elements {
            let nodes = mesh.elements.element_nodes(e as usize).iter();
            let nodes: Vec<usize> = nodes.map(|&n| self.local(n) as usize).collect();
            let element = ElementType::from_node_count(nodes.len());
            if let Some(element) = element.filter(|_| nodes.iter().any(|n| is_moved[*n])) {
                let x: Vec<[f64; 3]> = nodes.iter().map(|&n| self.nodes_m[n]).collect();
                if folds(element, &x) {
                    folded.push(mesh.elements.tags()[e as usize]);
                }
            }
        }
        if folded.is_empty() {
            Ok(Some(straightened))
        } else {
            Err(ModelError::FoldedAtFlank {
                body: self.name.clone(),
                count: folded.len(),
                tags: folded.into_iter().take(5).collect(),
                largest_m: straightened.largest_m,
            })
        }
    }

    pub(super) fn add_load(&mut self, number: usize, load: AppliedLoad) {
        self.loads.push((number, load));
    }

    pub(super) fn add_spring(&mut self, spring: Spring) {
        self.springs.push(spring);
    }

    /// Adds a node without position and mass and returns its local number. `is_end`: it is joined
    /// to one of another body.
    pub(super) fn add_auxiliary(&mut self, is_end: bool) -> u32 {
        self.roles.auxiliary.push(is_end);
        (self.nodes.len() + self.roles.auxiliary.len() - 1) as u32
    }

    pub(super) fn finish(
        mut self,
        spec: &BodySpec,
        rotation: Option<&RotationSpec>,
        mesh: &Mesh,
    ) -> Result<Body, ModelError> {
        let dofs = number(&self.roles);
        if dofs.free_nodes() == 0 {
            return Err(ModelError::NothingFree { body: self.name });
        }
        let held_dofs = self.held_dofs(&dofs);
        let supports = self.finished_supports(&dofs);
        let mut facets = Connectivity::default();
        for (tag, nodes) in self.outside(mesh).facets {
            facets.push(tag, nodes.iter().map(|&n| self.local[n as usize]));
        }
        let rotates = rotation.is_some_and(|r| r.bodies.contains(&spec.name));
        let matrices = match self.matrices {
            Unfinished::Given(_) if rotates && rotation.is_some_and(|r| r.speed_rad_s != 0.0) => {
                return Err(ModelError::MatricesRotate { body: self.name });
            }
            Unfinished::Given(placed) => MatrixOrigin::Given(placed),
            Unfinished::Elements(spec) => {
                let positions = |nodes: &[u32]| {
                    let local = nodes.iter().map(|&n| self.local[n as usize]);
                    local.map(|n| self.nodes_m[n as usize]).collect()
                };
                let solids = self
                    .elements
                    .iter()
                    .map(|&e| mesh.elements.solid(e as usize));
                let solids = solids.map(|(element, nodes)| (element, positions(nodes)));
                let volume = || volume_m3(solids);
                MatrixOrigin::Elements(material(&spec, mesh, &self.name, &self.elements, volume)?)
            }
        };
        let mut elements = Connectivity::default();
        for &e in &self.elements {
            let nodes = mesh.elements.element_nodes(e as usize).iter();
            let tag = mesh.elements.tags()[e as usize];
            elements.push(tag, nodes.map(|&n| self.local[n as usize]));
        }
        let mesh_node = |&n: &u32| n as usize;
        Ok(Body {
            name: self.name,
            matrices,
            rotates,
            fixed_interface_modes: spec.fixed_interface_modes,
            nodes_m: self.nodes_m,
            node_tags: self
                .nodes
                .iter()
                .map(|n| mesh.node_tags[mesh_node(n)])
                .collect(),
            elements,
            facets,
            mesh_nodes: self.nodes,
            held_dofs,
            supports,
            loads: self.loads,
            springs: self.springs,
            dofs,
        })
    }
}
