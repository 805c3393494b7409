#!/usr/bin/env python3
"""First frequencies of the blade, flanks held: dovetail against CalculiX on the same mesh.

    apt-get install calculix-ccx; cargo build --release
    python3 benches/calculix/compare_blade_modes.py [--scene scenes/paper.toml] [--speed-rpm 0 5000]
    python3 benches/calculix/compare_blade_modes.py --speed-rpm 0 2500 5000 --sizes --orders 1 2

Meshes the scene by `dovetail mesh` (or takes --mesh), runs `dovetail modes` and ccx on it at each
speed and prints a table; ends with status 1 where they differ by more than --tolerance. With --sizes
and --orders on three meshes of each order (sizes below). Material, supports and axis of the decks are
those of the default scene. Needs python3 (standard library only) and ccx, which no test installs;
takes half a minute, with --sizes ten.
"""

import argparse
import csv
import math
import pathlib
import subprocess
import sys
import tempfile

import blade_modes
import deck
import msh

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Parameters of geometry/dovetail.geo. The blade alone is compared: the jaw may stay coarse.
SIZES = {
    "coarse": {"nu": 3, "nv": 4, "lc": 16, "lc_root": 8, "lc_air": 12, "lc_edge": 6, "grow": 0.8},
    "paper": {"nu": 4, "nv": 9},
    "fine": {"nu": 6, "nv": 14, "lc": 8, "lc_root": 2.2, "lc_air": 2.2, "lc_edge": 0.9},
}


def dovetail(given, command, out, *sets, options=()):
    """Runs one subcommand of dovetail on the scene."""
    words = [given.dovetail, command, given.scene, "--out", str(out), "--quiet", *options]
    for key in sets:
        words += ["--set", key]
    done = subprocess.run(words, capture_output=True, text=True, timeout=given.time_limit)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(words)}\n{done.stderr}")


def held_frequencies_hz(table):
    with open(table, newline="") as file:
        rows = [r for r in csv.DictReader(file) if (r["kind"], r["body"]) == ("flanks_held", "blade")]
    return [float(r["frequency_hz"]) for r in rows]


def made(given, folder, size, order):
    """The scene's mesh, or that of a size and an order."""
    sets = [f"mesh.parameters.{k}={v}" for k, v in SIZES.get(size, {}).items()]
    if order != "scene":
        sets.append(f"mesh.parameters.order={order}")
    mesh = folder / "mesh.msh"
    mesh.unlink(missing_ok=True)
    dovetail(given, "mesh", folder, *sets)
    if not mesh.exists():
        raise SystemExit("gmsh is not installed: give the ready mesh with --mesh meshes/dovetail.msh")
    return mesh.rename(folder / "compared.msh")


def compare(given, folder, mesh, label):
    """Prints a line for each speed and mode; the largest difference."""
    _, groups = msh.read(mesh)
    count = len(msh.group(groups, "blade"))
    worst = 0.0
    for speed in given.speed_rpm:
        dovetail(given, "modes", folder, f"mesh.file={mesh}", f"rotation.speed_rpm={speed:g}")
        ours = held_frequencies_hz(folder / "modes.csv")
        case = blade_modes.case(mesh, given.modes, speed)
        theirs = deck.frequencies_hz(deck.run(case, folder, "modes", given.time_limit))
        for mode, (a, b) in enumerate(zip(ours[: given.modes], theirs[: given.modes], strict=True), 1):
            worst = max(worst, abs(a / b - 1.0))
            print(f"{label}  {count:8}  {speed:9g}  {mode:4}  {a:12.4f}  {b:12.4f}  "
                  f"{100 * (a / b - 1):+9.4f} %", flush=True)
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", default=str(ROOT / "scenes/paper.toml"))
    parser.add_argument("--mesh", help="a ready mesh instead of the scene's")
    parser.add_argument("--dovetail", default=str(ROOT / "target/release/dovetail"), help="the program")
    parser.add_argument("--speed-rpm", type=float, nargs="+", default=[0.0, 5000.0])
    parser.add_argument("--sizes", action="store_true", help="three meshes: " + ", ".join(SIZES))
    parser.add_argument("--orders", type=int, nargs="+", choices=[1, 2], help="of the elements")
    parser.add_argument("--modes", type=int, default=4, help="at most 6")
    parser.add_argument("--tolerance", type=float, default=0.005, help="largest relative difference allowed")
    parser.add_argument("--time-limit", type=float, default=600.0, help="for each run, s")
    given = parser.parse_args()

    worst = 0.0
    print("   mesh  order  elements  speed_rpm  mode   dovetail_hz   calculix_hz   difference")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for size in SIZES if given.sizes else ["scene"]:
            for order in given.orders or ["scene"]:
                mesh = given.mesh and pathlib.Path(given.mesh).resolve()
                if not mesh:
                    mesh = made(given, folder, size, order)
                worst = max(worst, compare(given, folder, mesh, f"{size:>7}  {order:>5}"))
    print(f"largest difference {100 * worst:.4f} %, allowed {100 * given.tolerance:g} %")
    return 0 if math.isfinite(worst) and worst <= given.tolerance else 1


if __name__ == "__main__":
    sys.exit(main())
