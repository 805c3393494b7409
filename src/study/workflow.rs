//! A study as a Snakemake workflow: one rule per case, each the same command, and one that gathers.

use std::fmt::Write;
use std::path::Path;

use super::cases::Case;
use super::file::Study;
use super::folder::Settings;
use crate::error::Error;
use crate::export::write_file;

/// Exit code 3: all is written, but a case failed or did not converge, which the report says.
const TOLERANT: &str = " || [ $? -eq 3 ]";

/// Writes `folder`/Snakefile.
///
/// # Errors
/// What writing a file brings.
pub fn write(
    folder: &Path,
    study_file: &Path,
    study: &Study,
    cases: &[Case],
    overrides: &[String],
    settings: &Settings,
) -> Result<(), Error> {
    let text = snakefile(study_file, study, cases, overrides, settings);
    Ok(write_file(&folder.join("Snakefile"), text.as_bytes())?)
}

/// The text of the workflow. Paths are made absolute, so that it runs from any folder.
fn snakefile(
    study_file: &Path,
    study: &Study,
    cases: &[Case],
    overrides: &[String],
    settings: &Settings,
) -> String {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let study_file = absolute(study_file).display().to_string();
    let out = absolute(&settings.out);
    let mut common = format!(
        "{} --out {}",
        shell(&study_file),
        shell(&out.display().to_string())
    );
    for argument in overrides {
        let _ = write!(common, " --set {}", shell(argument));
    }
    for word in &settings.sharing.words {
        let _ = write!(common, " {}", shell(word));
    }
    let outcome = |case: &Case| place(&out.join("cases").join(&case.slug).join("outcome.json"));
    let mut text = format!(
        "# The study \"{name}\": made by `dovetail study --export-workflow`, run by\n\
         #\n\
         #     snakemake --cores 4                 # here; after a kill: snakemake --unlock, then --rerun-incomplete\n\
         #     snakemake --executor slurm --jobs 50 --config dovetail=/path/to/dovetail\n\
         #\n\
         # Each case is one command and one folder. A case that fails says so in its folder and in the report; it does not\n\
         # stop the others. Complete cases are not run again.\n\n\
         DOVETAIL = config.get(\"dovetail\", \"dovetail\")\n\n\n\
         rule all:\n    input:\n        {csv},\n\n\n",
        name = study.name,
        csv = place(&out.join("study.csv")),
    );
    for (i, case) in cases.iter().enumerate() {
        let command = format!(
            "{{DOVETAIL}} study {common} --case {} --threads {{threads}}{TOLERANT}",
            shell(&case.slug)
        );
        let _ = write!(
            text,
            "# {}\nrule case_{i}:\n    input:\n        {},\n    output:\n        {},\n    threads: {}\n    shell:\n        {}\n\n\n",
            case.slug,
            place(Path::new(&study_file)),
            outcome(case),
            settings.threads,
            python(&command),
        );
    }
    let outcomes: Vec<String> = cases
        .iter()
        .map(|c| format!("        {},\n", outcome(c)))
        .collect();
    let gather = format!("{{DOVETAIL}} study {common} --collect{TOLERANT}");
    let _ = write!(
        text,
        "rule collect:\n    input:\n{}    output:\n        {},\n    shell:\n        {}\n",
        outcomes.concat(),
        place(&out.join("study.csv")),
        python(&gather),
    );
    text
}

/// A path as Snakemake reads it.
fn place(path: &Path) -> String {
    python(&literal(&path.display().to_string()))
}

/// Braces that Snakemake leaves alone.
fn literal(text: &str) -> String {
    text.replace('{', "{{").replace('}', "}}")
}

/// A word for the shell, in a command of a rule.
fn shell(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/=+,:@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        literal(&format!("'{}'", word.replace('\'', "'\\''")))
    }
}

/// A Python string.
fn python(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\n' => quoted.push_str("\\n"),
            _ => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::file::Mode;
    use crate::study::folder::Sharing;

    #[test]
    fn words_are_quoted_for_shell_and_python() {
        assert_eq!(shell("response.points=5"), "response.points=5");
        assert_eq!(shell("a b"), "'a b'");
        assert_eq!(shell("it's"), "'it'\\''s'");
        assert_eq!(shell("a={ b = 1 }"), "'a={{ b = 1 }}'");
        assert_eq!(python("a \"b\" \\"), "\"a \\\"b\\\" \\\\\"");
    }

    #[test]
    fn every_case_is_a_rule_with_its_command_and_all_are_gathered() {
        let study = Study {
            name: "quick".into(),
            scene: "scene.toml".into(),
            set: vec![],
            mode: Mode::Grid,
            quantities: vec![],
            fields: false,
            knobs: vec![],
            targets: vec![],
        };
        let case = |slug: &str| Case {
            slug: slug.into(),
            values: vec![],
        };
        let settings = Settings {
            out: "/tmp/o".into(),
            threads: 2,
            sharing: Sharing {
                own_folder: true,
                words: vec!["--cache-limit-gib".into(), "2".into()],
            },
        };
        let cases = [case("base"), case("h_5")];
        let set = ["contact.*.friction=0.1".to_owned()];
        let text = snakefile(Path::new("/s/quick.toml"), &study, &cases, &set, &settings);
        for slug in ["base", "h_5"] {
            let command = format!(
                "\"{{DOVETAIL}} study /s/quick.toml --out /tmp/o --set 'contact.*.friction=0.1' --cache-limit-gib 2 --case {slug} --threads {{threads}} || [ $? -eq 3 ]\""
            );
            assert_eq!(text.matches(&command).count(), 1, "{text}");
            let outcome = format!("\"/tmp/o/cases/{slug}/outcome.json\",");
            assert_eq!(text.matches(&outcome).count(), 2, "{text}");
        }
        assert_eq!(text.matches("--collect ||").count(), 1);
        assert_eq!(text.matches("threads: 2").count(), 2);
    }
}
