//! Contact of the flanks: signs once, and dynamic stiffness. The laws are in [`crate::law`].
//!
//! A *pair* joins the point b of the first flank of a contact to the point j of the second (or of
//! rigid ground) opposite; one of the two is a node, the other a weighted mean of nodes.
//! Frame (n, t1, t2), n the unit normal FROM THE SECOND FLANK INTO THE BODY OF THE FIRST. Relative
//! displacement X = R (u_b - u_j): X_N > 0 IS AN OPEN GAP. lambda is the contact force on the left-hand
//! side of the equation of the body of the first flank, Z u_b + lambda = f: lambda_N < 0 IS
//! COMPRESSION; contact pressure p = -lambda_N / A. An initial clearance g shifts contact to
//! X_N = -g; g < 0 is an interference.

pub mod dynamic_stiffness;
pub mod inexact;

/// The tangential ones of `n` unknowns, 3 per pair, ascending.
pub(crate) fn tangential(n: usize) -> Vec<usize> {
    (0..n).filter(|i| i % 3 != 0).collect()
}
