//! Problem and motion of all sectors of a disc that move differently, from those of one
//! ([`AllSectors`]): steps in time follow each of them.

use crate::dlft::Orbit;
use crate::problem::{HarmonicLoad, Problem};
use crate::reduced::{AllSectors, Load};
use dovetail_numerics::spectrum::{Spectrum, cosine, sine};

/// Problem of all sectors. Each has the laws of one, and the excitation of one in its turn.
pub(crate) fn problem_of(sectors: &AllSectors<'_>, problem: &Problem) -> Problem {
    let excitations = problem.excitations.iter().map(|load| HarmonicLoad {
        harmonic: load.harmonic,
        cosine: sectors.expand_harmonic(load.harmonic, &load.cosine),
        sine: sectors.expand_harmonic(load.harmonic, &load.sine),
        growth: load.growth,
    });
    let ratios = problem.modal_ratios.iter().enumerate();
    Problem {
        reduced: sectors.model().into(),
        laws: problem.laws.repeat(sectors.count()),
        excitations: excitations.collect(),
        modal_ratios: ratios
            .flat_map(|(mode, ratio)| vec![*ratio; sectors.modes_of(mode)])
            .collect(),
    }
}

/// Motion and contact forces of all sectors in the wave of which `orbit` is the motion of one, with its
/// other figures.
pub(crate) fn orbit_of(sectors: &AllSectors<'_>, problem: &Problem, orbit: &Orbit) -> Orbit {
    let reduced = &problem.reduced;
    // Contact forces are those of X, and move no mode.
    let on_all = |values: &[f64], modal: Option<&[f64]>| {
        let of_pairs = Spectrum::new(values, orbit.harmonics);
        let modal = modal.map(|values| Spectrum::new(values, orbit.harmonics));
        let part = |k: usize, block: usize, own: &[f64]| {
            let modes = reduced.harmonic_model(k).model.omega2.len();
            let on_modes = modal.map_or(vec![0.0; modes], |v| v.block(block)[..modes].to_vec());
            sectors.expand_harmonic(k, &Load::new(own.to_vec(), on_modes))
        };
        let mut sectors = vec![part(0, 0, of_pairs.mean())];
        for k in 1..=orbit.harmonics {
            let parts = [of_pairs.cosine(k), of_pairs.sine(k)];
            let parts = reduced.harmonic_model(k).widened_parts(parts);
            let blocks = [cosine(k), sine(k)].into_iter();
            sectors.extend(blocks.zip(&parts).map(|(block, own)| part(k, block, own)));
        }
        sectors
    };
    let moved = on_all(&orbit.x, Some(&orbit.modal));
    let forces = on_all(&orbit.lambda, None);
    let join = |parts: &[Load], of: fn(&Load) -> &Vec<f64>| {
        parts.iter().flat_map(of).copied().collect::<Vec<f64>>()
    };
    Orbit {
        x: join(&moved, |part| &part.on_x),
        modal: join(&moved, |part| &part.on_modes),
        lambda: join(&forces, |part| &part.on_x),
        ..orbit.clone()
    }
}
