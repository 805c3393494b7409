"""Frequencies over the nodal diameters of a published bladed disc, three meshes, beside those of Ansys MAPDL.

    cargo build --release
    python3 benches/seven_blades.py

Source of the geometry and of the frequencies: example "Cyclic Analysis" of the documentation of PyMAPDL, ANSYS, Inc.
(https://mapdl.docs.pyansys.com, gallery of examples; text version/0.63 of the repository ansys/pymapdl, solved by MAPDL 22.2 of
April 2023 with 1329 elements SOLID186 of 1 mm). Prints the tables of docs/verification.md and ends with 1 where a frequency of the
finest mesh is off by more than 0.2 %. Standard library only.
"""

import csv
import os
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.append(os.path.join(ROOT, "scripts"))
import origin  # noqa: E402
PROGRAM = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target")), "release/dovetail")
SCENE = os.path.join(ROOT, "scenes/verification/seven_blades.toml")
# Elements across and along a blade, from the hub inwards, and along the axis.
MESHES = [(6, 29, 7, 2), (8, 43, 10, 3), (12, 64, 14, 4)]
# Printed frequencies, Hz, of each harmonic index, without the rigid motions.
PUBLISHED_HZ = {
    0: [1754.7717, 9255.3082, 10975.854, 11515.659],
    1: [4016.6790, 4064.7019, 10313.635, 14213.057],
    2: [1057.6193, 3380.5306, 6319.8741, 10091.655, 18041.415],
    3: [1193.6466, 3319.5314, 7336.3716, 9979.9484, 19188.407],
}
# Those of the rigid disc on its soft springs are lower.
LEAST_HZ = 200.0
ALLOWED = 2e-3


def frequencies(mesh, out):
    """Elements and elastic frequencies, Hz, by their nodal diameter."""
    words = [PROGRAM, "modes", SCENE, "--out", out, "--force", "--no-cache", "--quiet"]
    for name, value in zip(["across", "along", "inward", "layers"], mesh):
        words += ["--set", f"mesh.parameters.{name}={value}"]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    found = {}
    with open(os.path.join(out, "modes_nodal_diameters.csv"), encoding="utf-8") as file:
        for row in csv.DictReader(file):
            hz = float(row["frequency_hz"])
            if hz > LEAST_HZ:
                found.setdefault(int(row["nodal_diameter"]), []).append(hz)
    across, along, inward, layers = mesh
    return across * (along + inward) * layers, found


def main():
    print(origin.line())
    with tempfile.TemporaryDirectory() as folder:
        found = [frequencies(mesh, os.path.join(folder, "out")) for mesh in MESHES]
    heads = " | ".join(f"{elements} elements" for elements, _ in found)
    print(f"| nodal diameters | mode | MAPDL, Hz | {heads} | difference of the finest |")
    print("| --- " * (4 + len(found)) + "|")
    worst = 0.0
    for diameter, published in PUBLISHED_HZ.items():
        for mode, theirs in enumerate(published):
            ours = [of[diameter][mode] for _, of in found]
            off = ours[-1] / theirs - 1.0
            worst = max(worst, abs(off))
            columns = " | ".join(f"{hz:.2f}" for hz in ours)
            print(f"| {diameter} | {mode + 1} | {theirs:.2f} | {columns} | {100 * off:+.3f} % |")
    print(f"largest difference {100 * worst:.3f} %")
    return int(worst > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
