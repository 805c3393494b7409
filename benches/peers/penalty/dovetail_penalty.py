"""dovetail on the examples: dovetail_penalty.py OUT.json

The matrices of each example go to the Python package of dovetail as they are.
"""

import json
import sys
from pathlib import Path

import dovetail
import numpy as np
from examples import EXAMPLES

SAMPLES = 1024
# Harmonics (those of the example where None) and eps_scale. eps is the stiffness that the harmonics left out feel (docs/method.md).
# The peers keep them at rest, and so does a large one.
RUNS = {"dovetail": (None, 1e4), "dovetail, own eps": (None, 1.0), "dovetail, 31 harmonics": (31, 1.0)}


def problem(example):
    """The example with a pair that opens along its normal, where the example presses."""
    sign = np.ones(len(example.K))
    steady = np.zeros(len(example.K))
    if example.normal is not None:
        sign[example.normal] = -1.0
        steady[example.normal] = -example.preload
    observed = np.zeros(len(example.K))
    observed[example.observed] = sign[example.observed]
    pair = dovetail.Pair(
        (example.normal, example.tangential, None),
        friction=example.mu,
        gap_m=example.gap,
        normal_stiffness_n_m=example.kn,
        tangential_stiffness_n_m=example.kt,
        preload_n=0.0 if example.normal is not None else example.preload,
    )
    a, b = example.damping
    return dovetail.Problem.from_matrices(
        np.outer(sign, sign) * example.K,
        np.outer(sign, sign) * example.M,
        [pair],
        excitation=sign * example.force,
        observe={"tip": observed},
        static_load=steady,
        damping={"stiffness_s": a, "mass_per_s": b},
    )


def response(example, level, frequencies, harmonics, eps_scale, **options):
    return problem(example).with_excitation_times(level).response(
        frequencies,
        harmonics=harmonics,
        samples=SAMPLES,
        eps_scale=eps_scale,
        tolerance=1e-10,
        progress=False,
        **options,
    )


def folds(example, harmonics, eps_scale):
    """Frequencies at which the curve turns back, rad/s."""
    ends = np.array(example.followed) / (2 * np.pi)
    curve = response(example, 1.0, ends, harmonics, eps_scale, follow=True)
    w = 2 * np.pi * curve.frequency_hz
    return [float(here) for before, here, after in zip(w, w[1:], w[2:]) if (here - before) * (after - here) < 0]


def run(example, harmonics, eps_scale):
    groups = {}
    for level, w in example.cases:
        groups.setdefault(level, []).append(w)
    rows = []
    for level, omegas in groups.items():
        found = response(example, level, np.array(omegas) / (2 * np.pi), harmonics, eps_scale)
        if not found.converged.all():
            sys.exit(f"{example.name}: {found.outcome}")
        if found.retention_n.any():
            sys.exit(f"{example.name}: dovetail held a mean, the others do not: another problem")
        motions = found.observed_m("tip")[:, 1 : harmonics + 1]
        counts = found.pair_counts
        for at, w in enumerate(omegas):
            opens = int(counts["opening"][at] + counts["closing"][at])
            cosine, sine = motions[at].real.tolist(), (-motions[at].imag).tolist()
            rows.append(dict(level=level, w=w, slips=int(counts["slipping"][at]), opens=opens, cosine=cosine, sine=sine))
    return rows


def main():
    found = {}
    for name, (harmonics, eps_scale) in RUNS.items():
        found[name] = {e.name: run(e, harmonics or e.harmonics, eps_scale) for e in EXAMPLES}
    followed = [example for example in EXAMPLES if example.followed]
    found["dovetail's folds"] = {
        name: {e.name: folds(e, harmonics or e.harmonics, eps_scale) for e in followed}
        for name, (harmonics, eps_scale) in RUNS.items()
    }
    Path(sys.argv[1]).write_text(json.dumps(found))


if __name__ == "__main__":
    main()
