//! Columns of a file of points: the meaning of their names, and their units.
//!
//! A name is words, whatever separates them, and a unit: in brackets (`Pressure Amplitude [ Pa ]`,
//! as CFD-Post writes it), or as its last word (`pressure_amplitude_pa`). Case does not matter,
//! except for units in brackets. Fluent names no units (`x-coordinate`, `pressure`): its files are
//! in SI units.

use std::path::Path;

use super::{SurfaceFieldError, UNITS};
use crate::text::{list, plain};

/// Part of a complex value that a column gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ComplexPart {
    /// The only number, or one of several that the name does not tell apart.
    Whole,
    Real,
    Imaginary,
    Amplitude,
    Phase,
}

/// Quantity in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    /// Coordinate along x, y or z.
    Place(usize),
    Pressure(ComplexPart),
    Force(usize, ComplexPart),
    Area,
    Friction,
    /// Number of a node, which is not used.
    Label,
}

impl Quantity {
    /// Units of the quantity, with their values in SI units.
    fn units(self) -> &'static [(&'static str, f64)] {
        const LENGTHS: &[(&str, f64)] = &[
            ("m", 1.0),
            ("mm", 1e-3),
            ("cm", 1e-2),
            ("in", 0.0254),
            ("ft", 0.3048),
        ];
        const PRESSURES: &[(&str, f64)] = &[
            ("Pa", 1.0),
            ("pa", 1.0),
            ("kPa", 1e3),
            ("MPa", 1e6),
            ("hPa", 1e2),
            ("bar", 1e5),
            ("mbar", 1e2),
            ("N/m^2", 1.0),
            ("Nm^-2", 1.0),
            ("kgm^-1s^-2", 1.0),
            ("psi", 6_894.757_293_168),
        ];
        const FORCES: &[(&str, f64)] = &[("N", 1.0), ("n", 1.0), ("kN", 1e3), ("mN", 1e-3)];
        const AREAS: &[(&str, f64)] = &[
            ("m^2", 1.0),
            ("m2", 1.0),
            ("mm^2", 1e-6),
            ("mm2", 1e-6),
            ("cm^2", 1e-4),
        ];
        const DEGREE: f64 = std::f64::consts::PI / 180.0;
        const ANGLES: &[(&str, f64)] = &[
            ("deg", DEGREE),
            ("degree", DEGREE),
            ("degrees", DEGREE),
            ("rad", 1.0),
            ("radian", 1.0),
            ("radians", 1.0),
        ];
        match self {
            Self::Place(_) => LENGTHS,
            Self::Pressure(ComplexPart::Phase) | Self::Force(_, ComplexPart::Phase) => ANGLES,
            Self::Pressure(_) => PRESSURES,
            Self::Force(..) => FORCES,
            Self::Area => AREAS,
            Self::Friction => &[("", 1.0), ("1", 1.0), ("-", 1.0)],
            Self::Label => &[],
        }
    }

    /// Name of such a column in a file of this program.
    fn column_name(self) -> String {
        let axis = |k: usize| ["x", "y", "z"][k];
        let part = |part: ComplexPart, unit: &str| match part {
            ComplexPart::Whole | ComplexPart::Real => format!("re_{unit}"),
            ComplexPart::Imaginary => format!("im_{unit}"),
            ComplexPart::Amplitude => format!("amplitude_{unit}"),
            ComplexPart::Phase => "phase_deg".to_owned(),
        };
        match self {
            Self::Place(k) => format!("{}_m", axis(k)),
            Self::Pressure(p) => format!("pressure_{}", part(p, "pa")),
            Self::Force(k, p) => format!("force_{}_{}", axis(k), part(p, "n")),
            Self::Area => "area_m2".to_owned(),
            Self::Friction => "friction".to_owned(),
            Self::Label => "node".to_owned(),
        }
    }
}

/// Interpretation of a name.
struct Meaning {
    quantity: Quantity,
    unit: Option<String>,
    /// True for a place that is called a coordinate.
    is_coordinate: bool,
}

/// Interpretation of a name by its words and unit; `None` where it is unknown.
fn meaning(name: &str) -> Option<Meaning> {
    let (words, mut unit) = match name.split_once('[') {
        Some((words, rest)) => {
            let unit = rest.trim().strip_suffix(']')?;
            (words, Some(unit.split_whitespace().collect::<String>()))
        }
        None => (name, None),
    };
    let words = words.to_lowercase();
    let mut words: Vec<&str> = words
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .collect();
    if unit.is_none()
        && let [_, .., last] = words[..]
        && ["m", "mm", "pa", "n", "m2", "mm2", "deg", "rad"].contains(&last)
    {
        unit = Some(last.to_owned());
        words.pop();
    }
    let (mut axis, mut part, mut noun) = (None, None, None);
    let mut is_coefficient = false;
    for word in &words {
        match *word {
            "x" | "y" | "z" => {
                let k = usize::from(word.as_bytes()[0] - b'x');
                if axis.replace(k).is_some() {
                    return None;
                }
            }
            "pressure" | "force" | "area" | "friction" | "coordinate" | "node" | "nodenumber"
            | "cellnumber" => {
                if noun.replace(*word).is_some() {
                    return None;
                }
            }
            "number" if noun == Some("node") => {}
            "coefficient" | "of" => is_coefficient = true,
            "part" if part.is_some() => {}
            _ => {
                let read_part = match *word {
                    "re" | "real" => ComplexPart::Real,
                    "im" | "imag" | "imaginary" => ComplexPart::Imaginary,
                    "amplitude" | "magnitude" => ComplexPart::Amplitude,
                    "phase" => ComplexPart::Phase,
                    _ => return None,
                };
                if part.replace(read_part).is_some() {
                    return None;
                }
            }
        }
    }
    let quantity = match (noun, axis, part) {
        (Some("friction"), None, None) => Quantity::Friction,
        _ if is_coefficient => return None,
        (None | Some("coordinate"), Some(k), None) => Quantity::Place(k),
        (Some("pressure"), None, part) => Quantity::Pressure(part.unwrap_or(ComplexPart::Whole)),
        (Some("force"), Some(k), part) => Quantity::Force(k, part.unwrap_or(ComplexPart::Whole)),
        (Some("area"), None, None) => Quantity::Area,
        (Some("node" | "nodenumber" | "cellnumber"), None, None) => Quantity::Label,
        _ => return None,
    };
    Some(Meaning {
        quantity,
        unit,
        is_coordinate: noun == Some("coordinate"),
    })
}

/// Column that is read.
#[derive(Debug, Clone)]
pub(super) struct FieldColumn {
    /// Name in the file.
    pub name: String,
    /// Position of the column.
    pub at: usize,
    /// Value of its unit in SI units.
    pub factor: f64,
}

/// Columns of a complex value.
pub(super) enum Complex {
    /// Real part, and the imaginary one if there is one.
    Parts(FieldColumn, Option<FieldColumn>),
    /// Amplitude and phase.
    Polar(FieldColumn, FieldColumn),
}

impl Complex {
    /// Real and imaginary part, from the numbers of the columns.
    pub fn value<E>(&self, number: impl Fn(&FieldColumn) -> Result<f64, E>) -> Result<[f64; 2], E> {
        match self {
            Self::Parts(re, im) => Ok([number(re)?, im.as_ref().map_or(Ok(0.0), number)?]),
            Self::Polar(amplitude, phase) => {
                let (size, (sine, cosine)) = (number(amplitude)?, number(phase)?.sin_cos());
                Ok([size * cosine, size * sine])
            }
        }
    }
}

/// Columns of the values at the points.
pub(super) enum ValueColumns {
    Forces([Complex; 3]),
    Pressures(Complex, Option<FieldColumn>),
    Friction(FieldColumn),
}

/// Positions of the columns.
pub(super) struct FieldColumns {
    pub place: [FieldColumn; 3],
    pub values: ValueColumns,
    /// Number of columns, including those that are not read.
    pub count: usize,
}

impl FieldColumns {
    /// Reads the line that names the columns.
    pub fn read(header: &csv::StringRecord, path: &Path) -> Result<Self, SurfaceFieldError> {
        let columns = Named::read(header, path)?;
        let place = [0, 1, 2].map(|k| columns.need(Quantity::Place(k)));
        let [x, y, z] = place;
        let place = [x?, y?, z?];
        let pressure = columns.found.iter().find_map(|(quantity, column)| {
            matches!(quantity, Quantity::Pressure(_) | Quantity::Area).then_some(column)
        });
        let is_force = |quantity: &Quantity| matches!(quantity, Quantity::Force(..));
        let has_forces = columns.found.iter().any(|(quantity, _)| is_force(quantity));
        let friction = columns.find(Quantity::Friction);
        let load = columns
            .found
            .iter()
            .find_map(|(quantity, column)| (is_force(quantity)).then_some(column).or(pressure));
        if let (Some(_), Some(load)) = (&friction, load) {
            return Err(SurfaceFieldError::FrictionAndLoad {
                path: path.to_owned(),
                column: load.name.clone(),
            });
        }
        let values = match (friction, has_forces, pressure) {
            (Some(friction), _, _) => ValueColumns::Friction(friction),
            (None, true, Some(column)) => {
                return Err(SurfaceFieldError::TwoKinds {
                    path: path.to_owned(),
                    column: column.name.clone(),
                });
            }
            (None, true, None) => {
                let force = |k| columns.complex(|part| Quantity::Force(k, part));
                ValueColumns::Forces([force(0)?, force(1)?, force(2)?])
            }
            (None, false, _) => {
                let area = columns.find(Quantity::Area);
                ValueColumns::Pressures(columns.complex(Quantity::Pressure)?, area)
            }
        };
        Ok(Self {
            place,
            values,
            count: header.len(),
        })
    }
}

/// Columns that are known.
struct Named<'a> {
    path: &'a Path,
    header: &'a csv::StringRecord,
    found: Vec<(Quantity, FieldColumn)>,
}

impl<'a> Named<'a> {
    fn read(header: &'a csv::StringRecord, path: &'a Path) -> Result<Self, SurfaceFieldError> {
        let understand = |name: &str| {
            meaning(name).ok_or_else(|| SurfaceFieldError::UnknownColumn {
                path: path.to_owned(),
                column: plain(name),
            })
        };
        let meanings: Vec<Meaning> = header.iter().map(understand).collect::<Result<_, _>>()?;
        let is_place = |m: &&Meaning| matches!(m.quantity, Quantity::Place(_));
        let mut places = meanings.iter().filter(is_place);
        let in_si = places.all(|m| m.is_coordinate && m.unit.is_none());
        let mut named = Self {
            path,
            header,
            found: Vec::new(),
        };
        for ((at, name), meaning) in header.iter().enumerate().zip(meanings) {
            let quantity = meaning.quantity;
            if quantity == Quantity::Label {
                continue;
            }
            let (path, column) = (path.to_owned(), plain(name));
            if named.find(quantity).is_some() {
                return Err(SurfaceFieldError::ColumnTwice { path, column });
            }
            let units = quantity.units();
            let is_angle = units.iter().any(|(unit, _)| *unit == "rad");
            let factor = match &meaning.unit {
                None if in_si && !is_angle => 1.0,
                unit => {
                    let given = unit.as_deref().unwrap_or_default();
                    let known = units.iter().find(|(unit, _)| *unit == given);
                    let Some((_, factor)) = known else {
                        let known: Vec<&str> = units.iter().map(|(unit, _)| *unit).collect();
                        return Err(SurfaceFieldError::Unit {
                            path,
                            column,
                            units: list(&known[..known.len().min(UNITS)]),
                        });
                    };
                    *factor
                }
            };
            let name = column;
            named
                .found
                .push((quantity, FieldColumn { name, at, factor }));
        }
        Ok(named)
    }

    fn find(&self, quantity: Quantity) -> Option<FieldColumn> {
        let named_column = self.found.iter().find(|(known, _)| *known == quantity);
        named_column.map(|(_, column)| column.clone())
    }

    fn need(&self, quantity: Quantity) -> Result<FieldColumn, SurfaceFieldError> {
        self.find(quantity)
            .ok_or_else(|| SurfaceFieldError::NoColumn {
                path: self.path.to_owned(),
                column: quantity.column_name(),
                found: list(&self.header.iter().map(plain).collect::<Vec<_>>()),
            })
    }

    /// Complex value in one of the ways to give it.
    fn complex(&self, of: impl Fn(ComplexPart) -> Quantity) -> Result<Complex, SurfaceFieldError> {
        let [whole, re, im, amplitude, phase] = [
            ComplexPart::Whole,
            ComplexPart::Real,
            ComplexPart::Imaginary,
            ComplexPart::Amplitude,
            ComplexPart::Phase,
        ]
        .map(|part| self.find(of(part)));
        let is_polar = amplitude.is_some() || phase.is_some();
        let extra = if is_polar {
            whole.as_ref().or(re.as_ref()).or(im.as_ref())
        } else {
            whole.as_ref().filter(|_| re.is_some() || im.is_some())
        };
        if let Some(column) = extra {
            return Err(SurfaceFieldError::TwoWays {
                path: self.path.to_owned(),
                column: column.name.clone(),
            });
        }
        match (is_polar, whole) {
            (true, _) => Ok(Complex::Polar(
                self.need(of(ComplexPart::Amplitude))?,
                self.need(of(ComplexPart::Phase))?,
            )),
            (false, Some(whole)) => Ok(Complex::Parts(whole, None)),
            (false, None) => Ok(Complex::Parts(self.need(of(ComplexPart::Real))?, im)),
        }
    }
}
