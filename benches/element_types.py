#!/usr/bin/env python3
"""The paper's joint by one element type after the other: what comes out, and what it costs.

    cargo build --release && python3 benches/element_types.py [--flanks 4x9 8x18] [--rounds 2] [--reference]

Each row is scenes/paper.toml on a mesh of geometry/dovetail.geo (tetrahedra) or geometry/dovetail_hex.geo (hexahedra, with the platform
of tetrahedra), of linear or of quadratic elements, without the response for comparison. --reference adds quadratic tetrahedra with 16 x
36 nodes a flank, once (four minutes, 3 GB). All runs of a round follow each other before the next round begins. Prints the figures of the
joint, then seconds of the processor by stage (one thread, no cache, the least of the rounds). Needs gmsh; else the standard library only.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "scripts"))
import origin  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/dovetail"
# Sizes of the two scripts by the flank, as docs/geometry.md has them.
SIZES = {
    "4x9": {"dovetail.geo": "lc = 6, lc_root = 3, lc_air = 3, lc_edge = 1.2", "dovetail_hex.geo": "lc = 6, lc_root = 3, lc_air = 2.5"},
    "8x18": {"dovetail.geo": "lc = 5, lc_root = 2.5, lc_air = 2.5, lc_edge = 1", "dovetail_hex.geo": "lc = 5, lc_root = 2.5, lc_air = 2"},
    "16x36": {"dovetail.geo": "lc = 4, lc_root = 2, lc_air = 2, lc_edge = 0.8", "dovetail_hex.geo": "lc = 4, lc_root = 2, lc_air = 1.5"},
}
REFERENCE = "16x36"
# Script and order.
ELEMENTS = {
    "tetrahedra of 10 nodes": ("dovetail.geo", 2),
    "hexahedra of 20 nodes": ("dovetail_hex.geo", 2),
    "tetrahedra of 4 nodes": ("dovetail.geo", 1),
    "hexahedra of 8 nodes": ("dovetail_hex.geo", 1),
}
BASIS = "tetrahedra of 10 nodes"
STAGES = ["finite_elements", "reduction", "response"]


def settings(element, flank):
    """--set of one mesh."""
    geometry, order = ELEMENTS[element]
    nu, nv = flank.split("x")
    return [f"mesh.geometry=../geometry/{geometry}", "mesh.fallback=", "mesh.fallback_parameters=", "mesh.time_limit_s=600",
            f"mesh.parameters={{ nu = {nu}, nv = {nv}, order = {order}, {SIZES[flank][geometry]} }}", "response.compare_harmonics="]


def run(element, flank, arguments):
    """summary.json of one run."""
    out = arguments.out / f"{element.replace(' ', '_')}_{flank}"
    line = [str(PROGRAM), "run", "scenes/paper.toml", "--out", str(out), "--quiet", "--no-fields", "--no-cache", "--threads", "1", "--force"]
    for key in settings(element, flank):
        line += ["--set", key]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(line)}\nended with {done.returncode}: {done.stderr}")
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def seconds(summary):
    """Of the processor: the stages, and the run less its mesh."""
    of = lambda name: sum(s["processor_seconds"] for s in summary["stages"] if s["id"] == name)
    return [of(name) for name in STAGES] + [summary["processor_seconds"] - of("mesh")]


def figures(summary):
    """Cells of the first table."""
    response = summary["response"]
    forces = ", ".join(f"{contact['normal_force_n']:.1f}" for contact in summary["static"]["contacts"])
    converged = f"{response['converged_points']} of {response['points']}"
    return [f"{summary['mesh']['nodes']}", f"{summary['mesh']['free_dofs']}", f"{summary['stuck_frequency_hz']:.3f}", forces,
            f"{1e3 * response['peak_amplitude_m']:.3f} at {response['peak_frequency_hz']:.2f}", f"{response['peak_ratio']:.4f}",
            f"{summary['pairs'] - response['peak_stuck_pairs']}, {response['peak_opening_pairs']} of {summary['pairs']}",
            f"{response['peak_friction_power_w']:.2f}, {response['peak_damping_power_w']:.2f}", converged]


def print_table(heads, rows):
    print("\n| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    for row in rows:
        print("| " + " | ".join(row) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flanks", nargs="+", default=["4x9", "8x18"], choices=list(SIZES), help="corner nodes across and along")
    parser.add_argument("--elements", nargs="+", default=list(ELEMENTS), choices=list(ELEMENTS))
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--reference", action="store_true")
    parser.add_argument("--out", type=Path, default=ROOT / "output/element_types")
    arguments = parser.parse_args()
    arguments.out = arguments.out.resolve()
    if not shutil.which("gmsh"):
        raise SystemExit("gmsh is not installed, and these meshes are its: apt-get install gmsh")
    cases = [(element, flank) for flank in arguments.flanks for element in arguments.elements]
    sequence = [case for _ in range(arguments.rounds) for case in cases]
    if arguments.reference:
        sequence.append((BASIS, REFERENCE))
    summaries, taken, load = {}, {}, []
    for case in sequence:
        load.append(os.getloadavg()[0])
        summaries[case] = run(*case, arguments)
        taken.setdefault(case, []).append(seconds(summaries[case]))
        print(f"{case[0]}, {case[1]}: {taken[case][-1][-1]:.1f} s", file=sys.stderr, flush=True)

    heads = ["elements", "flank", "nodes", "free dofs", "first stuck mode, Hz", "static normal forces, N", "peak of the tip, mm at Hz",
             "over the linear one", "pairs that do not stick, open at times there", "friction, damping power there, W", "converged"]
    print_table(heads, [[element, flank.replace("x", " x "), *figures(summaries[element, flank])] for element, flank in summaries])
    least = {case: [min(column) for column in zip(*rows)] for case, rows in taken.items()}
    rows = []
    for (element, flank), found in least.items():
        basis = least.get((BASIS, flank))
        ratio = f"{found[-1] / basis[-1]:.2f}" if basis else "-"
        spread = max(row[-1] for row in taken[element, flank]) / found[-1]
        memory = max(s["peak_memory_mib"] or 0.0 for s in summaries[element, flank]["stages"])
        rows.append([element, flank.replace("x", " x "), *(f"{s:.2f}" for s in found), ratio, f"{spread:.2f}", f"{memory:.0f}"])
    print_table(["elements", "flank", "finite elements, s", "reduction, s", "response, s", "all but gmsh, s", f"over {BASIS}",
                 "slowest round over fastest", "peak, MiB"], rows)
    print(f"\nload of the machine before the runs, mean of a minute: {min(load):.1f} to {max(load):.1f}")


if __name__ == "__main__":
    print(origin.line() + "\n")
    main()
