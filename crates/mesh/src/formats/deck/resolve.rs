//! Resolution of names and labels to numbers: the nodes and elements of all scopes in one list, and
//! their sets.

use std::collections::HashMap;
use std::rc::Rc;

use super::super::source::{LinePosition, SourceFiles};
use super::read::Deck;
use super::scope::{DeckSurface, Scope, SetMembers, Sets, key};
use crate::MeshError;
use crate::element::Connectivity;
use crate::sort_once;

/// Most sets inside one another.
const DEEPEST: usize = 200;

/// Labels with the indices that they refer to, by label.
type ByLabel = Rc<Vec<(u64, u32)>>;

/// Scope, with the first of its nodes and elements in the lists of all.
struct Placed<'a> {
    scope: &'a Scope,
    first_node: u32,
    first_element: u32,
    /// Labels of nodes and of elements; made when a range asks for them.
    by_label: [Option<ByLabel>; 2],
}

impl<'a> Placed<'a> {
    /// Numbers of the nodes or elements in the scope by their labels, and that of the first in the
    /// list of all.
    fn numbers(&self, what: What) -> (&'a HashMap<u64, u32>, u32) {
        match what {
            What::Nodes => (&self.scope.node_index, self.first_node),
            What::Elements => (&self.scope.element_index, self.first_element),
        }
    }
}

/// Nodes or elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum What {
    Nodes,
    Elements,
}

impl What {
    fn one(self) -> &'static str {
        match self {
            Self::Nodes => "node",
            Self::Elements => "element",
        }
    }

    fn keyword(self) -> &'static str {
        match self {
            Self::Nodes => "*NSET",
            Self::Elements => "*ELSET",
        }
    }
}

/// Kind of a set, number of its scope, its key.
type SetKey = (What, usize, String);

/// All scopes, the root first.
pub(super) struct DeckModel<'a> {
    scopes: Vec<Placed<'a>>,
    /// Numbers of the scopes by the keys of their names.
    instances: HashMap<String, usize>,
    /// Nodes of each element of all scopes.
    pub elements: Connectivity,
    /// Sets that are resolved; `None` while one is being resolved.
    sets: HashMap<SetKey, Option<Rc<Vec<u32>>>>,
    files: &'a SourceFiles,
    /// Sets that are generated from numbers that do not all exist, with their places.
    pub fewer: Vec<String>,
    /// Sets and surfaces that name numbers that do not exist, with their places.
    pub missing: Vec<String>,
    /// Instances that a deck without instances names, with their places.
    pub no_instances: Vec<String>,
}

impl<'a> DeckModel<'a> {
    /// Places the scopes one after the other.
    ///
    /// # Errors
    /// An element names a node that does not exist.
    pub fn new(deck: &'a Deck, files: &'a SourceFiles) -> Result<Self, MeshError> {
        let instances = if deck.instances.is_empty() {
            &deck.parts
        } else {
            &deck.instances
        };
        let mut model = Self {
            scopes: Vec::new(),
            instances: HashMap::new(),
            elements: Connectivity::default(),
            sets: HashMap::new(),
            files,
            fewer: Vec::new(),
            missing: Vec::new(),
            no_instances: Vec::new(),
        };
        let mut first_node = 0;
        for scope in std::iter::once(&deck.root).chain(instances) {
            if !scope.name.is_empty() {
                let number = model.scopes.len();
                model.instances.entry(key(&scope.name)).or_insert(number);
            }
            model.scopes.push(Placed {
                scope,
                first_node,
                first_element: model.elements.len() as u32,
                by_label: [None, None],
            });
            for element in &scope.elements {
                let mut nodes = Vec::with_capacity(scope.nodes_of(element).len());
                for node in scope.nodes_of(element) {
                    let index = scope.node_index.get(node).ok_or_else(|| {
                        let missing = MeshError::MissingNode {
                            element: element.label,
                            node: *node,
                        };
                        files.locate_error(element.place, "*ELEMENT", missing)
                    })?;
                    nodes.push(first_node + index);
                }
                model.elements.push(element.label, nodes);
            }
            first_node += scope.nodes.len() as u32;
        }
        Ok(model)
    }

    /// All scopes, with the first element of each.
    pub fn scopes(&self) -> impl Iterator<Item = (&'a Scope, u32)> + use<'a, '_> {
        self.scopes.iter().map(|p| (p.scope, p.first_element))
    }

    /// A place in the form of a message.
    pub fn message_position(&self, place: LinePosition) -> String {
        self.files.message_position(place)
    }

    /// Adds the place to an error.
    pub fn locate_error(&self, place: LinePosition, keyword: &str, error: MeshError) -> MeshError {
        self.files.locate_error(place, keyword, error)
    }

    fn sets_of(&self, what: What, scope: usize) -> &'a Sets {
        match what {
            What::Nodes => &self.scopes[scope].scope.nsets,
            What::Elements => &self.scopes[scope].scope.elsets,
        }
    }

    /// Number of the instance `name`.
    fn instance(&self, name: &str) -> Option<usize> {
        self.instances.get(&key(name)).copied()
    }

    /// Scope and key of the set `name`, also of `instance.set`, as seen from a scope.
    fn find(&self, what: What, scope: usize, name: &str) -> Option<(usize, String)> {
        if self.sets_of(what, scope).contains_key(&key(name)) {
            return Some((scope, key(name)));
        }
        name.match_indices('.').find_map(|(dot, _)| {
            let instance = self.instance(&name[..dot]).or(self.only_scope())?;
            let rest = key(&name[dot + 1..]);
            self.sets_of(what, instance)
                .contains_key(&rest)
                .then_some((instance, rest))
        })
    }

    /// Nodes or elements of a set, ascending, each once.
    ///
    /// # Errors
    /// There is no such set, it contains what does not exist, or it contains itself.
    pub fn set(&mut self, what: What, scope: usize, name: &str) -> Result<Rc<Vec<u32>>, MeshError> {
        self.set_inside(what, scope, name, 0)
    }

    fn set_inside(
        &mut self,
        what: What,
        scope: usize,
        name: &str,
        depth: usize,
    ) -> Result<Rc<Vec<u32>>, MeshError> {
        let Some((scope, set_key)) = self.find(what, scope, name) else {
            let known = self.sets_of(what, scope).values().map(|set| &set.name);
            let what = if what == What::Nodes { "NSET" } else { "ELSET" };
            return Err(MeshError::unknown_name(what, name, known));
        };
        let set = &self.sets_of(what, scope)[&set_key];
        let in_list = (what, scope, set_key);
        if let Some(Some(found)) = self.sets.get(&in_list) {
            return Ok(found.clone());
        }
        if self.sets.insert(in_list.clone(), None).is_some() || depth > DEEPEST {
            let name = set.name.clone();
            return Err(MeshError::SetCircle { name });
        }
        let mut members = Vec::new();
        for block in &set.blocks {
            self.block(what, scope, (&set.name, block), depth, &mut members)
                .map_err(|e| self.locate_error(block.place, what.keyword(), e))?;
        }
        sort_once(&mut members);
        let shared = Rc::new(members);
        self.sets.insert(in_list, Some(shared.clone()));
        Ok(shared)
    }

    /// The only scope, of a deck that has neither parts nor instances: a part that was written flat
    /// may still name its instance.
    fn only_scope(&self) -> Option<usize> {
        (self.scopes.len() == 1).then_some(0)
    }

    /// Adds the members that one keyword line gives.
    fn block(
        &mut self,
        what: What,
        scope: usize,
        (set, block): (&str, &SetMembers),
        depth: usize,
        out: &mut Vec<u32>,
    ) -> Result<(), MeshError> {
        let place = self.files.message_position(block.place);
        let scope = match (&block.instance, self.only_scope()) {
            (Some(name), Some(only)) => {
                let unknown = format!("`{name}` ({place}, {})", what.keyword());
                self.no_instances.push(unknown);
                only
            }
            (Some(name), None) => self.instance_or_error(name)?,
            (None, _) => scope,
        };
        let mut missing = block.labels.iter().filter(|label| {
            let indices = self.labelled(what, scope, **label);
            out.extend(indices);
            indices.is_none()
        });
        if let Some(first) = missing.next() {
            let more = omitted_count_text(missing.count());
            let (keyword, one) = (what.keyword(), what.one());
            self.missing
                .push(format!("`{set}` ({place}, {keyword}: {one} {first}{more})"));
        }
        for [first, last, step] in &block.ranges {
            let by_label = self.label_index(what, scope);
            let from = by_label.partition_point(|(label, _)| label < first);
            let inside = by_label[from..]
                .iter()
                .take_while(|(label, _)| label <= last);
            let taken = inside.filter(|(label, _)| (label - first).is_multiple_of(*step));
            let before = out.len();
            out.extend(taken.map(|(_, index)| *index));
            let there = out.len() - before;
            let meant = ((last - first) / step).saturating_add(1);
            if (there as u64) < meant {
                let keyword = what.keyword();
                let fewer = format!("`{set}` ({place}, {keyword}: {there} of {meant})");
                self.fewer.push(fewer);
            }
        }
        for name in &block.names {
            out.extend(self.set_inside(what, scope, name, depth + 1)?.iter());
        }
        for name in &block.elements_of {
            let elements = self.set_inside(What::Elements, scope, name, depth + 1)?;
            let nodes = elements
                .iter()
                .flat_map(|e| self.elements.element_nodes(*e as usize));
            out.extend(nodes);
        }
        Ok(())
    }

    fn instance_or_error(&self, name: &str) -> Result<usize, MeshError> {
        self.instance(name).ok_or_else(|| {
            let known = self.scopes[1..].iter().map(|p| &p.scope.name);
            MeshError::unknown_name("instance", name, known)
        })
    }

    /// Node or element with a label.
    fn labelled(&self, what: What, scope: usize, label: u64) -> Option<u32> {
        let (index, first) = self.scopes[scope].numbers(what);
        index.get(&label).map(|index| first + index)
    }

    fn label_index(&mut self, what: What, scope: usize) -> ByLabel {
        let placed = &mut self.scopes[scope];
        let (index, first) = placed.numbers(what);
        let list = placed.by_label[what as usize].get_or_insert_with(|| {
            let mut list: Vec<_> = index.iter().map(|(label, i)| (*label, first + i)).collect();
            list.sort_unstable();
            Rc::new(list)
        });
        list.clone()
    }

    /// Nodes or elements that the first entry on a line of a surface refers to: a label or a set,
    /// perhaps of an instance. A label that is not there is recorded.
    ///
    /// # Errors
    /// No set has this name.
    pub fn target(
        &mut self,
        what: What,
        scope: usize,
        target: &str,
        surface: &DeckSurface,
    ) -> Result<Rc<Vec<u32>>, MeshError> {
        let label = match target.rsplit_once('.') {
            Some((instance, label)) => {
                let instance = self.instance(instance).or(self.only_scope());
                label.parse().ok().zip(instance)
            }
            None => target.parse().ok().map(|label| (label, scope)),
        };
        let Some((label, scope)) = label else {
            return self.set(what, scope, target);
        };
        let labelled = self.labelled(what, scope, label);
        if labelled.is_none() {
            let (name, place) = (&surface.name, self.files.message_position(surface.place));
            let one = what.one();
            self.missing
                .push(format!("`{name}` ({place}, *SURFACE: {one} {label})"));
        }
        Ok(Rc::new(labelled.into_iter().collect()))
    }
}

/// How many more items there are than a message names.
pub(super) fn omitted_count_text(count: usize) -> String {
    match count {
        0 => String::new(),
        more => format!(" and {more} more"),
    }
}
