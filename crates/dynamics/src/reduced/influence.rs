//! Forces that the air returns to the vibrating blades of a disc.
//!
//! In a wave round the disc they are linear in the motion of each blade (E. F. Crawley, AGARD-AG-298
//! (1988), volume 2, chapter 19). With chosen modes s_n of one body of the sector, of the modal
//! masses m_n,
//!
//! ```text
//! f = sum_m w_m (A a)_m        a_n = w_n^T u        w_n = M s_n / m_n
//! ```
//!
//! where a_n is the amplitude of mode n in the motion u, and f does the work (A a)_m on mode m. A is a
//! complex matrix for each wave, N/m. Its real part takes from the stiffness of the modes, and a
//! negative imaginary part damps them.

use std::collections::BTreeMap;

use faer::{Mat, c64};
use serde::{Deserialize, Serialize, Serializer};

/// Coefficient A_mn of the aerodynamic influence in one wave.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct InfluenceCoefficient {
    /// Nodal diameter of the wave: above 0 where it runs in the direction in which sectors are
    /// counted, seen from the disc, and below 0 where it runs the other way.
    pub nodal_diameter: i64,
    /// Number m of the mode that the force acts on, counted from 1.
    pub mode: usize,
    /// Number n of the mode that causes the force, counted from 1.
    pub by_mode: usize,
    /// Real part, N/m.
    pub real_n_m: f64,
    /// Imaginary part, N/m.
    pub imaginary_n_m: f64,
}

/// Matrix of the aerodynamic influence for each wave. By default there is none.
#[derive(Debug, Clone, Default)]
pub struct Influence {
    /// Matrices A of the waves, by their nodal diameters; a wave without one has no influence.
    of_waves: BTreeMap<i64, Mat<c64>>,
}

/// Writes the matrices column by column.
impl Serialize for Influence {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.of_waves.iter().map(|(wave, matrix)| {
            let columns = (0..matrix.ncols()).flat_map(|j| matrix.col_as_slice(j));
            (wave, columns.map(|z| [z.re, z.im]).collect::<Vec<_>>())
        }))
    }
}

impl Influence {
    /// Influence on these modes, whose numbers the coefficients name. Those that are not given are 0.
    pub fn new(sectors: usize, modes: &[usize], coefficients: &[InfluenceCoefficient]) -> Self {
        let mut of_waves = BTreeMap::new();
        let place = |number: usize| modes.iter().position(|mode| *mode == number);
        for coefficient in coefficients {
            let both = place(coefficient.mode).zip(place(coefficient.by_mode));
            let Some((m, n)) = both else { continue };
            let none = || Mat::<c64>::zeros(modes.len(), modes.len());
            let wave = canonical_nodal_diameter(coefficient.nodal_diameter, sectors);
            let matrix = of_waves.entry(wave).or_insert_with(none);
            matrix[(m, n)] = c64::new(coefficient.real_n_m, coefficient.imaginary_n_m);
        }
        Self { of_waves }
    }

    /// Matrix of the wave of a nodal diameter, which is above 0 where it is half the number of sectors;
    /// `None` where it has no influence.
    pub(crate) fn wave_matrix(&self, nodal_diameter: i64) -> Option<&Mat<c64>> {
        self.of_waves.get(&nodal_diameter)
    }
}

/// Of the two numbers of the wave in which each sector moves against its neighbours, N / 2 and -N / 2,
/// the first; any other number as it is.
pub fn canonical_nodal_diameter(nodal_diameter: i64, sectors: usize) -> i64 {
    if 2 * nodal_diameter == -(sectors as i64) {
        return -nodal_diameter;
    }
    nodal_diameter
}
