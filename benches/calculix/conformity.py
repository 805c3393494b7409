#!/usr/bin/env python3
"""Whether the elements of each body fit together, and how good they are.

    python3 benches/calculix/conformity.py MESH.msh... [--bodies blade jaw]

Counts elements, nodes and volume of each volume group. Every inner face must be one of exactly two
elements, with the same corners and the same middles of edges; faces that only one element has must be
those of the surface groups; the Jacobian determinant must be positive at the nodes and at the points of a
rule. Prints the least of it over its largest value in the element (1: not distorted), and the mean ratio
of the corners: 1 for regular elements, 0 for flat ones. Ends with status 1 where something does not fit.
Needs python3 and numpy.
"""

import argparse
import collections
import sys

import numpy as np

import elements
import msh


def middles(kind, nodes):
    """The node in the middle of each edge, by the corners of the edge."""
    first = elements.corners(kind)
    return {frozenset((nodes[a], nodes[b])): nodes[first + i] for i, (a, b) in enumerate(elements.EDGES[kind])}


def misfits(solid, skin):
    """What does not fit together, as texts."""
    owners, middle, wrong = collections.defaultdict(list), {}, []
    for tag, nodes in solid:
        kind = len(nodes)
        for face in elements.FACES[elements.corners(kind)]:
            owners[frozenset(nodes[c] for c in face)].append((tag, kind in (4, 5, 6, 8)))
        for edge, node in middles(kind, nodes).items():
            if middle.setdefault(edge, node) != node:
                wrong.append(f"edge {sorted(edge)}: middles {middle[edge]} and {node}")
    skin = {frozenset(elements.facet_corners(n)) for _, n in skin}
    wrong += [f"face {sorted(f)}: {len(o)} elements" for f, o in owners.items() if len(o) > 2]
    wrong += [f"face {sorted(f)}: elements of both orders" for f, o in owners.items() if len({x for _, x in o}) > 1]
    outer = {f for f, o in owners.items() if len(o) == 1}
    wrong += [f"face {sorted(f)} of element {owners[f][0][0]} has no neighbour and is in no surface group"
              for f in outer - skin]
    # A quadrilateral against two triangles: they share three corners.
    triangles = {f for f in outer if len(f) == 3}
    by_edge = collections.defaultdict(list)
    for f in triangles:
        for node in f:
            by_edge[f - {node}].append(f)
    for edge, pair in by_edge.items():
        if len(pair) == 2 and frozenset().union(*pair) in owners:
            wrong.append(f"quadrilateral {sorted(frozenset().union(*pair))} against two triangles")
    return wrong


def mean_ratio(x, kind):
    """Of the worst corner of each element, its edges taken straight (the apex of a pyramid has four, and is left out)."""
    first = elements.corners(kind)
    sides = {4: elements.TETRAHEDRON, 5: elements.PYRAMID, 6: elements.WEDGE, 8: elements.HEXAHEDRON}[first]
    up = {4: np.sqrt(2 / 3), 5: np.sqrt(0.5), 6: 0.5, 8: 1.0}[first]
    # Regular: all edges alike.
    regular = np.array(elements.REFERENCE[first], dtype=float) * [1, 1, up]
    if first == 5:
        regular[:, :2] *= 0.5
    elif first in (4, 6):
        regular[:, :2] = regular[:, :2] @ [[1, 0], [0.5, np.sqrt(0.75)]]
        if first == 4:
            regular[3, :2] = regular[:3, :2].mean(axis=0)
    worst = np.ones(len(x))
    for corner in range(first):
        ends = [b if a == corner else a for a, b in sides if corner in (a, b)]
        if len(ends) != 3:
            continue
        jacobian = (x[:, ends] - x[:, [corner]]).transpose(0, 2, 1) @ np.linalg.inv((regular[ends] - regular[corner]).T)
        determinant = np.abs(np.linalg.det(jacobian))
        worst = np.minimum(worst, 3 * determinant ** (2 / 3) / (jacobian ** 2).sum(axis=(1, 2)))
    return worst


def quality(points, solid):
    """Per type: number, volume, least Jacobian over largest and mean ratio, of the worst and of the middle element."""
    found = {}
    for kind in sorted({len(n) for _, n in solid}):
        x = np.array([[points[t] for t in n] for _, n in solid if len(n) == kind])
        number = {4: 8, 5: 27, 6: (9, 3), 8: 27}[elements.corners(kind)]
        integral = elements.rule(kind, number)
        # The apex of a pyramid is singular, and is left out.
        places = [p for p, _ in integral] + [tuple(p) for p in elements.nodes(kind) if kind not in (5, 13) or p[2] < 1]
        determinants = np.array([np.linalg.det(np.einsum("eai,aj->eij", x, elements.shape(kind, p)[1]))
                                 for p in places])
        volume = sum(w * d for (_, w), d in zip(integral, determinants)).sum()
        least = determinants.min(axis=0) / determinants.max(axis=0)
        ratio = mean_ratio(x, kind)
        found[kind] = len(x), volume, (least.min(), np.median(least)), (ratio.min(), np.median(ratio))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("meshes", nargs="+", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--bodies", nargs="+", default=["blade", "jaw"], help="volume groups")
    given = parser.parse_args()
    bad = False
    for mesh in given.meshes:
        points, groups = msh.read(mesh)
        bodies = {name: msh.group(groups, name) for name in given.bodies}
        skin = [e for name, found in groups.items() if name not in bodies for e in found if len(e[1]) in (3, 4, 6, 8)]
        for name, solid in bodies.items():
            used = {n for _, nodes in solid for n in nodes}
            print(f"{mesh}: {name}: {len(solid)} elements, {len(used)} nodes")
            for kind, (count, volume, jacobian, ratio) in quality(points, solid).items():
                print(f"  {count:6} {elements.NAMES[kind]}, volume {volume:.6g}; worst (and median): least over "
                      f"largest Jacobian {jacobian[0]:.3f} ({jacobian[1]:.3f}), "
                      f"mean ratio {ratio[0]:.3f} ({ratio[1]:.3f})")
                bad |= not jacobian[0] > 0
            wrong = misfits(solid, skin)
            bad |= bool(wrong)
            for text in wrong[:10]:
                print(f"  {text}")
            print(f"  {len(wrong)} misfits", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
