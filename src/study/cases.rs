//! Makes the cases of a study from its parameters. Each case is a run of its own.

use std::collections::{HashMap, HashSet};

use super::file::{Mode, Study};
use super::parameter::Parameter;

/// One run, with a value of each parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name of its folder.
    pub slug: String,
    /// Position of the value of each parameter among its values.
    pub values: Vec<usize>,
}

impl Case {
    /// `KEY=VALUE` texts for `--set`, those of the study first.
    pub fn set(&self, study: &Study) -> Vec<String> {
        let parameters = study.parameters.iter().zip(&self.values);
        let of_parameters = parameters.flat_map(|(parameter, value)| &parameter.values[*value].set);
        study.set.iter().chain(of_parameters).cloned().collect()
    }

    /// Label of the value of each parameter.
    pub fn labels<'s>(&self, study: &'s Study) -> Vec<&'s str> {
        let parameters = study.parameters.iter().zip(&self.values);
        parameters
            .map(|(parameter, value)| parameter.values[*value].label.as_str())
            .collect()
    }
}

/// All cases. One at a time the base comes first, then one parameter after the other; in a grid the
/// last parameter varies fastest.
pub fn cases(study: &Study) -> Vec<Case> {
    let combinations = match study.mode {
        Mode::OneAtATime => one_at_a_time(&study.parameters),
        Mode::Grid => grid(&study.parameters),
    };
    let mut slugs = Slugs::default();
    let case = |values: Vec<usize>| {
        let parameters = study.parameters.iter().zip(&values);
        let is_named = |(p, v): &(&Parameter, &usize)| study.mode == Mode::Grid || p.base != **v;
        let slug = match slug(parameters.filter(is_named)) {
            empty if empty.is_empty() => slugs.distinct("base"),
            slug => slugs.distinct(&slug),
        };
        Case { slug, values }
    };
    combinations.into_iter().map(case).collect()
}

/// Designs and loads at which numerical parameters are refined, each by a value of every parameter
/// (numerical ones at their base). One at a time this is the base alone, in a grid each combination
/// of the other parameters. Empty if no parameter is numerical.
pub fn designs(study: &Study) -> Vec<Vec<usize>> {
    let base: Vec<usize> = study.parameters.iter().map(|p| p.base).collect();
    match study.mode {
        _ if !study.parameters.iter().any(Parameter::is_numerical) => Vec::new(),
        Mode::OneAtATime => vec![base],
        Mode::Grid => {
            let mut all = grid(&study.parameters);
            all.retain(|values| {
                let mut parameters = study.parameters.iter().enumerate();
                parameters.all(|(k, p)| !p.is_numerical() || values[k] == base[k])
            });
            all
        }
    }
}

/// Text of the `wanted` parameters with these values, such as `friction 0.3, force 1.0 N`; empty if
/// there are none.
pub fn words(study: &Study, values: &[usize], wanted: impl Fn(&Parameter) -> bool) -> String {
    let parameters = study.parameters.iter().zip(values);
    let wanted = parameters.filter(|(p, _)| wanted(p));
    wanted
        .map(|(p, v)| p.words(*v))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Text of the parameters that are not numerical, such as ` at friction 0.3, force 1.0 N`; empty if
/// all are numerical.
pub fn at_words(study: &Study, values: &[usize]) -> String {
    match words(study, values, |p| !p.is_numerical()) {
        none if none.is_empty() => none,
        words => format!(" at {words}"),
    }
}

/// Part of a file name for the parameters that are not numerical, such as
/// `__friction_0.3__force_n_1.0`; empty if all are numerical.
pub fn at_slug(study: &Study, values: &[usize]) -> String {
    let parameters = study.parameters.iter().zip(values);
    match slug(parameters.filter(|(p, _)| !p.is_numerical())) {
        none if none.is_empty() => none,
        slug => format!("__{slug}"),
    }
}

fn one_at_a_time(parameters: &[Parameter]) -> Vec<Vec<usize>> {
    let base: Vec<usize> = parameters.iter().map(|k| k.base).collect();
    let mut all = vec![base.clone()];
    for (k, parameter) in parameters.iter().enumerate() {
        for value in (0..parameter.values.len()).filter(|v| *v != parameter.base) {
            let mut values = base.clone();
            values[k] = value;
            all.push(values);
        }
    }
    all
}

fn grid(parameters: &[Parameter]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for parameter in parameters {
        let longer = |values: &Vec<usize>| {
            let values = values.clone();
            (0..parameter.values.len()).map(move |v| [&values[..], &[v]].concat())
        };
        all = all.iter().flat_map(longer).collect();
    }
    all
}

fn slug<'a>(turned: impl Iterator<Item = (&'a Parameter, &'a usize)>) -> String {
    let word = |(parameter, value): (&Parameter, &usize)| {
        format!(
            "{}_{}",
            parameter.name,
            clean(&parameter.values[*value].label)
        )
    };
    turned.map(word).collect::<Vec<_>>().join("__")
}

/// Label with only letters, digits, points and signs; `4 x 9` becomes `4x9`.
fn clean(label: &str) -> String {
    let joined = label.replace(" x ", "x");
    let mut text = String::new();
    for c in joined.chars() {
        if c.is_ascii_alphanumeric() || matches!(c, '.' | '+' | '_') {
            text.push(c);
        } else if !text.is_empty() && !text.ends_with('-') {
            text.push('-');
        }
    }
    let text = text.trim_end_matches('-');
    let text: String = text.chars().take(40).collect();
    if text.is_empty() {
        "value".to_owned()
    } else {
        text
    }
}

/// Distinct names of folders, also for file systems that do not distinguish small letters from
/// capitals.
#[derive(Default)]
struct Slugs {
    /// Names in use, in small letters.
    taken: HashSet<String>,
    /// Last number appended to each name; the names are in small letters.
    last: HashMap<String, usize>,
}

impl Slugs {
    /// First 180 characters of a name, with a number appended if they are in use.
    fn distinct(&mut self, slug: &str) -> String {
        let slug: String = slug.chars().take(180).collect();
        let last = self.last.entry(slug.to_ascii_lowercase()).or_default();
        loop {
            *last += 1;
            let candidate = match *last {
                1 => slug.clone(),
                number => format!("{slug}-{number}"),
            };
            if self.taken.insert(candidate.to_ascii_lowercase()) {
                return candidate;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::parameter::{Kind, ParameterValue};

    fn parameter(name: &str, labels: &[&str], base: usize) -> Parameter {
        let value = |label: &&str| ParameterValue {
            label: (*label).to_owned(),
            set: vec![format!("{name}={label}")],
            number: None,
            size: None,
            span: 0..0,
        };
        Parameter {
            name: name.to_owned(),
            kind: Kind::Numerical,
            values: labels.iter().map(value).collect(),
            base,
            size_name: String::new(),
            order: 2.0,
            span: 0..0,
        }
    }

    fn study(mode: Mode) -> Study {
        Study {
            name: "s".into(),
            scene: "scene.toml".into(),
            set: vec!["x=1".into()],
            mode,
            quantities: vec![],
            fields: false,
            parameters: vec![
                parameter("flanks", &["4 x 9", "8 x 18"], 0),
                parameter("h", &["1", "3", "7"], 1),
            ],
            minimise: vec![],
        }
    }

    #[test]
    fn numerical_parameters_are_refined_at_each_design_of_a_grid_and_else_at_the_base() {
        let mut study = study(Mode::Grid);
        assert_eq!(designs(&study), [[0, 1]]);
        assert_eq!(at_words(&study, &[0, 1]), "");
        study.parameters[0].kind = Kind::Design;
        assert_eq!(designs(&study), [[0, 1], [1, 1]]);
        assert_eq!(at_words(&study, &[1, 1]), " at flanks 8 x 18");
        assert_eq!(at_slug(&study, &[1, 1]), "__flanks_8x18");
        study.mode = Mode::OneAtATime;
        assert_eq!(designs(&study), [[0, 1]]);
        study.parameters[1].kind = Kind::Load;
        assert!(designs(&study).is_empty());
        assert_eq!(words(&study, &[1, 1], |p| p.is(Kind::Load)), "h 3");
    }

    #[test]
    fn one_at_a_time_varies_each_parameter_around_the_base() {
        let study = study(Mode::OneAtATime);
        let cases = cases(&study);
        let slugs: Vec<&str> = cases.iter().map(|c| c.slug.as_str()).collect();
        assert_eq!(slugs, ["base", "flanks_8x18", "h_1", "h_7"]);
        assert_eq!(cases[1].set(&study), ["x=1", "flanks=8 x 18", "h=3"]);
        assert_eq!(cases[2].labels(&study), ["4 x 9", "1"]);
    }

    #[test]
    fn a_grid_has_every_combination_once() {
        let cases = cases(&study(Mode::Grid));
        assert_eq!(cases.len(), 6);
        assert_eq!(cases[0].slug, "flanks_4x9__h_1");
        assert_eq!(cases[5].values, [1, 2]);
        for (i, case) in cases.iter().enumerate() {
            assert!(
                cases[..i]
                    .iter()
                    .all(|c| c.slug != case.slug && c.values != case.values)
            );
        }
    }

    #[test]
    fn folders_have_plain_names_of_their_own() {
        assert_eq!(clean("[0.98, 1.02]"), "0.98-1.02");
        assert_eq!(clean("1e-8"), "1e-8");
        assert_eq!(clean("///"), "value");
        let mut study = study(Mode::OneAtATime);
        study.parameters = vec![parameter("k", &["a b", "a-b", "a/b"], 0)];
        let slugs: Vec<String> = cases(&study).into_iter().map(|c| c.slug).collect();
        assert_eq!(slugs, ["base", "k_a-b", "k_a-b-2"]);
    }

    /// Ten thousand names that differ only after the characters that are kept.
    #[test]
    fn many_cases_with_one_name_are_told_apart() {
        let labels: Vec<String> = (0..10_000)
            .map(|i| format!("{}{i}", "x".repeat(40)))
            .collect();
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        let mut study = study(Mode::Grid);
        study.parameters = vec![parameter("k", &labels, 0)];
        let cases = cases(&study);
        assert_eq!(cases.len(), 10_000);
        assert!(cases[9_999].slug.ends_with("x-10000"), "{:?}", cases[9_999]);
        let distinct: HashSet<&str> = cases.iter().map(|c| c.slug.as_str()).collect();
        assert_eq!(distinct.len(), 10_000);
    }
}
