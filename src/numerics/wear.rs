//! When a factor that is kept as a preconditioner, while the matrix changes, is worth making anew.

/// Making a dense factor anew costs about as much as one linear iteration for every so many unknowns.
const UNKNOWNS_PER_ITERATION: usize = 60;

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

    /// Whether the old factor of `unknowns` rows has cost more than a new one would.
    pub fn is_worn(self, unknowns: usize) -> bool {
        self.excess > unknowns / UNKNOWNS_PER_ITERATION
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
        assert!(!wear.is_worn(120));
        wear.serve(14);
        assert!(!wear.is_worn(120));
        wear.serve(13);
        assert!(wear.is_worn(120) && !wear.is_worn(180));
    }
}
