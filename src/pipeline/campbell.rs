//! Computes frequencies over the speed, for the table and the diagram of `dovetail modes --rpm`.

use std::collections::BTreeSet;

use super::error::RunError;
use super::meshed::Bound;
use super::prestress::assemble;
use super::progress::Progress;
use super::{Context, hertz, summary};
use crate::export::csv::{CampbellRow, CrossingRow};
use crate::export::manifest::{self, Summary};
use crate::export::plots::{CampbellFamily, EngineOrders, Operation};
use crate::stage::Stage;
use crate::warning::Weight;
use dovetail_numerics::sparse::sum;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::fem::{BodyMatrices, Structure};
use dovetail_solver::model::{Body, Model, Prestress, RotationSpec};
use dovetail_solver::reduction::craig_bampton::fixed_interface_modes;
use dovetail_solver::reduction::{LISTED_MODES, ReductionError, stuck_modes};

/// Without a list of engine orders crossings with those up to this one are listed.
const MOST_ENGINE_ORDER: usize = 36;
/// Of these the diagram has those whose names have room, besides those that are named in the text.
const DRAWN_ENGINE_ORDERS: [usize; 12] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 36];
/// Most speeds of one table.
const MOST_SPEEDS: usize = 10_000;

/// Speeds of a Campbell table: `points` of them, evenly spaced, ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRange {
    from_rpm: f64,
    to_rpm: f64,
    points: usize,
}

/// Why a text is no [`SpeedRange`].
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SpeedRangeError {
    #[error("`{0}` is not FROM:TO:N, such as 0:8000:9")]
    Form(String),
    #[error("speeds must be from 0 to below 1e7 rpm and ascend, not {from} to {to}")]
    Speeds { from: f64, to: f64 },
    #[error(
        "the number of speeds must be from 2 to {MOST_SPEEDS} (1 where both ends are equal), not {0}"
    )]
    Points(usize),
}

impl std::str::FromStr for SpeedRange {
    type Err = SpeedRangeError;

    fn from_str(text: &str) -> Result<Self, SpeedRangeError> {
        let form = || SpeedRangeError::Form(text.to_string());
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let [from, to, points] = parts[..] else {
            return Err(form());
        };
        let speed = |s: &str| s.parse::<f64>().ok().filter(|v| v.is_finite());
        let (from, to) = (speed(from).ok_or_else(form)?, speed(to).ok_or_else(form)?);
        let points: usize = points.parse().map_err(|_| form())?;
        if !(0.0 <= from && from <= to && to < 1e7) {
            return Err(SpeedRangeError::Speeds { from, to });
        }
        if points > MOST_SPEEDS || points < if from == to { 1 } else { 2 } {
            return Err(SpeedRangeError::Points(points));
        }
        Ok(Self {
            from_rpm: from,
            to_rpm: to,
            points,
        })
    }
}

impl SpeedRange {
    /// The speeds, rpm, ascending.
    pub fn values_rpm(&self) -> Vec<f64> {
        let last = (self.points - 1).max(1) as f64;
        let step = (self.to_rpm - self.from_rpm) / last;
        (0..self.points)
            .map(|i| match i + 1 {
                n if n == self.points && n > 1 => self.to_rpm,
                _ => self.from_rpm + step * i as f64,
            })
            .collect()
    }
}

/// Modes at each speed: of the first body with its flanks held (full model), and of the stuck assembly.
/// Mesh, pairs, stiffness and mass are made once: under rotation the stiffness is a parabola of the
/// speed, so that two assemblies, at rest and at the highest speed, give it at any.
///
/// A speed that the structure does not stand has no frequencies, and a warning says why.
///
/// # Errors
/// [`RunError::NoMesh`], [`RunError::NoRotation`] without an axis; else those of [`modes`](super::modes) at the lowest speed.
/// `engine_orders` are those whose crossings are wanted; none: all up to 36.
pub fn campbell(
    scene: &Scene,
    speeds: SpeedRange,
    engine_orders: &[usize],
    context: &Context,
    progress: &Progress,
) -> Result<Campbell, RunError> {
    let Subject::Assembly(assembly) = &scene.subject else {
        return Err(RunError::NoMesh {
            scene: scene.name.clone(),
        });
    };
    let operating_rpm = assembly
        .rotation
        .as_ref()
        .map_or(0.0, RotationSpec::speed_rpm);
    let mut fastest = assembly.clone();
    let rotation = fastest.rotation.as_mut().ok_or(RunError::NoRotation)?;
    rotation.speed_rad_s = speeds.to_rpm * std::f64::consts::PI / 30.0;
    if rotation.prestress == Prestress::Contact {
        progress.note(
            "modes over the speed: the stress is that with all pairs stuck, a multiple of the square of the speed; that of \
             the static state with contact is in `dovetail modes` at one speed",
        );
    }
    let bound = Bound::of(&fastest, context, progress)?;
    let model = &bound.model;
    let spun = Spun::of(model, progress)?;
    let mut all = Vec::new();
    {
        let _stage = progress.stage(Stage::ModesAtSpeeds);
        let steps = progress.steps(speeds.points, "speeds");
        for rpm in speeds.values_rpm() {
            let share = match speeds.to_rpm {
                0.0 => 0.0,
                to => (rpm / to).powi(2),
            };
            let modes = match spun.modes(model, share) {
                Ok(modes) => Some(modes),
                // At the lowest speed it is the scene that is at fault, not the speed.
                Err(
                    error @ (ReductionError::InteriorUnstable { .. }
                    | ReductionError::NotHeld { .. }),
                ) if rpm > speeds.from_rpm => {
                    progress.warning(Weight::Wrong, format!("no modes at {rpm} rpm: {error}"));
                    None
                }
                Err(error) => return Err(error.into()),
            };
            all.push((rpm, modes));
            steps.step();
        }
    }
    let families = families(&model.bodies[0], &all);
    let mut summary = summary::empty(scene, context);
    summary.pairs = model.pairs.len();
    summary.observations = manifest::observation_summaries(model);
    summary.mesh = Some(bound.summary());
    summary::take_down(progress, &mut summary);
    let mut engine_orders = engine_orders.to_vec();
    engine_orders.sort_unstable();
    engine_orders.dedup();
    Ok(Campbell {
        families,
        engine_orders,
        operating_rpm,
        summary,
    })
}

/// Modes over the speed.
#[derive(Debug)]
pub struct Campbell {
    families: [Family; 2],
    /// Those that were asked for, rising; none: all up to [`MOST_ENGINE_ORDER`].
    engine_orders: Vec<usize>,
    /// The speed of the scene.
    pub operating_rpm: f64,
    pub summary: Summary,
}

impl Campbell {
    /// Rows of modes_campbell.csv.
    pub fn rows(&self) -> Vec<CampbellRow> {
        self.families.iter().flat_map(Family::rows).collect()
    }

    /// Of the diagram.
    pub fn curves(&self) -> Vec<CampbellFamily> {
        self.families.iter().map(Family::curves).collect()
    }

    /// Where modes cross engine orders: rows of modes_crossings.csv, rising in speed.
    pub fn crossings(&self) -> Vec<CrossingRow> {
        let orders = self.crossed();
        let families = self.families.iter();
        let mut rows: Vec<CrossingRow> = families.flat_map(|f| f.crossings(&orders)).collect();
        rows.sort_by(|a, b| a.speed_rpm.total_cmp(&b.speed_rpm));
        rows
    }

    /// The engine orders whose crossings are found.
    fn crossed(&self) -> Vec<usize> {
        match self.engine_orders.is_empty() {
            true => (1..=MOST_ENGINE_ORDER).collect(),
            false => self.engine_orders.clone(),
        }
    }

    /// Of each mode the crossing nearest to the speed of the scene.
    fn nearest(&self) -> Vec<CrossingRow> {
        let (orders, rpm) = (self.crossed(), self.operating_rpm);
        let families = self.families.iter().filter(|_| rpm > 0.0);
        families
            .flat_map(|f| f.nearest_crossings(&orders, rpm))
            .collect()
    }

    /// The engine orders of the diagram: all that were asked for or that the text names, and others
    /// that have room.
    pub fn drawn_orders(&self) -> EngineOrders {
        if !self.engine_orders.is_empty() {
            return EngineOrders {
                all_of: self.engine_orders.clone(),
                with_room: Vec::new(),
            };
        }
        let named = self.nearest().into_iter().map(|c| c.engine_order);
        let named: BTreeSet<usize> = named.collect();
        EngineOrders {
            all_of: named.into_iter().collect(),
            with_room: DRAWN_ENGINE_ORDERS.to_vec(),
        }
    }

    /// Of the diagram.
    pub fn operation(&self) -> Operation {
        let modes = self.families.iter().flat_map(|family| {
            (0..family.modes()).filter_map(|mode| family.frequency_hz(mode, self.operating_rpm))
        });
        let name = |hz: f64| format!("{hz:.1} Hz, EO {:.2}", hz * 60.0 / self.operating_rpm);
        Operation {
            speed_rpm: self.operating_rpm,
            modes: match self.operating_rpm > 0.0 {
                true => modes.map(|hz| (hz, name(hz))).collect(),
                false => Vec::new(),
            },
        }
    }

    /// For a reader: the frequencies, and the crossings nearest to the speed of the scene.
    pub fn table(&self) -> String {
        let tables: String = self.families.iter().map(Family::table).collect();
        let operating_rpm = self.operating_rpm;
        if operating_rpm <= 0.0 {
            return tables;
        }
        let line = |c: CrossingRow| {
            format!(
                "{:>10.1}{:>12.4}  EO {:<3}{:+8.1} %  {}, {}, mode {}\n",
                c.speed_rpm,
                c.frequency_hz,
                c.engine_order,
                100.0 * c.margin(operating_rpm),
                c.body,
                c.kind.replace('_', " "),
                c.mode
            )
        };
        let lines: String = self.nearest().into_iter().map(line).collect();
        let orders = match self.engine_orders.is_empty() {
            true => format!("an engine order up to {MOST_ENGINE_ORDER}"),
            false => {
                let orders = self.engine_orders.iter().map(usize::to_string);
                format!(
                    "one of the engine orders {}",
                    orders.collect::<Vec<_>>().join(", ")
                )
            }
        };
        format!(
            "{tables}crossing with {orders} that is nearest to {operating_rpm:.0} rpm, of each mode\n\
             {:>10}{:>12}\n{lines}",
            "speed_rpm", "Hz"
        )
    }
}

/// Frequencies (Hz) at one speed: flanks held, stuck.
type ModesAtSpeed = [Vec<f64>; 2];

/// The bodies at rest and at the highest speed.
struct Spun {
    at_rest: Structure,
    fastest: Structure,
}

impl Spun {
    fn of(model: &Model, progress: &Progress) -> Result<Self, RunError> {
        let at_rest = Model {
            rotation: None,
            ..model.clone()
        };
        let at_rest = assemble(&at_rest, progress)?;
        let fastest = assemble(model, progress)?;
        Ok(Self { at_rest, fastest })
    }

    /// Matrices of a body at `share` of the square of the highest speed.
    fn body(&self, b: usize, share: f64) -> BodyMatrices {
        let (rest, fast) = (&self.at_rest.bodies[b], &self.fastest.bodies[b]);
        // (1 - share) K_rest + share K_fast: exact at both ends.
        let mut stiffness = rest.stiffness.clone();
        stiffness
            .values_mut()
            .iter_mut()
            .for_each(|k| *k *= 1.0 - share);
        BodyMatrices {
            stiffness: sum(&stiffness, share, &fast.stiffness),
            mass: rest.mass.clone(),
            load_n: fast.load_n.iter().map(|f| share * f).collect(),
        }
    }

    fn modes(&self, model: &Model, share: f64) -> Result<ModesAtSpeed, ReductionError> {
        let bodies = (0..model.bodies.len()).map(|b| self.body(b, share));
        let structure = Structure {
            bodies: bodies.collect(),
        };
        let held =
            fixed_interface_modes(&model.bodies[0], &structure.bodies[0], LISTED_MODES)?.omega2;
        let stuck = stuck_modes(model, &structure, LISTED_MODES)?;
        Ok([held, stuck].map(|omega2| {
            omega2
                .iter()
                .take(LISTED_MODES)
                .map(|w2| hertz(*w2))
                .collect()
        }))
    }
}

/// One kind of modes over the speeds.
#[derive(Debug)]
struct Family {
    kind: &'static str,
    body: String,
    /// Speed (rpm), frequencies (Hz); `None` where the structure does not stand the speed.
    speeds: Vec<(f64, Option<Vec<f64>>)>,
}

fn families(blade: &Body, all: &[(f64, Option<ModesAtSpeed>)]) -> [Family; 2] {
    let kinds = [
        ("flanks_held", blade.name.clone()),
        ("stuck", "assembly".to_string()),
    ];
    let mut which = 0..;
    kinds.map(|(kind, body)| {
        let i = which.next().unwrap_or(0);
        let of_speed = |(rpm, modes): &(f64, Option<ModesAtSpeed>)| {
            (*rpm, modes.as_ref().map(|modes| modes[i].clone()))
        };
        Family {
            kind,
            body,
            speeds: all.iter().map(of_speed).collect(),
        }
    })
}

impl Family {
    fn modes(&self) -> usize {
        let counts = self.speeds.iter().flat_map(|(_, f)| f).map(Vec::len);
        counts.max().unwrap_or(0)
    }

    fn rows(&self) -> Vec<CampbellRow> {
        let row = |speed_rpm: f64, frequencies: &Option<Vec<f64>>, mode: usize| CampbellRow {
            speed_rpm,
            kind: self.kind.to_string(),
            body: self.body.clone(),
            mode: mode + 1,
            frequency_hz: frequencies.as_ref().and_then(|f| f.get(mode).copied()),
        };
        let of_speed = |(rpm, f): &(f64, Option<Vec<f64>>)| -> Vec<CampbellRow> {
            (0..self.modes()).map(|mode| row(*rpm, f, mode)).collect()
        };
        self.speeds.iter().flat_map(of_speed).collect()
    }

    fn curves(&self) -> CampbellFamily {
        let mode = |mode: usize| {
            let point = |(rpm, f): &(f64, Option<Vec<f64>>)| Some((*rpm, *f.as_ref()?.get(mode)?));
            self.speeds.iter().filter_map(point).collect()
        };
        CampbellFamily {
            label: self.title(),
            modes: (0..self.modes()).map(mode).collect(),
            dashed: self.kind == "stuck",
        }
    }

    /// Between two speeds the square of a frequency goes with the square of the speed.
    fn frequency_hz(&self, mode: usize, rpm: f64) -> Option<f64> {
        let stretch = self
            .stretches(mode)
            .find(|s| (s.from.0..=s.to.0).contains(&rpm))?;
        let squared = stretch.offset() + stretch.slope() * rpm * rpm;
        Some(squared.max(0.0).sqrt())
    }

    fn stretches(&self, mode: usize) -> impl Iterator<Item = Stretch> {
        let at = move |(rpm, f): &(f64, Option<Vec<f64>>)| Some((*rpm, *f.as_ref()?.get(mode)?));
        self.speeds.windows(2).filter_map(move |pair| {
            Some(Stretch {
                from: at(&pair[0])?,
                to: at(&pair[1])?,
            })
        })
    }

    /// Of each mode that crosses an engine order.
    fn nearest_crossings(&self, orders: &[usize], rpm: f64) -> Vec<CrossingRow> {
        let all = self.crossings(orders);
        let nearest = |mode: usize| {
            let own = all.iter().filter(|c| c.mode == mode);
            own.min_by(|a, b| a.margin(rpm).abs().total_cmp(&b.margin(rpm).abs()))
        };
        (1..=self.modes()).filter_map(nearest).cloned().collect()
    }

    fn crossings(&self, orders: &[usize]) -> Vec<CrossingRow> {
        let of_mode = |mode: usize| {
            self.stretches(mode).flat_map(move |stretch| {
                orders.iter().filter_map(move |&engine_order| {
                    let speed_rpm = stretch.crossing_rpm(engine_order)?;
                    Some(CrossingRow {
                        kind: self.kind.to_string(),
                        body: self.body.clone(),
                        mode: mode + 1,
                        engine_order,
                        speed_rpm,
                        frequency_hz: engine_order as f64 * speed_rpm / 60.0,
                    })
                })
            })
        };
        (0..self.modes()).flat_map(of_mode).collect()
    }

    fn title(&self) -> String {
        format!("{}, {}", self.body, self.kind.replace('_', " "))
    }

    /// One line per speed.
    fn table(&self) -> String {
        let heads = (1..=self.modes()).map(|mode| format!("{mode:>12}"));
        let heads = format!("{:>10}{}\n", "speed_rpm", heads.collect::<String>());
        let line = |(rpm, frequencies): &(f64, Option<Vec<f64>>)| {
            let cells: String = match frequencies {
                Some(f) => f.iter().map(|f| format!("{f:>12.4}")).collect(),
                None => format!("{:>12}", "-").repeat(self.modes()),
            };
            format!("{rpm:>10.1}{cells}\n")
        };
        let lines: String = self.speeds.iter().map(line).collect();
        format!("{}: frequencies in Hz\n{heads}{lines}", self.title())
    }
}

/// A mode between two speeds: speed (rpm) and frequency (Hz) at both.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    from: (f64, f64),
    to: (f64, f64),
}

impl Stretch {
    /// Of f2 = offset + slope rpm2.
    fn slope(self) -> f64 {
        let square = |v: f64| v * v;
        (square(self.to.1) - square(self.from.1)) / (square(self.to.0) - square(self.from.0))
    }

    fn offset(self) -> f64 {
        self.from.1 * self.from.1 - self.slope() * self.from.0 * self.from.0
    }

    /// Where the mode has the frequency of an engine order; the end of a stretch belongs to the next one.
    fn crossing_rpm(self, engine_order: usize) -> Option<f64> {
        let order = engine_order as f64 / 60.0;
        let squared = self.offset() / (order * order - self.slope());
        let rpm = Some(squared).filter(|s| s.is_finite() && *s > 0.0)?.sqrt();
        (self.from.0..self.to.0).contains(&rpm).then_some(rpm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_lie_on_the_mode_and_on_the_engine_order() {
        // f2 = 100^2 + 1e-4 rpm2.
        let hz = |rpm: f64| (1e4 + 1e-4 * rpm * rpm).sqrt();
        let speeds = [0.0, 2000.0, 4000.0, 8000.0];
        let family = Family {
            kind: "stuck",
            body: "assembly".to_owned(),
            speeds: speeds
                .iter()
                .map(|rpm| (*rpm, Some(vec![hz(*rpm)])))
                .collect(),
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b, "{a} {b}");
        near(family.frequency_hz(0, 3000.0).unwrap(), hz(3000.0));
        assert_eq!(family.frequency_hz(0, 9000.0), None);
        let orders: Vec<usize> = (1..=MOST_ENGINE_ORDER).collect();
        let crossings = family.crossings(&orders);
        // EO 1 is reached beyond the range: 100^2 = (1/3600 - 1e-4) rpm2 at 7500 rpm it is inside.
        let one = crossings.iter().find(|c| c.engine_order == 1).unwrap();
        near(one.speed_rpm, 7500.0);
        assert_eq!(crossings.len(), MOST_ENGINE_ORDER);
        for c in &crossings {
            near(c.frequency_hz, hz(c.speed_rpm));
        }
        near(1.0 + one.margin(6000.0), 1.25);
        let nearest = family.nearest_crossings(&orders, 7000.0);
        assert_eq!((nearest.len(), nearest[0].engine_order), (1, 1));
        // Of orders that were asked for, those alone.
        let of_two = family.crossings(&[2, 40]);
        let mut found: Vec<usize> = of_two.iter().map(|c| c.engine_order).collect();
        found.sort_unstable();
        assert_eq!(found, [2, 40]);
    }

    #[test]
    fn ranges_are_read_and_include_their_ends() {
        let speeds = |text: &str| text.parse::<SpeedRange>().map(|s| s.values_rpm());
        assert_eq!(speeds("0:8000:5").unwrap(), [0.0, 2e3, 4e3, 6e3, 8e3]);
        assert_eq!(speeds(" 1e3 : 2e3 : 2 ").unwrap(), [1e3, 2e3]);
        assert_eq!(speeds("5000:5000:1").unwrap(), [5e3]);
        assert_eq!(speeds("0:0:1").unwrap(), [0.0]);
        assert_eq!(*speeds("0:1e6:7").unwrap().last().unwrap(), 1e6);
    }

    #[test]
    fn what_is_no_range_says_what_is() {
        for (text, says) in [
            ("5000", "FROM:TO:N"),
            ("0:5000", "FROM:TO:N"),
            ("0:fast:3", "FROM:TO:N"),
            ("0:inf:3", "FROM:TO:N"),
            ("0:5000:2.5", "FROM:TO:N"),
            ("-1:5000:3", "ascend"),
            ("5000:0:3", "ascend"),
            ("0:1e7:3", "1e7"),
            ("0:5000:1", "2 to"),
            ("0:5000:0", "2 to"),
            ("0:5000:10001", "2 to"),
        ] {
            let message = text.parse::<SpeedRange>().unwrap_err().to_string();
            assert!(message.contains(says), "{text}: {message}");
        }
    }
}
