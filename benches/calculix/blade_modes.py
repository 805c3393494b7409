#!/usr/bin/env python3
"""First frequencies of the blade with its flanks fixed, at rest and spinning, by CalculiX.

    python3 blade_modes.py MESH.msh [--speed-rpm 5000] [--modes 4] [--units 1e-3]

Supports and rotation as in the default scene, elements by their number of nodes (deck.py; CalculiX has no
pyramids): all nodes of both flanks fixed, rotation about the x axis; the prestressed step has stress stiffening and spin softening.
Needs python3 (standard library only) and ccx.
"""

import argparse
import math
import tempfile

import deck
import msh


FLANKS = ["blade_flank_left", "blade_flank_right"]


def case(mesh, modes, speed_rpm, body="blade", held=FLANKS, units=1e-3):
    """Lines of a deck: at speed 0 one frequency step, else a static step and a perturbation about it."""
    points, groups = msh.read(mesh)
    solid = msh.group(groups, body)
    used = {n for _, e in solid for n in e}
    fixed = {n for name in held for _, e in msh.group(groups, name) for n in e}
    lines = deck.nodes({t: points[t] for t in used}, units)
    lines += deck.solid(solid, "BLADE") + deck.node_set("FLANKS", fixed & used)
    lines += deck.material(["BLADE"]) + ["*BOUNDARY", "FLANKS, 1, 3"]
    frequency = ["*FREQUENCY, SOLVER=SPOOLES", str(modes), "*END STEP"]
    if speed_rpm == 0.0:
        return lines + ["*STEP"] + frequency
    load = deck.centrifugal("BLADE", speed_rpm * math.pi / 30.0)
    return lines + ["*STEP", "*STATIC", *load, "*END STEP", "*STEP, PERTURBATION"] + frequency


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--body", default="blade", help="volume group")
    parser.add_argument("--fixed", nargs="+", default=FLANKS)
    parser.add_argument("--speed-rpm", type=float, default=5000.0)
    parser.add_argument("--modes", type=int, default=4)
    parser.add_argument("--units", type=float, default=1e-3, help="metres per mesh unit")
    parser.add_argument("--time-limit", type=float, default=600.0, help="for each run of ccx, s")
    parser.add_argument("--folder", help="keep the decks and results here")
    given = parser.parse_args()

    with tempfile.TemporaryDirectory() as temporary:
        for name, speed in {"rest": 0.0, "spin": given.speed_rpm}.items():
            lines = case(given.mesh, given.modes, speed, given.body, given.fixed, given.units)
            dat = deck.run(lines, given.folder or temporary, name, given.time_limit)
            values = ", ".join(f"{f:.2f}" for f in deck.frequencies_hz(dat))
            print(f"{speed:7.0f} rpm: {values} Hz", flush=True)


if __name__ == "__main__":
    main()
