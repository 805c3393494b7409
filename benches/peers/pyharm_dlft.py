"""pyHarm's DLFT (PyPI: pyHarm-os) on the reduced model.

    pyharm_dlft.py SCENE HARMONICS STATICS.json OUT.json [--points N] [--stock]

STATICS.json: written by numpy_newton.py, for the static state (pyHarm has none).

pyHarm's march starts from no shear, dovetail's from that of the static state. Measured from the static state in the
tangential directions, X = X_static + X', with K X_static taken off the preload, the equations are the same. What is changed in
pyHarm's contact element, and why:
- nbSub = 1: for a pair that ends at the ground (X is relative already) pyHarm divides the linear residual by 2, and then solves
  other equations than f(U) = Lambda U + lambda - F;
- eps of its own for the normal direction, as dovetail has;
- double precision (JAX_ENABLE_X64): in pyHarm's single precision no residual of 1e-8 can be reached.
The law, the march, its derivative, the assembly and the solver (scipy's hybrid Powell) are pyHarm's.

The stuck modes are condensed exactly by one linear element that forms Lambda and F on X alone; with --stock they are unknowns of
pyHarm's substructure, condensed by pyHarm's reductor "NLdofs".
"""

import argparse
import json
import os
import time

# Only when JAX is loaded.
os.environ["JAX_ENABLE_X64"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

import jax
import logging
import numpy as np
from pyHarm import Maestro
from pyHarm.Elements.ABCElement import ABCElement
from pyHarm.Elements.NodeToNodeElements.DLFTElements.DLFT3D import DLFT3D
from pyHarm.Elements.NodeToNodeElements.DLFTElements.DLFTFriction import DLFTFrictionResidual_jax
from pyHarm.Elements.NodeToNodeElements.DLFTElements.DLFTUniGap import DLFTUniGapResidual_jax

from reduced_model import read_case


@jax.jit
def contact(x, om, R, nbSub, Pdir, Pslave, Pmaster, mu, N0, g, eps, DFT, DTF):
    """pyHarm's DLFTFriction3DResidual_jax with eps = (normal, tangential)."""
    normal, at = DLFTUniGapResidual_jax(x, om, R, nbSub, Pdir[0:1], Pslave, Pmaster, g, eps[0], DFT, DTF, N0)
    shear, _ = DLFTFrictionResidual_jax(x, om, R, nbSub, Pdir[1:3], Pslave, Pmaster, mu, N0, eps[1], DFT, DTF, at)
    return normal + shear


# As in pyHarm: by x alone, the linear residual held.
contact_derivative = jax.jit(jax.jacfwd(contact))


class GroundedPair(DLFT3D):
    factory_keyword = "GroundedPair"

    def __post_init__(self):
        super().__post_init__()
        self.nbSub = 1
        self.eps = np.asarray(self.eps)

    def arguments(self, xg, om, R):
        rest = (float(self.nbSub), self.Pdir, self.Pslave, self.Pmaster, self.mu, self.N0, self.g, self.eps)
        return (xg[self.indices], om, R[self.indices], *rest, self.D["ft"], self.D["tf"])

    def evalResidual(self, xg, om, Rglin=None):
        return contact(*self.arguments(xg, om, Rglin))

    def evalJacobian(self, xg, om, Rglin=None, dJgdxlin=None, dJgdomlin=None):
        return contact_derivative(*self.arguments(xg, om, Rglin)), np.zeros(len(self.indices))


class OnAllUnknowns(ABCElement):
    """An element on every unknown, in pyHarm's order: mean, cos 1, sin 1, ...; coordinates within each."""

    def __init_data__(self, name, data, CS):
        self.name, self.data, self.CS = name, data, CS

    def __str__(self):
        return self.name

    def generateIndices(self, expl_dofs):
        self.indices = np.arange(len(expl_dofs))

    def adim(self, lc, wc):
        raise NotImplementedError


class Loads(OnAllUnknowns):
    """-F, F the mean and the cosine of harmonic 1."""

    factory_keyword = "Loads"

    def __flag_update__(self):
        self.flag_extforcing = True

    def evalResidual(self, xg, om):
        R = np.zeros((2 * self.nh + 1, len(self.data["mean"])))
        R[0], R[1] = -self.data["mean"], -self.data["cosine"]
        return R.ravel()

    def evalJacobian(self, xg, om):
        return np.zeros((len(xg), len(xg))), np.zeros(len(xg))


class Condensed(OnAllUnknowns):
    """Lambda X - F with the stuck modes condensed; formed when the frequency changes."""

    factory_keyword = "Condensed"
    at = None

    def form(self, om):
        if self.at == om:
            return
        model, mean = self.data["model"], self.data["mean"]
        n, m = len(mean), 2 * self.nh + 1
        self.J, self.F = np.zeros((m * n, m * n)), np.zeros((m, n))
        self.J[:n, :n], self.F[0] = model.K, mean
        for k in range(1, self.nh + 1):
            block, force = model.condensed(k * om)
            at = slice((2 * k - 1) * n, (2 * k + 1) * n)
            self.J[at, at] = np.block([[block.real, block.imag], [-block.imag, block.real]])
            if k == 1:
                self.F[1], self.F[2] = force.real, -force.imag
        self.at = om

    def evalResidual(self, xg, om):
        self.form(om)
        return self.J @ xg - self.F.ravel()

    def evalJacobian(self, xg, om):
        # The frequency is held: its column is not asked for.
        self.form(om)
        return self.J, np.zeros(len(xg))


def describe(case, x_static, stock):
    """pyHarm's input."""
    model = case.model
    n, modes = len(model.static_n), len(model.w2)
    shift = x_static.copy()
    shift[0::3] = 0.0
    mean = model.static_n - model.K @ shift
    pairs = {
        f"pair{i}": dict(
            type="GroundedPair",
            connect={"dovetail": [i]},
            dirs=[0, 1, 2],
            mu=model.friction,
            N0=0.0,
            g=0.0,
            eps=model.eps[3 * i : 3 * i + 2],
        )
        for i in range(n // 3)
    }
    if stock:
        K = np.block([[model.K, np.zeros((n, modes))], [np.zeros((modes, n)), np.diag(model.w2)]])
        M = np.block([[model.M, model.p], [model.p.T, np.eye(modes)]])
        matrices = dict(M=M, K=K, C=model.stiffness_s * K)
        body = dict(matrix=matrices, ndofs=3, nmodes=modes)
        cosine = np.concatenate([model.excitation_x, model.excitation_modes])
        rest = dict(loads=dict(type="Loads", mean=np.pad(mean, (0, modes)), cosine=cosine))
    else:
        body = dict(type="onlydofs", nnodes=n // 3, ndofs=3)
        rest = dict(rest=dict(type="Condensed", model=model, mean=mean))
    omega = 2 * np.pi * case.hz
    return shift, dict(
        plugin=[GroundedPair, Loads, Condensed],
        system=dict(type="Base", nh=case.harmonics, nti=case.samples),
        substructures=dict(dovetail=body),
        connectors=rest | pairs,
        analysis=dict(
            frf=dict(
                study="frf",
                solver="scipyroot",
                # hybr stops by the step alone.
                solver_options=dict(root=dict(method="hybr", options=dict(xtol=1e-9, maxfev=1000))),
                predictor="previous",
                predictor_options=dict(bifurcation_detect=False),
                corrector="nocontinuation",
                reductors=[dict(type="NLdofs" if stock else "noreductor")],
                stepsizer="constant",
                puls_inf=omega[0],
                puls_sup=omega[-1],
                puls_start=omega[0],
                ds0=1.0,
                verbose=False,
            )
        ),
    )


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("scene")
    arguments.add_argument("harmonics", type=int)
    arguments.add_argument("statics")
    arguments.add_argument("out")
    arguments.add_argument("--points", type=int)
    arguments.add_argument("--stock", action="store_true")
    options = arguments.parse_args()
    logging.disable(logging.INFO)
    case = read_case(options.scene, options.harmonics)
    case.hz = case.hz[: options.points]
    with open(options.statics) as file:
        x_static = np.array(json.load(file)["x_static"])
    shift, description = describe(case, x_static, options.stock)
    study = Maestro(description).nls["frf"]
    system = study.system
    residual, jacobian = study.solver.residual, study.solver.jacobian
    calls = dict(residual=0, jacobian=0)

    def counted(name, function):
        def call(*a):
            calls[name] += 1
            return function(*a)

        return call

    study.solver.residual = counted("residual", residual)
    study.solver.jacobian = counted("jacobian", jacobian)
    n, m = len(shift), 2 * case.harmonics + 1
    width = n + (len(case.model.w2) if options.stock else 0)
    at_rest = np.zeros(m * width)
    at_rest[:n] = x_static - shift
    # Compilation is not timed.
    first = np.append(at_rest, 2 * np.pi * case.hz[0])
    system.Residual(first)
    system.Jacobian(first)
    points, accepted = [], None
    for i, hz in enumerate(case.hz):
        omega = 2 * np.pi * hz
        calls.update(residual=0, jacobian=0)
        begin, processor = time.perf_counter(), time.process_time()
        if i == 0:
            study.initialise(at_rest)
        else:
            study.ds = omega - accepted
            study.makeStep()
        seconds, processor = time.perf_counter() - begin, time.process_time() - processor
        solution = study.SolList[-1]
        if i == 0 or solution.flag_accepted:
            accepted = solution.x[-1]
        U = solution.x[:-1].reshape(m, width)[:, :n]
        f = system.Residual(solution.x).reshape(m, width)[:, :n]
        force = np.zeros((m, n))
        force[0] = case.model.static_n
        unit = case.model.condensed(omega)[1]
        force[1], force[2] = unit.real, -unit.imag
        norm = np.linalg.norm
        measure = max(norm(f[0]) / norm(force), norm(f[1:]) / norm(force[1:]))
        tip = abs(case.model.tip(omega, 1, U[1] - 1j * U[2]))
        print(
            f"{hz:.3f} Hz: {tip:.9e} m, residual {measure:.1e}, {calls['residual']} residuals, {calls['jacobian']} Jacobians,"
            f" {seconds:.2f} s ({processor:.2f} of processor); {solution.message_solver}",
            flush=True,
        )
        points.append(
            dict(hz=hz, tip_m=tip, residual=measure, converged=bool(measure <= case.tolerance), seconds=seconds)
            | dict(processor_s=processor, residuals=calls["residual"], jacobians=calls["jacobian"])
        )
    with open(options.out, "w") as file:
        json.dump(dict(points=points), file)


if __name__ == "__main__":
    main()
