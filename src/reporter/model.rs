//! Reports the model made from a mesh: counts, masses, the positions of the flanks on each other,
//! and possible mistakes.

use super::line::ReportLine;
use super::mistakes::element_words;
use super::{maps, mistakes, units};
use dovetail_export::warning::Weight;
use dovetail_export::words::{counted, figure, motion_of_sectors, percent, quantity};
use dovetail_mesh::Mesh;
use dovetail_solver::fem::given;
use dovetail_solver::fem::mass_properties::MassProperties;
use dovetail_solver::model::gather::name_for;
use dovetail_solver::model::{
    Assembly, Body, BodySpec, ContactLaw, ContactSpec, Cyclic, DashpotSpec, FlankMatch,
    FrictionMap, Gap, MatrixOrigin, Model, PlacedMatrices, Side, SpringSpec,
};
use dovetail_solver::run::{Bound, PrestressPass};

/// Notes and warnings about a bound assembly.
pub(super) fn lines(assembly: &Assembly, mesh: &Mesh, bound: &Bound) -> Vec<ReportLine> {
    let model = &bound.model;
    let springs = assembly.springs.iter().map(spring_note);
    let dashpots = assembly.dashpots.iter().map(dashpot_note);
    let mut lines: Vec<ReportLine> = springs.chain(dashpots).map(ReportLine::Note).collect();
    warn_of_held_volumes(assembly, mesh, &mut lines);
    report_flanks(assembly, model, &mut lines);
    report_straightened_edges(model, &mut lines);
    let friction = model.friction_maps.iter().map(friction_note);
    lines.extend(friction.map(ReportLine::Note));
    lines.push(ReportLine::Note(counts_note(model)));
    let of_sector = |c| [sector_note(c), faces_note(c)].map(ReportLine::Note);
    lines.extend(model.cyclic.iter().flat_map(of_sector));
    lines.extend(model.cyclic.iter().filter_map(faces_apart));
    maps::report_maps(model, &mut lines);
    let sizes = units::doubtful_sizes(assembly, bound).into_iter();
    lines.extend(sizes.map(|text| ReportLine::warning(Weight::Wrong, text)));
    lines.extend(mistakes::lines(assembly, bound));
    let bodies = assembly.bodies.iter().zip(&model.bodies);
    for ((spec, body), properties) in bodies.zip(&bound.properties) {
        report_mass(spec, body, properties, &mut lines);
    }
    lines
}

/// Note on one pass of the prestress and its change.
pub(super) fn pass_note(number: usize, pass: &PrestressPass) -> String {
    let moved = match pass.change {
        None => "pairs stuck".to_string(),
        Some(change) => format!("normal forces moved by {change:.1e}"),
    };
    let stuck = pass.stuck_frequency_hz;
    let stuck = stuck.map_or(String::new(), |hz| format!(", first stuck mode {hz:.4} Hz"));
    format!("prestress, pass {number}: {moved}{stuck}")
}

fn counts_note(model: &Model) -> String {
    let types = model.element_types();
    let shapes = types
        .iter()
        .map(|(element, n)| format!("{n} {}", element_words(*element)));
    let facets = model.bodies.iter().map(|body| body.facets.len()).sum();
    let facets =
        (facets > 0).then(|| counted(facets, "facet without elements", "facets without elements"));
    format!(
        "{}, {} dofs, {} contact pairs (largest mismatch {:.1e} m)",
        shapes.chain(facets).collect::<Vec<_>>().join(", "),
        model
            .bodies
            .iter()
            .map(|b| 3 * b.dofs.free_nodes())
            .sum::<usize>(),
        model.pairs.len(),
        model.largest_mismatch_m()
    )
}

fn sector_note(cyclic: &Cyclic) -> String {
    format!(
        "one of {} sectors, joined to the next by {} nodes; {}",
        cyclic.sectors,
        cyclic.ties.len(),
        motion_of_sectors(cyclic.excitation())
    )
}

/// Warning of faces of a sector that are apart when one is turned onto the other.
fn faces_apart(cyclic: &Cyclic) -> Option<ReportLine> {
    let is_apart = |found: &&FlankMatch| found.largest_separation_m > FAR_APART * found.facet_m;
    let mut apart = cyclic.matches.iter().filter(is_apart);
    if cyclic.largest_mismatch_m > LOOSE * cyclic.spacing_m {
        return Some(ReportLine::warning(
            Weight::Doubt,
            format!(
                "[cyclic]: the nodes of the two faces, one turned by a pitch, are up to {} apart and are joined: check point_m, \
                 axis and the mesh",
                quantity(cyclic.largest_mismatch_m, "m", 2)
            ),
        ));
    }
    let first = apart.next()?;
    Some(ReportLine::warning(
        Weight::Wrong,
        format!(
            "[cyclic]: face `{}` and the other face, turned by one pitch, are up to {} apart and are joined: check point_m, axis \
             and sectors",
            first.name,
            quantity(first.largest_separation_m, "m", 3)
        ),
    ))
}

/// Note on the faces of a sector: whether their meshes match.
fn faces_note(cyclic: &Cyclic) -> String {
    if cyclic.matches.is_empty() {
        return "the meshes of the two faces of the sector match: each node is joined to one node"
            .to_string();
    }
    let weighted = cyclic.matches.iter().filter(|found| !found.nodes_match);
    let names: Vec<String> = weighted.map(|found| format!("`{}`", found.name)).collect();
    let farthest = cyclic.matches.iter().map(|found| found.largest_mismatch_m);
    if names.is_empty() {
        return format!(
            "the meshes of the two faces of the sector match, but not their places: each node is joined to one node, at most \
             {:.1e} m away",
            farthest.fold(0.0, f64::max)
        );
    }
    format!(
        "the meshes of the two faces of the sector do not match ({}): the nodes of one face follow the shape functions of \
         the other one, at most {:.1e} m away",
        names.join(", "),
        farthest.fold(0.0, f64::max)
    )
}

/// Adds notes and warnings about the positions of the flanks on each other.
fn report_flanks(assembly: &Assembly, model: &Model, lines: &mut Vec<ReportLine>) {
    for contact in assembly.contacts.iter().filter(|c| c.second.is_none()) {
        lines.push(ReportLine::Note(format!(
            "contact {}: on rigid ground, for no `second` is named",
            contact.name
        )));
    }
    let mut displaced: Vec<String> = Vec::new();
    for found in &model.matches {
        let spec = assembly.contacts.iter().find(|c| c.name == found.name);
        let Some(ContactSpec {
            first,
            second: Some(second),
            law,
            ..
        }) = spec
        else {
            continue;
        };
        let name = &found.name;
        let shares = found.covered.map(|share| 100.0 * share);
        let (slave, master) = match found.slave {
            Side::First => (first, second),
            Side::Second => (second, first),
        };
        let is_bonded = *law == ContactLaw::Bonded;
        let far = found.largest_mismatch_m;
        if !found.nodes_match {
            let followed = match is_bonded {
                true => "the shape functions of",
                false => "a mean of nodes of",
            };
            lines.push(ReportLine::Note(format!(
                "contact {name}: the meshes of its flanks do not match; each node of `{slave}` follows {followed} `{master}`, \
                 at most {far:.1e} m away; {:.1} % of the area of `{first}` and {:.1} % of the area of `{second}` lie \
                 opposite the other",
                shares[0], shares[1]
            )));
        } else if is_bonded {
            lines.push(ReportLine::Note(format!(
                "contact {name}: the meshes of its flanks match; each node of `{slave}` is joined to one node of `{master}`, at \
                 most {far:.1e} m away"
            )));
        }
        let words = format!(
            "{name} ({:.1} % of the area of `{first}` and {:.1} % of the area of `{second}`)",
            shares[0], shares[1]
        );
        if is_displaced(found) {
            displaced.push(words);
        } else if found.nodes_match && found.covered.iter().all(|share| *share < WHOLE) {
            lines.push(ReportLine::Note(format!(
                "contact {words}: only this part of each flank faces the other"
            )));
        }
    }
    if !displaced.is_empty() {
        lines.push(ReportLine::warning(
            Weight::Doubt,
            format!(
                "neither flank lies wholly opposite the other at contact {}: check where the bodies stand",
                displaced.join(", ")
            ),
        ));
    }
    report_distances(assembly, model, lines);
}

/// Returns `true` if a body may be misplaced: both flanks protrude along the slot, or most of each faces
/// nothing. Across the slot it is normal that both protrude.
fn is_displaced(found: &FlankMatch) -> bool {
    let all_below = |shares: [f64; 2], limit: f64| shares.iter().all(|share| *share < limit);
    let protrude = all_below(found.covered, WHOLE) && all_below(found.covered_along, WHOLE);
    protrude || all_below(found.covered, MOST)
}

/// Adds warnings about flanks that are apart or overlap in the mesh, and are taken to touch.
fn report_distances(assembly: &Assembly, model: &Model, lines: &mut Vec<ReportLine>) {
    for found in &model.matches {
        let name = &found.name;
        let counts = |c: &&ContactSpec| c.name == *name && c.gap == Gap::Mesh;
        if assembly.contacts.iter().any(|c| counts(&c)) {
            continue;
        }
        let far_m = FAR_APART * found.facet_m;
        let (apart, overlap) = (found.largest_separation_m, found.largest_overlap_m);
        if overlap > far_m {
            lines.push(ReportLine::warning(
                Weight::Wrong,
                format!(
                    "contact \"{name}\": the bodies overlap by up to {} in the mesh, and the flanks are taken to touch: \
                     check where the bodies stand (translation_m, rotation_deg); gap = \"mesh\" counts the overlap as \
                     interference",
                    quantity(overlap, "m", 3)
                ),
            ));
        }
        if apart > far_m && apart > overlap {
            lines.push(ReportLine::warning(
                Weight::Doubt,
                format!(
                    "contact \"{name}\": the flanks are up to {} apart in the mesh and are taken to touch; gap = \"mesh\" \
                     counts it as clearance",
                    quantity(apart, "m", 3)
                ),
            ));
        }
    }
}

/// Adds notes and remarks about edges of flanks that are straight in the model but not in the mesh.
fn report_straightened_edges(model: &Model, lines: &mut Vec<ReportLine>) {
    for found in &model.straightened {
        let text = format!(
            "body \"{}\": {} of its flanks were made straight: their middle nodes, which follow the mean of the corners, \
             were moved by up to {} ({} of the edge); smaller elements follow a curved flank more closely",
            found.body,
            counted(found.edges, "edge", "edges"),
            quantity(found.largest_m, "m", 2),
            percent(found.largest_share, 2)
        );
        if found.largest_share > CURVED {
            lines.push(ReportLine::warning(Weight::Remark, text));
        } else {
            lines.push(ReportLine::Note(text));
        }
    }
}

/// Displacement of a middle node, as a share of its edge, above which a remark is given.
const CURVED: f64 = 2e-3;
/// Share of a flank from which on it counts as wholly opposite the other one.
const WHOLE: f64 = 0.98;
/// Share of the area below which less than most of a flank is opposite the other one.
const MOST: f64 = 0.5;
/// Distance of flanks, as a share of the length of their facets, above which a warning is given if
/// they are taken to touch.
const FAR_APART: f64 = 0.05;
/// Distance of two nodes of the faces of a sector, as a share of the smallest distance of two nodes of
/// one face, above which a warning is given. Coordinates of five digits are nearer.
const LOOSE: f64 = 5e-3;

/// Adds a note on matrices of another program: their rows, and the number of rigid motions that
/// strain nothing, six of a body without supports.
fn report_matrices(body: &Body, placed: &PlacedMatrices, lines: &mut Vec<ReportLine>) {
    let (others, empty) = (placed.unmeshed_unknowns(), placed.empty());
    let on_mesh = placed.places.len() - others - empty;
    let beside = match others {
        0 => String::new(),
        others => format!(", and {others} unknowns that no node of the mesh has"),
    };
    let free = given::free_rigid_motions(body, placed);
    let [one, several, rest] = if free.with_rotations {
        ["rigid motion is", "rigid motions are", ""]
    } else {
        [
            "translation is",
            "translations are",
            ", rotations not checked",
        ]
    };
    let free = match free.count {
        0 => format!("no {one} free{rest}"),
        count => format!("{} free{rest}", counted(count, one, several)),
    };
    let empty = match empty {
        0 => String::new(),
        count => format!(
            "; {} neither stiffness nor mass and {} left out",
            counted(count, "row has", "rows have"),
            if count == 1 { "is" } else { "are" }
        ),
    };
    lines.push(ReportLine::Note(format!(
        "{}: matrices, {on_mesh} displacements of nodes of the mesh{beside}; {free}{empty}",
        body.name
    )));
    let negative = placed.given.negative_stiffness();
    if negative > 0 {
        lines.push(ReportLine::warning(
            Weight::Doubt,
            format!(
                "body `{}`: its stiffness is indefinite, {} negative: without its contacts the body is unstable at rest; \
                 write the matrix again, unless a prestress or a rotation makes it so",
                body.name,
                counted(negative, "eigenvalue is", "eigenvalues are")
            ),
        ));
    }
}

fn spring_note(spring: &SpringSpec) -> String {
    let SpringSpec {
        name,
        first,
        second,
        stiffness_n_m,
        direction,
    } = spring;
    let (place, along) = (place(first, second.as_deref()), direction_words(*direction));
    format!("spring {name}: {place}, {stiffness_n_m:.4e} N/m{along}")
}

fn dashpot_note(dashpot: &DashpotSpec) -> String {
    let DashpotSpec {
        name,
        first,
        second,
        damping_n_s_m,
        direction,
    } = dashpot;
    let (place, along) = (place(first, second.as_deref()), direction_words(*direction));
    format!("dashpot {name}: {place}, {damping_n_s_m:.4e} N s/m{along}")
}

/// Words on the ends of a spring or a dashpot.
fn place(first: &str, second: Option<&str>) -> String {
    match second {
        None => format!("`{first}` on ground"),
        Some(second) => format!("`{first}` to `{second}`"),
    }
}

fn direction_words(direction: Option<[f64; 3]>) -> String {
    match direction {
        None => String::new(),
        Some([x, y, z]) => format!(" along [{x:.4}, {y:.4}, {z:.4}]"),
    }
}

/// Note on the coefficients of friction that a contact has from a file.
fn friction_note(map: &FrictionMap) -> String {
    let [least, most] = map.range;
    format!(
        "friction of contact {}: {least} to {most}, mean {:.4} over the area, from {} of {}; pairs are up to {:.2e} m \
         from theirs",
        map.contact,
        map.mean,
        counted(map.points, "point", "points"),
        map.field,
        map.largest_distance_m
    )
}

/// Warns of fixed groups that are volumes. A set of a face in a deck of Abaqus/CAE is a set of
/// nodes and a set of elements, and the elements have its name: fixing them fixes more than the
/// face.
fn warn_of_held_volumes(assembly: &Assembly, mesh: &Mesh, lines: &mut Vec<ReportLine>) {
    for body in &assembly.bodies {
        for name in body.fixed.iter().chain(body.fixed_along.iter().flatten()) {
            let find = |name| mesh.groups.get(&*name_for(mesh, &body.name, name));
            let Some(group) = find(name).filter(|group| group.dimension == 3) else {
                continue;
            };
            let nodes = format!("{name} (nodes)");
            let remedy = if find(&nodes).is_some() {
                format!("the set of nodes alone is `{nodes}`")
            } else {
                "name a surface or a set of nodes to hold a face".to_owned()
            };
            lines.push(ReportLine::warning(
                Weight::Doubt,
                format!(
                    "body \"{}\": the group `{name}` that is fixed is a volume, and all {} nodes of its elements \
                     are held: {remedy}",
                    body.name,
                    group.nodes.len()
                ),
            ));
        }
    }
}

/// Adds a note on mass and centrifugal force, so that a wrong unit is noticed before anything is
/// computed with it.
fn report_mass(spec: &BodySpec, body: &Body, own: &MassProperties, lines: &mut Vec<ReportLine>) {
    let force = own.centrifugal_force_n.map_or(String::new(), |force| {
        let size_n = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        format!(", centrifugal force {size_n:.4e} N")
    });
    let volume = own
        .volume_m3
        .map_or(String::new(), |v| format!(", {v:.4e} m3"));
    lines.push(ReportLine::Note(format!(
        "{}: {} kg{volume}{force}",
        body.name,
        figure(own.mass_kg, 4)
    )));
    match &body.matrices {
        MatrixOrigin::Elements(material) => {
            if let Some(doubt) = units::implausible_material(spec, *material) {
                lines.push(ReportLine::warning(Weight::Wrong, doubt));
            }
        }
        MatrixOrigin::Given(placed) => report_matrices(body, placed, lines),
    }
}
