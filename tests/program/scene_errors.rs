//! An invalid scene is refused with the line, the valid values and the remedy; the reader never
//! panics. Every case changes one thing in the committed scene of the paper.

use std::path::Path;

use crate::shared_program::{cases, ended, has, printed, program, rendered};
use dovetail::scene::{self, SceneError};
use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_testkit::folder::root;

const PAPER: &str = include_str!("../../scenes/paper.toml");

fn parse(text: &str, overrides: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    scene::parse(text, "paper.toml", Path::new("scenes"), &overrides)
}

/// Text with the `nth` occurrence of `find` replaced, and the number of its line.
fn edited(find: &str, nth: usize, replace: &str) -> (String, usize) {
    let at = PAPER
        .match_indices(find)
        .nth(nth)
        .unwrap_or_else(|| panic!("no {find:?} in the scene"))
        .0;
    let text = format!("{}{replace}{}", &PAPER[..at], &PAPER[at + find.len()..]);
    (text, 1 + PAPER[..at].matches('\n').count())
}

/// Replaces the first text of each case by the second, and requires a single error, on that line
/// and with the words of the third.
#[track_caller]
fn refused(table: &str) {
    for [find, replace, words] in cases(table) {
        refused_at(&find, 0, &replace, &words);
    }
}

#[track_caller]
fn refused_at(find: &str, nth: usize, replace: &str, words: &str) {
    let (text, line) = edited(find, nth, replace);
    refused_on(&text, line, words);
}

/// Replaces `find` and requires a single error on the line after the first one of the replaced
/// text.
#[track_caller]
fn refused_later(find: &str, replace: &str, words: &str) {
    let (text, line) = edited(find, 0, replace);
    refused_on(&text, line + 1, words);
}

/// Requires a single error in a text, on this line and with these words.
#[track_caller]
fn refused_on(text: &str, line: usize, words: &str) {
    let error = parse(text, &[]).expect_err("the scene is wrong");
    let message = rendered(&error);
    assert_eq!(count(&error), 1, "{message}");
    has(&message, words);
    has(&message, &format!("[paper.toml:{line}:"));
}

/// Number of the line that begins with `start`.
fn line_of(text: &str, start: &str) -> usize {
    1 + text
        .lines()
        .position(|l| l.starts_with(start))
        .unwrap_or_else(|| panic!("no {start:?}"))
}

fn count(error: &SceneError) -> usize {
    match error {
        SceneError::Invalid { problems } => problems.len(),
        SceneError::Read { .. } => 0,
    }
}

// --- keys ---------------------------------------------------------------------------------------

#[test]
fn an_unknown_key_names_the_near_one_and_all_others() {
    refused(
        r#"
        poisson = 0.34 => poison = 0.34 => unknown key `body.blade.poison`
        & did you mean `poisson`?
        & translation_m, volume, material, young_pa, poisson, density_kg_m3
        load_steps = 10 => steps_of_the_load = 10 => the keys of `static` are: load_steps
        harmonic = 1 => colour = 1 => unknown key `excitation.0.colour` & not a key & phase_deg
        eps = "dynamic" => epsilon = "pair" => `response.epsilon` & did you mean `eps`?
        "#,
    );
}

#[test]
fn an_unknown_section_names_the_sections() {
    refused(
        r#"
        [rotation] => [rotatoin] => `rotatoin` & did you mean `rotation`?
        & contact, spring, dashpot, load, damping
        [[observe]] => [[watch]] => unknown section or key `watch` & excitation, observe, static
        name = "paper" => title = "paper" => unknown section or key `title`
        & name, reduced_model, mesh, body
        "#,
    );
}

#[test]
fn a_key_of_an_earlier_version_is_told_with_what_took_its_place() {
    let table = r#"
        on = "excitation" => points = "excitation" => did you mean `on`?
        linear_mode = 1 => stuck_mode = 1 => did you mean `linear_mode`?
        times_first_linear_mode = [ => times_first_stuck_mode = [
        => did you mean `times_first_linear_mode`?
        metres_per_unit = 1e-3 => pairing_tolerance = 1e-3
        => did you mean `search_distance_m of [[contact]]`?
        "#;
    for [find, replace, words] in cases(table) {
        let (text, _) = edited(&find, 0, &replace);
        has(&rendered(&parse(&text, &[]).unwrap_err()), &words);
    }
}

#[test]
fn a_key_twice_is_a_syntax_error_on_its_second_line() {
    refused("speed_rpm = 5000 => axis = [1, 0, 0] => not TOML & duplicate key");
}

#[test]
fn text_that_is_not_toml_points_at_the_place() {
    refused_at("friction = 0.3 ", 0, "friction = ", "not TOML");
    refused(
        r#"
        eps = "dynamic" => eps = dynamic => not TOML & double quotes
        [static] => [static => not TOML
        "#,
    );
}

// --- types --------------------------------------------------------------------------------------

#[test]
fn a_wrong_type_shows_how_to_write_the_key() {
    refused(
        r#"
        young_pa = 113.8e9 => young_pa = "113.8e9" => `body.blade.young_pa` has the wrong type
        & string "113.8e9", expected a finite number & write it like this: young_pa = 113.8e9
        # points = 200 => points = 2.5 => `response.points` & expected a whole number, 0 or more
        # points = 200 => points = -3 => `response.points` & -3 & expected a whole number
        name = "tip" => name = 7 => `observe.0.name` & expected a string & name = "tip"
        fixed = ["jaw_base"] => fixed = "jaw_base" => expected a sequence & ["jaw_base"]
        fixed = ["jaw_base"] => fixed = ["jaw_base", 3] => `body.jaw.fixed.1` & expected a string
        order = 2 } => order = true } => `mesh.parameters.order` & boolean `true`
        "#,
    );
}

#[test]
fn vectors_and_ranges_have_their_lengths() {
    refused(
        r#"
        direction = [0, 1, 0] => direction = [0, 1] => length 2 & a list of 3 finite numbers
        direction = [0, 1, 0] => direction = [0, 1, 0, 0] => length 4 & a list of 3 finite numbers
        axis = [1, 0, 0] => axis = "x" => `rotation.axis` & axis = [1, 0, 0]
        [0.98, 1.02] => [0.98] => `response.times_first_linear_mode` & a list of 2 finite numbers
        "#,
    );
}

#[test]
fn nan_and_infinity_are_not_numbers() {
    for value in ["nan", "inf", "-inf", "1e999"] {
        for key in [
            "young_pa = 113.8e9",
            "metres_per_unit = 1e-3",
            "tolerance = 1e-8",
            "force_n = 2.0",
        ] {
            let name = key.split(" = ").next().unwrap();
            let words = format!("{name} & has the wrong type");
            refused_at(key, 0, &format!("{name} = {value}"), &words);
        }
        let point = format!("point_m = [0, {value}, 0]");
        refused_at("point_m = [0, 0, 0]", 0, &point, "rotation.point_m");
    }
}

#[test]
fn a_section_of_the_wrong_shape_shows_the_right_one() {
    refused(
        r#"
        [[observe]] => [observe] => `observe` has to be a list of tables & [[observe]]
        [static] => [[static]] => `static` has to be a table & [static]
        "#,
    );
}

// --- values -------------------------------------------------------------------------------------

#[test]
fn impossible_materials_are_refused() {
    refused(
        r#"
        young_pa = 113.8e9 => young_pa = -113.8e9 => `body.blade.young_pa` is
        & must be greater than 0
        young_pa = 113.8e9 => young_pa = 0 => `body.blade.young_pa` is & must be greater than 0
        density_kg_m3 = 4430 => density_kg_m3 = 0.0 => `body.blade.density_kg_m3` & greater than 0
        "#,
    );
    for poisson in ["0.5", "-1", "3"] {
        let words = "`body.jaw.poisson` is & greater than -1 and less than 0.5";
        refused_at("poisson = 0.34", 1, &format!("poisson = {poisson}"), words);
    }
}

#[test]
fn impossible_numbers_are_refused() {
    refused(
        r#"
        metres_per_unit = 1e-3 => metres_per_unit = 0 => greater than 0
        time_limit_s = 120 => time_limit_s = -1 => `mesh.time_limit_s` is -1
        friction = 0.3 => search_distance_m = 0\nfriction = 0.3
        => `contact.left.search_distance_m` is 0 & greater than 0
        friction = 0.3 => friction = -0.3 => `contact.left.friction` is -0.3 & 0 or more
        speed_rpm = 5000 => speed_rpm = -5000 => `rotation.speed_rpm` & 0 or more
        ratio = 0.001 => ratio = -0.001 => `damping.ratio` & 0 or more and less than 1
        linear_mode = 1 => linear_mode = 0 => `damping.linear_mode` is 0 & from 1 to
        force_n = 2.0 => force_n = -2.0 => `excitation.0.force_n` & 0 or more
        harmonic = 1 => harmonic = 0 => `excitation.0.harmonic` is 0 & from 1 to
        load_steps = 10 => load_steps = 0 => `static.load_steps` is 0
        # points = 200 => points = 0 => `response.points` is 0 & from 1 to
        harmonics = 3 => harmonics = 0 => `response.harmonics` is 0
        eps_scale = 1.0 => eps_scale = 0.0 => `response.eps_scale` & greater than 0
        tolerance = 1e-8 => tolerance = 1.0 => greater than 0 and less than 0.001
        max_newton_iterations = 60 => max_newton_iterations = 0 => from 1 to
        "#,
    );
}

#[test]
fn a_zero_direction_is_refused() {
    refused("axis = [1, 0, 0] => axis = [0, 0.0, -0.0] => `rotation.axis` has no direction");
    let words = "`observe.tip.direction` has no direction & such as [0, 1, 0] for y";
    refused_at("direction = [0, 1, 0]", 1, "direction = [0, 0, 0]", words);
}

#[test]
fn too_few_samples_say_how_many_are_needed() {
    let words = "15 samples & 3 harmonics & set response.samples to 16 or more";
    refused_at("samples = 128", 0, "samples = 15", words);
    let (text, _) = edited("harmonics = 3", 0, "harmonics = 64");
    let line = line_of(&text, "samples = 128");
    refused_on(&text, line, "set response.samples to 260 or more");
    assert!(parse(&edited("samples = 128", 0, "samples = 16").0, &[]).is_ok());
}

#[test]
fn an_excitation_has_one_cause_with_the_keys_that_it_needs() {
    let both = "force_n = 2.0\npressure_pa = 3";
    let words = "`excitation.0.force_n` and `excitation.0.pressure_pa` \
                 & keep one of `force_n`, `traction_pa`, `pressure_pa`, `file`";
    refused_later("force_n = 2.0", both, words);
    let words = "`excitation.0.factor` is given without `excitation.0.file` \
                 & multiplies the values";
    refused_later("force_n = 2.0", "force_n = 2.0\nfactor = 3", words);
    let table = r#"
        pressure_pa = 3 => `excitation.0.pressure_pa` and `excitation.0.direction`
        & `traction_pa` has a direction
        file = "p.csv" => `excitation.0.file` and `excitation.0.direction` & three components
        base_displacement_m = 1e-6 => `excitation.0.base_displacement_m` and `excitation.0.on`
        & move as one
        "#;
    for [keys, words] in cases(table) {
        let (text, _) = edited("force_n = 2.0", 0, &keys);
        has(&rendered(&parse(&text, &[]).expect_err(&keys)), &words);
    }
    let (text, _) = edited("force_n = 2.0", 0, "");
    let words = "neither `excitation.0.force_n` nor `excitation.0.traction_pa` nor \
                 & add one of them, for example: force_n = 2.0";
    refused_on(&text, line_of(PAPER, "[[excitation]]"), words);
    for keys in ["traction_pa = 3", "force_n = 0"] {
        assert!(parse(&edited("force_n = 2.0", 0, keys).0, &[]).is_ok());
    }
    let base = [
        "excitation.0.on=",
        "excitation.0.force_n=",
        "excitation.0.base_acceleration_m_s2=3",
    ];
    assert!(parse(PAPER, &base).is_ok());
    let field = [
        "excitation.0.direction=",
        "excitation.0.force_n=",
        "excitation.0.file=p.csv",
    ];
    assert!(parse(PAPER, &field).is_ok());
}

#[test]
fn an_excitation_above_the_kept_harmonics_is_refused() {
    let words = "`excitation.0.harmonic` is 4 & keeps only 3 \
                 & set response.harmonics to 4 or more";
    refused_at("harmonic = 1", 0, "harmonic = 4", words);
    assert!(parse(&edited("harmonic = 1", 0, "harmonic = 3").0, &[]).is_ok());
}

#[test]
fn a_range_runs_upwards_from_above_zero() {
    let words = "`response.times_first_linear_mode` runs from & [from, to] with 0 < from < to";
    for range in ["[1.02, 0.98]", "[0.0, 1.0]", "[-1.0, 1.0]"] {
        refused_at("[0.98, 1.02]", 0, range, words);
    }
    // One frequency is no grid of several.
    refused_at("[0.98, 1.02]", 0, "[1.0, 1.0]\npoints = 2", words);
    for points in ["points = 1", ""] {
        let (text, _) = edited("[0.98, 1.02]", 0, &format!("[1.0, 1.0]\n{points}"));
        assert!(parse(&text, &[]).is_ok(), "{points}");
    }
}

#[test]
fn a_choice_that_does_not_exist_names_those_that_do() {
    refused(
        r#"
        solver = "newton_krylov" => solver = "newton" => no choice "newton"
        & did you mean `newton_krylov`? & "newton_krylov", "powell"
        eps = "dynamic" => eps = "rho" => the choices are: "dynamic", "pair", "spectral_radius"
        prestress = "held_flanks" => prestress = "yes" => "contact", "held_flanks", "none"
        "#,
    );
}

#[test]
fn names_are_fit_for_files_and_not_used_twice() {
    refused(
        r#"
        name = "paper" => name = "../paper" => "../paper" is not a name & begin with a letter
        name = "paper" => name = "" => is not a name
        name = "tip" => name = "2 tips" => letters, digits
        name = "right" => name = "left" => "left" is taken already & first here & used again
        volume = "jaw" => volume = "blade" => "blade" is taken already
        second = "jaw_flank_left" => second = " " => `contact.left.second` is empty
        "#,
    );
}

#[test]
fn a_rotating_body_has_to_exist() {
    refused(
        r#"
        bodies = ["blade", "jaw"] => bodies = ["blades", "jaw"] => no body "blades"
        & did you mean `blade`? & the bodies of this scene are: blade, jaw
        bodies = ["blade", "jaw"] => bodies = ["jaw", "jaw"] => taken already
        "#,
    );
}

#[test]
fn keys_that_exclude_each_other_are_refused_together() {
    let (text, _) = edited("time_limit_s = 120", 0, "file = \"x.msh\"");
    let words = "`mesh.file` and `mesh.geometry` exclude each other & not both & the other";
    refused_on(&text, line_of(&text, "geometry ="), words);
    let words = "`damping.ratio` and `damping.mass_per_s` exclude each other";
    refused_at("linear_mode = 1", 0, "mass_per_s = 0.1", words);
    let (text, _) = edited("# points = 200", 0, "frequency_hz = [440, 460]");
    let words = "`response.frequency_hz` and `response.times_first_linear_mode` exclude each other";
    refused_on(&text, line_of(&text, "times_first"), words);
}

// --- what is missing ----------------------------------------------------------------------------

#[test]
fn a_missing_key_points_at_the_heading_of_its_table() {
    let table = r#"
        [mesh] => 0 => metres_per_unit = 1e-3 => neither `mesh.units` nor `mesh.metres_per_unit`
        [[body]] => 0 => young_pa = 113.8e9 => `body.blade.young_pa` is missing
        [rotation] => 0 => speed_rpm = 5000 => `rotation.speed_rpm` is missing
        [rotation] => 0 => axis = [1, 0, 0] => `rotation.axis` is missing
        [[contact]] => 0 => friction = 0.3 => `contact.left.friction` is missing
        [[contact]] => 1 => first = "blade_flank_right" => `contact.right.first` is missing
        [[observe]] => 0 => name = "tip" => `observe.0.name` is missing
        "#;
    for [heading, nth, line, words] in cases(table) {
        let (text, _) = edited(&line, 0, "");
        let heading = format!("\n{heading}");
        let mut headings = text.match_indices(&heading);
        let (at, _) = headings.nth(nth.parse().unwrap()).unwrap();
        let heading_line = 2 + text[..at].matches('\n').count();
        refused_on(&text, heading_line, &words);
        refused_on(&text, heading_line, "help: add ");
    }
    let (text, _) = edited("name = \"paper\"", 0, "");
    refused_on(&text, 1, "`name` is missing & name = \"paper\"");
}

#[test]
fn a_table_that_needs_one_of_several_keys_names_them() {
    let (text, _) = edited("times_first_linear_mode", 0, "# ");
    let words = "neither `response.frequency_hz` nor `response.times_first_linear_mode`";
    refused_on(&text, line_of(&text, "[response]"), words);
    let (text, _) = edited("ratio = 0.001", 0, "");
    let neither = text.replace("linear_mode = 1 ", "");
    let words = "nor `damping.stiffness_s` & ratio = 0.001";
    refused_on(&neither, line_of(&neither, "[damping]"), words);
    let words = "`damping.linear_mode` is given without `damping.ratio`";
    refused_on(&text, line_of(&text, "linear_mode = 1"), words);
    let (text, _) = edited("fallback_parameters = {", 0, "# ");
    let words = "`mesh.fallback` is given without `mesh.fallback_parameters`";
    refused_on(&text, line_of(&text, "fallback ="), words);
}

#[test]
fn a_scene_without_a_section_says_which_and_how_it_begins() {
    let error = parse("name = \"empty\"\n", &[]).unwrap_err();
    let message = rendered(&error);
    for section in [
        "[mesh]",
        "[damping]",
        "[[excitation]]",
        "[[observe]]",
        "[response]",
    ] {
        has(&message, &format!("the scene has no {section}"));
    }
    has(&message, "the scene has no body");
    has(
        &message,
        "add it, beginning for example like this: [mesh] file =",
    );
    assert_eq!(count(&error), 6);
    assert_eq!(count(&parse("", &[]).unwrap_err()), 7);
}

#[test]
fn of_any_number_of_bodies_one_is_held() {
    let third =
        "[[body]]\nname = \"c\"\nvolume = \"c\"\nyoung_pa = 1\npoisson = 0\ndensity_kg_m3 = 1\n";
    let scene = parse(&format!("{PAPER}{third}"), &[]).unwrap();
    assert_eq!(scene.assembly().unwrap().bodies.len(), 3);
    let (text, _) = edited("fixed = [\"jaw_base\"]", 0, "");
    let second = 2 + text[..text.rfind("\n[[body]]").unwrap()]
        .matches('\n')
        .count();
    let words = "no body is fixed anywhere & fixed = [\"jaw_base\"]";
    refused_on(&text, second, words);
    // Rigid ground holds what rests on it.
    parse(&text.replacen("second = \"jaw_flank_left\"", "", 1), &[]).unwrap();
}

#[test]
fn springs_are_checked_and_hold_what_nothing_else_does() {
    let on_base = "\n[[spring]]\nname = \"foot\"\nfirst = \"jaw_base\"\nstiffness_n_m = 1e6\n";
    let (text, _) = edited("fixed = [\"jaw_base\"]", 0, "");
    let refused = rendered(&parse(&text, &[]).unwrap_err());
    has(&refused, "or hold a body by a [[spring]] to ground");
    assert!(parse(&format!("{text}{on_base}"), &[]).is_ok());
    let between = on_base.replace("stiffness", "second = \"excitation\"\nstiffness");
    assert!(parse(&format!("{text}{between}"), &[]).is_err());
    let whole = format!("{PAPER}{on_base}");
    let spring = parse(&format!("{whole}direction = [0, 3, 4]"), &[]).unwrap();
    let spring = spring.assembly().unwrap().springs[0].clone();
    assert_eq!(spring.direction, Some([0.0, 0.6, 0.8]));
    assert_eq!((spring.second, spring.stiffness_n_m), (None, 1e6));
    let line = |key: &str, text: &str| 1 + text[..text.rfind(key).unwrap()].matches('\n').count();
    let table = r#"
        1e6 => 0 => stiffness_n_m => `spring.foot.stiffness_n_m` & must be greater than 0
        1e6 => -5 => stiffness_n_m => `spring.foot.stiffness_n_m`
        stiffness_n_m = 1e6 =>  => [[spring]] => `spring.foot.stiffness_n_m` is missing
        1e6 => 1e6\ndirection = [0, 0, 0] => direction => `spring.foot.direction`
        1e6 => 1e6\nsecond = "jaw_base" => second => jaw_base
        "#;
    for [find, replace, key, words] in cases(table) {
        let text = format!("{PAPER}{}", on_base.replacen(&find, &replace, 1));
        refused_on(&text, line(&key, &text), &words);
    }
    let twice = format!("{whole}{on_base}");
    refused_on(&twice, line("name", &twice), "foot");
}

#[test]
fn a_flank_without_another_is_on_rigid_ground_and_a_bonded_one_needs_no_friction() {
    let ground = PAPER.replacen("second = \"jaw_flank_left\"", "", 1);
    let scene = parse(&ground, &[]).unwrap();
    assert_eq!(scene.assembly().unwrap().contacts[0].second, None);
    refused(
        r#"
        second = "jaw_flank_left" => second = "blade_flank_left"
        => `contact.left.second` is the same group as `first` & rigid ground
        second = "jaw_flank_left" => slave = "first"
        => `contact.left.slave` & second & rigid ground
        second = "jaw_flank_left" => gap = "mesh" => `contact.left.gap` & second & rigid ground
        second = "jaw_flank_left" => search_distance_m = 1e-3
        => `contact.left.search_distance_m` & second & rigid ground
        friction = 0.3 => slave = "third"\nfriction = 0.3 => third & first & second
        friction = 0.3 => law = "glued"\nfriction = 0.3 => glued & bonded
        "#,
    );
    let (bonded, _) = edited("friction = 0.3", 0, "law = \"bonded\"");
    let scene = parse(&bonded, &[]).unwrap();
    let laws = scene.assembly().unwrap().contacts.iter().map(|c| c.law);
    use dovetail_solver::model::ContactLaw::{Bonded, UnilateralCoulomb};
    assert_eq!(laws.collect::<Vec<_>>(), [Bonded, UnilateralCoulomb]);
    let (plain, line) = edited("friction = 0.3", 0, "");
    let contact = plain[..plain.find("\nname = \"left\"").unwrap()]
        .matches('\n')
        .count()
        + 1;
    assert!(line > contact);
    refused_on(&plain, contact, "`contact.left.friction`");
}

// --- the whole ----------------------------------------------------------------------------------

#[test]
fn all_problems_of_a_file_come_at_once_in_the_order_of_its_lines() {
    let in_order = |text: &str, words: &[&str]| {
        let error = parse(text, &[]).unwrap_err();
        let message = rendered(&error);
        assert_eq!(count(&error), words.len(), "{message}");
        let place = |word: &&str| {
            message
                .find(word)
                .unwrap_or_else(|| panic!("no {word}: {message}"))
        };
        assert!(words.iter().map(place).is_sorted(), "{message}");
        assert!(
            error
                .to_string()
                .contains(&format!("the first of {} errors", words.len()))
        );
    };
    let values = PAPER
        .replace("poisson = 0.34", "poisson = 0.6")
        .replace("# points = 200", "points = 0");
    let from = values.find("[[observe]]").unwrap();
    let to = values.find("[static]").unwrap();
    let without_observe = format!("{}{}", &values[..from], &values[to..]);
    let words = [
        "`body.blade.poisson`",
        "`body.jaw.poisson`",
        "`response.points`",
        "no [[observe]]",
    ];
    in_order(&without_observe, &words);

    let text = PAPER
        .replacen("order = 2 }", "order = \"2\" }", 1)
        .replace("poisson =", "poison =")
        .replace("# points = 200", "points = \"many\"");
    let words = [
        "mesh.parameters.order",
        "blade.poison",
        "jaw.poison",
        "`response.points`",
    ];
    in_order(&text, &words);
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let error = scene::load(Path::new("scenes/no_such_scene.toml"), &[]).unwrap_err();
    assert!(rendered(&error).contains("scenes/no_such_scene.toml cannot be read"));
}

#[test]
fn the_scene_of_the_paper_says_what_the_paper_says() {
    let scene = scene::load(Path::new("scenes/paper.toml"), &[]).unwrap();
    assert_eq!(scene, parse(PAPER, &[]).unwrap());
    assert_eq!(scene.name, "paper");
    let assembly = scene.assembly().unwrap();
    let rotation = assembly.rotation.as_ref().unwrap();
    assert!((rotation.speed_rad_s - 523.598_775_598_298_8).abs() < 1e-9);
    assert_eq!(
        (rotation.axis, rotation.point_m),
        ([1.0, 0.0, 0.0], [0.0; 3])
    );
    assert_eq!(rotation.bodies, ["blade", "jaw"]);
    assert_eq!(assembly.contacts.len(), 2);
    assert_eq!(
        scene.damping,
        DampingSpec::Ratio {
            ratio: 0.001,
            linear_mode: 1
        }
    );
    let response = &scene.response;
    assert_eq!(
        (response.resolution, response.points),
        (Resolution::fixed(3, 128), None)
    );
    let fallback = Path::new("scenes").join("../meshes/dovetail.msh");
    assert_eq!(
        assembly.mesh.as_ref().unwrap().kind.equivalent_fallback(),
        Some(fallback.as_path())
    );
}

#[test]
fn the_program_refuses_a_wrong_scene_with_code_2_and_plain_text() {
    for arguments in [
        &["check", "scenes/paper.toml", "--set", "response.points=0"][..],
        &["check", "scenes/no_such_scene.toml"],
        &["check"],
        &["fly", "scenes/paper.toml"],
    ] {
        let output = ended(program(root(), arguments), 2);
        assert!(output.stdout.is_empty() && !output.stderr.is_empty());
        let plain = |b: &u8| *b == b'\n' || (b' '..127).contains(b);
        assert!(
            output.stderr.iter().all(plain),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
    let help = printed(&ended(program(root(), &["run", "--help"]), 0));
    has(&help, "--set 'contact.*.friction=0.1'");
}
