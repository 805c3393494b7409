#!/usr/bin/env python3
"""What separates dovetail from CalculiX in the spinning blade: the initial-displacement stiffness.

    python3 initial_displacement.py MESH.msh [--speed-rpm 5000] [--modes 4] [--body blade] [--fixed GROUP...]

Assembles a body (the blade, its flanks held; rotation about the x axis) by numpy, finds the static displacement and the
frequencies about it by scipy: with stress stiffening and spin softening as dovetail and the paper have it, and with
the initial-displacement stiffness, as CalculiX has it (assembly.py). Points of integration are those of dovetail.
Shares no code with dovetail. Needs python3, numpy, scipy; takes half a minute.
"""

import argparse
import math

import assembly
import blade_modes


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--body", default="blade", help="volume group")
    parser.add_argument("--fixed", nargs="+", default=blade_modes.FLANKS)
    parser.add_argument("--speed-rpm", type=float, default=5000.0)
    parser.add_argument("--modes", type=int, default=4)
    parser.add_argument("--units", type=float, default=1e-3, help="metres per mesh unit")
    given = parser.parse_args()

    body = assembly.Body(given.mesh, given.body, given.fixed, given.units)
    system = assembly.System(body, assembly.DOVETAIL)
    as_paper, as_calculix = system.spinning(given.speed_rpm * math.pi / 30)
    for name, k in [("at rest", system.stiffness()), ("stress stiffening, spin softening", as_paper),
                    ("and initial displacement", as_calculix)]:
        values = ", ".join(f"{f:.6f}" for f in system.frequencies_hz(k, given.modes))
        print(f"{name}: {values} Hz", flush=True)


if __name__ == "__main__":
    main()
