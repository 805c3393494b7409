//! Small decks of Abaqus, written as text.

use std::fmt::Write as _;

/// Deck of a steel column along z from `foot_mm` on, 1 mm x 1 mm, of cubes: element set `name`, node sets
/// FOOT and TIP, surfaces FOOT_FACE and HEAD_FACE. Numbers of nodes and elements begin behind `before`.
pub fn column(name: &str, foot_mm: f64, cubes: usize, before: usize) -> String {
    let node = |corner: usize, level: usize| before + 4 * level + corner + 1;
    let mut deck = "*NODE\n".to_owned();
    for level in 0..=cubes {
        for (corner, [x, y]) in [[0, 0], [1, 0], [1, 1], [0, 1]].into_iter().enumerate() {
            let z = foot_mm + level as f64;
            writeln!(deck, "{}, {x}., {y}., {z:.3}", node(corner, level)).unwrap();
        }
    }
    writeln!(deck, "*ELEMENT, TYPE=C3D8I, ELSET={name}").unwrap();
    for cube in 0..cubes {
        let corners = (0..8).map(|c| node(c % 4, cube + c / 4).to_string());
        let corners: Vec<String> = corners.collect();
        writeln!(deck, "{}, {}", before + cube + 1, corners.join(", ")).unwrap();
    }
    let [foot, tip] = [0, cubes].map(|level| [0, 1, 2, 3].map(|c| node(c, level).to_string()));
    let (first, last) = (before + 1, before + cubes);
    write!(
        deck,
        "*NSET, NSET={name}_FOOT\n{}\n*NSET, NSET={name}_TIP\n{}\n*SURFACE, NAME={name}_BOTTOM\n{first}, S1\n\
         *SURFACE, NAME={name}_TOP\n{last}, S2\n",
        foot.join(", "),
        tip.join(", ")
    )
    .unwrap();
    deck
}

/// Material and sections of these element sets.
pub fn steel(names: &[&str]) -> String {
    let sections = names
        .iter()
        .map(|name| format!("*SOLID SECTION, ELSET={name}, MATERIAL=S\n"));
    format!(
        "*MATERIAL, NAME=S\n*ELASTIC\n210000., 0.3\n*DENSITY\n7.8e-9\n{}",
        sections.collect::<String>()
    )
}
