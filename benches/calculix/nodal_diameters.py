#!/usr/bin/env python3
"""Frequencies over the nodal diameters of a bladed disc: dovetail against CalculiX on the same sector.

    apt-get install calculix-ccx gmsh; cargo build --release
    python3 benches/calculix/nodal_diameters.py [--speed-rpm 0 10000] [--sectors 6] [--sizes 0.02 0.01]

Meshes the sector of scenes/verification/disc_sector.toml by `dovetail mesh` with elements of each size, in metres,
runs `dovetail modes` and ccx (*CYCLIC SYMMETRY MODEL) at each speed, and prints a table of the first modes of each
nodal diameter. Ends with status 1 where they differ by more than --tolerance. Needs python3 (standard library only),
gmsh and ccx; takes a quarter of a minute.
"""

import argparse
import csv
import math
import pathlib
import re
import sys
import tempfile

import compare_blade_modes
import deck
import msh

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402

SCENE = compare_blade_modes.ROOT / "scenes/verification/disc_sector.toml"
MOST_MODES = 6


def case(mesh, sectors, modes, speed_rpm):
    """Lines of a deck of the sector about the x axis, with the modes of all nodal diameters."""
    points, groups = msh.read(mesh)
    solid = msh.group(groups, "disc")
    used = {n for _, e in solid for n in e}
    on = {name: {n for _, e in msh.group(groups, name) for n in e} for name in ["bore", "low", "high"]}
    lines = deck.nodes({t: points[t] for t in used}, 1.0)
    lines += deck.solid(solid, "DISC") + deck.node_set("BORE", on["bore"])
    # CalculiX ties the slave to the master face by interpolation. Held nodes are left out of the slave.
    faces = {"LOW": on["low"] - on["bore"], "HIGH": on["high"]}
    for name, tags in faces.items():
        lines += deck.node_set(name, tags) + [f"*SURFACE, NAME=S{name}, TYPE=NODE", name]
    lines += ["*TIE, NAME=PITCH, CYCLIC SYMMETRY, POSITION TOLERANCE=1e-4", "SLOW, SHIGH"]
    lines += [f"*CYCLIC SYMMETRY MODEL, N={sectors}, NGRAPH=1, TIE=PITCH", "0, 0, 0, 1, 0, 0"]
    lines += deck.material(["DISC"]) + ["*BOUNDARY", "BORE, 1, 3"]
    last = ["*FREQUENCY, SOLVER=SPOOLES", str(2 * modes)]
    last += [f"*SELECT CYCLIC SYMMETRY MODES, NMIN=0, NMAX={sectors // 2}", "*END STEP"]
    if speed_rpm == 0.0:
        return lines + ["*STEP"] + last
    load = deck.centrifugal("DISC", speed_rpm * math.pi / 30.0)
    return lines + ["*STEP", "*STATIC", *load, "*END STEP", "*STEP, PERTURBATION"] + last


def calculix_hz(dat, modes):
    """Frequencies of each nodal diameter. Those of a travelling wave are there twice."""
    found = {}
    for table in dat.read_text().split("E I G E N V A L U E   O U T P U T")[1:]:
        rows = re.findall(r"^\s+(\d+)\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", table.split("P A R T")[0], re.M)
        for diameter, hz in rows:
            found.setdefault(int(diameter), []).append(float(hz))
    single = {}
    for diameter, all_hz in found.items():
        own = sorted(all_hz)
        pairs = list(zip(own[::2], own[1::2]))
        twice = pairs and all(math.isclose(a, b, rel_tol=1e-6) for a, b in pairs)
        single[diameter] = (own[::2] if twice else own)[:modes]
    return single


def dovetail_hz(folder, modes):
    found = {}
    with open(folder / "modes_nodal_diameters.csv", newline="") as file:
        for row in csv.DictReader(file):
            if int(row["mode"]) <= modes:
                found.setdefault(int(row["nodal_diameter"]), []).append(float(row["frequency_hz"]))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", default=str(SCENE))
    parser.add_argument("--dovetail", default=str(compare_blade_modes.ROOT / "target/release/dovetail"), help="the program")
    parser.add_argument("--speed-rpm", type=float, nargs="+", default=[0.0, 10000.0])
    parser.add_argument("--sectors", type=int, default=6)
    parser.add_argument("--sizes", type=float, nargs="+", default=[0.02, 0.01, 0.007], help="of the elements, m")
    parser.add_argument("--modes", type=int, default=4, help=f"of each nodal diameter, at most {MOST_MODES}")
    parser.add_argument("--tolerance", type=float, default=1e-3, help="largest relative difference allowed")
    parser.add_argument("--time-limit", type=float, default=600.0, help="for each run, s")
    given = parser.parse_args()

    print(origin.line())
    print("\n| element, m | elements | rpm | nodal diameter | dovetail, Hz | largest difference |")
    print("| --- | --- | --- | --- | --- | --- |")
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for size in given.sizes:
            sectors = [f"mesh.parameters.n={given.sectors}", f"cyclic.sectors={given.sectors}"]
            compare_blade_modes.dovetail(given, "mesh", folder, f"mesh.parameters.lc={size}", *sectors)
            mesh = (folder / "mesh.msh").rename(folder / "compared.msh")
            count = len(msh.group(msh.read(mesh)[1], "disc"))
            for speed in given.speed_rpm:
                own = ["mesh.geometry=", "mesh.parameters=", f"mesh.file={mesh}", f"rotation.speed_rpm={speed:g}"]
                compare_blade_modes.dovetail(given, "modes", folder, *own, sectors[1])
                ours = dovetail_hz(folder, given.modes)
                lines = case(mesh, given.sectors, given.modes, speed)
                theirs = calculix_hz(deck.run(lines, folder, "disc", given.time_limit), given.modes)
                for diameter, values in ours.items():
                    pairs = zip(values, theirs[diameter], strict=True)
                    difference = max((a / b - 1.0 for a, b in pairs), key=abs)
                    worst = max(worst, abs(difference))
                    cells = ", ".join(f"{hz:.2f}" for hz in values)
                    print(f"| {size:g} | {count} | {speed:g} | {diameter} | {cells} | {difference:.1e} |", flush=True)
    print(f"\nlargest difference {worst:.1e}, allowed {given.tolerance:g}")
    return 0 if math.isfinite(worst) and worst <= given.tolerance else 1


if __name__ == "__main__":
    sys.exit(main())
