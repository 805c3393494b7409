//! Table of `dovetail verify`.

use dovetail_solver::dlft::retention::Mean;
use dovetail_solver::integration::compare::Comparison;

/// Tables of both methods side by side, for the reader.
pub fn tables(comparisons: &[Comparison]) -> String {
    comparisons.iter().map(table).collect()
}

/// Table of both methods side by side at one frequency.
fn table(comparison: &Comparison) -> String {
    let (b, i) = (&comparison.balance, &comparison.integration);
    let steady = if comparison.steady {
        "steady"
    } else {
        "not steady"
    };
    let unstable = if comparison.is_stable {
        ""
    } else {
        ", an unstable motion, which the integration leaves"
    };
    let mut lines = vec![
        format!(
            "{:.4} Hz, {} harmonics{unstable}; {} periods, {steady}, {:.1e} of the transient left",
            comparison.frequency_hz,
            comparison.harmonics,
            comparison.periods,
            comparison.transient_left
        ),
        format!(
            "    {:<28} {:>14} {:>14} {:>11}",
            "", "balance", "integration", "difference"
        ),
    ];
    let [amplitude, first, contact, input] = comparison.differences();
    let line = |name: &str, b: f64, i: f64, difference: Option<f64>| {
        let percent = difference.map_or(String::new(), |d| format!("{:+.4} %", 100.0 * d));
        format!("    {name:<28} {b:>14.6e} {i:>14.6e} {percent:>11}")
    };
    if let (Some(b), Some(i)) = (b.amplitude_m, i.amplitude_m) {
        lines.push(line("amplitude, m", b, i, amplitude));
    }
    if let (Some(b), Some(i)) = (b.first_harmonic_m, i.first_harmonic_m) {
        lines.push(line("harmonic 1, m", b, i, first));
    }
    let count = |name: &str, b: usize, i: usize| format!("    {name:<28} {b:>14} {i:>14}");
    lines.extend([
        line(
            "contact work, J",
            b.contact_work_j,
            i.contact_work_j,
            contact,
        ),
        line("damping work, J", b.viscous_work_j, i.viscous_work_j, None),
        line("input work, J", b.input_work_j, i.input_work_j, input),
        count("pairs that slip", b.pairs.slipping, i.pairs.slipping),
        count("pairs that open", b.pairs.opening, i.pairs.opening),
    ]);
    if comparison.mean == Mean::Retained {
        lines.push(format!(
            "    what friction does not hold is held in both by a steady {:.3} N",
            comparison.retention_n
        ));
    }
    lines.join("\n") + "\n"
}
