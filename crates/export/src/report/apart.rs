//! Directions along which bodies are pulled apart to show the flanks between them.

use dovetail_solver::model::Model;
use dovetail_solver::space::{dot, scaled, sub, unit};

/// Number of sweeps over all contacts. Chains of bodies need the most.
const SWEEPS: usize = 400;
/// Smallest length of the mean normal of a contact. Below it the normals cancel each other and the
/// contact has no direction to open along: a pin in its hole.
const LEAST_MEAN: f64 = 0.2;

/// Displacement vector of each body, the longest of length 1. The bodies of each contact part along
/// its mean normal, all by the same distance if the bodies allow it. They part to the sides on
/// which they lie: a root leaves its slot outwards, although its flanks press inwards. Rigid ground
/// does not move. All vectors are zero if no contact has a direction.
pub(super) fn opening_displacements(model: &Model) -> Vec<[f64; 3]> {
    let contacts: Vec<Opening> = (0..model.contact_names.len())
        .filter_map(|contact| Opening::new(model, contact))
        .collect();
    let mut moved = opened(&contacts, model.bodies.len());
    let longest = moved.iter().map(|m| dot(*m, *m).sqrt()).fold(0.0, f64::max);
    if longest > 0.0 {
        for component in moved.as_flattened_mut() {
            *component /= longest;
        }
    }
    moved
}

/// Shortest vectors by which all contacts open by 1, by Kaczmarz's method from zero.
fn opened(contacts: &[Opening], bodies: usize) -> Vec<[f64; 3]> {
    let mut moved = vec![[0.0; 3]; bodies];
    for _ in 0..SWEEPS {
        contacts.iter().for_each(|contact| contact.open(&mut moved));
    }
    moved
}

/// Direction along which the first body of a contact leaves the second.
struct Opening {
    bodies: [Option<usize>; 2],
    direction: [f64; 3],
}

impl Opening {
    fn new(model: &Model, contact: usize) -> Option<Self> {
        let contact_pairs = || model.pairs.iter().filter(|pair| pair.contact == contact);
        let mut mean = [0.0; 3];
        let pairs = contact_pairs().count() as f64;
        for pair in contact_pairs() {
            for (sum, n) in mean.iter_mut().zip(pair.frame[0]) {
                *sum += n / pairs;
            }
        }
        let first = contact_pairs().next()?;
        let bodies = first.bodies();
        let direction = unit(mean).filter(|_| dot(mean, mean).sqrt() > LEAST_MEAN)?;
        // Rigid ground is where the flank is.
        let centre = |body: Option<usize>| {
            body.map_or(first.position_m, |b| middle(&model.bodies[b].nodes_m))
        };
        let direction = away(direction, centre(bodies[0]), centre(bodies[1]));
        (bodies[0] != bodies[1]).then_some(Self { bodies, direction })
    }

    fn open(&self, moved: &mut [[f64; 3]]) {
        let along = |body: Option<usize>| body.map_or(0.0, |b| dot(moved[b], self.direction));
        let missing = 1.0 - (along(self.bodies[0]) - along(self.bodies[1]));
        let movable = self.bodies.iter().flatten().count() as f64;
        for (body, sign) in self.bodies.iter().zip([1.0, -1.0]) {
            let Some(body) = *body else { continue };
            for (component, d) in moved[body].iter_mut().zip(self.direction) {
                *component += sign * missing / movable * d;
            }
        }
    }
}

/// Direction or its opposite, such that it points from `from` to the side of `of`.
fn away(direction: [f64; 3], of: [f64; 3], from: [f64; 3]) -> [f64; 3] {
    if dot(direction, sub(of, from)) < 0.0 {
        scaled(direction, -1.0)
    } else {
        direction
    }
}

fn middle(points_m: &[[f64; 3]]) -> [f64; 3] {
    let count = points_m.len() as f64;
    [0, 1, 2].map(|axis| points_m.iter().map(|p| p[axis]).sum::<f64>() / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opening(bodies: [Option<usize>; 2], direction: [f64; 3]) -> Opening {
        Opening { bodies, direction }
    }

    #[test]
    fn a_root_leaves_its_slot_between_both_flanks() {
        let (s, c) = (0.6, 0.8);
        let flanks = [[0.0, s, c], [0.0, -s, c]];
        let both = flanks.map(|n| opening([Some(0), Some(1)], n));
        let moved = opened(&both, 2);
        for (found, exact) in
            moved
                .as_flattened()
                .iter()
                .zip([0.0, 0.0, 0.5 / c, 0.0, 0.0, -0.5 / c])
        {
            assert!((found - exact).abs() < 1e-9, "{moved:?}");
        }
        // On rigid ground the one body goes all the way.
        let ground = flanks.map(|n| opening([Some(0), None], n));
        let [up] = opened(&ground, 1)[..] else {
            panic!("one body")
        };
        assert!((up[2] - 1.0 / c).abs() < 1e-9, "{up:?}");
    }

    #[test]
    fn bodies_part_to_the_sides_on_which_they_lie() {
        let [below, above] = [[5.0, 0.0, -1.0], [0.0, 0.0, 2.0]];
        let up = [0.0, 0.0, 1.0];
        assert_eq!(away(up, above, below), up);
        assert_eq!(away(up, below, above), [-0.0, -0.0, -1.0]);
    }

    #[test]
    fn a_chain_of_bodies_opens_everywhere() {
        let chain: Vec<Opening> = (0..5)
            .map(|i| opening([Some(i + 1), Some(i)], [0.0, 1.0, 0.0]))
            .collect();
        let moved = opened(&chain, 6);
        for two in moved.windows(2) {
            assert!((two[1][1] - two[0][1] - 1.0).abs() < 1e-6, "{moved:?}");
        }
    }
}
