"""The examples run, and give the numbers that they are about."""

import importlib.util

import numpy as np
import pytest

import dovetail
from conftest import DATA, ROOT

EXAMPLES = ROOT / "crates/python/examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_example_is_tested():
    tested = {"paper", "beam", "fit_joint", "friction_map"}
    assert {path.stem for path in EXAMPLES.glob("*.py")} == tested


def test_the_paper_in_twenty_lines_has_the_peak_of_the_program(program, tmp_path, capsys):
    """With fewer harmonics than the paper, for the sake of time, and on the ready mesh."""
    source = (EXAMPLES / "paper.py").read_text().split('"""')[2]
    assert len([line for line in source.splitlines() if line.strip()]) <= 20
    faster = {
        "mesh.file": "../meshes/dovetail.msh", "response.harmonics": 1, "response.points": 5,
        "response.times_first_linear_mode": [0.995, 1.0],
    }
    scene = dovetail.Scene(ROOT / "scenes/paper.toml").with_keys(
        faster | {"response.compare_harmonics": None}
    )
    written = tmp_path / "paper.toml"
    written.write_text(scene.to_toml().replace("../", f"{ROOT}/"))
    run = load("paper").main(written, progress=False, cache=tmp_path / "cache")
    printed = capsys.readouterr().out
    peak = run.response.peak("tip")
    assert f"{1e3 * peak.amplitude_m:.2f} mm" in printed and "opening" in printed
    told = program("run", written, "--out", tmp_path / "out", "--no-fields", "--cache", tmp_path / "cache")
    of_program = dovetail.read(tmp_path / "out").summary["response"]
    assert told and of_program["peak_amplitude_m"] == peak.amplitude_m


def test_the_beam_is_solved_by_both_solvers(capsys):
    own, ours = load("beam").main()
    assert own == pytest.approx(ours, rel=1e-5)
    printed = capsys.readouterr().out
    assert "slipping" in printed and "stuck" in printed


def test_the_fit_finds_the_joint_within_the_noise_of_its_curves(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    module = load("fit_joint")
    found, errors, noise, band = module.main()
    assert (np.abs(np.log(found / module.TRUTH)) < 3 * errors).all()
    assert (errors < 0.2).all(), "the curves determine all three"
    assert 0.5 * module.NOISE < noise < 2 * module.NOISE
    assert (band < 2 * noise).all()


def test_the_map_depends_on_friction_over_force():
    """Twice the friction limits twice the force to twice the motion: the preload hardly changes."""
    peaks = load("friction_map").main(str(DATA), frictions=(0.1, 0.2), forces_n=(1.0, 2.0))
    assert peaks[1, 1] == pytest.approx(peaks[0, 0], rel=0.03)
    assert peaks[0, 1] > 1.2 * peaks[0, 0] > 1.2**2 * peaks[1, 0]


def test_the_code_of_the_guide_runs_from_matrices_to_a_solver_of_ones_own():
    """The first block is the paper, which has its own test."""
    guide = (ROOT / "docs/how-to/python.md").read_text()
    blocks = [block.split("```")[0] for block in guide.split("```python\n")[1:]]
    assert len(blocks) == 3
    compile(blocks[0], "first block", "exec")
    names = {}
    for block in blocks[1:]:
        exec(block, names)
    assert names["curve"].converged.all()
    found = names["balance"].motion(names["u"])
    assert found.residual < 1e-9
    ours = names["problem"].response([0.2], harmonics=3, progress=False)
    assert found.amplitude_m[0] == pytest.approx(ours.amplitude_m[0, 0], rel=1e-6)
