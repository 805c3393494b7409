//! When a factor that is kept as a preconditioner, while the matrix changes, is worth making anew.

/// Making it anew costs about as much as this many linear iterations.
const ITERATIONS: usize = 20;

/// What a kept factor has cost: iterations of its first linear solve, and by how many all later ones together
/// exceeded that.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wear {
    fresh: Option<usize>,
    excess: usize,
}

impl Wear {
    /// Notes a linear solve.
    pub fn serve(&mut self, iterations: usize) {
        let fresh = *self.fresh.get_or_insert(iterations);
        self.excess += iterations.saturating_sub(fresh);
    }

    /// Whether the old one has cost more than a new one would.
    pub fn is_worn(self) -> bool {
        self.excess > ITERATIONS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_exceeds_the_first_solve_wears() {
        let mut wear = Wear::default();
        for _ in 0..100 {
            wear.serve(12);
        }
        assert!(!wear.is_worn());
        wear.serve(12 + ITERATIONS - 1);
        wear.serve(13);
        assert!(!wear.is_worn());
        wear.serve(13);
        assert!(wear.is_worn());
    }
}
