//! Fill-reducing order: nested dissection of the node graph, then a postorder of the elimination
//! tree.
//!
//! The unknowns of a finite element node come together, so that the graph of the nodes is dissected
//! (a ninth of the entries in 3-D) and each node is expanded into its unknowns. The postorder is
//! that of the unknowns, which do not always couple as their nodes do: supports may hold single
//! components. It costs nothing in fill, and the supernodes below another one then follow each
//! other, as `solve.rs` requires (Liu, SIAM J. Matrix Anal. Appl. 11 (1990) 134-172).

use feral_metis::{CscPattern, MetisOptions, OrderingError, metis_order_full};
use nalgebra_sparse::pattern::SparsityPattern;

/// Permutation and its inverse.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Order {
    /// Old index at each new position.
    pub new_to_old: Vec<usize>,
    /// New position of each old index.
    pub old_to_new: Vec<usize>,
}

impl Order {
    /// Order of a list; `None` where the list is no permutation.
    pub(super) fn new(new_to_old: Vec<usize>) -> Option<Self> {
        let mut seen = vec![false; new_to_old.len()];
        for &old in &new_to_old {
            if std::mem::replace(seen.get_mut(old)?, true) {
                return None;
            }
        }
        Some(Self::from_permutation(new_to_old))
    }

    fn from_permutation(new_to_old: Vec<usize>) -> Self {
        let mut old_to_new = vec![0; new_to_old.len()];
        for (new, &old) in new_to_old.iter().enumerate() {
            old_to_new[old] = new;
        }
        Self {
            new_to_old,
            old_to_new,
        }
    }

    /// Returns `true` if the unknowns below another one in the elimination tree of `pattern`
    /// directly precede it.
    pub(super) fn is_postorder(&self, pattern: &SparsityPattern) -> bool {
        postorder(&elimination_tree(pattern, self))
            .into_iter()
            .eq(0..self.new_to_old.len())
    }
}

/// Error of an order that was not found.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum OrderError {
    #[error("a pattern of {rows} rows and {columns} columns cannot be ordered: it must be square")]
    NotSquare { rows: usize, columns: usize },
    #[error(
        "{unknowns} unknowns with {entries} entries are more than the ordering's 32-bit indices can name"
    )]
    TooLarge { unknowns: usize, entries: usize },
    #[error("nested dissection failed: {0}")]
    Dissection(OrderingError),
}

/// Orders a structurally symmetric pattern whose unknowns come in nodes of `block` consecutive ones
/// (3 in solid mechanics; 1 is used where `block` does not divide their number).
///
/// # Errors
/// A pattern that is not square, or larger than 32-bit indices.
pub fn nested_dissection(pattern: &SparsityPattern, block: usize) -> Result<Order, OrderError> {
    let unknowns = pattern.minor_dim();
    if pattern.major_dim() != unknowns {
        return Err(OrderError::NotSquare {
            rows: unknowns,
            columns: pattern.major_dim(),
        });
    }
    let divides = block > 0 && unknowns.is_multiple_of(block);
    let block = if divides { block } else { 1 };
    let graph = node_graph(pattern, block);
    let too_large = || OrderError::TooLarge {
        unknowns: graph.nodes(),
        entries: graph.neighbours.len(),
    };
    let narrow = |v: &[usize]| -> Result<Vec<i32>, OrderError> {
        v.iter()
            .map(|&x| i32::try_from(x).map_err(|_| too_large()))
            .collect()
    };
    let (offsets, neighbours) = (narrow(&graph.offsets)?, narrow(&graph.neighbours)?);
    let nodes = CscPattern::new(graph.nodes(), &offsets, &neighbours).ok_or_else(too_large)?;
    let dissection: Vec<usize> = match graph.nodes() {
        0 => Vec::new(),
        _ => metis_order_full(&nodes, &dissection_options(graph.nodes()))
            .map_err(OrderError::Dissection)?
            .0
            .into_iter()
            .map(|node| node as usize)
            .collect(),
    };
    let dissected = Order::from_permutation(
        dissection
            .into_iter()
            .flat_map(|node| (0..block).map(move |i| block * node + i))
            .collect(),
    );
    let gathered = postorder(&elimination_tree(pattern, &dissected));
    Ok(Order::from_permutation(
        gathered
            .into_iter()
            .map(|position| dissected.new_to_old[position])
            .collect(),
    ))
}

/// Numbers of nodes below which the order takes as long as the factor, and from which a better
/// dissection repays its time.
const SMALL: usize = 30_000;
const LARGE: usize = 50_000;

/// Options of the dissection. Of a small graph, parts of 800 nodes are not dissected further but
/// ordered by minimum degree: this takes two thirds of the time, and the factor a few hundredths
/// more operations. The coarsest graph, which is bisected first, has a fraction of the nodes of a
/// large one, as in METIS 5 (there always, and a thirtieth): where it has 120 nodes, the separators
/// of large meshes come out a tenth larger.
fn dissection_options(nodes: usize) -> MetisOptions {
    let mut options = MetisOptions::default();
    if nodes < SMALL {
        options.nd_to_amd_switch = 800;
    }
    if nodes >= LARGE {
        options.coarsen_floor = u32::try_from(nodes / 60).unwrap_or(u32::MAX);
    }
    options
}

/// Adjacency of the nodes, ascending, each neighbour once, a node not its own neighbour.
struct Graph {
    offsets: Vec<usize>,
    neighbours: Vec<usize>,
}

impl Graph {
    fn nodes(&self) -> usize {
        self.offsets.len() - 1
    }
}

fn node_graph(pattern: &SparsityPattern, block: usize) -> Graph {
    let nodes = pattern.major_dim() / block;
    let mut offsets = Vec::with_capacity(nodes + 1);
    offsets.push(0);
    let mut neighbours = Vec::new();
    let mut row = Vec::new();
    for node in 0..nodes {
        row.clear();
        for column in block * node..block * (node + 1) {
            row.extend(
                pattern
                    .lane(column)
                    .iter()
                    .map(|&i| i / block)
                    .filter(|&i| i != node),
            );
        }
        row.sort_unstable();
        row.dedup();
        neighbours.extend_from_slice(&row);
        offsets.push(neighbours.len());
    }
    Graph {
        offsets,
        neighbours,
    }
}

/// Parent of each position in the elimination tree of the permuted pattern; roots are their own
/// parents (Liu's algorithm with path compression).
fn elimination_tree(pattern: &SparsityPattern, order: &Order) -> Vec<usize> {
    let n = order.new_to_old.len();
    let mut parent: Vec<usize> = (0..n).collect();
    let mut ancestor: Vec<usize> = (0..n).collect();
    for (new, &old) in order.new_to_old.iter().enumerate() {
        for &neighbour in pattern.lane(old) {
            let mut at = order.old_to_new[neighbour];
            while at < new {
                let next = ancestor[at];
                ancestor[at] = new;
                if next == at {
                    parent[at] = new;
                    break;
                }
                at = next;
            }
        }
    }
    parent
}

/// Positions of a forest, children before parents, each subtree together.
fn postorder(parent: &[usize]) -> Vec<usize> {
    const NONE: usize = usize::MAX;
    let n = parent.len();
    let (mut first_child, mut next_sibling) = (vec![NONE; n], vec![NONE; n]);
    let mut roots = Vec::new();
    for child in (0..n).rev() {
        if parent[child] == child {
            roots.push(child);
        } else {
            next_sibling[child] = first_child[parent[child]];
            first_child[parent[child]] = child;
        }
    }
    let mut order = Vec::with_capacity(n);
    let mut path = Vec::new();
    for root in roots.into_iter().rev() {
        path.push(root);
        while let Some(&at) = path.last() {
            if first_child[at] == NONE {
                order.push(at);
                path.pop();
            } else {
                let child = first_child[at];
                first_child[at] = next_sibling[child];
                path.push(child);
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::submatrix;
    use dovetail_testkit::lattice::Lattice;
    use nalgebra_sparse::CscMatrix;

    /// A box of nodes with three unknowns each, neighbours coupled.
    fn grid(shape: [usize; 3]) -> SparsityPattern {
        let lattice = Lattice::new(shape, 1.0, 1.0, 0.0);
        let number: Vec<_> = (0..lattice.nodes()).map(Some).collect();
        let (k, _) = lattice.matrices(&number, lattice.nodes());
        k.pattern().clone()
    }

    /// Entries of the Cholesky factor under an order, by symbolic elimination on sets.
    fn fill(pattern: &SparsityPattern, order: &Order) -> usize {
        let n = pattern.major_dim();
        let mut below: Vec<std::collections::BTreeSet<usize>> = (0..n)
            .map(|new| {
                let neighbours = pattern.lane(order.new_to_old[new]).iter();
                let all = neighbours.map(|&o| order.old_to_new[o]);
                all.filter(|&p| p > new).collect()
            })
            .collect();
        for new in 0..n {
            let column = below[new].clone();
            if let Some(&parent) = column.first() {
                below[parent].extend(column.iter().filter(|&&p| p > parent));
            }
        }
        below.iter().map(|c| c.len() + 1).sum()
    }

    #[test]
    fn the_order_is_a_permutation_that_keeps_nodes_together() {
        let order = nested_dissection(&grid([6, 5, 4]), 3).unwrap();
        let mut sorted = order.new_to_old.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..360).collect::<Vec<_>>());
        for node in order.new_to_old.chunks(3) {
            assert_eq!(node[0] % 3, 0);
            assert_eq!([node[1], node[2]], [node[0] + 1, node[0] + 2]);
        }
        for (new, &old) in order.new_to_old.iter().enumerate() {
            assert_eq!(order.old_to_new[old], new);
        }
    }

    /// Returns `true` if the subtree of each position is the block of positions that ends with it.
    fn subtrees_are_together(tree: &[usize]) -> bool {
        let mut descendants = vec![1; tree.len()];
        for (at, &parent) in tree.iter().enumerate() {
            if parent != at {
                descendants[parent] += descendants[at];
            }
        }
        tree.iter()
            .enumerate()
            .all(|(at, &parent)| at + descendants[parent] > parent)
    }

    #[test]
    fn a_postorder_keeps_the_fill_and_gathers_the_subtrees() {
        let pattern = grid([6, 5, 4]);
        let shuffled = Order::new((0..360).map(|i| (i * 77 + 13) % 360).collect()).unwrap();
        let tree = elimination_tree(&pattern, &shuffled);
        assert!(!subtrees_are_together(&tree) && !shuffled.is_postorder(&pattern));
        let gathered = postorder(&tree).into_iter();
        let gathered = Order::new(gathered.map(|p| shuffled.new_to_old[p]).collect()).unwrap();
        assert!(subtrees_are_together(&elimination_tree(
            &pattern, &gathered
        )));
        assert!(gathered.is_postorder(&pattern));
        assert_eq!(fill(&pattern, &gathered), fill(&pattern, &shuffled));
    }

    /// Pattern without the rows and columns for which `held` is true.
    fn restrict_pattern(
        pattern: &SparsityPattern,
        held: impl Fn(usize) -> bool,
    ) -> SparsityPattern {
        let ones = vec![1.0; pattern.nnz()];
        let all = CscMatrix::try_from_pattern_and_values(pattern.clone(), ones).unwrap();
        let kept: Vec<usize> = (0..pattern.major_dim()).filter(|&i| !held(i)).collect();
        submatrix(&all, &kept, &kept).pattern().clone()
    }

    #[test]
    fn the_whole_order_is_postordered_where_nodes_lose_components_too() {
        let whole = grid([9, 8, 7]);
        // Of every seventh node one component is held: threes of the unknowns left are no nodes.
        let odd = restrict_pattern(&whole, |dof| dof % 21 == 4);
        assert!(odd.major_dim().is_multiple_of(3) && odd.major_dim() < whole.major_dim());
        for pattern in [whole, odd] {
            let order = nested_dissection(&pattern, 3).unwrap();
            assert!(subtrees_are_together(&elimination_tree(&pattern, &order)));
        }
    }

    #[test]
    fn dissection_fills_far_less_than_the_natural_order() {
        let pattern = grid([14, 14, 14]);
        let dissected = nested_dissection(&pattern, 3).unwrap();
        let natural = Order::new((0..pattern.major_dim()).collect()).unwrap();
        let (dissected, natural) = (fill(&pattern, &dissected), fill(&pattern, &natural));
        assert!(3 * dissected < 2 * natural, "{dissected} against {natural}");
    }

    #[test]
    fn pieces_without_connection_and_no_unknowns_at_all_are_ordered() {
        let diagonal = SparsityPattern::try_from_offsets_and_indices(
            4,
            4,
            vec![0, 1, 2, 3, 4],
            vec![0, 1, 2, 3],
        );
        let mut order = nested_dissection(&diagonal.unwrap(), 3).unwrap().new_to_old;
        order.sort_unstable();
        assert_eq!(order, [0, 1, 2, 3]);
        let nothing = nested_dissection(&SparsityPattern::zeros(0, 0), 3).unwrap();
        assert!(nothing.new_to_old.is_empty());
        assert!(nested_dissection(&SparsityPattern::zeros(2, 3), 3).is_err());
    }
}
