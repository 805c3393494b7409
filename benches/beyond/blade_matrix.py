#!/usr/bin/env python3
"""Writes the stiffness of the blade at rest, for the trials of this folder.

    target/venv/bin/python benches/beyond/blade_matrix.py MESH FILE [flanks]

MESH is one of geometry/dovetail.geo (`dovetail mesh`, docs/geometry.md), with quadratic tetrahedra. The flanks are held; with the word
`flanks` their unknowns stand last, with the middles of their edges tied to the corners as dovetail has them. FILE: n, entries,
n + 1 column offsets, row indices (64-bit integers), values, both triangles; then the number of unknowns of the flanks, and the places
of the nodes, m. The finite elements are those of benches/calculix/assembly.py. Needs numpy and scipy.
"""

import sys
from pathlib import Path

import numpy as np
import scipy.sparse as sparse

sys.path.append(str(Path(__file__).resolve().parents[1] / "calculix"))
import assembly  # noqa: E402
import msh  # noqa: E402
from blade_modes import FLANKS  # noqa: E402


def tied(body):
    """Displacements of all nodes by those of the nodes that are free, and how many of these are on flanks."""
    corners, middles = set(), {}
    for name in FLANKS:
        for _, facet in msh.group(body.groups, name):
            nodes = [body.number[tag] for tag in facet]
            if len(nodes) != 6:
                raise SystemExit("the flanks are not of triangles of 6 nodes")
            corners.update(nodes[:3])
            middles.update({nodes[3 + i]: (nodes[i], nodes[(i + 1) % 3]) for i in range(3)})
    inner = [node for node in range(len(body.x)) if node not in corners and node not in middles]
    order = inner + sorted(corners)
    column = {node: i for i, node in enumerate(order)}
    entries = [(node, i, 1.0) for node, i in column.items()]
    entries += [(node, column[end], 0.5) for node, ends in middles.items() for end in ends]
    rows, columns, values = zip(*entries)
    nodal = sparse.csc_matrix((values, (rows, columns)), shape=(len(body.x), len(order)))
    return sparse.kron(nodal, sparse.identity(3), format="csc"), 3 * len(corners), body.x[order]


def main():
    if len(sys.argv) not in (3, 4) or sys.argv[3:] not in ([], ["flanks"]):
        raise SystemExit(__doc__)
    body = assembly.Body(sys.argv[1], "blade", [], 1e-3)
    transformation, flanks, places = tied(body)
    # Four points are exact where the edges are straight; nearly all are.
    stiffness = assembly.System(body, assembly.Scheme({10: 4}, {10: 4})).stiffness()
    stiffness = (transformation.T @ stiffness @ transformation).tocsc()
    if len(sys.argv) == 3:
        inner = stiffness.shape[0] - flanks
        stiffness, flanks, places = stiffness[:inner, :inner].tocsc(), 0, places[: inner // 3]
    stiffness.sort_indices()
    with open(sys.argv[2], "wb") as file:
        for numbers in ([stiffness.shape[0], stiffness.nnz], stiffness.indptr, stiffness.indices):
            np.asarray(numbers, dtype=np.int64).tofile(file)
        stiffness.data.tofile(file)
        np.array([flanks], dtype=np.int64).tofile(file)
        places.tofile(file)
    print(f"{stiffness.shape[0]} unknowns, {flanks} of the flanks, {stiffness.nnz} entries")


if __name__ == "__main__":
    sys.exit(main())
