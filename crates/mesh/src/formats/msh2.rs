//! Gmsh's MSH 2.0, 2.1 and 2.2 files, ASCII and binary.
//!
//! An element names its physical group itself. Gmsh writes an element that is in several groups
//! once for each of them: such copies become one element, with the tag of the first. Elements
//! without a physical group are left out. In a file without any physical group the entities of the
//! geometry are the groups. Format: Gmsh reference manual, "MSH file format version 2", and
//! `GModelIO_MSH2.cpp` of Gmsh.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap, HashSet};

use super::collapse;
use super::content::Content;
use super::gmsh_order::{COMPLETE, dimension_and_nodes, entity_names, gmsh_positions, group_names};
use super::numbers::SectionNumbers;
use super::sections::{Encoding, Names, Sections, physical_names};
use crate::element::ElementType;
use crate::{Group, MeshError, sort_once};

/// Parses the bytes of a mesh file. Lengths are those of the file.
///
/// # Errors
/// Bytes that are not a whole mesh in MSH 2.2: see [`MeshError`].
pub fn parse(bytes: &[u8]) -> Result<Content, MeshError> {
    let sections = Sections::parse(bytes)?;
    let format = sections.format(bytes)?;
    if !is_version_2(format.version) {
        return Err(format.other_version());
    }
    let names = physical_names(bytes, &sections, format.version)?;
    let of = |section| {
        Ok(SectionNumbers {
            bytes,
            encoding: format.encoding,
            section,
            at: sections.needed(section)?,
        })
    };
    let mut reader = Reader::new(&names);
    let parametric = "ParametricNodes";
    match sections.content(parametric) {
        Some(_) => reader.nodes(of(parametric)?, true)?,
        None => reader.nodes(of("Nodes")?, false)?,
    }
    reader.elements(of("Elements")?)?;
    reader.finish()
}

/// Returns `true` for the versions that this reader reads.
pub(super) fn is_version_2(version: f64) -> bool {
    (2.0..3.0).contains(&version)
}

struct Reader<'a> {
    names: &'a Names,
    content: Content,
    index_of: HashMap<u64, u32>,
    element_tags: HashSet<u64>,
    /// Elements with the tags that Gmsh calls physical and elementary.
    read: Vec<MshElement>,
    /// Numbers of the elements by dimension and nodes.
    found: HashMap<(u8, Vec<u32>), u32>,
    groups: BTreeMap<(u8, u32), Group>,
}

struct MshElement {
    tag: u64,
    kind: u64,
    dimension: u8,
    physical: u32,
    elementary: u32,
    nodes: Vec<u32>,
}

impl<'a> Reader<'a> {
    fn new(names: &'a Names) -> Self {
        Self {
            names,
            content: Content::default(),
            index_of: HashMap::new(),
            element_tags: HashSet::new(),
            read: Vec::new(),
            found: HashMap::new(),
            groups: BTreeMap::new(),
        }
    }

    fn group(&mut self, dimension: u8, tag: u32) -> &mut Group {
        let group = self.groups.entry((dimension, tag));
        group.or_insert_with(|| Group::empty(dimension))
    }

    /// Reads the nodes. Those of `$ParametricNodes` are followed by the dimension and the tag of an
    /// entity, and by the parameters: one on a curve, two on a surface.
    fn nodes(
        &mut self,
        mut numbers: SectionNumbers<'_>,
        parametric: bool,
    ) -> Result<(), MeshError> {
        let least = match numbers.encoding {
            Encoding::Ascii => "1 0 0 0\n".len(),
            _ => 4 + 3 * 8,
        };
        let count = numbers.count(least)?;
        MeshError::check_number("nodes", count as u64)?;
        for index in 0..count {
            let tag = numbers.natural("a node's tag")?;
            let at = [numbers.float()?, numbers.float()?, numbers.float()?];
            if parametric {
                let dimension = numbers.natural("a dimension")?;
                numbers.int()?;
                let parameters = if dimension < 3 { dimension } else { 0 };
                for _ in 0..parameters {
                    numbers.float()?;
                }
            }
            if self.index_of.insert(tag, index as u32).is_some() {
                return Err(MeshError::TagTwice { what: "node", tag });
            }
            self.content.nodes.push(at);
            self.content.node_tags.push(tag);
        }
        check_end(&numbers, count)
    }

    fn elements(&mut self, mut numbers: SectionNumbers<'_>) -> Result<(), MeshError> {
        let ascii = numbers.encoding == Encoding::Ascii;
        let least = if ascii { "1 1 0 1 2\n".len() } else { 8 };
        let count = numbers.count(least)?;
        if count == 0 {
            return Err(MeshError::Empty { what: "elements" });
        }
        let mut left = count;
        while left > 0 {
            // A binary file has the type once for several elements.
            let (first_tag, kind, in_block) = if ascii {
                let tag = numbers.natural("an element's tag")?;
                (Some(tag), numbers.natural("a type")?, 1)
            } else {
                let kind = numbers.natural("a type")?;
                (None, kind, numbers.natural("a number of elements")?)
            };
            let tags = numbers.natural("a number of tags")?;
            if in_block == 0 || in_block > left as u64 {
                let reason = format!("a block of {in_block} elements, where {left} are left");
                return Err(numbers.error(numbers.at.start, reason));
            }
            left -= in_block as usize;
            for _ in 0..in_block {
                let tag = match first_tag {
                    Some(tag) => tag,
                    None => numbers.natural("an element's tag")?,
                };
                self.element(&mut numbers, tag, kind, tags)?;
            }
        }
        check_end(&numbers, count)
    }

    fn element(
        &mut self,
        numbers: &mut SectionNumbers<'_>,
        tag: u64,
        kind: u64,
        tags: u64,
    ) -> Result<(), MeshError> {
        let mut groups = [0; 2];
        for i in 0..tags {
            let found = numbers.int()?;
            if let Some(group) = groups.get_mut(i as usize) {
                // The sign is an orientation.
                *group = u32::try_from(found.unsigned_abs()).map_err(|_| {
                    let reason = format!("a group has the tag {found}");
                    numbers.error(numbers.at.start, reason)
                })?;
            }
        }
        let Some((dimension, count)) = dimension_and_nodes(kind) else {
            let kind = kind.to_string();
            return Err(MeshError::ElementKind { element: tag, kind });
        };
        let mut nodes = Vec::with_capacity(count);
        for _ in 0..count {
            let node = numbers.natural("a node")?;
            let missing = MeshError::MissingNode { element: tag, node };
            nodes.push(*self.index_of.get(&node).ok_or(missing)?);
        }
        if !self.element_tags.insert(tag) {
            return Err(MeshError::TagTwice {
                what: "element",
                tag,
            });
        }
        let [physical, elementary] = groups;
        self.read.push(MshElement {
            tag,
            kind,
            dimension,
            physical,
            elementary,
            nodes,
        });
        Ok(())
    }

    /// Adds an element, unless it exists already, and puts it into a group.
    fn keep(&mut self, element: MshElement, group: u32) -> Result<(), MeshError> {
        let MshElement {
            tag,
            dimension,
            nodes,
            ..
        } = element;
        let tags = &self.content.node_tags;
        let nodes: Vec<u32> = match dimension {
            3 => {
                let solid = ElementType::from_node_count(nodes.len());
                let order = solid.map_or(&[][..], gmsh_positions);
                let nodes: Vec<u32> = order.iter().map(|i| nodes[*i]).collect();
                collapse::solid(tag, &nodes, tags)?.into_owned()
            }
            2 => collapse::facet(tag, &nodes, tags)?.into_owned(),
            _ => nodes,
        };
        self.group(dimension, group).nodes.extend(&nodes);
        let list = match dimension {
            3 => &mut self.content.elements,
            2 => &mut self.content.facets,
            _ => return Ok(()),
        };
        let index = match self.found.entry((dimension, nodes)) {
            Entry::Occupied(entry) => *entry.get(),
            Entry::Vacant(entry) => {
                let index = list.len() as u32;
                list.push(tag, entry.key().1.iter().copied());
                *entry.insert(index)
            }
        };
        self.group(dimension, group).elements.push(index);
        Ok(())
    }

    fn finish(mut self) -> Result<Content, MeshError> {
        let has_physical = self.read.iter().any(|element| element.physical != 0);
        let mut left_out = 0;
        for element in std::mem::take(&mut self.read) {
            let group = match has_physical {
                true => element.physical,
                false => element.elementary,
            };
            if has_physical && group == 0 {
                left_out += usize::from(element.dimension == 3);
                self.content.other_nodes.extend(element.nodes);
                continue;
            }
            if COMPLETE.contains(&element.kind) {
                let key = (element.dimension, group);
                return Err(MeshError::CompleteElement {
                    group: group_names(self.names, [key])[&key].clone(),
                    nodes: element.nodes.len(),
                });
            }
            self.keep(element, group)?;
        }
        let used = self.groups.keys().copied();
        let names = match has_physical {
            true => group_names(self.names, used),
            false => entity_names(used, &mut self.content),
        };
        for (key, name) in names {
            let group = self.groups.remove(&key);
            let group = group.unwrap_or_else(|| Group::empty(key.0));
            self.content.join_group(name, group)?;
        }
        self.content.solids_left_out(left_out);
        for group in self.content.groups.values_mut() {
            sort_once(&mut group.nodes);
            sort_once(&mut group.elements);
        }
        self.content.name_all();
        Ok(self.content)
    }
}

fn check_end(numbers: &SectionNumbers<'_>, said: usize) -> Result<(), MeshError> {
    if numbers.is_at_end() {
        return Ok(());
    }
    let reason = format!("it has more than the {said} items that it announces");
    Err(numbers.error(numbers.at.start, reason))
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{assert_middles, assert_near, elements, quadratic};
    use super::*;
    use crate::element::Shape;
    use dovetail_testkit::words::{cases, has};
    use std::collections::BTreeSet;

    const ASCII: &[u8] = elements!("order2_msh2.msh");
    const BINARY: &[u8] = elements!("order2_msh2_binary.msh");
    const LINEAR: &[u8] = elements!("order1_msh2.msh");

    /// A tetrahedron with a face, from the text after `change`.
    fn one(change: impl Fn(&str) -> String) -> Result<Content, MeshError> {
        let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"blade\"\n\
            $EndPhysicalNames\n$Nodes\n4\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n$EndNodes\n\
            $Elements\n2\n5 4 2 7 1 10 20 30 40\n6 2 2 9 1 10 30 20\n$EndElements\n";
        parse(change(text).as_bytes())
    }

    /// Message of the error that a changed text leads to.
    fn message(from: &str, to: &str) -> String {
        let change = |text: &str| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        };
        one(change).unwrap_err().to_string()
    }

    #[test]
    fn every_type_stands_in_its_group() {
        for (bytes, order) in [(LINEAR, 1), (ASCII, 2), (BINARY, 2)] {
            let content = parse(bytes).unwrap();
            let shapes = |group: &str| -> BTreeSet<Shape> {
                let elements = content.groups[group].elements.iter();
                let nodes = elements.map(|e| content.elements.element_nodes(*e as usize).len());
                nodes
                    .map(|n| ElementType::from_node_count(n).unwrap().shape)
                    .collect()
            };
            assert_eq!(shapes("hexahedra"), [Shape::Hexahedron].into());
            assert_eq!(shapes("wedges"), [Shape::Wedge].into());
            let others = [Shape::Tetrahedron, Shape::Pyramid, Shape::Wedge];
            assert_eq!(shapes("mixed"), others.into());
            let count = |group: &str| content.groups[group].elements.len();
            assert_eq!(
                (count("hexahedra"), count("wedges"), count("mixed")),
                (8, 4, 80)
            );
            let edge = &content.groups["edge"];
            assert_eq!(
                (edge.dimension, edge.elements.len(), edge.nodes.len()),
                (1, 0, 5 * order + 3)
            );
            let facets: BTreeSet<_> = content.facets.iter().map(<[u32]>::len).collect();
            assert_eq!(facets, [3 * order, 4 * order].into());
        }
    }

    #[test]
    fn middles_lie_between_the_corners_of_their_edges() {
        for bytes in [ASCII, BINARY] {
            let types = assert_middles(&parse(bytes).unwrap());
            assert_eq!(types, quadratic(&Shape::ALL));
        }
    }

    /// gmsh writes text with 16 digits.
    #[test]
    fn text_and_both_byte_orders_say_the_same() {
        let (text, binary) = (parse(ASCII).unwrap(), parse(BINARY).unwrap());
        assert_near(&text.nodes, &binary.nodes, 1e-14);
        let nodes = binary.nodes.clone();
        assert_eq!(Content { nodes, ..text }, binary);
        assert_eq!(parse(&swapped(BINARY)).unwrap(), binary);
    }

    /// The file with every number in the other byte order.
    fn swapped(bytes: &[u8]) -> Vec<u8> {
        let find = |word: &[u8]| bytes.windows(word.len()).position(|w| w == word).unwrap();
        let behind_count = |section: &str| {
            let start = find(section.as_bytes()) + section.len();
            start + bytes[start..].iter().position(|b| *b == b'\n').unwrap() + 1
        };
        let mut out = bytes.to_vec();
        let header = find(b"2.2 1 8\n") + 8;
        out[header..header + 4].reverse();
        let nodes = &mut out[behind_count("$Nodes\n")..find(b"\n$EndNodes")];
        assert_eq!(nodes.len() % 28, 0);
        for node in nodes.chunks_mut(28) {
            node[..4].reverse();
            node[4..].chunks_mut(8).for_each(<[u8]>::reverse);
        }
        let elements = behind_count("$Elements\n")..find(b"\n$EndElements");
        out[elements].chunks_mut(4).for_each(<[u8]>::reverse);
        out
    }

    #[test]
    fn tags_may_be_sparse_and_groups_nameless() {
        let content = one(str::to_owned).unwrap();
        assert_eq!(content.node_tags, [10, 20, 30, 40]);
        assert_eq!(
            (content.elements.tags(), content.elements.element_nodes(0)),
            (&[5][..], &[0, 1, 2, 3][..])
        );
        assert_eq!(content.groups["blade"].elements, [0]);
        assert_eq!(
            (
                content.groups["surface 9"].dimension,
                content.facets.element_nodes(0)
            ),
            (2, &[0, 2, 1][..])
        );
    }

    #[test]
    fn an_element_of_two_groups_is_one_element() {
        let twice = |text: &str| {
            let second = "$Elements\n3\n7 4 2 -8 1 10 20 30 40\n";
            text.replace("$Elements\n2\n", second)
        };
        let content = one(twice).unwrap();
        assert_eq!(content.elements.len(), 1);
        assert_eq!(content.groups["volume 8"].elements, [0]);
        assert_eq!(content.groups["blade"].elements, [0]);
    }

    #[test]
    fn elements_of_no_group_are_left_out() {
        let content = one(|text| text.replace("6 2 2 9 1", "6 2 2 0 1")).unwrap();
        assert_eq!((content.facets.len(), content.groups.len()), (0, 1));
        let content = one(|text| text.replace("6 2 2 9 1", "6 2 0")).unwrap();
        assert_eq!(content.facets.len(), 0);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let table = r#"
            20 1 0 0 => 10 1 0 0 => node tag 10 occurs twice
            6 2 2 9 => 5 2 2 9 => element tag 5 occurs twice
            20 30 40 => 20 30 50 => element 5 names node 50, which the file does not have
            20 30 40 => 20 30 20 => element 5 names node 20 twice
            6 2 2 9 => 6 20 2 9
            => element 6 is of Gmsh's type 20, which is not read: mesh with Mesh.ElementOrder 1
            6 2 2 9 1 10 30 20 => 6 2 2 9 1 10 30 => section $Elements): it breaks off
            $Nodes\n4 => $Nodes\n3 => it has more than the 3 items that it announces
            $Nodes\n4 => $Nodes\n123456789 => it announces 123456789 items and is shorter
            $Elements\n2 => $Elements\n0 => the mesh has no elements
            20 1 0 0 => 20 1 x 0 => expected a number
            20 1 0 0 => -20 1 0 0 => a node's tag is -20
            6 2 2 9 1 => 6 2 2 99999999999 1 => a group has the tag 99999999999
            6 2 2 9 1 => 6 2 -2 9 1 => a number of tags is -2
            $Nodes\n => $ParametricNodes\n => it has no $EndParametricNodes
            2.2 0 8 => 1.9 0 8 => MSH version 1.9 is not read, only 4.1, 4.0 as text, and 2
            2.2 0 8 => 2.2 0 4 => the $MeshFormat line `2.2 0 4` is not understood
            "#;
        for [from, to, words] in cases(table) {
            has(&message(&from, &to), &words);
        }
    }

    #[test]
    fn older_files_and_parameters_of_nodes_are_read() {
        let expected = one(str::to_owned).unwrap();
        for version in ["2.1 0 8", "2.0 0 8", "2 0 8", "2.2 0 8 "] {
            let older = |text: &str| {
                let text = text.replace("2.2 0 8", version);
                match version.contains(".1") || version.contains(".2") {
                    true => text,
                    false => text.replace("3 7 \"blade\"", "7 \"blade\""),
                }
            };
            assert_eq!(one(older).unwrap(), expected, "{version}");
        }
        let parametric = |text: &str| {
            let text = text.replace("Nodes\n", "ParametricNodes\n");
            let text = text.replace("10 0 0 0\n", "10 0 0 0 0 1\n");
            let text = text.replace("20 1 0 0\n", "20 1 0 0 1 1 0.25\n");
            let text = text.replace("30 0 1 0\n", "30 0 1 0 2 1 0.25 0.75\n");
            text.replace("40 0 0 1\n", "40 0 0 1 3 1\n")
        };
        assert_eq!(one(parametric).unwrap(), expected);
    }

    #[test]
    fn entities_are_the_groups_of_a_file_without_physical_groups() {
        let none = |text: &str| {
            let names = text.find("$PhysicalNames").unwrap()..text.find("$Nodes").unwrap();
            let text = [&text[..names.start], &text[names.end..]].concat();
            text.replace("5 4 2 7 1 ", "5 4 2 0 3 ")
                .replace("6 2 2 9 1 ", "6 2 2 0 4 ")
        };
        let content = one(none).unwrap();
        let names: Vec<&str> = content.groups.keys().map(String::as_str).collect();
        assert_eq!(names, ["surface 4", "volume 3"]);
        has(&content.remarks[0], "no physical groups");
        let without_tags = |text: &str| {
            text.replace("5 4 2 7 1 ", "5 4 0 ")
                .replace("6 2 2 9 1 ", "6 2 0 ")
        };
        assert_eq!(one(without_tags).unwrap().groups["volume 0"].elements, [0]);
        let solid_only = one(|text| text.replace("5 4 2 7 1 ", "5 4 2 0 1 ")).unwrap();
        has(
            &solid_only.remarks[0],
            "1 solid elements are in no physical group",
        );
    }

    #[test]
    fn groups_of_one_name_are_one_or_have_a_word_behind_it() {
        let names = "$PhysicalNames\n3\n2 9 \"blade\"\n3 8 \"blade\"\n";
        let text = |text: &str| {
            let second = "$Elements\n3\n7 4 2 8 1 20 10 30 40\n";
            text.replace("$PhysicalNames\n1\n", names)
                .replace("$Elements\n2\n", second)
        };
        let content = one(text).unwrap();
        let names: Vec<&str> = content.groups.keys().map(String::as_str).collect();
        assert_eq!(names, ["blade", "blade (surface)"]);
        assert_eq!(content.groups["blade"].elements, [0, 1]);
    }

    #[test]
    fn nodes_inside_faces_have_their_remedy() {
        let with = |physical: u32| {
            let points = (1..=9).map(|i| format!("{i} {i} 0 {}\n", i * i));
            let points: String = points.collect();
            format!(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9\n{points}$EndNodes\n\
                 $Elements\n1\n1 10 2 {physical} 1 1 2 3 4 5 6 7 8 9\n$EndElements\n"
            )
        };
        for (physical, group) in [(3, "surface 3"), (0, "surface 1")] {
            let found = parse(with(physical).as_bytes()).unwrap_err().to_string();
            has(&found, &format!("group `{group}` has elements of 9 nodes"));
            has(&found, "Mesh.SecondOrderIncomplete = 1");
        }
        let other = "2\n2 1 2 5 1 1 2\n1 10";
        let beside = with(0).replace("1\n1 10", other);
        assert!(parse(beside.as_bytes()).is_ok(), "it is in no group");
    }

    #[test]
    fn a_file_that_breaks_off_is_an_error_at_any_byte() {
        for bytes in [LINEAR, BINARY] {
            for end in (0..bytes.len() - 2).step_by(7) {
                assert!(parse(&bytes[..end]).is_err(), "{end}");
            }
        }
    }
}
