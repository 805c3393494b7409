//! Copies of files of MSH 4 in the form that `mshio` reads: MSH 4.1 with nothing but
//! `$Entities`, `$Nodes` and `$Elements`.
//!
//! `mshio` wants nothing behind the names of sections and behind the header. It drops node tags that
//! look dense and then assumes that file order is tag order, so the header of `$Nodes` is made to look
//! sparse. It knows no partitions, no parameters of nodes, and no MSH 4.0: sections with these are
//! rewritten. Format: Gmsh reference manual, "MSH file format", and `GModelIO_MSH4.cpp` of Gmsh.

use std::collections::BTreeMap;

use super::gmsh_order::dimension_and_nodes;
use super::numbers::SectionNumbers;
use super::sections::{Encoding, MshHeader, Sections};
use crate::MeshError;

/// Copy of a file.
pub(super) struct Plain {
    pub bytes: Vec<u8>,
    /// Places of the copy at which a piece begins, with its place in the file.
    pieces: Vec<[usize; 2]>,
}

/// File to be copied.
pub(super) struct MshSource<'a> {
    pub bytes: &'a [u8],
    pub sections: &'a Sections,
    pub format: MshHeader,
}

impl Plain {
    /// Copies a file. With `rewrite_nodes` the parameters of nodes are left out.
    ///
    /// # Errors
    /// A section is missing, empty, or broken.
    pub fn new(source: &MshSource<'_>, rewrite_nodes: bool) -> Result<Self, MeshError> {
        let is_old = source.format.version < 4.1;
        let mut plain = Self {
            bytes: Vec::new(),
            pieces: Vec::new(),
        };
        let mut header = Writer::new(source.format.encoding);
        match source.format.encoding {
            Encoding::Ascii => plain.text("$MeshFormat\n4.1 0 8"),
            _ => {
                plain.text("$MeshFormat\n4.1 1 8\n");
                header.int(1);
            }
        }
        plain.bytes.append(&mut header.out);
        plain.text("\n$EndMeshFormat\n");
        let partitioned = source.sections.content("PartitionedEntities").is_some();
        if is_old || partitioned {
            plain.section("Entities", |out| entities(source, out))?;
        } else if let Some(content) = source.sections.content("Entities") {
            plain.text("$Entities\n");
            plain.piece(source.bytes, content.start, content.end);
            plain.text("$EndEntities\n");
        }
        if is_old || rewrite_nodes {
            plain.section("Nodes", |out| nodes(source, out))?;
        } else {
            plain.copied(source, "Nodes", |[blocks, total, ..]| {
                [blocks, total, 1, u64::MAX]
            })?;
        }
        if is_old {
            plain.section("Elements", |out| elements(source, out))?;
        } else {
            plain.copied(source, "Elements", |[blocks, total, least, most]| {
                match least == 0 || most < least {
                    true => [blocks, total, 1, total],
                    false => [blocks, total, least, most],
                }
            })?;
        }
        Ok(plain)
    }

    /// Place in the file of a place in the copy.
    pub fn file_position(&self, byte: usize) -> usize {
        let next = self.pieces.partition_point(|[start, _]| *start <= byte);
        let piece = next.checked_sub(1).map(|i| self.pieces[i]);
        piece.map_or(0, |[start, in_file]| in_file + byte - start)
    }

    fn text(&mut self, text: &str) {
        self.bytes.extend(text.bytes());
    }

    /// Copies a part of the file.
    fn piece(&mut self, bytes: &[u8], start: usize, end: usize) {
        self.pieces.push([self.bytes.len(), start]);
        self.bytes.extend(&bytes[start..end]);
    }

    fn section(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut Vec<u8>) -> Result<(), MeshError>,
    ) -> Result<(), MeshError> {
        self.text(&format!("${name}\n"));
        write(&mut self.bytes)?;
        self.text(&format!("\n$End{name}\n"));
        Ok(())
    }

    /// Copies a section, with other counts at its head.
    fn copied(
        &mut self,
        source: &MshSource<'_>,
        section: &'static str,
        counts: impl Fn([u64; 4]) -> [u64; 4],
    ) -> Result<(), MeshError> {
        let content = source.sections.needed(section)?;
        let mut numbers = source.numbers(section)?;
        let said = source.counts(&mut numbers, section)?;
        let mut head = Writer::new(source.format.encoding);
        counts(said).into_iter().for_each(|count| head.size(count));
        self.text(&format!("${section}\n"));
        self.bytes.append(&mut head.out);
        self.piece(source.bytes, numbers.at.start, content.end);
        self.text(&format!("$End{section}\n"));
        Ok(())
    }
}

impl<'a> MshSource<'a> {
    fn numbers(&self, section: &'static str) -> Result<SectionNumbers<'a>, MeshError> {
        Ok(SectionNumbers {
            bytes: self.bytes,
            encoding: self.format.encoding,
            section,
            at: self.sections.needed(section)?,
        })
    }

    fn is_old(&self) -> bool {
        self.format.version < 4.1
    }

    /// Counts at the head of `$Nodes` and `$Elements`: blocks, total, lowest and highest tag.
    fn counts(
        &self,
        numbers: &mut SectionNumbers<'_>,
        section: &'static str,
    ) -> Result<[u64; 4], MeshError> {
        let missing = |_| MeshError::MissingSection { section };
        let mut counts = [0, 0, 1, u64::MAX];
        let there = if self.is_old() { 2 } else { 4 };
        let is_empty = numbers.is_at_end();
        for count in &mut counts[..there] {
            *count = match numbers.size() {
                Err(error) if is_empty => return Err(missing(error)),
                found => found?,
            };
        }
        if counts[1] == 0 {
            let what = if section == "Nodes" {
                "nodes"
            } else {
                "elements"
            };
            return Err(MeshError::Empty { what });
        }
        Ok(counts)
    }

    /// Head of a block: dimension and tag of its entity, a third number, and the number of items.
    fn block(&self, numbers: &mut SectionNumbers<'_>) -> Result<([i64; 3], u64), MeshError> {
        let [a, b, third] = [numbers.int()?, numbers.int()?, numbers.int()?];
        let [dimension, tag] = if self.is_old() { [b, a] } else { [a, b] };
        Ok(([dimension, tag, third], numbers.size()?))
    }
}

/// Writes numbers in an encoding.
struct Writer {
    out: Vec<u8>,
    encoding: Encoding,
}

impl Writer {
    fn new(encoding: Encoding) -> Self {
        Self {
            out: Vec::new(),
            encoding,
        }
    }

    fn write_field<const N: usize>(&mut self, text: impl FnOnce() -> String, little: [u8; N]) {
        match self.encoding {
            Encoding::Ascii => {
                self.out.extend(text().bytes());
                self.out.push(b' ');
            }
            Encoding::LittleEndian => self.out.extend(little),
            Encoding::BigEndian => self.out.extend(little.iter().rev()),
        }
    }

    fn int(&mut self, value: i64) {
        self.write_field(|| value.to_string(), (value as i32).to_le_bytes());
    }

    fn size(&mut self, value: u64) {
        self.write_field(|| value.to_string(), value.to_le_bytes());
    }

    fn float(&mut self, value: f64) {
        self.write_field(|| format!("{value:?}"), value.to_le_bytes());
    }
}

/// Entities without their boundaries, including the entities of partitions.
fn entities(source: &MshSource<'_>, out: &mut Vec<u8>) -> Result<(), MeshError> {
    let mut entities: BTreeMap<(usize, i64), Vec<u8>> = BTreeMap::new();
    for section in ["Entities", "PartitionedEntities"] {
        if source.sections.content(section).is_none() {
            continue;
        }
        let mut numbers = source.numbers(section)?;
        let partitioned = section == "PartitionedEntities";
        if partitioned {
            numbers.size()?; // of partitions
            for _ in 0..numbers.size()? {
                let _ghost_entity_and_partition = [numbers.int()?, numbers.int()?];
            }
        }
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = numbers.size()?;
        }
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let (tag, bytes) = entity(source, &mut numbers, dimension, partitioned)?;
                entities.insert((dimension, tag), bytes);
            }
        }
    }
    let mut writer = Writer::new(source.format.encoding);
    for dimension in 0..4 {
        let entity_keys = entities.keys().filter(|(d, _)| *d == dimension);
        writer.size(entity_keys.count() as u64);
    }
    out.append(&mut writer.out);
    out.extend(entities.into_values().flatten());
    Ok(())
}

/// Tag of an entity, and its bytes in the copy.
fn entity(
    source: &MshSource<'_>,
    numbers: &mut SectionNumbers<'_>,
    dimension: usize,
    partitioned: bool,
) -> Result<(i64, Vec<u8>), MeshError> {
    let mut writer = Writer::new(source.format.encoding);
    let tag = numbers.int()?;
    writer.int(tag);
    // An entity between partitions has the groups of the body or surface that it cuts.
    let mut is_cut = false;
    if partitioned {
        let [of_parent, _tag_of_parent] = [numbers.int()?, numbers.int()?];
        is_cut = of_parent > dimension as i64;
        for _ in 0..numbers.size()? {
            numbers.int()?;
        }
    }
    let bounds = if dimension == 0 { 3 } else { 6 };
    for _ in 0..bounds {
        writer.float(numbers.float()?);
    }
    if dimension == 0 && source.is_old() {
        for _ in 0..3 {
            numbers.float()?;
        }
    }
    let mut groups = Vec::new();
    for _ in 0..numbers.size()? {
        groups.push(numbers.int()?);
    }
    if is_cut {
        groups.clear();
    }
    writer.size(groups.len() as u64);
    groups.into_iter().for_each(|group| writer.int(group));
    if dimension > 0 {
        for _ in 0..numbers.size()? {
            numbers.int()?;
        }
        writer.size(0);
    }
    Ok((tag, writer.out))
}

/// Nodes without parameters.
fn nodes(source: &MshSource<'_>, out: &mut Vec<u8>) -> Result<(), MeshError> {
    let mut numbers = source.numbers("Nodes")?;
    let [blocks, total, ..] = source.counts(&mut numbers, "Nodes")?;
    let mut writer = Writer::new(source.format.encoding);
    for count in [blocks, total, 1, u64::MAX] {
        writer.size(count);
    }
    for _ in 0..blocks {
        let ([dimension, tag, parametric], count) = source.block(&mut numbers)?;
        for number in [dimension, tag, 0] {
            writer.int(number);
        }
        writer.size(count);
        let parameters = if parametric == 0 { 0 } else { dimension };
        let mut coordinates = Writer::new(source.format.encoding);
        if !source.is_old() {
            for _ in 0..count {
                writer.size(numbers.size()?);
            }
        }
        for _ in 0..count {
            if source.is_old() {
                writer.size(numbers.size()?);
            }
            for _ in 0..3 {
                coordinates.float(numbers.float()?);
            }
            for _ in 0..parameters {
                numbers.float()?;
            }
        }
        writer.out.append(&mut coordinates.out);
    }
    out.append(&mut writer.out);
    Ok(())
}

/// Elements of MSH 4.0 in the order of MSH 4.1.
fn elements(source: &MshSource<'_>, out: &mut Vec<u8>) -> Result<(), MeshError> {
    let mut numbers = source.numbers("Elements")?;
    let [blocks, total, ..] = source.counts(&mut numbers, "Elements")?;
    let mut writer = Writer::new(source.format.encoding);
    for count in [blocks, total, 1, total] {
        writer.size(count);
    }
    for _ in 0..blocks {
        let ([dimension, tag, kind], count) = source.block(&mut numbers)?;
        for number in [dimension, tag, kind] {
            writer.int(number);
        }
        writer.size(count);
        for _ in 0..count {
            let element = numbers.size()?;
            let known = u64::try_from(kind).ok().and_then(dimension_and_nodes);
            let Some((_, nodes)) = known else {
                let kind = kind.to_string();
                return Err(MeshError::ElementKind { element, kind });
            };
            writer.size(element);
            for _ in 0..nodes {
                writer.size(numbers.size()?);
            }
        }
    }
    out.append(&mut writer.out);
    Ok(())
}
