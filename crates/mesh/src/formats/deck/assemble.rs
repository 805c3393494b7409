//! Conversion of a [`Deck`] to its [`Content`]: solids, facets and groups.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

use super::super::content::{Content, FileMaterial};
use super::lines::Files;
use super::read::Deck;
use super::resolve::{Model, What, named};
use super::scope::{Surface, SurfaceLine, key};
use super::types::Kind;
use crate::element::{Connectivity, facet_corners};
use crate::text;
use crate::{Group, MeshError};

/// Position of an element of the deck in the content.
#[derive(Debug, Clone, Copy, PartialEq)]
enum At {
    Solid(u32),
    Facet(u32),
    Line,
    Aside,
}

/// Origin of a group. Of groups with one name the first in this order keeps it, and the others get
/// their [`Origin::suffix`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Origin {
    Instance,
    Solids,
    Surface,
    Shells,
    Lines,
    NodeSet,
    NodeSurface,
}

impl Origin {
    fn suffix(self) -> &'static str {
        match self {
            Self::Instance => " (instance)",
            Self::Solids => " (elements)",
            Self::Surface => " (surface)",
            Self::Shells => " (shells)",
            Self::Lines => " (lines)",
            Self::NodeSet => " (nodes)",
            Self::NodeSurface => " (node surface)",
        }
    }
}

/// Makes the content of a deck.
///
/// # Errors
/// Sets, surfaces and sections that name what is not there.
pub(super) fn assemble(deck: &Deck, files: &Files) -> Result<Content, MeshError> {
    let mut assembly = Assembly {
        model: Model::new(deck, files)?,
        content: Content {
            remarks: deck.remarks.clone(),
            ..Content::default()
        },
        places: Vec::new(),
        found: BTreeMap::new(),
        face_counts: None,
    };
    assembly.nodes();
    assembly.elements();
    assembly.groups()?;
    assembly.materials(deck)?;
    if !deck.instances.is_empty() {
        assembly.parts_without_instances(deck);
    }
    assembly.finish()
}

/// Name as it is shown, and groups by their origin.
type Found = (String, BTreeMap<Origin, Group>);

struct Assembly<'a> {
    model: Model<'a>,
    content: Content,
    /// Position of each element of the model.
    places: Vec<At>,
    /// Groups by the key of their names.
    found: BTreeMap<String, Found>,
    /// Number of solids that have a face with these corners, ascending.
    face_counts: Option<Rc<HashMap<[u32; 4], u32>>>,
}

impl Assembly<'_> {
    fn nodes(&mut self) {
        for (scope, _) in self.model.scopes() {
            let placed = scope.nodes.iter().map(|at| scope.placement.apply(*at));
            self.content.nodes.extend(placed);
            self.content.node_tags.extend(&scope.node_labels);
        }
    }

    fn elements(&mut self) {
        let kinds: Vec<Kind> = self
            .model
            .scopes()
            .flat_map(|(scope, _)| scope.elements.iter().map(|e| e.kind))
            .collect();
        let tags = self.model.elements.tags();
        for ((nodes, kind), tag) in self.model.elements.iter().zip(&kinds).zip(tags) {
            let add = |list: &mut Connectivity| {
                list.push(*tag, nodes.iter().copied());
                list.len() as u32 - 1
            };
            self.places.push(match kind {
                Kind::Solid(_) => At::Solid(add(&mut self.content.elements)),
                Kind::Facet(_) => At::Facet(add(&mut self.content.facets)),
                Kind::Line(_) => At::Line,
                Kind::Aside => At::Aside,
            });
        }
    }

    /// Names that more than one scope gives to sets, surfaces or (the root) to instances.
    fn shared_names(&self) -> BTreeMap<String, BTreeSet<usize>> {
        let mut scopes_of: BTreeMap<String, BTreeSet<usize>> = BTreeMap::new();
        for (number, (scope, _)) in self.model.scopes().enumerate() {
            let sets = scope.nsets.iter().chain(&scope.elsets);
            let sets = sets
                .filter(|(_, set)| !set.internal)
                .map(|(key, _)| key.clone());
            let surfaces = scope
                .surfaces
                .iter()
                .filter(|(_, surface)| !surface.internal);
            for name in sets.chain(surfaces.map(|(key, _)| key.clone())) {
                scopes_of.entry(name).or_default().insert(number);
            }
            if number > 0 {
                scopes_of.entry(key(&scope.name)).or_default().insert(0);
            }
        }
        scopes_of
    }

    fn groups(&mut self) -> Result<(), MeshError> {
        let shared = self.shared_names();
        let scopes: Vec<_> = self.model.scopes().collect();
        for (number, (scope, first_element)) in scopes.into_iter().enumerate() {
            let shown = |name: &str| match &shared[&key(name)] {
                scopes if number > 0 && scopes.len() > 1 => format!("{}.{name}", scope.name),
                _ => name.to_owned(),
            };
            if number > 0 {
                let all = first_element..first_element + scope.elements.len() as u32;
                let all: Vec<u32> = all.collect();
                self.element_groups(&scope.name, &all, Origin::Instance);
            }
            for set in scope.elsets.values().filter(|set| !set.internal) {
                let elements = self.model.set(What::Elements, number, &set.name)?;
                self.element_groups(&shown(&set.name), &elements, Origin::Solids);
            }
            for surface in scope.surfaces.values().filter(|surface| !surface.internal) {
                let result = if surface.of_nodes {
                    self.node_surface(&shown(&surface.name), number, surface)
                } else {
                    self.surface(&shown(&surface.name), number, surface)
                };
                let error = |e| {
                    self.model
                        .at(surface.place, "*SURFACE", named(e, &surface.name))
                };
                result.map_err(error)?;
            }
            for set in scope.nsets.values().filter(|set| !set.internal) {
                let nodes = self.model.set(What::Nodes, number, &set.name)?;
                self.node_group(&shown(&set.name), &nodes, Origin::NodeSet);
            }
        }
        Ok(())
    }

    fn keep(&mut self, name: &str, origin: Origin, group: Group) {
        let found = self
            .found
            .entry(key(name))
            .or_insert_with(|| (name.to_owned(), BTreeMap::new()));
        found.1.insert(origin, group);
    }

    /// Groups of solids, of facets and of lines.
    fn element_groups(&mut self, name: &str, elements: &[u32], solids: Origin) {
        let mut groups = [
            (solids, Group::empty(3)),
            (Origin::Shells, Group::empty(2)),
            (Origin::Lines, Group::empty(1)),
        ];
        for element in elements {
            let (slot, index) = match self.places[*element as usize] {
                At::Solid(index) => (0, Some(index)),
                At::Facet(index) => (1, Some(index)),
                At::Line => (2, None),
                At::Aside => continue,
            };
            let (_, group) = &mut groups[slot];
            group.elements.extend(index);
            let nodes = self.model.elements.of(*element as usize);
            group.nodes.extend(nodes);
        }
        for (origin, group) in groups {
            let of_instance = solids == Origin::Instance && origin != solids;
            if !group.nodes.is_empty() && !of_instance {
                self.keep(name, origin, group);
            }
        }
    }

    fn node_group(&mut self, name: &str, nodes: &[u32], origin: Origin) {
        let mut group = Group::empty(0);
        group.nodes.extend(nodes);
        self.keep(name, origin, group);
    }

    fn node_surface(
        &mut self,
        name: &str,
        scope: usize,
        surface: &Surface,
    ) -> Result<(), MeshError> {
        let mut nodes = Vec::new();
        for line in &surface.lines {
            nodes.extend(self.model.target(What::Nodes, scope, &line.target)?.iter());
        }
        self.node_group(name, &nodes, Origin::NodeSurface);
        Ok(())
    }

    fn surface(&mut self, name: &str, scope: usize, surface: &Surface) -> Result<(), MeshError> {
        let mut faces = BTreeSet::new();
        let mut group = Group::empty(2);
        let mut edges = 0;
        for line in &surface.lines {
            let elements = self.model.target(What::Elements, scope, &line.target)?;
            for element in elements.iter() {
                match self.places[*element as usize] {
                    At::Solid(index) => self.faces(index, line, &mut faces)?,
                    At::Facet(index) => match line.face.as_deref() {
                        None | Some("SPOS") => group.elements.push(index),
                        Some("SNEG") => group.elements.push(self.turned(index)),
                        Some(_) => edges += 1,
                    },
                    At::Line | At::Aside => edges += 1,
                }
            }
        }
        for (solid, face) in faces {
            let (element, nodes) = self.content.elements.solid(solid as usize);
            let nodes = element.face_of(face, nodes);
            let tag = self.content.elements.tags()[solid as usize];
            group.elements.push(self.content.facets.len() as u32);
            self.content.facets.push(tag, nodes);
        }
        for facet in &group.elements {
            group.nodes.extend(self.content.facets.of(*facet as usize));
        }
        if edges > 0 {
            self.content.remarks.push(format!(
                "Of the surface `{name}`, {edges} edges of shells or faces of other elements that are not read were left aside."
            ));
        }
        if !group.elements.is_empty() {
            self.keep(name, Origin::Surface, group);
        }
        Ok(())
    }

    /// Adds a facet that faces the other way and returns its number.
    fn turned(&mut self, facet: u32) -> u32 {
        let nodes = self.content.facets.of(facet as usize);
        let (corners, middles) = nodes.split_at(facet_corners(nodes.len()));
        let reversed = corners[..1].iter().chain(corners[1..].iter().rev());
        let reversed: Vec<u32> = reversed.chain(middles.iter().rev()).copied().collect();
        let tag = self.content.facets.tags()[facet as usize];
        self.content.facets.push(tag, reversed);
        self.content.facets.len() as u32 - 1
    }

    /// Adds the faces of a solid that a line of a surface refers to: the one that it names, or all
    /// that no other solid has.
    fn faces(
        &mut self,
        solid: u32,
        line: &SurfaceLine,
        out: &mut BTreeSet<(u32, usize)>,
    ) -> Result<(), MeshError> {
        let Some(label) = &line.face else {
            let counts = self.face_counts();
            let (element, nodes) = self.content.elements.solid(solid as usize);
            let exposed = element.sorted_faces(nodes).filter(|(_, f)| counts[f] == 1);
            out.extend(exposed.map(|(f, _)| (solid, f)));
            return Ok(());
        };
        let (element, _) = self.content.elements.solid(solid as usize);
        let faces = element.shape.faces();
        let number = label
            .strip_prefix(['S', 'P'])
            .and_then(|n| n.parse::<usize>().ok());
        match number {
            Some(face) if (1..=faces.len()).contains(&face) => {
                out.insert((solid, face - 1));
                Ok(())
            }
            _ => Err(MeshError::FaceLabel {
                found: label.clone(),
                element: self.content.elements.tags()[solid as usize],
                what: element.shape.plural(),
                faces: faces.len(),
            }),
        }
    }

    fn face_counts(&mut self) -> Rc<HashMap<[u32; 4], u32>> {
        let elements = &self.content.elements;
        let counts = self.face_counts.get_or_insert_with(|| {
            let mut counts = HashMap::new();
            for (element, nodes) in elements.solids() {
                for (_, corners) in element.sorted_faces(nodes) {
                    *counts.entry(corners).or_insert(0) += 1;
                }
            }
            Rc::new(counts)
        });
        counts.clone()
    }

    fn materials(&mut self, deck: &Deck) -> Result<(), MeshError> {
        let mut owner: Vec<Option<usize>> = vec![None; self.content.elements.len()];
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        let scopes: Vec<_> = self.model.scopes().collect();
        for (number, (scope, _)) in scopes.into_iter().enumerate() {
            for section in &scope.sections {
                let result = self.model.set(What::Elements, number, &section.set);
                let error = |e| self.model.at(section.place, "*SOLID SECTION", e);
                let elements = result.map_err(error)?;
                let (all, name) = (deck.materials.iter(), &section.material);
                let Some(known) = all.clone().find(|m| key(&m.name) == key(name)) else {
                    let names = all.map(|m| &m.name);
                    return Err(error(MeshError::no_such_name("material", name, names)));
                };
                let materials = &mut self.content.materials;
                let place = *places.entry(key(&section.material)).or_insert_with(|| {
                    materials.push(FileMaterial {
                        name: known.name.clone(),
                        young: known.young,
                        poisson: known.poisson,
                        density: known.density,
                        elements: Vec::new(),
                    });
                    materials.len() - 1
                });
                for element in elements.iter() {
                    let At::Solid(index) = self.places[*element as usize] else {
                        continue;
                    };
                    match owner[index as usize].replace(place) {
                        Some(other) if other != place => {
                            let tag = self.content.elements.tags()[index as usize];
                            return Err(error(MeshError::TwoMaterials {
                                element: tag,
                                first: self.content.materials[other].name.clone(),
                                second: known.name.clone(),
                            }));
                        }
                        Some(_) => {}
                        None => self.content.materials[place].elements.push(index),
                    }
                }
            }
        }
        for material in &mut self.content.materials {
            material.elements.sort_unstable();
        }
        Ok(())
    }

    fn parts_without_instances(&mut self, deck: &Deck) {
        let used: BTreeSet<_> = deck.instances.iter().map(|i| i.part.as_str()).collect();
        let unused = deck.parts.iter().map(|p| p.name.as_str());
        let unused: Vec<&str> = unused.filter(|name| !used.contains(name)).collect();
        if !unused.is_empty() {
            self.content.remarks.push(format!(
                "These parts have no instance and were left aside: {}.",
                text::list(&unused)
            ));
        }
    }

    fn finish(mut self) -> Result<Content, MeshError> {
        if !self.model.fewer.is_empty() {
            let sets = text::list(&self.model.fewer);
            self.content.remarks.push(format!(
                "Not all numbers that these sets generate are there: {sets}."
            ));
        }
        for (name, origins) in std::mem::take(&mut self.found).into_values() {
            for (place, (origin, group)) in origins.into_iter().enumerate() {
                let name = match place {
                    0 => name.clone(),
                    _ => format!("{name}{}", origin.suffix()),
                };
                self.content.add_group(name, group)?;
            }
        }
        self.content.name_all_solids();
        self.content.keep_what_solids_have()?;
        Ok(self.content)
    }
}
