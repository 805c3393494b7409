"""What each strategy of a frequency takes and finds, from the log of the solver.

    RUST_LOG=dovetail::attempts=debug dovetail run SCENE 2> LOG
    python3 benches/truth/attempts.py LOG ...
    python3 benches/truth/attempts.py --models 200 --accuracy 0.01    random models of the truth campaign
    python3 benches/truth/attempts.py --models-in FOLDER              models as JSON files

The log has a line for each attempt: strategy, mean, frequency (Hz), harmonics, unknowns, Newton and Krylov iterations,
milliseconds, end. The table has a row for each strategy.
"""

import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[name] = "1"

HERE = pathlib.Path(__file__).parent
MARK = "dovetail::attempts] "


class Row:
    def __init__(self):
        self.tried = self.found = 0
        self.ms = self.lost_ms = 0.0
        self.of_found = []


def tally(lines, rows):
    """Adds the attempts of a log to the rows of their strategies. Those that did not apply are left out."""
    for line in lines:
        if MARK not in line:
            continue
        strategy, _, _, _, _, newton, krylov, ms, end = line.split(MARK, 1)[1].strip().split("|")
        if end.startswith("not tried") and int(newton) + int(krylov) == 0:
            continue
        row, is_found = rows[strategy], end == "Converged"
        row.tried += 1
        row.found += is_found
        row.ms += float(ms)
        row.lost_ms += 0 if is_found else float(ms)
        if is_found:
            row.of_found.append(int(newton))


def report(rows):
    total = sum(row.ms for row in rows.values()) or 1.0
    print("| strategy | tried | found a motion | Newton iterations of these, median, 95 % | share of the time | of it in vain |")
    print("| --- | --- | --- | --- | --- | --- |")
    for strategy, row in sorted(rows.items(), key=lambda item: -item[1].found):
        counts = sorted(row.of_found)
        quantiles = f"{counts[len(counts) // 2]}, {counts[int(0.95 * (len(counts) - 1))]}" if counts else ""
        print(f"| {strategy} | {row.tried} | {row.found} | {quantiles} | {100 * row.ms / total:.1f} % | {100 * row.lost_ms / total:.1f} % |")
    print(f"\n{total / 1e3:.1f} s of all attempts")


def log_of(model, arguments):
    """Log and answer of one model, solved in a process of its own."""
    task = json.dumps({"model": model, "accuracy": arguments.accuracy, "python": arguments.python})
    environment = {**os.environ, "RUST_LOG": "dovetail::attempts=debug"}
    ended = subprocess.run([sys.executable, str(HERE / "solve.py")], input=task, capture_output=True, text=True, env=environment)
    return ended.stderr.splitlines(), json.loads(ended.stdout) if ended.stdout else {}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="*", type=pathlib.Path)
    parser.add_argument("--models", type=int, default=0, help="number of random models to solve")
    parser.add_argument("--models-in", type=pathlib.Path, help="folder of models to solve")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first random model")
    parser.add_argument("--accuracy", type=float, default=0.01)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--python", default=str(HERE.parent.parent / "target" / "truth" / "python"), help="folder that contains the package dovetail")
    arguments = parser.parse_args()
    rows = collections.defaultdict(Row)
    for log in arguments.logs:
        tally(log.read_text(errors="replace").splitlines(), rows)
    tasks = []
    if arguments.models:
        import models

        tasks += [models.model(seed) for seed in range(arguments.seed, arguments.seed + arguments.models)]
    if arguments.models_in:
        tasks += [json.loads(path.read_text()) for path in sorted(arguments.models_in.glob("*.json"))]
    seconds, outcomes = [], collections.Counter()
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for model, (lines, answer) in zip(tasks, pool.map(lambda model: log_of(model, arguments), tasks)):
            tally(lines, rows)
            count = len(model["frequency_hz"])
            seconds += [answer.get("seconds", 0.0) / count] * count
            outcomes.update(point["outcome"] for point in answer.get("points", ()))
    report(rows)
    if seconds:
        seconds.sort()
        at = lambda share: seconds[int(share * (len(seconds) - 1))]
        print(f"{len(seconds)} frequencies: median {at(0.5):.3f} s, 90 % below {at(0.9):.2f} s, 99 % below {at(0.99):.2f} s, all below {at(1):.2f} s")
        print(", ".join(f"{outcome} {count}" for outcome, count in outcomes.most_common()))


if __name__ == "__main__":
    main()
