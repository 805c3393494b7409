"""Writes the files of matrices that other programs' writers make: scipy, pyyeti and pyNastran.

All have the same matrices, whose entries are computed here and in crates/matrices/tests/files.rs.
"""

import pathlib

import numpy as np
import scipy.io
import scipy.sparse
from pyNastran.op4.op4 import write_op4
from pyyeti.nastran import op4

HERE = pathlib.Path(__file__).parent
N = 9


def entry(i, j):
    """Stiffness of two rows, counted from 0: bands at distances 0, 1 and 4, row 6 alone."""
    distance = abs(i - j)
    if distance not in (0, 1, 4) or (distance and 6 in (i, j)):
        return 0.0
    return (1e5 + 1e4 * (i + j) / 7.0) / (1.0 + distance)


stiffness = np.array([[entry(i, j) for j in range(N)] for i in range(N)])
unsymmetric = stiffness + np.triu(stiffness, 1) / 4.0
mass = np.diag([0.0 if i == 4 else (i + 1) / 3.0 for i in range(N)])
sparse = scipy.sparse.csc_matrix
scaled = np.rint(stiffness).astype(np.int32)

folder = HERE / "scipy"
folder.mkdir(exist_ok=True)
write = scipy.io.mmwrite
write(folder / "coordinate_symmetric.mtx", sparse(stiffness), symmetry="symmetric", precision=17)
write(folder / "coordinate_general.mtx", sparse(unsymmetric), symmetry="general", precision=17)
write(folder / "array_symmetric.mtx", stiffness, symmetry="symmetric", precision=17)
write(folder / "array_general.mtx", unsymmetric, symmetry="general", precision=17)
write(folder / "integer.mtx", sparse(scaled))
variables = {"K": stiffness, "U": unsymmetric, "MASS": mass, "mode": np.ones((N, 1))}
variables |= {"Z": stiffness * 1j, "title": "blade", "steps": np.zeros((2, 2, 2))}
scipy.io.savemat(folder / "dense.mat", variables)
scipy.io.savemat(folder / "dense_compressed.mat", variables, do_compression=True)
variables = {"K": sparse(stiffness), "U": sparse(unsymmetric), "MASS": sparse(mass)}
scipy.io.savemat(folder / "sparse.mat", variables)
scipy.io.savemat(folder / "sparse_compressed.mat", variables, do_compression=True)
single = {"K": stiffness.astype(np.float32), "whole": scaled, "bytes": (mass > 0).astype(np.uint8)}
scipy.io.savemat(folder / "single.mat", single)
others = {"K": sparse(stiffness), "MASS": sparse(mass), "gaps": np.full((N, 1), np.nan)}
others |= {"held": sparse(mass > 0), "struct": {"steps": 2, "K": stiffness}, "none": np.zeros((0, 0))}
others |= {"cell": np.array([1, "blade"], dtype=object), "Z": sparse(stiffness * 1j)}
others |= {"PA": np.linspace(0.0, 1.0, N).reshape(N, 1)}
scipy.io.savemat(folder / "others.mat", others)
scipy.io.savemat(folder / "others_compressed.mat", others, do_compression=True)
scipy.io.savemat(folder / "version4.mat", {"K": stiffness}, format="4")
scipy.io.hb_write(folder / "unsymmetric.rua", sparse(unsymmetric))

folder = HERE / "op4"
folder.mkdir(exist_ok=True)
matrices = {"kaa": stiffness, "u": unsymmetric, "maa": mass}
for form in ("dense", "nonbigmat", "bigmat"):
    given = {name: (m if form == "dense" else sparse(m)) for name, m in matrices.items()}
    text = str(folder / f"{form}.op4")
    op4.write(text, given, binary=False, digits=16, sparse=form)
    for endian, word in (("<", "little"), (">", "big")):
        binary = str(folder / f"{form}_{word}.op4")
        op4.write(binary, given, binary=True, endian=endian, sparse=form)
complex_first = {"b": stiffness * (1 + 2j), "k4": stiffness}
op4.write(str(folder / "complex.op4"), complex_first, binary=False, sparse="dense")
op4.write(str(folder / "complex_little.op4"), complex_first, binary=True, endian="<", sparse="bigmat")
for precision in ("single", "double"):
    typed = {"KAA": (6, stiffness.astype("float32" if precision == "single" else "float64"))}
    write_op4(folder / f"pynastran_{precision}.op4", typed, precision=precision, is_binary=False)
