//! Inputs of the motions that a run keeps one by one. Another run of the same inputs does not solve
//! for them again.
//!
//! A key is a hash of the serialised inputs. A new field of any of these types is therefore an input,
//! unless it is left out by name.

use serde::{Serialize, Serializer};

use crate::damping::Rayleigh;
use crate::description::Scene;
use crate::dlft::branch::{Guess, ValueRange};
use crate::dlft::sweep::SweepSettings;
use crate::dlft::{SolvedFrequency, StaticState};
use crate::model::Model;
use crate::problem::Problem;

/// Inputs of motions of one kind.
#[derive(Debug, Clone, Copy, Serialize)]
pub enum RecordInputs<'a> {
    /// Frequencies of a response.
    Response(ResponseInputs<'a>),
    /// Frequencies of a response along an engine order.
    RunUp {
        /// Model at the speed of the scene.
        model: &'a Model,
        /// Scene, whose damping, static state and response count in addition to the model.
        #[serde(serialize_with = "besides_the_model")]
        scene: &'a Scene,
    },
    /// One motion that is looked for: a peak, or a vibration that wears the contacts.
    Peak {
        /// Model, static state and settings.
        response: ResponseInputs<'a>,
        /// Motion near which the peak is looked for first; `None`: the whole curve is followed.
        near: Option<&'a Guess>,
        /// Number of the observed displacement.
        observation: usize,
    },
    /// Points of a curve over a value.
    Curve {
        /// Model, static state and settings at the first value.
        response: ResponseInputs<'a>,
        /// Problem at the last value.
        last: &'a Problem,
        /// Key of the scene whose values they are.
        key: &'a str,
        /// Values and frequency.
        range: &'a ValueRange,
    },
}

/// Inputs of a response.
#[derive(Debug, Clone, Copy, Serialize)]
#[non_exhaustive]
pub struct ResponseInputs<'a> {
    /// Reduced model, laws and excitations.
    pub problem: &'a Problem,
    /// Damping of the bodies.
    pub damping: Rayleigh,
    /// Static state that the motion is about.
    pub state: &'a StaticState,
    /// Frequencies, harmonics and solver.
    pub settings: &'a SweepSettings,
    /// Number of frequencies of the grid; `None` where the curve is followed.
    pub points: Option<usize>,
}

/// Key of motions that are kept: the hash of their inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordKey {
    /// Frequencies of a response.
    Response([u8; 32]),
    /// Motions of a search for peaks or along a curve.
    Search([u8; 32]),
}

impl RecordInputs<'_> {
    /// Key of the motions of these inputs, which have this hash.
    pub fn key(&self, hash: [u8; 32]) -> RecordKey {
        match self {
            Self::Response(_) | Self::RunUp { .. } => RecordKey::Response(hash),
            Self::Peak { .. } | Self::Curve { .. } => RecordKey::Search(hash),
        }
    }
}

/// Motions that an earlier run solved for before it was interrupted.
#[derive(Debug, Default)]
pub struct Recorded {
    /// Key under which further ones are kept; `None` where nothing is kept.
    pub key: Option<RecordKey>,
    /// The motions, in the order in which they were kept.
    pub earlier: Vec<SolvedFrequency>,
}

/// Writes the fields of a scene that a response along an engine order depends on. Its model has the
/// subject of the scene.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields so")]
fn besides_the_model<S: Serializer>(scene: &&Scene, serializer: S) -> Result<S::Ok, S::Error> {
    let Scene {
        name: _,
        subject: _,
        damping,
        modal_ratios,
        static_state,
        response,
        engine_orders: _,
        mission: _,
    } = scene;
    (damping, modal_ratios, static_state, response).serialize(serializer)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Arc;

    use faer::Mat;

    use super::*;
    use crate::contact::PairLaw;
    use crate::contact::penalty::PairStiffness;
    use crate::damping::DampingSpec;
    use crate::description::{FrequencyRange, MissionPart, ReducedModelSpec, ResponseSpec};
    use crate::dlft::pair_signals::Periods;
    use crate::dlft::settings::{EpsChoice, Resolution, Solver};
    use crate::dlft::{Orbit, Outcome, PairStatus};
    use crate::excitation::Growth;
    use crate::problem::LinearReference;
    use crate::reduced::{
        DiscExcitation, Influence, InfluenceCoefficient, ReducedModel, StaticPart, SteadyCause,
        Waves,
    };

    /// Everything that motions depend on, owned.
    #[derive(Clone)]
    struct Owned {
        problem: Problem,
        damping: Rayleigh,
        state: StaticState,
        settings: SweepSettings,
        points: Option<usize>,
        near: Option<Orbit>,
        observation: usize,
        last: Problem,
        key: &'static str,
        range: ValueRange,
        model: Model,
        scene: Scene,
    }

    fn problem() -> Problem {
        let (stiffness, mass) = (Mat::identity(3, 3), Mat::identity(3, 3));
        let reduced = ReducedModel::new(stiffness, mass, Mat::zeros(3, 1), vec![4.0]);
        let mut problem = Problem {
            reduced: Arc::new(reduced),
            laws: vec![PairLaw::rigid(0.3, 0.0)],
            excitations: Vec::new(),
            modal_ratios: Vec::new(),
        };
        let load = problem.reduced.static_load.clone();
        let excitation = crate::problem::HarmonicLoad::cosine(1, load);
        problem.excitations.push(excitation);
        problem
    }

    fn owned() -> Owned {
        let problem = problem();
        let (from_hz, to_hz) = (1.0, 2.0);
        let range = FrequencyRange::Hz { from_hz, to_hz };
        Owned {
            damping: Rayleigh::new(1e-3, 1e-4),
            state: StaticState {
                outcome: Outcome::Converged,
                x: vec![0.0; 3],
                lambda: vec![0.0; 3],
                status: vec![PairStatus::Stuck],
                newton_iterations: 1,
                residual: 0.0,
                retention_n: None,
                linear: LinearReference::stuck(&problem.reduced),
                on_path: Vec::new(),
                ended_at: None,
            },
            settings: SweepSettings::new(vec![from_hz, to_hz], Resolution::fixed(1, 16)),
            points: Some(2),
            near: Some(Orbit::motionless(1.0, Outcome::Converged)),
            observation: 0,
            last: problem.clone(),
            problem,
            key: "contact.friction",
            range: ValueRange {
                values: vec![0.1, 0.2],
                logarithmic: false,
                frequency_hz: 1.0,
            },
            model: Model {
                bodies: Vec::new(),
                rotation: None,
                cyclic: None,
                pairs: Vec::new(),
                bonded: Vec::new(),
                flank_facets: Vec::new(),
                contact_names: Vec::new(),
                excitations: Vec::new(),
                maps: Vec::new(),
                friction_maps: Vec::new(),
                observations: Vec::new(),
                dashpots: Vec::new(),
                matches: Vec::new(),
                straightened: Vec::new(),
            },
            scene: Scene::new(
                "a",
                ReducedModelSpec {
                    folder: "model".into(),
                    law: PairLaw::rigid(0.3, 0.0),
                    force_n: 1.0,
                },
                ResponseSpec::new(range, Resolution::fixed(1, 16)),
            )
            .damping(DampingSpec::ratio(0.001)),
        }
    }

    impl Owned {
        /// What is hashed of a response, a peak, a curve and a run-up.
        fn serialised(&self) -> [Vec<u8>; 4] {
            let response = ResponseInputs {
                problem: &self.problem,
                damping: self.damping,
                state: &self.state,
                settings: &self.settings,
                points: self.points,
            };
            let near = self.near.as_ref().map(Guess::from_peak);
            let all = [
                RecordInputs::Response(response),
                RecordInputs::Peak {
                    response,
                    near: near.as_ref(),
                    observation: self.observation,
                },
                RecordInputs::Curve {
                    response,
                    last: &self.last,
                    key: self.key,
                    range: &self.range,
                },
                RecordInputs::RunUp {
                    model: &self.model,
                    scene: &self.scene,
                },
            ];
            all.map(|inputs| postcard::to_stdvec(&inputs).unwrap())
        }
    }

    type Change = fn(&mut Owned);

    /// Checks that each change is one of the inputs of exactly these kinds, and like no other.
    #[track_caller]
    fn assert_changes(kinds: [bool; 4], changes: &[Change]) {
        let own = owned().serialised();
        assert_eq!(own, owned().serialised());
        let mut seen = Vec::new();
        for (number, change) in changes.iter().enumerate() {
            let mut changed = owned();
            change(&mut changed);
            let changed = changed.serialised();
            let differ: Vec<bool> = own.iter().zip(&changed).map(|(a, b)| a != b).collect();
            assert_eq!(differ, kinds, "change {number}");
            assert!(!seen.contains(&changed), "change {number}");
            seen.push(changed);
        }
    }

    fn reduced(owned: &mut Owned) -> &mut ReducedModel {
        Arc::make_mut(&mut owned.problem.reduced)
    }

    #[test]
    fn every_field_of_a_response_counts() {
        let changes: &[Change] = &[
            |o| reduced(o).stiffness[(0, 0)] = 2.0,
            |o| reduced(o).mass[(0, 0)] = 2.0,
            |o| reduced(o).coupling[(0, 0)] = 2.0,
            |o| reduced(o).omega2[0] = 5.0,
            |o| reduced(o).bodies_omega2.push(4.0),
            |o| reduced(o).stuck_modes = 0,
            |o| reduced(o).static_load.on_x[0] = 1.0,
            |o| reduced(o).static_load.on_modes[0] = 1.0,
            |o| {
                reduced(o).static_parts.push(StaticPart {
                    cause: SteadyCause::Matrices,
                    working: 1.0,
                    on_x: vec![0.0; 3],
                });
            },
            |o| {
                let load = reduced(o).static_load.clone();
                reduced(o).unit_loads.push(load);
            },
            |o| reduced(o).waves = waves(1.0),
            |o| reduced(o).waves = waves(2.0),
            |o| o.problem.laws[0].friction = 0.4,
            |o| o.problem.laws[0].gap_m = -1e-6,
            |o| o.problem.laws[0].wear_m2_n = 1e-15,
            |o| {
                let (normal_n_m, tangential_n_m) = (1.0, 1.0);
                o.problem.laws[0].stiffness = Some(PairStiffness {
                    normal_n_m,
                    tangential_n_m,
                });
            },
            |o| o.problem.excitations[0].harmonic = 2,
            |o| o.problem.excitations[0].cosine.on_x[1] = 1.0,
            |o| o.problem.excitations[0].sine.on_modes[0] = 1.0,
            |o| o.problem.excitations[0].growth = Growth::Squared,
            |o| o.problem.modal_ratios.push(0.01),
            |o| o.damping.stiffness_s = 0.0,
            |o| o.damping.mass_per_s = 0.0,
            // The least change of a number.
            |o| o.state.x[0] = f64::from_bits(1),
            |o| o.state.lambda[0] = -0.0,
            |o| o.state.status[0] = PairStatus::Open,
            |o| o.state.retention_n = Some(0.0),
            |o| o.settings.frequencies_hz[1] = 3.0,
            |o| o.settings.resolution = Resolution::fixed(1, 32),
            |o| o.settings.resolution = Resolution::Accuracy(1e-3),
            |o| o.settings.eps.choice = EpsChoice::Pair,
            |o| o.settings.eps.scale = 2.0,
            |o| o.settings.newton.tolerance = 1e-9,
            |o| o.settings.newton.max_iterations = 7,
            |o| o.settings.periods = Periods::Exactly(2),
            |o| o.settings.solver = Solver::Powell,
            |o| o.settings.slip_threshold_m = Some(1e-9),
            |o| o.settings.most_seconds = Some(1.0),
            |o| o.settings.estimates = false,
            |o| o.points = None,
        ];
        assert_changes([true, true, true, false], changes);
        let nothing: &[Change] = &[|o| {
            (o.state.newton_iterations, o.state.residual) = (7, 1e-12);
            o.state.on_path.push(vec![0.0; 3]);
        }];
        assert_changes([false; 4], nothing);
    }

    /// A disc whose blades the air acts on by so much, N/m.
    fn waves(real_n_m: f64) -> Waves {
        let excitation = DiscExcitation {
            sectors: 4,
            engine_order: 1,
        };
        let coefficient = InfluenceCoefficient {
            nodal_diameter: 1,
            mode: 1,
            by_mode: 1,
            real_n_m,
            imaginary_n_m: 0.0,
        };
        let influence = Influence::new(4, &[1], &[coefficient]);
        Waves::new(excitation, BTreeMap::new()).with_influence(influence)
    }

    #[test]
    fn every_field_of_a_peak_and_of_a_curve_counts() {
        let of_peak: &[Change] = &[
            |o| o.near = None,
            |o| o.near = Some(Orbit::motionless(1.5, Outcome::Converged)),
            |o| o.near.as_mut().unwrap().x.push(1e-6),
            |o| o.observation = 1,
        ];
        assert_changes([false, true, false, false], of_peak);
        let of_curve: &[Change] = &[
            |o| o.last.laws[0].friction = 0.2,
            |o| o.last.modal_ratios.push(0.1),
            |o| o.key = "contact.gap_m",
            |o| o.range.values[0] = 0.15,
            |o| o.range.logarithmic = true,
            |o| o.range.frequency_hz = 1.5,
        ];
        assert_changes([false, false, true, false], of_curve);
    }

    #[test]
    fn a_run_up_depends_on_its_model_and_on_a_part_of_the_scene() {
        let changes: &[Change] = &[
            |o| o.model.contact_names.push("root".to_owned()),
            |o| {
                o.scene.damping = DampingSpec::Rayleigh {
                    stiffness_s: 0.0,
                    mass_per_s: 0.0,
                }
            },
            |o| o.scene.modal_ratios.push(0.01),
            |o| o.scene.static_state.load_steps = 1,
            |o| o.scene.static_state.starting_tractions = 1,
            |o| o.scene.response.tolerance = 1e-5,
            |o| o.scene.response.points = Some(3),
        ];
        assert_changes([false, false, false, true], changes);
        let nothing: &[Change] = &[|o| {
            o.scene.name = "b".to_owned();
            o.scene.mission.push(MissionPart::whole_mission(None));
        }];
        assert_changes([false; 4], nothing);
    }
}
