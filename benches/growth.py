#!/usr/bin/env python3
"""How time and memory grow with pairs, degrees of freedom, harmonics and samples.

    make bench                                        # or, after cargo build --release:
    python3 benches/growth.py [--points 21] [--large] [--only pairs,dofs,harmonics,samples] [--out output/growth]

Runs the paper's scene, one thread, no cache, one thing changed at a time, and prints a Markdown table for each: seconds of the
processor by stage, peak memory, and the exponent e of a least-squares line through the logarithms, seconds ~ x^e. gmsh makes the meshes;
without it only harmonics and samples are measured, on the ready mesh. --large adds the flanks of 16 x 36 and 24 x 54 nodes, and
meshes of 0.4 and 1 million dofs. It takes an hour and 14 GiB of memory. --only names the tables. Standard library only.
"""

import argparse
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "scripts"))
import origin  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
READY = "mesh.file=../meshes/dovetail.msh"
PROGRAM = ROOT / "target/release/dovetail"
# Stage of summary.json, and what heads its column.
STAGES = [("finite_elements", "elements, s"), ("reduction", "reduction, s"), ("static_state", "static, s"), ("response", "response, s")]


def flank(nu, nv, scale, factor=1.0):
    """Parameters of a mesh; `scale` is the largest size in the jaw, `factor` refines all but the flanks."""
    sizes = {"lc": scale, "lc_air": 0.5 * scale, "lc_edge": 0.2 * scale, "lc_root": 0.5 * scale}
    sizes = ", ".join(f"{name} = {factor * size:g}" for name, size in sizes.items())
    return [f"mesh.parameters={{ nu = {nu}, nv = {nv}, {sizes} }}", "mesh.time_limit_s=600"]


def run(out, sets, points):
    line = [str(PROGRAM), "run", "scenes/paper.toml", "--out", str(out), "--quiet", "--no-fields", "--no-cache", "--threads", "1"]
    line += ["--set", "response.times_first_linear_mode=[0.995, 1.003]", "--set", f"response.points={points}"]
    line += ["--set", "response.compare_harmonics="]
    for key in sets:
        line += ["--set", key]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(line)}\nended with {done.returncode}: {done.stderr}")
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def seconds(summary, stage):
    taken = [s["processor_seconds"] for s in summary["stages"] if s["id"] == stage and s["processor_seconds"] is not None]
    return sum(s for s in taken)


def exponent(x, y):
    points = [(math.log(a), math.log(b)) for a, b in zip(x, y) if a > 0 and b > 0.02]
    if len(points) < 2:
        return None
    mx, my = (sum(p[i] for p in points) / len(points) for i in (0, 1))
    spread = sum((a - mx) ** 2 for a, _ in points)
    return sum((a - mx) * (b - my) for a, b in points) / spread if spread else None


def table(title, of, cases, stages, arguments):
    """`cases`: (label, overrides); `of(summary, label)` is what the cases are drawn against."""
    print(f"\n{title}\n")
    heads = [head for name, head in STAGES if name in stages]
    print("| " + " | ".join([of.__name__.replace("_", " "), *heads, "peak, MiB", "converged"]) + " |")
    print("|" + " --- |" * (len(heads) + 3))
    x, columns = [], []
    for label, sets in cases:
        summary = run(arguments.out / title.split(":")[0].replace(" ", "_") / str(label).replace(" ", ""), sets, arguments.points)
        figures = [seconds(summary, name) for name, _ in STAGES if name in stages]
        figures.append(max(s["peak_memory_mib"] or 0.0 for s in summary["stages"]))
        x.append(of(summary, label))
        columns.append(figures)
        cells = [str(x[-1]) + (f" ({label})" if str(label) != str(x[-1]) else "")]
        cells += [f"{figure:.3g}" for figure in figures[:-1]] + [f"{figures[-1]:.0f}"]
        response = summary["response"]
        print("| " + " | ".join([*cells, f"{response['converged_points']} of {response['points']}"]) + " |", flush=True)
    fitted = [exponent(x, column) for column in zip(*columns)]
    print("| **exponent** | " + " | ".join("-" if e is None else f"{e:.2f}" for e in fitted) + " | |")


def pairs(summary, _):
    return summary["pairs"]


def free_dofs(summary, _):
    return sum(body["free_dofs"] for body in summary["mesh"]["bodies"])


def harmonics(_, label):
    return label


def samples(_, label):
    return label


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=21)
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--only", default="pairs,dofs,harmonics,samples")
    parser.add_argument("--out", type=Path, default=ROOT / "output/growth")
    arguments = parser.parse_args()
    arguments.out = arguments.out.resolve()
    only = set(arguments.only.split(","))
    if unknown := only - {"pairs", "dofs", "harmonics", "samples"}:
        parser.error(f"--only: {', '.join(sorted(unknown))} is none of pairs, dofs, harmonics, samples")
    every = [name for name, _ in STAGES]
    meshed = only & {"pairs", "dofs"}
    if meshed and not shutil.which("gmsh"):
        print("gmsh is missing: pairs and degrees of freedom are left out")
        meshed = set()
    if "pairs" in meshed:
        meshes = [("4 x 9", flank(4, 9, 6)), ("6 x 13", flank(6, 13, 5.5)), ("8 x 18", flank(8, 18, 5))]
        if arguments.large:
            meshes += [("16 x 36", flank(16, 36, 4)), ("24 x 54", flank(24, 54, 3.4))]
        table("pairs: the whole mesh refined with the flanks", pairs, meshes, every, arguments)
    if "dofs" in meshed:
        factors = (1.0, 0.8, 0.65, 0.5, 0.35, 0.25) if arguments.large else (1.0, 0.8, 0.65, 0.5)
        finer = [(f"sizes x {f:g}", flank(4, 9, 6, f)) for f in factors]
        table("free dofs: 72 pairs, the mesh finer away from the flanks", free_dofs, finer, every, arguments)
    if "harmonics" in only:
        more = [(h, [READY, f"response.harmonics={h}", "response.samples=128"]) for h in (1, 3, 7, 15)]
        table("harmonics: 72 pairs, 128 samples", harmonics, more, ["response"], arguments)
    if "samples" in only:
        more = [(n, [READY, f"response.samples={n}"]) for n in (64, 128, 256, 512, 1024)]
        table("samples: 72 pairs, 3 harmonics", samples, more, ["response"], arguments)


if __name__ == "__main__":
    print(origin.line() + "\n")
    sys.exit(main())
