#!/usr/bin/env python3
"""Robustness at stick, slip and lift-off: a response over four decades of excitation on three meshes.

    python3 scripts/transitions.py [--points 67] [--out output/transitions] [--mesh "8 x 18"] [--levels 0.01 2]

Each mesh is reduced once (`dovetail reduce`), then solved at ten levels of excitation from 0.01 to 20 N over 0.97 to
1.03 of its first stuck mode, three harmonics, 128 samples. The curve is followed, or solved on a grid of frequencies.
Prints a Markdown table, a line per mesh and level: points that converged, iterations, peak over that of the linear curve, pairs open there. Exit code 1 when a
point has not converged, or the curve has a gap. Needs target/release/dovetail and, for the finer meshes, gmsh.
"""

import argparse
import csv
import json
import subprocess
import sys
import time
from pathlib import Path

import origin

LEVELS_N = [0.01, 0.05, 0.1, 0.3, 0.6, 1, 2, 5, 10, 20]
MESHES = {
    "4 x 9": ["mesh.file=../meshes/dovetail.msh"],
    "6 x 13": ["mesh.parameters={ nu = 6, nv = 13, lc = 5.5, lc_air = 2.7, lc_edge = 1.1, lc_root = 2.7 }"],
    "8 x 18": ["mesh.parameters={ nu = 8, nv = 18, lc = 5, lc_air = 2.5, lc_edge = 1, lc_root = 2.5 }"],
}
ROOT = Path(__file__).resolve().parent.parent
SCENE = """name = "transitions"
[reduced_model]
folder = "."
friction = 0.3
force_n = 1.0
[damping]
ratio = 0.001
linear_mode = 1
[response]
times_first_linear_mode = [0.97, 1.03]
{grid}harmonics = 3
samples = 128
"""


def dovetail(command, scene, out, sets):
    program = [str(ROOT / "target/release/dovetail"), command, str(scene), "--out", str(out), "--quiet"]
    for s in sets:
        program += ["--set", s]
    return subprocess.run(program, capture_output=True, text=True, cwd=ROOT)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, help="of a grid; without it the curve is followed")
    parser.add_argument("--out", type=Path, default=ROOT / "output/transitions")
    parser.add_argument("--mesh", choices=list(MESHES), action="append", help="this one alone")
    parser.add_argument("--levels", type=float, nargs="+", default=LEVELS_N, help="N")
    arguments = parser.parse_args()
    print("| flank | excitation, N | converged | Newton iterations | most for one | peak over linear | pairs open at the peak | held | seconds |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    points = failed = iterations = 0
    for name in arguments.mesh or MESHES:
        sets = MESHES[name]
        folder = arguments.out / name.replace(" ", "")
        reduced = dovetail("reduce", ROOT / "scenes/paper.toml", folder, sets)
        if reduced.returncode != 0:
            sys.exit(reduced.stderr)
        scene = folder / "scene.toml"
        scene.write_text(SCENE.format(grid=f"points = {arguments.points}\n" if arguments.points else ""))
        for level in arguments.levels:
            out = folder / f"{level}N"
            start = time.monotonic()
            run = dovetail("run", scene, out, [f"reduced_model.force_n={level}"])
            seconds = time.monotonic() - start
            if run.returncode not in (0, 3):
                sys.exit(f"{name} {level} N: {run.stderr}")
            with open(out / "response.csv", newline="") as file:
                rows = list(csv.DictReader(file))
            summary = json.loads((out / "summary.json").read_text())["response"]
            newton = [int(row["newton_iterations"]) for row in rows]
            bad = [row for row in rows if row["outcome"] != "converged"]
            good = [row for row in rows if row["outcome"] == "converged"]
            column = next(key for key in rows[0] if key.endswith("_linear_amplitude_m"))
            amplitude = column.replace("_linear", "")
            peak = max(good, key=lambda row: float(row[amplitude]))
            linear = max(float(row[column]) for row in rows)
            held = sum(float(row["retention_n"]) > 0 for row in good)
            opens = peak["opening_pairs"]
            print(f"| {name} | {level} | {len(good)} of {len(rows)} | {sum(newton)} | {max(newton)} "
                  f"| {float(peak[amplitude]) / linear:.4f} | {opens} | {held} | {seconds:.1f} |", flush=True)
            if "has a gap" in run.stderr or " gaps," in run.stderr:
                print(f"    {name}, {level} N: the curve has a gap", file=sys.stderr)
                failed += 1
            for row in bad:
                print(f"    {name}, {level} N, {row['frequency_hz']} Hz: {row['outcome']}, residual {row['residual']}", file=sys.stderr)
            points, failed, iterations = points + len(rows), failed + len(bad), iterations + sum(newton)
    print(f"\n{points} points, {failed} not converged, {iterations / points:.2f} Newton iterations each")
    sys.exit(failed > 0)


print(origin.line() + "\n")
main()
