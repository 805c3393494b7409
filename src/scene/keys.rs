//! The keys of a scene file: which exist, what an example of each looks like.

use serde::de::{self, Deserialize, Deserializer, Visitor};

use super::raw;

/// Whether a section is written `[section]` or, once per item, `[[section]]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Table,
    List,
}

/// What a kind of file may say.
pub struct Vocabulary {
    /// The tables at the top of the file, in the order they are usually written.
    pub sections: &'static [(&'static str, Shape)],
    /// The keys that a section accepts (`""`: the top of the file).
    pub of_section: fn(&str) -> &'static [&'static str],
    /// A line that could stand in the file, by section and key.
    pub example: fn(&str, &str) -> &'static str,
}

pub const SCENE: Vocabulary = Vocabulary {
    sections: &SECTIONS,
    of_section,
    example,
};

/// The tables at the top of a scene, in the order they are usually written.
pub const SECTIONS: [(&str, Shape); 11] = [
    ("reduced_model", Shape::Table),
    ("mesh", Shape::Table),
    ("body", Shape::List),
    ("rotation", Shape::Table),
    ("contact", Shape::List),
    ("load", Shape::List),
    ("damping", Shape::Table),
    ("excitation", Shape::List),
    ("observe", Shape::List),
    ("static", Shape::Table),
    ("response", Shape::Table),
];

/// The keys a section accepts (`""`: the top of the file), in the order of the mirror in
/// [`super::raw`]; empty for a section that does not exist.
pub fn of_section(section: &str) -> &'static [&'static str] {
    match section {
        "" => fields::<raw::RawScene>(),
        "reduced_model" => fields::<raw::RawReducedModel>(),
        "mesh" => fields::<raw::RawMesh>(),
        "body" => fields::<raw::RawBody>(),
        "rotation" => fields::<raw::RawRotation>(),
        "contact" => fields::<raw::RawContact>(),
        "load" => fields::<raw::RawLoad>(),
        "damping" => fields::<raw::RawDamping>(),
        "excitation" => fields::<raw::RawExcitation>(),
        "observe" => fields::<raw::RawObserve>(),
        "static" => fields::<raw::RawStatic>(),
        "response" => fields::<raw::RawResponse>(),
        _ => &[],
    }
}

/// A line that could stand in the file, for messages; a section's example is its first lines.
pub fn example(section: &str, key: &str) -> &'static str {
    match (section, key) {
        ("", "name") => "name = \"paper\"",
        ("", "reduced_model") => {
            "[reduced_model]\nfolder = \"den_hartog\"\nfriction = 0.3\nforce_n = 1.0"
        }
        ("", "mesh") => "[mesh]\nfile = \"../meshes/dovetail.msh\"\nmetres_per_unit = 1e-3",
        ("", "body") => "[[body]]\nname = \"blade\"\nvolume = \"blade\"\nyoung_pa = 113.8e9",
        ("", "rotation") => "[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 5000",
        ("", "contact") => {
            "[[contact]]\nname = \"left\"\nfirst = \"blade_flank_left\"\n\
             second = \"jaw_flank_left\"\nfriction = 0.3"
        }
        ("", "load") => "[[load]]\non = \"top\"\npressure_pa = 1e6",
        ("", "damping") => "[damping]\nratio = 0.001",
        ("", "excitation") => {
            "[[excitation]]\npoints = \"excitation\"\ndirection = [0, 1, 0]\nforce_n = 2.0"
        }
        ("", "observe") => {
            "[[observe]]\nname = \"tip\"\npoints = \"tip_trailing_edge\"\ndirection = [0, 1, 0]"
        }
        ("", "static") => "[static]\nload_steps = 10",
        ("", "response") => "[response]\nfrequency_hz = [440.0, 460.0]",
        ("reduced_model", "folder") => "folder = \"den_hartog\"  # K.mtx, M.mtx and the others",
        ("reduced_model", "friction") => "friction = 0.3",
        ("reduced_model", "gap_m") => "gap_m = 0.0",
        ("reduced_model", "force_n") => "force_n = 1.0",
        ("mesh", "geometry") => "geometry = \"../geometry/dovetail.geo\"",
        ("mesh", "parameters") => "parameters = { nu = 4, nv = 9, order = 2 }",
        ("mesh", "time_limit_s") => "time_limit_s = 120",
        ("mesh", "fallback") => "fallback = \"../meshes/dovetail.msh\"",
        ("mesh", "fallback_parameters") => "fallback_parameters = { nu = 4, nv = 9, order = 2 }",
        ("mesh", "file") => "file = \"../meshes/dovetail.msh\"",
        ("mesh", "metres_per_unit") => "metres_per_unit = 1e-3  # the mesh is in millimetres",
        ("mesh", "pairing_tolerance") => "pairing_tolerance = 1e-6",
        ("body", "name") => "name = \"blade\"",
        ("body", "volume") => "volume = \"blade\"  # a physical volume of the mesh",
        ("body", "young_pa") => "young_pa = 113.8e9",
        ("body", "poisson") => "poisson = 0.34",
        ("body", "density_kg_m3") => "density_kg_m3 = 4430",
        ("body", "fixed") => "fixed = [\"jaw_base\"]",
        ("body", "fixed_x") => "fixed_x = [\"plane_x\"]  # a plane of symmetry",
        ("body", "fixed_y") => "fixed_y = [\"plane_y\"]  # a plane of symmetry",
        ("body", "fixed_z") => "fixed_z = [\"plane_z\"]  # a plane of symmetry",
        ("body", "fixed_interface_modes") => "fixed_interface_modes = 6",
        ("rotation", "axis") => "axis = [1, 0, 0]",
        ("rotation", "point_m") => "point_m = [0, 0, 0]",
        ("rotation", "speed_rpm") => "speed_rpm = 5000",
        ("rotation", "bodies") => "bodies = [\"blade\", \"jaw\"]",
        ("rotation", "prestress") => "prestress = \"held_flanks\"",
        ("contact", "name") => "name = \"left\"",
        ("contact", "first") => "first = \"blade_flank_left\"  # a physical surface of the blade",
        ("contact", "second") => "second = \"jaw_flank_left\"  # a physical surface of the jaw",
        ("contact", "law") => "law = \"bonded\"",
        ("contact", "friction") => "friction = 0.3",
        ("contact", "gap_m") => "gap_m = 0.0",
        ("contact", "crown_radius_m") => "crown_radius_m = 2.0",
        ("contact", "crown_axis") => "crown_axis = [1, 0, 0]  # a cylinder along x",
        ("contact", "crown_centre_m") => "crown_centre_m = [0, 0, 0.45]",
        ("load", "on") => "on = \"top\"  # a physical surface or point of the mesh",
        ("load", "force_n") => "force_n = 100.0",
        ("load", "direction") => "direction = [0, 0, -1]",
        ("load", "pressure_pa") => "pressure_pa = 1e6",
        ("damping", "ratio") => "ratio = 0.001",
        ("damping", "stuck_mode") => "stuck_mode = 1",
        ("damping", "stiffness_s") => "stiffness_s = 1e-6",
        ("damping", "mass_per_s") => "mass_per_s = 0.1",
        ("excitation", "points") => "points = \"excitation\"  # a physical point of the mesh",
        ("excitation", "direction") => "direction = [0, 1, 0]",
        ("excitation", "force_n") => "force_n = 2.0",
        ("excitation", "harmonic") => "harmonic = 1",
        ("excitation", "phase_deg") => "phase_deg = 0.0",
        ("observe", "name") => "name = \"tip\"",
        ("observe", "points") => "points = \"tip_trailing_edge\"  # a physical point of the mesh",
        ("observe", "direction") => "direction = [0, 1, 0]",
        ("static", "load_steps") => "load_steps = 10",
        ("response", "frequency_hz") => "frequency_hz = [440.0, 460.0]",
        ("response", "times_first_stuck_mode") => "times_first_stuck_mode = [0.98, 1.02]",
        ("response", "points") => "points = 200",
        ("response", "accuracy") => "accuracy = 0.01  # of the amplitude",
        ("response", "harmonics") => "harmonics = 3",
        ("response", "compare_harmonics") => "compare_harmonics = 1",
        ("response", "samples") => "samples = 128",
        ("response", "eps") => "eps = \"pair\"",
        ("response", "eps_scale") => "eps_scale = 1.0",
        ("response", "tolerance") => "tolerance = 1e-8",
        ("response", "max_newton_iterations") => "max_newton_iterations = 60",
        ("response", "solver") => "solver = \"newton_krylov\"",
        ("response", "stuck_modes") => "stuck_modes = 20",
        ("response", "slip_threshold_m") => "slip_threshold_m = 1e-10",
        _ => "",
    }
}

/// The word of `valid` that `word` is most likely meant to be: at most a third of its letters differ
/// (Damerau-Levenshtein distance), or one is the other with something appended.
pub fn nearest<S: AsRef<str>>(word: &str, valid: &[S]) -> Option<String> {
    let lower = word.to_lowercase();
    let appended = |v: &str| {
        v.len() >= 3 && lower.len() >= 3 && (v.starts_with(&lower) || lower.starts_with(v))
    };
    valid
        .iter()
        .map(|v| v.as_ref())
        .map(|v| (distance(&lower, &v.to_lowercase()), v))
        .filter(|(d, v)| 3 * d <= v.chars().count().max(3) || appended(v))
        .min_by_key(|(d, _)| *d)
        .map(|(_, v)| v.to_owned())
}

/// Letters to insert, delete, replace or swap with their neighbour to turn `a` into `b`.
fn distance(a: &str, b: &str) -> usize {
    // Quadratic in the length: a key of the file can be of any length, a near one cannot.
    let (a, b): (Vec<char>, Vec<char>) =
        (a.chars().take(64).collect(), b.chars().take(64).collect());
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

/// The field names serde's derive gave to `T`, so that they are written once only.
pub fn fields<'de, T: Deserialize<'de>>() -> &'static [&'static str] {
    match T::deserialize(FieldsOnly) {
        Err(Fields(names)) => names,
        Ok(_) => &[],
    }
}

struct FieldsOnly;

#[derive(Debug)]
struct Fields(&'static [&'static str]);

impl std::fmt::Display for Fields {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}

impl std::error::Error for Fields {}

impl de::Error for Fields {
    fn custom<M: std::fmt::Display>(_: M) -> Self {
        Fields(&[])
    }
}

impl<'de> Deserializer<'de> for FieldsOnly {
    type Error = Fields;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Fields> {
        Err(Fields(&[]))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Fields> {
        Err(Fields(names))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option
        unit unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_has_an_example_that_sets_it() {
        for section in std::iter::once("").chain(SECTIONS.map(|(s, _)| s)) {
            let keys = of_section(section);
            assert!(!keys.is_empty(), "{section}");
            for key in keys {
                let line = example(section, key);
                let table: toml::Table = line.parse().unwrap_or_else(|e| panic!("{line}: {e}"));
                assert!(table.contains_key(*key), "{section}.{key}: {line:?}");
            }
        }
    }

    #[test]
    fn sections_are_the_tables_of_the_mirror() {
        let mut sections: Vec<&str> = SECTIONS.iter().map(|(s, _)| *s).chain(["name"]).collect();
        let mut keys = of_section("").to_vec();
        sections.sort_unstable();
        keys.sort_unstable();
        assert_eq!(sections, keys);
    }

    #[test]
    fn near_words_are_found_and_far_ones_are_not() {
        let keys = of_section("response");
        assert_eq!(nearest("pionts", keys).as_deref(), Some("points"));
        assert_eq!(nearest("Harmonic", keys).as_deref(), Some("harmonics"));
        assert_eq!(nearest("frequency", keys).as_deref(), Some("frequency_hz"));
        assert_eq!(nearest("colour", keys), None);
        assert_eq!(distance("abcd", "acbd"), 1);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("kitten", "sitting"), 3);
    }
}
