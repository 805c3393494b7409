//! Searches of a program that cannot read its own file.

use super::*;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::{FrequencyRange, ReducedModelSpec, ResponseSpec};
use dovetail_solver::dlft::branch::ValueRange;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::{Orbit, Outcome};
use dovetail_solver::run::CurveQuestion;

fn scene() -> Scene {
    let range = FrequencyRange::Hz {
        from_hz: 1.0,
        to_hz: 2.0,
    };
    Scene::new(
        "a",
        ReducedModelSpec {
            folder: "model".into(),
            law: PairLaw::rigid(0.3, 0.0),
            force_n: 1.0,
        },
        ResponseSpec::new(range, Resolution::fixed(1, 16)),
    )
    .damping(DampingSpec::ratio(0.001))
}

#[test]
fn a_search_of_a_program_that_does_not_know_itself_is_not_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let output = Output {
        folder: folder.path().to_path_buf(),
        scene_file: "a.toml".into(),
        overrides: Vec::new(),
        fields: false,
        frames: None,
        whole_disc: false,
        stress_points: false,
        further_plots: Vec::new(),
    };
    let opened = RunFiles::open(&scene(), &output, OtherScene::Refuse, Beginning::Beside);
    let mut files = opened.unwrap();
    let question = CurveQuestion {
        key: "reduced_model.force_n",
        range: ValueRange {
            values: vec![1.0, 2.0],
            logarithmic: false,
            frequency_hz: 1.0,
        },
        observation: None,
    };
    let begin = |files: &mut RunFiles, resume| {
        files.begin_search(Sought::Curve(CurveUnderWay::new(&question)), resume)
    };
    assert_eq!(begin(&mut files, false).unwrap(), None);
    let key = RecordKey::Search([7; 32]);
    let motion = Orbit::motionless(1.0, Outcome::Converged);
    let point = SolvedFrequency::isolated(motion);
    files.append(&key, &point).unwrap();
    let before = begin(&mut files, true).unwrap();
    assert_eq!(before.as_deref(), Some("1 motions were solved before"));
    files.figures.summary.program_blake3 = None;
    let refused = begin(&mut files, true).unwrap_err();
    assert!(refused.to_string().contains("cannot read"), "{refused}");
    // A search that begins anew has nothing to tell apart.
    assert_eq!(begin(&mut files, false).unwrap(), None);
    files.append(&key, &point).unwrap();
    let told = files.interrupted("Ctrl-C").unwrap();
    assert!(told.contains("after 1 motion. "), "{told}");
    assert!(told.contains("--resume cannot go on"), "{told}");
}
