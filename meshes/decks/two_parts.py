"""Writes the decks of a twisted blade in the slot of a disc, in the form of Abaqus/CAE.

joint.inp   both parts with their instances, in mm, t, s; the jaw is drawn with its base at z = 0
blade.inp   the blade alone, in mm, t, s
disc.inp    the jaw alone in m, kg, s, without parts; y is the radius, counted from the rotor's axis

    python3 two_parts.py            # writes them beside itself
    python3 two_parts.py --check    # says whether they are what it would write

Lengths are in mm. The slot runs along x, and z points outwards. The cross-section, in (y, z), is made of
rows of quadrilaterals, which are extruded along x; the airfoil is then twisted about its axis.
"""

import math
import sys
from pathlib import Path

DEPTH, LAYERS = 20.0, 4
AXIS_BELOW = 250.0  # of the rotor, below z = 0
BASE = -8.0
COLUMNS = 4
FOOT = [(0.0, 9.0), (3.0, 9.0)]  # height and half-width of the root, below its flanks
FLANK = [(5.0, 7.5), (7.0, 6.0), (9.0, 4.5)]
NECK = [(12.0, 3.2)]
AIRFOIL = [(12.0 + 8.0 * i, 3.2 - 0.28 * i) for i in range(1, 9)]
TWIST_DEG, LEAN = 32.0, 0.3  # of the tip, and the chord that the tip loses

BLADE = "Ti-6Al-4V", 110000.0, 0.31, 4.43e-9
JAW = "Inconel-718", 200000.0, 0.29, 8.22e-9


def twisted(point):
    """The airfoil above the neck is turned about the line x = DEPTH / 2, y = 0, and tapers."""
    x, y, z = point
    share = max(0.0, z - NECK[-1][0]) / (AIRFOIL[-1][0] - NECK[-1][0])
    angle = math.radians(TWIST_DEG) * share
    x = (x - DEPTH / 2) * (1.0 - LEAN * share)
    return x * math.cos(angle) - y * math.sin(angle) + DEPTH / 2, y * math.cos(angle) + x * math.sin(angle), z


def rows(left, right, columns):
    """Quadrilaterals between two lines of points, row by row; corners counter-clockwise."""
    for (a, b), (c, d) in zip(zip(left, left[1:]), zip(right, right[1:])):
        for i in range(columns):
            def at(p, q, k):
                return tuple(u + (v - u) * k / columns for u, v in zip(p, q))
            yield at(a, c, i), at(a, c, i + 1), at(b, d, i + 1), at(b, d, i)


class Part:
    """Hexahedra of 20 nodes, in the order of Abaqus."""

    def __init__(self, quadrilaterals, move=lambda point: point):
        self.move = move
        self.number, self.elements, self.faces = {}, [], {}
        for layer in range(LAYERS):
            x = [DEPTH * (layer + half / 2) / LAYERS for half in range(3)]
            for corners in quadrilaterals:
                self.add(corners, x)

    def add(self, corners, x):
        def middle(p, q):
            return tuple((u + v) / 2 for u, v in zip(p, q))
        edges = [middle(corners[i], corners[(i + 1) % 4]) for i in range(4)]
        sides = [(corners, x[0]), (corners, x[2]), (edges, x[0]), (edges, x[2]), (corners, x[1])]
        points = [(along, *p) for side, along in sides for p in side]
        nodes = [self.number.setdefault(tuple(round(u, 9) for u in p), len(self.number) + 1) for p in points]
        self.elements.append(nodes)
        for face, i in (("S3", 0), ("S4", 1), ("S5", 2), ("S6", 3)):
            key = tuple(sorted((corners[i], corners[(i + 1) % 4])))
            self.faces.setdefault(key, []).append((len(self.elements), face))

    def on_line(self, line, face):
        """Elements whose face of this label lies on a line of points of the cross-section."""
        edges = {tuple(sorted(edge)) for edge in zip(line, line[1:])}
        found = [e for edge in edges for e, label in self.faces[edge] if label == face]
        return sorted(found)

    def nodes_at(self, height):
        return [n for p, n in self.number.items() if p[2] == height]

    def at(self, place):
        """Positions of all nodes, moved to their place."""
        return [place(self.move(p)) for p in self.number]


def number(value):
    text = f"{value:.9g}"
    return text if any(c in text for c in ".en") else text + "."


def numbered(labels):
    """Data lines of a set, and whether they are first, last and step."""
    labels = sorted(labels)
    steps = {b - a for a, b in zip(labels, labels[1:])}
    if len(labels) > 2 and len(steps) == 1:
        return f"{labels[0]:5}, {labels[-1]:5}, {steps.pop():5}\n", ", generate"
    lines = [labels[i:i + 16] for i in range(0, len(labels), 16)]
    return "".join(",".join(f"{n:5}" for n in line) + "\n" for line in lines), ""


def a_set(kind, name, labels, more=""):
    lines, generate = numbered(labels)
    return f"*{kind}, {kind.lower()}={name}{more}{generate}\n{lines}"


def surface(name, elements, face, more=""):
    inner = f"_{name}_{face}"
    lines = a_set("Elset", inner, elements, ", internal" + more)
    return f"{lines}*Surface, type=ELEMENT, name={name}\n{inner}, {face}\n"


def mesh(part, place=lambda point: point):
    text = "*Node\n"
    for label, point in enumerate(part.at(place), 1):
        text += f"{label:7}," + ",".join(f"{number(x + 0.0):>13}" for x in point) + "\n"
    text += "*Element, type=C3D20R\n"
    for label, nodes in enumerate(part.elements, 1):
        first, rest = nodes[:15], nodes[15:]
        text += f"{label:5}," + ",".join(f"{n:5}" for n in first) + ",\n"
        text += " " * 6 + ",".join(f"{n:5}" for n in rest) + "\n"
    return text


def section(name, part, material):
    nodes, elements = range(1, len(part.number) + 1), range(1, len(part.elements) + 1)
    text = a_set("Nset", name, nodes) + a_set("Elset", name, elements)
    return text + f"** Section: {material[0]}\n*Solid Section, elset={name}, material={material[0]}\n,\n"


def material(name, young, poisson, density):
    return f"*Material, name={name}\n*Density\n{number(density)},\n*Elastic\n{number(young)}, {number(poisson)}\n"


def comment(text):
    return f"**\n** {text}\n**\n"


def a_part(name, part, of, place=lambda point: point):
    return f"*Part, name={name}\n" + mesh(part, place) + section("Solid", part, of) + "*End Part\n"


HEADING = "*Heading\n** {}, by two_parts.py in the form of Abaqus/CAE\n*Preprint, echo=NO, model=NO, history=NO, contact=NO\n"
ANALYSIS = """*Step, name=Spin, nlgeom=YES
*Static
0.1, 1., 1e-05, 1.
"""
OUTPUT = """*Restart, write, frequency=0
*Output, field, variable=PRESELECT
*Output, history, variable=PRESELECT
*End Step
"""


def joint(blade, jaw, flanks):
    def raised(point):
        return point[0], point[1], point[2] - BASE
    text = HEADING.format("A blade in the slot of a disc: mm, t, s")
    text += comment("PARTS") + a_part("Blade", blade, BLADE) + "**\n" + a_part("Jaw", jaw, JAW, raised)
    text += comment("ASSEMBLY") + "*Assembly, name=Assembly\n**\n"
    text += "*Instance, name=Blade-1, part=Blade\n*End Instance\n**\n"
    text += f"*Instance, name=Jaw-1, part=Jaw\n           0.,           0.,{number(BASE):>12}\n*End Instance\n**\n"
    on_blade, on_jaw = ", instance=Blade-1", ", instance=Jaw-1"
    text += a_set("Nset", "Tip", [blade.tip], on_blade)
    text += a_set("Nset", "Base", jaw.base, on_jaw) + a_set("Elset", "Base", jaw.at_base, on_jaw)
    for side, line, own, other in flanks:
        text += surface(f"Blade-{side}", blade.on_line(line, own), own, on_blade)
        text += surface(f"Jaw-{side}", jaw.on_line(line, other), other, on_jaw)
    text += "*End Assembly\n" + comment("MATERIALS") + material(*BLADE) + material(*JAW)
    text += comment("INTERACTION PROPERTIES")
    text += "*Surface Interaction, name=Dry\n1.,\n*Friction, slip tolerance=0.005\n0.3,\n"
    text += "*Surface Behavior, pressure-overclosure=HARD\n"
    text += comment("BOUNDARY CONDITIONS") + "*Boundary\nBase, ENCASTRE\n" + comment("INTERACTIONS")
    for side, *_ in flanks:
        text += f"*Contact Pair, interaction=Dry, type=SURFACE TO SURFACE\nBlade-{side}, Jaw-{side}\n"
    text += comment("STEP: Spin") + ANALYSIS
    text += f"*Dload\n, CENTRIF, 394784., 0., 0., {number(-AXIS_BELOW)}, 1., 0., 0.\n" + OUTPUT
    return text


def blade_alone(blade, flanks):
    text = HEADING.format("A blade: mm, t, s") + comment("PARTS") + a_part("Blade", blade, BLADE)
    text += comment("ASSEMBLY") + "*Assembly, name=Assembly\n*Instance, name=Blade-1, part=Blade\n*End Instance\n"
    text += a_set("Nset", "Tip", [blade.tip], ", instance=Blade-1")
    for side, line, own, _ in flanks:
        text += surface(f"Flank-{side}", blade.on_line(line, own), own, ", instance=Blade-1")
    return text + "*End Assembly\n" + comment("MATERIALS") + material(*BLADE)


def disc(jaw, flanks):
    def in_metres(point):
        x, y, z = point
        return x / 1000, (z + AXIS_BELOW) / 1000, -y / 1000
    name, young, poisson, density = JAW
    text = HEADING.format("A sector of a disc: m, kg, s")
    text += mesh(jaw, in_metres) + section("Sector", jaw, JAW) + a_set("Nset", "Base", jaw.base)
    for side, line, _, other in flanks:
        text += surface(f"Flank-{side}", jaw.on_line(line, other), other)
    return text + material(name, young * 1e6, poisson, density * 1e12)


def decks():
    def sides(profile):
        return [(-w, z) for z, w in profile], [(w, z) for z, w in profile]
    blade = Part(list(rows(*sides(FOOT + FLANK + NECK + AIRFOIL), COLUMNS)), twisted)
    left, right = sides([FOOT[-1], *FLANK])
    walls = [[(sign * 10.0, -1.0), *flank] for sign, flank in ((-1.0, left), (1.0, right))]
    outer = [[(sign * 20.0, z) for _, z in walls[0]] for sign in (-1.0, 1.0)]
    bottom = [(-20.0, BASE), (-20.0, -4.5), (-20.0, -1.0)]
    across = [-20.0, -10.0, 10.0, 20.0]
    base = [[(y, z) for _, z in bottom] for y in across]
    jaw = Part([
        *(q for k, n in enumerate((2, COLUMNS, 2)) for q in rows(base[k], base[k + 1], n)),
        *rows(outer[0], walls[0], 2),
        *rows(walls[1], outer[1], 2),
    ])
    height = AIRFOIL[-1][0]
    blade.tip = blade.number[(0.0, round(AIRFOIL[-1][1], 9), height)]
    jaw.base = jaw.nodes_at(BASE)
    jaw.at_base = jaw.on_line([(y, BASE) for y in (-20.0, -15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0)], "S3")
    flanks = [("Left", left, "S6", "S4"), ("Right", right, "S4", "S6")]
    return {
        "joint.inp": joint(blade, jaw, flanks),
        "blade.inp": blade_alone(blade, flanks),
        "disc.inp": disc(jaw, flanks),
    }


def main():
    folder, check = Path(__file__).parent, sys.argv[1:] == ["--check"]
    for name, text in decks().items():
        path = folder / name
        if not check:
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            sys.exit(f"{path} is not what {Path(__file__).name} writes: run it")


if __name__ == "__main__":
    main()
