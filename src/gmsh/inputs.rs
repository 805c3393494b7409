//! Inputs of a mesh made by gmsh besides the command line. A mesh kept from an earlier run is used
//! again only if gmsh would make the same.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::script::{Token, is_in_word, tokens};
use dovetail_superelement::input;

/// Words of Gmsh's language by which a script reads data from outside, or differs from run to run.
const REACH_OUT: [&str; 24] = [
    "Include",
    "Merge",
    "MergeWithBoundingBox",
    "ShapeFromFile",
    "Open",
    "OpenProject",
    "SystemCall",
    "NonBlockingSystemCall",
    "GetEnv",
    "GetString",
    "GetNumber",
    "FileExists",
    "CurrentDir",
    "CurrentDirectory",
    "CurrentFileName",
    "AbsolutePath",
    "Rand",
    "Today",
    "Cpu",
    "Memory",
    "TotalMemory",
    "OnelabAction",
    "OnelabRun",
    "Plugin",
];

/// Bytes of a script and of each file of settings that gmsh reads with it.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ScriptInputs {
    script: Vec<u8>,
    settings: Vec<Option<Vec<u8>>>,
}

/// Inputs of a script; `None` if the script reads data from outside, or if a file cannot be read.
pub fn inputs(script: &Path) -> Option<ScriptInputs> {
    let bytes = input::short_bytes(script).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let reaches_out = |token: &Token| match token {
        Token::Word(word) => REACH_OUT.contains(word),
        // A text may be a command.
        Token::Text(text) => text
            .split(|c| !is_in_word(c))
            .any(|word| REACH_OUT.contains(&word)),
        Token::Sign(_) => false,
    };
    if tokens(&text).iter().any(reaches_out) {
        return None;
    }
    let mut settings = Vec::new();
    for path in settings_files(script) {
        let content = match input::short_bytes(&path) {
            Ok(bytes) => Some(bytes),
            Err(e) if e.kind() == ErrorKind::NotFound => None,
            Err(_) => return None,
        };
        settings.push(content);
    }
    Some(ScriptInputs {
        script: bytes,
        settings,
    })
}

/// Files of settings: `<script>.opt`, and two files in the home folder as gmsh determines it.
fn settings_files(script: &Path) -> Vec<PathBuf> {
    let mut beside = script.as_os_str().to_owned();
    beside.push(".opt");
    let home = ["GMSH_HOME", "HOME", "TMP", "TEMP"]
        .into_iter()
        .find_map(std::env::var_os);
    let in_home = home
        .into_iter()
        .flat_map(|home| [".gmshrc", ".gmsh-options"].map(|name| Path::new(&home).join(name)));
    std::iter::once(beside.into()).chain(in_home).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_that_reaches_out_is_not_known_by_its_bytes() {
        let name = format!("dovetail-inputs-{}.geo", std::process::id());
        let script = std::env::temp_dir().join(name);
        let of = |text: &str| {
            std::fs::write(&script, text).unwrap();
            inputs(&script)
        };
        let plain = of("// Include 'a.geo';\nnu = 4; /* Rand(1) */ Mesh 3;").unwrap();
        assert_ne!(plain, of("nu = 4; Mesh 3;").unwrap());
        for reaching in [
            "Include \"a.geo\";",
            "Merge 'part.step';",
            "x = Rand(2);",
            "s = GetEnv('HOME');",
            "Printf('//'); Include \"a.geo\";",
        ] {
            assert_eq!(of(reaching), None, "{reaching}");
        }
        let beside = script.with_extension("geo.opt");
        std::fs::write(&beside, "Mesh.Algorithm = 5;").unwrap();
        let with_options = of("nu = 4; Mesh 3;");
        std::fs::remove_file(&beside).unwrap();
        assert_ne!(with_options, of("nu = 4; Mesh 3;"));
        std::fs::remove_file(&script).unwrap();
        assert_eq!(inputs(&script), None);
    }
}
