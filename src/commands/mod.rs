//! Commands about a scene. Each but [`check`] is a method of [`Workspace`], which gets the meshes
//! (`meshing`), computes with the library and hands the results to [`crate::files`].
//!
//! Each other file has the ranges and the table of the command of its name, `key_range` the range of
//! a key that two commands go through, `unjoined` a warning of bodies in pieces.
//!
//! A command prints nothing: it returns its result, or a table as text, and hands remarks to the
//! reporter. It lets the library compute through `Workspace::computes` alone, so that each run is
//! observed and uses cache and journal. What can be refused without a mesh is refused before
//! anything is meshed.

mod backbone;
mod campbell;
mod curve;
mod key_range;
mod meshing;
mod peaks;
mod unjoined;
mod verify;
mod wear;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use self::backbone::{
    AMPLITUDES, AmplitudeRange, AmplitudeRangeError, AskedBackbone, MOST_AMPLITUDES,
};
use self::campbell::Diagram;
pub use self::campbell::{SpeedRange, SpeedRangeError, table_of_nodal_diameters};
pub use self::curve::AskedCurve;
pub use self::key_range::{KeyRange, KeyRangeError};
use self::meshing::MadeIn;
pub use self::meshing::mesh_inputs;
pub use self::peaks::PeakQuestion;
pub use self::wear::{AskedWear, TOLERANCE, TOLERANCES};
use crate::error::RunError;
use crate::files::{SharedFiles, Sought, makes_mesh};
use crate::reporter::Reporter;
use crate::scene::check::pair_law::reduced_model_lines;
use crate::store::RunStore;
use dovetail_cache::Cache;
use dovetail_export::lock::FolderLock;
use dovetail_export::warning::{LARGE_ERROR, Weight};
use dovetail_export::words::percent;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::dlft::Orbit;
use dovetail_solver::model::{Assembly, ContactLaw, ContactSpec, Gap, Prestress, RotationSpec};
use dovetail_solver::results::modes::NaturalFrequency;
use dovetail_solver::run::{
    self, Bodies, CondensedAssembly, Error, Meshes, NodalDiameters, Options, ReducedScene, Run,
    Session, Source, Stage, Verification, Verified,
};

/// Scene with the means of the commands about it.
#[derive(Debug)]
pub struct Workspace<'a> {
    pub scene: &'a Scene,
    /// Folder in which gmsh writes the mesh of a script.
    pub folder: PathBuf,
    pub cache: Cache,
    /// Files of the run; `None` if nothing is written except the mesh that gmsh makes.
    pub files: Option<Arc<SharedFiles>>,
    pub reporter: Reporter<'a>,
}

impl Workspace<'_> {
    /// What the scene is about: the meshes of its bodies, or its reduced model.
    fn source(&self) -> Result<Source, RunError> {
        let assembly = match &self.scene.subject {
            Subject::Assembly(assembly) => assembly,
            Subject::ReducedModel(spec) => {
                let _stage = self.reporter.stage(Stage::ReducedModel);
                return Ok(dovetail_superelement::read(&spec.folder)?.into());
            }
        };
        self.meshes(assembly).map(Source::from)
    }

    fn meshes(&self, assembly: &Assembly) -> Result<Meshes, RunError> {
        let made_in = MadeIn {
            folder: &self.folder,
            cache: &self.cache,
        };
        let (mesh, origin) = meshing::make_mesh(assembly, made_in, &self.reporter)?;
        if let Some(files) = &self.files {
            files.locked().set_mesh_origin(origin);
        }
        let files = meshing::named_files(assembly, &self.reporter)?;
        Ok(Meshes { mesh, files })
    }

    /// Begins a search that can be resumed, in files if there are any, and notes how many motions of an
    /// interrupted one are known.
    fn start_search(&self, sought: Sought, resume: bool) -> Result<(), RunError> {
        if let Some(files) = &self.files {
            let note = files.locked().begin_search(sought, resume)?;
            if let Some(note) = note {
                self.reporter.note(&note);
            }
        }
        Ok(())
    }

    /// Warns of motions that miss the accuracy, which are some `of` a number.
    fn warn_of_missed<'o>(&self, of: &str, motions: impl Iterator<Item = &'o Orbit>) {
        let missed = motions.filter(|o| !o.outcome.is_converged()).count();
        if missed > 0 {
            let text = format!("{missed} of {of} miss the accuracy asked for");
            self.reporter.warning(Weight::Wrong, text);
        }
    }

    /// Warns of motions that are unstable, which are some `of` a number.
    fn warn_of_unstable<'o>(&self, of: &str, motions: impl Iterator<Item = &'o Orbit>) {
        let unstable = motions.filter(|o| o.stability.is_stable() == Some(false));
        let unstable = unstable.count();
        if unstable > 0 {
            let text = format!(
                "{unstable} of {of} are unstable: the structure does not stay in these motions (columns stable and instability)"
            );
            self.reporter.warning(Weight::Wrong, text);
        }
    }

    /// Warns of large estimated errors of amplitudes. `name` is the name of these.
    fn warn_of_errors<'o>(
        &self,
        name: &str,
        motions: impl Iterator<Item = &'o Orbit>,
        observation: usize,
    ) {
        let errors = motions.filter_map(|orbit| orbit.amplitude_error(observation));
        if let Some(error) = errors.reduce(f64::max).filter(|e| *e > LARGE_ERROR) {
            let text = format!(
                "{name} are estimated to err by up to {}: ask for more response.harmonics, or for response.accuracy",
                percent(error, 2)
            );
            self.reporter.warning(Weight::Doubt, text);
        }
    }

    /// Checks that the scene is about a disc of equal sectors.
    ///
    /// # Errors
    /// [`Error::NoDisc`].
    pub fn is_about_a_disc(&self) -> Result<(), RunError> {
        let disc = self.scene.assembly().and_then(|a| a.cyclic.as_ref());
        disc.map(|_| ()).ok_or_else(|| Error::NoDisc.into())
    }

    /// Bodies and meshes of a scene that must have meshes.
    fn meshed(&self) -> Result<(&Assembly, Meshes), RunError> {
        match self.scene.assembly() {
            Some(assembly) => Ok((assembly, self.meshes(assembly)?)),
            None => Err(RunError::NoMesh {
                scene: self.scene.name.clone(),
            }),
        }
    }

    /// Computes with the library. The run reports to the reporter and uses the cache and the
    /// journal of the folder.
    fn computes<T>(
        &self,
        work: impl FnOnce(&Session<'_>) -> Result<T, Error>,
    ) -> Result<T, RunError> {
        let files = self.files.clone();
        let mut store = RunStore::new(self.cache.clone(), files, &self.reporter);
        self.reporter.run_observed(&mut store, work)
    }

    /// Computes the static state and the response from the mesh or the reduced model.
    ///
    /// # Errors
    /// Errors of the meshes and of the run; a file that cannot be written.
    pub fn solve(&self, options: Options) -> Result<Run, RunError> {
        let source = self.source()?;
        let run = self.computes(|session| run::solve(self.scene, source, options, session))?;
        if let (Some(files), false) = (&self.files, run.held_omega2.is_empty()) {
            files.locked().held_modes(&run)?;
        }
        Ok(run)
    }

    /// Computes up to the static state under the steady load: a run without a response.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`].
    pub fn static_state(&self, options: Options) -> Result<Run, RunError> {
        let source = self.source()?;
        self.computes(|session| run::static_state(self.scene, source, options, session))
    }

    /// Makes and checks only the mesh, and pairs its flanks.
    ///
    /// # Errors
    /// Errors of gmsh, an unreadable or unusable mesh, missing groups, flanks that do not match; a
    /// scene without mesh.
    pub fn mesh(&self) -> Result<(), RunError> {
        let (assembly, meshes) = self.meshed()?;
        self.computes(|session| run::Bound::new(assembly, &meshes, session))?;
        Ok(())
    }

    /// Modes of each body with its flanks held, fixed-interface modes, modes of the stuck assembly,
    /// and those of a disc over its nodal diameters. `nodal_diameter` is the one whose shapes are
    /// written on the whole disc.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; a scene that is not about a disc, or a disc without such
    /// waves.
    pub fn modes(
        &self,
        nodal_diameter: Option<usize>,
    ) -> Result<(Vec<NaturalFrequency>, Option<NodalDiameters>), RunError> {
        // Before anything is meshed.
        if nodal_diameter.is_some() {
            self.is_about_a_disc()?;
        }
        let source = self.source()?;
        let found =
            self.computes(|session| run::modes(self.scene, source, nodal_diameter, session))?;
        let rows = match &self.files {
            Some(files) => files.locked().modal_analysis(&found)?,
            None => found.reduced.natural_frequencies(None, &found.held_omega2),
        };
        Ok((rows, found.nodal_diameters))
    }

    /// Computes the modes over the speed and returns a table for the reader. `engine_orders` are
    /// those whose crossings are listed; empty for all up to 36.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; a scene without mesh or without an axis of rotation.
    pub fn campbell(
        &self,
        speeds: SpeedRange,
        engine_orders: &[usize],
    ) -> Result<String, RunError> {
        // Before anything is meshed.
        let rotation = self.scene.assembly().map(|a| a.rotation.as_ref());
        if rotation == Some(None) {
            return Err(Error::NoRotation.into());
        }
        if rotation.flatten().map(|r| r.prestress) == Some(Prestress::Contact) {
            self.reporter.note(
                "modes over the speed: the stress is that with all pairs stuck, a multiple of the square of the speed; that of \
                 the static state with contact is in `dovetail modes` at one speed",
            );
        }
        let (_, meshes) = self.meshed()?;
        let speeds_rpm = speeds.values_rpm();
        let campbell =
            self.computes(|session| run::campbell(self.scene, meshes, &speeds_rpm, session))?;
        for (rpm, error) in &campbell.failed {
            let text = format!("no modes at {rpm} rpm: {error}");
            self.reporter.warning(Weight::Wrong, text);
        }
        let of_scene = self.scene.engine_orders.iter().map(|order| order.order.0);
        let orders: Vec<usize> = match engine_orders {
            [] => of_scene.collect(),
            asked => asked.to_vec(),
        };
        let peaks =
            self.computes(|session| run::crossing_peaks(self.scene, &campbell, &orders, session))?;
        for peak in &peaks {
            if let Err(error) = &peak.peak {
                let crossing = &peak.crossing;
                let text = format!(
                    "no peak at the crossing of mode {} with engine order {} at {:.1} rpm: {error}",
                    crossing.mode, crossing.engine_order, crossing.speed_rpm
                );
                self.reporter.warning(Weight::Wrong, text);
            }
        }
        let diagram = Diagram::new(&campbell, &orders, &peaks);
        if let Some(files) = &self.files {
            let drawn = (
                &diagram.curves()[..],
                &diagram.drawn_orders(),
                &diagram.operation(),
            );
            files
                .locked()
                .campbell(&campbell, (&diagram.crossings(), &peaks), drawn)?;
        }
        let observation = campbell.bound.model.observations.first();
        let observation = observation.map_or("", |observation| observation.name.as_str());
        Ok(diagram.table() + &campbell::table_of_peaks(observation, &peaks))
    }

    /// Compares harmonic balance with integration in time, and also returns a table for the reader.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; a harmonic balance without a motion to compare.
    pub fn verify(&self, asked: &Verification) -> Result<(Verified, String), RunError> {
        // Before anything is meshed.
        asked.check()?;
        run::check_one_speed(self.scene, "an integration in time needs one speed")?;
        let source = self.source()?;
        let verified = self.computes(|session| run::verify(self.scene, source, asked, session))?;
        self.reporter.judge(&verified.run);
        if let Some(files) = &self.files {
            files.locked().verification(&verified, asked)?;
        }
        let table = verify::tables(&verified.comparisons);
        Ok((verified, table))
    }

    /// Computes the reduced model and writes it to a folder for `[reduced_model]`. The folder has
    /// forces of 1 N in all, in the proportions of the scene: `reduced_model.force_n` alone gives
    /// their sum. If the scene has excitations other than forces, the folder has them unscaled, and
    /// `reduced_model.force_n` multiplies them.
    ///
    /// # Errors
    /// Errors of [`Workspace::mesh`] and of the reduction; a scene without pairs.
    pub fn reduce(&self) -> Result<(), RunError> {
        let (_, meshes) = self.meshed()?;
        let condensed = self.computes(|session| run::reduce(self.scene, meshes, session))?;
        let Some(files) = &self.files else {
            return Ok(());
        };
        let law = {
            let _stage = self.reporter.stage(Stage::ReducedModelFiles);
            files.locked().reduced_model(&condensed.reduced)?
        };
        match law.map(|law| lines_of_scene(&condensed, law, &self.folder)) {
            Some(lines) => self.reporter.note(&lines),
            None => self.reporter.warning(
                Weight::Doubt,
                "the pairs differ in friction, stiffness or clearance, of which [reduced_model] has one value for all",
            ),
        }
        Ok(())
    }

    /// Computes the reduced model and keeps it in the cache, with the data from which later runs
    /// recover the motion of the bodies.
    ///
    /// # Errors
    /// Errors of [`Workspace::mesh`] and of the reduction; no cache.
    pub fn reduce_into_cache(&self, held_modes: bool) -> Result<(), RunError> {
        if self.scene.assembly().is_none() {
            return Err(RunError::NoMesh {
                scene: self.scene.name.clone(),
            });
        }
        let Some(cache) = self.cache.folder() else {
            return Err(RunError::NoCache);
        };
        // gmsh writes its mesh there.
        let _lock = makes_mesh(self.scene)
            .then(|| FolderLock::acquire(&self.folder))
            .transpose()?;
        let (_, meshes) = self.meshed()?;
        self.computes(|session| {
            let reduced = ReducedScene::new(self.scene, meshes.into(), session)?;
            let bodies: Option<&Bodies> = reduced.bodies.as_ref().filter(|_| held_modes);
            bodies.map(|bodies| bodies.held_modes(session)).transpose()
        })?;
        self.reporter
            .note(&format!("reduced model in the cache {}", cache.display()));
        Ok(())
    }
}

/// Lines of a scene that read a reduced model from its folder. All of its pairs follow `law`.
fn lines_of_scene(condensed: &CondensedAssembly, law: PairLaw, folder: &Path) -> String {
    // A scene counts paths from its own folder, wherever that will be.
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    format!(
        "[reduced_model]\nfolder = {}\n{}force_n = {:?}",
        toml::Value::String(folder.display().to_string()),
        reduced_model_lines(law),
        condensed.force_n
    )
}

/// Returns `true` if the scene has contacts, and neither loads nor interferences.
fn nothing_presses(assembly: &Assembly) -> bool {
    let turns = |rotation: &RotationSpec| rotation.speed_rad_s > 0.0;
    let is_slack = |contact: &ContactSpec| {
        contact.law == ContactLaw::UnilateralCoulomb
            && contact.pair_law.gap_m >= 0.0
            && contact.gap == Gap::Closed
    };
    !assembly.rotation.as_ref().is_some_and(turns)
        && assembly.loads.is_empty()
        && !assembly.contacts.is_empty()
        && assembly.contacts.iter().all(is_slack)
}

/// Checks the scene without computing or writing anything.
///
/// # Errors
/// A mesh or script that does not exist, a reduced model that cannot be read.
pub fn check(scene: &Scene, reporter: &Reporter<'_>) -> Result<(), RunError> {
    match &scene.subject {
        Subject::Assembly(assembly) => meshing::check(assembly, reporter)?,
        Subject::ReducedModel(spec) => {
            dovetail_superelement::read(&spec.folder)?;
        }
    }
    let but = match &scene.subject {
        Subject::Assembly(assembly) if nothing_presses(assembly) => {
            ", but no steady load presses the contacts together: it has no speed_rpm above 0, no \
             [[load]] and no interference (gap_m below 0)"
        }
        _ => "",
    };
    reporter.note(&format!("scene \"{}\" is sound{but}", scene.name));
    Ok(())
}
