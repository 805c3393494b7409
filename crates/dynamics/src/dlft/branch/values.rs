//! Curves over a value of the model at one frequency: a force, a coefficient of friction, a
//! clearance, a speed.
//!
//! Each value has its own model about its own static state. Derivatives by the value are
//! difference quotients between the models at two values close by. Where these differ in their loads
//! and matrices alone, `R_p = (I - D) (Lambda_p U - F_p)`, which is exact for a force, on which F
//! depends linearly. Else the residuals of both are subtracted: the law, the clearances and the
//! static state, from which the memory of friction is counted, then depend on the value, too.
//!
//! Where the matrices differ from those of the first value, Newton's method takes the derivative of
//! the point from which a step begins: each of its iterations then takes one model, and each point
//! two more.
//!
//! Models are made where a step asks for them, and dropped at its end. No model is asked for
//! outside of the range of values. eps is that of the first value along the whole curve.

use super::gauge::motion;
use super::over::{ContinuationParameter, DerivativePoint, Use};
use super::several::Several;
use super::trace::Course;
use crate::damping::Rayleigh;
use crate::dlft::accuracy::Refinement;
use crate::dlft::balance::{Balance, Jacobian, Setting};
use crate::dlft::gross_slip::free_slips_m;
use crate::dlft::orbit::{linear_point, observed_amplitudes_m};
use crate::dlft::point::FrequencySolver;
use crate::dlft::retention::{Holding, Mean};
use crate::dlft::sweep::{SweepSettings, SweepSolvers};
use crate::dlft::{LinearPoint, Response, SolvedFrequency, StaticState, SweepProgress};
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::problem::inexact::InexactModel;
use crate::reduced::ReducedModel;
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Half the distance of the values of a difference quotient, as a fraction of the range.
const DIFFERENCE: f64 = 1e-4;

/// Model at one value, about its static state.
#[derive(Debug, Clone)]
pub struct ModelAt {
    /// Problem to be solved.
    pub problem: Problem,
    /// Coefficients of its damping.
    pub damping: Rayleigh,
    /// Static state.
    pub state: StaticState,
}

/// Maker of the model at a value; `None` where there is none. The same value gives the same model.
pub type ModelOf<'a> = dyn Fn(f64) -> Option<Arc<ModelAt>> + Sync + 'a;

/// Values over which a curve is followed at one frequency.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ValueRange {
    /// Values from the first to the last one, ascending, at each of which motions are solved for.
    pub values: Vec<f64>,
    /// True to follow the curve over the logarithm of the value; all values are then positive.
    pub logarithmic: bool,
    /// Frequency of the first harmonic, Hz.
    pub frequency_hz: f64,
}

/// Curve over a value.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ValueCurve {
    /// Motions along the branches. All have the same frequency. Its linear reference is known at
    /// its motions alone.
    pub response: Response,
    /// Value of each motion of the response.
    pub values: Vec<f64>,
    /// Ranges in which several motions were found, ascending in value.
    pub several: Vec<SeveralAt>,
}

/// Range of values at which several motions were found, and the value in it at which the largest
/// and the smallest of them differ most.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SeveralAt {
    /// First value of the range.
    pub from: f64,
    /// Last value of the range.
    pub to: f64,
    /// Value at which an amplitude differs most.
    pub value: f64,
    /// Number of the observed displacement whose amplitude differs most, 0 = first.
    pub observation: usize,
    /// Largest amplitude of that displacement, m.
    pub amplitude_m: f64,
    /// Smallest amplitude of that displacement, m.
    pub other_amplitude_m: f64,
}

/// Follows the motions at one frequency over a value, from the first value to the last one and
/// back, round folds, as [`follow`](super::follow) follows those over the frequency. Each of the
/// values of the range is solved for wherever a branch passes it. The settings give everything but
/// the frequency; the slip threshold, where none is given, is that of each static state.
///
/// `earlier` are points that an interrupted run of the same question solved, and `tell` is called
/// for each point, as with [`follow`](super::follow). `None` where there is no model at the first
/// value.
pub fn follow_over(
    range: &ValueRange,
    model_of: &ModelOf<'_>,
    settings: &SweepSettings,
    earlier: &[SolvedFrequency],
    tell: &(dyn Fn(SweepProgress<'_>) + Sync),
) -> Option<ValueCurve> {
    let first = model_of(*range.values.first()?)?;
    let settings = SweepSettings {
        frequencies_hz: vec![range.frequency_hz],
        ..settings.clone()
    };
    let (problem, damping, state) = (&first.problem, first.damping, &first.state);
    let run = SweepSolvers::new(problem, damping, state, &settings, earlier, tell).along_a_curve();
    let values = Values {
        run: &run,
        range: range.clone(),
        model_of,
        first: Arc::clone(&first),
        slip_threshold_m: settings.slip_threshold_m,
    };
    let response = run.followed_over(&values);
    Some(range.curve(response))
}

/// Place between the first and the last value at which a key that takes whole numbers alone has none.
const INSIDE: f64 = 0.381_966;

impl ValueRange {
    /// First value, one between, and last value.
    pub fn ends_and_inside(&self) -> Vec<f64> {
        match (self.values.first(), self.values.last()) {
            (Some(from), Some(to)) => vec![*from, from + INSIDE * (to - from), *to],
            _ => Vec::new(),
        }
    }

    /// Abscissa of a value.
    pub(crate) fn abscissa(&self, value: f64) -> f64 {
        if self.logarithmic { value.ln() } else { value }
    }

    /// Value of an abscissa; exactly one of the values asked for where it is that of one.
    pub(crate) fn value(&self, abscissa: f64) -> f64 {
        let asked = self.values.iter().copied();
        let is_at = |value: &f64| self.abscissa(*value) == abscissa;
        let other = if self.logarithmic {
            abscissa.exp()
        } else {
            abscissa
        };
        asked.into_iter().find(is_at).unwrap_or(other)
    }

    /// Abscissae of the values asked for.
    pub fn abscissae(&self) -> Vec<f64> {
        self.values.iter().map(|v| self.abscissa(*v)).collect()
    }

    /// Curve of a response over these values, such as that of
    /// [`partial_response`](super::partial_response).
    pub fn curve(&self, response: Response) -> ValueCurve {
        let indices = 0..response.orbits.len();
        let values = indices.map(|i| self.value(response.abscissa(i))).collect();
        let several = super::several::several(&response).into_iter();
        let several = several.map(|found: Several| SeveralAt {
            from: self.value(found.from),
            to: self.value(found.to),
            value: self.value(found.at),
            observation: found.observation,
            amplitude_m: found.amplitude_m,
            other_amplitude_m: found.other_amplitude_m,
        });
        ValueCurve {
            values,
            several: several.collect(),
            response,
        }
    }
}

/// Values of a curve, with what is the same at all of them.
pub(crate) struct Values<'b> {
    /// Run of the first value: harmonics, samples, eps and solver are those of all values.
    run: &'b SweepSolvers<'b>,
    range: ValueRange,
    model_of: &'b ModelOf<'b>,
    first: Arc<ModelAt>,
    slip_threshold_m: Option<f64>,
}

impl Values<'_> {
    /// Abscissae of the values asked for.
    pub(crate) fn abscissae(&self) -> Vec<f64> {
        self.range.abscissae()
    }

    /// Solvers about the static state of a model, with the harmonics, samples and eps of the run.
    fn model_solvers(&self, model: Arc<ModelAt>) -> Known<'_> {
        let ModelAt {
            problem,
            damping,
            state,
        } = &*model;
        let (of_run, first) = (&self.run.refinement, &self.first.problem);
        let lowest = of_run.lowest();
        let is_as_first = have_same_matrices(&problem.reduced, &first.reduced);
        let inexact = match is_as_first {
            true => Arc::clone(&lowest.setting.inexact),
            false => InexactModel::new(&problem.reduced).into(),
        };
        let holding = match is_as_first && problem.excitations == first.excitations {
            true => Arc::clone(&lowest.holding),
            false => Holding::new(problem).into(),
        };
        let Setting { fourier, eps, .. } = &lowest.setting;
        let (fourier, eps) = (Arc::clone(fourier), Arc::clone(eps));
        let system = ContactSystem::new(problem, *damping).into();
        let about = Setting::new(state, system, inexact, fourier, eps);
        let mut setting = Setting {
            periods: lowest.setting.periods,
            slip_threshold_m: self.slip_threshold_m.unwrap_or(about.slip_threshold_m),
            ..about
        };
        setting.free_slips_m = free_slips_m(&setting, TAU * self.range.frequency_hz).into();
        let solver = FrequencySolver {
            setting,
            holding,
            ..lowest.clone()
        };
        let linear = state.linear.problem(problem, *damping);
        Known {
            linear: ContactSystem::new(&linear, *damping),
            is_as_first,
            refinement: of_run.rebuilt(&solver).into(),
            model,
        }
    }

    /// The value that is followed over in a step, whose models are dropped with it. `near` is the
    /// abscissa of a point of the curve from which the step begins.
    pub(crate) fn parameter(&self, near: Option<f64>) -> impl ContinuationParameter {
        ValueParameter {
            values: self,
            course: Course::spanning(&self.abscissae()),
            near,
            known: RefCell::default(),
        }
    }
}

/// A value of the model, within one step of the follower.
struct ValueParameter<'b> {
    values: &'b Values<'b>,
    course: Course,
    /// Abscissa of the point from which a step begins.
    near: Option<f64>,
    known: RefCell<Vec<(f64, Option<Arc<Known<'b>>>)>>,
}

/// Solvers or a balance at an abscissa close to that of a place.
struct Neighbouring<T> {
    abscissa: f64,
    found: T,
}

/// Model at an abscissa, with its linear reference and its solvers.
struct Known<'b> {
    model: Arc<ModelAt>,
    linear: ContactSystem,
    /// `true` if its matrices are those of the first value.
    is_as_first: bool,
    refinement: Arc<Refinement<'b>>,
}

impl ValueParameter<'_> {
    /// Solvers at an abscissa; `None` outside of the range, and where there is no model.
    fn solvers_at(&self, abscissa: f64) -> Option<Arc<Known<'_>>> {
        let Course { from, to } = self.course;
        if !(from.min(to)..=from.max(to)).contains(&abscissa) {
            return None;
        }
        let known = self.known.borrow();
        if let Some((_, found)) = known.iter().find(|(at, _)| *at == abscissa) {
            return found.clone();
        }
        drop(known);
        let values = self.values;
        let model = (values.model_of)(values.range.value(abscissa));
        let made = model.map(|model| Arc::new(values.model_solvers(model)));
        self.known.borrow_mut().push((abscissa, made.clone()));
        made
    }

    /// Solvers at two abscissae close to one, within the range, the greater one first; `None` where
    /// there are no two.
    fn neighbouring_solvers(&self, abscissa: f64) -> Option<[Neighbouring<Arc<Known<'_>>>; 2]> {
        let Course { from, to } = self.course;
        let by = DIFFERENCE * self.course.range();
        let [above, below] = [by, -by].map(|by| {
            let beside = (abscissa + by).clamp(from.min(to), from.max(to));
            let neighbour = |abscissa: f64| {
                Some(Neighbouring {
                    abscissa,
                    found: self.solvers_at(abscissa)?,
                })
            };
            neighbour(beside).or_else(|| neighbour(abscissa))
        });
        let (above, below) = (above?, below?);
        (above.abscissa > below.abscissa).then_some([above, below])
    }

    /// Balances of a place beside an abscissa, with their own ones.
    fn balances_beside(
        &self,
        place: DerivativePoint<'_>,
        abscissa: f64,
    ) -> Option<[Neighbouring<Balance>; 2]> {
        let mean = place.balance.mean();
        let [above, below] = self.neighbouring_solvers(abscissa)?.map(|known| {
            let solver = known.found.refinement.level(place.level);
            Some(Neighbouring {
                abscissa: known.abscissa,
                found: solver.balance(self.values.range.frequency_hz, mean)?,
            })
        });
        Some([above?, below?])
    }
}

/// Returns `true` if two models have the same matrices, in phase and in each wave.
fn have_same_matrices(one: &ReducedModel, other: &ReducedModel) -> bool {
    if std::ptr::eq(one, other) {
        return true;
    }
    let [own, others] = [one, other].map(|model| model.waves.copies());
    one.omega2 == other.omega2
        && one.stiffness == other.stiffness
        && one.mass == other.mass
        && one.coupling == other.coupling
        && own.keys().eq(others.keys())
        && own
            .values()
            .zip(others.values())
            .all(|(own, other)| have_same_matrices(own, other))
}

/// Returns `true` if two models rest alike under the same laws: their balances then differ in the
/// dynamic stiffness and the loads alone.
fn rest_alike(one: &ModelAt, other: &ModelAt) -> bool {
    one.problem.laws == other.problem.laws
        && one.state.x == other.state.x
        && one.state.lambda == other.state.lambda
}

/// Difference quotient of a vector that two balances have.
fn quotient(
    [above, below]: &[Neighbouring<Balance>; 2],
    of: impl Fn(&Balance) -> Vec<f64>,
) -> Vec<f64> {
    let by = above.abscissa - below.abscissa;
    let (a, b) = (of(&above.found), of(&below.found));
    a.iter().zip(&b).map(|(a, b)| (a - b) / by).collect()
}

impl ContinuationParameter for ValueParameter<'_> {
    fn refinement(&self, abscissa: f64) -> Option<Arc<Refinement<'_>>> {
        Some(Arc::clone(&self.solvers_at(abscissa)?.refinement))
    }

    fn frequency_hz(&self, _: f64) -> f64 {
        self.values.range.frequency_hz
    }

    fn linear_point(&self, abscissa: f64) -> LinearPoint {
        let frequency_hz = self.values.range.frequency_hz;
        let Some(known) = self.solvers_at(abscissa) else {
            return LinearPoint {
                frequency_hz,
                observed_amplitude: Vec::new(),
            };
        };
        linear_point(&known.linear, self.values.run.harmonics(), frequency_hz)
    }

    fn end_before(&self, abscissa: f64) -> Option<f64> {
        let Course { from, to } = self.course;
        let end = abscissa.clamp(from.min(to), from.max(to));
        (end != abscissa).then_some(end)
    }

    fn column(
        &self,
        place: DerivativePoint<'_>,
        jacobian: &Jacobian,
        purpose: Use,
    ) -> Option<Vec<f64>> {
        // A model with other matrices than the first one is dear.
        let is_dear = !self.solvers_at(place.abscissa)?.is_as_first;
        let near = match purpose {
            Use::Correction if is_dear => self.near.unwrap_or(place.abscissa),
            Use::Correction | Use::Direction => place.abscissa,
        };
        let [above, below] = self.neighbouring_solvers(near)?;
        let alike = rest_alike(&above.found.model, &below.found.model);
        let beside = self.balances_beside(place, near)?;
        if alike {
            let left = |balance: &Balance| {
                let mut left = vec![0.0; place.u.len()];
                balance.apply_stiffness(place.u, &mut left);
                let both = left.iter_mut().zip(&balance.force);
                both.for_each(|(left, force)| *left -= force);
                left
            };
            let slope = quotient(&beside, left);
            let n = place.balance.unknowns_per_block();
            return Some(jacobian.unbalanced_part(&slope, n));
        }
        Some(quotient(&beside, |balance| {
            balance.evaluate(place.u).residual
        }))
    }

    fn motion_at(&self, place: DerivativePoint<'_>, abscissa: f64) -> Option<Vec<f64>> {
        let known = self.solvers_at(abscissa)?;
        let frequency_hz = self.values.range.frequency_hz;
        let balance = (known.refinement.level(place.level)).balance(frequency_hz, Mean::Free)?;
        Some(motion(&balance, place.u, frequency_hz))
    }

    fn motion_slope(&self, place: DerivativePoint<'_>) -> Option<Vec<f64>> {
        let beside = self.balances_beside(place, place.abscissa)?;
        let frequency_hz = self.values.range.frequency_hz;
        Some(quotient(&beside, |balance| {
            motion(balance, place.u, frequency_hz)
        }))
    }

    fn amplitudes_near(&self, place: DerivativePoint<'_>, u: &[f64], by: f64) -> Option<Vec<f64>> {
        let frequency_hz = self.values.range.frequency_hz;
        let of = |balance: &Balance, u: &[f64]| observed_amplitudes_m(balance, u, frequency_hz);
        let mut amplitudes = of(place.balance, u);
        if by != 0.0 {
            let beside = self.balances_beside(place, place.abscissa)?;
            let slope = quotient(&beside, |balance| of(balance, place.u));
            let both = amplitudes.iter_mut().zip(&slope);
            both.for_each(|(amplitude, slope)| *amplitude += by * slope);
        }
        Some(amplitudes)
    }
}

#[cfg(test)]
mod tests;
