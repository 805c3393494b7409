//! The limits in the README are correct: what they exclude fails with a message about it, and what
//! they permit runs.

use crate::shared_folder::Folder;
use crate::shared_program::{SMALL, cases, has, program, scene_command, told};
use crate::shared_runs::Run;
use dovetail_testkit::folder::root;

/// Checks that a sentence is in the section "Limits" of the README; the page may break its lines
/// elsewhere.
#[track_caller]
fn readme_says(sentence: &str) {
    let page = std::fs::read_to_string(root().join("README.md")).unwrap();
    let (_, limits) = page.split_once("\n## Limits\n").unwrap();
    let limits = limits.split("\n## ").next().unwrap();
    let limits = limits.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(limits.contains(sentence), "README, Limits: {sentence}");
}

#[test]
fn what_a_scene_cannot_ask_for_is_refused() {
    let table = "
        There is no mistuning. => cyclic.mistuning=0.01 => unknown key `cyclic.mistuning`
        no Coriolis force => rotation.coriolis=true => unknown key `rotation.coriolis`
        A body of finite elements has one Young's modulus => body.0.young_pa=[1e11,2e11,3e11]
        => expected a finite number
        Each contact has one coefficient of friction => contact.left.friction=[0.3,0.2]
        => expected a finite number
        and one stiffness per area => contact.left.normal_stiffness_n_m3=[1e14,1e13]
        => expected a finite number
        on linear springs between them => contact.left.normal_stiffness_n_m3=1e14
        => tangential_stiffness_n_m3
        There are no subharmonics => excitation.0.harmonic=0.5 => expected a whole number
        one number at a time => response.force_n=[1,2] => unknown key `response.force_n`
        ";
    for [sentence, setting, message] in cases(table) {
        readme_says(&sentence);
        let words = ["check", "scenes/paper.toml", "--set", &setting];
        has(&told(program(root(), &words), 2), &message);
    }
}

#[test]
fn a_slide_that_is_too_far_is_an_error() {
    let message = "a pair that slides farther than 20 % of the shorter side of its flank";
    readme_says(&format!("{message} is an error"));
    let out = Folder::new("limits-slide");
    let set = [SMALL, "rotation.speed_rpm=50000"];
    let said = told(scene_command("static", "scenes/paper.toml", &out, &set), 1);
    has(&said, &message.replace("that slides", "slides"));
}

#[test]
fn elements_with_nodes_inside_faces_are_refused() {
    readme_says("Elements with nodes inside their faces are not read");
    let folder = Folder::new("limits-elements");
    let deck = folder.write(
        "deck.inp",
        "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D27, ELSET=a\n1,1\n",
    );
    let words = ["groups", deck.to_str().unwrap()];
    has(&told(program(root(), &words), 2), "have nodes inside faces");
}

/// Two blocks, the lower face of the upper one being the flank of two contacts.
#[test]
fn a_node_is_the_slave_of_one_contact() {
    readme_says("a node can be the slave of one contact only");
    let folder = Folder::new("limits-slave");
    let patch = root().join("scenes/verification/spring_blocks.toml");
    let patch = std::fs::read_to_string(patch).unwrap();
    let mesh = root().join("meshes/blocks_order1.msh");
    let patch = patch.replace("../../meshes/blocks_order1.msh", mesh.to_str().unwrap());
    let contacts = |second: &str| {
        format!(
            "{patch}\n[[contact]]\nname = \"one\"\nfirst = \"upper_bottom\"\nsecond = \"lower_top\"\nfriction = 0.3\n\
             [[contact]]\nname = \"other\"\nfirst = \"{second}\"\nfriction = 0.3\n"
        )
    };
    for (second, code) in [("upper_bottom", 2), ("base", 0)] {
        let scene = folder.write("scene.toml", contacts(second));
        let mut mesh = scene_command("mesh", scene, &folder.join("out"), &[]);
        let said = told(mesh.arg("--force"), code);
        let message = "would follow the opposite flanks of contacts `one` and `other`";
        assert_eq!(said.contains(message), code == 2, "{said}");
    }
}

/// Bodies on springs alone, on rigid ground, and several with flanks that do not match.
#[test]
fn any_number_of_bodies_and_contacts_is_taken() {
    readme_says("any number of them, on each other, on springs or on rigid ground");
    readme_says("The meshes of two flanks need not match");
    let counts = |command, scene, set: &[&str]| {
        let mesh = &Run::new(command, scene, "limits-granted", set).summary()["mesh"];
        let [bodies, contacts] = ["bodies", "contacts"].map(|key| mesh[key].as_array().unwrap());
        let differ = contacts.iter().any(|c| c["nodes_match"] == false);
        (bodies.len(), contacts.len(), differ)
    };
    assert_eq!(
        counts("run", "verification/spring_blocks", &[]),
        (2, 0, false)
    );
    let ready = ["mesh.file=../../meshes/verification/hertz.msh"];
    assert_eq!(
        counts("static", "verification/hertz_rigid", &ready),
        (1, 0, false)
    );
    assert_eq!(counts("mesh", "platform_damper", &[]), (3, 2, true));
    let (bodies, contacts, _) = counts("mesh", "shroud", &[]);
    assert_eq!((bodies, contacts), (4, 5));
}

#[test]
fn a_scene_that_nothing_presses_together_is_warned_of() {
    let folder = Folder::new("limits-pressed");
    let said = |set: &[&str]| {
        let scene = "scenes/paper.toml";
        told(scene_command("check", scene, &folder.join("out"), set), 0)
    };
    let warning = "no steady load presses the contacts together";
    has(&said(&["rotation.speed_rpm=0"]), warning);
    for pressed in [
        &[][..],
        &["rotation.speed_rpm=0", "contact.*.gap_m=-1e-6"],
        &["rotation.speed_rpm=0", "contact.*.law=bonded"],
    ] {
        assert!(!said(pressed).contains(warning), "{pressed:?}");
    }
}

/// The wedge of the damper has the finer mesh: its nodes follow the platforms.
#[test]
fn flanks_that_do_not_match_are_told_with_which_follows_which() {
    let folder = Folder::new("limits-follows");
    let damper = "scenes/platform_damper.toml";
    let said = told(scene_command("mesh", damper, &folder.join("out"), &[]), 0);
    for (wedge, platform) in [
        ("wedge_right", "platform_left"),
        ("wedge_left", "b.platform_right"),
    ] {
        let follows = format!("each node of `{wedge}` follows a mean of nodes of `{platform}`");
        has(&said, &follows);
        let line = said.lines().find(|line| line.contains(&follows)).unwrap();
        let covered = format!("100.0 % of the area of `{wedge}`");
        has(
            line,
            &format!("{covered} & `{platform}` lie opposite the other"),
        );
    }
}

/// The paper's joint with springs between its flanks: it tends to the rigid one, and soft springs
/// lower its resonance.
#[test]
fn flanks_on_springs_are_taken() {
    readme_says("rigid or on linear springs between them");
    let run = |name: &str, springs_n_m3: Option<f64>| {
        let mut set = vec![
            SMALL.to_owned(),
            "response.points=5".to_owned(),
            "response.compare_harmonics=".to_owned(),
            "response.frequency_hz=[440,460]".to_owned(),
        ];
        for side in ["left", "right"] {
            for key in ["normal_stiffness_n_m3", "tangential_stiffness_n_m3"] {
                set.extend(springs_n_m3.map(|n_m3| format!("contact.{side}.{key}={n_m3:e}")));
            }
        }
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let run = Run::run_without_fields("paper", name, &set);
        let table = run.table("response.csv");
        assert!(table.iter().all(|row| row["outcome"] == "converged"));
        let linear_hz = run.summary()["linear_frequency_hz"].as_f64().unwrap();
        (run.column("response.csv", "tip_amplitude_m"), linear_hz)
    };
    let (rigid, rigid_hz) = run("rigid", None);
    let (stiff, stiff_hz) = run("stiff", Some(1e17));
    let (soft, soft_hz) = run("soft", Some(1e13));
    let differences = |other: &[f64]| {
        let ratios = other.iter().zip(&rigid).map(|(a, b)| (a / b - 1.0).abs());
        ratios.fold(0.0, f64::max)
    };
    let [to_stiff, to_soft] = [&stiff, &soft].map(|of| differences(of));
    println!("{to_stiff:.1e} {to_soft:.1e}, {rigid_hz} {stiff_hz} {soft_hz} Hz");
    assert!(to_stiff < 0.01 && to_soft > 10.0 * to_stiff);
    assert!((stiff_hz / rigid_hz - 1.0).abs() < 1e-4);
    assert!(soft_hz < 0.999 * rigid_hz);
}
