//! Reactions: forces and moments by which supports and springs to ground push the bodies.
//!
//! A reaction is what is left of the equations of the held degrees of freedom when the motion of the
//! bodies is put in. With K, M and the damping C = a K + b M of the body with nothing held,
//!
//! ```text
//! R_0 = K u_0 - f                  R_k = (K + i k w C - (k w)^2 M) u_k - F_k
//! ```
//!
//! on the rows of what is held. Rows of nodes that follow a held node belong to its support with
//! their weights: mid-edge nodes of a flank, and nodes of another flank that are paired with it or
//! bonded to it. So the contact force on a held node is borne by its support.

use std::collections::{BTreeMap, BTreeSet};

use faer::{Mat, MatRef};

use super::resultants::{Pusher, Resultant};
use crate::damping::Rayleigh;
use crate::excitation::Growth;
use crate::fem::released::Released;
use crate::fem::springs::forces_n;
use crate::fem::{FemError, NodeDisplacements};
use crate::model::{Body, BodyNode, Model, NodeMotion, Spring, SpringSupport};
use dovetail_numerics::space::{add_scaled, cross, sub};
use dovetail_numerics::sparse::times;
use dovetail_numerics::spectrum::{cosine, sine};

/// Supports of all bodies of a model, with the equations of what they hold.
#[derive(Debug)]
pub struct Supports<'a> {
    model: &'a Model,
    all: Vec<BodySupport>,
    /// Equations of each body at the nodes that move with supports.
    equations: BTreeMap<usize, Released>,
}

/// Support of one body.
#[derive(Debug)]
struct BodySupport {
    body: usize,
    name: String,
    about_m: [f64; 3],
    shares: Vec<SupportFollower>,
}

/// Node that moves with a held node.
#[derive(Debug, Clone, Copy)]
struct SupportFollower {
    /// Node; the held one itself, or one that follows it.
    at: BodyNode,
    /// Its displacement along each axis where the held node moves by 1.
    weights: [f64; 3],
    /// Position of the held node, m.
    held_m: [f64; 3],
    /// True if the support holds the rotations of the node.
    with_rotations: bool,
}

/// Periodic motion of the bodies.
#[derive(Debug, Clone, Copy)]
pub struct Moving<'a> {
    /// Angular frequency.
    pub omega_rad_s: f64,
    /// Displacements of the free degrees of freedom of each body, m, n x (2H+1): mean, cosine 1,
    /// sine 1, ...
    pub motion_m: &'a [Mat<f64>],
    /// The part of the motion that Rayleigh damping acts on, m, in the same order; stuck modes with
    /// a damping ratio of their own are not in it.
    pub damped_m: &'a [Mat<f64>],
    /// Rayleigh damping of the bodies.
    pub damping: Rayleigh,
}

impl<'a> Supports<'a> {
    /// Supports of a model whose bodies have the prestress of these displacements of all their
    /// nodes, m; `None` for a body without prestress.
    ///
    /// # Errors
    /// The errors of the finite elements at the supports.
    pub fn new(
        model: &'a Model,
        prestressed_m: &[Option<NodeDisplacements>],
    ) -> Result<Self, FemError> {
        let followers = followers(model);
        let bodies = model.bodies.iter().enumerate();
        let supports = bodies.flat_map(|(body, of)| {
            let supports = of.supports.iter().map(move |support| (body, of, support));
            supports.map(|(body, of, support)| {
                let mut shares = Vec::new();
                for (node, axes) in &support.nodes {
                    let share = SupportFollower {
                        at: BodyNode { body, node: *node },
                        weights: axes.map(f64::from),
                        held_m: of.nodes_m[*node as usize],
                        with_rotations: of.dofs.nodes[*node as usize] == NodeMotion::Fixed,
                    };
                    add_share(model, &followers, share, &mut shares);
                }
                BodySupport {
                    body,
                    name: support.name.clone(),
                    about_m: centroid(support.nodes.iter().map(|(n, _)| of.nodes_m[*n as usize])),
                    shares,
                }
            })
        });
        let shares: Vec<BodySupport> = supports.collect();
        let mut nodes: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        for share in shares.iter().flat_map(|support| &support.shares) {
            nodes
                .entry(share.at.body)
                .or_default()
                .insert(share.at.node);
        }
        let rotation = model.rotation.as_ref();
        let equations = nodes.into_iter().map(|(b, nodes)| {
            let prestressed_m = prestressed_m.get(b).and_then(Option::as_ref);
            let body = &model.bodies[b];
            Ok((b, Released::new(body, &nodes, rotation, prestressed_m)?))
        });
        Ok(Self {
            model,
            equations: equations.collect::<Result<_, FemError>>()?,
            all: shares,
        })
    }

    /// Reactions of all supports, then those of springs to ground, in a static displacement of the
    /// free degrees of freedom of each body, m.
    pub fn static_reactions(&self, free: &[Vec<f64>]) -> Vec<Resultant> {
        let column = |u: &Vec<f64>| Mat::from_fn(u.len(), 1, |i, _| u[i]);
        let motion: Vec<Mat<f64>> = free.iter().map(column).collect();
        self.periodic_reactions(&Moving {
            omega_rad_s: 0.0,
            motion_m: &motion,
            damped_m: &motion,
            damping: Rayleigh::NONE,
        })
    }

    /// Reactions of all supports, then those of springs to ground, in a periodic motion under the
    /// excitations of the model.
    pub fn periodic_reactions(&self, moving: &Moving<'_>) -> Vec<Resultant> {
        let residuals = self.equations.iter();
        let residuals: BTreeMap<usize, Mat<f64>> = residuals
            .map(|(body, equations)| (*body, self.residual(*body, equations, moving)))
            .collect();
        let supports = self.all.iter().map(|support| {
            let blocks = 0..moving.motion_m[support.body].ncols();
            let pushed = blocks.map(|block| {
                let shares = support.shares.iter();
                sum(shares.map(|share| self.push(share, support.about_m, block, &residuals)))
            });
            let (about_m, sums) = (support.about_m, pushed.collect());
            resultant(Pusher::Support, &support.name, support.body, about_m, sums)
        });
        let springs = self.model.bodies.iter().enumerate().flat_map(|(b, body)| {
            let springs = body.springs.iter();
            springs.filter_map(move |spring| self.spring_reaction((b, body), spring, moving))
        });
        supports.chain(springs).collect()
    }

    /// Force and moment of a support on one node, in one block of the residuals of the bodies.
    fn push(
        &self,
        share: &SupportFollower,
        about_m: [f64; 3],
        block: usize,
        residuals: &BTreeMap<usize, Mat<f64>>,
    ) -> [[f64; 3]; 2] {
        let BodyNode { body, node } = share.at;
        let (equations, residual) = (&self.equations[&body], &residuals[&body]);
        let residual = residual.col_as_slice(block);
        let at = equations.node_values(node, residual);
        let force = [0, 1, 2].map(|k| share.weights[k] * at[k]);
        let mut moment = cross(sub(share.held_m, about_m), force);
        if share.with_rotations {
            add_scaled(&mut moment, 1.0, equations.rotation_sum(node, residual));
        }
        [force, moment]
    }

    /// Residual of the equations of a body at its nodes in question, N, n x (2H+1).
    fn residual(&self, body: usize, equations: &Released, moving: &Moving<'_>) -> Mat<f64> {
        let whole = &self.model.bodies[body];
        let of = |motion: &Mat<f64>| {
            let columns = 0..motion.ncols();
            let columns: Vec<Vec<f64>> = columns
                .map(|j| equations.motion(whole, motion.col_as_slice(j)))
                .collect();
            Mat::from_fn(equations.load_n.len(), columns.len(), |i, j| columns[j][i])
        };
        let [u, damped] = [moving.motion_m, moving.damped_m].map(|motion| of(&motion[body]));
        let Rayleigh {
            stiffness_s,
            mass_per_s,
        } = moving.damping;
        let strained = strained(&u, &damped, moving.omega_rad_s, stiffness_s);
        let accelerated = accelerated(&u, &damped, moving.omega_rad_s, mass_per_s);
        let mut residual = times(&equations.stiffness, strained.as_ref());
        residual += times(&equations.mass, accelerated.as_ref());
        let mut subtract = |block: usize, factor: f64, load_n: &[f64]| {
            if block < u.ncols() && factor != 0.0 {
                for (r, f) in residual.col_as_slice_mut(block).iter_mut().zip(load_n) {
                    *r -= factor * f;
                }
            }
        };
        subtract(0, 1.0, &equations.load_n);
        if u.ncols() == 1 {
            return residual;
        }
        for excitation in &self.model.excitations {
            let in_time = &excitation.in_time;
            let k = in_time.harmonic;
            let amplitude = in_time.amplitude
                * match in_time.growth {
                    Growth::Constant => 1.0,
                    Growth::Squared => (k as f64 * moving.omega_rad_s).powi(2),
                };
            let loads = excitation.loads.iter().filter(|(on, _)| *on == body);
            for (_, load) in loads {
                let load_n = equations.load(load);
                let (sin, cos) = in_time.phase_rad.sin_cos();
                subtract(cosine(k), amplitude * cos, &load_n);
                subtract(sine(k), amplitude * sin, &load_n);
            }
        }
        residual
    }

    /// Reaction of a spring; `None` where it leads to another group of nodes.
    fn spring_reaction(
        &self,
        (number, body): (usize, &Body),
        spring: &Spring,
        moving: &Moving<'_>,
    ) -> Option<Resultant> {
        let mut nodes: Vec<u32> = match &spring.on {
            SpringSupport::Nodes(nodes) => nodes.clone(),
            SpringSupport::Surface(facets) => facets.concat(),
            SpringSupport::Chain(_) => return None,
        };
        nodes.sort_unstable();
        nodes.dedup();
        let position = |node: u32| body.nodes_m[node as usize];
        let about_m = centroid(nodes.into_iter().map(position));
        let (motion, damped) = (&moving.motion_m[number], &moving.damped_m[number]);
        let stiffness_s = moving.damping.stiffness_s;
        let strained = strained(motion, damped, moving.omega_rad_s, stiffness_s);
        let sums = (0..strained.ncols()).map(|block| {
            let forces = forces_n(body, spring, strained.col_as_slice(block));
            let with_moment = |(node, force): (u32, [f64; 3])| {
                [force, cross(sub(position(node), about_m), force)]
            };
            sum(forces.into_iter().map(with_moment))
        });
        let sums = sums.collect();
        Some(resultant(
            Pusher::Spring,
            &spring.name,
            number,
            about_m,
            sums,
        ))
    }
}

/// Motion u + a v that the stiffness acts on, with v the velocity of the damped part of the motion:
/// of harmonic k, k w times the sine and less the cosine.
fn strained(u: &Mat<f64>, damped: &Mat<f64>, omega_rad_s: f64, stiffness_s: f64) -> Mat<f64> {
    let mut combined = u.clone();
    add_velocity(&mut combined, damped.as_ref(), omega_rad_s, stiffness_s);
    combined
}

/// Motion u'' + b v that the mass acts on.
fn accelerated(u: &Mat<f64>, damped: &Mat<f64>, omega_rad_s: f64, mass_per_s: f64) -> Mat<f64> {
    let mut accelerations = Mat::from_fn(u.nrows(), u.ncols(), |i, block| {
        let k = block.div_ceil(2) as f64;
        -(k * omega_rad_s).powi(2) * u[(i, block)]
    });
    add_velocity(&mut accelerations, damped.as_ref(), omega_rad_s, mass_per_s);
    accelerations
}

fn add_velocity(all: &mut Mat<f64>, u: MatRef<'_, f64>, omega_rad_s: f64, factor: f64) {
    if factor == 0.0 {
        return;
    }
    for k in 1..=u.ncols() / 2 {
        let factor = factor * k as f64 * omega_rad_s;
        for i in 0..u.nrows() {
            all[(i, cosine(k))] += factor * u[(i, sine(k))];
            all[(i, sine(k))] -= factor * u[(i, cosine(k))];
        }
    }
}

/// Nodes that follow each node that has some, with their weights.
fn followers(model: &Model) -> BTreeMap<BodyNode, Vec<(BodyNode, f64)>> {
    let slaves = model.pairs.iter().map(|pair| &pair.slave);
    let mut masters: BTreeMap<BodyNode, Vec<(BodyNode, f64)>> = BTreeMap::new();
    for slave in slaves.chain(&model.bonded) {
        for (master, weight) in &slave.masters {
            masters
                .entry(*master)
                .or_default()
                .push((slave.node, *weight));
        }
    }
    masters
}

/// Adds a node, and the nodes that follow it. A follower does not move along axes on which it is
/// held itself. The model has no circle of followers.
fn add_share(
    model: &Model,
    followers: &BTreeMap<BodyNode, Vec<(BodyNode, f64)>>,
    share: SupportFollower,
    shares: &mut Vec<SupportFollower>,
) {
    shares.push(share);
    for (at, weight) in followers.get(&share.at).into_iter().flatten() {
        let is_held = held_axes(&model.bodies[at.body], at.node);
        let follows = |k: usize| if is_held[k] { 0.0 } else { *weight };
        let weights = [0, 1, 2].map(|k| follows(k) * share.weights[k]);
        if weights != [0.0; 3] {
            let follower = SupportFollower {
                at: *at,
                weights,
                with_rotations: false,
                ..share
            };
            add_share(model, followers, follower, shares);
        }
    }
}

/// Axes along which a free node is held.
fn held_axes(body: &Body, node: u32) -> [bool; 3] {
    let free = body.dofs.free(node);
    [0, 1, 2]
        .map(|k| free.is_some_and(|n| body.held_dofs.binary_search(&(3 * n as u32 + k)).is_ok()))
}

fn centroid(positions: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0);
    for x in positions {
        add_scaled(&mut sum, 1.0, x);
        count += 1;
    }
    sum.map(|x| x / f64::from(count))
}

/// Sum of forces and of moments.
fn sum(all: impl Iterator<Item = [[f64; 3]; 2]>) -> [[f64; 3]; 2] {
    let mut sum = [[0.0; 3]; 2];
    for both in all {
        for (sum, v) in sum.iter_mut().zip(both) {
            add_scaled(sum, 1.0, v);
        }
    }
    sum
}

fn resultant(
    pusher: Pusher,
    name: &str,
    body: usize,
    about_m: [f64; 3],
    sums: Vec<[[f64; 3]; 2]>,
) -> Resultant {
    Resultant {
        pusher,
        name: name.to_owned(),
        body,
        about_m,
        force_n: sums.iter().map(|[force, _]| *force).collect(),
        moment_nm: sums.into_iter().map(|[_, moment]| moment).collect(),
    }
}
