//! Points of a facet and integrals over it.

use super::element::facet_corners;
use super::interpolation::facet_functions;
use super::quadrature;
use dovetail_numerics::space::{add_scaled, cross, dot, norm};

/// Point of a facet of 3, 4, 6 or 8 nodes, which may be curved.
#[derive(Debug, Clone, PartialEq)]
pub struct FacetPoint {
    /// Position, m.
    pub position_m: [f64; 3],
    /// Derivatives of the position by the two reference coordinates.
    pub tangents_m: [[f64; 3]; 2],
    /// Cross product of the tangents: the normal times the area of a unit of the reference
    /// coordinates. It points to the side from which the nodes run counter-clockwise.
    pub normal_m2: [f64; 3],
    /// Shape functions of the nodes.
    pub shapes: Vec<f64>,
}

/// Point of a facet at two reference coordinates.
pub fn evaluate(coords_m: &[[f64; 3]], point: [f64; 2]) -> FacetPoint {
    let functions = facet_functions(coords_m.len(), point);
    let (mut position, mut tangents) = ([0.0; 3], [[0.0; 3]; 2]);
    for (x, n) in coords_m.iter().zip(&functions) {
        for k in 0..3 {
            position[k] += n.value * x[k];
            tangents[0][k] += n.gradient[0] * x[k];
            tangents[1][k] += n.gradient[1] * x[k];
        }
    }
    FacetPoint {
        position_m: position,
        tangents_m: tangents,
        normal_m2: cross(tangents[0], tangents[1]),
        shapes: functions.iter().map(|n| n.value).collect(),
    }
}

/// Points of the rule of quadrature of a facet, with their weights.
pub fn points(coords_m: &[[f64; 3]]) -> impl Iterator<Item = (FacetPoint, f64)> {
    let rule = quadrature::facet(facet_corners(coords_m.len())).into_iter();
    rule.map(|(point, weight)| (evaluate(coords_m, point), weight))
}

/// Mean elongation of a facet along a direction, as weights of the displacements of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Elongation {
    /// Area of the facet, m2.
    pub area_m2: f64,
    /// Vector of each node, m: the strain, integrated over the facet, is the sum of their products
    /// with the displacements, over m.
    pub weights_m: Vec<[f64; 3]>,
    /// Largest sine of the angle between the direction and the facet.
    pub largest_sine: f64,
}

/// Elongation of a facet along a direction of unit length, which is projected on the facet at each
/// point: int t . (grad_s u) t dA, with the unit tangent t and the gradient in the surface. It is
/// exact for the displacements that the facet interpolates.
pub fn elongation(coords_m: &[[f64; 3]], direction: [f64; 3]) -> Elongation {
    let mut elongation = Elongation {
        area_m2: 0.0,
        weights_m: vec![[0.0; 3]; coords_m.len()],
        largest_sine: 0.0,
    };
    for (reference, weight) in quadrature::facet(facet_corners(coords_m.len())) {
        let point = evaluate(coords_m, reference);
        let area = norm(point.normal_m2);
        let sine = dot(direction, point.normal_m2) / area;
        let mut tangent = direction;
        add_scaled(&mut tangent, -sine / area, point.normal_m2);
        let length = norm(tangent);
        elongation.area_m2 += weight * area;
        elongation.largest_sine = elongation.largest_sine.max(sine.abs());
        if length == 0.0 {
            continue;
        }
        let tangent = tangent.map(|t| t / length);
        // Components of the tangent along the two derivatives of the position.
        let [a, b] = point.tangents_m;
        let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
        let (ta, tb) = (dot(tangent, a), dot(tangent, b));
        let determinant = aa * bb - ab * ab;
        let along = [
            (bb * ta - ab * tb) / determinant,
            (aa * tb - ab * ta) / determinant,
        ];
        let functions = facet_functions(coords_m.len(), reference);
        for (sum, n) in elongation.weights_m.iter_mut().zip(&functions) {
            let slope = along[0] * n.gradient[0] + along[1] * n.gradient[1];
            add_scaled(sum, weight * area * slope, tangent);
        }
    }
    elongation
}

/// Part of a facet that belongs to a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Integral of the node's shape function, m2.
    pub area_m2: f64,
    /// Integral of the node's shape function times the unit normal, m2. It points to the side from
    /// which the nodes run counter-clockwise.
    pub normal_m2: [f64; 3],
}

/// Parts of a facet that belong to its nodes.
pub fn shares(coords_m: &[[f64; 3]]) -> Vec<Share> {
    let none = Share {
        area_m2: 0.0,
        normal_m2: [0.0; 3],
    };
    let mut shares = vec![none; coords_m.len()];
    for (point, weight) in points(coords_m) {
        let area = norm(point.normal_m2);
        for (share, n) in shares.iter_mut().zip(&point.shapes) {
            share.area_m2 += weight * n * area;
            for (sum, c) in share.normal_m2.iter_mut().zip(point.normal_m2) {
                *sum += weight * n * c;
            }
        }
    }
    shares
}

/// Integrals of the products of the shape functions of a facet two by two, row by row, m2.
pub fn products(coords_m: &[[f64; 3]]) -> Vec<f64> {
    let nodes = coords_m.len();
    let mut products = vec![0.0; nodes * nodes];
    for (point, weight) in points(coords_m) {
        let area = weight * norm(point.normal_m2);
        for (row, a) in products.chunks_exact_mut(nodes).zip(&point.shapes) {
            for (product, b) in row.iter_mut().zip(&point.shapes) {
                *product += a * b * area;
            }
        }
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of v_a v_b P_ab: the integral of the square of a field with these values at the nodes.
    fn square(coords_m: &[[f64; 3]], values: &[f64]) -> f64 {
        let products = products(coords_m);
        let rows = products.chunks_exact(values.len()).zip(values);
        rows.map(|(row, a)| row.iter().zip(values).map(|(p, b)| a * b * p).sum::<f64>())
            .sum()
    }

    /// The field r^2 has the values of its shape functions, and its square r^4 the mean 1/5 over a
    /// straight quadrilateral of any shape: its determinant is linear in r and s, and the odd parts
    /// vanish. Over a triangle the mean is 1/15.
    #[test]
    fn products_of_shape_functions_are_exact_where_edges_are_straight() {
        let corners = [[0.0, 0.0], [3.0, 0.2], [2.5, 2.0], [0.4, 1.1]];
        let straight = |corners: &[[f64; 2]]| -> Vec<[f64; 3]> {
            let next = corners.iter().cycle().skip(1);
            let middles = corners.iter().zip(next);
            let middles = middles.map(|(a, b)| [0, 1].map(|k| 0.5 * (a[k] + b[k])));
            let all = corners.iter().copied().chain(middles);
            // In the plane z = 0.75 x, on which areas are 5/4 of those seen along z.
            all.map(|[x, y]| [x, y, 0.75 * x]).collect()
        };
        let area = |corners: &[[f64; 2]]| {
            let next = corners.iter().cycle().skip(1);
            let twice = corners.iter().zip(next);
            0.625 * twice.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
        };
        let quadrilateral = square(
            &straight(&corners),
            &[1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0],
        );
        assert!((quadrilateral / (area(&corners) / 5.0) - 1.0).abs() < 1e-13);
        let triangle = square(&straight(&corners[..3]), &[0.0, 1.0, 0.0, 0.25, 0.25, 0.0]);
        assert!((triangle / (area(&corners[..3]) / 15.0) - 1.0).abs() < 1e-13);
    }

    /// Facets of every kind in a plane that lies obliquely, quadratic ones with edges that are
    /// curved in the plane and an uneven interior.
    fn oblique() -> Vec<Vec<[f64; 3]>> {
        let [a, b] = [[0.8, 0.6, 0.0], [-0.36, 0.48, 0.8]];
        let on_plane = |[x, y]: [f64; 2]| [0, 1, 2].map(|k| x * a[k] + y * b[k] + 0.1);
        let corners = [[0.0, 0.0], [3.0, 0.2], [2.5, 2.0], [0.4, 1.1]];
        let of = |n: usize| {
            let corners = &corners[..n];
            let next = corners.iter().cycle().skip(1);
            let middles = corners.iter().zip(next);
            let middles = middles.map(|(p, q)| [0.5 * (p[0] + q[0]) + 0.1, 0.5 * (p[1] + q[1])]);
            let all: Vec<[f64; 2]> = corners.iter().copied().chain(middles).collect();
            [all[..n].to_vec(), all]
        };
        let facets = [3, 4].into_iter().flat_map(of);
        facets
            .map(|facet| facet.into_iter().map(on_plane).collect())
            .collect()
    }

    fn strain(found: &Elongation, displacements_m: &[[f64; 3]]) -> f64 {
        let works = found.weights_m.iter().zip(displacements_m);
        works.map(|(w, u)| dot(*w, *u)).sum::<f64>() / found.area_m2
    }

    /// Under u = G x the strain along the unit tangent t is t . G t, for the direction of the plane
    /// and for one that leaves it and is projected.
    #[test]
    fn elongation_of_a_plane_facet_is_that_of_its_displacement_gradient() {
        let gradient = [[1e-3, 2e-4, -3e-4], [5e-4, -2e-3, 7e-4], [0.0, 4e-4, 3e-3]];
        let moved = |x: &[f64; 3]| gradient.map(|row| dot(row, *x));
        for facet in oblique() {
            let displacements: Vec<[f64; 3]> = facet.iter().map(moved).collect();
            let tangent = [0.8, 0.6, 0.0];
            let expected = dot(tangent, gradient.map(|row| dot(row, tangent)));
            let normal = [0.48, -0.64, 0.6];
            for sine in [0.0, 0.4_f64] {
                let cosine = (1.0 - sine * sine).sqrt();
                let direction = [0, 1, 2].map(|k| cosine * tangent[k] + sine * normal[k]);
                let found = elongation(&facet, direction);
                let error = strain(&found, &displacements) / expected - 1.0;
                assert!(error.abs() < 1e-12, "{} nodes: {error:e}", facet.len());
                assert!((found.largest_sine - sine).abs() < 1e-12);
            }
        }
    }

    /// A cylinder of radius r that grows by w has the strain w / r around and none along its axis,
    /// and a small rotation strains nothing, on facets that are curved.
    #[test]
    fn elongation_of_a_curved_facet_follows_the_surface() {
        let at = |angle: f64, z: f64| [2.0 * angle.cos(), 2.0 * angle.sin(), z];
        let facet = [
            at(0.0, 0.0),
            at(0.1, 0.0),
            at(0.1, 0.3),
            at(0.0, 0.3),
            at(0.05, 0.0),
            at(0.1, 0.15),
            at(0.05, 0.3),
            at(0.0, 0.15),
        ];
        let around = elongation(&facet, [0.0, 1.0, 0.0]);
        let along = elongation(&facet, [0.0, 0.0, 1.0]);
        let grown = facet.map(|[x, y, _]| [1e-3 * x, 1e-3 * y, 0.0]);
        assert!((strain(&around, &grown) / 1e-3 - 1.0).abs() < 1e-4);
        assert!(strain(&along, &grown).abs() < 1e-12);
        let turned = facet.map(|x| cross([1e-3, -2e-3, 3e-3], x));
        for found in [around, along] {
            assert!(strain(&found, &turned).abs() < 1e-17, "{found:?}");
        }
    }
}
