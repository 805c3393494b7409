//! Wear of the contacts of a scene, and what it makes of the vibration, over the number of cycles.
//!
//! The cycles are gone through in blocks. In a block each pair slides in every cycle as far as in the
//! vibration at its beginning, and is pressed as the worn depths let it be ([`wear_block`]). At the
//! end the vibration is solved for again, about the static state of the worn contacts, which follows
//! from the mean of the vibration before. The rate of wear there differs from the one that the block
//! ended with. Half of that difference times its cycles is what the depths miss, and what the
//! pressures leave of it is the error of the block ([`remaining_errors`]). A block whose error is
//! larger than asked for is taken again with fewer cycles.
//!
//! Worn depth is clearance: nothing but the laws of the pairs changes, and the reduced model stays.

use super::at::ModelAtValue;
use super::bodies::Source;
use super::error::Error;
use super::outcome::usable;
use super::peaks::counting;
use super::reduced::ReducedScene;
use super::response::check_one_speed;
use super::session::{Event, Session, Stage};
use super::statics::newton as static_newton;
use super::worn::{WearBlock, WearCourse, seconds_per_cycle};
use crate::description::{MissionPart, Scene};
use crate::dlft::branch::Guess;
use crate::dlft::static_state::{PairsAtRest, static_state_after};
use crate::dlft::wear::{WearRate, largest, remaining_errors, rest_state_after, wear_block};
use crate::dlft::{CycleStatus, Orbit, StaticState};
use crate::problem::HarmonicLoad;
use crate::reduced::Load;
use crate::results::far_slip::ShorterSides;
use std::sync::atomic::AtomicUsize;

/// Share of the accuracy asked for that the steps inside of a block take.
const OF_STEPS: f64 = 0.25;
/// Fraction of the cycles at which the next block is expected to have the error asked for.
const CAUTION: f64 = 0.8;
/// Least and largest ratio of a block to the one before.
const GROWTH: [f64; 2] = [0.2, 4.0];
/// A block of less than this fraction of all cycles is given up.
const LEAST_BLOCK: f64 = 1e-9;
/// Pairs with less than this fraction of the largest compression do not choose the first block.
const PRESSED: f64 = 0.01;
/// Vibrations of the unworn contacts after which they count as shaken down.
const MOST_SHAKES: usize = 20;
/// Share of the accuracy asked for within which the wear in a cycle stays then.
const OF_SHAKING: f64 = 0.25;
/// Parts in which the progress is told.
const PROGRESS: usize = 100;

/// Wear that is asked for.
#[derive(Debug, Clone)]
pub struct WearQuestion<'a> {
    /// Numbers of cycles at which a block ends, above 0, ascending; the last one is the end.
    pub cycles: &'a [f64],
    /// Largest error of the depths worn in a block, as a fraction of the largest of them.
    pub tolerance: f64,
    /// Vibrations that wear the contacts in turn; empty for the peak alone.
    pub mission: &'a [MissionPart],
    /// Name of the observed displacement whose peaks are followed; `None`: the first one.
    pub observation: Option<&'a str>,
}

/// Wear of a scene.
#[derive(Debug)]
#[non_exhaustive]
pub struct Wear {
    /// Reduced model, with the clearances of the last state.
    pub reduced: ReducedScene,
    /// Number of the observed displacement whose peaks were followed.
    pub observation: usize,
    /// Parts of the mission, with shares that add up to 1.
    pub mission: Vec<MissionPart>,
    /// Area of each pair, m2.
    pub area_m2: Vec<f64>,
    /// State at the beginning, and after each block.
    pub blocks: Vec<WearBlock>,
    /// Number of blocks that were taken again with fewer cycles.
    pub rejected: usize,
    /// Number of motions that were solved for.
    pub solved: usize,
    /// Reason why the wear ends before the last cycle.
    pub ended: Option<Error>,
}

impl Wear {
    /// All of its states.
    pub fn course(&self) -> WearCourse<'_> {
        WearCourse {
            reduced: &self.reduced,
            observation: self.observation,
            mission: &self.mission,
            area_m2: &self.area_m2,
            blocks: &self.blocks,
        }
    }
}

/// Wears the contacts of a scene.
///
/// # Errors
/// The error of a stage up to the first vibration; an observed displacement that there is not;
/// [`Error::AllBonded`] without a contact that can slip or open, [`Error::NoWear`] where none wears,
/// [`Error::NoAreas`] for a reduced model without areas; [`Error::AlongEngineOrder`];
/// [`Error::Stopped`] by the observer. Later errors are no errors: see [`Wear::ended`].
pub fn wear(
    scene: &Scene,
    source: Source,
    question: &WearQuestion<'_>,
    session: &Session<'_>,
) -> Result<Wear, Error> {
    check_one_speed(scene, "contacts wear at one speed")?;
    let at =
        ModelAtValue::new((0.0, scene.clone()), &source, None, session).map_err(|e| match e {
            Error::AllBonded { .. } => Error::AllBonded {
                why: "nothing then slides, and nothing wears",
            },
            error => error,
        })?;
    let laws = &at.reduced.problem.laws;
    if laws.iter().all(|law| law.wear_m2_n == 0.0) {
        return Err(Error::NoWear);
    }
    let areas = at.reduced.pairs.rows.iter().map(|pair| pair.area_m2);
    let area_m2: Vec<f64> = areas.collect::<Option<_>>().ok_or(Error::NoAreas)?;
    let observation = at.reduced.observed(question.observation)?;
    let at_peak = [MissionPart::whole_mission(None)];
    let asked = match question.mission {
        [] => &at_peak[..],
        asked => asked,
    };
    let whole: f64 = asked.iter().map(|part| part.share).sum();
    let mission = asked.iter().map(|part| MissionPart {
        share: part.share / whole,
        ..*part
    });
    let _stage = session.stage(Stage::Wear);
    let solved = AtomicUsize::new(0);
    let mut wearing = Wearing {
        unworn_m: laws.iter().map(|law| law.gap_m).collect(),
        excitations: at.reduced.problem.excitations.clone(),
        sides: ShorterSides::new(&at.reduced.pairs),
        mission: mission.collect(),
        area_m2,
        observation,
        tolerance: question.tolerance,
        session,
        solved: &solved,
        at,
    };
    let mut here = wearing.shaken_down()?;
    let unworn = vec![0.0; wearing.area_m2.len()];
    let mut blocks = vec![here.block(unworn)];
    let last = question.cycles.last().copied().unwrap_or(0.0);
    let steps = session.steps(PROGRESS, "percent");
    wearing.report_blocks(&blocks)?;
    let (mut told, mut rejected, mut ended) = (0, 0, None);
    let mut next = wearing.first_block(&here.rates).min(last);
    'all: for end in question.cycles {
        loop {
            let before = &blocks[blocks.len() - 1];
            let left = end - before.cycles;
            if left <= 0.0 {
                break;
            }
            // The last two blocks before an end are alike.
            let (cycles, is_last) = match next {
                next if next >= left => (left, true),
                next if 2.0 * next > left => (0.5 * left, false),
                next => (next, false),
            };
            let tried = wearing.block(&here, before, cycles);
            session.check_running()?;
            match tried {
                Ok(Some((there, mut block))) if block.error <= question.tolerance => {
                    let grown = growth(question.tolerance, block.error) * cycles;
                    // A block that ends where it is asked to could have been longer.
                    next = if is_last { next.max(grown) } else { grown };
                    if is_last {
                        block.cycles = *end;
                    }
                    let done = (PROGRESS as f64 * block.cycles / last) as usize;
                    blocks.push(block);
                    here = there;
                    wearing.report_blocks(&blocks)?;
                    (told..done).for_each(|_| steps.step());
                    told = done.max(told);
                }
                refused => {
                    rejected += 1;
                    let (factor, why) = match refused {
                        Ok(Some((_, block))) => (growth(question.tolerance, block.error), None),
                        Ok(None) => (GROWTH[0], None),
                        Err(why) => (GROWTH[0], Some(Box::new(why))),
                    };
                    next = factor * cycles;
                    if next < LEAST_BLOCK * last {
                        ended = Some(Error::WearStalls {
                            cycles: before.cycles,
                            block: cycles,
                            why,
                        });
                        break 'all;
                    }
                }
            }
        }
    }
    drop(steps);
    if let Some(block) = blocks.last() {
        wearing.open(&block.depth_m);
    }
    let Wearing {
        at,
        mission,
        area_m2,
        ..
    } = wearing;
    Ok(Wear {
        reduced: at.reduced,
        observation,
        mission,
        area_m2,
        blocks,
        rejected,
        solved: solved.into_inner(),
        ended,
    })
}

/// Factor on the cycles of a block with an error to one that is as accurate as asked for.
fn growth(tolerance: f64, error: f64) -> f64 {
    (CAUTION * tolerance / error).clamp(GROWTH[0], GROWTH[1])
}

/// Model whose contacts wear.
struct Wearing<'a, 'o> {
    at: ModelAtValue,
    /// Clearance of each pair before it has worn, m.
    unworn_m: Vec<f64>,
    /// Excitations of the scene.
    excitations: Vec<HarmonicLoad>,
    sides: ShorterSides,
    mission: Vec<MissionPart>,
    /// Area of each pair, m2.
    area_m2: Vec<f64>,
    observation: usize,
    tolerance: f64,
    session: &'a Session<'o>,
    solved: &'a AtomicUsize,
}

/// Vibrations of all parts of the mission about one state of the contacts.
struct Vibration {
    motions: Vec<Orbit>,
    /// State at rest that they leave.
    rest: StaticState,
    /// Wear of each pair in a cycle of the mission.
    rates: Vec<WearRate>,
}

impl Vibration {
    /// State of contacts of these depths, m, at the beginning.
    fn block(&self, depth_m: Vec<f64>) -> WearBlock {
        WearBlock {
            cycles: 0.0,
            seconds: 0.0,
            error: 0.0,
            steps: 0,
            depth_m,
            rate_m: self.rates.iter().map(|rate| rate.depth_m).collect(),
            at_rest_n: compressions_n(&self.rest.lambda).collect(),
            motions: self.motions.clone(),
        }
    }
}

/// Compression of each pair under these contact forces, N.
fn compressions_n(lambda: &[f64]) -> impl Iterator<Item = f64> + '_ {
    lambda.iter().step_by(3).map(|normal| (-normal).max(0.0))
}

impl Wearing<'_, '_> {
    /// Opens the clearances by these depths, m.
    fn open(&mut self, depth_m: &[f64]) {
        let ReducedScene { problem, pairs, .. } = &mut self.at.reduced;
        let both = problem.laws.iter_mut().zip(&mut pairs.rows);
        for ((law, row), (unworn_m, depth_m)) in both.zip(self.unworn_m.iter().zip(depth_m)) {
            law.gap_m = unworn_m + depth_m;
            row.gap_m = law.gap_m;
        }
    }

    /// Vibrations that the unworn contacts have shaken down to. Each vibration begins from what the one
    /// before has left, until the wear in a cycle stays.
    fn shaken_down(&mut self) -> Result<Vibration, Error> {
        let mut here = self.vibrate(None)?;
        for _ in 0..MOST_SHAKES {
            let (x, lambda) = (&here.rest.x, &here.rest.lambda);
            let next = self.vibrate(Some((x, lambda, &here.motions)))?;
            let most_m = next
                .rates
                .iter()
                .map(|rate| rate.depth_m)
                .fold(0.0, f64::max);
            let both = here.rates.iter().zip(&next.rates);
            let change_m = both
                .map(|(a, b)| (a.depth_m - b.depth_m).abs())
                .fold(0.0, f64::max);
            here = next;
            if change_m <= OF_SHAKING * self.tolerance * most_m {
                break;
            }
        }
        Ok(here)
    }

    /// Vibrations about the contacts as they are. `after` has the displacements and forces of the
    /// pairs at rest before, n each, and the vibrations near which these are; `None` where the
    /// contacts are at rest in the state of the model, and nothing is known of the vibrations.
    fn vibrate(&mut self, after: Option<(&[f64], &[f64], &[Orbit])>) -> Result<Vibration, Error> {
        let newton = static_newton(&self.at.scene);
        let n = 3 * self.area_m2.len();
        let tell = counting(self.solved, self.session);
        let mut before = after.map(|(x, lambda, _)| (x.to_vec(), lambda.to_vec()));
        let mut motions: Vec<Orbit> = Vec::new();
        for (number, part) in self.mission.iter().enumerate() {
            let scaled = self
                .excitations
                .iter()
                .map(|load| scaled(load, part.force_scale));
            self.at.reduced.problem.excitations = scaled.collect();
            if let Some((x, lambda)) = &before {
                let problem = &self.at.reduced.problem;
                let mut state = static_state_after(problem, PairsAtRest { x, lambda }, newton);
                self.sides.judge_static(&mut state);
                usable(&state, &[])?;
                self.at.set_static_state(state)?;
            }
            let near = after.map(|(.., motions)| &motions[number]);
            let (at, session) = (&self.at, self.session);
            let mut orbit = match part.frequency_hz {
                None => {
                    let guess = near.map(Guess::from_peak);
                    at.find(guess.as_ref(), self.observation, session, &tell)?
                }
                Some(hz) => at.solve_frequency(hz, near, session, &tell)?,
            };
            session.check_running()?;
            self.sides.judge_orbit(&mut orbit);
            at.judge(&mut orbit);
            if !orbit.outcome.has_motion() {
                return Err(Error::SlidesTooFar { point: None });
            }
            before = Some((orbit.x[..n].to_vec(), orbit.lambda[..n].to_vec()));
            motions.push(orbit);
        }
        let (x, lambda) = before.unwrap_or_default();
        let slides = |pair: usize| {
            let mut cycles = motions.iter().map(|orbit| &orbit.cycles[pair]);
            cycles.any(|cycle| cycle.status != CycleStatus::Stuck)
        };
        let slides: Vec<bool> = (0..self.area_m2.len()).map(slides).collect();
        let problem = &mut self.at.reduced.problem;
        let mean = PairsAtRest {
            x: &x,
            lambda: &lambda,
        };
        let rest = rest_state_after(problem, mean, &slides, newton);
        usable(&rest, &[])?;
        Ok(Vibration {
            rates: self.rates(&motions, &rest, &slides),
            motions,
            rest,
        })
    }

    /// Wear of each pair in a cycle of the mission.
    fn rates(&self, motions: &[Orbit], rest: &StaticState, slides: &[bool]) -> Vec<WearRate> {
        let laws = &self.at.reduced.problem.laws;
        let over_mission = |of: &dyn Fn(&Orbit) -> f64| -> f64 {
            let parts = self.mission.iter().zip(motions);
            parts.map(|(part, orbit)| part.share * of(orbit)).sum()
        };
        let pairs = laws
            .iter()
            .zip(&self.area_m2)
            .zip(compressions_n(&rest.lambda));
        pairs
            .enumerate()
            .map(|(pair, ((law, area_m2), at_rest_n))| {
                let rubbed_nm = over_mission(&|orbit| orbit.cycles[pair].rubbed_nm);
                let mean_n = over_mission(&|orbit| orbit.cycles[pair].compression_mean_n);
                WearRate {
                    depth_m: law.wear_m2_n * rubbed_nm / area_m2,
                    at_rest_n,
                    scale_n: at_rest_n.max(mean_n),
                    slides: slides[pair],
                }
            })
            .collect()
    }

    /// Cycles of the first block: those in which no pair loses more of its pressure than the
    /// accuracy asked for, if the other pairs kept theirs.
    fn first_block(&self, rates: &[WearRate]) -> f64 {
        let diagonal = self.at.reduced.model().diagonal_stiffness();
        let largest_n = rates.iter().map(|rate| rate.at_rest_n).fold(0.0, f64::max);
        let pairs = rates.iter().zip(diagonal.iter().step_by(3));
        let pressed = pairs.filter(|(rate, _)| rate.at_rest_n >= PRESSED * largest_n);
        let cycles = pressed.map(|(rate, diagonal)| rate.at_rest_n / (diagonal * rate.depth_m));
        self.tolerance * cycles.filter(|c| *c > 0.0).fold(f64::INFINITY, f64::min)
    }

    /// Wears the contacts over one more block, and lets them vibrate there. `None` where a block of
    /// so many cycles cannot be gone through.
    fn block(
        &mut self,
        here: &Vibration,
        before: &WearBlock,
        cycles: f64,
    ) -> Result<Option<(Vibration, WearBlock)>, Error> {
        self.open(&before.depth_m);
        let newton = static_newton(&self.at.scene);
        let rest = PairsAtRest::from(&here.rest);
        let (problem, within) = (&mut self.at.reduced.problem, OF_STEPS * self.tolerance);
        let worn = wear_block(problem, rest, &here.rates, cycles, within, newton);
        let Some(worn) = worn else {
            return Ok(None);
        };
        let depth_m = before.depth_m.iter().zip(&worn.depth_m);
        let depth_m: Vec<f64> = depth_m.map(|(before, worn)| before + worn).collect();
        self.open(&depth_m);
        let there = self.vibrate(Some((&worn.x, &worn.lambda, &here.motions)))?;
        let ends = here
            .rates
            .iter()
            .zip(&there.rates)
            .zip(compressions_n(&worn.lambda));
        let missed = |((from, to), at_rest_n): ((&WearRate, &WearRate), f64)| {
            0.5 * cycles * (to.depth_m - from.cycle_depth_m(at_rest_n))
        };
        let missed_m: Vec<f64> = ends.map(missed).collect();
        let (problem, end) = (&mut self.at.reduced.problem, worn.rest_state());
        let left_m = remaining_errors(problem, end, &here.rates, cycles, &missed_m, newton);
        let left_m = left_m
            .unwrap_or(missed_m)
            .into_iter()
            .map(f64::abs)
            .fold(0.0, f64::max);
        let error = match largest(&worn.depth_m).max(left_m) {
            0.0 => 0.0,
            most_m => left_m / most_m,
        };
        let durations = [&here.motions, &there.motions];
        let [first, last] = durations.map(|motions| seconds_per_cycle(&self.mission, motions));
        let block = WearBlock {
            cycles: before.cycles + cycles,
            seconds: before.seconds + 0.5 * cycles * (first + last),
            error,
            steps: worn.steps,
            ..there.block(depth_m)
        };
        Ok(Some((there, block)))
    }

    /// Tells of the last of these states.
    fn report_blocks(&self, blocks: &[WearBlock]) -> Result<(), Error> {
        self.session.report(&Event::Worn(WearCourse {
            reduced: &self.at.reduced,
            observation: self.observation,
            mission: &self.mission,
            area_m2: &self.area_m2,
            blocks,
        }))
    }
}

/// A load of another amplitude.
fn scaled(load: &HarmonicLoad, factor: f64) -> HarmonicLoad {
    let times = |part: &Load| Load {
        on_x: part.on_x.iter().map(|v| factor * v).collect(),
        on_modes: part.on_modes.iter().map(|v| factor * v).collect(),
    };
    HarmonicLoad {
        cosine: times(&load.cosine),
        sine: times(&load.sine),
        ..*load
    }
}
