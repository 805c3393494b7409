//! summary.json of a case, as far as a study reads it.

use serde::Deserialize;
use serde_json::Value;

use crate::stage::Stage;

/// What every run with a response says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseSummary {
    /// Wall clock, s.
    pub seconds: f64,
    /// Of all threads and of gmsh, s.
    pub processor_seconds: Option<f64>,
    pub stages: Vec<StageTimes>,
    /// Frequencies.
    pub points: usize,
    pub converged_points: usize,
    /// The whole of it, for the quantities.
    pub whole: Value,
}

/// A stage of it.
#[derive(Debug, Clone, PartialEq)]
pub struct StageTimes {
    pub stage: Stage,
    pub seconds: f64,
    pub processor_seconds: Option<f64>,
    pub peak_memory_mib: Option<f64>,
    pub from_cache: bool,
}

impl CaseSummary {
    /// `None`: this is no summary of a run with a response.
    pub fn of(whole: Value) -> Option<Self> {
        #[derive(Deserialize)]
        struct Run {
            seconds: f64,
            processor_seconds: Option<f64>,
            stages: Vec<OfStage>,
            response: OfResponse,
        }
        #[derive(Deserialize)]
        struct OfStage {
            id: String,
            seconds: f64,
            processor_seconds: Option<f64>,
            peak_memory_mib: Option<f64>,
            from_cache: bool,
        }
        #[derive(Deserialize)]
        struct OfResponse {
            points: usize,
            converged_points: usize,
        }
        let run = Run::deserialize(&whole).ok()?;
        let times = |s: OfStage| {
            Some(StageTimes {
                stage: Stage::of_id(&s.id)?,
                seconds: s.seconds,
                processor_seconds: s.processor_seconds,
                peak_memory_mib: s.peak_memory_mib,
                from_cache: s.from_cache,
            })
        };
        let OfResponse {
            points,
            converged_points,
        } = run.response;
        if points == 0 || converged_points > points {
            return None;
        }
        Some(Self {
            seconds: run.seconds,
            processor_seconds: run.processor_seconds,
            stages: run.stages.into_iter().map(times).collect::<Option<_>>()?,
            points,
            converged_points,
            whole,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn only_the_summary_of_a_run_with_a_response_is_one() {
        let stage = json!({ "id": "response", "name": "response to 0.01", "seconds": 1.5, "processor_seconds": null,
                            "peak_memory_mib": 20.0, "from_cache": false, "unknowns": [7] });
        let whole = json!({ "seconds": 2.0, "processor_seconds": 1.0, "stages": [stage],
                            "response": { "points": 3, "converged_points": 2 }, "version": "1" });
        let summary = CaseSummary::of(whole.clone()).unwrap();
        assert_eq!((summary.points, summary.converged_points), (3, 2));
        assert_eq!(summary.stages[0].stage, Stage::Response);
        assert_eq!(summary.stages[0].processor_seconds, None);
        assert_eq!(CaseSummary::of(json!({})), None);
        assert_eq!(CaseSummary::of(Value::Null), None);
        let but = |pointer: &str, value: Value| {
            let mut other = whole.clone();
            *other.pointer_mut(pointer).unwrap() = value;
            CaseSummary::of(other)
        };
        assert_eq!(but("/response", Value::Null), None);
        assert_eq!(but("/response", json!({})), None);
        assert_eq!(but("/response/points", json!(0)), None);
        assert_eq!(but("/response/converged_points", json!(4)), None);
        assert_eq!(but("/seconds", Value::Null), None);
        assert_eq!(but("/stages", Value::Null), None);
        assert_eq!(but("/stages/0/id", json!("a stage to come")), None);
        assert!(but("/stages", json!([])).is_some());
    }
}
