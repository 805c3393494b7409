//! Makes JSON schemas of scene and study files from the entries of their keys, for editors that
//! complete and check keys. The checks of [`crate::scene`] and [`crate::study`] are authoritative:
//! a schema covers single values, but not how they depend on each other.

use serde_json::{Map, Value, json};

use crate::scene::entries::SCENE;
use crate::scene::keys::{Key, SceneSection, SectionShape, Vocabulary};
use crate::scene::kinds::{Limits, ValueKind};
use crate::study_file::keys::STUDY;

/// Schema of scene files.
pub fn scene() -> Value {
    schema(&SCENE, "scene of dovetail", "docs/scene.md")
}

/// Schema of study files.
pub fn study() -> Value {
    schema(&STUDY, "study of dovetail", "docs/study.md")
}

/// Draft of JSON schema that editors of TOML accept.
const DRAFT: &str = "http://json-schema.org/draft-07/schema#";

fn schema(vocabulary: &Vocabulary, title: &str, page: &str) -> Value {
    let top = vocabulary.section("").map_or(&[][..], |top| top.keys);
    let properties = properties(vocabulary, "", top);
    let needed = vocabulary.sections_in("");
    let needed = needed.filter(|s| s.needed == "required").map(|s| s.name);
    let required: Vec<&str> = required(top).chain(needed).collect();
    json!({
        "$schema": DRAFT,
        "title": title,
        "description": format!("All keys are described in {page}."),
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

fn required(keys: &'static [Key]) -> impl Iterator<Item = &'static str> {
    keys.iter().filter(|k| k.is_required()).map(|k| k.name)
}

/// Schemas of the keys of a section and of the sections inside of it.
fn properties(vocabulary: &Vocabulary, name: &str, keys: &'static [Key]) -> Map<String, Value> {
    let keys = keys.iter().map(|k| (k.name.to_owned(), value(k)));
    let inside = vocabulary.sections_in(name);
    let inside = inside.map(|s| (s.place().1.to_owned(), section(vocabulary, s)));
    keys.chain(inside).collect()
}

fn section(vocabulary: &Vocabulary, section: &SceneSection) -> Value {
    let properties = properties(vocabulary, section.name, section.keys);
    let table = json!({
        "type": "object",
        "properties": properties,
        "required": required(section.keys).collect::<Vec<_>>(),
        "additionalProperties": false,
    });
    let description = format!("{} ({})", section.what, section.needed.replace('`', ""));
    match section.shape {
        SectionShape::Table => extend_schema(table, [("description", description.into())]),
        SectionShape::List => {
            json!({ "type": "array", "items": table, "description": description })
        }
    }
}

/// Schema of the value of a key.
fn value(key: &Key) -> Value {
    let mut about = vec![("description", description(key).into())];
    if let Some(default) = key.default_value() {
        about.extend(serde_json::to_value(default).ok().map(|v| ("default", v)));
    }
    extend_schema(kind_schema(key.kind), about)
}

/// Type and unit, limits and meaning, and the default of a key.
fn description(key: &Key) -> String {
    let default = if key.is_required() {
        "required".to_owned()
    } else {
        let default = key.default.to_string();
        format!("default: {}", default.trim_start_matches("- "))
    };
    let parts = [
        key.kind.to_string(),
        strip_links(&key.limits_and_meaning()),
        default,
    ];
    parts.join("; ")
}

fn kind_schema(kind: ValueKind) -> Value {
    match kind {
        ValueKind::Text(_) => json!({ "type": "string" }),
        ValueKind::Name => json!({
            "type": "string",
            "pattern": "^[A-Za-z][A-Za-z0-9_-]*$",
            "maxLength": 100,
        }),
        ValueKind::Choice(words) => json!({ "type": "string", "enum": words }),
        ValueKind::Texts(_) => json!({ "type": "array", "items": { "type": "string" } }),
        ValueKind::Choices(words) => json!({
            "type": "array",
            "items": { "type": "string", "enum": words },
            "minItems": 1,
        }),
        ValueKind::Number(_, limits) => {
            extend_schema(json!({ "type": "number" }), limit_words(limits))
        }
        ValueKind::Whole(least, most) => {
            let most = most.map(|most| ("maximum", most.into()));
            let ends = [("minimum", least.unwrap_or(0).into())];
            extend_schema(json!({ "type": "integer" }), ends.into_iter().chain(most))
        }
        ValueKind::Numbers(count, _) => json!({
            "type": "array",
            "items": { "type": "number" },
            "minItems": count,
            "maxItems": count,
        }),
        ValueKind::NumberList(_, limits) => json!({
            "type": "array",
            "items": extend_schema(json!({ "type": "number" }), limit_words(limits)),
            "minItems": 1,
        }),
        ValueKind::NumberOrList(_, limits) => {
            let number = extend_schema(json!({ "type": "number" }), limit_words(limits));
            let list = json!({ "type": "array", "items": number, "minItems": 1 });
            json!({ "anyOf": [number, list] })
        }
        ValueKind::NumberTable => json!({
            "type": "object",
            "additionalProperties": { "type": "number" },
        }),
        ValueKind::Flag => json!({ "type": "boolean" }),
        ValueKind::List => json!({ "type": "array", "minItems": 1 }),
        ValueKind::Any(_) => json!({}),
    }
}

fn limit_words(limits: Limits) -> Vec<(&'static str, Value)> {
    let Limits { above, below, from } = limits;
    let least = if from { "minimum" } else { "exclusiveMinimum" };
    let ends = [(least, above), ("exclusiveMaximum", below)];
    let ends = ends.into_iter().filter(|(_, end)| end.is_finite());
    ends.map(|(word, end)| (word, end.into())).collect()
}

/// Schema with further words added.
fn extend_schema(
    mut schema: Value,
    words: impl IntoIterator<Item = (&'static str, Value)>,
) -> Value {
    if let Some(object) = schema.as_object_mut() {
        object.extend(words.into_iter().map(|(word, v)| (word.to_owned(), v)));
    }
    schema
}

/// Text with `text` in place of `[text](target)`, as an editor cannot follow links of the book.
fn strip_links(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('[') {
        let link = after.split_once("](").and_then(|(words, target)| {
            let is_link = !words.contains(']');
            is_link.then_some((words, target.split_once(')')?.1))
        });
        plain.push_str(before);
        rest = match link {
            Some((words, behind)) => {
                plain.push_str(words);
                behind
            }
            None => {
                plain.push('[');
                after
            }
        };
    }
    plain + rest
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::entries::tests::{all_keys, probes, scene_with, wrong_types};
    use crate::scene::parse;

    fn is_valid(schema: &Value, file: &toml::Table) -> bool {
        let (mut schemas, mut compiler) = (boon::Schemas::new(), boon::Compiler::new());
        compiler
            .add_resource("memory.json", schema.clone())
            .unwrap();
        let index = compiler.compile("memory.json", &mut schemas).unwrap();
        let file = serde_json::to_value(file).unwrap();
        schemas.validate(&file, index).is_ok()
    }

    /// The file with a key of a section set or removed.
    fn changed(text: &str, section: &SceneSection, key: &Key, value: Option<&str>) -> toml::Table {
        let mut file: toml::Table = text.parse().unwrap();
        let table = table_of(&mut file, section);
        if let Some(value) = value {
            let line: toml::Table = format!("v = {value}").parse().unwrap();
            table.insert(key.name.to_owned(), line["v"].clone());
        } else {
            table.remove(key.name);
        }
        file
    }

    /// The table of a section, or of the first item of a list.
    fn table_of<'a>(file: &'a mut toml::Table, section: &SceneSection) -> &'a mut toml::Table {
        let mut table = file;
        for word in section.name.split('.') {
            let inner = match &mut table[word] {
                toml::Value::Array(items) => &mut items[0],
                inner => inner,
            };
            table = inner.as_table_mut().unwrap();
        }
        table
    }

    fn program_takes(file: &toml::Table) -> bool {
        parse(&file.to_string(), "scene.toml", Path::new(""), &[]).is_ok()
    }

    #[test]
    fn what_the_program_takes_the_schema_takes() {
        let schema = scene();
        let (mut taken, mut refused) = (0, 0);
        for (section, key) in all_keys() {
            let text = scene_with(section.name, key.name);
            let (inside, outside) = probes(key.kind).unwrap_or_default();
            let words = match key.kind {
                ValueKind::Choice(words) => words.iter().map(|w| format!("\"{w}\"")).collect(),
                _ => vec![],
            };
            let wrong = wrong_types(key.kind).iter().map(|w| (*w).to_owned());
            let values: Vec<String> = inside.into_iter().chain(words).collect();
            let outside = outside.into_iter().chain(wrong);
            let example: toml::Table = key.example.parse().unwrap();
            let example = example[key.name].to_string();
            let all = values.iter().chain([&example]).map(Some).chain([None]);
            for value in all {
                let file = changed(&text, section, key, value.map(String::as_str));
                if program_takes(&file) {
                    taken += 1;
                    assert!(is_valid(&schema, &file), "{} = {value:?}", key.name);
                }
            }
            for value in outside.filter(|value| !value.contains("inf")) {
                refused += 1;
                let file = changed(&text, section, key, Some(&value));
                assert!(!is_valid(&schema, &file), "{} = {value}", key.name);
            }
            if key.is_required() {
                let file = changed(&text, section, key, None);
                assert!(!is_valid(&schema, &file), "without {}", key.name);
            }
        }
        assert!(
            taken > 130 && refused > 150,
            "{taken} taken, {refused} refused"
        );
    }

    #[test]
    fn a_key_that_is_none_is_refused() {
        for (section, key) in all_keys() {
            let mut file: toml::Table = scene_with(section.name, key.name).parse().unwrap();
            assert!(is_valid(&scene(), &file), "{}.{}", section.name, key.name);
            table_of(&mut file, section).insert(format!("{}_", key.name), 1.into());
            assert!(!is_valid(&scene(), &file), "{}.{}_", section.name, key.name);
        }
    }

    #[test]
    fn descriptions_have_no_links_and_keep_brackets() {
        let found = strip_links("`[from, to]`, see [the page](a.md#b) and [c](d.md)");
        assert_eq!(found, "`[from, to]`, see the page and c");
        let all = format!("{}{}", scene(), study());
        assert!(!all.contains("](") && all.contains("number, Pa; greater than 0; Young's modulus"));
    }
}
