//! Conversion of [`Bulk`] data to their [`Content`].

use std::collections::{BTreeMap, BTreeSet};

use super::super::content::Content;
use super::super::named_groups::Origin;
use super::super::numbered::{Members, PlacedMesh, Position};
use super::super::source::SourceFiles;
use super::names::Named;
use super::read::Bulk;
use super::types::READ;
use crate::MeshError;

/// Makes the content of bulk data.
///
/// # Errors
/// Nodes and systems that are not there, and elements of no known shape.
pub(super) fn assemble(mut bulk: Bulk, files: &SourceFiles) -> Result<Content, MeshError> {
    let mut mesh = std::mem::take(&mut bulk.mesh);
    std::mem::take(&mut bulk.positions).apply(&mut mesh, files)?;
    let mut placed = mesh.place(files)?;
    placed.use_nodes(&bulk.other_nodes);
    add_properties(&mut placed, &bulk);
    add_sets(&mut placed, &bulk);
    let material_of = |property: &u64| bulk.properties.get(property).and_then(|(_, m)| *m);
    let numbers: Vec<u64> = bulk
        .properties_of_elements
        .iter()
        .map(|property| material_of(property).unwrap_or(0))
        .collect();
    let elements = numbers.iter().zip(&placed.positions);
    let used: BTreeSet<u64> = elements
        .filter(|(_, position)| matches!(position, Position::Solid(_)))
        .map(|(number, _)| *number)
        .collect();
    let known = bulk
        .materials
        .finish(&bulk.names, bulk.mass_factor.unwrap_or(1.0));
    placed.give_materials(known, &numbers);
    let mut noted = bulk.materials.remarks(&bulk.names, |id| used.contains(&id));
    noted.extend(remarks(&bulk));
    let mut elements = bulk.aside.names();
    elements.retain(|name| name.starts_with('C'));
    placed.finish(noted, &elements, READ)
}

/// Adds a volume or a surface for each property, and for each component of HyperMesh.
fn add_properties(placed: &mut PlacedMesh, bulk: &Bulk) {
    let mut parts: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
    for (property, element) in bulk.properties_of_elements.iter().zip(0..) {
        parts.entry(*property).or_default().push(element);
    }
    let mut known = BTreeSet::new();
    for (property, elements) in parts {
        let card = bulk
            .properties
            .get(&property)
            .map_or("property", |(card, _)| card);
        let name = bulk.names.get(Named::Property, property);
        let numbered = format!("{card} {property}");
        // Two properties of one name are told apart by their numbers.
        let name = name.filter(|name| known.insert(name.to_ascii_uppercase()));
        placed.group_elements(name.unwrap_or(&numbered), Origin::Part, elements);
    }
    for (name, ranges) in bulk.names.components() {
        if known.insert(name.to_ascii_uppercase()) {
            placed.group_ranges(name, Members::Elements, ranges);
        }
    }
}

fn add_sets(placed: &mut PlacedMesh, bulk: &Bulk) {
    for (name, ranges) in &bulk.node_sets {
        placed.group_ranges(name, Members::Nodes, ranges);
    }
    for (name, ranges) in &bulk.element_sets {
        placed.group_ranges(name, Members::Elements, ranges);
    }
    // A set of case control is one of nodes or of elements, by the request that names it.
    for (number, ranges) in &bulk.case_sets {
        let name = bulk.names.get(Named::Set, *number);
        let name = name.map_or_else(|| format!("SET {number}"), str::to_owned);
        for members in [Members::Nodes, Members::Elements] {
            if placed.has_all(members, ranges) {
                placed.group_ranges(&name, members, ranges);
            }
        }
    }
}

/// Remarks on unread contents.
fn remarks(bulk: &Bulk) -> Vec<String> {
    const JOINTS: [&str; 5] = ["RBE2", "RBE3", "RBAR", "MPC", "BCONTACT"];
    const LOADS: [&str; 6] = ["FORCE", "PLOAD4", "SPCADD", "MOMENT", "GRAV", "RFORCE"];
    let has = |words: &[&str]| words.iter().any(|word| bulk.aside.has(word));
    let hint = match has(&JOINTS) || has(&LOADS) {
        true => " Supports, joints and loads of the bodies are keys of the scene.",
        false => "",
    };
    let mut remarks = Vec::new();
    remarks.extend(bulk.aside.sentence("These cards were not read", hint));
    remarks.extend(bulk.sections.sentence(
        "These sections of bulk data (lines) were left aside, with their nodes and elements",
        "",
    ));
    if bulk.displacement_systems > 0 {
        remarks.push(format!(
            "The displacement systems (CD) of {} nodes were left aside: only loads and supports, \
             which are not read, refer to them.",
            bulk.displacement_systems
        ));
    }
    if let Some(factor) = bulk.mass_factor.filter(|factor| *factor != 1.0) {
        remarks.push(format!(
            "The densities were multiplied by {factor} (PARAM,WTMASS)."
        ));
    }
    if let Some(units) = &bulk.units {
        let units = crate::text::plain(units);
        remarks.push(format!(
            "The file states its units: DTI,UNITS with {units}."
        ));
    }
    remarks
}
