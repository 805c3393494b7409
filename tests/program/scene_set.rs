//! `--set KEY=VALUE`: the keys that it sets, the keys that it displaces, and how it is refused.

use std::path::Path;

use crate::shared_program::{cases, has, rendered};
use dovetail::scene::{self, SceneError};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::{FrequencyRange, ResponseSpec, Scene, StaticSpec};
use dovetail_solver::dlft::settings::Solver;
use dovetail_solver::model::{ExcitationKind, LoadKind, LoadSpec, MaterialSpec, MatrixSource};
use dovetail_solver::model::{Gap, MeshKind};

const PAPER: &str = include_str!("../../scenes/paper.toml");

fn parse(overrides: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    scene::parse(PAPER, "paper.toml", Path::new("scenes"), &overrides)
}

/// Requires that the arguments are refused with these words, and that the last of them is shown.
#[track_caller]
fn refused(overrides: &[&str], words: &str) {
    let error = parse(overrides).expect_err("the argument is wrong");
    let text = rendered(&error);
    has(&text, words);
    has(&text, "[--set:1:");
    has(&text, overrides[overrides.len() - 1]);
}

/// Requires that each argument is refused with the words beside it.
#[track_caller]
fn each_refused(table: &str) {
    for [argument, words] in cases(table) {
        refused(&[&argument], &words);
    }
}

/// What `scene::values` reads, as text; with the argument set before.
fn values(key: &str, set: &str) -> Vec<String> {
    let overrides = [set.to_owned()];
    let found = scene::values(PAPER, "paper.toml", &overrides, key).unwrap();
    found.iter().map(ToString::to_string).collect()
}

#[test]
fn values_are_read_by_the_paths_that_set_them() {
    let set = "contact.left.friction=0.1";
    assert_eq!(values("contact.left.friction", set), ["0.1"]);
    assert_eq!(values("contact.0.friction", set), ["0.1"]);
    assert_eq!(values("contact.*.friction", set), ["0.1", "0.3"]);
    assert_eq!(values("excitation.0.direction.1", set), ["1"]);
    assert!(values("response.slip_threshold_m", set).is_empty());
    let [whole] = &values("", set)[..] else {
        panic!("not one table");
    };
    has(whole, "friction = 0.1");
    let refused = |key: &str, words: &str| {
        let error = scene::values(PAPER, "paper.toml", &[], key).unwrap_err();
        has(&rendered(&error), words);
    };
    refused(
        "contact.middle.friction",
        "`contact` has no element \"middle\"",
    );
    refused(
        "response.harmonics.first",
        "`response.harmonics` is a single value",
    );
}

#[test]
fn keys_are_reached_by_name_number_and_star_and_the_last_wins() {
    let scene = parse(&[
        "response.points=20",
        "mesh.parameters.nu=8",
        "mesh.parameters.lc=2.5",
        "contact.left.friction=0.1",
        "contact.1.gap_m = 1e-6",
        "body.*.poisson=0.3",
        "response.solver=powell",
        "observe.0.name=\"top\"",
        "excitation.0.direction=[0, 0, 2]",
        "excitation.0.direction.1=2",
        "response.points=21",
        "static={ load_steps = 3 }",
    ])
    .unwrap();
    assert_eq!(scene.response.points, Some(21));
    let assembly = scene.assembly().unwrap();
    assert_eq!(assembly.contacts[0].pair_law, PairLaw::rigid(0.1, 0.0));
    assert_eq!(assembly.contacts[1].pair_law, PairLaw::rigid(0.3, 1e-6));
    assert!(
        assembly.bodies.iter().all(
            |b| matches!(b.matrices, MatrixSource::Elements(MaterialSpec::Given(material)) if material.poisson == 0.3)
        )
    );
    assert_eq!(scene.response.solver, Solver::Powell);
    assert_eq!(assembly.observations[0].name, "top");
    let half = 0.5f64.sqrt();
    let ExcitationKind::Load(LoadSpec {
        load: LoadKind::Force {
            vector_n: [x, y, z],
        },
        ..
    }) = assembly.excitations[0].kind
    else {
        panic!("{:?}", assembly.excitations[0]);
    };
    assert!(x == 0.0 && (y - half).abs() < 1e-15 && (z - half).abs() < 1e-15);
    assert_eq!(scene.static_state.load_steps, 3);
    let MeshKind::Geometry { parameters, .. } = &assembly.mesh.as_ref().unwrap().kind else {
        panic!()
    };
    let value = |name: &str| parameters.iter().find(|p| p.0 == name).map(|p| p.1);
    assert_eq!(
        (value("nu"), value("nv"), value("lc")),
        (Some(8.0), Some(9.0), Some(2.5))
    );
    assert_eq!(
        assembly.mesh.as_ref().unwrap().kind.equivalent_fallback(),
        None,
        "the ready mesh is another one"
    );
}

#[test]
fn a_key_displaces_those_of_the_file_that_it_excludes() {
    let scene = parse(&["response.frequency_hz=[440, 460]", "damping.mass_per_s=2"]).unwrap();
    let hz = FrequencyRange::Hz {
        from_hz: 440.0,
        to_hz: 460.0,
    };
    assert_eq!(scene.response.range, hz);
    let rayleigh = DampingSpec::Rayleigh {
        stiffness_s: 0.0,
        mass_per_s: 2.0,
    };
    assert_eq!(scene.damping, rayleigh);
    let scene = parse(&["mesh.file=../meshes/x.msh"]).unwrap();
    let path = Path::new("scenes").join("../meshes/x.msh");
    let assembly = scene.assembly().unwrap();
    assert_eq!(
        assembly.mesh.as_ref().unwrap().kind,
        MeshKind::File { path }
    );
    // What excludes nothing displaces nothing.
    let scene = parse(&["response.slip_threshold_m=1e-9", "mesh.metres_per_unit=1"]).unwrap();
    assert_eq!(scene.response.slip_threshold_m, Some(1e-9));
    let assembly = scene.assembly().unwrap();
    assert!(matches!(
        assembly.mesh.as_ref().unwrap().kind,
        MeshKind::Geometry { .. }
    ));
    // Two arguments that exclude each other are the caller's contradiction.
    let both = [
        "response.frequency_hz=[1, 2]",
        "response.times_first_linear_mode=[1, 2]",
    ];
    refused(&both, "exclude each other");
    // One frequency is a range when it is the only one.
    let one = parse(&["response.frequency_hz=[450, 450]", "response.points=1"]).unwrap();
    assert_eq!(
        one.response.range,
        FrequencyRange::Hz {
            from_hz: 450.0,
            to_hz: 450.0
        }
    );
}

#[test]
fn an_empty_value_removes() {
    let scene = parse(&["rotation=", "contact.right="]).unwrap();
    let assembly = scene.assembly().unwrap();
    assert_eq!(assembly.rotation, None);
    assert_eq!(
        assembly
            .contacts
            .iter()
            .map(|c| c.name.as_str())
            .collect::<Vec<_>>(),
        ["left"]
    );
}

#[test]
fn what_the_paper_writes_out_is_mostly_the_default() {
    let defaults = [
        "mesh.time_limit_s",
        "body.blade.fixed",
        "rotation.point_m",
        "rotation.bodies",
        "contact.*.gap_m",
        "damping.linear_mode",
        "excitation.0.harmonic",
        "excitation.0.phase_deg",
        "static",
        "response.samples",
        "response.eps",
        "response.eps_scale",
        "response.tolerance",
        "response.max_newton_iterations",
        "response.solver",
    ]
    .map(|key| format!("{key}="));
    let defaults: Vec<&str> = defaults.iter().map(String::as_str).collect();
    assert_eq!(parse(&defaults).unwrap(), parse(&[]).unwrap());
}

/// The library and the checker of scenes have the same defaults.
#[test]
fn a_response_that_asks_for_no_more_is_that_of_the_library() {
    let leave_out = ["stuck_modes", "compare_harmonics"].map(|key| format!("response.{key}="));
    let leave_out: Vec<&str> = leave_out.iter().map(String::as_str).collect();
    let fixed = parse(&leave_out).unwrap();
    let mut adapted = leave_out.clone();
    adapted.extend([
        "response.harmonics=",
        "response.samples=",
        "response.tolerance=",
    ]);
    for scene in [fixed, parse(&adapted).unwrap()] {
        let own = &scene.response;
        assert_eq!(*own, ResponseSpec::new(own.range, own.resolution));
        assert_eq!(scene.static_state, StaticSpec::default());
    }
}

#[test]
fn what_a_scene_says_of_how_flanks_lie_is_what_they_are_paired_by() {
    let contact = |overrides: &[&str]| {
        let scene = parse(overrides).unwrap();
        let contact = &scene.assembly().unwrap().contacts[0];
        (contact.gap, contact.search_distance_m)
    };
    assert_eq!(contact(&[]), (Gap::Closed, None));
    let far = ["contact.0.gap=mesh", "contact.0.search_distance_m=2e-3"];
    assert_eq!(contact(&far), (Gap::Mesh, Some(2e-3)));
}

#[test]
fn an_unknown_path_names_the_valid_ones() {
    each_refused(
        "
        response.pionts=20 => unknown key `response.pionts` & did you mean `points`?
        & the keys of `response` are
        meshes.file=a => unknown section or key `meshes` & did you mean `mesh`? & rotation
        contact.lft.friction=0 => no element \"lft\" & did you mean `left`? & left, right
        contact.2.friction=0 => no element \"2\" & left, right; a number
        response.samples.x=0 => `response.samples` is a single value
        & --set response.samples=VALUE
        response.accuracy= => no `response.accuracy` to remove
        no.such.thing= => no `no` to remove
        ",
    );
    let two = ["response.points=5", "static.x.y=1"];
    refused(&two, "unknown key `static.x` & load_steps");
}

#[test]
fn a_wrong_value_is_refused_as_in_the_file_but_shown_in_the_argument() {
    each_refused(
        "
        response.points=-3 => `response.points` & -3 & whole number
        response.points=0 => `response.points` is 0 & from 1 to
        response.points=many => string \"many\", expected a whole number
        body.jaw.poisson=0.5 => `body.jaw.poisson` is 0.5 & less than 0.5
        contact.*.friction=-1 => `contact.left.friction` is -1 & 0 or more
        contact.*.friction=x => `contact.left.friction` has the wrong type
        response=3 => `response` has to be a table
        response.samples=7 => set response.samples to 16 or more
        rotation.axis=[0, 0, 0] => `rotation.axis` has no direction
        ",
    );
    let two = ["response.stuck_modes=2", "damping.linear_mode=3"];
    refused(&two, "only 2 stuck modes are kept");
}

#[test]
fn an_argument_without_key_or_value_shows_how_it_is_written() {
    for argument in [
        "response.points",
        "=3",
        "response..points=3",
        ".=3",
        "response.=3",
    ] {
        let words = "`--set` needs KEY=VALUE & --set response.points=20";
        refused(&[argument], words);
    }
}
