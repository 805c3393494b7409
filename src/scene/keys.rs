//! Keys of a kind of file, as data: [`Vocabulary`], [`SceneSection`] and [`Key`]. The keys of
//! scenes are listed in [`super::entries`].

use std::fmt;

use super::kinds::{Short, ValueKind};

/// Form of a section: `[section]` or, once per item, `[[section]]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SectionShape {
    Table,
    List,
}

/// What applies without a key.
#[derive(Debug, Clone, Copy)]
pub enum Default {
    /// Default as it would be written, or what applies in words. It is "-" if the key is required,
    /// and "- or" with others if one of several keys is required.
    Words(&'static str),
    /// Number of the library.
    Number(f64),
}

impl fmt::Display for Default {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Words(words) => f.write_str(words),
            Self::Number(number) => Short(*number).fmt(f),
        }
    }
}

/// [`Default`] of a key: words, or a number of the library in parentheses.
macro_rules! default_of {
    ($words:literal) => {
        $crate::scene::keys::Default::Words($words)
    };
    (($number:expr)) => {
        $crate::scene::keys::Default::Number($number as f64)
    };
}
pub(crate) use default_of;

/// Key of a section.
#[derive(Debug)]
pub struct Key {
    pub name: &'static str,
    /// Type, unit and limits of its value.
    pub kind: ValueKind,
    pub default: Default,
    /// Choices, then the effect; Markdown. The limits of numbers are those of `kind`.
    pub meaning: &'static str,
    /// Example line of a file.
    pub example: &'static str,
}

impl Key {
    /// Returns `true` if a file without the key, and without `--set`, is refused whatever its other
    /// keys are.
    pub fn is_required(&self) -> bool {
        matches!(self.default, Default::Words("-"))
    }

    /// Default as a value, if it is one.
    pub fn default_value(&self) -> Option<toml::Value> {
        let line = format!("v = {}", self.default.to_string().trim_matches('`'));
        line.parse::<toml::Table>().ok()?.remove("v")
    }

    /// Limits of the value, then the effect.
    pub fn limits_and_meaning(&self) -> String {
        let limits = self.kind.limits();
        let parts = limits.iter().map(String::as_str).chain([self.meaning]);
        let parts: Vec<&str> = parts.filter(|part| !part.is_empty()).collect();
        parts.join("; ")
    }
}

/// Table of the file, or its top.
#[derive(Debug)]
pub struct SceneSection {
    /// Name; empty for the top of the file. One inside of another has the name of that one before a
    /// dot.
    pub name: &'static str,
    pub shape: SectionShape,
    /// Required number of these sections.
    pub needed: &'static str,
    pub what: &'static str,
    /// First lines of an example.
    pub example: &'static str,
    /// Keys, without the sections inside.
    pub keys: &'static [Key],
}

impl SceneSection {
    /// Name of the section that this one is inside of, empty for the top of the file, and its own
    /// last word.
    pub fn place(&self) -> (&'static str, &'static str) {
        self.name.rsplit_once('.').unwrap_or(("", self.name))
    }
}

/// Keys of a kind of file.
#[derive(Debug)]
pub struct Vocabulary {
    /// The top of the file, then its tables in the order in which they are usually written.
    pub sections: &'static [SceneSection],
    /// Renamed keys of earlier versions of the program: section, key, and the key in its place.
    pub former: &'static [(&'static str, &'static str, &'static str)],
}

impl Vocabulary {
    pub fn section(&self, name: &str) -> Option<&'static SceneSection> {
        self.sections.iter().find(|s| s.name == name)
    }

    /// Declaration of a key.
    pub fn key(&self, section: &str, key: &str) -> Option<&'static Key> {
        self.section(section)?.keys.iter().find(|k| k.name == key)
    }

    /// Sections inside of a section, or at the top of the file.
    pub fn sections_in(&self, section: &str) -> impl Iterator<Item = &'static SceneSection> {
        let named = self.sections.iter().filter(|s| !s.name.is_empty());
        named.filter(move |s| s.place().0 == section)
    }

    /// Keys that a section accepts, and the sections inside of it; empty if there is no such
    /// section.
    pub fn keys_of(&self, section: &str) -> Vec<&'static str> {
        let keys = self.section(section).map_or(&[][..], |s| s.keys);
        let sections = self.sections_in(section).map(|s| s.place().1);
        keys.iter().map(|key| key.name).chain(sections).collect()
    }

    /// Key that an unknown key of a section most likely means: its replacement, else the nearest
    /// word.
    pub fn suggestion(&self, section: &str, key: &str) -> Option<String> {
        let former = self.former.iter();
        let now = former
            .filter(|(s, k, _)| *s == section && *k == key)
            .map(|(_, _, now)| (*now).to_owned())
            .next();
        now.or_else(|| nearest(key, &self.keys_of(section)))
    }

    /// Example line of a file, for messages; the example of a section is its first lines.
    pub fn example(&self, section: &str, key: &str) -> &'static str {
        let of_section = self.section(section);
        let own_key = of_section.and_then(|s| s.keys.iter().find(|k| k.name == key));
        match own_key {
            Some(own_key) => own_key.example,
            None => {
                let mut inside = self.sections_in(section);
                inside
                    .find(|s| s.place().1 == key)
                    .map_or("", |s| s.example)
            }
        }
    }
}

/// Word of `valid` that `word` most likely means: at most a third of its letters differ
/// (Damerau-Levenshtein distance), or one is the other with something appended.
pub fn nearest<S: AsRef<str>>(word: &str, valid: &[S]) -> Option<String> {
    // The distance is quadratic in the length: a key of the file can be of any length, a near one
    // cannot.
    let start = |word: &str| word.chars().take(64).collect::<String>();
    let lower = word.to_lowercase();
    let appended = |v: &str| {
        v.len() >= 3 && lower.len() >= 3 && (v.starts_with(&lower) || lower.starts_with(v))
    };
    valid
        .iter()
        .map(|v| v.as_ref())
        .map(|v| {
            let (word, valid) = (start(&lower), start(&v.to_lowercase()));
            (strsim::osa_distance(&word, &valid), v)
        })
        .filter(|(d, v)| 3 * d <= v.chars().count().max(3) || appended(v))
        .min_by_key(|(d, _)| *d)
        .map(|(_, v)| v.to_owned())
}

/// Declares a section of a file: its name, [`SectionShape`], needed number, meaning and example,
/// then its keys, each with its [`ValueKind`], [`Default`], meaning and the value of its example.
/// Defines the section and its mirror, into which serde reads the keys: every one is optional, and
/// no other key is accepted. Fields of the mirror that are sections themselves stand behind `and`.
macro_rules! section {
    ($section:ident: $mirror:ident, $title:literal, $shape:ident, $needed:literal,
     $what:literal, $example:literal {
        $($key:ident: $kind:ident $(($($of:tt)*))?, $default:tt,
            $meaning:literal,
            $value:literal;)*
    } $(and { $($sections:tt)* })?) => {
        #[derive(Debug, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $mirror {
            $(pub $key: $crate::scene::raw::Located<
                $crate::scene::kinds::mirror!($kind $(($($of)*))?)
            >,)*
            $($($sections)*)?
        }

        const $section: $crate::scene::keys::SceneSection = $crate::scene::keys::SceneSection {
            name: $title,
            shape: $crate::scene::keys::SectionShape::$shape,
            needed: $needed,
            what: $what,
            example: $example,
            keys: &[$($crate::scene::keys::Key {
                name: stringify!($key),
                kind: $crate::scene::kinds::ValueKind::$kind $(($($of)*))?,
                default: $crate::scene::keys::default_of!($default),
                meaning: $meaning,
                example: concat!(stringify!($key), " = ", $value),
            },)*],
        };
    };
}
pub(crate) use section;

/// Returns `true` if the values of a key of a scene have errors: a setting of the solution, or of
/// the mesh. The others say what is built and what acts on it.
pub fn is_setting(key: &str) -> bool {
    let mut words = key.split('.').map(str::trim);
    let section = words.next().unwrap_or_default();
    let key = words.next().unwrap_or_default();
    let last = words.next_back().unwrap_or(key);
    let of_solution = matches!(section, "mesh" | "response" | "static");
    // By which way the load came is no matter of the solution.
    (of_solution && (section, key) != ("static", "path")) || last.ends_with("_modes")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::entries::SCENE;

    #[test]
    fn a_key_is_a_setting_or_physical() {
        for key in [
            "mesh.parameters.nu",
            "mesh.file",
            "response.harmonics",
            " response .points",
            "static.load_steps",
            "body.*.fixed_interface_modes",
        ] {
            assert!(is_setting(key), "{key}");
        }
        for key in [
            "contact.*.friction",
            "damping.ratio",
            "body.blade.young_pa",
            "reduced_model.force_n",
            "rotation.speed_rpm",
            "static.path.0.speed_rpm",
            "static.path",
            " load.0.force_n",
        ] {
            assert!(!is_setting(key), "{key}");
        }
    }

    #[test]
    fn near_words_are_found_and_far_ones_are_not() {
        let keys = &SCENE.keys_of("response");
        assert_eq!(nearest("pionts", keys).as_deref(), Some("points"));
        assert_eq!(nearest("Harmonic", keys).as_deref(), Some("harmonics"));
        assert_eq!(nearest("frequency", keys).as_deref(), Some("frequency_hz"));
        assert_eq!(nearest("colour", keys), None);
        let long = "x".repeat(1_000_000);
        assert_eq!(nearest(&long, keys), None);
    }
}
