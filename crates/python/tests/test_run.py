"""Runs: results as arrays, progress, and how they are stopped."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import dovetail
from conftest import joint, reduced_scene


def test_a_run_has_the_numbers_of_the_program_to_the_bit(run, program, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(dovetail.Scene(reduced_scene(harmonics=3, samples=128)).to_toml())
    program("run", file, "--out", tmp_path / "out", "--no-cache", "--quiet")
    found = dovetail.read(tmp_path / "out")
    response, table = run.response, found.response
    assert response.observations == ["tip"]
    np.testing.assert_array_equal(response.frequency_hz, table["frequency_hz"])
    np.testing.assert_array_equal(response.amplitude_m[:, 0], table["tip_amplitude_m"])
    np.testing.assert_array_equal(response.linear_amplitude_m[:, 0], table["tip_linear_amplitude_m"])
    np.testing.assert_array_equal(response.estimated_error[:, 0], table["tip_estimated_error"])
    np.testing.assert_array_equal(response.friction_power_w, table["friction_power_w"])
    np.testing.assert_array_equal(response.pair_counts["slipping"], table["slipping_pairs"])
    assert response.outcome == table["outcome"]
    np.testing.assert_allclose(found.observed_m("tip")[:, 1:], response.observed_m("tip")[:, 1:])
    np.testing.assert_array_equal(-run.static_state.contact_force_n[:, 0], found.static["normal_force_n"])
    top = response[response.peak().index]
    np.testing.assert_array_equal(top.slid_m, found.contact["peak_slid_m"])
    assert found.summary["state"] == found.state == "finished"
    assert "response.csv" in found.files


def test_shapes_and_sums_of_a_response(run):
    response, pairs, points = run.response, len(run.pairs), len(run.response)
    assert (pairs, points) == (72, 5)
    assert response.amplitude_m.shape == response.estimated_error.shape == (points, 1)
    assert response.observed_m().shape == (points, 4)
    assert response.pair_friction_power_w.shape == (points, pairs)
    np.testing.assert_allclose(
        response.pair_friction_power_w.sum(axis=1), response.friction_power_w, rtol=1e-12
    )
    np.testing.assert_allclose(
        response.input_power_w, response.friction_power_w + response.viscous_power_w, rtol=1e-3
    )
    assert sum(response.pair_counts.values()).tolist() == [pairs] * points
    assert response.converged.all() and response.stable.count(False) == 0 and run.is_complete
    run.verdict()


def test_a_motion_is_its_own_fourier_series(run):
    motion = run.response[-1]
    harmonics, pairs = motion.harmonics, len(run.pairs)
    assert motion.frequency_hz == run.response.frequency_hz[-1]
    assert motion.relative_displacement_m.shape == (harmonics + 1, pairs, 3)
    blocks = motion.u.reshape(2 * harmonics + 1, pairs, 3)
    np.testing.assert_array_equal(motion.relative_displacement_m[0], blocks[0])
    np.testing.assert_array_equal(
        motion.relative_displacement_m[1:], blocks[1::2] - 1j * blocks[2::2]
    )
    phase, displacement, force = motion.signals(7, 64)
    order = np.arange(harmonics + 1)[:, None]
    for signal_of, amplitudes in (
        (displacement, motion.relative_displacement_m),
        (force, motion.contact_force_n),
    ):
        series = (amplitudes[:, 7, :, None] * np.exp(1j * order * phase)[:, None]).real.sum(axis=0)
        np.testing.assert_allclose(signal_of.T, series, atol=1e-12 * abs(series).max())
    observed = (motion.observed_m[0][1:] * np.exp(1j * np.outer(phase, order[1:]))).real.sum(axis=1)
    assert abs(observed).max() == pytest.approx(motion.amplitude_m[0], rel=1e-2)
    assert run.response.nearest(motion.frequency_hz + 0.1).frequency_hz == motion.frequency_hz


def test_pressures_are_forces_over_areas(meshed, run):
    motion, area = meshed.response[0], meshed.pairs.area_m2
    assert (area > 0).all() and len(set(meshed.pairs.contact)) == 2
    np.testing.assert_allclose(motion.pressure_mean_pa * area, motion.compression_mean_n)
    np.testing.assert_allclose(motion.pressure_max_pa * area, motion.compression_max_n)
    np.testing.assert_allclose(
        motion.compression_mean_n, -motion.contact_force_n[0, :, 0].real, atol=1e-12
    )
    assert (motion.compression_min_n <= motion.compression_max_n).all()
    np.testing.assert_allclose(
        motion.friction_energy_j_m2 * area * motion.frequency_hz, motion.pair_friction_power_w
    )
    statics = meshed.static_state
    np.testing.assert_allclose(statics.pressure_pa * area, -statics.contact_force_n[:, 0])
    # The folder of the reduced model has no areas.
    assert np.isnan(run.pairs.area_m2).all() and np.isnan(run.response[0].pressure_mean_pa).all()


def test_frames_are_orthonormal_and_normals_point_out_of_the_flanks(meshed):
    frame = meshed.pairs.frame
    np.testing.assert_allclose(
        np.einsum("pij,pkj->pik", frame, frame), np.broadcast_to(np.eye(3), frame.shape), atol=1e-9
    )
    assert meshed.pairs.position_m.shape == (len(meshed.pairs), 3)
    assert meshed.pairs.contacts == ["left", "right"]


def test_what_is_not_there_is_named(run):
    with pytest.raises(KeyError, match='"top".*tip'):
        run.response.peak("top")
    with pytest.raises(IndexError, match="there are tip"):
        run.response.observed_m(1)
    with pytest.raises(IndexError, match="there are 5"):
        run.response[5]
    with pytest.raises(IndexError, match="there are 72"):
        run.response[0].signals(72)
    with pytest.raises(dovetail.RunError, match="no bodies"):
        run.response[0].displacements_m()


def test_a_mesh_gives_fields_on_its_nodes(meshed):
    nodes, motion = meshed.nodes_m, meshed.response[0]
    assert set(nodes) == {"blade", "jaw"}
    fields = motion.displacements_m()
    assert fields["blade"].shape == (2, len(nodes["blade"]), 3)
    assert meshed.static_state.displacements_m()["jaw"].shape == nodes["jaw"].shape
    # The observed point is a corner of the blade's tip: its motion is that of a node.
    along = fields["blade"][1, :, 1]
    nearest = abs(along - motion.observed_m[0, 1]).min()
    assert nearest < 1e-9 * abs(along).max()
    kinds = {kind for kind, _, _, _ in meshed.modes}
    assert kinds == {"stuck", "linear"}


def test_a_disc_has_frequencies_at_each_nodal_diameter(root):
    disc = dovetail.Scene(root / "scenes/verification/disc_sector.toml")
    disc["mesh.file"] = str(root / "meshes/verification/disc_sector.msh")
    found = disc.nodal_diameters(progress=False, cache=False)
    assert [len(frequencies) for frequencies in found] == [6, 6, 6, 6]
    in_phase = [f for kind, _, _, f in disc.modes(progress=False, cache=False) if kind == "stuck"]
    assert found[0] == pytest.approx(in_phase[:6], rel=1e-9)
    assert joint().nodal_diameters(progress=False, cache=False) is None



def test_natural_frequencies_of_a_scene():
    modes = joint().modes(progress=False, cache=False)
    held = [hz for kind, body, _, hz in modes if (kind, body) == ("flanks_held", "blade")]
    stuck = [hz for kind, _, _, hz in modes if kind == "stuck"]
    assert held == sorted(held) and stuck == sorted(stuck)
    # Held flanks are stiffer than the joint.
    assert stuck[0] < held[0] < 1.2 * stuck[0]


def test_a_run_that_fails_says_why_and_what_to_do():
    scene = joint()
    scene["contact.left.first"] = "Nowhere"
    with pytest.raises(dovetail.RunError, match="Nowhere") as caught:
        scene.run(progress=False, cache=False)
    assert isinstance(caught.value, RuntimeError)


def test_frequencies_that_did_not_converge_are_nan_and_the_verdict_raises():
    scene = dovetail.Scene(reduced_scene(max_newton_iterations=1, harmonics=3, samples=64))
    run = scene.run(progress=False, cache=False)
    lost = ~run.response.converged
    assert lost.any() and not run.is_complete
    assert np.isnan(run.response.amplitude_m[lost]).all()
    assert np.isnan(run.response.observed_m()[lost]).all()
    with pytest.raises(dovetail.RunError, match="did not converge"):
        run.verdict()


def test_a_resonance_that_failed_has_no_peak():
    """With three iterations the resonance fails, and the frequencies next to it have motions."""
    keys = {"times_first_linear_mode": [0.96, 1.01], "points": 21, "max_newton_iterations": 3}
    scene = reduced_scene(**keys)
    del scene["response"]["frequency_hz"]
    scene["reduced_model"]["force_n"] = 0.3
    response = dovetail.Scene(scene).run(progress=False, cache=False).response
    assert response.peak() is None
    from_hz, to_hz = response.uncomputed_resonance_hz("tip")
    assert from_hz < response.linear_peak().frequency_hz < to_hz
    left = response.largest_amplitude()
    assert left.amplitude_m == np.nanmax(response.amplitude_m[:, 0])
    scene["response"]["max_newton_iterations"] = 60
    response = dovetail.Scene(scene).run(progress=False, cache=False).response
    assert response.uncomputed_resonance_hz() is None
    assert response.peak().amplitude_m > 1.5 * left.amplitude_m


def test_peaks_over_friction_are_those_of_runs_and_reach_an_amplitude(scene):
    del scene["response.points"]
    scene["response.frequency_hz"] = [696.5, 699.5]
    wanted = 1.3e-3
    peaks = scene.peaks(
        "reduced_model.friction", [0.1, 0.2], amplitude_m=wanted, progress=False, cache=False
    )
    assert peaks.observation == "tip" and (np.diff(peaks.value) > 0).all()
    assert not peaks.missing and peaks.least is None
    (reached,) = peaks.reached
    assert 0.1 < reached < 0.2
    at = list(peaks.value).index(reached)
    assert peaks.amplitude_m[at] == pytest.approx(wanted, rel=1e-3)
    assert peaks[at].amplitude_m[0] == peaks.amplitude_m[at]
    assert peaks[at].frequency_hz == peaks.frequency_hz[at]
    # The peak of a whole run with this friction is the same.
    scene["reduced_model.friction"] = reached
    of_run = scene.run(progress=False, cache=False).response.peak()
    assert of_run.amplitude_m == pytest.approx(wanted, rel=2e-3)


def test_peaks_refuse_what_they_cannot_go_through(scene):
    with pytest.raises(ValueError, match="ascend"):
        scene.peaks("reduced_model.friction", [0.2, 0.1])
    with pytest.raises(dovetail.SceneError, match="frictio"):
        scene.peaks("reduced_model.frictio", [0.1, 0.2])


def test_progress_is_heard_event_by_event(scene):
    events = []
    scene.run(progress=events.append, cache=False)
    kinds = [event["kind"] for event in events]
    assert kinds.count("frequency") == 5 and kinds.count("loop_begins") == 1
    loop = events[kinds.index("loop_begins")]
    steps = sum(event["steps"] for event in events if event["kind"] == "loop_advances")
    assert loop["steps"] == steps == 5
    titles = [event["title"] for event in events if event["kind"] == "stage_ends"]
    assert titles == ["reduced model", "static state", "response, 1 harmonic", "stability"]
    frequencies = sorted(e["frequency_hz"] for e in events if e["kind"] == "frequency")
    np.testing.assert_allclose(frequencies, np.linspace(695, 705, 5))


def test_lines_of_progress_name_stages_and_loops(capsys):
    from dovetail._progress import Lines

    lines = Lines(interval_s=0.0)
    dovetail.Scene(reduced_scene()).run(progress=lines, cache=False)
    told = capsys.readouterr().err
    assert "static state" in told and "frequencies: 5 of 5" in told


def test_a_bar_of_tqdm_counts_the_frequencies(monkeypatch):
    made = []

    class Tqdm:
        def __init__(self, total, **options):
            self.total, self.done, self.closed = total, 0, False
            made.append(self)

        def update(self, steps):
            self.done += steps

        def set_postfix_str(self, text, refresh):
            self.text = text

        def close(self):
            self.closed = True

        @staticmethod
        def write(text, file):
            print(text, file=file)

    module = type(sys)("tqdm.auto")
    module.tqdm = Tqdm
    monkeypatch.setitem(sys.modules, "tqdm", type(sys)("tqdm"))
    monkeypatch.setitem(sys.modules, "tqdm.auto", module)
    dovetail.Scene(reduced_scene()).run(cache=False)
    (bar,) = made
    assert (bar.total, bar.done, bar.closed) == (5, 5, True)
    assert "Hz" in bar.text


def test_what_a_callback_raises_stops_the_run(scene):
    scene["response.points"] = 400
    seen = []

    def refuse(event):
        if event["kind"] == "frequency":
            seen.append(event)
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        scene.run(progress=refuse, cache=False)
    assert len(seen) == 1
    with pytest.raises(TypeError, match="progress"):
        scene.run(progress=3)


@pytest.mark.parametrize("way", ["scene", "follow", "problem"])
def test_ctrl_c_stops_a_run_at_its_next_event(way, problem, scene):
    """A run of minutes ends within seconds of the signal."""
    scene.update({"response.points": None if way == "follow" else 20000, "response.harmonics": 5})
    scene["response.frequency_hz"] = [100.0, 3000.0]
    # A shell that runs its commands in the background leaves the signal ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        if way == "problem":
            hz = np.linspace(100, 3000, 20000)
            problem.response(hz, harmonics=5, progress=False)
        else:
            scene.run(progress=False, cache=False)
    assert 0.5 < time.monotonic() - begun < 20


def test_other_threads_of_python_go_on_during_a_run(scene):
    counted = 0
    done = threading.Event()

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    scene["response.points"] = 60
    scene.run(progress=False, cache=False)
    done.set()
    thread.join()
    assert counted > 10


def test_the_cache_keeps_reductions_and_fields_are_made_where_they_are_asked_for(tmp_path):
    for kept in (False, True):
        events = []
        run = joint().static_state(progress=events.append, cache=tmp_path)
        ends = [e for e in events if e["kind"] == "stage_ends" and e["title"] == "reduction"]
        assert ends and {end["from_cache"] for end in ends} == {kept}
    with pytest.raises(dovetail.RunError, match="fields=True"):
        run.static_state.displacements_m()
    with_fields = joint().static_state(progress=False, cache=tmp_path, fields=True)
    assert with_fields.static_state.displacements_m()["blade"].any()
    assert with_fields.response is None


def test_a_run_in_a_process_of_its_own_prints_lines_without_tqdm(tmp_path):
    script = (
        "import sys; sys.modules['tqdm'] = None; sys.path.insert(0, sys.argv[1])\n"
        "import dovetail, conftest\n"
        "dovetail.Scene(conftest.reduced_scene()).run(cache=False)\n"
    )
    here = os.path.dirname(__file__)
    done = subprocess.run(
        [sys.executable, "-c", script, here], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0 and "response, 1 harmonic" in done.stderr
