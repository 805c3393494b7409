//! Checks of every mesh that a reader gives, shared by the targets.

use dovetail_mesh::formats::Content;
use dovetail_mesh::text;
use dovetail_mesh::{Connectivity, ElementType, Group, Mesh, MeshError, quality};

/// The content as a mesh in metres, of which every element was looked at.
#[allow(dead_code)] // not every target has it
pub fn content(content: Result<Content, MeshError>) {
    let content = match content {
        Ok(content) => content,
        Err(error) => {
            text::plain(&error.to_string());
            return;
        }
    };
    assert_eq!(content.nodes.len(), content.node_tags.len());
    lists(content.nodes.len(), &content.elements, &content.facets);
    for remark in &content.remarks {
        text::plain(remark);
    }
    for material in &content.materials {
        assert!(material.elements.is_sorted_by(|a, b| a < b));
        let is_element = |e: &u32| (*e as usize) < content.elements.len();
        assert!(material.elements.iter().all(is_element));
    }
    match content.into_mesh(1e-3.into()) {
        Ok(mesh) => {
            self::mesh(&mesh);
            if let Err(error) = quality::check(&mesh) {
                text::plain(&error.to_string());
            }
        }
        Err(error) => {
            text::plain(&error.to_string());
        }
    }
}

/// Every index of a mesh leads to a node or an element, and every number is finite.
pub fn mesh(mesh: &Mesh) {
    assert_eq!(mesh.nodes_m.len(), mesh.node_tags.len());
    assert!(mesh.nodes_m.iter().flatten().all(|x| x.is_finite()));
    lists(mesh.nodes_m.len(), &mesh.elements, &mesh.facets);
    for group in mesh.groups.values() {
        self::group(group, mesh);
    }
}

fn lists(nodes: usize, elements: &Connectivity, facets: &Connectivity) {
    for list in [elements, facets] {
        assert!(list.nodes().iter().all(|n| (*n as usize) < nodes));
        assert_eq!(list.len(), list.tags().len());
    }
    assert!(
        elements
            .iter()
            .all(|e| ElementType::from_node_count(e.len()).is_some())
    );
    assert!(facets.iter().all(|f| [3, 4, 6, 8].contains(&f.len())));
}

fn group(group: &Group, mesh: &Mesh) {
    assert!(
        group
            .nodes
            .iter()
            .all(|n| (*n as usize) < mesh.nodes_m.len())
    );
    assert!(group.nodes.is_sorted_by(|a, b| a < b));
    let list = match group.dimension {
        3 => &mesh.elements,
        2 => &mesh.facets,
        _ => return assert!(group.elements.is_empty()),
    };
    for element in &group.elements {
        let nodes = list.element_nodes(*element as usize);
        assert!(nodes.iter().all(|n| group.nodes.binary_search(n).is_ok()));
    }
}
