#!/usr/bin/env python3
"""What separates dovetail from CalculiX at rest: the quadrature of the element matrices.

    python3 quadrature.py MESH.msh [--modes 4] [--body blade] [--fixed GROUP...]
    python3 quadrature.py MESH.msh --points 20=27,64 15=6x3,16x4

Assembles a body (the blade, its flanks held) by numpy with the points of dovetail, with those of CalculiX
(where it has such elements) and with many; or, with --points, with those given for a type of elements, called
by its number of nodes: points of the stiffness, of the mass; for wedges on the triangle x along. The
incompatible modes of hexahedra of 8 nodes are those of Taylor, Beresford and Wilson, which have no mass; CalculiX
leaves out the factor of their gradients, and gives them mass (assembly.py). Shares no code with dovetail.
Needs python3, numpy, scipy; takes half a minute.
"""

import argparse

import assembly
import blade_modes


def points(text):
    """`27` or `6x3`."""
    found = tuple(int(word) for word in text.split("x"))
    return found if len(found) == 2 else found[0]


def schemes(kinds, asked):
    """Name and scheme of each line to print."""
    if asked:
        stiffness, mass = dict(assembly.DOVETAIL.stiffness), dict(assembly.DOVETAIL.mass)
        for word in asked:
            try:
                kind, pair = word.split("=")
                stiffness[int(kind)], mass[int(kind)] = (points(text) for text in pair.split(","))
            except ValueError:
                raise SystemExit(f"--points {word}: NODES=STIFFNESS,MASS such as 20=27,64 or 15=6x3,16x4") from None
        return {"as asked": assembly.Scheme(stiffness, mass)}
    found = {"as dovetail": assembly.DOVETAIL, "many": assembly.Scheme(assembly.MANY, assembly.MANY)}
    if all(kind in assembly.CALCULIX.stiffness for kind in kinds):
        found["as CalculiX"] = assembly.CALCULIX
    return found


def words(rules, kinds):
    shown = lambda rule: f"{rule[0]} x {rule[1]}" if isinstance(rule, tuple) else f"{rule}"
    return ", ".join(f"{shown(rules[kind])} ({kind} nodes)" for kind in kinds)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--body", default="blade", help="volume group")
    parser.add_argument("--fixed", nargs="+", default=blade_modes.FLANKS)
    parser.add_argument("--points", nargs="+", default=[], metavar="NODES=STIFFNESS,MASS")
    parser.add_argument("--modes", type=int, default=4)
    parser.add_argument("--units", type=float, default=1e-3, help="metres per mesh unit")
    given = parser.parse_args()

    body = assembly.Body(given.mesh, given.body, given.fixed, given.units)
    for name, scheme in schemes(body.blocks, given.points).items():
        system = assembly.System(body, scheme)
        hz = system.frequencies_hz(system.stiffness(), given.modes)
        print(f"stiffness {words(scheme.stiffness, body.blocks)} points, mass {words(scheme.mass, body.blocks)}, "
              f"{name}: {', '.join(f'{f:.4f}' for f in hz)} Hz", flush=True)


if __name__ == "__main__":
    main()
