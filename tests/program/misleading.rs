//! Mistakes of the first hour: wrong units, supports, names and directions. Each has a message that
//! names the likely mistake and its remedy, and a right scene has none of them.

use std::fmt::Write;

use crate::shared_folder::Folder;
use crate::shared_program::{cases, ended, has, printed, said, scene_command, told, unwrapped};
use dovetail_mesh::{ElementType, Mesh};
use dovetail_testkit::block::{block, map_nodes, side_by_side};

/// A block on another one, which is pressed on it and excited at a corner of its top.
const SCENE: &str = r#"
name = "blocks"
mesh = { file = "blocks.inp", metres_per_unit = 1e-3 }
[[body]]
name = "upper"
volume = "UPPER_VOLUME"
young_pa = 210e9
poisson = 0.3
density_kg_m3 = 7850
[[body]]
name = "lower"
volume = "LOWER_VOLUME"
young_pa = 210e9
poisson = 0.3
density_kg_m3 = 7850
fixed = ["LOWER_Z_MIN"]
[[contact]]
name = "joint"
first = "UPPER_Z_MIN"
second = "LOWER_Z_MAX"
friction = 0.3
[[load]]
on = "UPPER_Z_MAX"
pressure_pa = 1e6
[damping]
ratio = 0.005
[[excitation]]
on = "UPPER_CORNER_111"
direction = [1, 0, 0]
force_n = 0.8
[[observe]]
name = "top"
points = "UPPER_CORNER_111"
direction = [1, 0, 0]
[response]
times_first_linear_mode = [0.97, 1.03]
points = 3
harmonics = 1
"#;

/// The two blocks in millimetres. The lower one reaches from -20 to `top`.
fn blocks(element: ElementType, top: f64) -> Mesh {
    let upper = block(element, [3, 3, 4], [20.0, 20.0, 30.0]);
    let mut lower = block(element, [3, 3, 3], [20.0, 20.0, 20.0 + top]);
    map_nodes(&mut lower, |[x, y, z]| [x, y, z - 20.0]);
    side_by_side(("upper", &upper), ("lower", &lower))
}

/// Deck of a mesh, with its groups as sets, and the sides of the lower block below its flank.
fn deck(mesh: &Mesh) -> String {
    let mut text = String::from("*NODE\n");
    for (tag, [x, y, z]) in mesh.node_tags.iter().zip(&mesh.nodes_m) {
        writeln!(text, "{tag}, {x:?}, {y:?}, {z:?}").unwrap();
    }
    let tag = |node: &u32| mesh.node_tags[*node as usize].to_string();
    for (e, nodes) in mesh.elements.iter().enumerate() {
        let tags: Vec<String> = nodes.iter().map(tag).collect();
        let (kind, number) = (nodes.len(), e + 1);
        writeln!(
            text,
            "*ELEMENT, TYPE=C3D{kind}\n{number}, {}",
            tags.join(", ")
        )
        .unwrap();
    }
    let sides = mesh.nodes_m.iter().zip(&mesh.node_tags);
    let sides = sides.filter(|([_, y, z], _)| *z < -1.0 && [0.0, 20.0].contains(y));
    let sides: Vec<String> = sides.map(|(_, tag)| tag.to_string()).collect();
    writeln!(text, "*NSET, NSET=SIDES\n{}", sides.join(",\n")).unwrap();
    for (name, group) in &mesh.groups {
        let (keyword, members) = match group.dimension {
            3 => {
                let numbers = group.elements.iter().map(|e| (e + 1).to_string());
                ("ELSET", numbers.collect::<Vec<_>>())
            }
            _ => ("NSET", group.nodes.iter().map(tag).collect()),
        };
        writeln!(text, "*{keyword}, {keyword}={}", name.to_uppercase()).unwrap();
        for line in members.chunks(8) {
            writeln!(text, "{}", line.join(", ")).unwrap();
        }
    }
    text
}

/// Folder with the scene and the deck of its blocks.
fn folder(name: &str, element: ElementType) -> Folder {
    let folder = Folder::new(name);
    folder.write("blocks.inp", deck(&blocks(element, 0.0)));
    folder.write("scene.toml", SCENE);
    folder
}

/// Output of a command on the scene, on one line, with these keys set, `;` between them. The command
/// has to end with `code`.
#[track_caller]
fn tried(command: &str, folder: &Folder, set: &str, code: i32) -> String {
    let set: Vec<&str> = set.split("; ").filter(|set| *set != "-").collect();
    let scene = folder.join("scene.toml");
    let mut program = scene_command(command, scene, &folder.join("out"), &set);
    let output = ended(program.arg("--force"), code);
    unwrapped(&(said(&output) + &printed(&output)))
}

/// The scene as it is has no warning, and names its elements with their order.
#[test]
fn a_right_scene_has_no_warning() {
    let folder = folder("misleading-right", ElementType::HEX8);
    let said = tried(
        "run",
        &folder,
        "response.points=; response.accuracy=0.05; excitation.0.force_n=0.4",
        0,
    );
    assert!(!said.contains("warning"), "{said}");
    has(&said, "63 linear hexahedra of 8 nodes & with friction");
}

#[test]
fn likely_mistakes_are_warned_of_with_their_remedy() {
    let folder = folder("misleading-warned", ElementType::HEX8);
    let table = "
        mesh.metres_per_unit=1
            => 20.0 m x 20.0 m x 50.0 m & 157 kt & looks like millimetres & `metres_per_unit = 0.001` of [mesh]
        mesh.metres_per_unit=; mesh.units=m-kg-s => looks like millimetres & `units = \"mm-t-s\"` of [mesh]
        mesh.metres_per_unit=1e-6 => 50.0 µm & looks like millimetres
        mesh.metres_per_unit=1e3 => looks like millimetres
        body.upper.density_kg_m3=7.85 => looks like g/cm3 & density_kg_m3 = 7850
        body.upper.density_kg_m3=7.85e-9 => looks like t/mm3 & density_kg_m3 = 7850
        body.upper.young_pa=210e3 => looks like MPa & young_pa = 2.1e11
        body.upper.endurance_pa=300; body.upper.ultimate_pa=900 => look like MPa & endurance_pa = 3e8
        contact.joint.friction=30 => looks like per cent & friction = 0.3
        excitation.0.phase_deg=1.5708 => phase_deg = 1.5708 looks like radians & 90 degrees
        ";
    for [set, words] in cases(table) {
        let told = tried("mesh", &folder, &set, 0);
        has(&told, "warning: ");
        has(&told, &words);
    }
}

/// Coefficients that experts use are not doubted.
#[test]
fn what_is_unusual_but_possible_is_not_warned_of() {
    let folder = folder("misleading-possible", ElementType::HEX8);
    for set in [
        "contact.joint.friction=1.2",
        "excitation.0.phase_deg=90",
        "excitation.0.phase_deg=2",
        "body.upper.density_kg_m3=19300",
        "body.upper.young_pa=1e9",
    ] {
        let told = tried("mesh", &folder, set, 0);
        assert!(!told.contains("warning"), "{set}: {told}");
    }
}

#[test]
fn mistakes_that_a_response_shows_are_warned_of_with_their_remedy() {
    let folder = folder("misleading-response", ElementType::HEX8);
    let table = "
        excitation.0.on=UPPER_Z_MAX; excitation.0.direction=[0, 0, 1]
            => excites no mode of the range & by symmetry & direction of [[excitation]] & is at
        observe.0.points=UPPER_Z_MAX; observe.0.direction=[0, 0, 1]
            => `top` does not move in the modes & direction of [[observe]]
        damping.ratio=0.5 => 50 % of critical damping & ratio = 0.005
        excitation.0.force_n=8e-4 => all pairs stick at all frequencies
        contact.joint.gap_m=1e-3; body.upper.fixed=[\"UPPER_X_MAX\"]; load.0.on=UPPER_Y_MAX
            => all 16 pairs of contact `joint` are open at rest & gap_m
        response.times_first_linear_mode=; response.frequency_hz=[100, 200]
            => at an end of the range & nearest linear mode
        ";
    for [set, words] in cases(table) {
        let set = set.replace(
            "UPPER_X_MAX\"]; ",
            "UPPER_X_MAX\"]; excitation.0.on=UPPER_CORNER_011; observe.0.points=UPPER_CORNER_011; ",
        );
        has(&tried("run", &folder, &set, 0), &words);
    }
    let said = tried("run", &folder, "excitation.0.force_n=800", 3);
    has(
        &said,
        "the bodies would come apart & check the units of force_n",
    );
    let said = tried("run", &folder, "load.0.pressure_pa=-1e6", 1);
    has(
        &said,
        "nothing holds body `upper` & a pressure_pa above 0 presses",
    );
}

/// A force that is nearly across the motion of a mode excites it weakly.
#[test]
fn a_weak_force_is_not_one_that_excites_nothing() {
    let folder = folder("misleading-weak", ElementType::HEX8);
    for direction in ["[0.01, 0, 1]", "[0, 1, 0]"] {
        let set = format!(
            "excitation.0.on=UPPER_Z_MAX; excitation.0.direction={direction}; observe.0.direction={direction}"
        );
        let said = tried("run", &folder, &set, 0);
        assert!(!said.contains("excites no mode"), "{said}");
        assert!(!said.contains("does not move"), "{said}");
    }
}

#[test]
fn linear_elements_that_are_too_stiff_are_warned_of() {
    for (element, is_stiff) in [
        (ElementType::TET4, true),
        (ElementType::WEDGE6, true),
        (ElementType::HEX8, false),
        (ElementType::TET10, false),
    ] {
        let folder = folder("misleading-stiff", element);
        let said = tried("mesh", &folder, "-", 0);
        let order = if is_stiff { "linear" } else { "of" };
        has(&said, &format!("{order} & of {} nodes", element.nodes()));
        let warned = said.contains("too stiff in bending") && said.contains("second order");
        assert_eq!(warned, is_stiff, "{element:?}: {said}");
    }
}

/// The lower block reaches into the upper one, or ends below it.
#[test]
fn bodies_that_overlap_are_told_from_bodies_that_are_apart() {
    let folder = folder("misleading-overlap", ElementType::HEX8);
    let table = "
        2 => warning & the bodies overlap by up to 2.00 mm & interference
        -2 => warning & the flanks are up to 2.00 mm apart & clearance
        ";
    for [top, words] in cases(table) {
        let mesh = blocks(ElementType::HEX8, top.parse().unwrap());
        folder.write("blocks.inp", deck(&mesh));
        let said = tried("mesh", &folder, "-", 0);
        has(&said, &words);
        let counted = tried("mesh", &folder, "contact.joint.gap=mesh", 0);
        let told = [" in the mesh, and", " in the mesh and"];
        assert!(
            told.iter().all(|words| !counted.contains(words)),
            "{counted}"
        );
    }
    for (top, words) in [
        (
            12.0,
            "each lies behind the other, by 1.200e-2 m & if the bodies overlap",
        ),
        (
            -12.0,
            "the nearest two are 1.200e-2 m apart & search_distance_m",
        ),
    ] {
        folder.write("blocks.inp", deck(&blocks(ElementType::HEX8, top)));
        has(&tried("mesh", &folder, "-", 2), words);
    }
}

#[test]
fn names_that_do_not_exist_are_shown_in_the_scene_with_the_one_that_was_meant() {
    let folder = folder("misleading-names", ElementType::HEX8);
    let table = "
        friction => UPPER_ZMIN => first = \"UPPER_Z_MIN\" => scene.toml:19 & did you mean `UPPER_Z_MIN`?
        excitation => UPPER_CORNER => on = \"UPPER_CORNER_111\" => excitation 1 & scene.toml:28 & did you mean `UPPER_CORNER_
        support => lower_z_min => fixed = [\"LOWER_Z_MIN\"] => scene.toml:16 & did you mean `LOWER_Z_MIN`?
        volume => UPER_VOLUME => volume = \"UPPER_VOLUME\" => scene.toml:6 & did you mean `UPPER_VOLUME`?
        ";
    for [what, wrong, line, words] in cases(table) {
        let right = line.split('"').nth(1).unwrap();
        let text = SCENE.replacen(&line, &line.replace(right, &wrong), 1);
        assert_ne!(text, SCENE, "{what}");
        folder.write("scene.toml", text);
        has(&tried("mesh", &folder, "-", 2), &words);
    }
    folder.write("scene.toml", SCENE);
    let table = "
        contact.joint.first=nothing_like_it
            => the mesh has no group `nothing_like_it`; surfaces and points it has: & --set:1 & not in the mesh
        observe.0.points=UPPER_CORNER_11 => --set:1 & did you mean `UPPER_CORNER_
        mesh.file=block.inp => block.inp & did you mean `blocks.inp`?
        mesh.file=other/mesh.inp => counts from the folder of the scene
        excitation.0.on=LOWER_Z_MIN => fixed & --set:1
        observe.0.points=LOWER_Z_MIN => fixed & --set:1
        contact.joint.second=LOWER_Z_MIN => name the surfaces that touch & scene.toml:17
        body.lower.fixed=[\"LOWER_VOLUME\"] => every node of body `lower` is fixed & scene.toml:10
        body.lower.volume=UPPER_VOLUME => taken already
        ";
    for [set, words] in cases(table) {
        has(&tried("mesh", &folder, &set, 2), &words);
    }
}

#[test]
fn shares_in_per_cent_are_told_as_shares() {
    let folder = folder("misleading-per-cent", ElementType::HEX8);
    let table = "
        body.upper.poisson=30 => less than 0.5; 30 % is 0.3
        damping.ratio=2 => less than 1; 2 % is 0.02
        body.upper.poisson=0.5 => less than 0.5
        Mesh.metres_per_unit=1 => did you mean `mesh`?
        observe.0.direction=[0, 0, 0] => length is zero
        contact.joint.second=UPPER_Z_MIN => the same group as `first`
        body.lower.fixed= => every body floats
        ";
    for [set, words] in cases(table) {
        let said = tried("check", &folder, &set, 2);
        has(&said, &words);
        assert_eq!(said.contains(" % is "), words.contains(" % is "), "{said}");
    }
    let single = SCENE.replace("[[contact]]", "[contact]");
    folder.write("scene.toml", single);
    has(
        &tried("check", &folder, "-", 2),
        "has to be a list of tables & [[contact]]",
    );
}

/// A blade in a sector of a disc: the axis is at its right place, in the blade, and along it.
#[test]
fn an_axis_through_a_body_and_free_sides_of_a_sector_are_told() {
    let folder = folder("misleading-axis", ElementType::HEX8);
    let rotation = "[rotation]\naxis = [1, 0, 0]\npoint_m = [0.01, 0.01, -0.3]\nspeed_rpm = 3000\n";
    let load = "[[load]]\non = \"UPPER_Z_MAX\"\npressure_pa = 1e6\n";
    assert!(SCENE.contains(load));
    folder.write("scene.toml", SCENE.replace(load, rotation));
    let table = "
        - => lower: its sides are free & fixed_y & [cyclic]
        rotation.point_m=[0.01, 0.01, 0] => the axis of rotation runs through body \"upper\" & point_m
        rotation.axis=[0, 0, 1] => the axis of rotation runs through the middle of body \"upper\" & does not throw
        ";
    for [set, words] in cases(table) {
        let said = tried("mesh", &folder, &set, 0);
        has(&said, &words);
        assert_eq!(
            said.contains("axis of rotation"),
            words.contains("axis of"),
            "{said}"
        );
    }
    // The sides may be held, and the load of a speed of 0 spreads nothing.
    let held = "body.lower.fixed_y=[\"SIDES\"]";
    for set in [held, "rotation.speed_rpm=0"] {
        let said = tried("mesh", &folder, set, 0);
        assert!(!said.contains("sides are free"), "{said}");
    }
}

/// Bonded flanks answer in closed form: neither friction nor a grid is spoken of.
#[test]
fn a_linear_run_speaks_of_no_friction_and_no_grid() {
    let folder = folder("misleading-bonded", ElementType::HEX8);
    let bonded = "contact.joint.law=bonded; response.points=";
    let said = tried("run", &folder, bonded, 0);
    has(&said, "linear, for all contacts are bonded");
    for words in ["with friction", "response.points", "followed", "warning"] {
        assert!(!said.contains(words), "{words}: {said}");
    }
    // The peak is found between the frequencies that draw the curve.
    let summary = crate::shared_runs::summary(&folder.join("out"));
    let of = |key: &str| summary["response"][key].as_f64().unwrap();
    let off = of("peak_amplitude_m") / of("linear_peak_amplitude_m") - 1.0;
    assert!(off.abs() < 1e-9, "{off:e}");
    let coarse = tried(
        "run",
        &folder,
        "contact.joint.law=bonded; response.points=4",
        0,
    );
    has(&coarse, "leave them out: the curve then has its peak");
}

/// Each warning is printed once, however early it comes.
#[test]
fn a_warning_comes_once() {
    let folder = folder("misleading-once", ElementType::HEX8);
    let said = tried("run", &folder, "contact.joint.friction=30", 0);
    assert_eq!(said.matches("looks like per cent").count(), 1, "{said}");
    has(&said, "1 warning above, before the response");
    let out = folder.join("quiet");
    let mut quiet = scene_command(
        "run",
        folder.join("scene.toml"),
        &out,
        &["contact.joint.friction=30"],
    );
    let said = told(quiet.arg("--quiet"), 0);
    assert_eq!(said.matches("looks like per cent").count(), 1, "{said}");
}

/// A lower block that is moved across the slot is as in a fir tree, and one that is moved along it, or far
/// across, may be next to its place.
#[test]
fn flanks_that_protrude_across_the_slot_are_not_warned_of() {
    let folder = folder("misleading-protrude", ElementType::HEX8);
    for (along, across, is_told) in [
        (0.0, 6.0, false),
        (10.0, 0.0, true),
        (10.0, 6.0, true),
        (0.0, 14.0, true),
    ] {
        let upper = block(ElementType::HEX8, [6, 3, 4], [40.0, 20.0, 30.0]);
        let mut lower = block(ElementType::HEX8, [6, 3, 3], [40.0, 20.0, 20.0]);
        map_nodes(&mut lower, |[x, y, z]| [x + along, y + across, z - 20.0]);
        let both = side_by_side(("upper", &upper), ("lower", &lower));
        folder.write("blocks.inp", deck(&both));
        let said = tried("mesh", &folder, "-", 0);
        let warned = said.contains("neither flank lies wholly opposite the other at contact joint");
        assert_eq!(warned, is_told, "{along} along, {across} across: {said}");
    }
}
