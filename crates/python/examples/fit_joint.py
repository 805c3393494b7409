"""Friction, clearance and damping that fit measured curves, by SciPy's least squares.

The measurement is made up: a cantilever whose tip rubs and whose middle strikes a stop, with known
friction, clearance and damping, shaken by two forces, and noise. The matrices are condensed once:
friction and clearance are numbers of the contact law. The Jacobian of the fit says how much each
parameter moves the curves (sensitivities), how well the curves determine it (standard errors), and
how far curves of other parameters that fit as well may lie (the scatter band).

    python crates/python/examples/fit_joint.py
"""

import numpy as np
from beam import cantilever
from scipy.optimize import least_squares

import dovetail

NAMES = ["friction", "clearance_m", "damping_ratio"]
TRUTH = np.array([0.32, 1.4e-3, 0.006])
FORCES_N = (0.5, 2.0)
NOISE = 0.01


def joint():
    """The beam with a sliding point at its tip and a stop below its middle."""
    stiffness, mass = cantilever()
    tip, middle = len(stiffness) - 2, len(stiffness) // 2 - 1
    force = np.zeros(len(stiffness))
    force[tip] = 1.0
    rubbing = dovetail.Pair(
        (None, tip, None), friction=0.3, preload_n=10.0,
        normal_stiffness_n_m=1e6, tangential_stiffness_n_m=1e3,
    )
    stop = dovetail.Pair(
        (middle, None, None), friction=0.0, gap_m=1e-3,
        normal_stiffness_n_m=5e3, tangential_stiffness_n_m=1.0,
    )
    return dovetail.Problem.from_matrices(
        stiffness, mass, [rubbing, stop], excitation=force, observe={"tip": tip}, fixed=[0, 1],
        damping={"ratio": 0.005}, highest_hz=50.0,
    )


def curves_m(beam, frequencies_hz, parameters):
    """Amplitudes of the tip, a row for each force."""
    friction, clearance_m, ratio = parameters
    beam = beam.with_laws(friction=[friction, 0.0], gap_m=[0.0, clearance_m])
    return np.array([
        beam.with_excitation_times(force_n).response(
            frequencies_hz, harmonics=5, damping={"ratio": ratio}, progress=False
        ).amplitude_m[:, 0]
        for force_n in FORCES_N
    ])


def main(points=20):
    beam = joint()
    first_hz = beam.static_state().linear_frequency_hz[0]
    frequencies_hz = first_hz * np.linspace(0.6, 1.15, points)
    random = np.random.default_rng(1)
    measured_m = curves_m(beam, frequencies_hz, TRUTH)
    measured_m = measured_m * (1 + NOISE * random.standard_normal(measured_m.shape))

    # Logarithms: parameters stay positive, and errors are relative.
    def misfit(logarithms):
        found = curves_m(beam, frequencies_hz, np.exp(logarithms))
        return np.log(found / measured_m).ravel()

    # Within the bounds each parameter moves the curves: the stop is struck.
    fit = least_squares(
        misfit, np.log([0.2, 1e-3, 0.01]), bounds=np.log([[0.05, 2e-4, 1e-3], [1.0, 3e-3, 0.05]]),
        diff_step=1e-3, xtol=1e-5, ftol=1e-7,
    )
    found = np.exp(fit.x)
    # Relative change of each amplitude for a relative change of each parameter.
    sensitivities = fit.jac.reshape(len(FORCES_N), points, len(NAMES))
    noise = np.sqrt(np.sum(fit.fun**2) / (fit.fun.size - len(NAMES)))
    covariance = noise**2 * np.linalg.inv(fit.jac.T @ fit.jac)
    errors = np.sqrt(np.diag(covariance))
    band = np.sqrt(np.einsum("ijk,kl,ijl->ij", sensitivities, covariance, sensitivities))

    print("parameter           found     made up  standard error  most sensitive")
    for index, name in enumerate(NAMES):
        force, point = np.unravel_index(np.abs(sensitivities[..., index]).argmax(), band.shape)
        print(
            f"{name:14} {found[index]:10.4g}  {TRUTH[index]:10.4g}  {errors[index]:14.1%}  "
            f"{sensitivities[force, point, index]:+.2f} at {FORCES_N[force]} N, "
            f"{frequencies_hz[point]:.2f} Hz"
        )
    print(f"the curves are off by {noise:.2%}, of which {NOISE:.0%} is noise")
    print(f"the scatter band is {band.min():.2%} to {band.max():.2%} of the amplitude wide, each way")
    return found, errors, noise, band


if __name__ == "__main__":
    main()
