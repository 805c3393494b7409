#!/usr/bin/env python3
"""What separates dovetail from CalculiX in the blade at rest: the quadrature of the element matrices.

    python3 quadrature.py MESH.msh [--modes 4]

Assembles the blade (flanks held) by numpy twice: with as many points as are exact, or enough for curved
elements, as in dovetail, and with fewer, which turn out to be CalculiX's: mass of linear tetrahedra by 1 point, of
quadratic ones by 15, their stiffness by 4. Shares no code with dovetail. Needs python3, numpy, scipy; takes half a minute.
"""

import argparse
import math

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

import deck
import initial_displacement as quadratic
import msh


def points(order, number):
    """Barycentric points and weights of a rule of `number` points."""
    if number == 1:
        return [(np.full(4, 0.25), 1 / 6)]
    if number == 4:
        near, far = (5 - math.sqrt(5)) / 20, (5 + 3 * math.sqrt(5)) / 20
        return [(np.where(np.arange(4) == j, far, near), 1 / 24) for j in range(4)]
    if number == 15:
        return quadratic.rule()
    # Gauss and Legendre's product folded into the tetrahedron.
    n = round(number ** (1 / 3))
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    rule = []
    for a, wa in zip(x, w):
        for b, wb in zip(x, w):
            for c, wc in zip(x, w):
                p = np.array([a, (1 - a) * b, (1 - a) * (1 - b) * c])
                rule.append((np.concatenate([[1 - p.sum()], p]), wa * wb * wc * (1 - a) ** 2 * (1 - b)))
    return rule


def shape(order, bary):
    return quadratic.shape(bary) if order == 2 else (bary, quadratic.CORNER)


class Blade:
    def __init__(self, mesh, units):
        nodes, groups = msh.read(mesh)
        solid = msh.group(groups, "blade")
        self.order = 2 if len(solid[0][1]) == 10 else 1
        tags = sorted({n for _, e in solid for n in e})
        number = {tag: i for i, tag in enumerate(tags)}
        self.x = np.array([nodes[t] for t in tags]) * units
        # Gmsh's last two mid-edge nodes are swapped.
        reorder = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8][: len(solid[0][1])]
        self.tets = np.array([[number[e[k]] for k in reorder] for _, e in solid])
        held = {number[n] for f in quadratic.FLANKS for _, e in msh.group(groups, f) for n in e if n in number}
        fixed = [3 * n + c for n in held for c in range(3)]
        self.free = np.setdiff1d(np.arange(3 * len(tags)), fixed)
        self.width = 3 * self.tets.shape[1]
        self.dofs = (3 * self.tets[:, :, None] + np.arange(3)).reshape(len(self.tets), self.width)
        self.c = elasticity()

    def matrix(self, number, integrand):
        total = np.zeros((len(self.tets), self.width, self.width))
        for bary, weight in points(self.order, number):
            n, d = shape(self.order, bary)
            jacobian = np.einsum("eai,aj->eij", self.x[self.tets], d)
            gradient = np.einsum("aj,eji->eai", d, np.linalg.inv(jacobian))
            total += (weight * np.linalg.det(jacobian))[:, None, None] * integrand(n, gradient)
        rows = np.repeat(self.dofs, self.width, axis=1).ravel()
        columns = np.tile(self.dofs, (1, self.width)).ravel()
        full = sparse.csc_matrix((total.ravel(), (rows, columns)))
        return full[self.free][:, self.free].tocsc()

    def stiffness(self, number):
        def integrand(_, gradient):
            b = np.zeros((len(self.tets), 6, self.width))
            for row, (i, j) in enumerate(quadratic.VOIGT):
                b[:, row, i::3] += gradient[:, :, j]
                if i != j:
                    b[:, row, j::3] += gradient[:, :, i]
            return b.transpose(0, 2, 1) @ (self.c @ b)
        return self.matrix(number, integrand)

    def mass(self, number):
        return self.matrix(number, lambda n, _: np.kron(deck.DENSITY_KG_M3 * np.outer(n, n), np.eye(3))[None])


def elasticity():
    nu = deck.POISSON
    shear = deck.YOUNG_PA / (2 * (1 + nu))
    c = np.diag([2 * shear] * 3 + [shear] * 3)
    c[:3, :3] += 2 * shear * nu / (1 - 2 * nu)
    return c


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--modes", type=int, default=4)
    parser.add_argument("--units", type=float, default=1e-3, help="metres per mesh unit")
    given = parser.parse_args()

    blade = Blade(given.mesh, given.units)
    rules = {1: {"dovetail": (1, 4), "CalculiX": (1, 1)}, 2: {"dovetail": (125, 125), "CalculiX": (4, 15)}}
    for name, (k, m) in rules[blade.order].items():
        omega2 = linalg.eigsh(blade.stiffness(k), k=given.modes, M=blade.mass(m), sigma=0,
                              return_eigenvectors=False)
        hz = np.sqrt(np.sort(omega2)) / (2 * math.pi)
        print(f"stiffness {k} points, mass {m}, as {name}: {', '.join(f'{f:.4f}' for f in hz)} Hz", flush=True)


if __name__ == "__main__":
    main()
