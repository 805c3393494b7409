"""Runs the program at the extremes of its input and writes the table of docs/extremes.md.

    make extremes                                     # or, after cargo build --release:
    python3 scripts/extremes.py [--only ROW] [--out output/extremes] [--program FILE]

Every cell ends converged or with a message that says why not and what to do, and says which of the two it must be.
Exit code 1 when a cell ends otherwise, or panics, takes too long, or writes a number that is not finite. gmsh is needed
for the flank of 2 x 2 nodes only; without it that cell is left out, and said so. Standard library only.
"""

import argparse
import csv
import json
import os
import re
import resource
import shutil
import struct
import subprocess
import sys
import time

import origin

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = os.path.join(ROOT, "target/release/dovetail")
TIME_LIMIT_S = 600
PAPER = os.path.join(ROOT, "scenes/paper.toml")
READY = ["mesh.file=../meshes/dovetail.msh", "response.points=11", "response.compare_harmonics="]
SMALL = ["mesh.file=../meshes/dovetail_small.msh"] + READY[1:]

REDUCED_SCENE = """\
name = "{name}"
[reduced_model]
folder = "{folder}"
friction = 0.3
force_n = 2.0
[damping]
ratio = 0.001
[response]
times_first_linear_mode = [0.98, 1.02]
points = 11
harmonics = 3
"""

# Two unit cubes of millimetres on each other, nine pairs of which four are corners of a cube.
BLOCKS_SCENE = """\
name = "blocks"
[mesh]
file = "{mesh}"
metres_per_unit = 1e-3
[[body]]
name = "upper"
volume = "upper"
young_pa = 2e11
poisson = 0.3
density_kg_m3 = 7800
[[body]]
name = "lower"
volume = "lower"
young_pa = 2e11
poisson = 0.3
density_kg_m3 = 7800
fixed = ["base"]
[[contact]]
name = "c"
first = "upper_bottom"
second = "lower_top"
friction = 0.3
[[load]]
on = "corner"
force_n = 1.0
direction = [-0.3, -0.3, -1]
[damping]
ratio = 0.01
[[excitation]]
on = "corner"
direction = [1, 0, 0]
force_n = 0.01
[[observe]]
name = "tip"
points = "corner"
direction = [1, 0, 0]
[response]
times_first_linear_mode = [0.9, 1.1]
points = 11
harmonics = 3
"""


class Run:
    """One run of the program: what it said, wrote, and how it ended."""

    def __init__(self, out, command, scene, sets, more=(), threads=1, memory_bytes=None):
        shutil.rmtree(out, ignore_errors=True)
        line = [PROGRAM, command, scene, "--out", out, "--quiet", "--threads", str(threads), *more]
        for key in sets:
            line += ["--set", key]
        limit = memory_bytes and (lambda: resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes)))
        began = time.monotonic()
        try:
            done = subprocess.run(
                line, cwd=ROOT, capture_output=True, text=True, timeout=TIME_LIMIT_S, env=dict(os.environ, NO_COLOR="1"),
                preexec_fn=limit,
            )
            self.code, self.said = done.returncode, done.stderr
        except subprocess.TimeoutExpired:
            self.code, self.said = None, ""
        self.seconds, self.out = time.monotonic() - began, out
        path = os.path.join(out, "summary.json")
        self.summary = json.load(open(path)) if os.path.exists(path) else {}

    def words(self):
        """What was said, without the frames and line breaks of the terminal."""
        lines = []
        for line in self.said.splitlines():
            line = re.sub(r"^[\s|│╰╭╯╮─▶×⚠·✗x!]+(?=\s)", "", line).strip()
            if line and not re.match(r"\d+\s*[│|]|,-\[|:|`--|[╭╰·]", line):
                lines.append(line)
        words = " ".join(lines)
        # What holds for every run that did not converge says less than its own warning.
        return words.split(" help: they are marked")[0] if "would come apart" in words else words

    def broken(self):
        """Why the run counts as a failure whatever it was meant to do; None where it does not."""
        if self.code is None:
            return f"stopped after {TIME_LIMIT_S} s"
        if self.code not in (0, 1, 2, 3) or "panicked" in self.said:
            return f"exit code {self.code}: {self.words()[:200]}"
        for folder, _, names in os.walk(self.out):
            for name in names:
                if not name.endswith((".csv", ".json", ".svg")):
                    continue
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    if re.search(r"(?<![a-z_])-?(nan|inf|infinity)(?![a-z_])", file.read(), re.IGNORECASE):
                        return f"{name} holds a number that is not finite"
        return None

    def rows(self):
        path = os.path.join(self.out, "response.csv")
        if not os.path.exists(path):
            return []
        with open(path, newline="") as file:
            return list(csv.DictReader(file))

    def figure(self):
        """Peak, work and pairs, in the words of the table."""
        response, static = self.summary.get("response"), self.summary.get("static")
        parts = []
        if response and response["peak_amplitude_m"] is not None:
            parts.append(
                f"peak {response['peak_amplitude_m']:.4g} m at {response['peak_frequency_hz']:.6g} Hz"
                f" (linear {response['linear_peak_amplitude_m']:.4g} m)"
            )
        if static and static["open_pairs"] is not None:
            parts.append(
                f"static {static['stuck_pairs']}/{static['slipping_pairs']}/{static['open_pairs']}"
            )
        if static and static.get("retention_n") is not None:
            parts.append(f"held statically with {static['retention_n']:.4g} N")
        held = [float(row["retention_n"]) for row in self.rows() if row["retention_n"] not in ("", "0")]
        held = [force for force in held if force > 0.0]
        if held:
            parts.append(f"held at {len(held)} with {max(held):.3g} N")
        if response:
            parts.append(
                f"{response['converged_points']}/{response['points']} points,"
                f" {response['newton_iterations']} iterations"
            )
        return "; ".join(parts)


CONVERGED = "converged"
# Converged, or not at some frequencies and said so with what may help.
EITHER = "either"


class Table:
    def __init__(self, out, only):
        self.out, self.only, self.lines, self.failures = out, only, [], []
        self.count = 0

    def cell(self, row, value, scene, sets=(), command="run", expect=CONVERGED):
        """Runs one cell. `expect`: CONVERGED, or a regular expression that its message must match."""
        if self.only and self.only not in row:
            return None
        self.count += 1
        run = Run(os.path.join(self.out, f"cell{self.count:03}"), command, scene, sets)
        fault = run.broken()
        message = run.words()
        if expect == EITHER:
            expect = CONVERGED if run.code == 0 else "did not converge.*may help|would come apart"
        if fault is None and expect == CONVERGED and run.code != 0:
            fault = f"did not converge: {message}"
        if fault is None and expect != CONVERGED and (run.code == 0 or not re.search(expect, message)):
            fault = f"was to say /{expect}/, ended with {run.code}: {message}"
        if run.code == 0:
            ended = run.figure()
        elif run.code == 3:
            ended = f"{run.figure()}; *{message}*"
        else:
            ended = f"*{message}*"
        self.add(row, value, fault, ended, run.seconds)
        return run

    def memory(self, row, scene, sets, threads, levels_mb):
        """Runs one scene with each of these limits of memory: each gives its results, or a message and `failed` in its folder."""
        if self.only and self.only not in row:
            return
        began, faults, refused = time.monotonic(), [], 0
        for level in levels_mb:
            out = os.path.join(self.out, f"memory_{threads}_{level}")
            run = Run(out, "run", scene, sets, ["--no-cache"], threads, level * 10**6)
            state = run.summary.get("state", "failed")
            refused += run.code == 1
            told = run.code == 0 or (run.code == 1 and "memory" in run.words() and "panicked" not in run.said and state == "failed")
            if not told:
                faults.append(f"{level} MB: exit code {run.code}, {state}: {run.words()[-200:]}")
        if not 0 < refused < len(levels_mb):
            faults.append(f"{refused} of {len(levels_mb)} levels were too little")
        print(f"{refused} of {len(levels_mb)} levels were too little", flush=True)
        value = f"{levels_mb[0]} to {levels_mb[-1]} MB in {len(levels_mb)} steps, {threads} threads"
        self.add(row, value, "; ".join(faults), "each gives its results, or says that memory does not suffice", time.monotonic() - began)

    def add(self, row, value, fault, ended, seconds):
        if fault:
            self.failures.append(f"{row}, {value}: {fault}")
        mark = "**FAILED** " if fault else ""
        ended = (mark + (fault or ended)).replace("|", "\\|").replace("\n", " ")
        self.lines.append(f"| {row} | {value} | {ended} |")
        print(f"{seconds:6.1f} s  {row}, {value}: {ended}", flush=True)

    def same(self, row, what, runs, tolerance):
        """Peaks, shifts and counts of these runs agree to `tolerance`, relative."""
        if any(run is None for run in runs):
            return
        figures = [
            [float(r["tip_amplitude_m"] or "nan") for r in run.rows()] for run in runs
        ]
        first = figures[0]
        worst = max(
            (abs(a - b) / abs(b) if b else float("inf") for other in figures[1:] for a, b in zip(other, first)),
            default=float("inf"),
        )
        fault = None if worst <= tolerance else f"{what}: differ by {worst:.1e}, more than {tolerance:.0e}"
        self.add(row, what, fault, f"all amplitudes equal to {worst:.1e} (asked: {tolerance:.0e})", 0.0)


def binary_nodes_changed(source, target, change):
    """Copies a binary MSH 4.1 with every node put at change(tag, (x, y, z))."""
    with open(source, "rb") as file:
        data = bytearray(file.read())
    at = data.index(b"$Nodes\n") + len(b"$Nodes\n")
    (blocks,) = struct.unpack_from("<q", data, at)
    at += 32
    for _ in range(blocks):
        (count,) = struct.unpack_from("<q", data, at + 12)
        at += 20
        tags = struct.unpack_from(f"<{count}q", data, at)
        at += 8 * count
        for tag in tags:
            struct.pack_into("<3d", data, at, *change(tag, struct.unpack_from("<3d", data, at)))
            at += 24
    with open(target, "wb") as file:
        file.write(data)


def flattened(source, target, height):
    """Copies a linear MSH 4.1 with one tetrahedron inside the blade flattened to `height` of what it was, all others whole."""
    sys.path.insert(0, os.path.join(ROOT, "benches/calculix"))
    import msh

    nodes, groups = msh.read(source)
    tets = [corners for _, corners in groups["blade"]]
    around, faces = {}, {}
    for tet in tets:
        for i, node in enumerate(tet):
            around.setdefault(node, []).append(tet)
            face = frozenset(tet[:i] + tet[i + 1:])
            faces[face] = faces.get(face, 0) + 1
    surface = {node for face, count in faces.items() if count == 1 for node in face}

    def volume(tet, at):
        a, b, c, d = (at.get(node, nodes[node]) for node in tet)
        (ux, uy, uz), (vx, vy, vz), (wx, wy, wz) = ([p - q for p, q in zip(end, a)] for end in (b, c, d))
        return ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)

    for node in sorted(set(around) - surface):
        for tet in around[node]:
            rest = [nodes[other] for other in tet if other != node]
            foot = [sum(p[i] for p in rest) / 3 for i in range(3)]
            place = tuple(f + height * (x - f) for f, x in zip(foot, nodes[node]))
            others = (other for other in around[node] if other is not tet)
            if all(volume(other, {node: place}) > 0.1 * volume(other, {}) for other in others):
                binary_nodes_changed(source, target, lambda tag, p: place if tag == node else p)
                return
    raise SystemExit(f"{source}: no tetrahedron can be flattened alone")


def frequencies(out, kind, body):
    with open(os.path.join(out, "modes.csv"), newline="") as file:
        return [float(r["frequency_hz"]) for r in csv.DictReader(file) if r["kind"] == kind and r["body"] == body]


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


def main():
    global PROGRAM
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", help="rows whose name contains this")
    parser.add_argument("--out", default=os.path.join(ROOT, "output/extremes"))
    parser.add_argument("--program", default=PROGRAM, help="the program that is run")
    arguments = parser.parse_args()
    PROGRAM = os.path.abspath(arguments.program)
    out = os.path.abspath(arguments.out)
    os.makedirs(out, exist_ok=True)
    if not os.path.exists(PROGRAM):
        raise SystemExit(f"{PROGRAM} is missing: run cargo build --release")
    table = Table(out, arguments.only)

    base = os.path.join(out, "paper")
    for command, folder in [("reduce", base), ("modes", base + "_modes")]:
        made = Run(folder, command, PAPER, READY)
        if made.code != 0:
            raise SystemExit(f"the paper's scene cannot be reduced: {made.said}")
    paper = write(os.path.join(out, "paper.toml"), REDUCED_SCENE.format(name="paper", folder="paper"))
    stuck_hz = frequencies(base + "_modes", "stuck", "assembly")
    blade_hz = frequencies(base + "_modes", "flanks_held", "blade")

    def reduced(row, value, *sets, **more):
        return table.cell(row, value, paper, sets, **more)

    def meshed(row, value, *sets, mesh=READY, **more):
        return table.cell(row, value, PAPER, [*mesh, *sets], **more)

    for mu in ["0", "1e-6", "0.01", "0.3", "1", "10", "1e6"]:
        # Stiff flanks that open: the curve folds near its peak.
        expect = EITHER if float(mu) >= 10 else CONVERGED
        reduced("friction coefficient", mu, f"reduced_model.friction={mu}", expect=expect)
    for mu in ["10", "30", "100", "1e6"]:
        reduced("friction coefficient", f"{mu}, 0.2 N", f"reduced_model.friction={mu}", "reduced_model.force_n=0.2")
    far = "slides farther than 20 % of the shorter side"
    says = {"0": "nothing holds body `blade`", "10": "would come apart", "1e6": "lower the speed", "50000": far, "100000": far}
    for rpm in ["0", "10", "500", "5000", "20000", "50000", "100000", "1e6"]:
        # A hundredth of the speed's square presses a hundredth as hard.
        force = ["excitation.*.force_n=0.02"] if rpm == "500" else []
        name = f"{rpm}, 0.02 N" if force else rpm
        meshed("speed, rpm", name, f"rotation.speed_rpm={rpm}", *force, expect=says.get(rpm, CONVERGED))
    for force in ["0", "1e-9", "0.01", "2", "20", "100", "1000", "1e4", "1e6"]:
        expect = "would come apart" if float(force) >= 1000 else CONVERGED
        reduced("excitation, N", force, f"reduced_model.force_n={force}", expect=expect)
    for force in ["1e-3", "2", "20"]:
        # An even number of points: none at the middle, where the mode is.
        reduced("no damping", f"{force} N", "damping.ratio=0", f"reduced_model.force_n={force}", "response.points=10")
        reduced(
            "no damping",
            f"{force} N, exactly at the first stuck mode",
            "damping.ratio=0",
            f"reduced_model.force_n={force}",
            "response.times_first_linear_mode=[1,1]",
            "response.points=1",
            expect="no damping.*damping.ratio",
        )
    spots = [("0.01", 0.01), ("first stuck mode", stuck_hz[0]), ("second stuck mode", stuck_hz[1])]
    spots += [("first mode of the blade with its flanks held", blade_hz[0]), ("last stuck mode", stuck_hz[-1])]
    spots += [("1e5", 1e5), ("1e6", 1e6)]
    for name, hz in spots:
        for damping in ["0.001", "0"]:
            reduced(
                "frequency, Hz",
                f"{name}, damping {damping}",
                f"response.frequency_hz=[{hz!r},{hz!r}]",
                "response.points=1",
                f"damping.ratio={damping}",
                expect="no damping" if damping == "0" and "stuck" in name else CONVERGED,
            )
    for harmonics, samples, points in [(0, 128, 11), (1, 128, 11), (31, 64, 3), (31, 128, 3), (31, 1024, 3)]:
        reduced(
            "harmonics",
            f"{harmonics}, {samples} samples",
            f"response.points={points}",
            f"response.harmonics={harmonics}",
            f"response.samples={samples}",
            expect={0: "nothing vibrates.*dovetail static", 64: "cannot carry 31 harmonics.*128 or more"}.get(
                0 if harmonics == 0 else samples, CONVERGED
            ),
        )
    for samples in ["15", "16", "128", "4096"]:
        expect = "cannot carry 3 harmonics.*16 or more" if samples == "15" else CONVERGED
        reduced("samples", samples, f"response.samples={samples}", expect=expect)
    for choice in ["pair", "spectral_radius"]:
        for scale in ["1e-4", "1e-2", "1", "1e2", "1e4"]:
            # `pair x 1e-2` is at the edge of what converges: the last digits decide, and with them the processor.
            at_edge = scale in ("1e-4", "1e2", "1e4") or (choice, scale) == ("pair", "1e-2")
            expect = EITHER if at_edge else CONVERGED
            sets = [f"response.eps={choice}", f"response.eps_scale={scale}", "response.points=3"]
            reduced("eps", f"{choice} x {scale}", *sets, expect=expect)
    for poisson in ["-0.99", "0", "0.4999", "0.5"]:
        expect = "less than 0.5|below 0.5" if poisson == "0.5" else CONVERGED
        meshed("Poisson's ratio", poisson, f"body.*.poisson={poisson}", expect=expect)
    for blade, jaw in [("1.138e17", "1.138e11"), ("1.138e11", "1.138e17"), ("1.138e11", "1.138e5")]:
        # A jaw as soft as jelly does not stand 5000 rpm.
        expect = "more than the body is large.*lower the speed" if jaw == "1.138e5" else CONVERGED
        sets = [f"body.0.young_pa={blade}", f"body.1.young_pa={jaw}"]
        meshed("moduli, blade and jaw, Pa", f"{blade}, {jaw}", *sets, expect=expect)
    for gap in ["1e-9", "1e-6", "1e-5", "1e-4", "1e-2"]:
        reduced("gap of all pairs, m", gap, f"reduced_model.gap_m={gap}")
    for gap in ["1e-6", "1e-5", "1e-3"]:
        expect = far if gap == "1e-3" else CONVERGED
        meshed("gap of one flank, m", gap, f"contact.left.gap_m={gap}", expect=expect)
    for name in ["den_hartog", "jenkins"]:
        table.cell("one pair", name, os.path.join(ROOT, f"scenes/verification/{name}.toml"))

    # Without a grid: the curve is followed along its length.
    friction, force = "reduced_model.friction", "reduced_model.force_n"
    followed = [(f"{friction}={mu}", CONVERGED if float(mu) < 10 else EITHER) for mu in ["0", "1e-6", "0.01", "1", "10", "1e6"]]
    followed += [(f"{force}={newton}", CONVERGED) for newton in ["0", "1e-9", "0.01", "20", "100"]]
    followed += [(f"{force}=1000", "would come apart"), ("damping.ratio=0", EITHER), ("response.samples=16", CONVERGED)]
    followed += [(f"reduced_model.gap_m={gap}", CONVERGED) for gap in ["1e-6", "1e-5", "1e-4"]]
    for key, expect in followed:
        reduced("the curve followed", key, "response.points=", key, expect=expect)
    for rpm, newton, expect in [("10", "2", "would come apart"), ("500", "0.02", CONVERGED)]:
        sets = ["response.points=", f"rotation.speed_rpm={rpm}", f"excitation.*.force_n={newton}"]
        meshed("the curve followed", f"rotation.speed_rpm={rpm}, {newton} N", *sets, expect=expect)

    cubes = os.path.join(ROOT, "meshes/blocks_order1.msh")
    table.cell("nine pairs", "two cubes", write(os.path.join(out, "blocks.toml"), BLOCKS_SCENE.format(mesh=cubes)))
    if shutil.which("gmsh"):
        two = ["mesh.parameters={nu=2,nv=2,order=1}", *READY[1:]]
        table.cell("flank of 2 x 2 nodes", "paper's blade", PAPER, two)
    else:
        print("gmsh is missing: the flank of 2 x 2 nodes is left out")

    for height in ["1", "1e-2", "3e-4", "1e-9"]:
        bad = os.path.join(out, f"flattened_{height}.msh")
        flattened(os.path.join(ROOT, "meshes/dovetail_order1.msh"), bad, float(height))
        expect = "flat.*Mesh.Optimize" if height == "1e-9" else CONVERGED
        meshed("height of one tetrahedron", height, expect=expect, mesh=[f"mesh.file={bad}", *READY[1:]])

    small = os.path.join(ROOT, "meshes/dovetail_small.msh")
    metres = os.path.join(out, "metres.msh")
    binary_nodes_changed(small, metres, lambda _, p: tuple(1e-3 * x for x in p))
    runs = [
        meshed("unit of the mesh", "mm", mesh=SMALL),
        meshed("unit of the mesh", "m", f"mesh.file={metres}", "mesh.metres_per_unit=1", mesh=SMALL),
    ]
    table.same("unit of the mesh", "mm and m", runs, 1e-6)

    # 100 MB to 6 GB, each level 7 % above the one before.
    levels_mb = [round(100 * 60 ** (step / 59)) for step in range(60)]
    for threads in [1, 2, 16]:
        sets = [*READY[:1], "response.points=3", *READY[2:]]
        table.memory("limit of memory", PAPER, sets, threads, levels_mb)

    lines = [origin.line(), "", "| what | value | how it ended |", "| --- | --- | --- |", *table.lines]
    write(os.path.join(out, "extremes.md"), "\n".join(lines) + "\n")
    print(f"{len(table.lines)} cells, {len(table.failures)} failed; table in {os.path.join(out, 'extremes.md')}")
    for failure in table.failures:
        print("FAILED " + failure)
    return 1 if table.failures else 0


if __name__ == "__main__":
    sys.exit(main())
