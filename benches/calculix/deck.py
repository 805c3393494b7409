"""Writes the parts of a CalculiX input deck, runs ccx, reads frequencies."""

import pathlib
import re
import shutil
import subprocess

import elements

# Titanium, SI.
YOUNG_PA, POISSON, DENSITY_KG_M3 = 113.8e9, 0.34, 4430.0
# By the number of nodes. C3D8I has incompatible modes. CalculiX has no pyramids.
TYPES = {4: "C3D4", 6: "C3D6", 8: "C3D8I", 10: "C3D10", 15: "C3D15", 20: "C3D20"}


def nodes(points, metres_per_unit):
    """ccx reads at most 20 characters per real."""
    lines = ["*NODE, NSET=NALL"]
    for tag, xyz in sorted(points.items()):
        lines.append(f"{tag}, " + ", ".join(f"{x * metres_per_unit:.12g}" for x in xyz))
    return lines


def solid(found, name):
    """Elements of a volume group, a block for each type; ccx reads at most 16 numbers a line."""
    lines = []
    for kind in sorted({len(nodes) for _, nodes in found}):
        if kind not in TYPES:
            raise SystemExit(f"{name} has {elements.NAMES[kind]} nodes, and CalculiX has no such elements: give a "
                             "mesh without pyramids, or compare with the assembly by numpy (quadrature.py)")
        lines.append(f"*ELEMENT, TYPE={TYPES[kind]}, ELSET={name}")
        for tag, nodes in found:
            if len(nodes) == kind:
                words = [str(number) for number in (tag, *nodes)]
                rows = [", ".join(words[i:i + 16]) for i in range(0, len(words), 16)]
                lines += [row + "," for row in rows[:-1]] + rows[-1:]
    return lines


def material(elsets):
    lines = ["*MATERIAL, NAME=TITANIUM", "*ELASTIC", f"{YOUNG_PA:.12g}, {POISSON:.12g}",
             "*DENSITY", f"{DENSITY_KG_M3:.12g}"]
    return lines + [f"*SOLID SECTION, ELSET={name}, MATERIAL=TITANIUM" for name in elsets]


def node_set(name, tags):
    return [f"*NSET, NSET={name}"] + [f"{t}," for t in sorted(tags)]


def centrifugal(elset, omega_rad_s):
    """Rotation about the x axis through the origin."""
    return ["*DLOAD", f"{elset}, CENTRIF, {omega_rad_s ** 2:.12g}, 0, 0, 0, 1, 0, 0"]


def run(lines, folder, name, time_limit_s):
    """Path of the .dat file ccx wrote."""
    if shutil.which("ccx") is None:
        raise SystemExit("ccx not found: install CalculiX (apt-get install calculix-ccx)")
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n")
    dat = folder / f"{name}.dat"
    dat.unlink(missing_ok=True)
    try:
        done = subprocess.run(["ccx", name], cwd=folder, timeout=time_limit_s,
                              capture_output=True, text=True)
    except subprocess.TimeoutExpired:
        raise SystemExit(f"ccx did not end within {time_limit_s:g} s: give it more with --time-limit")
    if done.returncode != 0 or not dat.exists() or "*ERROR" in done.stdout:
        raise SystemExit(f"ccx failed ({done.returncode}):\n" + done.stdout[-2000:] + done.stderr[-500:])
    return dat


def frequencies_hz(dat):
    """Last table of eigenvalues in a .dat file."""
    tables = dat.read_text().split("E I G E N V A L U E   O U T P U T")[1:]
    if not tables:
        raise SystemExit(f"{dat}: no eigenvalues")
    row = re.compile(r"^\s+\d+\s+(\S+)\s+(\S+)\s+(\S+)\s+(\S+)\s*$", re.M)
    return [float(m[3]) for m in row.finditer(tables[-1].split("P A R T")[0])]


def displacements_m(dat):
    """Last table of displacements in a .dat file, by the node."""
    text = dat.read_text()
    start = text.rindex("displacements (vx,vy,vz)")
    rows = re.findall(r"^\s+(\d+)\s+(\S+)\s+(\S+)\s+(\S+)\s*$", text[start:], re.M)
    return {int(r[0]): [float(x) for x in r[1:]] for r in rows}
