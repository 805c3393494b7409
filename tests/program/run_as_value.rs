//! Run as a value: its results, the events that an observer receives, and that nothing is written
//! unless files are requested.

use std::ops::ControlFlow;
use std::path::PathBuf;

use crate::shared_folder::Folder;
use crate::shared_program::has;
use crate::shared_runs::manifest;
use crate::shared_work::workspace;
use dovetail::commands::Workspace;
use dovetail::reporter::Reporter;
use dovetail::scene;
use dovetail_cache::Cache;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::Outcome;
use dovetail_solver::run::{
    Error, Event, Observer, Options, Run, Session, Stage, Verification, solve,
};
use dovetail_testkit::folder::root;

fn jenkins() -> (Scene, PathBuf) {
    let scene_file = root().join("scenes/verification/jenkins.toml");
    let set = ["response.frequency_hz=[0.15, 0.2]", "response.points=5"].map(String::from);
    (scene::load(&scene_file, &set).unwrap(), scene_file)
}

/// Observer that records the events.
#[derive(Default)]
struct Listener {
    stages: Vec<Stage>,
    heard: Vec<&'static str>,
    frequencies_hz: Vec<f64>,
    steps: usize,
    /// True if it ends the run at the static state.
    refuses: bool,
}

impl Observer for Listener {
    fn on_event(&mut self, event: &Event<'_>) -> ControlFlow<()> {
        match event {
            Event::StageEnds(end) => self.stages.push(end.stage),
            Event::LoopAdvances(steps) => self.steps += steps,
            Event::Reduced(reduced) => {
                assert_eq!(reduced.problem.laws.len(), 1);
                self.heard.push("reduced");
            }
            Event::StaticState { statics, .. } => {
                assert_eq!(statics.state.outcome, Outcome::Converged);
                self.heard.push("static state");
                if self.refuses {
                    return ControlFlow::Break(());
                }
            }
            Event::Frequency(solved) => self.frequencies_hz.push(solved.orbit.frequency_hz),
            Event::Response(run) => {
                assert_eq!(run.response.as_ref().unwrap().response.orbits.len(), 5);
                self.heard.push("response");
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }
}

fn heard_by(listener: &mut Listener, scene: &Scene) -> Result<Run, Error> {
    let options = Options::default();
    let folder = root().join("scenes/verification/jenkins");
    let model = dovetail_superelement::read(&folder).unwrap();
    solve(
        scene,
        model.into(),
        options,
        &Session::new(listener, &mut ()),
    )
}

#[test]
fn a_run_tells_everything() {
    let (scene, _) = jenkins();
    let mut listener = Listener::default();
    let run = heard_by(&mut listener, &scene).unwrap();
    run.verdict().unwrap();
    let response = run.response.unwrap().response;
    assert_eq!(listener.heard, ["reduced", "static state", "response"]);
    assert_eq!((listener.steps, listener.frequencies_hz.len()), (5, 5));
    // They may come in any order.
    listener.frequencies_hz.sort_by(f64::total_cmp);
    let solved: Vec<f64> = response.orbits.iter().map(|o| o.frequency_hz).collect();
    assert_eq!(listener.frequencies_hz, solved);
    let stages = [Stage::StaticState, Stage::Response, Stage::Stability];
    assert_eq!(listener.stages, stages);
}

#[test]
fn an_observer_ends_the_run() {
    let (scene, _) = jenkins();
    let mut listener = Listener {
        refuses: true,
        ..Listener::default()
    };
    let error = heard_by(&mut listener, &scene).unwrap_err();
    assert!(matches!(error, Error::Stopped), "{error}");
    assert!(listener.frequencies_hz.is_empty());
    assert_eq!(listener.heard, ["reduced", "static state"]);
}

#[test]
fn without_files_nothing_is_written() {
    let folder = Folder::new("run-quiet");
    let out = folder.join("out");
    let (scene, _) = jenkins();
    let work = Workspace {
        scene: &scene,
        folder: out.clone(),
        cache: Cache::new(None),
        files: None,
        reporter: Reporter::silent(None),
    };
    work.solve(Options::default()).unwrap().verdict().unwrap();
    assert!(!out.exists());
    let stages = work.reporter.run_times().stages;
    let stages: Vec<Stage> = stages.iter().map(|s| s.id).collect();
    assert!(stages.contains(&Stage::StaticState) && stages.contains(&Stage::Response));
}

/// A mesh can take minutes.
#[test]
fn what_cannot_be_done_is_refused_before_the_mesh_is_looked_for() {
    let paper = root().join("scenes/paper.toml");
    let of = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
        scene::load(&paper, &set).unwrap()
    };
    let folder = Folder::new("run-refused");
    let work = |scene| Workspace {
        scene,
        folder: folder.join("out"),
        cache: Cache::new(None),
        files: None,
        reporter: Reporter::silent(None),
    };
    let at_rest = of(&["mesh.file=nowhere.msh", "rotation="]);
    let error = work(&at_rest).campbell("0:100:2".parse().unwrap(), &[]);
    has(&error.unwrap_err().to_string(), "no axis of rotation");
    let asked = Verification {
        frequencies_hz: Vec::new(),
        steps_per_period: usize::MAX,
        periods: None,
        most_periods: 2,
        steady: 1e-3,
        from_rest: false,
        perturbation: 0.0,
        tolerance: 0.1,
    };
    let error = work(&at_rest).verify(&asked).unwrap_err().to_string();
    has(&error, "are more than");
    let error = work(&at_rest).mesh().unwrap_err().to_string();
    has(&error, "nowhere.msh");
}

#[test]
fn what_the_files_say_reads_back_as_the_summary_of_the_run() {
    let out = Folder::new("run-files");
    let (scene, scene_file) = jenkins();
    let (work, files) = workspace(&scene, scene_file, &out);
    let run = work.solve(Options::default()).unwrap();
    files.locked().record_times(work.reporter.run_times());
    let verdict = run.verdict().map_err(Into::into);
    files.locked().finish(&verdict).unwrap();
    let read = manifest(&out);
    let own = files.locked().summary().clone();
    assert_eq!(read.stages.len(), own.stages.len());
    let (found, own) = (read.response.unwrap(), own.response.unwrap());
    assert_eq!((found.points, found.converged_points), (5, 5));
    assert_eq!(found.first.peak_row, own.first.peak_row);
    let (found, own) = (
        found.first.peak_amplitude_m.unwrap(),
        own.first.peak_amplitude_m.unwrap(),
    );
    assert!((found / own - 1.0).abs() < 1e-15);
    assert_eq!(read.static_state.unwrap().outcome, Outcome::Converged);
    let ids: Vec<Stage> = read.stages.iter().map(|s| s.id).collect();
    let expected = [
        Stage::ReducedModel,
        Stage::StaticState,
        Stage::StaticFiles,
        Stage::Response,
        Stage::Stability,
        Stage::ResponseFiles,
    ];
    assert_eq!(ids, expected);
    for file in ["response.csv", "static.csv", "modes.csv", "contact.csv"] {
        assert!(out.join(file).exists(), "{file}");
    }
}
