//! Bodies joined by their contacts, condensed on the relative displacements of the pairs.
//!
//! With the unknowns (g, X) of the [`Transformation`], K and M are sparse matrices of the whole
//! assembly. With X = 0, all pairs stuck, the meshes are one. Then
//!
//! ```text
//! g = Psi X + Phi q     Psi = -K_gg^-1 K_gx     Phi: modes of (K_gg, M_gg), all pairs stuck
//!
//! K X + M X'' + p q'' + lambda = F         K = K_xx + K_xg Psi      F = f_x + Psi^T f_g
//! q'' + w^2 q + p^T X'' = Phi^T f_g        p = (M_xg + Psi^T M_gg) Phi
//! M = M_xx + M_xg Psi + Psi^T M_gx + Psi^T M_gg Psi
//! ```
//!
//! is the Craig-Bampton reduction of the assembly with X for its interface (lambda acts on X alone:
//! on +X of the first body and on -X of the second). The lowest modes are followed by the [residual
//! vectors](super::residual) of the loads and of the observed points. With Rayleigh damping a K + b
//! M and q eliminated at the frequency w, `Lambda X + lambda = F - sum_m c_m fm_m / d_m`, where
//! `Lambda = (1 + i w a) K - (w^2 - i w b) M - sum_m c_m c_m^T / d_m`,
//! `d_m = (1 + i w a) w_m^2 - (w^2 - i w b)`, `c_m = -(w^2 - i w b) p_m`,
//! `q_m = (fm_m - c_m . X) / d_m`.

use std::borrow::Cow;

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::craig_bampton::{self, CraigBamptonBody, check_size, side_by_side};
use super::recovery::Recovery;
use super::residual::{ResidualVectors, residual_vectors};
use super::transformation::{Transformation, Zeros};
use super::truncation::{self, ModalTruncation};
use super::{Highest, Reduction, ReductionError, StuckModes};
use crate::structure::{BodyMatrices, BodyVectors, Joint, Structure};
use dovetail_dynamics::reduced::{Dashpots, Load, ObservedPoint, ReducedModel, StaticPart, Waves};
use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::eigen::{LastModes, Modes, lowest_modes, more_modes, unknowns_with_mass};
use dovetail_numerics::sparse::{
    Cholesky, FactorError, Symbolic, condense, leading, submatrix, symmetric_product, times,
};

/// Largest number of stuck modes, and how far above the highest frequency they reach, where the
/// scene gives no number.
const MOST_MODES: usize = 192;
const REACH: f64 = 4.0;
/// Estimated error of amplitudes that is small enough.
const ACCURATE: f64 = 1e-4;

/// Reduces the assembly to X and its stuck modes. Of a structure that is given away, the matrices of
/// the bodies are dropped as soon as those of the assembly are made, which lowers the peak of memory.
///
/// # Errors
/// See [`ReductionError`].
pub fn reduce<'a>(
    structure: impl Into<Cow<'a, Structure>>,
    stuck_modes: StuckModes,
) -> Result<Reduction, ReductionError> {
    reduce_copies(structure.into(), stuck_modes, 1, None)
}

/// Reduces the assembly as [`reduce`] does, in the order of its [`analyse`]d stiffness. An analysis of
/// another number of unknowns is not used.
///
/// # Errors
/// See [`ReductionError`].
pub fn reduce_analysed<'a>(
    structure: impl Into<Cow<'a, Structure>>,
    stuck_modes: StuckModes,
    analysis: Option<&Symbolic>,
) -> Result<Reduction, ReductionError> {
    reduce_copies(structure.into(), stuck_modes, 1, analysis)
}

/// Order and symbolic analysis of the stiffness K_gg of an assembly, with places for its mass. They
/// depend only on the pattern of entries: they serve whatever stresses the bodies. `None` where a body
/// is reduced by itself, which leaves little to analyse, and where the reduction will say what is wrong.
pub fn analyse(bodies: &[BodyMatrices], joints: &[Joint]) -> Option<Symbolic> {
    let is_whole = |body: &BodyMatrices| body.fixed_interface_modes.is_none();
    if !bodies.iter().all(is_whole) {
        return None;
    }
    let whole: Vec<Coordinates> = bodies.iter().map(|_| Coordinates::Full).collect();
    let transformation = transformation(bodies, joints, &whole).ok()?;
    let stiffness = bodies.iter().map(BodyMatrices::stiffness_with_places);
    let stiffness: Vec<_> = stiffness.collect();
    Symbolic::analyse(&assemble_gg(&transformation, &stiffness, Zeros::Kept)).ok()
}

/// Reduces an assembly of so many copies of a structure, each of whose modes stands as many times, as
/// [`reduce`] does. Numbers of modes are those of one copy.
pub(super) fn reduce_copies(
    mut structure: Cow<'_, Structure>,
    stuck_modes: StuckModes,
    copies: usize,
    analysis: Option<&Symbolic>,
) -> Result<Reduction, ReductionError> {
    let (joined, mut condensed) = Joined::new(&mut structure, analysis)?;
    let structure = &*structure;
    let condensed_loads = joined.condensed_loads(&BodyLoads::new(structure));
    let static_parts = joined.static_parts(structure);
    let mut count = copies * stuck_modes.count.unwrap_or(StuckModes::LEAST);
    let mut known = Modes::none(joined.inner());
    // Without equal modes of other bodies, some of a body's own would be left out.
    let last = match stuck_modes.count {
        Some(_) => LastModes::Given,
        None => LastModes::WithEqual,
    };
    let with_mass = unknowns_with_mass(&joined.m_gg);
    loop {
        let (k, m) = (&joined.k_gg, &joined.m_gg);
        let modes = more_modes(k, m, count, &joined.factor, &known, last)
            .map_err(|source| ReductionError::Stuck { source })?;
        let are_all = modes.count() < count || modes.count() == with_mass;
        count = count.max(modes.count());
        let last_try = stuck_modes.count.is_some() || are_all || count >= copies * MOST_MODES;
        let reaches = |highest: Highest| {
            let reach = REACH * highest.rad_s(&modes.omega2);
            modes.omega2.last().is_none_or(|w2| *w2 >= reach * reach)
        };
        let of_harmonics = count >= copies * StuckModes::OF_HARMONICS || reaches(stuck_modes.kept);
        let reached = reaches(stuck_modes.excited) && of_harmonics;
        if reached || last_try {
            let (on_modes, amplitude) = joined.project_on_modes(
                structure,
                condensed,
                &condensed_loads,
                modes,
                stuck_modes,
            )?;
            let amplitude = if are_all { Some(0.0) } else { amplitude };
            if last_try || amplitude.is_some_and(|error| error <= ACCURATE) {
                let mut reduction = joined.finish(structure, on_modes, amplitude);
                reduction.model.static_parts = static_parts;
                return Ok(reduction);
            }
            known = Modes {
                omega2: on_modes.reduced.stuck_omega2().to_vec(),
                vectors: on_modes
                    .modes
                    .get(.., ..on_modes.reduced.stuck_modes)
                    .to_owned(),
            };
            condensed = [on_modes.reduced.stiffness, on_modes.reduced.mass];
        } else {
            known = modes;
        }
        count *= 2;
    }
}

/// Squared angular frequencies of the `count` lowest stuck modes of the assembly alone, rad2/s2.
///
/// # Errors
/// See [`ReductionError`].
pub fn stuck_modes(structure: &Structure, count: usize) -> Result<Vec<f64>, ReductionError> {
    Ok(stuck_shapes(structure, count, None)?.0)
}

/// Lowest `count` stuck modes of the assembly alone: squared angular frequencies, rad2/s2, and the
/// shapes of modal mass 1 on all free degrees of freedom of each body, a column for each mode.
/// `analysis` is that of [`analyse`], if it is known.
///
/// # Errors
/// See [`ReductionError`].
pub fn stuck_shapes(
    structure: &Structure,
    count: usize,
    analysis: Option<&Symbolic>,
) -> Result<(Vec<f64>, Vec<Mat<f64>>), ReductionError> {
    let bodies = coordinates(structure, &BodyLoads::new(structure))?;
    let stuck = Stuck::new(structure, &bodies, analysis)?;
    let transformation = &stuck.transformation;
    let masses = matrices_of(structure, &bodies, BodyMatrix::Mass);
    let m_gg = assemble_gg(transformation, &masses, Zeros::LeftOut);
    let modes = lowest_modes(&stuck.k_gg, &m_gg, count, &stuck.factor);
    let modes = modes.map_err(|source| ReductionError::Stuck { source })?;
    let outer = transformation.unknowns() - transformation.inner();
    let still = Mat::zeros(outer, modes.count());
    let moved = transformation.scatter(modes.vectors.as_ref(), still.as_ref());
    let whole = moved.into_iter().zip(&bodies).map(|(u, body)| match body {
        Coordinates::Full => u,
        Coordinates::Reduced(body) => body.interior.motion(u.as_ref()),
    });
    Ok((modes.omega2, whole.collect()))
}

/// Linear static displacement (m) of all free dofs of each body under the steady load, with all
/// pairs stuck. No body is reduced by itself. `analysis` is that of [`analyse`], if it is known.
///
/// # Errors
/// See [`ReductionError`].
pub fn stuck_displacement(
    structure: &Structure,
    analysis: Option<&Symbolic>,
) -> Result<Vec<Vec<f64>>, ReductionError> {
    let full = structure.bodies.iter().map(|body| {
        check_size(body)?;
        Ok(Coordinates::Full)
    });
    let bodies = full.collect::<Result<Vec<_>, ReductionError>>()?;
    let stuck = Stuck::new(structure, &bodies, analysis)?;
    let loads: Vec<Vec<f64>> = structure.bodies.iter().map(|b| b.load_n.clone()).collect();
    let (mut g, on_x) = stuck.transformation.gather(&loads);
    stuck.factor.solve_vector(&mut g);
    let g = MatRef::from_column_major_slice(&g, g.len(), 1);
    let still = Mat::zeros(on_x.len(), 1);
    let displacements = stuck.transformation.scatter(g, still.as_ref()).into_iter();
    Ok(displacements.map(|u| u.col_as_slice(0).to_vec()).collect())
}

/// Assembly with all pairs stuck, without X.
struct Stuck {
    transformation: Transformation,
    k_gg: CscMatrix<f64>,
    factor: Cholesky,
}

impl Stuck {
    fn new(
        structure: &Structure,
        bodies: &[Coordinates],
        analysis: Option<&Symbolic>,
    ) -> Result<Self, ReductionError> {
        let transformation = transformation(&structure.bodies, &structure.joints, bodies)?;
        let stiffness = matrices_of(structure, bodies, BodyMatrix::Stiffness);
        let k_gg = assemble_gg(&transformation, &stiffness, Zeros::Kept);
        let factor = reuse_or_analyse(analysis, k_gg.ncols(), || Symbolic::analyse(&k_gg))
            .and_then(|symbolic| symbolic.cholesky(&k_gg))
            .map_err(|e| not_held_error(structure, bodies, &transformation, e))?;
        Ok(Self {
            transformation,
            k_gg,
            factor,
        })
    }
}

/// Matrix K_gg or M_gg, from those of the bodies.
fn assemble_gg(
    transformation: &Transformation,
    matrices: &[Cow<'_, CscMatrix<f64>>],
    zeros: Zeros,
) -> CscMatrix<f64> {
    let whole = transformation.congruent(matrices, zeros);
    leading(whole, transformation.inner())
}

/// Loads of the assembly, each as a vector on each body: the steady one, one unit of each
/// excitation, and for each observed point, each dashpot and each mode on which the air acts the load
/// whose work on a motion is the displacement that is observed, or that the dashpot or the air acts
/// on.
struct BodyLoads<'a>(Vec<Vec<&'a [f64]>>);

impl<'a> BodyLoads<'a> {
    fn new(structure: &'a Structure) -> Self {
        let on_bodies = |vectors: &'a BodyVectors| vectors.iter().map(Vec::as_slice).collect();
        let steady = structure.bodies.iter().map(|b| b.load_n.as_slice());
        let excitations = structure.excitations.iter().map(on_bodies);
        let observations = structure.observations.iter();
        let observations = observations.map(|observed| on_bodies(&observed.load));
        let dashpots = structure.dashpots.iter().map(|(_, load)| on_bodies(load));
        let steady = std::iter::once(steady.collect());
        let influenced = structure.influenced.iter().map(on_bodies);
        let vibrating = excitations.chain(observations).chain(dashpots);
        let vibrating = vibrating.chain(influenced);
        Self(steady.chain(vibrating).collect())
    }

    /// All loads on one body, side by side.
    fn body_loads(&self, body: usize) -> Mat<f64> {
        let columns: Vec<&[f64]> = self.0.iter().map(|load| load[body]).collect();
        Mat::from_fn(columns[0].len(), columns.len(), |i, j| columns[j][i])
    }
}

/// Coordinates that a body has in the assembly.
enum Coordinates {
    /// All free degrees of freedom.
    Full,
    Reduced(Box<CraigBamptonBody>),
}

#[derive(Clone, Copy)]
enum BodyMatrix {
    Stiffness,
    Mass,
}

fn coordinates(
    structure: &Structure,
    loads: &BodyLoads<'_>,
) -> Result<Vec<Coordinates>, ReductionError> {
    let one = |b: usize| {
        let body = &structure.bodies[b];
        check_size(body)?;
        Ok(match body.fixed_interface_modes {
            None => Coordinates::Full,
            Some(modes) => {
                let loads = loads.body_loads(b);
                let reduced = craig_bampton::condense(body, modes, loads.as_ref())?;
                Coordinates::Reduced(Box::new(reduced))
            }
        })
    };
    (0..structure.bodies.len())
        .into_par_iter()
        .map(one)
        .collect()
}

/// Matrices of the bodies in their coordinates, the stiffness with places for the mass.
fn matrices_of<'a>(
    structure: &'a Structure,
    bodies: &'a [Coordinates],
    which: BodyMatrix,
) -> Vec<Cow<'a, CscMatrix<f64>>> {
    let of_body =
        |(body, coordinates): (&'a BodyMatrices, &'a Coordinates)| match (coordinates, which) {
            (Coordinates::Full, BodyMatrix::Stiffness) => body.stiffness_with_places(),
            (Coordinates::Full, BodyMatrix::Mass) => Cow::Borrowed(&body.mass),
            (Coordinates::Reduced(body), BodyMatrix::Stiffness) => Cow::Borrowed(&body.stiffness),
            (Coordinates::Reduced(body), BodyMatrix::Mass) => Cow::Borrowed(&body.mass),
        };
    structure.bodies.iter().zip(bodies).map(of_body).collect()
}

/// The analysis of so many unknowns that is known, or else one that is made.
fn reuse_or_analyse(
    known: Option<&Symbolic>,
    unknowns: usize,
    analyse: impl FnOnce() -> Result<Symbolic, FactorError>,
) -> Result<Symbolic, FactorError> {
    let known = known.filter(|symbolic| symbolic.unknowns() == unknowns);
    known.cloned().map_or_else(analyse, Ok)
}

fn transformation(
    bodies: &[BodyMatrices],
    joints: &[Joint],
    coordinates: &[Coordinates],
) -> Result<Transformation, ReductionError> {
    let size = |(body, coordinates): (&BodyMatrices, &Coordinates)| match coordinates {
        Coordinates::Full => body.dofs(),
        Coordinates::Reduced(reduced) => reduced.stiffness.ncols(),
    };
    let sizes: Vec<usize> = bodies.iter().zip(coordinates).map(size).collect();
    Transformation::new(bodies, joints, &sizes, |at| {
        let body = &bodies[at.body];
        let on_interface = at.node.checked_sub(body.interior_nodes)?;
        let first = match &coordinates[at.body] {
            Coordinates::Full => at.node,
            Coordinates::Reduced(_) => on_interface,
        };
        (3 * at.node < body.dofs()).then_some(3 * first)
    })
}

/// Error that names what is not held, or is unstable, by the body and the node at which the
/// factorisation stopped.
fn not_held_error(
    structure: &Structure,
    bodies: &[Coordinates],
    transformation: &Transformation,
    error: FactorError,
) -> ReductionError {
    let (FactorError::NotPositiveDefinite { dof } | FactorError::Singular { dof, .. }) = error
    else {
        return ReductionError::Assembly { source: error };
    };
    let (b, coordinate) = transformation.origin(dof).unwrap_or((0, 0));
    let body = &structure.bodies[b];
    let before = match &bodies[b] {
        Coordinates::Full => 0,
        Coordinates::Reduced(_) => body.interior_nodes,
    };
    ReductionError::NotHeld {
        body: body.name.clone(),
        node: body.node_tag(before + coordinate / 3),
    }
}

/// Drops the matrices of the bodies that the assembly has in all their degrees of freedom.
fn give_up(structure: &mut Structure, bodies: &[Coordinates]) {
    for (body, coordinates) in structure.bodies.iter_mut().zip(bodies) {
        if matches!(coordinates, Coordinates::Full) {
            body.stiffness = CscMatrix::zeros(0, 0);
            body.mass = CscMatrix::zeros(0, 0);
        }
    }
}

/// Assembly on (g, X).
struct Joined {
    bodies: Vec<Coordinates>,
    transformation: Transformation,
    factor: Cholesky,
    k_gg: CscMatrix<f64>,
    m_gg: CscMatrix<f64>,
    k_gx: CscMatrix<f64>,
    k_xg: CscMatrix<f64>,
    m_xg: CscMatrix<f64>,
}

/// Condensed loads of the assembly: the steady one, the excitations, the observed points, the
/// dashpots, the modes on which the air acts.
struct CondensedLoads {
    /// Loads on g, side by side.
    on_g: Mat<f64>,
    /// Static answers K_gg^-1 to these loads.
    answers: Mat<f64>,
    /// Loads on X, including what g transfers.
    on_x: Vec<Vec<f64>>,
}

/// Reduced model with its modes.
struct ModalModel {
    reduced: ReducedModel,
    /// Modes of [`ReducedModel::omega2`] on g, side by side.
    modes: Mat<f64>,
    load_n: Vec<f64>,
}

impl Joined {
    /// Assembly, with its stiffness and mass condensed on X. Takes the matrices of the bodies from a
    /// structure that is owned.
    fn new(
        structure: &mut Cow<'_, Structure>,
        analysis: Option<&Symbolic>,
    ) -> Result<(Self, [Mat<f64>; 2]), ReductionError> {
        let bodies = coordinates(structure, &BodyLoads::new(structure))?;
        let transformation = transformation(&structure.bodies, &structure.joints, &bodies)?;
        let body_stiffness = matrices_of(structure, &bodies, BodyMatrix::Stiffness);
        let stiffness = transformation.congruent(&body_stiffness, Zeros::Kept);
        let inner: Vec<usize> = (0..transformation.inner()).collect();
        let outer: Vec<usize> = (transformation.inner()..transformation.unknowns()).collect();
        // The analysis keeps one thread busy.
        let (symbolic, (mass, k_gx, k_xg)) = rayon::join(
            || {
                reuse_or_analyse(analysis, inner.len(), || {
                    Symbolic::analyse(&submatrix(&stiffness, &inner, &inner))
                })
            },
            || {
                // Most of the mass is a scalar times the identity per pair of nodes: two thirds are
                // zeros.
                let matrices = matrices_of(structure, &bodies, BodyMatrix::Mass);
                (
                    transformation.congruent(&matrices, Zeros::LeftOut),
                    submatrix(&stiffness, &inner, &outer),
                    submatrix(&stiffness, &outer, &inner),
                )
            },
        );
        if let Cow::Owned(structure) = structure {
            give_up(structure, &bodies);
        }
        let condensed = symbolic
            .and_then(|symbolic| condense(&stiffness, &mass, &symbolic))
            .map_err(|error| not_held_error(structure, &bodies, &transformation, error))?;
        let m_xg = submatrix(&mass, &outer, &inner);
        let (k_gg, m_gg) = rayon::join(
            || leading(stiffness, inner.len()),
            || leading(mass, inner.len()),
        );
        let joined = Self {
            bodies,
            transformation,
            factor: condensed.factor,
            k_gg,
            m_gg,
            k_gx,
            k_xg,
            m_xg,
        };
        Ok((joined, [condensed.stiffness, condensed.mass]))
    }

    fn inner(&self) -> usize {
        self.transformation.inner()
    }

    /// Parts of the steady load on X. They have no residual vectors: the static answer of X needs
    /// none, since the fixed-interface modes of a reduced body do not act on its interface in K.
    fn static_parts(&self, structure: &Structure) -> Vec<StaticPart> {
        let parts = &structure.steady_parts;
        let loads = parts.iter();
        let loads = loads.map(|part| part.load.iter().map(Vec::as_slice).collect());
        let condensed = self.condensed_loads(&BodyLoads(loads.collect()));
        let parts = parts.iter().zip(condensed.on_x);
        parts
            .map(|(part, on_x)| StaticPart {
                cause: part.cause,
                on_x,
                working: part.working,
            })
            .collect()
    }

    fn condensed_loads(&self, loads: &BodyLoads<'_>) -> CondensedLoads {
        let parts = loads.0.iter().map(|load| {
            let on_bodies: Vec<Vec<f64>> = self
                .bodies
                .iter()
                .zip(load)
                .map(|(body, load)| match body {
                    Coordinates::Full => load.to_vec(),
                    Coordinates::Reduced(body) => body.interior.gather(load),
                })
                .collect();
            self.transformation.gather(&on_bodies)
        });
        let (on_g, mut on_x): (Vec<_>, Vec<_>) = parts.unzip();
        let on_g = Mat::from_fn(self.inner(), on_g.len(), |i, j| on_g[j][i]);
        let mut answers = on_g.clone();
        self.factor.solve_in_place(answers.as_mut());
        let carried = times(&self.k_xg, answers.as_ref());
        for (j, on_x) in on_x.iter_mut().enumerate() {
            for (f, c) in on_x.iter_mut().zip(carried.col_as_slice(j)) {
                *f -= c;
            }
        }
        CondensedLoads {
            on_g,
            answers,
            on_x,
        }
    }

    /// Model on these stuck modes, with the estimated error of its amplitudes.
    fn project_on_modes(
        &self,
        structure: &Structure,
        [stiffness, mass]: [Mat<f64>; 2],
        CondensedLoads {
            on_g,
            answers,
            on_x,
        }: &CondensedLoads,
        modes: Modes,
        wanted: StuckModes,
    ) -> Result<(ModalModel, Option<f64>), ReductionError> {
        let ResidualVectors {
            vectors,
            massless,
            energy_shares,
        } = residual_vectors(on_g.as_ref(), answers.as_ref(), &modes, &self.m_gg).map_err(
            |source| ReductionError::Residual {
                part: "the stuck assembly".to_string(),
                source,
            },
        )?;
        let stuck_modes = modes.count();
        let Modes { omega2, vectors } = side_by_side(&modes, &vectors);
        // p = (M_xg + Psi^T M_gg) Phi with Psi^T = -K_xg K_gg^-1.
        let mut followed = symmetric_product(&self.m_gg, vectors.as_ref());
        self.factor.solve_in_place(followed.as_mut());
        let mut coupling =
            times(&self.m_xg, vectors.as_ref()) - times(&self.k_xg, followed.as_ref());
        let with_mass = omega2.len() - massless;
        coupling.subcols_mut(with_mass, massless).fill(0.0);
        let on_modes = product(vectors.transpose(), on_g.as_ref());
        let load = |j: usize| Load::new(on_x[j].clone(), on_modes.col_as_slice(j).to_vec());
        let first_observed = 1 + structure.excitations.len();
        let unit_loads: Vec<Load> = (1..first_observed).map(load).collect();
        let observations = structure.observations.iter().enumerate();
        let observations = observations.map(|(o, observed)| {
            let Load { on_x, on_modes } = load(first_observed + o);
            ObservedPoint::new(observed.name.clone(), on_x, on_modes)
                .with_quantity(observed.quantity)
        });
        let first_dashpot = first_observed + structure.observations.len();
        let dashpots = structure.dashpots.iter().enumerate();
        let dashpots = dashpots.map(|(j, (damping, _))| (*damping, load(first_dashpot + j)));
        let dashpots: Vec<(f64, Load)> = dashpots.collect();
        let first_influenced = first_dashpot + dashpots.len();
        let influenced = first_influenced..first_influenced + structure.influenced.len();
        let influenced: Vec<Load> = influenced.map(load).collect();
        let dashpots = Dashpots::new(mass.nrows(), omega2.len(), &dashpots);
        let reduced = ReducedModel {
            dashpots: dashpots.with_influenced(&influenced),
            stiffness,
            mass,
            coupling,
            omega2,
            bodies_omega2: Vec::new(),
            stuck_modes,
            static_load: load(0),
            static_parts: Vec::new(),
            unit_loads,
            observations: observations.collect(),
            waves: Waves::default(),
        };
        let largest = |shares: &[f64]| shares.iter().copied().fold(0.0, f64::max);
        // A dashpot is a load and an observed point at once, and so is a mode on which the air acts.
        let of_dashpots = largest(&energy_shares[first_dashpot..]);
        let left = truncation::EnergyShares {
            loads: largest(&energy_shares[1..first_observed]).max(of_dashpots),
            observed: largest(&energy_shares[first_observed..first_dashpot]).max(of_dashpots),
        };
        let highest_rad_s = wanted.excited.rad_s(&reduced.omega2);
        let amplitude = self.amplitude_error(&reduced, left, highest_rad_s);
        let on_modes = ModalModel {
            reduced,
            modes: vectors,
            load_n: on_g.col_as_slice(0).to_vec(),
        };
        Ok((on_modes, amplitude))
    }

    /// Estimated relative error of amplitudes by the modes left out; `None` as for
    /// [`truncation::amplitude`].
    fn amplitude_error(
        &self,
        reduced: &ReducedModel,
        left: truncation::EnergyShares,
        highest_rad_s: f64,
    ) -> Option<f64> {
        let x = truncation::modal_yielding(reduced);
        let answers = self.answers_to_flanks(&x);
        truncation::amplitude(reduced, left, &x, &answers, highest_rad_s)
    }

    /// Computes y^T K_gg^-1 y with y = (M_gx + M_gg Psi) X, for each column of `x`.
    fn answers_to_flanks(&self, x: &Mat<f64>) -> Vec<f64> {
        let mut follow = times(&self.k_gx, x.as_ref());
        self.factor.solve_in_place(follow.as_mut());
        let y = times(&self.m_xg.transpose(), x.as_ref())
            - symmetric_product(&self.m_gg, follow.as_ref());
        let mut answer = y.clone();
        self.factor.solve_in_place(answer.as_mut());
        (0..x.ncols())
            .map(|j| y.col(j).transpose() * answer.col(j))
            .collect()
    }

    fn finish(
        self,
        structure: &Structure,
        on_modes: ModalModel,
        amplitude: Option<f64>,
    ) -> Reduction {
        let truncation = ModalTruncation {
            amplitude,
            frequencies: self.frequency_errors(structure, &on_modes),
        };
        let fixed_interface_omega2 = self.bodies.iter().map(|body| match body {
            Coordinates::Full => Vec::new(),
            Coordinates::Reduced(body) => body.omega2.clone(),
        });
        let fixed_interface_omega2 = fixed_interface_omega2.collect();
        let interiors = self.bodies.into_iter().map(|body| match body {
            Coordinates::Full => None,
            Coordinates::Reduced(body) => Some(body.interior),
        });
        Reduction {
            model: on_modes.reduced,
            truncation,
            fixed_interface_omega2,
            recovery: Recovery {
                interiors: interiors.collect(),
                transformation: self.transformation,
                factor: self.factor,
                coupling: self.k_gx,
                modes: on_modes.modes,
                load_n: on_modes.load_n,
            },
        }
    }

    /// Relative errors of the first stuck frequencies by the bodies that were reduced. With u the
    /// motion of the whole body and r the residual of K_ii u_i - w^2 M_ii u_i and the coupling in
    /// its interior, one step of inverse iteration lowers w^2 by r^T K_ii^-1 r (modal mass one).
    fn frequency_errors(&self, structure: &Structure, on_modes: &ModalModel) -> Vec<f64> {
        let reduced = |body: &Coordinates| matches!(body, Coordinates::Reduced(_));
        if !self.bodies.iter().any(reduced) {
            return Vec::new();
        }
        let count = on_modes.reduced.stuck_modes.min(super::LISTED_MODES);
        let still = Mat::<f64>::zeros(self.transformation.unknowns() - self.inner(), count);
        let modes = on_modes.modes.get(.., ..count);
        let coordinates = self.transformation.scatter(modes, still.as_ref());
        let mut lowered = vec![0.0; count];
        for (b, body) in self.bodies.iter().enumerate() {
            let Coordinates::Reduced(body) = body else {
                continue;
            };
            let motion = body.interior.motion(coordinates[b].as_ref());
            let interior = structure.bodies[b].interior_dofs();
            let elastic = symmetric_product(&structure.bodies[b].stiffness, motion.as_ref());
            let inertia = symmetric_product(&structure.bodies[b].mass, motion.as_ref());
            let residual = Mat::from_fn(interior, count, |i, j| {
                elastic[(i, j)] - on_modes.reduced.omega2[j] * inertia[(i, j)]
            });
            let followed = body.interior.solve(residual.clone());
            for (j, lowered) in lowered.iter_mut().enumerate() {
                *lowered += residual.col(j).transpose() * followed.col(j);
            }
        }
        let errors = lowered.iter().zip(&on_modes.reduced.omega2);
        errors.map(|(lowered, w2)| 0.5 * lowered / w2).collect()
    }
}
