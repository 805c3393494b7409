//! Sections of Gmsh's files, their header, and the names of the groups.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::MeshError;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Header of a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct MshHeader {
    pub version: f64,
    pub encoding: Encoding,
}

impl MshHeader {
    /// Error of a version that is not read.
    pub fn other_version(self) -> MeshError {
        MeshError::Version {
            found: self.version.to_string(),
            encoding: match self.encoding {
                Encoding::Ascii => "",
                _ => " (binary)",
            },
        }
    }
}

fn find(haystack: &[u8], needle: &[u8]) -> Option<usize> {
    haystack.windows(needle.len()).position(|w| w == needle)
}

/// Place of a word that no letter or digit follows.
fn find_word(haystack: &[u8], word: &[u8]) -> Option<usize> {
    let mut from = 0;
    loop {
        let at = from + find(&haystack[from..], word)?;
        from = at + word.len();
        let next = haystack.get(from);
        if next.is_none_or(|byte| !byte.is_ascii_alphanumeric()) {
            return Some(at);
        }
    }
}

fn malformed(byte: usize, name: &str, reason: impl Into<String>) -> MeshError {
    MeshError::Malformed {
        byte,
        at: format!("section ${name}"),
        reason: reason.into(),
    }
}

struct FileSection {
    name: String,
    /// Range between the line of its name and its `$End`.
    content: Range<usize>,
}

/// All sections of a file, in their order. Text inside a section that looks like the beginning of
/// another one does not count; lines between sections are skipped, as Gmsh does.
pub(super) struct Sections(Vec<FileSection>);

/// Sections that a file has at most once.
const ONCE: [&str; 7] = [
    "MeshFormat",
    "PhysicalNames",
    "Entities",
    "PartitionedEntities",
    "Nodes",
    "ParametricNodes",
    "Elements",
];

impl Sections {
    /// # Errors
    /// A section without an end, or a second one of a name.
    pub fn parse(bytes: &[u8]) -> Result<Self, MeshError> {
        let mut sections: Vec<FileSection> = Vec::new();
        let mut at = match bytes.starts_with(b"\xef\xbb\xbf") {
            true => 3,
            false => 0,
        };
        while at < bytes.len() {
            let line = bytes[at..]
                .split(|b| *b == b'\n')
                .next()
                .unwrap_or_default();
            let behind = at + line.len() + 1;
            let Some(name) = line.trim_ascii().strip_prefix(b"$") else {
                at = behind;
                continue;
            };
            let name = String::from_utf8_lossy(name).into_owned();
            if !name.bytes().all(|b| b.is_ascii_alphanumeric()) {
                let reason = "expected a line with `$` and the name of a section";
                return Err(malformed(at, &name, reason));
            }
            let end = format!("$End{name}");
            let rest = bytes.get(behind..).unwrap_or_default();
            let Some(length) = find_word(rest, end.as_bytes()) else {
                return Err(malformed(at, &name, format!("it has no {end}")));
            };
            if sections.iter().any(|s| s.name == name) && ONCE.contains(&name.as_str()) {
                return Err(malformed(at, &name, "the file has it twice"));
            }
            let content = behind..behind + length;
            at = content.end + end.len();
            sections.push(FileSection { name, content });
        }
        Ok(Self(sections))
    }

    /// Range of the content of a section.
    pub fn content(&self, name: &str) -> Option<Range<usize>> {
        let section = self.0.iter().find(|s| s.name == name);
        section.map(|s| s.content.clone())
    }

    /// Range of the content of a section that a file must have.
    ///
    /// # Errors
    /// The file does not have it.
    pub fn needed(&self, section: &'static str) -> Result<Range<usize>, MeshError> {
        let missing = MeshError::MissingSection { section };
        self.content(section).ok_or(missing)
    }

    /// Version and encoding of the file.
    ///
    /// # Errors
    /// The header is missing or not understood.
    pub fn format(&self, bytes: &[u8]) -> Result<MshHeader, MeshError> {
        let content = self.content("MeshFormat").ok_or(MeshError::NotMsh)?;
        let content = bytes[content].trim_ascii_start();
        let end = content.iter().position(|&b| b == b'\n');
        let end = end.unwrap_or(content.len());
        let line = String::from_utf8_lossy(&content[..end.min(80)]);
        let line = line.trim().to_owned();
        let words: Vec<&str> = line.split_whitespace().collect();
        let encoding = match words[..] {
            [_, "0", "8"] => Some(Encoding::Ascii),
            [_, "1", "8"] => match content.get(end + 1..end + 5) {
                Some([1, 0, 0, 0]) => Some(Encoding::LittleEndian),
                Some([0, 0, 0, 1]) => Some(Encoding::BigEndian),
                _ => None,
            },
            _ => None,
        };
        let version = words.first().and_then(|word| word.parse().ok());
        match version.zip(encoding) {
            Some((version, encoding)) => Ok(MshHeader { version, encoding }),
            None => Err(MeshError::Header { line }),
        }
    }
}

/// Names of groups by (dimension, tag).
pub(super) type Names = BTreeMap<(u8, u32), String>;

/// Dimension of names that hold for every dimension, as in MSH 2.0.
pub(super) const ANY_DIMENSION: u8 = u8::MAX;

/// Names in `$PhysicalNames`, which is text even in binary files.
pub(super) fn physical_names(
    bytes: &[u8],
    sections: &Sections,
    version: f64,
) -> Result<Names, MeshError> {
    let Some(content) = sections.content("PhysicalNames") else {
        return Ok(Names::new());
    };
    let text = String::from_utf8_lossy(&bytes[content]);
    let mut lines = text.lines().map(str::trim).filter(|l| !l.is_empty());
    let said = lines.next().unwrap_or("nothing").to_string();
    let mut names = Names::new();
    for line in lines {
        let parsed_name = match version {
            2.0 => physical_name(&format!("{ANY_DIMENSION} {line}")),
            _ => physical_name(line).filter(|((dimension, _), _)| *dimension <= 3),
        };
        let (key, name) = parsed_name.ok_or_else(|| MeshError::PhysicalName {
            line: line.chars().take(80).collect(),
        })?;
        if names.insert(key, name).is_some() {
            return Err(MeshError::TagTwice {
                what: "physical",
                tag: key.1.into(),
            });
        }
    }
    if said.parse() != Ok(names.len()) {
        return Err(MeshError::PhysicalNameCount {
            said,
            found: names.len(),
        });
    }
    Ok(names)
}

fn physical_name(line: &str) -> Option<((u8, u32), String)> {
    let blank = char::is_whitespace;
    let (dimension, rest) = line.split_once(blank)?;
    let (tag, rest) = rest.trim_start().split_once(blank)?;
    let name = rest.trim().strip_prefix('"')?.strip_suffix('"')?;
    let key = (dimension.parse().ok()?, tag.parse().ok()?);
    Some((key, name.to_string()))
}
