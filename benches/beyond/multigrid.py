#!/usr/bin/env python3
"""The blade's interior solved by conjugate gradients with algebraic multigrid, in place of a factor.

    benches/beyond/mumps.sh MESH...                                    # writes target/beyond/NAME.matrix
    target/venv/bin/python benches/beyond/multigrid.py target/beyond/NAME.matrix...

Smoothed aggregation (PyAMG) from the six rigid motions of the nodes, to a relative residual of 1e-8. The table has processor seconds,
and what the matrix and the levels keep; the last rows of MUMPS in mumps.sh have the factor of the same matrix. Needs numpy, scipy and
pyamg (target/venv/bin/pip install pyamg).
"""

import sys
import time
from pathlib import Path

import numpy as np
import pyamg
import scipy.sparse

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


def kept_mb(matrix):
    return sum(part.nbytes for part in (matrix.data, matrix.indices, matrix.indptr)) / 1e6


def main():
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    print("| unknowns | setup, s | iterations | a solve, s | K and levels, MB | residual |")
    print("|" + " --- |" * 6)
    for path in sys.argv[1:]:
        k, places = read(path)
        begun = time.process_time()
        smoother = ("gauss_seidel", {"sweep": "symmetric"})
        solver = pyamg.smoothed_aggregation_solver(
            k.tobsr(blocksize=(3, 3)), rigid_motions(places), strength=("symmetric", {"theta": 0.08}), max_coarse=500,
            presmoother=smoother, postsmoother=smoother,
        )  # fmt: skip
        set_up = time.process_time()
        b, history = np.sin(np.arange(k.shape[0])), []
        x = solver.solve(b, tol=1e-8, accel="cg", maxiter=1000, residuals=history)
        solved = time.process_time()
        parts = [getattr(level, name) for level in solver.levels for name in "APR" if hasattr(level, name)]
        error = np.linalg.norm(k @ x - b) / np.linalg.norm(b)
        print(f"| {k.shape[0]} | {set_up - begun:.1f} | {len(history) - 1} | {solved - set_up:.1f} | {sum(map(kept_mb, parts)):.0f}"
              f" | {error:.1e} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    print(origin.line() + "\n")
    main()
