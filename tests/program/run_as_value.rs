//! A run as a value: what it gives back, what an observer hears, and that nothing is written unless an observer does.

use std::path::{Path, PathBuf};

use dovetail::export::folder::OtherScene;
use dovetail::export::manifest::Summary;
use dovetail::pipeline::observer::{Both, Compared, Observer};
use dovetail::pipeline::{Beginning, Context, Files, Reduced, Run, RunError, solve};
use dovetail::scene;
use dovetail::stage::{Stage, StageRecord};
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::{Outcome, Response, SolvedFrequency, StaticState};

fn jenkins(out: PathBuf) -> (Scene, Context) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene_file = root.join("scenes/verification/jenkins.toml");
    let set = ["response.frequency_hz=[0.15, 0.2]", "response.points=5"].map(String::from);
    let scene = scene::load(&scene_file, &set).unwrap();
    let context = Context {
        out,
        scene_file,
        fields: true,
        frames: None,
        held_modes: false,
        further_plots: Vec::new(),
        cache: None,
    };
    (scene, context)
}

/// A folder of this name that does not exist yet.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("dovetail-run-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    path
}

/// Writes down what it hears.
#[derive(Default)]
struct Listener {
    stages: Vec<Stage>,
    heard: Vec<&'static str>,
    frequencies_hz: Vec<f64>,
    steps: usize,
    /// Ends the run at the static state.
    refuses: bool,
}

impl Observer for Listener {
    fn stage_ends(&mut self, record: &StageRecord) {
        self.stages.push(record.stage);
    }
    fn loop_advances(&mut self, steps: usize) {
        self.steps += steps;
    }
    fn reduced(&mut self, reduced: &Reduced) -> Result<(), RunError> {
        assert_eq!(reduced.problem().laws.len(), 1);
        self.heard.push("reduced");
        Ok(())
    }
    fn static_state(&mut self, _: &Reduced, state: &StaticState) -> Result<(), RunError> {
        assert_eq!(state.outcome, Outcome::Converged);
        self.heard.push("static state");
        match self.refuses {
            true => Err(RunError::NothingHolds {
                what: "the bodies".to_owned(),
            }),
            false => Ok(()),
        }
    }
    fn frequency(&mut self, solved: &SolvedFrequency) -> Result<(), RunError> {
        self.frequencies_hz.push(solved.orbit.frequency_hz);
        Ok(())
    }
    fn response(
        &mut self,
        _: &Reduced,
        response: &Response,
        _: Option<&Compared>,
    ) -> Result<(), RunError> {
        assert_eq!(response.orbits.len(), 5);
        self.heard.push("response");
        Ok(())
    }
}

#[test]
fn a_run_tells_everything_and_writes_nothing() {
    let out = folder("quiet");
    let (scene, context) = jenkins(out.clone());
    let mut listener = Listener::default();
    let run: Run = solve(&scene, &context, &mut listener).unwrap();
    assert!(!out.exists());
    run.verdict().unwrap();
    let response = run.response.unwrap();
    assert_eq!(listener.heard, ["reduced", "static state", "response"]);
    assert_eq!((listener.steps, listener.frequencies_hz.len()), (5, 5));
    // They may come in any order.
    listener.frequencies_hz.sort_by(f64::total_cmp);
    let solved: Vec<f64> = response.orbits.iter().map(|o| o.frequency_hz).collect();
    assert_eq!(listener.frequencies_hz, solved);
    let recorded: Vec<Stage> = run.summary.stages.iter().map(|s| s.id).collect();
    assert_eq!(listener.stages, recorded);
    assert!(recorded.contains(&Stage::StaticState) && recorded.contains(&Stage::Response));
}

#[test]
fn what_the_files_say_reads_back_as_the_summary_of_the_run() {
    let out = folder("files");
    let (scene, context) = jenkins(out.clone());
    let (mut listener, mut files) = (
        Listener::default(),
        Files::open(&scene, &context, OtherScene::Refuse, Beginning::Anew).unwrap(),
    );
    let run = solve(&scene, &context, &mut Both(&mut listener, &mut files)).unwrap();
    files.finish(&run.summary, &run.verdict()).unwrap();
    let text = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let read: Summary = serde_json::from_str(&text).unwrap();
    let (found, own) = (read.response.unwrap(), run.summary.response.unwrap());
    assert_eq!((found.points, found.converged_points), (5, 5));
    assert_eq!(found.peak_row, own.peak_row);
    let (found, own) = (
        found.peak_amplitude_m.unwrap(),
        own.peak_amplitude_m.unwrap(),
    );
    assert!((found / own - 1.0).abs() < 1e-15);
    assert_eq!(read.static_state.unwrap().outcome, Outcome::Converged);
    let ids = |summary: &[dovetail::export::manifest::StageSummary]| -> Vec<Stage> {
        summary.iter().map(|s| s.id).collect()
    };
    assert_eq!(ids(&read.stages), ids(&run.summary.stages));
    for file in ["response.csv", "static.csv", "modes.csv", "contact.csv"] {
        assert!(out.join(file).exists(), "{file}");
    }
    let _ = std::fs::remove_dir_all(&out);
}

#[test]
fn an_observer_that_fails_ends_the_run() {
    let (scene, context) = jenkins(folder("refused"));
    let mut listener = Listener {
        refuses: true,
        ..Listener::default()
    };
    let error = solve(&scene, &context, &mut listener).unwrap_err();
    assert!(matches!(error, RunError::NothingHolds { .. }), "{error}");
    assert!(listener.frequencies_hz.is_empty());
    assert_eq!(listener.heard, ["reduced", "static state"]);
}
