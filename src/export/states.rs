//! Words and colours of the states of a pair in a period, the same in all pictures.

use serde::Serialize;

/// Words and colour of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct State {
    /// Verb for one pair.
    pub one: &'static str,
    /// Verb for several pairs.
    pub many: &'static str,
    /// Red, green and blue.
    pub colour: [u8; 3],
}

/// States by the code of the status (`CycleStatus`). The colours are those of Okabe and Ito (2008),
/// which remain distinguishable in colour blindness: green, blue, vermillion, purple, orange. None
/// of them is the grey of bodies.
pub(super) const STATES: [State; 5] = [
    state("sticks", "stick", [0, 158, 115]),
    state("slips", "slip", [0, 114, 178]),
    OPENS,
    state("closes at times", "close at times", [204, 121, 167]),
    state("stays open", "stay open", [230, 159, 0]),
];

/// State of a pair that is closed at rest and opens at times.
pub(super) const OPENS: State = state("opens at times", "open at times", [213, 94, 0]);

const fn state(one: &'static str, many: &'static str, colour: [u8; 3]) -> State {
    State { one, many, colour }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_solver::dlft::CycleStatus;

    #[test]
    fn each_code_has_its_words() {
        for (status, words) in [
            (CycleStatus::Stuck, "sticks"),
            (CycleStatus::Slipping, "slips"),
            (CycleStatus::Opening, "opens at times"),
            (CycleStatus::Closing, "closes at times"),
            (CycleStatus::Open, "stays open"),
        ] {
            assert_eq!(STATES[status as usize].one, words);
        }
    }

    #[test]
    fn the_views_of_paraview_have_these_words_and_colours() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(root.join("views/colours.py")).unwrap();
        let (_, list) = text.split_once("STATES = [").unwrap();
        let (list, _) = list.split_once("]\n").unwrap();
        let written: Vec<&str> = list.split("),").map(str::trim).collect();
        for (state, written) in STATES.iter().zip(&written) {
            let State { many, colour, .. } = state;
            let [r, g, b] = colour;
            let expected = format!("(\"{many}\", ({r}, {g}, {b})");
            assert!(
                written
                    .trim_end_matches(')')
                    .starts_with(expected.trim_end_matches(')'))
            );
        }
        assert_eq!(
            written.iter().filter(|w| !w.is_empty()).count(),
            STATES.len()
        );
    }
}
