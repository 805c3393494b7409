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
    """Elements of one volume group; `held` are the groups whose nodes do not move.

    Hexahedra of 8 nodes have three more unknown vectors each, those of their incompatible modes 1 - r^2, 1 - s^2 and
    1 - t^2 (Taylor, Beresford and Wilson 1976). They are numbered like nodes, behind these, and free."""

    def __init__(self, mesh, volume, held, units):
        points, groups = msh.read(mesh)
        solid = msh.group(groups, volume)
        self.groups = groups
        tags = sorted({n for _, e in solid for n in e})
        self.number = {tag: i for i, tag in enumerate(tags)}
        self.x = np.array([points[t] for t in tags]) * units
        self.blocks = {kind: np.array([[self.number[n] for n in e] for _, e in solid if len(e) == kind])
                       for kind in sorted({len(e) for _, e in solid})}
        # Of displacements, in each direction: of the nodes, then of the incompatible modes.
        self.vectors = len(tags)
        self.unknown = dict(self.blocks)
        if 8 in self.blocks:
            modes = self.vectors + np.arange(3 * len(self.blocks[8])).reshape(-1, 3)
            self.unknown[8] = np.hstack([self.blocks[8], modes])
            self.vectors += modes.size
        fixed = {self.number[n] for name in held for _, e in msh.group(groups, name) for n in e if n in self.number}
        self.free = np.setdiff1d(np.arange(3 * self.vectors), [3 * n + c for n in fixed for c in range(3)])

    def assemble(self, matrices):
        """Sum of {kind: matrices elements x 3 n x 3 n}, on all unknowns."""
        rows, columns, values = [], [], []
        for kind, blocks in matrices.items():
            dofs = (3 * self.unknown[kind][:, :, None] + np.arange(3)).reshape(len(blocks), -1)
            width = dofs.shape[1]
            rows.append(np.repeat(dofs, width, axis=1).ravel())
            columns.append(np.tile(dofs, (1, width)).ravel())
            values.append(np.asarray(blocks).ravel())
        size = 3 * self.vectors
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return sparse.csc_matrix(entries, shape=(size, size))

    def free_part(self, matrix):
        return matrix[self.free][:, self.free].tocsc()

    def shares(self, force_n, group):
        """Vector of a force that the nodes of a group share equally, and the numbers of these nodes."""
        found = [self.number[n] for n in {n for _, e in msh.group(self.groups, group) for n in e}]
        load = np.zeros((self.vectors, 3))
        load[found] = np.array(force_n) / len(found)
        return load.ravel(), found


class Scheme:
    """Rules of stiffness and mass, and of the incompatible modes: whether their gradients, taken by the Jacobian in
    the middle, are scaled by its determinant there over that at the point (with which their integral vanishes); and
    whether they are functions like others, which have mass and carry the stress of the static state, too."""

    def __init__(self, stiffness, mass, scaled=True, massive=False):
        self.stiffness, self.mass, self.scaled, self.massive = stiffness, mass, scaled, massive


DOVETAIL = Scheme({4: 1, 5: 8, 6: (3, 2), 8: 8, 10: 14, 13: 27, 15: (6, 3), 20: 27},
                  {4: 4, 5: 27, 6: (6, 3), 8: 27, 10: 24, 13: 64, 15: (12, 4), 20: 64})
# Found by its frequencies (docs/verification.md).
_POINTS = {4: 1, 6: (1, 2), 8: 8, 10: 4, 15: (3, 3), 20: 27}
CALCULIX = Scheme(_POINTS, _POINTS, scaled=False, massive=True)


class System:
    """Matrices of a body by a scheme, on all unknowns."""

    def __init__(self, body, scheme):
        self.body, self.scheme, self.c = body, scheme, elasticity()

    def matrix(self, rules, integrand):
        """Sum over the points of the rules of integrand(kind, functions, their gradients) times the volume."""
        return self.body.assemble({kind: self.integrate(kind, rules[kind], integrand) for kind in self.body.blocks})

    def integrate(self, kind, points, integrand):
        x = self.body.x[self.body.blocks[kind]]
        middle = np.einsum("eai,aj->eij", x, elements.shape(kind, (0.0, 0.0, 0.0))[1]) if kind == 8 else None
        total = 0.0
        for place, weight in elements.rule(kind, points):
            n, d = elements.shape(kind, place)
            jacobian = np.einsum("eai,aj->eij", x, d)
            determinant = np.linalg.det(jacobian)
            gradient = np.einsum("aj,eji->eai", d, np.linalg.inv(jacobian))
            if kind == 8:
                modes = np.einsum("aj,eji->eai", np.diag(-2.0 * np.array(place)), np.linalg.inv(middle))
                if self.scheme.scaled:
                    modes = modes * (np.linalg.det(middle) / determinant)[:, None, None]
                n = np.concatenate([n, self.scheme.massive * (1.0 - np.array(place) ** 2)])
                gradient = np.concatenate([gradient, modes], axis=1)
            total = total + (weight * determinant)[:, None, None] * integrand(kind, n, gradient)
        return total

    def slope(self, kind, displacement, gradient):
        return np.einsum("eai,eaj->eij", displacement.reshape(-1, 3)[self.body.unknown[kind]], gradient)

    def stiffness(self, displacement=None):
        """Integral of B(u)^T C B(u); about no displacement where none is given."""
        def integrand(kind, _, gradient):
            about = None if displacement is None else np.eye(3) + self.slope(kind, displacement, gradient)
            b = strain(gradient, about)
            return b.transpose(0, 2, 1) @ (self.c @ b)
        return self.matrix(self.scheme.stiffness, integrand)

    def geometric_stiffness(self, displacement):
        """Of the stress, linear in the displacement."""
        def integrand(kind, _, gradient):
            slope = self.slope(kind, displacement, gradient)
            straining = 0.5 * (slope + slope.transpose(0, 2, 1))
            voigt = np.stack([straining[:, i, j] * (1 if i == j else 2) for i, j in VOIGT], axis=1) @ self.c
            stress = np.zeros_like(straining)
            for s, (i, j) in zip(voigt.T, VOIGT):
                stress[:, i, j] = stress[:, j, i] = s
            if kind == 8 and not self.scheme.massive:
                gradient = gradient * (np.arange(11) < 8)[:, None]
            return in_directions(gradient @ stress @ gradient.transpose(0, 2, 1), np.eye(3))
        return self.matrix(self.scheme.stiffness, integrand)

    def mass(self, directions):
        """Mass that acts on each direction by `directions`."""
        return self.matrix(self.scheme.mass, lambda kind, n, _: in_directions(
            np.broadcast_to(deck.DENSITY_KG_M3 * np.outer(n, n), (len(self.body.blocks[kind]), len(n), len(n))), directions))

    def answer(self, stiffness, load):
        """Static displacement."""
        u, free = np.zeros(len(load)), self.body.free
        u[free] = linalg.spsolve(self.body.free_part(stiffness), load[free])
        return u

    def frequencies_hz(self, stiffness, count):
        omega2 = linalg.eigsh(self.body.free_part(stiffness), k=count, M=self.body.free_part(self.mass(np.eye(3))),
                              sigma=0, return_eigenvectors=False)
        return np.sqrt(np.sort(omega2)) / (2 * math.pi)

    def spinning(self, speed_rad_s):
        """Rotation about the x axis: stiffness about the static state with stress stiffening and spin softening, as
        dovetail and the paper have it; and with the strain of the small vibration taken about that state, too
        (B(u0)^T C B(u0) in place of B(0)^T C B(0), the total Lagrangian tangent), as CalculiX has it. On incompatible
        modes the rotation does not act, though they have mass in CalculiX."""
        body = self.body
        of_nodes = sparse.diags(np.repeat(np.arange(body.vectors) < len(body.x), 3).astype(float))
        spin = speed_rad_s ** 2 * of_nodes @ self.mass(np.diag([0.0, 1.0, 1.0])) @ of_nodes
        at_rest = self.stiffness()
        places = np.zeros((body.vectors, 3))
        places[:len(body.x)] = body.x
        u0 = self.answer(at_rest, spin @ places.ravel())
        stiffening = self.geometric_stiffness(u0) - spin
        return at_rest + stiffening, self.stiffness(u0) + stiffening
