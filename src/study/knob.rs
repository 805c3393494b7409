//! `[[knob]]`: what is turned, its values from coarse to fine, and how fine each is.

use std::ops::Range;

use serde_spanned::Spanned;
use toml::de::DeValue;

use super::error::StudyFault;
use super::reader::{Reader, Section, number};

const KEYS: &[&str] = &["name", "key", "values", "base", "size", "order"];
const VALUE_KEYS: &[&str] = &["label", "set", "size"];
const VALUES: &str = "values = [1, 3, 5, 7]";
const SETTINGS: &str = "values = [{ label = \"4 x 9\", set = { \"mesh.parameters.nu\" = 4, \"mesh.parameters.nv\" = 9 } }]";
const SIZE: &str = "size = \"1/value\"";
/// Most cases of a grid.
pub const MOST_CASES: usize = 10_000;

/// h of a number.
type Size = fn(f64) -> f64;
/// Sizes counted from a number.
const RULES: [(&str, Size); 4] = [
    ("value", |v| v),
    ("1/value", |v| 1.0 / v),
    ("1/(value-1)", |v| 1.0 / (v - 1.0)),
    ("1/(value+1)", |v| 1.0 / (v + 1.0)),
];

/// Something that is turned: one key of the scene or several together.
#[derive(Debug, Clone, PartialEq)]
pub struct Knob {
    pub name: String,
    /// From coarse to fine: by falling size, or as written where they have none.
    pub values: Vec<KnobValue>,
    /// Which of them stands while other knobs are turned.
    pub base: usize,
    /// Order expected of the errors in the size.
    pub order: f64,
    /// Of its table in the file.
    pub span: Range<usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct KnobValue {
    pub label: String,
    /// `KEY=VALUE` texts.
    pub set: Vec<String>,
    /// h: errors are compared with its powers.
    pub size: Option<f64>,
    pub span: Range<usize>,
}

impl Knob {
    /// Sizes of all values, where they have them.
    pub fn sizes(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|v| v.size).collect()
    }

    fn keys(&self) -> impl Iterator<Item = &str> {
        let set = self.values.iter().flat_map(|v| &v.set);
        set.map(|s| s.split('=').next().unwrap_or(s).trim())
    }
}

/// Reads one `[[knob]]`; `needs_base`: it has to say which value the other knobs are turned around.
pub fn read(reader: &mut Reader, section: &Section, needs_base: bool) -> Option<Knob> {
    reader.only(section, "[[knob]]", KEYS);
    let key = reader.text(section, "key", "key = \"response.harmonics\"");
    let name = match reader.text(section, "name", "name = \"harmonics\"") {
        Some(name) => reader.name(section.key("name"), &name),
        None => match &key {
            Some(key) => Some(last_word(key.get_ref())),
            None => {
                reader.missing(
                    section,
                    "name",
                    "name = \"flanks\"  # or key = \"response.harmonics\"",
                );
                None
            }
        },
    };
    let items = reader.list(section, "values", VALUES);
    if section.get("values").is_none() {
        reader.missing(section, "values", VALUES);
    }
    let items = items?;
    if items.is_empty() {
        let span = section.get("values").map_or(0..0, Spanned::span);
        reader.wrong_type(section.key("values"), span, "at least one value", VALUES);
        return None;
    }
    let mut values = Vec::new();
    for item in items {
        values.push(match &key {
            Some(key) => plain_value(reader, key.get_ref(), item),
            None => joint_value(reader, section, item),
        });
    }
    let values: Option<Vec<KnobValue>> = values.into_iter().collect();
    let mut values = values?;
    distinct(reader, section, &values)?;
    sizes(reader, section, items, &mut values)?;
    let base = base(reader, section, items, &values, needs_base)?;
    let order = match section.get("order") {
        None => 2.0,
        Some(value) => reader.positive(section.key("order"), value, "order = 2")?,
    };
    let base_label = values[base].label.clone();
    if values.iter().all(|v| v.size.is_some()) {
        let size = |v: &KnobValue| v.size.unwrap_or(0.0);
        values.sort_by(|a, b| size(b).total_cmp(&size(a)));
    }
    let base = values.iter().position(|v| v.label == base_label)?;
    Some(Knob {
        name: name?,
        values,
        base,
        order,
        span: section.span.clone(),
    })
}

/// What only shows when all knobs are known: names taken twice, keys set twice, grids too large.
pub fn check_together(reader: &mut Reader, knobs: &[Knob], grid: bool) {
    for (i, knob) in knobs.iter().enumerate() {
        for other in &knobs[..i] {
            if other.name == knob.name {
                let fault = StudyFault::Duplicate {
                    path: format!("knob.{i}.name"),
                    name: knob.name.clone(),
                };
                reader.fault(knob.span.clone(), fault);
            }
            if let Some(key) = knob.keys().find(|key| other.keys().any(|k| k == *key)) {
                let fault = StudyFault::SetTwice {
                    first: other.name.clone(),
                    second: knob.name.clone(),
                    key: key.to_owned(),
                };
                reader.fault(knob.span.clone(), fault);
            }
        }
    }
    let cases = knobs.iter().try_fold(1usize, |product, knob| {
        product.checked_mul(knob.values.len())
    });
    if let (true, Some(first)) = (grid && cases.is_none_or(|c| c > MOST_CASES), knobs.first()) {
        let fault = StudyFault::TooManyCases {
            cases: cases.map_or("very many".to_owned(), |c| c.to_string()),
            most: MOST_CASES,
        };
        reader.fault(first.span.clone(), fault);
    }
}

fn last_word(key: &str) -> String {
    let word = key.rsplit('.').next().unwrap_or(key);
    word.trim().to_owned()
}

/// A value of the scene's own kind: its text goes into `--set KEY=VALUE` as it stands.
fn plain_value(reader: &mut Reader, key: &str, item: &Spanned<DeValue>) -> Option<KnobValue> {
    Some(KnobValue {
        label: label(reader, item),
        set: setting(reader, key, item).into_iter().collect(),
        size: None,
        span: item.span(),
    })
}

/// `{ label, set, size }`.
fn joint_value(reader: &mut Reader, knob: &Section, item: &Spanned<DeValue>) -> Option<KnobValue> {
    let path = knob.key("values");
    let DeValue::Table(table) = item.get_ref() else {
        reader.wrong_type(
            path,
            item.span(),
            "a table, or a `key` for this knob,",
            SETTINGS,
        );
        return None;
    };
    let section = Section {
        path,
        table,
        span: item.span(),
    };
    reader.only(&section, "a value of a knob without `key`", VALUE_KEYS);
    for key in ["label", "set"] {
        if section.get(key).is_none() {
            reader.missing(&section, key, SETTINGS);
        }
    }
    let label = reader.text(&section, "label", SETTINGS)?;
    let set_value = section.get("set")?;
    let DeValue::Table(settings) = set_value.get_ref() else {
        reader.wrong_type(
            section.key("set"),
            set_value.span(),
            "a table of keys of the scene",
            SETTINGS,
        );
        return None;
    };
    let set = settings
        .iter()
        .filter_map(|(key, value)| setting(reader, key.get_ref(), value))
        .collect();
    let size = match section.get("size") {
        None => None,
        Some(value) => Some(reader.positive(section.key("size"), value, "size = 0.5")?),
    };
    Some(KnobValue {
        label: label.into_inner(),
        set,
        size,
        span: item.span(),
    })
}

/// `KEY=VALUE`; nothing for an empty text, which leaves the key as the scene has it.
fn setting(reader: &Reader, key: &str, value: &Spanned<DeValue>) -> Option<String> {
    if value.get_ref().as_str() == Some("") {
        return None;
    }
    let text = reader.text.get(value.span()).unwrap_or_default();
    Some(format!("{}={text}", key.trim()))
}

fn label(reader: &Reader, item: &Spanned<DeValue>) -> String {
    match item.get_ref().as_str() {
        Some("") => "as in the scene".to_owned(),
        Some(text) => text.to_owned(),
        None => {
            let text = reader.text.get(item.span()).unwrap_or_default();
            text.split_whitespace().collect::<Vec<_>>().join(" ")
        }
    }
}

fn distinct(reader: &mut Reader, section: &Section, values: &[KnobValue]) -> Option<()> {
    for (i, value) in values.iter().enumerate() {
        if values[..i].iter().any(|v| v.label == value.label) {
            let fault = StudyFault::Duplicate {
                path: section.key("values"),
                name: value.label.clone(),
            };
            reader.fault(value.span.clone(), fault);
            return None;
        }
    }
    Some(())
}

/// Sizes by the rule or from the list of `size`; with joint settings each value may have its own.
fn sizes(
    reader: &mut Reader,
    section: &Section,
    items: &[Spanned<DeValue>],
    values: &mut [KnobValue],
) -> Option<()> {
    let path = section.key("size");
    if let Some(size) = section.get("size") {
        match size.get_ref() {
            DeValue::String(rule) => by_rule(
                reader,
                &path,
                &Spanned::new(size.span(), rule.to_string()),
                items,
                values,
            )?,
            DeValue::Array(sizes) => {
                if sizes.len() != values.len() {
                    let fault = StudyFault::SizeCount {
                        path,
                        found: sizes.len(),
                        expected: values.len(),
                    };
                    reader.fault(size.span(), fault);
                    return None;
                }
                for (value, size) in values.iter_mut().zip(sizes) {
                    value.size = Some(reader.positive(section.key("size"), size, SIZE)?);
                }
            }
            _ => {
                reader.wrong_type(path, size.span(), "a rule or a list of numbers", SIZE);
                return None;
            }
        }
    }
    let with_size: Vec<(f64, Range<usize>)> = values
        .iter()
        .filter_map(|v| Some((v.size?, v.span.clone())))
        .collect();
    if !with_size.is_empty() && with_size.len() < values.len() {
        let fault = StudyFault::SomeSizes {
            path: section.key("values"),
        };
        reader.fault(section.get("values")?.span(), fault);
        return None;
    }
    for (i, (size, span)) in with_size.iter().enumerate() {
        if with_size[..i].iter().any(|(s, _)| s == size) {
            let fault = StudyFault::EqualSizes {
                path: section.key("values"),
                size: *size,
            };
            reader.fault(span.clone(), fault);
            return None;
        }
    }
    Some(())
}

fn by_rule(
    reader: &mut Reader,
    path: &str,
    rule: &Spanned<String>,
    items: &[Spanned<DeValue>],
    values: &mut [KnobValue],
) -> Option<()> {
    let compact: String = rule.get_ref().split_whitespace().collect();
    let Some((word, size)) = RULES.iter().find(|(word, _)| *word == compact) else {
        let valid: Vec<String> = RULES.iter().map(|(w, _)| (*w).to_owned()).collect();
        let fault = StudyFault::UnknownChoice {
            path: path.to_owned(),
            value: rule.get_ref().clone(),
            nearest: crate::scene::nearest(&compact, &valid),
            valid,
        };
        reader.fault(rule.span(), fault);
        return None;
    };
    for (value, item) in values.iter_mut().zip(items) {
        let h = number(item.get_ref()).map(size);
        match h.filter(|h| *h > 0.0 && h.is_finite()) {
            Some(h) => value.size = Some(h),
            None => {
                let fault = StudyFault::NoSize {
                    path: path.to_owned(),
                    value: value.label.clone(),
                    rule: (*word).to_owned(),
                };
                reader.fault(value.span.clone(), fault);
                return None;
            }
        }
    }
    Some(())
}

/// The value of `base`: equal to one of the values, or its label.
fn base(
    reader: &mut Reader,
    section: &Section,
    items: &[Spanned<DeValue>],
    values: &[KnobValue],
    needed: bool,
) -> Option<usize> {
    let path = section.key("base");
    let labels = || values.iter().map(|v| shown(&v.label)).collect();
    let Some(base) = section.get("base") else {
        if !needed || values.len() == 1 {
            return Some(0);
        }
        let span = section.span.clone();
        let values = labels();
        reader.fault(span, StudyFault::NoBase { path, values });
        return None;
    };
    let text = label(reader, base);
    let found = values.iter().position(|v| v.label == text).or_else(|| {
        let wanted = number(base.get_ref())?;
        items
            .iter()
            .position(|i| number(i.get_ref()) == Some(wanted))
    });
    if found.is_none() {
        let values = labels();
        reader.fault(base.span(), StudyFault::NotAValue { path, values });
    }
    found
}

/// As it would be written for `base`.
fn shown(label: &str) -> String {
    if label.parse::<f64>().is_ok() {
        label.to_owned()
    } else {
        format!("\"{label}\"")
    }
}
