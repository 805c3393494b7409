//! Writes the files of a run as its events come, and collects the numbers of summary.json, which is
//! written for the last time when the run is done, fails or is interrupted.
//!
//! This folder decides which files a run has, by which names, and when they are written; a command
//! beside a run adds its own. [`crate::export`] knows how a file of each format is written. Each
//! file is asked for by name from the [`OutputFolder`], before it is written. `conditions` has the
//! words below the titles of pictures, `peaks` the pictures of `dovetail peaks`, `summary` the
//! content of summary.json.
//!
//! Threads that end a run early use its files too ([`SharedFiles`]). After each write the folder
//! must therefore be one that can be read, and resumed where frequencies are solved.

mod conditions;
mod peaks;
mod summary;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use self::conditions::{at_rest, in_motion};
pub use self::peaks::PeakLine;
pub use self::summary::Taken;
use crate::error::RunError;
use crate::exit::ExitStatus;
use crate::export::csv::PeakRow;
use crate::export::curves::{Curves, Sweep};
use crate::export::fields::Separation;
use crate::export::flank::FlankSeries;
pub use crate::export::folder::Beginning;
use crate::export::folder::{self, OtherScene, OutputFolder};
use crate::export::journal::{Inputs, JOURNAL, Journal};
use crate::export::manifest::{self, MeshOrigin, RunState, Summary};
use crate::export::plots::{
    CampbellFamily, EngineOrders, Heading, Operation, Scale, write_campbell, write_curves,
    write_field_map, write_no_field, write_separation_map,
};
use crate::export::{ExportError, create_folder, csv, fields, flank, report, vtu};
use crate::warning::{Warning, by_weight};
use crate::words::capital;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::branch::so_far;
use dovetail_solver::dlft::{Branch, LinearPoint, Orbit, Response, SolvedFrequency};
use dovetail_solver::fem::stress;
use dovetail_solver::model::MeshKind;
use dovetail_solver::reduction::superelement::{self, Superelement};
use dovetail_solver::results::modes::{ModeKind, NaturalFrequency};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::peak;
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::run::{
    Bodies, Campbell, Crossing, Event, ModalAnalysis, Reduced, ResponseResult, Run, StaticResult,
    Verification, Verified,
};

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
    /// Pictures in addition to those of every run.
    further_plots: Vec<FurtherPlot>,
    /// Conditions under the titles of pictures of the static state.
    at_rest: String,
    /// Conditions under the titles of pictures of the response.
    in_motion: String,
    begun: Instant,
    beginning: Beginning,
    journal: Journal,
    /// Responses that have begun, the scene's own first.
    solving: Vec<Solving>,
    /// Warnings so far.
    warnings: Vec<Warning>,
    /// Rows of modes.csv.
    rows: Vec<NaturalFrequency>,
    /// The 2H+1 nodal fields of each body at the peak, if fields are written.
    motion: Option<Vec<Vec<NodalField>>>,
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
        create_folder(&output.folder)?;
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
            further_plots: output.further_plots.clone(),
            at_rest: at_rest(scene),
            in_motion: in_motion(scene),
            begun: Instant::now(),
            beginning,
            journal,
            solving: Vec::new(),
            warnings: Vec::new(),
            rows: Vec::new(),
            motion: None,
        })
    }

    /// Draws the curves of each observation against frequency: amplitude, and the further pictures
    /// requested.
    fn write_curves(&self, names: &[&str], sweep: &Sweep<'_>) -> Result<(), RunError> {
        let further = |kind| self.further_plots.contains(&kind);
        let draw = |file: String, scale: Scale, curves: &Curves| -> Result<(), RunError> {
            let path = self.out.file(&format!("plots/{file}.svg"))?;
            let quantity = capital(&curves.quantity);
            let heading = Heading {
                title: &format!("{quantity}, scene {}", self.summary.scene.name),
                conditions: &self.in_motion,
            };
            Ok(write_curves(&path, heading, scale, curves)?)
        };
        for (i, name) in names.iter().enumerate() {
            let amplitude = sweep.amplitude(name, i);
            draw(format!("response_{name}"), Scale::Linear, &amplitude)?;
            if further(FurtherPlot::Logarithmic) {
                let file = format!("response_{name}_logarithmic");
                draw(file, Scale::Logarithmic, &amplitude)?;
            }
            if further(FurtherPlot::Phase) {
                draw(
                    format!("phase_{name}"),
                    Scale::Linear,
                    &sweep.phase(name, i),
                )?;
            }
        }
        Ok(())
    }

    /// Writes the maps of the flanks and, if fields are written, the fields on the flanks and the
    /// motion of the bodies at the peak. Returns this motion.
    fn write_response_on_mesh(
        &self,
        bodies: &Bodies,
        response: &Response,
    ) -> Result<Option<Vec<Vec<NodalField>>>, RunError> {
        let (out, conditions) = (&self.out, self.in_motion.as_str());
        let model = bodies.model();
        let at_peak = peak(response, 0).map(|peak| &response.orbits[peak.index]);
        if !model.pairs.is_empty() {
            let path = out.file("plots/separation.svg")?;
            let separation = Separation::of(response, model.pairs.len());
            write_separation_map(&path, model, conditions, &separation)?;
            if let Some(orbit) = at_peak {
                let [energy, slid, ..] = fields::at_peak(orbit, &model.pairs);
                for (file, field) in [("friction_energy", energy), ("slip", slid)] {
                    let title = capital(field.title);
                    let heading = Heading {
                        title: &format!("{title}, {:.3} Hz", orbit.frequency_hz),
                        conditions,
                    };
                    let path = out.file(&format!("plots/peak_{file}.svg"))?;
                    write_field_map(&path, model, heading, &field)?;
                }
            }
        }
        let Some(orbit) = at_peak.filter(|_| self.fields) else {
            return Ok(None);
        };
        let Some(motion) = bodies.motion_m(orbit) else {
            return Ok(None);
        };
        if !model.pairs.is_empty() {
            flank::write_flank_peak(&out.file("flank_peak.vtu")?, model, orbit, response)?;
        }
        vtu::write_motion(&out.file("peak.vtu")?, model, &motion)?;
        if let Some(frames) = self.frames {
            let (folder, hz) = (out.path(), orbit.frequency_hz);
            out.list(vtu::frame_files(frames))?;
            vtu::write_frames(folder, model, &motion, hz, frames)?;
        }
        Ok(Some(motion))
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
            vtu::write_modes(&self.out.file("modes.vtu")?, bodies.model(), &modes.shapes)?;
        }
        let own = modes.reduced.natural_frequencies(None, &modes.held_omega2);
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
        crossings: &[Crossing],
        diagram: (&[CampbellFamily], &EngineOrders, &Operation),
    ) -> Result<(), RunError> {
        csv::write_campbell(&self.out.file("modes_campbell.csv")?, &campbell.families)?;
        let path = self.out.file("modes_crossings.csv")?;
        csv::write_crossings(&path, campbell.operating_rpm, crossings)?;
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

    /// Writes peaks.csv and draws amplitude, frequency and loss factor of the peaks. `keys` are the
    /// key of the value of each line, if there is one, and the key of the values along it. Where
    /// there are several lines, the amplitudes are drawn as a map, too.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn peaks(&self, keys: &[&str], lines: &[PeakLine<'_>]) -> Result<(), RunError> {
        let rows: Vec<PeakRow<'_>> = lines.iter().flat_map(|line| line.rows.clone()).collect();
        csv::write_peaks(&self.out.file("peaks.csv")?, keys, &rows)?;
        peaks::draw(keys, lines, |file| {
            self.out.file(&format!("plots/{file}.svg"))
        })
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
        };
        Ok(report::write(&self.out.file(report::REPORT)?, &contents)?)
    }

    /// Writes the folder of `dovetail reduce`. Returns the law of its pairs if all have the same.
    ///
    /// # Errors
    /// A file that cannot be written, a model that the folder cannot represent.
    pub fn reduced_model(&self, reduced: &Reduced) -> Result<Option<PairLaw>, RunError> {
        let (problem, rows) = (&reduced.problem, &reduced.pairs.rows);
        let element = Superelement {
            model: problem.of_one_load()?,
            positions_m: rows.iter().map(|p| p.position_m).collect(),
            areas_m2: rows.iter().map(|p| p.area_m2).collect(),
        };
        self.out.list(superelement::FILES.map(str::to_owned))?;
        superelement::write(self.out.path(), &element)?;
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

    /// Writes summary.json of a run that failed before its last file. An error of writing is
    /// ignored, as the error of the run is the one to report.
    pub fn failed(&self, error: &dyn Error) {
        if !self.out.is_running() {
            return;
        }
        let _ = self.remove_empty_journal();
        let _ = self.write_summary(RunState::Failed, Some(told(error)));
    }

    /// Leaves the folder of a run that is interrupted by `signal` in a state that can be read and
    /// resumed. Returns the message for the user.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn interrupted(&mut self, signal: &str) -> Result<String, RunError> {
        let folder = self.out.path().display().to_string();
        let Some(solving) = self.solving.last() else {
            self.remove_empty_journal()?;
            let why = format!("{signal} before the first frequency");
            self.write_summary(RunState::Interrupted, Some(why.clone()))?;
            return Ok(format!(
                "ended by {why}; {folder} holds what was written until then"
            ));
        };
        let progress = format!(
            "{} of {} frequencies of {}",
            solving.solved.len(),
            solving.frequencies_hz.len(),
            solving.table
        );
        let own = &self.solving[0];
        let (partial, pairs) = (own.partial(), &own.pairs);
        csv::write_contact(&self.out.file("contact.csv")?, pairs, &partial)?;
        let first = own.names.first().map(String::as_str);
        self.summary.response = Some(manifest::response_summary(pairs, first, &partial));
        self.write_tables()?;
        let why = format!("{signal} after {progress}");
        self.write_summary(RunState::Interrupted, Some(why.clone()))?;
        Ok(format!(
            "ended by {why}; they are in {folder}. The same command with --resume goes on with the others"
        ))
    }

    /// Writes the tables of the responses under way, and all that is needed to resume.
    fn write_tables(&self) -> Result<(), RunError> {
        for solving in &self.solving {
            let names: Vec<&str> = solving.names.iter().map(String::as_str).collect();
            let partial = solving.partial();
            csv::write_response(&self.out.file(&solving.table)?, &names, &partial)?;
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

/// Response under way.
#[derive(Debug)]
struct Solving {
    inputs: Inputs,
    /// Name of its table.
    table: String,
    names: Vec<String>,
    pairs: PairTable,
    /// All requested frequencies, Hz.
    frequencies_hz: Vec<f64>,
    /// Solved frequencies by their numbers; the orbits have no fields.
    solved: BTreeMap<usize, SolvedFrequency>,
    /// Flanks of the scene's own response, if fields are written.
    flanks: Option<FlankSeries>,
    /// Number of the files of flanks that summary.json names, written or about to be.
    listed: usize,
    /// Time of the last update of the tables, and its duration.
    written: (Instant, Duration),
}

impl Solving {
    /// Solved part of the response, for tables.
    fn partial(&self) -> Response {
        let mut solved: Vec<SolvedFrequency> = self.solved.values().cloned().collect();
        if solved.iter().any(|solved| solved.along.is_some()) {
            return so_far(solved);
        }
        let frequency_hz = |solved: &SolvedFrequency| solved.orbit.frequency_hz;
        solved.sort_by(|a, b| frequency_hz(a).total_cmp(&frequency_hz(b)));
        let solved = solved.into_iter().map(|s| (s.orbit, s.linear));
        let (orbits, linear): (Vec<Orbit>, Vec<LinearPoint>) = solved.unzip();
        Response {
            branches: vec![Branch::swept(orbits.len())],
            orbits,
            linear,
            ..Response::default()
        }
    }

    /// Adds a frequency, and writes its file of the flanks.
    fn add(&mut self, out: &OutputFolder, solved: &SolvedFrequency) -> Result<(), RunError> {
        let orbit = &solved.orbit;
        let without_fields = Orbit {
            x: Vec::new(),
            lambda: Vec::new(),
            modal: Vec::new(),
            ..orbit.clone()
        };
        let point = SolvedFrequency {
            orbit: without_fields,
            linear: solved.linear.clone(),
            along: solved.along.clone(),
            ..*solved
        };
        self.solved.insert(orbit.point, point);
        if let Some(flanks) = &mut self.flanks {
            if orbit.point >= self.listed {
                let from = self.listed;
                self.listed = orbit.point + LISTED;
                out.list((from..self.listed).map(FlankSeries::file))?;
            }
            flanks.write(out.path(), orbit)?;
        }
        Ok(())
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
            Event::Frequency(solved) => self.frequency(solved),
            Event::Response(run) => match &run.response {
                Some(found) => self.response(&run.reduced, found),
                None => Ok(()),
            },
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

    fn write_static_state(
        &self,
        reduced: &Reduced,
        statics: &StaticResult,
    ) -> Result<(), RunError> {
        let (out, state) = (&self.out, &statics.state);
        csv::write_static(&out.file("static.csv")?, &reduced.pairs, state)?;
        let Some(bodies) = &reduced.bodies else {
            return Ok(());
        };
        let model = bodies.model();
        let opens = !model.pairs.is_empty();
        if opens {
            let path = out.file("plots/static_pressure.svg")?;
            let heading = |title| Heading {
                title,
                conditions: &self.at_rest,
            };
            match fields::at_rest(state, &model.pairs) {
                Some([pressure, _]) => {
                    write_field_map(&path, model, heading(&capital(pressure.title)), &pressure)?;
                }
                None => {
                    let outcome = state.outcome;
                    let title = format!("Static pressure: {outcome}, no result");
                    write_no_field(&path, heading(&title))?;
                }
            }
        }
        let Some(displacements) = statics.displacements_m.as_ref().filter(|_| self.fields) else {
            return Ok(());
        };
        if opens {
            flank::write_flank_static(&out.file("flank_static.vtu")?, model, state)?;
        }
        let fields: Vec<_> = model
            .bodies
            .iter()
            .zip(displacements)
            .map(|(body, displacement)| {
                let at_elements = stress::stress(body, displacement);
                let von_mises: Vec<f64> = stress::nodal_stress(body, displacement)
                    .into_iter()
                    .map(stress::von_mises)
                    .collect();
                (displacement, at_elements, von_mises)
            })
            .collect();
        let displacements: Vec<&[[f64; 3]]> = fields.iter().map(|f| &f.0[..]).collect();
        csv::write_static_observations(&out.file("static_observed.csv")?, model, &displacements)?;
        let fields = fields.iter();
        let fields = fields.map(|(displacement, stress, von_mises)| vtu::StaticBodyFields {
            displacement_m: displacement,
            stress_pa: stress,
            von_mises_pa: von_mises,
        });
        vtu::write_static(&out.file("static.vtu")?, model, &fields.collect::<Vec<_>>())?;
        Ok(())
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
            inputs: Inputs::default(),
            table: table_of(compared_harmonics),
            names: reduced
                .observations()
                .into_iter()
                .map(str::to_owned)
                .collect(),
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
    ///
    /// # Errors
    /// A journal of other inputs, or one that cannot be read; a file that cannot be written.
    pub fn solved(&mut self, inputs: Inputs) -> Result<Vec<SolvedFrequency>, RunError> {
        let is_own = self.solving.len() == 1;
        if is_own && self.beginning == Beginning::Anew {
            self.journal.clear()?;
        }
        let earlier = self.journal.solved(&inputs)?;
        if is_own && earlier.is_empty() && !self.journal.is_empty() {
            let path = self.out.path().join(JOURNAL);
            return Err(ExportError::OtherInputs { path }.into());
        }
        if let Some(solving) = self.solving.last_mut() {
            solving.inputs = inputs;
        }
        self.write_summary(RunState::Running, None)?;
        Ok(earlier)
    }

    fn frequency(&mut self, solved: &SolvedFrequency) -> Result<(), RunError> {
        let Some(solving) = self.solving.last_mut() else {
            return Ok(());
        };
        self.journal.append(&solving.inputs, solved)?;
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
        let first = reduced.observations().first().copied();
        let of_response = manifest::response_summary(&reduced.pairs, first, response);
        self.summary.response = Some(of_response);
        if let Some(truncation) = &mut self.summary.truncation {
            truncation.modes_reach = found.modes_reach;
        }
        let (out, names) = (&self.out, reduced.observations());
        csv::write_response(&out.file(&table_of(None))?, &names, response)?;
        if let Some(compared) = &found.compared {
            let file = table_of(Some(compared.harmonics));
            csv::write_response(&out.file(&file)?, &names, &compared.response)?;
        }
        csv::write_contact(&out.file("contact.csv")?, &reduced.pairs, response)?;
        self.write_curves(&names, &sweep(found))?;
        if let Some(flanks) = self.solving.first_mut().and_then(|s| s.flanks.as_mut()) {
            flanks.keep_alone(out.path(), &response.orbits)?;
            flanks.write_collection(&out.file(FLANKS)?, &response.orbits)?;
        }
        if let Some(bodies) = &reduced.bodies {
            self.motion = self.write_response_on_mesh(bodies, response)?;
        }
        Ok(())
    }
}

/// Returns `true` if gmsh makes the mesh of a scene.
fn makes_mesh(scene: &Scene) -> bool {
    let mesh = scene.assembly().and_then(|assembly| assembly.mesh.as_ref());
    mesh.is_some_and(|mesh| matches!(mesh.kind, MeshKind::Geometry { .. }))
}

/// Number of files of the flanks that are named in summary.json at once before they are written.
const LISTED: usize = 200;

/// File name of the collection of the flanks at each frequency.
const FLANKS: &str = "flank.pvd";

/// Name of the table of a response.
fn table_of(compared_harmonics: Option<usize>) -> String {
    match compared_harmonics {
        None => "response.csv".to_owned(),
        Some(harmonics) => format!("response_h{harmonics}.csv"),
    }
}

/// Longest time to wait for the files when the process ends for lack of memory.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// Files of a run that are also accessible to the code that ends the run early.
#[derive(Debug)]
pub struct SharedFiles {
    /// Folder of the run.
    folder: PathBuf,
    files: Mutex<Files>,
    /// True if the run is being ended: any thread that is not yet writing waits for the end of the
    /// process.
    ending: AtomicBool,
}

impl SharedFiles {
    /// Shares the files of one run.
    pub fn new(files: Files) -> Arc<Self> {
        Arc::new(Self {
            folder: files.folder().to_path_buf(),
            files: Mutex::new(files),
            ending: AtomicBool::new(false),
        })
    }

    /// Locks the files for the run. Does not return once the run is being ended.
    pub fn locked(&self) -> MutexGuard<'_, Files> {
        while self.ending.load(Ordering::Acquire) {
            std::thread::park_timeout(Duration::from_secs(1));
        }
        self.whole()
    }

    /// Locks the files for ending the run: nothing is written after what is written with this lock.
    pub fn locked_to_end(&self) -> MutexGuard<'_, Files> {
        self.ending.store(true, Ordering::Release);
        self.whole()
    }

    /// Records in the folder that the run failed, and prevents all further writing. The thread that
    /// has the files may itself wait for the end of the process: then the last summary.json is
    /// marked.
    pub fn failed_to_end(&self, error: &RunError) {
        self.ending.store(true, Ordering::Release);
        let begun = Instant::now();
        while begun.elapsed() < LONGEST_WAIT {
            if let Ok(files) = self.files.try_lock() {
                return files.failed(error);
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        folder::mark_failed(&self.folder, told(error));
    }

    /// Locks the files. A panic of another thread leaves them intact.
    fn whole(&self) -> MutexGuard<'_, Files> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Response of a result and the one that it is compared with.
fn sweep(found: &ResponseResult) -> Sweep<'_> {
    Sweep {
        response: &found.response,
        compared: found.compared.as_ref().map(|compared| &compared.response),
    }
}
