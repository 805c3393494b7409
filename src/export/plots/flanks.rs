//! Draws the [unrolled](crate::export::unrolled) flanks: a panel for each contact.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colour::of_value;
use super::{
    Bar, Canvas, Drawn, HEADING_HEIGHT, Heading, INK, PX, TEXT_PX, at_px, draw_bar, draw_heading,
    px, round_ticks, text_style, tick_label, write_svg,
};
use crate::export::ExportError;
use crate::export::flank::check_pairs;
use crate::export::states::OPENS;
use crate::export::unrolled::{Panel, panels};
use crate::words::figure;
use dovetail_solver::dlft::{Orbit, Response, StaticState};
use dovetail_solver::model::Model;
use dovetail_solver::results::quantities::{
    cycle_fields, static_fields, sweep_fields, with_motion,
};

const WIDTH: i32 = at_px(1400);
const LEFT: i32 = at_px(136);
const RIGHT: i32 = at_px(224);
const CAPTION: i32 = at_px(40);
/// Height of the ticks and of the name of the lower edge below a flank.
const AXIS: i32 = at_px(70);
const AXIS_NAME: i32 = at_px(40);
const TALLEST_FLANK: i32 = at_px(420);
/// Smallest height of the bar and of the legend.
const LEAST_HEIGHT: i32 = at_px(240);
/// Distance from the flanks to the bar or the legend, beyond the name of an edge.
const ASIDE: i32 = at_px(50);
const SEPARATES: RGBColor = {
    let [r, g, b] = OPENS.colour;
    RGBColor(r, g, b)
};
const STAYS: RGBColor = RGBColor(214, 219, 224);

/// Draws the static pressure on the flanks, Pa. If the static state did not converge, only the
/// title is drawn, which says so.
pub fn write_static_pressure_map(
    path: &Path,
    conditions: &str,
    model: &Model,
    state: &StaticState,
) -> Result<(), ExportError> {
    if !state.outcome.is_converged() {
        let title = format!("Static pressure: {}, no result", state.outcome.word());
        let heading = Heading {
            title: &title,
            conditions,
        };
        return write_svg(path, (WIDTH as u32 / PX, 100), |canvas| {
            draw_heading(canvas, heading)
        });
    }
    let pressure = static_fields(state, &model.pairs).pressure_pa;
    let heading = Heading {
        title: "Static pressure on the flanks",
        conditions,
    };
    write_flank_map(path, model, heading, "Pa", &pressure)
}

/// Draws the energy that friction dissipates in a period of an orbit, per area, J/m2. `what` names
/// it in the title.
pub fn write_friction_energy_map(
    path: &Path,
    conditions: &str,
    model: &Model,
    orbit: &Orbit,
    what: &str,
) -> Result<(), ExportError> {
    check_pairs(path, "pair cycles", orbit.cycles.len(), model.pairs.len())?;
    let title = format!(
        "Energy taken by friction in a period of {what}, {:.3} Hz",
        orbit.frequency_hz
    );
    let fields = cycle_fields(orbit, &model.pairs);
    let heading = Heading {
        title: &title,
        conditions,
    };
    write_flank_map(path, model, heading, "J/m²", &fields.friction_energy_j_m2)
}

/// Draws the distance that the pairs slide in a period of an orbit, m. `what` names it in the
/// title.
pub fn write_slip_map(
    path: &Path,
    conditions: &str,
    model: &Model,
    orbit: &Orbit,
    what: &str,
) -> Result<(), ExportError> {
    check_pairs(path, "pair cycles", orbit.cycles.len(), model.pairs.len())?;
    let title = format!(
        "Distance slid in a period of {what}, {:.3} Hz",
        orbit.frequency_hz
    );
    let slid_m: Vec<f64> = orbit.cycles.iter().map(|cycle| cycle.slid_m).collect();
    let heading = Heading {
        title: &title,
        conditions,
    };
    write_flank_map(path, model, heading, "m", &slid_m)
}

/// Draws the pairs that separate at any converged frequency (the paper's Figure 5).
pub fn write_separation_map(
    path: &Path,
    conditions: &str,
    model: &Model,
    response: &Response,
) -> Result<(), ExportError> {
    let separates = sweep_fields(response, model.pairs.len()).separates;
    let frequencies = || with_motion(response).map(|orbit| orbit.frequency_hz);
    let (least, most) = (
        frequencies().fold(f64::INFINITY, f64::min),
        frequencies().fold(f64::NEG_INFINITY, f64::max),
    );
    let separated = separates.iter().filter(|separates| **separates).count();
    let title = if least <= most {
        format!(
            "Pairs that open somewhere from {} to {} Hz: {separated} of {}",
            figure(least, 4),
            figure(most, 4),
            separates.len()
        )
    } else {
        "Pairs that open: no frequency converged".to_owned()
    };
    let heading = Heading {
        title: &title,
        conditions,
    };
    write_flank_flags(path, model, heading, &separates, ["opens", "never opens"])
}

/// Draws a value of each pair in colour, with a bar in `unit` (the SI prefix is chosen by the
/// largest value).
pub fn write_flank_map(
    path: &Path,
    model: &Model,
    heading: Heading<'_>,
    unit: &str,
    values: &[f64],
) -> Result<(), ExportError> {
    check_pairs(path, heading.title, values.len(), model.pairs.len())?;
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        let (path, field) = (path.to_path_buf(), heading.title.to_owned());
        return Err(ExportError::NotFinite { path, field, index });
    }
    let low = values.iter().copied().fold(0.0, f64::min);
    let high = values.iter().copied().fold(0.0, f64::max);
    let span = if high > low { high - low } else { 1.0 };
    let layout = Layout::of(model);
    write_svg(path, layout.size(), |canvas| {
        draw_heading(canvas, heading)?;
        layout.draw(canvas, |pair| of_value((values[pair] - low) / span), None)?;
        let bar = Bar {
            left: WIDTH - RIGHT + ASIDE,
            top: HEADING_HEIGHT + CAPTION,
            bottom: layout.bottom().max(HEADING_HEIGHT + LEAST_HEIGHT),
        };
        draw_bar(canvas, bar, [low, low + span], unit)
    })
}

/// Draws pairs in two colours, with a legend: `words[0]` names the flagged pairs.
pub fn write_flank_flags(
    path: &Path,
    model: &Model,
    heading: Heading<'_>,
    flags: &[bool],
    words: [&str; 2],
) -> Result<(), ExportError> {
    check_pairs(path, heading.title, flags.len(), model.pairs.len())?;
    let layout = Layout::of(model);
    write_svg(path, layout.size(), |canvas| {
        draw_heading(canvas, heading)?;
        let colour = |pair: usize| if flags[pair] { SEPARATES } else { STAYS };
        layout.draw(canvas, colour, Some(WHITE))?;
        let flagged = flags.iter().filter(|f| **f).count();
        let counts = [flagged, flags.len() - flagged];
        let x = WIDTH - RIGHT + ASIDE;
        let at = |right: i32, below: i32| (x + at_px(right), below);
        for (i, colour) in [SEPARATES, STAYS].into_iter().enumerate() {
            let y = HEADING_HEIGHT + CAPTION + at_px(58 * i as i32);
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

struct Layout {
    panels: Vec<Panel>,
    units_per_m: f64,
}

impl Layout {
    fn of(model: &Model) -> Self {
        let panels = panels(model);
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

    /// Length of panel `i` along an axis, units.
    fn extent(&self, i: usize, axis: usize) -> i32 {
        let metres = self.panels[i].high[axis] - self.panels[i].low[axis];
        (metres * self.units_per_m).ceil().max(f64::from(at_px(2))) as i32
    }

    /// Top of the plotting area of panel `i`, units.
    fn top(&self, i: usize) -> i32 {
        let above: i32 = (0..i).map(|j| CAPTION + self.extent(j, 1) + AXIS).sum();
        HEADING_HEIGHT + above + CAPTION
    }

    fn bottom(&self) -> i32 {
        let last = self.panels.len().checked_sub(1);
        last.map_or(HEADING_HEIGHT, |i| self.top(i) + self.extent(i, 1))
    }

    /// Width and height of the picture, pixels.
    fn size(&self) -> (u32, u32) {
        let height = self.bottom().max(HEADING_HEIGHT + LEAST_HEIGHT) + AXIS + AXIS_NAME;
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
        canvas.draw(&Text::new("along the flank (mm)", below, &name))?;
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

/// Draws the names of the sides left, right, below and above of a flank with this top, width and
/// height.
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
