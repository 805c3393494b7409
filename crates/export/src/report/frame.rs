//! Frame of every report: one page that needs no other file, with its styles, its data and the
//! scripts that draw them.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde::Serialize;

use crate::colours;

const STYLE: &str = include_str!("report.css");
/// uPlot 1.6.32 (MIT licence), <https://github.com/leeoniya/uPlot>: `dist/uPlot.min.css` and
/// `dist/uPlot.iife.min.js`.
const CHARTS_STYLE: &str = include_str!("vendor/uPlot.min.css");
/// Scripts at the beginning of those of each report.
const SCRIPTS: [&str; 2] = [
    include_str!("vendor/uPlot.iife.min.js"),
    include_str!("charts.js"),
];

/// Parts in which reports differ.
#[derive(Debug)]
pub struct Frame<'a> {
    /// Title of the page.
    pub title: &'a str,
    /// Line below the title.
    pub subtitle: Markup,
    /// Name and title of each section that has a link.
    pub links: &'a [(&'a str, &'a str)],
    /// Sections of the page.
    pub main: Markup,
    /// Data of the scripts, made by [`json`].
    pub data: &'a Markup,
    /// Scripts of the page, in the order in which they run.
    pub scripts: &'a [&'a str],
}

/// The whole page.
pub fn frame(frame: &Frame<'_>) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (frame.title) " – dovetail" }
                style { (PreEscaped(CHARTS_STYLE)) (PreEscaped(colours::style())) (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (frame.title) }
                    p.quiet { (frame.subtitle) }
                }
                nav { @for (id, title) in frame.links { a href={ "#" (id) } { (title) } } }
                main { (frame.main) }
                script type="application/json" id="data" { (frame.data) }
                @for script in SCRIPTS.iter().chain(frame.scripts) {
                    script { (PreEscaped(script)) }
                }
            }
        }
    }
}

/// Data as text of a script element. In such a text `</script` ends the element, and `<!--<script`
/// extends it beyond its end; therefore no `<` is left in it.
pub fn json(data: &impl Serialize) -> Markup {
    let text = serde_json::to_string(data).unwrap_or_else(|_| "null".to_owned());
    PreEscaped(text.replace('<', "\\u003c"))
}

/// Card with a title, a value and a remark.
pub fn card(title: &str, value: &str, more: &Markup) -> Markup {
    html! { div.card { div.quiet { (title) } div.figure { (value) } div.quiet { (more) } } }
}

/// List item that says `yes` if `good`, else `look`, and the text.
pub fn line(good: bool, text: &Markup) -> Markup {
    let (class, word) = if good {
        ("good", "yes")
    } else {
        ("doubt", "look")
    };
    html! { li class=(class) { b { (word) } " " (text) } }
}

/// List item for a question that was not checked.
pub fn unchecked(text: &Markup) -> Markup {
    html! { li.unchecked { b { "?" } " Not checked: " (text) } }
}

/// Heading of a column, and its cell of a row.
pub type Column<'a, R> = (&'a str, &'a dyn Fn(&R) -> String);

/// Table with a row for each of `rows`. In a table of the class `numbers` the columns but the first
/// are flush right.
pub fn table<R>(
    class: &str,
    rows: impl IntoIterator<Item = R>,
    columns: &[Column<'_, R>],
) -> Markup {
    html! {
        div.wide { table class=(class) {
            tr { @for (heading, _) in columns { th { (heading) } } }
            @for row in rows { tr { @for (_, cell) in columns { td { (cell(&row)) } } } }
        } }
    }
}

/// All warnings, in a section of their own.
pub fn warnings<'a>(warnings: impl Iterator<Item = &'a str>) -> Markup {
    let mut warnings = warnings.peekable();
    html! {
        @if warnings.peek().is_some() {
            section #warnings {
                h2 { "Warnings" }
                ul { @for warning in warnings { li.warning { (warning) } } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_changes_where_the_script_ends_that_it_stands_in() {
        for name in ["a</script><b>", "<!--<script>", "a < b"] {
            let text = json(&name).into_string();
            assert!(!text.contains('<'), "{text}");
            assert_eq!(serde_json::from_str::<String>(&text).unwrap(), name);
        }
    }
}
