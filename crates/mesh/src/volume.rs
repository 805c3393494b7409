//! Volume of elements whose edges may be curved.

use dovetail_numerics::space::{add_scaled, cross, dot};

use super::interpolation::element_functions;
use super::quadrature::{Rule, triangle};
use super::{ElementType, Shape};

/// Reference gradients of the shape functions at the points of a rule, with its weights.
type Table = Vec<(Vec<[f64; 3]>, f64)>;

/// Sum of the volumes of elements, each with the positions of its nodes, m.
pub fn volume_m3(elements: impl Iterator<Item = (ElementType, Vec<[f64; 3]>)>) -> f64 {
    let mut tables: Vec<(ElementType, Table)> = Vec::new();
    let mut sum = 0.0;
    for (element, nodes_m) in elements {
        let at = tables.iter().position(|(known, _)| *known == element);
        let at = at.unwrap_or_else(|| {
            tables.push((element, table(element)));
            tables.len() - 1
        });
        for (gradients, weight) in &tables[at].1 {
            let mut jacobian = [[0.0; 3]; 3];
            for (gradient, x) in gradients.iter().zip(&nodes_m) {
                for (row, by) in jacobian.iter_mut().zip(gradient) {
                    add_scaled(row, *by, *x);
                }
            }
            let [a, b, c] = jacobian;
            sum += weight * dot(a, cross(b, c));
        }
    }
    sum
}

/// Table of a rule that integrates the Jacobian determinant of any element of this type exactly.
fn table(element: ElementType) -> Table {
    let rule = match element.shape {
        Shape::Tetrahedron => Rule::degree_5(),
        Shape::Wedge => Rule::wedge(&triangle(6), 4),
        Shape::Pyramid | Shape::Hexahedron => Rule::cube(4),
    };
    let at = |point: &[f64; 3]| {
        let functions = element_functions(element, *point);
        functions.into_iter().map(|f| f.gradient).collect()
    };
    let gradients = rule.points.iter().map(at);
    gradients.zip(rule.weights).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolation::reference_nodes;

    #[test]
    fn volumes_are_those_of_straight_and_curved_elements() {
        // The height z becomes z (1 + 0.3 x^2) + 0.2 z^2: the integral of 1 + 0.3 x^2 + 0.4 z.
        for (element, straight, curved) in [
            (ElementType::TET4, 1.0 / 6.0, None),
            (ElementType::TET10, 1.0 / 6.0, None),
            (ElementType::WEDGE6, 1.0, None),
            (ElementType::HEX8, 8.0, None),
            (ElementType::HEX20, 8.0, Some(8.8)),
        ] {
            let nodes = reference_nodes(element);
            let found = volume_m3([(element, nodes.clone())].into_iter());
            assert!((found - straight).abs() < 1e-13, "{found}");
            let bulged = nodes.iter().map(|&[x, y, z]| {
                let z = z * (1.0 + 0.3 * x * x) + 0.2 * z * z;
                [x, y, z]
            });
            let found = volume_m3([(element, bulged.collect())].into_iter());
            if let Some(curved) = curved {
                assert!((found - curved).abs() < 1e-13, "{found}");
            }
        }
        // The derivative of x + 0.2 x^2 is 1 + 0.4 x; the mean of x is 1/4.
        let nodes = reference_nodes(ElementType::TET10).into_iter();
        let nodes = nodes.map(|[x, y, z]| [x + 0.2 * x * x, y, z]).collect();
        let found = volume_m3([(ElementType::TET10, nodes)].into_iter());
        assert!((found - 1.1 / 6.0).abs() < 1e-15, "{found}");
    }
}
