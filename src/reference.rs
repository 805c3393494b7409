//! Makes the tables of keys in docs/scene.md and docs/study.md, as Markdown.

use crate::scene::entries::SCENE;
use crate::scene::keys::{Section, Shape, Vocabulary};
use crate::study::keys::STUDY;

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
            Shape::Table => format!("[{}]", s.name),
            Shape::List => format!("[[{}]]", s.name),
        };
        format!("| `{heading}` | {} | {} |\n", s.needed, s.what)
    });
    format!(
        "| section | how many | what it describes |\n| --- | --- | --- |\n{}",
        rows.collect::<String>()
    )
}

fn keys(section: &Section) -> String {
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
    use super::*;
    use crate::scene::keys::Section;

    fn all_sections() -> impl Iterator<Item = (&'static Vocabulary, &'static Section)> {
        [&SCENE, &STUDY]
            .into_iter()
            .flat_map(|v| v.sections.iter().map(move |s| (v, s)))
    }

    #[test]
    fn every_field_of_the_mirror_has_an_entry_and_no_entry_is_without_a_field() {
        for (vocabulary, section) in all_sections() {
            let fields = (section.fields)().iter().copied();
            let of_keys: Vec<&str> = match section.name {
                "" => fields.filter(|f| vocabulary.section(f).is_none()).collect(),
                _ => fields.collect(),
            };
            assert!(!of_keys.is_empty(), "{:?}", section.name);
            let entries: Vec<&str> = section.keys.iter().map(|k| k.name).collect();
            assert_eq!(entries, of_keys, "{:?}", section.name);
        }
        for vocabulary in [&SCENE, &STUDY] {
            let top = vocabulary.keys_of("");
            let named = vocabulary.sections.iter().filter(|s| !s.name.is_empty());
            assert!(named.into_iter().all(|s| top.contains(&s.name)));
        }
    }

    #[test]
    fn every_entry_says_everything_and_its_example_sets_the_key() {
        for (_, section) in all_sections() {
            let of_section = (!section.name.is_empty()).then_some((section.name, section.example));
            let of_keys = section.keys.iter().map(|k| (k.name, k.example));
            for (key, line) in of_section.into_iter().chain(of_keys) {
                let table: toml::Table = line.parse().unwrap_or_else(|e| panic!("{line}: {e}"));
                assert!(table.contains_key(key), "{}.{key}: {line:?}", section.name);
            }
            for key in section.keys {
                let texts = [&key.kind.to_string(), key.default, key.meaning];
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
