//! Conversion of the lines of bulk data to a [`Bulk`]: nodes, elements, properties, materials and
//! sets by their numbers.

use std::collections::BTreeMap;

use super::super::numbered::{NumberedKind, NumberedMesh};
use super::super::source::{LinePosition, SourceLines, decoded};
use super::super::systems::Coordinates;
use super::super::tally::Tally;
use super::cards::{self, Card};
use super::case_control::CaseControl;
use super::materials::{Mat1, Materials};
use super::names::{Named, Names};
use super::positions::{Positions, SystemCard};
use super::types::{self, element};
use crate::MeshError;

/// Contents of bulk data that are read.
#[derive(Default)]
pub(super) struct Bulk {
    pub mesh: NumberedMesh,
    pub positions: Positions,
    /// Property of each element of the mesh.
    pub properties_of_elements: Vec<u64>,
    /// Card and material of each property.
    pub properties: BTreeMap<u64, (String, Option<u64>)>,
    pub materials: Materials,
    /// Sets of nodes: SPC, SPC1, SET1, SET3 of nodes, by name.
    pub node_sets: BTreeMap<String, Vec<(u64, u64)>>,
    /// Sets of elements, by name.
    pub element_sets: BTreeMap<String, Vec<(u64, u64)>>,
    /// Sets of case control, of nodes or elements, by number.
    pub case_sets: BTreeMap<u64, Vec<(u64, u64)>>,
    pub names: Names,
    /// Nodes of elements that are not read.
    pub other_nodes: Vec<u64>,
    /// Cards that are not read.
    pub aside: Tally,
    /// Sections of bulk data that are not read, such as superelements, with their lines.
    pub sections: Tally,
    /// Nodes with a system of displacements.
    pub displacement_systems: usize,
    /// PARAM,WTMASS.
    pub mass_factor: Option<f64>,
    /// Words of DTI,UNITS.
    pub units: Option<String>,
}

/// Section of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Section {
    /// Executive and case control.
    Control,
    Bulk,
    /// Another section of bulk data, by the line that begins it.
    Other(String),
}

/// Cards of several lines that are read, except elements.
const READ: [&str; 13] = [
    "GRID", "CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S", "MAT1", "MAT9", "SPC1",
    "SET1", "SET3", "SET",
];
/// Solution settings and tables without nodes and elements, which need no remark.
const SILENT: &str = "\
    PARAM MDLPRM ENDDATA EIGRL EIGR EIGB EIGC EIGP NLPARM NLPCI NLSTEP TSTEP TSTEPNL TSTEP1 FREQ \
    FREQ1 FREQ2 FREQ3 FREQ4 FREQ5 TABDMP1 TABLED1 TABLED2 TABLED3 TABLED4 TABLEM1 TABLEM2 TABLEM3 \
    TABLEM4 ECHOON ECHOOFF DTI GRDSET CORD1R CORD1C CORD1S CORD2R CORD2C CORD2S DOPTPRM DSCREEN";

/// Reads all lines. `has_control` says that executive or case control precedes the bulk data.
///
/// # Errors
/// See [`MeshError`]; each error names its line.
pub(super) fn read(lines: &mut SourceLines<'_>, has_control: bool) -> Result<Bulk, MeshError> {
    let mut reader = Reader {
        bulk: Bulk::default(),
        section: if has_control {
            Section::Control
        } else {
            Section::Bulk
        },
        card: Card::default(),
        is_open: false,
        control: CaseControl::default(),
        default_system: 0,
        include: None,
    };
    let mut text = String::new();
    while let Some((place, line)) = lines.next() {
        let line = decoded(line);
        if let Some(comment) = line.trim_start().strip_prefix('$') {
            let open = reader.open_name();
            reader.bulk.names.comment(comment, open);
            continue;
        }
        let Some(line) = cards::clean(&line) else {
            continue;
        };
        text.clear();
        text.push_str(&line);
        match reader.line(&text, place, lines) {
            Ok(true) => {}
            Ok(false) => break,
            Err(LineError::OfLine(error)) => {
                return Err(lines.files.locate_error(place, "", error));
            }
            Err(LineError::OfCard(error)) => return Err(reader.locate(lines, error)),
        }
    }
    if reader.include.is_some() {
        let (begin, end) = ("INCLUDE", "quotation mark behind the name");
        return Err(MeshError::NotEnded { begin, end });
    }
    reader.close().map_err(|e| reader.locate(lines, e))?;
    reader.bulk.case_sets = reader.control.finish();
    Ok(reader.bulk)
}

/// Error of a line, or of the card before it.
enum LineError {
    OfLine(MeshError),
    OfCard(MeshError),
}

struct Reader {
    bulk: Bulk,
    section: Section,
    /// Card that may go on in the next line.
    card: Card,
    is_open: bool,
    control: CaseControl,
    /// System of nodes without one (GRDSET).
    default_system: u64,
    /// Name of a file that goes on in the next line.
    include: Option<String>,
}

impl Reader {
    /// Kind and number of the card that is open, for the name that a comment gives it.
    fn open_name(&self) -> Option<(Named, u64)> {
        let number = self.card.natural(0).ok().flatten()?;
        match self.card.name.as_str() {
            _ if !self.is_open => None,
            name if name.starts_with("MAT") => Some((Named::Material, number)),
            name if name.starts_with('P') => Some((Named::Property, number)),
            _ => None,
        }
    }

    /// Adds the place of the last card to an error.
    fn locate(&self, lines: &SourceLines<'_>, error: MeshError) -> MeshError {
        lines
            .files
            .locate_error(self.card.place, &self.card.name, error)
    }

    /// Reads a line; `false` at the end of the data.
    fn line(
        &mut self,
        line: &str,
        place: LinePosition,
        lines: &mut SourceLines<'_>,
    ) -> Result<bool, LineError> {
        let trimmed = line.trim();
        if let Some(begun) = self.include.take() {
            let included = self.include(begun + trimmed, lines);
            return included.map(|()| true).map_err(LineError::OfLine);
        }
        if let Some(rest) = behind(trimmed, "INCLUDE")
            && rest.starts_with([' ', '\'', '"', '='])
        {
            self.close().map_err(LineError::OfCard)?;
            let name = rest.trim_start_matches([' ', '=']).to_owned();
            let included = self.include(name, lines);
            return included.map(|()| true).map_err(LineError::OfLine);
        }
        if let Some(rest) = behind(trimmed, "BEGIN")
            && !rest.starts_with(',')
        {
            self.close().map_err(LineError::OfCard)?;
            self.begin_section(&trimmed.to_ascii_uppercase());
            return Ok(true);
        }
        let is_end = behind(trimmed, "ENDDATA").is_some();
        match &self.section {
            Section::Control => {
                if let Some(parameter) = behind(trimmed, "PARAM,") {
                    self.parameter(&parameter.to_ascii_uppercase());
                }
                self.control.line(trimmed);
                return Ok(true);
            }
            Section::Other(name) => {
                let name = name.clone();
                self.bulk.sections.add(&name, 1);
                return Ok(!is_end);
            }
            Section::Bulk => {}
        }
        if cards::continues(line) {
            if !self.is_open {
                self.bulk.aside.add("continuation of no card", 1);
                return Ok(true);
            }
            let result = self.card.add(line);
            // The other cards are only counted.
            if element(&self.card.name).is_some() || READ.contains(&self.card.name.as_str()) {
                result.map_err(LineError::OfLine)?;
            }
            return Ok(true);
        }
        self.close().map_err(LineError::OfCard)?;
        if is_end {
            return Ok(false);
        }
        self.card.begin(line, place);
        self.is_open = true;
        if let Some((kind, number)) = self.open_name() {
            self.bulk.names.follow(kind, number);
        }
        Ok(true)
    }

    /// `BEGIN BULK`, or `BEGIN SUPER=1`.
    fn begin_section(&mut self, line: &str) {
        let words: Vec<&str> = line
            .split([' ', '='])
            .filter(|word| !word.is_empty())
            .collect();
        let rest = words.get(1..).unwrap_or_default();
        let is_main = matches!(
            rest,
            [] | ["BULK"] | ["SUPER", "0"] | ["BULK", "SUPER", "0"]
        );
        self.section = match is_main {
            true => Section::Bulk,
            false => Section::Other(words.join(" ")),
        };
        if let Section::Other(name) = &self.section {
            self.bulk.sections.add(name, 0);
        }
    }

    /// Goes on in another file. Its name may be split over lines, between quotation marks.
    fn include(&mut self, name: String, lines: &mut SourceLines<'_>) -> Result<(), MeshError> {
        let quote = name.chars().next().filter(|c| matches!(c, '\'' | '"'));
        let inner = match quote {
            None => Some(name.as_str()),
            Some(quote) => name[1..].split_once(quote).map(|(inner, _)| inner),
        };
        match inner {
            Some(inner) => match lines.include(inner.trim()) {
                // Files of control have no mesh, and often stay with the program.
                Err(MeshError::Io { .. }) if self.section == Section::Control => {
                    let name = format!("INCLUDE of {}", inner.trim());
                    self.bulk.aside.add(&name, 1);
                }
                result => result?,
            },
            None => self.include = Some(name),
        }
        Ok(())
    }

    /// Reads the card that is open.
    fn close(&mut self) -> Result<(), MeshError> {
        if !std::mem::take(&mut self.is_open) {
            return Ok(());
        }
        let card = std::mem::take(&mut self.card);
        let result = self.card(&card);
        self.card = card;
        result
    }

    fn card(&mut self, card: &Card) -> Result<(), MeshError> {
        if let Some(found) = element(&card.name) {
            return self.element(card, found);
        }
        match card.name.as_str() {
            "GRID" => self.grid(card),
            "GRDSET" => {
                self.default_system = card.natural(1)?.unwrap_or(0);
                Ok(())
            }
            "CORD1R" => self.system_of_nodes(card, Coordinates::Rectangular),
            "CORD1C" => self.system_of_nodes(card, Coordinates::Cylindrical),
            "CORD1S" => self.system_of_nodes(card, Coordinates::Colatitude),
            "CORD2R" => self.system_of_points(card, Coordinates::Rectangular),
            "CORD2C" => self.system_of_points(card, Coordinates::Cylindrical),
            "CORD2S" => self.system_of_points(card, Coordinates::Colatitude),
            "PSOLID" | "PLSOLID" => {
                let material = card.natural(1)?;
                self.property(card, material)
            }
            "PSHELL" | "PCOMP" | "PCOMPG" | "PCOMPS" | "PLPLANE" | "PSHEAR" => {
                self.property(card, None)
            }
            "MAT1" => {
                let material = Mat1 {
                    young: card.float(1)?,
                    shear: card.float(2)?,
                    poisson: card.float(3)?,
                    density: card.float(4)?,
                    expansion: card.float(5)?,
                };
                self.bulk
                    .materials
                    .isotropic
                    .insert(card.required(0)?, material);
                Ok(())
            }
            "MAT9" => {
                let density = card.float(22)?;
                self.bulk
                    .materials
                    .anisotropic
                    .insert(card.required(0)?, density);
                Ok(())
            }
            "MATT1" => {
                self.bulk.materials.tables.push(card.required(0)?);
                Ok(())
            }
            "SPC" | "SPC1" | "SET1" | "SET3" | "SET" => self.set(card),
            "PARAM" => {
                let text = format!("{},{}", card.field(0), card.field(1));
                self.parameter(&text.to_ascii_uppercase());
                Ok(())
            }
            "DTI" if card.field(0).eq_ignore_ascii_case("UNITS") => {
                let words: Vec<&str> = (2..card.len()).map(|i| card.field(i)).collect();
                let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
                self.bulk.units = Some(words.join(", "));
                Ok(())
            }
            name if name.starts_with('=') => {
                let card = name.to_owned();
                Err(MeshError::BulkNotWrittenOut { card })
            }
            name => {
                if !SILENT.split_ascii_whitespace().any(|word| word == name) {
                    self.bulk.aside.add(name, 1);
                }
                for &i in types::other_nodes(name) {
                    self.bulk.other_nodes.extend(card.natural(i).ok().flatten());
                }
                Ok(())
            }
        }
    }

    fn grid(&mut self, card: &Card) -> Result<(), MeshError> {
        let tag = card.required(0)?;
        let system = card.natural(1)?.unwrap_or(self.default_system);
        let at = card.point(2)?;
        if !matches!(card.field(5), "" | "0") {
            self.bulk.displacement_systems += 1;
        }
        let mesh = &mut self.bulk.mesh;
        mesh.add_node(tag, at)?;
        if system != 0 {
            self.bulk.positions.add_node(tag, system, card.place);
        }
        Ok(())
    }

    /// Two systems by three nodes each.
    fn system_of_nodes(&mut self, card: &Card, coordinates: Coordinates) -> Result<(), MeshError> {
        for first in [0, 4] {
            if card.field(first).is_empty() {
                continue;
            }
            let system = card.required(first)?;
            let mut nodes = [0; 3];
            for (node, i) in nodes.iter_mut().zip(first + 1..) {
                *node = card.required(i)?;
            }
            let found = SystemCard::Nodes(nodes);
            self.bulk
                .positions
                .add_system(system, coordinates, found, card.place);
        }
        Ok(())
    }

    /// A system by three points in another one.
    fn system_of_points(&mut self, card: &Card, coordinates: Coordinates) -> Result<(), MeshError> {
        let points = [card.point(2)?, card.point(5)?, card.point(8)?];
        let parent = card.natural(1)?.unwrap_or(0);
        let found = SystemCard::Points(parent, points);
        let system = card.required(0)?;
        self.bulk
            .positions
            .add_system(system, coordinates, found, card.place);
        Ok(())
    }

    fn element(&mut self, card: &Card, found: types::ElementCard) -> Result<(), MeshError> {
        let label = card.required(0)?;
        let property = card.natural(1)?.unwrap_or(label);
        let nodes = card.nodes(2, found.most)?;
        let arranged = found.arrange(&nodes);
        if arranged.is_none() && found.kind == NumberedKind::Facet {
            let name = format!("{} without corners", card.name);
            self.bulk.aside.add(&name, 1);
            return Ok(());
        }
        let Some(arranged) = arranged else {
            return Err(MeshError::NodesOfElement {
                element: label,
                kind: card.name.clone(),
                expected: found.corners,
                found: nodes.iter().filter(|node| **node != 0).count(),
            });
        };
        let mesh = &mut self.bulk.mesh;
        mesh.add_element(label, found.kind, &arranged, card.place)?;
        self.bulk.properties_of_elements.push(property);
        Ok(())
    }

    fn property(&mut self, card: &Card, material: Option<u64>) -> Result<(), MeshError> {
        match card.required(0) {
            Ok(number) => {
                let property = (card.name.clone(), material);
                self.bulk.properties.insert(number, property);
            }
            Err(error) if material.is_some() => return Err(error),
            Err(_) => self.bulk.aside.add(&card.name, 1),
        }
        Ok(())
    }

    /// SPC, SPC1, SET1, SET3 and SET of OptiStruct.
    fn set(&mut self, card: &Card) -> Result<(), MeshError> {
        let (name, id) = (card.name.as_str(), card.field(0));
        let known = id
            .parse()
            .ok()
            .and_then(|id| self.bulk.names.get(Named::Set, id));
        let shown = match (name, known) {
            ("SPC" | "SPC1", _) | (_, None) => format!("{} {id}", name.replace("SPC1", "SPC")),
            (_, Some(known)) => known.to_owned(),
        };
        let kind = card.field(1).to_ascii_uppercase();
        let (ranges, of_nodes) = match (name, kind.as_str()) {
            ("SPC", _) => {
                let nodes = [1, 4].map(|i| card.natural(i));
                let mut ranges = Vec::new();
                for node in nodes {
                    ranges.extend(node?.map(|node| (node, node)));
                }
                (ranges, true)
            }
            ("SPC1", _) => (card.ranges(2)?, true),
            ("SET1", _) => (card.ranges(1)?, true),
            ("SET3", "GRID") => (card.ranges(2)?, true),
            ("SET3", "ELEM") => (card.ranges(2)?, false),
            ("SET", "GRID" | "NODE") => (card.ranges(FIELDS_OF_LINE)?, true),
            ("SET", "ELEM") => (card.ranges(FIELDS_OF_LINE)?, false),
            _ => {
                self.bulk.aside.add(&format!("{name} of {kind}"), 1);
                return Ok(());
            }
        };
        let sets = match of_nodes {
            true => &mut self.bulk.node_sets,
            false => &mut self.bulk.element_sets,
        };
        sets.entry(shown).or_default().extend(ranges);
        Ok(())
    }

    /// `WTMASS,0.00259`.
    fn parameter(&mut self, text: &str) {
        let mut words = text.split([',', ' ', '=']).filter(|word| !word.is_empty());
        if words.next() == Some("WTMASS") {
            let value = words
                .next()
                .and_then(|w| super::super::source::number(w).ok());
            self.bulk.mass_factor = value.or(self.bulk.mass_factor);
        }
    }
}

/// Text behind a word at the beginning of a line, in capital or small letters.
fn behind<'a>(line: &'a str, word: &str) -> Option<&'a str> {
    let (start, rest) = line.split_at_checked(word.len())?;
    start.eq_ignore_ascii_case(word).then_some(rest)
}

/// Fields of the first line of SET of OptiStruct, whose members begin in the second.
const FIELDS_OF_LINE: usize = 8;
