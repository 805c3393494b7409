//! A period of perturbations in equal steps.

use super::GAMMA;
use super::bodies::{Bodies, MovingPair};
use super::states::States;
use super::step_laws::StepLaw;
use crate::contact::coulomb::Contact;
use crate::stability::Reason;
use dovetail_numerics::dense::{Lu, product};
use faer::Mat;
use rayon::prelude::*;

/// Share of the first stage's increment in the state that the second one starts from.
const CARRIED: f64 = (1.0 - GAMMA) / GAMMA;

/// Largest number of multiplications for a period: some seconds.
const MOST_OPERATIONS: f64 = 2e10;
/// Products with all unknowns in a step, for all perturbations of a block in some periods.
const PASSES: f64 = 200.0;

/// Period in steps.
pub(super) struct Period {
    bodies: Bodies,
    /// Rate a of a stage, 1/s.
    rate: f64,
    steps: Vec<Step>,
    /// Motions of the displacements that do not count, orthonormal.
    neutral: Mat<f64>,
    /// Forces a M v - K y on the rows of displacements and of normal forces, with the modes eliminated, by
    /// displacements and velocities.
    on_pairs: Mat<f64>,
    /// Motion of the modes by the same, and by the motion of the pairs.
    on_modes: Mat<f64>,
    by_pairs: Mat<f64>,
    /// Dynamic stiffness of the displacements with the modes eliminated.
    condensed: Mat<f64>,
}

/// Equations of a step.
struct Step {
    /// Columns of the displacements that are free, and the number of each column among them.
    free: Vec<usize>,
    place: Vec<Option<usize>>,
    /// For each of them its row, and the row that is added to it with a factor.
    rows: Vec<(usize, Option<(usize, f64)>)>,
    /// Moves of rigid pairs that land: a displacement, the normal one that it follows, and the factor.
    moves: Vec<(usize, usize, f64)>,
    factor: Lu,
}

/// Law of a pair with springs in a stage: force S x + G w and slider U x + W w by the displacement x
/// at the end of the stage and the slider w before it.
struct StageLaw {
    s: [[f64; 3]; 3],
    g: [[f64; 2]; 3],
    u: [[f64; 3]; 2],
    w: [[f64; 2]; 2],
}

impl Period {
    /// Period with the laws of its pairs in steps of this length, s. `neutral` are motions of the
    /// displacements that do not count, one in each column. Fails where a step cannot be
    /// solved.
    pub(super) fn new(
        bodies: Bodies,
        neutral: Mat<f64>,
        steps: usize,
        step_s: f64,
    ) -> Result<Self, Reason> {
        let rate = 1.0 / (GAMMA * step_s);
        let (n, m) = (bodies.displacements.len(), bodies.modes.len());
        let (rows, columns) = (bodies.stiffness.nrows(), n + m);
        let dynamic = Mat::from_fn(rows, columns, |i, j| {
            let [k, c, m] = [&bodies.stiffness, &bodies.damping, &bodies.mass].map(|of| of[(i, j)]);
            k + rate * (c + rate * m)
        });
        let loads = Mat::from_fn(rows, 2 * columns, |i, j| match j.checked_sub(columns) {
            None => -bodies.stiffness[(i, j)],
            Some(j) => rate * bodies.mass[(i, j)],
        });
        // Displacements first, then normal forces.
        let outer: Vec<usize> = (0..n).chain(columns..rows).collect();
        let modes = Lu::new(dynamic.get(n..columns, n..).to_owned());
        let mut by_pairs = dynamic.get(n..columns, ..n).to_owned();
        let mut on_modes = loads.get(n..columns, ..).to_owned();
        modes.solve_in_place(by_pairs.as_mut());
        modes.solve_in_place(on_modes.as_mut());
        let coupling = Mat::from_fn(outer.len(), m, |i, j| dynamic[(outer[i], n + j)]);
        let mut condensed = product(coupling.as_ref(), by_pairs.as_ref());
        let mut on_pairs = product(coupling.as_ref(), on_modes.as_ref());
        for (to, of) in [(&mut condensed, &dynamic), (&mut on_pairs, &loads)] {
            for (j, column) in to.col_iter_mut().enumerate() {
                for (v, i) in column.iter_mut().zip(&outer) {
                    *v = of[(*i, j)] - *v;
                }
            }
        }
        let count = outer.len() as f64 * columns as f64;
        let of_step = |number: usize| {
            let free = Step::free(&bodies, number).len() as f64;
            free.powi(3) + PASSES * (count + free * free)
        };
        if (0..steps).map(of_step).sum::<f64>() > MOST_OPERATIONS {
            return Err(Reason::TooLarge);
        }
        let steps: Vec<Step> = (0..steps)
            .into_par_iter()
            .map(|number| Step::new(&bodies, &condensed, rate, number))
            .collect();
        if steps.iter().any(|step| step.factor.is_singular()) {
            return Err(Reason::NotFound);
        }
        Ok(Self {
            bodies,
            rate,
            steps,
            neutral,
            on_pairs,
            on_modes,
            by_pairs,
            condensed,
        })
    }

    pub(super) const fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    /// States a period later, without their part along the motions that do not count.
    pub(super) fn advance(&self, states: &States) -> States {
        let mut states = states.clone();
        for number in 0..self.steps.len() {
            self.land(&mut states, number);
            let first = self.stage(&states, number);
            states.go_on(&first, CARRIED);
            states = self.stage(&states, number);
        }
        states.remove(self.neutral.as_ref());
        states
    }

    /// States at the end of a stage.
    fn stage(&self, from: &States, number: usize) -> States {
        let step = &self.steps[number];
        let (n, columns) = (self.bodies.displacements.len(), self.bodies.columns());
        let width = from.motion.ncols();
        let mut loads = product(self.on_pairs.as_ref(), from.motion.as_ref());
        let mut motion = Mat::<f64>::zeros(2 * columns, width);
        for (column, of, factor) in &step.moves {
            for j in 0..width {
                let moved = factor * from.motion[(*of, j)];
                motion[(*column, j)] = moved;
                for (load, stiffness) in loads
                    .col_mut(j)
                    .iter_mut()
                    .zip(self.condensed.col(*column).iter())
                {
                    *load -= stiffness * moved;
                }
            }
        }
        // Rows of normal forces follow those of displacements.
        let row = |i: usize| {
            if i < n {
                i
            } else {
                i - self.bodies.modes.len()
            }
        };
        let mut moved = Mat::from_fn(step.free.len(), width, |i, j| {
            let (own, added) = step.rows[i];
            let added = added.map_or(0.0, |(i, factor)| factor * loads[(row(i), j)]);
            loads[(own, j)] + added
        });
        let springs = self.bodies.pairs.iter().filter_map(|pair| {
            let law = StageLaw::new(pair, pair.laws.get(number)?, self.rate)?;
            Some((pair, pair.slider?, law))
        });
        let springs: Vec<_> = springs.collect();
        for (pair, slider, law) in &springs {
            let places = pair.places.map(|place| place.column);
            for j in 0..width {
                let x = places.map(|c| c.map_or(0.0, |c| from.motion[(c, j)]));
                let w = [0, 1].map(|c| from.sliders[(slider + c, j)]);
                for (c, place) in places.iter().enumerate() {
                    if let Some(i) = place.and_then(|column| step.place[column]) {
                        moved[(i, j)] -= dot(law.s[c], x) + dot(law.g[c], w);
                    }
                }
            }
        }
        step.factor.solve_in_place(moved.as_mut());
        for (i, column) in step.free.iter().enumerate() {
            for j in 0..width {
                motion[(*column, j)] = moved[(i, j)];
            }
        }
        let of_modes = product(self.on_modes.as_ref(), from.motion.as_ref());
        let by_pairs = product(self.by_pairs.as_ref(), motion.get(..n, ..));
        for j in 0..width {
            for i in 0..columns {
                let d = match i.checked_sub(n) {
                    None => motion[(i, j)],
                    Some(m) => of_modes[(m, j)] - by_pairs[(m, j)],
                };
                motion[(i, j)] = from.motion[(i, j)] + d;
                motion[(columns + i, j)] = self.rate * d;
            }
        }
        let mut sliders = from.sliders.clone();
        for (pair, slider, law) in &springs {
            for j in 0..width {
                let x = pair
                    .places
                    .map(|place| place.column.map_or(0.0, |c| motion[(c, j)]));
                let w = [0, 1].map(|c| from.sliders[(slider + c, j)]);
                for c in 0..2 {
                    sliders[(slider + c, j)] = dot(law.u[c], x) + dot(law.w[c], w);
                }
            }
        }
        States { motion, sliders }
    }

    /// Puts the sliders of pairs that land in a step to where they land: a pair that lands later has moved
    /// on.
    fn land(&self, states: &mut States, number: usize) {
        for pair in &self.bodies.pairs {
            let landing = pair.laws.get(number).and_then(|law| law.landing);
            let (Some(slope), Some(slider)) = (landing, pair.slider) else {
                continue;
            };
            for j in 0..states.motion.ncols() {
                let [x_n, x_1, x_2] = pair
                    .places
                    .map(|place| place.column.map_or(0.0, |c| states.motion[(c, j)]));
                states.sliders[(slider, j)] = x_1 - slope[0] * x_n;
                states.sliders[(slider + 1, j)] = x_2 - slope[1] * x_n;
            }
        }
    }
}

fn dot<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Step {
    /// Columns of the displacements that are free in a step.
    fn free(bodies: &Bodies, number: usize) -> Vec<usize> {
        let mut is_free = vec![true; bodies.displacements.len()];
        for pair in bodies.pairs.iter().filter(|pair| pair.springs.is_none()) {
            let contact = pair.laws[number].contact;
            for (c, place) in pair.places.iter().enumerate() {
                if let Some(column) = place.column {
                    is_free[column] = match contact {
                        Contact::Open => true,
                        Contact::Slip => c > 0,
                        Contact::Stick => false,
                    };
                }
            }
        }
        (0..is_free.len()).filter(|i| is_free[*i]).collect()
    }

    /// Equations of a step, from those of all displacements.
    fn new(bodies: &Bodies, condensed: &Mat<f64>, rate: f64, number: usize) -> Self {
        let n = bodies.displacements.len();
        let row_of = |i: usize| if i < n { i } else { i - bodies.modes.len() };
        let free = Self::free(bodies, number);
        let mut place = vec![None; n];
        for (i, column) in free.iter().enumerate() {
            place[*column] = Some(i);
        }
        let mut added = vec![None; n];
        let mut moves = Vec::new();
        for pair in bodies.pairs.iter().filter(|pair| pair.springs.is_none()) {
            let law = &pair.laws[number];
            let before = &pair.laws[(number + pair.laws.len() - 1) % pair.laws.len()];
            let [normal, tangential @ ..] = pair.places;
            let lands = before.contact == Contact::Open && law.contact != Contact::Open;
            let landed = normal.column.filter(|_| lands);
            moves.extend(landed.map(|column| (column, column, -1.0)));
            for (c, place) in tangential.iter().enumerate() {
                let Some(column) = place.column else {
                    continue;
                };
                match (law.contact, landed) {
                    (Contact::Slip, _) => {
                        let factor = pair.friction * law.direction[c];
                        added[column] = normal
                            .row
                            .map(|row| (row, factor))
                            .filter(|_| factor != 0.0);
                    }
                    (Contact::Stick, Some(normal)) => {
                        // A pair that lands later has moved on.
                        let slope = law.landing.or(before.landing);
                        moves.push((column, normal, -slope.map_or(0.0, |slope| slope[c])));
                    }
                    _ => {}
                }
            }
        }
        let rows: Vec<_> = free.iter().map(|i| (*i, added[*i])).collect();
        let mut matrix = Mat::from_fn(free.len(), free.len(), |i, j| {
            let (own, added) = rows[i];
            let added = added.map_or(0.0, |(row, factor)| {
                factor * condensed[(row_of(row), free[j])]
            });
            condensed[(own, free[j])] + added
        });
        let mut add = |i: Option<usize>, j: Option<usize>, value: f64| {
            let [i, j] = [i, j].map(|column| column.and_then(|column| place[column]));
            if let (Some(i), Some(j)) = (i, j) {
                matrix[(i, j)] += value;
            }
        };
        for pair in &bodies.pairs {
            let law = &pair.laws[number];
            let columns = pair.places.map(|place| place.column);
            if let Some(stage) = StageLaw::new(pair, law, rate) {
                for (i, row) in stage.s.iter().enumerate() {
                    (0..3).for_each(|j| add(columns[i], columns[j], row[j]));
                }
            } else if law.contact == Contact::Slip {
                for (i, row) in law.resistance.iter().enumerate() {
                    let resists = rate * pair.friction.signum();
                    (0..2).for_each(|j| add(columns[1 + i], columns[1 + j], resists * row[j]));
                }
            }
        }
        Self {
            factor: Lu::new(matrix),
            free,
            place,
            rows,
            moves,
        }
    }
}

impl StageLaw {
    /// Law of a pair in a stage; `None` for a rigid pair.
    fn new(pair: &MovingPair, law: &StepLaw, rate: f64) -> Option<Self> {
        let [k_n, k_t] = pair.springs?;
        let [k_n, k_t] = [k_n * law.closed, k_t];
        // The slider: w = U x + W w_before.
        let mut u = [[0.0; 3]; 2];
        let mut by_before = [[0.0; 2]; 2];
        match law.contact {
            _ if pair.friction == 0.0 => (u[0][1], u[1][2]) = (1.0, 1.0),
            Contact::Open => (u[0][1], u[1][2]) = (1.0, 1.0),
            Contact::Stick => (by_before[0][0], by_before[1][1]) = (1.0, 1.0),
            Contact::Slip => {
                let size = law.direction[0].hypot(law.direction[1]);
                let along = law
                    .direction
                    .map(|e| if size > 0.0 { e / size } else { 0.0 });
                // Friction resists across its force only.
                let across = [-along[1], along[0]];
                let resists: f64 = (0..2)
                    .map(|c| across[c] * dot(law.resistance[c], across))
                    .sum();
                let kept = rate * resists / (rate * resists + k_t);
                let limit = pair.friction * k_n / k_t;
                for c in 0..2 {
                    u[c][0] = along[c] * limit;
                    for d in 0..2 {
                        let across = across[c] * across[d];
                        u[c][1 + d] = along[c] * along[d] + (1.0 - kept) * across;
                        by_before[c][d] = kept * across;
                    }
                }
            }
        }
        let k = k_t * law.closed;
        let mut stage = Self {
            s: [[0.0; 3]; 3],
            g: [[0.0; 2]; 3],
            u,
            w: by_before,
        };
        stage.s[0][0] = k_n;
        for (c, slider) in u.iter().enumerate() {
            for (d, moved) in slider.iter().enumerate() {
                let own = if d == c + 1 { 1.0 } else { 0.0 };
                stage.s[1 + c][d] = k * (own - moved);
            }
            stage.g[1 + c] = by_before[c].map(|v| -k * v);
        }
        Some(stage)
    }
}
