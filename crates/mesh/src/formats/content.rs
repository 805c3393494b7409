//! Contents of a mesh file of any format: the common result of all readers.

use std::collections::{BTreeMap, HashSet};

use dovetail_numerics::space::{distance, middle};

use crate::element::{Connectivity, ElementOrder, ElementType};
use crate::near::Near;
use crate::text;
use crate::units::Units;
use crate::{FARTHEST_M, Group, Mesh, MeshError, MeshMaterial, sort_once};

/// Name of the group of all solids, or of all facets of a file without solids.
pub(super) const ALL: &str = "all";
/// Most nodes that a remark names.
const MOST_NAMED: usize = 5;

/// Nodes, elements, groups and materials of a file, in the units of the file.
///
/// Indices of nodes are positions in `nodes`, of which not all need to be used. Groups are those of
/// a [`Mesh`]; a set of nodes is a group of dimension 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Content {
    /// Positions of the nodes, in the unit of length of the file.
    pub nodes: Vec<[f64; 3]>,
    /// Number of each node in the file.
    pub node_tags: Vec<u64>,
    /// Solid elements, of the eight types of [`ElementType`](crate::element::ElementType).
    pub elements: Connectivity,
    /// Triangles of 3 or 6 nodes, quadrilaterals of 4 or 8.
    pub facets: Connectivity,
    /// Nodes of elements that are neither of these: lines, points, springs, elements of no group.
    pub other_nodes: Vec<u32>,
    /// Groups by name.
    pub groups: BTreeMap<String, Group>,
    /// Materials that the file gives to elements.
    pub materials: Vec<FileMaterial>,
    /// Remarks on contents of the file that were not read, one sentence each.
    pub remarks: Vec<String>,
}

/// Material of a file, in the units of the file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FileMaterial {
    /// Name in the file.
    pub name: String,
    /// Young's modulus, if given.
    pub young: Option<f64>,
    /// Poisson's ratio, if given.
    pub poisson: Option<f64>,
    /// Density, if given.
    pub density: Option<f64>,
    /// Elements made of the material, ascending, each once.
    pub elements: Vec<u32>,
}

impl FileMaterial {
    fn convert_to_si(self, units: Units) -> MeshMaterial {
        let scales = units.stress_pa_and_density_kg_m3();
        let [stress, density] = scales.unwrap_or([1.0; 2]);
        MeshMaterial {
            name: self.name,
            has_units: scales.is_some(),
            young_pa: self.young.map(|e| e * stress),
            poisson: self.poisson,
            density_kg_m3: self.density.map(|rho| rho * density),
            elements: self.elements,
        }
    }
}

impl Content {
    /// Converts to a mesh in metres. Nodes that no group, element or facet has are dropped, the
    /// others numbered in the order of the file.
    ///
    /// # Errors
    /// Neither solid elements nor facets, and a coordinate that is not a number or too far away.
    pub fn into_mesh(mut self, units: Units) -> Result<Mesh, MeshError> {
        const UNUSED: u32 = u32::MAX;
        let metres = units.metres();
        if !(metres.is_finite() && metres > 0.0) {
            return Err(MeshError::Unit(metres));
        }
        if self.elements.is_empty() {
            self.name_surface()?;
        }
        let mut new_index = vec![UNUSED; self.nodes.len()];
        let in_groups = self.groups.values().flat_map(|g| &g.nodes);
        let in_lists = self.elements.nodes().iter().chain(self.facets.nodes());
        for &node in in_groups.chain(in_lists) {
            new_index[node as usize] = 0;
        }
        let (mut nodes_m, mut node_tags) = (Vec::new(), Vec::new());
        let file = self.nodes.iter().zip(&self.node_tags);
        for (new, (&at, &tag)) in new_index.iter_mut().zip(file) {
            if *new == UNUSED {
                continue;
            }
            *new = nodes_m.len() as u32;
            let at_m = at.map(|x| x * metres);
            if at_m.iter().any(|x| !x.is_finite() || x.abs() > FARTHEST_M) {
                return Err(MeshError::NotFinite { tag, at });
            }
            nodes_m.push(at_m);
            node_tags.push(tag);
        }
        self.report_unused(&new_index);
        let lists = [&mut self.elements, &mut self.facets];
        let nodes = lists.into_iter().flat_map(Connectivity::nodes_mut);
        let in_groups = self.groups.values_mut().flat_map(|g| &mut g.nodes);
        for node in nodes.chain(in_groups) {
            *node = new_index[*node as usize];
        }
        for group in self.groups.values_mut() {
            sort_once(&mut group.nodes);
        }
        Ok(Mesh {
            nodes_m,
            node_tags,
            elements: self.elements,
            facets: self.facets,
            groups: self.groups,
            materials: self
                .materials
                .into_iter()
                .map(|m| m.convert_to_si(units))
                .collect(),
            remarks: self.remarks,
        })
    }

    /// Adds a remark on the nodes that have no new index because no element has them.
    fn report_unused(&mut self, new_index: &[u32]) {
        let mut is_used: Vec<bool> = new_index.iter().map(|new| *new != u32::MAX).collect();
        for node in &self.other_nodes {
            is_used[*node as usize] = true;
        }
        let unused: Vec<u32> = (0..)
            .zip(&is_used)
            .filter(|(_, used)| !**used)
            .map(|(i, _)| i)
            .collect();
        let tag = |node: &u32| self.node_tags[*node as usize];
        let first: Vec<u64> = unused.iter().take(MOST_NAMED).map(tag).collect();
        if first.is_empty() {
            return;
        }
        let mut remark = format!(
            "{} nodes belong to no element and were left out, first {}.",
            unused.len(),
            text::list(&first)
        );
        let middles = self.middles_among(&unused);
        if middles > 0 {
            remark += &format!(
                " {middles} of them lie in the middle of an edge of a linear element: if the \
                 elements were quadratic, a conversion has made them linear, so convert the mesh in \
                 another way."
            );
        }
        self.remarks.push(remark);
    }

    /// Number of these nodes that lie in the middle of an edge of a linear solid.
    fn middles_among(&self, nodes: &[u32]) -> usize {
        let is_linear = |e: &ElementType| e.order == ElementOrder::Linear;
        let solids = self
            .elements
            .solids()
            .filter(|(element, _)| is_linear(element));
        let edges = || {
            solids.clone().flat_map(|(element, nodes)| {
                let ends = element.shape.edges().iter();
                ends.map(|edge| edge.map(|i| self.nodes[nodes[i] as usize]))
            })
        };
        let radius = |[a, b]: [[f64; 3]; 2]| 1e-3 * distance(a, b);
        let largest = edges().map(radius).fold(0.0, f64::max);
        let near = Near::new(&self.nodes, nodes.iter().copied(), largest);
        let mut middles = HashSet::new();
        for edge in edges() {
            near.visit_within(middle(edge[0], edge[1]), radius(edge), |node| {
                middles.insert(node);
            });
        }
        middles.len()
    }

    /// Adds a group.
    ///
    /// # Errors
    /// Its name is taken.
    pub(super) fn add_group(&mut self, name: String, group: Group) -> Result<(), MeshError> {
        match self.groups.insert(name.clone(), group) {
            Some(_) => Err(MeshError::GroupNameTwice { name }),
            None => Ok(()),
        }
    }

    /// Adds a group, or adds its members to the group of this name.
    ///
    /// # Errors
    /// The name belongs to a group of another dimension.
    pub(super) fn join_group(&mut self, name: String, group: Group) -> Result<(), MeshError> {
        let known = self.groups.entry(name.clone());
        let known = known.or_insert_with(|| Group::empty(group.dimension));
        if known.dimension != group.dimension {
            return Err(MeshError::GroupNameTwice { name });
        }
        known.elements.extend(group.elements);
        known.nodes.extend(group.nodes);
        Ok(())
    }

    /// Adds a remark on solids of a Gmsh file that no physical group names.
    pub(super) fn solids_left_out(&mut self, count: usize) {
        if count > 0 {
            self.remarks.push(format!(
                "{count} solid elements are in no physical group and were left out: give them a \
                 `Physical Volume` if they belong to a body."
            ));
        }
    }

    /// Gives the nodes of a file without solids a volume, for a body whose stiffness and mass are
    /// matrices: the one volume that the file names, or `all`.
    ///
    /// # Errors
    /// There are no facets either, or the file names several volumes.
    fn name_surface(&mut self) -> Result<(), MeshError> {
        let volumes = self.groups.iter().filter(|(_, group)| group.dimension == 3);
        let volumes: Vec<String> = volumes.map(|(name, _)| name.clone()).collect();
        let name = match (volumes.as_slice(), self.facets.is_empty()) {
            ([], false) => self.free_name("all nodes"),
            ([only], false) => only.clone(),
            _ => return Err(MeshError::NoElements),
        };
        let in_groups = self.groups.values().flat_map(|group| &group.nodes);
        let nodes = in_groups.chain(self.facets.nodes()).copied().collect();
        self.remarks.push(format!(
            "There are no solid elements: the volume `{name}` is the nodes of the surfaces and \
             sets, for a body that takes its stiffness and mass from matrices (stiffness_file)."
        ));
        let group = Group {
            nodes,
            ..Group::empty(3)
        };
        self.groups.insert(name, group);
        Ok(())
    }

    /// Adds a group of all solids if no group has solids. A file without solids gets a group of all
    /// facets if no group has facets.
    pub(super) fn name_all(&mut self) {
        let has = |dimension| {
            self.groups
                .values()
                .any(|group| group.dimension == dimension)
        };
        let (name, group) = match (self.elements.is_empty(), self.facets.is_empty()) {
            (false, _) if !has(3) => ("all solids", self.solid_group()),
            (true, false) if !has(2) => ("all surfaces", self.facet_group()),
            _ => return,
        };
        self.groups.insert(self.free_name(name), group);
    }

    /// Group of all facets.
    fn facet_group(&self) -> Group {
        Group {
            dimension: 2,
            elements: (0..self.facets.len() as u32).collect(),
            nodes: self.facets.nodes().to_vec(),
        }
    }

    /// Group of all solids.
    pub(super) fn solid_group(&self) -> Group {
        Group {
            dimension: 3,
            elements: (0..self.elements.len() as u32).collect(),
            nodes: self.elements.nodes().to_vec(),
        }
    }

    /// Name of a group of everything: [`ALL`], or `other` where that is taken.
    pub(super) fn free_name(&self, other: &str) -> String {
        let name = if self.groups.contains_key(ALL) {
            other
        } else {
            ALL
        };
        name.to_owned()
    }

    /// Drops facets and nodes of groups that no solid has, and groups that are then empty; sorts
    /// the rest. For formats that also hold rigid tools, masses, springs and supports.
    ///
    /// # Errors
    /// There are neither solids nor facets.
    pub(super) fn drop_unused(&mut self) -> Result<(), MeshError> {
        if self.elements.is_empty() {
            // The surface of a body whose stiffness and mass are matrices stays whole.
            return match self.facets.is_empty() {
                false => Ok(()),
                true => Err(MeshError::Empty {
                    what: "solid elements",
                }),
            };
        }
        let mut on_solid = vec![false; self.nodes.len()];
        for node in self.elements.nodes() {
            on_solid[*node as usize] = true;
        }
        self.keep_facets(&on_solid);
        let (mut fewer, mut empty) = (Vec::new(), Vec::new());
        for (name, group) in &mut self.groups {
            sort_once(&mut group.nodes);
            sort_once(&mut group.elements);
            let before = group.nodes.len();
            group.nodes.retain(|node| on_solid[*node as usize]);
            let left_out = before - group.nodes.len();
            let is_empty = match group.dimension {
                2 | 3 => group.elements.is_empty(),
                _ => group.nodes.is_empty(),
            };
            if is_empty {
                empty.push(name.clone());
            } else if left_out > 0 {
                fewer.push(format!("`{name}` ({left_out} of {before})"));
            }
        }
        for name in &empty {
            self.groups.remove(name);
        }
        if !fewer.is_empty() {
            let groups = text::list(&fewer);
            self.remarks.push(format!(
                "Nodes that no solid element has were left out of these groups: {groups}."
            ));
        }
        if !empty.is_empty() {
            let quoted: Vec<String> = empty.iter().map(|name| format!("`{name}`")).collect();
            let groups = text::list(&quoted);
            self.remarks.push(format!(
                "These sets are no groups, as nothing in them belongs to a solid element: {groups}."
            ));
        }
        Ok(())
    }

    /// Drops the facets that have a node on no solid.
    fn keep_facets(&mut self, on_solid: &[bool]) {
        let nodes = on_solid.iter().zip(0..);
        let nodes: Vec<Option<u32>> = nodes.map(|(on, n)| on.then_some(n)).collect();
        let (kept, new_index) = self.facets.retain_nodes(&nodes);
        let left_out = self.facets.len() - kept.len();
        if left_out == 0 {
            return;
        }
        self.facets = kept;
        for group in self.groups.values_mut().filter(|g| g.dimension == 2) {
            let elements = group.elements.iter();
            group.elements = elements.filter_map(|f| new_index[*f as usize]).collect();
        }
        self.remarks.push(format!(
            "{left_out} triangles and quadrilaterals (shells, membranes, rigid faces) were left out, because not all of their nodes belong to solid elements."
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra, of which one is in no group.
    #[test]
    fn elements_of_no_group_keep_their_nodes() {
        let mut content = Content {
            nodes: (0..9).map(|i| [f64::from(i); 3]).collect(),
            node_tags: (0..9).collect(),
            ..Content::default()
        };
        content.elements.push(1, [0, 1, 2, 3]);
        content.elements.push(2, [4, 5, 6, 8]);
        let group = Group {
            dimension: 3,
            elements: vec![0],
            nodes: vec![0, 1, 2, 3],
        };
        content.groups.insert("blade".to_owned(), group);
        let mesh = content.into_mesh(1.0.into()).unwrap();
        assert_eq!(mesh.elements.element_nodes(1), [4, 5, 6, 7]);
        assert_eq!(mesh.node_tags, [0, 1, 2, 3, 4, 5, 6, 8]);
    }
}
