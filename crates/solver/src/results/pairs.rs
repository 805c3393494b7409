//! The pairs as tables name them, whether they come from a mesh or from a folder.

use crate::model::{ContactPair, Model};
use crate::reduction::superelement::Superelement;

/// What is known of the pairs besides their motion.
#[derive(Debug, Clone, PartialEq)]
pub struct PairTable {
    /// Names of the contacts.
    pub contacts: Vec<String>,
    /// Heading and one entry per pair: the nodes of a mesh that make the pairs.
    pub nodes: Vec<(String, Vec<Option<u64>>)>,
    /// One per pair, in the order of the model.
    pub rows: Vec<PairRow>,
}

/// One pair.
#[derive(Debug, Clone, PartialEq)]
pub struct PairRow {
    /// Which contact it belongs to.
    pub contact: usize,
    /// Where the pair is.
    pub position_m: [f64; 3],
    /// Directions n, t1, t2 in space, where known.
    pub frame: Option<[[f64; 3]; 3]>,
    /// Tributary area, where known.
    pub area_m2: Option<f64>,
    /// Initial clearance, m.
    pub gap_m: f64,
}

/// What fields need of a pair.
pub trait PairPlace {
    /// Tributary area; `None` where unknown.
    fn area_m2(&self) -> Option<f64>;
    /// Initial clearance, m.
    fn gap_m(&self) -> f64;
}

impl PairPlace for ContactPair {
    fn area_m2(&self) -> Option<f64> {
        Some(self.area_m2)
    }
    fn gap_m(&self) -> f64 {
        self.gap_m
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
    /// Of a meshed assembly.
    pub fn of_model(model: &Model) -> Self {
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
                    gap_m: pair.gap_m,
                })
                .collect(),
        }
    }

    /// All pairs of a folder make one contact, called `pairs`; each has the clearance `gap_m`.
    pub fn of_superelement(element: &Superelement, gap_m: f64) -> Self {
        let row = |i: usize| PairRow {
            contact: 0,
            position_m: element.positions_m[i],
            frame: None,
            area_m2: element.areas_m2.as_ref().map(|a| a[i]),
            gap_m,
        };
        Self {
            contacts: vec!["pairs".to_owned()],
            nodes: Vec::new(),
            rows: (0..element.positions_m.len()).map(row).collect(),
        }
    }
}
