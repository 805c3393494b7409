"""pyHarm (PyPI: pyHarm-os) on the examples: pyharm_penalty.py OUT.json

Its elements, its march and its derivatives, by its frequency response at given frequencies with scipy's hybrid Powell method. What is
described otherwise than in its examples:
- double precision (JAX_ENABLE_X64): in pyHarm's single precision Penalty3D reaches no residual of 1e-9;
- in `friction` the constant normal force is the preload N0 of Penalty3D, as its sign convention asks for, and displacements are
  measured from rest. Penalty3D has no friction with N0 = 0, and its normal force jumps where the pair lifts off with N0 > 0: the
  cases that lift off are left out.
"""

import json
import logging
import os
import sys

os.environ["JAX_ENABLE_X64"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

import numpy as np  # noqa: E402
from examples import EXAMPLES, FRICTION, GAP, SAMPLES, TWO_MASSES, TWO_MASSES_C  # noqa: E402
from pyHarm import Maestro  # noqa: E402

# Levels of `friction` at which the pair never lifts off.
PRESSED = [25.0, 80.0]


def contact(example):
    """The contact element of an example, which works between one node and the ground."""
    if example is GAP:
        return dict(type="PenaltyUnilateralGap", connect={"body": [0]}, dirs=[0], g=example.gap, k=example.kn)
    if example is FRICTION:
        # At rest both springs in parallel carry the load.
        pressed = example.preload * example.kn / (example.kn + example.K[example.normal, example.normal])
        springs = dict(k_n=example.kn, k_t=example.kt, mu=example.mu, N0=pressed, g=0.0)
        # The element opens along its first direction.
        return dict(type="Penalty3D", connect={"body": [0]}, dirs=[0, 1, 2], **springs)
    return dict(
        type="Jenkins", connect={"body": [example.tangential]}, dirs=[0], mu=example.mu, N0=example.preload, k=example.kt
    )


def matrices(example, C):
    """M, C, K, the force and the coordinates of a node: (opening, tangential, a third one that nothing moves) for Penalty3D."""
    if example is not FRICTION:
        return example.M, C, example.K, example.force, 1
    change = np.zeros((3, 3))
    change[example.normal, 0], change[example.tangential, 1], change[2, 2] = -1.0, 1.0, 1.0
    pad = lambda matrix: change.T @ np.block([[matrix, np.zeros((2, 1))], [np.zeros((1, 2)), np.eye(1)]]) @ change
    return pad(example.M), pad(C), pad(example.K), change.T @ np.pad(example.force, (0, 1)), 3


def study_of(example, samples, level, C, length_m=1.0, **analysis):
    """A frequency response of pyHarm with these options, in units of a length; its M, K, force and observed coordinate."""
    M, C, K, force, node = matrices(example, C)
    observed = 1 if example is FRICTION else example.observed
    loads = {
        f"load{i}": dict(type="CosinusForcing", connect={"body": [i // node]}, dirs=[i % node], amp=float(level * value))
        for i, value in enumerate(force)
        if value
    }
    description = dict(
        system=dict(type="Base", nh=example.harmonics, nti=samples, adim=dict(status=True, lc=length_m, wc=1.0)),
        substructures=dict(body=dict(matrix=dict(M=M, C=C, K=K, G=0 * M), ndofs=node)),
        connectors=loads | dict(contact=contact(example)),
        analysis=dict(
            frf=dict(
                study="frf",
                solver="scipyroot",
                solver_options=dict(root=dict(method="hybr", options=dict(xtol=1e-10, maxfev=2000))),
                reductors=[dict(type="noreductor")],
                verbose=False,
            )
            | analysis
        ),
    )
    return Maestro(description).nls["frf"], M, K, force, observed


def respond(example, samples, level, omegas, C):
    """Motions at given frequencies, each from that of the one before."""
    study, M, K, force, observed = study_of(
        example, samples, level, C, predictor="previous", corrector="nocontinuation", stepsizer="constant",
        predictor_options=dict(bifurcation_detect=False),
        puls_inf=min(omegas), puls_sup=max(omegas) + 1.0, puls_start=omegas[0], ds0=1.0,
    )
    C = matrices(example, C)[1]
    n, m = len(K), 2 * example.harmonics + 1
    accepted, rows = None, []
    for w in omegas:
        if accepted is None:
            # From the motion without contact.
            motion = np.linalg.solve(K - w**2 * M + 1j * w * C, level * force)
            start = np.zeros((m, n))
            start[1], start[2] = motion.real, -motion.imag
            study.initialise(start.ravel())
        else:
            study.ds = w - accepted
            study.makeStep()
        solution = study.SolList[-1]
        # Where its solver stops for want of progress, the step is not accepted: the next one starts from the last that was.
        if accepted is None or solution.flag_accepted:
            accepted = solution.x[-1]
        residual = np.linalg.norm(study.system.Residual(solution.x)) / np.linalg.norm(level * force)
        if residual > 1e-8 or abs(solution.x[-1] - w) > 1e-9:
            sys.exit(f"pyHarm, {example.name}, {w} rad/s: residual {residual:.1e}")
        U = solution.x[:-1].reshape(m, n)[:, observed]
        rows.append(dict(level=level, w=w, mean=U[0], cosine=list(U[1::2]), sine=list(U[2::2])))
    return rows


def folds(example, samples, step):
    """Frequencies at which the curve turns back, by its continuation along the length in steps of `step` at most.

    Both are those of single points: step by step, the frequency changes by less than 1e-3 there.
    """
    first, last = example.followed
    # Its unit of length, and the predictor that sees a fold, are those of the published example.
    study, *_ = study_of(
        example, samples, 1.0, example.C, length_m=example.gap, predictor="tangent", corrector="arc_length",
        stepsizer="acceptance", puls_inf=first, puls_sup=last, puls_start=first, ds0=step, ds_max=step,
    )
    study.Solve("null")
    w = np.array([solution.x[-1] for solution in study.SolList if solution.flag_accepted])
    highest = int(np.argmax(w[: np.flatnonzero(np.diff(w) < -0.1 * step)[-1] + 1]))
    return [float(w[highest]), float(w[highest:].min())]


def of(example, samples, C=None, cases=None):
    groups, rows = {}, []
    for level, w in cases or example.cases:
        if example is not FRICTION or level in PRESSED:
            groups.setdefault(level, []).append(w)
    for level, omegas in groups.items():
        rows += respond(example, samples, level, omegas, example.C if C is None else C)
    return rows


def main():
    logging.disable(logging.INFO)
    found = {f"pyHarm, {samples} samples": {e.name: of(e, samples) for e in EXAMPLES} for samples in SAMPLES}
    # Its published curves, with the samples and the damping that they have, in small steps.
    found["published"] = {}
    for example, C in [(GAP, None), (TWO_MASSES, TWO_MASSES_C)]:
        first, last = min(example.published), max(example.published)
        steps = sorted({*np.arange(first, last, 0.05), *example.published})
        rows = of(example, 1024, C=C, cases=[(1.0, float(w)) for w in steps])
        found["published"][example.name] = [row for row in rows if row["w"] in example.published]
    found["folds"] = {GAP.name: folds(GAP, SAMPLES[-1], 0.01)}
    with open(sys.argv[1], "w") as file:
        json.dump(found, file)


if __name__ == "__main__":
    main()
