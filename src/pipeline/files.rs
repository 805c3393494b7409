//! Writes the files of a run, and the figures that it tells at its end.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use faer::Mat;

use super::campbell::Campbell;
use super::conditions::{at_rest, in_motion};
use super::error::RunError;
use super::meshing::{self, MESH_FILE};
use super::observer::{Compared, Observer, ResponseBegins};
use super::progress::Progress;
use super::reduced::Reduced;
use super::{Context, FurtherPlot, ModalAnalysis, Run, hertz, solve, summary};
use crate::exit::ExitStatus;
use crate::export::flank::FlankSeries;
use crate::export::folder::{self, Beginning, OtherScene, OutputFolder};
use crate::export::journal::{Inputs, JOURNAL, Journal};
use crate::export::manifest::{self, RunState, Summary, WarningSummary};
use crate::export::plots::{
    self, Heading, Ordinate, Scale, linear_curve, phase_curve, response_curve, write_campbell,
    write_friction_energy_map, write_separation_map, write_slip_map, write_static_pressure_map,
};
use crate::export::{ExportError, create_folder, csv, flank, report, vtu};
use crate::stage::Stage;
use crate::warning::{Warning, by_weight};
use crate::words::counted;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::{LinearPoint, Orbit, Response, SolvedFrequency, StaticState};
use dovetail_solver::fem::{expand_to_nodes, stress};
use dovetail_solver::integration::compare::Comparison;
use dovetail_solver::model::Model;
use dovetail_solver::reduction::Recovery;
use dovetail_solver::reduction::superelement::{self, Superelement};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::peak;
use dovetail_solver::results::recovery::NodalField;

/// Between two writings of the tables of a response under way; no more than a part in so many of the time goes
/// into them.
const INTERVAL: Duration = Duration::from_secs(5);
const SHARE: u32 = 20;

/// An observer that keeps what it hears in files of one folder.
#[derive(Debug)]
pub struct Files {
    out: OutputFolder,
    /// The figures so far: all that a run which fails has to tell.
    summary: Summary,
    /// Whether fields for ParaView are written.
    fields: bool,
    /// Frames of the motion at the peak, where they are asked for.
    frames: Option<usize>,
    /// Pictures beyond those of every run.
    further_plots: Vec<FurtherPlot>,
    /// Under the titles of pictures of the static state, and of those of the response.
    at_rest: String,
    in_motion: String,
    /// The most frequencies that are added at peaks.
    most_added: usize,
    begun: Instant,
    beginning: Beginning,
    journal: Journal,
    /// The responses that have begun, the scene's own first.
    solving: Vec<Solving>,
    /// What there was to mind.
    warnings: Vec<Warning>,
    /// Rows of modes.csv.
    rows: Vec<csv::ModeRow>,
    /// At the peak, of each body, where fields are written.
    motion: Option<Vec<Vec<NodalField>>>,
}

impl Files {
    /// Takes the folder of the context for a run of the scene.
    ///
    /// # Errors
    /// A folder that cannot be written, that holds the run of another scene, or in which a run is going on.
    pub fn open(
        scene: &Scene,
        context: &Context,
        other: OtherScene,
        beginning: Beginning,
    ) -> Result<Self, RunError> {
        create_folder(&context.out)?;
        let summary = summary::beginning(scene, context);
        let journal = Journal::open(&context.out.join(JOURNAL))?;
        let to_resume = !journal.is_empty();
        let out = OutputFolder::open(&context.out, &summary, other, beginning, to_resume)
            .inspect_err(|_| {
                if journal.is_empty() {
                    let _ = journal.remove();
                }
            })?;
        let mesh = meshing::makes_mesh(scene).then_some(MESH_FILE);
        out.list(
            [Some(JOURNAL), mesh]
                .into_iter()
                .flatten()
                .map(str::to_owned),
        )?;
        Ok(Self {
            out,
            summary,
            fields: context.fields,
            frames: context.frames,
            further_plots: context.further_plots.clone(),
            at_rest: at_rest(scene),
            in_motion: in_motion(scene),
            most_added: scene.response.most_added_points,
            begun: Instant::now(),
            beginning,
            journal,
            solving: Vec::new(),
            warnings: Vec::new(),
            rows: Vec::new(),
            motion: None,
        })
    }

    /// Against frequency, per observation: amplitude, and what else is asked for.
    fn write_curves(
        &self,
        names: &[&str],
        response: &Response,
        compared: Option<&Compared>,
    ) -> Result<(), RunError> {
        let of = |response| (harmonics_label(response), response);
        let (compared, own) = (compared.map(|c| of(&c.response)), of(response));
        let further = |kind| self.further_plots.contains(&kind);
        for (i, name) in names.iter().enumerate() {
            let with = |of: &dyn Fn(&str, &Response) -> plots::Curve| -> Vec<plots::Curve> {
                let compared = compared.iter();
                let compared = compared.map(|(label, r)| of(label, r).to_compare());
                compared.chain([of(&own.0, own.1)]).collect()
            };
            let mut amplitudes = vec![linear_curve("linear", response, i)];
            amplitudes.extend(with(&|label, r| response_curve(label, r, i)));
            let draw = |file: String, ordinate: Ordinate<'_>, curves: &[plots::Curve]| {
                let path = self.out.file(&format!("plots/{file}.svg"))?;
                let heading = Heading {
                    title: &format!("{}, scene {}", ordinate.title(), self.summary.scene.name),
                    conditions: &self.in_motion,
                };
                plots::write_curves(&path, heading, ordinate, curves)
            };
            let linear = Ordinate::Amplitude(name, Scale::Linear);
            draw(format!("response_{name}"), linear, &amplitudes)?;
            if further(FurtherPlot::Logarithmic) {
                let logarithmic = Ordinate::Amplitude(name, Scale::Logarithmic);
                draw(
                    format!("response_{name}_logarithmic"),
                    logarithmic,
                    &amplitudes,
                )?;
            }
            if further(FurtherPlot::Phase) {
                let phases = with(&|label, r| phase_curve(label, r, i));
                draw(format!("phase_{name}"), Ordinate::Phase(name), &phases)?;
            }
        }
        Ok(())
    }

    /// Maps of the flanks; with `recovery` the fields on them and the motion of the bodies at the peak, which it gives.
    fn write_response_on_mesh(
        &self,
        model: &Model,
        recovery: Option<&Recovery>,
        response: &Response,
    ) -> Result<Option<Vec<Vec<NodalField>>>, RunError> {
        let (out, conditions) = (&self.out, self.in_motion.as_str());
        let at_peak = peak(response, 0).map(|peak| &response.orbits[peak.index]);
        if !model.pairs.is_empty() {
            let path = out.file("plots/separation.svg")?;
            write_separation_map(&path, conditions, model, response)?;
            if let Some(orbit) = at_peak {
                let path = out.file("plots/peak_friction_energy.svg")?;
                write_friction_energy_map(&path, conditions, model, orbit, "the peak")?;
                let path = out.file("plots/peak_slip.svg")?;
                write_slip_map(&path, conditions, model, orbit, "the peak")?;
            }
        }
        let (Some(recovery), Some(orbit)) = (recovery, at_peak) else {
            return Ok(None);
        };
        if !model.pairs.is_empty() {
            flank::write_flank_peak(&out.file("flank_peak.vtu")?, model, orbit, response)?;
        }
        let motion = motion(model, recovery, orbit);
        vtu::write_motion(&out.file("peak.vtu")?, model, &motion)?;
        if let Some(frames) = self.frames {
            let (folder, hz) = (out.path(), orbit.frequency_hz);
            out.list(vtu::frame_files("peak", frames))?;
            vtu::write_frames(folder, "peak", model, &motion, hz, frames)?;
        }
        Ok(Some(motion))
    }

    /// The way back to the bodies, where fields are written.
    fn recovery<'r>(&self, reduced: &'r Reduced) -> Option<&'r Recovery> {
        reduced.meshed().filter(|_| self.fields)?.recovery()
    }

    /// modes.csv.
    ///
    /// # Errors
    /// A file that cannot be written.
    fn modes(&mut self, rows: Vec<csv::ModeRow>) -> Result<(), RunError> {
        csv::write_modes(&self.out.file("modes.csv")?, &rows)?;
        self.rows = rows;
        Ok(())
    }

    /// modes.csv, and modes.vtu of an assembly that is meshed. Beside a run the modes about its
    /// static state stay.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn modal_analysis(&mut self, modes: &ModalAnalysis) -> Result<(), RunError> {
        if let Some(meshed) = modes.reduced.meshed() {
            vtu::write_modes(&self.out.file("modes.vtu")?, &meshed.model, &modes.shapes)?;
        }
        let mut rows = modes.rows.clone();
        if self.out.is_beside_run() {
            let earlier = csv::read_modes(&self.out.file("modes.csv")?);
            rows.extend(earlier.into_iter().filter(|row| row.kind == LINEAR));
        }
        self.modes(rows)
    }

    /// modes_campbell.csv, modes_crossings.csv and plots/campbell.svg.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn campbell(&self, campbell: &Campbell) -> Result<(), RunError> {
        csv::write_campbell(&self.out.file("modes_campbell.csv")?, &campbell.rows())?;
        let path = self.out.file("modes_crossings.csv")?;
        csv::write_crossings(&path, campbell.operating_rpm, &campbell.crossings())?;
        let heading = Heading {
            title: &format!("{}: natural frequencies", self.summary.scene.name),
            conditions: &match campbell.operating_rpm > 0.0 {
                true => format!("operation at {:.0} rpm", campbell.operating_rpm),
                false => String::new(),
            },
        };
        let path = self.out.file("plots/campbell.svg")?;
        Ok(write_campbell(
            &path,
            heading,
            &campbell.curves(),
            &campbell.drawn_orders(),
            &campbell.operation(),
        )?)
    }

    /// verify.csv.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn verification(&self, comparisons: &[Comparison]) -> Result<(), RunError> {
        Ok(csv::write_verification(
            &self.out.file("verify.csv")?,
            comparisons,
        )?)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.out.path()
    }

    /// summary.json of a run that came to its end: it failed where the verdict says that there is no result.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(
        &mut self,
        summary: &Summary,
        verdict: &Result<(), RunError>,
    ) -> Result<(), RunError> {
        if self.beginning != Beginning::Anew {
            self.out.remove_earlier()?;
        }
        // What was solved stands in the tables.
        if !self.solving.is_empty() {
            self.journal.clear()?;
        }
        self.remove_empty_journal()?;
        let (state, why) = ended(verdict);
        let summary = self.with_its_origin(summary.clone());
        Ok(self.out.write_summary(summary, state, why)?)
    }

    /// Of this run, with what there was to mind.
    fn with_its_origin(&self, summary: Summary) -> Summary {
        let own = &self.summary;
        let warnings = by_weight(&self.warnings).into_iter();
        Summary {
            scene: own.scene.clone(),
            commit: own.commit.clone(),
            program_blake3: own.program_blake3.clone(),
            begun: own.begun.clone(),
            warnings: warnings.map(WarningSummary::of).collect(),
            ..summary
        }
    }

    /// report.html of a run with this verdict.
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
            ..self.with_its_origin(run.summary.clone())
        };
        let compared = run.compared.as_ref();
        let compared = compared.map(|c| (harmonics_label(&c.response), &c.response));
        let contents = report::Contents {
            scene,
            summary: &summary,
            conditions: &self.in_motion,
            observations: &run.reduced.observations(),
            pairs: &run.reduced.pairs,
            model: run.reduced.meshed().map(|meshed| &meshed.model),
            modes: &self.rows,
            static_state: Some(&run.static_state),
            sweep: run.response.as_ref().map(|response| report::Sweep {
                response,
                label: harmonics_label(response),
                compared: compared.as_ref().map(|(label, r)| (label.as_str(), *r)),
            }),
            motion: self.motion.as_deref(),
        };
        Ok(report::write(&self.out.file(report::REPORT)?, &contents)?)
    }

    /// The folder of `dovetail reduce`; the law of its pairs, where they all have the same.
    ///
    /// # Errors
    /// A file that cannot be written, a model that the folder cannot hold.
    pub fn reduced_model(
        &self,
        reduced: &Reduced,
        progress: &Progress,
    ) -> Result<Option<PairLaw>, RunError> {
        let _stage = progress.stage(Stage::ReducedModelFiles);
        let (problem, rows) = (reduced.problem(), &reduced.pairs.rows);
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

    /// The journal, where it holds nothing to go on from.
    fn remove_empty_journal(&self) -> Result<(), RunError> {
        if self.journal.is_empty() {
            self.journal.remove()?;
        }
        Ok(())
    }

    /// summary.json of a run that failed before its last file. Where it cannot be written, the error of the run is the one
    /// to report.
    pub fn failed(&self, error: &dyn Error) {
        if !self.out.is_running() {
            return;
        }
        let _ = self.remove_empty_journal();
        let _ = self.write_summary(RunState::Failed, Some(told(error)));
    }

    /// Leaves the folder of a run that is broken off by `signal` so that it can be read and gone on with. Gives what
    /// there is to say.
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

    /// The tables of the responses under way, and what is needed to go on.
    fn write_tables(&self) -> Result<(), RunError> {
        for solving in &self.solving {
            let names: Vec<&str> = solving.names.iter().map(String::as_str).collect();
            csv::write_response(&self.out.file(&solving.table)?, &names, &solving.partial())?;
            if let Some(flanks) = &solving.flanks {
                let rows = solving.solved.len();
                flanks.write_collection(&self.out.file(FLANKS)?, rows)?;
            }
        }
        Ok(self.journal.sync()?)
    }

    /// With the figures so far.
    fn write_summary(&self, state: RunState, why: Option<String>) -> Result<(), RunError> {
        let mut summary = self.with_its_origin(self.summary.clone());
        summary.seconds = self.begun.elapsed().as_secs_f64();
        Ok(self.out.write_summary(summary, state, why)?)
    }
}

/// A response under way.
#[derive(Debug)]
struct Solving {
    inputs: Inputs,
    /// Name of its table.
    table: String,
    names: Vec<String>,
    pairs: PairTable,
    /// All that were asked for.
    frequencies_hz: Vec<f64>,
    /// Without the fields of the orbits, by the bits of their frequencies: rising.
    solved: BTreeMap<u64, (Orbit, LinearPoint)>,
    /// Of the scene's own response, where fields are written.
    flanks: Option<FlankSeries>,
    /// When the tables were written last, and how long that took.
    written: (Instant, Duration),
}

impl Solving {
    /// What there is of the response, for tables.
    fn partial(&self) -> Response {
        let (orbits, linear) = self.solved.values().cloned().unzip();
        Response {
            orbits,
            linear,
            linear_curve: Vec::new(),
            asked: self.frequencies_hz.len(),
            second_motions: Vec::new(),
            slip_threshold_m: 0.0,
        }
    }

    /// One frequency more: its file of the flanks is written.
    fn add(&mut self, out: &OutputFolder, solved: &SolvedFrequency) -> Result<(), RunError> {
        let SolvedFrequency { orbit, linear, .. } = solved;
        let without_fields = Orbit {
            x: Vec::new(),
            lambda: Vec::new(),
            modal: Vec::new(),
            ..orbit.clone()
        };
        let bits = orbit.frequency_hz.to_bits();
        self.solved.insert(bits, (without_fields, linear.clone()));
        if let Some(flanks) = &mut self.flanks {
            flanks.write(out.path(), orbit)?;
        }
        Ok(())
    }
}

/// How a run with this verdict ended, and why it failed.
fn ended(verdict: &Result<(), RunError>) -> (RunState, Option<String>) {
    match verdict {
        Err(error) if error.exit_status() == ExitStatus::Failed => {
            (RunState::Failed, Some(told(error)))
        }
        _ => (RunState::Finished, None),
    }
}

/// An error with its causes.
fn told(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text += &format!(": {error}");
        cause = error.source();
    }
    text
}

impl Observer for Files {
    /// modes.csv.
    fn reduced(&mut self, reduced: &Reduced) -> Result<(), RunError> {
        self.modes(mode_rows(reduced, None, &[]))
    }

    fn static_state(&mut self, reduced: &Reduced, state: &StaticState) -> Result<(), RunError> {
        let with_fields = self.fields && state.outcome.is_converged();
        write_static_state(&self.out, &self.at_rest, reduced, with_fields, state)?;
        if solve::usable(reduced, state).is_ok() {
            self.modes(mode_rows(reduced, Some(state), &[]))?;
        }
        match self.beginning {
            Beginning::Anew => Ok(self.out.remove_earlier()?),
            Beginning::Resumed | Beginning::Beside => Ok(()),
        }
    }

    fn warning(&mut self, warning: &Warning) {
        self.warnings.push(warning.clone());
    }

    fn figures(&mut self, summary: &Summary) {
        self.summary = self.with_its_origin(summary.clone());
    }

    fn response_begins(
        &mut self,
        begins: &ResponseBegins<'_>,
    ) -> Result<Vec<SolvedFrequency>, RunError> {
        let reduced = begins.reduced;
        let is_own = begins.compared_harmonics.is_none();
        if is_own && self.beginning == Beginning::Anew {
            self.journal.clear()?;
        }
        let earlier = self.journal.solved(&begins.inputs)?;
        if is_own && earlier.is_empty() && !self.journal.is_empty() {
            let path = self.out.path().join(JOURNAL);
            return Err(ExportError::OtherInputs { path }.into());
        }
        let meshed = reduced.meshed().filter(|_| is_own && self.fields);
        if meshed.is_some() {
            let most = begins.frequencies_hz.len() + self.most_added;
            self.out.list((0..most).map(FlankSeries::file))?;
        }
        self.solving.push(Solving {
            inputs: begins.inputs,
            table: table_of(begins.compared_harmonics),
            names: reduced
                .observations()
                .into_iter()
                .map(str::to_owned)
                .collect(),
            pairs: reduced.pairs.clone(),
            frequencies_hz: begins.frequencies_hz.to_vec(),
            solved: BTreeMap::new(),
            flanks: meshed.map(|meshed| FlankSeries::new(&meshed.model)),
            written: (Instant::now(), Duration::ZERO),
        });
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

    fn response(
        &mut self,
        reduced: &Reduced,
        response: &Response,
        compared: Option<&Compared>,
    ) -> Result<(), RunError> {
        let (out, names) = (&self.out, reduced.observations());
        csv::write_response(&out.file(&table_of(None))?, &names, response)?;
        if let Some(Compared {
            harmonics,
            response,
        }) = compared
        {
            let file = table_of(Some(*harmonics));
            csv::write_response(&out.file(&file)?, &names, response)?;
        }
        csv::write_contact(&out.file("contact.csv")?, &reduced.pairs, response)?;
        self.write_curves(&names, response, compared)?;
        if let Some(flanks) = self.solving.first_mut().and_then(|s| s.flanks.as_mut()) {
            // Some frequencies were solved in a second attempt.
            for orbit in &response.orbits {
                flanks.write(out.path(), orbit)?;
            }
            flanks.write_collection(&out.file(FLANKS)?, response.orbits.len())?;
        }
        if let Some(meshed) = reduced.meshed() {
            let recovery = self.recovery(reduced);
            self.motion = self.write_response_on_mesh(&meshed.model, recovery, response)?;
        }
        Ok(())
    }

    /// modes.csv once more, with the modes of the bodies.
    fn held_modes(
        &mut self,
        reduced: &Reduced,
        state: &StaticState,
        omega2: &[Vec<f64>],
    ) -> Result<(), RunError> {
        self.modes(mode_rows(reduced, Some(state), omega2))
    }
}

/// Kind of the modes about the static state in modes.csv.
const LINEAR: &str = "linear";
/// The collection of the flanks at each frequency.
const FLANKS: &str = "flank.pvd";

/// Name of the table of a response.
fn table_of(compared_harmonics: Option<usize>) -> String {
    match compared_harmonics {
        None => "response.csv".to_owned(),
        Some(harmonics) => format!("response_h{harmonics}.csv"),
    }
}

/// How long who ends a run for want of memory waits for its files.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// Files that more than the run reaches: what ends the run early, too.
#[derive(Debug)]
pub struct SharedFiles {
    /// Of the run.
    folder: PathBuf,
    files: Mutex<Files>,
    /// The run is being ended: whoever is not writing yet waits for the end of the process.
    ending: AtomicBool,
}

impl SharedFiles {
    /// Those of one run.
    pub fn new(files: Files) -> Arc<Self> {
        Arc::new(Self {
            folder: files.folder().to_path_buf(),
            files: Mutex::new(files),
            ending: AtomicBool::new(false),
        })
    }

    /// For the run. Does not return once the run is being ended.
    pub fn locked(&self) -> MutexGuard<'_, Files> {
        while self.ending.load(Ordering::Acquire) {
            std::thread::park_timeout(Duration::from_secs(1));
        }
        self.whole()
    }

    /// For who ends the run: nothing is written after what is written with this.
    pub fn locked_to_end(&self) -> MutexGuard<'_, Files> {
        self.ending.store(true, Ordering::Release);
        self.whole()
    }

    /// Says in the folder that the run failed, and lets nothing more be written. Whoever has the files may wait for the
    /// end of the process itself: what summary.json said last is then marked.
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

    /// A panic of another thread leaves what is written whole.
    fn whole(&self) -> MutexGuard<'_, Files> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Arc<SharedFiles> {
    fn reduced(&mut self, reduced: &Reduced) -> Result<(), RunError> {
        self.locked().reduced(reduced)
    }
    fn static_state(&mut self, reduced: &Reduced, state: &StaticState) -> Result<(), RunError> {
        self.locked().static_state(reduced, state)
    }
    fn warning(&mut self, warning: &Warning) {
        self.locked().warning(warning);
    }
    fn figures(&mut self, summary: &Summary) {
        self.locked().figures(summary);
    }
    fn response_begins(
        &mut self,
        begins: &ResponseBegins<'_>,
    ) -> Result<Vec<SolvedFrequency>, RunError> {
        self.locked().response_begins(begins)
    }
    fn frequency(&mut self, solved: &SolvedFrequency) -> Result<(), RunError> {
        self.locked().frequency(solved)
    }
    fn response(
        &mut self,
        reduced: &Reduced,
        response: &Response,
        compared: Option<&Compared>,
    ) -> Result<(), RunError> {
        self.locked().response(reduced, response, compared)
    }
    fn held_modes(
        &mut self,
        reduced: &Reduced,
        state: &StaticState,
        omega2: &[Vec<f64>],
    ) -> Result<(), RunError> {
        self.locked().held_modes(reduced, state, omega2)
    }
}

/// Rows of modes.csv; with a static state the linear modes about it; `held` are squared frequencies per body with the
/// contacts held.
pub(super) fn mode_rows(
    reduced: &Reduced,
    state: Option<&StaticState>,
    held: &[Vec<f64>],
) -> Vec<csv::ModeRow> {
    let mut rows = Vec::new();
    let mut add = |kind: &str, body: &str, omega2: &[f64]| {
        for (i, w2) in omega2.iter().enumerate() {
            rows.push(csv::ModeRow {
                kind: kind.to_string(),
                body: body.to_string(),
                mode: i + 1,
                frequency_hz: hertz(*w2),
            });
        }
    };
    if let Some(meshed) = reduced.meshed() {
        let bodies = &meshed.model.bodies;
        for (body, omega2) in bodies.iter().zip(held) {
            add("flanks_held", &body.name, omega2);
        }
        for (body, omega2) in bodies.iter().zip(&meshed.modes.fixed_interface_omega2) {
            add("fixed_interface", &body.name, omega2);
        }
    }
    add("stuck", "assembly", reduced.model().stuck_omega2());
    if let Some(state) = state {
        add(LINEAR, "assembly", reduced.linear_omega2(state));
    }
    rows
}

fn write_static_state(
    out: &OutputFolder,
    conditions: &str,
    reduced: &Reduced,
    with_fields: bool,
    state: &StaticState,
) -> Result<(), RunError> {
    csv::write_static(&out.file("static.csv")?, &reduced.pairs, state)?;
    let Some(meshed) = reduced.meshed() else {
        return Ok(());
    };
    let model = &meshed.model;
    let opens = !model.pairs.is_empty();
    if opens {
        let path = out.file("plots/static_pressure.svg")?;
        write_static_pressure_map(&path, conditions, model, state)?;
    }
    let displacements = meshed.static_displacements_m(state);
    let Some(displacements) = displacements.filter(|_| with_fields) else {
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
            let at_elements = stress::stress(body, &displacement);
            let von_mises: Vec<f64> = stress::nodal_stress(body, &displacement)
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

/// `with 3 harmonics`, or `with 1 to 7 harmonics` where the frequencies chose their own.
fn harmonics_label(response: &Response) -> String {
    let harmonics = || response.orbits.iter().map(|o| o.harmonics);
    let (least, most) = (harmonics().min(), harmonics().max());
    match (least.unwrap_or(0), most.unwrap_or(0)) {
        (least, most) if least == most => {
            format!("with {}", counted(most, "harmonic", "harmonics"))
        }
        (least, most) => format!("with {least} to {most} harmonics"),
    }
}

/// The 2H+1 nodal fields of each body in an orbit.
fn motion(model: &Model, recovery: &Recovery, orbit: &Orbit) -> Vec<Vec<NodalField>> {
    let blocks = 2 * orbit.harmonics + 1;
    let columns = |v: &[f64]| {
        let rows = v.len() / blocks;
        Mat::from_fn(rows, blocks, |i, j| v[j * rows + i])
    };
    let motion = recovery.full_motion(columns(&orbit.x).as_ref(), columns(&orbit.modal).as_ref());
    // The mean: what the static load does to the interior is not in the modes.
    let n = orbit.x.len() / blocks;
    let mean = recovery.full_static(&orbit.x[..n]);
    let bodies = model.bodies.iter().zip(motion.iter().zip(&mean));
    bodies
        .map(|(body, (motion, mean))| {
            let harmonic = (1..blocks).map(|j| expand_to_nodes(&body.dofs, motion.col_as_slice(j)));
            std::iter::once(expand_to_nodes(&body.dofs, mean))
                .chain(harmonic)
                .collect()
        })
        .collect()
}
