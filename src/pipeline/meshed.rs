//! A scene about a mesh, taken to its reduced model: mesh, model, finite elements, reduction.

use std::path::{Path, PathBuf};

use nalgebra_sparse::CscMatrix;

use super::Options;
use crate::error::Error;
use crate::export::manifest;
use crate::fem::statics::SolveFailure;
use crate::fem::{self, FemError, Structure};
use crate::mesh::gmsh::{self, GmshError};
use crate::mesh::{Mesh, MeshError, msh, quality};
use crate::model::{self, Model};
use crate::numerics::factor::{Cholesky, FactorError};
use crate::progress::{HELD_MODES_STAGE, Progress};
use crate::reduction::craig_bampton::held_modes;
use crate::reduction::{self, ReducedModel, ReductionError};
use crate::scene::{Assembly, MeshKind, MeshSource};

/// Modes of each body alone, flanks held, that `dovetail modes` lists.
pub(super) const HELD_MODES: usize = 6;

/// A mesh with its flanks paired, before anything is assembled.
pub(super) struct Bound {
    pub model: Model,
    origin: Origin,
}

/// A meshed assembly and its reduced model.
pub(super) struct Meshed {
    pub model: Model,
    pub structure: Structure,
    pub reduced: ReducedModel,
    origin: Origin,
}

/// Where the mesh came from, for the summary.
struct Origin {
    source: PathBuf,
    gmsh: Option<String>,
    fallback: bool,
}

impl Bound {
    pub(super) fn of(
        assembly: &Assembly,
        options: &Options,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let (mesh, origin) = make_mesh(&assembly.mesh, options, progress)?;
        let model = bind(assembly, &mesh, progress)?;
        Ok(Self { model, origin })
    }

    pub(super) fn summary(&self) -> manifest::MeshSummary {
        self.origin.summary(&self.model)
    }
}

impl Meshed {
    /// Keeps the `stuck_modes` lowest stuck modes (`None`: all).
    pub(super) fn of(
        assembly: &Assembly,
        stuck_modes: Option<usize>,
        options: &Options,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let Bound { model, origin } = Bound::of(assembly, options, progress)?;
        let structure = assemble(&model, progress)?;
        let reduced = reduce(stuck_modes, &model, &structure, progress)?;
        Ok(Self {
            model,
            structure,
            reduced,
            origin,
        })
    }

    pub(super) fn summary(&self) -> manifest::MeshSummary {
        self.origin.summary(&self.model)
    }

    /// Squared angular frequencies of each body alone, its flanks held (full model).
    pub(super) fn held_modes(&self, progress: &Progress) -> Result<Vec<Vec<f64>>, ReductionError> {
        let _stage = progress.stage(HELD_MODES_STAGE);
        let bodies = self.model.bodies.iter().zip(&self.structure.bodies);
        bodies
            .map(|(body, matrices)| Ok(held_modes(body, matrices, HELD_MODES)?.omega2))
            .collect()
    }
}

impl Origin {
    fn summary(&self, model: &Model) -> manifest::MeshSummary {
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
            std::fs::metadata(path).map_err(|source| MeshError::Io {
                path: path.clone(),
                source,
            })?;
        }
        MeshKind::Geometry { script, .. } => {
            std::fs::metadata(script).map_err(|source| GmshError::Script {
                path: script.clone(),
                source,
            })?;
        }
    }
    Ok(())
}

fn make_mesh(
    source: &MeshSource,
    options: &Options,
    progress: &Progress,
) -> Result<(Mesh, Origin), Error> {
    let _stage = progress.stage("mesh");
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
            let out = options.out.join("mesh.msh");
            create_folder(&options.out)?;
            match gmsh::generate(script, parameters, *time_limit_s, &out) {
                Ok(made) => {
                    for warning in &made.warnings {
                        progress.warning(&format!("gmsh: {warning}"));
                    }
                    Origin {
                        source: out,
                        gmsh: Some(made.version),
                        fallback: false,
                    }
                }
                Err(missing @ GmshError::Missing { .. }) => {
                    let Some(ready) = source.kind.equivalent_fallback() else {
                        return Err(missing.into());
                    };
                    progress.warning(&format!(
                        "gmsh is not installed: using the ready mesh {}, made with the same parameters",
                        ready.display()
                    ));
                    Origin {
                        source: ready.to_path_buf(),
                        gmsh: None,
                        fallback: true,
                    }
                }
                Err(error) => return Err(error.into()),
            }
        }
    };
    let mesh = msh::read(&origin.source, source.metres_per_unit)?;
    quality::check(&mesh)?;
    Ok((mesh, origin))
}

pub(super) fn create_folder(path: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(path).map_err(|source| Error::Io {
        action: "creating the folder",
        path: path.to_path_buf(),
        source,
    })
}

fn bind(assembly: &Assembly, mesh: &Mesh, progress: &Progress) -> Result<Model, Error> {
    let _stage = progress.stage("model");
    let model = model::bind(assembly, mesh)?;
    let tets: usize = model.bodies.iter().map(|b| b.tet_count()).sum();
    progress.note(&format!(
        "{tets} tetrahedra, {} dofs, {} contact pairs (largest mismatch {:.1e} m)",
        model
            .bodies
            .iter()
            .map(|b| 3 * b.dofs.free_nodes())
            .sum::<usize>(),
        model.pairs.len(),
        model.largest_mismatch_m
    ));
    Ok(model)
}

pub(super) fn assemble(model: &Model, progress: &Progress) -> Result<Structure, FemError> {
    let _stage = progress.stage("finite elements");
    let solve = |k: &CscMatrix<f64>, f: &[f64]| {
        let factor = Cholesky::factor(k).map_err(|error| match error {
            FactorError::NotPositiveDefinite { dof } | FactorError::Singular { dof, .. } => {
                SolveFailure::NotPositiveDefinite { dof }
            }
            other => SolveFailure::Factorisation(Box::new(other)),
        })?;
        let mut x = f.to_vec();
        factor.solve_vector(&mut x);
        Ok(x)
    };
    fem::assemble(model, &solve)
}

fn reduce(
    stuck_modes: Option<usize>,
    model: &Model,
    structure: &Structure,
    progress: &Progress,
) -> Result<ReducedModel, Error> {
    let _stage = progress.stage("reduction");
    Ok(reduction::reduce(model, structure, stuck_modes)?)
}
