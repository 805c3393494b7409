//! Commands that give materials their properties: MP, MPDATA and TB.

use super::read::{Reader, is_release};
use super::vocabulary::Command;
use crate::MeshError;

/// Most temperatures that the program has for a property.
const MOST_TEMPERATURES: u64 = 100;

impl Reader {
    /// `MP,label,material,c0,c1,...`, a polynomial in the temperature.
    pub(super) fn property(&mut self, command: &Command) -> Result<(), MeshError> {
        let material = self.natural(command.argument(1)).unwrap_or(0);
        let values: Result<[f64; 5], _> = self.floats(command, 2);
        let Some(label) = property_of_solids(command.argument(0)) else {
            return Ok(());
        };
        let Ok([constant, slopes @ ..]) = values else {
            let aside = format!("{label} of material {material} by an expression");
            self.archive.aside.add(&aside, 1);
            return Ok(());
        };
        let values = match slopes == [0.0; 4] {
            true => vec![constant],
            // At the temperatures 0 and 1.
            false => vec![constant, constant + slopes.iter().sum::<f64>()],
        };
        self.archive.materials.set(material, label, 1, &values);
        Ok(())
    }

    /// `MPDATA,R5.0,count,label,material,first,values` of an archive, or
    /// `MPDATA,label,material,first,values`.
    pub(super) fn property_table(&mut self, command: &Command) -> Result<(), MeshError> {
        let skip = if is_release(command.argument(0)) {
            2
        } else {
            0
        };
        let Some(label) = property_of_solids(command.argument(skip)) else {
            return Ok(());
        };
        let material = self.natural(command.argument(skip + 1))?;
        let first = self
            .natural(command.argument(skip + 2))?
            .clamp(1, MOST_TEMPERATURES);
        let mut values = Vec::new();
        let given = command.arguments.get(skip + 3..).unwrap_or_default();
        for value in given.iter().filter(|value| !value.is_empty()) {
            values.push(self.float(value)?);
        }
        let materials = &mut self.archive.materials;
        materials.set(material, label, first as usize, &values);
        Ok(())
    }

    /// `TB,label,material,temperatures,points,option`.
    pub(super) fn begin_table(&mut self, command: &Command) {
        let material = self.natural(command.argument(1)).unwrap_or(0);
        let label = command.argument(0).to_ascii_uppercase();
        let option = command.argument(4).to_ascii_uppercase();
        let is_isotropic = label.starts_with("ELAS") && matches!(option.as_str(), "" | "ISOT");
        self.table = is_isotropic.then_some((material, 0));
        if !is_isotropic {
            self.archive.materials.with_table.insert(material);
        }
    }

    /// `TBDATA,1,young,poisson` of TB,ELASTIC.
    pub(super) fn table_data(&mut self, command: &Command) {
        let values = self.floats(command, 1);
        let (Some((material, count)), Ok([young, poisson])) = (&mut self.table, values) else {
            return;
        };
        *count += 1;
        let (material, count) = (*material, *count);
        let materials = &mut self.archive.materials;
        materials.set(material, "EX", count, &[young]);
        materials.set(material, "NUXY", count, &[poisson]);
    }
}

/// Label of a property that solids are read with.
fn property_of_solids(label: &str) -> Option<&'static str> {
    const LABELS: [&str; 11] = [
        "EX", "EY", "EZ", "NUXY", "NUXZ", "NUYZ", "PRXY", "PRXZ", "PRYZ", "DENS", "ALPX",
    ];
    let label = label.trim().to_ascii_uppercase();
    LABELS.into_iter().find(|known| *known == label)
}
