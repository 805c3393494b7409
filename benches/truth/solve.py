"""Solves one model with the Python package in a process of its own: JSON from standard input to standard output."""

import json
import sys
import time

import numpy as np


def problem(dovetail, model):
    pairs = []
    for p in model["pairs"]:
        keys = {k: p[k] for k in ("friction", "gap_m", "preload_n", "normal_stiffness_n_m", "tangential_stiffness_n_m") if p[k] is not None}
        if p["against"] is not None:
            keys["against"] = tuple(p["against"])
        if p["frame"] is not None:
            keys["frame"] = np.array(p["frame"])
        pairs.append(dovetail.Pair(tuple(p["unknowns"]), **keys))
    excitation = {int(h): np.array(f["re"]) + 1j * np.array(f["im"]) for h, f in model["excitation"].items()}
    observe = {f"o{i}": np.array(o) for i, o in enumerate(model["observe"])}
    return dovetail.Problem.from_matrices(np.array(model["K"]), np.array(model["M"]), pairs, excitation=excitation, observe=observe,
                                          static_load=np.array(model["static_load"]), damping=model["damping"], modes=len(model["K"]))


def relative(error, of):
    """Largest error of a figure relative to the largest figure; NaN where one has no finite value."""
    size = np.abs(np.atleast_1d(of)).max()
    return [float(np.abs(np.atleast_1d(error)).max() / size) if size > 0 else 0.0]


def point(response, i):
    motion = response[i]
    found = {"outcome": response.outcome[i], "has_motion": motion.has_motion}
    if motion.has_motion:
        force, x, stability = motion.contact_force_n, motion.relative_displacement_m, motion.stability()
        found |= {
            "harmonics": motion.harmonics, "stable": stability.stable, "stability": repr(stability), "amplitude_m": motion.amplitude_m.tolist(),
            "estimated": {
                "amplitude": motion.estimated_error.tolist(),
                "friction power": relative(motion.friction_power_error_w, motion.friction_power_w),
                "slip": relative(motion.slid_error_m, motion.slid_m),
                "force": relative(motion.compression_max_error_n, motion.compression_max_n),
            },
            "friction_power_w": motion.friction_power_w, "damping_w": motion.viscous_power_w, "slid_m": motion.slid_m.tolist(),
            "most_n": motion.compression_max_n.tolist(), "retention_n": motion.retention_n, "status": motion.status,
            "force": [force.real.tolist(), force.imag.tolist()], "x": [x.real.tolist(), x.imag.tolist()],
        }
    return found


def main():
    task = json.load(sys.stdin)
    if task["python"]:
        sys.path.insert(0, task["python"])
    import dovetail

    start = time.process_time()
    try:
        response = problem(dovetail, task["model"]).response(task["model"]["frequency_hz"], accuracy=task["accuracy"], progress=False)
    except dovetail.Error as error:
        json.dump({"error": str(error)}, sys.stdout)
        return
    seconds = time.process_time() - start
    json.dump({"points": [point(response, i) for i in range(len(response))], "seconds": seconds}, sys.stdout)


if __name__ == "__main__":
    main()
