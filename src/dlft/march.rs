//! One pair marched through its period: from the predicted to the contact forces, with the exact
//! derivative including the history of slip.

use crate::contact::law::{Contact, length, slip_tangent, unilateral_coulomb};
use crate::numerics::fourier::Fourier;
use pulp::Arch;

/// Periods marched one after the other before the periodic state is solved for.
pub const PLAIN_PERIODS: usize = 6;
/// Periods after which a force that is still not periodic is given up.
pub const MOST_PERIODS: usize = 40;
/// Periodic when the state moves by less than this fraction of the largest predicted force.
const PERIODICITY: f64 = 1e-12;
/// A pair that shakes down ends at a corner of its cones (one per sample), touching each without
/// sliding: within this fraction of the largest predicted force a sample counts as touching.
const TOUCH: f64 = 1e-8;

/// How long a pair is marched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Periods {
    /// Until the end of a period equals its start.
    UntilPeriodic,
    /// A fixed number (at most [`PLAIN_PERIODS`]), periodic or not, as older programs do.
    Exactly(usize),
}

/// What the march of one pair starts from.
#[derive(Debug, Clone, Copy)]
pub struct PairInput<'a> {
    pub periods: Periods,
    /// Fourier coefficients of lambda_u, N: component-major, 3 x (2H+1).
    pub force: &'a [f64],
    /// eps_N times the initial clearance, N.
    pub shift_n: f64,
    pub friction: f64,
    /// lambda_x (tangential) at the start of the first period, N.
    pub start: [f64; 2],
}

/// How the march of one pair ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairEnd {
    pub periodic: bool,
    /// The pair sticks at every sample since the start: its contact force is its prediction.
    pub always_stuck: bool,
    pub open_samples: usize,
    /// Length of the path of lambda_x over the last period, N (distance slid = this / eps_T).
    pub slid_n: f64,
    history: History,
}

/// Which marched periods the derivative has to go through.
#[derive(Debug, Clone, Copy, PartialEq)]
enum History {
    /// This many, from the start.
    FromStart(usize),
    /// The state was solved for: `slipping` is the start of the last period that slid (the state is
    /// the fixed point of that period), `last` the start of the last period.
    FixedPoint {
        slipping: [f64; 2],
        last: [f64; 2],
        touch_n: f64,
    },
}

/// Signals of the last marched period, component-major, 3 x N; reused from pair to pair.
pub struct Signals {
    pub lambda_u: Vec<f64>,
    pub lambda: Vec<f64>,
}

impl Signals {
    pub fn new(samples: usize) -> Self {
        Self {
            lambda_u: vec![0.0; 3 * samples],
            lambda: vec![0.0; 3 * samples],
        }
    }
}

/// Marches one pair to its periodic contact force and writes the coefficients of that force into
/// `lambda` (component-major, 3 x (2H+1)).
pub fn march(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &mut Signals,
    lambda: &mut [f64],
) -> PairEnd {
    // With the widest vectors the processor has; the same arithmetic.
    Arch::new().dispatch(|| march_pair(fourier, input, signals, lambda))
}

#[inline(always)]
fn march_pair(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &mut Signals,
    lambda: &mut [f64],
) -> PairEnd {
    let (samples, width) = (fourier.samples(), fourier.width());
    for c in 0..3 {
        fourier.to_time(
            &input.force[c * width..(c + 1) * width],
            &mut signals.lambda_u[c * samples..(c + 1) * samples],
        );
    }
    let scale = signals.lambda_u.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut state = input.start;
    if input.friction == 0.0 {
        // No force depends on what was: the state is that of the last sample, and one period is periodic.
        state = [2, 3].map(|c| signals.lambda_u[c * samples - 1]);
    }
    let mut end = PairEnd {
        periodic: false,
        always_stuck: true,
        open_samples: 0,
        slid_n: 0.0,
        history: History::FromStart(1),
    };
    let mut slipping = state;
    for period in 1..=MOST_PERIODS {
        let before = state;
        let (slips, memory) = one_period(samples, &input, signals, &mut state, &mut end);
        end.always_stuck &= !slips;
        if slips {
            slipping = before;
        }
        end.history = if period <= PLAIN_PERIODS {
            History::FromStart(period)
        } else {
            History::FixedPoint {
                slipping,
                last: before,
                touch_n: TOUCH * scale,
            }
        };
        let moved = [state[0] - before[0], state[1] - before[1]];
        end.periodic = match input.periods {
            Periods::UntilPeriodic => moved[0].hypot(moved[1]) <= PERIODICITY * scale,
            Periods::Exactly(count) => period >= count.min(PLAIN_PERIODS),
        };
        if end.periodic {
            break;
        }
        if period >= PLAIN_PERIODS {
            // Newton's step on (state after a period) = (state before it).
            let step = memory.fixed_point_step(moved);
            state = [before[0] + step[0], before[1] + step[1]];
        }
    }
    for c in 0..3 {
        fourier.to_frequency(
            &signals.lambda[c * samples..(c + 1) * samples],
            &mut lambda[c * width..(c + 1) * width],
        );
    }
    end
}

/// Marches one period from `state`; says whether any sample was off sticking.
#[inline(always)]
fn one_period(
    samples: usize,
    input: &PairInput<'_>,
    signals: &mut Signals,
    state: &mut [f64; 2],
    end: &mut PairEnd,
) -> (bool, Memory) {
    let (mut slips, mut memory) = (false, Memory::Whole);
    (end.open_samples, end.slid_n) = (0, 0.0);
    for n in 0..samples {
        let predicted = prediction(signals, samples, n, input.shift_n, *state);
        let (contact, force) = unilateral_coulomb(predicted, input.friction);
        for (c, force) in force.iter().enumerate() {
            signals.lambda[c * samples + n] = *force;
        }
        if contact == Contact::Stick {
            continue;
        }
        slips = true;
        let next = [
            signals.lambda_u[samples + n] - force[1],
            signals.lambda_u[2 * samples + n] - force[2],
        ];
        if contact == Contact::Open {
            end.open_samples += 1;
            memory = Memory::Lost;
        } else {
            end.slid_n += length(next[0] - state[0], next[1] - state[1]);
            memory = memory.after_slip(predicted, input.friction);
        }
        *state = next;
    }
    (slips, memory)
}

/// Derivative of the state lambda_x after a stretch of samples by the state before it. Each slip
/// maps a change onto the direction across the slide, times kappa: a product of such is of rank one.
#[derive(Debug, Clone, Copy)]
enum Memory {
    /// Sticking throughout: the identity.
    Whole,
    /// factor last first^T.
    RankOne {
        factor: f64,
        last: [f64; 2],
        first: [f64; 2],
    },
    /// Opened: nothing of the earlier state is left.
    Lost,
}

impl Memory {
    #[inline(always)]
    fn after_slip(self, predicted: [f64; 3], friction: f64) -> Self {
        let tangent = slip_tangent(predicted, friction);
        let across = [-tangent.direction[1], tangent.direction[0]];
        match self {
            Self::Lost => Self::Lost,
            Self::Whole => Self::RankOne {
                factor: tangent.kappa,
                last: across,
                first: across,
            },
            Self::RankOne {
                factor,
                last,
                first,
            } => {
                let turn = across[0] * last[0] + across[1] * last[1];
                Self::RankOne {
                    factor: factor * tangent.kappa * turn,
                    last: across,
                    first,
                }
            }
        }
    }

    /// (I - memory)^-1 r.
    fn fixed_point_step(self, r: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Whole | Self::Lost => r,
            Self::RankOne {
                factor,
                last,
                first,
            } => {
                let rest = 1.0 - factor * (first[0] * last[0] + first[1] * last[1]);
                if rest < 1e-9 {
                    return r;
                }
                let c = factor * (first[0] * r[0] + first[1] * r[1]) / rest;
                [r[0] + c * last[0], r[1] + c * last[1]]
            }
        }
    }
}

#[inline(always)]
fn prediction(
    signals: &Signals,
    samples: usize,
    n: usize,
    shift: f64,
    state: [f64; 2],
) -> [f64; 3] {
    [
        signals.lambda_u[n] + shift,
        signals.lambda_u[samples + n] - state[0],
        signals.lambda_u[2 * samples + n] - state[1],
    ]
}

/// Derivative of the marched force by the coefficients of lambda_u: `derivative` is 3(2H+1) square,
/// row-major, both indices component-major. `signals` and `end` are those of [`march`].
pub fn march_derivative(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &Signals,
    end: &PairEnd,
    derivative: &mut [f64],
) {
    Arch::new().dispatch(|| differentiate_pair(fourier, input, signals, end, derivative));
}

#[inline(always)]
fn differentiate_pair(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &Signals,
    end: &PairEnd,
    derivative: &mut [f64],
) {
    let (samples, width) = (fourier.samples(), fourier.width());
    let full = 3 * width;
    derivative.fill(0.0);
    let mut pass = Pass {
        fourier,
        input: &input,
        signals,
        state: input.start,
        touch_n: 0.0,
        history: vec![0.0; 2 * full],
        force_rows: vec![0.0; 2 * full],
    };
    match end.history {
        History::FromStart(periods) => {
            for _ in 1..periods {
                pass.period(None);
            }
        }
        History::FixedPoint {
            slipping,
            last,
            touch_n,
        } => {
            pass.touch_n = touch_n;
            // d state = (I - memory)^-1 d(period map).
            pass.state = slipping;
            let memory = pass.period(None);
            let (first, second) = pass.history.split_at_mut(full);
            for (a, b) in first.iter_mut().zip(second) {
                [*a, *b] = memory.fixed_point_step([*a, *b]);
            }
            pass.state = last;
        }
    }
    pass.period(Some(derivative));
    // Rows: the weights of the analysis.
    let scale = 1.0 / samples as f64;
    for (row, values) in derivative.chunks_exact_mut(full).enumerate() {
        let weight = if row % width == 0 { scale } else { 2.0 * scale };
        values.iter_mut().for_each(|v| *v *= weight);
    }
}

/// The derivative of the state, carried along the samples.
struct Pass<'a> {
    fourier: &'a Fourier,
    input: &'a PairInput<'a>,
    signals: &'a Signals,
    state: [f64; 2],
    /// A sticking sample this close to its cone counts as slipping, N.
    touch_n: f64,
    /// d lambda_x / d lambda_u, two rows of 3(2H+1).
    history: Vec<f64>,
    force_rows: Vec<f64>,
}

impl Pass<'_> {
    /// Goes through one period; adds the derivative of the force (rows still to be scaled) if asked.
    #[inline(always)]
    fn period(&mut self, mut derivative: Option<&mut [f64]>) -> Memory {
        let (samples, width) = (self.fourier.samples(), self.fourier.width());
        let full = 3 * width;
        let mut memory = Memory::Whole;
        // Over a run of sticking samples the history is constant: only the sums of s and s s^T grow.
        let mut run = StickRun::new(width);
        for n in 0..samples {
            let s = self.fourier.synthesis_row(n);
            let predicted = prediction(self.signals, samples, n, self.input.shift_n, self.state);
            let (mut contact, force) = unilateral_coulomb(predicted, self.input.friction);
            if contact == Contact::Stick && self.touch_n > 0.0 {
                let margin =
                    -self.input.friction * predicted[0] - length(predicted[1], predicted[2]);
                if margin <= self.touch_n {
                    contact = Contact::Slip;
                }
            }
            if let (Some(derivative), false) = (&mut derivative, contact == Contact::Open) {
                // Normal force: the prediction itself.
                for (h, &sh) in s.iter().enumerate() {
                    let row = &mut derivative[h * full..h * full + width];
                    row.iter_mut().zip(s).for_each(|(d, &v)| *d += sh * v);
                }
            }
            if contact == Contact::Stick {
                if derivative.is_some() {
                    run.add(s);
                }
                continue;
            }
            if let Some(derivative) = &mut derivative {
                run.flush(&self.history, width, derivative);
            }
            self.state = [
                self.signals.lambda_u[samples + n] - force[1],
                self.signals.lambda_u[2 * samples + n] - force[2],
            ];
            self.force_rows.fill(0.0);
            if contact == Contact::Slip {
                let friction = self.input.friction;
                slip_rows(predicted, friction, s, &self.history, &mut self.force_rows);
                memory = memory.after_slip(predicted, friction);
                if let Some(derivative) = &mut derivative {
                    accumulate(s, &self.force_rows, width, derivative);
                }
            } else {
                memory = Memory::Lost;
            }
            // history = S_T - d lambda_T
            self.history
                .iter_mut()
                .zip(&self.force_rows)
                .for_each(|(g, f)| *g = -f);
            for (h, &sh) in s.iter().enumerate() {
                self.history[width + h] += sh;
                self.history[full + 2 * width + h] += sh;
            }
        }
        if let Some(derivative) = &mut derivative {
            run.flush(&self.history, width, derivative);
        }
        memory
    }
}

/// d lambda_T = -mu e S_N + kappa (I - e e^T) (S_T - history).
#[inline(always)]
fn slip_rows(predicted: [f64; 3], friction: f64, s: &[f64], history: &[f64], rows: &mut [f64]) {
    let width = s.len();
    let full = 3 * width;
    let tangent = slip_tangent(predicted, friction);
    let [e1, e2] = tangent.direction;
    // (I - e e^T) = across across^T in the plane: one scalar row serves both components.
    let across = [-e2, e1];
    let k = tangent.kappa;
    let (first, second) = rows.split_at_mut(full);
    let (h1, h2) = history.split_at(full);
    for j in 0..full {
        let v = -k * (across[0] * h1[j] + across[1] * h2[j]);
        first[j] = across[0] * v;
        second[j] = across[1] * v;
    }
    for (h, &sh) in s.iter().enumerate() {
        first[h] -= friction * e1 * sh;
        second[h] -= friction * e2 * sh;
        for (c, a) in across.iter().enumerate() {
            let j = (c + 1) * width + h;
            first[j] += k * across[0] * a * sh;
            second[j] += k * across[1] * a * sh;
        }
    }
}

/// derivative (tangential rows) += s (x) rows.
#[inline(always)]
fn accumulate(s: &[f64], rows: &[f64], width: usize, derivative: &mut [f64]) {
    let full = 3 * width;
    for (c, row) in rows.chunks_exact(full).enumerate() {
        for (h, &sh) in s.iter().enumerate() {
            let start = ((c + 1) * width + h) * full;
            let target = &mut derivative[start..start + full];
            target.iter_mut().zip(row).for_each(|(d, v)| *d += sh * v);
        }
    }
}

/// Sums over consecutive sticking samples.
struct StickRun {
    length: usize,
    /// sum s, and sum s s^T.
    first: Vec<f64>,
    second: Vec<f64>,
}

impl StickRun {
    fn new(width: usize) -> Self {
        Self {
            length: 0,
            first: vec![0.0; width],
            second: vec![0.0; width * width],
        }
    }

    #[inline(always)]
    fn add(&mut self, s: &[f64]) {
        self.length += 1;
        for (h, &sh) in s.iter().enumerate() {
            self.first[h] += sh;
            let row = &mut self.second[h * s.len()..(h + 1) * s.len()];
            row.iter_mut().zip(s).for_each(|(d, v)| *d += sh * v);
        }
    }

    /// Adds `sum s (x) (S_T - history)` to the tangential rows and starts afresh.
    #[inline(always)]
    fn flush(&mut self, history: &[f64], width: usize, derivative: &mut [f64]) {
        if self.length == 0 {
            return;
        }
        let full = 3 * width;
        for c in 0..2 {
            for h in 0..width {
                let start = ((c + 1) * width + h) * full;
                let row = &mut derivative[start..start + full];
                let g = &history[c * full..(c + 1) * full];
                let sh = self.first[h];
                row.iter_mut().zip(g).for_each(|(d, v)| *d -= sh * v);
                let own = &mut row[(c + 1) * width..(c + 2) * width];
                let squares = &self.second[h * width..(h + 1) * width];
                own.iter_mut().zip(squares).for_each(|(d, v)| *d += v);
            }
        }
        self.length = 0;
        self.first.fill(0.0);
        self.second.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn force(width: usize, seed: f64) -> Vec<f64> {
        (0..3 * width)
            .map(|i| {
                let base = if i == 0 { -1.0 } else { 0.0 };
                base + 0.8 * (seed + 1.7 * i as f64).sin() / (1 + i % width) as f64
            })
            .collect()
    }

    /// Compares the derivative with central differences of step `h`.
    fn check_derivative(fourier: &Fourier, input: PairInput<'_>, h: f64, what: &str) -> PairEnd {
        let (samples, full) = (fourier.samples(), 3 * fourier.width());
        let mut signals = Signals::new(samples);
        let end = march(fourier, input, &mut signals, &mut vec![0.0; full]);
        assert!(end.periodic);
        let mut d = vec![0.0; full * full];
        march_derivative(fourier, input, &signals, &end, &mut d);
        for column in 0..full {
            let sides = [h, -h].map(|step| {
                let mut force = input.force.to_vec();
                force[column] += step;
                let mut lambda = vec![0.0; full];
                let moved = PairInput {
                    force: &force,
                    ..input
                };
                march(fourier, moved, &mut Signals::new(samples), &mut lambda);
                lambda
            });
            for row in 0..full {
                let difference = (sides[0][row] - sides[1][row]) / (2.0 * h);
                let exact = d[row * full + column];
                assert!((difference - exact).abs() < 1e-4, "{what}: {row} {column}");
            }
        }
        end
    }

    #[test]
    fn derivative_with_slip_history_matches_differences() {
        let fourier = Fourier::new(3, 64);
        let (mut sliding, mut opening, mut solved) = (0, 0, 0);
        for trial in 0..30 {
            let f = force(fourier.width(), trial as f64);
            let input = PairInput {
                periods: Periods::UntilPeriodic,
                force: &f,
                shift_n: 0.05,
                friction: 0.4,
                start: [0.03, -0.02],
            };
            let end = check_derivative(&fourier, input, 1e-7, &format!("trial {trial}"));
            sliding += usize::from(!end.always_stuck);
            opening += usize::from(end.open_samples > 0);
            solved += usize::from(matches!(end.history, History::FixedPoint { .. }));
        }
        assert!(
            sliding > 10 && opening > 5 && solved > 2,
            "{sliding} {opening} {solved}"
        );
    }

    #[test]
    fn derivative_of_a_pair_that_shakes_down_between_two_cones_matches_differences() {
        let fourier = Fourier::new(1, 64);
        let mut shaken = 0;
        for trial in 0..40 {
            let angle = trial as f64;
            // N, t1, t2: steady compression, an elliptic tangential force within the cone's size.
            let f = [-1.0, 0.02, 0.01, 0.0, 0.2, 0.05, 0.0, 0.03, 0.16];
            let input = PairInput {
                periods: Periods::UntilPeriodic,
                force: &f,
                shift_n: 0.0,
                friction: 0.25,
                start: [0.3 * angle.cos(), 0.3 * angle.sin()],
            };
            let end = check_derivative(&fourier, input, 1e-6, &format!("trial {trial}"));
            let fixed = matches!(end.history, History::FixedPoint { .. });
            shaken += usize::from(fixed && end.slid_n < 1e-8);
        }
        assert!(shaken > 2, "{shaken}");
    }

    #[test]
    fn a_pair_inside_its_cone_returns_its_prediction_and_an_identity_derivative() {
        let fourier = Fourier::new(2, 32);
        let full = 3 * fourier.width();
        let mut f = vec![0.0; full];
        f[0] = -10.0;
        f[6] = 0.5;
        let input = PairInput {
            periods: Periods::UntilPeriodic,
            force: &f,
            shift_n: 0.0,
            friction: 0.3,
            start: [0.0; 2],
        };
        let mut signals = Signals::new(32);
        let mut lambda = vec![0.0; full];
        let end = march(&fourier, input, &mut signals, &mut lambda);
        assert!(end.always_stuck && end.periodic && end.history == History::FromStart(1));
        let mut d = vec![0.0; full * full];
        march_derivative(&fourier, input, &signals, &end, &mut d);
        for i in 0..full {
            assert!((lambda[i] - f[i]).abs() < 1e-14);
            for j in 0..full {
                let identity = f64::from(u8::from(i == j));
                assert!((d[i * full + j] - identity).abs() < 1e-14);
            }
        }
    }
}
