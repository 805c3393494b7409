//! The mesh of a scene: a file, or gmsh's of a script, made now or in an earlier run.

use std::path::{Path, PathBuf};

use super::Options;
use super::cache::{Cache, Key};
use crate::error::Error;
use crate::export::{manifest, write_file};
use crate::input;
use crate::mesh::gmsh::{self, GmshError, GmshRun};
use crate::mesh::{Mesh, MeshError, inputs, msh, quality};
use crate::model::Model;
use crate::numerics::stored;
use crate::progress::Progress;
use crate::scene::{MeshKind, MeshSource};

/// The mesh of a script, in the folder of the results.
const MESH_FILE: &str = "mesh.msh";

/// Where the mesh came from, for the summary.
pub(super) struct Origin {
    source: PathBuf,
    gmsh: Option<String>,
    fallback: bool,
}

impl Origin {
    pub(super) fn summary(&self, model: &Model) -> manifest::MeshSummary {
        manifest::mesh_summary(
            model,
            self.source.display().to_string(),
            self.gmsh.clone(),
            self.fallback,
        )
    }
}

/// That what the scene names as its mesh is there.
pub(super) fn check(mesh: &MeshSource) -> Result<(), Error> {
    match &mesh.kind {
        MeshKind::File { path } => {
            input::check(path).map_err(|source| MeshError::Io {
                path: path.clone(),
                source,
            })?;
        }
        MeshKind::Geometry { script, .. } => {
            input::check(script).map_err(|source| GmshError::Script {
                path: script.clone(),
                source,
            })?;
        }
    }
    Ok(())
}

pub(super) fn create_folder(path: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(path).map_err(|source| Error::Io {
        action: "creating the folder",
        path: path.to_path_buf(),
        source,
    })
}

pub(super) fn make_mesh(
    source: &MeshSource,
    options: &Options,
    progress: &Progress,
) -> Result<(Mesh, Origin), Error> {
    let stage = progress.stage("mesh");
    let origin = match &source.kind {
        MeshKind::File { path } => Origin {
            source: path.clone(),
            gmsh: None,
            fallback: false,
        },
        MeshKind::Geometry {
            script,
            parameters,
            time_limit_s,
            ..
        } => {
            create_folder(&options.out)?;
            let out = options.out.join(MESH_FILE);
            let cache = Cache::new(options.cache.as_ref());
            let key = mesh_key(&cache, script, parameters);
            match cache.get_or_turn::<KeptMesh>(key.as_ref(), progress) {
                Ok(kept) => {
                    stage.from_cache();
                    write_file(&out, &kept.file)?;
                    made(&out, kept.version, &kept.warnings, progress)
                }
                Err(_turn) => match gmsh::generate(script, parameters, *time_limit_s, &out) {
                    Ok(run) => {
                        keep(&cache, key.as_ref(), &run, &out, progress);
                        made(&out, run.version, &run.warnings, progress)
                    }
                    Err(missing @ GmshError::Missing { .. }) => {
                        ready(source.kind.equivalent_fallback(), missing, progress)?
                    }
                    Err(error) => return Err(error.into()),
                },
            }
        }
    };
    let mesh = msh::read(&origin.source, source.metres_per_unit)?;
    quality::check(&mesh)?;
    Ok((mesh, origin))
}

fn made(out: &Path, version: String, warnings: &[String], progress: &Progress) -> Origin {
    for warning in warnings {
        progress.warning(&format!("gmsh: {warning}"));
    }
    Origin {
        source: out.to_path_buf(),
        gmsh: Some(version),
        fallback: false,
    }
}

/// The ready mesh, where gmsh is missing.
fn ready(
    fallback: Option<&Path>,
    missing: GmshError,
    progress: &Progress,
) -> Result<Origin, Error> {
    let Some(ready) = fallback else {
        return Err(missing.into());
    };
    progress.warning(&format!(
        "gmsh is not installed: using the ready mesh {}, made with the same parameters",
        ready.display()
    ));
    Ok(Origin {
        source: ready.to_path_buf(),
        gmsh: None,
        fallback: true,
    })
}

/// What gmsh made in an earlier run.
#[derive(serde::Serialize, serde::Deserialize)]
struct KeptMesh {
    version: String,
    warnings: Vec<String>,
    #[serde(with = "stored::numbers")]
    file: Vec<u8>,
}

/// `None` where nothing is kept, or where the mesh depends on more than is known.
fn mesh_key(cache: &Cache, script: &Path, parameters: &[(String, f64)]) -> Option<Key> {
    // gmsh takes some tenths of a second to say its version: only where there is a cache.
    cache.is_on().then_some(())?;
    let version = gmsh::version().ok().filter(|v| !v.is_empty())?;
    let mut parameters = parameters.to_vec();
    parameters.sort_by(|a, b| a.0.cmp(&b.0));
    cache.key("mesh", &(inputs::inputs(script)?, parameters, version))
}

fn keep(cache: &Cache, key: Option<&Key>, run: &GmshRun, out: &Path, progress: &Progress) {
    let Some(key) = key else { return };
    if let Ok(file) = std::fs::read(out) {
        let kept = KeptMesh {
            version: run.version.clone(),
            warnings: run.warnings.clone(),
            file,
        };
        cache.put(Some(key), &kept, progress);
    }
}
