"""The commands of the wheel, and which gmsh they take. `make try-install` tries the wheel itself."""

import os
import subprocess
import sys

import pytest

from dovetail import _program


def command(folder, name):
    folder.mkdir(exist_ok=True)
    file = folder / name
    file.write_text("#!/bin/sh\n")
    file.chmod(0o755)
    return str(file)


@pytest.fixture
def chosen(tmp_path, monkeypatch):
    """What choose_gmsh leaves in the environment, for folders in PATH."""
    own = command(tmp_path / "own", "dovetail-gmsh")
    monkeypatch.setattr(_program, "_command", lambda name: own)

    def choose(*folders, before=""):
        monkeypatch.setenv(_program.GMSH, before)
        monkeypatch.setenv("PATH", os.pathsep.join(str(tmp_path / folder) for folder in folders))
        _program.choose_gmsh()
        return os.environ[_program.GMSH].replace(str(tmp_path), "")

    return choose


def test_the_gmsh_of_the_package_is_taken_where_path_has_no_other_one(chosen, tmp_path):
    assert chosen("empty") == "/own/dovetail-gmsh"
    # The command of the package of gmsh itself, of an environment that is active.
    command(tmp_path / "own", "gmsh")
    assert chosen("own") == "/own/dovetail-gmsh"
    command(tmp_path / "system", "gmsh")
    assert chosen("system", "own") == ""
    assert chosen("empty", before="mine") == "mine"


def test_a_package_without_the_program_says_so(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["dovetail", "--version"])
    monkeypatch.setattr(_program, "__file__", "/nowhere/_program.py")
    with pytest.raises(SystemExit, match="cannot start /nowhere/program/dovetail: No such file"):
        _program.program()


def test_the_package_is_imported_without_numpy():
    words = "import dovetail, sys; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", words], check=True)
