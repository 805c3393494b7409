//! Static state in summary.json.

use serde::{Deserialize, Serialize};

use super::finite;
use dovetail_solver::dlft::{Outcome, StaticCounts, StaticState};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::static_fields;

/// Counts and forces of the static state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StaticSummary {
    /// End of the solution.
    pub outcome: Outcome,
    /// Counts of the states of the pairs. Counts and forces are `None` if the static state did not
    /// converge.
    #[serde(flatten)]
    pub counts: Option<StaticCounts>,
    /// Largest slip over the pairs, m.
    pub largest_slip_m: Option<f64>,
    /// Largest pressure over the pairs, Pa; `None` if the area of a pair is unknown.
    pub largest_pressure_pa: Option<f64>,
    /// Forces and counts of each contact.
    pub contacts: Vec<ContactSummary>,
    /// Force that retains the motions that friction does not hold, N; `None` if nothing is
    /// retained.
    pub retention_n: Option<f64>,
    /// Number of iterations of Newton's method.
    pub newton_iterations: usize,
    /// Relative residual; `None` if it is not finite.
    pub residual: Option<f64>,
}

/// Forces of a contact in the static state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactSummary {
    /// Name of the contact.
    pub name: String,
    /// Number of its pairs.
    pub pairs: usize,
    /// Area, m2; `None` if the area of a pair is unknown.
    pub area_m2: Option<f64>,
    /// Sum of the compressive forces of the pairs, N.
    pub normal_force_n: Option<f64>,
    /// Length of the vector sum of the friction forces of the pairs, N; `None` if the directions of
    /// the pairs are unknown.
    pub friction_force_n: Option<f64>,
    /// Normal force over area, Pa.
    pub mean_pressure_pa: Option<f64>,
    /// Counts of the states of its pairs; `None` if the static state did not converge.
    #[serde(flatten)]
    pub counts: Option<StaticCounts>,
}

/// Counts and forces of the static state.
pub fn static_summary(pairs: &PairTable, state: &StaticState) -> StaticSummary {
    let valid = state.outcome.is_converged();
    let fields = static_fields(state, &pairs.rows);
    let counts = Some(state.counts()).filter(|_| valid);
    let contacts = pairs.contacts.iter().enumerate().map(|(c, name)| {
        let of_contact = || {
            let rows = pairs.rows.iter().enumerate();
            rows.filter(move |(_, p)| p.contact == c)
        };
        let area_m2: Option<f64> = of_contact().map(|(_, p)| p.area_m2).sum();
        let statuses = of_contact().map(|(i, _)| fields.status[i]);
        let counts = valid.then(|| statuses.collect::<StaticCounts>());
        let force = valid.then(|| of_contact().map(|(i, _)| fields.normal_force_n[i]).sum());
        let friction = || {
            let mut total = [0.0; 3];
            for (i, pair) in of_contact() {
                let ([f1, f2], [_, t1, t2]) = (fields.friction_n[i], pair.frame?);
                for (axis, sum) in total.iter_mut().enumerate() {
                    *sum += f1 * t1[axis] + f2 * t2[axis];
                }
            }
            Some(total.iter().map(|f| f * f).sum::<f64>().sqrt())
        };
        ContactSummary {
            name: name.clone(),
            pairs: of_contact().count(),
            area_m2,
            normal_force_n: force,
            friction_force_n: if valid { friction() } else { None },
            mean_pressure_pa: force
                .zip(area_m2.filter(|a| *a > 0.0))
                .map(|(f, a): (f64, f64)| f / a),
            counts,
        }
    });
    StaticSummary {
        outcome: state.outcome,
        counts,
        largest_slip_m: valid.then(|| {
            fields
                .slip_m
                .iter()
                .map(|s| s[0].hypot(s[1]))
                .fold(0.0, f64::max)
        }),
        largest_pressure_pa: (valid && fields.pressure_pa.iter().all(|p| p.is_finite()))
            .then(|| fields.pressure_pa.iter().copied().fold(0.0, f64::max)),
        contacts: contacts.collect(),
        retention_n: state.retention_n.filter(|_| valid).and_then(finite),
        newton_iterations: state.newton_iterations,
        residual: finite(state.residual),
    }
}
