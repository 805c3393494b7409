"""Friction and damping that fit a measured curve, by SciPy's least squares.

The measurement is made up: the reduced blade of 72 pairs with a known coefficient of friction and a
known damping, and noise. The reduction is done once; friction is a number of the contact law.

    python crates/python/examples/fit_friction.py tests/data/dovetail72
"""

import sys

import numpy as np
from scipy.optimize import least_squares

import dovetail

FRICTION, RATIO, NOISE = 0.22, 0.0015, 0.01


def main(folder="tests/data/dovetail72", points=9):
    blade = dovetail.Problem.from_folder(folder, friction=0.3, force_n=2.0)
    first_hz = blade.static_state().linear_frequency_hz[0]
    frequencies_hz = first_hz * np.linspace(0.994, 1.004, points)

    def amplitudes(friction, ratio):
        response = blade.with_laws(friction=friction).response(
            frequencies_hz, harmonics=1, samples=64, damping={"ratio": ratio}, progress=False
        )
        return response.amplitude_m[:, 0]

    noise = 1 + NOISE * np.random.default_rng(1).standard_normal(points)
    measured = amplitudes(FRICTION, RATIO) * noise
    # Logarithms of both, which stay positive.
    fit = least_squares(
        lambda x: np.log(amplitudes(*np.exp(x)) / measured), np.log([0.4, 0.001]), diff_step=1e-3,
        xtol=1e-4, ftol=1e-6,
    )
    friction, ratio = np.exp(fit.x)
    scatter = np.sqrt(np.mean(fit.fun**2))
    print(f"friction {friction:.3f} (made up with {FRICTION}), damping {ratio:.5f} ({RATIO})")
    print(f"the curve is off by {scatter:.2%}, of which {NOISE:.0%} is noise")
    return friction, ratio, scatter


if __name__ == "__main__":
    main(*sys.argv[1:])
