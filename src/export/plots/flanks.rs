//! Draws the flanks unrolled. Each contact is a panel, all in one sense: the slot runs to the right,
//! outwards is up, and the edges have names. Each pair is the patch of flank that is its tributary
//! area.

use std::collections::BTreeMap;
use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colour::of_value;
use super::{
    Bar, Canvas, Drawn, INK, PX, TEXT_PX, TITLE_HEIGHT, at_px, draw_bar, draw_title, px,
    round_ticks, text_style, tick_label, write_svg,
};
use crate::export::ExportError;
use crate::export::flank::check_pairs;
use dovetail_numerics::space::{dot, scaled, sub, unit};
use dovetail_solver::dlft::{Orbit, Response, StaticState};
use dovetail_solver::model::{Model, Rotation};
use dovetail_solver::results::quantities::{cycle_fields, static_fields, sweep_fields};

const WIDTH: i32 = at_px(1400);
const LEFT: i32 = at_px(136);
const RIGHT: i32 = at_px(224);
const CAPTION: i32 = at_px(40);
/// Under a flank: ticks, and the name of its lower edge.
const AXIS: i32 = at_px(70);
const AXIS_NAME: i32 = at_px(40);
const TALLEST_FLANK: i32 = at_px(420);
/// Least height of the bar and of the legend.
const LEAST_HEIGHT: i32 = at_px(240);
/// From the flanks to the bar or the legend, past the name of an edge.
const ASIDE: i32 = at_px(50);
/// A side of a flank is named after a direction of the machine with at least this cosine to it.
const LEAST_COSINE: f64 = 0.1;
const SEPARATES: RGBColor = RGBColor(213, 94, 0);
const STAYS: RGBColor = RGBColor(214, 219, 224);

/// Static pressure on the flanks, Pa. Where the static state did not converge nothing is drawn but
/// the title that says so.
pub fn write_static_pressure_map(
    path: &Path,
    model: &Model,
    state: &StaticState,
) -> Result<(), ExportError> {
    if !state.outcome.is_converged() {
        let title = format!("Static pressure: {}, no result", state.outcome.word());
        return write_svg(path, (WIDTH as u32 / PX, 100), |canvas| {
            draw_title(canvas, &title)
        });
    }
    let pressure = static_fields(state, &model.pairs).pressure_pa;
    write_flank_map(
        path,
        model,
        "Static pressure on the flanks",
        "Pa",
        &pressure,
    )
}

/// Friction power per area summed over the converged frequencies (the paper's Figure 6).
pub fn write_dissipation_map(
    path: &Path,
    model: &Model,
    response: &Response,
) -> Result<(), ExportError> {
    let sums = sweep_fields(response, &model.pairs);
    let title = format!(
        "Friction power summed over {} of {} frequencies",
        sums.points,
        response.orbits.len()
    );
    write_flank_map(path, model, &title, "W/m²", &sums.dissipation_sum_w_m2)
}

/// Friction power per area of one orbit, W/m2. `what` names it in the title.
pub fn write_orbit_dissipation_map(
    path: &Path,
    model: &Model,
    orbit: &Orbit,
    what: &str,
) -> Result<(), ExportError> {
    check_pairs(path, "pair cycles", orbit.cycles.len(), model.pairs.len())?;
    let title = format!("Friction power at {what}, {:.3} Hz", orbit.frequency_hz);
    let fields = cycle_fields(orbit, &model.pairs);
    write_flank_map(path, model, &title, "W/m²", &fields.dissipation_w_m2)
}

/// Pairs that separate at any converged frequency (the paper's Figure 5).
pub fn write_separation_map(
    path: &Path,
    model: &Model,
    response: &Response,
) -> Result<(), ExportError> {
    let sums = sweep_fields(response, &model.pairs);
    let opens: Vec<bool> = sums.opening_points.iter().map(|&n| n > 0).collect();
    let title = format!(
        "Pairs that separate at any of {} converged frequencies ({} computed)",
        sums.points,
        response.orbits.len()
    );
    write_flank_flags(path, model, &title, &opens, ["separates", "stays closed"])
}

/// A value per pair in colour, with a bar in `unit` (the SI prefix is chosen by the largest value).
pub fn write_flank_map(
    path: &Path,
    model: &Model,
    title: &str,
    unit: &str,
    values: &[f64],
) -> Result<(), ExportError> {
    check_pairs(path, title, values.len(), model.pairs.len())?;
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        let (path, field) = (path.to_path_buf(), title.to_owned());
        return Err(ExportError::NotFinite { path, field, index });
    }
    let low = values.iter().copied().fold(0.0, f64::min);
    let high = values.iter().copied().fold(0.0, f64::max);
    let span = if high > low { high - low } else { 1.0 };
    let layout = Layout::of(model);
    write_svg(path, layout.size(), |canvas| {
        draw_title(canvas, title)?;
        layout.draw(canvas, |pair| of_value((values[pair] - low) / span), None)?;
        let bar = Bar {
            left: WIDTH - RIGHT + ASIDE,
            top: TITLE_HEIGHT + CAPTION,
            bottom: layout.bottom().max(TITLE_HEIGHT + LEAST_HEIGHT),
        };
        draw_bar(canvas, bar, [low, low + span], unit)
    })
}

/// Pairs in two colours, with a legend: `words[0]` names the flagged ones.
pub fn write_flank_flags(
    path: &Path,
    model: &Model,
    title: &str,
    flags: &[bool],
    words: [&str; 2],
) -> Result<(), ExportError> {
    check_pairs(path, title, flags.len(), model.pairs.len())?;
    let layout = Layout::of(model);
    write_svg(path, layout.size(), |canvas| {
        draw_title(canvas, title)?;
        let colour = |pair: usize| if flags[pair] { SEPARATES } else { STAYS };
        layout.draw(canvas, colour, Some(WHITE))?;
        let flagged = flags.iter().filter(|f| **f).count();
        let counts = [flagged, flags.len() - flagged];
        let x = WIDTH - RIGHT + ASIDE;
        let at = |right: i32, below: i32| (x + at_px(right), below);
        for (i, colour) in [SEPARATES, STAYS].into_iter().enumerate() {
            let y = TITLE_HEIGHT + CAPTION + at_px(58 * i as i32);
            let square = [at(0, y), at(22, y + at_px(22))];
            canvas.draw(&Rectangle::new(square, colour.filled()))?;
            let style = text_style(TEXT_PX - 3, HPos::Left, VPos::Center);
            let lines = [words[i].to_owned(), format!("{} pairs", counts[i])];
            for (line, down) in lines.into_iter().zip([11, 35]) {
                canvas.draw(&Text::new(line, at(30, y + at_px(down)), &style))?;
            }
        }
        Ok(())
    })
}

/// A flank in its own plane.
struct Panel {
    name: String,
    /// The sides left, right, below and above.
    edges: [String; 4],
    /// Pair and outline of its patch, m, to the right and up.
    patches: Vec<(usize, Vec<[f64; 2]>)>,
    low: [f64; 2],
    high: [f64; 2],
}

struct Layout {
    panels: Vec<Panel>,
    units_per_m: f64,
}

impl Layout {
    fn of(model: &Model) -> Self {
        let panels: Vec<Panel> = (0..model.contact_names.len())
            .filter_map(|c| panel(model, c))
            .collect();
        let longest = |axis: usize| {
            panels
                .iter()
                .map(|p| p.high[axis] - p.low[axis])
                .fold(f64::MIN_POSITIVE, f64::max)
        };
        let width = f64::from(WIDTH - LEFT - RIGHT);
        let units_per_m = (width / longest(0)).min(f64::from(TALLEST_FLANK) / longest(1));
        Self {
            panels,
            units_per_m,
        }
    }

    /// Units of panel `i` along an axis.
    fn extent(&self, i: usize, axis: usize) -> i32 {
        let metres = self.panels[i].high[axis] - self.panels[i].low[axis];
        (metres * self.units_per_m).ceil().max(f64::from(at_px(2))) as i32
    }

    /// Top of the plotting area of panel `i`.
    fn top(&self, i: usize) -> i32 {
        let above: i32 = (0..i).map(|j| CAPTION + self.extent(j, 1) + AXIS).sum();
        TITLE_HEIGHT + above + CAPTION
    }

    fn bottom(&self) -> i32 {
        let last = self.panels.len().checked_sub(1);
        last.map_or(TITLE_HEIGHT, |i| self.top(i) + self.extent(i, 1))
    }

    /// Of the picture, pixels.
    fn size(&self) -> (u32, u32) {
        let height = self.bottom().max(TITLE_HEIGHT + LEAST_HEIGHT) + AXIS + AXIS_NAME;
        (WIDTH as u32 / PX, (height as u32).div_ceil(PX))
    }

    fn draw(
        &self,
        canvas: &Canvas,
        colour: impl Fn(usize) -> RGBColor,
        outline: Option<RGBColor>,
    ) -> Drawn {
        for (i, panel) in self.panels.iter().enumerate() {
            let (top, height, width) = (self.top(i), self.extent(i, 1), self.extent(i, 0));
            let place = |p: [f64; 2]| {
                let x = (p[0] - panel.low[0]) * self.units_per_m;
                let y = (panel.high[1] - p[1]) * self.units_per_m;
                (LEFT + x.round() as i32, top + y.round() as i32)
            };
            for (pair, corners) in &panel.patches {
                let mut path: Vec<(i32, i32)> = corners.iter().map(|&c| place(c)).collect();
                let fill = colour(*pair);
                canvas.draw(&Polygon::new(path.clone(), fill.filled()))?;
                // The outline in the same colour closes the hairlines between patches.
                path.extend(path.first().copied());
                canvas.draw(&PathElement::new(
                    path,
                    outline.unwrap_or(fill).stroke_width(px(1)),
                ))?;
            }
            let caption = text_style(TEXT_PX, HPos::Left, VPos::Bottom);
            canvas.draw(&Text::new(
                panel.name.clone(),
                (LEFT, top - at_px(8)),
                &caption,
            ))?;
            self.axes(canvas, panel, top, width, height)?;
            draw_edges(canvas, &panel.edges, [top, width, height])?;
        }
        let name = text_style(TEXT_PX, HPos::Center, VPos::Center);
        let below = (
            LEFT + (WIDTH - LEFT - RIGHT) / 2,
            self.bottom() + AXIS + at_px(12),
        );
        canvas.draw(&Text::new("along the slot (mm)", below, &name))?;
        let middle = (self.top(0).min(self.bottom()) + self.bottom()) / 2;
        let turned = name.transform(FontTransform::Rotate270);
        canvas.draw(&Text::new("across (mm)", (at_px(26), middle), &turned))?;
        Ok(())
    }

    fn axes(&self, canvas: &Canvas, panel: &Panel, top: i32, width: i32, height: i32) -> Drawn {
        let frame = [(LEFT, top), (LEFT + width, top + height)];
        canvas.draw(&Rectangle::new(frame, INK.stroke_width(px(1))))?;
        for axis in 0..2 {
            let (low, high) = (1e3 * panel.low[axis], 1e3 * panel.high[axis]);
            let units = if axis == 0 { width } else { height };
            let between = at_px([90, 40][axis]);
            let (ticks, step) = round_ticks(low, high, (units / between).max(2) as usize);
            for tick in ticks {
                let offset = ((tick - low) * 1e-3 * self.units_per_m).round() as i32;
                let text = tick_label(tick, step);
                let (from, to, at, style) = if axis == 0 {
                    let (x, y) = (LEFT + offset, top + height);
                    (
                        (x, y),
                        (x, y + at_px(6)),
                        (x, y + at_px(12)),
                        text_style(TEXT_PX - 3, HPos::Center, VPos::Top),
                    )
                } else {
                    let (x, y) = (LEFT, top + height - offset);
                    let style = text_style(TEXT_PX - 3, HPos::Right, VPos::Center);
                    ((x - at_px(6), y), (x, y), (x - at_px(12), y), style)
                };
                canvas.draw(&PathElement::new(vec![from, to], INK.stroke_width(px(1))))?;
                canvas.draw(&Text::new(text, at, &style))?;
            }
        }
        Ok(())
    }
}

/// The names of the sides left, right, below and above of a flank with this top, width and height.
fn draw_edges(canvas: &Canvas, edges: &[String; 4], [top, width, height]: [i32; 3]) -> Drawn {
    let end = LEFT + width;
    let upright = |h: HPos, v: VPos| text_style(TEXT_PX - 3, h, v);
    let sideways = || upright(HPos::Center, VPos::Center).transform(FontTransform::Rotate270);
    let middle = top + height / 2;
    let places = [
        ((LEFT - at_px(70), middle), sideways()),
        ((end + at_px(20), middle), sideways()),
        (
            (end, top + height + at_px(36)),
            upright(HPos::Right, VPos::Top),
        ),
        ((end, top - at_px(8)), upright(HPos::Right, VPos::Bottom)),
    ];
    for (name, (place, style)) in edges.iter().zip(&places) {
        canvas.draw(&Text::new(name.clone(), *place, style))?;
    }
    Ok(())
}

/// The flank of one contact, `None` where it has no triangles.
fn panel(model: &Model, contact: usize) -> Option<Panel> {
    let triangles: Vec<[usize; 3]> = model
        .flank_triangles
        .iter()
        .map(|t| t.map(|n| n as usize))
        .filter(|t| model.pairs[t[0]].contact == contact)
        .collect();
    let origin = model.pairs[triangles.first()?[0]].position_m;
    let [_, t1, t2] = model.pairs[triangles[0][0]].frame;
    let machine = MachineDirections::at(origin, model.rotation.as_ref());
    let (right, sides) = turned(t1, machine.axial, ["front end", "rear end"]);
    let (up, heights) = turned(t2, machine.radial, ["inner edge", "outer edge"]);
    let flat = |pair: usize| {
        let from_origin = sub(model.pairs[pair].position_m, origin);
        [dot(from_origin, right), dot(from_origin, up)]
    };
    let mut patches = patches(&triangles, flat);
    let corners = || patches.iter().flat_map(|(_, c)| c);
    let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
        corners().map(|c| c[axis]).fold(start, pick)
    };
    let low = [0, 1].map(|axis| bound(axis, f64::min, f64::INFINITY));
    let high = [0, 1].map(|axis| bound(axis, f64::max, f64::NEG_INFINITY));
    // Both axes start at the corner of the flank.
    for (_, corners) in &mut patches {
        for c in corners {
            *c = [c[0] - low[0], c[1] - low[1]];
        }
    }
    let name = model.contact_names[contact].clone();
    let [left, right] = sides;
    let [below, above] = heights;
    Some(Panel {
        name,
        edges: [left, right, below, above],
        patches,
        low: [0.0; 2],
        high: [high[0] - low[0], high[1] - low[1]],
    })
}

/// Directions that a rotating machine has at a point; none without rotation.
struct MachineDirections {
    axial: Option<[f64; 3]>,
    radial: Option<[f64; 3]>,
}

impl MachineDirections {
    fn at(point_m: [f64; 3], rotation: Option<&Rotation>) -> Self {
        let outwards = |r: &Rotation| {
            let arm = sub(point_m, r.point_m);
            unit(sub(arm, scaled(r.axis, dot(arm, r.axis))))
        };
        Self {
            axial: rotation.map(|r| r.axis),
            radial: rotation.and_then(outwards),
        }
    }
}

/// A tangent turned so that it points along a direction of the machine, and the words for the sides
/// where it comes from and where it leads. Where the machine has no such direction, or the tangent
/// lies across it, it is turned along the nearest axis of coordinates, which names the sides.
fn turned(
    tangent: [f64; 3],
    machine: Option<[f64; 3]>,
    words: [&str; 2],
) -> ([f64; 3], [String; 2]) {
    let cosine = machine.map_or(0.0, |direction| dot(tangent, direction));
    if cosine.abs() >= LEAST_COSINE {
        return (scaled(tangent, cosine.signum()), words.map(str::to_owned));
    }
    let largest = tangent.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    // The last of equals: of z and y it is z on every flank.
    let nearest = |axis: &usize| tangent[*axis].abs() >= largest * (1.0 - 1e-6);
    let axis = (0..3).rev().find(nearest).unwrap_or(2);
    let letter = ["x", "y", "z"][axis];
    (
        scaled(tangent, tangent[axis].signum()),
        ["−", "+"].map(|sign| format!("towards {sign}{letter}")),
    )
}

/// Outline of the share of each pair in its triangles: centroids and edge middles around it, and
/// the pair itself where it lies on the border.
fn patches(
    triangles: &[[usize; 3]],
    flat: impl Fn(usize) -> [f64; 2],
) -> Vec<(usize, Vec<[f64; 2]>)> {
    let mean = |points: &[[f64; 2]]| {
        let n = points.len() as f64;
        [0, 1].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / n)
    };
    let mut edges: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut around: BTreeMap<usize, Vec<[f64; 2]>> = BTreeMap::new();
    for t in triangles {
        let centroid = mean(&t.map(&flat));
        for i in 0..3 {
            let (a, b) = (t[i], t[(i + 1) % 3]);
            around.entry(a).or_default().push(centroid);
            let uses = edges.entry((a.min(b), a.max(b))).or_default();
            *uses += 1;
            if *uses == 1 {
                let middle = mean(&[flat(a), flat(b)]);
                around.entry(a).or_default().push(middle);
                around.entry(b).or_default().push(middle);
            }
        }
    }
    let mut border = std::collections::BTreeSet::new();
    for (&(a, b), &uses) in &edges {
        if uses == 1 {
            border.extend([a, b]);
        }
    }
    around
        .into_iter()
        .map(|(pair, points)| (pair, outline(flat(pair), points, border.contains(&pair))))
        .collect()
}

/// The points in order around `centre`; on the border the round starts after the widest gap and
/// ends in `centre`.
fn outline(centre: [f64; 2], mut points: Vec<[f64; 2]>, on_border: bool) -> Vec<[f64; 2]> {
    let angle = |p: &[f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
    points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    if on_border {
        let n = points.len();
        let gap = |i: usize| {
            let step = angle(&points[i]) - angle(&points[(i + n - 1) % n]);
            if i == 0 {
                step + std::f64::consts::TAU
            } else {
                step
            }
        };
        let start = (0..n)
            .max_by(|&a, &b| gap(a).total_cmp(&gap(b)))
            .unwrap_or(0);
        points.rotate_left(start);
        points.push(centre);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &[[f64; 2]]) -> f64 {
        let n = outline.len();
        let cross = |i: usize| {
            let (a, b) = (outline[i], outline[(i + 1) % n]);
            a[0] * b[1] - a[1] * b[0]
        };
        0.5 * (0..n).map(cross).sum::<f64>()
    }

    #[test]
    fn patches_are_the_tributary_areas_and_cover_the_flank() {
        // A 4 x 3 grid of nodes, 1 apart in x and 2 in y, each cell cut in two.
        let flat = |n: usize| [(n % 4) as f64, 2.0 * (n / 4) as f64];
        let mut triangles = Vec::new();
        for j in 0..2 {
            for i in 0..3 {
                let a = 4 * j + i;
                triangles.extend([[a, a + 1, a + 5], [a, a + 5, a + 4]]);
            }
        }
        let patches = patches(&triangles, flat);
        assert_eq!(patches.len(), 12);
        let mut total = 0.0;
        for (pair, corners) in &patches {
            // A third of each triangle (area 1) the node belongs to.
            let share = triangles.iter().filter(|t| t.contains(pair)).count() as f64 / 3.0;
            assert!(
                (area(corners) - share).abs() < 1e-12,
                "pair {pair}: {}",
                area(corners)
            );
            total += area(corners);
        }
        assert!((total - 12.0).abs() < 1e-12);
    }
}
