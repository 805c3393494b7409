//! Unknowns and matrices of the bodies for perturbations of a large model: the displacements that the
//! contact lets move at some time, and the modes that are slow beside a step.

use super::step_laws::StepLaw;
use crate::contact::coulomb::Contact;
use crate::damping::Rayleigh;
use crate::problem::Problem;
use crate::stability::equations::add_outer;
use faer::Mat;

/// Numbers of the column and of the row that belong to a direction of a pair; `None` where it is held,
/// and where no law needs its force.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) column: Option<usize>,
    pub(super) row: Option<usize>,
}

/// Pair that changes its status or slips.
pub(super) struct MovingPair {
    pub(super) places: [Place; 3],
    /// Number in the problem.
    pub(super) number: usize,
    /// Springs, normal and tangential, N/m; `None` for a rigid pair.
    pub(super) springs: Option<[f64; 2]>,
    pub(super) friction: f64,
    /// First row of its slider among the sliders; `None` without springs.
    pub(super) slider: Option<usize>,
    /// Laws in the steps of a period.
    pub(super) laws: Vec<StepLaw>,
}

/// Laws of a pair in the steps of a period.
pub(super) enum PairLaws {
    /// It does not touch.
    Open,
    /// It sticks in all steps.
    Stuck,
    /// It slips, or opens at times.
    Changing(Vec<StepLaw>),
}

/// Displacement or modal amplitude, by its number in the reduced model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unknown {
    Pair(usize),
    Mode(usize),
}

/// Unknowns and matrices. Rows are those of the columns, and those of normal forces whose displacements
/// are held.
pub(super) struct Bodies {
    pub(super) pairs: Vec<MovingPair>,
    /// Displacements of the columns, by their numbers in the reduced model.
    pub(super) displacements: Vec<usize>,
    /// Modes of the columns behind them.
    pub(super) modes: Vec<usize>,
    pub(super) sliders: usize,
    /// Angular frequency of the excitation, rad/s.
    omega: f64,
    /// Rows by columns.
    pub(super) stiffness: Mat<f64>,
    pub(super) mass: Mat<f64>,
    pub(super) damping: Mat<f64>,
}

/// What moves.
#[derive(Default)]
struct Moving {
    pairs: Vec<MovingPair>,
    displacements: Vec<usize>,
    /// Pairs with friction that need the row of their normal force, by their place in `pairs`.
    held: Vec<usize>,
    /// Constant springs, N/m, on columns.
    springs: Vec<(usize, f64)>,
    sliders: usize,
}

impl Moving {
    fn new(problem: &Problem, laws: Vec<PairLaws>) -> Self {
        let mut moving = Self::default();
        for (number, laws) in laws.into_iter().enumerate() {
            moving.add(problem, number, laws);
        }
        moving
    }

    fn add(&mut self, problem: &Problem, number: usize, laws: PairLaws) {
        let reduced = &problem.reduced;
        let law = &problem.laws[number];
        let given = law.stiffness.map(|s| [s.normal_n_m, s.tangential_n_m]);
        let moves = match (&laws, given) {
            (PairLaws::Stuck, None) => [false; 3],
            (PairLaws::Changing(laws), None) => {
                let opens = laws.iter().any(|law| law.contact == Contact::Open);
                [opens, true, true]
            }
            _ => [true; 3],
        };
        // A direction in which a pair has no unknowns has no mass and is coupled to nothing.
        let is_alone = |i: usize| {
            let mut others = (0..reduced.stiffness.nrows()).filter(|j| *j != i);
            reduced.mass[(i, i)] == 0.0 && others.all(|j| reduced.stiffness[(i, j)] == 0.0)
        };
        let places = [0, 1, 2].map(|c| {
            let moves = moves[c] && !is_alone(3 * number + c);
            let column = moves.then_some(self.displacements.len());
            self.displacements.extend(moves.then_some(3 * number + c));
            Place {
                column,
                row: column,
            }
        });
        let laws = match (laws, given) {
            (PairLaws::Changing(laws), _) => laws,
            (PairLaws::Stuck, Some([k_n, k_t])) => {
                let springs = places.iter().zip([k_n, k_t, k_t]);
                let springs = springs.filter_map(|(place, k)| Some((place.column?, k)));
                self.springs.extend(springs);
                return;
            }
            _ => return,
        };
        let friction = law.computed_friction();
        if given.is_none() && !moves[0] && friction > 0.0 {
            self.held.push(self.pairs.len());
        }
        self.pairs.push(MovingPair {
            number,
            places,
            springs: given,
            friction,
            slider: given.is_some().then_some(self.sliders),
            laws,
        });
        self.sliders += if given.is_some() { 2 } else { 0 };
    }
}

impl Bodies {
    /// Bodies of a problem that is excited with `omega`, rad/s, with the modes of at most `most_omega`.
    /// `laws` are those of the steps of each pair that may change.
    pub(super) fn new(
        problem: &Problem,
        damping: Rayleigh,
        laws: Vec<PairLaws>,
        [omega, most_omega]: [f64; 2],
    ) -> Self {
        let reduced = &*problem.reduced;
        let mut moving = Moving::new(problem, laws);
        let slow = reduced.omega2.iter().enumerate();
        let slow = slow.filter(|(_, w2)| **w2 <= most_omega * most_omega);
        let modes: Vec<usize> = slow.map(|(m, _)| m).collect();
        let displacements = moving.displacements.iter().copied().map(Unknown::Pair);
        let columns: Vec<Unknown> = displacements
            .chain(modes.iter().copied().map(Unknown::Mode))
            .collect();
        let mut rows = columns.clone();
        for pair in moving.held {
            let pair = &mut moving.pairs[pair];
            pair.places[0].row = Some(rows.len());
            rows.push(Unknown::Pair(3 * pair.number));
        }
        let [mut stiffness, mass] = matrices(problem, &rows, &columns);
        let mut viscous = Mat::from_fn(rows.len(), columns.len(), |i, j| {
            damping.stiffness_s * stiffness[(i, j)] + damping.mass_per_s * mass[(i, j)]
        });
        for (c, load) in problem.additional_damping(reduced.harmonic_model(0), damping) {
            let weight = |unknown: &Unknown| match unknown {
                Unknown::Pair(i) => load.on_x[*i],
                Unknown::Mode(m) => load.on_modes[*m],
            };
            let [of_rows, of_columns] =
                [&rows, &columns].map(|of| of.iter().map(weight).collect::<Vec<f64>>());
            add_outer(&mut viscous, [0, 0], c, &of_rows, &of_columns);
        }
        for (column, k) in moving.springs {
            stiffness[(column, column)] += k;
        }
        Self {
            pairs: moving.pairs,
            displacements: moving.displacements,
            modes,
            sliders: moving.sliders,
            omega,
            stiffness,
            mass,
            damping: viscous,
        }
    }

    /// Number of columns.
    pub(super) fn columns(&self) -> usize {
        self.displacements.len() + self.modes.len()
    }

    /// Names of the rows of a state: displacements and modes, of which each also has a velocity, and
    /// sliders. They are the same for all resolutions.
    pub(super) fn names(&self) -> [Vec<usize>; 3] {
        let with_sliders = self.pairs.iter().filter(|pair| pair.slider.is_some());
        let sliders = with_sliders.flat_map(|pair| [2 * pair.number, 2 * pair.number + 1]);
        [
            self.displacements.clone(),
            self.modes.clone(),
            sliders.collect(),
        ]
    }

    /// Weights of displacements and velocities, and of sliders, whose squares with them are energies, J.
    pub(super) fn weights(&self) -> [Vec<f64>; 2] {
        let diagonal = |of: &Mat<f64>, i: usize| of[(i, i)].abs();
        // A displacement that nothing opposes counts by its inertia.
        let inertial = |i: usize| self.omega.powi(2) * diagonal(&self.mass, i);
        let displaced = |i: usize| (diagonal(&self.stiffness, i) + inertial(i)).sqrt();
        let moving = |i: usize| diagonal(&self.mass, i).sqrt();
        let columns = 0..self.columns();
        let motion: Vec<f64> = columns
            .clone()
            .map(displaced)
            .chain(columns.map(moving))
            .collect();
        let of_sliders = self.pairs.iter().filter_map(|pair| pair.springs);
        let of_sliders = of_sliders.flat_map(|[_, k]| [k.sqrt(); 2]);
        [motion, of_sliders.collect()]
    }
}

/// Stiffness and mass on these rows and columns.
fn matrices(problem: &Problem, rows: &[Unknown], columns: &[Unknown]) -> [Mat<f64>; 2] {
    let reduced = &*problem.reduced;
    let stiffness = |i: usize, j: usize| match (rows[i], columns[j]) {
        (Unknown::Pair(i), Unknown::Pair(j)) => reduced.stiffness[(i, j)],
        (Unknown::Mode(i), Unknown::Mode(j)) if i == j => reduced.omega2[i],
        _ => 0.0,
    };
    let mass = |i: usize, j: usize| match (rows[i], columns[j]) {
        (Unknown::Pair(i), Unknown::Pair(j)) => reduced.mass[(i, j)],
        (Unknown::Pair(i), Unknown::Mode(m)) | (Unknown::Mode(m), Unknown::Pair(i)) => {
            reduced.coupling[(i, m)]
        }
        (Unknown::Mode(i), Unknown::Mode(j)) => f64::from(u8::from(i == j)),
    };
    let [rows, columns] = [rows.len(), columns.len()];
    [
        Mat::from_fn(rows, columns, stiffness),
        Mat::from_fn(rows, columns, mass),
    ]
}
