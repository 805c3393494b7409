"""A cantilever that rubs at its tip, from the matrices of beam elements, and two solvers of it.

The tip touches the ground through a Jenkins element: a spring along the motion that slides where
its force exceeds friction. The curve is followed by the solver of dovetail; at one frequency SciPy's
Newton-Krylov method solves the same balance, through its residual alone.

    python crates/python/examples/beam.py
"""

import numpy as np
from scipy.optimize import newton_krylov

import dovetail


def cantilever(elements=10, length=1.0, young=210e9, height=0.01, width=0.01, density=7800.0):
    """Stiffness and mass of a beam in bending; each node has a deflection and a slope."""
    inertia, area, h = width * height**3 / 12, width * height, length / elements
    k = young * inertia / h**3 * np.array([
        [12, 6 * h, -12, 6 * h],
        [6 * h, 4 * h**2, -6 * h, 2 * h**2],
        [-12, -6 * h, 12, -6 * h],
        [6 * h, 2 * h**2, -6 * h, 4 * h**2],
    ])
    m = density * area * h / 420 * np.array([
        [156, 22 * h, 54, -13 * h],
        [22 * h, 4 * h**2, 13 * h, -3 * h**2],
        [54, 13 * h, 156, -22 * h],
        [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
    ])
    stiffness, mass = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for element in range(elements):
        own = slice(2 * element, 2 * element + 4)
        stiffness[own, own] += k
        mass[own, own] += m
    return stiffness, mass


def problem(force_n=1.0, friction=0.3):
    stiffness, mass = cantilever()
    tip = len(stiffness) - 2
    force = np.zeros(len(stiffness))
    force[tip] = force_n
    # The normal and the second tangent are no degrees of freedom of a beam in a plane.
    rubbing = dovetail.Pair(
        (None, tip, None), friction=friction, preload_n=10.0,
        normal_stiffness_n_m=1e6, tangential_stiffness_n_m=1e3,
    )
    return dovetail.Problem.from_matrices(
        stiffness, mass, [rubbing], excitation=force, observe={"tip": tip}, fixed=[0, 1],
        damping={"ratio": 0.005}, highest_hz=50.0,
    )


def main():
    beam = problem()
    stuck_hz = beam.static_state().linear_frequency_hz[0]
    print(f"with the tip stuck the first mode is at {stuck_hz:.3f} Hz")
    for force_n in (0.01, 0.3, 1.0, 3.0):
        curve = problem(force_n).response(
            [0.5 * stuck_hz, 1.1 * stuck_hz], harmonics=7, follow=True, progress=False
        )
        peak = curve.peak("tip")
        motion = curve[peak.index]
        print(
            f"{force_n:5.2f} N: {peak.amplitude_m / force_n:.3e} m/N at {peak.frequency_hz:.3f} Hz, "
            f"loss factor {motion.loss_factor:.4f}, {motion.status[0]}"
        )
    # One frequency by SciPy, which knows nothing of the balance but its residual.
    hz = 0.8 * stuck_hz
    balance = beam.balance(hz, harmonics=3)
    scale = np.abs(balance.force_n).max()
    found = newton_krylov(lambda u: balance.residual(u) / scale, balance.at_rest, f_tol=1e-9)
    own = balance.motion(found).amplitude_m[0]
    ours = beam.response([hz], harmonics=3, progress=False).amplitude_m[0, 0]
    print(f"at {hz:.3f} Hz the tip moves {own:.6e} m by SciPy and {ours:.6e} m by dovetail")
    return own, ours


if __name__ == "__main__":
    main()
