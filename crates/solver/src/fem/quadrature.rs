//! Quadrature on the reference tetrahedron (weights sum to its volume, 1/6), and shape functions
//! tabulated at the points.
//!
//! Rules: 1 point, degree 1; 4 points, degree 2 (Hammer and Stroud 1956); 14 points, degree 5
//! (Walkington 2000); 24 points, degree 6 (Keast 1986). All weights are positive.

/// Points and weights of a rule.
#[derive(Debug, Clone)]
pub struct Rule {
    /// Coordinates in the reference tetrahedron.
    pub points: Vec<[f64; 3]>,
    /// Weights; they sum to its volume.
    pub weights: Vec<f64>,
}

impl Rule {
    /// One point, degree 1.
    pub fn degree_1() -> Self {
        Self::of(&[(&[[0.25; 4]], 1.0 / 6.0)])
    }

    /// Four points, degree 2.
    pub fn degree_2() -> Self {
        Self::of(&[(&corner_orbit((5.0 - 5.0_f64.sqrt()) / 20.0), 1.0 / 24.0)])
    }

    /// Fourteen points, degree 5.
    pub fn degree_5() -> Self {
        Self::of(&[
            (
                &corner_orbit(0.310_885_919_263_300_6),
                0.112_687_925_718_015_85 / 6.0,
            ),
            (
                &corner_orbit(0.092_735_250_310_891_23),
                0.073_493_043_116_361_95 / 6.0,
            ),
            (
                &edge_orbit(0.045_503_704_125_649_65),
                0.042_546_020_777_081_47 / 6.0,
            ),
        ])
    }

    /// Twenty-four points, degree 6.
    pub fn degree_6() -> Self {
        Self::of(&[
            (
                &corner_orbit(0.214_602_871_259_151_68),
                0.006_653_791_709_694_646,
            ),
            (
                &corner_orbit(0.040_673_958_534_611_34),
                0.001_679_535_175_886_776_2,
            ),
            (
                &corner_orbit(0.322_337_890_142_275_65),
                0.009_226_196_923_942_398,
            ),
            (
                &pair_orbit(0.063_661_001_875_017_53, 0.269_672_331_458_315_9),
                0.008_035_714_285_714_282,
            ),
        ])
    }

    /// Points without weights, to evaluate at.
    pub fn at(points: &[[f64; 3]]) -> Self {
        Self {
            points: points.to_vec(),
            weights: vec![0.0; points.len()],
        }
    }

    /// Orbits of barycentric points, each with the weight of one of its points.
    fn of(orbits: &[(&[[f64; 4]], f64)]) -> Self {
        let all = || {
            orbits
                .iter()
                .flat_map(|(points, w)| points.iter().map(move |l| (l, *w)))
        };
        Self {
            points: all().map(|(l, _)| [l[1], l[2], l[3]]).collect(),
            weights: all().map(|(_, w)| w).collect(),
        }
    }
}
/// Three barycentric coordinates `a`, the fourth the rest.
fn corner_orbit(a: f64) -> Vec<[f64; 4]> {
    (0..4)
        .map(|corner| {
            let mut l = [a; 4];
            l[corner] = 1.0 - 3.0 * a;
            l
        })
        .collect()
}

/// Two coordinates `a`, two 1/2 - a.
fn edge_orbit(a: f64) -> Vec<[f64; 4]> {
    pairs()
        .map(|(i, j)| {
            let mut l = [a; 4];
            (l[i], l[j]) = (0.5 - a, 0.5 - a);
            l
        })
        .collect()
}

/// Two coordinates `a`, one `b`, one the rest.
fn pair_orbit(a: f64, b: f64) -> Vec<[f64; 4]> {
    let c = 1.0 - 2.0 * a - b;
    pairs()
        .flat_map(|(i, j)| [(i, j), (j, i)])
        .map(|(i, j)| {
            let mut l = [a; 4];
            (l[i], l[j]) = (b, c);
            l
        })
        .collect()
}

fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)))
}

/// Shape functions and their reference derivatives at the points of a rule.
#[derive(Debug, Clone)]
pub struct Table<const N: usize> {
    /// Weight of each point.
    pub weights: Vec<f64>,
    /// Shape functions at each point.
    pub shapes: Vec<[f64; N]>,
    /// Their gradients at each point, in the reference tetrahedron.
    pub gradients: Vec<[[f64; 3]; N]>,
}

impl<const N: usize> Table<N> {
    /// Of shape functions and gradients at the points of a rule.
    pub fn new(
        rule: &Rule,
        shape: impl Fn([f64; 3]) -> [f64; N],
        gradient: impl Fn([f64; 3]) -> [[f64; 3]; N],
    ) -> Self {
        Self {
            weights: rule.weights.clone(),
            shapes: rule.points.iter().map(|&p| shape(p)).collect(),
            gradients: rule.points.iter().map(|&p| gradient(p)).collect(),
        }
    }
}

/// What one element type needs: tables of its shape functions.
#[derive(Debug, Clone)]
pub struct Tables<const N: usize> {
    /// At the centroid.
    pub centroid: Table<N>,
    /// At the element's own nodes (weights are zero).
    pub nodes: Table<N>,
    /// Exact for the stiffness of elements with straight edges.
    pub stiffness_straight: Table<N>,
    /// Exact for the internal force of a uniform stress in curved elements (so that they pass the
    /// patch test) and for the geometric stiffness of straight ones.
    pub stiffness_curved: Table<N>,
    /// Exact for the mass of straight elements, and for the volume of curved ones.
    pub mass: Table<N>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{tet4, tet10};
    use crate::mesh::TET_EDGES;
    use dovetail_numerics::space::middle;

    fn factorial(n: i32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    /// Largest error over the monomials of total degree `degree`; exact: i! j! k! / (i+j+k+3)!.
    fn monomial_error(rule: &Rule, degree: i32) -> f64 {
        let mut worst: f64 = 0.0;
        for i in 0..=degree {
            for j in 0..=degree - i {
                let k = degree - i - j;
                let exact = factorial(i) * factorial(j) * factorial(k) / factorial(degree + 3);
                let sum: f64 = rule
                    .points
                    .iter()
                    .zip(&rule.weights)
                    .map(|(p, w)| w * p[0].powi(i) * p[1].powi(j) * p[2].powi(k))
                    .sum();
                worst = worst.max((sum - exact).abs());
            }
        }
        worst
    }

    #[test]
    fn rules_are_exact_up_to_their_degree_and_not_beyond() {
        let rules = [
            Rule::degree_1(),
            Rule::degree_2(),
            Rule::degree_5(),
            Rule::degree_6(),
        ];
        for (rule, exact) in rules.iter().zip([1, 2, 5, 6]) {
            assert!(rule.weights.iter().all(|&w| w > 0.0));
            for degree in 0..=exact {
                let error = monomial_error(rule, degree);
                assert!(error < 1e-16, "rule {exact}, degree {degree}: {error:e}");
            }
            assert!(monomial_error(rule, exact + 1) > 1e-7);
        }
    }

    fn shape_functions_are_sound<const N: usize>(
        reference: [[f64; 3]; N],
        shape: fn([f64; 3]) -> [f64; N],
        gradient: fn([f64; 3]) -> [[f64; 3]; N],
    ) {
        for (a, &node) in reference.iter().enumerate() {
            for (b, value) in shape(node).into_iter().enumerate() {
                assert!((value - f64::from(a == b)).abs() < 1e-15);
            }
        }
        let p = [0.17, 0.31, 0.23];
        assert!((shape(p).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let g = gradient(p);
        for k in 0..3 {
            assert!(g.iter().map(|g| g[k]).sum::<f64>().abs() < 1e-14);
            // The map interpolates its own coordinate.
            let x: f64 = shape(p).iter().zip(&reference).map(|(n, r)| n * r[k]).sum();
            assert!((x - p[k]).abs() < 1e-15);
            let h = 1e-6;
            let (mut high, mut low) = (p, p);
            high[k] += h;
            low[k] -= h;
            let differences = shape(high).into_iter().zip(shape(low));
            for (g, (high, low)) in g.iter().zip(differences) {
                assert!((g[k] - (high - low) / (2.0 * h)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn linear_shape_functions_are_a_partition_of_unity_and_interpolate() {
        shape_functions_are_sound(tet4::REFERENCE, tet4::shape, tet4::gradient);
    }

    #[test]
    fn quadratic_shape_functions_are_a_partition_of_unity_and_interpolate() {
        shape_functions_are_sound(tet10::REFERENCE, tet10::shape, tet10::gradient);
    }

    #[test]
    fn quadratic_nodes_are_in_the_order_of_gmsh() {
        // As Gmsh's reference manual draws it: the last two edges end in node 3.
        assert_eq!(TET_EDGES, [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]]);
        for (edge, ends) in TET_EDGES.iter().enumerate() {
            let [a, b] = ends.map(|corner| tet10::REFERENCE[corner]);
            assert_eq!(tet10::REFERENCE[4 + edge], middle(a, b));
        }
    }
}
