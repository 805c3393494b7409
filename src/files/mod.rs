//! Writes the files of a run as its events come, and collects the numbers of summary.json, which is
//! written for the last time when the run is done, fails or is interrupted.
//!
//! This folder decides which files a run has, by which names, and when they are written; a command
//! beside a run adds its own. [`dovetail_export`] knows how a file of each format is written. Each
//! file is asked for by name from the [`OutputFolder`], before it is written. `solving` has the tables
//! of a response under way, `drawn` the pictures of a response, `conditions` the words below their
//! titles, `peaks`, `curve`, `backbone` and `wear` the pictures of the commands of these names, and
//! `summary` the content of summary.json.
//!
//! Threads that end a run early use its files too (`shared`, [`SharedFiles`]). After each write the folder
//! must therefore be one that can be read, and resumed where frequencies are solved.

mod backbone;
mod conditions;
mod curve;
mod drawn;
mod peaks;
mod shared;
mod solving;
mod summary;
mod wear;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub use self::backbone::BackboneFiles;
use self::conditions::{at_rest, in_motion, in_motion_over};
pub use self::curve::CurveFiles;
use self::curve::CurveUnderWay;
pub use self::peaks::PeakLine;
use self::peaks::PeaksFound;
pub use self::shared::SharedFiles;
use self::solving::Solving;
pub use self::summary::Taken;
use crate::error::RunError;
use crate::exit::ExitStatus;
use dovetail_export::csv::PeakRow;
use dovetail_export::curves::Sweep;
use dovetail_export::flank::{FlankSeries, WornFlanks};
use dovetail_export::folder::{Beginning, OtherScene, OutputFolder, knows_itself, way_on};
use dovetail_export::journal::{
    CURVE_JOURNAL, Inputs, JOURNAL, Journal, PEAKS_JOURNAL, WEAR_JOURNAL,
};
use dovetail_export::lock::FolderLock;
use dovetail_export::manifest::{self, MeshOrigin, ResponseSummary, RunState, Summary};
use dovetail_export::plots::{
    CampbellFamily, EngineOrders, Heading, Operation, write_campbell, write_nodal_diameters,
};
use dovetail_export::warning::{Warning, by_weight};
use dovetail_export::words::counted;
use dovetail_export::{ExportError, csv, report, vtu};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::{EngineOrder, Scene};
use dovetail_solver::dlft::SolvedFrequency;
use dovetail_solver::excitation::NamedExcitation;
use dovetail_solver::model::{ExcitationKind, ExcitationSpec, MeshKind, Strength};
use dovetail_solver::reduced::ReducedModel;
use dovetail_solver::results::modes::{ModeKind, ModeShape, NaturalFrequency};
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::results::resultants::Resultant;
use dovetail_solver::run::{
    Bodies, Campbell, Crossing, CrossingPeak, CurveQuestion, Event, ModalAnalysis, NodalDiameters,
    PeakAt, PeakStress, RecordKey, RecordKind, Reduced, ResponseResult, Run, StaticResult,
    Verification, Verified, WearCourse,
};
use dovetail_solver::superelement::Superelement;

/// Name of the mesh of a script in the folder of the results.
pub const MESH_FILE: &str = "mesh.msh";

/// Selection of the files that a run writes, and their folder.
#[derive(Debug, Clone)]
pub struct Output {
    pub folder: PathBuf,
    /// Path of the scene, for the record of what was run.
    pub scene_file: PathBuf,
    /// True if fields on the bodies are written.
    pub fields: bool,
    /// Number of frames of a period of the motion at the peak, which are written with the fields;
    /// `None` for no frames.
    pub frames: Option<usize>,
    /// True if the motion at the peak is written on all sectors of a disc, too.
    pub whole_disc: bool,
    /// True if the stress at the integration points is written with the fields.
    pub stress_points: bool,
    /// Pictures in addition to those of every run.
    pub further_plots: Vec<FurtherPlot>,
}

/// Picture that is drawn on request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FurtherPlot {
    /// Amplitude on a logarithmic axis.
    Logarithmic,
    /// Phase of the first harmonic.
    Phase,
}

/// Least time between two updates of the tables of a response under way.
const INTERVAL: Duration = Duration::from_secs(5);
/// Least time between two updates as a multiple of the duration of the last one, which limits the
/// share of the time spent on updates.
const SHARE: u32 = 20;

/// Writes the events of a run to files of one folder.
#[derive(Debug)]
pub struct Files {
    out: OutputFolder,
    /// Figures so far; if the run fails, these are all.
    summary: Summary,
    /// Origin of the mesh.
    origin: MeshOrigin,
    /// True if fields for ParaView are written.
    fields: bool,
    /// Number of frames of the motion at the peak, if requested.
    frames: Option<usize>,
    /// True if the motion at the peak is requested on all sectors of a disc.
    whole_disc: bool,
    /// True if the stress at the integration points is requested.
    stress_points: bool,
    /// Strength of the material of each body of the scene.
    strengths: Vec<Option<Strength>>,
    /// Pictures in addition to those of every run.
    further_plots: Vec<FurtherPlot>,
    /// Engine order of a run-up.
    along: Option<EngineOrder>,
    /// True if the scene asks for a curve that is followed.
    follows: bool,
    /// Conditions under the titles of pictures of the static state.
    at_rest: String,
    /// Conditions under the titles of pictures of the response.
    in_motion: String,
    begun: Instant,
    beginning: Beginning,
    journal: Journal,
    /// Right to write into the folder.
    _lock: FolderLock,
    /// Journal of the motions that a search has found, of `dovetail peaks` and `dovetail wear`, and
    /// what they are called.
    search: Option<(Journal, &'static str)>,
    /// Peaks that a search has found so far.
    peaks_found: PeaksFound,
    /// Curve over a key that is being followed.
    curve_under_way: Option<CurveUnderWay>,
    /// Worn flanks, if fields are written.
    worn: Option<WornFlanks>,
    /// Responses that have begun, the scene's own first.
    solving: Vec<Solving>,
    /// Warnings so far.
    warnings: Vec<Warning>,
    /// Rows of modes.csv.
    rows: Vec<NaturalFrequency>,
    /// The 2H+1 nodal fields of each body at the peak, if fields are written.
    motion: Option<Vec<Vec<NodalField>>>,
    /// Stress of each body at the peak, if fields are written.
    stress: Option<PeakStress>,
    /// Forces of contacts, supports and springs: those in the static state until the peak is known.
    forces: Vec<Resultant>,
}

impl Files {
    /// Takes the folder of the output for a run of the scene.
    ///
    /// # Errors
    /// A folder that cannot be written, that holds the run of another scene, or in which a run is
    /// going on.
    pub fn open(
        scene: &Scene,
        output: &Output,
        other: OtherScene,
        beginning: Beginning,
    ) -> Result<Self, RunError> {
        let lock = FolderLock::take(&output.folder)?;
        let summary = summary::beginning(scene, &output.scene_file);
        let journal = Journal::open(&output.folder.join(JOURNAL))?;
        let to_resume = !journal.is_empty();
        let out = OutputFolder::open(&output.folder, &summary, other, beginning, to_resume)
            .inspect_err(|_| {
                if journal.is_empty() {
                    let _ = journal.remove();
                }
            })?;
        let mesh = makes_mesh(scene).then_some(MESH_FILE);
        out.list(
            [Some(JOURNAL), mesh]
                .into_iter()
                .flatten()
                .map(str::to_owned),
        )?;
        Ok(Self {
            out,
            summary,
            origin: MeshOrigin::default(),
            fields: output.fields,
            frames: output.frames,
            whole_disc: output.whole_disc,
            stress_points: output.stress_points,
            strengths: scene.assembly().map_or_else(Vec::new, |assembly| {
                assembly.bodies.iter().map(|body| body.strength).collect()
            }),
            further_plots: output.further_plots.clone(),
            along: scene.response.along_engine_order,
            follows: scene.response.points.is_none(),
            at_rest: at_rest(scene),
            in_motion: in_motion(scene),
            begun: Instant::now(),
            beginning,
            journal,
            _lock: lock,
            search: None,
            peaks_found: PeaksFound::default(),
            curve_under_way: None,
            worn: None,
            solving: Vec::new(),
            warnings: Vec::new(),
            rows: Vec::new(),
            motion: None,
            stress: None,
            forces: Vec::new(),
        })
    }

    /// Writes modes.csv.
    ///
    /// # Errors
    /// A file that cannot be written.
    fn modes(&mut self, rows: Vec<NaturalFrequency>) -> Result<(), RunError> {
        csv::write_modes(&self.out.file("modes.csv")?, &rows)?;
        self.rows = rows;
        Ok(())
    }

    /// Writes modes.csv and, for a meshed assembly, modes.vtu. Beside a run the modes about its
    /// static state stay. Returns the rows.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn modal_analysis(
        &mut self,
        modes: &ModalAnalysis,
    ) -> Result<Vec<NaturalFrequency>, RunError> {
        if let Some(bodies) = &modes.reduced.bodies {
            let model = bodies.model();
            vtu::write_modes(&self.out.file("modes.vtu")?, model, &modes.shapes)?;
            if let (Some(cyclic), Some(disc)) = (&model.cyclic, &modes.disc) {
                let name = format!("modes_nodal_diameter_{}.vtu", disc.nodal_diameter);
                vtu::write_disc(&self.out.file(&name)?, model, cyclic, disc)?;
            }
        }
        if let Some(found) = &modes.nodal_diameters {
            self.nodal_diameters(found)?;
        }
        let mut own = modes.reduced.natural_frequencies(None, &modes.held_omega2);
        for row in &mut own {
            let mut shapes = modes.shapes.iter();
            let shape =
                shapes.find(|s| (s.kind, &s.body, s.mode) == (row.kind, &row.body, row.mode));
            row.modal_mass_kg = shape.and_then(ModeShape::modal_mass_kg);
        }
        let mut rows = own.clone();
        if self.out.is_beside_run() {
            let earlier = csv::read_modes(&self.out.file("modes.csv")?);
            rows.extend(
                earlier
                    .into_iter()
                    .filter(|row| row.kind == ModeKind::Linear),
            );
        }
        self.summary.blade_frequency_hz = summary::first_hz(&modes.held_omega2);
        self.modes(rows)?;
        Ok(own)
    }

    /// Writes modes_nodal_diameters.csv and plots/nodal_diameters.svg.
    fn nodal_diameters(&mut self, found: &NodalDiameters) -> Result<(), RunError> {
        csv::write_nodal_diameters(&self.out.file("modes_nodal_diameters.csv")?, found)?;
        let speed = if found.speed_rpm > 0.0 {
            format!("{:.0} rpm", found.speed_rpm)
        } else {
            "at rest".to_owned()
        };
        let heading = Heading {
            title: &format!("{}: modes of the disc", self.summary.scene.name),
            conditions: &format!("{} sectors, all pairs stuck, {speed}", found.sectors),
        };
        let path = self.out.file("plots/nodal_diameters.svg")?;
        Ok(write_nodal_diameters(&path, heading, found)?)
    }

    /// Writes modes.csv again, with the modes of the bodies with held flanks.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn held_modes(&mut self, run: &Run) -> Result<(), RunError> {
        let state = Some(&run.statics.state);
        self.summary.blade_frequency_hz = summary::first_hz(&run.held_omega2);
        self.modes(run.reduced.natural_frequencies(state, &run.held_omega2))
    }

    /// Sets the origin of the mesh.
    pub fn comes_from(&mut self, origin: MeshOrigin) {
        self.origin = origin;
    }

    /// Writes modes_campbell.csv, modes_crossings.csv and plots/campbell.svg.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn campbell(
        &self,
        campbell: &Campbell,
        (crossings, peaks): (&[Crossing], &[CrossingPeak]),
        diagram: (&[CampbellFamily], &EngineOrders, &Operation),
    ) -> Result<(), RunError> {
        csv::write_campbell(&self.out.file("modes_campbell.csv")?, &campbell.families)?;
        let path = self.out.file("modes_crossings.csv")?;
        csv::write_crossings(&path, campbell.operating_rpm, crossings, peaks)?;
        let heading = Heading {
            title: &format!("{}: natural frequencies", self.summary.scene.name),
            conditions: &if campbell.operating_rpm > 0.0 {
                format!("operation at {:.0} rpm", campbell.operating_rpm)
            } else {
                String::new()
            },
        };
        let path = self.out.file("plots/campbell.svg")?;
        let (families, orders, operation) = diagram;
        Ok(write_campbell(&path, heading, families, orders, operation)?)
    }

    /// Begins the search for peaks over the values of these keys, the key of each line first. Returns the number of those that are not looked for again,
    /// which is 0 unless an interrupted search is to be resumed.
    ///
    /// # Errors
    /// The file is not a journal, or cannot be written.
    pub fn begin_peaks(&mut self, keys: &[&str], resume: bool) -> Result<usize, RunError> {
        self.peaks_found.keys = keys.iter().map(|key| (*key).to_owned()).collect();
        self.begin_search((PEAKS_JOURNAL, "peaks"), resume)
    }

    /// Begins the line of peaks at a value of the second key, if there is one.
    pub fn begin_line_of_peaks(&mut self, also: Option<f64>) {
        self.peaks_found.also = also;
    }

    /// Begins to wear the contacts. Returns the number of vibrations that are not solved for again,
    /// which is 0 unless an interrupted computation is to be resumed.
    ///
    /// # Errors
    /// Those of [`Files::begin_peaks`].
    pub fn begin_wear(&mut self, resume: bool) -> Result<usize, RunError> {
        self.begin_search((WEAR_JOURNAL, "vibrations"), resume)
    }

    /// Begins a curve over a key. Returns the number of motions that are not solved for again, which
    /// is 0 unless an interrupted curve is to be resumed.
    ///
    /// # Errors
    /// Those of [`Files::begin_peaks`].
    pub fn begin_curve(
        &mut self,
        question: &CurveQuestion<'_>,
        resume: bool,
    ) -> Result<usize, RunError> {
        self.curve_under_way = Some(CurveUnderWay::of(question));
        self.begin_search((CURVE_JOURNAL, "motions"), resume)
    }

    fn begin_search(
        &mut self,
        (file, motions): (&str, &'static str),
        resume: bool,
    ) -> Result<usize, RunError> {
        let mut journal = Journal::open(&self.out.file(file)?)?;
        if !resume {
            journal.clear()?;
        } else if !journal.is_empty() {
            knows_itself(&self.summary, &self.out.path().join(file))?;
        }
        Ok(self.search.insert((journal, motions)).0.count())
    }

    /// Motions under this key that were kept before the run was interrupted.
    ///
    /// # Errors
    /// A journal of other inputs, or one that cannot be read; a file that cannot be written.
    pub fn records(&mut self, key: &RecordKey) -> Result<Vec<SolvedFrequency>, RunError> {
        match (key.kind, &mut self.search) {
            (RecordKind::Response | RecordKind::RunUp, _) => self.solved(&key.hash),
            (RecordKind::Peak | RecordKind::Curve, Some((journal, _))) => {
                Ok(journal.solved(&key.hash)?)
            }
            (RecordKind::Peak | RecordKind::Curve, None) => Ok(Vec::new()),
        }
    }

    /// Keeps a motion.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn append(&mut self, key: &RecordKey, motion: &SolvedFrequency) -> Result<(), RunError> {
        match (key.kind, &mut self.search) {
            (RecordKind::Response | RecordKind::RunUp, _) => self.frequency(&key.hash, motion),
            (RecordKind::Peak | RecordKind::Curve, Some((journal, _))) => {
                journal.append(&key.hash, motion)?;
                journal.sync()?;
                if let Some(curve) = &mut self.curve_under_way {
                    curve.add(motion);
                }
                Ok(())
            }
            (RecordKind::Peak | RecordKind::Curve, None) => Ok(()),
        }
    }

    /// Writes curve.csv, and draws the amplitude of the motions at one frequency over a key.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn curve(&mut self, scene: &Scene, curve: &CurveFiles<'_>) -> Result<(), RunError> {
        csv::write_curve(&self.out.file("curve.csv")?, curve.key, &curve.rows)?;
        self.summary.curve = Some(manifest::curve_summary(
            curve.key,
            curve.frequency_hz,
            curve.found,
        ));
        let conditions = in_motion_over(scene, &[curve.key]);
        curve::draw(curve, &conditions, |file| {
            self.out.file(&format!("plots/{file}.svg"))
        })
    }

    /// Writes peaks.csv and draws amplitude, frequency and loss factor of the peaks. `keys` are the
    /// key of the value of each line, if there is one, and the key of the values along it. Where
    /// there are several lines, the amplitudes are drawn as a map, too.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn peaks(
        &self,
        scene: &Scene,
        keys: &[&str],
        lines: &[PeakLine<'_>],
    ) -> Result<(), RunError> {
        let rows: Vec<PeakRow<'_>> = lines.iter().flat_map(|line| line.rows.clone()).collect();
        csv::write_peaks(&self.out.file("peaks.csv")?, keys, &rows)?;
        let conditions = in_motion_over(scene, keys);
        peaks::draw(keys, (lines, &conditions), |file| {
            self.out.file(&format!("plots/{file}.svg"))
        })
    }

    /// Adds a peak to peaks.csv of a search under way.
    fn peak_found(
        &mut self,
        reduced: &Reduced,
        observation: usize,
        peak: &PeakAt,
    ) -> Result<(), RunError> {
        if self.peaks_found.keys.is_empty() {
            return Ok(());
        }
        self.peaks_found.add(&reduced.pairs, observation, peak);
        let found = &self.peaks_found;
        let keys: Vec<&str> = found.keys.iter().map(String::as_str).collect();
        Ok(csv::write_peaks(
            &self.out.file("peaks.csv")?,
            &keys,
            &found.rows(),
        )?)
    }

    /// Writes backbone.csv and draws frequency, damping and peak of a mode.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn backbone(&self, scene: &Scene, backbone: &BackboneFiles<'_>) -> Result<(), RunError> {
        csv::write_backbone(&self.out.file("backbone.csv")?, backbone.rows)?;
        // A backbone has the peaks of all forces.
        let conditions = in_motion_over(scene, &["excitation.*.force_n"]);
        backbone::draw(backbone, &conditions, |file| {
            self.out.file(&format!("plots/{file}.svg"))
        })
    }

    /// Writes what the contacts have become, and draws amplitude, frequency and depth over the cycles.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn wear(&mut self, course: &WearCourse<'_>) -> Result<(), RunError> {
        if let Some(last) = course.blocks.last() {
            let path = self.out.file("wear_pairs.csv")?;
            csv::write_wear_pairs(&path, &course.reduced.pairs, course.area_m2, last)?;
        }
        wear::draw(course, &self.in_motion, |file| {
            self.out.file(&format!("plots/{file}.svg"))
        })
    }

    /// Writes wear.csv so far and, if fields are written, the flanks after the last block.
    fn worn(&mut self, course: &WearCourse<'_>) -> Result<(), RunError> {
        csv::write_wear(&self.out.file("wear.csv")?, course)?;
        self.summary.wear = manifest::wear_summary(course);
        let bodies = course.reduced.bodies.as_ref().filter(|_| self.fields);
        let (Some(bodies), Some(last)) = (bodies, course.blocks.last()) else {
            return Ok(());
        };
        let flanks = self
            .worn
            .get_or_insert_with(|| WornFlanks::new(bodies.model()));
        self.out.list([WornFlanks::file(course.blocks.len() - 1)])?;
        flanks.write(self.out.path(), last)?;
        Ok(flanks.write_collection(&self.out.file(wear::WORN)?)?)
    }

    /// Writes verify.csv.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn verification(
        &mut self,
        verified: &Verified,
        asked: &Verification,
    ) -> Result<(), RunError> {
        let (run, comparisons) = (&verified.run, &verified.comparisons);
        summary::of_statics(&mut self.summary, &run.reduced, &run.statics);
        self.summary.verification = Some(manifest::verification_summary(
            comparisons,
            asked.steps_per_period,
            asked.tolerance,
        ));
        let path = self.out.file("verify.csv")?;
        Ok(csv::write_verification(&path, comparisons)?)
    }

    /// Figures so far.
    pub fn summary(&self) -> &Summary {
        &self.summary
    }

    /// Records the time and the stages of the run so far.
    pub fn take_down(&mut self, taken: Taken) {
        self.summary.stages = taken.stages;
        self.summary.seconds = taken.seconds;
        self.summary.processor_seconds = taken.processor_seconds;
    }

    /// Path of the folder.
    pub fn folder(&self) -> &Path {
        self.out.path()
    }

    /// Writes summary.json of a run that came to its end. The run failed if the verdict is that
    /// there is no result.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(&mut self, verdict: &Result<(), RunError>) -> Result<(), RunError> {
        if self.beginning != Beginning::Anew {
            self.out.remove_earlier()?;
        }
        // What was solved stands in the tables.
        if !self.solving.is_empty() {
            self.journal.clear()?;
        }
        self.remove_empty_journal()?;
        if let Some((journal, _)) = &self.search {
            journal.remove()?;
        }
        let (state, why) = ended(verdict);
        Ok(self.out.write_summary(self.with_warnings(), state, why)?)
    }

    /// Figures so far, with the warnings.
    fn with_warnings(&self) -> Summary {
        Summary {
            warnings: by_weight(&self.warnings).into_iter().cloned().collect(),
            ..self.summary.clone()
        }
    }

    /// Writes report.html of a run with this verdict.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn report(
        &mut self,
        scene: &Scene,
        run: &Run,
        verdict: &Result<(), RunError>,
    ) -> Result<(), RunError> {
        let (state, why) = ended(verdict);
        let summary = Summary {
            state,
            why,
            files: self.out.files(state),
            ..self.with_warnings()
        };
        let contents = report::Contents {
            scene,
            summary: &summary,
            conditions: &self.in_motion,
            observations: &run.reduced.observations(),
            pairs: &run.reduced.pairs,
            model: run.reduced.bodies.as_ref().map(Bodies::model),
            modes: &self.rows,
            static_state: Some(&run.statics.state),
            sweep: run.response.as_ref().map(sweep),
            motion: self.motion.as_deref(),
            stress: self.stress.as_ref(),
            forces: &self.forces,
        };
        Ok(report::write(&self.out.file(report::REPORT)?, &contents)?)
    }

    /// Writes the folder of `dovetail reduce`. Returns the law of its pairs if all have the same.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn reduced_model(
        &self,
        scene: &Scene,
        reduced: &Reduced,
    ) -> Result<Option<PairLaw>, RunError> {
        let (problem, rows) = (&reduced.problem, &reduced.pairs.rows);
        let element = Superelement {
            model: ReducedModel::clone(&problem.reduced),
            excitations: named_excitations(scene, reduced),
            contacts: reduced.pairs.named_contacts(),
            positions_m: rows.iter().map(|p| p.position_m).collect(),
            areas_m2: rows.iter().map(|p| p.area_m2).collect(),
        };
        self.out
            .list(dovetail_superelement::FILES.map(str::to_owned))?;
        dovetail_superelement::write(self.out.path(), &element)?;
        let first = problem.laws.first().copied();
        Ok(first.filter(|law| problem.laws.iter().all(|other| other == law)))
    }

    /// Removes the journal if it has no frequencies from which to continue.
    fn remove_empty_journal(&self) -> Result<(), RunError> {
        if self.journal.is_empty() {
            self.journal.remove()?;
        }
        Ok(())
    }

    /// Writes summary.json of a run that failed before its last file. If it had no results yet and
    /// made no mesh, the summary of a finished run that was there before stays. An error of writing
    /// is ignored, as the error of the run is the one to report.
    pub fn failed(&self, error: &dyn Error) {
        if !self.out.is_running() {
            return;
        }
        let _ = self.remove_empty_journal();
        if let Some((journal, _)) = self.search.as_ref().filter(|(j, _)| j.is_empty()) {
            let _ = journal.remove();
        }
        let under_way = [
            JOURNAL,
            PEAKS_JOURNAL,
            WEAR_JOURNAL,
            CURVE_JOURNAL,
            MESH_FILE,
        ];
        if self.origin.gmsh.is_none() && self.out.puts_back(&under_way) {
            return;
        }
        let _ = self.write_summary(RunState::Failed, Some(told(error)));
    }

    /// Leaves the folder of a run that is interrupted by `signal` in a state that can be read and
    /// resumed. Returns the message for the user.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn interrupted(&mut self, signal: &str) -> Result<String, RunError> {
        let folder = self.out.path().display().to_string();
        if let Some((journal, motions)) = &self.search {
            let is_empty = journal.is_empty();
            let why = match is_empty {
                true => format!("{signal} before the first of its {motions}"),
                false => {
                    let one = motions.trim_end_matches('s');
                    format!("{signal} after {}", counted(journal.count(), one, motions))
                }
            };
            self.remove_empty_journal()?;
            let curve = self.curve_under_way.as_ref();
            let file = || self.out.file("curve.csv");
            let table = match curve.map_or(Ok(false), |curve| curve.write(file))? {
                true => Some("curve.csv"),
                false => (!self.peaks_found.keys.is_empty()).then_some("peaks.csv"),
            };
            self.write_summary(RunState::Interrupted, Some(why.clone()))?;
            if is_empty {
                return Ok(format!("ended by {why}; there is nothing to resume"));
            }
            let table = table.map_or_else(String::new, |table| {
                format!("; {folder} has a table of those found, {table}")
            });
            return Ok(format!(
                "ended by {why}{table}. {}",
                way_on(&self.summary, "does not look for them again")
            ));
        }
        let Some(solving) = self.solving.last() else {
            self.remove_empty_journal()?;
            let until = match self.beginning {
                Beginning::Beside => "end",
                Beginning::Anew | Beginning::Resumed => "first frequency",
            };
            let why = format!("{signal} before the {until}");
            self.write_summary(RunState::Interrupted, Some(why.clone()))?;
            return Ok(format!(
                "ended by {why}; {folder} holds what was written until then"
            ));
        };
        let progress = solving.progress(self.follows);
        let own = &self.solving[0];
        let (partial, pairs) = (own.partial(), &own.pairs);
        csv::write_contact(&self.out.file("contact.csv")?, pairs, &partial)?;
        let first = own.observed.first().map(|first| first.name.as_str());
        let summary = manifest::response_summary(pairs, first, &partial, self.along);
        self.summary.response = Some(summary);
        self.write_tables()?;
        let why = format!("{signal} after {progress}");
        self.write_summary(RunState::Interrupted, Some(why.clone()))?;
        Ok(format!(
            "ended by {why}; they are in {folder}. {}",
            way_on(&self.summary, "goes on with the others")
        ))
    }

    /// Writes the tables of the responses under way, and all that is needed to resume.
    fn write_tables(&self) -> Result<(), RunError> {
        for solving in &self.solving {
            let partial = solving.partial();
            csv::write_response(
                &self.out.file(&solving.table)?,
                &solving.observed,
                &partial,
                self.along,
            )?;
            if let Some(flanks) = &solving.flanks {
                flanks.write_collection(&self.out.file(FLANKS)?, &partial.orbits)?;
            }
        }
        Ok(self.journal.sync()?)
    }

    /// Writes summary.json with the figures so far.
    fn write_summary(&self, state: RunState, why: Option<String>) -> Result<(), RunError> {
        let mut summary = self.with_warnings();
        summary.seconds = self.begun.elapsed().as_secs_f64();
        Ok(self.out.write_summary(summary, state, why)?)
    }
}

/// State of a run with this verdict, and the reason if it failed.
fn ended(verdict: &Result<(), RunError>) -> (RunState, Option<String>) {
    match verdict {
        Err(error) if error.exit_status() == ExitStatus::Failed => {
            (RunState::Failed, Some(told(error)))
        }
        _ => (RunState::Finished, None),
    }
}

/// Message of an error with its causes.
fn told(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text += &format!(": {error}");
        cause = error.source();
    }
    text
}

impl Files {
    /// Writes the files for an event.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn hear(&mut self, event: &Event<'_>) -> Result<(), RunError> {
        match event {
            Event::Model { bound, .. } => {
                self.summary = summary::of_bound(&self.summary, &self.origin, bound);
                Ok(())
            }
            Event::Reduced(reduced) => {
                self.summary = summary::of_reduced(&self.summary, reduced);
                if let Some(curve) = &mut self.curve_under_way {
                    curve.begins_with(reduced)?;
                }
                if self.beginning == Beginning::Beside {
                    return Ok(());
                }
                self.modes(reduced.natural_frequencies(None, &[]))
            }
            Event::StaticState { reduced, statics } => self.static_state(reduced, statics),
            Event::ResponseBegins {
                reduced,
                frequencies_hz,
                compared_harmonics,
            } => self.response_begins(reduced, frequencies_hz, *compared_harmonics),
            Event::Response(run) => match &run.response {
                Some(found) => self.response(&run.reduced, found),
                None => Ok(()),
            },
            Event::Worn(course) => self.worn(course),
            Event::Peak {
                reduced,
                observation,
                peak,
            } => self.peak_found(reduced, *observation, peak),
            _ => Ok(()),
        }
    }

    /// Records a warning.
    pub fn warning(&mut self, warning: &Warning) {
        self.warnings.push(warning.clone());
    }

    fn static_state(&mut self, reduced: &Reduced, statics: &StaticResult) -> Result<(), RunError> {
        summary::of_statics(&mut self.summary, reduced, statics);
        if self.beginning == Beginning::Beside {
            return Ok(());
        }
        self.write_static_state(reduced, statics)?;
        if statics.usable().is_ok() {
            self.modes(reduced.natural_frequencies(Some(&statics.state), &[]))?;
        }
        match self.beginning {
            Beginning::Anew => Ok(self.out.remove_earlier()?),
            Beginning::Resumed | Beginning::Beside => Ok(()),
        }
    }

    fn response_begins(
        &mut self,
        reduced: &Reduced,
        frequencies_hz: &[f64],
        compared_harmonics: Option<usize>,
    ) -> Result<(), RunError> {
        let is_own = compared_harmonics.is_none();
        let bodies = reduced.bodies.as_ref().filter(|_| is_own && self.fields);
        self.solving.push(Solving {
            table: table_of(compared_harmonics),
            observed: reduced.observations(),
            pairs: reduced.pairs.clone(),
            frequencies_hz: frequencies_hz.to_vec(),
            solved: BTreeMap::new(),
            flanks: bodies.map(|bodies| FlankSeries::new(bodies.model())),
            listed: 0,
            written: (Instant::now(), Duration::ZERO),
        });
        Ok(())
    }

    /// Frequencies of the last response begun, with these inputs, that were solved before it was
    /// interrupted.
    fn solved(&mut self, inputs: &Inputs) -> Result<Vec<SolvedFrequency>, RunError> {
        let is_own = self.solving.len() == 1;
        if is_own && self.beginning == Beginning::Anew {
            self.journal.clear()?;
        }
        let earlier = self.journal.solved(inputs)?;
        if is_own && earlier.is_empty() && !self.journal.is_empty() {
            let path = self.out.path().join(JOURNAL);
            return Err(ExportError::OtherInputs { path }.into());
        }
        self.write_summary(RunState::Running, None)?;
        Ok(earlier)
    }

    fn frequency(&mut self, inputs: &Inputs, solved: &SolvedFrequency) -> Result<(), RunError> {
        let Some(solving) = self.solving.last_mut() else {
            return Ok(());
        };
        self.journal.append(inputs, solved)?;
        solving.add(&self.out, solved)?;
        let (last, took) = solving.written;
        if last.elapsed() > INTERVAL.max(SHARE * took) {
            let begin = Instant::now();
            self.write_tables()?;
            self.write_summary(RunState::Running, None)?;
            if let Some(solving) = self.solving.last_mut() {
                solving.written = (Instant::now(), begin.elapsed());
            }
        }
        Ok(())
    }

    fn response(&mut self, reduced: &Reduced, found: &ResponseResult) -> Result<(), RunError> {
        let response = &found.response;
        let observed = reduced.observations();
        let first = observed.first().map(|first| first.name.as_str());
        let of_response = manifest::response_summary(&reduced.pairs, first, response, self.along);
        self.summary.response = Some(ResponseSummary {
            traction_range: found.tractions.as_ref().and_then(manifest::traction_range),
            ..of_response
        });
        if let Some(truncation) = &mut self.summary.truncation {
            truncation.modes_reach = found.modes_reach;
        }
        let (out, along) = (&self.out, self.along);
        csv::write_response(&out.file(&table_of(None))?, &observed, response, along)?;
        if let Some(compared) = &found.compared {
            let file = table_of(Some(compared.harmonics));
            csv::write_response(&out.file(&file)?, &observed, &compared.response, along)?;
        }
        csv::write_contact(&out.file("contact.csv")?, &reduced.pairs, response)?;
        if let Some(range) = &found.tractions {
            csv::write_tractions(&out.file("tractions.csv")?, range)?;
        }
        self.write_curves(&observed, &sweep(found))?;
        if let Some(flanks) = self.solving.first_mut().and_then(|s| s.flanks.as_mut()) {
            flanks.keep_alone(out.path(), &response.orbits)?;
            flanks.write_collection(&out.file(FLANKS)?, &response.orbits)?;
        }
        if let Some(bodies) = found.bodies_at_peak(reduced.bodies.as_ref()) {
            self.write_response_on_mesh(bodies, &reduced.problem, found)?;
        }
        Ok(())
    }
}

/// Excitations of a reduced model, called by where they act.
fn named_excitations(scene: &Scene, reduced: &Reduced) -> Vec<NamedExcitation> {
    let specs = scene.assembly().map_or(&[][..], |a| &a.excitations);
    let name = |spec: &ExcitationSpec| match &spec.kind {
        ExcitationKind::Load(load) => load.on.clone(),
        ExcitationKind::Field { on, .. } => on.clone(),
        ExcitationKind::Base { .. } => "base".to_owned(),
    };
    let bound = reduced.bodies.as_ref().map(Bodies::model);
    let bound = bound.map_or(&[][..], |model| &model.excitations);
    let both = specs.iter().zip(bound);
    both.map(|(spec, excitation)| NamedExcitation::new(name(spec), excitation.in_time))
        .collect()
}

/// Returns `true` if gmsh makes the mesh of a scene.
pub(crate) fn makes_mesh(scene: &Scene) -> bool {
    let mesh = scene.assembly().and_then(|assembly| assembly.mesh.as_ref());
    mesh.is_some_and(|mesh| matches!(mesh.kind, MeshKind::Geometry { .. }))
}

/// File name of the collection of the flanks at each frequency.
const FLANKS: &str = "flank.pvd";

/// Name of the table of a response.
fn table_of(compared_harmonics: Option<usize>) -> String {
    match compared_harmonics {
        None => "response.csv".to_owned(),
        Some(harmonics) => format!("response_h{harmonics}.csv"),
    }
}

/// Response of a result and the one that it is compared with.
fn sweep(found: &ResponseResult) -> Sweep<'_> {
    Sweep {
        response: &found.response,
        compared: found.compared.as_ref().map(|compared| &compared.response),
        along: found.run_up.as_ref().map(|run_up| run_up.engine_order),
        tractions: found.tractions.as_ref(),
    }
}

#[cfg(test)]
mod tests;
