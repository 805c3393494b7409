//! Blade alone, flanks held, on meshes/dovetail.msh: first frequencies at rest and spinning against
//! CalculiX 2.20 (benches/calculix/blade_modes.py) and an assembly by numpy and scipy
//! (benches/calculix/initial_displacement.py) on the same mesh.

use std::path::Path;

use dovetail::scene;
use dovetail_solver::fem::{assemble_body, statics::solve_by_cholesky};
use dovetail_solver::mesh::msh;
use dovetail_solver::mesh::source::MeshKind;
use dovetail_solver::model::bind;
use dovetail_solver::reduction::craig_bampton::fixed_interface_modes;

/// Speed, CalculiX, scipy.
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

#[test]
fn first_blade_frequencies_are_those_of_other_programs() {
    for (speed_rpm, calculix, scipy) in CASES {
        let overrides = [
            "mesh.file=../meshes/dovetail.msh".to_string(),
            format!("rotation.speed_rpm={speed_rpm}"),
        ];
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paper.toml");
        let scene = scene::load(&scene, &overrides).unwrap();
        let assembly = scene.assembly().unwrap();
        let MeshKind::File { path } = &assembly.mesh.kind else {
            panic!("the ready mesh was asked for");
        };
        let mesh = msh::read(path, assembly.mesh.metres_per_unit).unwrap();
        let model = bind(assembly, &mesh).unwrap();
        let blade = &model.bodies[0];
        let matrices = assemble_body(blade, model.rotation.as_ref(), &solve_by_cholesky).unwrap();
        let omega2 = fixed_interface_modes(blade, &matrices, 4).unwrap().omega2;
        let found: Vec<f64> = omega2
            .iter()
            .map(|w2| w2.sqrt() / std::f64::consts::TAU)
            .collect();
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
