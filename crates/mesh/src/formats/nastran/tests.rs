use super::super::fixtures::{
    assert_near, element_tags, node_tags, nodes_of, nothing_included, remarks,
};
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

fn at(content: &Content, tag: u64) -> [f64; 3] {
    let node = content.node_tags.iter().position(|known| *known == tag);
    content.nodes[node.unwrap_or_else(|| panic!("no node {tag}"))]
}

/// The twelve corners of two unit cubes above each other, as free fields.
fn corners() -> String {
    let mut text = String::new();
    for i in 0..12 {
        let (layer, corner) = (i / 4, i % 4);
        let x = u8::from(corner == 1 || corner == 2);
        let y = u8::from(corner >= 2);
        text += &format!("GRID,{},,{x}.,{y}.,{layer}.\n", i + 1);
    }
    text
}

const LOWER: &str = "CHEXA,1,7,1,2,3,4,5,6,+\n+,7,8\n";
const UPPER: &str = "CHEXA,2,8,5,6,7,8,9,10,+\n+,11,12\n";

/// A tetrahedron in each field format, with each kind of continuation.
#[test]
fn small_large_and_free_fields_give_the_same_mesh() {
    let free = "GRID,1,,0.,0.,0.\nGRID,2,,15.,0.,0.\nGRID,3,,0.,-1.5+1,0.\nGRID,4,,0.,0.,7.-4\n\
                CTETRA,3,5,1,2,3,4\nPSOLID,5,6\nMAT1,6,2.1+5,,.3,7.8-9\n";
    let expected = read(free);
    assert_eq!(at(&expected, 3), [0.0, -15.0, 0.0]);
    assert_eq!(at(&expected, 4), [0.0, 0.0, 7e-4]);
    let small = "\
$ comment
GRID           1              0.      0.      0.
GRID    2               15.     0.      0.      $ a comment
GRID\t3\t\t0.\t-1.5+1\t0.
GRID*                  4                              0.              0.*A
*A                7.0D-4
ctetra         3       5       1       2       3       4
PSOLID  5       6
MAT1*                  6           2.1E5                              .3*
*                 7.8E-9
ENDDATA
GRID    9
";
    assert_eq!(read(small), expected);
    let blank = small
        .replace("*A                7", "*                 7")
        .replace("0.*A", "0.");
    assert_eq!(read(&blank), expected);
    let large_free = free.replace("GRID,4,,0.,0.,7.-4", "GRID*,4,,0.,0.,*\n*,7.-4");
    assert_eq!(read(&large_free), expected);
    let control = format!("ID a,b\nSOL 101\nCEND\nTITLE = GRID 1\nBEGIN BULK\n{small}");
    assert_eq!(read(&control), expected);
    let material = &expected.materials[0];
    let found = (material.young, material.poisson, material.density);
    assert_eq!(found, (Some(2.1e5), Some(0.3), Some(7.8e-9)));
}

/// Each middle node is in the middle of its edge, in the order of Nastran.
#[test]
fn middle_nodes_have_our_order() {
    // Edges on each card, by corners, in the order of its middle nodes.
    let table = "
        CTETRA => 1 2 3 5 => 12 23 13 15 25 35
        CPYRAM => 1 2 3 4 5 => 12 23 34 14 15 25 35 45
        CPENTA => 1 2 3 5 6 7 => 12 23 13 15 26 37 56 67 57
        CHEXA => 1 2 3 4 5 6 7 8 => 12 23 34 14 15 26 37 48 56 67 78 58
    ";
    for [card, on_corners, edges] in cases(table) {
        let mut text = corners();
        let mut list: Vec<String> = on_corners.split(' ').map(str::to_owned).collect();
        let of = |text: &str, tag: char| at(&read(text), u64::from(tag as u32 - '0' as u32));
        let mesh = format!("{}CTETRA,1,1,1,2,3,5\n", corners());
        for edge in edges.split(' ') {
            let ends: Vec<char> = edge.chars().collect();
            let [a, b] = [ends[0], ends[1]].map(|tag| of(&mesh, tag));
            let [x, y, z] = [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]));
            text += &format!("GRID,1{edge},,{x:?},{y:?},{z:?}\n");
            list.push(format!("1{edge}"));
        }
        // Six nodes on the first line, eight on the others.
        text += &format!("{card},9,9,{}", list[..list.len().min(6)].join(","));
        for line in list[list.len().min(6)..].chunks(8) {
            text += &format!(",\n,{}", line.join(","));
        }
        let content = read(&(text + "\n"));
        let (element, found) = content.elements.solid(0);
        assert_eq!(element.nodes(), list.len(), "{card}");
        let position = |i: usize| content.nodes[found[i] as usize];
        for (middle, [a, b]) in (element.shape.corners()..).zip(element.shape.edges()) {
            let between = [0, 1, 2].map(|k| 0.5 * (position(*a)[k] + position(*b)[k]));
            assert_near(&[position(middle)], &[between], 1e-15);
        }
    }
}

#[test]
fn missing_middle_nodes_collapsed_and_linear_elements() {
    let table = "
        CTETRA,1,1,1,2,3,5 => tet4
        CPYRA,1,1,1,2,3,4,5 => pyramid5
        CPENTA,1,1,1,2,3,5,6,7 => wedge6
        CHEXA,1,1,1,2,3,3,5,6,+\\n+,7,7 => wedge6
        CHEXA,1,1,1,2,3,4,5,5,+\\n+,5,5 => pyramid5
        CTETRA,1,1,1,2,3,5,9,10,+\\n+,11,,,12 => tet10
        CHEXA,1,1,1,2,3,4,5,6,+\\n+,7,8,9 => hex20
    ";
    for [card, name] in cases(table) {
        let content = read(&format!("{}{card}\n", corners()));
        let types: Vec<ElementType> = content.elements.types().into_keys().collect();
        assert_eq!(types[0].name(), name, "{card}");
    }
    let made = read(&format!(
        "{}CTETRA,1,1,1,2,3,5,9,10,+\n+,11,,,12\n",
        corners()
    ));
    assert_eq!(at(&made, 13), [0.0, 0.0, 0.5]);
    assert_eq!(at(&made, 14), [0.5, 0.0, 0.5]);
}

#[test]
fn properties_and_shells_are_groups_by_the_names_of_preprocessors() {
    let cards = format!(
        "{}{LOWER}{UPPER}CQUAD4,3,4,1,2,3,4\nCTRIA3,5,4,5,6,7\nCQUAD8,6,4,9,10,11,12\nPSHELL,4,1,.1\n",
        corners()
    );
    let plain = read(&format!("{cards}PSOLID,7,1\nPSOLID,8,2\n"));
    assert_eq!(element_tags(&plain, "PSOLID 7"), [1]);
    assert_eq!(element_tags(&plain, "PSOLID 8"), [2]);
    assert_eq!(element_tags(&plain, "all"), [1, 2]);
    assert_eq!(element_tags(&plain, "PSHELL 4"), [3, 5, 6]);
    assert_eq!(nodes_of::<Vec<_>>(&plain, "PSHELL 4")[1], [4, 5, 6]);
    let table = "
        $HMNAME PROP                   7\"blade\" 4\\nPSOLID,7,1
        $ Elements and Element Properties for region : blade\\nPSOLID,7,1
        PSOLID,7,1\\n$ Pset: \"blade\" will be imported as: \"psolid.7\"
        $ANSA_NAME_COMMENT;7;PSOLID;blade;~\\nPSOLID,7,1
        $ANSA_NAME;7;PSOLID;~\\n$blade\\nPSOLID,7,1
        $ Femap with NX Nastran Property 7 : blade\\nPSOLID,7,1
        $* Property: blade\\nPSOLID,7,1
    ";
    for [lines] in cases(table) {
        let content = read(&format!("{cards}{lines}\nPSOLID,8,2\n"));
        assert_eq!(element_tags(&content, "blade"), [1], "{lines}");
        assert_eq!(element_tags(&content, "PSOLID 8"), [2], "{lines}");
    }
    let components = "$HMNAME COMP                   2\"both\" 7 \"PSOLID\"\n$HMMOVE        2\n$       1THRU       3\n";
    let content = read(&format!("{cards}{components}PSOLID,7,1\n"));
    assert_eq!(element_tags(&content, "both"), [1, 2]);
    assert_eq!(element_tags(&content, "both (shells)"), [3]);
}

#[test]
fn materials_follow_from_what_is_given() {
    let table = "
        MAT1,1,2.6,,.3,5. => 2.6 0.3 5
        MAT1,1,2.6,1.,,5. => 2.6 0.30000000000000004 5
        MAT1,1,,1.,.3,5. => 2.6 0.3 5
        MAT1,1,2.6,,,5. => 2.6 0 5
        MAT1,1,2.6,9.,.3 => 2.6 0.3 -
        PARAM,WTMASS,.5\\nMAT1,1,2.6,,.3,5. => 2.6 0.3 2.5
        MAT9,1,1.,,,,,,,+\\n+,,,,,,,,,+\\n+,,,,,,,5. => - - 5
    ";
    for [cards, expected] in cases(table) {
        let content = read(&format!("{}{LOWER}PSOLID,7,1\n{cards}\n", corners()));
        let material = &content.materials[0];
        let shown = |value: Option<f64>| value.map_or("-".to_owned(), |v| v.to_string());
        let found = [material.young, material.poisson, material.density].map(shown);
        assert_eq!(found.join(" "), expected, "{cards}");
    }
    let cards = "$HMNAME MAT                    1\"steel\" \"MAT1\"\nMAT1,1,2.,,.3,5.,1.-5\nMATT1,1,4\nPARAM,WTMASS,.5\nMAT9,2,1.\n";
    let content = read(&format!(
        "{}{LOWER}{UPPER}PSOLID,7,1\nPSOLID,8,2\n{cards}",
        corners()
    ));
    let expected = "A 0.00001 of `steel` & (MATT1) of these materials were left aside, and the values \
                    of MAT1 count: `steel` & only isotropic ones are read: `material 2` & \
                    multiplied by 0.5";
    has(&remarks(&content), expected);
    assert_eq!(content.materials[0].name, "steel");
    assert_eq!(content.materials[0].elements, [0]);
}

/// Chains of systems by points and by nodes, GRDSET, spherical and cylindrical systems.
#[test]
fn nodes_in_systems_of_coordinates() {
    let text = format!(
        "{}{LOWER}\
         CORD2R,1,0,1.,0.,0.,1.,0.,1.,+\n+,1.,1.,0.\n\
         CORD2C,2,1,0.,0.,0.,0.,0.,1.,+\n+,1.,0.,0.\n\
         CORD1S,3,20,21,22\n\
         GRID,20,1,1.,1.,0.\nGRID,21,1,1.,1.,1.\nGRID,22,2,9.,90.,0.\n\
         GRID,23,2,2.,90.,3.\nGRID,24,3,2.,90.,0.,5\nGRDSET,,1\nGRID,25,,1.,2.,3.\n",
        corners()
    );
    let content = read(&text);
    // x of system 1 is the global y, and its y the global -x.
    assert_near(&[at(&content, 20)], &[[0.0, 1.0, 0.0]], 1e-15);
    assert_near(&[at(&content, 23)], &[[-1.0, 0.0, 3.0]], 1e-14);
    assert_near(&[at(&content, 25)], &[[-1.0, 1.0, 3.0]], 1e-15);
    // x of system 3 points from node 20 (0, 1, 0) to node 22 (-8, 0, 0).
    let length = 65.0_f64.sqrt();
    let along = [-8.0 / length, -1.0 / length];
    assert_near(
        &[at(&content, 24)],
        &[[2.0 * along[0], 1.0 + 2.0 * along[1], 0.0]],
        1e-14,
    );
    has(&remarks(&content), "(CD) of 1 nodes were left aside");
}

#[test]
fn sets_are_groups() {
    let text = format!(
        "SOL 101\nCEND\nSET 5 = 1,2,\n  4 THRU 6\nSET 6 = ALL\nSET 7 = 1 THRU 3, 99\nSPC = 3\nset 8=1,2\nBEGIN BULK\n\
         {}{LOWER}{UPPER}SPC1,3,123,9,THRU,12\nSPC,3,1,12,0.,2,3,.1\nSPC1,4,1,8\nSET1,5,1,THRU,4\nSET3,6,ELEM,2\n\
         $HMSET       9        1 \"tip\"\nSET,9,GRID,LIST,,,,,,+\n+,9,10\n",
        corners()
    );
    let content = read(&text);
    assert_eq!(node_tags(&content, "SET 5"), [1, 2, 4, 5, 6]);
    assert_eq!(node_tags(&content, "SPC 3"), [1, 2, 9, 10, 11, 12]);
    assert_eq!(node_tags(&content, "SPC 4"), [8]);
    assert_eq!(node_tags(&content, "SET1 5"), [1, 2, 3, 4]);
    assert_eq!(element_tags(&content, "SET3 6"), [2]);
    assert_eq!(node_tags(&content, "tip"), [9, 10]);
    // Both nodes and elements have the numbers 1 and 2.
    assert_eq!(element_tags(&content, "SET 8"), [1, 2]);
    assert_eq!(node_tags(&content, "SET 8 (nodes)"), [1, 2]);
    assert!(!content.groups.contains_key("SET 7"));
}

#[test]
fn what_is_left_aside_is_named_with_its_number() {
    let text = format!(
        "+,1,2\n{}{LOWER}GRID,30\nGRID,31\nCONM2,40,30,,1.\nRBE2,41,31,123,1,2\nFORCE,1,1,,1.,1.\nFORCE,1,2,,1.,1.\n\
         PARAM,POST,-1\nEIGRL,1\nCIHEX9,1\nDTI,UNITS,1,KG,N,M,S\nBEGIN SUPER=1\nGRID,1\nCHEXA,1\nENDDATA\n",
        corners()
    );
    let content = read(&text);
    let expected = "CIHEX9 (1), CONM2 (1), FORCE (2), RBE2 (1), continuation of no card (1). Supports & BEGIN SUPER 1 (3) & \
                    KG, N, M, S";
    has(&remarks(&content), expected);
    assert!(
        !remarks(&content).contains("belong to no element"),
        "{}",
        remarks(&content)
    );
}

#[test]
fn files_are_included_in_their_place() {
    let mut include = |name: &str| {
        Ok(match name {
            "nodes/all.bdf" => corners().into_bytes(),
            "control.inc" => b"SET 5 = 4\n".to_vec(),
            other => panic!("{other}"),
        })
    };
    let text =
        format!("CEND\nINCLUDE 'control.inc'\nBEGIN BULK\ninclude 'nodes/\n     all.bdf'\n{LOWER}");
    let content = parse(text.as_bytes(), &mut include).unwrap();
    assert_eq!(node_tags(&content, "SET 5"), [4]);
    let mut include = |_: &str| Ok(b"GRID,1,,0.,x\n".to_vec());
    let error = parse(b"INCLUDE 'a.bdf'\nGRID,2\n", &mut include).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 1 of a.bdf, GRID: `x` is not a number"
    );
}

#[test]
fn faults_name_the_line_and_the_remedy() {
    let table = r"
        GRID,1,,0.,x => line 1, GRID: `x` is not a number
        GRID,a => line 1, GRID: `a` is not the number
        GRID,1,7 => line 1, GRID: there is no coordinate system 7
        CORD2R,1,0,0.,0.,0.,0.,0.,0.\nGRID,1,1 => line 1: & coordinate system 1
        CORD2R,1,2,0.,0.,0.,0.,0.,1.,\n,1.\nCORD2R,2,1,0.,0.,0.,0.,0.,1.,\n,1.\nGRID,1,1 => coordinate system & depend
        CORD1R,1,1,2,3\nGRID,1,1\nGRID,2\nGRID,3 => line 1: & coordinate system 1
        GRID,1\nCTETRA,3,1,1,,,1 => line 2, CTETRA: element 3 has 2 nodes, and type CTETRA has 4
        GRID,1\nCTETRA,3,1,1,2,3,4 => line 2: element 3 names node 2
        CHEXA,1,1,1,2,3,4,5,6,+A\n+B,7,8 => line 2 & +B & +A
        GRID,1\n=,*1,==\n => line 2, = & writes
        SPC1,1,1,1,THRU => line 1, SPC1
        CBAR,1,1,1,2 => elements of types CBAR are neither solids nor surfaces
    ";
    for [text, expected] in cases(table) {
        has(&message(&text), &expected.replace("+A", "A"));
    }
    let twice = format!("{}{LOWER}{LOWER}", corners());
    has(&message(&twice), "line 15: element 1 occurs twice");
}

/// Files that MSC Apex and Patran wrote. pyNastran 1.4 finds the same nodes, elements and volumes.
#[test]
fn real_files() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/nastran");
    let table = "
        cantilevered_plate_3D.bdf => 312 => 125 => 5e7
        rigid_rbe2.bdf => 252 => 128 => 1.600000015e-2
        solid_bending.bdf => 72 => 186 => 6
    ";
    for [file, nodes, elements, volume] in cases(table) {
        let path = format!("{folder}/{file}");
        let Ok(bytes) = std::fs::read(&path) else {
            eprintln!("{path} is absent: nothing is checked");
            return;
        };
        let content = super::super::parse(&bytes, &path, &mut nothing_included).unwrap();
        assert_eq!(content.nodes.len().to_string(), nodes, "{file}");
        assert_eq!(content.elements.len().to_string(), elements, "{file}");
        let mesh = content.into_mesh(1.0.into()).unwrap();
        let found = crate::quality::check(&mesh).unwrap().volume_m3;
        let expected: f64 = volume.parse().unwrap();
        assert!((found / expected - 1.0).abs() < 1e-6, "{file}: {found}");
    }
}
