//! Gmsh's MSH 4.1 files, ASCII and binary.
//!
//! `mshio` does the parsing, and its gaps are closed here. It skips `$PhysicalNames`. It drops node
//! tags that look dense and then takes file order for tag order, so the header is patched in memory
//! to look sparse. It looks for the end of an unknown section at every byte, across all blanks that
//! follow, so those sections are made blank. It trusts every count and tag, so all of them are
//! checked here.
//!
//! The elements that a physical group names are kept, with their nodes. Format: Gmsh reference
//! manual, "MSH file format".

use std::collections::{BTreeMap, HashMap, HashSet};

use mshio::mshfile::{ElementBlock, Entities, MshFile, Nodes};

use super::content::Content;
use super::gmsh_order::{COMPLETE, dimension_and_nodes, from_gmsh, group_name};
use super::sections::{
    Names, blank_other_sections, check_elements_header, content, encoding, keep_node_tags,
    physical_names, sections,
};
use crate::element;
use crate::{Group, MeshError};

/// Parses the bytes of a file, in the units of the file.
///
/// # Errors
/// Bytes that are not a whole mesh in MSH 4.1: see [`MeshError`].
pub fn parse(bytes: impl Into<Vec<u8>>) -> Result<Content, MeshError> {
    let mut bytes = bytes.into();
    let encoding = encoding(&bytes, "4.1")?;
    let sections = sections(&bytes)?;
    if content(&sections, "PartitionedEntities").is_some() {
        return Err(MeshError::Partitioned);
    }
    let names = physical_names(&bytes, &sections)?;
    check_elements_header(&bytes, encoding, &sections)?;
    blank_other_sections(&mut bytes, &sections);
    let max_node_tag = keep_node_tags(&mut bytes, encoding, &sections)?;
    let file = mshio::parse_msh_bytes(&bytes).map_err(|e| malformed(&bytes, &e))?;
    assemble(file, &names, max_node_tag)
}

fn malformed(bytes: &[u8], error: &mshio::MshParserError<&[u8]>) -> MeshError {
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
        byte,
        at: at.join(", "),
        reason,
    }
}

fn assemble(
    file: MshFile<u64, i32, f64>,
    names: &Names,
    max_node_tag: u64,
) -> Result<Content, MeshError> {
    let missing = |section| MeshError::MissingSection { section };
    let nodes = file.data.nodes.ok_or_else(|| missing("Nodes"))?;
    let elements = file.data.elements.ok_or_else(|| missing("Elements"))?;
    let (positions, tags) = flatten_nodes(&nodes, max_node_tag)?;
    let index_of: HashMap<u64, u32> = (0..).zip(&tags).map(|(i, &tag)| (tag, i)).collect();

    let found: u64 = elements
        .element_blocks
        .iter()
        .map(|b| b.elements.len() as u64)
        .sum();
    check_total("elements", elements.num_elements, found)?;
    let all = elements.element_blocks.iter().flat_map(|b| &b.elements);
    let range = (elements.min_element_tag, elements.max_element_tag);
    check_tags("element", all.map(|e| e.element_tag), range)?;

    let groups_of = groups_of_entities(file.data.entities.as_ref(), names)?;
    let mut content = Content {
        nodes: positions,
        node_tags: tags,
        groups: empty_groups(names, &groups_of)?,
        ..Content::default()
    };
    if content.groups.is_empty() {
        return Err(MeshError::NoGroups);
    }
    for block in &elements.element_blocks {
        let groups = groups_of.get(&(block.entity_dim, block.entity_tag)).ok_or(
            MeshError::UnknownEntity {
                dimension: block.entity_dim,
                entity: block.entity_tag,
            },
        )?;
        check_block(block, &index_of)?;
        let Some(first) = groups.first() else {
            continue; // on an entity that no physical group names
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
        append_block(&mut content, block, groups, dimension, &index_of);
    }
    Ok(content)
}

fn check_total(what: &'static str, said: u64, found: u64) -> Result<(), MeshError> {
    if said != found {
        return Err(MeshError::Total { what, said, found });
    }
    MeshError::check_number(what, found)
}

fn check_tags(
    what: &'static str,
    tags: impl Iterator<Item = u64>,
    (min, max): (u64, u64),
) -> Result<(), MeshError> {
    let mut seen = HashSet::new();
    for tag in tags {
        if tag < min || tag > max {
            return Err(MeshError::TagRange {
                what,
                tag,
                min,
                max,
            });
        }
        if !seen.insert(tag) {
            return Err(MeshError::TagTwice { what, tag });
        }
    }
    Ok(())
}

/// Positions (in the file's unit) and tags of all nodes, in the order of the file.
fn flatten_nodes(
    nodes: &Nodes<u64, i32, f64>,
    max_node_tag: u64,
) -> Result<(Vec<[f64; 3]>, Vec<u64>), MeshError> {
    let found = nodes.node_blocks.iter().map(|b| b.nodes.len() as u64).sum();
    check_total("nodes", nodes.num_nodes, found)?;
    let mut positions = Vec::with_capacity(found as usize);
    let mut tags = vec![0; found as usize];
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
    let range = (nodes.min_node_tag, max_node_tag);
    check_tags("node", tags.iter().copied(), range)?;
    Ok((positions, tags))
}

type GroupsOf = BTreeMap<(i32, i32), Vec<String>>;

/// Names of the physical groups of each entity, given by (dimension, entity tag). See
/// [`group_name`].
fn groups_of_entities(
    entities: Option<&Entities<i32, f64>>,
    names: &Names,
) -> Result<GroupsOf, MeshError> {
    let Some(entities) = entities else {
        return Err(MeshError::NoGroups);
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
    let mut groups_of = GroupsOf::new();
    for (dimension, tag, physical) in points.chain(curves).chain(surfaces).chain(volumes) {
        let mut groups: Vec<String> = physical
            .iter()
            .map(|p| p.unsigned_abs()) // the sign is an orientation
            .map(|p| group_name(names, dimension, p))
            .collect();
        groups.sort();
        groups.dedup();
        if groups_of.insert((dimension.into(), tag), groups).is_some() {
            return Err(MeshError::TagTwice {
                what: "entity",
                tag: tag.unsigned_abs().into(),
            });
        }
    }
    Ok(groups_of)
}

fn empty_groups(names: &Names, groups_of: &GroupsOf) -> Result<BTreeMap<String, Group>, MeshError> {
    let mut groups = BTreeMap::new();
    let named = names.iter().map(|((d, _), name)| (*d, name));
    let used = groups_of
        .iter()
        .flat_map(|((d, _), names)| names.iter().map(|n| (*d as u8, n)));
    for (dimension, name) in named.chain(used) {
        let group = groups
            .entry(name.clone())
            .or_insert(Group::empty(dimension));
        if group.dimension != dimension {
            return Err(MeshError::GroupNameTwice { name: name.clone() });
        }
    }
    Ok(groups)
}

fn check_block(
    block: &ElementBlock<u64, i32>,
    index_of: &HashMap<u64, u32>,
) -> Result<(), MeshError> {
    for e in &block.elements {
        for (i, &node) in e.nodes.iter().enumerate() {
            let element = e.element_tag;
            if !index_of.contains_key(&node) {
                return Err(MeshError::MissingNode { element, node });
            }
            if e.nodes[..i].contains(&node) {
                return Err(MeshError::RepeatedNode { element, node });
            }
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
) {
    let list = match dimension {
        2 => &mut content.facets,
        _ => &mut content.elements,
    };
    let first = list.len() as u32;
    if dimension >= 2 {
        for e in &block.elements {
            let nodes = |i: usize| index_of[&e.nodes[i]];
            let solid = element::ElementType::with_nodes(e.nodes.len()).filter(|_| dimension == 3);
            match solid.map(from_gmsh) {
                Some(order) => list.push(e.element_tag, order.iter().map(|&i| nodes(i))),
                None => list.push(e.element_tag, (0..e.nodes.len()).map(nodes)),
            }
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
}
