//! Conversion of a [`Deck`] to its [`Content`]: solids, facets and groups.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

use super::super::collapse;
use super::super::content::{Content, FileMaterial};
use super::super::named_groups::{NamedGroups, Origin};
use super::super::source::SourceFiles;

use super::read::{Deck, DeckMaterial};
use super::resolve::{DeckModel, What, omitted_count_text};
use super::scope::{DeckSection, DeckSurface, SurfaceLine, SurfaceOf, key};
use super::types::{self, DeckElementKind};
use crate::element::{ElementType, facet_corners, sorted_corners};
use crate::text;
use crate::{Group, MeshError};

/// Position of an element of the deck in the content.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ElementPosition {
    Solid(u32),
    Facet(u32),
    Line,
    Aside,
}

/// Makes the content of a deck.
///
/// # Errors
/// Sets, surfaces and sections that name what is not there.
pub(super) fn assemble(deck: &Deck, files: &SourceFiles) -> Result<Content, MeshError> {
    let mut assembly = ContentBuilder {
        model: DeckModel::new(deck, files)?,
        content: Content {
            remarks: deck.remarks.clone(),
            ..Content::default()
        },
        places: Vec::new(),
        collapsed: HashMap::new(),
        found: NamedGroups::default(),
        face_counts: None,
    };
    assembly.nodes();
    assembly.elements()?;
    assembly.groups()?;
    assembly.materials(deck)?;
    if !deck.instances.is_empty() {
        assembly.parts_without_instances(deck);
    }
    assembly.finish(deck)
}

struct ContentBuilder<'a> {
    model: DeckModel<'a>,
    content: Content,
    /// Position of each element of the model.
    places: Vec<ElementPosition>,
    /// Nodes in the deck of solids that name a node more than once, by their position.
    collapsed: HashMap<u32, Vec<u32>>,
    found: NamedGroups,
    /// Number of solids that have a face with these corners, ascending.
    face_counts: Option<Rc<HashMap<[u32; 4], u32>>>,
}

impl ContentBuilder<'_> {
    fn nodes(&mut self) {
        for (scope, _) in self.model.scopes() {
            let placed = scope.nodes.iter().map(|at| scope.placement.apply(*at));
            self.content.nodes.extend(placed);
            self.content.node_tags.extend(&scope.node_labels);
            let first = self.content.nodes.len() - scope.nodes.len();
            let aside = scope.aside_nodes.iter();
            let aside = aside.filter_map(|label| scope.node_index.get(label));
            let aside = aside.map(|index| first as u32 + index);
            self.content.other_nodes.extend(aside);
        }
    }

    fn elements(&mut self) -> Result<(), MeshError> {
        let scopes = self.model.scopes();
        let elements = scopes.flat_map(|(scope, _)| &scope.elements);
        for (nodes, element) in self.model.elements.iter().zip(elements) {
            let tag = element.label;
            let at = |error| self.model.locate_error(element.place, "*ELEMENT", error);
            let content = &mut self.content;
            self.places.push(match element.kind {
                DeckElementKind::Solid(_) => {
                    let index = content.elements.len() as u32;
                    let kept = collapse::solid(tag, nodes, &content.node_tags).map_err(at)?;
                    if kept.len() < nodes.len() {
                        self.collapsed.insert(index, nodes.to_vec());
                    }
                    content.elements.push(tag, kept.iter().copied());
                    ElementPosition::Solid(index)
                }
                DeckElementKind::Facet(_) => {
                    let index = content.facets.len() as u32;
                    let kept = collapse::facet(tag, nodes, &content.node_tags).map_err(at)?;
                    content.facets.push(tag, kept.iter().copied());
                    ElementPosition::Facet(index)
                }
                DeckElementKind::Line(_) => {
                    content.other_nodes.extend(nodes);
                    ElementPosition::Line
                }
                DeckElementKind::Aside => ElementPosition::Aside,
            });
        }
        Ok(())
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
            for name in sets.chain(surfaces.map(|((key, _), _)| key.clone())) {
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
                let range = first_element..first_element + scope.elements.len() as u32;
                let elements: Vec<u32> = range.collect();
                self.element_groups(&scope.name, &elements, Origin::Instance);
            }
            for set in scope.elsets.values().filter(|set| !set.internal) {
                let elements = self.model.set(What::Elements, number, &set.name)?;
                self.element_groups(&shown(&set.name), &elements, Origin::Solids);
            }
            for ((_, of), surface) in scope.surfaces.iter().filter(|(_, s)| !s.internal) {
                let name = shown(&surface.name);
                let lines = scope.lines_of(surface, *of);
                let result = match of {
                    SurfaceOf::Nodes => self.node_surface(&name, number, surface, &lines),
                    SurfaceOf::Faces => self.surface(&name, number, surface, &lines),
                };
                result.map_err(|e| self.model.locate_error(surface.place, "*SURFACE", e))?;
            }
            for set in scope.nsets.values().filter(|set| !set.internal) {
                let nodes = self.model.set(What::Nodes, number, &set.name)?;
                self.node_group(&shown(&set.name), &nodes, Origin::NodeSet);
            }
        }
        Ok(())
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
                ElementPosition::Solid(index) => (0, Some(index)),
                ElementPosition::Facet(index) => (1, Some(index)),
                ElementPosition::Line => (2, None),
                ElementPosition::Aside => continue,
            };
            let (_, group) = &mut groups[slot];
            group.elements.extend(index);
            let nodes = self.model.elements.element_nodes(*element as usize);
            group.nodes.extend(nodes);
        }
        for (origin, group) in groups {
            let of_instance = solids == Origin::Instance && origin != solids;
            if !group.nodes.is_empty() && !of_instance {
                self.found.keep(name, origin, group);
            }
        }
    }

    fn node_group(&mut self, name: &str, nodes: &[u32], origin: Origin) {
        let mut group = Group::empty(0);
        group.nodes.extend(nodes);
        self.found.keep(name, origin, group);
    }

    fn node_surface(
        &mut self,
        name: &str,
        scope: usize,
        surface: &DeckSurface,
        lines: &[&SurfaceLine],
    ) -> Result<(), MeshError> {
        let mut nodes = Vec::new();
        for line in lines {
            let target = self
                .model
                .target(What::Nodes, scope, &line.target, surface)?;
            nodes.extend(target.iter());
        }
        self.node_group(name, &nodes, Origin::NodeSurface);
        Ok(())
    }

    fn surface(
        &mut self,
        name: &str,
        scope: usize,
        surface: &DeckSurface,
        lines: &[&SurfaceLine],
    ) -> Result<(), MeshError> {
        let mut faces = BTreeSet::new();
        let mut group = Group::empty(2);
        let mut edges = 0;
        for line in lines {
            let target = &line.target;
            let elements = self.model.target(What::Elements, scope, target, surface)?;
            for element in elements.iter() {
                match self.places[*element as usize] {
                    ElementPosition::Solid(index) => self.faces(index, line, &mut faces)?,
                    ElementPosition::Facet(index) => match line.face.as_deref() {
                        None | Some("SPOS") => group.elements.push(index),
                        Some("SNEG") => group.elements.push(self.add_flipped_facet(index)),
                        Some(_) => edges += 1,
                    },
                    ElementPosition::Line | ElementPosition::Aside => edges += 1,
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
            group
                .nodes
                .extend(self.content.facets.element_nodes(*facet as usize));
        }
        if edges > 0 {
            self.content.remarks.push(format!(
                "Of the surface `{name}`, {edges} edges of shells or faces of other elements that are not read were left aside."
            ));
        }
        if !group.elements.is_empty() {
            self.found.keep(name, Origin::Surface, group);
        }
        Ok(())
    }

    /// Adds a facet that faces the other way and returns its number.
    fn add_flipped_facet(&mut self, facet: u32) -> u32 {
        let nodes = self.content.facets.element_nodes(facet as usize);
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
        let (element, nodes) = self.content.elements.solid(solid as usize);
        let in_deck = self.collapsed.get(&solid);
        let of_deck = in_deck.and_then(|nodes| ElementType::from_node_count(nodes.len()));
        let faces = of_deck.unwrap_or(element).shape.faces();
        let number = label
            .strip_prefix(['S', 'P'])
            .and_then(|n| n.parse::<usize>().ok());
        match (number, in_deck) {
            (Some(face), None) if (1..=faces.len()).contains(&face) => {
                out.insert((solid, face - 1));
                Ok(())
            }
            (Some(face), Some(in_deck)) if (1..=faces.len()).contains(&face) => {
                let mut corners: Vec<u32> = faces[face - 1].iter().map(|i| in_deck[*i]).collect();
                corners.sort_unstable();
                corners.dedup();
                // A face that has shrunk to an edge or a point is left out.
                let wanted = sorted_corners(&corners);
                let face = element.sorted_faces(nodes).find(|(_, f)| *f == wanted);
                out.extend(face.map(|(f, _)| (solid, f)));
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

    /// Section of each solid. The last section of an element counts, as in CalculiX.
    fn sections(&mut self, deck: &Deck) -> Result<Vec<Option<&DeckSection>>, MeshError> {
        let mut section_of: Vec<Option<&DeckSection>> = vec![None; self.content.elements.len()];
        let (mut changed, mut unknown) = (Vec::new(), Vec::new());
        let scopes: Vec<_> = self.model.scopes().collect();
        let sections = scopes.into_iter().enumerate();
        let sections =
            sections.flat_map(|(n, (scope, _))| scope.sections.iter().map(move |s| (n, s)));
        for (number, section) in sections {
            let result = self.model.set(What::Elements, number, &section.set);
            let elements =
                result.map_err(|e| self.model.locate_error(section.place, "*SOLID SECTION", e))?;
            let shown = |s: &DeckSection| {
                format!(
                    "`{}` ({})",
                    s.material,
                    self.model.message_position(s.place)
                )
            };
            if deck.material(&section.material).is_none() {
                unknown.push(shown(section));
            }
            let mut others = Vec::new();
            for element in elements.iter() {
                let ElementPosition::Solid(index) = self.places[*element as usize] else {
                    continue;
                };
                let before = section_of[index as usize].replace(section);
                let other = before.filter(|b| key(&b.material) != key(&section.material));
                others.extend(other.map(|other| (index, other)));
            }
            if let Some((index, other)) = others.first() {
                let tag = self.content.elements.tags()[*index as usize];
                let more = omitted_count_text(others.len() - 1);
                changed.push(format!(
                    "{tag}{more} from {} to {}",
                    shown(other),
                    shown(section)
                ));
            }
        }
        self.remark(
            "Sections give these elements another material than sections before them, and the last \
             one counts",
            &changed,
            "",
        );
        self.remark(
            "Sections name these materials, which are not in the deck",
            &unknown,
            " Give the bodies young_pa, poisson and density_kg_m3, or add the materials.",
        );
        Ok(section_of)
    }

    /// Gives materials to the elements of sections.
    fn materials(&mut self, deck: &Deck) -> Result<(), MeshError> {
        let names: Vec<Option<String>> = self
            .sections(deck)?
            .into_iter()
            .map(|section| section.map(|s| s.material.clone()))
            .collect();
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        let materials = &mut self.content.materials;
        for (name, index) in names.into_iter().zip(0..) {
            let Some(name) = name else {
                continue;
            };
            let place = *places.entry(key(&name)).or_insert_with(|| {
                let known = deck.material(&name).cloned();
                let known = known.unwrap_or_else(|| DeckMaterial {
                    name,
                    ..DeckMaterial::default()
                });
                materials.push(FileMaterial {
                    name: known.name,
                    young: known.young,
                    poisson: known.poisson,
                    density: known.density,
                    elements: Vec::new(),
                });
                materials.len() - 1
            });
            materials[place].elements.push(index);
        }
        Ok(())
    }

    /// Adds a remark on the items of a list, if there are any.
    fn remark(&mut self, sentence: &str, list: &[String], hint: &str) {
        if !list.is_empty() {
            let list = text::list(list);
            let remark = format!("{sentence}: {list}.{hint}");
            self.content.remarks.push(remark);
        }
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

    fn finish(mut self, deck: &Deck) -> Result<Content, MeshError> {
        if self.content.elements.is_empty() && self.content.facets.is_empty() {
            let kinds = &deck.other_types;
            if !kinds.is_empty() {
                let (kinds, read) = (text::list(kinds), types::READ);
                return Err(MeshError::NothingRead { kinds, read });
            }
        }
        let missing_elements = self
            .model
            .missing
            .iter()
            .any(|set| set.contains(": element "));
        let pyramids = match missing_elements {
            true => " A deck that gmsh wrote lacks its pyramids: write MSH.",
            false => "",
        };
        let [fewer, missing, no_instances] = [
            &mut self.model.fewer,
            &mut self.model.missing,
            &mut self.model.no_instances,
        ]
        .map(std::mem::take);
        self.remark(
            "Not all numbers that these sets generate are there",
            &fewer,
            "",
        );
        self.remark(
            "Numbers that are not there were left out of these sets",
            &missing,
            pyramids,
        );
        self.remark(
            "The deck has no instances, but these sets name one",
            &no_instances,
            " Their numbers are looked up in the whole deck.",
        );
        self.found.move_to(&mut self.content)?;
        self.content.name_all();
        self.content.drop_unused()?;
        Ok(self.content)
    }
}
