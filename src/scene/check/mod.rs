//! Makes a [`Scene`] from a [`RawScene`], or reports all that is missing, impossible or
//! contradictory.
//!
//! There is a file for each section; `fields` checks single values, `pair_law` the law that two
//! sections give. A function notes a problem in
//! the [`Checker`] and goes on, so that one run reports as many problems as it can. It takes the
//! values of its section first, as options, and applies `?` to them where it puts them together. An
//! earlier `?` stands only where the rest has no meaning: after keys that exclude or need each
//! other, or where the next check needs the value.

mod bodies;
mod contacts;
mod cyclic;
mod excitations;
pub(crate) mod fields;
mod load_path;
mod loads;
mod mesh;
pub(crate) mod pair_law;
mod probes;
mod reduced_model;
mod response;
mod springs;

use std::path::Path;

use fields::{Checker, SceneTable};

use super::entries;
use super::entries::{RawBody, RawScene};
use super::error::{SceneFault, SceneProblem};
use super::keys::SectionShape;
use super::source::SourceTexts;
use dovetail_solver::description::{ResponseSpec, Scene, StaticSpec, Subject};
use dovetail_solver::model::Assembly;

/// Returns the checked scene, or every problem in the order of the text.
pub fn scene(
    source: &SourceTexts,
    base_dir: &Path,
    raw: RawScene,
) -> Result<Scene, Vec<SceneProblem>> {
    Checker::run(source, |checker| check_scene(checker, base_dir, raw))
}

fn check_scene(checker: &mut Checker, base_dir: &Path, raw: RawScene) -> Option<Scene> {
    let name = match &raw.name {
        Some(name) => checker.name("name".to_owned(), name),
        None => {
            let fault = SceneFault::MissingKey {
                path: "name".to_owned(),
                example: entries::example("", "name"),
            };
            checker.fault(0..0, fault);
            None
        }
    };
    missing_sections(checker, &raw);
    let response = raw.response.as_ref();
    let response = response.and_then(|r| response::response(checker, r));
    response::turns(checker, &raw);
    let damping = raw.damping.as_ref();
    let damping = damping.and_then(|d| contacts::damping(checker, d, response.as_ref()));
    let (damping, modal_ratios) = damping.unzip();
    let subject = match &raw.reduced_model {
        Some(table) => {
            reduced_model::check_exclusive(checker, table.span(), &raw);
            reduced_model::reduced_model(checker, base_dir, table).map(Subject::ReducedModel)
        }
        None => assembly(checker, base_dir, &raw, response.as_ref())
            .map(|a| Subject::Assembly(Box::new(a))),
    };
    let engine_orders = response::engine_orders(checker, &raw.engine_order);
    let mission = response::mission(checker, &raw.mission);
    let table = raw.static_state.as_ref();
    let at = SceneTable::new("static", table.map_or(0..0, |table| table.span()), None);
    let load_steps = table.map_or(&None, |table| &table.get_ref().load_steps);
    let load_steps = checker.count(&at, "load_steps", load_steps);
    let path = load_path::load_path(checker, &raw);
    let tractions = table.map_or(&None, |table| &table.get_ref().starting_tractions);
    let starting_tractions = checker.count(&at, "starting_tractions", tractions);
    Some(Scene {
        name: name?,
        subject: subject?,
        damping: damping?,
        modal_ratios: modal_ratios?,
        static_state: StaticSpec {
            load_steps: load_steps?,
            path: path?,
            starting_tractions: starting_tractions?,
        },
        response: response?,
        engine_orders: engine_orders?,
        mission: mission?,
    })
}

/// Sections about a mesh.
fn assembly(
    checker: &mut Checker,
    base_dir: &Path,
    raw: &RawScene,
    response: Option<&ResponseSpec>,
) -> Option<Assembly> {
    let mesh = mesh::mesh(checker, base_dir, raw.mesh.as_ref(), needs_shared_mesh(raw));
    let units = mesh.as_ref().and_then(|mesh| mesh.units);
    let bodies = bodies::bodies(checker, base_dir, raw, units);
    let names = raw.body.iter().filter_map(|b| b.get_ref().name.as_ref());
    let names: Vec<String> = names.map(|n| n.get_ref().clone()).collect();
    let rotation = raw.rotation.as_ref();
    let rotation = rotation.map(|r| bodies::rotation(checker, &names, r));
    let symmetry = raw.cyclic.as_ref();
    let run_up = response.and_then(|r| r.along_engine_order);
    let symmetry =
        symmetry.map(|c| cyclic::cyclic(checker, base_dir, c, raw.rotation.as_ref(), run_up));
    cyclic::check_contacts(checker, raw);
    let contacts = contacts::contacts(checker, base_dir, &raw.contact);
    let springs = springs::springs(checker, &raw.spring);
    let dashpots = springs::dashpots(checker, &raw.dashpot);
    let loads = loads::loads(checker, &raw.load);
    let excitations = excitations::excitations(checker, base_dir, &raw.excitation, response);
    let observations = probes::observations(checker, &raw.observe);
    let mesh = mesh?;
    Some(Assembly {
        mesh: mesh.source,
        bodies: bodies?,
        rotation: match rotation {
            None => None,
            Some(rotation) => Some(rotation?),
        },
        cyclic: match symmetry {
            None => None,
            Some(symmetry) => Some(symmetry?),
        },
        contacts: contacts?,
        springs: springs?,
        dashpots: dashpots?,
        loads: loads?,
        excitations: excitations?,
        observations: observations?,
    })
}

/// Returns `true` if a body has no mesh of its own, or if there are no bodies.
fn needs_shared_mesh(raw: &RawScene) -> bool {
    let has_own = |body: &RawBody| body.mesh_file.is_some() || body.copy_of.is_some();
    raw.body.is_empty() || !raw.body.iter().all(|body| has_own(body.get_ref()))
}

/// Reports missing sections without which nothing can be computed. Bodies have a message of their
/// own.
fn missing_sections(checker: &mut Checker, raw: &RawScene) {
    let meshed = raw.reduced_model.is_none();
    for section in entries::SCENE.sections {
        let absent = match section.name {
            "mesh" => meshed && raw.mesh.is_none() && needs_shared_mesh(raw),
            "damping" => raw.damping.is_none(),
            "excitation" => meshed && raw.excitation.is_empty(),
            "observe" => meshed && raw.observe.is_empty(),
            "response" => raw.response.is_none(),
            _ => false,
        };
        if absent {
            let end = checker.source.text.len();
            let fault = SceneFault::MissingSection {
                section: section.name,
                list: section.shape == SectionShape::List,
                example: section.example,
            };
            checker.fault(end..end, fault);
        }
    }
}
