//! Does what the commands have in common once a scene is reduced, whether it began with a mesh or
//! with a folder.

use super::error::RunError;
use super::meshed::Meshed;
use super::progress::Progress;
use super::{Context, hertz};
use crate::export::manifest::TruncationSummary;
use crate::stage::Stage;
use crate::warning::Weight;
use crate::words::percent;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::{FrequencyRange, ReducedModelSpec, Scene, Subject};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::{Response, StaticState};
use dovetail_solver::problem::Problem;
use dovetail_solver::reduction::superelement;
use dovetail_solver::reduction::{Highest, LISTED_MODES, ReducedModel, StuckModes};
use dovetail_solver::results::pairs::PairTable;

/// Above this a prestress of held flanks is warned of.
const LARGE_HELD_FLANKS_ERROR: f64 = 0.01;

/// The reduced model of a scene, and what tables say of its pairs.
#[derive(Debug)]
pub struct Reduced {
    pub pairs: PairTable,
    origin: Origin,
}

#[derive(Debug)]
enum Origin {
    Mesh(Box<Meshed>),
    Folder(Box<Problem>),
}

impl Reduced {
    /// Meshes, binds, assembles and reduces, or reads the folder.
    pub(super) fn of(
        scene: &Scene,
        context: &Context,
        progress: &Progress,
    ) -> Result<Self, RunError> {
        let reduced = match &scene.subject {
            Subject::Assembly(assembly) => {
                let meshed = Meshed::of(assembly, stuck_modes(scene), scene, context, progress)?;
                Self {
                    pairs: PairTable::of_model(&meshed.model),
                    origin: Origin::Mesh(Box::new(meshed)),
                }
            }
            Subject::ReducedModel(spec) => {
                let _stage = progress.stage(Stage::ReducedModel);
                let element = superelement::read(&spec.folder)?;
                let pairs = PairTable::of_superelement(&element, spec.law.gap_m);
                progress.note(&format!("{} contact pairs", pairs.rows.len()));
                let reduced = match scene.response.stuck_modes {
                    Some(modes) => element.model.with_modes(modes),
                    None => element.model,
                };
                let problem = Problem::of_one_law(reduced, spec.law, spec.force_n);
                Self {
                    pairs,
                    origin: Origin::Folder(Box::new(problem)),
                }
            }
        };
        reduced.warn_of_much_friction(progress);
        if let Some(omega2) = reduced.model().stuck_omega2().first() {
            progress.note(&format!("first stuck mode {:.4} Hz", hertz(*omega2)));
        }
        if let Some(truncation) = reduced.truncation() {
            progress.note(&truncation_note(
                reduced.model().stuck_omega2().len(),
                &truncation,
            ));
        }
        reduced.warn_of_held_flanks(progress);
        Ok(reduced)
    }

    fn warn_of_much_friction(&self, progress: &Progress) {
        let pairs = self.problem().laws.iter();
        let largest = pairs.map(|pair| pair.friction).fold(0.0, f64::max);
        if largest > PairLaw::MOST_FRICTION {
            progress.warning(Weight::Remark, format!(
                "a coefficient of friction of {largest:e} is computed as {:e}: pairs stick as long as they are pressed",
                PairLaw::MOST_FRICTION
            ));
        }
    }

    fn warn_of_held_flanks(&self, progress: &Progress) {
        let Some(error) = self
            .held_flanks_error()
            .filter(|e| *e > LARGE_HELD_FLANKS_ERROR)
        else {
            return;
        };
        progress.warning(Weight::Doubt, format!(
            "the prestress of held flanks is not that of the assembly: its first frequencies change by an estimated {} with the stress \
             that the contacts hand on (held_flanks_error of summary.json); take prestress = \"contact\" of [rotation], the default",
            percent(error, 2)
        ));
    }

    /// Where the prestress is that of the held flanks.
    pub(super) fn held_flanks_error(&self) -> Option<f64> {
        self.meshed()?.modes.held_flanks_error
    }

    /// What is to be solved.
    pub fn problem(&self) -> &Problem {
        match &self.origin {
            Origin::Mesh(meshed) => &meshed.problem,
            Origin::Folder(problem) => problem,
        }
    }

    /// Its matrices.
    pub fn model(&self) -> &ReducedModel {
        &self.problem().reduced
    }

    /// Squared angular frequencies of the linear reference about a static state: as many modes as [`ReducedModel::stuck_omega2`],
    /// and a few where all that moves are open pairs.
    pub(super) fn linear_omega2<'a>(&self, state: &'a StaticState) -> &'a [f64] {
        let count = match self.model().stuck_omega2().len() {
            0 => LISTED_MODES,
            stuck => stuck,
        };
        &state.linear.omega2[..count.min(state.linear.with_mass)]
    }

    /// What the modes left out may cost, where the reduction was made here.
    pub(super) fn truncation(&self) -> Option<TruncationSummary> {
        let truncation = &self.meshed()?.modes.truncation;
        Some(TruncationSummary {
            amplitude: truncation.amplitude,
            frequencies: truncation.frequencies.clone(),
            modes_reach: None,
        })
    }

    /// Frequency of the last stuck mode over that of the highest harmonic of any solution. `None` where no mode was left
    /// out, or where it is not known.
    pub(super) fn modes_reach(&self, responses: &[&Response]) -> Option<f64> {
        let kept = self.meshed()?;
        if kept.modes.truncation.amplitude == Some(0.0) || self.problem().laws.is_empty() {
            return None;
        }
        let last_hz = hertz(*self.model().stuck_omega2().last()?);
        let orbits = responses.iter().flat_map(|r| &r.orbits);
        let solved = orbits.filter(|o| o.outcome.is_converged());
        let highest_hz = solved.map(|o| o.harmonics as f64 * o.frequency_hz);
        let highest_hz = highest_hz.reduce(f64::max).filter(|hz| *hz > 0.0)?;
        Some(last_hz / highest_hz)
    }

    /// The bodies, where there is a mesh.
    pub(super) fn meshed(&self) -> Option<&Meshed> {
        match &self.origin {
            Origin::Mesh(meshed) => Some(meshed),
            Origin::Folder(_) => None,
        }
    }

    /// Names of the observed displacements.
    pub fn observations(&self) -> Vec<&str> {
        let probes = self.model().observations.iter();
        probes.map(|probe| probe.name.as_str()).collect()
    }
}

/// The stuck modes that a response asks for.
pub(super) fn stuck_modes(scene: &Scene) -> StuckModes {
    let excitations = scene.assembly().map_or(&[][..], |a| &a.excitations);
    let harmonic = excitations.iter().map(|e| e.harmonic).max().unwrap_or(1) as f64;
    let highest = match scene.response.range {
        FrequencyRange::Hz { to_hz, .. } => Highest::RadS(std::f64::consts::TAU * to_hz),
        FrequencyRange::OfFirstLinearMode { to, .. } => Highest::OfFirstStuckMode(to),
    };
    let count = scene.response.stuck_modes;
    let kept = match (count, scene.response.resolution) {
        // Harmonics then ask for nothing, and scenes that differ in them share a reduction.
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

/// Where the number of harmonics is adapted, the modes are chosen as for so many.
const USUALLY_ADAPTED: usize = 7;

fn truncation_note(modes: usize, truncation: &TruncationSummary) -> String {
    let amplitude = match truncation.amplitude {
        Some(error) => format!("amplitudes of the linear curve err by about {error:.0e}"),
        None => "they do not reach the highest frequency of the linear curve".to_string(),
    };
    let worst = truncation.frequencies.iter().copied().fold(0.0, f64::max);
    let frequencies = match truncation.frequencies.len() {
        0 => String::new(),
        n => format!(
            "; fixed_interface_modes raise the first {n} stuck frequencies by up to {:.2} %",
            100.0 * worst
        ),
    };
    format!("{modes} stuck modes: {amplitude}{frequencies}")
}

/// That the folder can be read.
pub(super) fn check(spec: &ReducedModelSpec) -> Result<(), RunError> {
    superelement::read(&spec.folder)?;
    Ok(())
}
