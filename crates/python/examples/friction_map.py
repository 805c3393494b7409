"""Map of the peak over friction and force.

    python crates/python/examples/friction_map.py tests/data/dovetail72
"""

import sys

import numpy as np

import dovetail


def main(folder="tests/data/dovetail72", frictions=(0.05, 0.1, 0.2, 0.4), forces_n=(0.5, 1.0, 2.0)):
    peaks = np.empty((len(forces_n), len(frictions)))
    scene = {
        "name": "map",
        "reduced_model": {"folder": folder, "friction": 0.3, "force_n": 1.0},
        "damping": {"ratio": 0.001},
        "response": {"times_first_linear_mode": [0.99, 1.005], "harmonics": 1, "samples": 64},
    }
    for row, force_n in enumerate(forces_n):
        at_force = dovetail.Scene(scene).with_keys({"reduced_model.force_n": force_n})
        found = at_force.peaks("reduced_model.friction", frictions, progress=False, cache=False)
        # Values that were added to find the least peak are left out of the map.
        asked = [list(found.value).index(friction) for friction in frictions]
        peaks[row] = found.amplitude_m[asked] / force_n
    print("peak of 1 N, m/N, over friction (columns) and force (rows, N)")
    print("        " + "".join(f"{friction:>11}" for friction in frictions))
    for force_n, row in zip(forces_n, peaks):
        print(f"{force_n:>8}" + "".join(f"{peak:>11.3e}" for peak in row))
    return peaks


if __name__ == "__main__":
    main(*sys.argv[1:])
