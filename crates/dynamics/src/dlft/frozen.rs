//! Vibration about the static state with the contacts frozen: closed pairs stick, open pairs stay open.
//! It is linear. Where it violates no condition of contact at any instant, it is the motion itself.

use crate::problem::LinearReference;
use crate::problem::dynamic_stiffness::ContactSystem;
use dovetail_numerics::spectrum::{blocks, cosine, sine};
use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

/// Pairs frozen in the state that they have in the static state.
pub(crate) struct FrozenContacts {
    reference: LinearReference,
    system: Arc<ContactSystem>,
    on_modes: OnceLock<ContactSystem>,
}

impl FrozenContacts {
    /// Contacts of `system` frozen as `reference` has them.
    pub(crate) fn new(reference: &LinearReference, system: &Arc<ContactSystem>) -> Self {
        Self {
            reference: reference.clone(),
            system: Arc::clone(system),
            on_modes: OnceLock::new(),
        }
    }

    /// Linear reference on its modes, without pairs.
    pub(crate) fn on_modes(&self) -> &ContactSystem {
        self.on_modes.get_or_init(|| {
            let ContactSystem { problem, damping } = &*self.system;
            ContactSystem::new(&self.reference.problem(problem, *damping), *damping)
        })
    }

    /// Relative displacements of the vibration at `omega` rad/s, m: (2H+1) n, zero in the mean.
    pub(crate) fn vibration(&self, omega: f64, harmonics: usize) -> Vec<f64> {
        let n = self.system.unknowns();
        let mut u = vec![0.0; blocks(harmonics) * n];
        let modes = self.on_modes();
        let excited = modes.problem.excitations.iter().map(|load| load.harmonic);
        let excited: BTreeSet<usize> = excited.filter(|k| (1..=harmonics).contains(k)).collect();
        for k in excited {
            let shares = modes.modal_response(k, omega, &[], &modes.modal_load(k, omega));
            let reduced = &self.system.problem.reduced;
            let x = self.reference.displacements(reduced, k, &shares);
            for (i, x) in x.iter().enumerate() {
                (u[cosine(k) * n + i], u[sine(k) * n + i]) = (x.re, -x.im);
            }
        }
        u
    }
}
