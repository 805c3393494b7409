"""The types of the compiled classes are those that they have, and everything has its doc."""

import ast
import inspect
import pathlib
import re

import pytest

import dovetail
from dovetail import _dovetail

STUBS = ast.parse((pathlib.Path(dovetail.__file__).parent / "_dovetail.pyi").read_text())
CLASSES = {node.name: node for node in STUBS.body if isinstance(node, ast.ClassDef)}
# Those that Python itself calls; a sequence is iterated over by its items.
SILENT = {
    "__repr__", "__copy__", "__deepcopy__", "__getnewargs_ex__", "__slotnames__", "__doc__",
    "__module__",
}


def own(name):
    """Members that a class defines, by name."""
    members = vars(getattr(_dovetail, name)).items()
    return {key: member for key, member in members if key not in SILENT}


def typed(name):
    """Functions of the class in the stubs, by name."""
    return {node.name: node for node in CLASSES[name].body if isinstance(node, ast.FunctionDef)}


def test_all_classes_have_types():
    compiled = {name for name, of in vars(_dovetail).items() if inspect.isclass(of)}
    assert compiled == set(CLASSES)
    assert compiled <= set(dovetail.__all__)
    assert (pathlib.Path(dovetail.__file__).parent / "py.typed").is_file()


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_the_members_of_a_class_are_those_of_its_types(name):
    # Every compiled class has `__new__`; those that cannot be made by a user have no type of it.
    assert set(own(name)) - {"__new__"} == set(typed(name)) - {"__iter__", "__new__"}
    for key, node in typed(name).items():
        is_property = any(getattr(d, "id", "") == "property" for d in node.decorator_list)
        member = own(name).get(key)
        if key in ("__iter__", "__new__"):
            continue
        assert is_property == inspect.isdatadescriptor(member), key


def parameters(node):
    """Parameters of a function of the stubs: name, whether it is a keyword, and its default."""
    arguments = node.args
    positional = arguments.args[1 if arguments.args and arguments.args[0].arg in ("self", "cls") else 0 :]
    defaults = [None] * (len(positional) - len(arguments.defaults)) + arguments.defaults
    plain = [(a.arg, False, d) for a, d in zip(positional, defaults)]
    keywords = [(a.arg, True, d) for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults)]
    return [(n, k, inspect.Parameter.empty if d is None else ast.literal_eval(d)) for n, k, d in plain + keywords]


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_the_parameters_of_functions_are_those_of_their_types(name):
    checked = 0
    for key, node in typed(name).items():
        member = getattr(_dovetail, name) if key == "__new__" else own(name).get(key)
        if key.startswith("__") and key != "__new__" or inspect.isdatadescriptor(member):
            continue
        signature = inspect.signature(getattr(member, "__func__", member))
        found = [
            (p.name, p.kind is p.KEYWORD_ONLY, p.default)
            for p in signature.parameters.values()
            if p.name not in ("self", "cls")
        ]
        assert found == parameters(node), f"{name}.{key}"
        checked += 1
    assert checked or name in {"Peak", "Pairs", "Peaks", "Stability"}


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_every_class_function_and_property_has_a_doc(name):
    assert inspect.getdoc(getattr(_dovetail, name))
    for key, member in own(name).items():
        if not key.startswith("__"):
            doc = inspect.getdoc(getattr(member, "__func__", member))
            assert doc, f"{name}.{key}"


UNITS = {"m": "m", "hz": "Hz", "n": "N", "w": "W", "pa": "Pa", "j": "J", "m2": "m2", "kg": "kg"}


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_the_doc_of_a_quantity_has_its_unit_and_that_of_an_array_its_shape(name):
    """Names end with their unit, and docs repeat it. Parentheses with commas are shapes."""
    for key, node in typed(name).items():
        if key.startswith("__") or not own(name).get(key):
            continue
        doc = " ".join(inspect.getdoc(getattr(own(name)[key], "__func__", own(name)[key])).split())
        unit = UNITS.get(key.rsplit("_", 1)[-1])
        if unit and "_" in key:
            assert re.search(rf"\b{unit}\b", doc), f"{name}.{key} has no unit {unit}: {doc}"
        returns = ast.unparse(node.returns)
        if returns in ("Floats", "Complexes", "Ints", "Bools") and name not in ("Peaks",):
            assert re.search(r"\([^()]*,[^()]*(\([^()]*\)[^()]*)?\)|ascending", doc), f"{name}.{key}: {doc}"
