//! Reads `[[parameter]]`: a key of the scene, or several together, with its values in order, the
//! kind of the key, and the fineness of each value.

use std::ops::Range;

use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use super::keys::STUDY;
use super::quantity::{name_and_unit, with_unit};
use super::raw::{KIND_WORDS, RawParameter};
use crate::scene::Fault;
use crate::scene::check::fields::{Checker, Table, is_name};
use crate::scene::raw::Located;

/// Largest number of cases of a grid.
pub const MOST_CASES: usize = 10_000;
/// Example of a value that sets several keys together.
const JOINT: &str = "values = [{ label = \"4 x 9\", set = { \"mesh.parameters.nu\" = 4, \"mesh.parameters.nv\" = 9 } }]";
/// Rules for the size h of a number.
const RULES: [&str; 4] = ["value", "1/value", "1/(value-1)", "1/(value+1)"];
const SIZES: [fn(f64) -> f64; 4] = [|v| v, |v| 1.0 / v, |v| 1.0 / (v - 1.0), |v| 1.0 / (v + 1.0)];

/// Kind of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Setting of the solution method: its values have errors.
    Numerical,
    /// Load on the model: values are compared separately at each load.
    Load,
    /// Value of the design.
    Design,
}

const KINDS: [Kind; 3] = [Kind::Numerical, Kind::Load, Kind::Design];

impl Kind {
    /// Word for the kind in a study file.
    pub fn word(self) -> &'static str {
        KIND_WORDS[self as usize]
    }

    /// Kind of a key of the scene, if the study does not state it.
    fn of_key(key: &str) -> Self {
        let words: Vec<&str> = key.split('.').map(str::trim).collect();
        let last = words[words.len() - 1];
        match words[0] {
            _ if last.ends_with("_modes") => Self::Numerical,
            "mesh" | "response" | "static" => Self::Numerical,
            "excitation" | "load" | "rotation" => Self::Load,
            "reduced_model" if last == "force_n" => Self::Load,
            _ => Self::Design,
        }
    }
}

/// One varied key of the scene, or several keys that are varied together.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub name: String,
    pub kind: Kind,
    /// Values in order. Numerical ones are ordered from coarse to fine: by decreasing size, or as
    /// written if they have no sizes. Others are ordered from low to high, or as written if they
    /// are not numbers.
    pub values: Vec<ParameterValue>,
    /// Position of the value that applies while other parameters are varied.
    pub base: usize,
    /// Formula of the size, such as `1/(harmonics+1)`.
    pub size_name: String,
    /// Expected order of the errors in the size.
    pub order: f64,
    /// Place of its table in the file, bytes.
    pub span: Range<usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct ParameterValue {
    pub label: String,
    /// `KEY=VALUE` texts.
    pub set: Vec<String>,
    /// The value itself, if it is a finite number.
    pub number: Option<f64>,
    /// Size h: errors are compared with its powers.
    pub size: Option<f64>,
    pub span: Range<usize>,
}

impl Parameter {
    pub fn is(&self, kind: Kind) -> bool {
        self.kind == kind
    }

    pub fn is_numerical(&self) -> bool {
        self.is(Kind::Numerical)
    }

    /// The values themselves, if all are numbers.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|v| v.number).collect()
    }

    /// Sizes of all values, if they have sizes.
    pub fn sizes(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|v| v.size).collect()
    }

    /// Title of the parameter, such as `force (N)`.
    pub fn title(&self) -> String {
        let (name, unit) = name_and_unit(&self.name);
        with_unit(&name, unit)
    }

    /// Name and value, such as `force 0.5 N`.
    pub fn words(&self, value: usize) -> String {
        let ((name, unit), value) = (name_and_unit(&self.name), &self.values[value]);
        let unit = if value.number.is_some() { unit } else { "" };
        format!("{name} {} {unit}", value.label)
            .trim_end()
            .to_owned()
    }

    fn keys(&self) -> impl Iterator<Item = &str> {
        keys(&self.values)
    }
}

/// Keys that the values set.
fn keys(values: &[ParameterValue]) -> impl Iterator<Item = &str> {
    let set = values.iter().flat_map(|v| &v.set);
    set.map(|s| s.split('=').next().unwrap_or(s).trim())
}

/// Value that sets several keys together.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointValue {
    label: String,
    set: toml::Table,
    size: Option<f64>,
}

/// Fault that only a study can have.
pub fn fault(message: String, label: &'static str, remedy: impl Into<String>) -> Fault {
    Fault::Particular {
        message,
        label,
        remedy: remedy.into(),
    }
}

/// Fault for an empty list that needs at least one item.
pub fn nothing(path: String, what: &str, example: &'static str) -> Fault {
    Fault::WrongType {
        path,
        message: format!("at least one {what} is expected"),
        example,
    }
}

/// Checks one `[[parameter]]`. With `needs_base` it has to state the value that applies while
/// others are varied.
pub fn check(
    checker: &mut Checker,
    index: usize,
    raw: &Spanned<RawParameter>,
    needs_base: bool,
) -> Option<Parameter> {
    let (span, raw) = (raw.span(), raw.get_ref());
    let at = Table::of("parameter", span.clone(), Some((index, &None)));
    let name = match (&raw.name, &raw.key) {
        (None, Some(key)) => name_of_key(checker, &at, key),
        (name, _) => checker.required_name(&at, name),
    };
    let order = checker.number(&at, "order", &raw.order);
    let Some(items) = &raw.values else {
        checker.missing(&at, "values");
        return None;
    };
    if items.get_ref().is_empty() {
        let example = STUDY.example("parameter", "values");
        checker.fault(items.span(), nothing(at.key("values"), "value", example));
        return None;
    }
    let items = items.get_ref();
    let values = items.iter().map(|item| value(checker, &at, &raw.key, item));
    let values: Vec<Option<ParameterValue>> = values.collect();
    let mut values: Vec<ParameterValue> = values.into_iter().collect::<Option<_>>()?;
    let labels = values
        .iter()
        .map(|v| (at.key("values"), v.label.clone(), v.span.clone()));
    checker.distinct(&labels.collect::<Vec<_>>());
    let kind = kind(checker, &at, raw, &values)?;
    let rule = sizes(checker, &at, raw, items, &mut values)?;
    let base = base(checker, &at, &raw.base, items, &values, needs_base)?;
    let base_label = values[base].label.clone();
    sort(kind, &mut values);
    let name = name?;
    let words = name_and_unit(&name).0;
    Some(Parameter {
        size_name: rule.map_or(format!("size of {words}"), |r| r.replace("value", &words)),
        name,
        kind,
        base: values.iter().position(|v| v.label == base_label)?,
        values,
        order: order?,
        span,
    })
}

/// Last word of a key, which names the parameter if nothing else does.
fn name_of_key(checker: &mut Checker, at: &Table, key: &Spanned<String>) -> Option<String> {
    let word = key.get_ref().rsplit('.').next().unwrap_or_default().trim();
    if is_name(word) {
        return Some(word.to_owned());
    }
    let message = format!(
        "`{}`: \"{word}\", the last word of the key, is no name for the parameter",
        at.key("key")
    );
    let remedy = "give the parameter a `name` of its own, which begins with a letter and has \
                  letters, digits, `_` and `-`: it becomes part of the names of folders";
    checker.fault(key.span(), fault(message, "names the parameter", remedy));
    None
}

/// Kind given by `is`, else the last of the kinds of its keys. Only numerical parameters may have a
/// size and an order, as these describe errors.
fn kind(
    checker: &mut Checker,
    at: &Table,
    raw: &RawParameter,
    values: &[ParameterValue],
) -> Option<Kind> {
    let own = raw.key.iter().map(|key| key.get_ref().as_str());
    let kinds = own.chain(keys(values)).map(Kind::of_key);
    let kind = match &raw.is {
        Some(_) => checker.choice(at, "is", &raw.is, &KINDS)?,
        None => kinds
            .max_by_key(|kind| *kind as usize)
            .unwrap_or(Kind::Numerical),
    };
    let of_value = values.iter().find(|v| v.size.is_some());
    let of_errors = [
        ("size", raw.size.as_ref().map(Spanned::span)),
        ("size", of_value.map(|v| v.span.clone())),
        ("order", raw.order.as_ref().map(Spanned::span)),
    ];
    let mut given = of_errors.into_iter().filter_map(|(k, s)| Some((k, s?)));
    match given.next().filter(|_| kind != Kind::Numerical) {
        None => Some(kind),
        Some((key, span)) => {
            let path = at.key(key);
            let message =
                format!("`{path}` belongs to errors, which numerical parameters alone have");
            let remedy = format!(
                "leave `{key}` out, or write is = \"numerical\" where the parameter is a setting of \
                 the computation"
            );
            checker.fault(span, fault(message, "of no numerical parameter", remedy));
            None
        }
    }
}

/// Sorts numerical values with sizes from coarse to fine, other numbers from low to high.
fn sort(kind: Kind, values: &mut [ParameterValue]) {
    let place = |v: &ParameterValue| match kind {
        Kind::Numerical => v.size.map(|size| -size),
        Kind::Load | Kind::Design => v.number,
    };
    if values.iter().all(|v| place(v).is_some()) {
        values.sort_by(|a, b| {
            let order = place(a).partial_cmp(&place(b));
            order.unwrap_or(std::cmp::Ordering::Equal)
        });
    }
}

/// Checks all parameters together: repeated names, keys that are set twice, grids that are too
/// large.
pub fn check_together(checker: &mut Checker, parameters: &[Parameter], grid: bool) {
    let named = parameters.iter().enumerate();
    let named = named.map(|(i, p)| {
        let path = format!("parameter.{i}.name");
        (path, p.name.clone(), p.span.clone())
    });
    checker.distinct(&named.collect::<Vec<_>>());
    for (i, parameter) in parameters.iter().enumerate() {
        for other in &parameters[..i] {
            let mut keys = parameter.keys();
            if let Some(key) = keys.find(|key| other.keys().any(|k| k == *key)) {
                let message = format!("both {} and {} set `{key}`", other.name, parameter.name);
                let remedy = format!("let one parameter set both together: {JOINT}");
                checker.fault(parameter.span.clone(), fault(message, "set again", remedy));
            }
        }
    }
    let mut counts = parameters.iter().map(|p| p.values.len());
    let cases = counts.try_fold(1usize, usize::checked_mul);
    if let (true, Some(first)) = (
        grid && cases.is_none_or(|c| c > MOST_CASES),
        parameters.first(),
    ) {
        let cases = cases.map_or("very many".to_owned(), |c| c.to_string());
        let message = format!("a grid of {cases} cases is more than {MOST_CASES}");
        let remedy = "take fewer values, or mode = \"one_at_a_time\"";
        checker.fault(first.span.clone(), fault(message, "too many", remedy));
    }
}

/// Reads a value: with a `key` the value of the key, else `{ label, set, size }`.
fn value(
    checker: &mut Checker,
    at: &Table,
    key: &Located<String>,
    item: &Spanned<Value>,
) -> Option<ParameterValue> {
    let span = item.span();
    if let Some(key) = key {
        let text = checker.source.text.get(span.clone()).unwrap_or_default();
        let set = setting(key.get_ref(), item.get_ref(), text.to_owned());
        return Some(ParameterValue {
            label: label(checker, item),
            set: set.into_iter().collect(),
            number: Some(number(item.get_ref())).filter(|v| v.is_finite()),
            size: None,
            span,
        });
    }
    let joint: JointValue = match item.get_ref().clone().try_into() {
        Ok(joint) => joint,
        Err(error) => {
            let fault = Fault::WrongType {
                path: at.key("values"),
                message: error.message().to_owned(),
                example: JOINT,
            };
            checker.fault(span, fault);
            return None;
        }
    };
    let settings = joint.set.iter();
    let set = settings.filter_map(|(key, value)| setting(key, value, value.to_string()));
    Some(ParameterValue {
        label: joint.label,
        set: set.collect(),
        number: None,
        size: joint.size,
        span,
    })
}

/// Setting `KEY=VALUE`; `None` for an empty text, which leaves the key as in the scene.
fn setting(key: &str, value: &Value, text: String) -> Option<String> {
    (value.as_str() != Some("")).then(|| format!("{}={text}", key.trim()))
}

fn label(checker: &Checker, item: &Spanned<Value>) -> String {
    match item.get_ref().as_str() {
        Some("") => "as in the scene".to_owned(),
        Some(text) => text.to_owned(),
        None => {
            let text = checker.source.text.get(item.span()).unwrap_or_default();
            text.split_whitespace().collect::<Vec<_>>().join(" ")
        }
    }
}

/// Value as a number; NaN if it is not a number.
fn number(value: &Value) -> f64 {
    match value {
        Value::Integer(v) => *v as f64,
        Value::Float(v) => *v,
        _ => f64::NAN,
    }
}

/// Sets the sizes by the rule or from the list of `size`; values that set several keys may have
/// their own. Returns the rule, if any.
fn sizes(
    checker: &mut Checker,
    at: &Table,
    raw: &RawParameter,
    items: &[Spanned<Value>],
    values: &mut [ParameterValue],
) -> Option<Option<String>> {
    let path = at.key("size");
    let mut by_rule = None;
    match raw.size.as_ref().map(|size| (size.span(), size.get_ref())) {
        None => {}
        Some((span, Value::String(rule))) => {
            let compact: String = rule.split_whitespace().collect();
            by_rule = Some(compact.clone());
            let rule = Some(Spanned::new(span, compact));
            let size = checker.word(at, "size", &rule, &RULES, &SIZES)?;
            for (value, item) in values.iter_mut().zip(items) {
                value.size = Some(size(number(item.get_ref())));
            }
        }
        Some((_, Value::Array(sizes))) if sizes.len() == values.len() => {
            for (value, size) in values.iter_mut().zip(sizes) {
                value.size = Some(number(size));
            }
        }
        Some((span, _)) => {
            let fault = Fault::WrongType {
                path,
                message: format!("a rule, or {} numbers, one a value", values.len()),
                example: STUDY.example("parameter", "size"),
            };
            checker.fault(span, fault);
            return None;
        }
    }
    let has_sizes = values.iter().any(|v| v.size.is_some());
    for (
        i,
        ParameterValue {
            label, span, size, ..
        },
    ) in values.iter().enumerate()
    {
        let of_earlier = || values[..i].iter().any(|v| v.size == *size);
        let (message, words, remedy) = match *size {
            None if has_sizes => (
                format!("some values have a size, {label} has none"),
                "no size",
                "give each value a `size`, or none",
            ),
            Some(size) if !(size > 0.0 && size.is_finite()) => (
                format!("{label} has the size {size}, which is not above 0"),
                "no size above 0",
                "give one size above 0 for each value, as a list: size = [1.0, 0.5]",
            ),
            Some(size) if of_earlier() => (
                format!("two values have the size {size}"),
                "the same size",
                "a size says how fine a value is; leave out `size` where the values are not finer \
                 and coarser (they then count from coarse to fine as they are written)",
            ),
            _ => continue,
        };
        checker.fault(
            span.clone(),
            fault(format!("`{path}`: {message}"), words, remedy),
        );
        return None;
    }
    Some(by_rule)
}

/// Position of the value of `base`, which equals one of the values or its label.
fn base(
    checker: &mut Checker,
    at: &Table,
    base: &Located<Value>,
    items: &[Spanned<Value>],
    values: &[ParameterValue],
    needed: bool,
) -> Option<usize> {
    let (span, problem) = match base {
        None if !needed || values.len() == 1 => return Some(0),
        None => (
            at.span.clone(),
            "is missing: with several parameters one at a time, each needs a base",
        ),
        Some(base) => {
            let text = label(checker, base);
            let wanted = number(base.get_ref());
            let same = |item: &Spanned<Value>| number(item.get_ref()) == wanted;
            let found = values.iter().position(|v| v.label == text);
            match found.or_else(|| items.iter().position(same)) {
                Some(found) => return Some(found),
                None => (base.span(), "is not one of the values"),
            }
        }
    };
    // As they would be written.
    let shown = values.iter().map(|v| match v.label.parse::<f64>() {
        Ok(_) => v.label.clone(),
        Err(_) => format!("\"{}\"", v.label),
    });
    let shown: Vec<String> = shown.collect();
    let all = dovetail_mesh::text::list(&shown);
    let remedy = format!("the values are: {all}; for example: base = {}", shown[0]);
    let message = format!("`{}` {problem}", at.key("base"));
    checker.fault(span, fault(message, "not one of the values", remedy));
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_a_setting_a_load_or_a_design_value() {
        for key in [
            "mesh.parameters.nu",
            "mesh.file",
            "response.harmonics",
            " response .points",
            "static.load_steps",
            "body.*.fixed_interface_modes",
        ] {
            assert_eq!(Kind::of_key(key), Kind::Numerical, "{key}");
        }
        for key in [
            "contact.*.friction",
            "reduced_model.friction",
            "damping.ratio",
            "body.blade.young_pa",
        ] {
            assert_eq!(Kind::of_key(key), Kind::Design, "{key}");
        }
        for key in [
            "reduced_model.force_n",
            "excitation.*.force_n",
            "rotation.speed_rpm",
            " load.0.force_n",
        ] {
            assert_eq!(Kind::of_key(key), Kind::Load, "{key}");
        }
        assert_eq!(KINDS.map(Kind::word), KIND_WORDS);
    }

    #[test]
    fn numbers_of_a_design_are_put_in_order_and_sizes_of_a_setting() {
        let value = |number: Option<f64>, size: Option<f64>| ParameterValue {
            label: String::new(),
            set: vec![],
            number,
            size,
            span: 0..0,
        };
        let numbers =
            |values: &[ParameterValue]| values.iter().map(|v| v.number).collect::<Vec<_>>();
        let mut values = [0.3, 0.1, 0.2].map(|v| value(Some(v), None));
        sort(Kind::Numerical, &mut values);
        assert_eq!(numbers(&values), [0.3, 0.1, 0.2].map(Some));
        sort(Kind::Design, &mut values);
        assert_eq!(numbers(&values), [0.1, 0.2, 0.3].map(Some));
        let mut values = [(1.0, 0.5), (2.0, 1.0)].map(|(v, h)| value(Some(v), Some(h)));
        sort(Kind::Numerical, &mut values);
        assert_eq!(numbers(&values), [2.0, 1.0].map(Some));
        // A value that leaves the key as it is has no place among numbers.
        let mut values = [Some(2.0), None, Some(1.0)].map(|v| value(v, None));
        sort(Kind::Design, &mut values);
        assert_eq!(numbers(&values), [Some(2.0), None, Some(1.0)]);
    }
}
