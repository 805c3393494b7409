#!/usr/bin/env python3
"""Seconds of CalculiX for one linear static step of the blade, its flanks fixed, under rotation: in all, and
from the beginning of the factorisation to the displacements.

    python3 linear_static.py MESH.msh... [--speed-rpm 5000]

One thread, SPOOLES. The equations are those of `cargo bench --bench solvers -- solve` with one right-hand side in
place of 256. Needs python3 (standard library only), ccx and stdbuf.
"""

import argparse
import math
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import blade_modes
import deck

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402


def processor_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure(mesh, speed_rpm, folder):
    """Equations, seconds of factorisation and solution, processor seconds in all."""
    lines = blade_modes.case(mesh, 1, 0.0)
    lines = lines[:lines.index("*STEP")]
    lines += ["*STEP", "*STATIC, SOLVER=SPOOLES", *deck.centrifugal("BLADE", speed_rpm * math.pi / 30.0),
              "*NODE PRINT, NSET=FLANKS, TOTALS=ONLY", "RF", "*END STEP"]
    (pathlib.Path(folder) / "static.inp").write_text("\n".join(lines) + "\n")
    environment = dict(os.environ, OMP_NUM_THREADS="1", CCX_NPROC_EQUATION_SOLVER="1")
    before = processor_s()
    program = subprocess.Popen(["stdbuf", "-oL", "ccx", "static"], cwd=folder, env=environment, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    equations, started, solved = None, None, None
    last = ""
    for line in program.stdout:
        if "number of equations" in last:
            equations = int(line)
        if line.strip():
            last = line
        if "Factoring" in line:
            started = time.monotonic()
        elif started and solved is None and ("average" in line or "Job finished" in line or "Total CalculiX" in line):
            solved = time.monotonic()
    if program.wait() != 0 or equations is None or started is None or solved is None:
        raise SystemExit(f"{mesh}: ccx failed or says other things than expected; last: {last}")
    return equations, solved - started, processor_s() - before


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("meshes", nargs="+", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--speed-rpm", type=float, default=5000.0)
    given = parser.parse_args()
    if shutil.which("ccx") is None:
        raise SystemExit("ccx not found: install CalculiX (apt-get install calculix-ccx)")
    print(f"load {os.getloadavg()[0]:.1f}\n\n| equations | factor, one solution and results, wall s | whole run, processor s |\n| --- | --- | --- |")
    for mesh in given.meshes:
        with tempfile.TemporaryDirectory() as folder:
            equations, solved, whole = measure(mesh, given.speed_rpm, folder)
        print(f"| {equations} | {solved:.2f} | {whole:.2f} |", flush=True)


if __name__ == "__main__":
    print(origin.line() + "\n")
    main()
