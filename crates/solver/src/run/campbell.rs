//! Natural frequencies over the speed of rotation, and their crossings with engine orders.

use super::bodies::{Bound, Meshes};
use super::error::Error;
use super::prestress::assemble;
use super::session::{Session, Stage};
use crate::description::Scene;
use crate::model::{Model, Rotation, RotationSpec};
use crate::reduced::waves::{largest_nodal_diameter, nodal_diameter_of};
use crate::reduction::craig_bampton::fixed_interface_modes;
use crate::reduction::sectors::modes_of_nodal_diameter;
use crate::reduction::{LISTED_MODES, ReductionError, stuck_shapes};
use crate::results::modes::{ModeKind, hertz};
use crate::structure::{BodyMatrices, Structure};
use dovetail_numerics::sparse::{Symbolic, sum};

/// Modes over the speed.
#[derive(Debug)]
#[non_exhaustive]
pub struct Campbell {
    /// Model at the highest speed.
    pub bound: Bound,
    /// Modes of the first body with its flanks held (full model), and of the stuck assembly; of a disc
    /// those of the stuck assembly at each nodal diameter.
    pub families: Vec<ModeFamily>,
    /// Speed of the scene, rpm; 0 at rest.
    pub operating_rpm: f64,
    /// Speeds (rpm) at which the structure is unstable or not held, and why.
    pub failed: Vec<(f64, ReductionError)>,
}

/// Modes of one kind over the speeds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ModeFamily {
    /// Kind of the modes.
    pub kind: ModeKind,
    /// Name of the body; `None` for the assembly.
    pub body: Option<String>,
    /// Wave round the disc that the assembly is a sector of; `None` without cyclic symmetry, and for
    /// a body alone.
    pub wave: Option<DiscWave>,
    /// Speeds (rpm), ascending, with the frequencies (Hz) of each; `None` where the structure is
    /// unstable.
    pub speeds: Vec<(f64, Option<Vec<f64>>)>,
}

/// Wave round a disc of equal sectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiscWave {
    /// Number of sectors.
    pub sectors: usize,
    /// Nodal diameter.
    pub nodal_diameter: usize,
}

impl DiscWave {
    /// Returns `true` if an engine order excites this wave.
    pub(crate) const fn is_excited_by(self, engine_order: usize) -> bool {
        nodal_diameter_of(engine_order, self.sectors) == self.nodal_diameter
    }
}

/// Mode that has the frequency of an engine order.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Crossing {
    /// Kind of the mode.
    pub kind: ModeKind,
    /// Name of the body; `None` for the assembly.
    pub body: Option<String>,
    /// Wave round the disc, as in [`ModeFamily`].
    pub wave: Option<DiscWave>,
    /// Number of the mode, 1 the lowest.
    pub mode: usize,
    /// Engine order, in cycles per revolution.
    pub engine_order: usize,
    /// Speed of the crossing, rpm.
    pub speed_rpm: f64,
    /// Frequency of the crossing, Hz.
    pub frequency_hz: f64,
}

impl Crossing {
    /// Relative amount by which the speed of the crossing exceeds that of operation.
    pub fn margin(&self, operating_rpm: f64) -> f64 {
        self.speed_rpm / operating_rpm - 1.0
    }
}

/// Modes at each of `speeds_rpm`, which ascend: of the first body with its flanks held (full
/// model), and of the stuck assembly. A sector of a disc has those of the stuck assembly at each
/// nodal diameter alone. Mesh, pairs, stiffness and mass are made once: under rotation the stiffness
/// is a parabola of the speed, so that two assemblies, at rest and at the highest speed, give it at
/// any speed. The stress is that with all pairs stuck.
///
/// # Errors
/// [`Error::NoMesh`], [`Error::NoRotation`] without an axis; otherwise those of
/// [`modes`](super::modes) at the lowest speed. A higher speed at which the structure is unstable
/// is no error: see [`Campbell::failed`].
pub fn campbell(
    scene: &Scene,
    meshes: Meshes,
    speeds_rpm: &[f64],
    session: &Session<'_>,
) -> Result<Campbell, Error> {
    let assembly = scene.assembly().ok_or(Error::NoMesh)?;
    let operating = assembly.rotation.as_ref();
    let operating_rpm = operating.map_or(0.0, RotationSpec::speed_rpm);
    let fastest_rpm = speeds_rpm.last().copied().unwrap_or(0.0);
    let mut fastest = assembly.clone();
    let rotation = fastest.rotation.as_mut().ok_or(Error::NoRotation)?;
    rotation.speed_rad_s = fastest_rpm * std::f64::consts::PI / 30.0;
    let bound = Bound::new(&fastest, &meshes, session)?;
    drop(meshes);
    let model = &bound.model;
    let spun = Spun::new(model, session)?;
    let waves = waves(model);
    let family = |kind, body, wave| ModeFamily {
        kind,
        body,
        wave,
        speeds: Vec::new(),
    };
    // A sector by itself would have its faces held, too, which no part of a disc has.
    let first = model.bodies.first().filter(|_| model.cyclic.is_none());
    let held = first.map(|body| family(ModeKind::FlanksHeld, Some(body.name.clone()), None));
    let stuck = waves
        .iter()
        .map(|wave| family(ModeKind::Stuck, None, *wave));
    let mut families: Vec<ModeFamily> = held.into_iter().chain(stuck).collect();
    let mut failed = Vec::new();
    {
        let _stage = session.stage(Stage::ModesAtSpeeds);
        let steps = session.steps(speeds_rpm.len(), "speeds");
        for &rpm in speeds_rpm {
            let share = match fastest_rpm {
                0.0 => 0.0,
                fastest => (rpm / fastest).powi(2),
            };
            session.check_running()?;
            let frequencies = match spun.modes(share, &waves) {
                Ok(modes) => modes.into_iter().map(Some).collect(),
                // At the lowest speed the scene is at fault, not the speed.
                Err(
                    error @ (ReductionError::InteriorUnstable { .. }
                    | ReductionError::NotHeld { .. }),
                ) if rpm > speeds_rpm[0] => {
                    failed.push((rpm, error));
                    vec![None; families.len()]
                }
                Err(error) => return Err(error.into()),
            };
            for (family, frequencies) in families.iter_mut().zip(frequencies) {
                family.speeds.push((rpm, frequencies));
            }
            steps.step();
        }
    }
    session.check_running()?;
    Ok(Campbell {
        bound,
        families,
        operating_rpm,
        failed,
    })
}

impl Campbell {
    /// Crossings of the modes with these engine orders, ascending in speed.
    pub fn crossings(&self, engine_orders: &[usize]) -> Vec<Crossing> {
        let families = self.families.iter();
        let mut crossings: Vec<Crossing> =
            families.flat_map(|f| f.crossings(engine_orders)).collect();
        crossings.sort_by(|a, b| a.speed_rpm.total_cmp(&b.speed_rpm));
        crossings
    }

    /// Crossing of each mode that is nearest to the speed of the scene; empty at rest.
    pub fn nearest_crossings(&self, engine_orders: &[usize]) -> Vec<Crossing> {
        let rpm = self.operating_rpm;
        let families = self.families.iter().filter(|_| rpm > 0.0);
        families
            .flat_map(|f| f.nearest_crossings(engine_orders, rpm))
            .collect()
    }
}

/// Waves of the stuck assembly: one of each nodal diameter of a disc.
fn waves(model: &Model) -> Vec<Option<DiscWave>> {
    let Some(cyclic) = &model.cyclic else {
        return vec![None];
    };
    let sectors = cyclic.sectors;
    let wave = |nodal_diameter| DiscWave {
        sectors,
        nodal_diameter,
    };
    let diameters = 0..=largest_nodal_diameter(sectors);
    diameters.map(|d| Some(wave(d))).collect()
}

/// Bodies at rest and at the highest speed.
struct Spun {
    at_rest: Structure,
    fastest: Structure,
    /// Analysis of the stuck assembly, which is the same at all speeds; `None` without a prestress.
    analysis: Option<Symbolic>,
}

impl Spun {
    fn new(model: &Model, session: &Session<'_>) -> Result<Self, Error> {
        // At rest, the steady loads alone stress the bodies.
        let is_loaded = model.bodies.iter().any(|body| !body.loads.is_empty());
        let still = |rotation: &Rotation| Rotation {
            speed_rad_s: 0.0,
            ..rotation.clone()
        };
        let at_rest = Model {
            rotation: model.rotation.as_ref().filter(|_| is_loaded).map(still),
            ..model.clone()
        };
        let (at_rest, ..) = assemble(&at_rest, session)?;
        let (fastest, _, analysis) = assemble(model, session)?;
        Ok(Self {
            at_rest,
            fastest,
            analysis,
        })
    }

    /// Matrices of a body at `share` of the square of the highest speed.
    fn body(&self, b: usize, share: f64) -> BodyMatrices {
        let (rest, fast) = (&self.at_rest.bodies[b], &self.fastest.bodies[b]);
        // (1 - share) K_rest + share K_fast: exact at both ends.
        let mut body = rest.clone();
        let values = body.stiffness.values_mut().iter_mut();
        values.for_each(|k| *k *= 1.0 - share);
        body.stiffness = sum(&body.stiffness, share, &fast.stiffness);
        let loads_n = rest.load_n.iter().zip(&fast.load_n);
        body.load_n = loads_n
            .map(|(rest, fast)| (1.0 - share) * rest + share * fast)
            .collect();
        body
    }

    /// Frequencies (Hz) of the families: flanks held, where there is no disc, and stuck at each wave.
    fn modes(
        &self,
        share: f64,
        waves: &[Option<DiscWave>],
    ) -> Result<Vec<Vec<f64>>, ReductionError> {
        let bodies = (0..self.at_rest.bodies.len()).map(|b| self.body(b, share));
        let structure = Structure {
            bodies: bodies.collect(),
            joints: self.at_rest.joints.clone(),
            steady_parts: Vec::new(),
            excitations: self.at_rest.excitations.clone(),
            observations: self.at_rest.observations.clone(),
            dashpots: self.at_rest.dashpots.clone(),
            influenced: Vec::new(),
        };
        let held = (waves == [None])
            .then(|| fixed_interface_modes(&structure.bodies[0], LISTED_MODES))
            .transpose()?;
        let held = held.map(|modes| Ok(modes.omega2));
        let stuck = waves.iter().map(|wave| match wave {
            None => {
                let analysis = self.analysis.as_ref();
                Ok(stuck_shapes(&structure, LISTED_MODES, analysis)?.0)
            }
            Some(wave) => {
                let (sectors, diameter) = (wave.sectors, wave.nodal_diameter);
                modes_of_nodal_diameter(&structure, sectors, diameter, LISTED_MODES)
            }
        });
        let squares = held.into_iter().chain(stuck);
        squares
            .map(|omega2| {
                let listed = omega2?.into_iter().take(LISTED_MODES);
                Ok(listed.map(hertz).collect())
            })
            .collect()
    }
}

impl ModeFamily {
    /// Number of modes at any speed.
    pub fn modes(&self) -> usize {
        let counts = self.speeds.iter().flat_map(|(_, f)| f).map(Vec::len);
        counts.max().unwrap_or(0)
    }

    /// Frequency of a mode, counted from 0, at a speed, Hz. Between two speeds the squared
    /// frequency is linear in the squared speed.
    pub fn frequency_hz(&self, mode: usize, rpm: f64) -> Option<f64> {
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

    /// Crossing with an engine order that is nearest to a speed, for each mode that has one.
    fn nearest_crossings(&self, orders: &[usize], rpm: f64) -> Vec<Crossing> {
        let crossings = self.crossings(orders);
        let nearest = |mode: usize| {
            let of_mode = crossings.iter().filter(|c| c.mode == mode);
            of_mode.min_by(|a, b| a.margin(rpm).abs().total_cmp(&b.margin(rpm).abs()))
        };
        (1..=self.modes()).filter_map(nearest).cloned().collect()
    }

    fn crossings(&self, orders: &[usize]) -> Vec<Crossing> {
        let is_excited = |order: &&usize| self.wave.is_none_or(|wave| wave.is_excited_by(**order));
        let of_mode = |mode: usize| {
            self.stretches(mode).flat_map(move |stretch| {
                let excited = orders.iter().filter(is_excited);
                excited.filter_map(move |&engine_order| {
                    let speed_rpm = stretch.crossing_rpm(engine_order)?;
                    Some(Crossing {
                        kind: self.kind,
                        body: self.body.clone(),
                        wave: self.wave,
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
}

/// Mode between two speeds: speed (rpm) and frequency (Hz) at both.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    from: (f64, f64),
    to: (f64, f64),
}

impl Stretch {
    /// Slope of f2 = offset + slope rpm2.
    fn slope(self) -> f64 {
        let square = |v: f64| v * v;
        (square(self.to.1) - square(self.from.1)) / (square(self.to.0) - square(self.from.0))
    }

    fn offset(self) -> f64 {
        self.from.1 * self.from.1 - self.slope() * self.from.0 * self.from.0
    }

    /// Speed at which the mode has the frequency of an engine order; the end of a stretch belongs
    /// to the next one.
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

    /// Highest engine order.
    const MOST_ENGINE_ORDER: usize = 36;

    #[test]
    fn crossings_lie_on_the_mode_and_on_the_engine_order() {
        // f2 = 100^2 + 1e-4 rpm2.
        let hz = |rpm: f64| (1e4 + 1e-4 * rpm * rpm).sqrt();
        let speeds = [0.0, 2000.0, 4000.0, 8000.0];
        let family = ModeFamily {
            kind: ModeKind::Stuck,
            body: None,
            wave: None,
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
        // Only the orders that were asked for.
        let of_two = family.crossings(&[2, 40]);
        let mut found: Vec<usize> = of_two.iter().map(|c| c.engine_order).collect();
        found.sort_unstable();
        assert_eq!(found, [2, 40]);
    }
}
