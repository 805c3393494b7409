//! A mesh file: parsed, its elements checked, its groups bound to the two bodies of
//! `meshes/blocks.geo`.

#![no_main]

mod checks;
mod limits;

use std::path::Path;
use std::sync::LazyLock;

use dovetail::scene;
use dovetail_mesh::quality;
use dovetail_mesh::text;
use dovetail_solver::model::{self, Assembly};

static ASSEMBLY: LazyLock<Assembly> = LazyLock::new(|| {
    let text = include_str!("blocks.toml");
    let scene = scene::parse(text, "blocks.toml", Path::new(""), &[]);
    let scene = scene.expect("blocks.toml is a scene");
    scene.assembly().expect("it has a mesh").clone()
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    let assembly = &*ASSEMBLY;
    let mesh = match dovetail_mesh::parse(bytes, 1e-3) {
        Ok(mesh) => mesh,
        Err(error) => {
            text::plain(&error.to_string());
            return;
        }
    };
    checks::mesh(&mesh);
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
    match model::bind(assembly, &mesh, None) {
        Ok(model) => {
            for pair in &model.pairs {
                assert!(pair.area_m2 > 0.0 && pair.area_m2.is_finite(), "{pair:?}");
            }
        }
        Err(error) => {
            text::plain(&error.to_string());
        }
    }
}
