//! Inputs that several cases of a study share: meshes and reduced models. On a cluster each is a
//! job of its own, which puts it into the cache that the cases share.

use std::path::PathBuf;

use super::cases::Case;
use super::error::StudyError;
use super::file::Study;
use super::folder::Settings;
use super::quantity::BLADE_FREQUENCY;
use crate::commands::pieces::{MeshInputs, ReductionInputs, mesh_inputs, reduction_inputs};
use crate::scene;

/// Kind of a shared input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Mesh,
    Reduction,
}

/// One shared input.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Name of its folder: `mesh_1`, `reduction_2`.
    pub name: String,
    pub kind: Kind,
    /// First case that needs it.
    case: Case,
    /// Position of the shared input that has to be made before it.
    pub needs: Option<usize>,
}

/// All shared inputs, each after the one that it needs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pieces {
    pub all: Vec<Piece>,
    /// Position of the shared input that each case needs.
    pub of_case: Vec<Option<usize>>,
}

impl Pieces {
    /// Meshes that are used by two or more reductions, and reductions that are used by two or more
    /// cases.
    ///
    /// # Errors
    /// A case whose scene cannot be read.
    pub fn of(study: &Study, cases: &[Case]) -> Result<Self, StudyError> {
        let mut meshes: Vec<MeshInputs> = Vec::new();
        let mut reductions: Vec<ReductionInputs> = Vec::new();
        let mut needed: Vec<(Option<usize>, Option<usize>)> = Vec::new();
        for case in cases {
            let scene = scene::load(&study.scene, &case.set(study))?;
            let mesh = mesh_inputs(&scene).map(|inputs| position(&mut meshes, inputs));
            let reduction =
                reduction_inputs(&scene).map(|inputs| position(&mut reductions, inputs));
            needed.push((mesh, reduction));
        }
        Ok(Self::shared(cases, &needed))
    }

    /// `needed`: numbers of the mesh and of the reduction that each case needs.
    fn shared(cases: &[Case], needed: &[(Option<usize>, Option<usize>)]) -> Self {
        let mut pieces = Self::default();
        let mut made: Vec<((Kind, usize), usize)> = Vec::new();
        let made_of = |mesh: usize| {
            let mut reductions: Vec<Option<usize>> = needed
                .iter()
                .filter(|n| n.0 == Some(mesh))
                .map(|n| n.1)
                .collect();
            reductions.sort_unstable();
            reductions.dedup();
            reductions.len()
        };
        let cases_of = |reduction: usize| needed.iter().filter(|n| n.1 == Some(reduction)).count();
        for (case, (mesh, reduction)) in cases.iter().zip(needed) {
            let mut needs = None;
            let wanted = [
                mesh.filter(|m| made_of(*m) > 1).map(|m| (Kind::Mesh, m)),
                reduction
                    .filter(|r| cases_of(*r) > 1)
                    .map(|r| (Kind::Reduction, r)),
            ];
            for key in wanted.into_iter().flatten() {
                let known = made.iter().find(|(k, _)| *k == key).map(|(_, at)| *at);
                needs = Some(known.unwrap_or_else(|| {
                    let number = 1 + made.iter().filter(|((kind, _), _)| *kind == key.0).count();
                    made.push((key, pieces.all.len()));
                    pieces.all.push(Piece::new(key.0, number, case, needs));
                    pieces.all.len() - 1
                }));
            }
            pieces.of_case.push(needs);
        }
        pieces
    }

    /// No shared inputs: each case makes all that it needs.
    pub fn none(cases: &[Case]) -> Self {
        Self {
            all: Vec::new(),
            of_case: vec![None; cases.len()],
        }
    }
}

impl Piece {
    fn new(kind: Kind, number: usize, case: &Case, needs: Option<usize>) -> Self {
        let word = match kind {
            Kind::Mesh => "mesh",
            Kind::Reduction => "reduction",
        };
        Self {
            name: format!("{word}_{number}"),
            kind,
            case: case.clone(),
            needs,
        }
    }

    pub fn folder(&self, settings: &Settings) -> PathBuf {
        settings.out.join("pieces").join(&self.name)
    }

    /// Words of the command line that put it into the cache.
    pub fn command(&self, study: &Study, settings: &Settings) -> Vec<String> {
        let (word, options) = match self.kind {
            Kind::Mesh => ("mesh", &[][..]),
            Kind::Reduction if study.quantities.contains(&BLADE_FREQUENCY) => {
                ("reduce", &["--into-cache", "--held-modes"][..])
            }
            Kind::Reduction => ("reduce", &["--into-cache"][..]),
        };
        let mut command = vec![word.to_owned(), study.scene.display().to_string()];
        command.extend(options.iter().map(|option| (*option).to_owned()));
        command.extend(settings.words(&self.case.set(study), &self.folder(settings)));
        command
    }
}

/// Position of an item in a list of distinct items; a new item is appended.
fn position<T: PartialEq>(all: &mut Vec<T>, item: T) -> usize {
    all.iter()
        .position(|known| *known == item)
        .unwrap_or_else(|| {
            all.push(item);
            all.len() - 1
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cases(count: usize) -> Vec<Case> {
        let case = |i: usize| Case {
            slug: format!("c{i}"),
            values: vec![i],
        };
        (0..count).map(case).collect()
    }

    /// Two speeds of one mesh, one of another: the second mesh has one reduction, which two cases
    /// share.
    #[test]
    fn what_only_one_needs_is_no_piece() {
        let needed = [(0, 0), (0, 0), (0, 1), (1, 2), (1, 2), (2, 3)];
        let needed = needed.map(|(m, r)| (Some(m), Some(r)));
        let pieces = Pieces::shared(&cases(6), &needed);
        let names: Vec<&str> = pieces.all.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["mesh_1", "reduction_1", "reduction_2"]);
        let needs: Vec<Option<usize>> = pieces.all.iter().map(|p| p.needs).collect();
        assert_eq!(needs, [None, Some(0), None]);
        assert_eq!(
            pieces.of_case,
            [Some(1), Some(1), Some(0), Some(2), Some(2), None]
        );
        let makers: Vec<&str> = pieces.all.iter().map(|p| p.case.slug.as_str()).collect();
        assert_eq!(makers, ["c0", "c0", "c3"]);
    }

    #[test]
    fn without_a_mesh_nothing_is_shared() {
        let pieces = Pieces::shared(&cases(2), &[(None, None); 2]);
        assert_eq!((pieces.all.len(), pieces.of_case), (0, vec![None, None]));
    }
}
