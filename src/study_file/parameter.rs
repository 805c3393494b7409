//! Reads `[[parameter]]`: a key of the scene, or several together, with its values in order, the
//! kind of the key, and the fineness of each value.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::Deserialize;
use serde_spanned::Spanned;
use strum::{EnumString, VariantNames};
use toml::Value;

use super::keys::{ParameterKind, RawParameter};
use crate::scene::SceneFault;
use crate::scene::check::fields::{Checker, SceneTable, is_name};
use crate::scene::keys::is_setting;
use crate::scene::raw::Located;
use dovetail_export::words::{name_and_unit, title};

/// Largest number of cases of a grid.
const MOST_CASES: usize = 10_000;
/// Example of a value that sets several keys together.
const JOINT: &str = "values = [{ label = \"4 x 9\", set = { \"mesh.parameters.nu\" = 4, \"mesh.parameters.nv\" = 9 } }]";
/// Rules for the size h of a number.
#[derive(Debug, Clone, Copy, EnumString, VariantNames)]
enum SizeRule {
    #[strum(serialize = "value")]
    Value,
    #[strum(serialize = "1/value")]
    Inverse,
    #[strum(serialize = "1/(value-1)")]
    PerInterval,
    #[strum(serialize = "1/(value+1)")]
    PerHarmonic,
}

impl SizeRule {
    fn size(self, value: f64) -> f64 {
        match self {
            Self::Value => value,
            Self::Inverse => 1.0 / value,
            Self::PerInterval => 1.0 / (value - 1.0),
            Self::PerHarmonic => 1.0 / (value + 1.0),
        }
    }
}

/// One varied key of the scene, or several keys that are varied together.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub name: String,
    pub kind: ParameterKind,
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
    /// Position of the last value.
    pub fn last(&self) -> usize {
        self.values.len() - 1
    }

    /// The values themselves, if all are numbers.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|v| v.number).collect()
    }

    /// Sizes of all values, if they have sizes.
    pub fn sizes(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|v| v.size).collect()
    }

    pub fn labels(&self) -> Vec<String> {
        self.values.iter().map(|v| v.label.clone()).collect()
    }

    /// Keys that the values set, each once.
    pub fn keys(&self) -> BTreeSet<&str> {
        keys(&self.values).collect()
    }

    /// Title of the parameter, such as `force (N)`.
    pub fn title(&self) -> String {
        title(&self.name)
    }

    /// Name and value, such as `force 0.5 N`.
    pub fn words(&self, value: &ParameterValue) -> String {
        let (name, unit) = name_and_unit(&self.name);
        let unit = if value.number.is_some() { unit } else { "" };
        let words = format!("{name} {} {unit}", value.label);
        words.trim_end().to_owned()
    }
}

/// Keys that these values set.
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
}

/// All items if none is missing. Every one is made first, so that the faults of all are noted.
pub fn collect_all<T>(items: impl Iterator<Item = Option<T>>) -> Option<Vec<T>> {
    items.collect::<Vec<_>>().into_iter().collect()
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
    let at = SceneTable::new("parameter", span.clone(), Some((index, &None)));
    let name = match (&raw.name, &raw.key) {
        (None, Some(key)) => Reader { checker, at: &at }.name(key),
        (name, _) => checker.required_name(&at, name),
    };
    let order = checker.number(&at, "order", &raw.order);
    let Some(items) = &raw.values else {
        checker.missing(&at, "values");
        return None;
    };
    let items = checker.non_empty(&at, "values", items)?;
    let mut reader = Reader { checker, at: &at };
    let mut values = collect_all(items.iter().map(|item| reader.value(&raw.key, item)))?;
    let labels = values.iter();
    let labels = labels.map(|v| (at.key("values"), v.label.clone(), v.span.clone()));
    reader.checker.distinct(&labels.collect::<Vec<_>>());
    let kind = reader.kind(raw, &values)?;
    let size_name = reader.sizes(&raw.size, &mut values)?;
    let base = reader.base(&raw.base, &values, needs_base)?;
    let base_label = values[base].label.clone();
    sort(kind, &mut values);
    let name = name?;
    Some(Parameter {
        size_name: size_name.replace("value", &name_and_unit(&name).0),
        name,
        kind,
        base: values.iter().position(|v| v.label == base_label)?,
        values,
        order: order?,
        span,
    })
}

/// Reader of the keys of one `[[parameter]]`.
struct Reader<'c, 's> {
    checker: &'c mut Checker<'s>,
    at: &'c SceneTable,
}

impl Reader<'_, '_> {
    /// Notes a fault about a key; `problem` follows its path.
    fn refuse<T>(
        &mut self,
        key: &str,
        span: Range<usize>,
        problem: &str,
        label: &'static str,
        remedy: impl Into<String>,
    ) -> Option<T> {
        let message = format!("`{}`{problem}", self.at.key(key));
        self.checker
            .fault(span, SceneFault::particular(message, label, remedy));
        None
    }

    /// Last word of a key, which names the parameter if nothing else does.
    fn name(&mut self, key: &Spanned<String>) -> Option<String> {
        let word = key.get_ref().rsplit('.').next().unwrap_or_default().trim();
        if is_name(word) {
            return Some(word.to_owned());
        }
        let problem =
            format!(": \"{word}\", the last word of the key, is no name for the parameter");
        let remedy = "give the parameter a `name` of its own, which begins with a letter and has \
                      letters, digits, `_` and `-`: it becomes part of the names of folders";
        self.refuse("key", key.span(), &problem, "names the parameter", remedy)
    }

    /// Kind given by `is`, else numerical if all keys are. Only numerical parameters may have a
    /// size and an order, as these describe errors.
    fn kind(&mut self, raw: &RawParameter, values: &[ParameterValue]) -> Option<ParameterKind> {
        let own = raw.key.iter().map(|key| key.get_ref().as_str());
        let mut keys = own.chain(keys(values));
        let kind = match &raw.is {
            None if keys.all(is_setting) => ParameterKind::Numerical,
            None => ParameterKind::Physical,
            is => self.checker.optional_choice(self.at, "is", is)??,
        };
        let size = raw.size.as_ref().map(|size| ("size", size.span()));
        let of_errors = size.or(raw.order.as_ref().map(|order| ("order", order.span())));
        let Some((key, span)) = of_errors.filter(|_| kind == ParameterKind::Physical) else {
            return Some(kind);
        };
        let problem = " belongs to errors, which numerical parameters alone have";
        let remedy = format!(
            "leave `{key}` out, or write is = \"numerical\" where the parameter is a setting of \
             the computation"
        );
        self.refuse(key, span, problem, "of no numerical parameter", remedy)
    }

    /// Reads a value: with a `key` the value of the key, else `{ label, set }`. An empty text leaves
    /// the key as in the scene.
    fn value(&mut self, key: &Located<String>, item: &Spanned<Value>) -> Option<ParameterValue> {
        let setting = |key: &str, value: &Value, text: &str| {
            (value.as_str() != Some("")).then(|| format!("{}={text}", key.trim()))
        };
        let (span, value) = (item.span(), item.get_ref());
        let (label, set) = if let Some(key) = key {
            let set = setting(key.get_ref(), value, self.text(item));
            (self.label(item), set.into_iter().collect())
        } else {
            match value.clone().try_into() {
                Ok(JointValue { label, set }) => {
                    let set = set.iter();
                    let set = set.filter_map(|(key, v)| setting(key, v, &v.to_string()));
                    (label, set.collect())
                }
                Err(error) => {
                    let problem = format!(": {}", error.message());
                    let remedy = format!("write it like this: {JOINT}");
                    return self.refuse("values", span, &problem, "not { label, set }", remedy);
                }
            }
        };
        Some(ParameterValue {
            label,
            set,
            number: number(value),
            size: None,
            span,
        })
    }

    fn text(&self, item: &Spanned<Value>) -> &str {
        let text = self.checker.source.text.get(item.span());
        text.unwrap_or_default()
    }

    /// Text of a value in the file, without line ends.
    fn label(&self, item: &Spanned<Value>) -> String {
        match item.get_ref().as_str() {
            Some("") => "as in the scene".to_owned(),
            Some(text) => text.to_owned(),
            None => Vec::from_iter(self.text(item).split_whitespace()).join(" "),
        }
    }

    /// Sets the sizes by the rule or from the list of `size`. Returns the formula of the size of a
    /// `value`.
    fn sizes(&mut self, size: &Located<Value>, values: &mut [ParameterValue]) -> Option<String> {
        let mut name = "size of value".to_owned();
        let sizes: Vec<f64> = match size.as_ref().map(|size| (size.span(), size.get_ref())) {
            None => return Some(name),
            Some((span, Value::String(rule))) => {
                name = rule.split_whitespace().collect();
                let rule = Spanned::new(span, name.clone());
                let valid = SizeRule::VARIANTS;
                let rule: SizeRule = self.checker.word(self.at, "size", &rule, valid)?;
                let numbers = values.iter().map(|v| v.number.unwrap_or(f64::NAN));
                numbers.map(|value| rule.size(value)).collect()
            }
            Some((_, Value::Array(sizes))) if sizes.len() == values.len() => {
                let sizes = sizes.iter().map(|size| number(size).unwrap_or(f64::NAN));
                sizes.collect()
            }
            Some((span, _)) => {
                let message = format!("a rule, or {} numbers, one a value", values.len());
                self.checker.wrong_type(self.at, "size", span, message);
                return None;
            }
        };
        for (i, (value, &size)) in values.iter_mut().zip(&sizes).enumerate() {
            if !(size > 0.0 && size.is_finite()) || sizes[..i].contains(&size) {
                let problem = format!(
                    ": {} has the size {size}, which is not above 0, or that of another value",
                    value.label
                );
                let remedy = "give each value a size of its own above 0, as a list: \
                              size = [1.0, 0.5]; leave `size` out where the values are not finer \
                              and coarser (they then count from coarse to fine as written)";
                return self.refuse("size", value.span.clone(), &problem, "no size", remedy);
            }
            value.size = Some(size);
        }
        Some(name)
    }

    /// Position of the value of `base`, which equals one of the values or its label.
    fn base(
        &mut self,
        base: &Located<Value>,
        values: &[ParameterValue],
        needed: bool,
    ) -> Option<usize> {
        let (span, problem) = if let Some(base) = base {
            let (label, number) = (self.label(base), number(base.get_ref()));
            let is_equal = |v: &ParameterValue| number.is_some() && v.number == number;
            let position = values.iter().position(|v| v.label == label);
            if let Some(position) = position.or_else(|| values.iter().position(is_equal)) {
                return Some(position);
            }
            (base.span(), " is not one of the values")
        } else if needed && values.len() > 1 {
            let problem = " is missing: with several parameters one at a time, each needs a base";
            (self.at.span.clone(), problem)
        } else {
            return Some(0);
        };
        // As they would be written.
        let shown = values.iter().map(|v| match v.label.parse::<f64>() {
            Ok(_) => v.label.clone(),
            Err(_) => format!("\"{}\"", v.label),
        });
        let shown: Vec<String> = shown.collect();
        let labels = dovetail_mesh::text::list(&shown);
        let remedy = format!("the values are: {labels}; for example: base = {}", shown[0]);
        let label = "not one of the values";
        self.refuse("base", span, problem, label, remedy)
    }
}

/// Value as a number, if it is a finite one.
fn number(value: &Value) -> Option<f64> {
    let number = value.as_integer().map(|v| v as f64).or(value.as_float());
    number.filter(|v| v.is_finite())
}

/// Sorts numerical values with sizes from coarse to fine, other numbers from low to high.
fn sort(kind: ParameterKind, values: &mut [ParameterValue]) {
    let place = |v: &ParameterValue| {
        if kind == ParameterKind::Numerical {
            v.size.map(|size| -size)
        } else {
            v.number
        }
    };
    if values.iter().all(|v| place(v).is_some()) {
        values.sort_by(|a, b| f64::total_cmp(&place(a).unwrap_or(0.0), &place(b).unwrap_or(0.0)));
    }
}

/// Checks all parameters together: repeated names, keys that are set twice, grids that are too
/// large.
pub fn check_together(checker: &mut Checker, parameters: &[Parameter], grid: bool) {
    let path = |i: usize| format!("parameter.{i}.name");
    let named = parameters.iter().enumerate();
    let named = named.map(|(i, p)| (path(i), p.name.clone(), p.span.clone()));
    checker.distinct(&named.collect::<Vec<_>>());
    for (i, parameter) in parameters.iter().enumerate() {
        for other in &parameters[..i] {
            let is_set_again = |key: &&str| keys(&other.values).any(|k| k == *key);
            if let Some(key) = keys(&parameter.values).find(is_set_again) {
                let message = format!("both {} and {} set `{key}`", other.name, parameter.name);
                let remedy = format!("let one parameter set both together: {JOINT}");
                checker.fault(
                    parameter.span.clone(),
                    SceneFault::particular(message, "set again", remedy),
                );
            }
        }
    }
    let counts = parameters.iter().map(|p| p.values.len());
    let cases = counts.fold(1, usize::saturating_mul);
    if grid && cases > MOST_CASES {
        let message = format!("a grid of {cases} cases is more than {MOST_CASES}");
        let remedy = "take fewer values, or mode = \"one_at_a_time\"";
        let span = parameters[0].span.clone();
        checker.fault(span, SceneFault::particular(message, "too many", remedy));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn physical_numbers_are_put_in_order_and_sizes_of_a_setting() {
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
        sort(ParameterKind::Numerical, &mut values);
        assert_eq!(numbers(&values), [0.3, 0.1, 0.2].map(Some));
        sort(ParameterKind::Physical, &mut values);
        assert_eq!(numbers(&values), [0.1, 0.2, 0.3].map(Some));
        let mut values = [(1.0, 0.5), (2.0, 1.0)].map(|(v, h)| value(Some(v), Some(h)));
        sort(ParameterKind::Numerical, &mut values);
        assert_eq!(numbers(&values), [2.0, 1.0].map(Some));
        // A value that leaves the key as it is has no place among numbers.
        let mut values = [Some(2.0), None, Some(1.0)].map(|v| value(v, None));
        sort(ParameterKind::Physical, &mut values);
        assert_eq!(numbers(&values), [Some(2.0), None, Some(1.0)]);
    }
}
