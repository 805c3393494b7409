//! The keys of a scene file. Each entry says what the key means, its unit, its default and what is
//! valid, with a line that could stand in the file. Messages take their examples from here, and
//! docs/scene.md its tables.

use super::keys::{Key, Section, Shape, Vocabulary, fields, key};
use super::raw;

/// What a scene may say.
pub const SCENE: Vocabulary = Vocabulary {
    sections: &SECTIONS,
};

/// [`Vocabulary::example`] of a scene.
pub fn example(section: &str, key: &str) -> &'static str {
    SCENE.example(section, key)
}

/// The top of the file, then the tables in the order in which they are usually written.
const SECTIONS: [Section; 12] = [
    Section {
        name: "",
        shape: Shape::Table,
        needed: "",
        what: "",
        example: "",
        fields: fields::<raw::RawScene>,
        keys: &TOP,
    },
    Section {
        name: "reduced_model",
        shape: Shape::Table,
        needed: "in place of a mesh",
        what: "a reduced model, read from a folder",
        example: "[reduced_model]\nfolder = \"den_hartog\"\nfriction = 0.3\nforce_n = 1.0",
        fields: fields::<raw::RawReducedModel>,
        keys: &REDUCED_MODEL,
    },
    Section {
        name: "mesh",
        shape: Shape::Table,
        needed: "required",
        what: "the mesh, or the script that gmsh makes it from",
        example: "[mesh]\nfile = \"../meshes/dovetail.msh\"\nmetres_per_unit = 1e-3",
        fields: fields::<raw::RawMesh>,
        keys: &MESH,
    },
    Section {
        name: "body",
        shape: Shape::List,
        needed: "one or two",
        what: "the body that vibrates, then the one that holds it",
        example: "[[body]]\nname = \"blade\"\nvolume = \"blade\"\nyoung_pa = 113.8e9",
        fields: fields::<raw::RawBody>,
        keys: &BODY,
    },
    Section {
        name: "rotation",
        shape: Shape::Table,
        needed: "optional",
        what: "the speed about an axis",
        example: "[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 5000",
        fields: fields::<raw::RawRotation>,
        keys: &ROTATION,
    },
    Section {
        name: "contact",
        shape: Shape::List,
        needed: "one or more",
        what: "two flanks that touch, and the law between them",
        example: "[[contact]]\nname = \"left\"\nfirst = \"blade_flank_left\"\n\
                  second = \"jaw_flank_left\"\nfriction = 0.3",
        fields: fields::<raw::RawContact>,
        keys: &CONTACT,
    },
    Section {
        name: "load",
        shape: Shape::List,
        needed: "none or more",
        what: "a steady force or pressure",
        example: "[[load]]\non = \"top\"\npressure_pa = 1e6",
        fields: fields::<raw::RawLoad>,
        keys: &LOAD,
    },
    Section {
        name: "damping",
        shape: Shape::Table,
        needed: "required",
        what: "viscous damping of the material",
        example: "[damping]\nratio = 0.001",
        fields: fields::<raw::RawDamping>,
        keys: &DAMPING,
    },
    Section {
        name: "excitation",
        shape: Shape::List,
        needed: "one or more",
        what: "a harmonic force",
        example: "[[excitation]]\npoints = \"excitation\"\ndirection = [0, 1, 0]\nforce_n = 2.0",
        fields: fields::<raw::RawExcitation>,
        keys: &EXCITATION,
    },
    Section {
        name: "observe",
        shape: Shape::List,
        needed: "one or more",
        what: "a displacement that is followed",
        example: "[[observe]]\nname = \"tip\"\npoints = \"tip_trailing_edge\"\n\
                  direction = [0, 1, 0]",
        fields: fields::<raw::RawObserve>,
        keys: &OBSERVE,
    },
    Section {
        name: "static",
        shape: Shape::Table,
        needed: "optional",
        what: "how the steady load is applied",
        example: "[static]\nload_steps = 10",
        fields: fields::<raw::RawStatic>,
        keys: &STATIC,
    },
    Section {
        name: "response",
        shape: Shape::Table,
        needed: "required",
        what: "frequencies, harmonics and how they are solved",
        example: "[response]\nfrequency_hz = [440.0, 460.0]",
        fields: fields::<raw::RawResponse>,
        keys: &RESPONSE,
    },
];

const TOP: [Key; 1] = [key(
    "name",
    "text",
    "-",
    "a name; results go to `output/<name>`",
    "name = \"paper\"",
)];

const REDUCED_MODEL: [Key; 4] = [
    key(
        "folder",
        "path of a folder",
        "-",
        "holds [the files](how-to/reduced_model.md#the-folder) that `dovetail reduce` writes",
        "folder = \"den_hartog\"  # K.mtx, M.mtx and the others",
    ),
    key(
        "friction",
        "number",
        "-",
        "0 or more; Coulomb coefficient of every pair; above 1000 computed as 1000, with a \
         warning",
        "friction = 0.3",
    ),
    key(
        "gap_m",
        "number, m",
        "0",
        "0 or more; initial clearance of every pair",
        "gap_m = 0.0",
    ),
    key(
        "force_n",
        "number, N",
        "-",
        "0 or more; amplitude of the excitation in all",
        "force_n = 1.0",
    ),
];

const MESH: [Key; 8] = [
    key(
        "geometry",
        "path of a Gmsh script",
        "-",
        "meshed by the program `gmsh` in the run; the script is code that runs",
        "geometry = \"../geometry/dovetail.geo\"",
    ),
    key(
        "parameters",
        "table of numbers",
        "`{}`",
        "parameters that the script defines ([those of dovetail.geo](geometry.md)), and options of \
         gmsh; one without effect is an error, see below",
        "parameters = { nu = 4, nv = 9, order = 2 }",
    ),
    key(
        "time_limit_s",
        "number, s",
        "120",
        "more than 0, less than 1e9; gmsh is stopped after it",
        "time_limit_s = 120",
    ),
    key(
        "fallback",
        "path of a `.msh`",
        "none",
        "used where gmsh is missing and `parameters` equal `fallback_parameters`",
        "fallback = \"../meshes/dovetail.msh\"",
    ),
    key(
        "fallback_parameters",
        "table of numbers",
        "none",
        "what `fallback` was made with; required with it, meaningless without",
        "fallback_parameters = { nu = 4, nv = 9, order = 2 }",
    ),
    key(
        "file",
        "path of a `.msh`",
        "-",
        "MSH 4.1, ASCII or binary",
        "file = \"../meshes/dovetail.msh\"",
    ),
    key(
        "metres_per_unit",
        "number, m",
        "-",
        "more than 0; 1e-3 for a mesh in millimetres",
        "metres_per_unit = 1e-3  # the mesh is in millimetres",
    ),
    key(
        "pairing_tolerance",
        "number",
        "1e-6",
        "more than 0, less than 0.5; of the local node spacing: flank nodes nearer than this \
         are a pair",
        "pairing_tolerance = 1e-6",
    ),
];

const BODY: [Key; 10] = [
    key(
        "name",
        "text",
        "-",
        "a name, not that of the other body",
        "name = \"blade\"",
    ),
    key(
        "volume",
        "group",
        "-",
        "volume group, not that of the other body",
        "volume = \"blade\"  # a physical volume of the mesh",
    ),
    key(
        "young_pa",
        "number, Pa",
        "-",
        "more than 0",
        "young_pa = 113.8e9",
    ),
    key(
        "poisson",
        "number",
        "-",
        "more than -1, less than 0.5",
        "poisson = 0.34",
    ),
    key(
        "density_kg_m3",
        "number, kg/m3",
        "-",
        "more than 0",
        "density_kg_m3 = 4430",
    ),
    key(
        "fixed",
        "list of groups",
        "`[]`",
        "groups of any dimension; their nodes do not move",
        "fixed = [\"jaw_base\"]",
    ),
    key(
        "fixed_x",
        "list of groups",
        "`[]`",
        "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
         along the flank, and in both bodies alike",
        "fixed_x = [\"plane_x\"]  # a plane of symmetry",
    ),
    key(
        "fixed_y",
        "list of groups",
        "`[]`",
        "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
         along the flank, and in both bodies alike",
        "fixed_y = [\"plane_y\"]  # a plane of symmetry",
    ),
    key(
        "fixed_z",
        "list of groups",
        "`[]`",
        "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
         along the flank, and in both bodies alike",
        "fixed_z = [\"plane_z\"]  # a plane of symmetry",
    ),
    key(
        "fixed_interface_modes",
        "whole number",
        "none",
        "0 to 10,000; the body is first reduced by itself to its contact nodes and so many \
         modes (Craig-Bampton, [method.md](method.md)); without the key it is not",
        "fixed_interface_modes = 6",
    ),
];

const ROTATION: [Key; 5] = [
    key(
        "axis",
        "list of 3 numbers",
        "-",
        "not all 0; any length",
        "axis = [1, 0, 0]",
    ),
    key(
        "point_m",
        "list of 3 numbers, m",
        "`[0, 0, 0]`",
        "a point of the axis. Metres, not mesh units",
        "point_m = [0, 0, 0]",
    ),
    key(
        "speed_rpm",
        "number, rpm",
        "-",
        "0 or more, less than 1e7",
        "speed_rpm = 5000",
    ),
    key(
        "bodies",
        "list of body names",
        "all bodies",
        "which carry the load and the prestress",
        "bodies = [\"blade\", \"jaw\"]",
    ),
    key(
        "prestress",
        "text",
        "`\"held_flanks\"`",
        "`\"held_flanks\"`: geometric stiffness of the state with the contact nodes held, and \
         spin softening; `\"none\"`: the load only",
        "prestress = \"held_flanks\"",
    ),
];

const CONTACT: [Key; 9] = [
    key(
        "name",
        "text",
        "-",
        "a name, each different",
        "name = \"left\"",
    ),
    key(
        "first",
        "group",
        "-",
        "surface group of the first body",
        "first = \"blade_flank_left\"  # a physical surface of the blade",
    ),
    key(
        "second",
        "group",
        "-",
        "surface group of the second body, its corner nodes at the same places; left out \
         where there is no second body",
        "second = \"jaw_flank_left\"  # a physical surface of the jaw",
    ),
    key(
        "law",
        "text",
        "`\"unilateral_coulomb\"`",
        "`\"unilateral_coulomb\"`: compression only, dry friction; `\"bonded\"`: both sides \
         move as one, and `friction` (then not required), `gap_m` and the crown are not used",
        "law = \"bonded\"",
    ),
    key(
        "friction",
        "number",
        "- (`\"bonded\"`: none)",
        "0 or more; Coulomb coefficient, 0 for a frictionless contact; above 1000 computed as \
         1000, with a warning",
        "friction = 0.3",
    ),
    key(
        "gap_m",
        "number, m",
        "0",
        "0 or more; initial clearance",
        "gap_m = 0.0",
    ),
    key(
        "crown_radius_m",
        "number, m",
        "none",
        "more than 0; adds the clearance d^2 / (2 `crown_radius_m`)",
        "crown_radius_m = 2.0",
    ),
    key(
        "crown_axis",
        "list of 3 numbers",
        "none",
        "along the flank, any length; only with `crown_radius_m`",
        "crown_axis = [1, 0, 0]  # a cylinder along x",
    ),
    key(
        "crown_centre_m",
        "list of 3 numbers, m",
        "centroid of the flank",
        "only with `crown_radius_m`",
        "crown_centre_m = [0, 0, 0.45]",
    ),
];

const LOAD: [Key; 4] = [
    key(
        "on",
        "group",
        "-",
        "a point group (the force is shared equally by its nodes) or part of the surface of \
         one body (spread uniformly over its area)",
        "on = \"top\"  # a physical surface or point of the mesh",
    ),
    key(
        "force_n",
        "number, N",
        "-",
        "0 or more; the whole force",
        "force_n = 100.0",
    ),
    key(
        "direction",
        "list of 3 numbers",
        "-",
        "not all 0; any length",
        "direction = [0, 0, -1]",
    ),
    key(
        "pressure_pa",
        "number, Pa",
        "-",
        "any; acts along the inward normal; surface groups only",
        "pressure_pa = 1e6",
    ),
];

const DAMPING: [Key; 4] = [
    key(
        "ratio",
        "number",
        "-",
        "0 or more, less than 1; share of critical damping on linear mode `linear_mode`, by \
         stiffness-proportional damping",
        "ratio = 0.001",
    ),
    key(
        "linear_mode",
        "whole number",
        "1",
        "1 to 10,000; no more than `response.stuck_modes` where that is given; only with `ratio`",
        "linear_mode = 1",
    ),
    key(
        "stiffness_s",
        "number, s",
        "0",
        "0 or more; C = `stiffness_s` K + `mass_per_s` M",
        "stiffness_s = 1e-6",
    ),
    key(
        "mass_per_s",
        "number, 1/s",
        "0",
        "0 or more",
        "mass_per_s = 0.1",
    ),
];

const EXCITATION: [Key; 5] = [
    key(
        "points",
        "group",
        "-",
        "usually a point group",
        "points = \"excitation\"  # a physical point of the mesh",
    ),
    key(
        "direction",
        "list of 3 numbers",
        "-",
        "not all 0; any length",
        "direction = [0, 1, 0]",
    ),
    key(
        "force_n",
        "number, N",
        "-",
        "0 or more; amplitude",
        "force_n = 2.0",
    ),
    key(
        "harmonic",
        "whole number",
        "1",
        "1 to `response.harmonics`",
        "harmonic = 1",
    ),
    key(
        "phase_deg",
        "number, degrees",
        "0",
        "any",
        "phase_deg = 0.0",
    ),
];

const OBSERVE: [Key; 3] = [
    key(
        "name",
        "text",
        "-",
        "a name, each different; heads the columns `<name>_amplitude_m` and so on",
        "name = \"tip\"",
    ),
    key(
        "points",
        "group",
        "-",
        "usually a point group",
        "points = \"tip_trailing_edge\"  # a physical point of the mesh",
    ),
    key(
        "direction",
        "list of 3 numbers",
        "-",
        "not all 0; any length",
        "direction = [0, 1, 0]",
    ),
];

const STATIC: [Key; 1] = [key(
    "load_steps",
    "whole number",
    "10",
    "1 to 10,000; the load is applied in this many equal steps",
    "load_steps = 10",
)];

const RESPONSE: [Key; 15] = [
    key(
        "frequency_hz",
        "list of 2 numbers, Hz",
        "-",
        "`[from, to]` with 0 < from < to, or from = to with `points = 1`",
        "frequency_hz = [440.0, 460.0]",
    ),
    key(
        "times_first_linear_mode",
        "list of 2 numbers",
        "-",
        "the same, in multiples of the first linear frequency",
        "times_first_linear_mode = [0.98, 1.02]",
    ),
    key(
        "points",
        "whole number",
        "200",
        "1 to 1,000,000; evenly spaced, ends included",
        "points = 200",
    ),
    key(
        "most_added_points",
        "whole number",
        "12",
        "0 to 1000; frequencies that may be added at the peaks of the observed amplitudes, until the \
         parabola through the highest one and its neighbours rises at most 0.1 % above it",
        "most_added_points = 0",
    ),
    key(
        "accuracy",
        "number",
        "0.01",
        "more than 1e-4, less than 0.5; largest relative error of the observed amplitudes, where \
         `harmonics` is not given, see below",
        "accuracy = 0.01  # of the amplitude",
    ),
    key(
        "harmonics",
        "whole number",
        "none",
        "1 to 1,000; kept besides the mean, in the place of an accuracy",
        "harmonics = 3",
    ),
    key(
        "compare_harmonics",
        "whole number",
        "none",
        "1 to `harmonics`; a second response with this many, in the plots alone. Its points that \
         do not converge are crosses there, and count neither in `summary.json` nor in the exit code",
        "compare_harmonics = 1",
    ),
    key(
        "samples",
        "whole number",
        "128",
        "at most 1,048,576; at least 4 `harmonics` + 4; instants of a period at which contact is \
         decided",
        "samples = 128",
    ),
    key(
        "eps",
        "text",
        "`\"dynamic\"`",
        "`\"dynamic\"`: per pair, the median of the dynamic stiffness over the harmonics; \
         `\"pair\"`: per pair, the diagonal of the static stiffness; `\"spectral_radius\"`: \
         one value for all, the paper's ([method.md](method.md))",
        "eps = \"pair\"",
    ),
    key(
        "eps_scale",
        "number",
        "1",
        "more than 0; multiplies eps. The static state does not depend on eps",
        "eps_scale = 1.0",
    ),
    key(
        "tolerance",
        "number",
        "1e-8",
        "more than 0, less than 1; of the relative residual ([method.md](method.md)). The \
         static state takes 1e-10 or this, whichever is smaller",
        "tolerance = 1e-8",
    ),
    key(
        "max_newton_iterations",
        "whole number",
        "60",
        "1 to 100,000; of one attempt, see below",
        "max_newton_iterations = 60",
    ),
    key(
        "solver",
        "text",
        "`\"newton_krylov\"`",
        "`\"newton_krylov\"` or `\"powell\"`, the paper's; the latter is dense: small models \
         only",
        "solver = \"newton_krylov\"",
    ),
    key(
        "stuck_modes",
        "whole number",
        "as many as are needed",
        "1 to 10,000; stuck modes kept; without the key those below four times the highest \
         frequency, at least 12, and more where the estimated error of amplitudes exceeds \
         1e-4 ([method.md](method.md))",
        "stuck_modes = 20",
    ),
    key(
        "slip_threshold_m",
        "number, m",
        "1e-5 of the largest static slip",
        "0 or more; a pair counts as slipping when it slides farther than this in a period",
        "slip_threshold_m = 1e-10",
    ),
];

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::error::{Fault, SceneError};
    use crate::scene::parse;

    /// A scene with every section, in which each key of `section` can be given.
    fn scene_with(section: &str, key: &str) -> String {
        let mesh = match key {
            "file" => "file = \"a.msh\"",
            "fallback" | "fallback_parameters" => {
                "geometry = \"a.geo\"\nfallback = \"a.msh\"\nfallback_parameters = {}"
            }
            _ => "geometry = \"a.geo\"",
        };
        let load = match key {
            "pressure_pa" => "pressure_pa = 1.0",
            _ => "force_n = 1.0\ndirection = [1, 0, 0]",
        };
        let damping = match key {
            "stiffness_s" => "mass_per_s = 1.0",
            "mass_per_s" => "stiffness_s = 1.0",
            _ => "ratio = 0.001",
        };
        let range = match key {
            "frequency_hz" => "frequency_hz = [1, 2]",
            _ => "times_first_linear_mode = [0.9, 1.1]",
        };
        let body = "young_pa = 1e11\npoisson = 0.3\ndensity_kg_m3 = 4000";
        let subject = match section {
            "reduced_model" => {
                "[reduced_model]\nfolder = \"a\"\nfriction = 0.3\nforce_n = 1".to_owned()
            }
            _ => format!(
                "[mesh]\n{mesh}\nmetres_per_unit = 1e-3\n\
                 [[body]]\nname = \"a\"\nvolume = \"a\"\n{body}\n\
                 [[body]]\nname = \"b\"\nvolume = \"b\"\n{body}\nfixed = [\"base\"]\n\
                 [rotation]\naxis = [1, 0, 0]\nspeed_rpm = 5000\n\
                 [[contact]]\nname = \"c\"\nfirst = \"a1\"\nsecond = \"b1\"\nfriction = 0.3\n\
                 crown_radius_m = 1.0\n\
                 [[load]]\non = \"a2\"\n{load}\n\
                 [[excitation]]\npoints = \"p\"\ndirection = [1, 0, 0]\nforce_n = 1.0\n\
                 [[observe]]\nname = \"tip\"\npoints = \"p\"\ndirection = [1, 0, 0]"
            ),
        };
        let resolution = match key {
            "samples" | "tolerance" => "harmonics = 3\n",
            _ => "",
        };
        format!(
            "name = \"s\"\n{subject}\n[damping]\n{damping}\n[static]\n[response]\n{range}\n{resolution}"
        )
    }

    fn parsed(section: &Section, key: &Key, value: &str) -> (String, Vec<Fault>) {
        let text = scene_with(section.name, key.name);
        let path = match section.shape {
            Shape::Table => format!("{}.{}", section.name, key.name),
            Shape::List => format!("{}.0.{}", section.name, key.name),
        };
        let set = match value {
            "" => vec![],
            value => vec![format!("{path}={value}")],
        };
        let path = match section.name {
            "body" => format!("body.a.{}", key.name),
            "contact" => format!("contact.c.{}", key.name),
            "observe" => format!("observe.tip.{}", key.name),
            _ => path,
        };
        match parse(&text, "scene.toml", Path::new(""), &set) {
            Ok(scene) => (format!("{scene:?}"), vec![]),
            Err(SceneError::Invalid { problems }) => {
                (path, problems.into_iter().map(|p| p.fault).collect())
            }
            Err(error) => panic!("{error}"),
        }
    }

    fn is_out_of_range(section: &Section, key: &Key, value: &str) -> bool {
        let (path, faults) = parsed(section, key, value);
        let of_key = |f: &Fault| match f {
            Fault::OutOfRange { path: found, .. } => *found == path,
            Fault::NoHarmonic => key.name == "harmonics",
            _ => false,
        };
        faults.iter().any(of_key)
    }

    fn all_keys() -> impl Iterator<Item = (&'static Section, &'static Key)> {
        SECTIONS
            .iter()
            .filter(|s| !s.name.is_empty())
            .flat_map(|s| s.keys.iter().map(move |k| (s, k)))
    }

    /// Values within the documented limits and values just outside.
    fn probes(kind: &str, valid: &str) -> Option<(Vec<String>, Vec<String>)> {
        let phrase = valid
            .split([';', '('])
            .next()
            .unwrap()
            .trim()
            .replace(',', "");
        let words: Vec<&str> = phrase.split(' ').collect();
        let number = |word: &str| word.parse::<f64>().ok();
        let text = |v: f64| format!("{v:e}");
        if kind == "whole number" {
            let whole = |v: f64| format!("{v}");
            let (least, most) = match words[..] {
                ["at", "most", most] => (None, number(most)),
                [least, "to", most] => (number(least), number(most)),
                _ => return None,
            };
            let below = least.filter(|l| *l > 0.0).map(|l| whole(l - 1.0));
            return Some((
                least.into_iter().chain(most).map(whole).collect(),
                below
                    .into_iter()
                    .chain(most.map(|m| whole(m + 1.0)))
                    .collect(),
            ));
        }
        let step = |v: f64| v.abs().max(1e-30) * 1e-9;
        match words[..] {
            ["any"] => Some((vec![text(-1e300), text(1e300)], vec![])),
            [least, "or", "more"] => {
                let least = number(least)?;
                Some((
                    vec![text(least), text(1e300)],
                    vec![text(least - step(least))],
                ))
            }
            [least, "or", "more", "less", "than", most] => {
                let (least, most) = (number(least)?, number(most)?);
                Some((
                    vec![text(least), text(most - step(most))],
                    vec![text(least - step(least)), text(most)],
                ))
            }
            ["more", "than", least] => {
                let least = number(least)?;
                Some((
                    vec![text(least + step(least)), text(1e300)],
                    vec![text(least)],
                ))
            }
            ["more", "than", least, "less", "than", most] => {
                let (least, most) = (number(least)?, number(most)?);
                Some((
                    vec![text(least + step(least)), text(most - step(most))],
                    vec![text(least), text(most)],
                ))
            }
            _ => None,
        }
    }

    #[test]
    fn documented_limits_are_those_of_the_checks() {
        let mut probed = 0;
        for (section, key) in all_keys() {
            let is_number = key.kind == "whole number" || key.kind.starts_with("number");
            if !is_number {
                continue;
            }
            let probes = probes(key.kind, key.valid);
            let (inside, outside) =
                probes.unwrap_or_else(|| panic!("no limits: {}: {}", key.name, key.valid));
            probed += 1;
            for value in inside {
                assert!(
                    !is_out_of_range(section, key, &value),
                    "{} = {value}",
                    key.name
                );
            }
            for value in outside {
                assert!(
                    is_out_of_range(section, key, &value),
                    "{} = {value}",
                    key.name
                );
            }
        }
        assert!(probed > 30, "{probed} keys");
    }

    #[test]
    fn documented_defaults_change_nothing() {
        let mut written = 0;
        for (section, key) in all_keys() {
            let quoted = key.default.trim_matches('`');
            if toml::from_str::<toml::Table>(&format!("v = {quoted}")).is_err() {
                continue;
            }
            written += 1;
            let (without, faults) = parsed(section, key, "");
            assert!(faults.is_empty(), "{}: {faults:?}", key.name);
            let (with, _) = parsed(section, key, quoted);
            assert_eq!(with, without, "{}.{}", section.name, key.name);
        }
        assert!(written > 20, "{written} keys");
    }

    #[test]
    fn documented_words_are_those_of_the_checks() {
        let mut chosen = 0;
        for (section, key) in all_keys() {
            let (_, faults) = parsed(section, key, "\"no such word\"");
            let words = faults.iter().find_map(|f| match f {
                Fault::UnknownChoice { valid, .. } => Some(*valid),
                _ => None,
            });
            for word in words.unwrap_or_default() {
                chosen += 1;
                assert!(
                    key.valid.contains(&format!("`\"{word}\"`")),
                    "{}: {word}",
                    key.name
                );
            }
        }
        assert!(chosen > 7, "{chosen} words");
    }
}
