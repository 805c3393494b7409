//! Files that other programs wrote, read and held against what is known of them otherwise:
//! formulas, rigid motions, masses and eigenvalues. `tests/data/README.md` says what wrote them.

use std::path::{Path, PathBuf};

use dovetail_matrices::{
    FileMatrices, MatrixQuantity, NamedMatrix, Row, expand_to_rows, parse, parse_rows,
    write_matrix_market,
};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::na::{DMatrix, DVector};

const N: usize = 9;

fn bytes(file: &str) -> (PathBuf, Vec<u8>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(file);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{file}: {error}"));
    (path, bytes)
}

#[track_caller]
fn read(file: &str) -> Vec<NamedMatrix> {
    let (path, bytes) = bytes(file);
    let all = parse(&path, &bytes).and_then(FileMatrices::read_all);
    all.unwrap_or_else(|error| panic!("{error}"))
}

/// The matrix of a name, or the only one.
#[track_caller]
fn matrix(file: &str, name: Option<&str>) -> CscMatrix<f64> {
    let (path, bytes) = bytes(file);
    let matrices = parse(&path, &bytes).unwrap();
    matrices
        .choose(MatrixQuantity::Stiffness, name)
        .unwrap()
        .matrix
}

fn dense(matrix: &CscMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from(matrix)
}

/// Entry of the stiffness of `tests/data/writers.py`.
fn entry(i: usize, j: usize) -> f64 {
    let distance = i.abs_diff(j);
    let is_alone = distance > 0 && (i == 6 || j == 6);
    if ![0, 1, 4].contains(&distance) || is_alone {
        return 0.0;
    }
    (1e5 + 1e4 * (i + j) as f64 / 7.0) / (1.0 + distance as f64)
}

fn stiffness() -> DMatrix<f64> {
    DMatrix::from_fn(N, N, entry)
}

fn unsymmetric() -> DMatrix<f64> {
    DMatrix::from_fn(N, N, |i, j| {
        entry(i, j) + if i < j { entry(i, j) / 4.0 } else { 0.0 }
    })
}

fn mass() -> DMatrix<f64> {
    DMatrix::from_fn(N, N, |i, j| {
        if i == j && i != 4 {
            (i + 1) as f64 / 3.0
        } else {
            0.0
        }
    })
}

/// Checks a matrix of a file to a part of each entry.
#[track_caller]
fn assert_is(file: &str, name: Option<&str>, expected: &DMatrix<f64>, tolerance: f64) {
    let found = dense(&matrix(file, name));
    assert_eq!(found.shape(), expected.shape(), "{file} {name:?}");
    for (found, expected) in found.iter().zip(expected) {
        let error = (found - expected).abs();
        assert!(
            error <= tolerance * expected.abs(),
            "{file} {name:?}: {found} {expected}"
        );
    }
}

#[test]
fn files_of_scipy_have_the_matrices_to_the_bit() {
    assert_is("scipy/coordinate_symmetric.mtx", None, &stiffness(), 0.0);
    assert_is("scipy/coordinate_general.mtx", None, &unsymmetric(), 0.0);
    assert_is("scipy/array_symmetric.mtx", None, &stiffness(), 0.0);
    assert_is("scipy/array_general.mtx", None, &unsymmetric(), 0.0);
    assert_is(
        "scipy/integer.mtx",
        None,
        &stiffness().map(f64::round_ties_even),
        0.0,
    );
    assert_is("scipy/unsymmetric.rua", None, &unsymmetric(), 1e-15);
    for kind in ["dense", "dense_compressed", "sparse", "sparse_compressed"] {
        let file = format!("scipy/{kind}.mat");
        assert_is(&file, None, &stiffness(), 0.0);
        assert_is(&file, Some("U"), &unsymmetric(), 0.0);
        assert_is(&file, Some("MASS"), &mass(), 0.0);
    }
    let (file, single) = ("scipy/single.mat", |value: f64| f64::from(value as f32));
    assert_is(file, Some("K"), &stiffness().map(single), 0.0);
    assert_is(
        file,
        Some("whole"),
        &stiffness().map(f64::round_ties_even),
        0.0,
    );
    assert_is(
        file,
        Some("bytes"),
        &mass().map(|m| f64::from(m > 0.0)),
        0.0,
    );
}

#[test]
fn variables_that_are_no_real_matrices_are_left_out() {
    let names = |file: &str| -> Vec<String> {
        let mut names: Vec<_> = read(file).into_iter().flat_map(|m| m.name).collect();
        names.sort();
        names
    };
    for file in ["scipy/dense.mat", "scipy/dense_compressed.mat"] {
        assert_eq!(names(file), ["K", "MASS", "U", "mode"]);
    }
    for file in ["op4/complex.op4", "op4/complex_little.op4"] {
        assert_eq!(names(file), ["K4"]);
        assert_is(file, None, &stiffness(), 1e-9);
    }
}

#[test]
fn a_variable_that_nobody_asks_for_does_no_harm() {
    for file in ["scipy/others.mat", "scipy/others_compressed.mat"] {
        assert_is(file, None, &stiffness(), 0.0);
        assert_is(file, Some("MASS"), &mass(), 0.0);
        assert_is(file, Some("held"), &mass().map(|m| f64::from(m > 0.0)), 0.0);
        let (path, bytes) = bytes(file);
        let found = || parse(&path, &bytes).unwrap();
        let load = found().column(Some("PA")).unwrap();
        assert_eq!(load[..3], [0.0, 0.125, 0.25]);
        let said = |name| {
            let failure = found().choose(MatrixQuantity::Stiffness, Some(name));
            failure.unwrap_err().to_string()
        };
        for (name, words) in [
            ("gaps", "NaN in `gaps`"),
            ("struct", "`struct` is a structure"),
            ("cell", "`cell` is a cell array"),
            ("Z", "`Z` is complex"),
            ("none", "`none` is empty"),
            ("X", "no matrix is called `X`"),
        ] {
            assert!(said(name).contains(words), "{}", said(name));
        }
        let two = found().column(None).unwrap_err().to_string();
        assert!(two.contains("2 matrices of one column"), "{two}");
        // The last variable is damaged.
        let at = bytes.len() - 30;
        let mut changed = bytes.clone();
        changed[at..].fill(0xff);
        let found = parse(&path, &changed).unwrap();
        let found = found.choose(MatrixQuantity::Mass, None).unwrap();
        assert_eq!(dense(&found.matrix), mass());
    }
}

#[test]
fn files_of_nastran_have_the_matrices_in_every_form() {
    for form in ["dense", "nonbigmat", "bigmat"] {
        for (order, tolerance) in [("", 1e-16), ("_little", 0.0), ("_big", 0.0)] {
            let file = format!("op4/{form}{order}.op4");
            assert_is(&file, None, &stiffness(), tolerance);
            assert_is(&file, Some("U"), &unsymmetric(), tolerance);
            assert_is(&file, Some("MAA"), &mass(), tolerance);
        }
    }
    assert_is("op4/pynastran_single.op4", None, &stiffness(), 1e-7);
    assert_is("op4/pynastran_double.op4", None, &stiffness(), 1e-16);
}

#[test]
fn matrices_of_calculix_are_those_of_a_body() {
    let stiffness = dense(&matrix("calculix/free.sti", None));
    let mass = dense(&matrix("calculix/free.mas", None));
    let (path, text) = bytes("calculix/free.dof");
    let rows = parse_rows(&path, &text).unwrap();
    assert_eq!(rows.len(), 36);
    assert_eq!((stiffness.shape(), mass.shape()), ((36, 36), (36, 36)));
    let largest = stiffness.amax();
    assert!((&stiffness - stiffness.transpose()).amax() == 0.0);
    let mut total = 0.0;
    for axis in 1..=3 {
        let moves = |row: &Row| matches!(row, Row::Node { direction, .. } if *direction == axis);
        let along = DVector::from_iterator(36, rows.iter().map(|row| f64::from(moves(row))));
        let force = (&stiffness * &along).amax() / largest;
        assert!(
            force < 1e-12,
            "force of a rigid motion along {axis}: {force:e} of the largest"
        );
        total += along.dot(&(&mass * &along));
    }
    // 7800 kg/m3 in 1 m x 1 m x 3.5 m, along each of three axes.
    let error = total / (3.0 * 7800.0 * 3.5) - 1.0;
    assert!(error.abs() < 1e-12, "{error:e}");
    // About z, which needs the right node in each row.
    let positions = positions();
    let turned = rows.iter().map(|row| match row {
        Row::Node { node, direction: 1 } => -positions[node][1],
        Row::Node { node, direction: 2 } => positions[node][0],
        _ => 0.0,
    });
    let force = (&stiffness * DVector::from_iterator(36, turned)).amax() / largest;
    assert!(
        force < 1e-12,
        "force of a rotation: {force:e} of the largest"
    );
}

/// Positions of the nodes of the deck.
fn positions() -> std::collections::HashMap<u64, [f64; 2]> {
    let (_, deck) = bytes("calculix/free.inp");
    let deck = String::from_utf8(deck).unwrap();
    let lines = deck
        .lines()
        .skip(1)
        .take_while(|line| !line.starts_with('*'));
    let numbers = lines.map(|line| line.split(',').map(|n| n.parse::<f64>().unwrap()));
    let position = |line: Vec<f64>| (line[0] as u64, [line[1], line[2]]);
    numbers.map(|line| position(line.collect())).collect()
}

#[test]
fn matrices_of_calculix_have_the_eigenvalues_that_it_prints() {
    let stiffness = dense(&matrix("calculix/held.sti", None));
    let mass = dense(&matrix("calculix/held.mas", None));
    let factor = mass.cholesky().unwrap().l();
    let half = factor.solve_lower_triangular(&stiffness).unwrap();
    let whole = factor.solve_lower_triangular(&half.transpose()).unwrap();
    let mut found: Vec<f64> = whole.symmetric_eigenvalues().iter().copied().collect();
    found.sort_by(f64::total_cmp);
    let (_, printed) = bytes("calculix/held.eigenvalues");
    let printed = String::from_utf8(printed).unwrap();
    let printed: Vec<f64> = printed.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(printed.len(), 4);
    for (found, printed) in found.iter().zip(printed) {
        let error = found / printed - 1.0;
        assert!(error.abs() < 2e-7, "{found} {printed}: {error:e}"); // seven digits
    }
}

/// CalculiX 2.20 writes the part of the stiffness at the retained rows.
#[test]
fn a_substructure_of_calculix_is_the_part_of_its_stiffness() {
    let [found] = &read("calculix/substruct.mtx")[..] else {
        panic!("one matrix");
    };
    assert_eq!(found.name.as_deref(), Some("STIFFNESS"));
    let at = |node, direction| Row::Node { node, direction };
    let kept = [
        at(1, 1),
        at(1, 2),
        at(1, 3),
        at(30, 2),
        at(30, 3),
        at(12, 1),
    ];
    assert_eq!(found.rows.as_deref(), Some(&kept[..]));
    let whole = dense(&matrix("calculix/free.sti", None));
    let (path, text) = bytes("calculix/free.dof");
    let rows = parse_rows(&path, &text).unwrap();
    let place = |row: &Row| rows.iter().position(|other| other == row).unwrap();
    let kept: Vec<usize> = kept.iter().map(place).collect();
    let expected = DMatrix::from_fn(6, 6, |i, j| whole[(kept[i], kept[j])]);
    let error = (dense(&found.matrix) - &expected).amax() / expected.amax();
    assert!(error < 1e-12, "{error:e}");
}

#[test]
fn substructures_of_abaqus_are_free_beams() {
    let [stiffness, mass] = &read("abaqus/symmetric.mtx")[..] else {
        panic!("two matrices");
    };
    assert_eq!(stiffness.name.as_deref(), Some("STIFFNESS"));
    assert_eq!(mass.name.as_deref(), Some("MASS"));
    let rows = stiffness.rows.as_ref().unwrap();
    let expected: Vec<Row> = (0..36)
        .map(|i| Row::Node {
            node: i / 6 + 2,
            direction: (i % 6 + 1) as u8,
        })
        .collect();
    assert_eq!(rows, &expected);
    let unsymmetric = read("abaqus/unsymmetric.mtx");
    let [whole, lower] = &unsymmetric[..] else {
        panic!("two matrices");
    };
    let (stiffness, whole) = (dense(&stiffness.matrix), dense(&whole.matrix));
    // It is symmetric but for rounding, in the file that has all of it, too.
    let error = (&whole - whole.transpose()).amax() / whole.amax();
    assert!(error < 1e-12, "{error:e}");
    let error = (&whole - &stiffness).amax() / whole.amax();
    assert!(error < 1e-12, "{error:e}");
    let (mass, lower) = (dense(&mass.matrix), dense(&lower.matrix));
    let error = (&mass - &lower).amax() / mass.amax();
    assert!(error < 1e-12, "{error:e}");
    assert!(mass.cholesky().is_some());
}

#[test]
fn what_is_written_reads_back_to_the_bit() {
    let matrix = matrix("calculix/held.sti", None);
    let text = write_matrix_market(&matrix);
    let found = parse(Path::new("a.mtx"), text.as_bytes()).unwrap();
    let found = found.choose(MatrixQuantity::Stiffness, None).unwrap();
    assert_eq!(found.matrix, matrix);
}

#[test]
fn files_in_versions_that_are_not_read_name_the_remedy() {
    let (path, bytes) = bytes("scipy/version4.mat");
    let message = parse(&path, &bytes).unwrap_err().to_string();
    assert!(
        message.contains("version4.mat") && message.contains("save -v7"),
        "{message}"
    );
    let hdf = b"\x89HDF\r\n\x1a\n and more";
    let message = parse(Path::new("k.mat"), hdf).unwrap_err().to_string();
    assert!(
        message.contains("7.3") && message.contains("save -v7"),
        "{message}"
    );
    let (path, bytes) = self::bytes("calculix/free.dof");
    let message = parse(&path, &bytes).unwrap_err().to_string();
    assert!(
        message.contains("table of rows") && message.contains(".sti"),
        "{message}"
    );
}

/// Every file, cut off anywhere, and with any byte changed: an error or a matrix, and no panic.
#[test]
fn no_damage_to_a_file_is_a_panic() {
    let files = [
        "scipy/coordinate_symmetric.mtx",
        "scipy/array_general.mtx",
        "scipy/sparse.mat",
        "scipy/sparse_compressed.mat",
        "scipy/dense.mat",
        "scipy/others_compressed.mat",
        "scipy/unsymmetric.rua",
        "op4/dense.op4",
        "op4/nonbigmat.op4",
        "op4/bigmat.op4",
        "op4/dense_big.op4",
        "op4/nonbigmat_little.op4",
        "op4/bigmat_little.op4",
        "calculix/substruct.mtx",
    ];
    for file in files {
        let (path, whole) = bytes(file);
        for at in 0..whole.len() {
            // Where something is missing at the end of a text, the rest may be a file, too.
            let _ = parse(&path, &whole[..at]).and_then(FileMatrices::read_all);
            for change in [0x01, 0x80, 0xff] {
                let mut changed = whole.clone();
                changed[at] ^= change;
                if let Ok(matrices) = parse(&path, &changed).and_then(FileMatrices::read_all) {
                    for m in matrices {
                        assert!(m.matrix.values().iter().all(|v| v.is_finite() && *v != 0.0));
                    }
                }
            }
        }
    }
}

#[test]
fn a_mass_without_some_rows_comes_onto_those_of_the_stiffness() {
    let (stiffness, mass) = (
        b"1,1,1,1,4.\n2,3,1,1,-1.\n2,3,2,3,5.\n10,2,10,2,6.\n".as_slice(),
        b"10,2,10,2,0.5\n2,3,2,3,0.25\n10,2,2,3,0.125\n",
    );
    let [stiffness, mass] = [stiffness, mass].map(|text| {
        let found = parse(Path::new("a.mtx"), text).unwrap();
        found.read_all().unwrap().remove(0)
    });
    let rows = stiffness.rows.clone().unwrap();
    let node = |node, direction| Row::Node { node, direction };
    assert_eq!(rows, [node(1, 1), node(2, 3), node(10, 2)]);
    assert_eq!(mass.rows.as_deref(), Some(&rows[1..]));
    let expected = DMatrix::from_row_slice(3, 3, &[4.0, -1.0, 0.0, -1.0, 5.0, 0.0, 0.0, 0.0, 6.0]);
    assert_eq!(dense(&stiffness.matrix), expected);
    let placed = expand_to_rows(mass.clone(), &rows).unwrap();
    let expected =
        DMatrix::from_row_slice(3, 3, &[0.0, 0.0, 0.0, 0.0, 0.25, 0.125, 0.0, 0.125, 0.5]);
    assert_eq!(dense(&placed), expected);
    let message = expand_to_rows(stiffness, mass.rows.as_ref().unwrap())
        .unwrap_err()
        .to_string();
    assert!(message.contains("direction 1 of node 1"), "{message}");
}
