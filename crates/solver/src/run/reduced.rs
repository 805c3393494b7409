//! Reduced model of a scene, from meshes or from a folder.

use super::bodies::Bodies;
use super::error::Error;
use crate::damping::{DampingError, DampingSpec, ModalStiffness, Rayleigh, rayleigh};
use crate::description::{FrequencyRange, Scene};
use crate::dlft::settings::Resolution;
use crate::dlft::{Response, StaticState};
use crate::excitation::NamedExcitation;
use crate::problem::Problem;
use crate::reduced::{ObservedQuantity, ReducedModel};
use crate::reduction::{Highest, LISTED_MODES, StuckModes};
use crate::results::modes::{ModeKind, NaturalFrequency, hertz};
use crate::results::pairs::PairTable;

/// Reduced model of a scene with its laws and excitations, and the table of its pairs.
#[derive(Debug)]
#[non_exhaustive]
pub struct ReducedScene {
    /// Positions and areas of the pairs.
    pub pairs: PairTable,
    /// Problem to be solved.
    pub problem: Problem,
    /// Bodies; `None` where the model was read from a folder.
    pub bodies: Option<Bodies>,
    /// Excitations of the folder; empty where there are bodies, which have their own.
    pub of_folder: Vec<NamedExcitation>,
}

/// Displacement or strain that is observed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Observed {
    /// Name in the results.
    pub name: String,
    /// What is observed.
    pub quantity: ObservedQuantity,
}

impl ReducedScene {
    /// Matrices of the model.
    pub fn model(&self) -> &ReducedModel {
        &self.problem.reduced
    }

    /// Squared angular frequencies of the stuck modes, rad2/s2, ascending: those of the wave of the
    /// first harmonic where it is one round a disc.
    pub fn stuck_omega2(&self) -> Vec<f64> {
        let of = self.model().harmonic_model(1);
        let squares = of.model.stuck_omega2().iter();
        squares.step_by(of.copies()).copied().collect()
    }

    /// Squared angular frequencies of the linear reference about a static state, rad2/s2: as many
    /// modes as [`ReducedScene::stuck_omega2`] has, or [`LISTED_MODES`] where all that moves are
    /// open pairs.
    pub fn linear_omega2(&self, state: &StaticState) -> Vec<f64> {
        let modes = self.linear_modes(state);
        modes.iter().map(|mode| mode.omega2).collect()
    }

    /// The modes of [`ReducedScene::linear_omega2`].
    fn linear_modes(&self, state: &StaticState) -> Vec<ModalStiffness> {
        let count = match self.stuck_omega2().len() {
            0 => LISTED_MODES,
            stuck => stuck,
        };
        let mut modes = state.linear.modes_of_first_harmonic(self.model());
        modes.truncate(count);
        modes
    }

    /// Coefficients of a damping about a static state.
    ///
    /// # Errors
    /// Those of [`rayleigh`].
    pub fn rayleigh(
        &self,
        damping: &DampingSpec,
        state: &StaticState,
    ) -> Result<Rayleigh, DampingError> {
        rayleigh(damping, &self.linear_modes(state))
    }

    /// Ratio of the frequency of the last stuck mode to that of the highest harmonic of any
    /// solution. `None` where no mode was left out, or where it is not known.
    pub(super) fn modes_reach(&self, responses: &[&Response]) -> Option<f64> {
        let kept = self.bodies.as_ref()?;
        if kept.modes.truncation.amplitude == Some(0.0) || self.problem.laws.is_empty() {
            return None;
        }
        let last_hz = hertz(*self.stuck_omega2().last()?);
        let orbits = responses.iter().flat_map(|r| &r.orbits);
        let solved = orbits.filter(|o| o.outcome.is_converged());
        let highest_hz = solved.map(|o| o.harmonics as f64 * o.frequency_hz);
        let highest_hz = highest_hz.reduce(f64::max).filter(|hz| *hz > 0.0)?;
        Some(last_hz / highest_hz)
    }

    /// Observed displacements and strains.
    pub fn observations(&self) -> Vec<Observed> {
        let points = self.model().observations.iter();
        let observed = points.map(|point| Observed {
            name: point.name.clone(),
            quantity: point.quantity,
        });
        observed.collect()
    }

    /// Number of the observed displacement of this name, or of the first one.
    ///
    /// # Errors
    /// [`Error::NoObservation`].
    pub fn observed(&self, name: Option<&str>) -> Result<usize, Error> {
        let observations = self.observations();
        let fits = |o: &Observed| {
            o.quantity == ObservedQuantity::Displacement && name.is_none_or(|name| o.name == name)
        };
        observations.iter().position(fits).ok_or_else(|| {
            let displacements = observations
                .iter()
                .filter(|o| o.quantity == ObservedQuantity::Displacement);
            Error::NoObservation {
                name: name.map(str::to_owned),
                names: displacements.map(|o| o.name.clone()).collect(),
            }
        })
    }

    /// Natural frequencies. `held_omega2` are squared angular frequencies of each body with its
    /// contacts held, if they are known. With a static state the modes of the linear reference
    /// about it are included.
    pub fn natural_frequencies(
        &self,
        state: Option<&StaticState>,
        held_omega2: &[Vec<f64>],
    ) -> Vec<NaturalFrequency> {
        let mut frequencies = Vec::new();
        let mut add = |kind: ModeKind, body: Option<&str>, omega2: &[f64]| {
            frequencies.extend(omega2.iter().enumerate().map(|(i, w2)| NaturalFrequency {
                kind,
                body: body.map(str::to_owned),
                mode: i + 1,
                frequency_hz: hertz(*w2),
                modal_mass_kg: None,
            }));
        };
        if let Some(bodies) = &self.bodies {
            let names = || bodies.model().bodies.iter().map(|b| Some(b.name.as_str()));
            for (body, omega2) in names().zip(held_omega2) {
                add(ModeKind::FlanksHeld, body, omega2);
            }
            for (body, omega2) in names().zip(&bodies.modes.fixed_interface_omega2) {
                add(ModeKind::FixedInterface, body, omega2);
            }
        }
        add(ModeKind::Stuck, None, &self.stuck_omega2());
        if let Some(state) = state {
            add(ModeKind::Linear, None, &self.linear_omega2(state));
        }
        frequencies
    }
}

/// Number of harmonics that the modes are chosen for where it is adapted.
const USUALLY_ADAPTED: usize = 7;

/// Highest harmonic that is excited.
pub(super) fn highest_harmonic(scene: &Scene) -> usize {
    let excitations = scene.assembly().map_or(&[][..], |a| &a.excitations);
    excitations.iter().map(|e| e.harmonic).max().unwrap_or(1)
}

/// Stuck modes that the response of a scene requires.
pub(super) fn stuck_modes(scene: &Scene) -> StuckModes {
    let harmonic = highest_harmonic(scene) as f64;
    let highest = match scene.response.range {
        FrequencyRange::Hz { to_hz, .. } => Highest::RadS(std::f64::consts::TAU * to_hz),
        FrequencyRange::OfFirstLinearMode { to, .. } => Highest::OfFirstStuckMode(to),
    };
    let count = scene.response.stuck_modes;
    let kept = match (count, scene.response.resolution) {
        // Harmonics then require nothing, and scenes that differ in them share a reduction.
        (Some(_), _) => 0,
        (None, Resolution::Fixed { harmonics, .. }) => harmonics,
        (None, Resolution::Accuracy(_)) => USUALLY_ADAPTED,
    };
    StuckModes {
        count,
        excited: highest.times(harmonic).rounded_up(),
        kept: highest.times(harmonic.max(kept as f64)).rounded_up(),
    }
}
