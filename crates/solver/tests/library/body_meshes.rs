//! Bodies with meshes of their own: placed, copied, with units and materials of decks.

use crate::shared_scenes::*;
use dovetail_mesh::parts::Placement;
use dovetail_mesh::units::Units;
use dovetail_mesh::{ElementType, Mesh};
use dovetail_solver::model::gather::gather;
use dovetail_solver::model::{
    Assembly, BodyMesh, ContactSpec, ExcitationKind, Material, MaterialSpec, MatrixSource, Model,
    ModelError, bind,
};
use dovetail_testkit::block::{block, map_nodes};
use dovetail_testkit::words::has;

const SIZE: [f64; 3] = [3e-3, 2e-3, 1e-3];
const STAY: Placement = Placement {
    axis: [0.0, 0.0, 1.0],
    point_m: [0.0; 3],
    angle_rad: 0.0,
    translation_m: [0.0; 3],
};

/// A block with corners at different heights, so that a wrong turn is seen.
fn wedge_shaped() -> Mesh {
    let mut mesh = block(ElementType::HEX20, [3, 2, 1], SIZE);
    map_nodes(&mut mesh, |[x, y, z]| {
        [x, y, z * (1.0 + x / SIZE[0] + 0.5 * y / SIZE[1])]
    });
    mesh
}

/// Block below the other one.
fn support() -> Mesh {
    let mut mesh = block(ElementType::HEX20, [3, 2, 1], SIZE);
    map_nodes(&mut mesh, |[x, y, z]| [x, y, z - SIZE[2]]);
    mesh
}

/// The two blocks, with the groups of `blocks_assembly` called as a scene with own meshes calls
/// them.
fn own_assembly(upper: BodyMesh, lower: BodyMesh) -> Assembly {
    let mut assembly = blocks_assembly();
    assembly.mesh = None;
    for (body, mesh) in assembly.bodies.iter_mut().zip([upper, lower]) {
        body.mesh = mesh;
        body.volume = "volume".into();
    }
    assembly.bodies[1].fixed = vec!["z_min".into()];
    assembly.contacts = vec![ContactSpec {
        first: "upper.z_min".into(),
        second: Some("lower.z_max".into()),
        ..assembly.contacts[0].clone()
    }];
    assembly.excitations[0].kind = ExcitationKind::force("upper.corner_111", [0.0, 1.0, 0.0]);
    assembly.observations[0].points = "upper.corner_111".into();
    assembly
}

fn file(path: &str, placement: Placement) -> BodyMesh {
    BodyMesh::File {
        path: path.into(),
        units: Units::MetresPerUnit(1.0),
        placement,
    }
}

/// Mesh gathered from the files `upper` and `lower`.
fn gathered(assembly: &Assembly, upper: &Mesh, lower: &Mesh) -> Result<Mesh, ModelError> {
    let mut reads = 0;
    let mesh = gather::<ModelError>(assembly, None, &mut |path, _| {
        reads += 1;
        Ok(match path.to_str() {
            Some("upper") => upper.clone(),
            _ => lower.clone(),
        })
    });
    assert!(reads <= 2, "each file is read once");
    mesh
}

/// Model of both bodies without any placement.
fn plain() -> Model {
    let both = two_blocks(&wedge_shaped(), &support());
    bind(&blocks_assembly(), &both, None).unwrap()
}

fn assert_same_model(found: &Model, expected: &Model) {
    assert_eq!(found.pairs.len(), expected.pairs.len());
    for (p, q) in found.pairs.iter().zip(&expected.pairs) {
        assert_vector(p.position_m, q.position_m, 1e-15);
        assert_vector(p.frame[0], q.frame[0], 1e-12);
        assert!((p.area_m2 / q.area_m2 - 1.0).abs() < 1e-9);
    }
    for (p, q) in found.bodies.iter().zip(&expected.bodies) {
        assert_eq!(p.dofs, q.dofs);
        assert!(p.elements.iter().eq(q.elements.iter()));
        for (x, y) in p.nodes_m.iter().zip(&q.nodes_m) {
            assert_vector(*x, *y, 1e-15);
        }
    }
}

#[test]
fn bodies_of_files_of_their_own_are_put_in_place() {
    // The upper block lies turned and moved in its file; the placement takes it back.
    let (angle, move_m) = (0.7, [0.2, -0.1, 0.3]);
    let turn = Placement {
        axis: [0.0, 2.0, 0.0],
        point_m: [0.01, 0.02, -0.03],
        angle_rad: -angle,
        translation_m: [0.0; 3],
    };
    let mut upper = wedge_shaped();
    upper.place(&turn);
    map_nodes(&mut upper, |x| [0, 1, 2].map(|k| x[k] - move_m[k]));
    let back = Placement {
        point_m: [0, 1, 2].map(|k| turn.point_m[k] - move_m[k]),
        angle_rad: angle,
        translation_m: move_m,
        ..turn
    };
    let assembly = own_assembly(file("upper", back), file("lower", STAY));
    let mesh = gathered(&assembly, &upper, &support()).unwrap();
    assert_same_model(&bind(&assembly, &mesh, None).unwrap(), &plain());
    // By the right hand about +y: x goes to -z.
    let quarter = Placement {
        axis: [0.0, 3.0, 0.0],
        angle_rad: std::f64::consts::FRAC_PI_2,
        ..STAY
    };
    assert_vector(quarter.apply([1.0, 2.0, 0.0]), [0.0, 2.0, -1.0], 1e-15);
}

#[test]
fn a_copy_has_the_groups_of_its_original_under_its_own_name() {
    let mut assembly = own_assembly(
        file("upper", STAY),
        BodyMesh::CopyOf {
            body: "upper".into(),
            placement: Placement {
                translation_m: [0.0, 0.0, -SIZE[2]],
                ..STAY
            },
        },
    );
    let straight = block(ElementType::HEX20, [3, 2, 1], SIZE);
    let mesh = gathered(&assembly, &straight, &straight).unwrap();
    let model = bind(&assembly, &mesh, None).unwrap();
    assert_eq!(model.pairs.len(), 12);
    assert_eq!(model.bodies[0].elements, model.bodies[1].elements);
    let low = |model: &Model, body: usize| {
        let z = model.bodies[body].nodes_m.iter().map(|x| x[2]);
        z.fold(f64::INFINITY, f64::min)
    };
    assert!((low(&model, 1) + SIZE[2]).abs() < 1e-18 && low(&model, 0) == 0.0);
    // A group that both have needs the name of its body.
    assert!(mesh.groups.contains_key("lower.x_min") && !mesh.groups.contains_key("x_min"));
    assembly.contacts[0].first = "z_min".into();
    let error = bind(&assembly, &mesh, None).unwrap_err().to_string();
    has(&error, "no group `z_min` & upper.z_min");
}

#[test]
fn a_volume_that_the_file_of_a_body_lacks_is_named_with_those_it_has() {
    let mut assembly = own_assembly(file("upper", STAY), file("lower", STAY));
    assembly.bodies[1].volume = "jaw".into();
    let error = gathered(&assembly, &wedge_shaped(), &support()).unwrap_err();
    let error = error.to_string();
    has(&error, "body `lower`: the mesh has no group `jaw`");
    assert!(error.ends_with("volume"), "{error}");
}

// ------------------------------------------------------------------------------------ materials

/// One cube of one element, of steel in millimetres, tonnes and seconds.
const STEEL_CUBE: &str = "*NODE\n1,0,0,0\n2,2,0,0\n3,2,2,0\n4,0,2,0\n5,0,0,2\n6,2,0,2\n7,2,2,2\n8,0,2,2\n\
    *ELEMENT, TYPE=C3D8, ELSET=cube\n1,1,2,3,4,5,6,7,8\n*NSET, NSET=base\n1,2,3,4\n*NSET, NSET=corner\n7\n\
    *MATERIAL, NAME=Steel\n*ELASTIC\n210000., 0.3\n*DENSITY\n7.85e-9\n\
    *SOLID SECTION, ELSET=cube, MATERIAL=Steel\n";

fn cube(deck: &str, units: Units, material: Option<&str>) -> Result<Model, ModelError> {
    let mut assembly = blocks_assembly();
    assembly.bodies.truncate(1);
    assembly.bodies[0].volume = "cube".into();
    let of_mesh = MaterialSpec::OfMesh(material.map(str::to_owned));
    assembly.bodies[0].matrices = MatrixSource::Elements(of_mesh);
    let contact = &mut assembly.contacts[0];
    (contact.first, contact.second) = ("base".into(), None);
    assembly.excitations[0].kind = ExcitationKind::force("corner", [0.0, 1.0, 0.0]);
    assembly.observations[0].points = "corner".into();
    bind(&assembly, &dovetail_mesh::parse(deck, units).unwrap(), None)
}

#[test]
fn materials_of_a_deck_are_converted_by_its_units() {
    let model = cube(STEEL_CUBE, Units::MillimetreTonneSecond, None).unwrap();
    let Material {
        young_pa,
        poisson,
        density_kg_m3,
    } = model.bodies[0].material().unwrap();
    assert!((young_pa / 210e9 - 1.0).abs() < 1e-15 && poisson == 0.3);
    assert!((density_kg_m3 / 7850.0 - 1.0).abs() < 1e-14);
    let volume = dovetail_solver::fem::mass_properties::mass_properties(&model.bodies[0], None);
    assert!((volume.unwrap().mass_kg / (7850.0 * 8e-9) - 1.0).abs() < 1e-12);
    // In metres the same numbers are another material.
    let raw = cube(STEEL_CUBE, Units::MetreKilogramSecond, Some("Steel")).unwrap();
    assert_eq!(raw.bodies[0].material().unwrap().young_pa, 210000.0);
}

#[test]
fn a_material_that_cannot_be_used_is_named_with_the_remedy() {
    let si = Units::MillimetreTonneSecond;
    let refused = |deck: &str, units: Units, material: Option<&str>, words: &str| {
        has(&cube(deck, units, material).unwrap_err().to_string(), words);
    };
    let unknown = Units::MetresPerUnit(1e-3);
    refused(STEEL_CUBE, unknown, None, "`Steel` & `units` & mm-t-s");
    let words = "none called `Gold` & Steel & young_pa";
    refused(STEEL_CUBE, si, Some("Gold"), words);
    let bare = STEEL_CUBE.split("*SOLID SECTION").next().unwrap();
    refused(bare, si, None, "none to all of its elements & `material`");
    let light = STEEL_CUBE.replace("*DENSITY\n7.85e-9\n", "");
    refused(&light, si, None, "no density (*DENSITY, DENS, MAT1)");
    let rubber = STEEL_CUBE.replace("0.3", "0.5");
    refused(&rubber, si, None, "0.5, not between -1 and 0.5");
    let weightless = STEEL_CUBE.replace("7.85e-9", "0");
    refused(&weightless, si, None, "must be positive");
}
