//! Takes a scene about a mesh to its reduced model: mesh, model, finite elements, reduction.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use faer::Mat;
use serde::{Deserialize, Serialize};

use super::cache::{Cache, Key, Kind, Turn, reduction_inputs};
use super::error::RunError;
use super::meshing::{Origin, make_mesh, surface_fields};
use super::prestress::{Displacement, assemble, is_of_contact, reduce, settle, stressed};
use super::progress::Progress;
use super::statics::static_options;
use super::{Context, hertz, maps, units};
use crate::export::manifest::{self, PrestressPass};
use crate::export::vtu::ModeShape;
use crate::stage::Stage;
use crate::warning::Weight;
use crate::words::{counted, percent, quantity};
use dovetail_mesh::{Mesh, Shape};
use dovetail_numerics::eigen::Modes;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::StaticState;
use dovetail_solver::fem::mass_properties::{MassProperties, mass_properties};
use dovetail_solver::fem::{FemError, Structure, expand_to_nodes};
use dovetail_solver::model::gather::name_for;
use dovetail_solver::model::{self, Assembly, ContactSpec, Model, Side, SpringSpec};
use dovetail_solver::problem::Problem;
use dovetail_solver::reduction::craig_bampton::fixed_interface_modes;
use dovetail_solver::reduction::{LISTED_MODES, Recovery, ReducedModel, StuckModes, Truncation};
use dovetail_solver::results::recovery::NodalField;

/// What is known of the modes of a reduction.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct ReductionModes {
    pub truncation: Truncation,
    /// Squared angular frequencies of each body; none where it was not reduced by itself.
    pub fixed_interface_omega2: Vec<Vec<f64>>,
    /// None where the prestress is not that of the static state with contact.
    pub prestress_passes: Vec<PrestressPass>,
    /// `None` where the prestress is not that of the held flanks.
    pub held_flanks_error: Option<f64>,
}

/// A mesh with its flanks paired, before anything is assembled.
pub(super) struct Bound {
    pub model: Model,
    properties: Vec<MassProperties>,
    origin: Origin,
}

/// A meshed assembly and its reduced model. What only fields and modes of single bodies need is made, or taken from the
/// cache, when it is first asked for.
#[derive(Debug)]
pub(super) struct Meshed {
    pub model: Model,
    pub problem: Problem,
    pub modes: ReductionModes,
    wanted: StuckModes,
    structure: OnceCell<Structure>,
    /// Of the static state that the prestress comes from, where it was repeated.
    displacement: Option<Displacement>,
    recovery: OnceCell<Recovery>,
    cache: Cache,
    recovery_key: Option<Key>,
    held_modes_key: Option<Key>,
    properties: Vec<MassProperties>,
    origin: Origin,
}

impl Bound {
    pub(super) fn of(
        assembly: &Assembly,
        context: &Context,
        progress: &Progress,
    ) -> Result<Self, RunError> {
        let (mesh, origin) = make_mesh(assembly, context, progress)?;
        let _stage = progress.stage(Stage::Model);
        let model = bind(assembly, &mesh, progress)?;
        let properties = properties(&model, progress)?;
        Ok(Self {
            model,
            properties,
            origin,
        })
    }

    pub(super) fn summary(&self) -> manifest::MeshSummary {
        self.origin.summary(&self.model, &self.properties)
    }
}

impl Meshed {
    pub(super) fn of(
        assembly: &Assembly,
        wanted: StuckModes,
        scene: &Scene,
        context: &Context,
        progress: &Progress,
    ) -> Result<Self, RunError> {
        let Bound {
            model,
            properties,
            origin,
        } = Bound::of(assembly, context, progress)?;
        let cache = Cache::new(context.cache.as_ref());
        let statics = is_of_contact(&model).then(|| static_options(scene));
        let inputs = reduction_inputs(&model, wanted, statics);
        let [key, recovery_key, held_modes_key] =
            [Kind::ReducedModel, Kind::Recovery, Kind::HeldModes]
                .map(|kind| cache.key(kind, &inputs));
        let (structure, recovery) = (OnceCell::new(), OnceCell::new());
        let (problem, modes, displacement) = match kept(&cache, key.as_ref(), &model, progress) {
            Ok(kept) => kept,
            Err(_turn) => {
                let settled = settle(&model, wanted, scene, progress)?;
                let displacement = settled.displacement;
                let modes = ReductionModes {
                    truncation: settled.truncation,
                    fixed_interface_omega2: settled.fixed_interface_omega2,
                    prestress_passes: settled.passes,
                    held_flanks_error: settled.held_flanks_error,
                };
                if key.is_some() {
                    let _stage = progress.stage(Stage::Keeping);
                    let parts = (&settled.problem.reduced, &modes, &displacement);
                    cache.put(key.as_ref(), &parts, progress);
                    cache.put(recovery_key.as_ref(), &settled.recovery, progress);
                }
                structure.get_or_init(|| settled.structure);
                recovery.get_or_init(|| settled.recovery);
                (settled.problem, modes, displacement)
            }
        };
        Ok(Self {
            model,
            problem,
            modes,
            wanted,
            structure,
            displacement,
            recovery,
            cache,
            recovery_key,
            held_modes_key,
            properties,
            origin,
        })
    }

    /// The way back from the reduced model to the bodies, where [`Meshed::recover`] has made it.
    pub(super) fn recovery(&self) -> Option<&Recovery> {
        self.recovery.get()
    }

    /// Displacements of all nodes of each body in a static state, m; `None` where there is no way
    /// back to the bodies.
    pub(super) fn static_displacements_m(&self, state: &StaticState) -> Option<Vec<NodalField>> {
        let free = self.recovery()?.full_static(&state.x);
        let bodies = self.model.bodies.iter().zip(&free);
        Some(
            bodies
                .map(|(body, free)| expand_to_nodes(&body.dofs, free))
                .collect(),
        )
    }

    /// Makes the way back from the reduced model to the bodies.
    pub(super) fn recover(&self, progress: &Progress) -> Result<(), RunError> {
        if self.recovery.get().is_some() {
            return Ok(());
        }
        let begin = Instant::now();
        let key = self.recovery_key.as_ref();
        let recovery = match self.cache.get::<Recovery, _>(key, Ok, progress) {
            Some(recovery) => {
                progress.kept_stage(Stage::Recovery, begin.elapsed());
                recovery
            }
            None => {
                let matrices = self.structure(progress)?;
                let reduction = reduce(&self.model, matrices, self.wanted, progress)?;
                self.cache.put(key, &reduction.recovery, progress);
                reduction.recovery
            }
        };
        self.recovery.get_or_init(|| recovery);
        Ok(())
    }

    pub(super) fn summary(&self) -> manifest::MeshSummary {
        self.origin.summary(&self.model, &self.properties)
    }

    /// Matrices of the bodies, assembled once.
    fn structure(&self, progress: &Progress) -> Result<&Structure, RunError> {
        if let Some(structure) = self.structure.get() {
            return Ok(structure);
        }
        let structure = match &self.displacement {
            None => assemble(&self.model, progress)?,
            Some(displacement) => stressed(&self.model, displacement, progress)?,
        };
        Ok(self.structure.get_or_init(|| structure))
    }

    /// Modes of each body alone, its flanks held (full model), on the free dofs of its interior.
    pub(super) fn held_modes(&self, progress: &Progress) -> Result<Vec<Modes>, RunError> {
        let begin = Instant::now();
        let key = self.held_modes_key.as_ref();
        if let Some(kept) = self.cache.get(key, Ok, progress) {
            progress.kept_stage(Stage::HeldModes, begin.elapsed());
            return Ok(kept);
        }
        let structure = self.structure(progress)?;
        let _stage = progress.stage(Stage::HeldModes);
        let bodies = self.model.bodies.iter().zip(&structure.bodies);
        let modes = bodies
            .map(|(body, matrices)| Ok(fixed_interface_modes(body, matrices, LISTED_MODES)?))
            .collect::<Result<Vec<Modes>, RunError>>()?;
        self.cache.put(key, &modes, progress);
        Ok(modes)
    }

    /// The listed modes on the nodes: those of the stuck assembly, where there is a way back to the bodies, and those
    /// of each body with its flanks held.
    pub(super) fn shapes(&self, held: &[Modes]) -> Vec<ModeShape> {
        let bodies = &self.model.bodies;
        let on_nodes = |b: usize, free: &[f64]| {
            let dofs = &bodies[b].dofs;
            let mut all = vec![0.0; 3 * dofs.free_nodes()];
            all[..free.len()].copy_from_slice(free);
            expand_to_nodes(dofs, &all)
        };
        let shape = |kind: &str, body: Option<&str>, mode: usize, omega2: f64| ModeShape {
            kind: kind.to_owned(),
            body: body.map(str::to_owned),
            mode: mode + 1,
            frequency_hz: hertz(omega2),
            shape: Vec::new(),
        };
        let mut shapes = Vec::new();
        if let Some(recovery) = self.recovery() {
            let reduced = &self.problem.reduced;
            let all = reduced.omega2.len();
            let count = reduced.stuck_modes.min(LISTED_MODES);
            let still = Mat::zeros(3 * self.model.pairs.len(), count);
            let each = Mat::from_fn(all, count, |i, j| f64::from(u8::from(i == j)));
            let motion = recovery.full_motion(still.as_ref(), each.as_ref());
            shapes.extend((0..count).map(|j| {
                ModeShape {
                    shape: (0..bodies.len())
                        .map(|b| on_nodes(b, motion[b].col_as_slice(j)))
                        .collect(),
                    ..shape("stuck", None, j, reduced.omega2[j])
                }
            }));
        }
        for (moving, modes) in held.iter().enumerate() {
            let name = Some(bodies[moving].name.as_str());
            shapes.extend((0..modes.count()).map(|j| {
                ModeShape {
                    shape: (0..bodies.len())
                        .map(|b| match b == moving {
                            true => on_nodes(b, modes.vectors.col_as_slice(j)),
                            false => on_nodes(b, &[]),
                        })
                        .collect(),
                    ..shape("flanks_held", name, j, modes.omega2[j])
                }
            }));
        }
        shapes
    }
}

fn bind(assembly: &Assembly, mesh: &Mesh, progress: &Progress) -> Result<Model, RunError> {
    let model = model::bind_with_fields(assembly, mesh, &surface_fields(assembly)?)?;
    for spring in &assembly.springs {
        progress.note(&spring_note(spring));
    }
    warn_of_held_volumes(assembly, mesh, progress);
    tell_of_flanks(assembly, &model, progress);
    tell_of_straightened_edges(&model, progress);
    let mut shapes: BTreeMap<Shape, usize> = BTreeMap::new();
    for (element, count) in model.element_types() {
        *shapes.entry(element.shape).or_default() += count;
    }
    let shapes = shapes
        .iter()
        .map(|(shape, n)| format!("{n} {}", shape.plural()));
    progress.note(&format!(
        "{}, {} dofs, {} contact pairs (largest mismatch {:.1e} m)",
        shapes.collect::<Vec<_>>().join(", "),
        model
            .bodies
            .iter()
            .map(|b| 3 * b.dofs.free_nodes())
            .sum::<usize>(),
        model.pairs.len(),
        model.largest_mismatch_m()
    ));
    maps::tell(&model, progress);
    Ok(model)
}

/// How flanks lie on each other, and what may not be meant.
fn tell_of_flanks(assembly: &Assembly, model: &Model, progress: &Progress) {
    for contact in assembly.contacts.iter().filter(|c| c.second.is_none()) {
        progress.note(&format!(
            "contact {}: on rigid ground, for no `second` is named",
            contact.name
        ));
    }
    for found in &model.matches {
        let spec = assembly.contacts.iter().find(|c| c.name == found.name);
        let Some(ContactSpec {
            first,
            second: Some(second),
            ..
        }) = spec
        else {
            continue;
        };
        let name = &found.name;
        let shares = found.covered.map(|share| 100.0 * share);
        if !found.nodes_match {
            let (slave, master, of_slave) = match found.slave {
                Side::First => (first, second, shares[0]),
                Side::Second => (second, first, shares[1]),
            };
            progress.note(&format!(
                "contact {name}: the meshes of its flanks do not match; each node of `{slave}` follows a mean of nodes of \
                 `{master}`, at most {:.1e} m away; {of_slave:.1} % of the area of `{slave}` lies opposite",
                found.largest_mismatch_m
            ));
        }
        if found.covered.iter().all(|share| *share < WHOLE) {
            progress.warning(
                Weight::Doubt,
                format!(
                    "contact \"{name}\": neither flank lies wholly opposite the other, only {:.1} % of the area of \
                     `{first}` and {:.1} % of that of `{second}`: check where the bodies stand",
                    shares[0], shares[1]
                ),
            );
        }
    }
    for found in &model.matches {
        let (name, apart) = (&found.name, found.largest_separation_m);
        let counts = |c: &&ContactSpec| c.name == *name && c.gap_from_mesh;
        if apart > FAR_APART * found.facet_m && !assembly.contacts.iter().any(|c| counts(&c)) {
            progress.warning(
                Weight::Doubt,
                format!(
                    "contact \"{name}\": the flanks are up to {apart:.2e} m apart in the mesh and are taken to \
                     touch; gap = \"mesh\" counts it as clearance"
                ),
            );
        }
    }
}

/// The edges of flanks that the model has straight and the mesh has not.
fn tell_of_straightened_edges(model: &Model, progress: &Progress) {
    for found in &model.straightened {
        let text = format!(
            "body \"{}\": {} of its flanks were made straight: their middle nodes, which follow the mean of the corners, \
             were moved by up to {} ({} of the edge); smaller elements follow a curved flank more closely",
            found.body,
            counted(found.edges, "edge", "edges"),
            quantity(found.largest_m, "m", 2),
            percent(found.largest_share, 2)
        );
        if found.largest_share > CURVED {
            progress.warning(Weight::Remark, text);
        } else {
            progress.note(&text);
        }
    }
}

/// A middle node that was moved by more than this share of its edge is warned of.
const CURVED: f64 = 2e-3;
/// Of two flanks of which neither has this share of its area opposite the other, one may not be where it is meant to be.
const WHOLE: f64 = 0.98;
/// Flanks farther apart than this share of their facets' length are not taken to touch without a word.
const FAR_APART: f64 = 0.05;

fn spring_note(spring: &SpringSpec) -> String {
    let SpringSpec {
        name,
        first,
        second,
        stiffness_n_m,
        direction,
    } = spring;
    let place = match second {
        None => format!("`{first}` on ground"),
        Some(second) => format!("`{first}` to `{second}`"),
    };
    let along = match direction {
        None => String::new(),
        Some([x, y, z]) => format!(" along [{x:.4}, {y:.4}, {z:.4}]"),
    };
    format!("spring {name}: {place}, {stiffness_n_m:.4e} N/m{along}")
}

/// A set of a face in a deck of Abaqus/CAE is one of nodes and one of elements, and the elements have its
/// name: holding them holds more than the face.
fn warn_of_held_volumes(assembly: &Assembly, mesh: &Mesh, progress: &Progress) {
    for body in &assembly.bodies {
        for name in body.fixed.iter().chain(body.fixed_along.iter().flatten()) {
            let find = |name| mesh.groups.get(&*name_for(mesh, &body.name, name));
            let Some(group) = find(name).filter(|group| group.dimension == 3) else {
                continue;
            };
            let nodes = format!("{name} (nodes)");
            let remedy = match find(&nodes).is_some() {
                true => format!("the set of nodes alone is `{nodes}`"),
                false => "name a surface or a set of nodes to hold a face".to_owned(),
            };
            progress.warning(
                Weight::Doubt,
                format!(
                    "body \"{}\": the group `{name}` that is fixed is a volume, and all {} nodes of its elements \
                     are held: {remedy}",
                    body.name,
                    group.nodes.len()
                ),
            );
        }
    }
}

/// Told, so that a wrong unit is seen before anything is computed with it.
fn properties(model: &Model, progress: &Progress) -> Result<Vec<MassProperties>, FemError> {
    let rotation = model.rotation.as_ref();
    let mut all = Vec::new();
    for body in &model.bodies {
        let own = mass_properties(body, rotation)?;
        let force = own.centrifugal_force_n.map_or(String::new(), |force| {
            let size_n = force.iter().map(|f| f * f).sum::<f64>().sqrt();
            format!(", centrifugal force {size_n:.4e} N")
        });
        progress.note(&format!(
            "{}: {:.4} kg, {:.4e} m3{force}",
            body.name, own.mass_kg, own.volume_m3
        ));
        if let Some(doubt) = units::doubt(&body.name, body.material) {
            progress.warning(Weight::Wrong, doubt);
        }
        all.push(own);
    }
    Ok(all)
}

/// The reduced model of an earlier run, with the laws and the excitation of this one, and the modes of the bodies; else
/// the turn to make it.
fn kept(
    cache: &Cache,
    key: Option<&Key>,
    model: &Model,
    progress: &Progress,
) -> Result<(Problem, ReductionModes, Option<Displacement>), Option<Turn>> {
    let begin = Instant::now();
    let (reduced, modes, displacement): (ReducedModel, _, _) =
        cache.get_or_turn(key, Ok, progress)?;
    let problem = Problem::new(reduced, model);
    progress.kept_stage(Stage::FiniteElements, Duration::ZERO);
    progress.kept_stage(Stage::Reduction, begin.elapsed());
    Ok((problem, modes, displacement))
}
