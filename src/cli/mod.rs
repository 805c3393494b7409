//! Turns the arguments of the command line (`arguments.rs`) into one call, and errors into an exit
//! code.
//!
//! A command about a scene has the scene checked and calls [`crate::commands`]. All of these but
//! `check` and `reduce --into-cache` open an output folder, and leave it readable when a signal
//! ends them. The other commands are about no scene: `study` calls [`crate::study`], `schema`
//! [`crate::schema`], and `groups`, `new`, completions and man pages are made by files of this
//! folder.
//!
//! Only this folder prints to standard output, by [`crate::terminal`]: commands return their tables
//! as texts. What commands and studies tell on their way goes to the reporter and from there to
//! stderr.

mod arguments;
mod closing;
mod error;
mod groups;
mod help;
mod interruption;
mod new;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

pub use self::error::Error;

use self::arguments::{
    Cli, Command, FileKind, ModesArguments, New, Reduce, RunArguments, SceneCommand, cache_settings,
};
use crate::commands::{self, Workspace, table_of_nodal_diameters};
use crate::console::Console;
use crate::error::RunError;
use crate::exhaustion;
use crate::exit::ExitStatus;
use crate::files::{Output, RunFiles, SharedFiles};
use crate::reporter::Reporter;
use crate::scene;
use crate::schema;
use crate::study;
use crate::terminal;
use dovetail_cache::Cache;
use dovetail_export::csv::ASSEMBLY;
use dovetail_export::folder::{Beginning, OtherScene};
use dovetail_solver::description::Scene;
use dovetail_solver::memory;
use dovetail_solver::reduction::LISTED_MODES;
use dovetail_solver::results::modes::NaturalFrequency;
use dovetail_solver::run::{Options, factorise_on_one_thread};
use signal_hook::consts::SIGXFSZ;

/// Runs the program with the arguments of the process. Exit codes: see [`ExitStatus`].
pub fn main() -> ExitCode {
    env_logger::init();
    // A file that may not grow is then an error of the file, with its name, and not the end without
    // a word.
    let told = signal_hook::flag::register(SIGXFSZ, Arc::default());
    if let Err(source) = told.and_then(|_| exhaustion::prepare()) {
        terminal::report(&Error::Start(source));
        return ExitCode::from(ExitStatus::Failed.code());
    }
    let cli = match help::parsed(std::env::args_os()) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too, with code 0. Nothing can be done where even they
            // cannot be printed.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(1));
        }
    };
    match run(&cli) {
        Ok(()) => ExitCode::from(ExitStatus::Done.code()),
        Err(error) => {
            terminal::report(&error);
            ExitCode::from(error.exit_status().code())
        }
    }
}

fn run(cli: &Cli) -> Result<(), Error> {
    let mut console = Console::new(cli.shared.verbosity());
    let print = |text: &str| terminal::print(text).map_err(Error::Print);
    match &cli.command {
        Command::Scene(command) => {
            let done = run_scene_command(cli, command, &mut console);
            done.map_err(|error| error.located(command.file(), cli.overrides()))
        }
        Command::Study(arguments) => {
            let reporter = Reporter::new(&mut console, None);
            let options = arguments.options(&cli.shared);
            Ok(study::study(&arguments.study, &options, &reporter)?)
        }
        Command::New(New { folder, template }) => {
            let told = new::write(folder, *template)?;
            if cli.shared.quiet {
                Ok(())
            } else {
                print(&told)
            }
        }
        Command::Groups(arguments) => print(&groups::list(&arguments.mesh, &mut console)?),
        Command::Schema(arguments) => {
            let schema = match arguments.kind {
                FileKind::Scene => schema::scene(),
                FileKind::Study => schema::study(),
            };
            print(&format!("{schema:#}\n"))
        }
        Command::Completions(arguments) => print(&help::completions(arguments.shell)),
        Command::Man(arguments) => help::man_pages(&arguments.folder),
    }
}

fn run_scene_command(
    cli: &Cli,
    command: &SceneCommand,
    console: &mut Console,
) -> Result<(), Error> {
    // Results do not depend on --threads.
    factorise_on_one_thread();
    let shared = &cli.shared;
    let file = command.file();
    let overrides = cli.overrides();
    let scene = scene::load(file, overrides)?;
    start_threads(shared.threads.map(usize::from))?;
    let of_scene = || Path::new("output").join(&scene.name);
    let out = shared.out.clone().unwrap_or_else(|| match command {
        // Another scene reads it, and the runs of this one leave it alone.
        SceneCommand::Reduce(Reduce {
            into_cache: false, ..
        }) => of_scene().join("reduced_model"),
        _ => of_scene(),
    });
    let run = match command {
        SceneCommand::Run(run) => Some(run),
        _ => None,
    };
    let output = Output {
        folder: out,
        scene_file: file.to_path_buf(),
        overrides: overrides.to_vec(),
        fields: run.is_none_or(|run| !run.no_fields),
        frames: run.and_then(|run| run.frames),
        whole_disc: run.is_some_and(|run| run.whole_disc),
        stress_points: match command {
            SceneCommand::Run(run) => run.stress_points,
            SceneCommand::Static(of) => of.stress_points,
            _ => false,
        },
        further_plots: run.map_or_else(Vec::new, RunArguments::further_plots),
    };
    let cache = Cache::new(cache_settings(shared)?.as_ref());
    let other = if shared.force {
        OtherScene::Replace
    } else {
        OtherScene::Refuse
    };
    match command {
        SceneCommand::Reduce(Reduce {
            into_cache: true,
            held_modes,
            ..
        }) => {
            let work = Workspace {
                scene: &scene,
                folder: output.folder,
                cache,
                files: None,
                reporter: Reporter::new(console, None),
            };
            Ok(work.reduce_into_cache(*held_modes)?)
        }
        SceneCommand::Check(_) => Ok(commands::check(&scene, &Reporter::new(console, None))?),
        command => {
            // A signal that comes while the folder is opened is heard once it is.
            let signals = interruption::signals().map_err(Error::Signals)?;
            let files = files(command, &scene, &output, other)?;
            let ended = handle_endings(command, &files, signals, console).and_then(|()| {
                let asked = (command, overrides);
                run_with_files(asked, &scene, &output, cache, &files, console)
            });
            ended.inspect_err(|error| files.locked().failed(error))
        }
    }
}

/// Memory of a thread, bytes: its stack and the buffers of its products of matrices.
const THREAD_BYTES: u64 = 4 << 20;

/// Most threads that are started for each core: more of them only wait for each other.
const MOST_THREADS_PER_CORE: usize = 4;

/// Starts the requested number of threads, as far as they are of use, or one for each core.
fn start_threads(asked: Option<usize>) -> Result<(), Error> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = asked.map_or(cores, |asked| asked.min(MOST_THREADS_PER_CORE * cores));
    memory::check_available(threads as u64 * THREAD_BYTES)
        .map_err(|source| Error::MemoryOfThreads { threads, source })?;
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|source| Error::Threads { threads, source })
}

/// Files of a command in their folder. An interrupted command leaves them readable.
fn files(
    command: &SceneCommand,
    scene: &Scene,
    output: &Output,
    other: OtherScene,
) -> Result<Arc<SharedFiles>, Error> {
    let beginning = match command {
        SceneCommand::Run(RunArguments { resume: true, .. }) => Beginning::Resumed,
        SceneCommand::Run(_) | SceneCommand::Static(_) => Beginning::Anew,
        _ => Beginning::Beside,
    };
    let files = RunFiles::open(scene, output, other, beginning)?;
    Ok(SharedFiles::new(files))
}

/// Sets up the final record in the folder for a process that ends by a signal, by the end of its
/// input or by lack of memory.
fn handle_endings(
    command: &SceneCommand,
    files: &Arc<SharedFiles>,
    signals: signal_hook::iterator::Signals,
    console: &Console,
) -> Result<(), Error> {
    let (of_signal, lines) = (Arc::clone(files), console.lines());
    let last_word = Arc::new(move |signal: &str| {
        let message = match of_signal.locked_to_end().interrupted(signal) {
            Ok(message) => message,
            Err(error) => format!("ended by {signal}: {error}"),
        };
        lines.last(&message);
    });
    interruption::handle_signals(signals, last_word.clone()).map_err(Error::Start)?;
    if matches!(command, SceneCommand::Run(arguments) if arguments.until_stdin_ends) {
        interruption::handle_end_of_stdin(last_word).map_err(Error::Start)?;
    }
    let out_of_memory = Arc::clone(files);
    exhaustion::set_exhaustion_action(move |error| {
        out_of_memory.failed_to_end(&RunError::OutOfMemory(error));
    });
    Ok(())
}

/// Executes a command about a scene, which was loaded with these keys set: computes, writes, prints.
fn run_with_files(
    (command, overrides): (&SceneCommand, &[String]),
    scene: &Scene,
    output: &Output,
    cache: Cache,
    files: &Arc<SharedFiles>,
    console: &mut Console,
) -> Result<(), Error> {
    let print = |text: &str| terminal::print(text).map_err(Error::Print);
    let verbosity = console.verbosity();
    let work = Workspace {
        scene,
        folder: output.folder.clone(),
        cache,
        files: Some(Arc::clone(files)),
        reporter: Reporter::new(console, Some(Arc::clone(files))),
    };
    let finish = |verdict: &Result<(), RunError>| finish(files, verdict, &work.reporter);
    let scene_with = |set: &[String]| {
        let both: Vec<String> = overrides.iter().chain(set).cloned().collect();
        scene::load(&output.scene_file, &both).map_err(Error::from)
    };
    match command {
        SceneCommand::Run(_) | SceneCommand::Static(_) => {
            let options = Options {
                fields: output.fields,
                held_modes: matches!(command, SceneCommand::Run(run) if run.held_modes),
            };
            if output.whole_disc {
                work.is_about_a_disc()?;
            }
            let run = match command {
                SceneCommand::Static(_) => work.static_state(options),
                _ => work.solve(options),
            }?;
            let verdict = run.verdict().map_err(RunError::from);
            files.locked().record_times(work.reporter.run_times());
            files.locked().report(&run, &verdict)?;
            finish(&verdict)?;
            drop(work);
            console.end();
            let files = files.locked();
            print(&closing::closing_lines(
                &run,
                files.summary(),
                files.folder(),
                verbosity,
            ))?;
            Ok(verdict?)
        }
        SceneCommand::Mesh(_) => {
            work.mesh()?;
            finish(&Ok(()))
        }
        SceneCommand::Modes(ModesArguments {
            rpm: None,
            nodal_diameter,
            ..
        }) => {
            let (modes, nodal_diameters) = work.modes(*nodal_diameter)?;
            let listed = modes.iter().filter(|r| r.mode <= LISTED_MODES);
            print(&listed.map(mode_line).collect::<String>())?;
            print(
                &nodal_diameters
                    .as_ref()
                    .map_or_else(String::new, table_of_nodal_diameters),
            )?;
            finish(&Ok(()))
        }
        SceneCommand::Modes(ModesArguments {
            rpm: Some(speeds),
            orders,
            ..
        }) => {
            print(&work.campbell(*speeds, orders)?)?;
            finish(&Ok(()))
        }
        SceneCommand::Peaks(arguments) => {
            let (table, verdict) = work.peaks(&arguments.question()?, &scene_with)?;
            finish(&verdict)?;
            print(&table)?;
            Ok(verdict?)
        }
        SceneCommand::Curve(arguments) => {
            let (table, verdict) = work.curve(&arguments.request(), &scene_with)?;
            finish(&verdict)?;
            print(&table)?;
            Ok(verdict?)
        }
        SceneCommand::Backbone(arguments) => {
            let (table, verdict) = work.backbone(&arguments.request())?;
            finish(&verdict)?;
            print(&table)?;
            Ok(verdict?)
        }
        SceneCommand::Wear(arguments) => {
            let (table, verdict) = work.wear(&arguments.request()?)?;
            finish(&verdict)?;
            print(&table)?;
            Ok(verdict?)
        }
        SceneCommand::Verify(arguments) => {
            let (verified, table) = work.verify(&arguments.request())?;
            finish(&Ok(()))?;
            print(&table)?;
            Ok(verified.verdict.map_err(RunError::from)?)
        }
        SceneCommand::Reduce(_) => {
            work.reduce()?;
            finish(&Ok(()))
        }
        // They write no results of a run.
        SceneCommand::Check(_) => Ok(()),
    }
}

/// Writes the last file of a run, and prints the folder of all of them.
fn finish(
    files: &SharedFiles,
    verdict: &Result<(), RunError>,
    reporter: &Reporter<'_>,
) -> Result<(), Error> {
    let folder = {
        let mut files = files.locked();
        files.record_times(reporter.run_times());
        files.finish(verdict)?;
        files.folder().display().to_string()
    };
    reporter.note(&format!("results in {folder}"));
    Ok(())
}

fn mode_line(row: &NaturalFrequency) -> String {
    format!(
        "{:<15} {:<10} {:>3} {:>14.4} Hz\n",
        row.kind.id(),
        row.body.as_deref().unwrap_or(ASSEMBLY),
        row.mode,
        row.frequency_hz
    )
}
