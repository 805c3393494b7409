//! Contact of the flanks: signs once, dynamic stiffness, laws.
//!
//! A *pair* joins node b of the first body (blade) to the coincident node j of the second (jaw).
//! Frame (n, t1, t2), n the unit normal FROM THE JAW INTO THE BLADE. Relative displacement
//! X = R (u_b - u_j): X_N > 0 IS AN OPEN GAP. lambda is the contact force on the left-hand side of
//! the blade's equation, Z u_b + lambda = f: lambda_N < 0 IS COMPRESSION; contact pressure
//! p = -lambda_N / A. Initial clearance g >= 0 shifts contact to X_N = -g.

pub mod dynamic_stiffness;
pub mod inexact;
pub mod law;
