"""Vibration of machine parts that rub on each other, in Python.

A run from a scene file to its peak::

    import dovetail
    scene = dovetail.Scene("scenes/paper.toml")
    scene["response.harmonics"] = 5
    run = scene.run()
    print(run.response.peak())

`Scene` describes a run and does it; `Run`, `Response`, `Motion`, `StaticState` and `Pairs` are its
results as numpy arrays. `Problem` is a reduced model, from matrices or from a folder, with
`Problem.static_state`, `Problem.response` and `Problem.balance`: residual and Jacobian of one
frequency for a solver of one's own. `read` opens the folder of a finished run of the program.

Names end with their unit: `frequency_hz`, `amplitude_m`. Errors are `SceneError`, with the key and
the remedy, and `RunError`; arguments of the wrong type or shape raise `TypeError` and `ValueError`.
"""

from ._dovetail import (
    Balance,
    Motion,
    Pair,
    Pairs,
    Peak,
    Peaks,
    Problem,
    Response,
    Run,
    Scene,
    Stability,
    StaticState,
    __version__,
)
from ._errors import Error, RunError, SceneError
from ._folder import Folder, read
from ._program import choose_gmsh as _choose_gmsh

__all__ = [
    "Balance",
    "Error",
    "Folder",
    "Motion",
    "Pair",
    "Pairs",
    "Peak",
    "Peaks",
    "Problem",
    "Response",
    "Run",
    "RunError",
    "Scene",
    "SceneError",
    "Stability",
    "StaticState",
    "__version__",
    "read",
]

_choose_gmsh()
