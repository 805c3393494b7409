//! Keys of a kind of file, as data: [`Vocabulary`], [`Section`] and [`Key`]. The keys of scenes are
//! listed in [`super::entries`].

use serde::de::{self, Deserialize, Deserializer, Visitor};

use super::kinds::Kind;

/// Form of a section: `[section]` or, once per item, `[[section]]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Table,
    List,
}

/// Key of a section.
#[derive(Debug)]
pub struct Key {
    pub name: &'static str,
    /// Type, unit and limits of its value.
    pub kind: Kind,
    /// Default as it would be written, or what applies without the key. It is "-" if the key is
    /// required, and "- or" with others if one of several keys is required.
    pub default: &'static str,
    /// Choices, then the effect; Markdown. The limits of numbers are those of `kind`.
    pub meaning: &'static str,
    /// Example line of a file.
    pub example: &'static str,
}

pub const fn key(
    name: &'static str,
    kind: Kind,
    default: &'static str,
    meaning: &'static str,
    example: &'static str,
) -> Key {
    Key {
        name,
        kind,
        default,
        meaning,
        example,
    }
}

impl Key {
    /// Returns `true` if a file without the key, and without `--set`, is refused whatever its other
    /// keys are.
    pub fn is_required(&self) -> bool {
        self.default == "-"
    }

    /// Default as a value, if it is written as one.
    pub fn default_value(&self) -> Option<toml::Value> {
        let line = format!("v = {}", self.default.trim_matches('`'));
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
pub struct Section {
    /// Name; empty for the top of the file.
    pub name: &'static str,
    pub shape: Shape,
    /// Required number of these sections.
    pub needed: &'static str,
    pub what: &'static str,
    /// First lines of an example.
    pub example: &'static str,
    /// Names of the keys that the mirror reads.
    pub fields: fn() -> &'static [&'static str],
    /// Keys in the order of the mirror; for the top of the file, without the sections.
    pub keys: &'static [Key],
}

/// Keys of a kind of file.
#[derive(Debug)]
pub struct Vocabulary {
    /// The top of the file, then its tables in the order in which they are usually written.
    pub sections: &'static [Section],
    /// Renamed keys of earlier versions of the program: section, key, and the key in its place.
    pub former: &'static [(&'static str, &'static str, &'static str)],
}

impl Vocabulary {
    pub fn section(&self, name: &str) -> Option<&'static Section> {
        self.sections.iter().find(|s| s.name == name)
    }

    /// Declaration of a key.
    pub fn key(&self, section: &str, key: &str) -> Option<&'static Key> {
        self.section(section)?.keys.iter().find(|k| k.name == key)
    }

    /// Keys that a section accepts; empty if there is no such section.
    pub fn keys_of(&self, section: &str) -> &'static [&'static str] {
        self.section(section).map_or(&[], |s| (s.fields)())
    }

    /// Key that an unknown key of a section most likely means: its replacement, else the nearest
    /// word.
    pub fn meant_by(&self, section: &str, key: &str) -> Option<String> {
        let former = self.former.iter();
        let now = former
            .filter(|(s, k, _)| *s == section && *k == key)
            .map(|(_, _, now)| (*now).to_owned())
            .next();
        now.or_else(|| nearest(key, self.keys_of(section)))
    }

    /// Example line of a file, for messages; the example of a section is its first lines.
    pub fn example(&self, section: &str, key: &str) -> &'static str {
        let of_section = self.section(section);
        let own = of_section.and_then(|s| s.keys.iter().find(|k| k.name == key));
        match own {
            Some(own) => own.example,
            None => self.section(key).map_or("", |s| s.example),
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

/// Names of the fields of `T` from serde's derive, so that they are written only once.
pub fn fields<'de, T: Deserialize<'de>>() -> &'static [&'static str] {
    match T::deserialize(FieldsOnly) {
        Err(Fields(names)) => names,
        Ok(_) => &[],
    }
}

struct FieldsOnly;

#[derive(Debug)]
struct Fields(&'static [&'static str]);

impl std::fmt::Display for Fields {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}

impl std::error::Error for Fields {}

impl de::Error for Fields {
    fn custom<M: std::fmt::Display>(_: M) -> Self {
        Fields(&[])
    }
}

impl<'de> Deserializer<'de> for FieldsOnly {
    type Error = Fields;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Fields> {
        Err(Fields(&[]))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Fields> {
        Err(Fields(names))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option
        unit unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::entries::SCENE;

    #[test]
    fn near_words_are_found_and_far_ones_are_not() {
        let keys = SCENE.keys_of("response");
        assert_eq!(nearest("pionts", keys).as_deref(), Some("points"));
        assert_eq!(nearest("Harmonic", keys).as_deref(), Some("harmonics"));
        assert_eq!(nearest("frequency", keys).as_deref(), Some("frequency_hz"));
        assert_eq!(nearest("colour", keys), None);
        let long = "x".repeat(1_000_000);
        assert_eq!(nearest(&long, keys), None);
    }
}
