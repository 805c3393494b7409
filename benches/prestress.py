#!/usr/bin/env python3
"""What the prestress changes on the paper's joint.

    cargo build --release && python3 benches/prestress.py [--out output/prestress]

Each row is scenes/paper.toml with one choice of rotation.prestress, without the response for comparison; the last rows are at 15,000 rpm.
Prints a table. Needs gmsh, or the ready mesh of the scene; else the standard library only.
"""

import argparse
import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/dovetail"
CASES = [(rpm, prestress) for rpm in (5000, 15000) for prestress in ("none", "held_flanks", "contact")]


def run(rpm, prestress, out):
    folder = out / f"{prestress}_{rpm}"
    line = [str(PROGRAM), "run", "scenes/paper.toml", "--out", str(folder), "--quiet", "--no-fields", "--force"]
    for key in [f"rotation.prestress={prestress}", f"rotation.speed_rpm={rpm}", "response.compare_harmonics="]:
        line += ["--set", key]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(line)}\nended with {done.returncode}: {done.stderr}")
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "output/prestress")
    out = parser.parse_args().out.resolve()
    heads = ["rpm", "prestress", "passes", "last change of the normal forces", "static normal forces, N", "first stuck mode, Hz",
             "first linear mode, Hz", "peak of the tip, mm at Hz", "friction power there, W"]
    print("| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    for rpm, prestress in CASES:
        summary = run(rpm, prestress, out)
        response, passes = summary["response"], summary.get("prestress_passes") or []
        change = f"{passes[-1]['change']:.1e}" if passes else "-"
        forces = ", ".join(f"{contact['normal_force_n']:.2f}" for contact in summary["static"]["contacts"])
        row = [f"{rpm:,}", f'`"{prestress}"`', str(len(passes) or "-"), change, forces, f"{summary['stuck_frequency_hz']:.3f}",
               f"{summary['linear_frequency_hz']:.3f}", f"{1e3 * response['peak_amplitude_m']:.3f} at {response['peak_frequency_hz']:.2f}",
               f"{response['peak_friction_power_w']:.3f}"]
        print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
