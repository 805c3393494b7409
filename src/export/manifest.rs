//! Writes summary.json: what was run, on what, how long it took, and the figures that a reader asks
//! for first.
//!
//! A number that does not exist (no converged point, no excitation) or is not finite is `null`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::unrolled::Orientation;
use super::{ExportError, write_file};
use crate::warning::{Warning, Weight};
use dovetail_solver::dlft::{
    CycleCounts, Orbit, Outcome, Response, SecondMotion, StaticCounts, StaticState,
};
use dovetail_solver::fem::mass_properties::MassProperties;
use dovetail_solver::integration::compare::{Comparison, Figures};
use dovetail_solver::model::{BodyNode, FieldMap, FlankMatch, Model, StraightenedEdges};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{
    LocalPeak, cycle_fields, energy_balance_error, friction_power_w, largest_estimated_error,
    largest_of_pairs, linear_peak, local_peaks, peak, peak_is_at_an_end, peak_ratio, peak_rise,
    static_fields, sweep_fields, with_motion,
};
use dovetail_solver::run::{PrestressPass, Stage};

/// The whole of summary.json.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Of the program.
    pub version: String,
    /// That the program was built from; `None` where it is not known.
    #[serde(default)]
    pub commit: Option<String>,
    /// Hash of the program, its libraries and the processor, on which the last digits depend, in
    /// hexadecimals; `None` where the system does not tell.
    #[serde(default)]
    pub program_blake3: Option<String>,
    /// When the run began, in universal time: `2026-02-28T23:59:59Z`.
    #[serde(default)]
    pub begun: String,
    pub scene: SceneSummary,
    /// How far the run came.
    pub state: RunState,
    /// Why a run failed; else `None`.
    pub why: Option<String>,
    /// What stands in the folder of the run besides this file, by name: the files that the run
    /// wrote, and those of an earlier run until they are replaced; of a run under way also those
    /// that it is about to write.
    pub files: Vec<String>,
    /// Where the scene is about a mesh.
    pub mesh: Option<MeshSummary>,
    /// Where the scene is about a reduced model: its folder.
    pub reduced_model: Option<String>,
    /// Stuck modes kept; `None` where nothing was reduced yet.
    pub stuck_modes: Option<usize>,
    /// Estimated errors by the modes left out, where a mesh was reduced.
    pub truncation: Option<TruncationSummary>,
    pub pairs: usize,
    /// Where the prestress is that of the static state with contact.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prestress_passes: Vec<PrestressPass>,
    /// Where the prestress is that of the held flanks: the estimated relative change of the first stuck frequencies
    /// with the stress of the static state in its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_flanks_error: Option<f64>,
    /// First frequency of the fully stuck assembly.
    pub stuck_frequency_hz: Option<f64>,
    /// First frequency of the linear reference: pairs that are open in the static state are released. `None` where there
    /// is no static state yet.
    pub linear_frequency_hz: Option<f64>,
    /// First frequency of the first body with its flanks held; `None` where it was not asked for.
    pub blade_frequency_hz: Option<f64>,
    /// Wall clock of the whole run, s.
    pub seconds: f64,
    /// Of all its threads and of gmsh, s; `None` where the system does not tell.
    pub processor_seconds: Option<f64>,
    /// Pairs of nodes tied by bonded contacts; none of them is among `pairs`.
    pub bonded_pairs: usize,
    pub stages: Vec<StageSummary>,
    #[serde(rename = "static")]
    pub static_state: Option<StaticSummary>,
    pub response: Option<ResponseSummary>,
    /// What there is to mind, the weightiest first.
    #[serde(default)]
    pub warnings: Vec<WarningSummary>,
    /// Of `dovetail verify` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verification: Option<VerificationSummary>,
    pub observations: Vec<ObservationSummary>,
    /// Fields at points in space that were mapped to surfaces; none where no excitation has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excitation_fields: Vec<FieldMap>,
}

impl Summary {
    /// Whether it has figures of a run: those of `dovetail run` or `dovetail static`.
    pub fn is_of_run(&self) -> bool {
        self.static_state.is_some() || self.response.is_some()
    }

    /// This one, and what a command beside its run has found.
    pub fn with_findings_of(&self, beside: Self) -> Self {
        let own = self.clone();
        Self {
            blade_frequency_hz: beside.blade_frequency_hz.or(own.blade_frequency_hz),
            verification: beside.verification.or(own.verification),
            ..own
        }
    }
}

/// How far a run came. A run that was killed without a word leaves `running`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    #[default]
    Running,
    Finished,
    /// By Ctrl-C or SIGTERM.
    Interrupted,
    Failed,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneSummary {
    pub name: String,
    pub file: String,
    /// Hash of the scene as it was read, with all that was set on the command line, and of the
    /// files that it names, in hexadecimals.
    #[serde(default)]
    pub blake3: Option<String>,
}

impl SceneSummary {
    /// Whether both are the same scene with the same settings and files.
    pub fn is_of(&self, other: &Self) -> bool {
        self.name == other.name && self.blake3.is_some() && self.blake3 == other.blake3
    }
}

/// Something to mind about a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WarningSummary {
    pub weight: Weight,
    pub text: String,
}

impl WarningSummary {
    pub fn of(warning: &Warning) -> Self {
        Self {
            weight: warning.weight,
            text: warning.text.clone(),
        }
    }
}

/// What the modes that a reduction leaves out may cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TruncationSummary {
    /// Estimated relative error of the amplitudes of observed points on the linear curve; none where the stuck modes end
    /// below its highest frequency.
    pub amplitude: Option<f64>,
    /// Estimated relative errors of the first stuck frequencies by bodies with `fixed_interface_modes`.
    pub frequencies: Vec<f64>,
    /// Frequency of the last stuck mode over that of the highest harmonic of the response; `None` before there is one, and
    /// where no mode was left out.
    #[serde(default)]
    pub modes_reach: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshSummary {
    /// The .msh file or the .geo script.
    pub source: String,
    /// Hash of the bytes of the mesh, in hexadecimals; `None` where its file is gone.
    #[serde(default)]
    pub blake3: Option<String>,
    /// Version of gmsh that made the mesh; `None` for a ready mesh.
    pub gmsh: Option<String>,
    /// The committed mesh was used because gmsh is missing.
    pub fallback: bool,
    pub nodes: usize,
    pub elements: usize,
    /// Number of elements of each type, by its name: tet10, hex20.
    pub element_types: BTreeMap<String, usize>,
    pub free_dofs: usize,
    pub bodies: Vec<BodySummary>,
    /// Contacts between two flanks, bonded ones last.
    pub contacts: Vec<FlankMatch>,
    /// Contacts whose flanks have maps, as these show them.
    #[serde(default)]
    pub flanks: Vec<FlankView>,
    /// Bodies with flanks whose edges are not straight in the mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub straightened_edges: Vec<StraightenedEdges>,
}

/// A flank as the maps show it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlankView {
    /// Number of its contact, as in the VTK files, and its name.
    pub contact: usize,
    pub name: String,
    /// Numbers of the bodies of the first and of the second flank; `None` for rigid ground.
    pub bodies: [Option<usize>; 2],
    /// Unit vectors that lead to the right and up.
    pub right: [f64; 3],
    pub up: [f64; 3],
    /// Names of the sides left, right, below and above.
    pub edges: [String; 4],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodySummary {
    pub name: String,
    pub nodes: usize,
    pub elements: usize,
    pub free_dofs: usize,
    pub young_pa: f64,
    pub poisson: f64,
    pub density_kg_m3: f64,
    pub volume_m3: f64,
    pub mass_kg: f64,
    /// Of gravity.
    pub centre_m: [f64; 3],
    /// Of the whole body; `None` where it does not rotate.
    pub centrifugal_force_n: Option<[f64; 3]>,
}

/// Wall time and peak memory of one stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageSummary {
    /// For programs: it stays when a name changes.
    pub id: Stage,
    pub name: String,
    pub seconds: f64,
    /// Of all threads and of gmsh; `None` where the system does not tell.
    pub processor_seconds: Option<f64>,
    /// Peak of the process up to the end of the stage; `None` where the system does not tell.
    pub peak_memory_mib: Option<f64>,
    /// What it makes was kept from an earlier run.
    pub from_cache: bool,
    /// Unknowns of each system that it solves, the largest first.
    pub unknowns: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StaticSummary {
    pub outcome: Outcome,
    /// Counts and forces are `None` where the static state did not converge.
    #[serde(flatten)]
    pub counts: Option<StaticCounts>,
    pub largest_slip_m: Option<f64>,
    /// Over the pairs; `None` where the area of a pair is unknown.
    pub largest_pressure_pa: Option<f64>,
    pub contacts: Vec<ContactSummary>,
    /// Force that holds what friction does not hold, N; else `None`.
    pub retention_n: Option<f64>,
    pub newton_iterations: usize,
    pub residual: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactSummary {
    pub name: String,
    pub pairs: usize,
    /// `None` where the area of a pair is unknown.
    pub area_m2: Option<f64>,
    /// Sum of the pairs' compression, N.
    pub normal_force_n: Option<f64>,
    /// Length of the sum of the pairs' friction forces, as vectors, N; `None` where the directions of
    /// the pairs are unknown.
    pub friction_force_n: Option<f64>,
    /// Normal force over area, Pa.
    pub mean_pressure_pa: Option<f64>,
    /// What its pairs do; `None` where the static state did not converge.
    #[serde(flatten)]
    pub counts: Option<StaticCounts>,
}

impl ResponseSummary {
    /// What the pairs do at the peak; `None` where there is none.
    pub fn peak_counts(&self) -> Option<CycleCounts> {
        Some(CycleCounts {
            stuck: self.peak_stuck_pairs?,
            slipping: self.peak_slipping_pairs?,
            opening: self.peak_opening_pairs?,
            closing: self.peak_closing_pairs?,
            open: self.peak_open_pairs?,
        })
    }
}

/// What the pairs of a contact do in a period.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactCounts {
    pub name: String,
    #[serde(flatten)]
    pub counts: CycleCounts,
}

/// What the pairs of each contact do in the period of an orbit.
pub fn contact_counts(pairs: &PairTable, orbit: &Orbit) -> Vec<ContactCounts> {
    let contacts = pairs.contacts.iter().enumerate();
    let of_contact = |(c, name): (usize, &String)| {
        let own = pairs.rows.iter().zip(&orbit.cycles);
        let own = own.filter(|(row, _)| row.contact == c);
        ContactCounts {
            name: name.clone(),
            counts: own.map(|(_, cycle)| cycle.status).collect(),
        }
    };
    contacts.map(of_contact).collect()
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ResponseSummary {
    /// Frequencies that were asked for, and those added at peaks.
    pub points: usize,
    pub added_points: usize,
    pub converged_points: usize,
    /// Frequencies that have a motion and did not converge: its error is estimated above the accuracy asked for.
    pub accuracy_not_reached_points: usize,
    /// Largest estimated error of an observed amplitude for the harmonics left out, relative; `None` where nothing is left
    /// out or nothing converged.
    pub largest_estimated_error: Option<f64>,
    /// That at the peak.
    pub peak_estimated_error: Option<f64>,
    pub unconverged: Vec<UnconvergedPoint>,
    /// The first observation; `None` where there is none.
    pub observation: Option<String>,
    pub peak_amplitude_m: Option<f64>,
    pub peak_frequency_hz: Option<f64>,
    /// Row of response.csv, 0 = first.
    pub peak_row: Option<usize>,
    /// The largest amplitude is at an end of the range: the curve may go on rising outside.
    pub peak_at_end_of_range: bool,
    /// How far the curve through the peak and its neighbours rises above it, relative; `None` at an end of the
    /// range or beside a frequency without a result.
    pub peak_rise: Option<f64>,
    /// Ranges in which another motion was found beside that of response.csv, rising.
    pub second_motion: Vec<SecondMotion>,
    /// Every local maximum inside of the range, rising in frequency.
    pub peaks: Vec<PeakSummary>,
    /// Of the linear reference, exact.
    pub linear_peak_amplitude_m: Option<f64>,
    pub linear_peak_frequency_hz: Option<f64>,
    /// Peak amplitude over linear peak amplitude.
    pub peak_ratio: Option<f64>,
    /// At the peak, over a period: how many pairs do what, which adds up to the pairs.
    #[serde(default)]
    pub peak_stuck_pairs: Option<usize>,
    pub peak_slipping_pairs: Option<usize>,
    pub peak_opening_pairs: Option<usize>,
    #[serde(default)]
    pub peak_closing_pairs: Option<usize>,
    #[serde(default)]
    pub peak_open_pairs: Option<usize>,
    /// The same of each contact.
    #[serde(default)]
    pub peak_contacts: Vec<ContactCounts>,
    /// Mean powers at the peak. The power of friction is 0 where friction takes nothing but rounding.
    pub peak_friction_power_w: Option<f64>,
    pub peak_damping_power_w: Option<f64>,
    /// At the peak, the largest over the pairs: energy that friction takes in a period per area
    /// (`None` where the area of a pair is unknown), and distance slid in a period.
    #[serde(default)]
    pub peak_largest_friction_energy_j_m2: Option<f64>,
    #[serde(default)]
    pub peak_largest_slid_m: Option<f64>,
    /// Pairs, closed in the static state, that separate at any converged frequency.
    pub pairs_that_open: usize,
    /// Their share of the area of the flanks; `None` where the area of a pair is unknown.
    pub area_share_that_opens: Option<f64>,
    /// Largest |input - friction - viscous| over the largest of the three powers.
    pub worst_energy_balance_error: Option<f64>,
    pub slip_threshold_m: Option<f64>,
    pub newton_iterations: usize,
    pub krylov_iterations: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PeakSummary {
    pub row: usize,
    pub frequency_hz: f64,
    pub amplitude_m: f64,
    /// Energy spent in a period over 2 pi times the stored one: twice the equivalent damping ratio.
    pub loss_factor: Option<f64>,
    /// Its inverse.
    pub quality_factor: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnconvergedPoint {
    pub row: usize,
    pub frequency_hz: f64,
    pub outcome: Outcome,
    pub residual: Option<f64>,
}

/// Harmonic balance against time integration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerificationSummary {
    pub steps_per_period: usize,
    /// Largest relative difference that passes.
    pub tolerance: f64,
    pub worst_difference: Option<f64>,
    pub points: Vec<VerifiedPoint>,
}

/// Differences are harmonic balance less integration, over integration (works: over the input work).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerifiedPoint {
    pub frequency_hz: f64,
    pub harmonics: usize,
    pub periods: usize,
    pub steady: bool,
    /// Estimated rest of the transient, relative to the amplitude.
    pub transient_left: Option<f64>,
    pub balance: VerifiedFigures,
    pub integration: VerifiedFigures,
    pub amplitude_difference: Option<f64>,
    pub first_harmonic_difference: Option<f64>,
    pub contact_work_difference: Option<f64>,
    pub input_work_difference: Option<f64>,
    /// Steady force that held what friction does not hold, N.
    pub retention_n: f64,
}

/// One period by one method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerifiedFigures {
    pub amplitude_m: Option<f64>,
    pub first_harmonic_m: Option<f64>,
    pub contact_work_j: Option<f64>,
    pub damping_work_j: Option<f64>,
    pub input_work_j: Option<f64>,
    pub slipping_pairs: usize,
    pub opening_pairs: usize,
}

/// An observed displacement: sum over `terms` of `direction . u(node)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservationSummary {
    pub name: String,
    pub terms: Vec<ObservationTerm>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservationTerm {
    /// 0 or 1, as the array `body` of the VTK files.
    pub body: usize,
    pub node_tag: Option<u64>,
    pub direction: [f64; 3],
}

/// Where a mesh came from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshOrigin {
    /// The .msh file or the .geo script.
    pub source: PathBuf,
    /// Hash of the bytes of the mesh, in hexadecimals; `None` where its file cannot be read.
    pub blake3: Option<String>,
    /// Version of gmsh that made the mesh; `None` for a ready mesh.
    pub gmsh: Option<String>,
    /// The committed mesh was used because gmsh is missing.
    pub fallback: bool,
}

/// Mesh sizes read off the model.
pub fn mesh_summary(
    model: &Model,
    properties: &[MassProperties],
    origin: &MeshOrigin,
) -> MeshSummary {
    let bodies: Vec<BodySummary> = model
        .bodies
        .iter()
        .zip(properties)
        .map(|(b, properties)| BodySummary {
            young_pa: b.material.young_pa,
            poisson: b.material.poisson,
            density_kg_m3: b.material.density_kg_m3,
            volume_m3: properties.volume_m3,
            mass_kg: properties.mass_kg,
            centre_m: properties.centre_m,
            centrifugal_force_n: properties.centrifugal_force_n,
            name: b.name.clone(),
            nodes: b.nodes_m.len(),
            elements: b.elements.len(),
            free_dofs: 3 * b.dofs.free_nodes(),
        })
        .collect();
    let types = model.element_types();
    let flanks = Orientation::of_flanks(model).map(|(pair, orientation)| FlankView {
        contact: pair.contact,
        name: model.contact_names[pair.contact].clone(),
        bodies: pair.bodies(),
        right: orientation.right,
        up: orientation.up,
        edges: orientation.edges,
    });
    MeshSummary {
        source: origin.source.display().to_string(),
        blake3: origin.blake3.clone(),
        gmsh: origin.gmsh.clone(),
        fallback: origin.fallback,
        nodes: bodies.iter().map(|b| b.nodes).sum(),
        elements: bodies.iter().map(|b| b.elements).sum(),
        element_types: types.into_iter().map(|(t, n)| (t.name(), n)).collect(),
        free_dofs: bodies.iter().map(|b| b.free_dofs).sum(),
        bodies,
        contacts: model.matches.clone(),
        flanks: flanks.collect(),
        straightened_edges: model.straightened.clone(),
    }
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
        let own = of_contact().map(|(i, _)| fields.status[i]);
        let counts = valid.then(|| own.collect::<StaticCounts>());
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
        largest_pressure_pa: valid
            .then(|| fields.pressure_pa.iter().copied().fold(0.0, nan_or_max))
            .and_then(finite),
        contacts: contacts.collect(),
        retention_n: state.retention_n.filter(|_| valid).and_then(finite),
        newton_iterations: state.newton_iterations,
        residual: finite(state.residual),
    }
}

fn peak_summary(peak: &LocalPeak) -> PeakSummary {
    let loss_factor = peak.loss_factor.and_then(finite);
    PeakSummary {
        row: peak.at.index,
        frequency_hz: peak.at.frequency_hz,
        amplitude_m: peak.at.amplitude_m,
        loss_factor,
        quality_factor: loss_factor.map(f64::recip).and_then(finite),
    }
}

/// The figures of a response that a reader asks for first.
/// `observation` is the name of the first.
pub fn response_summary(
    pairs: &PairTable,
    observation: Option<&str>,
    response: &Response,
) -> ResponseSummary {
    let top = peak(response, 0);
    let at_peak = top.map(|p| &response.orbits[p.index]);
    let counts = at_peak.map(Orbit::counts);
    let linear = linear_peak(response, 0);
    let separates = sweep_fields(response, pairs.rows.len()).separates;
    let cycles = at_peak.map(|orbit| cycle_fields(orbit, &pairs.rows));
    let friction_works = at_peak.is_some_and(|orbit| friction_power_w(orbit) > 0.0);
    let energies = cycles.as_ref().map(|c| &c.friction_energy_j_m2);
    let largest_energy = energies.and_then(|energies| largest_of_pairs(energies));
    let unconverged = response
        .orbits
        .iter()
        .enumerate()
        .filter(|(_, o)| !o.outcome.is_converged())
        .map(|(row, o)| UnconvergedPoint {
            row,
            frequency_hz: o.frequency_hz,
            outcome: o.outcome,
            residual: finite(o.residual),
        });
    let inaccurate = |o: &&Orbit| o.outcome == Outcome::AccuracyNotReached;
    let inaccurate = response.orbits.iter().filter(inaccurate);
    ResponseSummary {
        points: response.orbits.len(),
        added_points: response
            .orbits
            .iter()
            .filter(|o| response.is_added(o))
            .count(),
        converged_points: response
            .orbits
            .iter()
            .filter(|o| o.outcome.is_converged())
            .count(),
        accuracy_not_reached_points: inaccurate.count(),
        largest_estimated_error: largest_estimated_error(response),
        peak_estimated_error: at_peak.and_then(|o| o.estimated_error),
        unconverged: unconverged.collect(),
        observation: observation.map(str::to_owned),
        peak_amplitude_m: top.map(|p| p.amplitude_m),
        peak_frequency_hz: top.map(|p| p.frequency_hz),
        peak_row: top.map(|p| p.index),
        peak_at_end_of_range: peak_is_at_an_end(response, 0),
        peak_rise: peak_rise(response, 0),
        second_motion: response.second_motions.clone(),
        peaks: local_peaks(response, 0).iter().map(peak_summary).collect(),
        linear_peak_amplitude_m: linear.map(|p| p.amplitude_m),
        linear_peak_frequency_hz: linear.map(|p| p.frequency_hz),
        peak_ratio: peak_ratio(response, 0),
        peak_stuck_pairs: counts.map(|c| c.stuck),
        peak_slipping_pairs: counts.map(|c| c.slipping),
        peak_opening_pairs: counts.map(|c| c.opening),
        peak_closing_pairs: counts.map(|c| c.closing),
        peak_open_pairs: counts.map(|c| c.open),
        peak_contacts: at_peak.map_or_else(Vec::new, |o| contact_counts(pairs, o)),
        peak_friction_power_w: at_peak.map(friction_power_w).and_then(finite),
        peak_damping_power_w: at_peak.and_then(|o| finite(o.viscous_power_w)),
        peak_largest_friction_energy_j_m2: largest_energy
            .map(|energy| if friction_works { energy } else { 0.0 }),
        peak_largest_slid_m: cycles.and_then(|c| largest_of_pairs(&c.slid_m)),
        pairs_that_open: separates.iter().filter(|separates| **separates).count(),
        area_share_that_opens: opening_share(pairs, &separates),
        worst_energy_balance_error: with_motion(response)
            .filter_map(energy_balance_error)
            .reduce(f64::max),
        slip_threshold_m: finite(response.slip_threshold_m),
        newton_iterations: response.orbits.iter().map(|o| o.newton_iterations).sum(),
        krylov_iterations: response.orbits.iter().map(|o| o.krylov_iterations).sum(),
    }
}

/// What each observation is made of.
pub fn observation_summaries(model: &Model) -> Vec<ObservationSummary> {
    let term = |&(BodyNode { body, node }, direction): &(BodyNode, [f64; 3])| ObservationTerm {
        body,
        node_tag: model
            .bodies
            .get(body)
            .and_then(|b| b.node_tags.get(node as usize))
            .copied(),
        direction,
    };
    let summary = |o: &dovetail_solver::model::Observation| ObservationSummary {
        name: o.name.clone(),
        terms: o.terms.iter().map(term).collect(),
    };
    model.observations.iter().map(summary).collect()
}

/// Observations of a model without nodes: their names.
pub fn probe_summaries(names: &[&str]) -> Vec<ObservationSummary> {
    let summary = |name: &&str| ObservationSummary {
        name: (*name).to_owned(),
        terms: Vec::new(),
    };
    names.iter().map(summary).collect()
}

/// The comparisons of `dovetail verify`.
pub fn verification_summary(
    comparisons: &[Comparison],
    steps_per_period: usize,
    tolerance: f64,
) -> VerificationSummary {
    let figures = |f: &Figures| VerifiedFigures {
        amplitude_m: f.amplitude_m.and_then(finite),
        first_harmonic_m: f.first_harmonic_m.and_then(finite),
        contact_work_j: finite(f.contact_work_j),
        damping_work_j: finite(f.viscous_work_j),
        input_work_j: finite(f.input_work_j),
        slipping_pairs: f.pairs.slipping,
        opening_pairs: f.pairs.opening,
    };
    let point = |c: &Comparison| {
        let [amplitude, first, contact, input] = c.differences().map(|d| d.and_then(finite));
        VerifiedPoint {
            frequency_hz: c.frequency_hz,
            harmonics: c.harmonics,
            periods: c.periods,
            steady: c.steady,
            transient_left: finite(c.transient_left),
            balance: figures(&c.balance),
            integration: figures(&c.integration),
            amplitude_difference: amplitude,
            first_harmonic_difference: first,
            contact_work_difference: contact,
            input_work_difference: input,
            retention_n: c.retention_n,
        }
    };
    VerificationSummary {
        steps_per_period,
        tolerance,
        worst_difference: comparisons
            .iter()
            .map(Comparison::worst)
            .reduce(f64::max)
            .and_then(finite),
        points: comparisons.iter().map(point).collect(),
    }
}

/// Writes summary.json.
pub fn write_summary(path: &Path, summary: &Summary) -> Result<(), ExportError> {
    let mut json =
        serde_json::to_vec_pretty(summary).map_err(|source| ExportError::EncodeJson {
            path: path.to_path_buf(),
            source,
        })?;
    json.push(b'\n');
    write_file(path, &json)
}

/// The summary that a file holds; none where it is not there or is no summary of this program.
pub fn read_summary(path: &Path) -> Option<Summary> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

/// Area of the pairs that open at some frequency over that of all.
fn opening_share(pairs: &PairTable, separates: &[bool]) -> Option<f64> {
    let areas: Option<Vec<f64>> = pairs.rows.iter().map(|p| p.area_m2).collect();
    let areas = areas?;
    let open = areas.iter().zip(separates).filter(|(_, opens)| **opens);
    let total: f64 = areas.iter().sum();
    (total > 0.0).then(|| open.map(|(a, _)| a).sum::<f64>() / total)
}

/// The larger of two, or a NaN that is among them (the pressure of a pair without area).
fn nan_or_max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}

fn finite(v: f64) -> Option<f64> {
    v.is_finite().then_some(v)
}
