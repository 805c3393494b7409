//! A study as a Snakemake workflow: the Snakefile is the same for all studies, cases.json lists the
//! jobs. The meshes and reduced models that several cases share are jobs of their own, which put
//! them into the cache of the cases.

use std::collections::HashSet;
use std::path::Path;

use serde_json::json;

use super::cases::Case;
use super::error::StudyError;
use super::folder::{Plan, write_json};
use super::quantity::BLADE_FREQUENCY;
use crate::commands::pieces::{mesh_inputs, reduction_inputs};
use crate::export::write_file;
use crate::scene;

const SNAKEFILE: &str = include_str!("../../workflow/Snakefile");
/// Words for the two kinds of shared inputs.
const MESH: &str = "mesh";
const REDUCTION: &str = "reduction";

/// One shared input.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Name of its folder: `mesh_1`, `reduction_2`.
    pub name: String,
    kind: &'static str,
    /// First case that needs it.
    case: Case,
    /// Name of the shared input that has to be made before it.
    needs: Option<String>,
}

/// All shared inputs, each after the one that it needs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pieces {
    pub all: Vec<Piece>,
    /// Name of the shared input that each case needs; empty if nothing is shared.
    of_case: Vec<Option<String>>,
}

impl Pieces {
    /// `needed`: numbers of the mesh and of the reduction that each case needs.
    fn shared(cases: &[Case], needed: &[(Option<usize>, Option<usize>)]) -> Self {
        let mut pieces = Self::default();
        // Kind and number of each piece.
        let mut made: Vec<(&'static str, usize)> = Vec::new();
        for (case, &(mesh, reduction)) in cases.iter().zip(needed) {
            let of_mesh = needed.iter().filter(|n| n.0 == mesh).map(|n| n.1);
            let is_shared = of_mesh.collect::<HashSet<_>>().len() > 1;
            let mesh = mesh.filter(|_| is_shared).map(|m| (MESH, m));
            let is_shared = needed.iter().filter(|n| n.1 == reduction).count() > 1;
            let reduction = reduction.filter(|_| is_shared).map(|r| (REDUCTION, r));
            let mut needs = None;
            for (kind, number) in mesh.into_iter().chain(reduction) {
                let at = position(&mut made, (kind, number));
                if at == pieces.all.len() {
                    let of_kind = made.iter().filter(|(k, _)| *k == kind).count();
                    pieces.all.push(Piece {
                        name: format!("{kind}_{of_kind}"),
                        kind,
                        case: case.clone(),
                        needs,
                    });
                }
                needs = Some(pieces.all[at].name.clone());
            }
            pieces.of_case.push(needs);
        }
        pieces
    }
}

impl Piece {
    /// Words of the command line that put it into the cache.
    pub fn command(&self, plan: &Plan, folder: &Path) -> Vec<String> {
        let study = &plan.study;
        let words: &[&str] = match self.kind {
            MESH => &["mesh"],
            _ if study.quantities.contains(&BLADE_FREQUENCY) => {
                &["reduce", "--into-cache", "--held-modes"]
            }
            _ => &["reduce", "--into-cache"],
        };
        let mut command: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        command.insert(1, study.scene.display().to_string());
        command.extend(plan.words(&self.case.set(study), folder));
        command
    }
}

/// Position of an item in a list of distinct items; a new item is appended.
fn position<T: PartialEq>(all: &mut Vec<T>, item: T) -> usize {
    let known = all.iter().position(|known| *known == item);
    known.unwrap_or_else(|| {
        all.push(item);
        all.len() - 1
    })
}

impl Plan {
    /// Meshes that are used by two or more reductions, and reductions that are used by two or more
    /// cases.
    ///
    /// # Errors
    /// A case whose scene cannot be read.
    pub fn pieces(&self) -> Result<Pieces, StudyError> {
        let (mut meshes, mut reductions) = (Vec::new(), Vec::new());
        let mut needed = Vec::new();
        for case in &self.cases {
            let scene = scene::load(&self.study.scene, &case.set(&self.study))?;
            needed.push((
                mesh_inputs(&scene).map(|inputs| position(&mut meshes, inputs)),
                reduction_inputs(&scene).map(|inputs| position(&mut reductions, inputs)),
            ));
        }
        Ok(Pieces::shared(&self.cases, &needed))
    }

    /// Writes `folder`/Snakefile and `folder`/cases.json for this study file and these overrides of
    /// the command line.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn export(
        &self,
        folder: &Path,
        study_file: &Path,
        overrides: &[String],
        pieces: &Pieces,
    ) -> Result<(), StudyError> {
        // Absolute, so that the workflow runs from any folder.
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let set = overrides.iter().flat_map(|set| ["--set", set]);
        let cache = self.cache.iter().map(String::as_str);
        // Name of the job, and of the shared input that it waits for.
        let job = |name: &String, needs: Option<&Option<String>>| json!({ "name": name, "needs": Vec::from_iter(needs.into_iter().flatten()) });
        let of_pieces = pieces.all.iter().map(|p| job(&p.name, Some(&p.needs)));
        let cases = self.cases.iter().enumerate();
        let of_cases = cases.map(|(i, case)| job(&case.slug, pieces.of_case.get(i)));
        let study = json!({
            "study": absolute(study_file),
            "out": absolute(&self.out),
            "arguments": set.chain(cache).collect::<Vec<_>>(),
            "threads": self.threads,
            "pieces": of_pieces.collect::<Vec<_>>(),
            "cases": of_cases.collect::<Vec<_>>(),
        });
        write_json(&folder.join("cases.json"), &study)?;
        Ok(write_file(&folder.join("Snakefile"), SNAKEFILE.as_bytes())?)
    }
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
        let needs = pieces.all.iter().map(|p| p.needs.as_deref());
        assert!(needs.eq([None, Some("mesh_1"), None]));
        let [mesh, one, two] = [names[0], names[1], names[2]].map(Some);
        let needs = pieces.of_case.iter().map(Option::as_deref);
        assert!(needs.eq([one, one, mesh, two, two, None]));
        let makers: Vec<&str> = pieces.all.iter().map(|p| p.case.slug.as_str()).collect();
        assert_eq!(makers, ["c0", "c0", "c3"]);
    }

    #[test]
    fn without_a_mesh_nothing_is_shared() {
        let pieces = Pieces::shared(&cases(2), &[(None, None); 2]);
        assert_eq!((pieces.all.len(), pieces.of_case), (0, vec![None, None]));
    }
}
