//! Quadrature on the reference elements and facets of [`interpolation`](super::interpolation).
//!
//! Rules on the tetrahedron (weights sum to its volume, 1/6): 1 point, degree 1; 4 points, degree 2
//! (Hammer and Stroud 1956); 14 points, degree 5 (Walkington 2000); 24 points, degree 6
//! (Keast 1986). On the cube (volume 8), for hexahedra and for pyramids as collapsed cubes: n x n x
//! n points of Gauss and Legendre, degree 2 n - 1 in each direction. On the wedge (volume 1): rules
//! of the triangle, 3, 6, 7 and 12 points of degrees 2, 4, 5 and 6 (Dunavant, Int. J. Numer. Meth.
//! Engng 21 (1985) 1129-1148), times n points along it. All weights are positive.

/// Points and weights of a rule.
#[derive(Debug, Clone)]
pub struct Rule {
    /// Coordinates in the reference element.
    pub points: Vec<[f64; 3]>,
    /// Weights; they sum to the volume of the reference element.
    pub weights: Vec<f64>,
}

impl Rule {
    /// One point, degree 1.
    pub fn degree_1() -> Self {
        Self::from_orbits(&[(vec![[0.25; 4]], 1.0 / 6.0)])
    }

    /// Four points, degree 2.
    pub fn degree_2() -> Self {
        Self::from_orbits(&[corner_orbit((5.0 - 5.0_f64.sqrt()) / 20.0, 1.0 / 24.0)])
    }

    /// Fourteen points, degree 5.
    pub fn degree_5() -> Self {
        Self::from_orbits(&[
            corner_orbit(0.310_885_919_263_300_6, 0.112_687_925_718_015_85 / 6.0),
            corner_orbit(0.092_735_250_310_891_23, 0.073_493_043_116_361_95 / 6.0),
            edge_orbit(0.045_503_704_125_649_65, 0.042_546_020_777_081_47 / 6.0),
        ])
    }

    /// Twenty-four points, degree 6.
    pub fn degree_6() -> Self {
        let (a, b) = (0.063_661_001_875_017_53, 0.269_672_331_458_315_9);
        Self::from_orbits(&[
            corner_orbit(0.214_602_871_259_151_68, 0.006_653_791_709_694_646),
            corner_orbit(0.040_673_958_534_611_34, 0.001_679_535_175_886_776_2),
            corner_orbit(0.322_337_890_142_275_65, 0.009_226_196_923_942_398),
            pair_orbit(a, b, 0.008_035_714_285_714_282),
        ])
    }

    /// `n` points in each direction of the cube, 1 to 4.
    pub fn cube(n: usize) -> Self {
        let line = gauss_line(n);
        let mut rule = Self::unweighted(&[]);
        for &(x, wx) in &line {
            for &(y, wy) in &line {
                for &(z, wz) in &line {
                    rule.points.push([x, y, z]);
                    rule.weights.push(wx * wy * wz);
                }
            }
        }
        rule
    }

    /// A rule of the triangle times `n` points along the wedge.
    pub fn wedge(triangle: &[([f64; 2], f64)], n: usize) -> Self {
        let mut rule = Self::unweighted(&[]);
        for &([x, y], w) in triangle {
            for (z, wz) in gauss_line(n) {
                rule.points.push([x, y, z]);
                rule.weights.push(w * wz);
            }
        }
        rule
    }

    /// Rule of points without weights, for evaluation.
    pub fn unweighted(points: &[[f64; 3]]) -> Self {
        Self {
            points: points.to_vec(),
            weights: vec![0.0; points.len()],
        }
    }

    /// Rule of the points of orbits.
    fn from_orbits(orbits: &[PointOrbit]) -> Self {
        let weighted = |(points, weight): &PointOrbit| {
            let points = points.iter().map(|l| ([l[1], l[2], l[3]], *weight));
            points.collect::<Vec<_>>()
        };
        let (points, weights) = orbits.iter().flat_map(weighted).unzip();
        Self { points, weights }
    }
}

/// Barycentric points that permutations of the corners take into one another, and the weight of
/// each of them.
type PointOrbit = (Vec<[f64; 4]>, f64);

/// Orbit with three barycentric coordinates `a`.
fn corner_orbit(a: f64, weight: f64) -> PointOrbit {
    let point = |corner: usize| {
        let mut l = [a; 4];
        l[corner] = 1.0 - 3.0 * a;
        l
    };
    ((0..4).map(point).collect(), weight)
}

/// Orbit with two coordinates `a`, and two 1/2 - a.
fn edge_orbit(a: f64, weight: f64) -> PointOrbit {
    let point = |(i, j)| replace_two([a; 4], (i, 0.5 - a), (j, 0.5 - a));
    (pairs().map(point).collect(), weight)
}

/// Orbit with two coordinates `a`, one `b`, and the fourth as the rest.
fn pair_orbit(a: f64, b: f64, weight: f64) -> PointOrbit {
    let c = 1.0 - 2.0 * a - b;
    let both = pairs().flat_map(|(i, j)| [(i, j), (j, i)]);
    let point = |(i, j)| replace_two([a; 4], (i, b), (j, c));
    (both.map(point).collect(), weight)
}

/// Point with two coordinates replaced.
fn replace_two(mut l: [f64; 4], (i, b): (usize, f64), (j, c): (usize, f64)) -> [f64; 4] {
    (l[i], l[j]) = (b, c);
    l
}

fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)))
}

/// Gauss-Legendre rule on -1 to 1: 1 to 4 points with their weights, exact to degree 2 n - 1.
pub fn gauss_line(n: usize) -> Vec<(f64, f64)> {
    let both = |x: f64, w: f64| [(-x, w), (x, w)];
    match n {
        1 => vec![(0.0, 2.0)],
        2 => both(1.0 / 3.0_f64.sqrt(), 1.0).to_vec(),
        3 => {
            let mut points = both(0.6_f64.sqrt(), 5.0 / 9.0).to_vec();
            points.insert(1, (0.0, 8.0 / 9.0));
            points
        }
        4 => {
            let (root, wide) = (2.0 / 7.0 * 1.2_f64.sqrt(), 30.0_f64.sqrt() / 36.0);
            let inner = both((3.0 / 7.0 - root).sqrt(), 0.5 + wide);
            let outer = both((3.0 / 7.0 + root).sqrt(), 0.5 - wide);
            vec![outer[0], inner[0], inner[1], outer[1]]
        }
        _ => unreachable!("one to four points are tabulated"),
    }
}

/// Rule of the reference triangle (area 1/2) that is exact to this degree: 2, 4, 5 or 6.
pub fn triangle(degree: usize) -> Vec<([f64; 2], f64)> {
    // Weights for an area of 1.
    let mut points: Vec<([f64; 3], f64)> = Vec::new();
    let mut three = |a: f64, w: f64| {
        let b = 1.0 - 2.0 * a;
        points.extend([[b, a, a], [a, b, a], [a, a, b]].map(|l| (l, w)));
    };
    match degree {
        2 => three(1.0 / 6.0, 1.0 / 3.0),
        4 => {
            three(0.445_948_490_915_964_9, 0.223_381_589_678_011_47);
            three(0.091_576_213_509_770_74, 0.109_951_743_655_321_87);
        }
        5 => {
            // (6 -+ sqrt 15) / 21, (155 -+ sqrt 15) / 1200
            let root = 15.0_f64.sqrt();
            three((6.0 - root) / 21.0, (155.0 - root) / 1200.0);
            three((6.0 + root) / 21.0, (155.0 + root) / 1200.0);
            points.push(([1.0 / 3.0; 3], 9.0 / 40.0));
        }
        6 => {
            three(0.249_286_745_170_910_42, 0.116_786_275_726_379_37);
            three(0.063_089_014_491_502_23, 0.050_844_906_370_206_82);
            let (a, b) = (0.310_352_451_033_784_4, 0.053_145_049_844_816_95);
            let c = 1.0 - a - b;
            let permutations = [
                [a, b, c],
                [b, c, a],
                [c, a, b],
                [b, a, c],
                [a, c, b],
                [c, b, a],
            ];
            points.extend(permutations.map(|l| (l, 0.082_851_075_618_373_58)));
        }
        _ => unreachable!("degrees 2, 4, 5 and 6 are tabulated"),
    }
    let points = points.into_iter();
    points.map(|(l, w)| ([l[1], l[2]], 0.5 * w)).collect()
}

/// Rule on a reference facet: to degree 5 on the triangle, to degree 5 in each direction on the
/// quadrilateral.
pub fn facet(corners: usize) -> Vec<([f64; 2], f64)> {
    if corners == 3 {
        return triangle(5);
    }
    let line = gauss_line(3);
    let across = |&(x, wx): &(f64, f64)| line.iter().map(move |&(y, wy)| ([x, y], wx * wy));
    line.iter().flat_map(across).collect()
}

#[cfg(test)]
mod tests {
    use super::super::element::Shape;
    use super::*;

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

    /// int x^i y^j z^k over the cube and over the wedge.
    fn exact(shape: Shape, [i, j, k]: [i32; 3]) -> f64 {
        let line = |n: i32| {
            if n % 2 == 0 {
                2.0 / f64::from(n + 1)
            } else {
                0.0
            }
        };
        match shape {
            Shape::Wedge => factorial(i) * factorial(j) / factorial(i + j + 2) * line(k),
            _ => line(i) * line(j) * line(k),
        }
    }

    fn error(rule: &Rule, shape: Shape, powers: [i32; 3]) -> f64 {
        let points = rule.points.iter().zip(&rule.weights);
        let power = |p: &[f64; 3]| (0..3).map(|k| p[k].powi(powers[k])).product::<f64>();
        let sum: f64 = points.map(|(p, w)| w * power(p)).sum();
        (sum - exact(shape, powers)).abs()
    }

    #[test]
    fn rules_of_the_cube_are_exact_to_their_degree_in_each_direction() {
        for n in 1..=4 {
            let rule = Rule::cube(n);
            assert!(rule.weights.iter().all(|&w| w > 0.0));
            let most = 2 * n as i32 - 1;
            for i in 0..=most {
                for j in 0..=most {
                    for k in 0..=most {
                        assert!(error(&rule, Shape::Hexahedron, [i, j, k]) < 1e-14);
                    }
                }
            }
            for k in 0..3 {
                let mut beyond = [0; 3];
                beyond[k] = most + 1;
                assert!(error(&rule, Shape::Hexahedron, beyond) > 1e-3);
            }
        }
    }

    #[test]
    fn rules_of_the_wedge_are_exact_to_the_degrees_of_their_parts() {
        for degree in [2, 4, 5, 6] {
            let rule = Rule::wedge(&triangle(degree), 3);
            assert!(rule.weights.iter().all(|&w| w > 0.0));
            let all = degree as i32;
            for i in 0..=all {
                for j in 0..=all - i {
                    for k in 0..=5 {
                        assert!(error(&rule, Shape::Wedge, [i, j, k]) < 1e-15, "{degree}");
                    }
                }
            }
            let beyond = (0..=all + 1).map(|i| error(&rule, Shape::Wedge, [i, all + 1 - i, 0]));
            assert!(beyond.fold(0.0, f64::max) > 1e-6, "{degree}");
        }
    }
}
