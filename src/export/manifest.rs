//! Writes summary.json: the inputs of a run, its duration, and the main figures.
//!
//! A number that does not exist (no converged point, no excitation) or is not finite is `null`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize, Serializer};

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

/// Content of summary.json.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Version of the program.
    pub version: String,
    /// Commit that the program was built from; `None` if it is not known.
    #[serde(default)]
    pub commit: Option<String>,
    /// Hash of the program, its libraries and the processor, on which the last digits depend, in
    /// hexadecimals; `None` if the system does not provide it.
    #[serde(default)]
    pub program_blake3: Option<String>,
    /// Start of the run in universal time: `2026-02-28T23:59:59Z`.
    #[serde(default)]
    pub begun: String,
    pub scene: SceneSummary,
    /// Progress of the run.
    pub state: RunState,
    /// Reason why the run failed; else `None`.
    pub why: Option<String>,
    /// Names of the other files in the folder of the run: the files that the run wrote, and those
    /// of an earlier run until they are replaced. If the run is under way, they include the files
    /// that it is about to write.
    pub files: Vec<String>,
    /// Mesh of the scene; `None` without one.
    pub mesh: Option<MeshSummary>,
    /// Folder of the reduced model; `None` if the scene does not use one.
    pub reduced_model: Option<String>,
    /// Number of stuck modes kept; `None` if nothing was reduced yet.
    pub stuck_modes: Option<usize>,
    /// Estimated errors due to the omitted modes, if a mesh was reduced.
    pub truncation: Option<TruncationSummary>,
    pub pairs: usize,
    /// Passes of the prestress of the static state with contact; empty for other prestress.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prestress_passes: Vec<PrestressPass>,
    /// Estimated relative change of the first stuck frequencies if the stress of the static state
    /// replaced the prestress of the held flanks; `None` for other prestress.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_flanks_error: Option<f64>,
    /// First frequency of the fully stuck assembly, Hz.
    pub stuck_frequency_hz: Option<f64>,
    /// First frequency of the linear reference, Hz: pairs that are open in the static state are
    /// released. `None` if there is no static state yet.
    pub linear_frequency_hz: Option<f64>,
    /// First frequency of the first body with its flanks held, Hz; `None` if it was not requested.
    pub blade_frequency_hz: Option<f64>,
    /// Wall time of the whole run, s.
    pub seconds: f64,
    /// Processor time of all threads and of gmsh, s; `None` if the system does not provide it.
    pub processor_seconds: Option<f64>,
    /// Number of pairs of nodes tied by bonded contacts; none of them is among `pairs`.
    pub bonded_pairs: usize,
    pub stages: Vec<StageSummary>,
    #[serde(rename = "static")]
    pub static_state: Option<StaticSummary>,
    pub response: Option<ResponseSummary>,
    /// Warnings, the most important first.
    #[serde(default)]
    pub warnings: Vec<WarningSummary>,
    /// Figures of `dovetail verify`; `None` for other commands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verification: Option<VerificationSummary>,
    pub observations: Vec<ObservationSummary>,
    /// Fields at points in space that were mapped to surfaces; empty if no excitation has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excitation_fields: Vec<FieldMap>,
}

impl Summary {
    /// Returns `true` if there are figures of a run: those of `dovetail run` or `dovetail static`.
    pub fn is_of_run(&self) -> bool {
        self.static_state.is_some() || self.response.is_some()
    }

    /// This summary with the findings of a command beside its run.
    pub fn with_findings_of(&self, beside: Self) -> Self {
        let own = self.clone();
        Self {
            blade_frequency_hz: beside.blade_frequency_hz.or(own.blade_frequency_hz),
            verification: beside.verification.or(own.verification),
            ..own
        }
    }
}

/// Progress of a run. A killed run leaves `running`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    #[default]
    Running,
    Finished,
    /// Ended by Ctrl-C or SIGTERM.
    Interrupted,
    Failed,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneSummary {
    pub name: String,
    pub file: String,
    /// Hash of the scene as it was read, with all settings of the command line, and of the files
    /// that it names, in hexadecimals.
    #[serde(default)]
    pub blake3: Option<String>,
}

impl SceneSummary {
    /// Returns `true` if both are the same scene with the same settings and files.
    pub fn is_of(&self, other: &Self) -> bool {
        self.name == other.name && self.blake3.is_some() && self.blake3 == other.blake3
    }
}

/// Warning about a run.
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

/// Estimated errors due to the modes that a reduction leaves out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TruncationSummary {
    /// Estimated relative error of the amplitudes of observed points on the linear curve; `None` if
    /// the stuck modes end below its highest frequency.
    pub amplitude: Option<f64>,
    /// Estimated relative errors of the first stuck frequencies due to bodies with
    /// `fixed_interface_modes`.
    pub frequencies: Vec<f64>,
    /// Frequency of the last stuck mode over that of the highest harmonic of the response; `None`
    /// before there is a response, and if no mode was left out.
    #[serde(default)]
    pub modes_reach: Option<f64>,
}

/// Origin of a mesh.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshOrigin {
    /// The .msh file or the .geo script.
    #[serde(serialize_with = "displayed")]
    pub source: PathBuf,
    /// Hash of the bytes of the mesh, in hexadecimals; `None` if its file cannot be read.
    #[serde(default)]
    pub blake3: Option<String>,
    /// Version of gmsh that made the mesh; `None` for a ready mesh.
    pub gmsh: Option<String>,
    /// True if the committed mesh was used because gmsh is missing.
    pub fallback: bool,
}

/// Path as text, whatever bytes it has.
fn displayed<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.display())
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshSummary {
    #[serde(flatten)]
    pub origin: MeshOrigin,
    pub nodes: usize,
    pub elements: usize,
    /// Number of elements of each type, by the name of the type: tet10, hex20.
    pub element_types: BTreeMap<String, usize>,
    pub free_dofs: usize,
    pub bodies: Vec<BodySummary>,
    /// Contacts between two flanks, bonded ones last.
    pub contacts: Vec<FlankMatch>,
    /// Contacts whose flanks have maps, in the orientation of the maps.
    #[serde(default)]
    pub flanks: Vec<FlankView>,
    /// Bodies with flanks whose edges are not straight in the mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub straightened_edges: Vec<StraightenedEdges>,
}

/// Flank in the orientation of the maps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlankView {
    /// Number of its contact, as in the VTK files.
    pub contact: usize,
    pub name: String,
    /// Numbers of the bodies of the first and of the second flank; `None` for rigid ground.
    pub bodies: [Option<usize>; 2],
    #[serde(flatten)]
    pub orientation: Orientation,
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
    /// Centre of gravity, m.
    pub centre_m: [f64; 3],
    /// Centrifugal force of the whole body, N; `None` if it does not rotate.
    pub centrifugal_force_n: Option<[f64; 3]>,
}

/// Wall time and peak memory of one stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageSummary {
    /// Identifier for programs: it stays when the name changes.
    pub id: Stage,
    pub name: String,
    pub seconds: f64,
    /// Processor time of all threads and of gmsh, s; `None` if the system does not provide it.
    pub processor_seconds: Option<f64>,
    /// Peak memory of the process up to the end of the stage; `None` if the system does not provide
    /// it.
    pub peak_memory_mib: Option<f64>,
    /// True if the result of the stage was kept from an earlier run.
    pub from_cache: bool,
    /// Unknowns of each system that the stage solves, the largest first.
    pub unknowns: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StaticSummary {
    pub outcome: Outcome,
    /// Counts of the states of the pairs. Counts and forces are `None` if the static state did not
    /// converge.
    #[serde(flatten)]
    pub counts: Option<StaticCounts>,
    pub largest_slip_m: Option<f64>,
    /// Largest pressure over the pairs, Pa; `None` if the area of a pair is unknown.
    pub largest_pressure_pa: Option<f64>,
    pub contacts: Vec<ContactSummary>,
    /// Force that retains the motions that friction does not hold, N; `None` if nothing is
    /// retained.
    pub retention_n: Option<f64>,
    pub newton_iterations: usize,
    pub residual: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactSummary {
    pub name: String,
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

impl ResponseSummary {
    /// Counts of the states of the pairs at the peak; `None` without a peak.
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

/// Counts of the states of the pairs of a contact in a period.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactCounts {
    pub name: String,
    #[serde(flatten)]
    pub counts: CycleCounts,
}

/// Counts of the states of the pairs of each contact in the period of an orbit.
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
    /// Number of frequencies, including the frequencies added at peaks.
    pub points: usize,
    /// Number of frequencies added at peaks.
    pub added_points: usize,
    pub converged_points: usize,
    /// Frequencies that have a motion and did not converge: the estimated error is above the
    /// requested accuracy.
    pub accuracy_not_reached_points: usize,
    /// Largest estimated relative error of an observed amplitude due to the omitted harmonics;
    /// `None` if no harmonic is omitted or nothing converged.
    pub largest_estimated_error: Option<f64>,
    /// Estimated relative error of the observed amplitude at the peak.
    pub peak_estimated_error: Option<f64>,
    pub unconverged: Vec<UnconvergedPoint>,
    /// Name of the first observation; `None` without observations.
    pub observation: Option<String>,
    pub peak_amplitude_m: Option<f64>,
    pub peak_frequency_hz: Option<f64>,
    /// Row of response.csv, 0 = first.
    pub peak_row: Option<usize>,
    /// True if the largest amplitude is at an end of the range: the curve may rise further outside.
    pub peak_at_end_of_range: bool,
    /// Height of the curve through the peak and its neighbours above the peak, relative; `None` at
    /// an end of the range or beside a frequency without a result.
    pub peak_rise: Option<f64>,
    /// Ranges in which another motion was found beside that of response.csv, rising.
    pub second_motion: Vec<SecondMotion>,
    /// All local maxima inside the range, rising in frequency.
    pub peaks: Vec<PeakSummary>,
    /// Peak of the linear reference, exact.
    pub linear_peak_amplitude_m: Option<f64>,
    pub linear_peak_frequency_hz: Option<f64>,
    /// Peak amplitude over linear peak amplitude.
    pub peak_ratio: Option<f64>,
    /// Counts of the states of the pairs in a period at the peak. The five counts add up to the
    /// number of pairs.
    #[serde(default)]
    pub peak_stuck_pairs: Option<usize>,
    pub peak_slipping_pairs: Option<usize>,
    pub peak_opening_pairs: Option<usize>,
    #[serde(default)]
    pub peak_closing_pairs: Option<usize>,
    #[serde(default)]
    pub peak_open_pairs: Option<usize>,
    /// Counts of the states of the pairs of each contact at the peak.
    #[serde(default)]
    pub peak_contacts: Vec<ContactCounts>,
    /// Mean power of friction at the peak. It is 0 if friction takes no power beyond rounding.
    pub peak_friction_power_w: Option<f64>,
    /// Mean power of viscous damping at the peak.
    pub peak_damping_power_w: Option<f64>,
    /// Energy that friction dissipates in a period per area at the peak, the largest over the
    /// pairs; `None` if the area of a pair is unknown.
    #[serde(default)]
    pub peak_largest_friction_energy_j_m2: Option<f64>,
    /// Distance slid in a period at the peak, the largest over the pairs.
    #[serde(default)]
    pub peak_largest_slid_m: Option<f64>,
    /// Number of pairs, closed in the static state, that separate at any converged frequency.
    pub pairs_that_open: usize,
    /// Share of these pairs in the area of the flanks; `None` if the area of a pair is unknown.
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
    /// Energy dissipated in a period over 2 pi times the stored energy: twice the equivalent
    /// damping ratio.
    pub loss_factor: Option<f64>,
    /// Inverse of the loss factor.
    pub quality_factor: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnconvergedPoint {
    pub row: usize,
    pub frequency_hz: f64,
    pub outcome: Outcome,
    pub residual: Option<f64>,
}

/// Comparison of harmonic balance with time integration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerificationSummary {
    pub steps_per_period: usize,
    /// Largest relative difference that passes.
    pub tolerance: f64,
    pub worst_difference: Option<f64>,
    pub points: Vec<VerifiedPoint>,
}

/// Comparison at one frequency. Differences are harmonic balance less integration, over integration
/// (works: over the input work).
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
    /// Steady force that retained the motions that friction does not hold, N.
    pub retention_n: f64,
}

/// Figures of one period by one method.
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

/// Observed displacement: sum over `terms` of `direction . u(node)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservationSummary {
    pub name: String,
    pub terms: Vec<ObservationTerm>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservationTerm {
    /// Number of the body, as the array `body` of the VTK files.
    pub body: usize,
    pub node_tag: Option<u64>,
    pub direction: [f64; 3],
}

/// Sizes of the mesh of a model.
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
        orientation,
    });
    MeshSummary {
        origin: origin.clone(),
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

/// Main figures of a response. `observation` is the name of the first observation.
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

/// Terms of each observation.
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

/// Observations of a model without nodes: only their names.
pub fn probe_summaries(names: &[&str]) -> Vec<ObservationSummary> {
    let summary = |name: &&str| ObservationSummary {
        name: (*name).to_owned(),
        terms: Vec::new(),
    };
    names.iter().map(summary).collect()
}

/// Summary of the comparisons of `dovetail verify`.
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

/// Reads the summary in a file; `None` if there is no such file or it is not a summary of this
/// program.
pub fn read_summary(path: &Path) -> Option<Summary> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

/// Area of the pairs that open at some frequency over that of all pairs.
fn opening_share(pairs: &PairTable, separates: &[bool]) -> Option<f64> {
    let areas: Option<Vec<f64>> = pairs.rows.iter().map(|p| p.area_m2).collect();
    let areas = areas?;
    let open = areas.iter().zip(separates).filter(|(_, opens)| **opens);
    let total: f64 = areas.iter().sum();
    (total > 0.0).then(|| open.map(|(a, _)| a).sum::<f64>() / total)
}

/// Larger of two numbers, or NaN if one is NaN (the pressure of a pair without area).
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
