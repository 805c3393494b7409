"""Peaks by `dovetail backbone`, which needs no force, beside those of `dovetail peaks`.

    cargo build --release
    python3 benches/backbone.py [--range FROM:TO:N] [--amplitude FROM:TO] [--points N] [--set KEY=VALUE]...

Prints a table for docs/verification.md: for each force the amplitude and the frequency of the peak by both. Between two rows of
backbone.csv the logarithm of the amplitude is a line over that of the force. Both take the reduced model from the cache. Below it
stand, for each force of --response, the largest differences of the response from that of the backbone. Standard library only.
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
    table = "response" if command == "run" else command
    with open(os.path.join(out, f"{table}.csv"), encoding="utf-8") as file:
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


def beside_response(backbone, curve):
    """Largest relative differences of the amplitudes above a half and a fifth of the peak, below and above its frequency."""
    tip = next(name for name in curve[0] if name.endswith("_amplitude_m"))
    points = [(float(row["frequency_hz"]), float(row[tip])) for row in curve if row["outcome"] == "converged"]
    peak_hz, peak_m = max(points, key=lambda point: point[1])
    worst = {}
    for name, above in [("response_below_hz", False), ("response_above_hz", True)]:
        side = [(float(row[name]), float(row["amplitude_m"])) for row in backbone if row[name]]
        for hz, amplitude in points:
            between = [(p, q) for p, q in zip(side, side[1:]) if min(p[0], q[0]) <= hz <= max(p[0], q[0])]
            if (hz > peak_hz) != above or not between or amplitude < 0.2 * peak_m:
                continue
            (low, high) = between[0]
            share = (hz - low[0]) / (high[0] - low[0])
            found = math.exp(math.log(low[1]) + share * math.log(high[1] / low[1]))
            for share_of_peak in (0.5, 0.2):
                if amplitude >= share_of_peak * peak_m:
                    key = (share_of_peak, above)
                    worst[key] = max(worst.get(key, (0.0, 0)), (abs(found / amplitude - 1.0), hz))
    return worst


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--range", default="0.1:3:10")
    parser.add_argument("--amplitude", default="5e-4:7e-3")
    parser.add_argument("--points", default="60")
    parser.add_argument("--response", nargs="*", default=["0.3", "1", "2"], help="forces, N, whose responses are compared")
    parser.add_argument("--set", action="append", default=[])
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows("backbone", os.path.join(folder, "first"), asked.set, ["--amplitude", "1e-4:2e-4", "--points", "2"])
        of_backbone = ["--amplitude", asked.amplitude, "--points", asked.points]
        backbone, backbone_s = rows("backbone", os.path.join(folder, "backbone"), asked.set, of_backbone)
        peaks, peaks_s = rows("peaks", os.path.join(folder, "peaks"), asked.set, ["--over", f"{KEY}={asked.range}"])
        responses = []
        for force in asked.response:
            sets = asked.set + [f"{KEY}={force}"]
            own, _ = rows("backbone", os.path.join(folder, "of_force"), sets, of_backbone)
            curve = ["response.times_first_linear_mode=[0.98, 1.02]", "response.points=600"]
            response, _ = rows("run", os.path.join(folder, "run"), sets + curve, ["--no-fields"])
            responses.append((force, beside_response(own, response)))
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
    print("\n| force, N | above half of the peak, below it in frequency | above it | above a fifth, below | above |")
    print("| --- | --- | --- | --- | --- |")
    for force, worst in responses:
        words = [f"{100.0 * worst[key][0]:.2f} %" if (key := (share, above)) in worst else "–" for share in (0.5, 0.2) for above in (False, True)]
        print(f"| {force} | {' | '.join(words)} |")
    print(f"\n{len(backbone)} amplitudes in {backbone_s:.1f} s, {len(peaks)} peaks in {peaks_s:.1f} s")


if __name__ == "__main__":
    main()
