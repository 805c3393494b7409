#!/usr/bin/env python3
"""What separates dovetail from CalculiX in the spinning blade: the initial-displacement stiffness.

    python3 initial_displacement.py MESH.msh [--speed-rpm 5000] [--modes 4]

Assembles the blade (10-node tetrahedra, flanks held, rotation about the x axis) by numpy, finds the
static displacement u0 and the frequencies by scipy, about u0: with stress stiffening and spin
softening as dovetail and the paper have it, and with the strain of the small vibration taken about u0,
too (B(u0)^T C B(u0) instead of B(0)^T C B(0), the total Lagrangian tangent), as CalculiX has it. Shares
no code with dovetail. Needs python3, numpy, scipy; takes half a minute.
"""

import argparse
import math

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

import deck
import msh

FLANKS = ["blade_flank_left", "blade_flank_right"]
# Abaqus' order of mid-edge nodes, gradients of the barycentric coordinates, Voigt pairs.
EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
CORNER = np.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
VOIGT = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]


def shape(bary):
    """Shape functions and their gradients in the reference tetrahedron."""
    mid = np.array([4 * bary[a] * bary[b] for a, b in EDGES])
    d_mid = np.array([4 * (bary[a] * CORNER[b] + bary[b] * CORNER[a]) for a, b in EDGES])
    return (np.concatenate([bary * (2 * bary - 1), mid]),
            np.vstack([(4 * bary - 1)[:, None] * CORNER, d_mid]))


def rule():
    """Keast's rule of 15 points, degree 5 (exact for the mass of straight elements but for rounding)."""
    points = [(np.full(4, 0.25), 0.030283678097089)]
    for x, w in ((1 / 3, 0.006026785714286), (1 / 11, 0.011645249086029)):
        points += [(np.where(np.arange(4) == j, 1 - 3 * x, x), w) for j in range(4)]
    x = 0.066550153573664
    for pair in EDGES:
        bary = np.full(4, 0.5 - x)
        bary[list(pair)] = x
        points.append((bary, 0.010949141561386))
    return points


class Blade:
    def __init__(self, mesh, units):
        points, groups = msh.read(mesh)
        solid = msh.group(groups, "blade")
        if len(solid[0][1]) != 10:
            raise SystemExit(f"{mesh}: 10-node tetrahedra needed (order 2)")
        tags = sorted({n for _, e in solid for n in e})
        number = {tag: i for i, tag in enumerate(tags)}
        self.x = np.array([points[t] for t in tags]) * units
        self.tets = np.array([[number[n] for n in e[:8] + [e[9], e[8]]] for _, e in solid])
        held = {number[n] for f in FLANKS for _, e in msh.group(groups, f) for n in e if n in number}
        held_dofs = [3 * n + c for n in held for c in range(3)]
        self.free = np.setdiff1d(np.arange(3 * len(tags)), held_dofs)
        self.dofs = (3 * self.tets[:, :, None] + np.arange(3)).reshape(len(self.tets), 30)
        nu = deck.POISSON
        lame = deck.YOUNG_PA * nu / ((1 + nu) * (1 - 2 * nu))
        shear = deck.YOUNG_PA / (2 * (1 + nu))
        self.c = np.diag([2 * shear] * 3 + [shear] * 3)
        self.c[:3, :3] += lame

    def integrate(self, integrand, size):
        """Sum over the points of integrand(N, grad N) times the volume, per element."""
        total = np.zeros((len(self.tets), size, size))
        for bary, weight in rule():
            n, d = shape(bary)
            jacobian = np.einsum("eai,aj->eij", self.x[self.tets], d)
            gradient = np.einsum("aj,eji->eai", d, np.linalg.inv(jacobian))
            volume = weight * np.linalg.det(jacobian)
            total += volume[:, None, None] * integrand(n, gradient)
        return total

    def matrix(self, elements):
        """Assembled on the free dofs; 10 x 10 elements act on each direction alike."""
        if elements.shape[1] == 10:
            elements = self.in_directions(elements, np.eye(3))
        rows = np.repeat(self.dofs, 30, axis=1).ravel()
        columns = np.tile(self.dofs, (1, 30)).ravel()
        size = 3 * len(self.x)
        return sparse.csc_matrix((elements.ravel(), (rows, columns)), shape=(size, size))

    def in_directions(self, elements, directions):
        return np.einsum("eab,ij->eaibj", elements, directions).reshape(len(elements), 30, 30)

    def strain(self, gradient, deformation):
        """B: Green-Lagrange strain of a small displacement about the deformation gradient given."""
        b = np.zeros((len(self.tets), 6, 30))
        for row, (i, j) in enumerate(VOIGT):
            for k in range(3):
                term = deformation[:, k, i, None] * gradient[:, :, j]
                if i != j:
                    term = term + deformation[:, k, j, None] * gradient[:, :, i]
                b[:, row, k::3] = term
        return b

    def stiffness(self, displacement):
        """Integral of B(u)^T C B(u)."""
        def integrand(_, gradient):
            b = self.strain(gradient, np.eye(3) + self.slope(displacement, gradient))
            return b.transpose(0, 2, 1) @ (self.c @ b)
        return self.matrix(self.integrate(integrand, 30))

    def slope(self, displacement, gradient):
        return np.einsum("eai,eaj->eij", displacement.reshape(-1, 3)[self.tets], gradient)

    def geometric_stiffness(self, displacement):
        def integrand(_, gradient):
            slope = self.slope(displacement, gradient)
            strain = 0.5 * (slope + slope.transpose(0, 2, 1))
            voigt = np.stack([strain[:, i, j] * (1 if i == j else 2) for i, j in VOIGT], axis=1) @ self.c
            stress = np.zeros_like(strain)
            for s, (i, j) in zip(voigt.T, VOIGT):
                stress[:, i, j] = stress[:, j, i] = s
            return gradient @ stress @ gradient.transpose(0, 2, 1)
        return self.matrix(self.integrate(integrand, 10))

    def frequencies_hz(self, stiffness, mass, count):
        k, m = (a[self.free][:, self.free].tocsc() for a in (stiffness, mass))
        omega2 = linalg.eigsh(k, k=count, M=m, sigma=0, return_eigenvectors=False)
        return np.sqrt(np.sort(omega2)) / (2 * math.pi)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="MSH 4.1, ASCII or binary, order 2")
    parser.add_argument("--speed-rpm", type=float, default=5000.0)
    parser.add_argument("--modes", type=int, default=4)
    parser.add_argument("--units", type=float, default=1e-3, help="metres per mesh unit")
    given = parser.parse_args()

    blade = Blade(given.mesh, given.units)
    density = blade.integrate(lambda n, _: deck.DENSITY_KG_M3 * np.outer(n, n), 10)
    mass = blade.matrix(density)
    spin = (given.speed_rpm * math.pi / 30) ** 2 * blade.matrix(
        blade.in_directions(density, np.diag([0.0, 1.0, 1.0])))
    rest = np.zeros(3 * len(blade.x))
    stiffness = blade.stiffness(rest)
    u0 = rest.copy()
    free = blade.free
    u0[free] = linalg.spsolve(stiffness[free][:, free].tocsc(), (spin @ blade.x.ravel())[free])
    stiffening = blade.geometric_stiffness(u0) - spin
    for name, k in [("at rest", stiffness),
                    ("stress stiffening, spin softening", stiffness + stiffening),
                    ("and initial displacement", blade.stiffness(u0) + stiffening)]:
        values = ", ".join(f"{f:.6f}" for f in blade.frequencies_hz(k, mass, given.modes))
        print(f"{name}: {values} Hz", flush=True)


if __name__ == "__main__":
    main()
