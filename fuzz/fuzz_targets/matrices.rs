//! A file of matrices of another program, or a table of their rows.

#![no_main]

mod limits;

use std::path::Path;

use dovetail_matrices::{MatrixQuantity, expand_to_rows, parse, parse_rows};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    let path = Path::new("matrices");
    match parse_rows(path, bytes) {
        Ok(rows) => assert!(rows.len() <= bytes.len()),
        Err(error) => assert!(error.to_string().len() < 2_000),
    }
    for name in [None, Some("K")] {
        if let Err(error) = parse(path, bytes).and_then(|m| m.choose(MatrixQuantity::Mass, name)) {
            assert!(error.to_string().len() < 2_000);
        }
    }
    let matrices = match parse(path, bytes).and_then(|matrices| matrices.read_all()) {
        Ok(matrices) => matrices,
        Err(error) => {
            assert!(error.to_string().len() < 2_000);
            return;
        }
    };
    assert!(!matrices.is_empty());
    for found in &matrices {
        let matrix = &found.matrix;
        assert!(
            matrix
                .values()
                .iter()
                .all(|value| value.is_finite() && *value != 0.0)
        );
        if let Some(rows) = &found.rows {
            assert!(rows.len() == matrix.nrows() && rows.len() == matrix.ncols());
            match expand_to_rows(found.clone(), rows) {
                Ok(same) => assert!(same == *matrix),
                // Abaqus' list of nodes may have one twice.
                Err(error) => assert!(error.to_string().contains("each may have one row")),
            }
        }
    }
}
