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
}

impl Units {
    /// Systems of units, by the words that name them.
    pub const SYSTEMS: [(&'static str, Self); 2] = [
        ("m-kg-s", Self::MetreKilogramSecond),
        ("mm-t-s", Self::MillimetreTonneSecond),
    ];

    /// Length of one unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::MetresPerUnit(metres) => metres,
            Self::MetreKilogramSecond => 1.0,
            Self::MillimetreTonneSecond => 1e-3,
        }
    }

    /// One unit of stress in Pa and one of density in kg/m3, if they are known.
    pub fn stress_pa_and_density_kg_m3(self) -> Option<[f64; 2]> {
        match self {
            Self::MetresPerUnit(_) => None,
            Self::MetreKilogramSecond => Some([1.0, 1.0]),
            Self::MillimetreTonneSecond => Some([1e6, 1e12]),
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
