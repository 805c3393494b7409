//! Real numbers with their derivatives, by which a function is differentiated as it is evaluated.
//!
//! All is inlined where it is called, so that it uses the vectors of the processor there.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Real number, with or without derivatives.
pub trait Real:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Add<f64, Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Div<Output = Self>
    + Div<f64, Output = Self>
    + Neg<Output = Self>
{
    /// The number itself.
    fn re(self) -> f64;
    /// Square root; it has no derivative at 0.
    fn sqrt(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn re(self) -> f64 {
        self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
}

/// Values of `of` at 0 and 1. (`map` of an array calls a function for each number.)
#[inline(always)]
pub fn two<T>(of: impl Fn(usize) -> T) -> [T; 2] {
    [of(0), of(1)]
}

/// Values of `of` at 0, 1 and 2, as [`two`].
#[inline(always)]
pub fn three<T>(of: impl Fn(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

/// Number with its derivatives by `N` others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The number.
    pub re: f64,
    /// Its derivatives.
    pub by: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// Number `re` that is the independent one of number `of`.
    #[inline(always)]
    pub fn independent(re: f64, of: usize) -> Self {
        let mut by = [0.0; N];
        by[of] = 1.0;
        Self { re, by }
    }

    /// Number with the derivatives `by(i)`.
    #[inline(always)]
    fn new(re: f64, by: impl Fn(usize) -> f64) -> Self {
        let mut out = [0.0; N];
        for (i, out) in out.iter_mut().enumerate() {
            *out = by(i);
        }
        Self { re, by: out }
    }
}

impl<const N: usize> Real for Dual<N> {
    #[inline(always)]
    fn re(self) -> f64 {
        self.re
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.re.sqrt();
        let half = 0.5 / root;
        Self::new(root, |i| half * self.by[i])
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline(always)]
    fn from(re: f64) -> Self {
        Self { re, by: [0.0; N] }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, |i| self.by[i] + other.by[i])
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self {
            re: self.re + other,
            ..self
        }
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, |i| self.by[i] - other.by[i])
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the rule of the product")]
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let by = |i: usize| self.re * other.by[i] + other.re * self.by[i];
        Self::new(self.re * other.re, by)
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self::new(self.re * other, |i| self.by[i] * other)
    }
}

#[expect(
    clippy::suspicious_arithmetic_impl,
    reason = "the rule of the quotient"
)]
impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = other.re.recip();
        let quotient = self.re / other.re;
        let by = |i: usize| (self.by[i] - quotient * other.by[i]) * inverse;
        Self::new(quotient, by)
    }
}

#[expect(
    clippy::suspicious_arithmetic_impl,
    reason = "the rule of the quotient"
)]
impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        let inverse = other.recip();
        Self::new(self.re / other, |i| self.by[i] * inverse)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.re, |i| -self.by[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All that a number can do.
    fn function<D: Real>([x, y]: [D; 2]) -> D {
        let mut sum = (x * y + x * 2.0 - y / 3.0).sqrt();
        sum += -x / (y + 4.0) + D::from(5.0);
        sum * sum / x
    }

    #[test]
    fn derivatives_are_those_by_differences() {
        let at = [1.7, 0.6];
        let found = function([0, 1].map(|i| Dual::<2>::independent(at[i], i)));
        assert_eq!(found.re, function(at));
        for i in 0..2 {
            let moved = |step: f64| {
                let mut at = at;
                at[i] += step;
                function(at)
            };
            let by_differences = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            assert!((found.by[i] - by_differences).abs() < 1e-8, "{i}");
        }
    }
}
