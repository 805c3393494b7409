//! What a run spent, stage by stage. What it took from the cache is counted as its making: by the times of a case of the
//! same study that made it, so that costs do not depend on which case came first.

use serde_json::Value;

use super::folder::CaseRecord;
use crate::progress::HELD_MODES_STAGE;

/// The stage in which a run keeps something for later ones.
const KEEPING_STAGE: &str = "cache";

/// A stage of summary.json.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    pub name: String,
    pub seconds: f64,
    pub processor_seconds: Option<f64>,
    pub peak_memory_mib: Option<f64>,
    pub from_cache: bool,
}

/// What a run costs without what only the study asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Spent {
    /// Wall clock, s.
    pub seconds: f64,
    /// Of the static state and the response.
    pub contact_seconds: f64,
    /// The same two on the processors, all threads.
    pub processor_seconds: Option<f64>,
    pub contact_processor_seconds: Option<f64>,
    /// Largest resident memory, MiB.
    pub peak_memory_mib: Option<f64>,
    /// Stages taken from the cache that no case of the study made: their making is missing from the times.
    pub not_counted: Vec<String>,
}

/// The stages of a summary.
pub fn stages(summary: &Value) -> Vec<Stage> {
    let stage = |s: &Value| {
        Some(Stage {
            name: s["name"].as_str()?.to_owned(),
            seconds: s["seconds"].as_f64()?,
            processor_seconds: s["processor_seconds"].as_f64(),
            peak_memory_mib: s["peak_memory_mib"].as_f64(),
            from_cache: s["from_cache"].as_bool().unwrap_or(false),
        })
    };
    let all = summary["stages"].as_array().into_iter().flatten();
    all.filter_map(stage).collect()
}

/// Adds up. `made` gives a stage of this name from a case that made what this one may have taken from the cache.
pub fn spent<'s>(
    summary: &Value,
    stages: &'s [Stage],
    made: impl Fn(&str) -> Option<&'s Stage>,
) -> Spent {
    let mut not_counted = Vec::new();
    let mut counted: Vec<&Stage> = Vec::new();
    for stage in stages {
        let name = stage.name.as_str();
        let asked_by_study = [HELD_MODES_STAGE, KEEPING_STAGE].contains(&name);
        let kept = stages.iter().find(|s| s.name == name && s.from_cache);
        match kept {
            _ if asked_by_study => {}
            None => counted.push(stage),
            // Made after all, for the held modes alone, or taken from the cache: counted once, as made.
            Some(first) if std::ptr::eq(first, stage) => match made(name) {
                Some(made) => counted.push(made),
                None => {
                    counted.push(stage);
                    not_counted.push(name.to_owned());
                }
            },
            Some(_) => {}
        }
    }
    let contact = |s: &&&Stage| s.name == "static state" || s.name.starts_with("response, ");
    let sum = |of: fn(&Stage) -> f64| counted.iter().map(|s| of(s)).sum::<f64>();
    let contact_sum =
        |of: fn(&Stage) -> f64| counted.iter().filter(contact).map(|s| of(s)).sum::<f64>();
    // Between the stages.
    let outside =
        |whole: f64, of: fn(&Stage) -> f64| (whole - stages.iter().map(of).sum::<f64>()).max(0.0);
    let wall: fn(&Stage) -> f64 = |s| s.seconds;
    let processor: fn(&Stage) -> f64 = |s| s.processor_seconds.unwrap_or_default();
    let on_processors = summary["processor_seconds"].as_f64();
    Spent {
        seconds: sum(wall) + outside(summary["seconds"].as_f64().unwrap_or_default(), wall),
        contact_seconds: contact_sum(wall),
        processor_seconds: on_processors.map(|whole| sum(processor) + outside(whole, processor)),
        contact_processor_seconds: on_processors.map(|_| contact_sum(processor)),
        peak_memory_mib: counted
            .iter()
            .filter_map(|s| s.peak_memory_mib)
            .reduce(f64::max),
        not_counted,
    }
}

/// The overrides on which a stage kept for others may depend: cases alike in these share it.
pub fn shared_settings<'r>(record: &'r CaseRecord, stage: &str) -> Vec<&'r str> {
    let matters = |s: &&str| match stage {
        "mesh" => s.trim_start().starts_with("mesh"),
        _ => !concerns_contact_alone(s),
    };
    record
        .set
        .iter()
        .map(String::as_str)
        .filter(matters)
        .collect()
}

fn concerns_contact_alone(setting: &str) -> bool {
    let key = setting.split('=').next().unwrap_or(setting).trim();
    let last = key.rsplit('.').next().unwrap_or(key);
    match key.split('.').next().unwrap_or(key) {
        "response" => last != "stuck_modes",
        "static" | "damping" => true,
        "contact" => ["friction", "gap_m"].contains(&last),
        "excitation" => ["force_n", "harmonic", "phase_deg"].contains(&last),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(name: &str, seconds: f64, mib: f64, from_cache: bool) -> Value {
        serde_json::json!({ "name": name, "seconds": seconds, "processor_seconds": 2.0 * seconds,
                            "peak_memory_mib": mib, "from_cache": from_cache })
    }

    fn made() -> Value {
        serde_json::json!({
            "seconds": 13.0, "processor_seconds": 26.0,
            "stages": [stage("finite elements", 1.0, 200.0, false), stage("reduction", 4.0, 300.0, false),
                       stage("cache", 2.0, 300.0, false), stage("static state", 0.5, 310.0, false),
                       stage("response, 3 harmonics", 2.0, 350.0, false), stage(HELD_MODES_STAGE, 2.5, 900.0, false)] })
    }

    #[test]
    fn time_leaves_out_what_only_the_study_asked_for() {
        let (summary, none) = (made(), |_: &str| None);
        let stages = stages(&summary);
        let spent = spent(&summary, &stages, none);
        // 13 in all, of them 2.5 of held modes and 2 of keeping; 1 is in no stage.
        assert_eq!((spent.seconds, spent.contact_seconds), (8.5, 2.5));
        assert_eq!(
            (spent.processor_seconds, spent.contact_processor_seconds),
            (Some(17.0), Some(5.0))
        );
        assert_eq!(
            (spent.peak_memory_mib, spent.not_counted.len()),
            (Some(350.0), 0)
        );
    }

    #[test]
    fn what_came_from_the_cache_counts_as_made() {
        let first = made();
        let of_first = stages(&first);
        // The matrices are assembled again for the held modes.
        let second = serde_json::json!({
            "seconds": 7.0, "processor_seconds": null,
            "stages": [stage("finite elements", 0.0, 50.0, true), stage("reduction", 0.1, 60.0, true),
                       stage("static state", 0.5, 90.0, false), stage("response, 5 harmonics", 3.0, 100.0, false),
                       stage("finite elements", 1.1, 250.0, false), stage(HELD_MODES_STAGE, 2.3, 900.0, false)] });
        let own = stages(&second);
        let counted = spent(&second, &own, |name| {
            of_first.iter().find(|s| s.name == name)
        });
        assert!((counted.seconds - 8.5).abs() < 1e-12, "{counted:?}");
        assert_eq!(
            (counted.contact_seconds, counted.processor_seconds),
            (3.5, None)
        );
        assert_eq!(
            (counted.peak_memory_mib, counted.not_counted.len()),
            (Some(300.0), 0)
        );
        let lacking = spent(&second, &own, |_| None);
        assert!((lacking.seconds - 3.6).abs() < 1e-12, "{lacking:?}");
        assert_eq!(lacking.not_counted, ["finite elements", "reduction"]);
    }

    #[test]
    fn settings_of_the_contact_are_not_shared() {
        for (setting, alone) in [
            ("response.harmonics=3", true),
            ("response.stuck_modes=6", false),
            ("contact.*.friction=0.1", true),
            ("contact.left.crown_radius_m=1", false),
            ("excitation.0.force_n=1", true),
            ("excitation.0.direction=[1, 0, 0]", false),
            ("load.0.force_n=1", false),
            ("mesh.parameters.nu=4", false),
            ("rotation=", false),
            ("damping.ratio=0.01", true),
        ] {
            assert_eq!(concerns_contact_alone(setting), alone, "{setting}");
        }
    }
}
