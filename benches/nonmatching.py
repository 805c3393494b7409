#!/usr/bin/env python3
"""The paper's joint with flanks whose meshes do not match, beside the matching ones.

    cargo build --release && python3 benches/nonmatching.py [--out output/nonmatching]

Each case is scenes/paper.toml with a mesh of its own for each body, made by geometry/dovetail.geo (tetrahedra) or geometry/dovetail_hex.geo
(hexahedra), both of quadratic elements, and without the response for comparison. Prints a table. The static pressures are read from
static.csv: each pair's pressure and area, of which the mean and the largest are taken. Needs gmsh; else the standard library only.
"""

import argparse
import csv
import json
import re
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "scripts"))
import origin  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/dovetail"
SCRIPTS = {"tet": "dovetail.geo", "hex": "dovetail_hex.geo"}
# Mesh of the blade, mesh of the jaw: corner nodes across and along a flank.
CASES = [
    (("tet", "4x9"), ("tet", "4x9")),
    (("tet", "4x9"), ("tet", "6x13")),
    (("tet", "6x13"), ("tet", "6x13")),
    (("tet", "5x11"), ("tet", "5x11")),
    (("tet", "8x18"), ("tet", "5x11")),
    (("tet", "8x18"), ("tet", "8x18")),
    (("hex", "4x9"), ("hex", "4x9")),
    (("hex", "4x9"), ("tet", "6x13")),
    (("hex", "6x13"), ("tet", "4x9")),
]


def mesh_of(kind, flank, out):
    """The mesh file, made where it is not there."""
    path = out / f"{kind}_{flank}.msh"
    if not path.exists():
        nu, nv = flank.split("x")
        line = ["gmsh", "-3", str(ROOT / "geometry" / SCRIPTS[kind]), "-o", str(path), "-format", "msh41", "-v", "1"]
        for key, value in [("nu", nu), ("nv", nv), ("order", 2)]:
            line += ["-setnumber", key, str(value)]
        subprocess.run(line, check=True, timeout=600)
    return path


def scene_of(blade, jaw, out):
    """The paper's scene with these meshes in the place of its own."""
    text = (ROOT / "scenes/paper.toml").read_text(encoding="utf-8")
    text = re.sub(r"\[mesh\]\n(?:[^\[\n].*\n|\n)*", "", text, count=1)
    for body, mesh in [("blade", blade), ("jaw", jaw)]:
        own = f'volume = "{body}"\nmesh_file = "{mesh}"\nmetres_per_unit = 1e-3\n'
        text, count = re.subn(rf'volume = "{body}".*\n', own, text)
        assert count == 1, body
        # Both files have the groups of both bodies.
        text = re.sub(rf'"({body}_flank_\w+)"', rf'"{body}.\1"', text)
    text = text.replace('on = "excitation"', 'on = "blade.excitation"')
    text = text.replace('points = "tip_trailing_edge"', 'points = "blade.tip_trailing_edge"')
    path = out / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def run(case, out):
    (blade, jaw) = case
    name = "_".join(f"{kind}_{flank}" for kind, flank in case)
    scene = scene_of(mesh_of(*blade, out), mesh_of(*jaw, out), out)
    folder = out / name
    line = [str(PROGRAM), "run", str(scene), "--out", str(folder), "--quiet", "--no-fields", "--force", "--set", "response.compare_harmonics="]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(line)}\nended with {done.returncode}: {done.stderr}")
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    with (folder / "static.csv").open(encoding="utf-8") as file:
        pairs = [(float(row["pressure_pa"]), float(row["area_m2"])) for row in csv.DictReader(file)]
    return summary, pairs


def cells(case, summary, pairs):
    response, matches = summary["response"], summary["mesh"]["contacts"]
    area = sum(a for _, a in pairs)
    mean = sum(p * a for p, a in pairs) / area
    # Pressure peaks at the edges grow as the mesh is refined: the root mean square does so less.
    rms = (sum(p * p * a for p, a in pairs) / area) ** 0.5
    forces = ", ".join(f"{contact['normal_force_n']:.1f}" for contact in summary["static"]["contacts"])
    names = [f"{kind} {flank.replace('x', ' x ')}" for kind, flank in case]
    weight = max(m["largest_weight"] for m in matches)
    return [*names, str(summary["pairs"]), matches[0]["slave"], f"{weight:.2f}", f"{summary['stuck_frequency_hz']:.3f}", forces,
            f"{mean / 1e6:.2f}, {rms / 1e6:.2f}, {max(p for p, _ in pairs) / 1e6:.1f}",
            f"{1e3 * response['peak_amplitude_m']:.3f} at {response['peak_frequency_hz']:.2f}",
            f"{response['peak_friction_power_w']:.2f}", f"{response['converged_points']} of {response['points']}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "output/nonmatching")
    out = parser.parse_args().out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    heads = ["blade", "jaw", "pairs", "slave", "largest weight", "first stuck mode, Hz", "static normal forces, N",
             "pressure, mean, rms, largest, MPa", "peak of the tip, mm at Hz", "friction power there, W", "converged"]
    print("| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    for case in CASES:
        print("| " + " | ".join(cells(case, *run(case, out))) + " |", flush=True)
        print(f"{case} done", file=sys.stderr, flush=True)


if __name__ == "__main__":
    print(origin.line() + "\n")
    main()
