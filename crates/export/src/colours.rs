//! Colours of what pairs do, of curves and of fields, one meaning each in all pictures, with the
//! words of what pairs do. `views/colours.py` has the same for ParaView.

use dovetail_solver::dlft::CycleStatus;
use serde::Serialize;

/// Red, green and blue.
pub(crate) type Colour = [u8; 3];

/// Words and colour of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct StateStyle {
    /// Verb for one pair.
    pub one: &'static str,
    /// Verb for several pairs.
    pub many: &'static str,
    pub colour: Colour,
}

/// States by the code of the status (`CycleStatus`). The colours are those of Okabe and Ito (2008),
/// which remain distinguishable in colour blindness: green, blue, vermillion, purple, orange. None
/// of them is the grey of bodies.
pub(crate) const STATES: [StateStyle; 5] = [
    state("sticks", "stick", [0, 158, 115]),
    state("slips", "slip", [0, 114, 178]),
    OPENS,
    state("closes at times", "close at times", [204, 121, 167]),
    state("stays open", "stay open", [230, 159, 0]),
];

/// State of a pair that is closed at rest and opens at times.
pub(crate) const OPENS: StateStyle = state("opens at times", "open at times", [213, 94, 0]);

const fn state(one: &'static str, many: &'static str, colour: Colour) -> StateStyle {
    StateStyle { one, many, colour }
}

/// Colour of text, axes and the result.
pub(crate) const INK: Colour = [34, 34, 34];
/// Colour of patches and cells without a value or a state.
pub(crate) const NOTHING: Colour = [214, 219, 224];

/// Kind of a curve, which determines its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(into = "String")]
pub enum CurveKind {
    /// Response with slip and separation: the result.
    Response,
    /// Response with another number of harmonics.
    Compared,
    /// Response without slip and separation.
    Linear,
    /// Ends of the range over starting tractions.
    Tractions,
    /// Power that friction takes.
    Friction,
    /// Power that viscous damping takes.
    Damping,
    /// Number of pairs in a state.
    State(CycleStatus),
}

impl CurveKind {
    /// Kinds whose curves have colours of their own.
    const OWN: [Self; 6] = [
        Self::Response,
        Self::Compared,
        Self::Linear,
        Self::Tractions,
        Self::Friction,
        Self::Damping,
    ];

    /// Colour on white.
    pub(crate) fn colour(self) -> Colour {
        match self {
            Self::Response => INK,
            Self::Compared => [86, 180, 233],
            Self::Linear => [90, 90, 90],
            Self::Tractions => [230, 159, 0],
            Self::Friction => [165, 15, 21],
            Self::Damping => [122, 122, 0],
            Self::State(status) => STATES[status as usize].colour,
        }
    }

    /// Name of its colour in the styles of a page.
    fn name(self) -> String {
        match self {
            Self::Response => "response".to_owned(),
            Self::Compared => "compared".to_owned(),
            Self::Linear => "linear".to_owned(),
            Self::Tractions => "tractions".to_owned(),
            Self::Friction => "friction".to_owned(),
            Self::Damping => "damping".to_owned(),
            Self::State(status) => STATES[status as usize].many.replace(' ', "-"),
        }
    }
}

impl From<CurveKind> for String {
    fn from(kind: CurveKind) -> Self {
        kind.name()
    }
}

/// Colours of curves as variables of a page, for light pages; report.css has those of dark ones.
pub(crate) fn style() -> String {
    let line = |name: String, [r, g, b]: Colour| format!("--{name}:rgb({r},{g},{b});");
    let curve_styles = CurveKind::OWN.map(|kind| line(kind.name(), kind.colour()));
    let states = STATES.map(|state| line(state.many.replace(' ', "-"), state.colour));
    format!(":root{{{}{}}}", curve_styles.concat(), states.concat())
}

/// Colours of Okabe and Ito (2008) for series without a meaning of their own: blue, vermillion,
/// green, purple, orange, sky blue.
const SERIES: [Colour; 6] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
];

/// Colour of one of `count` series: one of six or, if there are more series than those, a colour
/// from dark to light.
pub(crate) fn series_colour(i: usize, count: usize) -> Colour {
    if count <= SERIES.len() {
        SERIES[i % SERIES.len()]
    } else {
        // The lightest colours are lost on white.
        value_colour(0.9 * i as f64 / (count - 1) as f64)
    }
}

/// Colours of fields on flanks from the least value to the largest, in equal steps: viridis (Smith
/// and van der Walt, 2015).
pub(crate) const VIRIDIS: [Colour; 11] = [
    [68, 1, 84],
    [72, 36, 117],
    [65, 68, 135],
    [53, 95, 141],
    [42, 120, 142],
    [33, 145, 140],
    [34, 168, 132],
    [68, 191, 112],
    [122, 209, 81],
    [189, 223, 38],
    [253, 231, 37],
];

/// Colours of fields on bodies: from the grey of bodies to dark red.
pub(crate) const BODIES: [Colour; 5] = [
    [222, 225, 230],
    [253, 212, 158],
    [252, 141, 89],
    [215, 48, 31],
    [127, 0, 0],
];

/// Colour on flanks of a value between 0 (dark) and 1 (light); values outside are clamped.
pub(crate) fn value_colour(fraction: f64) -> Colour {
    let position = fraction.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (position as usize).min(VIRIDIS.len() - 2);
    let weight = position - below as f64;
    [0, 1, 2].map(|channel| {
        let [a, b] = [below, below + 1].map(|stop| f64::from(VIRIDIS[stop][channel]));
        (a + weight * (b - a)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light([r, g, b]: Colour) -> f64 {
        0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
    }

    #[test]
    fn the_views_of_paraview_have_the_same_words_and_colours() {
        let views = dovetail_testkit::folder::root().join("views/colours.py");
        let views = std::fs::read_to_string(views).unwrap();
        let views: Vec<&str> = views.split_whitespace().collect();
        let tuple = |[r, g, b]: Colour| format!("({r}, {g}, {b})");
        let state = |s: StateStyle| format!("(\"{}\", {})", s.many, tuple(s.colour));
        for (name, colours) in [
            ("STATES", STATES.map(state).join(", ")),
            ("VIRIDIS", VIRIDIS.map(tuple).join(", ")),
            ("BODIES", BODIES.map(tuple).join(", ")),
        ] {
            let list = format!("{name} = [{colours}]");
            assert!(views.join(" ").contains(&list), "{list}");
        }
    }

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
    fn fields_on_flanks_grow_lighter_and_fields_on_bodies_darker() {
        assert_eq!(value_colour(0.0), VIRIDIS[0]);
        assert_eq!(value_colour(0.5), VIRIDIS[5]);
        assert_eq!(value_colour(7.0), VIRIDIS[10]);
        for i in 0..100 {
            let [a, b] = [i, i + 1].map(|i| light(value_colour(f64::from(i) / 100.0)));
            assert!(b >= a - 0.7);
        }
        assert!(BODIES.windows(2).all(|two| light(two[0]) > light(two[1])));
    }
}
