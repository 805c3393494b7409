"""Reads what the comparison needs of a Gmsh mesh (MSH 4.1, ASCII or binary)."""

import struct

NODES_OF_TYPE = {1: 2, 2: 3, 4: 4, 8: 3, 9: 6, 11: 10, 15: 1}


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
        width = 1 + NODES_OF_TYPE[kind]
        numbers = source.sizes(width * count)
        elements = [(numbers[i], numbers[i + 1:i + width]) for i in range(0, width * count, width)]
        for group in groups_of[dimension, entity]:
            groups[names[dimension, abs(group)]] += elements
    return nodes, groups


def group(groups, name):
    if name not in groups:
        raise SystemExit(f"no group \"{name}\" in the mesh; it has: {', '.join(sorted(groups))}")
    return groups[name]
