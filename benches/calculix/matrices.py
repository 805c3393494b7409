#!/usr/bin/env python3
"""The paper's joint with matrices that CalculiX assembled, against the joint with dovetail's own elements.

    apt-get install calculix-ccx; cargo build --release
    python3 benches/calculix/matrices.py meshes/dovetail.msh

Writes a deck of the blade and one of the jaw, lets ccx write their matrices (*FREQUENCY,
SOLVER=MATRIXSTORAGE: .sti, .mas and .dof), and runs the same scene twice: with the elements of the
decks, and with stiffness_file, mass_file and rows_file. CalculiX holds the base of the jaw, so that the
rows of its support are missing. The joint is at rest: a steady force pulls the blade outwards, as the
rotation would. Prints the frequencies of the blade with its flanks held beside those of ccx, and the
peak of both runs; ends with status 1 where they differ by more than --tolerance. Needs python3 (standard
library only) and ccx; takes a minute.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import blade_modes
import deck
import msh
from compare_blade_modes import held_frequencies_hz

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Sets of nodes, by the body that has them.
SETS = {
    "blade": ["blade_flank_left", "blade_flank_right", "excitation", "tip_trailing_edge"],
    "jaw": ["jaw_flank_left", "jaw_flank_right", "jaw_base"],
}
# Outward force on the top of the blade, N: that of the rotation at 5000 rpm.
PULL_N = 7723.5
SCENE = """
name = "{name}"
{bodies}
[[contact]]
name = "left"
first = "BLADE_FLANK_LEFT"
second = "JAW_FLANK_LEFT"
friction = 0.3
[[contact]]
name = "right"
first = "BLADE_FLANK_RIGHT"
second = "JAW_FLANK_RIGHT"
friction = 0.3
[[load]]
on = "TOP"
direction = [0, 0, 1]
force_n = {pull}
[damping]
ratio = 0.001
[[excitation]]
on = "EXCITATION"
direction = [0, 1, 0]
force_n = 2.0
[[observe]]
name = "tip"
points = "TIP_TRAILING_EDGE"
direction = [0, 1, 0]
[response]
times_first_linear_mode = [0.98, 1.02]
harmonics = 3
"""
BODY = """
[[body]]
name = "{body}"
mesh_file = "{body}.inp"
units = "m-kg-s"
volume = "{volume}"
{source}
"""
ELEMENTS = "young_pa = 113.8e9\npoisson = 0.34\ndensity_kg_m3 = 4430"
MATRICES = 'stiffness_file = "{body}.sti"\nmass_file = "{body}.mas"\nrows_file = "{body}.dof"'


def model(points, groups, body):
    """Lines of the deck of a body, without a step."""
    solid = msh.group(groups, body)
    used = {n for _, e in solid for n in e}
    lines = deck.nodes({t: points[t] for t in used}, 1e-3) + deck.solid(solid, body.upper())
    for name in SETS[body]:
        lines += deck.node_set(name.upper(), {n for _, e in msh.group(groups, name) for n in e} & used)
    if body == "blade":
        top = max(points[n][2] for n in used)
        lines += deck.node_set("TOP", {n for n in used if points[n][2] > top - 1e-6})
    return lines + deck.material([body.upper()])


def run(given, folder, command, name, *options):
    words = [given.dovetail, command, str(folder / f"{name}.toml"), "--out", str(folder / name), "--quiet",
             "--no-cache", *options]
    done = subprocess.run(words, capture_output=True, text=True, timeout=given.time_limit)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(words)}\n{done.stderr}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="mesh of geometry/dovetail.geo, MSH 4.1")
    parser.add_argument("--dovetail", default=str(ROOT / "target/release/dovetail"), help="the program")
    parser.add_argument("--tolerance", type=float, default=1e-4, help="largest relative difference allowed")
    parser.add_argument("--folder", help="keep the decks, matrices and results here")
    parser.add_argument("--time-limit", type=float, default=600.0, help="for each run, s")
    given = parser.parse_args()

    points, groups = msh.read(given.mesh)
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(given.folder or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        store = ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP"]
        for body in SETS:
            lines = model(points, groups, body)
            (folder / f"{body}.inp").write_text("\n".join(lines) + "\n")
            held = ["*BOUNDARY", "JAW_BASE, 1, 3"] if body == "jaw" else []
            # ccx ends with an error once the matrices are written: it goes no further.
            name = f"{body}_matrices"
            (folder / f"{name}.inp").write_text("\n".join(lines + held + store) + "\n")
            subprocess.run(["ccx", name], cwd=folder, timeout=given.time_limit, capture_output=True)
            for ending in ["sti", "mas", "dof"]:
                (folder / f"{name}.{ending}").replace(folder / f"{body}.{ending}")
        for name, source in {"elements": ELEMENTS, "matrices": MATRICES}.items():
            fixed = {"jaw": '\nfixed = ["JAW_BASE"]'} if name == "elements" else {}
            bodies = [BODY.format(body=body, volume=body.upper(), source=source.format(body=body) + fixed.get(body, ""))
                      for body in SETS]
            scene = SCENE.format(name=name, bodies="".join(bodies), pull=PULL_N)
            (folder / f"{name}.toml").write_text(scene)
            run(given, folder, "run", name)
            run(given, folder, "modes", name)

        worst = 0.0
        print("blade, flanks held, Hz:  elements      matrices      CalculiX  matrices over CalculiX")
        case = blade_modes.case(given.mesh, 4, 0.0)
        theirs = deck.frequencies_hz(deck.run(case, folder, "modes", given.time_limit))
        ours = [held_frequencies_hz(folder / name / "modes.csv") for name in ["elements", "matrices"]]
        for own, matrices, ccx in zip(ours[0], ours[1], theirs):
            worst = max(worst, abs(matrices / ccx - 1.0))
            print(f"{own:33.4f}  {matrices:12.4f}  {ccx:12.4f}  {matrices / ccx - 1.0:+22.1e}")
        print("\nresponse at rest        peak, mm   frequency, Hz")
        peaks = []
        for name in ["elements", "matrices"]:
            response = json.loads((folder / name / "summary.json").read_text())["response"]
            peaks.append([response["peak_amplitude_m"], response["peak_frequency_hz"]])
            print(f"{name:18}  {1e3 * peaks[-1][0]:12.6f}  {peaks[-1][1]:14.5f}")
        worst = max(worst, *(abs(a / b - 1.0) for a, b in zip(*peaks)))
    print(f"largest difference {worst:.1e}, allowed {given.tolerance:g}")
    return 0 if math.isfinite(worst) and worst <= given.tolerance else 1


if __name__ == "__main__":
    sys.exit(main())
