//! Account of what was computed: bodies, contacts, loads and the method, in the words of a report.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::super::Contents;
use super::super::frame::table;
use crate::manifest::BodySummary;
use crate::words::{counted, figure, motion_of_sectors, percent, quantity, text_or_dash, vector};
use dovetail_mesh::ElementType;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::Subject;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::model::{
    Assembly, BaseMotion, BodySpec, ContactLaw, ContactSpec, DashpotSpec, ExcitationKind,
    ExcitationSpec, FieldSource, Gap, LoadKind, LoadSpec, Model, Prestress, Sector, SpringSpec,
};
use dovetail_solver::reduced::DiscExcitation;
use dovetail_solver::reduced::ObservedQuantity;

pub(super) fn computed(contents: &Contents<'_>) -> Markup {
    html! {
        section #computed {
            h2 { "What was computed" }
            @match &contents.scene.subject {
                Subject::Assembly(assembly) => (assembly_words(contents, assembly)),
                Subject::ReducedModel(spec) => {
                    p {
                        "A reduced model was read from " code { (spec.folder.display()) } ": "
                        (contents.pairs.rows.len()) " pairs, " (law_words(spec.law, "N/m")) ", excitation " (quantity(spec.force_n, "N", 3)) "."
                    }
                }
            }
            (solution_words(contents))
            (origin(contents))
        }
    }
}

/// Hash of the inputs, by which the figures can be told from those of another scene.
fn origin(contents: &Contents<'_>) -> Markup {
    let Some(hash) = contents.summary.scene.blake3.as_deref() else {
        return html! {};
    };
    html! {
        p.quiet {
            "The scene as it was read and the files that it names have the hash " code { (short_hash(hash)) }
            ". summary.json has the hashes whole."
        }
    }
}

/// First digits of a hash, which suffice to distinguish two files.
fn short_hash(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

fn assembly_words(contents: &Contents<'_>, assembly: &Assembly) -> Markup {
    let mesh = contents.summary.mesh.as_ref();
    let of = |body: &BodySpec, words: fn(&BodySummary) -> String| {
        let bodies = mesh.iter().flat_map(|mesh| &mesh.bodies);
        text_or_dash(bodies.into_iter().find(|b| b.name == body.name), words)
    };
    html! {
        (table(
            "",
            &assembly.bodies,
            &[
                ("body", &|body| body.name.clone()),
                ("Young's modulus", &|body| of(body, |b| text_or_dash(b.young_pa, |e| quantity(e, "Pa", 4)))),
                ("Poisson's ratio", &|body| of(body, |b| text_or_dash(b.poisson, |nu| figure(nu, 3)))),
                ("density", &|body| of(body, |b| text_or_dash(b.density_kg_m3, |rho| format!("{} kg/m³", figure(rho, 4))))),
                ("mass", &|body| of(body, |b| format!("{} kg", figure(b.mass_kg, 4)))),
                ("nodes", &|body| of(body, |b| b.nodes.to_string())),
                ("elements", &|body| of(body, |b| b.elements.to_string())),
                ("held by", &|body| held(body, contents.model)),
            ],
        ))
        @if let Some(mesh) = mesh {
            p {
                "The mesh is " code { (mesh.origin.source.file_name().unwrap_or(mesh.origin.source.as_os_str()).display()) }
                @if let Some(hash) = mesh.origin.blake3.as_deref() { " (hash " code { (short_hash(hash)) } ")" }
                ": " (elements(&mesh.element_types)) ", "
                (mesh.free_dofs) " free degrees of freedom."
            }
        }
        @if let Some(rotation) = &assembly.rotation {
            p {
                "Rotor speed " (figure(rotation.speed_rpm(), 5)) " rpm about the axis "
                (vector(rotation.axis, 3)) ". "
                @if rotation.bodies.len() < assembly.bodies.len() {
                    "Only " (rotation.bodies.join(", ")) " of the bodies rotate. "
                }
                @match rotation.prestress {
                    Prestress::HeldFlanks => "The stiffness includes stress stiffening, computed with the contact nodes of each body held, and spin softening.",
                    Prestress::Contact => "The stiffness includes stress stiffening, computed from the static state with contact and friction, and spin softening.",
                    Prestress::None => "The stiffness includes neither stress stiffening nor spin softening.",
                }
            }
        }
        @if let Some(cyclic) = &assembly.cyclic {
            p {
                "The bodies are one of " (cyclic.sectors) " equal sectors of a disc about the axis "
                (vector(cyclic.axis, 3)) "; "
                (motion_of_sectors(DiscExcitation {
                    sectors: cyclic.sectors,
                    engine_order: cyclic.engine_order,
                })) "."
                @if cyclic.influence.is_some() {
                    " The air that the blades move acts back on them."
                }
            }
        }
        ul {
            @for contact in &assembly.contacts { li { (contact_words(contact, contents.model)) } }
            @for spring in &assembly.springs { li { (spring_words(spring)) } }
            @for dashpot in &assembly.dashpots { li { (dashpot_words(dashpot)) } }
            @for load in &assembly.loads {
                li {
                    "A steady load on " code { (load.on) } ": "
                    @match load.load {
                        LoadKind::Force { vector_n } => { "a force of " (vector(vector_n, 4)) " N." },
                        LoadKind::Traction { vector_pa } => { "a traction of " (vector(vector_pa, 4)) " Pa." },
                        LoadKind::Pressure { pressure_pa } => { "a pressure of " (quantity(pressure_pa, "Pa", 4)) "." },
                    }
                }
            }
            @for cause in &assembly.excitations {
                li {
                    "Excitation: " (excitation_words(cause))
                    @if cause.harmonic > 1 { " with " (cause.harmonic) " times the frequency" }
                    @if cause.phase_rad != 0.0 { ", " (figure(cause.phase_rad.to_degrees(), 3)) "° behind" }
                    "."
                }
            }
            @for probe in &assembly.observations {
                li {
                    (probe.name) " is the "
                    @match probe.quantity { ObservedQuantity::Displacement => "displacement", ObservedQuantity::Strain => "strain" }
                    " of " code { (probe.points) } " along "
                    (vector(probe.direction, 3)) "."
                }
            }
        }
    }
}

/// Number of elements of each type: `6739 tetrahedra of 10 nodes`.
fn elements(types: &BTreeMap<String, usize>) -> String {
    let element_types = ElementType::ALL.iter();
    let named = element_types.filter_map(|element| Some((types.get(&element.name())?, element)));
    let words = named.map(|(n, e)| format!("{n} {} of {} nodes", e.shape.plural(), e.nodes()));
    words.collect::<Vec<_>>().join(", ")
}

/// Supports and springs of a body or, if it has none, `contacts`.
fn held(body: &BodySpec, model: Option<&Model>) -> String {
    let along = body.fixed_along.iter().zip(["x", "y", "z"]);
    let along =
        along.flat_map(|(groups, axis)| groups.iter().map(move |g| format!("{g} along {axis}")));
    let bodies = model.iter().flat_map(|model| &model.bodies);
    let sprung_bodies = bodies.filter(|b| b.name == body.name && !b.springs.is_empty());
    let springs = sprung_bodies.map(|_| "springs".to_owned());
    let supports: Vec<String> = body
        .fixed
        .iter()
        .cloned()
        .chain(along)
        .chain(springs)
        .collect();
    if supports.is_empty() {
        "contacts".to_owned()
    } else {
        supports.join(", ")
    }
}

/// Kind, amplitude and place of an excitation.
fn excitation_words(cause: &ExcitationSpec) -> Markup {
    let amplitude = quantity(cause.amplitude, cause.kind.unit(), 3);
    html! {
        @match &cause.kind {
            ExcitationKind::Load(LoadSpec { on, load }) => {
                @match load {
                    LoadKind::Force { vector_n } => {
                        "A force of " (amplitude) " on " code { (on) } " along " (vector(*vector_n, 3))
                    },
                    LoadKind::Traction { vector_pa } => {
                        "A traction of " (amplitude) " on " code { (on) } " along " (vector(*vector_pa, 3))
                    },
                    LoadKind::Pressure { .. } => { "A pressure of " (amplitude) " on " code { (on) } },
                }
            },
            ExcitationKind::Field { on, field } => {
                @match field {
                    FieldSource::File(path) => { "The field of " code { (path.display()) } },
                    FieldSource::Points(_) => { "A field" },
                }
                " on " code { (on) }
                @if cause.amplitude != 1.0 { ", times " (figure(cause.amplitude, 3)) "," }
            },
            ExcitationKind::Base { direction, motion } => {
                @match motion {
                    BaseMotion::Acceleration => { "An acceleration" },
                    BaseMotion::Displacement => { "A displacement" },
                }
                " of the base of " (amplitude) " along " (vector(*direction, 3))
            },
        }
    }
}

fn spring_words(spring: &SpringSpec) -> Markup {
    html! {
        "The spring " code { (spring.name) } " of " (quantity(spring.stiffness_n_m, "N/m", 4))
        (joins(&spring.first, spring.second.as_deref(), spring.direction))
    }
}

fn dashpot_words(dashpot: &DashpotSpec) -> Markup {
    html! {
        "The dashpot " code { (dashpot.name) } " of " (quantity(dashpot.damping_n_s_m, "N s/m", 4))
        (joins(&dashpot.first, dashpot.second.as_deref(), dashpot.direction))
    }
}

/// Ends and direction of a spring or a dashpot.
fn joins(first: &str, second: Option<&str>, direction: Option<[f64; 3]>) -> Markup {
    html! {
        " joins " code { (first) } " to "
        @match second {
            Some(second) => { code { (second) } },
            None => { "ground" },
        }
        @if let Some(direction) = direction { ", along " (vector(direction, 3)) }
        "."
    }
}

fn contact_words(contact: &ContactSpec, model: Option<&Model>) -> Markup {
    let second = contact.second.as_deref().unwrap_or("rigid ground");
    html! {
        "Contact " b { (contact.name) } " between " code { (contact.first) } " and " code { (second) }
        @if contact.second_sector == Sector::Next { " of the next sector" }
        ": "
        @match contact.law {
            ContactLaw::Bonded => "bonded.",
            ContactLaw::UnilateralCoulomb => {
                "it opens and slides, " (friction_words(contact, model)) (further_words(contact.pair_law, "N/m3"))
                @if contact.gap == Gap::Mesh { ", the distance in the mesh being clearance too" }
                @if let Some(crown) = &contact.crown { ", crowned with a radius of " (quantity(crown.radius_m, "m", 3)) }
                "."
            },
        }
    }
}

/// Friction of a contact: one coefficient, or the range of those of a file.
fn friction_words(contact: &ContactSpec, model: Option<&Model>) -> Markup {
    let maps = model.iter().flat_map(|model| &model.friction_maps);
    let map = maps.into_iter().find(|map| map.contact == contact.name);
    html! {
        @match (contact.friction_at.as_ref().and_then(FieldSource::file), map) {
            (Some(file), Some(map)) => {
                "dry friction of " (figure(map.range[0], 3)) " to " (figure(map.range[1], 3)) " from "
                code { (file.file_name().unwrap_or(file.as_os_str()).display()) }
                ", on average " (figure(map.mean, 3))
            },
            (Some(file), None) => {
                "dry friction from " code { (file.file_name().unwrap_or(file.as_os_str()).display()) }
            },
            (None, _) => { "dry friction " (figure(contact.pair_law.friction, 3)) },
        }
    }
}

/// Law of a pair, with stiffnesses in this unit.
fn law_words(law: PairLaw, unit: &str) -> Markup {
    html! { "dry friction " (figure(law.friction, 3)) (further_words(law, unit)) }
}

/// Law of a pair besides its friction, with stiffnesses in this unit.
fn further_words(law: PairLaw, unit: &str) -> Markup {
    html! {
        @if let Some(stiffness) = law.stiffness {
            ", on springs of " (figure(stiffness.normal_n_m, 3)) " " (unit) " against penetration and "
            (figure(stiffness.tangential_n_m, 3)) " " (unit) " against shear"
        }
        @if law.gap_m > 0.0 { ", clearance " (quantity(law.gap_m, "m", 3)) }
        @if law.gap_m < 0.0 { ", interference " (quantity(-law.gap_m, "m", 3)) }
    }
}

fn solution_words(contents: &Contents<'_>) -> Markup {
    let scene = contents.scene;
    let spec = &scene.response;
    html! {
        p {
            @match scene.damping {
                DampingSpec::Ratio { ratio, linear_mode } => {
                    "Damping is " (percent(ratio, 3)) " of critical on linear mode " (linear_mode) "."
                }
                DampingSpec::Rayleigh { stiffness_s, mass_per_s } => {
                    "Damping is " (figure(stiffness_s, 3)) " s times the stiffness and " (figure(mass_per_s, 3)) "/s times the mass."
                }
            }
            @if !scene.modal_ratios.is_empty() {
                " In place of it "
                @if scene.modal_ratios.len() == 1 { "the first mode with all pairs stuck has " }
                @else { "the first " (scene.modal_ratios.len()) " modes with all pairs stuck have " }
                (scene.modal_ratios.iter().map(|ratio| percent(*ratio, 3)).collect::<Vec<_>>().join(", ")) " of critical."
            }
            @if contents.sweep.is_some() {
                @match spec.points {
                    Some(points) => {
                        " The periodic motion was sought at " (counted(points, "frequency", "frequencies")) ", "
                    }
                    None => { " The curve of periodic motions was followed along its length, " }
                }
                "by harmonic balance with "
                @match spec.resolution {
                    Resolution::Fixed { harmonics, samples } => {
                        (counted(harmonics, "harmonic", "harmonics")) " and " (samples) " samples of a period."
                    }
                    Resolution::Accuracy(accuracy) => {
                        "as many harmonics as an accuracy of " (percent(accuracy, 2)) " asks for."
                    }
                }
            }
        }
        p.quiet {
            "Assumptions: small displacements, linear elasticity, no other bodies than those of the table, pairs that stay "
            "opposite each other, the same coefficient of friction at rest and in motion, no wear, no Coriolis force, and motion "
            "with the period of the excitation."
        }
    }
}
