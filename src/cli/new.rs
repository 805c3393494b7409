//! `dovetail new`: writes a folder with an initial scene, its geometry, and the schema by which an
//! editor completes its keys.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use clap::ValueEnum;

use super::error::Error;
use crate::error::RunError;
use crate::scene::check::fields::is_name;
use crate::schema;
use dovetail_export::words::shell_word;
use dovetail_export::{ExportError, create_folder, write_file};

/// Template of a new scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Template {
    /// A rotating blade held in its disc by a dovetail
    Dovetail,
    /// A rotating blade held in its disc by a fir tree with two teeth a side
    FirTree,
    /// A block pressed on another one, at rest
    TwoBlocks,
    /// A rotating blade whose dovetail is held by rigid ground
    RigidGround,
}

/// Name of the schema file, which the first line of a scene refers to.
const SCHEMA: &str = "scene.schema.json";
const SCENE: &str = "scene.toml";
/// Line with the name of the scene in a template.
const NAME: &str = "name = \"NAME\"";

impl Template {
    fn scene(self) -> &'static str {
        match self {
            Self::Dovetail => include_str!("../../templates/dovetail.toml"),
            Self::FirTree => include_str!("../../templates/fir_tree.toml"),
            Self::TwoBlocks => include_str!("../../templates/two_blocks.toml"),
            Self::RigidGround => include_str!("../../templates/rigid_ground.toml"),
        }
    }

    /// Name and text of the script that gmsh meshes.
    fn geometry(self) -> (&'static str, &'static str) {
        match self {
            Self::Dovetail | Self::RigidGround => {
                ("dovetail.geo", include_str!("../../geometry/dovetail.geo"))
            }
            Self::FirTree => ("fir_tree.geo", include_str!("../../templates/fir_tree.geo")),
            Self::TwoBlocks => ("blocks.geo", include_str!("../../templates/blocks.geo")),
        }
    }
}

/// Writes the files of a template into a new folder. The scene is named after the last component of
/// its path. Returns a text with the files written and the next step.
///
/// # Errors
/// [`Error::NewName`] if that component is not a valid name, [`Error::NewExists`] if the folder
/// exists, and errors of writing a file, after which the folder is removed.
pub(super) fn write(folder: &Path, template: Template) -> Result<String, Error> {
    let name = folder.file_name().and_then(|name| name.to_str());
    let Some(name) = name.filter(|name| is_name(name)) else {
        return Err(Error::NewName {
            name: folder.display().to_string(),
        });
    };
    made(folder)?;
    let (geometry, script) = template.geometry();
    let files = [
        (
            SCENE,
            template
                .scene()
                .replacen(NAME, &format!("name = \"{name}\""), 1),
        ),
        (geometry, script.to_owned()),
        (SCHEMA, format!("{:#}\n", schema::scene())),
    ];
    let mut told = String::new();
    for (file, text) in files {
        let path = folder.join(file);
        if let Err(error) = write_file(&path, text.as_bytes()) {
            // Nothing in it but what was written here.
            let _ = fs::remove_dir_all(folder);
            return Err(RunError::from(error).into());
        }
        told += &format!("wrote {}\n", path.display());
    }
    let scene = folder.join(SCENE);
    Ok(format!(
        "{told}next: dovetail run {}\n",
        shell_word(&scene.display().to_string())
    ))
}

/// Creates the folder, which must not exist, and its missing parents.
fn made(folder: &Path) -> Result<(), Error> {
    if let Some(parent) = folder.parent() {
        create_folder(parent).map_err(RunError::from)?;
    }
    fs::create_dir(folder).map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => Error::NewExists {
            path: folder.to_owned(),
        },
        _ => RunError::from(ExportError::CreateFolder {
            path: folder.to_owned(),
            source,
        })
        .into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    #[test]
    fn every_template_is_a_scene_with_a_name_to_replace_and_a_schema() {
        for template in Template::value_variants() {
            let text = template.scene();
            assert!(text.starts_with(&format!("#:schema ./{SCHEMA}\n")));
            assert_eq!(text.matches(NAME).count(), 1);
            assert!(text.contains(&format!("geometry = \"{}\"", template.geometry().0)));
            scene::parse(text, SCENE, Path::new(""), &[]).unwrap();
        }
    }
}
