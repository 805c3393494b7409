//! Disc of equal sectors, computed from one of them.
//!
//! In a motion of nodal diameter d of a disc of N sectors, sector j moves as sector 0 does times
//! `exp(i j theta)`, each in axes of its own, with `theta = 2 pi d / N` (D. L. Thomas, Int. J. Numer.
//! Meth. Engng 14 (1979) 81-102). A joint whose masters belong to the sector that lies `a` sectors
//! ahead therefore reads, with the matrix Q that turns the axes of that sector to those of this one,
//!
//! ```text
//! u_s = R^T X + exp(i a theta) Q sum_k w_k u_k
//! ```
//!
//! With `u = c + i s` that is a real structure of two copies of the bodies, one for c and one for
//! s, whose joints lead from one copy to the other:
//!
//! ```text
//! c_s = R^T X_c + cos(a theta) Q sum_k w_k c_k - sin(a theta) Q sum_k w_k s_k
//! s_s = R^T X_s + sin(a theta) Q sum_k w_k c_k + cos(a theta) Q sum_k w_k s_k
//! ```
//!
//! Its matrices are [[A, -B], [B, A]], where A + i B is the Hermitian matrix of the sector, so that
//! each of its frequencies is there twice: the two are the travelling wave at two phases. Where
//! theta is 0 or pi, s is free of c and one copy is enough. Sectors that turn the other way round,
//! N - d, have the same frequencies, because the Coriolis force is left out.

use std::borrow::Cow;
use std::f64::consts::TAU;

use dovetail_dynamics::reduced::waves::nodal_diameter_of;
use faer::Mat;

use super::assembly::reduce_copies;
use super::{Reduction, ReductionError, StuckModes, stuck_shapes};
use crate::structure::{BodyMatrices, BodyVectors, InterfaceNode, Joint, ObservedWork, Structure};

/// Squared angular frequencies of the `count` lowest modes of a disc with all pairs stuck, rad2/s2,
/// ascending. The structure is one of its `sectors`, and the motion has this nodal diameter.
///
/// # Errors
/// See [`ReductionError`].
pub fn modes_of_nodal_diameter(
    structure: &Structure,
    sectors: usize,
    nodal_diameter: usize,
    count: usize,
) -> Result<Vec<f64>, ReductionError> {
    Ok(wave_modes(structure, sectors, nodal_diameter, count)?.omega2)
}

/// Modes of a disc at one nodal diameter. The first sector moves as `c cos wt - s sin wt`, and sector j
/// as `(c + i s) exp(i j theta)` does.
#[derive(Debug)]
pub struct WaveModes {
    /// Squared angular frequencies, rad2/s2, ascending.
    pub omega2: Vec<f64>,
    /// Real part c on the free degrees of freedom of each body, a column for each mode.
    pub real: Vec<Mat<f64>>,
    /// Imaginary part s.
    pub imaginary: Vec<Mat<f64>>,
}

/// Lowest `count` modes of a disc with all pairs stuck, with their shapes, as
/// [`modes_of_nodal_diameter`] has their frequencies.
///
/// # Errors
/// See [`ReductionError`].
pub fn wave_modes(
    structure: &Structure,
    sectors: usize,
    nodal_diameter: usize,
    count: usize,
) -> Result<WaveModes, ReductionError> {
    match nodal_diameter_structure(structure, sectors, nodal_diameter) {
        DiameterModel::Standing(sector) => {
            let (omega2, real) = stuck_shapes(&sector, count, None)?;
            let still = real.iter().map(|u| Mat::zeros(u.nrows(), u.ncols()));
            Ok(WaveModes {
                imaginary: still.collect(),
                omega2,
                real,
            })
        }
        DiameterModel::Travelling(copies) => {
            let (omega2, shapes) = stuck_shapes(&copies, 2 * count, None)?;
            // Of each two modes of one frequency the first, which is the wave at some phase.
            let first = |u: &Mat<f64>| {
                let modes = u.ncols().div_ceil(2).min(count);
                Mat::from_fn(u.nrows(), modes, |i, mode| u[(i, 2 * mode)])
            };
            let bodies = structure.bodies.len();
            Ok(WaveModes {
                omega2: omega2.into_iter().step_by(2).take(count).collect(),
                real: shapes[..bodies].iter().map(first).collect(),
                imaginary: shapes[bodies..].iter().map(first).collect(),
            })
        }
    }
}

/// Sector at a nodal diameter.
enum DiameterModel<'a> {
    /// All sectors move in phase, or each against its neighbours.
    Standing(Cow<'a, Structure>),
    /// Two copies of the bodies, each for a part of the complex motion.
    Travelling(Structure),
}

fn nodal_diameter_structure(
    structure: &Structure,
    sectors: usize,
    nodal_diameter: usize,
) -> DiameterModel<'_> {
    let nodal_diameter = nodal_diameter_of(nodal_diameter, sectors);
    if nodal_diameter == 0 {
        return DiameterModel::Standing(Cow::Borrowed(structure));
    }
    if 2 * nodal_diameter == sectors {
        let mut against = structure.clone();
        for joint in &mut against.joints {
            let odd = |ahead: i32| ahead.rem_euclid(2) == 1;
            let across = joint.across.as_mut().filter(|sector| odd(sector.ahead));
            if let Some(sector) = across {
                *sector = sector.times(-1.0);
            }
        }
        return DiameterModel::Standing(Cow::Owned(against));
    }
    DiameterModel::Travelling(copies(structure, sectors, nodal_diameter))
}

/// Reduced model of a disc at a nodal diameter above 0: that of two copies of a sector
/// ([`waves`](dovetail_dynamics::reduced::waves)). Pairs, loads, observed points and dashpots of the first copy come
/// first. The structure is one of the `sectors`, and numbers of modes are those of one sector.
///
/// # Errors
/// See [`ReductionError`].
pub fn reduce_wave(
    structure: &Structure,
    sectors: usize,
    nodal_diameter: usize,
    stuck_modes: StuckModes,
) -> Result<Reduction, ReductionError> {
    let copies = Structure {
        excitations: duplicate(&structure.excitations, |vectors| vectors),
        observations: duplicate(&structure.observations, |observed: &mut ObservedWork| {
            &mut observed.load
        }),
        dashpots: duplicate(&structure.dashpots, |dashpot: &mut (f64, BodyVectors)| {
            &mut dashpot.1
        }),
        influenced: duplicate(&structure.influenced, |vectors| vectors),
        ..copies(structure, sectors, nodal_diameter)
    };
    reduce_copies(Cow::Owned(copies), stuck_modes, 2, None)
}

/// Structure of two copies of a sector for a nodal diameter, without loads.
fn copies(structure: &Structure, sectors: usize, nodal_diameter: usize) -> Structure {
    // The sine of a multiple of half a turn is no rounding.
    let phase = |ahead: i32| {
        let waves = i64::from(ahead) * nodal_diameter as i64;
        let (sine, cosine) = (TAU * waves as f64 / sectors as f64).sin_cos();
        match (2 * waves) % sectors as i64 {
            0 => (0.0, cosine),
            _ => (sine, cosine),
        }
    };
    let count = structure.bodies.len();
    let in_copy = |copy: usize, at: InterfaceNode| InterfaceNode {
        body: at.body + copy * count,
        ..at
    };
    let joint = |copy: usize, joint: &Joint| {
        let mut masters = Vec::new();
        let shares = match joint.across {
            None => [f64::from(copy == 0), f64::from(copy == 1)],
            Some(sector) => {
                let (sine, cosine) = phase(sector.ahead);
                [[cosine, -sine], [sine, cosine]][copy]
            }
        };
        for (of, share) in shares.into_iter().enumerate().filter(|(_, s)| *s != 0.0) {
            let masters_of_joint = joint.masters.iter();
            masters.extend(masters_of_joint.map(|&(at, weight)| (in_copy(of, at), share * weight)));
        }
        Joint {
            slave: in_copy(copy, joint.slave),
            masters,
            ..joint.clone()
        }
    };
    let joints = [0, 1].map(|copy| structure.joints.iter().map(move |j| joint(copy, j)));
    let of_copies = structure.bodies.iter().chain(&structure.bodies);
    let unloaded = of_copies.map(|body| BodyMatrices {
        load_n: vec![0.0; body.load_n.len()],
        ..body.clone()
    });
    Structure {
        bodies: unloaded.collect(),
        joints: joints.into_iter().flatten().collect(),
        steady_parts: Vec::new(),
        excitations: Vec::new(),
        observations: Vec::new(),
        dashpots: Vec::new(),
        influenced: Vec::new(),
    }
}

/// Vectors on the bodies of a sector, on the first of two copies and then on the second one. `of` are
/// the vectors of an item.
fn duplicate<T: Clone>(items: &[T], of: impl Fn(&mut T) -> &mut BodyVectors) -> Vec<T> {
    let on_copy = |copy: usize, item: &T| {
        let mut item = item.clone();
        let vectors = std::mem::take(of(&mut item));
        let still = vectors.iter().map(|body| vec![0.0; body.len()]).collect();
        let both = match copy {
            0 => [vectors, still],
            _ => [still, vectors],
        };
        *of(&mut item) = both.concat();
        item
    };
    let copies = [0, 1].map(|copy| items.iter().map(|item| on_copy(copy, item)).collect());
    let copies: [Vec<T>; 2] = copies;
    copies.concat()
}
