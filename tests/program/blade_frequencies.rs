//! Blade alone, flanks held, on meshes/dovetail.msh: first frequencies at rest and spinning against
//! CalculiX 2.20 (benches/calculix/blade_modes.py) and an assembly by numpy and scipy
//! (benches/calculix/initial_displacement.py) on the same mesh. Mode shapes that `dovetail modes`
//! writes against the stiffness and the mass of the bodies.

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra_sparse::CscMatrix;
use vtkio::model::{Attribute, DataSet, Piece, Vtk};

use crate::shared_folder::Folder;
use crate::shared_program::{SMALL, ended, scene_command};
use crate::shared_runs::{number, rows};
use crate::shared_work::paper;
use dovetail_numerics::space::{norm, sub};
use dovetail_solver::fem::{self, assemble_body, statics::solve_by_cholesky};
use dovetail_solver::model::{Model, NodeMotion};
use dovetail_solver::reduction::craig_bampton::fixed_interface_modes;

/// Speed, rpm, and the first frequencies, Hz, by CalculiX and by scipy.
const CASES: [(f64, [f64; 4], [f64; 4]); 2] = [
    (
        0.0,
        [378.48, 1519.05, 1767.24, 3142.99],
        [378.490012, 1519.024396, 1767.190169, 3143.017343],
    ),
    (
        5000.0,
        [452.83, 1571.95, 1806.76, 3158.86],
        [452.695781, 1570.351029, 1808.424651, 3162.091809],
    ),
];

/// The paper's model on a ready mesh.
fn model(mesh: &str, overrides: &[String]) -> Model {
    paper(mesh, overrides).1
}

#[test]
fn first_blade_frequencies_are_those_of_other_programs() {
    for (speed_rpm, calculix, scipy) in CASES {
        let model = model("dovetail.msh", &[format!("rotation.speed_rpm={speed_rpm}")]);
        let blade = &model.bodies[0];
        let matrices = assemble_body(blade, model.rotation.as_ref(), &solve_by_cholesky).unwrap();
        let omega2 = fixed_interface_modes(&matrices, 4).unwrap().omega2;
        let found: Vec<f64> = omega2.iter().map(|w2| w2.sqrt() / TAU).collect();
        println!("{speed_rpm} rpm: {found:.4?} Hz");
        // CalculiX adds the initial-displacement stiffness, which is worth 0.1 % here.
        let tolerance = if speed_rpm == 0.0 { 5e-5 } else { 5e-3 };
        for (mode, hz) in found.iter().enumerate() {
            let off = hz / calculix[mode] - 1.0;
            assert!(
                off.abs() < tolerance,
                "{speed_rpm} rpm, mode {mode}: {off:e}"
            );
            // scipy: the same terms as here.
            let off = hz / scipy[mode] - 1.0;
            assert!(off.abs() < 1e-6, "{speed_rpm} rpm, mode {mode}: {off:e}");
        }
    }
}

/// Product u' A u.
fn energy(a: &CscMatrix<f64>, u: &[f64]) -> f64 {
    a.triplet_iter().map(|(i, j, a)| u[i] * a * u[j]).sum()
}

/// Name and vectors of each array of modes.vtu: nodes of the first body, then those of the second.
fn shapes(path: &Path) -> Vec<(String, Vec<[f64; 3]>)> {
    let DataSet::UnstructuredGrid { mut pieces, .. } = Vtk::import(path).unwrap().data else {
        panic!("not a grid")
    };
    let Piece::Inline(piece) = pieces.remove(0) else {
        panic!("not inline")
    };
    let vectors = |array: &Attribute| match array {
        Attribute::DataArray(array) if array.name.ends_with("_hz") => {
            let numbers = array.data.cast_into::<f64>().unwrap();
            let vectors = numbers.chunks_exact(3).map(|u| [u[0], u[1], u[2]]);
            Some((array.name.clone(), vectors.collect()))
        }
        _ => None,
    };
    piece.data.point.iter().filter_map(vectors).collect()
}

#[test]
fn mode_shapes_have_the_energies_of_their_frequencies() {
    let folder = Folder::new("mode-shapes");
    ended(
        scene_command("modes", "scenes/paper.toml", &folder, &[SMALL]),
        0,
    );
    let model = model("dovetail_small.msh", &[]);
    let structure = fem::assemble(&model).unwrap();
    let rows = rows(&folder.join("modes.csv"));
    let shapes = shapes(&folder.join("modes.vtu"));
    assert_eq!(shapes.len(), 3 * 6);
    for (name, shape) in &shapes {
        let row = rows.iter().find(|row| {
            let [kind, body, mode] = ["kind", "body", "mode"].map(|column| &row[column]);
            match body.as_str() {
                "assembly" => name.starts_with(&format!("{kind}_{mode}_")),
                body => name.starts_with(&format!("{kind}_{body}_{mode}_")),
            }
        });
        let row = row.unwrap_or_else(|| panic!("{name} is not in modes.csv"));
        let frequency_hz = number(row, "frequency_hz");
        let rounded: f64 = name.split('_').rev().nth(1).unwrap().parse().unwrap();
        assert!((rounded / frequency_hz - 1.0).abs() < 5e-5, "{name}");
        let (mut stiffness, mut mass) = (0.0, 0.0);
        let mut first_node = [0; 2];
        first_node[1] = model.bodies[0].nodes_m.len();
        for (b, body) in model.bodies.iter().enumerate() {
            let mut free = vec![0.0; 3 * body.dofs.free_nodes()];
            for (node, motion) in body.dofs.nodes.iter().enumerate() {
                if let NodeMotion::Free(n) = motion {
                    let at = 3 * *n as usize;
                    free[at..at + 3].copy_from_slice(&shape[first_node[b] + node]);
                }
            }
            stiffness += energy(&structure.bodies[b].stiffness, &free);
            mass += energy(&structure.bodies[b].mass, &free);
        }
        let found_hz = (stiffness / mass).sqrt() / TAU;
        let off = found_hz / frequency_hz - 1.0;
        assert!(off.abs() < 1e-9, "{name}: {found_hz} {frequency_hz}");
        // Flanks that are held do not move, and stuck ones move as one.
        for pair in &model.pairs {
            let first = shape[pair.slave.node.node as usize];
            let second = shape[first_node[1] + pair.slave.partner().unwrap().node as usize];
            let slip = norm(sub(first, second));
            assert!(slip < 1e-9, "{name}: {slip}");
            assert!(row["kind"] == "stuck" || norm(first) == 0.0, "{name}");
        }
    }
}
