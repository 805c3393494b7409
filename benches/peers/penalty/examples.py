"""Published examples of pyHarm and tmdsimpy whose contacts are springs with sliders, as matrices that every program here takes.

- `jenkins`: tests/test_vprnm.py of tmdsimpy (test_known_solution): a mass on a spring and on a Jenkins element, with two
  published solutions.
- `gap`: tests/nonregression of pyHarm (onedofgap): a mass that strikes a spring behind a gap, with a published curve.
- `two_masses`: tests/nonregression of pyHarm (jenkins): a mass with a light one on it that a Jenkins element holds, with a
  published curve. Its viscous damping is not proportional to stiffness and mass, and dovetail has no other: the programs are
  compared with `damping` below, and pyHarm alone has the published damping, too.
- `friction`: examples/2dof_eldry_fric.py of tmdsimpy: a mass that slides while the normal force varies. Its damping is replaced in
  the normal direction alone, for the same reason. It has no published figures.

Units are kg, m, s, N. In the friction example the normal coordinate is positive where it presses.
"""

from dataclasses import dataclass, field

import numpy as np

# Samples of a period of the peers: tmdsimpy's default, and a number with which digits can be compared.
SAMPLES = [128, 2048]


@dataclass
class Example:
    name: str
    M: np.ndarray
    K: np.ndarray
    damping: tuple  # (a, b) of C = a K + b M
    force: np.ndarray  # amplitude of cos(w t) at level 1
    observed: int
    harmonics: int
    cases: list  # (level of the force, w)
    normal: int | None = None  # coordinate that presses where it is positive; without it `preload` presses
    tangential: int | None = None
    preload: float = 0.0  # constant force that presses: on the pair, or in the static state on `normal`
    gap: float = 0.0
    kn: float = 1.0
    kt: float = 1.0
    mu: float = 0.0
    published: dict = field(default_factory=dict)
    # Range of w in which the curve is followed round its folds.
    followed: tuple | None = None

    @property
    def C(self):
        a, b = self.damping
        return a * self.K + b * self.M


def even(level, first, last, points):
    return [(level, float(w)) for w in np.linspace(first, last, points)]


JENKINS = Example(
    name="jenkins",
    M=np.array([[1.0]]),
    K=np.array([[0.75]]),
    damping=(0.0, 0.01),
    force=np.array([1.0]),
    observed=0,
    harmonics=3,
    cases=[(1.0, 0.3115958), (100.0, 0.28892166)],
    tangential=0,
    preload=0.4,
    kt=0.25,
    mu=0.5,
    # Amplitudes of the first and the third harmonic at the cases.
    published={
        0: (np.hypot(1.28497308, 0.2842021), np.hypot(0.50030017, 0.22542694)),
        1: (np.hypot(150.01064345, 1.0314443), np.hypot(9.20507502, 2.65110885)),
    },
)

GAP = Example(
    name="gap",
    M=np.array([[1.0]]),
    K=np.array([[40.0]]),
    damping=(0.0, 0.1 * float(np.sqrt(40.0))),
    force=np.array([100.0]),
    observed=0,
    harmonics=7,
    # The curve folds from 7.00 to 8.57 rad/s: one motion for each frequency of the cases, and the rest is followed.
    cases=even(1.0, 5.6, 6.9, 14),
    followed=(5.6, 9.5),
    normal=0,
    gap=10.0,
    kn=1000.0,
    # Points of tests/nonregression/NonRegressionData/onedofgap/ref_sol.csv: w, and the norm of all coefficients, in 10 m there.
    published={
        5.794884202876134: 10.170288833706012,
        6.267587035448577: 10.654513014047438,
        6.769057710680533: 11.532707354798097,
    },
)

# The published damping: not proportional to K and M.
TWO_MASSES_C = 0.05 * np.array([[2.0, -1.0], [-1.0, 1.0]])
TWO_MASSES = Example(
    name="two_masses",
    M=np.diag([1.0, 0.02]),
    K=np.array([[680.0, -40.0], [-40.0, 40.0]]),
    # The published 0.1 N s/m of the heavy mass.
    damping=(0.1 / 680.0, 0.0),
    force=np.array([1.0, 0.0]),
    observed=0,
    harmonics=7,
    cases=even(1.0, 25.7, 26.1, 9),
    tangential=1,
    preload=5.0,
    kn=200.0,
    kt=200.0,
    mu=1.0,
    # Points of tests/nonregression/NonRegressionData/jenkins/ref_sol.csv: w, and the norm of all coefficients.
    published={
        25.502111417917360: 0.04407146500819515,
        25.906800235089050: 0.150313689623987,
        26.303755864363577: 0.05239749920116422,
    },
)

FRICTION = Example(
    name="friction",
    M=np.eye(2),
    K=np.diag([12.0, 21.0]),
    # 5 % of the tangential spring's frequency, as published.
    damping=(2 * 0.05 * float(np.sqrt(12.0)) / 12.0, 0.0),
    force=np.array([1.0, 0.1]),
    observed=0,
    harmonics=8,
    cases=even(25.0, 3.0, 6.0, 7) + even(80.0, 3.0, 6.0, 7) + even(300.0, 3.0, 6.0, 7),
    normal=1,
    tangential=0,
    preload=100.0,
    kn=21.0,
    kt=5.0,
    mu=0.85,
)

EXAMPLES = [JENKINS, GAP, TWO_MASSES, FRICTION]
