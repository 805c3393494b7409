//! VTU files of VTK, ParaView, pyvista and meshio: one unstructured grid, in one part or several.
//!
//! Groups come from arrays of whole numbers with one component. Such an array gives a group
//! `<array> <value>` for each of its values: the cells or nodes that have the value. Two kinds of
//! arrays give none. One has more than 1000 distinct values. The other has at least four values, no
//! two of them alike: it only numbers the cells or nodes. A remark names it.
//!
//! An array that holds only 0 and 1 gives a group `<array>` of the ones, too. Where cells of
//! several dimensions have a value, the word `volume`, `surface`, `curve` or `point` is appended to
//! the name. Arrays of nodes give groups of nodes, with the word `nodes` appended to the name where
//! cells have an array of that name. All solids are the group `all`, unless an array has this name.
//!
//! Tags of nodes and cells are their numbers in ParaView, from 0.

mod arrays;
mod xml;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use dovetail_numerics::space::{cross, dot};

use super::collapse;
use super::content::{ALL, Content};
use crate::element::{ElementType, Shape};
use crate::{Group, MeshError, text};
use arrays::values;
use xml::{Array, File, Piece};

/// Most values of an array that gives groups.
const MOST_VALUES: usize = 1000;
/// Number of values from which on an array of distinct numbers counts nodes or cells, and gives no
/// groups.
const LEAST_NUMBERING: usize = 4;

/// Kind of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
enum VtuCell {
    Solid(ElementType),
    Facet(usize),
    /// Line of so many nodes, or of any number.
    Line(Option<usize>),
    Points,
}

impl VtuCell {
    fn dimension(self) -> u8 {
        match self {
            Self::Solid(_) => 3,
            Self::Facet(_) => 2,
            Self::Line(_) => 1,
            Self::Points => 0,
        }
    }
}

/// Kind of a cell by VTK's number of its type and its number of nodes.
fn cell(kind: f64, nodes: usize) -> Option<VtuCell> {
    let solid = |nodes| ElementType::from_node_count(nodes).map(VtuCell::Solid);
    match kind as i64 {
        10 => solid(4),
        11 | 12 => solid(8),
        13 => solid(6),
        14 => solid(5),
        24 => solid(10),
        25 => solid(20),
        26 => solid(15),
        27 => solid(13),
        7 if matches!(nodes, 3 | 4) => Some(VtuCell::Facet(nodes)),
        5 => Some(VtuCell::Facet(3)),
        8 | 9 => Some(VtuCell::Facet(4)),
        22 => Some(VtuCell::Facet(6)),
        23 => Some(VtuCell::Facet(8)),
        3 => Some(VtuCell::Line(Some(2))),
        21 => Some(VtuCell::Line(Some(3))),
        4 => Some(VtuCell::Line(None)),
        1 | 2 => Some(VtuCell::Points),
        _ => None,
    }
}

/// Position of each of our nodes in a voxel or a pixel, whose nodes are sorted by coordinates.
const SORTED: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];
/// Position of each of our nodes in a wedge that is inside out.
const TURNED_WEDGE: [usize; 15] = [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13];

/// Parses the bytes of a file. Lengths are those of the file.
///
/// # Errors
/// Bytes that are not a whole VTU file, or cells that are not read: see [`MeshError`].
pub fn parse(bytes: &[u8]) -> Result<Content, MeshError> {
    let file = xml::read(bytes)?;
    let mut grid = VtuGrid::default();
    for piece in &file.pieces {
        grid.add(&file, piece)?;
    }
    if file.pieces.iter().filter(|p| p.points > 0).count() > 1 {
        let remark = "The file has several pieces: nodes that stand in two of them are not joined \
            (ParaView's filter Clean to Grid joins them).";
        grid.content.remarks.push(remark.to_owned());
    }
    grid.groups(&file)?;
    let mut content = grid.content;
    if !(content.groups.contains_key(ALL) || content.elements.is_empty()) {
        content.groups.insert(ALL.to_owned(), content.solid_group());
    }
    content.name_all();
    content.drop_unused()?;
    Ok(content)
}

/// Cell of the file with its nodes: an element, or nodes alone.
struct Placed {
    cell: VtuCell,
    /// Index among the elements or the facets.
    index: u32,
    /// Nodes of lines and points.
    nodes: Vec<u32>,
}

#[derive(Default)]
struct VtuGrid {
    content: Content,
    cells: Vec<Placed>,
}

fn named<'a, 'b>(arrays: &'b [Array<'a>], name: &str) -> Result<&'b Array<'a>, MeshError> {
    let array = arrays
        .iter()
        .find(|array| array.name.eq_ignore_ascii_case(name));
    array.ok_or_else(|| xml::xml_error(format!("a piece lacks the array `{name}` of <Cells>")))
}

impl VtuGrid {
    fn add(&mut self, file: &File<'_>, piece: &Piece<'_>) -> Result<(), MeshError> {
        let first = self.content.nodes.len();
        if piece.points > 0 {
            let Some(positions) = piece.positions.first() else {
                return Err(xml::xml_error("a piece has no array in <Points>"));
            };
            if positions.components != 3 {
                return Err(xml::xml_error(
                    "the array in <Points> has not three components",
                ));
            }
            let positions = values(file, positions, piece.points)?;
            let positions = positions.as_chunks::<3>().0;
            self.content.nodes.extend(positions);
            let tags = first as u64..self.content.nodes.len() as u64;
            self.content.node_tags.extend(tags);
        }
        MeshError::check_number("nodes", self.content.nodes.len() as u64)?;
        if piece.cells == 0 {
            return Ok(());
        }
        let kinds = values(file, named(&piece.topology, "types")?, piece.cells)?;
        let offsets = values(file, named(&piece.topology, "offsets")?, piece.cells)?;
        let total = offsets.last().copied().unwrap_or(0.0);
        if !(0.0..4e9).contains(&total) {
            return Err(xml::xml_error(format!(
                "the last offset of <Cells> is {total}"
            )));
        }
        let connectivity = values(
            file,
            named(&piece.topology, "connectivity")?,
            total as usize,
        )?;
        let mut begin = 0;
        for (kind, end) in kinds.iter().zip(&offsets) {
            let end = *end as usize;
            let tag = self.cells.len() as u64;
            let Some(nodes) = connectivity.get(begin..end) else {
                return Err(xml::xml_error(format!(
                    "the offsets of <Cells> go back at cell {tag}"
                )));
            };
            begin = end;
            let nodes = indices(nodes, piece.points, first, tag)?;
            self.cell(tag, *kind, nodes)?;
        }
        Ok(())
    }

    fn cell(&mut self, tag: u64, kind: f64, nodes: Vec<u32>) -> Result<(), MeshError> {
        let Some(cell) = cell(kind, nodes.len()) else {
            return Err(MeshError::CellType { cell: tag, kind });
        };
        let expected = match cell {
            VtuCell::Solid(element) => Some(element.nodes()),
            VtuCell::Facet(nodes) => Some(nodes),
            VtuCell::Line(nodes) => nodes,
            VtuCell::Points => None,
        };
        if expected.is_some_and(|expected| expected != nodes.len()) {
            let found = nodes.len();
            return Err(xml::xml_error(format!(
                "cell {tag} of type {kind} has {found} nodes"
            )));
        }
        let nodes = match kind as i64 {
            8 | 11 => SORTED[..nodes.len()].iter().map(|i| nodes[*i]).collect(),
            _ => nodes,
        };
        let mut placed = Placed {
            cell,
            index: 0,
            nodes: Vec::new(),
        };
        match cell {
            VtuCell::Solid(element) => {
                placed.index = self.content.elements.len() as u32;
                let nodes = self.upright(element, nodes);
                let kept = collapse::solid(tag, &nodes, &self.content.node_tags)?;
                self.content.elements.push(tag, kept.iter().copied());
            }
            VtuCell::Facet(_) => {
                placed.index = self.content.facets.len() as u32;
                let kept = collapse::facet(tag, &nodes, &self.content.node_tags)?;
                self.content.facets.push(tag, kept.iter().copied());
            }
            VtuCell::Line(_) | VtuCell::Points => {
                self.content.other_nodes.extend(&nodes);
                placed.nodes = nodes;
            }
        }
        self.cells.push(placed);
        Ok(())
    }

    /// Nodes of a solid. Those of a wedge whose base faces the other way are turned, because VTK's
    /// own wedges are oriented so, and those of other programs are not.
    fn upright(&self, element: ElementType, nodes: Vec<u32>) -> Vec<u32> {
        if element.shape != Shape::Wedge {
            return nodes;
        }
        let at = |i: usize| self.content.nodes[nodes[i] as usize];
        let from_first = |i: usize| [0, 1, 2].map(|axis| at(i)[axis] - at(0)[axis]);
        let normal = cross(from_first(1), from_first(2));
        let up = [0, 1, 2].map(|axis| {
            let top: f64 = (3..6).map(|i| at(i)[axis]).sum();
            let base: f64 = (0..3).map(|i| at(i)[axis]).sum();
            top - base
        });
        if dot(normal, up) < 0.0 {
            TURNED_WEDGE[..nodes.len()]
                .iter()
                .map(|i| nodes[*i])
                .collect()
        } else {
            nodes
        }
    }

    fn groups(&mut self, file: &File<'_>) -> Result<(), MeshError> {
        let remarks = &mut self.content.remarks;
        let of_cells = whole_arrays(file, |p| (p.cells, &p.cell_data), remarks)?;
        let of_points = whole_arrays(file, |p| (p.points, &p.point_data), remarks)?;
        for (name, values) in &of_cells {
            let mut by_value: BTreeMap<(i64, u8), Vec<usize>> = BTreeMap::new();
            for (i, (value, placed)) in values.iter().zip(&self.cells).enumerate() {
                let key = (*value, placed.cell.dimension());
                by_value.entry(key).or_default().push(i);
            }
            for (&(value, dimension), cells) in &by_value {
                let has = |d: &u8| by_value.contains_key(&(value, *d));
                let suffix = match (0..=3).filter(has).count() {
                    1 => "",
                    _ => [" point", " curve", " surface", " volume"][usize::from(dimension)],
                };
                let group = self.group_of(dimension, cells);
                self.insert(name, values, value, suffix, group)?;
            }
        }
        for (name, values) in &of_points {
            let suffix = if of_cells.contains_key(name) {
                " nodes"
            } else {
                ""
            };
            let mut by_value: BTreeMap<i64, Vec<u32>> = BTreeMap::new();
            for (i, value) in values.iter().enumerate() {
                by_value.entry(*value).or_default().push(i as u32);
            }
            for (value, nodes) in by_value {
                let group = Group {
                    nodes,
                    ..Group::empty(0)
                };
                self.insert(name, values, value, suffix, group)?;
            }
        }
        Ok(())
    }

    fn group_of(&self, dimension: u8, cells: &[usize]) -> Group {
        let mut group = Group::empty(dimension);
        for placed in cells.iter().map(|i| &self.cells[*i]) {
            let nodes = match placed.cell {
                VtuCell::Solid(_) => self.content.elements.element_nodes(placed.index as usize),
                VtuCell::Facet(_) => self.content.facets.element_nodes(placed.index as usize),
                VtuCell::Line(_) | VtuCell::Points => &placed.nodes,
            };
            group.nodes.extend(nodes);
            if dimension >= 2 {
                group.elements.push(placed.index);
            }
        }
        group
    }

    /// Adds the group of a value of an array; that of the ones also under the name of the array, if
    /// all its values are 0 or 1.
    fn insert(
        &mut self,
        name: &str,
        values: &[i64],
        value: i64,
        suffix: &str,
        group: Group,
    ) -> Result<(), MeshError> {
        if value == 1 && values.iter().all(|value| matches!(value, 0 | 1)) {
            let mark = format!("{name}{suffix}");
            self.content.add_group(mark, group.clone())?;
        }
        let name = format!("{name} {value}{suffix}");
        self.content.add_group(name, group)
    }
}

/// Numbers of nodes in the whole grid.
fn indices(nodes: &[f64], points: usize, first: usize, cell: u64) -> Result<Vec<u32>, MeshError> {
    let mut positions = Vec::with_capacity(nodes.len());
    for node in nodes {
        let in_piece = *node as usize;
        if *node < 0.0 || node.fract() != 0.0 || in_piece >= points {
            return Err(xml::xml_error(format!(
                "cell {cell} names point {node}, and its piece has {points}"
            )));
        }
        let index = (first + in_piece) as u32;
        positions.push(index);
    }
    Ok(positions)
}

/// Values of arrays of one component that every part of the grid has, if all are whole numbers and
/// not too many are distinct.
fn whole_arrays<'a>(
    file: &'a File<'a>,
    of: impl Fn(&'a Piece<'a>) -> (usize, &'a Vec<Array<'a>>),
    remarks: &mut Vec<String>,
) -> Result<BTreeMap<String, Vec<i64>>, MeshError> {
    let pieces: Vec<_> = file
        .pieces
        .iter()
        .map(of)
        .filter(|(count, _)| *count > 0)
        .collect();
    let mut joined_arrays = BTreeMap::new();
    let Some((_, first)) = pieces.first() else {
        return Ok(joined_arrays);
    };
    let names: BTreeSet<&str> = first.iter().map(|array| array.name.as_str()).collect();
    let mut numberings = Vec::new();
    for name in names {
        let arrays: Vec<_> = pieces
            .iter()
            .map(|(count, arrays)| (*count, arrays.iter().find(|array| array.name == name)))
            .collect();
        let Some(values) = whole_array(file, name, &arrays, remarks)? else {
            continue;
        };
        let distinct = values.iter().collect::<BTreeSet<_>>().len();
        if distinct > MOST_VALUES {
            continue;
        }
        if distinct == values.len() && distinct >= LEAST_NUMBERING {
            numberings.push(format!("`{name}`"));
        } else {
            joined_arrays.insert(name.to_owned(), values);
        }
    }
    if !numberings.is_empty() {
        let names = text::list(&numberings);
        remarks.push(format!(
            "These arrays have another number everywhere and give no groups: {names}."
        ));
    }
    Ok(joined_arrays)
}

/// Values of the array `name` in all parts of the grid, each with their number; `None` where a part
/// lacks it, or the values are not whole numbers.
fn whole_array(
    file: &File<'_>,
    name: &str,
    arrays: &[(usize, Option<&Array<'_>>)],
    remarks: &mut Vec<String>,
) -> Result<Option<Vec<i64>>, MeshError> {
    let mut whole = Vec::new();
    for (count, array) in arrays {
        let Some(array) = array else {
            remarks.push(format!(
                "The array `{name}` was left aside, as not every piece has it."
            ));
            return Ok(None);
        };
        if name.is_empty() || array.components != 1 || array.scalar.is_none() {
            return Ok(None);
        }
        match whole_numbers(&values(file, array, *count)?) {
            Some(values) => whole.extend(values),
            None => return Ok(None),
        }
    }
    Ok(Some(whole))
}

/// Values as whole numbers, if all are.
fn whole_numbers(values: &[f64]) -> Option<Vec<i64>> {
    const EXACT: f64 = 9_007_199_254_740_992.0; // 2^53
    let is_whole = |x: &f64| x.fract() == 0.0 && x.abs() < EXACT;
    values
        .iter()
        .map(|x| is_whole(x).then_some(*x as i64))
        .collect()
}
