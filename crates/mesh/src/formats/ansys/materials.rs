//! Materials of an archive: MP, MPTEMP and MPDATA.

use std::collections::{BTreeMap, BTreeSet};

use super::super::content::FileMaterial;
use crate::text;

/// Moduli of an orthotropic material, with the modulus that an isotropic one has in their place.
const DIRECTIONAL: [(&str, &str); 6] = [
    ("EY", "EX"),
    ("EZ", "EX"),
    ("NUXZ", "NUXY"),
    ("NUYZ", "NUXY"),
    ("PRXZ", "PRXY"),
    ("PRYZ", "PRXY"),
];
/// Largest relative difference of moduli that are written twice.
const SAME: f64 = 1e-6;

/// Properties of all materials.
#[derive(Debug, Default)]
pub(super) struct Materials {
    /// Values by material and property, one for each temperature.
    values: BTreeMap<u64, BTreeMap<String, Vec<f64>>>,
    /// Names that comments give to materials.
    names: BTreeMap<u64, String>,
    /// Materials with a law of TB that replaces the elasticity.
    pub with_table: BTreeSet<u64>,
}

impl Materials {
    /// Sets the values of a property from the place `first` (1 is the first) on.
    pub fn set(&mut self, material: u64, property: &str, first: usize, values: &[f64]) {
        let known = self.values.entry(material).or_default();
        let known = known.entry(property.to_owned()).or_default();
        let first = first.max(1) - 1;
        known.truncate(first);
        known.resize(first, f64::NAN);
        known.extend(values);
    }

    /// Names a material.
    pub fn name(&mut self, material: u64, name: &str) {
        self.names.insert(material, name.to_owned());
    }

    /// Name of a material.
    pub fn name_of(&self, material: u64) -> String {
        let unnamed = || format!("material {material}");
        self.names.get(&material).cloned().unwrap_or_else(unnamed)
    }

    fn first(&self, material: u64, property: &str) -> Option<f64> {
        let values = self.values.get(&material)?.get(property)?;
        values.iter().copied().find(|value| value.is_finite())
    }

    fn is_orthotropic(&self, material: u64) -> bool {
        let differs = |(property, isotropic): &(&str, &str)| {
            let value = self.first(material, property);
            let other = self.first(material, isotropic);
            value.is_some_and(|value| {
                other.is_none_or(|other| (value - other).abs() > SAME * other.abs())
            })
        };
        DIRECTIONAL.iter().any(differs)
    }

    /// Materials in `used` by number, and remarks on their unread properties.
    pub fn finish(&self, used: &BTreeSet<u64>) -> (BTreeMap<u64, FileMaterial>, Vec<String>) {
        let mut found = BTreeMap::new();
        let [mut of_temperature, mut orthotropic, mut tables, mut unread] =
            [const { Vec::new() }; 4];
        for &material in used
            .iter()
            .filter(|number| self.values.contains_key(number))
        {
            let name = self.name_of(material);
            let quoted = format!("`{name}`");
            let is_orthotropic = self.is_orthotropic(material);
            let elastic = |property: &str| {
                let value = self.first(material, property);
                value.filter(|_| !is_orthotropic)
            };
            if is_orthotropic {
                orthotropic.push(quoted.clone());
            }
            if self.with_table.contains(&material) {
                tables.push(quoted.clone());
            }
            let varies = |property: &&str| {
                let values = self.values[&material].get(*property);
                let differs = |pair: &[f64]| pair[0] != pair[1];
                values.is_some_and(|values| values.windows(2).any(differs))
            };
            let read = ["EX", "NUXY", "PRXY", "DENS"];
            let varying: Vec<&str> = read.into_iter().filter(varies).collect();
            if !varying.is_empty() {
                of_temperature.push(format!("{} of {quoted}", varying.join(" ")));
            }
            if let Some(expansion) = self.first(material, "ALPX").filter(|alpha| *alpha != 0.0) {
                unread.push(format!("ALPX {expansion} of {quoted}"));
            }
            found.insert(
                material,
                FileMaterial {
                    young: elastic("EX"),
                    poisson: elastic("NUXY").or_else(|| elastic("PRXY")),
                    density: self.first(material, "DENS"),
                    name,
                    elements: Vec::new(),
                },
            );
        }
        let remarks = [
            (
                "Properties with values for several temperatures are taken at the first of each",
                of_temperature,
            ),
            (
                "The elasticity of these materials was left aside, because only isotropic ones are \
                 read",
                orthotropic,
            ),
            (
                "Laws of TB (plasticity, creep, contact and others) of these materials were left \
                 aside, and only EX, NUXY or PRXY, and DENS count",
                tables,
            ),
            ("Thermal expansion was left aside", unread),
        ];
        let remarks = remarks.into_iter().filter(|(_, list)| !list.is_empty());
        let remarks = remarks.map(|(sentence, list)| format!("{sentence}: {}.", text::list(&list)));
        (found, remarks.collect())
    }
}
