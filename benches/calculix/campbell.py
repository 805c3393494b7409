#!/usr/bin/env python3
"""Frequencies of the blade over the speed, flanks held: `dovetail modes --rpm` against CalculiX.

    apt-get install calculix-ccx gmsh; cargo build --release
    python3 benches/calculix/campbell.py [--rpm 0:5000:3] [--sizes coarse paper fine] [--orders 1 2]

Three meshes of the scene's geometry, of linear and of quadratic tetrahedra; on each the Campbell table of
dovetail and, at each of its speeds, a static and a prestressed frequency step of ccx. Prints a Markdown
table; ends with status 1 where they differ by more than ALLOWED. What the differences are: quadrature.py and
initial_displacement.py. Material, supports and axis of the decks are those of scenes/paper.toml. Needs python3 (standard library only), gmsh and ccx; takes minutes.
"""

import argparse
import csv
import math
import pathlib
import sys
import tempfile

import blade_modes
import compare_blade_modes
import deck
import msh

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402

ROOT = compare_blade_modes.ROOT
SIZES = compare_blade_modes.SIZES
# Relative, by the order of the tetrahedra.
ALLOWED = {1: 0.02, 2: 0.002}


def campbell_hz(table, modes):
    """{speed in rpm: frequencies of the blade with its flanks held}, ascending."""
    speeds = {}
    with open(table, newline="") as file:
        for row in csv.DictReader(file):
            if row["kind"] == "flanks_held" and int(row["mode"]) <= modes:
                speeds.setdefault(float(row["speed_rpm"]), []).append(float(row["frequency_hz"]))
    return speeds


def compare(given, folder, mesh, label):
    """Prints a line for each speed; the largest difference."""
    _, groups = msh.read(mesh)
    tets = len(msh.group(groups, "blade"))
    compare_blade_modes.dovetail(given, "modes", folder, f"mesh.file={mesh}", options=["--rpm", given.rpm])
    worst = 0.0
    for speed, ours in campbell_hz(folder / "modes_campbell.csv", given.modes).items():
        case = blade_modes.case(mesh, given.modes, speed)
        theirs = deck.frequencies_hz(deck.run(case, folder, "modes", given.time_limit))[: given.modes]
        off = [a / b - 1.0 for a, b in zip(ours, theirs, strict=True)]
        worst = max([worst, *map(abs, off)])
        cells = [label, f"{tets}", f"{speed:g}", f"{ours[0]:.3f}", f"{theirs[0]:.3f}"]
        print("| " + " | ".join(cells + [f"{100 * o:+.4f} %" for o in off]) + " |", flush=True)
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", default=str(ROOT / "scenes/paper.toml"))
    parser.add_argument("--dovetail", default=str(ROOT / "target/release/dovetail"), help="the program")
    parser.add_argument("--rpm", default="0:5000:3", help="speeds, FROM:TO:N")
    parser.add_argument("--sizes", nargs="+", default=list(SIZES), choices=list(SIZES))
    parser.add_argument("--orders", type=int, nargs="+", default=[1, 2], choices=[1, 2], help="of the tetrahedra")
    parser.add_argument("--modes", type=int, default=4, help="at most 6")
    parser.add_argument("--time-limit", type=float, default=600.0, help="for each run, s")
    given = parser.parse_args()

    heads = ["mesh", "order", "tetrahedra of the blade", "speed, rpm", "mode 1, dovetail, Hz", "CalculiX, Hz"]
    heads += [f"difference, mode {mode}" for mode in range(1, given.modes + 1)]
    print("| " + " | ".join(heads) + " |")
    print("|" + " --- |" * len(heads))
    worst = dict.fromkeys(given.orders, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for size in given.sizes:
            for order in given.orders:
                mesh = compare_blade_modes.made(given, folder, size, order)
                worst[order] = max(worst[order], compare(given, folder, mesh, f"{size} | {order}"))
    for order, found in worst.items():
        print(f"order {order}: largest difference {100 * found:.4f} %, allowed {100 * ALLOWED[order]:g} %")
    return 0 if all(math.isfinite(found) and found <= ALLOWED[order] for order, found in worst.items()) else 1


if __name__ == "__main__":
    print(origin.line() + "\n")
    sys.exit(main())
