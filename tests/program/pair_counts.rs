//! The states of pairs are counted by one definition: in the tables, the summary, the report and
//! the terminal, in total and per contact, the counts are the same and add up to the number of
//! pairs.

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, printed, scene_command};
use crate::shared_runs::{Row, rows, summary};

const STATES: [&str; 5] = ["stuck", "slipping", "opening", "closing", "open"];
const AT_REST: [&str; 3] = ["stuck", "slipping", "open"];

fn counts<const N: usize>(of: &Value, prefix: &str, states: [&str; N]) -> [u64; N] {
    states.map(|state| {
        let key = format!("{prefix}{state}_pairs");
        of[&key].as_u64().unwrap_or_else(|| panic!("{key} of {of}"))
    })
}

/// Numbers of rows with each word in a column.
fn words<const N: usize>(rows: &[&Row], column: &str, states: [&str; N]) -> [u64; N] {
    states.map(|state| rows.iter().filter(|row| row[column] == state).count() as u64)
}

/// The joint of two decks: pairs stick, slip, open, and are open at rest, on two contacts.
#[test]
fn every_pair_is_counted_once_wherever_pairs_are_counted() {
    let out = Folder::new("counts");
    let set = ["response.points=9", "response.harmonics=3"];
    let run = scene_command("run", "scenes/decks/joint.toml", &out, &set);
    let told = printed(&ended(run, 0));
    let summary = summary(&out);
    let (state, response) = (&summary["static"], &summary["response"]);
    let pairs = summary["pairs"].as_u64().unwrap();

    let at_rest = counts(state, "", AT_REST);
    assert_eq!(at_rest.iter().sum::<u64>(), pairs);
    assert!(at_rest[2] > 0, "{at_rest:?}");
    let of_table = rows(&out.join("static.csv"));
    let all: Vec<&Row> = of_table.iter().collect();
    assert_eq!(words(&all, "status", AT_REST), at_rest);

    let at_peak = counts(response, "peak_", STATES);
    assert_eq!(at_peak.iter().sum::<u64>(), pairs);
    assert!(
        at_peak[1] > 0 && at_peak[4] + at_peak[3] == at_rest[2],
        "{at_peak:?}"
    );
    let of_table = rows(&out.join("contact.csv"));
    let all: Vec<&Row> = of_table.iter().collect();
    assert_eq!(words(&all, "peak_status", STATES), at_peak);
    for row in rows(&out.join("response.csv")) {
        let counts = STATES.map(|state| row[&format!("{state}_pairs")].parse::<u64>().unwrap());
        assert_eq!(counts.iter().sum::<u64>(), pairs);
    }

    let [stuck, slip, opening, closing, open] = at_peak;
    let peak_words = format!(
        "{stuck} pairs stick, {slip} slip, {opening} open at times, {closing} close at times, {open} stay open"
    );
    let rest_words = format!(
        "{} pairs stick, {} slide, {} open",
        at_rest[0], at_rest[1], at_rest[2]
    );
    let report = out.text("report.html");
    for words in [&peak_words, &rest_words] {
        has(&told, words);
        has(&report, words);
    }
    let moving = slip + opening + closing;
    assert!(report.contains(&format!("{moving} of {pairs} pairs slip or open")));

    let (contacts, peaks) = (&state["contacts"], &response["peak_contacts"]);
    let (mut rest_sum, mut peak_sum) = ([0; 3], [0; 5]);
    for (contact, peak) in contacts
        .as_array()
        .unwrap()
        .iter()
        .zip(peaks.as_array().unwrap())
    {
        assert_eq!(contact["name"], peak["name"]);
        let name = contact["name"].as_str().unwrap();
        let (rest, peak) = (counts(contact, "", AT_REST), counts(peak, "", STATES));
        assert_eq!(Some(rest.iter().sum::<u64>()), contact["pairs"].as_u64());
        assert_eq!(rest.iter().sum::<u64>(), peak.iter().sum::<u64>());
        let own: Vec<&Row> = of_table
            .iter()
            .filter(|row| row["contact"] == name)
            .collect();
        assert_eq!(words(&own, "peak_status", STATES), peak);
        (0..3).for_each(|i| rest_sum[i] += rest[i]);
        (0..5).for_each(|i| peak_sum[i] += peak[i]);
        has(&told, &format!("{name}: {} pair", rest[0]));
    }
    assert_eq!((rest_sum, peak_sum), (at_rest, at_peak));
}
