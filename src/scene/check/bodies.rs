//! Checks `[[body]]` and `[rotation]`.

use std::f64::consts::PI;
use std::path::Path;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use super::mesh::units;
use crate::scene::entries::{RawBody, RawContact, RawRotation, RawScene};
use crate::scene::error::SceneFault;
use crate::scene::keys;
use crate::scene::raw::{Located, Numbers};
use dovetail_mesh::parts::Placement;
use dovetail_mesh::units::Units;
use dovetail_solver::model::{
    BodyMesh, BodySpec, Material, MaterialSpec, MatrixFile, MatrixFiles, MatrixSource,
    RotationSpec, Strength,
};

/// Checks the bodies. `units` are those of `[mesh]`.
pub fn bodies(
    checker: &mut Checker,
    base_dir: &Path,
    scene: &RawScene,
    units: Option<Units>,
) -> Option<Vec<BodySpec>> {
    let raw = scene.body.as_slice();
    let mut specs: Vec<Option<BodySpec>> = Vec::new();
    for (i, table) in raw.iter().enumerate() {
        let context = Context {
            base_dir,
            scene,
            units,
            before: &specs,
        };
        let spec = body(checker, i, table, &context);
        specs.push(spec);
    }
    let Some(last) = raw.last() else {
        let end = checker.source.text.len();
        checker.fault(end..end, SceneFault::NoBody);
        return None;
    };
    let is_fixed = |b: &Spanned<RawBody>| {
        let RawBody {
            fixed,
            fixed_x,
            fixed_y,
            fixed_z,
            copy_of,
            stiffness_file,
            ..
        } = b.get_ref();
        let groups = [fixed, fixed_x, fixed_y, fixed_z].into_iter().flatten();
        // Supports may be in the matrices of another program.
        copy_of.is_some()
            || stiffness_file.is_some()
            || groups.into_iter().any(|g| !g.get_ref().is_empty())
    };
    let on_ground = |c: &Spanned<RawContact>| c.get_ref().second.is_none();
    let grounded = scene.spring.iter().any(|s| s.get_ref().second.is_none());
    let rests = scene.contact.iter().any(on_ground) || grounded;
    if !raw.iter().any(is_fixed) && !rests {
        checker.fault(last.span(), SceneFault::NothingFixed);
    }
    let located = |key: &str, i: usize, value: &Located<String>| {
        let value = value.as_ref()?;
        Some((
            format!("body.{i}.{key}"),
            value.get_ref().clone(),
            value.span(),
        ))
    };
    let numbered = || raw.iter().map(Spanned::get_ref).enumerate();
    let names = numbered().filter_map(|(i, b)| located("name", i, &b.name));
    // In meshes of their own bodies may have volumes of the same name.
    let shared = numbered().filter(|(_, b)| b.mesh_file.is_none() && b.copy_of.is_none());
    let volumes: Vec<_> = shared
        .filter_map(|(i, b)| located("volume", i, &b.volume))
        .collect();
    checker.distinct(&names.collect::<Vec<_>>());
    checker.distinct(&volumes);
    specs.into_iter().collect()
}

/// Context of the check of a body.
struct Context<'a> {
    base_dir: &'a Path,
    scene: &'a RawScene,
    /// Units of `[mesh]`.
    units: Option<Units>,
    /// Bodies before it in the file.
    before: &'a [Option<BodySpec>],
}

fn body(
    checker: &mut Checker,
    index: usize,
    raw: &Spanned<RawBody>,
    context: &Context,
) -> Option<BodySpec> {
    let at = SceneTable::new("body", raw.span(), Some((index, &raw.get_ref().name)));
    let raw = raw.get_ref();
    let name = checker.required_name(&at, &raw.name);
    let mesh = body_mesh(checker, &at, raw, context);
    let original = match &mesh {
        Some(BodyMesh::CopyOf { body, .. }) => {
            let named = |b: &&BodySpec| b.name == *body;
            context.before.iter().flatten().find(named)
        }
        _ => None,
    };
    let volume = match (&raw.volume, original) {
        (None, Some(original)) => Some(original.volume.clone()),
        (volume, _) => checker.text(&at, "volume", volume),
    };
    let matrices = matrices(checker, &at, raw, (mesh.as_ref(), original), context);
    let strength = match (places!(raw; endurance_pa, ultimate_pa), original) {
        (given, Some(original)) if given.iter().all(|(_, span)| span.is_none()) => {
            Some(original.strength)
        }
        _ => strength(checker, &at, raw),
    };
    let key = "fixed_interface_modes";
    let modes = match (&raw.fixed_interface_modes, original) {
        (None, original) => Some(original.and_then(|o| o.fixed_interface_modes)),
        (given, _) => checker.optional_count(&at, key, given, None),
    };
    let mut supports =
        |key, given: &Located<Vec<Spanned<String>>>, of: &dyn Fn(&BodySpec) -> Vec<String>| match (
            given, original,
        ) {
            (None, Some(original)) => of(original),
            (given, _) => groups(checker, &at, key, given),
        };
    let fixed = supports("fixed", &raw.fixed, &|o| o.fixed.clone());
    let fixed_along = [
        supports("fixed_x", &raw.fixed_x, &|o| o.fixed_along[0].clone()),
        supports("fixed_y", &raw.fixed_y, &|o| o.fixed_along[1].clone()),
        supports("fixed_z", &raw.fixed_z, &|o| o.fixed_along[2].clone()),
    ];
    Some(BodySpec {
        name: name?,
        mesh: mesh?,
        volume: volume?,
        matrices: matrices?,
        fixed,
        fixed_along,
        fixed_interface_modes: modes?,
        strength: strength?,
    })
}

/// Strength of the material, where it is given.
fn strength(checker: &mut Checker, at: &SceneTable, raw: &RawBody) -> Option<Option<Strength>> {
    let remedy = "give both, or leave both out: the use of a strength needs the two";
    let (endurance, ultimate) = match (&raw.endurance_pa, &raw.ultimate_pa) {
        (None, None) => return Some(None),
        (Some(endurance), Some(ultimate)) => (endurance, ultimate),
        (Some(alone), None) => {
            checker.note_missing_partner(at, "endurance_pa", "ultimate_pa", alone.span(), remedy);
            return None;
        }
        (None, Some(alone)) => {
            checker.note_missing_partner(at, "ultimate_pa", "endurance_pa", alone.span(), remedy);
            return None;
        }
    };
    if let Some(file) = &raw.stiffness_file {
        let remedy = "leave the strength out: matrices of another program have no stress here, that \
                      program has it";
        let both = [endurance, ultimate].map(Spanned::span);
        let keys = ["endurance_pa", "ultimate_pa"]
            .into_iter()
            .zip(both.map(Some));
        checker.exclude(
            at,
            ("stiffness_file", file.span()),
            &keys.collect::<Vec<_>>(),
            remedy,
        )?;
    }
    let endurance_pa = checker.number(at, "endurance_pa", &raw.endurance_pa)?;
    let ultimate_pa = checker.number(at, "ultimate_pa", &raw.ultimate_pa)?;
    Some(Some(Strength {
        endurance_pa,
        ultimate_pa,
    }))
}

/// Mesh file of the body itself, or another body that it copies, and its placement.
fn body_mesh(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawBody,
    context: &Context,
) -> Option<BodyMesh> {
    if let Some(file) = &raw.mesh_file {
        let remedy = "keep `mesh_file` (a mesh of its own) or `copy_of` (that of another body)";
        let file = ("mesh_file", file.span());
        checker.exclude(at, file, &places!(raw; copy_of), remedy)?;
    }
    if raw.mesh_file.is_none() && raw.copy_of.is_none() {
        let of_own_mesh = places!(
            raw;
            rotation_deg, rotation_axis, rotation_point_m, translation_m, metres_per_unit, units
        );
        for (key, span) in of_own_mesh {
            let remedy = "name a mesh of the body's own by `mesh_file`, or leave it out: a body of the shared mesh \
                          stands where that has it";
            if let Some(span) = span {
                checker.note_missing_partner(at, key, "mesh_file", span, remedy);
            }
        }
        return Some(BodyMesh::Shared);
    }
    let placement = placement(checker, at, raw);
    let units_given = units(checker, at, &raw.metres_per_unit, &raw.units);
    if let Some(original) = &raw.copy_of {
        let name = checker.text(at, "copy_of", &raw.copy_of)?;
        let names = context
            .scene
            .body
            .iter()
            .filter_map(|b| b.get_ref().name.as_ref());
        let names: Vec<String> = names.map(|n| n.get_ref().clone()).collect();
        let before = &names[..context.before.len().min(names.len())];
        if !before.contains(&name) {
            let fault = SceneFault::UnknownBody {
                path: at.key("copy_of"),
                nearest: keys::nearest(&name, before),
                name,
                bodies: before.to_vec(),
            };
            checker.fault(original.span(), fault);
            return None;
        }
        return Some(BodyMesh::CopyOf {
            body: name,
            placement: placement?,
        });
    }
    let path = checker.text(at, "mesh_file", &raw.mesh_file);
    let units = units_given?.or(context.units);
    if units.is_none() {
        checker.require_one_of(at, &["units", "metres_per_unit"], "units");
    }
    Some(BodyMesh::File {
        path: context.base_dir.join(path?),
        units: units?,
        placement: placement?,
    })
}

fn placement(checker: &mut Checker, at: &SceneTable, raw: &RawBody) -> Option<Placement> {
    let degrees = checker.number(at, "rotation_deg", &raw.rotation_deg);
    let axis = match (&raw.rotation_deg, &raw.rotation_axis) {
        (None, None) => Some([0.0, 0.0, 1.0]),
        (_, axis) => checker.direction(at, "rotation_axis", axis),
    };
    let vector = |given: &Located<Numbers<3>>| given.as_ref().map_or([0.0; 3], |v| v.get_ref().0);
    Some(Placement {
        axis: axis?,
        point_m: vector(&raw.rotation_point_m),
        angle_rad: degrees?.to_radians(),
        translation_m: vector(&raw.translation_m),
    })
}

/// Matrices of another program, or finite elements of a material.
fn matrices(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawBody,
    (mesh, original): (Option<&BodyMesh>, Option<&BodySpec>),
    context: &Context,
) -> Option<MatrixSource> {
    let Some(stiffness) = &raw.stiffness_file else {
        let others = places!(
            raw;
            mass_file, rows_file, load_file, stiffness_name, mass_name, load_name
        );
        for (key, span) in others {
            let remedy = "name the file of the stiffness, or leave it out: finite elements have no such file";
            if let Some(span) = span {
                checker.note_missing_partner(at, key, "stiffness_file", span, remedy);
            }
        }
        return match original.map(|original| &original.matrices) {
            Some(matrices @ (MatrixSource::Files(_) | MatrixSource::Given(_))) => {
                Some(matrices.clone())
            }
            Some(MatrixSource::Elements(of)) => {
                material(checker, at, raw, Some(of), context).map(MatrixSource::Elements)
            }
            None => material(checker, at, raw, None, context).map(MatrixSource::Elements),
        };
    };
    let remedy = "keep the matrices of another program or the material of finite elements";
    let material = places!(raw; material, young_pa, poisson, density_kg_m3, mass_kg);
    checker.exclude(at, ("stiffness_file", stiffness.span()), &material, remedy)?;
    let mut text = |key: &'static str, value: &Located<String>| match value {
        None => Some(None),
        Some(_) => checker.text(at, key, value).map(Some),
    };
    let stiffness_name = text("stiffness_name", &raw.stiffness_name);
    let mass_name = text("mass_name", &raw.mass_name);
    let rows = text("rows_file", &raw.rows_file);
    let load_name = text("load_name", &raw.load_name);
    let load = text("load_file", &raw.load_file);
    if let (Some(name), None) = (&raw.load_name, &raw.load_file) {
        let remedy = "name the file of the load, or leave it out";
        checker.note_missing_partner(at, "load_name", "load_file", name.span(), remedy);
    }
    let stiffness_path = checker.text(at, "stiffness_file", &raw.stiffness_file);
    let mass_path = checker.text(at, "mass_file", &raw.mass_file);
    let units = units_of(mesh?, context)?;
    if units.stress_pa_and_density_kg_m3().is_none() {
        let remedy = "give `units` (\"m-kg-s\", \"mm-t-s\" or \"in-lbf-s\") of the mesh in place of metres_per_unit: the matrices are \
                      in the same units, and a length alone says nothing about forces and masses";
        checker.note_missing_partner(at, "stiffness_file", "units", stiffness.span(), remedy);
        return None;
    }
    let file = |path, name| MatrixFile {
        path: context.base_dir.join(path),
        name,
    };
    Some(MatrixSource::Files(MatrixFiles {
        stiffness: file(stiffness_path?, stiffness_name?),
        mass: file(mass_path?, mass_name?),
        rows: rows?.map(|path| context.base_dir.join(path)),
        load: match load? {
            Some(path) => Some(file(path, load_name?)),
            None => None,
        },
        units,
    }))
}

/// Units of the mesh of a body.
fn units_of(mesh: &BodyMesh, context: &Context) -> Option<Units> {
    match mesh {
        BodyMesh::Shared => context.units,
        BodyMesh::File { units, .. } => Some(*units),
        BodyMesh::CopyOf { body, .. } => {
            let original = context.before.iter().flatten().find(|b| b.name == *body)?;
            units_of(&original.mesh, context)
        }
    }
}

/// Material given by numbers, or a material of the mesh; without either, that of `original`.
fn material(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawBody,
    original: Option<&MaterialSpec>,
    context: &Context,
) -> Option<MaterialSpec> {
    let inertia = match &raw.mass_kg {
        Some(mass) => {
            let remedy = "keep `density_kg_m3` or `mass_kg`: the one follows from the other";
            let density = places!(raw; density_kg_m3);
            checker.exclude(at, ("mass_kg", mass.span()), &density, remedy)?;
            ("mass_kg", &raw.mass_kg)
        }
        None => ("density_kg_m3", &raw.density_kg_m3),
    };
    let numbers = [
        ("young_pa", &raw.young_pa),
        ("poisson", &raw.poisson),
        inertia,
    ];
    if let Some(name) = &raw.material {
        let remedy = "keep `material` (one of the mesh) or the three numbers";
        let given = places!(raw; young_pa, poisson, density_kg_m3, mass_kg);
        checker.exclude(at, ("material", name.span()), &given, remedy)?;
        let name = checker.text(at, "material", &raw.material)?;
        return Some(MaterialSpec::OfMesh(Some(name)));
    }
    if numbers.iter().all(|(_, value)| value.is_none()) {
        if let Some(original) = original {
            return Some(original.clone());
        }
        if may_have_materials(raw, context) {
            return Some(MaterialSpec::OfMesh(None));
        }
    }
    let values = numbers.map(|(key, value)| checker.number(at, key, value));
    let [young_pa, poisson, inertia] = values;
    let (young_pa, poisson, inertia) = (young_pa?, poisson?, inertia?);
    Some(match raw.mass_kg {
        Some(_) => MaterialSpec::OfMass {
            young_pa,
            poisson,
            mass_kg: inertia,
        },
        None => MaterialSpec::Given(Material {
            young_pa,
            poisson,
            density_kg_m3: inertia,
        }),
    })
}

/// Endings of mesh files that may have materials: decks, archives of Ansys, bulk data of Nastran.
const WITH_MATERIALS: [&str; 6] = ["inp", "cdb", "bdf", "nas", "dat", "fem"];

/// Returns `true` if the mesh of a body may have materials, by the ending of its name.
fn may_have_materials(raw: &RawBody, context: &Context) -> bool {
    let shared = context.scene.mesh.as_ref();
    let shared = shared.and_then(|mesh| mesh.get_ref().file.as_ref());
    let file = raw.mesh_file.as_ref().or(shared);
    let ending = file.and_then(|file| Path::new(file.get_ref()).extension());
    ending.is_some_and(|ending| {
        WITH_MATERIALS
            .iter()
            .any(|known| ending.eq_ignore_ascii_case(known))
    })
}

/// Names of groups; an empty name is a fault.
fn groups(
    checker: &mut Checker,
    at: &SceneTable,
    key: &str,
    list: &Located<Vec<Spanned<String>>>,
) -> Vec<String> {
    let groups = list.as_ref().map_or(&[][..], |f| f.get_ref().as_slice());
    for group in groups.iter().filter(|g| g.get_ref().trim().is_empty()) {
        let path = at.key(key);
        checker.fault(group.span(), SceneFault::EmptyText { path });
    }
    groups.iter().map(|g| g.get_ref().clone()).collect()
}

pub fn rotation(
    checker: &mut Checker,
    bodies: &[String],
    raw: &Spanned<RawRotation>,
) -> Option<RotationSpec> {
    let at = SceneTable::new("rotation", raw.span(), None);
    let raw = raw.get_ref();
    let axis = checker.direction(&at, "axis", &raw.axis);
    let speed = checker.number(&at, "speed_rpm", &raw.speed_rpm);
    let prestress = checker.choice(&at, "prestress", &raw.prestress);
    let carried = match &raw.bodies {
        None => bodies.to_vec(),
        Some(list) => {
            let list = list.get_ref();
            for name in list.iter().filter(|n| !bodies.contains(n.get_ref())) {
                let fault = SceneFault::UnknownBody {
                    path: at.key("bodies"),
                    name: name.get_ref().clone(),
                    nearest: keys::nearest(name.get_ref(), bodies),
                    bodies: bodies.to_vec(),
                };
                checker.fault(name.span(), fault);
            }
            let named = list.iter();
            let named: Vec<_> = named
                .map(|n| (at.key("bodies"), n.get_ref().clone(), n.span()))
                .collect();
            checker.distinct(&named);
            named.into_iter().map(|(_, name, _)| name).collect()
        }
    };
    Some(RotationSpec {
        point_m: raw.point_m.as_ref().map_or([0.0; 3], |p| p.get_ref().0),
        axis: axis?,
        speed_rad_s: speed? * 2.0 * PI / 60.0,
        bodies: carried,
        prestress: prestress?,
    })
}
