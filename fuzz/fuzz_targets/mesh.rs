//! A mesh file: parsed, its elements checked, its groups bound to the two bodies of
//! `meshes/blocks.geo`.

#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use dovetail::scene;
use dovetail_solver::mesh::{self, Mesh, quality};
use dovetail_solver::model::{self, Assembly};
use dovetail_solver::text;

static ASSEMBLY: LazyLock<Assembly> = LazyLock::new(|| {
    let text = include_str!("blocks.toml");
    let scene = scene::parse(text, "blocks.toml", Path::new(""), &[]);
    let scene = scene.expect("blocks.toml is a scene");
    scene.assembly().expect("it has a mesh").clone()
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let assembly = &*ASSEMBLY;
    let mesh = match mesh::parse(bytes, 1e-3) {
        Ok(mesh) => mesh,
        Err(error) => {
            text::plain(&error.to_string());
            return;
        }
    };
    check_indices(&mesh);
    let quality = match quality::check(&mesh) {
        Ok(quality) => quality,
        Err(error) => {
            text::plain(&error.to_string());
            return;
        }
    };
    assert!(
        quality.worst_shape > 0.0 && quality.worst_shape < 1.0 + 1e-9,
        "{quality:?}"
    );
    assert!(
        quality.volume_m3 > 0.0 && quality.volume_m3.is_finite(),
        "{quality:?}"
    );
    match model::bind(assembly, &mesh) {
        Ok(model) => {
            for pair in &model.pairs {
                assert!(pair.area_m2 > 0.0 && pair.area_m2.is_finite(), "{pair:?}");
            }
        }
        Err(error) => {
            text::plain(&error.to_string());
        }
    }
});

/// Every index of a mesh leads to a node or an element, and every number is finite.
fn check_indices(mesh: &Mesh) {
    let (per_tet, per_facet) = (mesh.order.nodes_per_tet(), mesh.order.nodes_per_facet());
    assert_eq!(mesh.tets.len(), per_tet * mesh.elements.len());
    assert_eq!(mesh.facets.len(), per_facet * mesh.facets.len());
    assert_eq!(mesh.nodes_m.len(), mesh.node_tags.len());
    assert!(mesh.nodes_m.iter().flatten().all(|x| x.is_finite()));
    let is_node = |n: &u32| (*n as usize) < mesh.nodes_m.len();
    assert!(mesh.tets.iter().chain(&mesh.facets).all(is_node));
    for group in mesh.groups.values() {
        assert!(group.nodes.iter().all(is_node));
        assert!(group.nodes.is_sorted_by(|a, b| a < b));
        let count = match group.dimension {
            3 => mesh.elements.len(),
            2 => mesh.facets.len(),
            _ => 0,
        };
        assert!(group.elements.iter().all(|e| (*e as usize) < count));
    }
}
