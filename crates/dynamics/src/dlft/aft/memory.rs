//! Memory of a stretch of samples: the influence of the friction state of a pair before it on the
//! state after it.

use crate::contact::PredictedLaw;
use crate::contact::coulomb::{Contact, SlipTangent};
use crate::dlft::between_samples::Visit;

/// Derivative of the state lambda_x after a stretch of samples by the state before it. Each slip
/// maps a change onto the direction across the force: a product of such maps is of rank one.
#[derive(Debug, Clone, Copy)]
pub(super) enum Memory {
    /// The pair sticks throughout: the identity.
    Whole,
    /// The matrix `factor last first^T`.
    RankOne {
        factor: f64,
        last: [f64; 2],
        first: [f64; 2],
    },
    /// The pair opened: nothing of the earlier state is left.
    Lost,
}

impl Memory {
    /// Memory after an evaluation of the law.
    #[inline(always)]
    pub(super) fn updated(self, visit: &Visit, law: &PredictedLaw) -> Self {
        let memory = if visit.landed { Self::Lost } else { self };
        match visit.contact {
            Contact::Stick => memory,
            Contact::Slip => memory.updated_by_slip(law.slip_tangent(visit.trial, visit.rate)),
            Contact::Open => Self::Lost,
        }
    }

    #[inline(always)]
    pub(super) fn updated_by_slip(self, tangent: SlipTangent) -> Self {
        let SlipTangent {
            across, by_trial, ..
        } = tangent;
        match self {
            Self::Lost => Self::Lost,
            Self::Whole => Self::RankOne {
                factor: 1.0,
                last: across,
                first: by_trial,
            },
            Self::RankOne {
                factor,
                last,
                first,
            } => {
                let kept = by_trial[0] * last[0] + by_trial[1] * last[1];
                Self::RankOne {
                    factor: factor * kept,
                    last: across,
                    first,
                }
            }
        }
    }

    /// Computes (I - memory)^-1 r.
    pub(super) fn fixed_point_step(self, r: [f64; 2]) -> [f64; 2] {
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
