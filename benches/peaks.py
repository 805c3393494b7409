"""Peaks over a key by `dovetail peaks`, beside the peaks of whole curves at each of its values.

    cargo build --release
    python3 benches/peaks.py [--key KEY] [--range FROM:TO:N] [--set KEY=VALUE]...

Prints a table for docs/verification.md: the largest difference in amplitude and in frequency, the motions that were
solved, and the seconds of the peaks over those of the sweeps of 200 frequencies that would find them, of which the first
and the last value are run. Both take the reduced model from the cache. Standard library only.
"""

import argparse
import csv
import json
import os
import re
import subprocess
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = os.path.join(ROOT, "target/release/dovetail")
SCENE = os.path.join(ROOT, "scenes/paper.toml")
READY = ["mesh.file=../meshes/dovetail.msh", "response.times_first_linear_mode=[0.95, 1.01]", "response.compare_harmonics="]


def dovetail(command, out, settings, rest=()):
    """Runs the program; returns its output and seconds."""
    words = [PROGRAM, command, SCENE, "--out", out, *rest]
    for setting in READY + settings:
        words += ["--set", setting]
    begin = time.perf_counter()
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode not in (0, 3):
        raise SystemExit(done.stderr)
    return done.stdout, time.perf_counter() - begin


def rows(path):
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(file))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--key", default="excitation.*.force_n")
    parser.add_argument("--range", default="0.1:20:20")
    parser.add_argument("--set", action="append", default=[])
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        of = lambda name: os.path.join(folder, name)
        dovetail("static", of("first"), asked.set)
        told, seconds = dovetail("peaks", of("peaks"), asked.set, ["--over", f"{asked.key}={asked.range}"])
        peaks = rows(of("peaks/peaks.csv"))
        solved = int(re.search(r"(\d+) motions solved", told).group(1))
        differences, frequencies = [], []
        for peak in peaks:
            setting = f"{asked.key}={peak[asked.key]}"
            dovetail("run", of("whole"), asked.set + [setting], ["--no-fields", "--force"])
            with open(of("whole/summary.json"), encoding="utf-8") as file:
                response = json.load(file)["response"]
            differences.append(float(peak["amplitude_m"]) / response["peak_amplitude_m"] - 1.0)
            frequencies.append(float(peak["frequency_hz"]) / response["peak_frequency_hz"] - 1.0)
        sweeps = []
        for peak in (peaks[0], peaks[-1]):
            setting = f"{asked.key}={peak[asked.key]}"
            grid = asked.set + [setting, "response.points=200"]
            sweeps.append(dovetail("run", of("grid"), grid, ["--no-fields", "--force"])[1])
    worst = lambda values: max(values, key=abs)
    sweep = sum(sweeps) / len(sweeps)
    print("| key, range | peaks | amplitude | frequency | motions | seconds | 200 frequencies for each, seconds | ratio |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    print(
        f"| `{asked.key}`, {asked.range} | {len(peaks)} | {worst(differences):+.1e} | {worst(frequencies):+.1e} "
        f"| {solved} | {seconds:.1f} | {sweep * len(peaks):.0f} | {sweep * len(peaks) / seconds:.1f} |"
    )


if __name__ == "__main__":
    main()
