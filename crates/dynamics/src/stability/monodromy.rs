//! Monodromy matrix of the linearised motion: a product of exponentials, one for each stretch in which
//! no pair changes its status and none turns its friction by much.

use super::Reason;
use super::equations::{Equations, add_outer};
use super::passage::{Passage, Prediction, Turn};
use crate::contact::coulomb::Contact;
use crate::damping::Rayleigh;
use crate::dlft::Orbit;
use crate::dlft::eps::Eps;
use crate::dlft::settings::EpsChoice;
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use dovetail_numerics::dense::{Lu, eigenvalues, exponential, product};
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::vector::dot;
use faer::{Mat, c64};
use std::f64::consts::TAU;

/// Ratio of the frequency of the springs of a rigid pair to the frequencies of the pair and the excitation.
const RIGID: f64 = 100.0;
/// Ratio of critical damping of the dashpots that are parallel to these springs.
const RIGID_DAMPING: f64 = 0.5;
/// Largest number of operations for a monodromy matrix: about a second.
const MOST_OPERATIONS: f64 = 2e9;
/// Products of matrices in an exponential, about.
const PRODUCTS: f64 = 20.0;
/// Instants nearer than this, in samples, are one.
const SAME_INSTANT: f64 = 1e-6;

/// Resolution of the known motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    /// Samples at which the law of pairs is evaluated.
    samples: usize,
    /// Stretches of a period in which a pair slips throughout.
    stretches: usize,
    /// True if the force of springs follows from the displacement. If it follows from the contact force
    /// as well, it differs by the harmonics that the balance leaves out.
    by_displacement: bool,
    /// Factor on the eps that rigid pairs are predicted with.
    eps_scale: f64,
}

impl Resolution {
    /// Resolution of a verdict.
    pub(super) const FINE: Self = Self {
        samples: 4096,
        stretches: 256,
        by_displacement: true,
        eps_scale: 1.0,
    };
    /// Half of it, with other predictions. A verdict must not depend on them.
    pub(super) const COARSE: Self = Self {
        samples: 2048,
        stretches: 128,
        by_displacement: false,
        eps_scale: 0.5,
    };
}

/// Largest multiplier.
pub(super) struct Found {
    pub multiplier: c64,
    /// True if some pair changes its status or slips.
    pub changes: bool,
}

/// Largest multiplier of a motion; `None` where nothing can move.
pub(super) fn largest(
    problem: &Problem,
    damping: Rayleigh,
    orbit: &Orbit,
    resolution: Resolution,
) -> Result<Option<Found>, Reason> {
    let equations = Equations::new(problem, damping, orbit)?;
    if equations.size() == 0 {
        return Ok(None);
    }
    let samples = resolution
        .samples
        .max((32 * orbit.harmonics).next_power_of_two());
    let fourier = Fourier::new(orbit.harmonics, samples);
    let motion = Motion::new(&equations, problem, orbit, &fourier, resolution);
    let matrix = motion.monodromy()?;
    let values = eigenvalues(matrix.as_ref()).ok_or(Reason::NotFound)?;
    let above = values.into_iter().filter(|v| v.im >= 0.0);
    let multiplier = above.max_by(|a, b| a.norm().total_cmp(&b.norm()));
    Ok(Some(Found {
        multiplier: multiplier.ok_or(Reason::NotFound)?,
        changes: !motion.pairs.is_empty(),
    }))
}

/// Pair that changes its status or slips.
struct ChangingPair {
    /// Displacement (N, t1, t2) by the coordinates, in units in which the pair has the mass 1.
    rows: [Vec<f64>; 3],
    /// Springs, normal and tangential, rad2/s2, and parallel dashpots, 1/s.
    springs: [f64; 2],
    dashpots: [f64; 2],
    friction: f64,
    /// Tangential spring, N/m.
    tangential_n_m: f64,
    /// Row of the state that has the slider; `None` without friction.
    memory: Option<usize>,
    passage: Passage,
}

/// Linearised motion.
struct Motion<'a> {
    equations: &'a Equations,
    pairs: Vec<ChangingPair>,
    /// Number of states: displacements, velocities, sliders.
    states: usize,
    /// Unit of frequency in which displacements and velocities are alike, rad/s.
    unit: f64,
    /// Reversals that rigid pairs pass at once.
    reversals: Vec<Reversal>,
    /// Instants at which stretches begin, in samples, ascending.
    instants: Vec<f64>,
    samples: usize,
}

impl<'a> Motion<'a> {
    fn new(
        equations: &'a Equations,
        problem: &Problem,
        orbit: &Orbit,
        fourier: &Fourier,
        resolution: Resolution,
    ) -> Self {
        let mut states = 2 * equations.size();
        let system = ContactSystem::new(problem, equations.rayleigh);
        let eps = Eps::new(EpsChoice::Dynamic);
        let eps = eps.values(&system, equations.omega, orbit.harmonics);
        let changing = equations.changing.iter();
        let mut pairs: Vec<ChangingPair> = changing
            .map(|(number, rows)| {
                let law = &problem.laws[*number];
                let eps = [0, 1].map(|c| resolution.eps_scale * eps[3 * number + c]);
                let prediction = match law.stiffness.filter(|_| resolution.by_displacement) {
                    Some(s) => Prediction::of_springs(law, [s.normal_n_m, s.tangential_n_m]),
                    None => Prediction::of_balance(law, eps),
                };
                let passage = Passage::new(orbit, *number, &prediction, fourier);
                let mut pair = ChangingPair::new(*number, rows, problem, equations.omega, passage);
                if pair.friction > 0.0 {
                    pair.memory = Some(states);
                    states += 2;
                }
                pair
            })
            .collect();
        let reversals = pass_reversals(&mut pairs, equations, problem, orbit, fourier);
        let samples = fourier.samples();
        let unit = pairs
            .iter()
            .map(|pair| pair.springs[0].max(pair.springs[1]));
        let diagonal = (0..equations.size()).map(|i| equations.stiffness[(i, i)]);
        let unit = unit.chain(diagonal).fold(equations.omega.powi(2), f64::max);
        Self {
            instants: instants(&pairs, &reversals, samples, resolution.stretches),
            reversals,
            unit: unit.sqrt(),
            equations,
            pairs,
            states,
            samples,
        }
    }

    /// Monodromy matrix from the start of the period on.
    fn monodromy(&self) -> Result<Mat<f64>, Reason> {
        let operations = PRODUCTS * self.instants.len() as f64 * 2.0 * (self.states as f64).powi(3);
        if operations > MOST_OPERATIONS {
            return Err(Reason::TooLarge);
        }
        let mut matrix = Mat::<f64>::identity(self.states, self.states);
        let ends = self.instants.iter().skip(1).copied();
        let ends = ends.chain([self.samples as f64]);
        let stretches: Vec<[f64; 2]> = self
            .instants
            .iter()
            .copied()
            .zip(ends)
            .map(<[f64; 2]>::from)
            .collect();
        let at = |[from, to]: [f64; 2]| -> Vec<usize> {
            let middle = 0.5 * (from + to);
            self.pairs
                .iter()
                .map(|pair| pair.passage.sample_at(middle))
                .collect()
        };
        let period = TAU / self.equations.omega;
        let mut before = stretches.last().map(|last| at(*last)).unwrap_or_default();
        for [from, to] in stretches {
            let now = at([from, to]);
            for (pair, change) in self.pairs.iter().zip(before.iter().zip(&now)) {
                let beginning = from.ceil() as usize % self.samples;
                let samples = [*change.0, beginning, *change.1];
                pair.pass_over(&mut matrix, self.equations.size(), samples);
            }
            for reversal in self.reversals.iter().filter(|r| r.is_at(from)) {
                reversal.pass_over(&mut matrix);
            }
            let duration = self.unit * period * (to - from) / self.samples as f64;
            let mut rates = self.rates(&now);
            for column in rates.col_iter_mut() {
                column.iter_mut().for_each(|v| *v *= duration);
            }
            matrix = product(exponential(rates.as_ref()).as_ref(), matrix.as_ref());
            before = now;
        }
        Ok(matrix)
    }

    /// Rates of the states, in the unit of frequency, where the pairs are at these samples.
    fn rates(&self, at: &[usize]) -> Mat<f64> {
        let n = self.equations.size();
        let mut rates = Mat::<f64>::zeros(self.states, self.states);
        for j in 0..n {
            rates[(j, n + j)] = 1.0;
            for i in 0..n {
                rates[(n + i, j)] = -self.equations.stiffness[(i, j)] / self.unit.powi(2);
                rates[(n + i, n + j)] = -self.equations.damping[(i, j)] / self.unit;
            }
        }
        for (pair, sample) in self.pairs.iter().zip(at) {
            pair.add_rates(&mut rates, n, self.unit, *sample);
        }
        rates
    }
}

/// Reversal that a rigid pair passes at once. Its friction changes its sign, and all accelerations jump.
/// A perturbed motion reverses later, and has its acceleration for as long.
struct Reversal {
    /// Instant, in samples.
    instant: f64,
    /// Velocity of the pair by the velocities of the coordinates.
    row: Vec<f64>,
    /// Jump of the accelerations of the coordinates over the acceleration of the pair before it.
    jump: Vec<f64>,
}

impl Reversal {
    fn is_at(&self, instant: f64) -> bool {
        (self.instant - instant).abs() < SAME_INSTANT
    }

    /// Applies the reversal to the velocities in the rows of a matrix.
    fn pass_over(&self, matrix: &mut Mat<f64>) {
        let n = self.row.len();
        for mut column in matrix.col_iter_mut() {
            let velocity: f64 = (0..n).map(|i| self.row[i] * column[n + i]).sum();
            for (i, jump) in self.jump.iter().enumerate() {
                column[n + i] += jump * velocity;
            }
        }
    }
}

/// Reversals of rigid pairs that forces carry through at once. A pair sticks at the others.
fn pass_reversals(
    pairs: &mut [ChangingPair],
    equations: &Equations,
    problem: &Problem,
    orbit: &Orbit,
    fourier: &Fourier,
) -> Vec<Reversal> {
    let mut reversals = Vec::new();
    for (own, (number, rows)) in equations.changing.iter().enumerate() {
        let law = &problem.laws[*number];
        if law.stiffness.is_some() {
            continue;
        }
        for turn in pairs[own].passage.turns(law, orbit, *number, fourier) {
            let held = held_rows(pairs, equations, own, turn.at);
            if let Some(reversal) = reversal(rows, &turn, &held) {
                pairs[own].passage.pass_at_once(&turn);
                reversals.push(reversal);
            }
        }
    }
    reversals
}

/// Displacements that rigid contact holds at a sample: the normal ones of closed pairs, and the
/// tangential ones of those that stick, but for the pair `own`.
fn held_rows<'a>(
    pairs: &[ChangingPair],
    equations: &'a Equations,
    own: usize,
    sample: usize,
) -> Vec<&'a Vec<f64>> {
    let mut held = Vec::new();
    for (i, (pair, (_, rows))) in pairs.iter().zip(&equations.changing).enumerate() {
        let contact = pair.passage.contact[sample];
        let is_rigid = pair.dashpots[0] > 0.0;
        if is_rigid && contact != Contact::Open {
            held.push(&rows[0]);
            if i != own && contact == Contact::Stick {
                held.extend(&rows[1..]);
            }
        }
    }
    held
}

/// Reversal of a pair with these rows; `None` where it sticks.
fn reversal(rows: &[Vec<f64>; 3], turn: &Turn, held: &[&Vec<f64>]) -> Option<Reversal> {
    let [_, t1, t2] = rows;
    let row: Vec<f64> = t1
        .iter()
        .zip(t2)
        .map(|(t1, t2)| turn.along[0] * t1 + turn.along[1] * t2)
        .collect();
    // Accelerations by a force on the pair. The rigid contact of other pairs bears a part of it.
    let count = held.len();
    let inner = Mat::from_fn(count, count, |i, j| dot(held[i], held[j]));
    let mut shares: Vec<f64> = held.iter().map(|h| dot(h, &row)).collect();
    Lu::new(inner).solve_column_in_place(&mut shares);
    let mut moved = row.clone();
    for (h, share) in held.iter().zip(&shares) {
        for (m, h) in moved.iter_mut().zip(h.iter()) {
            *m -= share * h;
        }
    }
    let by_force = dot(&row, &moved);
    let free = turn.acceleration + by_force * turn.force_n;
    let [before, after] = [-1.0, 1.0].map(|sign| free + sign * by_force * turn.limit_n);
    let jump = moved.iter().map(|m| 2.0 * turn.limit_n * m / before);
    (before < 0.0 && after < 0.0).then(|| Reversal {
        instant: turn.at as f64,
        jump: jump.collect(),
        row,
    })
}

/// Instants at which stretches begin: 0, each change of a pair, and the ends of equal stretches in which
/// a pair with friction slips.
fn instants(
    pairs: &[ChangingPair],
    reversals: &[Reversal],
    samples: usize,
    stretches: usize,
) -> Vec<f64> {
    let changes = pairs.iter().flat_map(|pair| pair.passage.changes());
    let length = samples / stretches;
    let slips = |n: &usize| {
        let of = |pair: &ChangingPair| pair.friction > 0.0 && pair.passage.slips_about(*n);
        pairs.iter().any(of)
    };
    let equal = (0..samples).step_by(length).filter(slips).map(|n| n as f64);
    let turns = reversals.iter().map(|reversal| reversal.instant);
    let mut instants: Vec<f64> = changes.chain(equal).chain(turns).chain([0.0]).collect();
    instants.sort_by(f64::total_cmp);
    instants.dedup_by(|b, a| *b - *a < SAME_INSTANT);
    instants
}

impl ChangingPair {
    /// Pair of this number with these rows and its passage.
    fn new(
        pair: usize,
        rows: &[Vec<f64>; 3],
        problem: &Problem,
        omega: f64,
        passage: Passage,
    ) -> Self {
        let law = &problem.laws[pair];
        let size2 = rows.iter().map(|row| dot(row, row)).fold(0.0, f64::max);
        let scale = size2.sqrt();
        let own = problem.reduced.diagonal_stiffness();
        let given = law.stiffness.map(|s| [s.normal_n_m, s.tangential_n_m]);
        let (springs, dashpots) = match given {
            Some(given) => (given.map(|k| k * size2), [0.0; 2]),
            None => {
                let stiffest = own[3 * pair].max(own[3 * pair + 1]) * size2;
                let frequency2 = RIGID * RIGID * stiffest.max(omega * omega);
                let dashpot = 2.0 * RIGID_DAMPING * frequency2.sqrt();
                ([frequency2; 2], [dashpot; 2])
            }
        };
        Self {
            rows: rows
                .each_ref()
                .map(|row| row.iter().map(|v| v / scale).collect()),
            tangential_n_m: springs[1] / size2,
            springs,
            dashpots,
            friction: law.computed_friction(),
            memory: None,
            passage,
        }
    }

    /// Row across or along the friction force by that along.
    fn tangential_row(&self, direction: [f64; 2]) -> Vec<f64> {
        let [_, t1, t2] = &self.rows;
        let both = t1.iter().zip(t2);
        both.map(|(t1, t2)| direction[0] * t1 + direction[1] * t2)
            .collect()
    }

    /// Adds the forces of the pair at a sample to the rates of the states, in units of frequency `unit`; `n`
    /// is the number of coordinates.
    fn add_rates(&self, rates: &mut Mat<f64>, n: usize, unit: f64, sample: usize) {
        let springs = self.springs.map(|k| -k / (unit * unit));
        let dashpots = self.dashpots.map(|c| -c / unit);
        let [normal, t1, t2] = &self.rows;
        let contact = self.passage.contact[sample];
        if contact == Contact::Open {
            if let Some(memory) = self.memory {
                for (c, row) in [t1, t2].into_iter().enumerate() {
                    add_outer(rates, [memory + c, n], 1.0, &[1.0], row);
                }
            }
            return;
        }
        add_outer(rates, [n, 0], springs[0], normal, normal);
        add_outer(rates, [n, n], dashpots[0], normal, normal);
        let Some(memory) = self.memory else {
            return;
        };
        if contact == Contact::Stick {
            for (c, row) in [t1, t2].into_iter().enumerate() {
                add_outer(rates, [n, 0], springs[1], row, row);
                add_outer(rates, [n, n], dashpots[1], row, row);
                add_outer(rates, [n, memory + c], -springs[1], row, &[1.0]);
            }
            return;
        }
        let along = self.passage.direction[sample];
        let across = [-along[1], along[0]];
        let row = self.tangential_row(along);
        add_outer(rates, [n, 0], -self.friction * springs[0], &row, normal);
        add_outer(rates, [n, n], -self.friction * dashpots[0], &row, normal);
        let row = self.tangential_row(across);
        add_outer(rates, [n, 0], springs[1], &row, &row);
        add_outer(rates, [n, memory], -springs[1], &row, &across);
        let forgets = self.tangential_n_m * self.passage.forgets[sample] / unit;
        add_outer(rates, [memory, 0], forgets, &across, &row);
        add_outer(rates, [memory, memory], -forgets, &across, &across);
    }

    /// Applies a change of status, from the status at one sample to the status at another, to the states
    /// in the rows of a matrix. `change` is the sample of the interval between them.
    fn pass_over(&self, matrix: &mut Mat<f64>, n: usize, [before, change, now]: [usize; 3]) {
        let Some(memory) = self.memory else {
            return;
        };
        let of = |row: &[f64], column: usize, matrix: &Mat<f64>| {
            dot(row, &matrix.col_as_slice(column)[..n])
        };
        let [was, is] = [before, now].map(|sample| self.passage.contact[sample]);
        for column in 0..matrix.ncols() {
            let [x_n, x_1, x_2] = self.rows.each_ref().map(|row| of(row, column, matrix));
            if was == Contact::Slip {
                // The slider follows the pair along the force, at the limit of friction.
                let along = self.passage.direction[before];
                let slider = [0, 1].map(|c| matrix[(memory + c, column)]);
                let limit = self.friction * self.springs[0] / self.springs[1] * x_n;
                let place = along[0] * x_1 + along[1] * x_2 + limit;
                let moved = place - along[0] * slider[0] - along[1] * slider[1];
                for c in 0..2 {
                    matrix[(memory + c, column)] += along[c] * moved;
                }
            }
            if was == Contact::Open && is != Contact::Open {
                // A pair that lands later has moved on.
                let slope = match is {
                    Contact::Stick => self.passage.slopes[change],
                    _ => [0.0; 2],
                };
                for (c, x) in [x_1, x_2].into_iter().enumerate() {
                    matrix[(memory + c, column)] = x - slope[c] * x_n;
                }
            }
        }
    }
}
