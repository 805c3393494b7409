//! Meshes whose nodes and elements have numbers: archives of Ansys.
//!
//! A reader collects a [`NumberedMesh`]; [`NumberedMesh::place`] looks the numbers up, adds middle
//! nodes that elements lack, and finds the shapes of elements that name a node more than once. The
//! reader then adds groups and materials to the [`PlacedMesh`].

use std::collections::{BTreeMap, HashMap};

use super::collapse;
use super::content::{Content, FileMaterial};
use super::middles::Middles;
pub(super) use super::middles::NumberedKind;
use super::named_groups::{NamedGroups, Origin};
use super::source::{LinePosition, SourceFiles};
use crate::text;
use crate::{Group, MeshError};

/// Most numbers that a remark names.
const MOST_NAMED: usize = 5;

struct NumberedElement {
    label: u64,
    kind: NumberedKind,
    /// Index behind its last node in [`NumberedMesh::numbers`].
    end: usize,
    place: LinePosition,
}

/// Nodes and elements of a file.
#[derive(Default)]
pub(super) struct NumberedMesh {
    nodes: Vec<[f64; 3]>,
    node_tags: Vec<u64>,
    node_index: HashMap<u64, u32>,
    highest_tag: u64,
    elements: Vec<NumberedElement>,
    numbers: Vec<u64>,
    /// Numbers of nodes that were given a second position.
    moved: Vec<u64>,
}

impl NumberedMesh {
    /// Adds a node. A node that is there already moves to its new position.
    ///
    /// # Errors
    /// More nodes than can be numbered.
    pub fn add_node(&mut self, tag: u64, at: [f64; 3]) -> Result<(), MeshError> {
        if let Some(index) = self.node_index.get(&tag) {
            let known = &mut self.nodes[*index as usize];
            if *known != at {
                *known = at;
                self.moved.push(tag);
            }
            return Ok(());
        }
        MeshError::check_number("nodes", self.nodes.len() as u64)?;
        self.node_index.insert(tag, self.nodes.len() as u32);
        self.nodes.push(at);
        self.node_tags.push(tag);
        self.highest_tag = self.highest_tag.max(tag);
        Ok(())
    }

    /// Adds an element of nodes in our order and returns its index. The number 0 is a middle node
    /// that the element lacks.
    ///
    /// # Errors
    /// More elements than can be numbered.
    pub fn add_element(
        &mut self,
        label: u64,
        kind: NumberedKind,
        nodes: &[u64],
        place: LinePosition,
    ) -> Result<u32, MeshError> {
        MeshError::check_number("elements", self.elements.len() as u64)?;
        self.numbers.extend(nodes);
        self.elements.push(NumberedElement {
            label,
            kind,
            end: self.numbers.len(),
            place,
        });
        Ok(self.elements.len() as u32 - 1)
    }

    /// Numbers of the nodes, in the order of the file.
    pub fn node_tags(&self) -> &[u64] {
        &self.node_tags
    }

    /// Highest number of a node.
    pub fn highest_tag(&self) -> u64 {
        self.highest_tag
    }

    /// Looks the nodes of all elements up and finds their shapes.
    ///
    /// # Errors
    /// A node that the file does not have, an element number that occurs twice, and a solid of no
    /// known shape.
    pub fn place(self, files: &SourceFiles) -> Result<PlacedMesh, MeshError> {
        let mut placed = PlacedMesh {
            content: Content {
                nodes: self.nodes,
                node_tags: self.node_tags,
                ..Content::default()
            },
            positions: Vec::with_capacity(self.elements.len()),
            node_index: self.node_index,
            element_index: HashMap::with_capacity(self.elements.len()),
            groups: NamedGroups::default(),
            missing: Vec::new(),
        };
        if !self.moved.is_empty() {
            placed.content.remarks.push(format!(
                "{} nodes are defined again at another place, and their last place counts, first {}.",
                self.moved.len(),
                first_of(&self.moved)
            ));
        }
        let mut nodes = Vec::with_capacity(self.numbers.len());
        let mut start = 0;
        for (index, element) in (0..).zip(&self.elements) {
            let at = |error| files.locate_error(element.place, "", error);
            for &number in &self.numbers[start..element.end] {
                let known = placed.node_index.get(&number).copied();
                let missing = Some(Middles::MISSING).filter(|_| number == 0);
                let wrong = MeshError::MissingNode {
                    element: element.label,
                    node: number,
                };
                nodes.push(known.or(missing).ok_or(wrong).map_err(at)?);
            }
            start = element.end;
            let label = element.label;
            if placed.element_index.insert(label, index).is_some() {
                return Err(at(MeshError::ElementTwice { label }));
            }
        }
        placed.add_elements(&self.elements, &nodes, files)?;
        Ok(placed)
    }
}

fn first_of(numbers: &[u64]) -> String {
    text::list(&numbers[..numbers.len().min(MOST_NAMED)])
}

/// Position of an element in the content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Position {
    Solid(u32),
    Facet(u32),
    Other,
}

/// Mesh of which all numbers are looked up.
pub(super) struct PlacedMesh {
    pub content: Content,
    /// Position of each element of the file.
    pub positions: Vec<Position>,
    node_index: HashMap<u64, u32>,
    element_index: HashMap<u64, u32>,
    groups: NamedGroups,
    /// Sets that name nodes or elements which are not there.
    missing: Vec<String>,
}

impl PlacedMesh {
    fn add_elements(
        &mut self,
        elements: &[NumberedElement],
        nodes: &[u32],
        files: &SourceFiles,
    ) -> Result<(), MeshError> {
        let ends = elements.iter().map(|element| element.end);
        let starts = std::iter::once(0).chain(ends);
        let parts = || elements.iter().zip(starts.clone());
        let mut middles = Middles::default();
        for (element, start) in parts() {
            middles.inspect(element.kind, &nodes[start..element.end]);
        }
        if middles.lacking > 0 {
            for (element, start) in parts() {
                middles.learn(element.kind, &nodes[start..element.end]);
            }
        }
        let mut without_area = Vec::new();
        for (element, start) in parts() {
            let tag = element.label;
            let at = |error| files.locate_error(element.place, "", error);
            let nodes = &nodes[start..element.end];
            self.positions.push(match element.kind {
                NumberedKind::Other => {
                    let nodes = nodes.iter().filter(|node| **node != Middles::MISSING);
                    self.content.other_nodes.extend(nodes);
                    Position::Other
                }
                kind => {
                    let nodes = middles.complete(kind, nodes, &mut self.content);
                    let content = &mut self.content;
                    if nodes.contains(&Middles::MISSING) {
                        return Err(at(MeshError::MissingNode {
                            element: tag,
                            node: 0,
                        }));
                    }
                    if kind == NumberedKind::Solid {
                        let kept = collapse::solid(tag, &nodes, &content.node_tags).map_err(at)?;
                        content.elements.push(tag, kept.iter().copied());
                        Position::Solid(content.elements.len() as u32 - 1)
                    } else if let Ok(kept) = collapse::facet(tag, &nodes, &content.node_tags) {
                        content.facets.push(tag, kept.iter().copied());
                        Position::Facet(content.facets.len() as u32 - 1)
                    } else {
                        without_area.push(tag);
                        Position::Other
                    }
                }
            });
        }
        if !without_area.is_empty() {
            self.content.remarks.push(format!(
                "{} surface elements without an area were left aside, first {}.",
                without_area.len(),
                first_of(&without_area)
            ));
        }
        let linear = || self.content.elements.iter();
        self.content.remarks.extend(middles.remark(linear));
        Ok(())
    }

    /// Index of an element by its number.
    pub fn element(&self, label: u64) -> Option<u32> {
        self.element_index.get(&label).copied()
    }

    /// Adds the groups of the elements with these indices: a volume, a surface and the nodes of
    /// other elements.
    pub fn group_elements(
        &mut self,
        name: &str,
        solids: Origin,
        elements: impl IntoIterator<Item = u32>,
    ) {
        let mut groups = [(solids, Group::empty(3)), (Origin::Shells, Group::empty(2))];
        for element in elements {
            let (slot, index, list) = match self.positions[element as usize] {
                Position::Solid(index) => (0, index, &self.content.elements),
                Position::Facet(index) => (1, index, &self.content.facets),
                Position::Other => continue,
            };
            let (_, group) = &mut groups[slot];
            group.elements.push(index);
            group.nodes.extend(list.element_nodes(index as usize));
        }
        for (origin, group) in groups {
            if !group.elements.is_empty() {
                self.groups.keep(name, origin, group);
            }
        }
    }

    /// Adds the groups of the elements with these numbers.
    pub fn group_labels(&mut self, name: &str, labels: impl IntoIterator<Item = u64>) {
        let mut missing = 0;
        let mut elements = Vec::new();
        for label in labels {
            match self.element(label) {
                Some(element) => elements.push(element),
                None => missing += 1,
            }
        }
        self.note_missing(name, "elements", missing, elements.len());
        self.group_elements(name, Origin::Solids, elements);
    }

    /// Adds a group of the nodes with these numbers.
    pub fn group_nodes(&mut self, name: &str, numbers: impl IntoIterator<Item = u64>) {
        let mut missing = 0;
        let mut group = Group::empty(0);
        for number in numbers {
            match self.node_index.get(&number) {
                Some(node) => group.nodes.push(*node),
                None => missing += 1,
            }
        }
        self.note_missing(name, "nodes", missing, group.nodes.len());
        if !group.nodes.is_empty() {
            self.groups.keep(name, Origin::NodeSet, group);
        }
    }

    /// Notes that a set names so many nodes or elements which are not there.
    pub fn note_missing(&mut self, name: &str, what: &str, missing: usize, found: usize) {
        if missing > 0 {
            let all = missing.saturating_add(found);
            self.missing
                .push(format!("`{name}` ({missing} of {all} {what})"));
        }
    }

    /// Gives the solids their materials. `numbers` has the material number of each element of the
    /// file; materials without a property are left out.
    pub fn give_materials(&mut self, mut known: BTreeMap<u64, FileMaterial>, numbers: &[u64]) {
        for (position, number) in self.positions.iter().zip(numbers) {
            if let (Position::Solid(solid), Some(material)) = (position, known.get_mut(number)) {
                material.elements.push(*solid);
            }
        }
        let materials = &mut self.content.materials;
        for material in known.into_values().filter(|m| !m.elements.is_empty()) {
            let is_same = |m: &&mut FileMaterial| {
                m.name == material.name
                    && (m.young, m.poisson, m.density)
                        == (material.young, material.poisson, material.density)
            };
            match materials.iter_mut().find(is_same) {
                Some(same) => {
                    same.elements.extend(material.elements);
                    same.elements.sort_unstable();
                }
                None => materials.push(material),
            }
        }
    }

    /// Content of the file: with the volume `all` unless a volume has all solids, and without
    /// groups and facets that no solid has. `noted` are remarks of the reader.
    ///
    /// # Errors
    /// There are neither solids nor facets; `others` are the types of the other elements and `read`
    /// those that are read.
    pub fn finish(
        mut self,
        noted: impl IntoIterator<Item = String>,
        others: &[String],
        read: &'static str,
    ) -> Result<Content, MeshError> {
        let content = &mut self.content;
        if content.elements.is_empty() && content.facets.is_empty() && !others.is_empty() {
            let kinds = text::list(others);
            return Err(MeshError::NothingRead { kinds, read });
        }
        content.remarks.extend(noted);
        if !self.missing.is_empty() {
            content.remarks.push(format!(
                "Numbers that are not there were left out of these sets: {}.",
                text::list(&self.missing)
            ));
        }
        self.groups.move_to(content)?;
        let solids = content.elements.len();
        let has_all = |group: &Group| group.dimension == 3 && group.elements.len() == solids;
        if solids > 0 && !content.groups.values().any(has_all) {
            let name = content.free_name("all solids");
            let group = content.solid_group();
            content.groups.entry(name).or_insert(group);
        }
        content.name_all();
        content.drop_unused()?;
        Ok(self.content)
    }
}
