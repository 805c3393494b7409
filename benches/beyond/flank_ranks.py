#!/usr/bin/env python3
"""Low rank of the flanks' stiffness, mass and compliance: a hierarchical matrix beside the dense one.

    dovetail reduce scenes/paper.toml --out FOLDER                                # one folder for each mesh
    target/venv/bin/python benches/beyond/flank_ranks.py FOLDER... [--grids 50x100 158x316] [--results OUT]

Pairs are ordered by geometric bisection, 16 in a leaf. A block of two clusters is admissible where the smaller extent is at most their
distance. Admissible blocks are kept as U V^T of the least rank whose error is below the tolerance times the norm of K shared among the
blocks by their area (Frobenius), so that the whole keeps the tolerance; all others are dense. The storage is that of the lower
triangle, beside the dense lower triangle. --grids tells what the same tree needs on finer flanks, with the ranks measured on the last
folder by the size of the blocks. --results OUT runs target/release/dovetail (static state and response) on each folder with K and M
compressed, and says what that changes: as they are, and corrected so that K acts exactly on its six softest motions. Needs numpy.
"""

import argparse
import csv
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "scripts"))
import origin  # noqa: E402

TOLERANCES = [1e-4, 1e-6, 1e-8]
SCENE = """name = "reduced"
[reduced_model]
folder = "."
friction = 0.3
force_n = 2.0
[damping]
ratio = 0.001
[response]
times_first_linear_mode = [0.995, 1.003]
points = 21
harmonics = 3
samples = 128
"""
LEAF = 16
SOFTEST = 6  # Rigid motions of a blade that nothing but the contacts holds.


def read(path):
    with open(path) as file:
        if "array real general" not in file.readline():
            raise SystemExit(f"{path}: not a dense matrix")
        shape = next(line for line in file if not line.startswith("%"))
        rows, columns = (int(word) for word in shape.split())
        return np.fromfile(file, sep=" ", count=rows * columns).reshape(columns, rows).T


def write(path, a):
    with open(path, "w") as file:
        file.write(f"%%MatrixMarket matrix array real general\n{a.shape[0]} {a.shape[1]}\n")
        a.T.ravel().tofile(file, sep="\n", format="%.17g")
        file.write("\n")


class Cluster:
    def __init__(self, xyz, points):
        self.points = points
        self.low, self.high = xyz[points].min(axis=0), xyz[points].max(axis=0)
        self.extent = np.linalg.norm(self.high - self.low)
        self.halves = []
        if len(points) > LEAF:
            axis = np.argmax(self.high - self.low)
            order = points[np.argsort(xyz[points, axis], kind="stable")]
            self.halves = [Cluster(xyz, half) for half in np.array_split(order, 2)]

    def distance(self, other):
        return np.linalg.norm(np.maximum(0, np.maximum(self.low - other.high, other.low - self.high)))


def blocks(a, b):
    """Pairs of clusters that cover the lower triangle, whether they are admissible, and their area."""
    rows, columns = 3 * len(a.points), 3 * len(b.points)
    if a is not b and min(a.extent, b.extent) <= a.distance(b):
        yield a, b, True, rows * columns
    elif not a.halves or not b.halves:
        yield a, b, False, rows * columns if a is not b else rows * (rows + 1) // 2
    elif a is b:
        first, second = a.halves
        for pair in ((first, first), (second, first), (second, second)):
            yield from blocks(*pair)
    else:
        for x in a.halves:
            for y in b.halves:
                yield from blocks(x, y)


def size(a, b):
    """Of a block, in pairs; clusters of one level differ by one."""
    return round(np.log2(max(len(a.points), len(b.points)) / LEAF))


class Compressed:
    """For each tolerance the numbers kept, the ranks by the size of the blocks, and the matrix that they stand for."""

    def __init__(self, matrix, tree):
        self.matrices = {t: matrix.copy() for t in TOLERANCES}
        self.kept = dict.fromkeys(TOLERANCES, 0)
        self.ranks = {t: defaultdict(list) for t in TOLERANCES}
        norm = np.linalg.norm(matrix)
        for a, b, admissible, area in blocks(tree, tree):
            if not admissible:
                for t in TOLERANCES:
                    self.kept[t] += area
                continue
            rows, columns = ((3 * c.points[:, None] + np.arange(3)).ravel() for c in (a, b))
            block = np.ix_(rows, columns)
            u, s, v = np.linalg.svd(matrix[block], full_matrices=False)
            tails = np.sqrt(np.append(np.cumsum((s**2)[::-1])[::-1], 0))
            for t in TOLERANCES:
                rank = int(np.argmax(tails <= t * norm * np.sqrt(area) / len(matrix)))
                self.kept[t] += min(rank * (len(rows) + len(columns)), area)
                self.ranks[t][size(a, b)].append(rank)
                low = u[:, :rank] * s[:rank] @ v[:rank]
                self.matrices[t][block] = low
                self.matrices[t][np.ix_(columns, rows)] = low.T


def exact_on(softest, matrix, compressed):
    """The compressed matrix, corrected so that it acts exactly on these orthonormal motions."""
    off = (matrix - compressed) @ softest
    return compressed + off @ softest.T + softest @ off.T - softest @ (softest.T @ off) @ softest.T


def predicted(xyz, grid, ranks):
    """Pairs of a finer grid of the same two flanks, and for each tolerance the numbers that the tree keeps there, with the mean rank of
    the largest measured blocks for all that are larger."""
    fine = refined(xyz, *grid)
    tree = Cluster(fine, np.arange(len(fine)))
    kept = dict.fromkeys(TOLERANCES, 0)
    means = {t: {level: np.mean(measured) for level, measured in ranks[t].items()} for t in TOLERANCES}
    for a, b, admissible, area in blocks(tree, tree):
        sides = 3 * (len(a.points) + len(b.points))
        for t, mean in means.items():
            kept[t] += min(mean[max(min(size(a, b), max(mean)), min(mean))] * sides, area) if admissible else area
    return len(fine), kept


def refined(xyz, nu, nv):
    """A grid of nu x nv points on each flank: x along the slot, z across, y linear in both."""
    slope = np.polyfit(xyz[:, 0], xyz[:, 1], 1)[0]
    side = xyz[:, 1] - slope * xyz[:, 0] > 0
    flanks = []
    for part in (xyz[side], xyz[~side]):
        plane = np.linalg.lstsq(np.c_[part[:, [0, 2]], np.ones(len(part))], part[:, 1], rcond=None)[0]
        x, z = np.meshgrid(*(np.linspace(part[:, i].min(), part[:, i].max(), k) for i, k in ((0, nv), (2, nu))))
        flanks.append(np.c_[x.ravel(), np.c_[x.ravel(), z.ravel(), np.ones(x.size)] @ plane, z.ravel()])
    return np.vstack(flanks)


def answers(folder):
    """Static normal forces, and the amplitudes of the response, of a reduced model."""
    (folder / "scene.toml").write_text(SCENE)
    line = [ROOT / "target/release/dovetail", "run", folder / "scene.toml", "--out", folder / "out", "--quiet", "--no-fields", "--no-cache", "--threads", "1"]
    done = subprocess.run([str(word) for word in line], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{folder}: {done.stderr}")
    found = []
    for name, column in (("static", "normal_force_n"), ("response", "tip_amplitude_m")):
        with open(folder / "out" / f"{name}.csv", newline="") as file:
            found.append(np.array([float(row[column]) for row in csv.DictReader(file)]))
    return found


def changed(folder, out, stiffness, compressed, softest):
    """A line for each tolerance: what compressed K and M change."""
    shutil.copytree(folder, out / folder.name, dirs_exist_ok=True)
    forces, amplitudes = answers(out / folder.name)
    for t, low in compressed["K"].items():
        for label, k in (("as it is", low), ("exact on the softest", exact_on(softest, stiffness, low))):
            to = out / f"{folder.name}_{t:g}_{label.split()[0]}"
            shutil.copytree(folder, to, dirs_exist_ok=True)
            write(to / "stiffness.mtx", 0.5 * (k + k.T))
            write(to / "mass.mtx", compressed["M"][t])
            f, a = answers(to)
            print(
                f"| {len(f)} | {t:g} | {label} | {abs(f - forces).max() / abs(forces).max():.1e}"
                f" | {abs(a - amplitudes).max() / amplitudes.max():.1e} | {a.max() / amplitudes.max() - 1:.1e} |",
                flush=True,
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--grids", nargs="*", default=["50x100", "158x316"])
    parser.add_argument("--results", type=Path)
    arguments = parser.parse_args()
    print("| pairs | of | tolerance | kept | mean rank | error | error of K x, x at random |")
    print("|" + " --- |" * 7)
    found, softest, stiffnesses = defaultdict(list), [], []
    for folder in arguments.folders:
        xyz, stiffness = read(folder / "positions.mtx"), read(folder / "stiffness.mtx")
        tree = Cluster(xyz, np.arange(len(xyz)))
        stiffness = 0.5 * (stiffness + stiffness.T)
        x = np.random.default_rng(1).standard_normal(len(stiffness))
        values, vectors = np.linalg.eigh(stiffness)
        print(f"# eigenvalues of K: {values[0]:.3g} ... {values[SOFTEST - 1]:.3g}, {values[SOFTEST]:.3g} ... {values[-1]:.3g} N/m",
              file=sys.stderr)  # fmt: skip
        softest.append(vectors[:, :SOFTEST])
        stiffnesses.append(stiffness)
        compliance = vectors[:, SOFTEST:] / values[SOFTEST:] @ vectors[:, SOFTEST:].T
        for name, matrix in (("K", stiffness), ("M", read(folder / "mass.mtx")), ("compliance", compliance)):
            low = Compressed(matrix, tree)
            found[name].append(low)
            half = len(matrix) * (len(matrix) + 1) / 2
            for t in TOLERANCES:
                off = low.matrices[t] - matrix
                ranks = sum(low.ranks[t].values(), []) or [0]
                print(f"| {len(xyz)} | {name} | {t:g} | {low.kept[t] / half:.3f} | {np.mean(ranks):.1f}"
                      f" | {np.linalg.norm(off) / np.linalg.norm(matrix):.1e}"
                      f" | {np.linalg.norm(off @ x) / np.linalg.norm(matrix @ x):.1e} |", flush=True)  # fmt: skip
    print("\n| of | tolerance | exponent of the last two | " + " | ".join(f"{grid}: pairs, GB, of the dense one" for grid in arguments.grids) + " |")
    print("|" + " --- |" * (3 + len(arguments.grids)))
    for name, cases in found.items():
        finer = [predicted(xyz, [int(k) for k in grid.split("x")], cases[-1].ranks) for grid in arguments.grids]
        for t in TOLERANCES:
            sizes = [(len(case.matrices[t]), case.kept[t]) for case in cases[-2:]]
            exponent = f"{np.divide(*np.diff(np.log(sizes), axis=0)[0][::-1]):.2f}" if len(sizes) > 1 else "-"
            line = [f"{n}: {8e-9 * kept[t]:.3g}, {kept[t] / (1.5 * n * (3 * n + 1)):.4f}" for n, kept in finer]
            print(f"| {name} | {t:g} | {exponent} | " + " | ".join(line) + " |", flush=True)
    if arguments.results:
        print("\n| pairs | tolerance | K | static normal force, largest change over the largest | amplitude, likewise | peak |")
        print("|" + " --- |" * 6)
        for i, folder in enumerate(arguments.folders):
            changed(folder, arguments.results, stiffnesses[i], {name: found[name][i].matrices for name in "KM"}, softest[i])


if __name__ == "__main__":
    print(origin.line() + "\n")
    sys.exit(main())
