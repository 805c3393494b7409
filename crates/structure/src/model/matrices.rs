//! Bodies whose stiffness and mass come from another program, and the places of their rows.

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra_sparse::{CooMatrix, CscMatrix};
use serde::Serialize;
use serde::ser::{SerializeTuple, Serializer};

use super::ModelError;
use crate::model::{Assembly, BodyMesh, BodySpec};
use dovetail_mesh::Row;
use dovetail_mesh::parts::Placement;
use dovetail_mesh::units::Units;
use dovetail_numerics::space::cross;
use dovetail_numerics::sparse::{self, Symbolic};

/// Largest difference of two entries of a symmetric matrix, relative to the largest entry.
const ASYMMETRY: f64 = 1e-9;

/// Stiffness and mass of a body from another program, in SI units and in the axes of its mesh file.
#[derive(Debug, PartialEq)]
pub struct GivenMatrices {
    stiffness: CscMatrix<f64>,
    mass: CscMatrix<f64>,
    rows: Vec<Row>,
    load_n: Option<Vec<f64>>,
    /// True for rows with neither stiffness nor mass.
    is_empty: Vec<bool>,
    negative_stiffness: usize,
}

/// Error of matrices that are not those of a body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum MatricesError {
    #[error("the {what} matrix is {rows} x {columns}: it has to be square")]
    NotSquare {
        what: &'static str,
        rows: usize,
        columns: usize,
    },
    #[error(
        "the stiffness has {stiffness} rows, the mass {mass}, and the table of rows {table}: they belong to the same degrees of freedom"
    )]
    Sizes {
        stiffness: usize,
        mass: usize,
        table: usize,
    },
    #[error(
        "the {what} matrix is not symmetric: entries ({row}, {column}) and ({column}, {row}), counted from 1, differ by {by:.3e}, and the largest entry is {largest:.3e}; dampers and gyroscopic terms do not belong in it"
    )]
    NotSymmetric {
        what: &'static str,
        row: usize,
        column: usize,
        by: f64,
        largest: f64,
    },
    #[error("entry ({row}, {column}) of the {what} matrix, counted from 1, is not a finite number")]
    NotFinite {
        what: &'static str,
        row: usize,
        column: usize,
    },
    #[error(
        "entry {row} of the diagonal of the {what} matrix, counted from 1, is {value:.3e}: no body has a negative one; check that the two matrices are not exchanged, and their signs"
    )]
    Negative {
        what: &'static str,
        row: usize,
        value: f64,
    },
    #[error(
        "the {what} matrix is indefinite: entry ({row}, {column}), counted from 1, is {value:.3e}, and the entries {first:.3e} and {second:.3e} of the diagonal in its row and column allow no more than {most:.3e}; a motion of these two rows would have a negative energy"
    )]
    TooFarOff {
        what: &'static str,
        row: usize,
        column: usize,
        value: f64,
        first: f64,
        second: f64,
        most: f64,
    },
    #[error(
        "the mass matrix is indefinite: {negative} of its {rows} eigenvalues are negative, and a motion would have a negative kinetic energy; write it again from the model"
    )]
    IndefiniteMass { negative: usize, rows: usize },
    #[error(
        "the steady load has {values} values, and the matrices have {rows} rows: it has one for each"
    )]
    LoadSize { values: usize, rows: usize },
    #[error("value {row} of the steady load, counted from 1, is not a finite number")]
    LoadNotFinite { row: usize },
    #[error(
        "rows {first} and {second} of the table, counted from 1, are both direction {direction} of node {node}"
    )]
    RowTwice {
        first: usize,
        second: usize,
        node: u64,
        direction: u8,
    },
}

impl GivenMatrices {
    /// Matrices in these units on these rows. Entries that differ from their mirror by rounding are
    /// replaced by the mean of both.
    ///
    /// # Errors
    /// Matrices that are not square, of different sizes, not symmetric (1e-9 of the largest entry)
    /// or not finite, with negative diagonals; an indefinite mass; a row that is named twice.
    ///
    /// # Panics
    /// Where `units` give no unit of force: a length alone does not.
    pub fn new(
        stiffness: CscMatrix<f64>,
        mass: CscMatrix<f64>,
        rows: Vec<Row>,
        units: Units,
    ) -> Result<Self, MatricesError> {
        let [stress_pa, density_kg_m3] = units
            .stress_pa_and_density_kg_m3()
            .expect("a system of units has a unit of force");
        let length_m = units.metres();
        let stiffness = symmetric("stiffness", stiffness, stress_pa * length_m)?;
        let mass = symmetric("mass", mass, density_kg_m3 * length_m.powi(3))?;
        let sizes = [stiffness.nrows(), mass.nrows(), rows.len()];
        if sizes.iter().any(|size| *size != sizes[0]) {
            let [stiffness, mass, table] = sizes;
            return Err(MatricesError::Sizes {
                stiffness,
                mass,
                table,
            });
        }
        let mut known = HashMap::new();
        for (at, row) in rows.iter().enumerate() {
            let Row::Node { node, direction } = *row else {
                continue;
            };
            if let Some(first) = known.insert((node, direction), at) {
                return Err(MatricesError::RowTwice {
                    first: first + 1,
                    second: at + 1,
                    node,
                    direction,
                });
            }
        }
        let negative = negative_eigenvalues(&mass);
        if negative > 0 {
            let rows = rows.len();
            return Err(MatricesError::IndefiniteMass { negative, rows });
        }
        Ok(Self {
            is_empty: empty_rows(&stiffness, &mass),
            negative_stiffness: negative_eigenvalues(&stiffness),
            stiffness,
            mass,
            rows,
            load_n: None,
        })
    }

    /// The same matrices with a steady load on their rows, N; in both systems of units a force is
    /// in newtons.
    ///
    /// # Errors
    /// A load of another size, and one that is not finite.
    pub fn with_load(mut self, load_n: Vec<f64>) -> Result<Self, MatricesError> {
        if load_n.len() != self.rows.len() {
            return Err(MatricesError::LoadSize {
                values: load_n.len(),
                rows: self.rows.len(),
            });
        }
        if let Some(at) = load_n.iter().position(|f| !f.is_finite()) {
            return Err(MatricesError::LoadNotFinite { row: at + 1 });
        }
        self.load_n = Some(load_n);
        Ok(self)
    }

    /// Stiffness, N/m, n x n.
    pub fn stiffness(&self) -> &CscMatrix<f64> {
        &self.stiffness
    }

    /// Mass, kg, n x n.
    pub fn mass(&self) -> &CscMatrix<f64> {
        &self.mass
    }

    /// Rows of both matrices, n.
    pub(crate) fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Number of negative eigenvalues of the stiffness, beyond rounding: without its joints the body
    /// is unstable.
    pub fn negative_stiffness(&self) -> usize {
        self.negative_stiffness
    }

    /// Steady load on the rows, N, if there is one.
    pub(crate) fn load_n(&self) -> Option<&[f64]> {
        self.load_n.as_deref()
    }
}

/// Rows that have entries in neither of two symmetric matrices.
pub fn empty_rows(stiffness: &CscMatrix<f64>, mass: &CscMatrix<f64>) -> Vec<bool> {
    let mut is_empty = vec![true; stiffness.ncols()];
    for (_, j, _) in [stiffness, mass]
        .into_iter()
        .flat_map(|matrix| matrix.triplet_iter())
        .filter(|(.., v)| **v != 0.0)
    {
        is_empty[j] = false;
    }
    is_empty
}

/// Smallest share of the diagonal that a negative eigenvalue exceeds: below it may be the rounding
/// of a free body, or the softening of one that rotates.
const NEGATIVE: f64 = 1e-5;

/// Number of negative eigenvalues of a symmetric matrix whose rows are scaled to a diagonal of 1.
/// Those above -1e-5 do not count. A matrix that cannot be factored has none that are known.
pub fn negative_eigenvalues(matrix: &CscMatrix<f64>) -> usize {
    // A row with its diagonal only is an eigenvalue by itself.
    let entries = || matrix.triplet_iter().filter(|(.., v)| **v != 0.0);
    let mut place = vec![None; matrix.ncols()];
    let mut coupled = 0;
    for (_, j, _) in entries().filter(|(i, j, _)| i != j) {
        place[j].get_or_insert_with(|| {
            coupled += 1;
            coupled - 1
        });
    }
    let mut own_entries = CooMatrix::new(coupled, coupled);
    let mut scales = CscMatrix::identity(coupled);
    let mut negative = 0;
    for (i, j, v) in entries() {
        match (place[i], place[j]) {
            (Some(i), Some(j)) => {
                own_entries.push(i, j, *v);
                if i == j && *v > 0.0 {
                    scales.values_mut()[i] = *v;
                }
            }
            _ => negative += usize::from(*v < 0.0),
        }
    }
    let matrix = CscMatrix::from(&own_entries);
    let counted = Symbolic::analyse(&matrix)
        .and_then(|symbolic| sparse::negative_eigenvalues(&matrix, -NEGATIVE, &scales, &symbolic));
    negative + counted.unwrap_or(0)
}

/// Entry of a matrix that is too large for the diagonal of its row and column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TooFarOff {
    /// Row, from 0.
    pub row: usize,
    /// Column, from 0.
    pub column: usize,
    /// Value of the entry.
    pub value: f64,
    /// Entries of the diagonal in the row and in the column.
    pub diagonal: [f64; 2],
}

/// First entry of a symmetric matrix that makes it indefinite by itself: its square exceeds the
/// product of the entries of the diagonal in its row and column by more than rounding.
pub fn find_indefinite_entry(matrix: &CscMatrix<f64>) -> Option<TooFarOff> {
    let mut diagonal = vec![0.0; matrix.ncols()];
    for (i, _, v) in matrix.triplet_iter().filter(|(i, j, _)| i == j) {
        diagonal[i] = *v;
    }
    let entries = matrix.triplet_iter().filter(|(i, j, _)| i != j);
    let mut entries = entries.map(|(row, column, v)| TooFarOff {
        row,
        column,
        value: *v,
        diagonal: [diagonal[row], diagonal[column]],
    });
    entries.find(|found| found.value.abs() > (1.0 + NEGATIVE) * found.most())
}

impl TooFarOff {
    /// Largest entry at this place of a matrix that is not indefinite.
    pub fn most(&self) -> f64 {
        let [first, second] = self.diagonal;
        first.max(0.0).sqrt() * second.max(0.0).sqrt()
    }
}

/// Two entries of a matrix that differ by more than rounding and ought to be alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asymmetry {
    /// Row of the entry above the diagonal, from 0.
    pub row: usize,
    /// Its column, from 0.
    pub column: usize,
    /// Difference from the entry below the diagonal.
    pub by: f64,
    /// Largest entry of the matrix.
    pub largest: f64,
}

/// Entries of a square matrix that differ most from their mirrors; `None` where they do by rounding
/// at most, 1e-9 of the largest entry.
pub fn asymmetry(matrix: &CscMatrix<f64>) -> Option<Asymmetry> {
    let largest = matrix
        .values()
        .iter()
        .fold(0.0, |most: f64, v| most.max(v.abs()));
    let difference = matrix - &matrix.transpose();
    let above = difference.triplet_iter().filter(|(i, j, _)| i < j);
    let worst = above.max_by(|a, b| {
        a.2.abs()
            .total_cmp(&b.2.abs())
            .then((b.0, b.1).cmp(&(a.0, a.1)))
    })?;
    let (row, column, by) = (worst.0, worst.1, worst.2.abs());
    (by > ASYMMETRY * largest).then_some(Asymmetry {
        row,
        column,
        by,
        largest,
    })
}

/// Symmetric matrix times a factor.
fn symmetric(
    what: &'static str,
    mut matrix: CscMatrix<f64>,
    factor: f64,
) -> Result<CscMatrix<f64>, MatricesError> {
    let (rows, columns) = (matrix.nrows(), matrix.ncols());
    if rows != columns || rows == 0 {
        return Err(MatricesError::NotSquare {
            what,
            rows,
            columns,
        });
    }
    let numbered = |(row, column)| (row + 1, column + 1);
    if let Some((row, column, _)) = matrix.triplet_iter().find(|(.., v)| !v.is_finite()) {
        let (row, column) = numbered((row, column));
        return Err(MatricesError::NotFinite { what, row, column });
    }
    let values = || matrix.triplet_iter().map(|(i, j, v)| (i, j, *v));
    if let Some((i, _, value)) = values().find(|(i, j, v)| i == j && *v < 0.0) {
        return Err(MatricesError::Negative {
            what,
            row: i + 1,
            value,
        });
    }
    if let Some(found) = asymmetry(&matrix) {
        let Asymmetry { by, largest, .. } = found;
        let (row, column) = numbered((found.row, found.column));
        return Err(MatricesError::NotSymmetric {
            what,
            row,
            column,
            by,
            largest,
        });
    }
    if let Some(found) = find_indefinite_entry(&matrix) {
        let (row, column) = numbered((found.row, found.column));
        return Err(MatricesError::TooFarOff {
            what,
            row,
            column,
            value: found.value,
            first: found.diagonal[0],
            second: found.diagonal[1],
            most: found.most(),
        });
    }
    // The mean of both sides, which differ by rounding at most.
    let mirror = matrix.transpose();
    if matrix != mirror {
        matrix = (&matrix + &mirror) * 0.5;
    }
    if factor != 1.0 {
        matrix.values_mut().iter_mut().for_each(|v| *v *= factor);
    }
    Ok(matrix)
}

/// Writes all numbers, for the hash by which results are kept.
impl Serialize for GivenMatrices {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut parts = serializer.serialize_tuple(8)?;
        for matrix in [&self.stiffness, &self.mass] {
            let (offsets, indices, values) = matrix.csc_data();
            parts.serialize_element(offsets)?;
            parts.serialize_element(indices)?;
            parts.serialize_element(values)?;
        }
        parts.serialize_element(&self.rows)?;
        parts.serialize_element(&self.load_n)?;
        parts.end()
    }
}

/// Matrices of another program on the nodes of a body.
#[derive(Debug, Clone)]
pub struct PlacedMatrices {
    /// Matrices as they were given.
    pub given: Arc<GivenMatrices>,
    /// Unknown of the body that each row is.
    pub places: Vec<RowUnknown>,
    /// Axes of the matrices as columns, in those of the scene, where the body is turned.
    pub axes: Option<[[f64; 3]; 3]>,
}

/// Unknown of a body that a row of its matrices is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum RowUnknown {
    /// Displacement of a node of the mesh, local number, along an axis of the matrices.
    Displacement {
        /// Node in the body's own numbering.
        node: u32,
        /// Axis, from 0.
        axis: u8,
    },
    /// Unknown that no node of the mesh has: a generalised coordinate, the rotation of a node, or
    /// a displacement of a node that the mesh lacks. Three of them make an auxiliary node.
    Other {
        /// Number among these unknowns.
        number: u32,
        /// Node of the mesh, local number, whose rotation it is.
        rotates: Option<u32>,
    },
    /// None: the row has neither stiffness nor mass, no spring acts on it, and it is left out.
    Empty,
}

/// Matrices are equal that were read once: their entries are not compared.
impl PartialEq for PlacedMatrices {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.given, &other.given)
            && self.places == other.places
            && self.axes == other.axes
    }
}

impl Serialize for PlacedMatrices {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&*self.given, &self.places, &self.axes).serialize(serializer)
    }
}

impl PlacedMatrices {
    /// Number of unknowns that no node of the mesh has.
    pub fn unmeshed_unknowns(&self) -> usize {
        let other = |place: &&RowUnknown| matches!(place, RowUnknown::Other { .. });
        self.places.iter().filter(other).count()
    }

    /// Number of rows that are left out: they have neither stiffness nor mass, nor a spring.
    pub fn empty(&self) -> usize {
        let empty = self.places.iter().filter(|p| **p == RowUnknown::Empty);
        empty.count()
    }

    /// Nodes, axes and weights of the displacements in the scene that make up a row. `nodes` is the
    /// number of nodes of the mesh, behind which auxiliary ones are numbered.
    pub(crate) fn parts(
        &self,
        row: usize,
        nodes: usize,
    ) -> impl Iterator<Item = (usize, usize, f64)> {
        let place = match self.places[row] {
            RowUnknown::Displacement { node, axis } => {
                Some((node as usize, usize::from(axis), self.axes))
            }
            RowUnknown::Other { number, .. } => {
                let number = number as usize;
                Some((nodes + number / 3, number % 3, None))
            }
            RowUnknown::Empty => None,
        };
        place.into_iter().flat_map(|(node, axis, axes)| {
            (0..3).filter_map(move |k| {
                let weight = axes.map_or(f64::from(k == axis), |axes| axes[k][axis]);
                (weight != 0.0).then_some((node, k, weight))
            })
        })
    }

    /// Values of the rows in a motion of all nodes by the same vector, also of those that the mesh
    /// lacks. Rotations and generalised coordinates are zero.
    pub(crate) fn translation(&self, vector: [f64; 3]) -> Vec<f64> {
        let of = |row: &Row| match row {
            Row::Node { direction, .. } if *direction <= 3 => {
                self.component(usize::from(*direction) - 1, vector)
            }
            _ => 0.0,
        };
        self.given.rows().iter().map(of).collect()
    }

    /// Values of the rows in a rotation of all nodes about an axis. `arm` gives the position of a
    /// node relative to a point of the axis. `None` where the mesh lacks a node.
    pub(crate) fn rotation(
        &self,
        axis: [f64; 3],
        arm: impl Fn(u32) -> [f64; 3],
    ) -> Option<Vec<f64>> {
        let of = |(place, row): (&RowUnknown, &Row)| match (place, row) {
            (RowUnknown::Displacement { node, axis: k }, _) => {
                Some(self.component(usize::from(*k), cross(axis, arm(*node))))
            }
            (RowUnknown::Empty, _) | (_, Row::Generalised) => Some(0.0),
            (_, Row::Node { direction, .. }) if *direction > 3 => {
                Some(self.component(usize::from(*direction) - 4, axis))
            }
            (_, Row::Node { .. }) => None,
        };
        self.places.iter().zip(self.given.rows()).map(of).collect()
    }

    /// Axes of each node of the mesh along which it has a row.
    pub(super) fn axes_with_rows(&self, nodes: usize) -> Vec<[bool; 3]> {
        let mut known = vec![[false; 3]; nodes];
        for place in &self.places {
            if let RowUnknown::Displacement { node, axis } = *place {
                known[node as usize][usize::from(axis)] = true;
            }
        }
        known
    }

    /// Component of a vector along an axis of the matrices.
    fn component(&self, axis: usize, vector: [f64; 3]) -> f64 {
        let of_turned = |axes: [[f64; 3]; 3]| (0..3).map(|k| axes[k][axis] * vector[k]).sum();
        self.axes.map_or(vector[axis], of_turned)
    }
}

/// Finds the rows of the matrices of a body on its nodes, whose numbers are `tags`. `sprung` has the
/// axes of the scene along which springs act on each node: their stiffness fills empty rows.
///
/// # Errors
/// A number that two nodes have, matrices none of whose rows is on a node of the mesh, a node of a
/// turned body that has some of its three displacements only, and a steady load on a row that is
/// left out.
pub(super) fn place(
    body: &str,
    given: &Arc<GivenMatrices>,
    axes: Option<[[f64; 3]; 3]>,
    tags: &[u64],
    sprung: &[[bool; 3]],
) -> Result<PlacedMatrices, ModelError> {
    let mut local = HashMap::with_capacity(tags.len());
    for (at, &tag) in (0..).zip(tags) {
        if local.insert(tag, at).is_some() {
            return Err(ModelError::TagTwice {
                body: body.to_owned(),
                tag,
            });
        }
    }
    let mut others = 0..;
    let mut other = |rotates| RowUnknown::Other {
        number: others.next().unwrap_or(u32::MAX),
        rotates,
    };
    // The rows of a turned body mix the axes of the scene.
    let is_sprung = |row: &Row| match *row {
        Row::Node { node, direction } if direction <= 3 => local.get(&node).is_some_and(|&at| {
            let along: [bool; 3] = sprung[at as usize];
            along[usize::from(direction) - 1] || (axes.is_some() && along.contains(&true))
        }),
        _ => false,
    };
    let rows = given.rows().iter().zip(&given.is_empty);
    let places = rows.map(|(row, is_empty)| match *row {
        _ if *is_empty && !is_sprung(row) => RowUnknown::Empty,
        Row::Generalised => other(None),
        Row::Node { node, direction } => match local.get(&node) {
            Some(&node) if direction <= 3 => RowUnknown::Displacement {
                node,
                axis: direction - 1,
            },
            known => other(known.copied()),
        },
    });
    let placed = PlacedMatrices {
        given: Arc::clone(given),
        places: places.collect(),
        axes,
    };
    let mut loaded = placed.places.iter().zip(given.load_n().unwrap_or_default());
    if let Some(at) = loaded.position(|(place, f)| *place == RowUnknown::Empty && *f != 0.0) {
        return Err(ModelError::LoadOnEmptyRow {
            body: body.to_owned(),
            row: at + 1,
        });
    }
    let known = placed.axes_with_rows(tags.len());
    if known.iter().all(|axes| *axes == [false; 3]) {
        let of_node = |row: &Row| match row {
            Row::Node { node, .. } => Some(*node),
            Row::Generalised => None,
        };
        return Err(ModelError::NoRowOnMesh {
            body: body.to_owned(),
            rows: given.rows().len(),
            nodes: given.rows().iter().filter_map(of_node).take(5).collect(),
            tags: tags.iter().take(5).copied().collect(),
        });
    }
    let partly = known.iter().zip(tags);
    let mut partly = partly.filter(|(axes, _)| axes.contains(&true) && axes.contains(&false));
    match partly.next() {
        Some((_, &tag)) if axes.is_some() => Err(ModelError::TurnedRows {
            body: body.to_owned(),
            count: partly.count() + 1,
            tag,
        }),
        _ => Ok(placed),
    }
}

/// Axes of the file of a body in those of the scene, as columns; `None` where it is not turned.
pub(super) fn axes_of(assembly: &Assembly, body: &BodySpec) -> Option<[[f64; 3]; 3]> {
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut turns: Vec<&Placement> = Vec::new();
    let mut of = Some(body);
    while let Some(spec) = of {
        of = match &spec.mesh {
            BodyMesh::Shared => None,
            BodyMesh::File { placement, .. } => {
                turns.push(placement);
                None
            }
            BodyMesh::CopyOf { body, placement } => {
                turns.push(placement);
                assembly.bodies.iter().find(|b| b.name == *body)
            }
        };
    }
    turns.retain(|placement| placement.angle_rad != 0.0);
    for placement in turns.iter().rev() {
        let origin = placement.apply([0.0; 3]);
        for axis in &mut axes {
            let end = placement.apply(*axis);
            *axis = [0, 1, 2].map(|k| end[k] - origin[k]);
        }
    }
    // `axes` has the axes of the file as rows.
    (!turns.is_empty()).then(|| [0, 1, 2].map(|k| [0, 1, 2].map(|axis| axes[axis][k])))
}
