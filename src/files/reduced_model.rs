//! The folder of a reduced model.

use super::RunFiles;
use crate::error::RunError;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::description::Scene;
use dovetail_solver::excitation::NamedExcitation;
use dovetail_solver::model::{ExcitationKind, ExcitationSpec};
use dovetail_solver::reduced::ReducedModel;
use dovetail_solver::run::{Bodies, ReducedScene};
use dovetail_solver::superelement::Superelement;

impl RunFiles {
    /// Writes the folder of `dovetail reduce`. Returns the law of its pairs if all have the same.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn reduced_model(&self, reduced: &ReducedScene) -> Result<Option<PairLaw>, RunError> {
        let (problem, rows) = (&reduced.problem, &reduced.pairs.rows);
        let element = Superelement {
            model: ReducedModel::clone(&problem.reduced),
            excitations: named_excitations(&self.scene, reduced),
            contacts: reduced.pairs.named_contacts(),
            positions_m: rows.iter().map(|p| p.position_m).collect(),
            areas_m2: rows.iter().map(|p| p.area_m2).collect(),
        };
        self.folder
            .out
            .list(dovetail_superelement::FILES.map(str::to_owned))?;
        dovetail_superelement::write(self.folder.out.path(), &element)?;
        let first = problem.laws.first().copied();
        Ok(first.filter(|law| problem.laws.iter().all(|other| other == law)))
    }
}

/// Excitations of a reduced model, called by where they act.
fn named_excitations(scene: &Scene, reduced: &ReducedScene) -> Vec<NamedExcitation> {
    let specs = scene.assembly().map_or(&[][..], |a| &a.excitations);
    let name = |spec: &ExcitationSpec| match &spec.kind {
        ExcitationKind::Load(load) => load.on.clone(),
        ExcitationKind::Field { on, .. } => on.clone(),
        ExcitationKind::Base { .. } => "base".to_owned(),
    };
    let bound = reduced.bodies.as_ref().map(Bodies::model);
    let bound = bound.map_or(&[][..], |model| &model.excitations);
    let both = specs.iter().zip(bound);
    both.map(|(spec, excitation)| NamedExcitation::new(name(spec), excitation.in_time))
        .collect()
}
