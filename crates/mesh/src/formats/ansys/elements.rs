//! Reading of the blocks of an archive, line by line.

use super::super::numbered::Members;
use super::super::source::{LinePosition, SourceLines};
use super::blocks::{
    self, BlockFormat, add_members, field, float, integer, is_command, is_end, natural,
};
use super::read::{Archive, ArchiveElement, Component, Reader};
use super::types::{AnsysType, Kind};
use super::vocabulary::Command;
use crate::MeshError;

/// Fields before the nodes in the first line of an element of a block of solids.
const SOLID_FIELDS: usize = 11;
/// Fields before the nodes in an element of another block.
const OTHER_FIELDS: usize = 5;

/// Format of a block: its first line that is neither empty nor a comment.
fn format(lines: &mut SourceLines<'_>, block: &'static str) -> Result<BlockFormat, MeshError> {
    loop {
        let end = "its lines";
        let (place, line) = lines
            .next()
            .ok_or(MeshError::NotEnded { begin: block, end })?;
        let line = line.trim_ascii();
        if line.is_empty() || line.starts_with(b"!") {
            continue;
        }
        let format = BlockFormat::parse(&String::from_utf8_lossy(line));
        return format.map_err(|e| lines.files.locate_error(place, block, e));
    }
}

/// Calls `read` for each line of a block up to its end; it returns `true` if the block has all of
/// its items, and the file may end. A command that ends the block is read next, unless it begins
/// with `closing`.
fn each_line(
    lines: &mut SourceLines<'_>,
    block: &'static str,
    closing: &[u8],
    mut read: impl FnMut(&[u8], LinePosition) -> Result<bool, MeshError>,
) -> Result<(), MeshError> {
    let mut is_whole = false;
    loop {
        let Some((place, line)) = lines.next() else {
            let end = "`-1` behind it";
            let error = MeshError::NotEnded { begin: block, end };
            return if is_whole { Ok(()) } else { Err(error) };
        };
        if line.trim_ascii().is_empty() {
            continue;
        }
        if is_end(line) {
            let start = line.trim_ascii_start().get(..closing.len());
            let is_closed = start.is_some_and(|start| start.eq_ignore_ascii_case(closing));
            if is_command(line) && !is_closed {
                lines.back();
            }
            return Ok(());
        }
        let result = read(line, place);
        is_whole = result.map_err(|e| lines.files.locate_error(place, block, e))?;
    }
}

/// Adds the whole numbers of the fields of a line, as far as it goes.
fn integers(format: &BlockFormat, line: &[u8], into: &mut Vec<i64>) -> Result<(), MeshError> {
    let fields = format.integers.iter().map_while(|at| field(line, *at));
    for text in fields {
        into.push(integer(text)?);
    }
    Ok(())
}

/// Number of a node, an element, a type or a material.
fn number(value: i64) -> Result<u64, MeshError> {
    let found = || value.to_string();
    u64::try_from(value).map_err(|_| MeshError::NotALabel { found: found() })
}

/// Fields of an element, from one or more lines.
struct Fields {
    is_solid: bool,
    numbers: Vec<i64>,
    /// How many are needed, once the first line is known.
    expected: usize,
    /// Place of the first line.
    begun: Option<LinePosition>,
}

impl Fields {
    /// Number of the type: in blocks that are not of solids the field may be a section instead.
    fn type_number(&self, archive: &Archive, current: u64) -> Result<u64, MeshError> {
        let found = number(self.numbers.get(1).copied().unwrap_or(0))?;
        let is_known = self.is_solid || archive.types.contains_key(&found);
        Ok(if is_known { found } else { current })
    }

    /// Notes how many fields the element has whose first line was read.
    fn expect(
        &mut self,
        archive: &Archive,
        current: u64,
        in_first_line: usize,
    ) -> Result<(), MeshError> {
        let given = self.numbers.len();
        self.expected = given;
        if self.is_solid {
            let count = number(self.numbers.get(8).copied().unwrap_or(0))? as usize;
            if count > 0 {
                self.expected = count.saturating_add(SOLID_FIELDS);
            }
        } else if given >= OTHER_FIELDS + in_first_line.max(1) {
            let found = self.type_number(archive, current)?;
            let most = kind_of(archive.types.get(&found)).nodes().unwrap_or(0);
            self.expected = given.max(OTHER_FIELDS + most);
        }
        Ok(())
    }

    /// The element that has all of its fields, and its nodes.
    fn element(
        &mut self,
        archive: &Archive,
        current: u64,
        place: LinePosition,
    ) -> Result<(ArchiveElement, Vec<u64>), MeshError> {
        let (fields, [label, material]) = match self.is_solid {
            true => (SOLID_FIELDS, [10, 0]),
            false => (OTHER_FIELDS, [0, 3]),
        };
        let needed = MeshError::ElementFields {
            needed: fields + 1,
            found: self.numbers.len(),
        };
        let nodes = self.numbers.get(fields..self.expected).ok_or(needed)?;
        let nodes: Result<Vec<u64>, _> = nodes.iter().map(|node| number(*node)).collect();
        let mut nodes = nodes?;
        if !self.is_solid {
            // The last line may end with fields of zeros.
            let last = nodes.iter().rposition(|node| *node != 0);
            nodes.truncate(last.map_or(0, |last| last + 1));
        }
        let element = ArchiveElement {
            label: number(self.numbers[label])?,
            material: number(self.numbers[material])?,
            type_number: self.type_number(archive, current)?,
            place: self.begun.take().unwrap_or(place),
            end: 0,
        };
        self.numbers.clear();
        Ok((element, nodes))
    }
}

impl Reader {
    /// NBLOCK: nodes in global coordinates.
    pub(super) fn node_block(
        &mut self,
        command: &Command,
        lines: &mut SourceLines<'_>,
    ) -> Result<(), MeshError> {
        let format = format(lines, "NBLOCK")?;
        let said = self.natural(command.argument(3)).unwrap_or(0);
        let archive = &mut self.archive;
        let mut count = 0;
        each_line(lines, "NBLOCK", b"N,", |line, _| {
            let tag = natural(field(line, format.integers[0]).unwrap_or(""))?;
            let mut values = [0.0; 6];
            for (value, at) in values.iter_mut().zip(&format.floats) {
                let Some(text) = field(line, *at) else { break };
                *value = float(text)?;
            }
            let [x, y, z, angles @ ..] = values;
            archive.rotated_nodes += usize::from(angles != [0.0; 3]);
            archive.mesh.add_node(tag, [x, y, z])?;
            count += 1;
            Ok(count >= said && said > 0)
        })
    }

    /// EBLOCK: elements with their attributes, of solids (`EBLOCK,19,SOLID`) or of another layout.
    pub(super) fn element_block(
        &mut self,
        command: &Command,
        lines: &mut SourceLines<'_>,
    ) -> Result<(), MeshError> {
        let is_solid = command.argument(1).eq_ignore_ascii_case("SOLID");
        let in_first_line = natural(command.argument(0)).unwrap_or(0).min(20) as usize;
        let format = format(lines, "EBLOCK")?;
        let current = self.attributes.type_number;
        let said = self.natural(command.argument(3)).unwrap_or(0);
        let archive = &mut self.archive;
        let mut count = 0;
        let mut fields = Fields {
            is_solid,
            numbers: Vec::new(),
            expected: 0,
            begun: None,
        };
        each_line(lines, "EBLOCK", b"-1", |line, place| {
            integers(&format, line, &mut fields.numbers)?;
            if fields.begun.is_none() {
                fields.begun = Some(place);
                fields.expect(archive, current, in_first_line)?;
            }
            if fields.numbers.len() >= fields.expected {
                let (element, nodes) = fields.element(archive, current, place)?;
                archive.add_element(element, &nodes)?;
                count += 1;
            }
            Ok(count >= said && said > 0)
        })?;
        let Some(place) = fields.begun else {
            return Ok(());
        };
        let error = MeshError::ElementFields {
            needed: fields.expected,
            found: fields.numbers.len(),
        };
        Err(lines.files.locate_error(place, "EBLOCK", error))
    }

    /// CMBLOCK: the nodes or elements of a component.
    pub(super) fn component_block(
        &mut self,
        command: &Command,
        lines: &mut SourceLines<'_>,
    ) -> Result<(), MeshError> {
        let said = natural(command.argument(2))?;
        let word = command.argument(1).to_ascii_uppercase();
        let format = format(lines, "CMBLOCK")?;
        let mut members = Vec::new();
        let mut found = 0;
        while found < said {
            let Some((place, line)) = lines.next() else {
                break;
            };
            if is_command(line) {
                lines.back();
                break;
            }
            let texts = format.integers.iter().map_while(|at| field(line, *at));
            let mut result = Ok(());
            for text in texts.filter(|text| !text.is_empty()) {
                if found == said {
                    break;
                }
                found += 1;
                result = integer(text).and_then(|number| add_members(&mut members, number));
                if result.is_err() {
                    break;
                }
            }
            result.map_err(|e| lines.files.locate_error(place, "CMBLOCK", e))?;
        }
        if found != said {
            let what = "members of the component";
            return Err(MeshError::Total { what, said, found });
        }
        match word.as_str() {
            "NODE" | "ELEM" | "ELEMENT" | "NODES" | "ELEMENTS" => {
                self.archive.components.push(Component {
                    name: command.argument(0).to_owned(),
                    of: match word.starts_with("ELEM") {
                        true => Members::Elements,
                        false => Members::Nodes,
                    },
                    members,
                });
            }
            _ => self.archive.aside.add(&format!("CMBLOCK of {word}"), 1),
        }
        Ok(())
    }

    /// ETBLOCK: number, name and options of element types.
    pub(super) fn type_block(&mut self, lines: &mut SourceLines<'_>) -> Result<(), MeshError> {
        let format = format(lines, "ETBLOCK")?;
        let archive = &mut self.archive;
        each_line(lines, "ETBLOCK", b"-1", |line, _| {
            let mut fields = format.integers.iter().map_while(|at| field(line, *at));
            let number = natural(fields.next().unwrap_or(""))?;
            let mut found = AnsysType::new(fields.next().unwrap_or(""));
            found.first_option = fields.next().map_or(Ok(0), blocks::integer).unwrap_or(0);
            archive.types.insert(number, found);
            Ok(true)
        })
    }
}

/// Kind of a type that may be unknown.
pub(super) fn kind_of(found: Option<&AnsysType>) -> Kind {
    found.map_or(Kind::Other, AnsysType::kind)
}
