#!/usr/bin/env python3
"""Writes the reduced models of the scenes in scenes/verification: three problems with an answer in closed form.

    python3 scripts/closed_form_models.py                       # all three, beside their scenes
    python3 scripts/closed_form_models.py bar FOLDER ELEMENTS   # the bar with another number of elements

Each folder holds what crates/superelement/src/lib.rs lists: per pair N, t1, t2. The preload N is constant, so that
friction * N is the limit of sliding. Stiffnesses are of the order of 1 N/m and the mass is 1 / (2 pi)^2 kg: the
mass alone on its spring has 1 Hz.
"""

import json
import math
import sys
from pathlib import Path

from name_reduced_model import description

MASS = 1 / (2 * math.pi) ** 2


def write(folder, **arrays):
    folder.mkdir(parents=True, exist_ok=True)
    for name, rows in arrays.items():
        rows = [row if isinstance(row, list) else [row] for row in rows]
        lines = ["%%MatrixMarket matrix array real general", f"{len(rows)} {len(rows[0])}"]
        lines += [repr(float(row[j])) for j in range(len(rows[0])) for row in rows]
        (folder / f"{name}.mtx").write_text("\n".join(lines) + "\n")
    contents = description(len(arrays["positions"]), len(arrays.get("squared_frequencies", [])))
    (folder / "model.json").write_text(json.dumps(contents, indent=2) + "\n")


def diagonal(values):
    return [[v if i == j else 0.0 for j in range(len(values))] for i, v in enumerate(values)]


def den_hartog(folder):
    """A mass on a spring that rubs on the ground: no modes, the pair is the mass."""
    write(
        folder,
        stiffness=diagonal([1.0, 1.0, 1.0]),
        mass=diagonal([MASS] * 3),
        static_load=[-1.0, 0.0, 0.0],
        excitations=[0.0, 1.0, 0.0],
        observed_points=[0.0, 1.0, 0.0],
        positions=[[0.0, 0.0, 0.0]],
    )


def jenkins(folder, k=1.0, kd=0.5):
    """A mass u on a spring k to the ground and on a spring kd to a massless slider X.

    Statically u = psi X with psi = kd / (k + kd); with the slider held the mass vibrates at w^2 = (k + kd) / m.
    """
    psi = kd / (k + kd)
    stiffness = k * psi
    write(
        folder,
        stiffness=diagonal([1.0, stiffness, stiffness]),
        mass=diagonal([0.0, psi**2 * MASS, 0.0]),
        coupling=[0.0, psi * math.sqrt(MASS), 0.0],
        squared_frequencies=[(k + kd) / MASS],
        static_load=[-1.0, 0.0, 0.0],
        excitations=[0.0, psi, 0.0],
        excitations_on_modes=[1 / math.sqrt(MASS)],
        observed_points=[0.0, psi, 0.0],
        observed_points_on_modes=[1 / math.sqrt(MASS)],
        positions=[[0.0, 0.0, 0.0]],
    )


def bar(folder, elements):
    """A massless bar, E A = L = 1, on a rough floor: a node per pair, t1 along the bar, the force on the first."""
    nodes, h = elements + 1, 1 / elements
    shares = [h / 2 if i in (0, elements) else h for i in range(nodes)]
    diagonals = [1 / h if i in (0, elements) else 2 / h for i in range(nodes)]
    stiffness = diagonal([v for d in diagonals for v in (d, d, d)])
    for i in range(elements):
        a, b = 3 * i + 1, 3 * i + 4
        stiffness[a][b] = stiffness[b][a] = -1 / h
    unit = [0.0] * (3 * nodes)
    unit[1] = 1.0
    write(
        folder,
        stiffness=stiffness,
        mass=diagonal([0.0] * (3 * nodes)),
        static_load=[v for share in shares for v in (-share, 0.0, 0.0)],
        excitations=unit,
        observed_points=unit,
        positions=[[i * h, 0.0, 0.0] for i in range(nodes)],
    )


def main(arguments):
    scenes = Path(__file__).resolve().parent.parent / "scenes" / "verification"
    match arguments:
        case []:
            den_hartog(scenes / "den_hartog")
            jenkins(scenes / "jenkins")
            bar(scenes / "microslip_bar", 9)
        case ["bar", folder, elements] if elements.isdigit() and int(elements) > 1:
            bar(Path(folder), int(elements))
        case _:
            sys.exit(__doc__)


main(sys.argv[1:])
