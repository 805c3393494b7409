//! Reduced models from matrices: numbers of Python become a [`Structure`], which the library
//! reduces.

use std::collections::HashMap;

use faer::Mat;
use nalgebra_sparse::{CooMatrix, CscMatrix};
use numpy::Complex64;
use pyo3::exceptions::{PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Given, complexes, has_shape, reals};
use crate::errors::{library_error, value};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::model::{
    Asymmetry, asymmetry, empty_rows, find_indefinite_entry, negative_eigenvalues,
};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ObservedQuantity};
use dovetail_solver::reduction::{StuckModes, reduce};
use dovetail_solver::structure::{BodyMatrices, InterfaceNode, Joint, ObservedWork, Structure};

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Degrees of freedom of a node along n, t1 and t2; `None` along a direction that the matrices do
/// not have.
type Node = [Option<usize>; 3];

/// Contact pair of matrices: a node, and what it faces.
///
/// `dofs` are the degrees of freedom of the node along the normal n, t1 and t2: numbers of rows of
/// the matrices, or `None` along a direction that the model does not have, as in a plane or on a
/// line. The node opens along +n. `against` are those of the node that it faces, by default rigid
/// ground. Where the three run along the axes of space, `frame` has the directions n, t1, t2 as
/// rows.
///
/// `preload_n` is a pair of forces on the node and on its counterpart, which presses them together: a
/// part of the steady load, and not the normal force at rest. `gap_m` is the clearance of the pair
/// without any load, below zero for an interference. Both add up: the preload first closes the
/// clearance against the stiffness of the model, and the rest of it presses; an interference
/// presses in addition to it. On a node that nothing else holds the preload is the normal force
/// whatever the clearance. On a stiff one it is less: with stiffness k at the closed pair and no
/// other load the normal force is `preload_n - k gap_m`, and 0 where that is negative.
/// With `normal_stiffness_n_m` and `tangential_stiffness_n_m` the contact is elastic (a Jenkins
/// element), else rigid.
#[pyclass(frozen, skip_from_py_object, name = "Pair", module = "dovetail")]
#[derive(Clone)]
pub struct PyPair {
    dofs: Node,
    against: Option<Node>,
    frame: [[f64; 3]; 3],
    law: PairLaw,
    preload_n: f64,
}

/// Law of a pair from the numbers of a user.
pub fn law_of(
    friction: f64,
    gap_m: f64,
    normal_stiffness_n_m: Option<f64>,
    tangential_stiffness_n_m: Option<f64>,
) -> PyResult<PairLaw> {
    if !(friction.is_finite() && friction >= 0.0) {
        return Err(value(format!(
            "friction is {friction}; it must be at least 0"
        )));
    }
    if !gap_m.is_finite() {
        return Err(value(format!("gap_m is {gap_m}; it must be finite")));
    }
    let stiffness = match (normal_stiffness_n_m, tangential_stiffness_n_m) {
        (None, None) => None,
        (Some(normal), Some(tangential)) => {
            for (name, stiffness) in [
                ("normal_stiffness_n_m", normal),
                ("tangential_stiffness_n_m", tangential),
            ] {
                if !(stiffness.is_finite() && stiffness > 0.0) {
                    return Err(value(format!("{name} is {stiffness}; it must be above 0")));
                }
            }
            Some(PairStiffness::new(normal, tangential))
        }
        _ => {
            return Err(value(
                "normal_stiffness_n_m and tangential_stiffness_n_m belong together: give both, or neither for rigid contact",
            ));
        }
    };
    Ok(PairLaw {
        stiffness,
        ..PairLaw::rigid(friction, gap_m)
    })
}

#[pymethods]
impl PyPair {
    #[new]
    #[pyo3(signature = (
        dofs, *, friction, against=None, frame=None, gap_m=0.0, normal_stiffness_n_m=None,
        tangential_stiffness_n_m=None, preload_n=0.0
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn new(
        dofs: Node,
        friction: f64,
        against: Option<Node>,
        frame: Option<Bound<'_, PyAny>>,
        gap_m: f64,
        normal_stiffness_n_m: Option<f64>,
        tangential_stiffness_n_m: Option<f64>,
        preload_n: f64,
    ) -> PyResult<Self> {
        let law = law_of(
            friction,
            gap_m,
            normal_stiffness_n_m,
            tangential_stiffness_n_m,
        )?;
        if !preload_n.is_finite() {
            return Err(value(format!(
                "preload_n is {preload_n}; it must be finite"
            )));
        }
        if dofs.iter().all(Option::is_none) {
            return Err(value("dofs names no degree of freedom: give at least one"));
        }
        let frame = frame.map(|given| frame_of(&given)).transpose()?;
        if frame.is_some()
            && dofs
                .iter()
                .chain(against.iter().flatten())
                .any(Option::is_none)
        {
            return Err(value(
                "a frame turns three displacements: give three degrees of freedom, or leave the frame out",
            ));
        }
        Ok(Self {
            dofs,
            against,
            frame: frame.unwrap_or(IDENTITY),
            law,
            preload_n,
        })
    }

    fn __repr__(&self) -> String {
        let word = |dof: &Option<usize>| dof.map_or("None".to_owned(), |dof| dof.to_string());
        let dofs: Vec<String> = self.dofs.iter().map(word).collect();
        format!(
            "<dovetail.Pair of degrees of freedom ({}), friction {}>",
            dofs.join(", "),
            self.law.friction
        )
    }
}

/// Orthonormal directions n, t1, t2.
fn frame_of(given: &Bound<'_, PyAny>) -> PyResult<[[f64; 3]; 3]> {
    let Given { shape, values } = reals("frame", given)?;
    has_shape("frame", &shape, &[3, 3])?;
    let row = |i: usize| [0, 1, 2].map(|j| values[3 * i + j]);
    let frame = [0, 1, 2].map(row);
    for i in 0..3 {
        for j in 0..3 {
            let product: f64 = (0..3).map(|k| frame[i][k] * frame[j][k]).sum();
            let expected = if i == j { 1.0 } else { 0.0 };
            if (product - expected).abs() > 1e-6 {
                return Err(value(
                    "the rows of frame have to be of length 1 and at right angles: n, t1 and t2",
                ));
            }
        }
    }
    Ok(frame)
}

/// Entries of a sparse or dense matrix, by row and column.
struct GivenEntries {
    size: usize,
    entries: Vec<(usize, usize, f64)>,
}

impl GivenEntries {
    fn read(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Self> {
        if given.hasattr("tocoo")? {
            return Self::read_sparse(name, given);
        }
        let Given { shape, values } = reals(name, given)?;
        let size = square(name, &shape)?;
        let entry = |(at, v): (usize, &f64)| (*v != 0.0).then(|| (at / size, at % size, *v));
        Ok(Self {
            size,
            entries: values.iter().enumerate().filter_map(entry).collect(),
        })
    }

    fn read_sparse(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let coo = given.call_method0("tocoo")?;
        let shape: Vec<usize> = coo.getattr("shape")?.extract()?;
        let size = square(name, &shape)?;
        let data = reals(name, &coo.getattr("data")?)?.values;
        let places = |what: &str| -> PyResult<Vec<usize>> {
            let indices = reals(name, &coo.getattr(what)?)?.values;
            has_shape(&format!("{name}.{what}"), &[indices.len()], &[data.len()])?;
            let outside = |v: &&f64| !(0.0..size as f64).contains(*v) || v.fract() != 0.0;
            match indices.iter().find(outside) {
                Some(v) => Err(value(format!(
                    "{name} has an entry with {what} {v}, and its {what}s are 0 to {}",
                    size - 1
                ))),
                None => Ok(indices.iter().map(|v| *v as usize).collect()),
            }
        };
        let (rows, columns) = (places("row")?, places("col")?);
        let entries = rows.into_iter().zip(columns).zip(data);
        Ok(Self {
            size,
            entries: entries.map(|((i, j), v)| (i, j, v)).collect(),
        })
    }

    /// Sparse matrix, which is symmetric and has no entry that makes it indefinite by itself.
    fn checked(&self, name: &str) -> PyResult<CscMatrix<f64>> {
        let mut matrix = CooMatrix::new(self.size, self.size);
        self.entries
            .iter()
            .for_each(|&(i, j, v)| matrix.push(i, j, v));
        let matrix = CscMatrix::from(&matrix);
        if let Some(Asymmetry {
            row,
            column,
            by,
            largest,
        }) = asymmetry(&matrix)
        {
            return Err(value(format!(
                "{name} is not symmetric: entries ({row}, {column}) and ({column}, {row}) differ by {by:e}, and the largest entry \
                 is {largest:e}; dampers and gyroscopic terms do not belong in it"
            )));
        }
        let negative = matrix.triplet_iter().find(|(i, j, v)| i == j && **v < 0.0);
        if let Some((row, _, v)) = negative {
            return Err(value(format!(
                "{name} is indefinite: entry {row} of its diagonal is {v:e}"
            )));
        }
        match find_indefinite_entry(&matrix) {
            None => Ok(matrix),
            Some(found) => Err(value(format!(
                "{name} is indefinite: entry ({}, {}) is {:e}, and the diagonal in its row and column allows no more than {:e}",
                found.row,
                found.column,
                found.value,
                found.most()
            ))),
        }
    }
}

/// Checks that a matrix is square and symmetric. A mass is also not indefinite; the stiffness of a
/// rotating body may be.
pub fn symmetric(name: &str, given: &Bound<'_, PyAny>, is_mass: bool) -> PyResult<()> {
    let matrix = GivenEntries::read(name, given)?.checked(name)?;
    if is_mass {
        check_not_indefinite(name, &matrix)
    } else {
        Ok(())
    }
}

fn check_not_indefinite(name: &str, matrix: &CscMatrix<f64>) -> PyResult<()> {
    match negative_eigenvalues(matrix) {
        0 => Ok(()),
        count => Err(value(format!(
            "{name} is indefinite: {count} of its {} eigenvalues are negative, and a motion would have a negative energy",
            matrix.ncols()
        ))),
    }
}

fn square(name: &str, shape: &[usize]) -> PyResult<usize> {
    match *shape {
        [rows, columns] if rows == columns && rows > 0 => Ok(rows),
        _ => {
            let sizes: Vec<String> = shape.iter().map(ToString::to_string).collect();
            Err(value(format!(
                "{name} has to be a square matrix, and has the shape ({})",
                sizes.join(", ")
            )))
        }
    }
}

/// Vector on the degrees of freedom: the number of one, for 1 there, or a value for each.
pub fn dof_vector(name: &str, given: &Bound<'_, PyAny>, size: usize) -> PyResult<Vec<f64>> {
    if let Ok(dof) = given.extract() {
        let dof = dof_of(name, dof, size)?;
        let mut vector = vec![0.0; size];
        vector[dof] = 1.0;
        return Ok(vector);
    }
    crate::arrays::real_vector(name, given, size)
}

fn dof_of(name: &str, dof: usize, size: usize) -> PyResult<usize> {
    if dof < size {
        return Ok(dof);
    }
    Err(value(format!(
        "{name} names degree of freedom {dof}, and the matrices have {size}, counted from 0"
    )))
}

/// Amplitudes of the harmonics of an excitation, N: an array for harmonic 1, or arrays by harmonic.
/// The force is the real part of `amplitude exp(i k w t)`.
pub fn harmonics_of(
    given: &Bound<'_, PyAny>,
    size: usize,
) -> PyResult<Vec<(usize, Vec<Complex64>)>> {
    let of = |name: &str, given: &Bound<'_, PyAny>| {
        let Given { shape, values } = complexes(name, given)?;
        has_shape(name, &shape, &[size])?;
        Ok::<_, PyErr>(values)
    };
    let Ok(dict) = given.cast::<PyDict>() else {
        return Ok(vec![(1, of("excitation", given)?)]);
    };
    let mut harmonics = Vec::new();
    for (harmonic, amplitude) in dict {
        let harmonic: usize = harmonic.extract().map_err(|_| {
            PyTypeError::new_err("the keys of excitation are numbers of harmonics, from 1")
        })?;
        if harmonic == 0 {
            return Err(value(
                "harmonic 0 of the excitation is the steady load: give it as static_load",
            ));
        }
        harmonics.push((
            harmonic,
            of(&format!("excitation[{harmonic}]"), &amplitude)?,
        ));
    }
    harmonics.sort_by_key(|(harmonic, _)| *harmonic);
    Ok(harmonics)
}

/// Matrices in the order of the library: interior degrees of freedom first, then the nodes of the
/// contacts, with one more degree of freedom along each direction that a node lacks.
struct Ordered {
    /// Place of each row of the user; `None` for rows that do not move.
    place: Vec<Option<usize>>,
    /// Nodes of the interface, and which of them are slaves.
    nodes: Vec<(Node, bool)>,
    /// Number of each of these nodes.
    numbers: HashMap<Node, usize>,
    interior_nodes: usize,
    dofs: usize,
}

impl Ordered {
    /// Order of the rows of which `is_still` says that they do not move. Rows of pairs keep their
    /// place.
    fn new(pairs: &[PyPair], is_still: &[bool]) -> PyResult<Self> {
        let size = is_still.len();
        let mut nodes: Vec<(Node, bool)> = Vec::new();
        let mut numbers: HashMap<Node, usize> = HashMap::new();
        let mut owner: HashMap<usize, usize> = HashMap::new();
        let sides = pairs.iter().enumerate().flat_map(|(p, pair)| {
            let master = pair.against.map(|against| (p, against, false));
            std::iter::once((p, pair.dofs, true)).chain(master)
        });
        for (p, dofs, is_slave) in sides {
            if let Some(known) = numbers.get(&dofs) {
                let slave = &mut nodes[*known].1;
                if *slave && is_slave {
                    return Err(value(format!(
                        "pair {p} has the same node as a pair before it: a node follows one contact; exchange dofs and against"
                    )));
                }
                *slave |= is_slave;
                continue;
            }
            for dof in dofs.iter().flatten() {
                dof_of(&format!("pair {p}"), *dof, size)?;
                if owner.insert(*dof, nodes.len()).is_some() {
                    return Err(value(format!(
                        "degree of freedom {dof} belongs to two nodes of pairs (pair {p}): each node has its own, in the order n, t1, t2"
                    )));
                }
            }
            numbers.insert(dofs, nodes.len());
            nodes.push((dofs, is_slave));
        }
        let inner = (0..size).filter(|dof| !is_still[*dof] && !owner.contains_key(dof));
        let mut place = vec![None; size];
        let mut inside = 0usize;
        for dof in inner {
            place[dof] = Some(inside);
            inside += 1;
        }
        let interior_nodes = inside.div_ceil(3);
        for (node, (dofs, _)) in nodes.iter().enumerate() {
            for (axis, dof) in dofs.iter().enumerate() {
                if let Some(dof) = dof {
                    place[*dof] = Some(3 * (interior_nodes + node) + axis);
                }
            }
        }
        Ok(Self {
            dofs: 3 * (interior_nodes + nodes.len()),
            place,
            nodes,
            numbers,
            interior_nodes,
        })
    }

    fn vector(&self, of_user: &[f64]) -> Vec<f64> {
        let mut vector = vec![0.0; self.dofs];
        for (place, v) in self.place.iter().zip(of_user) {
            if let Some(place) = place {
                vector[*place] = *v;
            }
        }
        vector
    }

    /// Matrix with only the diagonal in held rows, whose entry is `held`, and these further entries
    /// of the diagonal.
    fn matrix(
        &self,
        entries: &GivenEntries,
        is_held: &[bool],
        held: f64,
        more: &[(usize, f64)],
    ) -> CscMatrix<f64> {
        let mut matrix = CooMatrix::new(self.dofs, self.dofs);
        for &(i, j, v) in &entries.entries {
            let (Some(i), Some(j)) = (self.place[i], self.place[j]) else {
                continue;
            };
            if !is_held[i] && !is_held[j] {
                // The mean of both sides, which differ by rounding at most.
                matrix.push(i, j, 0.5 * v);
                matrix.push(j, i, 0.5 * v);
            }
        }
        for (at, is_held) in is_held.iter().enumerate() {
            if *is_held && held != 0.0 {
                matrix.push(at, at, held);
            }
        }
        for (at, v) in more {
            matrix.push(*at, *at, *v);
        }
        CscMatrix::from(&matrix)
    }

    fn node_of(&self, dofs: Node) -> InterfaceNode {
        let known = self.numbers.get(&dofs).copied().unwrap_or_default();
        InterfaceNode {
            body: 0,
            node: self.interior_nodes + known,
        }
    }
}

fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = std::ffi::CString::new(text).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

/// Problem of matrices, reduced on its pairs and the modes that `wanted` names.
pub fn problem_of(
    py: Python<'_>,
    (stiffness, mass): (&Bound<'_, PyAny>, &Bound<'_, PyAny>),
    pairs: &[PyPair],
    fixed: &[usize],
    loads: impl FnOnce(usize) -> PyResult<Loads>,
    wanted: StuckModes,
) -> PyResult<Problem> {
    let k = GivenEntries::read("stiffness", stiffness)?;
    let m = GivenEntries::read("mass", mass)?;
    if k.size != m.size {
        return Err(value(format!(
            "stiffness has {} rows and mass {}: they belong to the same degrees of freedom",
            k.size, m.size
        )));
    }
    let (of_k, of_m) = (k.checked("stiffness")?, m.checked("mass")?);
    check_not_indefinite("mass", &of_m)?;
    let negative = negative_eigenvalues(&of_k);
    if negative > 0 {
        warn(
            py,
            &format!(
                "stiffness is indefinite, with {negative} negative eigenvalues: where the pairs are open the model is unstable at rest"
            ),
        )?;
    }
    if pairs.is_empty() {
        return Err(value("pairs is empty: give at least one dovetail.Pair"));
    }
    let size = k.size;
    let loads = loads(size)?;
    let mut is_still = empty_rows(&of_k, &of_m);
    drop((of_k, of_m));
    let empty = is_still.iter().filter(|is_empty| **is_empty).count();
    if let Some((what, dof)) = loads.find_on_rows(&is_still) {
        return Err(value(format!(
            "{what} is on degree of freedom {dof}, which has neither stiffness nor mass: it does not move"
        )));
    }
    if empty > 0 {
        let text = format!("{empty} rows have neither stiffness nor mass and are left out");
        warn(py, &text)?;
    }
    for dof in fixed {
        is_still[dof_of("fixed", *dof, size)?] = true;
    }
    let ordered = Ordered::new(pairs, &is_still)?;
    let structure = structure_of(&ordered, (&k, &m), pairs, fixed, &loads);
    let reduction = crate::balance::quietly(py, || reduce(structure, wanted))?;
    let mut reduced = reduction.map_err(|error| library_error(py, error))?.model;
    give_stiffness(&mut reduced.stiffness, pairs);
    // One unit load for each part of an excitation that is not zero.
    let mut units = std::mem::take(&mut reduced.unit_loads).into_iter();
    let zero = || Load::zeros(reduced.stiffness.nrows(), reduced.omega2.len());
    let mut part = |is_given: bool| match is_given {
        true => units.next().unwrap_or_else(zero),
        false => zero(),
    };
    let excitations = loads.parts().map(|(harmonic, [cosine, sine])| {
        let [cosine, sine] = [cosine.is_some(), sine.is_some()].map(&mut part);
        HarmonicLoad {
            sine,
            ..HarmonicLoad::cosine(harmonic, cosine)
        }
    });
    let excitations = excitations.collect();
    Ok(Problem {
        laws: pairs.iter().map(|pair| pair.law).collect(),
        excitations,
        reduced: reduced.into(),
        modal_ratios: Vec::new(),
    })
}

/// Stiffness along a normal that the matrices lack, relative to the pair's own. It is small beside
/// the springs of a pair, which then carry the preload.
const SOFT: f64 = 1e-6;

/// Gives the directions that the matrices lack, which nothing couples, the stiffness of those that
/// they have: eps follows both tangents of a pair.
fn give_stiffness(stiffness: &mut Mat<f64>, pairs: &[PyPair]) {
    for (p, pair) in pairs.iter().enumerate() {
        let at = |axis: usize| 3 * p + axis;
        let known = (0..3).filter(|axis| pair.dofs[*axis].is_some());
        let own = known
            .map(|axis| stiffness[(at(axis), at(axis))])
            .fold(0.0, f64::max);
        for axis in (0..3).filter(|axis| pair.dofs[*axis].is_none()) {
            stiffness[(at(axis), at(axis))] = if axis == 0 { SOFT * own } else { own };
        }
    }
}

/// Loads on the rows of the matrices.
pub struct Loads {
    pub excitation: Vec<(usize, Vec<Complex64>)>,
    pub observed: Vec<(String, Vec<f64>)>,
    pub static_load: Option<Vec<f64>>,
}

impl Loads {
    /// First load or observation that acts on one of some rows, and the row.
    fn find_on_rows(&self, rows: &[bool]) -> Option<(String, usize)> {
        let on = |vector: &mut dyn Iterator<Item = bool>| {
            let mut both = vector.zip(rows);
            both.position(|(acts, is_one)| acts && *is_one)
        };
        let on_values = |vector: &[f64]| on(&mut vector.iter().map(|v| *v != 0.0));
        let of_load = self.static_load.as_deref().and_then(on_values);
        let found_load = of_load.map(|dof| ("static_load".to_owned(), dof));
        let excited = self.excitation.iter().find_map(|(_, amplitude)| {
            let dof = on(&mut amplitude.iter().map(|v| v.norm_sqr() > 0.0))?;
            Some(("excitation".to_owned(), dof))
        });
        let observed = || {
            let mut observed = self.observed.iter();
            observed.find_map(|(name, weights)| {
                Some((format!("observe[\"{name}\"]"), on_values(weights)?))
            })
        };
        found_load.or(excited).or_else(observed)
    }

    /// Parts of each harmonic that are not zero: cosine and sine.
    fn parts(&self) -> impl Iterator<Item = (usize, [Option<Vec<f64>>; 2])> + '_ {
        let some = |part: Vec<f64>| part.iter().any(|v| *v != 0.0).then_some(part);
        self.excitation.iter().map(move |(harmonic, amplitude)| {
            let cosine = amplitude.iter().map(|v| v.re).collect();
            let sine = amplitude.iter().map(|v| -v.im).collect();
            (*harmonic, [some(cosine), some(sine)])
        })
    }
}

fn structure_of(
    ordered: &Ordered,
    (k, m): (&GivenEntries, &GivenEntries),
    pairs: &[PyPair],
    fixed: &[usize],
    loads: &Loads,
) -> Structure {
    let mut is_held = vec![true; ordered.dofs];
    for place in ordered.place.iter().flatten() {
        is_held[*place] = false;
    }
    for dof in fixed {
        if let Some(place) = ordered.place[*dof] {
            is_held[place] = true;
        }
    }
    // A direction that a slave lacks has no mass, and a stiffness that it is given in the end.
    let mut diagonal = vec![0.0; ordered.dofs];
    for &(i, j, v) in &k.entries {
        if let (Some(place), true) = (ordered.place[i], i == j) {
            diagonal[place] += v;
        }
    }
    let mut lacking = Vec::new();
    for (node, (dofs, is_slave)) in ordered.nodes.iter().enumerate() {
        let first = 3 * (ordered.interior_nodes + node);
        let largest = (0..3)
            .map(|axis| diagonal[first + axis])
            .fold(0.0, f64::max);
        for (axis, dof) in dofs.iter().enumerate() {
            if dof.is_none() && *is_slave {
                is_held[first + axis] = false;
                lacking.push((first + axis, if largest > 0.0 { largest } else { 1.0 }));
            }
        }
    }
    let mut load_n = match &loads.static_load {
        Some(load) => ordered.vector(load),
        None => vec![0.0; ordered.dofs],
    };
    let mut joints = Vec::new();
    for pair in pairs {
        let slave = ordered.node_of(pair.dofs);
        let master = pair.against.map(|against| ordered.node_of(against));
        let pressed = [(Some(slave), -pair.preload_n), (master, pair.preload_n)];
        for (node, force) in pressed {
            let Some(node) = node else { continue };
            for (axis, n) in pair.frame[0].iter().enumerate() {
                load_n[3 * node.node + axis] += force * n;
            }
        }
        let turned = [0, 1, 2].map(|row| [0, 1, 2].map(|column| pair.frame[column][row]));
        joints.push(Joint {
            slave,
            masters: master.map(|master| (master, 1.0)).into_iter().collect(),
            turned: Some(turned),
            across: None,
        });
    }
    for (at, is_held) in is_held.iter().enumerate() {
        if *is_held {
            load_n[at] = 0.0;
        }
    }
    let on_body = |vector: &[f64]| {
        let mut vector = ordered.vector(vector);
        for (at, is_held) in is_held.iter().enumerate() {
            if *is_held {
                vector[at] = 0.0;
            }
        }
        vec![vector]
    };
    let mut tags = vec![0; ordered.dofs / 3];
    for (dof, place) in ordered.place.iter().enumerate().rev() {
        if let Some(place) = place {
            tags[place / 3] = dof as u64;
        }
    }
    let held = is_held.iter().enumerate().filter(|(_, held)| **held);
    Structure {
        bodies: vec![BodyMatrices {
            name: "matrices".to_owned(),
            stiffness: ordered.matrix(k, &is_held, 1.0, &lacking),
            mass: ordered.matrix(m, &is_held, 0.0, &[]),
            load_n,
            centrifugal_n_s2: Vec::new(),
            interior_nodes: ordered.interior_nodes,
            held_dofs: held.filter_map(|(at, _)| u32::try_from(at).ok()).collect(),
            fixed_interface_modes: None,
            node_tags: tags,
        }],
        joints,
        steady_parts: Vec::new(),
        excitations: loads
            .parts()
            .flat_map(|(_, parts)| parts.into_iter().flatten())
            .map(|vector| on_body(&vector))
            .collect(),
        observations: loads
            .observed
            .iter()
            .map(|(name, vector)| ObservedWork {
                name: name.clone(),
                quantity: ObservedQuantity::Displacement,
                load: on_body(vector),
            })
            .collect(),
        dashpots: Vec::new(),
        influenced: Vec::new(),
    }
}
