//! Iterative solution of large linear systems A x = b of which only products A x are at hand.
//!
//! [`gmres()`] is the method, for matrices without symmetry. It converges as fast as the
//! preconditioner, an approximate inverse of A, is good. [`RefreshPolicy`] says when a
//! preconditioner that was made for an earlier A costs more iterations than a new one would.
//!
//! Both know nothing of where A comes from. The order of the sums decides the last bits of every
//! result and stays as it is.

mod gmres;
mod refresh;

pub use gmres::{GmresEnd, gmres};
pub use refresh::RefreshPolicy;
