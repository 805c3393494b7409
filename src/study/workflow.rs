//! A study as a Snakemake workflow: the Snakefile is the same for all studies, cases.json lists the
//! jobs. The meshes and reduced models that several cases share are jobs of their own, which put
//! them into the cache of the cases.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::folder::StudyPlan;
use crate::commands::mesh_inputs;
use crate::scene;
use crate::study_file::StudyError;
use crate::study_file::quantity::BLADE_FREQUENCY;
use dovetail_export::{write_file, write_json};
use dovetail_solver::run::PlannedReduction;

const SNAKEFILE: &str = include_str!("../../workflow/Snakefile");
/// Words for the two kinds of shared inputs.
const MESH: &str = "mesh";
const REDUCTION: &str = "reduction";

/// One shared input.
#[derive(Debug, Clone, PartialEq)]
struct WorkflowPiece {
    /// Name of its folder: `mesh_1`, `reduction_2`.
    name: String,
    kind: &'static str,
    /// First case that needs it.
    case: usize,
    /// Name of the shared input that has to be made before it.
    needs: Option<String>,
}

/// Shared inputs, each after the one that it needs, and the name of the one that each case needs.
/// `needed`: numbers of the mesh and of the reduction that each case needs.
fn shared(needed: &[[Option<usize>; 2]]) -> (Vec<WorkflowPiece>, Vec<Option<String>>) {
    let mut pieces: Vec<WorkflowPiece> = Vec::new();
    let of_cases = needed.iter().enumerate().map(|(case, &[mesh, reduction])| {
        let of_mesh = needed.iter().filter(|n| n[0] == mesh).map(|n| n[1]);
        let of_mesh = of_mesh.collect::<HashSet<_>>().len();
        let of_reduction = needed.iter().filter(|n| n[1] == reduction).count();
        let mut needs = None;
        for (kind, number, users) in [(MESH, mesh, of_mesh), (REDUCTION, reduction, of_reduction)] {
            let Some(number) = number.filter(|_| users > 1) else {
                continue;
            };
            let name = format!("{kind}_{}", number + 1);
            if pieces.iter().all(|piece| piece.name != name) {
                pieces.push(WorkflowPiece {
                    name: name.clone(),
                    kind,
                    case,
                    needs,
                });
            }
            needs = Some(name);
        }
        needs
    });
    let of_cases = of_cases.collect();
    (pieces, of_cases)
}

/// Position of an item in a list of distinct items; a new item is appended.
fn position<T: PartialEq>(all: &mut Vec<T>, item: T) -> usize {
    let known = all.iter().position(|known| *known == item);
    known.unwrap_or_else(|| {
        all.push(item);
        all.len() - 1
    })
}

/// Absolute path, so that the workflow runs from any folder.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

impl StudyPlan {
    /// Numbers of the mesh and of the reduction that each case needs and can share.
    fn needed(&self) -> Result<Vec<[Option<usize>; 2]>, StudyError> {
        let (mut meshes, mut reductions) = (Vec::new(), Vec::new());
        let needed = self.cases.iter().map(|case| {
            let scene = scene::load(&self.study.scene, &case.set(&self.study))?;
            Ok([
                mesh_inputs(&scene).map(|inputs| position(&mut meshes, inputs)),
                PlannedReduction::from_scene(&scene)
                    .map(|inputs| position(&mut reductions, inputs)),
            ])
        });
        needed.collect()
    }

    /// Words after the name of the program that put a shared input into the cache.
    fn making(&self, piece: &WorkflowPiece) -> Vec<String> {
        let study = &self.study;
        let scene = absolute(&study.scene).display().to_string();
        let words: &[&str] = match piece.kind {
            MESH => &["mesh", &scene],
            _ if study.quantities.contains(&BLADE_FREQUENCY) => {
                &["reduce", &scene, "--into-cache", "--held-modes"]
            }
            _ => &["reduce", &scene, "--into-cache"],
        };
        let folder = absolute(&self.out).join("pieces").join(&piece.name);
        let words = words.iter().map(|word| (*word).to_owned());
        let options = self.words(&self.cases[piece.case].set(study), &folder);
        words.chain(options).collect()
    }

    /// Writes `folder`/Snakefile and `folder`/cases.json for this study file and these overrides of
    /// the command line. Meshes that two or more reductions use, and reductions that two or more
    /// cases use, are made once if the cases have a cache. Returns their number.
    ///
    /// # Errors
    /// A case whose scene cannot be read, a file that cannot be written.
    pub fn export(
        &self,
        folder: &Path,
        study_file: &Path,
        overrides: &[String],
    ) -> Result<usize, StudyError> {
        let needed = if self.cache.len() > 1 {
            self.needed()?
        } else {
            vec![[None; 2]; self.cases.len()]
        };
        let (pieces, of_cases) = shared(&needed);
        let set = overrides.iter().flat_map(|set| ["--set", set]);
        let cache = self.cache.iter().map(String::as_str);
        let pieces = pieces.iter().map(|piece| {
            let needs = Vec::from_iter(&piece.needs);
            json!({ "name": piece.name, "needs": needs, "command": self.making(piece) })
        });
        let pieces: Vec<_> = pieces.collect();
        let cases = self.cases.iter().zip(&of_cases);
        let cases =
            cases.map(|(case, needs)| json!({ "name": case.slug, "needs": Vec::from_iter(needs) }));
        let study = json!({
            "study": absolute(study_file),
            "out": absolute(&self.out),
            "arguments": set.chain(cache).collect::<Vec<_>>(),
            "threads": self.threads,
            "pieces": pieces,
            "cases": cases.collect::<Vec<_>>(),
        });
        write_json(&folder.join("cases.json"), &study)?;
        write_file(&folder.join("Snakefile"), SNAKEFILE.as_bytes())?;
        Ok(pieces.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two speeds of one mesh, one of another: the second mesh has one reduction, which two cases
    /// share.
    #[test]
    fn what_only_one_needs_is_no_piece() {
        let needed = [[0, 0], [0, 0], [0, 1], [1, 2], [1, 2], [2, 3]];
        let (pieces, of_cases) = shared(&needed.map(|needed| needed.map(Some)));
        let names: Vec<&str> = pieces.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["mesh_1", "reduction_1", "reduction_3"]);
        let needs = pieces.iter().map(|p| p.needs.as_deref());
        assert!(needs.eq([None, Some("mesh_1"), None]));
        let [mesh, one, three] = [names[0], names[1], names[2]].map(Some);
        let needs = of_cases.iter().map(Option::as_deref);
        assert!(needs.eq([one, one, mesh, three, three, None]));
        let makers: Vec<usize> = pieces.iter().map(|p| p.case).collect();
        assert_eq!(makers, [0, 0, 3]);
    }

    #[test]
    fn without_a_mesh_nothing_is_shared() {
        assert_eq!(shared(&[[None; 2]; 2]), (vec![], vec![None, None]));
    }
}
