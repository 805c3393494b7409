"""Scenes: where they come from, their keys, and what is refused."""

import copy
import pathlib
import pickle

import numpy as np
import pytest

import dovetail
from conftest import reduced_scene


def test_a_scene_is_the_same_from_a_file_a_text_and_a_dictionary(root, tmp_path):
    file = root / "scenes/paper.toml"
    of_file = dovetail.Scene(file)
    of_text = dovetail.Scene.from_toml(file.read_text(), folder=file.parent)
    of_dict = dovetail.Scene(of_file.to_dict(), folder=file.parent)
    assert of_file.name == of_text.name == of_dict.name == "paper"
    assert of_file.to_dict() == of_text.to_dict() == of_dict.to_dict()
    assert of_file.folder == of_dict.folder == file.parent
    written = tmp_path / "again.toml"
    written.write_text(of_dict.to_toml())
    assert dovetail.Scene(written).to_dict() == of_file.to_dict()


def test_keys_are_read_and_set_by_dotted_paths(root):
    scene = dovetail.Scene(root / "scenes/paper.toml")
    scene["response.harmonics"] = 5
    scene["contact.left.friction"] = np.float64(0.1)
    scene["contact.1.friction"] = 0.2
    scene["observe.0.direction"] = np.array([0, 0, 1])
    assert scene["response.harmonics"] == 5
    assert scene["contact.*.friction"] == [0.1, 0.2]
    assert scene["contact.right"]["friction"] == 0.2
    assert scene["observe.0.direction"] == [0, 0, 1]
    assert "response.points" not in scene and scene.get("response.points", 7) == 7
    with pytest.raises(KeyError, match="response.points"):
        scene["response.points"]


def test_a_key_displaces_those_that_it_excludes_and_can_be_removed(scene):
    scene["response.accuracy"] = 0.01
    assert "response.harmonics" not in scene
    scene["response.harmonics"] = 2
    assert "response.accuracy" not in scene
    del scene["response.points"]
    assert "response.points" not in scene
    scene.update({"response.points": 4, "response.harmonics": None})
    assert scene["response.points"] == 4 and "response.harmonics" not in scene


def test_several_keys_are_set_on_a_copy(scene):
    other = scene.with_keys({"reduced_model.friction": 0.1, "response.points": 3})
    assert (other["reduced_model.friction"], other["response.points"]) == (0.1, 3)
    assert (scene["reduced_model.friction"], scene["response.points"]) == (0.3, 5)


@pytest.mark.parametrize(
    ("key", "value", "named", "words"),
    [
        ("response.harmonics", -1, "response.harmonics", "0 or more"),
        ("response.harmonics", "many", "response.harmonics", "write it like this"),
        ("response.harmonix", 3, "response.harmonix", "the keys of `response` are"),
        ("reduced_model.friction", -0.1, "reduced_model.friction", "give a value"),
        ("response.solver", "newton", "response.solver", "the choices are"),
        ("excitation.tip.force_n", 1.0, "excitation", "write it like this"),
    ],
)
def test_what_is_not_possible_names_the_key_and_the_remedy_and_changes_nothing(
    scene, key, value, named, words
):
    before = scene.to_dict()
    with pytest.raises(dovetail.SceneError) as caught:
        scene[key] = value
    error = caught.value
    assert error.key == named
    assert words in error.remedy or words in error.message
    assert error.remedy in str(error) and isinstance(error, ValueError)
    assert scene.to_dict() == before


def test_all_problems_of_a_scene_are_listed():
    wrong = reduced_scene(harmonics=-1, samples="few")
    with pytest.raises(dovetail.SceneError) as caught:
        dovetail.Scene(wrong)
    assert {key for key, _, _ in caught.value.problems} == {"response.harmonics", "response.samples"}
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.problems == caught.value.problems and str(again) == str(caught.value)


@pytest.mark.parametrize(
    ("value", "words"),
    [(1j, "complex"), (np.array([1j]), "complex"), (object(), "object"), ({1: 2}, "texts")],
)
def test_values_that_a_scene_does_not_have_are_refused_with_their_key(scene, value, words):
    with pytest.raises(TypeError, match=words) as caught:
        scene["response.frequency_hz"] = value
    assert "response.frequency_hz" in str(caught.value)


def test_a_file_that_is_not_there_or_no_scene_is_named(tmp_path):
    with pytest.raises(dovetail.SceneError, match="nowhere.toml"):
        dovetail.Scene(tmp_path / "nowhere.toml")
    with pytest.raises(dovetail.SceneError, match="TOML"):
        dovetail.Scene.from_toml("= 1")
    with pytest.raises(TypeError, match="dictionary"):
        dovetail.Scene(3)
    with pytest.raises(ValueError, match="dotted path"):
        dovetail.Scene(reduced_scene())["a=b"] = 1


def test_scenes_are_copied_and_pickled(scene):
    for again in (copy.copy(scene), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert again.to_dict() == scene.to_dict()
        again["response.points"] = 2
        assert scene["response.points"] == 5
    assert isinstance(scene.folder, pathlib.Path)


def test_a_dictionary_that_contains_itself_is_refused():
    loop = {"name": "loop"}
    loop["response"] = [loop]
    with pytest.raises(ValueError, match="contains itself"):
        dovetail.Scene(loop)
