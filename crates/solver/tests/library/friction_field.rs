//! Coefficients of friction of the pairs of a contact from points in space.

use crate::shared_scenes::{blocks_assembly, ready};
use dovetail_mesh::surface_field::{FieldValues, SurfaceField};
use dovetail_solver::model::{Assembly, ExcitationKind, FieldSource, Model, ModelError, bind};

fn bound(assembly: &Assembly) -> Result<Model, ModelError> {
    bind(assembly, &ready("blocks_order2.msh"), None)
}

/// Blocks whose contact has coefficients at points.
fn blocks_with_points(points: &[([f64; 3], f64)]) -> Assembly {
    let mut assembly = blocks_assembly();
    let field = SurfaceField {
        points_m: points.iter().map(|(at, _)| *at).collect(),
        values: FieldValues::Friction(points.iter().map(|(_, friction)| *friction).collect()),
    };
    assembly.contacts[0].pair_law.friction = 0.7;
    assembly.contacts[0].friction_at = Some(FieldSource::Points(field));
    assembly
}

#[test]
fn one_coefficient_at_all_points_is_that_of_the_contact() {
    let mut plain = blocks_assembly();
    plain.contacts[0].pair_law.friction = 0.3;
    let plain = bound(&plain).unwrap();
    let at = plain.pairs[0].position_m;
    let model = bound(&blocks_with_points(&[(at, 0.3)])).unwrap();
    let laws = |model: &Model| model.pairs.iter().map(|pair| pair.law).collect::<Vec<_>>();
    assert_eq!(laws(&model), laws(&plain));
    let [map] = &model.friction_maps[..] else {
        panic!("{:?}", model.friction_maps);
    };
    assert_eq!((map.points, map.range), (1, [0.3, 0.3]));
    assert!((map.mean - 0.3).abs() < 1e-15 && map.largest_distance_m > 0.0);
    assert_eq!(map.contact, "c");
}

#[test]
fn each_pair_has_the_coefficient_of_the_nearest_point() {
    let plain = bound(&blocks_assembly()).unwrap();
    let points: Vec<([f64; 3], f64)> = plain
        .pairs
        .iter()
        .enumerate()
        .map(|(i, pair)| (pair.position_m, 0.1 + 0.01 * i as f64))
        .collect();
    // In another order, a little beside the pairs.
    let mut moved = points.clone();
    moved.reverse();
    moved.iter_mut().for_each(|(at, _)| at[2] += 1e-6);
    let model = bound(&blocks_with_points(&moved)).unwrap();
    for (pair, (_, friction)) in model.pairs.iter().zip(&points) {
        assert_eq!(pair.law.friction, *friction);
    }
    let map = &model.friction_maps[0];
    let area: f64 = model.pairs.iter().map(|pair| pair.area_m2).sum();
    let weighted = model
        .pairs
        .iter()
        .map(|pair| pair.area_m2 * pair.law.friction);
    assert!((map.mean - weighted.sum::<f64>() / area).abs() < 1e-15);
    assert_eq!(map.points, points.len());
    assert!((map.largest_distance_m - 1e-6).abs() < 1e-12);
}

#[test]
fn points_elsewhere_and_fields_of_another_kind_are_refused() {
    let plain = bound(&blocks_assembly()).unwrap();
    // In millimetres.
    let far = plain.pairs[0].position_m.map(|x| 1e3 * x + 1.0);
    let error = bound(&blocks_with_points(&[(far, 0.3)]))
        .unwrap_err()
        .to_string();
    for words in ["contact `c`", "nearest point", "metres"] {
        assert!(error.contains(words), "{error}");
    }
    let mut assembly = blocks_with_points(&[(far, 0.3)]);
    let friction = assembly.contacts[0].friction_at.take().unwrap();
    let mut wrong = assembly.clone();
    let pressures = FieldValues::Pressures {
        pressures_pa: vec![[1.0, 0.0]],
        areas_m2: None,
    };
    wrong.contacts[0].friction_at = Some(FieldSource::Points(SurfaceField {
        points_m: vec![far],
        values: pressures,
    }));
    let error = bound(&wrong).unwrap_err().to_string();
    assert!(
        error.contains("coefficients of friction are expected"),
        "{error}"
    );
    assembly.excitations[0].kind = ExcitationKind::Field {
        on: "upper_bottom".to_owned(),
        field: friction,
    };
    let error = bound(&assembly).unwrap_err().to_string();
    assert!(
        error.contains("pressures or forces are expected"),
        "{error}"
    );
}
