#!/usr/bin/env python3
"""Gives the files of a reduced model with the names K.mtx, M.mtx, ... their names in words, and writes model.json.

    python3 scripts/name_reduced_model.py FOLDER...

The model gets one contact, called pairs, one excitation cos(w t) of amplitude 1, and one observed point, called tip.
"""

import json
import sys
from pathlib import Path

NAMES = {
    "K": "stiffness",
    "M": "mass",
    "p": "coupling",
    "w2": "squared_frequencies",
    "f_static": "static_load",
    "fm_static": "static_load_on_modes",
    "f_excitation": "excitations",
    "fm_excitation": "excitations_on_modes",
    "tip_x": "observed_points",
    "tip_modes": "observed_points_on_modes",
    "area": "areas",
    "xyz": "positions",
}


def rows(path):
    """Rows of a MatrixMarket array, which the line below its comments says; 0 where it is absent."""
    if not path.exists():
        return 0
    with path.open() as file:
        return int(next(line for line in file if not line.startswith("%") and line.strip()).split()[0])


def description(pairs, modes):
    """Contents of model.json."""
    return {
        "format": "reduced model of dovetail",
        "units": {"length": "m", "mass": "kg", "time": "s", "force": "N"},
        "pairs": pairs,
        "modes": modes,
        "contacts": [{"name": "pairs", "pairs": pairs}],
        "excitations": [{"name": "force", "harmonic": 1, "amplitude": 1.0, "phase_rad": 0.0}],
        "observed_points": ["tip"],
    }


def main(folders):
    if not folders:
        sys.exit(__doc__)
    for folder in map(Path, folders):
        if not (folder / "K.mtx").exists():
            sys.exit(f"{folder} has no K.mtx: nothing was renamed in it")
        for short, name in NAMES.items():
            if (folder / f"{short}.mtx").exists():
                (folder / f"{short}.mtx").rename(folder / f"{name}.mtx")
        contents = description(rows(folder / "positions.mtx"), rows(folder / "squared_frequencies.mtx"))
        (folder / "model.json").write_text(json.dumps(contents, indent=2) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
