//! Conversion of the lines of an archive to an [`Archive`]: nodes, elements, types, materials and
//! components by their numbers.

use std::collections::{BTreeMap, HashMap};

use super::super::numbered::{Members, NumberedMesh};
use super::super::source::{LinePosition, SourceLines, decoded, number};
use super::super::systems::System;
use super::super::tally::Tally;
use super::blocks::{self, is_command};
use super::materials::Materials;
use super::systems;
use super::types::AnsysType;
use super::vocabulary::{Command, assignment, commands, quoted};
use crate::MeshError;

/// Element with the nodes that the file gives it.
pub(super) struct ArchiveElement {
    pub label: u64,
    pub material: u64,
    pub type_number: u64,
    pub place: LinePosition,
    /// Index behind its last node in [`Archive::numbers`].
    pub end: usize,
}

/// Component, or another list of nodes or elements.
pub(super) struct Component {
    pub name: String,
    pub of: Members,
    /// First and last number of each range.
    pub members: Vec<(u64, u64)>,
}

/// Contents of an archive that are read.
#[derive(Default)]
pub(super) struct Archive {
    pub mesh: NumberedMesh,
    pub elements: Vec<ArchiveElement>,
    /// Nodes of all elements.
    pub numbers: Vec<u64>,
    highest_label: u64,
    pub types: BTreeMap<u64, AnsysType>,
    pub materials: Materials,
    pub components: Vec<Component>,
    /// Bodies of Workbench: name, first element and the one behind the last.
    pub bodies: Vec<(String, [u32; 2])>,
    /// Word of /UNITS.
    pub units: Option<String>,
    /// Commands that are not read.
    pub aside: Tally,
    /// Nodes with a rotated coordinate system.
    pub rotated_nodes: usize,
}

impl Archive {
    /// Adds an element.
    ///
    /// # Errors
    /// More elements than can be numbered.
    pub fn add_element(&mut self, element: ArchiveElement, nodes: &[u64]) -> Result<(), MeshError> {
        MeshError::check_number("elements", self.elements.len() as u64)?;
        self.numbers.extend(nodes);
        self.highest_label = self.highest_label.max(element.label);
        let end = self.numbers.len();
        self.elements.push(ArchiveElement { end, ..element });
        Ok(())
    }
}

/// Attributes of the elements that E and EN make.
#[derive(Default)]
pub(super) struct Attributes {
    pub material: u64,
    pub type_number: u64,
    /// Element number of EN,R5.5,ATTR.
    label: u64,
}

/// Reads all lines.
///
/// # Errors
/// See [`MeshError`]; each error names its line.
pub(super) fn read(lines: &mut SourceLines<'_>) -> Result<Archive, MeshError> {
    let mut reader = Reader {
        attributes: Attributes {
            material: 1,
            type_number: 1,
            label: 0,
        },
        selected: [Some(0); 2],
        ..Reader::default()
    };
    while let Some((place, line)) = lines.next() {
        if place == (LinePosition { file: 0, line: 1 }) {
            reader.has_geometry = is_geometry(line);
        }
        if line.trim_ascii().is_empty() || reader.has_geometry && is_geometry(line) {
            continue;
        }
        if !is_command(line) {
            reader.data_line(line);
            continue;
        }
        let line = decoded(line).into_owned();
        let result = reader.line(&line, place, lines);
        result.map_err(|e| lines.files.locate_error(place, &reader.last, e))?;
    }
    Ok(reader.archive)
}

/// True for a line of the geometry (IGES) that CDWRITE puts before the mesh: 80 characters, of which
/// the last eight are a letter and a number.
fn is_geometry(line: &[u8]) -> bool {
    let is_number = |text: &[u8]| {
        let text = text.trim_ascii();
        !text.is_empty() && text.iter().all(u8::is_ascii_digit)
    };
    line.len() == 80 && b"SGDPT".contains(&line[72]) && is_number(&line[73..])
}

#[derive(Default)]
pub(super) struct Reader {
    pub archive: Archive,
    pub attributes: Attributes,
    parameters: HashMap<String, f64>,
    /// Coordinate systems of LOCAL, and the active one.
    systems: HashMap<u64, System>,
    active: u64,
    /// First node and first element of the selection, which includes all that follow. `None` if
    /// the selection is not known.
    selected: [Option<usize>; 2],
    /// Name of the last command, and whether it is counted with the lines behind it.
    pub last: String,
    counts_lines: bool,
    is_first_line: bool,
    has_geometry: bool,
    /// Number of *DO loops that are open.
    loops: usize,
    /// True if comments list the names of materials (HyperMesh).
    names_materials: bool,
    /// Material of TB,ELASTIC whose data follow, and how many temperatures it has so far.
    pub table: Option<(u64, usize)>,
}

impl Reader {
    /// Counts a line of numbers behind a command that is not read.
    fn data_line(&mut self, line: &[u8]) {
        let line = line.trim_ascii();
        if !self.counts_lines || line.starts_with(b"(") || line == b"-1" {
            return;
        }
        if !self.is_first_line {
            self.archive.aside.add(&self.last, 1);
        }
        self.is_first_line = false;
    }

    fn line(
        &mut self,
        line: &str,
        place: LinePosition,
        lines: &mut SourceLines<'_>,
    ) -> Result<(), MeshError> {
        let trimmed = line.trim();
        if let Some(comment) = trimmed.strip_prefix('!') {
            self.comment(comment);
            return Ok(());
        }
        for text in commands(trimmed) {
            if let Some((name, value)) = assignment(text) {
                if let Ok(value) = number(&value) {
                    self.parameters.insert(name, value);
                }
                continue;
            }
            let Some(command) = Command::parse(text) else {
                continue;
            };
            self.last.clone_from(&command.shown);
            self.counts_lines = false;
            self.command(&command, place, lines)?;
        }
        Ok(())
    }

    /// Names of materials in the comments of HyperMesh and Workbench.
    fn comment(&mut self, comment: &str) {
        if let Some(list) = comment.strip_prefix("!HMNAME") {
            self.names_materials = list.trim() == "MAT";
        } else if let Some(name) = quoted(comment).filter(|_| self.names_materials) {
            let number = comment.trim_start_matches('!').split_whitespace().next();
            if let Some(Ok(number)) = number.map(str::parse) {
                self.archive.materials.name(number, name);
            }
        } else if let Some((before, number)) = comment.split_once("matid,")
            && let Ok(number) = number.trim().parse()
        {
            let name = before.trim().trim_end_matches(',').rsplit(',').next();
            let name = name.map(str::trim).filter(|name| !name.is_empty());
            if let Some(name) = name {
                self.archive.materials.name(number, name);
            }
        }
    }

    fn command(
        &mut self,
        command: &Command,
        place: LinePosition,
        lines: &mut SourceLines<'_>,
    ) -> Result<(), MeshError> {
        let makes_mesh = ["N", "E", "EN", "NBLO", "EBLO"].contains(&command.key.as_str());
        if command.is_generator() || makes_mesh && self.loops > 0 {
            let command = command.shown.clone();
            return Err(MeshError::ArchiveNotWrittenOut { command });
        }
        match command.key.as_str() {
            "NBLO" => self.node_block(command, lines)?,
            "EBLO" => self.element_block(command, lines)?,
            "CMBL" => self.component_block(command, lines)?,
            "ETBL" => self.type_block(lines)?,
            "N" => self.node(command)?,
            "E" => self.element(command, place)?,
            "EMOR" => self.more_nodes(command)?,
            "EN" => self.numbered_element(command, place)?,
            "ET" => self.element_type(command)?,
            "KEYO" => self.key_option(command)?,
            "TYPE" => self.attributes.type_number = self.natural(command.argument(0))?,
            "MAT" => self.attributes.material = self.natural(command.argument(0))?,
            "MP" => self.property(command)?,
            "MPDA" => self.property_table(command)?,
            "MPTE" | "MPTG" => {}
            "TB" => self.begin_table(command),
            "TBDA" => self.table_data(command),
            "LOCA" | "CS" => self.local_system(command)?,
            "CSYS" => self.active = self.natural(command.argument(0))?,
            "NSEL" | "ESEL" | "ALLS" => self.select(command),
            "CM" => self.component(command),
            "/UNIT" => self.archive.units = Some(command.argument(0).to_ascii_uppercase()),
            "/COM" => self.message(command),
            "/WB" => self.workbench(command),
            "/INPU" | "CDRE" => include(command, lines)?,
            "*DO" | "*DOWH" => self.loops += 1,
            "*ENDD" => self.loops = self.loops.saturating_sub(1),
            "*REPE" => {
                let command = command.shown.clone();
                return Err(MeshError::ArchiveNotWrittenOut { command });
            }
            _ if command.is_silent() => {}
            _ => {
                self.archive.aside.add(&command.shown, 1);
                (self.counts_lines, self.is_first_line) = (true, true);
            }
        }
        Ok(())
    }

    /// Whole number of an argument, which may be the name of a parameter; 0 for an empty one.
    pub fn natural(&self, argument: &str) -> Result<u64, MeshError> {
        match self.parameters.get(&argument.to_ascii_uppercase()) {
            Some(value) if *value >= 0.0 && value.fract() == 0.0 => Ok(*value as u64),
            _ => blocks::natural(argument),
        }
    }

    /// Number of an argument, which may be the name of a parameter; 0 for an empty one.
    pub fn float(&self, argument: &str) -> Result<f64, MeshError> {
        match self.parameters.get(&argument.to_ascii_uppercase()) {
            Some(value) => Ok(*value),
            None => blocks::float(argument),
        }
    }

    /// Numbers of the arguments from number `from` on.
    pub fn floats<const N: usize>(
        &self,
        command: &Command,
        from: usize,
    ) -> Result<[f64; N], MeshError> {
        let mut values = [0.0; N];
        for (value, i) in values.iter_mut().zip(from..) {
            *value = self.float(command.argument(i))?;
        }
        Ok(values)
    }

    /// `N,R5.3,LOC,number,,,x,y,z` of an archive in global coordinates, or `N,number,x,y,z` in the
    /// active ones.
    fn node(&mut self, command: &Command) -> Result<(), MeshError> {
        let is_ended = command.argument(2) == "-1";
        if is_release(command.argument(0)) {
            if is_ended || command.argument(3).is_empty() {
                return Ok(());
            }
            let values: [f64; 3] = self.floats(command, 5)?;
            if !command.argument(1).eq_ignore_ascii_case("LOC") {
                self.archive.rotated_nodes += usize::from(values != [0.0; 3]);
                return Ok(());
            }
            let tag = self.natural(command.argument(2))?;
            return self.archive.mesh.add_node(tag, values);
        }
        let tag = match command.argument(0) {
            "" => self.archive.mesh.highest_tag().saturating_add(1),
            tag => self.natural(tag)?,
        };
        let angles: [f64; 3] = self.floats(command, 4)?;
        self.archive.rotated_nodes += usize::from(angles != [0.0; 3]);
        let at = self.floats(command, 1)?;
        let at = match self.active {
            0 => at,
            active => {
                let unknown = MeshError::UnknownSystem { number: active };
                let system = self.systems.get(&active).copied();
                system
                    .or_else(|| systems::global(active))
                    .ok_or(unknown)?
                    .point(at)
            }
        };
        self.archive.mesh.add_node(tag, at)
    }

    /// `E,i,j,...` with the current attributes.
    fn element(&mut self, command: &Command, place: LinePosition) -> Result<(), MeshError> {
        let label = self.archive.highest_label.saturating_add(1);
        self.add_element(label, &command.arguments, place)
    }

    fn add_element(
        &mut self,
        label: u64,
        nodes: &[String],
        place: LinePosition,
    ) -> Result<(), MeshError> {
        let nodes: Result<Vec<u64>, _> = nodes.iter().map(|node| self.natural(node)).collect();
        let mut nodes = nodes?;
        let given = nodes.iter().rposition(|node| *node != 0);
        nodes.truncate(given.map_or(0, |last| last + 1));
        let element = ArchiveElement {
            label,
            material: self.attributes.material,
            type_number: self.attributes.type_number,
            place,
            end: 0,
        };
        self.archive.add_element(element, &nodes)
    }

    /// `EMORE,q,r,...`: further nodes of the last element.
    fn more_nodes(&mut self, command: &Command) -> Result<(), MeshError> {
        for node in &command.arguments {
            let node = self.natural(node)?;
            self.archive.numbers.push(node);
        }
        if let Some(last) = self.archive.elements.last_mut() {
            last.end = self.archive.numbers.len();
        }
        Ok(())
    }

    /// `EN,R5.5,ATTR,...` and `EN,R5.5,NODE,...` of an archive, or `EN,number,i,j,...`.
    fn numbered_element(
        &mut self,
        command: &Command,
        place: LinePosition,
    ) -> Result<(), MeshError> {
        if !is_release(command.argument(0)) {
            let label = self.natural(command.argument(0))?;
            return self.add_element(label, command.arguments.get(1..).unwrap_or_default(), place);
        }
        let word = command.argument(1).to_ascii_uppercase();
        match (word.as_str(), command.argument(2)) {
            (_, "-1") => {}
            ("ATTR", _) => {
                self.attributes = Attributes {
                    material: self.natural(command.argument(3))?,
                    type_number: self.natural(command.argument(4))?,
                    label: self.natural(command.argument(8))?,
                };
            }
            ("NODE", _) => {
                let is_more = self.archive.elements.last();
                let is_more = is_more.is_some_and(|e| e.label == self.attributes.label);
                let rest = command.arguments.get(2..).unwrap_or_default().to_vec();
                if is_more {
                    let rest = Command {
                        arguments: rest,
                        ..command.clone()
                    };
                    return self.more_nodes(&rest);
                }
                return self.add_element(self.attributes.label, &rest, place);
            }
            _ => {
                let found = command.argument(1).to_owned();
                return Err(MeshError::NotALabel { found });
            }
        }
        Ok(())
    }

    /// `ET,number,name,kop1,...`.
    fn element_type(&mut self, command: &Command) -> Result<(), MeshError> {
        let number = match command.argument(0) {
            "" => {
                let last = self.archive.types.last_key_value();
                last.map_or(1, |(number, _)| number.saturating_add(1))
            }
            number => self.natural(number)?,
        };
        if command.argument(1).is_empty() {
            return Ok(());
        }
        let mut found = AnsysType::new(command.argument(1));
        found.first_option = self.natural(command.argument(2)).unwrap_or(0) as i64;
        self.archive.types.insert(number, found);
        Ok(())
    }

    /// `KEYOPT,number,option,value`.
    fn key_option(&mut self, command: &Command) -> Result<(), MeshError> {
        let number = self.natural(command.argument(0))?;
        let value = self.float(command.argument(2)).unwrap_or(0.0);
        if let (Ok(1), Some(known)) = (
            self.natural(command.argument(1)),
            self.archive.types.get_mut(&number),
        ) {
            known.first_option = value as i64;
        }
        Ok(())
    }

    /// Coordinate system: `LOCAL,R5.0,LOC,number,kind,x,y,z` with a line ANG, or
    /// `LOCAL,number,kind,x,y,z,xy,yz,zx`.
    fn local_system(&mut self, command: &Command) -> Result<(), MeshError> {
        if command.key == "CS" {
            self.archive.aside.add("CS", 1);
            return Ok(());
        }
        if !is_release(command.argument(0)) {
            let number = self.natural(command.argument(0))?;
            let kind = self.natural(command.argument(1)).unwrap_or(0);
            let system = systems::local(kind, self.floats(command, 2)?, self.floats(command, 5)?);
            self.systems.extend(system.map(|system| (number, system)));
            // LOCAL activates the system that it defines.
            self.active = number;
            return Ok(());
        }
        let number = self.natural(command.argument(2))?;
        let kind = self.natural(command.argument(3)).unwrap_or(0);
        let values = self.floats(command, 4)?;
        let known = self.systems.get(&number).map(|system| system.origin);
        let system = match command.argument(1).to_ascii_uppercase().as_str() {
            "LOC" => systems::local(kind, values, [0.0; 3]),
            "ANG" => systems::local(kind, known.unwrap_or_default(), values),
            _ => return Ok(()),
        };
        self.systems.extend(system.map(|system| (number, system)));
        Ok(())
    }

    /// Follows selections: of everything, of nothing, and others, which are not known.
    fn select(&mut self, command: &Command) {
        let counts = [
            self.archive.mesh.node_tags().len(),
            self.archive.elements.len(),
        ];
        let word = command.argument(0).to_ascii_uppercase();
        let selection = |count: usize| match word.as_str() {
            "ALL" | "" => Some(0),
            "NONE" => Some(count),
            _ => None,
        };
        match command.key.as_str() {
            "NSEL" => self.selected[0] = selection(counts[0]),
            "ESEL" => self.selected[1] = selection(counts[1]),
            _ => self.selected = [Some(0); 2],
        }
    }

    /// `CM,name,NODE` or `CM,name,ELEM`: a component of the selection.
    fn component(&mut self, command: &Command) {
        let name = command.argument(0).to_owned();
        let word: String = command.argument(1).to_ascii_uppercase();
        let archive = &mut self.archive;
        let members: Option<Vec<u64>> = match (word.get(..4), self.selected) {
            (Some("NODE"), [Some(from), _]) => Some(archive.mesh.node_tags()[from..].to_vec()),
            (Some("ELEM"), [_, Some(from)]) => {
                Some(archive.elements[from..].iter().map(|e| e.label).collect())
            }
            _ => None,
        };
        match members {
            Some(members) => archive.components.push(Component {
                name,
                of: match word.starts_with("ELEM") {
                    true => Members::Elements,
                    false => Members::Nodes,
                },
                members: members.into_iter().map(|m| (m, m)).collect(),
            }),
            None => archive.aside.add("CM of a selection", 1),
        }
    }

    /// `/COM,*** Elements for Body 1 "blade" ***` of Workbench.
    fn message(&mut self, command: &Command) {
        let text = command.arguments.join(",");
        if text.contains("Elements for Body")
            && let Some(name) = quoted(&text)
        {
            self.end_body();
            let first = self.archive.elements.len() as u32;
            let bodies = &mut self.archive.bodies;
            bodies.push((name.to_owned(), [first, u32::MAX]));
        }
    }

    /// `/WB,ELEM,END`: the elements behind it belong to no body.
    fn workbench(&mut self, command: &Command) {
        if command.argument(0).eq_ignore_ascii_case("ELEM") {
            self.end_body();
        }
    }

    fn end_body(&mut self) {
        let elements = self.archive.elements.len() as u32;
        if let Some((_, range)) = self.archive.bodies.last_mut() {
            range[1] = range[1].min(elements);
        }
    }
}

/// True for the first word of commands in archives: `R5.3`, `UNBL`.
pub(super) fn is_release(word: &str) -> bool {
    let word = word.to_ascii_uppercase();
    word == "UNBL"
        || word
            .strip_prefix('R')
            .is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
}

/// `/INPUT,name,ending` or `CDREAD,option,name,ending`: another file in this place.
fn include(command: &Command, lines: &mut SourceLines<'_>) -> Result<(), MeshError> {
    let skip = usize::from(command.key == "CDRE");
    let [name, ending] = [skip, skip + 1].map(|i| command.argument(i).trim_matches('\''));
    let ending = match (ending, skip) {
        ("", 1) => "cdb",
        (ending, _) => ending,
    };
    match (name, ending) {
        ("", _) => Ok(()),
        (name, "") => lines.include(name),
        (name, ending) => lines.include(&format!("{name}.{ending}")),
    }
}
