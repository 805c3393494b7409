"""Reading the folder of a finished run."""

import json

import numpy as np
import pytest

import dovetail


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "summary.json").write_text(json.dumps({"state": "finished", "pairs": 2}))
    (tmp_path / "response.csv").write_text(
        "point,stable,outcome,tip_amplitude_m,tip_h1_amplitude_m,tip_h1_phase_rad\n"
        "0,true,converged,2e-3,2e-3,0.5\n"
        "1,false,stagnated,,,\n"
    )
    return tmp_path


def test_columns_are_numbers_truths_or_texts(folder):
    found = dovetail.read(folder)
    assert (found.state, found.summary["pairs"], found.files) == ("finished", 2, ["response.csv"])
    table = found.response
    np.testing.assert_array_equal(table["point"], [0.0, 1.0])
    np.testing.assert_array_equal(table["stable"], [True, False])
    assert table["outcome"] == ["converged", "stagnated"]
    assert table["tip_amplitude_m"][0] == 2e-3 and np.isnan(table["tip_amplitude_m"][1])


def test_observed_displacements_are_complex_amplitudes(folder):
    observed = dovetail.read(folder).observed_m("tip")
    assert observed.shape == (2, 2)
    assert observed[0, 1] == pytest.approx(2e-3 * np.exp(-0.5j))
    assert np.isnan(observed[1]).all() and np.isnan(observed[0, 0])


def test_what_is_not_there_is_named(folder, tmp_path):
    found = dovetail.read(folder)
    with pytest.raises(FileNotFoundError, match="no contact.csv: its tables are response.csv"):
        found.contact
    with pytest.raises(KeyError, match="root.*tip"):
        found.observed_m("root")
    with pytest.raises(FileNotFoundError, match="summary.json"):
        dovetail.read(tmp_path / "nowhere")
