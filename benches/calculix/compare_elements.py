#!/usr/bin/env python3
"""Element type by element type: a twisted bar by dovetail, by CalculiX and by numpy, on the same mesh.

    apt-get install calculix-ccx gmsh; cargo build --release
    target/venv/bin/python benches/calculix/compare_elements.py [--elements C3D8I C3D20] [--divisions 2] [--rpm 20000]

Meshes geometry/verification/element_bar.geo with each type, its root held: the first frequencies, and at rest the
displacement of the end under a force, by `dovetail modes` and `dovetail static` of
scenes/verification/element_bar.toml, by ccx, and by the assembly of assembly.py with the rules of each of
the two programs. At a speed about the x axis, through the root, the assembly of CalculiX has its initial-displacement
stiffness, too, and the last two columns divide what the two programs differ by: between their rules, and between
what they compute. Prints a Markdown table. Each program must give what the assembly gives with its rules. Ends with status 1 where one is off by more than ALLOWED. Material,
force and supports of the decks are those of the scene. Needs python3, numpy, scipy, gmsh and ccx; takes a
minute.
"""

import argparse
import csv
import math
import pathlib
import subprocess
import sys
import tempfile

import assembly
import blade_modes
import compare_blade_modes
import deck
import msh

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402

ROOT = compare_blade_modes.ROOT
GEOMETRY = ROOT / "geometry/verification/element_bar.geo"
# Shape and order of the script, by the name of CalculiX.
ELEMENTS = {"C3D8I": (8, 1), "C3D20": (8, 2), "C3D6": (6, 1), "C3D15": (6, 2), "C3D4": (4, 1), "C3D10": (4, 2)}
# Relative, from the assembly; ccx writes seven digits.
ALLOWED = {"CalculiX": 2e-6, "dovetail": 1e-8}
# Of the scene.
FORCE_N, CORNERS, ROOT_GROUP, UNITS = (36.0, 48.0, 80.0), "bar_corners", "bar_root", 1e-3


def made(given, folder, element):
    """The mesh of one type of elements."""
    shape, order = ELEMENTS[element]
    mesh = folder / f"{element}.msh"
    words = ["gmsh", "-3", str(GEOMETRY), "-nt", "1", "-format", "msh41", "-bin", "-o", str(mesh)]
    n = given.divisions
    sizes = {"shape": shape, "order": order, "nx": 4 * n, "ny": 2 * n, "nz": 10 * n}
    for key, value in (sizes | getattr(given, "parameters", {})).items():
        words += ["-setnumber", key, str(value)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=given.time_limit)
    if done.returncode != 0 or not mesh.exists():
        raise SystemExit(f"{' '.join(words)}\n{done.stdout[-2000:]}{done.stderr[-500:]}")
    return mesh


def along(displacement):
    """Component along the force."""
    return sum(u * f for u, f in zip(displacement, FORCE_N)) / math.hypot(*FORCE_N)


def by_calculix(given, folder, mesh):
    """Frequencies, Hz, and at rest displacement along the force, m."""
    if given.rpm:
        case = blade_modes.case(mesh, given.modes, given.rpm, "bar", [ROOT_GROUP], UNITS)
        return deck.frequencies_hz(deck.run(case, folder, "modes", given.time_limit))[:given.modes], None
    points, groups = msh.read(mesh)
    solid = msh.group(groups, "bar")
    fixed = {n for _, e in msh.group(groups, ROOT_GROUP) for n in e}
    ends = sorted({n for _, e in msh.group(groups, CORNERS) for n in e})
    lines = deck.nodes({t: points[t] for t in {n for _, e in solid for n in e}}, UNITS)
    lines += deck.solid(solid, "BAR") + deck.node_set("ROOT", fixed) + deck.node_set("ENDS", ends)
    lines += deck.material(["BAR"]) + ["*BOUNDARY", "ROOT, 1, 3"]
    frequency = ["*STEP", "*FREQUENCY, SOLVER=SPOOLES", str(given.modes), "*END STEP"]
    load = [f"{n}, {k + 1}, {force / len(ends):.12g}" for n in ends for k, force in enumerate(FORCE_N)]
    static = ["*STEP", "*STATIC, SOLVER=SPOOLES", "*CLOAD", *load, "*NODE PRINT, NSET=ENDS", "U", "*END STEP"]
    hz = deck.frequencies_hz(deck.run(lines + frequency, folder, "modes", given.time_limit))[:given.modes]
    moved = deck.displacements_m(deck.run(lines + static, folder, "static", given.time_limit))
    return hz, along([sum(moved[n][k] for n in ends) / len(ends) for k in range(3)])


def by_dovetail(given, folder, mesh):
    """The same."""
    sets = [f"mesh.file={mesh}"]
    if given.rpm:
        sets += [f"rotation={{ axis = [1, 0, 0], point_m = [0, 0, 0], speed_rpm = {given.rpm:g}, bodies = ['bar'], "
                 "prestress = 'held_flanks' }", "load="]
    compare_blade_modes.dovetail(given, "modes", folder, *sets)
    with open(folder / "modes.csv", newline="") as file:
        hz = [float(row["frequency_hz"]) for row in csv.DictReader(file) if row["kind"] == "stuck"]
    if given.rpm:
        return hz[:given.modes], None
    compare_blade_modes.dovetail(given, "static", folder, *sets, options=["--force"])
    with open(folder / "static_observed.csv", newline="") as file:
        moved = {row["name"]: float(row["displacement_m"]) for row in csv.DictReader(file)}
    return hz[:given.modes], along([moved["x"], moved["y"], moved["z"]])


def by_assembly(given, body, scheme):
    """The same; at a speed with all that CalculiX has, where the scheme is its."""
    system = assembly.System(body, scheme)
    if given.rpm:
        as_paper, as_calculix = system.spinning(given.rpm * math.pi / 30)
        return system.frequencies_hz(as_calculix if scheme is assembly.CALCULIX else as_paper, given.modes), None
    stiffness = system.stiffness()
    load, ends = body.shares(FORCE_N, CORNERS)
    moved = system.answer(stiffness, load).reshape(-1, 3)[ends].mean(axis=0)
    return system.frequencies_hz(stiffness, given.modes), along(moved)


def with_our_terms(given, body):
    """Of the assembly with the points of CalculiX, at a speed with the stiffness of dovetail."""
    system = assembly.System(body, assembly.CALCULIX)
    return system.frequencies_hz(system.spinning(given.rpm * math.pi / 30)[0], given.modes), None


def figures(result):
    """Names and values: frequencies in Hz, displacement in um."""
    hz, displacement_m = result
    found = [(f"mode {mode}, Hz", f) for mode, f in enumerate(hz, 1)]
    return found if displacement_m is None else found + [("displacement, um", 1e6 * displacement_m)]


def compare(given, folder, element):
    """Prints the rows of one type; the largest differences of CalculiX and dovetail from the assembly."""
    mesh = made(given, folder, element)
    body = assembly.Body(mesh, "bar", [ROOT_GROUP], UNITS)
    theirs = figures(by_calculix(given, folder, mesh))
    their_points = figures(by_assembly(given, body, assembly.CALCULIX))
    our_points = figures(by_assembly(given, body, assembly.DOVETAIL))
    between = figures(with_our_terms(given, body)) if given.rpm else their_points
    ours = figures(by_dovetail(given, folder / element, mesh)) if not given.without_dovetail else None
    count = f"{sum(len(b) for b in body.blocks.values())}, {len(body.x)}"
    off = dict.fromkeys(ALLOWED, 0.0)
    for row, (name, b) in enumerate(theirs):
        off["CalculiX"] = max(off["CalculiX"], abs(b / their_points[row][1] - 1))
        cells = [element, count, name]
        if ours:
            off["dovetail"] = max(off["dovetail"], abs(ours[row][1] / our_points[row][1] - 1))
            cells.append(f"{ours[row][1]:.7g}")
        cells += [f"{our_points[row][1]:.7g}", f"{b:.7g}", f"{their_points[row][1]:.7g}"]
        over = [our_points[row][1] / between[row][1]]
        if given.rpm:
            over.append(between[row][1] / their_points[row][1])
        cells += [f"{100 * (ratio - 1):+.4f} %" for ratio in over]
        print("| " + " | ".join(cells) + " |", flush=True)
    return off


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scene", default=str(ROOT / "scenes/verification/element_bar.toml"))
    parser.add_argument("--dovetail", default=str(ROOT / "target/release/dovetail"), help="the program")
    parser.add_argument("--without-dovetail", action="store_true", help="compare CalculiX with the assembly alone")
    parser.add_argument("--elements", nargs="+", default=list(ELEMENTS), choices=list(ELEMENTS))
    parser.add_argument("--divisions", type=int, default=1, help="times as many elements each way")
    parser.add_argument("--rpm", type=float, default=0.0, help="speed of rotation")
    parser.add_argument("--modes", type=int, default=6)
    parser.add_argument("--time-limit", type=float, default=600.0, help="for each run, s")
    given = parser.parse_args()

    heads = ["element", "elements, nodes", "figure", "dovetail", "assembly, points of dovetail", "CalculiX",
             "assembly, points of CalculiX", "dovetail over CalculiX, by the assembly"]
    if given.rpm:
        heads[-1:] = ["points of dovetail over those of CalculiX", "without over with initial displacement"]
    if given.without_dovetail:
        heads.remove("dovetail")
    print("| " + " | ".join(heads) + " |")
    print("|" + " --- |" * len(heads))
    worst = dict.fromkeys(["CalculiX"] if given.without_dovetail else ALLOWED, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        for element in given.elements:
            off = compare(given, pathlib.Path(folder), element)
            worst = {program: max(found, off[program]) for program, found in worst.items()}
    print()
    for program, found in worst.items():
        print(f"largest difference of {program} from the assembly: {found:.1e}, allowed {ALLOWED[program]:g}")
    return 0 if all(math.isfinite(found) and found <= ALLOWED[program] for program, found in worst.items()) else 1


if __name__ == "__main__":
    print(origin.line() + "\n")
    sys.exit(main())
