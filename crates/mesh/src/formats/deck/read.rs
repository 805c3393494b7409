//! Conversion of lines to a [`Deck`]: parts, instances, sets, surfaces and materials, with their
//! names.

use std::collections::HashSet;

use dovetail_numerics::space::{sub, unit};

use super::super::source::{LinePosition, label, number};
use super::left_aside::LeftAside;
use super::lines::{DeckLine, DeckLines, Keyword, fields, unquoted};
use super::scope::{
    DeckSection, InstancePlacement, InstanceTurn, Scope, SurfaceLine, SurfaceOf, block, key,
};
use super::types::{DeckElementKind, kind};
use super::vocabulary::{self, Understood};
use crate::MeshError;

#[derive(Debug, Clone, Default)]
pub(super) struct DeckMaterial {
    pub name: String,
    pub young: Option<f64>,
    pub poisson: Option<f64>,
    pub density: Option<f64>,
}

/// Contents of a deck that are read.
#[derive(Debug, Default)]
pub(super) struct Deck {
    /// Contents outside of any part, and in the assembly.
    pub root: Scope,
    pub parts: Vec<Scope>,
    pub instances: Vec<Scope>,
    pub materials: Vec<DeckMaterial>,
    /// Types of elements that are neither solids nor facets.
    pub other_types: Vec<String>,
    pub remarks: Vec<String>,
}

impl Deck {
    /// Material of this name.
    pub fn material(&self, name: &str) -> Option<&DeckMaterial> {
        self.materials.iter().find(|m| key(&m.name) == key(name))
    }
}

/// Keywords that are ignored without a remark.
const SILENT: &str = "\
    HEADING PREPRINT INCLUDE ASSEMBLY ENDASSEMBLY ENDPART ENDINSTANCE MATERIAL ENDSTEP END";

/// Scope that nodes, elements and sets go to.
#[derive(Clone, Copy, PartialEq)]
enum Open {
    Root,
    Part,
    Instance,
}

/// Meaning of the data lines after a keyword.
enum Mode {
    Skip,
    Nodes {
        cylindrical: bool,
        set: Option<String>,
    },
    Elements(PendingElements),
    Set {
        name: String,
        of_elements: bool,
        generate: bool,
        instance: Option<String>,
    },
    Surface(String, SurfaceOf),
    Union {
        name: String,
        internal: bool,
    },
    /// First line of a property of a material, then those for other temperatures.
    Property {
        elastic: bool,
        is_read: bool,
    },
    Placement(usize),
}

/// Element that is being read, perhaps from several lines.
struct PendingElements {
    kind: DeckElementKind,
    kind_name: String,
    set: Option<String>,
    /// Label, then nodes.
    pending: Vec<u64>,
    /// True if a line of a mass or a beam ended with a comma.
    goes_on: bool,
    /// True if one of its nodes is not a number, as for a connector between instances.
    odd: bool,
}

/// Reads all lines.
///
/// # Errors
/// See [`MeshError`]; each error names its place.
pub(super) fn read(lines: &mut DeckLines<'_>) -> Result<Deck, MeshError> {
    let mut reader = Reader {
        deck: Deck::default(),
        open: Open::Root,
        in_assembly: None,
        has_assembly: false,
        mode: Mode::Skip,
        keyword: Keyword::default(),
        place: String::new(),
        aside: LeftAside::default(),
        names: HashSet::new(),
        nodes_of_instances: 0,
    };
    while let Some((place, line)) = lines.next() {
        let result = match line {
            DeckLine::Keyword(keyword) => {
                let closed = reader.close();
                closed.map_err(|e| reader.locate_keyword_error(lines, e))?;
                reader.keyword = keyword.clone();
                vocabulary::understand(keyword).and_then(|found| reader.keyword(found, lines))
            }
            DeckLine::Data(_) if reader.keyword.name.is_empty() => {
                reader
                    .aside
                    .without_keyword
                    .push(lines.source.files.message_position(place));
                Ok(())
            }
            DeckLine::Data(text) => {
                reader.place = lines.source.files.message_position(place);
                reader.data(&text)
            }
        };
        result.map_err(|e| {
            lines
                .source
                .files
                .locate_error(place, &reader.keyword.shown, e)
        })?;
    }
    let end = reader.close().and_then(|()| reader.finish());
    let end = end.and_then(|()| reader.join_parts());
    end.map_err(|e| reader.locate_keyword_error(lines, e))?;
    Ok(reader.deck)
}

struct Reader {
    deck: Deck,
    open: Open,
    /// Place of *ASSEMBLY, while it is open.
    in_assembly: Option<LinePosition>,
    mode: Mode,
    has_assembly: bool,
    /// Last keyword; one without a name before the first, and after a line of one asterisk.
    keyword: Keyword,
    /// Place of the last data line.
    place: String,
    aside: LeftAside,
    /// Keys of the names of parts, instances and materials.
    names: HashSet<(&'static str, String)>,
    /// Nodes of all instances before the last.
    nodes_of_instances: usize,
}

fn name_once(list: &mut Vec<String>, name: &str) {
    if !list.iter().any(|known| known == name) {
        list.push(name.to_owned());
    }
}

impl Reader {
    /// A name that none of its kind has yet.
    fn new_name(&mut self, name: &str, what: &'static str) -> Result<String, MeshError> {
        let name = name.to_owned();
        if !self.names.insert((what, key(&name))) {
            return Err(MeshError::ScopeTwice { what, name });
        }
        Ok(name)
    }

    fn locate_keyword_error(&self, lines: &DeckLines<'_>, error: MeshError) -> MeshError {
        let keyword = &self.keyword;
        lines
            .source
            .files
            .locate_error(keyword.place, &keyword.shown, error)
    }

    fn scope(&mut self) -> &mut Scope {
        let list = match self.open {
            Open::Root => return &mut self.deck.root,
            Open::Part => &mut self.deck.parts,
            Open::Instance => &mut self.deck.instances,
        };
        list.last_mut().expect("one is open")
    }

    fn keyword(&mut self, found: Understood, lines: &mut DeckLines<'_>) -> Result<(), MeshError> {
        let keyword = &found.keyword;
        self.mode = Mode::Skip;
        let shown = |parameter: &String| {
            let place = lines.source.files.message_position(keyword.place);
            format!("{parameter} of {} ({place})", keyword.shown)
        };
        self.aside.parameters.extend(found.aside.iter().map(shown));
        let unknown = found.unknown.iter().map(shown);
        self.aside.unknown_parameters.extend(unknown);
        if found.is_generator {
            let keyword = keyword.shown.clone();
            return Err(MeshError::NotWrittenOut { keyword });
        }
        self.mode = match keyword.name.as_str() {
            "NODE" => self.node(keyword)?,
            "ELEMENT" => self.element(keyword)?,
            "NSET" | "ELSET" => self.set(keyword)?,
            "SURFACE" => self.surface(keyword)?,
            "SOLIDSECTION" => self.section(keyword)?,
            "MATERIAL" => self.material(keyword)?,
            "ELASTIC" => self.elastic(keyword)?,
            "DENSITY" => self.density(keyword)?,
            "INCLUDE" => {
                lines.source.include(keyword.required("INPUT")?)?;
                return Ok(());
            }
            "PART" | "ENDPART" | "ASSEMBLY" | "ENDASSEMBLY" | "INSTANCE" | "ENDINSTANCE" => {
                self.structure(keyword)?
            }
            name => {
                let is_silent = vocabulary::words(SILENT).any(|word| word == name);
                if !is_silent && !name.is_empty() {
                    name_once(&mut self.aside.keywords, &keyword.shown);
                }
                return Ok(());
            }
        };
        match keyword.get("INPUT") {
            Some(file) if !matches!(self.mode, Mode::Skip) => lines.source.include(file),
            _ => Ok(()),
        }
    }

    fn node(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        let system = keyword.get("SYSTEM").unwrap_or("R").to_uppercase();
        let cylindrical = match system.as_str() {
            "R" | "" => false,
            "C" => true,
            _ => return Err(MeshError::NodeSystem { found: system }),
        };
        let set = keyword.get("NSET").map(str::to_owned);
        Ok(Mode::Nodes { cylindrical, set })
    }

    fn element(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        let kind_name = keyword.required("TYPE")?.to_owned();
        let set = keyword.get("ELSET").map(str::to_owned);
        let kind = kind(&kind_name, set.as_deref())?;
        let capitals = kind_name.to_uppercase();
        if kind == DeckElementKind::Aside {
            name_once(&mut self.aside.types, &capitals);
        }
        if matches!(kind, DeckElementKind::Aside | DeckElementKind::Line(_)) {
            name_once(&mut self.deck.other_types, &capitals);
        }
        Ok(Mode::Elements(PendingElements {
            kind,
            kind_name,
            set,
            pending: Vec::new(),
            goes_on: false,
            odd: false,
        }))
    }

    fn set(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        let of_elements = keyword.name == "ELSET";
        let parameter = if of_elements { "ELSET" } else { "NSET" };
        let name = keyword.required(parameter)?.to_owned();
        let instance = keyword.get("INSTANCE").map(str::to_owned);
        let sets = self.scope().sets(of_elements);
        let block = block(sets, &name, keyword.place, instance.as_deref());
        if let (false, Some(elements)) = (of_elements, keyword.get("ELSET")) {
            block.elements_of.push(elements.to_owned());
        }
        if let Some(set) = sets.get_mut(&key(&name)) {
            set.internal |= keyword.has("INTERNAL");
        }
        Ok(Mode::Set {
            name,
            of_elements,
            generate: keyword.has("GENERATE"),
            instance,
        })
    }

    fn surface(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        const TYPES: &str = "\
            ELEMENT NODE CUTTINGSURFACE CYLINDER EULERIANMATERIAL REVOLUTION SEGMENTS USER";
        const COMBINED: &str = "UNION INTERSECTION DIFFERENCE";
        let name = keyword.required("NAME")?.to_owned();
        let kind = vocabulary::value(keyword.get("TYPE").unwrap_or("ELEMENT"), TYPES)?;
        let combine = keyword.get("COMBINE");
        let combine = combine.map(|how| vocabulary::value(how, COMBINED));
        let combine = combine.transpose()?;
        let union = combine.as_deref() == Some("UNION");
        let is_read = matches!(kind.as_str(), "ELEMENT" | "NODE")
            && (combine.is_none() || union)
            && !keyword.has("CROP");
        if !is_read {
            let how = combine.unwrap_or(kind);
            self.deck.remarks.push(format!(
                "The surface `{name}` ({how}) was left aside: only those of elements, of nodes and unions are read."
            ));
            return Ok(Mode::Skip);
        }
        let internal = keyword.has("INTERNAL");
        if union {
            return Ok(Mode::Union { name, internal });
        }
        let of = match kind.as_str() {
            "NODE" => SurfaceOf::Nodes,
            _ => SurfaceOf::Faces,
        };
        let surface = self.scope().surface(&name, of, keyword.place);
        surface.internal |= internal;
        Ok(Mode::Surface(name, of))
    }

    fn section(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        let section = DeckSection {
            set: keyword.required("ELSET")?.to_owned(),
            material: keyword.required("MATERIAL")?.to_owned(),
            place: keyword.place,
        };
        self.scope().sections.push(section);
        Ok(Mode::Skip)
    }

    fn material(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        let name = self.new_name(keyword.required("NAME")?, "materials")?;
        self.deck.materials.push(DeckMaterial {
            name,
            ..DeckMaterial::default()
        });
        Ok(Mode::Skip)
    }

    fn elastic(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        const TYPES: &str = "\
            ISOTROPIC ORTHOTROPIC ANISOTROPIC ENGINEERINGCONSTANTS LAMINA BILAMINA TRACTION \
            COUPLEDTRACTION SHEAR SHORTFIBER SHELL";
        let written = keyword.get("TYPE").filter(|kind| !kind.is_empty());
        let written = written.unwrap_or("ISOTROPIC");
        if vocabulary::value(written, TYPES)? == "ISOTROPIC" {
            return Ok(self.property(keyword, true, |m| m.young.is_some()));
        }
        if let Some(material) = self.deck.materials.last() {
            let (name, kind) = (&material.name, written.to_uppercase());
            self.deck.remarks.push(format!(
                "The elasticity of the material `{name}` ({kind}) was left aside: only isotropic ones are read."
            ));
        }
        Ok(Mode::Skip)
    }

    fn density(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        if keyword.has("POREFLUID") {
            name_once(&mut self.aside.keywords, "*DENSITY, PORE FLUID");
            return Ok(Mode::Skip);
        }
        Ok(self.property(keyword, false, |m| m.density.is_some()))
    }

    /// Data lines of a property. The last of several counts.
    fn property(
        &mut self,
        keyword: &Keyword,
        elastic: bool,
        is_given: impl Fn(&DeckMaterial) -> bool,
    ) -> Mode {
        if let Some(material) = self.deck.materials.last().filter(|m| is_given(m)) {
            let (name, keyword) = (&material.name, &keyword.shown);
            self.aside
                .given_again
                .push(format!("{keyword} of `{name}`"));
        }
        Mode::Property {
            elastic,
            is_read: false,
        }
    }

    /// Records a line of a property that is not the first.
    fn other_temperatures(&mut self) {
        if let Some(material) = self.deck.materials.last() {
            name_once(&mut self.aside.of_temperature, &material.name);
        }
    }

    /// Beginning and end of parts, instances and the assembly.
    fn structure(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        let place = keyword.place;
        let misplaced = |needs: &'static str| MeshError::Misplaced { needs };
        match (keyword.name.as_str(), self.open, self.in_assembly) {
            ("PART", Open::Root, None) => {
                let name = self.new_name(keyword.required("NAME")?, "parts")?;
                self.deck.parts.push(Scope {
                    name,
                    ..Scope::default()
                });
                self.open = Open::Part;
            }
            ("ENDPART", Open::Part, _) => self.open = Open::Root,
            ("ASSEMBLY", Open::Root, None) => {
                (self.in_assembly, self.has_assembly) = (Some(place), true);
            }
            ("ENDASSEMBLY", Open::Root, Some(_)) => self.in_assembly = None,
            ("INSTANCE", Open::Root, Some(_)) => return self.instance(keyword),
            ("ENDINSTANCE", Open::Instance, _) => self.open = Open::Root,
            ("PART" | "ASSEMBLY", ..) => return Err(misplaced("the end of what stands before it")),
            ("INSTANCE", ..) => return Err(misplaced("*ASSEMBLY around it")),
            _ => self.aside.without_begin.push(keyword.shown.clone()),
        }
        Ok(Mode::Skip)
    }

    fn instance(&mut self, keyword: &Keyword) -> Result<Mode, MeshError> {
        let (name, part) = (keyword.required("NAME")?, keyword.required("PART")?);
        let name = self.new_name(name, "instances")?;
        let parts = self.deck.parts.iter();
        let Some(part) = parts.clone().find(|p| key(&p.name) == key(part)) else {
            let known = parts.map(|p| &p.name);
            return Err(MeshError::unknown_name("part", part, known));
        };
        self.nodes_of_instances += self.deck.instances.last().map_or(0, |i| i.nodes.len());
        let nodes = self.nodes_of_instances + part.nodes.len();
        MeshError::check_number("nodes", nodes as u64)?;
        let part = Scope {
            name,
            part: part.name.clone(),
            ..part.clone()
        };
        self.deck.instances.push(part);
        self.open = Open::Instance;
        Ok(Mode::Placement(0))
    }

    fn data(&mut self, text: &str) -> Result<(), MeshError> {
        let mut mode = std::mem::replace(&mut self.mode, Mode::Skip);
        let result = match &mut mode {
            Mode::Skip => Ok(()),
            Mode::Nodes { cylindrical, set } => self.node_line(text, *cylindrical, set.as_deref()),
            Mode::Elements(elements) => self.element_line(text, elements),
            Mode::Set {
                name,
                of_elements,
                generate,
                instance,
            } => self.set_line(text, name, *of_elements, *generate, instance.as_deref()),
            Mode::Surface(name, of) => self.surface_line(text, name, *of),
            Mode::Union { name, internal } => self.union_line(text, name, *internal),
            Mode::Placement(line) => {
                *line += 1;
                self.placement_line(text, *line)
            }
            Mode::Property { elastic, is_read } => {
                if std::mem::replace(is_read, true) {
                    self.other_temperatures();
                    Ok(())
                } else {
                    self.material_line(text, *elastic)
                }
            }
        };
        self.mode = mode;
        result
    }

    fn node_line(
        &mut self,
        text: &str,
        cylindrical: bool,
        set: Option<&str>,
    ) -> Result<(), MeshError> {
        let mut fields = fields(text);
        let node = label(fields.next().unwrap_or_default())?;
        let mut at = [0.0; 3];
        for (x, field) in at.iter_mut().zip(fields) {
            if !field.is_empty() {
                *x = number(field)?;
            }
        }
        if cylindrical {
            let (sine, cosine) = at[1].to_radians().sin_cos();
            at = [at[0] * cosine, at[0] * sine, at[2]];
        }
        let place = self.keyword.place;
        let scope = self.scope();
        let moved = scope.push_node(node, at);
        if let Some(set) = set {
            block(&mut scope.nsets, set, place, None).labels.push(node);
        }
        if moved {
            self.aside
                .moved_nodes
                .push(format!("{node} ({})", self.place));
        }
        Ok(())
    }

    fn element_line(
        &mut self,
        text: &str,
        elements: &mut PendingElements,
    ) -> Result<(), MeshError> {
        let mut fields: Vec<&str> = fields(text).collect();
        let goes_on = fields.last().is_some_and(|last| last.is_empty());
        if goes_on {
            fields.pop();
        }
        let tolerant = !matches!(
            elements.kind,
            DeckElementKind::Solid(_) | DeckElementKind::Facet(_)
        );
        for field in fields {
            match label(field) {
                Ok(found) => elements.pending.push(found),
                Err(_) if tolerant && !elements.pending.is_empty() => elements.odd = true,
                Err(e) => return Err(e),
            }
        }
        elements.goes_on = goes_on;
        let is_complete = match elements.kind {
            DeckElementKind::Solid(nodes) | DeckElementKind::Facet(nodes) => {
                elements.pending.len() > nodes
            }
            DeckElementKind::Line(_) | DeckElementKind::Aside => !goes_on,
        };
        if let DeckElementKind::Solid(nodes) | DeckElementKind::Facet(nodes) = elements.kind
            && elements.pending.len() > nodes + 1
        {
            let (place, kind) = (&self.place, &elements.kind_name);
            let (element, found) = (elements.pending[0], elements.pending.len() - 1);
            self.aside.surplus.push(format!(
                "{element} ({place}: {found} nodes, {kind} has {nodes})"
            ));
            elements.pending.truncate(nodes + 1);
        }
        if is_complete {
            self.element_done(elements)
        } else {
            Ok(())
        }
    }

    /// Stores the element that has been read.
    fn element_done(&mut self, elements: &mut PendingElements) -> Result<(), MeshError> {
        let Some((&element, nodes)) = elements.pending.split_first() else {
            return Ok(());
        };
        let wrong = |expected| MeshError::NodesOfElement {
            element,
            kind: elements.kind_name.clone(),
            expected,
            found: nodes.len(),
        };
        let mut aside = nodes;
        let (kind, nodes) = match elements.kind {
            DeckElementKind::Solid(expected) | DeckElementKind::Facet(expected)
                if nodes.len() != expected =>
            {
                return Err(wrong(expected));
            }
            DeckElementKind::Line(_) if elements.odd => (DeckElementKind::Aside, &[][..]),
            // A node of a beam's orientation may follow.
            DeckElementKind::Line(expected) => match nodes.split_at_checked(expected) {
                Some((nodes, rest)) => {
                    aside = rest;
                    (elements.kind, nodes)
                }
                None => return Err(wrong(expected)),
            },
            DeckElementKind::Aside => (DeckElementKind::Aside, &[][..]),
            kind => (kind, nodes),
        };
        let place = self.keyword.place;
        let scope = self.scope();
        if matches!(kind, DeckElementKind::Aside | DeckElementKind::Line(_)) {
            scope.aside_nodes.extend(aside);
        }
        scope.push_element(element, kind, nodes, place)?;
        if let Some(set) = &elements.set {
            block(&mut scope.elsets, set, place, None)
                .labels
                .push(element);
        }
        elements.pending.clear();
        (elements.goes_on, elements.odd) = (false, false);
        Ok(())
    }

    fn set_line(
        &mut self,
        text: &str,
        name: &str,
        of_elements: bool,
        generate: bool,
        instance: Option<&str>,
    ) -> Result<(), MeshError> {
        let place = self.keyword.place;
        let sets = self.scope().sets(of_elements);
        if generate {
            let fields: Vec<&str> = fields(text).filter(|f| !f.is_empty()).collect();
            let wrong = || MeshError::Generate {
                line: text.to_owned(),
            };
            let range = match fields[..] {
                [first, last] => [label(first)?, label(last)?, 1],
                [first, last, step] => [label(first)?, label(last)?, label(step)?],
                _ => return Err(wrong()),
            };
            let [first, last, step] = range;
            if step == 0 || last < first {
                return Err(wrong());
            }
            block(sets, name, place, instance).ranges.push(range);
            return Ok(());
        }
        for field in fields(text).filter(|f| !f.is_empty()) {
            if let Ok(label) = label(field) {
                block(sets, name, place, instance).labels.push(label);
                continue;
            }
            // `instance.label`
            if let Some((whose, rest)) = unquoted(field).rsplit_once('.')
                && let Ok(label) = label(rest)
            {
                let block = block(sets, name, place, Some(unquoted(whose)));
                block.labels.push(label);
                continue;
            }
            let other = unquoted(field).to_owned();
            block(sets, name, place, instance).names.push(other);
        }
        Ok(())
    }

    fn surface_line(&mut self, text: &str, name: &str, of: SurfaceOf) -> Result<(), MeshError> {
        let mut fields = fields(text);
        let target = unquoted(fields.next().unwrap_or_default()).to_owned();
        if target.is_empty() {
            return Err(MeshError::SurfaceOfAll);
        }
        let face = fields
            .next()
            .filter(|face| !face.is_empty())
            .map(str::to_uppercase);
        let place = self.keyword.place;
        let surface = self.scope().surface(name, of, place);
        surface.lines.push(SurfaceLine { target, face });
        Ok(())
    }

    /// Notes the surfaces that a union names.
    fn union_line(&mut self, text: &str, name: &str, internal: bool) -> Result<(), MeshError> {
        let place = self.keyword.place;
        let scope = self.scope();
        for field in fields(text).filter(|f| !f.is_empty()) {
            let other = key(unquoted(field));
            let kinds = [SurfaceOf::Faces, SurfaceOf::Nodes];
            let kinds = kinds.map(|of| Some(of).filter(|_| scope.has_surface(&other, of)));
            if kinds == [None; 2] {
                let known = scope.surfaces.values().map(|s| &s.name);
                return Err(MeshError::unknown_name("surface", unquoted(field), known));
            }
            for of in kinds.into_iter().flatten() {
                let surface = scope.surface(name, of, place);
                surface.internal |= internal;
                surface.united.insert(other.clone());
            }
        }
        Ok(())
    }

    fn placement_line(&mut self, text: &str, line: usize) -> Result<(), MeshError> {
        let mut values = Vec::new();
        for field in fields(text).filter(|f| !f.is_empty()) {
            values.push(number(field)?);
        }
        let wrong = || MeshError::Placement {
            line: text.to_owned(),
        };
        let placement: &mut InstancePlacement = &mut self.scope().placement;
        match (line, &values[..]) {
            (1, [x, y, z]) => placement.shift = [*x, *y, *z],
            (2, [ax, ay, az, bx, by, bz, angle]) => {
                let (a, b) = ([*ax, *ay, *az], [*bx, *by, *bz]);
                placement.turn = Some(InstanceTurn {
                    point: a,
                    direction: unit(sub(b, a)).ok_or_else(wrong)?,
                    angle_rad: angle.to_radians(),
                });
            }
            _ => return Err(wrong()),
        }
        Ok(())
    }

    fn material_line(&mut self, text: &str, elastic: bool) -> Result<(), MeshError> {
        let Some(material) = self.deck.materials.last_mut() else {
            return Err(MeshError::Misplaced {
                needs: "*MATERIAL before it",
            });
        };
        let mut fields = fields(text);
        let first = number(fields.next().unwrap_or_default())?;
        if elastic {
            material.young = Some(first);
            // CalculiX and Abaqus take a missing ratio as zero.
            let poisson = fields.next().filter(|f| !f.is_empty());
            material.poisson = Some(poisson.map_or(Ok(0.0), number)?);
        } else {
            material.density = Some(first);
        }
        Ok(())
    }

    /// Ends the data lines of a keyword.
    fn close(&mut self) -> Result<(), MeshError> {
        match std::mem::replace(&mut self.mode, Mode::Skip) {
            Mode::Elements(mut elements) => self.element_done(&mut elements),
            _ => Ok(()),
        }
    }

    fn finish(&mut self) -> Result<(), MeshError> {
        let open = match (self.open, self.in_assembly) {
            // CalculiX has no parts.
            (Open::Part, _) if !self.has_assembly => {
                self.deck.remarks.push("*PART has no *END PART.".to_owned());
                None
            }
            (Open::Part, _) => Some(("*PART", "*END PART")),
            (Open::Instance, _) => Some(("*INSTANCE", "*END INSTANCE")),
            (Open::Root, Some(_)) => Some(("*ASSEMBLY", "*END ASSEMBLY")),
            (Open::Root, None) => None,
        };
        if let Some((begin, end)) = open {
            return Err(MeshError::NotEnded { begin, end });
        }
        self.deck.remarks.extend(self.aside.sentences());
        Ok(())
    }

    /// Joins parts with the lines outside of them if the deck has no instances: CalculiX skips
    /// `*PART`. Each part stays a set of elements.
    ///
    /// # Errors
    /// Two of them have an element of one number.
    fn join_parts(&mut self) -> Result<(), MeshError> {
        if !self.deck.instances.is_empty() || self.deck.root.is_empty() {
            return Ok(());
        }
        for part in std::mem::take(&mut self.deck.parts) {
            let (name, labels) = (part.name.clone(), part.elements.iter().map(|e| e.label));
            let labels = labels.collect();
            let root = &mut self.deck.root;
            root.merge(part)?;
            if !root.elsets.contains_key(&key(&name)) {
                block(&mut root.elsets, &name, LinePosition::default(), None).labels = labels;
            }
        }
        Ok(())
    }
}
