//! Vectors in space: three components.

/// Point, direction or force.
pub type Vector = [f64; 3];

/// Difference a - b.
pub fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Inner product.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Euclidean length.
pub fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// Length of the longest of some vectors, with the sign of its largest component; 0 where there is
/// none.
pub fn signed_longest<'a>(vectors: impl IntoIterator<Item = &'a Vector>) -> f64 {
    let vectors = vectors.into_iter();
    let longest = vectors.max_by(|a, b| norm(**a).total_cmp(&norm(**b)));
    longest.map_or(0.0, |u| {
        let component = u.iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        norm(*u).copysign(component.copied().unwrap_or(1.0))
    })
}

/// Distance of two points.
pub fn distance(a: Vector, b: Vector) -> f64 {
    norm(sub(a, b))
}

/// Point halfway between two points.
pub fn middle(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]))
}

/// Product s a.
pub fn scaled(a: Vector, s: f64) -> Vector {
    a.map(|c| c * s)
}

/// Computes sum += s a.
pub fn add_scaled(sum: &mut Vector, s: f64, a: Vector) {
    for (sum, c) in sum.iter_mut().zip(a) {
        *sum += s * c;
    }
}

/// Difference of the largest and the least of some numbers.
pub fn extent(values: impl Iterator<Item = f64>) -> f64 {
    let empty = (f64::INFINITY, f64::NEG_INFINITY);
    let (least, most) = values.fold(empty, |(least, most), x| (least.min(x), most.max(x)));
    most - least
}

/// Diagonal of the box around some points, along the axes.
pub fn diagonal(points: &[Vector]) -> f64 {
    norm([0, 1, 2].map(|axis| extent(points.iter().map(|p| p[axis]))))
}

/// Unit vector along a vector; `None` for a zero one.
pub fn unit(a: Vector) -> Option<Vector> {
    let length = norm(a);
    (length > 0.0).then(|| scaled(a, 1.0 / length))
}

/// Unit vector along a vector of any size, as a user gives it; `None` for a zero one. It is scaled
/// first: squares of very large or very small components would leave the range of f64.
pub fn direction(v: Vector) -> Option<Vector> {
    let largest = v.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    if largest == 0.0 {
        return None;
    }
    let scaled = v.map(|c| c / largest);
    let length = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
    Some(scaled.map(|c| c / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_of_any_size_become_unit_vectors() {
        for scale in [1e-300, 1e-160, 1.0, 1e160, 1e300] {
            let u = direction([3.0 * scale, 0.0, -4.0 * scale]).unwrap();
            assert!(
                (u[0] - 0.6).abs() < 1e-15 && u[1] == 0.0 && (u[2] + 0.8).abs() < 1e-15,
                "{u:?}"
            );
        }
        assert_eq!(direction([0.0, -0.0, 0.0]), None);
    }

    #[test]
    fn products_lengths_and_directions() {
        let (a, b) = ([1.0, 2.0, 3.0], [-2.0, 0.5, 4.0]);
        assert_eq!(dot(a, b), 11.0);
        // Right-handed, and orthogonal to both.
        assert_eq!(cross([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        let normal = cross(a, b);
        assert_eq!(normal, [6.5, -10.0, 4.5]);
        assert_eq!([dot(normal, a), dot(normal, b)], [0.0; 2]);
        assert_eq!(distance([1.0, 2.0, 2.0], [4.0, 6.0, 14.0]), 13.0);
        assert_eq!(middle(a, b), [-0.5, 1.25, 3.5]);
        assert_eq!(unit([0.0, -4.0, 0.0]), Some([0.0, -1.0, 0.0]));
        assert_eq!(unit([0.0; 3]), None);
    }
}
