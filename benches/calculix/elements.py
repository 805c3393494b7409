"""Tetrahedra, pyramids, wedges and hexahedra with nodes at corners, or there and in the middles of edges.

A type is called by its number of nodes. Nodes are in the order of Abaqus and CalculiX. EDGES and FACES
need the standard library alone; what follows them needs numpy.
"""

import math

TETRAHEDRON = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
PYRAMID = [(0, 1), (1, 2), (2, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4)]
WEDGE = [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (0, 3), (1, 4), (2, 5)]
HEXAHEDRON = [(0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)]
# Edges with a node in the middle, in the order of these nodes.
EDGES = {4: [], 5: [], 6: [], 8: [], 10: TETRAHEDRON, 13: PYRAMID, 15: WEDGE, 20: HEXAHEDRON}
NAMES = {4: "tetrahedra of 4 nodes", 5: "pyramids of 5", 6: "wedges of 6", 8: "hexahedra of 8",
         10: "tetrahedra of 10 nodes", 13: "pyramids of 13", 15: "wedges of 15", 20: "hexahedra of 20"}
# Corners of the faces, by the number of corners of the element; in CalculiX S1, S2 and so on.
FACES = {
    4: [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    5: [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
    6: [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
    8: [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
}


def corners(kind):
    """Number of corners."""
    return kind - len(EDGES[kind])


def facet_corners(nodes):
    """Nodes of a facet (3, 4, 6 or 8 of them) at its corners."""
    return nodes[:3] if len(nodes) in (3, 6) else nodes[:4]


# Corners of the reference elements. In a tetrahedron and across a wedge r, s >= 0 and r + s (+ t) <= 1;
# in a pyramid |r|, |s| <= 1 - t and t >= 0; in a hexahedron, and along a wedge, from -1 to 1.
REFERENCE = {
    4: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    5: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1)],
    6: [(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    8: [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
}


def powers(kind):
    """Exponents (a, b, c) of the monomials r^a s^b t^c that the element has."""
    cube = [(a, b, c) for a in range(3) for b in range(3) for c in range(3)]
    above_one = lambda e: sum(k for k in e if k > 1)
    return {
        4: [e for e in cube if sum(e) <= 1],
        5: [e for e in cube if sum(e) <= 1],
        6: [e for e in cube if e[0] + e[1] <= 1 and e[2] <= 1],
        8: [e for e in cube if max(e) <= 1],
        10: [e for e in cube if sum(e) <= 2],
        13: [e for e in cube if sum(e) <= 2],
        15: [e for e in cube if e[0] + e[1] + above_one(e[2:]) <= (2 if e[2] < 2 else 3)],
        20: [e for e in cube if above_one(e) <= 2],
    }[kind]


def functions(kind, point):
    """Values at a point of what the shape functions are combined of."""
    r, s, t = point
    values = [r ** a * s ** b * t ** c for a, b, c in powers(kind)]
    if kind in (5, 13):
        over = 0 * t if t == 1 else r * s / (1 - t)
        values += [over] if kind == 5 else [over, over * r, over * s]
    return values


def nodes(kind):
    """Places of the nodes in the reference element."""
    import numpy as np
    ends = np.array(REFERENCE[corners(kind)], dtype=float)
    return np.vstack([ends, *((ends[a] + ends[b])[None] / 2 for a, b in EDGES[kind])])


_INVERSE = {}


def shape(kind, point):
    """Shape functions, and their gradients in the reference element (by a complex step, which is exact)."""
    import numpy as np
    if kind not in _INVERSE:
        _INVERSE[kind] = np.linalg.inv(np.array([functions(kind, p) for p in nodes(kind)]))
    values = np.array(functions(kind, point)) @ _INVERSE[kind]
    step = 1e-30
    gradient = [np.imag(np.array(functions(kind, np.array(point) + 1j * step * axis)) @ _INVERSE[kind]) / step
                for axis in np.eye(3)]
    return values, np.array(gradient).T


def line(n):
    """Gauss and Legendre's rule on [-1, 1]: points and weights."""
    import numpy as np
    return list(zip(*np.polynomial.legendre.leggauss(n)))


def unit(n):
    """The same on [0, 1]."""
    return [((x + 1) / 2, w / 2) for x, w in line(n)]


def triangle(number):
    """Points (r, s) and weights: 1, 3, 6, 12 of degrees 1, 2, 4, 6 (Dunavant's), or n^2 of a folded product."""
    three = lambda x, weight: [(p, weight / 2) for p in ((x, x), (1 - 2 * x, x), (x, 1 - 2 * x))]
    if number == 1:
        return [((1 / 3, 1 / 3), 1 / 2)]
    if number == 3:
        return three(1 / 6, 1 / 3)
    if number == 6:
        return three(0.445948490915965, 0.223381589678011) + three(0.091576213509771, 0.109951743655322)
    if number == 12:
        a, b = 0.310352451033784, 0.053145049844817
        c = 1 - a - b
        mixed = [(a, b), (b, a), (a, c), (c, a), (b, c), (c, b)]
        return (three(0.249286745170910, 0.116786275726379) + three(0.063089014491502, 0.050844906370207)
                + [(p, 0.082851075618374 / 2) for p in mixed])
    n = exact_root(number, 2)
    return [((a, (1 - a) * b), wa * wb * (1 - a)) for a, wa in unit(n) for b, wb in unit(n)]


def tetrahedron(number):
    """Points and weights: 1, 4, 14, 15, 24 of degrees 1, 2, 5, 5, 6 (14 Walkington's, 15 and 24 Keast's), or n^3 of
    a folded product."""
    if number == 1:
        return [((0.25, 0.25, 0.25), 1 / 6)]
    if number == 4:
        return three_alike((5 - math.sqrt(5)) / 20, 1 / 24)
    if number == 14:
        return (three_alike(0.310885919263301, 0.018781320953003) + three_alike(0.092735250310891, 0.012248840519394)
                + two_alike(0.045503704125650, 0.007091003462847))
    if number == 15:
        return ([((0.25, 0.25, 0.25), 0.030283678097089)] + three_alike(1 / 3, 0.006026785714286)
                + three_alike(1 / 11, 0.011645249086029) + two_alike(0.066550153573664, 0.010949141561386))
    if number == 24:
        a, b = 0.063661001875018, 0.269672331458316
        c = 1 - 2 * a - b
        mixed = [tuple(b if k == i else c if k == j else a for k in range(4))
                 for i in range(4) for j in range(4) if i != j]
        return (three_alike(0.214602871259152, 0.006653791709695) + three_alike(0.040673958534611, 0.001679535175887)
                + three_alike(0.322337890142276, 0.009226196923942) + [(p[1:], 0.008035714285714) for p in mixed])
    n = exact_root(number, 3)
    return [((a, (1 - a) * b, (1 - a) * (1 - b) * c), wa * wb * wc * (1 - a) ** 2 * (1 - b))
            for a, wa in unit(n) for b, wb in unit(n) for c, wc in unit(n)]


def three_alike(x, weight):
    """The four points of a tetrahedron with three barycentric coordinates x."""
    return [(tuple(1 - 3 * x if j == k else x for j in range(1, 4)), weight) for k in range(4)]


def two_alike(x, weight):
    """The six with two coordinates x, and two 1/2 - x."""
    return [(tuple(x if k in pair else 0.5 - x for k in range(1, 4)), weight) for pair in TETRAHEDRON]


def exact_root(number, power):
    n = round(number ** (1 / power))
    if n ** power != number:
        raise SystemExit(f"no rule of {number} points")
    return n


def rule(kind, number):
    """Points and weights of a rule: for wedges `number` is (on the triangle, along), else of all points."""
    if corners(kind) == 4:
        return tetrahedron(number)
    if corners(kind) == 6:
        across, along = number
        return [((*p, x), w * v) for p, w in triangle(across) for x, v in line(along)]
    n = exact_root(number, 3)
    if corners(kind) == 8:
        return [((x, y, z), u * v * w) for x, u in line(n) for y, v in line(n) for z, w in line(n)]
    return [((x * (1 - t), y * (1 - t), t), u * v * w * (1 - t) ** 2)
            for x, u in line(n) for y, v in line(n) for t, w in unit(n)]
