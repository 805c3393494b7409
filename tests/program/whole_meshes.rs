//! Meshes that lost something on their way: bodies in pieces, middle nodes that a conversion drops,
//! regions of a pressure field.

use std::path::Path;

use crate::shared_folder::Folder;
use crate::shared_program::{has, scene_command, told};
use crate::shared_runs::summary;
use dovetail_mesh::Mesh;

/// Deck of a bar of two cubes, and perhaps other elements. The cubes have common nodes if
/// `nodes` says so.
fn bar(first_of: [usize; 2], more: &str) -> String {
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
    let mut nodes = String::new();
    let mut layer = |first: usize, x: usize| {
        for (i, [y, z]) in corners.iter().enumerate() {
            nodes += &format!("{}, {x}, {y}, {z}\n", first + i);
        }
    };
    layer(1, 0);
    layer(5, 1);
    layer(first_of[0], 1);
    layer(first_of[1], 2);
    let element = |a: usize, b: usize| {
        let labels = (a..a + 4).chain(b..b + 4).map(|label| label.to_string());
        labels.collect::<Vec<_>>().join(",")
    };
    let (one, two) = (element(1, 5), element(first_of[0], first_of[1]));
    format!(
        "*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=Bar\n1,{one}\n2,{two}\n*NSET, NSET=End\n1,2,3,4\n\
         *NSET, NSET=Tip\n{}\n*SURFACE, NAME=Left\n1,S2\n*SURFACE, NAME=Right\n2,S1\n{more}",
        first_of[1]
    )
}

/// Messages of `mesh` about a scene of this deck.
fn said_of(folder: &Folder, deck: &str, more: &str) -> String {
    folder.write("bar.inp", deck);
    let scene = format!(
        "name = \"bar\"\nmesh = {{ file = \"bar.inp\", metres_per_unit = 1 }}\n\
         damping = {{ ratio = 0.001 }}\n\
         excitation = [{{ on = \"Tip\", direction = [0, 0, 1], force_n = 1 }}]\n\
         observe = [{{ name = \"tip\", points = \"Tip\", direction = [0, 0, 1] }}]\n\
         response = {{ frequency_hz = [10, 20], points = 2 }}\n\
         body = [{{ name = \"bar\", volume = \"Bar\", fixed = [\"End\"], young_pa = 200e9, poisson = 0.3, density_kg_m3 = 7800 }}]\n{more}"
    );
    let scene = folder.write("bar.toml", scene);
    let mut mesh = scene_command("mesh", scene, &folder.join("out"), &[]);
    told(mesh.arg("--force"), 0)
}

/// Nodes 5 to 8 lie where 9 to 12 do. A contact between the faces there makes them two sides.
#[test]
fn a_body_in_pieces_is_warned_of_with_the_nodes() {
    let folder = Folder::new("whole-meshes-bar");
    let merged = said_of(&folder, &bar([5, 13], ""), "");
    assert!(
        !merged.contains("piece") && !merged.contains("one place"),
        "{merged}"
    );
    let halves = said_of(&folder, &bar([9, 13], ""), "");
    has(
        &halves,
        "4 pairs of nodes are at one place in body `bar`, which consists of 2 pieces & (1, 1 elements) \
         & first 5 and 9, 6 and 10, 7 and 11 and 1 more & Coherence Mesh;",
    );
    let contact =
        "contact = [{ name = \"cut\", first = \"Left\", second = \"Right\", law = \"bonded\" }]\n";
    let joined = said_of(&folder, &bar([9, 13], ""), contact);
    assert!(
        !joined.contains("pairs of nodes") && !joined.contains("pieces"),
        "{joined}"
    );
    let far = "*NODE\n21,7,0,0\n22,8,0,0\n23,7,1,0\n24,7,0,1\n*ELEMENT, TYPE=C3D4, ELSET=Bar\n3,21,22,23,24\n";
    let beside = said_of(&folder, &bar([5, 13], far), "");
    has(
        &beside,
        "body `bar` consists of 2 pieces that share no node and no contact (2, 1 elements)",
    );
}

/// A quadratic tetrahedron, wedge and hexahedron whose continued lines begin with blanks, as
/// Nastran allows, keep their middle nodes.
#[test]
fn bulk_data_keep_middle_nodes() {
    let folder = Folder::new("whole-meshes-nastran");
    let bulk = folder.write("part.dat", nastran());
    let mesh = dovetail::mesh_files::read(&bulk, 1.0).unwrap();
    let mut nodes: Vec<usize> = mesh.elements.iter().map(<[u32]>::len).collect();
    nodes.sort_unstable();
    assert_eq!(nodes, [10, 15, 20]);
    middles_are_in_the_middle(&mesh);
    assert_eq!(mesh.groups["property 7"].elements.len(), 3);
}

/// Name, corners and edges of a solid.
type Solid<'a> = (&'a str, Vec<[f64; 3]>, &'a [[usize; 2]]);

/// Bulk data with elements of three shapes: corners, then the middles of edges in Nastran's order,
/// in which the upright edges of hexahedra and wedges precede the edges of the top.
fn nastran() -> String {
    let tetrahedron: &[[f64; 3]] = &[[0., 0., 0.], [2., 0., 0.], [0., 2., 0.], [0., 0., 2.]];
    let square = [[0., 0.], [2., 0.], [2., 2.], [0., 2.]];
    let prism = |base: &[[f64; 2]], x: f64| -> Vec<[f64; 3]> {
        let layer = |z: f64| base.iter().map(move |[a, b]| [x + a, *b, z]);
        layer(0.).chain(layer(2.)).collect()
    };
    let of_tetrahedron = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
    let of_wedge = [
        [0, 1],
        [1, 2],
        [0, 2],
        [0, 3],
        [1, 4],
        [2, 5],
        [3, 4],
        [4, 5],
        [3, 5],
    ];
    let of_hexahedron = [
        [0, 1],
        [1, 2],
        [2, 3],
        [0, 3],
        [0, 4],
        [1, 5],
        [2, 6],
        [3, 7],
        [4, 5],
        [5, 6],
        [6, 7],
        [4, 7],
    ];
    let elements: [Solid<'_>; 3] = [
        ("CTETRA", tetrahedron.to_vec(), &of_tetrahedron),
        (
            "CPENTA",
            prism(&[square[0], square[1], square[2]], 10.),
            &of_wedge,
        ),
        ("CHEXA", prism(&square, 20.), &of_hexahedron),
    ];
    let (mut grid, mut bulk, mut count) = (String::new(), String::new(), 0);
    for (i, (name, corners, edges)) in elements.into_iter().enumerate() {
        let middles = edges
            .iter()
            .map(|[a, b]| [0, 1, 2].map(|k| 0.5 * (corners[*a][k] + corners[*b][k])));
        let mut fields = vec![(i + 1).to_string(), "7".to_owned()];
        for x in corners.iter().copied().chain(middles) {
            count += 1;
            grid += &format!(
                "GRID    {count:<8}        {:<8.2}{:<8.2}{:<8.2}\n",
                x[0], x[1], x[2]
            );
            fields.push(count.to_string());
        }
        for (line, fields) in fields.chunks(8).enumerate() {
            let first = if line == 0 { name } else { "" };
            let fields: String = fields.iter().map(|field| format!("{field:<8}")).collect();
            bulk += format!("{first:<8}{fields}").trim_end();
            bulk.push('\n');
        }
    }
    format!("CEND\nBEGIN BULK\n{grid}{bulk}ENDDATA\n")
}

#[track_caller]
fn middles_are_in_the_middle(mesh: &Mesh) {
    for (element, nodes) in mesh.elements.solids() {
        let at = |i: usize| mesh.nodes_m[nodes[i] as usize];
        for (middle, [a, b]) in (element.shape.corners()..).zip(element.shape.edges()) {
            for k in 0..3 {
                let between = 0.5 * (at(*a)[k] + at(*b)[k]);
                assert!((at(middle)[k] - between).abs() < 1e-12, "{element:?}");
            }
        }
    }
}

/// A plate pressed on both sides, each a region of its own in one file of CFD-Post: the forces of
/// both regions act.
#[test]
fn all_regions_of_a_pressure_field_press() {
    let folder = Folder::new("whole-meshes-regions");
    let region = |x: f64, pressure: f64| {
        let points = [[0, 0], [1, 0], [1, 1], [0, 1]].iter().enumerate();
        let lines = points.map(|(i, [y, z])| format!("{i}, {x}, {y}, {z}, {pressure}\n"));
        format!(
            "[Name]\nregion\n\n[Data]\nNode Number, X [ m ], Y [ m ], Z [ m ], Pressure [ Pa ]\n{}\n[Faces]\n0, 1, 2, 3\n\n",
            lines.collect::<String>()
        )
    };
    let amplitude = |regions: &str| {
        folder.write("regions.csv", regions);
        folder.write("bar.inp", bar([5, 13], "*SURFACE, NAME=Skin\n1,S1\n2,S2\n"));
        let scene = "name = \"bar\"\nmesh = { file = \"bar.inp\", metres_per_unit = 1 }\n\
            damping = { ratio = 0.001 }\nexcitation = [{ on = \"Skin\", file = \"regions.csv\" }]\n\
            observe = [{ name = \"tip\", points = \"Tip\", direction = [1, 0, 0] }]\n\
            response = { frequency_hz = [1, 2], points = 2, harmonics = 1 }\n\
            body = [{ name = \"bar\", volume = \"Bar\", fixed_y = [\"Bar\"], fixed_z = [\"Bar\"], fixed_x = [\"End\"], \
            young_pa = 200e9, poisson = 0.0, density_kg_m3 = 7800 }]\n";
        let scene = folder.write("bar.toml", scene);
        let mut run = scene_command("run", scene, &folder.join("out"), &[]);
        told(run.arg("--force"), 0);
        peak(&folder.join("out"))
    };
    let end = amplitude(&region(2.0, 100.0));
    let both = amplitude(&(region(0.0, 50.0) + &region(2.0, 100.0)));
    // The near end is held, so its pressure moves nothing: p L / E.
    let closed_form = 100.0 * 2.0 / 200e9;
    for found in [end, both] {
        assert!(
            (found / closed_form - 1.0).abs() < 1e-3,
            "{found} {closed_form}"
        );
    }
}

fn peak(folder: &Path) -> f64 {
    summary(folder)["response"]["peak_amplitude_m"]
        .as_f64()
        .unwrap()
}
