use std::collections::BTreeSet;

use super::super::fixtures::{GROUPS, assert_near, elements, nodes_of};
use super::super::msh2;
use super::*;
use dovetail_testkit::words::{cases, has};

const ORDER1: &[u8] = elements!("order1_msh2.msh");
const ORDER2: &[u8] = elements!("order2_msh2.msh");

/// Files that VTK and meshio wrote of the meshes that gmsh made, each encoded in another way.
const FILES: [(&str, &[u8], &[u8]); 8] = [
    ("ascii", elements!("order1_ascii.vtu"), ORDER1),
    ("binary", elements!("order1_binary.vtu"), ORDER1),
    ("raw, plain", elements!("order1_raw_plain.vtu"), ORDER1),
    (
        "appended, big endian",
        elements!("order1_appended_plain.vtu"),
        ORDER1,
    ),
    ("meshio", elements!("order1_meshio.vtu"), ORDER1),
    ("zlib", elements!("order2_zlib.vtu"), ORDER2),
    ("appended, zlib", elements!("order2_appended.vtu"), ORDER2),
    ("raw, zlib", elements!("order2_raw.vtu"), ORDER2),
];

#[test]
fn every_encoding_says_what_the_mesh_of_gmsh_says() {
    for (name, vtu, msh) in FILES {
        let vtu = parse(vtu).unwrap_or_else(|e| panic!("{name}: {e}"));
        let msh = msh2::parse(msh).unwrap();
        println!("{name}");
        assert_near(&vtu.nodes, &msh.nodes, 1e-9);
        // meshio gives numbers to the groups, in an array of its own.
        for (group, number) in GROUPS.into_iter().chain(["edge"]).zip(1..) {
            let in_vtu = match name {
                "meshio" => format!("gmsh:physical {number}"),
                _ => group.to_owned(),
            };
            let expected: BTreeSet<_> = nodes_of(&msh, group);
            assert_eq!(nodes_of::<BTreeSet<_>>(&vtu, &in_vtu), expected, "{group}");
            let (a, b) = (&vtu.groups[&in_vtu], &msh.groups[group]);
            assert_eq!(a.dimension, b.dimension, "{group}");
            assert_eq!(a.nodes, b.nodes, "{group}");
        }
        assert_eq!(vtu.groups["all"].elements.len(), msh.elements.len());
        assert_eq!(vtu.remarks, [""; 0], "{name}");
    }
}

/// Two tetrahedra that share a face, a triangle, a line and a vertex, after `change`.
const SMALL: &str = r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="6" NumberOfCells="5">
<PointData>
<DataArray type="Int32" Name="load" format="ascii">0 0 1 0 1 1</DataArray>
<DataArray type="Float32" Name="part" format="ascii">2 2 2 3 3 9</DataArray>
<DataArray type="Float32" Name="motion" NumberOfComponents="3" format="ascii">0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0</DataArray>
</PointData>
<CellData Scalars="part">
<DataArray type="Int8" Name="part" format="ascii">1 -2 1 5 5<InformationKey name="L2"><Value index="0">7</Value></InformationKey></DataArray>
<DataArray type="Float64" Name="stress" format="ascii">1.5 2 3 4 5</DataArray>
</CellData>
<Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" format="ascii">
0 0 0  1 0 0  0 1 0  0 0 1  1 1 1  9 9 9
</DataArray></Points>
<Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 1 2 3 4 0 1 2 0 1 4</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4 8 11 13 14</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10 10 5 3 1</DataArray>
</Cells></Piece></UnstructuredGrid></VTKFile>
"#;

fn small(changes: &[(&str, &str)]) -> Result<Content, MeshError> {
    let mut text = SMALL.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    parse(text.as_bytes())
}

#[test]
fn arrays_of_whole_numbers_are_groups() {
    let content = small(&[]).unwrap();
    let names: Vec<&str> = content.groups.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "all",
            "load",
            "load 0",
            "load 1",
            "part -2",
            "part 1 surface",
            "part 1 volume",
            "part 2 nodes",
            "part 3 nodes",
            "part 5 curve",
            "part 5 point",
        ]
    );
    let group = |name: &str| {
        let group = &content.groups[name];
        (group.dimension, group.elements.clone(), group.nodes.clone())
    };
    assert_eq!(group("all"), (3, vec![0, 1], vec![0, 1, 2, 3, 4]));
    assert_eq!(group("part 1 volume"), (3, vec![0], vec![0, 1, 2, 3]));
    assert_eq!(group("part -2"), (3, vec![1], vec![1, 2, 3, 4]));
    assert_eq!(group("part 1 surface"), (2, vec![0], vec![0, 1, 2]));
    assert_eq!(group("part 5 curve"), (1, vec![], vec![0, 1]));
    assert_eq!(group("part 5 point"), (0, vec![], vec![4]));
    assert_eq!(group("load"), (0, vec![], vec![2, 4]));
    assert_eq!(group("load 0"), (0, vec![], vec![0, 1, 3]));
    assert_eq!(group("part 3 nodes"), (0, vec![], vec![3, 4]));
    assert_eq!(
        (content.elements.tags(), content.facets.tags()),
        (&[0, 1][..], &[2][..])
    );
    let expected = [
        "Nodes that no solid element has were left out of these groups: `load` (1 of 3), `load 1` (1 of 3).",
        "These sets are no groups, as nothing in them belongs to a solid element: `part 9 nodes`.",
    ];
    assert_eq!(content.remarks, expected);
}

#[test]
fn arrays_of_too_many_values_and_those_that_number_are_no_groups() {
    let cells = |count: usize, distinct: usize| {
        let row = |word: &str| [word, " "].concat().repeat(count);
        let values: String = (0..count).map(|i| format!("{} ", i % distinct)).collect();
        let ends: String = (1..=count).map(|i| format!("{} ", 4 * i)).collect();
        let array = |kind: &str, name: &str, values: &str| {
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>"
            )
        };
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"{count}\">\
            <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>\
            <Cells>{}{}{}</Cells><CellData>{}</CellData></Piece></UnstructuredGrid></VTKFile>",
            array("Int32", "connectivity", &row("0 1 2 3")),
            array("Int32", "offsets", &ends),
            array("UInt8", "types", &row("10")),
            array("Int32", "id", &values),
        )
    };
    let remark = ["These arrays have another number everywhere and give no groups: `id`."];
    for (count, distinct, groups, remarks) in [
        (1001, 1000, 1001, &[][..]),
        (1002, 1001, 1, &[]),
        (1001, 1001, 1, &[]),
        (1000, 1000, 1, &remark),
        (40, 40, 1, &remark),
        (4, 4, 1, &remark),
        (40, 39, 40, &[]),
        (3, 3, 4, &[]),
    ] {
        let content = parse(cells(count, distinct).as_bytes()).unwrap();
        assert_eq!(content.groups.len(), groups, "{count} {distinct}");
        assert_eq!(content.remarks, remarks, "{count} {distinct}");
    }
}

/// The pieces of two files are one grid; an array that one of them lacks is left aside.
#[test]
fn an_attribute_that_is_given_twice_is_an_error() {
    let twice = SMALL.replacen("NumberOfPoints=", "NumberOfPoints=\"1\" NumberOfPoints=", 1);
    let error = parse(twice.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("NumberOfPoints twice"), "{error}");
}

#[test]
fn pieces_follow_one_another() {
    let (head, rest) = SMALL.split_once("<Piece ").unwrap();
    let (piece, tail) = rest.split_once("</Piece>").unwrap();
    let second = piece
        .replace("\"load\"", "\"other\"")
        .replace("1 -2 1 5 5", "8 8 8 8 8");
    let empty = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><Points/><Cells/></Piece>";
    let content = parse(
        format!("{head}<Piece {piece}</Piece>{empty}<Piece {second}</Piece>{tail}").as_bytes(),
    )
    .unwrap();
    assert_eq!((content.nodes.len(), content.elements.len()), (12, 4));
    assert_eq!(content.elements.element_nodes(3), [7, 8, 9, 10]);
    assert_eq!(content.groups["part 8 volume"].elements, [2, 3]);
    assert!(!content.groups.contains_key("load"));
    assert!(content.remarks[0].contains("nodes that stand in two of them are not joined"));
    assert_eq!(
        content.remarks[1],
        "The array `load` was left aside, as not every piece has it."
    );
}

/// A wedge, a voxel and a pixel: nodes in the order of VTK become ours.
#[test]
fn nodes_in_other_orders_are_turned() {
    let file = |points: &str, count: usize, cell: &str, kind: usize| {
        let nodes = cell.split(' ').count();
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"{count}\" NumberOfCells=\"1\">\
            <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{points}</DataArray></Points>\
            <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">{cell}</DataArray>\
            <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">{nodes}</DataArray>\
            <DataArray type=\"Int32\" Name=\"types\" format=\"ascii\">{kind}</DataArray></Cells>\
            </Piece></UnstructuredGrid></VTKFile>"
        )
    };
    let wedge = "0 0 0 1 0 0 0 1 0 0 0 1 1 0 1 0 1 1";
    let upright = parse(file(wedge, 6, "0 1 2 3 4 5", 13).as_bytes()).unwrap();
    assert_eq!(upright.elements.element_nodes(0), [0, 1, 2, 3, 4, 5]);
    let inside_out = parse(file(wedge, 6, "0 2 1 3 5 4", 13).as_bytes()).unwrap();
    assert_eq!(inside_out.elements.element_nodes(0), [0, 1, 2, 3, 4, 5]);
    let cube = "0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1";
    let voxel = parse(file(cube, 8, "0 1 2 3 4 5 6 7", 11).as_bytes()).unwrap();
    assert_eq!(voxel.elements.element_nodes(0), [0, 1, 3, 2, 4, 5, 7, 6]);
}

/// A turned wedge of second order keeps its middles between their corners.
#[test]
fn middles_of_a_turned_wedge_stay_on_their_edges() {
    let edges = Shape::Wedge.edges();
    for (i, [a, b]) in edges.iter().enumerate() {
        let old = edges[TURNED_WEDGE[6 + i] - 6];
        let corners = [TURNED_WEDGE[*a], TURNED_WEDGE[*b]];
        assert!(corners == old || corners == [old[1], old[0]], "{i}");
    }
}

#[test]
fn what_is_wrong_is_named() {
    let table = r#"
        type="UnstructuredGrid" => type="PolyData"
        => the VTK file holds `PolyData`, not UnstructuredGrid: open it in ParaView
        byte_order => compressor="vtkLZ4DataCompressor" byte_order
        => compressed by vtkLZ4DataCompressor, which is not read: write the file with zlib
        10 10 5 => 10 29 5 => cell 1 has VTK's type 29, which is not read
        10 10 5 => 10 42 5 => split polyhedra by ParaView's filter Tetrahedralize
        10 10 5 => 10 14 5 => cell 1 of type 14 has 4 nodes
        4 8 11 => 8 4 11 => cell 0 of type 10 has 8 nodes
        4 8 11 => 4 3 11 => the offsets of <Cells> go back at cell 1
        4 8 11 => 4 99 11 => the offsets of <Cells> go back at cell 1
        11 13 14 => 11 13 15
        => the array `connectivity` of the VTU file: it has 14 numbers, expected 15
        11 13 14 => 11 13 -1 => the last offset of <Cells> is -1
        0 1 2 3 1 => 0 1 2 7 1 => cell 0 names point 7, and its piece has 6
        0 1 2 3 1 => 0 1 2 1.5 1 => cell 0 names point 1.5
        0 1 2 3 1 => 0 1 2 -1 1 => cell 0 names point -1
        0 1 2 3 1 => 0 1 2 2 1 => element 0 names node 2 twice
        9 9 9 => 9 9 x => the array `Points` of the VTU file: `x` is not a number
        9 9 9 => 9 9 => the array `Points` of the VTU file: it has 17 numbers, expected 18
        NumberOfPoints="6" => NumberOfPoints="six" => NumberOfPoints="six" is not a number
        NumberOfPoints="6" => NumberOfPoints="9999999999999999999"
        => the array `Points` of the VTU file: it is larger than any file
        Name="types" => Name="kinds" => a piece lacks the array `types` of <Cells>
        "Points" NumberOfComponents="3" => "Points"
        => the array in <Points> has not three components
        Name="types" format="ascii" => Name="types" format="appended"
        => the array `types` of the VTU file: the file has no <AppendedData>
        Name="types" format="ascii" => Name="types" format="words"
        => the array `types` has the format `words`
        Name="types" format="ascii" => Name="types" format="binary"
        => the array `types` of the VTU file: it has 3883158999 bytes, expected 5
        type="UInt8" => type="String"
        => the array `types` of the VTU file: its type is not one of numbers
        </Piece></UnstructuredGrid></VTKFile> => </Piece> => <UnstructuredGrid> is not closed
        <VTKFile type => <File type => the VTU file is not whole
        "#;
    for [from, to, words] in cases(table) {
        has(&small(&[(&from, &to)]).unwrap_err().to_string(), &words);
    }
    let stress = "\"stress\" format=\"ascii\">1.5 2 3 4 5";
    let mark = "\"load 1\" format=\"ascii\">0 1 0 0 0";
    let found = small(&[(stress, mark)]).unwrap_err().to_string();
    has(&found, "two groups are called `load 1`");
    let table = "
        BQAAAAoKBQM= => it breaks off: 5 bytes are announced
        BQAAAAoK!QMB => it is no base64
        BQA => it breaks off: 4 bytes are announced
        ";
    for [text, words] in cases(table) {
        let binary = "Name=\"types\" format=\"binary\"";
        let changes = [
            ("Name=\"types\" format=\"ascii\"", binary),
            ("10 10 5 3 1", &text),
        ];
        has(&small(&changes).unwrap_err().to_string(), &words);
    }
    has(
        &parse(b"<a/>").unwrap_err().to_string(),
        "it has no <VTKFile>",
    );
    let none = small(&[("NumberOfCells=\"5\"", "NumberOfCells=\"0\"")]).unwrap_err();
    assert_eq!(none.to_string(), "the mesh has no solid elements");
}

/// Integers of each width, with their signs, between the tags.
#[test]
fn integers_keep_their_signs() {
    for (kind, text) in [
        ("Int8", "BQAAAAH+AQUF"),
        ("Int16", "CgAAAAEA/v8BAAUABQA="),
        ("Float32", "FAAAAAAAgD8AAADAAACAPwAAoEAAAKBA"),
    ] {
        let array = format!("\"{kind}\" Name=\"part\" format=\"binary\">{text}<");
        let content = small(&[(
            "\"Int8\" Name=\"part\" format=\"ascii\">1 -2 1 5 5<",
            &array,
        )]);
        assert_eq!(
            content.unwrap().groups,
            small(&[]).unwrap().groups,
            "{kind}"
        );
    }
}

/// Blocks of equal size have 0 for the size of the last; a block of another size is an error.
#[test]
fn blocks_have_the_size_that_is_announced() {
    use base64::Engine;
    use std::io::Write;
    let file = |bytes: &[u8], last: u32| {
        let mut compressed = Vec::new();
        for block in bytes.chunks(5) {
            let mut encoder =
                flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(block).unwrap();
            compressed.push(encoder.finish().unwrap());
        }
        let sizes = compressed.iter().map(|block| block.len() as u32);
        let header: Vec<u8> = [compressed.len() as u32, 5, last]
            .into_iter()
            .chain(sizes)
            .flat_map(u32::to_le_bytes)
            .collect();
        let base64 = base64::engine::general_purpose::STANDARD;
        let text = base64.encode(header) + &base64.encode(compressed.concat());
        let compressor = "compressor=\"vtkZLibDataCompressor\" byte_order";
        small(&[
            ("byte_order", compressor),
            (
                "\"types\" format=\"ascii\">10 10 5 3 1",
                &format!("\"types\" format=\"binary\">{text}"),
            ),
        ])
    };
    let kinds = [10, 10, 5, 3, 1];
    for last in [0, 5] {
        assert_eq!(
            file(&kinds, last).unwrap().groups,
            small(&[]).unwrap().groups
        );
    }
    let refused = |kinds: &[u8]| file(kinds, 0).unwrap_err().to_string();
    has(
        &refused(&kinds[..4]),
        "a block of it has 4 bytes, expected 5",
    );
    has(&refused(&[10; 6]), "it has 10 bytes, expected 5");
}

/// Twenty million points in 640 kB: the array is refused before it is decompressed.
#[test]
fn an_array_that_grows_beyond_measure_is_refused() {
    use base64::Engine;
    use std::io::Write;
    const BLOCKS: usize = 400;
    let block = vec![0; 24 * 50_000];
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(&block).unwrap();
    let compressed = encoder.finish().unwrap();
    let sizes = vec![compressed.len() as u32; BLOCKS];
    let header = [BLOCKS as u32, block.len() as u32, 0];
    let header = header.into_iter().chain(sizes).flat_map(u32::to_le_bytes);
    let base64 = base64::engine::general_purpose::STANDARD;
    let text =
        base64.encode(header.collect::<Vec<u8>>()) + &base64.encode(compressed.repeat(BLOCKS));
    let refused = small(&[
        (
            "byte_order",
            "compressor=\"vtkZLibDataCompressor\" byte_order",
        ),
        ("NumberOfPoints=\"6\"", "NumberOfPoints=\"20000000\""),
        (
            "format=\"ascii\">\n0 0 0  1 0 0  0 1 0  0 0 1  1 1 1  9 9 9\n",
            &format!("format=\"binary\">{text}"),
        ),
    ]);
    has(
        &refused.unwrap_err().to_string(),
        "more than 100 times the size of the file",
    );
}

/// Numbers that a file announces are not trusted.
#[test]
fn announced_sizes_are_compared_with_what_is_there() {
    for (name, bytes, _) in FILES.iter().filter(|(name, ..)| *name != "ascii") {
        let text = String::from_utf8_lossy(bytes);
        let (_, count) = text.split_once("NumberOfPoints=\"").unwrap();
        let (count, _) = count.split_once('"').unwrap();
        let find = |word: &str| {
            let word = word.as_bytes();
            bytes.windows(word.len()).position(|w| w == word).unwrap()
        };
        let at = find(&format!("NumberOfPoints=\"{count}")) + 16;
        let huge = [&bytes[..at], b"99999999999", &bytes[at + count.len()..]].concat();
        let found = parse(&huge).unwrap_err().to_string();
        has(&format!("{name}: {found}"), "bytes, expected 2399999999976");
    }
}

#[test]
fn a_file_that_breaks_off_is_an_error_at_any_byte() {
    for (name, bytes, _) in FILES {
        let last = bytes.windows(9).rposition(|w| w == b"</VTKFile").unwrap();
        let appended = bytes.windows(13).position(|w| w == b"<AppendedData");
        // What follows the last array is not missed.
        let last = if appended.is_some() { last - 60 } else { last };
        for end in (0..last).step_by(13) {
            assert!(parse(&bytes[..end]).is_err(), "{name}: {end} of {last}");
        }
    }
}

/// A file of triangles is a surface, and a hexahedron with repeated points is a wedge.
#[test]
fn surfaces_alone_and_collapsed_cells_are_read() {
    let file = |points: &str, nodes: &str, kind: u8| {
        let count = points.split(' ').count() / 3;
        let ends = nodes.split(' ').count();
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"{count}\" NumberOfCells=\"1\">\
            <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{points}</DataArray></Points>\
            <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">{nodes}</DataArray>\
            <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">{ends}</DataArray>\
            <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">{kind}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"
        )
    };
    let content = parse(file("0 0 0 1 0 0 0 1 0", "0 1 2", 5).as_bytes()).unwrap();
    assert_eq!(content.groups["all"].dimension, 2);
    let content = parse(file("0 0 0 1 0 0 1 1 0 0 1 0", "0 1 2 3", 7).as_bytes()).unwrap();
    assert_eq!(content.facets.element_nodes(0), [0, 1, 2, 3]);
    let prism = "0 0 0 1 0 0 0 1 0 0 0 1 1 0 1 0 1 1";
    let content = parse(file(prism, "0 1 2 2 3 4 5 5", 12).as_bytes()).unwrap();
    assert_eq!(content.elements.element_nodes(0), [0, 1, 2, 3, 4, 5]);
    assert!(parse(file(prism, "0 1 2 2 3 3 5 4", 12).as_bytes()).is_err());
}
