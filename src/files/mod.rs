//! Writes the files of a run as its events come, and collects the numbers of summary.json, which is
//! written for the last time when the run is done, fails or is interrupted.
//!
//! This folder decides which files a run has, by which names, and when they are written; a command
//! beside a run adds its own. [`dovetail_export`] knows how a file of each format is written. Each
//! file is asked for by name from the [`OutputFolder`], before it is written.
//!
//! A file of this folder writes the files of one kind of run: `modes`, `statics`, `response` with
//! `solving` (the tables of a response under way) and `drawn` (its pictures and fields), `backbone`,
//! `curve`, `peaks`, `wear`, `verification` and `reduced_model`. `search` has the motions that a
//! search keeps, `summary` the figures of summary.json, `conditions` the words below the titles of
//! pictures, and `ending` the files of a run that ends.
//!
//! Threads that end a run early use its files too (`shared`, [`SharedFiles`]). After each write the folder
//! must therefore be one that can be read, and resumed where frequencies are solved.

mod backbone;
mod conditions;
mod curve;
mod drawn;
mod ending;
mod modes;
mod peaks;
mod reduced_model;
mod response;
mod search;
mod shared;
mod solving;
mod statics;
mod summary;
mod verification;
mod wear;

use std::path::{Path, PathBuf};
use std::time::Instant;

pub use self::curve::CurveUnderWay;
pub use self::peaks::{PeakLine, PeaksFound};
use self::response::RunningResponses;
use self::search::SearchFiles;
pub use self::search::Sought;
pub use self::shared::SharedFiles;
pub use self::summary::RunTimes;
use self::summary::SummaryFigures;
use crate::error::RunError;
use dovetail_export::ExportError;
use dovetail_export::flank::WornFlanks;
use dovetail_export::folder::{Beginning, OtherScene, OutputFolder};
use dovetail_export::journal::{JOURNAL, Journal};
use dovetail_export::lock::FolderLock;
use dovetail_export::manifest::{MeshOrigin, Summary};
use dovetail_export::plots::{Axis, PictureHeading, Scale, Series, write_series};
use dovetail_export::warning::Warning;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::SolvedFrequency;
use dovetail_solver::model::MeshKind;
use dovetail_solver::run::{Event, RecordKey, ReducedScene};

/// Name of the mesh of a script in the folder of the results.
pub const MESH_FILE: &str = "mesh.msh";

/// Selection of the files that a run writes, and their folder.
#[derive(Debug, Clone)]
pub struct Output {
    pub folder: PathBuf,
    /// Path of the scene, for the record of what was run.
    pub scene_file: PathBuf,
    /// `KEY=VALUE` texts with which the scene was read.
    pub overrides: Vec<String>,
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

/// Writes the events of a run to files of one folder.
#[derive(Debug)]
pub struct RunFiles {
    scene: Scene,
    asked: Output,
    folder: RunFolder,
    figures: SummaryFigures,
    responses: RunningResponses,
    /// Search under way, of `dovetail peaks`, `dovetail curve` and `dovetail wear`.
    search: Option<SearchFiles>,
    /// Worn flanks, if fields are written.
    worn: Option<WornFlanks>,
}

/// Folder of a run, with the right to write into it.
#[derive(Debug)]
struct RunFolder {
    out: OutputFolder,
    beginning: Beginning,
    begun: Instant,
    _lock: FolderLock,
}

impl RunFiles {
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
        let lock = FolderLock::acquire(&output.folder)?;
        let figures = SummaryFigures::new(scene, &output.scene_file);
        let journal = Journal::open(&output.folder.join(JOURNAL))?;
        let (folder, to_resume) = (&output.folder, !journal.is_empty());
        let out = OutputFolder::open(folder, &figures.summary, other, beginning, to_resume)
            .inspect_err(|_| {
                let _ = journal.remove_if_empty();
            })?;
        let mesh = makes_mesh(scene).then_some(MESH_FILE);
        let listed = [Some(JOURNAL), mesh].into_iter().flatten();
        out.list(listed.map(str::to_owned))?;
        Ok(Self {
            scene: scene.clone(),
            asked: output.clone(),
            folder: RunFolder {
                out,
                beginning,
                begun: Instant::now(),
                _lock: lock,
            },
            figures,
            responses: RunningResponses {
                journal,
                solving: Vec::new(),
            },
            search: None,
            worn: None,
        })
    }

    /// Path of the folder.
    pub fn folder(&self) -> &Path {
        self.folder.out.path()
    }

    /// Figures so far.
    pub fn summary(&self) -> &Summary {
        &self.figures.summary
    }

    /// Place of a picture.
    fn picture(&self, name: &str) -> Result<PathBuf, ExportError> {
        self.folder.out.file(&format!("plots/{name}.svg"))
    }

    /// Draws series under a title and the conditions that hold for all of them.
    fn draw(
        &self,
        name: &str,
        [title, conditions]: [&str; 2],
        axes: &[Axis; 2],
        series: &[Series],
    ) -> Result<(), RunError> {
        let heading = PictureHeading { title, conditions };
        Ok(write_series(&self.picture(name)?, heading, axes, series)?)
    }

    /// Sets the origin of the mesh.
    pub fn set_mesh_origin(&mut self, origin: MeshOrigin) {
        self.figures.origin = origin;
    }

    /// Records a warning.
    pub fn warning(&mut self, warning: &Warning) {
        self.figures.warnings.push(warning.clone());
    }

    /// Writes the files for an event.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn handle_event(&mut self, event: &Event<'_>) -> Result<(), RunError> {
        match event {
            Event::Model { bound, .. } => {
                self.figures.add_bodies(bound);
                Ok(())
            }
            Event::Reduced(reduced) => self.reduced(reduced),
            Event::StaticState { reduced, statics } => self.static_state(reduced, statics),
            Event::ResponseBegins {
                reduced,
                frequencies_hz,
                compared_harmonics,
            } => {
                self.response_begins(reduced, frequencies_hz, *compared_harmonics);
                Ok(())
            }
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

    fn reduced(&mut self, reduced: &ReducedScene) -> Result<(), RunError> {
        self.figures.add_reduced_model(reduced);
        if let Some(Sought::Curve(curve)) = self.search.as_mut().map(|search| &mut search.sought) {
            curve.start(reduced)?;
        }
        if self.folder.beginning == Beginning::Beside {
            return Ok(());
        }
        self.modes(reduced.natural_frequencies(None, &[]))
    }

    /// Motions under this key that were kept before the run was interrupted.
    ///
    /// # Errors
    /// A journal of other inputs, or one that cannot be read; a file that cannot be written.
    pub fn records(&mut self, key: &RecordKey) -> Result<Vec<SolvedFrequency>, RunError> {
        match (key, &mut self.search) {
            (RecordKey::Response(inputs), _) => self.earlier_frequencies(inputs),
            (RecordKey::Search(inputs), Some(search)) => Ok(search.journal.solved(inputs)?),
            (RecordKey::Search(_), None) => Ok(Vec::new()),
        }
    }

    /// Keeps a motion, and writes what is asked for of it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn append(&mut self, key: &RecordKey, motion: &SolvedFrequency) -> Result<(), RunError> {
        match (key, &mut self.search) {
            (RecordKey::Response(inputs), _) => self.frequency(inputs, motion),
            (RecordKey::Search(inputs), Some(search)) => search.keep(inputs, motion),
            (RecordKey::Search(_), None) => Ok(()),
        }
    }
}

/// Axis that shows these values.
fn axis(title: String, unit: &'static str, values: impl IntoIterator<Item = f64>) -> Axis {
    Axis {
        title,
        unit,
        scale: Scale::fitting(values.into_iter()),
        marks: Vec::new(),
    }
}

/// Returns `true` if gmsh makes the mesh of a scene.
pub(crate) fn makes_mesh(scene: &Scene) -> bool {
    let mesh = scene.assembly().and_then(|assembly| assembly.mesh.as_ref());
    mesh.is_some_and(|mesh| matches!(mesh.kind, MeshKind::Geometry { .. }))
}

#[cfg(test)]
mod tests;
