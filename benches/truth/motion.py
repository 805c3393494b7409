"""Periodic motions of a model: the integrator as a map of a period, its static state, and shooting.

A model is a dictionary: K, M, damping (stiffness_s, mass_per_s), pairs (unknowns, against, frame, friction,
gap_m, preload_n, normal_stiffness_n_m, tangential_stiffness_n_m), static_load, excitation by harmonic (re, im),
observe, frequency_hz. Shares nothing with dovetail.
"""

import ctypes
import hashlib
import os
import pathlib
import subprocess
import time

import numpy as np

HERE = pathlib.Path(__file__).parent
SOURCE = HERE / "integrator.c"
BUILT = HERE.parent.parent / "target" / "truth"
MOST_OBSERVED, MOST_PAIRS = 8, 8
Doubles = np.ctypeslib.ndpointer(float, flags="C")


class CModel(ctypes.Structure):
    _fields_ = (
        [(name, ctypes.c_int) for name in ("dofs", "pairs", "observed", "harmonics")]
        + [(name, ctypes.c_void_p) for name in ("stiffness", "inverse_mass", "mass")]
        + [(name, ctypes.c_double) for name in ("alpha", "beta", "omega")]
        + [(name, ctypes.c_void_p) for name in ("gap", "mu", "kn", "kt", "rows", "steady", "cosine", "sine", "orders", "weights")]
        + [("u_scale", ctypes.c_double), ("tolerance", ctypes.c_double), ("least_steps", ctypes.c_int), ("is_diagonal", ctypes.c_int)]
    )


class Figures(ctypes.Structure):
    _fields_ = (
        [(name, ctypes.c_double * MOST_OBSERVED) for name in ("amplitude", "mean")]
        + [(name, ctypes.c_double * MOST_PAIRS) for name in ("friction_w", "slid_m", "way_open_m", "most_n", "least_n")]
        + [("damping_w", ctypes.c_double)]
        + [(name, ctypes.c_int * MOST_PAIRS) for name in ("slips", "opens", "touches")]
        + [("steps", ctypes.c_int), ("events", ctypes.c_int)]
    )


def source_hash():
    """Of all that a truth depends on besides its model."""
    text = b"".join((HERE / name).read_bytes() for name in ("contact.h", "integrator.c", "motion.py", "periodic.py"))
    return hashlib.sha256(text).hexdigest()[:12]


def compiled():
    """The integrator, compiled once."""
    text = SOURCE.read_bytes() + (HERE / "contact.h").read_bytes()
    path = BUILT / f"integrator-{hashlib.sha256(text).hexdigest()[:12]}.so"
    if not path.exists():
        BUILT.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}")
        subprocess.run(["gcc", "-O3", "-march=native", "-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math", "-shared", "-fPIC", str(SOURCE), "-o", str(part), "-lm"], check=True)
        part.replace(path)
    loaded = ctypes.CDLL(str(path))
    loaded.integrate.argtypes = [ctypes.POINTER(CModel), Doubles, ctypes.c_int, ctypes.POINTER(Figures), ctypes.c_int, ctypes.c_void_p]
    loaded.follow_path.argtypes = [ctypes.POINTER(CModel), Doubles, ctypes.c_int, Doubles, np.ctypeslib.ndpointer(np.int32)]
    return loaded


COMPILED = None


class NoMotion(Exception):
    """No periodic motion, or no static state, was found."""


class System:
    """Matrices of a model, with springs of `rigid_n_m` for its rigid pairs."""

    def __init__(self, model, rigid_n_m=None):
        global COMPILED
        COMPILED = COMPILED or compiled()
        self.K, self.M = np.array(model["K"], float), np.array(model["M"], float)
        self.n, pairs = len(self.K), model["pairs"]
        self.p = len(pairs)
        self.rows = np.zeros((self.p, 3, self.n))
        self.f0 = np.array(model["static_load"], float)
        for p, pair in enumerate(pairs):
            frame = np.eye(3) if pair["frame"] is None else np.array(pair["frame"])
            for dofs, sign in ((pair["unknowns"], 1.0), (pair["against"], -1.0)):
                for axis, dof in enumerate(dofs or ()):
                    if dof is not None:
                        self.rows[p, :, dof] += sign * frame[:, axis]
            self.f0 -= pair["preload_n"] * self.rows[p, 0]
        springs = [(pair["normal_stiffness_n_m"] or rigid_n_m, pair["tangential_stiffness_n_m"] or rigid_n_m) for pair in pairs]
        self.rigid = np.inf if rigid_n_m is None else rigid_n_m
        self.kn, self.kt = (np.array([s[c] for s in springs], float) for c in (0, 1))
        self.gap = np.array([pair["gap_m"] for pair in pairs], float)
        self.mu = np.array([pair["friction"] for pair in pairs], float)
        self.alpha, self.beta = model["damping"]["stiffness_s"], model["damping"]["mass_per_s"]
        self.orders = np.array([int(h) for h in model["excitation"]], np.int32)
        self.cosine = np.array([f["re"] for f in model["excitation"].values()], float)
        self.sine = np.array([f["im"] for f in model["excitation"].values()], float)
        self.weights = np.array(model["observe"], float)
        self.inverse_mass = np.linalg.inv(self.M)
        held = self.K + sum(r.T @ np.diag([n, t, t]) @ r for r, n, t in zip(self.rows, self.kn, self.kt))
        self.fastest = np.sqrt(np.linalg.eigvals(self.inverse_mass @ held).real.max())
        self.is_diagonal = int(np.count_nonzero(self.M - np.diag(np.diag(self.M))) == 0)

    def contact_rows(self):
        return self.rows.reshape(3 * self.p, self.n)

    def law(self, x, w, gap):
        """Forces on the rows (p, 3), sliders after, and derivative (p, 3, 3) at rest."""
        force, after, slope = np.zeros((self.p, 3)), w.copy(), np.zeros((self.p, 3, 3))
        for p in range(self.p):
            normal = self.kn[p] * -(x[p, 0] + gap[p])
            if normal <= 0:
                after[p] = x[p, 1:]
                continue
            force[p, 0], slope[p, 0, 0] = -normal, self.kn[p]
            trial, limit = self.kt[p] * (x[p, 1:] - w[p]), self.mu[p] * normal
            size = np.hypot(*trial)
            if size <= limit:
                force[p, 1:], slope[p, 1, 1], slope[p, 2, 2] = trial, self.kt[p], self.kt[p]
                continue
            e = trial / size
            force[p, 1:] = limit * e
            after[p] = x[p, 1:] - limit * e / self.kt[p]
            slope[p, 1:, 1:] = self.kt[p] * limit / size * (np.eye(2) - np.outer(e, e))
            slope[p, 1:, 0] = -self.mu[p] * self.kn[p] * e
        return force, after, slope

    def static_state(self, steps=10):
        """Displacements and sliders at rest: load and interference grow in ten equal steps from the stuck,
        unloaded state, and each step is an equilibrium with the sliders of the step before."""
        u, w, G = np.zeros(self.n), np.zeros((self.p, 2)), self.contact_rows()
        for step in range(1, steps + 1):
            share = step / steps
            gap = np.where(self.gap < 0, share * self.gap, self.gap)
            scale = np.linalg.norm(self.f0) + np.linalg.norm(self.kn * np.minimum(self.gap, 0)) + 1e-9 * np.linalg.norm(self.kn * self.gap)

            def residual(u):
                force, after, slope = self.law((G @ u).reshape(-1, 3), w, gap)
                return self.K @ u + G.T @ force.ravel() - share * self.f0, after, slope

            r, after, slope = residual(u)
            for _ in range(400):
                if np.linalg.norm(r) <= 1e-11 * scale:
                    break
                J = self.K.copy()
                for p in range(self.p):
                    J += self.rows[p].T @ slope[p] @ self.rows[p]
                du = np.linalg.solve(J, -r)
                factor = 1.0
                while factor > 1e-3:
                    tried = residual(u + factor * du)
                    if np.linalg.norm(tried[0]) < (1 - 0.1 * factor) * np.linalg.norm(r):
                        break
                    factor *= 0.5
                u = u + factor * du
                r, after, slope = residual(u)
            else:
                raise NoMotion("static state")
            w = after
        return u, w

    def linear(self, omega, closed, w):
        """State at t = 0 of the vibration whose pairs stick (True) or are open, about the static state."""
        G = self.contact_rows()
        held = self.K.copy()
        for p in np.flatnonzero(closed):
            held += self.rows[p].T @ np.diag([self.kn[p], self.kt[p], self.kt[p]]) @ self.rows[p]
        u, v = np.zeros(self.n), np.zeros(self.n)
        for h, c, s in zip(self.orders, self.cosine, self.sine):
            z = held - (h * omega) ** 2 * self.M + 1j * h * omega * (self.alpha * self.K + self.beta * self.M)
            amplitude = np.linalg.solve(z, c + 1j * s)
            u, v = u + amplitude.real, v - h * omega * amplitude.imag
        return u, v

    def at(self, omega, u_scale, tolerance=1e-8, least_steps=100):
        return Map(self, omega, u_scale, tolerance, least_steps)


class Map:
    """Map of a period at one frequency, on z = (u, v / omega, sliders)."""

    def __init__(self, system, omega, u_scale, tolerance, least_steps):
        s = self.system = system
        self.omega, self.u_scale = omega, u_scale
        kept = [np.ascontiguousarray(a) for a in (s.K, s.inverse_mass, s.M, s.gap, s.mu, s.kn, s.kt, s.rows, s.f0, s.cosine,
                                                  s.sine, s.orders, s.weights)]
        self.kept = kept
        tolerance *= min(1.0, (10 * omega / s.fastest) ** 2)  # What stiff springs hold moves little.
        at = [a.ctypes.data for a in kept]
        self.model = CModel(s.n, s.p, len(s.weights), len(s.orders), *at[:3], s.alpha, s.beta, omega, *at[3:], u_scale,
                            tolerance, least_steps, s.is_diagonal)
        self.periods = 0

    def finer(self, tolerance, least_steps):
        return Map(self.system, self.omega, self.u_scale, tolerance, least_steps)

    def join(self, u, v, w):
        return np.concatenate([u, np.asarray(v) / self.omega, np.ravel(w)])

    def run(self, z, periods=1, figures=None, instants=0):
        state = np.array(z, float)
        n = self.system.n
        state[n:2 * n] *= self.omega
        path = np.zeros((instants, self.system.p, 3)) if instants else None
        figures = Figures() if instants and figures is None else figures
        code = COMPILED.integrate(ctypes.byref(self.model), state, periods, ctypes.byref(figures) if figures else None, instants,
                                 path.ctypes.data if instants else None)
        self.periods += periods
        if code or not np.isfinite(state).all():
            raise NoMotion("integration")
        state[n:2 * n] /= self.omega
        return (state, path) if instants else state

    def sliders_of(self, path, w):
        """Sliders that come of `w` along a period of the pairs, and which pairs slide in it still."""
        w, slides = np.array(w, float), np.zeros(self.system.p, np.int32)
        if not COMPILED.follow_path(ctypes.byref(self.model), np.ascontiguousarray(path), len(path), w, slides):
            raise NoMotion("sliders")
        return w, slides.astype(bool)


class Deadline:
    """Limit of processor time."""

    def __init__(self, seconds):
        self.end = time.process_time() + seconds

    def check(self):
        if time.process_time() > self.end:
            raise NoMotion("time")
