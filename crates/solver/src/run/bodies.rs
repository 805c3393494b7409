//! Bodies of a run: their meshes, their model, and their modes after a reduction.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use faer::Mat;

use super::kept::{ReductionKey, ReductionModes};
use crate::dlft::{Orbit, StaticState};
use crate::excitation::Excitation;
use crate::fem::mass_properties::MassProperties;
use crate::fem::{Prestressed, expand_to_nodes};
use crate::model::{Cyclic, Model, NamedFiles};
use crate::problem::Problem;
use crate::reduced::ReducedModel;
use crate::reduction::{LISTED_MODES, Recovery, StuckModes};
use crate::results::modes::{ModeKind, ModeShape, hertz};
use crate::results::recovery::NodalField;
use crate::structure::Structure;
use crate::superelement::Superelement;
use dovetail_mesh::Mesh;
use dovetail_numerics::eigen::Modes;
use dovetail_numerics::spectrum::{Spectrum, blocks, cosine, sine};

/// Meshes and other files that an assembly is bound to.
#[derive(Debug, Clone)]
pub struct Meshes {
    /// Mesh of all bodies, in metres: see [`gather`](crate::model::gather::gather).
    pub mesh: Mesh,
    /// Contents of the other files that it names.
    pub files: NamedFiles,
}

/// Contents of the files that a scene names, which the caller has read.
#[derive(Debug, Clone)]
pub enum Source {
    /// Meshes of a scene about bodies.
    Meshes(Box<Meshes>),
    /// Reduced model of a scene about one.
    ReducedModel(Box<Superelement>),
}

impl From<Meshes> for Source {
    fn from(meshes: Meshes) -> Self {
        Self::Meshes(Box::new(meshes))
    }
}

impl From<Mesh> for Source {
    fn from(mesh: Mesh) -> Self {
        Meshes::from(mesh).into()
    }
}

impl From<Superelement> for Source {
    fn from(element: Superelement) -> Self {
        Self::ReducedModel(Box::new(element))
    }
}

impl From<Mesh> for Meshes {
    fn from(mesh: Mesh) -> Self {
        Self {
            mesh,
            files: NamedFiles::default(),
        }
    }
}

/// Problem of a reduced model with the contact laws and excitations of the model that it was made of.
pub fn problem(reduced: impl Into<Arc<ReducedModel>>, model: &Model) -> Problem {
    let laws = model.pairs.iter().map(|pair| pair.law).collect();
    let excitations: Vec<Excitation> = model.excitations.iter().map(|e| e.in_time).collect();
    Problem::new(reduced, laws, &excitations)
}

/// Assembly with its flanks paired, before matrices are assembled.
#[derive(Debug)]
#[non_exhaustive]
pub struct Bound {
    /// Bodies, pairs, loads and excitations by their numbers.
    pub model: Model,
    /// Volume, mass and centre of each body.
    pub properties: Vec<MassProperties>,
}

impl Bound {
    /// The same bodies and pairs at another speed of rotation; `None` where nothing rotates. The
    /// speed that they have and the other one are above 0.
    pub(super) fn with_speed(&self, speed_rad_s: f64) -> Option<Self> {
        let (mut model, mut properties) = (self.model.clone(), self.properties.clone());
        let rotation = model.rotation.as_mut().filter(|r| r.speed_rad_s != 0.0)?;
        let growth = (speed_rad_s / rotation.speed_rad_s).powi(2);
        rotation.speed_rad_s = speed_rad_s;
        let forces = properties
            .iter_mut()
            .flat_map(|p| p.centrifugal_force_n.iter_mut());
        forces.flatten().for_each(|force_n| *force_n *= growth);
        Some(Self { model, properties })
    }
}

/// Assembly and its reduction.
#[derive(Debug)]
#[non_exhaustive]
pub struct Bodies {
    /// Assembly with its flanks paired.
    pub bound: Bound,
    /// Estimates and frequencies of the modes of the reduction.
    pub modes: ReductionModes,
    pub(super) wanted: StuckModes,
    pub(super) structure: OnceLock<Structure>,
    /// Displacement of each body that its prestress comes from.
    pub(super) prestressed: Prestressed,
    pub(super) recovery: OnceLock<Recovery>,
    /// Recovery for the waves of each nodal diameter that a harmonic has, where it has been made, and
    /// the key that it is kept under.
    pub(super) wave_recoveries: BTreeMap<usize, (OnceLock<Recovery>, Option<ReductionKey>)>,
    pub(super) key: Option<ReductionKey>,
}

impl Bodies {
    /// Bodies, pairs, loads and excitations by their numbers.
    pub fn model(&self) -> &Model {
        &self.bound.model
    }

    /// Recovery of the bodies' motion from the reduced model, if [`Bodies::recover`] has made it.
    pub(crate) fn recovery(&self) -> Option<&Recovery> {
        self.recovery.get()
    }

    /// Displacements of all nodes of each body in a static state, m; `None` without a recovery.
    pub fn static_displacements_m(&self, state: &StaticState) -> Option<Vec<NodalField>> {
        let free = self.recovery()?.full_static(&state.x);
        let bodies = self.model().bodies.iter().zip(&free);
        let on_nodes = bodies.map(|(body, free)| expand_to_nodes(&body.dofs, free));
        Some(on_nodes.collect())
    }

    /// Motion of the free degrees of freedom of each body in an orbit, m, n x (2H+1): mean, cosine 1,
    /// sine 1, ... `None` without a recovery.
    pub fn free_motion_m(&self, orbit: &Orbit) -> Option<Vec<Mat<f64>>> {
        let recovery = self.recovery()?;
        let [x, modal] =
            [&orbit.x, &orbit.modal].map(|v| Spectrum::new(v.as_slice(), orbit.harmonics));
        let columns = |of: &[&[f64]], rows: usize| {
            let rows = rows.min(of.first().map_or(0, |column| column.len()));
            Mat::from_fn(rows, of.len(), |i, j| of[j][i])
        };
        let excitation = self.model().cyclic.as_ref().map(Cyclic::excitation);
        let wave = |k: usize| excitation.and_then(|excitation| excitation.wave(k));
        let (waves, in_phase): (Vec<usize>, Vec<usize>) =
            (1..=orbit.harmonics).partition(|k| wave(*k).is_some());
        let both = |k: &usize| [cosine(*k), sine(*k)];
        let of_mean: Vec<usize> = std::iter::once(0)
            .chain(in_phase.iter().flat_map(both))
            .collect();
        let mut groups = vec![(of_mean.clone(), {
            let [x, modal] = [&x, &modal].map(|v| of_mean.iter().map(|b| v.block(*b)).collect());
            let (x, modal): (Vec<_>, Vec<_>) = (x, modal);
            let modal = columns(&modal, recovery.mode_count());
            recovery.full_motion(columns(&x, usize::MAX).as_ref(), modal.as_ref())
        })];
        for k in waves {
            let wave = wave(k)?;
            let recovery = self.wave_recoveries.get(&wave.nodal_diameter)?.0.get()?;
            let parts = both(&k);
            let on_copies = wave.widened_parts(parts.map(|b| x.block(b)));
            let on_copies = columns(&on_copies.each_ref().map(Vec::as_slice), usize::MAX);
            let modal = columns(&parts.map(|b| modal.block(b)), recovery.mode_count());
            let moved = recovery.full_motion(on_copies.as_ref(), modal.as_ref());
            groups.push((parts.to_vec(), moved));
        }
        // Of two copies the first one is the sector.
        let bodies = self.model().bodies.len();
        let sizes = groups[0].1.iter().map(Mat::nrows).take(bodies);
        let blocks = blocks(orbit.harmonics);
        let mut motion: Vec<Mat<f64>> = sizes.map(|n| Mat::zeros(n, blocks)).collect();
        for (of_blocks, moved) in &groups {
            for (motion, moved) in motion.iter_mut().zip(moved) {
                for (b, column) in of_blocks.iter().zip(moved.col_iter()) {
                    motion.col_mut(*b).copy_from(column);
                }
            }
        }
        // The mean: the answer of the interior to the static load is not in the modes.
        let mean = Spectrum::new(&orbit.x, orbit.harmonics).mean();
        let mean = recovery.full_static(mean);
        for (motion, mean) in motion.iter_mut().zip(&mean) {
            motion.col_as_slice_mut(0).copy_from_slice(mean);
        }
        Some(motion)
    }

    /// Fields of all nodes of each body, m, 2H+1 each, of a motion of the free degrees of freedom
    /// ([`Bodies::free_motion_m`]).
    pub fn node_fields_m(&self, motion: &[Mat<f64>]) -> Vec<Vec<NodalField>> {
        let bodies = self.model().bodies.iter().zip(motion);
        let on_nodes = bodies.map(|(body, motion)| {
            let columns = 0..motion.ncols();
            let field = |j| expand_to_nodes(&body.dofs, motion.col_as_slice(j));
            columns.map(field).collect()
        });
        on_nodes.collect()
    }

    /// Fields of all nodes of each body in an orbit, m, 2H+1 each: mean, cosine 1, sine 1, ...
    /// `None` without a recovery.
    pub fn motion_m(&self, orbit: &Orbit) -> Option<Vec<Vec<NodalField>>> {
        Some(self.node_fields_m(&self.free_motion_m(orbit)?))
    }

    /// Listed modes on the nodes: those of the stuck assembly, if there is a recovery, and those of
    /// each body with its flanks held.
    pub(crate) fn shapes(&self, problem: &Problem, held: &[Modes]) -> Vec<ModeShape> {
        let bodies = &self.model().bodies;
        let on_nodes = |b: usize, free: &[f64]| {
            let dofs = &bodies[b].dofs;
            let mut displacement = vec![0.0; 3 * dofs.free_nodes()];
            displacement[..free.len()].copy_from_slice(free);
            expand_to_nodes(dofs, &displacement)
        };
        let shape = |kind: ModeKind, body: Option<&str>, mode: usize, omega2: f64| ModeShape {
            kind,
            body: body.map(str::to_owned),
            mode: mode + 1,
            frequency_hz: hertz(omega2),
            shape: Vec::new(),
        };
        let mut shapes = Vec::new();
        if let Some(recovery) = self.recovery() {
            let reduced = &problem.reduced;
            let count = reduced.stuck_modes.min(LISTED_MODES);
            let motion = recovery.modes(count);
            shapes.extend((0..count).map(|j| {
                ModeShape {
                    shape: (0..bodies.len())
                        .map(|b| on_nodes(b, motion[b].col_as_slice(j)))
                        .collect(),
                    ..shape(ModeKind::Stuck, None, j, reduced.omega2[j])
                }
            }));
        }
        for (moving, modes) in held.iter().enumerate() {
            let name = Some(bodies[moving].name.as_str());
            shapes.extend((0..modes.count()).map(|j| {
                let of_body = |b: usize| {
                    if b == moving {
                        on_nodes(b, modes.vectors.col_as_slice(j))
                    } else {
                        on_nodes(b, &[])
                    }
                };
                ModeShape {
                    shape: (0..bodies.len()).map(of_body).collect(),
                    ..shape(ModeKind::FlanksHeld, name, j, modes.omega2[j])
                }
            }));
        }
        shapes
    }
}
