"""The reduced model of a folder of MatrixMarket arrays (crates/superelement/src/lib.rs), for programs other than dovetail.

Signs and equations: docs/method.md. Shapes: n = 3 pairs unknowns X (per pair N, t1, t2), r stuck modes q; of the physical
coordinates (X, q) the stiffness is [[K, 0], [0, diag w2]], the mass [[M, p], [p^T, I]], and C = a K + b M with b = 0 here.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.io import mmread


@dataclass
class ReducedModel:
    K: np.ndarray  # n x n, N/m
    M: np.ndarray  # n x n, kg
    p: np.ndarray  # n x r
    w2: np.ndarray  # r, (rad/s)^2
    static_n: np.ndarray  # n: the preload, mean of F on X
    excitation_x: np.ndarray  # n: cosine of harmonic 1 on X
    excitation_modes: np.ndarray  # r
    tip_x: np.ndarray  # n: the observed point is tip_x . X + tip_modes . q
    tip_modes: np.ndarray  # r
    friction: float
    stiffness_s: float  # a of C = a K
    eps: np.ndarray  # n, N/m: "pair" of docs/method.md

    def condensed(self, omega):
        """Lambda (complex, n x n) and the condensed unit cosine load (complex, n) at omega rad/s."""
        s, z = 1 + 1j * omega * self.stiffness_s, omega**2
        d = s * self.w2 - z
        stiffness = s * self.K - z * self.M - (self.p * (z**2 / d)) @ self.p.T
        return stiffness, self.excitation_x + self.p @ (z / d * self.excitation_modes)

    def tip(self, omega, harmonic, x):
        """Complex amplitude of the observed point from that of X, at `harmonic` of omega."""
        w = harmonic * omega
        s, z = 1 + 1j * w * self.stiffness_s, w**2
        load = self.excitation_modes if harmonic == 1 else 0.0
        q = (load + z * (self.p.T @ x)) / (s * self.w2 - z)
        return self.tip_x @ x + self.tip_modes @ q


@dataclass
class Case:
    model: ReducedModel
    hz: np.ndarray
    harmonics: int
    samples: int
    tolerance: float
    load_steps: int


def read_case(scene_path, harmonics):
    """The scene that dovetail runs, with this many harmonics."""
    scene_path = Path(scene_path)
    scene = tomllib.loads(scene_path.read_text())
    spec, response = scene["reduced_model"], scene["response"]
    folder = scene_path.parent / spec["folder"]

    def array(name):
        return np.asarray(mmread(folder / f"{name}.mtx"))

    K, M, w2 = array("stiffness"), array("mass"), array("squared_frequencies").ravel()
    K, M = (K + K.T) / 2, (M + M.T) / 2
    diagonal = np.diag(K).reshape(-1, 3)
    tangential = diagonal[:, 1:].mean(axis=1)
    model = ReducedModel(
        K=K,
        M=M,
        p=array("coupling"),
        w2=w2,
        static_n=array("static_load").ravel(),
        excitation_x=spec["force_n"] * array("excitations").ravel(),
        excitation_modes=spec["force_n"] * array("excitations_on_modes").ravel(),
        tip_x=array("observed_points").ravel(),
        tip_modes=array("observed_points_on_modes").ravel(),
        friction=spec["friction"],
        stiffness_s=2 * scene["damping"]["ratio"] / np.sqrt(w2[0]),
        eps=np.column_stack([diagonal[:, 0], tangential, tangential]).ravel(),
    )
    first, last = response["times_first_linear_mode"]
    hz = np.linspace(first, last, response["points"]) * np.sqrt(w2[0]) / (2 * np.pi)
    return Case(model, hz, harmonics, response["samples"], response["tolerance"], scene["static"]["load_steps"])
