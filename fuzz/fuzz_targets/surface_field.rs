//! A CSV file of points with complex pressures or forces, or coefficients of friction.

#![no_main]

mod limits;

use std::path::Path;

use dovetail_mesh::surface_field::{FieldValues, SurfaceField};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    match SurfaceField::parse(bytes, Path::new("field.csv")) {
        Ok(field) => {
            let count = field.points_m.len();
            let values = match &field.values {
                FieldValues::Friction(coefficients) => {
                    assert!(coefficients.iter().all(|c| c.is_finite() && *c >= 0.0));
                    coefficients.len()
                }
                FieldValues::Forces(forces) => forces.len(),
                FieldValues::Pressures {
                    pressures_pa,
                    areas_m2,
                } => {
                    assert!(areas_m2.as_ref().is_none_or(|areas| areas.len() == count));
                    pressures_pa.len()
                }
            };
            assert!(count > 0 && values == count);
            assert!(field.points_m.iter().flatten().all(|x| x.is_finite()));
        }
        Err(error) => assert!(error.to_string().len() < 20_000),
    }
}
