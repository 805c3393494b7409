//! The ready meshes and assemblies of them, made in code, for the tests of meshes and binding.

use dovetail_mesh::{ElementType, Mesh};
use dovetail_solver::dlft::StaticState;
use dovetail_solver::fem::assemble;
use dovetail_solver::model::{Assembly, ExcitationSpec, Material, Model, bind};
use dovetail_solver::problem::Problem;
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use dovetail_testkit::block::{block, side_by_side};

pub use crate::shared_bodies::{assembly, body, ready};
pub use crate::shared_dovetail::{assert_vector, contact};
pub use dovetail_numerics::space::{cross, distance, dot, sub};
pub use dovetail_testkit::folder::root;

pub fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(root().join("meshes").join(name)).unwrap()
}

/// Model of an assembly, and its reduced model.
pub fn reduced(assembly: &Assembly, mesh: &Mesh, wanted: StuckModes) -> (Model, Problem) {
    let model = bind(assembly, mesh, None).unwrap();
    let reduction = reduce(assemble(&model).unwrap(), wanted).unwrap();
    let problem = dovetail_solver::run::problem(reduction.model, &model);
    (model, problem)
}

/// Checks the pressure on each pair, within a relative tolerance.
#[track_caller]
pub fn assert_pressure(model: &Model, state: &StaticState, expected_pa: f64, tolerance: f64) {
    for (p, pair) in model.pairs.iter().enumerate() {
        let off = -state.lambda[3 * p] / pair.area_m2 / expected_pa - 1.0;
        assert!(off.abs() < tolerance, "{:?}: {off:e}", pair.position_m);
    }
}

/// Few stuck modes, for a static state.
pub const FEW_MODES: StuckModes = StuckModes::new(Some(4), Highest::OfFirstStuckMode(1.0));

// ---------------------------------------------------------------------------------- assemblies

pub fn blocks_assembly() -> Assembly {
    let bodies = vec![body("upper", &[]), body("lower", &["base"])];
    assembly(
        bodies,
        vec![contact("c", "upper_bottom", "lower_top")],
        "corner",
    )
}

/// Two blocks in one mesh, with the groups that [`blocks_assembly`] names.
pub fn two_blocks(upper: &Mesh, lower: &Mesh) -> Mesh {
    let mut both = side_by_side(("upper", upper), ("lower", lower));
    let names = [
        ("upper_volume", "upper"),
        ("lower_volume", "lower"),
        ("upper_z_min", "upper_bottom"),
        ("lower_z_max", "lower_top"),
        ("lower_z_min", "base"),
        ("upper_corner_111", "corner"),
    ];
    rename(&mut both, &names);
    both
}

/// Gives groups new names.
pub fn rename(mesh: &mut Mesh, names: &[(&str, &str)]) {
    for (old, new) in names {
        let group = mesh.groups.remove(*old).unwrap();
        mesh.groups.insert((*new).to_owned(), group);
    }
}

/// Length of [`bar`], m.
pub const LENGTH_M: f64 = 0.2;

/// A bar along x whose base is its face x = 0, with no strain across it; its end is observed. The
/// last value is the speed of sound in it.
pub fn bar(
    element: ElementType,
    cells: usize,
    excitation: ExcitationSpec,
) -> (Assembly, Mesh, f64) {
    let mut mesh = block(element, [cells, 1, 1], [LENGTH_M, 0.01, 0.01]);
    rename(&mut mesh, &[("volume", "bar")]);
    let material = Material {
        young_pa: 70e9,
        poisson: 0.0,
        density_kg_m3: 2700.0,
    };
    let mut bar = body("bar", &["x_min"]);
    bar.matrices = material.into();
    let mut assembly = assembly(vec![bar], Vec::new(), "x_max");
    assembly.rotation = None;
    assembly.excitations = vec![excitation];
    assembly.observations[0].direction = [1.0, 0.0, 0.0];
    (
        assembly,
        mesh,
        (material.young_pa / material.density_kg_m3).sqrt(),
    )
}
