#!/usr/bin/env python3
"""Reads every .vtu and .pvd of an output folder with VTK's own reader and compares the numbers with
the CSV files and summary.json. meshio and pyvista open every file, too, and find the same arrays.
The report must stand by itself.

    python3 scripts/check_output.py output/paper

Needs python3 with vtk, meshio and pyvista (pip install meshio pyvista brings vtk and numpy). Ends
with 0 if all agrees, with 1 and a list of mismatches otherwise, with 2 where it cannot start.
"""

import csv
import json
import math
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

try:
    import meshio
    import numpy as np
    import pyvista
    import vtk
    from meshio._mesh import topological_dimension
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print(f"cannot start: {missing}. Remedy: pip install meshio pyvista", file=sys.stderr)
    sys.exit(2)

# Numbers in CSV read back exactly; sums of them in another order agree to this.
SUM = 1e-9
# A node in the middle of an edge may sit this fraction of the edge off (curved elements).
MIDDLE = 0.25
VTK_QUAD = 9
# Edges of VTK's ten-node tetrahedron, in the order of its nodes 4 to 9.
MOST_REPORT_BYTES = 6e6
STATIC_STATUS = ["stuck", "slipping", "open"]
# Names of the components of vectors and of stresses.
COMPONENTS = {3: ["X", "Y", "Z"], 6: ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]}
CYCLE_STATUS = ["stuck", "slipping", "opening", "closing", "open"]

# meshio reads quadratic pyramids but for this entry (5.3.5).
topological_dimension.setdefault("pyramid13", 3)

problems = []
facts = []


def problem(message):
    problems.append(message)


def same(what, found, expected, relative=0.0, absolute=0.0):
    """Notes a problem unless found = expected, entry by entry, within the tolerance."""
    found, expected = np.atleast_1d(found), np.atleast_1d(expected)
    if found.shape != expected.shape:
        problem(f"{what}: {found.shape} values, expected {expected.shape}")
        return
    if found.size == 0:
        return
    off = np.abs(found - expected)
    allowed = absolute + relative * np.abs(expected)
    bad = ~(off <= allowed)
    if bad.any():
        i = int(np.argmax(np.where(bad, np.nan_to_num(off, nan=np.inf), -1)))
        problem(f"{what}: {found.flat[i]} where {expected.flat[i]} is expected "
                f"(entry {i}; {int(bad.sum())} of {bad.size} differ)")


class Grid:
    """A .vtu as VTK read it."""

    def __init__(self, path, root):
        self.name = str(path.relative_to(root))
        said = vtk.vtkStringOutputWindow()
        vtk.vtkOutputWindow.SetInstance(said)
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(path))
        reader.Update()
        self.grid = reader.GetOutput()
        self.failed = bool(said.GetOutput()) or reader.GetErrorCode() != 0
        if self.failed:
            problem(f"{self.name}: VTK's reader says: {' '.join(said.GetOutput().split())}")
        if self.grid.GetNumberOfPoints() == 0:
            problem(f"{self.name}: no points")
            self.failed = True

    def points(self):
        return vtk_to_numpy(self.grid.GetPoints().GetData())

    def cells(self):
        return vtk_to_numpy(self.grid.GetCells().GetConnectivityArray())

    def types(self):
        return np.array([self.grid.GetCellType(i) for i in range(self.grid.GetNumberOfCells())])

    def point(self, name):
        return self._array(self.grid.GetPointData(), name)

    def cell(self, name):
        return self._array(self.grid.GetCellData(), name)

    def _array(self, data, name):
        array = data.GetArray(name)
        if array is None:
            names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
            raise LookupError(f"{self.name}: no array {name}; it has {names}")
        return vtk_to_numpy(array)

    def pairs(self, name):
        """A field of the flanks at the pairs, which are the first points."""
        return self.point(name)[: self.cell("pair").max() + 1]

    def of_pairs(self, name):
        """A state or size of each pair, which all cells of the pair have."""
        pair, values = self.cell("pair"), self.cell(name)
        _, first = np.unique(pair, return_index=True)
        if (values[first][pair] != values).any():
            problem(f"{self.name}: cells of one pair differ in {name}")
        return values[first]

    def arrays(self):
        """The arrays of the points and those of the cells, each by its name."""
        return [{data.GetArrayName(i): data.GetArray(i) for i in range(data.GetNumberOfArrays())}
                for data in (self.grid.GetPointData(), self.grid.GetCellData())]

    def check_arrays(self):
        for arrays in self.arrays():
            for name, array in arrays.items():
                if not np.isfinite(vtk_to_numpy(array)).all():
                    problem(f"{self.name}: {name} holds a number that is not finite")
                count = array.GetNumberOfComponents()
                names = [array.GetComponentName(i) for i in range(count)]
                if count > 1 and names != COMPONENTS.get(count):
                    problem(f"{self.name}: the components of {name} are named {names}")

    def check_other_readers(self, path):
        """meshio and pyvista find the points, the cells and the arrays that VTK finds."""
        points, cells = ({name: vtk_to_numpy(array) for name, array in arrays.items()}
                         for arrays in self.arrays())
        try:
            mesh = meshio.read(path)
        # meshio ends the process where it cannot read.
        except (Exception, SystemExit) as refused:
            problem(f"{self.name}: meshio cannot read it: {refused!r}")
        else:
            same(f"{self.name}: points by meshio", mesh.points, self.points())
            of_cells = {name: np.concatenate(parts) for name, parts in mesh.cell_data.items()}
            for found, expected in ((mesh.point_data, points), (of_cells, cells)):
                same_arrays(f"{self.name}: by meshio", found, expected)
        try:
            grid = pyvista.read(path)
        except Exception as refused:
            problem(f"{self.name}: pyvista cannot read it: {refused!r}")
        else:
            same(f"{self.name}: points by pyvista", grid.points, self.points())
            for found, expected in ((grid.point_data, points), (grid.cell_data, cells)):
                same_arrays(f"{self.name}: by pyvista", dict(found), expected)


def same_arrays(what, found, expected):
    if set(found) != set(expected):
        problem(f"{what}: arrays {sorted(found)}, expected {sorted(expected)}")
        return
    for name, values in expected.items():
        same(f"{what}: {name}", found[name], values)


def read_table(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def column(rows, name, table):
    if rows and name not in rows[0]:
        raise LookupError(f"{table}: no column {name}")
    cells = [row[name] for row in rows]
    if "" in cells:
        raise LookupError(f"{table}: {name} is empty in row {cells.index('')}, "
                          "where a result is expected")
    return np.array([float(c) for c in cells])


def read_pvd(path, root, grids):
    """(timestep, grid) of a collection; checks that it and its folder hold the same files."""
    entries, seen = [], set()
    tree = ElementTree.parse(path).getroot()
    if tree.tag != "VTKFile" or tree.get("type") != "Collection":
        problem(f"{path.name}: not a VTK collection")
    for element in tree.iter("DataSet"):
        name = str((path.parent / element.get("file")).relative_to(root))
        if name in seen:
            problem(f"{path.name}: names {name} twice")
        seen.add(name)
        if name not in grids:
            problem(f"{path.name}: names {name}, which is not there")
            continue
        entries.append((float(element.get("timestep")), grids[name]))
    folder = root / path.stem
    for file in sorted(folder.glob("*.vtu")):
        name = str(file.relative_to(root))
        if name not in seen:
            problem(f"{name}: not named in {path.name}")
    steps = [t for t, _ in entries]
    same(f"{path.name}: timesteps by pyvista", pyvista.PVDReader(path).time_values, steps)
    if steps != sorted(steps):
        problem(f"{path.name}: timesteps are not ascending")
    return entries


def check_elements(grid):
    """Cells of solid elements with positive volumes by VTK; middles in the middle of VTK's edges."""
    cells = vtk.vtkCellSizeFilter()
    cells.SetInputData(grid.grid)
    cells.Update()
    volume = vtk_to_numpy(cells.GetOutput().GetCellData().GetArray("Volume"))
    points, counts, worst = grid.points(), {}, {}
    for i in range(grid.grid.GetNumberOfCells()):
        cell = grid.grid.GetCell(i)
        kind = cell.GetClassName()[3:]
        counts[kind] = counts.get(kind, 0) + 1
        if cell.GetCellDimension() != 3:
            problem(f"{grid.name}: cell {i} is a {kind}, expected solid elements only")
            return
        if cell.IsLinear():
            continue
        for e in range(cell.GetNumberOfEdges()):
            edge = cell.GetEdge(e)
            a, b, middle = (points[edge.GetPointId(k)] for k in range(3))
            off = np.linalg.norm(middle - (a + b) / 2) / np.linalg.norm(b - a)
            worst[kind] = max(worst.get(kind, 0.0), off)
    if not (volume > 0).all():
        problem(f"{grid.name}: {int((volume <= 0).sum())} elements have no positive volume")
    for kind, off in worst.items():
        if off > MIDDLE:
            problem(f"{grid.name}: a node of a {kind} is {off:.2f} edge lengths off the middle of VTK's edge")
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items()))
    facts.append(f"{grid.name}: {kinds}, {volume.sum():.6e} m3 by VTK")


def check_flank_geometry(grid, pairs, table):
    if set(grid.types().tolist()) - {VTK_QUAD}:
        problem(f"{grid.name}: cells other than quadrilaterals")
    if sorted(set(grid.cell("pair").tolist())) != list(range(len(pairs))):
        problem(f"{grid.name}: {table} has {len(pairs)} pairs, its cells belong to others")
    position = np.column_stack([column(pairs, k, table) for k in ("x_m", "y_m", "z_m")])
    same(f"{grid.name}: positions against {table}", grid.points()[: len(pairs)], position)
    same(f"{grid.name}: area_m2 against {table}", grid.of_pairs("area_m2"),
         column(pairs, "area_m2", table))
    sizes = vtk.vtkCellSizeFilter()
    sizes.SetInputData(grid.grid)
    sizes.Update()
    return vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray("Area")).sum()


def check_static(root, grids, summary):
    table = "static.csv"
    rows = read_table(root / table)
    if not rows:
        facts.append("static.csv: no pairs, all contacts are bonded")
        check_elements(grids["static.vtu"])
        return
    pressure_missing = [r["pressure_pa"] == "" for r in rows]
    if all(pressure_missing):
        facts.append("static.csv: the static state did not converge, nothing to compare")
        return
    force = column(rows, "normal_force_n", table)
    pressure, area = column(rows, "pressure_pa", table), column(rows, "area_m2", table)
    same("static.csv: pressure x area against normal_force_n", pressure * area, force, relative=SUM)
    slip = column(rows, "slip_m", table)
    same("static.csv: slip_m against its components", slip,
         np.hypot(column(rows, "slip_t1_m", table), column(rows, "slip_t2_m", table)), relative=SUM)
    gap, clearance = column(rows, "gap_m", table), column(rows, "clearance_m", table)

    flank = grids["flank_static.vtu"]
    area_by_vtk = check_flank_geometry(flank, rows, table)
    for name in ("pressure_pa", "normal_force_n", "slip_m", "gap_m"):
        same(f"{flank.name}: {name} against {table}", flank.pairs(name), column(rows, name, table))
    slip_vector, normal = flank.pairs("slip_vector_m"), flank.pairs("normal")
    same(f"{flank.name}: |slip_vector_m| against {table}",
         np.linalg.norm(slip_vector, axis=1), slip, relative=SUM, absolute=1e-18)
    check_friction_vectors(flank, rows, slip_vector, normal, table)
    same(f"{flank.name}: status against {table}", flank.of_pairs("status"),
         [STATIC_STATUS.index(r["status"]) for r in rows])
    facts.append(f"{flank.name}: {len(rows)} pairs, {flank.grid.GetNumberOfCells()} shares, "
                 f"{area_by_vtk:.6e} m2 by VTK, {area.sum():.6e} m2 of pairs")

    grid = grids["static.vtu"]
    check_elements(grid)
    check_pairs_in_bodies(grid, rows, slip_vector + (gap - clearance)[:, None] * normal)
    if not summary:
        return
    for contact in summary["static"]["contacts"]:
        of_contact = np.array([r["contact"] == contact["name"] for r in rows])
        same(f"summary.json: normal force of {contact['name']} against {table}",
             contact["normal_force_n"], force[of_contact].sum(), relative=SUM)
        facts.append(f"static: {contact['name']} carries {contact['normal_force_n']:.6g} N")
    if summary["mesh"]["elements"] != grid.grid.GetNumberOfCells():
        problem(f"{grid.name}: {grid.grid.GetNumberOfCells()} cells, summary.json says "
                f"{summary['mesh']['elements']}")
    if summary["mesh"]["nodes"] != grid.grid.GetNumberOfPoints():
        problem(f"{grid.name}: {grid.grid.GetNumberOfPoints()} points, summary.json says "
                f"{summary['mesh']['nodes']}")


def check_friction_vectors(flank, rows, slip_vector, normal, table):
    """friction_vector_n lies in the flank; its size and angle with the slip are the table's."""
    found = flank.pairs("friction_vector_n")
    friction, slip = (np.column_stack([column(rows, f"{name}_t{i}_{unit}", table) for i in (1, 2)])
                      for name, unit in (("friction", "n"), ("slip", "m")))
    size = np.linalg.norm(friction, axis=1)
    largest = max(size.max(), 1e-300)
    same(f"{flank.name}: |friction_vector_n| against {table}",
         np.linalg.norm(found, axis=1), size, relative=SUM, absolute=SUM * largest)
    same(f"{flank.name}: friction_vector_n along the normal",
         (found * normal).sum(axis=1), np.zeros(len(rows)), absolute=SUM * largest)
    along = np.linalg.norm(slip, axis=1).max()
    same(f"{flank.name}: friction_vector_n times slip_vector_m against {table}",
         (found * slip_vector).sum(axis=1), (friction * slip).sum(axis=1),
         absolute=SUM * largest * along)


def node_numbers(grid):
    body, tag = grid.point("body"), grid.point("node_tag")
    return {(int(b), int(t)): i for i, (b, t) in enumerate(zip(body, tag))}


def check_pairs_in_bodies(grid, rows, relative_m):
    """u of the first flank - u of the second at each pair is its slip and opening, as vectors."""
    numbers = node_numbers(grid)
    names = [k for k in rows[0] if k.endswith("_node")]
    nodes = [[numbers.get((b, int(r[name])), -1) for r in rows] for b, name in enumerate(names)]
    if min(map(min, nodes)) < 0:
        problem(f"{grid.name}: a node of static.csv is not in it")
        return
    u, x = grid.point("displacement_m"), grid.points()
    moved = u[nodes[0]]
    if len(nodes) == 2:  # not on rigid ground
        moved = moved - u[nodes[1]]
        distance = np.linalg.norm(x[nodes[0]] - x[nodes[1]], axis=1)
        size = np.ptp(x, axis=0).max()
        if distance.max() > 1e-6 * size:
            problem(f"{grid.name}: the nodes of a pair are {distance.max()} m apart")
    largest = np.linalg.norm(relative_m, axis=1).max()
    same(f"{grid.name}: displacement of the pairs against slip_vector_m of flank_static.vtu and "
         "gap_m of static.csv", moved, relative_m, absolute=1e-6 * max(largest, 1e-12))


# Outcomes of response.csv that come with numbers.
HAS_NUMBERS = ("converged", "accuracy_not_reached")


def check_response(root, grids, summary):
    table = "response.csv"
    rows = read_table(root / table)
    converged = [i for i, r in enumerate(rows) if r["outcome"] in HAS_NUMBERS]
    good = [rows[i] for i in converged]
    for i, row in enumerate(rows):
        if row["outcome"] not in HAS_NUMBERS and (row["friction_power_w"] or row["slipping_pairs"]):
            problem(f"{table}: row {i} ({row['outcome']}) has numbers that look like a result")
    pairs = read_table(root / "contact.csv")
    frequency = column(good, "frequency_hz", table)
    power = column(good, "friction_power_w", table)
    if not pairs:
        same(f"{table}: friction power without pairs", power, np.zeros(len(good)))
        if converged:
            check_peak(root, grids, good, converged, pairs, summary)
        return
    series = read_pvd(root / "flank.pvd", root, grids)
    if len(series) != len(converged):
        problem(f"flank.pvd: {len(series)} files, {len(converged)} points of {table} converged")
    by_name = {grid.name: t for t, grid in series}
    total, opening = np.zeros(len(pairs)), np.zeros(len(pairs))
    separates = np.zeros(len(pairs), dtype=bool)
    weight = weights(rows)
    rises = all(np.diff([float(row["frequency_hz"]) for row in rows]) > 0)
    for n, i in enumerate(converged):
        name = f"flank/flank_{int(rows[i]['point']):04}.vtu"
        if name not in by_name:
            problem(f"{name}: missing, row {i} of {table} converged")
            continue
        grid = grids[name]
        same(f"{name}: timestep against frequency_hz or the row", by_name[name], frequency[n] if rises else i)
        check_flank_geometry(grid, pairs, "contact.csv")
        joules = grid.pairs("friction_energy_j_m2") * grid.of_pairs("area_m2")
        watts = joules * frequency[n]
        scale = np.abs(watts).sum()
        same(f"{name}: sum of friction energy x area x frequency against friction_power_w of {table}",
             watts.sum(), power[n], relative=1e-6, absolute=1e-9 * scale)
        status = grid.of_pairs("status")
        for code, word in enumerate(CYCLE_STATUS):
            same(f"{name}: pairs with status {code} against {word}_pairs",
                 int((status == code).sum()), int(rows[i][f"{word}_pairs"]))
        low, mean, high = (grid.pairs(f"pressure_{k}_pa") for k in ("min", "mean", "max"))
        slack = 1e-9 * np.abs(high).max()
        if (low > mean + slack).any() or (mean > high + slack).any():
            problem(f"{name}: pressures are not ordered min <= mean <= max")
        if (low < 0).any():
            problem(f"{name}: a pressure below zero")
        total += watts * weight[i]
        opening += (status == 2) * weight[i]
        separates |= status == 2
    check_sweep(pairs, total, opening, separates, good, sum(weight[i] for i in converged))
    facts.append(f"flank.pvd: {len(series)} files for {len(converged)} converged points "
                 f"of {len(rows)}; friction power {power.sum():.6e} W in all")
    if converged:
        check_peak(root, grids, good, converged, pairs, summary)


def weights(rows):
    """Weight of each row in the means over frequency: 1 on a grid, and along a curve that was followed the range of
    frequencies nearest to the point. A gap of such a curve counts as a part of it."""
    steps = np.diff([float(r["frequency_hz"]) for r in rows])
    if len(steps) == 0 or np.allclose(steps, steps[0], rtol=1e-6):
        return [1.0] * len(rows)
    weight = np.zeros(len(rows))
    for i, step in enumerate(steps):
        if rows[i]["branch"] == rows[i + 1]["branch"]:
            weight[i : i + 2] += 0.5 * abs(step)
    return weight.tolist()


def check_sweep(pairs, total, opening, separates, good, whole):
    """The means of contact.csv against the sums of the series."""
    table = "contact.csv"
    if not good:
        return
    mean = column(pairs, "friction_power_mean_w", table)
    same(f"{table}: friction_power_mean_w against the series", mean, total / whole,
         relative=SUM, absolute=1e-9 * np.abs(mean).max())
    same(f"{table}: opening_share against the series", column(pairs, "opening_share", table),
         opening / whole, relative=SUM)
    flags = [int(r["opens_at_any_frequency"] == "true") for r in pairs]
    same(f"{table}: opens_at_any_frequency against the series", flags, separates.astype(int))


def check_peak(root, grids, good, converged, pairs, summary):
    """contact.csv against the flanks at the peak; the motion against response.csv."""
    if summary and summary["response"]["resonance_not_computed_hz"]:
        same("contact.csv: frequencies of a peak that was not computed",
             len([r for r in pairs if r["peak_frequency_hz"]]), 0)
        return
    first = next(k for k in good[0] if k.endswith("_amplitude_m"))
    observation = first[: -len("_amplitude_m")]
    amplitude = column(good, first, "response.csv")
    best = int(np.argmax(amplitude))
    frequency = float(good[best]["frequency_hz"])
    if pairs:
        of_series = grids[f"flank/flank_{int(good[best]['point']):04}.vtu"]
        at_peak = grids["flank_peak.vtu"]
        for flank in (of_series, at_peak):
            for name in ("pressure_mean_pa", "pressure_min_pa", "pressure_max_pa", "slid_m",
                         "open_fraction", "friction_energy_j_m2"):
                same(f"{flank.name}: {name} against contact.csv", flank.pairs(name),
                     column(pairs, f"peak_{name}", "contact.csv"))
            same(f"{flank.name}: status against contact.csv", flank.of_pairs("status"),
                 [CYCLE_STATUS.index(r["peak_status"]) for r in pairs])
        check_flank_geometry(at_peak, pairs, "contact.csv")
        same(f"{at_peak.name}: separates against contact.csv", at_peak.of_pairs("separates"),
             [int(r["opens_at_any_frequency"] == "true") for r in pairs])
    if summary:
        same("summary.json: peak amplitude against response.csv",
             summary["response"]["peak_amplitude_m"], amplitude[best])
    check_motion(grids["peak.vtu"], good[best], summary, observation)
    check_stress(root, grids["peak.vtu"])
    if pairs:
        check_fretting(grids["flank_peak.vtu"])
    if (root / "peak.pvd").exists():
        check_frames(grids["peak.vtu"], read_pvd(root / "peak.pvd", root, grids), frequency)


def harmonics(grid):
    """cos and sin of each harmonic on the nodes."""
    k, found = 1, []
    while grid.grid.GetPointData().HasArray(f"h{k}_cos_m"):
        found.append((grid.point(f"h{k}_cos_m"), grid.point(f"h{k}_sin_m")))
        k += 1
    return found


def check_motion(grid, row, summary, name):
    """Harmonics of the observed displacement, from the nodes, against response.csv."""
    check_elements(grid)
    motion = harmonics(grid)
    for k, (cosine, sine) in enumerate(motion, 1):
        amplitude, phase = grid.point(f"h{k}_amplitude_m"), grid.point(f"h{k}_phase_rad")
        size = np.abs(amplitude).max()
        for part, found in ((np.cos, cosine), (np.sin, sine)):
            same(f"{grid.name}: h{k}_amplitude_m and h{k}_phase_rad against its {part.__name__}",
                 amplitude * part(phase), found, absolute=1e-12 * size)
    if not summary:
        return
    numbers = node_numbers(grid)
    terms = next(o for o in summary["observations"] if o["name"] == name)["terms"]

    def observed(field):
        return sum(field[numbers[t["body"], t["node_tag"]]] @ np.array(t["direction"])
                   for t in terms)

    found = [observed(cosine) + 1j * observed(sine) for cosine, sine in motion]
    if row.get(f"{name}_h{len(found) + 1}_amplitude_m"):
        problem(f"{grid.name}: {len(found)} harmonics, response.csv has more")
    expected = [float(row[f"{name}_h{k}_amplitude_m"])
                * np.exp(1j * float(row[f"{name}_h{k}_phase_rad"]))
                for k in range(1, len(found) + 1)]
    same(f"{grid.name}: harmonics of {name} (amplitude and phase) against response.csv", found,
         expected, absolute=1e-6 * np.abs(expected).max())
    phases = 2 * math.pi * np.arange(3600) / 3600
    signal = sum((a * np.exp(-1j * k * phases)).real for k, a in enumerate(found, 1))
    largest, amplitude = np.abs(signal).max(), float(row[f"{name}_amplitude_m"])
    same(f"{grid.name}: amplitude of {name} against response.csv", largest, amplitude,
         relative=1e-3)
    facts.append(f"{grid.name}: {len(found)} harmonics of {name} as in response.csv; "
                 f"largest in the period {largest:.6e} m, amplitude {amplitude:.6e} m")


def von_mises(stress):
    xx, yy, zz, xy, yz, xz = np.moveaxis(stress, -1, 0)
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(normal / 2 + 3 * (xy**2 + yz**2 + xz**2))


def check_stress(root, grid):
    """Mean, amplitude and largest equivalent stress from the tensors; stress.csv against the nodes."""
    if not grid.grid.GetPointData().HasArray("mean_stress_pa"):
        return
    table = read_table(root / "stress.csv")
    numbers, names = node_numbers(grid), sorted({r["body"] for r in table})
    mean, k, moving = grid.point("mean_stress_pa"), 1, []
    while grid.grid.GetPointData().HasArray(f"h{k}_stress_cos_pa"):
        moving.append((grid.point(f"h{k}_stress_cos_pa"), grid.point(f"h{k}_stress_sin_pa")))
        k += 1
    amplitude = grid.point("von_mises_amplitude_pa")
    nodes = np.unique(np.append(np.arange(0, len(mean), max(1, len(mean) // 100)), np.argmax(amplitude)))
    phases = 2 * math.pi * np.arange(240) / 240
    swing = sum(np.cos(k * phases)[:, None, None] * c[nodes] + np.sin(k * phases)[:, None, None] * s[nodes]
                for k, (c, s) in enumerate(moving, 1))
    ranges = [von_mises(swing[:, None, i] - swing[None, :, i]).max() for i in range(len(nodes))]
    scale = amplitude.max() + np.abs(mean).max()
    same(f"{grid.name}: von_mises_amplitude_pa against the tensors", amplitude[nodes], np.array(ranges) / 2,
         absolute=2e-4 * scale)
    same(f"{grid.name}: von_mises_largest_pa against the tensors", grid.point("von_mises_largest_pa")[nodes],
         von_mises(mean[nodes] + swing).max(axis=0), absolute=2e-4 * scale)
    signed = np.sign(mean[:, :3].sum(axis=1)) * von_mises(mean)
    same(f"{grid.name}: von_mises_mean_pa against the tensors", grid.point("von_mises_mean_pa"), signed,
         absolute=1e-9 * scale)
    for row in table:
        at = [numbers[b, int(row["node_tag"])] for b in sorted({b for b, _ in numbers})
              if (b, int(row["node_tag"])) in numbers]
        found = min(abs(amplitude[i] / float(row["von_mises_amplitude_pa"]) - 1) for i in at)
        if found > 1e-12:
            problem(f"stress.csv: node {row['node_tag']} of {row['body']} has another amplitude in {grid.name}")
    facts.append(f"{grid.name}: stress of {len(nodes)} nodes as from its tensors; {len(table)} places in stress.csv, "
                 f"bodies {', '.join(names)}")


def check_fretting(grid):
    """Ruiz' parameter of wear from its factors."""
    slid = grid.pairs("slid_m")
    wear, stress = grid.pairs("ruiz_wear_pa_m"), grid.pairs("friction_stress_max_pa")
    same(f"{grid.name}: ruiz_wear_pa_m against its factors", wear, stress * slid / 2)


def check_frames(peak, frames, frequency):
    """The frames of a period against the harmonics."""
    count = len(frames)
    same("peak.pvd: timesteps against one period of the peak's frequency",
         [t for t, _ in frames], [i / (count * frequency) for i in range(count)],
         relative=1e-12)
    mean, motion = peak.point("mean_m"), harmonics(peak)
    scale = np.abs(mean).max() + max(np.abs(cosine).max() + np.abs(sine).max()
                                     for cosine, sine in motion)
    for i, (_, grid) in enumerate(frames):
        phase = 2 * math.pi * i / count
        moving = sum(math.cos(k * phase) * cosine + math.sin(k * phase) * sine
                     for k, (cosine, sine) in enumerate(motion, 1))
        same(f"{grid.name}: oscillation_m against the harmonics of peak.vtu",
             grid.point("oscillation_m"), moving, absolute=1e-12 * scale)
        same(f"{grid.name}: displacement_m against peak.vtu", grid.point("displacement_m"),
             mean + moving, absolute=1e-12 * scale)
    facts.append(f"peak.pvd: {count} frames of the motion in peak.vtu")


def check_report(root):
    """The report needs no other file, and is small enough to be sent by mail."""
    page = (root / "report.html").read_text(encoding="utf-8")
    for link in ['src="http', "src='http", "<link", "@import"]:
        if link in page:
            problem(f"report.html: is not self-contained: {link}")
    if len(page.encode()) > MOST_REPORT_BYTES:
        problem(f"report.html: {len(page.encode())} bytes, at most {MOST_REPORT_BYTES:.0f}")
    facts.append(f"report.html: {len(page.encode())} bytes")


def main():
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        print("usage: check_output.py OUTPUT_FOLDER (a folder written by dovetail run)",
              file=sys.stderr)
        return 2
    root = Path(sys.argv[1])
    grids = {}
    for path in sorted(root.rglob("*.vtu")):
        grid = Grid(path, root)
        grids[grid.name] = grid
        if not grid.failed:
            grid.check_arrays()
            grid.check_other_readers(path)
    if not grids:
        problem(f"{root}: no .vtu file")
    summary = None
    if (root / "summary.json").exists():
        summary = json.loads((root / "summary.json").read_text(encoding="utf-8"))
    checks = [("static.csv", check_static), ("response.csv", check_response)]
    if not any((root / table).exists() for table, _ in checks):
        problem(f"{root}: neither static.csv nor response.csv")
    if not any(grid.failed for grid in grids.values()):
        for table, check in checks:
            if not (root / table).exists():
                continue
            try:
                check(root, grids, summary)
            except KeyError as missing:
                problem(f"{table}: {missing} is missing")
            except LookupError as missing:
                problem(str(missing))
    if summary and "report.html" in summary.get("files", []):
        check_report(root)
    for line in facts:
        print(line)
    print(f"{len(grids)} .vtu files read by VTK {vtk.vtkVersion.GetVTKVersion()}, "
          f"meshio {meshio.__version__} and pyvista {pyvista.__version__}")
    for line in problems:
        print(f"MISMATCH {line}", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
