//! Content of a Gmsh script, read without running it: its words, and the parameters that a caller
//! may set.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use dovetail_superelement::input;

/// Token of a script; comments and blanks are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Token<'t> {
    /// Name or number.
    Word(&'t str),
    /// Text between quotation marks of either kind.
    Text(&'t str),
    Sign(char),
}

pub(super) fn is_in_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let after = &rest[first.len_utf8()..];
        rest = match first {
            '/' if after.starts_with('/') => after.find('\n').map_or("", |end| &after[end..]),
            '/' if after.starts_with('*') => {
                after[1..].find("*/").map_or("", |end| &after[end + 3..])
            }
            '"' | '\'' => {
                let end = after.find(first).unwrap_or(after.len());
                tokens.push(Token::Text(&after[..end]));
                after.get(end + 1..).unwrap_or("")
            }
            c if is_in_word(c) => {
                let end = rest.find(|c| !is_in_word(c)).unwrap_or(rest.len());
                tokens.push(Token::Word(&rest[..end]));
                &rest[end..]
            }
            c => {
                if !c.is_whitespace() {
                    tokens.push(Token::Sign(c));
                }
                after
            }
        };
    }
    tokens
}

/// Definitions of a script and of the files that it includes.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Definitions {
    /// Constants to which a caller may give another value, in the order of the text: those of
    /// `DefineConstant[ .. ]`, and those that the script tests with `Exists(name)`.
    pub parameters: Vec<String>,
    /// Names `a_` of constants `a~{i}` that the script defines, which gmsh calls `a_1`, `a_2` and
    /// so on.
    indexed: Vec<String>,
    /// Options that the script itself sets, such as `Mesh.Algorithm`.
    options: BTreeSet<String>,
}

impl Definitions {
    /// Definitions of a script and of all files that it includes by a literal name.
    pub(super) fn open(script: &Path) -> io::Result<Self> {
        let mut definitions = Self::default();
        let mut waiting = vec![script.to_path_buf()];
        let mut seen = BTreeSet::new();
        while let Some(path) = waiting.pop() {
            let bytes = match input::short_bytes(&path) {
                Ok(bytes) => bytes,
                Err(error) if seen.is_empty() => return Err(error),
                // gmsh tells it.
                Err(_) => continue,
            };
            if !seen.insert(path.canonicalize().unwrap_or_else(|_| path.clone())) {
                continue;
            }
            let text = String::from_utf8_lossy(&bytes);
            let tokens = tokens(&text);
            definitions.read(&tokens);
            let folder = path.parent().unwrap_or(Path::new(""));
            waiting.extend(included(&tokens).map(|name| folder.join(name)));
        }
        Ok(definitions)
    }

    pub(super) fn has_parameter(&self, name: &str) -> bool {
        let has_index = |prefix: &String| {
            let index = name.strip_prefix(prefix.as_str()).unwrap_or_default();
            !index.is_empty() && index.chars().all(|c| c.is_ascii_digit() || c == '_')
        };
        self.parameters.iter().any(|p| p == name) || self.indexed.iter().any(has_index)
    }

    pub(super) fn sets_option(&self, name: &str) -> bool {
        self.options.contains(name)
    }

    fn read(&mut self, tokens: &[Token]) {
        use Token::{Sign, Word};
        for (at, token) in tokens.iter().enumerate() {
            let after = &tokens[at + 1..];
            match (token, after) {
                (Word("DefineConstant"), [Sign('['), entries @ ..]) => self.read_entries(entries),
                (Word("Exists"), [Sign('('), name @ ..]) => self.add(name),
                (
                    Word(category),
                    [
                        Sign('.'),
                        Word(option),
                        Sign('='),
                        Word(_) | Token::Text(_) | Sign('-' | '+' | '(' | '!' | '{' | '#' | '.'),
                        ..,
                    ],
                ) => {
                    self.options.insert(format!("{category}.{option}"));
                }
                _ => {}
            }
        }
    }

    /// Reads the names of `DefineConstant[ a, b = 1, c = {2, Choices{0, 1, 2}}, d~{1} = 3 ]`, after
    /// the first bracket.
    fn read_entries(&mut self, entries: &[Token]) {
        let mut depth = 0;
        self.add(entries);
        for (at, token) in entries.iter().enumerate() {
            match token {
                Token::Sign('[' | '(' | '{') => depth += 1,
                Token::Sign(']') if depth == 0 => return,
                Token::Sign(']' | ')' | '}') => depth -= 1,
                Token::Sign(',') if depth == 0 => self.add(&entries[at + 1..]),
                _ => {}
            }
        }
    }

    /// Adds the name at the beginning.
    fn add(&mut self, tokens: &[Token]) {
        let (name, is_indexed) = match tokens {
            [Token::Word(name), Token::Sign('~'), ..] => (format!("{name}_"), true),
            [Token::Word(name), ..] => ((*name).to_owned(), false),
            _ => return,
        };
        let names = if is_indexed {
            &mut self.indexed
        } else {
            &mut self.parameters
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
}

/// Scripts that are included by a literal name.
fn included<'t>(tokens: &'t [Token<'t>]) -> impl Iterator<Item = PathBuf> + 't {
    tokens.windows(2).filter_map(|pair| match pair {
        [Token::Word("Include"), Token::Text(name)] => Some(PathBuf::from(name)),
        [Token::Word("Merge"), Token::Text(name)] => {
            let is_script = Path::new(name).extension().is_some_and(|e| e == "geo");
            is_script.then(|| PathBuf::from(name))
        }
        _ => None,
    })
}

/// Returns `true` if a name has the form of gmsh's own options: `Mesh.Algorithm`.
pub(super) fn is_option(name: &str) -> bool {
    let is_part = |part: &str| {
        part.starts_with(|c: char| c.is_ascii_uppercase())
            && part.chars().all(|c| c.is_ascii_alphanumeric())
    };
    name.split_once('.')
        .is_some_and(|(category, option)| is_part(category) && is_part(option))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_left_out_and_quotation_marks_hold() {
        use Token::{Sign, Text, Word};
        let text = "a = 'x//y'; // b\n/* c \" */ d(\"/*\") / e";
        let expected = [
            Word("a"),
            Sign('='),
            Text("x//y"),
            Sign(';'),
            Word("d"),
            Sign('('),
            Text("/*"),
            Sign(')'),
            Sign('/'),
            Word("e"),
        ];
        assert_eq!(tokens(text), expected);
        for unfinished in ["a /* b", "a // b", "a 'b", "a \"", "a /*/"] {
            assert_eq!(tokens(unfinished)[0], Word("a"), "{unfinished}");
        }
    }

    #[test]
    fn parameters_are_those_a_script_lets_others_set() {
        let folder = std::env::temp_dir().join(format!("dovetail-script-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("parts")).unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        write(
            "a.geo",
            "Include \"parts/b.geo\"; Include 'absent.geo'; Include StrCat('x', '.geo');
            DefineConstant[ nu = 4, /* old = 1 */ nv = {9, Choices{0, 1=\"many, or\"}, Name \"Mesh/nv]\"}, w ];
            DefineConstant[ r~{1} = a[0], s = Sqrt(2) ];
            If(!Exists(height)) height = 1; EndIf
            length = 5; Point(1) = {0, 0, 0, nu};
            If(Mesh.Algorithm == 5) Mesh.Optimize = 1; Mesh.Smoothing = -1; EndIf",
        );
        write(
            "parts/b.geo",
            "DefineConstant[ deep = 1 ]; Merge \"c.geo\";",
        );
        write(
            "parts/c.geo",
            "Include \"../a.geo\"; DefineConstant[ deeper = 1 ];",
        );
        let found = Definitions::open(&folder.join("a.geo")).unwrap();
        let expected = ["nu", "nv", "w", "s", "height", "deep", "deeper"];
        assert_eq!(found.parameters, expected);
        for name in expected.into_iter().chain(["r_1", "r_22"]) {
            assert!(found.has_parameter(name), "{name}");
        }
        for name in [
            "old", "length", "Point", "r", "r_", "r_x", "0", "Mesh/nv", "-nu",
        ] {
            assert!(!found.has_parameter(name), "{name}");
        }
        assert!(found.sets_option("Mesh.Optimize") && found.sets_option("Mesh.Smoothing"));
        assert!(!found.sets_option("Mesh.Algorithm"));
        assert!(Definitions::open(&folder.join("absent.geo")).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn options_have_a_category() {
        for name in [
            "Mesh.Algorithm",
            "Geometry.OCCFixDegenerated",
            "Mesh.MaxNumThreads3D",
        ] {
            assert!(is_option(name), "{name}");
        }
        for name in [
            "nu",
            "a.b",
            "Mesh",
            "Mesh.",
            ".A",
            "View[0].Visible",
            "Mesh/A.B",
            "A.B; C.D",
        ] {
            assert!(!is_option(name), "{name}");
        }
    }
}
