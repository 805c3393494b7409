//! Points near a point, by the cells of a grid.

use std::collections::HashMap;

use dovetail_numerics::space::distance;

/// Some of a list of points, sorted into cells.
pub(crate) struct Near<'a> {
    points: &'a [[f64; 3]],
    size: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Near<'a> {
    /// Sorts the points with these indices into cells that are ten times as wide as the largest
    /// radius within which points will be asked for. Points that are not finite are left out.
    pub fn new(
        points: &'a [[f64; 3]],
        which: impl IntoIterator<Item = u32>,
        largest_radius: f64,
    ) -> Self {
        let size = (10.0 * largest_radius).max(f64::MIN_POSITIVE);
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for i in which {
            let at = points[i as usize];
            if at.iter().all(|x| x.is_finite()) {
                let cell = at.map(|x| (x / size).floor() as i64);
                cells.entry(cell).or_default().push(i);
            }
        }
        Self {
            points,
            size,
            cells,
        }
    }

    /// Calls `found` with each point at most `radius` away from `at`.
    pub fn visit_within(&self, at: [f64; 3], radius: f64, mut found: impl FnMut(u32)) {
        let cell = |x: f64| (x / self.size).floor() as i64;
        let [x, y, z] = at.map(|x| cell(x - radius)..=cell(x + radius));
        for x in x {
            for y in y.clone() {
                for z in z.clone() {
                    for &i in self.cells.get(&[x, y, z]).into_iter().flatten() {
                        if distance(self.points[i as usize], at) <= radius {
                            found(i);
                        }
                    }
                }
            }
        }
    }
}
