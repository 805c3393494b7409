//! Gmsh's MSH 4.1 files, ASCII and binary, and MSH 4.0 as text.
//!
//! `mshio` does the parsing, and its gaps are closed here and in `plain`, which copies a file to the
//! form that it reads. It skips `$PhysicalNames`. It trusts every count and tag, so all of them are
//! checked here; like Gmsh, the reader ignores the range of tags that a section announces.
//!
//! The elements that a physical group names are kept, with their nodes. In a file without any
//! physical group the entities of the geometry are the groups. Format: Gmsh reference manual, "MSH
//! file format".

use std::collections::{BTreeMap, HashMap, HashSet};

use mshio::mshfile::{ElementBlock, Elements, Entities, MshFile, Nodes};

use super::collapse;
use super::content::Content;
use super::gmsh_order::{COMPLETE, dimension_and_nodes, entity_names, gmsh_positions, group_names};
use super::plain::{MshSource, Plain};
use super::sections::{Encoding, Names, Sections, physical_names};
use crate::element;
use crate::{Group, MeshError};

/// Parses the bytes of a file, in the units of the file.
///
/// # Errors
/// Bytes that are not a whole mesh in MSH 4: see [`MeshError`].
pub fn parse(bytes: impl AsRef<[u8]>) -> Result<Content, MeshError> {
    let bytes = bytes.as_ref();
    let sections = Sections::parse(bytes)?;
    let format = sections.format(bytes)?;
    let is_text = format.encoding == Encoding::Ascii;
    if !(format.version == 4.1 || format.version == 4.0 && is_text) {
        return Err(format.other_version());
    }
    let names = physical_names(bytes, &sections, format.version)?;
    let source = MshSource {
        bytes,
        sections: &sections,
        format,
    };
    let mut plain = Plain::new(&source, false)?;
    if mshio::parse_msh_bytes(&plain.bytes).is_err_and(|e| has_parameters(&e)) {
        plain = Plain::new(&source, true)?;
    }
    let file = mshio::parse_msh_bytes(&plain.bytes).map_err(|e| malformed(&plain, &e))?;
    assemble(file, &names)
}

/// Returns `true` if mshio stopped at nodes with parameters.
fn has_parameters(error: &mshio::MshParserError<&[u8]>) -> bool {
    let contexts = error
        .backtrace
        .iter()
        .filter_map(|(_, kind)| kind.context());
    contexts
        .into_iter()
        .any(|context| context.contains("parametric nodes"))
}

fn malformed(plain: &Plain, error: &mshio::MshParserError<&[u8]>) -> MeshError {
    let bytes = &plain.bytes;
    let trace: Vec<_> = error.filter_msh_errors().collect();
    let byte = trace
        .first()
        .map_or(bytes.len(), |(rest, _)| bytes.len() - rest.len());
    let at: Vec<&str> = trace
        .iter()
        .rev()
        .filter_map(|(_, k)| k.context())
        .collect();
    let reason = trace
        .iter()
        .find(|(_, k)| k.context().is_none())
        .map_or("unexpected end or text".to_string(), |(_, k)| k.to_string());
    MeshError::Malformed {
        byte: plain.file_position(byte),
        at: at.join(", "),
        reason,
    }
}

fn assemble(file: MshFile<u64, i32, f64>, names: &Names) -> Result<Content, MeshError> {
    let missing = |section| MeshError::MissingSection { section };
    let nodes = file.data.nodes.ok_or_else(|| missing("Nodes"))?;
    let elements = file.data.elements.ok_or_else(|| missing("Elements"))?;
    let (positions, tags) = flatten_nodes(&nodes)?;
    let index_of: HashMap<u64, u32> = (0..).zip(&tags).map(|(i, &tag)| (tag, i)).collect();

    let count: u64 = elements
        .element_blocks
        .iter()
        .map(|b| b.elements.len() as u64)
        .sum();
    check_total("elements", elements.num_elements, count)?;
    let all_elements = elements.element_blocks.iter().flat_map(|b| &b.elements);
    check_tags("element", all_elements.map(|e| e.element_tag))?;

    let mut content = Content {
        nodes: positions,
        node_tags: tags,
        ..Content::default()
    };
    let groups_of = groups_of(file.data.entities.as_ref(), &elements, names, &mut content)?;
    let mut left_out = 0;
    for block in &elements.element_blocks {
        let groups = groups_of.get(&(block.entity_dim, block.entity_tag)).ok_or(
            MeshError::UnknownEntity {
                dimension: block.entity_dim,
                entity: block.entity_tag,
            },
        )?;
        check_block(block, &index_of)?;
        let Some(first) = groups.first() else {
            // On an entity that no physical group names.
            left_out += if block.entity_dim == 3 {
                block.elements.len()
            } else {
                0
            };
            let nodes = block.elements.iter().flat_map(|e| &e.nodes);
            content.other_nodes.extend(nodes.map(|n| index_of[n]));
            continue;
        };
        let kind = block.element_type as u64;
        let group = || first.clone();
        let Some((dimension, nodes)) = dimension_and_nodes(kind) else {
            return Err(MeshError::UnsupportedElement {
                group: group(),
                kind: format!("{:?}", block.element_type),
            });
        };
        if COMPLETE.contains(&kind) {
            let group = group();
            return Err(MeshError::CompleteElement { group, nodes });
        }
        if block.entity_dim != i32::from(dimension) {
            return Err(MeshError::Dimension {
                kind: format!("type {:?}", block.element_type),
                entity: block.entity_tag,
                dimension: block.entity_dim,
            });
        }
        append_block(&mut content, block, groups, dimension, &index_of)?;
    }
    content.solids_left_out(left_out);
    content.name_all();
    Ok(content)
}

fn check_total(what: &'static str, said: u64, found: u64) -> Result<(), MeshError> {
    if said != found {
        return Err(MeshError::Total { what, said, found });
    }
    MeshError::check_number(what, found)
}

fn check_tags(what: &'static str, tags: impl Iterator<Item = u64>) -> Result<(), MeshError> {
    let mut seen = HashSet::new();
    for tag in tags {
        if !seen.insert(tag) {
            return Err(MeshError::TagTwice { what, tag });
        }
    }
    Ok(())
}

/// Positions (in the file's unit) and tags of all nodes, in the order of the file.
fn flatten_nodes(nodes: &Nodes<u64, i32, f64>) -> Result<(Vec<[f64; 3]>, Vec<u64>), MeshError> {
    let count = nodes.node_blocks.iter().map(|b| b.nodes.len() as u64).sum();
    check_total("nodes", nodes.num_nodes, count)?;
    let mut positions = Vec::with_capacity(count as usize);
    let mut tags = vec![0; count as usize];
    for block in &nodes.node_blocks {
        // A map with fewer tags than nodes leaves tag 0 (never valid) for one of them.
        for (&tag, &i) in block.node_tags.iter().flatten() {
            tags[positions.len() + i] = tag;
        }
        positions.extend(block.nodes.iter().map(|n| [n.x, n.y, n.z]));
    }
    if let Some(i) = tags.iter().position(|&tag| tag == 0) {
        return Err(MeshError::SharedTag { at: positions[i] });
    }
    check_tags("node", tags.iter().copied())?;
    Ok((positions, tags))
}

type GroupsOf = BTreeMap<(i32, i32), Vec<String>>;

/// Names of the groups of each entity, given by (dimension, entity tag). Adds the groups.
fn groups_of(
    entities: Option<&Entities<i32, f64>>,
    elements: &Elements<u64, i32>,
    names: &Names,
    content: &mut Content,
) -> Result<GroupsOf, MeshError> {
    let physical = physical_of(entities)?;
    let of_all = physical
        .iter()
        .flat_map(|((dimension, _), tags)| tags.iter().map(|tag| (*dimension as u8, *tag)));
    let has_physical = physical.values().any(|tags| !tags.is_empty());
    let (groups_of, names) = if has_physical {
        let names = group_names(names, of_all);
        let of_entity = physical.iter().map(|(&(dimension, entity), tags)| {
            let name = |tag: &u32| names[&(dimension as u8, *tag)].clone();
            let mut names: Vec<String> = tags.iter().map(name).collect();
            names.sort();
            names.dedup();
            ((dimension, entity), names)
        });
        (of_entity.collect(), names)
    } else {
        let blocks = elements.element_blocks.iter();
        let used: Vec<(i32, i32)> = blocks.map(|b| (b.entity_dim, b.entity_tag)).collect();
        let key = |(dimension, tag): (i32, i32)| {
            let dimension = u8::try_from(dimension).ok().filter(|d| *d <= 3);
            dimension.map(|dimension| (dimension, tag.unsigned_abs()))
        };
        let names = entity_names(used.iter().copied().filter_map(key), content);
        let groups = used.into_iter().filter_map(|entity| {
            let name = names.get(&key(entity)?)?;
            Some((entity, vec![name.clone()]))
        });
        (groups.collect(), names)
    };
    for ((dimension, _), name) in names {
        content.join_group(name, Group::empty(dimension))?;
    }
    Ok(groups_of)
}

/// Tags of the physical groups of each entity, given by (dimension, entity tag).
fn physical_of(
    entities: Option<&Entities<i32, f64>>,
) -> Result<BTreeMap<(i32, i32), Vec<u32>>, MeshError> {
    let Some(entities) = entities else {
        return Ok(BTreeMap::new());
    };
    let points = entities.points.iter().map(|e| (0, e.tag, &e.physical_tags));
    let curves = entities.curves.iter().map(|e| (1, e.tag, &e.physical_tags));
    let surfaces = entities
        .surfaces
        .iter()
        .map(|e| (2, e.tag, &e.physical_tags));
    let volumes = entities
        .volumes
        .iter()
        .map(|e| (3, e.tag, &e.physical_tags));
    let mut names = BTreeMap::new();
    for (dimension, tag, physical) in points.chain(curves).chain(surfaces).chain(volumes) {
        // The sign is an orientation.
        let tags: Vec<u32> = physical.iter().map(|tag| tag.unsigned_abs()).collect();
        if names.insert((dimension, tag), tags).is_some() {
            return Err(MeshError::TagTwice {
                what: "entity",
                tag: tag.unsigned_abs().into(),
            });
        }
    }
    Ok(names)
}

fn check_block(
    block: &ElementBlock<u64, i32>,
    index_of: &HashMap<u64, u32>,
) -> Result<(), MeshError> {
    for e in &block.elements {
        if let Some(&node) = e.nodes.iter().find(|node| !index_of.contains_key(node)) {
            let element = e.element_tag;
            return Err(MeshError::MissingNode { element, node });
        }
    }
    Ok(())
}

/// Adds the elements of a block.
fn append_block(
    content: &mut Content,
    block: &ElementBlock<u64, i32>,
    groups: &[String],
    dimension: u8,
    index_of: &HashMap<u64, u32>,
) -> Result<(), MeshError> {
    let list = match dimension {
        2 => &mut content.facets,
        _ => &mut content.elements,
    };
    let first = list.len() as u32;
    if dimension >= 2 {
        let tags = &content.node_tags;
        for e in &block.elements {
            let node = |i: usize| index_of[&e.nodes[i]];
            let all = 0..e.nodes.len();
            let solid = element::ElementType::from_node_count(all.len()).filter(|_| dimension == 3);
            let nodes: Vec<u32> = match solid.map(gmsh_positions) {
                Some(order) => order.iter().map(|&i| node(i)).collect(),
                None => all.map(node).collect(),
            };
            let kept = match dimension {
                3 => collapse::solid(e.element_tag, &nodes, tags)?,
                _ => collapse::facet(e.element_tag, &nodes, tags)?,
            };
            list.push(e.element_tag, kept.iter().copied());
        }
    }
    let nodes = || block.elements.iter().flat_map(|e| &e.nodes);
    for name in groups {
        if let Some(group) = content.groups.get_mut(name) {
            group.nodes.extend(nodes().map(|n| index_of[n]));
            if dimension >= 2 {
                let elements = first..first + block.elements.len() as u32;
                group.elements.extend(elements);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::words::has;

    /// A tetrahedron with a face and an edge in groups of one name.
    const TEXT: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n\
        1 9 \"wall\"\n2 3 \"wall\"\n3\t7 \"blade\"\n$EndPhysicalNames\n\
        $Entities\n1 1 1 1\n5 0 0 1 0\n4 0 0 0 1 0 0 1 9 0\n2 0 0 0 1 1 0 1 3 1 4\n1 0 0 0 1 1 1 1 7 1 2\n$EndEntities\n\
        $Nodes\n2 4 1 4\n2 2 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n3 1 0 1\n4\n0 0 1\n$EndNodes\n\
        $Elements\n3 3 1 3\n1 4 1 1\n1 1 2\n2 2 2 1\n2 1 2 3\n3 1 4 1\n3 1 2 3 4\n$EndElements\n";

    /// The text after replacements, each of which must apply.
    fn changed(changes: &[[&str; 2]]) -> String {
        changes.iter().fold(TEXT.to_owned(), |text, [from, to]| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        })
    }

    fn whole() -> Content {
        let content = parse(TEXT).unwrap();
        let groups: Vec<(&str, u8)> = content
            .groups
            .iter()
            .map(|(name, group)| (name.as_str(), group.dimension))
            .collect();
        assert_eq!(groups, [("blade", 3), ("wall", 2), ("wall (curve)", 1)]);
        assert_eq!(content.elements.element_nodes(0), [0, 1, 2, 3]);
        assert_eq!(content.remarks, [""; 0]);
        content
    }

    #[test]
    fn what_gmsh_skips_is_skipped() {
        let comments =
            "$Comments\nmade on Monday, as\n$MeshFormat\n3 0 8\n$EndComments\n$MeshFormat\n4.1";
        let texts = [
            changed(&[
                ["4.1 0 8\n", "4.1 0 8 \t\n"],
                ["$Nodes\n", "$Nodes  \n"],
                ["$EndNodes", "$EndNodes "],
            ]),
            TEXT.replace('\n', "\r\n"),
            TEXT.replace('\n', " \n\n"),
            changed(&[["$MeshFormat\n4.1", comments]]),
            changed(&[["$MeshFormat", "\n  a line of text\n$MeshFormat"]]),
            changed(&[[
                "$EndNodes\n",
                "$EndNodes\na line of text\n$Periodic\n0\n$EndPeriodic\n",
            ]]),
            changed(&[["2 4 1 4\n", "2 4 0 3\n"], ["3 3 1 3\n", "3 3 0 0\n"]]),
        ];
        for text in texts {
            let content = super::super::parse(text.as_bytes(), "", &mut |_| unreachable!());
            assert_eq!(content.unwrap(), whole(), "{text}");
        }
    }

    #[test]
    fn parameters_of_nodes_are_left_out() {
        let on_surface = [
            "2 2 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n",
            "2 2 1 3\n1\n2\n3\n0 0 0 7 8\n1 0 0 7 8\n0 1 0 7 8e-3\n",
        ];
        let in_volume = ["3 1 0 1\n4\n0 0 1\n", "3 1 1 1\n4\n0 0 1 7 8 9\n"];
        let empty = ["2 4 1 4\n", "4 4 1 4\n1 4 1 0\n0 5 1 0\n"];
        for changes in [
            &[on_surface][..],
            &[in_volume, empty],
            &[on_surface, in_volume, empty],
        ] {
            assert_eq!(parse(changed(changes)).unwrap(), whole());
        }
        let cut = changed(&[on_surface, ["7 8e-3", "7"]]);
        has(&parse(&cut).unwrap_err().to_string(), "section $Nodes");
        for (bytes, parameters) in [binary(false, true), binary(true, true), binary(true, false)]
            .iter()
            .zip([true, true, false])
        {
            let content = parse(bytes).unwrap();
            let groups = BTreeMap::from([("volume 1".to_owned(), whole().groups["blade"].clone())]);
            assert_eq!(content.nodes, whole().nodes, "{parameters}");
            assert_eq!(content.groups, groups, "{parameters}");
        }
    }

    /// The tetrahedron as binary numbers, without groups; its nodes perhaps with parameters.
    fn binary(big: bool, parametric: bool) -> Vec<u8> {
        let mut out = b"$MeshFormat\n4.1 1 8\n".to_vec();
        let int = |out: &mut Vec<u8>, values: &[i32]| {
            for value in values {
                out.extend(if big {
                    value.to_be_bytes()
                } else {
                    value.to_le_bytes()
                });
            }
        };
        let size = |out: &mut Vec<u8>, values: &[u64]| {
            for value in values {
                out.extend(if big {
                    value.to_be_bytes()
                } else {
                    value.to_le_bytes()
                });
            }
        };
        let float = |out: &mut Vec<u8>, values: &[f64]| {
            for value in values {
                out.extend(if big {
                    value.to_be_bytes()
                } else {
                    value.to_le_bytes()
                });
            }
        };
        int(&mut out, &[1]);
        out.extend(b"\n$EndMeshFormat\n$Nodes\n");
        size(&mut out, &[2, 4, 1, 4]);
        for (dimension, tags) in [(2, &[1, 2, 3][..]), (3, &[4])] {
            int(&mut out, &[dimension, 1, parametric.into()]);
            size(&mut out, &[tags.len() as u64]);
            size(&mut out, tags);
            for tag in tags {
                float(&mut out, &whole().nodes[*tag as usize - 1]);
                if parametric {
                    float(&mut out, &[7.0, 8.0, 9.0][..dimension as usize]);
                }
            }
        }
        out.extend(b"\n$EndNodes\n$Elements\n");
        size(&mut out, &[1, 1, 1, 1]);
        int(&mut out, &[3, 1, 4]);
        size(&mut out, &[1, 1, 1, 2, 3, 4]);
        out.extend(b"\n$EndElements\n");
        out
    }

    /// The same in MSH 4.0: tags before dimensions, nodes line by line, and points with six numbers.
    #[test]
    fn the_order_of_msh_4_0_is_read() {
        let old = changed(&[
            ["4.1 0 8", "4 0 8"],
            ["5 0 0 1 0\n", "5 0 0 1 0 0 1 0\n"],
            [
                "2 4 1 4\n2 2 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n",
                "2 4\n2 2 0 3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n",
            ],
            ["3 1 0 1\n4\n0 0 1\n", "1 3 0 1\n4 0 0 1\n"],
            ["3 3 1 3\n1 4 1 1\n", "3 3\n4 1 1 1\n"],
            ["3 1 4 1\n", "1 3 4 1\n"],
        ]);
        assert_eq!(parse(&old).unwrap(), whole());
        let binary = old.replace("4 0 8\n", "4 1 8\n\u{1}\0\0\0");
        let words = "MSH version 4 (binary) is not read & -format msh41";
        has(&parse(binary).unwrap_err().to_string(), words);
        let higher = old.replace("2 2 2 1\n", "2 2 21 1\n");
        has(
            &parse(higher).unwrap_err().to_string(),
            "Gmsh's type 21, which is not read",
        );
    }

    #[test]
    fn entities_of_partitions_have_their_groups() {
        let parts = "$EndEntities\n$PartitionedEntities\n2\n1\n9 1\n0 0 0 1\n8 3 1 2 1 2 0 0 0 1 1 1 1 7 2 2 -2\n$EndPartitionedEntities\n";
        let text = changed(&[
            ["$EndEntities\n", parts],
            ["3 1 0 1\n4\n", "3 8 0 1\n4\n"],
            ["3 1 4 1\n", "3 8 4 1\n"],
        ]);
        assert_eq!(parse(text).unwrap(), whole());
    }

    /// Gmsh gives the surface between two partitions the groups of the volume, whose numbers are those
    /// of other groups among surfaces.
    #[test]
    fn a_surface_between_partitions_has_no_group_of_surfaces() {
        let with_parent = |parent: &str| {
            let parts = format!(
                "$EndEntities\n$PartitionedEntities\n2\n0\n0 0 1 0\n9 {parent} 2 1 2 0 0 0 1 1 1 1 3 0\n$EndPartitionedEntities\n"
            );
            let text = changed(&[["$EndEntities\n", &parts], ["2 2 2 1\n", "2 9 2 1\n"]]);
            parse(text).unwrap()
        };
        assert_eq!(with_parent("2 2").groups, whole().groups);
        let cut = with_parent("3 1").groups;
        let is_empty = |group: &Group| group.dimension != 2 || group.elements.is_empty();
        assert!(cut.values().all(is_empty));
    }

    #[test]
    fn entities_are_the_groups_of_a_file_without_physical_groups() {
        let none = changed(&[
            [" 1 9 0\n", " 0 0\n"],
            [" 1 3 1 4\n", " 0 0\n"],
            [" 1 7 1 2\n", " 0 0\n"],
        ]);
        let end = TEXT.find("$Entities").unwrap()..TEXT.find("$Nodes").unwrap();
        let mut without = TEXT.to_owned();
        without.replace_range(end, "");
        for text in [none, without] {
            let content = parse(text).unwrap();
            let names: Vec<&str> = content.groups.keys().map(String::as_str).collect();
            assert_eq!(names, ["curve 4", "surface 2", "volume 1"]);
            assert_eq!(content.groups["volume 1"].elements, [0]);
            has(
                &content.remarks[0],
                "no physical groups & such as `volume 1`",
            );
        }
    }

    #[test]
    fn solids_of_no_group_are_counted() {
        let some = changed(&[[" 1 7 1 2\n", " 0 0\n"]]);
        let content = parse(some).unwrap();
        assert_eq!(content.elements.len(), 0);
        has(
            &content.remarks[0],
            "1 solid elements are in no physical group & `Physical Volume`",
        );
        let unknown = changed(&[["3 1 4 1\n", "3 6 4 1\n"]]);
        has(
            &parse(unknown).unwrap_err().to_string(),
            "entity 6 of dimension 3",
        );
        let same = changed(&[["\"blade\"", "\"wall\""]]);
        let content = parse(same).unwrap();
        let names: Vec<&str> = content.groups.keys().map(String::as_str).collect();
        assert_eq!(names, ["wall", "wall (curve)", "wall (surface)"]);
    }

    #[test]
    fn a_fault_is_at_its_byte_in_the_file() {
        let text = changed(&[
            ["$Nodes\n", "$Comments\nlong\n$EndComments\n$Nodes \n"],
            ["0 1 0\n3", "0 x 0\n3"],
        ]);
        let error = parse(&text).unwrap_err();
        let MeshError::Malformed { byte, .. } = error else {
            panic!("{error}");
        };
        let expected = text.find("0 x 0").unwrap();
        assert!(
            (expected..expected + 4).contains(&byte),
            "{byte} {expected}"
        );
    }
}
