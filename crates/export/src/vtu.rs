//! Writes unstructured grids for ParaView: the bodies in the static state and in motion.
//!
//! Arrays are f64, compressed by zlib, which every reader of the format supports. The nodes of an
//! element are in the order of VTK.

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataSet, IOBuffer, UnstructuredGridPiece,
    Version, VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

use super::{ExportError, write_file};
use dovetail_solver::fem::stress::{point_stress, points_m};
use dovetail_solver::model::{Cyclic, Model};
use dovetail_solver::results::modes::ModeShape;
use dovetail_solver::results::recovery::{NodalField, added, frame_phase_rad, oscillation};
use dovetail_solver::results::stress::{Singular, StressCycle};
use dovetail_solver::run::{DiscModes, PeakStress};
use dovetail_solver::space::{dot, sub};
use dovetail_solver::spectrum::{cosine, sine};

/// Fields of one body in the static state.
#[derive(Debug, Clone, Copy)]
pub struct StaticBodyFields<'a> {
    /// Displacement of each node.
    pub displacement_m: &'a [[f64; 3]],
    /// Stress in the middle of each element: xx, yy, zz, xy, yz, xz.
    pub stress_pa: &'a [[f64; 6]],
    /// Equivalent stress of each node.
    pub von_mises_pa: &'a [f64],
}

/// Writes static.vtu: the bodies with `displacement_m` and `von_mises_pa` on the nodes, `stress_pa`
/// (VTK's order XX, YY, ZZ, XY, YZ, XZ) and `body` (0, 1, ...) on the elements, and the tags of the
/// mesh file. The cells of a body without elements are its facets, without stress.
///
/// # Errors
/// [`ExportError`] if a field does not fit the mesh or is not finite, or if the file cannot be
/// written.
pub fn write_static(
    path: &Path,
    model: &Model,
    fields: &[StaticBodyFields<'_>],
) -> Result<(), ExportError> {
    let mut displacement = Vec::new();
    let mut von_mises = Vec::new();
    let mut stress = Vec::new();
    for (body, f) in model.bodies.iter().zip(fields) {
        let (nodes, elements) = (body.nodes_m.len(), body.elements.len());
        let name = |what: &str| format!("{what} of body {}", body.name);
        let check = |what, found, expected, counted| {
            check_length(path, &name(what), found, expected, counted)
        };
        check(
            "static displacement",
            f.displacement_m.len(),
            nodes,
            "one per node",
        )?;
        check(
            "von Mises stress",
            f.von_mises_pa.len(),
            nodes,
            "one per node",
        )?;
        check("stress", f.stress_pa.len(), elements, "one per element")?;
        displacement.extend_from_slice(f.displacement_m.as_flattened());
        von_mises.extend_from_slice(f.von_mises_pa);
        stress.extend_from_slice(f.stress_pa.as_flattened());
        stress.resize(stress.len() + 6 * body.facets.len(), 0.0);
    }
    let mut grid = Grid::from_model(model, None);
    grid.point_array("displacement_m", 3, displacement);
    grid.point_array("von_mises_pa", 1, von_mises);
    grid.cell_array("stress_pa", 6, stress);
    grid.write(path)
}

/// Writes the bodies with their motion over one period, as harmonics on the nodes: `mean_m`, and
/// for each harmonic k of the displacement `h<k>_cos_m` and `h<k>_sin_m`, so that `u = mean + sum_k
/// cos(k w t) C_k + sin(k w t) S_k`. For each component there are also `h<k>_amplitude_m` and
/// `h<k>_phase_rad` of `A cos(k w t - phase)`, as in response.csv.
///
/// Where there is stress, its tensors have the same harmonics: `mean_stress_pa`,
/// `h<k>_stress_cos_pa` and `h<k>_stress_sin_pa`. `von_mises_mean_pa`, `von_mises_amplitude_pa` and
/// `von_mises_largest_pa` are those of [`StressCycle`], `utilisation` is that of the strength, zero
/// without one, and `singular` is 1 at supports, 2 at edges of flanks, 3 at point loads, and 0
/// elsewhere.
///
/// `coefficients[b]` holds the 2H+1 nodal fields of body b: mean, cosine 1, sine 1, ... With
/// rotation the mean includes the static displacement.
///
/// With a disc all of its sectors are written. The fields given are those of its first sector, and
/// nodes and elements have `sector`, counted from 0.
///
/// # Errors
/// Fields that do not fit the bodies; a file that cannot be written.
pub fn write_motion(
    path: &Path,
    (model, disc): (&Model, Option<&Cyclic>),
    coefficients: &[Vec<NodalField>],
    stress: Option<&PeakStress>,
) -> Result<(), ExportError> {
    check_motion(path, model, coefficients)?;
    let mut grid = Grid::from_model(model, disc);
    add_motion(&mut grid, &expand_sectors(disc, coefficients, rotate));
    if let Some(stress) = stress {
        add_stress(&mut grid, stress, disc);
    }
    grid.write(path)
}

/// Cosine and sine part of a wave, `cosine - i sine`, times `exp(i angle)`.
fn rotate_phase<const N: usize>(angle_rad: f64, c: [f64; N], s: [f64; N]) -> [[f64; N]; 2] {
    let (sin, cos) = angle_rad.sin_cos();
    let sum = |a: f64, b: f64| std::array::from_fn(|i| a * c[i] + b * s[i]);
    [sum(cos, sin), sum(-sin, cos)]
}

/// Turns a vector.
fn rotate(turn: &[[f64; 3]; 3], u: [f64; 3]) -> [f64; 3] {
    turn.map(|row| dot(row, u))
}

/// Turns a stress: xx, yy, zz, xy, yz, xz.
fn turned_stress(turn: &[[f64; 3]; 3], [xx, yy, zz, xy, yz, xz]: [f64; 6]) -> [f64; 6] {
    let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    // The components of R S R^T along pairs of axes.
    let along = |a: usize, b: usize| dot(turn[a], rows.map(|row| dot(row, turn[b])));
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|(a, b)| along(a, b))
}

/// Fields of the bodies of all sectors of a disc, from those of the first one, each with 2H+1
/// coefficients: harmonic k of sector j is turned by j pitches, and times `exp(i k E 2 pi j / N)` with
/// the engine order E. Without a disc the fields as they are.
fn expand_sectors<'a, const N: usize>(
    disc: Option<&Cyclic>,
    coefficients: impl IntoIterator<Item = &'a Vec<Vec<[f64; N]>>> + Clone,
    turned: fn(&[[f64; 3]; 3], [f64; N]) -> [f64; N],
) -> Vec<Cow<'a, [Vec<[f64; N]>]>> {
    let Some(disc) = disc else {
        let bodies = coefficients.into_iter();
        return bodies.map(|fields| Cow::Borrowed(&fields[..])).collect();
    };
    let of_sector = |sector: usize| {
        let turn = disc.turned_to(sector);
        let of_body = move |fields: &'a Vec<Vec<[f64; N]>>| {
            let mean = fields[0].iter().map(|v| turned(&turn, *v));
            let mut coefficients = vec![mean.collect()];
            for k in 1..=fields.len() / 2 {
                let angle_rad = disc.phase_rad(k, sector);
                let both = fields[cosine(k)].iter().zip(&fields[sine(k)]);
                let parts = both.map(|(c, s)| rotate_phase(angle_rad, *c, *s));
                let turned = parts.map(|parts| parts.map(|v| turned(&turn, v)).into());
                let (cosine, sine) = turned.unzip();
                coefficients.extend([cosine, sine]);
            }
            Cow::Owned(coefficients)
        };
        coefficients.clone().into_iter().map(of_body)
    };
    (0..disc.sectors).flat_map(of_sector).collect()
}

/// Adds the arrays of a motion to those of the nodes.
fn add_motion(grid: &mut Grid, coefficients: &[Cow<'_, [NodalField]>]) {
    let fields = coefficients.first().map_or(1, |fields| fields.len());
    grid.point_array("mean_m", 3, join_bodies(coefficients, 0));
    for k in 1..=fields / 2 {
        let [cosine, sine] = [cosine(k), sine(k)].map(|i| join_bodies(coefficients, i));
        let both = || cosine.iter().zip(&sine);
        let amplitude = both().map(|(c, s)| c.hypot(*s)).collect();
        let phase = both().map(|(c, s)| s.atan2(*c)).collect();
        grid.point_array(&format!("h{k}_amplitude_m"), 3, amplitude);
        grid.point_array(&format!("h{k}_phase_rad"), 3, phase);
        grid.point_array(&format!("h{k}_cos_m"), 3, cosine);
        grid.point_array(&format!("h{k}_sin_m"), 3, sine);
    }
}

/// Field `i` of all bodies, one after the other.
fn join_bodies<const N: usize>(coefficients: &[Cow<'_, [Vec<[f64; N]>]>], i: usize) -> Vec<f64> {
    let bodies = coefficients.iter().flat_map(|fields| &fields[i]);
    bodies.flatten().copied().collect()
}

/// Adds the arrays of the stress to those of the nodes. Its cycle is that of the first sector in all
/// sectors of a disc, at another instant.
fn add_stress(grid: &mut Grid, stress: &PeakStress, disc: Option<&Cyclic>) {
    let tensors = stress.bodies.iter().map(|body| &body.coefficients_pa);
    let tensors = expand_sectors(disc, tensors, turned_stress);
    let fields = tensors.first().map_or(1, |fields| fields.len());
    grid.point_array("mean_stress_pa", 6, join_bodies(&tensors, 0));
    for k in 1..=fields / 2 {
        let [cosine, sine] = [cosine(k), sine(k)].map(|i| join_bodies(&tensors, i));
        grid.point_array(&format!("h{k}_stress_cos_pa"), 6, cosine);
        grid.point_array(&format!("h{k}_stress_sin_pa"), 6, sine);
    }
    let sectors = || 0..disc.map_or(1, |disc| disc.sectors);
    let bodies = || sectors().flat_map(|_| &stress.bodies);
    let cycles = || bodies().flat_map(|body| &body.cycles);
    let mut add = |name: &str, figure: fn(&StressCycle) -> f64| {
        grid.point_array(name, 1, cycles().map(figure).collect());
    };
    add("von_mises_mean_pa", |cycle| cycle.mean_pa);
    add("von_mises_amplitude_pa", |cycle| cycle.amplitude_pa);
    add("von_mises_largest_pa", |cycle| cycle.largest_pa);
    if stress.strengths.iter().any(Option::is_some) {
        let strengths = sectors().flat_map(|_| &stress.strengths);
        let stresses = bodies().zip(strengths).flat_map(|(body, strength)| {
            let cycles = body.cycles.iter();
            cycles.map(move |cycle| strength.map_or(0.0, |s| cycle.utilisation(s)))
        });
        grid.point_array("utilisation", 1, stresses.collect());
    }
    let code = |reason: &Option<Singular>| match reason {
        None => 0,
        Some(Singular::Support) => 1,
        Some(Singular::FlankEdge) => 2,
        Some(Singular::PointLoad) => 3,
    };
    let singular = sectors().flat_map(|_| stress.singular.iter().flatten());
    grid.point_integers("singular", singular.map(code).collect());
}

/// Writes the integration points of all elements, with the stress of the fields of the bodies
/// there: `names` and, for each, `fields` of the nodes of each body, m. Points have `body` and the
/// tag of their element.
///
/// # Errors
/// [`ExportError`] if a field does not fit the mesh or is not finite, or if the file cannot be
/// written.
pub fn write_stress_points(
    path: &Path,
    model: &Model,
    fields: &[(String, Vec<&[[f64; 3]]>)],
) -> Result<(), ExportError> {
    let mut points = Vec::new();
    let (mut bodies, mut tags) = (Vec::new(), Vec::new());
    for (b, body) in model.bodies.iter().enumerate() {
        for (e, of_element) in points_m(body).iter().enumerate() {
            points.extend_from_slice(of_element.as_flattened());
            bodies.resize(bodies.len() + of_element.len(), b as i32);
            tags.resize(tags.len() + of_element.len(), body.elements.tags()[e]);
        }
    }
    let count = bodies.len();
    let mut grid = Grid::new(
        points,
        (0..count as u64).collect(),
        (1..=count as u64).collect(),
        vec![CellType::Vertex; count],
    );
    grid.arrays.point.push(array("element_tag", 1, tags));
    grid.point_integers("body", bodies);
    for (name, of_bodies) in fields {
        let stressed_bodies = model.bodies.iter().zip(of_bodies);
        let stress: Vec<[f64; 6]> = stressed_bodies
            .flat_map(|(body, u)| point_stress(body, u))
            .collect();
        grid.point_array(name, 6, stress.into_flattened());
    }
    grid.write(path)
}

/// Writes peak.pvd with peak/peak_000.vtu and so on: the motion of [`write_motion`] at
/// `frequency_hz` as `frames` frames, evenly spaced (the end, equal to the start, is left out). The
/// timestep is the time in s.
///
/// Arrays on the nodes: `displacement_m` is the whole displacement, mean included; `oscillation_m`
/// is the displacement without the mean, the one to warp by. The files are those of
/// [`frame_files`]. With a disc they show all of its sectors.
///
/// # Errors
/// [`ExportError`] if a field does not fit the mesh or is not finite, or if the file cannot be
/// written.
pub fn write_frames(
    folder: &Path,
    (model, disc): (&Model, Option<&Cyclic>),
    coefficients: &[Vec<NodalField>],
    frequency_hz: f64,
    frames: usize,
) -> Result<(), ExportError> {
    let pvd = folder.join(FRAMES);
    check_motion(&pvd, model, coefficients)?;
    let still = Grid::from_model(model, disc);
    let coefficients = expand_sectors(disc, coefficients, rotate);
    let write_frame = |frame: usize| {
        let phase = frame_phase_rad(frame, frames);
        let mut whole = Vec::with_capacity(still.points.len());
        let mut moving = Vec::with_capacity(still.points.len());
        for fields in &coefficients {
            let u = oscillation(fields, phase);
            whole.extend_from_slice(added(&fields[0], &u).as_flattened());
            moving.extend_from_slice(u.as_flattened());
        }
        let mut grid = still.clone();
        grid.point_array("displacement_m", 3, whole);
        grid.point_array("oscillation_m", 3, moving);
        let file = frame_file(frame);
        grid.write(&folder.join(&file))?;
        Ok((frame as f64 / (frames as f64 * frequency_hz), file))
    };
    let entries: Vec<_> = (0..frames)
        .into_par_iter()
        .map(write_frame)
        .collect::<Result<_, ExportError>>()?;
    write_pvd(&pvd, &entries, "one period; timestep = time in seconds")
}

/// File name of the collection of the frames.
const FRAMES: &str = "peak.pvd";

/// Names of the files of `frames` frames, their collection last.
pub fn frame_files(frames: usize) -> Vec<String> {
    let files = (0..frames).map(frame_file);
    files.chain([FRAMES.to_owned()]).collect()
}

fn frame_file(frame: usize) -> String {
    format!("peak/peak_{frame:03}.vtu")
}

/// Checks that each body has 2H+1 fields with a vector per node.
fn check_motion(
    path: &Path,
    model: &Model,
    coefficients: &[Vec<NodalField>],
) -> Result<(), ExportError> {
    for (body, fields) in model.bodies.iter().zip(coefficients) {
        let name = |i: usize| format!("harmonic field {i} of body {}", body.name);
        let odd = fields.len().max(1) | 1;
        check_length(path, &name(0), fields.len(), odd, "2H+1 fields")?;
        for (i, field) in fields.iter().enumerate() {
            let nodes = body.nodes_m.len();
            check_length(path, &name(i), field.len(), nodes, "one per node")?;
        }
    }
    Ok(())
}

/// Name of the array of a mode: `stuck_1_451.12_hz`, `flanks_held_blade_1_455.36_hz`; the frequency
/// with five digits.
fn array_name(mode: &ModeShape) -> String {
    let body = mode.body.iter().map(|body| format!("_{body}"));
    format!(
        "{}{}_{}_{}_hz",
        mode.kind.id(),
        body.collect::<String>(),
        mode.mode,
        five_digits(mode.frequency_hz)
    )
}

/// Frequency with five digits.
fn five_digits(frequency_hz: f64) -> String {
    let digits = 4.0 - frequency_hz.abs().max(1e-9).log10().floor();
    format!("{frequency_hz:.*}", digits.max(0.0) as usize)
}

/// Mode on all nodes, scaled to a largest displacement of 1 whose largest component is positive.
fn to_scale(mode: &ModeShape) -> Vec<f64> {
    // A mode that does not move has no scale.
    let scale = match mode.scale() {
        0.0 => 1.0,
        scale => scale,
    };
    let nodes = mode.shape.iter().flatten();
    nodes.flatten().map(|u| u / scale).collect()
}

/// Writes the bodies with mode shapes on the nodes. Each is a vector without unit whose largest
/// length is 1, under the name `<kind>[_<body>]_<mode>_<frequency>_hz`.
///
/// # Errors
/// [`ExportError`] if a field does not fit the mesh or is not finite, or if the file cannot be
/// written.
pub fn write_modes(path: &Path, model: &Model, modes: &[ModeShape]) -> Result<(), ExportError> {
    let mut grid = Grid::from_model(model, None);
    for mode in modes {
        let name = array_name(mode);
        for (body, shape) in model.bodies.iter().zip(&mode.shape) {
            let field = format!("{name} of body {}", body.name);
            let nodes = body.nodes_m.len();
            check_length(path, &field, shape.len(), nodes, "one per node")?;
        }
        grid.point_array(&name, 3, to_scale(mode));
    }
    grid.write(path)
}

/// Writes all sectors of a disc with the modes of a nodal diameter on the nodes, each as two vectors
/// without unit, `mode_<number>_<frequency>_hz_cos` and `..._sin`: the disc moves as the first times
/// cos wt plus the second times sin wt. The largest displacement is 1. Nodes and elements have
/// `sector`, counted from 0.
///
/// # Errors
/// Shapes that do not fit the bodies; a file that cannot be written.
pub fn write_disc(
    path: &Path,
    model: &Model,
    disc: &Cyclic,
    modes: &DiscModes,
) -> Result<(), ExportError> {
    let mut grid = Grid::from_model(model, Some(disc));
    for (number, mode) in (1..).zip(&modes.modes) {
        for part in [&mode.cosine, &mode.sine] {
            for (body, shape) in model.bodies.iter().zip(part) {
                let field = format!("mode {number} of body {}", body.name);
                let nodes = body.nodes_m.len();
                check_length(path, &field, shape.len(), nodes, "one per node")?;
            }
        }
        let name = format!("mode_{number}_{}_hz", five_digits(mode.frequency_hz));
        let nodes = || mode.cosine.iter().flatten().zip(mode.sine.iter().flatten());
        let size = |u: &[f64; 3]| u.iter().map(|u| u * u).sum::<f64>();
        let largest = nodes().map(|(c, s)| size(c).max(size(s)));
        let largest = largest.fold(0.0, f64::max).sqrt();
        let scale = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        let (mut cosine, mut sine) = (Vec::new(), Vec::new());
        for sector in 0..disc.sectors {
            let turn = disc.turned_to(sector);
            let angle_rad = TAU * (modes.nodal_diameter * sector) as f64 / disc.sectors as f64;
            for (c, s) in nodes() {
                let parts = rotate_phase(angle_rad, *c, *s).map(|u| rotate(&turn, u));
                let [c, s] = parts.map(|u| u.map(|u| scale * u));
                cosine.extend(c);
                sine.extend(s);
            }
        }
        grid.point_array(&format!("{name}_cos"), 3, cosine);
        grid.point_array(&format!("{name}_sin"), 3, sine);
    }
    grid.write(path)
}

/// Writes a collection of files with their timesteps, sorted by timestep (viewers need that;
/// entries of one timestep keep their order). Names and `comment` have no markup.
pub(crate) fn write_pvd(
    path: &Path,
    entries: &[(f64, String)],
    comment: &str,
) -> Result<(), ExportError> {
    let mut sorted: Vec<&(f64, String)> = entries.iter().collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let entry = |(timestep, file): &&(f64, String)| {
        format!("    <DataSet timestep=\"{timestep:e}\" part=\"0\" file=\"{file}\"/>\n")
    };
    let entries: String = sorted.iter().map(entry).collect();
    let xml = format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         \x20 <!-- {comment} -->\n  <Collection>\n{entries}  </Collection>\n</VTKFile>\n"
    );
    write_file(path, xml.as_bytes())
}

/// Points and cells with their arrays, ready to be written.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    points: Vec<f64>,
    connectivity: Vec<u64>,
    offsets: Vec<u64>,
    types: Vec<CellType>,
    arrays: Attributes,
    /// Name and entry of the first value that is not finite.
    not_finite: Option<(String, usize)>,
}

impl Grid {
    /// Grid of all bodies, the nodes of each before those of the next, with `body` on nodes and
    /// elements, `node_tag` and `element_tag`. With a disc, of which the bodies are the first sector,
    /// the grid has all sectors, one after the other, with `sector` on nodes and elements.
    fn from_model(model: &Model, disc: Option<&Cyclic>) -> Self {
        let Some(disc) = disc else {
            return Self::from_copies(model, std::iter::once(|x: [f64; 3]| x));
        };
        let places = (0..disc.sectors).map(|sector| {
            let turn = disc.turned_to(sector);
            move |x: [f64; 3]| {
                let arm = rotate(&turn, sub(x, disc.point_m));
                [0, 1, 2].map(|k| disc.point_m[k] + arm[k])
            }
        });
        let mut grid = Self::from_copies(model, places);
        let nodes: usize = model.bodies.iter().map(|body| body.nodes_m.len()).sum();
        let bodies = model.bodies.iter();
        let cells: usize = bodies
            .map(|body| body.elements.len() + body.facets.len())
            .sum();
        let of = |each: usize| (0..each * disc.sectors).map(move |i| (i / each) as i32);
        grid.point_integers("sector", of(nodes).collect());
        grid.cell_integers("sector", of(cells).collect());
        grid
    }

    /// Grid of copies of all bodies, each with its nodes at other places.
    fn from_copies<F: Fn([f64; 3]) -> [f64; 3]>(
        model: &Model,
        places: impl Iterator<Item = F>,
    ) -> Self {
        let mut points: Vec<f64> = Vec::new();
        let mut connectivity = Vec::new();
        let mut offsets = Vec::new();
        let mut types = Vec::new();
        let (mut node_tags, mut node_body) = (Vec::new(), Vec::new());
        let (mut element_tags, mut element_body) = (Vec::new(), Vec::new());
        let mut first_node = 0;
        for place in places {
            for (b, body) in model.bodies.iter().enumerate() {
                let elements = body.elements.iter().map(|n| (n, vtk_cell(n.len())));
                let facets = body.facets.iter().map(|n| (n, vtk_facet(n.len())));
                for (nodes, kind) in elements.chain(facets) {
                    connectivity.extend(nodes.iter().map(|&n| first_node + u64::from(n)));
                    offsets.push(connectivity.len() as u64);
                    types.push(kind);
                }
                points.extend(body.nodes_m.iter().flat_map(|x| place(*x)));
                node_tags.extend_from_slice(&body.node_tags);
                element_tags.extend_from_slice(body.elements.tags());
                element_tags.extend_from_slice(body.facets.tags());
                node_body.resize(node_tags.len(), b as i32);
                element_body.resize(element_tags.len(), b as i32);
                first_node += body.nodes_m.len() as u64;
            }
        }
        let mut grid = Self::new(points, connectivity, offsets, types);
        grid.arrays.point.push(array("node_tag", 1, node_tags));
        grid.arrays.point.push(array("body", 1, node_body));
        grid.arrays.cell.push(array("element_tag", 1, element_tags));
        grid.arrays.cell.push(array("body", 1, element_body));
        grid
    }

    /// Grid of quadrilaterals on points.
    pub(crate) fn from_quadrilaterals(points: Vec<f64>, corners: &[[u64; 4]]) -> Self {
        Self::new(
            points,
            corners.as_flattened().to_vec(),
            (1..=corners.len() as u64).map(|q| 4 * q).collect(),
            vec![CellType::Quad; corners.len()],
        )
    }

    fn new(
        points: Vec<f64>,
        connectivity: Vec<u64>,
        offsets: Vec<u64>,
        types: Vec<CellType>,
    ) -> Self {
        let arrays = Attributes::new();
        let mut grid = Self {
            points,
            connectivity,
            offsets,
            types,
            arrays,
            not_finite: None,
        };
        grid.not_finite = first_not_finite("node positions", 3, &grid.points);
        grid
    }

    pub(crate) fn point_array(&mut self, name: &str, components: u32, values: Vec<f64>) {
        self.note_not_finite(name, components, &values);
        self.arrays.point.push(array(name, components, values));
    }

    fn point_integers(&mut self, name: &str, values: Vec<i32>) {
        self.arrays.point.push(array(name, 1, values));
    }

    pub(crate) fn cell_integers(&mut self, name: &str, values: Vec<i32>) {
        self.arrays.cell.push(array(name, 1, values));
    }

    pub(crate) fn cell_array(&mut self, name: &str, components: u32, values: Vec<f64>) {
        self.note_not_finite(name, components, &values);
        self.arrays.cell.push(array(name, components, values));
    }

    fn note_not_finite(&mut self, name: &str, components: u32, values: &[f64]) {
        if self.not_finite.is_none() {
            self.not_finite = first_not_finite(name, components as usize, values);
        }
    }

    /// Writes the file. Errors: an array contains a number that is not finite, or the file cannot
    /// be written.
    pub(crate) fn write(self, path: &Path) -> Result<(), ExportError> {
        if let Some((field, index)) = self.not_finite {
            return Err(ExportError::NotFinite {
                path: path.to_path_buf(),
                field,
                index,
            });
        }
        let piece = UnstructuredGridPiece {
            points: IOBuffer::F64(self.points),
            cells: Cells {
                cell_verts: VertexNumbers::XML {
                    connectivity: self.connectivity,
                    offsets: self.offsets,
                },
                types: self.types,
            },
            data: self.arrays,
        };
        let vtk = Vtk {
            version: Version::XML { major: 1, minor: 0 },
            title: String::new(),
            byte_order: ByteOrder::LittleEndian,
            data: DataSet::inline(piece),
            file_path: None::<PathBuf>,
        };
        let failed = |source: vtkio::Error| ExportError::EncodeVtk {
            path: path.to_path_buf(),
            source,
        };
        let xml = vtk
            .try_into_xml_format(Compressor::ZLib, 1)
            .map_err(|e| failed(e.into()))?;
        write_file(path, add_component_names(xml.to_string()).as_bytes())
    }
}

/// Adds names of the components of vectors and of stresses to the file, which vtkio does not
/// support.
fn add_component_names(mut xml: String) -> String {
    for names in [
        &["X", "Y", "Z"][..],
        &["XX", "YY", "ZZ", "XY", "YZ", "XZ"][..],
    ] {
        let unnamed = format!("NumberOfComponents=\"{}\"", names.len());
        let named = names
            .iter()
            .enumerate()
            .fold(unnamed.clone(), |text, (i, name)| {
                text + &format!(" ComponentName{i}=\"{name}\"")
            });
        xml = xml.replace(&unnamed, &named);
    }
    xml
}

/// Checks that `found == expected`.
pub(crate) fn check_length(
    path: &Path,
    field: &str,
    found: usize,
    expected: usize,
    needed_for: &'static str,
) -> Result<(), ExportError> {
    if found == expected {
        return Ok(());
    }
    let (path, field) = (path.to_path_buf(), field.to_owned());
    Err(ExportError::FieldLength {
        path,
        field,
        found,
        expected,
        needed_for,
    })
}

/// VTK's cell type for an element of `nodes` nodes.
fn vtk_cell(nodes: usize) -> CellType {
    match nodes {
        4 => CellType::Tetra,
        10 => CellType::QuadraticTetra,
        5 => CellType::Pyramid,
        13 => CellType::QuadraticPyramid,
        6 => CellType::Wedge,
        15 => CellType::QuadraticWedge,
        8 => CellType::Hexahedron,
        _ => CellType::QuadraticHexahedron,
    }
}

/// Kind of a facet with this number of nodes.
fn vtk_facet(nodes: usize) -> CellType {
    match nodes {
        3 => CellType::Triangle,
        6 => CellType::QuadraticTriangle,
        4 => CellType::Quad,
        _ => CellType::QuadraticQuad,
    }
}

fn array<T>(name: &str, components: u32, values: Vec<T>) -> Attribute
where
    IOBuffer: From<Vec<T>>,
{
    Attribute::generic(name, components).with_data(values)
}

/// Name and entry (node, element) of the first value that is not finite.
fn first_not_finite(name: &str, components: usize, values: &[f64]) -> Option<(String, usize)> {
    let at = values.iter().position(|v| !v.is_finite())?;
    Some((name.to_owned(), at / components))
}
