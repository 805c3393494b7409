//! What the commands have in common once a scene is reduced, whether it began with a mesh or with a folder.

use super::meshed::Meshed;
use super::{Options, hertz};
use crate::error::Error;
use crate::progress::{Progress, Stage};
use dovetail_solver::description::{ReducedModelSpec, Scene, Subject};
use dovetail_solver::reduction::superelement;
use dovetail_solver::reduction::{PairLaw, RelativeModel};
use dovetail_solver::results::pairs::PairTable;

/// The reduced model of a scene, and what tables say of its pairs.
pub(super) struct Prepared {
    pub pairs: PairTable,
    origin: Origin,
}

enum Origin {
    Mesh(Box<Meshed>),
    Folder(Box<RelativeModel>),
}

impl Prepared {
    /// Meshes, binds, assembles and reduces, or reads the folder.
    pub(super) fn of(scene: &Scene, options: &Options, progress: &Progress) -> Result<Self, Error> {
        let stuck_modes = scene.response.stuck_modes;
        let prepared = match &scene.subject {
            Subject::Assembly(assembly) => {
                let meshed = Meshed::of(assembly, stuck_modes, options, progress)?;
                Self {
                    pairs: PairTable::of_model(&meshed.model),
                    origin: Origin::Mesh(Box::new(meshed)),
                }
            }
            Subject::ReducedModel(spec) => {
                let _stage = progress.stage(Stage::ReducedModel);
                let element = read(spec)?;
                let pairs = PairTable::of_superelement(&element);
                progress.note(&format!("{} contact pairs", pairs.rows.len()));
                let relative = match stuck_modes {
                    Some(modes) => element.relative.with_modes(modes),
                    None => element.relative,
                };
                Self {
                    pairs,
                    origin: Origin::Folder(Box::new(relative)),
                }
            }
        };
        prepared.warn_of_much_friction(progress);
        if let Some(omega2) = prepared.relative().omega2.first() {
            progress.note(&format!("first stuck mode {:.4} Hz", hertz(*omega2)));
        }
        Ok(prepared)
    }

    fn warn_of_much_friction(&self, progress: &Progress) {
        let pairs = self.relative().pairs.iter();
        let largest = pairs.map(|pair| pair.friction).fold(0.0, f64::max);
        if largest > PairLaw::MOST_FRICTION {
            progress.warning(&format!(
                "a coefficient of friction of {largest:e} is computed as {:e}: pairs stick as long as they are pressed",
                PairLaw::MOST_FRICTION
            ));
        }
    }

    pub(super) fn relative(&self) -> &RelativeModel {
        match &self.origin {
            Origin::Mesh(meshed) => &meshed.relative,
            Origin::Folder(relative) => relative,
        }
    }

    /// The bodies, where there is a mesh.
    pub(super) fn meshed(&self) -> Option<&Meshed> {
        match &self.origin {
            Origin::Mesh(meshed) => Some(meshed),
            Origin::Folder(_) => None,
        }
    }

    pub(super) fn observations(&self) -> Vec<&str> {
        let probes = self.relative().observations.iter();
        probes.map(|probe| probe.name.as_str()).collect()
    }
}

fn read(spec: &ReducedModelSpec) -> Result<superelement::Superelement, Error> {
    let law = PairLaw {
        friction: spec.friction,
        gap_m: spec.gap_m,
    };
    Ok(superelement::read(&spec.folder, law, spec.force_n)?)
}

/// That the folder can be read.
pub(super) fn check(spec: &ReducedModelSpec) -> Result<(), Error> {
    read(spec).map(|_| ())
}
