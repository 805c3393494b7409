#!/usr/bin/env python3
"""Static state of blade and jaw under rotation, with friction on the flanks, by CalculiX.

    python3 contact_statics.py MESH.msh [--friction 0.3] [--speed-rpm 5000] [--jaw-rotates]

Surface-to-surface penalty contact; prints the normal and friction force on each flank and the slip of
the coincident flank corner nodes. Needs python3 (standard library only) and ccx; takes minutes.
"""

import argparse
import math
import re
import tempfile

import deck
import elements
import msh

PAIRS = [("blade_flank_left", "jaw_flank_left"), ("blade_flank_right", "jaw_flank_right")]


def surface(name, facets, solid):
    """The element faces that are `facets`."""
    wanted = {frozenset(elements.facet_corners(n)) for _, n in facets}
    lines = [f"*SURFACE, NAME={name}, TYPE=ELEMENT"]
    for tag, n in solid:
        for face, corners in enumerate(elements.FACES[elements.corners(len(n))], 1):
            if frozenset(n[c] for c in corners) in wanted:
                lines.append(f"{tag}, S{face}")
    if len(lines) != 1 + len(wanted):
        raise SystemExit(f"{name}: {len(wanted)} facets, {len(lines) - 1} element faces found")
    return lines


def normal_of(facets, points):
    """Unit normal of the first facet (the flanks are plane)."""
    a, b, c = (points[t] for t in facets[0][1][:3])
    u, v = [b[k] - a[k] for k in range(3)], [c[k] - a[k] for k in range(3)]
    n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    size = math.sqrt(sum(x * x for x in n))
    return [x / size for x in n]


def forces_n(dat, slave):
    """Normal force (compression positive) and size of the friction force on one flank."""
    text = dat.read_text()
    number = r"(-?\d\.\d+E[+-]\d+)"
    rows = re.findall(rf"slave set {slave.upper()},.*?area,\s+normal force[^\n]*\n\s*{number}\s+{number}\s+{number}",
                      text, re.S)
    if not rows:
        raise SystemExit(f"{dat}: no contact force on {slave}")
    # ccx writes one table for the whole, the normal part and the friction part each.
    return max(-float(r[1]) for r in rows), max(float(r[2]) for r in rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--fixed", nargs="+", default=["jaw_base"])
    parser.add_argument("--friction", type=float, default=0.3)
    parser.add_argument("--speed-rpm", type=float, default=5000.0)
    parser.add_argument("--jaw-rotates", action="store_true", help="the jaw carries its own load, too")
    parser.add_argument("--units", type=float, default=1e-3, help="metres per mesh unit")
    parser.add_argument("--normal-stiffness", type=float, default=1e15, help="penalty, Pa/m")
    parser.add_argument("--stick-stiffness", type=float, default=1e14, help="penalty, Pa/m")
    parser.add_argument("--time-limit", type=float, default=1800.0, help="of ccx, s")
    parser.add_argument("--folder", help="keep the deck and the results here")
    given = parser.parse_args()

    points, groups = msh.read(given.mesh)
    blade, jaw = msh.group(groups, "blade"), msh.group(groups, "jaw")
    used = {n for _, e in blade + jaw for n in e}
    fixed = {n for name in given.fixed for _, e in msh.group(groups, name) for n in e}
    flanks = {n for pair in PAIRS for name in pair for _, e in msh.group(groups, name) for n in e}
    lines = deck.nodes({t: points[t] for t in used}, given.units)
    lines += deck.solid(blade, "BLADE") + deck.solid(jaw, "JAW") + deck.material(["BLADE", "JAW"])
    lines += deck.node_set("HELD", fixed & used) + deck.node_set("FLANKS", flanks)
    lines += ["*BOUNDARY", "HELD, 1, 3"]
    for slave, master in PAIRS:
        lines += surface(slave.upper(), groups[slave], blade)
        lines += surface(master.upper(), groups[master], jaw)
        lines += ["*CONTACT PAIR, INTERACTION=FLANK, TYPE=SURFACE TO SURFACE",
                  f"{slave.upper()}, {master.upper()}"]
    lines += ["*SURFACE INTERACTION, NAME=FLANK",
              "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{given.normal_stiffness:.12g}"]
    if given.friction > 0.0:
        lines += ["*FRICTION", f"{given.friction:.12g}, {given.stick_stiffness:.12g}"]
    omega = given.speed_rpm * math.pi / 30.0
    lines += ["*STEP, INC=500", "*STATIC", "0.1, 1."] + deck.centrifugal("BLADE", omega)
    if given.jaw_rotates:
        lines += deck.centrifugal("JAW", omega)
    lines += ["*NODE PRINT, NSET=FLANKS, FREQUENCY=1000", "U"]
    for slave, master in PAIRS:
        lines += [f"*CONTACT PRINT, SLAVE={slave.upper()}, MASTER={master.upper()}, FREQUENCY=1000",
                  "CF, CFN, CFS"]
    lines += ["*END STEP"]

    with tempfile.TemporaryDirectory() as temporary:
        dat = deck.run(lines, given.folder or temporary, "contact", given.time_limit)
        forces = {slave: forces_n(dat, slave) for slave, _ in PAIRS}
        u = deck.displacements_m(dat)
    place = lambda t: tuple(round(x, 6) for x in points[t])
    for slave, master in PAIRS:
        opposite = {place(t): t for _, e in groups[master] for t in elements.facet_corners(e)}
        normal = normal_of(groups[slave], points)
        slips = []
        for t in {t for _, e in groups[slave] for t in elements.facet_corners(e)}:
            d = [a - b for a, b in zip(u[t], u[opposite[place(t)]])]
            along = sum(a * b for a, b in zip(d, normal))
            slips.append(math.sqrt(sum(a * a for a in d) - along * along))
        normal_n, friction_n = forces[slave]
        print(f"{slave}: normal force {normal_n:.1f} N, friction {friction_n:.1f} N; "
              f"{len(slips)} pairs, slip {min(slips) * 1e6:.2f} to {max(slips) * 1e6:.2f}, "
              f"mean {sum(slips) / len(slips) * 1e6:.2f} um")


if __name__ == "__main__":
    main()
