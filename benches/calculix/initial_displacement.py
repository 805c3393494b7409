#!/usr/bin/env python3
"""What separates dovetail from CalculiX in the spinning blade: the initial-displacement stiffness.

    python3 initial_displacement.py MESH.msh [--speed-rpm 5000] [--modes 4]

Assembles the blade (flanks held, rotation about the x axis; any elements but hexahedra of 8 nodes) by numpy,
finds the static displacement u0 and the frequencies by scipy, about u0: with stress stiffening and spin
softening as dovetail and the paper have it, and with the strain of the small vibration taken about u0,
too (B(u0)^T C B(u0) instead of B(0)^T C B(0), the total Lagrangian tangent), as CalculiX has it. Shares
no code with dovetail. Needs python3, numpy, scipy; takes half a minute.
"""

import argparse
import math

import numpy as np
import scipy.sparse.linalg as linalg

import assembly
import blade_modes
import deck

STIFFNESS, MASS = assembly.DOVETAIL.stiffness, assembly.DOVETAIL.mass


class Blade(assembly.Body):
    def slope(self, kind, displacement, gradient):
        return np.einsum("eai,eaj->eij", displacement.reshape(-1, 3)[self.blocks[kind]], gradient)

    def matrix(self, of_kind):
        """Assembled on all nodes from of_kind(kind), the matrices of one type of elements."""
        return self.assemble({kind: of_kind(kind) for kind in self.blocks})

    def stiffness(self, displacement):
        """Integral of B(u)^T C B(u)."""
        def of_kind(kind):
            def integrand(_, gradient):
                b = assembly.strain(gradient, np.eye(3) + self.slope(kind, displacement, gradient))
                return b.transpose(0, 2, 1) @ (self.c @ b)
            return self.integrate(kind, STIFFNESS[kind], integrand)
        return self.matrix(of_kind)

    def geometric_stiffness(self, displacement):
        def of_kind(kind):
            def integrand(_, gradient):
                slope = self.slope(kind, displacement, gradient)
                strain = 0.5 * (slope + slope.transpose(0, 2, 1))
                voigt = np.stack([strain[:, i, j] * (1 if i == j else 2) for i, j in assembly.VOIGT], axis=1) @ self.c
                stress = np.zeros_like(strain)
                for s, (i, j) in zip(voigt.T, assembly.VOIGT):
                    stress[:, i, j] = stress[:, j, i] = s
                return gradient @ stress @ gradient.transpose(0, 2, 1)
            return assembly.in_directions(self.integrate(kind, STIFFNESS[kind], integrand), np.eye(3))
        return self.matrix(of_kind)

    def mass(self, directions):
        """Mass that acts on each direction by `directions`."""
        def of_kind(kind):
            scalar = self.integrate(kind, MASS[kind], lambda n, _: deck.DENSITY_KG_M3 * np.outer(n, n))
            return assembly.in_directions(scalar, directions)
        return self.matrix(of_kind)

    def frequencies_hz(self, stiffness, mass, count):
        omega2 = linalg.eigsh(self.free_part(stiffness), k=count, M=self.free_part(mass), sigma=0,
                              return_eigenvectors=False)
        return np.sqrt(np.sort(omega2)) / (2 * math.pi)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("mesh", help="MSH 4.1, ASCII or binary")
    parser.add_argument("--speed-rpm", type=float, default=5000.0)
    parser.add_argument("--modes", type=int, default=4)
    parser.add_argument("--units", type=float, default=1e-3, help="metres per mesh unit")
    given = parser.parse_args()

    blade = Blade(given.mesh, "blade", blade_modes.FLANKS, given.units)
    if 8 in blade.blocks:
        raise SystemExit(f"{given.mesh}: hexahedra of 8 nodes; their incompatible modes are not in this assembly")
    mass = blade.mass(np.eye(3))
    spin = (given.speed_rpm * math.pi / 30) ** 2 * blade.mass(np.diag([0.0, 1.0, 1.0]))
    rest = np.zeros(3 * len(blade.x))
    stiffness = blade.stiffness(rest)
    u0 = rest.copy()
    free = blade.free
    u0[free] = linalg.spsolve(blade.free_part(stiffness), (spin @ blade.x.ravel())[free])
    stiffening = blade.geometric_stiffness(u0) - spin
    for name, k in [("at rest", stiffness),
                    ("stress stiffening, spin softening", stiffness + stiffening),
                    ("and initial displacement", blade.stiffness(u0) + stiffening)]:
        values = ", ".join(f"{f:.6f}" for f in blade.frequencies_hz(k, mass, given.modes))
        print(f"{name}: {values} Hz", flush=True)


if __name__ == "__main__":
    main()
