//! Tags of a VTU file, and the positions of the numbers of its arrays.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::MeshError;

/// Type of the numbers of an array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scalar {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Self::Signed(1),
            "Int16" => Self::Signed(2),
            "Int32" => Self::Signed(4),
            "Int64" => Self::Signed(8),
            "UInt8" => Self::Unsigned(1),
            "UInt16" => Self::Unsigned(2),
            "UInt32" => Self::Unsigned(4),
            "UInt64" => Self::Unsigned(8),
            "Float32" => Self::Float(4),
            "Float64" => Self::Float(8),
            _ => return None,
        })
    }

    /// Number of bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) | Self::Float(size) => size,
        }
    }
}

/// Position of the numbers of an array.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum ArrayPosition {
    /// Text between the tags.
    Ascii,
    /// Base64 between the tags.
    Binary,
    /// Number of bytes after the beginning of the appended data.
    Appended(usize),
}

/// One array.
#[derive(Debug, Clone)]
pub(super) struct Array<'a> {
    pub name: String,
    /// Type of its numbers; `None` if the type is not one of numbers.
    pub scalar: Option<Scalar>,
    pub components: usize,
    pub place: ArrayPosition,
    /// Text between its tags.
    pub text: Vec<&'a [u8]>,
}

/// One part of the grid.
#[derive(Debug, Clone, Default)]
pub(super) struct Piece<'a> {
    pub points: usize,
    pub cells: usize,
    pub positions: Vec<Array<'a>>,
    pub topology: Vec<Array<'a>>,
    pub point_data: Vec<Array<'a>>,
    pub cell_data: Vec<Array<'a>>,
}

/// A whole file.
#[derive(Debug, Clone, Default)]
pub(super) struct File<'a> {
    pub big_endian: bool,
    /// True if the numbers before an array have eight bytes, not four.
    pub wide_header: bool,
    /// True if the arrays are compressed by zlib.
    pub compressed: bool,
    pub pieces: Vec<Piece<'a>>,
    /// Size of the file, bytes.
    pub size: usize,
    /// Data after the `_` of the appended data, and whether they are base64.
    pub appended: Option<(&'a [u8], bool)>,
}

/// Error in the text of the file.
pub(super) fn xml_error(reason: impl Into<String>) -> MeshError {
    let reason = reason.into();
    MeshError::Vtu { reason }
}

fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    bytes.windows(word.len()).position(|w| w == word)
}

/// Reads the tags.
///
/// # Errors
/// Bytes that are not a VTU file, or a file of another kind.
pub(super) fn read(bytes: &[u8]) -> Result<File<'_>, MeshError> {
    let (head, appended) = match find(bytes, b"<AppendedData") {
        Some(at) => (&bytes[..at], Some(appended(&bytes[at..])?)),
        None => (bytes, None),
    };
    let mut file = File {
        appended,
        size: bytes.len(),
        ..File::default()
    };
    let mut reader = Reader::from_reader(head);
    let mut open: Vec<String> = Vec::new();
    let mut seen = false;
    loop {
        let event = reader.read_event().map_err(|e| xml_error(e.to_string()))?;
        match event {
            Event::Start(tag) => {
                let name = name_of(&tag);
                file.open_element(&open, &name, &tag)?;
                seen |= name == "VTKFile";
                open.push(name);
            }
            Event::Empty(tag) => file.open_element(&open, &name_of(&tag), &tag)?,
            Event::End(_) => {
                open.pop();
            }
            Event::Text(text) => {
                let in_input: &[u8] = match text.into_inner() {
                    std::borrow::Cow::Borrowed(inner) => inner,
                    std::borrow::Cow::Owned(_) => {
                        return Err(xml_error("text that cannot be read"));
                    }
                };
                if let Some(array) = file.array_at(&open) {
                    array.text.push(in_input);
                }
            }
            Event::Eof => break,
            _ => {}
        }
    }
    if !seen {
        return Err(xml_error("it has no <VTKFile>"));
    }
    // The appended data are inside <VTKFile>.
    if open.len() > usize::from(file.appended.is_some()) {
        return Err(xml_error(format!(
            "<{}> is not closed",
            open[open.len() - 1]
        )));
    }
    Ok(file)
}

fn name_of(tag: &BytesStart<'_>) -> String {
    String::from_utf8_lossy(tag.name().as_ref()).into_owned()
}

/// Appended data after their `_`, and whether they are base64.
fn appended(bytes: &[u8]) -> Result<(&[u8], bool), MeshError> {
    let cut = || xml_error("<AppendedData> is cut off");
    let end = find(bytes, b">").ok_or_else(cut)?;
    let tag = String::from_utf8_lossy(&bytes[..end]).to_lowercase();
    let base64 = tag.contains("base64");
    let content = &bytes[end + 1..];
    let begin = find(content, b"_").ok_or_else(cut)?;
    Ok((&content[begin + 1..], base64))
}

/// Value of an attribute, which a tag has at most once. The reader's own check for attributes that
/// repeat compares each with all others, in quadratic time.
fn attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, MeshError> {
    let mut value = None;
    for attribute in tag.attributes().with_checks(false) {
        let attribute = attribute.map_err(|e| xml_error(e.to_string()))?;
        if attribute.key.as_ref() != name.as_bytes() {
            continue;
        }
        if value.is_some() {
            return Err(xml_error(format!("a tag has the attribute {name} twice")));
        }
        let text = attribute.unescape_value();
        value = Some(text.map_err(|e| xml_error(e.to_string()))?.into_owned());
    }
    Ok(value)
}

/// Number in an attribute, which must not be negative.
fn count(tag: &BytesStart<'_>, name: &str) -> Result<Option<usize>, MeshError> {
    let value = attribute(tag, name)?;
    let number = |text: String| match text.trim().parse() {
        Ok(number) => Ok(number),
        Err(_) => Err(xml_error(format!("{name}=\"{text}\" is not a number"))),
    };
    value.map(number).transpose()
}

impl<'a> File<'a> {
    fn open_element(
        &mut self,
        open: &[String],
        name: &str,
        tag: &BytesStart<'_>,
    ) -> Result<(), MeshError> {
        match name {
            "VTKFile" => self.header(tag),
            "Piece" => {
                let points = count(tag, "NumberOfPoints")?.unwrap_or(0);
                let cells = count(tag, "NumberOfCells")?.unwrap_or(0);
                self.pieces.push(Piece {
                    points,
                    cells,
                    ..Piece::default()
                });
                Ok(())
            }
            "DataArray" => {
                let section = open.last().map(String::as_str);
                let Some(arrays) = self.section(section.unwrap_or_default()) else {
                    return Ok(()); // of the whole grid
                };
                arrays.push(array(tag)?);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn header(&mut self, tag: &BytesStart<'_>) -> Result<(), MeshError> {
        let kind = attribute(tag, "type")?.unwrap_or_default();
        if kind != "UnstructuredGrid" {
            return Err(MeshError::VtuKind { found: kind });
        }
        self.big_endian = attribute(tag, "byte_order")?.as_deref() == Some("BigEndian");
        self.wide_header = attribute(tag, "header_type")?.as_deref() == Some("UInt64");
        self.compressed = match attribute(tag, "compressor")?.as_deref() {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                let found = other.to_owned();
                return Err(MeshError::VtuCompressor { found });
            }
        };
        Ok(())
    }

    /// Arrays of a section of the part of the grid that is open.
    fn section(&mut self, name: &str) -> Option<&mut Vec<Array<'a>>> {
        let piece = self.pieces.last_mut()?;
        Some(match name {
            "Points" => &mut piece.positions,
            "Cells" => &mut piece.topology,
            "PointData" => &mut piece.point_data,
            "CellData" => &mut piece.cell_data,
            _ => return None,
        })
    }

    /// Array that is open.
    fn array_at(&mut self, open: &[String]) -> Option<&mut Array<'a>> {
        let section = open.len().checked_sub(2).map(|i| open[i].clone())?;
        self.section(&section)?.last_mut()
    }
}

fn array<'a>(tag: &BytesStart<'_>) -> Result<Array<'a>, MeshError> {
    let name = attribute(tag, "Name")?.unwrap_or_default();
    let scalar = attribute(tag, "type")?.unwrap_or_default();
    let format = attribute(tag, "format")?.unwrap_or_default();
    let place = match format.to_lowercase().as_str() {
        "ascii" => ArrayPosition::Ascii,
        "binary" => ArrayPosition::Binary,
        "appended" => ArrayPosition::Appended(count(tag, "offset")?.unwrap_or(0)),
        _ => {
            return Err(xml_error(format!(
                "the array `{name}` has the format `{format}`, not ascii, binary or appended"
            )));
        }
    };
    Ok(Array {
        name,
        scalar: Scalar::named(&scalar),
        components: count(tag, "NumberOfComponents")?.unwrap_or(1).max(1),
        place,
        text: Vec::new(),
    })
}
