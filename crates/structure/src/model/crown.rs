//! Crowned flanks: a clearance that grows with the square of the distance from a point or a line.

use super::ContactPair;
use crate::model::CrownSpec;
use dovetail_numerics::space::{Vector, add_scaled, dot, scaled, sub, unit};

/// Adds the crown's clearance d^2 / (2 R) to the pairs of one contact. d is measured in the tangent
/// plane of the flank (across its mean normal): from the centre or, with an axis, from the line
/// along it.
///
/// Returns `Err` where the axis is perpendicular to the flank.
pub(super) fn add_crown(pairs: &mut [ContactPair], crown: &CrownSpec) -> Result<(), AcrossFlank> {
    let area: f64 = pairs.iter().map(|p| p.area_m2).sum();
    let mean = |of: &dyn Fn(&ContactPair) -> Vector| -> Vector {
        let mut sum = [0.0; 3];
        for pair in pairs.iter() {
            add_scaled(&mut sum, pair.area_m2 / area, of(pair));
        }
        sum
    };
    let centre = crown.centre_m.unwrap_or_else(|| mean(&|p| p.position_m));
    let normal = unit(mean(&|p| p.frame[0])).ok_or(AcrossFlank)?;
    let without = |v: Vector, d: Vector| sub(v, scaled(d, dot(v, d)));
    let axis = match crown.axis {
        None => None,
        Some(axis) => {
            let along = without(axis, normal);
            if dot(along, along) < LEAST_ALONG * LEAST_ALONG {
                return Err(AcrossFlank);
            }
            unit(along)
        }
    };
    for pair in pairs {
        let mut d = without(sub(pair.position_m, centre), normal);
        if let Some(axis) = axis {
            d = without(d, axis);
        }
        pair.law.gap_m += dot(d, d) / (2.0 * crown.radius_m);
    }
    Ok(())
}

/// The axis of the crown is (nearly) the normal of the flank.
#[derive(Debug, PartialEq)]
pub(super) struct AcrossFlank;

/// Sine of the smallest angle between axis and normal.
const LEAST_ALONG: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{BodyNode, Side, Slave};
    use dovetail_dynamics::contact::PairLaw;

    fn pairs() -> Vec<ContactPair> {
        // A plane flank at 45 degrees, 3 x 3 nodes, areas of a uniform grid.
        let h = 0.5f64.sqrt();
        let [n, t1, t2] = [[0.0, -h, -h], [1.0, 0.0, 0.0], [0.0, -h, h]];
        let weight = |i: usize| if i == 1 { 2.0 } else { 1.0 };
        (0..9)
            .map(|k| {
                let (i, j) = (k % 3, k / 3);
                let (a, b) = (1e-3 * i as f64, 2e-3 * j as f64);
                ContactPair {
                    contact: 0,
                    slave: Slave {
                        node: BodyNode { body: 0, node: 0 },
                        masters: Vec::new(),
                        ahead: 0,
                    },
                    side: Side::First,
                    position_m: [0, 1, 2].map(|c| a * t1[c] + b * t2[c] + 0.3),
                    frame: [n, t1, t2],
                    area_m2: weight(i) * weight(j),
                    law: PairLaw::rigid(0.0, 1e-6),
                }
            })
            .collect()
    }

    fn crown(axis: Option<[f64; 3]>, centre_m: Option<[f64; 3]>) -> CrownSpec {
        CrownSpec {
            radius_m: 0.25,
            axis,
            centre_m,
        }
    }

    fn gaps(crown: &CrownSpec) -> Vec<f64> {
        let mut pairs = pairs();
        add_crown(&mut pairs, crown).unwrap();
        pairs.iter().map(|p| p.law.gap_m - 1e-6).collect()
    }

    fn assert_gaps(found: &[f64], expected: impl Fn(f64, f64) -> f64) {
        for (k, gap) in found.iter().enumerate() {
            let (a, b) = (1e-3 * (k % 3) as f64, 2e-3 * (k / 3) as f64);
            assert!((gap - expected(a, b)).abs() < 1e-15, "{k}: {gap}");
        }
    }

    #[test]
    fn a_sphere_about_the_centroid() {
        let square = |a: f64, b: f64| 2.0 * ((a - 1e-3).powi(2) + (b - 2e-3).powi(2));
        assert_gaps(&gaps(&crown(None, None)), square);
    }

    #[test]
    fn a_cylinder_about_a_line_through_a_point_off_the_flank() {
        let h = 0.5f64.sqrt();
        // At the corner (0, 0), lifted off the flank; the axis tilted out of its plane.
        let centre = [0.3, 0.3 - 0.1 * h, 0.3 - 0.1 * h];
        let found = gaps(&crown(Some([0.8, -0.6 * h, -0.6 * h]), Some(centre)));
        assert_gaps(&found, |_, b| 2.0 * b * b);
    }

    #[test]
    fn an_axis_along_the_normal_is_no_axis() {
        let mut pairs = pairs();
        let along_normal = crown(Some([0.0, 0.75, 0.7]), None);
        assert_eq!(add_crown(&mut pairs, &along_normal), Err(AcrossFlank));
    }
}
