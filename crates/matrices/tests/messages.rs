//! What readers refuse, and in which words; small texts of every format.

use std::path::Path;

use dovetail_matrices::{
    FileMatrices, MatrixError, MatrixQuantity, NamedMatrix, Row, expand_to_rows, parse, parse_rows,
};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::na::DMatrix;

/// Checks a message: the file, and all of some words.
#[track_caller]
fn says<T>(result: Result<T, MatrixError>, file: &str, words: &[&str]) {
    let Err(error) = result else {
        panic!("it is read, not refused: {words:?}");
    };
    let message = error.to_string();
    assert!(message.contains(file), "{file}: {message}");
    assert!(
        message.len() < 500 && !message.contains('\u{1b}'),
        "{message}"
    );
    for words in words {
        assert!(message.contains(words), "{words}: {message}");
    }
}

#[track_caller]
fn refused(file: &str, text: impl AsRef<[u8]>, words: &[&str]) {
    let all = parse(Path::new(file), text.as_ref()).and_then(FileMatrices::read_all);
    says(all, file, words);
}

#[track_caller]
fn refused_rows(text: &str, words: &[&str]) {
    says(
        parse_rows(Path::new("rows.csv"), text.as_bytes()),
        "rows.csv",
        words,
    );
}

#[track_caller]
fn read(text: &str) -> NamedMatrix {
    let all = parse(Path::new("a"), text.as_bytes()).and_then(FileMatrices::read_all);
    let mut matrices = all.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(matrices.len(), 1);
    matrices.remove(0)
}

fn dense(text: &str) -> DMatrix<f64> {
    DMatrix::from(&read(text).matrix)
}

#[test]
fn files_that_are_no_matrices() {
    refused("a.mtx", "", &["empty"]);
    refused("a.mtx", " \r\n\n", &["empty"]);
    refused(
        "a.txt",
        "solid part\nfacet\n",
        &["format is not known", "MatrixMarket", "op4"],
    );
    refused("a.csv", "node,direction\n1,1\n", &["table of rows"]);
    refused("a.inp", "*NODE\n1,0,0,0\n", &["format is not known"]);
    refused("a.txt", "1 2 3 4\n", &["format is not known"]);
    refused(
        "a\u{1b}[2J.mtx".replace('\u{1b}', "").as_str(),
        "x",
        &["format"],
    );
}

#[test]
fn matrix_market_files_are_held_against_their_header() {
    let head = "%%MatrixMarket matrix";
    let file = |kind: &str, rest: &str| format!("{head} {kind}\n% a comment\n\n{rest}");
    let huge = i64::MAX;
    let placed = "coordinate real general";
    for (kind, rest, words) in [
        ("coordinate complex general", "", ["line 1: ", "complex"]),
        ("coordinate pattern general", "", ["line 1: ", "pattern"]),
        (
            "array real skew-symmetric",
            "",
            ["line 1: ", "skew-symmetric"],
        ),
        (
            "coordinate real odd",
            "",
            ["line 1: ", "expected `%%MatrixMarket"],
        ),
        (
            "vector real general",
            "",
            ["line 1: ", "expected `%%MatrixMarket"],
        ),
        (placed, "", ["ends before", "size"]),
        (placed, "2 2\n", ["line 4: ", "rows, columns and entries"]),
        (
            placed,
            "2 2 2\n1 1 1\n",
            ["line 4: ", "2 entries is announced"],
        ),
        (
            placed,
            "2 2 1\n1 1 1\n2 2 1\n",
            ["line 6: ", "more entries"],
        ),
        (
            placed,
            "2 2 2\n1 1 1.000000\n",
            ["found 1 entries", "expected 2"],
        ),
        (
            placed,
            "2 2 1\n3 1 1\n",
            ["line 5: ", "row `3` is outside the 2"],
        ),
        (
            placed,
            "2 2 1\n1 0 1\n",
            ["line 5: ", "column `0` is outside the 2"],
        ),
        (placed, "2 2 1\n1 1 x\n", ["line 5: ", "found `x`"]),
        (placed, "2 2 1\n1 1 nan\n", ["line 5: ", "finite"]),
        (placed, "2 2 1\n1 1 -1e999\n", ["line 5: ", "finite"]),
        (placed, "2 2 1\n1 1 1 1\n", ["line 5: ", "row column value"]),
        (
            placed,
            &format!("{huge} {huge} 1\n1 1 1\n"),
            ["line 4: ", "bytes"],
        ),
        (
            placed,
            &format!("2 2 {huge}\n1 1 1\n"),
            ["line 4: ", "bytes"],
        ),
        (placed, &format!("0 {huge} 0\n"), ["line 4: ", "bytes"]),
        (
            "array real general",
            "90000 90000\n1\n",
            ["line 4: ", "bytes"],
        ),
        (
            "array real symmetric",
            "2 3\n1\n",
            ["line 4: ", "as many rows as columns"],
        ),
        (
            "array real general",
            "2 2\n1\n2\n3\n4 5\n",
            ["line 8: ", "`4 5`"],
        ),
        (
            "coordinate real symmetric",
            "2 2 2\n2 1 1\n1 2 1\n",
            ["line 6: ", "(1, 2)"],
        ),
    ] {
        refused("k.mtx", file(kind, rest), &words);
    }
    // Either triangle of a symmetric file, and sums at one place.
    let expected = DMatrix::from_row_slice(2, 2, &[0.0, 3.0, 3.0, 5.0]);
    let kind = "coordinate integer symmetric";
    assert_eq!(dense(&file(kind, "2 2 3\n1 2 1\n1 2 2\n2 2 5\n")), expected);
    assert_eq!(dense(&file(kind, "2 2 2\n2 1 3\n2 2 5")), expected);
}

#[test]
fn columns_of_numbers_are_one_triangle_or_a_whole_matrix() {
    let expected = DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -1.0, 0.0]);
    assert_eq!(dense("1 1 4.\n1 2 -1.\n"), expected);
    assert_eq!(dense("1,1,4.\n2,1,-1.\n"), expected);
    assert_eq!(dense("1 1 4.\n1 2 -1.\n2 1 -1.\n"), expected);
    let lame = DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -2.0, 0.0]);
    assert_eq!(dense("1 1 4.\n1 2 -1.\n2 1 -2.\n"), lame);
    for (text, words) in [
        ("1 1 4.\n1 2\n", ["line 2: ", "row column value"]),
        ("1 1 4.\n0 2 1.\n", ["line 2: ", "counted from 1"]),
        ("1 1 4.\n1 2.5 1.\n", ["line 2: ", "`2.5`"]),
        ("1 1 4.\n1 99999999 1.\n", ["line 2: ", "bytes"]),
        ("1 1 4.\n1 2 Infinity\n", ["line 2: ", "finite"]),
    ] {
        refused("job.sti", text, &words);
    }
}

#[test]
fn labels_of_abaqus_become_rows_in_their_order() {
    // Abaqus' internal nodes have negative numbers: they come last.
    let found = read("12,1, 3,2, 1.5\n3,2, 3,2, 7.\n-1,1, 3,2, 0.5\n12,1, 12,1, 8.\n");
    let node = |node, direction| Row::Node { node, direction };
    assert_eq!(
        found.rows.unwrap(),
        [node(3, 2), node(12, 1), Row::Generalised]
    );
    let expected = DMatrix::from_row_slice(3, 3, &[7.0, 1.5, 0.5, 1.5, 8.0, 0.0, 0.5, 0.0, 0.0]);
    assert_eq!(DMatrix::from(&found.matrix), expected);
    for (text, words) in [
        (
            "1,1,1,1,4.\n1,11,1,1,4.\n",
            ["line 2: ", "direction 11 of node 1"],
        ),
        (
            "1,1,1,1,4.\n1,2,1,1\n",
            ["line 2: ", "node, direction, node"],
        ),
        ("1,1,1,1,4.\nx,2,1,1,1\n", ["line 2: ", "`x`"]),
    ] {
        refused("job_STIF1.mtx", text, &words);
    }
}

#[test]
fn substructures_have_the_rows_of_their_lists() {
    let head = "** GENERATION OF SUBSTRUCTURE Z1\n*USER ELEMENT, NODES= 3, LINEAR\n** ELEMENT NODES\n\
                ** 7, 5,\n** 0\n 1, 3\n 3, 1\n";
    let text = format!(
        "{head}*MATRIX,TYPE=STIFFNESS\n1. ,\n2. , 3.\n4.,5.,6.,7.\n8.,9.,10.\n\
                        11.,12.,13.,14.\n15. ,\n**\n"
    );
    let found = read(&text);
    let node = |node, direction| Row::Node { node, direction };
    let rows = [
        node(7, 1),
        node(7, 3),
        node(5, 1),
        node(5, 3),
        Row::Generalised,
    ];
    assert_eq!(found.rows.as_deref(), Some(&rows[..]));
    let lower = |i: usize, j: usize| (i * (i + 1) / 2 + j + 1) as f64;
    let expected = DMatrix::from_fn(5, 5, |i, j| lower(i.max(j), i.min(j)));
    assert_eq!(DMatrix::from(&found.matrix), expected);
    for (from, to, words) in [
        ("15. ,", "", ["line 8: ", "14 values of STIFFNESS"]),
        ("NODES= 3", "NODES= 4", ["line 8: ", "3 nodes"]),
        (
            " 3, 1\n",
            " 4, 1\n",
            ["line 7: ", "position of a node from 2 to 3"],
        ),
        (" 3, 1\n", "", ["line 7: ", "15 values"]),
        ("7, 5", "7, x", ["line 4: ", "`x`"]),
        (
            " 1, 3\n",
            " 1, 11\n",
            ["line 8: ", "direction 11 of node 7"],
        ),
        ("3.\n", "x\n", ["line 10: ", "`x`"]),
        (
            "*MATRIX,TYPE=STIFFNESS",
            "*OTHER",
            ["ends before", "*MATRIX"],
        ),
    ] {
        refused("z1.mtx", text.replacen(from, to, 1), &words);
    }
}

#[test]
fn harwell_boeing_files_of_ansys_are_read() {
    // The layout of HBMAT: one number on a line.
    let head = "Stiffness matrix from ANSYS FULL file dumped into Harwell-Boeing format         \n\
                \x20            9             3             3             3             0\n\
                RSA                        2             2             3             0\n\
                (I14)           (I14)           (d25.15)            (d25.15)            \n";
    let numbers = ["1", "3", "4", "1", "2", "2"]
        .map(|n| format!("{n:>14}\n"))
        .concat();
    let values = ["0.4D+01", "-0.1D+01", "0.5D+01"]
        .map(|n| format!("{n:>25}\n"))
        .concat();
    let text = format!("{head}{numbers}{values}");
    let expected = DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -1.0, 5.0]);
    assert_eq!(dense(&text), expected);
    // A right-hand side has a line of the head, and stands behind the values.
    let with_side = text
        .replacen("3             0\nRSA", "3             2\nRSA", 1)
        .replacen(
            "(d25.15)            \n",
            "(d25.15)            \nF              1  0\n",
            1,
        );
    assert_eq!(
        dense(&format!("{with_side}{:>25}\n{:>25}\n", "1.0D0", "0.0D0")),
        expected
    );
    for (from, to, words) in [
        ("RSA", "CSA", ["line 3: ", "CSA"]),
        ("RSA", "RSE", ["line 3: ", "assembled"]),
        ("-0.1D+01", "     NaN", ["line 12: ", "finite"]),
        ("0.5D+01\n", "\n", ["line 13: ", "nothing"]),
        (
            "            4\n",
            "            9\n",
            ["line 7: ", "beginning of a column `9`"],
        ),
        (
            "(I14)           (I14) ",
            "(I14)           odd ",
            ["line 4: ", "formats"],
        ),
    ] {
        assert!(text.contains(from), "{from}");
        refused("k.matrix", text.replacen(from, to, 1), &words);
    }
    refused(
        "k.matrix",
        &text[..text.len() - 26],
        &["ends before", "values"],
    );
}

#[test]
fn harwell_boeing_files_may_have_any_format_of_fortran() {
    let expected = DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -1.0, 0.5]);
    let file = |formats: [&str; 3], numbers: &str| {
        let [columns, rows, values] = formats;
        format!(
            "title\n 9 3 3 3 0\nRSA            2             2             3             0\n\
             {columns:<16}{rows:<16}{values:<20}\n{numbers}"
        )
    };
    for (formats, numbers) in [
        (
            ["(1X,8I9)", "(2(1X,I3))", "(1P,2(2X,E9.2))"],
            "         1        3        4\n   1   2\n   2\n   4.00E+00  -1.00E+00\n   5.00E-01\n",
        ),
        (
            ["(I2,2(1X,I2))", "( T2, 3I2 )", "(3(1PD9.1))"],
            " 1  3  4\n- 1 2 2\n  4.0D+00 -1.0D 00  0.5D+00\n",
        ),
        // Without an exponent the scale divides, and without a point the last digits are decimals.
        (
            ["(3I2/)", "(I1/(2I1))", "(2PF7.1,-1P,2F4.2)"],
            " 1 3 4\n\n1\n22\n  400.0 -10   5\n",
        ),
        // All of a column of the head is used.
        (
            ["(1X,1X,I2,2I0002)", "(BN,0001X,0003I1)", "(3(F5.2))"],
            "   1 3 4\n 122\n 4.00-1.00  .50\n",
        ),
    ] {
        let text = file(formats, numbers);
        assert_eq!(dense(&text), expected, "{text}");
    }
    let text = file(["(3I2)", "(3A2)", "(3F5.2)"], "");
    refused("k.rsa", text, &["line 4: ", "`(3A2)`", "(1X,8I9)"]);
}

#[test]
fn op4_texts_are_held_against_their_header() {
    let text = "       2       2       6       2KAA     1P,3E23.16\n       1       1       2\n \
                4.0000000000000000E+00-1.0000000000000000E+00\n       2       2       1\n \
                5.0000000000000000E+00\n       3       1       1\n 1.0000000000000000E+00\n";
    let expected = DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -1.0, 5.0]);
    assert_eq!(dense(text), expected);
    for (from, to, words) in [
        (
            "       2       2       1\n",
            "       2       2       2\n",
            ["line 4: ", "2 values"],
        ),
        (
            "       1       1       2\n",
            "       0       1       2\n",
            ["line 2: ", "column 0"],
        ),
        (
            "       1       1       2\n",
            "       1       x       2\n",
            ["line 2: ", "`1       x"],
        ),
        (
            "1P,3E23.16",
            "1P,3A23.16",
            ["line 1: ", "a format of values"],
        ),
        (
            " 5.0000000000000000E+00",
            "                   NaN ",
            ["line 5: ", "finite"],
        ),
        (
            "       2       2       6",
            "       2 9999999       6",
            ["line 1: ", "bytes"],
        ),
        (
            "       6       2KAA",
            "       6       9KAA",
            ["line 1: ", "form (1 to 9)"],
        ),
    ] {
        assert!(text.contains(from), "{from}");
        refused("k.op4", text.replacen(from, to, 1), &words);
    }
    refused("k.op4", &text[..170], &["ends before"]);
    let complex = text.replacen("       2KAA", "       4KAA", 1);
    refused(
        "k.op4",
        complex,
        &["no matrix of real numbers", "`KAA` is complex"],
    );
    // Exponents of three digits leave no room for their letter.
    let small = text.replacen("5.0000000000000000E+00", "5.0000000000000000-103", 1);
    assert_eq!(dense(&small)[(1, 1)], 5e-103);
}

#[test]
fn tables_of_rows_are_read_in_every_form() {
    let rows = |text: &str| parse_rows(Path::new("rows"), text.as_bytes()).unwrap();
    let node = |node, direction| Row::Node { node, direction };
    let expected = [node(10, 1), node(2, 6), Row::Generalised];
    assert_eq!(rows("node,direction\n10,1\n2,6\n,\n"), expected);
    assert_eq!(
        rows("# made by hand\nNode Direction\n10 UX\n2 rotz\n- -\n"),
        expected
    );
    assert_eq!(
        rows("\"node\";\"direction\"\r\n10;x\r\n2;RZ\r\n-;\r\n"),
        expected
    );
    assert_eq!(
        rows("name,direction,row,node\na,1,1,10\nq,,3,\nb,6,2,2\n"),
        expected
    );
    assert_eq!(
        rows("10.1\n10.2\n1.1\n"),
        [node(10, 1), node(10, 2), node(1, 1)]
    );
    let mapping = "    Matrix Eqn          Node    DOF     \n             1             5    UX  \n\
                   \x20            2             1    ROTY\n";
    assert_eq!(rows(mapping), [node(5, 1), node(1, 5)]);
    for (text, words) in [
        ("", ["empty", "empty"]),
        (
            "nodes,direction\n1,1\n",
            ["line 1: ", "columns node and direction"],
        ),
        ("node,direction\n1,7\n", ["line 2: ", "`7`"]),
        ("node,direction\n1,TEMP\n", ["line 2: ", "`TEMP`"]),
        ("node,direction\n1.5,1\n", ["line 2: ", "`1.5`"]),
        ("node,direction\n1\n", ["line 2: ", "1 columns"]),
        (
            "node,direction\n1,2\n3,1\n1,y\n",
            ["direction 2 of node 1", "rows 1 and 3"],
        ),
        (
            "row,node,direction\n1,1,1\n1,2,1\n",
            ["line 3: ", "row 1 again"],
        ),
        ("row,node,direction\n1,1,1\n3,2,1\n", ["line 3: ", "row 3"]),
        ("row,node,direction\n0,1,1\n", ["line 2: ", "row 0"]),
        ("1.1\n1.1\n", ["direction 1 of node 1", "rows 1 and 2"]),
        ("1.1\n1.0\n", ["line 2: ", "direction 0 of node 1"]),
        ("1.1\n12\n", ["line 2: ", "`node.direction`"]),
    ] {
        refused_rows(text, &words);
    }
}

/// File of OUTPUT4 with matrices of these names, of one row and column.
fn op4_of(names: &[&str]) -> String {
    let matrix = |name: &&str| {
        format!(
            "       1       1       6       2{name:<8}1P,3E23.16\n       1       1       1\n\
             {:>23}\n       2       1       1\n{:>23}\n",
            "2.0E+00", "1.0E+00"
        )
    };
    names.iter().map(matrix).collect()
}

#[test]
fn a_matrix_is_chosen_by_name_or_by_custom() {
    let pick = |names: &[&str], quantity, name| {
        let text = op4_of(names);
        let found = parse(Path::new("m.op4"), text.as_bytes()).unwrap();
        found.choose(quantity, name).map(|m| m.name.unwrap())
    };
    use MatrixQuantity::{Mass, Stiffness};
    for (names, quantity, name, expected) in [
        (&["A", "B"][..], Mass, Some("B"), "B"),
        (&["b", "B"], Mass, Some("B"), "B"),
        (&["a", "b"], Mass, Some("B"), "b"),
        (&["anything"], Mass, None, "anything"),
        (&["K", "M"], Mass, None, "M"),
        (&["KAA", "MAA", "PHI"], Stiffness, None, "KAA"),
        (&["KAA", "MAA", "PHI"], Mass, None, "MAA"),
        (&["STIFF", "MASS"], Stiffness, None, "STIFF"),
        (&["k_gg", "b_gg", "m_gg"], Stiffness, None, "k_gg"),
    ] {
        assert_eq!(pick(names, quantity, name).unwrap(), expected, "{names:?}");
    }
    let says = |result, words: &[&str]| says(result, "m.op4", words);
    says(pick(&["K", "M"], Mass, Some("X")), &["`X`", "`K`, `M`"]);
    says(pick(&["kk", "KK"], Mass, Some("Kk")), &["`Kk`"]);
    says(
        pick(&["KAA", "KGG", "M"], Stiffness, None),
        &["stiffness is not clear", "`KGG`"],
    );
    says(
        pick(&["A", "B"], Mass, None),
        &["mass is not clear", "`A`, `B`"],
    );
    says(
        pick(&["MAA"], Stiffness, None),
        &["the stiffness is expected", "`MAA`"],
    );
    let unnamed = || parse(Path::new("m.op4"), b"1 1 2.0\n").unwrap();
    assert!(unnamed().choose(Mass, None).is_ok());
    says(
        unnamed()
            .choose(Mass, Some("M"))
            .map(|m| m.name.unwrap_or_default()),
        &["without names"],
    );
}

#[test]
fn rows_that_do_not_fit_are_refused() {
    let of = |rows: &[Row]| NamedMatrix {
        rows: Some(rows.to_vec()),
        matrix: CscMatrix::identity(2),
        name: Some("M".to_owned()),
    };
    let node = |node| Row::Node { node, direction: 1 };
    let two = [node(1), node(2)];
    let modal = [Row::Generalised, node(2), Row::Generalised];
    let unlabelled = NamedMatrix {
        rows: None,
        ..of(&two)
    };
    says(expand_to_rows(unlabelled, &two), "`M`", &["no labels"]);
    says(expand_to_rows(of(&two[..1]), &two), "`M`", &["2 rows", "1"]);
    says(
        expand_to_rows(of(&two), &[node(1), node(1)]),
        "",
        &["rows 1 and 2"],
    );
    says(
        expand_to_rows(of(&two), &two[..1]),
        "`M`",
        &["direction 1 of node 2"],
    );
    says(
        expand_to_rows(of(&modal[..2]), &modal),
        "`M`",
        &["1 generalised", "2"],
    );
    let placed = expand_to_rows(of(&[modal[0], modal[0]]), &modal).unwrap();
    let expected = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(DMatrix::from(&placed), expected);
}
