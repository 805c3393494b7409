"""Matrices of a beam that is clamped at one end, for the notebooks beside it."""

import numpy as np


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
