#!/usr/bin/env python3
"""This working tree beside another commit on one machine: ratios of times, with their spread.

    make against REV=24db848a                  # the inputs that need minutes: all but the builds
    python3 benches/against.py 24db848a --only paper,kernels --pairs 5
    python3 benches/against.py 24db848a --only build,incremental,wheel

Machines differ by a factor of 2.5, so a statement about speed is a ratio. The other commit is checked out and built in
target/against. Both programs run alternately, each with the scene of its own commit and the same mesh. A ratio below 1
says that this tree is faster. Inputs:

    paper        scenes/paper.toml with 200 points, 72 pairs
    p288, p1152  the same joint with 8 x 18 nodes in a flank and 100 points, 16 x 36 and 20 points
    disc         scenes/verification/bladed_disc.toml
    kernels      benches/kernels.rs, each kernel that both commits have
    build        cargo build --release from an empty target directory (one pair)
    incremental  cargo build --release after a change in the DLFT code (one pair)
    wheel        cargo build --release -p dovetail-python after that of the program (one pair)

Standard library only, with git, cargo and gmsh.
"""

import argparse
import csv
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "scripts"))
import origin  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "target/against"
OUTPUTS = FOLDER / "runs"
# Input: scene, nodes of a flank (None: the ready mesh), more settings, pairs of runs.
RUNS = {
    "paper": ("scenes/paper.toml", None, ["response.points=200"], 10),
    "p288": ("scenes/paper.toml", (8, 18), ["response.points=100"], 3),
    "p1152": ("scenes/paper.toml", (16, 36), ["response.points=20"], 3),
    "disc": ("scenes/verification/bladed_disc.toml", "disc", [], 10),
}
BUILDS = ["build", "incremental", "wheel"]
USUAL = [*RUNS, "kernels"]
CHANGED = "dlft/aft.rs"
SHORT = ["--measurement-time", "1", "--warm-up-time", "0.3"]


class Side:
    """One of the two trees."""

    def __init__(self, name, root, target):
        self.name, self.root, self.target = name, root, target

    def cargo(self, *words, target=None, quiet=True):
        environment = dict(os.environ, CARGO_TARGET_DIR=str(target or self.target))
        done = subprocess.run(["cargo", *words], cwd=self.root, env=environment, capture_output=quiet, text=True)
        if done.returncode != 0:
            raise SystemExit(f"cargo {' '.join(words)} failed in {self.root}:\n{done.stderr}")
        return done

    def program(self):
        return self.target / "release/dovetail"


def usage(work):
    """Seconds of the clock and of the processor of the processes that `work` starts."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    work()
    wall, after = time.monotonic() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def checked_out(rev):
    """Tree of a commit in the folder, which git knows as a worktree."""
    words = ["git", "-C", str(ROOT), "rev-parse", "--short=8", f"{rev}^{{commit}}"]
    found = subprocess.run(words, capture_output=True, text=True)
    if found.returncode != 0:
        raise SystemExit(f"git knows no commit {rev}: {found.stderr.strip()}")
    commit = found.stdout.strip()
    tree = FOLDER / commit
    if not tree.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        words = ["git", "-C", str(ROOT), "worktree", "add", "--detach", str(tree), commit]
        subprocess.run(words, check=True, capture_output=True)
    return Side(commit, tree, FOLDER / f"{commit}-target")


def mesh_of(side, nodes):
    """Mesh of an input, made once by the program of this tree."""
    if nodes is None:
        return ROOT / "meshes/dovetail.msh"
    if nodes == "disc":
        scene, name, settings = "scenes/verification/bladed_disc.toml", "disc", []
    else:
        scene, name = "scenes/paper.toml", f"flank_{nodes[0]}x{nodes[1]}"
        settings = ["--set", f"mesh.parameters.nu={nodes[0]}", "--set", f"mesh.parameters.nv={nodes[1]}"]
    folder = FOLDER / "meshes" / name
    mesh = folder / "mesh.msh"
    if not mesh.exists():
        words = [str(side.program()), "mesh", scene, "--out", str(folder), "--quiet", *settings]
        subprocess.run([*words, "--set", "mesh.time_limit_s=600"], cwd=ROOT, check=True)
    return mesh


def solve(side, name, mesh):
    scene, _, settings, _ = RUNS[name]
    words = [str(side.program()), "run", scene, "--no-cache", "--quiet", "--out", str(OUTPUTS / f"{name}-{side.name}")]
    for setting in [f"mesh.file={mesh}", *settings]:
        words += ["--set", setting]
    done = subprocess.run(words, cwd=side.root, capture_output=True, text=True)
    # 3: a frequency did not converge, which both commits may share.
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(words)}\nended with {done.returncode}: {done.stderr}")


def difference(name, sides):
    """How far the tables of the responses differ."""
    files = [OUTPUTS / f"{name}-{side.name}/response.csv" for side in sides]
    if files[0].read_bytes() == files[1].read_bytes():
        return "equal to the byte"
    one, other = (list(csv.reader(file.open(encoding="utf-8"))) for file in files)
    if [len(row) for row in one] != [len(row) for row in other]:
        return "other rows or columns"
    largest = 0.0
    for a, b in ((a, b) for rows in zip(one[1:], other[1:]) for a, b in zip(*rows)):
        try:
            a, b = float(a), float(b)
        except ValueError:
            continue
        if max(abs(a), abs(b)) > 0:
            largest = max(largest, abs(a - b) / max(abs(a), abs(b)))
    return f"numbers differ by up to {largest:.1e}"


def row(name, pairs, note=""):
    """Line of the table from pairs of usages, ours and theirs."""
    cells = [name, str(len(pairs))]
    for kind in (0, 1):
        ratios = sorted(ours[kind] / theirs[kind] for ours, theirs in pairs)
        spread = f" ({ratios[0]:.3f} to {ratios[-1]:.3f})" if len(ratios) > 1 else ""
        cells.append(f"{statistics.median(ratios):.3f}{spread}")
    cells += [f"{statistics.median(theirs[kind] for _, theirs in pairs):.1f}" for kind in (0, 1)]
    print("| " + " | ".join([*cells, note]) + " |", flush=True)


def alternately(work, sides, count):
    """Usages of both sides, which begin in turn."""
    pairs = []
    for number in range(count):
        order = sides if number % 2 == 0 else sides[::-1]
        found = {side.name: usage(lambda side=side: work(side)) for side in order}
        pairs.append(tuple(found[side.name] for side in sides))
    return pairs


def kernels(sides, count):
    """Ratio of the median time of each kernel that both commits have.

    The pace of a whole process varies by a quarter, whichever commit it runs: many short processes, in turn, tell more
    than few long ones.
    """
    times = {side.name: {} for side in sides}
    for number in range(count):
        for side in sides if number % 2 == 0 else sides[::-1]:
            side.cargo("bench", "--locked", "--bench", "kernels", "--", "--noplot", *SHORT)
            for file in (side.target / "criterion").glob("**/new/estimates.json"):
                kernel = str(file.parent.parent.relative_to(side.target / "criterion"))
                median = json.loads(file.read_text(encoding="utf-8"))["median"]["point_estimate"]
                times[side.name].setdefault(kernel, []).append(median)
    ours, theirs = (times[side.name] for side in sides)
    print("\n| kernel | ratio | |\n| --- | --- | --- |")
    for kernel in sorted(set(ours) & set(theirs)):
        ratios = sorted(a / b for a, b in zip(ours[kernel], theirs[kernel]))
        print(f"| {kernel} | {statistics.median(ratios):.3f} | {ratios[0]:.3f} to {ratios[-1]:.3f} |", flush=True)


def builds(sides, wanted):
    """Builds in target directories of their own, which are removed afterwards."""
    targets = {side.name: Path(tempfile.mkdtemp(prefix="build-", dir=FOLDER)) for side in sides}
    try:
        def build(side, *words):
            side.cargo("build", "--release", "--locked", *words, target=targets[side.name])

        def changed(side):
            found = subprocess.run(["git", "ls-files", f"*/{CHANGED}"], cwd=side.root, capture_output=True, text=True)
            (side.root / found.stdout.split()[0]).touch()
            build(side)

        row("build", alternately(build, sides, 1))
        if "incremental" in wanted:
            row("incremental", alternately(changed, sides, 1))
        if "wheel" in wanted:
            row("wheel", alternately(lambda side: build(side, "--package", "dovetail-python"), sides, 1))
    finally:
        for target in targets.values():
            shutil.rmtree(target)


def main():
    about = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    about.add_argument("rev", help="the other commit")
    about.add_argument("--only", default=",".join(USUAL), help="inputs, with commas between them")
    about.add_argument("--pairs", type=int, help="pairs of runs of each input")
    asked = about.parse_args()
    wanted = asked.only.split(",")
    unknown = [name for name in wanted if name not in [*USUAL, *BUILDS]]
    if unknown:
        about.error(f"no input is called {', '.join(unknown)}: there are {', '.join([*USUAL, *BUILDS])}")
    sides = [Side("this", ROOT, ROOT / "target"), checked_out(asked.rev)]
    runs = [name for name in RUNS if name in wanted]
    if runs:
        for side in sides:
            side.cargo("build", "--release", "--locked", quiet=False)
    print(f"{origin.line()} Against {sides[1].name}; {os.cpu_count()} processors.\n")
    print("| input | pairs | ratio of time | ratio of processor time | other, s | other, processor s | response.csv |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in runs:
        mesh = mesh_of(sides[0], RUNS[name][1])
        pairs = alternately(lambda side: solve(side, name, mesh), sides, asked.pairs or RUNS[name][3])
        row(name, pairs, difference(name, sides))
    if set(BUILDS) & set(wanted):
        builds(sides, wanted)
    if "kernels" in wanted:
        kernels(sides, asked.pairs or 10)


if __name__ == "__main__":
    main()
