//! Defines the words of the command line, and what each of them asks for.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use clap_complete::Shell;

use super::error::Error;
use super::new::Template;
use crate::commands::{
    AMPLITUDES, AmplitudeRange, AskedBackbone, AskedCurve, AskedWear, KeyRange, MOST_AMPLITUDES,
    PeakQuestion, SpeedRange, TOLERANCE, TOLERANCES,
};
use crate::console::Verbosity;
use crate::files::FurtherPlot;
use crate::study::{Action, StudyOptions};
use dovetail_cache::{CacheSettings, gibibytes};
use dovetail_solver::integration::steady::MOST_PERIODS;
use dovetail_solver::integration::step::{LEAST_STEPS, MOST_STEPS};
use dovetail_solver::run::{ModeChoice, Verification};

const EXIT_CODES: &str = "\
Exit codes:
  0  done
  3  done, but some frequencies or cases did not converge, or a peak is unstable
  1  a computation failed, or a file could not be read or written
  2  the command line, the scene or its mesh is wrong
  130  ended by Ctrl-C or SIGTERM; run, peaks, curve, wear go on with --resume";

const RUN_HELP: &str = "\
Keys of the scene are set with --set KEY=VALUE, as if the file said so:
  KEY is a dotted path; elements of a list are meant by name, by number from 0,
  or all by *. VALUE is TOML, or else a text; paths count from the folder of the
  scene. KEY= removes the key. Of keys that exclude each other, such as
  response.frequency_hz and response.times_first_linear_mode, the one set
  replaces the file's. May be repeated; the last wins.

Example:
  dovetail run scene.toml --set 'contact.*.friction=0.1' --out output/smooth";

const PEAKS_HELP: &str = "\
The whole curve is solved for at the first value and at the last. Between them
each peak is found near the last ones, with a few solutions. The least peak over
the first key is found where it lies inside of the range.

Examples:
  dovetail peaks scene.toml --over 'excitation.*.force_n=0.1:20'
  dovetail peaks scene.toml --over 'contact.*.friction=0.01:1' \\
      --over 'excitation.*.force_n=0.5:20:5'
  dovetail peaks scene.toml --over rotation.speed_rpm=2000:8000 --amplitude 1e-3";

const CURVE_HELP: &str = "\
All motions at one frequency, from the first value to the last and back, round
folds: between two folds they are unstable. Points are solved where the curve
bends, and at each of the N values. A key that changes the bodies, such as the
speed, takes a reduction for each value that is tried.

Examples:
  dovetail curve scene.toml --over 'excitation.*.force_n=0.1:20' --frequency 450
  dovetail curve scene.toml --over 'contact.*.gap_m=0:1e-4' --frequency 450";

const BACKBONE_HELP: &str = "\
No force excites the motion: a damping ratio keeps it up, which is that of the
mode at this amplitude. The force of the scene only says which force has its
peak at an amplitude, and its range of frequencies how many stuck modes to take.

Example:
  dovetail backbone scene.toml --mode 1 --amplitude 1e-6:1e-3 --points 30";

const WEAR_HELP: &str = "\
A [[contact]] wears that has a coefficient `wear_m2_n`. Its worn depth opens its
clearance (Archard). Without --at-frequency all [[mission]] of the scene wear it
in turn, or the peak alone where the scene has none.

Examples:
  dovetail wear scene.toml --cycles 1e8
  dovetail wear scene.toml --cycles 1e6,1e7,1e8 --at-frequency 420";

/// Vibration of parts in contact: friction, lift-off, dissipation
#[derive(Debug, Parser)]
#[command(name = "dovetail", version = crate::version::WITH_COMMIT, after_help = EXIT_CODES)]
#[command(subcommand_required = true, arg_required_else_help = true)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Command,

    #[command(flatten)]
    pub(super) shared: Shared,
}

impl Cli {
    /// Keys of the scene that the command line sets, as `KEY=VALUE`.
    pub(super) fn overrides(&self) -> &[String] {
        &self.shared.overrides
    }
}

/// The options of all commands about a scene or a study.
#[derive(Debug, Args)]
#[command(next_help_heading = "Options of all commands about scenes and studies")]
pub(super) struct Shared {
    /// Folder for the results [default: output/<name>]
    #[arg(long, value_name = "DIR", global = true, value_hint = ValueHint::DirPath)]
    pub(super) out: Option<PathBuf>,

    /// Replace the files of another scene's run there
    #[arg(long, global = true)]
    pub(super) force: bool,

    /// Set a key of the scene (see dovetail help run)
    #[arg(long = "set", value_name = "KEY=VALUE", global = true)]
    pub(super) overrides: Vec<String>,

    /// Threads [default: all cores; at most 4 a core]
    #[arg(long, value_name = "N", global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,

    /// Folder of the cache [default: output/.cache]
    #[arg(long, value_name = "DIR", global = true, value_hint = ValueHint::DirPath)]
    pub(super) cache: Option<PathBuf>,

    /// Most that is kept there, 0 for none [default: 4]
    #[arg(long, value_name = "GIB", global = true, value_parser = gibibytes)]
    pub(super) cache_limit_gib: Option<f64>,

    /// Keep nothing there, and take nothing from there
    #[arg(long, global = true, conflicts_with_all = ["cache", "cache_limit_gib"])]
    pub(super) no_cache: bool,

    /// One line of results, warnings and errors only
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,

    /// Every frequency, what is tried and the residuals
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub(super) verbose: bool,
}

impl Shared {
    pub(super) fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (false, true) => Verbosity::Verbose,
            (false, false) => Verbosity::Normal,
        }
    }
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Write a scene with its geometry to begin with
    #[command(after_help = "Example:\n  dovetail new my_blade --template fir-tree")]
    New(New),
    #[command(flatten)]
    Scene(SceneCommand),
    /// List the groups and materials of a mesh file, for a scene to name
    #[command(after_help = "Example:\n  dovetail groups my_part.inp")]
    Groups(MeshFile),
    /// Run a scene over ranges of its keys: errors, costs, responses
    #[command(after_help = "Example:\n  dovetail study studies/quick.toml --jobs 2")]
    Study(StudyArguments),
    /// Print the JSON schema of scene or study files, for editors
    #[command(after_help = "Example:\n  dovetail schema scene > scene.schema.json")]
    Schema(Schema),
    /// Print the completions of a shell
    #[command(
        after_help = "Example, as a line of ~/.bashrc:\n  source <(dovetail completions bash)"
    )]
    Completions(Completions),
    /// Write the man pages into a folder
    #[command(after_help = "Example:\n  dovetail man ~/.local/share/man/man1")]
    Man(Man),
}

/// Commands about a scene.
#[derive(Debug, Subcommand)]
pub(super) enum SceneCommand {
    /// The whole chain: mesh, static state, response, fields and plots
    #[command(after_help = RUN_HELP)]
    Run(RunArguments),
    /// Only read or make the mesh, and pair the flanks
    #[command(after_help = "Example:\n  dovetail mesh scene.toml --set mesh.parameters.nu=8")]
    Mesh(SceneFile),
    /// Up to the modes of the stuck assembly; over the speed (Campbell)
    #[command(after_help = "Example:\n  dovetail modes scene.toml --rpm 0:8000:9")]
    Modes(ModesArguments),
    /// Up to the reduced model, which [reduced_model] of a scene reads
    #[command(after_help = "Example:\n  dovetail reduce scene.toml --out my_model")]
    Reduce(Reduce),
    /// Up to the static state under rotation, loads and press fits
    #[command(after_help = "Example:\n  dovetail static scene.toml --set rotation.speed_rpm=8000")]
    Static(Static),
    /// Follow the peak over values of a key, or of two: the design curve
    #[command(after_help = PEAKS_HELP)]
    Peaks(PeaksArguments),
    /// All motions at one frequency over values of a key, round folds
    #[command(after_help = CURVE_HELP)]
    Curve(CurveArguments),
    /// Frequency and damping of a mode over its amplitude
    #[command(after_help = BACKBONE_HELP)]
    Backbone(BackboneArguments),
    /// Wear of the contacts over cycles, and the vibration left
    #[command(after_help = WEAR_HELP)]
    Wear(WearArguments),
    /// Compare the response with a time integration at a few frequencies
    #[command(after_help = "Example:\n  dovetail verify scene.toml --at 450.1,451")]
    Verify(VerifyArguments),
    /// Only check the scene file; nothing is computed or written
    #[command(after_help = "Example:\n  dovetail check scene.toml")]
    Check(SceneFile),
}

impl SceneCommand {
    /// File of the scene.
    pub(super) fn file(&self) -> &Path {
        match self {
            Self::Run(RunArguments { file, .. })
            | Self::Mesh(file)
            | Self::Modes(ModesArguments { file, .. })
            | Self::Reduce(Reduce { file, .. })
            | Self::Static(Static { file, .. })
            | Self::Peaks(PeaksArguments { file, .. })
            | Self::Curve(CurveArguments { file, .. })
            | Self::Backbone(BackboneArguments { file, .. })
            | Self::Wear(WearArguments { file, .. })
            | Self::Verify(VerifyArguments { file, .. })
            | Self::Check(file) => &file.scene,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct New {
    /// New folder for the files; its name is that of the scene
    #[arg(value_name = "NAME", value_hint = ValueHint::DirPath)]
    pub(super) folder: PathBuf,

    /// Model of the scene
    #[arg(long, value_name = "TEMPLATE", value_enum, default_value_t = Template::Dovetail)]
    pub(super) template: Template,
}

#[derive(Debug, Args)]
pub(super) struct Schema {
    /// Kind of file that it describes
    #[arg(value_name = "KIND", value_enum, default_value_t = FileKind::Scene)]
    pub(super) kind: FileKind,
}

/// A kind of file that a user writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum FileKind {
    Scene,
    Study,
}

#[derive(Debug, Args)]
pub(super) struct Completions {
    /// The shell whose words are completed
    #[arg(value_name = "SHELL", value_enum)]
    pub(super) shell: Shell,
}

#[derive(Debug, Args)]
pub(super) struct Man {
    /// Folder for the pages; it is made where it is missing
    #[arg(value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(super) folder: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct StudyArguments {
    /// The study: a TOML file that names a scene and its parameters
    #[arg(value_name = "STUDY", value_hint = ValueHint::FilePath)]
    pub(super) study: PathBuf,

    /// Cases side by side [default: one per core]; each takes --threads [default: 1]
    #[arg(long, value_name = "N", value_parser = parse_positive)]
    jobs: Option<usize>,

    /// Run nothing: answer with the cases that are there
    #[arg(long, group = "action", conflicts_with = "jobs")]
    collect: bool,

    /// Run this case alone, without answers
    #[arg(long, value_name = "NAME", group = "action", conflicts_with = "jobs")]
    case: Option<String>,

    /// Run nothing: write a Snakemake workflow and the list of its cases into DIR
    #[arg(long, value_name = "DIR", group = "action", conflicts_with = "jobs", value_hint = ValueHint::DirPath)]
    export_workflow: Option<PathBuf>,
}

impl StudyArguments {
    pub(super) fn options(&self, shared: &Shared) -> StudyOptions {
        let action = match (&self.case, &self.export_workflow) {
            (Some(case), _) => Action::Case(case.clone()),
            (_, Some(folder)) => Action::ExportWorkflow(folder.clone()),
            _ if self.collect => Action::Collect,
            _ => Action::Run,
        };
        let cache = shared.cache.clone();
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        StudyOptions {
            action,
            out: shared.out.clone(),
            jobs: self.jobs.unwrap_or_else(cores),
            threads: shared.threads.unwrap_or(1),
            cache: cache.map(|folder| (folder, shared.cache_limit_gib)),
            no_cache: shared.no_cache,
            overrides: shared.overrides.clone(),
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct SceneFile {
    /// The scene: a TOML file that describes one run
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub(super) scene: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct Reduce {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Keep the reduced model in the cache for later runs, and write no folder
    #[arg(long)]
    pub(super) into_cache: bool,

    /// There too: the modes of each body with its flanks held, for runs with this option
    #[arg(long, requires = "into_cache")]
    pub(super) held_modes: bool,
}

#[derive(Debug, Args)]
pub(super) struct MeshFile {
    /// The mesh: MSH, a deck of Abaqus or CalculiX, an archive of Ansys, bulk data of Nastran, or VTU
    #[arg(value_name = "MESH", value_hint = ValueHint::FilePath)]
    pub(super) mesh: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Plot {
    Logarithmic,
    Phase,
}

#[derive(Debug, Args)]
pub(super) struct Static {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Write the stress at the integration points, too (static_points.vtu)
    #[arg(long)]
    pub(super) stress_points: bool,
}

#[derive(Debug, Args)]
pub(super) struct RunArguments {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Write tables and plots only: no fields for ParaView, no static_observed.csv
    #[arg(long)]
    pub(super) no_fields: bool,

    /// Write the motion at the peak as N frames of one period, too (peak.pvd)
    #[arg(long, value_name = "N", conflicts_with = "no_fields", value_parser = frames)]
    pub(super) frames: Option<usize>,

    /// Write the motion at the peak on all sectors of a disc, too (peak_disc.vtu, and the frames)
    #[arg(long, conflicts_with = "no_fields")]
    pub(super) whole_disc: bool,

    /// Write the stress at the integration points, too (static_points.vtu, peak_points.vtu)
    #[arg(long, conflicts_with = "no_fields")]
    pub(super) stress_points: bool,

    /// Compute the modes of each body with its flanks held, too (modes.csv, summary.json)
    #[arg(long)]
    pub(super) held_modes: bool,

    /// Draw this, too (may be repeated): the amplitude on a logarithmic axis, or the phase
    #[arg(long = "plot", value_name = "KIND", value_enum)]
    pub(super) plots: Vec<Plot>,

    /// Go on with a run of this scene that was broken off: its frequencies are not solved again
    #[arg(long)]
    pub(super) resume: bool,

    /// End when standard input ends: so a case of a study ends with the study
    #[arg(long, hide = true)]
    pub(super) until_stdin_ends: bool,
}

impl RunArguments {
    pub(super) fn further_plots(&self) -> Vec<FurtherPlot> {
        let kind = |plot: &Plot| match plot {
            Plot::Logarithmic => FurtherPlot::Logarithmic,
            Plot::Phase => FurtherPlot::Phase,
        };
        self.plots.iter().map(kind).collect()
    }
}

#[derive(Debug, Args)]
pub(super) struct ModesArguments {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Frequencies at N speeds in place of the scene's: a table and a Campbell diagram
    #[arg(long, value_name = "FROM:TO:N")]
    pub(super) rpm: Option<SpeedRange>,

    /// Shapes of the modes of this nodal diameter on the whole disc, for a scene with [cyclic]
    #[arg(long, value_name = "D", conflicts_with = "rpm")]
    pub(super) nodal_diameter: Option<usize>,

    /// Engine orders of diagram and crossings; repeated or with commas [default: up to 36]
    #[arg(long, value_name = "EO", value_delimiter = ',', value_parser = engine_order, requires = "rpm")]
    pub(super) orders: Vec<usize>,
}

#[derive(Debug, Args)]
pub(super) struct PeaksArguments {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Key with its range, of N values [default: 20]; given twice, the peaks over the first key at
    /// each value of the second
    #[arg(long, value_name = "KEY=FROM:TO[:N]", required = true)]
    over: Vec<KeyRange>,

    /// Name of the observed displacement [default: the first one]
    #[arg(long, value_name = "NAME")]
    observe: Option<String>,

    /// Find the values at which the peak has this amplitude, too
    #[arg(long, value_name = "M", value_parser = positive)]
    amplitude: Option<f64>,

    /// Go on with a search that was broken off: its peaks are not looked for again
    #[arg(long)]
    resume: bool,
}

impl PeaksArguments {
    pub(super) fn question(&self) -> Result<PeakQuestion, Error> {
        let (over, at_each) = match &self.over[..] {
            [over] => (over, None),
            [over, at_each] => (over, Some(at_each.clone())),
            more => return Err(Error::KeyRanges { given: more.len() }),
        };
        Ok(PeakQuestion {
            over: over.clone(),
            at_each,
            observation: self.observe.clone(),
            amplitude_m: self.amplitude,
            resume: self.resume,
        })
    }
}

#[derive(Debug, Args)]
pub(super) struct CurveArguments {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Key with its range; KEY=FROM:TO:N asks for motions at N values [default: 20]
    #[arg(long, value_name = "KEY=FROM:TO")]
    over: KeyRange,

    /// Frequency of the motions
    #[arg(long, value_name = "HZ", value_parser = positive)]
    frequency: f64,

    /// Name of the observed displacement [default: the first one]
    #[arg(long, value_name = "NAME")]
    observe: Option<String>,

    /// Go on with a curve that was broken off: its motions are not solved for again
    #[arg(long)]
    resume: bool,
}

impl CurveArguments {
    pub(super) fn request(&self) -> AskedCurve {
        AskedCurve {
            over: self.over.clone(),
            frequency_hz: self.frequency,
            observation: self.observe.clone(),
            resume: self.resume,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct BackboneArguments {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Number of the linear mode, 1 the lowest (modes.csv of `dovetail static` lists them), or
    /// `shape`: of those in the range of frequencies of the scene, the one that moves the observed
    /// displacement most
    #[arg(long, value_name = "N|shape", default_value = "1", value_parser = mode_choice)]
    mode: ModeChoice,

    /// Range of the amplitude of the observed displacement, m
    #[arg(long, value_name = "FROM:TO", required = true)]
    amplitude: AmplitudeRange,

    /// Number of amplitudes, spaced evenly in their logarithm
    #[arg(long, value_name = "N", default_value_t = AMPLITUDES, value_parser = amplitudes)]
    points: usize,

    /// Name of the observed displacement [default: the first one]
    #[arg(long, value_name = "NAME")]
    observe: Option<String>,
}

impl BackboneArguments {
    pub(super) fn request(&self) -> AskedBackbone {
        AskedBackbone {
            mode: self.mode,
            amplitudes_m: self.amplitude.values_m(self.points),
            observation: self.observe.clone(),
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct WearArguments {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Number of cycles; with commas, those at which a state is asked for, ascending
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = positive, required = true)]
    cycles: Vec<f64>,

    /// Frequency of all cycles [default: the mission of the scene, or the peak]
    #[arg(long, value_name = "HZ", value_parser = positive)]
    at_frequency: Option<f64>,

    /// Largest error of the depths of a block, as a fraction of the largest of them
    #[arg(long, value_name = "E", default_value_t = TOLERANCE, value_parser = wear_tolerance)]
    tolerance: f64,

    /// Name of the observed displacement whose peak is followed [default: the first one]
    #[arg(long, value_name = "NAME")]
    observe: Option<String>,

    /// Go on with a computation that was broken off: its vibrations are not solved for again
    #[arg(long)]
    resume: bool,
}

impl WearArguments {
    pub(super) fn request(&self) -> Result<AskedWear, Error> {
        if let Some(two) = self.cycles.windows(2).find(|two| two[0] >= two[1]) {
            let [from, to] = [two[0], two[1]];
            return Err(Error::CyclesDescend { from, to });
        }
        Ok(AskedWear {
            cycles: self.cycles.clone(),
            frequency_hz: self.at_frequency,
            tolerance: self.tolerance,
            observation: self.observe.clone(),
            resume: self.resume,
        })
    }
}

#[derive(Debug, Args)]
pub(super) struct VerifyArguments {
    #[command(flatten)]
    pub(super) file: SceneFile,

    /// Frequencies, Hz; repeated or with commas [default: the peak and its two flanks]
    #[arg(long, value_name = "HZ", value_delimiter = ',', value_parser = positive)]
    at: Vec<f64>,

    /// Time steps per period
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = steps_of_a_period)]
    steps: usize,

    /// Integrate exactly so many periods, steady or not [default: until steady]
    #[arg(long, value_name = "N", value_parser = periods)]
    periods: Option<usize>,

    /// Give up after so many periods
    #[arg(long, value_name = "N", default_value_t = 1500, value_parser = periods)]
    most_periods: usize,

    /// Allowed transient, as a fraction of the amplitude
    #[arg(long, value_name = "FRACTION", default_value_t = 2e-4, value_parser = positive)]
    steady: f64,

    /// Start from the static state, not from the motion of harmonic balance
    #[arg(long)]
    from_rest: bool,

    /// Start from the motion of harmonic balance made larger by this fraction
    #[arg(long, value_name = "FRACTION", conflicts_with = "from_rest", value_parser = positive)]
    perturb: Option<f64>,

    /// Largest difference that passes, of the integrated value
    #[arg(long, value_name = "FRACTION", default_value_t = 0.02, value_parser = positive)]
    tolerance: f64,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v),
        _ => Err("a number above 0 is expected".to_owned()),
    }
}

fn parse_positive(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(v) if v >= 1 => Ok(v),
        _ => Err("a whole number of at least 1 is expected".to_owned()),
    }
}

fn mode_choice(text: &str) -> Result<ModeChoice, String> {
    match text {
        "shape" => Ok(ModeChoice::LargestShape),
        number => parse_positive(number)
            .map(ModeChoice::Number)
            .map_err(|expected| format!("{expected}, or `shape`")),
    }
}

fn steps_of_a_period(text: &str) -> Result<usize, String> {
    parse_whole_number(text, LEAST_STEPS..=MOST_STEPS)
}

fn periods(text: &str) -> Result<usize, String> {
    parse_whole_number(text, 1..=MOST_PERIODS)
}

fn engine_order(text: &str) -> Result<usize, String> {
    parse_whole_number(text, 1..=1000)
}

fn wear_tolerance(text: &str) -> Result<f64, String> {
    let [least, most] = TOLERANCES;
    match text.parse::<f64>() {
        Ok(v) if (least..=most).contains(&v) => Ok(v),
        _ => Err(format!("a number from {least} to {most} is expected")),
    }
}

fn amplitudes(text: &str) -> Result<usize, String> {
    parse_whole_number(text, 2..=MOST_AMPLITUDES)
}
fn frames(text: &str) -> Result<usize, String> {
    parse_whole_number(text, 2..=999)
}

fn parse_whole_number(text: &str, range: RangeInclusive<usize>) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(v) if range.contains(&v) => Ok(v),
        _ => Err(format!(
            "a whole number from {} to {} is expected",
            range.start(),
            range.end()
        )),
    }
}

impl VerifyArguments {
    pub(super) fn request(&self) -> Verification {
        Verification {
            frequencies_hz: self.at.clone(),
            steps_per_period: self.steps,
            periods: self.periods,
            most_periods: self.most_periods,
            steady: self.steady,
            from_rest: self.from_rest,
            perturbation: self.perturb.unwrap_or(0.0),
            tolerance: self.tolerance,
        }
    }
}

/// Folder and size limit of the cache, from the command line, the environment, or the defaults;
/// `None` if the command line switches the cache off.
pub(super) fn cache_settings(shared: &Shared) -> Result<Option<CacheSettings>, Error> {
    if shared.no_cache {
        return Ok(None);
    }
    let settings = CacheSettings::chosen(shared.cache.clone(), shared.cache_limit_gib)?;
    Ok(Some(settings))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::path::Path;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn global_options_stand_before_or_after_the_command() {
        for line in [
            "dovetail run a.toml --set x=1 --set y=2 --threads 2 -q --out o",
            "dovetail --set x=1 --set y=2 --threads 2 --quiet --out o run a.toml",
        ] {
            let cli = Cli::try_parse_from(line.split(' ')).unwrap();
            let shared = cli.shared;
            assert_eq!(shared.overrides, ["x=1", "y=2"]);
            assert_eq!((shared.threads, shared.quiet), (Some(2), true));
            assert_eq!(shared.out.as_deref(), Some(Path::new("o")));
            assert!(
                matches!(cli.command, Command::Scene(SceneCommand::Run(r)) if r.file.scene == Path::new("a.toml"))
            );
        }
    }

    #[test]
    fn frequencies_are_repeated_or_listed() {
        let line = "dovetail verify a.toml --at 450.1,451 --at 452 --periods 5 --from-rest";
        let cli = Cli::try_parse_from(line.split(' ')).unwrap();
        let Command::Scene(SceneCommand::Verify(arguments)) = cli.command else {
            panic!("not verify");
        };
        let asked = arguments.request();
        assert_eq!(asked.frequencies_hz, [450.1, 451.0, 452.0]);
        assert_eq!((asked.periods, asked.from_rest), (Some(5), true));
    }

    #[test]
    fn engine_orders_are_repeated_or_listed() {
        let line = "dovetail modes a.toml --rpm 0:5000:3 --orders 4,36 --orders 40";
        let cli = Cli::try_parse_from(line.split(' ')).unwrap();
        assert!(
            matches!(cli.command, Command::Scene(SceneCommand::Modes(m)) if m.orders == [4, 36, 40])
        );
    }

    #[test]
    fn a_wrong_command_line_has_exit_code_2_and_help_0() {
        for (line, code) in [
            ("dovetail fly a.toml", 2),
            ("dovetail run", 2),
            ("dovetail run a.toml --threads 0", 2),
            ("dovetail verify a.toml --at 0", 2),
            ("dovetail verify a.toml --steps 3", 2),
            ("dovetail verify a.toml --steps 1000000000000", 2),
            ("dovetail verify a.toml --periods 1000000000000", 2),
            ("dovetail verify a.toml --most-periods 0", 2),
            ("dovetail modes a.toml --rpm 5000", 2),
            ("dovetail run a.toml --rpm 0:5000:3", 2),
            ("dovetail modes a.toml --orders 4", 2),
            ("dovetail modes a.toml --rpm 0:5000:3 --orders 4,0", 2),
            ("dovetail run a.toml --frames 1", 2),
            ("dovetail run a.toml --frames 24 --no-fields", 2),
            ("dovetail", 2),
            ("dovetail --help", 0),
            ("dovetail static --help", 0),
            ("dovetail --version", 0),
        ] {
            assert_eq!(
                Cli::try_parse_from(line.split(' '))
                    .unwrap_err()
                    .exit_code(),
                code,
                "{line}"
            );
        }
    }
}
