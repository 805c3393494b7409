#!/usr/bin/env python3
"""The blade's interior solved by conjugate gradients with algebraic multigrid, in place of a factor.

    benches/beyond/mumps.sh MESH...                                    # writes target/beyond/NAME.matrix
    target/venv/bin/python benches/beyond/multigrid.py target/beyond/NAME.matrix... [--tolerance 1e-8]

Smoothed aggregation (PyAMG) from the six rigid motions of the nodes, to a relative residual. PyAMG is installed by pip in
target/beyond/site where it is missing. The table has processor seconds and what the levels keep; the last rows of MUMPS in mumps.sh
have the factor of the same matrix. Needs numpy and scipy.
"""

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import scipy.sparse

SITE = Path(__file__).resolve().parents[2] / "target/beyond/site"
if not (SITE / "pyamg").exists():
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(SITE), "pyamg"], check=True)
sys.path.append(str(SITE))
import pyamg  # noqa: E402

sys.path.append(str(Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402


def read(path):
    """Stiffness, and the places of the nodes, of a file of blade_matrix.py."""
    with open(path, "rb") as file:
        n, entries = np.fromfile(file, np.int64, 2)
        offsets, rows = np.fromfile(file, np.int64, n + 1), np.fromfile(file, np.int64, entries)
        values = np.fromfile(file, np.float64, entries)
        np.fromfile(file, np.int64, 1)
        stiffness = scipy.sparse.csr_matrix((values, rows.astype(np.int32), offsets.astype(np.int32)), shape=(n, n))
        return stiffness, np.fromfile(file, np.float64).reshape(-1, 3)


def rigid_motions(places):
    motions = np.zeros((3 * len(places), 6))
    x, y, z = (places - places.mean(axis=0)).T
    for axis in range(3):
        motions[axis::3, axis] = 1
    motions[1::3, 3], motions[2::3, 3] = -z, y
    motions[0::3, 4], motions[2::3, 4] = z, -x
    motions[0::3, 5], motions[1::3, 5] = -y, x
    return motions


def kept_bytes(matrix):
    return sum(part.nbytes for part in (matrix.data, matrix.indices, matrix.indptr))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matrices", nargs="+", type=Path)
    parser.add_argument("--tolerance", type=float, default=1e-8)
    arguments = parser.parse_args()
    print("| unknowns | levels | setup, s | iterations | a solve, s | K, MB | levels beside K, MB | peak, MiB | residual |")
    print("|" + " --- |" * 9)
    for path in arguments.matrices:
        k, places = read(path)
        begun = time.process_time()
        blocked = k.tobsr(blocksize=(3, 3))
        smoother = ("gauss_seidel", {"sweep": "symmetric"})
        levels = pyamg.smoothed_aggregation_solver(
            blocked, rigid_motions(places), strength=("symmetric", {"theta": 0.08}), max_coarse=500, presmoother=smoother, postsmoother=smoother
        )
        setup = time.process_time() - begun
        b, history = np.sin(np.arange(k.shape[0])), []
        begun = time.process_time()
        x = levels.solve(b, tol=arguments.tolerance, accel="cg", maxiter=1000, residuals=history)
        solve = time.process_time() - begun
        beside = sum(kept_bytes(part) for level in levels.levels for part in (level.A, getattr(level, "P", None), getattr(level, "R", None))
                     if part is not None and part is not blocked)  # fmt: skip
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        error = np.linalg.norm(k @ x - b) / np.linalg.norm(b)
        print(f"| {k.shape[0]} | {len(levels.levels)} | {setup:.1f} | {len(history) - 1} | {solve:.1f} | {kept_bytes(blocked) / 1e6:.0f}"
              f" | {beside / 1e6:.0f} | {peak:.0f} | {error:.1e} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    print(origin.line() + "\n")
    sys.exit(main())
