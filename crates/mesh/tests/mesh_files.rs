//! Tests of the reader with real mesh files, sound and broken.

use std::collections::BTreeSet;

use dovetail_mesh::quality::{self, QualityError};
use dovetail_mesh::{ElementOrder, ElementType, Mesh, MeshError, Shape};
use dovetail_numerics::space::distance;
use dovetail_testkit::folder::root;
use dovetail_testkit::words::has;

const MM: f64 = 1e-3;
/// Files of one geometry, two cubes.
const BLOCKS: [&str; 3] = [
    "blocks_order1.msh",
    "blocks_order2.msh",
    "blocks_binary.msh",
];

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(root().join("meshes").join(name)).unwrap()
}

fn ready(name: &str) -> Mesh {
    dovetail_mesh::parse(bytes(name), MM).unwrap()
}

// ------------------------------------------------------------------------- what the files say

#[test]
fn the_ready_meshes_hold_what_their_readme_says() {
    let readme = std::fs::read_to_string(root().join("meshes/README.md")).unwrap();
    for (name, order, pairs, least_shape) in [
        ("dovetail.msh", ElementOrder::Quadratic, 72, 0.05),
        ("dovetail_order1.msh", ElementOrder::Linear, 72, 0.05),
        ("dovetail_small.msh", ElementOrder::Quadratic, 24, 0.03),
    ] {
        let mesh = ready(name);
        let element = ElementType::new(Shape::Tetrahedron, order);
        assert!(mesh.elements.types().into_keys().eq([element]));
        let tets = |g: &str| mesh.groups[g].elements.len();
        let row = format!(
            "| {name} | {} | {} | {} / {} | {pairs} |",
            order as usize + 1,
            mesh.nodes_m.len(),
            tets("blade"),
            tets("jaw")
        );
        assert!(readme.contains(&row), "meshes/README.md should say {row}");
        assert_eq!(tets("blade") + tets("jaw"), mesh.elements.len());
        assert!(bytes(name).len() < 2 << 20);
        assert_eq!(mesh.groups.len(), 18);
        assert_eq!(mesh.groups["excitation"].nodes.len(), 1);
        assert_eq!(mesh.groups["blade_leading_edge"].dimension, 1);
        let found = quality::check(&mesh).unwrap();
        println!("{name}: {found:?}");
        assert!(found.worst_shape > least_shape && found.worst_jacobian_ratio > 0.1);
    }
}

/// The positions of the mid-edge nodes determine which corners they lie between: the order of the
/// file against the one that the code relies on.
#[test]
fn mid_edge_nodes_lie_between_the_corners_of_their_edge() {
    let mesh = ready("dovetail.msh");
    let x = |n: u32| mesh.nodes_m[n as usize];
    let check = |nodes: &[u32], corners: usize, edges: &[[usize; 2]]| {
        for (&middle, &[a, b]) in nodes[corners..].iter().zip(edges) {
            let off = |p: usize, q: usize| {
                let (p, q) = (x(nodes[p]), x(nodes[q]));
                distance(x(middle), [0, 1, 2].map(|k| 0.5 * (p[k] + q[k])))
            };
            for p in 0..corners {
                for q in p + 1..corners {
                    let own = [p, q] == [a.min(b), a.max(b)];
                    assert!(own || off(a, b) < off(p, q));
                }
            }
        }
    };
    let edges = Shape::Tetrahedron.edges();
    (0..mesh.elements.len()).for_each(|e| check(mesh.elements.element_nodes(e), 4, edges));
    (0..mesh.facets.len())
        .for_each(|f| check(mesh.facets.element_nodes(f), 3, &[[0, 1], [1, 2], [0, 2]]));
}

#[test]
fn ascii_and_binary_blocks_are_the_same_two_cubes() {
    let ascii = ready("blocks_order1.msh");
    for name in BLOCKS {
        let mesh = ready(name);
        let found = quality::check(&mesh).unwrap();
        assert!((found.volume_m3 - 2e-9).abs() < 1e-20, "{found:?}");
        assert_eq!(
            mesh.groups.keys().collect::<Vec<_>>(),
            ascii.groups.keys().collect::<Vec<_>>()
        );
        // The lower face of the upper cube is in two groups.
        let bottom: BTreeSet<_> = mesh.groups["upper_bottom"].elements.iter().collect();
        let skin: BTreeSet<_> = mesh.groups["upper_skin"].elements.iter().collect();
        assert!(bottom.len() == 8 && bottom.is_subset(&skin) && skin.len() == 48);
        assert_eq!(mesh.groups["corner"].nodes.len(), 1);
        let per_edge = if mesh.elements.element_nodes(0).len() == 4 {
            3
        } else {
            5
        };
        assert_eq!(mesh.groups["rim"].nodes.len(), per_edge);
        let corner = mesh.groups["corner"].nodes[0] as usize;
        assert!(distance(mesh.nodes_m[corner], [MM, MM, 2.0 * MM]) < 1e-15);
    }
    let binary = ready("blocks_binary.msh");
    assert_eq!(binary.node_tags, ascii.node_tags);
    for (a, b) in binary.nodes_m.iter().zip(&ascii.nodes_m) {
        assert!(distance(*a, *b) < 1e-15);
    }
}

/// Lines of a section of an ASCII file, without its first and last.
fn section<'a>(lines: &'a mut [String], name: &str) -> &'a mut [String] {
    let start = lines.iter().position(|l| *l == format!("${name}")).unwrap();
    let end = lines
        .iter()
        .position(|l| *l == format!("$End{name}"))
        .unwrap();
    &mut lines[start + 1..end]
}

/// Puts another word in the place of one of a line.
fn set_word(line: &mut String, word: usize, value: &str) {
    let mut words: Vec<&str> = line.split_whitespace().collect();
    words[word] = value;
    *line = words.join(" ");
}

/// Number of the line that begins the last block of elements.
fn last_block(elements: &[String]) -> usize {
    let is_head = |line: &String| line.split_whitespace().count() == 4;
    elements.iter().rposition(is_head).unwrap()
}

fn edited(name: &str, edit: impl Fn(&mut Vec<String>)) -> Vec<u8> {
    let text = String::from_utf8(bytes(name)).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
    edit(&mut lines);
    (lines.join("\n") + "\n").into_bytes()
}

/// Dense tags that are not in the order of the file, as partitioners and renumbering write them:
/// element connectivity goes by tag.
#[test]
fn node_tags_need_not_stand_in_order() {
    let count = ready("blocks_order1.msh").nodes_m.len();
    let new = |tag: usize| (tag * 7 + 3) % count + 1; // 7 and 58 have no common divisor
    let permuted = edited("blocks_order1.msh", |lines| {
        let nodes = section(lines, "Nodes");
        let mut at = 1;
        while at < nodes.len() {
            let n: usize = nodes[at].split(' ').nth(3).unwrap().parse().unwrap();
            for line in &mut nodes[at + 1..at + 1 + n] {
                *line = new(line.parse().unwrap()).to_string();
            }
            at += 1 + 2 * n;
        }
        let elements = section(lines, "Elements");
        let mut at = 1;
        while at < elements.len() {
            let n: usize = elements[at].split(' ').nth(3).unwrap().parse().unwrap();
            for line in &mut elements[at + 1..at + 1 + n] {
                let words: Vec<usize> = line
                    .split_whitespace()
                    .map(|w| w.parse().unwrap())
                    .collect();
                let mut out = words[0].to_string();
                for &w in &words[1..] {
                    out += &format!(" {}", new(w));
                }
                *line = out;
            }
            at += 1 + n;
        }
    });
    let (plain, permuted) = (
        ready("blocks_order1.msh"),
        dovetail_mesh::parse(permuted, MM).unwrap(),
    );
    assert_eq!(permuted.nodes_m, plain.nodes_m);
    assert_eq!(permuted.elements, plain.elements);
    assert_eq!(permuted.groups, plain.groups);
    assert_ne!(permuted.node_tags, plain.node_tags);
}

#[test]
fn the_unit_is_applied() {
    let millimetres = ready("blocks_order1.msh");
    let metres = dovetail_mesh::parse(bytes("blocks_order1.msh"), 1.0).unwrap();
    for (a, b) in millimetres.nodes_m.iter().zip(&metres.nodes_m) {
        assert!(distance(*a, b.map(|x| x * MM)) < 1e-18);
    }
    for unit in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let found = dovetail_mesh::parse(bytes("blocks_order1.msh"), unit);
        assert!(matches!(found, Err(MeshError::Unit(_))));
    }
}

// ------------------------------------------------------------------------------ broken files

fn error_of(edit: impl Fn(&mut Vec<String>)) -> MeshError {
    dovetail_mesh::parse(edited("blocks_order1.msh", edit), MM).unwrap_err()
}

fn replace(lines: &mut [String], from: &str, to: &str) {
    let line = lines
        .iter_mut()
        .find(|l| *l == from)
        .unwrap_or_else(|| panic!("no line {from}"));
    *line = to.to_string();
}

#[test]
fn wrong_files_are_named_for_what_they_are() {
    use MeshError as E;
    let plain = String::from_utf8(bytes("blocks_order1.msh")).unwrap();
    assert!(matches!(dovetail_mesh::parse("", MM), Err(E::NoBytes)));
    assert!(matches!(
        dovetail_mesh::parse("a cube", MM),
        Err(E::UnknownFormat)
    ));
    let old = plain.replace("4.1 0 8", "3.0 0 8");
    let error = dovetail_mesh::parse(old, MM).unwrap_err();
    assert!(error.to_string().contains("-format msh41"), "{error}");
    for header in ["4.1 2 8", "4.1 0 4", "4.1 0", "x", "4.1 0 8 9", "4.1 1 8"] {
        let error = dovetail_mesh::parse(plain.replace("4.1 0 8", header), MM).unwrap_err();
        assert!(matches!(error, E::Header { .. }), "{header}: {error}");
    }
    let error = error_of(|l| {
        l.extend([
            "$PartitionedEntities".into(),
            "$EndPartitionedEntities".into(),
        ]);
    });
    has(
        &error.to_string(),
        "section $PartitionedEntities & breaks off",
    );
}

#[test]
fn wrong_content_is_named_for_what_it_is() {
    type Edit = Box<dyn Fn(&mut Vec<String>)>;
    let header = |section_name: &'static str, word: usize, value: &'static str| -> Edit {
        Box::new(move |lines| set_word(&mut section(lines, section_name)[0], word, value))
    };
    let line = |from: &'static str, to: &'static str| -> Edit {
        Box::new(move |lines| replace(lines, from, to))
    };
    let element = |word: usize, value: &'static str| -> Edit {
        Box::new(move |lines| {
            let last = section(lines, "Elements").last_mut().unwrap();
            set_word(last, word, value);
        })
    };
    let block = |word: usize, value: &'static str| -> Edit {
        Box::new(move |lines| {
            let lines = section(lines, "Elements");
            let at = last_block(lines);
            set_word(&mut lines[at], word, value);
        })
    };
    let node = |value: &'static str| -> Edit {
        Box::new(move |lines| *section(lines, "Nodes").last_mut().unwrap() = value.to_string())
    };
    let huge = "18446744073709551615";
    let cases: Vec<(&str, Edit)> = vec![
        ("Empty", header("Nodes", 1, "0")),
        ("Empty", header("Elements", 1, "0")),
        ("Total", header("Nodes", 1, "57")),
        ("Total", header("Elements", 1, "279")),
        ("Total", header("Nodes", 1, huge)),
        ("Malformed", header("Nodes", 1, "18446744073709551616")),
        ("Malformed", header("Nodes", 0, huge)),
        ("Total", header("Elements", 1, huge)),
        ("Malformed", header("Elements", 0, huge)),
        ("NotFinite", node("nan 0 0")),
        ("NotFinite", node("1e308 1e999 0")),
        ("NotFinite", node("0 -1e13 0")),
        ("Malformed", node("0 0 zero")),
        ("MissingNode", element(1, "4000")),
        ("TagTwice", element(0, "1")),
        (
            "RepeatedNode",
            Box::new(|lines| {
                let last = section(lines, "Elements").last_mut().unwrap();
                let node = last.split_whitespace().nth(1).unwrap().to_owned();
                set_word(last, 2, &node);
            }),
        ),
        ("UnknownEntity", block(0, "9")),
        ("UnknownEntity", block(1, "99")),
        ("UnsupportedElement", block(2, "26")),
        ("Malformed", block(2, "5")),
        ("Malformed", block(2, "4000")),
        ("Malformed", block(3, huge)),
        ("PhysicalName", line("3 1 \"upper\"", "3 1 upper")),
        ("PhysicalName", line("3 1 \"upper\"", "4 1 \"upper\"")),
        ("TagTwice", line("3 2 \"lower\"", "3 1 \"lower\"")),
        ("PhysicalNameCount", line("8", "9")),
        (
            "SharedTag",
            Box::new(|lines| {
                let nodes = section(lines, "Nodes");
                let at = nodes.iter().rposition(|l| !l.contains(' ')).unwrap();
                nodes[at] = nodes[at - 1].clone();
            }),
        ),
        (
            "TagTwice",
            Box::new(|lines| {
                let nodes = section(lines, "Nodes");
                nodes[2] = "2".to_string();
            }),
        ),
        ("Malformed", line("$Entities", "$")),
        (
            "Malformed",
            line(
                "$EndElements",
                "$EndElements\n$Nodes\n1 1 1 1\n3 1 0 0\n$EndNodes",
            ),
        ),
        (
            "MissingSection",
            Box::new(|lines| {
                let at = lines.iter().position(|l| l == "$Elements").unwrap();
                lines.truncate(at);
            }),
        ),
    ];
    for (i, (expected, edit)) in cases.iter().enumerate() {
        let error = dovetail_mesh::parse(edited("blocks_order1.msh", edit), MM).unwrap_err();
        let name = format!("{error:?}");
        assert!(
            name.starts_with(expected),
            "case {i}: expected {expected}, got {name}"
        );
        assert!(!error.to_string().is_empty());
    }
    assert!(dovetail_mesh::parse(edited("blocks_order1.msh", |_| ()), MM).is_ok());
}

/// Two orders in one file: the linear tetrahedra of one cube written as part of the quadratic file.
#[test]
fn mixed_orders_are_refused() {
    let linear = edited("blocks_order2.msh", |lines| {
        let elements = section(lines, "Elements");
        let at = last_block(elements);
        elements[at] = elements[at].replace(" 11 ", " 4 ");
        for line in &mut elements[at + 1..] {
            *line = line
                .split_whitespace()
                .take(5)
                .collect::<Vec<_>>()
                .join(" ");
        }
    });
    let error = quality::check(&dovetail_mesh::parse(linear, MM).unwrap()).unwrap_err();
    assert!(matches!(error, QualityError::MixedOrders { .. }), "{error}");
}

#[test]
fn elements_with_nodes_inside_faces_matter_only_where_a_group_names_them() {
    let with_quad = |group: &'static str| {
        edited("blocks_order1.msh", move |lines| {
            // A new surface entity with one quadrilateral of nine nodes, all there.
            let entities = section(lines, "Entities");
            entities[0] = "16 24 13 2".to_string();
            entities[1 + 16 + 24] += &format!("\n99 0 0 0 1 1 0 {group} 0 ");
            let elements = section(lines, "Elements");
            let mut words: Vec<u64> = elements[0].split(' ').map(|w| w.parse().unwrap()).collect();
            (words[0], words[1], words[3]) = (words[0] + 1, words[1] + 1, 9000);
            let words: Vec<String> = words.iter().map(u64::to_string).collect();
            elements[0] = words.join(" ") + "\n2 99 10 1\n9000 1 2 3 4 5 6 7 8 9 ";
        })
    };
    assert_eq!(
        dovetail_mesh::parse(with_quad("0"), MM).unwrap(),
        ready("blocks_order1.msh")
    );
    let error = dovetail_mesh::parse(with_quad("1 22"), MM)
        .unwrap_err()
        .to_string();
    has(&error, "9 nodes & base & SecondOrderIncomplete = 1");
}

/// A comment may quote a mesh file: no line of it is a section.
#[test]
fn what_looks_like_a_section_in_a_comment_is_none() {
    let quoted = "$EndMeshFormat\n$Comments\n$PartitionedEntities\n$PhysicalNames\n1\n\
                  3 1 \"quoted\"\n$EndPhysicalNames\n$Nodes\n1 1 1 1\n$Elements\n1 1 1 1\n$EndComments";
    let commented = edited("blocks_order1.msh", |lines| {
        replace(lines, "$EndMeshFormat", quoted);
    });
    assert_eq!(
        dovetail_mesh::parse(commented, MM).unwrap(),
        ready("blocks_order1.msh")
    );
    for name in ["Nodes", "Elements"] {
        let error = error_of(|lines| {
            let header = &mut section(lines, name)[0];
            *header = "1 0 1 1".to_string();
            replace(lines, "$EndMeshFormat", quoted);
        });
        assert!(matches!(error, MeshError::Empty { .. }), "{name}: {error}");
    }
}

#[test]
fn cut_off_files_are_errors() {
    for name in BLOCKS {
        let whole = bytes(name);
        let end = whole.iter().rposition(|&b| b == b'$').unwrap();
        for length in (0..=end).step_by(13) {
            let Err(error) = dovetail_mesh::parse(&whole[..length], MM) else {
                panic!("{name} is read when cut after {length} bytes");
            };
            assert!(error.to_string().len() < 2000);
        }
    }
}
