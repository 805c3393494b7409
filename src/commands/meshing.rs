//! Provides the mesh of a scene: from a file, or made by gmsh from a script in this run or in an
//! earlier one.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::unjoined;
use crate::error::RunError;
use crate::files::MESH_FILE;
use crate::gmsh::{self, GmshError, GmshRun, inputs};
use crate::influence_file;
use crate::matrix_files;
use crate::mesh_files;
use crate::reporter::{ProgramStage, Reporter};
use crate::scene::nearest;
use crate::scene_files::hash_of_file;
use dovetail_cache::{Cache, EntryKey, KeptMesh};
use dovetail_export::manifest::MeshOrigin;
use dovetail_export::warning::Weight;
use dovetail_export::{create_folder, write_file};
use dovetail_mesh::units::Units;
use dovetail_mesh::{Mesh, MeshError, quality};
use dovetail_solver::description::Scene;
use dovetail_solver::model::gather::gather;
use dovetail_solver::model::{
    Assembly, BodyMesh, BodySpec, GivenMatrices, MatrixFiles, MatrixSource, MeshKind, MeshSource,
    NamedFiles, SurfaceFields,
};
use dovetail_solver::reduced::InfluenceCoefficient;
use dovetail_solver::run::Stage;
use dovetail_superelement::input;

/// Origin of a mesh that is read from a file.
fn origin_of(path: &Path) -> MeshOrigin {
    MeshOrigin {
        source: path.to_path_buf(),
        blake3: hash_of_file(path).ok(),
        gmsh: None,
        fallback: false,
    }
}

/// Checks that the meshes, matrices and fields named by the scene exist. Notes that gmsh runs a script as a
/// program.
pub(super) fn check(assembly: &Assembly, reporter: &Reporter<'_>) -> Result<(), RunError> {
    let is_there = |path: &Path| {
        input::check(path).map_err(|source| MeshError::Io {
            path: path.to_path_buf(),
            source: suggest_nearest(path, source),
        })
    };
    for body in &assembly.bodies {
        if let BodyMesh::File { path, .. } = &body.mesh {
            is_there(path)?;
        }
        if let MatrixSource::Files(named) = &body.matrices {
            matrix_files::check(&body.name, named)?;
        }
    }
    surface_fields(assembly)?;
    influence(assembly)?;
    match assembly.mesh.as_ref().map(|mesh| &mesh.kind) {
        None => {}
        Some(MeshKind::File { path }) => is_there(path)?,
        Some(MeshKind::Geometry { script, .. }) => {
            input::check(script).map_err(|source| GmshError::Script {
                path: script.clone(),
                source: suggest_nearest(script, source),
            })?;
            reporter.note(&format!(
                "{} is a program that gmsh runs, and it can start any command: run it only where you trust it",
                script.display()
            ));
        }
    }
    Ok(())
}

/// Fields that excitations and contacts name by their files.
fn surface_fields(assembly: &Assembly) -> Result<SurfaceFields, RunError> {
    let mut fields = SurfaceFields::new();
    for path in assembly.field_files() {
        fields.insert(path.to_path_buf(), mesh_files::surface_field(path)?);
    }
    Ok(fields)
}

/// Coefficients of the aerodynamic influence, if a file has them.
fn influence(assembly: &Assembly) -> Result<Option<Vec<InfluenceCoefficient>>, RunError> {
    Ok(assembly
        .influence_file()
        .map(influence_file::read)
        .transpose()?)
}

/// Contents of the files that excitations, bodies and the disc name.
pub(super) fn named_files(
    assembly: &Assembly,
    reporter: &Reporter<'_>,
) -> Result<NamedFiles, RunError> {
    let mut files = NamedFiles {
        fields: surface_fields(assembly)?,
        influence: influence(assembly)?,
        ..NamedFiles::default()
    };
    let has_files = |body: &BodySpec| matches!(body.matrices, MatrixSource::Files(_));
    let is_read = assembly.bodies.iter().any(has_files);
    let _stage = is_read.then(|| reporter.stage(Stage::Matrices));
    // Copies of a body have the same files.
    let mut read: Vec<(&MatrixFiles, Arc<GivenMatrices>)> = Vec::new();
    for body in &assembly.bodies {
        if let MatrixSource::Files(named) = &body.matrices {
            let known = read.iter().find(|(files, _)| *files == named);
            let matrices = match known {
                Some((_, matrices)) => Arc::clone(matrices),
                None => {
                    let matrices = Arc::new(matrix_files::read(&body.name, named)?);
                    read.push((named, Arc::clone(&matrices)));
                    matrices
                }
            };
            files.matrices.insert(body.name.clone(), matrices);
        }
    }
    Ok(files)
}

/// Folder in which gmsh writes the mesh, and the cache that keeps it for later runs.
#[derive(Debug, Clone, Copy)]
pub(super) struct MadeIn<'a> {
    pub folder: &'a Path,
    pub cache: &'a Cache,
}

/// Mesh of all bodies, with the elements of each file checked, and its origin.
pub(super) fn make_mesh(
    assembly: &Assembly,
    made_in: MadeIn<'_>,
    reporter: &Reporter<'_>,
) -> Result<(Mesh, MeshOrigin), RunError> {
    let mut stage = reporter.stage(Stage::Mesh);
    let (shared, mut origin) = match &assembly.mesh {
        Some(source) => {
            let (mesh, origin) = shared_mesh(source, made_in, &mut stage, reporter)?;
            (Some(mesh), Some(origin))
        }
        None => (None, None),
    };
    let mesh = gather(assembly, shared, &mut |path, units| {
        origin.get_or_insert_with(|| origin_of(path));
        read(path, units)
    })?;
    for remark in &mesh.remarks {
        reporter.warning(Weight::Remark, format!("mesh {remark}"));
    }
    unjoined::report(assembly, &mesh, reporter);
    let origin = origin.unwrap_or_else(|| origin_of(Path::new("")));
    Ok((mesh, origin))
}

/// Mesh that bodies share.
fn shared_mesh(
    source: &MeshSource,
    made_in: MadeIn<'_>,
    stage: &mut ProgramStage<'_, '_>,
    reporter: &Reporter<'_>,
) -> Result<(Mesh, MeshOrigin), RunError> {
    let units = source.units;
    let (script, parameters, time_limit_s) = match &source.kind {
        MeshKind::File { path } => {
            return Ok((read(path, units)?, origin_of(path)));
        }
        MeshKind::Geometry {
            script,
            parameters,
            time_limit_s,
            ..
        } => (script, parameters, *time_limit_s),
    };
    create_folder(made_in.folder)?;
    let out = made_in.folder.join(MESH_FILE);
    let cache = made_in.cache;
    let key = mesh_key(cache, script, parameters);
    // A mesh that cannot be used is a fault of the entry; a file that cannot be written is one of
    // the run.
    let usable = |kept: KeptMesh| {
        if let Err(error) = write_file(&out, &kept.file) {
            return Ok(Err(error));
        }
        let mesh = dovetail_mesh::parse(kept.file, units).map_err(|e| e.to_string())?;
        quality::check(&mesh).map_err(|e| e.to_string())?;
        Ok(Ok((mesh, kept.version, kept.warnings)))
    };
    let mut used = None;
    let accept = &mut |kept| usable(kept).map(|mesh| used = Some(mesh));
    // The turn is held until the mesh is kept.
    let _turn = cache.mesh(key.as_ref(), accept, reporter).err();
    match used {
        Some(kept) => {
            let (mesh, version, warnings) = kept?;
            stage.mark_cached();
            Ok((mesh, made(&out, version, &warnings, reporter)))
        }
        None => match gmsh::generate(script, parameters, time_limit_s, &out) {
            Ok(run) => {
                let mesh = read(&out, units).map_err(|error| writing_error(error, &out))?;
                keep(cache, key.as_ref(), &run, &out, reporter);
                Ok((mesh, made(&out, run.version, &run.warnings, reporter)))
            }
            Err(missing @ GmshError::Missing { .. }) => {
                let origin = ready(source.kind.equivalent_fallback(), missing, reporter)?;
                Ok((read(&origin.source, units)?, origin))
            }
            Err(error) => Err(error.into()),
        },
    }
}

/// Reads a mesh and checks its elements. Its remarks name the file, since several bodies may have
/// one each.
fn read(path: &Path, units: Units) -> Result<Mesh, RunError> {
    let mesh = mesh_files::read(path, units);
    let mut mesh = mesh.map_err(|error| match error {
        MeshError::Io { path, source } => MeshError::Io {
            source: suggest_nearest(&path, source),
            path,
        },
        error => error,
    })?;
    quality::check(&mesh)?;
    for remark in &mut mesh.remarks {
        *remark = format!("{}: {remark}", path.display());
    }
    Ok(mesh)
}

/// Error of a file that does not exist, with the file of its folder that was most likely meant.
fn suggest_nearest(path: &Path, source: io::Error) -> io::Error {
    if source.kind() != io::ErrorKind::NotFound {
        return source;
    }
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let files = std::fs::read_dir(folder.unwrap_or(Path::new(".")));
    let names = files.into_iter().flatten().flatten();
    let names: Vec<String> = names
        .filter_map(|file| file.file_name().into_string().ok())
        .collect();
    let name = path.file_name().and_then(|name| name.to_str());
    let meant = match name.and_then(|name| nearest(name, &names)) {
        Some(meant) => format!("; did you mean `{meant}`?"),
        None => "; the path of a file counts from the folder of the scene".to_owned(),
    };
    io::Error::new(source.kind(), format!("{source}{meant}"))
}

/// Error of a mesh that gmsh has just written: on a full disk gmsh writes a part of it without an
/// error.
fn writing_error(error: RunError, out: &Path) -> RunError {
    match error {
        RunError::Mesh(source) if source.is_damage() => {
            let _ = std::fs::remove_file(out); // made a moment ago, and no mesh
            let folder = out.parent().unwrap_or(out).to_path_buf();
            GmshError::NotWhole { folder, source }.into()
        }
        error => error,
    }
}

fn made(out: &Path, version: String, warnings: &[String], reporter: &Reporter<'_>) -> MeshOrigin {
    for warning in warnings {
        reporter.warning(Weight::Remark, format!("gmsh: {warning}"));
    }
    MeshOrigin {
        gmsh: Some(version),
        ..origin_of(out)
    }
}

/// Origin of the ready mesh that replaces that of gmsh if gmsh is missing.
fn ready(
    fallback: Option<&Path>,
    missing: GmshError,
    reporter: &Reporter<'_>,
) -> Result<MeshOrigin, RunError> {
    let Some(ready) = fallback else {
        return Err(missing.into());
    };
    reporter.warning(
        Weight::Remark,
        format!(
            "gmsh is not installed: using the ready mesh {}, made with the same parameters",
            ready.display()
        ),
    );
    Ok(MeshOrigin {
        fallback: true,
        ..origin_of(ready)
    })
}

/// Script and parameters, sorted by name, of the mesh of a scene, by which scenes share it; `None` if no
/// mesh is made, or if it cannot be kept for later runs.
pub fn mesh_inputs(scene: &Scene) -> Option<(PathBuf, Vec<(String, f64)>)> {
    let MeshKind::Geometry {
        script, parameters, ..
    } = &scene.assembly()?.mesh.as_ref()?.kind
    else {
        return None;
    };
    inputs::inputs(script)?;
    Some((script.clone(), sorted(parameters)))
}

fn sorted(parameters: &[(String, f64)]) -> Vec<(String, f64)> {
    let mut parameters = parameters.to_vec();
    parameters.sort_by(|a, b| a.0.cmp(&b.0));
    parameters
}

/// Key of the mesh of a script; `None` if nothing is kept, or if the mesh has unknown dependencies.
fn mesh_key(cache: &Cache, script: &Path, parameters: &[(String, f64)]) -> Option<EntryKey> {
    // gmsh takes some tenths of a second to say its version: only where there is a cache.
    cache.is_enabled().then_some(())?;
    let version = gmsh::version().ok().filter(|v| !v.is_empty())?;
    cache.mesh_key(&(inputs::inputs(script)?, sorted(parameters), version))
}

fn keep(cache: &Cache, key: Option<&EntryKey>, run: &GmshRun, out: &Path, reporter: &Reporter<'_>) {
    let Some(key) = key else { return };
    if let Ok(file) = std::fs::read(out) {
        let kept = KeptMesh {
            version: run.version.clone(),
            warnings: run.warnings.clone(),
            file,
        };
        cache.keep_mesh(key, &kept, reporter);
    }
}
