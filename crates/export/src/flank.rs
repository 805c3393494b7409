//! Writes the fields on the flanks. The first points are the pairs. Each facet is cut into the
//! shares of its pairs, so that a state belongs to the share of its pair and nothing is
//! interpolated between two states.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::ExportError;
use super::vtu::{Grid, check_length, write_pvd};
use dovetail_solver::dlft::{Orbit, Response, StaticState};
use dovetail_solver::model::{ContactPair, Model};
use dovetail_solver::results::fretting::Fretting;
use dovetail_solver::results::quantities::{
    StaticFields, cycle_fields, static_fields, sweep_fields,
};
use dovetail_solver::run::WearBlock;

/// Writes flank_static.vtu: pressure, forces, slip, gap, `status` (0 stuck, 1 slipping, 2 open) and
/// the normal of each pair. If the static state did not converge, the flanks are written without
/// fields.
///
/// # Errors
/// [`ExportError`] if a field does not fit the mesh or is not finite, or if the file cannot be
/// written.
pub fn write_flank_static(
    path: &Path,
    model: &Model,
    state: &StaticState,
) -> Result<(), ExportError> {
    let fields = static_fields(state, &model.pairs);
    check_static(path, &fields, model.pairs.len())?;
    let mut flanks = Flanks::new(model);
    let normals = model.pairs.iter().flat_map(|p| p.frame[0]).collect();
    flanks.field("normal", 3, normals);
    let friction = model.pairs.iter().map(|pair| pair.law.friction);
    flanks.field("friction", 1, friction.collect());
    if state.outcome.is_converged() {
        flanks.field("pressure_pa", 1, fields.pressure_pa);
        flanks.field("normal_force_n", 1, fields.normal_force_n);
        flanks.field(
            "slip_m",
            1,
            fields.slip_m.iter().map(|s| s[0].hypot(s[1])).collect(),
        );
        flanks.field(
            "slip_vector_m",
            3,
            tangential_vectors(model, &fields.slip_m),
        );
        flanks.field(
            "friction_vector_n",
            3,
            tangential_vectors(model, &fields.friction_n),
        );
        flanks.field("gap_m", 1, fields.gap_m);
        flanks.integers("status", |pair| fields.status[pair] as i32);
    }
    flanks.grid.write(path)
}

/// The flanks at each converged frequency: flank.pvd with flank/flank_0000.vtu and so on. The
/// timestep is the frequency in Hz, the number in the file name is column `point` of response.csv.
/// Fields of each pair: pressure (mean, minimum and maximum of the period), slid distance, energy
/// dissipated by friction, open fraction, `status` (0 stuck, 1 slipping, 2 opening, 3 closing, 4
/// open). Points that did not converge have no file.
#[derive(Debug)]
pub struct FlankSeries {
    still: Flanks,
    pairs: Vec<ContactPair>,
    /// Frequency, Hz, and file name of each point that is written, by the number of the point.
    written: BTreeMap<usize, (f64, String)>,
}

impl FlankSeries {
    /// Series for the flanks of this model; nothing is written yet.
    pub fn new(model: &Model) -> Self {
        Self {
            still: Flanks::new(model),
            pairs: model.pairs.clone(),
            written: BTreeMap::new(),
        }
    }

    /// Name of the file of a point.
    pub fn file(point: usize) -> String {
        format!("flank/flank_{point:04}.vtu")
    }

    /// Writes the file of a point unless the point has no motion or is already written.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&mut self, folder: &Path, orbit: &Orbit) -> Result<(), ExportError> {
        let point = orbit.point;
        if !orbit.outcome.has_motion() {
            return Ok(());
        }
        let file = Self::file(point);
        let path = folder.join(&file);
        let flanks = self.still.orbit_flanks(&path, &self.pairs, orbit)?;
        flanks.grid.write(&path)?;
        self.written.insert(point, (orbit.frequency_hz, file));
        Ok(())
    }

    /// Removes the files of points that are none of these orbits.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove_others(&mut self, folder: &Path, orbits: &[Orbit]) -> Result<(), ExportError> {
        let kept: BTreeSet<usize> = orbits.iter().map(|orbit| orbit.point).collect();
        let others = self
            .written
            .iter()
            .filter(|(point, _)| !kept.contains(point));
        for (_, (_, file)) in others {
            let path = folder.join(file);
            std::fs::remove_file(&path)
                .map_err(|source| ExportError::RemoveOld { path, source })?;
        }
        self.written.retain(|point, _| kept.contains(point));
        Ok(())
    }

    /// Writes the collection of the written files of these orbits, beside their folder. Its time is
    /// the frequency, or the row of response.csv where the frequency turns back.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_collection(&self, path: &Path, orbits: &[Orbit]) -> Result<(), ExportError> {
        let rises = orbits.is_sorted_by(|a, b| a.frequency_hz < b.frequency_hz);
        let entry = |(row, orbit): (usize, &Orbit)| {
            let (frequency_hz, file) = self.written.get(&orbit.point)?;
            Some((if rises { *frequency_hz } else { row as f64 }, file.clone()))
        };
        let entries: Vec<(f64, String)> = orbits.iter().enumerate().filter_map(entry).collect();
        let comment = format!(
            "timestep = {}; {} points converged, {} did not and are left out",
            if rises {
                "frequency in Hz"
            } else {
                "row of response.csv, from 0"
            },
            entries.len(),
            orbits.len() - entries.len()
        );
        write_pvd(path, &entries, &comment)
    }
}

/// The worn flanks over the cycles: wear.pvd with wear/wear_0000.vtu and so on, one for the beginning
/// and one for each block. The timestep is the number of cycles. Fields of each pair: worn depth,
/// depth that it wears in a cycle, static pressure, and those of [`FlankSeries`] in the first
/// vibration of the mission.
#[derive(Debug)]
pub struct WornFlanks {
    still: Flanks,
    pairs: Vec<ContactPair>,
    /// Cycles and file name of each state that is written.
    written: Vec<(f64, String)>,
}

impl WornFlanks {
    /// Series for the flanks of this model; nothing is written yet.
    pub fn new(model: &Model) -> Self {
        Self {
            still: Flanks::new(model),
            pairs: model.pairs.clone(),
            written: Vec::new(),
        }
    }

    /// Name of the file of the state after so many blocks.
    pub fn file(blocks: usize) -> String {
        format!("wear/wear_{blocks:04}.vtu")
    }

    /// Writes the file of the next state.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&mut self, folder: &Path, block: &WearBlock) -> Result<(), ExportError> {
        let file = Self::file(self.written.len());
        let path = folder.join(&file);
        check_pairs(&path, "worn depth", block.depth_m.len(), self.pairs.len())?;
        let mut flanks = match block.motions.first() {
            Some(orbit) => self.still.orbit_flanks(&path, &self.pairs, orbit)?,
            None => self.still.clone(),
        };
        let pressed = block.at_rest_n.iter().zip(&self.pairs);
        let pressures = pressed.map(|(force, pair)| force / pair.area_m2).collect();
        flanks.field("worn_depth_m", 1, block.depth_m.clone());
        flanks.field("depth_per_cycle_m", 1, block.rate_m.clone());
        flanks.field("static_pressure_pa", 1, pressures);
        flanks.grid.write(&path)?;
        self.written.push((block.cycles, file));
        Ok(())
    }

    /// Writes the collection of the files so far, beside their folder.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_collection(&self, path: &Path) -> Result<(), ExportError> {
        write_pvd(path, &self.written, "timestep = cycles")
    }
}

/// Writes flank_peak.vtu: the flanks in the motion of this orbit with the fields of
/// [`FlankSeries`], and `separates` (0 or 1): whether a pair separates at any converged frequency
/// (the paper's Figure 5). The figures of [`Fretting`] are `slip_range_m`,
/// `friction_stress_max_pa`, `ruiz_wear_pa_m` and, with stress, `surface_tension_max_pa` and
/// `ruiz_fatigue_pa2_m`.
///
/// # Errors
/// [`ExportError`] if a field does not fit the mesh or is not finite, or if the file cannot be
/// written.
pub fn write_flank_peak(
    path: &Path,
    model: &Model,
    orbit: &Orbit,
    response: &Response,
    fretting: &[Fretting],
) -> Result<(), ExportError> {
    let mut flanks = Flanks::new(model).orbit_flanks(path, &model.pairs, orbit)?;
    check_pairs(
        path,
        "figures of fretting",
        fretting.len(),
        model.pairs.len(),
    )?;
    let mut add = |name: &str, of: &dyn Fn(&Fretting) -> f64| {
        flanks.field(name, 1, fretting.iter().map(of).collect());
    };
    add("slip_range_m", &|f| f.slip_range_m);
    add("friction_stress_max_pa", &|f| f.friction_stress_pa);
    add("ruiz_wear_pa_m", &Fretting::wear_parameter_pa_m);
    if fretting.iter().all(|f| f.tension_pa.is_some()) {
        add("surface_tension_max_pa", &|f| f.tension_pa.unwrap_or(0.0));
        add("ruiz_fatigue_pa2_m", &|f| {
            f.fatigue_parameter_pa2_m().unwrap_or(0.0)
        });
    }
    let separates = sweep_fields(response, model.pairs.len()).separates;
    flanks.integers("separates", |pair| i32::from(separates[pair]));
    flanks.grid.write(path)
}

/// Checks that there is one value per pair.
pub(crate) fn check_pairs(
    path: &Path,
    field: &str,
    found: usize,
    pairs: usize,
) -> Result<(), ExportError> {
    check_length(path, field, found, pairs, "one per contact pair")
}

/// Checks that the static state has one value per pair.
pub(crate) fn check_static(
    path: &Path,
    fields: &StaticFields,
    pairs: usize,
) -> Result<(), ExportError> {
    check_pairs(path, "static status", fields.status.len(), pairs)?;
    check_pairs(
        path,
        "static contact forces",
        fields.normal_force_n.len(),
        pairs,
    )?;
    check_pairs(path, "static displacements", fields.gap_m.len(), pairs)
}

/// Grid of the flanks.
#[derive(Debug, Clone)]
struct Flanks {
    grid: Grid,
    cut: Cut,
}

impl Flanks {
    /// Flanks with the fields that every file has: number, contact and area of the pair of each
    /// cell.
    fn new(model: &Model) -> Self {
        let cut = Cut::new(&model.flank_facets);
        let places: Vec<[f64; 3]> = model.pairs.iter().map(|p| p.position_m).collect();
        let points = cut.append_means(3, places.into_flattened());
        let mut grid = Grid::from_quadrilaterals(points, &cut.cells(model.pairs.len()));
        let areas = cut.pair_indices().map(|pair| model.pairs[pair].area_m2);
        grid.cell_array("area_m2", 1, areas.collect());
        let mut flanks = Self { grid, cut };
        flanks.integers("pair", |pair| pair as i32);
        flanks.integers("contact", |pair| model.pairs[pair].contact as i32);
        flanks
    }

    /// Flanks with the fields of an orbit; `path` is the file that they are written to.
    fn orbit_flanks(
        &self,
        path: &Path,
        pairs: &[ContactPair],
        orbit: &Orbit,
    ) -> Result<Self, ExportError> {
        check_pairs(path, "pair cycles", orbit.cycles.len(), pairs.len())?;
        let fields = cycle_fields(orbit, pairs);
        let mut flanks = self.clone();
        flanks.field("pressure_mean_pa", 1, fields.pressure_mean_pa);
        flanks.field("pressure_min_pa", 1, fields.pressure_min_pa);
        flanks.field("pressure_max_pa", 1, fields.pressure_max_pa);
        flanks.field("slid_m", 1, fields.slid_m);
        flanks.field("open_fraction", 1, fields.open_fraction);
        flanks.field("friction_energy_j_m2", 1, fields.friction_energy_j_m2);
        flanks.integers("status", |pair| fields.status[pair] as i32);
        Ok(flanks)
    }

    /// Adds a field that is linear on each facet, from its values at the pairs.
    fn field(&mut self, name: &str, components: usize, of_pairs: Vec<f64>) {
        let values = self.cut.append_means(components, of_pairs);
        self.grid.point_array(name, components as u32, values);
    }

    /// Adds a state or number of each pair, the same on all of its cells.
    fn integers(&mut self, name: &str, of_pair: impl Fn(usize) -> i32) {
        let values = self.cut.pair_indices().map(of_pair).collect();
        self.grid.cell_integers(name, values);
    }
}

/// Facets cut into the shares of their pairs: each a quadrilateral from a pair over the middle of
/// one edge and the centroid to the middle of the other edge. The points are the pairs, the middles
/// of the edges, and the centroids.
#[derive(Debug, Clone)]
struct Cut {
    facets: Vec<Vec<usize>>,
    /// Pairs at the ends of each edge, the lower one first; ascending.
    edges: Vec<[usize; 2]>,
}

impl Cut {
    fn new(facets: &[Vec<u32>]) -> Self {
        let pairs = |facet: &Vec<u32>| facet.iter().map(|&pair| pair as usize).collect();
        let facets: Vec<Vec<usize>> = facets.iter().map(pairs).collect();
        let edges: BTreeSet<[usize; 2]> = facets.iter().flat_map(|facet| edges(facet)).collect();
        Self {
            facets,
            edges: edges.into_iter().collect(),
        }
    }

    /// Points of each quadrilateral.
    fn cells(&self, pairs: usize) -> Vec<[u64; 4]> {
        let mut shares = Vec::new();
        for (f, facet) in self.facets.iter().enumerate() {
            let centroid = pairs + self.edges.len() + f;
            let middle = |edge: [usize; 2]| pairs + self.edges.partition_point(|e| *e < edge);
            let middles: Vec<usize> = edges(facet).map(middle).collect();
            let n = facet.len();
            shares.extend((0..n).map(|i| {
                let before = middles[(i + n - 1) % n];
                [facet[i], middles[i], centroid, before].map(|point| point as u64)
            }));
        }
        shares
    }

    /// Pair of each quadrilateral.
    fn pair_indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.facets.iter().flatten().copied()
    }

    /// Values at the pairs, followed by the means at the other points.
    fn append_means(&self, components: usize, mut values: Vec<f64>) -> Vec<f64> {
        let mut add_mean = |pairs: &[usize]| {
            for c in 0..components {
                let of_pairs = pairs.iter().map(|pair| values[pair * components + c]);
                let mean = of_pairs.sum::<f64>() / pairs.len() as f64;
                values.push(mean);
            }
        };
        self.edges.iter().for_each(|edge| add_mean(edge));
        self.facets.iter().for_each(|facet| add_mean(facet));
        values
    }
}

/// Edges of a facet, each with its lower pair first; edge i joins corner i and the next.
fn edges(facet: &[usize]) -> impl Iterator<Item = [usize; 2]> {
    (0..facet.len()).map(|i| {
        let (a, b) = (facet[i], facet[(i + 1) % facet.len()]);
        [a.min(b), a.max(b)]
    })
}

/// Components along t1 and t2 as vectors in space.
fn tangential_vectors(model: &Model, tangential: &[[f64; 2]]) -> Vec<f64> {
    let vector = |(p, s): (&ContactPair, &[f64; 2])| {
        let [_, t1, t2] = p.frame;
        [0, 1, 2].map(|a| s[0] * t1[a] + s[1] * t2[a])
    };
    model
        .pairs
        .iter()
        .zip(tangential)
        .flat_map(vector)
        .collect()
}
