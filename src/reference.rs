//! Makes the tables of keys in docs/scene.md and docs/study.md, as Markdown.

use crate::scene::entries::SCENE;
use crate::scene::keys::{SceneSection, SectionShape, Vocabulary};
use crate::study_file::keys::STUDY;

/// Tables of scene files: the name of each section (`top` for the top of the file, `sections` for
/// the list of them) and its table.
pub fn scene_tables() -> Vec<(&'static str, String)> {
    tables(&SCENE)
}

/// Tables of study files, with names as in [`scene_tables`].
pub fn study_tables() -> Vec<(&'static str, String)> {
    tables(&STUDY)
}

fn tables(vocabulary: &Vocabulary) -> Vec<(&'static str, String)> {
    let of_keys = vocabulary.sections.iter().map(|section| {
        let name = if section.name.is_empty() {
            "top"
        } else {
            section.name
        };
        (name, keys(section))
    });
    std::iter::once(("sections", sections(vocabulary)))
        .chain(of_keys)
        .collect()
}

fn sections(vocabulary: &Vocabulary) -> String {
    let named = vocabulary.sections.iter().filter(|s| !s.name.is_empty());
    let rows = named.map(|s| {
        let heading = match s.shape {
            SectionShape::Table => format!("[{}]", s.name),
            SectionShape::List => format!("[[{}]]", s.name),
        };
        format!("| `{heading}` | {} | {} |\n", s.needed, s.what)
    });
    format!(
        "| section | how many | what it describes |\n| --- | --- | --- |\n{}",
        rows.collect::<String>()
    )
}

fn keys(section: &SceneSection) -> String {
    let rows = section.keys.iter().map(|k| {
        format!(
            "| `{}` | {} | {} | {} |\n",
            k.name,
            k.kind,
            k.default,
            k.limits_and_meaning()
        )
    });
    format!(
        "| key | type, unit | default | valid values and meaning |\n| --- | --- | --- | --- |\n{}",
        rows.collect::<String>()
    )
}

#[cfg(test)]
mod tests {
    use std::fmt::Debug;

    use serde::de::DeserializeOwned;

    use super::*;
    use crate::scene::entries::RawScene;
    use crate::study_file::keys::RawStudy;

    fn all_sections() -> impl Iterator<Item = (&'static Vocabulary, &'static SceneSection)> {
        [&SCENE, &STUDY]
            .into_iter()
            .flat_map(|v| v.sections.iter().map(move |s| (v, s)))
    }

    /// Names of the fields of a mirror, which serde lists where it meets another.
    fn fields<T: DeserializeOwned + Debug>() -> Vec<String> {
        let error = toml::from_str::<T>("no_such_key = 1").unwrap_err();
        let words = error.message().split('`').map(str::to_owned);
        words.skip(3).step_by(2).collect()
    }

    #[test]
    fn the_mirror_of_a_file_has_the_keys_and_sections_of_its_vocabulary() {
        assert_eq!(fields::<RawScene>(), SCENE.keys_of(""));
        assert_eq!(fields::<RawStudy>(), STUDY.keys_of(""));
        for (_, section) in all_sections() {
            assert!(!section.keys.is_empty(), "{:?}", section.name);
        }
    }

    #[test]
    fn every_entry_says_everything_and_its_example_sets_the_key() {
        for (_, section) in all_sections() {
            let of_section = (!section.name.is_empty()).then_some((section.name, section.example));
            let of_keys = section.keys.iter().map(|k| (k.name, k.example));
            for (key, line) in of_section.into_iter().chain(of_keys) {
                let table: toml::Table = line.parse().unwrap_or_else(|e| panic!("{line}: {e}"));
                let mut words = key.split('.');
                let value = words.next().and_then(|word| table.get(word));
                let value = words.fold(value, |value, word| value?.get(word));
                assert!(value.is_some(), "{}.{key}: {line:?}", section.name);
            }
            for key in section.keys {
                let default = key.default.to_string();
                let texts = [&key.kind.to_string(), &default, key.meaning];
                assert!(
                    texts
                        .iter()
                        .all(|t| !t.is_empty() && !t.contains(['|', '\n'])),
                    "{}",
                    key.name
                );
            }
        }
    }
}
