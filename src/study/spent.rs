//! What a run spent, stage by stage. What it took from the cache is counted as its making: by the times of a case of the
//! same study that made it, so that costs do not depend on which case came first.

use super::folder::CaseRecord;
use super::summary::{CaseSummary, StageTimes};
use crate::stage::Stage;

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
    pub not_counted: Vec<Stage>,
}

/// Adds up. `made` gives such a stage of a case that made what this one may have taken from the
/// cache.
pub fn spent<'s>(
    summary: &'s CaseSummary,
    made: impl Fn(Stage) -> Option<&'s StageTimes>,
) -> Spent {
    let stages = &summary.stages;
    let mut not_counted = Vec::new();
    let mut counted: Vec<&StageTimes> = Vec::new();
    for times in stages {
        let stage = times.stage;
        let asked_by_study = [Stage::HeldModes, Stage::Keeping].contains(&stage);
        let kept = stages.iter().find(|s| s.stage == stage && s.from_cache);
        match kept {
            _ if asked_by_study => {}
            None => counted.push(times),
            // Made after all, for the held modes alone, or taken from the cache: counted once, as made.
            Some(first) if std::ptr::eq(first, times) => match made(stage) {
                Some(made) => counted.push(made),
                None => {
                    counted.push(times);
                    not_counted.push(stage);
                }
            },
            Some(_) => {}
        }
    }
    let contact = |s: &&&StageTimes| [Stage::StaticState, Stage::Response].contains(&s.stage);
    let sum = |of: fn(&StageTimes) -> f64| counted.iter().map(|s| of(s)).sum::<f64>();
    let contact_sum =
        |of: fn(&StageTimes) -> f64| counted.iter().filter(contact).map(|s| of(s)).sum::<f64>();
    // Between the stages.
    let outside = |whole: f64, of: fn(&StageTimes) -> f64| {
        (whole - stages.iter().map(of).sum::<f64>()).max(0.0)
    };
    let wall: fn(&StageTimes) -> f64 = |s| s.seconds;
    let processor: fn(&StageTimes) -> f64 = |s| s.processor_seconds.unwrap_or_default();
    let on_processors = summary.processor_seconds;
    Spent {
        seconds: sum(wall) + outside(summary.seconds, wall),
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
pub fn shared_settings(record: &CaseRecord, stage: Stage) -> Vec<&str> {
    let matters = |s: &&str| match stage {
        Stage::Mesh => s.trim_start().starts_with("mesh"),
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

    fn times(stage: Stage, seconds: f64, mib: f64, from_cache: bool) -> StageTimes {
        StageTimes {
            stage,
            seconds,
            processor_seconds: Some(2.0 * seconds),
            peak_memory_mib: Some(mib),
            from_cache,
        }
    }

    fn summary(
        seconds: f64,
        processor_seconds: Option<f64>,
        stages: Vec<StageTimes>,
    ) -> CaseSummary {
        CaseSummary {
            seconds,
            processor_seconds,
            stages,
            points: 3,
            converged_points: 3,
            whole: serde_json::Value::Null,
        }
    }

    fn made() -> CaseSummary {
        let stages = vec![
            times(Stage::FiniteElements, 1.0, 200.0, false),
            times(Stage::Reduction, 4.0, 300.0, false),
            times(Stage::Keeping, 2.0, 300.0, false),
            times(Stage::StaticState, 0.5, 310.0, false),
            times(Stage::Response, 2.0, 350.0, false),
            times(Stage::HeldModes, 2.5, 900.0, false),
        ];
        summary(13.0, Some(26.0), stages)
    }

    #[test]
    fn time_leaves_out_what_only_the_study_asked_for() {
        let spent = spent(&made(), |_| None);
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
        // The matrices are assembled again for the held modes.
        let stages = vec![
            times(Stage::FiniteElements, 0.0, 50.0, true),
            times(Stage::Reduction, 0.1, 60.0, true),
            times(Stage::StaticState, 0.5, 90.0, false),
            times(Stage::Response, 3.0, 100.0, false),
            times(Stage::FiniteElements, 1.1, 250.0, false),
            times(Stage::HeldModes, 2.3, 900.0, false),
        ];
        let second = summary(7.0, None, stages);
        let counted = spent(&second, |stage| {
            first.stages.iter().find(|s| s.stage == stage)
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
        let lacking = spent(&second, |_| None);
        assert!((lacking.seconds - 3.6).abs() < 1e-12, "{lacking:?}");
        assert_eq!(
            lacking.not_counted,
            [Stage::FiniteElements, Stage::Reduction]
        );
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
