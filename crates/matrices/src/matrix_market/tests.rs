//! Dense files. Sparse ones have their tests in the folder of the package.

use super::*;

/// Columns of a dense matrix.
fn dense(text: &str) -> Result<Vec<Vec<f64>>, String> {
    let zeros = |rows, columns| vec![vec![0.0; rows]; columns];
    let add = |a: &mut Vec<Vec<f64>>, [i, j]: [usize; 2], value| a[j][i] += value;
    let read = read_matrix_market(text.as_bytes(), text.len(), zeros, add);
    read.map_err(|error| error.to_string())
}

/// Checks that a text is not read, for a reason that begins and goes on like this.
#[track_caller]
fn assert_refused(text: &str, begin: &str, words: &str) {
    let message = dense(text).unwrap_err();
    let is_told = message.starts_with(begin) && message.contains(words);
    assert!(is_told, "{begin}{words}: {text}: {message}");
}

#[test]
fn a_header_is_held_against_the_length_of_the_file() {
    let huge = u64::MAX;
    for (header, size) in [
        ("array real general", "90000 90000".to_owned()),
        ("array real general", format!("0 {huge}")),
        ("array real general", format!("{huge} 0")),
        ("array real general", format!("{huge} {huge}")),
        ("array real symmetric", "90000 90000".to_owned()),
        ("array real symmetric", format!("{huge} {huge}")),
        ("array real skew-symmetric", format!("{huge} {huge}")),
        ("array integer general", "90000 90000".to_owned()),
        ("coordinate real general", "90000 90000 2".to_owned()),
        ("coordinate real general", format!("2 2 {huge}")),
        ("coordinate real general", format!("0 {huge} 0")),
        ("coordinate real general", format!("{huge} {huge} 1")),
        ("coordinate pattern general", "3 3 100".to_owned()),
    ] {
        let text = format!("%%MatrixMarket matrix {header}\n% a comment\n{size}\n1 1 1\n");
        assert_refused(&text, "line 3: ", "bytes");
    }
}

#[test]
fn dense_matrices_of_every_form_are_read() {
    let (even, odd) = ([1.0, 2.0, 2.0, 5.0], [0.0, 3.0, -3.0, 0.0]);
    let ones = [1.0, 1.0, 0.0, 0.0];
    // Entries at the same position are added.
    let sums = [0.0, 0.0, 7.0, 5.0];
    let added = "2 2 3\n1 2 4\n1 2 3\n2 2 5";
    let lower = "2 2 3\n1 1 1\n2 1 2\n2 2 5\n";
    let upper = "2 2 3\n1 1 1\n1 2 2\n2 2 5\n";
    for (header, text, expected) in [
        ("array real general", "2 2\n1\n2\n2\n5", even),
        ("array real symmetric", "2 2\n1\n\n2\n% 3\n5\n", even),
        ("array integer skew-symmetric", "2 2\n3\n", odd),
        ("coordinate real symmetric", lower, even),
        ("coordinate real symmetric", upper, even),
        ("coordinate integer general", added, sums),
        ("coordinate real skew-symmetric", "2 2 1\n2 1 3\n", odd),
        ("coordinate real skew-symmetric", "2 2 1\n1 2 -3\n", odd),
        ("coordinate pattern general", "2 2 2\n1 1\n2 1\n", ones),
    ] {
        let text = format!("%%MatrixMarket matrix {header}\n{text}");
        assert_eq!(dense(&text).unwrap().concat(), expected, "{text}");
    }
    // A digit and a line end an entry, the last without: as short as a file can be.
    let shortest = format!(
        "%MatrixMarket matrix array real general\n9 9\n{}7",
        "1\n".repeat(80)
    );
    assert_eq!(dense(&shortest).unwrap()[8][8], 7.0);
    let places = |i: usize| format!("{} {}\n", i / 9 + 1, i % 9 + 1);
    let places: String = (0..81).map(places).collect();
    let shortest = format!("%MatrixMarket matrix coordinate pattern general\n9 9 81\n{places}");
    assert_eq!(dense(shortest.trim()).unwrap()[8][8], 1.0);
    let nothing = "%%MatrixMarket matrix array real skew-symmetric\n0 0\n";
    assert!(dense(nothing).unwrap().is_empty());
}

#[test]
fn what_is_wrong_in_a_dense_file_is_told_with_its_line() {
    let skew = "coordinate real skew-symmetric";
    for (header, text, line, words) in [
        (
            skew,
            "2 2 1\n2 2 1",
            3,
            "(2, 2), expected no entry on the diagonal",
        ),
        (skew, "2 2 2\n2 1 1\n1 2 1", 4, "(1, 2) on the other side"),
        (skew, "0 3 0", 2, "0 x 3, expected as many rows as columns"),
        (
            "array real skew-symmetric",
            "2 2\n3\n4",
            4,
            "more entries than announced, expected 1",
        ),
        (
            "coordinate pattern general",
            "1 3 1\n1 1 1",
            3,
            "(`row column`)",
        ),
        ("array real general", "1 1\nx", 3, "found `x`"),
        ("array real general", "1 1\ninf", 3, "finite"),
        (
            "array real general",
            "3",
            2,
            "the numbers of rows and columns",
        ),
        ("array complex general", "1 1\n1", 1, "complex"),
        (
            "array pattern general",
            "1 1\n1",
            1,
            "expected `%%MatrixMarket",
        ),
        ("array real hermitian", "1 1\n1", 1, "hermitian"),
    ] {
        let text = format!("%%MatrixMarket matrix {header}\n{text}\n");
        assert_refused(&text, &format!("line {line}: "), words);
    }
    let long = " ".repeat(100_000);
    let long = format!("%%MatrixMarket matrix array real general\n1 1\n{long}\n");
    assert_refused(&long, "line 3: ", "a longer one");
    for text in ["\0\0\0", "%%MatrixMarket", "1 1\n1\n"] {
        assert_refused(text, "line 1: ", "expected `%%MatrixMarket");
    }
    assert_refused("\n\n", "the file ends before its header", "");
}
