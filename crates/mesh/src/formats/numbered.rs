//! Meshes whose nodes and elements have numbers: archives of Ansys and bulk data of Nastran.
//!
//! A reader collects a [`NumberedMesh`]; [`NumberedMesh::place`] looks the numbers up, adds middle
//! nodes that elements lack, and finds the shapes of elements that name a node more than once. The
//! reader then adds groups and materials to the [`PlacedMesh`].

use std::collections::BTreeMap;

use super::collapse;
use super::content::{Content, FileMaterial};
use super::middles::Middles;
pub(super) use super::middles::NumberedKind;
use super::mirror::mirrored;
use super::named_groups::{NamedGroups, Origin};
use super::source::{LinePosition, SourceFiles};
use super::tag_index::TagIndex;
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
    node_index: TagIndex,
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
        if let Some(index) = self.node_index.get(tag) {
            let known = &mut self.nodes[index as usize];
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

    /// Position of a node.
    pub fn node(&self, tag: u64) -> Option<[f64; 3]> {
        let index = self.node_index.get(tag)?;
        Some(self.nodes[index as usize])
    }

    /// Moves a node.
    pub fn move_node(&mut self, tag: u64, at: [f64; 3]) {
        if let Some(index) = self.node_index.get(tag) {
            self.nodes[index as usize] = at;
        }
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
        let labels = self.elements.iter().map(|element| element.label);
        let mut sorted = [self.node_tags.clone(), labels.collect()];
        sorted
            .iter_mut()
            .for_each(|numbers| numbers.sort_unstable());
        let mut placed = PlacedMesh {
            sorted,
            content: Content {
                nodes: self.nodes,
                node_tags: self.node_tags,
                ..Content::default()
            },
            positions: Vec::with_capacity(self.elements.len()),
            node_index: self.node_index,
            element_index: TagIndex::default(),
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
                let known = placed.node_index.get(number);
                let missing = Some(Middles::MISSING).filter(|_| number == 0);
                let wrong = MeshError::MissingNode {
                    element: element.label,
                    node: number,
                };
                nodes.push(known.or(missing).ok_or(wrong).map_err(at)?);
            }
            start = element.end;
            let label = element.label;
            if placed.element_index.get(label).is_some() {
                return Err(at(MeshError::ElementTwice { label }));
            }
            placed.element_index.insert(label, index);
        }
        placed.add_elements(&self.elements, &nodes, files)?;
        Ok(placed)
    }
}

fn first_of(numbers: &[u64]) -> String {
    text::list(&numbers[..numbers.len().min(MOST_NAMED)])
}

/// Kind of the members of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Members {
    Nodes,
    Elements,
}

impl Members {
    fn plural(self) -> &'static str {
        match self {
            Self::Nodes => "nodes",
            Self::Elements => "elements",
        }
    }
}

/// Position of an element in the content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Position {
    Solid(u32),
    Facet(u32),
    Other,
}

/// Numbers of a list that are in these ranges, each once, and how many numbers of the ranges are not
/// in the list. The list is ascending.
fn members_of(all: &[u64], ranges: &[(u64, u64)]) -> (Vec<u64>, usize) {
    // Ranges that begin before each number, less those that end before it.
    let mut open = vec![0_i64; all.len() + 1];
    let mut missing: usize = 0;
    for &(first, last) in ranges.iter().filter(|(first, last)| first <= last) {
        let from = all.partition_point(|number| *number < first);
        let to = all.partition_point(|number| *number <= last);
        open[from] += 1;
        open[to] -= 1;
        let length = usize::try_from(last - first).unwrap_or(usize::MAX);
        missing = missing.saturating_add(length.saturating_add(1).saturating_sub(to - from));
    }
    let mut count = 0;
    let is_member = |(number, open): (&u64, &i64)| {
        count += open;
        (count > 0).then_some(*number)
    };
    (
        all.iter().zip(&open).filter_map(is_member).collect(),
        missing,
    )
}

/// Mesh of which all numbers are looked up.
pub(super) struct PlacedMesh {
    pub content: Content,
    /// Position of each element of the file.
    pub positions: Vec<Position>,
    node_index: TagIndex,
    /// Numbers of all nodes and of all elements, ascending.
    sorted: [Vec<u64>; 2],
    element_index: TagIndex,
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
        let (mut without_area, mut turned) = (Vec::new(), Vec::new());
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
                        let mirrored = mirrored(&kept, |n| content.nodes[n as usize]);
                        turned.extend(mirrored.as_ref().map(|_| tag));
                        let nodes = mirrored.as_ref().map_or(&*kept, |nodes| nodes);
                        content.elements.push(tag, nodes.iter().copied());
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
        if !turned.is_empty() {
            self.content.remarks.push(format!(
                "The nodes of {} solids were in mirrored order and were turned, first {}.",
                turned.len(),
                first_of(&turned)
            ));
        }
        let linear = || self.content.elements.iter();
        self.content.remarks.extend(middles.remark(linear));
        Ok(())
    }

    /// Notes that these nodes belong to elements which are not read.
    pub fn use_nodes(&mut self, numbers: &[u64]) {
        let known = numbers
            .iter()
            .filter_map(|number| self.node_index.get(*number));
        self.content.other_nodes.extend(known);
    }

    fn sorted(&self, members: Members) -> &[u64] {
        match members {
            Members::Nodes => &self.sorted[0],
            Members::Elements => &self.sorted[1],
        }
    }

    /// True if all numbers of these ranges are there, and there are some.
    pub fn has_all(&self, members: Members, ranges: &[(u64, u64)]) -> bool {
        let (found, missing) = members_of(self.sorted(members), ranges);
        missing == 0 && !found.is_empty()
    }

    /// Adds the groups of the nodes or elements whose numbers are in these ranges, first and last.
    /// Numbers that are not there are left out.
    pub fn group_ranges(&mut self, name: &str, members: Members, ranges: &[(u64, u64)]) {
        let (found, missing) = members_of(self.sorted(members), ranges);
        if missing > 0 {
            let (all, what) = (missing.saturating_add(found.len()), members.plural());
            self.missing
                .push(format!("`{name}` ({missing} of {all} {what})"));
        }
        match members {
            Members::Nodes => {
                let nodes = found
                    .iter()
                    .filter_map(|number| self.node_index.get(*number));
                let group = Group {
                    nodes: nodes.collect(),
                    ..Group::empty(0)
                };
                if !group.nodes.is_empty() {
                    self.groups.keep(name, Origin::NodeSet, group);
                }
            }
            Members::Elements => {
                let index = &self.element_index;
                let elements = found.iter().filter_map(|label| index.get(*label));
                let elements: Vec<u32> = elements.collect();
                self.group_elements(name, Origin::Solids, elements);
            }
        }
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
