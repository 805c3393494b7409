"""dovetail on the examples: dovetail_penalty.py DOVETAIL WORK OUT.json

Each example becomes a folder of a reduced model and a scene for each level of its force.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from examples import EXAMPLES
from scipy.linalg import eigh
from scipy.io import mmwrite

SAMPLES = 1024
# Harmonics (those of the example where None) and eps_scale. eps is the stiffness that the harmonics left out feel (docs/method.md).
# The peers keep them at rest, and so does a large one.
RUNS = {"dovetail": (None, 1e4), "dovetail, own eps": (None, 1.0), "dovetail, 31 harmonics": (31, 1.0)}


def condensed(example):
    """The files of a reduced model with one pair: X is (gap, tangential 1, tangential 2), the rest is condensed with its modes.

    Coordinates of the pair that the example lacks get a unit spring and a unit mass that nothing else moves.
    """
    places = [(example.normal, -1.0), (example.tangential, 1.0), (None, 1.0)]
    kept = [place if place[0] is not None else None for place in places]
    inner = [i for i in range(len(example.K)) if i not in [place[0] for place in kept if place]]
    n, free, all_of = len(example.K), kept.count(None), len(example.K) + kept.count(None)
    extended = [np.block([[matrix, np.zeros((n, free))], [np.zeros((free, n)), np.eye(free)]]) for matrix in (example.K, example.M)]
    change, filler = np.zeros((all_of, all_of)), iter(range(n, all_of))
    for column, place in enumerate(kept):
        index, sign = place or (next(filler), 1.0)
        change[index, column] = sign
    for column, index in enumerate(inner, 3):
        change[index, column] = 1.0
    K, M = (change.T @ matrix @ change for matrix in extended)
    force = change.T @ np.pad(example.force, (0, free))
    observed = change[example.observed]
    steady = np.zeros(3)
    # A pair without a normal coordinate: its unit spring and the contact's share what presses.
    steady[0] = -example.preload * (1.0 if example.normal is not None else 1.0 + 1.0 / example.kn)
    psi = -np.linalg.solve(K[3:, 3:], K[3:, :3])
    w2, phi = eigh(K[3:, 3:], M[3:, 3:]) if inner else (np.zeros(0), np.zeros((0, 0)))
    onto = np.vstack([np.eye(3), psi])
    files = dict(
        stiffness=onto.T @ K @ onto,
        mass=onto.T @ M @ onto,
        static_load=steady,
        excitations=onto.T @ force,
        observed_points=onto.T @ observed,
        positions=np.zeros((1, 3)),
    )
    if inner:
        files |= dict(
            coupling=(onto.T @ M)[:, 3:] @ phi,
            squared_frequencies=w2,
            excitations_on_modes=phi.T @ force[3:],
            observed_points_on_modes=phi.T @ observed[3:],
        )
    return files


def scene(example, level, omegas, harmonics, eps_scale, grid=True):
    """Scene over these frequencies: a grid, or the curve that is followed."""
    a, b = example.damping
    hertz = [w / (2 * np.pi) for w in (omegas[0], omegas[-1])]
    points = f"points = {len(omegas)}" if grid else ""
    return f"""name = "{example.name}"

[reduced_model]
folder = "{example.name}"
friction = {example.mu}
normal_stiffness_n_m = {example.kn}
tangential_stiffness_n_m = {example.kt}
gap_m = {example.gap}
force_n = {level}

[damping]
stiffness_s = {a!r}
mass_per_s = {b!r}

[response]
frequency_hz = {hertz}
{points}
harmonics = {harmonics}
samples = {SAMPLES}
tolerance = 1e-10
eps_scale = {eps_scale}
"""


def compute(dovetail, path, results):
    command = [dovetail, "run", path, "--threads", "1", "--quiet", "--out", results]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{path}: {done.stdout}{done.stderr}")


def folds(dovetail, work, example, harmonics, eps_scale):
    """Frequencies at which the curve turns back, rad/s."""
    path, results = work / f"{example.name}_followed.toml", work / "output" / f"{example.name}_followed"
    path.write_text(scene(example, 1.0, example.followed, harmonics, eps_scale, grid=False))
    compute(dovetail, path, results)
    summary = json.loads((results / "summary.json").read_text())
    return [2 * np.pi * fold["frequency_hz"] for fold in summary["response"]["folds"]]


def run(dovetail, work, example, harmonics, eps_scale):
    folder = work / example.name
    folder.mkdir(parents=True, exist_ok=True)
    files = condensed(example)
    for name, array in files.items():
        mmwrite(folder / f"{name}.mtx", array if array.ndim == 2 else array[:, None], precision=17)
    described = {
        "format": "reduced model of dovetail",
        "units": {"length": "m", "mass": "kg", "time": "s", "force": "N"},
        "pairs": 1,
        "modes": len(files.get("squared_frequencies", [])),
        "contacts": [{"name": "pairs", "pairs": 1}],
        "excitations": [{"name": "force", "harmonic": 1, "amplitude": 1.0, "phase_rad": 0.0}],
        "observed_points": ["tip"],
    }
    (folder / "model.json").write_text(json.dumps(described))
    # The cases of one level lie at even distances.
    groups = {}
    for level, w in example.cases:
        groups.setdefault(level, []).append(w)
    rows = []
    for level, omegas in groups.items():
        path, results = work / f"{example.name}.toml", work / "output" / example.name
        path.write_text(scene(example, level, omegas, harmonics, eps_scale))
        compute(dovetail, path, results)
        with open(results / "response.csv") as file:
            for row in csv.DictReader(file):
                if float(row["retention_n"]) != 0.0:
                    sys.exit(f"{example.name}: dovetail held a mean, the others do not: another problem")
                motion = [
                    float(row[f"tip_h{k}_amplitude_m"]) * np.exp(1j * float(row[f"tip_h{k}_phase_rad"]))
                    for k in range(1, harmonics + 1)
                ]
                rows.append(
                    dict(level=level, w=2 * np.pi * float(row["frequency_hz"]), slips=int(row["slipping_pairs"]))
                    | dict(opens=int(row["opening_pairs"]) + int(row["closing_pairs"]))
                    | dict(cosine=[z.real for z in motion], sine=[z.imag for z in motion])
                )
    return rows


def main():
    dovetail, work, out = sys.argv[1:]
    found = {}
    for name, (harmonics, eps_scale) in RUNS.items():
        found[name] = {e.name: run(dovetail, Path(work), e, harmonics or e.harmonics, eps_scale) for e in EXAMPLES}
    followed = [example for example in EXAMPLES if example.followed]
    found["dovetail's folds"] = {
        name: {e.name: folds(dovetail, Path(work), e, harmonics or e.harmonics, eps_scale) for e in followed}
        for name, (harmonics, eps_scale) in RUNS.items()
    }
    Path(out).write_text(json.dumps(found))


if __name__ == "__main__":
    main()
