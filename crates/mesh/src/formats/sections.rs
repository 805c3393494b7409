//! Parts of an MSH file that are read, checked or changed before `mshio` reads it.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use crate::MeshError;

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Encoding of the numbers of a file of this `version`.
pub(super) fn encoding(bytes: &[u8], version: &str) -> Result<Encoding, MeshError> {
    let rest = bytes
        .strip_prefix(b"$MeshFormat")
        .and_then(skip_line_end)
        .ok_or(MeshError::NotMsh)?;
    let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
    let line = String::from_utf8_lossy(&rest[..end.min(80)])
        .trim()
        .to_string();
    let words: Vec<&str> = line.split_whitespace().collect();
    match words[..] {
        [found, "0", "8"] if found == version => Ok(Encoding::Ascii),
        [found, "1", "8"] if found == version => match rest.get(end + 1..end + 5) {
            Some([1, 0, 0, 0]) => Ok(Encoding::LittleEndian),
            Some([0, 0, 0, 1]) => Ok(Encoding::BigEndian),
            _ => Err(MeshError::Header { line }),
        },
        [found, "0" | "1", _] if found != version && found.parse::<f64>().is_ok() => {
            Err(MeshError::Version {
                found: found.to_string(),
            })
        }
        _ => Err(MeshError::Header { line }),
    }
}

fn skip_line_end(bytes: &[u8]) -> Option<&[u8]> {
    bytes
        .strip_prefix(b"\r\n")
        .or_else(|| bytes.strip_prefix(b"\n"))
}

fn find(haystack: &[u8], needle: &[u8]) -> Option<usize> {
    haystack.windows(needle.len()).position(|w| w == needle)
}

/// Section after the header of the file.
pub(super) struct Section {
    name: String,
    /// Range from the `$` of its name to the end of its `$End`.
    whole: Range<usize>,
    /// Range between the line of its name and its `$End`.
    content: Range<usize>,
}

/// All sections up to the end of the file, in their order. Text inside a section that looks like
/// the beginning of another one does not count.
pub(super) fn sections(bytes: &[u8]) -> Result<Vec<Section>, MeshError> {
    const HEADER_END: &[u8] = b"$EndMeshFormat";
    let malformed = |byte: usize, name: &str, reason: String| MeshError::Malformed {
        byte,
        at: format!("section ${name}"),
        reason,
    };
    let mut at = match find(bytes, HEADER_END) {
        Some(at) => at + HEADER_END.len(),
        None => {
            let reason = "it has no $EndMeshFormat".to_string();
            return Err(malformed(bytes.len(), "MeshFormat", reason));
        }
    };
    let mut found: Vec<Section> = Vec::new();
    loop {
        let blanks = bytes[at..].iter().take_while(|b| b.is_ascii_whitespace());
        at += blanks.count();
        if at == bytes.len() {
            return Ok(found);
        }
        let rest = bytes[at..].strip_prefix(b"$").unwrap_or_default();
        let letters = rest.iter().take_while(|b| b.is_ascii_alphabetic()).count();
        let (name, behind) = rest.split_at(letters);
        let name = String::from_utf8_lossy(name).into_owned();
        let Some(content) = skip_line_end(behind) else {
            return Err(MeshError::Malformed {
                byte: at,
                at: "between the sections".to_string(),
                reason: "expected a line with `$` and the name of a section".to_string(),
            });
        };
        let end = format!("$End{name}");
        let Some(length) = find(content, end.as_bytes()) else {
            return Err(malformed(at, &name, format!("it has no {end}")));
        };
        if found.iter().any(|s| s.name == name) && USED.contains(&name.as_str()) {
            return Err(malformed(at, &name, "the file has it twice".to_string()));
        }
        let begin = bytes.len() - content.len();
        let content = begin..begin + length;
        let whole = at..content.end + end.len();
        at = whole.end;
        found.push(Section {
            name,
            whole,
            content,
        });
    }
}

/// Range of the content of a section.
pub(super) fn content(sections: &[Section], name: &str) -> Option<Range<usize>> {
    let section = sections.iter().find(|s| s.name == name);
    section.map(|s| s.content.clone())
}

/// Sections whose content counts: those that mshio reads, and the names of the groups.
const USED: [&str; 4] = ["Entities", "Nodes", "Elements", "PhysicalNames"];

/// Overwrites all sections that mshio does not read with blanks, so that the others keep their
/// positions.
pub(super) fn blank_other_sections(bytes: &mut [u8], sections: &[Section]) {
    let is_read = |s: &&Section| USED[..3].contains(&s.name.as_str());
    for section in sections.iter().filter(|s| !is_read(s)) {
        bytes[section.whole.clone()].fill(b' ');
    }
}

/// Four counts at the head of `$Nodes` and `$Elements` (blocks, total, lowest and highest tag) and
/// the range of the last one.
fn section_header(
    bytes: &[u8],
    encoding: Encoding,
    sections: &[Section],
    section: &'static str,
) -> Result<([u64; 4], Range<usize>), MeshError> {
    let missing = || MeshError::MissingSection { section };
    let content = content(sections, section).ok_or_else(missing)?;
    let bytes = &bytes[..content.end];
    let mut counts = [0; 4];
    let mut at = content.start..content.start;
    for count in &mut counts {
        if encoding == Encoding::Ascii {
            let is_space = |b: &u8| b.is_ascii_whitespace();
            let from = bytes[at.end..].iter().position(|b| !is_space(b));
            let from = at.end + from.ok_or_else(missing)?;
            let len = bytes[from..]
                .iter()
                .position(is_space)
                .ok_or_else(missing)?;
            at = from..from + len;
            *count = std::str::from_utf8(&bytes[at.clone()])
                .ok()
                .and_then(|word| word.parse().ok())
                .ok_or_else(|| MeshError::Malformed {
                    byte: from,
                    at: format!("header of ${section}"),
                    reason: "expected four whole numbers".to_string(),
                })?;
        } else {
            at = at.end..at.end + 8;
            let word = bytes.get(at.clone()).ok_or_else(missing)?;
            let word: [u8; 8] = word.try_into().map_err(|_| missing())?;
            *count = match encoding {
                Encoding::BigEndian => u64::from_be_bytes(word),
                _ => u64::from_le_bytes(word),
            };
        }
    }
    Ok((counts, at))
}

/// Refuses an empty section, because mshio subtracts one from the total.
pub(super) fn check_elements_header(
    bytes: &[u8],
    encoding: Encoding,
    sections: &[Section],
) -> Result<(), MeshError> {
    match section_header(bytes, encoding, sections, "Elements")?.0 {
        [_, 0, ..] => Err(MeshError::Empty { what: "elements" }),
        _ => Ok(()),
    }
}

/// Raises the highest node tag in the header of `$Nodes`, so that mshio takes the tags for sparse
/// and keeps them. Returns the file's own highest tag.
pub(super) fn keep_node_tags(
    bytes: &mut Vec<u8>,
    encoding: Encoding,
    sections: &[Section],
) -> Result<u64, MeshError> {
    let ([_, total, min, max], at) = section_header(bytes, encoding, sections, "Nodes")?;
    if total == 0 {
        return Err(MeshError::Empty { what: "nodes" });
    }
    if min == 0 || max < min || u64::MAX - min < total {
        return Err(MeshError::Malformed {
            byte: at.start,
            at: "header of $Nodes".to_string(),
            reason: format!("{total} nodes with tags from {min} to {max}"),
        });
    }
    if encoding == Encoding::Ascii {
        bytes.splice(at, u64::MAX.to_string().into_bytes());
    } else {
        bytes[at].fill(0xff); // u64::MAX, in either byte order
    }
    Ok(max)
}

pub(super) type Names = BTreeMap<(u8, u32), String>;

/// Names in `$PhysicalNames`, which is text in binary files, too, by (dimension, tag).
pub(super) fn physical_names(bytes: &[u8], sections: &[Section]) -> Result<Names, MeshError> {
    let Some(content) = content(sections, "PhysicalNames") else {
        return Ok(Names::new());
    };
    let text = String::from_utf8_lossy(&bytes[content]);
    let mut lines = text.lines().map(str::trim).filter(|l| !l.is_empty());
    let said = lines.next().unwrap_or("nothing").to_string();
    let mut names = Names::new();
    let mut seen = HashSet::new();
    for line in lines {
        let (key, name) = physical_name(line).ok_or_else(|| MeshError::PhysicalName {
            line: line.chars().take(80).collect(),
        })?;
        if !seen.insert(name.clone()) {
            return Err(MeshError::GroupNameTwice { name });
        }
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
    let (dimension, rest) = line.split_once(' ')?;
    let (tag, rest) = rest.trim_start().split_once(' ')?;
    let name = rest.trim().strip_prefix('"')?.strip_suffix('"')?;
    let dimension = dimension.parse().ok().filter(|d| *d <= 3)?;
    Some(((dimension, tag.parse().ok()?), name.to_string()))
}
