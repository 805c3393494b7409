use super::super::fixtures::{element_tags, node_tags, nodes_of, nothing_included, remarks};
use super::*;
use crate::element::ElementType;
use dovetail_testkit::words::{cases, has};

fn read(text: &str) -> Content {
    parse(text.as_bytes(), &mut nothing_included).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn message(text: &str) -> String {
    let found = parse(text.as_bytes(), &mut nothing_included);
    found.map(|c| format!("{c:?}")).unwrap_err().to_string()
}

fn types(content: &Content) -> Vec<(ElementType, usize)> {
    content.elements.types().into_iter().collect()
}

/// Lines of an NBLOCK with the twelve corners of two unit cubes above each other.
fn corners() -> String {
    let mut text = "NBLOCK,6,SOLID,12,12\n(3i8,6e20.13)\n".to_owned();
    for i in 0..12 {
        let (layer, corner) = (i / 4, i % 4);
        let x = f64::from(u8::from(corner == 1 || corner == 2));
        let y = f64::from(u8::from(corner >= 2));
        let z = f64::from(layer);
        text += &format!("{:8}{:8}{:8}{x:20.13E}{y:20.13E}{z:20.13E}\n", i + 1, 0, 0);
    }
    text + "N,R5.3,LOC,       -1,\n"
}

/// Line of an EBLOCK of solids: material, type, number, nodes.
fn solid(material: u64, kind: u64, label: u64, nodes: &[i64]) -> String {
    let head = [
        material,
        kind,
        1,
        1,
        0,
        0,
        0,
        0,
        nodes.len() as u64,
        0,
        label,
    ];
    let head = head.map(|n| n as i64);
    let all: Vec<i64> = head.into_iter().chain(nodes.iter().copied()).collect();
    let mut text = String::new();
    for line in all[..all.len().min(19)]
        .chunks(19)
        .chain(all[all.len().min(19)..].chunks(19))
    {
        text.extend(line.iter().map(|n| format!("{n:8}")));
        text += "\n";
    }
    text
}

fn block(elements: &[String]) -> String {
    format!(
        "EBLOCK,19,SOLID,9,9\n(19i8)\n{}      -1\n",
        elements.concat()
    )
}

const LOWER: [i64; 8] = [1, 2, 3, 4, 5, 6, 7, 8];
const UPPER: [i64; 8] = [5, 6, 7, 8, 9, 10, 11, 12];

#[test]
fn blocks_of_nodes_elements_and_components() {
    let text = format!(
        "/PREP7\nET,1,SOLID185\n{}{}CMBLOCK,TOP     ,NODE,       2  ! comment\n(8i10)\n         9       -12\n\
         CMBLOCK,Upper,ELEM,1\n(8i10)\n        20\nMP,EX,1,2.1E5\nMP,NUXY,1,0.3\nMP,DENS,1,7.8E-9\n/UNITS,MPA\nFINISH\n",
        corners(),
        block(&[solid(1, 1, 10, &LOWER), solid(1, 1, 20, &UPPER)])
    );
    let content = read(&text);
    assert_eq!(types(&content), [(ElementType::HEX8, 2)]);
    assert_eq!(content.nodes[10], [1.0, 1.0, 2.0]);
    assert_eq!(node_tags(&content, "TOP"), [9, 10, 11, 12]);
    assert_eq!(element_tags(&content, "Upper"), [20]);
    assert_eq!(element_tags(&content, "all"), [10, 20]);
    let material = &content.materials[0];
    assert_eq!(
        (
            material.young,
            material.poisson,
            material.density,
            material.elements.len()
        ),
        (Some(2.1e5), Some(0.3), Some(7.8e-9), 2)
    );
    assert!(
        remarks(&content).contains("(`units = \"mm-t-s\"`)"),
        "{:?}",
        content.remarks
    );
}

/// The same two cubes by single commands, with lower case, `$` and attributes.
#[test]
fn commands_give_the_same_mesh_as_blocks() {
    let blocks = read(&format!(
        "ET,1,185\n{}{}",
        corners(),
        block(&[solid(1, 1, 1, &LOWER), solid(2, 1, 2, &UPPER)])
    ));
    let mut text = "/prep7\net,1,solid185\n".to_owned();
    for (node, at) in blocks.node_tags.iter().zip(&blocks.nodes) {
        text += &format!("n, {node}, {}, {}, {}   ! a node\n", at[0], at[1], at[2]);
    }
    text += "type,1 $ mat,1\ne,1,2,3,4,5,6,7,8\nmat,2\nen,2,5,6,7,8,9,10,11,12\n";
    let commands = read(&text);
    assert_eq!(commands, blocks);
    let release = text
        .replace("n, ", "N,UNBL,LOC,")
        .replace(
            "e,1,2,3,4,5,6,7,8",
            "EN,R5.5,ATTR,8,1,1,1,1,0,1,0,0,0\nEN,R5.5,NODE,1,2,3,4,5,6,7,8",
        )
        .replace(
            "en,2,5,",
            "EN,R5.5,ATTR,8,2,1,1,1,0,2,0,0,0\nEN,R5.5,NODE,5,",
        );
    let lines = release
        .lines()
        .map(|line| match line.strip_prefix("N,UNBL,LOC,") {
            Some(rest) => {
                let (node, at) = rest.split_once(',').unwrap();
                format!("N,UNBL,LOC,{node},0,0,{at}\n")
            }
            None => format!("{line}\n"),
        });
    assert_eq!(read(&lines.collect::<String>()), blocks);
    assert_eq!(element_tags(&blocks, "material 2"), [2]);
}

/// Every kind of solid, with the order of its nodes by the middle of an edge of the cube.
#[test]
fn element_types_and_their_collapsed_forms() {
    let table = "
        185 => 1 2 3 4 5 6 7 8 => hex8
        45 => 1 2 3 3 5 6 7 7 => wedge6
        SOLSH190 => 1 2 3 4 5 5 5 5 => pyramid5
        185 => 1 2 3 3 5 5 5 5 => tet4
        285 => 1 2 3 5 => tet4
        187 => 1 2 3 5 21 22 23 24 25 26 => tet10
        92 => 1 2 3 5 0 0 0 0 0 0 => tet4
        186 => 1 2 3 4 5 6 7 8 21 22 23 24 25 26 27 28 29 30 31 32 => hex20
        95 => 1 2 3 4 5 6 7 8 0 0 0 0 0 0 0 0 0 0 0 0 => hex8
        186 => 1 2 3 4 5 6 7 8 => hex8
        186 => 1 2 3 3 5 6 7 7 21 22 3 24 25 26 7 28 29 30 31 31 => wedge15
        186 => 1 2 3 4 5 5 5 5 21 22 23 24 5 5 5 5 29 30 31 32 => pyramid13
        186 => 1 2 3 3 5 5 5 5 21 22 3 24 5 5 5 5 29 30 31 31 => tet10
        200,8 => 1 2 3 5 => tet4
        200,10 => 1 2 3 3 5 6 7 7 => wedge6
        200,9 => 1 2 3 5 21 22 23 24 25 26 => tet10
    ";
    let mut middles = String::from("N,21,.5,0,0\n");
    for node in 22..=32 {
        middles += &format!("N,{node},{},{},{}\n", node, 2 * node, 3 * node);
    }
    for [kind, list, name] in cases(table) {
        let list: Vec<i64> = list.split(' ').map(|n| n.parse().unwrap()).collect();
        let text = format!(
            "ET,7,{kind}\n{}{middles}{}",
            corners(),
            block(&[solid(1, 7, 3, &list)])
        );
        let content = read(&text);
        let (found, _) = types(&content)[0];
        assert_eq!(found.name(), name, "{kind} {list:?}");
        // All of our elements begin with these corners: the base, from its first one.
        let element = content.elements.element_nodes(0);
        let middle = element
            .iter()
            .position(|n| content.node_tags[*n as usize] == 21);
        assert_eq!(
            middle.is_some(),
            element.len() > found.shape.corners(),
            "{kind} {list:?}"
        );
        if let Some(middle) = middle {
            let ends = found.shape.edges()[middle - found.shape.corners()];
            let mut ends = ends.map(|i| content.node_tags[element[i] as usize]);
            ends.sort_unstable();
            assert_eq!(ends, [1, 2], "{kind} {list:?}");
        }
    }
}

#[test]
fn elements_that_carry_a_face_are_surfaces() {
    let text = format!(
        "ET,1,185\n*SET,tid,4\nET,tid,154\nET,5,174\nET,6,170\nET,7,21\nET,8,200\nKEYOPT,8,1,6\n{}{}\
         EBLOCK,10,,,1\n(15i9)\n{:9}{:9}{:9}{:9}{:9}{:9}{:9}{:9}{:9}\n-1\n",
        corners(),
        block(&[
            solid(1, 1, 1, &LOWER),
            solid(1, 5, 2, &[5, 6, 7, 8, 0, 0, 0, 0]),
            solid(1, 6, 3, &[5, 6, 7]),
            solid(1, 6, 4, &[5]),
            solid(1, 7, 5, &[5]),
            solid(1, 8, 6, &[1, 2, 3, 3]),
            solid(1, 9, 7, &[1, 2, 3, 3]),
        ]),
        9,
        4,
        4,
        4,
        0,
        1,
        2,
        6,
        5
    );
    let content = read(&text);
    assert_eq!(nodes_of::<Vec<_>>(&content, "SURF154 4"), [[0, 1, 5, 4]]);
    assert_eq!(nodes_of::<Vec<_>>(&content, "CONTA174 5"), [[4, 5, 6, 7]]);
    assert_eq!(nodes_of::<Vec<_>>(&content, "TARGE170 6"), [[4, 5, 6]]);
    assert_eq!(nodes_of::<Vec<_>>(&content, "MESH200 8"), [[0, 1, 2]]);
    let expected = "MASS21 (1), TARGE170 (1), type 9, which no ET defines (1)";
    has(&remarks(&content), expected);
}

/// The same solids in the other two layouts of EBLOCK, with a second line and without.
#[test]
fn plain_and_compact_blocks_of_elements() {
    let mut nodes = corners();
    for node in 21..=32 {
        nodes += &format!("N,{node},{node},0,0\n");
    }
    let list: Vec<i64> = LOWER.into_iter().chain(21..=32).collect();
    let elements = [solid(2, 1, 10, &list), solid(2, 3, 20, &UPPER)];
    let types = "ET,1,186\nET,3,185\nMP,EX,1,3\nMP,EX,2,5\n";
    let expected = read(&format!("{types}{nodes}{}", block(&elements)));
    let line = |numbers: &[i64]| {
        let fields: String = numbers.iter().map(|n| format!("{n:9}")).collect();
        fields + "\n"
    };
    let plain = |kind: i64, label: i64, list: &[i64]| {
        let all: Vec<i64> = [label, kind, 1, 2, 0].iter().chain(list).copied().collect();
        all.chunks(15).map(line).collect::<String>()
    };
    let (quadratic, linear) = (plain(1, 10, &list), plain(3, 20, &UPPER));
    let both = format!("{types}{nodes}EBLOCK,10,,,2\n(15i9)\n{quadratic}{linear}-1\n");
    assert_eq!(read(&both), expected);
    let compact = |kind: i64, label: i64, list: &[i64]| {
        let all: Vec<i64> = [label].iter().chain(list).copied().collect();
        let lines: String = all.chunks(11).map(line).collect();
        format!("TYPE,{kind}\nMAT,2\nEBLOCK,10,COMPACT,,1\n(11i9)\n{lines}-1\n")
    };
    let (quadratic, linear) = (compact(1, 10, &list), compact(3, 20, &UPPER));
    assert_eq!(
        read(&format!("{types}{nodes}{quadratic}{linear}")),
        expected
    );
}

#[test]
fn middle_nodes_of_a_neighbour_are_used_and_others_made() {
    let quadratic = [1, 2, 3, 5, 21, 22, 23, 24, 25, 26];
    let lacking = [2, 3, 4, 5, 0, 0, 0, 0, 26, 0];
    let mut text = format!("ET,1,187\n{}", corners());
    for node in 21..=26 {
        text += &format!("N,{node},{node},0,0\n");
    }
    text += &block(&[solid(1, 1, 1, &quadratic), solid(1, 1, 2, &lacking)]);
    let content = read(&text);
    let second: Vec<u64> = content
        .elements
        .element_nodes(1)
        .iter()
        .map(|n| content.node_tags[*n as usize])
        .collect();
    assert_eq!(second, [2, 3, 4, 5, 22, 27, 28, 25, 26, 29]);
    let made = content.node_tags.iter().position(|tag| *tag == 27).unwrap();
    assert_eq!(content.nodes[made], [0.5, 1.0, 0.0]);
    has(
        &remarks(&content),
        "1 elements lack some & in the middle of 3 edges",
    );
}

#[test]
fn properties_of_materials_in_all_forms() {
    let mesh = |properties: &str| {
        let elements = [solid(1, 1, 1, &LOWER), solid(2, 1, 2, &UPPER)];
        read(&format!(
            "ET,1,185\n{}{}{properties}",
            corners(),
            block(&elements)
        ))
    };
    let table = r"
        MP,EX,1,5 $ MP,PRXY,1,.3 $ MP,DENS,1,2 $ MP,EX,2,7 => 5 0.3 2 7
        MPTEMP,UNBL,2,1,20,100,\nMPDATA,UNBL,2,EX  ,1,1,5,5\nMPDATA,UNBL,1,NUXY,1,1,.3\nMPDATA,R5.0,1,DENS,1,1,2\nMPDATA,EX,2,1,7 => 5 0.3 2 7
        TB,ELASTIC,1,1,2,ISOT\nTBTEMP,20\nTBDATA,1,5,.3\nMP,DENS,1,2\nMP,EX,2,7 => 5 0.3 2 7
        young=5\n*SET,nu,.3\nMP,EX,1,young\nMP,NUXY,1,nu\nMP,DENS,1,2\nMP,EX,2,7 => 5 0.3 2 7
        MPDATA,EX,1,1,5,6,7\nMP,NUXY,1,.3\nMP,DENS,1,2,.1\nMP,EX,2,7 => 5 0.3 2 7
        MP,EX,1,5\nMP,EY,1,5.000001\nMP,NUXY,1,.3\nMP,DENS,1,2\nMP,EX,2,7 => 5 0.3 2 7
        MP,EX,1,5\nMP,EY,1,6\nMP,NUXY,1,.3\nMP,DENS,1,2\nMP,EX,2,7 => - - 2 7
    ";
    for [properties, expected] in cases(table) {
        let content = mesh(&properties);
        let [first, second] = &content.materials[..] else {
            panic!("{:?}", content.materials)
        };
        let shown = |value: Option<f64>| value.map_or("-".to_owned(), |v| v.to_string());
        let found = [first.young, first.poisson, first.density, second.young].map(shown);
        assert_eq!(found.join(" "), expected, "{properties}");
    }
    let varying = mesh(
        "MPDATA,EX,1,1,5,6,7\nMP,DENS,1,2,.1\nMP,ALPX,1,1e-5\nMP,EY,2,3\nTB,BISO,1\n!!HMNAME MAT\n!!  1 \"steel\"\n",
    );
    let expected = [
        "taken at the first of each: EX DENS of `steel`",
        "only isotropic ones are read: `material 2`",
        "ALPX 0.00001 of `steel`",
        "Laws of TB (plasticity, creep, contact and others) of these materials were left aside, and only EX, NUXY or PRXY, and DENS count: `steel`",
    ];
    has(&remarks(&varying), &expected.join(" & "));
    assert_eq!(element_tags(&varying, "steel"), [1]);
}

/// Comments of Workbench name bodies and their materials.
#[test]
fn bodies_and_materials_of_workbench_keep_their_names() {
    let text = format!(
        "/batch\n{}/com,*********** Elements for Body 1 \"Blade\" ***********\nET,1,185\n{}\
         /com,*********** Elements for Body 2 \"Disc\" ***********\nET,2,185\n{}/wb,elem,end\n\
         MP,EX,1,5\nMP,EX,2,5\n!SYS\\Blade,\tSteel,\tmatid,\t1\n!SYS\\Disc,\tSteel,\tmatid,\t2\n",
        corners(),
        block(&[solid(1, 1, 1, &LOWER)]),
        block(&[solid(2, 2, 2, &UPPER)])
    );
    let content = read(&text);
    assert_eq!(element_tags(&content, "Blade"), [1]);
    assert_eq!(element_tags(&content, "Disc"), [2]);
    assert_eq!(element_tags(&content, "all"), [1, 2]);
    assert_eq!(content.groups.len(), 3, "{:?}", content.groups.keys());
    assert_eq!(content.materials.len(), 1);
    assert_eq!(content.materials[0].name, "Steel");
}

#[test]
fn nodes_in_other_systems_and_what_is_left_aside() {
    let text = format!(
        "ET,1,185\n{}{}LOCAL,11,1,1,0,0,0,0,0\nN,40,2,90,3\nCSYS,0\nN,41,1,2,3,0,0,45\n\
         D,1,UX,0\nD,2,UX,0\nDBLOCK,3\n(2i9)\n  1\n  2\n  3\n-1\nACEL,0,0,0\nOMEGA,0,0,100\nCP,1,UX,1,2\nTREF,20\n\
         ESEL,NONE\nCM,empty,ELEM\nNSEL,S,LOC,X,0\nCM,some,NODE\nALLSEL\nCM,every,NODE\n",
        corners(),
        block(&[solid(1, 1, 1, &LOWER)])
    );
    let content = read(&text);
    let at = content.node_tags.iter().position(|tag| *tag == 40).unwrap();
    let expected = [1.0, 2.0, 3.0];
    assert!((0..3).all(|k| (content.nodes[at][k] - expected[k]).abs() < 1e-15));
    let left = "not read: CM of a selection (1), CP (1), D (2), DBLOCK (3), OMEGA (1). Supports";
    has(&remarks(&content), left);
    has(&remarks(&content), "systems of 1 nodes were left aside");
    assert_eq!(node_tags(&content, "every"), LOWER.map(|n| n as u64));
}

#[test]
fn faults_name_the_line_and_the_remedy() {
    let table = r"
        NBLOCK,6\n => NBLOCK & not complete
        NBLOCK,6\n(3x8)\n => line 2, NBLOCK & `(3x8)`
        NBLOCK,6\n(3i8,6e20.13)\n       1       0       0 1.0x => line 3, NBLOCK & `1.0x` is not a number
        NBLOCK,6\n(3i8,6e20.13)\n       1 => NBLOCK has no `-1` behind it
        EBLOCK,19,SOLID\n(19i8)\n       1       1\n-1\n => line 3, EBLOCK & has 2 fields and needs 12
        CMBLOCK,a,NODE,2\n(8i10)\n         1\nFINISH\n => says 2 members of the component and the file has 1
        CMBLOCK,a,NODE,1\n(8i10)\n        -1\n => line 3, CMBLOCK & -1
        VMESH,ALL\n => line 1, VMESH & CDWRITE
        *DO,i,1,9\nN,i,i,0,0\n*ENDDO\n => line 2, N & CDWRITE
        ET,1,45\nE,1,2,3,4,5,6,7,8\n => line 2: element 1 names node 1
        ET,1,45\nN,1\nE,1,1,1\n => line 3: element 1 has 3 nodes, and type SOLID45 has 8
        NBLOCK,6\n(3i8,6e20.13)\n       1\nET,1,185\nCSYS,12\nN,2 => line 6, N & no coordinate system 12
        CSYS,12\nN,1,0,0,0\n => line 2, N & no coordinate system 12
        ET,1,21\nN,1\nE,1\n => elements of types MASS21 are neither solids nor surfaces
    ";
    for [text, expected] in cases(table) {
        has(&message(&text), &expected);
    }
    let twice = format!(
        "ET,1,185\n{}{}",
        corners(),
        block(&[solid(1, 1, 3, &LOWER), solid(1, 1, 3, &UPPER)])
    );
    has(&message(&twice), "line 20: element 3 occurs twice");
}

/// The file of a real blade, with the geometry that CDWRITE writes first. mapdl-archive 0.4.2 finds
/// the same nodes, elements, volume and components.
#[test]
fn a_real_blade() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/data/ansys/blade.cdb"
    );
    let Ok(bytes) = std::fs::read(path) else {
        eprintln!("{path} is absent: nothing is checked");
        return;
    };
    let mut content = super::super::parse(&bytes, path, &mut nothing_included).unwrap();
    assert_eq!(
        types(&content),
        [(ElementType::WEDGE6, 38), (ElementType::HEX8, 12_331)]
    );
    assert_eq!(content.nodes.len(), 15_689);
    for i in 1..=4 {
        assert_eq!(node_tags(&content, &format!("FIRTREE{i}")).len(), 80);
    }
    assert_eq!(node_tags(&content, "PRESSURE_SURF").len(), 2701);
    let material = content.materials.remove(0);
    let found = (material.young, material.poisson, material.density);
    assert_eq!(found, (Some(29_007_547.5), Some(0.3), Some(7.345444929e-4)));
    let mesh = content.into_mesh(1.0.into()).unwrap();
    let volume = crate::quality::check(&mesh).unwrap().volume_m3;
    assert!((volume - 6.421566706e-1).abs() < 1e-9, "{volume}");
}

#[test]
fn other_files_are_read_in_their_place() {
    let mut include = |name: &str| {
        assert_eq!(name, "nodes.cdb");
        Ok(corners().into_bytes())
    };
    let text = format!(
        "/INPUT,nodes,cdb\nET,1,185\n{}",
        block(&[solid(1, 1, 1, &LOWER)])
    );
    assert_eq!(
        parse(text.as_bytes(), &mut include).unwrap().elements.len(),
        1
    );
}
