"""Pressure towards the edges of the flanks against the theory of two wedges in frictional contact.

    python3 scripts/edge_pressure.py RUN [RUN ...]      # folders of `dovetail run` or `dovetail static` on geometry/dovetail.geo

At the upper edge of a flank the jaw ends in a corner of 135 degrees on the smooth blade, at the lower edge the blade on the smooth jaw. Near such
an edge the pressure of a sliding contact goes as d^(l - 1), d the distance from the edge: l is the smallest root between 0 and 1 of
the determinant of two wedges, free outside, that share normal stress, normal displacement and a shear of mu times the pressure on their common face
(M. Comninou, J. Appl. Mech. 43 (1976); G. B. Sinclair and N. G. Cormier, J. Eng. Gas Turbines Power 125 (2003), on why the peak of a dovetail
does not converge). The pressure of the nodes on the edge (the mean over the middle third of the slot, away from the ends) then goes as the
spacing to the power l - 1. Give runs that differ in the spacing of their flanks alone. The first line says from
which commit the program was built that made them, and on which day. numpy.
"""

import argparse
import csv
import math
import os

import numpy
import origin

FLANK_ANGLE = math.radians(45)
CORNER = math.radians(135)
SMOOTH = math.pi


def traces(l, theta, kappa):
    """Hoop stress, shear stress and hoop displacement of the four stress functions of power l at the angle theta."""
    up, down = (l + 1) * theta, (l - 1) * theta
    cu, su, cd, sd = math.cos(up), math.sin(up), math.cos(down), math.sin(down)
    hoop = l * (l + 1) * numpy.array([cu, cd, su, sd])
    shear = -l * numpy.array([-(l + 1) * su, -(l - 1) * sd, (l + 1) * cu, (l - 1) * cd])
    displacement = numpy.array([(l + 1) * su, (kappa + l) * sd, -(l + 1) * cu, -(kappa + l) * cd])
    return hoop, shear, displacement


def determinant(l, first, second, friction, poisson):
    """Of the conditions of a wedge of angle `first` that slides on one of angle `second`; friction > 0 pulls the first
    wedge's face away from the edge."""
    kappa = 3 - 4 * poisson
    matrix = numpy.zeros((8, 8))
    matrix[0, :4], matrix[1, :4], _ = traces(l, first, kappa)
    matrix[2, 4:], matrix[3, 4:], _ = traces(l, -second, kappa)
    hoop, shear, displacement = traces(l, 0.0, kappa)
    for row, trace in [(4, hoop), (5, shear), (6, displacement)]:
        matrix[row, :4], matrix[row, 4:] = trace, -trace
    matrix[7, :4] = shear - friction * hoop
    return numpy.linalg.det(matrix / numpy.abs(matrix).max(axis=1, keepdims=True))


def smallest_power(first, second, friction, poisson):
    def value(l):
        return determinant(l, first, second, friction, poisson)

    grid = numpy.linspace(0.02, 0.999, 1000)
    for low, high in zip(grid, grid[1:]):
        if value(low) * value(high) < 0:
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if value(low) * value(middle) <= 0 else (middle, high)
            return low
    raise SystemExit("no power between 0 and 1: the pressure is finite at this edge")


def rows(folder):
    """Per contact: nodes by their height, each a list of (distance along the flank's width, normal force, area, pressure) in
    the middle third of the slot."""
    with open(os.path.join(folder, "static.csv"), newline="") as file:
        nodes = list(csv.DictReader(file))
    reach = max(abs(float(n["x_m"])) for n in nodes) / 3
    contacts = {}
    for node in nodes:
        heights = contacts.setdefault(node["contact"], {})
        row = heights.setdefault(round(float(node["z_m"]), 9), [0.0, 0.0, 0.0])
        row[2] = max(row[2], float(node["pressure_pa"]))
        if abs(float(node["x_m"])) <= reach:
            row[0] += float(node["normal_force_n"])
            row[1] += float(node["area_m2"])
    return {name: sorted((z, *row) for z, row in heights.items()) for name, heights in contacts.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("runs", nargs="+")
    parser.add_argument("--friction", type=float, default=0.3)
    parser.add_argument("--poisson", type=float, default=0.34)
    arguments = parser.parse_args()
    print(origin.line_of_runs(arguments.runs) + "\n")
    check = smallest_power(math.pi / 2, math.pi, 0.0, arguments.poisson)
    print(f"a right angle without friction: pressure as d^{check - 1:.4f} (known: -0.2260)")
    # Both corners slide towards the middle of the flank: friction pulls their faces outwards, towards the edge.
    theory = smallest_power(CORNER, SMOOTH, -arguments.friction, arguments.poisson)
    print(f"135 degrees on a smooth body, friction {arguments.friction}: as d^{theory - 1:.3f}\n")
    print("| run | contact | spacing at the edge, mm | largest, MPa | lower edge, MPa | middle, MPa | upper edge, MPa |")
    print("|" + " --- |" * 7)
    edges = {}
    for run in arguments.runs:
        for name, heights in rows(run).items():
            spacing = (heights[1][0] - heights[0][0]) / math.cos(FLANK_ANGLE)
            mean = [force / area for _, force, area, _ in heights]
            middle = 0.5 * (mean[(len(mean) - 1) // 2] + mean[len(mean) // 2])
            largest = max(p for *_, p in heights)
            figures = [1e3 * spacing] + [1e-6 * p for p in (largest, mean[0], middle, mean[-1])]
            print(f"| {os.path.basename(os.path.normpath(run))} | {name} | " + " | ".join(f"{f:.3g}" for f in figures) + " |")
            for edge, pressure in [("lower", mean[0]), ("upper", mean[-1])]:
                edges.setdefault((name, edge), []).append((math.log(spacing), math.log(pressure)))
    print()
    for (name, edge), points in edges.items():
        x, y = numpy.array(sorted(points, reverse=True)).T
        if len(points) > 1:
            steps = ", ".join(f"{slope:.2f}" for slope in numpy.diff(y) / numpy.diff(x))
            print(f"{name} flank, {edge} edge: as spacing^{numpy.polyfit(x, y, 1)[0]:.3f}; between runs {steps}")


if __name__ == "__main__":
    main()
