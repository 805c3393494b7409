//! Studies of meshes in the folders next to a run, and their estimate of the error of its mesh.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Deserialize;

use crate::scene_files::hash_of_file;
use crate::study_file::Study;
use crate::study_file::keys::ParameterKind;
use crate::study_file::quantity::StudyQuantity;
use dovetail_export::manifest::{FlankMeshCheck, Summary};
use dovetail_export::read_json;
use dovetail_export::words::shell_word;

/// Figures of a study that are looked at: peak amplitude and friction power there.
const FIGURES: [&str; 2] = ["peak_amplitude_m", "peak_friction_power_w"];

/// Folder of the answers of studies if nothing else is asked for.
const OUTPUT: &str = "output";
/// Command of a study whose file is to be written.
const UNKNOWN: &str = "dovetail study STUDY.toml";

/// Part of the summary.json of a study that is read here.
#[derive(Debug, Deserialize)]
struct StudyRecord {
    study: String,
    /// Hash of the scene file.
    scene_blake3: Option<String>,
    parameters: Vec<ParameterRecord>,
    refinements: Vec<RefinementRecord>,
}

#[derive(Debug, Deserialize)]
struct ParameterRecord {
    name: String,
    #[serde(default)]
    keys: Vec<String>,
}

/// A numerical parameter through its values, from coarse to fine.
#[derive(Debug, Deserialize)]
struct RefinementRecord {
    parameter: String,
    cases: Vec<String>,
    figures: Vec<FigureRecord>,
}

#[derive(Debug, Deserialize)]
struct FigureRecord {
    figure: String,
    estimated_errors: Vec<Option<f64>>,
    limit: Option<LimitRecord>,
}

#[derive(Debug, Deserialize)]
struct LimitRecord {
    value: f64,
}

/// Errors of the mesh of a run in `folder` by a study in a folder next to it, or in `OUTPUT`. The
/// study must be of the same scene file and have a case with the same mesh. Otherwise the answer has
/// the command of a study.
pub fn check(summary: &Summary, scene_file: &Path, folder: &Path) -> FlankMeshCheck {
    let Some(mesh) = &summary.mesh else {
        return FlankMeshCheck::default();
    };
    let mut not_checked = FlankMeshCheck {
        command: Some(command(scene_file)),
        ..FlankMeshCheck::default()
    };
    let (Ok(scene), Some(mesh)) = (hash_of_file(scene_file), &mesh.origin.blake3) else {
        return not_checked;
    };
    for (place, study) in studies_beside(folder) {
        let refinements = study.mesh_refinements();
        if study.scene_blake3.as_deref() != Some(&scene) || refinements.is_empty() {
            continue;
        }
        let cases = cases_with_mesh(&place, mesh);
        let errors = FIGURES.map(|figure| error(figure, &refinements, &cases));
        let found = FlankMeshCheck::by_study(&study.study, errors);
        if found.peak_error.is_some() {
            return found;
        }
        not_checked.study = Some(study.study);
    }
    not_checked
}

impl StudyRecord {
    /// Refinements of parameters that set keys of the mesh.
    fn mesh_refinements(&self) -> Vec<&RefinementRecord> {
        let sets_mesh = |name: &str| {
            let of_name = self.parameters.iter().filter(|p| p.name == name);
            of_name.flat_map(|p| &p.keys).any(|key| is_of_mesh(key))
        };
        let refinements = self.refinements.iter();
        refinements.filter(|r| sets_mesh(&r.parameter)).collect()
    }
}

fn is_of_mesh(key: &str) -> bool {
    key.starts_with("mesh.")
}

/// Studies in the folder that this folder is in, and in [`OUTPUT`], in the order of their names.
fn studies_beside(folder: &Path) -> Vec<(PathBuf, StudyRecord)> {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = absolute(folder);
    let mut places: Vec<PathBuf> = folder.parent().map(Path::to_owned).into_iter().collect();
    let output = absolute(Path::new(OUTPUT));
    if !places.contains(&output) {
        places.push(output);
    }
    let mut folders: Vec<PathBuf> = places.iter().flat_map(|place| entries(place)).collect();
    folders.retain(|place| *place != folder && place.join("cases").is_dir());
    let read = |place: PathBuf| {
        let study = read_json(&place.join("summary.json"))?;
        Some((place, study))
    };
    folders.into_iter().filter_map(read).collect()
}

/// Entries of a folder in the order of their names; none if it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

/// Names and summaries of the cases of a study whose mesh has this hash.
fn cases_with_mesh(study: &Path, mesh: &str) -> Vec<(String, Summary)> {
    let case = |folder: PathBuf| {
        let summary: Summary = read_json(&folder.join("summary.json"))?;
        let hash = summary.mesh.as_ref()?.origin.blake3.as_deref();
        let name = folder.file_name()?.to_string_lossy().into_owned();
        (hash == Some(mesh)).then_some((name, summary))
    };
    let folders = entries(&study.join("cases")).into_iter();
    folders.filter_map(case).collect()
}

/// Largest error of a figure of these cases: as the refinements estimate it, or for cases that
/// belong to none of them the distance from the limit.
fn error(
    figure: &str,
    refinements: &[&RefinementRecord],
    cases: &[(String, Summary)],
) -> Option<f64> {
    let quantity = StudyQuantity::from_str(figure).ok()?;
    let (mut estimated, mut distances) = (Vec::new(), Vec::new());
    for refinement in refinements {
        let found = refinement.figures.iter().find(|f| f.figure == figure);
        let Some(found) = found else { continue };
        for (case, summary) in cases {
            let place = refinement.cases.iter().position(|name| name == case);
            let value = quantity.figures(summary).first().map(|(_, value)| *value);
            match (place, value, &found.limit) {
                (Some(place), ..) => {
                    estimated.extend(found.estimated_errors.get(place).copied().flatten());
                }
                (None, Some(value), Some(limit)) => {
                    distances.push((value - limit.value).abs() / limit.value.abs());
                }
                _ => {}
            }
        }
    }
    let errors = if estimated.is_empty() {
        distances
    } else {
        estimated
    };
    errors
        .into_iter()
        .reduce(f64::max)
        .filter(|e| e.is_finite())
}

/// Command of a study of the mesh of a scene. The study file is looked for next to the scene, in a
/// folder `studies` there, and in such a folder one level up.
fn command(scene_file: &Path) -> String {
    let of_scene = scene_file.parent().filter(|of| *of != Path::new(""));
    let (of_scene, up) = match of_scene {
        Some(of_scene) => (of_scene, of_scene.parent().unwrap_or(of_scene)),
        None => (Path::new("."), Path::new("..")),
    };
    let near = [
        of_scene.to_owned(),
        of_scene.join("studies"),
        up.join("studies"),
    ];
    let files = near.iter().flat_map(|folder| entries(folder));
    let mut files = files.filter(|file| file.extension().is_some_and(|e| e == "toml"));
    match files.find(|file| varies_mesh(file, scene_file)) {
        Some(file) => format!("dovetail study {}", shell_word(&file.display().to_string())),
        None => UNKNOWN.to_owned(),
    }
}

/// Returns `true` if a file has a study that varies the mesh of this scene.
fn varies_mesh(file: &Path, scene_file: &Path) -> bool {
    let Ok(study) = Study::read(file, &[]) else {
        return false;
    };
    let [of_study, own] = [&study.scene, scene_file].map(|path| path.canonicalize().ok());
    // Values of a physical parameter have no error.
    let numerical = study.parameters.iter();
    let mut numerical = numerical.filter(|of| of.kind == ParameterKind::Numerical);
    of_study.is_some()
        && of_study == own
        && numerical.any(|parameter| parameter.keys().into_iter().any(is_of_mesh))
}
