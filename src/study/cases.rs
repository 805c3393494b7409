//! Makes the cases of a study from its parameters. Each case is a run of its own.

use std::collections::HashSet;

use crate::study_file::Study;
use crate::study_file::keys::{CombinationMode, ParameterKind};
use crate::study_file::parameter::{Parameter, ParameterValue};

/// One run, with a value of each parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name of its folder.
    pub slug: String,
    /// Position of the value of each parameter among its values.
    pub values: Vec<usize>,
}

/// Parameter and one of its values.
pub type Chosen<'s> = (&'s Parameter, &'s ParameterValue);

impl Case {
    /// `KEY=VALUE` texts for `--set`, those of the study first.
    pub fn set(&self, study: &Study) -> Vec<String> {
        let of_parameters = study.chosen(&self.values).flat_map(|(_, v)| &v.set);
        study.set.iter().chain(of_parameters).cloned().collect()
    }
}

impl Study {
    /// Parameters, each with its value at these positions.
    pub fn chosen<'s>(&'s self, values: &'s [usize]) -> impl Iterator<Item = Chosen<'s>> {
        let parameters = self.parameters.iter().zip(values);
        parameters.map(|(p, v)| (p, &p.values[*v]))
    }

    /// Physical parameters, each with its value at these positions.
    pub fn physical<'s>(&'s self, values: &'s [usize]) -> impl Iterator<Item = Chosen<'s>> {
        self.chosen(values)
            .filter(|(p, _)| p.kind == ParameterKind::Physical)
    }

    /// Text of the physical parameters, such as ` at friction 0.3, force 1.0 N`; empty if there are
    /// none.
    pub fn case_conditions(&self, values: &[usize]) -> String {
        match words(self.physical(values)) {
            none if none.is_empty() => none,
            words => format!(" at {words}"),
        }
    }

    /// Position of the value of each parameter around which others are varied: its base or, for a
    /// numerical parameter in a grid, its finest value.
    pub fn centre(&self) -> Vec<usize> {
        let is_finest = |p: &Parameter| {
            self.mode == CombinationMode::Grid && p.kind == ParameterKind::Numerical
        };
        let value = |p: &Parameter| if is_finest(p) { p.last() } else { p.base };
        self.parameters.iter().map(value).collect()
    }
}

/// Text of parameters and their values, such as `friction 0.3, force 1.0 N`.
pub fn words<'s>(chosen: impl Iterator<Item = Chosen<'s>>) -> String {
    let words = chosen.map(|(p, v)| p.words(v));
    words.collect::<Vec<_>>().join(", ")
}

/// All cases. One at a time the base comes first, then one parameter after the other; in a grid the
/// last parameter varies fastest.
pub fn cases(study: &Study) -> Vec<Case> {
    let base: Vec<usize> = study.parameters.iter().map(|p| p.base).collect();
    let counts = study.parameters.iter().map(|p| p.values.len());
    let designs: Vec<Vec<usize>> = match study.mode {
        CombinationMode::OneAtATime => {
            let values = |(k, count): (usize, usize)| (0..count).map(move |v| (k, v));
            let others = counts.enumerate().flat_map(values);
            let others = others.filter(|(k, v)| *v != base[*k]).map(|(k, v)| {
                let mut values = base.clone();
                values[k] = v;
                values
            });
            std::iter::once(base.clone()).chain(others).collect()
        }
        CombinationMode::Grid => counts.fold(vec![Vec::new()], |all, count| {
            let shorter = all.iter();
            let longer =
                shorter.flat_map(|short| (0..count).map(move |v| [&short[..], &[v]].concat()));
            longer.collect()
        }),
    };
    let mut taken = HashSet::new();
    let mut case = |(i, values): (usize, Vec<usize>)| {
        let chosen = study.chosen(&values).zip(values.iter().zip(&base));
        let named =
            chosen.filter(|(_, (v, base))| study.mode == CombinationMode::Grid || v != base);
        let name = slug(named.map(|(chosen, _)| chosen));
        let name = if name.is_empty() { "base" } else { &name };
        let mut slug: String = name.chars().take(180).collect();
        // Some file systems do not distinguish small letters from capitals.
        while !taken.insert(slug.to_ascii_lowercase()) {
            slug += &format!("-{i}");
        }
        Case { slug, values }
    };
    designs.into_iter().enumerate().map(&mut case).collect()
}

/// Part of a file name for parameters and their values, such as `friction_0.3__force_n_1.0`.
pub fn slug<'s>(chosen: impl Iterator<Item = Chosen<'s>>) -> String {
    let word = |(p, v): Chosen<'_>| format!("{}_{}", p.name, clean(&v.label));
    chosen.map(word).collect::<Vec<_>>().join("__")
}

/// Label with only letters, digits, points and signs; `4 x 9` becomes `4x9`.
fn clean(label: &str) -> String {
    let mut text = String::new();
    for c in label.replace(" x ", "x").chars() {
        if c.is_ascii_alphanumeric() || matches!(c, '.' | '+' | '_') {
            text.push(c);
        } else if !text.is_empty() && !text.ends_with('-') {
            text.push('-');
        }
    }
    match text.trim_end_matches('-') {
        "" => "value".to_owned(),
        text => text.chars().take(40).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            kind: ParameterKind::Numerical,
            values: labels.iter().map(value).collect(),
            base,
            size_name: String::new(),
            order: 2.0,
            span: 0..0,
        }
    }

    fn study(mode: CombinationMode) -> Study {
        Study {
            set: vec!["x=1".into()],
            mode,
            parameters: vec![
                parameter("flanks", &["4 x 9", "8 x 18"], 0),
                parameter("h", &["1", "3", "7"], 1),
            ],
            ..Study::default()
        }
    }

    #[test]
    fn one_at_a_time_varies_each_parameter_around_the_base() {
        let study = study(CombinationMode::OneAtATime);
        let cases = cases(&study);
        let slugs: Vec<&str> = cases.iter().map(|c| c.slug.as_str()).collect();
        assert_eq!(slugs, ["base", "flanks_8x18", "h_1", "h_7"]);
        assert_eq!(cases[1].set(&study), ["x=1", "flanks=8 x 18", "h=3"]);
    }

    #[test]
    fn a_grid_has_every_combination_once() {
        let cases = cases(&study(CombinationMode::Grid));
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
    fn physical_parameters_have_words() {
        let mut study = study(CombinationMode::Grid);
        assert_eq!(study.case_conditions(&[0, 1]), "");
        study.parameters[0].kind = ParameterKind::Physical;
        assert_eq!(study.case_conditions(&[1, 1]), " at flanks 8 x 18");
        assert_eq!(slug(study.physical(&[1, 1])), "flanks_8x18");
        assert_eq!(study.centre(), [0, 2]);
    }

    #[test]
    fn folders_have_plain_names_of_their_own() {
        assert_eq!(clean("[0.98, 1.02]"), "0.98-1.02");
        assert_eq!(clean("1e-8"), "1e-8");
        assert_eq!(clean("///"), "value");
        let mut study = study(CombinationMode::OneAtATime);
        study.parameters = vec![parameter("k", &["a b", "a-b", "a/b", "A-b"], 0)];
        let slugs: Vec<String> = cases(&study).into_iter().map(|c| c.slug).collect();
        assert_eq!(slugs, ["base", "k_a-b", "k_a-b-2", "k_A-b-3"]);
    }

    /// Ten thousand names that differ only after the characters that are kept.
    #[test]
    fn many_cases_with_one_name_are_told_apart() {
        let labels: Vec<String> = (0..10_000)
            .map(|i| format!("{}{i}", "x".repeat(40)))
            .collect();
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        let mut study = study(CombinationMode::Grid);
        study.parameters = vec![parameter("k", &labels, 0)];
        let cases = cases(&study);
        let distinct: HashSet<&str> = cases.iter().map(|c| c.slug.as_str()).collect();
        assert_eq!(distinct.len(), 10_000);
    }
}
