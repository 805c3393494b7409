//! Solution of nonlinear systems f(x) = 0.
//!
//! [`newton()`] is Newton's method with damped steps, for systems of any size that solve their own
//! linear equations ([`NonlinearSystem`]). [`dogleg()`] is Powell's method in a trust region, for
//! small dense systems ([`DoglegSystem`]) that Newton's method does not solve. Both end with a
//! [`NewtonEnd`]: a solution that was not found is a result, not an error.
//!
//! The systems are traits of a few functions and contain all physics. A new method is a file beside
//! these two.

mod dogleg;
mod newton;

pub use dogleg::{DoglegSystem, dogleg};
pub use newton::{
    Damping, LinearTolerances, NewtonEnd, NewtonOptions, NewtonStatus, NonlinearSystem, correction,
    newton,
};
