//! Help of the command line that fits a screen, completions and man pages.

use std::ffi::OsString;
use std::path::Path;

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, CommandFactory, FromArgMatches, Subcommand};
use clap_complete::Shell;

use super::arguments::{Cli, SceneCommand};
use super::error::Error;
use crate::error::RunError;
use dovetail_export::{create_folder, write_file};

/// Largest width of help, columns.
const WIDTH: usize = 80;

/// The command line for parsing and help. The options of all commands are only in the help of the
/// program; each command has a line about them.
fn command() -> clap::Command {
    let command = Cli::command().max_term_width(WIDTH);
    let shared: Vec<Arg> = shared(&command).map(|arg| arg.clone().hide(true)).collect();
    command.mut_subcommands(|sub| {
        let help = sub.get_after_help().map(ToString::to_string);
        let more = if takes_shared(sub.get_name()) {
            "\n\nOptions of all commands, such as --out and --threads: dovetail --help"
        } else {
            ""
        };
        sub.args(&shared)
            .after_help(help.unwrap_or_default() + more)
    })
}

fn shared(command: &clap::Command) -> impl Iterator<Item = &Arg> {
    command.get_arguments().filter(|arg| arg.is_global_set())
}

/// Returns `true` if a command is about a scene or a study.
fn takes_shared(name: &str) -> bool {
    SceneCommand::has_subcommand(name) || name == "study"
}

/// Parses the command line.
///
/// # Errors
/// An invalid command line; also help and version.
pub(super) fn parsed(words: impl IntoIterator<Item = OsString>) -> Result<Cli, clap::Error> {
    let matches = command().try_get_matches_from(words)?;
    refuse_unused_options(&matches)?;
    Cli::from_arg_matches(&matches)
}

/// Refuses options of commands about scenes for other commands.
fn refuse_unused_options(matches: &ArgMatches) -> Result<(), clap::Error> {
    let Some((name, given)) = matches.subcommand() else {
        return Ok(());
    };
    let command = Cli::command();
    let mut options = shared(&command).filter(|arg| arg.get_id() != "quiet");
    let is_given =
        |arg: &&Arg| given.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine);
    match options.find(is_given).and_then(Arg::get_long) {
        Some(option) if !takes_shared(name) => {
            let message = format!(
                "`dovetail {name}` takes no --{option}, which is for commands about scenes and \
                 studies: leave it out"
            );
            Err(self::command().error(ErrorKind::ArgumentConflict, message))
        }
        _ => Ok(()),
    }
}

/// Script by which a shell completes the words of the command line.
pub(super) fn completions(shell: Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "dovetail", &mut script);
    String::from_utf8_lossy(&script).into_owned()
}

/// Writes dovetail.1 and a page for each command.
///
/// # Errors
/// A file or the folder cannot be written.
pub(super) fn man_pages(folder: &Path) -> Result<(), Error> {
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    create_folder(folder).map_err(RunError::from)?;
    let commands = command.get_subcommands().filter(|sub| !sub.is_hide_set());
    for command in commands.chain([&command]) {
        let page = clap_mangen::Man::new(command.clone());
        let mut text = Vec::new();
        page.render(&mut text).map_err(Error::Print)?;
        write_file(&folder.join(page.get_filename()), &text).map_err(RunError::from)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of lines of a large window. The help of the program, which has all commands and the
    /// options of all of them, is the longest.
    const MOST_LINES: usize = 48;

    fn help_of(name: &str) -> String {
        let words = ["dovetail", "help", name].map(OsString::from);
        parsed(words).unwrap_err().to_string()
    }

    fn names() -> Vec<String> {
        let command = command();
        let names = command
            .get_subcommands()
            .map(|sub| sub.get_name().to_owned());
        names.collect()
    }

    fn parses(line: &str) -> Result<Cli, clap::Error> {
        parsed(line.split_whitespace().map(OsString::from))
    }

    #[test]
    fn help_fits_a_screen() {
        let whole = parses("dovetail --help").unwrap_err().to_string();
        let pages = names()
            .into_iter()
            .map(|name| help_of(&name))
            .chain([whole]);
        for page in pages {
            assert!(page.lines().count() <= MOST_LINES, "{page}");
            let wide = page.lines().find(|line| line.chars().count() > WIDTH);
            assert_eq!(wide, None, "{page}");
        }
    }

    /// docs/command_line.md, and docs/study.md for the options of `study`.
    #[test]
    fn the_book_has_each_command_and_option() {
        let page = |name: &str| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("docs")
                .join(name);
            std::fs::read_to_string(path).unwrap()
        };
        let [pages, studies] = ["command_line.md", "study.md"].map(page);
        let command = command();
        let visible = |arg: &&Arg| !arg.is_hide_set() || arg.is_global_set();
        for sub in command.get_subcommands() {
            let name = sub.get_name();
            assert!(pages.contains(&format!("dovetail {name} ")), "{name}");
            let options = sub.get_arguments().filter(visible);
            for option in options.filter_map(Arg::get_long) {
                let word = format!("--{option}");
                let in_studies = name == "study" && studies.contains(&word);
                assert!(pages.contains(&word) || in_studies, "{name} {word}");
            }
        }
    }

    #[test]
    fn help_of_each_command_has_an_example_that_parses() {
        for name in names() {
            let page = help_of(&name);
            let (_, example) = page
                .split_once("Example")
                .unwrap_or_else(|| panic!("{page}"));
            let line = example.lines().nth(1).unwrap();
            let line = &line[line.find("dovetail").unwrap()..];
            let line = line.split([')', '>']).next().unwrap().replace('\'', "");
            assert!(line.starts_with(&format!("dovetail {name}")), "{line}");
            parses(&line).unwrap_or_else(|error| panic!("{line}: {error}"));
        }
    }

    #[test]
    fn shared_options_stand_in_the_help_of_the_program_alone() {
        let whole = parses("dovetail --help").unwrap_err().to_string();
        let command = Cli::command();
        let options: Vec<String> = shared(&command)
            .map(|arg| format!("--{} ", arg.get_long().unwrap()))
            .collect();
        assert!(options.len() >= 8);
        for option in options {
            assert!(whole.contains(option.trim()), "{option}");
            let stands = |page: &str| {
                let mut lines = page.lines().map(str::trim_start);
                lines.any(|line| line.starts_with(&option))
            };
            for name in names() {
                assert!(!stands(&help_of(&name)), "{name}: {option}");
            }
        }
    }

    #[test]
    fn an_option_without_effect_is_refused() {
        for line in [
            "dovetail new a --threads 2",
            "dovetail --out o schema",
            "dovetail man m --set a=1",
            "dovetail completions bash --no-cache",
            "dovetail groups a.inp --out b",
        ] {
            let error = parses(line).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains("leave it out"), "{error}");
        }
        for line in ["dovetail new a -q", "dovetail check a.toml --threads 2"] {
            parses(line).unwrap();
        }
    }
}
