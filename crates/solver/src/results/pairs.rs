//! Table of the pairs, from a mesh or from a folder.

use crate::contact::PairLaw;
use crate::model::{ContactPair, Model};
use crate::superelement::{NamedContact, Superelement};

/// Properties of the pairs besides their motion.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PairTable {
    /// Names of the contacts.
    pub contacts: Vec<String>,
    /// Nodes of a mesh that make the pairs, by columns: heading, and one entry per pair.
    pub nodes: Vec<(String, Vec<Option<u64>>)>,
    /// Properties of each pair, in the order of the model.
    pub rows: Vec<PairRow>,
}

/// Properties of one pair.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PairRow {
    /// Number of its contact in [`PairTable::contacts`].
    pub contact: usize,
    /// Position of the pair, m.
    pub position_m: [f64; 3],
    /// Directions n, t1, t2 in space, if known.
    pub frame: Option<[[f64; 3]; 3]>,
    /// Tributary area, m2, if known.
    pub area_m2: Option<f64>,
    /// Initial clearance, m.
    pub gap_m: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

/// Properties of a pair that fields need.
pub trait PairPlace {
    /// Tributary area, m2; `None` where unknown.
    fn area_m2(&self) -> Option<f64>;
    /// Initial clearance, m.
    fn gap_m(&self) -> f64;
}

impl PairPlace for ContactPair {
    fn area_m2(&self) -> Option<f64> {
        Some(self.area_m2)
    }
    fn gap_m(&self) -> f64 {
        self.law.gap_m
    }
}

impl PairPlace for PairRow {
    fn area_m2(&self) -> Option<f64> {
        self.area_m2
    }
    fn gap_m(&self) -> f64 {
        self.gap_m
    }
}

impl PairTable {
    /// Table of a meshed assembly.
    pub fn from_model(model: &Model) -> Self {
        let bodies = model.bodies.iter().enumerate();
        let nodes = bodies.map(|(b, body)| {
            let tag = |pair: &ContactPair| {
                let sides = std::iter::once(pair.slave.node).chain(pair.slave.partner());
                let node = sides.into_iter().find(|at| at.body == b)?.node;
                body.node_tags.get(node as usize).copied()
            };
            let tags = model.pairs.iter().map(tag).collect();
            (format!("{}_node", body.name), tags)
        });
        Self {
            contacts: model.contact_names.clone(),
            nodes: nodes.collect(),
            rows: model
                .pairs
                .iter()
                .map(|pair| PairRow {
                    contact: pair.contact,
                    position_m: pair.position_m,
                    frame: Some(pair.frame),
                    area_m2: Some(pair.area_m2),
                    gap_m: pair.law.gap_m,
                    friction: pair.law.friction,
                })
                .collect(),
        }
    }

    /// Table of a folder, each of whose pairs follows `law`.
    pub fn from_superelement(element: &Superelement, law: PairLaw) -> Self {
        let contacts = element.contacts.iter().enumerate();
        let contact_of: Vec<usize> = contacts
            .flat_map(|(number, contact)| std::iter::repeat_n(number, contact.pairs))
            .collect();
        let row = |i: usize| PairRow {
            contact: contact_of[i],
            position_m: element.positions_m[i],
            frame: None,
            area_m2: element.areas_m2.as_ref().map(|a| a[i]),
            gap_m: law.gap_m,
            friction: law.friction,
        };
        Self {
            contacts: element.contacts.iter().map(|c| c.name.clone()).collect(),
            nodes: Vec::new(),
            rows: (0..element.positions_m.len()).map(row).collect(),
        }
    }

    /// Contacts in the order of the pairs, for a folder of a reduced model.
    pub fn named_contacts(&self) -> Vec<NamedContact> {
        let same = self.rows.chunk_by(|a, b| a.contact == b.contact);
        same.map(|rows| NamedContact {
            name: self.contacts[rows[0].contact].clone(),
            pairs: rows.len(),
        })
        .collect()
    }
}
