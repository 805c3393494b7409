"""The integrator against closed forms: prints each value beside the exact one, and fails on a miss.

    python3 benches/truth/check.py
"""

import sys

import numpy as np
from scipy.optimize import brentq, fsolve

from motion import System
from periodic import solutions

MISSES = []


def compare(name, found, exact, tolerance):
    error = abs(found - exact) / abs(exact)
    print(f"{name:58} {found:.9g}  exact {exact:.9g}  off by {error:.1e}")
    if not error <= tolerance:
        MISSES.append(name)


def model(K, M, pairs, force, hz, static=None, damping=None, observe=0):
    size = len(K)
    keys = ("against", "frame")
    full = [{**{"friction": 0.0, "gap_m": 0.0, "preload_n": 0.0}, **dict.fromkeys(keys), **pair} for pair in pairs]
    weights = np.zeros(size)
    weights[observe] = 1
    return {"K": K, "M": M, "damping": damping or {"stiffness_s": 0.0, "mass_per_s": 0.0}, "pairs": full,
            "static_load": np.zeros(size) if static is None else static,
            "excitation": {"1": {"re": np.real(force), "im": np.imag(force)}}, "observe": [weights], "frequency_hz": [hz]}


def only(found):
    solved, reasons = found
    if not solved:
        sys.exit(f"no motion: {reasons}")
    return solved[0]


def springs(normal, tangential):
    return {"normal_stiffness_n_m": normal, "tangential_stiffness_n_m": tangential}


def linear():
    """A mass whose pair never touches."""
    K, M, w = np.diag([2.0, 1.0, 1.0]), np.eye(3), 1.3
    pair = {"unknowns": [0, 1, 2], "gap_m": 100.0, **springs(1.0, 1.0)}
    at = model(K, M, [pair], np.array([1.0, 0, 0]), w / 2 / np.pi, damping={"stiffness_s": 0.02, "mass_per_s": 0.03})
    motion = only(solutions(at, w / 2 / np.pi, tries=1))
    c = 0.02 * 2 + 0.03
    compare("linear oscillator: amplitude", motion["values"]["amplitude_m"][0], 1 / abs(2 - w * w + 1j * w * c), 1e-8)
    compare("linear oscillator: damping power", motion["values"]["damping_w"][0],
            c * w * w / 2 / abs(2 - w * w + 1j * w * c) ** 2, 1e-7)
    decay = [np.exp(np.roots([1, 0.02 * k + 0.03, k]).real.max() * 2 * np.pi / w) for k in (2.0, 1.0)]
    compare("linear oscillator: largest multiplier", abs(motion["multipliers"][0]), max(decay), 1e-6)


def den_hartog():
    """Coulomb friction without stops (Den Hartog 1931): rigid, by springs of growing stiffness."""
    for w, ratio in ((0.6, 0.3), (0.8, 0.4), (1.3, 0.5), (1.8, 0.3)):
        limit = ratio
        pair = {"unknowns": [0, 1, 2], "friction": limit, "preload_n": 1.0, "normal_stiffness_n_m": None, "tangential_stiffness_n_m": None}
        at = model(np.diag([1.0, 1.0, 1.0]), np.eye(3), [pair], np.array([0, 1.0, 0]), w / 2 / np.pi, observe=1)
        motion = only(solutions(at, w / 2 / np.pi, tries=1))
        beta = 1 / w
        V = 1 / (1 - w * w)
        U = beta * np.sin(np.pi * beta) / (1 + np.cos(np.pi * beta))
        exact = np.sqrt(V * V - (limit * U) ** 2)
        compare(f"Den Hartog, w = {w}, friction {limit}: amplitude", motion["values"]["amplitude_m"][0], exact, 2e-4)
        compare(f"Den Hartog, w = {w}: friction power", motion["values"]["friction_power_w"][0], 4 * limit * exact * w / 2 / np.pi, 5e-4)


def circle():
    """A mass that a turning force slides in a circle: the direction of friction."""
    mu, N, c, F = 0.5, 1.0, 0.05, 0.8
    for w in (0.9, 0.97, 1.0, 1.1):
        pair = {"unknowns": [0, 1, 2], "friction": mu, "preload_n": N, "normal_stiffness_n_m": None, "tangential_stiffness_n_m": None}
        at = model(np.eye(3), np.eye(3), [pair], np.array([0, F, 1j * F]), w / 2 / np.pi, damping={"stiffness_s": 0.0, "mass_per_s": c}, observe=1)
        motion = only(solutions(at, w / 2 / np.pi, tries=1))
        b, a, q = c * w * mu * N, (1 - w * w) ** 2 + (c * w) ** 2, mu * mu * N * N - F * F
        exact = (-b + np.sqrt(b * b - a * q)) / a
        compare(f"sliding circle, rigid, w = {w}: amplitude", motion["values"]["amplitude_m"][0], exact, 2e-4)


def elastic_circle():
    """The same with a spring kt: the slider runs in a circle of its own, at a right angle to its force."""
    mu, N, c, F, kt, w = 0.5, 1.0, 0.002, 0.8, 20.0, 0.9
    pair = {"unknowns": [0, 1, 2], "friction": mu, "preload_n": N, **springs(50.0, kt)}
    at = model(np.diag([1e-9, 1.0, 1.0]), np.eye(3), [pair], np.array([0, F, 1j * F]), w / 2 / np.pi, damping={"stiffness_s": 0.0, "mass_per_s": c}, observe=1)
    motion = only(solutions(at, w / 2 / np.pi, tries=1))

    def balance(A):
        # x = A, slider w of radius r with |x - w| = mu N / kt at a right angle to w.
        lag = mu * N / kt
        r = np.sqrt(A * A - lag * lag)
        force = mu * N * (lag / A + 1j * r / A)  # along and across x
        return abs((1 - w * w + 1j * c * w) * A + force) - F

    exact = brentq(balance, 0.1, 100)
    compare("sliding circle, springs: amplitude", motion["values"]["amplitude_m"][0], exact, 1e-7)
    lag = mu * N / kt
    compare("sliding circle, springs: slid distance", motion["values"]["slid_m"][0], 2 * np.pi * np.sqrt(exact**2 - lag**2), 1e-6)


def stop():
    """A mass with a stop of low stiffness that it touches once a period: two linear pieces, matched."""
    k, ks, c, F, w, gap = 1.0, 0.7, 0.1, 1.0, 0.8, 0.4
    pair = {"unknowns": [0, 1, 2], "gap_m": gap, **springs(ks, 1.0)}
    at = model(np.diag([k, 1.0, 1.0]), np.eye(3), [pair], np.array([F, 0, 0]), w / 2 / np.pi, damping={"stiffness_s": 0.0, "mass_per_s": c})
    motion = only(solutions(at, w / 2 / np.pi, tries=1))

    def flight(kk, shift, t0, x0, v0, t):
        """x and v at t of m x'' + c x' + kk x + shift = F cos w t from (x0, v0) at t0."""
        z = F / (kk - w * w + 1j * w * c)
        part = lambda t: ((z * np.exp(1j * w * t)).real - shift / kk, (1j * w * z * np.exp(1j * w * t)).real)
        wd, a, b = np.sqrt(kk - c * c / 4), x0 - part(t0)[0], v0 - part(t0)[1]
        d = t - t0
        s = (b + c / 2 * a) / wd
        x = np.exp(-c * d / 2) * (a * np.cos(wd * d) + s * np.sin(wd * d))
        v = np.exp(-c * d / 2) * ((s * wd - c / 2 * a) * np.cos(wd * d) - (a * wd + c / 2 * s) * np.sin(wd * d))
        return x + part(t)[0], v + part(t)[1]

    T = 2 * np.pi / w

    def match(q):
        touch, leave, v_in, v_out = q
        x1, v1 = flight(k + ks, ks * gap, touch, -gap, v_in, leave)
        x2, v2 = flight(k, 0.0, leave, -gap, v_out, touch + T)
        return [x1 + gap, v1 - v_out, x2 + gap, v2 - v_in]

    best = None
    for touch in np.linspace(0, T, 25):
        q, _, ok, _ = fsolve(match, [touch, touch + 0.4 * T, -1.0, 1.0], full_output=True, xtol=1e-13)
        if ok == 1 and T > q[1] - q[0] > 0 and q[2] < 0 < q[3]:
            best = q
    touch, leave, v_in, v_out = best
    inside = flight(k + ks, ks * gap, touch, -gap, v_in, np.linspace(touch, leave, 200001))[0]
    compare("mass with a stop: largest force", motion["values"]["most_n"][0], ks * (-inside.min() - gap), 1e-7)
    outside = flight(k, 0.0, leave, -gap, v_out, np.linspace(leave, touch + T, 200001))[0]
    mean = (np.trapezoid(inside, dx=(leave - touch) / 200000) + np.trapezoid(outside, dx=(touch + T - leave) / 200000)) / T
    compare("mass with a stop: amplitude", motion["values"]["amplitude_m"][0], max(outside.max() - mean, mean - inside.min()), 1e-7)


def jenkins():
    """Loss of a Jenkins element in a cycle, 4 mu N (X - mu N / kt), at the amplitude that it has."""
    mu, N, kt, w = 0.3, 1.0, 2.0, 1.1
    pair = {"unknowns": [0, 1, 2], "friction": mu, "preload_n": N, **springs(50.0, kt)}
    at = model(np.diag([1e-9, 1.0, 1.0]), np.eye(3), [pair], np.array([0, 1.0, 0]), w / 2 / np.pi, damping={"stiffness_s": 0.0, "mass_per_s": 0.05}, observe=1)
    motion = only(solutions(at, w / 2 / np.pi, tries=1))
    X = motion["values"]["amplitude_m"][0]
    compare("Jenkins element: loss of a cycle", motion["values"]["friction_power_w"][0] * 2 * np.pi / w, 4 * mu * N * (X - mu * N / kt), 1e-7)
    compare("Jenkins element: slid distance", motion["values"]["slid_m"][0], 4 * (X - mu * N / kt), 1e-7)


def static():
    """Sliding wedge at rest: a mass pulled along by more than friction holds."""
    pair = {"unknowns": [0, 1, 2], "friction": 0.2, "preload_n": 1.0, **springs(50.0, 10.0)}
    at = model(np.diag([1e-9, 3.0, 1.0]), np.eye(3), [pair], np.zeros(3), 1.0, static=np.array([0, 2.0, 0]))
    u, w = System(at).static_state()
    compare("static state: displacement", u[1], (2.0 - 0.2) / 3.0, 1e-8)
    compare("static state: slider", w[0, 0], (2.0 - 0.2) / 3.0 - 0.2 / 10.0, 1e-8)


def main():
    for check in (linear, jenkins, elastic_circle, stop, static, den_hartog, circle):
        check()
    if MISSES:
        sys.exit("missed: " + "; ".join(MISSES))
    print("all closed forms are met")


if __name__ == "__main__":
    main()
