//! Gmsh's MSH 4.1 files, ASCII and binary.
//!
//! `mshio` does the parsing. What it leaves out is done here: it skips `$PhysicalNames`; it drops
//! node tags that look dense and then takes file order for tag order, so the header is patched in
//! memory to look sparse; it looks for the end of a section that it does not know at every byte,
//! across all blanks that follow, so those sections are made blank; and it believes every count and
//! tag, so all of them are checked here.
//!
//! Kept is what a physical group names, and the nodes that is made of. Format: Gmsh reference
//! manual, "MSH file format".

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use mshio::mshfile::{ElementBlock, ElementType, Entities, MshFile, Nodes};

use super::sections::{
    Names, blank_other_sections, check_elements_header, content, encoding, keep_node_tags,
    physical_names, sections,
};
use super::{ElementOrder, FARTHEST_M, Group, Mesh, MeshError};
use crate::input;

/// Reads a mesh file. Lengths are multiplied by `metres_per_unit`.
///
/// # Errors
/// A file that cannot be read, or as [`parse`].
pub fn read(path: &Path, metres_per_unit: f64) -> Result<Mesh, MeshError> {
    let bytes = input::bytes(path).map_err(|source| MeshError::Io {
        path: path.to_path_buf(),
        source,
    })?;
    parse(bytes, metres_per_unit).map_err(|e| MeshError::File {
        path: path.to_path_buf(),
        source: Box::new(e),
    })
}

/// Parses the bytes of a mesh file. Lengths are multiplied by `metres_per_unit`.
///
/// # Errors
/// Bytes that are no whole mesh of tetrahedra in MSH 4.1: see [`MeshError`].
pub fn parse(bytes: impl Into<Vec<u8>>, metres_per_unit: f64) -> Result<Mesh, MeshError> {
    if !(metres_per_unit.is_finite() && metres_per_unit > 0.0) {
        return Err(MeshError::Unit(metres_per_unit));
    }
    let mut bytes = bytes.into();
    let encoding = encoding(&bytes)?;
    let sections = sections(&bytes)?;
    if content(&sections, "PartitionedEntities").is_some() {
        return Err(MeshError::Partitioned);
    }
    let names = physical_names(&bytes, &sections)?;
    check_elements_header(&bytes, encoding, &sections)?;
    blank_other_sections(&mut bytes, &sections);
    let max_node_tag = keep_node_tags(&mut bytes, encoding, &sections)?;
    let file = mshio::parse_msh_bytes(&bytes).map_err(|e| malformed(&bytes, &e))?;
    assemble(file, &names, max_node_tag, metres_per_unit)
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

/// Element shapes that are read: dimension and, but for points, order.
fn shape(kind: ElementType) -> Option<(u8, Option<ElementOrder>)> {
    use ElementOrder::{Linear, Quadratic};
    Some(match kind {
        ElementType::Pnt => (0, None),
        ElementType::Lin2 => (1, Some(Linear)),
        ElementType::Lin3 => (1, Some(Quadratic)),
        ElementType::Tri3 => (2, Some(Linear)),
        ElementType::Tri6 => (2, Some(Quadratic)),
        ElementType::Tet4 => (3, Some(Linear)),
        ElementType::Tet10 => (3, Some(Quadratic)),
        _ => return None,
    })
}

fn assemble(
    file: MshFile<u64, i32, f64>,
    names: &Names,
    max_node_tag: u64,
    metres_per_unit: f64,
) -> Result<Mesh, MeshError> {
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
    let mut mesh = Mesh {
        order: ElementOrder::Linear,
        nodes_m: Vec::new(),
        node_tags: Vec::new(),
        tets: Vec::new(),
        tet_tags: Vec::new(),
        facets: Vec::new(),
        facet_tags: Vec::new(),
        groups: empty_groups(names, &groups_of)?,
    };
    if mesh.groups.is_empty() {
        return Err(MeshError::NoGroups);
    }
    let mut by_order: [Option<&String>; 2] = [None, None];
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
        let Some((dimension, order)) = shape(block.element_type) else {
            return Err(MeshError::UnsupportedElement {
                group: first.clone(),
                kind: format!("{:?}", block.element_type),
            });
        };
        if block.entity_dim != i32::from(dimension) {
            return Err(MeshError::Dimension {
                kind: format!("type {:?}", block.element_type),
                entity: block.entity_tag,
                dimension: block.entity_dim,
            });
        }
        if let Some(order) = order {
            mesh.order = order;
            by_order[order as usize] = Some(first);
        }
        append_block(&mut mesh, block, groups, dimension, &index_of);
    }
    if let [Some(linear), Some(quadratic)] = by_order {
        return Err(MeshError::MixedOrders {
            linear: linear.clone(),
            quadratic: quadratic.clone(),
        });
    }
    if mesh.tets.is_empty() {
        return Err(MeshError::NoTetrahedra);
    }
    keep_used_nodes(&mut mesh, &positions, &tags, metres_per_unit)?;
    Ok(mesh)
}

fn check_total(what: &'static str, said: u64, found: u64) -> Result<(), MeshError> {
    if said != found {
        return Err(MeshError::Total { what, said, found });
    }
    if found >= u64::from(u32::MAX) {
        return Err(MeshError::TooMany { what, found });
    }
    Ok(())
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

/// (dimension, entity tag) -> names of its physical groups. A group without a name is called after
/// its dimension and tag, such as `surface 12`.
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
            .map(|p| match names.get(&(dimension, p)) {
                Some(name) => name.clone(),
                None => {
                    let kind = ["point", "curve", "surface", "volume"][usize::from(dimension)];
                    format!("{kind} {p}")
                }
            })
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
        let group = groups.entry(name.clone()).or_insert(Group {
            dimension,
            elements: Vec::new(),
            nodes: Vec::new(),
        });
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

/// Adds the elements of a block (node indices still those of the file).
fn append_block(
    mesh: &mut Mesh,
    block: &ElementBlock<u64, i32>,
    groups: &[String],
    dimension: u8,
    index_of: &HashMap<u64, u32>,
) {
    let nodes = || {
        block
            .elements
            .iter()
            .flat_map(|e| &e.nodes)
            .map(|n| index_of[n])
    };
    let tags = block.elements.iter().map(|e| e.element_tag);
    let first = match dimension {
        2 => mesh.facet_tags.len(),
        _ => mesh.tet_tags.len(),
    } as u32;
    match dimension {
        3 => {
            mesh.tets.extend(nodes());
            mesh.tet_tags.extend(tags);
        }
        2 => {
            mesh.facets.extend(nodes());
            mesh.facet_tags.extend(tags);
        }
        _ => {}
    }
    for name in groups {
        if let Some(group) = mesh.groups.get_mut(name) {
            group.nodes.extend(nodes());
            if dimension >= 2 {
                group
                    .elements
                    .extend(first..first + block.elements.len() as u32);
            }
        }
    }
}

/// Drops the nodes that no kept element has and numbers the others, in the order of the file.
fn keep_used_nodes(
    mesh: &mut Mesh,
    positions: &[[f64; 3]],
    tags: &[u64],
    metres_per_unit: f64,
) -> Result<(), MeshError> {
    const UNUSED: u32 = u32::MAX;
    let mut new_index = vec![UNUSED; positions.len()];
    let in_groups = mesh.groups.values().flat_map(|g| &g.nodes);
    for &node in in_groups {
        new_index[node as usize] = 0;
    }
    for (old, new) in new_index.iter_mut().enumerate() {
        if *new == UNUSED {
            continue;
        }
        *new = mesh.nodes_m.len() as u32;
        let at = positions[old].map(|x| x * metres_per_unit);
        if at.iter().any(|x| !x.is_finite() || x.abs() > FARTHEST_M) {
            return Err(MeshError::NotFinite {
                tag: tags[old],
                at: positions[old],
            });
        }
        mesh.nodes_m.push(at);
        mesh.node_tags.push(tags[old]);
    }
    for node in mesh.tets.iter_mut().chain(&mut mesh.facets) {
        *node = new_index[*node as usize];
    }
    for group in mesh.groups.values_mut() {
        for node in &mut group.nodes {
            *node = new_index[*node as usize];
        }
        group.nodes.sort_unstable();
        group.nodes.dedup();
    }
    Ok(())
}
