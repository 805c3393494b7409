//! Materials of bulk data: MAT1, and the names of others.

use std::collections::BTreeMap;

use super::super::content::FileMaterial;
use super::names::{Named, Names};
use crate::text;

/// Card MAT1.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Mat1 {
    pub young: Option<f64>,
    pub shear: Option<f64>,
    pub poisson: Option<f64>,
    pub density: Option<f64>,
    pub expansion: Option<f64>,
}

impl Mat1 {
    /// Young's modulus and Poisson's ratio, of which one may follow from the shear modulus. A ratio
    /// that nothing gives is 0, as in Nastran.
    fn elasticity(self) -> [Option<f64>; 2] {
        match (self.young, self.shear, self.poisson) {
            (Some(e), Some(g), None) if g != 0.0 => [Some(e), Some(e / (2.0 * g) - 1.0)],
            (None, Some(g), Some(nu)) => [Some(2.0 * g * (1.0 + nu)), Some(nu)],
            (Some(e), _, nu) => [Some(e), Some(nu.unwrap_or(0.0))],
            (None, ..) => [None; 2],
        }
    }
}

/// Materials by number.
#[derive(Debug, Default)]
pub(super) struct Materials {
    pub isotropic: BTreeMap<u64, Mat1>,
    /// Densities of MAT9.
    pub anisotropic: BTreeMap<u64, Option<f64>>,
    /// Materials with tables over the temperature (MATT1).
    pub tables: Vec<u64>,
}

impl Materials {
    /// Materials with the factor of PARAM,WTMASS in their densities.
    pub fn finish(&self, names: &Names, factor: f64) -> BTreeMap<u64, FileMaterial> {
        let file_material =
            |(id, [young, poisson], density): (u64, [Option<f64>; 2], Option<f64>)| {
                let material = FileMaterial {
                    name: name_of(names, id),
                    young,
                    poisson,
                    density: density.map(|density| density * factor),
                    elements: Vec::new(),
                };
                (id, material)
            };
        let anisotropic = self
            .anisotropic
            .iter()
            .map(|(id, rho)| (*id, [None; 2], *rho));
        let isotropic = self.isotropic.iter();
        let isotropic = isotropic.map(|(id, mat)| (*id, mat.elasticity(), mat.density));
        anisotropic.chain(isotropic).map(file_material).collect()
    }

    /// Remarks on unread properties of the materials in use.
    pub fn remarks(&self, names: &Names, is_used: impl Fn(u64) -> bool) -> Vec<String> {
        let quoted = |id: u64| format!("`{}`", name_of(names, id));
        let list = |ids: &mut dyn Iterator<Item = u64>| -> Vec<String> {
            ids.filter(|id| is_used(*id)).map(quoted).collect()
        };
        let expansion = self.isotropic.iter().filter_map(|(id, mat)| {
            let value = mat.expansion.filter(|a| *a != 0.0 && is_used(*id))?;
            Some(format!("A {value} of {}", quoted(*id)))
        });
        let remarks = [
            (
                "The elasticity of these materials (MAT9) was left aside, because only isotropic \
                 ones are read",
                list(&mut self.anisotropic.keys().copied()),
            ),
            (
                "Tables over the temperature (MATT1) of these materials were left aside, and the \
                 values of MAT1 count",
                list(&mut self.tables.iter().copied()),
            ),
            ("Thermal expansion was left aside", expansion.collect()),
        ];
        let remarks = remarks.into_iter().filter(|(_, list)| !list.is_empty());
        let remarks = remarks.map(|(sentence, list)| format!("{sentence}: {}.", text::list(&list)));
        remarks.collect()
    }
}

fn name_of(names: &Names, id: u64) -> String {
    let name = names.get(Named::Material, id).map(str::to_owned);
    name.unwrap_or_else(|| format!("material {id}"))
}
