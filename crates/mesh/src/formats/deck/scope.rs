//! Contents of a deck by scope: a part, an instance of one, or all that is in neither.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use dovetail_numerics::space::{cross, dot, sub};

use super::super::source::LinePosition;
use super::types::DeckElementKind;
use crate::MeshError;

/// Key by which names are compared: Abaqus and CalculiX ignore the case of the letters A to Z.
pub(super) fn key(name: &str) -> String {
    name.to_ascii_uppercase()
}

#[derive(Debug, Clone)]
pub(super) struct DeckElement {
    pub label: u64,
    pub kind: DeckElementKind,
    /// Index of its first node in [`Scope::element_nodes`].
    pub first: usize,
    /// Place of its keyword line.
    pub place: LinePosition,
}

/// Members of a set that one keyword line gives.
#[derive(Debug, Clone, Default)]
pub(super) struct SetMembers {
    pub place: LinePosition,
    /// Instance that the nodes or elements belong to, if the line names one.
    pub instance: Option<String>,
    pub labels: Vec<u64>,
    /// First, last and step of each range.
    pub ranges: Vec<[u64; 3]>,
    /// Names of other sets.
    pub names: Vec<String>,
    /// Names of the sets whose elements' nodes are members.
    pub elements_of: Vec<String>,
}

/// A set of nodes or of elements.
#[derive(Debug, Clone, Default)]
pub(super) struct Set {
    /// Name as it was first written.
    pub name: String,
    /// True if a program wrote the set for itself: it is no group.
    pub internal: bool,
    pub blocks: Vec<SetMembers>,
}

/// Sets by their [`key`].
pub(super) type Sets = BTreeMap<String, Set>;

/// Block of the set `name` that the keyword line at `place` gives.
pub(super) fn block<'a>(
    sets: &'a mut Sets,
    name: &str,
    place: LinePosition,
    instance: Option<&str>,
) -> &'a mut SetMembers {
    let set = sets.entry(key(name)).or_default();
    if set.name.is_empty() {
        name.clone_into(&mut set.name);
    }
    let fits = |block: &SetMembers| block.place == place && block.instance.as_deref() == instance;
    if !set.blocks.last().is_some_and(fits) {
        set.blocks.push(SetMembers {
            place,
            instance: instance.map(str::to_owned),
            ..SetMembers::default()
        });
    }
    let last = set.blocks.len() - 1;
    &mut set.blocks[last]
}

/// One data line of a surface.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct SurfaceLine {
    /// Element, node or set, perhaps preceded by the name of an instance and a dot.
    pub target: String,
    /// Label of a face.
    pub face: Option<String>,
}

/// Kind of a surface. CalculiX keeps surfaces of one name and different kinds apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum SurfaceOf {
    Faces,
    Nodes,
}

#[derive(Debug, Clone, Default)]
pub(super) struct DeckSurface {
    pub name: String,
    pub internal: bool,
    pub place: LinePosition,
    pub lines: Vec<SurfaceLine>,
    /// Keys of the surfaces of the same kind whose lines belong to this one.
    pub united: BTreeSet<String>,
}

#[derive(Debug, Clone)]
pub(super) struct DeckSection {
    pub set: String,
    pub material: String,
    pub place: LinePosition,
}

/// Translation, then a rotation about a line.
#[derive(Debug, Clone, Default)]
pub(super) struct InstancePlacement {
    pub shift: [f64; 3],
    pub turn: Option<InstanceTurn>,
}

#[derive(Debug, Clone)]
pub(super) struct InstanceTurn {
    /// Point of the line.
    pub point: [f64; 3],
    /// Direction of unit length; the rotation follows the right-hand rule.
    pub direction: [f64; 3],
    pub angle_rad: f64,
}

impl InstancePlacement {
    /// Position in the assembly of a node of the part.
    pub fn apply(&self, at: [f64; 3]) -> [f64; 3] {
        let shifted = [0, 1, 2].map(|i| at[i] + self.shift[i]);
        let Some(turn) = &self.turn else {
            return shifted;
        };
        // Rodrigues' formula.
        let n = turn.direction;
        let r = sub(shifted, turn.point);
        let (sine, cosine) = turn.angle_rad.sin_cos();
        let (across, along) = (cross(n, r), dot(n, r));
        [0, 1, 2].map(|i| {
            turn.point[i] + cosine * r[i] + sine * across[i] + (1.0 - cosine) * along * n[i]
        })
    }
}

/// Nodes, elements, sets and surfaces with labels and names of their own.
#[derive(Debug, Clone, Default)]
pub(super) struct Scope {
    /// Name of a part or an instance; empty for the root.
    pub name: String,
    /// Name of the part of an instance.
    pub part: String,
    pub placement: InstancePlacement,
    pub nodes: Vec<[f64; 3]>,
    pub node_labels: Vec<u64>,
    pub node_index: HashMap<u64, u32>,
    pub elements: Vec<DeckElement>,
    pub element_index: HashMap<u64, u32>,
    /// Labels of the nodes of the elements.
    pub element_nodes: Vec<u64>,
    /// Labels of the nodes of elements without a shape, such as masses and springs.
    pub aside_nodes: Vec<u64>,
    pub nsets: Sets,
    pub elsets: Sets,
    /// Surfaces by the [`key`] of their name and by their kind.
    pub surfaces: BTreeMap<(String, SurfaceOf), DeckSurface>,
    pub sections: Vec<DeckSection>,
}

impl Scope {
    /// Sets of elements, or those of nodes.
    pub fn sets(&mut self, of_elements: bool) -> &mut Sets {
        if of_elements {
            &mut self.elsets
        } else {
            &mut self.nsets
        }
    }

    /// The surface of a name and kind, made by the keyword line at `place` if it is new.
    pub fn surface(&mut self, name: &str, of: SurfaceOf, place: LinePosition) -> &mut DeckSurface {
        let new = || DeckSurface {
            name: name.to_owned(),
            place,
            ..DeckSurface::default()
        };
        let surface = self.surfaces.entry((key(name), of));
        surface.or_insert_with(new)
    }

    /// Returns `true` if there is a surface of this kind with a name, given as its key.
    pub fn has_surface(&self, key: &str, of: SurfaceOf) -> bool {
        self.surfaces.contains_key(&(key.to_owned(), of))
    }

    /// Lines of a surface, including those of the surfaces that it unites, each once.
    pub fn lines_of<'s>(&'s self, surface: &'s DeckSurface, of: SurfaceOf) -> Vec<&'s SurfaceLine> {
        if surface.united.is_empty() {
            return surface.lines.iter().collect();
        }
        let mut lines: BTreeSet<&SurfaceLine> = surface.lines.iter().collect();
        let mut seen = BTreeSet::new();
        let mut left: Vec<&String> = surface.united.iter().collect();
        while let Some(name) = left.pop() {
            if seen.insert(name)
                && let Some(other) = self.surfaces.get(&(name.clone(), of))
            {
                lines.extend(&other.lines);
                left.extend(&other.united);
            }
        }
        lines.into_iter().collect()
    }

    /// Adds a node, or moves the one that has this label already. Returns `true` if it has moved.
    pub fn push_node(&mut self, label: u64, at: [f64; 3]) -> bool {
        let index = self.nodes.len() as u32;
        if let Some(known) = self.node_index.get(&label) {
            return std::mem::replace(&mut self.nodes[*known as usize], at) != at;
        }
        self.node_index.insert(label, index);
        self.nodes.push(at);
        self.node_labels.push(label);
        false
    }

    /// Adds an element.
    ///
    /// # Errors
    /// Its label exists already.
    pub fn push_element(
        &mut self,
        label: u64,
        kind: DeckElementKind,
        nodes: &[u64],
        place: LinePosition,
    ) -> Result<(), MeshError> {
        let index = self.elements.len() as u32;
        if self.element_index.insert(label, index).is_some() {
            return Err(MeshError::ElementTwice { label });
        }
        self.elements.push(DeckElement {
            label,
            kind,
            first: self.element_nodes.len(),
            place,
        });
        self.element_nodes.extend(nodes);
        Ok(())
    }

    /// Returns `true` if it has nothing at all.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
            && self.elements.is_empty()
            && self.nsets.is_empty()
            && self.elsets.is_empty()
            && self.surfaces.is_empty()
            && self.sections.is_empty()
    }

    /// Adds all that another scope has.
    ///
    /// # Errors
    /// An element of it has a label that exists already.
    pub fn merge(&mut self, other: Self) -> Result<(), MeshError> {
        for (label, at) in other.node_labels.iter().zip(&other.nodes) {
            self.push_node(*label, *at);
        }
        for element in &other.elements {
            let nodes = other.nodes_of(element);
            self.push_element(element.label, element.kind, nodes, element.place)?;
        }
        for (own, added) in [
            (&mut self.nsets, other.nsets),
            (&mut self.elsets, other.elsets),
        ] {
            for (key, set) in added {
                let known = own.entry(key).or_insert_with(|| Set {
                    name: set.name,
                    internal: true,
                    blocks: Vec::new(),
                });
                known.internal &= set.internal;
                known.blocks.extend(set.blocks);
            }
        }
        for (key, surface) in other.surfaces {
            let known = self.surfaces.entry(key).or_default();
            let (lines, united) = (
                std::mem::take(&mut known.lines),
                std::mem::take(&mut known.united),
            );
            *known = surface;
            known.lines.extend(lines);
            known.united.extend(united);
        }
        self.sections.extend(other.sections);
        self.aside_nodes.extend(other.aside_nodes);
        Ok(())
    }

    /// Labels of the nodes of an element.
    pub fn nodes_of(&self, element: &DeckElement) -> &[u64] {
        let count = element.kind.nodes().unwrap_or(0);
        &self.element_nodes[element.first..element.first + count]
    }
}
