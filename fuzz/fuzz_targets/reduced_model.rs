//! The folder of a reduced model: its files one after another, each behind a line `=== NAME`, are
//! written into a folder of this process and read from there as those of a user.

#![no_main]

mod limits;

use std::path::PathBuf;
use std::sync::LazyLock;

use dovetail_mesh::text;
use dovetail_solver::reduced::ReducedModel;
use dovetail_superelement::FILES;

const MARK: &[u8] = b"=== ";

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("dovetail-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the files is made");
    folder
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    write(bytes);
    match dovetail_superelement::read(&FOLDER) {
        Ok(element) => {
            check(&element.model);
            assert_eq!(element.positions_m.len(), element.model.pairs());
            assert!(element.positions_m.iter().flatten().all(|x| x.is_finite()));
            let areas = element.areas_m2.iter().flatten();
            assert!(areas.clone().all(|a| *a > 0.0 && a.is_finite()));
        }
        Err(error) => {
            text::plain(&error.to_string());
        }
    }
}

/// Writes the files of the input and removes those that it does not have.
fn write(bytes: &[u8]) {
    let mut found: [Option<Vec<u8>>; FILES.len()] = Default::default();
    let mut file = None;
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        if let Some(name) = line.strip_prefix(MARK) {
            let name = name.trim_ascii();
            file = FILES.iter().position(|f| f.as_bytes() == name);
            if let Some(file) = file {
                found[file] = Some(Vec::new());
            }
        } else if let Some(content) = file.and_then(|file: usize| found[file].as_mut()) {
            content.extend_from_slice(line);
        }
    }
    for (name, content) in FILES.iter().zip(found) {
        let path = FOLDER.join(name);
        match content {
            Some(content) => std::fs::write(&path, content).expect("a file is written"),
            None if path.exists() => std::fs::remove_file(&path).expect("a file is removed"),
            None => {}
        }
    }
}

/// Every array has its shape, and every number is finite.
fn check(model: &ReducedModel) {
    let (n, m) = (3 * model.pairs(), model.omega2.len());
    for (a, rows, columns) in [
        (&model.stiffness, n, n),
        (&model.mass, n, n),
        (&model.coupling, n, m),
    ] {
        assert_eq!((a.nrows(), a.ncols()), (rows, columns));
        assert!((0..columns).all(|j| a.col_as_slice(j).iter().all(|x| x.is_finite())));
    }
    for load in model.unit_loads.iter().chain([&model.static_load]) {
        assert_eq!((load.on_x.len(), load.on_modes.len()), (n, m));
        assert!(
            load.on_x
                .iter()
                .chain(&load.on_modes)
                .all(|f| f.is_finite())
        );
    }
    for point in &model.observations {
        assert_eq!((point.on_x.len(), point.on_modes.len()), (n, m));
    }
    assert!(model.omega2.iter().all(|w2| *w2 > 0.0 && w2.is_finite()));
}
