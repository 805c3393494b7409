"""Finite elements by numpy, of the types of elements.py, that share no code with dovetail.

Titanium of deck.py, linear elasticity, some nodes held. The rules of integration are arguments:
{number of nodes of the element: number of points}, as elements.rule has them. Needs numpy and scipy.
"""

import math

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

import deck
import elements
import msh

VOIGT = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]
# Rules that more points change no more in the digits that are shown.
MANY = {4: 64, 5: 216, 6: (36, 6), 8: 216, 10: 216, 13: 512, 15: (36, 6), 20: 216}


def elasticity():
    """Stress by strain in the order of VOIGT, Pa."""
    shear = deck.YOUNG_PA / (2 * (1 + deck.POISSON))
    c = np.diag([2 * shear] * 3 + [shear] * 3)
    c[:3, :3] += 2 * shear * deck.POISSON / (1 - 2 * deck.POISSON)
    return c


def strain(gradient, deformation=None):
    """B, elements x 6 x 3 nodes, of gradients elements x nodes x 3: Green and Lagrange's strain of a small
    displacement about the deformation gradient given (elements x 3 x 3; the identity where none is)."""
    count, nodes, _ = gradient.shape
    if deformation is None:
        deformation = np.broadcast_to(np.eye(3), (count, 3, 3))
    b = np.zeros((count, 6, 3 * nodes))
    for row, (i, j) in enumerate(VOIGT):
        for k in range(3):
            term = deformation[:, k, i, None] * gradient[:, :, j]
            if i != j:
                term = term + deformation[:, k, j, None] * gradient[:, :, i]
            b[:, row, k::3] = term
    return b


def in_directions(scalar, directions):
    """Matrices elements x 3 n x 3 n of matrices elements x n x n that act on each direction by `directions`."""
    count, n, _ = scalar.shape
    return np.einsum("eab,ij->eaibj", scalar, directions).reshape(count, 3 * n, 3 * n)


class Body:
    """Elements of one volume group; `held` are the groups whose nodes do not move."""

    def __init__(self, mesh, volume, held, units):
        points, groups = msh.read(mesh)
        solid = msh.group(groups, volume)
        self.groups = groups
        tags = sorted({n for _, e in solid for n in e})
        self.number = {tag: i for i, tag in enumerate(tags)}
        self.x = np.array([points[t] for t in tags]) * units
        self.blocks = {kind: np.array([[self.number[n] for n in e] for _, e in solid if len(e) == kind])
                       for kind in sorted({len(e) for _, e in solid})}
        fixed = {self.number[n] for name in held for _, e in msh.group(groups, name) for n in e if n in self.number}
        self.free = np.setdiff1d(np.arange(3 * len(tags)), [3 * n + c for n in fixed for c in range(3)])
        self.c = elasticity()

    def integrate(self, kind, points, integrand):
        """Sum over the points of a rule of integrand(shape functions, their gradients) times the volume, per element."""
        x = self.x[self.blocks[kind]]
        total = 0.0
        for place, weight in elements.rule(kind, points):
            n, d = elements.shape(kind, place)
            jacobian = np.einsum("eai,aj->eij", x, d)
            gradient = np.einsum("aj,eji->eai", d, np.linalg.inv(jacobian))
            total = total + (weight * np.linalg.det(jacobian))[:, None, None] * integrand(n, gradient)
        return total

    def assemble(self, matrices):
        """Sum of {kind: matrices elements x 3 n x 3 n}, on all nodes."""
        rows, columns, values = [], [], []
        for kind, blocks in matrices.items():
            dofs = (3 * self.blocks[kind][:, :, None] + np.arange(3)).reshape(len(blocks), -1)
            width = dofs.shape[1]
            rows.append(np.repeat(dofs, width, axis=1).ravel())
            columns.append(np.tile(dofs, (1, width)).ravel())
            values.append(np.asarray(blocks).ravel())
        size = 3 * len(self.x)
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return sparse.csc_matrix(entries, shape=(size, size))

    def free_part(self, matrix):
        return matrix[self.free][:, self.free].tocsc()

    def stiffness_of(self, kind, points):
        def integrand(_, gradient):
            b = strain(gradient)
            return b.transpose(0, 2, 1) @ (self.c @ b)
        return self.integrate(kind, points, integrand)

    def mass_of(self, kind, points):
        scalar = self.integrate(kind, points, lambda n, _: deck.DENSITY_KG_M3 * np.outer(n, n)[None])
        return in_directions(scalar, np.eye(3))

    def incompatible(self, points, scaled):
        """Stiffness, elements x 33 x 33, of hexahedra of 8 nodes with the modes 1 - r^2, 1 - s^2, 1 - t^2 in each
        direction (Taylor, Beresford and Wilson 1976): the gradients of the modes are taken by the Jacobian in the
        middle, and `scaled` by its determinant there over that at the point, with which their integral vanishes."""
        x = self.x[self.blocks[8]]
        middle = np.einsum("eai,aj->eij", x, elements.shape(8, (0.0, 0.0, 0.0))[1])
        inverse, size = np.linalg.inv(middle), np.linalg.det(middle)
        total = 0.0
        for place, weight in elements.rule(8, points):
            _, d = elements.shape(8, place)
            jacobian = np.einsum("eai,aj->eij", x, d)
            determinant = np.linalg.det(jacobian)
            modes = np.einsum("aj,eji->eai", np.diag(-2.0 * np.array(place)), inverse)
            if scaled:
                modes = modes * (size / determinant)[:, None, None]
            gradient = np.concatenate([np.einsum("aj,eji->eai", d, np.linalg.inv(jacobian)), modes], axis=1)
            b = strain(gradient)
            total = total + (weight * determinant)[:, None, None] * (b.transpose(0, 2, 1) @ (self.c @ b))
        return total

    def massive_modes(self, points):
        """Mass, elements x 33 x 33, in which the incompatible modes of hexahedra of 8 nodes take part."""
        x = self.x[self.blocks[8]]
        total = 0.0
        for place, weight in elements.rule(8, points):
            n, d = elements.shape(8, place)
            n = np.concatenate([n, 1.0 - np.array(place) ** 2])
            determinant = np.linalg.det(np.einsum("eai,aj->eij", x, d))
            total = total + (weight * determinant)[:, None, None] * deck.DENSITY_KG_M3 * np.outer(n, n)[None]
        return in_directions(total, np.eye(3))


class Scheme:
    """Rules of stiffness and mass, and for hexahedra of 8 nodes whether the gradients of the incompatible modes
    are scaled and whether these modes have mass."""

    def __init__(self, stiffness, mass, scaled=True, massive=False):
        self.stiffness, self.mass, self.scaled, self.massive = stiffness, mass, scaled, massive


DOVETAIL = Scheme({4: 1, 5: 8, 6: (3, 2), 8: 8, 10: 14, 13: 27, 15: (6, 3), 20: 27},
                  {4: 4, 5: 27, 6: (6, 3), 8: 27, 10: 24, 13: 64, 15: (12, 4), 20: 64})
# Found by its frequencies (docs/verification.md).
_POINTS = {4: 1, 6: (1, 2), 8: 8, 10: 4, 15: (3, 3), 20: 27}
CALCULIX = Scheme(_POINTS, _POINTS, scaled=False, massive=True)


class System:
    """Stiffness and mass of a body on what is free to move."""

    def __init__(self, body, scheme):
        self.body = body
        kinds = body.blocks
        stiffness = {k: body.stiffness_of(k, scheme.stiffness[k]) for k in kinds if k != 8}
        mass = {k: body.mass_of(k, scheme.mass[k]) for k in kinds if k != 8 or not scheme.massive}
        inner = None
        if 8 in kinds:
            full = body.incompatible(scheme.stiffness[8], scheme.scaled)
            if scheme.massive:
                inner = full, body.massive_modes(scheme.mass[8])
                stiffness[8], mass[8] = (m[:, :24, :24] for m in inner)
            else:
                stiffness[8] = full[:, :24, :24] - full[:, :24, 24:] @ np.linalg.solve(full[:, 24:, 24:], full[:, 24:, :24])
        self.k, self.m = (body.free_part(body.assemble(a)) for a in (stiffness, mass))
        if inner:
            self.k, self.m = (self.with_inner(a, b) for a, b in zip((self.k, self.m), inner))

    def with_inner(self, outer, full):
        """Adds the incompatible modes as unknowns of their own."""
        count, size = len(full), 3 * len(self.body.x)
        dofs = (3 * self.body.blocks[8][:, :, None] + np.arange(3)).reshape(count, 24)
        own = np.arange(9 * count).reshape(count, 9)
        rows, columns = np.repeat(dofs, 9, axis=1).ravel(), np.tile(own, (1, 24)).ravel()
        coupling = sparse.csc_matrix((full[:, :24, 24:].ravel(), (rows, columns)), shape=(size, 9 * count))[self.body.free]
        diagonal = sparse.block_diag(list(full[:, 24:, 24:]))
        return sparse.bmat([[outer, coupling], [coupling.T, diagonal]], format="csc")

    def frequencies_hz(self, count):
        omega2 = linalg.eigsh(self.k, k=count, M=self.m, sigma=0, return_eigenvectors=False)
        return np.sqrt(np.sort(omega2)) / (2 * math.pi)

    def displacement_m(self, force_n, group):
        """Mean displacement of the nodes of a group that share a force equally."""
        found = [self.body.number[n] for n in {n for _, e in msh.group(self.body.groups, group) for n in e}]
        load = np.zeros(3 * len(self.body.x))
        for n in found:
            load[3 * n:3 * n + 3] = np.array(force_n) / len(found)
        right = np.zeros(self.k.shape[0])
        right[:len(self.body.free)] = load[self.body.free]
        u = np.zeros_like(load)
        u[self.body.free] = linalg.spsolve(self.k, right)[:len(self.body.free)]
        return u.reshape(-1, 3)[found].mean(axis=0)
