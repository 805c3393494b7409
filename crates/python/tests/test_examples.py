"""The notebooks run, and give the numbers that they are about."""

import json
import textwrap

import nbclient
import nbformat
import numpy as np
import pytest
from jupyter_client import KernelManager

import dovetail
from conftest import DATA, ROOT

EXAMPLES = ROOT / "crates/python/examples"


def executed(name, asked="None", **parameters):
    """What the cells of a notebook print, and the value of an expression behind the last of them.

    The parameters replace those of the cell that is marked for them, as papermill does."""
    notebook = nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4)
    marked = [i for i, c in enumerate(notebook.cells) if "parameters" in c.metadata.get("tags", [])]
    if parameters:
        given = "\n".join(f"{key} = {value!r}" for key, value in parameters.items())
        notebook.cells.insert(marked[0] + 1, nbformat.v4.new_code_cell(given))
    last = f"import json\nprint(json.dumps({asked}, default=lambda array: array.tolist()))"
    notebook.cells.append(nbformat.v4.new_code_cell(last))
    resources = {"metadata": {"path": str(EXAMPLES)}}
    nbclient.NotebookClient(notebook, timeout=240, resources=resources).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    printed = [output.text for output in outputs if output.output_type == "stream"]
    has_picture = any("image/png" in output.get("data", {}) for output in outputs)
    assert has_picture, "each notebook draws what it is about"
    return "".join(printed[:-1]), json.loads(printed[-1])


def test_every_notebook_is_tested_and_holds_no_results():
    tested = {"paper", "beam", "fit_joint", "friction_map"}
    assert {path.stem for path in EXAMPLES.glob("*.ipynb")} == tested
    for name in tested:
        cells = nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4).cells
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells), name


def test_the_paper_in_twenty_lines_has_the_peak_of_the_program(program, tmp_path):
    """With fewer harmonics than the paper, for the sake of time, and on the ready mesh."""
    cells = nbformat.read(EXAMPLES / "paper.ipynb", as_version=4).cells
    lines = [cell.source.splitlines() for cell in cells if cell.cell_type == "code"]
    assert len([line for line in lines[0] + lines[1] if line.strip()]) <= 20
    faster = {
        "mesh.file": "../meshes/dovetail.msh", "response.harmonics": 1, "response.points": 5,
        "response.times_first_linear_mode": [0.995, 1.0],
    }
    scene = dovetail.Scene(ROOT / "scenes/paper.toml").with_keys(
        faster | {"response.compare_harmonics": None}
    )
    written = tmp_path / "paper.toml"
    written.write_text(scene.to_toml().replace("../", f"{ROOT}/"))
    options = {"cache": str(tmp_path / "cache")}
    printed, amplitude_m = executed(
        "paper", "peak.amplitude_m", scene_file=str(written), options=options
    )
    assert f"{1e3 * amplitude_m:.2f} mm" in printed and "opening" in printed
    told = program("run", written, "--out", tmp_path / "out", "--no-fields", "--cache", tmp_path / "cache")
    of_program = dovetail.read(tmp_path / "out").summary["response"]
    assert told and of_program["peak_amplitude_m"] == amplitude_m


def test_the_beam_is_solved_by_both_solvers():
    printed, (own, ours) = executed("beam", "[own, ours]")
    assert own == pytest.approx(ours, rel=1e-5)
    assert "slipping" in printed and "stuck" in printed


def test_the_fit_finds_the_joint_within_the_noise_of_its_curves():
    asked = "[found, errors, noise, band, made_up, noise_asked]"
    _, values = executed("fit_joint", asked)
    found, errors, noise, band, made_up, noise_asked = map(np.array, values)
    assert (np.abs(np.log(found / made_up)) < 3 * errors).all()
    assert (errors < 0.2).all(), "the curves determine all three"
    assert 0.5 * noise_asked < noise < 2 * noise_asked
    assert (band < 2 * noise).all()


def test_the_map_depends_on_friction_over_force():
    """Twice the friction limits twice the force to twice the motion: the preload hardly changes."""
    _, peaks = executed(
        "friction_map", "peaks", folder=str(DATA), frictions=(0.1, 0.2), forces_n=(1.0, 2.0)
    )
    peaks = np.array(peaks)
    assert peaks[1, 1] == pytest.approx(peaks[0, 0], rel=0.03)
    assert peaks[0, 1] > 1.2 * peaks[0, 0] > 1.2**2 * peaks[1, 0]


def test_the_stop_button_of_a_notebook_ends_a_run():
    """The kernel lives on, and the next cell runs."""
    long = f"""
        import dovetail, time
        scene = dovetail.Scene({{
            "name": "long",
            "reduced_model": {{"folder": {str(DATA)!r}, "friction": 0.3, "force_n": 2.0}},
            "damping": {{"ratio": 0.001}},
            "response": {{"frequency_hz": [100.0, 3000.0], "points": 20000, "harmonics": 5}},
        }})
        print("begun", flush=True)
        scene.run(cache=False)
    """
    manager = KernelManager()
    manager.start_kernel(cwd=str(EXAMPLES))
    client = manager.client()
    client.start_channels()

    def run(source, when_printed=None):
        request, told, is_idle = client.execute(source), [], False

        def answer(next_message):
            # A client that waits for its kernel may ask it several times: those replies come too.
            while (message := next_message(timeout=60))["parent_header"].get("msg_id") != request:
                pass
            return message

        while not is_idle:
            told.append(answer(client.get_iopub_msg))
            content = told[-1]["content"]
            if when_printed and content.get("text", "").startswith("begun"):
                when_printed()
            is_idle = content.get("execution_state") == "idle"
        return answer(client.get_shell_msg)["content"], told

    try:
        client.wait_for_ready(timeout=60)
        ended, _ = run(textwrap.dedent(long), manager.interrupt_kernel)
        assert (ended["status"], ended["ename"]) == ("error", "KeyboardInterrupt")
        ended, told = run("print(len(scene.to_toml()) > 10)")
        assert ended["status"] == "ok"
        assert any(message["content"].get("text") == "True\n" for message in told)
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)


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
