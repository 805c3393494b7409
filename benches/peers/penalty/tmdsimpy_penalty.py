"""tmdsimpy on the examples with a slider: tmdsimpy_penalty.py FOLDER OUT.json

FOLDER: a clone of https://github.com/tmd-lab/tmdsimpy (MIT licence; PyPI has no package). Its contact law ElasticDryFriction2D
and its residual of harmonic balance with their derivatives; Newton's method is here.
"""

import json
import os
import sys

os.environ["JAX_ENABLE_X64"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
sys.path.insert(0, sys.argv[1])

import numpy as np  # noqa: E402
from examples import FRICTION, JENKINS, SAMPLES, TWO_MASSES  # noqa: E402
from tmdsimpy.jax.nlforces.elastic_dry_fric_2d import ElasticDryFriction2D  # noqa: E402
from tmdsimpy.vibration_system import VibrationSystem  # noqa: E402


def newton(residual, U, scale):
    """Halved while the residual grows; (U, relative residual)."""
    R, J = residual(U)
    for _ in range(100):
        if np.linalg.norm(R) <= 1e-11 * scale:
            break
        step, s = np.linalg.solve(J, R), 1.0
        while True:
            R_trial, J_trial = residual(U - s * step)
            if np.linalg.norm(R_trial) < np.linalg.norm(R) or s < 1e-3:
                break
            s /= 2
        U, R, J = U - s * step, R_trial, J_trial
    return U, np.linalg.norm(R) / scale


def of(example, samples):
    M, C, K, force, steady = example.M, example.C, example.K, example.force, np.zeros(len(example.K))
    normal = example.normal
    if normal is None:
        # A normal coordinate that nothing moves: what presses is shared by its unit spring and the contact's.
        normal, pad = len(K), lambda matrix, corner: np.block(
            [[matrix, np.zeros((len(matrix), 1))], [np.zeros((1, len(matrix))), np.array([[corner]])]]
        )
        M, C, K, force = pad(M, 1.0), pad(C, 0.0), pad(K, 1.0), np.append(force, 0.0)
        steady = np.append(steady, example.preload * (1.0 + 1.0 / example.kn))
    else:
        steady[normal] = example.preload
    n = len(K)
    # (tangential, normal) of all coordinates.
    Q = np.zeros((2, n))
    Q[0, example.tangential], Q[1, normal] = 1.0, 1.0
    system = VibrationSystem(M, K, C=C)
    system.add_nl_force(ElasticDryFriction2D(Q, Q.T, example.kt, example.kn, example.mu, u0=0.0))
    h, rows, last = np.arange(example.harmonics + 1), [], None
    for level, w in example.cases:
        Fl = np.zeros(n * (2 * example.harmonics + 1))
        Fl[:n], Fl[n : 2 * n] = steady, level * force
        stuck = Q.T @ np.diag([example.kt, example.kn]) @ Q
        at_rest = np.linalg.solve(K + stuck, steady)
        motion = np.linalg.solve(K + stuck - w**2 * M + 1j * w * C, level * force)
        start = np.zeros_like(Fl)
        start[:n], start[n : 2 * n], start[2 * n : 3 * n] = at_rest, motion.real, -motion.imag
        residual = lambda U: system.hbm_res(np.append(U, w), Fl, h, Nt=samples)[:2]
        guesses = [start] if last is None or last[0] != level else [last[1], start]
        for guess in guesses:
            U, measure = newton(residual, guess, level * np.linalg.norm(force))
            if measure <= 1e-8:
                break
        else:
            sys.exit(f"tmdsimpy, {example.name}, level {level}, {w} rad/s: residual {measure:.1e}")
        last = (level, U)
        U = U.reshape(-1, n)[:, example.observed]
        rows.append(dict(level=level, w=w, mean=float(U[0]), cosine=list(U[1::2]), sine=list(U[2::2])))
    return rows


def main():
    found = {f"tmdsimpy, {samples} samples": {e.name: of(e, samples) for e in (JENKINS, TWO_MASSES, FRICTION)} for samples in SAMPLES}
    with open(sys.argv[2], "w") as file:
        json.dump(found, file)


if __name__ == "__main__":
    main()
