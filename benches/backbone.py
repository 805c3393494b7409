"""Peaks by `dovetail backbone`, which needs no force, beside those of `dovetail peaks`.

    cargo build --release
    python3 benches/backbone.py [--range FROM:TO:N] [--amplitude FROM:TO] [--points N] [--set KEY=VALUE]...

Prints a table for docs/verification.md: for each force the amplitude and the frequency of the peak by both. Between two rows of
backbone.csv the logarithm of the amplitude is a line over that of the force. Both take the reduced model from the cache.
Standard library only.
"""

import argparse
import csv
import math
import os
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.append(os.path.join(ROOT, "scripts"))
import origin  # noqa: E402
PROGRAM = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target")), "release/dovetail")
SCENE = os.path.join(ROOT, "scenes/paper.toml")
READY = ["mesh.file=../meshes/dovetail.msh", "response.times_first_linear_mode=[0.97, 1.01]", "response.compare_harmonics="]
KEY = "excitation.*.force_n"


def rows(command, out, settings, rest):
    """Runs the program; returns the rows of its table and the seconds."""
    words = [PROGRAM, command, SCENE, "--out", out, "--quiet", *rest]
    for setting in READY + settings:
        words += ["--set", setting]
    begin = time.perf_counter()
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode not in (0, 3):
        raise SystemExit(done.stderr)
    seconds = time.perf_counter() - begin
    with open(os.path.join(out, f"{command}.csv"), encoding="utf-8") as file:
        return list(csv.DictReader(file)), seconds


def at_force(backbone, force):
    """Amplitude, frequency and damping ratio where the backbone has a force; None outside of it."""
    for low, high in zip(backbone, backbone[1:]):
        below, above = [math.log(float(row["force_n"]) / force) for row in (low, high)]
        if below <= 0.0 <= above:
            share = -below / (above - below)
            between = lambda a, b: a + share * (b - a)
            of = lambda name: between(float(low[name]), float(high[name]))
            amplitude = math.exp(between(*[math.log(float(row["amplitude_m"])) for row in (low, high)]))
            return amplitude, of("frequency_hz"), of("damping_ratio")
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--range", default="0.1:3:10")
    parser.add_argument("--amplitude", default="5e-4:7e-3")
    parser.add_argument("--points", default="60")
    parser.add_argument("--set", action="append", default=[])
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows("backbone", os.path.join(folder, "first"), asked.set, ["--amplitude", "1e-4:2e-4", "--points", "2"])
        of_backbone = ["--amplitude", asked.amplitude, "--points", asked.points]
        backbone, backbone_s = rows("backbone", os.path.join(folder, "backbone"), asked.set, of_backbone)
        peaks, peaks_s = rows("peaks", os.path.join(folder, "peaks"), asked.set, ["--over", f"{KEY}={asked.range}"])
    print(origin.line() + "\n")
    print("| force, N | peak, mm | by the backbone, mm | difference | at, Hz | by the backbone, Hz | difference | in half widths |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for peak in peaks:
        force, amplitude, frequency = [float(peak[name]) for name in (KEY, "amplitude_m", "frequency_hz")]
        found = at_force(backbone, force)
        if found is None:
            continue
        off = found[1] / frequency - 1.0
        print(
            f"| {force:.3f} | {1e3 * amplitude:.4f} | {1e3 * found[0]:.4f} | {100.0 * (found[0] / amplitude - 1.0):+.2f} % "
            f"| {frequency:.4f} | {found[1]:.4f} | {off:+.1e} | {off / found[2]:+.3f} |"
        )
    print(f"\n{len(backbone)} amplitudes in {backbone_s:.1f} s, {len(peaks)} peaks in {peaks_s:.1f} s")


if __name__ == "__main__":
    main()
