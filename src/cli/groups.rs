//! `dovetail groups`: the content of a mesh file, before any scene names it.

use std::path::Path;

use super::error::Error;
use crate::console::Console;
use crate::error::RunError;
use crate::mesh_files;
use dovetail_export::warning::{Warning, Weight};
use dovetail_export::words::counted;
use dovetail_mesh::{Group, Mesh};

/// Largest width of a column of names, characters; longer names are not aligned.
const MOST_OF_A_COLUMN: usize = 40;

/// Groups and materials of a mesh file, one line each. Parts of the file that are not read are
/// reported.
///
/// # Errors
/// The file cannot be read.
pub(super) fn list(path: &Path, console: &mut Console) -> Result<String, Error> {
    // Its numbers are shown as they are: one unit of the file is a metre here.
    let mesh = mesh_files::read(path, 1.0).map_err(RunError::from)?;
    for remark in &mesh.remarks {
        console.warning(&Warning {
            weight: Weight::Remark,
            text: format!("mesh: {remark}"),
        });
    }
    Ok(table(&mesh))
}

fn table(mesh: &Mesh) -> String {
    let types = mesh.elements.types();
    let types = types
        .iter()
        .map(|(e, n)| format!("{n} {} of {} nodes", e.shape.plural(), e.nodes()));
    let mut text = types.collect::<Vec<_>>().join(", ") + "\n";
    let axis = |k: usize| {
        let along = mesh.nodes_m.iter().map(|x| x[k]);
        let least = along.clone().fold(f64::INFINITY, f64::min);
        let most = along.fold(f64::NEG_INFINITY, f64::max);
        let [least, most] = [least, most].map(short);
        format!("{} from {least} to {most}", ["x", "y", "z"][k])
    };
    let extents: Vec<String> = (0..3).map(axis).collect();
    text += &format!("{}, in the unit of the file\n", extents.join(", "));
    let mut rows: Vec<[String; 3]> = Vec::new();
    for (dimension, kind) in [(3, "volume"), (2, "surface"), (1, "curve"), (0, "point")] {
        let groups = mesh.groups.iter().filter(|(_, g)| g.dimension == dimension);
        rows.extend(groups.map(|(name, group)| [kind.to_owned(), name.clone(), size(group)]));
    }
    for material in &mesh.materials {
        let properties = [
            ("young", material.young_pa),
            ("poisson", material.poisson),
            ("density", material.density_kg_m3),
        ];
        let words = properties.map(|(what, value)| match value {
            Some(value) => format!(", {what} {}", short(value)),
            None => format!(", no {what}"),
        });
        let size = counted(material.elements.len(), "element", "elements");
        rows.push([
            "material".to_owned(),
            material.name.clone(),
            size + &words.concat(),
        ]);
    }
    let quoted = |name: &str| toml::Value::String(name.to_owned()).to_string();
    let width = rows.iter().map(|row| quoted(&row[1]).chars().count());
    let width = width.max().unwrap_or(0).min(MOST_OF_A_COLUMN);
    for [kind, name, size] in &rows {
        text += &format!("{kind:<9} {:<width$}  {size}\n", quoted(name));
    }
    text
}

/// Number with at most six digits, and no more than it needs.
fn short(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Size of a group: the numbers of its elements or faces and of its nodes.
fn size(group: &Group) -> String {
    let nodes = counted(group.nodes.len(), "node", "nodes");
    let elements = group.elements.len();
    match group.dimension {
        3 => format!("{}, {nodes}", counted(elements, "element", "elements")),
        2 => format!("{}, {nodes}", counted(elements, "face", "faces")),
        _ => nodes,
    }
}
