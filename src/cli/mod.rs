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
use crate::export::manifest::Summary;
use crate::pipeline::observer::{Both, Observer};
use crate::pipeline::progress::Progress;
use crate::pipeline::verify::verify;
use crate::pipeline::{self, Context, Files};
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
    command(&cli.command, &scene, &context, console)
}

/// What a command does about a scene: computes, writes, prints.
fn command(
    command: &Command,
    scene: &Scene,
    context: &Context,
    mut console: Console,
) -> Result<(), Error> {
    let mut files = Files::new(scene, context);
    let print = |text: &str| terminal::print(text).map_err(Error::Print);
    match command {
        Command::Run(_) => {
            let observers = &mut Both(&mut files, &mut console);
            let run = pipeline::solve(scene, context, observers)?;
            finish(&files, context, &run.summary, &mut console)?;
            if let Some(response) = &run.response {
                console.figures(&run.reduced, response);
            }
            Ok(run.verdict()?)
        }
        Command::Static(_) => {
            let observers = &mut Both(&mut files, &mut console);
            let (summary, verdict) = pipeline::static_state(scene, context, observers)?;
            finish(&files, context, &summary, &mut console)?;
            Ok(verdict?)
        }
        Command::Mesh(_) => {
            let summary = pipeline::mesh(scene, context, &Progress::new(&mut console))?;
            finish(&files, context, &summary, &mut console)
        }
        Command::Modes(Modes { rpm: None, .. }) => {
            let (rows, summary) = pipeline::modes(scene, context, &Progress::new(&mut console))?;
            files.modes(&rows)?;
            let listed = rows.iter().filter(|r| r.mode <= LISTED_MODES);
            print(&listed.map(mode_line).collect::<String>())?;
            finish(&files, context, &summary, &mut console)
        }
        Command::Modes(Modes {
            rpm: Some(speeds), ..
        }) => {
            let progress = Progress::new(&mut console);
            let (table, summary) = pipeline::campbell(scene, *speeds, context, &progress)?;
            print(&table)?;
            finish(&files, context, &summary, &mut console)
        }
        Command::Verify(arguments) => {
            let progress = Progress::new(&mut console);
            let verified = verify(scene, context, &arguments.asked(), &progress)?;
            finish(&files, context, &verified.summary, &mut console)?;
            print(&verified.table)?;
            Ok(verified.verdict?)
        }
        Command::Reduce(_) => Ok(pipeline::reduce(
            scene,
            context,
            &Progress::new(&mut console),
        )?),
        Command::Check(_) => Ok(pipeline::check(scene, &Progress::new(&mut console))?),
        // Comes with a file of its own.
        Command::Study(_) => Ok(()),
    }
}

/// The last file of a run, and where all of them are.
fn finish(
    files: &Files,
    context: &Context,
    summary: &Summary,
    console: &mut Console,
) -> Result<(), Error> {
    files.finish(summary)?;
    console.note(&format!("results in {}", context.out.display()));
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
