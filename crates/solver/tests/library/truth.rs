//! Small random models beside periodic motions of an integration in time from event to event, which
//! shares nothing with the library: `tests/data/truth/models.json`, which
//! `benches/truth/run.py --write-suite` writes. Each model is solved to an accuracy and has to be
//! as near the truth as three of its estimates say.

use std::collections::BTreeMap;

use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::prelude::*;
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use dovetail_solver::structure::{BodyMatrices, InterfaceNode, Joint, ObservedWork, Structure};
use dovetail_testkit::folder::root;
use nalgebra_sparse::{CooMatrix, CscMatrix};
use rayon::prelude::*;
use serde::Deserialize;

const ACCURACY: f64 = 0.01;
/// Smallest error that counts as estimated, relative to the accuracy: the tolerance of the balance.
const LEAST_ESTIMATE: f64 = 1e-4;
/// A friction power below this share of all powers is not compared.
const LITTLE: f64 = 1e-3;

#[derive(Deserialize)]
struct Model {
    seed: u64,
    kind: String,
    does: String,
    /// Lower triangle, row by row, N/m.
    #[serde(rename = "K")]
    stiffness: Vec<f64>,
    /// Diagonal, kg.
    #[serde(rename = "M")]
    mass: Vec<f64>,
    damping: Damping,
    pairs: Vec<Pair>,
    static_load: Vec<f64>,
    excitation: BTreeMap<usize, Amplitude>,
    observe: Vec<Vec<f64>>,
    frequency_hz: Vec<f64>,
    truth: Truth,
    truth_error: Errors,
}

#[derive(Deserialize)]
struct Damping {
    stiffness_s: f64,
    mass_per_s: f64,
}

#[derive(Deserialize)]
struct Pair {
    unknowns: [usize; 3],
    against: Option<[usize; 3]>,
    frame: Option<[[f64; 3]; 3]>,
    friction: f64,
    gap_m: f64,
    preload_n: f64,
    normal_stiffness_n_m: Option<f64>,
    tangential_stiffness_n_m: Option<f64>,
}

#[derive(Deserialize)]
struct Amplitude {
    re: Vec<f64>,
    im: Vec<f64>,
}

#[derive(Deserialize)]
struct Truth {
    amplitude_m: Vec<f64>,
    friction_power_w: Vec<f64>,
    damping_w: f64,
    most_n: Vec<f64>,
    largest_multiplier: f64,
}

#[derive(Deserialize)]
struct Errors {
    amplitude_m: Vec<f64>,
    friction_power_w: Vec<f64>,
    most_n: Vec<f64>,
}

impl Pair {
    fn law(&self) -> PairLaw {
        let springs = self.normal_stiffness_n_m.zip(self.tangential_stiffness_n_m);
        PairLaw {
            stiffness: springs.map(|(normal, tangential)| PairStiffness::new(normal, tangential)),
            ..PairLaw::rigid(self.friction, self.gap_m)
        }
    }

    fn frame(&self) -> [[f64; 3]; 3] {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        self.frame.unwrap_or(identity)
    }
}

impl Model {
    /// Place of each point among the nodes of the body: those of pairs come last.
    fn places(&self) -> (Vec<usize>, usize) {
        let points = self.mass.len() / 3;
        let firsts = |pair: &Pair| [Some(pair.unknowns[0]), pair.against.map(|dofs| dofs[0])];
        let touching = self.pairs.iter().flat_map(firsts).flatten();
        let touching: Vec<usize> = touching.map(|dof| dof / 3).collect();
        let is_interior = |point: &usize| !touching.contains(point);
        let (interior, others): (Vec<usize>, Vec<usize>) = (0..points).partition(is_interior);
        let mut places = vec![0; points];
        let order = interior.iter().chain(&others);
        order
            .enumerate()
            .for_each(|(place, point)| places[*point] = place);
        (places, interior.len())
    }

    fn structure(&self) -> Structure {
        let (places, interior_nodes) = self.places();
        let size = self.mass.len();
        let at = |dof: usize| 3 * places[dof / 3] + dof % 3;
        let placed = |vector: &[f64]| {
            let mut placed = vec![0.0; size];
            vector
                .iter()
                .enumerate()
                .for_each(|(dof, v)| placed[at(dof)] = *v);
            placed
        };
        let (mut stiffness, mut mass) = (CooMatrix::new(size, size), CooMatrix::new(size, size));
        let mut entries = self.stiffness.iter();
        for i in 0..size {
            mass.push(at(i), at(i), self.mass[i]);
            for j in 0..=i {
                let v = *entries.next().unwrap();
                stiffness.push(at(i), at(j), v);
                if i != j {
                    stiffness.push(at(j), at(i), v);
                }
            }
        }
        let mut load = self.static_load.clone();
        let mut joints = Vec::new();
        for pair in &self.pairs {
            let frame = pair.frame();
            for axis in 0..3 {
                load[pair.unknowns[axis]] -= pair.preload_n * frame[0][axis];
                if let Some(against) = pair.against {
                    load[against[axis]] += pair.preload_n * frame[0][axis];
                }
            }
            let node = |dofs: [usize; 3]| InterfaceNode {
                body: 0,
                node: places[dofs[0] / 3],
            };
            let turned = [0, 1, 2].map(|row| [0, 1, 2].map(|column| frame[column][row]));
            joints.push(Joint {
                slave: node(pair.unknowns),
                masters: pair
                    .against
                    .map(|dofs| (node(dofs), 1.0))
                    .into_iter()
                    .collect(),
                turned: Some(turned),
                across: None,
            });
        }
        Structure {
            bodies: vec![BodyMatrices {
                name: "points".into(),
                stiffness: CscMatrix::from(&stiffness),
                mass: CscMatrix::from(&mass),
                load_n: placed(&load),
                centrifugal_n_s2: Vec::new(),
                interior_nodes,
                held_dofs: Vec::new(),
                fixed_interface_modes: None,
                node_tags: (0..size as u64 / 3).collect(),
            }],
            joints,
            steady_parts: Vec::new(),
            excitations: self.parts().map(|(_, part)| vec![placed(&part)]).collect(),
            observations: self
                .observe
                .iter()
                .map(|weights| ObservedWork {
                    name: "point".into(),
                    quantity: ObservedQuantity::Displacement,
                    load: vec![placed(weights)],
                })
                .collect(),
            dashpots: Vec::new(),
            influenced: Vec::new(),
        }
    }

    /// Parts of the excitation that are not zero: cosine and sine of each harmonic.
    fn parts(&self) -> impl Iterator<Item = ((usize, bool), Vec<f64>)> {
        let parts = self.excitation.iter().flat_map(|(harmonic, amplitude)| {
            let sine = amplitude.im.iter().map(|v| -v).collect();
            [
                ((*harmonic, true), amplitude.re.clone()),
                ((*harmonic, false), sine),
            ]
        });
        parts.filter(|(_, part)| part.iter().any(|v| *v != 0.0))
    }

    fn problem(&self) -> Problem {
        let wanted = StuckModes::new(Some(self.mass.len()), Highest::OfFirstStuckMode(2.0));
        let mut reduced = reduce(self.structure(), wanted).unwrap().model;
        let units = std::mem::take(&mut reduced.unit_loads);
        let zero = || Load::zeros(reduced.static_load.on_x.len(), reduced.omega2.len());
        let mut excitations: BTreeMap<usize, HarmonicLoad> = BTreeMap::new();
        for (((harmonic, is_cosine), _), unit) in self.parts().zip(units) {
            let load = excitations.entry(harmonic).or_insert_with(|| HarmonicLoad {
                sine: zero(),
                ..HarmonicLoad::cosine(harmonic, zero())
            });
            *(if is_cosine {
                &mut load.cosine
            } else {
                &mut load.sine
            }) = unit;
        }
        Problem {
            excitations: excitations.into_values().collect(),
            laws: self.pairs.iter().map(Pair::law).collect(),
            reduced: reduced.into(),
            modal_ratios: Vec::new(),
        }
    }

    /// What is further from the truth than it should be.
    fn misses(&self) -> Vec<String> {
        let (
            problem,
            Damping {
                stiffness_s,
                mass_per_s,
            },
        ) = (self.problem(), &self.damping);
        let solved = ForcedResponse::new(&problem)
            .damping(DampingSpec::Rayleigh {
                stiffness_s: *stiffness_s,
                mass_per_s: *mass_per_s,
            })
            .resolution(Resolution::Accuracy(ACCURACY))
            .frequencies_hz(&self.frequency_hz[..])
            .solve();
        let name = format!("seed {}, {} {}", self.seed, self.kind, self.does);
        let orbit = match &solved {
            Ok(solved) => &solved.response.orbits[0],
            Err(error) => return vec![format!("{name}: {error}")],
        };
        if !orbit.outcome.is_converged() {
            return vec![format!("{name}: {}", orbit.outcome)];
        }
        let mut misses = Vec::new();
        let mut compare =
            |what: &str, found: &[f64], truth: &[f64], error: &[f64], estimate: f64| {
                let largest =
                    |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
                let off: Vec<f64> = found.iter().zip(truth).map(|(a, b)| a - b).collect();
                // Where no pair touches there is no force.
                let scale = largest(truth).max(f64::MIN_POSITIVE);
                let (off, error) = (largest(&off) / scale, largest(error) / scale);
                let is_near = off <= 3.0 * estimate + error;
                if !is_near {
                    let estimate = format!("estimated {estimate:.2e}, the truth {error:.1e}");
                    misses.push(format!("{name}: {what} off by {off:.3e}, {estimate}"));
                }
            };
        let (truth, error) = (&self.truth, &self.truth_error);
        let estimate = orbit
            .amplitude_error(0)
            .unwrap_or(ACCURACY)
            .max(LEAST_ESTIMATE * ACCURACY);
        compare(
            "amplitude",
            &orbit.observed_amplitude,
            &truth.amplitude_m,
            &error.amplitude_m,
            estimate,
        );
        let figures = orbit
            .figure_errors
            .as_ref()
            .expect("the errors are estimated");
        let relative = |error: f64, of: f64| (error / of).max(LEAST_ESTIMATE * ACCURACY);
        if truth.friction_power_w[0] > LITTLE * (truth.damping_w + truth.friction_power_w[0]) {
            compare(
                "friction power",
                &[orbit.friction_power_w],
                &truth.friction_power_w,
                &error.friction_power_w,
                relative(figures.friction_power_w, truth.friction_power_w[0]),
            );
        }
        // The force of a rigid pair that lands has no finite maximum.
        let of_forces: Option<Vec<f64>> =
            figures.pairs.iter().map(|p| p.compression_max_n).collect();
        if let Some(errors) = of_forces {
            let largest: Vec<f64> = orbit.cycles.iter().map(|c| c.compression_max_n).collect();
            let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
            let estimate = relative(most(&errors), most(&truth.most_n).max(f64::MIN_POSITIVE));
            compare("force", &largest, &truth.most_n, &error.most_n, estimate);
        }
        misses
    }
}

fn models() -> Vec<Model> {
    let text = std::fs::read_to_string(root().join("tests/data/truth/models.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn small_models_are_as_near_the_truth_as_their_estimates_say() {
    let models = models();
    let misses: Vec<String> = models.par_iter().flat_map(Model::misses).collect();
    assert!(misses.is_empty(), "{}", misses.join("\n"));
}

#[test]
fn the_models_are_of_all_kinds() {
    let models = models();
    assert_eq!(models.len(), 30);
    let count = |is: &dyn Fn(&Model) -> bool| models.iter().filter(|m| is(m)).count();
    for (kind, does) in [
        ("elastic", "opens"),
        ("elastic", "slips"),
        ("elastic", "sticks"),
        ("rigid", "slips"),
        ("rigid", "apart"),
    ] {
        assert!(
            count(&|m| m.kind == kind && m.does == does) > 1,
            "{kind} {does}"
        );
    }
    let any = |is: &dyn Fn(&Pair) -> bool| count(&|m| m.pairs.iter().any(is));
    assert!(any(&|p| p.gap_m > 0.0) > 1, "gaps");
    assert!(any(&|p| p.gap_m < 0.0) > 1, "interference");
    assert!(any(&|p| p.preload_n > 0.0) > 1, "preload");
    assert!(any(&|p| p.against.is_some()) > 1, "between points");
    assert!(any(&|p| p.frame.is_some()) > 1, "turned frames");
    assert!(count(&|m| m.excitation.len() > 1) > 1, "several harmonics");
    assert!(count(&|m| m.pairs.len() > 1) > 4, "several pairs");
    assert!(
        count(&|m| m.truth.largest_multiplier < 1.0) > 20,
        "stable motions"
    );
}
