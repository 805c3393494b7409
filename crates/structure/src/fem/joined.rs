//! Joints of the bodies of a model, and their loads, on their free degrees of freedom.

use super::loads::add_load;
use super::{FemError, expand_to_nodes, given};
use crate::model::{
    AppliedLoad, BladeInfluence, BodyNode, ContactPair, Dashpot, MatrixOrigin, Model,
    ModelExcitation, NodeMotion, Observation, Side, Slave,
};
use crate::reduction::craig_bampton::fixed_interface_modes;
use crate::structure::{
    BodyMatrices, BodyVectors, InterfaceNode, Joint, ObservedWork, SteadyPart, Structure,
};
use dovetail_dynamics::reduced::SteadyCause;
use dovetail_numerics::space::signed_longest;
use dovetail_numerics::sparse::symmetric_product;
use faer::Mat;

/// Bodies with the joints, the excitations and the observed points of the model that their matrices
/// belong to.
///
/// # Errors
/// [`FemError::ContactNodeNotFree`]; modes on which the air acts that are not found.
pub fn join(model: &Model, bodies: Vec<BodyMatrices>) -> Result<Structure, FemError> {
    let nothing = || -> BodyVectors { bodies.iter().map(|b| vec![0.0; b.dofs()]).collect() };
    let steady_parts = steady_parts(model, &bodies);
    let excitation = |excitation: &ModelExcitation| {
        let mut load = nothing();
        for (body, applied) in &excitation.loads {
            add_load(&model.bodies[*body], applied, &mut load[*body]);
        }
        zero_held_loads(model, &mut load);
        load
    };
    let displacement = |terms: &[(BodyNode, [f64; 3])]| {
        let mut load = nothing();
        for &(BodyNode { body, node }, vector_n) in terms {
            let unit = AppliedLoad::Point { node, vector_n };
            add_load(&model.bodies[body], &unit, &mut load[body]);
        }
        load
    };
    let observation = |observation: &Observation| ObservedWork {
        name: observation.name.clone(),
        quantity: observation.quantity,
        load: displacement(&observation.terms),
    };
    let dashpot = |dashpot: &Dashpot| {
        let mut load = displacement(&dashpot.terms);
        zero_held_loads(model, &mut load);
        (dashpot.damping_n_s_m, load)
    };
    let influence = model.cyclic.as_ref().and_then(|c| c.influence.as_ref());
    let influenced = influence.map(|influence| influenced(model, influence, &bodies));
    Ok(Structure {
        joints: joints(model)?,
        steady_parts,
        excitations: model.excitations.iter().map(excitation).collect(),
        observations: model.observations.iter().map(observation).collect(),
        dashpots: model.dashpots.iter().map(dashpot).collect(),
        influenced: influenced.transpose()?.unwrap_or_default(),
        bodies,
    })
}

/// Joints of a model.
///
/// # Errors
/// [`FemError::ContactNodeNotFree`].
pub(super) fn joints(model: &Model) -> Result<Vec<Joint>, FemError> {
    let pairs = model.pairs.iter();
    let pairs = pairs.map(|pair| (&pair.slave, Some(pair_rotation(pair))));
    let tied = model.cyclic.iter().flat_map(|cyclic| &cyclic.ties);
    let bonded = model.bonded.iter().chain(tied).map(|slave| (slave, None));
    let joints = pairs.chain(bonded);
    joints
        .map(|(slave, turned)| joint(model, slave, turned))
        .collect()
}

/// Loads on the bodies whose work on a motion is the amplitude of a mode on which the air acts: `M phi`
/// times the longest displacement of phi, of unit modal mass, so that the amplitude is that of the
/// node that moves farthest.
fn influenced(
    model: &Model,
    influence: &BladeInfluence,
    bodies: &[BodyMatrices],
) -> Result<Vec<BodyVectors>, FemError> {
    let body = &bodies[influence.body];
    let asked = influence.modes.last().copied().unwrap_or(0);
    let modes = fixed_interface_modes(body, asked).map_err(|source| FemError::InfluencedModes {
        body: body.name.clone(),
        source,
    })?;
    if modes.count() < asked {
        return Err(FemError::NoInfluencedMode {
            body: body.name.clone(),
            asked,
            available: modes.count(),
        });
    }
    let interior = body.interior_dofs();
    let shapes = Mat::from_fn(body.dofs(), influence.modes.len(), |i, j| {
        match i < interior {
            true => modes.vectors[(i, influence.modes[j] - 1)],
            false => 0.0,
        }
    });
    let inert = symmetric_product(&body.mass, shapes.as_ref());
    let on_bodies = |j: usize| {
        let still = bodies.iter().map(|b| vec![0.0; b.dofs()]);
        let mut loads: BodyVectors = still.collect();
        let on_nodes = expand_to_nodes(&model.bodies[influence.body].dofs, shapes.col_as_slice(j));
        let longest = signed_longest(&on_nodes);
        let scaled = inert.col_as_slice(j).iter().map(|f| longest * f);
        loads[influence.body] = scaled.collect();
        loads
    };
    Ok((0..influence.modes.len()).map(on_bodies).collect())
}

/// Takes a load from the degrees of freedom that do not move.
fn zero_held_loads(model: &Model, load: &mut BodyVectors) {
    for (body, load) in model.bodies.iter().zip(load) {
        super::zero_held_loads(body, load);
    }
}

/// Parts of the steady load: that of the rotation, the loads of the description in their order, and
/// what comes with matrices of another program.
fn steady_parts(model: &Model, bodies: &[BodyMatrices]) -> Vec<SteadyPart> {
    let nothing = || -> BodyVectors { bodies.iter().map(|b| vec![0.0; b.dofs()]).collect() };
    let mut parts = Vec::new();
    if let Some(rotation) = &model.rotation {
        let mut load = nothing();
        for (load, body) in load.iter_mut().zip(bodies) {
            for (f, unit) in load.iter_mut().zip(&body.centrifugal_n_s2) {
                *f = *unit;
            }
        }
        parts.push(SteadyPart {
            cause: SteadyCause::Rotation,
            load,
            working: rotation.speed_rad_s * rotation.speed_rad_s,
        });
    }
    let numbers = model.bodies.iter().flat_map(|body| &body.loads);
    let count = numbers.map(|(number, _)| number + 1).max().unwrap_or(0);
    for number in 0..count {
        let mut load = nothing();
        for (body, load) in model.bodies.iter().zip(&mut load) {
            for (_, own) in body.loads.iter().filter(|(of, _)| *of == number) {
                add_load(body, own, load);
            }
        }
        zero_held_loads(model, &mut load);
        parts.push(SteadyPart {
            cause: SteadyCause::Load(number),
            load,
            working: 1.0,
        });
    }
    let mut with_matrices = nothing();
    for (body, load) in model.bodies.iter().zip(&mut with_matrices) {
        if let MatrixOrigin::Given(placed) = &body.matrices {
            *load = given::steady_load(body, placed);
        }
    }
    zero_held_loads(model, &mut with_matrices);
    if with_matrices.iter().flatten().any(|f| *f != 0.0) {
        parts.push(SteadyPart {
            cause: SteadyCause::Matrices,
            load: with_matrices,
            working: 1.0,
        });
    }
    parts
}

/// Joint of a slave. Masters on a support are left out, because a slave does not move with them.
fn joint(model: &Model, slave: &Slave, turned: Option<[[f64; 3]; 3]>) -> Result<Joint, FemError> {
    let disc = model.cyclic.as_ref();
    let at = |BodyNode { body, node }: BodyNode| {
        let of = &model.bodies[body];
        let free = of
            .dofs
            .free(node)
            .ok_or_else(|| FemError::ContactNodeNotFree {
                body: of.name.clone(),
                node: of.node_tags[node as usize],
            })?;
        Ok(InterfaceNode { body, node: free })
    };
    let masters = slave.masters.iter().filter(|(master, _)| {
        let nodes = &model.bodies[master.body].dofs.nodes;
        nodes.get(master.node as usize) != Some(&NodeMotion::Fixed)
    });
    let masters = masters.map(|&(master, weight)| Ok((at(master)?, weight)));
    Ok(Joint {
        slave: at(slave.node)?,
        masters: masters.collect::<Result<_, FemError>>()?,
        turned,
        across: disc.and_then(|disc| disc.sector(slave.ahead)),
    })
}

/// Matrix that turns the relative displacements of a pair into those of its slave node.
fn pair_rotation(pair: &ContactPair) -> [[f64; 3]; 3] {
    let sign = match pair.side {
        Side::First => 1.0,
        Side::Second => -1.0,
    };
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| sign * pair.frame[j][i]))
}
