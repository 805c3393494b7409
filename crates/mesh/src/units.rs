//! Units of a mesh file.

use std::str::FromStr;

/// Units of the numbers of a mesh file, which no format records.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub enum Units {
    /// Length of one unit in metres. Materials of the file cannot be used.
    MetresPerUnit(f64),
    /// Metre, kilogram, second: Pa, kg/m3.
    MetreKilogramSecond,
    /// Millimetre, tonne, second: MPa, t/mm3.
    MillimetreTonneSecond,
    /// Inch, pound-force, second: psi, lbf s2/in4.
    InchPoundSecond,
}

/// One inch, m.
const INCH_M: f64 = 0.0254;
/// One pound-force, N.
const POUND_FORCE_N: f64 = 4.4482216152605;

impl Units {
    /// Systems of units, by the words that name them.
    pub const SYSTEMS: [(&'static str, Self); 3] = [
        ("m-kg-s", Self::MetreKilogramSecond),
        ("mm-t-s", Self::MillimetreTonneSecond),
        ("in-lbf-s", Self::InchPoundSecond),
    ];

    /// Length of one unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::MetresPerUnit(metres) => metres,
            Self::MetreKilogramSecond => 1.0,
            Self::MillimetreTonneSecond => 1e-3,
            Self::InchPoundSecond => INCH_M,
        }
    }

    /// One unit of stress in Pa and one of density in kg/m3, if they are known.
    pub fn stress_pa_and_density_kg_m3(self) -> Option<[f64; 2]> {
        match self {
            Self::MetresPerUnit(_) => None,
            Self::MetreKilogramSecond => Some([1.0, 1.0]),
            Self::MillimetreTonneSecond => Some([1e6, 1e12]),
            Self::InchPoundSecond => {
                let stress_pa = POUND_FORCE_N / INCH_M.powi(2);
                Some([stress_pa, stress_pa / INCH_M.powi(2)])
            }
        }
    }
}

/// Reads the word of a system.
impl FromStr for Units {
    type Err = ();
    fn from_str(word: &str) -> Result<Self, ()> {
        let mut systems = Self::SYSTEMS.into_iter();
        let system = systems.find(|(own, _)| *own == word);
        system.map(|(_, units)| units).ok_or(())
    }
}

impl From<f64> for Units {
    fn from(metres_per_unit: f64) -> Self {
        Self::MetresPerUnit(metres_per_unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steel in inches, pounds and seconds: 29e6 psi, 7.33e-4 lbf s2/in4.
    #[test]
    fn one_unit_of_each_system_in_si() {
        let scales = |word: &str| {
            let units: Units = word.parse().unwrap();
            (units.metres(), units.stress_pa_and_density_kg_m3().unwrap())
        };
        assert_eq!(scales("m-kg-s"), (1.0, [1.0, 1.0]));
        assert_eq!(scales("mm-t-s"), (1e-3, [1e6, 1e12]));
        let (inch, [psi, density]) = scales("in-lbf-s");
        assert_eq!(inch, 0.0254);
        assert!((29.007548e6 * psi - 200e9).abs() < 1e5, "{psi}");
        assert!((7.345445e-4 * density - 7850.0).abs() < 0.01, "{density}");
    }
}
