//! Meshes made of parts: the part of a volume, placed elsewhere, and parts side by side.

use std::collections::BTreeMap;

use super::{Group, Mesh, MeshMaterial, sort_once};
use dovetail_numerics::space::{cross, dot, norm};

/// Placement of a part: a rotation about an axis, then a translation.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Placement {
    /// Direction of the axis, of any length but zero.
    pub axis: [f64; 3],
    /// Point of the axis, m.
    pub point_m: [f64; 3],
    /// Angle of the rotation about the axis by the right-hand rule.
    pub angle_rad: f64,
    /// Translation after the rotation, m.
    pub translation_m: [f64; 3],
}

impl Placement {
    /// New position of a point, m (Rodrigues' formula).
    pub fn apply(&self, point_m: [f64; 3]) -> [f64; 3] {
        let length = norm(self.axis);
        let axis = self.axis.map(|a| a / length);
        let arm = [0, 1, 2].map(|k| point_m[k] - self.point_m[k]);
        let (sine, cosine) = self.angle_rad.sin_cos();
        let (across, along) = (cross(axis, arm), dot(axis, arm) * (1.0 - cosine));
        [0, 1, 2].map(|k| {
            let turned = cosine * arm[k] + sine * across[k] + along * axis[k];
            self.point_m[k] + turned + self.translation_m[k]
        })
    }
}

fn renumbered(list: &[u32], number: &[Option<u32>]) -> Vec<u32> {
    list.iter().filter_map(|&i| number[i as usize]).collect()
}

impl Mesh {
    /// Part of the mesh that belongs to a volume group: the elements and facets all of whose nodes
    /// are in the group, and the remainder of each group. `None` where there is no such group.
    pub fn part(&self, volume: &str) -> Option<Self> {
        let whole = self
            .groups
            .get(volume)
            .filter(|group| group.dimension == 3)?;
        let mut node = vec![None; self.nodes_m.len()];
        for (new, &old) in (0..).zip(&whole.nodes) {
            node[old as usize] = Some(new);
        }
        let (elements, element) = self.elements.retain_nodes(&node);
        let (facets, facet) = self.facets.retain_nodes(&node);
        let mut groups = BTreeMap::new();
        for (name, group) in &self.groups {
            let (list, number) = match group.dimension {
                3 => (&elements, &element),
                _ => (&facets, &facet),
            };
            let of_group = renumbered(&group.elements, number);
            let mut nodes: Vec<u32> = match group.dimension {
                0 | 1 => renumbered(&group.nodes, &node),
                3 if group.elements.is_empty() => renumbered(&group.nodes, &node),
                _ => of_group
                    .iter()
                    .flat_map(|&e| list.element_nodes(e as usize))
                    .copied()
                    .collect(),
            };
            sort_once(&mut nodes);
            if !nodes.is_empty() {
                let group = Group {
                    dimension: group.dimension,
                    elements: of_group,
                    nodes,
                };
                groups.insert(name.clone(), group);
            }
        }
        let materials = self.materials.iter().map(|material| MeshMaterial {
            elements: renumbered(&material.elements, &element),
            ..material.clone()
        });
        let kept = || whole.nodes.iter().map(|&n| n as usize);
        Some(Self {
            nodes_m: kept().map(|n| self.nodes_m[n]).collect(),
            node_tags: kept().map(|n| self.node_tags[n]).collect(),
            elements,
            facets,
            groups,
            materials: materials.filter(|m| !m.elements.is_empty()).collect(),
            remarks: self.remarks.clone(),
        })
    }

    /// Moves all nodes to another place.
    pub fn place(&mut self, placement: &Placement) {
        for x in &mut self.nodes_m {
            *x = placement.apply(*x);
        }
    }

    /// Adds a mesh without joining its nodes. Its groups and materials keep their names, preceded
    /// by that of the part and a full stop.
    pub fn add_part(&mut self, name: &str, part: &Self) {
        let first = |count: usize| count as u32;
        let (node, element) = (first(self.nodes_m.len()), first(self.elements.len()));
        let facet = first(self.facets.len());
        self.nodes_m.extend(&part.nodes_m);
        self.node_tags.extend(&part.node_tags);
        let lists = [
            (&mut self.elements, &part.elements),
            (&mut self.facets, &part.facets),
        ];
        for (list, added) in lists {
            for (nodes, &tag) in added.iter().zip(added.tags()) {
                list.push(tag, nodes.iter().map(|n| n + node));
            }
        }
        for (group_name, group) in &part.groups {
            let first = if group.dimension == 3 { element } else { facet };
            let group = Group {
                dimension: group.dimension,
                elements: group.elements.iter().map(|e| e + first).collect(),
                nodes: group.nodes.iter().map(|n| n + node).collect(),
            };
            self.groups.insert(format!("{name}.{group_name}"), group);
        }
        self.remarks.extend(part.remarks.iter().cloned());
        self.materials
            .extend(part.materials.iter().map(|material| MeshMaterial {
                name: format!("{name}.{}", material.name),
                elements: material.elements.iter().map(|e| e + element).collect(),
                ..material.clone()
            }));
    }
}
