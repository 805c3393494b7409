#!/usr/bin/env python3
"""What the prestress changes on the paper's joint, and what it costs.

    cargo build --release && python3 benches/prestress.py [--out output/prestress] [--program FILE]

Each row is scenes/paper.toml with one choice of rotation.prestress, without the response for comparison; the last rows are at 15,000 rpm.
The processor seconds are those of the run up to its response, over those with flanks held at the same speed in the last column. Prints a
table. Needs gmsh, or the ready mesh of the scene; else the standard library only.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "scripts"))
import origin  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/dovetail"
CASES = [(rpm, prestress) for rpm in (5000, 15000) for prestress in ("none", "held_flanks", "contact")]


def run(program, rpm, prestress, out):
    folder = out / f"{prestress}_{rpm}"
    line = [str(program), "run", "scenes/paper.toml", "--out", str(folder), "--quiet", "--no-fields", "--no-cache", "--force"]
    for key in [f"rotation.prestress={prestress}", f"rotation.speed_rpm={rpm}", "response.compare_harmonics="]:
        line += ["--set", key]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(line)}\nended with {done.returncode}: {done.stderr}")
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def seconds(summary):
    """Processor time of the stages that the prestress is in."""
    before = ("finite_elements", "reduction", "static_state")
    return sum(stage["processor_seconds"] for stage in summary["stages"] if stage["id"] in before)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "output/prestress")
    parser.add_argument("--program", type=Path, default=PROGRAM)
    given = parser.parse_args()
    out = given.out.resolve()
    held = {}
    heads = ["rpm", "prestress", "passes", "last change of the normal forces", "static normal forces, N", "first stuck mode, Hz",
             "first linear mode, Hz", "peak of the tip, mm at Hz", "friction power there, W", "held_flanks_error", "processor s",
             "of held flanks"]
    print("| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    for rpm, prestress in CASES:
        summary = run(given.program.resolve(), rpm, prestress, out)
        took, error = seconds(summary), summary.get("held_flanks_error")
        if prestress == "held_flanks":
            held[rpm] = took
        response, passes = summary["response"], summary.get("prestress_passes") or []
        change = f"{passes[-1]['change']:.1e}" if passes else "-"
        forces = ", ".join(f"{contact['normal_force_n']:.2f}" for contact in summary["static"]["contacts"])
        row = [f"{rpm:,}", f'`"{prestress}"`', str(len(passes) or "-"), change, forces, f"{summary['stuck_frequency_hz']:.3f}",
               f"{summary['linear_frequency_hz']:.3f}", f"{1e3 * response['peak_amplitude_m']:.3f} at {response['peak_frequency_hz']:.2f}",
               f"{response['peak_friction_power_w']:.3f}", f"{error:.1e}" if error is not None else "-", f"{took:.1f}",
               f"{took / held[rpm]:.2f}" if rpm in held else "-"]
        print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    print(origin.line() + "\n")
    main()
