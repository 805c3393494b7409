"""What the tests of the Python package share.

The package is the one that Python finds: package.rs and `make python` put it into target/python. The
program and the examples of the library are those of the same build; `DOVETAIL_BUILD` names its
folder, by default target/debug.
"""

import os
import pathlib
import subprocess

import numpy as np
import pytest

import dovetail

ROOT = pathlib.Path(__file__).resolve().parents[3]
DATA = ROOT / "tests/data/dovetail72"


def build():
    """Folder of the build that the program and the examples stand in."""
    target = os.environ.get("CARGO_TARGET_DIR", ROOT / "target")
    return pathlib.Path(os.environ.get("DOVETAIL_BUILD", pathlib.Path(target) / "debug"))


def reduced_scene(**response):
    """Scene about the reduced dovetail of 72 pairs, as a dictionary."""
    return {
        "name": "dovetail72",
        "reduced_model": {"folder": str(DATA), "friction": 0.3, "force_n": 1.0},
        "damping": {"ratio": 0.001},
        "response": {"frequency_hz": [695.0, 705.0], "points": 5, "harmonics": 1, "samples": 64}
        | response,
    }


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture
def scene():
    return dovetail.Scene(reduced_scene())


@pytest.fixture(scope="session")
def run():
    return dovetail.Scene(reduced_scene(harmonics=3, samples=128)).run(progress=False, cache=False)


@pytest.fixture(scope="session")
def meshed():
    """Run of a blade in its slot from a deck, with the motion of its nodes."""
    scene = joint().with_keys({
        "response.points": 1, "response.harmonics": 1, "response.stuck_modes": 6,
        "response.times_first_linear_mode": [1.0, 1.0],
    })
    return scene.run(progress=False, cache=False, fields=True)


def joint():
    return dovetail.Scene(ROOT / "scenes/decks/joint.toml")


@pytest.fixture(scope="session")
def problem():
    return dovetail.Problem.from_folder(DATA, friction=0.3, damping={"ratio": 0.001})


@pytest.fixture(scope="session")
def program():
    """Runs the program with arguments, and returns what it prints."""

    def run(*arguments, cwd=ROOT):
        command = [build() / "dovetail", *map(str, arguments)]
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def example():
    """Runs an example of the library, and returns what it prints."""

    def run(name, *arguments):
        command = [build() / "examples" / name, *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True, timeout=300).stdout

    return run


@pytest.fixture(scope="session")
def beam():
    """Matrices of a cantilever of Euler and Bernoulli in bending: deflection and slope of each node."""
    return cantilever(10)


def cantilever(elements, length=1.0, young=210e9, height=0.01, width=0.01, density=7800.0):
    inertia, area, step = width * height**3 / 12, width * height, length / elements
    k = young * inertia / step**3 * np.array([
        [12, 6 * step, -12, 6 * step],
        [6 * step, 4 * step**2, -6 * step, 2 * step**2],
        [-12, -6 * step, 12, -6 * step],
        [6 * step, 2 * step**2, -6 * step, 4 * step**2],
    ])
    m = density * area * step / 420 * np.array([
        [156, 22 * step, 54, -13 * step],
        [22 * step, 4 * step**2, 13 * step, -3 * step**2],
        [54, 13 * step, 156, -22 * step],
        [-13 * step, -3 * step**2, -22 * step, 4 * step**2],
    ])
    size = 2 * (elements + 1)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for element in range(elements):
        own = np.ix_(range(2 * element, 2 * element + 4), range(2 * element, 2 * element + 4))
        stiffness[own] += k
        mass[own] += m
    return stiffness, mass
