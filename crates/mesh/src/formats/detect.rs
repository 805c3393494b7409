//! Detection of the format of a mesh file by its contents, and by its name where these do not
//! suffice.

use std::path::Path;

use super::msh2;
use crate::MeshError;

/// Bytes at the beginning of a file that are searched for words.
const HEAD: usize = 4000;

/// Format that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Gmsh's MSH 4, and the rest of that family, whose faults its reader reports.
    Msh4,
    /// Gmsh's MSH 2.
    Msh2,
    /// A deck of Abaqus or CalculiX.
    Deck,
    /// An archive of Ansys Mechanical APDL, or an input file in its form.
    Ansys,
    /// Bulk data of Nastran.
    Nastran,
    /// VTK's XML file of an unstructured grid.
    Vtu,
}

/// Detects the format of a file.
///
/// # Errors
/// A format that is not read, with the program that converts it.
pub fn detect(bytes: &[u8], name: &str) -> Result<Format, MeshError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.trim_ascii().is_empty() {
        return Err(MeshError::NoBytes);
    }
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]).into_owned();
    let start = head.trim_start();
    if let Some(version) = version_of_msh(bytes) {
        return Ok(match msh2::is_version_2(version) {
            true => Format::Msh2,
            false => Format::Msh4,
        });
    }
    if start.starts_with("<VTKFile") || (start.starts_with("<?xml") && head.contains("<VTKFile")) {
        return Ok(Format::Vtu);
    }
    if is_archive(bytes) {
        return Ok(Format::Ansys);
    }
    let other = match first_keyword(bytes) {
        Some(keyword) if keyword.to_ascii_uppercase().starts_with(b"KEYWORD") => Other::LsDyna,
        Some(_) => return Ok(Format::Deck),
        None => {
            if head.starts_with("version https://git-lfs") {
                return Err(Other::Pointer.error(name));
            }
            let by_name = detect_name(name);
            let is_text = detect_content(bytes, &head).is_none();
            if is_text && has_ending(name, &["cdb"]) {
                return Ok(Format::Ansys);
            }
            if is_text && (is_bulk_data(bytes) || has_ending(name, &["bdf", "nas", "dat", "fem"])) {
                return Ok(Format::Nastran);
            }
            if is_text && is_deck_below_text(bytes) {
                return Ok(Format::Deck);
            }
            let by_content = detect_content(bytes, &head).filter(|found| {
                // MED, CGNS and others are HDF5 files.
                *found != Other::Hdf || by_name.is_none()
            });
            by_content.or(by_name).ok_or(MeshError::UnknownFormat)?
        }
    };
    Err(other.error(name))
}

/// Version of a file of Gmsh, `NaN` if the header has none. Other sections, such as `$Comments`, and
/// lines of text may precede the header.
fn version_of_msh(bytes: &[u8]) -> Option<f64> {
    let mut lines = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    lines.find(|line| *line == b"$MeshFormat")?;
    let line = String::from_utf8_lossy(lines.next().unwrap_or_default());
    let version = line
        .split_whitespace()
        .next()
        .and_then(|word| word.parse().ok());
    Some(version.unwrap_or(f64::NAN))
}

/// Returns `true` for an archive of Ansys, which has blocks of nodes or elements, or for another
/// input file that begins as its files do.
fn is_archive(bytes: &[u8]) -> bool {
    let begins = |line: &[u8], words: &[&[u8]]| {
        let line = line.trim_ascii_start();
        words.iter().any(|word| {
            let start = line.get(..word.len());
            start.is_some_and(|start| start.eq_ignore_ascii_case(word))
        })
    };
    let head = &bytes[..bytes.len().min(HEAD)];
    let mut lines = bytes.split(|b| *b == b'\n');
    let mut of_head = head.split(|b| *b == b'\n');
    // The geometry that CDWRITE writes to a file of its own begins with the same commands.
    lines.any(|line| begins(line, &[b"NBLOCK,", b"EBLOCK,"]))
        || of_head.any(|line| begins(line, &[b"/PREP7", b"/COM,ANSYS", b"/BATCH"]))
            && !is_iges(bytes)
}

/// Returns `true` for bulk data of Nastran: a line is a node, or separates sections.
fn is_bulk_data(bytes: &[u8]) -> bool {
    bytes.split(|b| *b == b'\n').any(|line| {
        let line = line[..line.len().min(10)].to_ascii_uppercase();
        let rest = line.strip_prefix(b"GRID").and_then(|rest| rest.first());
        rest.is_some_and(|b| b" ,*\t".contains(b))
            || [&b"BEGIN BULK"[..], b"CEND"].contains(&line.trim_ascii())
    })
}

/// Returns `true` if text without a keyword precedes the lines of a deck; CalculiX skips it.
fn is_deck_below_text(bytes: &[u8]) -> bool {
    const WORDS: [&[u8]; 6] = [
        b"NODE",
        b"ELEMENT",
        b"HEADING",
        b"PART",
        b"INCLUDE",
        b"ASSEMBLY",
    ];
    let lines = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let mut keywords = lines.filter_map(|line| line.strip_prefix(b"*"));
    keywords.any(|line| {
        let word = line
            .split(|b| !b.is_ascii_alphabetic())
            .next()
            .unwrap_or_default();
        WORDS.contains(&&*word.to_ascii_uppercase())
    })
}

/// First line that is neither empty nor a comment, if it is a keyword of a deck.
fn first_keyword(bytes: &[u8]) -> Option<&[u8]> {
    let lines = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let first = lines
        .into_iter()
        .find(|line| !line.is_empty() && !line.starts_with(b"**"))?;
    let word = first.strip_prefix(b"*")?.trim_ascii_start();
    word.first()
        .filter(|b| b.is_ascii_alphabetic())
        .map(|_| word)
}

/// Format that another program converts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Other {
    OldMsh,
    GmshScript,
    Universal,
    Med,
    Geometry,
    Triangles,
    LegacyVtk,
    Exodus,
    Xdmf,
    Cgns,
    Medit,
    LsDyna,
    Hdf,
    Pointer,
}

impl Other {
    fn description(self) -> &'static str {
        match self {
            Self::OldMsh => "a Gmsh mesh of version 1",
            Self::GmshScript => "a Gmsh script",
            Self::Universal => "an I-DEAS universal file",
            Self::Med => "a MED file of SALOME",
            Self::Geometry => "a geometry (STEP, IGES or BREP) and no mesh",
            Self::Triangles => "a surface of triangles (STL) without a volume",
            Self::LegacyVtk => "a legacy VTK file",
            Self::Exodus => "an Exodus file",
            Self::Xdmf => "an XDMF file",
            Self::Cgns => "a CGNS file",
            Self::Medit => "a Medit mesh",
            Self::LsDyna => "a deck of LS-DYNA",
            Self::Hdf => "an HDF5 file",
            Self::Pointer => "a pointer of Git LFS, not the file",
        }
    }

    /// Error that says which program converts the file `name`.
    fn error(self, name: &str) -> MeshError {
        let path = Path::new(name);
        let [file, stem] = [path.file_name(), path.file_stem()]
            .map(|part| part.map_or("mesh".into(), |n| n.to_string_lossy()));
        let remedy = match self {
            Self::OldMsh => format!("convert it: `gmsh -0 {file} -format msh41 -o {stem}_41.msh`"),
            Self::GmshScript => format!(
                "give it as mesh.geometry, or mesh it: `gmsh -3 {file} -format msh41 -o {stem}.msh`"
            ),
            Self::Pointer => "fetch the file: `git lfs pull`".to_owned(),
            Self::Universal => format!(
                "convert it with its groups: `gmsh -0 {file} -format msh41 -o {stem}.msh`, or write a deck of Abaqus in the program that made it"
            ),
            Self::LsDyna => format!(
                "convert it with its parts by the Python package lsdyna-mesh-reader: `lsdyna_mesh_reader.Deck(\"{file}\").to_grid().save(\"{stem}.vtu\")`"
            ),
            Self::Geometry => format!(
                "mesh it by a Gmsh script with the lines `SetFactory(\"OpenCASCADE\"); Merge \"{file}\"; Physical Volume(\"part\") = Volume{{:}};`, given as mesh.geometry"
            ),
            Self::Triangles => format!(
                "mesh its inside by a Gmsh script with the lines `Merge \"{file}\"; Surface Loop(1) = Surface{{:}}; Volume(1) = {{1}}; Physical Volume(\"part\") = {{1}};`, given as mesh.geometry"
            ),
            Self::Med
            | Self::LegacyVtk
            | Self::Exodus
            | Self::Xdmf
            | Self::Cgns
            | Self::Medit
            | Self::Hdf => format!("convert it: `meshio convert {file} {stem}.vtu`"),
        };
        let what = self.description();
        MeshError::OtherFormat { what, remedy }
    }
}

/// Format that the first bytes indicate.
fn detect_content(bytes: &[u8], head: &str) -> Option<Other> {
    let start = head.trim_start();
    let begins = |words: &[&str]| words.iter().any(|word| start.starts_with(word));
    if bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        return Some(Other::Hdf);
    }
    if matches!(bytes, [b'C', b'D', b'F', 1 | 2 | 5, ..]) {
        return Some(Other::Exodus);
    }
    if begins(&["ISO-10303-21", "DBRep_DrawableShape", "CASCADE Topology"]) || is_iges(bytes) {
        return Some(Other::Geometry);
    }
    if start.starts_with("solid") && head.contains("facet") {
        return Some(Other::Triangles);
    }
    if begins(&["# vtk DataFile"]) {
        return Some(Other::LegacyVtk);
    }
    if head.contains("<Xdmf") {
        return Some(Other::Xdmf);
    }
    if begins(&["MeshVersionFormatted"]) {
        return Some(Other::Medit);
    }
    if start
        .lines()
        .next()
        .is_some_and(|line| line.trim_end() == "$NOD")
    {
        return Some(Other::OldMsh);
    }
    let mut words = start.split_whitespace();
    let dataset = |word: &str| word.parse::<u32>().is_ok();
    if words.next() == Some("-1") && words.next().is_some_and(dataset) {
        return Some(Other::Universal);
    }
    let lines = || head.lines().map(str::trim_start);
    let is_line =
        |words: &[&str]| lines().any(|line| words.iter().any(|word| line.starts_with(word)));
    is_line(&["*KEYWORD"]).then_some(Other::LsDyna)
}

/// Returns `true` for an IGES file: every line has 80 letters, and the 73rd of the first ones is an
/// S.
fn is_iges(bytes: &[u8]) -> bool {
    let line = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    let line = line.strip_suffix(b"\r").unwrap_or(line);
    line.len() == 80 && line[72] == b'S' && line[73..].trim_ascii() == b"1"
}

/// Returns `true` if the name has one of these endings.
fn has_ending(name: &str, endings: &[&str]) -> bool {
    let ending = Path::new(name)
        .extension()
        .and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| endings.iter().any(|e| e.eq_ignore_ascii_case(ending)))
}

/// Format that the ending of the name indicates.
fn detect_name(name: &str) -> Option<Other> {
    let ending = Path::new(name).extension()?.to_str()?.to_lowercase();
    Some(match ending.as_str() {
        "geo" | "geo_unrolled" => Other::GmshScript,
        "unv" => Other::Universal,
        "med" => Other::Med,
        "step" | "stp" | "igs" | "iges" | "brep" => Other::Geometry,
        "stl" => Other::Triangles,
        "vtk" => Other::LegacyVtk,
        "e" | "exo" | "ex2" => Other::Exodus,
        "xdmf" | "xmf" => Other::Xdmf,
        "cgns" => Other::Cgns,
        "mesh" | "meshb" => Other::Medit,
        "k" | "key" => Other::LsDyna,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{GROUPS, elements};
    use super::super::{Content, parse};
    use super::*;
    use dovetail_testkit::words::{cases, has};

    fn none(name: &str) -> Result<Vec<u8>, MeshError> {
        panic!("{name} is included");
    }

    fn message(bytes: &[u8], name: &str) -> String {
        parse(bytes, name, &mut none).unwrap_err().to_string()
    }

    #[test]
    fn formats_are_known_by_what_they_hold() {
        // CDWRITE puts the geometry before the mesh.
        let geometry = format!("{:<72}S      1\n/PREP7\nNBLOCK,6\n", "/TITLE,a");
        let files: [(&[u8], Format); 16] = [
            (elements!("order2.msh"), Format::Msh4),
            (elements!("order2_msh2.msh"), Format::Msh2),
            (elements!("order2_msh2_binary.msh"), Format::Msh2),
            (elements!("order2.inp"), Format::Deck),
            (elements!("order1_meshio.vtu"), Format::Vtu),
            (elements!("order2_raw.vtu"), Format::Vtu),
            (b"** a comment\n\n  * node, nset=KEYWORD\n", Format::Deck),
            (b"\xef\xbb\xbf<?xml version=\"1.0\"?>\n<!-- mine -->\n<VTKFile type=\"UnstructuredGrid\">", Format::Vtu),
            (b"!\nNBLOCK,6,SOLID\n", Format::Ansys),
            (b"*SET,A,1\n  eblock,10,,,3\n", Format::Ansys),
            (b"/COM,ANSYS\n/PREP7\n", Format::Ansys),
            (geometry.as_bytes(), Format::Ansys),
            (b"CEND\nBEGIN BULK\nGRID,1\n", Format::Nastran),
            (b"$ comment\nGRID    1\n", Format::Nastran),
            (b"$NODES\nGRID*   1\n", Format::Nastran),
            (b"grid\t1\n*NODE1  2\n", Format::Nastran),
        ];
        for (bytes, format) in files {
            // The ending is that of another format: it does not count.
            assert_eq!(detect(bytes, "mesh.stl").unwrap(), format);
        }
        let named = [
            ("a.cdb", Format::Ansys),
            ("b.NAS", Format::Nastran),
            ("c.dat", Format::Nastran),
        ];
        for (name, format) in named {
            assert_eq!(detect(b"unknown", name).unwrap(), format, "{name}");
        }
        let newer = b"$MeshFormat\n5 0 8\n$EndMeshFormat\n";
        assert!(message(newer, "a.msh").starts_with("MSH version 5 is not read, only 4.1, 4.0"));
    }

    /// Files of one geometry that gmsh wrote in four formats: the same nodes, elements and groups.
    #[test]
    fn all_formats_give_the_same_mesh() {
        let four: [[(&[u8], &str); 4]; 2] = [
            [
                (elements!("order1.msh"), "4.1"),
                (elements!("order1_msh2.msh"), "2.2"),
                (elements!("order1_msh2_binary.msh"), "2.2 binary"),
                (elements!("order1_binary.vtu"), "vtu"),
            ],
            [
                (elements!("order2.msh"), "4.1"),
                (elements!("order2_msh2.msh"), "2.2"),
                (elements!("order2_msh2_binary.msh"), "2.2 binary"),
                (elements!("order2_raw.vtu"), "vtu"),
            ],
        ];
        for files in four {
            let contents =
                files.map(|(bytes, name)| (parse(bytes, name, &mut none).unwrap(), name));
            let (first, _) = &contents[0];
            for (other, name) in &contents[1..] {
                for group in GROUPS.into_iter().chain(["edge"]) {
                    let expected = described(first, group);
                    assert_eq!(described(other, group), expected, "{name}, {group}");
                }
            }
        }
    }

    /// Position of a node, rounded.
    type At = [i64; 3];

    /// Dimension of a group, the positions of the nodes of its elements, and those of all its
    /// nodes.
    fn described(content: &Content, group: &str) -> (u8, Vec<Vec<At>>, Vec<At>) {
        let group = &content.groups[group];
        let list = match group.dimension {
            3 => &content.elements,
            _ => &content.facets,
        };
        let at = |nodes: &[u32]| -> Vec<At> {
            let round = |x: f64| (x * 1e6).round() as i64;
            nodes
                .iter()
                .map(|n| content.nodes[*n as usize].map(round))
                .collect()
        };
        let mut elements: Vec<_> = group
            .elements
            .iter()
            .map(|e| at(list.element_nodes(*e as usize)))
            .collect();
        elements.sort();
        let mut nodes = at(&group.nodes);
        nodes.sort_unstable();
        nodes.dedup();
        (group.dimension, elements, nodes)
    }

    #[track_caller]
    fn is_named(bytes: &[u8], name: &str, what: &str, remedy: &str) {
        let found = message(bytes, name);
        assert!(
            found.starts_with(&format!("this is {what}")),
            "{name}: {found}"
        );
        has(&found, remedy);
    }

    #[test]
    fn other_formats_are_named_with_their_remedy() {
        let table = r#"
            unknown => c.unv => an I-DEAS universal file => gmsh
            unknown => e.exo => an Exodus file => meshio
            ISO-10303-21;\n => f.step => a geometry (STEP, IGES or BREP) and no mesh
            => Merge "f.step"; Physical Volume("part") = Volume{:};`
            \nCASCADE Topology V3 => f.txt => a geometry => OpenCASCADE
            unknown => f.IGS => a geometry => OpenCASCADE
            solid a\nfacet normal 0 0 1\n => g.txt => a surface of triangles (STL) without a volume
            => Surface Loop(1) = Surface{:}; Volume(1) = {1};
            # vtk DataFile Version 3.0\n => h.vtk => a legacy VTK file
            => `meshio convert h.vtk h.vtu`
            <?xml version="1.0"?>\n<Xdmf Version="3.0"> => i => an XDMF file => meshio
            MeshVersionFormatted 2\n => j => a Medit mesh => meshio
            $ made by\n*KEYWORD\n*NODE\n => k.k => a deck of LS-DYNA
            => `lsdyna_mesh_reader.Deck("k.k").to_grid().save("k.vtu")`
            *KEYWORD MEMORY=20\n*NODE\n => k => a deck of LS-DYNA => lsdyna
            $NOD\n3\n => l.msh => a Gmsh mesh of version 1
            => `gmsh -0 l.msh -format msh41 -o l_41.msh`
            Point(1) = {0, 0, 0};\n => m.geo => a Gmsh script
            => mesh.geometry, or mesh it: `gmsh -3 m.geo -format msh41 -o m.msh`
            version https://git-lfs.github.com/spec/v1\noid => m.vtu => a pointer of Git LFS, not the file => `git lfs pull`
            unknown => m.mesh => a Medit mesh => meshio
            unknown => m.key => a deck of LS-DYNA => lsdyna
            "#;
        for [bytes, name, what, remedy] in cases(table) {
            is_named(bytes.as_bytes(), &name, &what, &remedy);
        }
        let iges = [b"comment".as_slice(), &[b' '; 65], b"S      1\n"].concat();
        let hdf = b"\x89HDF\r\n\x1a\n";
        let universal = "an I-DEAS universal file";
        is_named(
            b"    -1\n  2411\n",
            "c",
            universal,
            "`gmsh -0 c -format msh41 -o c.msh`",
        );
        // The geometry that CDWRITE writes to a file of its own.
        let of_ansys = format!("{:<72}S      1\n/PREP7\n", "/TITLE,a");
        is_named(of_ansys.as_bytes(), "f.txt", "a geometry", "OpenCASCADE");
        is_named(hdf, "d.med", "a MED file", "`meshio convert d.med d.vtu`");
        is_named(hdf, "d.cgns", "a CGNS file", "meshio");
        is_named(hdf, "d.h5", "an HDF5 file", "meshio");
        is_named(b"CDF\x01", "e.e", "an Exodus file", "meshio");
        is_named(b"CDF\x02", "e.nc", "an Exodus file", "meshio");
        is_named(&iges, "f.txt", "a geometry", "OpenCASCADE");
        is_named(
            b"\0\0\0\0",
            "g.stl",
            "a surface of triangles",
            "Merge \"g.stl\"",
        );
        assert!(
            message(b"unknown", "mesh.xyz")
                .starts_with("the format of the mesh is not known: read are")
        );
        assert!(message(b"unknown", "").contains("meshio convert"));
        assert!(message(b" \r\n", "mesh.msh").starts_with("the file is empty"));
    }
}
