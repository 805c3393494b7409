//! Springs and dashpots of the scene tied to nodes and facets.

use std::collections::HashMap;

use super::builder::BodyBuilder;
use super::groups::{find_group, kind};
use super::loads::{check_nodes, outward_facets, unique_body};
use super::{BodyNode, Dashpot, ModelError, Slave, Spring, SpringChain, SpringSupport};
use crate::model::{DashpotSpec, SpringSpec};
use dovetail_mesh::facet::shares;
use dovetail_mesh::{Group, Mesh};
use dovetail_numerics::space::extent;

/// A node does not count if its weight is below this fraction of the largest one.
const NO_WEIGHT: f64 = 1e-12;

/// Axes along which springs act on the nodes of the mesh that they name. Groups that the mesh lacks
/// have no nodes.
pub(super) fn sprung_axes(mesh: &Mesh, specs: &[SpringSpec]) -> HashMap<u32, [bool; 3]> {
    let mut sprung: HashMap<u32, [bool; 3]> = HashMap::new();
    for spec in specs {
        let along = spec.direction.map_or([true; 3], |d| d.map(|x| x != 0.0));
        let ends = [Some(&spec.first), spec.second.as_ref()];
        let groups = ends.into_iter().flatten();
        let groups = groups.filter_map(|name| find_group(mesh, name, None, &spec.name).ok());
        for node in groups.flat_map(|group| &group.nodes) {
            let known = sprung.entry(*node).or_default();
            *known = [0, 1, 2].map(|axis| known[axis] || along[axis]);
        }
    }
    sprung
}

/// Adds a spring to the bodies that it acts on. Returns the end that follows the other where it
/// joins two bodies.
pub(super) fn add_spring(
    mesh: &Mesh,
    bodies: &mut [BodyBuilder],
    spec: &SpringSpec,
) -> Result<Option<Slave>, ModelError> {
    let used_by = format!("spring `{}`", spec.name);
    let first = Place::find(mesh, bodies, (spec.direction, &spec.first), &used_by)?;
    let Some(second) = &spec.second else {
        let on = match first.facets(mesh, bodies, &used_by)? {
            Some(facets) => SpringSupport::Surface(facets),
            None => {
                let local = |&n: &u32| bodies[first.body].local(n);
                SpringSupport::Nodes(first.group.nodes.iter().map(local).collect())
            }
        };
        bodies[first.body].add_spring(make_spring(spec, spec.stiffness_n_m, on));
        return Ok(None);
    };
    let second = Place::find(mesh, bodies, (spec.direction, second), &used_by)?;
    let mut links = [Vec::new(), Vec::new()];
    for (links, place) in links.iter_mut().zip([&first, &second]) {
        *links = place.links(mesh, bodies, &used_by)?;
    }
    let [one, mut other] = links;
    if first.body == second.body {
        other.iter_mut().for_each(|(_, weight)| *weight *= -1.0);
        let links = [one, other].concat();
        add_chain(
            &mut bodies[first.body],
            spec,
            spec.stiffness_n_m,
            links,
            false,
        );
        return Ok(None);
    }
    // Two springs in series, each twice as stiff.
    let mut end = |place: &Place, links| {
        let stiffness_n_m = 2.0 * spec.stiffness_n_m;
        let last = add_chain(&mut bodies[place.body], spec, stiffness_n_m, links, true);
        last.map(|node| BodyNode {
            body: place.body,
            node,
        })
    };
    let ends = (end(&first, one), end(&second, other));
    let joined = ends.0.zip(ends.1);
    Ok(joined.map(|(node, master)| Slave {
        node,
        masters: vec![(master, 1.0)],
        ahead: 0,
    }))
}

/// Dashpots of a scene's one: along its direction, or along all three axes.
pub(super) fn dashpots_of(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    spec: &DashpotSpec,
) -> Result<Vec<Dashpot>, ModelError> {
    let used_by = format!("dashpot `{}`", spec.name);
    let ends = [(Some(&spec.first), 1.0), (spec.second.as_ref(), -1.0)];
    let mut weights: Vec<(BodyNode, f64)> = Vec::new();
    for (name, sign) in ends {
        let Some(name) = name else { continue };
        let place = Place::find(mesh, bodies, (spec.direction, name), &used_by)?;
        let body = place.body;
        let links = place.links(mesh, bodies, &used_by)?.into_iter();
        weights.extend(links.map(|(node, weight)| (BodyNode { body, node }, sign * weight)));
    }
    let along = |direction: [f64; 3]| Dashpot {
        damping_n_s_m: spec.damping_n_s_m,
        terms: weights
            .iter()
            .map(|(at, weight)| (*at, direction.map(|d| d * weight)))
            .collect(),
    };
    Ok(match spec.direction {
        Some(direction) => vec![along(direction)],
        None => vec![
            along([1.0, 0.0, 0.0]),
            along([0.0, 1.0, 0.0]),
            along([0.0, 0.0, 1.0]),
        ],
    })
}

fn make_spring(spec: &SpringSpec, stiffness_n_m: f64, on: SpringSupport) -> Spring {
    Spring {
        name: spec.name.clone(),
        stiffness_n_m,
        direction: spec.direction,
        on,
    }
}

/// Adds a chain of these links to a body. Returns its last auxiliary node.
fn add_chain(
    body: &mut BodyBuilder,
    spec: &SpringSpec,
    stiffness_n_m: f64,
    links: Vec<(u32, f64)>,
    is_open: bool,
) -> Option<u32> {
    let inner = links.len() - 1;
    let mut nodes: Vec<u32> = (0..inner).map(|_| body.add_auxiliary(false)).collect();
    if is_open {
        nodes.push(body.add_auxiliary(true));
    }
    let last = nodes.last().copied();
    let chain = SpringSupport::Chain(SpringChain { links, nodes });
    body.add_spring(make_spring(spec, stiffness_n_m, chain));
    last
}

/// Group that a spring or a dashpot acts on.
struct Place<'a> {
    name: &'a str,
    group: &'a Group,
    body: usize,
}

impl<'a> Place<'a> {
    fn find(
        mesh: &'a Mesh,
        bodies: &[BodyBuilder],
        (direction, name): (Option<[f64; 3]>, &'a str),
        used_by: &str,
    ) -> Result<Self, ModelError> {
        let group = find_group(mesh, name, None, used_by)?;
        if ![0, 2].contains(&group.dimension) {
            return Err(ModelError::SpringDimension {
                used_by: used_by.to_string(),
                group: name.to_string(),
                found: kind(group.dimension),
            });
        }
        let axes = direction.unwrap_or([1.0; 3]);
        check_nodes(mesh, bodies, group, axes, used_by, name)?;
        let body = unique_body(bodies, group, name, used_by)?;
        Ok(Self { name, group, body })
    }

    /// Facets of the group in local nodes; `None` for a group of nodes.
    fn facets(
        &self,
        mesh: &Mesh,
        bodies: &[BodyBuilder],
        used_by: &str,
    ) -> Result<Option<Vec<Vec<u32>>>, ModelError> {
        if self.group.dimension == 0 {
            return Ok(None);
        }
        outward_facets(mesh, self.group, &bodies[self.body], used_by, self.name).map(Some)
    }

    /// Nodes (local) that move, with their weights in the mean displacement of the group, ordered
    /// along its largest extent.
    fn links(
        &self,
        mesh: &Mesh,
        bodies: &[BodyBuilder],
        used_by: &str,
    ) -> Result<Vec<(u32, f64)>, ModelError> {
        let body = &bodies[self.body];
        let position = |node: u32| body.nodes_m()[node as usize];
        let nodes = &self.group.nodes;
        let mut weights = vec![0.0; nodes.len()];
        match self.facets(mesh, bodies, used_by)? {
            None => weights.fill(1.0 / nodes.len() as f64),
            Some(facets) => {
                for facet in &facets {
                    let coords: Vec<[f64; 3]> = facet.iter().map(|&n| position(n)).collect();
                    for (&node, share) in facet.iter().zip(shares(&coords)) {
                        // A group lists the nodes of its facets, ascending.
                        if let Ok(at) = nodes.binary_search(&body.mesh_nodes()[node as usize]) {
                            weights[at] += share.area_m2;
                        }
                    }
                }
                let area: f64 = weights.iter().sum();
                weights.iter_mut().for_each(|weight| *weight /= area);
            }
        }
        let largest = weights
            .iter()
            .fold(0.0f64, |most, weight| most.max(weight.abs()));
        let along = |axis: usize| extent(nodes.iter().map(|&n| position(body.local(n))[axis]));
        let axis = (0..3).max_by(|&a, &b| along(a).total_cmp(&along(b)));
        let axis = axis.unwrap_or(0);
        let weighted = nodes.iter().zip(&weights);
        let moving = weighted
            .filter(|(n, weight)| !body.is_fixed(**n) && weight.abs() > NO_WEIGHT * largest);
        let mut links: Vec<(u32, f64)> = moving
            .map(|(&n, &weight)| (body.local(n), weight))
            .collect();
        links.sort_by(|a, b| position(a.0)[axis].total_cmp(&position(b.0)[axis]));
        Ok(links)
    }
}
