//! Preparation of words from outside (names, paths, output of gmsh) for messages: bounded in
//! length, and without anything that a terminal would obey.

use std::fmt::Display;

/// Most items of a list in a message.
const MOST_ITEMS: usize = 30;
/// Most characters of a word in a message.
const MOST_OF_A_WORD: usize = 300;
/// Most characters of a message.
const MOST_OF_A_MESSAGE: usize = 6000;

/// `a, b, c`; for many items the first few and how many more there are, for none `none`.
pub fn list<T: Display>(items: &[T]) -> String {
    joined(items, ", ")
}

/// [`list`] with another separator.
pub fn joined<T: Display>(items: &[T], separator: &str) -> String {
    if items.is_empty() {
        return "none".to_owned();
    }
    let words: Vec<String> = items.iter().take(MOST_ITEMS).map(T::to_string).collect();
    let words = words.join(separator);
    match items.len().saturating_sub(MOST_ITEMS) {
        0 => words,
        more => format!("{words} and {more} more"),
    }
}

/// Text in the form for messages: [`visible`], with long words and a long text shortened in the
/// middle.
pub fn plain(text: &str) -> String {
    let mut shown = String::with_capacity(text.len().min(MOST_OF_A_MESSAGE));
    let mut rest = text;
    while !rest.is_empty() {
        let is_blank = |c: char| c.is_whitespace();
        let (blanks, from) = rest.split_at(rest.find(|c| !is_blank(c)).unwrap_or(rest.len()));
        let (word, after) = from.split_at(from.find(is_blank).unwrap_or(from.len()));
        shown.push_str(&visible(blanks));
        shown.push_str(&visible(&shorten_middle(word, MOST_OF_A_WORD)));
        rest = after;
    }
    shorten_middle(&shown, MOST_OF_A_MESSAGE)
}

/// Text with line ends and tabs unchanged, and every other character that a terminal would obey
/// written as `\u{1b}`.
pub fn visible(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_plain(c) {
            shown.push(c);
        } else {
            shown.extend(c.escape_unicode());
        }
    }
    shown
}

/// Shortens a text longer than `most` characters to its first two thirds and its last third.
fn shorten_middle(text: &str, most: usize) -> String {
    // Characters have at least a byte.
    let long = text.len() > most;
    let count = if long { text.chars().count() } else { 0 };
    if count <= most {
        return text.to_owned();
    }
    let (head, tail) = (most - most / 3, most / 3);
    let place = |character: usize| {
        let boundary = text.char_indices().nth(character);
        boundary.map_or(text.len(), |(at, _)| at)
    };
    format!(
        "{}[... {} characters left out ...]{}",
        &text[..place(head)],
        count - head - tail,
        &text[place(count - tail)..]
    )
}

/// Returns `true` if a terminal may receive this character unchanged.
pub fn is_plain(c: char) -> bool {
    let turns_writing = matches!(c,
        '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}');
    matches!(c, '\n' | '\t') || !(c.is_control() || turns_writing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_a_terminal_obeys_is_left() {
        let shown = plain("a\x1b[2Jb\r\n\tc\u{9b}31m\u{202e}\0 é");
        assert_eq!(shown, "a\\u{1b}[2Jb\\u{d}\n\tc\\u{9b}31m\\u{202e}\\u{0} é");
        assert!(shown.chars().all(is_plain));
    }

    #[test]
    fn words_texts_and_lists_are_bounded() {
        let name = "x".repeat(1_000_000);
        let shown = plain(&format!("`contact.{name}.friction` is missing"));
        assert!(shown.starts_with("`contact.xxx") && shown.ends_with("x.friction` is missing"));
        assert!(shown.contains("characters left out") && shown.len() < 400);
        let blanks = plain(&format!("a{}b", "é ".repeat(1_000_000)));
        assert!(blanks.ends_with('b') && blanks.chars().count() < MOST_OF_A_MESSAGE + 60);
        assert_eq!(list::<u8>(&[]), "none");
        assert_eq!(list(&[1, 2]), "1, 2");
        let many: Vec<usize> = (0..1000).collect();
        assert!(list(&many).ends_with(", 29 and 970 more"));
    }
}
