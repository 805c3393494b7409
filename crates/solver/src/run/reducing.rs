//! Reduction of a scene from its meshes to its reduced model. Data that only fields and modes of
//! single bodies need are computed, or taken from the store, when first asked for.

use std::collections::BTreeMap;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use super::bodies::{Bodies, Bound, Meshes, Source, problem};
use super::error::Error;
use super::kept::{
    ReductionInputs, ReductionKey, ReductionModes, StaticOptions, StoreEntry, StoreSlot,
    StoredReduction, clear,
};
use super::prestress::{is_of_contact, reduce, settle, stressed};
use super::reduced::{ReducedScene, highest_harmonic, stuck_modes};
use super::session::{Event, Session, Stage};
use super::statics::static_options;
use crate::description::{Scene, Subject};
use crate::fem::Prestressed;
use crate::fem::mass_properties::mass_properties;
use crate::model::{Assembly, Cyclic, Gap, Model, Prestress, bind};
use crate::problem::Problem;
use crate::reduced::Waves;
use crate::reduction::craig_bampton::fixed_interface_modes;
use crate::reduction::sectors::reduce_wave;
use crate::reduction::{LISTED_MODES, Recovery, Reduction, StuckModes};
use crate::results::pairs::PairTable;
use crate::structure::Structure;
use dovetail_numerics::eigen::Modes;

impl ReducedScene {
    /// Binds, assembles and reduces a scene about meshes, or uses the reduced model that it is about.
    ///
    /// # Errors
    /// [`Error::NoMesh`] and [`Error::NoReducedModel`] if `source` does not fit the scene;
    /// the errors of binding, finite elements, prestress and reduction.
    pub fn new(scene: &Scene, source: Source, session: &Session<'_>) -> Result<Self, Error> {
        let reduced = match (&scene.subject, source) {
            (Subject::Assembly(assembly), Source::Meshes(meshes)) => {
                let bound = Bound::new(assembly, &meshes, session)?;
                drop(meshes);
                Self::from_bound(bound, stuck_modes(scene), scene, session)?
            }
            (Subject::ReducedModel(spec), Source::ReducedModel(element)) => {
                let pairs = PairTable::from_superelement(&element, spec.law);
                let reduced = match scene.response.stuck_modes {
                    Some(modes) => element.model.with_modes(modes),
                    None => element.model,
                };
                Self {
                    pairs,
                    problem: Problem::excited(
                        reduced,
                        spec.law,
                        &element.excitations,
                        spec.force_n,
                    )
                    .with_modal_ratios(&scene.modal_ratios)?,
                    bodies: None,
                    of_folder: element.excitations,
                }
            }
            (Subject::Assembly(_), Source::ReducedModel(_)) => return Err(Error::NoMesh),
            (Subject::ReducedModel(_), Source::Meshes(_)) => return Err(Error::NoReducedModel),
        };
        session.report(&Event::Reduced(&reduced))?;
        Ok(reduced)
    }

    /// Reduces an assembly that is bound to its mesh, without telling it.
    ///
    /// # Errors
    /// The errors of the finite elements, of the prestress and of the reduction.
    pub(super) fn from_bound(
        bound: Bound,
        wanted: StuckModes,
        scene: &Scene,
        session: &Session<'_>,
    ) -> Result<Self, Error> {
        let (bodies, problem) = Bodies::reduce(bound, wanted, scene, session)?;
        Ok(Self {
            pairs: PairTable::from_model(bodies.model()),
            problem,
            bodies: Some(bodies),
            of_folder: Vec::new(),
        })
    }
}

impl Bound {
    /// Binds an assembly to its mesh, and reports it.
    ///
    /// # Errors
    /// A name that the mesh does not have, flanks that do not lie on each other, elements without
    /// volume.
    pub fn new(assembly: &Assembly, meshes: &Meshes, session: &Session<'_>) -> Result<Self, Error> {
        let _stage = session.stage(Stage::Model);
        let model = bind(assembly, &meshes.mesh, Some(&meshes.files))?;
        let rotation = model.rotation.as_ref();
        let bodies = model.bodies.iter();
        let properties = bodies
            .map(|body| mass_properties(body, rotation))
            .collect::<Result<_, _>>()?;
        let bound = Self { model, properties };
        session.report(&Event::Model {
            assembly,
            mesh: &meshes.mesh,
            bound: &bound,
        })?;
        Ok(bound)
    }
}

/// Fills the place of a recovery, from the store where it is kept.
fn recovered(
    place: &OnceLock<Recovery>,
    key: Option<ReductionKey>,
    session: &Session<'_>,
    make: impl FnOnce() -> Result<Recovery, Error>,
) -> Result<(), Error> {
    if place.get().is_some() {
        return Ok(());
    }
    let begin = Instant::now();
    let mut kept = None;
    session.load(key, StoreSlot::Recovery(&mut kept));
    let recovery = match kept {
        Some(recovery) => {
            session.report_stored_stage(Stage::Recovery, begin.elapsed());
            recovery
        }
        None => {
            let recovery = make()?;
            session.keep(key, StoreEntry::Recovery(&recovery));
            recovery
        }
    };
    place.get_or_init(|| recovery);
    Ok(())
}

/// Inputs of the reduction of a model for a scene.
pub(super) fn inputs(model: &Model, wanted: StuckModes, scene: &Scene) -> ReductionInputs {
    let statics = is_of_contact(model).then(|| static_options(scene));
    ReductionInputs::new(model, wanted, statics)
}

/// Inputs of a reduction as far as a scene describes them, before its names are resolved. Scenes with
/// equal ones share a reduction.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedReduction {
    assembly: Assembly,
    wanted: StuckModes,
    statics: Option<StaticOptions>,
}

impl PlannedReduction {
    /// Inputs of the reduction of a scene; `None` if nothing is reduced. Coefficients of the air
    /// count as a whole: they name the modes on which it acts.
    pub fn from_scene(scene: &Scene) -> Option<Self> {
        let mut assembly = scene.assembly()?.clone();
        let rotation = assembly.rotation.as_ref();
        let of_contact = rotation.is_some_and(|r| r.prestress == Prestress::Contact);
        let statics = of_contact.then(|| static_options(scene));
        if statics.is_none() {
            // They are parts of the laws of the pairs.
            for contact in &mut assembly.contacts {
                (contact.friction_at, contact.crown) = (None, None);
                contact.gap = Gap::Closed;
            }
        }
        let excitations = assembly.excitations.iter_mut();
        clear(
            assembly.contacts.iter_mut().map(|c| &mut c.pair_law),
            excitations.map(|e| (&mut e.amplitude, &mut e.phase_rad, &mut e.harmonic)),
            assembly.cyclic.as_mut().map(|c| &mut c.engine_order),
            statics.as_ref(),
        );
        Some(Self {
            assembly,
            wanted: stuck_modes(scene),
            statics,
        })
    }
}

impl ReducedScene {
    /// Reduces the waves in which sectors of a disc may move differently, besides those of the harmonics.
    ///
    /// # Errors
    /// Those of the reduction.
    pub(super) fn add_all_waves(
        mut self,
        scene: &Scene,
        session: &Session<'_>,
    ) -> Result<Self, Error> {
        if let Some(bodies) = &mut self.bodies {
            let all_waves = bodies.waves_of_all_sectors();
            let waves = &mut self.problem.reduced_mut().waves;
            *waves = bodies.extend_waves(std::mem::take(waves), &all_waves, scene, session)?;
        }
        Ok(self)
    }
}

impl Bodies {
    /// Reduces an assembly to its model and the problem with its laws and excitations.
    ///
    /// # Errors
    /// The errors of [`Bound::new`], of the finite elements, of the reduction and of the prestress.
    pub(super) fn reduce(
        bound: Bound,
        wanted: StuckModes,
        scene: &Scene,
        session: &Session<'_>,
    ) -> Result<(Self, Problem), Error> {
        let model = &bound.model;
        if let Some(cyclic) = &model.cyclic {
            cyclic.check_influence()?;
        }
        let key = session.store().key(&inputs(model, wanted, scene));
        let (structure, recovery) = (OnceLock::new(), OnceLock::new());
        let begin = Instant::now();
        let mut kept = None;
        session.load(key, StoreSlot::Reduction(&mut kept));
        let kept = match kept {
            Some(kept) => {
                session.report_stored_stage(Stage::FiniteElements, Duration::ZERO);
                session.report_stored_stage(Stage::Reduction, begin.elapsed());
                kept
            }
            None => {
                let settled = settle(model, wanted, scene, session)?;
                if key.is_some() {
                    let _stage = session.stage(Stage::Keeping);
                    let entry = StoreEntry::Reduction(&settled.reduction, &settled.recovery);
                    session.keep(key, entry);
                }
                if let Some(settled) = settled.structure {
                    structure.get_or_init(|| settled);
                }
                recovery.get_or_init(|| settled.recovery);
                settled.reduction
            }
        };
        let StoredReduction {
            mut reduced,
            modes,
            prestressed,
        } = kept;
        let mut bodies = Self {
            modes,
            prestressed,
            bound,
            wanted,
            structure,
            recovery,
            wave_recoveries: BTreeMap::new(),
            key,
        };
        let waves = bodies.waves_of_harmonics(scene);
        reduced.waves = bodies.extend_waves(Waves::default(), &waves, scene, session)?;
        let problem = problem(reduced, bodies.model());
        Ok((bodies, problem.with_modal_ratios(&scene.modal_ratios)?))
    }

    /// Nodal diameters of the waves round a disc that the harmonics of the response of a scene make.
    fn waves_of_harmonics(&self, scene: &Scene) -> Vec<usize> {
        let harmonics = scene.response.resolution.most_harmonics();
        let highest = highest_harmonic(scene).max(harmonics);
        let cyclic = self.model().cyclic.as_ref();
        cyclic.map_or_else(Vec::new, |c| c.excitation().nodal_diameters(highest))
    }

    /// Nodal diameters of all motions of the sectors that an engine order moves differently.
    pub(super) fn waves_of_all_sectors(&self) -> Vec<usize> {
        let excitation = self.model().cyclic.as_ref().map(Cyclic::excitation);
        excitation.map_or_else(Vec::new, |e| e.nodal_diameters(e.different_sectors()))
    }

    /// Waves round a disc with the models of these nodal diameters besides those that they have.
    pub(super) fn extend_waves(
        &mut self,
        waves: Waves,
        nodal_diameters: &[usize],
        scene: &Scene,
        session: &Session<'_>,
    ) -> Result<Waves, Error> {
        let Some(cyclic) = &self.model().cyclic else {
            return Ok(waves);
        };
        let (excitation, influence) = (cyclic.excitation(), cyclic.influence());
        let mut copies = waves.into_copies();
        for nodal_diameter in nodal_diameters {
            if copies.contains_key(nodal_diameter) {
                continue;
            }
            let kept = self.wave(*nodal_diameter, scene, session)?;
            if excitation.wave(1).map(|wave| wave.nodal_diameter) == Some(*nodal_diameter) {
                self.modes.truncation = kept.modes.truncation;
            }
            copies.insert(*nodal_diameter, kept.reduced);
        }
        Ok(Waves::new(excitation, copies).with_influence(influence))
    }

    /// Reduced model of the waves of a nodal diameter, from the store or made anew.
    fn wave(
        &mut self,
        nodal_diameter: usize,
        scene: &Scene,
        session: &Session<'_>,
    ) -> Result<StoredReduction, Error> {
        session.check_running()?;
        let inputs = inputs(self.model(), self.wanted, scene).with_nodal_diameter(nodal_diameter);
        let key = session.store().key(&inputs);
        let mut kept = None;
        session.load(key, StoreSlot::Reduction(&mut kept));
        // What the store keeps is not held in memory, too.
        let mut recovery = OnceLock::new();
        let kept = match kept {
            Some(kept) => kept,
            None => {
                let reduction = self.reduce_waves(nodal_diameter, session)?;
                let kept = StoredReduction {
                    reduced: reduction.model,
                    modes: ReductionModes {
                        truncation: reduction.truncation,
                        ..self.modes.clone()
                    },
                    // That of the sectors in phase serves all waves.
                    prestressed: Prestressed::new(),
                };
                if key.is_some() {
                    let _stage = session.stage(Stage::Keeping);
                    session.keep(key, StoreEntry::Reduction(&kept, &reduction.recovery));
                } else {
                    recovery = OnceLock::from(reduction.recovery);
                }
                kept
            }
        };
        self.wave_recoveries.insert(nodal_diameter, (recovery, key));
        Ok(kept)
    }

    /// Reduces the sector for the waves of a nodal diameter.
    fn reduce_waves(
        &self,
        nodal_diameter: usize,
        session: &Session<'_>,
    ) -> Result<Reduction, Error> {
        let cyclic = self.model().cyclic.as_ref().ok_or(Error::NoDisc)?;
        let structure = self.structure(session)?;
        let title = format!("reduction at {nodal_diameter} nodal diameters");
        let _stage = session.titled_stage(Stage::Reduction, &title);
        let reduction = reduce_wave(structure, cyclic.sectors, nodal_diameter, self.wanted);
        reduction.map_err(|source| Error::NodalDiameter {
            nodal_diameter,
            source,
        })
    }

    /// Makes the recovery of the bodies' motion from the reduced model, and from those of the waves that
    /// harmonics make round a disc.
    ///
    /// # Errors
    /// The errors of the finite elements and of the reduction.
    pub(crate) fn recover(&self, session: &Session<'_>) -> Result<(), Error> {
        recovered(&self.recovery, self.key, session, || {
            let matrices = self.structure(session)?;
            Ok(reduce(self.model(), matrices, self.wanted, session)?.recovery)
        })?;
        for (nodal_diameter, (recovery, key)) in &self.wave_recoveries {
            recovered(recovery, *key, session, || {
                Ok(self.reduce_waves(*nodal_diameter, session)?.recovery)
            })?;
        }
        Ok(())
    }

    /// Matrices of the bodies, assembled once more where the reduction has dropped them.
    pub(super) fn structure(&self, session: &Session<'_>) -> Result<&Structure, Error> {
        if let Some(structure) = self.structure.get() {
            return Ok(structure);
        }
        let structure = stressed(self.model(), &self.prestressed, session)?;
        Ok(self.structure.get_or_init(|| structure))
    }

    /// Modes of each body alone with its flanks held (full model), on the free degrees of freedom
    /// of its interior.
    ///
    /// # Errors
    /// The errors of the finite elements and of the eigenvalues.
    pub fn held_modes(&self, session: &Session<'_>) -> Result<Vec<Modes>, Error> {
        let begin = Instant::now();
        let mut kept = None;
        session.load(self.key, StoreSlot::HeldModes(&mut kept));
        if let Some(kept) = kept {
            session.report_stored_stage(Stage::HeldModes, begin.elapsed());
            return Ok(kept);
        }
        let structure = self.structure(session)?;
        let _stage = session.stage(Stage::HeldModes);
        let bodies = structure.bodies.iter();
        let modes = bodies
            .map(|body| Ok(fixed_interface_modes(body, LISTED_MODES)?))
            .collect::<Result<Vec<Modes>, Error>>()?;
        session.keep(self.key, StoreEntry::HeldModes(&modes));
        Ok(modes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damping::DampingSpec;
    use crate::description::{FrequencyRange, ResponseSpec};
    use crate::dlft::settings::Resolution;
    use crate::model::{
        ContactSpec, CyclicSpec, ExcitationKind, ExcitationSpec, Gap, RotationSpec,
    };

    type Change = fn(&mut Assembly);

    fn assembly() -> Assembly {
        Assembly {
            rotation: Some(RotationSpec {
                point_m: [0.0; 3],
                axis: [1.0, 0.0, 0.0],
                speed_rad_s: 100.0,
                bodies: Vec::new(),
                prestress: Prestress::HeldFlanks,
            }),
            cyclic: Some(CyclicSpec {
                sectors: 6,
                low: Vec::new(),
                high: Vec::new(),
                point_m: [0.0; 3],
                axis: [1.0, 0.0, 0.0],
                engine_order: 1,
                influence: None,
            }),
            contacts: vec![ContactSpec::new("root", "foot", "seat", 0.3)],
            excitations: vec![ExcitationSpec {
                kind: ExcitationKind::force("tip", [1.0, 0.0, 0.0]),
                amplitude: 1.0,
                harmonic: 1,
                phase_rad: 0.0,
            }],
            ..Assembly::default()
        }
    }

    fn planned(changes: &[Change]) -> PlannedReduction {
        let mut assembly = assembly();
        changes.iter().for_each(|change| change(&mut assembly));
        let (from, to) = (0.9, 1.1);
        let range = FrequencyRange::OfFirstLinearMode { from, to };
        let scene = Scene::new(
            "disc",
            assembly,
            ResponseSpec::new(range, Resolution::fixed(3, 64)),
        )
        .damping(DampingSpec::ratio(1e-3));
        PlannedReduction::from_scene(&scene).unwrap()
    }

    #[test]
    fn scenes_that_differ_in_what_only_the_response_reads_share_a_reduction() {
        let of_laws: &[Change] = &[
            |a| a.contacts[0].pair_law.friction = 0.4,
            |a| a.contacts[0].gap = Gap::Mesh,
        ];
        let of_excitation: &[Change] = &[
            |a| a.excitations[0].amplitude = 2.0,
            |a| a.excitations[0].phase_rad = 0.1,
            |a| a.cyclic.as_mut().unwrap().engine_order = 2,
        ];
        let of_bodies: &[Change] = &[
            |a| a.rotation.as_mut().unwrap().speed_rad_s = 101.0,
            |a| a.cyclic.as_mut().unwrap().sectors = 7,
            |a| a.contacts[0].first = "root".to_owned(),
            // Its load reaches to higher frequencies.
            |a| a.excitations[0].harmonic = 5,
        ];
        let of_contact: Change = |a| a.rotation.as_mut().unwrap().prestress = Prestress::Contact;
        let is_shared = |change: &Change| {
            let (plain, stressed) = (planned(&[]), planned(&[of_contact]));
            [
                planned(&[*change]) == plain,
                planned(&[of_contact, *change]) == stressed,
            ]
        };
        assert!(of_laws.iter().all(|c| is_shared(c) == [true, false]));
        assert!(of_excitation.iter().all(|c| is_shared(c) == [true; 2]));
        assert!(of_bodies.iter().all(|c| is_shared(c) == [false; 2]));
    }
}
