//! Tables of cases as lines of a text, and texts that have all of some words.

/// Checks that a text has all these words, between which ` & ` stands.
#[track_caller]
pub fn has(text: &str, words: &str) {
    for words in words.split(" & ") {
        assert!(text.contains(words), "no {words:?} in:\n{text}");
    }
}

/// Cases of a test: the cells of each line, between which ` => ` stands. A line that begins with
/// `&` or `=>` goes on with the line before it. The end of a line in a cell is written `\n`.
#[track_caller]
pub fn cases<const N: usize>(table: &str) -> Vec<[String; N]> {
    let lines: Vec<&str> = table.trim().lines().map(str::trim).collect();
    let joined = lines.join("\n");
    let joined = joined.replace("\n&", " &").replace("\n=>", " =>");
    let cells = |line: &str| -> [String; N] {
        let cells = line.split(" => ").map(|cell| cell.replace("\\n", "\n"));
        let cells: Result<[String; N], _> = cells.collect::<Vec<_>>().try_into();
        cells.unwrap_or_else(|cells| panic!("{} cells, not {N}: {line}", cells.len()))
    };
    joined.lines().map(cells).collect()
}
