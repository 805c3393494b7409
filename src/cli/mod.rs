//! Turns the arguments of the command line into a checked scene and one call of
//! [`crate::pipeline`], and errors into an exit code. Results are printed here alone.

mod arguments;
mod error;

use std::path::Path;
use std::process::ExitCode;

use clap::Parser;

pub use self::error::Error;

use self::arguments::{Cli, Command, Modes, cache_settings};
use crate::console::{Console, Verbosity};
use crate::exit::ExitStatus;
use crate::export::csv;
use crate::export::folder::OtherScene;
use crate::export::manifest::Summary;
use crate::pipeline::observer::{Both, Observer};
use crate::pipeline::progress::Progress;
use crate::pipeline::verify::verify;
use crate::pipeline::{self, Context, Files, RunError};
use crate::scene;
use crate::study;
use crate::terminal;
use dovetail_solver::description::Scene;
use dovetail_solver::reduction::LISTED_MODES;

/// Runs the program on the process's arguments. Exit codes: see [`ExitStatus`].
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
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
    let mut console = Console::new(match cli.quiet {
        true => Verbosity::Quiet,
        false => Verbosity::Normal,
    });
    if let Command::Study(arguments) = &cli.command {
        let progress = Progress::new(&mut console);
        let studied = study::study(&arguments.study, &arguments.options(cli), &progress)?;
        terminal::print(&studied.recommendations).map_err(Error::Print)?;
        return Ok(studied.verdict?);
    }
    // Dense factorisations split among threads round differently: each runs on one, and the work is shared
    // between bodies, halves of the sweep and pairs, so that results do not depend on --threads.
    faer::set_global_parallelism(faer::Par::Seq);
    let file = cli.command.scene();
    let scene = scene::load(file, &cli.overrides)?;
    if let Some(threads) = cli.threads.map(usize::from) {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|source| Error::Threads { threads, source })?;
    }
    let out = cli
        .out
        .clone()
        .unwrap_or_else(|| Path::new("output").join(&scene.name));
    let context = Context {
        out,
        scene_file: file.to_path_buf(),
        fields: !matches!(&cli.command, Command::Run(arguments) if arguments.no_fields),
        held_modes: matches!(&cli.command, Command::Run(arguments) if arguments.held_modes),
        cache: cache_settings(cli)?,
    };
    if matches!(&cli.command, Command::Run(arguments) if arguments.until_stdin_ends) {
        end_with_stdin();
    }
    let other = match cli.force {
        true => OtherScene::Replace,
        false => OtherScene::Refuse,
    };
    command(&cli.command, &scene, &context, other, console)
}

/// What a command does about a scene: computes, writes, prints.
fn command(
    command: &Command,
    scene: &Scene,
    context: &Context,
    other: OtherScene,
    mut console: Console,
) -> Result<(), Error> {
    let print = |text: &str| terminal::print(text).map_err(Error::Print);
    match command {
        Command::Run(_) => {
            let mut files = Files::open(scene, context, other)?;
            let observers = &mut Both(&mut files, &mut console);
            let run = noted(pipeline::solve(scene, context, observers), &files)?;
            let verdict = run.verdict();
            finish(&files, &run.summary, &verdict, &mut console)?;
            if let Some(response) = &run.response {
                console.figures(&run.reduced, response);
            }
            Ok(verdict?)
        }
        Command::Static(_) => {
            let mut files = Files::open(scene, context, other)?;
            let observers = &mut Both(&mut files, &mut console);
            let state = pipeline::static_state(scene, context, observers);
            let (summary, verdict) = noted(state, &files)?;
            finish(&files, &summary, &verdict, &mut console)?;
            Ok(verdict?)
        }
        Command::Mesh(_) => {
            let files = Files::open(scene, context, other)?;
            let progress = Progress::new(&mut console);
            let summary = noted(pipeline::mesh(scene, context, &progress), &files)?;
            finish(&files, &summary, &Ok(()), &mut console)
        }
        Command::Modes(Modes { rpm: None, .. }) => {
            let files = Files::open(scene, context, other)?;
            let progress = Progress::new(&mut console);
            let (rows, summary) = noted(pipeline::modes(scene, context, &progress), &files)?;
            files.modes(&rows)?;
            let listed = rows.iter().filter(|r| r.mode <= LISTED_MODES);
            print(&listed.map(mode_line).collect::<String>())?;
            finish(&files, &summary, &Ok(()), &mut console)
        }
        Command::Modes(Modes {
            rpm: Some(speeds), ..
        }) => {
            let files = Files::open(scene, context, other)?;
            let progress = Progress::new(&mut console);
            let campbell = pipeline::campbell(scene, *speeds, context, &progress);
            let campbell = noted(campbell, &files)?;
            files.campbell(&campbell)?;
            print(&campbell.table())?;
            finish(&files, &campbell.summary, &Ok(()), &mut console)
        }
        Command::Verify(arguments) => {
            let files = Files::open(scene, context, other)?;
            let progress = Progress::new(&mut console);
            let verified = verify(scene, context, &arguments.asked(), &progress);
            let verified = noted(verified, &files)?;
            files.verification(&verified.comparisons)?;
            finish(&files, &verified.summary, &Ok(()), &mut console)?;
            print(&verified.table())?;
            Ok(verified.verdict?)
        }
        Command::Reduce(_) => {
            let progress = Progress::new(&mut console);
            Ok(pipeline::reduce(scene, context, &progress)?)
        }
        Command::Check(_) => Ok(pipeline::check(scene, &Progress::new(&mut console))?),
        // Comes with a file of its own.
        Command::Study(_) => Ok(()),
    }
}

/// The result of a run; where it failed, its folder says so.
fn noted<T>(result: Result<T, RunError>, files: &Files) -> Result<T, RunError> {
    result.inspect_err(|error| files.failed(error))
}

/// The last file of a run, and where all of them are.
fn finish(
    files: &Files,
    summary: &Summary,
    verdict: &Result<(), RunError>,
    console: &mut Console,
) -> Result<(), Error> {
    files.finish(summary, verdict)?;
    console.note(&format!("results in {}", files.folder().display()));
    Ok(())
}

fn mode_line(row: &csv::ModeRow) -> String {
    format!(
        "{:<15} {:<10} {:>3} {:>14.4} Hz\n",
        row.kind, row.body, row.mode, row.frequency_hz
    )
}

/// Ends the process when standard input does, which the death of whoever holds its other end brings about.
fn end_with_stdin() {
    std::thread::spawn(|| {
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        std::process::exit(i32::from(ExitStatus::Failed.code()));
    });
}
