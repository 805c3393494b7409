//! Colours of curves and of fields.

use plotters::style::RGBColor;

/// Colours of Okabe and Ito (2008): blue, vermillion, green, purple, orange, sky blue.
const CURVES: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Colour of the linear curve. No state of a pair has it. The report has the same in `report.css`.
pub(super) const LINEAR: RGBColor = RGBColor(90, 90, 90);
/// Colour of a curve with another number of harmonics. No state of a pair has it. The report has
/// the same in `report.css`.
pub(super) const COMPARED: RGBColor = CURVES[5];

/// Colours of viridis (Smith and van der Walt, 2015) at 0, 0.1, ... 1.
const VIRIDIS: [[u8; 3]; 11] = [
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

/// Colour of one of `count` series: a colour of curves or, if there are more series than those, a
/// colour from dark to light.
pub(super) fn of_series(i: usize, count: usize) -> RGBColor {
    if count <= CURVES.len() {
        of_curve(i)
    } else {
        // The lightest colours are lost on white.
        of_value(0.9 * i as f64 / (count - 1) as f64)
    }
}

/// Colour of curve `i`; the colours repeat after six.
pub(super) fn of_curve(i: usize) -> RGBColor {
    CURVES[i % CURVES.len()]
}

/// Colour of a value between 0 (dark) and 1 (light); values outside are clamped.
pub(super) fn of_value(fraction: f64) -> RGBColor {
    let position = fraction.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (position as usize).min(VIRIDIS.len() - 2);
    let weight = position - below as f64;
    let mix = |channel: usize| {
        let (a, b) = (
            f64::from(VIRIDIS[below][channel]),
            f64::from(VIRIDIS[below + 1][channel]),
        );
        (a + weight * (b - a)).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_views_of_paraview_have_the_same_colours() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(root.join("views/colours.py")).unwrap();
        let (_, list) = text.split_once("VIRIDIS = [").unwrap();
        let (list, _) = list.split_once(']').unwrap();
        let words: Vec<&str> = list.split_whitespace().collect();
        let stops = VIRIDIS.map(|[r, g, b]| format!("({r}, {g}, {b})"));
        assert_eq!(words.join(" "), stops.join(", "));
    }

    #[test]
    fn values_run_from_dark_to_light_and_are_clamped() {
        assert_eq!(of_value(0.0), RGBColor(68, 1, 84));
        assert_eq!(of_value(0.5), RGBColor(33, 145, 140));
        assert_eq!(of_value(7.0), RGBColor(253, 231, 37));
        let light = |c: RGBColor| 0.2126 * c.0 as f64 + 0.7152 * c.1 as f64 + 0.0722 * c.2 as f64;
        for i in 0..100 {
            let (a, b) = (f64::from(i) / 100.0, f64::from(i + 1) / 100.0);
            assert!(light(of_value(b)) >= light(of_value(a)) - 0.7);
        }
    }
}
