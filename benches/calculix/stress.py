#!/usr/bin/env python3
"""Stress at the integration points: dovetail against CalculiX on the same mesh, at rest and in harmonic motion.

    apt-get install calculix-ccx gmsh; cargo build --release
    target/venv/bin/python benches/calculix/stress.py [--elements C3D10 C3D20] [--modes 10 20 40 80]

Meshes geometry/verification/element_bar.geo with straight edges, its root held and its end pulled, by
`dovetail static --stress-points` and `dovetail run --stress-points` of scenes/verification/element_bar.toml and by
ccx (*STATIC, then *FREQUENCY and *STEADY STATE DYNAMICS, the base shaken). Points are paired by their place. Differences are of all
components, relative to the largest equivalent stress of von Mises of all points. In motion the number of modes of
both programs is doubled, and the table has what the last doubling changes in each. The nodes are compared, too:
CalculiX extrapolates its integration points to them, and dovetail evaluates the element there. Prints Markdown
tables; ends with status 1 where a difference at rest is above 1e-6, or in motion with the most modes above 1e-3.
Needs python3, numpy, scipy, pyvista, gmsh and ccx; takes ten seconds.
"""

import argparse
import json
import pathlib
import re
import sys
import tempfile

import numpy
import pyvista
from scipy.spatial import cKDTree

import compare_blade_modes
import compare_elements
import deck
import msh

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402

STRAIGHT = {"twist": 0, "camber": 0, "nsec": 2, "Mesh.SecondOrderLinear": 1}
ALLOWED = {"at rest": 1e-6, "in motion": 1e-3}
# Of the response: share of the first frequency, and damping. The base is shaken along y by 1 m/s2.
SHARE, RATIO = 0.97, 0.001
# Elements whose mass both programs integrate alike (quadrature.py).
ALIKE = ["C3D10", "C3D20"]
# CalculiX has xx, yy, zz, xy, xz, yz; dovetail has xx, yy, zz, xy, yz, xz, as the .frd files of CalculiX do.
OURS = [0, 1, 2, 3, 5, 4]


def equivalent(stress):
    xx, yy, zz, xy, xz, yz = stress.T
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return numpy.sqrt(normal / 2 + 3 * (xy**2 + xz**2 + yz**2))


def bodies(mesh):
    """Lines of the deck that both analyses share, and the nodes that are pulled."""
    points, groups = msh.read(mesh)
    solid = msh.group(groups, "bar")
    fixed = {n for _, e in msh.group(groups, compare_elements.ROOT_GROUP) for n in e}
    ends = sorted({n for _, e in msh.group(groups, compare_elements.CORNERS) for n in e})
    lines = deck.nodes({t: points[t] for t in {n for _, e in solid for n in e}}, compare_elements.UNITS)
    lines += deck.solid(solid, "BAR") + deck.node_set("ROOT", fixed)
    lines += deck.material(["BAR"]) + ["*BOUNDARY", "ROOT, 1, 3"]
    return lines, ends


def tables(dat, heading, columns):
    """All tables with this heading in a .dat file, each as an array."""
    number = r"[-+]?\d*\.?\d+(?:[EeDd][-+]?\d+)?"
    row = re.compile(r"^\s+\d+\s+\d+((?:\s+" + number + r"){%d})\s*$" % columns, re.M)
    parts = dat.read_text().split(heading)[1:]
    found = []
    for part in parts:
        end = re.search(r"\n\s*[a-zA-Z]", part)
        part = part[:end.start()] if end else part
        found.append(numpy.array([[float(x) for x in m[1].split()] for m in row.finditer(part)]))
    return found


def nodal(frd, name):
    """Blocks of nodal results of this name in an .frd file: node numbers and values."""
    found = []
    lines = iter(frd.read_text().splitlines())
    for line in lines:
        if line.startswith(f" -4  {name} "):
            rows = {}
            for line in lines:
                if line.startswith(" -3"):
                    break
                if line.startswith(" -1"):
                    rows[int(line[3:13])] = [float(line[13 + 12 * k:25 + 12 * k]) for k in range(6)]
            found.append(rows)
    return found


def paired(theirs_at, ours_at):
    """Number of our point at each of theirs."""
    far, which = cKDTree(ours_at).query(theirs_at)
    if far.max() > 1e-7 or len(set(which)) != len(ours_at):
        raise SystemExit(f"the integration points differ: {len(theirs_at)} and {len(ours_at)}, up to {far.max():g} m")
    return which


def off(ours, theirs):
    scale = equivalent(theirs if not numpy.iscomplexobj(theirs) else numpy.abs(theirs)).max()
    return numpy.abs(ours - theirs).max() / scale


def at_rest(given, folder, mesh, element):
    lines, ends = bodies(mesh)
    load = [f"{n}, {k + 1}, {f / len(ends):.12g}" for n in ends for k, f in enumerate(compare_elements.FORCE_N)]
    lines += ["*STEP", "*STATIC, SOLVER=SPOOLES", "*CLOAD", *load, "*EL PRINT, ELSET=BAR", "S", "*EL PRINT, ELSET=BAR",
              "COORD", "*EL FILE", "S", "*END STEP"]
    dat = deck.run(lines, folder, "static", given.time_limit)
    theirs, theirs_at = tables(dat, "stresses (", 6)[-1], tables(dat, "global coordinates (", 3)[-1]
    compare_blade_modes.dovetail(given, "static", folder / "ours", f"mesh.file={mesh}", options=["--stress-points"])
    ours = pyvista.read(folder / "ours/static_points.vtu")
    which = paired(theirs_at, ours.points)
    difference = off(ours["stress_pa"][which][:, OURS], theirs)
    # At the nodes.
    nodes = nodal(dat.with_suffix(".frd"), "STRESS")[-1]
    at_nodes = pyvista.read(folder / "ours/static.vtu")
    tags = at_nodes["node_tag"]
    both = numpy.array([nodes[int(t)] for t in tags])[:, OURS]
    of_nodes = numpy.abs(equivalent(both) - at_nodes["von_mises_pa"]).max() / equivalent(both).max()
    print(f"| {element} | {len(theirs)} | {equivalent(theirs).max() / 1e6:.4g} | {difference:.1e} | {of_nodes:.2g} |",
          flush=True)
    return difference


def in_motion(given, folder, mesh, element):
    lines, _ = bodies(mesh)
    first = ["*STEP", "*FREQUENCY, SOLVER=SPOOLES", "1", "*END STEP"]
    hz = deck.frequencies_hz(deck.run(lines + first, folder, "first", given.time_limit))[0]
    at_hz = SHARE * hz
    before = None
    for modes in given.modes:
        compare_blade_modes.dovetail(
            given, "run", folder / "ours", f"mesh.file={mesh}", f"response.frequency_hz=[{at_hz / 1.001},{at_hz}]",
            "load=", "excitation=[{ direction = [0, 1, 0], base_acceleration_m_s2 = 1 }]",
            f"response.stuck_modes={modes}", f"damping={{ ratio = {RATIO}, linear_mode = 1 }}",
            options=["--stress-points", "--force"])
        summary = json.loads((folder / "ours/summary.json").read_text())
        at = summary["response"]["peak_frequency_hz"]
        beta = 2 * RATIO / (2 * numpy.pi * summary["stuck_frequency_hz"])
        ours = pyvista.read(folder / "ours/peak_points.vtu")
        # cos - i sin is the complex amplitude of exp(i w t).
        own = (ours["h1_stress_cos_pa"] - 1j * ours["h1_stress_sin_pa"])[:, OURS]
        steps = ["*STEP", "*FREQUENCY, SOLVER=SPOOLES, STORAGE=YES", str(modes), "*END STEP",
                 "*STEP", "*STEADY STATE DYNAMICS", f"{at:.12g}, {at * 1.5:.12g}, 2", "*MODAL DAMPING, RAYLEIGH",
                 f", , 0., {beta:.12g}", "*DLOAD", "BAR, GRAV, 1., 0., -1., 0.", "*EL PRINT, ELSET=BAR", "S",
                 "*EL PRINT, ELSET=BAR", "COORD", "*END STEP"]
        dat = deck.run(lines + steps, folder, "motion", given.time_limit)
        found = tables(dat, "stresses (", 6)
        real, imaginary = found[0], found[1]
        theirs, theirs_at = real + 1j * imaginary, tables(dat, "global coordinates (", 3)[0]
        own = own[paired(theirs_at, ours.points)]
        difference = off(own, theirs)
        moved = ["", ""] if before is None else [f"{off(a, b):.1e}" for a, b in zip((own, theirs), before)]
        before = own, theirs
        print(f"| {element} | {modes} | {at:.4f} | {numpy.abs(theirs).max() / 1e6:.5g} | {difference:.1e} | "
              f"{moved[0]} | {moved[1]} |", flush=True)
    return difference


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", default=str(compare_blade_modes.ROOT / "scenes/verification/element_bar.toml"))
    parser.add_argument("--dovetail", default=str(compare_blade_modes.ROOT / "target/release/dovetail"), help="the program")
    parser.add_argument("--elements", nargs="+", default=["C3D4", "C3D10", "C3D20"],
                        choices=list(compare_elements.ELEMENTS))
    parser.add_argument("--divisions", type=int, default=1, help="times as many elements each way")
    parser.add_argument("--modes", type=int, nargs="+", default=[10, 20, 40, 80])
    parser.add_argument("--time-limit", type=float, default=600.0, help="for each run, s")
    given = parser.parse_args()
    given.parameters = STRAIGHT

    worst = dict.fromkeys(ALLOWED, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        meshes = {element: compare_elements.made(given, folder, element) for element in given.elements}
        print("| element | points | largest equivalent, MPa | difference at points | at nodes |")
        print("|" + " --- |" * 5)
        for element, mesh in meshes.items():
            worst["at rest"] = max(worst["at rest"], at_rest(given, folder / element, mesh, element))
        print("\n| element | modes | Hz | largest component, MPa | difference | dovetail, last doubling | "
              "CalculiX, last doubling |")
        print("|" + " --- |" * 7)
        for element, mesh in [(e, m) for e, m in meshes.items() if e in ALIKE]:
            worst["in motion"] = max(worst["in motion"], in_motion(given, folder / element, mesh, element))
    print()
    for what, found in worst.items():
        print(f"largest difference {what}: {found:.1e}, allowed {ALLOWED[what]:g}")
    return 0 if all(found <= ALLOWED[what] for what, found in worst.items()) else 1


if __name__ == "__main__":
    print(origin.line() + "\n")
    sys.exit(main())
