"""Reads what the comparison needs of a Gmsh mesh (MSH 4.1, ASCII or binary).

The nodes of elements are in the order of Abaqus and CalculiX: the corners, then the middles of EDGES.
"""

import struct

import elements

# By Gmsh's number of the type. Those with nodes inside faces (10, 12, 13, 14) are refused.
NODES_OF_TYPE = {1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 11: 10, 15: 1, 16: 8, 17: 20, 18: 15, 19: 13}
# Gmsh's order of the middles of edges, by the number of the type.
EDGES_OF_TYPE = {
    11: [(0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3)],
    17: [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)],
    18: [(0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)],
    19: [(0, 1), (0, 3), (0, 4), (1, 2), (1, 4), (2, 3), (2, 4), (3, 4)],
}


def order(kind):
    """Where each node of an element stands in Gmsh's list."""
    if kind not in EDGES_OF_TYPE:
        return range(NODES_OF_TYPE[kind])
    edges = elements.EDGES[NODES_OF_TYPE[kind]]
    corners = NODES_OF_TYPE[kind] - len(edges)
    return [*range(corners), *(corners + EDGES_OF_TYPE[kind].index(edge) for edge in edges)]


class Text:
    def __init__(self, data):
        self.words = iter(data.split())

    def ints(self, n):
        return [int(next(self.words)) for _ in range(n)]

    sizes = ints

    def reals(self, n):
        return [float(next(self.words)) for _ in range(n)]


class Binary:
    def __init__(self, data):
        self.data, self.at = data, 0

    def _take(self, code, width, n):
        values = struct.unpack_from(f"<{n}{code}", self.data, self.at)
        self.at += width * n
        return list(values)

    def ints(self, n):
        return self._take("i", 4, n)

    def sizes(self, n):
        return self._take("q", 8, n)

    def reals(self, n):
        return self._take("d", 8, n)


def read(path):
    """Nodes {tag: (x, y, z)}, and per physical name the elements [(tag, [node tags])] of its entities."""
    with open(path, "rb") as file:
        data = file.read()
    version, is_binary = data.split(b"\n", 2)[1].split()[:2]
    if version != b"4.1":
        raise SystemExit(f"{path}: MSH {version.decode()} given, MSH 4.1 needed (gmsh -format msh41)")
    is_binary = is_binary == b"1"

    def section(name):
        start, end = f"${name}\n".encode(), f"\n$End{name}".encode()
        if start not in data:
            raise SystemExit(f"{path}: no ${name} section")
        first = data.index(start) + len(start)
        body = data[first:data.index(end, first)]
        return Binary(body) if is_binary else Text(body)

    names = {}
    start = data.index(b"$PhysicalNames\n")
    for line in data[start:data.index(b"$EndPhysicalNames")].decode().split("\n")[2:]:
        if line:
            dimension, number, name = line.split(" ", 2)
            names[int(dimension), int(number)] = name.strip().strip('"')

    source = section("Entities")
    groups_of = {}
    for dimension, count in enumerate(source.sizes(4)):
        for _ in range(count):
            (tag,) = source.ints(1)
            source.reals(3 if dimension == 0 else 6)
            groups_of[dimension, tag] = source.ints(source.sizes(1)[0])
            if dimension > 0:
                source.ints(source.sizes(1)[0])

    source = section("Nodes")
    nodes = {}
    for _ in range(source.sizes(4)[0]):
        source.ints(3)
        (count,) = source.sizes(1)
        tags = source.sizes(count)
        xyz = source.reals(3 * count)
        nodes.update((t, tuple(xyz[3 * i:3 * i + 3])) for i, t in enumerate(tags))

    source = section("Elements")
    groups = {name: [] for name in names.values()}
    for _ in range(source.sizes(4)[0]):
        dimension, entity, kind = source.ints(3)
        (count,) = source.sizes(1)
        if kind not in NODES_OF_TYPE:
            raise SystemExit(f"{path}: elements of Gmsh's type {kind}; none has nodes inside its faces, "
                             "and at most three nodes are on an edge (Mesh.SecondOrderIncomplete = 1)")
        width, places = 1 + NODES_OF_TYPE[kind], order(kind)
        numbers = source.sizes(width * count)
        found = [(numbers[i], [numbers[i + 1 + k] for k in places]) for i in range(0, width * count, width)]
        for group in groups_of[dimension, entity]:
            groups[names[dimension, abs(group)]] += found
    return nodes, groups


def group(groups, name):
    if name not in groups:
        raise SystemExit(f"no group \"{name}\" in the mesh; it has: {', '.join(sorted(groups))}")
    return groups[name]
