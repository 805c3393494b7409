//! Criterion to refresh a preconditioner, a factor that is reused while the matrix changes.

/// Cost of a new factor, as a number of linear iterations.
const ITERATIONS: usize = 20;

/// Cost of an old factor: the iterations of its first linear solve, and the sum by which all later
/// ones exceeded that.
#[derive(Debug, Clone, Copy, Default)]
pub struct RefreshPolicy {
    fresh: Option<usize>,
    excess: usize,
}

impl RefreshPolicy {
    /// Records the iterations of a linear solve.
    pub fn record(&mut self, iterations: usize) {
        let fresh = *self.fresh.get_or_insert(iterations);
        self.excess += iterations.saturating_sub(fresh);
    }

    /// Returns `true` if the old factor has cost more than a new one would.
    pub fn is_due(self) -> bool {
        self.excess > ITERATIONS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_exceeds_the_first_solve_counts() {
        let mut refresh = RefreshPolicy::default();
        for _ in 0..100 {
            refresh.record(12);
        }
        assert!(!refresh.is_due());
        refresh.record(12 + ITERATIONS - 1);
        refresh.record(13);
        assert!(!refresh.is_due());
        refresh.record(13);
        assert!(refresh.is_due());
    }
}
