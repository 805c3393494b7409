//! Keys of a study file, from which docs/study.md has its tables.

use serde_spanned::Spanned;
use strum::{Display, EnumString, VariantNames};

use super::quantity;
use crate::scene::keys::{Vocabulary, section};
use crate::scene::kinds::Limits;

/// Combination of the values of several parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, EnumString, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum CombinationMode {
    /// Each parameter through its values while the others are at their base.
    #[default]
    OneAtATime,
    /// Every value of each parameter with every value of the others.
    Grid,
}

/// Kind of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display, EnumString, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum ParameterKind {
    /// A setting of the solution, whose values have errors.
    Numerical,
    /// A property of the bodies, or of the loads on them.
    Physical,
}

/// Keys of a study file.
pub const STUDY: Vocabulary = Vocabulary {
    former: &[],
    sections: &[TOP, PARAMETER],
};

section! {
    TOP: RawStudy, "", Table, "", "", "" {
        name: Name, "-",
            "a name; the answers go to `output/<name>`",
            "\"harmonics\"";
        scene: Text("path of a scene file"), "-",
            "the path counts from the folder of the study",
            "\"../scenes/paper.toml\"";
        set: Texts("list of texts"), "`[]`",
            "`KEY=VALUE` for all cases, as [`--set`](scene.md#--set); `--set` on the command line \
             comes after these",
            "[\"response.points=50\", \"response.compare_harmonics=\"]";
        mode: Choice(CombinationMode::VARIANTS), "`\"one_at_a_time\"`",
            "`\"one_at_a_time\"`: each parameter goes through its values while the others stand at \
             their base; `\"grid\"`: every combination, up to 10,000",
            "\"one_at_a_time\"";
        quantities: Choices(quantity::WORDS), "all of them",
            "the figures that are followed: at least one of the table below",
            "[\"peak_amplitude_m\", \"stuck_frequency_hz\"]";
        fields: Flag, "`false`",
            "whether the cases write their VTK files too (11 MB each for the paper's scene)",
            "true";
    } and {
        #[serde(default)]
        pub parameter: Vec<Spanned<RawParameter>>,
    }
}

section! {
    PARAMETER: RawParameter, "parameter", List, "one or more",
        "a key that is varied, or several together, and its values",
        "[[parameter]]\nkey = \"response.harmonics\"\nvalues = [1, 3, 5, 7]" {
        name: Name, "the last word of `key`",
            "a name; it heads a column and names folders",
            "\"flanks\"  # or key = \"response.harmonics\"";
        key: Text("text"), "none",
            "a path as for `--set`: `\"response.harmonics\"`, `\"body.*.fixed_interface_modes\"`",
            "\"response.harmonics\"";
        is: Choice(ParameterKind::VARIANTS), "by its keys",
            "`\"numerical\"`: how the model is solved, which has an error; `\"physical\"`: what is \
             built, or what acts on it. Keys of `mesh`, `response` and `static` (but \
             `static.path`) and numbers of modes are numerical, all others physical. A parameter that sets keys of both kinds is \
             physical",
            "\"physical\"";
        values: List, "-",
            "at least one, numerical ones from coarse to fine; `\"\"` leaves the key as the scene \
             has it. Without `key` each value is a table that sets several keys together: `{ label \
             = \"4 x 9\", set = { \"mesh.parameters.nu\" = 4, \"mesh.parameters.nv\" = 9 } }`",
            "[1, 3, 5, 7]";
        base: Any("a value, or its label"), "the first",
            "one of the values; it stands while other parameters are varied. With several \
             parameters one at a time it must be given",
            "3";
        size: Any("text, or list of numbers"), "none",
            "the size h that errors are compared with: `\"value\"`, `\"1/value\"`, \
             `\"1/(value-1)\"` (nodes), `\"1/(value+1)\"` (harmonics), or one number above 0 for \
             each value. Numerical parameters alone",
            "\"1/value\"";
        order: Number("", Limits::POSITIVE), "2",
            "the order that is expected of errors in the size. Numerical parameters alone",
            "2";
    }
}

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
