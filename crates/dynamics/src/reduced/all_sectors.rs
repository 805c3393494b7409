//! Sectors of a disc that an engine order moves differently, as one reduced model.
//!
//! An engine order E moves the sectors j and j + N' of N alike, N' = N / gcd(N, E). The motions of N'
//! sectors are sums of those with c = 0 .. N' / 2 periods round them, which are c N / N' nodal diameters
//! of the disc, each with the reduced model of two copies of the sector ([`waves`](super::waves)). From
//! the real coordinates (y1, y2) of both copies follow those of sector j,
//!
//! ```text
//! x_j = y1 cos(2 pi c j / N') - y2 sin(2 pi c j / N')
//! ```
//!
//! With the scale sqrt(2 / N'), or sqrt(1 / N') for c = 0 and c = N' / 2, these columns are
//! orthonormal: the matrices of all sectors are sums of those of the copies between them, and the modes
//! of the copies have unit modal mass among all. Where neighbours move against each other, c = N' / 2,
//! both copies are the same sector, and one of the two modes of each frequency is left.

use std::f64::consts::TAU;

use faer::Mat;

use super::{Dashpots, DiscExcitation, Load, ObservedPoint, ReducedModel};

/// Sectors of a disc that an engine order moves differently.
#[derive(Debug)]
pub(crate) struct AllSectors<'a> {
    sector: &'a ReducedModel,
    excitation: DiscExcitation,
    /// Motions of the sectors, by ascending number of periods round them.
    waves: Vec<WaveOfAll<'a>>,
    /// Modes of all sectors: the wave, and the number of the mode in it. Those that have the same
    /// number in the sector stand together, ascending.
    modes: Vec<(usize, usize)>,
}

/// Motions of all sectors with one number of periods round them.
#[derive(Debug)]
struct WaveOfAll<'a> {
    /// Phase from a sector to the next one.
    angle: f64,
    /// Model of one copy or of two.
    model: &'a ReducedModel,
    /// Number of copies that the model has.
    copies: usize,
    /// Size of the columns of the model's coordinates.
    scale: f64,
    /// Modes, each as a combination of those of the model.
    modes: Vec<Vec<(usize, f64)>>,
    /// Number of modes that stand for one mode of the sector.
    of_each: usize,
}

impl<'a> AllSectors<'a> {
    /// Sectors of the model of one; `None` where they all move in phase.
    ///
    /// # Errors
    /// The nodal diameter of a motion of the sectors for which the model has no copies.
    pub(crate) fn new(sector: &'a ReducedModel) -> Result<Option<Self>, usize> {
        let excitation = sector.waves.excitation();
        let Some(excitation) = excitation.filter(|e| e.different_sectors() > 1) else {
            return Ok(None);
        };
        let count = excitation.different_sectors();
        let wave = |periods: usize| {
            if periods == 0 {
                return Ok(WaveOfAll::synchronous(sector, count));
            }
            let diameter = periods * excitation.sectors / count;
            let model = sector.waves.copies().get(&diameter).ok_or(diameter)?;
            Ok(WaveOfAll::from_copies(model, periods, count))
        };
        let waves = (0..=count / 2)
            .map(wave)
            .collect::<Result<Vec<_>, usize>>()?;
        let most = waves
            .iter()
            .map(|w| w.modes.len().div_ceil(w.of_each))
            .max();
        let mut modes = Vec::new();
        for number in 0..most.unwrap_or(0) {
            for (i, wave) in waves.iter().enumerate() {
                let of_number = number * wave.of_each..(number + 1) * wave.of_each;
                let there = of_number.filter(|mode| *mode < wave.modes.len());
                modes.extend(there.map(|mode| (i, mode)));
            }
        }
        Ok(Some(Self {
            sector,
            excitation,
            waves,
            modes,
        }))
    }

    /// Number of sectors.
    pub(crate) fn count(&self) -> usize {
        self.excitation.different_sectors()
    }

    /// Number of modes of all sectors that stand for a mode of the sector.
    pub(crate) fn modes_of(&self, mode: usize) -> usize {
        let modes = self.modes.iter();
        modes
            .filter(|(wave, own)| own / self.waves[*wave].of_each == mode)
            .count()
    }

    /// Reduced model of all sectors, the unknowns of one after the other. What is observed is observed
    /// on the first one. Unit loads, and the forces of the air, are left out.
    pub(crate) fn model(&self) -> ReducedModel {
        let points = self
            .sector
            .observations
            .iter()
            .enumerate()
            .map(|(i, point)| {
                let weights = self.weights(0, |wave, copy| {
                    let points = &wave.model.observations;
                    let point = &points[i + copy * points.len() / wave.copies];
                    Load::new(point.on_x.clone(), point.on_modes.clone())
                });
                ObservedPoint::new(point.name.clone(), weights.on_x, weights.on_modes)
                    .with_quantity(point.quantity)
            });
        let dampings = &self.sector.dashpots.damping_n_s_m;
        let dashpots = (0..self.count()).flat_map(|sector| {
            dampings.iter().enumerate().map(move |(i, damping)| {
                let weights = self.weights(sector, |wave, copy| {
                    wave.model.dashpots.weights(i + copy * dampings.len())
                });
                (*damping, weights)
            })
        });
        let dashpots: Vec<(f64, Load)> = dashpots.collect();
        let coupling = self.coupling();
        let omega2 = self.modes.iter().map(|(wave, mode)| {
            let wave = &self.waves[*wave];
            wave.model.omega2[wave.modes[*mode][0].0]
        });
        let (n, m) = (coupling.nrows(), coupling.ncols());
        ReducedModel {
            static_load: self.expand_harmonic(0, &self.sector.static_load),
            observations: points.collect(),
            dashpots: Dashpots::new(n, m, &dashpots),
            ..ReducedModel::new(
                self.matrix(|model| &model.stiffness),
                self.matrix(|model| &model.mass),
                coupling,
                omega2.collect(),
            )
        }
    }

    /// Forces or amplitudes on all sectors and modes, from those on the model of harmonic `k`: its
    /// unknowns, and its modes.
    pub(crate) fn expand_harmonic(&self, k: usize, on_model: &Load) -> Load {
        let periods = self.excitation.wave(k).map_or(0, |wave| {
            wave.nodal_diameter * self.count() / self.excitation.sectors
        });
        let sector_wave = &self.waves[periods];
        let n = self.unknowns();
        let on_x = (0..self.count()).flat_map(|sector| {
            let shares = sector_wave
                .shares(sector)
                .map(|share| share / sector_wave.scale);
            let of_copies = on_model.on_x.chunks_exact(n);
            let mut on_x = vec![0.0; n];
            for (share, copy) in shares.iter().zip(of_copies) {
                let both = on_x.iter_mut().zip(copy);
                both.for_each(|(sum, v)| *sum += share * v);
            }
            on_x
        });
        let on_modes = self
            .modes
            .iter()
            .map(|(wave, mode)| match *wave == periods {
                true => sector_wave.mode_amplitude(*mode, &on_model.on_modes) / sector_wave.scale,
                false => 0.0,
            });
        Load::new(on_x.collect(), on_modes.collect())
    }

    /// Number of unknowns of a sector.
    fn unknowns(&self) -> usize {
        self.sector.stiffness.nrows()
    }

    /// Matrix on the unknowns of all sectors, from those of the waves.
    fn matrix(&self, of: impl Fn(&ReducedModel) -> &Mat<f64>) -> Mat<f64> {
        let (n, count) = (self.unknowns(), self.count());
        // The block of two sectors depends on how far they are apart.
        let blocks = (0..count).map(|apart| {
            let mut block = Mat::zeros(n, n);
            for wave in &self.waves {
                let matrix = of(wave.model);
                let shares = wave.shares(apart).into_iter();
                for (copy, share) in shares.take(wave.copies).enumerate() {
                    let rows = matrix.submatrix(copy * n, 0, n, n);
                    block += rows * faer::Scale(share * wave.scale);
                }
            }
            block
        });
        let blocks: Vec<Mat<f64>> = blocks.collect();
        Mat::from_fn(n * count, n * count, |i, j| {
            let apart = (count + i / n - j / n) % count;
            blocks[apart][(i % n, j % n)]
        })
    }

    /// Coupling of all unknowns to all modes.
    fn coupling(&self) -> Mat<f64> {
        let n = self.unknowns();
        let columns: Vec<Vec<f64>> = (self.modes.iter())
            .map(|(wave, mode)| {
                let wave = &self.waves[*wave];
                let of_copies: Vec<f64> = (0..n * wave.copies)
                    .map(|i| {
                        let coupling = wave.model.coupling.row(i);
                        let parts = wave.modes[*mode].iter();
                        parts.map(|(m, share)| share * coupling[*m]).sum()
                    })
                    .collect();
                wave.expand(&of_copies, n, self.count())
            })
            .collect();
        Mat::from_fn(n * self.count(), columns.len(), |i, j| columns[j][i])
    }

    /// Weights of a displacement of one sector on all unknowns and modes; `of` gives those on a wave of
    /// the same displacement of a copy.
    fn weights(&self, sector: usize, of: impl Fn(&WaveOfAll<'_>, usize) -> Load) -> Load {
        let (n, count) = (self.unknowns(), self.count());
        let mut sum = Load::zeros(n * count, self.modes.len());
        for (i, wave) in self.waves.iter().enumerate() {
            let shares = wave.shares(sector).into_iter();
            for (copy, share) in shares.take(wave.copies).enumerate() {
                let weights = of(wave, copy);
                let on_modes = self.modes.iter().map(|(of, mode)| match *of == i {
                    true => wave.mode_amplitude(*mode, &weights.on_modes),
                    false => 0.0,
                });
                let load = Load::new(wave.expand(&weights.on_x, n, count), on_modes.collect());
                sum.add(share, &load);
            }
        }
        sum
    }
}

impl<'a> WaveOfAll<'a> {
    fn synchronous(model: &'a ReducedModel, count: usize) -> Self {
        Self {
            angle: 0.0,
            model,
            copies: 1,
            scale: (1.0 / count as f64).sqrt(),
            modes: (0..model.omega2.len()).map(|m| vec![(m, 1.0)]).collect(),
            of_each: 1,
        }
    }

    fn from_copies(model: &'a ReducedModel, periods: usize, count: usize) -> Self {
        let against = 2 * periods == count;
        let modes = 0..model.omega2.len();
        Self {
            angle: TAU * periods as f64 / count as f64,
            model,
            copies: 2,
            scale: ((2 - usize::from(against)) as f64 / count as f64).sqrt(),
            modes: match against {
                false => modes.map(|m| vec![(m, 1.0)]).collect(),
                true => {
                    let twins = modes.step_by(2).filter(|m| m + 1 < model.omega2.len());
                    twins.map(|m| single_copy_combination(model, m)).collect()
                }
            },
            of_each: 2 - usize::from(against),
        }
    }

    /// Displacement of a sector by a unit of the coordinate of each copy, for columns of unit length.
    fn shares(&self, sector: usize) -> [f64; 2] {
        let (sine, cosine) = (self.angle * sector as f64).sin_cos();
        // Neighbours that move against each other have no second copy.
        let sine = if self.of_each < self.copies {
            0.0
        } else {
            sine
        };
        [self.scale * cosine, -self.scale * sine]
    }

    /// Weight or amplitude of a mode, from those of the modes of the model.
    fn mode_amplitude(&self, mode: usize, of_model: &[f64]) -> f64 {
        let parts = self.modes[mode].iter();
        parts.map(|(m, share)| share * of_model[*m]).sum()
    }

    /// Unknowns of all sectors, n each, from those of the copies, for columns of unit length.
    fn expand(&self, of_copies: &[f64], n: usize, count: usize) -> Vec<f64> {
        let at = |sector: usize| {
            let shares = self.shares(sector);
            (0..n).map(move |i| {
                let copies = of_copies[i..].iter().step_by(n);
                shares.iter().zip(copies).map(|(share, v)| share * v).sum()
            })
        };
        (0..count).flat_map(at).collect()
    }
}

/// Combination of a mode and its twin that moves the first copy alone, of a model whose copies do not
/// depend on each other.
fn single_copy_combination(model: &ReducedModel, mode: usize) -> Vec<(usize, f64)> {
    let both = [mode, mode + 1];
    let of_pairs = (0..model.stiffness.nrows() / 2).map(|i| both.map(|m| model.coupling[(i, m)]));
    let points = &model.observations[..model.observations.len() / 2];
    let of_points = points.iter().map(|point| both.map(|m| point.on_modes[m]));
    let dashpots = &model.dashpots.on_modes;
    let of_dashpots =
        (0..model.dashpots.damping_n_s_m.len() / 2).map(|j| both.map(|m| dashpots[(m, j)]));
    let size = |[a, b]: &[f64; 2]| a.hypot(*b);
    // All of the first copy depends on this combination alone.
    let candidates = of_pairs.chain(of_points).chain(of_dashpots);
    let largest = candidates.max_by(|a, b| size(a).total_cmp(&size(b)));
    let [a, b] = largest.filter(|v| size(v) > 0.0).unwrap_or([1.0, 0.0]);
    let size = a.hypot(b);
    vec![(mode, a / size), (mode + 1, b / size)]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::Waves;
    use super::*;

    /// Two sectors of one mass of 1 kg each on a spring of 3 N/m to ground and one of 0.5 N/m to the
    /// other, without pairs that slide: X stands for a displacement that moves with 0.2 of the mass.
    /// Of the waves against each other both copies have the mode, turned by an angle.
    fn two_sectors(turned: f64) -> ReducedModel {
        let one = |copies: usize, omega2: f64, shapes: [[f64; 2]; 2]| {
            let own =
                |size: f64| Mat::from_fn(copies, copies, |i, j| if i == j { size } else { 0.0 });
            let coupling = Mat::from_fn(copies, copies, |i, j| 0.2 * shapes[i][j]);
            let observed = (0..copies).map(|i| {
                let on_x = (0..copies).map(|j| if i == j { 0.2 } else { 0.0 });
                ObservedPoint::new("mass", on_x.collect(), shapes[i][..copies].to_vec())
            });
            let observed: Vec<ObservedPoint> = observed.collect();
            let dashpots: Vec<(f64, Load)> = (observed.iter())
                .map(|point| (0.3, Load::new(point.on_x.clone(), point.on_modes.clone())))
                .collect();
            ReducedModel {
                dashpots: Dashpots::new(copies, copies, &dashpots),
                observations: observed,
                ..ReducedModel::new(
                    own(0.04 * omega2),
                    own(0.04),
                    coupling,
                    vec![omega2; copies],
                )
            }
        };
        let (sine, cosine) = turned.sin_cos();
        let copies = one(2, 4.0, [[cosine, -sine], [sine, cosine]]);
        let excitation = DiscExcitation {
            sectors: 2,
            engine_order: 1,
        };
        ReducedModel {
            waves: Waves::new(excitation, BTreeMap::from([(1, copies)])),
            ..one(1, 3.0, [[1.0, 0.0]; 2])
        }
    }

    /// Modes of two masses: the mean moves them alike, the difference against each other.
    #[test]
    fn two_sectors_have_one_mode_against_each_other_however_those_of_the_copies_are_turned() {
        let half = 0.5_f64.sqrt();
        for turned in [0.0, 0.3, 1.2, 2.0, std::f64::consts::FRAC_PI_2] {
            let sector = two_sectors(turned);
            let all = AllSectors::new(&sector).unwrap().unwrap();
            assert_eq!((all.count(), all.modes_of(0)), (2, 2));
            let model = all.model();
            assert_eq!(model.omega2, [3.0, 4.0]);
            let close = |found: f64, exact: f64| {
                assert!((found - exact).abs() < 1e-14, "{turned}: {found} {exact}");
            };
            let sign = model.coupling[(0, 1)].signum();
            for (i, own) in [sign, -sign].into_iter().enumerate() {
                close(model.coupling[(i, 0)], 0.2 * half);
                close(model.coupling[(i, 1)], 0.2 * half * own);
                close(model.stiffness[(i, i)], 0.04 * 3.5);
                close(model.stiffness[(i, 1 - i)], -0.04 * 0.5);
                close(model.mass[(i, i)], 0.04);
                close(model.mass[(i, 1 - i)], 0.0);
                close(model.dashpots.on_modes[(0, i)], half);
                close(model.dashpots.on_modes[(1, i)], half * own);
                close(model.dashpots.on_x[(i, i)], 0.2);
                close(model.dashpots.on_x[(i, 1 - i)], 0.0);
            }
            close(model.observations[0].on_modes[1], half * sign);
            close(model.observations[0].on_x[0], 0.2);
            // Both copies follow harmonic 1 by (X, -i X), of which the first sector has X.
            let cosine = Load::new(vec![0.7, 0.4], vec![0.0; 2]);
            let spread = all.expand_harmonic(1, &cosine);
            close(spread.on_x[0], 0.7);
            close(spread.on_x[1], -0.7);
        }
    }

    #[test]
    fn a_wave_without_a_model_is_named() {
        let mut sector = two_sectors(0.0);
        let excitation = DiscExcitation {
            sectors: 6,
            engine_order: 1,
        };
        sector.waves = Waves::new(excitation, BTreeMap::new());
        assert_eq!(AllSectors::new(&sector).unwrap_err(), 1);
        let in_phase = DiscExcitation {
            engine_order: 6,
            ..excitation
        };
        sector.waves = Waves::new(in_phase, BTreeMap::new());
        assert!(AllSectors::new(&sector).unwrap().is_none());
    }
}
