//! A disc of equal sectors from one of them, against all of its sectors.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use crate::shared_program::{ended, has, printed, scene_command, told};
use crate::shared_runs::{Row, Run, number, rows};
use dovetail_testkit::folder::{Folder, root};
use vtkio::model::{Attribute, DataSet, Piece, Vtk};

const SECTORS: usize = 6;
/// Nodes of disc_sector.msh.
const NODES: usize = 94;

const STEEL: &str = "young_pa = 210e9\npoisson = 0.3\ndensity_kg_m3 = 7800\n";

/// Bonded flanks may be held along axes, not fixed.
const BORE: &str = "fixed_x = [\"bore\"]\nfixed_y = [\"bore\"]\nfixed_z = [\"bore\"]\n";

const CYCLIC: &str =
    "[cyclic]\nsectors = 6\nlow = [\"low\"]\nhigh = [\"high\"]\naxis = [1, 0, 0]\n";

fn mesh(name: &str) -> PathBuf {
    root().join("meshes/verification").join(name)
}

/// Direction of the first sector, turned about x to where a sector stands.
fn turned([x, y, z]: [f64; 3], sector: usize) -> String {
    let (sine, cosine) = (TAU * sector as f64 / SECTORS as f64).sin_cos();
    let (y, z) = (y * cosine - z * sine, y * sine + z * cosine);
    format!("[{x}, {y}, {z}]")
}

/// Name of a body, or of a group of it, in a sector. The first sector has the bodies themselves.
fn sector_name(body: &str, sector: usize) -> String {
    match sector {
        0 => body.to_owned(),
        sector => format!("{body}{sector}"),
    }
}

/// Bodies of so many sectors; each is a disc whose bore is held, with or without a blade of its own.
fn bodies(file: &str, sectors: usize, names: &[&str]) -> String {
    let mut text = String::new();
    for sector in 0..sectors {
        for name in names {
            let own = sector_name(name, sector);
            text += &format!("[[body]]\nname = \"{own}\"\n");
            if sector > 0 {
                let degrees = 360.0 * sector as f64 / SECTORS as f64;
                text += &format!(
                    "copy_of = \"{name}\"\nrotation_axis = [1, 0, 0]\nrotation_deg = {degrees}\n"
                );
                continue;
            }
            let path = mesh(file);
            text += &format!("mesh_file = {path:?}\nmetres_per_unit = 1\nvolume = \"{name}\"\n");
            text += STEEL;
            if *name == "disc" {
                text += BORE;
            }
        }
    }
    if sectors > 1 {
        for sector in 0..sectors {
            let (own, next) = (
                sector_name("disc", sector),
                sector_name("disc", (sector + 1) % sectors),
            );
            text += &format!(
                "[[contact]]\nname = \"pitch{sector}\"\nfirst = \"{own}.high\"\n\
                 second = \"{next}.low\"\nlaw = \"bonded\"\n"
            );
        }
    }
    text
}

/// Section of the disc, excited by an engine order, or in phase.
fn cyclic(order: usize) -> String {
    match order {
        0 => CYCLIC.to_owned(),
        order => format!("{CYCLIC}engine_order = {order}\n"),
    }
}

/// Lag of the excitation of a sector behind that of the first one, degrees.
fn phase_deg(order: usize, sector: usize) -> f64 {
    -360.0 * (order * sector) as f64 / SECTORS as f64
}

/// Scene of so many sectors. One alone has the cyclic symmetry of all.
fn scene(file: &str, sectors: usize, names: &[&str], more: &str) -> String {
    scene_of_order(0, file, sectors, names, more)
}

/// Scene of so many sectors, excited by an engine order.
fn scene_of_order(order: usize, file: &str, sectors: usize, names: &[&str], more: &str) -> String {
    let blade = *names.last().unwrap();
    let mut text = format!("name = \"disc\"\n{}", bodies(file, sectors, names));
    if sectors == 1 {
        text += &cyclic(order);
    }
    for sector in 0..sectors {
        let (tip, along) = (sector_name(blade, sector), turned([1.0, 0.5, 0.0], sector));
        let phase = phase_deg(order, sector);
        text += &format!(
            "[[excitation]]\non = \"{tip}.tip\"\ndirection = {along}\nforce_n = 20\n\
             phase_deg = {phase}\n"
        );
        if names.len() == 2 {
            let inwards = turned([0.0, 0.0, -1.0], sector);
            let seat = sector_name("disc", sector);
            text += &format!(
                "[[load]]\non = \"{tip}.tip\"\ndirection = {inwards}\nforce_n = 5000\n\
                 [[contact]]\nname = \"root{sector}\"\nfirst = \"{tip}.foot\"\n\
                 second = \"{seat}.seat\"\nfriction = 0.3\n"
            );
        }
    }
    text += &format!(
        "[[observe]]\nname = \"tip\"\npoints = \"{blade}.tip\"\ndirection = [1, 0, 1]\n\
         [damping]\nstiffness_s = 3e-6\nmass_per_s = 0\n{more}"
    );
    text
}

const RESPONSE: &str = "[response]\nfrequency_hz = [900, 1100]\npoints = 6\nharmonics = 3\n\
                        samples = 120\ntolerance = 1e-10\nstuck_modes = 400\n";

/// The modes of all nodal diameters are those of the whole disc, of which all but the first and the
/// last come in pairs.
#[test]
fn modes_over_the_nodal_diameters_are_those_of_the_whole_disc() {
    for (file, names) in [
        ("disc_sector.msh", &["disc"][..]),
        ("disc_sector_two.msh", &["disc", "blade"][..]),
    ] {
        let folder = Folder::new("nodal_diameters");
        let run = |sectors: usize| {
            let text = scene(file, sectors, names, RESPONSE);
            let path = folder.write(&format!("{sectors}.toml"), text);
            Run::run_file("modes", path, &format!("nodal_diameters_{sectors}"), &[])
        };
        let (sector, disc) = (run(1), run(SECTORS));
        let rows = sector.table("modes_nodal_diameters.csv");
        let mut expected: Vec<f64> = Vec::new();
        for row in &rows {
            let diameter = number(row, "nodal_diameter") as usize;
            let times = if [0, SECTORS / 2].contains(&diameter) {
                1
            } else {
                2
            };
            expected.extend(vec![number(row, "frequency_hz"); times]);
        }
        assert_eq!(rows.len(), 6 * (SECTORS / 2 + 1));
        expected.sort_by(f64::total_cmp);
        let of_disc = disc.table("modes.csv");
        let of_disc = of_disc.iter().filter(|row| row["kind"] == "stuck");
        let found: Vec<f64> = of_disc.map(|row| number(row, "frequency_hz")).collect();
        // Each nodal diameter has its six lowest alone.
        for (found, expected) in found.iter().zip(&expected).take(12) {
            let error = found / expected - 1.0;
            assert!(error.abs() < 1e-9, "{file}: {found} {expected}");
        }
        let drawn = sector.0.join("plots/nodal_diameters.svg");
        has(
            &std::fs::read_to_string(drawn).unwrap(),
            "nodal diameter & 6 sectors & at rest",
        );
    }
}

/// With the same force on each sector the disc vibrates with friction as the sector does.
#[test]
fn sectors_in_phase_have_the_response_of_the_whole_disc() {
    let folder = Folder::new("sectors_in_phase");
    let run = |sectors: usize| {
        let text = scene("disc_sector_two.msh", sectors, &["disc", "blade"], RESPONSE);
        let path = folder.write(&format!("{sectors}.toml"), text);
        Run::run_file("run", path, &format!("in_phase_{sectors}"), &[])
    };
    let (sector, disc) = (run(1), run(SECTORS));
    let [own, whole] = [&sector, &disc].map(|run| run.table("response.csv"));
    assert_eq!((own.len(), whole.len()), (6, 6));
    for (own, whole) in own.iter().zip(&whole) {
        // Each has its own eps, which three harmonics leave a trace of where pairs slip.
        let [a, b] = [own, whole].map(|row| number(row, "tip_amplitude_m"));
        let allowed = number(own, "estimated_error").max(1e-5);
        assert!((a / b - 1.0).abs() < allowed, "{a} {b} {allowed:e}");
    }
    let slipping = sector.column("response.csv", "slipping_pairs");
    assert!(slipping.iter().any(|pairs| *pairs > 0.0), "{slipping:?}");
    let [own, whole] =
        [&sector, &disc].map(|run| run.column("static_observed.csv", "displacement_m")[0]);
    assert!(
        (own - whole).abs() < 1e-9 * whole.abs().max(1e-9),
        "{own} {whole}"
    );
}

/// Contact through springs.
const SPRINGS: &str = "friction = 0.1\nnormal_stiffness_n_m3 = 4e12\n\
                       tangential_stiffness_n_m3 = 3e12\n";

/// Compares the responses of a sector and of the whole disc, in amplitudes and in powers. Where pairs
/// slip, what they did before the motion became periodic leaves a trace, and each sector begins at
/// another instant.
fn same_response(sector: &Run, disc: &Run, tolerance: f64) {
    let [own, whole] = [sector, disc].map(|run| run.table("response.csv"));
    assert_eq!(own.len(), whole.len());
    for (own, whole) in own.iter().zip(&whole) {
        let input_w = number(own, "input_power_w");
        let slips = number(own, "friction_power_w") > 1e-9 * input_w;
        let tolerance = if slips { 2e-4 } else { tolerance };
        let [a, b] = [own, whole].map(|row| number(row, "tip_amplitude_m"));
        assert!((a / b - 1.0).abs() < tolerance, "{a} {b} {tolerance:e}");
        for column in ["friction_power_w", "viscous_power_w", "input_power_w"] {
            let [a, b] = [own, whole].map(|row| number(row, column));
            let off = (6.0 * a - b).abs() / (6.0 * input_w);
            assert!(off < 5.0 * tolerance, "{column}: {a} {b} {tolerance:e}");
        }
    }
}

/// The wave that an engine order makes is that of all sectors, each excited in its turn: with one
/// body, which is linear, and with blades whose roots slip.
#[test]
fn the_wave_of_an_engine_order_is_that_of_the_whole_disc() {
    let mut slipping = 0.0;
    for (file, names, orders) in [
        ("disc_sector.msh", &["disc"][..], &[1, 2, 3, 4, 5][..]),
        ("disc_sector_two.msh", &["disc", "blade"][..], &[1, 4][..]),
    ] {
        for order in orders {
            let folder = Folder::new("wave");
            let run = |sectors: usize| {
                let text = scene_of_order(*order, file, sectors, names, RESPONSE);
                let text = text.replace("friction = 0.3\n", SPRINGS);
                let text = text.replace("[900, 1100]\npoints = 6", "[900, 1020]\npoints = 4");
                let path = folder.write(&format!("{sectors}.toml"), text);
                Run::run_file("run", path, &format!("wave_{sectors}"), &[])
            };
            let (sector, disc) = (run(1), run(SECTORS));
            same_response(&sector, &disc, 1e-7);
            if names.len() == 2 {
                let pairs = sector.column("response.csv", "slipping_pairs");
                slipping += pairs.iter().sum::<f64>();
            }
        }
    }
    assert!(slipping > 0.0);
}

/// Steps in time of all sectors, each of which may move in its own way, keep to the wave of one.
#[test]
fn steps_in_time_of_all_sectors_agree_with_the_wave() {
    let folder = Folder::new("wave_in_time");
    let dashpot = "[[dashpot]]\nname = \"tip\"\nfirst = \"blade.tip\"\ndamping_n_s_m = 1\n\
                   direction = [1, 0, 0]\n";
    // Neighbours move against each other in engine order 3, and orders 1 and 4 run in opposite
    // directions.
    for (order, hz) in [(1, 1016.2), (3, 1117.2), (4, 1045.5)] {
        let names = ["disc", "blade"];
        let text = scene_of_order(order, "disc_sector_two.msh", 1, &names, RESPONSE);
        let text = text.replace(
            "[damping]\n",
            &format!("{dashpot}[damping]\nmodal_ratios = [0.001]\n"),
        );
        let text = text.replace("stuck_modes = 400", "stuck_modes = 12");
        let text = text.replace("force_n = 20\n", "force_n = 2\n");
        let text = text.replace("stiffness_s = 3e-6", "stiffness_s = 3e-7");
        let path = folder.write("wave.toml", text);
        let out = Folder::new("wave_in_time_verify");
        let mut verify = scene_command("verify", &path, &out, &[]);
        verify.args(["--at", &hz.to_string(), "--steps", "120", "--periods", "40"]);
        ended(verify, 0);
        let [balance, integration] = &rows(&out.join("verify.csv"))[..] else {
            panic!("{order}: one frequency");
        };
        assert!(number(balance, "slipping_pairs") > 0.0, "{order}");
        for figure in ["amplitude", "contact_work", "input_work"] {
            let off = number(integration, &format!("{figure}_difference"));
            assert!(off.abs() < 2e-2, "{order}, {figure}: {off:e}");
            println!("{order} {figure}: {off:e}");
        }
    }
}

/// A wave in which nothing slips has the linear peak, where the springs of contacts carry a part of
/// the vibration, too, which nothing damps.
#[test]
fn a_small_wave_with_springs_in_its_contacts_has_the_linear_peak() {
    let folder = Folder::new("small_wave");
    let text = scene_of_order(4, "disc_sector_two.msh", 1, &["disc", "blade"], RESPONSE);
    let text = text.replace("friction = 0.3\n", &SPRINGS.replace("0.1", "2.0"));
    let text = text.replace("[900, 1100]\npoints = 6", "[950, 990]");
    let path = folder.write("wave.toml", text);
    let run = Run::run_file("run", path, "small_wave", &["excitation.0.force_n=0.01"]);
    let rows = run.table("response.csv");
    let of = |row: &Row| ["tip_amplitude_m", "tip_linear_amplitude_m"].map(|key| number(row, key));
    let peak = rows.iter().max_by(|a, b| of(a)[0].total_cmp(&of(b)[0]));
    let [own, linear] = of(peak.unwrap());
    assert!((own / linear - 1.0).abs() < 1e-4, "{own} {linear}");
    let largest = rows.iter().map(|row| of(row)[1]).fold(0.0, f64::max);
    assert!((own / largest - 1.0).abs() < 1e-4, "{own} {largest}");
}

/// The force of an amplitude is that whose curve has its peak there, in a wave with blades whose roots
/// slip.
#[test]
fn the_peak_of_a_wave_is_where_its_backbone_has_it() {
    let folder = Folder::new("backbone_of_a_wave");
    let text = scene_of_order(4, "disc_sector_two.msh", 1, &["disc", "blade"], RESPONSE);
    let text = text.replace("friction = 0.3\n", SPRINGS);
    let text = text.replace("[900, 1100]\npoints = 6", "[950, 990]");
    let text = text.replace("stuck_modes = 400", "stuck_modes = 12");
    let path = folder.write("wave.toml", text.replace("tolerance = 1e-10\n", ""));
    let out = Folder::new("backbone_of_a_wave_backbone");
    let mut backbone = scene_command("backbone", &path, &out, &[]);
    backbone.args(["--amplitude", "1e-5:2.2e-5", "--points", "3"]);
    ended(backbone, 0);
    let rows = rows(&out.join("backbone.csv"));
    let last = rows.last().unwrap();
    assert!(number(last, "slipping_pairs") > 0.0);
    assert!(number(last, "friction_ratio") > 1e-4);
    assert!(
        rows.iter()
            .all(|row| number(row, "power_defect").abs() < 1e-6)
    );
    let force = format!("excitation.0.force_n={}", number(last, "force_n"));
    let curve = Run::run_file("run", path, "peak_of_a_wave", &[&force]);
    let peak_m = curve
        .column("response.csv", "tip_amplitude_m")
        .into_iter()
        .fold(0.0, f64::max);
    let off = peak_m / number(last, "amplitude_m") - 1.0;
    assert!(off.abs() < 2e-3, "{peak_m}: {off:e}");
}

/// Rims that lift off one another in a wave, without friction and with it, with nodes that meet and
/// that do not.
#[test]
fn rims_lift_off_in_a_wave_as_those_of_the_whole_disc_do() {
    let folder = Folder::new("rims_in_a_wave");
    let (matched, moved) = (mesh("slit_disc.msh"), moved_rim(&folder));
    for (order, friction, file) in [
        (1, 0.0, &matched),
        (2, 0.0, &moved),
        (3, 0.0, &matched),
        (5, 0.3, &moved),
    ] {
        let run = |sectors: usize| {
            let law = SPRINGS.replace("0.1", &friction.to_string());
            let text = rims(file, order, sectors).replace("friction = 0.3\n", &law);
            let text = text.replace("force_n = 2000\n", "force_n = 8000\n");
            let path = folder.write(&format!("{sectors}.toml"), text);
            Run::run_file("run", path, &format!("rims_in_a_wave_{sectors}"), &[])
        };
        let (sector, disc) = (run(1), run(SECTORS));
        // Of pairs that open, the three harmonics keep a trace of eps, which each has of its own.
        same_response(&sector, &disc, 2e-4);
        let open = sector.column("response.csv", "opening_pairs");
        assert!(open.iter().any(|pairs| *pairs > 0.0), "{order}: {open:?}");
    }
}

/// In a run-up, and where modes cross an engine order, the sectors make the wave of that order, as at
/// one speed.
#[test]
fn a_run_up_and_a_crossing_have_the_wave_of_their_engine_order() {
    let folder = Folder::new("wave_at_speed");
    let at = |speed_rpm: f64, order: usize, response: &str| {
        let names = &["disc", "blade"][..];
        let rotation = format!(
            "[rotation]\naxis = [1, 0, 0]\nspeed_rpm = {speed_rpm}\nprestress = \"contact\"\n"
        );
        let more = format!("{rotation}[response]\nharmonics = 3\nsamples = 120\n{response}");
        let text = scene_of_order(order, "disc_sector_two.msh", 1, names, &more);
        let text = text.replace("force_n = 5000\n", "force_n = 400000\n");
        text.replace("stiffness_s = 3e-6", "stiffness_s = 3e-7")
    };
    let run = |text: &str| {
        let path = folder.write("scene.toml", text);
        Run::run_file("run", path, "wave_at_speed", &[])
    };
    let up = "along_engine_order = 4\nspeed_rpm = [14000, 15000]\npoints = 2\n";
    let up = run(&at(15000.0, 0, up));
    let alone = "frequency_hz = [1000, 1000]\npoints = 1\n";
    let alone = run(&at(15000.0, 4, alone));
    let [own, other] = [&up, &alone].map(|run| run.column("response.csv", "tip_amplitude_m"));
    let off = own[1] / other[0] - 1.0;
    assert!(off.abs() < 1e-9, "{own:?} {other:?}");

    let orders = "frequency_hz = [900, 1100]\n[[engine_order]]\norder = 4\ntimes = 1\n";
    let path = folder.write("scene.toml", at(15000.0, 0, orders));
    let out = folder.join("crossings");
    ended(
        scene_command("modes", &path, &out, &[]).args(["--rpm", "14000:16000:3"]),
        0,
    );
    let crossings = rows(&out.join("modes_crossings.csv"));
    let mut crossings = crossings.iter();
    let crossing = crossings
        .find(|row| !row["peak_amplitude_m"].is_empty())
        .unwrap();
    assert_eq!(number(crossing, "nodal_diameter"), 2.0);
    let range = "frequency_hz = [900, 1010]\n";
    let alone = run(&at(number(crossing, "speed_rpm"), 4, range));
    let highest = alone.column("response.csv", "tip_amplitude_m");
    let highest = highest.into_iter().fold(0.0, f64::max);
    let off = number(crossing, "peak_amplitude_m") / highest - 1.0;
    assert!(off.abs() < 2e-4, "{off:e}");

    let both = at(
        15000.0,
        4,
        "along_engine_order = 4\nspeed_rpm = [14000, 15000]\n",
    );
    let path = folder.write("scene.toml", both);
    let said = told(scene_command("mesh", path, &folder.join("out"), &[]), 2);
    has(
        &said,
        "cyclic.engine_order & response.along_engine_order & leave out",
    );
    let path = folder.write("scene.toml", at(15000.0, 4, "frequency_hz = [900, 1100]\n"));
    has(
        &told(scene_command("reduce", path, &folder.join("out"), &[]), 1),
        "all sectors & in phase & engine order 4",
    );
}

/// At speed the stress of the whole disc stiffens it.
#[test]
fn a_disc_at_speed_is_stiffened_as_all_of_its_sectors_are() {
    let folder = Folder::new("disc_at_speed");
    let first = |sectors: usize| {
        let more = format!("[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 20000\n{RESPONSE}");
        let text = scene("disc_sector.msh", sectors, &["disc"], &more);
        let text = text.replace("axis = [1, 0, 0]\n[[exc", "[[exc");
        let path = folder.write(&format!("{sectors}.toml"), text);
        let run = Run::run_file("modes", path, &format!("at_speed_{sectors}"), &[]);
        let rows = run.table("modes.csv");
        let stuck = rows.iter().filter(|row| row["kind"] == "stuck");
        stuck
            .map(|row| number(row, "frequency_hz"))
            .collect::<Vec<_>>()
    };
    let (sector, disc) = (first(1), first(SECTORS));
    let error = |hz: &f64| (hz / sector[0] - 1.0).abs();
    let nearest = disc.iter().map(error).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-9, "{nearest:e}: {sector:?} {disc:?}");
}

/// Over the speed each nodal diameter has its own curves, which only the engine orders cross that
/// excite it.
#[test]
fn engine_orders_cross_the_nodal_diameters_that_they_excite() {
    let folder = Folder::new("disc_campbell");
    let more = format!("[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 10000\n{RESPONSE}");
    let text = scene("disc_sector.msh", 1, &["disc"], &more);
    let path = folder.write("scene.toml", text);
    let out = folder.join("out");
    let mut command = scene_command("modes", path, &out, &[]);
    let output = ended(command.args(["--rpm", "0:20000:3"]), 0);
    has(&printed(&output), "nodal diameter 3");
    let crossings = rows(&out.join("modes_crossings.csv"));
    let of_disc: Vec<_> = crossings
        .iter()
        .filter(|row| row["kind"] == "stuck")
        .collect();
    assert!(of_disc.len() > 10);
    for row in of_disc {
        let (order, diameter) = (
            number(row, "engine_order") as usize,
            number(row, "nodal_diameter"),
        );
        let rest = order % SECTORS;
        assert_eq!(rest.min(SECTORS - rest) as f64, diameter, "{row:?}");
    }
    let rows = rows(&out.join("modes_campbell.csv"));
    assert_eq!(rows.len(), 3 * 6 * (SECTORS / 2 + 1));
}

/// Errors of a sector name the key and the remedy.
/// Scene of a blade that is bonded to a disc which does not yield, excited by an engine order, with the
/// aerodynamic influence of a file.
fn scene_in_flow(order: usize, influence: &str) -> String {
    let names = ["disc", "blade"];
    let response = "[response]\nfrequency_hz = [FIRST, LAST]\npoints = 5\nharmonics = 1\n\
                    stuck_modes = 40\n";
    let text = scene_of_order(order, "disc_sector_two.msh", 1, &names, response);
    let text = text.replacen("young_pa = 210e9", "young_pa = 210e14", 1);
    let text = text.replace("friction = 0.3", "law = \"bonded\"");
    text.replace(
        "axis = [1, 0, 0]\n",
        &format!("axis = [1, 0, 0]\n{influence}"),
    )
}

/// Near its first mode a blade has the amplitude 1 / |m (w0^2 (1 + i a w) - w^2) - A| with the A of its
/// wave, which is that of engine order 5 of 6 sectors, and not that of engine order 1.
#[test]
fn the_air_shifts_and_damps_the_wave_whose_coefficients_are_given() {
    let folder = Folder::new("in_a_flow");
    let still = folder.write(
        "still.toml",
        scene_in_flow(5, "").replace("FIRST, LAST", "1, 2"),
    );
    let modes = Run::run_file("modes", still, "in_still_air", &[]).table("modes.csv");
    let is_first = |row: &&Row| row["kind"] == "flanks_held" && row["body"] == "blade";
    let first = modes.iter().find(is_first).unwrap();
    let [hz, mass] = ["frequency_hz", "modal_mass_kg"].map(|column| number(first, column));
    let stiffness = mass * (TAU * hz).powi(2);
    let [real, imaginary] = [0.02 * stiffness, -0.03 * stiffness];
    let air = |imaginary: f64| {
        format!(
            "nodal_diameter,mode,real_n_m,imaginary_n_m\n-1,1,0,0\n1,1,{real},{imaginary}\n0,1,0,0\n"
        )
    };
    folder.write("air.csv", air(imaginary));
    // More than the damping of the scene takes.
    folder.write("driving.csv", air(-3.0 * imaginary));
    let run = |order: usize, influence: &str, name: &str| {
        let range = format!("{}, {}", 0.98 * hz, 1.02 * hz);
        let text = scene_in_flow(order, influence).replace("FIRST, LAST", &range);
        let path = folder.write(&format!("{name}.toml"), text);
        Run::run_file("run", path, &format!("in_a_flow_{name}"), &[])
    };
    let own = "influence = \"air.csv\"\ninfluence_on = \"blade\"\n";
    for order in [1, 5] {
        let [still, flow] = [("", "still"), (own, "flow")]
            .map(|(influence, name)| run(order, influence, &format!("{name}_{order}")));
        let rows = flow.table("response.csv");
        for (row, still) in rows.iter().zip(still.table("response.csv")) {
            let omega = TAU * number(row, "frequency_hz");
            // Damping of the scene is 3e-6 s times the stiffness.
            let z = [stiffness - mass * omega * omega, stiffness * 3e-6 * omega];
            let in_flow = [z[0] - real, z[1] - imaginary];
            let expected = match order {
                5 => z[0].hypot(z[1]) / in_flow[0].hypot(in_flow[1]),
                _ => 1.0,
            };
            let [a, b] = [row, &still].map(|row| number(row, "tip_amplitude_m"));
            let allowed = if order == 5 { 1e-2 } else { 1e-9 };
            let off = a / b / expected - 1.0;
            assert!(off.abs() < allowed, "{order}: {a} {b} {expected} {off:e}");
            // What the damping takes includes the air.
            let [input, spent] = ["input_power_w", "viscous_power_w"].map(|c| number(row, c));
            assert!(
                (spent / input - 1.0).abs() < 1e-9,
                "{order}: {spent} {input}"
            );
        }
    }
    let driving = own.replace("air.csv", "driving.csv");
    let driven = run(5, &driving, "driven");
    let warnings = driven.summary()["warnings"].to_string();
    has(
        &warnings,
        "the air drives & mode 1, at & damping ratio of \u{2212}",
    );
    // Damping that exceeds the aerodynamic drive prevents flutter in a run-up, with the fields and without.
    folder.write("mild.csv", air(0.25 * stiffness * 3e-6 * TAU * hz));
    let mild = scene_in_flow(0, &own.replace("air.csv", "mild.csv"));
    let turning =
        "[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 100\n[response]\nalong_engine_order = 5\n";
    let range = format!("{}, {}", 0.98 * hz, 1.02 * hz);
    let mild = mild.replace("[response]\n", turning);
    let mild = mild
        .replace("FIRST, LAST", &range)
        .replace("points = 5", "points = 3");
    let path = folder.write("mild.toml", mild);
    for words in [&["--no-fields"][..], &[]] {
        let out = folder.join("mild");
        ended(scene_command("run", &path, &out, &[]).args(words), 0);
        let warnings = std::fs::read_to_string(out.join("summary.json")).unwrap();
        assert!(!warnings.contains("the air drives"), "{words:?}");
    }
    let refused = |command: &str, order: usize, code: i32, words: &str| {
        let text = scene_in_flow(order, own).replace("FIRST, LAST", "900, 1100");
        let path = folder.write("refused.toml", text);
        has(
            &told(scene_command(command, path, &folder, &[]), code),
            words,
        );
    };
    refused(
        "run",
        2,
        2,
        "engine order 2 makes & nodal diameter -2 & 0, 1",
    );
    refused(
        "verify",
        6,
        1,
        "has no aerodynamic influence & leave out `influence`",
    );
}

#[test]
fn what_is_no_sector_is_refused() {
    let folder = Folder::new("no_sector");
    let plain = scene("disc_sector.msh", 1, &["disc"], RESPONSE);
    let turning = "[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 100\n";
    let after = |text: &str, more: &str| text.replace("[damping]", &format!("{more}[damping]"));
    let axis = "axis = [1, 0, 0]\n[[exc";
    for (text, words) in [
        (
            plain
                .replace("[\"low\"]", "[\"x\"]")
                .replace("[\"high\"]", "[\"low\"]")
                .replace("[\"x\"]", "[\"high\"]"),
            "[cyclic] & 10 nodes & exchange `low` and `high`",
        ),
        (
            plain.replace("sectors = 6", "sectors = 7"),
            "one of 7 pitches & Check `sectors`",
        ),
        (
            plain.replace("sectors = 6", "sectors = 1"),
            "cyclic.sectors & from 2 to 10000",
        ),
        (
            plain.replace("[\"high\"]", "[\"tip\"]"),
            "meet no node of `high`",
        ),
        (
            plain.replace("[\"high\"]", "[\"high\", \"tip\"]"),
            "`low` has 10 nodes and `high` has 16",
        ),
        (
            plain.replace("[\"high\"]", "[\"hihg\"]"),
            "[cyclic], high & `hihg` & high",
        ),
        (
            plain.replace("[\"high\"]", "[]"),
            "cyclic.high & at least one",
        ),
        (plain.replace(axis, "[[exc"), "cyclic.axis & missing"),
        (
            after(&plain.replace(axis, "axis = [0, 0, 1]\n[[exc"), turning),
            "cyclic.axis & rotation.axis & leave out `axis`",
        ),
        (
            after(
                &plain.replace(axis, "axis = [1, 0, 0]\npoint_m = [0, 0.1, 0]\n[[exc"),
                turning,
            ),
            "cyclic.point_m & rotation.point_m",
        ),
        (
            after(&plain, &format!("{turning}prestress = \"held_flanks\"\n")),
            "rotation.prestress & [cyclic] & \"contact\"",
        ),
        (
            plain.replace("fixed_y = [\"bore\"]\n", ""),
            "[cyclic]: 2 nodes & support both faces alike",
        ),
        (
            after(
                &plain.replace(BORE, ""),
                "[[spring]]\nname = \"s\"\nfirst = \"bore\"\nstiffness_n_m = 1e9\n\
                 [[contact]]\nname = \"c\"\nfirst = \"low\"\nfriction = 0.3\n",
            ),
            "[cyclic] & 10 nodes of the faces & belong to a contact",
        ),
        (
            after(
                &plain.replace(CYCLIC, ""),
                "[[contact]]\nname = \"c\"\nfirst = \"low\"\nsecond = \"high\"\n\
                 second_sector = \"next\"\nfriction = 0.3\n",
            ),
            "contact.c.second_sector & [cyclic] & leave out",
        ),
        (
            after(
                &plain,
                "[[contact]]\nname = \"c\"\nfirst = \"low\"\nsecond = \"high\"\n\
                 second_sector = \"next\"\nslave = \"second\"\nfriction = 0.3\n",
            ),
            "contact.c.slave & next & leave out `slave`",
        ),
    ] {
        let path = folder.write("scene.toml", &text);
        let said = told(scene_command("mesh", path, &folder.join("out"), &[]), 2);
        has(&said, words);
    }
}

/// Mesh of the disc of [`rims`] whose rims do not match: the line of nodes in the middle of one of them is
/// moved outwards.
fn moved_rim(folder: &Folder) -> PathBuf {
    let text = std::fs::read_to_string(mesh("slit_disc.msh")).unwrap();
    let mut moved = 0;
    let line = |line: &str| {
        let numbers = line.split(' ').map(str::parse);
        let Ok(place) = numbers.collect::<Result<Vec<f64>, _>>() else {
            return line.to_owned();
        };
        let [x, y, z] = place[..] else {
            return line.to_owned();
        };
        let (angle, radius) = ((-y).atan2(z), y.hypot(z));
        let is_middle = (radius - 0.11).abs() < 1e-6 && (angle - TAU / 12.0).abs() < 1e-6;
        if !is_middle {
            return line.to_owned();
        }
        moved += 1;
        let by = 0.114 / 0.11;
        format!("{x} {} {}", by * y, by * z)
    };
    let lines: Vec<String> = text.lines().map(line).collect();
    assert_eq!(moved, 3);
    folder.write("moved_rim.msh", lines.join("\n") + "\n")
}

/// Scene of so many sectors of a disc whose rims press on each other, excited by an engine order.
fn rims(file: &Path, order: usize, sectors: usize) -> String {
    let mut text = "name = \"rims\"\n".to_owned();
    for sector in 0..sectors {
        let own = sector_name("disc", sector);
        text += &format!("[[body]]\nname = \"{own}\"\n");
        text += &match sector {
            0 => format!(
                "mesh_file = {file:?}\nmetres_per_unit = 1\nvolume = \"disc\"\n{STEEL}{BORE}"
            ),
            _ => format!(
                "copy_of = \"disc\"\nrotation_axis = [1, 0, 0]\nrotation_deg = {}\n",
                360.0 * sector as f64 / SECTORS as f64
            ),
        };
        let next = sector_name("disc", (sector + 1) % sectors);
        let neighbour = match sectors {
            1 => "second_sector = \"next\"\n",
            _ => "slave = \"first\"\n",
        };
        text += &format!(
            "[[contact]]\nname = \"rim{sector}\"\nfirst = \"{own}.rim_high\"\n\
             second = \"{next}.rim_low\"\nfriction = 0.3\ngap_m = -2e-6\n{neighbour}"
        );
        if sectors > 1 {
            text += &format!(
                "[[contact]]\nname = \"pitch{sector}\"\nfirst = \"{own}.high\"\n\
                 second = \"{next}.low\"\nlaw = \"bonded\"\n"
            );
        }
        let along = turned([1.0, 0.5, 1.0], sector);
        let phase = phase_deg(order, sector);
        text += &format!(
            "[[excitation]]\non = \"{own}.tip\"\ndirection = {along}\nforce_n = 2000\n\
             phase_deg = {phase}\n"
        );
    }
    if sectors == 1 {
        text += &cyclic(order);
    }
    text += "[[observe]]\nname = \"tip\"\npoints = \"disc.tip\"\ndirection = [1, 1, 1]\n\
             [damping]\nstiffness_s = 3e-7\nmass_per_s = 0\n";
    text + RESPONSE
}

/// A contact with the next sector is that of two neighbours: at rest, stuck at each nodal diameter,
/// and in a vibration that all sectors share.
#[test]
fn a_contact_with_the_next_sector_is_that_of_two_neighbours() {
    let folder = Folder::new("rims");
    let run = |command: &str, sectors: usize| {
        let text = rims(&mesh("slit_disc.msh"), 0, sectors);
        let path = folder.write(&format!("{sectors}.toml"), text);
        Run::run_file(command, path, &format!("rims_{command}_{sectors}"), &[])
    };
    let [sector, disc] = [1, SECTORS].map(|sectors| run("modes", sectors));
    let all = sector.column("modes_nodal_diameters.csv", "frequency_hz");
    let of_disc = disc.table("modes.csv");
    let of_disc = of_disc.iter().filter(|row| row["kind"] == "stuck");
    for row in of_disc.take(12) {
        let hz = number(row, "frequency_hz");
        let nearest = all.iter().map(|own| (own / hz - 1.0).abs());
        assert!(nearest.fold(1.0, f64::min) < 1e-9, "{hz} {all:?}");
    }
    let [sector, disc] = [1, SECTORS].map(|sectors| run("run", sectors));
    let [own, whole] = [&sector, &disc].map(|run| run.table("static.csv"));
    assert_eq!(6 * own.len(), whole.len());
    for (own, whole) in own.iter().zip(&whole) {
        for column in [
            "normal_force_n",
            "friction_t1_n",
            "friction_t2_n",
            "x_m",
            "z_m",
        ] {
            let [a, b] = [own, whole].map(|row| number(row, column));
            assert!((a - b).abs() < 1e-7 * a.abs().max(1.0), "{column}: {a} {b}");
        }
    }
    let [own, whole] = [&sector, &disc].map(|run| run.table("response.csv"));
    for (own, whole) in own.iter().zip(&whole) {
        let [a, b] = [own, whole].map(|row| number(row, "tip_amplitude_m"));
        let errors = [own, whole].map(|row| number(row, "estimated_error"));
        let allowed = (errors[0] + errors[1]).max(1e-5);
        assert!((a / b - 1.0).abs() < allowed, "{a} {b} {allowed:e}");
    }
}

/// Faces whose meshes differ are tied as the bonded flanks of neighbours are, whichever face is finer.
#[test]
fn faces_of_other_meshes_are_those_of_neighbours_bonded_to_each_other() {
    let folder = Folder::new("annulus");
    let run = |name: &str, text: &str| {
        let path = folder.write(&format!("{name}.toml"), text);
        Run::run_file("modes", path, &format!("annulus_{name}"), &[])
    };
    let text = scene("annulus.msh", 1, &["disc"], RESPONSE);
    let backwards =
        "[cyclic]\nsectors = 6\nlow = [\"high\"]\nhigh = [\"low\"]\naxis = [-1, 0, 0]\n";
    let [sector, other_way] = [
        run("sector", &text),
        run("backwards", &text.replace(CYCLIC, backwards)),
    ];
    let whole = scene("annulus.msh", SECTORS, &["disc"], RESPONSE);
    let disc = run("disc", &whole);
    let [all, again] =
        [&sector, &other_way].map(|run| run.column("modes_nodal_diameters.csv", "frequency_hz"));
    for (hz, again) in all.iter().zip(&again) {
        assert!((hz / again - 1.0).abs() < 1e-9, "{hz} {again}");
    }
    let of_disc = disc.table("modes.csv");
    let of_disc = of_disc.iter().filter(|row| row["kind"] == "stuck");
    for row in of_disc.take(12) {
        let hz = number(row, "frequency_hz");
        let nearest = all.iter().map(|own| (own / hz - 1.0).abs());
        assert!(nearest.fold(1.0, f64::min) < 1e-9, "{hz} {all:?}");
    }
}

/// An axis that differs from the axis of the faces is an error or a warning. The axis of the mesh is neither.
#[test]
fn no_sector_with_a_displaced_or_tilted_axis_is_joined_in_silence() {
    let out = Folder::new("displaced_axis");
    let mesh = "mesh.file=../../meshes/verification/disc_sector_two.msh";
    let said = |key: &str, code: i32| {
        let scene = "scenes/verification/bladed_disc.toml";
        told(scene_command("modes", scene, &out, &[mesh, key]), code)
    };
    let right = said("cyclic.point_m=[0.01, 0, 0]", 0);
    assert!(!right.contains("warning: [cyclic]"), "{right}");
    for (key, words) in [
        // From face to face.
        ("cyclic.point_m=[0, 0.01, 0]", "meet no node of `high`"),
        ("cyclic.point_m=[0, 0.001, 0]", "meet no node of `high`"),
        ("cyclic.axis=[1, 0.0175, 0]", "meet no node of `high`"),
    ] {
        has(&said(key, 2), words);
    }
    for (key, words) in [
        // Along the middle of the sector.
        (
            "cyclic.point_m=[0, 0, 0.01]",
            "match, but not their places & warning: [cyclic]: face `high` & 10.0 mm apart",
        ),
        (
            "cyclic.point_m=[0, 0, 0.001]",
            "face `high` & 1.00 mm apart",
        ),
        (
            "cyclic.axis=[1, 0, 0.0175]",
            "warning: [cyclic]: the nodes & apart & axis",
        ),
    ] {
        has(&said(key, 0), words);
    }
}

/// The motion of the wave at its peak is continuous between the sectors of the whole disc.
#[test]
fn a_wave_on_the_whole_disc_is_continuous_between_the_sectors() {
    let folder = Folder::new("disc_in_motion");
    let response = RESPONSE.replace("points = 6", "points = 2");
    let text = scene_of_order(4, "disc_sector.msh", 1, &["disc"], &response);
    let path = folder.write("scene.toml", text);
    let out = folder.join("out");
    let mut command = scene_command("run", &path, &out, &[]);
    ended(command.args(["--whole-disc", "--frames", "4"]), 0);
    let (points, arrays) = vectors(&out.join("peak_disc.vtu"), |name| {
        ["h1_cos_m", "h1_sin_m"].contains(&name)
    });
    assert_eq!((points.len(), arrays.len()), (SECTORS * NODES, 2));
    assert!(meets_alike(&points, &arrays) >= SECTORS * 10);
    // The second sector leads the first one by 240 degrees.
    let [(_, cosine), (_, sine)] = &arrays[..] else {
        panic!("two arrays")
    };
    let (sin, cos) = (TAU * 4.0 / SECTORS as f64).sin_cos();
    let axial = |u: &Vectors, node: usize| u[node][0];
    let largest = (0..NODES).map(|i| axial(cosine, i).hypot(axial(sine, i)));
    let largest = largest.fold(0.0, f64::max);
    for node in 0..NODES {
        let expected = cos * axial(cosine, node) + sin * axial(sine, node);
        let found = axial(cosine, NODES + node);
        assert!((found - expected).abs() < 1e-9 * largest, "{node}");
    }
    let (_, frames) = vectors(&out.join("peak/peak_001.vtu"), |name| {
        name == "oscillation_m"
    });
    for (node, u) in frames[0].1.iter().enumerate() {
        let off = (u[0] - axial(sine, node)).abs();
        assert!(off < 1e-9 * largest, "{node}");
    }
    // So does the report, with 240 degrees in radians.
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    has(
        &page,
        "whole disc & \"disc\":{\"sectors\":6, & \"ahead_rad\":4.18879",
    );
    let paper = root().join("scenes/paper.toml");
    let mut command = scene_command("run", &paper, &folder.join("no"), &[]);
    has(
        &told(command.args(["--whole-disc"]), 1),
        "not about a disc & [cyclic]",
    );
}

/// The stress of a wave, on all sectors of its disc, is that of the whole disc: each sector of it is a
/// body that computes the stress from its own motion.
#[test]
fn the_stress_of_a_wave_on_all_sectors_is_that_of_the_whole_disc() {
    let folder = Folder::new("stress_of_a_wave");
    let run = |sectors: usize, whole: &[&str]| {
        let file = "disc_sector_two.msh";
        let text = scene_of_order(4, file, sectors, &["disc", "blade"], RESPONSE);
        // So small that no pair slips.
        let text = text.replace("friction = 0.3\n", SPRINGS);
        let text = text.replace("force_n = 20\n", "force_n = 0.2\n");
        let text = text.replace("points = 6", "points = 2");
        let path = folder.write(&format!("{sectors}.toml"), text);
        let out = folder.join(format!("out_{sectors}"));
        ended(scene_command("run", &path, &out, &[]).args(whole), 0);
        out
    };
    let is_stress = |name: &str| name.contains("stress") || name.contains("von_mises");
    let (_, own) = arrays(&run(1, &["--whole-disc"]).join("peak_disc.vtu"), is_stress);
    let (_, whole) = arrays(&run(SECTORS, &[]).join("peak.vtu"), is_stress);
    assert_eq!(own.len(), 1 + 2 * 3 + 3);
    // In the third harmonic, in which nothing excites the disc, there is rounding alone.
    let size_of = |values: &[f64]| values.iter().fold(0.0_f64, |size, v| size.max(v.abs()));
    let first_pa = |name: &str| size_of(&whole.iter().find(|(own, _)| own == name).unwrap().1);
    let least_pa = first_pa("h1_stress_cos_pa").max(first_pa("h1_stress_sin_pa"));
    for ((name, a), (other, b)) in own.iter().zip(&whole) {
        assert_eq!((name, a.len()), (other, b.len()));
        let size = size_of(b).max(least_pa);
        for (i, (a, b)) in a.iter().zip(b).enumerate() {
            // The sector has all of its modes, and the disc 400 of those of all sectors.
            assert!((a - b).abs() < 1e-4 * size, "{name} {i}: {a} {b}");
        }
    }
}

type Vectors = Vec<[f64; 3]>;

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// Number of pairs of points that lie at one place, where all vectors are alike.
fn meets_alike(points: &Vectors, arrays: &[(String, Vectors)]) -> usize {
    let mut meet = 0;
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points[..i].iter().enumerate() {
            if distance(a, b) < 1e-9 {
                meet += 1;
                for (name, u) in arrays {
                    let size = distance(&u[i], &[0.0; 3]);
                    assert!(distance(&u[i], &u[j]) < 1e-9 * size.max(1e-3), "{name}");
                }
            }
        }
    }
    meet
}

/// Points of a .vtu file, and its arrays of vectors on them by their names.
fn vectors(file: &Path, is_asked: impl Fn(&str) -> bool) -> (Vectors, Vec<(String, Vectors)>) {
    let threes = |numbers: Vec<f64>| -> Vectors {
        let all = numbers.chunks_exact(3);
        all.map(|u| [u[0], u[1], u[2]]).collect()
    };
    let (points, arrays) = arrays(file, is_asked);
    let arrays = arrays.into_iter();
    let arrays = arrays.map(|(name, values)| (name, threes(values)));
    (threes(points), arrays.collect())
}

/// Coordinates of the points of a .vtu file, and its arrays on them by their names.
fn arrays(file: &Path, is_asked: impl Fn(&str) -> bool) -> (Vec<f64>, Vec<(String, Vec<f64>)>) {
    let DataSet::UnstructuredGrid { mut pieces, .. } = Vtk::import(file).unwrap().data else {
        panic!("not a grid")
    };
    let Piece::Inline(piece) = pieces.remove(0) else {
        panic!("not inline")
    };
    let arrays = piece.data.point.iter().filter_map(|array| match array {
        Attribute::DataArray(array) if is_asked(&array.name) => {
            Some((array.name.clone(), array.data.cast_into::<f64>()?))
        }
        _ => None,
    });
    let arrays = arrays.collect();
    (piece.points.cast_into::<f64>().unwrap(), arrays)
}

/// Two sectors move alike where they meet, in the whole disc and at both parts of the period. A mode of
/// one nodal diameter changes its sign twice round the disc.
#[test]
fn shapes_on_the_whole_disc_are_continuous_between_the_sectors() {
    let folder = Folder::new("disc_shapes");
    let text = scene("disc_sector.msh", 1, &["disc"], RESPONSE);
    let path = folder.write("scene.toml", text);
    for diameter in 0..=SECTORS / 2 {
        let out = folder.join(diameter.to_string());
        let mut command = scene_command("modes", &path, &out, &[]);
        ended(command.args(["--nodal-diameter", &diameter.to_string()]), 0);
        let file = out.join(format!("modes_nodal_diameter_{diameter}.vtu"));
        let (points, arrays) = vectors(&file, |name| name.contains("_hz_"));
        assert_eq!((points.len(), arrays.len()), (SECTORS * NODES, 12));
        // Each face has ten nodes.
        assert_eq!(meets_alike(&points, &arrays), SECTORS * 10);
        // The first mode is axial: the tip of each blade in turn.
        let (_, first) = &arrays[0];
        let tip = (0..98)
            .max_by(|a, b| points[*a][2].total_cmp(&points[*b][2]))
            .unwrap();
        let around: Vec<f64> = (0..SECTORS).map(|j| first[NODES * j + tip][0]).collect();
        let changes = (0..SECTORS).filter(|&j| around[j] * around[(j + 1) % SECTORS] < 0.0);
        assert_eq!(changes.count(), 2 * diameter, "{around:?}");
    }
    let mut command = scene_command("modes", &path, &folder.join("far"), &[]);
    has(
        &told(command.args(["--nodal-diameter", "4"]), 1),
        "largest nodal diameter of the disc is 3",
    );
    let paper = root().join("scenes/paper.toml");
    let mut command = scene_command("modes", &paper, &folder.join("no"), &[]);
    has(
        &told(command.args(["--nodal-diameter", "1"]), 1),
        "not about a disc & [cyclic]",
    );
}
