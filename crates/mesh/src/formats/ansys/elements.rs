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

/// Layout of the elements in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// Attributes, the number of nodes and the number of the element: `EBLOCK,19,SOLID`.
    Solid,
    /// Number, type, real constant, material and system: `EBLOCK,10`.
    Plain,
    /// Number alone; the attributes are the current ones: `EBLOCK,10,COMPACT`.
    Compact,
}

impl Layout {
    /// Number of fields before the nodes.
    fn fields(self) -> usize {
        match self {
            Self::Solid => 11,
            Self::Plain => 5,
            Self::Compact => 1,
        }
    }

    /// Position of the number of the element.
    fn label(self) -> usize {
        match self {
            Self::Solid => 10,
            Self::Plain | Self::Compact => 0,
        }
    }

    /// Position of the material.
    fn material(self) -> Option<usize> {
        match self {
            Self::Solid => Some(0),
            Self::Plain => Some(3),
            Self::Compact => None,
        }
    }
}

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
    layout: Layout,
    numbers: Vec<i64>,
    /// How many are needed, once the first line is known.
    expected: usize,
    /// Place of the first line.
    begun: Option<LinePosition>,
    /// Current material and type.
    current: [u64; 2],
}

impl Fields {
    /// Number of the type. In plain blocks the field may have a section instead.
    fn type_number(&self, archive: &Archive) -> Result<u64, MeshError> {
        let found = number(self.numbers.get(1).copied().unwrap_or(0))?;
        let is_type = match self.layout {
            Layout::Solid => true,
            Layout::Plain => archive.types.contains_key(&found),
            Layout::Compact => false,
        };
        Ok(if is_type { found } else { self.current[1] })
    }

    /// Notes how many fields the element has whose first line was read. A line of `full` fields
    /// goes on in the next one.
    fn expect(&mut self, archive: &Archive, full: usize) -> Result<(), MeshError> {
        let given = self.numbers.len();
        self.expected = given;
        if self.layout == Layout::Solid {
            let count = number(self.numbers.get(8).copied().unwrap_or(0))? as usize;
            if count > 0 {
                self.expected = count.saturating_add(self.layout.fields());
            }
        } else if given >= full {
            let found = self.type_number(archive)?;
            let most = kind_of(archive.types.get(&found)).nodes().unwrap_or(0);
            self.expected = given.max(self.layout.fields() + most);
        }
        Ok(())
    }

    /// The element that has all of its fields, and its nodes.
    fn element(
        &mut self,
        archive: &Archive,
        place: LinePosition,
    ) -> Result<(ArchiveElement, Vec<u64>), MeshError> {
        let fields = self.layout.fields();
        let needed = MeshError::ElementFields {
            needed: fields + 1,
            found: self.numbers.len(),
        };
        let nodes = self.numbers.get(fields..self.expected).ok_or(needed)?;
        let nodes: Result<Vec<u64>, _> = nodes.iter().map(|node| number(*node)).collect();
        let mut nodes = nodes?;
        if self.layout != Layout::Solid {
            // The last line may end with fields of zeros.
            let last = nodes.iter().rposition(|node| *node != 0);
            nodes.truncate(last.map_or(0, |last| last + 1));
        }
        let element = ArchiveElement {
            label: number(self.numbers[self.layout.label()])?,
            material: match self.layout.material() {
                Some(field) => number(self.numbers[field])?,
                None => self.current[0],
            },
            type_number: self.type_number(archive)?,
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

    /// EBLOCK: elements in one of the layouts.
    pub(super) fn element_block(
        &mut self,
        command: &Command,
        lines: &mut SourceLines<'_>,
    ) -> Result<(), MeshError> {
        let layout = match command.argument(1).to_ascii_uppercase().as_str() {
            "SOLID" => Layout::Solid,
            "COMPACT" => Layout::Compact,
            _ => Layout::Plain,
        };
        let format = format(lines, "EBLOCK")?;
        let in_first_line = natural(command.argument(0)).unwrap_or(0).clamp(1, 20);
        let full = format.integers.len();
        let full = full.min(layout.fields() + in_first_line as usize);
        let said = self.natural(command.argument(3)).unwrap_or(0);
        let mut fields = Fields {
            layout,
            numbers: Vec::new(),
            expected: 0,
            begun: None,
            current: [self.attributes.material, self.attributes.type_number],
        };
        let archive = &mut self.archive;
        let mut count = 0;
        each_line(lines, "EBLOCK", b"-1", |line, place| {
            integers(&format, line, &mut fields.numbers)?;
            if fields.begun.is_none() {
                fields.begun = Some(place);
                fields.expect(archive, full)?;
            }
            if fields.numbers.len() >= fields.expected {
                let (element, nodes) = fields.element(archive, place)?;
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
