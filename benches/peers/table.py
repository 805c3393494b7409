"""The tables of compare.sh from its JSON files: table.py FOLDER ROUNDS HARMONICS..."""

import json
import statistics
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "scripts"))
import origin  # noqa: E402

# Largest relative difference of amplitudes that counts as agreement, all stopping at 1e-8 of |F|: of programs that evaluate
# the law at the same samples, and of dovetail, which follows it between them, with many samples.
AGREE = 1e-7
AGREE_BETWEEN = 1e-6

folder, rounds = Path(sys.argv[1]), int(sys.argv[2])


def points(name, harmonics):
    return [one(name, harmonics, i) for i in range(1, rounds + 1)]


def one(name, harmonics, which):
    with open(folder / f"{name}-{harmonics}-{which}.json") as file:
        return json.load(file)["points"]


def per_point(runs, key):
    """Median over the rounds of the mean over the points."""
    return statistics.median(statistics.mean(p[key] for p in run) for run in runs)


def farthest(a, b):
    return max(abs(x["tip_m"] / y["tip_m"] - 1) for x, y in zip(a, b, strict=True))


failures = []
print(origin.line() + "\n")
print("| H | program | processor s a frequency | wall s a frequency | ratio | converged | largest residual |")
print("| --- | --- | --- | --- | --- | --- | --- |")
details = []
for harmonics in sys.argv[3:]:
    own, dense = points("dovetail", harmonics), points("numpy", harmonics)
    solved, pyharm = points("periodic", harmonics), points("pyharm", harmonics)
    peers = {
        "dovetail": own,
        "numpy, dense Newton, until periodic": solved,
        "numpy, dense Newton, three periods": dense,
        "pyHarm, three periods": pyharm,
    }
    base = per_point(own, "processor_s")
    for name, runs in peers.items():
        seconds, wall = per_point(runs, "processor_s"), per_point(runs, "seconds")
        done = sum(p["converged"] for p in runs[0])
        worst = max(p["residual"] for p in runs[0])
        print(f"| {harmonics} | {name} | {seconds:.3f} | {wall:.3f} | {seconds / base:.1f} | {done} of {len(runs[0])} | {worst:.0e} |")
    columns = [own[0], solved[0], pyharm[0], dense[0]]
    for p, q, r, s in zip(*columns, strict=True):
        details.append(
            f"| {harmonics} | {p['hz']:.3f} | {p['slipping']}, {p['opening']} | "
            + " | ".join(f"{x['tip_m']:.9e}" for x in (p, q, r, s))
            + " |"
        )
    fine = [one(name, harmonics, "fine") for name in ("dovetail", "periodic")]
    for what, a, b, agree in [
        ("dovetail and numpy marched until periodic, 128 samples", own[0], solved[0], 1e-4),
        ("dovetail and numpy marched until periodic, 2048 samples", *fine, AGREE_BETWEEN),
        ("pyHarm and numpy marched three periods", pyharm[0], dense[0], AGREE),
    ]:
        apart = farthest(a, b)
        details.append((harmonics, what, apart))
        if not apart < agree or not all(x["converged"] for x in a + b):
            failures.append(f"{what}, H = {harmonics}: {apart:.1e} apart, or not converged")
print("\n| H | Hz | pairs that slip, open at times | dovetail, m | numpy until periodic, m | pyHarm, m | numpy three periods, m |")
print("| --- | --- | --- | --- | --- | --- | --- |")
print("\n".join(line for line in details if isinstance(line, str)))
print()
for harmonics, what, apart in (line for line in details if not isinstance(line, str)):
    print(f"H = {harmonics}: {what}: amplitudes at most {apart:.1e} apart")
sys.exit("\n".join(failures) or 0)
