//! Checks `[reduced_model]`: a folder that replaces the mesh and all that refers to one.

use std::ops::Range;
use std::path::Path;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use super::pair_law::law_keys;
use crate::scene::entries::{RawReducedModel, RawScene};
use crate::scene::error::SceneFault;
use dovetail_solver::description::ReducedModelSpec;

pub fn reduced_model(
    checker: &mut Checker,
    base_dir: &Path,
    raw: &Spanned<RawReducedModel>,
) -> Option<ReducedModelSpec> {
    let at = SceneTable::new("reduced_model", raw.span(), None);
    let raw = raw.get_ref();
    let folder = checker.text(&at, "folder", &raw.folder);
    let keys = law_keys!(raw; normal_stiffness_n_m, tangential_stiffness_n_m);
    let law = keys.law(checker, &at, false);
    let force_n = checker.number(&at, "force_n", &raw.force_n);
    Some(ReducedModelSpec {
        folder: base_dir.join(folder?),
        law: law?,
        force_n: force_n?,
    })
}

/// Notes a fault for every section that needs a mesh.
pub fn check_exclusive(checker: &mut Checker, own: Range<usize>, raw: &RawScene) {
    fn first<T>(list: &[Spanned<T>]) -> Option<Range<usize>> {
        list.first().map(Spanned::span)
    }
    let lists = [
        ("body", first(&raw.body)),
        ("contact", first(&raw.contact)),
        ("spring", first(&raw.spring)),
        ("dashpot", first(&raw.dashpot)),
        ("load", first(&raw.load)),
        ("excitation", first(&raw.excitation)),
        ("observe", first(&raw.observe)),
        ("engine_order", first(&raw.engine_order)),
    ];
    for (section, span) in places!(raw; mesh, rotation, cyclic)
        .into_iter()
        .chain(lists)
    {
        let Some(span) = span else { continue };
        let fault = SceneFault::Exclusive {
            first: "reduced_model".to_owned(),
            second: section.to_owned(),
            remedy: "a scene is about a reduced model or about a mesh: keep [reduced_model] alone, whose folder \
                     holds the loads, the dashpots and the observed points, or the sections [mesh], [[body]], [rotation], [cyclic], \
                     [[contact]], [[spring]], [[dashpot]], [[load]], [[excitation]], [[observe]] and [[engine_order]] without it",
        };
        let problem = checker
            .source
            .problem_with(span, fault, own.clone(), "the other");
        checker.problems.push(problem);
    }
}
