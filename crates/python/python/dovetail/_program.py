"""The commands of the wheel: the program `dovetail`, and the gmsh of its Python package.

The wheel has the program as a file. It is no call into the extension module: signals, exit codes,
the end for lack of memory and the processes of a study are then those of the program.
"""

import os
import sys

#: Variable by which the program and the module are told of another gmsh than that in PATH.
GMSH = "DOVETAIL_GMSH"

#: Packages of Debian and Ubuntu with the libraries that the Python package of gmsh does not have.
OF_GMSH = "libgl1 libglu1-mesa libgomp1 libxcursor1 libxft2 libxinerama1"


def program():
    """Command `dovetail`: becomes the program."""
    file = os.path.join(os.path.dirname(os.path.abspath(__file__)), "program", "dovetail")
    try:
        os.execv(file, sys.argv)
    except OSError as error:
        sys.exit(
            f"dovetail: cannot start {file}: {error.strerror}. Wheels of `make wheel` have the "
            "program: install one again with `pip install --force-reinstall`"
        )


def gmsh():
    """Command `dovetail-gmsh`: gmsh of the Python package, by the Python that has it."""
    try:
        import gmsh as package
    except (ImportError, OSError) as error:
        # In the form of gmsh's own messages.
        remedy = "run `pip install gmsh`"
        if isinstance(error, OSError):
            remedy = f"on Debian and Ubuntu run `apt-get install {OF_GMSH}`"
        sys.exit(f"Error   : gmsh cannot be loaded ({error}): {remedy}")
    package.initialize(["gmsh", *sys.argv[1:]], run=True)
    package.finalize()


def choose_gmsh():
    """Names the gmsh of the Python package in the environment, if PATH has no other one."""
    if os.environ.get(GMSH):
        return
    own = _command("dovetail-gmsh")
    if own is None:
        return
    import shutil

    in_path = shutil.which("gmsh")
    # The command that the package of gmsh has starts whatever Python is first in PATH.
    if in_path is None or os.path.dirname(in_path) == os.path.dirname(own):
        os.environ[GMSH] = own


def _command(name):
    """File of a command that was installed with this package; `None` if there is none."""
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        files = distribution("dovetail").files or []
    except PackageNotFoundError:
        return None
    for file in files:
        path = os.path.normpath(file.locate())
        if file.name == name and os.access(path, os.X_OK):
            return path
    return None
