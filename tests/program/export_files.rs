//! Files written from a made-up model and response are read back: by `vtkio`, as text, and by VTK
//! itself, meshio and pyvista through scripts/check_output.py. That needs an interpreter of Python
//! that has them: the one of `tools/setup.sh checks`, or another one named by `DOVETAIL_PYTHON`;
//! without one these tests fail.

mod made_up_run;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use dovetail_export::curves::Sweep;
use dovetail_export::fields::{Field, Separation, peak_fields, static_state_fields};
use dovetail_export::manifest::{self, MeshOrigin, SceneSummary, StageSummary, Summary};
use dovetail_export::plots::{self, PictureHeading, Scale};
use dovetail_export::words::figure;
use dovetail_export::{ExportError, csv, flank, vtu, write_json};
use dovetail_mesh::ElementOrder;
use dovetail_numerics::space::{cross, norm, sub};
use dovetail_solver::dlft::{Outcome, PairStatus, Response};
use dovetail_solver::fem::mass_properties::MassProperties;
use dovetail_solver::model::{BodyPrestress, Observation, Rotation};
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::results::fretting::fretting;
use dovetail_solver::results::modes::{ModeKind, ModeShape};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::peak::{linear_peak, peak};
use dovetail_solver::results::quantities::sweep_fields;
use dovetail_solver::run::Observed;
use dovetail_testkit::block::mixed_block;
use dovetail_testkit::folder::root;
use dovetail_testkit::words::has;
use made_up_run::{Run, observed, run, scaled};
use vtkio::model::{Attribute, DataSet, Piece, UnstructuredGridPiece, Vtk};

const FRAMES: usize = 6;

fn pairs(run: &Run) -> PairTable {
    PairTable::from_model(&run.model)
}

fn all_observed(run: &Run) -> Vec<Observed> {
    let observations = run.model.observations.iter();
    let of = |o: &Observation| Observed {
        name: o.name.clone(),
        quantity: o.quantity,
    };
    observations.map(of).collect()
}

fn tip() -> Observed {
    Observed {
        name: "tip".into(),
        quantity: ObservedQuantity::Displacement,
    }
}

fn summary(run: &Run) -> Summary {
    Summary {
        version: "0.0.0".into(),
        scene: SceneSummary {
            name: "made up".into(),
            file: "made_up.toml".into(),
            blake3: None,
        },
        mesh: Some(manifest::mesh_summary(
            &run.model,
            &[MassProperties {
                volume_m3: Some(1e-4),
                mass_kg: 0.5,
                centre_m: Some([0.0, 0.0, 0.5]),
                centrifugal_force_n: None,
            }; 2],
            &MeshOrigin {
                source: "made up".into(),
                ..MeshOrigin::default()
            },
        )),
        stuck_modes: Some(3),
        pairs: run.model.pairs.len(),
        stuck_frequency_hz: Some(377.0),
        linear_frequency_hz: Some(376.0),
        blade_frequency_hz: None,
        seconds: 2.5,
        processor_seconds: Some(2.0),
        bonded_pairs: 0,
        stages: vec![StageSummary {
            from_cache: false,
            unknowns: Vec::new(),
            id: dovetail_solver::run::Stage::Mesh,
            name: "none".into(),
            seconds: f64::NAN,
            processor_seconds: None,
            peak_memory_mib: None,
        }],
        static_state: Some(manifest::static_summary(&pairs(run), &run.static_state)),
        response: Some(manifest::response_summary(
            &pairs(run),
            Some("tip"),
            &run.response,
            None,
            &[],
        )),
        observations: manifest::observation_summaries(&run.model),
        ..Summary::default()
    }
}

/// Writes the files of the flanks at each frequency, and their collection.
fn write_flanks(out: &Path, run: &Run) -> Vec<String> {
    let mut flanks = flank::FlankSeries::new(&run.model);
    let orbits = &run.response.orbits;
    for orbit in orbits {
        flanks.write(out, orbit).unwrap();
    }
    let collection = "flank.pvd".to_owned();
    flanks
        .write_collection(&out.join(&collection), orbits)
        .unwrap();
    let files = orbits
        .iter()
        .map(|orbit| flank::FlankSeries::file(orbit.point));
    let there = files.filter(|file| out.join(file).exists());
    there.chain([collection]).collect()
}

const HEADING: PictureHeading<'_> = PictureHeading {
    title: "Tip",
    conditions: "1 N, 5000 rpm, friction 0.3",
};

fn sweep(response: &Response) -> Sweep<'_> {
    Sweep {
        response,
        compared: None,
        along: None,
        tractions: None,
    }
}

/// Writes all files of a run into a fresh folder.
fn write_all(name: &str, run: &Run) -> PathBuf {
    let out = folder(name);
    let (model, response) = (&run.model, &run.response);
    csv::write_response(
        &out.join("response.csv"),
        &all_observed(run),
        response,
        None,
    )
    .unwrap();
    csv::write_static(&out.join("static.csv"), &pairs(run), &run.static_state).unwrap();
    csv::write_contact(&out.join("contact.csv"), &pairs(run), response).unwrap();
    vtu::write_static(&out.join("static.vtu"), model, &static_fields(run)).unwrap();
    flank::write_flank_static(&out.join("flank_static.vtu"), model, &run.static_state).unwrap();
    write_flanks(&out, run);
    let top = peak(response, 0).unwrap();
    let orbit = &response.orbits[top.index];
    let fretting = fretting(model, orbit, None);
    flank::write_flank_peak(
        &out.join("flank_peak.vtu"),
        model,
        orbit,
        response,
        &fretting,
    )
    .unwrap();
    // `motion` belongs to a gain of 1: scale it to the orbit at the peak.
    let gain = response.orbits[top.index].observed[0][1]
        / observed(&model.observations[0], &run.motion)[1];
    let motion = scaled(&run.motion, gain);

    vtu::write_motion(&out.join("peak.vtu"), (model, None), &motion, None).unwrap();
    vtu::write_frames(&out, (model, None), &motion, top.frequency_hz, FRAMES).unwrap();
    let files = vtu::frame_files(FRAMES);
    assert_eq!((files.len(), &files[FRAMES][..]), (FRAMES + 1, "peak.pvd"));
    assert!(files.iter().all(|file| out.join(file).exists()));
    let mode = ModeShape {
        kind: ModeKind::Stuck,
        body: None,
        mode: 1,
        frequency_hz: 377.0,
        shape: run.static_displacement.to_vec(),
    };
    vtu::write_modes(&out.join("modes.vtu"), model, &[mode]).unwrap();
    write_json(&out.join("summary.json"), &summary(run)).unwrap();
    let curves = sweep(response).amplitude(&tip(), 0);
    let plot = |file: &str, scale, curves| {
        plots::write_curves(&out.join(file), HEADING, scale, curves).unwrap();
    };
    plot("response.svg", Scale::Linear, &curves);
    plot("response_log.svg", Scale::Logarithmic, &curves);
    plot("phase.svg", Scale::Linear, &sweep(response).phase("tip", 0));
    let separation = Separation::new(response, model.pairs.len());
    plots::write_separation_map(&out.join("separation.svg"), model, "1 N", &separation).unwrap();
    let [energy, slid, ..] = peak_fields(orbit, &model.pairs);
    let [pressure, _] = static_state_fields(&run.static_state, &model.pairs).unwrap();
    for (file, field) in [
        ("energy.svg", energy),
        ("slip.svg", slid),
        ("pressure.svg", pressure),
    ] {
        plots::write_field_map(&out.join(file), model, HEADING, &field).unwrap();
    }
    out
}

fn static_fields(run: &Run) -> [vtu::StaticBodyFields<'_>; 2] {
    [0, 1].map(|b| vtu::StaticBodyFields {
        displacement_m: &run.static_displacement[b],
        stress_pa: &run.stress[b],
        von_mises_pa: &run.von_mises[b],
    })
}

fn folder(name: &str) -> PathBuf {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("export_files")
        .join(name);
    let _ = fs::remove_dir_all(&out);
    fs::create_dir_all(&out).unwrap();
    out
}

/// Reads the grid of a .vtu file with vtkio.
fn read(path: &Path) -> UnstructuredGridPiece {
    let vtk = Vtk::import(path).unwrap();
    let DataSet::UnstructuredGrid { mut pieces, .. } = vtk.data else {
        panic!("not a grid")
    };
    match pieces.remove(0) {
        Piece::Inline(piece) => *piece,
        other => panic!("not inline: {other:?}"),
    }
}

fn values(attributes: &[Attribute], name: &str) -> Vec<f64> {
    let found = attributes.iter().find(|a| a.name() == name);
    match found {
        Some(Attribute::DataArray(array)) => array.data.cast_into::<f64>().unwrap(),
        _ => panic!("no array {name}"),
    }
}

fn table(path: &Path) -> Vec<BTreeMap<String, String>> {
    let rows = ::csv::Reader::from_path(path).unwrap().into_deserialize();
    rows.map(Result::unwrap).collect()
}

/// Each observed amplitude has an error of its own. Console, tables and report have the error of the
/// first one next to the peak.
#[test]
fn the_error_of_the_peak_is_that_of_the_observation_shown() {
    let mut run = run(ElementOrder::Linear, 2, 2);
    for orbit in &mut run.response.orbits {
        (orbit.estimated_error, orbit.observed_error) = (Some(0.02), vec![0.004, 0.02]);
    }
    let out = folder("peak_error");
    write_json(&out.join("summary.json"), &summary(&run)).unwrap();
    let text = fs::read_to_string(out.join("summary.json")).unwrap();
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let response = &found["response"];
    assert_eq!(response["observation"], "tip");
    assert_eq!(response["peak_estimated_error"], 0.004);
    assert_eq!(response["peak_largest_estimated_error"], 0.02);
}

#[test]
fn a_point_that_did_not_converge_has_its_outcome_and_no_result() {
    let run = run(ElementOrder::Linear, 4, 9);
    let out = folder("unconverged");
    let path = out.join("response.csv");
    csv::write_response(&path, &all_observed(&run), &run.response, None).unwrap();
    let header = fs::read_to_string(&path)
        .unwrap()
        .lines()
        .next()
        .unwrap()
        .to_owned();
    assert!(
        header.starts_with(
            "point,branch,periods,stable,frequency_hz,outcome,tip_amplitude_m,tip_linear_amplitude_m,rim_"
        ),
        "{header}"
    );
    let rows = table(&path);
    assert_eq!(rows.len(), 31);
    let emptied = |k: &str| {
        let kept = [
            "point",
            "branch",
            "periods",
            // Nobody asked for their stability.
            "instability",
            "floquet_multiplier",
            "floquet_argument_rad",
            "newton_iterations",
            "krylov_iterations",
            "frequency_hz",
            "outcome",
            "residual",
            "harmonics",
        ];
        !kept.contains(&k) && !k.contains("_linear_")
    };
    for (i, row) in rows.iter().enumerate() {
        let converged = row["outcome"] == "converged";
        assert_eq!(converged, i != 3 && i != 17);
        for (name, cell) in row.iter().filter(|(k, _)| emptied(k)) {
            assert_eq!(cell.is_empty(), !converged, "row {i}, {name}: '{cell}'");
        }
        let linear: f64 = row["tip_linear_amplitude_m"].parse().unwrap();
        assert_eq!(linear, run.response.linear[i].observed_amplitude[0]);
        assert!(!row["newton_iterations"].is_empty());
    }
    assert_eq!(rows[3]["outcome"], "iteration_limit");
    assert_eq!(rows[3]["residual"].parse::<f64>().unwrap(), 1e-9);
    assert_eq!(
        rows[17]["residual"], "",
        "a residual that is not finite is no number"
    );
    let orbit = &run.response.orbits[10];
    let (a, p) = (
        &rows[10]["tip_h2_amplitude_m"],
        &rows[10]["tip_h2_phase_rad"],
    );
    let (a, p): (f64, f64) = (a.parse().unwrap(), p.parse().unwrap());
    assert!((a * p.cos() - orbit.observed[0][3]).abs() < 1e-20);
    assert!((a * p.sin() - orbit.observed[0][4]).abs() < 1e-20);
}

#[test]
fn tables_per_pair_hold_the_exact_numbers() {
    let run = run(ElementOrder::Linear, 4, 9);
    let out = folder("pairs");
    csv::write_static(&out.join("static.csv"), &pairs(&run), &run.static_state).unwrap();
    csv::write_contact(&out.join("contact.csv"), &pairs(&run), &run.response).unwrap();
    let rows = table(&out.join("static.csv"));
    assert_eq!(rows.len(), 72);
    assert_eq!(rows[0]["status"], "open");
    assert_eq!(rows[0]["gap_m"].parse::<f64>().unwrap(), 1e-7 + 2e-6);
    assert_eq!(
        rows[40]["contact"], "right, \"skewed\"",
        "quotes and commas survive"
    );
    let (pair, state) = (&run.model.pairs[7], &run.static_state);
    assert_eq!(
        rows[7]["blade_node"],
        run.model.bodies[0].node_tags[pair.slave.node.node as usize].to_string()
    );
    assert_eq!(
        rows[7]["pressure_pa"].parse::<f64>().unwrap(),
        -state.lambda[21] / pair.area_m2
    );
    let swept = sweep_fields(&run.response, run.model.pairs.len());
    let top = peak(&run.response, 0).unwrap();
    for (i, row) in table(&out.join("contact.csv")).iter().enumerate() {
        let cycle = &run.response.orbits[top.index].cycles[i];
        let number = |column: &str| row[column].parse::<f64>().unwrap();
        assert_eq!(number("peak_slid_m"), cycle.slid_m);
        let energy_j = cycle.friction_power_w / top.frequency_hz;
        assert_eq!(number("peak_friction_energy_j"), energy_j);
        assert_eq!(
            number("peak_friction_energy_j_m2"),
            energy_j / run.model.pairs[i].area_m2
        );
        assert_eq!(
            number("friction_power_mean_w"),
            swept.friction_power_mean_w[i]
        );
        assert_eq!(number("opening_share"), swept.opening_share[i]);
        assert_eq!(
            row["opens_at_any_frequency"],
            swept.separates[i].to_string()
        );
    }
}

#[test]
fn without_a_converged_point_the_tables_say_nothing_instead_of_zero() {
    let mut run = run(ElementOrder::Linear, 2, 2);
    run.static_state.outcome = Outcome::Stagnated;
    run.response
        .orbits
        .iter_mut()
        .for_each(|o| o.outcome = Outcome::Stagnated);
    let out = folder("nothing_converged");
    csv::write_static(&out.join("static.csv"), &pairs(&run), &run.static_state).unwrap();
    csv::write_contact(&out.join("contact.csv"), &pairs(&run), &run.response).unwrap();
    flank::write_flank_static(&out.join("flank_static.vtu"), &run.model, &run.static_state)
        .unwrap();
    let files = write_flanks(&out, &run);
    assert_eq!(files, ["flank.pvd"]);
    for row in table(&out.join("static.csv")) {
        assert_eq!(
            (row["status"].as_str(), row["pressure_pa"].as_str()),
            ("stagnated", "")
        );
    }
    for row in table(&out.join("contact.csv")) {
        assert_eq!(
            (
                row["friction_power_mean_w"].as_str(),
                row["peak_status"].as_str()
            ),
            ("", "")
        );
    }
    let grid = read(&out.join("flank_static.vtu"));
    assert!(grid.data.point.iter().all(|a| a.name() != "pressure_pa"));
    write_json(&out.join("summary.json"), &summary(&run)).unwrap();
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert!(json["response"]["peak_amplitude_m"].is_null());
    assert!(json["static"]["slipping_pairs"].is_null());
    assert!(json["stages"][0]["seconds"].is_null(), "NaN becomes null");
    assert_eq!(
        json["response"]["unconverged"].as_array().unwrap().len(),
        31
    );
}

#[test]
fn grids_read_back_bit_for_bit() {
    for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
        let run = run(order, 2, 2);
        let out = folder(&format!("grids_{order:?}"));
        vtu::write_static(&out.join("static.vtu"), &run.model, &static_fields(&run)).unwrap();
        let grid = read(&out.join("static.vtu"));
        let bodies = &run.model.bodies;
        let nodes: Vec<f64> = bodies
            .iter()
            .flat_map(|b| b.nodes_m.as_flattened().to_vec())
            .collect();
        assert_eq!(grid.points.clone().into_vec::<f64>().unwrap(), nodes);
        assert_eq!(
            grid.cells.num_cells(),
            bodies[0].elements.len() + bodies[1].elements.len()
        );
        let displacement = run.static_displacement.concat();
        assert_eq!(
            values(&grid.data.point, "displacement_m"),
            displacement.as_flattened()
        );
        assert_eq!(
            values(&grid.data.cell, "stress_pa"),
            run.stress.concat().as_flattened()
        );
        assert_eq!(
            values(&grid.data.point, "von_mises_pa"),
            run.von_mises.concat()
        );
    }
}

/// The reader of meshes takes the file for the bodies that it shows.
#[test]
fn the_bodies_are_a_mesh_again() {
    for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
        let run = run(order, 2, 2);
        let path = folder(&format!("mesh_{order:?}")).join("static.vtu");
        vtu::write_static(&path, &run.model, &static_fields(&run)).unwrap();
        let content = dovetail_mesh::formats::vtu::parse(&fs::read(&path).unwrap()).unwrap();
        let bodies = &run.model.bodies;
        let nodes: Vec<[f64; 3]> = bodies.iter().flat_map(|b| b.nodes_m.clone()).collect();
        assert_eq!(content.nodes, nodes);
        let (mut first_node, mut found) = (0, 0);
        for (number, body) in bodies.iter().enumerate() {
            let group = &content.groups[&format!("body {number}")];
            assert_eq!(group.elements.len(), body.elements.len());
            for (element, nodes) in group.elements.iter().zip(body.elements.iter()) {
                let shifted = nodes.iter().map(|n| n + first_node);
                assert!(
                    content
                        .elements
                        .element_nodes(*element as usize)
                        .iter()
                        .copied()
                        .eq(shifted)
                );
                found += 1;
            }
            first_node += body.nodes_m.len() as u32;
        }
        assert!(found > 0 && content.groups["all"].elements.len() == found);
    }
}

#[test]
fn mode_shapes_have_the_length_1_under_names_with_their_frequency() {
    let run = run(ElementOrder::Linear, 2, 2);
    let out = folder("modes");
    let path = out.join("modes.vtu");
    let shape = |factor: f64| -> Vec<Vec<[f64; 3]>> {
        let bodies = run.static_displacement.iter();
        let scaled = bodies.map(|u| u.iter().map(|u| u.map(|u| factor * u)).collect());
        scaled.collect()
    };
    let mode = |kind: ModeKind, body: Option<&str>, mode, frequency_hz, factor| ModeShape {
        kind,
        body: body.map(str::to_owned),
        mode,
        frequency_hz,
        shape: shape(factor),
    };
    let mut modes = vec![
        mode(ModeKind::Stuck, None, 1, 450.7647, 1.0),
        mode(ModeKind::Stuck, None, 2, 43924.8738, -7.0),
        mode(ModeKind::FlanksHeld, Some("jaw"), 1, 0.0512345, 3.0),
        mode(ModeKind::FlanksHeld, Some("jaw"), 2, 0.0, 0.0),
    ];
    vtu::write_modes(&path, &run.model, &modes).unwrap();
    let grid = read(&path);
    let names = [
        "stuck_1_450.76_hz",
        "stuck_2_43925_hz",
        "flanks_held_jaw_1_0.051235_hz",
    ];
    let expected = run.static_displacement.concat();
    let longest = expected.iter().map(|u| norm(*u)).fold(0.0, f64::max);
    for name in names {
        let found = values(&grid.data.point, name);
        let found: Vec<[f64; 3]> = found.chunks_exact(3).map(|u| [u[0], u[1], u[2]]).collect();
        let largest = found
            .iter()
            .copied()
            .max_by(|a, b| norm(*a).total_cmp(&norm(*b)));
        let largest = largest.unwrap();
        assert!((norm(largest) - 1.0).abs() < 1e-12, "{name}");
        let component = largest
            .into_iter()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        assert!(component.unwrap() > 0.0, "{name}");
        for (found, expected) in found.iter().zip(&expected) {
            let along = expected.map(|u| u / longest);
            let off = [1.0, -1.0].map(|sign| norm(sub(*found, along.map(|u| sign * u))));
            assert!(off[0].min(off[1]) < 1e-12, "{name}");
        }
    }
    let still = grid.data.point.last().unwrap();
    assert_eq!(
        values(&grid.data.point, still.name()),
        vec![0.0; 3 * expected.len()]
    );
    modes[0].shape[1].pop();
    let error = vtu::write_modes(&path, &run.model, &modes).unwrap_err();
    assert!(error.to_string().contains("of body jaw"), "{error}");
}

/// Corners of each cell of a grid of quadrilaterals.
fn quadrilaterals(grid: &UnstructuredGridPiece) -> Vec<[usize; 4]> {
    let (connectivity, offsets) = grid.cells.cell_verts.clone().into_xml();
    assert!(offsets.iter().zip(1..).all(|(end, n)| *end == 4 * n));
    let corners = connectivity.chunks_exact(4);
    corners
        .map(|c| [c[0], c[1], c[2], c[3]].map(|n| n as usize))
        .collect()
}

#[test]
fn a_state_belongs_to_the_share_of_its_pair_and_fields_stay_linear_on_facets() {
    let mut run = run(ElementOrder::Linear, 4, 9);
    let pairs = run.model.pairs.len();
    let status =
        |pair: usize| [PairStatus::Stuck, PairStatus::Slipping, PairStatus::Open][pair % 3];
    run.static_state.status = (0..pairs).map(status).collect();
    let out = folder("shares");
    let [at_rest, swept] = ["flank_static.vtu", "flank_peak.vtu"].map(|f| out.join(f));
    flank::write_flank_static(&at_rest, &run.model, &run.static_state).unwrap();
    let orbit = &run.response.orbits[peak(&run.response, 0).unwrap().index];
    let fretting = fretting(&run.model, orbit, None);
    flank::write_flank_peak(&swept, &run.model, orbit, &run.response, &fretting).unwrap();
    let separates = sweep_fields(&run.response, pairs).separates;
    let [at_rest, swept] = [&at_rest, &swept].map(|path| read(path));
    let owners = values(&at_rest.data.cell, "pair");
    assert_eq!(owners.len(), 3 * run.model.flank_facets.len());
    let contact = |pair: usize| run.model.pairs[pair].contact;
    let expected: [(_, _, &dyn Fn(usize) -> usize); 4] = [
        (&at_rest, "status", &|pair| pair % 3),
        (&at_rest, "contact", &contact),
        (&swept, "contact", &contact),
        (&swept, "separates", &|pair| usize::from(separates[pair])),
    ];
    for (grid, name, of_pair) in expected {
        let found = values(&grid.data.cell, name);
        let expected = owners.iter().map(|&pair| of_pair(pair as usize) as f64);
        assert!(found.iter().copied().eq(expected), "{name}");
        assert!(grid.data.point.iter().all(|array| array.name() != name));
    }
    // A cell is a third of its facet and has its pair as a corner.
    let points = at_rest.points.clone().into_vec::<f64>().unwrap();
    let place = |n: usize| [0, 1, 2].map(|a| points[3 * n + a]);
    let area = |corners: &[[f64; 3]]| {
        let diagonals = match corners {
            [a, b, c] => [sub(*b, *a), sub(*c, *a)],
            [a, b, c, d] => [sub(*c, *a), sub(*d, *b)],
            _ => panic!("{} corners", corners.len()),
        };
        0.5 * norm(cross(diagonals[0], diagonals[1]))
    };
    let facets = run.model.flank_facets.iter();
    let facets = facets.flat_map(|t| [[0, 1, 2].map(|k| t[k] as usize); 3]);
    let pressure = values(&at_rest.data.point, "pressure_pa");
    let mean = |of: &[usize]| of.iter().map(|&n| pressure[n]).sum::<f64>() / of.len() as f64;
    for ((cell, facet), owner) in quadrilaterals(&at_rest).iter().zip(facets).zip(&owners) {
        assert_eq!(cell[0], *owner as usize);
        let third = area(&facet.map(place)) / 3.0;
        assert!((area(&cell.map(place)) / third - 1.0).abs() < 1e-12);
        let scale = pressure.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
        assert!((pressure[cell[2]] - mean(&facet)).abs() < 1e-12 * scale);
        let i = facet.iter().position(|n| *n == cell[0]).unwrap();
        for (side, other) in [(cell[1], facet[(i + 1) % 3]), (cell[3], facet[(i + 2) % 3])] {
            assert!((pressure[side] - mean(&[cell[0], other])).abs() < 1e-12 * scale);
        }
    }
}

#[test]
fn errors_name_the_file_the_field_and_the_remedy() {
    let run = run(ElementOrder::Linear, 2, 2);
    let out = folder("errors");
    let mut fields = static_fields(&run);
    fields[1].von_mises_pa = &fields[1].von_mises_pa[1..];
    let error = vtu::write_static(&out.join("static.vtu"), &run.model, &fields).unwrap_err();
    assert!(
        matches!(&error, ExportError::FieldLength { found, expected, .. } if found + 1 == *expected)
    );
    let words = "static.vtu & von Mises stress of body jaw";
    has(&error.to_string(), words);
    assert!(!out.join("static.vtu").exists());

    let mut fields = static_fields(&run);
    let mut sick = run.static_displacement[0].clone();
    sick[3][1] = f64::INFINITY;
    fields[0].displacement_m = &sick;
    let error = vtu::write_static(&out.join("static.vtu"), &run.model, &fields).unwrap_err();
    assert!(
        matches!(&error, ExportError::NotFinite { index: 3, .. }),
        "{error}"
    );

    fs::write(out.join("blocked"), "a file where a folder should be").unwrap();
    let path = out.join("blocked/response.csv");
    let error = csv::write_response(&path, &all_observed(&run), &run.response, None).unwrap_err();
    has(&error.to_string(), "blocked & --out");

    let field = Field {
        title: "pressure",
        unit: "Pa",
        values: vec![1.0],
    };
    let error = plots::write_field_map(&out.join("map.svg"), &run.model, HEADING, &field);
    assert!(error.unwrap_err().to_string().contains("map.svg"));
}

#[test]
fn figures_show_every_pair_and_every_lost_point() {
    let run = run(ElementOrder::Linear, 4, 9);
    let out = write_all("figures", &run);
    let svg = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    for file in ["pressure.svg", "energy.svg", "slip.svg", "separation.svg"] {
        assert_eq!(
            svg(file).matches("<polygon").count(),
            72,
            "{file}: one patch per pair"
        );
    }
    let separates = sweep_fields(&run.response, run.model.pairs.len()).separates;
    let separated = separates.iter().filter(|separates| **separates).count();
    assert!(separated > 0 && separated < 72);
    assert!(svg("separation.svg").contains(&format!(" Hz: {separated} of 72\n")));
    assert!(svg("separation.svg").contains(&format!("\n{separated} pairs\n")));
    assert!(svg("response.svg").contains("with 3 harmonics: 2 points did not converge"));
    // Three stretches of the curve (before 3, between 3 and 17, after 17) and its legend (3
    // pieces).
    let mut gapless = run.response.clone();
    gapless
        .orbits
        .iter_mut()
        .for_each(|o| o.outcome = Outcome::Converged);
    gapless.orbits[17].observed_amplitude = gapless.orbits[16].observed_amplitude.clone();
    let draw = |response: &Response| {
        let curves = sweep(response).amplitude(&tip(), 0);
        let path = out.join("one.svg");
        plots::write_curves(&path, HEADING, Scale::Linear, &curves).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        text.matches("stroke=\"#222222\"").count()
    };
    // Two crosses on the axis and one in the legend add two lines each; two gaps add two lines.
    assert_eq!(draw(&run.response), draw(&gapless) + 2 + 6);
}

/// Corners of the patches in a map of the flanks, in pixels: patch after patch, in the order of the
/// pairs.
fn patches(svg: &str) -> Vec<Vec<[f64; 2]>> {
    let corner = |text: &str| {
        let (x, y) = text.split_once(',').unwrap();
        [x, y].map(|number| number.parse().unwrap())
    };
    let polygons = svg.lines().filter(|line| line.starts_with("<polygon"));
    let corners = polygons.map(|line| {
        let (_, points) = line.split_once("points=\"").unwrap();
        let (points, _) = points.split_once('"').unwrap();
        points.split_whitespace().map(corner).collect()
    });
    corners.collect()
}

/// Points of each line of a picture.
fn polylines(svg: &str) -> Vec<Vec<[f64; 2]>> {
    patches(&svg.replace("<polyline", "<polygon"))
}

#[test]
fn the_peak_of_each_amplitude_has_a_mark_over_it_and_its_figures_beside_it() {
    let run = run(ElementOrder::Linear, 4, 9);
    let out = write_all("peaks", &run);
    let svg = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    let tops = [peak(&run.response, 0), linear_peak(&run.response, 0)];
    for file in ["response.svg", "response_log.svg"] {
        let (text, lines) = (svg(file), polylines(&svg(file)));
        for top in tops {
            let frequency = figure(top.unwrap().frequency_hz, 6);
            let beside = format!("m at {frequency} Hz");
            let named = words(&text).iter().any(|words| words.ends_with(&beside));
            assert!(named, "{file}: {beside}");
        }
        let marks = patches(&text);
        assert_eq!(marks.len(), 2, "{file}");
        for mark in marks {
            let [x, tip] = mark[0];
            // To the tenths of a pixel in which both are written.
            let near = |a: f64, b: f64| (a - b).abs() < 0.11;
            let touches = |p: &[f64; 2]| near(p[0], x) && near(p[1], tip + 5.0);
            assert!(lines.iter().flatten().any(touches), "{file}: {mark:?}");
        }
    }
    assert!(patches(&svg("phase.svg")).is_empty() && !svg("phase.svg").contains(" at "));
}

/// Texts of a picture, each on a line of its own.
fn words(svg: &str) -> Vec<&str> {
    svg.lines().filter(|line| !line.starts_with('<')).collect()
}

#[test]
fn flanks_are_drawn_in_one_sense_to_one_scale_with_named_edges() {
    let mut run = run(ElementOrder::Linear, 4, 9);
    let out = folder("sense");
    // The two flanks of the model have opposite t2.
    let [first, last] = [0, 71].map(|pair| run.model.pairs[pair].frame[2]);
    assert!(first[2] * last[2] < 0.0);
    let about = |x: f64| {
        Some(Rotation {
            point_m: [0.0, 0.0, -0.5],
            axis: [x, 0.0, 0.0],
            speed_rad_s: 500.0,
            prestress: BodyPrestress::None,
            prestress_of_contact: false,
        })
    };
    let ends = ["front end", "rear end"];
    let heights = ["inner edge", "outer edge"];
    // Without rotation the edges are named after axes of coordinates.
    for (rotation, to_the_right, sides, edges) in [
        (about(1.0), 1.0, ends, heights),
        (about(-1.0), -1.0, ends, heights),
        (
            None,
            1.0,
            ["towards −x", "towards +x"],
            ["towards −z", "towards +z"],
        ),
    ] {
        run.model.rotation = rotation;
        let path = out.join("pressure.svg");
        let [pressure, _] = static_state_fields(&run.static_state, &run.model.pairs).unwrap();
        plots::write_field_map(&path, &run.model, HEADING, &pressure).unwrap();
        let svg = fs::read_to_string(&path).unwrap();
        for edge in sides.iter().chain(&edges) {
            let drawn = words(&svg).iter().filter(|word| *word == edge).count();
            assert_eq!(drawn, 2, "{edge}: once a flank");
        }
        let centres: Vec<[f64; 2]> = patches(&svg)
            .iter()
            .map(|corners| {
                let mean = |axis: usize| corners.iter().map(|c| c[axis]).sum::<f64>();
                [0, 1].map(|axis| mean(axis) / corners.len() as f64)
            })
            .collect();
        assert_eq!(centres.len(), 72);
        for contact in [0, 1] {
            let of_contact = || (0..72).filter(|pair| run.model.pairs[*pair].contact == contact);
            for (a, b) in of_contact().flat_map(|a| of_contact().map(move |b| (a, b))) {
                let from_a = sub(run.model.pairs[b].position_m, run.model.pairs[a].position_m);
                let [x, y] = [0, 1].map(|axis| centres[b][axis] - centres[a][axis]);
                if from_a[0].abs() > 6e-3 {
                    assert_eq!((to_the_right * from_a[0]).signum(), x.signum());
                }
                if from_a[2].abs() > 1.5e-3 {
                    assert_eq!(from_a[2].signum(), -y.signum());
                }
            }
        }
        let extent = |axis: usize| {
            let corners = patches(&svg).into_iter().take(36).flatten();
            let (low, high) = corners.fold((f64::INFINITY, 0.0_f64), |(low, high), c| {
                (low.min(c[axis]), high.max(c[axis]))
            });
            high - low
        };
        let ratio = extent(0) / extent(1);
        assert!((ratio - 35.3 / 4.5).abs() < 0.01, "{ratio}");
    }
}

/// Numbers of an attribute in the elements of a picture.
fn attributes(svg: &str, name: &str) -> Vec<f64> {
    let start = format!(" {name}=\"");
    let values = svg.split(&start).skip(1);
    let values = values.map(|after| after.split_once('"').unwrap().0);
    values
        .flat_map(|value| value.split([',', ' ']))
        .filter_map(|number| number.parse().ok())
        .collect()
}

#[test]
fn pictures_are_drawn_in_tenths_of_a_pixel() {
    let run = run(ElementOrder::Linear, 4, 9);
    let out = write_all("tenths", &run);
    for file in [
        "pressure.svg",
        "separation.svg",
        "response.svg",
        "response_log.svg",
        "phase.svg",
    ] {
        let svg = fs::read_to_string(out.join(file)).unwrap();
        let (head, drawing) = svg.split_once('\n').unwrap();
        let shown = ["width", "height"].map(|name| attributes(head, name)[0]);
        assert!((600.0..2000.0).contains(&shown[0]), "{file}: {head}");
        let [width, height] = shown;
        assert_eq!(attributes(head, "viewBox"), [0.0, 0.0, width, height]);
        let places = ["points", "x"].map(|name| attributes(drawing, name));
        let places = || places.iter().flatten();
        assert!(places().filter(|n| *n % 1.0 != 0.0).count() > 5, "{file}");
        assert!(places().all(|n| ((10.0 * n).round() - 10.0 * n).abs() < 1e-9));
        for (name, least) in [("stroke-width", 1.0), ("font-size", 13.5), ("r", 3.0)] {
            let sizes = attributes(drawing, name);
            assert!(
                sizes.iter().all(|s| *s >= least),
                "{file}: {name} {sizes:?}"
            );
        }
        // The drawing fills the picture.
        let reach = |name: &str| attributes(drawing, name).into_iter().fold(0.0, f64::max);
        assert!(
            reach("x") > 0.6 * width && reach("y") > 0.8 * height,
            "{file}"
        );
    }
}

#[test]
fn vtk_reads_every_file_back_with_the_right_numbers() {
    let folders = [
        (ElementOrder::Linear, 2, 2),
        (ElementOrder::Quadratic, 2, 2),
        (ElementOrder::Quadratic, 4, 9),
    ]
    .map(|(order, nu, nv)| {
        let name = format!("vtk_{order:?}_{nu}x{nv}");
        write_all(&name, &run(order, nu, nv))
    });
    for (folder, (ok, text)) in folders.iter().zip(check_output(&folders)) {
        assert!(ok, "{}: {text}", folder.display());
        println!("{text}");
    }
}

#[test]
fn the_vtk_check_notices_what_is_wrong() {
    let run = run(ElementOrder::Quadratic, 2, 2);
    let (mut folders, mut expected) = (Vec::new(), Vec::new());
    let mut must_fail = |name: &'static str, spoil: &dyn Fn(&Path), word: &'static str| {
        let out = write_all(&format!("spoiled_{name}"), &run);
        spoil(&out);
        folders.push(out);
        expected.push((name, word));
    };
    let replace = |file: PathBuf, from: &str, to: &str| {
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.contains(from), "{from} is not in {}", file.display());
        fs::write(file, text.replacen(from, to, 1)).unwrap();
    };
    must_fail(
        "missing",
        &|o| fs::remove_file(o.join("flank/flank_0005.vtu")).unwrap(),
        "flank_0005",
    );
    must_fail(
        "swapped",
        &|o| {
            let (a, b) = (
                o.join("flank/flank_0005.vtu"),
                o.join("flank/flank_0015.vtu"),
            );
            fs::copy(a, b).unwrap();
        },
        "friction_power_w",
    );
    must_fail(
        "outcome",
        &|o| replace(o.join("response.csv"), "iteration_limit", "converged"),
        "empty",
    );
    must_fail(
        "truncated",
        &|o| {
            let bytes = fs::read(o.join("static.vtu")).unwrap();
            fs::write(o.join("static.vtu"), &bytes[..bytes.len() / 2]).unwrap();
        },
        "VTK's reader says",
    );
    must_fail(
        "slip",
        &|o| {
            let mut moved = run.static_displacement.clone();
            moved[0][run.model.pairs[1].slave.node.node as usize][2] += 1e-6;
            let mut fields = static_fields(&run);
            fields[0].displacement_m = &moved[0];
            vtu::write_static(&o.join("static.vtu"), &run.model, &fields).unwrap();
        },
        "slip_vector_m",
    );
    must_fail(
        "edge_nodes",
        &|o| {
            let mut model = run.model.clone();
            let tets = model.bodies[1].elements.nodes_mut();
            tets.chunks_exact_mut(10).for_each(|t| t.swap(8, 9));
            vtu::write_static(&o.join("static.vtu"), &model, &static_fields(&run)).unwrap();
        },
        "middle",
    );
    must_fail(
        "inverted",
        &|o| {
            let mut model = run.model.clone();
            let tet = &mut model.bodies[0].elements.nodes_mut()[..10];
            tet.swap(0, 1);
            tet.swap(5, 6);
            tet.swap(7, 8);
            vtu::write_static(&o.join("static.vtu"), &model, &static_fields(&run)).unwrap();
        },
        "volume",
    );
    must_fail(
        "motion",
        &|o| {
            let top = peak(&run.response, 0).unwrap();
            let slow = 0.5 * top.frequency_hz;
            vtu::write_frames(o, (&run.model, None), &run.motion, slow, FRAMES).unwrap();
        },
        "timesteps",
    );
    must_fail(
        "frames",
        &|o| {
            let (half, top) = (scaled(&run.motion, 0.5), peak(&run.response, 0).unwrap());
            vtu::write_frames(o, (&run.model, None), &half, top.frequency_hz, FRAMES).unwrap();
        },
        "oscillation_m",
    );
    must_fail(
        "phase",
        &|o| {
            replace(
                o.join("peak.vtu"),
                "Name=\"h1_phase_rad\"",
                "Name=\"h1_phase\"",
            );
        },
        "h1_phase_rad",
    );
    must_fail(
        "component_names",
        &|o| replace(o.join("static.vtu"), "ComponentName1=\"Y\"", ""),
        "the components of displacement_m are named",
    );
    // VTK and pyvista read LZ4, meshio does not.
    must_fail(
        "lz4",
        &|o| {
            let script = "import sys, pyvista\n\
                          pyvista.read(sys.argv[1]).save(sys.argv[1], compression='lz4')";
            run_python(script, &[o.join("static.vtu")]);
        },
        "meshio cannot read",
    );
    for ((name, word), (ok, text)) in expected.into_iter().zip(check_output(&folders)) {
        assert!(!ok && text.contains(word), "{name}: {text}");
    }
}

/// Cells of all shapes, of both orders: VTK finds that every volume is positive, that every middle
/// node is in the middle of its edge, and that the whole is the box.
#[test]
fn vtk_knows_the_elements_of_all_shapes() {
    let size = [6e-3, 2e-3, 1e-3];
    let files = [ElementOrder::Linear, ElementOrder::Quadratic].map(|order| {
        let out = folder(&format!("shapes_{order:?}"));
        let mesh = mixed_block(order, [6, 2, 2], size);
        let mut run = run(order, 2, 2);
        let blade = &mut run.model.bodies[0];
        blade.elements = mesh.elements.clone();
        blade.node_tags = mesh.node_tags.clone();
        blade.nodes_m = mesh.nodes_m;
        run.model.bodies.truncate(1);
        let (nodes, elements) = (mesh.node_tags.len(), mesh.elements.len());
        let (u, von_mises) = (vec![[0.0; 3]; nodes], vec![0.0; nodes]);
        let stress = vec![[0.0; 6]; elements];
        let fields = [vtu::StaticBodyFields {
            displacement_m: &u,
            stress_pa: &stress,
            von_mises_pa: &von_mises,
        }];
        let path = out.join("static.vtu");
        vtu::write_static(&path, &run.model, &fields).unwrap();
        path
    });
    let said = run_python(ELEMENTS_OF_EACH, &files);
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), files.len(), "{said}");
    for line in lines {
        assert!(line.ends_with(" []"), "{said}");
        let kinds = ["Tetra", "Pyramid", "Wedge", "Hexahedron"];
        assert!(kinds.iter().all(|kind| line.contains(kind)), "{said}");
        // The apexes of the pyramids lie inside: the whole is 6 x 2 x 1 mm.
        assert!(line.contains("1.200000e-08 m3"), "{said}");
    }
}

/// Checks the elements of each file by scripts/check_output.py: a line of facts and problems each.
const ELEMENTS_OF_EACH: &str = r#"
import pathlib, sys
sys.path.insert(0, "scripts")
import check_output as c

for name in sys.argv[1:]:
    c.facts.clear()
    c.problems.clear()
    path = pathlib.Path(name)
    c.check_elements(c.Grid(path, path.parent))
    print(c.facts, c.problems)
"#;

/// Runs scripts/check_output.py for each folder. After what it says of a folder stands its exit
/// code, between two bytes that no text has.
const CHECK_OF_EACH: &str = r#"
import sys, traceback
sys.path.insert(0, "scripts")
import check_output as c

sys.stderr = sys.stdout
for folder in sys.argv[1:]:
    sys.argv = ["check_output.py", folder]
    c.facts.clear()
    c.problems.clear()
    try:
        code = c.main()
    except BaseException:
        traceback.print_exc()
        code = 1
    print(f"\x1e{code}\x1e")
"#;

/// Checks folders by scripts/check_output.py: whether all agrees, and what is said of it. One
/// process checks them all, for its imports take longer than a check.
fn check_output(folders: &[PathBuf]) -> Vec<(bool, String)> {
    let said = run_python(CHECK_OF_EACH, folders);
    let parts: Vec<&str> = said.split('\x1e').collect();
    let checked: Vec<(bool, String)> = parts
        .chunks_exact(2)
        .map(|part| (part[1] == "0", part[0].to_owned()))
        .collect();
    assert_eq!(checked.len(), folders.len(), "{said}");
    checked
}

/// Runs this code by an interpreter of Python that can import what scripts/check_output.py imports,
/// and returns what it prints. It has to end without an error.
fn run_python(code: &str, files: &[PathBuf]) -> String {
    let python = std::env::var_os("DOVETAIL_PYTHON")
        .map_or_else(|| root().join("target/venv/bin/python"), PathBuf::from);
    let done = Command::new(&python)
        .current_dir(root())
        .args(["-c", code])
        .args(files)
        .output();
    let (ok, said, errors) = match done {
        Ok(done) => {
            let [said, errors] = [done.stdout, done.stderr]
                .map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
            (done.status.success(), said, errors)
        }
        Err(error) => (false, String::new(), error.to_string()),
    };
    assert!(
        ok,
        "{} is missing, cannot import vtk, numpy, meshio and pyvista, or failed: run `make test` \
         or `tools/setup.sh checks`, which install them, or name an interpreter that has them in \
         DOVETAIL_PYTHON\n{said}{errors}",
        python.display()
    );
    said
}
