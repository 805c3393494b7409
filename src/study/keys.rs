//! Keys of a study file: their mirror, as [`crate::scene::raw`] is that of a scene, and their
//! declarations, from which docs/study.md has its tables.

use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use super::quantity;
use crate::scene::keys::{Key, Section, Shape, Vocabulary, fields, key};
use crate::scene::kinds::{Kind, Limits};
use crate::scene::raw::{Located, Number};

/// Words for the two kinds of a parameter.
pub(super) const NUMERICAL: &str = "numerical";
pub(super) const PHYSICAL: &str = "physical";

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawStudy {
    pub name: Located<String>,
    pub scene: Located<String>,
    #[serde(default)]
    pub set: Vec<Spanned<String>>,
    pub mode: Located<String>,
    pub quantities: Located<Vec<Spanned<String>>>,
    #[serde(default)]
    pub fields: bool,
    #[serde(default)]
    pub parameter: Vec<Spanned<RawParameter>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawParameter {
    pub name: Located<String>,
    pub key: Located<String>,
    pub is: Located<String>,
    pub values: Located<Vec<Spanned<Value>>>,
    pub base: Located<Value>,
    pub size: Located<Value>,
    pub order: Located<Number>,
}

/// Keys of a study file.
pub const STUDY: Vocabulary = Vocabulary {
    former: &[],
    sections: &[
        Section {
            name: "",
            shape: Shape::Table,
            needed: "",
            what: "",
            example: "",
            fields: fields::<RawStudy>,
            keys: &TOP,
        },
        Section {
            name: "parameter",
            shape: Shape::List,
            needed: "one or more",
            what: "a key that is varied, or several together, and its values",
            example: "[[parameter]]\nkey = \"response.harmonics\"\nvalues = [1, 3, 5, 7]",
            fields: fields::<RawParameter>,
            keys: &PARAMETER,
        },
    ],
};

const TOP: [Key; 6] = [
    key(
        "name",
        Kind::Name,
        "-",
        "a name; the answers go to `output/<name>`",
        "name = \"harmonics\"",
    ),
    key(
        "scene",
        Kind::Text("path of a scene file"),
        "-",
        "the path counts from the folder of the study",
        "scene = \"../scenes/paper.toml\"",
    ),
    key(
        "set",
        Kind::Texts("list of texts"),
        "`[]`",
        "`KEY=VALUE` for all cases, as [`--set`](scene.md#--set); `--set` on the command line \
         comes after these",
        "set = [\"response.points=50\", \"response.compare_harmonics=\"]",
    ),
    key(
        "mode",
        Kind::Choice(&["one_at_a_time", "grid"]),
        "`\"one_at_a_time\"`",
        "`\"one_at_a_time\"`: each parameter goes through its values while the others stand at their \
         base; `\"grid\"`: every combination, up to 10,000",
        "mode = \"one_at_a_time\"",
    ),
    key(
        "quantities",
        Kind::Choices(quantity::WORDS),
        "all of them",
        "the figures that are followed: at least one of the table below",
        "quantities = [\"peak_amplitude_m\", \"stuck_frequency_hz\"]",
    ),
    key(
        "fields",
        Kind::Flag,
        "`false`",
        "whether the cases write their VTK files too (11 MB each for the paper's scene)",
        "fields = true",
    ),
];

const PARAMETER: [Key; 7] = [
    key(
        "name",
        Kind::Name,
        "the last word of `key`",
        "a name; it heads a column and names folders",
        "name = \"flanks\"  # or key = \"response.harmonics\"",
    ),
    key(
        "key",
        Kind::Text("text"),
        "none",
        "a path as for `--set`: `\"response.harmonics\"`, `\"body.*.fixed_interface_modes\"`",
        "key = \"response.harmonics\"",
    ),
    key(
        "is",
        Kind::Choice(&[NUMERICAL, PHYSICAL]),
        "by its keys",
        "`\"numerical\"`: how the model is solved, which has an error; `\"physical\"`: what is \
         built, or what acts on it. Keys of `mesh`, `response` and `static` and numbers of modes \
         are numerical, all others physical. A parameter that sets keys of both kinds is physical",
        "is = \"physical\"",
    ),
    key(
        "values",
        Kind::List,
        "-",
        "at least one, numerical ones from coarse to fine; `\"\"` leaves the key as the scene has it. Without \
         `key` each value is a table that sets several keys together: `{ label = \"4 x 9\", set = \
         { \"mesh.parameters.nu\" = 4, \"mesh.parameters.nv\" = 9 } }`",
        "values = [1, 3, 5, 7]",
    ),
    key(
        "base",
        Kind::Any("a value, or its label"),
        "the first",
        "one of the values; it stands while other parameters are varied. With several parameters one at a \
         time it must be given",
        "base = 3",
    ),
    key(
        "size",
        Kind::Any("text, or list of numbers"),
        "none",
        "the size h that errors are compared with: `\"value\"`, `\"1/value\"`, `\"1/(value-1)\"` \
         (nodes), `\"1/(value+1)\"` (harmonics), or one number above 0 for each value. Numerical parameters alone",
        "size = \"1/value\"",
    ),
    key(
        "order",
        Kind::Number("", Limits::POSITIVE),
        "2",
        "the order that is expected of errors in the size. Numerical parameters alone",
        "order = 2",
    ),
];

#[cfg(test)]
mod tests {
    use super::super::quantity;

    #[test]
    fn the_page_of_studies_has_every_quantity() {
        let page = include_str!("../../docs/study.md");
        for word in quantity::WORDS {
            assert!(page.contains(&format!("`{word}`")), "{word}");
        }
    }
}
