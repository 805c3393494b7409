//! The script of the dovetail through gmsh: its meshes are bound as the ready one is, and it
//! explains what it cannot mesh.

use crate::shared_bodies::{MM, ready};
use crate::shared_dovetail::{check_dovetail, dovetail_assembly};
use dovetail::gmsh::{self, GmshError};
use dovetail::mesh_files;
use dovetail_mesh::{ElementType, Mesh, quality};
use dovetail_solver::model::bind;
use dovetail_testkit::folder::{Folder, root};

const WITH_GMSH: &str = "This test runs gmsh: `tools/setup.sh` installs it.";

/// Meshes the script.
fn meshed(name: &str, parameters: &[(&str, f64)]) -> (Mesh, String) {
    let folder = Folder::new(&format!("dovetail_script-{name}"));
    let out = folder.join("a.msh");
    let parameters: Vec<_> = parameters
        .iter()
        .map(|(n, v)| (n.to_string(), *v))
        .collect();
    let script = root().join("geometry/dovetail.geo");
    match gmsh::generate(&script, &parameters, 120.0, &out) {
        Ok(run) => {
            let mesh = mesh_files::read(&out, MM).unwrap();
            println!(
                "gmsh {}: {:.1} s, {:?}",
                run.version,
                run.seconds,
                quality::check(&mesh).unwrap()
            );
            assert!(!run.version.is_empty());
            (mesh, run.version)
        }
        Err(error) => panic!("{error}\n{WITH_GMSH}"),
    }
}

#[test]
fn the_script_meshes_into_what_the_ready_mesh_is() {
    let (mesh, version) = meshed("default", &[]);
    let ready = ready("dovetail.msh");
    check_dovetail(&bind(&dovetail_assembly(), &mesh, None).unwrap(), 4, 9);
    assert_eq!(
        mesh.elements.types().into_keys().collect::<Vec<_>>(),
        [ElementType::TET10]
    );
    let groups = |m: &Mesh| m.groups.keys().cloned().collect::<Vec<_>>();
    assert_eq!(groups(&mesh), groups(&ready));
    let volume = |m: &Mesh| quality::check(m).unwrap().volume_m3;
    assert!((volume(&mesh) / volume(&ready) - 1.0).abs() < 1e-3);
    if version == "4.8.4" {
        assert!(
            mesh == ready,
            "meshes/dovetail.msh is not what geometry/dovetail.geo gives"
        );
    }
}

#[test]
fn other_flank_meshes_and_gradings_match_too() {
    for (name, nu, nv, more) in [
        ("graded", 4, 9, vec![("bump", 0.3), ("order", 2.0)]),
        ("strong", 5, 12, vec![("bump_u", 0.15), ("order", 1.0)]),
        (
            "fine",
            8,
            18,
            vec![("order", 2.0), ("lc", 5.0), ("lc_root", 2.5)],
        ),
        ("coarse", 2, 4, vec![("order", 1.0), ("lc_air", 5.0)]),
    ] {
        let mut parameters = vec![("nu", nu as f64), ("nv", nv as f64)];
        parameters.extend(more);
        let (mesh, _) = meshed(name, &parameters);
        check_dovetail(&bind(&dovetail_assembly(), &mesh, None).unwrap(), nu, nv);
    }
}

#[test]
fn impossible_dimensions_are_explained_by_the_script() {
    let folder = Folder::new("dovetail_script-none");
    let out = folder.join("a.msh");
    let script = root().join("geometry/dovetail.geo");
    for (name, value, told) in [
        ("nu", 1.0, "at least 2 x 2"),
        ("wf", 40.0, "do not fit"),
        ("order", 3.0, "1 or 2"),
    ] {
        match gmsh::generate(&script, &[(name.to_string(), value)], 60.0, &out) {
            Err(GmshError::Missing { .. }) => panic!("{WITH_GMSH}"),
            Err(error) => assert!(error.to_string().contains(told), "{error}"),
            Ok(_) => panic!("{name} = {value} gave a mesh"),
        }
    }
}
