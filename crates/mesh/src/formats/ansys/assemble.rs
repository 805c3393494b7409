//! Conversion of an [`Archive`] to its [`Content`].

use std::collections::{BTreeMap, BTreeSet};

use super::super::content::Content;
use super::super::named_groups::Origin;
use super::super::numbered::{NumberedKind, PlacedMesh, Position};
use super::super::source::SourceFiles;
use super::super::tally::Tally;
use super::elements::kind_of;
use super::read::Archive;
use super::types::READ;
use crate::MeshError;
use crate::text;

/// Makes the content of an archive.
///
/// # Errors
/// Elements with too few nodes, or of no known shape, and nodes that are not there.
pub(super) fn assemble(mut archive: Archive, files: &SourceFiles) -> Result<Content, MeshError> {
    let mut left = Tally::default();
    add_elements(&mut archive, files, &mut left)?;
    let mut placed = std::mem::take(&mut archive.mesh).place(files)?;
    for component in &archive.components {
        placed.group_ranges(&component.name, component.of, &component.members);
    }
    add_parts(&mut placed, &archive);
    let used = solids(&placed).map(|e| archive.elements[e as usize].material);
    let (known, remarks) = archive.materials.finish(&used.collect());
    let numbers: Vec<u64> = archive.elements.iter().map(|e| e.material).collect();
    placed.give_materials(known, &numbers);
    let noted = noted(&archive, &left).into_iter().chain(remarks);
    placed.finish(noted, &left.names(), READ)
}

/// Moves the elements to the mesh. Those of other types are counted in `left`.
fn add_elements(
    archive: &mut Archive,
    files: &SourceFiles,
    left: &mut Tally,
) -> Result<(), MeshError> {
    let mut start = 0;
    for element in &archive.elements {
        let found = archive.types.get(&element.type_number);
        let nodes = archive.numbers.get(start..element.end).unwrap_or_default();
        start = element.end;
        let Some((kind, arranged)) = kind_of(found).arrange(nodes) else {
            let error = MeshError::NodesOfElement {
                element: element.label,
                kind: found.map_or_else(String::new, |found| found.name.clone()),
                expected: kind_of(found).nodes().unwrap_or(0),
                found: nodes.len(),
            };
            return Err(files.locate_error(element.place, "", error));
        };
        if kind == NumberedKind::Other {
            let unknown = || format!("type {}, which no ET defines", element.type_number);
            left.add(&found.map_or_else(unknown, |found| found.name.clone()), 1);
        }
        archive
            .mesh
            .add_element(element.label, kind, &arranged, element.place)?;
    }
    Ok(())
}

/// Elements of the file that are solids.
fn solids(placed: &PlacedMesh) -> impl Iterator<Item = u32> {
    let positions = placed.positions.iter().zip(0..);
    positions.filter_map(|(position, e)| matches!(position, Position::Solid(_)).then_some(e))
}

/// Adds the volumes of bodies, of materials and of element types, if there are several, and the
/// surfaces of the types that have faces.
fn add_parts(placed: &mut PlacedMesh, archive: &Archive) {
    let solids: BTreeSet<u32> = solids(placed).collect();
    let type_name = |number: u64| match archive.types.get(&number) {
        Some(found) => format!("{} {number}", found.name),
        None => format!("type {number}"),
    };
    let mut parts: Vec<BTreeMap<String, Vec<u32>>> = vec![BTreeMap::new(); 3];
    let mut bodies = BTreeSet::new();
    for (i, (name, [from, to])) in archive.bodies.iter().enumerate() {
        let name = match bodies.insert(name.to_ascii_uppercase()) {
            true => name.clone(),
            false => format!("{name} (body {})", i + 1),
        };
        let elements = solids.range(from..(to).max(from)).copied();
        parts[0].entry(name).or_default().extend(elements);
    }
    for &solid in &solids {
        let element = &archive.elements[solid as usize];
        let material = archive.materials.name_of(element.material);
        let of_type = type_name(element.type_number);
        parts[1].entry(material).or_default().push(solid);
        parts[2].entry(of_type).or_default().push(solid);
    }
    let mut known: BTreeSet<Vec<u32>> = BTreeSet::new();
    for part in parts {
        let is_whole = part.len() < 2;
        for (name, elements) in part {
            // One that is all solids has another name, and so has one that was here before.
            let is_new = elements.len() < solids.len() && known.insert(elements.clone());
            if is_new && !is_whole {
                placed.group_elements(&name, Origin::Part, elements);
            }
        }
    }
    let mut facets: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
    for (position, element) in placed.positions.iter().zip(0..) {
        if matches!(position, Position::Facet(_)) {
            let number = archive.elements[element as usize].type_number;
            facets.entry(number).or_default().push(element);
        }
    }
    for (number, elements) in facets {
        placed.group_elements(&type_name(number), Origin::Surface, elements);
    }
}

/// Remarks on unread contents, and on the units.
fn noted(archive: &Archive, left: &Tally) -> Vec<String> {
    let mut remarks = Vec::new();
    remarks.extend(left.sentence("Elements of these types were left aside", ""));
    let loads = ["D", "F", "SF", "SFE", "DBLOCK", "SFEBLOCK", "CE", "CP"];
    let hint = match loads.iter().any(|word| archive.aside.has(word)) {
        true => " Supports, joints and loads of the bodies are keys of the scene.",
        false => "",
    };
    remarks.extend(archive.aside.sentence("These commands were not read", hint));
    if archive.rotated_nodes > 0 {
        remarks.push(format!(
            "The coordinate systems of {} nodes were left aside: only loads and supports, which are \
             not read, refer to them.",
            archive.rotated_nodes
        ));
    }
    if let Some(units) = &archive.units {
        const KNOWN: [(&str, &str); 4] = [
            ("SI", "metre, kilogram, second (`units = \"m-kg-s\"`)"),
            ("MKS", "metre, kilogram, second (`units = \"m-kg-s\"`)"),
            ("MPA", "millimetre, tonne, second (`units = \"mm-t-s\"`)"),
            ("BIN", "inch, pound-force, second (`units = \"in-lbf-s\"`)"),
        ];
        let known = KNOWN.iter().find(|(word, _)| word == units);
        remarks.push(match known {
            Some((_, meaning)) => format!("The archive states its units (/UNITS): {meaning}."),
            None => format!(
                "The archive states its units: /UNITS,{}.",
                text::plain(units)
            ),
        });
    }
    remarks
}
